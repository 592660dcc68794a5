// SPDX-License-Identifier: Apache-2.0
// The environment variable ROBOMOSP_SIMD, which limits the instruction sets of all kernels, for
// measurements and tests (layer: data processing, spatial).
#pragma once

#include <string>

#include "spatial/instruction_set.h"

namespace robomosp::spatial {

/// The widest that ROBOMOSP_SIMD allows ("baseline", "avx2" or "avx512"); avx512 where it is unset,
/// empty or another word. Read at each call. [any thread, unless another one sets the variable]
[[nodiscard]] InstructionSet instruction_set_limit();

/// Empty, or a sentence if ROBOMOSP_SIMD has a value that names no instruction set. A set that this
/// processor lacks is a limit like any other. [any thread, likewise]
[[nodiscard]] std::string instruction_set_complaint();

}  // namespace robomosp::spatial
