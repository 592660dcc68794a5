// SPDX-License-Identifier: Apache-2.0
// Checks of one record on its own: finite numbers, unique names, order, ranges, sizes
// (layer: application).
#pragma once

#include <string_view>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "model/records.h"

namespace robomosp::document {

/// A name starts with a letter of any script, has letters, digits, _ - . and spaces, and does not
/// end in a space (robomosp/sdk/names.h).
[[nodiscard]] bool is_name(std::string_view name);
/// `a robot`, `an object`.
[[nodiscard]] std::string with_article(std::string_view noun);
/// The refusal of a malformed name; `what` as in "robot" or "node".
[[nodiscard]] Error bad_name(std::string_view name, std::string_view what);

/// The element of a record that a fault is about: ("node" | "part" | "link" | "pose" | "segment" |
/// "object" | "robot" | "trajectory", index); an empty list is the record as a whole.
struct Subject {
  std::string_view list;
  std::size_t index = 0;
};

/// Everything that can be checked without other records; the error's `where` names the record and
/// its message the node, part or link. [any thread]
[[nodiscard]] Result<void> check_record(const model::Record& record, Subject* subject = nullptr);
/// The same of a record that was `before`, which has passed; null = it was not there. What the two
/// share is not looked at again. `progress`, if any, is asked every some elements whether to stop
/// (ErrorCode::cancelled). [any thread]
[[nodiscard]] Result<void> check_edit(const model::Record& record, const model::Record* before,
                                      const Progress* progress = nullptr);

/// Asks every some elements of a long list whether to stop.
class Watch {
 public:
  explicit Watch(const Progress* progress) : progress_(progress) {}
  [[nodiscard]] Result<void> at(std::size_t element) const {
    constexpr std::size_t kLook = 1024;
    if (!progress_ || element % kLook != 0 || !progress_->cancelled()) return {};
    return error(ErrorCode::cancelled, "its check was cancelled");
  }

 private:
  const Progress* progress_;
};

}  // namespace robomosp::document
