// SPDX-License-Identifier: Apache-2.0
#include "ioci/view/map_view.h"

#include <cmath>

#include "kernel/type.h"
#include "scene/voxels.h"

namespace robomosp::ioci {
namespace {

/// Axis of "x" or "-z" and its sign; nothing for other words.
std::optional<std::pair<std::size_t, double>> read_axis(std::string_view word) {
  const double sign = word.starts_with('-') ? -1.0 : 1.0;
  if (word.starts_with('-')) word.remove_prefix(1);
  if (word.size() != 1 || word[0] < 'x' || word[0] > 'z') return std::nullopt;
  return std::pair{static_cast<std::size_t>(word[0] - 'x'), sign};
}

Schema map_fields() {
  Schema s{
      needed("recording", "ref:recording", "",
             "Recording of robot.workspace or robot.reachability."),
      optional("column", "string", "",
               "Column for the colours; by default share, or manipulability if there is no share."),
      optional("cut", "any", "", "The plane; voxels on the side of its normal are left out."),
      between(defaulted("opacity", "real", "", 1.0, "1 = solid."), 0.01, 1),
      optional("low", "real", "", "Value of the lowest colour."),
      optional("high", "real", "", "Value of the highest colour."),
      optional("above", "real", "", "Voxels with a smaller value are left out."),
      between(defaulted("bands", "int", "", 20, "Colours."), 2, 100),
      optional("robot", "string", "", "Name of the robot in the world.")};
  return s;
}

/// Where the mounting frame of the map's robot is in the picture.
Result<Pose> mounting_of(const CommandContext& ctx, const recording::Recording& r, AnyId what,
                         const std::string& name) {
  if (what.kind == Kind::robot) return Pose{};
  const auto* world = what.kind == Kind::world ? ctx.snapshot().get(WorldId{what.number}) : nullptr;
  if (!world)
    return error(ErrorCode::invalid_argument, name_in(ctx, what) + " is neither robot nor world",
                 "Draw a robot or a world, or leave map out.", "map");
  std::vector<std::string> known;
  for (const model::PlacedRobot& p : world->robots) {
    known.push_back(p.name);
    const model::Record* record = ctx.snapshot().find(AnyId{Kind::robot, p.robot.number});
    if (name.empty() ? record && record->name == r.robot : p.name == name)
      return model::pose(p.placement);
  }
  if (!name.empty()) return unknown_name("robot", name, known);
  return error(ErrorCode::invalid_argument,
               "the world has no robot " + text::quote(r.robot) + ", to which the map belongs",
               "Name one of its robots in the field robot.", "map");
}

}  // namespace

Schema plane_fields() {
  return {optional("normal", "vec3", "", "Normal towards the removed side."),
          optional("axis", "string", "",
                   "x, y, z, -x, -y or -z instead of a normal: the removed side."),
          optional("point", "vec3", "m", "A point on the plane."),
          optional("offset", "real", "m",
                   "Instead of a point: distance of the plane from the origin along the axis "
                   "(x and -x both count along x) or the normal.")};
}

Schema section_fields() {
  Schema s = plane_fields();
  s.push_back(optional("colour", "any", "", "Colour of the cut faces."));
  s.push_back(defaulted("hatch", "bool", "", true, "Hatching of the cut faces."));
  return s;
}

namespace {

std::string placed_type(Schema s) {
  retype(s, "axis", "enum(x|y|z|-x|-y|-z) @when(normal is absent)");
  retype(s, "normal", "vec3 @when(axis is absent)");
  retype(s, "point", "vec3 @when(offset is absent)");
  retype(s, "offset", "real @when(point is absent)");
  return map_type(s);
}
std::string plane_type() { return placed_type(plane_fields()); }
std::string section_type() {
  Schema s = section_fields();
  retype(s, "colour", "colour");
  return placed_type(std::move(s));
}
std::string voxels_type() {
  Schema s = map_fields();
  retype(s, "column", "member:column of recording");
  retype(s, "cut", "string or type:plane");
  retype(s, "robot", "member:robot of id");
  return map_type(s);
}
const NamedType kPlaneType("plane", "map", plane_type);
const NamedType kSectionType("section", "map", section_type);
const NamedType kVoxelsType("voxels", "map", voxels_type);

}  // namespace

Result<Map> read_plane_map(const CommandContext& ctx, const Schema& fields, const Value& given,
                           std::string_view path) {
  Map table;
  if (given.as_string()) {
    table.set("axis", given);
  } else if (const Map* m = given.as_map()) {
    table = *m;
  } else {
    return error(ErrorCode::invalid_argument, given.text() + " is not a plane",
                 "Give an axis such as \"x\", or {normal = {0, 1, 0}, offset = 0.02}.",
                 std::string(path));
  }
  return read_map(ctx, fields, Value(std::move(table)), path);
}

Result<Plane> read_plane(const Map& s, const Vec3& through, std::string_view path) {
  const auto at = [&](const char* field) { return std::string(path) + "." + field; };
  Plane plane;
  double along = 1;  // offsets of -x count along x
  if (has(s, "axis") == has(s, "normal"))
    return error(ErrorCode::invalid_argument, "a plane must have either an axis or a normal",
                 "Give one of them.", std::string(path));
  if (has(s, "axis")) {
    const auto axis = read_axis(text_of(s, "axis"));
    if (!axis)
      return error(ErrorCode::invalid_argument, text::quote(text_of(s, "axis")) + " is not an axis",
                   "Axes are x, y, z, -x, -y and -z.", at("axis"));
    plane.normal[axis->first] = axis->second;
    along = axis->second;
  } else {
    plane.normal = vec3(s, "normal");
  }
  const Vec3& n = plane.normal;
  const double length = std::hypot(n[0], n[1], n[2]);
  if (!(length > 0))
    return error(ErrorCode::invalid_argument, "the normal is zero, so it has no direction",
                 "Give one that is not zero.", at("normal"));
  if (has(s, "point") && has(s, "offset"))
    return error(ErrorCode::invalid_argument, "a plane must have either a point or an offset",
                 "Give one of them.", std::string(path));
  if (has(s, "point")) plane.point = vec3(s, "point");
  else if (has(s, "offset"))
    for (std::size_t i = 0; i < 3; ++i) plane.point[i] = along * real(s, "offset") * n[i] / length;
  else plane.point = through;
  return plane;
}

Result<void> add_map(CommandContext& ctx, const Value& given, AnyId what, render::Scene& scene) {
  Map table;
  if (given.as_map()) table = *given.as_map();
  else table.set("recording", given);
  RMP_TRY_ASSIGN(const Map m, read_map(ctx, map_fields(), Value(std::move(table)), "map"));
  const auto recording = ctx.recording(*m.find("recording")->as_handle());
  scene::VoxelView view;
  const auto number = [&](const char* name) {
    return has(m, name) ? std::optional(real(m, name)) : std::nullopt;
  };
  if (has(m, "column")) view.column = text_of(m, "column");
  view.opacity = real(m, "opacity");
  view.low = number("low");
  view.high = number("high");
  view.above = number("above");
  view.bands = static_cast<std::size_t>(integer(m, "bands"));
  if (has(m, "cut")) {
    RMP_TRY_ASSIGN(const Map cut, read_plane_map(ctx, plane_fields(), *m.find("cut"), "map.cut"));
    RMP_TRY_ASSIGN(const Plane plane, read_plane(cut, {}, "map.cut"));
    view.cut = scene::VoxelView::Cut{plane.point, plane.normal};
  }
  RMP_TRY_ASSIGN(const Pose mounting,
                 mounting_of(ctx, *recording, what, has(m, "robot") ? text_of(m, "robot") : ""));
  return scene::add_voxels(scene, *recording, mounting, view);
}

}  // namespace robomosp::ioci
