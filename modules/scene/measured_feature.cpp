// SPDX-License-Identifier: Apache-2.0
// Finding the bodies, faces, edges, corners and frames that measurements take.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <span>
#include <utility>

#include "kernel/text.h"
#include "scene/leaf_parts.h"
#include "scene/measure.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::scene {
namespace {

using evaluation::Derived;
using spatial::add;
using spatial::cross;
using spatial::dot;
using spatial::norm;
using spatial::scale;
using spatial::sub;
using Feature = MeasuredFeature;
using FeatureKind = MeasuredFeature::Kind;
using Triangle = std::array<Vec3, 3>;

constexpr double kSinglePrecision = 4e-7;  ///< share by which coordinates of meshes are rounded
constexpr double kSameNormal = 1e-4;       ///< sine between normals of triangles of one plane
constexpr double kRoundness = 2e-3;        ///< greatest share by which points leave a circle
constexpr std::size_t kFewestOfCircle = 8;
constexpr std::size_t kSidesOfCircle = 1440;
constexpr double kFarAway = std::numeric_limits<double>::infinity();
constexpr std::size_t kMostNames = 12;

/// The solid of an item; its frame is that of the item's mesh.
struct Solid {
  SolidId id;
  double chord = 0;
};

/// An item that belongs to the body that is measured.
struct Part {
  ElementRef ref;
  const Mesh* mesh = nullptr;
  Pose world_T_mesh;
  std::optional<Solid> solid;  ///< none of generated bodies
};

Vec3 vertex(const Part& p, std::uint32_t i) {
  const auto& list = p.mesh->positions;
  return spatial::transform(p.world_T_mesh, {static_cast<double>(list[3 * std::size_t{i}]),
                                             static_cast<double>(list[3 * std::size_t{i} + 1]),
                                             static_cast<double>(list[3 * std::size_t{i} + 2])});
}
Triangle triangle(const Part& p, std::size_t t) {
  const auto& list = p.mesh->triangles;
  return {vertex(p, list[3 * t]), vertex(p, list[3 * t + 1]), vertex(p, list[3 * t + 2])};
}
/// Normal of a triangle, as long as twice its area.
Vec3 area_vector(const Triangle& t) { return cross(sub(t[1], t[0]), sub(t[2], t[0])); }

Vec3 nearest_on_side(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = sub(b, a);
  const double square = dot(along, along);
  const double share = square > 0 ? std::clamp(dot(sub(p, a), along) / square, 0.0, 1.0) : 0;
  return add(a, scale(along, share));
}
double distance_to_side(const Vec3& p, const Vec3& a, const Vec3& b) {
  return spatial::distance(p, nearest_on_side(p, a, b));
}
double distance_to_triangle(const Vec3& p, const Triangle& t) {
  const Vec3 u = sub(t[1], t[0]), v = sub(t[2], t[0]), n = cross(u, v), w = sub(p, t[0]);
  const double n2 = dot(n, n);
  if (n2 > 0) {
    const double second = dot(cross(u, w), n) / n2, first = dot(cross(w, v), n) / n2;
    if (first >= 0 && second >= 0 && first + second <= 1)
      return std::fabs(dot(w, n)) / std::sqrt(n2);
  }
  return std::min({distance_to_side(p, t[0], t[1]), distance_to_side(p, t[1], t[2]),
                   distance_to_side(p, t[2], t[0])});
}

// --- bodies --------------------------------------------------------------------------------

bool is_within(std::string_view name, std::string_view body) {
  return body.empty() || name == body ||
         (name.size() > body.size() && name.starts_with(body) && name[body.size()] == '.');
}

/// The solid or object that an item is a leaf of.
AnyId body_of_item(const Frame& frame, const Member& m, const PartOf& of) {
  if (m.kind == MemberKind::body) return m.what;
  const model::Robot* robot = frame.snapshot->get(RobotId{m.what.number});
  if (!robot) return {};
  const auto at = [](const auto& list, std::int32_t i) {
    return i >= 0 && static_cast<std::size_t>(i) < list.size()
               ? list[static_cast<std::size_t>(i)].what
               : AnyId{};
  };
  if (of.tool >= 0) return at(robot->attached, of.tool);
  if (of.link == 0) return at(robot->base_parts, of.part);
  if (of.link > 0 && static_cast<std::size_t>(of.link) <= robot->links.size())
    return at(robot->links[static_cast<std::size_t>(of.link) - 1].parts, of.part);
  return {};
}

Error no_body(const Frame& frame, const std::string& body, std::set<std::string> known,
              std::string_view path) {
  frame.for_each_member([&](const MemberPtr& m) {
    if (m->is_placed && (m->kind == MemberKind::body || m->kind == MemberKind::robot))
      known.insert(m->name);
  });
  std::vector<std::string> names;
  for (const std::string& each : known) {
    if (names.size() == kMostNames) {
      names.emplace_back("...");
      break;
    }
    names.push_back(text::quote(each));
  }
  return error(
      ErrorCode::unknown_name, "nothing in the picture is named " + text::quote(body),
      names.empty() ? "Nothing is shown there." : "Names are " + text::enumerate(names) + ".",
      std::string(path) + ".body");
}

/// The name of the body that an item is. `leaf`, if known, spares listing all leaves of the member.
std::string name_of(const Frame& frame, const ElementRef& ref, const LeafPart* leaf = nullptr) {
  if (leaf && ref.member->kind == MemberKind::body) {
    const std::string own = ref.member->is_placed ? ref.member->name : std::string();
    if (leaf->steps.empty()) return own;
    return own.empty() ? leaf->name : own + "." + leaf->name;
  }
  const auto origin = pick(frame, ref);
  if (origin.ok()) return body_of(*origin);
  return ref.member->is_placed ? ref.member->name : std::string();
}

/// All items of a body.
Result<std::vector<Part>> parts_of(const Frame& frame, const std::string& body,
                                   std::string_view path) {
  std::vector<Part> out;
  std::set<std::string> known;
  std::optional<Error> failure;
  std::map<AnyId, std::vector<LeafPart>> leaves;
  const auto see = [&](const MemberPtr& m) {
    if (m->kind != MemberKind::body && m->kind != MemberKind::robot) return;
    const std::string own = m->is_placed ? m->name : std::string();
    // A member of another name can have no part of that name.
    if (!own.empty() && !is_within(body, own) && !is_within(own, body)) return;
    const ShapePtr& shape = m->shape(ShapeLayer::bodies);
    if (!shape) return;
    if (shape->failure && !failure) failure = shape->failure;
    for (std::size_t i = 0; i < shape->items.size(); ++i) {
      const Element<render::Item>& e = shape->items[i];
      if (!e.what.mesh) continue;
      ElementRef ref{ElementKind::item, ShapeLayer::bodies, static_cast<std::uint32_t>(i), m};
      const LeafPart* leaf = nullptr;
      if (e.of.leaf >= 0) {
        const AnyId what = body_of_item(frame, *m, e.of);
        auto at = leaves.find(what);
        if (at == leaves.end()) at = leaves.emplace(what, leaf_parts(*frame.snapshot, what)).first;
        const auto n = static_cast<std::size_t>(e.of.leaf);
        if (n < at->second.size()) leaf = &at->second[n];
      }
      if (!is_within(own, body)) {
        const std::string name = name_of(frame, ref, leaf);
        if (known.size() <= kMostNames) known.insert(name);
        if (!is_within(name, body)) continue;
      }
      Part part{ref, e.what.mesh.get(), item_of(ref).pose, std::nullopt};
      if (leaf)
        if (const model::Solid* solid = frame.snapshot->get(leaf->solid))
          part.solid = Solid{leaf->solid, solid->chord};
      out.push_back(std::move(part));
    }
  };
  frame.for_each_member(see);
  if (!out.empty()) return out;
  if (frame.failure) return Error(*frame.failure);
  if (failure) return Error(*failure);
  bool is_member = false;
  frame.for_each_member(
      [&](const MemberPtr& m) { is_member = is_member || (m->is_placed && m->name == body); });
  if (is_member || body.empty())
    return error(ErrorCode::invalid_argument,
                 body.empty() ? std::string("nothing with a surface is shown")
                              : text::quote(body) + " has no surface",
                 "Measure to its frame, or to a point.", std::string(path) + ".body");
  return no_body(frame, body, std::move(known), path);
}

// --- the shape behind an item --------------------------------------------------------------

CsgFeature moved(CsgFeature f, const Pose& world_T_solid) {
  f.point = spatial::transform(world_T_solid, f.point);
  f.direction = spatial::rotate(world_T_solid, f.direction);
  return f;
}

/// The features of the solid of an item, in the world; none where it has no solid, or its engine
/// knows none.
Result<std::vector<CsgFeature>> features_of(const Frame& frame, Derived& derived, const Part& part,
                                            Progress& progress) {
  std::vector<CsgFeature> out;
  if (!part.solid) return out;
  const auto all = derived.features(*frame.snapshot, part.solid->id, progress);
  if (!all.ok()) {
    if (all.error().code == ErrorCode::cancelled) return Error(all.error());
    return out;
  }
  out.reserve((*all)->size());
  for (const CsgFeature& f : **all) out.push_back(moved(f, part.world_T_mesh));
  return out;
}

/// True if all faces are flat and all edges straight, so that triangles are exact.
bool are_straight(std::span<const CsgFeature> features) {
  return !features.empty() &&
         std::all_of(features.begin(), features.end(), [](const CsgFeature& f) {
           return f.kind == CsgFeature::Kind::plane || f.kind == CsgFeature::Kind::line ||
                  f.kind == CsgFeature::Kind::corner;
         });
}

// --- faces ---------------------------------------------------------------------------------

/// Triangles of the face that triangle `seed` of an item is in: the engine's face, else all that
/// lie in one plane with it and hang together.
std::vector<Triangle> triangles_of_face(const Part& p, std::size_t seed) {
  std::vector<Triangle> out;
  for (const Mesh::Face& face : p.mesh->faces)
    if (seed >= face.first_triangle &&
        seed < std::size_t{face.first_triangle} + face.triangle_count)
      for (std::size_t t = 0; t < face.triangle_count; ++t)
        out.push_back(triangle(p, face.first_triangle + t));
  if (!out.empty()) return out;
  const std::size_t count = p.mesh->triangle_count();
  using Corner = std::array<float, 3>;
  std::map<Corner, std::vector<std::size_t>> at;
  const auto corner = [&](std::size_t t, std::size_t k) {
    const std::size_t v = p.mesh->triangles[3 * t + k];
    return Corner{p.mesh->positions[3 * v], p.mesh->positions[3 * v + 1],
                  p.mesh->positions[3 * v + 2]};
  };
  for (std::size_t t = 0; t < count; ++t)
    for (std::size_t k = 0; k < 3; ++k) at[corner(t, k)].push_back(t);
  const Vec3 normal = spatial::unit(area_vector(triangle(p, seed)));
  std::vector<bool> is_seen(count);
  std::vector<std::size_t> open{seed};
  is_seen[seed] = true;
  while (!open.empty()) {
    const std::size_t t = open.back();
    open.pop_back();
    out.push_back(triangle(p, t));
    for (std::size_t k = 0; k < 3; ++k)
      for (const std::size_t next : at[corner(t, k)]) {
        if (is_seen[next]) continue;
        const Vec3 n = area_vector(triangle(p, next));
        if (norm(cross(n, normal)) > kSameNormal * norm(n) || dot(n, normal) < 0) continue;
        is_seen[next] = true;
        open.push_back(next);
      }
  }
  return out;
}

/// How far points may be from a surface through them, for their single precision [m].
double rounding_of(std::span<const Triangle> triangles, const Part& p) {
  double size = 0;
  for (const Triangle& t : triangles)
    for (const Vec3& v : t) size = std::max(size, spatial::distance(v, p.world_T_mesh.p));
  return kSinglePrecision * size + 1e-9;
}

/// Whether a surface goes through the corners of triangles; `chord`: by how much those of curved
/// ones may miss it.
bool goes_through(const CsgFeature& f, std::span<const Triangle> triangles, double rounding,
                  double chord) {
  const double curved = rounding + chord;
  double slope = 0, highest = 0;              // of a cone
  double least = kFarAway, most = -kFarAway;  // distances from the ring of a torus
  for (const Triangle& t : triangles)
    for (const Vec3& v : t) {
      const Vec3 w = sub(v, f.point);
      const double height = dot(w, f.direction);
      const double off = norm(sub(w, scale(f.direction, height)));
      switch (f.kind) {
        case CsgFeature::Kind::plane:
          if (std::fabs(height) > rounding) return false;
          break;
        case CsgFeature::Kind::cylinder:
          if (std::fabs(off - f.radius) > curved) return false;
          break;
        case CsgFeature::Kind::sphere:
          if (std::fabs(norm(w) - f.radius) > curved) return false;
          break;
        case CsgFeature::Kind::cone:
          if (std::fabs(height) > highest)
            highest = std::fabs(height), slope = (off - f.radius) / height;
          break;
        case CsgFeature::Kind::torus: {
          const double tube = std::hypot(off - f.radius, height);
          least = std::min(least, tube), most = std::max(most, tube);
          break;
        }
        default: return false;
      }
    }
  if (f.kind == CsgFeature::Kind::torus) return most - least <= 2 * curved;
  if (f.kind == CsgFeature::Kind::cone)
    for (const Triangle& t : triangles)
      for (const Vec3& v : t) {
        const Vec3 w = sub(v, f.point);
        const double height = dot(w, f.direction);
        const double off = norm(sub(w, scale(f.direction, height)));
        if (std::fabs(off - f.radius - slope * height) > 2 * curved) return false;
      }
  if (f.kind == CsgFeature::Kind::plane) {
    Vec3 normal{};
    for (const Triangle& t : triangles) normal = add(normal, area_vector(t));
    return dot(normal, f.direction) > 0;
  }
  return true;
}

FeatureKind kind_of(CsgFeature::Kind kind) {
  switch (kind) {
    case CsgFeature::Kind::plane: return FeatureKind::plane;
    case CsgFeature::Kind::cylinder: return FeatureKind::cylinder;
    case CsgFeature::Kind::cone: return FeatureKind::cone;
    case CsgFeature::Kind::sphere: return FeatureKind::sphere;
    case CsgFeature::Kind::torus: return FeatureKind::torus;
    case CsgFeature::Kind::line: return FeatureKind::line;
    case CsgFeature::Kind::circle: return FeatureKind::circle;
    case CsgFeature::Kind::corner: return FeatureKind::corner;
    case CsgFeature::Kind::other: break;
  }
  return FeatureKind::surface;
}

/// Moves corners of triangles, which meshes give in single precision, to the exact corners of the
/// solid, or to the surface.
void straighten(std::vector<Triangle>& triangles, const CsgFeature& f,
                std::span<const Vec3> corners, double rounding) {
  for (Triangle& t : triangles)
    for (Vec3& v : t) {
      const Vec3* exact = nullptr;
      double least = rounding;
      for (const Vec3& c : corners)
        if (const double d = spatial::distance(c, v); d <= least) exact = &c, least = d;
      if (exact) {
        v = *exact;
      } else if (f.kind == CsgFeature::Kind::plane) {
        v = sub(v, scale(f.direction, dot(sub(v, f.point), f.direction)));
      } else if (f.kind == CsgFeature::Kind::sphere) {
        v = add(f.point, scale(spatial::unit(sub(v, f.point)), f.radius));
      } else if (f.kind == CsgFeature::Kind::cylinder) {
        const double height = dot(sub(v, f.point), f.direction);
        const Vec3 foot = add(f.point, scale(f.direction, height));
        v = add(foot, scale(spatial::unit(sub(v, foot)), f.radius));
      }
    }
}

constexpr std::size_t kMostSnaps = 4'000'000;  ///< pairs of corners that are compared

/// Corners of a face's solid for straighten(); none where there are too many.
std::vector<Vec3> corners_of(std::span<const CsgFeature> features, std::size_t triangles) {
  std::vector<Vec3> out;
  for (const CsgFeature& f : features)
    if (f.kind == CsgFeature::Kind::corner) out.push_back(f.point);
  if (out.size() * triangles > kMostSnaps) out.clear();
  return out;
}

Result<Feature> find_face(const Frame& frame, Derived& derived, const std::vector<Part>& parts,
                          const Vec3& place, Progress& progress) {
  double least = kFarAway;
  const Part* nearest = nullptr;
  std::size_t seed = 0;
  for (const Part& p : parts) {
    if (progress.cancelled()) return error(ErrorCode::cancelled, "measuring was cancelled");
    for (std::size_t t = 0; t < p.mesh->triangle_count(); ++t)
      if (const double d = distance_to_triangle(place, triangle(p, t)); d < least)
        least = d, nearest = &p, seed = t;
  }
  if (!nearest) return error(ErrorCode::invalid_argument, "nothing there has a surface");
  Feature out;
  out.body = name_of(frame, nearest->ref);
  out.pieces = triangles_of_face(*nearest, seed);
  double twice = 0;
  Vec3 normal{}, moment{};
  for (const Triangle& t : out.pieces) {
    const Vec3 a = area_vector(t);
    const double size = norm(a);
    twice += size;
    normal = add(normal, a);
    moment = add(moment, scale(add(t[0], add(t[1], t[2])), size / 3));
  }
  out.area = twice / 2;
  const double rounding = rounding_of(out.pieces, *nearest);
  const auto& solid = nearest->solid;
  if (solid) {
    RMP_TRY_ASSIGN(const auto features, features_of(frame, derived, *nearest, progress));
    const CsgFeature* best = nullptr;
    for (const CsgFeature& f : features)
      if (goes_through(f, out.pieces, rounding, solid->chord) &&
          (!best || std::fabs(f.size - out.area) < std::fabs(best->size - out.area)))
        best = &f;
    if (best) {
      out.kind = kind_of(best->kind);
      out.point = best->point;
      out.direction = best->direction;
      out.radius = best->radius;
      out.area = best->size;
      out.is_inward = best->inward;
      // A plane with curved borders is cut off by chords.
      out.bound = out.is_plane() && are_straight(features) ? 0 : solid->chord;
      straighten(out.pieces, *best, corners_of(features, out.pieces.size()), rounding);
      return out;
    }
    out.bound = solid->chord;
  }
  out.is_of_mesh = true;
  out.kind = FeatureKind::surface;
  // Flat, as far as its triangles tell.
  const Vec3 mean = spatial::unit(normal);
  const Vec3 centre = scale(moment, twice > 0 ? 1 / twice : 0);
  bool is_flat = twice > 0;
  for (const Triangle& t : out.pieces)
    for (const Vec3& v : t) is_flat = is_flat && std::fabs(dot(sub(v, centre), mean)) <= rounding;
  if (is_flat) {
    out.kind = FeatureKind::plane;
    out.point = centre;
    out.direction = mean;
  }
  return out;
}

// --- edges and corners ---------------------------------------------------------------------

/// A curve as it is found in a solid or a mesh, in the world.
struct Curve {
  FeatureKind kind = FeatureKind::curve;
  std::vector<Vec3> points;
  double length = 0, radius = 0, angle = 0, bound = 0;
  Vec3 centre{}, axis{};
  bool is_of_mesh = false;
  const Part* part = nullptr;
};

/// The circle that points lie on, if they do: a full one or an arc.
bool make_circle(Curve& c) {
  const std::size_t n = c.points.size();
  if (n < kFewestOfCircle) return false;
  const Vec3 &p = c.points[0], &q = c.points[n / 3], &r = c.points[2 * n / 3];
  const Vec3 u = sub(q, p), v = sub(r, p), w = cross(u, v);
  const double w2 = dot(w, w);
  if (w2 < 1e-12 * dot(u, u) * dot(v, v)) return false;
  // The centre of three points, from their sides and the normal of their plane.
  const Vec3 to =
      scale(sub(scale(cross(w, u), dot(v, v)), scale(cross(w, v), dot(u, u))), 0.5 / w2);
  const Vec3 centre = add(p, to), axis = scale(w, 1 / std::sqrt(w2));
  const double radius = norm(to);
  for (const Vec3& each : c.points) {
    const Vec3 from = sub(each, centre);
    if (std::fabs(norm(from) - radius) > kRoundness * radius ||
        std::fabs(dot(from, axis)) > kRoundness * radius)
      return false;
  }
  c.kind = FeatureKind::circle;
  c.centre = centre;
  c.axis = axis;
  c.radius = radius;
  c.angle = c.length / radius;
  return true;
}

double distance_to_curve(const Vec3& place, const Curve& c) {
  double least = kFarAway;
  for (std::size_t i = 1; i < c.points.size(); ++i)
    least = std::min(least, distance_to_side(place, c.points[i - 1], c.points[i]));
  return least;
}

/// The points of a circle close enough together for measuring.
void make_fine(Curve& c) {
  const Vec3 start = sub(c.points.front(), c.centre);
  const Vec3 u = sub(start, scale(c.axis, dot(start, c.axis)));
  const Vec3 v = cross(c.axis, u);
  const auto sides = std::max<std::size_t>(
      8, static_cast<std::size_t>(std::ceil(kSidesOfCircle * c.angle / (2 * std::numbers::pi))));
  c.points.clear();
  for (std::size_t i = 0; i <= sides; ++i) {
    const double t = c.angle * static_cast<double>(i) / static_cast<double>(sides);
    c.points.push_back(add(c.centre, add(scale(u, std::cos(t)), scale(v, std::sin(t)))));
  }
  c.bound = c.radius * (1 - std::cos(c.angle / static_cast<double>(2 * sides)));
}

/// Calls see(Curve) for all edges of the parts.
Result<void> for_each_edge(const Frame& frame, Derived& derived, const std::vector<Part>& parts,
                           Progress& progress, const std::function<void(Curve)>& see) {
  for (const Part& p : parts) {
    if (progress.cancelled()) return error(ErrorCode::cancelled, "measuring was cancelled");
    const auto& solid = p.solid;
    if (solid && !p.mesh->edge_sizes.empty()) {
      const auto edges = derived.edges(*frame.snapshot, solid->id, solid->chord, progress);
      if (!edges.ok() && edges.error().code == ErrorCode::cancelled) return Error(edges.error());
      if (edges.ok() && !(*edges)->empty()) {
        for (const CsgEdge& e : **edges) {
          Curve c;
          c.kind = e.kind == CsgEdge::Kind::line     ? FeatureKind::line
                   : e.kind == CsgEdge::Kind::circle ? FeatureKind::circle
                                                     : FeatureKind::curve;
          for (const CsgEdgePoint& at : e.points)
            c.points.push_back(spatial::transform(p.world_T_mesh, at.position));
          c.length = e.length;
          c.radius = e.radius;
          c.angle = e.angle;
          c.bound = e.kind == CsgEdge::Kind::curve ? solid->chord : 0;
          c.centre = spatial::transform(p.world_T_mesh, e.centre);
          c.axis = spatial::rotate(p.world_T_mesh, e.axis);
          c.part = &p;
          see(std::move(c));
        }
        continue;
      }
    }
    std::size_t from = 0;
    for (const std::uint32_t size : p.mesh->edge_sizes) {
      const std::size_t first = from;
      from += size;
      if (3 * from > p.mesh->edge_points.size()) break;
      Curve c;
      for (std::size_t i = first; i < from; ++i)
        c.points.push_back(spatial::transform(
            p.world_T_mesh, {static_cast<double>(p.mesh->edge_points[3 * i]),
                             static_cast<double>(p.mesh->edge_points[3 * i + 1]),
                             static_cast<double>(p.mesh->edge_points[3 * i + 2])}));
      if (c.points.size() < 2) continue;
      for (std::size_t i = 1; i < c.points.size(); ++i)
        c.length += spatial::distance(c.points[i - 1], c.points[i]);
      if (c.points.size() == 2) c.kind = FeatureKind::line;
      c.is_of_mesh = true;
      c.part = &p;
      see(std::move(c));
    }
  }
  return {};
}

Result<Feature> find_edge(const Frame& frame, Derived& derived, const std::vector<Part>& parts,
                          const Vec3& place, std::string_view path, Progress& progress) {
  std::optional<Curve> best;
  double least = kFarAway;
  RMP_TRY(for_each_edge(frame, derived, parts, progress, [&](Curve c) {
    if (const double d = distance_to_curve(place, c); d < least) least = d, best = std::move(c);
  }));
  if (!best)
    return error(ErrorCode::invalid_argument, "it has no edges", "Measure to a face or a body.",
                 std::string(path));
  if (best->is_of_mesh && best->kind == FeatureKind::curve) make_circle(*best);
  Feature out;
  out.kind = best->kind;
  out.body = name_of(frame, best->part->ref);
  out.is_of_mesh = best->is_of_mesh;
  out.length = best->length;
  out.ends = {best->points.front(), best->points.back()};
  if (out.kind == FeatureKind::circle) {
    out.point = best->centre;
    out.direction = best->axis;
    out.radius = best->radius;
    out.angle = best->angle;
    if (!best->is_of_mesh) make_fine(*best);
  } else if (out.kind == FeatureKind::line) {
    out.point = scale(add(out.ends[0], out.ends[1]), 0.5);
    out.direction = spatial::unit(sub(out.ends[1], out.ends[0]));
  }
  out.bound = best->bound;
  for (std::size_t i = 1; i < best->points.size(); ++i)
    out.pieces.push_back({best->points[i - 1], best->points[i], best->points[i]});
  return out;
}

Feature point_feature(FeatureKind kind, const Vec3& at) {
  Feature out;
  out.kind = kind;
  out.point = at;
  out.ends = {at, at};
  out.pieces.push_back({at, at, at});
  return out;
}

Result<Feature> find_corner(const Frame& frame, Derived& derived, const std::vector<Part>& parts,
                            const Vec3& place, std::string_view path, Progress& progress) {
  double least = kFarAway;
  Vec3 best{};
  const Part* part = nullptr;
  bool is_of_mesh = false;
  const auto offer = [&](const Vec3& at, const Part& p, bool of_mesh) {
    if (const double d = spatial::distance(at, place); d < least)
      least = d, best = at, part = &p, is_of_mesh = of_mesh;
  };
  for (const Part& p : parts) {
    if (progress.cancelled()) return error(ErrorCode::cancelled, "measuring was cancelled");
    RMP_TRY_ASSIGN(const auto features, features_of(frame, derived, p, progress));
    for (const CsgFeature& f : features)
      if (f.kind == CsgFeature::Kind::corner) offer(f.point, p, false);
    if (!features.empty()) continue;
    std::size_t from = 0;
    for (const std::uint32_t size : p.mesh->edge_sizes) {
      const std::size_t first = from;
      from += size;
      if (size == 0 || 3 * from > p.mesh->edge_points.size()) continue;
      for (const std::size_t i : {first, from - 1})
        offer(spatial::transform(p.world_T_mesh,
                                 {static_cast<double>(p.mesh->edge_points[3 * i]),
                                  static_cast<double>(p.mesh->edge_points[3 * i + 1]),
                                  static_cast<double>(p.mesh->edge_points[3 * i + 2])}),
              p, true);
    }
  }
  if (!part)
    return error(ErrorCode::invalid_argument, "it has no corners", "Measure to a face or an edge.",
                 std::string(path));
  Feature out = point_feature(FeatureKind::corner, best);
  out.body = name_of(frame, part->ref);
  out.is_of_mesh = is_of_mesh;
  return out;
}

Result<Feature> whole_body(const Frame& frame, Derived& derived, const std::vector<Part>& parts,
                           const std::string& body, Progress& progress) {
  Feature out;
  out.kind = FeatureKind::body;
  out.body = body;
  for (const Part& p : parts) {
    if (progress.cancelled()) return error(ErrorCode::cancelled, "measuring was cancelled");
    RMP_TRY_ASSIGN(const auto features, features_of(frame, derived, p, progress));
    std::vector<Triangle> triangles;
    for (std::size_t t = 0; t < p.mesh->triangle_count(); ++t) triangles.push_back(triangle(p, t));
    if (are_straight(features))
      straighten(triangles, {}, corners_of(features, triangles.size()), rounding_of(triangles, p));
    else if (p.solid) out.bound = std::max(out.bound, p.solid->chord);
    out.is_of_mesh = out.is_of_mesh || features.empty();
    out.pieces.insert(out.pieces.end(), triangles.begin(), triangles.end());
  }
  return out;
}

// --- frames --------------------------------------------------------------------------------

Feature frame_feature(const std::string& body, const Pose& pose) {
  Feature out = point_feature(FeatureKind::frame, pose.p);
  out.body = body;
  out.pose = pose;
  return out;
}

Result<Feature> find_frame(const Frame& frame, const MeasuredPlace& wanted, std::string_view path) {
  const bool wants_tool = wanted.as == MeasuredAs::tool;
  std::optional<Feature> found;
  std::set<std::string> known;
  frame.for_each_member([&](const MemberPtr& m) {
    if (found || m->bodies.empty() || m->kind == MemberKind::ghost ||
        m->kind == MemberKind::clearance || m->kind == MemberKind::material)
      return;
    const std::string own = m->is_placed ? m->name : std::string();
    if (m->kind == MemberKind::robot) {
      const model::Robot* robot = frame.snapshot->get(RobotId{m->what.number});
      if (!robot) return;
      known.insert(own);
      if (wants_tool) {
        if (own == wanted.body) found = frame_feature(own, m->bodies.back());
        return;
      }
      for (std::size_t b = 0; b <= robot->links.size() && b < m->bodies.size(); ++b) {
        const std::string link = b == 0 ? "base" : robot->links[b - 1].name;
        const std::string name = own.empty() ? link : own + "." + link;
        if (name == wanted.body || (b == 0 && own == wanted.body)) {
          found = frame_feature(name, m->bodies[b]);
          return;
        }
      }
      return;
    }
    if (wants_tool) return;
    known.insert(own);
    if (own == wanted.body) found = frame_feature(own, m->bodies.front());
  });
  if (found) return std::move(*found);
  if (frame.failure) return Error(*frame.failure);
  if (wanted.body.empty() && !wants_tool) return frame_feature("", Pose{});
  return no_body(frame, wanted.body, std::move(known), path);
}

}  // namespace

std::string_view word_of(MeasuredFeature::Kind kind) {
  constexpr std::string_view kWords[] = {"point",   "corner",   "line", "circle", "curve",
                                         "plane",   "cylinder", "cone", "sphere", "torus",
                                         "surface", "body",     "frame"};
  return kWords[static_cast<std::size_t>(kind)];
}

std::string body_of(const Origin& origin) {
  std::string out = origin.member;
  for (const std::string* each : {&origin.link, &origin.part})
    if (!each->empty()) out += (out.empty() ? "" : ".") + *each;
  return out;
}

Result<MeasuredFeature> find_feature(const Frame& frame, Derived& derived,
                                     const MeasuredPlace& wanted, std::string_view path,
                                     Progress& progress) {
  if (!frame.snapshot || !frame.is_there)
    return error(ErrorCode::not_found, "the record that is measured is no longer there");
  const bool needs_place = wanted.as == MeasuredAs::point || wanted.as == MeasuredAs::corner ||
                           wanted.as == MeasuredAs::edge || wanted.as == MeasuredAs::face;
  if (needs_place && !wanted.place)
    return error(ErrorCode::invalid_argument, "no place is given",
                 "Give place = {x, y, z}, near which the measurement takes it.", std::string(path));
  if (wanted.as == MeasuredAs::point) return point_feature(FeatureKind::point, *wanted.place);
  if (wanted.as == MeasuredAs::frame || wanted.as == MeasuredAs::tool)
    return find_frame(frame, wanted, path);
  RMP_TRY_ASSIGN(const std::vector<Part> parts, parts_of(frame, wanted.body, path));
  switch (wanted.as) {
    case MeasuredAs::face: return find_face(frame, derived, parts, *wanted.place, progress);
    case MeasuredAs::edge: return find_edge(frame, derived, parts, *wanted.place, path, progress);
    case MeasuredAs::corner:
      return find_corner(frame, derived, parts, *wanted.place, path, progress);
    default: return whole_body(frame, derived, parts, wanted.body, progress);
  }
}

}  // namespace robomosp::scene
