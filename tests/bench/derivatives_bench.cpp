// SPDX-License-Identifier: Apache-2.0
// Partial derivatives of inverse and forward dynamics: microseconds a sample, single and in
// batches, with ratios to the torques (or accelerations) of the same robot and to the same
// derivatives by products of every pair (`pairwise_derivatives.h`), in turns in one run.
//
// derivatives_bench [passes]
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>

#include <robomosp/sdk/conformance/mechanisms.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/dynamics.h>

#include "support/pairwise_derivatives.h"

namespace robomosp::bench {
namespace {

using namespace conformance;

const std::string kPlugins = ROBOMOSP_PLUGIN_DIR;

void must(const Result<void>& r) {
  if (r.ok()) return;
  std::fprintf(stderr, "%s\n", r.error().sentence().c_str());
  std::exit(1);
}
/// Of all threads [s].
double processor_time() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
template <class Interface>
std::shared_ptr<Interface> provider(const char* plugin, const char* name, const RobotModel& m,
                                    const char* set) {
  auto found = find_provider<Interface>(kPlugins + plugin, name);
  if (!found.ok()) must(found.error());
  TableParams params(**found);
  params.set("instructions", set);
  std::shared_ptr<Interface> made = create<Interface>(**found);
  must(made->prepare(m, params));
  return made;
}

RobotModel chain(std::size_t n) {
  RobotModel m;
  m.name = "chain of " + std::to_string(n);
  m.gravity = {0, 0, -9.81};
  Random random(5);
  for (std::size_t i = 0; i < n; ++i) {
    JointModel j;
    j.name = "j" + std::to_string(i);
    j.parent = static_cast<std::int32_t>(i) - 1;
    j.q_index = j.v_index = static_cast<std::int32_t>(i);
    const auto x = random.vector(6, -0.3, 0.3);
    j.placement = multiply(shift(x[0], x[1], 0.2), turn_x(3 * x[2]));
    j.body = {1 + x[3], {x[4], x[5], 0.05}, {0.02, 0.03, 0.025, 0.001, -0.001, 0.002}};
    m.joints.push_back(j);
  }
  m.coordinates = m.velocities = static_cast<std::int32_t>(n);
  m.tips = {{"tip", static_cast<std::int32_t>(n) - 1, Pose{}}};
  return m;
}

struct Row {
  const char* what;
  std::function<void()> pass;  ///< all of the pool
  double least = std::numeric_limits<double>::infinity();
};

void measure(const RobotModel& m, std::size_t pool, int passes) {
  const std::size_t n = m.dof();
  Random random(1);
  std::vector<double> q;
  for (std::size_t i = 0; i < pool; ++i)
    for (const double x : random.configuration(m)) q.push_back(x);
  const auto qd = random.vector(pool * n, -1, 1), u = random.vector(pool * n, -2, 2);
  const auto inverse =
      provider<InverseDynamics>("/dynamics_newton_euler.so", "newton_euler", m, "auto");
  const auto inverse2 =
      provider<InverseDynamics>("/dynamics_newton_euler.so", "newton_euler", m, "avx2");
  const auto forward =
      provider<ForwardDynamics>("/dynamics_articulated.so", "articulated_body", m, "auto");
  const auto forward2 =
      provider<ForwardDynamics>("/dynamics_articulated.so", "articulated_body", m, "avx2");
  auto tree = spatial::make_body_tree(m);
  if (!tree.ok()) must(tree.error());
  std::vector<double> scratch(
      std::max({inverse->scratch_size(), inverse2->scratch_size(), forward->scratch_size(),
                forward2->scratch_size(), test::pairwise_scratch(*tree)}));
  std::vector<double> a(pool * n * n), b(a.size()), c(a.size());
  NoProgress none;
  const auto sample = [&](std::size_t i, std::size_t count) {
    DynamicsBatch s;
    s.count = count, s.scratch = scratch;
    s.q = std::span(q).subspan(i * n, count * n);
    s.qd = std::span(qd).subspan(i * n, count * n);
    s.qdd = s.tau = std::span(u).subspan(i * n, count * n);
    return s;
  };
  const auto each = [&](auto one) {
    return [=] {
      for (std::size_t i = 0; i < pool; ++i) one(i);
    };
  };
  const auto first = [&](std::vector<double>& v) { return std::span(v).first(n * n); };
  const auto torques = [&](const auto& x) {
    return [&, x](std::size_t i) { must(x->torques(sample(i, 1), std::span(a).first(n), none)); };
  };
  const auto rates = [&](const auto& x) {
    return [&, x](std::size_t i) { must(x->derivatives(sample(i, 1), first(a), first(b), none)); };
  };
  const auto accelerations = [&](const auto& x) {
    return [&, x](std::size_t i) {
      must(x->accelerations(sample(i, 1), std::span(a).first(n), none));
    };
  };
  const auto bends = [&](const auto& x) {
    return [&, x](std::size_t i) {
      must(x->derivatives(sample(i, 1), first(a), first(b), first(c), none));
    };
  };
  Row rows[] = {
      {"torques", each(torques(inverse))},
      {"derivatives of the torques", each(rates(inverse))},
      {"the same, AVX2", each(rates(inverse2))},
      {"the same by pairs", each([&](std::size_t i) {
         test::pairwise_derivatives(*tree, sample(i, 1), 0, nullptr, false, scratch.data(),
                                    first(a), first(b));
       })},
      {"the same, a batch", [&] { must(inverse->derivatives(sample(0, pool), a, b, none)); }},
      {"accelerations", each(accelerations(forward))},
      {"derivatives of the accelerations", each(bends(forward))},
      {"the same, AVX2", each(bends(forward2))},
      {"the same by pairs", each([&](std::size_t i) {
         accelerations(forward)(i);
         const std::vector<double> qdd(a.begin(), a.begin() + static_cast<std::ptrdiff_t>(n));
         if (!test::pairwise_derivatives(*tree, sample(i, 1), 0, qdd.data(), scratch.data(),
                                         first(a), first(b), first(c)))
           std::exit(1);
       })},
      {"the same, a batch", [&] { must(forward->derivatives(sample(0, pool), a, b, c, none)); }},
  };
  for (int i = 0; i < passes; ++i)
    for (Row& row : rows) {
      const double begin = processor_time();
      row.pass();
      row.least = std::min(row.least, processor_time() - begin);
    }
  std::printf("\n| %s | us a sample | times what is differentiated | times the one by pairs |\n",
              m.name.c_str());
  std::printf("|---|---|---|---|\n");
  const double samples = static_cast<double>(pool);
  for (std::size_t k = 0; k < std::size(rows); ++k) {
    const Row& row = rows[k];
    const double base = rows[k < 5 ? 0 : 5].least, pairs = rows[k < 5 ? 3 : 8].least;
    std::printf("| %s | %.3g | %.3g | %.3g |\n", row.what, 1e6 * row.least / samples,
                row.least / base, row.least / pairs);
  }
}

}  // namespace
}  // namespace robomosp::bench

int main(int argc, char** argv) {
  using namespace robomosp;
  const int passes = argc > 1 ? std::atoi(argv[1]) : 30;
  bench::measure(conformance::puma560(), 24, 40 * passes);
  bench::measure(conformance::panda(), 24, 40 * passes);
  bench::measure(bench::chain(30), 8, 10 * passes);
  bench::measure(bench::chain(100), 4, 2 * passes);
  bench::measure(bench::chain(300), 1, passes);
}
