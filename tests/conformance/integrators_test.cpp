// SPDX-License-Identifier: Apache-2.0
// Providers "dormand_prince", "runge_kutta4" and "symplectic": the SDK's suite.
#include <robomosp/sdk/conformance/integrator_suite.h>

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/integrators.so";

INSTANTIATE_TEST_SUITE_P(
    Plugin, IntegratorConformance,
    testing::Values(
        IntegratorCase{kFile, "dormand_prince", 5, {}, true, "max_step", false},
        IntegratorCase{kFile, "dormand_prince", 5, {{"norm", "max"}}, true, "max_step", false},
        IntegratorCase{kFile, "runge_kutta4", 4, {}, false, "", false},
        IntegratorCase{kFile, "symplectic", 2, {{"method", "verlet"}}, false, "", true},
        IntegratorCase{kFile, "symplectic", 4, {{"method", "yoshida4"}}, false, "", true},
        IntegratorCase{kFile, "symplectic", 1, {{"method", "euler"}}, false, "", true}),
    integrator_case_name);

}  // namespace
}  // namespace robomosp::conformance
