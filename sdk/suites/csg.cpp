// SPDX-License-Identifier: Apache-2.0
#include <robomosp/sdk/conformance/csg_suite.h>
#include <robomosp/sdk/conformance/provider.h>

#include "subject.h"

namespace robomosp::conformance {
namespace {

const suites::Suite here("csg");

std::vector<CsgSubject> subjects() {
  std::vector<CsgSubject> all;
  for (const std::string& name : suites::providers_for<CsgEngine>("csg")) {
    const std::string file = suites::subject().file;
    CsgSubject subject;
    subject.name = name;
    if (const auto found = find_provider<CsgEngine>(file, name); found.ok() && (*found)->tags)
      subject.tags = (*found)->tags;
    subject.make = [name, file]() -> std::unique_ptr<CsgEngine> {
      const auto found = find_provider<CsgEngine>(file, name);
      return found.ok() ? create<CsgEngine>(**found) : nullptr;
    };
    all.push_back(std::move(subject));
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Plugin, CsgConformance, testing::ValuesIn(subjects()),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace robomosp::conformance
