// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/sandbox/decoder_connection.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <string>
#include <system_error>

#include "engine/camera/sandbox/control_socket.h"

namespace veduta {
namespace {

// Starting takes some 20 ms; a machine under load may take long.
constexpr int64_t kGreetingMs = 60'000;
// How much longer the process itself may take than a child may.
constexpr int64_t kSlackMs = 30'000;

Status CannotStart(const std::string& why) {
  return Status::IoError("the process that decodes photos cannot be started: " + why);
}
Status CannotStart(int error) {
  return CannotStart(std::generic_category().message(error));
}

// What becomes of a started process's descriptors and signals.
class SpawnSettings final {
 public:
  explicit SpawnSettings(int control) {
    posix_spawn_file_actions_init(&actions_);
    for (int i = 0; i < 3; ++i)
      posix_spawn_file_actions_addopen(&actions_, i, "/dev/null", i == 0 ? O_RDONLY : O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions_, control, kControlDescriptor);
    posix_spawnattr_init(&attributes_);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes_, &none);
    posix_spawnattr_setsigdefault(&attributes_, &all);
    // A group of its own: Ctrl-C is meant for the program.
    posix_spawnattr_setpgroup(&attributes_, 0);
    posix_spawnattr_setflags(
        &attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  }
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  // The error, or 0.
  int Spawn(const std::string& path, pid_t* process) const {
    std::array<char, 15> name = {"veduta-decoder"};
    std::array<char*, 2> arguments = {name.data(), nullptr};
    std::array<char*, 1> environment = {nullptr};
    return posix_spawn(process, path.c_str(), &actions_, &attributes_, arguments.data(),
                       environment.data());
  }

 private:
  posix_spawn_file_actions_t actions_;
  posix_spawnattr_t attributes_;
};

}  // namespace

int NicenessOfThread() {
  return getpriority(PRIO_PROCESS, 0);
}

Result<std::unique_ptr<DecoderConnection>> DecoderConnection::Start(int program) {
  // Above those that the process finds at numbers of its own.
  const Descriptor file(fcntl(program, F_DUPFD_CLOEXEC, kControlDescriptor + 1));
  std::array<int, 2> ends = {-1, -1};
  if (file.number() < 0 || socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
    return CannotStart(errno);
  Descriptor ours(ends[0]);
  Descriptor theirs(ends[1]);
  pid_t process = -1;
  const int failed = SpawnSettings(theirs.number())
                         .Spawn("/proc/self/fd/" + std::to_string(file.number()), &process);
  theirs = Descriptor();  // so that its end is noticed
  if (failed != 0) return CannotStart(failed);
  std::unique_ptr<DecoderConnection> connection(
      new DecoderConnection(process, std::move(ours), NicenessOfThread()));
  DecoderGreeting greeting;
  if (Receive(connection->control_.number(), &greeting, {}, kGreetingMs) != Reception::kMessage)
    return CannotStart("it does not answer");
  if (greeting.version != kExchangeVersion)
    return CannotStart("veduta-decoder is of another version of Veduta; install them together");
  if (greeting.is_ready != 1)
    return CannotStart(FromExchange(greeting.why_not).value_or("it does not say why"));
  return connection;
}

DecoderConnection::~DecoderConnection() {
  kill(process_, SIGKILL);
  while (waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

std::optional<DecoderEnd> DecoderConnection::Ask(const DecoderRequest& request, int photo,
                                                 int answer) {
  const std::array<int, 2> memory = {photo, answer};
  if (!Send(control_.number(), request, memory)) return std::nullopt;
  DecoderEnd end;
  const int64_t wait_ms = int64_t{request.wall_s} * 1000 + kSlackMs;
  if (Receive(control_.number(), &end, {}, wait_ms) != Reception::kMessage) return std::nullopt;
  return end;
}

}  // namespace veduta
