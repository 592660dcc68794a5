// SPDX-License-Identifier: Apache-2.0
#include <robomosp/sdk/conformance/ik_closed_suite.h>

#include "subject.h"

namespace robomosp::conformance {
namespace {

const suites::Suite here("ik");

std::vector<IkCase> cases(bool closed_form) {
  const suites::Subject& s = suites::subject();
  std::vector<IkCase> all;
  for (const std::string& name : suites::providers_for<IkSolver>("ik"))
    if (!closed_form || suites::has_tag<IkSolver>(s.file, name, "closed_form"))
      for (IkCase& c : ik_cases(s.file, name, s.models)) {
        c.may_refuse = !s.are_models_chosen;
        all.push_back(std::move(c));
      }
  return all;
}
std::string name(const testing::TestParamInfo<IkCase>& info) {
  return info.param.provider + "_" + ik_case_name(info);
}

INSTANTIATE_TEST_SUITE_P(Plugin, IkConformance, testing::ValuesIn(cases(false)), name);
INSTANTIATE_TEST_SUITE_P(Plugin, IkClosedForm, testing::ValuesIn(cases(true)), name);

}  // namespace
}  // namespace robomosp::conformance
