// SPDX-License-Identifier: Apache-2.0
// What a run makes of C_PASS without a distance: the words of notes, the same in all posts (layer:
// contract helper, inline only, not part of the ABI).
#pragma once

#include <cstdint>
#include <string>

#include <robomosp/sdk/post_writer.h>

namespace robomosp::post {

/// Whether a run may pass the target of a motion with C_PASS and without C_CP and C_PTP: that of a
/// PTP of one target with a TIME, without UNTIL. `code` holds the motion as the program has it,
/// since writers take motions of several targets apart.
[[nodiscard]] inline bool may_pass_in_a_run(const rmp_code& code, const Motion& m) {
  const Attribute& time = m[RMP_ATTR_TIME];
  return m.interpolation == RMP_MOVE_PTP && m.until == RMP_NONE &&
         row<rmp_code_motion>(code.motions, m.row).target_count == 1 &&
         (time.known ? *time.known > 0 : time.expression != RMP_NONE);
}

/// What the robot does in a run at the target of such a motion, behind "in a run the robot ".
[[nodiscard]] inline std::string at_c_pass_in_a_run(const rmp_code& code, const Motion& m) {
  if (!may_pass_in_a_run(code, m)) return "stops here";
  bool is_alone = true;
  for (const Target& t : m.targets)
    is_alone = is_alone && t.role != RMP_ROLE_ADD_JOINT && !(t.point && !t.point->external.empty());
  return std::string("passes this target at its TIME, each joint by a cubic, if a PTP of one ") +
         "target with a TIME follows at once" +
         (is_alone ? "" : " and no other device moves with it");
}

}  // namespace robomosp::post
