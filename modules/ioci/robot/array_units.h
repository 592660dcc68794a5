// SPDX-License-Identifier: Apache-2.0
// Units of arrays with one number for each joint: one unit where all joints share it, else one for
// each entry (of matrices: column), such as "rad, m, rad" (layer: application). Internal to
// modules/ioci.
#pragma once

#include <string>
#include <string_view>

#include <robomosp/sdk/robot_model.h>

#include "model/records.h"

namespace robomosp::ioci {

/// Of configurations q: "rad", "m", or a list; the four numbers of a quaternion are in "1".
[[nodiscard]] std::string joint_array_unit(const RobotModel& model);
/// The same of a record. `degrees`: turning joints are in "deg".
[[nodiscard]] std::string joint_array_unit(const model::Robot& robot, bool degrees = false);
/// Of rates and accelerations, dof() entries: `per` is "/s" or "/s^2".
[[nodiscard]] std::string rate_array_unit(const RobotModel& model, std::string_view per);
/// Of the residual of the loops, loop_rows() entries: "m", or a list.
[[nodiscard]] std::string residual_array_unit(const RobotModel& model);
/// Of torques and forces, dof() entries: "N m", "N", or a list.
[[nodiscard]] std::string force_array_unit(const RobotModel& model);

}  // namespace robomosp::ioci
