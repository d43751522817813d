// SPDX-License-Identifier: Apache-2.0
// A connection of the daemon's HTTP: the bytes that a client sends, from the first on, and what is
// answered. Two daemons are real, each on a database of its own that is empty at first: nobody has
// a token of the one, so that whoever reaches it may do anything but what is the owner's; the other
// one asks for tokens. An odd first byte of the input stands for the latter. In the rest of it
// {admin}, {contributor}, {viewer} and {link} stand for tokens, and {upload} for the id of the
// upload in parts that was begun last over the connection: no input can have these, since the
// daemons draw them.
// The socket of the owner is left out: its commands write to whatever folder they are told.
#include <chrono>
#include <ctime>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "cli/service/city_service.h"
#include "cli/service/http_door.h"
#include "tools/fuzz/city_folder.h"
#include "tools/fuzz/fuzz_target.h"
#include "tools/fuzz/http_answers.h"
#include "tools/fuzz/http_client.h"
#include "tools/fuzz/http_seeds.h"

namespace veduta::fuzz {
namespace {

// Photos that may wait: chosen by hand, so that nobody waits long for the answer to another one,
// and a run does not fill the disk.
constexpr uint32_t kPhotosMax = 4;
// Of bodies on their way, and of answers: so little that one request of our own takes all of it.
constexpr uint64_t kBodiesBytes = 128 << 10, kAnswersBytes = (64 << 10) + 1;
constexpr uint32_t kConnectionsMax = 64;
// After so many inputs it is looked whether all of that is free again, and after so many the daemon
// begins anew with an empty database. Chosen by hand: looking costs as much as an input, and what
// few inputs leave behind slows nothing down.
constexpr int kInputsBeforeLook = 16, kInputsOfOne = 500;
// Looks, a millisecond each, at what is free: longer than anything takes.
constexpr int kLooks = 20'000;
// Ids that an input gets: each waits for the answers before it.
constexpr int kUploadsMax = 8;

void Replace(const std::string& what, const std::string& by, std::string* text) {
  for (size_t at = text->find(what); at != text->npos; at = text->find(what, at + by.size()))
    text->replace(at, what.size(), by);
}

class Daemon final {
 public:
  explicit Daemon(bool asks_for_tokens) {
    auto engine = folder_.MakeCity();
    if (asks_for_tokens) MakeTokens(engine.get());
    ServiceOptions options;
    options.intake.photos_max = kPhotosMax;
    service_ = std::make_unique<CityService>(std::move(engine), folder_.database(), options,
                                             CityService::Listeners());
    door_.address = "127.0.0.1:0";
    door_.body_bytes_max = door_.bodies_bytes_max = kBodiesBytes;
    door_.answers_bytes_max = kAnswersBytes;
    door_.connections_max = kConnectionsMax;
    door_.threads = 1;
    std::promise<std::string> address;
    serving_ = std::jthread([&](std::stop_token stop) {
      Expect(ServeHttp(service_.get(), door_, std::move(stop),
                       [&](const std::string& told) { address.set_value(told); }),
             "the daemon serves until it is stopped");
    });
    const std::string told = address.get_future().get();
    port_ = static_cast<uint16_t>(NumberIn(std::string_view(told).substr(told.rfind(':') + 1)));
  }

  void Serve(std::string text) {
    for (const auto& [name, token] : tokens_) Replace(name, token, &text);
    HttpClient client(port_);
    SayAll(text, &client);
    client.Finish();
    if (!client.was_cut()) CheckAnswers(client.received());
    if (++inputs_ % kInputsBeforeLook == 0) Look();
  }
  bool is_old() const { return inputs_ >= kInputsOfOne; }

 private:
  void MakeTokens(Engine* engine) {
    const auto add = [&](const std::string& name, Role role, bool is_link) {
      TokenRequest request;
      request.name = name;
      request.role = role;
      request.is_link = is_link;
      if (is_link) request.expires_unix_s = std::time(nullptr) + 1'000'000;
      const Result<NewToken> made = engine->CreateToken(request);
      Expect(made.status(), "a token can be made");
      tokens_.emplace_back("{" + name + "}", made->text);
    };
    add("admin", Role::kAdmin, false);
    add("contributor", Role::kContributor, false);
    add("viewer", Role::kViewer, false);
    add("link", Role::kViewer, true);
  }

  static void SayAll(const std::string& text, HttpClient* client) {
    static const std::string kUpload = "{upload}", kTus = "/v1/tus/";
    size_t said = 0;
    for (int i = 0; i < kUploadsMax; ++i) {
      const size_t at = text.find(kUpload, said);
      if (at == text.npos) break;
      client->Send(std::string_view(text).substr(said, at - said));
      client->Await(HttpClient::CountOf(std::string_view(text).substr(0, at)));
      const size_t begun = client->received().rfind("\r\nLocation: " + kTus);
      // A copy, for sending receives.
      if (begun != text.npos)
        client->Send(std::string(client->received()).substr(begun + 12 + kTus.size(), 32));
      said = at + kUpload.size();
    }
    client->Send(std::string_view(text).substr(said));
    client->Await(HttpClient::CountOf(text));
  }

  std::string AnswerTo(const std::string& request) const {
    HttpClient client(port_);
    client.Send(request);
    client.Await(1);
    client.Finish();
    return client.received();
  }

  // A body that takes all the memory for bodies is read, and refused by who has read it, and an
  // answer that takes all the memory for answers is sent: so nothing of either is still taken.
  void Look() {
    const std::string token = tokens_.empty() ? "" : tokens_.front().second;
    const std::string body =
        RequestOf("POST", "/v1/cameras", token, "Content-Type: application/json\r\n",
                  std::string(kBodiesBytes, ' '));
    const std::string page = RequestOf("GET", "/page.js", token);
    for (int i = 0; i < kLooks; ++i) {
      const uint64_t code = CodeOf(AnswerTo(body));
      if (code == 401) inputs_ = kInputsOfOne;  // an input has revoked the token
      if ((code == 400 || code == 401) && CodeOf(AnswerTo(page)) == 200) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    Expect(false, "what a connection held is given back");
  }

  const CityFolder folder_{"http"};
  std::unique_ptr<CityService> service_;
  HttpDoorOptions door_;
  std::vector<std::pair<std::string, std::string>> tokens_;  // what stands for each, and itself
  uint16_t port_ = 0;
  int inputs_ = 0;
  std::jthread serving_;
};

// Without tokens, and with them.
class Daemons final {
 public:
  // Both are made at once: CityFolder::MakeCity.
  Daemons() {
    for (const bool asks : {false, true}) daemons_[asks ? 1 : 0].emplace(asks);
  }
  Daemon& Of(bool asks_for_tokens) {
    std::optional<Daemon>& daemon = daemons_[asks_for_tokens ? 1 : 0];
    if (daemon->is_old()) daemon.emplace(asks_for_tokens);
    return *daemon;
  }

 private:
  std::optional<Daemon> daemons_[2];
};

}  // namespace

std::vector<std::string> Seeds() {
  return HttpSeeds();
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static veduta::fuzz::Daemons daemons;
  if (size == 0) return 0;
  daemons.Of((data[0] & 1) != 0).Serve(std::string(veduta::fuzz::Text(data + 1, size - 1)));
  return 0;
}
