// SPDX-License-Identifier: Apache-2.0
// The program under load from many threads, without plugins, so that it is quickly built for
// ThreadSanitizer: sessions that start, cancel and leave jobs while others edit and undo and
// subscribers come and go; solvers of scripts that are asked by jobs while their script waits or
// ends; a connection with many waiting requests.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "ioci/core/commands.h"
#include "lua/lua_state.h"
#include "remote/json.h"
#include "remote/rpc.h"
#include "spatial/parallel.h"
#include "support/seed.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// Adds one to a material, after some work on all cores and another command as a part of it.
Result<Value> add_one(ioci::CommandContext& ctx, const Map& args) {
  std::atomic<std::size_t> done{0};
  spatial::in_parallel(64, 1, 4, [&](std::size_t first, std::size_t last, std::size_t) {
    for (std::size_t i = first; i < last && !ctx.progress.cancelled(); ++i) {
      std::this_thread::sleep_for(50us);
      ctx.progress.report(static_cast<double>(++done) / 64, "adding");
    }
  });
  if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "stopped");
  RMP_TRY(ctx.dispatch("material.list", {}));
  RMP_TRY(ioci::change<model::Material>(ctx, ioci::ref(args, "id"), [](model::Material& m) {
    m.density += 1;
    return Result<void>();
  }));
  return Value(1);
}
/// The same twice, each as a command of its own within this one.
Result<Value> add_two(ioci::CommandContext& ctx, const Map& args) {
  for (int i = 0; i < 2; ++i) RMP_TRY(ctx.dispatch("work.add_one", args));
  return Value(2);
}

class Threads : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    journals() = fs::temp_directory_path() / ("robomosp-threads-" + std::to_string(::getpid()));
    ioci::ApplicationOptions options;
    options.library = {fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"};
    options.plugins = false;
    options.recovery = journals();
    options.recovery_interval = 5ms;
    auto made = ioci::Application::create(std::move(options));
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    holder() = std::move(*made);
    std::vector<ioci::CommandSpec> own;
    for (const auto& [name, run] :
         {std::pair{"work.add_one", &add_one}, std::pair{"work.add_two", &add_two}})
      own.push_back({.name = name,
                     .classic = "",
                     .summary = "Adds to a density.",
                     .details = "",
                     .example = "work",
                     .params = {ioci::self("material")},
                     .returns = {"int", "", "", {}},
                     .effect = Effect::edits,
                     .run = run});
    app().commands.add(std::move(own));
  }
  static void TearDownTestSuite() {
    holder().reset();
    fs::remove_all(journals());
  }
  static ioci::Application& app() { return *holder(); }

 private:
  static std::unique_ptr<ioci::Application>& holder() {
    static std::unique_ptr<ioci::Application> one;
    return one;
  }
  static fs::path& journals() {
    static fs::path folder;
    return folder;
  }
};

/// What commands of this file may answer when others are at work.
bool is_expected(ErrorCode code) {
  return code == ErrorCode::cancelled || code == ErrorCode::conflict ||
         code == ErrorCode::unknown_name || code == ErrorCode::stale_handle;
}

/// Takes its events in the call that says that there are some, and sees whether any is missing.
class Follower : public std::enable_shared_from_this<Follower> {
 public:
  explicit Follower(ioci::Events& events) : events_(events) {}
  void begin(std::size_t most) {
    ioci::EventFilter filter;
    filter.most = most;
    token_ = events_.subscribe(filter, [self = weak_from_this()] {
      if (const auto follower = self.lock()) follower->take();
    });
  }
  void end() { events_.unsubscribe(token_); }
  void take() {
    const std::lock_guard lock(mutex_);
    if (token_ == 0) return;
    const auto all = events_.take(token_);
    if (!all.ok()) return;  // it ended meanwhile
    for (const ioci::Event& e : *all) {
      ++count_;
      if (!e.change) continue;
      const ioci::Change& c = *e.change;
      // The end of a gesture that changes nothing any more gives the revision before.
      const bool repeats = c.kind == document::CommitKind::kept ||
                           c.kind == document::CommitKind::cancelled || c.commits > 1;
      if (last_ != 0 && c.first_revision != last_ + 1 && !(repeats && c.first_revision == last_))
        ADD_FAILURE() << "revision " << c.first_revision << " after " << last_;
      EXPECT_GE(c.commits, c.revision - c.first_revision + 1);
      last_ = e.change->revision;
    }
  }
  std::size_t count() {
    const std::lock_guard lock(mutex_);
    return count_;
  }

 private:
  ioci::Events& events_;
  std::atomic<std::uint64_t> token_{0};
  std::mutex mutex_;
  std::uint64_t last_ = 0;  // guarded by mutex_
  std::size_t count_ = 0;   // guarded by mutex_
};

TEST_F(Threads, ThreeSessionsStartAndCancelJobsWhileAnotherEditsAndSubscribersComeAndGo) {
  constexpr int kJobs = 200, kSubscribers = 100, kStarters = 3;
  const unsigned seed = test::seed();
  std::array<MaterialId, kStarters> counters;
  {
    ioci::Session own("first");
    for (std::size_t i = 0; i < counters.size(); ++i) {
      const auto made = app().dispatch(own, "material.create",
                                       {{"name", "c" + std::to_string(i)}, {"density", 1000}});
      ASSERT_TRUE(made.ok()) << made.error().sentence();
      counters[i] = MaterialId{made->as_handle()->number};
    }
  }
  struct Started {
    std::uint64_t job;
    std::size_t counter;
  };
  std::mutex mutex;
  std::vector<Started> started;  // guarded by mutex
  std::array<std::atomic<int>, kStarters> added{};
  std::atomic<int> left{kJobs}, edits{0}, unexpected{0}, subscribed{0};
  std::atomic<std::size_t> heard{0};
  std::atomic<bool> is_over{false};
  const auto look = [&](const Result<Value>& r) {
    if (r.ok() || is_expected(r.error().code)) return r.ok();
    ++unexpected;
    ADD_FAILURE() << r.error().sentence();
    return false;
  };

  const auto starter = [&](unsigned number) {
    std::mt19937 random(seed + number);
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
    while (left > 0) {
      // A session starts some, ends and so ends those that still run.
      ioci::Session own("starter " + std::to_string(number));
      std::vector<Handle> jobs;
      for (std::size_t n = 1 + below(40); n > 0 && left.fetch_sub(1) > 0; --n) {
        const std::size_t counter = below(kStarters);
        const Map args{{"id", "c" + std::to_string(counter)}};
        auto job = app().dispatch_async(own, below(3) == 0 ? "work.add_two" : "work.add_one", args);
        if (!job.ok()) {
          ADD_FAILURE() << job.error().sentence();
          continue;
        }
        jobs.push_back(*job);
        {
          const std::lock_guard lock(mutex);
          started.push_back({job->number, counter});
        }
        const Handle& one = jobs[below(jobs.size())];
        switch (below(7)) {
          case 0: look(app().dispatch(own, "job.cancel", {{"id", one}})); break;
          case 1: app().jobs.cancel(1 + below(job->number)); break;
          case 2: look(app().dispatch(own, "job.progress", {{"id", one}})); break;
          case 3: look(app().dispatch(own, "job.wait", {{"id", one}})); break;
          case 4: look(app().dispatch(own, "job.list", {})); break;
          case 5:
            if (look(app().dispatch(own, "work.add_one", args))) ++added[counter];
            break;
          default: std::this_thread::sleep_for(std::chrono::microseconds(below(3000)));
        }
      }
      if (below(2) == 0) continue;
      for (const Handle& job : jobs) look(app().dispatch(own, "job.wait", {{"id", job}}));
    }
  };
  const auto editor = [&] {
    std::mt19937 random(seed + 100);
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
    ioci::Session own("editor");
    while (!is_over) {
      const std::string name = "e" + std::to_string(below(8));
      const Map set{{"id", name}, {"density", 1.0 + static_cast<double>(below(5000))}};
      bool has_edited = false;
      switch (below(6)) {
        case 0:
          has_edited =
              look(app().dispatch(own, "material.create", {{"name", name}, {"density", 1000}}));
          break;
        case 1: has_edited = look(app().dispatch(own, "material.set", set)); break;
        case 2: has_edited = look(app().dispatch(own, "document.undo", {})); break;
        case 3: has_edited = look(app().dispatch(own, "document.redo", {})); break;
        case 4: has_edited = look(app().dispatch(own, "material.remove", {{"id", name}})); break;
        default: {
          const auto gesture = app().dispatch(own, "gesture.begin", {{"label", "drag"}});
          if (!look(gesture)) break;
          const Map update{
              {"gesture", *gesture}, {"command", "material.set"}, {"arguments", Value(set)}};
          for (std::size_t i = below(4); i > 0; --i)
            look(app().dispatch(own, "gesture.update", update));
          has_edited = look(app().dispatch(own, below(2) == 0 ? "gesture.commit" : "gesture.cancel",
                                           {{"gesture", *gesture}}));
        }
      }
      edits += has_edited ? 1 : 0;
      // What it adds and removes refuses the jobs that list records meanwhile: not all of them.
      std::this_thread::sleep_for(std::chrono::microseconds(below(4000)));
    }
  };
  const auto subscribers = [&](unsigned number) {
    std::mt19937 random(seed + 200 + number);
    while (!is_over && subscribed < kSubscribers) {
      ioci::Session own("subscriber");
      // One that takes events where it is notified of them, and one that its session leaves behind.
      const auto follower = std::make_shared<Follower>(app().events);
      follower->begin(2 + random() % 30);
      auto token = app().dispatch(own, "event.subscribe", {{"most", 10}});
      ASSERT_TRUE(token.ok()) << token.error().sentence();
      subscribed += 2;
      for (int i = 0; i < 5; ++i) {
        std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
        look(app().dispatch(own, "event.take", {{"subscription", *token}}));
      }
      follower->end();
      heard += follower->count();
    }
  };

  {
    std::vector<std::jthread> editing;
    editing.emplace_back(editor);
    editing.emplace_back(subscribers, 0U);
    editing.emplace_back(subscribers, 1U);
    {
      std::vector<std::jthread> starting;
      for (unsigned i = 0; i < kStarters; ++i) starting.emplace_back(starter, i);
    }
    while (subscribed < kSubscribers || edits < 50) std::this_thread::sleep_for(1ms);
    is_over = true;
  }
  std::map<JobState, int> ended;
  for (const Started& s : started) {
    const auto status = app().jobs.status(s.job);
    ASSERT_TRUE(status.ok()) << status.error().sentence();
    ++ended[status->state];
    const auto result = app().jobs.wait(s.job);
    if (look(result)) added[s.counter] += static_cast<int>(*result->as_int());
  }
  ASSERT_EQ(started.size(), static_cast<std::size_t>(kJobs));
  EXPECT_EQ(ended[JobState::waiting] + ended[JobState::running], 0) << "their sessions are over";
  EXPECT_GT(ended[JobState::done], 0);
  EXPECT_GT(ended[JobState::cancelled], 0);
  for (std::size_t i = 0; i < counters.size(); ++i)
    EXPECT_EQ(app().document.now()->get(counters[i])->density, 1000 + added[i])
        << "what is done stands, what is cancelled or refused left nothing";
  EXPECT_GT(heard, 0U);
  EXPECT_EQ(unexpected, 0);
  // Those that were left behind end with the next that comes.
  ioci::Session last("last");
  const auto token = app().dispatch(last, "event.subscribe", {});
  ASSERT_TRUE(token.ok());
  ASSERT_TRUE(app().dispatch(last, "event.unsubscribe", {{"subscription", *token}}).ok());
  EXPECT_FALSE(app().events.has_subscribers());
  EXPECT_EQ(app().lock.stats().calls_within, 0U);
  for (const auto& [state, count] : ended) RecordProperty(std::string(to_string(state)), count);
}

TEST_F(Threads, SolversOfScriptsAnswerJobsWhileTheirScriptWaitsAndWhenItEnds) {
  {
    ioci::Session own("first");
    lua::LuaState state(app(), own);
    const auto made = state.eval(
        "rod = robot.create{name = 'rod', convention = 'dh', links = {{a = 1, lower = -3, "
        "upper = 3}}}");
    ASSERT_TRUE(made.ok()) << made.error().sentence();
  }
  constexpr int kScripts = 3, kRounds = 10, kEach = 6;
  std::atomic<int> solved{0}, ended{0};
  {
    std::vector<std::jthread> scripts;
    for (int s = 0; s < kScripts; ++s)
      scripts.emplace_back([&, s] {
        const std::string name = "mine" + std::to_string(s);
        for (int round = 0; round < kRounds; ++round) {
          ioci::Session own(name);
          auto state = std::make_unique<lua::LuaState>(app(), own);
          const auto begun =
              state->eval("ioci.provide('robomosp.ik/1', '" + name +
                          "', function(model, target)\n"
                          "  return {math.atan(target(2, 4), target(1, 4))} end)\n"
                          "local arm = robot.get('rod')\n"
                          "jobs = {}\n"
                          "for i = 1, " +
                          std::to_string(kEach) +
                          " do jobs[i] = start(arm.solve_ik, arm,\n"
                          "  {target = arm:fk{q = {0.1 * i}}.pose, provider = '" +
                          name +
                          "'}) end\n"
                          "for i = 1, " +
                          std::to_string(kEach / 2) +
                          " do assert(math.abs(jobs[i]:wait().q[1] - 0.1 * i) < 1e-9, i) end");
          if (!begun.ok()) ADD_FAILURE() << begun.error().sentence();
          else solved += kEach / 2;
          // The others may be about to ask: first the script ends, then its session.
          state.reset();
          ++ended;
        }
      });
  }
  EXPECT_EQ(ended, kScripts * kRounds);
  EXPECT_EQ(solved, kScripts * kRounds * kEach / 2);
  for (const JobStatus& job : app().jobs.list())
    EXPECT_TRUE(job.state != JobState::waiting && job.state != JobState::running) << job.label;
}

/// The other end of a connection, read by a thread of its own.
class ThreadPeer {
 public:
  explicit ThreadPeer(ioci::Application& app) {
    EXPECT_EQ(::pipe2(to_, O_CLOEXEC), 0);
    EXPECT_EQ(::pipe2(from_, O_CLOEXEC), 0);
    server_ = std::jthread([this, &app] {
      ioci::Session session("peer", ioci::SessionKind::connection);
      lua::LuaOptions options;
      options.print = [](std::string_view) {};
      lua::LuaState state(app, session, std::move(options));
      remote::RpcServer server(app, session, state);
      code_ = remote::serve(app, session, server, to_[0], from_[1]);
      ::close(from_[1]);
    });
    reader_ = std::jthread([this] {
      std::array<char, 4096> chunk{};
      for (ssize_t n = 0; (n = ::read(from_[0], chunk.data(), chunk.size())) > 0;)
        answers_.append(chunk.data(), static_cast<std::size_t>(n));
    });
  }
  void send(const std::string& line) const {
    const std::string text = line + "\n";
    EXPECT_EQ(::write(to_[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  /// Closes the input and returns all that was answered.
  const std::string& finish() {
    ::close(to_[1]);
    server_.join();
    reader_.join();
    ::close(to_[0]);
    ::close(from_[0]);
    return answers_;
  }
  int code() const { return code_; }

 private:
  int to_[2]{}, from_[2]{};
  int code_ = -1;
  std::string answers_;
  std::jthread server_, reader_;
};

TEST_F(Threads, AConnectionAnswersEachRequestOnceWhileJobsRunAreAwaitedAndCancelled) {
  ioci::Session own("first");
  ASSERT_TRUE(app().dispatch(own, "material.create", {{"name", "shared"}, {"density", 1000}}).ok());
  const std::uint64_t first = [&] {  // numbers of the jobs that come
    const auto job = app().dispatch_async(own, "material.list", {});
    EXPECT_TRUE(job.ok() && app().jobs.wait(job->number).ok());
    return job->number + 1;
  }();
  constexpr int kRequests = 150;
  std::mt19937 random(test::seed());
  ThreadPeer peer(app());
  int asked = 0;
  const auto ask = [&](const std::string& method, const std::string& params,
                       const std::string& more = {}) {
    peer.send(R"({"jsonrpc":"2.0","id":)" + std::to_string(++asked) + R"(,"method":")" + method +
              R"(","params":)" + params + more + "}");
  };
  std::uint64_t jobs = 0;
  for (int i = 0; i < kRequests; ++i) {
    const std::string some =
        R"({"id":"job#)" + std::to_string(first + (jobs ? random() % jobs : 0)) + R"("})";
    switch (random() % 6) {
      case 0:
      case 1:
        ask("work.add_one", R"({"id":"shared"})", R"(,"job":true,"progress":true)");
        ++jobs;
        break;
      case 2: ask("job.wait", some); break;
      case 3: ask("job.cancel", some); break;
      case 4: ask("lua.eval", R"x({"code":"return #material.list()"})x"); break;
      default: ask("rpc.cancel", R"({"request":)" + std::to_string(asked) + "}"); break;
    }
    if (random() % 8 == 0) std::this_thread::sleep_for(std::chrono::microseconds(random() % 5000));
  }
  const std::string& answers = peer.finish();
  EXPECT_EQ(peer.code(), 0);
  std::multiset<std::int64_t> answered;
  std::size_t begin = 0;
  for (std::size_t end = 0; (end = answers.find('\n', begin)) != std::string::npos;
       begin = end + 1) {
    const auto message = remote::from_json(std::string_view(answers).substr(begin, end - begin));
    ASSERT_TRUE(message.ok() && message->as_map()) << answers.substr(begin, end - begin);
    if (const Value* id = message->as_map()->find("id")) answered.insert(*id->as_int());
  }
  EXPECT_EQ(begin, answers.size()) << "the last line is whole";
  EXPECT_EQ(answered.size(), static_cast<std::size_t>(kRequests));
  for (int i = 1; i <= kRequests; ++i) EXPECT_EQ(answered.count(i), 1U) << "request " << i;
}

}  // namespace
}  // namespace robomosp
