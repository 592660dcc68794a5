// SPDX-License-Identifier: Apache-2.0
// The frame and the tool of a cell, written at each motion (layer: data processing, program_post).
#pragma once

#include <memory>
#include <optional>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/program_tables.h>

namespace robomosp::program_post {

struct CellPlaces {
  std::optional<Pose> frame;  ///< base_T_frame that all targets are in [m]; empty = the base
  std::optional<Pose> tool;   ///< flange_T_tool of motions without TOOL [m]; empty = the flange
};

/// A copy of the program whose motions say by FRAME and TOOL what the cell says: a FRAME of their
/// own is in that of the cell; motions to joint values need none. Texts stay those of the program,
/// which outlives it. Null where there is nothing to say.
[[nodiscard]] std::unique_ptr<ProgramTables> in_cell(const rmp_code&, const CellPlaces&);

/// The pose itself, or empty where it moves nothing: 1e-9 m, 1e-9 of a direction.
[[nodiscard]] std::optional<Pose> unless_identity(const Pose&);

}  // namespace robomosp::program_post
