// SPDX-License-Identifier: Apache-2.0
// Providers "computed_torque", "pd_gravity", "joint_pid" and "operational_space" (controllers)
// (layer: plugin).
#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/plugin.h>

#include "controllers.h"

namespace robomosp::control {
namespace {

constexpr const char* kFrequencyDoc =
    "How fast errors vanish: natural frequency of the closed loop.";
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
    {"kd", "real[]", "", "Gains of the velocity error [1/s], likewise.", "{}", nullptr, 1, 0},
    {"friction", "bool", "", kFrictionDoc, "true", nullptr, 1, 0},
};
const rmp_param kPdParams[] = {
    {"frequency", "real", "rad/s",
     "Natural frequency of a joint alone, with the others held in the zero position.", "30",
     nullptr, 0, 1e6},
    {"damping", "real", "", kDampingDoc, "1", nullptr, 0, 100},
    {"kp", "real[]", "",
     "Gains of the position error [N m/rad or N/m], one for all or one per joint; replace the "
     "frequency.",
     "{}", nullptr, 1, 0},
    {"kd", "real[]", "", "Gains of the velocity error [N m s/rad or N s/m], likewise.", "{}",
     nullptr, 1, 0},
};
const rmp_param kPidParams[] = {
    {"frequency", "real", "rad/s",
     "Natural frequency of a joint alone, with the others held in the zero position.", "30",
     nullptr, 0, 1e6},
    {"damping", "real", "", kDampingDoc, "1", nullptr, 0, 100},
    {"kp", "real[]", "",
     "Gains of the position error [N m/rad or N/m], one for all or one per joint; replace the "
     "frequency.",
     "{}", nullptr, 1, 0},
    {"kd", "real[]", "", "Gains of the velocity error [N m s/rad or N s/m], likewise.", "{}",
     nullptr, 1, 0},
    {"ki", "real[]", "", "Gains of the error's integral [N m/(rad s) or N/(m s)], likewise.", "{}",
     nullptr, 1, 0},
};
const rmp_param kOperationalSpaceParams[] = {
    {"frequency", "real", "rad/s", kFrequencyDoc, "30", nullptr, 0, 1e6},
    {"damping", "real", "", kDampingDoc, "1", nullptr, 0, 100},
    {"task", "enum", "", "What of the tip is controlled.", "pose", "pose|position", 1, 0},
    {"posture_frequency", "real", "rad/s",
     "How fast the joints return to their reference in directions that leave the tip at rest.",
     "10", nullptr, 0, 1e6},
    {"friction", "bool", "", kFrictionDoc, "true", nullptr, 1, 0},
};

}  // namespace
}  // namespace robomosp::control

RMP_PLUGIN(
    "org.robomosp.control", "0.1.0", "Apache-2.0",
    "Controllers: torques from the state of a mechanism and its reference.",
    RMP_PROVIDER(robomosp::control::ComputedTorque, "computed_torque",
                 "Inverse dynamics with linear feedback: errors vanish as chosen.",
                 "joint_space,model_based", robomosp::control::kComputedTorqueParams),
    RMP_PROVIDER(robomosp::control::PdGravity, "pd_gravity",
                 "Proportional and derivative feedback with the weight compensated.", "joint_space",
                 robomosp::control::kPdParams),
    RMP_PROVIDER(robomosp::control::JointPid, "joint_pid",
                 "A PID controller for each joint, with anti-windup; without a dynamics model.",
                 "joint_space,integral", robomosp::control::kPidParams),
    RMP_PROVIDER(robomosp::control::OperationalSpace, "operational_space",
                 "The tip is driven as a unit mass, the posture in the remaining freedoms.",
                 "cartesian,model_based", robomosp::control::kOperationalSpaceParams))
