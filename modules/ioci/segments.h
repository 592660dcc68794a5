// SPDX-License-Identifier: Apache-2.0
// Segments of trajectories as tables (layer: application, ioci).
#pragma once

#include "ioci/command.h"
#include "model/records.h"

namespace robomosp::ioci {

/// `{shape = "line", points = {...}, speed = "50 mm/s", law = "trapezoidal", orientation = ...,
/// transition = ...}` or `{trajectory = "weld", placement = ...}`. What is none of the named fields
/// is a parameter of the shape, its law or its orientation, and is checked against their tables.
[[nodiscard]] Result<model::TrajectorySegment> read_segment(const CommandContext&, const Value&,
                                                            const std::string& path);
/// Joint values of a robot that is not known yet: numbers, or texts with units.
[[nodiscard]] Result<std::vector<double>> read_joint_vector(const Value&, const std::string& path);
[[nodiscard]] Value segment_value(const document::Snapshot&, const model::TrajectorySegment&);

/// What read_segment understands, for the help of commands.
inline constexpr const char* kSegmentDoc =
    "A segment is a table: shape (a curve, see provider.list(\"curve\"), or a joint motion, see "
    "provider.list(\"joint_segment\")), points (poses, in the trajectory's frame) or joints (joint "
    "vectors), law (how it is run, see provider.list(\"motion_law\")), orientation (see "
    "provider.list(\"orientation\")), transition (\"none\", or {distance, speed}) and the "
    "parameters of these. Or a stored trajectory run again: trajectory, placement.";

}  // namespace robomosp::ioci
