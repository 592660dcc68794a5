// SPDX-License-Identifier: Apache-2.0
// Faults of the parts of arguments: elements of lists, fields of maps, alternatives (layer: core).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/fault.h"
#include "kernel/schema.h"
#include "kernel/type.h"
#include "kernel/value.h"

namespace robomosp {

/// The faults of a value and of all its parts, one for each part with its path: `links[3].alpha`.
/// At most `most`, and then one that counts the others. Names, files and records are not looked up.
/// If expressions may be given (NumberReader), a text in place of a number is left to the command.
[[nodiscard]] std::vector<Fault> part_faults(const ParamSpec&, const Value&, std::string_view path,
                                             std::size_t most = 10);
/// The same for a value of a type, and for a table of arguments: unknown and missing names, too.
[[nodiscard]] std::vector<Fault> part_faults(const TypeTree&, const Value&, std::string_view path,
                                             std::size_t most = 10);
[[nodiscard]] std::vector<Fault> part_faults(const Schema&, const Map& given,
                                             std::size_t most = 10);
/// Whether check_value() leaves parts of such a value unchecked.
[[nodiscard]] bool has_unchecked_parts(const ParamSpec&);
/// The same where its plain type (kernel/type.h) is known.
[[nodiscard]] bool has_unchecked_parts(const ParamSpec&, std::string_view plain);

/// Checks how many numbers a checked vector or matrix has.
Result<void> check_count(const TypeTree&, const Value& checked, std::string_view path);
/// The fault of a parameter that must be given.
[[nodiscard]] Error missing_argument(const ParamSpec&, std::string_view path);
/// The fault of a name that a table at `path` does not have; "" = the arguments themselves.
[[nodiscard]] Fault unknown_argument(const Schema&, std::string_view name, std::string_view path);
/// Completes the fault of a name that the case `own` of a variant does not have: which cases do.
void name_cases(Fault&, const TypeTree& variant, std::string_view own, std::string_view name);

}  // namespace robomosp
