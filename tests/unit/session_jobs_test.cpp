// SPDX-License-Identifier: Apache-2.0
// Commands that do not stop the program: other sessions are answered while one computes, jobs end
// when they are told to and leave no trace, two that edit are brought together or refused, and
// solvers written in Lua answer every thread.
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <latch>
#include <map>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/ik.h>

#include "ioci/core/commands.h"
#include "lua/lua_state.h"
#include "support/program.h"
#include "support/seed.h"

namespace robomosp::lua {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// The work of the commands below waits for it.
struct Gate {
  std::atomic<bool> is_open{false};
  std::atomic<int> waiting{0};
  void wait(Progress& progress) {
    ++waiting;
    while (!is_open && !progress.cancelled()) std::this_thread::sleep_for(1ms);
    --waiting;
  }
};
Gate& gate() {
  static Gate one;
  return one;
}

/// Looks at a material, waits for the gate, then sets the density of another one.
Result<Value> slow_edit(ioci::CommandContext& ctx, const Map& args) {
  const double factor = ioci::content<model::Material>(ctx, args, "from").density;
  gate().wait(ctx.progress);
  if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "stopped");
  RMP_TRY(ioci::change<model::Material>(ctx, ioci::ref(args, "id"), [&](model::Material& m) {
    m.density = 2 * factor;
    return Result<void>();
  }));
  return Value(2 * factor);
}
Result<Value> slow_read(ioci::CommandContext& ctx, const Map&) {
  gate().wait(ctx.progress);
  if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "stopped");
  return Value("read");
}

/// Counts commands that edit, so that a test sees how often one was run.
std::atomic<int> tries{0};
Result<Value> count_up(ioci::CommandContext& ctx, const Map& args) {
  ++tries;
  return ioci::change<model::Material>(
             ctx, ioci::ref(args, "id"),
             [&](model::Material& m) {
               m.density += 1;
               return Result<void>();
             }).ok()
             ? Result<Value>(Value())
             : Result<Value>(error(ErrorCode::internal, "no edit"));
}

class SessionJobs : public test::ProgramTest {
 protected:
  static void SetUpTestSuite() {
    test::ProgramTest::SetUpTestSuite();
    std::vector<ioci::CommandSpec> own;
    own.push_back({.name = "slow.edit",
                   .classic = "",
                   .summary = "Waits and edits.",
                   .details = "",
                   .example = "slow.edit",
                   .params = {ioci::self("material"),
                              ioci::needed("from", "ref:material", "", "Another one.")},
                   .returns = {"real", "", "", {}},
                   .effect = Effect::edits,
                   .run = slow_edit});
    own.push_back({.name = "slow.read",
                   .classic = "",
                   .summary = "Waits.",
                   .details = "",
                   .example = "slow.read",
                   .params = {},
                   .returns = {"string", "", "", {}},
                   .effect = Effect::reads,
                   .run = slow_read});
    own.push_back({.name = "slow.count",
                   .classic = "",
                   .summary = "Adds one.",
                   .details = "",
                   .example = "slow.count",
                   .params = {ioci::self("material")},
                   .returns = {},
                   .effect = Effect::edits,
                   .run = count_up});
    app().commands.add(std::move(own));
  }
  void SetUp() override {
    ProgramTest::SetUp();
    gate().is_open = false;
    LuaOptions options;
    options.patience = 2s;
    state_ = std::make_unique<LuaState>(app(), session_, options);
  }
  void TearDown() override { gate().is_open = true; }
  std::string eval(std::string_view code) {
    auto r = state_->eval(code);
    return r.ok() ? *r
                  : "ERROR " + std::string(to_string(r.error().code)) + ": " + r.error().sentence();
  }
  void run(std::string_view code) { EXPECT_EQ(eval(code), ""); }
  /// An arm whose way is blocked: the search goes on until its time is over.
  void make_blocked_arm() {
    run("arm = robot.create{name = 'arm', convention = 'dh', links = {{a = 0.5, lower = -3, upper "
        "= 3}},\n"
        "  poses = {there = {1}, here = {-1}}}\n"
        "ball = solid.create{name = 'ball', root = {kind = 'sphere', radius = 0.1}}\n"
        "cell = world.create{name = 'cell'}\n"
        "cell:add_robot{robot = arm, q = 'here'}\n"
        "cell:add_object{what = ball, position = {0.4, 0, 0}}");
    // What is prepared once is no part of what is measured.
    EXPECT_EQ(eval("return cell:check_path{path = {'here', 'there'}}.is_free"), "false");
  }
  Map endless_plan() const {
    return Map{{"id", "cell"}, {"robot", "arm"}, {"to", "there"}, {"seconds", 120.0}};
  }
  MaterialId material(const std::string& name, double density) {
    const auto made =
        app().dispatch(session_, "material.create", {{"name", name}, {"density", density}});
    EXPECT_TRUE(made.ok());
    return MaterialId{made->as_handle()->number};
  }
  double density(MaterialId id) { return app().document.now()->get(id)->density; }
  /// Of what would last for minutes if it waited for another command: it has ended long before.
  /// What it took [ms] is only noted; the aim is for a machine that does nothing else.
  static void expect_early(double ms, const char* what, int aim) {
    RecordProperty(std::string(what) + "_ms", std::to_string(ms));
    std::printf("%s took %.0f ms (aim %d)\n", what, ms, aim);
    EXPECT_LT(ms, 15000) << what;
  }
  void until_running(const Handle& job) {
    while (app().jobs.status(job.number)->state == JobState::waiting)
      std::this_thread::sleep_for(1ms);
  }

  ioci::Session session_{"test"};
  std::unique_ptr<LuaState> state_;
};

TEST_F(SessionJobs, AnotherSessionIsAnsweredWhileOnePlansAndEndsIt) {
  make_blocked_arm();
  ioci::Session other("other");
  ASSERT_TRUE(app().dispatch(other, "robot.fk", {{"id", "arm"}, {"q", "here"}}).ok());
  Result<Value> planned = Value();
  std::atomic<bool> has_ended{false};
  std::thread planning([&] {
    planned = app().dispatch(session_, "world.plan_path", endless_plan());
    has_ended = true;
  });
  std::this_thread::sleep_for(300ms);
  double slowest = 0;
  for (int i = 0; i < 50; ++i) {
    const auto begin = Clock::now();
    ASSERT_TRUE(app().dispatch(other, "robot.fk", {{"id", "arm"}, {"q", "here"}}).ok());
    ASSERT_TRUE(app()
                    .dispatch(other, "material.create",
                              {{"name", "m" + std::to_string(i)}, {"density", 1000}})
                    .ok())
        << "edits go on too";
    slowest = std::max(slowest, ms_since(begin));
  }
  expect_early(slowest, "the_slowest_answer", 50);
  EXPECT_FALSE(has_ended) << "the search must go on for the test to say anything";
  const auto begin = Clock::now();
  session_.interrupt();  // what Ctrl-C does
  planning.join();
  expect_early(ms_since(begin), "the_end", 200);
  ASSERT_FALSE(planned.ok());
  EXPECT_EQ(planned.error().code, ErrorCode::cancelled) << planned.error().sentence();
  session_.clear_interrupt();
}

TEST_F(SessionJobs, AScriptStartsAJobDoesOtherThingsAndEndsIt) {
  make_blocked_arm();
  run("job = start('world.plan_path', {id = cell, robot = 'arm', to = 'there', seconds = 120})");
  std::this_thread::sleep_for(300ms);
  const auto begin = Clock::now();
  EXPECT_EQ(eval("return #arm:fk{q = 'here'}.position"), "3");
  expect_early(ms_since(begin), "the_answer", 50);
  EXPECT_EQ(eval("return job:progress().state"), "running");
  EXPECT_EQ(eval("return job.name"), "world.plan_path cell");
  const auto ending = Clock::now();
  EXPECT_EQ(eval("return job:cancel()"), "true");
  EXPECT_NE(eval("return job:wait()").find("ERROR cancelled"), std::string::npos);
  expect_early(ms_since(ending), "the_end", 200);
  EXPECT_EQ(eval("return job:progress().state"), "cancelled");
  EXPECT_EQ(eval("return job:cancel()"), "false");
}

TEST_F(SessionJobs, AJobGivesWhatItsCommandGivesAndItsErrors) {
  material("brass", 8500);
  EXPECT_EQ(eval("return #start('material.list'):wait()"), "1");
  EXPECT_EQ(eval("return start(material.describe, 'brass'):wait().density"), "8500");
  EXPECT_EQ(eval("start('material.create', {name = 'tin', density = 7300}):wait() return "
                 "#material.list()"),
            "2");
  EXPECT_EQ(app().document.undo_labels().front(), "material.create");
  // What is wrong with the arguments is said at once, the rest by the job.
  EXPECT_NE(eval("start('material.describe', {id = 'zinc'})").find("there is no material"),
            std::string::npos);
  EXPECT_NE(eval("start('no.such')").find("there is no command"), std::string::npos);
  EXPECT_NE(eval("start(7)").find("the command must be a text"), std::string::npos);
  EXPECT_NE(eval("local j = start('material.create', {name = 'tin', density = 1}) j:wait()")
                .find("there is already a material named \"tin\""),
            std::string::npos);
  EXPECT_NE(eval("ioci.transaction('g', function() start('material.list') end)")
                .find("a job cannot start while a group of edits is open"),
            std::string::npos);
  EXPECT_NE(eval("start('document.undo')").find("Call it without a job"), std::string::npos);
}

TEST_F(SessionJobs, AJobComputesWithTheRecordsAsTheyWereWhenItBegan) {
  const auto from = material("from", 100), own = material("own", 1);
  const auto job = app().dispatch_async(session_, "slow.edit", {{"id", "own"}, {"from", "from"}});
  ASSERT_TRUE(job.ok());
  while (gate().waiting == 0) std::this_thread::sleep_for(1ms);
  // Nobody has looked at this one: the job is made again on top of it.
  material("new", 5);
  ASSERT_TRUE(app().dispatch(session_, "material.rename", {{"id", "new"}, {"name", "newer"}}).ok());
  gate().is_open = true;
  const auto result = app().jobs.wait(job->number);
  ASSERT_TRUE(result.ok()) << result.error().sentence();
  EXPECT_EQ(density(own), 200);
  EXPECT_EQ(density(from), 100);
  EXPECT_TRUE(app().document.now()->find(Kind::material, "newer"));
}

TEST_F(SessionJobs, OfTwoJobsThatEditTheSecondIsBroughtTogetherOrRefusedWithWhatChanged) {
  const auto a = material("a", 100), b = material("b", 10), c = material("c", 1);
  const auto start = [&](const char* id, const char* from) {
    const auto job = app().dispatch_async(session_, "slow.edit", {{"id", id}, {"from", from}});
    EXPECT_TRUE(job.ok());
    return *job;
  };
  // b = 2 a, c = 2 b: whichever ends second has looked at what the first changed, or not.
  const Handle first = start("b", "a"), second = start("c", "b");
  while (gate().waiting < 2) std::this_thread::sleep_for(1ms);
  gate().is_open = true;
  const auto r1 = app().jobs.wait(first.number), r2 = app().jobs.wait(second.number);
  ASSERT_TRUE(r1.ok()) << "nobody changed what it looks at: " << r1.error().sentence();
  EXPECT_EQ(density(b), 200);
  if (r2.ok()) {  // it ended first
    EXPECT_EQ(density(c), 20);
  } else {
    EXPECT_EQ(r2.error().code, ErrorCode::conflict);
    EXPECT_EQ(r2.error().sentence(),
              "material \"b\" was changed by session \"test\" (slow.edit b) while slow.edit c was "
              "running. Nothing was changed. Run it again.");
    EXPECT_EQ(density(c), 1);
  }
  // Refused for certain: the edit comes from elsewhere while the job waits.
  gate().is_open = false;
  const Handle third = start("c", "a");
  while (gate().waiting < 1) std::this_thread::sleep_for(1ms);
  ASSERT_TRUE(app().dispatch(session_, "material.set", {{"id", "a"}, {"density", 50}}).ok());
  gate().is_open = true;
  const auto r3 = app().jobs.wait(third.number);
  ASSERT_FALSE(r3.ok());
  EXPECT_NE(r3.error().sentence().find("material \"a\" was changed by session \"test\""),
            std::string::npos)
      << r3.error().sentence();
  EXPECT_EQ(app().jobs.status(third.number)->state, JobState::failed);
  // Two that have nothing to do with each other both stand.
  gate().is_open = false;
  const Handle left = start("b", "a"), right = start("c", "a");
  while (gate().waiting < 2) std::this_thread::sleep_for(1ms);
  gate().is_open = true;
  EXPECT_TRUE(app().jobs.wait(left.number).ok());
  EXPECT_TRUE(app().jobs.wait(right.number).ok());
  EXPECT_EQ(density(b), 100);
  EXPECT_EQ(density(c), 100);
  EXPECT_EQ(density(a), 50);
}

TEST_F(SessionJobs, ShortCommandsThatAreOvertakenAreRunAgain) {
  const auto id = material("count", 1000);
  tries = 0;
  constexpr int kThreads = 4, kEach = 100;
  std::atomic<int> refused{0};
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < kThreads; ++t)
      threads.emplace_back([&, t] {
        ioci::Session own("thread " + std::to_string(t));
        for (int i = 0; i < kEach; ++i)
          while (!app().dispatch(own, "slow.count", {{"id", "count"}}).ok()) ++refused;
      });
  }
  EXPECT_EQ(density(id), 1000 + kThreads * kEach) << "no count is lost";
  EXPECT_LT(refused, kThreads * kEach / 10);
  EXPECT_GE(tries, kThreads * kEach);
}

TEST_F(SessionJobs, ASessionThatEndsEndsItsJobs) {
  material("a", 1);
  std::uint64_t job = 0;
  {
    ioci::Session own("own");
    job = app().dispatch_async(own, "slow.edit", {{"id", "a"}, {"from", "a"}})->number;
    while (gate().waiting == 0) std::this_thread::sleep_for(1ms);
  }
  EXPECT_EQ(app().jobs.status(job)->state, JobState::cancelled);
  EXPECT_EQ(gate().waiting, 0);
}

TEST_F(SessionJobs, AJobThatIsCancelledAtAnyMomentLeavesEverythingAsItWas) {
  make_blocked_arm();
  run("material.create{name = 'wood', density = 600}\n"
      "local parts = {}\n"
      "for i = 1, 12 do parts[i] = {kind = 'cylinder', radius = 0.002 * i, height = 1,\n"
      "  placement = {position = {0.07 * i, 0, -0.5}}} end\n"
      "plate = solid.create{name = 'plate', material = 'wood', chord = 0.00005, root = {kind = "
      "'difference',\n"
      "  children = {{kind = 'box', x = 2, y = 0.4, z = 0.2}, {kind = 'union', children = "
      "parts}}}}\n"
      "heavy = object.create{name = 'heavy', parts = {{what = plate}}}\n"
      "cell:add_object{what = heavy, position = {0, 0, -3}}");
  const auto folder = fs::temp_directory_path() / ("robomosp-jobs-" + std::to_string(::getpid()));
  fs::create_directories(folder);
  const auto files = [&] {
    std::vector<std::string> names;
    for (const auto& f : fs::directory_iterator(folder)) names.push_back(f.path().filename());
    return names;
  };
  const std::vector<std::pair<std::string, Map>> work{
      {"world.plan_path", endless_plan()},
      {"solid.mass", {{"id", "plate"}}},
      {"world.evaluate", {{"id", "cell"}}},
      {"robot.find_allowed_pairs", {{"id", "arm"}, {"samples", 200000}}},
      {"solid.export", {{"id", "plate"}, {"file", (folder / "plate.stl").string()}}},
      {"robot.workspace", {{"id", "arm"}, {"samples", 2000000}}},
  };
  std::mt19937 random(test::seed());
  std::map<std::string, int> ended;
  for (int round = 0; round < 60; ++round) {
    const auto& [name, args] = work[static_cast<std::size_t>(round) % work.size()];
    app().derived.clear();
    const std::string digest = app().document.content_digest();
    const auto steps = app().document.undo_labels().size();
    const auto recordings = app().recordings.list().size();
    const auto revision = app().registry.revision();
    const auto job = app().dispatch_async(session_, name, args);
    ASSERT_TRUE(job.ok()) << name << ": " << job.error().sentence();
    std::this_thread::sleep_for(
        std::chrono::microseconds(std::uniform_int_distribution<int>(0, 60'000)(random)));
    app().jobs.cancel(job->number);
    const auto result = app().jobs.wait(job->number);
    if (result.ok()) {  // it was faster
      ++ended[name + " done"];
      if (app().document.undo_labels().size() > steps) {
        ASSERT_TRUE(app().document.undo().ok());
      }
      for (const auto& [number, r] : app().recordings.list())
        if (app().recordings.list().size() > recordings) app().recordings.remove(number);
      fs::remove(folder / "plate.stl");
      continue;
    }
    ++ended[name];
    EXPECT_EQ(result.error().code, ErrorCode::cancelled)
        << name << ": " << result.error().sentence();
    EXPECT_EQ(app().document.content_digest(), digest) << name;
    EXPECT_EQ(app().document.undo_labels().size(), steps) << name;
    EXPECT_EQ(app().recordings.list().size(), recordings) << name;
    EXPECT_EQ(app().registry.revision(), revision) << name;
    EXPECT_TRUE(files().empty()) << name;
  }
  EXPECT_GT(ended["world.plan_path"], 5) << "some must be cancelled";
  for (const auto& [what, count] : ended) RecordProperty(what, count);
  // What the cache holds after all that is what is computed anew.
  const auto mass = [&] {
    const auto r = app().dispatch(session_, "solid.mass", {{"id", "plate"}});
    return r.ok() ? r->text() : r.error().sentence();
  };
  const std::string kept = mass();
  app().derived.clear();
  EXPECT_EQ(mass(), kept);
  fs::remove_all(folder);
}

/// The arguments of robot.create for a chain.
Map long_chain(int count) {
  List links;
  for (int i = 0; i < count; ++i) links.emplace_back(Map{{"a", 0.01}, {"mass", 1.0}});
  Map args{{"name", "endless"}};
  args.set("links", std::move(links));
  return args;
}

double seconds_of(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Lets work go on, and measures how much of the processor its thread takes between two looks at
/// whether to stop: so long goes on what was told to stop.
class Looks final : public Progress {
 public:
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override {
    look();
    return false;
  }
  void look() const {
    const double now = seconds_of(CLOCK_THREAD_CPUTIME_ID);
    if (count++ > 0) longest = std::max(longest, now - last);
    last = now;
  }
  mutable int count = 0;
  mutable double last = 0, longest = 0;  ///< [s]
};

// Of time of the processor, as shares of the whole: neither a slow machine nor a busy one matters.
TEST_F(SessionJobs, MakingARobotOfAHundredThousandLinksLooksOftenWhetherToStop) {
  const Map args = long_chain(100'000);
  Looks progress;
  const double begin = seconds_of(CLOCK_THREAD_CPUTIME_ID);
  ASSERT_TRUE(app().dispatch_beside(session_, "robot.create", args, progress).ok());
  progress.look();  // publishing it and letting go of the arguments cannot be stopped
  const double whole = progress.last - begin;
  std::cout << progress.count << " looks, at most " << progress.longest << " s apart, " << whole
            << " s for all of it\n";
  EXPECT_GT(progress.count, 100);
  EXPECT_LT(progress.longest, 0.15 * whole);
}

// 100,000 links, cancelled at moments all over the time that they take. What counts is processor
// time, as the machine may be busy with other things; where it is slow, a share of the whole.
TEST_F(SessionJobs, MakingARobotOfAHundredThousandLinksEndsAtOnceWhenItIsCancelled) {
  const auto processor = [] { return seconds_of(CLOCK_PROCESS_CPUTIME_ID); };
  const Map args = long_chain(100'000);
  double whole = processor();
  const auto made = app().dispatch_async(session_, "robot.create", args);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  ASSERT_TRUE(app().jobs.wait(made->number).ok());
  whole = processor() - whole;
  ASSERT_TRUE(app().document.undo().ok());
  int cancelled = 0;
  double worst = 0;
  for (const double part : {0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.9, 0.95}) {
    const double after = part * whole;
    const std::string digest = app().document.content_digest();
    const double begin = processor();
    const auto job = app().dispatch_async(session_, "robot.create", args);
    ASSERT_TRUE(job.ok()) << job.error().sentence();
    const auto is_running = [&] {
      const auto state = app().jobs.status(job->number)->state;
      return state == JobState::waiting || state == JobState::running;
    };
    while (processor() - begin < after && is_running()) std::this_thread::sleep_for(1ms);
    const double asked = processor();
    app().jobs.cancel(job->number);
    const auto result = app().jobs.wait(job->number);
    worst = std::max(worst, processor() - asked);
    if (result.ok()) {
      ASSERT_TRUE(app().document.undo().ok());
      continue;
    }
    EXPECT_EQ(result.error().code, ErrorCode::cancelled) << result.error().sentence();
    EXPECT_EQ(app().document.content_digest(), digest);
    ++cancelled;
  }
  RecordProperty("milliseconds", static_cast<int>(1e3 * worst));
  std::cout << cancelled << " cancelled, " << worst << " s of processor time at most, " << whole
            << " s for all of it\n";
  EXPECT_GE(cancelled, 3);
  EXPECT_LT(worst, std::max(0.1, 0.25 * whole));
}

TEST_F(SessionJobs, ASolverOfAScriptAnswersJobsWhileTheScriptWaits) {
  run("arm = robot.create{name = 'rod', convention = 'dh', links = {{a = 1, lower = -3, upper = "
      "3}}}\n"
      "calls = 0\n"
      "ioci.provide('robomosp.ik/1', 'mine', function(model, target)\n"
      "  calls = calls + 1\n"
      "  return {math.atan(target(2, 4), target(1, 4))} end)");
  EXPECT_EQ(eval("local jobs = {}\n"
                 "for i = 1, 20 do jobs[i] = start(arm.solve_ik, arm, {target = "
                 "arm:fk{q = {0.1 * i}}.pose, provider = 'mine'}) end\n"
                 "for i = 1, 20 do assert(math.abs(jobs[i]:wait().q[1] - 0.1 * i) < 1e-9, i) end\n"
                 "return calls >= 20"),
            "true");
}

TEST_F(SessionJobs, ASolverOfAScriptIsCalledFromManyThreadsAtOnce) {
  run("arm = robot.create{name = 'rod', convention = 'dh', links = {{a = 1, lower = -3, upper = "
      "3}}}\n"
      "ioci.provide('robomosp.ik/1', 'mine', function(model, target)\n"
      "  return {math.atan(target(2, 4), target(1, 4))} end)");
  auto ik = app().registry.create<IkSolver>("mine");
  ASSERT_TRUE(ik.ok());
  NoProgress progress;
  const auto snapshot = app().document.now();
  const auto model = app().derived.robot_model(
      *snapshot, RobotId{snapshot->find(Kind::robot, "rod")->number}, {0, 0, -9.81}, progress);
  ASSERT_TRUE(model.ok());
  ASSERT_TRUE((*ik)->prepare(**model, *make_params({})).ok());
  std::atomic<int> solved{0}, ended{0};
  constexpr int kThreads = 4, kEach = 50;
  std::vector<std::jthread> threads;
  for (int t = 0; t < kThreads; ++t)
    threads.emplace_back([&, t] {
      for (int i = 0; i < kEach; ++i) {
        const double q = 0.01 * (t * kEach + i);
        Pose target;
        target.p = {std::cos(q), std::sin(q), 0};
        target.R = {std::cos(q), -std::sin(q), 0, std::sin(q), std::cos(q), 0, 0, 0, 1};
        IkBatch batch;
        batch.targets = {&target, 1};
        std::vector<IkResult> results(1);
        NoProgress none;
        const auto done = (*ik)->solve(batch, results, none);
        if (!done.ok()) ADD_FAILURE() << done.error().sentence();
        else if (std::abs(results[0].q.at(0) - q) < 1e-9) ++solved;
      }
      if (++ended == kThreads) gate().is_open = true;
    });
  // The script's thread is in a command that waits; it answers from there.
  EXPECT_EQ(eval("return start('slow.read'):wait()"), "read");
  threads.clear();
  EXPECT_EQ(solved, kThreads * kEach);
}

TEST_F(SessionJobs, AScriptThatIsBusyIsReportedToWhoCallsItsSolver) {
  LuaOptions options;
  options.patience = 50ms;
  state_ = std::make_unique<LuaState>(app(), session_, options);
  run("arm = robot.create{name = 'rod', convention = 'dh', links = {{a = 1, lower = -3, upper = "
      "3}}}\n"
      "ioci.provide('robomosp.ik/1', 'mine', function(model, target) return {0} end)\n"
      "job = start(arm.solve_ik, arm, {target = arm:fk{q = {0}}.pose, provider = 'mine'})\n"
      "local t = os.clock() while os.clock() - t < 0.3 do end");
  EXPECT_NE(eval("job:wait()").find("its script was busy for 0.05 s"), std::string::npos);
}

TEST_F(SessionJobs, ALiveRunAnswersWhileAnotherSessionWaitsForItsEnd) {
  run("material.create{name = 'wood', density = 600}\n"
      "solid.create{name = 'box', material = 'wood', root = {kind = 'box', x = 0.1, y = 0.1, z = "
      "0.1}}\n"
      "cell = world.create{name = 'cell'}\n"
      "cell:add_object{what = 'box', position = {0, 0, 0.5}}\n"
      "fall = cell:start_run('physics', {duration = 100000})\n"
      "job = start(fall.finish, fall)");
  double slowest = 0;
  bool has_rows = false;
  for (const auto end = Clock::now() + 60s; !has_rows && Clock::now() < end;) {
    const auto begin = Clock::now();
    has_rows = eval("return fall:state().rows > 1") == "true";
    slowest = std::max(slowest, ms_since(begin));
    std::this_thread::sleep_for(5ms);
  }
  EXPECT_TRUE(has_rows);
  expect_early(slowest, "the_slowest_answer", 50);
  EXPECT_EQ(eval("fall:pause() return fall:state().is_playing"), "false");
  EXPECT_NE(eval("job:wait()").find("another command moved the run meanwhile"), std::string::npos);
  run("fall:remove()");
}

}  // namespace
}  // namespace robomosp::lua
