// SPDX-License-Identifier: Apache-2.0
// One verified boolean operation on solids: runs it, checks the result, and climbs a ladder of
// remedies before it gives up (layer: plugin).
#pragma once

#include <span>
#include <vector>

#include "face_memory.h"

#include <Bnd_Box.hxx>
#include <TopoDS_Shape.hxx>

namespace robomosp::csg_occt {

/// A closed solid with what later steps ask of it [mm].
struct Solid {
  TopoDS_Shape shape;
  Bnd_Box box;
  double volume = 0;
};

/// Measures a solid. The box contains it with OCCT's gap.
Solid measured(const TopoDS_Shape& solid, FaceMemory& faces);
/// The same, which throws Interrupted once cancelled.
Solid measured(const TopoDS_Shape& solid, FaceMemory& faces, const Progress& progress);
bool boxes_meet(const Bnd_Box& a, const Bnd_Box& b);

struct BooleanCall {
  CsgKind kind = CsgKind::union_;
  std::vector<Solid> objects, tools;  ///< for a union their roles are equal
  /// The same operands with poles and seams elsewhere.
  struct Turned {
    std::vector<TopoDS_Shape> objects, tools;
  };
  std::vector<Turned> turned;  ///< tried in this order; empty when there is nothing to turn
};

struct BooleanOutcome {
  std::vector<Solid> solids;
  std::string remedy;  ///< what had to be done to get a valid result; empty = nothing
};

/// Never returns a result that failed its check. The error lacks the place.
Result<BooleanOutcome> run_boolean(const BooleanCall& call, FaceMemory& faces, Progress& progress,
                                   double from, double to);

}  // namespace robomosp::csg_occt
