// SPDX-License-Identifier: Apache-2.0
// Sections of an MJCF file that refer to its bodies: actuators, equalities, fixed tendons and
// keyframes (layer: plugin).
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "mjcf_values.h"

namespace robomosp::robot_files {

/// The bodies as read, for reference by the other sections.
struct MjcfBodies {
  Mechanism& m;
  const MjcfValues& values;
  LeftOut& left_out;
  std::map<std::string, std::int32_t, std::less<>> index;  ///< body -> m.bodies
  std::vector<Pose> world;                                 ///< world_T_body at rest
  std::map<std::string, std::pair<std::int32_t, Pose>, std::less<>> sites;  ///< body_T_site
  std::map<std::string, double, std::less<>> refs;  ///< of joints: origin of their values
};

/// A section is the elements inside <actuator>, <equality> and <keyframe>; those inside <tendon>
/// define what actuators of tendons drive.
[[nodiscard]] Result<void> read_actuators(MjcfBodies&, const std::vector<const Element*>& actuators,
                                          const std::vector<const Element*>& tendons);
[[nodiscard]] Result<void> read_equalities(MjcfBodies&, const std::vector<const Element*>&);
[[nodiscard]] Result<void> read_keyframes(MjcfBodies&, const std::vector<const Element*>&);

}  // namespace robomosp::robot_files
