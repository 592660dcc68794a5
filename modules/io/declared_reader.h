// SPDX-License-Identifier: Apache-2.0
// Reads what the declarations of the records' fields say, whatever the kind (layer: application).
// Internal to modules/io. Written by io/native_print.cpp.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "io/field_reader.h"
#include "model/data.h"
#include "model/field_path.h"

namespace robomosp::io {

class DeclaredReader : public FieldReader {
 public:
  using FieldReader::FieldReader;

 protected:
  /// A struct that is read, and the way to it in the record, for what is known later only.
  struct Target {
    const model::Type* type = nullptr;
    void* data = nullptr;
    model::Way way;               ///< from the record to it; empty = the record
    std::string shown;            ///< `part "plate"`, for messages
    std::size_t alternative = 0;  ///< of units
  };
  /// The rules for all fields of a struct but its name, when it is an element with one.
  [[nodiscard]] std::vector<Rule> rules_of(const Target&);
  /// The rule for one of them.
  void add_rules(const Target&, const model::Field&, std::vector<Rule>& out);
  /// Where there must be one of several words for a reference, there is.
  Result<void> need_references(const Target&, Index block);

  /// A whole record of a kind that has no reader of its own.
  Result<void> declared_record(Kind);
  /// What names elements of lists is looked up when all is read.
  Result<void> look_up_names();

 private:
  Rule list_rule(const Target&, const model::Field&);
  Rule table_rule(const model::Field&, void* table);
  Result<void> read_value(Index, const Target&, const model::Field&, const model::Type&, void* data,
                          const model::Way& way);
  Result<void> read_numbers(Index, const Target&, const model::Field&, const model::Type&,
                            void* data);

  /// A field that names an element of a list of the record.
  struct NameToFind {
    Index field = 0;
    model::Way way;  ///< to the integer
    std::string_view list;
  };
  std::vector<NameToFind> names_;
};

}  // namespace robomosp::io
