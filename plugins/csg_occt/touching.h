// SPDX-License-Identifier: Apache-2.0
// Which of many boxes meet (layer: plugin).
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <Bnd_Box.hxx>

#include <robomosp/sdk/progress.h>

namespace robomosp::csg_occt {

/// Sets of boxes that meet each other, directly or by way of others of their set; the sets by their
/// first members, members ascending. Pairs for which `counts` is false are passed over. None when
/// it is cancelled. Takes time by the number of boxes and of pairs that meet, wherever they lie.
std::vector<std::vector<std::size_t>> touching_sets(
    const std::vector<const Bnd_Box*>& boxes,
    const std::function<bool(std::size_t, std::size_t)>& counts, const Progress& progress);

}  // namespace robomosp::csg_occt
