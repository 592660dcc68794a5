// SPDX-License-Identifier: Apache-2.0
// Trials of remedies: commands run on a draft that is dropped afterwards (layer: application, ioci
// only).
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "document/draft.h"
#include "ioci/core/application.h"
#include "kernel/fault.h"

namespace robomosp::ioci {

/// A draft on records that a command sees, those of an open group and of a job included. No list,
/// event or audit message names it, and its edits are dropped with it. [thread of the command]
class Trial {
 public:
  /// Longest time of one trial; its commands are cancelled then.
  static constexpr std::chrono::milliseconds kLongest{1000};
  /// Null within another trial of the thread, and if the session may not edit.
  [[nodiscard]] static std::unique_ptr<Trial> open(CommandContext&, const document::Snapshot& base);
  /// Why a command is not tried, as a sentence; "" = it has only effects that dropping the draft
  /// takes back.
  [[nodiscard]] static std::string why_not(const CommandSpec&);
  ~Trial();
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;
  /// Runs a command with the session's rights. It sees what earlier ones of this trial edited.
  /// Commands with effects other than reading and editing are refused (ErrorCode::permission).
  Result<Value> run(std::string_view command, const Map& args);
  /// Whether the time was over, so that a failure of run() says nothing of the remedy.
  [[nodiscard]] bool is_over() const;

 private:
  Trial(CommandContext& ctx, const document::Snapshot& base);
  CommandContext& ctx_;
  std::shared_ptr<document::Draft> draft_;
  std::chrono::steady_clock::time_point end_;
};

/// Reasons that several remedies have (FaultRemedy::untried).
inline constexpr const char* kUntriedTooLong = "Its trial took too long.";
inline constexpr const char* kUntriedHere = "No trial was possible in this call.";

}  // namespace robomosp::ioci
