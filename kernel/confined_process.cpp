// SPDX-License-Identifier: Apache-2.0
#include "kernel/confined_process.h"

#include <cstdlib>
#include <string>
#include <system_error>

#include "kernel/file_root.h"

#include <linux/landlock.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace robomosp {

namespace fs = std::filesystem;

bool can_confine_processes() noexcept {
  return ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION) >= 1;
}

Result<ProcessConfinement> ProcessConfinement::apply(ProcessSpec& spec,
                                                     const std::vector<fs::path>& code) {
  ProcessConfinement out;
  const FileRoot* root = current_file_root();
  std::error_code ec;
  // That it is missing is found where it is started.
  if (!root || !fs::is_regular_file(spec.program, ec)) return out;
  if (!can_confine_processes())
    return error(ErrorCode::unsupported,
                 "this system cannot keep a program to a folder (Landlock), so no importer can "
                 "read files for a session confined to a folder",
                 "Use Linux 5.13 or later with Landlock, or have the file read by another "
                 "session.");
  std::string own = (fs::temp_directory_path(ec) / "robomosp-XXXXXX").string();
  if (ec || !::mkdtemp(own.data()))
    return error(ErrorCode::io,
                 "no temporary folder could be made for " + spec.program.filename().string(),
                 "Check TMPDIR and its free space.");
  out.own_ = own;
  std::vector<std::string> words{"confine", "own", own, "read", root->folder().string()};
  const auto add = [&](const char* what, const fs::path& path) {
    words.emplace_back(what);
    words.push_back(path.string());
  };
  for (const fs::path& p : root->readable()) add("read", p);
  for (const fs::path& p : code) add("code", p);
  words.emplace_back("run");
  words.push_back(spec.program.string());
  words.insert(words.end(), spec.arguments.begin(), spec.arguments.end());
  spec.program = helper_program("robomosp-importer");
  spec.arguments = std::move(words);
  return out;
}

ProcessConfinement::~ProcessConfinement() {
  std::error_code ignored;
  if (!own_.empty()) fs::remove_all(own_, ignored);
}

}  // namespace robomosp
