// SPDX-License-Identifier: Apache-2.0
// The volume shared by a solid and others, measured along lines rather than by cutting: for pairs
// with nearly coincident faces, for which Boolean operations fail or take minutes (layer: plugin).
#pragma once

#include <array>
#include <vector>

#include "boolean.h"

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

namespace robomosp::csg_occt {

struct SharedVolume {
  Integrals moments;     ///< of the shared volume, about the origin of the common frame; area = 0
  double deviation = 0;  ///< greatest error of the volume [mm^3]
  /// True if the result cannot be distinguished from touching faces.
  [[nodiscard]] bool is_contact() const { return moments.volume <= deviation; }
};

/// Shared by `mine` and the union of `others`, all in one frame [mm]. Equal inputs give equal
/// numbers. Errors: only cancellation; solids that cannot be meshed are bounded by the boxes.
[[nodiscard]] Result<SharedVolume> measure_shared(const Solid& mine,
                                                  const std::vector<const Solid*>& others,
                                                  Progress& progress);

}  // namespace robomosp::csg_occt
