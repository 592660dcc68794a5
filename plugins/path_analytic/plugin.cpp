// SPDX-License-Identifier: Apache-2.0
// Curves in closed form, motion laws and orientations of Cartesian trajectories (layer: plugin).
#include <robomosp/sdk/plugin.h>

#include "makers.h"

namespace robomosp::path_analytic {
namespace {

const rmp_param kCircleParams[] = {
    {"turns", "real", "", "Number of turns, whole or not.", "1", nullptr, 0, 1e6},
};
const rmp_param kConstantSpeedParams[] = {
    {"speed", "real", "m/s", "Speed of the tool along the curve.", "0.1", nullptr, 0, 1e6},
    {"angular_speed", "real", "rad/s", "Greatest speed of turning; the slower of the two counts.",
     "0.5", nullptr, 0, 1e6},
    {"duration", "real", "s", "Time for the whole way, instead of speeds; 0 = by the speeds.", "0",
     nullptr, 0, 1e9},
};

}  // namespace
}  // namespace robomosp::path_analytic

namespace pa = robomosp::path_analytic;

RMP_PLUGIN(
    "org.robomosp.path_analytic", "0.2.0", "Apache-2.0",
    "Lines and arcs, motion laws and orientations.",
    RMP_PROVIDER_NO_PARAMS(pa::LineMaker, "line",
                           "Straight line between two poses; a turn on the spot when their "
                           "positions are the same.",
                           "points=2"),
    RMP_PROVIDER_NO_PARAMS(pa::ArcMaker, "arc",
                           "Part of a circle from the first pose through the second to the third.",
                           "points=3"),
    RMP_PROVIDER(pa::CircleMaker, "circle",
                 "Full turns through three points, starting at the first.", "points=3",
                 pa::kCircleParams),
    RMP_PROVIDER(pa::ConstantSpeedMaker, "constant_speed", "Constant speed.", "",
                 pa::kConstantSpeedParams),
    RMP_PROVIDER_NO_PARAMS(pa::FixedMaker, "fixed", "Keeps the first pose's orientation.", ""),
    RMP_PROVIDER_NO_PARAMS(
        pa::SlerpMaker, "slerp",
        "Turns at a constant rate from the first pose's orientation to the last one's.", ""))
