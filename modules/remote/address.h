// SPDX-License-Identifier: Apache-2.0
// Address: where a server listens, as text and as what it is (layer: application, remote).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

namespace robomosp::remote {

/// Port of a TCP address that names none.
inline constexpr std::uint16_t kDefaultPort = 7007;

/// "127.0.0.1:7007", "[::1]:7007", "robot.example:7007", "unix:/run/robomosp.sock".
struct Address {
  bool is_unix = false;
  std::string host;  ///< without brackets; "" = every address of this machine
  std::uint16_t port = kDefaultPort;
  std::string path;  ///< of a Unix socket

  /// ErrorCode::invalid_argument names what is wrong.
  [[nodiscard]] static Result<Address> parse(std::string_view text);
  [[nodiscard]] std::string text() const;
  /// Whether only programs of this machine reach it. A name counts as loopback only when it is
  /// "localhost".
  [[nodiscard]] bool is_local() const;
};

}  // namespace robomosp::remote
