// SPDX-License-Identifier: Apache-2.0
// Routines that call themselves, as loops with a stack of their own (layer: data processing,
// program_post).
#pragma once

#include <cstddef>
#include <vector>

#include "program_post/legalise.h"

namespace robomosp::program_post {

/// Rewrites the tables in place where the capabilities have no recursion: routines that call
/// themselves, or each other in a circle, become steps of one loop. What a call of theirs has to
/// find again behind it is kept in arrays, element `depth` for the `depth`-th call within the
/// others; `most` calls are that many, and one more ends the program with a message and HALT. Calls
/// from elsewhere stay as they are, and no routine calls what called it. Each group is a note among
/// the remarks.
///
/// An error at its line where a program may mean something else then: a variable that such a
/// routine reaches by an OUT or INOUT parameter and by its name (or by two of them), several
/// processes that call it, lists, files and semaphores within it, a call of its own in WAIT FOR or
/// UNTIL or at the end of a motion (DO), any in the condition of an interrupt. So is recursion
/// where the target lacks procedures, IF, WHILE, integers or arrays. About linear, times the depth
/// of its blocks.
void to_loops(ProgramTables&, const PostCapabilities&, std::size_t most, std::vector<Remark>&);

}  // namespace robomosp::program_post
