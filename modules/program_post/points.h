// SPDX-License-Identifier: Apache-2.0
// Geometric values of a program that are known before it runs, and the joints of its targets
// (layer: data processing, program_post).
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/program_tables.h>

#include "program_post/remark.h"

namespace robomosp::program_post {

/// An additional joint bound to a joint of the world.
struct CarriedAxis {
  std::size_t number = 0;  ///< in the program, from 1
  std::int32_t rail = -1;  ///< index in q of the chain before the arm; -1 = it does not carry the
                           ///< arm
  bool is_rotary = true;
  double start = 0;             ///< of the joint [degrees or mm]
  double lower = 0, upper = 0;  ///< of the joint [degrees or mm]
  double sign = 1, offset = 0;  ///< value in the program = sign * joint + offset
  std::string name;             ///< of the joint
};
/// The joint [degrees or mm] for a value of the program; for a step, its increment.
[[nodiscard]] double joint_of(const CarriedAxis&, double value, bool is_step);
/// A robot with first joints that are additional joints of the program, such as a rail.
struct Carrier {
  std::shared_ptr<const RobotModel> chain;  ///< rail and arm
  std::vector<double> start;                ///< of the chain [rad or m]
  std::size_t rail = 0;                     ///< number of its joints that are additional ones
  std::vector<CarriedAxis> axes;            ///< by number
  std::size_t slots = 0;                    ///< number of values in ADD_JOINT
  bool has_no_additional = false;           ///< its values are zeros required by the type (R_NADDJ
                                            ///< := 0)
  /// Frames of motions are relative to the carriage at their ends, as after on_carriage().
  bool is_on_carriage = false;
};
/// Additional joints of a motion [degrees or mm], in values of the joints, by number; empty = known
/// at run time only.
struct CarriedMotion {
  std::optional<std::vector<double>> from, to;
  [[nodiscard]] bool moves() const { return from && to && *from != *to; }
};

/// Owns the data of its points; they stay valid when it is moved.
struct KnownPoints {
  std::vector<PostPoint> points;  ///< by ascending expression
  std::deque<std::vector<double>> numbers;
  std::deque<std::vector<std::int32_t>> turns;
  std::deque<std::string> words;
  std::vector<Remark> remarks;         ///< targets that the run reaches with other joints than they
                                       ///< specify
  std::vector<CarriedMotion> motions;  ///< by motion, with a carrier
};

/// Values of all expressions of position, orientation, pose, joints and robot target that do not
/// depend on the run: they consist of constants and of variables that are never assigned. With
/// kinematics, the targets of motions get joints and poses, each seeded by the previous one in the
/// text, the first by `start` (may be empty = zeros); motions along a path keep the branch in which
/// they begin, as in a run. PostStatus of an arm with a spherical wrist is determined from its
/// joints: the wrist before or behind axis 1, the elbow above or below; for others it consists of
/// the solver's names. TOOL and FRAME of a motion are applied: the kinematics are those of the
/// flange that carries TOOL, and `default_tool` is for motions without TOOL. A ROBTARGET has a
/// STATUS (-1 = any) and TURNS, which are those of the last joints, in turns that begin at
/// R_TURNS_FROM of the cell. With R_MAKER_AXES in the cell, joints and turns are those of `axes`.
/// Joints: degrees and mm of the program become rad and m by the robot's types of joints (rad
/// without a robot). With a `carrier`, the robot, its kinematics and `start` are those of the arm,
/// poses are in the base of the chain, and points of motions have the additional joints at that
/// time (`external`, in values of the joints); a target without them leaves them unchanged. If they
/// depend on the run, the target has no joints. Linear in the size of the tables.
[[nodiscard]] KnownPoints known_points(const rmp_code& code, const RobotModel* robot,
                                       const PostKinematics* kinematics,
                                       std::span<const double> start = {},
                                       const Pose& default_tool = {},
                                       std::span<const PostAxis> axes = {},
                                       const Carrier* carrier = nullptr);

/// q of a carrier's chain [rad or m] for additional joints by number [degrees or mm], in values of
/// the joints; missing ones, and the arm, are at the start.
[[nodiscard]] std::vector<double> chain_at(const Carrier&, std::span<const double> additional);
/// base_T_carriage of a carrier for additional joints by number [degrees or mm], in values of the
/// joints.
[[nodiscard]] Pose carriage_at(const Carrier&, std::span<const double> additional);

}  // namespace robomosp::program_post
