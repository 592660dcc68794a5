// SPDX-License-Identifier: Apache-2.0
// The mechanisms of the suites by their names, for programs that are asked to use some (layer:
// contract helper for tests, header-only).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/conformance/arms.h>
#include <robomosp/sdk/conformance/mechanisms.h>
#include <robomosp/sdk/conformance/models.h>

namespace robomosp::conformance {

struct NamedModel {
  std::string_view name;
  RobotModel (*make)();
};

/// Names are those of the functions that make them.
[[nodiscard]] inline const std::vector<NamedModel>& named_models() {
  static const std::vector<NamedModel> all{{"puma560", puma560},
                                           {"puma560_modified", puma560_modified},
                                           {"pa10", pa10},
                                           {"pa10_nus", pa10_nus},
                                           {"panda", panda},
                                           {"planar_rods", planar_rods},
                                           {"scara", scara},
                                           {"tree", tree},
                                           {"floating_manipulator", floating_manipulator},
                                           {"four_bar", [] { return four_bar(4, 1, 3, 3); }},
                                           {"long_chain", [] { return long_chain(40); }},
                                           {"kr5", kr5},
                                           {"irb140", irb140},
                                           {"ur5", ur5},
                                           {"iiwa14", iiwa14},
                                           {"skew_arm", skew_arm},
                                           {"meeting_arm", meeting_arm},
                                           {"parallel_first_arm", parallel_first_arm}};
  return all;
}

[[nodiscard]] inline std::optional<RobotModel> named_model(std::string_view name) {
  for (const NamedModel& m : named_models())
    if (m.name == name) return m.make();
  return std::nullopt;
}

}  // namespace robomosp::conformance
