// SPDX-License-Identifier: Apache-2.0
// The shortcut of csg_occt for prisms along one direction, against the general way.
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/csg_suite.h>

#include "support/plugin_door.h"

namespace robomosp::conformance {
namespace {

constexpr double kPi = std::numbers::pi;
// What the general way computes of crossing curves is exact to OCCT's tolerance only.
constexpr double kAgreement = 1e-10;

/// The engine with the shortcut "on", "off", or "only", which refuses what it does not apply to.
std::unique_ptr<CsgEngine> engine(const char* shortcut) {
  ::setenv("ROBOMOSP_CSG_PRISMATIC", shortcut, 1);
  auto made = test::make_provider<CsgEngine>(ROBOMOSP_PLUGIN_DIR "/csg_occt.so", "occt");
  ::unsetenv("ROBOMOSP_CSG_PRISMATIC");
  return made;
}

class Prismatic : public ::testing::Test {
 protected:
  static Result<std::shared_ptr<const CsgShape>> evaluate(const CsgEngine& e, const Csg& c) {
    NoProgress progress;
    return e.evaluate(c.tree(), progress);
  }
  static Moments moments(const CsgEngine& e, const CsgShape& s) {
    NoProgress progress;
    return e.moments(s, progress).value();
  }

  // Moments, bounds, pieces and a closed mesh, the same both ways. False when the general way
  // fails.
  bool agree(const Csg& c, const CsgShape& quick) {
    const auto general = evaluate(*off_, c);
    if (!general) return false;
    const Moments want = moments(*off_, **general), got = moments(*only_, quick);
    expect_moments(got, want, kAgreement, "moments");
    EXPECT_NEAR(got.area, want.area, kAgreement * want.area);
    EXPECT_TRUE(got.exact);
    for (std::size_t side = 0; side < 2; ++side)
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(quick.bounds()[side][k], (*general)->bounds()[side][k], 1e-9);
    expect_mesh(quick, want);
    return true;
  }
  void expect_mesh(const CsgShape& shape, const Moments& want) {
    NoProgress progress;
    const auto mesh = only_->mesh(shape, {1e-4, 0.3}, progress);
    ASSERT_TRUE(mesh.ok()) << mesh.error().sentence();
    const MeshFacts f = facts(*mesh);
    EXPECT_EQ(f.unbalanced_sides, 0U);
    EXPECT_EQ(f.degenerate, 0U);
    EXPECT_EQ(f.inward_normals, 0U);
    EXPECT_NEAR(f.volume, want.volume, want.area * 1e-4);
  }

  // The shortcut is taken, and right.
  void expect_quick(const Csg& c, const char* what) {
    SCOPED_TRACE(what);
    const auto quick = evaluate(*only_, c);
    ASSERT_TRUE(quick.ok()) << quick.error().sentence();
    EXPECT_TRUE(agree(c, **quick));
  }
  // The shortcut is left to the general way, with its outcome.
  void expect_general(const Csg& c, const char* what) {
    SCOPED_TRACE(what);
    const auto refused = evaluate(*only_, c);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::unsupported) << refused.error().sentence();
    const auto with = evaluate(*on_, c), without = evaluate(*off_, c);
    ASSERT_EQ(with.ok(), without.ok());
    if (!with) {
      EXPECT_EQ(with.error().sentence(), without.error().sentence());
      return;
    }
    expect_moments(moments(*on_, **with), moments(*off_, **without), 1e-12, "moments");
  }

  std::unique_ptr<CsgEngine> on_ = engine("on"), off_ = engine("off"), only_ = engine("only");
};

Csg link() {
  std::vector<Csg> parts{unite({cylinder(0.060, 0.080), cylinder(0.045, 0.080).at(0.300, 0, 0),
                                box(0.300, 0.060, 0.050).at(0.150, 0, 0.015)}),
                         cylinder(0.025, 0.100).at(0, 0, -0.010),
                         cylinder(0.018, 0.100).at(0.300, 0, -0.010)};
  for (int k = 0; k < 6; ++k) {
    const double t = k * kPi / 3;
    parts.push_back(cylinder(0.004, 0.030).at(0.045 * std::cos(t), 0.045 * std::sin(t), 0.060));
    parts.push_back(
        cylinder(0.004, 0.030).at(0.300 + 0.032 * std::cos(t), 0.032 * std::sin(t), 0.060));
  }
  return subtract(std::move(parts));
}

TEST_F(Prismatic, PlainPartsTakeTheShortcut) {
  const Csg plate = box(0.1, 0.08, 0.02);
  expect_quick(subtract({plate, cylinder(0.01, 0.1).at(0, 0, -0.01)}), "a hole");
  expect_quick(subtract({plate, cylinder(0.01, 0.015).at(0, 0, 0.01)}), "a blind hole");
  expect_quick(subtract({plate, cylinder(0.01, 0.01).at(0.01, 0, 0.005)}), "a closed bubble");
  expect_quick(subtract({plate, cylinder(0.03, 0.1).at(0.05, 0.01, -0.01)}), "over the border");
  expect_quick(subtract({plate, cylinder(0.02, 0.1).at(0, 0, -0.01),
                         cylinder(0.02, 0.1).at(0.015, 0, -0.01)}),
               "holes that cross");
  expect_quick(subtract({cylinder(0.05, 0.1), cylinder(0.04, 0.1)}), "a tube with flush ends");
  expect_quick(unite({subtract({cylinder(0.05, 0.1), cylinder(0.04, 0.1)}), cylinder(0.02, 0.1)}),
               "nested rings");
  expect_quick(subtract({cylinder(0.05, 0.1), box(0.2, 0.02, 0.02).at(0, 0, 0.04)}),
               "a slot through a shaft");
  expect_quick(subtract({cylinder(0.05, 0.1), box(0.2, 0.02, 0.02).at(0, 0, 0.02),
                         box(0.02, 0.2, 0.02).at(0, 0, 0.06)}),
               "slots from all sides");
  expect_quick(unite({cylinder(0.05, 0.1), cylinder(0.03, 0.1).at(0, 0, 0.1)}), "a stepped shaft");
  expect_quick(unite({cylinder(0.05, 0.1), cylinder(0.05, 0.1).at(0, 0, 0.1)}), "end to end");
  expect_quick(intersect({cylinder(0.05, 0.1), box(0.06, 0.2, 0.05).at(0, 0, 0.02)}), "common");
  expect_quick(link(), "link");
  expect_quick(unite({plate, plate.at(0.1, 0, 0)}), "side by side");
  expect_quick(unite({plate, plate.at(0.05, 0.08, 0.01)}), "in part side by side");
  expect_quick(subtract({plate, box(0.1, 0.04, 0.01).at(0, 0, 0.01)}), "a flush slot");
  expect_quick(unite({box(0.1, 0.04, 0.02), cylinder(0.02, 0.02).at(0.05, 0, 0),
                      cylinder(0.02, 0.02).at(-0.05, 0, 0)}),
               "a bar with round ends");
  expect_quick(unite({subtract({plate, box(0.05, 0.04, 0.1).at(0, 0, -0.01)}),
                      box(0.02, 0.02, 0.02).at(0.1, 0, 0)}),
               "two pieces");
}

TEST_F(Prismatic, AnyDirectionWillDo) {
  for (const Pose& pose : {turned({1, 0, 0}, kPi / 2), turned({0, 1, 0}, -kPi / 2, {1, 2, 3}),
                           turned({1, 2, 3}, 0.7, {0.1, 0, 0}), turned({1, 0, 0}, kPi)}) {
    expect_quick(link().at(pose), "turned as a whole");
    expect_quick(
        unite({subtract({box(0.1, 0.1, 0.1), cylinder(0.02, 0.3).at(0.01, 0, -0.1)}).at(pose),
               cylinder(0.008, 0.3).at(pose)}),
        "turned one by one");
  }
  expect_quick(subtract({box(0.1, 0.08, 0.02),
                         cylinder(0.005, 0.2).at(turned({1, 0, 0}, kPi / 2, {0, 0.1, 0.01}))}),
               "across a plate");
}

TEST_F(Prismatic, WhatIsNotPlainIsLeftToTheGeneralWay) {
  const Csg plate = box(0.1, 0.08, 0.02);
  expect_general(subtract({plate, sphere(0.01)}), "a sphere");
  expect_general(subtract({plate, cylinder(0.01, 0.1, 0.001).at(0, 0, -0.01)}), "a rounded hole");
  expect_general(subtract({plate, cylinder(0.01, 0.2).at(turned({1, 0, 0}, 1e-6, {0, 0, -0.1}))}),
                 "a hole that leans a little");
  expect_general(unite({cylinder(0.02, 0.1), cylinder(0.02, 0.1).at(0.04, 0, 0)}), "tangent discs");
  expect_general(subtract({plate, cylinder(0.04, 0.1).at(0, 0, -0.01)}), "a hole as wide");
  expect_general(subtract({plate, cylinder(0.01, 0.1).at(0.03 - 1e-9, 0, -0.01),
                           cylinder(0.01, 0.1).at(0.01, 0, -0.01)}),
                 "holes that touch");
  expect_general(unite({plate, plate.at(0.1, 0.08, 0)}), "along an edge");
  expect_general(unite({plate, plate.at(0, 0, 0.02 + 1e-9)}), "a gap of 1e-6 mm");
  expect_general(subtract({plate, cylinder(0.01, 0.1).at(0.04 - 1e-9, 0, -0.01)}),
                 "a wall of 1e-6 mm");
  expect_general(subtract({plate, plate}), "nothing left");
  expect_general(intersect({plate, plate.at(1, 0, 0)}), "nothing common");
  expect_general(subtract({plate, intersect({cylinder(0.01, 1), cylinder(0.01, 1).at(1, 0, 0)})}),
                 "a tool that is empty");
}

TEST_F(Prismatic, IdleToolsAreToldAsTheGeneralWayDoes) {
  const Csg c = subtract({box(0.1, 0.1, 0.1), cylinder(0.01, 1).at(0, 0, -0.1).named("bore"),
                          cylinder(0.01, 1).at(5, 0, 0).named("far")});
  const auto quick = evaluate(*only_, c), general = evaluate(*off_, c);
  ASSERT_TRUE(quick.ok() && general.ok());
  ASSERT_EQ((*quick)->notes().size(), 1U);
  EXPECT_EQ((*quick)->notes()[0], "node 3 (\"far\"): cuts nothing: it does not reach the solid.");
  EXPECT_EQ((*general)->notes()[0], (*quick)->notes()[0]);
}

// What the shortcut makes is an operand like any other.
TEST_F(Prismatic, LaterOperationsTakeWhatTheShortcutMade) {
  const std::vector<Csg> tools{
      sphere(0.05).at(0.06, 0.01, 0.06), sphere(0.03).at(0.31, 0.02, 0.075),
      cylinder(0.011, 0.6).at(turned({0, 1, 0}, kPi / 2, {-0.1, 0.003, 0.041})),
      cone(0.05, 0.01, 0.1).at(0.02, 0.04, 0.03)};
  for (const Csg& tool : tools)
    for (const auto& combine : {unite, subtract, intersect}) {
      const Csg c = combine({link(), tool});
      const auto quick = evaluate(*on_, c), general = evaluate(*off_, c);
      ASSERT_TRUE(quick.ok()) << quick.error().sentence();
      ASSERT_TRUE(general.ok()) << general.error().sentence();
      expect_moments(moments(*on_, **quick), moments(*off_, **general), 1e-8, "moments");
    }
}

// Here OCCT loses the curve in which a sphere enters a part with holes, without a word.
TEST_F(Prismatic, IntersectionsThatTheKernelLosesAreNeverSilentlyWrong) {
  const Csg ball = sphere(0.03).at(0.3, 0, 0.08);
  const double V = moments(*on_, *evaluate(*on_, link()).value()).volume,
               W = 4 * kPi / 3 * std::pow(0.03, 3);
  const auto volume = [&](const CsgEngine& e, const Csg& c) {
    const auto shape = evaluate(e, c);
    if (!shape) {
      EXPECT_EQ(shape.error().code, ErrorCode::plugin_failed) << shape.error().sentence();
      return -1.0;
    }
    return moments(e, **shape).volume;
  };
  double common = -1;
  for (const double v :
       {volume(*on_, intersect({link(), ball})), V + W - volume(*on_, unite({link(), ball})),
        V - volume(*off_, subtract({link(), ball}))}) {
    if (v < 0 || v > V) continue;  // refused
    if (common < 0) common = v;
    EXPECT_NEAR(v, common, 1e-8 * V);
  }
  if (common < 0) return;  // all refused
  EXPECT_GT(common, 0.1 * W);
  EXPECT_LT(common, 0.5 * W);
}

// Positions on a grid make borders coincide, touch and cross in corners far more often than free
// ones. Whatever the shortcut takes must be what the general way makes.
TEST_F(Prismatic, RandomPartsAgreeWithTheGeneralWay) {
  const char* count_text = std::getenv("ROBOMOSP_CSG_PARTS");
  const char* seed_text = std::getenv("ROBOMOSP_SEED");
  const int count = count_text ? std::atoi(count_text) : 200;
  const unsigned seed = seed_text ? static_cast<unsigned>(std::atoi(seed_text)) : 1U;
  RecordProperty("seed", static_cast<int>(seed));
  int quick_count = 0, failed = 0;
  for (int i = 0; i < count; ++i) {
    std::mt19937 random(seed + 1'000'003U * static_cast<unsigned>(i));
    const bool on_grid = i % 2 == 0;
    const auto length = [&](int low, int high) {
      return on_grid ? 0.005 * std::uniform_int_distribution<int>(low, high)(random)
                     : 0.005 * std::uniform_real_distribution<double>(low, high)(random);
    };
    const auto any = [&]() -> Csg {
      const Csg c = std::uniform_int_distribution<int>(0, 1)(random) == 0
                        ? cylinder(length(1, 6), length(2, 8))
                        : box(length(2, 12), length(2, 12), length(2, 8));
      Csg placed = c.at(length(-8, 8), length(-8, 8), length(-4, 4));
      if (i % 4 == 1) placed.node.placement.R = turned({0, 0, 1}, length(0, 200)).R;
      return placed;
    };
    const auto several = [&](int low, int high) {
      std::vector<Csg> parts;
      for (int n = std::uniform_int_distribution<int>(low, high)(random); n > 0; --n)
        parts.push_back(any());
      return parts;
    };
    std::vector<Csg> parts{unite(several(1, 4))};
    for (Csg& tool : several(1, 4)) parts.push_back(std::move(tool));
    Csg c = subtract(std::move(parts));
    if (i % 3 == 0) c = unite({c, any()});
    if (i % 5 == 0) c = intersect({c, box(0.06, 0.06, 0.03)});
    SCOPED_TRACE("part " + std::to_string(i) + ", seed " + std::to_string(seed));
    const auto quick = evaluate(*only_, c);
    if (!quick) {
      ASSERT_EQ(quick.error().code, ErrorCode::unsupported) << quick.error().sentence();
      continue;
    }
    ++quick_count;
    if (!agree(c, **quick)) ++failed;
  }
  RecordProperty("quick", quick_count);
  RecordProperty("general way failed", failed);
  EXPECT_GT(quick_count, count / 2);
  EXPECT_LE(failed, count / 50);
}

/// Says that it is cancelled from the `last`-th time on that it is asked.
class Asked final : public Progress {
 public:
  explicit Asked(int last) : last_(last) {}
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return ++count >= last_; }
  mutable int count = 0;

 private:
  int last_;
};

TEST_F(Prismatic, ManyBoxesInOnePlaceAreCancelledOrRefused) {
  std::vector<Csg> boxes;
  for (int i = 0; i < 1500; ++i)
    boxes.push_back(box(0.1 + i * 1e-6, 0.1 + (i * 7919 % 1500) * 1e-6, 0.1).at(i * 1e-7, 0, 0));
  const Csg all = unite(std::move(boxes));
  for (const int last : {1, 100, 1600, 4000, 7600}) {
    for (const CsgEngine* e : {only_.get(), off_.get()}) {
      Asked progress(last);
      const auto made = e->evaluate(all.tree(), progress);
      ASSERT_FALSE(made.ok());
      if (progress.count < last) continue;  // it was refused before
      EXPECT_EQ(made.error().code, ErrorCode::cancelled) << made.error().sentence();
      EXPECT_LE(progress.count, last + 4) << "it goes on";
    }
  }
  const auto refused = evaluate(*off_, all);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
  EXPECT_NE(refused.error().sentence().find("of 1500 solids more than 1000000 pairs meet"),
            std::string::npos)
      << refused.error().sentence();
}

}  // namespace
}  // namespace robomosp::conformance
