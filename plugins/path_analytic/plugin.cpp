// SPDX-License-Identifier: Apache-2.0
// Curves in closed form, motion laws and orientations of Cartesian trajectories (layer: plugin).
#include <robomosp/sdk/plugin.h>

#include "factories.h"

namespace robomosp::path_analytic {
namespace {

const rmp_param kCircleParams[] = {
    {"turns", "real", "", "Number of turns, whole or not.", "1", nullptr, 0, 1e6},
};
const rmp_param kCentre{"centre", "real[]", "m", "A point on the axis: x, y, z.",
                        nullptr,  nullptr,  1,   0};
const rmp_param kAxis{"axis", "real[]", "", "Direction of the axis.", "{0, 0, 1}", nullptr, 1, 0};
const rmp_param kArcCentreParams[] = {
    kCentre,
    kAxis,
    {"angle", "real", "rad", "Angle about the axis; negative for the other direction.", nullptr,
     nullptr, -1e6, 1e6},
};
const rmp_param kHelixParams[] = {
    kCentre,
    kAxis,
    {"turns", "real", "", "Number of turns; negative for the other direction.", "1", nullptr, -1e6,
     1e6},
    {"pitch", "real", "m", "Distance along the axis per turn.", nullptr, nullptr, -1e6, 1e6},
};

const rmp_param kSpeed{"speed", "real",  "m/s", "Maximum speed of the tool along the curve.",
                       "0.1",   nullptr, 0,     1e6},
    kAngularSpeed{
        "angular_speed", "real",  "rad/s", "Greatest angular speed; the slower of the two counts.",
        "0.5",           nullptr, 0,       1e6},
    kAcceleration{"acceleration", "real", "m/s^2", "Greatest acceleration along the curve.", "1",
                  nullptr,        0,      1e9},
    kAngularAcceleration{"angular_acceleration",
                         "real",
                         "rad/s^2",
                         "Greatest angular acceleration.",
                         "5",
                         nullptr,
                         0,
                         1e9},
    kStartSpeed{"start_speed", "real", "m/s", "Speed at the start.", "0", nullptr, 0, 1e6},
    kEndSpeed{"end_speed", "real", "m/s", "Speed at the end.", "0", nullptr, 0, 1e6},
    kDuration{"duration", "real",  "s", "Duration of the motion; 0 = as short as the limits allow.",
              "0",        nullptr, 0,   1e9};

const rmp_param kSpeedParams[] = {kSpeed, kAngularSpeed, kDuration};
const rmp_param kConstantAccelerationParams[] = {
    kAcceleration,
    kAngularAcceleration,
    kStartSpeed,
    kEndSpeed,
    {"start_ratio", "real", "", "Speed at the start over the mean speed, if a duration is given.",
     "0", nullptr, 0, 2},
    kDuration};
const rmp_param kTrapezoidalParams[] = {
    kSpeed, kAngularSpeed, kAcceleration, kAngularAcceleration, kStartSpeed, kEndSpeed, kDuration};
const rmp_param kSCurveParams[] = {
    kSpeed,
    kAngularSpeed,
    kAcceleration,
    kAngularAcceleration,
    {"jerk", "real", "m/s^3", "Greatest jerk along the curve.", "10", nullptr, 0, 1e12},
    {"angular_jerk", "real", "rad/s^3", "Greatest angular jerk.", "50", nullptr, 0, 1e12},
    kStartSpeed,
    kEndSpeed,
    kDuration};
const rmp_param kCycloidalParams[] = {kSpeed, kAngularSpeed, kAcceleration, kAngularAcceleration,
                                      kDuration};

const rmp_param kSlerpParams[] = {
    {"from", "real", "", "Path parameter at which the rotation begins.", "0", nullptr, 0, 1},
    {"to", "real", "", "Path parameter at which it ends.", "1", nullptr, 0, 1},
    {"ease", "enum", "",
     "Rotation in between: in proportion to the path, or smoothly from rest to rest.", "way",
     "way|smooth", 1, 0},
};
const rmp_param kAnglesParams[] = {
    {"first", "real[]", "rad", "Roll, pitch, yaw at the start; by default those of the first pose.",
     "{}", nullptr, 1, 0},
    {"last", "real[]", "rad",
     "Roll, pitch, yaw at the end, including full turns; by default those of the last pose, each "
     "by the shortest rotation.",
     "{}", nullptr, 1, 0},
};
const rmp_param kTangentParams[] = {
    {"axis", "enum", "", "The tool's axis that follows the tangent.", "x", "x|y|z", 1, 0},
    {"up", "real[]", "",
     "Reference direction for the axis before it (z for x); by default that of the first pose.",
     "{}", nullptr, 1, 0},
};

}  // namespace
}  // namespace robomosp::path_analytic

namespace pa = robomosp::path_analytic;

RMP_PLUGIN(
    "org.robomosp.path_analytic", "0.2.0", "Apache-2.0",
    "Lines and arcs, motion laws and orientations.",
    RMP_PROVIDER_NO_PARAMS(
        pa::LineFactory, "line",
        "Straight line between two poses; a rotation in place if their positions are equal.",
        "points=2"),
    RMP_PROVIDER_NO_PARAMS(pa::ArcFactory, "arc",
                           "Part of a circle from the first pose through the second to the third.",
                           "points=3"),
    RMP_PROVIDER(pa::CircleFactory, "circle",
                 "Full turns through three points, starting at the first.", "points=3",
                 pa::kCircleParams),
    RMP_PROVIDER(pa::ArcCentreFactory, "arc_centre", "Arc about a centre and an axis, by an angle.",
                 "points=1", pa::kArcCentreParams),
    RMP_PROVIDER(pa::HelixFactory, "helix", "Helix about a centre and an axis.", "points=1",
                 pa::kHelixParams),
    RMP_PROVIDER(pa::ConstantSpeedFactory, "constant_speed", "Constant speed.", "",
                 pa::kSpeedParams),
    RMP_PROVIDER(pa::ConstantAccelerationFactory, "constant_acceleration",
                 "The speed changes uniformly from start_speed to end_speed; without an end_speed, "
                 "by the acceleration.",
                 "", pa::kConstantAccelerationParams),
    RMP_PROVIDER(pa::TrapezoidalFactory, "trapezoidal",
                 "Trapezoidal: constant acceleration, constant speed, constant deceleration.", "",
                 pa::kTrapezoidalParams),
    RMP_PROVIDER(pa::SCurveFactory, "s_curve",
                 "Trapezoidal with limited jerk, so that the acceleration is continuous.", "",
                 pa::kSCurveParams),
    RMP_PROVIDER(pa::CubicFactory, "cubic", "A polynomial of third degree in time.", "",
                 pa::kTrapezoidalParams),
    RMP_PROVIDER(pa::QuinticFactory, "quintic",
                 "A polynomial of fifth degree in time: without acceleration at the ends.", "",
                 pa::kTrapezoidalParams),
    RMP_PROVIDER(pa::CycloidalFactory, "cycloidal",
                 "x - sin(2 pi x) / (2 pi): at rest at both ends, with continuous acceleration.",
                 "", pa::kCycloidalParams),
    RMP_PROVIDER_NO_PARAMS(pa::FixedFactory, "fixed", "Keeps the first pose's orientation.", ""),
    RMP_PROVIDER(pa::SlerpFactory, "slerp",
                 "Rotates about one axis from the first pose's orientation to the last one's.", "",
                 pa::kSlerpParams),
    RMP_PROVIDER_NO_PARAMS(pa::SlerpPointsFactory, "slerp_points",
                           "Rotates from point to point, each at a constant rate.", ""),
    RMP_PROVIDER_NO_PARAMS(pa::SquadFactory, "squad",
                           "Rotates through every point's orientation with a continuous rate.", ""),
    RMP_PROVIDER(pa::AnglesFactory, "angles",
                 "Roll, pitch and yaw change in proportion, each by the given number of turns.", "",
                 pa::kAnglesParams),
    RMP_PROVIDER(pa::TangentFactory, "tangent", "One axis of the tool follows the tangent.", "",
                 pa::kTangentParams))
