// SPDX-License-Identifier: Apache-2.0
// A trace as a straight program, for controllers that have neither routines nor records nor
// recursion (layer: data processing, program).
#pragma once

#include <memory>

#include <robomosp/sdk/program_tables.h>
#include <robomosp/sdk/result.h>

#include "program/trace.h"

namespace robomosp::program {

/// The entries of a trace as the statements of one program without variables: MOVE with constant
/// targets and all attributes that differ from the system's, signals := values, WAIT, WRITE, PAUSE,
/// HALT. It has the types, fields, signals and files of the program traced, the spans of the lines
/// that the entries come from, the structured form and three-address code. Its trace is the trace
/// that it was made from, and flattening it again gives the same. Entries of other processes than
/// the program itself are an error.
Result<std::unique_ptr<ProgramTables>> flatten(const Trace&);

}  // namespace robomosp::program
