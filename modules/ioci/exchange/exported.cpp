// SPDX-License-Identifier: Apache-2.0
#include "ioci/exchange/exported.h"

#include <system_error>

#include "io/native.h"

namespace robomosp::ioci {

namespace fs = std::filesystem;

Result<void> write_exported(const std::vector<ExportedFile>& files, const fs::path& file) {
  const std::string own = file.filename().string();
  // The main one last: it names the others.
  for (const bool is_main : {false, true})
    for (const ExportedFile& f : files) {
      if ((f.name == own) != is_main) continue;
      const fs::path to = file.parent_path() / f.name;
      if (!to.parent_path().empty()) {
        std::error_code failed;
        fs::create_directories(to.parent_path(), failed);  // write_file says what did not work
      }
      RMP_TRY(io::write_file(to, f.bytes));
    }
  return {};
}

}  // namespace robomosp::ioci
