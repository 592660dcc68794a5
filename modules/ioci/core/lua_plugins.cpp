// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/lua_plugins.h"

#include <algorithm>
#include <set>
#include <system_error>

namespace robomosp::ioci {

namespace fs = std::filesystem;

std::vector<fs::path> lua_plugins(std::span<const fs::path> folders) {
  std::vector<fs::path> out;
  std::set<fs::path> names;
  for (const fs::path& folder : folders) {
    std::vector<fs::path> here;
    std::error_code failed;
    for (fs::directory_iterator it(folder, failed), end; !failed && it != end; it.increment(failed))
      if (it->path().extension() == ".lua" && it->is_regular_file(failed))
        here.push_back(it->path());
    std::sort(here.begin(), here.end());
    for (fs::path& file : here)
      if (names.insert(file.filename()).second) out.push_back(std::move(file));
  }
  return out;
}

}  // namespace robomosp::ioci
