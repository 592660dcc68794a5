// SPDX-License-Identifier: Apache-2.0
// Mechanisms of any number of joints, batches of any number of samples and every instruction set
// through all solvers of joints: scratch that is one number too short is found under
// AddressSanitizer, and by the answers. Targets and states beyond what can be calculated with get
// an answer or a sentence.
#include <cmath>
#include <cstdlib>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>

#include "robotics/batch_kinematics.h"
#include "support/plugin_door.h"
#include "support/seed.h"

namespace robomosp::test {
namespace {

using conformance::kPi;
using conformance::Random;
using conformance::TableParams;

const char* const kSets[] = {"baseline", "avx2", "avx512"};

enum class Kind { revolute, slides, followers, balls, floating, branches };

RobotModel chain(std::size_t n, Kind kind, Random& random) {
  RobotModel m;
  m.name = "chain of " + std::to_string(n);
  const double length = 1.0 / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    JointModel j;
    j.name = "joint " + std::to_string(i + 1);
    j.parent = static_cast<std::int32_t>(i) - 1;
    if (kind == Kind::branches && i % 5 == 3) j.parent = static_cast<std::int32_t>(i) - 2;
    const bool bound = kind != Kind::balls && kind != Kind::floating;
    if (kind == Kind::slides && i % 7 == 2) j.type = JointType::prismatic;
    if (kind == Kind::balls && i % 4 == 1) j.type = JointType::spherical;
    if (kind == Kind::floating && i == 0) j.type = JointType::free;
    if (kind == Kind::followers && i % 6 == 4)
      j.coupling = {static_cast<std::int32_t>(i) - 1, 0.5, 0.1};
    if (bound) j.lower = -2, j.upper = 2;
    if (j.type == JointType::prismatic) j.lower = 0, j.upper = length;
    j.placement =
        conformance::multiply(conformance::shift(i == 0 ? 0 : length, 0, 0),
                              conformance::turn_x(i % 2 ? kPi / 2 : random.uniform(-kPi, kPi)));
    j.body = conformance::body(1, random.uniform(0, length), 0, 0, 1e-3, 2e-3, 1.5e-3);
    if (coordinate_count(j.type) == 1) {
      j.armature = 0.01;
      j.friction = {0.1, 0.05, -0.05};
    }
    m.joints.push_back(j);
  }
  m.tips = {{"tool", static_cast<std::int32_t>(n) - 1, conformance::shift(0, 0, 0.1)}};
  m.number_coordinates();
  return m;
}

/// Lengths about the places where vectors, blocks and tables end, and some others.
std::vector<std::size_t> lengths(Random& random, std::size_t most) {
  std::set<std::size_t> all{1, 2, 3, 5, 6, 7, 8, 9, 12, 13, 16, 17};
  for (const std::size_t edge : {32, 64, 128, 256, 512})
    for (const std::size_t n : {edge - 1, edge, edge + 1}) all.insert(n);
  for (int k = 0; k < 4; ++k) all.insert(static_cast<std::size_t>(random.uniform(1, 600)));
  all.erase(all.upper_bound(most), all.end());
  return {all.begin(), all.end()};
}

std::string plugin(const char* name) { return std::string(ROBOMOSP_PLUGIN_DIR) + "/" + name; }

template <class Interface>
TableParams table(const std::string& file, const char* name) {
  const rmp_plugin& p = open_plugin(file);
  for (std::uint32_t i = 0; i < p.provider_count; ++i)
    if (std::string_view(rmp_provider_at(p, i).name) == name)
      return TableParams(rmp_provider_at(p, i));
  return {};
}

void expect_finite(std::span<const double> values, const std::string& what) {
  for (const double x : values) ASSERT_TRUE(std::isfinite(x)) << what;
}

std::vector<double> states(const RobotModel& m, std::size_t count, Random& random) {
  std::vector<double> q;
  for (std::size_t i = 0; i < count; ++i) {
    const auto one = random.configuration(m);
    q.insert(q.end(), one.begin(), one.end());
  }
  return q;
}

class ChainLengths : public testing::Test {
 protected:
  void TearDown() override { unsetenv("ROBOMOSP_SIMD"); }
  Random random_{test::seed()};
  NoProgress none_;
};

TEST_F(ChainLengths, InverseKinematicsBySearchAnswersForEveryLengthAndWidth) {
  const std::string file = plugin("ik_numeric.so");
  TableParams params = table<IkSolver>(file, "numeric");
  params.set("restarts", 2.0).set("max_iterations", 4.0);
  for (const char* set : kSets) {
    setenv("ROBOMOSP_SIMD", set, 1);
    for (const std::size_t n : lengths(random_, 600))
      for (const Kind kind : {Kind::revolute, Kind::slides, Kind::followers, Kind::balls}) {
        if (kind != Kind::revolute && n > 66) continue;
        const RobotModel m = chain(n, kind, random_);
        const std::string where =
            m.name + ", kind " + std::to_string(static_cast<int>(kind)) + ", " + set;
        SCOPED_TRACE(where);
        const auto solver = make_provider<IkSolver>(file, "numeric");
        ASSERT_TRUE(solver->prepare(m, params).ok());
        for (const std::size_t count : {1UL, 2UL, 9UL}) {
          if (count > 1 && n > 260) continue;
          const auto q = states(m, count, random_);
          std::vector<Pose> targets;
          for (std::size_t i = 0; i < count; ++i)
            targets.push_back(conformance::tip_pose(m, q.data() + i * m.coordinate_count()));
          IkBatch batch;
          batch.targets = targets;
          batch.continuous = count == 9;
          std::vector<IkResult> results(count);
          const auto done = solver->solve(batch, results, none_);
          ASSERT_TRUE(done.ok()) << done.error().sentence();
          for (const IkResult& r : results) {
            ASSERT_EQ(r.q.size(), m.coordinate_count());
            expect_finite(r.q, where);
            if (r.status == IkStatus::solved) {
              EXPECT_LE(
                  conformance::position_gap(conformance::tip_pose(m, r.q.data()),
                                            targets[static_cast<std::size_t>(&r - results.data())]),
                  1e-8);
            }
          }
        }
      }
  }
}

TEST_F(ChainLengths, TargetsBeyondAllNumbersAreOutOfReachAtAFiniteDistance) {
  struct Solver {
    const char* file;
    const char* name;
    RobotModel model;
  };
  std::vector<Solver> solvers{
      {"ik_spherical_wrist.so", "spherical_wrist", conformance::puma560()},
      {"ik_srs.so", "srs", conformance::pa10()},
      {"ik_numeric.so", "numeric", conformance::puma560()},
  };
  for (const Kind kind : {Kind::revolute, Kind::slides, Kind::followers, Kind::balls})
    solvers.push_back({"ik_numeric.so", "numeric", chain(7, kind, random_)});
  for (const Solver& s : solvers) {
    const auto solver = make_provider<IkSolver>(plugin(s.file), s.name);
    ASSERT_TRUE(solver->prepare(s.model, table<IkSolver>(plugin(s.file), s.name)).ok());
    for (const double far : {1e8, 1e77, 1e155, 1e200, 1e300, 1.7e308})
      for (const bool all : {false, true}) {
        SCOPED_TRACE(std::string(s.name) + " of " + s.model.name + " at " + std::to_string(far));
        const std::vector<Pose> targets{conformance::shift(far, 0, 0),
                                        conformance::shift(-far, far, -far)};
        for (const Pose& target : targets) {
          IkBatch batch;
          batch.targets = {&target, 1};
          batch.all_solutions = all;
          std::vector<IkResult> results(1);
          const auto done = solver->solve(batch, results, none_);
          ASSERT_TRUE(done.ok()) << done.error().sentence();
          EXPECT_EQ(results[0].status, IkStatus::out_of_reach);
          ASSERT_EQ(results[0].q.size(), s.model.coordinate_count());
          expect_finite(results[0].q, s.name);
          const double distance = std::min(&target == targets.data() ? far : std::sqrt(3.0) * far,
                                           std::numeric_limits<double>::max());
          EXPECT_NEAR(results[0].shortfall / distance, 1, 1e-3);
          EXPECT_NEAR(results[0].position_error / distance, 1, 1e-3);
          EXPECT_NE(results[0].detail.find("out of reach by"), std::string::npos)
              << results[0].detail;
        }
      }
  }
}

TEST_F(ChainLengths, InverseDynamicsAndForwardDynamicsAgreeForEveryLengthAndWidth) {
  struct Forward {
    const char* file;
    const char* name;
    std::size_t most;
  };
  const Forward solvers[] = {{"dynamics_articulated.so", "articulated_body", 600},
                             {"dynamics_articulated.so", "constrained", 600},
                             {"dynamics_articulated.so", "divide_and_conquer", 600},
                             {"dynamics_newton_euler.so", "inertia_matrix", 140}};
  const std::string ne = plugin("dynamics_newton_euler.so");
  for (const char* set : kSets)
    for (const std::size_t n : lengths(random_, 600))
      for (const Kind kind : {Kind::revolute, Kind::slides, Kind::followers, Kind::balls,
                              Kind::floating, Kind::branches}) {
        if (kind != Kind::revolute && n > 34) continue;
        const RobotModel m = chain(n, kind, random_);
        const std::size_t dof = m.dof();
        SCOPED_TRACE(m.name + ", kind " + std::to_string(static_cast<int>(kind)) + ", " + set);
        TableParams params = table<InverseDynamics>(ne, "newton_euler");
        params.set("instructions", std::string(set));
        const auto inverse = make_provider<InverseDynamics>(ne, "newton_euler");
        ASSERT_TRUE(inverse->prepare(m, params).ok());
        for (const std::size_t count : {1UL, 3UL, 8UL, 17UL}) {
          if (count > 3 && n > 66) continue;
          const auto q = states(m, count, random_);
          const auto qd = random_.vector(count * dof, -1, 1),
                     qdd = random_.vector(count * dof, -1, 1);
          const TipWrench wrench{{1, 2, 3}, {0.1, 0.2, 0.3}};
          // Exactly what is asked for, so that a number more is found.
          std::vector<double> scratch(inverse->scratch_size());
          DynamicsBatch batch;
          batch.count = count;
          batch.q = q, batch.qd = qd, batch.qdd = qdd;
          batch.tip = {&wrench, 1};
          batch.scratch = scratch;
          std::vector<double> tau(count * dof);
          ASSERT_TRUE(inverse->torques(batch, tau, none_).ok());
          expect_finite(tau, "tau");
          if (n <= 140) {
            std::vector<double> M(count * dof * dof), by_q(M.size()), by_qd(M.size()),
                Y(count * dof * 10 * n);
            EXPECT_TRUE(inverse->inertia(batch, M, none_).ok());
            expect_finite(M, "M");
            if (const auto d = inverse->derivatives(batch, by_q, by_qd, none_); !d.ok()) {
              EXPECT_EQ(d.error().code, ErrorCode::unsupported);
            }
            if (const auto r = inverse->regressor(batch, Y, none_); !r.ok()) {
              EXPECT_EQ(r.error().code, ErrorCode::unsupported);
            }
          }
          std::vector<Energy> energies(count);
          EXPECT_TRUE(inverse->energy(batch, energies, none_).ok());
          for (const Forward& f : solvers) {
            if (n > f.most) continue;
            SCOPED_TRACE(f.name);
            const auto forward = make_provider<ForwardDynamics>(plugin(f.file), f.name);
            TableParams own = table<ForwardDynamics>(plugin(f.file), f.name);
            if (own.has("instructions")) own.set("instructions", std::string(set));
            if (const auto ready = forward->prepare(m, own); !ready.ok()) {
              EXPECT_EQ(ready.error().code, ErrorCode::unsupported) << ready.error().sentence();
              continue;
            }
            std::vector<double> room(forward->scratch_size()), back(count * dof);
            batch.scratch = room;
            batch.tau = tau;
            const auto done = forward->accelerations(batch, back, none_);
            if (!done.ok()) {
              EXPECT_EQ(done.error().code, ErrorCode::unsupported) << done.error().sentence();
              continue;
            }
            for (std::size_t i = 0; i < back.size(); ++i)
              ASSERT_NEAR(back[i], qdd[i], 1e-6 * static_cast<double>(n * n)) << i;
            if (n > 34) continue;
            std::vector<double> by_q(count * dof * dof), by_qd(by_q.size()), by_tau(by_q.size());
            if (const auto d = forward->derivatives(batch, by_q, by_qd, by_tau, none_); !d.ok()) {
              EXPECT_EQ(d.error().code, ErrorCode::unsupported) << d.error().sentence();
            }
          }
          batch.scratch = scratch;
        }
      }
}

TEST_F(ChainLengths, BatchKinematicsAreThoseOfTheChainForEveryLengthAndWidth) {
  using spatial::InstructionSet;
  for (const InstructionSet set :
       {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512})
    for (const std::size_t n : lengths(random_, 600))
      for (const Kind kind : {Kind::revolute, Kind::slides, Kind::followers, Kind::balls,
                              Kind::floating, Kind::branches}) {
        const RobotModel m = chain(n, kind, random_);
        const robotics::BatchKinematics batch(m, set);
        std::vector<double> scratch(batch.scratch_size());
        for (const std::size_t count : {1UL, 7UL, 9UL}) {
          if (count > 1 && n > 140) continue;
          const auto q = states(m, count, random_);
          std::vector<Pose> frames(count * n), tips(count), again(count);
          std::vector<double> jacobians(count * 6 * m.dof());
          batch.joint_frames(q, frames, scratch);
          batch.tip_poses(0, q, tips, scratch);
          batch.jacobians(0, q, robotics::JacobianFrame::tip, again, jacobians, scratch);
          expect_finite(jacobians, "J");
          for (std::size_t i = 0; i < count; ++i) {
            const Pose expected = conformance::tip_pose(m, q.data() + i * m.coordinate_count());
            EXPECT_LE(conformance::position_gap(tips[i], expected), 1e-11) << m.name;
            EXPECT_LE(conformance::position_gap(again[i], expected), 1e-11) << m.name;
          }
        }
      }
}

}  // namespace
}  // namespace robomosp::test
