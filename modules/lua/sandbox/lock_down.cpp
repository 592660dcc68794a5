// SPDX-License-Identifier: Apache-2.0
#include "lua/sandbox/lock_down.h"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <string>
#include <type_traits>

#include <linux/capability.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace robomosp::lua {
namespace {

// AddressSanitizer reserves terabytes, and its run time makes calls of its own.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsSanitized = true;
#else
constexpr bool kIsSanitized = false;
#endif

Error failed(const std::string& what, int number) {
  return error(ErrorCode::unsupported, what + ": " + std::strerror(number),
               "Untrusted scripts need Linux with seccomp filters.");
}

bool limit(__rlimit_resource what, std::uint64_t value) {
  const rlimit both{static_cast<rlim_t>(value), static_cast<rlim_t>(value)};
  return ::setrlimit(what, &both) == 0;
}

/// Users, network, mounts, host name and System V messages of its own, and an empty folder as its
/// root. False where the system does not let it.
bool enter_namespaces() {
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET | CLONE_NEWNS | CLONE_NEWIPC | CLONE_NEWUTS) != 0)
    return false;
  constexpr unsigned long kFlags = MS_RDONLY | MS_NOSUID | MS_NODEV | MS_NOEXEC;
  return ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         ::mount("none", "/tmp", "tmpfs", kFlags, "size=4k,nr_inodes=2,mode=0555") == 0 &&
         ::chroot("/tmp") == 0 && ::chdir("/") == 0;
}

/// Those that the namespace gave.
void drop_capabilities() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct none[_LINUX_CAPABILITY_U32S_3]{};
  (void)::syscall(SYS_capset, &header, none);
}

/// 0, or the number of the error.
int filter_calls() {
  const std::unique_ptr<std::remove_pointer_t<scmp_filter_ctx>, void (*)(scmp_filter_ctx)> filter(
      ::seccomp_init(SCMP_ACT_KILL_PROCESS), [](scmp_filter_ctx f) { ::seccomp_release(f); });
  if (!filter) return ENOSYS;
  int result = 0;
  const auto allow = [&](int call, std::initializer_list<scmp_arg_cmp> where) {
    if (result == 0)
      result = ::seccomp_rule_add_array(filter.get(), SCMP_ACT_ALLOW, call,
                                        static_cast<unsigned>(where.size()), where.begin());
  };
  for (const int call :
       {SCMP_SYS(munmap), SCMP_SYS(mremap), SCMP_SYS(madvise), SCMP_SYS(brk), SCMP_SYS(futex),
        SCMP_SYS(clock_gettime), SCMP_SYS(gettimeofday), SCMP_SYS(time), SCMP_SYS(getrandom),
        SCMP_SYS(sched_yield), SCMP_SYS(restart_syscall), SCMP_SYS(rt_sigreturn), SCMP_SYS(exit),
        SCMP_SYS(exit_group)})
    allow(call, {});
  // The one descriptor.
  allow(SCMP_SYS(read), {SCMP_A0(SCMP_CMP_EQ, 0, 0)});
  allow(SCMP_SYS(write), {SCMP_A0(SCMP_CMP_EQ, 0, 0)});
  // Memory that is of no file and never code.
  allow(SCMP_SYS(mmap), {SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0),
                         SCMP_A3(SCMP_CMP_MASKED_EQ, MAP_ANONYMOUS, MAP_ANONYMOUS)});
  allow(SCMP_SYS(mprotect), {SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0)});
  if (result == 0) result = ::seccomp_load(filter.get());
  return -result;
}

}  // namespace

Result<Locked> lock_down(const LockDown& wanted) {
  Locked out;
  if (::syscall(SYS_close_range, 1U, ~0U, 0U) != 0)
    return failed("the descriptors cannot be closed", errno);
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1UL, 0UL, 0UL, 0UL) != 0)
    return failed("new privileges cannot be refused", errno);
  const pid_t parent = ::getppid();
  out.namespaces = enter_namespaces();
  drop_capabilities();
  // A change of credentials takes both back, so they come after it.
  if (::prctl(PR_SET_PDEATHSIG, static_cast<unsigned long>(SIGKILL), 0UL, 0UL, 0UL) != 0 ||
      ::prctl(PR_SET_DUMPABLE, 0UL, 0UL, 0UL, 0UL) != 0)
    return failed("the process cannot be tied to its parent", errno);
  if (::getppid() != parent) ::_exit(0);  // which has ended meanwhile
  if (!(kIsSanitized || limit(RLIMIT_AS, wanted.memory)) || !limit(RLIMIT_NOFILE, 0) ||
      !limit(RLIMIT_NPROC, 0) || !limit(RLIMIT_FSIZE, 0) || !limit(RLIMIT_CORE, 0) ||
      !limit(RLIMIT_MEMLOCK, 0))
    return failed("its limits cannot be set", errno);
  if (kIsSanitized) return out;
  const int number = filter_calls();
  out.seccomp = number == 0;
  if (!out.seccomp && !wanted.without_seccomp)
    return failed("system calls cannot be filtered (seccomp)", number);
  return out;
}

}  // namespace robomosp::lua
