// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/blur_command.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <thread>

#include "engine/camera/sandbox/shared_memory.h"

namespace veduta {
namespace {

using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr int kDepthMax = 4;  // the answer nests 3 deep
// How often it is looked whether the program is to stop, or has ended; chosen by hand.
constexpr std::chrono::milliseconds kLook{20};

Status Wrong(const std::string& what) {
  return Status::InvalidArgument("its answer is wrong: " + what);
}

// The area of four numbers x, y, width and height; nothing where they are none that lie, at least
// in part, in the picture.
std::optional<PixelArea> AreaOf(const Json& numbers, ImageSize picture) {
  if (!numbers.is_array() || numbers.size() != 4) return std::nullopt;
  std::array<double, 4> n;
  for (size_t i = 0; i < n.size(); ++i) {
    if (!numbers[i].is_number()) return std::nullopt;
    n[i] = numbers[i].get<double>();
  }
  const auto [x, y, width, height] = n;
  if (!(width > 0 && height > 0) || !std::isfinite(x + y + width + height)) return std::nullopt;
  const double left = std::max(0.0, std::floor(x)), top = std::max(0.0, std::floor(y)),
               right = std::min<double>(picture.width_px, std::ceil(x + width)),
               bottom = std::min<double>(picture.height_px, std::ceil(y + height));
  if (!(left < right && top < bottom)) return std::nullopt;
  return PixelArea{static_cast<uint16_t>(left), static_cast<uint16_t>(top),
                   static_cast<uint16_t>(right - left), static_cast<uint16_t>(bottom - top)};
}

// A program that runs, in a process group of its own. All of it is ended with this.
class RunningProgram final {
 public:
  RunningProgram(pid_t pid, Descriptor output) : pid_(pid), output_(std::move(output)) {}
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;
  ~RunningProgram() {
    kill(-pid_, SIGKILL);  // the number is nobody else's before the next line
    waitpid(pid_, nullptr, 0);
  }

  const Descriptor& output() const { return output_; }
  // Whether the program has ended by now.
  bool HasEnded() {
    const int failed = waitid(P_PID, static_cast<id_t>(pid_), &end_, WEXITED | WNOHANG | WNOWAIT);
    return failed == 0 && end_.si_pid == pid_;
  }
  // How it has ended, where that is not as it should.
  Status End() const {
    const bool has_exited = end_.si_code == CLD_EXITED;
    if (has_exited && end_.si_status == 0) return Status::Ok();
    return Status::Busy(std::string("it ended with ") + (has_exited ? "exit code " : "signal ") +
                        std::to_string(end_.si_status));
  }

 private:
  const pid_t pid_;
  const Descriptor output_;
  siginfo_t end_ = {};
};

// Started with the picture as its standard input; nothing else of this process is left to it but
// its standard error.
Result<std::unique_ptr<RunningProgram>> Start(const std::string& program,
                                              std::span<const uint8_t> jpeg) {
  VEDUTA_ASSIGN_OR_RETURN(const Descriptor picture, ShareForReading(jpeg));
  lseek(picture.number(), 0, SEEK_SET);  // it was left where its writer ended
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0)
    return Status::Busy(std::string("no pipe for its answer: ") + std::strerror(errno));
  Descriptor output(ends[0]);
  const Descriptor written(ends[1]);
  fcntl(output.number(), F_SETFL, O_NONBLOCK);
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&files);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_adddup2(&files, picture.number(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, written.number(), STDOUT_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  std::string name = program;
  std::array<char*, 2> arguments = {name.data(), nullptr};
  pid_t pid = 0;
  const int failed =
      posix_spawn(&pid, program.c_str(), &files, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  if (failed != 0) return Status::Busy(std::string("it cannot be started: ") + strerror(failed));
  return std::make_unique<RunningProgram>(pid, std::move(output));
}

// Adds what can be read by now; false once there will be no more.
bool ReadMore(int descriptor, std::string* text) {
  std::array<char, 1 << 14> bytes;
  for (;;) {
    const ssize_t count = read(descriptor, bytes.data(), bytes.size());
    if (count > 0) {
      text->append(bytes.data(), static_cast<size_t>(count));
      return true;
    }
    if (count == 0) return false;
    if (errno != EINTR) return errno == EAGAIN;
  }
}

// All that the program says until it has ended.
Result<std::string> Listen(RunningProgram* program, const BlurCommandLimits& limits,
                           const std::atomic<bool>& stop) {
  const Clock::time_point end = Clock::now() + limits.time_max;
  std::string said;
  for (bool is_open = true;;) {
    const bool has_ended = program->HasEnded();  // looked at first: what it said is in the pipe
    const size_t before = said.size();
    if (is_open) is_open = ReadMore(program->output().number(), &said);
    if (said.size() > limits.output_bytes_max)
      return Status::Busy("it says more than " + std::to_string(limits.output_bytes_max) +
                          " bytes");
    if (said.size() > before) continue;
    if (has_ended) break;
    if (stop) return Status::Busy("the database is being closed");
    if (Clock::now() > end)
      return Status::Busy("it takes longer than " +
                          std::to_string(limits.time_max.count() / 1000.0) + " s");
    pollfd wait{program->output().number(), POLLIN, 0};
    if (is_open) {
      poll(&wait, 1, static_cast<int>(kLook.count()));
    } else {
      std::this_thread::sleep_for(kLook);
    }
  }
  VEDUTA_RETURN_IF_ERROR(program->End());
  return said;
}

}  // namespace

Result<std::vector<PixelArea>> ParseBlurAnswer(std::string_view answer, ImageSize picture) {
  const auto is_flat = [](int depth, Json::parse_event_t, Json&) {
    if (depth > kDepthMax) throw std::length_error("nested");
    return true;
  };
  Json read;
  try {
    read = Json::parse(answer, is_flat, /*allow_exceptions=*/true);
  } catch (const std::exception&) {
    return Wrong("it is no JSON");
  }
  if (!read.is_object() || !read.contains("areas") || !read["areas"].is_array())
    return Wrong("it is no object with \"width\", \"height\" and \"areas\"");
  const auto is = [&](const char* name, uint32_t wanted) {
    return read.contains(name) && read[name].is_number_unsigned() &&
           read[name].get<uint64_t>() == wanted;
  };
  if (!is("width", picture.width_px) || !is("height", picture.height_px))
    return Wrong("\"width\" and \"height\" are not those of the picture, " + picture.Text());
  if (read["areas"].size() > kPrivateAreasMax)
    return Wrong("it has more than " + std::to_string(kPrivateAreasMax) + " areas");
  std::vector<PixelArea> areas;
  for (const Json& numbers : read["areas"]) {
    const std::optional<PixelArea> area = AreaOf(numbers, picture);
    if (!area)
      return Wrong("area " + std::to_string(areas.size()) +
                   " is not [x, y, width, height] of pixels in a picture of " + picture.Text());
    areas.push_back(*area);
  }
  return areas;
}

Result<std::vector<PixelArea>> AskBlurCommand(const std::string& program,
                                              std::span<const uint8_t> jpeg, ImageSize picture,
                                              const BlurCommandLimits& limits,
                                              const std::atomic<bool>& stop) {
  const auto ask = [&]() -> Result<std::vector<PixelArea>> {
    VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<RunningProgram> running, Start(program, jpeg));
    VEDUTA_ASSIGN_OR_RETURN(const std::string answer, Listen(running.get(), limits, stop));
    return ParseBlurAnswer(answer, picture);
  };
  if (stop) return Status::Busy("the database is being closed");
  Result<std::vector<PixelArea>> areas = ask();
  if (areas.ok()) return areas;
  return Status::Busy("it waits to be blurred, for " + program +
                      " has not told what is private in it: " + areas.status().message());
}

}  // namespace veduta
