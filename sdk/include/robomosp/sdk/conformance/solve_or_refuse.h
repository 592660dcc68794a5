// SPDX-License-Identifier: Apache-2.0
// Every provider on every mechanism: it solves, or it refuses with a sentence; it never crashes,
// hangs or answers with rubbish (layer: contract helper for tests, GoogleTest, header-only). The
// suites of inverse kinematics and dynamics run it on each of their providers.
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/mechanisms.h>
#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>

namespace robomosp::conformance {

/// Serial arms, trees, a floating base with a ball joint and followers, a loop, a gantry, a chain
/// of 40 joints, one joint, and a mechanism with a fixed tip.
[[nodiscard]] inline std::vector<RobotModel> all_mechanisms() {
  std::vector<RobotModel> all{
      puma560(),      pa10(),       tree(), floating_manipulator(), four_bar(4, 1, 3, 3),
      long_chain(40), long_chain(1)};
  RobotModel fixed = pa10();
  fixed.name = "tip at the base";
  fixed.tips[0].joint = -1;
  all.push_back(std::move(fixed));
  return all;
}

/// Where every joint is at rest: zeros, within limits, and quaternions of no rotation.
[[nodiscard]] inline std::vector<double> rest(const RobotModel& model) {
  std::vector<double> q(model.coordinate_count(), 0.0);
  for (const JointModel& j : model.joints) {
    if (j.is_coupled()) continue;
    const auto at = static_cast<std::size_t>(j.q_index);
    if (j.type == JointType::spherical) q[at] = 1;
    else if (j.type == JointType::free) q[at + 3] = 1;
    else q[at] = std::fmin(std::fmax(0, j.lower), j.upper);
  }
  return q;
}

/// A refusal is an error with a sentence, and no fault of the program.
inline void expect_refusal(const Error& e) {
  EXPECT_FALSE(e.message.empty());
  EXPECT_TRUE(e.code == ErrorCode::unsupported || e.code == ErrorCode::invalid_argument ||
              e.code == ErrorCode::unreachable)
      << to_string(e.code) << ": " << e.sentence();
}
inline void expect_finite(const std::vector<double>& values) {
  for (const double v : values) ASSERT_TRUE(std::isfinite(v));
}

/// `make` gives a new solver, not yet prepared.
inline void solve_or_refuse(const std::function<std::unique_ptr<IkSolver>()>& make,
                            const Params& params) {
  NoProgress none;
  for (const RobotModel& model : all_mechanisms()) {
    SCOPED_TRACE(model.name);
    const auto solver = make();
    ASSERT_NE(solver, nullptr);
    if (const auto prepared = solver->prepare(model, params); !prepared.ok()) {
      expect_refusal(prepared.error());
      continue;
    }
    const Pose targets[] = {shift(0.3, 0.1, 0.2), multiply(shift(0.1, -0.2, 0.4), turn_x(1.0))};
    const std::vector<double> seed = rest(model);
    const auto check = [&](const IkBatch& batch, const char* what) {
      SCOPED_TRACE(what);
      std::vector<IkResult> results(batch.samples());
      const auto solved = solver->solve(batch, results, none);
      if (!solved.ok()) return expect_refusal(solved.error());
      for (const IkResult& r : results) {
        expect_finite(r.q);
        EXPECT_EQ(r.q.size() % model.coordinate_count(), 0U);
        EXPECT_TRUE(r.status != IkStatus::solved || !r.q.empty());
      }
    };
    IkBatch batch;
    batch.targets = targets;
    check(batch, "two poses");
    batch.seeds = seed;
    check(batch, "two poses from a seed");
    batch.all_solutions = true;
    check(batch, "all solutions");
    batch.all_solutions = false;
    for (const IkObjective objective : {IkObjective::centre, IkObjective::manipulability,
                                        IkObjective::limits, IkObjective::clearance}) {
      batch.objective = objective;
      check(batch, "an objective");
    }
    batch.objective = IkObjective::none;
    const double angle[] = {0.4};
    batch.arm_angles = angle;
    check(batch, "an arm angle");
    batch.arm_angles = {};
    const IkGoal goals[] = {{0, kIkPosition, 1}, {0, kIkAxis, 0.5}};
    batch.goals = goals;
    check(batch, "parts of poses");
    batch.goals = {goals, 1};
    check(batch, "the position only");
    batch.goals = {};
    batch.targets = {};
    batch.seeds = {};
    check(batch, "nothing");
  }
}

inline void solve_or_refuse(const std::function<std::unique_ptr<InverseDynamics>()>& make,
                            const Params& params) {
  NoProgress none;
  for (const RobotModel& model : all_mechanisms()) {
    SCOPED_TRACE(model.name);
    const auto solver = make();
    ASSERT_NE(solver, nullptr);
    if (const auto prepared = solver->prepare(model, params); !prepared.ok()) {
      expect_refusal(prepared.error());
      continue;
    }
    const std::vector<double> q = rest(model), qd(model.dof(), 0.3), qdd(model.dof(), -0.2);
    std::vector<double> scratch(solver->scratch_size()), tau(model.dof()),
        square(model.dof() * model.dof()), other(square.size()),
        regressor(model.dof() * 10 * model.joints.size());
    std::vector<Energy> energy(1);
    const TipWrench wrench[] = {{{1, 2, 3}, {0.1, 0.2, 0.3}}};
    const BaseMotion base[] = {{{0, 0, -9.81}, {1, 0, 0}, {0, 0.5, 0}, {0, 0, 0.2}}};
    DynamicsBatch batch;
    batch.count = 1;
    batch.q = q, batch.qd = qd, batch.qdd = qdd, batch.scratch = scratch;
    const auto check = [&](const Result<void>& done, const std::vector<double>& values) {
      if (!done.ok()) expect_refusal(done.error());
      else expect_finite(values);
    };
    check(solver->torques(batch, tau, none), tau);
    batch.tip = wrench;
    batch.base = base;
    check(solver->torques(batch, tau, none), tau);
    batch.tip = {};
    batch.base = {};
    check(solver->inertia(batch, square, none), square);
    check(solver->derivatives(batch, square, other, none), square);
    check(solver->regressor(batch, regressor, none), regressor);
    check(solver->energy(batch, energy, none), {energy[0].kinetic, energy[0].potential});
  }
}

inline void solve_or_refuse(const std::function<std::unique_ptr<ForwardDynamics>()>& make,
                            const Params& params) {
  NoProgress none;
  for (const RobotModel& model : all_mechanisms()) {
    SCOPED_TRACE(model.name);
    const auto solver = make();
    ASSERT_NE(solver, nullptr);
    if (const auto prepared = solver->prepare(model, params); !prepared.ok()) {
      expect_refusal(prepared.error());
      continue;
    }
    const std::vector<double> q = rest(model), qd(model.dof(), 0.3), tau(model.dof(), 0.5);
    std::vector<double> scratch(solver->scratch_size()), qdd(model.dof()),
        square(model.dof() * model.dof()), by_qd(square.size()), by_tau(square.size()),
        forces(6 * model.loops.size());
    DynamicsBatch batch;
    batch.count = 1;
    batch.q = q, batch.qd = qd, batch.tau = tau, batch.scratch = scratch;
    const auto check = [&](const Result<void>& done, const std::vector<double>& values) {
      if (!done.ok()) expect_refusal(done.error());
      else expect_finite(values);
    };
    check(solver->accelerations(batch, qdd, none), qdd);
    std::size_t rows = 0;
    for (const LoopModel& l : model.loops)
      for (std::uint32_t bit = 1; bit <= kLoopWeld; bit <<= 1) rows += (l.fixed & bit) ? 1 : 0;
    forces.resize(rows);
    check(solver->constrained(batch, qdd, forces, none), qdd);
    check(solver->derivatives(batch, square, by_qd, by_tau, none), square);
  }
}

}  // namespace robomosp::conformance
