// SPDX-License-Identifier: Apache-2.0
// The command server.wait, and what wakes it.
#include "remote/signal_waits.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

#include "ioci/core/commands.h"
#include "kernel/call_queue.h"
#include "kernel/executor.h"
#include "kernel/text.h"

namespace robomosp::remote {
namespace {

using namespace ioci;
using namespace std::chrono_literals;

/// How often a blocking wait asks whether the user wants it to end.
constexpr auto kSignalLook = 50ms;
constexpr double kLongestSignalWait = 86'400;  // [s]

thread_local DeferredWait* g_deferred = nullptr;

const model::Signal* find_signal(const model::World& w, const std::string& name) {
  const auto it = std::find_if(w.signals.begin(), w.signals.end(),
                               [&](const model::Signal& s) { return s.name == name; });
  return it == w.signals.end() ? nullptr : &*it;
}

std::string wanted(const SignalWish& w) {
  const char* how = w.is == SignalWish::Is::equal      ? ""
                    : w.is == SignalWish::Is::at_least ? "at least "
                                                       : "at most ";
  return how + text::print_rounded(w.value);
}

std::string signal_in(const SignalWish& w) {
  return "signal " + text::quote(w.signal) + " of world " + text::quote(w.world_name);
}

Error gone(const SignalWish& w) {
  return error(ErrorCode::cancelled,
               "no client " + text::quote(w.client) + " has been connected for " +
                   text::print_rounded(w.absent) + " s, and " + signal_in(w) + " is not " +
                   wanted(w),
               "Its earlier changes remain; wait again when it has reconnected.");
}

}  // namespace

struct SignalWaits::State : std::enable_shared_from_this<State> {
  using Clock = std::chrono::steady_clock;
  explicit State(Application& a) : app(&a) {}
  struct Waiting {
    SignalWish wish;
    Done done;
    Away away;
    std::optional<Clock::time_point> away_since{};
  };
  using Over = std::vector<std::pair<Done, Result<Value>>>;

  [[nodiscard]] static std::optional<Result<Value>> look(const document::Snapshot& now,
                                                         const SignalWish& wish) {
    const auto* world = now.get(wish.world);
    if (!world)
      return error(ErrorCode::stale_handle,
                   "the world " + text::quote(wish.world_name) + " no longer exists");
    const model::Signal* s = find_signal(*world, wish.signal);
    if (!s)
      return error(ErrorCode::unknown_name, "the world " + text::quote(wish.world_name) +
                                                " has no signal " + text::quote(wish.signal) +
                                                " any more");
    const bool is_so = wish.is == SignalWish::Is::equal      ? s->initial == wish.value
                       : wish.is == SignalWish::Is::at_least ? s->initial >= wish.value
                                                             : s->initial <= wish.value;
    if (!is_so) return std::nullopt;
    return Result<Value>(Value(s->initial));
  }
  void erase(std::map<std::uint64_t, Waiting>::iterator it) {  // with mutex held
    const auto of = by_world.find(it->second.wish.world.number);
    of->second.erase(it->first);
    if (of->second.empty()) by_world.erase(of);
    all.erase(it);
    if (!all.empty() || subscription == 0 || !app) return;
    app->events.unsubscribe(subscription);
    subscription = 0;
  }
  void look_at_changes() {
    Over over;
    {
      const std::lock_guard lock(mutex);
      if (!app || subscription == 0) return;
      std::set<std::uint64_t> worlds;
      for (;;) {
        const auto events = app->events.take(subscription);
        if (!events.ok() || events->empty()) break;
        for (const Event& e : *events)
          if (e.change)
            for (const document::RecordChange& r : e.change->records) worlds.insert(r.id.number);
      }
      const document::SnapshotPtr now = app->document.now();
      for (const std::uint64_t world : worlds) {
        const auto of = by_world.find(world);
        if (of == by_world.end()) continue;
        const std::vector<std::uint64_t> waits(of->second.begin(), of->second.end());
        for (const std::uint64_t number : waits) {
          const auto it = all.find(number);
          if (auto outcome = look(*now, it->second.wish)) {
            over.emplace_back(std::move(it->second.done), std::move(*outcome));
            erase(it);
          }
        }
      }
    }
    for (auto& [done, outcome] : over) done(std::move(outcome));
  }

  std::mutex mutex;
  Application* app;                      // guarded by mutex; null when it is gone
  std::map<std::uint64_t, Waiting> all;  // guarded by mutex
  std::map<std::uint64_t, std::set<std::uint64_t>> by_world;  // guarded by mutex
  std::map<std::string, std::size_t> clients;  // guarded by mutex; how many are connected
  std::uint64_t next = 1;                      // guarded by mutex
  std::uint64_t subscription = 0;              // guarded by mutex; there while somebody waits
};

namespace {

struct Holder {
  explicit Holder(Application& app) : waits(std::make_shared<SignalWaits>(app)) {}
  ~Holder() { waits->close(); }
  Holder(const Holder&) = delete;
  Holder& operator=(const Holder&) = delete;
  const std::shared_ptr<SignalWaits> waits;
};

Error ended() { return error(ErrorCode::cancelled, "the program ends"); }

}  // namespace

std::shared_ptr<SignalWaits> SignalWaits::of(Application& app) { return app.kept<Holder>().waits; }

SignalWaits::SignalWaits(Application& app) : state_(std::make_shared<State>(app)) {}

SignalWaits::~SignalWaits() { close(); }

void SignalWaits::close() {
  const std::lock_guard lock(state_->mutex);
  if (!state_->app) return;
  if (state_->subscription) state_->app->events.unsubscribe(state_->subscription);
  state_->subscription = 0;
  state_->app = nullptr;
}

std::optional<Result<Value>> SignalWaits::look(const SignalWish& wish) const {
  const std::lock_guard lock(state_->mutex);
  if (!state_->app) return ended();
  return State::look(*state_->app->document.now(), wish);
}

std::uint64_t SignalWaits::begin(SignalWish wish, Done done, Away away) {
  std::unique_lock lock(state_->mutex);
  const std::uint64_t number = state_->next++;
  if (!state_->app) {
    lock.unlock();
    done(ended());
    return number;
  }
  if (state_->subscription == 0) {
    EventFilter filter;
    filter.topics = 1U << static_cast<unsigned>(Topic::change);
    filter.kinds = 1U << static_cast<unsigned>(Kind::world);
    state_->subscription = state_->app->events.subscribe(filter, [weak = state_->weak_from_this()] {
      Executor::of_process().run([weak] {
        if (const auto state = weak.lock()) state->look_at_changes();
      });
    });
  }
  state_->by_world[wish.world.number].insert(number);
  State::Waiting waiting{std::move(wish), std::move(done), std::move(away)};
  const auto it = state_->all.emplace(number, std::move(waiting)).first;
  // It may have come true before anybody looked at changes.
  const SignalWish& asked = it->second.wish;
  auto outcome = State::look(*state_->app->document.now(), asked);
  if (!outcome) {
    if (asked.client.empty() || state_->clients.contains(asked.client)) return number;
    it->second.away_since = State::Clock::now();
    const Away absent = it->second.away;
    lock.unlock();
    absent(number);
    return number;
  }
  const Done told = std::move(it->second.done);
  state_->erase(it);
  lock.unlock();
  told(std::move(*outcome));
  return number;
}

bool SignalWaits::end(std::uint64_t wait) {
  Done unused;  // its captures go without the lock
  const std::lock_guard lock(state_->mutex);
  const auto it = state_->all.find(wait);
  if (it == state_->all.end()) return false;
  unused = std::move(it->second.done);
  state_->erase(it);
  return true;
}

void SignalWaits::check_absent(std::uint64_t wait) {
  Done told;
  std::optional<Error> why;
  {
    const std::lock_guard lock(state_->mutex);
    const auto it = state_->all.find(wait);
    if (it == state_->all.end() || !it->second.away_since) return;
    const std::chrono::duration<double> away = State::Clock::now() - *it->second.away_since;
    if (away.count() < it->second.wish.absent) return;
    told = std::move(it->second.done);
    why = gone(it->second.wish);
    state_->erase(it);
  }
  told(std::move(*why));
}

void SignalWaits::client_came(const std::string& name) {
  if (name.empty()) return;
  const std::lock_guard lock(state_->mutex);
  if (++state_->clients[name] > 1) return;
  for (auto& [number, w] : state_->all)
    if (w.wish.client == name) w.away_since.reset();
}

void SignalWaits::client_gone(const std::string& name) {
  std::vector<std::pair<Away, std::uint64_t>> told;
  {
    const std::lock_guard lock(state_->mutex);
    const auto of = state_->clients.find(name);
    if (of == state_->clients.end() || --of->second > 0) return;
    state_->clients.erase(of);
    for (auto& [number, w] : state_->all) {
      if (w.wish.client != name) continue;
      w.away_since = State::Clock::now();
      told.emplace_back(w.away, number);
    }
  }
  for (const auto& [away, number] : told) away(number);
}

Error SignalWaits::late(const SignalWish& wish, double seconds) const {
  const std::lock_guard lock(state_->mutex);
  if (!state_->app) return ended();
  const auto now = state_->app->document.now();
  const auto* world = now->get(wish.world);
  const model::Signal* s = world ? find_signal(*world, wish.signal) : nullptr;
  return error(ErrorCode::cancelled,
               signal_in(wish) + " did not become " + wanted(wish) + " within " +
                   text::print_rounded(seconds) + " s" +
                   (s ? "; it is " + text::print_rounded(s->initial) : std::string()),
               "Check that the program that sets it is still running.");
}

DeferredWait::DeferredWait() : before_(std::exchange(g_deferred, this)) {}
DeferredWait::~DeferredWait() { g_deferred = before_; }
DeferredWait* DeferredWait::of_this_thread() { return g_deferred; }

namespace {

/// The world that is named, or the only one with such a signal.
Result<WorldId> world_of(CommandContext& ctx, const Map& args, const std::string& signal) {
  if (has(args, "world")) return typed<model::World>(args, "world");
  std::vector<WorldId> found;
  for (const auto& id : ctx.snapshot().list(Kind::world))
    if (const auto* w = ctx.snapshot().get(WorldId{id.number}); w && find_signal(*w, signal))
      found.push_back(WorldId{id.number});
  if (found.size() == 1) return found.front();
  return error(
      ErrorCode::invalid_argument,
      found.empty() ? "no world has a signal " + text::quote(signal)
                    : std::to_string(found.size()) + " worlds have a signal " + text::quote(signal),
      found.empty() ? "Add one with world.add_signal." : "Select one with world.", "world");
}

Result<Value> wait(CommandContext& ctx, const Map& args) {
  SignalWish wish;
  wish.signal = text_of(args, "signal");
  RMP_TRY_ASSIGN(wish.world, world_of(ctx, args, wish.signal));
  const auto* world = ctx.snapshot().get(wish.world);
  wish.world_name = ctx.snapshot().find(AnyId(wish.world))->name;
  const model::Signal* s = find_signal(*world, wish.signal);
  if (!s) {
    std::vector<std::string> known;
    for (const auto& one : world->signals) known.push_back(one.name);
    return unknown_name("signal", wish.signal, known).in("signal");
  }
  if (has(args, "value") + has(args, "at_least") + has(args, "at_most") > 1)
    return error(ErrorCode::invalid_argument, "give one of value, at_least and at_most", "",
                 "value");
  if (has(args, "value")) wish.value = real(args, "value");
  if (has(args, "at_least"))
    wish.is = SignalWish::Is::at_least, wish.value = real(args, "at_least");
  if (has(args, "at_most")) wish.is = SignalWish::Is::at_most, wish.value = real(args, "at_most");
  wish.client = text_of(args, "client");
  wish.absent = real(args, "absent");
  const double seconds = real(args, "timeout");
  const auto shared_waits = SignalWaits::of(ctx.app);
  SignalWaits& waits = *shared_waits;
  if (auto now = waits.look(wish)) return std::move(*now);
  if (ctx.is_in_group())
    return error(ErrorCode::conflict,
                 "a wait for a signal cannot be part of a group of edits, since others see the "
                 "group only when it ends",
                 "Wait before or after the group.");
  DeferredWait* deferred = DeferredWait::of_this_thread();
  if (!deferred && ctx.session.kind() == SessionKind::connection)
    return error(
        ErrorCode::unsupported,
        "within a batch, a job or a script of a client, a wait for a signal would block others",
        "Send server.wait as a separate request.");
  if (deferred && !deferred->may_block) {
    deferred->seconds = seconds;
    deferred->wish = std::move(wish);
    return Value();
  }
  struct Shared {
    std::mutex mutex;
    std::condition_variable changed;
    std::optional<Result<Value>> outcome;
  };
  const auto shared = std::make_shared<Shared>();
  const auto done = [shared](Result<Value> outcome) {
    const std::lock_guard lock(shared->mutex);
    shared->outcome = std::move(outcome);
    shared->changed.notify_all();
  };
  const std::uint64_t number = waits.begin(wish, done, [](std::uint64_t) {});  // it looks itself
  const auto end =
      std::chrono::steady_clock::now() +
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(seconds));
  std::unique_lock lock(shared->mutex);
  const auto is_done = [&] { return shared->outcome.has_value(); };
  for (;;) {
    const auto left = end - std::chrono::steady_clock::now();
    if (wait_serving(lock, shared->changed,
                     std::clamp<std::chrono::nanoseconds>(left, 0ns, kSignalLook), is_done))
      return std::move(*shared->outcome);
    const bool is_late = std::chrono::steady_clock::now() >= end;
    lock.unlock();
    if (!is_late && !ctx.progress.cancelled()) {
      waits.check_absent(number);
      lock.lock();
      continue;
    }
    if (!waits.end(number)) {  // it has come just now
      lock.lock();
      shared->changed.wait(lock, is_done);
      return std::move(*shared->outcome);
    }
    if (is_late) return waits.late(wish, seconds);
    return error(ErrorCode::cancelled, "the wait for " + signal_in(wish) + " was interrupted");
  }
}

}  // namespace

RMP_COMMANDS(signal_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "server.wait",
       .classic = "",
       .summary = "Waits until a signal of a world has a value.",
       .details =
           "It synchronises programs or consoles: one sets a signal with world.set_signal, the "
           "other waits for it. A client of the server gets the answer when the condition becomes "
           "true, and can send other requests meanwhile; rpc.cancel ends the wait; the limit "
           "`waits` sets how many can wait at a time. Clients send it as a separate request: in "
           "batches, jobs and scripts it is refused, unless the condition is already true. A value "
           "that exists only briefly may be missed, so let the program that waits reset it.",
       .example = "local cell = world.create{name = \"cell\"}\n"
                  "cell:add_signal{name = \"ready\"}\ncell:set_signal(\"ready\", 1)\n"
                  "assert(server.wait{signal = \"ready\"} == 1)\n"
                  "assert(not pcall(server.wait, {signal = \"ready\", value = 0, timeout = 0}))",
       .params = {needed("signal", "string", "", "Its name."),
                  optional("value", "real", "", "Value to wait for, in SI; 1 if omitted."),
                  optional("at_least", "real", "", "Instead of value: a lower bound."),
                  optional("at_most", "real", "", "Instead of value: an upper bound."),
                  optional("world", "ref:world", "",
                           "By default the only world with such a signal."),
                  between(defaulted("timeout", "real", "s", 60.0,
                                    "After this time it is an error; 0 = check only."),
                          0, kLongestSignalWait),
                  optional("client", "string", "",
                           "Client that sets the signal: give up if no client of this name, or "
                           "with a token of this name, is connected."),
                  between(defaulted("absent", "real", "s", 5.0,
                                    "Time for which it may be absent, to start or to reconnect."),
                          0, kLongestSignalWait)},
       .returns = {"real", "", "The value of the signal, in SI.", {}},
       .effect = Effect::reads,
       .run = wait});
  return all;
}

}  // namespace robomosp::remote
