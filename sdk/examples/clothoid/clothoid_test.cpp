// SPDX-License-Identifier: Apache-2.0
// The clothoid: the SDK's suite of curves, and Fresnel's integrals.
#include <robomosp/sdk/conformance/curve_suite.h>
#include <robomosp/sdk/conformance/models.h>

namespace robomosp::conformance {
namespace {

const double kPiHere = std::acos(-1.0);

INSTANTIATE_TEST_SUITE_P(
    Clothoid, CurveConformance,
    testing::Values(CurveCase{ROBOMOSP_PLUGIN_FILE,
                              "clothoid",
                              "spiral",
                              {multiply(shift(0.3, 0.1, 0.5), turn_x(0.7))},
                              {{"length", "2"}, {"start_curvature", "-1"}, {"end_curvature", "9"}}},
                    CurveCase{ROBOMOSP_PLUGIN_FILE,
                              "clothoid",
                              "arc",
                              {shift(0, 0, 0)},
                              {{"length", "1"}, {"start_curvature", "2"}, {"end_curvature", "2"}}}),
    curve_case_name);

// From rest to the curvature pi L over the length L it runs through Fresnel's integrals
// C(1) = 0.7798934, S(1) = 0.4382591 (Abramowitz and Stegun, table 7.7), times L.
TEST(Clothoid, RunsThroughFresnelsIntegrals) {
  const auto provider = find_provider<CurveFactory>(ROBOMOSP_PLUGIN_FILE, "clothoid");
  ASSERT_TRUE(provider.ok()) << provider.error().sentence();
  TableParams params(**provider);
  params.set("length", 1).set("start_curvature", 0).set("end_curvature", kPiHere);
  const std::vector<Pose> start{shift(0, 0, 0)};
  const auto made = create<CurveFactory>(**provider)->make(start, params);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const double end[] = {1};
  CurveSample s[1];
  ASSERT_TRUE((*made)->evaluate(end, s).ok());
  EXPECT_NEAR(s[0].p[0], 0.7798934, 5e-8);
  EXPECT_NEAR(s[0].p[1], 0.4382591, 5e-8);
}

}  // namespace
}  // namespace robomosp::conformance
