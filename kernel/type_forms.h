// SPDX-License-Identifier: Apache-2.0
// What is made of types: data for front ends, JSON Schema, a form of plain text, and whether a
// value has the form of a type (layer: core).
#pragma once

#include <string>
#include <string_view>

#include "kernel/schema.h"
#include "kernel/type.h"
#include "kernel/value.h"

namespace robomosp {

/// "" or what keeps a value from having a type, with the path of the part: `links[2].a: ...`.
/// Numbers may be texts (with a unit or as an expression), lists may be arrays, and names, files
/// and records are not looked up.
[[nodiscard]] std::string misfit(const TypeTree&, const Value&, std::string_view path);
/// The same for a table of arguments: unknown names, missing ones, and what is in them.
[[nodiscard]] std::string misfit(const Schema&, const Map& given);

/// A type as nested maps: {kind = "list", element = {kind = "real", unit = "m"}}.
[[nodiscard]] Value type_value(const TypeTree&);
/// All that is known of a parameter: name, label, doc, plain and declared type, form (its tree),
/// unit, shown_unit, default, range, choices, group, order, advanced, when, step, example ...;
/// what does not apply is left out. `is_input`: with required.
[[nodiscard]] Map param_value(const ParamSpec&, bool is_input = true);

/// A JSON Schema (draft 2020-12) of a table of arguments. What JSON Schema has no word for is in
/// `x-` members: unit, member, provider, when.
[[nodiscard]] Map json_schema(const Schema&, std::string_view title, std::string_view doc);

/// A form of plain text: headings, a line a field with name, type, unit, value and doc; `filled`
/// gives the values. Fields that do not matter for the values are left out.
[[nodiscard]] std::string form_text(const Schema&, const Map& filled);

}  // namespace robomosp
