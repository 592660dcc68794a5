// SPDX-License-Identifier: Apache-2.0
// The remedy of a contact that is intended: a rule that allows the pair (layer: application, ioci
// only).
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "ioci/core/trial.h"
#include "kernel/fault.h"

namespace robomosp::ioci {

/// world.allow_pair for two bodies of a world, not tried yet.
[[nodiscard]] FaultRemedy allow_pair_remedy(const Handle& world, const std::string& a,
                                            const std::string& b);

/// Tries rules of pairs, each pair once: with the rule, the world must not check the pair any more.
class PairTrials {
 public:
  /// On the records that the command sees. It must outlive this.
  explicit PairTrials(CommandContext& ctx) : ctx_(ctx) {}
  /// Marks the remedies world.allow_pair of the fault as tried, and drops those that do not help.
  void look_at(Fault&);

 private:
  static constexpr std::size_t kMostTried = 20;
  enum class Outcome : std::uint8_t { not_tried, helps, useless };
  Outcome outcome_of(const FaultRemedy&);
  CommandContext& ctx_;
  std::map<std::string, Outcome> known_;  ///< by the remedy's arguments
};

}  // namespace robomosp::ioci
