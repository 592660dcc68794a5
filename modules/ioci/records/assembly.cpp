// SPDX-License-Identifier: Apache-2.0
// Features of solids and parts, and parts placed on each other by them.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "evaluation/features.h"
#include "ioci/core/commands.h"
#include "kernel/fresh_names.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

using evaluation::Features;
using evaluation::FeatureUse;
using model::Object;
using model::ObjectPart;

/// Features of a solid, or of all solids of an object, in its frame.
Result<Features> features_of(CommandContext& ctx, AnyId what) {
  return evaluation::features_of(ctx.app.derived, ctx.snapshot(), what, ctx.progress);
}
/// A selector as it was given: an index or words.
Result<evaluation::FeatureSelector> read_selector(const Value& given, std::string_view path) {
  if (given.is_number()) return evaluation::FeatureSelector(given.number());
  if (given.as_string()) return evaluation::FeatureSelector(*given.as_string());
  return error(ErrorCode::invalid_argument, given.text() + " is not a selector",
               std::string(evaluation::kSelectorHint), std::string(path));
}

// --- commands ------------------------------------------------------------------------------

Value feature_list(const Features& all) {
  List out;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const CsgFeature& f = all[i];
    Map m{{"index", static_cast<std::int64_t>(i + 1)},
          {"kind", evaluation::kind_word(f.kind)},
          {"point", vec_value(f.point, "m")}};
    if (f.direction != Vec3{}) m.set("direction", vec_value(f.direction));
    if (f.radius > 0) m.set("radius", f.radius);
    if (f.size > 0) m.set("size", f.size);
    if (f.kind == CsgFeature::Kind::cylinder || f.kind == CsgFeature::Kind::cone ||
        f.kind == CsgFeature::Kind::sphere)
      m.set("inward", f.inward);
    out.emplace_back(std::move(m));
  }
  return out;
}

Result<Value> assembly_features(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  if (!has(args, "part")) {
    RMP_TRY_ASSIGN(const Features all, features_of(ctx, id));
    return feature_list(all);
  }
  const Object& o = content<Object>(ctx, args);
  auto at = find_part(o, text_of(args, "part"));
  if (!at.ok()) return std::move(at).in(name_in(ctx, id)).error();
  RMP_TRY_ASSIGN(const Features all, features_of(ctx, o.parts[*at].what));
  return feature_list(all);
}

CsgFeature in_object(CsgFeature f, const Pose& t) {
  f.point = spatial::transform(t, f.point);
  f.direction = spatial::rotate(t, f.direction);
  return f;
}

/// Gives a part a placement as `object.set` does: expressions of the old one go.
Result<void> put(CommandContext& ctx, AnyId id, std::size_t at, const Pose& pose) {
  const Object& o = std::get<Object>(ctx.snapshot().find(id)->body);
  const ObjectPart& part = o.parts[at];
  const model::Placement placement = model::placement(pose, part.placement.notation);
  RMP_TRY(ctx.expressions.read_at(ctx.snapshot().find(id)->body, part.name + ".placement",
                                  placement_value(placement)));
  return change<Object>(ctx, id, [&](Object& edited) -> Result<void> {
    ctx.expressions.keep(edited.parametric);
    edited.parts[at].placement = placement;
    return {};
  });
}

Result<Value> place(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  const Object& o = content<Object>(ctx, args);
  const auto where = [&](auto r) { return std::move(r).in(name_in(ctx, id)).error(); };
  auto at = find_part(o, text_of(args, "part"));
  if (!at.ok()) return where(std::move(at));
  const ObjectPart& part = o.parts[*at];
  const std::string kind = text_of(args, "mate");
  evaluation::Mate mate;
  mate.use = kind == "face"   ? FeatureUse::face
             : kind == "axis" ? FeatureUse::axis
                              : FeatureUse::point;
  mate.flip = flag(args, "flip");
  mate.centre = flag(args, "centre");
  mate.offset = real(args, "offset");
  mate.angle = real(args, "angle");
  if (mate.use == FeatureUse::point && (mate.offset != 0 || mate.angle != 0 || mate.flip))
    return error(ErrorCode::invalid_argument, "point to point has no offset, angle or flip",
                 "Leave them out, or mate faces or axes.", name_in(ctx, id));
  const auto feature = [&](AnyId what, const std::string& whose,
                           const char* name) -> Result<CsgFeature> {
    RMP_TRY_ASSIGN(const auto selector, read_selector(*args.find(name), name));
    return evaluation::feature_of(ctx.app.derived, ctx.snapshot(), what, selector, mate.use, whose,
                                  name, ctx.progress);
  };
  auto own = feature(part.what, "part " + text::quote(part.name), "feature");
  if (!own.ok()) return where(std::move(own));
  CsgFeature on;
  if (has(args, "on")) {
    auto other = find_part(o, text_of(args, "on"));
    if (!other.ok()) return where(std::move(other));
    if (*other == *at)
      return error(ErrorCode::invalid_argument,
                   "part " + text::quote(part.name) + " cannot be placed on itself",
                   "Name another part, or leave on out for the object's own frame.",
                   name_in(ctx, id));
    const ObjectPart& onto = o.parts[*other];
    auto chosen = feature(onto.what, "part " + text::quote(onto.name), "on_feature");
    if (!chosen.ok()) return where(std::move(chosen));
    on = in_object(*chosen, model::pose(onto.placement));
  } else {
    auto selector = read_selector(*args.find("on_feature"), "on_feature");
    if (!selector.ok()) return where(std::move(selector));
    auto chosen =
        evaluation::choose_feature({}, *selector, mate.use, "the object's frame", "on_feature");
    if (!chosen.ok()) return where(std::move(chosen));
    on = *chosen;
  }
  const Pose after = evaluation::mated(model::pose(part.placement), *own, on, mate);
  RMP_TRY(put(ctx, id, *at, after));
  return Value(pose_map(after));
}

Result<Value> move_part(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  auto done = change<Object>(ctx, id, [&](Object& o) -> Result<void> {
    RMP_TRY_ASSIGN(const std::size_t from, find_part(o, text_of(args, "part")));
    const std::int64_t to = integer(args, "to");
    if (to < 1 || to > static_cast<std::int64_t>(o.parts.size()))
      return error(ErrorCode::invalid_argument,
                   "there is no place " + std::to_string(to) + " among " +
                       std::to_string(o.parts.size()) + " parts",
                   "Places are numbered from 1.");
    const auto first = o.parts.begin();
    const auto target = static_cast<std::size_t>(to - 1);
    const auto f = static_cast<std::ptrdiff_t>(from), t = static_cast<std::ptrdiff_t>(target);
    if (from < target) std::rotate(first + f, first + f + 1, first + t + 1);
    else std::rotate(first + t, first + f, first + f + 1);
    return {};
  });
  if (!done.ok()) return std::move(done).in(name_in(ctx, id)).error();
  return Value();
}

Result<Value> duplicate_part(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  const Vec3 step = vec3(args, "step");
  const double turn = real(args, "turn");
  const auto count = static_cast<std::size_t>(integer(args, "count"));
  List made;
  auto done = change<Object>(ctx, id, [&](Object& o) -> Result<void> {
    RMP_TRY_ASSIGN(const std::size_t from, find_part(o, text_of(args, "part")));
    const ObjectPart original = o.parts[from];
    FreshNames taken;
    for (const ObjectPart& p : o.parts) taken.take(p.name);
    std::vector<ObjectPart> copies;
    for (std::size_t i = 1; i <= count; ++i) {
      ObjectPart copy = original;
      copy.name = taken.fresh(original.name);
      const auto k = static_cast<double>(i);
      if (turn != 0 || step != Vec3{}) {
        Pose t = spatial::compose(spatial::rotation_z(k * turn), model::pose(original.placement));
        t.p = spatial::add(t.p, spatial::scale(step, k));
        if (turn != 0) copy.placement = model::placement(t, original.placement.notation);
        copy.placement.position = t.p;
        copy.placement.coordinates = model::PositionRepresentation::cartesian;
      }
      made.emplace_back(copy.name);
      copies.push_back(std::move(copy));
    }
    o.parts.insert(o.parts.begin() + static_cast<std::ptrdiff_t>(from) + 1, copies.begin(),
                   copies.end());
    return {};
  });
  if (!done.ok()) return std::move(done).in(name_in(ctx, id)).error();
  return Value(std::move(made));
}

const char* const kStack =
    "material.create{name = \"steel\", density = 7850}\n"
    "solid.create{name = \"plate\", material = \"steel\", root = {kind = \"difference\", children "
    "= {{kind = \"box\", x = 0.1, y = 0.1, z = 0.02}, {kind = \"cylinder\", radius = 0.01, height "
    "= 0.1, position = {0.03, 0, -0.01}}}}}\n"
    "solid.create{name = \"pin\", material = \"steel\", root = {kind = \"cylinder\", radius = "
    "0.01, height = 0.05}}\n"
    "local stack = object.create{name = \"stack\", parts = {{what = \"plate\"}, {what = "
    "\"pin\"}}}\n";
std::string with_stack(const char* rest) { return std::string(kStack) + rest; }

ReturnSpec features_returns() {
  return {"list",
          "",
          "Faces, edges, corners.",
          {field("index", "int", "", "Number for selectors."),
           field("kind", "string", "",
                 "plane, cylinder, cone, sphere, torus, line, circle, corner or other."),
           field("point", "vec3", "m", "Centroid, centre, or the middle on the axis."),
           field("direction", "vec3", "", "Outward normal, axis, or direction of an edge."),
           field("radius", "real", "m", "Radius of a round feature."),
           field("size", "real", "", "Area of a face [m^2], length of an edge [m]."),
           field("inward", "bool", "", "True for the wall of a hole.")}};
}

}  // namespace

RMP_COMMANDS(assembly_commands) {
  std::vector<CommandSpec> all;
  all.push_back({.name = "object.features",
                 .classic = "",
                 .summary = "Lists faces, edges and corners of an object or of one of its parts.",
                 .details = "In the frame of the object, or of the part if one is named. The order "
                            "stays the same as long as the solids do not change.",
                 .example = with_stack("assert(#stack:features{part = \"pin\"} >= 3)"),
                 .params = {self("object"), optional("part", "string", "", "One of its parts.")},
                 .returns = features_returns(),
                 .effect = Effect::reads,
                 .run = assembly_features});
  all.push_back(
      {.name = "object.place",
       .classic = "",
       .summary = "Places a part on another, by a face, an axis or a point of each.",
       .details =
           "face: the part's face is placed flush against the other, centre on centre (with centre "
           "= false it only moves across the plane); flip makes both normals point in the same "
           "direction, "
           "offset is the gap. axis: the axis of the part's cylinder, hole, circle or straight "
           "edge is aligned with the other axis, point on point, offset along it; flip reverses "
           "it. point: the part moves so that both points coincide. The part is rotated as little "
           "as possible, then by angle about the other's normal or axis. The placement is computed "
           "once and stored; later changes of either part do not move it.\n\nA selector is an "
           "index of object.features{part = ...}, or a description: top, bottom, left, right, "
           "front, back (faces by the part's own axes), largest, smallest, plane, cylinder, hole, "
           "shaft, cone, sphere, torus, circle, line, corner, radius 5 mm, near (x, y, z), such as "
           "\"largest plane\" or \"hole radius 10 mm\"; or an element of the frame such as origin, "
           "x axis, xy plane. It must match exactly one feature.",
       .example = with_stack(
           "stack:place{part = \"pin\", feature = \"bottom\", on = \"plate\", on_feature = "
           "\"top\"}\nassert(math.abs(stack:describe().parts[2].placement.position[3] - 0.02) < "
           "1e-12)\nstack:place{part = \"pin\", mate = \"axis\", feature = \"shaft\", on = "
           "\"plate\", on_feature = \"hole radius 10 "
           "mm\"}\nassert(math.abs(stack:describe().parts[2].placement.position[1] - 0.03) < "
           "1e-12)"),
       .params = {self("object"), needed("part", "string", "", "The part that moves."),
                  needed("feature", "any", "", "Selector of the feature on it."),
                  optional("on", "string", "",
                           "The part that stays; by default the object's frame."),
                  needed("on_feature", "any", "", "Selector of the feature on that part."),
                  choice("mate", {"face", "axis", "point"}, "The features to align."),
                  defaulted("flip", "bool", "", false, "Reverse the direction."),
                  defaulted("offset", "real", "m", 0.0,
                            "Distance along the other's normal or axis."),
                  defaulted("angle", "real", "rad", 0.0, "Rotation about it."),
                  defaulted("centre", "bool", "", true, "For faces: centre on centre.")},
       .returns = {"map",
                   "",
                   "Pose of the part in the object.",
                   {field("pose", "pose", "", "4x4 matrix."),
                    field("position", "vec3", "m", "Its origin."),
                    field("rpy", "vec3", "rad", "Roll, pitch, yaw."),
                    field("quaternion", "array", "", "w, x, y, z.")}},
       .effect = Effect::edits,
       .run = place});
  all.push_back(
      {.name = "object.move_part",
       .classic = "",
       .summary = "Moves a part to another place in the list.",
       .details = "Volume shared by several parts belongs to the part listed first.",
       .example = with_stack(
           "stack:move_part{part = \"pin\", to = 1}\nassert(stack:describe().parts[1].name == "
           "\"pin\")"),
       .params = {self("object"), needed("part", "string", "", "Its name."),
                  needed("to", "int", "", "Its new place; 1 is the first.")},
       .returns = {},
       .effect = Effect::edits,
       .run = move_part});
  all.push_back(
      {.name = "object.duplicate_part",
       .classic = "",
       .summary = "Adds copies of a part that share its solid or object.",
       .details = "Each copy is moved by step from the one before, and rotated by turn about the "
                  "object's z axis: rows and rings.",
       .example = with_stack(
           "local names = stack:duplicate_part{part = \"pin\", count = 3, step = {0.02, 0, "
           "0}}\nassert(#names == 3 and "
           "math.abs(stack:describe().parts[5].placement.position[1] - 0.06) < 1e-12)"),
       .params = {self("object"), needed("part", "string", "", "Its name."),
                  between(defaulted("count", "int", "", std::int64_t{1}, "Number of copies."), 1,
                          10000),
                  optional("step", "vec3", "m", "Translation from one copy to the next."),
                  defaulted("turn", "real", "rad", 0.0, "Translation from one copy to the next.")},
       .returns = {"list", "", "Names of the copies.", {}},
       .effect = Effect::edits,
       .run = duplicate_part});
  return all;
}

}  // namespace robomosp::ioci
