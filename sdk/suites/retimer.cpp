// SPDX-License-Identifier: Apache-2.0
#include <robomosp/sdk/conformance/retimer_suite.h>

#include "subject.h"

namespace robomosp::conformance {
namespace {

const suites::Suite here("retimer");

std::vector<RetimerCase> cases() {
  std::vector<RetimerCase> all;
  for (const std::string& name : suites::providers_for<Retimer>("retimer"))
    all.push_back({suites::subject().file, name,
                   suites::has_tag<Retimer>(suites::subject().file, name, "torque")});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Plugin, RetimerConformance, testing::ValuesIn(cases()),
                         [](const auto& one) { return one.param.provider; });

}  // namespace
}  // namespace robomosp::conformance
