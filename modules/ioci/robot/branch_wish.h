// SPDX-License-Identifier: Apache-2.0
// Requested branches of inverse kinematics: "left up", {shoulder = "left"} (layer: application).
// Internal to modules/ioci.
#pragma once

#include <string>

#include "ioci/core/commands.h"
#include "sim/ik_question.h"

namespace robomosp::ioci {

/// Reads words in any order, a list of them, or a table by the choices' names; "no flip" may be
/// written "no_flip", "no-flip" and "noflip". Unknown words and words that exclude each other are
/// errors.
[[nodiscard]] Result<sim::BranchWish> read_branch_wish(const sim::BranchNames& names,
                                                       const Value& given, const std::string& path);

}  // namespace robomosp::ioci
