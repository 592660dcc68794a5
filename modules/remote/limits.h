// SPDX-License-Identifier: Apache-2.0
// Limits: what one client, and all together, may take of a server (layer: application, remote).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "kernel/value.h"

namespace robomosp::remote {

struct Limits {
  std::uint64_t line = std::uint64_t{8} << 20;
  std::uint64_t batch = 10'000;
  std::uint64_t answer = std::uint64_t{64} << 20;
  std::uint64_t waiting = 10'000;
  std::uint64_t waiting_bytes = std::uint64_t{16} << 20;
  std::uint64_t unread = std::uint64_t{1} << 20;
  std::uint64_t rate = 0;
  std::uint64_t jobs = 16;
  std::uint64_t waits = 16;
  std::uint64_t subscriptions = 16;
  std::uint64_t seconds = 600;
  std::uint64_t clients = 1'100;
  std::uint64_t clients_of_address = 1'100;
  std::uint64_t hello_seconds = 10;
  std::uint64_t line_seconds = 60;
  std::uint64_t unread_seconds = 60;
  std::uint64_t idle_seconds = 86'400;
  std::uint64_t scripts = 16;
  std::uint64_t threads = 64;
  std::uint64_t memory = 4096;
};

/// What a limit is called, and what it is; the table of the documentation is made from these.
struct LimitSpec {
  std::string_view name;
  std::uint64_t Limits::*value;
  std::uint64_t least, most;
  std::string_view unit;
  std::string_view doc;
  bool can_be_none = false;  ///< 0 = no limit
};
[[nodiscard]] std::span<const LimitSpec> limit_specs();

/// The defaults with those of `given` by name; ErrorCode::invalid_argument or unknown_name.
[[nodiscard]] Result<Limits> limits_from(const Map& given);
[[nodiscard]] Map limits_value(const Limits& limits);

}  // namespace robomosp::remote
