// SPDX-License-Identifier: Apache-2.0
// Rotations side by side in every notation, and the original's transforms: the placements of a
// robot's base and tool and of a world's members, element by element.
#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <numbers>
#include <optional>

#include "evaluation/attached_tools.h"
#include "ioci/core/commands.h"
#include "ioci/robot/shown_robot.h"
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

/// The site of a member named by itself: of the active world, else of the only world that has it.
Result<Site> member_site(const CommandContext& ctx, const std::string& name,
                         const std::string& hint) {
  const auto worlds = ctx.snapshot().list(Kind::world);
  std::vector<Site> found;
  std::vector<std::string> names;
  for (auto it = worlds.rbegin(); it != worlds.rend(); ++it) {
    model::World w = *ctx.snapshot().get(WorldId{it->number});
    const Placement* p = member_placement(w, name);
    if (!p) continue;
    found.push_back({*it, name, *p});
    names.push_back(ctx.snapshot().find(*it)->name + "." + name);
    if (it == worlds.rbegin()) break;
  }
  if (found.size() == 1) return std::move(found.front());
  if (found.empty())
    return error(ErrorCode::unknown_name, text::quote(name) + " does not name a transform", hint);
  return error(ErrorCode::conflict,
               "there are several transforms " + text::quote(name) + ": " + text::enumerate(names),
               "Write one of these names.");
}

Result<Site> find_site(const CommandContext& ctx, const std::string& id) {
  const std::string hint =
      "Write \"<robot>.base\", \"<robot>.tool\", \"<world>.<member>\" or \"<member>\".";
  const auto dot = id.rfind('.');
  if (dot == std::string::npos) return member_site(ctx, id, hint);
  Site s;
  s.member = id.substr(dot + 1);
  const std::string owner = id.substr(0, dot);
  if (s.member == "base" || s.member == "tool")
    if (const auto robot = ctx.snapshot().find(Kind::robot, owner)) {
      s.record = *robot;
      const auto& r = *ctx.snapshot().get(RobotId{robot->number});
      s.placement = r.base;
      if (s.member == "base") return s;
      RMP_TRY_ASSIGN(const model::Robot equipped,
                     evaluation::with_tool_frames(ctx.snapshot(), owner, r));
      s.placement = equipped.tool;
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
  return needed("id", "string", "",
                "\"<robot>.base\", \"<robot>.tool\", \"<world>.<member>\", or the member alone: of "
                "the active world, otherwise of the only world that has it.");
}
ParamSpec element_param() {
  return choice("element", {"P1", "P2", "P3", "O1", "O2", "O3", "PType", "OType", "RType"},
                "P1 to P3 position, O1 to O3 angles, PType and RType kind of position and "
                "reference, OType representation.",
                true);
}

using View = ClassicState::View;
constexpr double kDegree = std::numbers::pi / 180;

/// The frame in which the numbers of a tool count that is seen globally: that of its link, in the
/// mounting's frame, at the pose "home".
Result<Pose> parent_of(CommandContext& ctx, const Site& s) {
  if (s.member != "tool" || s.record.kind != Kind::robot) return Pose{};
  const RobotId id{s.record.number};
  RMP_TRY_ASSIGN(const auto m,
                 ctx.app.derived.robot_model(ctx.snapshot(), id, {0, 0, -9.81}, ctx.progress));
  const std::vector<double> q = robotics::home_joint_values(*ctx.snapshot().get(id));
  std::vector<Pose> frames(m->joints.size());
  robotics::forward_kinematics(*m, q, frames);
  return spatial::compose(spatial::compose(m->base, robotics::tip_pose(*m, 0, frames)),
                          spatial::inverse(model::pose(s.placement)));
}

/// The codes that say its placement as it is kept; OType of zyz is that of Euler Y.
View own_view(const Placement& p) {
  const int notation = p.notation == AngleRepresentation::xyz   ? 0
                       : p.notation == AngleRepresentation::zyz ? 2
                                                                : 3;
  return {static_cast<int>(p.coordinates), notation, 0};
}
bool same(const View& a, const View& b) {
  return a.position == b.position && a.orientation == b.orientation && a.reference == b.reference;
}
View view_of(CommandContext& ctx, const Site& s) {
  const std::lock_guard lock(ctx.app.classic.mutex);
  const auto known = ctx.app.classic.views.find({s.record, s.member});
  return known == ctx.app.classic.views.end() ? own_view(s.placement) : known->second;
}

/// P1 to P3 and O1 to O3 [m, rad].
using AngleElements = std::array<double, 6>;

/// The elements as the codes say. Of the program of 2006: roll-pitch-yaw is turned about z, y and x
/// by O1, O2 and O3; Euler X about z, the new x and the new z; of a quaternion they are x, y, z,
/// with w >= 0.
AngleElements elements_of(const Placement& p, const Pose& parent, const View& view) {
  if (same(view, own_view(p))) {
    Vec3 o = p.angles;
    if (p.notation == AngleRepresentation::rpy) std::swap(o[0], o[2]);
    return {p.position[0], p.position[1], p.position[2], o[0], o[1], o[2]};
  }
  Pose t = model::pose(p);
  if (view.reference == 1) t = spatial::compose(parent, t);
  Vec3 at = t.p, o{};
  if (view.position == 1) at = {std::hypot(t.p[0], t.p[1]), std::atan2(t.p[1], t.p[0]), t.p[2]};
  if (view.position == 2) {
    const double across = std::hypot(t.p[0], t.p[1]);
    at = {spatial::norm(t.p), std::atan2(t.p[1], t.p[0]), std::atan2(across, t.p[2])};
  }
  switch (view.orientation) {
    case 0: o = spatial::to_xyz(t.R); break;
    case 1: {  // z, x', z'' is z, y', z'' with the x axis where y was
      const Vec3 zyz = spatial::to_zyz(t.R);
      o = {zyz[0] + std::numbers::pi / 2, zyz[1], zyz[2] - std::numbers::pi / 2};
      break;
    }
    case 2: o = spatial::to_zyz(t.R); break;
    case 4: {
      const spatial::Quaternion q = spatial::to_quaternion(t.R);
      const double sign = q.w < 0 ? -1 : 1;
      o = {sign * q.x, sign * q.y, sign * q.z};
      break;
    }
    default: {
      const Vec3 rpy = spatial::to_rpy(t.R);
      o = {rpy[2], rpy[1], rpy[0]};
    }
  }
  return {at[0], at[1], at[2], o[0], o[1], o[2]};
}

/// The placement that has these elements, kept in the notation and coordinates of `kept`.
Result<Placement> placed_by(const AngleElements& e, const Pose& parent, const View& view,
                            const Placement& kept) {
  const Vec3 at{e[0], e[1], e[2]};
  Vec3 o{e[3], e[4], e[5]};
  if (same(view, own_view(kept))) {
    Placement p = kept;
    if (kept.notation == AngleRepresentation::rpy) std::swap(o[0], o[2]);
    p.position = at;
    p.angles = o;
    return p;
  }
  Pose t;
  t.p = model::position(Placement{
      at, {}, AngleRepresentation::rpy, static_cast<model::PositionRepresentation>(view.position)});
  switch (view.orientation) {
    case 0: t.R = spatial::from_xyz(o); break;
    case 1:
      t.R = spatial::from_zyz({o[0] - std::numbers::pi / 2, o[1], o[2] + std::numbers::pi / 2});
      break;
    case 2: t.R = spatial::from_zyz(o); break;
    case 4: {
      const double squares = o[0] * o[0] + o[1] * o[1] + o[2] * o[2];
      if (!(squares <= 1 + 1e-12))
        return error(ErrorCode::invalid_argument, "the quaternion would be longer than 1",
                     "O1, O2 and O3 are its x, y and z; w completes it to length 1.", "value");
      const double w = std::sqrt(std::max(0.0, 1 - squares)),
                   length = std::hypot(w, std::sqrt(squares));
      t.R = spatial::from_quaternion({w / length, o[0] / length, o[1] / length, o[2] / length});
      break;
    }
    default: t.R = spatial::from_rpy({o[2], o[1], o[0]});
  }
  if (view.reference == 1) t = spatial::compose(spatial::inverse(parent), t);
  return model::placement(t, kept.notation);
}

/// What an element is: its place among the six, its unit ("" = of a quaternion).
struct Element {
  std::size_t at = 0;
  std::string unit;
};
Element element_of(const std::string& name, const View& view) {
  const auto i = static_cast<std::size_t>(name[1] - '1');
  if (name[0] == 'O') return {3 + i, view.orientation == 4 ? "" : "rad"};
  const bool turns = (view.position > 0 && i == 1) || (view.position == 2 && i == 2);
  return {i, turns ? "rad" : "m"};
}

Result<Value> get(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Site s, find_site(ctx, text_of(args, "id")));
  const View view = view_of(ctx, s);
  const std::string e = text_of(args, "element");
  if (e == "PType") return Value(view.position);
  if (e == "OType") return Value(view.orientation);
  if (e == "RType") return Value(view.reference);
  Pose parent;
  if (view.reference == 1) {
    RMP_TRY_ASSIGN(parent, parent_of(ctx, s));
  }
  const Element element = element_of(e, view);
  const double x = elements_of(s.placement, parent, view)[element.at];
  return Value(element.unit == "rad" && in_degrees(args) ? x / kDegree : x);
}

/// PType, OType and RType: the transform stays, its numbers follow.
Result<void> put_code(CommandContext& ctx, Site& s, View view, const std::string& e,
                      const Value& given) {
  RMP_TRY_ASSIGN(const Value v, check_value(field("", "int", "", ""), given, "value"));
  const auto code = *v.as_int();
  const int most = e == "PType" ? 2 : e == "OType" ? 4 : 1;
  if (code < 0 || code > most)
    return error(ErrorCode::unsupported, e + " " + std::to_string(code) + " is not known",
                 e == "PType" ? "0 is Cartesian, 1 cylindrical, 2 spherical."
                 : e == "OType"
                     ? "0 is Euler XYZ, 1 Euler X, 2 Euler Y, 3 roll-pitch-yaw, 4 quaternion."
                     : "0 is local, 1 global.",
                 "value");
  (e == "PType"   ? view.position
   : e == "OType" ? view.orientation
                  : view.reference) = static_cast<int>(code);
  const bool has_notation = view.orientation == 0 || view.orientation == 2 || view.orientation == 3;
  if (e == "OType" && has_notation) {
    const auto notation = view.orientation == 0   ? AngleRepresentation::xyz
                          : view.orientation == 2 ? AngleRepresentation::zyz
                                                  : AngleRepresentation::rpy;
    if (notation != s.placement.notation) {
      const Placement turned = model::placement(model::pose(s.placement), notation);
      s.placement.angles = turned.angles;
      s.placement.notation = notation;
    }
  }
  if (e == "PType" && view.reference == 0) {
    const View local{view.position, own_view(s.placement).orientation, 0};
    const AngleElements now = elements_of(s.placement, Pose{}, local);
    s.placement.position = {now[0], now[1], now[2]};
    s.placement.coordinates = static_cast<model::PositionRepresentation>(view.position);
  }
  const std::lock_guard lock(ctx.app.classic.mutex);
  const std::pair key{s.record, s.member};
  if (same(view, own_view(s.placement))) ctx.app.classic.views.erase(key);
  else ctx.app.classic.views[key] = view;
  return {};
}

Result<Value> put(CommandContext& ctx, const Map& args, bool add) {
  RMP_TRY_ASSIGN(Site s, find_site(ctx, text_of(args, "id")));
  const std::string e = text_of(args, "element");
  const View view = view_of(ctx, s);
  if (e.ends_with("Type")) {
    Value code = *args.find("value");
    if (add) {
      RMP_TRY_ASSIGN(const Value more, check_value(field("", "int", "", ""), code, "value"));
      const int now = e == "PType"   ? view.position
                      : e == "OType" ? view.orientation
                                     : view.reference;
      code = Value(*more.as_int() > 100 || *more.as_int() < -100 ? *more.as_int()
                                                                 : *more.as_int() + now);
    }
    RMP_TRY(put_code(ctx, s, view, e, code));
  } else {
    const Element element = element_of(e, view);
    Value given = *args.find("value");
    std::optional<double> bare;
    if (given.is_number()) bare = given.number();
    else if (const std::string* word = given.as_string()) bare = text::read_real(*word);
    if (bare && element.unit == "rad" && in_degrees(args)) given = Value(*bare * kDegree);
    RMP_TRY_ASSIGN(const Value v, check_value(field("", "real", element.unit, ""), given, "value"));
    Pose parent;
    if (view.reference == 1) {
      RMP_TRY_ASSIGN(parent, parent_of(ctx, s));
    }
    AngleElements now = elements_of(s.placement, parent, view);
    now[element.at] = v.number() + (add ? now[element.at] : 0);
    RMP_TRY_ASSIGN(s.placement, placed_by(now, parent, view, s.placement));
  }
  auto done = ctx.edit().edit(s.record, [&](model::Record& r) -> Result<void> {
    if (auto* robot = std::get_if<model::Robot>(&r.body);
        robot && s.member == "tool" && !robot->tcp.empty())
      return error(
          ErrorCode::conflict,
          "the tool is the centre point " + text::quote(robot->tcp) + " of an attached tool",
          "Move it with object.set, or remove the tool with robot.detach.");
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
Result<Value> set_transform(CommandContext& ctx, const Map& args) { return put(ctx, args, false); }
Result<Value> add(CommandContext& ctx, const Map& args) { return put(ctx, args, true); }

Result<Value> local(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Site s, find_site(ctx, text_of(args, "id")));
  return Value(pose_map(model::pose(s.placement)));
}

Result<Value> global(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Site s, find_site(ctx, text_of(args, "id")));
  RMP_TRY_ASSIGN(const Pose parent, parent_of(ctx, s));
  return Value(pose_map(spatial::compose(parent, model::pose(s.placement))));
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
       .summary = "Shows one rotation in every representation, side by side.",
       .details = "rpy is R = Rz(yaw) Ry(pitch) Rx(roll), xyz R = Rx Ry Rz, zyz R = Rz Ry Rz. At a "
                  "singularity of a representation only the sum of two angles is defined and one "
                  "of them is 0.",
       .example =
           "local c = spatial.convert{rpy = {0, 0, \"90 deg\"}}\nassert(math.abs(c.quaternion[4] - "
           "math.sqrt(0.5)) < 1e-15)\nassert(c.matrix[2][1] == 1)",
       .params = {optional("rpy", "vec3", "rad", "Roll, pitch, yaw."),
                  optional("xyz", "vec3", "rad", "Angles about the moving x, y and z axes."),
                  optional("zyz", "vec3", "rad", "Angles about the moving z, y and z axes."),
                  optional("quaternion", "real[]", "", "w, x, y, z of any length except zero."),
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
           "Composes two poses: b, given in frame a, becomes relative to the parent frame of a.",
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
                 .summary = "Returns the inverse of a pose.",
                 .details = "",
                 .example = "assert(spatial.invert({1, 0, 0, 0, 0, 0}).position[1] == -1)",
                 .params = {needed("pose", "pose", "", "The pose.")},
                 .returns = {"map", "", "", pose_fields},
                 .effect = Effect::reads,
                 .run = invert});
  const char* const elements =
      "Elements as in the program of 2006: P1 P2 P3 by PType (0 Cartesian; 1 cylindrical: radius, "
      "angle, z; 2 spherical: radius, angle about z, angle from z), O1 O2 O3 by OType (0 Euler "
      "XYZ; 1 Euler X: about z, x', z''; 2 Euler Y: about z, y', z''; 3 roll-pitch-yaw: R = Rz(O1) "
      "Ry(O2) Rx(O3); 4 quaternion: x, y, z, with w >= 0), both by RType (0 local, 1 global). Bare "
      "angles are in the unit set by `angles`. Setting a type keeps the transform.";
  all.push_back({.name = "transform.get",
                 .classic = "Transform Get(element, angles=degrees)",
                 .summary = "Returns one element of a placement.",
                 .details = elements,
                 .example = with_arm("arm:set_tool{position = {0, 0, "
                                     "0.15}}\nassert(transform.get(\"arm.tool\", \"P3\") == 0.15)"),
                 .params = {site_param(), element_param(), angle_unit()},
                 .returns = {"any", "", "Metres, an angle, or a code.", {}},
                 .effect = Effect::reads,
                 .run = get});
  all.push_back({.name = "transform.set",
                 .classic = "Transform Set(element, value, angles=degrees)",
                 .summary = "Sets one element of a placement.",
                 .details = elements,
                 .example = with_arm("transform.set(\"arm.tool\", \"P3\", \"150 "
                                     "mm\")\nassert(arm:tool().position[3] == 0.15)"),
                 .params = {site_param(), element_param(), needed("value", "any", "", "The value."),
                            angle_unit()},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = set_transform});
  all.push_back(
      {.name = "transform.add",
       .classic = "Transform Add(element, value, angles=degrees)",
       .summary = "Adds to one element of a placement.",
       .details = elements,
       .example = with_arm("transform.add(\"arm.tool\", \"P3\", 0.1)\ntransform.add(\"arm.tool\", "
                           "\"P3\", 0.1)\nassert(arm:tool().position[3] == 0.2)"),
       .params = {site_param(), element_param(), needed("value", "any", "", "The increment."),
                  angle_unit()},
       .returns = {},
       .effect = Effect::edits,
       .run = add});
  all.push_back({.name = "transform.local_pose",
                 .classic = "Transform mLocal|Transform Get mLocal",
                 .summary = "Returns a placement as a pose in its parent.",
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
           "Returns a placement as a pose in the frame of the world, or of the robot's mounting.",
       .details = "For a tool, the robot's pose \"home\" is used, or zeros.",
       .example = with_arm(
           "assert(math.abs(transform.global_pose(\"arm.tool\").position[1] - 0.5) < 1e-12)"),
       .params = {site_param()},
       .returns = {"map", "", "", pose_fields},
       .effect = Effect::reads,
       .run = global});
  return all;
}

}  // namespace robomosp::ioci
