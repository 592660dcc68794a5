// SPDX-License-Identifier: Apache-2.0
// main() of a program that is many tests: called by the name of one of them, through a link, it
// runs the tests of that one's sources (robomosp_room in cmake/RobomospProject.cmake); called by
// its own name, all. ROOM_TABLE names a file of pairs of test and source.
#pragma once

#include <filesystem>
#include <iostream>
#include <set>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace robomosp::test {

inline std::set<std::string_view> sources_of(std::string_view test) {
  std::set<std::string_view> out;
  for (const auto& [name, source] : kTestsAndSources)
    if (name == test) out.insert(source);
  return out;
}

/// What a filter leaves out so that only tests of these sources run, "A.one:B.two:"; takes the
/// sources that have tests from `without_tests`.
inline std::string all_but(const std::set<std::string_view>& sources,
                           std::set<std::string_view>& without_tests) {
  std::string out;
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  for (int i = 0; i < all.total_test_suite_count(); ++i) {
    const testing::TestSuite& suite = *all.GetTestSuite(i);
    for (int k = 0; k < suite.total_test_count(); ++k) {
      const testing::TestInfo& one = *suite.GetTestInfo(k);
      const std::string source = std::filesystem::path(one.file()).filename().string();
      without_tests.erase(source);
      if (!sources.count(source)) out += std::string(suite.name()) + "." + one.name() + ":";
    }
  }
  return out;
}

}  // namespace robomosp::test

int main(int argc, char** argv) {
  const std::string name = std::filesystem::path(argv[0]).filename().string();
  testing::InitGoogleTest(&argc, argv);
  const auto sources = robomosp::test::sources_of(name);
  std::string& filter = testing::GTEST_FLAG(filter);
  if (!sources.empty()) {
    auto without_tests = sources;
    filter += (filter.find('-') == std::string::npos ? "-" : ":") +
              robomosp::test::all_but(sources, without_tests);
    if (!without_tests.empty()) {
      std::cerr << name << ": no test of this program stands in " << *without_tests.begin() << '\n';
      return 1;
    }
  }
  return RUN_ALL_TESTS();
}
