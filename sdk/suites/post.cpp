// SPDX-License-Identifier: Apache-2.0
#include <robomosp/sdk/conformance/post_suite.h>

#include "subject.h"

namespace robomosp::conformance {
namespace {

const suites::Suite here("post");

std::vector<PostSubject> cases() {
  suites::Subject& s = suites::subject();
  std::vector<PostSubject> all;
  for (const std::string& name : suites::providers_for<Post>("post"))
    all.push_back({s.file, name, s.language, s.constructs, {}});
  if (!all.empty() && (s.language.empty() || s.constructs.empty()))
    s.notes.insert(
        "Posts are judged by programs: --language gives the plugin that compiles them (irl.so), "
        "and "
        "--constructs the catalogue (share/robomosp/post_test/constructs.txt).");
  return all;
}

INSTANTIATE_TEST_SUITE_P(Plugin, PostConformance, testing::ValuesIn(cases()),
                         [](const auto& one) { return suites::as_name(one.param.provider); });

}  // namespace
}  // namespace robomosp::conformance
