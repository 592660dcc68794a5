// SPDX-License-Identifier: Apache-2.0
// Rotations side by side in every notation, and the original's transforms: the placements of a
// robot's base and tool and of a world's members, element by element.
#include <algorithm>
#include <cmath>

#include "ioci/core/commands.h"
#include "ioci/world/members.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::ioci {
namespace {

using model::AngleRepresentation;
using model::Placement;

Result<Value> convert(CommandContext&, const Map& args) {
  spatial::Matrix3 r{1, 0, 0, 0, 1, 0, 0, 0, 1};
  int given = 0;
  Vec3 p{};
  for (const char* name :
       {"rpy", "xyz", "zyz", "quaternion", "axis_angle", "rotation_vector", "matrix", "pose"}) {
    if (!has(args, name)) continue;
    ++given;
    const std::string_view n = name;
    const auto v = reals(args, name);
    if (n == "rpy") r = spatial::from_rpy({v[0], v[1], v[2]});
    if (n == "xyz") r = spatial::from_xyz({v[0], v[1], v[2]});
    if (n == "zyz") r = spatial::from_zyz({v[0], v[1], v[2]});
    if (n == "rotation_vector") r = spatial::rotation_exp({v[0], v[1], v[2]});
    if (n == "quaternion" || n == "axis_angle") {
      if (v.size() != 4)
        return error(ErrorCode::invalid_argument, count_given(v.size(), "number"),
                     n == "quaternion" ? "Give {w, x, y, z}." : "Give {x, y, z, angle}.", name);
      const double length = n == "quaternion"
                                ? std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + v[3] * v[3])
                                : spatial::norm({v[0], v[1], v[2]});
      if (!(length > 1e-12))
        return error(ErrorCode::invalid_argument,
                     n == "quaternion" ? "the quaternion is zero" : "the axis is zero",
                     "Give one with a length.", name);
      r = n == "quaternion" ? spatial::from_quaternion(
                                  {v[0] / length, v[1] / length, v[2] / length, v[3] / length})
                            : spatial::from_axis_angle({v[0], v[1], v[2]}, v[3]);
    }
    if (n == "pose") {
      const auto pose = pose_from(*args.find(name));
      if (pose) {
        r = pose->R;
        p = pose->p;
      }
    }
    if (n == "matrix") {
      const NumericArray& m = *args.find(name)->as_array();
      if (m.rows() != 3 || m.cols() != 3)
        return error(ErrorCode::invalid_argument,
                     "the matrix is " + std::to_string(m.rows()) + "x" + std::to_string(m.cols()) +
                         ", not 3x3",
                     "Give three rows of three numbers.", name);
      Pose t;
      for (std::size_t i = 0; i < 9; ++i) t.R[i] = m[i];
      if (!spatial::is_rigid(t, 1e-6))
        return error(ErrorCode::invalid_argument, "the matrix is not a rotation",
                     "Its columns must be perpendicular, of length 1, and right-handed.", name);
      r = t.R;
    }
  }
  if (given != 1)
    return error(ErrorCode::invalid_argument, std::to_string(given) + " rotations are given",
                 "Give exactly one of rpy, xyz, zyz, quaternion, axis_angle, rotation_vector, "
                 "matrix and pose.");
  const spatial::Quaternion q = spatial::to_quaternion(r);
  const Vec3 vector = spatial::rotation_log(r);
  const double angle = spatial::norm(vector);
  const Vec3 axis = angle > 0 ? spatial::unit(vector) : Vec3{0, 0, 1};
  return Value(Map{{"rpy", vec_value(spatial::to_rpy(r), "rad")},
                   {"xyz", vec_value(spatial::to_xyz(r), "rad")},
                   {"zyz", vec_value(spatial::to_zyz(r), "rad")},
                   {"quaternion", NumericArray({q.w, q.x, q.y, q.z})},
                   {"axis", vec_value(axis)},
                   {"angle", angle},
                   {"rotation_vector", vec_value(vector, "rad")},
                   {"matrix", NumericArray(std::vector<double>(r.begin(), r.end()), 3, 3)},
                   {"pose", pose_value(Pose{r, p})}});
}

Result<Value> compose(CommandContext&, const Map& args) {
  const auto a = pose_from(*args.find("a")), b = pose_from(*args.find("b"));
  return Value(pose_map(spatial::compose(*a, *b)));
}

Result<Value> invert(CommandContext&, const Map& args) {
  return Value(pose_map(spatial::inverse(*pose_from(*args.find("pose")))));
}

/// Where a transform lives: "pa10.base", "pa10.tool", or "cell.pa10".
struct Site {
  AnyId record;
  std::string member;  ///< "base", "tool", or a member of a world
  Placement placement;
};

Placement* member_placement(model::World& w, const std::string& name) {
  for (std::size_t i = 0; i < w.objects.size(); ++i)
    if (std::as_const(w.objects)[i].name == name) return &w.objects[i].placement;
  for (auto& m : w.robots)
    if (m.name == name) return &m.placement;
  for (auto& m : w.trajectories)
    if (m.name == name) return &m.placement;
  for (auto& m : w.frames)
    if (m.name == name) return &m.placement;
  for (auto& m : w.lights)
    if (m.name == name) return &m.placement;
  return nullptr;
}

Result<Site> find_site(const CommandContext& ctx, const std::string& id) {
  const auto dot = id.rfind('.');
  const std::string hint = "Write \"<robot>.base\", \"<robot>.tool\" or \"<world>.<member>\".";
  if (dot == std::string::npos)
    return error(ErrorCode::unknown_name, text::quote(id) + " does not name a transform", hint);
  Site s;
  s.member = id.substr(dot + 1);
  const std::string owner = id.substr(0, dot);
  if (s.member == "base" || s.member == "tool")
    if (const auto robot = ctx.snapshot().find(Kind::robot, owner)) {
      s.record = *robot;
      const auto& r = *ctx.snapshot().get(RobotId{robot->number});
      s.placement = s.member == "base" ? r.base : r.tool;
      return s;
    }
  if (const auto world = ctx.snapshot().find(Kind::world, owner)) {
    s.record = *world;
    model::World w = *ctx.snapshot().get(WorldId{world->number});
    if (const Placement* p = member_placement(w, s.member)) s.placement = *p;
    else if (s.member != kTarget) return no_member(w, s.member).in(name_in(ctx, *world));
    return s;
  }
  return error(ErrorCode::unknown_name, "there is no robot or world " + text::quote(owner), hint);
}

ParamSpec site_param() {
  return needed("id", "string", "", "\"<robot>.base\", \"<robot>.tool\" or \"<world>.<member>\".");
}
ParamSpec element_param() {
  return choice("element", {"P1", "P2", "P3", "O1", "O2", "O3", "PType", "OType", "RType"},
                "P1 to P3 position, O1 to O3 angles, PType and RType kind of position and "
                "reference, OType notation.",
                true);
}

int notation_code(AngleRepresentation n) {
  return n == AngleRepresentation::xyz ? 0 : n == AngleRepresentation::rpy ? 3 : 4;
}

Result<Value> get(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Site s, find_site(ctx, text_of(args, "id")));
  const std::string e = text_of(args, "element");
  if (e[0] == 'P' && e.size() == 2)
    return Value(s.placement.position[static_cast<std::size_t>(e[1] - '1')]);
  if (e[0] == 'O' && e.size() == 2)
    return Value(s.placement.angles[static_cast<std::size_t>(e[1] - '1')]);
  return Value(e == "OType" ? notation_code(s.placement.notation) : 0);
}

Result<Value> put(CommandContext& ctx, const Map& args, bool add) {
  RMP_TRY_ASSIGN(Site s, find_site(ctx, text_of(args, "id")));
  const std::string e = text_of(args, "element");
  if (e.ends_with("Type")) {
    RMP_TRY_ASSIGN(const Value v,
                   check_value(field("", "int", "", ""), *args.find("value"), "value"));
    const auto code = *v.as_int();
    if (add) return error(ErrorCode::unsupported, e + " cannot be added to", "Set it.");
    if (e != "OType" && code != 0)
      return error(ErrorCode::unsupported, e + " can only be 0 here: Cartesian and local",
                   "Convert the numbers first.");
    if (e == "OType") {
      if (code != 0 && code != 3 && code != 4)
        return error(ErrorCode::unsupported, "OType " + std::to_string(code) + " is not known",
                     "0 is XYZ, 3 roll-pitch-yaw, 4 ZYZ.");
      // The orientation stays, the numbers follow the notation.
      s.placement =
          model::placement(model::pose(s.placement), code == 0   ? AngleRepresentation::xyz
                                                     : code == 3 ? AngleRepresentation::rpy
                                                                 : AngleRepresentation::zyz);
    }
  } else {
    const bool position = e[0] == 'P';
    RMP_TRY_ASSIGN(const Value v, check_value(field("", "real", position ? "m" : "rad", ""),
                                              *args.find("value"), "value"));
    double& target = (position ? s.placement.position
                               : s.placement.angles)[static_cast<std::size_t>(e[1] - '1')];
    target = v.number() + (add ? target : 0);
  }
  auto done = ctx.edit().edit(s.record, [&](model::Record& r) -> Result<void> {
    if (auto* robot = std::get_if<model::Robot>(&r.body))
      (s.member == "base" ? robot->base : robot->tool) = s.placement;
    else if (auto* world = std::get_if<model::World>(&r.body)) {
      if (Placement* p = member_placement(*world, s.member)) *p = s.placement;
      else world->frames.push_back({s.member, s.placement});  // the target, until now the origin
    }
    return {};
  });
  if (!done.ok()) return std::move(done).error();
  return Value();
}
Result<Value> set(CommandContext& ctx, const Map& args) { return put(ctx, args, false); }
Result<Value> add(CommandContext& ctx, const Map& args) { return put(ctx, args, true); }

Result<Value> local(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Site s, find_site(ctx, text_of(args, "id")));
  return Value(pose_map(model::pose(s.placement)));
}

Result<Value> global(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Site s, find_site(ctx, text_of(args, "id")));
  if (s.member != "tool" || s.record.kind != Kind::robot)
    return Value(pose_map(model::pose(s.placement)));
  const RobotId id{s.record.number};
  RMP_TRY_ASSIGN(const auto m,
                 ctx.app.derived.robot_model(ctx.snapshot(), id, {0, 0, -9.81}, ctx.progress));
  const std::vector<double> q = robotics::home_joint_values(*ctx.snapshot().get(id));
  std::vector<Pose> frames(m->joints.size());
  robotics::forward_kinematics(*m, q, frames);
  return Value(pose_map(spatial::compose(m->base, robotics::tip_pose(*m, 0, frames))));
}

}  // namespace

RMP_COMMANDS(transform_commands) {
  std::vector<CommandSpec> all;
  const std::vector<ParamSpec> pose_fields{field("pose", "pose", "", "4x4 homogeneous matrix."),
                                           field("position", "vec3", "m", "Position."),
                                           field("rpy", "vec3", "rad", "Roll, pitch, yaw."),
                                           field("quaternion", "real[]", "", "w, x, y, z.")};
  all.push_back(
      {.name = "spatial.convert",
       .classic = "",
       .summary = "Shows one rotation in every notation, side by side.",
       .details =
           "rpy is R = Rz(yaw) Ry(pitch) Rx(roll), xyz R = Rx Ry Rz, zyz R = Rz Ry Rz. Where a "
           "notation is singular only the sum of two angles is defined and one of them is 0.",
       .example =
           "local c = spatial.convert{rpy = {0, 0, \"90 deg\"}}\nassert(math.abs(c.quaternion[4] - "
           "math.sqrt(0.5)) < 1e-15)\nassert(c.matrix[2][1] == 1)",
       .params = {optional("rpy", "vec3", "rad", "Roll, pitch, yaw."),
                  optional("xyz", "vec3", "rad", "Angles about the moving x, y and z axes."),
                  optional("zyz", "vec3", "rad", "Angles about the moving z, y and z axes."),
                  optional("quaternion", "real[]", "", "w, x, y, z of any length but zero."),
                  optional("axis_angle", "real[]", "", "Axis x, y, z and angle [rad]."),
                  optional("rotation_vector", "vec3", "rad", "Axis times angle."),
                  optional("matrix", "matrix", "", "3x3 rotation matrix."),
                  optional("pose", "pose", "", "A whole pose; its position is kept.")},
       .returns = {"map",
                   "",
                   "",
                   {field("rpy", "vec3", "rad", "Roll, pitch, yaw."),
                    field("xyz", "vec3", "rad", "Angles about moving x, y, z."),
                    field("zyz", "vec3", "rad", "Angles about moving z, y, z."),
                    field("quaternion", "real[]", "", "w, x, y, z with w >= 0."),
                    field("axis", "vec3", "", "Unit axis."),
                    field("angle", "real", "rad", "0 to pi."),
                    field("rotation_vector", "vec3", "rad", "Axis times angle."),
                    field("matrix", "matrix", "", "3x3."), field("pose", "pose", "", "4x4.")}},
       .effect = Effect::reads,
       .run = convert});
  all.push_back(
      {.name = "spatial.compose",
       .classic = "",
       .summary =
           "Composes two poses: b, given in frame a, as seen from the frame that a is given in.",
       .details = "",
       .example = "local t = spatial.compose({1, 0, 0, 0, 0, \"90 deg\"}, {1, 0, 0, 0, "
                  "0, 0})\nassert(math.abs(t.position[2] - 1) < 1e-15)",
       .params = {needed("a", "pose", "", "The first pose."),
                  needed("b", "pose", "", "The second, in the frame of the first.")},
       .returns = {"map", "", "", pose_fields},
       .effect = Effect::reads,
       .run = compose});
  all.push_back({.name = "spatial.invert",
                 .classic = "",
                 .summary = "Gives the inverse of a pose.",
                 .details = "",
                 .example = "assert(spatial.invert({1, 0, 0, 0, 0, 0}).position[1] == -1)",
                 .params = {needed("pose", "pose", "", "The pose.")},
                 .returns = {"map", "", "", pose_fields},
                 .effect = Effect::reads,
                 .run = invert});
  const char* const elements =
      "Elements as in the program of 2006: P1 P2 P3 [m], O1 O2 O3 [rad unless a unit is written], "
      "PType "
      "(0 Cartesian), OType (0 XYZ, 3 roll-pitch-yaw, 4 ZYZ), RType (0 local).";
  all.push_back({.name = "transform.get",
                 .classic = "Transform Get",
                 .summary = "Gives one element of a placement.",
                 .details = elements,
                 .example = with_arm("arm:set_tool{position = {0, 0, "
                                     "0.15}}\nassert(transform.get(\"arm.tool\", \"P3\") == 0.15)"),
                 .params = {site_param(), element_param()},
                 .returns = {"any", "", "Metres, radians, or a code.", {}},
                 .effect = Effect::reads,
                 .run = get});
  all.push_back(
      {.name = "transform.set",
       .classic = "Transform Set",
       .summary = "Sets one element of a placement.",
       .details = elements,
       .example = with_arm("transform.set(\"arm.tool\", \"P3\", \"150 "
                           "mm\")\nassert(arm:tool().position[3] == 0.15)"),
       .params = {site_param(), element_param(), needed("value", "any", "", "The value.")},
       .returns = {},
       .effect = Effect::edits,
       .run = set});
  all.push_back(
      {.name = "transform.add",
       .classic = "Transform Add",
       .summary = "Adds to one element of a placement.",
       .details = elements,
       .example = with_arm("transform.add(\"arm.tool\", \"P3\", 0.1)\ntransform.add(\"arm.tool\", "
                           "\"P3\", 0.1)\nassert(arm:tool().position[3] == 0.2)"),
       .params = {site_param(), element_param(), needed("value", "any", "", "What is added.")},
       .returns = {},
       .effect = Effect::edits,
       .run = add});
  all.push_back({.name = "transform.local_pose",
                 .classic = "Transform mLocal|Transform Get mLocal",
                 .summary = "Gives a placement as a pose in its parent.",
                 .details = "",
                 .example = with_arm("assert(transform.local_pose(\"arm.tool\").pose[1][1] == 1)"),
                 .params = {site_param()},
                 .returns = {"map", "", "", pose_fields},
                 .effect = Effect::reads,
                 .run = local});
  all.push_back(
      {.name = "transform.global_pose",
       .classic = "Transform mGlobal|Transform Get mGlobal",
       .summary =
           "Gives a placement as a pose in the frame of the world, or of the robot's mounting.",
       .details = "A tool is given at the robot's pose \"home\", or at zeros.",
       .example = with_arm(
           "assert(math.abs(transform.global_pose(\"arm.tool\").position[1] - 0.5) < 1e-12)"),
       .params = {site_param()},
       .returns = {"map", "", "", pose_fields},
       .effect = Effect::reads,
       .run = global});
  return all;
}

}  // namespace robomosp::ioci
