// SPDX-License-Identifier: Apache-2.0
#include <robomosp/sdk/conformance/module_suite.h>

#include "subject.h"

namespace robomosp::conformance {
namespace {

const suites::Suite here("module");

std::vector<ModuleCase> cases() {
  std::vector<ModuleCase> all;
  for (const std::string& name : suites::providers_for<Module>("module"))
    all.push_back({suites::subject().file, name});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Plugin, ModuleConformance, testing::ValuesIn(cases()), module_case_name);

}  // namespace
}  // namespace robomosp::conformance
