// SPDX-License-Identifier: Apache-2.0
// Records as variables of their parts, functions as procedures, OUT parameters as variables of the
// program, AND and OR as IF (layer: data processing, program_post).
#pragma once

#include <cstdint>
#include <map>
#include <string_view>
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

/// Routines that call themselves, and the variables of the program by which their calls of each
/// other take and give values.
struct InnerCalls {
  std::vector<std::uint32_t> group;               ///< by routine; RMP_NONE = it is none of them
  std::map<std::uint32_t, std::uint32_t> sent;    ///< by parameter
  std::map<std::uint32_t, std::uint32_t> result;  ///< by routine, of functions
};
/// Within routines of a group, calls of the same group become statements without arguments: values
/// are assigned to the variables before, results and what is changed are copied from them behind.
/// Other calls stay. A call that has no place for statements is an error, as above.
void to_statements(ProgramTables&, std::string_view title, const InnerCalls&, std::vector<Remark>&);

}  // namespace robomosp::program_post
