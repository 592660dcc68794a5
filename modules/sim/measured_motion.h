// SPDX-License-Identifier: Apache-2.0
// What the model says of a measured motion (layer: application, sim). [any thread]
#pragma once

#include <optional>
#include <vector>

#include "recording/recording.h"
#include "sim/simulate.h"
#include "sim/tip_load.h"

namespace robomosp::sim {

/// Samples that the window of a fit may hold.
inline constexpr std::size_t kMostInWindow = 1000;

/// Values, slopes and curvatures of noisy samples: at every time the parabola that fits best what
/// is within `window` [s] about it, by least squares, also where samples are missing or unevenly
/// far apart (Savitzky and Golay 1964 for even ones). NaN where fewer than five finite samples are
/// there. An error where a window holds more than kMostInWindow.
struct Fitted {
  std::vector<double> value, rate, second;
};
[[nodiscard]] Result<Fitted> fit_parabolas(const std::vector<double>& time,
                                           const std::vector<double>& values, double window);

/// A recording of the motor torques tau1.. that the inverse dynamics of the recording's robot gives
/// for its joints q1.. as measured. Velocities are those measured, else derivatives, and so are
/// accelerations: of fitted parabolas where `window` [s] > 0, else through five points. The columns
/// wrench1 to wrench6 or `load` count as in with_quantities().
[[nodiscard]] Result<recording::RecordingPtr> torques_of_motion(
    const Simulator&, const recording::Recording& measured, double window, Progress&,
    const std::optional<TipLoad>& load = std::nullopt);

}  // namespace robomosp::sim
