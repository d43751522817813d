// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/sandbox/process/lockdown.h"

#include <seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>

namespace veduta {
namespace {

Status Refused(const char* what, int error) {
  return Status::IoError(std::string("the system refuses ") + what + ": " +
                         std::generic_category().message(error));
}

// Computing takes these: memory, time, the end of the process.
constexpr int kAllowed[] = {
    SCMP_SYS(brk),          SCMP_SYS(munmap),
    SCMP_SYS(mremap),       SCMP_SYS(madvise),
    SCMP_SYS(futex),        SCMP_SYS(sched_yield),
    SCMP_SYS(getrandom),    SCMP_SYS(clock_gettime),
    SCMP_SYS(clock_getres), SCMP_SYS(gettimeofday),
    SCMP_SYS(rt_sigreturn), SCMP_SYS(exit),
    SCMP_SYS(exit_group),   SCMP_SYS(getpid),
    SCMP_SYS(gettid),       SCMP_SYS(restart_syscall),
#ifdef VEDUTA_SANITIZED
    SCMP_SYS(sigaltstack),  // the sanitizers look at the stack when something is thrown
#endif
};
// Libraries that complain do so to a stream, which is closed.
constexpr int kClosed[] = {
    SCMP_SYS(write), SCMP_SYS(writev), SCMP_SYS(fstat), SCMP_SYS(newfstatat),
    SCMP_SYS(ioctl), SCMP_SYS(lseek),  SCMP_SYS(close),
};

int AddRules(scmp_filter_ctx filter) {
  for (const int call : kAllowed) {
    if (const int failed = seccomp_rule_add(filter, SCMP_ACT_ALLOW, call, 0)) return failed;
  }
  for (const int call : kClosed) {
    if (const int failed = seccomp_rule_add(filter, SCMP_ACT_ERRNO(EBADF), call, 0)) return failed;
  }
  // Memory, but none that may be executed.
  if (const int failed = seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(mprotect), 1,
                                          SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0))) {
    return failed;
  }
  return seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(mmap), 2,
                          SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0),
                          SCMP_A3(SCMP_CMP_MASKED_EQ, MAP_ANONYMOUS, MAP_ANONYMOUS));
}

Status Limit(__rlimit_resource resource, rlim_t most, const char* what) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0) return Refused(what, errno);
  limit.rlim_cur = std::min(limit.rlim_cur, most);
  // One more, for what only the hard limit stops.
  limit.rlim_max = std::min(limit.rlim_max, most == 0 ? 0 : most + 1);
  if (setrlimit(resource, &limit) != 0) return Refused(what, errno);
  return Status::Ok();
}

// The size of all addresses that are in use; 0 where it is not told.
uint64_t AddressBytes() {
  std::FILE* const file = std::fopen("/proc/self/statm", "re");
  if (file == nullptr) return 0;
  unsigned long long pages = 0;
  const bool is_read = std::fscanf(file, "%llu", &pages) == 1;
  std::fclose(file);
  return is_read ? pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE)) : 0;
}

Status LimitMemory(uint64_t memory_bytes) {
#ifdef VEDUTA_SANITIZED
  return Status::Ok();
#else
  const uint64_t used = AddressBytes();
  if (used == 0) return Status::IoError("/proc/self/statm cannot be read: is /proc mounted?");
  return Limit(RLIMIT_AS, used + memory_bytes, "a limit of memory");
#endif
}

}  // namespace

Result<Lockdown> Lockdown::Make() {
  std::shared_ptr<void> filter(seccomp_init(SCMP_ACT_KILL_PROCESS), [](void* made) {
    if (made != nullptr) seccomp_release(made);
  });
  if (!filter)
    return Status::IoError("the system does not let a process give up its system calls (seccomp)");
  // Calls of another architecture, as a 64-bit process can make 32-bit ones.
  int failed = seccomp_attr_set(filter.get(), SCMP_FLTATR_ACT_BADARCH, SCMP_ACT_KILL_PROCESS);
  if (failed == 0) failed = AddRules(filter.get());
  if (failed != 0) return Refused("a filter of system calls", -failed);
  return Lockdown(std::move(filter));
}

Status Lockdown::Enter(const LockdownLimits& limits) const {
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return Refused("no_new_privs", errno);
  if (prctl(PR_SET_DUMPABLE, 0, 0, 0, 0) != 0) return Refused("to forbid dumps", errno);
  VEDUTA_RETURN_IF_ERROR(LimitMemory(limits.memory_bytes));
  VEDUTA_RETURN_IF_ERROR(Limit(RLIMIT_CPU, limits.cpu_s, "a limit of processor time"));
  VEDUTA_RETURN_IF_ERROR(Limit(RLIMIT_CORE, 0, "a limit of core files"));
  VEDUTA_RETURN_IF_ERROR(Limit(RLIMIT_FSIZE, 0, "a limit of files' sizes"));
  VEDUTA_RETURN_IF_ERROR(Limit(RLIMIT_NPROC, 0, "a limit of processes"));
  closefrom(0);
  VEDUTA_RETURN_IF_ERROR(Limit(RLIMIT_NOFILE, 0, "a limit of descriptors"));
  if (const int failed = seccomp_load(filter_.get()))
    return Refused("a filter of system calls", -failed);
  return Status::Ok();
}

}  // namespace veduta
