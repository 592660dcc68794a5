// SPDX-License-Identifier: Apache-2.0
// Drops, permanently, what a process for untrusted scripts does not need: system calls,
// descriptors, memory, the network and the file system (layer: application, lua).
#pragma once

#include <cstdint>

#include <robomosp/sdk/result.h>

namespace robomosp::lua {

/// The program itself needs at least this much memory [bytes].
inline constexpr std::uint64_t kLeastMemory = std::uint64_t{128} << 20;

struct LockDown {
  std::uint64_t memory = std::uint64_t{256} << 20;  ///< address space [bytes]
  /// Continues on systems without seccomp, with only the limits and namespaces.
  bool without_seccomp = false;
};

/// The protections in effect.
struct Locked {
  bool seccomp = false;     ///< system calls other than those for memory and time end the process
  bool namespaces = false;  ///< separate users, network, mounts and messages; an empty root folder
};

/// Locks the calling process, which must have one thread: afterwards it can only read and write
/// descriptor 0 and compute. It is killed when the thread that started it ends. The error names
/// what could not be locked; then the process must end.
[[nodiscard]] Result<Locked> lock_down(const LockDown&);

}  // namespace robomosp::lua
