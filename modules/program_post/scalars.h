// SPDX-License-Identifier: Apache-2.0
// Converts records to variables of their parts, functions to procedures, OUT parameters to
// variables of the program, AND and OR to IF (layer: data processing, program_post).
#pragma once

#include <cstdint>
#include <map>
#include <string_view>
#include <vector>

#include "program_post/legalise.h"

namespace robomosp::program_post {

/// Rewrites the tables in place if the capabilities lack one of these, and preserves the meaning of
/// the program: values are computed from left to right, once, and the right side of AND and OR only
/// if needed. If no statements can be inserted before a condition (WAIT FOR, UNTIL, interrupts),
/// that is an error among the remarks.
/// - kPostRecords: a variable, parameter or constant of record type becomes one for each of its
///   parts;
///   arrays of records become arrays of the parts. Whole values are assigned, passed, written and
///   constructed part by part; a function that returns a record becomes a procedure.
/// - kPostFunctions, with kPostProcedures: a function becomes a procedure with OUT parameters for
///   its
///   value.
/// - kPostOutParameters, with kPostProcedures: they become variables of the program that are copied
///   before and after each call.
/// - kPostShortCircuit, with kPostIf: if the right side may fail or calls a function.
void to_scalars(ProgramTables&, const PostCapabilities&, std::vector<Remark>&);

/// Recursive routines, and the variables of the program that pass the arguments and results of
/// their recursive calls.
struct InnerCalls {
  std::vector<std::uint32_t> group;               ///< by routine; RMP_NONE = not recursive
  std::map<std::uint32_t, std::uint32_t> sent;    ///< by parameter
  std::map<std::uint32_t, std::uint32_t> result;  ///< by routine, of functions
};
/// Within routines of a group, calls of the same group become statements without arguments: values
/// are assigned to the variables before, and results and modified values are copied from them
/// afterwards. Other calls are kept. A call in a position without statements is an error, as above.
void to_statements(ProgramTables&, std::string_view title, const InnerCalls&, std::vector<Remark>&);

}  // namespace robomosp::program_post
