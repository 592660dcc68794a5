// SPDX-License-Identifier: Apache-2.0
#include "lanes.h"

#include "spatial/instruction_limit.h"

namespace robomosp::ik_numeric {

namespace baseline {
extern const LaneEngine kEngine;
}
#ifdef RMP_IK_WIDE
namespace avx2 {
extern const LaneEngine kEngine;
}
namespace avx512 {
extern const LaneEngine kEngine;
}
#endif

const LaneEngine& lane_engine() {
#ifdef RMP_IK_WIDE
  const spatial::InstructionSet most = spatial::instruction_set_limit();
  if (most == spatial::InstructionSet::avx512 && __builtin_cpu_supports("avx512f") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    return avx512::kEngine;
  if (most >= spatial::InstructionSet::avx2 && __builtin_cpu_supports("avx2") &&
      __builtin_cpu_supports("fma"))
    return avx2::kEngine;
#endif
  return baseline::kEngine;
}

}  // namespace robomosp::ik_numeric
