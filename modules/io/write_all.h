// SPDX-License-Identifier: Apache-2.0
// Writing to a descriptor until all is written (layer: application, io).
#pragma once

#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <string_view>

namespace robomosp::io {

/// Writes all bytes, whatever the system takes at once. Returns 0, or errno of the write that
/// failed.
[[nodiscard]] inline int write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return 0;
}

}  // namespace robomosp::io
