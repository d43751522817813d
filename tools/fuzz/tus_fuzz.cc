// SPDX-License-Identifier: Apache-2.0
// Photos that arrive in parts: a sequence of messages of the tus protocol, to a real engine. Beside
// it the target keeps account of what must be there: after each message the upload that it was
// about has just the bytes that were taken of it.
// An input is a sequence of messages. Each has two bytes, the kind and the marks (enum Mark), and
// then, by its kind,
//   0, 4  a new upload: its length (2 bytes, the lower one first), the size of its first part (1)
//   1, 5, 6  a part: of which upload (1), how far its offset is off (1, signed), its size (2; 0
//         stands for all that is left)
//   2  a question: about which upload (1)
//   3  giving up: which upload (1)
//   7  what the protocol has here: nothing
// and at last, where it is marked so, a header that is something else than it should be: which one
// (1), the length of the text (1) and the text.
#include <sodium.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <thread>

#include "cli/service/photo_intake.h"
#include "cli/service/quotas.h"
#include "cli/service/tus_message.h"
#include "cli/service/tus_uploads.h"
#include "engine/engine.h"
#include "engine/parts.h"
#include "storage/base/content_hash.h"
#include "tools/fuzz/city_folder.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {
namespace {

// What a message may be besides its kind.
enum Mark : uint8_t {
  kWhoMask = 3,  // 0: somebody without a token; 1, 2: the owners of two; 3: the database's owner
  kWithSum = 4,
  kWithWrongSum = 8,
  kWithOddHeader = 16,
  kOfContribution = 32,
  kUnderName = 64,  // of another one
  kByUnknownCamera = 128,
};

constexpr uint64_t kLengthMax = 50'000;
// Of each token: so few that inputs use them up.
constexpr TokenQuota kQuota = {8, 200'000, 0};
// Inputs after which the next one has an empty database. Chosen by hand: what few leave behind
// slows nothing down.
constexpr int kInputsOfOne = 2'000;
// Looks, a millisecond each, at whether all photos were judged: longer than that takes.
constexpr int kLooks = 20'000;

class City final {
 public:
  City() : engine_(folder_.MakeCity()) {
    CameraModel camera;
    camera.width_px = 160;
    camera.height_px = 120;
    camera.fx = camera.fy = 150;
    camera.cx = camera.u0 = 80;
    camera.cy = camera.v0 = 60;
    Expect(engine_->AddCamera("street", camera, "the target").status(), "a camera can be added");
    ContributionRequest walk;
    walk.contributor = walk.actor = "anna";
    Expect(engine_->OpenContribution(walk).status(), "a contribution can be opened");
  }

  Engine& engine() { return *engine_; }
  PhotoIntake& intake() { return intake_; }
  // Nothing is judged meanwhile, so that all that has arrived can be looked at.
  Writer::Turn Hold() { return EngineParts::Of(*engine_).writer->Take(); }

 private:
  const CityFolder folder_{"tus"};
  PhotoIntake intake_{{.photos_max = 16},
                      [](uint64_t, const std::string&, const Result<AddOutcome>&) {}};
  std::unique_ptr<Engine> engine_;
};

// The input from where it was read to. 0 and nothing after its end.
class Reader final {
 public:
  explicit Reader(std::span<const uint8_t> bytes) : bytes_(bytes) {}
  bool is_at_end() const { return bytes_.empty(); }
  uint8_t Byte() {
    if (bytes_.empty()) return 0;
    const uint8_t byte = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return byte;
  }
  uint32_t Short() {
    const uint32_t low = Byte();
    return low + 256u * Byte();
  }
  std::string Text(size_t size) {
    const auto part = bytes_.first(std::min(size, bytes_.size()));
    bytes_ = bytes_.subspan(part.size());
    return {part.begin(), part.end()};
  }

 private:
  std::span<const uint8_t> bytes_;
};

// What must be there of an upload.
struct Upload {
  std::string id;
  uint32_t token = 0;
  uint64_t length = 0;
  std::vector<uint8_t> bytes = {};
  uint64_t number = 0;     // in line, once it has arrived
  bool is_gone = false;    // it was given up
  bool is_counted = true;  // in the quota of its token
};

class Client final {
 public:
  explicit Client(City* city) : city_(*city) {}

  void Do(Reader* input) {
    const uint8_t kind = input->Byte() & 7, marks = input->Byte();
    HttpRequest request = RequestBy(marks);
    if (kind == 0 || kind == 4) {
      Begin(marks, input, std::move(request));
    } else if (kind == 2 || kind == 3) {
      AskOrGiveUp(kind == 3, marks, input, std::move(request));
    } else if (kind == 7) {
      SetOddHeader(marks, input, &request);
      Expect(Ask("OPTIONS", "", std::move(request)).code == 204, "the protocol is told to anybody");
    } else {
      Continue(marks, input, std::move(request));
    }
  }

  // Those that have arrived have the bytes that were sent; what is given up leaves nothing behind.
  void End() {
    CheckArrived();
    for (Upload& upload : uploads_) {
      if (!upload.is_gone) GiveUp(RequestBy(static_cast<uint8_t>(upload.token)), &upload);
    }
    const Result<size_t> left =
        city_.engine().AbandonUploadsBefore(std::numeric_limits<int64_t>::max());
    Expect(left.ok() && *left == 0, "nothing is on its way that the target does not know of");
    for (const uint32_t token : {1u, 2u}) CheckQuota(token);
  }

 private:
  static HttpRequest RequestBy(uint8_t marks) {
    HttpRequest request;
    const uint32_t who = marks & kWhoMask;
    request.is_of_owner = who == 3;
    if (who == 1 || who == 2) {
      request.token_number = who;
      request.who = who == 1 ? "anna" : "ben";
      request.quota = kQuota;
      request.may_name_others = false;
    }
    request.headers["Tus-Resumable"] = kTusVersion;
    return request;
  }

  static void SetOddHeader(uint8_t marks, Reader* input, HttpRequest* request) {
    if ((marks & kWithOddHeader) == 0) return;
    const auto names = HeadersOfRoutes();
    const std::string name = names[input->Byte() % names.size()];
    request->headers[name] = input->Text(input->Byte());
    if (name == "Content-Type") request->content_type = MediaType(request->headers[name]);
  }

  // Other bytes for each part.
  std::vector<uint8_t> Part(uint64_t size) {
    std::vector<uint8_t> bytes(size);
    for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random_.Next());
    return bytes;
  }

  static void SetBody(uint8_t marks, std::vector<uint8_t> body, HttpRequest* request) {
    request->content_type = kTusContentType;
    if ((marks & (kWithSum | kWithWrongSum)) != 0) {
      ContentHash sum = HashContent(body);
      if ((marks & kWithWrongSum) != 0) sum.bytes[0] ^= 1;
      char text[64];
      sodium_bin2base64(text, sizeof(text), sum.bytes.data(), sum.bytes.size(),
                        sodium_base64_VARIANT_ORIGINAL);
      request->headers["Upload-Checksum"] = std::string("sha256 ") + text;
    }
    request->body = std::move(body);
  }

  HttpAnswer Ask(const std::string& method, const std::string& id, HttpRequest request) {
    request.method = method;
    request.path = {"v1", "tus"};
    if (!id.empty()) request.path.push_back(id);
    HttpAnswer answer = tus_.Answer(&city_.engine(), request);
    Expect(answer.code >= 200 && answer.code < 500, "no message makes the daemon fail");
    Expect(answer.code < 400 || answer.content_type == "application/problem+json",
           "every failure is a problem as RFC 9457 has it");
    return answer;
  }

  void Begin(uint8_t marks, Reader* input, HttpRequest request) {
    const uint64_t length = input->Short();
    const std::vector<uint8_t> part = Part(input->Byte());
    request.headers["Upload-Length"] = std::to_string(length);
    std::string metadata = "filename YS5qcGc=,camera ";                     // a.jpg
    metadata += (marks & kByUnknownCamera) != 0 ? "bm9uZQ==" : "c3RyZWV0";  // none, street
    if ((marks & kOfContribution) != 0) metadata += ",contribution MQ==";   // 1
    if ((marks & kUnderName) != 0) metadata += ",contributor YmVu";         // ben
    request.headers["Upload-Metadata"] = metadata;
    if (!part.empty()) SetBody(marks, part, &request);
    SetOddHeader(marks, input, &request);
    const uint32_t token = request.token_number;
    const HttpAnswer answer = Ask("POST", "", std::move(request));
    const bool is_sound = (marks & ~(kWhoMask | kWithSum | kWithWrongSum)) == 0 && length > 0 &&
                          length <= kLengthMax && part.size() <= length;
    Expect(!is_sound || answer.code == 201 || answer.code == 429, "a sound upload is taken");
    if (answer.code != 201) return;
    const std::string where = HeaderOf(answer, "Location");
    Expect(where.starts_with("/v1/tus/"), "an upload has an address");
    Upload upload{where.substr(8), token, length};
    const auto is_same = [&](const Upload& other) { return other.id == upload.id; };
    Expect(std::ranges::none_of(uploads_, is_same), "no upload has the address of another one");
    const HttpAnswer told = Tell(upload);
    upload.length = NumberOf(told, "Upload-Length");
    const bool is_odd = (marks & kWithOddHeader) != 0;
    Expect(is_odd || upload.length == length, "an upload has the length that was announced");
    Expect(upload.length > 0 && upload.length <= kLengthMax, "no upload is too long");
    const bool is_taken = NumberOf(answer, "Upload-Offset") != 0;
    Expect(is_odd || is_taken == (!part.empty() && (marks & kWithWrongSum) == 0),
           "the first part is taken unless its sum is wrong");
    Take(is_taken ? part : std::vector<uint8_t>(), answer, &upload);
    uploads_.push_back(std::move(upload));
  }

  void Continue(uint8_t marks, Reader* input, HttpRequest request) {
    Upload* const upload = Find(input->Byte());
    const auto off = static_cast<int8_t>(input->Byte());
    uint64_t size = input->Short();
    const uint64_t so_far = upload == nullptr ? 0 : upload->bytes.size();
    const uint64_t left = upload == nullptr ? 0 : upload->length - so_far;
    if (size == 0) size = left;
    const std::vector<uint8_t> part = Part(size);
    request.headers["Upload-Offset"] = std::to_string(so_far + static_cast<uint64_t>(off));
    SetBody(marks, part, &request);
    SetOddHeader(marks, input, &request);
    const bool is_allowed = upload != nullptr && MayAsk(request, *upload);
    const bool is_sound =
        is_allowed && off == 0 && size <= left && (marks & (kWithWrongSum | kWithOddHeader)) == 0;
    const HttpAnswer answer =
        Ask("PATCH", upload == nullptr ? "none" : upload->id, std::move(request));
    Expect((answer.code == 204) == is_sound || (marks & kWithOddHeader) != 0,
           "a part is taken where it is sound, and only there");
    if (upload == nullptr) return;
    if (answer.code == 204) {
      Expect(is_allowed, "nobody goes on with what is not theirs");
      Take(part, answer, upload);
    }
    CheckOffset(*upload);
  }

  void AskOrGiveUp(bool gives_up, uint8_t marks, Reader* input, HttpRequest request) {
    Upload* const upload = Find(input->Byte());
    SetOddHeader(marks, input, &request);
    const bool is_odd = (marks & kWithOddHeader) != 0;
    if (upload != nullptr && gives_up && !is_odd) return GiveUp(std::move(request), upload);
    const bool is_allowed = upload != nullptr && MayAsk(request, *upload);
    const HttpAnswer answer = Ask("GET", upload == nullptr ? "none" : upload->id, request);
    Expect((answer.code == 200) == is_allowed || is_odd,
           "an upload is told to whom it belongs, and only to them");
    if (answer.code == 200) {
      Expect(NumberOf(answer, "Upload-Offset") == upload->bytes.size() &&
                 NumberOf(answer, "Upload-Length") == upload->length,
             "an upload is told as far as it has come");
    }
  }

  void GiveUp(HttpRequest request, Upload* upload) {
    const bool is_allowed = MayAsk(request, *upload);
    // What waits in line was sent, and the owner of the database has no quota to give it back to.
    const bool gives_back = upload->number == 0 && upload->token == request.token_number;
    const HttpAnswer answer = Ask("DELETE", upload->id, std::move(request));
    Expect((answer.code == 204) == is_allowed, "an upload is given up by whom it belongs to");
    if (answer.code != 204) return;
    upload->is_gone = true;
    if (gives_back) upload->is_counted = false;
    HttpRequest owner = RequestBy(3);
    Expect(Ask("GET", upload->id, std::move(owner)).code == 404, "what is given up is gone");
  }

  // The upload has these bytes, too, from now on.
  void Take(const std::vector<uint8_t>& part, const HttpAnswer& answer, Upload* upload) {
    upload->bytes.insert(upload->bytes.end(), part.begin(), part.end());
    Expect(upload->bytes.size() <= upload->length, "no upload passes its length");
    Expect(NumberOf(answer, "Upload-Offset") == upload->bytes.size(),
           "a part is taken whole or not at all");
    if (upload->bytes.size() < upload->length || upload->number != 0) return;
    const auto arrived = city_.engine().Ask().PartialUpload(upload->id);
    Expect(arrived.ok() && arrived->upload != 0, "what has arrived is in line");
    upload->number = arrived->upload;
  }

  static bool MayAsk(const HttpRequest& request, const Upload& upload) {
    return !upload.is_gone && (request.is_of_owner || request.token_number == upload.token);
  }
  // Null for one that there is not.
  Upload* Find(uint8_t index) { return index < uploads_.size() ? &uploads_[index] : nullptr; }

  HttpAnswer Tell(const Upload& upload) {
    HttpAnswer told = Ask("GET", upload.id, RequestBy(3));
    Expect(told.code == (upload.is_gone ? 404u : 200u), "an upload is there until it is given up");
    return told;
  }
  void CheckOffset(const Upload& upload) {
    const HttpAnswer told = Tell(upload);
    if (upload.is_gone) return;
    Expect(NumberOf(told, "Upload-Offset") == upload.bytes.size(),
           "an upload has the bytes that were taken");
  }
  static uint64_t NumberOf(const HttpAnswer& answer, const std::string& header) {
    const std::string text = HeaderOf(answer, header);
    Expect(!text.empty(), "an answer has the headers of the protocol");
    return std::stoull(text);
  }

  void CheckArrived() {
    const auto waiting = city_.engine().Ask().Uploads();
    Expect(waiting.status(), "what waits can be told");
    size_t count = 0;
    for (const Upload& upload : uploads_) {
      if (upload.number == 0) continue;
      ++count;
      const auto found = std::ranges::find(*waiting, upload.number, &UploadAnswer::number);
      Expect(found != waiting->end(), "what has arrived waits for its turn");
      Expect(found->size_bytes == upload.length && found->photo == HashContent(upload.bytes).Hex(),
             "what has arrived has the bytes that were sent");
    }
    Expect(waiting->size() == count, "nothing waits that has not arrived");
  }

  void CheckQuota(uint32_t token) {
    double photos = 0, bytes = 0;
    for (const Upload& upload : uploads_) {
      if (upload.token != token || !upload.is_counted) continue;
      ++photos;
      bytes += static_cast<double>(upload.length);
    }
    // Of what is given up a second later, a day's second is not given back: for an hour's input.
    constexpr double kShare = 3600.0 / 86'400;
    Expect(std::abs(used_[token].photos - photos) <= kShare * kQuota.photos_per_day &&
               std::abs(used_[token].bytes - bytes) <= kShare * kQuota.bytes_per_day,
           "what is given up counts in no quota");
  }

  City& city_;
  SeededRandom random_{1};
  std::vector<Upload> uploads_;
  std::map<uint32_t, TokenUse> used_;
  // Its clocks stand still, so that nothing is given back but what is given up.
  Quotas quotas_{TokenQuota{8, 200'000, 1},
                 {.now = [] { return Quotas::Clock::time_point(); },
                  .unix_ms = [] { return int64_t{0}; },
                  .keep = [this](const TokenUse& use) { used_[use.token] = use; }}};
  TusUploads tus_{{.limits = {}, .length_bytes_max = kLengthMax}, &city_.intake(), &quotas_};
};

// Whether every photo was judged, or waits for its camera.
bool IsAtRest(City* city) {
  const PhotoIntake::Counts counts = city->intake().counts();
  const auto waiting = city->engine().Ask().Uploads();
  Expect(waiting.status(), "what waits can be told");
  return counts.waiting == counts.awaiting_camera && waiting->size() == counts.waiting;
}

void AwaitRest(City* city) {
  for (int i = 0; i < kLooks; ++i) {
    if (IsAtRest(city)) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  Expect(false, "every photo that has arrived is judged, and leaves nothing behind");
}

void CheckSound(City* city) {
  const auto violations = city->engine().Ask().Verify({});
  Expect(violations.status(), "the database can be checked");
  for (const std::string& one : *violations) std::fprintf(stderr, "%s\n", one.c_str());
  Expect(violations->empty(), "the database is sound");
}

// The city of an input. The first one is made when this is: CityFolder::MakeCity.
class Cities final {
 public:
  Cities() { Renew(); }
  City& Next() {
    if (++inputs_ > kInputsOfOne) Renew();
    return *city_;
  }
  void Renew() {
    city_.emplace();
    inputs_ = 0;
  }

 private:
  std::optional<City> city_;
  int inputs_ = 0;
};

}  // namespace

std::vector<std::string> Seeds() {
  using namespace std::string_literals;
  const std::string begin = "\0\1\12\0\0"s;  // 10 bytes, by the first token
  return {
      begin + "\1\1\0\0\4\0"s + "\1\1\0\0\0\0"s,                              // two parts
      begin + "\2\1\0"s + "\3\1\0"s + "\2\1\0"s,                              // given up
      "\0\0\12\0\3"s + "\1\4\0\0\2\0"s + "\1\10\0\0\2\0"s + "\1\0\0\0\0\0"s,  // sums
      "\0\1\12\0\12"s + "\1\1\0\0\1\0"s + "\3\1\0"s,  // all in the first message
      begin + "\1\1\0\1\2\0"s + "\1\1\0\377\2\0"s + "\1\1\0\0\377\377"s,  // wrong offsets and sizes
      begin + "\1\2\0\0\1\0"s + "\3\2\0"s + "\3\3\0"s,                    // of somebody else
      "\0\40\12\0\2"s + "\0\140\12\0\2"s + "\0\200\12\0\0"s + "\0\101\12\0\0"s,
      begin + begin + begin + begin + begin + begin + begin + begin + begin,
      "\0\20\12\0\0\1\3"
      "007"s +
          "\1\20\0\0\2\0\2\1"
          "0"s +
          "\7\0"s +
          "\2\20\0\0\3"
          "0.2"s,
      "\0\21\12\0\0\5\0"s + "\0\21\12\0\0\6\0"s +
          "\0\20\12\0\0\3\20"
          "filename YS5qcGc="s,
  };
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace veduta::fuzz;
  static Cities cities;
  City& city = cities.Next();
  {
    const auto turn = city.Hold();
    Client client(&city);
    Reader input({data, size});
    while (!input.is_at_end()) client.Do(&input);
    client.End();
  }
  AwaitRest(&city);
  CheckSound(&city);
  // Those whose camera cannot be told would wait on.
  if (city.intake().counts().waiting > 0) cities.Renew();
  return 0;
}
