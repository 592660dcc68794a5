// SPDX-License-Identifier: Apache-2.0
// Live runs: what is computed when, what is shown, and how a run goes on in an edited world.
#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <thread>

#include <gtest/gtest.h>

#include "sim/forward_simulation.h"
#include "sim/live_run.h"
#include "sim/physics.h"
#include "support/records.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using recording::Recording;
using recording::RecordingPtr;
using sim::LiveRun;
using sim::RowSink;
using sim::RunState;
using test::make;
using test::unwrap;
using test::Workbench;

constexpr double kLiveGravity = 9.81;

void ok(const Result<void>& done) { EXPECT_TRUE(done.ok()) << done.error().sentence(); }

/// Rows 0.1 s apart with a value that gives its row, and how many of them were computed.
struct Counter {
  std::atomic<int> made{0};
  std::atomic<bool> was_cancelled{false};

  /// Ends behind `rows`; with `fails` by an error instead.
  LiveRun::Source source(int rows, bool fails = false, std::string column = "value") {
    return [=, this](const RunState* from, RowSink& sink, Progress&) -> Result<RecordingPtr> {
      Recording table;
      table.columns = {{"time", "s", "", {}}, {column, "", "", {}}};
      for (int i = from ? static_cast<int>(std::lround(from->time * 10)) : 0; i < rows; ++i) {
        ++made;
        table.columns[0].values.push_back(0.1 * i);
        table.columns[1].values.push_back(i * i);
        auto state = std::make_shared<RunState>();
        state->time = 0.1 * i;
        auto taken = sink.take(table, table.rows() - 1, std::move(state));
        if (!taken.ok()) {
          was_cancelled = taken.error().code == ErrorCode::cancelled;
          return std::move(taken).error();
        }
      }
      if (fails) return error(ErrorCode::plugin_failed, "the engine broke");
      table.notes = {"done"};
      return std::make_shared<const Recording>(std::move(table));
    };
  }
};

class Gate : public testing::Test {
 protected:
  NoProgress progress;
  Counter counter;
  std::atomic<double> now{100};
  std::unique_ptr<LiveRun> run = std::make_unique<LiveRun>([this] { return now.load(); });

  void start(int rows, bool fails = false) {
    ok(run->start(counter.source(rows, fails), progress));
  }
  void pass(double seconds) {
    now = now + seconds;
    run->wake();
    ok(run->catch_up(progress));
  }
};

TEST_F(Gate, NothingIsComputedBeforeItIsAskedFor) {
  start(100);
  EXPECT_EQ(counter.made, 1);
  EXPECT_EQ(run->shown().time, 0);
  ok(run->step(3, progress));
  EXPECT_EQ(counter.made, 4);
  EXPECT_EQ(run->shown().values.at(1), 9);
  ok(run->go_to(0.7, progress));
  EXPECT_EQ(counter.made, 8);
  EXPECT_EQ(run->shown().row, 7U);
}

TEST_F(Gate, RecordedRowsAreShownWithoutComputing) {
  start(100);
  ok(run->step(5, progress));
  ok(run->step(-3, progress));
  EXPECT_EQ(run->shown().row, 2U);
  ok(run->go_to(0.45, progress));
  EXPECT_EQ(run->shown().row, 4U);
  ok(run->step(-1, progress));  // from between two rows to the one before
  EXPECT_EQ(run->shown().row, 4U);
  ok(run->step(-99, progress));
  EXPECT_EQ(run->shown().row, 0U);
  EXPECT_EQ(counter.made, 6);
  EXPECT_EQ(run->recording()->rows(), 6U);
}

TEST_F(Gate, PlayedItFollowsTheClock) {
  start(1000);
  run->play(1);
  pass(0.25);
  EXPECT_NEAR(run->shown().time, 0.25, 1e-12);
  EXPECT_EQ(counter.made, 4);  // the one behind what is shown as well
  pass(0.25);
  EXPECT_NEAR(run->shown().time, 0.5, 1e-12);
  run->play(2);
  pass(0.5);
  EXPECT_NEAR(run->shown().time, 1.5, 1e-12);
  EXPECT_EQ(run->shown().speed, 2);
}

TEST_F(Gate, PausedItsThreadRestsHoweverTimePasses) {
  start(1 << 30);
  run->play(sim::kAsFastAsPossible);
  while (run->shown().rows < 100) std::this_thread::yield();
  ok(run->pause(progress));
  const int made = counter.made;
  EXPECT_EQ(run->shown().rows, static_cast<std::size_t>(made));
  EXPECT_EQ(run->shown().speed, 0);
  pass(1000);
  EXPECT_EQ(counter.made, made);
  ok(run->go_to(run->shown().recorded, progress));
  ok(run->step(1, progress));
  EXPECT_EQ(counter.made, made + 1);
}

TEST_F(Gate, BackwardsItGoesOverWhatIsRecorded) {
  start(100);
  ok(run->go_to(2, progress));
  const int made = counter.made;
  run->play(-4);
  pass(0.25);
  EXPECT_NEAR(run->shown().time, 1, 1e-12);
  EXPECT_EQ(run->shown().values.at(1), 100);
  EXPECT_EQ(run->shown().speed, -4);
  pass(1);
  EXPECT_EQ(run->shown().time, 0);
  EXPECT_EQ(run->shown().speed, 0);
  EXPECT_EQ(counter.made, made);
}

TEST_F(Gate, AtItsEndItIsOverAndKeepsTheNotes) {
  start(11);
  run->play(1);
  pass(20);
  const LiveRun::Shown s = run->shown();
  EXPECT_TRUE(s.is_over && s.is_complete);
  EXPECT_EQ(s.speed, 0);
  EXPECT_NEAR(s.time, 1, 1e-12);
  ok(run->step(1, progress));  // stays there
  EXPECT_EQ(run->shown().row, 10U);
  EXPECT_EQ(run->recording()->notes, std::vector<std::string>{"done"});
}

TEST_F(Gate, AFailureIsToldWhereItIsMet) {
  start(3, true);
  ok(run->step(2, progress));
  const auto done = run->step(1, progress);
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().message, "the engine broke");
  EXPECT_EQ(run->shown().row, 2U);
  EXPECT_TRUE(run->shown().failure);
  ok(run->step(-1, progress));  // what is recorded can still be seen
}

TEST_F(Gate, AStartThatFailsSaysWhy) {
  const auto done = run->start(counter.source(0, true), progress);
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().message, "the engine broke");
}

TEST_F(Gate, ItEndsWhileItWaitsForTheNextWish) {
  start(100);
  ok(run->step(2, progress));
  run.reset();
  EXPECT_TRUE(counter.was_cancelled);
  EXPECT_EQ(counter.made, 3);
}

TEST_F(Gate, StoppedItKeepsItsRowsAndSaysThatItIsStopped) {
  start(100);
  ok(run->step(4, progress));
  run->stop();
  EXPECT_TRUE(counter.was_cancelled);
  ok(run->step(-4, progress));
  const auto done = run->step(10, progress);
  ASSERT_FALSE(done.ok());
  EXPECT_NE(done.error().message.find("cancelled"), std::string::npos);
  ok(run->refresh(counter.source(100), progress));  // goes on
  ok(run->step(10, progress));
}

/// A user who gives up at once.
class Impatient final : public Progress {
 public:
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return true; }
};

TEST_F(Gate, WhoWaitsMayGiveUp) {
  ok(run->start(
      [](const RunState*, RowSink& sink, Progress& p) -> Result<RecordingPtr> {
        Recording table;
        table.columns = {{"time", "s", "", {0}}};
        RMP_TRY(sink.take(table, 0, std::make_shared<RunState>()));
        while (!p.cancelled()) std::this_thread::yield();  // a row that takes for ever
        return error(ErrorCode::cancelled, "stopped");
      },
      progress));
  Impatient user;
  const auto done = run->step(1, user);
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().code, ErrorCode::cancelled);
  EXPECT_EQ(run->shown().time, 0);
}

TEST_F(Gate, StartedAgainItForgetsWhatItHad) {
  start(100);
  ok(run->go_to(3, progress));
  ok(run->start(counter.source(5, false, "other"), progress));
  EXPECT_EQ(run->shown().rows, 1U);
  EXPECT_EQ(run->shown().time, 0);
  EXPECT_EQ(run->recording()->columns.at(1).name, "other");
}

TEST_F(Gate, RefreshedItGoesOnFromWhatIsShown) {
  start(100);
  ok(run->go_to(1, progress));
  ok(run->go_to(0.5, progress));
  ok(run->refresh(counter.source(100, false, "other"), progress));
  EXPECT_EQ(run->shown().rows, 6U);
  EXPECT_NEAR(run->shown().time, 0.5, 1e-12);
  ok(run->step(2, progress));
  const auto r = run->recording();
  ASSERT_EQ(r->columns.size(), 3U);
  // What is gone stays as it was, what is new was as it is at first.
  EXPECT_EQ(r->columns[1].values, (std::vector<double>{0, 1, 4, 9, 16, 25, 25, 25}));
  EXPECT_EQ(r->columns[2].values, (std::vector<double>{25, 25, 25, 25, 25, 25, 36, 49}));
  ASSERT_EQ(r->notes.size(), 1U + 2U);
}

TEST_F(Gate, ASourceWithoutARowLeavesTheOldOneInItsPlace) {
  start(100);
  ok(run->go_to(1, progress));
  ok(run->go_to(0.5, progress));
  const auto restarts = run->shown().restarts;
  const auto shorter = run->refresh(counter.source(3), progress);
  ASSERT_FALSE(shorter.ok());
  EXPECT_NE(shorter.error().message.find("over now before t = 0.5 s"), std::string::npos);
  const auto broken = run->refresh(counter.source(3, true), progress);
  ASSERT_FALSE(broken.ok());
  EXPECT_EQ(broken.error().message, "the engine broke");
  const auto again = run->start(counter.source(0, true), progress);
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(run->shown().rows, 11U);
  EXPECT_NEAR(run->shown().time, 0.5, 1e-12);
  EXPECT_EQ(run->shown().restarts, restarts);
  EXPECT_FALSE(run->shown().failure);
  counter.was_cancelled = false;
  ok(run->go_to(2, progress));
  EXPECT_FALSE(counter.was_cancelled);
  EXPECT_EQ(run->recording()->columns[1].values.back(), 400);
  ok(run->refresh(counter.source(25), progress));  // and can still be replaced
  EXPECT_TRUE(counter.was_cancelled);
  ok(run->finish(progress));
  EXPECT_EQ(run->shown().rows, 25U);
}

/// Gives up when it has waited for a while.
class Tired final : public Progress {
 public:
  void report(double, std::string_view) override { ++asked_; }
  [[nodiscard]] bool cancelled() const override { return asked_ > 1; }

 private:
  std::atomic<int> asked_{0};
};

TEST_F(Gate, WhoGivesUpARefreshKeepsTheOldSource) {
  start(100);
  ok(run->go_to(1, progress));
  Tired user;
  const auto done = run->refresh(
      [](const RunState*, RowSink&, Progress& p) -> Result<RecordingPtr> {
        while (!p.cancelled()) std::this_thread::yield();  // on its way there for ever
        return error(ErrorCode::cancelled, "stopped");
      },
      user);
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().code, ErrorCode::cancelled);
  EXPECT_EQ(run->shown().rows, 11U);
  ok(run->step(3, progress));
  EXPECT_EQ(run->shown().rows, 14U);
}

TEST_F(Gate, PiecesFollowItsRowsAndNameTheFirstThatIsAnother) {
  start(100);
  ok(run->go_to(1, progress));
  const auto values = [](const LiveRun::Piece& p) { return p.columns.back().values; };
  const auto piece = [&](std::size_t from, std::optional<std::size_t> restarts,
                         std::size_t most = 1000) {
    auto p = run->piece(from, restarts, most, {});
    EXPECT_TRUE(p.ok());
    return std::move(*p);
  };
  auto p = piece(0, std::nullopt, 3);
  EXPECT_EQ(values(p), (std::vector<double>{0, 1, 4}));
  EXPECT_EQ(p.recorded, 11U);
  p = piece(3, p.restarts);
  EXPECT_EQ(p.from, 3U);
  EXPECT_EQ(values(p).size(), 8U);
  const std::size_t known = p.restarts;
  EXPECT_TRUE(values(piece(11, known)).empty());
  EXPECT_EQ(piece(1000, known).from, 11U) << "beyond the end is the end";
  // Twice back: of all that was dropped the first row counts.
  ok(run->go_to(0.5, progress));
  ok(run->refresh(counter.source(100), progress));
  ok(run->go_to(0.3, progress));
  ok(run->refresh(counter.source(100), progress));
  ok(run->go_to(0.8, progress));
  ok(run->go_to(0.6, progress));
  ok(run->refresh(counter.source(100), progress));
  p = piece(11, known);
  EXPECT_EQ(p.from, 4U);
  EXPECT_EQ(p.recorded, 7U);
  EXPECT_EQ(piece(2, known).from, 2U) << "who has less asks for less";
  EXPECT_EQ(piece(7, p.restarts).from, 7U);
  // With a column more, all rows are other ones.
  ok(run->refresh(counter.source(100, false, "other"), progress));
  EXPECT_EQ(piece(7, p.restarts).from, 0U);
  // Chosen ones, and names that are none.
  const std::string names[] = {"value"};
  EXPECT_EQ(run->piece(0, std::nullopt, 2, names)->columns.size(), 1U);
  const std::string wrong[] = {"valu"};
  EXPECT_NE(run->piece(0, std::nullopt, 2, wrong).error().sentence().find("value"),
            std::string::npos);
}

TEST_F(Gate, TwoRunsAtOnceDoNotDisturbEachOther) {
  Counter second;
  LiveRun other;
  start(5000);
  ok(other.start(second.source(3000), progress));
  run->play(sim::kAsFastAsPossible);
  other.play(sim::kAsFastAsPossible);
  for (int i = 0; i < 100; ++i) {
    const LiveRun::Shown s = run->shown();
    EXPECT_NEAR(s.values.at(1), std::pow(static_cast<double>(s.row), 2), 1e-6);
  }
  ok(other.finish(progress));
  ok(run->finish(progress));
  EXPECT_EQ(run->recording()->rows(), 5000U);
  EXPECT_EQ(other.recording()->rows(), 3000U);
}

TEST_F(Gate, ARecordingIsHandedOnFromATimeOn) {
  Recording table;
  table.columns = {{"time", "s", "", {0, 0.5, 1, 1.5}}, {"q1", "rad", "", {1, 2, 3, 4}}};
  const auto replay = [table](const RunState* from, RowSink& sink,
                              Progress&) -> Result<RecordingPtr> {
    RMP_TRY(sim::hand_on(table, from ? from->time : -1, sink));
    return std::make_shared<const Recording>(table);
  };
  ok(run->start(replay, progress));
  ok(run->step(2, progress));
  ok(run->refresh(replay, progress));
  EXPECT_EQ(run->shown().rows, 3U);
  ok(run->finish(progress));
  EXPECT_EQ(run->recording()->columns[1].values, table.columns[1].values);
}

// ---- physics and forward dynamics ----

class LiveWorlds : public testing::Test {
 protected:
  LiveWorlds() {
    model::Material wood;
    wood.density = 600;
    material_ = make(bench.document, "wood", wood);
    box_ = add_box("box", 0.1, material_);
    world_.objects = {{"floor", add_box("floor", 2, {}), at({0, 0, -2})},
                      {"box", box_, at({0, 0, 1})}};
    model::Link rod;
    rod.name = "rod";
    rod.joint = model::JointKind::revolute;
    rod.origin = model::Placement{};
    rod.axis = {0, 1, 0};
    rod.given = MassProperties{2, {0.3, 0, 0}, {0.01, 0.06, 0.06, 0, 0, 0}};
    model::Link second = rod;
    second.name = "tip rod";
    second.parent = 0;
    second.origin->position = {0.6, 0, 0};
    pendulum_.links = {rod, second};
    world_.robots.push_back(
        {"pendulum", make(bench.document, "pendulum", pendulum_), at({0, 3, 2}), {0.1, 0.2}});
    id_ = make(bench.document, "cell", world_);
  }
  static model::Placement at(Vec3 p) {
    model::Placement out;
    out.position = p;
    return out;
  }
  SolidId add_box(const std::string& name, double edge, MaterialId material) {
    model::SolidNode n;
    n.name = name;
    n.sizes = {edge, edge, edge};
    model::Solid s;
    s.material = material;
    s.nodes = {n};
    return make(bench.document, name, s);
  }
  void edit(AnyId id, const std::function<void(model::Record&)>& change) {
    auto tx = bench.document.begin("edit");
    ok(tx->edit(id, [&](model::Record& r) -> Result<void> {
      change(r);
      return {};
    }));
    EXPECT_TRUE(tx->commit().ok());
  }
  LiveRun::Source physics(const sim::PhysicsRun& wanted) {
    return [this, wanted, snapshot = bench.document.now()](const RunState* from, RowSink& sink,
                                                           Progress& p) {
      return sim::simulate_physics({bench.registry, bench.derived, *snapshot}, wanted, p, &sink,
                                   from);
    };
  }
  LiveRun::Source dynamics(const sim::ForwardRun& wanted) {
    return [this, wanted, snapshot = bench.document.now()](const RunState* from, RowSink& sink,
                                                           Progress& p) {
      return sim::forward_dynamics({bench.registry, bench.derived, *snapshot}, wanted, p, &sink,
                                   from);
    };
  }
  /// A box that falls beside a double pendulum that swings.
  sim::PhysicsRun fall() const {
    sim::PhysicsRun r;
    r.world = id_;
    r.duration = 0.4;
    r.robots = {{"pendulum", sim::RobotDrive::limp, {}, {}, {}, false}};
    return r;
  }
  sim::ForwardRun swing() const {
    sim::ForwardRun r;
    r.world = id_;
    r.robot = "pendulum";
    r.duration = 0.5;
    r.hold = {0.3, -0.2};
    r.is_controlled = true;
    r.controller.name = "pd_gravity";
    return r;
  }
  /// The engine's steps of 1 ms are semi-implicit: v += g h, z += v h.
  static double fallen(double seconds) {
    const double n = std::round(seconds * 1000);
    return kLiveGravity * 1e-6 * n * (n + 1) / 2;
  }
  static double last(const Recording& r, const std::string& column) {
    const auto* c = r.find(column);
    EXPECT_NE(c, nullptr) << column;
    return c ? c->values.back() : std::nan("");
  }
  static void expect_equal_bits(const Recording& a, const Recording& b, bool all) {
    for (const recording::Column& c : a.columns) {
      const auto* other = b.find(c.name);
      if (!other && !all) continue;
      ASSERT_NE(other, nullptr) << c.name;
      ASSERT_EQ(c.values.size(), other->values.size()) << c.name;
      for (std::size_t i = 0; i < c.values.size(); ++i)
        ASSERT_EQ(std::bit_cast<std::uint64_t>(c.values[i]),
                  std::bit_cast<std::uint64_t>(other->values[i]))
            << c.name << " in row " << i;
    }
  }

  Workbench bench;
  NoProgress progress;
  MaterialId material_;
  SolidId box_;
  model::Robot pendulum_;
  model::World world_;
  WorldId id_;
  LiveRun run;
};

TEST_F(LiveWorlds, SteppedPhysicsIsThatInOneGoBitForBit) {
  ok(run.start(physics(fall()), progress));
  for (int i = 0; i < 20; ++i) ok(run.step(i % 3, progress));
  run.play(sim::kAsFastAsPossible);
  ok(run.finish(progress));
  const auto snapshot = bench.document.now();
  const auto whole =
      unwrap(sim::simulate_physics({bench.registry, bench.derived, *snapshot}, fall(), progress));
  EXPECT_EQ(whole->rows(), 41U);
  expect_equal_bits(*whole, *run.recording(), true);
}

/// ODE, whose answer to read() number `at` has one number that is none.
struct Breaking {
  enum class What { place, velocity, turn, joint, rate } what;
  int at;
  std::atomic<int> reads{0};
};
class BreakingWorld final : public PhysicsWorld {
 public:
  BreakingWorld(std::unique_ptr<PhysicsWorld> inner, Breaking& fault)
      : inner_(std::move(inner)), fault_(fault) {}
  Result<void> step(double dt, std::int32_t steps, std::span<const double> forces,
                    Progress& p) override {
    return inner_->step(dt, steps, forces, p);
  }
  Result<void> read(const PhysicsState& out) const override {
    RMP_TRY(inner_->read(out));
    if (++fault_.reads != fault_.at) return {};
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    switch (fault_.what) {
      case Breaking::What::place: out.poses.back().p[1] = kNone; break;
      case Breaking::What::velocity: out.velocities.back()[2] = kNone; break;
      case Breaking::What::turn: out.angular_velocities.back()[0] = kNone; break;
      case Breaking::What::joint: out.joint_positions.back() = kNone; break;
      case Breaking::What::rate: out.joint_velocities.back() = kNone; break;
    }
    return {};
  }
  void contacts(std::vector<PhysicsContact>& out) const override { inner_->contacts(out); }
  Result<std::int32_t> attach(std::int32_t a, std::int32_t b) override {
    return inner_->attach(a, b);
  }
  Result<void> release(std::int32_t attachment) override { return inner_->release(attachment); }
  Result<void> move(std::int32_t body, const Pose& pose, Vec3 v, Vec3 w) override {
    return inner_->move(body, pose, v, w);
  }

 private:
  std::unique_ptr<PhysicsWorld> inner_;
  Breaking& fault_;
};
class BreakingEngine final : public PhysicsEngine {
 public:
  BreakingEngine(std::shared_ptr<PhysicsEngine> inner, Breaking& fault)
      : inner_(std::move(inner)), fault_(fault) {}
  Result<std::unique_ptr<PhysicsWorld>> create(std::span<const PhysicsBody> bodies,
                                               std::span<const PhysicsJoint> joints, Vec3 gravity,
                                               const Params& params) const override {
    RMP_TRY_ASSIGN(auto made, inner_->create(bodies, joints, gravity, params));
    return std::unique_ptr<PhysicsWorld>(std::make_unique<BreakingWorld>(std::move(made), fault_));
  }

 private:
  std::shared_ptr<PhysicsEngine> inner_;
  Breaking& fault_;
};

TEST_F(LiveWorlds, AnEngineThatAnswersNoNumberEndsALiveRunAsItEndsAWholeOne) {
  // Between two rows, and where a row is made: reads are one before the first step and one a step.
  for (const int at : {36, 41}) {
    for (const auto what : {Breaking::What::place, Breaking::What::velocity, Breaking::What::turn,
                            Breaking::What::joint, Breaking::What::rate}) {
      Breaking fault{what, at};
      ProviderInfo info = unwrap(bench.registry.find(PhysicsEngine::kInterfaceId, "ode"));
      info.name = "breaking";
      ok(bench.registry.add(
          info,
          [&]() -> Result<void*> {
            RMP_TRY_ASSIGN(auto inner, bench.registry.create<PhysicsEngine>("ode"));
            return static_cast<void*>(
                static_cast<PhysicsEngine*>(new BreakingEngine(std::move(inner), fault)));
          },
          true));
      sim::PhysicsRun broken = fall();
      broken.engine.name = "breaking";
      const auto snapshot = bench.document.now();
      const auto whole =
          sim::simulate_physics({bench.registry, bench.derived, *snapshot}, broken, progress);
      ASSERT_FALSE(whole.ok());
      const std::string sentence = whole.error().sentence();
      EXPECT_NE(sentence.find("\"breaking\" returned a state that is not a number"),
                std::string::npos)
          << sentence;
      EXPECT_NE(sentence.find("t = 0.0"), std::string::npos) << sentence;

      fault.reads = 0;
      ok(run.start(physics(broken), progress));
      const auto done = run.finish(progress);
      ASSERT_FALSE(done.ok());
      EXPECT_EQ(done.error().sentence(), sentence);
      const auto shown = run.shown();
      EXPECT_FALSE(shown.is_complete);
      ASSERT_TRUE(shown.failure.has_value());
      EXPECT_EQ(shown.failure->sentence(), sentence);
      // Rows are 0.01 s apart: 0 to 0.03 s.
      EXPECT_EQ(shown.rows, 4U);
      const auto kept = run.recording();
      EXPECT_EQ(kept->rows(), 4U);
      for (const recording::Column& c : kept->columns)
        for (const double x : c.values) EXPECT_TRUE(std::isfinite(x)) << c.name;
      run.stop();
      bench.registry.remove(PhysicsEngine::kInterfaceId, "breaking");
    }
  }
}

TEST_F(LiveWorlds, SteppedDynamicsIsThatInOneGoBitForBit) {
  ok(run.start(dynamics(swing()), progress));
  for (int i = 0; i < 20; ++i) ok(run.step(1, progress));
  ok(run.finish(progress));
  const auto snapshot = bench.document.now();
  const auto whole =
      unwrap(sim::forward_dynamics({bench.registry, bench.derived, *snapshot}, swing(), progress));
  EXPECT_EQ(whole->rows(), 51U);
  expect_equal_bits(*whole, *run.recording(), true);
  EXPECT_EQ(whole->notes, run.recording()->notes);
}

TEST_F(LiveWorlds, AnElementLoadedInTheMiddleOfAFallFallsFromThen) {
  ok(run.start(physics(fall()), progress));
  ok(run.go_to(0.2, progress));
  EXPECT_NEAR(last(*run.recording(), "box.z"), 1 - fallen(0.2), 1e-9);
  edit(AnyId(id_), [&](model::Record& r) {
    std::get<model::World>(r.body).objects.push_back({"late", box_, at({1, 0, 0.5})});
  });
  ok(run.refresh(physics(fall()), progress));
  EXPECT_EQ(last(*run.recording(), "late.z"), 0.5);
  ok(run.finish(progress));
  const auto r = run.recording();
  EXPECT_NEAR(last(*r, "box.z"), 1 - fallen(0.4), 1e-9);
  EXPECT_NEAR(last(*r, "late.z"), 0.5 - fallen(0.2), 1e-9);
  EXPECT_EQ(r->find("late.z")->values.front(), 0.5);
  EXPECT_EQ(r->rows(), 41U);
}

TEST_F(LiveWorlds, AnEditedBodyGoesOnWhereItWasAndAResetKeepsTheEdit) {
  ok(run.start(physics(fall()), progress));
  ok(run.go_to(0.2, progress));
  edit(AnyId(box_), [](model::Record& r) {
    std::get<model::Solid>(r.body).nodes[0].sizes = {0.05, 0.05, 0.2};
  });
  // A place given meanwhile counts for the next start only.
  edit(AnyId(id_), [&](model::Record& r) {
    std::get<model::World>(r.body).objects[1].placement = at({0, 0, 1.7});
  });
  ok(run.refresh(physics(fall()), progress));
  ok(run.finish(progress));
  EXPECT_NEAR(last(*run.recording(), "box.z"), 1 - fallen(0.4), 1e-9);
  ok(run.start(physics(fall()), progress));
  EXPECT_EQ(last(*run.recording(), "box.z"), 1.7);
  const auto* solid = bench.document.now()->get(box_);
  EXPECT_EQ(solid->nodes[0].sizes[2], 0.2);
}

TEST_F(LiveWorlds, ADrivenRobotKeepsJointValuesAndRatesThroughARefresh) {
  // Its links go on without the gaps in their joints that the engine had let open: those, and with
  // them the difference, shrink with the step.
  double apart = 1;
  for (const double step : {1e-3, 1e-4}) {
    sim::PhysicsRun wanted = fall();
    wanted.duration = 0.3;
    wanted.step = step;
    ok(run.start(physics(wanted), progress));
    ok(run.finish(progress));
    const auto whole = run.recording();
    EXPECT_GT(std::fabs(last(*whole, "qd2")), 1);
    ok(run.go_to(0.2, progress));
    ok(run.refresh(physics(wanted), progress));
    ok(run.finish(progress));
    double most = 0;
    for (const char* column : {"q1", "q2", "qd1", "qd2"})
      most = std::max(most, std::fabs(last(*run.recording(), column) - last(*whole, column)));
    EXPECT_LT(most, 0.3 * apart);
    apart = most;
  }
  EXPECT_LT(apart, 1e-3);
}

TEST_F(LiveWorlds, WhatIsHeldStaysHeldThroughARefresh) {
  sim::PhysicsRun lift = fall();
  lift.robots.clear();
  sim::PhysicsAction grasp, move;
  grasp.kind = sim::PhysicsAction::Kind::grasp;
  grasp.object = "box";
  move.time = 0;
  move.duration = 0.4;
  move.q = {0.1, 0.8};
  lift.actions = {grasp, move};
  ok(run.start(physics(lift), progress));
  ok(run.finish(progress));
  const auto whole = run.recording();
  ok(run.go_to(0.2, progress));
  ok(run.refresh(physics(lift), progress));
  ok(run.finish(progress));
  for (const char* column : {"box.x", "box.z", "q2"})
    EXPECT_NEAR(last(*run.recording(), column), last(*whole, column), 1e-4) << column;
  EXPECT_GT(std::fabs(last(*whole, "box.z") - (1 - fallen(0.4))), 0.1);  // it did not fall
}

TEST_F(LiveWorlds, AChangedMassCountsFromTheRefreshOn) {
  sim::ForwardRun free = swing();
  free.is_controlled = false;
  ok(run.start(dynamics(free), progress));
  ok(run.go_to(0.2, progress));
  const auto before = run.shown();
  const RobotId robot = bench.document.now()->get(id_)->robots[0].robot;
  edit(AnyId(robot),
       [](model::Record& r) { std::get<model::Robot>(r.body).links[1].given->mass = 6; });
  ok(run.refresh(dynamics(free), progress));
  ok(run.finish(progress));
  // The same motion begun anew with the heavier rod.
  sim::ForwardRun rest = free;
  rest.q = {before.values[1], before.values[2]};
  rest.qd = {before.values[3], before.values[4]};
  rest.duration = 0.3;
  const auto snapshot = bench.document.now();
  const auto anew =
      unwrap(sim::forward_dynamics({bench.registry, bench.derived, *snapshot}, rest, progress));
  for (const char* column : {"q1", "q2", "qd1", "qd2", "energy"})
    EXPECT_NEAR(last(*run.recording(), column), last(*anew, column), 1e-7) << column;
  EXPECT_EQ(run.recording()->rows(), 51U);
}

TEST_F(LiveWorlds, AnotherNumberOfJointsDoesNotFit) {
  ok(run.start(dynamics(swing()), progress));
  ok(run.go_to(0.1, progress));
  const RobotId robot = bench.document.now()->get(id_)->robots[0].robot;
  edit(AnyId(id_), [](model::Record& r) { std::get<model::World>(r.body).robots[0].q.clear(); });
  edit(AnyId(robot), [](model::Record& r) { std::get<model::Robot>(r.body).links.pop_back(); });
  sim::ForwardRun free = swing();
  free.is_controlled = false;
  const auto done = run.refresh(dynamics(free), progress);
  ASSERT_FALSE(done.ok());
  EXPECT_NE(done.error().message.find("does not fit"), std::string::npos);
  EXPECT_EQ(run.recording()->rows(), 11U);  // what was recorded stays
}

TEST_F(LiveWorlds, AControllerKeepsItsMemoryThroughARefresh) {
  ok(run.start(dynamics(swing()), progress));
  ok(run.finish(progress));
  const auto whole = run.recording();
  ok(run.go_to(0.25, progress));
  ok(run.refresh(dynamics(swing()), progress));
  ok(run.finish(progress));
  for (const char* column : {"q1", "qd2", "tau1"})
    EXPECT_NEAR(last(*run.recording(), column), last(*whole, column), 1e-7) << column;
}

TEST_F(LiveWorlds, TwoSimulationsAtOnceAreThoseOneAfterTheOther) {
  LiveRun other;
  ok(run.start(physics(fall()), progress));
  ok(other.start(dynamics(swing()), progress));
  run.play(sim::kAsFastAsPossible);
  other.play(sim::kAsFastAsPossible);
  ok(run.finish(progress));
  ok(other.finish(progress));
  const auto snapshot = bench.document.now();
  const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
  expect_equal_bits(*unwrap(sim::simulate_physics(simulator, fall(), progress)), *run.recording(),
                    true);
  expect_equal_bits(*unwrap(sim::forward_dynamics(simulator, swing(), progress)),
                    *other.recording(), true);
}

}  // namespace
}  // namespace robomosp
