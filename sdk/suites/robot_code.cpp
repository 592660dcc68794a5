// SPDX-License-Identifier: Apache-2.0
#include <robomosp/sdk/conformance/robot_code_suite.h>

#include "subject.h"

namespace robomosp::conformance {
namespace {

const suites::Suite here("robot_code");

std::vector<RobotCodeCase> cases() {
  suites::Subject& s = suites::subject();
  std::vector<RobotCodeCase> all;
  const auto names = suites::providers_for<RobotCodeGenerator>("robot_code");
  if (!names.empty() && s.runner.empty()) {
    s.notes.insert("The generators were not judged: --runner gives no command for their code.");
    return all;
  }
  for (const std::string& name : names)
    for (const RobotModel& m : s.models)
      all.push_back({s.file, name, run_by(s.runner), m, s.work + "/robot_code"});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Plugin, RobotCodeConformance, testing::ValuesIn(cases()),
                         robot_code_case_name);

}  // namespace
}  // namespace robomosp::conformance
