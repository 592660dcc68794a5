// SPDX-License-Identifier: Apache-2.0
// Assigns the motions of a program to robots (layer: data processing, program_post).
#pragma once

#include <string_view>
#include <vector>

#include <robomosp/sdk/program_tables.h>

#include "program_post/legalise.h"

namespace robomosp::program_post {

/// Removes ACT_ROB from a program, since targets move one robot, their controller's. If the motions
/// of the called routines are of several robots, each further robot is an error at its first
/// motion. A motion without ACT_ROB belongs to the only ROBOT, if there is one. Linear.
void to_one_robot(ProgramTables& t, std::string_view title, std::vector<Remark>& remarks);

}  // namespace robomosp::program_post
