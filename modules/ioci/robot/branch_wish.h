// SPDX-License-Identifier: Apache-2.0
// Requested branches of inverse kinematics: "left up", {shoulder = "left"} (layer: application).
// Internal to modules/ioci.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "ioci/core/commands.h"
#include "sim/ik_choice.h"

namespace robomosp::ioci {

/// A side for each of some of a solver's choices.
class BranchWish {
 public:
  /// Reads words in any order, a list of them, or a table by the choices' names; "no flip" may be
  /// written "no_flip", "no-flip" and "noflip". Unknown words and words that exclude each other are
  /// errors.
  static Result<BranchWish> read(const sim::BranchNames& names, const Value& given,
                                 const std::string& path);
  /// True if a configuration is on such a branch, or on the border of its two sides.
  [[nodiscard]] bool is_met(std::span<const double> measures) const;
  /// "left up"
  [[nodiscard]] const std::string& words() const { return words_; }

 private:
  std::vector<int> ways_;  ///< one per choice: 1, -1, 0 = any
  std::string words_;
};

}  // namespace robomosp::ioci
