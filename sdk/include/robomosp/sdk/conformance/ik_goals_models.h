// SPDX-License-Identifier: Apache-2.0
// Mechanisms for inverse kinematics beyond models.h (layer: contract helper for tests,
// header-only).
#pragma once

#include <robomosp/sdk/conformance/mechanisms.h>

namespace robomosp::conformance {

/// KUKA LBR iiwa 14 R820, standard DH: 360/420/400/126 mm, limits 170/120/170/120/170/120/175
/// degrees (KUKA, LBR iiwa specification). Kinematics only.
[[nodiscard]] inline RobotModel iiwa14() {
  const double r = kPi / 2;
  return serial("iiwa14", false,
                {{0, 0.36, 0, -r, -170, 170, {}},
                 {0, 0, 0, r, -120, 120, {}},
                 {0, 0.42, 0, r, -170, 170, {}},
                 {0, 0, 0, -r, -120, 120, {}},
                 {0, 0.4, 0, -r, -170, 170, {}},
                 {0, 0, 0, r, -120, 120, {}},
                 {0, 0.126, 0, 0, -175, 175, {}}});
}

}  // namespace robomosp::conformance
