// SPDX-License-Identifier: Apache-2.0
// Faults of arguments: their codes, and the remedies that a schema knows (layer: core).
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "kernel/fault.h"
#include "kernel/schema.h"
#include "kernel/value.h"

namespace robomosp {

/// A path of an argument as faults keep it: a long one shortened.
[[nodiscard]] std::string subject_path(std::string path);

/// An error about the argument `path`, with a fault of that code.
[[nodiscard]] Error argument_error(std::string_view code, std::string_view path,
                                   std::string message, std::string hint = {});
/// `e`, which is about the value of the argument `path`.
[[nodiscard]] Error argument_error(Error e, std::string_view path, std::string_view code);
/// The same about a number outside its range, which ends at `limit`.
[[nodiscard]] Error range_error(std::string_view path, std::string message, double value,
                                double limit, std::string_view unit);
/// The fault of an argument that failed its check, about the argument `name` if the error does not
/// say it more exactly.
[[nodiscard]] Fault argument_fault(const Error& e, std::string_view name);

/// Adds what mends a fault of an argument of `given`: the nearest name, the nearest choice, the
/// nearest value in range. Each was checked against the schema.
void add_remedies(Fault& fault, const Schema& schema, const Map& given, const ResolveRef& resolve);

/// The part of the value of the argument `name` at `path`: "steps[2].pose"; nullopt = none.
[[nodiscard]] std::optional<Value> part_at(const Value&, std::string_view path,
                                           std::string_view name);
/// The value with another one there; nullopt where it has no such part, or is too large to copy.
[[nodiscard]] std::optional<Value> with_part(const Value&, std::string_view path,
                                             std::string_view name, const Value& part);

/// The arguments of a call that failed with what a remedy (FaultRemedy::repeats) changes.
[[nodiscard]] Map repeated(const FaultRemedy& remedy, const Map& given);

}  // namespace robomosp
