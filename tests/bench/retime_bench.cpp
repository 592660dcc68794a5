// SPDX-License-Identifier: Apache-2.0
// Time-optimal re-timing of a path of seven joints: a clamped cubic spline through six random
// waypoints under velocity and acceleration limits, its evaluation on the grid included. The same
// task took TOPP-RA (C++) 51, 107 and 200 us at 50, 100 and 200 grid points on the reference
// machine.
#include <random>
#include <vector>

#include <benchmark/benchmark.h>

#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/retimer.h>

namespace {

using namespace robomosp;

constexpr std::size_t kDof = 7, kPoints = 6;

/// Cubic spline with knots at 0, 1, ..., at rest at both ends.
struct Spline {
  std::vector<double> c;  ///< 4 coefficients of each joint of each piece

  explicit Spline(std::mt19937& random) : c(4 * kDof * (kPoints - 1)) {
    std::uniform_real_distribution<double> uniform(-1.5, 1.5);
    for (std::size_t j = 0; j < kDof; ++j) {
      double y[kPoints], m[kPoints] = {}, upper[kPoints] = {}, right[kPoints] = {};
      for (double& v : y) v = uniform(random);
      for (std::size_t i = 1; i + 1 < kPoints; ++i) {  // m[i-1] + 4 m[i] + m[i+1] = 3 (y+ - y-)
        const double pivot = 4 - upper[i - 1];
        upper[i] = 1 / pivot;
        right[i] = (3 * (y[i + 1] - y[i - 1]) - right[i - 1]) / pivot;
      }
      for (std::size_t i = kPoints - 2; i > 0; --i) m[i] = right[i] - upper[i] * m[i + 1];
      for (std::size_t i = 0; i + 1 < kPoints; ++i) {
        double* k = &c[4 * (i * kDof + j)];
        const double dy = y[i + 1] - y[i];
        k[0] = y[i], k[1] = m[i], k[2] = 3 * dy - 2 * m[i] - m[i + 1],
        k[3] = -2 * dy + m[i] + m[i + 1];
      }
    }
  }
  void at(double s, double* q, double* q1, double* q2) const {
    const auto i = std::min(static_cast<std::size_t>(s), kPoints - 2);
    const double x = s - static_cast<double>(i);
    for (std::size_t j = 0; j < kDof; ++j) {
      const double* k = &c[4 * (i * kDof + j)];
      q[j] = k[0] + x * (k[1] + x * (k[2] + x * k[3]));
      q1[j] = k[1] + x * (2 * k[2] + x * 3 * k[3]);
      q2[j] = 2 * k[2] + 6 * x * k[3];
    }
  }
};

void retime(benchmark::State& state) {
  const auto count = static_cast<std::size_t>(state.range(0)) + 1;
  std::mt19937 random(7);
  std::vector<Spline> splines;
  for (int i = 0; i < 64; ++i) splines.emplace_back(random);
  const rmp_provider* provider = *conformance::find_provider<Retimer>(
      std::string(ROBOMOSP_PLUGIN_DIR) + "/retime_reachability.so", "reachability");
  const auto retimer = conformance::create<Retimer>(*provider);
  const conformance::TableParams params(*provider);
  std::vector<double> s(count), q(count * kDof), q1(q), q2(q), velocity(kDof, 1.5),
      acceleration(kDof, 4.0);
  for (std::size_t i = 0; i < count; ++i)
    s[i] =
        static_cast<double>(kPoints - 1) * static_cast<double>(i) / static_cast<double>(count - 1);
  RetimeProblem p;
  p.dof = kDof;
  p.s = s, p.q = q, p.q1 = q1, p.q2 = q2, p.velocity = velocity, p.acceleration = acceleration;
  NoProgress none;
  std::size_t k = 0;
  for (auto _ : state) {
    const Spline& spline = splines[k++ % splines.size()];
    for (std::size_t i = 0; i < count; ++i)
      spline.at(s[i], &q[i * kDof], &q1[i * kDof], &q2[i * kDof]);
    auto done = retimer->retime(p, params, none);
    if (!done.ok()) state.SkipWithError(done.error().sentence().c_str());
    benchmark::DoNotOptimize(done);
  }
}
BENCHMARK(retime)->Arg(50)->Arg(100)->Arg(200)->Arg(1000)->Unit(benchmark::kMicrosecond);

}  // namespace
