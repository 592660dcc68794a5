// SPDX-License-Identifier: Apache-2.0
// The plugin csg_cgal: the conformance suite, imported meshes, repairs and degenerate operands.
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/csg_suite.h>

#include "support/plugin_door.h"

namespace robomosp::conformance {
namespace {

const std::string kFile = ROBOMOSP_PLUGIN_DIR "/csg_cgal.so";

std::unique_ptr<CsgEngine> make_cgal() { return test::make_provider<CsgEngine>(kFile, "cgal"); }

INSTANTIATE_TEST_SUITE_P(Cgal, CsgConformance,
                         ::testing::Values(CsgSubject{"cgal", make_cgal,
                                                      test::open_plugin(kFile).providers[0].tags}),
                         [](const auto& subject) { return subject.param.name; });

class CgalCsg : public ::testing::Test {
 protected:
  std::shared_ptr<const CsgShape> shape(const Csg& c) {
    NoProgress progress;
    auto made = engine->evaluate(c.tree(), progress);
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().sentence());
    return made.ok() ? *made : nullptr;
  }
  Moments moments(const Csg& c) {
    NoProgress progress;
    const auto s = shape(c);
    return s ? *engine->moments(*s, progress) : Moments{};
  }
  std::string refusal(const Csg& c) {
    NoProgress progress;
    const auto made = engine->evaluate(c.tree(), progress);
    return made.ok() ? "it was made" : made.error().sentence();
  }
  std::unique_ptr<CsgEngine> engine = make_cgal();
};

/// The unit cube, its corners numbered by their coordinates' bits.
CsgGeometry cube() {
  CsgGeometry g;
  g.form = CsgGeometry::Form::mesh;
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 3; ++k) g.points.push_back((i >> k) & 1);
  g.triangles = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  return g;
}
Csg scan(CsgGeometry g, double scale = 1) {
  Csg c = primitive(CsgKind::imported, {scale});
  c.node.geometry = std::make_shared<const CsgGeometry>(std::move(g));
  return c.named("scan");
}
/// A sphere of rows by columns, on no grid.
CsgGeometry ball(int rows, int columns, double radius) {
  CsgGeometry g;
  g.form = CsgGeometry::Form::mesh;
  const auto add = [&](double polar, double around) {
    g.points.insert(g.points.end(),
                    {radius * std::sin(polar) * std::cos(around),
                     radius * std::sin(polar) * std::sin(around), radius * std::cos(polar)});
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

TEST_F(CgalCsg, TheDoorTellsWhatThePluginIs) {
  const rmp_plugin& plugin = test::open_plugin(kFile);
  EXPECT_STREQ(plugin.id, "org.robomosp.csg_cgal");
  EXPECT_STREQ(plugin.license, "GPL-3.0-or-later");
  ASSERT_EQ(plugin.provider_count, 1U);
  EXPECT_STREQ(plugin.providers[0].tags, "mesh,approximate,overlap");
}

TEST_F(CgalCsg, CirclesHaveTheirAreaSoThatLonePrimitivesHaveTheirVolume) {
  for (const auto& c : detail::primitive_cases()) {
    const Moments m = moments(c.solid);
    EXPECT_NEAR(m.volume, c.want.volume, 1e-8 * c.want.volume) << c.name;
    EXPECT_LE(std::abs(m.second.zz - c.want.second.zz), m.relative_error * m.second.zz) << c.name;
  }
}

TEST_F(CgalCsg, AnImportedPolyhedronIsExact) {
  const Moments m = moments(scan(cube(), 0.2));
  EXPECT_TRUE(m.exact);
  EXPECT_NEAR(m.volume, 0.008, 1e-14);
  EXPECT_NEAR(m.area, 0.24, 1e-13);
  EXPECT_NEAR(m.second.xy, 0.2 * 0.02 * 0.02, 1e-15);
  const auto s = shape(scan(cube()));
  EXPECT_TRUE(s->notes().empty());
}

TEST_F(CgalCsg, RepairsOfAnImportedMeshAreTold) {
  const auto note_of = [&](const CsgGeometry& g) {
    const auto s = shape(scan(g));
    NoProgress progress;
    if (s) {
      EXPECT_NEAR(engine->moments(*s, progress)->volume, 1, 1e-5);
    }
    return s && s->notes().size() == 1 ? s->notes()[0] : "not one note";
  };
  CsgGeometry inside_out = cube();
  for (std::size_t t = 0; t < inside_out.triangles.size(); t += 3)
    std::swap(inside_out.triangles[t], inside_out.triangles[t + 1]);
  EXPECT_EQ(note_of(inside_out),
            "node 0 (\"scan\"): 12 triangles of the mesh that faced inwards were flipped.");
  CsgGeometry one_turned = cube();
  std::swap(one_turned.triangles[0], one_turned.triangles[1]);
  EXPECT_EQ(note_of(one_turned),
            "node 0 (\"scan\"): 1 triangle of the mesh that faced inwards were flipped.");
  CsgGeometry twice = cube();
  twice.triangles.insert(twice.triangles.end(), {0, 2, 3, 5, 5, 7});
  EXPECT_EQ(note_of(twice),
            "node 0 (\"scan\"): 2 triangles of the mesh without area or with the corners of "
            "another were removed.");
  CsgGeometry torn = cube();  // one triangle has corners of its own, a micrometre off
  torn.points.insert(torn.points.end(), {1e-7, 0, 0, 0, 1 + 1e-7, 0, 1, 1, 1e-7});
  torn.triangles[0] = 8;
  torn.triangles[1] = 9;
  torn.triangles[2] = 10;
  EXPECT_EQ(note_of(torn),
            "node 0 (\"scan\"): 3 corners of the mesh less than 0.0017 mm from another "
            "were welded to it.");
  CsgGeometry sliver = cube();  // an edge divided on one side only, closed by a flat triangle
  sliver.points.insert(sliver.points.end(), {0.5, 0, 0});
  const std::vector<std::uint32_t> front{0, 8, 5, 8, 1, 5, 0, 1, 8};
  sliver.triangles.erase(sliver.triangles.begin() + 12, sliver.triangles.begin() + 15);
  sliver.triangles.insert(sliver.triangles.end(), front.begin(), front.end());
  EXPECT_EQ(note_of(sliver),
            "node 0 (\"scan\"): 1 triangle of the mesh without area or with the corners of another "
            "were removed.");
}

TEST_F(CgalCsg, MeshesThatBoundNoSolidAreRefusedWithThePlace) {
  CsgGeometry open = cube();
  open.triangles.resize(open.triangles.size() - 3);
  EXPECT_EQ(refusal(scan(open)),
            "node 0 (\"scan\"): the mesh is not closed: 3 edges with a triangle on one side only, "
            "the first at (1e+03 mm, 0 mm, 5e+02 mm). Close it in the program it came from.");
  CsgGeometry crossing = cube();
  CsgGeometry second = cube();
  for (double& x : second.points) x += 0.5;
  crossing.points.insert(crossing.points.end(), second.points.begin(), second.points.end());
  for (const std::uint32_t v : second.triangles) crossing.triangles.push_back(v + 8);
  const std::string cut = refusal(scan(crossing));
  EXPECT_EQ(cut.find("node 0 (\"scan\"): the mesh cuts itself, for example at ("), 0U) << cut;
  CsgGeometry wild = cube();
  wild.points[4] = std::nan("");
  EXPECT_NE(refusal(scan(wild)).find("not a number"), std::string::npos);
}

TEST_F(CgalCsg, SolidsThatTouchInALineOrAPointAreClosed) {
  const Csg block = box(0.1, 0.1, 0.1);
  NoProgress progress;
  const std::vector<std::pair<std::string, Csg>> pairs{
      {"edge", unite({block, block.at(0.1, 0.1, 0)})},
      {"corner", unite({block, block.at(0.1, 0.1, 0.1)})},
      {"face", unite({block, block.at(0.1, 0, 0)})},
      {"face, turned", unite({block, block.at(0.1, 0, 0)}).at(turned({1, 2, 3}, 0.7))}};
  for (const auto& [name, c] : pairs) {
    const auto s = shape(c);
    ASSERT_NE(s, nullptr) << name;
    EXPECT_NEAR(engine->moments(*s, progress)->volume, 2e-3, 1e-9) << name;
    const auto m = engine->mesh(*s, {}, progress);
    ASSERT_TRUE(m.ok()) << m.error().sentence();
    EXPECT_EQ(facts(*m).unbalanced_sides, 0U) << name;
  }
  // Two square holes that meet in an edge inside the plate.
  const Csg holes = subtract({box(0.3, 0.3, 0.1), box(0.1, 0.1, 0.2).at(-0.05, -0.05, -0.05),
                              box(0.1, 0.1, 0.2).at(0.05, 0.05, -0.05)});
  const auto plate = shape(holes);
  ASSERT_NE(plate, nullptr);
  EXPECT_NEAR(engine->moments(*plate, progress)->volume, 7e-3, 1e-9);
  const auto m = engine->mesh(*plate, {}, progress);
  ASSERT_TRUE(m.ok()) << m.error().sentence();
  EXPECT_EQ(facts(*m).unbalanced_sides, 0U);
}

TEST_F(CgalCsg, ManyCutsOneAfterAnotherKeepTheSurfaceWhole) {
  // Consecutive operations with rounded corners cut themselves before the hundredth.
  std::vector<Csg> all{scan(ball(16, 24, 0.1))};
  for (int i = 0; i < 12; ++i) {
    const double t = 0.5 * i;
    all = {subtract({unite({all[0], sphere(0.02).at(0.09 * std::cos(t), 0.09 * std::sin(t), 0)}),
                     cylinder(0.005, 0.4).at(0.09 * std::cos(t), 0.09 * std::sin(t), -0.2)})};
  }
  NoProgress progress;
  const auto s = shape(all[0]);
  ASSERT_NE(s, nullptr);
  const auto m = engine->mesh(*s, {}, progress);
  ASSERT_TRUE(m.ok()) << m.error().sentence();
  EXPECT_EQ(facts(*m).unbalanced_sides, 0U);
  const Moments moments = *engine->moments(*s, progress);
  EXPECT_NEAR(facts(*m).volume, moments.volume, 1e-5 * moments.volume);
}

TEST_F(CgalCsg, NotesTellHowFarCurvedFacesAreOff) {
  const auto s = shape(sphere(0.05));
  ASSERT_EQ(s->notes().size(), 1U);
  EXPECT_EQ(s->notes()[0].find("Computed from triangles: curved faces are within 0.1 mm"), 0U)
      << s->notes()[0];
}

TEST_F(CgalCsg, WorkThatIsUnderWayStops) {
  class Later final : public Progress {
   public:
    void report(double, std::string_view) override {}
    [[nodiscard]] bool cancelled() const override { return ++asked > 40; }
    mutable int asked = 0;
  } later;
  const Csg c = subtract({scan(ball(40, 60, 0.1)), scan(ball(41, 60, 0.1)).at(0.02, 0.01, 0)});
  const auto made = engine->evaluate(c.tree(), later);
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.error().code, ErrorCode::cancelled);
  EXPECT_LT(later.asked, 50) << "it stopped at once";
}

}  // namespace
}  // namespace robomosp::conformance
