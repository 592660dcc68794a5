// SPDX-License-Identifier: Apache-2.0
// The round outside of a shape, beside its triangles (layer: contract, std only).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <robomosp/sdk/collision.h>

namespace robomosp {

/// What a mesh or convex shape is from outside where it is a solid of revolution, but for openings
/// such as bores and slots: its triangles make a polygon of it, which does not roll.
struct RoundOutside {
  Pose pose;          ///< shape_T_outside: the axis is z, a sphere is about the origin
  double sphere = 0;  ///< radius [m]; 0 = by the profile
  /// Radius and z [m] of circles of which the hull consists, with z from below to above.
  std::vector<std::array<double, 2>> profile;
};
/// Borrowed; for engines of contact physics, which may leave it out of account.
inline void set_outside(Shape& s, const RoundOutside* outside) {
  s.room.words[2] = reinterpret_cast<std::uintptr_t>(outside);
}
/// nullptr = it is what its triangles are.
[[nodiscard]] inline const RoundOutside* outside_of(const Shape& s) {
  return reinterpret_cast<const RoundOutside*>(static_cast<std::uintptr_t>(s.room.words[2]));
}

}  // namespace robomosp
