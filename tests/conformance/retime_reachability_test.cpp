// SPDX-License-Identifier: Apache-2.0
// Retimer "reachability": the SDK's suite.
#include <robomosp/sdk/conformance/retimer_suite.h>

namespace robomosp::conformance {
namespace {

INSTANTIATE_TEST_SUITE_P(Reachability, RetimerConformance,
                         testing::Values(RetimerCase{
                             std::string(ROBOMOSP_PLUGIN_DIR) + "/retime_reachability.so",
                             "reachability"}));

}  // namespace
}  // namespace robomosp::conformance
