// SPDX-License-Identifier: Apache-2.0
// Doors to spatial/lanes.h for lanes_test, one an instruction set.
#pragma once

#include <cstddef>

namespace robomosp::test {

struct LanesProbe {
  /// Reads and writes up to the next multiple of 8 numbers.
  void (*sines)(const double* x, std::size_t count, bool exact, double* sine, double* cosine);
  /// Adds its index to every number of every sample; width <= 64.
  void (*there_and_back)(const double* from, std::size_t width, std::size_t samples, double* to);
};

namespace baseline {
const LanesProbe& probe();
}
namespace avx2 {
const LanesProbe& probe();
}
namespace avx512 {
const LanesProbe& probe();
}

}  // namespace robomosp::test
