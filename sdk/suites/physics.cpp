// SPDX-License-Identifier: Apache-2.0
#include <robomosp/sdk/conformance/physics_suite.h>

#include "subject.h"

namespace robomosp::conformance {
namespace {

const suites::Suite here("physics");

std::vector<PhysicsCase> cases() {
  std::vector<PhysicsCase> all;
  for (const std::string& name : suites::providers_for<PhysicsEngine>("physics"))
    all.push_back({suites::subject().file, name, {}, name});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Plugin, PhysicsConformance, testing::ValuesIn(cases()),
                         [](const auto& one) { return one.param.provider; });

}  // namespace
}  // namespace robomosp::conformance
