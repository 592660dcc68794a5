// SPDX-License-Identifier: Apache-2.0
// Steps of tasks, and the frames, lights, tasks, signals and attachments of worlds, to and from
// values (layer: application, ioci only).
#pragma once

#include <string>
#include <vector>

#include "ioci/core/command.h"

namespace robomosp::ioci {

/// Help for steps: each kind with its fields, from their declarations.
[[nodiscard]] std::string step_doc();

/// A step from `{step = "move", robot = "left", pose = "home"}`, followed by the steps inside a
/// block (`steps`); parents are indices relative to the first step, which has parent -1.
[[nodiscard]] Result<std::vector<model::TaskStep>> read_steps(const CommandContext&, const Value&,
                                                              const std::string& path);
/// The steps as a flat list; `number` and `parent` count from 1, parent 0 is the task.
[[nodiscard]] Value steps_value(const document::Snapshot&, const model::Task&);
/// frames, lights, tasks, signals, attachments.
void set_members(Map& out, const document::Snapshot&, const model::World&);

}  // namespace robomosp::ioci
