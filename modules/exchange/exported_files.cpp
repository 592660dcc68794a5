// SPDX-License-Identifier: Apache-2.0
#include "exchange/exported_files.h"

#include <set>

#include "io/native.h"
#include "kernel/file_root.h"
#include "kernel/text.h"

namespace robomosp::exchange {

namespace fs = std::filesystem;

Result<void> write_exported(const std::vector<ExportedFile>& files, const fs::path& file) {
  const std::string own = file.filename().string();
  // Together, so that folders are put on the disk once and not once a file; all come or none.
  io::FileBatch batch;
  std::set<fs::path> folders;
  // The main one last: it names the others.
  for (const bool is_main : {false, true})
    for (const ExportedFile& f : files) {
      if ((f.name == own) != is_main) continue;
      const fs::path to = file.parent_path() / f.name;
      if (!to.parent_path().empty() && folders.insert(to.parent_path()).second) {
        if (const auto made = make_folders(to.parent_path());  // add() says what did not work
            !made.ok() && made.error().code == ErrorCode::permission)
          return made.error();
      }
      // Of a robot of very many bodies few have changed since it was exported last.
      if (!is_main && io::file_holds(to, f.bytes)) continue;
      RMP_TRY(batch.add(to, f.bytes));
    }
  return batch.finish();
}

Result<void> check_new(const std::vector<ExportedFile>& files, const fs::path& file) {
  std::vector<std::string> there;
  for (const ExportedFile& f : files)
    if (file_kind(file.parent_path() / f.name) != FileKind::none)
      there.push_back(text::quote(f.name));
  if (there.empty()) return {};
  return error(ErrorCode::conflict,
               text::enumerate_some(there, 4) + (there.size() == 1 ? " is" : " are") +
                   " already present, and nothing was written",
               "overwrite = true replaces existing files.", file.parent_path().string());
}

}  // namespace robomosp::exchange
