// SPDX-License-Identifier: Apache-2.0
// What a checked run has to show: sentences, the tool's path with its faults in colours, and joints
// against their limits over time (layer: application, program_check). [any thread]
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>

#include <robomosp/sdk/program_code.h>
#include <robomosp/sdk/render.h>

#include "program_check/check_program.h"
#include "recording/plot/plot.h"

namespace robomosp::program_check {

/// Name of a file of the program; "" = it has no such file.
[[nodiscard]] std::string file_name(const rmp_code&, std::uint32_t file);
/// Name of a routine; "" = the program has no such routine.
[[nodiscard]] std::string routine_name(const rmp_code&, std::uint32_t routine);
/// "lift.irl:8:3"
[[nodiscard]] std::string where_of(const rmp_code&, const rmp_span&);
/// `lift.irl:8:3: error: reach: robot "ur5" does not reach ... . Move it. (t = 3 s, run 2)`
[[nodiscard]] std::string sentence_of(const rmp_code&, const Fault&);
/// Label of a place in a picture: `line 7`, `lines 7, 12 and 18`, or for more than five `lines 7,
/// 9, 12, 18 and 3 more`.
[[nodiscard]] std::string lines_text(const std::set<std::uint32_t>& lines);
/// At most about so many bytes, cut between words, with the number of words that were left out.
[[nodiscard]] std::string shortened(std::string_view, std::size_t most);

/// A picture shows the time of this fault: the first that has a place; null = none.
[[nodiscard]] const Fault* shown_fault(const Check&);
/// Draws the tool's path in a scene of the run's world: green where it is good, other colours where
/// it has a fault, with labels at the worst places. Returns how many places have no label, since
/// there would be too many.
std::size_t mark_run(render::Scene&, const CheckedProgram&);
/// The fault, and the number of others; the picture breaks it into lines. `unnamed`: of mark_run().
[[nodiscard]] std::string caption_of(const CheckedProgram&, const Fault&, std::size_t unnamed);
/// Joints against their limits and the clearance over time, with faults as stretches at the lines
/// that have them. An error if no joint has limits and nothing can touch.
[[nodiscard]] Result<recording::Plot> limits_plot(const CheckedProgram&);

}  // namespace robomosp::program_check
