// SPDX-License-Identifier: Apache-2.0
// Providers "computed_torque", "pd_gravity", "joint_pid" and "operational_space" (controllers)
// (layer: plugin).
#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/plugin.h>

#include "controllers.h"

namespace robomosp::control {
namespace {

constexpr const char* kFrequencyDoc =
    "Natural frequency of the closed loop: how fast errors vanish.";
constexpr const char* kDampingDoc = "Damping ratio of the closed loop; 1 = no overshoot.";
constexpr const char* kFrictionDoc =
    "Whether joint friction is compensated: viscous friction of the velocity, Coulomb friction of "
    "the desired velocity.";

const rmp_param kComputedTorqueParams[] = {
    {"frequency", "real", "rad/s", kFrequencyDoc, "30", nullptr, 0, 1e6},
    {"damping", "real", "", kDampingDoc, "1", nullptr, 0, 100},
    {"kp", "real[]", "",
     "Gains of the position error [1/s^2], one for all or one per joint; replace the frequency.",
     "{}", nullptr, 1, 0},
    {"kd", "real[]", "", "Gains of the velocity error [1/s], one for all or one per joint.", "{}",
     nullptr, 1, 0},
    {"friction", "bool", "", kFrictionDoc, "true", nullptr, 1, 0},
};
const rmp_param kPdParams[] = {
    {"frequency", "real", "rad/s",
     "Natural frequency of a single joint, with the others held in the zero position.", "30",
     nullptr, 0, 1e6},
    {"damping", "real", "", kDampingDoc, "1", nullptr, 0, 100},
    {"kp", "real[]", "",
     "Gains of the position error [N m/rad or N/m], one for all or one per joint; replace the "
     "frequency.",
     "{}", nullptr, 1, 0},
    {"kd", "real[]", "",
     "Gains of the velocity error [N m s/rad or N s/m], one for all or one per joint.", "{}",
     nullptr, 1, 0},
};
const rmp_param kPidParams[] = {
    {"frequency", "real", "rad/s",
     "Natural frequency of a single joint, with the others held in the zero position.", "30",
     nullptr, 0, 1e6},
    {"damping", "real", "", kDampingDoc, "1", nullptr, 0, 100},
    {"kp", "real[]", "",
     "Gains of the position error [N m/rad or N/m], one for all or one per joint; replace the "
     "frequency.",
     "{}", nullptr, 1, 0},
    {"kd", "real[]", "",
     "Gains of the velocity error [N m s/rad or N s/m], one for all or one per joint.", "{}",
     nullptr, 1, 0},
    {"ki", "real[]", "",
     "Gains of the integral of the error [N m/(rad s) or N/(m s)], one for all or one per joint.",
     "{}", nullptr, 1, 0},
};
const rmp_param kOperationalSpaceParams[] = {
    {"frequency", "real", "rad/s", kFrequencyDoc, "30", nullptr, 0, 1e6},
    {"damping", "real", "", kDampingDoc, "1", nullptr, 0, 100},
    {"task", "enum", "", "Controlled quantities of the tip.", "pose", "pose|position", 1, 0},
    {"posture_frequency", "real", "rad/s",
     "Rate at which the joints return to their reference as far as the tip leaves them free.", "10",
     nullptr, 0, 1e6},
    {"friction", "bool", "", kFrictionDoc, "true", nullptr, 1, 0},
};

}  // namespace
}  // namespace robomosp::control

RMP_PLUGIN(
    "org.robomosp.control", "0.1.0", "Apache-2.0",
    "Controllers: torques from the state of a mechanism and its reference.",
    RMP_PROVIDER(robomosp::control::ComputedTorque, "computed_torque",
                 "Inverse dynamics with linear feedback: errors vanish at the chosen rate.",
                 "joint_space,model_based", robomosp::control::kComputedTorqueParams),
    RMP_PROVIDER(robomosp::control::PdGravity, "pd_gravity",
                 "Proportional and derivative feedback with the weight compensated.", "joint_space",
                 robomosp::control::kPdParams),
    RMP_PROVIDER(robomosp::control::JointPid, "joint_pid",
                 "A PID controller for each joint, with anti-windup and without a dynamic model.",
                 "joint_space,integral", robomosp::control::kPidParams),
    RMP_PROVIDER(robomosp::control::OperationalSpace, "operational_space",
                 "The tip is driven like a unit mass, the posture in the remaining freedom.",
                 "cartesian,model_based", robomosp::control::kOperationalSpaceParams))
