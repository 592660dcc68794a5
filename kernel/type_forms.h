// SPDX-License-Identifier: Apache-2.0
// Products of types: data for front ends, JSON Schema, a plain-text form, and a check of a value's
// form (layer: core).
#pragma once

#include <string>
#include <string_view>

#include "kernel/schema.h"
#include "kernel/type.h"
#include "kernel/value.h"

namespace robomosp {

/// "" or the first fault of a value (part_faults()), with the path of the part: `links[2].a: ...`.
/// Numbers may be texts (with a unit or as an expression), lists may be arrays; names, files and
/// records are not looked up.
[[nodiscard]] std::string misfit(const TypeTree&, const Value&, std::string_view path);
/// The same for a table of arguments: unknown and missing names, and each value.
[[nodiscard]] std::string misfit(const Schema&, const Map& given);

/// A type as nested maps: {kind = "list", element = {kind = "real", unit = "m"}}.
[[nodiscard]] Value type_value(const TypeTree&);
/// All facts about a parameter: name, label, doc, plain and declared type, form (its tree), unit,
/// shown_unit, default, range, choices, group, order, advanced, when, step, example ...; facts that
/// do not apply are left out. `is_input`: includes required.
[[nodiscard]] Map param_value(const ParamSpec&, bool is_input = true);

/// A JSON Schema (draft 2020-12) of a table of arguments. Facts that JSON Schema cannot express are
/// in `x-` members: unit, member, provider, when.
[[nodiscard]] Map json_schema(const Schema&, std::string_view title, std::string_view doc);

/// A plain-text form: headings, one line per field with name, type, unit, value and doc; `filled`
/// has the values. Fields that do not apply to these values are left out.
[[nodiscard]] std::string form_text(const Schema&, const Map& filled);

}  // namespace robomosp
