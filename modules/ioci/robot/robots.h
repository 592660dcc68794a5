// SPDX-License-Identifier: Apache-2.0
// Shared by the commands of robots: reading links and bodies, edits that leave a mechanism which
// solvers accept (layer: application). Internal to modules/ioci.
#pragma once

#include <numbers>
#include <optional>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include <robomosp/sdk/ik.h>

#include "ioci/core/commands.h"
#include "robotics/closure.h"
#include "robotics/tip_motion.h"

namespace robomosp::ioci {

/// Degrees to radians.
inline constexpr double kDegree = std::numbers::pi / 180;

/// Joint values, rates and forces, points and wrenches beyond this are refused: what is computed of
/// their squares and products would not be numbers.
inline constexpr double kMostOfAJoint = 1e12;
/// The first number that is not finite or beyond kMostOfAJoint is an error at path[i].
Result<void> check_size(std::span<const double> values, std::string_view path);

/// Fields of a link as arguments, with units such as "rad|m" where they depend on the joint.
[[nodiscard]] const Schema& link_params();
/// The same for check(), with the units of a joint. `creating`: with defaults. Stays.
[[nodiscard]] const Schema& link_schema(model::JointKind kind, bool creating);
/// Adds a link from a table of the fields of link_schema().
Result<void> append_link(CommandContext& ctx, model::Robot& r, Value given,
                         const std::string& path);
/// The same for many links: `names` has those of all that it has, and gets the new one's.
Result<void> append_link(CommandContext& ctx, model::Robot& r, Value given, const std::string& path,
                         std::unordered_set<std::string>& names);
/// Links as robot.create takes them: a list of tables and of rows of numbers, a matrix, or what
/// robot.dh_table gives. `columns` names those of rows of numbers. The result has tables only.
[[nodiscard]] Result<List> links_given(const Value& links, const Value* columns);
/// The maker's axes of a robot that has its links, from a list of the fields of robot.set_axes.
Result<void> give_axes(const CommandContext& ctx, model::Robot& r, const Value& list);
/// Designed bodies; `name` is what paths call the list: "parts" or "base_parts".
[[nodiscard]] Result<std::vector<model::BodyPart>> read_bodies(CommandContext& ctx,
                                                               const Value& list,
                                                               const std::string& path,
                                                               const char* name);
/// {Ixx, Iyy, Izz, Ixy, Iyz, Ixz} or a symmetric 3x3 matrix [kg m^2].
[[nodiscard]] Result<Sym3> read_inertia(const Value& v, const std::string& path);
/// The parameters mass, com and inertia, and what they say; nothing when none is given.
[[nodiscard]] std::vector<ParamSpec> mass_fields(const char* of_what, const char* frame);
[[nodiscard]] Result<void> read_mass(const Map& args, std::optional<MassProperties>& out,
                                     const std::string& path);
/// The mechanism must be one that solvers accept: faults show at the command that makes them.
Result<void> check_robot(const std::string& name, const model::Robot& r);
/// Tells of given inertias that no body can have. They are kept: published data may be partial,
/// such as the only element of PUMA's first link that its torques depend on.
void report_inertia(CommandContext& ctx, const std::string& name, const model::Link& l);
/// The fault of loops that do not close or leave limits, else nothing.
Result<void> closed_or_fault(const RobotModel& m, const robotics::Closure& closed);
/// The tip of the argument `tip`; the first one when it is left out.
Result<std::size_t> tip_index(const RobotModel& m, const Map& args);
/// What belongs to an objective that is not asked for is refused.
Result<void> check_objective_fields(const CommandContext& ctx, const Map& args);
/// Tells (code "degrees") when a turning joint is given an angle that is beyond its limits by more
/// than a turn, or is more than two turns where it has none, and in degrees would be within them or
/// is a whole number up to a turn: angles are radians. Once for a robot and joint, as long as it is
/// among the last messages.
void note_degrees(const CommandContext& ctx, const RobotModel& m, std::span<const double> q);
/// Whether a link that moves has mass or inertia.
[[nodiscard]] bool has_mass(const RobotModel& m);
/// Fills in what a solver leaves out of an answer: a solved configuration next to a singular one
/// (least rate below 1e-3 of the greatest) names the direction it loses of the parts wanted.
void report_singular(const RobotModel& m, std::size_t tip, std::uint32_t parts, IkResult& result);
/// What a tip can do with its joint frames there; open loops are an error.
Result<robotics::TipMotion> closed_tip_motion(const RobotModel& m, std::size_t tip,
                                              std::span<const Pose> joint_frames);

[[nodiscard]] inline ParamSpec unbounded(ParamSpec p) {
  p.infinite = true;
  return p;
}

/// Changes a robot and refuses what no solver could accept.
template <class Fn>
Result<Value> change_robot(CommandContext& ctx, const Map& args, Fn&& fn) {
  const AnyId id = ref(args, "id");
  const std::string name = ctx.snapshot().find(id)->name;
  auto done = change<model::Robot>(ctx, id, [&](model::Robot& r) -> Result<void> {
    auto changed = fn(r);
    if (!changed.ok()) return std::move(changed).error().in("robot " + text::quote(name));
    return check_robot(name, r);
  });
  if (!done.ok()) return std::move(done).error();
  return Value();
}

}  // namespace robomosp::ioci
