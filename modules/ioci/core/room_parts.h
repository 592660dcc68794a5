// SPDX-License-Identifier: Apache-2.0
// What the folders of ioci do at certain moments of the program. Their files register it, so that
// core includes no other folder (layer: application). Internal to modules/ioci.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "ioci/core/application.h"

namespace robomosp::ioci {

/// Functions that are null are not called. The order of the calls is not defined.
struct RoomPart {
  /// After the plugins of `folders` were loaded, before the document is created.
  void (*plugins_loaded)(Application&, std::span<const std::filesystem::path> folders) = nullptr;
  /// After the document was created, before the first command.
  void (*document_started)(Application&) = nullptr;
  /// Before the open transaction of a command is committed, which it may complete; an error rejects
  /// the command. [the command's thread]
  Result<void> (*before_commit)(CommandContext&) = nullptr;
  /// A subscription to events was made. [any thread]
  void (*subscribed)(Application&) = nullptr;
};

/// Registers the part of a file when the program starts: `const RoomFile kPart({...});`.
class RoomFile {
 public:
  explicit RoomFile(const RoomPart&);
  [[nodiscard]] static const std::vector<RoomPart>& all();
};

/// Calls `moment` of all parts that have it: in_rooms(&RoomPart::subscribed, app).
template <class... Parameters, class... Args>
void in_rooms(void (*RoomPart::*moment)(Parameters...), Args&&... args) {
  for (const RoomPart& part : RoomFile::all())
    if (part.*moment) (part.*moment)(args...);
}

/// Calls before_commit of all parts, up to the first error.
[[nodiscard]] Result<void> complete_in_rooms(CommandContext&);

}  // namespace robomosp::ioci
