// SPDX-License-Identifier: Apache-2.0
// Columns computed from those of a recording: rates, power, energies, the tool's motion and force,
// utilisation of the limits, expressions (layer: application, sim).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "recording/recording.h"
#include "sim/simulate.h"
#include "sim/tip_load.h"

namespace robomosp::sim {

/// Sets the limits of the columns q, qd, qdd, qddd and tau of joints of one coordinate.
void mark_limits(recording::Recording& recording, const RobotModel& model);

/// A group of columns computed by with_quantities().
struct RecordedQuantity {
  std::string_view name, columns, doc;
};
[[nodiscard]] std::span<const RecordedQuantity> recorded_quantities();

/// The recording with the columns of the named quantities, which replace those with the same names.
/// Uses the current robot and its placement; if the tool of the recording was elsewhere, that is an
/// error. Velocities and accelerations missing in a recording of joints are derivatives of its
/// columns (five points); quantities that need torques report the missing column. Torques include
/// the force and moment of the columns wrench1 to wrench6, if present, or those of `load`, which
/// then replaces these columns (a zero load removes them); tau_external is their part.
[[nodiscard]] Result<recording::RecordingPtr> with_quantities(
    const Simulator&, const recording::Recording&, std::span<const std::string> quantities,
    Progress&, const std::optional<TipLoad>& load = std::nullopt);

/// The same for one robot of a recording of several, such as of tasks: its columns are named
/// `<robot>.q1`, and so are the new ones.
[[nodiscard]] Result<recording::RecordingPtr> with_quantities_of(
    const Simulator&, const recording::Recording&, const std::string& robot,
    std::span<const std::string> quantities, Progress&,
    const std::optional<TipLoad>& load = std::nullopt);

/// Derivative with respect to time by five-point polynomials, and integral from the first row on by
/// trapezoids corrected by the derivatives at their ends (exact for cubics).
[[nodiscard]] std::vector<double> rate_of(const std::vector<double>& time,
                                          const std::vector<double>& values);
[[nodiscard]] std::vector<double> integral_of(const std::vector<double>& time,
                                              const std::vector<double>& values);

enum class Watch { value, rate, integral };
/// The recording with a column for an expression over the others, row by row ("tau1*qd1"), its rate
/// or its integral. An empty unit means that of the result; another dimension, a unit that is not
/// SI, or a name that cannot be used in expressions is an error.
[[nodiscard]] Result<recording::RecordingPtr> with_watch(const recording::Recording&,
                                                         const std::string& name,
                                                         std::string_view expression,
                                                         const std::string& unit, Watch);

}  // namespace robomosp::sim
