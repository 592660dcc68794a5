// SPDX-License-Identifier: Apache-2.0
// Providers "articulated_body" and "divide_and_conquer": the SDK's suite, with the inverse dynamics
// of newton_euler, and against each other on long chains.
#include <robomosp/sdk/conformance/dynamics_suite.h>
#include <robomosp/sdk/conformance/mechanisms.h>

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/dynamics_articulated.so";
const std::string kInverse = std::string(ROBOMOSP_PLUGIN_DIR) + "/dynamics_newton_euler.so";

INSTANTIATE_TEST_SUITE_P(ArticulatedBody, DynamicsConformance,
                         testing::ValuesIn(with_inverse_of(
                             kInverse,
                             dynamics_cases(kFile, "newton_euler", "articulated_body",
                                            {puma560(), puma560_modified(), pa10(), pa10_nus(),
                                             panda(), planar_rods(), scara(), tree(),
                                             floating_manipulator(), long_chain(30)}))),
                         dynamics_case_name);

INSTANTIATE_TEST_SUITE_P(DivideAndConquer, DynamicsConformance,
                         testing::ValuesIn(with_inverse_of(
                             kInverse, dynamics_cases(kFile, "newton_euler", "divide_and_conquer",
                                                      {puma560(), pa10_nus(), panda(), scara(),
                                                       long_chain(30)}))),
                         dynamics_case_name);

struct Forward {
  Forward(const std::string& file, const std::string& name, const RobotModel& model,
          const char* threads = nullptr) {
    const rmp_provider* provider = *find_provider<ForwardDynamics>(file, name);
    solver = create<ForwardDynamics>(*provider);
    TableParams params(*provider);
    if (threads) params.set("threads", std::string(threads));
    const auto prepared = solver->prepare(model, params);
    EXPECT_TRUE(prepared.ok()) << prepared.error().sentence();
    scratch.resize(solver->scratch_size());
    dof = model.dof();
  }
  std::vector<double> operator()(const std::vector<double>& q, const std::vector<double>& qd,
                                 const std::vector<double>& tau,
                                 const std::vector<TipWrench>& tip = {}) {
    DynamicsBatch b;
    b.count = 1, b.q = q, b.qd = qd, b.tau = tau, b.tip = tip, b.scratch = scratch;
    std::vector<double> qdd(dof);
    NoProgress none;
    const auto r = solver->accelerations(b, qdd, none);
    EXPECT_TRUE(r.ok()) << r.error().sentence();
    return qdd;
  }
  std::unique_ptr<ForwardDynamics> solver;
  std::vector<double> scratch;
  std::size_t dof = 0;
};

double largest_gap(const std::vector<double>& a, const std::vector<double>& b) {
  double gap = 0, size = 1;
  for (std::size_t i = 0; i < a.size(); ++i) {
    gap = std::max(gap, std::fabs(a[i] - b[i]));
    size = std::max(size, std::fabs(a[i]));
  }
  return gap / size;
}

TEST(LongChains, ThreeMethodsAgree) {
  const RobotModel m = long_chain(100);
  Forward bodies(kFile, "articulated_body", m), halves(kFile, "divide_and_conquer", m),
      matrix(kInverse, "inertia_matrix", m);
  Random random(7);
  for (int i = 0; i < 5; ++i) {
    const auto q = random.configuration(m), qd = random.vector(100, -1, 1),
               tau = random.vector(100, -5, 5);
    const std::vector<TipWrench> tip{{{1, 2, -3}, {0.1, 0, 0.2}}};
    const auto a = bodies(q, qd, tau, tip);
    EXPECT_LT(largest_gap(a, halves(q, qd, tau, tip)), 1e-10);
    EXPECT_LT(largest_gap(a, matrix(q, qd, tau, tip)), 1e-10);
  }
}

TEST(LongChains, EveryNumberOfThreadsGivesTheSameBits) {
  const RobotModel m = long_chain(700);
  Forward one(kFile, "divide_and_conquer", m, "1"), two(kFile, "divide_and_conquer", m, "2"),
      five(kFile, "divide_and_conquer", m, "5");
  Random random(8);
  const auto q = random.configuration(m), qd = random.vector(700, -0.1, 0.1),
             tau = random.vector(700, -1, 1);
  const auto a = one(q, qd, tau);
  EXPECT_EQ(a, two(q, qd, tau));
  EXPECT_EQ(a, five(q, qd, tau));
}

TEST(LongChains, MasslessBodiesBetweenRunsDoNoHarm) {
  RobotModel m = long_chain(40);  // two joints at one place, over and over
  for (std::size_t i = 1; i < 39; i += 2) {
    m.joints[i].body = {};
    m.joints[i + 1].placement.p = {};
  }
  Forward bodies(kFile, "articulated_body", m), halves(kFile, "divide_and_conquer", m);
  Random random(9);
  const auto q = random.configuration(m), qd = random.vector(40, -1, 1),
             tau = random.vector(40, -5, 5);
  EXPECT_LT(largest_gap(bodies(q, qd, tau), halves(q, qd, tau)), 1e-9);
}

}  // namespace
}  // namespace robomosp::conformance
