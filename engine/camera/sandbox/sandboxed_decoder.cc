// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/sandbox/sandboxed_decoder.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <optional>
#include <system_error>

namespace veduta {
namespace {

// What decoding may take. Sound photos take a tenth of it at most: a HEIC of 12 Mpx that is full of
// noise took 4.0 s on a 2-core machine, and PNG, the slowest of the others, 0.6 s. Besides the 16
// bytes for each pixel that DecodeLimits tells there is room for a HEIC that shows a part of a
// larger picture; chosen by hand.
constexpr uint32_t kCpuBaseS = 20, kPixelsPerCpuS = 500'000;
constexpr uint64_t kMemoryBaseBytes = 1ull << 30, kBytesPerPixel = 16;
// By the clock of the wall, for machines that have other things to do.
constexpr uint32_t kWallFactor = 4;

constexpr const char* kWhatToDo =
    "; the file is damaged, or made to do harm: open it in another program and save it as a JPEG";

void Limit(uint64_t pixel_count, DecoderRequest* request) {
  request->cpu_s = kCpuBaseS + static_cast<uint32_t>(pixel_count / kPixelsPerCpuS);
  request->wall_s = kWallFactor * request->cpu_s;
  request->memory_bytes = kMemoryBaseBytes + kBytesPerPixel * pixel_count;
}

// An end for taking too long comes from the decoder process itself.
bool WasKilledByOthers(const DecoderEnd& end) {
  return end.is_overdue == 0 && WIFSIGNALED(end.wait_status) &&
         WTERMSIG(end.wait_status) == SIGKILL;
}

std::string SignalText(int signal) {
  const char* const name = sigabbrev_np(signal);
  return name == nullptr ? "signal " + std::to_string(signal) : std::string("SIG") + name;
}

// Why a photo is refused on which its process ended so.
std::string DeathText(const DecoderEnd& end, const DecoderRequest& request) {
  const int signal = WIFSIGNALED(end.wait_status) ? WTERMSIG(end.wait_status) : 0;
  std::string text = "the decoder died on the photo";
  if (end.is_overdue != 0) {
    text += " (it took longer than " + std::to_string(request.wall_s) + " s)";
  } else if (signal == SIGXCPU) {
    text += " (it took more than " + std::to_string(request.cpu_s) + " s of the processor)";
  } else if (signal == SIGSYS) {
    text += " (it tried to reach beyond its process)";
  } else if (signal != 0) {
    text += " (" + SignalText(signal) + ")";
  } else {
    text += " (exit code " + std::to_string(WEXITSTATUS(end.wait_status)) + ")";
  }
  return text + kWhatToDo;
}

// A shortage of memory is the photo's, for taking more than any of its size may, unless the program
// itself has a limit of memory, which its processes have then, too.
bool HasOwnLimit() {
  rlimit addresses{};
  return getrlimit(RLIMIT_AS, &addresses) == 0 && addresses.rlim_cur != RLIM_INFINITY;
}

std::string TooMuchText(const DecoderRequest& request) {
  return "the decoder took more than the " + std::to_string(request.memory_bytes >> 20) +
         " MiB that a photo of this size may" + kWhatToDo;
}

std::string NonsenseText() {
  return std::string("the decoder gave an answer that no sound photo makes it give") + kWhatToDo;
}

PhotoExamination Unexamined(HeaderOutcome outcome, std::string why) {
  PhotoExamination found;
  found.header.outcome = outcome;
  found.header.detail = std::move(why);
  return found;
}

}  // namespace

Result<std::shared_ptr<const SandboxedDecoder>> SandboxedDecoder::Start(
    const std::string& program) {
  Descriptor opened(open(program.c_str(), O_PATH | O_CLOEXEC));
  if (opened.number() < 0) {
    return Status::IoError("cannot open " + program + ": " +
                           std::generic_category().message(errno) +
                           "; it is installed with veduta (--decoders in-process does without)");
  }
  std::shared_ptr<SandboxedDecoder> decoder(new SandboxedDecoder(std::move(opened)));
  Result<std::unique_ptr<DecoderConnection>> first = decoder->Take();
  if (!first.ok()) {
    return Status::IoError(first.status().message() +
                           "; photos of people whom you trust can be decoded without it "
                           "(--decoders in-process)");
  }
  decoder->GiveBack(*std::move(first));
  return std::shared_ptr<const SandboxedDecoder>(std::move(decoder));
}

Result<std::unique_ptr<DecoderConnection>> SandboxedDecoder::Take() const {
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::ranges::find(waiting_, NicenessOfThread(), [](const auto& connection) {
      return connection->niceness();
    });
    if (found != waiting_.end()) {
      std::unique_ptr<DecoderConnection> taken = std::move(*found);
      waiting_.erase(found);
      return taken;
    }
  }
  return DecoderConnection::Start(program_.number());
}

void SandboxedDecoder::GiveBack(std::unique_ptr<DecoderConnection> connection) const {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(connection));
}

Result<DecoderEnd> SandboxedDecoder::Run(const DecoderRequest& request, int photo,
                                         int answer) const {
  VEDUTA_ASSIGN_OR_RETURN(std::unique_ptr<DecoderConnection> connection, Take());
  Status why;
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (!connection) {
      VEDUTA_ASSIGN_OR_RETURN(connection, DecoderConnection::Start(program_.number()));
    }
    const std::optional<DecoderEnd> end = connection->Ask(request, photo, answer);
    if (end && end->is_started == 1 && !WasKilledByOthers(*end)) {
      GiveBack(std::move(connection));
      return *end;
    }
    if (!end) connection.reset();
    if (!end || end->is_started == 1) ++killed_;
    why = Status::NoMemory(
        end && end->is_started == 0
            ? "no process can be started to decode the photo"
            : "the process that decodes the photo was killed, as the system does where memory is "
              "short");
  }
  if (connection) GiveBack(std::move(connection));
  return why;
}

SandboxedDecoder::Asked SandboxedDecoder::Ask(DecoderRequest request,
                                              std::span<const uint8_t> photo) const {
  const auto not_done = [](const Status& why) {
    return Asked{Fate::kNotDone, why.message(), {}, {}};
  };
  const Result<Descriptor> bytes = ShareForReading(photo);
  if (!bytes.ok()) return not_done(bytes.status());
  const Result<Descriptor> room = ShareForWriting(request.answer_bytes);
  if (!room.ok()) return not_done(room.status());
  request.photo_bytes = photo.size();
  const Result<DecoderEnd> end = Run(request, bytes->number(), room->number());
  if (!end.ok()) return not_done(end.status());
  if (!WIFEXITED(end->wait_status) || WEXITSTATUS(end->wait_status) != 0) {
    ++died_;
    return {Fate::kDied, DeathText(*end, request), {}, {}};
  }
  Result<MappedMemory> memory =
      MappedMemory::Map(room->number(), request.answer_bytes, MappedMemory::Access::kRead);
  if (!memory.ok()) return not_done(memory.status());
  Asked asked{Fate::kAnswered, {}, {}, *std::move(memory)};
  std::memcpy(&asked.answer, asked.memory->data(), sizeof(asked.answer));
  return asked;
}

PhotoExamination SandboxedDecoder::Examine(std::span<const uint8_t> bytes) const {
  if (bytes.empty()) return DecoderInProcess().Examine(bytes);  // there is nothing to share
  DecoderRequest request;
  request.task = DecodeTask::kExamine;
  request.answer_bytes = kPixelsOffset;
  Limit(0, &request);
  const Asked asked = Ask(request, bytes);
  if (asked.fate == Fate::kNotDone) return Unexamined(HeaderOutcome::kNoMemory, asked.why_not);
  if (asked.fate == Fate::kDied) return Unexamined(HeaderOutcome::kUnreadable, asked.why_not);
  std::optional<PhotoExamination> found = ReadExamination(asked.answer);
  if (!found) return Unexamined(HeaderOutcome::kUnreadable, NonsenseText());
  if (found->header.outcome == HeaderOutcome::kNoMemory && !HasOwnLimit())
    return Unexamined(HeaderOutcome::kUnreadable, TooMuchText(request));
  return *std::move(found);
}

Pixels SandboxedDecoder::DecodePixels(std::span<const uint8_t> bytes,
                                      const PhotoHeader& header) const {
  const uint64_t pixel_count = header.stored_size.pixel_count();
  DecoderRequest request;
  request.task = DecodeTask::kDecodePixels;
  request.width_px = header.stored_size.width_px;
  request.height_px = header.stored_size.height_px;
  request.answer_bytes = kPixelsOffset + 3 * pixel_count;
  Limit(pixel_count, &request);
  const Asked asked = Ask(request, bytes);
  if (asked.fate == Fate::kNotDone) return {PixelOutcome::kNoMemory, asked.why_not, {}};
  if (asked.fate == Fate::kDied) return {PixelOutcome::kUnreadable, asked.why_not, {}};
  std::optional<Pixels> pixels = ReadPixelOutcome(asked.answer);
  if (!pixels) return {PixelOutcome::kUnreadable, NonsenseText(), {}};
  if (pixels->outcome == PixelOutcome::kNoMemory && !HasOwnLimit())
    return {PixelOutcome::kUnreadable, TooMuchText(request), {}};
  if (pixels->outcome != PixelOutcome::kDecoded) return *std::move(pixels);
  pixels->bgr = cv::Mat(static_cast<int>(request.height_px), static_cast<int>(request.width_px),
                        CV_8UC3, asked.memory->data() + kPixelsOffset)
                    .clone();
  return *std::move(pixels);
}

uint64_t SandboxedDecoder::HandoverBytes(uint64_t size_bytes, uint64_t pixel_count) const {
  return size_bytes + kPixelsOffset + 3 * pixel_count;
}

}  // namespace veduta
