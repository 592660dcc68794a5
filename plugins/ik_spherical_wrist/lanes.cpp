// SPDX-License-Identifier: Apache-2.0
#include "lanes.h"

#include "spatial/instruction_set.h"

namespace robomosp::ik_spherical_wrist {

const LaneSolver& lane_solver() {
  const spatial::InstructionSet set = spatial::widest_instruction_set();
#if defined(RMP_HAS_AVX512)
  if (set == spatial::InstructionSet::avx512) return avx512::lane_solver();
#endif
#if defined(__x86_64__)
  if (set == spatial::InstructionSet::avx2) return avx2::lane_solver();
#endif
  (void)set;
  return baseline::lane_solver();
}

}  // namespace robomosp::ik_spherical_wrist
