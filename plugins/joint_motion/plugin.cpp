// SPDX-License-Identifier: Apache-2.0
// Joint motions: point to point, splines through joint vectors, time-optimal from any state to any
// state (layer: plugin).
#include <robomosp/sdk/plugin.h>

#include "task.h"

namespace robomosp::joint_motion {
namespace {

const rmp_param kSpeedShare{"speed_share", "real",  "", "Share of the velocity limits to use.",
                            "1",           nullptr, 0,  1},
    kVelocity{"velocity",
              "real[]",
              "",
              "Limits of this motion, one for all joints or one per joint [rad/s or m/s]; lower "
              "limits of the robot take precedence.",
              "{}",
              nullptr,
              1,
              0},
    kAcceleration{"acceleration", "real[]", "", "The same for accelerations [rad/s^2 or m/s^2].",
                  "{}",           nullptr,  1,  0},
    kJerk{"jerk", "real[]", "", "The same for jerks [rad/s^3 or m/s^3].", "{}", nullptr, 1, 0};

const rmp_param kEndVelocity{"end_velocity",
                             "real[]",
                             "",
                             "Velocity of each joint [rad/s or m/s], passed on to the next joint "
                             "segment; at rest if omitted.",
                             "{}",
                             nullptr,
                             1,
                             0},
    kEndAcceleration{"end_acceleration",
                     "real[]",
                     "",
                     "The same for accelerations [rad/s^2 or m/s^2].",
                     "{}",
                     nullptr,
                     1,
                     0};

const rmp_param kPtpParams[] = {
    {"profile", "enum", "", "Speed profile.", "trapezoidal", "trapezoidal|s_curve|quintic", 1, 0},
    {"joints_arrive", "enum", "",
     "Joints move together on a straight line in joint space, or each as fast as it can.",
     "together", "together|each", 1, 0},
    {"duration", "real", "s", "Duration of the motion; 0 = as short as the limits allow.", "0",
     nullptr, 0, 1e9},
    kSpeedShare,
    kVelocity,
    kAcceleration,
    kJerk};
const rmp_param kSplineParams[] = {
    {"degree", "enum", "",
     "Cubic: continuous acceleration; quintic: two more continuous derivatives.", "3", "3|5", 1, 0},
    {"ends", "enum", "",
     "clamped: at rest, or with the rates given there; natural: free; not_a_knot: one polynomial "
     "over the first and the last pieces; periodic: the last joint vector is the first, and the "
     "motion continues there as it began.",
     "clamped", "clamped|natural|not_a_knot|periodic", 1, 0},
    {"times", "real[]", "s",
     "Times of the joint vectors; without them, as fast as the limits allow.", "{}", nullptr, 1, 0},
    kEndVelocity,
    kEndAcceleration,
    kSpeedShare,
    kVelocity,
    kAcceleration,
    kJerk};
const rmp_param kTimeOptimalParams[] = {
    {"duration", "real", "s", "Duration of the motion; 0 = as short as the limits allow.", "0",
     nullptr, 0, 1e9},
    kEndVelocity,
    kEndAcceleration,
    kSpeedShare,
    kVelocity,
    kAcceleration,
    kJerk};

}  // namespace
}  // namespace robomosp::joint_motion

namespace jm = robomosp::joint_motion;

RMP_PLUGIN(
    "org.robomosp.joint_motion", "0.1.0", "Apache-2.0", "Motions of all joints.",
    RMP_PROVIDER(jm::PtpFactory, "ptp", "From joint vector to joint vector, at rest in each.",
                 "points=2+", jm::kPtpParams),
    RMP_PROVIDER(jm::SplineFactory, "joint_spline",
                 "A spline through joint vectors, at given times or as fast as the limits "
                 "allow.",
                 "points=2+", jm::kSplineParams),
    RMP_PROVIDER(jm::TimeOptimalFactory, "time_optimal",
                 "The fastest motion with limited jerk from any state of motion to any other.",
                 "points=2", jm::kTimeOptimalParams))
