// SPDX-License-Identifier: Apache-2.0
// Whose motions the motions of a program are (layer: data processing, program_post).
#pragma once

#include <string_view>
#include <vector>

#include <robomosp/sdk/program_tables.h>

#include "program_post/legalise.h"

namespace robomosp::program_post {

/// Takes ACT_ROB out of a program: targets move one robot, their controller's. Where the
/// motions of the routines that are mentioned are of more than one, each other robot is an error at
/// its first motion. A motion without ACT_ROB is of the only ROBOT, where there is one. Linear.
void to_one_robot(ProgramTables& t, std::string_view title, std::vector<Remark>& remarks);

}  // namespace robomosp::program_post
