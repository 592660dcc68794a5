// SPDX-License-Identifier: Apache-2.0
// Ids of what pictures show (layer: application, scene). Internal to modules/scene.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "kernel/fingerprint.h"

namespace robomosp::scene {

/// Stable across scenes: the same member of the same world has the same id.
[[nodiscard]] inline std::uint64_t item_id(std::string_view owner, std::size_t body,
                                           std::size_t part) {
  return Fingerprinter("item/1")
      .add(owner)
      .add(static_cast<std::int64_t>(body))
      .add(static_cast<std::int64_t>(part))
      .finish()
      .lo;
}
// Numbers of bodies that no robot has.
inline constexpr std::size_t kToolBody = 100000, kLineBody = 200000, kMarkBody = 300000,
                             kFrameBody = 400000, kEllipsoidBody = 500000, kPlaceBody = 600000,
                             kNoteBody = 700000, kDimensionBody = 800000;

}  // namespace robomosp::scene
