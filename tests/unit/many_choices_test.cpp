// SPDX-License-Identifier: Apache-2.0
// Choices of every argument in documents of 10,000 members and 10,000 records: an answer needs
// memory for what it lists only, and the times of the slowest sources are noted.
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "docs/examples.h"
#include "kernel/type.h"
#include "model/records.h"
#include "support/allocations.h"

namespace robomosp::ioci {
namespace {

constexpr int kMany = 10'000;

std::string numbered(const char* word, int i) { return word + std::to_string(i); }

double own_seconds() {
  timespec t{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

class ManyChoices : public ::testing::Test {
 protected:
  void SetUp() override {
    app().document.clear();
    for (const auto& [number, r] : app().recordings.list()) app().recordings.remove(number);
  }
  static Application& app() { return test::examples_app(); }

  /// The slowest answer of an argument of each type [s], over all commands. `given` are arguments
  /// by the type of a command's first one.
  struct Slowest {
    double seconds = 0;
    std::size_t shown = 0;
    std::string argument;
  };
  std::map<std::string, Slowest> ask_all(const std::map<std::string, Map>& given,
                                         const std::string& prefix) {
    std::map<std::string, Slowest> out;
    for (const CommandSpec* spec : app().commands.list())
      for (const ParamSpec& p : spec->params) {
        const std::string type(plain_type(p.type));
        if (type_tree(p.type).kind == TypeKind::path) continue;  // below
        const std::string first = spec->params.empty() ? "" : spec->params[0].type;
        const auto it = given.find(first);
        const std::string key = type + (it == given.end() ? "" : " in " + first);
        if (out.contains(key)) continue;
        const Map args{{"command", spec->name},
                       {"argument", p.name},
                       {"given", it == given.end() ? Map() : it->second},
                       {"prefix", prefix}};
        Slowest s{1e9, 0, spec->name + " " + p.name};
        for (int pass = 0; pass < 2; ++pass) {
          const double begin = own_seconds();
          const auto found = app().dispatch(session_, "schema.choices", args);
          s.seconds = std::min(s.seconds, own_seconds() - begin);
          EXPECT_TRUE(found.ok()) << s.argument << ": " << found.error().sentence();
          if (found.ok() && found->as_list()) s.shown = found->as_list()->size();
        }
        out[key] = s;
      }
    return out;
  }
  /// Notes the slowest three.
  static void note(const std::string& what, const std::map<std::string, Slowest>& all) {
    std::vector<std::pair<double, std::string>> sorted;
    for (const auto& [type, s] : all)
      sorted.emplace_back(s.seconds,
                          type + " (" + s.argument + ", " + std::to_string(s.shown) + " listed)");
    std::sort(sorted.rbegin(), sorted.rend());
    for (std::size_t i = 0; i < std::min<std::size_t>(3, sorted.size()); ++i)
      std::cout << "Note: " << what << ": " << sorted[i].first * 1e3 << " ms for "
                << sorted[i].second << "\n";
  }
  /// Allocations of one answer.
  double allocations(const Map& args) {
    EXPECT_TRUE(app().dispatch(session_, "schema.choices", args).ok());
    const std::size_t before = test::allocations;
    (void)app().dispatch(session_, "schema.choices", args);
    return static_cast<double>(test::allocations - before);
  }
  std::vector<std::string> names(const Map& args) {
    const auto found = app().dispatch(session_, "schema.choices", args);
    EXPECT_TRUE(found.ok()) << found.error().sentence();
    std::vector<std::string> out;
    if (found.ok())
      for (const Value& v : *found->as_list()) out.push_back(v.as_map()->find("value")->text());
    return out;
  }

  Session session_{"choices"};
};

/// Records of each kind with 10,000 of everything that they can have.
void fill_wide(Application& app) {
  auto t = app.document.begin("wide");
  ASSERT_TRUE(t.ok());
  const auto add = [&t](const char* name, auto record) {
    auto made = t->add(name, std::move(record));
    EXPECT_TRUE(made.ok()) << made.error().sentence();
    return *made;
  };
  const auto all = [](auto& list, const char* word, auto&& fill) {
    for (int i = 1; i <= kMany; ++i) {
      typename std::remove_reference_t<decltype(list)>::value_type element;
      element.name = numbered(word, i);
      fill(element, i);
      list.push_back(std::move(element));
    }
  };
  const auto none = [](auto&, int) {};
  const auto parameters = [](auto& record) {
    for (int i = 1; i <= kMany; ++i)
      record.parametric.parameters.push_back({numbered("p", i), "", "m", 0.1, "A length."});
  };
  model::Solid solid;
  solid.nodes.push_back({CsgKind::union_, "all", -1, {}, {}});
  for (int i = 1; i <= kMany; ++i)
    solid.nodes.push_back({CsgKind::box, numbered("n", i), 0, {}, {1, 1, 1}});
  parameters(solid);
  const SolidId brick = add("wide_solid", std::move(solid));
  model::Object object;
  all(object.parts, "part", [&](auto& p, int) { p.what = AnyId(brick); });
  all(object.tcps, "tcp", none);
  const ObjectId thing = add("wide_object", std::move(object));
  model::Robot chain;
  all(chain.links, "link", [](model::Link& l, int i) { l.parent = i / 2 - 1; });
  all(chain.axes, "axis", [](auto& p, int i) { p.link = i - 1; });
  const RobotId links = add("wide_links", std::move(chain));
  model::Robot arm;
  for (const char* name : {"turn", "reach"}) {
    arm.links.emplace_back();
    arm.links.back().name = name;
    arm.links.back().parent = static_cast<std::int32_t>(arm.links.size()) - 2;
  }
  all(arm.poses, "pose", [](auto& p, int) { p.q = {0, 0}; });
  all(arm.tools, "tool", [](auto& p, int) { p.link = 1; });
  all(arm.attached, "held", [&](auto& p, int) { p.link = 1, p.what = AnyId(thing); });
  all(arm.loops, "loop", [](auto& p, int) { p.link_a = 0, p.link_b = 1; });
  const RobotId two = add("wide_arm", std::move(arm));
  model::Trajectory way;
  way.segments.resize(kMany);
  for (auto& s : way.segments) s.shape.name = "line";
  const TrajectoryId along = add("wide_trajectory", std::move(way));
  model::Task job;
  job.steps.resize(kMany);
  const TaskId task = add("wide_task", std::move(job));
  model::World world;
  all(world.objects, "object", [&](auto& p, int) { p.what = AnyId(brick); });
  all(world.robots, "robot", [&](auto& p, int i) { p.robot = i == 1 ? links : two; });
  all(world.trajectories, "way", [&](auto& p, int) { p.trajectory = along; });
  all(world.frames, "frame", none);
  all(world.lights, "light", none);
  all(world.tasks, "job", [&](auto& p, int) { p.task = task; });
  all(world.signals, "signal", none);
  add("wide_world", std::move(world));
  const auto done = t->commit();
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  recording::Recording r;
  r.title = "wide";
  for (int i = 1; i <= kMany; ++i) {
    r.columns.emplace_back();
    r.columns.back().name = numbered("c", i);
    r.columns.back().values = {0};
  }
  app.recordings.add(std::make_shared<const recording::Recording>(std::move(r)));
}

/// 10,000 small records of each kind.
void fill_many(Application& app) {
  auto t = app.document.begin("many");
  ASSERT_TRUE(t.ok());
  for (int i = 1; i <= kMany; ++i) {
    model::Solid solid;
    solid.nodes.push_back({CsgKind::box, "box", -1, {}, {1, 1, 1}});
    const auto what = t->add(numbered("solid", i), std::move(solid));
    model::Robot robot;
    robot.links.resize(2);
    robot.links[0].name = numbered("a", i), robot.links[1].name = numbered("b", i);
    robot.links[1].parent = 0;
    robot.poses.push_back({"home", {0, 0}});
    const auto arm = t->add(numbered("robot", i), std::move(robot));
    model::World world;
    world.objects.push_back({numbered("o", i), AnyId(*what), {}});
    model::PlacedRobot placed;
    placed.name = numbered("r", i), placed.robot = *arm;
    world.robots.push_back(std::move(placed));
    ASSERT_TRUE(t->add(numbered("world", i), std::move(world)).ok());
    ASSERT_TRUE(t->add(numbered("material", i), model::Material{}).ok());
    ASSERT_TRUE(t->add(numbered("task", i), model::Task{}).ok());
    ASSERT_TRUE(t->add(numbered("trajectory", i), model::Trajectory{}).ok());
  }
  const auto done = t->commit();
  ASSERT_TRUE(done.ok()) << done.error().sentence();
}

/// Allocations beside the members: the description of the form, names of the library, the answer.
constexpr double kPerAnswer = 6000, kPerRow = 14;

TEST_F(ManyChoices, OfRecordsWithManyMembersCostWhatTheyList) {
  fill_wide(app());
  const std::map<std::string, Map> given{
      {"ref:world", Map{{"id", "wide_world"}, {"robot", "robot2"}}},
      {"ref:robot", Map{{"id", "wide_links"}}},
      {"ref:solid", Map{{"id", "wide_solid"}}},
      {"ref:object", Map{{"id", "wide_object"}}},
      {"ref:task", Map{{"id", "wide_task"}}},
      {"ref:trajectory", Map{{"id", "wide_trajectory"}}},
      {"ref:recording", Map{{"id", "recording#1"}}}};
  auto arm = given;
  arm["ref:robot"] = Map{{"id", "wide_arm"}};
  for (const char* prefix : {"", "zzz"}) {
    note("prefix \"" + std::string(prefix) + "\", one wide record", ask_all(given, prefix));
    note("prefix \"" + std::string(prefix) + "\", a robot with many tools and poses",
         ask_all(arm, prefix));
  }
  if (!ROBOMOSP_COUNTS_MEMORY) GTEST_SKIP() << "a sanitizer has its own operators";
  std::set<std::string> asked;
  for (const CommandSpec* spec : app().commands.list())
    for (const ParamSpec& p : spec->params) {
      if (p.type.find("member:") == std::string::npos) continue;
      const auto it = given.find(spec->params[0].type);
      if (it == given.end() || !asked.insert(it->first + " " + p.type).second) continue;
      Map args{
          {"command", spec->name}, {"argument", p.name}, {"given", it->second}, {"prefix", "zzz"}};
      // Of bodies, each robot of the world has its own prefix.
      const double most =
          kPerAnswer + (p.type.find("member:body") == std::string::npos ? 0 : kMany);
      EXPECT_LE(allocations(args), most) << spec->name << " " << p.name << " without a match";
      args.set("prefix", "");
      const double rows = static_cast<double>(names(args).size());
      EXPECT_LE(allocations(args), most + kPerRow * rows) << spec->name << " " << p.name;
    }
}

TEST_F(ManyChoices, TheLimitEndsTheListAndAPrefixLeadsToTheRest) {
  fill_wide(app());
  const Map base{
      {"command", "world.allow_pair"}, {"argument", "a"}, {"given", Map{{"id", "wide_world"}}}};
  Map args = base;
  const auto first = names(args);
  ASSERT_EQ(first.size(), 1000U);
  EXPECT_EQ(first[0], "object1");
  EXPECT_EQ(first[999], "object1000");
  args.set("prefix", "OBJECT9999");
  EXPECT_EQ(names(args), std::vector<std::string>{"object9999"});
  args.set("prefix", "robot10000.");  // the last of all bodies
  args.set("at_most", 2);
  EXPECT_EQ(names(args), (std::vector<std::string>{"robot10000.base", "robot10000.turn"}));
  args = base;
  args.set("at_most", 10000);
  EXPECT_EQ(names(args).size(), 10000U);
}

TEST_F(ManyChoices, OfManyRecordsAreListedWithoutTheirModels) {
  fill_many(app());
  for (const char* prefix : {"", "zzz"})
    note("prefix \"" + std::string(prefix) + "\", many records", ask_all({}, prefix));
  const auto tips = names({{"command", "robot.fk"}, {"argument", "tip"}, {"prefix", "t"}});
  EXPECT_EQ(tips, std::vector<std::string>{"tool"}) << "each name once";
  const auto links = names(
      {{"command", "robot.set_link"}, {"argument", "link"}, {"prefix", "b1000"}, {"at_most", 10}});
  EXPECT_EQ(links, (std::vector<std::string>{"b1000", "b10000"}));
}

TEST_F(ManyChoices, OfAFolderWithManyFilesAreTheFirstByName) {
  const test::ExamplesFolder folder("many-files");
  for (int i = 1; i <= kMany; ++i) std::ofstream(numbered("f", i) + (i % 2 ? ".csv" : ".txt"));
  std::filesystem::create_directory("far");
  const Map args{{"command", "file.read"}, {"argument", "file"}};
  double least = 1e9;
  std::vector<std::string> found;
  for (int pass = 0; pass < 3; ++pass) {
    const double begin = own_seconds();
    found = names(args);
    least = std::min(least, own_seconds() - begin);
  }
  std::cout << "Note: files: " << least * 1e3 << " ms\n";
  ASSERT_EQ(found.size(), 1000U);
  EXPECT_EQ(found[0], "f1.csv");
  EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
  Map deeper = args;
  deeper.set("prefix", "fa");
  EXPECT_EQ(names(deeper), std::vector<std::string>{"far/"});
}

}  // namespace
}  // namespace robomosp::ioci
