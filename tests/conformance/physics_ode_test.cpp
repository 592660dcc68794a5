// SPDX-License-Identifier: Apache-2.0
// Provider "ode": the SDK's suite with all ways to solve contacts.
#include <robomosp/sdk/conformance/physics_suite.h>

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/physics_ode.so";

INSTANTIATE_TEST_SUITE_P(
    Ode, PhysicsConformance,
    testing::Values(PhysicsCase{kFile, "ode", {}, "exact"},
                    PhysicsCase{kFile, "ode", {{"piles_from", "0"}}, "piles"},
                    PhysicsCase{kFile, "ode", {{"piles_from", "1000000"}}, "engine"},
                    PhysicsCase{kFile, "ode", {{"solver", "sweeps"}, {"sweeps", "200"}}, "sweeps"}),
    physics_case_name);

}  // namespace
}  // namespace robomosp::conformance
