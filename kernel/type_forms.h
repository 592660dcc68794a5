// SPDX-License-Identifier: Apache-2.0
// Products of types: data for front ends, JSON Schema, a plain-text form, and a check of a value's
// form (layer: core).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

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

/// One line of a form.
struct FormRow {
  const ParamSpec* param = nullptr;
  TypeNotes notes{};
};
/// The lines of a form for these values: fields that have a value or a condition that holds, by
/// groups in the order of their first field, within a group by @order. Points into the schema.
[[nodiscard]] std::vector<FormRow> form_rows(const Schema&, const Map& filled);
/// The value of a field, given or by default; `shape.name` is a part of a map. Null = none.
[[nodiscard]] const Value* form_value(const Schema&, const Map& filled, std::string_view field);
/// The label of a field: @label, or its name.
[[nodiscard]] std::string form_label(const ParamSpec&);

/// A type as nested maps: {kind = "list", element = {kind = "real", unit = "m"}}.
[[nodiscard]] Value type_value(const TypeTree&);
/// All facts about a parameter: name, label, doc, plain and declared type, form (its tree), unit,
/// shown_unit, default, range, choices, group, order, advanced, when, step, example ...; facts that
/// do not apply are left out. `is_input`: includes required.
[[nodiscard]] Map param_value(const ParamSpec&, bool is_input = true);

/// The parameter that param_value() describes, with the same type, range, default, label and group.
/// For front ends that get commands as data. ErrorCode::invalid_argument without name or type.
[[nodiscard]] Result<ParamSpec> param_from(const Value& described);
/// The same for a list of descriptions, such as `params` of ioci.describe.
[[nodiscard]] Result<Schema> schema_from_values(const Value& described);

/// A JSON Schema (draft 2020-12) of a table of arguments. Facts that JSON Schema cannot express are
/// in `x-` members: unit, member, provider, when.
[[nodiscard]] Map json_schema(const Schema&, std::string_view title, std::string_view doc);

/// A plain-text form: headings, one line per field with name, type, unit, value and doc; `filled`
/// has the values. Fields that do not apply to these values are left out.
[[nodiscard]] std::string form_text(const Schema&, const Map& filled);

}  // namespace robomosp
