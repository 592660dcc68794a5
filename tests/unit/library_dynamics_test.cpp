// SPDX-License-Identifier: Apache-2.0
// Kinematics and dynamics of every robot of the library, loops left open: all providers agree, and
// forward dynamics undoes inverse dynamics, to 1e-10 of the greatest number.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/mechanisms.h>

#include "robotics/kinematics.h"
#include "sim/simulate.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using test::unwrap;

constexpr double kAgree = 1e-10;

/// Generated code takes a compiler's time for each robot and has a suite of its own.
bool is_compiled(const ProviderInfo& p) { return p.name == "compiled"; }

double greatest(std::span<const double> all) {
  double most = 1;
  for (const double x : all) most = std::max(most, std::fabs(x));
  return most;
}

void expect_agree(std::span<const double> a, std::span<const double> b, const std::string& what) {
  ASSERT_EQ(a.size(), b.size()) << what;
  const double size = std::max(greatest(a), greatest(b));
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], kAgree * size) << what;
}

std::vector<fs::path> robots() {
  std::vector<fs::path> out;
  for (const auto& e : fs::directory_iterator(test::Workbench::library() / "robots"))
    if (e.path().extension() == ".rbt") out.push_back(e.path());
  std::sort(out.begin(), out.end());
  return out;
}

TEST(LibraryDynamics, AllProvidersAgreeAndForwardUndoesInverseForEveryRobot) {
  test::Workbench bench;
  NoProgress progress;
  const auto files = robots();
  ASSERT_GE(files.size(), 22U);
  std::mt19937_64 random(20251);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::size_t moved = 0;
  for (const fs::path& file : files) {
    const std::string name = file.stem().string();
    const RobotId id{bench.load(file.string()).number};
    const auto snapshot = bench.document.now();
    auto tree = *unwrap(bench.derived.robot_model(*snapshot, id, {0.3, -0.2, -9.81}, progress));
    tree.loops.clear();
    const auto model = std::make_shared<const RobotModel>(std::move(tree));
    const std::size_t n = model->dof(), c = model->coordinate_count();
    constexpr std::size_t kCount = 5;
    std::vector<double> q(kCount * c), qd(kCount * n), qdd(kCount * n);
    for (auto* all : {&q, &qd, &qdd})
      for (double& x : *all) x = uniform(random);
    for (std::size_t i = 0; i < kCount; ++i)
      for (const JointModel& j : model->joints) {
        if (coordinate_count(j.type) < 4 || j.is_coupled()) continue;
        double* o = &q[i * c + static_cast<std::size_t>(j.q_index + coordinate_count(j.type) - 4)];
        const double l = std::sqrt(o[0] * o[0] + o[1] * o[1] + o[2] * o[2] + o[3] * o[3]);
        for (int k = 0; k < 4; ++k) o[k] /= l;
      }
    // Frames by plain products of matrices.
    std::vector<Pose> frames(model->joints.size());
    robotics::forward_kinematics(*model, std::span(q).first(c), frames);
    const auto expected = conformance::joint_frames(*model, q.data());
    for (std::size_t j = 0; j < frames.size(); ++j) {
      for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(frames[j].p[k], expected[j].p[k], 1e-12);
      for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(frames[j].R[k], expected[j].R[k], 1e-12);
    }
    const TipWrench push{{3, -4, 5}, {0.3, 0.2, -0.1}};
    DynamicsBatch batch;
    batch.count = kCount, batch.q = q, batch.qd = qd, batch.qdd = qdd;
    batch.tip = std::span(&push, 1);
    std::vector<double> tau, inertia;
    for (const ProviderInfo& p : bench.registry.list(InverseDynamics::kInterfaceId)) {
      if (is_compiled(p)) continue;
      model::ProviderChoice choice;
      choice.name = p.name;
      const auto bound = sim::bind_inverse_dynamics(bench.registry, model, choice);
      if (!bound.ok()) continue;
      const auto t = sim::torques(*bound, batch, progress);
      const auto m = sim::inertia(*bound, batch, progress);
      if (!t.ok() || !m.ok()) continue;
      if (tau.empty()) tau = *t, inertia = *m;
      expect_agree(*t, tau, name + ": torques by " + p.name);
      expect_agree(*m, inertia, name + ": inertia by " + p.name);
    }
    ASSERT_EQ(tau.size(), kCount * n) << name;
    DynamicsBatch back = batch;
    back.qdd = {}, back.tau = tau;
    std::size_t methods = 0;
    for (const ProviderInfo& p : bench.registry.list(ForwardDynamics::kInterfaceId)) {
      if (is_compiled(p)) continue;
      model::ProviderChoice choice;
      choice.name = p.name;
      const auto bound = sim::bind_forward_dynamics(bench.registry, model, choice);
      if (!bound.ok()) continue;
      const auto a = sim::accelerations(*bound, back, progress);
      if (!a.ok()) continue;  // such as bodies without mass, which is said
      ++methods;
      // What a torque of 1 N m does decides how exactly torques tell accelerations.
      double lightest = 1;
      for (std::size_t i = 0; i < kCount; ++i)
        for (std::size_t r = 0; r < n; ++r)
          lightest = std::min(lightest, inertia[(i * n + r) * n + r]);
      const double size = std::max(greatest(qdd), 1e-5 * greatest(tau) / lightest);
      for (std::size_t k = 0; k < a->size(); ++k)
        EXPECT_NEAR((*a)[k], qdd[k], kAgree * size) << name << " by " << p.name;
    }
    moved += methods >= 3;
    EXPECT_TRUE(methods == 0 || methods >= 3) << name << " by " << methods << " methods";
  }
  EXPECT_GE(moved, 18U) << "the others have bodies without mass";
}

}  // namespace
}  // namespace robomosp
