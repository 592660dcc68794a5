// SPDX-License-Identifier: Apache-2.0
// Shared by the commands of robots: reading of links and bodies, and edits that keep a mechanism
// acceptable to solvers (layer: application). Internal to modules/ioci.
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

/// Limit of joint values, rates and forces, points and wrenches: beyond it, squares and products of
/// them would overflow.
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
/// The same for many links: `names` has the names of all existing links, and receives the new one.
Result<void> append_link(CommandContext& ctx, model::Robot& r, Value given, const std::string& path,
                         std::unordered_set<std::string>& names);
/// Links as accepted by robot.create: a list of tables and of rows of numbers, a matrix, or the
/// result of robot.dh_table. `columns` names the columns of rows of numbers. The result has tables
/// only.
[[nodiscard]] Result<List> links_given(const Value& links, const Value* columns);
/// Sets the maker's axes of a robot with its links, from a list of the fields of robot.set_axes.
Result<void> give_axes(const CommandContext& ctx, model::Robot& r, const Value& list);
/// Designed bodies; `name` is the name of the list in paths: "parts" or "base_parts".
[[nodiscard]] Result<std::vector<model::BodyPart>> read_bodies(CommandContext& ctx,
                                                               const Value& list,
                                                               const std::string& path,
                                                               const char* name);
/// {Ixx, Iyy, Izz, Ixy, Iyz, Ixz} or a symmetric 3x3 matrix [kg m^2].
[[nodiscard]] Result<Sym3> read_inertia(const Value& v, const std::string& path);
/// The parameters mass, com and inertia, and the reader of their values; empty if none is given.
[[nodiscard]] std::vector<ParamSpec> mass_fields(const char* of_what, const char* frame);
[[nodiscard]] Result<void> read_mass(const Map& args, std::optional<MassProperties>& out,
                                     const std::string& path);
/// Checks that solvers accept the mechanism, so that a fault is reported by the command that causes
/// it.
Result<void> check_robot(const std::string& name, const model::Robot& r);
/// Warns about given inertias that no body can have. They are kept: published data may be partial,
/// such as the only element of PUMA's first link that affects its torques.
void report_inertia(CommandContext& ctx, const std::string& name, const model::Link& l);
/// The error of loops that do not close or violate limits, else nothing.
Result<void> closed_or_fault(const RobotModel& m, const robotics::Closure& closed);
/// The tip of the argument `tip`; the first one by default.
Result<std::size_t> tip_index(const RobotModel& m, const Map& args);
/// Rejects arguments of an objective other than the selected one.
Result<void> check_objective_fields(const CommandContext& ctx, const Map& args);
/// Posts a note (code "degrees") if the value of a revolute joint exceeds its limits by more than a
/// turn (or two turns without limits), and would be within them in degrees or is a whole number up
/// to a turn: angles are in radians. Once per robot and joint, while it is among the last messages.
void note_degrees(const CommandContext& ctx, const RobotModel& m, std::span<const double> q);
/// True if a moving link has mass or inertia.
[[nodiscard]] bool has_mass(const RobotModel& m);
/// Motions of a tip for given joint frames; open loops are an error.
Result<robotics::TipMotion> closed_tip_motion(const RobotModel& m, std::size_t tip,
                                              std::span<const Pose> joint_frames);

[[nodiscard]] inline ParamSpec unbounded(ParamSpec p) {
  p.infinite = true;
  return p;
}

/// Changes a robot, and rejects a result that no solver could accept.
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
