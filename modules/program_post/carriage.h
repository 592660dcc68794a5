// SPDX-License-Identifier: Apache-2.0
// Programs of a robot on a rail for controllers that know of the rail, and for those that do not
// (layer: data processing, program_post).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/program_tables.h>

#include "program_post/points.h"
#include "program_post/remark.h"

namespace robomosp::program_post {

/// What the controller of a target does with a rail.
enum class RailKind {
  base,      ///< external axes carry the robot: poses stay in the fixed base
  carriage,  ///< external axes move beside the robot: poses are those of the carriage
  none,      ///< it has no external axes: the robot has to stay where it is on the rail
};

/// A copy of the program for such a controller. `base`: TCP_KEEP is what the controller does, and
/// is taken out; motions along a path that move the rail without it are remarks. `carriage` and
/// `none`: FRAME of each motion is measured from the carriage at the motion's end; motions where
/// that is not known are remarks of errors, and for `none` those that move the rail. `known`: of
/// this code and carrier. Texts stay those of the program, which outlives it.
[[nodiscard]] std::unique_ptr<ProgramTables> for_rail(const rmp_code&, const Carrier&,
                                                      const KnownPoints& known, RailKind,
                                                      const PostCapabilities&,
                                                      std::vector<Remark>& remarks);

}  // namespace robomosp::program_post
