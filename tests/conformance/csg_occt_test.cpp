// SPDX-License-Identifier: Apache-2.0
// The plugin csg_occt: the conformance suite, degenerate operands, and the compound object of the
// ROBOMOSP paper.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/csg_suite.h>

#include "support/plugin_door.h"

namespace robomosp::conformance {
namespace {

const std::string kFile = ROBOMOSP_PLUGIN_DIR "/csg_occt.so";

std::unique_ptr<CsgEngine> make_occt() { return test::make_provider<CsgEngine>(kFile, "occt"); }

INSTANTIATE_TEST_SUITE_P(Occt, CsgConformance,
                         ::testing::Values(CsgSubject{"occt", make_occt,
                                                      test::open_plugin(kFile).providers[0].tags}),
                         [](const auto& subject) { return subject.param.name; });

class OcctCsg : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { engine_ = make_occt().release(); }
  static void TearDownTestSuite() {
    delete engine_;
    engine_ = nullptr;
  }
  static std::shared_ptr<const CsgShape> shape(const Csg& c) {
    NoProgress progress;
    auto result = engine_->evaluate(c.tree(), progress);
    if (!result) {
      ADD_FAILURE() << result.error().sentence();
      return nullptr;
    }
    return *result;
  }
  static Moments moments(const Csg& c) {
    NoProgress progress;
    const auto s = shape(c);
    return s ? *engine_->moments(*s, progress) : Moments{};
  }
  // The volume, and the same from a closed mesh.
  static void expect_solid(const Csg& c, double volume, double relative, const char* what) {
    SCOPED_TRACE(what);
    const auto s = shape(c);
    ASSERT_NE(s, nullptr);
    NoProgress progress;
    const auto m = engine_->moments(*s, progress);
    ASSERT_TRUE(m.ok()) << m.error().sentence();
    EXPECT_NEAR(m->volume, volume, relative * volume);
    const auto mesh = engine_->mesh(*s, {1e-4, 0.3}, progress);
    ASSERT_TRUE(mesh.ok()) << mesh.error().sentence();
    const MeshFacts f = facts(*mesh);
    EXPECT_EQ(f.unbalanced_sides, 0U);
    EXPECT_NEAR(f.volume, volume, m->area * 1e-4);
  }
  static CsgEngine* engine_;
};
CsgEngine* OcctCsg::engine_ = nullptr;

constexpr double kPi = std::numbers::pi;
constexpr double kExact = 1e-12;

TEST_F(OcctCsg, TheDoorTellsWhatThePluginIs) {
  const rmp_plugin& plugin = test::open_plugin(kFile);
  EXPECT_STREQ(plugin.id, "org.robomosp.csg_occt");
  EXPECT_STREQ(plugin.license, "Apache-2.0");
  ASSERT_EQ(plugin.provider_count, 1U);
  EXPECT_STREQ(plugin.providers[0].interface_id, CsgEngine::kInterfaceId);
}

TEST_F(OcctCsg, PlanarAndPlainSolidsAreExactToFourteenDigits) {
  for (const auto& c : detail::primitive_cases()) {
    const Moments m = moments(c.solid);
    expect_moments(m, c.want, 1e-14, c.name);
    EXPECT_TRUE(m.exact) << c.name;
  }
}

TEST_F(OcctCsg, CoplanarFacesJoinExactly) {
  const Csg cube = box(0.1, 0.1, 0.1);
  expect_solid(unite({cube, cube.at(0.1, 0, 0)}), 2e-3, kExact, "side by side");
  expect_solid(unite({cube, cube.at(0.05, 0, 0)}), 1.5e-3, kExact, "shared side planes");
  expect_solid(unite({cube, box(0.05, 0.05, 0.1).at(0, 0, 0.1)}), 1.25e-3, kExact, "stacked");
  expect_solid(subtract({cube, box(0.05, 0.05, 0.05).at(0, 0, 0.05)}), 8.75e-4, kExact,
               "flush pocket");
  expect_solid(subtract({cube, box(0.1, 0.05, 0.05).at(0, 0, 0.05)}), 7.5e-4, kExact, "flush slot");
  const Pose tilt = turned({1, 1, 0}, 0.0872664625997165);
  expect_solid(unite({cube, cube.at(0.1, 0, 0)}).at(tilt), 2e-3, kExact, "tilted");
}

TEST_F(OcctCsg, SpheresAndToriAreMeshedWithinTheChordAndNoFinerThanAGridNeeds) {
  const double R = 0.05, ring = 0.06, tube = 0.02;
  const auto off_sphere = [&](const std::array<double, 3>& p) {
    return std::abs(std::hypot(p[0], p[1], p[2]) - R);
  };
  const auto off_torus = [&](const std::array<double, 3>& p) {
    return std::abs(std::hypot(std::hypot(p[0], p[1]) - ring, p[2]) - tube);
  };
  const Csg low = box(1, 1, 1).at(0, 0, -1);
  struct Case {
    const char* name;
    Csg solid;
    std::function<double(const std::array<double, 3>&)> off;
    double volume;
    double most_triangles;  ///< at a chord of 10 um
  };
  const double ball = 4 * kPi / 3 * R * R * R, donut = 2 * kPi * kPi * ring * tube * tube;
  // A grid of steps 2 acos(1 - chord / 2 R) has so many triangles.
  const double step = 2 * std::acos(1 - 1e-5 / (2 * R)), grid = 4 * kPi * kPi / (step * step);
  const std::vector<Case> cases{
      {"ball", sphere(R), off_sphere, ball, 1.1 * grid},
      {"turned ball", sphere(R).at(turned({1, 2, 3}, 0.7)), off_sphere, ball, 1.1 * grid},
      {"ring", torus(ring, tube), off_torus, donut, 1.1 * 2 * grid * (ring + tube) / R},
      {"half a ball", subtract({sphere(R), low}), off_sphere, ball / 2, 0.6 * grid}};
  NoProgress progress;
  for (const Case& c : cases)
    for (const double chord : {1e-5, 1e-4}) {
      SCOPED_TRACE(std::string(c.name) + ", chord " + std::to_string(chord));
      const auto s = shape(c.solid);
      ASSERT_NE(s, nullptr);
      const auto mesh = engine_->mesh(*s, {chord, 0.35}, progress);
      ASSERT_TRUE(mesh.ok()) << mesh.error().sentence();
      const MeshFacts f = facts(*mesh, chord);
      EXPECT_EQ(f.unbalanced_sides, 0U);
      EXPECT_NEAR(f.volume, c.volume, 6 * c.volume / R * chord);
      if (chord < 1e-4) {
        EXPECT_LT(static_cast<double>(mesh->triangle_count()), c.most_triangles);
      }
      double worst = 0;
      for (std::size_t t = 0; t < mesh->triangle_count(); ++t) {
        std::array<double, 3> middle{};
        for (std::size_t k = 0; k < 3; ++k) {
          std::array<double, 3> p{};
          for (std::size_t i = 0; i < 3; ++i) {
            p[i] = static_cast<double>(mesh->positions[3 * mesh->triangles[3 * t + k] + i]);
            middle[i] += p[i] / 3;
          }
          ASSERT_LT(std::abs(std::hypot(mesh->normals[3 * mesh->triangles[3 * t + k]],
                                        mesh->normals[3 * mesh->triangles[3 * t + k] + 1],
                                        mesh->normals[3 * mesh->triangles[3 * t + k] + 2]) -
                             1),
                    1e-5);
        }
        const bool is_cut =
            std::abs(std::abs(middle[2]) - 0.03) < 1e-7 || std::abs(middle[2]) < 1e-9;
        if (!is_cut) worst = std::max(worst, c.off(middle));
      }
      EXPECT_LE(worst, chord * 1.01 + 1e-8);
    }
}

TEST_F(OcctCsg, CoincidentSolidsAreOneSolid) {
  const double V = kPi * 0.05 * 0.05 * 0.1;
  const Csg c = cylinder(0.05, 0.1);
  expect_solid(unite({c, c}), V, kExact, "union with itself");
  expect_solid(intersect({c, c}), V, kExact, "intersection with itself");
  expect_solid(unite({sphere(0.05), sphere(0.05)}), 4 * kPi / 3 * 1.25e-4, kExact, "spheres");
  NoProgress progress;
  const auto nothing = engine_->evaluate(subtract({c, c}).tree(), progress);
  ASSERT_FALSE(nothing.ok());
  EXPECT_EQ(nothing.error().code, ErrorCode::invalid_argument);
}

TEST_F(OcctCsg, CoaxialCylindersMakeATube) {
  const Csg tube = subtract({cylinder(0.05, 0.1), cylinder(0.04, 0.1)});
  const double V = kPi * (0.0025 - 0.0016) * 0.1;
  expect_solid(tube, V, kExact, "flush ends");
  expect_solid(unite({tube, cylinder(0.04, 0.1)}), kPi * 0.0025 * 0.1, kExact, "plugged");
  expect_solid(tube.at(turned({1, 0.2, 0}, 0.0872664625997165)), V, kExact, "tilted");
}

TEST_F(OcctCsg, TouchingSolidsStaySeparateAndClosed) {
  const Csg cube = box(0.1, 0.1, 0.1);
  expect_solid(unite({cube, cube.at(0.1, 0.1, 0)}), 2e-3, kExact, "along an edge");
  expect_solid(unite({cube, cube.at(0.1, 0.1, 0.1)}), 2e-3, kExact, "in a corner");
  expect_solid(unite({cube, sphere(0.05).at(0, 0, 0.15)}), 1e-3 + 4 * kPi / 3 * 1.25e-4, 1e-9,
               "sphere on a face");
  const Csg two = unite({cube, cube.at(0.3, 0, 0)});
  expect_solid(two, 2e-3, kExact, "apart");
  ASSERT_EQ(shape(two)->notes().size(), 1U);
  EXPECT_EQ(shape(two)->notes()[0], "The solid consists of 2 separate pieces.");
}

TEST_F(OcctCsg, TangentHolesLeaveClosedPieces) {
  // A hole of the box's full width touches two sides along lines.
  expect_solid(subtract({box(0.1, 0.1, 0.1), cylinder(0.05, 0.1)}), 1e-3 - kPi * 2.5e-4, 1e-9,
               "hole as wide as the box");
}

TEST_F(OcctCsg, DiscsJoinedByAFrustumThatIsAllButTangentGiveAClosedPlate) {
  // The sides touch the discs where the radius makes the angle acos((R - r) / d) with the line of
  // centres. Rounding the corners leaves slivers between side and disc, from 1e-4 m down to
  // nothing.
  const double R = 0.06, r = 0.04, d = 0.2, h = 0.02;
  const double c = (R - r) / d, s = std::sqrt(1 - c * c), angle = std::acos(c);
  for (const double step : {0.0, 1e-4, 1e-5, 1e-6, 1e-8}) {
    const auto snap = [&](double x) { return step > 0 ? std::round(x / step) * step : x; };
    const double x1 = snap(R * c), y1 = snap(R * s), x2 = snap(d + r * c), y2 = snap(r * s);
    const Csg plate = unite(
        {cylinder(R, h), cylinder(r, h).at(d, 0, 0),
         frustum(h, 2 * y1, h, 2 * y2, x2 - x1).at(turned({0, 1, 0}, kPi / 2, {x1, 0, h / 2}))});
    const double area =
        (x2 - x1) * (y1 + y2) + R * R * (kPi - angle + s * c) + r * r * (angle - s * c);
    expect_solid(plate, area * h, std::max(1e-9, 4 * step / R), std::to_string(step).c_str());
  }
}

TEST_F(OcctCsg, ARoundedCylinderHasTheVolumeOfPappus) {
  for (const double f : {1e-5, 0.01, 0.03, 0.0499, 0.05 - 1e-10}) {
    const double R = 0.05, h = 0.12, flat = R - f;
    // A quarter disc's centre of area is 4 f / (3 pi) from its corner.
    const double rim = 2 * kPi * (flat + 4 * f / (3 * kPi)) * kPi * f * f / 4;
    const double V = kPi * R * R * (h - 2 * f) + 2 * (kPi * flat * flat * f + rim);
    const auto s = shape(cylinder(R, h, f));
    ASSERT_NE(s, nullptr) << f;
    NoProgress progress;
    const Moments m = *engine_->moments(*s, progress);
    EXPECT_NEAR(m.volume, V, 1e-8 * V) << f;
    EXPECT_NEAR(m.first[2], V * h / 2, 1e-8 * V * h) << f;
    EXPECT_NEAR(s->bounds()[0][0], -R, 1e-9) << f;
    EXPECT_NEAR(s->bounds()[1][1], R, 1e-9) << f;
    EXPECT_NEAR(s->bounds()[1][2], h, 1e-9) << f;
    expect_solid(subtract({cylinder(R, h, f), cylinder(0.0001, 1).at(0, 0, -0.1)}),
                 V - kPi * 1e-8 * h, 1e-6, "bored");
  }
}

TEST_F(OcctCsg, EdgesWorkedAsWideAsTheirFaceLoseTheirPrisms) {
  const double a = 0.01;
  // Each bevel takes a prism over a right triangle.
  const auto left = [&](double size, int bevels) {
    return a * a * a - bevels * a * size * size / 2;
  };
  const char* top = "parallel x and top";
  expect_solid(chamfer(box(a, a, a), a / 2, top), left(a / 2, 2), kExact, "two that meet");
  expect_solid(chamfer(box(a, a, a), 0.499 * a, top), left(0.499 * a, 2), kExact, "nearly");
  expect_solid(chamfer(box(a, a, a), a, "parallel x and top and back"), left(a, 1), kExact,
               "as wide as the face");
  expect_solid(chamfer(box(a, a, a), a / 2, "parallel x"), left(a / 2, 4), kExact, "a diamond");
  const auto rounded = [&](double r, int fillets) {
    return a * a * a - fillets * a * r * r * (1 - kPi / 4);
  };
  expect_solid(fillet(box(a, a, a), a / 2, top), rounded(a / 2, 2), kExact, "half a cylinder");
  expect_solid(fillet(box(a, a, a), 0.499 * a, top), rounded(0.499 * a, 2), kExact, "nearly");
  expect_solid(fillet(box(a, a, a), a, "parallel x and top and back"), rounded(a, 1), kExact,
               "a quarter of a cylinder");
  expect_solid(fillet(box(a, a, a), a / 2, "parallel x"), rounded(a / 2, 4), kExact, "a cylinder");
  // Beyond the line they would overlap: no bevel of this size.
  NoProgress progress;
  const auto beyond = engine_->evaluate(chamfer(box(a, a, a), 0.6 * a, top).tree(), progress);
  ASSERT_FALSE(beyond.ok());
  EXPECT_NE(beyond.error().sentence().find("too large"), std::string::npos);
}

TEST_F(OcctCsg, ACylinderOfFourQuartersTakesAFillet) {
  const double r = 0.005, h = 0.01, f = 0.001;
  const Csg quarters = fillet(box(2 * r, 2 * r, h), r, "parallel z");
  // Pappus: a square less a quarter of a disc, at the rim.
  const double area = f * f * (1 - kPi / 4);
  const double from_rim = (f * f * f / 2 - kPi * f * f / 4 * (f - 4 * f / (3 * kPi))) / area;
  expect_solid(fillet(quarters, f, "round and top"),
               kPi * r * r * h - 2 * kPi * (r - from_rim) * area, 1e-9, "quarters");
}

TEST_F(OcctCsg, CrossingEqualCylindersShareSteinmetzVolume) {
  const double r = 0.03;
  const Csg a = cylinder(r, 0.2).at(0, 0, -0.1);
  const Csg b = cylinder(r, 0.2).at(turned({0, 1, 0}, kPi / 2, {-0.1, 0, 0}));
  expect_solid(intersect({a, b}), 16.0 / 3 * r * r * r, 1e-9, "intersection");
  expect_solid(unite({a, b}), 2 * kPi * r * r * 0.2 - 16.0 / 3 * r * r * r, 1e-9, "union");
}

TEST_F(OcctCsg, NearlyEqualSolidsGiveARightResultOrAnError) {
  for (const double angle : {1e-9, 1e-8, 5e-8, 1e-7, 2e-7, 3e-7, 1e-6, 1e-5, 1e-4}) {
    const Csg c =
        unite({box(0.01, 0.01, 0.01), box(0.01, 0.01, 0.01).at(turned({0, 0, 1}, angle))});
    NoProgress progress;
    const auto s = engine_->evaluate(c.tree(), progress);
    if (!s.ok()) {
      EXPECT_EQ(s.error().code, ErrorCode::plugin_failed) << s.error().sentence();
      continue;
    }
    // The two squares differ by eight triangles: area a^2 (1 + tan(angle / 2) ...) ~ a^2 angle / 2.
    EXPECT_NEAR(engine_->moments(**s, progress)->volume, 1e-6 * (1 + angle / 2), 1e-6 * 3e-5)
        << angle;
  }
  const Csg shell = subtract({cylinder(0.0050001, 0.1), cylinder(0.005, 0.1)});
  expect_solid(shell, kPi * (0.0050001 * 0.0050001 - 0.005 * 0.005) * 0.1, 1e-6, "thin tube");
}

TEST_F(OcctCsg, ASphereWhosePoleLiesOnTheCutKeepsItsVolume) {
  // Sphere R minus three orthogonal cylinders r through its centre, sphere turned so that a pole
  // comes near the cut. By inclusion-exclusion: each sphere-cylinder intersection is
  // 4/3 pi (R^3 - (R^2 - r^2)^(3/2)), each pair of cylinders 16/3 r^3, all three
  // 8 (2 - sqrt 2) r^3 (the tricylinder), which lies inside the sphere for r sqrt 1.5 < R.
  const double R = 0.05, r = 0.02;
  const double one = 4 * kPi / 3 * (R * R * R - std::pow(R * R - r * r, 1.5));
  const double cut = 3 * one - 3 * 16.0 / 3 * r * r * r + 8 * (2 - std::sqrt(2.0)) * r * r * r;
  const Csg z = cylinder(r, 0.12).at(0, 0, -0.06);
  const Csg x = cylinder(r, 0.12).at(turned({0, 1, 0}, kPi / 2, {-0.06, 0, 0}));
  const Csg y = cylinder(r, 0.12).at(turned({1, 0, 0}, kPi / 2, {0, 0.06, 0}));
  const double V = 4 * kPi / 3 * R * R * R - cut;
  expect_solid(subtract({sphere(R), x, y, z}), V, 1e-8, "aligned");
  // asin(r / R) puts the pole on the rim of the bore along z.
  const Csg tilted = sphere(R).at(turned({1, 0, 0}, std::asin(r / R)));
  expect_solid(subtract({tilted, x, y, z}), V, 1e-8, "pole on the rim");
}

// What a default integrator gets wrong by 1e-5 and more on trimmed spheres.
TEST_F(OcctCsg, InertiaOfTrimmedCurvedSolidsIsRightToEightDigits) {
  const double R = 0.05, r = 0.02, h = std::sqrt(R * R - r * r);
  // A ball with a bore: rings from r to sqrt(R^2 - z^2).
  const double volume = 4 * kPi / 3 * h * h * h;
  const auto slices = [&](auto&& f) { return 2 * detail::gauss5(0, h, f); };
  const double zz = slices([&](double z) { return kPi * z * z * (R * R - z * z - r * r); });
  const double xx =
      slices([&](double z) { return kPi / 4 * (std::pow(R * R - z * z, 2) - std::pow(r, 4)); });
  const Csg bore = cylinder(r, 0.2).at(0, 0, -0.1);
  for (const double tilt : {0.0, 0.7, std::asin(r / R)}) {
    const Csg ball = sphere(R).at(turned({1, 0.2, 0}, tilt));
    expect_moments(moments(subtract({ball, bore})), closed_form(volume, 0, xx, xx, zz), 1e-8,
                   "bored ball, tilted by " + std::to_string(tilt));
  }
  // Three bores through a ball whose pole lies on the rim of one: the body has the symmetry of a
  // cube, whatever the sphere's own axis.
  const Moments m =
      moments(subtract({sphere(R).at(turned({1, 0, 0}, std::asin(r / R))), bore,
                        cylinder(r, 0.12).at(turned({0, 1, 0}, kPi / 2, {-0.06, 0, 0})),
                        cylinder(r, 0.12).at(turned({1, 0, 0}, kPi / 2, {0, 0.06, 0}))}));
  const double third = (m.second.xx + m.second.yy + m.second.zz) / 3;
  Moments want = m;
  want.area = -1;
  want.first = {};
  want.second = {third, third, third, 0, 0, 0};
  expect_moments(m, want, 1e-8, "three bores");
  expect_moments(moments(torus(0.08, 0.02).at(turned({1, 2, 3}, 1))),
                 moved(closed_form(2 * kPi * kPi * 0.08 * 4e-4, 0,
                                   2 * kPi * kPi * 0.08 * 4e-4 * (0.0032 + 1.5e-4),
                                   2 * kPi * kPi * 0.08 * 4e-4 * (0.0032 + 1.5e-4),
                                   2 * kPi * kPi * 0.08 * 4e-4 * 1e-4),
                       turned({1, 2, 3}, 1)),
                 1e-13, "torus");
}

TEST_F(OcctCsg, ToolsThatMissAreToldByName) {
  const auto s = shape(subtract({box(0.1, 0.1, 0.1), cylinder(0.01, 1).at(5, 0, 0).named("bore")}));
  ASSERT_NE(s, nullptr);
  ASSERT_EQ(s->notes().size(), 1U);
  EXPECT_EQ(s->notes()[0], "node 2 (\"bore\"): cuts nothing: it does not reach the solid.");
}

struct Body {
  double mass;
  Vec3 com;
  Vec3 own;  // principal inertia about its own centre, axes parallel to the frame
};

MassProperties closed_form_of(const std::vector<Body>& bodies) {
  MassProperties total;
  for (const Body& b : bodies) {
    total.mass += b.mass;
    for (std::size_t i = 0; i < 3; ++i) total.com[i] += b.mass * b.com[i];
  }
  for (double& c : total.com) c /= total.mass;
  for (const Body& b : bodies) {
    const double x = b.com[0] - total.com[0], y = b.com[1] - total.com[1],
                 z = b.com[2] - total.com[2];
    total.inertia.xx += b.own[0] + b.mass * (y * y + z * z);
    total.inertia.yy += b.own[1] + b.mass * (x * x + z * z);
    total.inertia.zz += b.own[2] + b.mass * (x * x + y * y);
    total.inertia.xy -= b.mass * x * y;
    total.inertia.yz -= b.mass * y * z;
    total.inertia.xz -= b.mass * x * z;
  }
  return total;
}

MassProperties mass_of(const std::vector<Moments>& parts, const std::vector<double>& densities) {
  double m = 0;
  Vec3 f{};
  Sym3 s;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const double rho = densities[k];
    m += rho * parts[k].volume;
    for (std::size_t i = 0; i < 3; ++i) f[i] += rho * parts[k].first[i];
    s.xx += rho * parts[k].second.xx;
    s.yy += rho * parts[k].second.yy;
    s.zz += rho * parts[k].second.zz;
    s.xy += rho * parts[k].second.xy;
    s.yz += rho * parts[k].second.yz;
    s.xz += rho * parts[k].second.xz;
  }
  MassProperties out;
  out.mass = m;
  for (std::size_t i = 0; i < 3; ++i) out.com[i] = f[i] / m;
  const auto& c = out.com;
  s.xx -= m * c[0] * c[0];
  s.yy -= m * c[1] * c[1];
  s.zz -= m * c[2] * c[2];
  out.inertia = {s.yy + s.zz,
                 s.xx + s.zz,
                 s.xx + s.yy,
                 -(s.xy - m * c[0] * c[1]),
                 -(s.yz - m * c[1] * c[2]),
                 -(s.xz - m * c[0] * c[2])};
  return out;
}

TEST_F(OcctCsg, TheCompoundObjectOfThePaperHasItsMassProperties) {
  const auto plate = shape(box(0.20, 0.20, 0.05)), column = shape(cylinder(0.05, 0.20));
  ASSERT_TRUE(plate && column);
  Pose on_top;
  on_top.p = {0, 0.05, 0.05};
  NoProgress progress;
  const auto parts =
      engine_->partition(std::vector<PlacedShape>{{plate, {}}, {column, on_top}}, progress);
  ASSERT_TRUE(parts.ok()) << parts.error().sentence();
  EXPECT_EQ(parts->overlap, 0) << "they only touch";
  const MassProperties got = mass_of(parts->parts, {7850, 2700});

  const double mb = 7850 * 0.2 * 0.2 * 0.05, mc = 2700 * kPi * 0.05 * 0.05 * 0.2;
  const double side = (3 * 0.05 * 0.05 + 0.2 * 0.2) / 12 * mc;
  const MassProperties want =
      closed_form_of({{mb,
                       {0, 0, 0.025},
                       {mb * (0.2 * 0.2 + 0.05 * 0.05) / 12, mb * (0.2 * 0.2 + 0.05 * 0.05) / 12,
                        mb * (0.2 * 0.2 + 0.2 * 0.2) / 12}},
                      {mc, {0, 0.05, 0.15}, {side, side, mc * 0.05 * 0.05 / 2}}});
  const double relative = 1e-12;
  EXPECT_NEAR(got.mass, want.mass, relative * want.mass);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(got.com[i], want.com[i], relative * 0.2);
  EXPECT_NEAR(got.inertia.xx, want.inertia.xx, relative * want.inertia.xx);
  EXPECT_NEAR(got.inertia.yy, want.inertia.yy, relative * want.inertia.yy);
  EXPECT_NEAR(got.inertia.zz, want.inertia.zz, relative * want.inertia.zz);
  EXPECT_NEAR(got.inertia.yz, want.inertia.yz, relative * -want.inertia.yz);
  EXPECT_NEAR(got.inertia.xy, 0, relative);
  EXPECT_NEAR(got.inertia.xz, 0, relative);

  // The closed form to nine decimals, so that an error common to both computations shows; the
  // paper prints these cut off after the fourth.
  EXPECT_NEAR(got.mass, 19.941150082, 5e-10);
  EXPECT_NEAR(got.com[1], 0.010634, 5e-7);
  EXPECT_NEAR(got.com[2], 0.051585, 5e-7);
  EXPECT_NEAR(got.inertia.xx, 0.132913751, 5e-10);
  EXPECT_NEAR(got.inertia.yy, 0.124565930, 5e-10);
  EXPECT_NEAR(got.inertia.zz, 0.118315925, 5e-10);
  EXPECT_NEAR(got.inertia.yz, -0.020869551, 5e-10);
  EXPECT_EQ(std::trunc(got.mass * 1e4), 199411);
  EXPECT_EQ(std::trunc(got.inertia.xx * 1e4), 1329);
  EXPECT_EQ(std::trunc(got.inertia.yy * 1e4), 1245);
  EXPECT_EQ(std::trunc(got.inertia.zz * 1e4), 1183);
  EXPECT_EQ(std::trunc(got.inertia.yz * 1e4), -208);
}

TEST_F(OcctCsg, SectionsFarAwayEndWithTheirLimit) {
  NoProgress progress;
  const auto ball = shape(sphere(0.02));
  for (const double x : {1e308, 1e300, 1e100, 1.1e4}) {
    Pose plane;
    plane.p = {x, 0, 0.005};
    const auto cut = engine_->section(*ball, plane, 1e-4, progress);
    ASSERT_FALSE(cut.ok()) << x;
    EXPECT_NE(cut.error().message.find("farther than 10000 m"), std::string::npos)
        << cut.error().sentence();
  }
  Pose near;
  near.p = {9000, 0, 0.005};
  EXPECT_TRUE(engine_->section(*ball, near, 1e-4, progress).ok());
}

TEST_F(OcctCsg, SlenderConesTakeFewTriangles) {
  NoProgress progress;
  // A needle of 10 um took 13 triangles for each radius of its height, 1.3 million for a metre.
  for (const auto& [base, top, height] : std::vector<std::array<double, 3>>{{1e-5, 0, 1},
                                                                            {0, 1e-5, 0.1},
                                                                            {1e-5, 2e-5, 1},
                                                                            {2e-4, 1e-5, 10},
                                                                            {1e-2, 1e-6, 3},
                                                                            {0.05, 0.02, 0.3},
                                                                            {0.05, 0, 0.3},
                                                                            {0.05, 0.002, 1e-3}}) {
    const auto needle = shape(cone(base, top, height));
    ASSERT_NE(needle, nullptr);
    const auto mesh = engine_->mesh(*needle, {1e-4, 0.35}, progress);
    ASSERT_TRUE(mesh.ok()) << mesh.error().sentence();
    EXPECT_LT(mesh->triangle_count(), 5000U) << base << " " << top << " " << height;
    const MeshFacts f = facts(*mesh);
    EXPECT_EQ(f.unbalanced_sides, 0U) << base << " " << top << " " << height;
    const Moments m = *engine_->moments(*needle, progress);
    EXPECT_NEAR(f.volume, m.volume, m.area * 1e-4 + 1e-7 * m.volume);
  }
  // Where it is fine enough to be seen, it is as near as asked for.
  const auto bell = shape(cone(0.05, 0.002, 0.03));
  const auto mesh = engine_->mesh(*bell, {2e-6, 0.35}, progress);
  ASSERT_TRUE(mesh.ok());
  const Moments m = *engine_->moments(*bell, progress);
  EXPECT_NEAR(facts(*mesh).volume, m.volume, m.area * 2e-6);
}

/// A prism over a wavy outline, whose sides are freeform, from z = `low` up.
CsgTree wavy(double height, double low, bool is_hole) {
  auto outline = std::make_shared<CsgProfile>();
  outline->loops.push_back(
      {{0.02, 0},
       {{CsgCurve::Kind::spline, {{0.017, 0.012}, {0, 0.024}, {-0.015, 0.01}, {-0.022, 0}}},
        {CsgCurve::Kind::spline, {{-0.013, -0.014}, {0, -0.019}, {0.016, -0.011}, {0.02, 0}}}}});
  CsgTree tree;
  if (is_hole) {
    tree.nodes.push_back({CsgKind::difference, -1, {}, {}, "plate"});
    tree.nodes.push_back({CsgKind::box, 0, {}, {0.1, 0.1, 0.03}, "block"});
  }
  CsgNode prism{CsgKind::prism, is_hole ? 0 : -1, {}, {height}, "plug"};
  prism.placement.p[2] = low;
  prism.profile = outline;
  tree.nodes.push_back(prism);
  return tree;
}

TEST_F(OcctCsg, WhatFreeformPartsShareIsMeasuredWhereTheyTouchAndCutWhereTheyCross) {
  NoProgress progress;
  const auto make = [&](const CsgTree& tree) {
    auto made = engine_->evaluate(tree, progress);
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().sentence());
    return made.ok() ? *made : nullptr;
  };
  const auto plate = make(wavy(0.05, -0.01, true)), plug = make(wavy(0.02, 0, false));
  CsgTree box;
  box.nodes.push_back({CsgKind::box, -1, {}, {0.1, 0.1, 0.03}, "block"});
  const auto block = make(box);
  ASSERT_TRUE(plate && plug && block);
  const double own = engine_->moments(*plug, progress)->volume;
  // The plug fills its hole: its whole side is where the plate's is.
  const auto touching =
      engine_->partition(std::vector<PlacedShape>{{plate, {}}, {plug, {}}}, progress);
  ASSERT_TRUE(touching.ok()) << touching.error().sentence();
  const Moments& t = touching->parts[1];
  EXPECT_FALSE(t.exact);
  EXPECT_GT(t.relative_error, 0);
  EXPECT_LT(t.relative_error, 2e-3);
  EXPECT_NEAR(t.volume, own, t.relative_error * own);
  EXPECT_NEAR(touching->overlap, 0, t.relative_error * own);
  // Half of it in the solid block.
  Pose up;
  up.p[2] = 0.02;
  const auto crossing =
      engine_->partition(std::vector<PlacedShape>{{block, {}}, {plug, up}}, progress);
  ASSERT_TRUE(crossing.ok()) << crossing.error().sentence();
  EXPECT_NEAR(crossing->overlap, own / 2, 1e-9 * own);
  EXPECT_NEAR(crossing->parts[1].volume, own / 2, 1e-9 * own);
  EXPECT_NEAR(crossing->parts[1].first[2], own / 2 * 0.035, 1e-9 * own);
}

TEST_F(OcctCsg, FacesThatNearlyCoincideNeverKeepPartsFromAMass) {
  // Pins in holes of their own radius, tilted and moved by a hair: what boolean operations fail on.
  NoProgress progress;
  const auto cylinder = [](double radius, double height) {
    CsgTree tree;
    tree.nodes.push_back({CsgKind::cylinder, -1, {}, {radius, height, 0}, "pin"});
    return tree;
  };
  CsgTree drilled;
  drilled.nodes.push_back({CsgKind::difference, -1, {}, {}, "plate"});
  drilled.nodes.push_back({CsgKind::box, 0, {}, {0.1, 0.1, 0.03}, "block"});
  drilled.nodes.push_back({CsgKind::cylinder, 0, {}, {0.01, 0.03, 0}, "hole"});
  const auto plate = *engine_->evaluate(drilled, progress);
  const auto pin = *engine_->evaluate(cylinder(0.01, 0.05), progress);
  const double own = kPi * 0.01 * 0.01 * 0.05;
  for (const double tilt : {0.0, 1e-9, 3e-8, 1e-6, 2e-5, 1e-3})
    for (const double shift : {0.0, 1e-10, 2e-9, 5e-8, 1e-6}) {
      Pose at;
      at.R = {std::cos(tilt), 0, std::sin(tilt), 0, 1, 0, -std::sin(tilt), 0, std::cos(tilt)};
      at.p = {shift, 0, -0.01};
      const auto parts =
          engine_->partition(std::vector<PlacedShape>{{plate, {}}, {pin, at}}, progress);
      ASSERT_TRUE(parts.ok()) << tilt << " " << shift << ": " << parts.error().sentence();
      const Moments& m = parts->parts[1];
      // A shift by s over a circle of radius r shares 2 r s of each layer, a tilt by a 2 r a h / 4.
      const double most = 2 * 0.01 * (shift + tilt * 0.03) * 0.03;
      const double bound = m.relative_error * own + 1e-7 * own;
      EXPECT_LE(m.volume, own + bound) << tilt << " " << shift;
      EXPECT_GE(m.volume, own - most - bound) << tilt << " " << shift;
      EXPECT_LT(m.relative_error, 5e-3) << tilt << " " << shift;
    }
}

}  // namespace
}  // namespace robomosp::conformance
