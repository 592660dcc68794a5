// SPDX-License-Identifier: Apache-2.0
// The tags say what to expect: "order=5", "adaptive", "symplectic".
#include <cstdlib>

#include <robomosp/sdk/conformance/integrator_suite.h>

#include "subject.h"

namespace robomosp::conformance {
namespace {

const suites::Suite here("integrator");

std::vector<IntegratorCase> cases() {
  const std::string& file = suites::subject().file;
  std::vector<IntegratorCase> all;
  for (const std::string& name : suites::providers_for<Integrator>("integrator")) {
    IntegratorCase c;
    c.file = file;
    c.provider = name;
    c.is_adaptive = suites::has_tag<Integrator>(file, name, "adaptive");
    c.is_symplectic = suites::has_tag<Integrator>(file, name, "symplectic");
    const std::string tags = (*find_provider<Integrator>(file, name))->tags;
    if (const auto at = tags.find("order="); at != std::string::npos)
      c.order = std::atoi(tags.c_str() + at + 6);
    all.push_back(c);
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Plugin, IntegratorConformance, testing::ValuesIn(cases()),
                         integrator_case_name);

}  // namespace
}  // namespace robomosp::conformance
