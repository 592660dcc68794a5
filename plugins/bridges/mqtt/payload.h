// SPDX-License-Identifier: Apache-2.0
// What a message says: JSON text to numbers, by a mapping that the configuration gives
// (layer: plugin). Messages are a stranger's: length, depth and numbers are bounded. [any thread]
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "../config.h"

namespace robomosp::bridges {

inline constexpr std::size_t kLongestPayload = 65536;  ///< [bytes]

/// Numbers from one field of a message: a number, or a list of exactly `count`.
struct FieldMap {
  Json::json_pointer field;           ///< RFC 6901, "/joints/position"
  std::string name;                   ///< the same, for people
  std::optional<std::size_t> count;   ///< none = a number
  std::vector<double> scale, offset;  ///< of each: value = scale * what came + offset
};

/// The keys `field`, `count`, `sign`, `scale`, `offset` of a table; `sign` is 1 or -1, and the last
/// three are a number or a list.
[[nodiscard]] FieldMap read_field(Table& table, const std::string& field_when_left_out);

/// The values of fields one after the other; throws PayloadFault.
struct PayloadFault : std::runtime_error {
  using std::runtime_error::runtime_error;
};
[[nodiscard]] std::vector<double> read_payload(std::string_view payload,
                                               const std::vector<const FieldMap*>& fields);

}  // namespace robomosp::bridges
