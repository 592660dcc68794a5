// SPDX-License-Identifier: Apache-2.0
// robomosp-plugin-suites FILE [GoogleTest options]: runs the suites of the SDK on every provider of
// one plugin file. Exit code 0 all passed, 1 something failed, 3 nothing of it has a suite here.
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include "tested_plugin.h"

namespace {
std::string file;
}  // namespace

const char* robomosp_tested_plugin() { return file.c_str(); }

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: robomosp-plugin-suites FILE [GoogleTest options]\n", stderr);
    return 2;
  }
  file = argv[1];
  argv[1] = argv[0];
  int count = argc - 1;
  // These ask whether a plugin offers a certain interface; here that is not asked.
  GTEST_FLAG_SET(filter, "-Conformance.*");
  testing::InitGoogleTest(&count, argv + 1);
  const int failed = RUN_ALL_TESTS();
  if (testing::UnitTest::GetInstance()->test_to_run_count() > 0) return failed;
  std::fputs(
      "There is no suite here for what this plugin offers. The suites of curves, motion laws, "
      "orientations, segments, planners and code need cases of your own: see "
      "robomosp/sdk/conformance.\n",
      stderr);
  return 3;
}
