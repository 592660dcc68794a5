// SPDX-License-Identifier: Apache-2.0
#include <robomosp/sdk/conformance/primitive_suite.h>

#include "subject.h"

namespace robomosp::conformance {
namespace {

const suites::Suite here("primitive");

std::vector<PrimitiveSubject> cases() {
  std::vector<PrimitiveSubject> all;
  for (const std::string& name : suites::providers_for<CsgPrimitive>("primitive"))
    all.push_back({suites::subject().file, name});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Plugin, PrimitiveConformance, testing::ValuesIn(cases()),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace robomosp::conformance
