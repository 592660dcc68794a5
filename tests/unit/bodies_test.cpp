// SPDX-License-Identifier: Apache-2.0
// Bodies through their commands: masses in other frames, part by part and measured, links'
// parameters, parts placed on each other, looks of materials. Numbers from closed forms.
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "ioci/core/application.h"
#include "spatial/rotation.h"
#include "support/program.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;

constexpr double kHalfTurn = std::numbers::pi;

class Bodies : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    call("material.create", {{"name", "steel"}, {"density", 8000}});
    call("material.create", {{"name", "light"}, {"density", 1000}});
  }

  /// The sentence of a command that must fail and must leave the document as it was.
  std::string fails(std::string_view name, const Map& args = {}) {
    return CommandTest::fails(name, args).sentence();
  }
  static double number(const Value& v, std::string_view key) { return at(v, key).number(); }
  static std::vector<double> array(const Value& v, std::string_view key) {
    const Value found = at(v, key);
    const NumericArray* a = found.as_array();
    EXPECT_NE(a, nullptr) << key;
    return a ? std::vector<double>(a->data()) : std::vector<double>(9, 0.0);
  }
  static Value list(std::initializer_list<double> numbers) {
    List out;
    for (const double x : numbers) out.emplace_back(x);
    return out;
  }
  void solid(const std::string& name, Map root, const std::string& material = "steel") {
    call("solid.create", {{"name", name}, {"material", material}, {"root", std::move(root)}});
  }
  /// Box 0.2 x 0.1 x 0.02 with a bore of radius 5 mm at x = 0.06, and a pin for it.
  void plate_and_pin() {
    solid("plate", Map{{"kind", "difference"},
                       {"children", List{Map{{"kind", "box"}, {"x", 0.2}, {"y", 0.1}, {"z", 0.02}},
                                         Map{{"kind", "cylinder"},
                                             {"radius", 0.005},
                                             {"height", 0.1},
                                             {"position", list({0.06, 0, -0.02})}}}}});
    solid("pin", Map{{"kind", "cylinder"}, {"radius", 0.005}, {"height", 0.06}}, "light");
    call("object.create",
         {{"name", "joint"}, {"parts", List{Map{{"what", "plate"}}, Map{{"what", "pin"}}}}});
  }
  /// object_T_pin.
  std::array<double, 16> pin() {
    const Value parts = at(call("object.describe", {{"id", "joint"}}), "parts");
    const Value placement = at((*parts.as_list())[1], "placement");
    const auto p = array(placement, "position"), o = array(placement, "rpy");
    const Pose t{spatial::from_rpy({o[0], o[1], o[2]}), {p[0], p[1], p[2]}};
    std::array<double, 16> out{};
    for (std::size_t i = 0; i < 3; ++i) {
      std::copy_n(t.R.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                  out.begin() + static_cast<std::ptrdiff_t>(4 * i));
      out[4 * i + 3] = t.p[i];
    }
    return out;
  }
};

Map place(std::initializer_list<std::pair<std::string, Value>> fields) {
  Map m{{"id", "joint"}, {"part", "pin"}};
  for (const auto& [k, v] : fields) m.set(k, v);
  return m;
}

TEST_F(Bodies, MassInAnotherFrameIsThatOfTheParallelAxisTheorem) {
  const double x = 0.2, y = 0.1, z = 0.04, m = 8000 * x * y * z;
  solid("block", Map{{"kind", "box"}, {"x", x}, {"y", y}, {"z", z}});
  const Value own = call("solid.mass", {{"id", "block"}});
  EXPECT_NEAR(number(own, "mass"), m, 1e-12);
  EXPECT_NEAR(array(own, "com")[2], z / 2, 1e-15);
  EXPECT_NEAR(array(own, "radii_of_gyration")[0], std::sqrt((y * y + z * z) / 12), 1e-12);
  // Principal moments ascend: the smallest is about the longest edge.
  EXPECT_NEAR(array(own, "principal_radii")[2], std::sqrt((x * x + y * y) / 12), 1e-12);
  EXPECT_EQ(at(own, "exact").as_bool() && *at(own, "exact").as_bool(), true);
  // A frame at (1, 0, 0) turned by 90 degrees about z: its x is the block's y.
  const Value there =
      call("solid.mass",
           {{"id", "block"},
            {"about", Map{{"position", list({1, 0, 0})}, {"rpy", list({0, 0, kHalfTurn / 2})}}}});
  EXPECT_NEAR(array(there, "com")[0], 0, 1e-12);
  EXPECT_NEAR(array(there, "com")[1], 1, 1e-12);
  EXPECT_NEAR(array(there, "inertia")[0], m * (x * x + z * z) / 12, 1e-12);
  EXPECT_NEAR(array(there, "inertia_origin")[0], m * ((x * x + z * z) / 12 + 1 + z * z / 4), 1e-10);
  EXPECT_NEAR(array(there, "inertia_origin")[5], -m * 1 * z / 2, 1e-10);  // Iyz
}

TEST_F(Bodies, TheMassTableCountsSharedVolumeForThePartListedFirst) {
  // Two cubes of 0.1 m that share a slab of 0.02 m.
  solid("cube", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}});
  call("object.create", {{"name", "pair"},
                         {"parts", List{Map{{"what", "cube"}, {"name", "a"}},
                                        Map{{"what", "cube"},
                                            {"name", "b"},
                                            {"material", "light"},
                                            {"position", list({0.08, 0, 0})}}}}});
  const auto row = [&](std::size_t i) {
    return (*call("object.mass_table", {{"id", "pair"}}).as_list())[i];
  };
  EXPECT_NEAR(number(row(0), "mass"), 8, 1e-9);
  EXPECT_NEAR(number(row(1), "volume"), 0.1 * 0.1 * 0.08, 1e-12);
  EXPECT_NEAR(number(row(1), "mass"), 0.8, 1e-9);
  EXPECT_NEAR(array(row(1), "com")[0], 0.09, 1e-9);
  EXPECT_EQ(*at(row(1), "material").as_string(), "light");
  call("object.move_part", {{"id", "pair"}, {"part", "b"}, {"to", 1}});
  EXPECT_EQ(*at(row(0), "part").as_string(), "b");
  EXPECT_NEAR(number(row(0), "mass"), 1, 1e-9);
  EXPECT_NEAR(number(row(1), "mass"), 8 * 0.8, 1e-9);
  EXPECT_NEAR(number(call("object.mass", {{"id", "pair"}}), "mass"), 1 + 6.4, 1e-9);
  EXPECT_NE(
      fails("object.move_part", {{"id", "pair"}, {"part", "b"}, {"to", 3}}).find("no place 3"),
      std::string::npos);
}

TEST_F(Bodies, AMaterialWithoutDensityTakesNoVolumeFromOthers) {
  call("material.create", {{"name", "look"}, {"density", 0}});
  solid("cube", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}});
  call("object.create",
       {{"name", "pair"},
        {"parts", List{Map{{"what", "cube"}, {"name", "ghost"}, {"material", "look"}},
                       Map{{"what", "cube"}, {"name", "real"}}}}});
  EXPECT_NEAR(number(call("object.mass", {{"id", "pair"}}), "mass"), 8, 1e-9);
}

TEST_F(Bodies, AMeasuredMassCountsAndTheComputedOneStaysKnown) {
  solid("block", Map{{"kind", "box"}, {"x", 0.2}, {"y", 0.1}, {"z", 0.05}});
  const double m = 8, ixx = m * (0.01 + 0.0025) / 12;
  call("solid.set_measured", {{"id", "block"}, {"mass", 10}, {"source", "scales"}});
  const Value both = call("solid.mass", {{"id", "block"}});
  EXPECT_EQ(number(both, "mass"), 10);
  EXPECT_NEAR(array(both, "inertia")[0], ixx * 10 / 8, 1e-12) << "in proportion to the mass";
  EXPECT_NEAR(number(at(both, "computed"), "mass"), m, 1e-12);
  EXPECT_EQ(*at(at(both, "measured"), "source").as_string(), "scales");
  call("solid.set_measured", {{"id", "block"},
                              {"mass", 9},
                              {"com", list({0.01, 0, 0.02})},
                              {"inertia", list({2, 2.5, 3, 0.1, 0.2, 0.3})}});
  const Value given = call("solid.mass", {{"id", "block"}});
  EXPECT_EQ(array(given, "com")[0], 0.01);
  EXPECT_EQ(array(given, "inertia"),
            (std::vector<double>{2, 0.1, 0.3, 0.1, 2.5, 0.2, 0.3, 0.2, 3}));
  call("solid.clear_measured", {{"id", "block"}});
  EXPECT_NEAR(number(call("solid.mass", {{"id", "block"}}), "mass"), m, 1e-12);
  EXPECT_NE(fails("solid.set_measured", {{"id", "block"}, {"mass", 1}, {"inertia", list({1, 2})}})
                .find("inertia: {1, 2} is not "),
            std::string::npos);
  const auto refused = [&](const Value& inertia) {
    return fails("solid.set_measured", {{"id", "block"}, {"mass", 1}, {"inertia", inertia}});
  };
  EXPECT_EQ(refused(list({1, 1, 2.5, 0, 0, 0})),
            "solid \"block\": the measured inertia has the principal moments 1, 1 and 2.5 kg m^2, "
            "which are impossible for a body. None may be greater than the sum of the other two.");
  EXPECT_NE(refused(list({1, 1, 1, 2, 0, 0})).find("the principal moments -1, 1 and 3 kg m^2"),
            std::string::npos);
  // A thin plate, rounded to three digits.
  call("solid.set_measured",
       {{"id", "block"}, {"mass", 1}, {"inertia", list({0.0833, 0.0834, 0.1668, 0, 0, 0})}});
}

TEST_F(Bodies, AnExportIsAsFineAsItIsAskedFor) {
  solid("ball", Map{{"kind", "sphere"}, {"radius", 0.05}});
  const std::string stl = (std::filesystem::path(testing::TempDir()) / "bodies_ball.stl").string();
  const auto triangles = [&](double chord) {
    return number(call("solid.export", {{"id", "ball"}, {"file", stl}, {"chord", chord}}),
                  "triangles");
  };
  // Of a sphere in steps of 2 acos(1 - chord / 2 R), with a row of half as many at the poles.
  for (const double chord : {1e-4, 1e-5}) {
    const double step = 2 * std::acos(1 - chord / (2 * 0.05));
    EXPECT_NEAR(triangles(chord) * step * step / (4 * std::numbers::pi * std::numbers::pi), 1, 0.2);
  }
  EXPECT_NE(fails("solid.export", {{"id", "ball"}, {"file", "ball.step"}, {"chord", 1e-3}})
                .find(".step files hold exact surfaces"),
            std::string::npos);
  std::filesystem::remove(stl);
}

TEST_F(Bodies, ALinksTenParametersAreThoseOfItsPartsInItsFrame) {
  // A block 0.2 x 0.1 x 0.05 whose base centre is at (0.1, 0, 0), turned by 90 degrees about x: its
  // centre of mass is at (0.1, -0.025, 0).
  solid("block", Map{{"kind", "box"}, {"x", 0.2}, {"y", 0.1}, {"z", 0.05}});
  call("robot.create",
       {{"name", "arm"},
        {"mass_source", "designed"},
        {"links", List{Map{{"a", 0.3},
                           {"parts", List{Map{{"what", "block"},
                                              {"position", list({0.1, 0, 0})},
                                              {"rpy", list({kHalfTurn / 2, 0, 0})}}}}}}}});
  const Value link = call("robot.link_mass", {{"id", "arm"}, {"link", 1}});
  EXPECT_EQ(*at(link, "source").as_string(), "designed");
  const double m = 8, cx = 0.1, cy = -0.025;
  const double ix = m * (0.1 * 0.1 + 0.05 * 0.05) / 12, iy = m * (0.2 * 0.2 + 0.1 * 0.1) / 12,
               iz = m * (0.2 * 0.2 + 0.05 * 0.05) / 12;  // after the turn
  const std::vector<double> expected{m,
                                     m * cx,
                                     m * cy,
                                     0,
                                     ix + m * cy * cy,
                                     iy + m * cx * cx,
                                     iz + m * (cx * cx + cy * cy),
                                     -m * cx * cy,
                                     0,
                                     0};
  const auto p = array(link, "parameters");
  ASSERT_EQ(p.size(), 10U);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_NEAR(p[i], expected[i], 1e-12) << i;
  // The same numbers from the definition: sums over a fine grid of points of the turned block.
  const int n = 24;
  std::array<double, 10> sums{};
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) {
        const double u = 0.2 * ((i + 0.5) / n - 0.5), v = 0.1 * ((j + 0.5) / n - 0.5),
                     w = 0.05 * (k + 0.5) / n, dm = m / (n * n * n);
        const double x = 0.1 + u, y = -w, z = v;  // Rx(90 deg): (u, v, w) -> (u, -w, v)
        const double terms[] = {
            1, x, y, z, y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -y * z, -x * z};
        for (std::size_t t = 0; t < 10; ++t) sums[t] += dm * terms[t];
      }
  for (std::size_t i = 0; i < 10; ++i) EXPECT_NEAR(p[i], sums[i], 2e-4) << i;
}

TEST_F(Bodies, FacesLieFlushWithOffsetAngleAndFlip) {
  plate_and_pin();
  const auto steps = app().document.undo_labels().size();
  call("object.place",
       place({{"feature", "bottom"}, {"on", "plate"}, {"on_feature", "top"}, {"offset", "3 mm"}}));
  EXPECT_EQ(app().document.undo_labels().size(), steps + 1);
  auto t = pin();
  // The plate's top without its bore has its centroid off the middle, towards -x.
  const double hole = kHalfTurn * 25e-6, centroid = -hole * 0.06 / (0.02 - hole);
  EXPECT_NEAR(t[3], centroid, 1e-9);
  EXPECT_NEAR(t[11], 0.023, 1e-12);
  EXPECT_NEAR(t[10], 1, 1e-12) << "it needs no turn";
  call("object.place",
       place({{"feature", "bottom"}, {"on", "plate"}, {"on_feature", "top"}, {"flip", true}}));
  t = pin();
  EXPECT_NEAR(t[10], -1, 1e-12) << "both look up: the pin hangs through the plate";
  EXPECT_NEAR(t[11], 0.02, 1e-12);
  // Onto a side, without centring: it stays where it was along the face.
  call("object.set", {{"id", "joint"},
                      {"path", "pin.placement"},
                      {"value", Map{{"position", list({0.3, 0.01, 0.007})}}}});
  call("object.place",
       place({{"feature", "bottom"}, {"on", "plate"}, {"on_feature", "right"}, {"centre", false}}));
  t = pin();
  EXPECT_NEAR(t[3], 0.1, 1e-12);
  EXPECT_NEAR(t[7], 0.01, 1e-12);
  EXPECT_NEAR(t[11], 0.007, 1e-12);
  EXPECT_NEAR(t[2], 1, 1e-12) << "the pin's z runs along x";
}

TEST_F(Bodies, AxesComeTogetherInTheHole) {
  plate_and_pin();
  call("object.place", place({{"mate", "axis"},
                              {"feature", "shaft"},
                              {"on", "plate"},
                              {"on_feature", "hole radius 5 mm"},
                              {"offset", 0.01},
                              {"angle", kHalfTurn / 2}}));
  auto t = pin();
  EXPECT_NEAR(t[3], 0.06, 1e-12);
  EXPECT_NEAR(t[7], 0, 1e-12);
  EXPECT_NEAR(t[11], 0.01 + 0.01 - 0.03, 1e-12) << "middle on middle of the bore, then 10 mm up";
  EXPECT_NEAR(std::fabs(t[4]), 1, 1e-12) << "x runs along y after a quarter turn";
  call("object.place", place({{"mate", "axis"},
                              {"feature", "shaft"},
                              {"on", "plate"},
                              {"on_feature", "hole"},
                              {"flip", true}}));
  t = pin();
  EXPECT_NEAR(t[10], -1, 1e-12);
  EXPECT_NEAR(t[11], 0.01 + 0.03, 1e-12);
  // To the object's own frame.
  call("object.place", place({{"mate", "axis"}, {"feature", "shaft"}, {"on_feature", "y axis"}}));
  t = pin();
  EXPECT_NEAR(std::fabs(t[6]), 1, 1e-12);
  EXPECT_NEAR(t[3], 0, 1e-12);
}

TEST_F(Bodies, PointsMeetAndThePartDoesNotTurn) {
  plate_and_pin();
  call("object.place", place({{"mate", "point"},
                              {"feature", "origin"},
                              {"on", "plate"},
                              {"on_feature", "corner near (1, 1, 1)"}}));
  const auto t = pin();
  EXPECT_NEAR(t[3], 0.1, 1e-12);
  EXPECT_NEAR(t[7], 0.05, 1e-12);
  EXPECT_NEAR(t[11], 0.02, 1e-12);
  EXPECT_EQ(t[0], 1);
}

TEST_F(Bodies, SelectorsThatMeanNothingOrTooMuchAreToldSo) {
  plate_and_pin();
  const auto sentence = [&](const char* feature, const char* on) {
    return fails("object.place",
                 place({{"feature", feature}, {"on", "plate"}, {"on_feature", on}}));
  };
  EXPECT_NE(sentence("bottom", "plane").find("\"plane\" fits 6 features of part \"plate\""),
            std::string::npos)
      << sentence("bottom", "plane");
  EXPECT_NE(sentence("torus", "top").find("fits no feature of part \"pin\""), std::string::npos);
  EXPECT_NE(sentence("upside", "top").find("\"upside\" does not fit a selector"),
            std::string::npos);
  EXPECT_NE(fails("object.place", place({{"feature", 99}, {"on", "plate"}, {"on_feature", "top"}}))
                .find("so there is no 99"),
            std::string::npos);
  EXPECT_NE(fails("object.place", place({{"feature", "top"}, {"on", "pin"}, {"on_feature", "top"}}))
                .find("cannot be placed on itself"),
            std::string::npos);
  EXPECT_NE(fails("object.place", place({{"mate", "point"},
                                         {"feature", "origin"},
                                         {"offset", 1},
                                         {"on_feature", "origin"}}))
                .find("no offset"),
            std::string::npos);
}

TEST_F(Bodies, FeaturesTellTheHole) {
  plate_and_pin();
  int holes = 0, planes = 0;
  const Value all = call("object.features", {{"id", "joint"}, {"part", "plate"}});
  for (const Value& f : *all.as_list()) {
    const std::string kind = *at(f, "kind").as_string();
    planes += kind == "plane";
    if (kind != "cylinder") continue;
    ++holes;
    EXPECT_NEAR(number(f, "radius"), 0.005, 1e-12);
    EXPECT_NEAR(array(f, "point")[0], 0.06, 1e-12);
    EXPECT_NEAR(number(f, "size"), 2 * kHalfTurn * 0.005 * 0.02, 1e-12);
    EXPECT_TRUE(*at(f, "inward").as_bool());
  }
  EXPECT_EQ(holes, 1);
  EXPECT_EQ(planes, 6);
}

TEST_F(Bodies, CopiesOfAPartShareWhatItIsAndStandInRowsAndRings) {
  plate_and_pin();
  call("object.set", {{"id", "joint"}, {"path", "pin.position.x"}, {"value", 0.04}});
  const Value names =
      call("object.duplicate_part",
           {{"id", "joint"}, {"part", "pin"}, {"count", 3}, {"turn", kHalfTurn / 2}});
  ASSERT_EQ(names.as_list()->size(), 3U);
  const Value parts = at(call("object.describe", {{"id", "joint"}}), "parts");
  ASSERT_EQ(parts.as_list()->size(), 5U);
  const Value last = at((*parts.as_list())[4], "placement");
  EXPECT_NEAR(array(last, "position")[0], 0, 1e-12);
  EXPECT_NEAR(array(last, "position")[1], -0.04, 1e-12);
  EXPECT_EQ(app().document.now()->list(Kind::solid).size(), 2U);
}

TEST_F(Bodies, LooksOfMaterialsAreKeptAndTakenAway) {
  call("material.create", {{"name", "lamp"},
                           {"density", 1200},
                           {"colour", "#ff8000"},
                           {"opacity", 0.5},
                           {"ambient", list({0.1, 0.2, 0.3})},
                           {"specular", "#ffffff"},
                           {"emission", list({0.5, 0.25, 0})}});
  const Value lamp = call("material.describe", {{"id", "lamp"}});
  EXPECT_EQ(number(lamp, "opacity"), 0.5);
  EXPECT_NEAR(array(lamp, "ambient")[1], 0.2, 1e-7);
  EXPECT_NEAR(array(lamp, "emission")[1], 0.25, 1e-7);
  const std::string text = *call("material.text", {{"id", "lamp"}}).as_string();
  EXPECT_NE(text.find("ambient (0.1, 0.2, 0.3)\nspecular (1, 1, 1)\nemission (0.5, 0.25, 0)"),
            std::string::npos)
      << text;
  call("material.set", {{"id", "lamp"}, {"ambient", ""}, {"colour", "#00ff00"}});
  const Value now = call("material.describe", {{"id", "lamp"}});
  EXPECT_EQ(now.as_map()->find("ambient"), nullptr);
  EXPECT_EQ(number(now, "opacity"), 0.5) << "a colour without a fourth part keeps the opacity";
  EXPECT_NE(fails("material.set", {{"id", "lamp"}, {"opacity", 1.5}}), "");
  EXPECT_NE(fails("material.set", {{"id", "lamp"}, {"emission", "bright"}}).find("emission"),
            std::string::npos);
}

}  // namespace
}  // namespace robomosp::ioci
