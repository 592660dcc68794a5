// SPDX-License-Identifier: Apache-2.0
// Branches of inverse kinematics as they are asked for: "left up", {shoulder = "left"} (layer:
// application). Internal to modules/ioci.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "ioci/core/commands.h"
#include "sim/ik_choice.h"

namespace robomosp::ioci {

/// Ways of some of a solver's choices.
class BranchWish {
 public:
  /// Words in any order, a list of them, or a table by the choices' names; "no flip" may be written
  /// "no_flip", "no-flip" and "noflip". Words that are unknown or exclude each other are errors.
  static Result<BranchWish> read(const sim::BranchNames& names, const Value& given,
                                 const std::string& path);
  /// Whether a configuration is on such a branch; where both ways meet it is.
  [[nodiscard]] bool is_met(std::span<const double> measures) const;
  /// "left up"
  [[nodiscard]] const std::string& words() const { return words_; }

 private:
  std::vector<int> ways_;  ///< a choice each: 1, -1, 0 = any
  std::string words_;
};

}  // namespace robomosp::ioci
