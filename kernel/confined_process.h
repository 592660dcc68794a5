// SPDX-License-Identifier: Apache-2.0
// Programs that read files for a session whose files lie in a folder: the system itself (Landlock)
// keeps them to it, whatever names the files hold that they read (layer: core).
#pragma once

#include <filesystem>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/process.h"

namespace robomosp {

/// Holds as long as the program runs; then removes the temporary folder that was its own.
class ProcessConfinement {
 public:
  /// Where this thread's permit has a folder for files, changes what is to be run so that the
  /// program can read that folder, those that come with it, libraries of the system and `code`, and
  /// write in a temporary folder of its own (TMPDIR), and opens nothing else. Without one, nothing
  /// is changed. ErrorCode::unsupported where the system cannot do that.
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

/// Whether the system can keep a program to folders.
[[nodiscard]] bool can_confine_processes() noexcept;

}  // namespace robomosp
