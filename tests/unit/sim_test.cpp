// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <random>
#include <sstream>
#include <stdexcept>

#include <gtest/gtest.h>

#include "kernel/text.h"
#include "model/placement.h"
#include "recording/compare.h"
#include "recording/file.h"
#include "robotics/kinematics.h"
#include "sim/joint_rates.h"
#include "sim/simulate.h"
#include "support/reference_dynamics.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using recording::Recording;
using test::unwrap;
using test::Workbench;

std::vector<double> row(const Recording& r, const std::string& stem, std::size_t i) {
  std::vector<double> v;
  for (std::size_t j = 1; j <= r.dof; ++j) v.push_back(r.find(stem + std::to_string(j))->values[i]);
  return v;
}

TEST(JointRates, DerivativesOfAQuarticAreExactAtUnevenTimes) {
  std::vector<double> times, values;
  for (int i = 0; i < 12; ++i) times.push_back(0.1 * i + 0.03 * std::sin(i));
  const auto f = [](double t) { return 1 - 2 * t + 3 * t * t - t * t * t + 0.5 * t * t * t * t; };
  for (const double t : times) values.push_back(f(t));
  std::vector<double> first(12), second(12);
  sim::differentiate(times, values, 1, first, second);
  for (std::size_t i = 0; i < 12; ++i) {
    const double t = times[i];
    EXPECT_NEAR(first[i], -2 + 6 * t - 3 * t * t + 2 * t * t * t, 1e-10);
    EXPECT_NEAR(second[i], 6 - 6 * t + 6 * t * t, 1e-8);
  }
}

/// An arm of the library that swings, its tool's rates by finite differences of its places.
TEST(JointRates, AreThoseOfTheMotionWhoseToolIsFollowed) {
  Workbench bench;
  NoProgress progress;
  const AnyId robot = bench.load("robots/pa10.rbt");
  const auto model = unwrap(bench.derived.robot_model(*bench.document.now(), RobotId{robot.number},
                                                      {0, 0, -9.81}, progress));
  const auto place = [](double t, std::size_t j) {
    return 0.5 + 0.4 * std::sin(t * (1 + 0.3 * static_cast<double>(j)) + static_cast<double>(j));
  };
  const auto rate = [](double t, std::size_t j, int order) {
    const double w = 1 + 0.3 * static_cast<double>(j), at = t * w + static_cast<double>(j);
    return 0.4 * (order == 1 ? w * std::cos(at) : -w * w * std::sin(at));
  };
  // v = J qd, and a by the central difference of v, error of order h^4.
  const auto twist = [&](double t) {
    std::vector<double> q, j(42);
    for (std::size_t k = 0; k < 7; ++k) q.push_back(place(t, k));
    std::vector<Pose> frames(7);
    robotics::forward_kinematics(*model, q, frames);
    robotics::geometric_jacobian(*model, 0, frames, robotics::JacobianFrame::base, j);
    std::array<double, 6> v{};
    for (std::size_t k = 0; k < 7; ++k)
      for (std::size_t r = 0; r < 6; ++r) v[r] += j[6 * k + r] * rate(t, k, 1);
    return v;
  };
  std::vector<double> times, q;
  std::vector<PathSample> path;
  for (std::size_t i = 0; i < 203; ++i) {
    const double t = 0.002 * static_cast<double>(i), h = 1e-3;
    times.push_back(t);
    for (std::size_t k = 0; k < 7; ++k) q.push_back(place(t, k));
    const auto v = twist(t), a = twist(t - 2 * h), b = twist(t - h), c = twist(t + h),
               d = twist(t + 2 * h);
    std::array<double, 6> w{};
    for (std::size_t r = 0; r < 6; ++r) w[r] = (a[r] - 8 * b[r] + 8 * c[r] - d[r]) / (12 * h);
    PathSample s;
    s.velocity = {v[0], v[1], v[2]}, s.angular_velocity = {v[3], v[4], v[5]};
    s.acceleration = {w[0], w[1], w[2]}, s.angular_acceleration = {w[3], w[4], w[5]};
    path.push_back(s);
  }
  std::vector<double> qd(q.size()), qdd(q.size());
  sim::joint_rates(*model, times, q, path, qd, qdd);
  for (std::size_t i = 2; i + 2 < times.size(); ++i)
    for (std::size_t k = 0; k < 7; ++k) {
      EXPECT_NEAR(qd[7 * i + k], rate(times[i], k, 1), 1e-9) << "sample " << i;
      EXPECT_NEAR(qdd[7 * i + k], rate(times[i], k, 2), 1e-7) << "sample " << i;
    }
}

class Pa10Circle : public ::testing::TestWithParam<const char*> {
 protected:
  static constexpr Vec3 kCentre{0.658, 0, 0.7346};
  static constexpr double kRadius = 0.1;

  Workbench bench;
  NoProgress progress;
  WorldId world;

  /// The paper's circle with the given PA-10 at the world's origin.
  void SetUp() override {
    const AnyId robot = bench.load(std::string("robots/") + GetParam() + ".rbt");
    const AnyId circle = bench.load("trajectories/circle.tjc");
    auto t = bench.document.begin("world");
    ASSERT_TRUE(t.ok());
    model::World w;
    w.robots.push_back({"arm", RobotId{robot.number}, {}, {0, 0.35, 0, 1.85, 0, 0.94, 0}});
    w.trajectories.push_back({"circle", TrajectoryId{circle.number}, {}});
    world = unwrap(t->add("cell", std::move(w)));
    ASSERT_TRUE(t->commit().ok());
  }
  recording::RecordingPtr run(double sample_time = 0) {
    const auto snapshot = bench.document.now();
    const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
    auto r = simulator.inverse_dynamics(
        {.world = world, .robot = "arm", .trajectory = "circle", .sample_time = sample_time},
        progress);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? *r : nullptr;
  }
};

TEST_P(Pa10Circle, TheTipStaysOnTheCircleWithinLimits) {
  const auto r = run();
  ASSERT_TRUE(r);
  EXPECT_GE(r->rows(), 628U);
  EXPECT_NEAR(r->find("time")->values.back(), 20 * M_PI, 1e-9);  // 2 pi 0.1 m / 0.01 m/s
  const auto snapshot = bench.document.now();
  const auto* w = snapshot->get(world);
  const auto model = unwrap(
      bench.derived.robot_model(*snapshot, w->robots.front().robot, {0, 0, -9.81}, progress));
  std::vector<Pose> frames(model->joints.size());
  for (std::size_t i = 0; i < r->rows(); ++i) {
    const auto q = row(*r, "q", i);
    robotics::forward_kinematics(*model, q, frames);
    const Vec3 p = robotics::tip_pose(*model, 0, frames).p;
    EXPECT_NEAR(std::hypot(p[0] - kCentre[0], p[1] - kCentre[1]), kRadius, 1e-9) << "sample " << i;
    EXPECT_NEAR(p[2], kCentre[2], 1e-9) << "sample " << i;
    // Tool straight down: its z axis is -z.
    EXPECT_NEAR(robotics::tip_pose(*model, 0, frames).R[8], -1, 1e-9);
    for (std::size_t j = 0; j < q.size(); ++j) {
      EXPECT_GE(q[j], model->joints[j].lower);
      EXPECT_LE(q[j], model->joints[j].upper);
    }
  }
  // The printed order of the points turns about -z: from (558, 0) towards (658, -100) would be
  // positive; a quarter turn before the last point the tip is at (658, +100).
  const std::size_t quarter = r->rows() / 4;
  EXPECT_GT(r->find("y")->values[quarter], 0.05);
}

/// The circle in closed form at the times of a run, `late` behind it [rad].
Recording ideal_circle(const std::vector<double>& times, const Vec3& centre, double radius,
                       double late) {
  Recording ideal;
  ideal.columns = {
      {"time", "s", "", times}, {"x", "m", "", {}}, {"y", "m", "", {}}, {"z", "m", "", {}}};
  for (const double t : times) {
    const double angle = M_PI - 0.01 / radius * t + late;  // 10 mm/s about -z from (558, 0) mm
    ideal.columns[1].values.push_back(centre[0] + radius * std::cos(angle));
    ideal.columns[2].values.push_back(centre[1] + radius * std::sin(angle));
    ideal.columns[3].values.push_back(centre[2]);
  }
  return ideal;
}

TEST_P(Pa10Circle, TheTipCorrelatesWithTheIdealCircleInEveryCoordinate) {
  const auto r = run();
  ASSERT_TRUE(r);
  const auto& times = r->find("time")->values;
  const std::vector<std::string> place{"x", "y", "z"};
  const auto d = unwrap(recording::compare(ideal_circle(times, kCentre, kRadius, 0), *r, place));
  ASSERT_EQ(d.size(), 3U);
  for (const auto& c : d) {
    EXPECT_EQ(c.samples, r->rows());
    EXPECT_LT(c.greatest, 1e-8) << c.name;
    if (c.name == "z") continue;  // the ideal does not vary along it: no correlation
    ASSERT_TRUE(c.correlation) << c.name;
    EXPECT_GE(*c.correlation, 0.9999) << c.name;
  }
  EXPECT_FALSE(d[2].correlation);
  // 2 degrees behind on the same circle is seen: cos(2 deg) = 0.99939.
  const auto late =
      unwrap(recording::compare(ideal_circle(times, kCentre, kRadius, M_PI / 90), *r, place));
  EXPECT_NEAR(*late[0].correlation, std::cos(M_PI / 90), 1e-5);
  EXPECT_NEAR(*late[1].correlation, std::cos(M_PI / 90), 1e-5);
}

TEST_P(Pa10Circle, JointVelocitiesAreContinuousAndMoveTheTipAtTheProgrammedSpeed) {
  const auto r = run();
  ASSERT_TRUE(r);
  const auto& t = r->find("time")->values;
  for (std::size_t i = 1; i < r->rows(); ++i) {
    const double dt = t[i] - t[i - 1];
    const auto a = row(*r, "qd", i - 1), b = row(*r, "qd", i), aa = row(*r, "qdd", i - 1),
               bb = row(*r, "qdd", i);
    for (std::size_t j = 0; j < r->dof; ++j) {
      // What the accelerations explain, and no jump on top of it.
      EXPECT_NEAR(b[j] - a[j], 0.5 * dt * (aa[j] + bb[j]), 2e-5)
          << "joint " << j + 1 << " at " << t[i];
      EXPECT_LT(std::fabs(b[j] - a[j]), 2e-3);
    }
  }
  // Tip speed from the recorded positions.
  const auto &x = r->find("x")->values, &y = r->find("y")->values;
  for (std::size_t i = 1; i + 2 < r->rows(); ++i)
    EXPECT_NEAR(std::hypot(x[i + 1] - x[i - 1], y[i + 1] - y[i - 1]) / (t[i + 1] - t[i - 1]), 0.01,
                1e-6);
}

TEST_P(Pa10Circle, RatesAreThoseOfTheRecordedPositions) {
  const auto r = run();
  ASSERT_TRUE(r);
  const auto& t = r->find("time")->values;
  for (std::size_t i = 2; i + 3 < r->rows(); i += 7) {
    const auto before = row(*r, "q", i - 1), at = row(*r, "q", i), after = row(*r, "q", i + 1),
               qd = row(*r, "qd", i), qdd = row(*r, "qdd", i);
    const double h = t[i + 1] - t[i];
    for (std::size_t j = 0; j < r->dof; ++j) {
      EXPECT_NEAR((after[j] - before[j]) / (2 * h), qd[j], 1e-5);
      EXPECT_NEAR((after[j] - 2 * at[j] + before[j]) / (h * h), qdd[j], 1e-4);
    }
  }
}

TEST_P(Pa10Circle, TorquesEqualAnIndependentEvaluation) {
  const auto r = run();
  ASSERT_TRUE(r);
  const auto snapshot = bench.document.now();
  const auto* w = snapshot->get(world);
  const auto model = unwrap(
      bench.derived.robot_model(*snapshot, w->robots.front().robot, {0, 0, -9.81}, progress));
  double greatest = 0;
  for (std::size_t i = 0; i < r->rows(); i += 5) {
    const auto reference =
        test::reference_torques(*model, row(*r, "q", i), row(*r, "qd", i), row(*r, "qdd", i));
    const auto tau = row(*r, "tau", i);
    for (std::size_t j = 0; j < r->dof; ++j) {
      EXPECT_NEAR(tau[j], reference[j], 1e-10 * std::max(1.0, std::fabs(reference[j])));
      greatest = std::max(greatest, std::fabs(tau[j]));
    }
  }
  EXPECT_GT(greatest, 10) << "a PA-10 that weighs nothing proves nothing";
}

TEST_P(Pa10Circle, PartsOfTheTorqueSumToTheWhole) {
  const auto r = run(1.0);
  ASSERT_TRUE(r);
  for (std::size_t i = 0; i < r->rows(); ++i) {
    const auto all = row(*r, "tau", i), g = row(*r, "tau_gravity", i),
               m = row(*r, "tau_inertial", i), v = row(*r, "tau_velocity", i),
               f = row(*r, "tau_friction", i);
    for (std::size_t j = 0; j < r->dof; ++j) EXPECT_NEAR(all[j], g[j] + m[j] + v[j] + f[j], 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(BothParameterSets, Pa10Circle, ::testing::Values("pa10", "pa10_nus"),
                         [](const auto& param) { return std::string(param.param); });

/// An ik provider that misbehaves in a chosen way.
class BadIk final : public IkSolver {
 public:
  enum class Fault { throws, throws_int, nan, wrong_length, misses, outside };
  explicit BadIk(Fault fault) : fault_(fault) {}
  Result<void> prepare(const RobotModel& model, const Params&) override {
    dof_ = model.dof();
    return {};
  }
  Result<void> solve(const IkBatch&, std::span<IkResult> results, Progress&) const override {
    if (fault_ == Fault::throws) throw std::runtime_error("no memory for matrices");
    if (fault_ == Fault::throws_int) throw 7;  // NOLINT: what a careless plugin does
    for (auto& r : results) {
      r.status = IkStatus::solved;
      r.q.assign(dof_, 0.0);
      if (fault_ == Fault::nan) r.q[2] = std::nan("");
      if (fault_ == Fault::wrong_length) r.q.pop_back();
      if (fault_ == Fault::outside) r.q[1] = 3.0;
    }
    return {};
  }

 private:
  Fault fault_;
  std::size_t dof_ = 0;
};

struct BadCase {
  BadIk::Fault fault;
  const char* name;
  const char* says;
};

class BadProvider : public ::testing::TestWithParam<BadCase> {};

TEST_P(BadProvider, IsNamedInOneSentenceAndItsAnswerIsNotUsed) {
  Workbench bench;
  NoProgress progress;
  const AnyId robot = bench.load("robots/pa10.rbt");
  ProviderInfo info;
  info.interface_id = IkSolver::kInterfaceId;
  info.name = "bad";
  const auto fault = GetParam().fault;
  ASSERT_TRUE(
      bench.registry
          .add(info,
               [fault]() -> Result<void*> { return static_cast<IkSolver*>(new BadIk(fault)); })
          .ok());
  const auto snapshot = bench.document.now();
  const auto model =
      unwrap(bench.derived.robot_model(*snapshot, RobotId{robot.number}, {0, 0, -9.81}, progress));
  model::ProviderChoice choice;
  choice.name = "bad";
  const auto ik = unwrap(sim::bind_ik(bench.registry, model, choice));
  // With "outside" the pose is the one its answer has, so that only the limit is wrong with it.
  std::vector<double> q(7, 0.0);
  if (fault == BadIk::Fault::outside) q[1] = 3.0;
  else if (fault == BadIk::Fault::misses) q[1] = 0.5;
  std::vector<Pose> frames(7);
  robotics::forward_kinematics(*model, q, frames);
  const Pose target = robotics::tip_pose(*model, 0, frames);
  IkBatch batch;
  batch.targets = {&target, 1};
  const auto result = sim::solve_ik(ik, batch, progress);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::plugin_failed);
  EXPECT_EQ(result.error().sentence().find("robot \"pa10\": provider \"bad\" "), 0U)
      << result.error().sentence();
  EXPECT_NE(result.error().sentence().find(GetParam().says), std::string::npos)
      << result.error().sentence();
}

INSTANTIATE_TEST_SUITE_P(
    Ik, BadProvider,
    ::testing::Values(
        BadCase{BadIk::Fault::throws, "Throws", "threw: no memory for matrices"},
        BadCase{BadIk::Fault::throws_int, "ThrowsAnInt", "threw an unknown exception"},
        BadCase{BadIk::Fault::nan, "Nan", "a joint value that is not a number"},
        BadCase{BadIk::Fault::wrong_length, "WrongLength",
                "returned 6 joint values for a robot with 7 joints"},
        BadCase{BadIk::Fault::misses, "Misses", "claimed a solution that misses the target by"},
        BadCase{BadIk::Fault::outside, "OutsideLimits", "outside the limits of joint 2"}),
    [](const auto& param) { return std::string(param.param.name); });

/// Inverse dynamics that forgets to fill in a value.
class LazyDynamics final : public InverseDynamics {
 public:
  Result<void> prepare(const RobotModel&, const Params&) override { return {}; }
  [[nodiscard]] std::size_t scratch_size() const override { return 0; }
  Result<void> torques(const DynamicsBatch&, std::span<double> tau, Progress&) const override {
    std::fill(tau.begin(), tau.end() - 1, 0.0);
    return {};
  }
  Result<void> inertia(const DynamicsBatch&, std::span<double>, Progress&) const override {
    return {};
  }
};

TEST(BadProviders, TorquesThatWereNotComputedAreNotTakenForZero) {
  Workbench bench;
  NoProgress progress;
  const AnyId robot = bench.load("robots/puma560.rbt");
  ProviderInfo info;
  info.interface_id = InverseDynamics::kInterfaceId;
  info.name = "lazy";
  ASSERT_TRUE(
      bench.registry
          .add(info,
               []() -> Result<void*> { return static_cast<InverseDynamics*>(new LazyDynamics); })
          .ok());
  const auto model = unwrap(bench.derived.robot_model(*bench.document.now(), RobotId{robot.number},
                                                      {0, 0, -9.81}, progress));
  model::ProviderChoice choice;
  choice.name = "lazy";
  const auto dynamics = unwrap(sim::bind_inverse_dynamics(bench.registry, model, choice));
  const std::vector<double> q(6, 0.0);
  DynamicsBatch batch;
  batch.count = 1;
  batch.q = q;
  const auto tau = sim::torques(dynamics, batch, progress);
  ASSERT_FALSE(tau.ok());
  EXPECT_EQ(tau.error().code, ErrorCode::plugin_failed);
  EXPECT_FALSE(sim::inertia(dynamics, batch, progress).ok());
}

Recording small_recording() {
  Recording r;
  r.title = "a <small> one";
  r.dof = 2;
  r.columns = {{"time", "s", "", {0, 0.1, 0.2}},
               {"tau1", "N m", "", {1, -2.5, 1e-17}},
               {"tau2", "N m", "", {0, 0.30000000000000004, 3}},
               {"tau_gravity1", "N m", "", {1, 1, 1}},
               {"x", "m", "", {0.5, 0.6, 0.7}}};
  return r;
}

TEST(Recordings, CsvReadsBackToTheSameBits) {
  const Recording r = small_recording();
  NoProgress progress;
  std::istringstream in(unwrap(recording::to_csv(r, progress)));
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "time [s],tau1 [N m],tau2 [N m],tau_gravity1 [N m],x [m]\r");
  for (std::size_t i = 0; i < r.rows(); ++i) {
    ASSERT_TRUE(std::getline(in, line));
    const auto words = text::split(text::trim(line), ',');
    ASSERT_EQ(words.size(), r.columns.size());
    for (std::size_t c = 0; c < words.size(); ++c)
      EXPECT_EQ(text::read_real(words[c]), r.columns[c].values[i]);
  }
  EXPECT_FALSE(std::getline(in, line));
}

TEST(Recordings, AGroupNameSelectsItsNumberedColumnsOnly) {
  const Recording r = small_recording();
  const std::vector<std::string> group{"tau"};
  const auto chosen = unwrap(r.select(group));
  ASSERT_EQ(chosen.size(), 2U);
  EXPECT_EQ(chosen[0]->name, "tau1");
  EXPECT_EQ(chosen[1]->name, "tau2");
}

TEST(Recordings, AnUnknownColumnIsRefusedWithTheNearestName) {
  const Recording r = small_recording();
  const std::vector<std::string> wrong{"tua1"};
  const auto chosen = r.select(wrong);
  ASSERT_FALSE(chosen.ok());
  EXPECT_EQ(chosen.error().sentence(),
            "the recording has no column \"tua1\". Did you mean \"tau1\"?");
}

TEST(Recordings, NumbersOfRemovedRecordingsAreNotUsedAgain) {
  recording::Recordings all;
  const auto first = all.add(std::make_shared<Recording>(small_recording()));
  EXPECT_TRUE(all.remove(first));
  EXPECT_EQ(all.find(first), nullptr);
  EXPECT_NE(all.add(std::make_shared<Recording>(small_recording())), first);
}

}  // namespace
}  // namespace robomosp
