// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/room_parts.h"

namespace robomosp::ioci {
namespace {

std::vector<RoomPart>& room_parts() {
  static std::vector<RoomPart> all;
  return all;
}

}  // namespace

RoomFile::RoomFile(const RoomPart& part) { room_parts().push_back(part); }

const std::vector<RoomPart>& RoomFile::all() { return room_parts(); }

Result<void> complete_in_rooms(CommandContext& ctx) {
  for (const RoomPart& part : RoomFile::all())
    if (part.before_commit) RMP_TRY(part.before_commit(ctx));
  return {};
}

}  // namespace robomosp::ioci
