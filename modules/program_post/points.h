// SPDX-License-Identifier: Apache-2.0
// Geometric values of a program that are known before it runs, and the joints of its targets
// (layer: data processing, program_post).
#pragma once

#include <deque>
#include <memory>
#include <vector>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/program_tables.h>

#include "program_post/remark.h"

namespace robomosp::program_post {

/// Owns what its points refer to; moved, they stay valid.
struct KnownPoints {
  std::vector<PostPoint> points;  ///< by rising expression
  std::deque<std::vector<double>> numbers;
  std::deque<std::vector<std::int32_t>> turns;
  std::deque<std::string> words;
  std::vector<Remark> remarks;  ///< targets that the run reaches otherwise than they say
};

/// Values of all expressions of position, orientation, pose, joints and robot target that do not
/// depend on the run: made of constants and of variables that nothing assigns. With kinematics the
/// targets of motions get joints and poses, each seeded by the one before in the text, the first by
/// `start` (may be empty = zeros); motions along a path keep the branch in which they begin, as in
/// a run. PostStatus of an arm with a spherical wrist is what its joints are seen to be: the wrist
/// before or behind axis 1, the elbow above or below; of others it is the solver's names. A
/// TOOL and FRAME of a motion count: the kinematics are of the flange that TOOL is on, and
/// `default_tool` is of motions without TOOL. A
/// ROBTARGET has its STATUS (-1 = any) and its TURNS, which are those of the last joints, in turns
/// that begin at R_TURNS_FROM of the cell. Where the cell says R_MAKER_AXES, joints and turns are
/// those of `axes`. Joints: degrees and mm of the program become rad and m
/// by the robot's types of joints (rad without a robot). Linear in the size of the tables.
[[nodiscard]] KnownPoints known_points(const rmp_code& code, const RobotModel* robot,
                                       const PostKinematics* kinematics,
                                       std::span<const double> start = {},
                                       const Pose& default_tool = {},
                                       std::span<const PostAxis> axes = {});

}  // namespace robomosp::program_post
