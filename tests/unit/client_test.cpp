// SPDX-License-Identifier: Apache-2.0
// The client of a session: order, updates of which only the newest waits, cancelling, jobs,
// gestures and drafts, and its end with calls in flight. Without plugins, so that it is quickly
// built for ThreadSanitizer.
#include "ioci/client/client.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "ioci/core/commands.h"

namespace robomosp {
namespace {

using namespace std::chrono_literals;
using ioci::Client;
using Clock = std::chrono::steady_clock;
using Answer = Client::Answer;

/// Takes so many seconds, with reports of how far it is, and looks whether it is cancelled.
Result<Value> last(ioci::CommandContext& ctx, const Map& args) {
  const double seconds = ioci::real(args, "seconds");
  const auto begin = Clock::now();
  for (;;) {
    const double t = std::chrono::duration<double>(Clock::now() - begin).count();
    if (t >= seconds) return Value(seconds);
    if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "stopped");
    ctx.progress.report(t / seconds, "lasting");
    std::this_thread::sleep_for(2ms);
  }
}
/// For `test.hold`, whose calls have numbers.
struct Holding {
  std::atomic<bool> is_released{false};
  std::atomic<int> cancelled{0};   ///< the call whose cancel() has returned
  std::atomic<int> overlooked{0};  ///< checks after that which did not see it
  std::mutex mutex;
  std::set<int> began;  ///< guarded by mutex
  bool has_begun(int number) {
    const std::lock_guard lock(mutex);
    return began.contains(number);
  }
};
Holding holding;
/// Lasts until it is released or sees that it is cancelled; if deaf, it does not look.
Result<Value> hold(ioci::CommandContext& ctx, const Map& args) {
  const int number = static_cast<int>(ioci::real(args, "number"));
  {
    const std::lock_guard lock(holding.mutex);
    holding.began.insert(number);
  }
  while (!holding.is_released) {
    const bool was_cancelled = holding.cancelled == number;
    if (!ioci::flag(args, "deaf")) {
      if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "stopped");
      holding.overlooked += was_cancelled;
    }
    std::this_thread::sleep_for(2ms);
  }
  return Value(number);
}
/// Adds a word to the list of those that were said.
std::mutex said_mutex;
std::vector<std::string> said;
Result<Value> say(ioci::CommandContext&, const Map& args) {
  const std::lock_guard lock(said_mutex);
  said.push_back(ioci::text_of(args, "word"));
  return Value(said.back());
}
Result<Value> fail_by_exception(ioci::CommandContext&, const Map&) {
  throw std::runtime_error("boom");
}

/// What a window does: sleeps until it is woken, and delivers.
class Host {
 public:
  explicit Host(ioci::Application& app, std::function<void(const ioci::Event&)> on_event = {},
                ioci::EventFilter filter = {}) {
    Client::Options options;
    options.name = "host";
    options.wake = [this] {
      const std::lock_guard lock(mutex_);
      ++wakes_;
      woken_.notify_all();
    };
    options.events = std::move(filter);
    options.on_event = std::move(on_event);
    auto made = Client::open(app, std::move(options));
    EXPECT_TRUE(made.ok());
    client = std::move(*made);
  }
  /// Delivers until it is so.
  void until(const std::function<bool()>& is_so, std::chrono::seconds patience = 30s) {
    const auto end = Clock::now() + patience;
    while (!is_so()) {
      ASSERT_LT(Clock::now(), end) << "it never became so";
      {
        std::unique_lock lock(mutex_);
        if (woken_.wait_for(lock, 20ms, [this] { return wakes_ > 0; })) wakes_ = 0;
        else continue;
      }
      (void)client->deliver();
    }
  }
  Result<Value> result(const Answer& a) {
    until([&] { return a.result() != nullptr; });
    return *a.result();
  }

 private:
  std::mutex mutex_;
  std::condition_variable woken_;
  int wakes_ = 0;  // guarded by mutex_

 public:
  std::unique_ptr<Client> client;  ///< the last member: it may wake the host until it is gone
};

class ClientTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    ioci::ApplicationOptions options;
    options.library = {std::filesystem::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"};
    options.plugins = false;
    auto made = ioci::Application::create(std::move(options));
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    holder() = std::move(*made);
    std::vector<ioci::CommandSpec> own;
    const auto add = [&](const char* name, std::vector<ParamSpec> params,
                         Result<Value> (*run)(ioci::CommandContext&, const Map&)) {
      own.push_back({.name = name,
                     .classic = "",
                     .summary = "For a test.",
                     .details = "",
                     .example = "test",
                     .params = std::move(params),
                     .returns = {"any", "", "", {}},
                     .effect = Effect::reads,
                     .run = run});
    };
    add("test.last", {ioci::needed("seconds", "real", "s", "How long.")}, &last);
    add("test.hold",
        {ioci::needed("number", "int", "", "Which."),
         ioci::defaulted("deaf", "bool", "", false, "It does not look whether it is cancelled.")},
        &hold);
    add("test.say", {ioci::needed("word", "string", "", "What.")}, &say);
    add("test.throw", {}, &fail_by_exception);
    app().commands.add(std::move(own));
  }
  static void TearDownTestSuite() { holder().reset(); }
  void SetUp() override {
    app().document.clear();
    said.clear();
    holding.is_released = false;
    holding.cancelled = holding.overlooked = 0;
    holding.began.clear();
  }
  static ioci::Application& app() { return *holder(); }
  static double density(const char* name) {
    const auto now = app().document.now();
    const auto id = now->find(Kind::material, name);
    return id ? now->get(MaterialId{id->number})->density : -1;
  }

 private:
  static std::unique_ptr<ioci::Application>& holder() {
    static std::unique_ptr<ioci::Application> one;
    return one;
  }
};

Map steel(double density) { return {{"name", "steel"}, {"density", density}}; }
Map to(double density) { return {{"id", "steel"}, {"density", density}}; }

TEST_F(ClientTest, CallsRunInTheirOrderAndAreToldOnTheHostsThread) {
  Host host(app());
  const auto here = std::this_thread::get_id();
  std::vector<int> told;
  std::vector<std::string> wanted;
  for (int i = 0; i < 500; ++i) {
    wanted.push_back(std::to_string(i));
    host.client->call("test.say", {{"word", wanted.back()}}, [&, i](const Result<Value>& r) {
      EXPECT_EQ(std::this_thread::get_id(), here);
      EXPECT_TRUE(r.ok());
      EXPECT_EQ(r->text(), std::to_string(i));
      told.push_back(i);
    });
  }
  host.until([&] { return told.size() == 500; });
  EXPECT_EQ(said, wanted);
  for (int i = 0; i < 500; ++i) EXPECT_EQ(told[static_cast<std::size_t>(i)], i);
}

TEST_F(ClientTest, ErrorsAndExceptionsOfCommandsAreResults) {
  Host host(app());
  EXPECT_EQ(host.result(host.client->call("no.command")).error().code, ErrorCode::unknown_name);
  EXPECT_EQ(host.result(host.client->call("test.last")).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(host.result(host.client->call("test.throw")).error().code, ErrorCode::internal);
  EXPECT_EQ(host.result(host.client->start("no.command")).error().code, ErrorCode::unknown_name);
  EXPECT_EQ(host.result(host.client->start("test.throw")).error().code, ErrorCode::internal);
  EXPECT_FALSE(Answer().result());
  EXPECT_FALSE(host.client->cancel(Answer()));
}

TEST_F(ClientTest, ACallbackThatThrowsHoldsUpNoOther) {
  Host host(app());
  int told = 0, thrown = 0;
  for (int i = 0; i < 3; ++i)
    host.client->call("test.say", {{"word", "a"}}, [&](const Result<Value>&) {
      ++told;
      throw std::runtime_error("host");
    });
  const auto end = Clock::now() + 30s;
  while (told < 3 && Clock::now() < end) {
    try {
      (void)host.client->deliver();
    } catch (const std::runtime_error&) {
      ++thrown;
    }
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_EQ(told, 3);
  EXPECT_EQ(thrown, 3);
}

TEST_F(ClientTest, AGestureOfUpdatesIsOneStepAndOnlyTheNewestWaits) {
  Host host(app());
  host.client->call("material.create", steel(1));
  const Answer before = host.client->call("test.last", {{"seconds", 600}});  // the updates wait
  const Client::Edits drag = host.client->begin_gesture("drag");
  std::vector<Answer> updates;
  for (int i = 1; i <= 100; ++i)
    updates.push_back(host.client->update(drag, "material.set", to(i)));
  const Answer kept = host.client->commit(drag);
  EXPECT_TRUE(host.client->cancel(before));
  ASSERT_TRUE(host.result(kept).ok()) << kept.result()->error().sentence();
  for (std::size_t i = 0; i + 1 < updates.size(); ++i) {
    ASSERT_TRUE(updates[i].result());
    EXPECT_TRUE(updates[i].was_replaced());
    EXPECT_EQ(updates[i].result()->error().code, ErrorCode::cancelled);
  }
  EXPECT_TRUE(updates.back().result()->ok());
  EXPECT_EQ(density("steel"), 100);
  EXPECT_EQ(app().document.undo_labels(), (std::vector<std::string>{"drag", "material.create"}));
  EXPECT_EQ(host.result(host.client->update(drag, "material.set", to(5))).error().code,
            ErrorCode::conflict)
      << "the gesture has ended";
}

TEST_F(ClientTest, AnUpdateIsNotReplacedAcrossACallThatCouldSeeItNorByAnotherSlot) {
  Host host(app());
  host.client->call("material.create", steel(1));
  host.client->call("material.create", {{"name", "brass"}, {"density", 1}});
  const Answer before = host.client->call("test.last", {{"seconds", 600}});  // the rest waits
  const Client::Edits drag = host.client->begin_gesture("drag");
  const Answer first = host.client->update(drag, "material.set", to(2));
  const Answer seen = host.client->call("material.describe", {{"id", "steel"}});
  const Answer other =
      host.client->update(drag, "material.set", {{"id", "brass"}, {"density", 7}}, {}, "brass");
  const Answer second = host.client->update(drag, "material.set", to(3), {}, "steel");
  const Answer third = host.client->update(drag, "material.set", to(4), {}, "steel");
  EXPECT_TRUE(host.client->cancel(before));
  ASSERT_TRUE(host.result(host.client->commit(drag)).ok());
  EXPECT_FALSE(first.was_replaced());
  EXPECT_EQ(seen.result()->value().as_map()->find("density")->number(), 2);
  EXPECT_FALSE(other.was_replaced());
  EXPECT_TRUE(second.was_replaced());
  EXPECT_FALSE(third.was_replaced());
  EXPECT_EQ(density("steel"), 4);
  EXPECT_EQ(density("brass"), 7);
}

TEST_F(ClientTest, ACancelledGestureIsTakenBackAndWaitingUpdatesWithIt) {
  Host host(app());
  host.client->call("material.create", steel(1));
  const Client::Edits drag = host.client->begin_gesture("drag");
  ASSERT_TRUE(host.result(host.client->update(drag, "material.set", to(2))).ok());
  EXPECT_EQ(density("steel"), 2);
  const Answer slow = host.client->call("test.last", {{"seconds", 0.2}});
  const Answer waits = host.client->update(drag, "material.set", to(3));
  ASSERT_TRUE(host.result(host.client->cancel(drag)).ok());
  EXPECT_EQ(waits.result()->error().code, ErrorCode::cancelled);
  EXPECT_TRUE(slow.result()->ok());
  EXPECT_EQ(density("steel"), 1);
  EXPECT_EQ(app().document.undo_labels().size(), 1U);
}

TEST_F(ClientTest, AGestureThatCannotBeginSaysWhyInAllThatJoinsIt) {
  Host host(app());
  host.client->call("material.create", steel(1));
  const Client::Edits one = host.client->begin_gesture("one");
  const Client::Edits two = host.client->begin_gesture("two");
  const Answer update = host.client->update(two, "material.set", to(2));
  const Answer kept = host.client->commit(two);
  EXPECT_NE(host.result(kept).error().message.find("already open"), std::string::npos)
      << kept.result()->error().sentence();
  EXPECT_NE(update.result()->error().message.find("already open"), std::string::npos);
  ASSERT_TRUE(host.result(host.client->commit(one)).ok());
}

// Without a clock: what has not begun never does, what runs ends at its next check, and neither
// waits for another command. How long that takes is the time between two checks.
TEST_F(ClientTest, WhatWaitsNeverBeginsAndWhatRunsEndsAtTheNextCheckWhenCancelled) {
  Host host(app());
  const auto end = [&](const Answer& a, int number) {
    EXPECT_TRUE(host.client->cancel(a));
    holding.cancelled = number;
    EXPECT_EQ(host.result(a).error().code, ErrorCode::cancelled);
    EXPECT_FALSE(host.client->cancel(a));
    EXPECT_EQ(holding.overlooked, 0) << number;
  };
  const Answer runs = host.client->call("test.hold", {{"number", 1}});
  const Answer waits = host.client->call("test.hold", {{"number", 2}});
  host.until([&] { return holding.has_begun(1); });
  end(waits, 2);
  EXPECT_EQ(runs.stage(), Answer::Stage::running);
  EXPECT_FALSE(holding.has_begun(2));
  end(runs, 1);
  const Answer job = host.client->start("test.hold", {{"number", 3}});
  const Answer beside = host.client->call("test.say", {{"word", "beside"}});
  EXPECT_TRUE(host.result(beside).ok()) << "a job holds up nothing";
  host.until([&] { return holding.has_begun(3); });
  EXPECT_EQ(job.stage(), Answer::Stage::running);
  end(job, 3);
  // Jobs that wait for their turn behind others.
  std::vector<Answer> jobs;
  for (int i = 0; i < 200; ++i)
    jobs.push_back(host.client->start("test.hold", {{"number", 100 + i}}));
  host.until([&] { return host.client->waiting() == 0 && holding.has_begun(100); });
  EXPECT_FALSE(holding.has_begun(299));
  end(jobs.back(), 299);
  EXPECT_FALSE(holding.has_begun(299));
  EXPECT_EQ(jobs.front().stage(), Answer::Stage::running);
  host.client->cancel_all();
  for (const Answer& a : jobs) EXPECT_EQ(host.result(a).error().code, ErrorCode::cancelled);
}

TEST_F(ClientTest, SixtyUpdatesASecondBesideALongCommandAndAJobLoseNothingAndKeepTheirOrder) {
  std::vector<double> seen;  // densities, as changes tell them
  Host host(app(),
            [&](const ioci::Event& e) {
              if (!e.change) return;
              for (const auto& r : e.change->records)
                if (r.after && r.id.kind == Kind::material)
                  seen.push_back(std::get<model::Material>(r.after->body).density);
            },
            {.topics = bit(ioci::Topic::change)});
  ASSERT_TRUE(host.result(host.client->call("material.create", steel(1))).ok());
  // Both last until all updates were made.
  const Answer job = host.client->start("test.hold", {{"number", 1}});
  const Client::Edits drag = host.client->begin_gesture("drag");
  std::vector<Answer> updates;
  std::size_t told = 0, came = 0;
  constexpr std::size_t kBeside = 60, kLeastCame = 30;
  auto next = Clock::now();
  const auto update = [&] {
    const double density = 10.0 + static_cast<double>(updates.size());
    updates.push_back(
        host.client->update(drag, "material.set", to(density), [&](const Result<Value>& r) {
          ++told;
          came += r.ok();
        }));
    next += std::chrono::microseconds(1'000'000 / 60);
    host.until([&] { return Clock::now() >= next; });
  };
  const auto begin = Clock::now();
  // On a loaded machine more of them are replaced.
  while (updates.size() < kBeside || came < kLeastCame) {
    ASSERT_LT(Clock::now() - begin, 120s) << "while the job runs alone they come through";
    update();
  }
  const std::size_t last_before = updates.size() - 1;
  const Answer command = host.client->call("test.hold", {{"number", 2}});
  for (std::size_t i = 0; i < kBeside; ++i) update();
  // The newest waits behind the command, all others have ended.
  host.until([&] { return told == updates.size() - 1; });
  host.until([&] { return holding.has_begun(1) && holding.has_begun(2); });
  EXPECT_EQ(job.stage(), Answer::Stage::running);
  EXPECT_EQ(command.stage(), Answer::Stage::running);
  EXPECT_EQ(updates.back().stage(), Answer::Stage::waiting);
  EXPECT_TRUE(host.client->cancel(job));
  EXPECT_EQ(host.result(job).error().code, ErrorCode::cancelled);
  holding.is_released = true;
  const double newest = 10.0 + static_cast<double>(updates.size() - 1);
  ASSERT_TRUE(host.result(host.client->commit(drag)).ok());
  EXPECT_TRUE(command.result()->ok());
  host.until([&] { return told == updates.size() && !seen.empty() && seen.back() == newest; });
  // Each update was either seen by all, or replaced by one behind it.
  std::vector<double> wanted{1};
  for (std::size_t i = 0; i < updates.size(); ++i) {
    const Answer& a = updates[i];
    ASSERT_TRUE(a.result());
    if (a.result()->ok()) wanted.push_back(10.0 + static_cast<double>(i));
    else EXPECT_TRUE(a.was_replaced()) << a.result()->error().sentence();
  }
  EXPECT_EQ(seen, wanted);
  EXPECT_TRUE(updates[last_before].result()->ok()) << "the command behind it could see it";
  EXPECT_TRUE(updates.back().result()->ok());
  EXPECT_EQ(density("steel"), newest);
  EXPECT_EQ(app().document.undo_labels(), (std::vector<std::string>{"drag", "material.create"}));
}

TEST_F(ClientTest, ProgressOfCallsAndJobsIsShown) {
  Host host(app());
  for (const bool job : {false, true}) {
    std::vector<double> shown;
    Client::How how;
    how.job = job;
    how.progress = [&](double fraction, const std::string& what) {
      EXPECT_EQ(what, "lasting");
      shown.push_back(fraction);
    };
    const Answer a = host.client->call("test.last", {{"seconds", 600}}, {}, std::move(how));
    host.until([&] { return shown.size() >= 3; });
    EXPECT_TRUE(host.client->cancel(a));
    EXPECT_EQ(host.result(a).error().code, ErrorCode::cancelled) << job;
    for (std::size_t i = 1; i < shown.size(); ++i) EXPECT_GE(shown[i], shown[i - 1]);
  }
}

TEST_F(ClientTest, DraftsAreEditedBesideTheDocumentAndJobsJoinThem) {
  Host host(app());
  ASSERT_TRUE(host.result(host.client->call("material.create", steel(1))).ok());
  const std::string before = app().document.content_digest();
  const Client::Edits one = host.client->open_draft("one"), two = host.client->open_draft("two");
  Client::How in_one, in_two;
  in_one.in = one;
  in_two.in = two;
  in_two.job = true;
  host.client->call("material.set", to(2), {}, in_one);
  const Answer job =
      host.client->call("material.create", {{"name", "brass"}, {"density", 3}}, {}, in_two);
  const Answer seen = host.client->call("material.describe", {{"id", "steel"}}, {}, in_one);
  EXPECT_EQ(host.result(seen)->as_map()->find("density")->number(), 2);
  ASSERT_TRUE(host.result(job).ok()) << job.result()->error().sentence();
  EXPECT_EQ(app().document.content_digest(), before);
  ASSERT_TRUE(host.result(host.client->commit(one)).ok());
  ASSERT_TRUE(host.result(host.client->commit(two)).ok());
  EXPECT_EQ(density("steel"), 2);
  EXPECT_EQ(density("brass"), 3);
  const Client::Edits three = host.client->open_draft("three");
  host.client->update(three, "material.set", to(9));
  ASSERT_TRUE(host.result(host.client->cancel(three)).ok());
  EXPECT_EQ(density("steel"), 2);
}

TEST_F(ClientTest, AJobThatJoinsAGestureIsAPreviewOfIt) {
  Host host(app());
  ASSERT_TRUE(host.result(host.client->call("material.create", steel(1))).ok());
  const Client::Edits drag = host.client->begin_gesture("drag");
  Client::How how;
  how.in = drag;
  how.job = true;
  ASSERT_TRUE(host.result(host.client->call("material.set", to(2), {}, how)).ok());
  EXPECT_EQ(density("steel"), 2);
  EXPECT_EQ(app().document.undo_labels().size(), 1U);
  ASSERT_TRUE(host.result(host.client->cancel(drag)).ok());
  EXPECT_EQ(density("steel"), 1);
}

TEST_F(ClientTest, ItEndsWithCallsInFlightAndLeavesNothingOpen) {
  std::vector<Answer> answers;
  int told = 0;
  auto alive = std::make_shared<int>(1);
  const std::weak_ptr<int> held = alive;
  const auto count = [&told, alive](const Result<Value>&) { ++told; };
  alive.reset();
  {
    Host host(app());
    ASSERT_TRUE(host.result(host.client->call("material.create", steel(1))).ok());
    const Client::Edits drag = host.client->begin_gesture("drag");
    ASSERT_TRUE(host.result(host.client->update(drag, "material.set", to(2))).ok());
    // They end only if they are cancelled.
    answers.push_back(host.client->start("test.hold", {{"number", 1}}, count));
    answers.push_back(host.client->call("test.hold", {{"number", 2}}, count));
    for (int i = 0; i < 20; ++i) {
      answers.push_back(host.client->start("test.hold", {{"number", 3 + i}}, count));
      answers.push_back(host.client->call("test.say", {{"word", "late"}}, count));
    }
    host.until([&] { return answers[1].stage() == Answer::Stage::running; });
  }
  EXPECT_EQ(told, 0);
  for (const Answer& a : answers) {
    ASSERT_TRUE(a.result());
    EXPECT_EQ(a.result()->error().code, ErrorCode::cancelled);
  }
  EXPECT_TRUE(said.empty());
  EXPECT_EQ(density("steel"), 1) << "its gesture was taken back";
  EXPECT_TRUE(app().document.gestures().empty());
  // `count` itself is the last that holds it.
  EXPECT_EQ(held.use_count(), 1);
}

TEST_F(ClientTest, ClosingDoesNotWaitForWhatRunsAndTellsTheRest) {
  Host host(app());
  int told = 0;
  const auto count = [&told](const Result<Value>& r) {
    EXPECT_EQ(r.error().code, ErrorCode::cancelled);
    ++told;
  };
  const Answer runs = host.client->call("test.hold", {{"number", 1}, {"deaf", true}},
                                        [&told](const Result<Value>&) { ++told; });
  host.client->call("test.hold", {{"number", 2}}, count);
  host.until([&] { return holding.has_begun(1); });
  host.client->close();
  EXPECT_EQ(runs.stage(), Answer::Stage::running);
  holding.is_released = true;
  host.client->call("test.say", {{"word", "late"}}, count);
  host.until([&] { return told == 3 && host.client->is_closed(); });
}

TEST_F(ClientTest, ACallbackMayEndTheClient) {
  Host host(app());
  int told = 0;
  for (int i = 0; i < 3; ++i)
    host.client->call("test.say", {{"word", "x"}}, [&](const Result<Value>&) {
      ++told;
      host.client.reset();
    });
  std::this_thread::sleep_for(100ms);
  Client* client = host.client.get();
  EXPECT_FALSE(client->deliver());
  EXPECT_EQ(told, 1);
  EXPECT_FALSE(host.client);
}

TEST_F(ClientTest, AProgressCallbackMayEndTheClient) {
  Host host(app());
  int shown = 0;
  Client::How how;
  how.progress = [&](double, const std::string&) {
    ++shown;
    host.client.reset();
  };
  host.client->call(
      "test.last", {{"seconds", 10}},
      [](const Result<Value>&) { ADD_FAILURE() << "the client has ended"; }, std::move(how));
  const auto end = Clock::now() + 30s;
  while (host.client && Clock::now() < end) {
    Client* client = host.client.get();
    (void)client->deliver();
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_EQ(shown, 1);
  EXPECT_FALSE(host.client);
}

TEST_F(ClientTest, AnEventCallbackThatThrowsLosesNoEventBehindIt) {
  std::vector<std::string> heard;
  int thrown = 0;
  ioci::EventFilter filter;
  filter.topics = ioci::bit(ioci::Topic::command);
  Host host(
      app(),
      [&](const ioci::Event& e) {
        heard.push_back(e.command->command);
        throw std::runtime_error("host");
      },
      std::move(filter));
  std::vector<Answer> answers;
  for (int i = 0; i < 5; ++i)
    answers.push_back(host.client->call("material.create",
                                        {{"name", "m" + std::to_string(i)}, {"density", 1 + i}}));
  const auto end = Clock::now() + 30s;
  while (heard.size() < 5 && Clock::now() < end) {
    try {
      (void)host.client->deliver();
    } catch (const std::runtime_error&) {
      ++thrown;
    }
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_EQ(heard, std::vector<std::string>(5, "material.create"));
  EXPECT_EQ(thrown, 5);
  for (const Answer& a : answers) EXPECT_TRUE(a.result() && a.result()->ok());
}

TEST_F(ClientTest, NoCallEndsBeforeTheEventsThatCameEarlier) {
  ioci::EventFilter filter;
  filter.topics = ioci::bit(ioci::Topic::command) | ioci::bit(ioci::Topic::change);
  int changes = 0, commands = 0, ended = 0;
  Host host(
      app(),
      [&](const ioci::Event& e) {
        changes += e.topic == ioci::Topic::change;
        commands += e.topic == ioci::Topic::command;
      },
      std::move(filter));
  Answer last;
  for (int i = 1; i <= 20; ++i)
    last = host.client->call("material.create",
                             {{"name", "m" + std::to_string(i)}, {"density", 1 + i}},
                             [&, i](const Result<Value>& r) {
                               EXPECT_TRUE(r.ok());
                               EXPECT_EQ(++ended, i);
                               EXPECT_GE(changes, i);
                               EXPECT_GE(commands, i);
                             });
  while (last.stage() != Answer::Stage::ended) std::this_thread::sleep_for(1ms);
  // One callback at a time, as for a host that has little time.
  const auto end = Clock::now() + 30s;
  while (ended < 20 && Clock::now() < end) (void)host.client->deliver(0us);
  EXPECT_EQ(ended, 20);
  EXPECT_EQ(changes, 20);
  EXPECT_EQ(commands, 20);
}

TEST_F(ClientTest, WorkRunsOnTheClientsThreadInOrderAndItsEndIsLast) {
  const auto here = std::this_thread::get_id();
  std::vector<std::string> order;  // of the client's thread
  std::thread::id there;
  {
    Client::Options options;
    options.finish = [&](ioci::Session& session) {
      EXPECT_EQ(std::this_thread::get_id(), there);
      EXPECT_TRUE(app().dispatch(session, "test.say", {{"word", "end"}}).ok());
      order.emplace_back("finish");
    };
    auto made = Client::open(app(), std::move(options));
    ASSERT_TRUE(made.ok());
    Client& client = **made;
    client.call("test.say", {{"word", "first"}});
    const Answer work = client.run("work", [&](ioci::Session& session) -> Result<Value> {
      there = std::this_thread::get_id();
      order.emplace_back("work");
      return app().dispatch(session, "test.say", {{"word", "within"}});
    });
    const Answer failed = client.run(
        "work", [](ioci::Session&) -> Result<Value> { throw std::runtime_error("boom"); });
    while (failed.stage() != Answer::Stage::ended) std::this_thread::sleep_for(1ms);
    EXPECT_EQ(work.result()->value(), Value("within"));
    EXPECT_EQ(failed.result()->error().code, ErrorCode::internal);
  }
  EXPECT_NE(there, here);
  EXPECT_EQ(order, (std::vector<std::string>{"work", "finish"}));
  EXPECT_EQ(said, (std::vector<std::string>{"first", "within", "end"}));
}

TEST_F(ClientTest, DeliveryStopsWhenItsTimeIsOverAndWakesAgain) {
  Host host(app());
  int told = 0;
  for (int i = 0; i < 20; ++i)
    host.client->call("test.say", {{"word", "x"}}, [&](const Result<Value>&) {
      ++told;
      std::this_thread::sleep_for(1ms);
    });
  const Answer last = host.client->call("test.say", {{"word", "x"}});
  while (last.stage() != Answer::Stage::ended) std::this_thread::sleep_for(1ms);
  EXPECT_TRUE(host.client->deliver(100us));
  EXPECT_EQ(told, 1);
  host.until([&] { return told == 20; });
}

TEST_F(ClientTest, WhatPreparesTheSessionLimitsItAndMayThrow) {
  Client::Options options;
  options.prepare = [](ioci::Session& s) { s.deny(Effect::edits); };
  auto limited = Client::open(app(), std::move(options));
  ASSERT_TRUE(limited.ok());
  const auto ended = [](const Answer& a) {
    while (!a.result()) std::this_thread::sleep_for(1ms);
    return *a.result();
  };
  EXPECT_EQ(ended((*limited)->call("material.create", steel(1))).error().code,
            ErrorCode::permission);
  Client::Options odd;
  odd.prepare = [](ioci::Session&) { throw std::runtime_error("odd"); };
  auto broken = Client::open(app(), std::move(odd));
  ASSERT_TRUE(broken.ok());
  EXPECT_EQ(ended((*broken)->call("version")).error().code, ErrorCode::internal);
}

/// For ThreadSanitizer: clients that come and go, call, cancel and drag from several threads.
TEST_F(ClientTest, ManyClientsComeAndGoWhileTheyCallCancelAndDrag) {
  constexpr int kHosts = 4, kRounds = 6;
  std::vector<std::thread> hosts;
  for (int h = 0; h < kHosts; ++h)
    hosts.emplace_back([h] {
      for (int round = 0; round < kRounds; ++round) {
        std::atomic<int> ended{0};
        Host host(app(), [](const ioci::Event&) {});
        const std::string name = "m" + std::to_string(h) + "_" + std::to_string(round);
        const auto count = [&](const Result<Value>&) { ++ended; };
        host.client->call("material.create", {{"name", name}, {"density", 1}}, count);
        const Client::Edits drag = host.client->begin_gesture("drag", count);
        const Client::Edits draft = host.client->open_draft("draft", count);
        std::vector<Answer> all;
        for (int i = 0; i < 20; ++i) {
          all.push_back(host.client->update(drag, "material.set",
                                            {{"id", name}, {"density", 1.0 + i}}, count));
          all.push_back(host.client->start("test.last", {{"seconds", 0.01}}, count));
          all.push_back(host.client->update(
              draft, "material.set", {{"id", name}, {"density", 100.0 + i}}, count, "draft"));
          if (i % 3 == 0) host.client->cancel(all[static_cast<std::size_t>(i)]);
          (void)host.client->deliver();
        }
        if (round % 2 == 0) continue;  // ends with all that in flight
        host.client->commit(drag, count);
        host.client->cancel(draft, count);
        host.until([&] { return ended == 65; });
      }
    });
  for (std::thread& t : hosts) t.join();
  EXPECT_TRUE(app().document.gestures().empty());
}

}  // namespace
}  // namespace robomosp
