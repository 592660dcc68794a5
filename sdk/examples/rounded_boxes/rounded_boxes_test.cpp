// SPDX-License-Identifier: Apache-2.0
// The engine against a search that needs no cleverness (all faces of the difference, by
// enumeration) for random spheres, capsules and boxes, and what is said about other shapes.
#include <robomosp/sdk/conformance/collision_suite.h>

#include "zonotope.h"

namespace robomosp::conformance {
namespace {

using rounded_boxes::Difference;
using rounded_boxes::Zonotope;

/// Least distance over all 3^n choices of sides at a bound or free, each free set solved by
/// Cramer's rule and left out where it lies outside its bounds.
double by_enumeration(const Zonotope& a, const Zonotope& b) {
  std::vector<Vec3> g(a.sides.begin(), a.sides.begin() + static_cast<std::ptrdiff_t>(a.count));
  for (std::size_t k = 0; k < b.count; ++k) g.push_back(spatial::scale(b.sides[k], -1));
  std::size_t choices = 1;
  for (std::size_t k = 0; k < g.size(); ++k) choices *= 3;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t choice = 0; choice < choices; ++choice) {
    Vec3 r = spatial::sub(a.center, b.center);
    std::vector<Vec3> free;
    for (std::size_t k = 0, rest = choice; k < g.size(); ++k, rest /= 3) {
      if (rest % 3 == 2) free.push_back(g[k]);
      else r = spatial::add(r, spatial::scale(g[k], rest % 3 == 0 ? -1 : 1));
    }
    if (free.size() > 2) continue;  // three free sides reach all points: the bodies overlap
    const auto in = [](double s) { return s >= -1 && s <= 1; };
    if (free.size() == 1) {
      const double s = -spatial::dot(free[0], r) / spatial::dot(free[0], free[0]);
      if (!in(s)) continue;
      r = spatial::add(r, spatial::scale(free[0], s));
    }
    if (free.size() == 2) {
      const double aa = spatial::dot(free[0], free[0]), bb = spatial::dot(free[1], free[1]);
      const double ab = spatial::dot(free[0], free[1]), det = aa * bb - ab * ab;
      if (det < 1e-12 * aa * bb) continue;
      const double ar = spatial::dot(free[0], r), br = spatial::dot(free[1], r);
      const double s = (ab * br - bb * ar) / det, t = (ab * ar - aa * br) / det;
      if (!in(s) || !in(t)) continue;
      r = spatial::add(r, spatial::add(spatial::scale(free[0], s), spatial::scale(free[1], t)));
    }
    least = std::min(least, spatial::norm(r));
  }
  return least - a.radius - b.radius;
}

Zonotope random_shape(Random& random, std::size_t sides) {
  Zonotope z;
  z.count = sides;
  z.radius = sides == 3 ? 0 : random.uniform(0.05, 0.3);
  const Pose turn = multiply(turn_z(random.uniform(-3, 3)), turn_x(random.uniform(-3, 3)));
  for (std::size_t k = 0; k < 3; ++k) z.center[k] = random.uniform(-1, 1);
  for (std::size_t k = 0; k < sides; ++k) {
    const double half = random.uniform(0.05, 0.5);
    z.sides[k] = {half * turn.R[k], half * turn.R[3 + k], half * turn.R[6 + k]};
  }
  return z;
}

TEST(Zonotopes, AreAsFarApartAsTheNearestOfAllFacesEdgesAndCorners) {
  Random random(3);
  int apart = 0, overlapping = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    constexpr std::size_t kSides[] = {0, 1, 3};
    const Zonotope a = random_shape(random, kSides[trial % 3]);
    const Zonotope b = random_shape(random, kSides[trial / 3 % 3]);
    const auto gap = Difference(a, b).gap();
    const Vec3 way = spatial::sub(gap.on_a, gap.on_b);
    ASSERT_NEAR(spatial::norm(way), std::fabs(gap.distance), 1e-9) << "trial " << trial;
    if (gap.distance > 0) {
      ++apart;
      ASSERT_NEAR(gap.distance, by_enumeration(a, b), 1e-12) << "trial " << trial;
    } else {
      // Moved out by its depth it touches, and by less it does not come free.
      ++overlapping;
      Zonotope out = b;
      out.center = spatial::add(b.center, spatial::scale(way, 1 + 1e-6));
      ASSERT_NEAR(Difference(a, out).gap().distance, 0, 2e-6 * -gap.distance + 1e-12);
      out.center = spatial::add(b.center, spatial::scale(way, 0.5));
      ASSERT_LT(Difference(a, out).gap().distance, 0);
    }
  }
  EXPECT_GT(apart, 500);
  EXPECT_GT(overlapping, 100);
}

TEST(RoundedBoxes, NamesTheBodyAndTheShapeThatItRefuses) {
  const auto found = find_provider<CollisionEngine>(ROBOMOSP_PLUGIN_FILE, "rounded_boxes");
  ASSERT_TRUE(found.ok());
  const std::vector<ShapedBody> bodies{{{shape_of(ShapeKind::sphere, 1)}},
                                       {{shape_of(ShapeKind::cylinder, 1, 1)}}};
  NoProgress none;
  const auto made = create<CollisionEngine>(**found)->build(bodies, TableParams(**found), none);
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.error().sentence(),
            "body 2: it has a cylinder; rounded_boxes knows spheres, capsules and boxes. "
            "Choose boxes_around, which takes the box around it, or fcl.");
}

}  // namespace
}  // namespace robomosp::conformance
