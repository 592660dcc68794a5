// SPDX-License-Identifier: Apache-2.0
// Writes the frame and the tool of a cell at each motion (layer: data processing, program_post).
#pragma once

#include <memory>
#include <optional>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/program_tables.h>

namespace robomosp::program_post {

struct CellPlaces {
  std::optional<Pose> frame;  ///< base_T_frame of all targets [m]; empty = the base
  std::optional<Pose> tool;   ///< flange_T_tool of motions without TOOL [m]; empty = the flange
};

/// A copy of the program with FRAME and TOOL of the cell added to its motions: a FRAME of a motion
/// is relative to that of the cell; motions to joint values need none. Texts are those of the
/// program, which must outlive it. Null if there is nothing to add.
[[nodiscard]] std::unique_ptr<ProgramTables> in_cell(const rmp_code&, const CellPlaces&);

}  // namespace robomosp::program_post
