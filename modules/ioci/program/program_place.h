// SPDX-License-Identifier: Apache-2.0
// A place that a program has in a world (layer: application, ioci only).
#pragma once

#include "model/world.h"

namespace robomosp::ioci {

struct ProgramPlace {
  WorldId world;
  std::size_t at = 0;                            ///< in its list of programs
  const model::PlacedProgram* placed = nullptr;  ///< of the snapshot, or one to be tried
};

}  // namespace robomosp::ioci
