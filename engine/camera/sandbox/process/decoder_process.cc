// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/sandbox/process/decoder_process.h"

#include <fcntl.h>
#include <sys/poll.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <system_error>

#include "engine/camera/sandbox/control_socket.h"
#include "engine/camera/sandbox/exchange.h"
#include "engine/camera/sandbox/process/decoding_child.h"
#include "engine/camera/sandbox/process/lockdown.h"

namespace veduta {
namespace {

using Clock = std::chrono::steady_clock;

// What a child ends with that could not be shut in.
constexpr int kNotShutIn = 3;

// Receives SIGCHLD by a descriptor, so that one call waits for a child and for the program.
Descriptor WatchChildren() {
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGCHLD);
  sigprocmask(SIG_BLOCK, &ends, nullptr);
  return Descriptor(signalfd(-1, &ends, SFD_CLOEXEC | SFD_NONBLOCK));
}

void Forget(int ends) {
  signalfd_siginfo told;
  while (read(ends, &told, sizeof(told)) > 0) {
  }
}

// Whoever wants the memory back takes it from a child first.
void OfferToMemoryKiller() {
  const int file = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
  if (file < 0) return;
  [[maybe_unused]] const ssize_t written = write(file, "1000", 4);
  close(file);
}

// In a child: it ends with its parent, even one that was killed.
void EndWith(pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL, 0, 0, 0);
  if (getppid() != parent) _exit(kNotShutIn);
}

// Waits for a child's end; ends it where it takes longer than wall_s, or where the program is gone.
DecoderEnd WaitFor(pid_t child, int ends, int control, uint32_t wall_s) {
  DecoderEnd end;
  end.is_started = 1;
  const Clock::time_point deadline = Clock::now() + std::chrono::seconds(wall_s);
  for (;;) {
    Forget(ends);  // before it is asked: an end that comes afterwards is told again
    const pid_t waited = waitpid(child, &end.wait_status, WNOHANG);
    if (waited == child) return end;
    if (waited < 0 && errno != EINTR) return {};  // how it ended cannot be told
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
    std::array<pollfd, 2> awaited = {pollfd{ends, POLLIN, 0}, pollfd{control, 0, 0}};
    const bool is_overdue = left <= 0;
    if (!is_overdue && poll(awaited.data(), awaited.size(), static_cast<int>(left)) < 0) continue;
    if (!is_overdue && awaited[1].revents == 0) continue;
    end.is_overdue = is_overdue ? 1 : 0;
    kill(child, SIGKILL);
    while (waitpid(child, &end.wait_status, 0) < 0 && errno == EINTR) {
    }
    return end;
  }
}

// Whether a child that is shut in is ended for opening a folder. Nothing where it is; otherwise
// what is missing.
std::string WhyNotShutIn(const Lockdown& lockdown, int ends, int control) {
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child == 0) {
    EndWith(parent);
    if (!lockdown.Enter({64u << 20, 10}).ok()) _exit(kNotShutIn);
    syscall(SYS_openat, AT_FDCWD, "/", O_RDONLY);
    _exit(0);
  }
  if (child < 0) return "no process can be started: " + std::generic_category().message(errno);
  const DecoderEnd end = WaitFor(child, ends, control, 30);
  if (WIFSIGNALED(end.wait_status) && WTERMSIG(end.wait_status) == SIGSYS) return {};
  return "the system does not let a process give up its system calls (seccomp)";
}

DecoderEnd Decode(const Lockdown& lockdown, const DecoderRequest& request, int photo, int answer,
                  int ends, int control) {
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child == 0) {
    EndWith(parent);
    OfferToMemoryKiller();
    DecodeShutIn(lockdown, request, photo, answer);
  }
  if (child < 0) return {};
  return WaitFor(child, ends, control, request.wall_s);
}

}  // namespace

int RunDecoderProcess(int control) {
  // Whoever ends the program by its terminal or its unit lets it finish the photo at hand.
  for (const int ignored : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) std::signal(ignored, SIG_IGN);
  const Descriptor ends = WatchChildren();
  const Result<Lockdown> lockdown = Lockdown::Make();
  DecoderGreeting greeting;
  const std::string why_not =
      lockdown.ok() ? WhyNotShutIn(*lockdown, ends.number(), control) : lockdown.status().message();
  greeting.is_ready = why_not.empty() ? 1 : 0;
  greeting.why_not = ToExchange<240>(why_not);
  if (!Send(control, greeting) || !why_not.empty()) return 1;
  PrepareToDecode();
  for (;;) {
    DecoderRequest request;
    std::array<Descriptor, 2> memory;
    if (Receive(control, &request, memory, -1) != Reception::kMessage) return 0;
    const DecoderEnd end =
        Decode(*lockdown, request, memory[0].number(), memory[1].number(), ends.number(), control);
    if (!Send(control, end)) return 0;
  }
}

}  // namespace veduta
