// SPDX-License-Identifier: Apache-2.0
// Gives up, for good, what a process that runs scripts of strangers does not need: system calls,
// descriptors, memory, the network and the file system (layer: application, lua).
#pragma once

#include <cstdint>

#include <robomosp/sdk/result.h>

namespace robomosp::lua {

/// Less memory is not enough for the program itself [bytes].
inline constexpr std::uint64_t kLeastMemory = std::uint64_t{128} << 20;

struct LockDown {
  std::uint64_t memory = std::uint64_t{256} << 20;  ///< address space [bytes]
  /// Goes on where the system has no seccomp; the limits and namespaces are all there is then.
  bool without_seccomp = false;
};

/// What holds.
struct Locked {
  bool seccomp = false;  ///< any other system call than those for memory and time ends the process
  bool namespaces = false;  ///< own users, network, mounts and messages; an empty root folder
};

/// Of the calling process, which must have one thread: from here on it reads and writes descriptor
/// 0 and computes. It is killed when the thread that started it ends. The error says what could not
/// be locked; then the process must end.
[[nodiscard]] Result<Locked> lock_down(const LockDown&);

}  // namespace robomosp::lua
