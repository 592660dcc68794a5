// SPDX-License-Identifier: Apache-2.0
// Replaces recursive routines by loops with a stack (layer: data processing, program_post).
#pragma once

#include <cstddef>
#include <vector>

#include "program_post/legalise.h"

namespace robomosp::program_post {

/// Rewrites the tables in place if the capabilities lack recursion: routines that call themselves
/// or each other recursively become steps of one loop. Values needed after such a call are kept in
/// arrays, at element `depth` for the `depth`-th nested call; the arrays have `most` elements, and
/// one more call ends the program with a message and HALT. Calls from elsewhere are kept, and no
/// routine calls its caller. Each group is a note among the remarks.
///
/// Constructs that could change the meaning are errors at their lines: a variable accessed by such
/// a routine through an OUT or INOUT parameter and by its name (or through two of them), several
/// processes that call it, lists, files and semaphores within it, recursive calls in WAIT FOR or
/// UNTIL or at the end of a motion (DO), and any in the condition of an interrupt. So is recursion
/// if the target lacks procedures, IF, WHILE, integers or arrays. Roughly linear, times the nesting
/// of its blocks.
void to_loops(ProgramTables&, const PostCapabilities&, std::size_t most, std::vector<Remark>&);

}  // namespace robomosp::program_post
