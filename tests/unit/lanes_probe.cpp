// SPDX-License-Identifier: Apache-2.0
// What lanes_test asks of spatial/lanes.h, compiled by robomosp_lanes().
#include "lanes_probe.h"

#include "spatial/lanes.h"

namespace robomosp::test::RMP_LANES {
namespace {

using namespace spatial::RMP_LANES;

void sines(const double* x, std::size_t count, bool exact, double* sine, double* cosine) {
  if (exact) sin_cos<RightAngles::exact>(x, count, sine, cosine);
  else sin_cos<RightAngles::as_given>(x, count, sine, cosine);
}
void there_and_back(const double* from, std::size_t width, std::size_t samples, double* to) {
  for (std::size_t i = 0; i < samples; i += kLanes) {
    Lanes numbers[64];
    load_samples(from + i * width, width, samples - i, numbers);
    for (std::size_t k = 0; k < width; ++k) numbers[k] += static_cast<double>(k);
    store_samples(numbers, width, samples - i, to + i * width);
  }
}
constexpr LanesProbe kProbe{sines, there_and_back};

}  // namespace

const LanesProbe& probe() { return kProbe; }

}  // namespace robomosp::test::RMP_LANES
