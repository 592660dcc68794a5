// SPDX-License-Identifier: Apache-2.0
// Which of the compiled instruction sets this processor runs (layer: data processing, spatial).
#pragma once

#include <string_view>

/// Defined where robomosp_lanes() compiles for AVX-512: sanitized builds leave it out, which has
/// the same source as AVX2, to compile faster.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define RMP_HAS_AVX512
#endif

namespace robomosp::spatial {

/// In order of width; sources of robomosp_lanes() are compiled once for each. Only baseline exists
/// where the processor is no x86-64.
enum class InstructionSet { baseline, avx2, avx512 };

/// The widest that processor, system and ROBOMOSP_SIMD (instruction_limit.h) allow. [any thread]
[[nodiscard]] InstructionSet widest_instruction_set();

/// The widest that is no wider than the named one ("avx512", "avx2", "baseline"; "auto" = any).
[[nodiscard]] InstructionSet instruction_set_up_to(std::string_view name);

}  // namespace robomosp::spatial
