// SPDX-License-Identifier: Apache-2.0
// Finds intersecting boxes among many (layer: plugin).
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <Bnd_Box.hxx>

#include <robomosp/sdk/progress.h>

namespace robomosp::csg_occt {

/// Connected sets of intersecting boxes; the sets in order of their first members, members
/// ascending. Pairs for which `counts` is false are ignored. None on cancellation. The time depends
/// on the number of boxes and of intersecting pairs, not on their positions.
std::vector<std::vector<std::size_t>> touching_sets(
    const std::vector<const Bnd_Box*>& boxes,
    const std::function<bool(std::size_t, std::size_t)>& counts, const Progress& progress);

}  // namespace robomosp::csg_occt
