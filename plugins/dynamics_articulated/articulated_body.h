// SPDX-License-Identifier: Apache-2.0
// Forward dynamics by articulated bodies in O(n) (layer: plugin): Featherstone, Rigid Body Dynamics
// Algorithms (2008), 7.3, in joint frames, with motor inertia. Joints that follow another one are
// moved by multipliers, one a coupling.
#pragma once

#include <cstdint>
#include <vector>

#include "spatial/body_tree.h"

namespace robomosp::articulated {

using spatial::BodyTree;
using spatial::Screw;

/// Constants of the algorithm beside those of the tree.
struct Articulated {
  BodyTree tree;
  std::vector<double> pivot;            ///< below it a body's resistance is rounding, one a body
  std::vector<std::int32_t> wide;       ///< place among the joints of several columns, -1 = one
  std::vector<std::int32_t> followers;  ///< coupled joints
  std::vector<std::int32_t> leaders;    ///< whom they follow
  std::size_t wide_count = 0;
};
[[nodiscard]] Result<Articulated> make_articulated(const RobotModel& model);

/// Doubles of scratch of accelerations().
[[nodiscard]] std::size_t articulated_scratch(const Articulated& a);
/// qdd of one sample. Returns -1, or the joint that nothing resists.
[[nodiscard]] std::int32_t accelerations(const Articulated& a, const DynamicsBatch& batch,
                                         std::size_t sample, double* scratch, double* qdd);

}  // namespace robomosp::articulated
