// SPDX-License-Identifier: Apache-2.0
// What a solid shares with others, measured along lines instead of cut: for pairs whose faces
// nearly coincide, where boolean operations fail or take minutes (layer: plugin).
#pragma once

#include <array>
#include <vector>

#include "boolean.h"

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

namespace robomosp::csg_occt {

struct SharedVolume {
  Integrals moments;     ///< of what is shared, about the origin of the common frame; area = 0
  double deviation = 0;  ///< the volume is at most so far off [mm^3]
  /// Nothing that the measurement could tell from faces that touch.
  [[nodiscard]] bool is_contact() const { return moments.volume <= deviation; }
};

/// Shared by `mine` and the union of `others`, all in one frame [mm]. The same input gives the same
/// numbers. Errors: only cancellation; what cannot be meshed is bounded by the boxes.
[[nodiscard]] Result<SharedVolume> measure_shared(const Solid& mine,
                                                  const std::vector<const Solid*>& others,
                                                  Progress& progress);

}  // namespace robomosp::csg_occt
