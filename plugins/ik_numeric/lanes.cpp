// SPDX-License-Identifier: Apache-2.0
#include "lanes.h"

#include <cstdlib>
#include <string_view>

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
  // For measurements and tests of the narrower forms.
  const char* set = std::getenv("ROBOMOSP_SIMD");
  const std::string_view most = set ? set : "avx512";
  if (most == "avx512" && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"))
    return avx512::kEngine;
  if (most != "baseline" && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    return avx2::kEngine;
#endif
  return baseline::kEngine;
}

}  // namespace robomosp::ik_numeric
