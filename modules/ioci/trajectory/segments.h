// SPDX-License-Identifier: Apache-2.0
// Segments of trajectories as tables (layer: application, ioci).
#pragma once

#include <functional>
#include <memory>

#include "ioci/core/command.h"
#include "model/records.h"

namespace robomosp::motion {
class Path;
}

namespace robomosp::ioci {

/// Reads `{shape = "line", points = {...}, speed = "50 mm/s", law = "trapezoidal", orientation =
/// ..., transition = ...}` or `{trajectory = "weld", placement = ...}`. Other fields are parameters
/// of the shape, its law or its orientation, and are checked against their tables.
[[nodiscard]] Result<model::TrajectorySegment> read_segment(const CommandContext&, const Value&,
                                                            const std::string& path);
/// The fields of segments that are given as they are declared, without those with a special form
/// (shape, laws, points, joints, transition, trajectory and placement).
[[nodiscard]] const Schema& declared_segment_params();
/// Joint values of a robot that is not known yet: numbers, or texts with units.
[[nodiscard]] Result<std::vector<double>> read_joint_vector(const Value&, const std::string& path);
/// The segment with the fields of the table changed: a new shape drops the parameters of the old
/// one, a new law or orientation those of the old ones; everything else stays.
[[nodiscard]] Result<model::TrajectorySegment> update_segment(const CommandContext&,
                                                              const model::TrajectorySegment&,
                                                              const Value&,
                                                              const std::string& path);
[[nodiscard]] Value segment_value(const document::Snapshot&, const model::TrajectorySegment&);

/// True if the segment moves joints; such segments have times and positions only with a robot.
[[nodiscard]] bool moves_joints(const CommandContext&, const model::TrajectorySegment&);
/// Reports coincident points, gaps and bad speeds before the first run (motion::Path::check).
Result<void> check_trajectory(const CommandContext&, const std::string& name,
                              const model::Trajectory&);
/// The path of the checked argument `id`.
[[nodiscard]] Result<std::shared_ptr<const motion::Path>> path_of(const CommandContext&,
                                                                  const Map& args);
/// Changes the trajectory of the checked argument `id` in the command's transaction, and checks it.
[[nodiscard]] Result<Value> change_trajectory(
    CommandContext&, const Map& args, const std::function<Result<void>(model::Trajectory&)>&);
/// A trajectory "stroke" of one line, then `rest`: for examples of commands.
[[nodiscard]] std::string with_stroke(const char* rest);

/// What read_segment understands, for the help of commands.
inline constexpr const char* kSegmentDoc =
    "A segment is a table: shape (a curve, see provider.list(\"curve\"), or a joint motion, see "
    "provider.list(\"joint_segment\")), points (poses, in the trajectory's frame) or joints (joint "
    "vectors), law (its motion law, see provider.list(\"motion_law\")), orientation (see "
    "provider.list(\"orientation\")), turning (a separate motion law for the rotation, its "
    "parameters in a table with its name), transition (\"none\", or {distance, speed}) and the "
    "parameters of these. Or a stored trajectory to run: trajectory, placement.";

}  // namespace robomosp::ioci
