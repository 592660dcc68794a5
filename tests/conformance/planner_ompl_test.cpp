// SPDX-License-Identifier: Apache-2.0
// The planners of OMPL against the SDK's suite.
#include <robomosp/sdk/conformance/planner_suite.h>

namespace robomosp::conformance {

INSTANTIATE_TEST_SUITE_P(
    Ompl, PlannerConformance,
    testing::Values(
        PlannerCase{std::string(ROBOMOSP_PLUGIN_DIR) + "/planner_ompl.so", "rrt_connect"},
        PlannerCase{std::string(ROBOMOSP_PLUGIN_DIR) + "/planner_ompl.so", "prm"},
        PlannerCase{std::string(ROBOMOSP_PLUGIN_DIR) + "/planner_ompl.so", "bit_star", 1.05}));

}  // namespace robomosp::conformance
