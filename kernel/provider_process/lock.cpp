// SPDX-License-Identifier: Apache-2.0
#include "kernel/provider_process/lock.h"

#include <cerrno>
#include <csignal>
#include <initializer_list>
#include <memory>
#include <type_traits>

#include <sched.h>
#include <seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

namespace {

// AddressSanitizer reserves terabytes, and its run time makes calls of its own.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsSanitized = true;
#else
constexpr bool kIsSanitized = false;
#endif

bool limit(__rlimit_resource what, std::uint64_t value) {
  const rlimit both{static_cast<rlim_t>(value), static_cast<rlim_t>(value)};
  return ::setrlimit(what, &both) == 0;
}

/// Refuses what reaches beyond the process; libraries that ask for it hear that they may not.
bool filter_calls() {
  const std::unique_ptr<std::remove_pointer_t<scmp_filter_ctx>, void (*)(scmp_filter_ctx)> filter(
      ::seccomp_init(SCMP_ACT_ALLOW), [](scmp_filter_ctx f) { ::seccomp_release(f); });
  if (!filter) return false;
  bool is_good = true;
  const auto refuse = [&](int call, int number, std::initializer_list<scmp_arg_cmp> where = {}) {
    // What the oldest kernels' headers do not know has a negative number.
    if (call == __NR_SCMP_ERROR) return;
    is_good = is_good &&
              ::seccomp_rule_add_array(filter.get(), SCMP_ACT_ERRNO(number), call,
                                       static_cast<unsigned>(where.size()), where.begin()) == 0;
  };
  for (const int call : {SCMP_SYS(execve),
                         SCMP_SYS(execveat),
                         SCMP_SYS(fork),
                         SCMP_SYS(vfork),
                         SCMP_SYS(socket),
                         SCMP_SYS(socketpair),
                         SCMP_SYS(connect),
                         SCMP_SYS(bind),
                         SCMP_SYS(listen),
                         SCMP_SYS(ptrace),
                         SCMP_SYS(process_vm_readv),
                         SCMP_SYS(process_vm_writev),
                         SCMP_SYS(pidfd_open),
                         SCMP_SYS(pidfd_getfd),
                         SCMP_SYS(pidfd_send_signal),
                         SCMP_SYS(rt_sigqueueinfo),
                         SCMP_SYS(rt_tgsigqueueinfo),
                         SCMP_SYS(tkill),
                         SCMP_SYS(unshare),
                         SCMP_SYS(setns),
                         SCMP_SYS(mount),
                         SCMP_SYS(umount2),
                         SCMP_SYS(pivot_root),
                         SCMP_SYS(chroot),
                         SCMP_SYS(bpf),
                         SCMP_SYS(perf_event_open),
                         SCMP_SYS(keyctl),
                         SCMP_SYS(add_key),
                         SCMP_SYS(request_key),
                         SCMP_SYS(userfaultfd),
                         SCMP_SYS(io_uring_setup),
                         SCMP_SYS(io_uring_enter),
                         SCMP_SYS(io_uring_register),
                         SCMP_SYS(open_by_handle_at),
                         SCMP_SYS(name_to_handle_at),
                         SCMP_SYS(personality),
                         SCMP_SYS(process_madvise),
                         SCMP_SYS(move_pages),
                         SCMP_SYS(migrate_pages),
                         SCMP_SYS(shmget),
                         SCMP_SYS(shmat),
                         SCMP_SYS(msgget),
                         SCMP_SYS(semget),
                         SCMP_SYS(mq_open),
                         SCMP_SYS(setpriority),
                         SCMP_SYS(setsid),
                         SCMP_SYS(setpgid)})
    refuse(call, EPERM);
  // The C library asks for threads in the older way then, whose flags can be seen.
  refuse(SCMP_SYS(clone3), ENOSYS);
  refuse(SCMP_SYS(clone), EPERM, {SCMP_A0(SCMP_CMP_MASKED_EQ, CLONE_THREAD, 0)});
  const auto own = static_cast<scmp_datum_t>(::getpid());
  refuse(SCMP_SYS(kill), EPERM, {SCMP_A0(SCMP_CMP_NE, own)});
  refuse(SCMP_SYS(tgkill), EPERM, {SCMP_A0(SCMP_CMP_NE, own)});
  // Its own limits are named by 0, as the C library does.
  refuse(SCMP_SYS(prlimit64), EPERM, {SCMP_A0(SCMP_CMP_NE, 0)});
  // That it ends with the program stays so.
  refuse(SCMP_SYS(prctl), EPERM, {SCMP_A0(SCMP_CMP_EQ, PR_SET_PDEATHSIG)});
  return is_good && ::seccomp_load(filter.get()) == 0;
}

}  // namespace

const char* lock_provider_process(int parent, std::uint64_t memory, bool is_confined) {
  if (::prctl(PR_SET_PDEATHSIG, static_cast<unsigned long>(SIGKILL), 0UL, 0UL, 0UL) != 0)
    return "the process cannot be tied to its program";
  if (::getppid() != parent) return "its program has ended";
  if (!limit(RLIMIT_CORE, 0)) return "its limits cannot be set";
  if (kIsSanitized) return nullptr;
  // Shared memory grows as files do.
  if (!limit(RLIMIT_AS, memory)) return "its limits cannot be set";
  if (!is_confined) return nullptr;
  if (!limit(RLIMIT_FSIZE, 8 * memory)) return "its limits cannot be set";
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1UL, 0UL, 0UL, 0UL) != 0 || !filter_calls())
    return "its calls of the system cannot be filtered (seccomp)";
  return nullptr;
}
