// SPDX-License-Identifier: Apache-2.0
// The robots of the library, by name.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

namespace robomosp::test {

inline std::vector<std::string> library_robots() {
  std::vector<std::string> names;
  const auto folder = std::filesystem::path(ROBOMOSP_SOURCE_DIR) / "scripts/library/robots";
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".rbt") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace robomosp::test
