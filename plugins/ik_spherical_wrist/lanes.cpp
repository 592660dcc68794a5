// SPDX-License-Identifier: Apache-2.0
#include "lanes.h"

#include "lanes_kernel.h"
#include "spatial/instruction_set.h"

namespace robomosp::ik_spherical_wrist {

LaneSolver lane_solver() {
  const spatial::InstructionSet set = spatial::widest_instruction_set();
#if defined(RMP_HAS_AVX512)
  if (set == spatial::InstructionSet::avx512) return {avx512::solve_lanes, avx512::sines_cosines};
#endif
#if defined(__x86_64__)
  if (set == spatial::InstructionSet::avx2) return {avx2::solve_lanes, avx2::sines_cosines};
#endif
  (void)set;
  return {baseline::solve_lanes, baseline::sines_cosines};
}

}  // namespace robomosp::ik_spherical_wrist
