// SPDX-License-Identifier: Apache-2.0
// Boolean operations that look only at the triangles near the cut, held to those that look at both
// solids from end to end, on solids that lie in each other's way in every manner.
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/csg_suite.h>

#include "support/plugin_door.h"
#include "support/seed.h"

namespace robomosp::conformance {
namespace {

const std::string kFile = ROBOMOSP_PLUGIN_DIR "/csg_cgal.so";

struct Outcome {
  Moments moments;
  Mesh mesh;
  bool is_moved = false;  ///< a note says that solids that only touch were moved
  std::string refusal;
};

class NearTheCut : public ::testing::Test {
 protected:
  /// `way`: "near", "whole", or "" as users have it.
  Outcome made(const Csg& c, const char* way) {
    ::setenv("ROBOMOSP_CSG_TRIANGLES", way, 1);
    NoProgress progress;
    const auto shape = engine->evaluate(c.tree(), progress);
    ::unsetenv("ROBOMOSP_CSG_TRIANGLES");
    Outcome out;
    if (!shape.ok()) {
      out.refusal = shape.error().sentence();
      return out;
    }
    for (const std::string& note : (*shape)->notes())
      out.is_moved = out.is_moved || note.find("were moved by") != std::string::npos;
    out.moments = *engine->moments(**shape, progress);
    out.mesh = *engine->mesh(**shape, {}, progress);
    return out;
  }

  /// Returns what was made near the cut; its volume is 0 where it is refused as empty.
  Outcome expect_alike(const Csg& c, const std::string& name) {
    const Outcome near = made(c, "near"), whole = made(c, "whole");
    const bool is_empty = near.refusal.find("the result is empty") != std::string::npos;
    EXPECT_TRUE(near.refusal.empty() || is_empty) << name << ": " << near.refusal;
    if (near.refusal.empty()) {
      EXPECT_EQ(facts(near.mesh).unbalanced_sides, 0U) << name;
    }
    // Again, and the same to the last bit.
    const Outcome again = made(c, "near");
    EXPECT_EQ(again.mesh.positions, near.mesh.positions) << name;
    EXPECT_EQ(again.mesh.triangles, near.mesh.triangles) << name;
    // Now and then the whole operation finds no closed surface where there is one, and moves an
    // operand, or loses a shell; what is made near the cut is held to the identities of volumes
    // alone then.
    if ((whole.is_moved || !whole.refusal.empty()) && !near.is_moved) return near;
    EXPECT_EQ(near.is_moved, whole.is_moved) << name;
    EXPECT_EQ(near.refusal, whole.refusal) << name;
    const Moments &m = near.moments, &w = whole.moments;
    // Corners are rounded to doubles, and volumes summed in them.
    double reach = 0;
    for (const float x : near.mesh.positions) reach = std::max(reach, std::abs(double{x}));
    const double slack = 1e-11 * w.volume + 1e-14 * reach * w.area + 1e-15 * reach * reach * reach;
    EXPECT_NEAR(m.volume, w.volume, slack) << name;
    EXPECT_NEAR(m.area, w.area, 1e-9 * w.area + 1e-11 * reach * reach) << name;
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(m.first[i], w.first[i], 4 * reach * slack) << name;
    return near;
  }
  void expect_all_alike(const Csg& a, const Csg& b, const std::string& name) {
    const Outcome a_b = expect_alike(subtract({a, b}), name + ": difference");
    const Outcome b_a = expect_alike(subtract({b, a}), name + ": difference the other way");
    const Outcome both = expect_alike(unite({a, b}), name + ": union");
    const Outcome common = expect_alike(intersect({a, b}), name + ": intersection");
    const Outcome first = made(a, ""), second = made(b, "");
    const double slack =
        (a_b.is_moved || b_a.is_moved || both.is_moved || common.is_moved ? 1e-7 : 1e-11) *
        (first.moments.volume + second.moments.volume);
    const double shared = common.moments.volume;
    EXPECT_NEAR(a_b.moments.volume, first.moments.volume - shared, slack) << name;
    EXPECT_NEAR(b_a.moments.volume, second.moments.volume - shared, slack) << name;
    EXPECT_NEAR(both.moments.volume, first.moments.volume + second.moments.volume - shared, slack)
        << name;
  }

  std::unique_ptr<CsgEngine> engine = test::make_provider<CsgEngine>(kFile, "cgal");
};

Csg scan(CsgGeometry g, double scale = 1) {
  Csg c = primitive(CsgKind::imported, {scale});
  c.node.geometry = std::make_shared<const CsgGeometry>(std::move(g));
  return c;
}

/// The box from 0 to these numbers.
CsgGeometry block(double x, double y, double z) {
  CsgGeometry g;
  g.form = CsgGeometry::Form::mesh;
  const std::array<double, 3> size{x, y, z};
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t k = 0; k < 3; ++k) g.points.push_back((i >> k) & 1U ? size[k] : 0);
  g.triangles = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  return g;
}

/// Starlike, its corners at random distances from the centre.
CsgGeometry rock(std::mt19937& random, int rows, int columns, double roughness) {
  CsgGeometry g;
  g.form = CsgGeometry::Form::mesh;
  std::uniform_real_distribution<double> radius(1 - roughness, 1);
  const auto add = [&](double polar, double around) {
    const double r = radius(random);
    g.points.insert(g.points.end(), {r * std::sin(polar) * std::cos(around),
                                     r * std::sin(polar) * std::sin(around), r * std::cos(polar)});
  };
  add(0, 0);
  for (int i = 1; i < rows; ++i)
    for (int j = 0; j < columns; ++j)
      add(std::numbers::pi * i / rows, 2 * std::numbers::pi * j / columns);
  add(std::numbers::pi, 0);
  const auto at = [&](int i, int j) {
    if (i == 0) return 0U;
    if (i == rows) return static_cast<std::uint32_t>((rows - 1) * columns + 1);
    return static_cast<std::uint32_t>(1 + (i - 1) * columns + j % columns);
  };
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      if (i > 0) g.triangles.insert(g.triangles.end(), {at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + 1 < rows)
        g.triangles.insert(g.triangles.end(), {at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)});
    }
  return g;
}

/// Two meshes as one.
CsgGeometry both(CsgGeometry a, const CsgGeometry& b) {
  const auto corners = static_cast<std::uint32_t>(a.points.size() / 3);
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  for (const std::uint32_t v : b.triangles) a.triangles.push_back(v + corners);
  return a;
}
CsgGeometry moved(CsgGeometry g, const Vec3& by) {
  for (std::size_t i = 0; i < g.points.size(); ++i) g.points[i] += by[i % 3];
  return g;
}

TEST_F(NearTheCut, BoxesInEveryPositionToEachOther) {
  const Csg a = scan(block(2, 2, 2));
  // Apart, corner to corner, edge to edge, face to face (part, whole, more), across, inside, equal.
  for (const double x : {-3.0, -2.0, -1.0, 0.0, 1.0, 2.0})
    for (const double y : {-2.0, 0.0, 0.5})
      for (const double z : {-2.0, 0.0, 0.5})
        expect_all_alike(
            a, scan(block(2, 1, 1)).at(x, y, z),
            "box at " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z));
}

TEST_F(NearTheCut, IdenticalNestedAndAlmostIdenticalSolids) {
  std::mt19937 random(test::seed());
  const CsgGeometry g = rock(random, 8, 12, 0.3);
  expect_all_alike(scan(g), scan(g), "the same");
  expect_all_alike(scan(g), scan(g).at(1e-9, 0, 0), "the same moved by a nanometre");
  expect_all_alike(scan(g), scan(g).at(turned({0, 0, 1}, 1e-7)), "the same turned by 1e-7");
  expect_all_alike(scan(g), scan(g, 0.25), "one in another");
  expect_all_alike(scan(g), scan(g, 0.25).at(5, 0, 0), "apart");
}

TEST_F(NearTheCut, ShellsInShells) {
  // A hollow block with a block in the hollow, cut by what reaches all of them or one.
  CsgGeometry hollow = moved(block(4, 4, 4), {1, 1, 1});
  for (std::size_t t = 0; t < hollow.triangles.size(); t += 3)
    std::swap(hollow.triangles[t], hollow.triangles[t + 1]);
  const CsgGeometry nested = both(both(block(6, 6, 6), hollow), moved(block(2, 2, 2), {2, 2, 2}));
  const Csg solid = scan(nested);
  expect_all_alike(solid, scan(block(10, 0.7, 0.9)).at(-1, 2.6, 2.7), "a bar through all");
  expect_all_alike(solid, scan(block(0.5, 0.7, 0.9)).at(2.6, 2.6, 2.7), "in the core");
  expect_all_alike(solid, scan(block(0.5, 0.7, 0.9)).at(1.2, 2.6, 2.7), "in the hollow");
  expect_all_alike(solid, scan(block(3, 3, 3)).at(1.5, 1.5, 1.5), "round the core");
  expect_all_alike(solid, scan(block(4, 4, 4)).at(1, 1, 1), "a plug of the hollow");
  expect_all_alike(solid, scan(block(20, 20, 20)).at(-5, -5, -5), "round everything");
}

TEST_F(NearTheCut, NeedlesSmallBigAndFarFromTheOrigin) {
  std::mt19937 random(test::seed());
  const CsgGeometry g = rock(random, 7, 11, 0.4);
  const Csg needle = scan(block(4, 1e-6, 1e-6)).at(turned({1, 2, 3}, 0.4));
  expect_all_alike(scan(g), needle, "a needle");
  expect_all_alike(scan(block(4, 4, 1e-7)).at(-2, -2, 0.1), scan(g), "a foil");
  for (const double scale : {1e-6, 1e-3, 1e3}) {
    const Csg a = scan(g, scale), b = scan(g, scale).at(0.3 * scale, 0.2 * scale, 0.1 * scale);
    expect_all_alike(a, b, "scaled by " + std::to_string(scale));
  }
  const Csg far = scan(moved(g, {4096, -2048, 1024}));
  expect_all_alike(far, scan(moved(rock(random, 6, 9, 0.2), {4096.4, -2048.1, 1024.3})), "far");
}

TEST_F(NearTheCut, CornersInFacesAndEdgesInEdges) {
  // A pyramid's tip on a face, its edge in one, its tip on an edge and on a corner.
  CsgGeometry tip;
  tip.form = CsgGeometry::Form::mesh;
  tip.points = {0, 0, 0, 1, 0, 1, 0, 1, 1, -1, -1, 1};
  tip.triangles = {0, 2, 1, 0, 3, 2, 0, 1, 3, 1, 2, 3};
  const Csg b = scan(block(2, 2, 2));
  for (const auto& [x, y, z] :
       {std::array{1.0, 0.5, 2.0}, std::array{2.0, 1.0, 2.0}, std::array{2.0, 2.0, 2.0},
        std::array{1.0, 0.5, 1.0}, std::array{1.0, 1.0, 1.0}, std::array{0.0, 0.0, 1.0}})
    expect_all_alike(b, scan(tip).at(x, y, z), "tip at " + std::to_string(x));
}

TEST_F(NearTheCut, RandomRocksTurnedAndOneAfterAnother) {
  std::mt19937 random(test::seed());
  std::uniform_real_distribution<double> shift(-0.8, 0.8), angle(-3, 3);
  for (int i = 0; i < 12; ++i) {
    const auto pose = [&] {
      Pose p = turned({shift(random), shift(random), 1}, angle(random));
      p.p = {shift(random), shift(random), shift(random)};
      return p;
    };
    const Csg a = scan(rock(random, 6, 9, 0.5)), b = scan(rock(random, 8, 10, 0.5)).at(pose());
    expect_all_alike(a, b, "rocks " + std::to_string(i));
    // The result of one turned, as an operand of the next.
    const Csg c = scan(rock(random, 5, 7, 0.3), 0.6).at(pose());
    expect_alike(subtract({unite({subtract({a, b}).at(pose()), c}).at(pose()), b}),
                 "three " + std::to_string(i));
  }
}

TEST_F(NearTheCut, ManyHolesOfAllKinds) {
  std::vector<Csg> all{scan(block(10, 10, 1))};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      all.push_back((i + j) % 2 ? box(0.5, 0.5, 3).at(1.0 + i, 1.0 + j, -1)
                                : cylinder(0.3, 3).at(1.2 + i, 1.2 + j, -1));
  expect_alike(subtract(all), "holes");
  for (std::size_t i = 1; i < all.size(); ++i) all[i].node.placement.p[2] = 0.5;
  expect_alike(subtract(all), "pockets");
  for (std::size_t i = 1; i < all.size(); ++i) all[i].node.placement.p[2] = 1;
  expect_alike(unite(all), "studs");
}

TEST_F(NearTheCut, AKeptImportIsNoOtherOne) {
  NoProgress progress;
  const auto volume = [&](const Csg& c) {
    const auto shape = engine->evaluate(c.tree(), progress);
    return shape.ok() ? engine->moments(**shape, progress)->volume : -1;
  };
  const Csg one = scan(block(1, 2, 3));
  EXPECT_NEAR(volume(one), 6, 1e-12);
  EXPECT_NEAR(volume(one), 6, 1e-12);
  Csg scaled = one;  // the same geometry, another scale
  scaled.node.sizes[0] = 2;
  EXPECT_NEAR(volume(scaled), 48, 1e-11);
  EXPECT_NEAR(volume(one.at(turned({1, 2, 3}, 0.5))), 6, 1e-11);
  for (int i = 1; i < 40; ++i)  // geometries that die, so that addresses are used again
    EXPECT_NEAR(volume(scan(block(1, 1, i))), i, 1e-11);
  // Repairs are told each time.
  CsgGeometry turned_in = block(1, 1, 1);
  std::swap(turned_in.triangles[0], turned_in.triangles[1]);
  const Csg mended = scan(turned_in);
  for (int i = 0; i < 2; ++i) {
    const auto shape = engine->evaluate(mended.tree(), progress);
    ASSERT_TRUE(shape.ok());
    ASSERT_EQ((*shape)->notes().size(), 1U);
    EXPECT_NE((*shape)->notes()[0].find("were flipped"), std::string::npos);
  }
}

}  // namespace
}  // namespace robomosp::conformance
