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

/// Borrowed texts: the session's name and the command's.
struct Permit {
  std::string_view session;
  std::string_view work;  ///< "robot.get", "a script"
  Effects declared;       ///< all that the table says of the work
  Effects denied;         ///< of the session
  /// Set when an effect was refused: whatever a provider made of that on its way up, the command
  /// was not permitted.
  mutable bool was_refused = false;
};

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
