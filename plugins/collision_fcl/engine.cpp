// SPDX-License-Identifier: Apache-2.0
#include "engine.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <robomosp/sdk/collision_bounds.h>

#include "convex.h"
#include "fcl_shapes.h"
#include "mesh_solid.h"
#include "mesh_tree.h"
#include "penetration.h"
#include "spatial/box.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::collision_fcl {
namespace {

using namespace spatial;

constexpr std::size_t kBlock = 16;         ///< samples that one thread takes at a time
constexpr std::size_t kManyQueries = 256;  ///< from which threads are worth starting

/// FCL's object of a shape, which is made when it is asked for: its trees take longer to build than
/// all else of a scene.
class LateGeometry {
 public:
  explicit LateGeometry(std::function<GeometryPtr()> make) : make_(std::move(make)) {}
  [[nodiscard]] const Geometry& get() const {
    std::call_once(once_, [this] { made_ = make_(); });
    return *made_;
  }

 private:
  std::function<GeometryPtr()> make_;
  mutable std::once_flag once_;
  mutable GeometryPtr made_;
};

struct Solid {
  bool is_convex = true;
  Core core;
  std::shared_ptr<const MeshSolid> mesh;     ///< of meshes
  std::shared_ptr<const MeshTree> tree;      ///< of meshes; of hulls where there are meshes
  std::shared_ptr<const LateGeometry> late;  ///< of meshes
  Pose pose;                                 ///< body_T_shape
  Box box;                                   ///< in the shape's frame
  bool is_placed = false;                    ///< the pose is not that of the body
  Vec3 inner{};                              ///< a point of the shape, convex only
};
struct Body {
  std::vector<Solid> solids;
  Box box;
};

/// As is_rigid(t, 1e-6); without a branch where it is one.
bool is_placement(const Pose& t) {
  const auto& r = t.R;
  const double xx = r[0] * r[0] + r[3] * r[3] + r[6] * r[6] - 1,
               yy = r[1] * r[1] + r[4] * r[4] + r[7] * r[7] - 1,
               zz = r[2] * r[2] + r[5] * r[5] + r[8] * r[8] - 1,
               xy = r[0] * r[1] + r[3] * r[4] + r[6] * r[7],
               yz = r[1] * r[2] + r[4] * r[5] + r[7] * r[8],
               xz = r[0] * r[2] + r[3] * r[5] + r[6] * r[8];
  const double off = xx * xx + yy * yy + zz * zz + xy * xy + yz * yz + xz * xz;
  const double det = r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                     r[2] * (r[3] * r[7] - r[4] * r[6]);
  const double finite = (t.p[0] - t.p[0]) + (t.p[1] - t.p[1]) + (t.p[2] - t.p[2]);
  if (off + finite <= 1e-12 && det > 0) return true;
  return is_rigid(t, 1e-6);
}

Error bad(std::string message, std::string hint, std::string where = {}) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint), std::move(where));
}

Result<Solid> convex_solid(const Shape& s) {
  Solid out;
  Core& c = out.core;
  const auto positive = [&](std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      if (!(s.sizes[i] > 0) || !std::isfinite(s.sizes[i])) return false;
    return true;
  };
  const Error sizes = bad("a size is not positive", "Give lengths above 0.");
  switch (s.kind) {
    case ShapeKind::box:
      if (!positive(3)) return sizes;
      c.kind = Core::Kind::box;
      c.half = scale(s.sizes, 0.5);
      out.box.half = c.half;
      break;
    case ShapeKind::sphere:
      if (!positive(1)) return sizes;
      c.kind = Core::Kind::point;
      c.margin = s.sizes[0];
      out.box.half = {c.margin, c.margin, c.margin};
      break;
    case ShapeKind::cylinder:
      if (!positive(2)) return sizes;
      c.kind = Core::Kind::cylinder;
      c.half = {s.sizes[0], s.sizes[0], s.sizes[1] / 2};
      out.box.half = c.half;
      break;
    case ShapeKind::capsule:
      if (!positive(2)) return sizes;
      c.kind = Core::Kind::segment;
      c.margin = s.sizes[0];
      c.half = {0, 0, s.sizes[1] / 2};
      out.box.half = {c.margin, c.margin, c.half[2] + c.margin};
      break;
    case ShapeKind::cone: {
      const bool is_sized = s.sizes[0] >= 0 && s.sizes[1] >= 0 && s.sizes[0] + s.sizes[1] > 0 &&
                            s.sizes[2] > 0 && is_finite(s.sizes);
      if (!is_sized) return sizes;
      c.kind = Core::Kind::cone;
      c.half = {s.sizes[0], s.sizes[1], s.sizes[2] / 2};
      const double r = std::max(c.half[0], c.half[1]);
      out.box.half = {r, r, c.half[2]};
      break;
    }
    case ShapeKind::ellipsoid:
      if (!positive(3)) return sizes;
      c.kind = Core::Kind::ellipsoid;
      c.half = s.sizes;
      out.box.half = s.sizes;
      break;
    case ShapeKind::convex: {
      const auto corners = corners_of(s);
      for (const Vec3& p : corners)
        if (!is_finite(p)) return bad("a corner is not finite", "Correct the shape.");
      auto hull = corners.empty() ? convex_hull(vertices(*s.mesh)) : convex_hull(corners);
      if (!hull) return bad("the vertices of a convex shape span no volume", "Give a solid body.");
      out.box = box_around(hull->points);
      out.inner = hull->middle;
      c.kind = Core::Kind::hull;
      c.hull = std::make_shared<const HullData>(hull_data(std::move(*hull)));
      break;
    }
    default: return bad("the kind of a shape is unknown", "Use one of ShapeKind.");
  }
  return out;
}

Result<void> check_pose(const Shape& s) {
  if (!is_rigid(s.pose, 1e-6))
    return bad("a shape's pose is not a rigid motion", "Its rotation must be orthonormal.");
  return {};
}

Result<Solid> solid_of(const Shape& s) {
  RMP_TRY(check_pose(s));
  const bool wants_mesh = s.kind == ShapeKind::mesh || s.kind == ShapeKind::convex;
  if (s.kind == ShapeKind::mesh && !s.mesh)
    return bad("a shape has no mesh", "Give a mesh with triangles.");
  if (wants_mesh) {
    if ((!s.mesh || s.mesh->positions.size() < 9) && corners_of(s).empty())
      return bad("a shape has no mesh", "Give a mesh with triangles.");
    const Mesh none, &mesh = s.mesh ? *s.mesh : none;
    for (const float v : mesh.positions)
      if (!std::isfinite(v))
        return bad("a mesh has a number that is not finite", "Correct the mesh.");
    for (const auto i : mesh.triangles)
      if (i >= mesh.vertex_count())
        return bad("a mesh refers to a missing vertex", "Correct the mesh.");
  }
  Solid out;
  if (s.kind == ShapeKind::mesh) {
    out.is_convex = false;
    out.mesh = std::make_shared<const MeshSolid>(mesh_solid(*s.mesh));
    if (out.mesh->triangles.empty())
      return bad("a mesh has no triangles", "Give a mesh with triangles.");
    out.box = box_around(out.mesh->points);
    out.tree = std::make_shared<const MeshTree>(out.mesh->points, out.mesh->triangles);
    out.late = std::make_shared<const LateGeometry>(
        [mesh = out.mesh] { return make_mesh_geometry(mesh->points, mesh->triangles); });
  } else {
    RMP_TRY_ASSIGN(out, convex_solid(s));
  }
  out.pose = s.pose;
  return out;
}

/// The bodies that a call asks for, each once, and its pairs as indices into them.
struct Asked {
  std::vector<std::uint32_t> bodies;
  std::vector<std::size_t> first;  ///< of each body's shapes among those of all; and their number
  std::vector<std::pair<std::uint32_t, std::uint32_t>>
      pairs;  ///< the first is the body named first
};

/// Poses and boxes of the shapes of a sample; one a thread.
struct Placed {
  std::vector<Pose> poses;
  std::vector<Box> boxes;
  std::vector<Box> bodies;
  struct Candidate {
    double gap;
    std::uint32_t a, b;
  };
  std::vector<Candidate> candidates;
  std::vector<Candidate> rough;  ///< with bounds of their distances for gaps
};

class Scene final : public CollisionScene, public CollisionBounds {
 public:
  Scene(std::vector<Body> bodies, bool has_mesh, Host host, std::size_t threads)
      : bodies_(std::move(bodies)), has_mesh_(has_mesh), host_(host), threads_(threads) {}

  Result<void> distances(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                         double interest, std::span<PairDistance> out,
                         Progress& progress) const override {
    if (!(interest >= 0))
      return bad("the distance of interest is not a length",
                 "Give a length of 0 or more, or infinity.");
    return each(
        poses, pairs, out.size(), progress,
        [&](const Asked& asked, Placed& p, std::size_t i, std::size_t k) {
          return distance(asked, p, k, interest, 0, pairs[k].a > pairs[k].b, out[i]);
        },
        [&](const Asked& asked, std::span<const Pose> at, std::size_t i, std::size_t k) {
          return closed(asked, at, k, interest, pairs[k].a > pairs[k].b, out[i]);
        });
  }

  [[nodiscard]] const void* extension(const char* id) const override {
    return has_mesh_ && std::string_view(id) == CollisionBounds::kId
               ? static_cast<const CollisionBounds*>(this)
               : nullptr;
  }
  Result<void> lower_bounds(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                            double interest, double tolerance, std::span<PairDistance> out,
                            Progress& progress) const override {
    if (!(interest >= 0) || !(tolerance > 0))
      return bad("the distance of interest or the tolerance is not a length",
                 "Give lengths of 0 or more.");
    return each(poses, pairs, out.size(), progress,
                [&](const Asked& asked, Placed& p, std::size_t i, std::size_t k) {
                  return distance(asked, p, k, interest, tolerance, pairs[k].a > pairs[k].b,
                                  out[i]);
                });
  }

  Result<void> collisions(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                          std::span<std::uint8_t> out, Progress& progress) const override {
    return each(poses, pairs, out.size(), progress,
                [&](const Asked& asked, Placed& p, std::size_t i, std::size_t k) -> Result<void> {
                  out[i] = touch(asked, p, k) ? 1 : 0;
                  return {};
                });
  }

 private:
  /// Checks the arguments and calls `query` for every sample and pair, samples spread over threads.
  /// `quick` is asked first where all shapes are single and plain; false = it does not know.
  template <class Query, class Quick = std::nullptr_t>
  Result<void> each(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                    std::size_t room, Progress& progress, Query&& query,
                    Quick&& quick = nullptr) const {
    const std::size_t n = bodies_.size();
    const std::size_t samples = n == 0 ? 0 : poses.size() / n;
    if (n == 0 ? !poses.empty() : poses.size() % n != 0)
      return bad(std::to_string(poses.size()) + " poses for " + std::to_string(n) + " bodies",
                 "Give one pose per body and sample.");
    if (room != samples * pairs.size())
      return bad("space for " + std::to_string(room) + " results where " +
                     std::to_string(samples * pairs.size()) + " are required",
                 "Give one per pair and sample.");
    for (const CollisionPair& p : pairs)
      if (p.a < 0 || p.b < 0 || p.a == p.b || static_cast<std::size_t>(p.a) >= n ||
          static_cast<std::size_t>(p.b) >= n)
        return bad("a pair names bodies " + std::to_string(p.a) + " and " + std::to_string(p.b),
                   "Give two different bodies out of " + std::to_string(n) + ", counted from 0.");
    const Asked asked = asked_for(pairs);
    for (std::size_t i = 0; i < poses.size(); i += n)
      for (const std::uint32_t b : asked.bodies)
        if (!is_placement(poses[i + b]))
          return bad("pose " + std::to_string(i + b) + " is not a rigid motion",
                     "Its rotation must be orthonormal and its numbers finite.");

    std::atomic<std::size_t> next{0}, done{0};
    std::atomic<bool> stops{false};
    std::mutex mutex;
    std::optional<Error> failure;  // guarded by mutex
    const auto fail = [&](Error e) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::move(e);
      stops = true;
    };
    // Single shapes whose distance has a closed form need no boxes around them.
    const auto is_plain = [&](std::uint32_t body) {
      const auto& solids = bodies_[asked.bodies[body]].solids;
      return solids.size() == 1 && solids[0].is_convex &&
             solids[0].core.kind <= Core::Kind::cylinder;
    };
    const bool is_quick =
        std::is_same_v<std::decay_t<Quick>, std::nullptr_t>
            ? false
            : std::all_of(asked.pairs.begin(), asked.pairs.end(),
                          [&](const auto& p) { return is_plain(p.first) && is_plain(p.second); });
    const auto work = [&, caller = std::this_thread::get_id()](std::size_t) {
      const bool reports = std::this_thread::get_id() == caller;
      Placed placed;
      while (!stops) {
        const std::size_t begin = kBlock * next.fetch_add(1);
        if (begin >= samples) return;
        const std::size_t end = std::min(samples, begin + kBlock);
        for (std::size_t i = begin; i < end; ++i) {
          const std::span<const Pose> at = poses.subspan(i * n, n);
          bool is_placed = !is_quick;
          if (is_placed) place(asked, at, placed);
          for (std::size_t k = 0; k < pairs.size(); ++k) {
            if ((is_placed || i == begin) && k % 8 == 0 && (stops || progress.cancelled()))
              return fail(error(ErrorCode::cancelled, "the collision check was cancelled"));
            if constexpr (!std::is_same_v<std::decay_t<Quick>, std::nullptr_t>) {
              if (is_quick && quick(asked, at, i * pairs.size() + k, k)) continue;
              if (!is_placed) place(asked, at, placed);
              is_placed = true;
            }
            if (auto r = query(asked, placed, i * pairs.size() + k, k); !r.ok())
              return fail(std::move(r).error());
          }
        }
        done += end - begin;
        if (reports)
          progress.report(static_cast<double>(done) / static_cast<double>(samples), "collision");
      }
    };
    const std::size_t blocks = (samples + kBlock - 1) / kBlock;
    std::size_t helpers = std::min(threads_, blocks);
    if (samples * pairs.size() < kManyQueries) helpers = 1;
    host_.spread(helpers, helpers, work);
    if (failure) return std::move(*failure);
    return {};
  }

  /// A pair is computed in the order of its bodies, so that (a, b) and (b, a) agree to the bit.
  [[nodiscard]] Asked asked_for(std::span<const CollisionPair> pairs) const {
    Asked out;
    std::vector<std::int32_t> number(bodies_.size(), -1);
    out.first.push_back(0);
    const auto of = [&](std::int32_t body) {
      auto& own = number[static_cast<std::size_t>(body)];
      if (own < 0) {
        own = static_cast<std::int32_t>(out.bodies.size());
        out.bodies.push_back(static_cast<std::uint32_t>(body));
        out.first.push_back(out.first.back() +
                            bodies_[static_cast<std::size_t>(body)].solids.size());
      }
      return static_cast<std::uint32_t>(own);
    };
    for (const CollisionPair& p : pairs) {
      const auto [a, b] = std::minmax(p.a, p.b);
      const std::uint32_t first = of(a);
      out.pairs.emplace_back(first, of(b));
    }
    return out;
  }

  void place(const Asked& asked, std::span<const Pose> poses, Placed& p) const {
    p.poses.resize(asked.first.back());
    p.boxes.resize(asked.first.back());
    p.bodies.resize(asked.bodies.size());
    for (std::size_t i = 0; i < asked.bodies.size(); ++i) {
      const std::size_t b = asked.bodies[i], first = asked.first[i];
      const auto& solids = bodies_[b].solids;
      for (std::size_t s = 0; s < solids.size(); ++s) {
        p.poses[first + s] = compose(poses[b], solids[s].pose);
        p.boxes[first + s] = moved(solids[s].box, p.poses[first + s]);
        p.bodies[i] = s == 0 ? p.boxes[first] : spatial::around(p.bodies[i], p.boxes[first + s]);
      }
    }
  }

  /// A body of a call with where its shapes are.
  struct At {
    const std::vector<Solid>& solids;
    const Pose* poses;
    const Box* boxes;
    const Box& box;
  };
  At at(const Asked& asked, const Placed& p, std::uint32_t i) const {
    return {bodies_[asked.bodies[i]].solids, p.poses.data() + asked.first[i],
            p.boxes.data() + asked.first[i], p.bodies[i]};
  }

  bool touch(const Asked& asked, const Placed& p, std::size_t pair) const {
    const At a = at(asked, p, asked.pairs[pair].first), b = at(asked, p, asked.pairs[pair].second);
    if (a.solids.empty() || b.solids.empty() || gap(a.box, b.box) > 0) return false;
    for (std::size_t i = 0; i < a.solids.size(); ++i) {
      if (gap(a.boxes[i], b.box) > 0) continue;
      for (std::size_t k = 0; k < b.solids.size(); ++k)
        if (!(gap(a.boxes[i], b.boxes[k]) > 0) &&
            touch(a.solids[i], a.poses[i], b.solids[k], b.poses[k]))
          return true;
    }
    return false;
  }

  static bool touch(const Solid& a, const Pose& at_a, const Solid& b, const Pose& at_b) {
    if (a.is_convex && b.is_convex) {
      const Apart r = separation(a.core, b.core, compose(inverse(at_a), at_b), 0);
      return r.state == Apart::State::overlap ||
             (r.state == Apart::State::apart && r.distance <= 0);
    }
    return surfaces(a, at_a, b, at_b, 0, 0).state == Apart::State::overlap ||
           is_nested(a, at_a, b, at_b);
  }

  /// How far the surfaces of a pair with a mesh in it are apart; points in the frame of a, or of b
  /// where only that is convex and has no triangles (`own_frame`).
  static Apart surfaces(const Solid& a, const Pose& at_a, const Solid& b, const Pose& at_b,
                        double interest, double tolerance) {
    const Pose a_T_b = compose(inverse(at_a), at_b);
    if (a.tree && b.tree) return a.tree->separation(*b.tree, a_T_b, interest, tolerance);
    if (b.tree) return b.tree->separation(a.core, a_T_b, interest, tolerance);
    Apart r = a.tree->separation(b.core, inverse(a_T_b), interest, tolerance);
    std::swap(r.on_a, r.on_b);
    r.on_a = transform(a_T_b, r.on_a);
    r.on_b = transform(a_T_b, r.on_b);
    return r;
  }

  /// Whether one is inside the other, of a pair whose surfaces do not meet and with a mesh in it.
  static bool is_nested(const Solid& a, const Pose& at_a, const Solid& b, const Pose& at_b) {
    const auto holds = [](const Solid& outer, const Pose& at_outer, const Solid& inner,
                          const Pose& at_inner) {
      const Pose outer_T_inner = compose(inverse(at_outer), at_inner);
      const auto has = [&](const Vec3& inner_point) {
        const Vec3 p = transform(outer_T_inner, inner_point);
        for (std::size_t k = 0; k < 3; ++k)
          if (std::fabs(p[k] - outer.box.centre[k]) > outer.box.half[k]) return false;
        return outer.is_convex ? contains(outer.core, p) : contains(*outer.mesh, p);
      };
      if (inner.is_convex) return has(inner.inner);
      const auto& points = inner.mesh->one_of_each_piece;
      return std::any_of(points.begin(), points.end(), has);
    };
    return holds(a, at_a, b, at_b) || holds(b, at_b, a, at_a);
  }

  Result<void> distance(const Asked& asked, Placed& p, std::size_t pair, double interest,
                        double tolerance, bool is_swapped, PairDistance& out) const {
    const At a = at(asked, p, asked.pairs[pair].first), b = at(asked, p, asked.pairs[pair].second);
    out = {};
    out.distance = interest;
    if (a.solids.empty() || b.solids.empty() || gap(a.box, b.box) > interest) return {};
    auto& candidates = p.candidates;
    candidates.clear();
    for (std::uint32_t i = 0; i < a.solids.size(); ++i) {
      if (gap(a.boxes[i], b.box) > interest) continue;
      for (std::uint32_t k = 0; k < b.solids.size(); ++k)
        if (const double g = gap(a.boxes[i], b.boxes[k]); g <= interest)
          candidates.push_back({g, i, k});
    }
    if (candidates.size() > 1)
      std::sort(candidates.begin(), candidates.end(), [](const auto& x, const auto& y) {
        return std::tie(x.gap, x.a, x.b) < std::tie(y.gap, y.a, y.b);
      });
    if (tolerance > 0) {
      RMP_TRY(bound_from_below(a, b, p, interest, tolerance, out));
      if (is_swapped) std::swap(out.on_a, out.on_b);
      return {};
    }
    bool found = false;
    for (const auto& c : candidates) {
      if (c.gap > std::max(out.distance, 0.0)) break;
      RMP_TRY_ASSIGN(const auto d,
                     distance(a.solids[c.a], a.poses[c.a], b.solids[c.b], b.poses[c.b],
                              found ? std::max(out.distance, 0.0) : interest));
      if (d && (!found || d->distance < out.distance)) out = *d, found = true;
    }
    if (!found) out = {interest, {}, {}};
    if (is_swapped) std::swap(out.on_a, out.on_b);
    return {};
  }

  /// By a closed form in the frame of the world; false where there is none.
  bool closed(const Asked& asked, std::span<const Pose> at, std::size_t pair, double interest,
              bool is_swapped, PairDistance& out) const {
    const auto [i, k] = asked.pairs[pair];
    const std::size_t of_a = asked.bodies[i], of_b = asked.bodies[k];
    const Solid &a = bodies_[of_a].solids.front(), &b = bodies_[of_b].solids.front();
    const bool is_told = a.is_placed || b.is_placed
                             ? closed_distance(a.core, compose(at[of_a], a.pose), b.core,
                                               compose(at[of_b], b.pose), out)
                             : closed_distance(a.core, at[of_a], b.core, at[of_b], out);
    if (!is_told) return false;
    if (out.distance > interest) out = {interest, {}, {}};
    if (is_swapped) std::swap(out.on_a, out.on_b);
    return true;
  }

  /// All candidates roughly first, which costs little each; then exactly enough those that may be
  /// the nearest.
  static Result<void> bound_from_below(const At& a, const At& b, Placed& p, double interest,
                                       double tolerance, PairDistance& out) {
    constexpr double kRough = std::numeric_limits<double>::max();  // half of the distance will do
    double most = interest;                                        // that the least distance can be
    out = {interest, {}, {}};
    bool found = false;
    const auto ask = [&](const Placed::Candidate& c, double within) -> Result<double> {
      const Solid &of_a = a.solids[c.a], &of_b = b.solids[c.b];
      const double room = std::max(most, 0.0);
      PairDistance d;
      double above = 0;
      if (of_a.is_convex && of_b.is_convex) {
        RMP_TRY_ASSIGN(const auto exact, distance(of_a, a.poses[c.a], of_b, b.poses[c.b], room));
        if (!exact) return room;
        d = *exact;
        above = d.distance;
      } else {
        const Apart r = surfaces(of_a, a.poses[c.a], of_b, b.poses[c.b], room, within);
        if (r.state == Apart::State::overlap || is_nested(of_a, a.poses[c.a], of_b, b.poses[c.b])) {
          d.on_a = d.on_b = meeting_point(of_a, a.poses[c.a], of_b, b.poses[c.b]);
        } else {
          if (r.state == Apart::State::beyond) return r.distance;
          d = {r.distance, transform(a.poses[c.a], r.on_a), transform(a.poses[c.a], r.on_b)};
          above = std::max(d.distance, spatial::distance(r.on_a, r.on_b));
        }
      }
      if (!found || above < most) out = d, most = std::min(most, above), found = true;
      return d.distance;
    };
    auto& rough = p.rough;
    rough.clear();
    for (const auto& c : p.candidates) {
      if (c.gap > std::max(most, 0.0)) break;
      RMP_TRY_ASSIGN(const double least, ask(c, kRough));
      rough.push_back({least, c.a, c.b});
    }
    std::sort(rough.begin(), rough.end(), [](const auto& x, const auto& y) {
      return std::tie(x.gap, x.a, x.b) < std::tie(y.gap, y.a, y.b);
    });
    double told = most;
    for (const auto& c : rough) {
      double least = c.gap;
      if (most > 0 && std::isfinite(most) && least < enough(most, tolerance)) {
        RMP_TRY_ASSIGN(least, ask(c, tolerance));
      }
      told = std::min(told, least);
    }
    out.distance = told;
    return {};
  }

  /// nullopt = farther than the interest.
  static Result<std::optional<PairDistance>> distance(const Solid& a, const Pose& at_a,
                                                      const Solid& b, const Pose& at_b,
                                                      double interest) {
    PairDistance d;
    if (a.is_convex && b.is_convex) {
      const Pose a_T_b = compose(inverse(at_a), at_b);
      const Apart r = separation(a.core, b.core, a_T_b, interest);
      if (r.state == Apart::State::beyond) return std::optional<PairDistance>{};
      if (r.state == Apart::State::apart) {
        d = {r.distance, transform(at_a, r.on_a), transform(at_a, r.on_b)};
        return std::optional(d);
      }
      const Apart deep = penetration(a.core, b.core, a_T_b);
      d = {deep.distance, transform(at_a, deep.on_a), transform(at_a, deep.on_b)};
      return std::optional(d);
    }
    if (a.is_convex || b.is_convex) {
      const Apart r = surfaces(a, at_a, b, at_b, interest, 0);
      if (r.state == Apart::State::overlap || is_nested(a, at_a, b, at_b)) {
        d.on_a = d.on_b = meeting_point(a, at_a, b, at_b);
        return std::optional(d);
      }
      if (r.state == Apart::State::beyond) return std::optional<PairDistance>{};
      d = {r.distance, transform(at_a, r.on_a), transform(at_a, r.on_b)};
      return std::optional(d);
    }
    if (touch(a, at_a, b, at_b)) {
      d.on_a = d.on_b = meeting_point(a, at_a, b, at_b);
      return std::optional(d);
    }
    return surface_distance(a.late->get(), at_a, b.late->get(), at_b, interest);
  }

  /// Somewhere in what the boxes share.
  static Vec3 meeting_point(const Solid& a, const Pose& at_a, const Solid& b, const Pose& at_b) {
    const Box box_a = moved(a.box, at_a), box_b = moved(b.box, at_b);
    Vec3 p{};
    for (std::size_t k = 0; k < 3; ++k)
      p[k] = 0.5 * (std::max(box_a.centre[k] - box_a.half[k], box_b.centre[k] - box_b.half[k]) +
                    std::min(box_a.centre[k] + box_a.half[k], box_b.centre[k] + box_b.half[k]));
    return p;
  }

  std::vector<Body> bodies_;
  bool has_mesh_;
  Host host_;
  std::size_t threads_;
};

}  // namespace

Result<std::unique_ptr<CollisionScene>> FclEngine::build(std::span<const ShapedBody> bodies,
                                                         const Params& params,
                                                         Progress& progress) const {
  warm_up();
  const auto has = [&](ShapeKind kind) {
    return std::any_of(bodies.begin(), bodies.end(), [&](const ShapedBody& b) {
      return std::any_of(b.shapes.begin(), b.shapes.end(),
                         [&](const Shape& s) { return s.kind == kind; });
    });
  };
  const bool has_mesh = has(ShapeKind::mesh);
  // Copies of one part share what is made of it.
  std::map<std::tuple<ShapeKind, const void*, const void*>, Solid> known;
  std::vector<Body> made;
  const auto place = [](std::size_t body, std::size_t shape) {
    return "body " + std::to_string(body) + ", shape " + std::to_string(shape);
  };
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    Body body;
    for (std::size_t k = 0; k < bodies[i].shapes.size(); ++k) {
      if (progress.cancelled())
        return error(ErrorCode::cancelled, "the preparation of collision checks was cancelled");
      const Shape& shape = bodies[i].shapes[k];
      const bool is_listed = shape.kind == ShapeKind::mesh || shape.kind == ShapeKind::convex;
      const std::tuple key(shape.kind, static_cast<const void*>(shape.mesh),
                           static_cast<const void*>(corners_of(shape).data()));
      if (const auto it = known.find(key); is_listed && it != known.end()) {
        RMP_TRY(check_pose(shape).in(place(i, k)));
        body.solids.push_back(it->second);
        body.solids.back().pose = shape.pose;
        continue;
      }
      auto solid = solid_of(shape);
      if (!solid.ok()) return std::move(solid).error().in(place(i, k));
      if (has_mesh && solid->is_convex && solid->core.kind == Core::Kind::hull)
        solid->tree = std::make_shared<const MeshTree>(solid->core.hull->hull.points,
                                                       solid->core.hull->hull.triangles);
      if (is_listed) known.emplace(key, *solid);
      body.solids.push_back(std::move(*solid));
      const Pose none;
      Solid& own = body.solids.back();
      own.is_placed = own.pose.R != none.R || own.pose.p != none.p;
    }
    made.push_back(std::move(body));
  }
  const auto threads = static_cast<std::size_t>(std::max(0LL, params.integer("threads")));
  return std::unique_ptr<CollisionScene>(std::make_unique<Scene>(
      std::move(made), has_mesh, host_, threads > 0 ? threads : host_.cores()));
}

}  // namespace robomosp::collision_fcl
