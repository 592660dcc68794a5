// SPDX-License-Identifier: Apache-2.0
// Records as variables of their parts, functions as procedures, OUT parameters as variables of the
// program, AND and OR as IF (layer: data processing, program_post).
#pragma once

#include <vector>

#include "program_post/legalise.h"

namespace robomosp::program_post {

/// Rewrites the tables in place where the capabilities lack one of these, and the rest of what the
/// program means stays: values are computed from left to right, once, and the right side of AND and
/// OR only where it counts. Where the place of a condition leaves no room for statements before it
/// (WAIT FOR, UNTIL, interrupts), that is an error among the remarks.
/// - kPostRecords: a variable, a parameter or a constant of a record is one for each of its parts;
///   arrays of records are arrays of the parts. Values as a whole are assigned, passed, written
///   and made part by part; a function that gives a record is a procedure.
/// - kPostFunctions, with kPostProcedures: a function is a procedure whose OUT parameters get its
///   value.
/// - kPostOutParameters, with kPostProcedures: they are variables of the program that are copied
///   before and behind each call.
/// - kPostShortCircuit, with kPostIf: where the right side may fail or calls a function.
void to_scalars(ProgramTables&, const PostCapabilities&, std::vector<Remark>&);

}  // namespace robomosp::program_post
