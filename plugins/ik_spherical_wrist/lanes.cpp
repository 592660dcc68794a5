// SPDX-License-Identifier: Apache-2.0
#include "lanes.h"

#include "lanes_kernel.h"
#include "spatial/instruction_set.h"

namespace robomosp::ik_spherical_wrist {

LaneSolver lane_solver() {
#if defined(__x86_64__)
  switch (spatial::widest_instruction_set()) {
    case spatial::InstructionSet::avx512: return {avx512::solve_lanes, avx512::sines_cosines};
    case spatial::InstructionSet::avx2: return {avx2::solve_lanes, avx2::sines_cosines};
    case spatial::InstructionSet::baseline: break;
  }
#endif
  return {baseline::solve_lanes, baseline::sines_cosines};
}

}  // namespace robomosp::ik_spherical_wrist
