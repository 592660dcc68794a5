// SPDX-License-Identifier: Apache-2.0
// Value <-> JSON text: handles as {"$handle": {...}}, arrays as lists of numbers or as {"$array":
// {...}}, NaN and infinities as strings (layer: application, remote). [any thread]
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "kernel/value.h"

namespace robomosp::remote {

/// Nesting that a message may have.
inline constexpr std::size_t kDeepestJson = 64;

/// Name of a handle's record, empty when there is none.
using NameOf = std::function<std::string(const Handle&)>;

/// How numeric arrays are written.
enum class Arrays {
  numbers,  ///< lists of numbers, matrices as lists of rows
  base64,   ///< {"$array": {"shape": [rows, cols], "base64": "..."}}, doubles little-endian by rows
};

/// One line of JSON; text that is not UTF-8 has its bad bytes replaced. Numbers read back to the
/// same bits.
[[nodiscard]] std::string to_json(const Value& value, const NameOf& name_of = {},
                                  Arrays arrays = Arrays::numbers);
/// The same behind what is there.
void append_json(std::string& out, const Value& value, const NameOf& name_of = {},
                 Arrays arrays = Arrays::numbers);

/// How {"$handle": ...} is read.
enum class Handles {
  own,     ///< as a handle of this program
  foreign  ///< as the table that it is: the handle is another program's
};

/// Strict JSON; ErrorCode::syntax names the place. Whole numbers within 64 bits are integers. An
/// {"$array": ...} that is none is left for array_fault() to be found.
[[nodiscard]] Result<Value> from_json(std::string_view text, Handles handles = Handles::own);

/// What is wrong with the first {"$array": ...} of a value that could not be read; `where` is its
/// path. nullopt = nothing.
[[nodiscard]] std::optional<Error> array_fault(const Value& value);

/// {code, message, where, hint} of an error.
[[nodiscard]] Map error_map(const Error& e);

}  // namespace robomosp::remote
