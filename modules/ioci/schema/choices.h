// SPDX-License-Identifier: Apache-2.0
// What may be given for an argument now: records, members of what other arguments name, providers,
// words, files, units (layer: application, ioci only).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "ioci/core/command.h"
#include "kernel/schema.h"

namespace robomosp::ioci {

/// One value that may be given.
struct Choice {
  Value value;
  std::string label{};    ///< for people; empty = the value
  std::string doc{};      ///< one sentence; may be empty
  std::string why_not{};  ///< why it would be refused now; empty = it would not
  /// False for members of any record, as nothing is given that says of which.
  bool is_decided = true;
};

/// Values that may be given at `path` of a table of arguments: "link", "step.robot",
/// "links[2].parent". `given` are the arguments so far, as the user gave them; what they name
/// decides the members. Where nothing is given that would decide, the members of all records in the
/// document are choices. Those that begin with `prefix`, case-blind, at most so many.
/// `from_library`: also records of the library, which commands that edit load by their names.
/// ErrorCode::unknown_name.
[[nodiscard]] Result<std::vector<Choice>> choices_of(CommandContext&, const Schema&,
                                                     std::string_view path, const Map& given,
                                                     std::string_view prefix,
                                                     bool from_library = false,
                                                     std::size_t most = 10'000);

/// The words behind `member:` for which there are choices, sorted.
[[nodiscard]] std::vector<std::string> member_words();

}  // namespace robomosp::ioci
