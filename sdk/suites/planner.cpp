// SPDX-License-Identifier: Apache-2.0
#include <robomosp/sdk/conformance/planner_suite.h>

#include "subject.h"

namespace robomosp::conformance {
namespace {

const suites::Suite here("planner");

std::vector<PlannerCase> cases() {
  std::vector<PlannerCase> all;
  for (const std::string& name : suites::providers_for<Planner>("planner"))
    all.push_back({suites::subject().file, name});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Plugin, PlannerConformance, testing::ValuesIn(cases()),
                         [](const auto& one) { return one.param.provider; });

}  // namespace
}  // namespace robomosp::conformance
