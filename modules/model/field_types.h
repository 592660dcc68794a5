// SPDX-License-Identifier: Apache-2.0
// Records in the language of types (kernel/type.h): the fields of a kind as a table of parameters,
// for forms, schemas and choices (layer: data processing, model).
#pragma once

#include <span>
#include <string_view>

#include "kernel/schema.h"
#include "model/fields.h"

namespace robomosp::model {

/// What a field is beside its C++ type: what a text names, which providers a choice is of, when it
/// counts, its group.
struct FieldNote {
  std::string_view kind;  ///< of record: "task"
  std::string_view path;  ///< of names of fields: "steps.pose"
  /// Type with notes; a type that begins with @ has notes only, and an empty one none.
  std::string_view type;
  /// What arguments of commands say in place of the declaration's sentence; may be empty.
  std::string_view doc = {};
};
[[nodiscard]] std::span<const FieldNote> field_notes();
/// The field that a note is about, and the struct that has it; nulls = there is none.
struct NotedField {
  const Type* owner = nullptr;
  const Field* field = nullptr;
};
[[nodiscard]] NotedField noted_field(const FieldNote&);

/// A field of a record of `kind` at `path`: type with notes, unit, range, doc. Of one default value
/// only where it is plain. [any thread]
[[nodiscard]] ParamSpec field_param(std::string_view kind, std::string_view path, const Field&);
/// All fields of a kind of record, as record.describe names them.
[[nodiscard]] Schema record_fields(const KindInfo&);

}  // namespace robomosp::model
