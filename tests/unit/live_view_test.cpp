// SPDX-License-Identifier: Apache-2.0
// What a window stands on: edits through the client reach the scene, runs and recordings move it,
// and the host's thread never waits.
#include "ioci/client/live_view.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <sys/resource.h>

#include "ioci/client/window_program.h"
#include "ioci/core/commands.h"
#include "model/data.h"
#include "model/placement.h"
#include "scene/build.h"

namespace robomosp {
namespace {

using namespace std::chrono_literals;
using ioci::Client;
using ioci::LiveView;
using Clock = std::chrono::steady_clock;

/// How long calls of this thread take: by the processor time that they use, and by the clock. A
/// call that lasts although it computes little had no processor. The system reports that as
/// switches: involuntary ones to other threads, or voluntary ones where a mutex was held by a
/// thread without a processor; without any, the machine under the system ran another one.
class Stopwatch {
 public:
  template <class Call>
  auto time(const Call& call, const char* name = "call") {
    struct Lap {
      Stopwatch& watch;
      const char* name;
      Now begin = now();
      ~Lap() {
        const Now end = now();
        ++watch.calls_;
        const auto computed = end.processor - begin.processor;
        const auto lasted = end.clock - begin.clock;
        watch.computing_ += computed > 1ms;
        watch.computed_ = std::max(watch.computed_, computed);
        watch.lasted_ = std::max(watch.lasted_, lasted);
        if (lasted <= 1ms) return;
        watch.slow_ += std::string(watch.slow_.empty() ? "" : ", ") + name + " " +
                       std::to_string(in_ms(lasted));
        if (end.taken_away != begin.taken_away) ++watch.taken_away_;
        else if (end.waited != begin.waited) ++watch.waited_;
        else if (computed <= 1ms) ++watch.stolen_;
      }
    } lap{*this, name};
    return call();
  }
  [[nodiscard]] int calls() const { return calls_; }
  /// Calls of more than 1 ms of processor time.
  [[nodiscard]] int computing() const { return computing_; }
  [[nodiscard]] int waited() const { return waited_; }
  [[nodiscard]] std::string text() const {
    return std::to_string(calls_) + " calls, at most " + std::to_string(in_ms(computed_)) +
           " ms of processor time and " + std::to_string(in_ms(lasted_)) +
           " ms by the clock; above 1 ms by the clock: " + std::to_string(taken_away_) +
           " that lost the processor, " + std::to_string(waited_) + " that waited for a mutex, " +
           std::to_string(stolen_) + " on a machine that ran another one" +
           (slow_.empty() ? "" : " (" + slow_ + ")");
  }

 private:
  struct Now {
    std::chrono::nanoseconds processor{};
    Clock::time_point clock;
    long waited = 0, taken_away = 0;
  };
  static Now now() {
    rusage use{};
    getrusage(RUSAGE_THREAD, &use);
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return {std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec), Clock::now(),
            use.ru_nvcsw, use.ru_nivcsw};
  }
  static double in_ms(std::chrono::nanoseconds t) {
    return std::chrono::duration<double, std::milli>(t).count();
  }
  std::chrono::nanoseconds computed_{}, lasted_{};
  int calls_ = 0, computing_ = 0, taken_away_ = 0, waited_ = 0, stolen_ = 0;
  std::string slow_;  ///< the names and times [ms] of calls of more than 1 ms
};

/// Computes for so many seconds, and looks whether it is cancelled.
Result<Value> last(ioci::CommandContext& ctx, const Map& args) {
  const auto end = Clock::now() + std::chrono::duration<double>(ioci::real(args, "seconds"));
  while (Clock::now() < end)
    if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "stopped");
  return Value();
}
/// A result that takes long to destroy.
Result<Value> much(ioci::CommandContext&, const Map&) {
  List out;
  for (int i = 0; i < 100'000; ++i) out.emplace_back(Map{{"name", "a name that is not short"}});
  return Value(std::move(out));
}

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
      watch.time([&] { return view->deliver(); }, "deliver");
    }
  }
  /// Delivers what comes within a time.
  void deliver_for(Clock::duration time) {
    for (const auto end = Clock::now() + time; Clock::now() < end;) {
      {
        std::unique_lock lock(mutex_);
        if (!woken_.wait_until(lock, end, [this] { return is_woken_; })) return;
        is_woken_ = false;
      }
      watch.time([&] { return view->deliver(); }, "deliver");
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
    std::vector<ioci::CommandSpec> own;
    for (const auto& [name, run] : {std::pair{"test.last", &last}, std::pair{"test.much", &much}})
      own.push_back({.name = name,
                     .classic = "",
                     .summary = "For a test.",
                     .details = "",
                     .example = "test",
                     .params = {ioci::defaulted("seconds", "real", "s", 0.0, "How long.")},
                     .returns = {"any", "", "", {}},
                     .effect = Effect::reads,
                     .run = run});
    app().commands.add(std::move(own));
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
  /// A world of so many boxes, not through a client.
  static Handle boxes(int count) {
    auto tx = app().document.begin("fill");
    EXPECT_TRUE(tx.ok());
    model::Solid box;
    box.nodes.push_back({CsgKind::box, "block", -1, {}, {0.1, 0.1, 0.1}});
    const auto block = tx->add("block", box);
    model::World w;
    for (int i = 0; i < count; ++i)
      w.objects.push_back(
          {"b" + std::to_string(i), *block, {.position = {0.2 * (i % 100), 0.2 * (i / 100), 0}}});
    const auto cell = tx->add("hall", w);
    EXPECT_TRUE(tx->commit().ok());
    return ioci::Application::handle(*cell);
  }
  static void expect_quick(const Stopwatch& watch) {
    std::cout << watch.text() << "\n";
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    // An interrupt, or another machine, may count as time of a call.
    EXPECT_LE(watch.computing(), 1) << watch.text();
    // A mutex is held for microseconds; only a thread that lost its processor meanwhile holds it
    // longer.
    EXPECT_LE(watch.waited(), 1 + watch.calls() / 500) << watch.text();
#endif
  }
  /// Of what would last for more than `most`: it has ended before. What it took [ms] is only
  /// noted; the aim is for a machine that does nothing else.
  static void expect_early(Clock::duration took, const char* what, int aim,
                           std::chrono::seconds most = 15s) {
    const double ms = std::chrono::duration<double, std::milli>(took).count();
    RecordProperty(std::string(what) + "_ms", std::to_string(ms));
    std::printf("%s took %.0f ms (aim %d)\n", what, ms, aim);
    EXPECT_LT(took, most) << what;
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
  expect_quick(host.watch);
}

TEST_F(LiveViewTest, NoCallOfTheHostComputesForAMillisecondAmongTenThousandObjects) {
  ViewHost host(app());
  const Handle hall = boxes(10'000), cell = bolts(host, 2);
  host.watch.time([&] { host.view->show(hall); });
  ASSERT_EQ(host.settled()->scene.items.size(), 10'000U);
  // Results, frames and pictures whose last owner is the host, each several times.
  for (int i = 0; i < 10; ++i) {
    Client::Answer large = host.view->client().call("test.much");
    ASSERT_TRUE(host.result(large).ok());
    host.watch.time([&] { large = {}; }, "release a result");
    auto frame = host.shown->frame;
    auto picture = host.shown;
    host.watch.time([&] { host.view->show(cell); }, "show");
    ASSERT_EQ(host.settled()->scene.items.size(), 2U);
    host.watch.time([&] { frame = nullptr; }, "release a frame");
    host.watch.time([&] { picture = nullptr; }, "release a picture");
    host.watch.time([&] { host.view->show(hall); }, "show");
    ASSERT_EQ(host.settled()->scene.items.size(), 10'000U);
  }
  // A long command and a job, another session that drags, and a host that calls 60 times a second.
  const Client::Answer job = host.view->client().start("test.last", {{"seconds", 600}});
  const Client::Answer command = host.view->client().call("test.last", {{"seconds", 600}});
  std::atomic<bool> is_over{false};
  std::jthread other([&] {
    ioci::Session session("other");
    for (int i = 0; !is_over; ++i) {
      EXPECT_TRUE(app()
                      .dispatch(session, "world.place",
                                {{"id", hall},
                                 {"member", "b" + std::to_string(i % 100)},
                                 {"position", List{0.0, 0.0, 0.001 * i}}})
                      .ok());
      std::this_thread::sleep_for(5ms);
    }
  });
  const Client::Edits drag = host.view->client().begin_gesture("drag");
  std::set<const void*> distinct;
  LiveView::PicturePtr kept = host.shown;
  const int before = host.pictures;
  // On a loaded machine a picture shows more of the edits.
  const auto end = Clock::now() + 120s;
  for (int i = 0; (i < 240 || host.pictures - before <= 50) && Clock::now() < end; ++i) {
    host.watch.time(
        [&] {
          host.view->client().update(
              drag, "world.place",
              {{"id", hall}, {"member", "b5000"}, {"position", List{0.0, 0.001 * i, 1.0}}});
        },
        "update");
    if (i % 60 == 30)
      host.watch.time([&] { EXPECT_TRUE(host.view->show_layer("frames", i % 120 == 30).ok()); },
                      "show_layer");
    if (i % 20 == 10) host.watch.time([&] { kept = host.shown; }, "release a picture");
    host.deliver_for(16ms);
    distinct.insert(host.shown.get());
  }
  EXPECT_GT(host.pictures - before, 50);
  EXPECT_LE(distinct.size(), 8U) << "pictures are used again";
  EXPECT_EQ(command.stage(), Client::Answer::Stage::running);
  EXPECT_EQ(job.stage(), Client::Answer::Stage::running);
  is_over = true;
  other.join();
  for (const Client::Answer& a : {command, job}) {
    const auto asked = Clock::now();
    host.watch.time([&] { EXPECT_TRUE(host.view->client().cancel(a)); }, "cancel");
    EXPECT_EQ(host.result(a).error().code, ErrorCode::cancelled);
    expect_early(Clock::now() - asked, "cancelling", 200);
  }
  ASSERT_TRUE(host.result(host.view->client().commit(drag)).ok());
  host.watch.time([&] { EXPECT_TRUE(host.view->show_layer("frames", false).ok()); });
  expect_same_items(host.settled()->scene, anew(hall));
  expect_quick(host.watch);
}

TEST_F(LiveViewTest, ADraftIsPreviewedAndAcceptedWithoutARebuildOrTakenBack) {
  ViewHost host(app());
  const Handle hall = boxes(1'000);
  host.view->show(hall);
  const auto rest = host.settled();
  const std::string digest = app().document.content_digest();
  Client& client = host.view->client();
  const auto place = [&](const char* member, double z) {
    return Map{{"id", hall}, {"member", member}, {"position", List{0.0, 0.0, z}}};
  };
  for (const bool is_accepted : {false, true}) {
    const int rebuilt = host.rebuilt;
    const Client::Edits form = client.open_draft("move a box");
    host.watch.time([&] { host.view->show_draft(form); });
    for (int i = 1; i <= 300; ++i) {
      const Client::Answer a = host.watch.time(
          [&] { return client.update(form, "world.place", place("b7", 0.01 * i)); });
      if (i % 50 == 0) {
        EXPECT_TRUE(host.result(a).ok());
        EXPECT_EQ(host.settled()->frame->bodies[7]->bodies.front().p[2], 0.01 * i);
      }
    }
    EXPECT_EQ(app().document.content_digest(), digest) << "nobody else sees it";
    EXPECT_EQ(host.rebuilt, rebuilt) << "a preview only moves what the draft moves";
    const auto preview = host.settled();
    EXPECT_EQ(preview->frame->bodies[8], rest->frame->bodies[8]) << "the same member";
    if (is_accepted) {
      ASSERT_TRUE(host.result(client.commit(form)).ok());
      const auto accepted = host.settled();
      EXPECT_EQ(accepted, preview) << "the same frame, and no new picture";
      expect_same_items(accepted->scene, anew(hall));
      EXPECT_EQ(app().document.undo_labels().front(), "move a box");
    } else {
      ASSERT_TRUE(host.result(client.cancel(form)).ok());
      expect_same_items(host.settled()->scene, rest->scene);
      EXPECT_EQ(host.rebuilt, rebuilt);
    }
  }
  // A record that only the draft has; another mesh; what others do meanwhile.
  const Client::Edits form = client.open_draft("a pin");
  Client::How how;
  how.in = form;
  const auto pin = host.result(client.call(
      "solid.create",
      {{"name", "pin"}, {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.2}}}}, {},
      how));
  ASSERT_TRUE(pin.ok()) << pin.error().sentence();
  host.view->show(*pin->as_handle());
  ASSERT_TRUE(host.result(host.view->show_draft(form)).ok());
  ASSERT_EQ(host.settled()->scene.items.size(), 1U);
  ASSERT_TRUE(host.result(client.update(form, "solid.set",
                                        {{"id", *pin}, {"path", "nodes.1.z"}, {"value", 0.3}}))
                  .ok());
  EXPECT_FALSE(host.settled()->only_moved) << "another mesh";
  host.view->show_document();
  ASSERT_TRUE(host.settled()->frame->failure) << "the document has no such record";
  ASSERT_TRUE(host.result(host.view->show_draft(form)).ok());
  EXPECT_FALSE(host.settled()->frame->failure);
  host.view->show(hall);
  ASSERT_TRUE(host.result(client.update(form, "world.place", place("b9", 2))).ok());
  ioci::Session other("other");
  const auto by_other = [&](const char* command, const Map& args) {
    const auto done = app().dispatch(other, command, args);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
  };
  by_other("solid.set", {{"id", "block"}, {"path", "nodes.1.x"}, {"value", 0.05}});
  auto both = host.settled();
  EXPECT_EQ(both->frame->bodies[9]->bodies.front().p[2], 2);
  EXPECT_NE(both->scene.items[0].mesh, rest->scene.items[0].mesh) << "the other session's edit";
  EXPECT_TRUE(both->left_out.empty());
  by_other("world.place", place("b10", 3));  // the same record: a conflict, which is said
  both = host.settled();
  EXPECT_EQ(both->frame->bodies[9]->bodies.front().p[2], 2);
  ASSERT_EQ(both->left_out.size(), 1U);
  EXPECT_NE(both->left_out[0].find("world \"hall\" was changed by session \"other\""),
            std::string::npos)
      << both->left_out[0];
  EXPECT_EQ(host.result(client.commit(form)).error().code, ErrorCode::conflict);
  ASSERT_TRUE(host.result(client.cancel(form)).ok());
  EXPECT_TRUE(host.settled()->left_out.empty());
  expect_same_items(host.shown->scene, anew(hall));

  // Edits that are no draft, or one that has ended.
  EXPECT_NE(host.result(host.view->show_draft(form)).error().sentence().find("has ended"),
            std::string::npos);
  const Client::Edits drag = client.begin_gesture("drag");
  EXPECT_NE(host.result(host.view->show_draft(drag)).error().sentence().find("is a gesture"),
            std::string::npos);
  client.cancel(drag);
  expect_quick(host.watch);
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
  host.until([&] { return busy.stage() == Client::Answer::Stage::running; });
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
  std::optional<Result<ioci::Opened>> drawn;  // by material.render
  host.view->open_record({.what = "steel", .is_for_picture = true},
                         [&](const Result<ioci::Opened>& r) { drawn.emplace(r); });
  host.until([&] { return drawn.has_value(); });
  ASSERT_TRUE(drawn && drawn->ok());
  EXPECT_EQ((*drawn)->what.kind, "material");
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

/// A file of a script that ends with the test.
class Script {
 public:
  explicit Script(const std::string& code)
      : folder_(std::filesystem::path(testing::TempDir()) / "live-view-script") {
    std::filesystem::create_directories(folder_);
    file_ = folder_ / ("script" + std::to_string(next_++) + ".lua");
    std::ofstream(file_) << code;
  }
  ~Script() { std::filesystem::remove(file_); }
  Script(const Script&) = delete;
  Script& operator=(const Script&) = delete;
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

 private:
  static inline int next_ = 0;
  std::filesystem::path folder_, file_;
};

/// A world whose path is a curve of the script.
constexpr const char* kOwnCurve = R"(
  ioci.provide("robomosp.segment/2", "wave", {duration = 1, sample = function(points, params, t)
    return pose(points[1][1][4] + 0.1 * t, 0, 0.3) end})
  local wave = trajectory.create{name = "wave", segments = {
    {shape = "wave", points = {{0, 0, 0.3, 0, 0, 0}, {0.1, 0, 0.3, 0, 0, 0}}}}}
  local block = solid.create{name = "block", root = {kind = "box", x = 0.1, y = 0.1, z = 0.1}}
  local cell = world.create{name = "cell"}
  cell:add_object{what = block, name = "box"}
  cell:add_trajectory{trajectory = wave, name = "wave"}
  return cell)";

void move_curve(ioci::Application& app, double x) {
  auto tx = app.document.begin("move the curve");
  const auto id = app.document.now()->find(Kind::trajectory, "wave");
  ASSERT_TRUE(tx->edit(*id, [&](model::Record& r) -> Result<void> {
                  std::get<model::Trajectory>(r.body).segments[0].points[0].position[0] = x;
                  return {};
                }).ok());
  ASSERT_TRUE(tx->commit().ok());
}

TEST_F(LiveViewTest, ASolverOfAScriptWhoseThreadIsBusyIsWaitedForWhileTheRestIsShown) {
  const Script script(kOwnCurve);
  ViewHost host(app());
  const ioci::Opened opened = open(host, {.script = script.file()});
  host.view->show(opened.what);
  ASSERT_EQ(host.settled()->scene.lines.size(), 1U);
  EXPECT_NEAR(host.shown->scene.lines[0].points.front()[0], 0, 1e-9);
  const Client::Answer busy = host.view->client().call("test.last", {{"seconds", 30}});
  host.until([&] { return busy.stage() == Client::Answer::Stage::running; });
  move_curve(app(), 0.5);
  ioci::Session other("other");
  for (int i = 1; i <= 5; ++i) {
    ASSERT_TRUE(app()
                    .dispatch(other, "world.place",
                              {{"id", opened.what}, {"member", "box"}, {"position", List{0, 0, i}}})
                    .ok());
    host.until([&] { return host.shown->frame->bodies[0]->bodies.front().p[2] == i; });
    EXPECT_FALSE(host.shown->frame->is_exact) << "the path is outstanding";
    EXPECT_TRUE(host.shown->left_out.empty()) << host.shown->left_out.front();
    ASSERT_EQ(host.shown->scene.lines.size(), 1U) << "the path as it was";
  }
  EXPECT_EQ(busy.stage(), Client::Answer::Stage::running);
  host.view->client().cancel(busy);
  const auto p = host.settled();
  EXPECT_TRUE(p->frame->is_exact);
  EXPECT_TRUE(p->left_out.empty());
  EXPECT_NEAR(p->scene.lines[0].points.front()[0], 0.5, 1e-9);
}

TEST_F(LiveViewTest, ItEndsAtOnceWhileItsSceneWaitsForAScriptThatIsBusy) {
  const Script script(kOwnCurve);
  ViewHost host(app());
  const ioci::Opened opened = open(host, {.script = script.file()});
  host.view->show(opened.what);
  host.settled();
  const Client::Answer busy = host.view->client().call("test.last", {{"seconds", 30}});
  host.until([&] { return busy.stage() == Client::Answer::Stage::running; });
  move_curve(app(), 0.25);
  host.until([&] { return !host.shown->frame->is_exact; });
  const auto begin = Clock::now();
  host.view.reset();
  // The scene would wait for its script for 10 s.
  expect_early(Clock::now() - begin, "the_end", 1000, 8s);
}

/// A robot of one joint, and solvers that answer themselves or ask another one.
std::string solvers(const std::string& own, const std::string& other) {
  return "local rod = robot.list()[1] or robot.create{name = 'rod', convention = 'dh', links = {{a "
         "= 1, lower = -3, upper = 3}}}\n"
         "ioci.provide('robomosp.ik/1', '" +
         own +
         "', function(model, target)\n"
         "  return {math.atan(target(2, 4), target(1, 4))} end)\n"
         "ioci.provide('robomosp.ik/1', '" +
         own + "_by_" + other +
         "', function(model, target)\n"
         "  return robot('rod'):solve_ik{target = target, provider = '" +
         other +
         "'}.q end)\n"
         "return robot('rod')";
}

TEST_F(LiveViewTest, ClientsJobsAndDraftsUseSolversOfEachOthersScriptsAndNobodyIsLeftWaiting) {
  const Script first(solvers("one", "two")), second(solvers("two", "one"));
  ViewHost a(app()), b(app());
  const ioci::Opened rod = open(a, {.script = first.file()});
  open(b, {.script = second.file()});
  const auto arguments = [&](double q, const char* provider) {
    const Pose target{{std::cos(q), -std::sin(q), 0, std::sin(q), std::cos(q), 0, 0, 0, 1},
                      {std::cos(q), std::sin(q), 0}};
    return Map{{"id", rod.what}, {"target", pose_value(target)}, {"provider", provider}};
  };
  const auto begin = Clock::now();
  std::vector<std::pair<double, Client::Answer>> of_a, of_b;
  const Client::Edits draft = a.view->client().open_draft("try");
  for (int i = 0; i < 20; ++i) {
    const double q = 0.1 * i - 1;
    // Each thread asks the other one, which asks back; jobs and jobs on a draft ask both.
    of_a.emplace_back(q, a.view->client().call("robot.solve_ik", arguments(q, "two_by_one")));
    of_b.emplace_back(q, b.view->client().call("robot.solve_ik", arguments(q, "one_by_two")));
    of_b.emplace_back(q, b.view->client().start("robot.solve_ik", arguments(q, "two_by_one")));
    Client::How how;
    how.in = draft;
    how.job = true;
    of_a.emplace_back(q,
                      a.view->client().call("robot.solve_ik", arguments(q, "one_by_two"), {}, how));
  }
  const auto expect_all = [](ViewHost& host, const auto& all) {
    for (const auto& [q, answer] : all) {
      const auto solved = host.result(answer);
      ASSERT_TRUE(solved.ok()) << solved.error().sentence();
      EXPECT_NEAR(solved->as_map()->find("q")->as_array()->data()[0], q, 1e-9);
    }
  };
  expect_all(a, of_a);
  expect_all(b, of_b);
  // One that had waited until it was late would have failed.
  const double solved_s = std::chrono::duration<double>(Clock::now() - begin).count();
  RecordProperty("all_solved_s", std::to_string(solved_s));
  std::printf("80 solutions took %.1f s (aim 9)\n", solved_s);
  // A third session, on this thread, while the first client is busy with what ends.
  const Client::Answer busy = a.view->client().call("test.last", {{"seconds", 0.5}});
  ioci::Session third("third");
  const auto solved = app().dispatch(third, "robot.solve_ik", arguments(0.3, "one"));
  EXPECT_TRUE(solved.ok()) << (solved.ok() ? "" : solved.error().sentence());
  EXPECT_TRUE(a.result(busy).ok());
}

}  // namespace
}  // namespace robomosp
