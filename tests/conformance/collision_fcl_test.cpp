// SPDX-License-Identifier: Apache-2.0
// Provider "fcl": the SDK's suite of collision engines.
#include <robomosp/sdk/conformance/collision_suite.h>

namespace robomosp::conformance {
namespace {

INSTANTIATE_TEST_SUITE_P(Fcl, CollisionConformance,
                         testing::Values(CollisionCase{
                             std::string(ROBOMOSP_PLUGIN_DIR) + "/collision_fcl.so", "fcl"}));

}  // namespace
}  // namespace robomosp::conformance
