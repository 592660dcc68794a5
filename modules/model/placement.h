// SPDX-License-Identifier: Apache-2.0
// Placements of records as poses and back (layer: data processing, model). [any thread]
#pragma once

#include <cmath>
#include <cstddef>
#include <string_view>

#include "model/records.h"
#include "spatial/rotation.h"

namespace robomosp::model {

/// "at", "cylindrical" or "spherical"; "rpy", "xyz" or "zyz": the words of files.
[[nodiscard]] constexpr std::string_view word_of(PositionRepresentation notation) {
  return kPositionWords[static_cast<std::size_t>(notation)];
}
[[nodiscard]] constexpr std::string_view word_of(AngleRepresentation notation) {
  return kAngleWords[static_cast<std::size_t>(notation)];
}

/// The Cartesian position that a placement writes down [m].
[[nodiscard]] inline Vec3 position(const Placement& placement) {
  const auto& [a, b, c] = placement.position;
  switch (placement.coordinates) {
    case PositionRepresentation::cylindrical: return {a * std::cos(b), a * std::sin(b), c};
    case PositionRepresentation::spherical:
      return {a * std::sin(c) * std::cos(b), a * std::sin(c) * std::sin(b), a * std::cos(c)};
    case PositionRepresentation::cartesian: break;
  }
  return placement.position;
}

/// The pose that a placement writes down.
[[nodiscard]] inline Pose pose(const Placement& placement) {
  Pose t;
  t.p = position(placement);
  switch (placement.notation) {
    case AngleRepresentation::rpy: t.R = spatial::from_rpy(placement.angles); break;
    case AngleRepresentation::xyz: t.R = spatial::from_xyz(placement.angles); break;
    case AngleRepresentation::zyz: t.R = spatial::from_zyz(placement.angles); break;
  }
  return t;
}

/// A placement of the wanted notation that writes `t` down.
[[nodiscard]] inline Placement placement(const Pose& t,
                                         AngleRepresentation notation = AngleRepresentation::rpy) {
  switch (notation) {
    case AngleRepresentation::xyz: return {t.p, spatial::to_xyz(t.R), notation};
    case AngleRepresentation::zyz: return {t.p, spatial::to_zyz(t.R), notation};
    case AngleRepresentation::rpy: break;
  }
  return {t.p, spatial::to_rpy(t.R), AngleRepresentation::rpy};
}

}  // namespace robomosp::model
