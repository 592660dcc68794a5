// SPDX-License-Identifier: Apache-2.0
// Provider "newton_euler" and "inertia_matrix": the SDK's suite and published figures.
#include <limits>

#include <robomosp/sdk/conformance/dynamics_suite.h>
#include <robomosp/sdk/conformance/mechanisms.h>

#include "support/reference_dynamics.h"

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/dynamics_newton_euler.so";

std::vector<RobotModel> models() {
  return {puma560(), puma560_modified(),    pa10(), pa10_nus(), panda(), planar_rods(), scara(),
          tree(),    floating_manipulator()};
}

INSTANTIATE_TEST_SUITE_P(Composite, DynamicsConformance,
                         testing::ValuesIn(dynamics_cases(kFile, "newton_euler", "inertia_matrix",
                                                          models())),
                         dynamics_case_name);
INSTANTIATE_TEST_SUITE_P(Columns, DynamicsConformance,
                         testing::ValuesIn(dynamics_cases(kFile, "newton_euler", "inertia_matrix",
                                                          {puma560(), scara(), tree(),
                                                           floating_manipulator()},
                                                          {{"inertia_method", "columns"}})),
                         dynamics_case_name);

std::vector<double> gravity_torques_at_zero(const RobotModel& m) {
  const rmp_provider* provider = *find_provider<InverseDynamics>(kFile, "newton_euler");
  auto solver = create<InverseDynamics>(*provider);
  EXPECT_TRUE(solver->prepare(m, TableParams(*provider)).ok());
  std::vector<double> q(m.dof()), tau(m.dof()), scratch(solver->scratch_size());
  DynamicsBatch b;
  b.count = 1, b.q = q, b.scratch = scratch;
  NoProgress none;
  EXPECT_TRUE(solver->torques(b, tau, none).ok());
  return tau;
}

// The paper's third validation case; digits from an evaluation independent of this project, the
// paper prints {0, 37.48366, 0.248928, 0, 0, 0}.
TEST(NewtonEuler, GivesThePublishedPumaGravityTorques) {
  const double expected[] = {0, 37.48366665, 0.24892875, 0, 0, 0};
  const auto tau = gravity_torques_at_zero(puma560());
  const auto gradient = potential_gradient(puma560(), std::vector<double>(6));
  for (std::size_t j = 0; j < 6; ++j) {
    EXPECT_NEAR(tau[j], expected[j], 1e-8) << "joint " << j + 1;
    EXPECT_NEAR(tau[j], gradient[j], 1e-9) << "joint " << j + 1;
  }
}

TEST(NewtonEuler, GivesTheGravityTorquesOfTheModifiedPuma) {
  const double expected[] = {0, -36.98581, 0.24892875, 0, 0, 0};
  const auto tau = gravity_torques_at_zero(puma560_modified());
  const auto gradient = potential_gradient(puma560_modified(), std::vector<double>(6));
  for (std::size_t j = 0; j < 6; ++j) {
    EXPECT_NEAR(tau[j], expected[j], 5e-6) << "joint " << j + 1;
    EXPECT_NEAR(tau[j], gradient[j], 1e-9) << "joint " << j + 1;
  }
}

// One prepared pair of solvers with its states.
struct Bench {
  Bench(const RobotModel& m, const char* instructions, const char* method = "composite")
      : model(m) {
    const rmp_provider* id = *find_provider<InverseDynamics>(kFile, "newton_euler");
    const rmp_provider* fd = *find_provider<ForwardDynamics>(kFile, "inertia_matrix");
    inverse = create<InverseDynamics>(*id);
    forward = create<ForwardDynamics>(*fd);
    TableParams a(*id), b(*fd);
    for (TableParams* params : {&a, &b})
      params->set("instructions", instructions), params->set("inertia_method", method);
    EXPECT_TRUE(inverse->prepare(model, a).ok());
    EXPECT_TRUE(forward->prepare(model, b).ok());
    scratch.resize(std::max(inverse->scratch_size(), forward->scratch_size()));
  }
  void fill(std::size_t samples) {
    Random random(11);
    count = samples;
    q.clear();
    for (std::size_t i = 0; i < count; ++i)
      for (const double x : random.configuration(model)) q.push_back(x);
    qd = random.vector(count * model.dof(), -2, 2), u = random.vector(count * model.dof(), -5, 5);
    wrenches.resize(count), bases.resize(count);
    for (TipWrench& w : wrenches) w = {three(random, 5), three(random, 1)};
    for (BaseMotion& b : bases)
      b = {three(random, 10), three(random, 2), three(random, 2), three(random, 3)};
  }
  static Vec3 three(Random& random, double size) {
    const auto v = random.vector(3, -size, size);
    return {v[0], v[1], v[2]};
  }
  enum class What { torques, inertia, accelerations };
  // Samples first..first+n in one call.
  std::vector<double> compute(What what, std::size_t first, std::size_t n, bool moving_base,
                              std::int32_t tip, std::uint32_t terms = kAllTerms) {
    const std::size_t v = model.dof(), c = model.coordinate_count();
    DynamicsBatch b;
    b.count = n, b.scratch = scratch, b.terms = terms, b.tip_index = tip;
    b.q = std::span(q).subspan(first * c, n * c);
    b.qd = std::span(qd).subspan(first * v, n * v);
    b.tip = std::span(wrenches).subspan(first, n);
    if (moving_base) b.base = std::span(bases).subspan(first, n);
    const auto given = std::span(u).subspan(first * v, n * v);
    std::vector<double> out(n * v * (what == What::inertia ? v : 1));
    NoProgress none;
    Result<void> r;
    if (what == What::inertia) {
      r = inverse->inertia(b, out, none);
    } else if (what == What::torques) {
      b.qdd = given;
      r = inverse->torques(b, out, none);
    } else {
      b.tau = given;
      r = forward->accelerations(b, out, none);
    }
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    return out;
  }
  RobotModel model;
  std::unique_ptr<InverseDynamics> inverse;
  std::unique_ptr<ForwardDynamics> forward;
  std::vector<double> scratch, q, qd, u;
  std::vector<TipWrench> wrenches;
  std::vector<BaseMotion> bases;
  std::size_t count = 0;
};
constexpr Bench::What kKinds[] = {Bench::What::torques, Bench::What::inertia,
                                  Bench::What::accelerations};

class EveryInstructionSet : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(NewtonEuler, EveryInstructionSet,
                         testing::Values("avx512", "avx2", "baseline"));

TEST_P(EveryInstructionSet, ManySamplesAtOnceGiveWhatEachGivesAlone) {
  constexpr std::size_t kCount = 13;  // no multiple of any number of lanes
  for (const RobotModel& m : models())
    for (const char* method : {"composite", "columns"}) {
      Bench bench(m, GetParam(), method);
      bench.fill(kCount);
      for (const Bench::What what : kKinds)
        for (const bool moving : {false, true}) {
          const auto tip = static_cast<std::int32_t>(m.tips.size()) - 1;
          const auto many = bench.compute(what, 0, kCount, moving, tip);
          const std::size_t width = many.size() / kCount;
          for (std::size_t i = 0; i < kCount; ++i) {
            const auto one = bench.compute(what, i, 1, moving, tip);
            double size = 0;
            for (const double x : one) size = std::max(size, std::fabs(x));
            // Accelerations by as much more as the inertia is ill conditioned.
            const double allowed = (what == Bench::What::accelerations ? 1e-10 : 1e-13) * size;
            for (std::size_t k = 0; k < width; ++k)
              EXPECT_NEAR(many[i * width + k], one[k], allowed) << m.name << ", sample " << i;
          }
        }
    }
}

TEST_P(EveryInstructionSet, AResultDependsNeitherOnItsPlaceNorOnThreads) {
  Bench bench(puma560(), GetParam());
  constexpr std::size_t kCount = 60001;  // enough for several threads
  bench.fill(kCount);
  for (const Bench::What what : kKinds) {
    const auto all = bench.compute(what, 0, kCount, false, 0);
    const std::size_t width = all.size() / kCount;
    for (const std::size_t at : {std::size_t{0}, std::size_t{5}, kCount / 2, kCount - 3}) {
      const auto few = bench.compute(what, at, 3, false, 0);
      for (std::size_t k = 0; k < few.size(); ++k)
        ASSERT_EQ(few[k], all[at * width + k]) << "from sample " << at;
    }
  }
}

TEST_P(EveryInstructionSet, TheFirstBadSampleOfABatchIsNamed) {
  Bench bench(puma560(), GetParam());
  bench.fill(40000);
  bench.q[12345 * 6 + 2] = std::numeric_limits<double>::infinity();
  bench.q[39990 * 6] = std::numeric_limits<double>::quiet_NaN();
  DynamicsBatch b;
  b.count = bench.count, b.q = bench.q, b.scratch = bench.scratch;
  std::vector<double> tau(bench.q.size());
  NoProgress none;
  for (const auto& r :
       {bench.inverse->torques(b, tau, none), bench.forward->accelerations(b, tau, none)}) {
    ASSERT_FALSE(r.ok());
    EXPECT_NE(r.error().sentence().find("sample 12346 "), std::string::npos)
        << r.error().sentence();
  }
}

// A robot on a moving base is the same robot on a free, massless body that moves so.
TEST_P(EveryInstructionSet, AMovingBaseIsAFreeBodyThatMovesSo) {
  const RobotModel arm = puma560();
  RobotModel carried;
  carried.name = "carried";
  add_joint(carried, "carrier", -1, JointType::free, Pose{}, MassProperties{});
  for (JointModel j : arm.joints) {
    ++j.parent;
    carried.joints.push_back(j);
  }
  carried.tips = arm.tips;
  ++carried.tips[0].joint;
  carried.number_coordinates();
  Bench fixed(arm, GetParam());
  fixed.fill(9);
  for (std::size_t i = 0; i < fixed.count; ++i) {
    const BaseMotion& base = fixed.bases[i];
    carried.gravity = base.gravity;
    std::vector<double> q{0, 0, 0, 1, 0, 0, 0}, qd{0, 0, 0}, qdd;
    const auto append = [](std::vector<double>& to, const auto& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    append(qd, base.angular_velocity);
    append(qdd, base.acceleration), append(qdd, base.angular_acceleration);
    append(q, std::span(fixed.q).subspan(i * 6, 6));
    append(qd, std::span(fixed.qd).subspan(i * 6, 6));
    append(qdd, std::span(fixed.u).subspan(i * 6, 6));
    const rmp_provider* provider = *find_provider<InverseDynamics>(kFile, "newton_euler");
    auto solver = create<InverseDynamics>(*provider);
    ASSERT_TRUE(solver->prepare(carried, TableParams(*provider)).ok());
    std::vector<double> expected(12), scratch(solver->scratch_size());
    DynamicsBatch b;
    b.count = 1, b.q = q, b.qd = qd, b.qdd = qdd, b.scratch = scratch;
    b.tip = std::span(fixed.wrenches).subspan(i, 1);
    NoProgress none;
    ASSERT_TRUE(solver->torques(b, expected, none).ok());
    const auto many = fixed.compute(Bench::What::torques, 0, fixed.count, true, 0);
    const auto one = fixed.compute(Bench::What::torques, i, 1, true, 0);
    std::vector<double> sum(6);
    for (const std::uint32_t term :
         {kGravityTerm, kInertialTerm, kVelocityTerm, kFrictionTerm, kExternalTerm, kSpringTerm}) {
      const auto part = fixed.compute(Bench::What::torques, i, 1, true, 0, term);
      for (std::size_t k = 0; k < 6; ++k) sum[k] += part[k];
    }
    for (std::size_t k = 0; k < 6; ++k) {
      EXPECT_NEAR(one[k], expected[6 + k], 1e-11);
      EXPECT_NEAR(many[i * 6 + k], expected[6 + k], 1e-11);
      EXPECT_NEAR(sum[k], expected[6 + k], 1e-11) << "terms add up";
    }
    // Forward dynamics on the same base leads back.
    Bench back = Bench(arm, GetParam());
    back.fill(fixed.count);
    back.u = many;
    const auto qdd_again = back.compute(Bench::What::accelerations, 0, back.count, true, 0);
    for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(qdd_again[i * 6 + k], fixed.u[i * 6 + k], 1e-9);
  }
}

TEST_P(EveryInstructionSet, TorquesAgreeWithVirtualPower) {
  for (const RobotModel& m :
       {puma560(), puma560_modified(), pa10(), panda(), scara(), tree(), long_chain(30)}) {
    Bench bench(m, GetParam());
    bench.fill(9);
    const std::uint32_t terms = kAllTerms & ~static_cast<std::uint32_t>(kExternalTerm);
    const auto many = bench.compute(Bench::What::torques, 0, bench.count, false, 0, terms);
    const std::size_t n = m.dof();
    for (std::size_t i = 0; i < bench.count; ++i) {
      const auto part = [&](const std::vector<double>& v) {
        return std::vector<double>(v.begin() + static_cast<std::ptrdiff_t>(i * n),
                                   v.begin() + static_cast<std::ptrdiff_t>((i + 1) * n));
      };
      const auto expected =
          test::reference_torques(m, part(bench.q), part(bench.qd), part(bench.u));
      const auto one = bench.compute(Bench::What::torques, i, 1, false, 0, terms);
      double size = 1;
      for (const double x : expected) size = std::max(size, std::fabs(x));
      for (std::size_t k = 0; k < n; ++k) {
        EXPECT_NEAR(one[k], expected[k], 1e-12 * size) << m.name << ", joint " << k + 1;
        EXPECT_NEAR(many[i * n + k], expected[k], 1e-12 * size) << m.name << ", joint " << k + 1;
      }
    }
  }
}

}  // namespace
}  // namespace robomosp::conformance
