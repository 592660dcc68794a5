// SPDX-License-Identifier: Apache-2.0
// Reads records of any kind by the declarations of their fields (layer: application). Internal to
// modules/io. Written by io/native_print.cpp.
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
  /// A struct being read, and its path in the record, for values known only later.
  struct Target {
    const model::Type* type = nullptr;
    void* data = nullptr;
    model::Way way;               ///< from the record to it; empty = the record
    std::string shown;            ///< `part "plate"`, for messages
    std::size_t alternative = 0;  ///< of units
  };
  /// The rules for all fields of a struct except its name, if it is a named element.
  [[nodiscard]] std::vector<Rule> rules_of(const Target&);
  /// The rule for one field.
  void add_rules(const Target&, const model::Field&, std::vector<Rule>& out);
  /// The rules for those of the fields that are in the block `owner`, and the names of the others.
  /// The target must outlive the rules.
  void add_rules(const Target&, const std::vector<const model::Field*>&, Index owner,
                 std::vector<Rule>& out);
  /// Checks that a reference has at least one of the words that can provide it.
  Result<void> need_references(const Target&, Index block);

  /// A whole record of a kind without a special reader.
  Result<void> declared_record(Kind);
  /// Resolves names of list elements after everything is read.
  Result<void> look_up_names();

 private:
  Rule list_rule(const Target&, const model::Field&);
  Rule table_rule(const model::Field&, void* table);
  /// A field of one value.
  Result<void> read_single(Index, const Target&, const model::Field&);
  Result<void> read_value(Index, const Target&, const model::Field&, const model::Type&, void* data,
                          const model::Way& way);
  Result<void> read_numbers(Index, const Target&, const model::Field&, const model::Type&,
                            void* data);

  /// A field that names an element of one of the record's lists.
  struct NameToFind {
    Index field = 0;
    model::Way way;  ///< to the integer
    std::string_view list;
  };
  std::vector<NameToFind> names_;
};

}  // namespace robomosp::io
