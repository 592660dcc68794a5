// SPDX-License-Identifier: Apache-2.0
#include "kernels.h"

namespace robomosp::newton_euler {

const Kernels& kernels(spatial::InstructionSet set) {
#if defined(__x86_64__)
  if (set == spatial::InstructionSet::avx512) return avx512::kernels();
  if (set == spatial::InstructionSet::avx2) return avx2::kernels();
#endif
  (void)set;
  return baseline::kernels();
}

}  // namespace robomosp::newton_euler
