// SPDX-License-Identifier: Apache-2.0
// Permit: the effects allowed to the work on a thread. Dispatch installs one while a command runs.
// All code that edits the document, reads or writes a file, starts a process or changes the
// registry requests its effect there, so that a wrong entry in the command table grants no access
// (layer: core).
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "kernel/effects.h"

namespace robomosp {

class FileRoot;

/// Borrowed texts: names of the session and of the command.
struct Permit {
  std::string_view session;
  std::string_view work;  ///< "robot.get", "a script"
  Effects declared;       ///< effects that the command table declares for the work
  Effects denied;         ///< effects denied to the session
  /// Set when an effect was refused, so that the command fails with a permission error even if a
  /// provider hides the refusal.
  mutable bool was_refused = false;
  /// True if `denied` also applies to commands dispatched within, whatever the session may do; for
  /// a script that came with a file.
  bool holds_within = false;
  /// The only folder for reading and writing files; null = anywhere. Commands dispatched within,
  /// and jobs, inherit it (kernel/file_root.h).
  std::shared_ptr<const FileRoot> files = nullptr;
};

/// Effects that this thread's permit denies to everything dispatched within.
[[nodiscard]] Effects denied_within() noexcept;

/// Installs a permit for this thread until the scope ends; null = the program's own work, which may
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

/// Marks the program's own work until the scope ends: it may have any effect, but opens files only
/// where the previous permit allows. For code that opens files named by a user without that being
/// an effect of the command.
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

/// A copy of this thread's permit for work on other threads (jobs). Null if it has none.
[[nodiscard]] std::shared_ptr<const Permit> keep_permit();

/// Ok if this thread's work may have the effect; else one sentence that names session and work.
/// ErrorCode::permission if the session is denied it, ErrorCode::internal if the table does not
/// declare it for the work.
[[nodiscard]] Result<void> require(Effect effect);

/// The refusal, before a command runs or at the effect itself.
[[nodiscard]] Error not_permitted(std::string_view session, std::string_view work, Effect effect);

}  // namespace robomosp
