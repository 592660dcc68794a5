// SPDX-License-Identifier: Apache-2.0
// Opening what a window or picture shows: a file, a record of the library, or the result of a
// script, and the run that moves it (layer: application).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

#include "ioci/client/scripts.h"
#include "ioci/core/application.h"

namespace robomosp::ioci {

struct OpenRequest {
  std::string what = {};                 ///< a native file, or a name of the library
  std::filesystem::path script{};        ///< replaces `what`, unless empty
  std::vector<std::string> arguments{};  ///< of the script
  /// Robot and trajectory of a world to simulate; empty = the first of each, if there are any.
  std::vector<std::string> play{};
  bool simulates = true;  ///< false: only a recording of the script moves it
  /// For a picture by <kind>.render, which materials have, too.
  bool is_for_picture = false;
};

struct Opened {
  Handle what;       ///< a world, robot, object or solid; for a picture also a material
  std::string name;  ///< of that record
  std::optional<Handle> recording = std::nullopt;  ///< moves the world's members
  double from = 0, to = 0;                         ///< times of its first and last row [s]
};

/// Loads the record, or runs the script, and simulates by world.inverse_kinematics. A script
/// selects what is shown by returning a record, or a recording of a world; else its last recording
/// of a world is shown. `scripts` may be null if no script is given. Errors: names that no record
/// of the library has, records that cannot be shown, and those of the commands.
/// [the session's thread]
[[nodiscard]] Result<Opened> open_shown(Application&, Session&, Scripts* scripts,
                                        const OpenRequest&);

/// Computes a map of a robot's workspace, "manipulability" or "reachability", by
/// robot.workspace or robot.reachability: the robot shown, or `robot` of a world ("" = its first).
/// Returns the recording. [the session's thread]
[[nodiscard]] Result<Handle> compute_map(Application&, Session&, const Handle& what,
                                         const std::string& map, const std::string& robot);

}  // namespace robomosp::ioci
