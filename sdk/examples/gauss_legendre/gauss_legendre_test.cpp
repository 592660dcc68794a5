// SPDX-License-Identifier: Apache-2.0
// What the method promises beyond the suite: quadratic invariants to rounding, and energy in bounds
// where the inertia depends on the position.
#include <cmath>

#include <robomosp/sdk/conformance/integrator_suite.h>

namespace robomosp::conformance {
namespace {

std::vector<double> end_state(TestSystem& system, const std::vector<double>& x0, double end,
                              double step) {
  const auto found = find_provider<Integrator>(ROBOMOSP_PLUGIN_FILE, "gauss_legendre");
  const auto method = create<Integrator>(**found);
  OdeRun run;
  run.end = end, run.x0 = x0, run.step = step;
  const std::vector<double> times{end};
  run.sample_times = times;
  KeptSamples kept;
  NoProgress none;
  const auto done = method->run(system, run, kept, none);
  EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
  return kept.states.empty() ? x0 : kept.states.back();
}

TEST(GaussLegendre, KeepsSpinEnergyAndMomentumOfAFreeBodyToRounding) {
  // Euler's equations: I w' = I w x w; 2 T = w . I w and (I w)^2 are quadratic in w.
  const double I[3] = {1, 2, 3.5};
  TestSystem system(3, [&](double, std::span<const double> w, std::span<double> dw) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t u = (k + 1) % 3, v = (k + 2) % 3;
      dw[k] = (I[u] - I[v]) * w[u] * w[v] / I[k];
    }
  });
  const auto invariants = [&](const std::vector<double>& w) {
    double twice = 0, momentum = 0;
    for (std::size_t k = 0; k < 3; ++k)
      twice += I[k] * w[k] * w[k], momentum += I[k] * I[k] * w[k] * w[k];
    return std::pair(twice, momentum);
  };
  const std::vector<double> start{0.3, 2, 0.1};
  const auto end = end_state(system, start, 200, 0.05);
  EXPECT_NEAR(invariants(end).first / invariants(start).first, 1, 1e-12);
  EXPECT_NEAR(invariants(end).second / invariants(start).second, 1, 1e-12);
  EXPECT_GT(std::fabs(end[0] - start[0]) + std::fabs(end[1] - start[1]), 1e-3) << "it did move";
}

TEST(GaussLegendre, KeepsTheEnergyOfTwoSwingingRodsInBounds) {
  // Two point masses of 1 kg on rods of 1 m, angles from the vertical (q1, q2 both absolute):
  // T = w1^2 + w2^2 / 2 + w1 w2 cos(q1 - q2), V = -g (2 cos q1 + cos q2).
  const double g = 9.81;
  TestSystem system(4, [g](double, std::span<const double> x, std::span<double> dx) {
    const double c = std::cos(x[0] - x[1]), s = std::sin(x[0] - x[1]);
    const double f1 = -x[3] * x[3] * s - 2 * g * std::sin(x[0]);
    const double f2 = x[2] * x[2] * s - g * std::sin(x[1]);
    dx[0] = x[2], dx[1] = x[3];
    dx[2] = (f1 - c * f2) / (2 - c * c);
    dx[3] = (2 * f2 - c * f1) / (2 - c * c);
  });
  const auto energy = [g](const std::vector<double>& x) {
    return x[2] * x[2] + x[3] * x[3] / 2 + x[2] * x[3] * std::cos(x[0] - x[1]) -
           g * (2 * std::cos(x[0]) + std::cos(x[1]));
  };
  const std::vector<double> start{0.5, -0.2, 0, 0};
  const double short_run = std::fabs(energy(end_state(system, start, 10, 0.01)) - energy(start));
  const double long_run = std::fabs(energy(end_state(system, start, 1000, 0.01)) - energy(start));
  EXPECT_LT(short_run, 1e-5);
  EXPECT_LT(long_run, 1e-5) << "a method that is not symplectic drifts with time";
}

}  // namespace
}  // namespace robomosp::conformance
