// SPDX-License-Identifier: Apache-2.0
// Arguments of commands that are fields of records: made of the declarations in model/, and set in
// the structs again (layer: application, ioci only). docs/decisions/0100-arguments-from-fields.md.
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "ioci/core/command.h"
#include "kernel/schema.h"
#include "model/fields.h"

namespace robomosp::ioci {

/// The fields of the struct at `path` of a kind of record ("robot", "links"; "" = the record) as
/// optional arguments in order of declaration: type, unit, range, words, label, group, condition
/// and doc. Fields of flat structs are among them, and a flat placement is placement_fields(frame).
/// Read-only fields, parameters and expressions are left out.
[[nodiscard]] Schema record_params(std::string_view kind, std::string_view path,
                                   const std::string& frame = {});
/// One parameter of a table, to add what a command says more; aborts if the table lacks it.
[[nodiscard]] ParamSpec& param_named(Schema&, std::string_view name);
/// The table without some parameters; aborts if it lacks one of them.
[[nodiscard]] Schema without(Schema, std::initializer_list<std::string_view> names);
/// The table with these parameters in front, in this order, as calls without names give them.
[[nodiscard]] Schema led_by(std::initializer_list<std::string_view> names, Schema);
/// The table for the command itself, where units such as "rad|m" depend on what it changes: such
/// parameters are read by the command instead of the schema.
[[nodiscard]] Schema units_by_joint(Schema);
/// The table for check() within the command: plain types, and one of units such as "rad|m".
[[nodiscard]] Schema plain_params(Schema, std::size_t alternative = 0);

/// Sets the fields of a struct that checked arguments of the same names give: bool, number, word,
/// text, colour, numbers, reference, provider. Placements, elements of other lists, joint values,
/// lists and the fields named by `except` are left to the command. false and "" empty an optional
/// field.
Result<void> set_fields(const model::Type&, void* to, const Map& checked,
                        std::initializer_list<std::string_view> except = {});
/// The same for one field.
Result<void> set_field(const model::Field&, void* owner, const Map& checked);
template <class T>
Result<void> set_fields(T& to, const Map& checked,
                        std::initializer_list<std::string_view> except = {}) {
  return set_fields(model::type_of<T>(), &to, checked, except);
}

/// Stores a checked value; false = it is of a type that is left to the command, as of set_fields().
Result<bool> set_checked_value(const model::Type&, const model::Field&, void* to,
                               const Value& checked);
/// A value as commands return it; nullopt = of a type that set_fields() leaves to the command. nil
/// if it is not finite, or a reference without records to find its name in. `unit`: of numbers.
[[nodiscard]] std::optional<Value> plain_value(const document::Snapshot*, const model::Type&,
                                               const model::Field&, const void* p,
                                               std::string_view unit);
/// A field of `owner` as commands return it; nil if it has its default value, or if it is a
/// reference and there are no records to find its name in.
[[nodiscard]] Value changed_value(const document::Snapshot*, const model::Type&,
                                  const model::Field&, const void* owner);

}  // namespace robomosp::ioci
