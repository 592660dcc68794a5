// SPDX-License-Identifier: Apache-2.0
// Whole runs of forward_dynamics(): torques, wrenches and base motions over time against closed
// forms, inverse dynamics played back, and what the notes tell.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "recording/file.h"
#include "sim/forward_simulation.h"
#include "sim/recording_columns.h"
#include "support/records.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using recording::Recording;
using recording::RecordingPtr;
using sim::ForwardRun;
using test::unwrap;

RecordingPtr recorded_motion(std::vector<double> times, const std::string& stem,
                             const std::vector<std::vector<double>>& columns) {
  Recording r;
  r.columns.push_back({"time", "s", "", std::move(times)});
  for (std::size_t k = 0; k < columns.size(); ++k)
    r.columns.push_back({stem + std::to_string(k + 1), "", "", columns[k]});
  return std::make_shared<const Recording>(std::move(r));
}

class Runs : public ::testing::Test {
 protected:
  /// A block of 2 kg on a level rail along x of the mounting.
  RobotId sled(double friction = 0, double lower = -100, double upper = 100) {
    model::Link link;
    link.name = "block";
    link.joint = model::JointKind::prismatic;
    link.origin = model::Placement{};
    link.axis = {1, 0, 0};
    link.lower = lower, link.upper = upper;
    link.given = MassProperties{};
    link.given->mass = 2;
    link.given->inertia = {0.01, 0.01, 0.01, 0, 0, 0};
    link.drive.coulomb_positive = friction;
    link.drive.coulomb_negative = -friction;
    model::Robot r;
    r.links = {link};
    return test::make(bench.document, "sled" + std::to_string(++count), r);
  }
  RecordingPtr run(const ForwardRun& r) {
    const auto snapshot = bench.document.now();
    const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
    return unwrap(sim::forward_dynamics(simulator, r, progress));
  }
  static double end(const RecordingPtr& r, const std::string& name) {
    const recording::Column* c = r->find(name);
    EXPECT_TRUE(c) << name;
    return c ? c->values.back() : std::nan("");
  }
  static bool tells(const RecordingPtr& r, const std::string& words) {
    return std::any_of(r->notes.begin(), r->notes.end(),
                       [&](const std::string& n) { return n.find(words) != std::string::npos; });
  }
  static std::string all_notes(const RecordingPtr& r) {
    std::string out;
    for (const auto& n : r->notes) out += n + "\n";
    return out;
  }
  test::Workbench bench;
  NoProgress progress;
  int count = 0;
};

// 2 kg under 4 t N: x = t^3 / 3.
TEST_F(Runs, ARecordedForceIsLinearBetweenItsRows) {
  ForwardRun r;
  r.record = sled();
  r.duration = 1.5;
  r.recorded_tau = recorded_motion({0, 1, 2}, "tau", {{0, 4, 8}});
  const auto out = run(r);
  EXPECT_NEAR(end(out, "qd1"), 1.5 * 1.5, 1e-9);
  EXPECT_NEAR(end(out, "q1"), 1.5 * 1.5 * 1.5 / 3, 1e-9);
  EXPECT_NEAR(end(out, "tau1"), 6, 1e-12);
}

TEST_F(Runs, ARecordingWithoutTheColumnsThatAreNeededNamesThem) {
  ForwardRun r;
  r.record = sled();
  r.duration = 1;
  r.recorded_tau = recorded_motion({0, 1}, "torque", {{0, 4}});
  const auto snapshot = bench.document.now();
  const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
  const auto out = sim::forward_dynamics(simulator, r, progress);
  ASSERT_FALSE(out.ok());
  EXPECT_NE(out.error().sentence().find("tau1"), std::string::npos) << out.error().sentence();
}

// A wrench in world axes on a sled: only its x counts; constant and recorded parts add.
TEST_F(Runs, ARecordedWrenchIsOfTheWorldsAxesAndAddsToAConstantOne) {
  ForwardRun r;
  r.record = sled();
  r.duration = 1;
  r.load.constant = {1, 5, 7, 0, 0, 0};
  r.load.recorded =
      recorded_motion({0, 1}, "wrench", {{0, 3}, {2, 2}, {9, 9}, {1, 1}, {1, 1}, {1, 1}});
  const auto out = run(r);
  // 2 x'' = 1 + 3 t.
  EXPECT_NEAR(end(out, "qd1"), (1 + 1.5) / 2, 1e-9);
  EXPECT_NEAR(end(out, "q1"), (0.5 + 0.5) / 2, 1e-9);
}

// On a rail that shakes by a sin(w t) a block without friction stays where it is in the world.
TEST_F(Runs, OnAShakenRailAFreeBlockStaysInTheWorld) {
  ForwardRun r;
  r.record = sled();
  r.duration = 1;
  r.base_motion = sim::BaseExpressions{"0.05 m * sin(9 rad/s * time)", "", "", "", "", ""};
  r.qd = {-0.45};  // at rest in the world
  const auto out = run(r);
  EXPECT_NEAR(end(out, "q1"), -0.05 * std::sin(9.0), 1e-8);
  for (const double x : out->find("x")->values) EXPECT_NEAR(x, 0, 1e-8);
}

// The recording does not say how its base moved, so torques computed from it would lack that.
TEST_F(Runs, QuantitiesOfAMotionOnAMovingBaseAreRefusedAlsoAfterLoading) {
  ForwardRun r;
  r.record = sled();
  r.duration = 0.1;
  const auto fixed = run(r);
  r.base_motion = sim::BaseExpressions{"0.05 m * sin(9 rad/s * time)", "", "", "", "", ""};
  const auto shaken = run(r);
  const auto snapshot = bench.document.now();
  const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
  const std::vector<std::string> torque{"torque"};
  const auto compute = [&](const Recording& of) {
    return sim::with_quantities(simulator, of, torque, progress);
  };
  EXPECT_TRUE(compute(*fixed).ok());
  const std::string text = unwrap(recording::to_text(*shaken, "", progress));
  const Recording loaded = unwrap(recording::recording_from_text(text, progress)).recording;
  for (const Recording* of : {shaken.get(), &loaded}) {
    const auto refused = compute(*of);
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.error().sentence().find("fixed bases only"), std::string::npos)
        << refused.error().sentence();
  }
}

// On a rail that turns with w about z, r'' = w^2 r: r = r0 cosh(w t).
TEST_F(Runs, OnATurningRailABlockIsThrownOut) {
  ForwardRun r;
  r.record = sled();
  r.duration = 1;
  r.q = {0.2};
  r.base_motion = sim::BaseExpressions{"", "", "", "", "", "2 rad/s * time"};
  const auto out = run(r);
  EXPECT_NEAR(end(out, "q1"), 0.2 * std::cosh(2.0), 1e-8);
  EXPECT_NEAR(end(out, "y"), 0.2 * std::cosh(2.0) * std::sin(2.0), 1e-8);
}

// All six numbers at once against Newton's law in the world by differences of the block's own
// place: nothing but the rail acts, across itself, so along the rail's axis the acceleration is
// gravity's.
TEST_F(Runs, OnARailThatMovesInSixWaysTheBlockAcceleratesAlongItAsGravityAsks) {
  ForwardRun r;
  r.record = sled();
  r.duration = 1;
  r.sample_time = 5e-3;
  r.relative_tolerance = 1e-12;
  r.q = {0.3};
  r.base_motion = sim::BaseExpressions{"0.1 m * sin(3 rad/s * time)",
                                       "0.2 m * cos(2 rad/s * time)",
                                       "0.3 m/s^2 * time^2",
                                       "0.4 rad * sin(5 rad/s * time)",
                                       "0.5 rad * sin(2 rad/s * time)",
                                       "0.6 rad * sin(4 rad/s * time)"};
  const auto out = run(r);
  const auto& x = out->find("x")->values;
  const auto &y = out->find("y")->values, &z = out->find("z")->values;
  constexpr double h = 5e-3;
  for (const std::size_t i : {20U, 80U, 160U}) {
    const double t = h * static_cast<double>(i);
    const double p = 0.5 * std::sin(2 * t), w = 0.6 * std::sin(4 * t);
    const double along[3] = {std::cos(w) * std::cos(p), std::sin(w) * std::cos(p), -std::sin(p)};
    double sum = 0;
    const std::vector<double>* xyz[3] = {&x, &y, &z};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& v = *xyz[k];
      const double second =
          (-v[i - 2] + 16 * v[i - 1] - 30 * v[i] + 16 * v[i + 1] - v[i + 2]) / (12 * h * h);
      sum += along[k] * (second + (k == 2 ? 9.81 : 0));
    }
    EXPECT_NEAR(sum, 0, 1e-6) << t;
  }
}

TEST_F(Runs, ABaseMotionThatIsNoLengthIsRefusedByItsName) {
  ForwardRun r;
  r.record = sled();
  r.duration = 1;
  for (const char* wrong : {"0.1 rad * time / 1 s", "0.1 m * speed", "0.1 m / (time - 0.5 s)"}) {
    r.base_motion = sim::BaseExpressions{wrong, "", "", "", "", ""};
    const auto snapshot = bench.document.now();
    const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
    const auto out = sim::forward_dynamics(simulator, r, progress);
    ASSERT_FALSE(out.ok()) << wrong;
    EXPECT_NE(out.error().sentence().find("base_motion.x"), std::string::npos)
        << out.error().sentence();
  }
}

// The torques of inverse dynamics along a motion, played back from its start, give the motion. They
// are linear between rows 1 ms apart, which is wrong by h^2 / 8 of their curvature: some 1e-6.
TEST_F(Runs, TorquesOfInverseDynamicsPlayedBackGiveTheMotion) {
  const RobotId puma{bench.load("robots/puma560.rbt").number};
  const auto snapshot = bench.document.now();
  const auto model = unwrap(bench.derived.robot_model(*snapshot, puma, {0, 0, -9.81}, progress));
  const auto inverse = unwrap(sim::bind_inverse_dynamics(bench.registry, model, {}));
  const std::size_t n = model->dof(), rows = 1001;
  std::vector<double> times(rows), q(rows * n), qd(rows * n), qdd(rows * n);
  const double middle[6] = {0.2, -0.9, 0.4, 0.3, 0.6, -0.2};
  for (std::size_t i = 0; i < rows; ++i) {
    const double t = times[i] = 1e-3 * static_cast<double>(i);
    for (std::size_t j = 0; j < n; ++j) {
      const double w = 1.5 + 0.4 * static_cast<double>(j), a = 0.25;
      q[i * n + j] = middle[j] + a * std::sin(w * t);
      qd[i * n + j] = a * w * std::cos(w * t);
      qdd[i * n + j] = -a * w * w * std::sin(w * t);
    }
  }
  DynamicsBatch batch;
  // Coulomb friction jumps where a joint turns back, which rows cannot tell.
  batch.terms = kAllTerms & ~static_cast<std::uint32_t>(kFrictionTerm);
  batch.count = rows, batch.q = q, batch.qd = qd, batch.qdd = qdd;
  const auto tau = unwrap(sim::torques(inverse, batch, progress));
  std::vector<std::vector<double>> columns(n, std::vector<double>(rows));
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < n; ++j) columns[j][i] = tau[i * n + j];
  ForwardRun r;
  r.record = puma;
  r.duration = 1;
  r.q.assign(q.begin(), q.begin() + static_cast<std::ptrdiff_t>(n));
  r.qd.assign(qd.begin(), qd.begin() + static_cast<std::ptrdiff_t>(n));
  r.recorded_tau = recorded_motion(times, "tau", columns);
  r.at_limit = sim::AtLimit::ignore;
  r.friction = false;
  const auto out = run(r);
  for (std::size_t j = 0; j < n; ++j) {
    const auto& is = out->find("q" + std::to_string(j + 1))->values;
    for (std::size_t s = 0; s < is.size(); ++s)
      EXPECT_NEAR(is[s], q[s * 10 * n + j], 5e-6) << "joint " << j + 1 << ", sample " << s;
  }
}

TEST_F(Runs, NotesTellWhatHappenedAndWhen) {
  ForwardRun r;
  r.record = sled(4, -1, 0.5);
  r.duration = 3;
  r.qd = {2};
  const auto out = run(r);
  // 2 kg braked by 4 N: 0.5 m = 2 t - t^2, so at 1 - sqrt(0.5) s with 2 sqrt(0.5) m/s.
  EXPECT_TRUE(tells(out,
                    "joint 1 (block) met its upper limit at 0.29289 s with 1.414 m/s and "
                    "stayed there"))
      << all_notes(out);
  EXPECT_TRUE(tells(out, "integrated by dormand_prince")) << all_notes(out);
  EXPECT_TRUE(tells(out, "tolerance 1e-10 relative")) << all_notes(out);
  r.record = sled(4);
  r.recorded_tau = recorded_motion({0, 3}, "tau", {{0, 6}});  // 2 t N
  r.duration = 3;
  r.qd = {0.5};
  const auto slip = run(r);
  // 2 x'' = 2 t - 4: at rest where t^2 / 2 - 2 t + 0.5 = 0, at 2 - sqrt(3); on again at 2 s.
  EXPECT_TRUE(tells(slip, "joint 1 (block) came to rest at 0.26795 s")) << all_notes(slip);
  EXPECT_TRUE(tells(slip, "joint 1 (block) moved again at 2 s")) << all_notes(slip);
  EXPECT_NEAR(end(slip, "qd1"), 0.5, 1e-8) << "from 2 s to 3 s under t - 2";
}

}  // namespace
}  // namespace robomosp
