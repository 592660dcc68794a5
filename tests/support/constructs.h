// SPDX-License-Identifier: Apache-2.0
// The catalogue of constructs that posts are tried with, as it is shipped.
#pragma once

#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/post_constructs.h>

namespace robomosp::test {

inline std::vector<post::ConstructCase> construct_catalogue() {
  std::ifstream in(std::string(ROBOMOSP_SOURCE_DIR) + "/scripts/post_test/constructs.txt",
                   std::ios::binary);
  auto all = post::read_constructs(std::string(std::istreambuf_iterator<char>(in), {}));
  if (all.ok()) return std::move(all).value();
  ADD_FAILURE() << all.error().sentence();
  return {};
}

}  // namespace robomosp::test
