// SPDX-License-Identifier: Apache-2.0
// Every robot of the library, arms and mechanisms, through every command on robots, with arguments
// made from the commands' schemas: plain ones, extreme ones and wrong ones. Each is answered with
// finite numbers, or refused with a sentence, and a command that takes long ends when it is
// cancelled.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <ctime>
#include <filesystem>
#include <limits>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/models.h>

#include "support/library_robots.h"
#include "support/program.h"
#include "support/seed.h"

namespace robomosp::test {
namespace {

namespace fs = std::filesystem;
using conformance::Random;
using ioci::CommandSpec;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What may be infinite in an answer: limits that are not there, and measures of singular states.
const std::set<std::string> kMayBeInfinite{"lower", "upper", "max_velocity", "max_acceleration",
                                           "max_jerk", "max_force", "condition", "velocity",
                                           "force",
                                           // of a singular configuration
                                           "manipulability"};

/// The first number in an answer that is none, by its path; empty when all are finite.
std::string not_finite(const Value& v, const std::string& path = "") {
  const std::string field =
      path.substr(path.rfind('.') == std::string::npos ? 0 : path.rfind('.') + 1);
  const auto bad = [&](double x) {
    return std::isnan(x) || (std::isinf(x) && !kMayBeInfinite.contains(field));
  };
  if (const double* x = v.as_real()) return bad(*x) ? path + " = " + v.text() : "";
  if (const NumericArray* a = v.as_array())
    return std::any_of(a->data().begin(), a->data().end(), bad) ? path : "";
  if (const List* list = v.as_list())
    for (const Value& x : *list)
      if (auto found = not_finite(x, path); !found.empty()) return found;
  if (const Map* map = v.as_map())
    for (const auto& [name, x] : *map)
      if (auto found = not_finite(x, path + "." + name); !found.empty()) return found;
  return "";
}

/// Cancels what takes longer than it may.
class Watchdog {
 public:
  explicit Watchdog(ioci::Session& session) : session_(session), thread_([this] { watch(); }) {}
  ~Watchdog() {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    wake_.notify_all();
    thread_.join();
  }
  void begin() { since_ = now(); }
  /// Seconds since begin(), and whether it was cancelled.
  std::pair<double, bool> end() {
    const double took = now() - since_.exchange(kInfinity);
    const bool cancelled = session_.interrupted();
    session_.clear_interrupt();
    return {took, cancelled};
  }
  static constexpr double kPatience = 2;  ///< [s]

 private:
  static double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }
  void watch() {
    std::unique_lock lock(mutex_);
    while (!wake_.wait_for(lock, std::chrono::milliseconds(50), [this] { return ends_; }))
      if (now() - since_ > kPatience) session_.interrupt();
  }
  ioci::Session& session_;
  std::atomic<double> since_{kInfinity};
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ends_ = false;
  std::thread thread_;
};

enum class Taste { plain, extreme, wrong };

class RobotCommands : public CommandTest, public testing::WithParamInterface<std::string> {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    session_.deny(Effect::loads_code);
    session_.deny(Effect::processes);
    session_.deny(Effect::stops);
    folder_ = fs::temp_directory_path() /
              ("robot_commands_" + GetParam() + "_" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    fs::current_path(folder_);  // arguments that are names are files as well
    load();
  }
  void TearDown() override {
    fs::current_path(fs::temp_directory_path());
    fs::remove_all(folder_);
  }

  void load() {
    app().document.clear();
    robot_ = call("robot.get", {{"name", GetParam()}});
    cell_ = call("world.create", {{"name", "cell"}});
    call("world.add_robot", {{"id", cell_}, {"robot", robot_}});
    coordinates_ = call("robot.joint_values", {{"id", robot_}});
    // A way near the tool, an obstacle and a task, for the commands on worlds.
    const Value ball = call(
        "solid.create", {{"name", "ball"}, {"root", Map{{"kind", "sphere"}, {"radius", 0.05}}}});
    call("world.add_object",
         {{"id", cell_}, {"what", ball}, {"position", NumericArray({2.0, 2.0, 2.0})}});
    const auto at = app().dispatch(session_, "robot.fk", {{"id", robot_}, {"q", coordinates_}});
    const NumericArray from =
        at.ok() ? *at->as_map()->find("position")->as_array() : NumericArray({0.3, 0.0, 0.3});
    const auto point = [&](double up) {
      return Value(Map{{"position", NumericArray({from[0], from[1], from[2] + up})}});
    };
    call("trajectory.create",
         {{"name", "way"},
          {"sample_time", 0.1},
          {"segments", List{Map{{"shape", "line"}, {"points", List{point(0), point(0.01)}}}}}});
    call("world.add_trajectory", {{"id", cell_}, {"trajectory", "way"}});
    call("task.create", {{"name", "rest"}, {"steps", List{Map{{"step", "wait"}, {"time", 0.01}}}}});
    call("world.add_task", {{"id", cell_}, {"task", "rest"}, {"robot", GetParam()}});
  }
  std::size_t coordinates() const {
    return coordinates_.as_array() ? coordinates_.as_array()->size() : 6;
  }
  std::size_t velocities() {
    if (const Value dof = call("robot.dof", {{"id", robot_}}); dof.as_int())
      return static_cast<std::size_t>(*dof.as_int());
    return coordinates();
  }

  double number(Taste taste) {
    static constexpr double kExtremes[] = {0,    -0.0,  1e-300, 1e3,    -1e3,  1e9,
                                           1e77, 1e155, 1e200,  -1e200, 1e300, 1.7e308};
    if (taste == Taste::wrong && pick(4) == 0) return pick(2) ? kInfinity : std::nan("");
    if (taste == Taste::plain || pick(3) == 0) return random_.uniform(-1, 1);
    return kExtremes[pick(std::size(kExtremes))];
  }
  std::size_t pick(std::size_t n) {
    return std::min(n - 1, static_cast<std::size_t>(random_.uniform(0, static_cast<double>(n))));
  }
  Value numbers(std::size_t n, Taste taste) {
    if (taste == Taste::wrong && pick(3) == 0) n = pick(3) ? n + 1 : 0;
    std::vector<double> v;
    for (std::size_t i = 0; i < n; ++i) v.push_back(number(taste));
    return Value(NumericArray(std::move(v)));
  }
  Value target(Taste taste) {
    return Value(Map{{"position", numbers(3, taste)}, {"rpy", numbers(3, Taste::plain)}});
  }
  /// Something for a parameter; nothing = it is left out.
  std::optional<Value> argument(const ParamSpec& p, Taste taste) {
    const auto is = [&](std::initializer_list<const char*> names) {
      return std::any_of(names.begin(), names.end(), [&](const char* n) { return p.name == n; });
    };
    if (taste == Taste::wrong && pick(6) == 0)
      return pick(2) ? Value("no such thing") : Value(List{Value(Map{}), Value("x")});
    if (is({"q", "seed", "start"}) && p.choices.empty())
      return taste == Taste::plain ? coordinates_ : numbers(coordinates(), taste);
    if (is({"qd", "qdd", "tau", "reference"})) return numbers(velocities(), taste);
    if (is({"target"})) return target(taste);
    if (is({"targets"})) return Value(List{target(taste), target(taste)});
    if (is({"goals"})) return Value(List{Value(Map{{"target", target(taste)}})});
    if (is({"file", "folder"}))
      return Value((folder_ / (p.name == "file" ? "out.rbt" : "code")).string());
    if (is({"robot", "member", "from", "to"}) && p.type != "ref:robot" && pick(4) != 0)
      return Value(p.name == "to" || p.name == "from" ? coordinates_ : Value(GetParam()));
    if (is({"trajectory"}) && pick(4) != 0) return Value("way");
    if (is({"task"}) && pick(4) != 0) return Value("rest");
    if (is({"object"}) && pick(4) != 0) return Value("ball");
    if (is({"seconds"})) return Value(taste == Taste::plain ? 0.2 : number(taste));
    if (is({"duration"})) return Value(taste == Taste::plain ? 0.02 : number(taste));
    if (is({"sample_time", "step", "control_period"}))
      return Value(taste == Taste::plain ? 0.01 : number(taste));
    if (is({"name"})) return Value("n" + std::to_string(pick(3)));
    if (is({"width", "height"})) return Value(std::int64_t{64});
    if (!p.choices.empty()) return Value(p.choices[pick(p.choices.size())]);
    if (p.type == "bool") return Value(pick(2) == 0);
    if (p.type == "int") {
      constexpr std::int64_t kWhole[] = {0, 1, 2, 7, -1, 1000, 2147483648, 9223372036854775807};
      return Value(kWhole[pick(taste == Taste::plain ? 3 : std::size(kWhole))]);
    }
    if (p.type == "real") return Value(number(taste));
    if (p.type == "vec3") return numbers(3, taste);
    if (p.type == "real[]") return numbers(velocities(), taste);
    if (p.type == "pose") return target(taste);
    if (p.type.starts_with("ref:robot")) return robot_;
    if (p.type == "ref:world") return cell_;
    if (p.required) return numbers(3, taste);
    return std::nullopt;
  }

  Random random_{test::seed()};
  FuzzBudget budget_{1};
  fs::path folder_;
  Value robot_, cell_, coordinates_;
};

/// A chain of `n` links, and q = 0.001 of each joint.
class LongChains : public CommandTest {
 protected:
  static Map chain(std::size_t n) {
    List links;
    for (std::size_t i = 0; i < n; ++i) links.emplace_back(Map{{"a", 1e-3}, {"mass", 0.01}});
    return Map{{"name", "chain"}, {"links", Value(std::move(links))}};
  }
  double seconds(std::size_t links) {
    SetUp();
    const std::clock_t before = std::clock();
    call("robot.create", chain(links));
    return static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  }
};

TEST_F(LongChains, TakeTimeInProportionToTheirLength) {
  seconds(1000);  // what is done once
  const double few = seconds(5000), many = seconds(40000);
  EXPECT_LT(many, 8 * 3 * few + 0.1) << few << " s for 5,000 links";
}

TEST_F(LongChains, HaveForwardDynamicsOfASolverThatIsMadeForThem) {
  const Value robot = call("robot.create", chain(5000));
  const Value q(NumericArray(std::vector<double>(5000, 1e-3)));
  const std::clock_t before = std::clock();
  const Value qdd = call("robot.forward_dynamics", {{"id", robot}, {"q", q}});
  EXPECT_LT(static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC, 5);
  ASSERT_TRUE(qdd.as_array());
  EXPECT_EQ(qdd.as_array()->size(), 5000U);
  const Error refused =
      fails("robot.forward_dynamics", {{"id", robot}, {"q", q}, {"provider", "inertia_matrix"}});
  EXPECT_NE(refused.message.find("up to 1000"), std::string::npos) << refused.sentence();
}

TEST_P(RobotCommands, EachIsAnsweredWithNumbersOrRefusedWithASentence) {
  const auto all = app().commands.list();
  Watchdog watchdog(session_);
  std::size_t answered = 0, tried = 0;
  for (std::size_t round = 0; budget_.allows(round); ++round) {
    for (const CommandSpec* spec : all) {
      const bool is_of_world = spec->name.starts_with("world.");
      if ((!is_of_world && !spec->name.starts_with("robot.")) || spec->params.empty() ||
          spec->params.front().name != "id" ||
          !spec->params.front().type.starts_with(is_of_world ? "ref:world" : "ref:robot"))
        continue;
      // Live runs and pictures have tests of their own below.
      if (spec->name.ends_with(".start_run") || spec->name.ends_with(".render")) continue;
      for (const Taste taste :
           {Taste::plain, Taste::extreme, Taste::extreme, Taste::extreme, Taste::wrong}) {
        // Of the commands on worlds a part for each robot, all of them over all robots.
        if (is_of_world && !budget_.is_long() && pick(5) != 0) continue;
        Map args;
        args.set("id", is_of_world ? cell_ : robot_);
        for (const ParamSpec& p : spec->params) {
          if (p.name == "id" || (!p.required && pick(taste == Taste::plain ? 4 : 2) == 0)) continue;
          if (auto v = argument(p, taste)) args.set(p.name, std::move(*v));
        }
        const std::string line = spec->name + Value(args).text();
        const auto before = app().document.undo_labels().size();
        watchdog.begin();
        const auto done = app().dispatch(session_, spec->name, args);
        const auto [took, cancelled] = watchdog.end();
        ++tried;
        EXPECT_LT(took, Watchdog::kPatience + 10)
            << line << (cancelled ? " does not stop when it is cancelled" : "");
        if (done.ok()) {
          ++answered;
          const std::string bad = not_finite(*done, "." + spec->name);
          EXPECT_TRUE(bad.empty()) << line << " answers " << bad;
        } else {
          const Error& e = done.error();
          EXPECT_FALSE(e.message.empty()) << line;
          EXPECT_TRUE(e.code != ErrorCode::internal && e.code != ErrorCode::plugin_failed)
              << line << ": " << e.sentence();
        }
        if (app().document.undo_labels().size() != before) load();
      }
    }
  }
  EXPECT_GT(answered, tried / 8) << "hardly anything was answered: is it asked rightly?";
}

TEST_P(RobotCommands, AreDrawnAndRunLiveWithNothingLeftOutUnsaid) {
  const std::string picture = (folder_ / "robot.png").string();
  const Value drawn = call("robot.render", {{"id", robot_},
                                            {"file", picture},
                                            {"size", List{Value(96), Value(72)}},
                                            {"quality", "draft"}});
  ASSERT_TRUE(drawn.as_map()) << drawn.text();
  EXPECT_EQ(not_finite(drawn), "");
  EXPECT_GT(fs::file_size(picture), 500U);
  // A live run gives the rows of the whole one, or both are refused with one sentence.
  const Map asked{{"q", coordinates_}, {"duration", 0.02}, {"sample_time", 0.01}};
  Map whole_args{{"id", robot_}};
  for (const auto& [name, value] : asked) whole_args.set(name, value);
  const auto whole = app().dispatch(session_, "robot.simulate", whole_args);
  const auto live = app().dispatch(session_, "robot.start_run",
                                   {{"id", robot_}, {"of", "dynamics"}, {"with", asked}});
  ASSERT_EQ(whole.ok(), live.ok()) << (whole.ok() ? live : whole).error().sentence();
  if (!whole.ok()) return;
  call("run.finish", {{"id", *live}});
  const Value done = call("run.recording", {{"id", *live}});
  const auto rows = [&](const Value& recording) {
    // A live run has columns that a whole one leaves out when all is 0 in them.
    return call("recording.values", {{"id", recording}, {"columns", List{"time", "q"}}}).text();
  };
  EXPECT_EQ(rows(*whole), rows(done));
}

INSTANTIATE_TEST_SUITE_P(Library, RobotCommands, testing::ValuesIn(test::library_robots()),
                         [](const auto& c) { return c.param; });

}  // namespace
}  // namespace robomosp::test
