// SPDX-License-Identifier: Apache-2.0
// Columns of recordings as arguments (layer: application, ioci, internal).
#pragma once

#include <string>

#include "ioci/core/commands.h"
#include "recording/recording.h"

namespace robomosp::ioci {

/// Adds the columns that an entry of `columns` describes: one, or one for each column of a matrix.
Result<void> add_columns(const Value& entry, const std::string& where, recording::Recording& out);

/// The arguments `robot` and `world` of what makes recordings of given numbers.
[[nodiscard]] ParamSpec robot_of_columns_field();
[[nodiscard]] ParamSpec world_of_columns_field();
/// Makes the recording one of the robot that the arguments name, if any; its columns have to fit.
Result<void> give_robot(CommandContext&, const Map& args, recording::Recording&);

}  // namespace robomosp::ioci
