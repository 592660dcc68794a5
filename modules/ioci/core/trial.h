// SPDX-License-Identifier: Apache-2.0
// Trials of remedies: commands run on a draft that is dropped afterwards (layer: application, ioci
// only).
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "ioci/core/application.h"

namespace robomosp::ioci {

/// A draft on the document's records that no list, event or audit message names. Its edits are
/// dropped with it.
class Trial {
 public:
  /// Null where nothing can be tried: in a job, within another trial, and while the session edits a
  /// group, a gesture or a draft.
  [[nodiscard]] static std::unique_ptr<Trial> open(Application&, Session&);
  ~Trial();
  /// Whether a command has only effects that dropping the draft takes back.
  [[nodiscard]] static bool may_run(const CommandSpec&);
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;
  /// Runs a command with the session's rights. It sees what earlier ones of this trial edited.
  /// Commands with effects other than reading and editing are refused (ErrorCode::permission).
  Result<Value> run(std::string_view command, const Map& args);

 private:
  Trial(Application& app, Session& session, std::uint64_t draft);
  Application& app_;
  Session& session_;
  std::uint64_t draft_;
};

}  // namespace robomosp::ioci
