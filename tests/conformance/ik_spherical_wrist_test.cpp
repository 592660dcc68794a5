// SPDX-License-Identifier: Apache-2.0
// Provider "spherical_wrist": the SDK's suites on every family it knows, and what it refuses.
#include <robomosp/sdk/conformance/arms.h>
#include <robomosp/sdk/conformance/ik_closed_suite.h>

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/ik_spherical_wrist.so";
const std::string kNumeric = std::string(ROBOMOSP_PLUGIN_DIR) + "/ik_numeric.so";
const char* const kName = "spherical_wrist";

std::vector<RobotModel> arms() {
  return {puma560(), puma560_modified(), kr5(),         irb140(),
          ur5(),     skew_arm(),         meeting_arm(), parallel_first_arm()};
}
std::vector<RobotModel> free_arms() {
  std::vector<RobotModel> all;
  for (RobotModel& m : arms()) all.push_back(within_one_turn(std::move(m)));
  return all;
}

INSTANTIATE_TEST_SUITE_P(SphericalWrist, IkConformance,
                         testing::ValuesIn(ik_cases(kFile, kName, arms())), ik_case_name);
INSTANTIATE_TEST_SUITE_P(SphericalWrist, IkClosedForm,
                         testing::ValuesIn(ik_cases(kFile, kName, arms())), ik_case_name);
INSTANTIATE_TEST_SUITE_P(SphericalWristFree, IkClosedForm,
                         testing::ValuesIn(ik_cases(kFile, kName, free_arms(), kNumeric)),
                         ik_case_name);

}  // namespace
}  // namespace robomosp::conformance
