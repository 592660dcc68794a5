// SPDX-License-Identifier: Apache-2.0
// What a window stands on: edits through the client reach the scene, runs and recordings move it,
// and the host's thread never waits.
#include "ioci/client/live_view.h"

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <sys/resource.h>

#include "ioci/client/window_program.h"
#include "model/placement.h"
#include "scene/build.h"

namespace robomosp {
namespace {

using namespace std::chrono_literals;
using ioci::Client;
using ioci::LiveView;
using Clock = std::chrono::steady_clock;

/// How long calls of this thread take. Time in which the system ran others instead of this thread,
/// though it did not wait for anything, does not count.
class Stopwatch {
 public:
  template <class Call>
  auto time(const Call& call) {
    struct Lap {
      Stopwatch& watch;
      long switches = involuntary();
      Clock::time_point begin = Clock::now();
      ~Lap() {
        const auto took = Clock::now() - begin;
        ++watch.calls_;
        if (involuntary() != switches) return;
        watch.longest_ = std::max(watch.longest_, took);
        watch.slow_ += took > 1ms;
      }
    } lap{*this};
    return call();
  }
  [[nodiscard]] double longest_ms() const {
    return std::chrono::duration<double, std::milli>(longest_).count();
  }
  [[nodiscard]] int calls() const { return calls_; }
  [[nodiscard]] int slow() const { return slow_; }  ///< of more than 1 ms

 private:
  static long involuntary() {
    rusage use{};
    getrusage(RUSAGE_THREAD, &use);
    return use.ru_nivcsw;
  }
  Clock::duration longest_{};
  int calls_ = 0, slow_ = 0;
};

/// Sleeps until it is woken, and delivers, as a window does.
class ViewHost {
 public:
  explicit ViewHost(ioci::Application& app) : here_(std::this_thread::get_id()) {
    LiveView::Options options;
    options.name = "host";
    options.wake = [this] {
      const std::lock_guard lock(mutex_);
      is_woken_ = true;
      woken_.notify_all();
    };
    options.on_picture = [this](const LiveView::PicturePtr& p) {
      EXPECT_EQ(std::this_thread::get_id(), here_);
      if (!p->only_moved) ++rebuilt;
      ++pictures;
      shown = p;
    };
    auto made = LiveView::open(app, std::move(options));
    EXPECT_TRUE(made.ok());
    view = std::move(*made);
  }
  void until(const std::function<bool()>& is_so, std::chrono::seconds patience = 60s) {
    const auto end = Clock::now() + patience;
    while (!is_so()) {
      ASSERT_LT(Clock::now(), end) << "it never became so";
      {
        std::unique_lock lock(mutex_);
        if (!woken_.wait_for(lock, 20ms, [this] { return is_woken_; })) continue;
        is_woken_ = false;
      }
      watch.time([&] { return view->deliver(); });
    }
  }
  Result<Value> result(const Client::Answer& a) {
    until([&] { return a.result() != nullptr; });
    if (a.result()) return *a.result();
    return error(ErrorCode::internal, "no result");
  }
  Value call(const std::string& command, Map args) {
    auto r = result(watch.time([&] { return view->client().call(command, std::move(args)); }));
    EXPECT_TRUE(r.ok()) << command << ": " << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? *r : Value();
  }
  Handle made(const std::string& command, Map args) {
    const Value v = call(command, std::move(args));
    EXPECT_NE(v.as_handle(), nullptr) << command;
    return v.as_handle() ? *v.as_handle() : Handle{};
  }
  /// What is shown once everything is exact, delivered.
  LiveView::PicturePtr settled() {
    NoProgress progress;
    auto p = view->settle(progress);
    EXPECT_TRUE(p.ok());
    until([&] { return shown == *p; });
    return *p;
  }

 private:
  std::thread::id here_;
  std::mutex mutex_;
  std::condition_variable woken_;
  bool is_woken_ = false;  // guarded by mutex_

 public:
  Stopwatch watch;
  LiveView::PicturePtr shown;
  int pictures = 0, rebuilt = 0;
  std::unique_ptr<LiveView> view;  ///< the last member: it may wake the host until it is gone
};

/// Names and poses of the items of a scene.
std::map<std::string, Pose> items_of(const render::Scene& scene) {
  std::map<std::string, Pose> out;
  for (const render::Item& i : scene.items) out[i.name + " " + std::to_string(i.id)] = i.pose;
  return out;
}
void expect_same_items(const render::Scene& a, const render::Scene& b) {
  const auto first = items_of(a), second = items_of(b);
  ASSERT_EQ(first.size(), second.size());
  for (const auto& [name, pose] : second) {
    const auto at = first.find(name);
    ASSERT_NE(at, first.end()) << name;
    EXPECT_EQ(at->second.p, pose.p) << name;
    EXPECT_EQ(at->second.R, pose.R) << name;
  }
}

class LiveViewTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    ioci::WindowProgramOptions options;
    options.plugin_path = {ROBOMOSP_PLUGIN_DIR};
    options.library = {std::filesystem::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"};
    options.keeps_unsaved = false;
    auto made = ioci::start_window_program(std::move(options));
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    holder() = std::move(*made);
  }
  static void TearDownTestSuite() { holder().reset(); }
  void SetUp() override { app().document.clear(); }
  static ioci::Application& app() { return *holder(); }
  /// Built anew from the document, moved by `motion`.
  static render::Scene anew(const Handle& what, scene::MotionPtr motion = nullptr) {
    NoProgress progress;
    const auto now = app().document.now();
    const auto id = ioci::Application::record_id(*now, what);
    EXPECT_TRUE(id.ok());
    auto built =
        scene::build({*now, app().derived, app().registry}, *id, {}, progress, std::move(motion));
    EXPECT_TRUE(built.ok()) << (built.ok() ? "" : built.error().sentence());
    return built.ok() ? std::move(built->scene) : render::Scene{};
  }
  /// A world of so many bolts.
  static Handle bolts(ViewHost& host, int count) {
    const Handle bolt = host.made(
        "solid.create",
        {{"name", "bolt"}, {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}}});
    const Handle cell = host.made("world.create", {{"name", "cell"}});
    for (int i = 0; i < count; ++i)
      host.call("world.add_object", {{"id", cell},
                                     {"what", bolt},
                                     {"name", "b" + std::to_string(i)},
                                     {"position", List{0.2 * i, 0.0, 0.0}}});
    return cell;
  }
  static ioci::Opened open(ViewHost& host, ioci::OpenRequest request) {
    std::optional<Result<ioci::Opened>> out;
    host.view->open_record(std::move(request),
                           [&](const Result<ioci::Opened>& r) { out.emplace(r); });
    host.until([&] { return out.has_value(); });
    EXPECT_TRUE(out && out->ok()) << (out && !out->ok() ? out->error().sentence() : "");
    return out && out->ok() ? **out : ioci::Opened{};
  }

 private:
  static std::unique_ptr<ioci::Application>& holder() {
    static std::unique_ptr<ioci::Application> one;
    return one;
  }
};

TEST_F(LiveViewTest, EditsOfTheClientReachTheSceneAndTheHostNeverWaits) {
  ViewHost host(app());
  const Handle cell = bolts(host, 300);
  host.watch.time([&] { host.view->show(cell); });
  expect_same_items(host.settled()->scene, anew(cell));
  ASSERT_EQ(host.shown->scene.items.size(), 300U);

  const int pictures = host.pictures, rebuilt = host.rebuilt;
  const Client::Edits drag = host.view->client().begin_gesture("drag");
  for (int i = 1; i <= 200; ++i) {
    const Client::Answer moved = host.watch.time([&] {
      return host.view->client().update(
          drag, "world.place",
          {{"id", cell}, {"member", "b7"}, {"position", List{0.01 * i, 0.0, 0.5}}});
    });
    if (i % 20 == 0) {
      EXPECT_TRUE(host.result(moved).ok());
    }
  }
  expect_same_items(host.settled()->scene, anew(cell));  // a preview of the gesture
  EXPECT_TRUE(host.result(host.view->client().commit(drag)).ok());
  const auto dragged = host.settled();
  expect_same_items(dragged->scene, anew(cell));
  EXPECT_EQ(dragged->frame->bodies[7]->bodies.front().p, (Vec3{2.0, 0.0, 0.5}));
  EXPECT_GT(host.pictures, pictures);
  EXPECT_EQ(host.rebuilt, rebuilt) << "a drag only moves";

  // Removal and undo.
  host.call("world.remove_member", {{"id", cell}, {"member", "b7"}});
  EXPECT_EQ(host.settled()->scene.items.size(), 299U);
  EXPECT_FALSE(host.shown->only_moved);
  host.call("document.undo", {});
  EXPECT_EQ(host.settled()->scene.items.size(), 300U);
  expect_same_items(host.shown->scene, anew(cell));
  host.call("solid.set", {{"id", "bolt"}, {"path", "nodes.1.x"}, {"value", 0.15}});
  EXPECT_FALSE(host.settled()->only_moved) << "another mesh";
  host.call("world.remove", {{"id", cell}});
  EXPECT_TRUE(host.settled()->scene.items.empty());
  ASSERT_TRUE(host.shown->frame->failure);
  host.call("document.undo", {});
  EXPECT_EQ(host.settled()->scene.items.size(), 300U);

  EXPECT_GT(host.watch.calls(), 500);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  // One in a hundred may meet a page fault or another guest of the machine.
  EXPECT_LE(host.watch.slow() * 100, host.watch.calls());
  EXPECT_LT(host.watch.longest_ms(), 20.0);
#endif
}

TEST_F(LiveViewTest, EditsOfOtherSessionsAreFollowedWhileTheClientIsBusy) {
  ViewHost host(app());
  const Handle cell = bolts(host, 3);
  host.view->show(cell);
  host.settled();
  std::mutex mutex;
  std::condition_variable changed;
  bool may_end = false;
  const Client::Answer busy =
      host.view->client().run("a long command", [&](ioci::Session&) -> Result<Value> {
        std::unique_lock lock(mutex);
        changed.wait(lock, [&] { return may_end; });
        return Value();
      });
  ioci::Session other("other");
  ASSERT_TRUE(app()
                  .dispatch(other, "world.place",
                            {{"id", cell}, {"member", "b1"}, {"position", List{9, 0, 0}}})
                  .ok());
  host.until([&] { return host.shown->frame->bodies[1]->bodies.front().p[0] == 9; });
  EXPECT_EQ(busy.stage(), Client::Answer::Stage::running);
  {
    const std::lock_guard lock(mutex);
    may_end = true;
  }
  changed.notify_all();
  EXPECT_TRUE(host.result(busy).ok());
}

TEST_F(LiveViewTest, RecordingsAndRunsMoveTheSceneByPoseAlone) {
  ViewHost host(app());
  const ioci::Opened opened = open(host, {.what = "pa10_circle"});
  ASSERT_TRUE(opened.recording);
  EXPECT_EQ(opened.name, "pa10_circle");
  EXPECT_LT(opened.from, opened.to);
  host.view->show(opened.what);
  const auto rest = host.settled();
  expect_same_items(rest->scene, anew(opened.what));

  const auto recording = app().recordings.find(opened.recording->number);
  ASSERT_TRUE(recording);
  const int rebuilt = host.rebuilt;
  const auto at = [&](double time) {
    auto motion =
        scene::motion_at(*app().document.now(), WorldId{opened.what.number}, *recording, time);
    EXPECT_TRUE(motion.ok());
    return std::make_shared<const scene::Motion>(std::move(*motion));
  };
  for (const double share : {0.0, 0.3, 0.71, 1.0}) {
    const double time = opened.from + share * (opened.to - opened.from);
    host.watch.time([&] { host.view->show_recording(*opened.recording, time); });
    expect_same_items(host.settled()->scene, anew(opened.what, at(time)));
  }
  EXPECT_EQ(host.rebuilt, rebuilt);
  host.view->rest();
  expect_same_items(host.settled()->scene, rest->scene);

  // A live run of the same motion shows its row, however it got there.
  const auto* world = app().document.now()->get(WorldId{opened.what.number});
  const Handle run =
      host.made("world.start_run", {{"id", opened.what},
                                    {"of", "inverse_kinematics"},
                                    {"with", Map{{"robot", world->robots[0].name},
                                                 {"trajectory", world->trajectories[0].name}}}});
  host.view->show_run(run);
  expect_same_items(host.settled()->scene, anew(opened.what, at(opened.from)));
  host.call("run.step", {{"id", run}, {"rows", 25}});
  const double time = recording->columns.front().values[25];
  const auto wanted = items_of(anew(opened.what, at(time)));
  host.until([&] { return items_of(host.shown->scene).size() == wanted.size(); });
  host.until([&] {
    const auto now = items_of(host.shown->scene);
    for (const auto& [name, pose] : wanted)
      if (now.at(name).p != pose.p) return false;
    return true;
  });
  EXPECT_EQ(host.rebuilt, rebuilt);

  // What does not fit is a sentence, and the last motion stays.
  host.view->show_recording({"recording", 99'999}, 0);
  ASSERT_EQ(host.settled()->left_out.size(), rest->left_out.size() + 1);
  EXPECT_NE(host.shown->left_out.back().find("recording #99999 no longer exists"),
            std::string::npos);
  host.view->rest();
  EXPECT_EQ(host.settled()->left_out, rest->left_out);
  expect_same_items(host.shown->scene, rest->scene);
}

TEST_F(LiveViewTest, LayersMapsAndOtherRecordsAreShownWhenAskedFor) {
  ViewHost host(app());
  const ioci::Opened opened = open(host, {.what = "planar2rods"});
  EXPECT_FALSE(opened.recording);
  host.view->show(opened.what);
  const std::size_t bodies = host.settled()->scene.items.size();
  EXPECT_TRUE(host.view->show_layer("velocity_ellipsoids", true).ok());
  EXPECT_EQ(host.settled()->scene.items.size(), bodies + 1);
  EXPECT_TRUE(host.view->show_layer("velocity_ellipsoids", false).ok());
  EXPECT_EQ(host.settled()->scene.items.size(), bodies);
  EXPECT_FALSE(host.view->show_layer("shadows", true).ok());

  const auto map = host.result(host.view->compute_map(opened.what, "manipulability", "", {}));
  ASSERT_TRUE(map.ok()) << map.error().sentence();
  ASSERT_TRUE(host.result(host.view->show_map({{"recording", *map}, {"cut", "-x"}})).ok());
  EXPECT_GT(host.settled()->scene.items.size(), bodies);
  EXPECT_EQ(host.shown->scene.legends.size(), 1U);
  host.view->explode(1);
  EXPECT_FALSE(host.settled()->only_moved);

  // Another record, without what was added to the one before.
  host.view->explode(0);
  const Handle cell = bolts(host, 2);
  host.view->show(cell);
  expect_same_items(host.settled()->scene, anew(cell));
  EXPECT_TRUE(host.shown->scene.legends.empty());
  const auto none = host.result(host.view->compute_map(cell, "manipulability", "", {}));
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().sentence().find("no robot that a map could be of"), std::string::npos);
}

TEST_F(LiveViewTest, WhatCannotBeOpenedIsAnErrorThatNamesIt) {
  ViewHost host(app());
  const auto refused = [&](ioci::OpenRequest request) {
    std::optional<Result<ioci::Opened>> out;
    host.view->open_record(std::move(request),
                           [&](const Result<ioci::Opened>& r) { out.emplace(r); });
    host.until([&] { return out.has_value(); });
    EXPECT_TRUE(out && !out->ok());
    return out && !out->ok() ? out->error().sentence() : std::string();
  };
  EXPECT_NE(refused({.what = "pa10_circel"}).find("Did you mean \"pa10_circle\"?"),
            std::string::npos);
  EXPECT_NE(refused({.what = "steel"}).find("\"steel\" is a material; it cannot be shown."),
            std::string::npos);
  EXPECT_NE(refused({.what = "nowhere/x.wld"}).find("nowhere/x.wld"), std::string::npos);
  EXPECT_NE(refused({.script = "nowhere.lua"}).find("there is no script \"nowhere.lua\""),
            std::string::npos);
}

TEST_F(LiveViewTest, AScriptIsOpenedWithItsSolvers) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "live-view-scripts";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "show.lua") << R"(
    ioci.provide("robomosp.ik/1", "mine", function(model, target) return {target[3][4]} end)
    local rail = robot.create{name = "rail", links = {{joint = "prismatic", lower = -1, upper = 1}}}
    rail:set{ik = "mine"}
    local way = trajectory.create{name = "way", sample_time = 0.1, segments = {
      {shape = "line", points = {{0, 0, 0, 0, 0, 0}, {0, 0, 0.5, 0, 0, 0}}, speed = 0.5}}}
    local cell = world.create{name = "cell"}
    cell:add_robot{robot = rail}
    cell:add_trajectory{trajectory = way}
    return cell:inverse_kinematics{robot = "rail", trajectory = "way"})";
  ViewHost host(app());
  const ioci::Opened opened = open(host, {.script = folder / "show.lua"});
  EXPECT_EQ(opened.name, "cell");
  ASSERT_TRUE(opened.recording);
  host.view->show(opened.what);
  host.view->show_recording(*opened.recording, opened.to);
  const auto p = host.settled();
  EXPECT_FALSE(p->frame->failure);
  EXPECT_FALSE(p->scene.lines.empty()) << "the path";
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace robomosp
