// SPDX-License-Identifier: Apache-2.0
// Programs that read files for a session that is confined to a folder: the system (Landlock)
// restricts them to it, whatever names the files they read contain (layer: core).
#pragma once

#include <filesystem>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/process.h"

namespace robomosp {

/// Keep it while the program runs; it then removes the program's temporary folder.
class ProcessConfinement {
 public:
  /// If this thread's permit has a folder for files, changes the process specification so that the
  /// program can read that folder, the files shipped with this program, system libraries and
  /// `code`, write in a separate temporary folder (TMPDIR), and open nothing else. Without such a
  /// folder nothing changes. ErrorCode::unsupported if the system lacks this.
  static Result<ProcessConfinement> apply(ProcessSpec&,
                                          const std::vector<std::filesystem::path>& code = {});
  ProcessConfinement(ProcessConfinement&& from) noexcept : own_(std::move(from.own_)) {
    from.own_.clear();
  }
  ProcessConfinement& operator=(ProcessConfinement&&) = delete;
  ~ProcessConfinement();

 private:
  ProcessConfinement() = default;
  std::filesystem::path own_;  ///< its temporary folder; empty = none
};

/// True if the system can confine a program to folders.
[[nodiscard]] bool can_confine_processes() noexcept;

}  // namespace robomosp
