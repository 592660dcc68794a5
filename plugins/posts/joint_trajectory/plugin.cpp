// SPDX-License-Identifier: Apache-2.0
// Plugin post_joint_trajectory: programs to joint trajectories of ROS 2 behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "joint_trajectory.h"

RMP_PLUGIN("org.robomosp.post_joint_trajectory", "1.0.0", "Apache-2.0",
           "Programs to joint trajectories of ROS 2.",
           RMP_PROVIDER_NO_PARAMS(robomosp::post::JointTrajectory, "joint_trajectory",
                                  "Joint trajectories of ROS 2 (YAML and JSON).", ""))
