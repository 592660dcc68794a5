// SPDX-License-Identifier: Apache-2.0
// Names of the files that a post writes: what the host takes, and what the suite of posts expects
// (layer: contract helper, inline only, not part of the ABI).
#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace robomosp::post {

/// What is wrong with a file's name, such as "named a file outside of its folder"; "" = nothing.
/// Folders are allowed ("app/app.pjx"), paths out of the folder are not.
[[nodiscard]] inline std::string_view file_name_fault(std::string_view name) {
  if (name.empty() || !name.data()) return "named a file \"\"";
  if (name.size() > 1000) return "named a file with more than 1000 bytes";
  for (std::size_t from = 0; from <= name.size();) {
    const std::size_t end = std::min(name.find('/', from), name.size());
    const std::string_view part = name.substr(from, end - from);
    if (part.empty() || part == "." || part == "..") return "named a file outside its folder";
    from = end + 1;
  }
  for (const char c : name)
    if (static_cast<unsigned char>(c) < 32 || c == 127 || c == '\\' || c == ':')
      return "named a file with characters not allowed in file names";
  return {};
}

}  // namespace robomosp::post
