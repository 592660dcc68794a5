// SPDX-License-Identifier: Apache-2.0
// Every solver of the plugin at least once; alone where there is no other half.
#include <robomosp/sdk/conformance/dynamics_suite.h>

#include "subject.h"

namespace robomosp::conformance {
namespace {

const suites::Suite here("dynamics");

std::vector<DynamicsCase> cases() {
  const suites::Subject& s = suites::subject();
  auto inverse = suites::providers_for<InverseDynamics>("dynamics");
  const auto forward = suites::providers_for<ForwardDynamics>("dynamics");
  std::string inverse_file;
  if (inverse.empty() && !forward.empty() && !s.dynamics.empty()) {
    inverse = provider_names<InverseDynamics>(s.dynamics.c_str());
    inverse.resize(std::min<std::size_t>(inverse.size(), 1));
    inverse_file = s.dynamics;
  }
  std::vector<DynamicsCase> all;
  for (std::size_t i = 0; i < std::max(inverse.size(), forward.size()); ++i) {
    const auto of = [&](const std::vector<std::string>& names) {
      return names.empty() ? std::string() : names[std::min(i, names.size() - 1)];
    };
    for (DynamicsCase& c :
         with_inverse_of(inverse_file, dynamics_cases(s.file, of(inverse), of(forward), s.models)))
      all.push_back(std::move(c));
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Plugin, DynamicsConformance, testing::ValuesIn(cases()),
                         [](const auto& one) {
                           return one.param.inverse + "_" + one.param.forward + "_" +
                                  dynamics_case_name(one);
                         });

}  // namespace
}  // namespace robomosp::conformance
