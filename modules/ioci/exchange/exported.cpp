// SPDX-License-Identifier: Apache-2.0
#include "ioci/exchange/exported.h"

#include <algorithm>
#include <system_error>

#include "io/native.h"
#include "kernel/text.h"

namespace robomosp::ioci {

namespace fs = std::filesystem;

Result<void> write_exported(const std::vector<ExportedFile>& files, const fs::path& file,
                            const std::string& provider) {
  const auto broken = [&](const std::string& what) {
    return error(ErrorCode::plugin_failed, "provider " + text::quote(provider) + " " + what,
                 "Report it to the provider's author or choose another format.");
  };
  const std::string own = file.filename().string();
  bool has_main = false;
  for (const ExportedFile& f : files) {
    const fs::path name(f.name);
    const bool leads_out =
        name.empty() || name.is_absolute() ||
        std::any_of(name.begin(), name.end(), [](const fs::path& part) { return part == ".."; });
    if (leads_out)
      return broken("made a file " + text::quote(f.name) + " that is not beside the main one");
    has_main = has_main || f.name == own;
  }
  if (!has_main) return broken("made no file " + text::quote(own));
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
