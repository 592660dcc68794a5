// SPDX-License-Identifier: Apache-2.0
// The gear's own geometry. What every primitive has to keep is checked by the SDK's conformance
// suite (CONFORMANCE primitive in CMakeLists.txt).
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/csg_primitive.h>

namespace {

using namespace robomosp;
using namespace robomosp::conformance;
constexpr double kPi = std::numbers::pi;

Result<CsgTree> gear(const std::vector<std::pair<std::string, double>>& values) {
  RMP_TRY_ASSIGN(const rmp_provider* provider,
                 find_provider<CsgPrimitive>(ROBOMOSP_PLUGIN_FILE, "involute_gear"));
  TableParams params(*provider);
  for (const auto& [name, value] : values) params.set(name, value);
  NoProgress progress;
  return create<CsgPrimitive>(*provider)->build(params, progress);
}

/// Every point that the outline names: ends, middles of arcs, points of splines.
std::vector<std::array<double, 2>> points(const CsgTree& tree) {
  const CsgLoop& outer = tree.nodes.at(0).profile->loops.at(0);
  std::vector<std::array<double, 2>> all{outer.start};
  for (const CsgCurve& c : outer.curves) all.insert(all.end(), c.points.begin(), c.points.end());
  return all;
}

TEST(InvoluteGear, ReachesFromRootToTipCircle) {
  const auto tree = gear({{"teeth", 24}, {"module", 0.003}});
  ASSERT_TRUE(tree.ok()) << tree.error().sentence();
  double low = 1, high = 0;
  for (const auto& p : points(*tree)) {
    low = std::min(low, std::hypot(p[0], p[1]));
    high = std::max(high, std::hypot(p[0], p[1]));
  }
  EXPECT_NEAR(low, 0.036 - 1.25 * 0.003, 1e-12);
  EXPECT_NEAR(high, 0.036 + 0.003, 1e-12);
}

// A thread unwound from the base circle draws the involute: from every point of the flank, the
// tangent to the base circle is as long as the arc from where the involute began. The tooth's
// thickness at the pitch circle is m (pi / 2 + 2 x tan a) (DIN 3960).
TEST(InvoluteGear, FlanksAreInvolutesWithTheRightTooth) {
  const double m = 0.002, alpha = 20 * kPi / 180, x = 0.3;
  const int z = 17;
  const auto tree = gear({{"teeth", z}, {"module", m}, {"shift", x}, {"bore", 0.008}});
  ASSERT_TRUE(tree.ok()) << tree.error().sentence();
  const double base = m * z / 2 * std::cos(alpha);
  int checked = 0;
  double start = 0;
  for (const CsgCurve& c : tree->nodes[0].profile->loops[0].curves) {
    if (c.kind != CsgCurve::Kind::spline || checked > 20) continue;
    for (const auto& p : c.points) {
      const double r = std::hypot(p[0], p[1]);
      if (p[1] > 0 || r < base * (1 + 1e-9)) continue;  // right flank of the first tooth only
      const double tangent = std::sqrt(r * r - base * base);
      const double foot = std::atan2(p[1], p[0]) + std::acos(base / r);  // where it touches
      const double began = foot - tangent / base;
      if (checked++ == 0) start = began;
      EXPECT_NEAR(began, start, 1e-12);
    }
    if (checked) break;
  }
  EXPECT_GE(checked, 10);
  const double tooth = m * (kPi / 2 + 2 * x * std::tan(alpha));  // thickness at the pitch circle
  EXPECT_NEAR(-start, tooth / (m * z) + std::tan(alpha) - alpha, 1e-12);
}

TEST(InvoluteGear, RefusesWhatMakesNoGear) {
  const auto pointed = gear({{"teeth", 8}, {"shift", 1}});
  ASSERT_FALSE(pointed.ok());
  EXPECT_NE(pointed.error().message.find("shift"), std::string::npos);
  const auto hollow = gear({{"teeth", 20}, {"bore", 0.036}});
  ASSERT_FALSE(hollow.ok());
  EXPECT_NE(hollow.error().message.find("bore"), std::string::npos);
}

}  // namespace
