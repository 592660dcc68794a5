// SPDX-License-Identifier: Apache-2.0
// Members of a world and poses of a robot by name, or why there is none (layer: application, task).
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/text.h"
#include "model/records.h"

namespace robomosp::task {

/// The place of a name in an index; `kind` as in "robot".
template <class Index>
[[nodiscard]] Result<std::size_t> find_member(const Index& index, const std::string& name,
                                              const char* kind) {
  if (const auto it = index.find(name); it != index.end()) return it->second;
  std::vector<std::string> known;
  for (const auto& [key, at] : index) known.push_back(key);
  std::sort(known.begin(), known.end());
  std::string hint = text::did_you_mean(name, known);
  if (hint.empty())
    hint = known.empty() ? "It has none." : "It has " + text::enumerate(known) + ".";
  return error(ErrorCode::unknown_name,
               "the world has no " + std::string(kind) + " " + text::quote(name), hint);
}

/// The joint values of a robot's named pose; `placed` is the robot's name in the world.
[[nodiscard]] inline Result<std::vector<double>> named_pose(const model::Robot& robot,
                                                            const std::string& placed,
                                                            const std::string& name) {
  for (const model::NamedPose& pose : robot.poses)
    if (pose.name == name) return pose.q;
  return error(ErrorCode::unknown_name,
               "robot " + text::quote(placed) + " has no pose " + text::quote(name),
               "Define it with robot.set_pose.");
}

}  // namespace robomosp::task
