// SPDX-License-Identifier: Apache-2.0
// Shared by motion laws: speeds and limits relative to the path length (layer: plugin).
#pragma once

#include "factories.h"

namespace robomosp::path_analytic {

struct EndRates {
  double start = 0, end = 0;  ///< [1/s]
};
/// From the parameters start_speed and end_speed.
Result<EndRates> end_rates(const LawTask&, const Params&);
/// From speed and angular_speed [1/s], from acceleration and angular_acceleration [1/s^2]: the
/// slower of translation and rotation.
Result<double> greatest_rate(const LawTask&, const Params&);
Result<double> greatest_acceleration(const LawTask&, const Params&);

}  // namespace robomosp::path_analytic
