// SPDX-License-Identifier: Apache-2.0
// The part of the suite of robomosp.csg/1 on what is stretched; csg_suite_kinds.h includes it
// (layer: contract).
#pragma once

#include <robomosp/sdk/conformance/csg_suite_kinds.h>

namespace robomosp::conformance {

inline Csg scale(Csg child, Vec3 factors) {
  return modifier(CsgKind::scale, std::move(child), {factors[0], factors[1], factors[2]});
}

namespace detail {
/// The moments of a stretched solid: the integrals of the coordinates put in. Its area is unknown.
inline Moments stretched(const Moments& m, const Vec3& f) {
  const double v = f[0] * f[1] * f[2];
  Moments out;
  out.volume = v * m.volume;
  out.area = -1;
  for (std::size_t k = 0; k < 3; ++k) out.first[k] = v * f[k] * m.first[k];
  const Sym3& s = m.second;
  out.second = {v * f[0] * f[0] * s.xx, v * f[1] * f[1] * s.yy, v * f[2] * f[2] * s.zz,
                v * f[0] * f[1] * s.xy, v * f[1] * f[2] * s.yz, v * f[0] * f[2] * s.xz};
  return out;
}

struct ScaleCase {
  std::string name;
  Csg child;
  bool is_polyhedral = false;
  bool is_exact = true;  ///< the child's own moments are
};
/// Children with the axes of the scale, and others.
inline std::vector<ScaleCase> scale_cases() {
  const Pose askew = turned({1, 2, 3}, 0.8, {0.02, 0.01, -0.05});
  const Pose quarter = turned({1, 0, 0}, kPi / 2, {0.1, 0, 0.02});
  const auto drilled = [](Csg of) {
    return subtract({std::move(of), cylinder(0.02, 0.4).at(0.01, 0, -0.2)});
  };
  std::vector<ScaleCase> cases;
  const auto add = [&](const std::string& name, const Csg& child, bool is_polyhedral = false,
                       bool is_exact = true) {
    cases.push_back({name, child, is_polyhedral, is_exact});
    cases.push_back({name + ", a quarter turned", child.at(quarter), is_polyhedral, is_exact});
    cases.push_back({name + ", askew", child.at(askew), is_polyhedral, is_exact});
  };
  add("box", box(0.1, 0.05, 0.08), true);
  add("frustum", frustum(0.1, 0.08, 0.04, 0.05, 0.09), true);
  add("pyramid", pyramid(5, 0.06, 0.02, 0.08), true);
  add("cylinder", cylinder(0.04, 0.1));
  add("cone", cone(0.05, 0.02, 0.1));
  add("sphere", sphere(0.05));
  add("ellipsoid", primitive(CsgKind::ellipsoid, {0.05, 0.03, 0.06}));
  add("torus", torus(0.06, 0.015));
  add("drilled box", drilled(box(0.1, 0.08, 0.05)));
  add("frame", subtract({box(0.1, 0.08, 0.05), box(0.06, 0.04, 0.2).at(0, 0, -0.1)}), true);
  add("pattern", linear_pattern(box(0.02, 0.02, 0.02), 3, {0.03, 0, 0}), true);
  add("turned", revolution({{polygon_loop({{0.02, 0}, {0.06, 0.01}, {0.03, 0.05}})}}));
  // Where a sphere meets a cylinder no engine has the curve exactly.
  add("ball with a hole", drilled(sphere(0.06)), false, false);
  return cases;
}
}  // namespace detail

TEST_P(CsgConformance, AStretchedSphereIsAnEllipsoid) {
  for (const Vec3 r : {Vec3{0.05, 0.03, 0.08}, Vec3{0.02, 0.06, 0.02}, Vec3{0.03, 0.03, 0.03}}) {
    const double v = 4 * detail::kPi / 3 * r[0] * r[1] * r[2];
    const Moments want =
        closed_form(v, 0, v * r[0] * r[0] / 5, v * r[1] * r[1] / 5, v * r[2] * r[2] / 5);
    const Pose place = turned({3, 1, -2}, 1.1, {0.1, -0.2, 0.3});
    const Csg made = scale(sphere(0.02), {r[0] / 0.02, r[1] / 0.02, r[2] / 0.02});
    const Csg given = primitive(CsgKind::ellipsoid, {r[0], r[1], r[2]});
    for (const Csg& c : {made, given}) {
      const std::string name(csg_info(c.node.kind).name);
      const Moments m = moments(c);
      expect_closed(m, want, 10 * GetParam().primitive_accuracy, name);
      EXPECT_EQ(m.exact, !is_mesh()) << name;
      expect_closed(moments(c.at(place)), moved(want, place), 10 * GetParam().primitive_accuracy,
                    name + " elsewhere");
      // What it is as a solid: where its box ends, and what its triangles enclose.
      const auto whole = shape(c.at(place));
      ASSERT_NE(whole, nullptr);
      for (std::size_t k = 0; k < 3; ++k) {
        double reach = 0;  // the support of an ellipsoid along an axis of the world
        for (std::size_t i = 0; i < 3; ++i) reach += std::pow(place.R[3 * k + i] * r[i], 2);
        const double slack = is_mesh() ? 2e-4 : 1e-6;
        EXPECT_NEAR(whole->bounds()[0][k], place.p[k] - std::sqrt(reach), slack) << name;
        EXPECT_NEAR(whole->bounds()[1][k], place.p[k] + std::sqrt(reach), slack) << name;
      }
      const MeshFacts f = facts(mesh(c.at(place), {2e-4, 0.3}), 2e-4);
      EXPECT_EQ(f.unbalanced_sides, 0U) << name;
      EXPECT_EQ(f.inward_normals, 0U) << name;
      EXPECT_NEAR(f.volume, v, 2e-4 * m.area + volume_slack(m, 0)) << name;
    }
  }
}

TEST_P(CsgConformance, StretchedSolidsHaveTheImagesOfTheirMoments) {
  for (const auto& c : detail::scale_cases())
    for (const Vec3 f : {Vec3{2, 0.5, 1.25}, Vec3{1.5, 1.5, 0.75}, Vec3{2, 2, 2}}) {
      SCOPED_TRACE(c.name + ", " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " +
                   std::to_string(f[2]));
      const Moments before = moments(c.child), m = moments(scale(c.child, f));
      const Moments want = detail::stretched(before, f);
      EXPECT_EQ(m.exact, c.is_polyhedral || (c.is_exact && !is_mesh()));
      if (before.exact) {
        EXPECT_TRUE(m.exact) << "nothing is lost by stretching";
      }
      expect_identity(m, want, c.is_exact ? 1e-11 : GetParam().boolean_accuracy, {before}, "");
      // The solid itself, which its moments need not have been taken from.
      const MeshFacts made = facts(mesh(scale(c.child, f), {2e-4, 0.3}), 2e-4);
      EXPECT_EQ(made.unbalanced_sides, 0U);
      EXPECT_EQ(made.inward_normals, 0U);
      EXPECT_NEAR(made.volume, want.volume, made.area * 2e-4 + volume_slack(m, 0));
      EXPECT_NEAR(made.area, m.area, 0.02 * m.area);
    }
}

TEST_P(CsgConformance, StretchedSolidsTakePartInOperations) {
  const double pi = detail::kPi, claim = GetParam().boolean_accuracy;
  // A bore of elliptic section: pi a b h less.
  const Csg bore = scale(cylinder(0.01, 0.2), {2, 0.75, 1}).at(0.01, 0.005, -0.1);
  const Moments plate = moments(subtract({box(0.1, 0.08, 0.03), bore}));
  const double section = pi * 0.02 * 0.0075;
  EXPECT_NEAR(plate.volume, (0.1 * 0.08 - section) * 0.03, volume_slack(plate, claim));
  // Half an ellipsoid: its centre is 3/8 of its half axis from the cut.
  const Csg egg = primitive(CsgKind::ellipsoid, {0.05, 0.03, 0.04});
  const Moments half = moments(intersect({egg, box(0.2, 0.2, 0.1)}));
  const double volume = 2 * pi / 3 * 0.05 * 0.03 * 0.04;
  EXPECT_NEAR(half.volume, volume, volume_slack(half, claim));
  EXPECT_NEAR(half.first[2], volume * 0.04 * 3 / 8, volume_slack(half, claim) * 0.05);
  // A stretched union is the union of what is stretched.
  const Csg pair = unite({box(0.1, 0.1, 0.05), cone(0.03, 0.01, 0.06).at(0.01, 0, 0.03)});
  const Moments before = moments(pair);
  expect_identity(moments(scale(pair, {0.5, 2, 1.5})), detail::stretched(before, {0.5, 2, 1.5}),
                  claim, {before}, "union");
  // Nothing is nothing.
  expect_identity(moments(scale(pair, {1, 1, 1})), before, 1e-15, {before}, "by 1");
}

TEST_P(CsgConformance, AStretchBetweenTwoTurnsShears) {
  // Turned back by another angle than before, squares become no rectangles any more.
  const Pose there = turned({1, 1, 0}, 0.6), back = turned({0, 1, 2}, -0.9, {0.1, 0, 0.2});
  const Vec3 f{3, 1, 0.5};
  const std::vector<std::pair<std::string, Csg>> children{
      {"box", box(0.1, 0.06, 0.04)},
      {"torus", torus(0.05, 0.01)},
      {"stretched torus", scale(torus(0.05, 0.01).at(there), {1, 2, 1})}};
  for (const auto& [name, child] : children) {
    const Moments before = moments(child.at(there));
    const Csg sheared = scale(child.at(there), f).at(back);
    const Moments m = moments(sheared);
    expect_identity(m, moved(detail::stretched(before, f), back), 1e-11, {before}, name);
    if (before.exact) {
      EXPECT_TRUE(m.exact) << name;
    }
    const MeshFacts made = facts(mesh(sheared, {2e-4, 0.3}), 2e-4);
    EXPECT_EQ(made.unbalanced_sides, 0U) << name;
    EXPECT_NEAR(made.volume, m.volume, made.area * 2e-4 + volume_slack(m, 0)) << name;
  }
}

TEST_P(CsgConformance, FactorsOutOfRangeAreRefusedByNode) {
  const auto refused = [&](Vec3 f, const std::vector<std::string>& words) {
    expect_error(unite({box(1, 1, 1), scale(sphere(1), f).named("egg")}), words);
  };
  refused({0, 1, 1}, {"node 2", "\"egg\"", "scale x", "0"});
  refused({1, -2, 1}, {"\"egg\"", "scale y", "-2"});
  refused({1, 1, std::nan("")}, {"\"egg\"", "scale z"});
  refused({1, 1, INFINITY}, {"\"egg\"", "scale z"});
  refused({1e300, 1, 1}, {"\"egg\"", "scale x", "1e+300", "1000"});
  refused({1, 1e-300, 1}, {"\"egg\"", "scale y", "0.001"});
  expect_error(primitive(CsgKind::ellipsoid, {0.1, 0, 0.1}).named("egg"),
               {"\"egg\"", "ellipsoid y", "0"});
  expect_error(primitive(CsgKind::ellipsoid, {0.1, 0.1, 1e300}), {"ellipsoid z"});
  if (!is_mesh()) expect_error(scale(torus(100, 10), {1000, 1, 1}), {"scale", "m long"});
  // One within the other.
  Csg much = sphere(1e-3);
  for (int i = 0; i < 3; ++i) much = scale(std::move(much), {1000, 1, 1});
  expect_error(much, {"node 2", "scales"});
}

}  // namespace robomosp::conformance
