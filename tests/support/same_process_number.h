// SPDX-License-Identifier: Apache-2.0
// Child processes with the same number, as the first ones of containers have.
#pragma once

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace robomosp::test {

/// fork() into a process with number 1 in a separate namespace, if the system permits it in a test;
/// otherwise the same as fork().
inline pid_t fork_as_the_first() {
  const int ours = ::open("/proc/self/ns/pid_for_children", O_RDONLY | O_CLOEXEC);
  const bool has_own = ours >= 0 && ::unshare(CLONE_NEWPID) == 0;
  const pid_t child = ::fork();
  if (child == 0 && has_own && ::getpid() != 1) ::_exit(2);
  if (child != 0 && has_own) {
    EXPECT_EQ(::setns(ours, CLONE_NEWPID), 0);
  }
  if (ours >= 0) ::close(ours);
  return child;
}

}  // namespace robomosp::test
