// SPDX-License-Identifier: Apache-2.0
// Why inverse kinematics found no solution, in the terms of the robot's maker (layer: application,
// sim). [any thread]
#pragma once

#include <span>
#include <string>

#include "robotics/maker_axes.h"
#include "sim/simulate.h"

namespace robomosp::sim {

/// The reason of `r`, which is not solved, with the maker's axes in it; "" = the solver gave none.
/// Solvers know joints only. If the axis of the limiting joint counts other joints, too, `ik`
/// solves once more without limits to name the axis with its value and range; otherwise the
/// solver's own words are used. `target` is base_T_tip of the first tip of ik.model, `seed` holds
/// coordinate_count() numbers or none.
[[nodiscard]] std::string ik_reason(const Registry&, const Bound<IkSolver>& ik,
                                    const model::ProviderChoice&, const IkResult& r,
                                    const Pose& target, std::span<const double> seed,
                                    const robotics::MakerAxes&, Progress&);

}  // namespace robomosp::sim
