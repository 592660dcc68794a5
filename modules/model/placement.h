// SPDX-License-Identifier: Apache-2.0
// Placements of records as poses and back (layer: data processing, model). [any thread]
#pragma once

#include "model/records.h"
#include "spatial/rotation.h"

namespace robomosp::model {

/// The pose that a placement writes down.
[[nodiscard]] inline Pose pose(const Placement& placement) {
  Pose t;
  t.p = placement.position;
  switch (placement.notation) {
    case AngleNotation::rpy: t.R = spatial::from_rpy(placement.angles); break;
    case AngleNotation::xyz: t.R = spatial::from_xyz(placement.angles); break;
    case AngleNotation::zyz: t.R = spatial::from_zyz(placement.angles); break;
  }
  return t;
}

/// A placement of the wanted notation that writes `t` down.
[[nodiscard]] inline Placement placement(const Pose& t,
                                         AngleNotation notation = AngleNotation::rpy) {
  switch (notation) {
    case AngleNotation::xyz: return {t.p, spatial::to_xyz(t.R), notation};
    case AngleNotation::zyz: return {t.p, spatial::to_zyz(t.R), notation};
    case AngleNotation::rpy: break;
  }
  return {t.p, spatial::to_rpy(t.R), AngleNotation::rpy};
}

}  // namespace robomosp::model
