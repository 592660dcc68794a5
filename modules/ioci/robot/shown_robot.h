// SPDX-License-Identifier: Apache-2.0
// A robot in a world: the selected world, and the joint values shown there (layer: application,
// ioci only).
#pragma once

#include <vector>

#include "ioci/core/commands.h"
#include "robotics/maker_axes.h"

namespace robomosp::ioci {

struct ShownRobot {
  WorldId world;
  std::size_t member = 0;  ///< of World::robots
  std::vector<double> q;   ///< as placed, else of the pose "home", else zeros
};

/// The optional argument `world` of commands of a robot.
[[nodiscard]] ParamSpec shown_world();
/// The world of the argument `world`, else the only one with the robot `id`.
[[nodiscard]] Result<ShownRobot> shown_robot(const CommandContext& ctx, const Map& args);
/// Posts a message if joint values to be shown exceed limits or leave loops open. They are shown
/// anyway, since users move one joint after another.
void note_shown_joints(CommandContext& ctx, RobotId robot, std::span<const double> q);
/// The same with the robot's model.
void note_shown_joints(CommandContext& ctx, RobotId robot, const RobotModel&,
                       std::span<const double> q);

/// The joint values shown in a world; without one, those of its pose "home", else zeros.
[[nodiscard]] Result<std::vector<double>> shown_or_home(const CommandContext& ctx, const Map& args);
/// Sets the joint values shown in the world to `q`; returns q, in the unit of the argument `angles`
/// if there is one.
[[nodiscard]] Result<Value> put_joints(CommandContext& ctx, const Map& args,
                                       const ShownRobot& shown, std::vector<double> q);
/// q with the maker's axes set to the values of `given`: a list of all in order, or a table by
/// name, in which missing axes keep their value at `q`. Numbers are in degrees and mm, texts may
/// have a unit. Errors name `path`.
[[nodiscard]] Result<std::vector<double>> read_axis_values(const model::Robot& robot,
                                                           const Value& given,
                                                           std::span<const double> q,
                                                           std::string_view path);
/// Values of the maker's axes by name [degrees or mm] at q.
[[nodiscard]] Map axis_map(const robotics::MakerAxes& maker, std::span<const double> q);
/// The argument `axes` of commands that set joint values.
[[nodiscard]] ParamSpec axis_values();
/// Rejects `q` together with `axes`, neither of them, and `axes` for a robot without axes.
[[nodiscard]] Result<void> one_of_joints_and_axes(const CommandContext& ctx, const Map& args,
                                                  RobotId id, const model::Robot& robot);
/// The error of an argument `axes` or `axis` that does not fit the robot.
[[nodiscard]] Error no_maker_axes(const CommandContext& ctx, RobotId robot);
/// The frame "target" of a world; while there is none, its origin.
inline constexpr std::string_view kTarget = "target";
[[nodiscard]] model::Placement target_of(const model::World& w);
/// The target of the world that shows the robot, in the frame the robot is mounted in.
[[nodiscard]] Pose target_in_mounting(const CommandContext& ctx, const ShownRobot& shown);
/// The argument `q` if given, else the joint values shown in the world.
[[nodiscard]] Result<std::vector<double>> given_or_shown(const CommandContext& ctx, const Map& args,
                                                         const RobotModel& m);

// Lines of the program of 2006 use degrees for joints, except in its LLRL.

/// The argument `angles`: radians, or degrees.
[[nodiscard]] ParamSpec angle_unit();
[[nodiscard]] bool in_degrees(const Map& args);
/// As read_q(); plain numbers of revolute joints are in the unit of the argument `angles`.
[[nodiscard]] Result<std::vector<double>> read_joints(const Map& args, const Value& value,
                                                      const model::Robot& robot,
                                                      const RobotModel& m, std::string_view path);
/// Joint values as a result, with revolute joints in the unit of the argument `angles`.
[[nodiscard]] Value joints_answer(const Map& args, const model::Robot& robot,
                                  std::vector<double> q);

}  // namespace robomosp::ioci
