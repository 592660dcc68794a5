// SPDX-License-Identifier: Apache-2.0
// Fields of records as values of commands and back, and their schema, from the declarations of the
// fields (layer: application, ioci).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ioci/core/command.h"
#include "model/data.h"
#include "model/field_path.h"

namespace robomosp::ioci {

/// How what a type describes is written as a value where the commands that make it take a form that
/// differs from its fields: a file in the folder of these commands registers it.
struct OwnForm {
  const model::Type& (*type)();
  bool is_list = false;  ///< of a list of that type
  /// Of the record `whole`, which holds the part `p`; nullopt = by its fields.
  std::optional<Value> (*of)(const document::Snapshot&, const model::Content& whole, const void* p);
  /// Stores such a value at `p`; false = it has the form of the fields.
  Result<bool> (*read)(const CommandContext&, void* p, const Value&, const std::string& path);
};
class OwnFormFile {
 public:
  explicit OwnFormFile(OwnForm);
  [[nodiscard]] static const std::vector<OwnForm>& all();
};

/// All fields of a record, in order of declaration.
void add_fields(Map& out, const document::Snapshot&, const model::Record&);

/// The schema of a record kind: a list of fields, each with name, label, doc, type, unit, range,
/// default, choices and, if it has fields, these.
[[nodiscard]] List schema_fields(const document::Snapshot&, const model::Type&);

/// Stores a value at a place of `body`: in the form of the fields, or in that of record.describe.
/// Nil clears an optional field.
Result<void> read_field(CommandContext&, model::Body& body, const model::Place&, const Value&,
                        const std::string& path);

/// Sets what a path names in a record of any kind; numbers may be expressions.
Result<void> set_path(CommandContext&, AnyId, const std::string& path, const Value&);

/// The error for a `path` that is not in the record; with similar paths.
[[nodiscard]] Error unknown_path(const model::Body&, std::string_view path);

}  // namespace robomosp::ioci
