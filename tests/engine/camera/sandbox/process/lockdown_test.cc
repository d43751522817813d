// SPDX-License-Identifier: Apache-2.0
// Goal: a process that is shut in can compute and nothing else: whatever reaches for a file, the
//   network, another process, or memory to execute ends it, and so does too much time.
// Method: for each way out a child is forked, shut in and lets it try; its end is looked at.
#include "engine/camera/sandbox/process/lockdown.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

namespace veduta {
namespace {

constexpr uint64_t kMemory = 256 << 20;

// How a child ends that is shut in and does this; what it returns is its exit code.
int StatusOf(const std::function<int()>& work, const LockdownLimits& limits = {kMemory, 20}) {
  const Result<Lockdown> lockdown = Lockdown::Make();
  EXPECT_TRUE(lockdown.ok());
  const pid_t child = fork();
  if (child == 0) {
    if (!lockdown->Enter(limits).ok()) _exit(99);
    _exit(work());
  }
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return status;
}

std::string Text(int status) {
  if (WIFSIGNALED(status)) return "signal " + std::to_string(WTERMSIG(status));
  return "exit code " + std::to_string(WEXITSTATUS(status));
}
const std::string kKilled = "signal " + std::to_string(SIGSYS);

// A way out of the process, and what it returns where it is not closed: less than 0 on failure.
struct Way {
  const char* name;
  std::function<long()> out;
};

void ExpectClosed(const std::vector<Way>& ways) {
  for (const Way& way : ways) {
    const int status = StatusOf([&] { return way.out() < 0 ? 1 : 0; });
    EXPECT_EQ(Text(status), kKilled) << way.name;
  }
}

TEST(Lockdown, FilesAreOutOfReach) {
  ExpectClosed({
      {"open", [] { return open("/etc/passwd", O_RDONLY); }},
      {"openat", [] { return openat(AT_FDCWD, ".", O_RDONLY | O_DIRECTORY); }},
      {"openat2", [] { return syscall(SYS_openat2, AT_FDCWD, "/", nullptr, 0); }},
      {"creat", [] { return creat("/tmp/shut_in", 0600); }},
      {"unlink", [] { return unlink("/tmp/nothing"); }},
      {"access", [] { return access("/", R_OK); }},
      {"read",
       [] {
         char byte = 0;
         return read(0, &byte, 1);
       }},
      {"memfd_create", [] { return memfd_create("more", 0); }},
      {"dup", [] { return dup(0); }},
      {"io_uring", [] { return syscall(SYS_io_uring_setup, 1, nullptr); }},
      {"a file into memory",
       [] { return mmap(nullptr, 1, PROT_READ, MAP_PRIVATE, 0, 0) == MAP_FAILED ? -1 : 0; }},
  });
}

TEST(Lockdown, TheNetworkIsOutOfReach) {
  ExpectClosed({
      {"socket", [] { return socket(AF_INET, SOCK_STREAM, 0); }},
      {"socketpair",
       [] {
         std::array<int, 2> ends = {};
         return socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data());
       }},
      {"connect", [] { return connect(3, nullptr, 0); }},
      {"sendto", [] { return sendto(3, "x", 1, 0, nullptr, 0); }},
  });
}

TEST(Lockdown, OtherProcessesAreOutOfReach) {
  const pid_t parent = getpid();
  ExpectClosed({
      {"execve", [] { return execl("/bin/true", "true", nullptr); }},
      {"execveat", [] { return syscall(SYS_execveat, AT_FDCWD, "/bin/true", 0, 0, 0); }},
      {"fork", [] { return fork(); }},
      {"clone", [] { return syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0); }},
      {"clone3", [] { return syscall(SYS_clone3, nullptr, 0); }},
      {"kill", [parent] { return kill(parent, SIGTERM); }},
      {"ptrace", [parent] { return ptrace(PTRACE_ATTACH, parent, nullptr, nullptr); }},
      {"process_vm_writev",
       [parent] { return syscall(SYS_process_vm_writev, parent, nullptr, 0, nullptr, 0, 0); }},
  });
}

TEST(Lockdown, ItCannotBeUndone) {
  ExpectClosed({
      {"setrlimit",
       [] {
         rlimit more{};
         return setrlimit(RLIMIT_CPU, &more);
       }},
      {"prctl", [] { return prctl(PR_SET_PDEATHSIG, 0, 0, 0, 0); }},
      {"seccomp", [] { return syscall(SYS_seccomp, 1, 0, nullptr); }},
      {"bpf", [] { return syscall(SYS_bpf, 0, nullptr, 0); }},
      {"userfaultfd", [] { return syscall(SYS_userfaultfd, 0); }},
      {"unshare", [] { return syscall(SYS_unshare, 0x10000000); }},
      {"sigaction", [] { return std::signal(SIGXCPU, SIG_IGN) == SIG_ERR ? -1 : 0; }},
      {"a call that does not exist", [] { return syscall(100'000); }},
  });
}

TEST(Lockdown, NoMemoryMayBeExecuted) {
  ExpectClosed({
      {"mmap",
       [] {
         void* const got =
             mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
         return got == MAP_FAILED ? -1 : 0;
       }},
      {"mprotect",
       [] {
         void* const got =
             mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
         return mprotect(got, 4096, PROT_READ | PROT_EXEC);
       }},
  });
}

TEST(Lockdown, ComputingGoesOn) {
  const int status = StatusOf([] {
    std::vector<std::string> much;
    for (int i = 0; i < 1000; ++i) much.emplace_back(100'000, 'x');
    timespec now{};
    if (clock_gettime(CLOCK_MONOTONIC, &now) != 0) return 1;
    try {
      much.at(1000);
    } catch (const std::exception&) {
      return 42;
    }
    return 2;
  });
  EXPECT_EQ(Text(status), "exit code 42");
}

// Libraries print what they do not like.
TEST(Lockdown, NothingIsOpenAndPrintingIsRefused) {
  const int file = open("/dev/null", O_WRONLY | O_CLOEXEC);
  const int status = StatusOf([file] {
    for (const int number : {0, 1, 2, file}) {
      if (write(number, "x", 1) != -1 || errno != EBADF) return 1;
    }
    std::fprintf(stderr, "nobody reads this\n");
    std::fflush(stderr);
    return 42;
  });
  close(file);
  EXPECT_EQ(Text(status), "exit code 42");
}

TEST(Lockdown, MemoryHasALimit) {
#ifdef VEDUTA_SANITIZED
  GTEST_SKIP() << "the sanitizer takes its addresses by the terabyte";
#endif
  const auto takes = [](uint64_t size_bytes) {
    return [size_bytes] {
      void* const got = std::malloc(size_bytes);
      return got == nullptr ? 1 : 42;
    };
  };
  EXPECT_EQ(Text(StatusOf(takes(kMemory / 2))), "exit code 42");
  EXPECT_EQ(Text(StatusOf(takes(kMemory + (1 << 20)))), "exit code 1");
}

TEST(Lockdown, ProcessorTimeHasALimit) {
  const int status = StatusOf(
      [] {
        timespec now{};
        while (clock_gettime(CLOCK_MONOTONIC, &now) == 0) {
        }
        return 1;
      },
      {kMemory, 1});
  EXPECT_EQ(Text(status), "signal " + std::to_string(SIGXCPU));
}

}  // namespace
}  // namespace veduta
