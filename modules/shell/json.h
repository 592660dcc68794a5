// SPDX-License-Identifier: Apache-2.0
// Value <-> JSON text: handles as {"$handle": {...}}, arrays as lists of numbers, NaN and
// infinities as strings (layer: application, shell). [any thread]
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "kernel/value.h"

namespace robomosp::shell {

/// Nesting that a message may have.
inline constexpr std::size_t kDeepestJson = 64;

/// Name of a handle's record, empty when there is none.
using NameOf = std::function<std::string(const Handle&)>;

/// One line of JSON; text that is not UTF-8 has its bad bytes replaced. Numbers read back to the
/// same bits.
[[nodiscard]] std::string to_json(const Value& value, const NameOf& name_of = {});

/// Strict JSON; ErrorCode::syntax names the place. Whole numbers within 64 bits are integers.
[[nodiscard]] Result<Value> from_json(std::string_view text);

/// {code, message, where, hint} of an error.
[[nodiscard]] Map error_map(const Error& e);

}  // namespace robomosp::shell
