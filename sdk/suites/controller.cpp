// SPDX-License-Identifier: Apache-2.0
// With the inverse dynamics of another plugin. A controller with the tag "model_based" has to hold
// the weight exactly.
#include <robomosp/sdk/conformance/controller_suite.h>

#include "subject.h"

namespace robomosp::conformance {
namespace {

const suites::Suite here("controller");

std::vector<ControllerCase> cases() {
  suites::Subject& s = suites::subject();
  std::vector<ControllerCase> all;
  const auto names = suites::providers_for<Controller>("controller");
  if (names.empty()) return all;
  const auto dynamics = provider_names<InverseDynamics>(s.dynamics.c_str());
  if (dynamics.empty()) {
    s.notes.insert(
        "The controllers were not judged: --dynamics names no plugin with inverse dynamics.");
    return all;
  }
  for (const std::string& name : names) {
    const bool knows_weight = suites::has_tag<Controller>(s.file, name, "model_based");
    for (const RobotModel& m : s.models)
      all.push_back({s.file,
                     name,
                     s.dynamics,
                     dynamics.front(),
                     without_friction(m),
                     {},
                     knows_weight,
                     knows_weight ? 1e-4 : 2e-3});
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Plugin, ControllerConformance, testing::ValuesIn(cases()),
                         controller_case_name);

}  // namespace
}  // namespace robomosp::conformance
