// SPDX-License-Identifier: Apache-2.0
// Edges of solids as curves: where they run, and how the faces beside them stand.
#include "ioci/records/solid_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "kernel/text.h"
#include "model/records.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

/// Two edges are equally near within this [m].
constexpr double kSameDistance = 1e-9;

constexpr std::string_view kWords[] = {"line", "circle", "curve"};

double distance_to(const CsgEdge& e, const Vec3& p) {
  if (e.kind == CsgEdge::Kind::circle) {
    const Vec3 from = spatial::sub(p, e.centre);
    const double above = spatial::dot(from, e.axis);
    const Vec3 flat = spatial::sub(from, spatial::scale(e.axis, above));
    const Vec3 start = spatial::sub(e.points.front().position, e.centre);
    double at =
        std::atan2(spatial::dot(spatial::cross(start, flat), e.axis), spatial::dot(start, flat));
    if (at < 0) at += 2 * std::numbers::pi;
    if (at <= e.angle || e.is_closed) return std::hypot(spatial::norm(flat) - e.radius, above);
    return std::min(spatial::norm(spatial::sub(p, e.points.front().position)),
                    spatial::norm(spatial::sub(p, e.points.back().position)));
  }
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < e.points.size(); ++i) {
    const Vec3 &a = e.points[i - 1].position, along = spatial::sub(e.points[i].position, a);
    const double square = spatial::dot(along, along);
    const double share =
        square > 0 ? std::clamp(spatial::dot(spatial::sub(p, a), along) / square, 0.0, 1.0) : 0;
    const Vec3 foot = spatial::add(a, spatial::scale(along, share));
    least = std::min(least, spatial::norm(spatial::sub(p, foot)));
  }
  return least;
}

Result<std::size_t> nearest(const std::vector<CsgEdge>& all, const Vec3& p, std::string_view path) {
  std::vector<double> far(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) far[i] = distance_to(all[i], p);
  const auto best =
      static_cast<std::size_t>(std::min_element(far.begin(), far.end()) - far.begin());
  for (std::size_t i = 0; i < all.size(); ++i)
    if (i != best && far[i] - far[best] <= kSameDistance)
      return error(ErrorCode::invalid_argument,
                   "the edges " + std::to_string(std::min(i, best) + 1) + " and " +
                       std::to_string(std::max(i, best) + 1) + " are equally near",
                   "Give a point near the middle of the edge, or its number.", std::string(path));
  return best;
}

Value place_list(const CsgEdge& e) {
  std::vector<double> numbers;
  for (const CsgEdgePoint& p : e.points)
    numbers.insert(numbers.end(), p.position.begin(), p.position.end());
  return NumericArray(std::move(numbers), e.points.size(), 3, "m");
}
Value normal_pair(const CsgEdgePoint& p) {
  const auto& n = p.normals;
  return NumericArray({n[0][0], n[0][1], n[0][2], n[1][0], n[1][1], n[1][2]}, 2, 3);
}

Map edge_map(const CsgEdge& e, std::size_t index) {
  const CsgEdgePoint &a = e.points.front(), &b = e.points.back();
  Map m{{"index", index + 1},
        {"kind", kWords[static_cast<std::size_t>(e.kind)]},
        {"length", e.length},
        {"is_closed", e.is_closed},
        {"start", vec_value(a.position, "m")},
        {"finish", vec_value(b.position, "m")},
        {"start_tangent", vec_value(a.tangent)},
        {"finish_tangent", vec_value(b.tangent)},
        {"start_normals", normal_pair(a)},
        {"finish_normals", normal_pair(b)},
        {"points", place_list(e)}};
  if (e.kind == CsgEdge::Kind::circle) {
    m.set("centre", vec_value(e.centre, "m"));
    m.set("axis", vec_value(e.axis));
    m.set("radius", e.radius);
    m.set("angle", e.angle);
  }
  return m;
}

Result<Value> edges(CommandContext& ctx, const Map& args) {
  const auto id = typed<model::Solid>(args);
  const double chord =
      has(args, "chord") ? real(args, "chord") : content<model::Solid>(ctx, args).chord;
  RMP_TRY_ASSIGN(const auto all, ctx.app.derived.edges(ctx.snapshot(), id, chord, ctx.progress));
  List out;
  if (has(args, "near")) {
    if (all->empty()) return Value(std::move(out));
    RMP_TRY_ASSIGN(const std::size_t i, nearest(*all, vec3(args, "near"), "near"));
    out.emplace_back(edge_map((*all)[i], i));
    return Value(std::move(out));
  }
  for (std::size_t i = 0; i < all->size(); ++i)
    if (!has(args, "kind") ||
        text_of(args, "kind") == kWords[static_cast<std::size_t>((*all)[i].kind)])
      out.emplace_back(edge_map((*all)[i], i));
  return Value(std::move(out));
}

}  // namespace

Result<std::vector<std::size_t>> read_edges(const std::vector<CsgEdge>& all, const List& given,
                                            std::string_view path) {
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < given.size(); ++i) {
    const std::string at = std::string(path) + "[" + std::to_string(i + 1) + "]";
    if (given[i].is_number()) {
      const double n = given[i].number();
      if (!(n >= 1 && n <= static_cast<double>(all.size())) || n != std::floor(n))
        return error(ErrorCode::invalid_argument,
                     "the solid has " + std::to_string(all.size()) + " edges, and no edge " +
                         text::print_rounded(n),
                     "solid.edges lists them.", at);
      chosen.push_back(static_cast<std::size_t>(n) - 1);
      continue;
    }
    RMP_TRY_ASSIGN(const Value place, check_value(needed("place", "vec3", "m", ""), given[i], at));
    const std::vector<double> p = reals(&place);
    if (all.empty()) return error(ErrorCode::invalid_argument, "the solid has no edges", {}, at);
    RMP_TRY_ASSIGN(const std::size_t found, nearest(all, {p[0], p[1], p[2]}, at));
    chosen.push_back(found);
  }
  return chosen;
}

RMP_COMMANDS(solid_edge_commands) {
  std::vector<CommandSpec> all;
  ParamSpec kind = field("kind", "enum", "", "Only edges of this type.");
  kind.choices.assign(std::begin(kWords), std::end(kWords));
  all.push_back(
      {.name = "solid.edges",
       .classic = "",
       .summary = "Lists the edges of a solid as curves, with the normals of their two faces.",
       .details = "trajectory.along_edges makes paths along them. The numbers stay the same as "
                  "long as the tree does not change.",
       .example = "local plate = solid.create{name = \"plate\", root = {kind = \"box\", x = 0.2, y "
                  "= 0.1, z = 0.01}}\n"
                  "local rim = plate:edges{near = {0.1, 0, 0.01}}[1]\n"
                  "assert(rim.kind == \"line\" and math.abs(rim.length - 0.1) < 1e-12)\n"
                  "assert(rim.start_normals[1][1] + rim.start_normals[2][1] == 1)",
       .params = {self("solid"), kind,
                  optional("near", "vec3", "m", "Only the edge nearest to this place."),
                  above_zero(optional("chord", "real", "m",
                                      "Greatest distance of a chord between two points from the "
                                      "edge; by default the chord of the solid."))},
       .returns =
           {"list",
            "",
            "",
            {field("index", "int", "", "Its number in the whole list."),
             field("kind", "string", "", "line, circle (or a part of one) or curve."),
             field("length", "real", "m", "Length along it."),
             field("is_closed", "bool", "", "Whether it ends at its start."),
             field("start", "vec3", "m", "Its first point."),
             field("finish", "vec3", "m", "Its last point."),
             field("start_tangent", "vec3", "", "Its direction there, a unit vector."),
             field("finish_tangent", "vec3", "", "Its direction there, a unit vector."),
             field("start_normals", "matrix", "",
                   "Outward normals of its two faces at the start, one row each."),
             field("finish_normals", "matrix", "", "The same at its end."),
             field("points", "matrix", "m", "Points on it, from start to end, one row each."),
             field("centre", "vec3", "m", "Centre of a circle."),
             field("axis", "vec3", "", "Axis of a circle, which runs counterclockwise about it."),
             field("radius", "real", "m", "Centre of a circle."),
             field("angle", "real", "rad", "Angle covered by a circle.")}},
       .effect = Effect::reads,
       .run = edges});
  return all;
}

}  // namespace robomosp::ioci
