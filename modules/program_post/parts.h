// SPDX-License-Identifier: Apache-2.0
// A program that is too long for one file as several that it calls (layer: data processing,
// program_post).
#pragma once

#include <cstddef>
#include <string_view>

#include <robomosp/sdk/program_tables.h>

namespace robomosp::program_post {

/// Moves the statements of the program itself into about `count` procedures without parameters of
/// `name` and a number, each about equally many, and leaves their calls. A part begins with a
/// motion that depends on nothing before it (PTP or LIN to a pose or to joints, behind a motion
/// that stops), so that it means the same alone; HALT and RETURN stay in the program. Nothing is
/// done where the program has variables, labels or blocks: it is for flattened ones. Gives how many
/// parts there are now; 0 = none. Linear.
std::size_t to_parts(ProgramTables&, std::size_t count, std::string_view name);

}  // namespace robomosp::program_post
