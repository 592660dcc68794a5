// SPDX-License-Identifier: Apache-2.0
// Provider "articulated_body": the SDK's suite, with the inverse dynamics of newton_euler.
#include <robomosp/sdk/conformance/dynamics_suite.h>
#include <robomosp/sdk/conformance/mechanisms.h>

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/dynamics_articulated.so";
const std::string kInverse = std::string(ROBOMOSP_PLUGIN_DIR) + "/dynamics_newton_euler.so";

INSTANTIATE_TEST_SUITE_P(
    ArticulatedBody, DynamicsConformance,
    testing::ValuesIn(with_inverse_of(
        kInverse, dynamics_cases(kFile, "newton_euler", "articulated_body",
                                 {puma560(), puma560_modified(), pa10(), pa10_nus(), panda(),
                                  planar_rods(), scara(), tree(), floating_manipulator(),
                                  long_chain(30)}))),
    dynamics_case_name);

}  // namespace
}  // namespace robomosp::conformance
