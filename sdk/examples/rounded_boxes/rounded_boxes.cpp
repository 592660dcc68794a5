// SPDX-License-Identifier: Apache-2.0
// A collision engine of one's own: spheres, capsules and boxes, exactly and without iterating to a
// tolerance (zonotope.h). Two providers: "rounded_boxes" refuses every other shape, naming the
// body; "boxes_around" takes the box around a cylinder, hull or mesh in its place, so that it never
// reports more room than there is.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/plugin.h>

#include "spatial/pose.h"
#include "zonotope.h"

namespace {

using namespace robomosp;
using namespace robomosp::spatial;
using rounded_boxes::Difference;
using rounded_boxes::Gap;
using rounded_boxes::Zonotope;

struct Body {
  std::vector<Zonotope> parts;  ///< in the body's frame
};

Error bad(std::string message, std::string hint, std::string where = {}) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint), std::move(where));
}

Zonotope moved(const Zonotope& z, const Pose& t) {
  Zonotope out = z;
  out.center = transform(t, z.center);
  for (std::size_t k = 0; k < z.count; ++k) out.sides[k] = rotate(t, z.sides[k]);
  return out;
}
/// Of all its points from the centre.
double reach(const Zonotope& z) {
  double sum = z.radius;
  for (std::size_t k = 0; k < z.count; ++k) sum += norm(z.sides[k]);
  return sum;
}
Zonotope box_of(const Vec3& center, const Vec3& half) {
  return {center, {Vec3{half[0], 0, 0}, Vec3{0, half[1], 0}, Vec3{0, 0, half[2]}}, 3, 0};
}

/// Every side of a triangle is that of another one, the other way round; points of equal place are
/// one, for meshes repeat them where normals differ.
bool is_closed(const Mesh& mesh) {
  std::map<std::array<float, 3>, std::size_t> places;
  std::vector<std::size_t> place;
  for (std::size_t i = 0; i + 2 < mesh.positions.size(); i += 3)
    place.push_back(
        places.try_emplace({mesh.positions[i], mesh.positions[i + 1], mesh.positions[i + 2]}, i)
            .first->second);
  std::map<std::pair<std::size_t, std::size_t>, int> sides;  // there minus back
  for (std::size_t t = 0; t + 2 < mesh.triangles.size(); t += 3)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = mesh.triangles[t + k], to = mesh.triangles[t + (k + 1) % 3];
      if (from >= place.size() || to >= place.size()) return false;
      const auto [low, high] = std::minmax(place[from], place[to]);
      if (low != high) sides[{low, high}] += place[from] == low ? 1 : -1;
    }
  return std::all_of(sides.begin(), sides.end(), [](const auto& s) { return s.second == 0; });
}

Result<Zonotope> around(const Mesh* mesh) {
  if (!mesh || mesh->positions.size() < 12)
    return bad("a mesh has no points", "Give a closed mesh.");
  Vec3 low{}, high{};
  for (std::size_t i = 0; i + 2 < mesh->positions.size(); i += 3)
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = static_cast<double>(mesh->positions[i + k]);
      if (!std::isfinite(x)) return bad("a mesh has a point that is not finite", "Correct it.");
      low[k] = i == 0 ? x : std::min(low[k], x);
      high[k] = i == 0 ? x : std::max(high[k], x);
    }
  const Vec3 half = scale(sub(high, low), 0.5);
  if (!(half[0] > 0 && half[1] > 0 && half[2] > 0)) return bad("a mesh is flat", "Give a solid.");
  return box_of(scale(add(low, high), 0.5), half);
}

/// The shape in its own frame.
Result<Zonotope> zonotope_of(const Shape& s, bool takes_boxes_around) {
  const auto lengths = [&](std::size_t count) -> Result<void> {
    for (std::size_t i = 0; i < count; ++i)
      if (!(s.sizes[i] > 0) || !std::isfinite(s.sizes[i]))
        return bad("a size is not positive", "Give lengths above 0.");
    return {};
  };
  const char* refused = "a mesh";
  switch (s.kind) {
    case ShapeKind::sphere: RMP_TRY(lengths(1)); return Zonotope{{}, {}, 0, s.sizes[0]};
    case ShapeKind::capsule:
      RMP_TRY(lengths(2));
      return Zonotope{{}, {Vec3{0, 0, s.sizes[1] / 2}}, 1, s.sizes[0]};
    case ShapeKind::box: RMP_TRY(lengths(3)); return box_of({}, scale(s.sizes, 0.5));
    case ShapeKind::cylinder:
      RMP_TRY(lengths(2));
      refused = "a cylinder";
      if (takes_boxes_around) return box_of({}, {s.sizes[0], s.sizes[0], s.sizes[1] / 2});
      break;
    case ShapeKind::cone: refused = "a cone"; break;  // only for who says that it takes them
    case ShapeKind::ellipsoid: refused = "an ellipsoid"; break;  // the same
    case ShapeKind::convex: refused = "a convex hull"; [[fallthrough]];
    case ShapeKind::mesh:
      if (!takes_boxes_around) break;
      if (s.kind == ShapeKind::mesh && s.mesh && !is_closed(*s.mesh))
        return bad("a mesh is open, so its inside is undefined", "Close it.");
      return around(s.mesh);
  }
  return error(
      ErrorCode::unsupported,
      std::string("it has ") + refused + "; rounded_boxes knows spheres, capsules and boxes",
      "Choose boxes_around, which takes the box around it, or fcl.");
}

class Scene final : public CollisionScene {
  using Parts = std::span<const Zonotope>;

 public:
  explicit Scene(std::vector<Body> bodies) : bodies_(std::move(bodies)) {}

  Result<void> distances(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                         double interest, std::span<PairDistance> out,
                         Progress& progress) const override {
    if (!(interest >= 0)) return bad("the distance of interest is not a length", "Give 0 or more.");
    return each(poses, pairs, out.size(), progress, [&](std::size_t i, Parts a, Parts b) {
      const Gap g = nearest(a, b, interest);
      out[i] = {g.distance, g.on_a, g.on_b};
      const CollisionPair& pair = pairs[i % pairs.size()];
      if (pair.a > pair.b) std::swap(out[i].on_a, out[i].on_b);
    });
  }
  Result<void> collisions(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                          std::span<std::uint8_t> out, Progress& progress) const override {
    return each(poses, pairs, out.size(), progress, [&](std::size_t i, Parts a, Parts b) {
      out[i] = nearest(a, b, std::numeric_limits<double>::min()).distance <= 0;
    });
  }

 private:
  /// Pairs of parts whose balls around are farther apart than what is known are passed over.
  static Gap nearest(Parts a, Parts b, double interest) {
    Gap best;
    best.distance = interest;
    for (const Zonotope& x : a)
      for (const Zonotope& y : b) {
        if (norm(sub(x.center, y.center)) - reach(x) - reach(y) > best.distance) continue;
        const Gap g = Difference(x, y).gap();
        if (g.distance < best.distance) best = g;
      }
    return best;
  }

  /// Calls work(number of the answer, parts of one body, parts of the other), all in the world's
  /// frame. The body of the lower number comes first, so that (a, b) and (b, a) give the same bits.
  template <class Work>
  Result<void> each(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                    std::size_t answers, Progress& progress, Work&& work) const {
    constexpr std::size_t kPerCheck = 256;
    const std::size_t n = bodies_.size(), samples = n == 0 ? 0 : poses.size() / n;
    if (poses.size() != samples * n || answers != samples * pairs.size())
      return bad(
          "the numbers of poses, pairs and results do not fit the " + std::to_string(n) + " bodies",
          "Give one pose per body and one result per pair, for each sample.");
    for (const CollisionPair& p : pairs)
      if (p.a < 0 || p.b < 0 || p.a == p.b || std::cmp_greater_equal(std::max(p.a, p.b), n))
        return bad("a pair names the same body twice or a body that does not exist",
                   "Give two of the " + std::to_string(n) + " bodies.");
    for (const Pose& p : poses)
      if (!is_rigid(p, 1e-6)) return bad("a body's pose is not a rigid placement", "Correct it.");
    std::vector<std::vector<Zonotope>> placed(n);
    for (std::size_t s = 0; s < samples; ++s) {
      if (s % kPerCheck == 0 && progress.cancelled())
        return error(ErrorCode::cancelled, "the distance computation was cancelled");
      for (std::size_t b = 0; b < n; ++b) {
        placed[b].clear();
        for (const Zonotope& z : bodies_[b].parts) placed[b].push_back(moved(z, poses[s * n + b]));
      }
      for (std::size_t p = 0; p < pairs.size(); ++p) {
        const auto [low, high] = std::minmax(pairs[p].a, pairs[p].b);
        work(s * pairs.size() + p, Parts(placed[static_cast<std::size_t>(low)]),
             Parts(placed[static_cast<std::size_t>(high)]));
      }
    }
    return {};
  }

  std::vector<Body> bodies_;
};

class Engine : public CollisionEngine {
 public:
  explicit Engine(bool takes_boxes_around) : takes_boxes_around_(takes_boxes_around) {}
  Result<std::unique_ptr<CollisionScene>> build(std::span<const ShapedBody> bodies, const Params&,
                                                Progress&) const override {
    std::vector<Body> made(bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b)
      for (const Shape& s : bodies[b].shapes) {
        const std::string where = "body " + std::to_string(b + 1);
        if (!is_rigid(s.pose))
          return bad("a shape's pose is not a rigid placement", "Correct it.", where);
        auto zonotope = zonotope_of(s, takes_boxes_around_);
        if (!zonotope.ok()) return std::move(zonotope).error().in(where);
        made[b].parts.push_back(moved(*zonotope, s.pose));
      }
    return std::unique_ptr<CollisionScene>(std::make_unique<Scene>(std::move(made)));
  }

 private:
  bool takes_boxes_around_;
};
struct RoundedBoxes final : Engine {
  RoundedBoxes() : Engine(false) {}
};
struct BoxesAround final : Engine {
  BoxesAround() : Engine(true) {}
};

}  // namespace

RMP_PLUGIN("org.example.rounded_boxes", "0.1.0", "Apache-2.0", "A collision engine as an example.",
           RMP_PROVIDER_NO_PARAMS(RoundedBoxes, "rounded_boxes",
                                  "Spheres, capsules and boxes, exactly; rejects all other shapes.",
                                  "exact,partial"),
           RMP_PROVIDER_NO_PARAMS(BoxesAround, "boxes_around",
                                  "The same, with the boxes around all other shapes.",
                                  "approximate"))
