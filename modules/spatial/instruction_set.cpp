// SPDX-License-Identifier: Apache-2.0
#include "spatial/instruction_set.h"

namespace robomosp::spatial {

InstructionSet widest_instruction_set() {
#if defined(__x86_64__)
  // The levels of the x86-64 psABI, which are also what robomosp_lanes() compiles for.
  __builtin_cpu_init();
#if defined(RMP_HAS_AVX512)
  if (__builtin_cpu_supports("x86-64-v4")) return InstructionSet::avx512;
#endif
  if (__builtin_cpu_supports("x86-64-v3")) return InstructionSet::avx2;
#endif
  return InstructionSet::baseline;
}

InstructionSet instruction_set_up_to(std::string_view name) {
  const InstructionSet set = widest_instruction_set();
  if (name == "baseline") return InstructionSet::baseline;
  return name == "avx2" && set == InstructionSet::avx512 ? InstructionSet::avx2 : set;
}

}  // namespace robomosp::spatial
