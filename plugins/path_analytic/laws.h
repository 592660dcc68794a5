// SPDX-License-Identifier: Apache-2.0
// What motion laws share: speeds and limits as shares of the way (layer: plugin).
#pragma once

#include "factories.h"

namespace robomosp::path_analytic {

struct EndRates {
  double start = 0, end = 0;  ///< [1/s]
};
/// Of the parameters start_speed and end_speed.
Result<EndRates> end_rates(const LawTask&, const Params&);
/// Of speed and angular_speed [1/s], of acceleration and angular_acceleration [1/s^2]: the slower
/// of moving and turning.
Result<double> greatest_rate(const LawTask&, const Params&);
Result<double> greatest_acceleration(const LawTask&, const Params&);

}  // namespace robomosp::path_analytic
