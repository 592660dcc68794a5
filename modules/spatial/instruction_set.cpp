// SPDX-License-Identifier: Apache-2.0
#include "spatial/instruction_set.h"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string>

#include "spatial/instruction_limit.h"

namespace robomosp::spatial {
namespace {

constexpr const char* kLimitVariable = "ROBOMOSP_SIMD";

#if defined(__x86_64__)
// The levels of the x86-64 psABI, which are also what robomosp_lanes() compiles for. Clang knows
// their names since version 18; before, the features of a level that no processor below it has.
#if defined(__clang__) && __clang_major__ < 18
bool has_v3() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
         __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
}
[[maybe_unused]] bool has_v4() {
  return has_v3() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512vl");
}
#else
bool has_v3() { return __builtin_cpu_supports("x86-64-v3"); }
[[maybe_unused]] bool has_v4() { return __builtin_cpu_supports("x86-64-v4"); }
#endif
#endif

InstructionSet widest_of_processor() {
#if defined(__x86_64__)
  __builtin_cpu_init();
#if defined(RMP_HAS_AVX512)
  if (has_v4()) return InstructionSet::avx512;
#endif
  if (has_v3()) return InstructionSet::avx2;
#endif
  return InstructionSet::baseline;
}

std::optional<InstructionSet> instruction_set_named(std::string_view name) {
  if (name == "baseline") return InstructionSet::baseline;
  if (name == "avx2") return InstructionSet::avx2;
  if (name == "avx512") return InstructionSet::avx512;
  return std::nullopt;
}

std::string_view limit_text() {
  const char* given = std::getenv(kLimitVariable);
  return given ? given : "";
}

}  // namespace

InstructionSet instruction_set_limit() {
  return instruction_set_named(limit_text()).value_or(InstructionSet::avx512);
}

std::string instruction_set_complaint() {
  const std::string_view text = limit_text();
  if (text.empty() || instruction_set_named(text)) return {};
  return std::string(kLimitVariable) + " is \"" + std::string(text) +
         "\", which is not an instruction set: the widest of this processor is used. Set it to "
         "baseline, avx2 or avx512, or unset it.";
}

InstructionSet widest_instruction_set() {
  return std::min(widest_of_processor(), instruction_set_limit());
}

InstructionSet instruction_set_up_to(std::string_view name) {
  return std::min(widest_instruction_set(),
                  instruction_set_named(name).value_or(InstructionSet::avx512));
}

}  // namespace robomosp::spatial
