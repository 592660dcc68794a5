// SPDX-License-Identifier: Apache-2.0
// The members that words behind `member:` name: lists of records, parts of a record, what the
// program has (layer: application, ioci only).
#pragma once

#include <span>
#include <string_view>

#include "ioci/core/command.h"
#include "ioci/schema/choice_list.h"

namespace robomosp::ioci {

/// What runs through the records of a kind.
using OfRecord = void (*)(CommandContext&, const model::Record&, ChoiceList&);
/// What needs no owner.
using OfProgram = void (*)(CommandContext&, ChoiceList&);

/// Members that are elements of a list of a record, by name; or by number where they have none.
struct ListMember {
  std::string_view word;
  Kind kind;
  std::string_view list;  ///< the record's field
};
[[nodiscard]] std::span<const ListMember> list_members();

/// Further members, of a kind of record each; a body is of a robot or a world.
struct RecordMember {
  std::string_view word;
  std::string_view kinds;
  OfRecord add;
};
[[nodiscard]] std::span<const RecordMember> record_members();

/// Members that need no record.
struct ProgramMember {
  std::string_view word;
  OfProgram add;
};
[[nodiscard]] std::span<const ProgramMember> program_members();

/// The elements of a list of a record: their names, or their numbers where they have none.
void add_list(const model::Record&, std::string_view list, ChoiceList& out,
              std::string_view doc = {});

}  // namespace robomosp::ioci
