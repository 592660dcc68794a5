// SPDX-License-Identifier: Apache-2.0
// Passes from program tables to program tables: constructs that a target lacks are rewritten with
// those it has (layer: data processing, program_post).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/program_tables.h>

#include "program_post/remark.h"

namespace robomosp::program_post {

struct Legal {
  std::unique_ptr<ProgramTables> tables;  ///< texts are those of the program, which must outlive
                                          ///< them
  std::vector<Remark> remarks;
  std::size_t parts = 0;  ///< number of parts besides the program itself
};

struct LegaliseOptions {
  std::span<const PostPoint> points;  ///< known points of the program (points.h), for arcs
  double chord_mm = 0.1;              ///< greatest deviation of straight pieces from an arc
  std::size_t recursion_depth = 32;   ///< greatest depth of recursion, where loops replace it
  std::size_t parts = 0;              ///< approximate number of programs it is split into
                                      ///< (parts.h); 0 = one
  std::string_view name = "part";     ///< prefix of their names
};

/// A copy of the structured program's tables, without three-address code. Texts are those of the
/// program, which must outlive it. Linear.
[[nodiscard]] std::unique_ptr<ProgramTables> copied_tables(const rmp_code& code);

/// A copy of the structured program, rewritten for the capabilities of a target:
/// - ACT_ROB is removed if all motions are of one robot (robots.h);
/// - TEACH to assignments (taught.h);
/// - circles and smooth paths to straight pieces (arcs.h);
/// - routines that call themselves to loops with a stack (recursion.h);
/// - records to variables, functions to procedures, OUT parameters to variables, AND and OR to IF,
///   values that a call changes to variables (scalars.h);
/// - CASE to IF, ELSIF to nested IF, FOR to WHILE, LOOP to WHILE, REPEAT and EXIT to jumps.
/// Each row keeps the span of its original. Three-address code is not copied. Linear.
[[nodiscard]] Legal legalise(const rmp_code& code, const PostCapabilities& capabilities,
                             const LegaliseOptions& options = {});

/// True if legalise() needs points: the program has circles or paths that the target lacks.
[[nodiscard]] bool wants_points(const rmp_code& code, const PostCapabilities& capabilities);

}  // namespace robomosp::program_post
