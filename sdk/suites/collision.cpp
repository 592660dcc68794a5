// SPDX-License-Identifier: Apache-2.0
#include <robomosp/sdk/conformance/collision_suite.h>

#include "subject.h"

namespace robomosp::conformance {
namespace {

const suites::Suite here("collision");

std::vector<CollisionCase> cases() {
  std::vector<CollisionCase> all;
  for (const std::string& name : suites::providers_for<CollisionEngine>("collision"))
    all.push_back({suites::subject().file, name});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Plugin, CollisionConformance, testing::ValuesIn(cases()),
                         [](const auto& one) { return one.param.provider; });

}  // namespace
}  // namespace robomosp::conformance
