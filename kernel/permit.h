// SPDX-License-Identifier: Apache-2.0
// Permit: what the work on a thread may do. Dispatch puts one up for as long as a command runs, and
// whatever edits the document, reads or writes a file, starts a process or changes the registry
// asks for its effect there, so that a wrong line in the table of commands opens nothing
// (layer: core).
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "kernel/effects.h"

namespace robomosp {

class FileRoot;

/// Borrowed texts: the session's name and the command's.
struct Permit {
  std::string_view session;
  std::string_view work;  ///< "robot.get", "a script"
  Effects declared;       ///< all that the table says of the work
  Effects denied;         ///< of the session
  /// Set when an effect was refused: whatever a provider made of that on its way up, the command
  /// was not permitted.
  mutable bool was_refused = false;
  /// What is denied is denied to commands that are dispatched within, too, whatever the session
  /// may: of a text that came with a file.
  bool holds_within = false;
  /// The folder that files are read and written in, and nowhere else; null = anywhere. What is
  /// dispatched within, and jobs, have it too (kernel/file_root.h).
  std::shared_ptr<const FileRoot> files = nullptr;
};

/// What this thread's permit denies to all that is dispatched within.
[[nodiscard]] Effects denied_within() noexcept;

/// Puts a permit up for this thread until the scope ends; null = the program's own work, which may
/// do anything.
class PermitScope {
 public:
  explicit PermitScope(const Permit* permit) noexcept;
  ~PermitScope();
  PermitScope(const PermitScope&) = delete;
  PermitScope& operator=(const PermitScope&) = delete;

 private:
  const Permit* before_;
};

/// The program's own work until the scope ends: it may do anything, but with files only where the
/// permit before it could. For what touches files that a user named without that being an effect of
/// the command.
class OwnWorkScope {
 public:
  OwnWorkScope();
  OwnWorkScope(const OwnWorkScope&) = delete;
  OwnWorkScope& operator=(const OwnWorkScope&) = delete;

 private:
  Permit permit_;
  PermitScope scope_;
};

/// The permit of this thread; null = none.
[[nodiscard]] const Permit* current_permit() noexcept;

/// A copy of this thread's permit for work that goes on elsewhere (jobs). Null when there is none.
[[nodiscard]] std::shared_ptr<const Permit> keep_permit();

/// Ok when this thread's work may have the effect; else one sentence that names session and work.
/// ErrorCode::permission when the session is denied it, ErrorCode::internal when the table does not
/// say that the work has it.
[[nodiscard]] Result<void> require(Effect effect);

/// The refusal before a command runs, or when it gets there.
[[nodiscard]] Error not_permitted(std::string_view session, std::string_view work, Effect effect);

}  // namespace robomosp
