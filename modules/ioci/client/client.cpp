// SPDX-License-Identifier: Apache-2.0
#include "ioci/client/client.h"

#include <algorithm>
#include <deque>
#include <exception>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "ioci/core/drafts.h"
#include "ioci/core/room_parts.h"
#include "ioci/core/surroundings.h"
#include "kernel/bell.h"
#include "kernel/call_queue.h"
#include "kernel/check.h"
#include "kernel/text.h"

namespace robomosp::ioci {
namespace {

using Clock = std::chrono::steady_clock;

/// Reports of how far a command is are kept no more often than this.
constexpr std::chrono::milliseconds kShowEvery{20};

Error cancelled(const std::string& what, std::string_view why) {
  return error(ErrorCode::cancelled, what + " was cancelled: " + std::string(why));
}
constexpr std::string_view kByHost = "its caller asked for that";
constexpr std::string_view kByNewer = "a newer one took its place";
constexpr std::string_view kByEnd = "the client has ended";

bool is_over(JobState s) { return s != JobState::waiting && s != JobState::running; }

}  // namespace

struct Client::EditsState {
  bool is_draft = false;
  std::string label;
  std::uint64_t id = 0;
  // Guarded by State::mutex:
  std::uint64_t number = 0;      ///< of the gesture or draft; 0 = not yet, or no more
  std::optional<Error> failure;  ///< why it could not be opened
};

struct Client::Entry {
  enum class What : std::uint8_t { command, work, open, commit, cancel };
  What what = What::command;
  std::string command{};  ///< or the label of edits, or what work is called in errors
  Work work{};            ///< of the client's thread
  Map args{};             ///< of the client's thread, once it is called
  std::shared_ptr<EditsState> in{};
  bool as_job = false;
  std::string slot{};
  /// Of the host's thread:
  Done done{};
  Shown shown{};
  const bool wants_progress = false;
  // Guarded by State::mutex:
  enum class At : std::uint8_t { queue, thread, job, end } at = At::queue;
  std::uint64_t job = 0;
  bool is_told_to_end = false, was_replaced = false;
  std::optional<Result<Value>> result{};  ///< never changed once it is there
  double fraction = 0;
  std::string doing{};
  bool has_news = false;  ///< fraction and doing are to be shown
  bool is_due = false;    ///< due in the present round, after its events
  Clock::time_point shown_at{};

  [[nodiscard]] std::string text() const {
    return what == What::command || what == What::work ? command : command_of(what, in->is_draft);
  }
  /// The command that opens or ends edits.
  [[nodiscard]] static const char* command_of(What what, bool is_draft) {
    switch (what) {
      case What::open: return is_draft ? "draft.open" : "gesture.begin";
      case What::commit: return is_draft ? "draft.accept" : "gesture.commit";
      case What::cancel: return is_draft ? "draft.discard" : "gesture.cancel";
      case What::command:
      case What::work: break;
    }
    return "";
  }
};

/// What the host, the client's thread and the jobs' listener share. It may outlive the client, in
/// answers and in a listener that is just called.
struct Client::State : std::enable_shared_from_this<Client::State> {
  State(Application& a, Options o) : app(a), options(std::move(o)) {}
  using EntryPtr = std::shared_ptr<Entry>;

  Application& app;
  const Options options;
  std::uint64_t events = 0, listener = 0;  ///< subscriptions
  std::thread thread;
  std::optional<Error> unprepared;  ///< why nothing may be called; the client's thread's

  // Of the host's thread: events of which the first ones have been delivered.
  std::shared_ptr<const std::vector<Event>> batch;
  std::size_t next_event = 0;

  /// Shared by those who wake, so that the host never waits for another one who does just that: on
  /// a busy machine the host may get the processor of the thread that wakes it.
  std::shared_mutex wake_mutex;
  bool may_wake = true;  // guarded by wake_mutex

  mutable std::mutex mutex;  ///< for a moment only
  Bell bell;                 ///< for the client's thread
  // Guarded by mutex:
  std::deque<EntryPtr> queue;
  EntryPtr running;                                ///< on the client's thread
  std::map<std::uint64_t, EntryPtr> jobs;          ///< by number
  std::deque<EntryPtr> told;                       ///< that have ended, or news of them
  std::vector<std::shared_ptr<EditsState>> open;   ///< edits that may have to be taken back
  std::vector<std::shared_ptr<const void>> trash;  ///< for the client's thread to destroy
  Session* session = nullptr;                      ///< while it is there
  std::uint64_t next_edits = 1;
  bool is_woken = false;    ///< since deliver() was called last
  bool has_events = false;  ///< some may wait
  bool is_ending = false, is_closed = false;
  bool is_host_gone = false;  ///< the client is destroyed

  // --- any thread ---

  /// Whether the host is to be woken; with mutex held.
  [[nodiscard]] bool needs_wake() { return !std::exchange(is_woken, true); }
  void wake() {
    const std::shared_lock lock(wake_mutex);
    if (may_wake && options.wake) options.wake();
  }
  /// With mutex held; true = wake() is to be called without it.
  [[nodiscard]] bool end(const EntryPtr& e, Result<Value> result) {
    if (e->at == Entry::At::end) return false;
    e->at = Entry::At::end;
    if (e->what == Entry::What::open && !result.ok()) e->in->failure = result.error();
    e->result = std::move(result);
    if (std::exchange(e->has_news, false)) std::erase(told, e);
    e->is_due = false;
    told.push_back(e);
    return needs_wake();
  }
  /// The same; of how far it is.
  [[nodiscard]] bool show(const EntryPtr& e, double fraction, std::string_view doing) {
    if (!e->wants_progress || e->at == Entry::At::end) return false;
    const auto now = Clock::now();
    if (e->shown_at != Clock::time_point{} && now - e->shown_at < kShowEvery) return false;
    e->shown_at = now;
    e->fraction = fraction >= 1 ? 1 : fraction > 0 ? fraction : 0;
    e->doing = doing;
    if (!std::exchange(e->has_news, true)) told.push_back(e);
    return needs_wake();
  }
  /// With mutex held.
  [[nodiscard]] bool cancel(const EntryPtr& e, std::string_view why) {
    switch (e->at) {
      case Entry::At::queue: std::erase(queue, e); return end(e, cancelled(e->text(), why));
      case Entry::At::thread:
        e->is_told_to_end = true;
        if (session && running == e) session->interrupt();
        return false;
      case Entry::At::job:
        e->is_told_to_end = true;
        if (app.jobs.ask_to_end(e->job) != Jobs::Asked::will_not_begin) return false;
        jobs.erase(e->job);
        return end(e, cancelled(e->text(), why));
      case Entry::At::end: return false;
    }
    return false;
  }
  /// Those that `which` names of all that wait or run; with mutex held.
  template <class Which>
  [[nodiscard]] bool cancel_all(std::string_view why, const Which& which) {
    bool wakes = false;
    std::vector<EntryPtr> all(queue.begin(), queue.end());
    if (running) all.push_back(running);
    for (const auto& [number, e] : jobs) all.push_back(e);
    for (const EntryPtr& e : all)
      if (which(*e)) wakes = cancel(e, why) || wakes;
    return wakes;
  }
  [[nodiscard]] bool cancel_all(std::string_view why) {
    return cancel_all(why, [](const Entry&) { return true; });
  }
  void job_changed(const JobStatus& s) {
    EntryPtr entry;
    bool wakes = false;
    {
      const std::lock_guard lock(mutex);
      const auto at = jobs.find(s.id);
      if (at == jobs.end()) return;
      entry = at->second;
      // A job that begins has reported nothing yet.
      if (!is_over(s.state) && (s.fraction > 0 || !s.what.empty()))
        wakes = show(entry, s.fraction, s.what);
    }
    if (is_over(s.state)) end_job(entry, s.id);
    else if (wakes) wake();
  }
  /// Of a job that has ended; the first who sees that does it.
  void end_job(const EntryPtr& entry, std::uint64_t job) {
    auto result = app.jobs.wait(job);
    bool wakes = false;
    {
      const std::lock_guard lock(mutex);
      jobs.erase(job);
      wakes = end(entry, std::move(result));
    }
    if (wakes) wake();
  }

  // --- the client's thread ---

  void work() {
    {
      Session own(options.name, options.kind);
      own.show_progress = [this](double fraction, std::string_view doing) {
        bool wakes = false;
        {
          const std::lock_guard lock(mutex);
          wakes = running && show(running, fraction, doing);
        }
        if (wakes) wake();
      };
      prepare(own);
      std::unique_lock lock(mutex);
      session = &own;
      for (;;) {
        bell.wait(lock, [this] { return is_ending || !queue.empty() || !trash.empty(); });
        if (!trash.empty()) {
          auto old = std::exchange(trash, {});
          lock.unlock();
          old.clear();
          lock.lock();
          continue;
        }
        if (queue.empty()) break;  // it ends
        run_next(own, lock);
        // Other threads wait for solvers of the session's scripts; those behind many calls would
        // wait for all of them.
        lock.unlock();
        own.clear_interrupt();  // it was meant for the call before
        if (const auto calls = CallQueue::of_this_thread()) calls->serve();
        lock.lock();
      }
      session = nullptr;
      auto left = std::exchange(open, {});
      lock.unlock();
      own.clear_interrupt();
      for (const auto& edits : left)
        if (edits->number != 0) (void)end_edits(own, Entry::What::cancel, *edits).ok();
      finish(own);
    }  // the session ends, and with it its jobs
    // Their listener may still be about to tell of the last ones.
    std::map<std::uint64_t, EntryPtr> ended;
    {
      const std::lock_guard lock(mutex);
      ended = jobs;
    }
    for (const auto& [job, e] : ended) end_job(e, job);
    bool wakes = false;
    {
      const std::lock_guard lock(mutex);
      is_closed = true;
      wakes = needs_wake();
    }
    if (wakes) wake();
  }
  void prepare(Session& own) {
    if (!options.prepare) return;
    try {
      options.prepare(own);
    } catch (const std::exception& e) {
      unprepared =
          error(ErrorCode::internal, "preparing the session threw: " + std::string(e.what()));
    } catch (...) {
      unprepared = error(ErrorCode::internal, "preparing the session threw an unknown exception");
    }
  }
  /// What ends with the session has no caller that an exception could reach.
  void finish(Session& own) {
    if (!options.finish) return;
    try {
      options.finish(own);
    } catch (const std::exception& e) {
      app.messages.post(Severity::error, "client_end",
                        "ending the session " + text::quote(options.name) + " threw: " + e.what(),
                        "client");
    } catch (...) {
      app.messages.post(
          Severity::error, "client_end",
          "ending the session " + text::quote(options.name) + " threw an unknown exception",
          "client");
    }
  }
  void run_next(Session& own, std::unique_lock<std::mutex>& lock) {
    const EntryPtr entry = queue.front();
    queue.pop_front();
    entry->at = Entry::At::thread;
    running = entry;
    own.clear_interrupt();
    lock.unlock();
    std::optional<Result<Value>> result;
    try {
      result = call(own, entry);
    } catch (const std::exception& e) {
      result = error(ErrorCode::internal, entry->text() + " threw: " + e.what());
    } catch (...) {
      result = error(ErrorCode::internal, entry->text() + " threw an unknown exception");
    }
    lock.lock();
    running.reset();
    if (result && end(entry, std::move(*result))) {
      lock.unlock();
      wake();
      lock.lock();
    }
  }
  /// nullopt = it goes on as a job.
  std::optional<Result<Value>> call(Session& own, const EntryPtr& entry) {
    if (unprepared) return Result<Value>(*unprepared);
    const auto number = [&] {
      const std::lock_guard lock(mutex);
      return entry->in ? entry->in->number : 0;
    }();
    if (entry->in && entry->what != Entry::What::open && number == 0)
      return Result<Value>(not_open(*entry->in).in(entry->text()));
    switch (entry->what) {
      case Entry::What::open: return open_edits(own, entry);
      case Entry::What::commit:
      case Entry::What::cancel: return close_edits(own, *entry);
      case Entry::What::work: {
        const Work work = std::exchange(entry->work, {});
        return work(own);
      }
      case Entry::What::command: break;
    }
    const bool is_draft = entry->in && entry->in->is_draft;
    const Map args = std::move(entry->args);
    if (entry->as_job) return start(own, entry, args, is_draft, number);
    if (!entry->in) return app.dispatch(own, entry->command, args);
    return is_draft ? app.dispatch_on_draft(own, number, entry->command, args)
                    : app.update_gesture(own, number, entry->command, args);
  }
  std::optional<Result<Value>> start(Session& own, const EntryPtr& entry, const Map& args,
                                     bool is_draft, std::uint64_t number) {
    Application::Joined joined;
    (is_draft ? joined.draft : joined.gesture) = number;
    auto job = app.dispatch_async(own, entry->command, args, joined);
    if (!job.ok()) return Result<Value>(std::move(job).error());
    bool wakes = false;
    {
      const std::lock_guard lock(mutex);
      entry->at = Entry::At::job;
      entry->job = job->number;
      jobs.emplace(job->number, entry);
      if (entry->is_told_to_end || is_ending) wakes = cancel(entry, is_ending ? kByEnd : kByHost);
    }
    if (wakes) wake();
    // It may have ended before the listener knew it.
    const auto status = app.jobs.status(job->number);
    if (!status.ok() || is_over(status->state)) end_job(entry, job->number);
    return std::nullopt;
  }
  [[nodiscard]] Error not_open(const EditsState& edits) {
    const std::lock_guard lock(mutex);
    if (edits.failure) return *edits.failure;
    return error(ErrorCode::conflict,
                 std::string(edits.is_draft ? "the draft " : "the gesture ") +
                     text::quote(edits.label) + " has ended",
                 "Begin another one.");
  }
  Result<Value> open_edits(Session& own, const EntryPtr& entry) {
    auto made = app.dispatch(own, entry->text(), Map{{"label", entry->command}});
    if (!made.ok()) return made;
    const std::lock_guard lock(mutex);
    entry->in->number = static_cast<std::uint64_t>(*made->as_int());
    open.push_back(entry->in);
    return made;
  }
  Result<Value> close_edits(Session& own, const Entry& entry) {
    EditsState& edits = *entry.in;
    auto done = end_edits(own, entry.what, edits);
    // A gesture that could not be ended, and a draft in conflict, are still open.
    if (!done.ok()) return done;
    const std::lock_guard lock(mutex);
    edits.number = 0;
    std::erase(open, entry.in);
    return done;
  }
  Result<Value> end_edits(Session& own, Entry::What what, const EditsState& edits) {
    const Map which{
        {edits.is_draft ? "draft" : "gesture", static_cast<std::int64_t>(edits.number)}};
    return app.dispatch(own, Entry::command_of(what, edits.is_draft), which);
  }

  // --- the host's thread ---

  /// Hands what deliver() or an answer is done with to the client's thread. [any thread]
  void throw_away(std::shared_ptr<const void> old) {
    {
      const std::lock_guard lock(mutex);
      if (!is_closed) trash.push_back(std::move(old));  // else it goes after the lock
    }
    bell.ring();
  }
  /// Whether deliver() has something to do; with mutex held.
  [[nodiscard]] bool has_news() const { return has_events || batch || !told.empty(); }
  /// Starts a round: takes all waiting events, and marks the calls that have ended or progressed so
  /// far as due after them, so that no call ends before an event that came earlier. Returns false
  /// if nothing waits or the event queue is locked; results then wait, too.
  bool begin_round() {
    {
      const std::lock_guard lock(mutex);
      if (!std::exchange(has_events, false) && told.empty()) return false;
      for (const EntryPtr& e : told) e->is_due = true;
    }
    if (!events) return true;
    auto taken = app.events.try_take(events, std::numeric_limits<std::size_t>::max());
    if (!taken) {
      const std::lock_guard lock(mutex);
      for (const EntryPtr& e : told) e->is_due = false;
      has_events = true;
      return false;
    }
    if (taken->empty()) return true;
    batch = std::make_shared<const std::vector<Event>>(std::move(*taken));
    next_event = 0;
    return true;
  }
  /// Calls the callback of the next due call: its result or its progress. Returns false if none is
  /// due.
  bool tell_next() {
    Done done;
    Shown shown;
    EntryPtr entry;
    double fraction = 0;
    std::string doing;
    bool has_ended = false;
    {
      const std::lock_guard lock(mutex);
      if (told.empty() || !told.front()->is_due) return false;
      entry = std::move(told.front());
      told.pop_front();
      entry->is_due = false;
      has_ended = entry->at == Entry::At::end;
      entry->has_news = false;
      fraction = entry->fraction;
      doing = entry->doing;
    }
    if (!has_ended) {
      shown = entry->shown;  // the callback may end the client, and with it what the entry holds
      if (shown) shown(fraction, doing);
      return true;
    }
    done = std::exchange(entry->done, {});
    shown = std::exchange(entry->shown, {});
    struct Dropped {
      State& state;
      EntryPtr& entry;
      ~Dropped() { state.throw_away(std::move(entry)); }
    } dropped{*this, entry};
    if (done) done(*entry->result);
    return true;
  }
};

// --- answers ---

/// What copies of an answer share.
struct Client::Held {
  std::shared_ptr<State> state;
  std::shared_ptr<Entry> entry;
  Held(std::shared_ptr<State> s, std::shared_ptr<Entry> e)
      : state(std::move(s)), entry(std::move(e)) {}
  ~Held() { state->throw_away(std::move(entry)); }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;
};

Client::Answer::Stage Client::Answer::stage() const {
  if (!held_) return Stage::ended;
  const std::lock_guard lock(held_->state->mutex);
  switch (held_->entry->at) {
    case Entry::At::queue: return Stage::waiting;
    case Entry::At::thread:
    case Entry::At::job: return Stage::running;
    case Entry::At::end: break;
  }
  return Stage::ended;
}

const Result<Value>* Client::Answer::result() const {
  return held_ && stage() == Stage::ended ? &*held_->entry->result : nullptr;
}

bool Client::Answer::was_replaced() const {
  if (!held_) return false;
  const std::lock_guard lock(held_->state->mutex);
  return held_->entry->was_replaced;
}

// --- the client ---

Result<std::unique_ptr<Client>> Client::open(Application& app, Options options) {
  const auto state = std::make_shared<State>(app, std::move(options));
  const std::weak_ptr<State> weak = state;
  try {
    state->thread = std::thread([state = state.get()] { state->work(); });  // joined by the client
  } catch (const std::system_error& e) {
    return error(
        ErrorCode::internal,
        "the system gives no thread for " + text::quote(state->options.name) + ": " + e.what(),
        "End something else first.");
  }
  std::unique_ptr<Client> client(new Client(state));
  state->listener = app.jobs.subscribe([weak](const JobStatus& s) {
    if (const auto held = weak.lock()) held->job_changed(s);
  });
  if (state->options.on_event) {
    app.kept<Surroundings>().prepare(state->options.events.topics);
    state->events = app.events.subscribe(state->options.events, [weak] {
      const auto held = weak.lock();
      if (!held) return;
      bool wakes = false;
      {
        const std::lock_guard lock(held->mutex);
        held->has_events = true;
        wakes = held->needs_wake();
      }
      if (wakes) held->wake();
    });
    in_rooms(&RoomPart::subscribed, app);
    app.kept<Surroundings>().begin(state->options.events.topics);
  }
  return client;
}

Client::Client(std::shared_ptr<State> state) : state_(std::move(state)) {}

Client::~Client() {
  const std::shared_ptr<State> state = state_;
  {
    const std::unique_lock lock(state->wake_mutex);
    state->may_wake = false;
  }
  close();
  state->thread.join();
  if (state->events) state->app.events.unsubscribe(state->events);
  if (state->listener) state->app.jobs.unsubscribe(state->listener);
  std::deque<State::EntryPtr> untold;
  {
    const std::lock_guard lock(state->mutex);
    state->is_host_gone = true;
    untold.swap(state->told);
  }
  // Whatever answers keep of them, callbacks end here, on the host's thread.
  for (const auto& entry : untold) {
    entry->done = {};
    entry->shown = {};
  }
}

Client::Answer Client::add(std::shared_ptr<Entry> entry) {
  Answer answer;
  answer.held_ = std::make_shared<const Held>(state_, entry);
  bool wakes = false;
  {
    const std::lock_guard lock(state_->mutex);
    if (state_->is_ending) {
      wakes = state_->end(entry, cancelled(entry->text(), kByEnd));
    } else {
      auto& queue = state_->queue;
      if (!entry->slot.empty())
        for (auto it = queue.rbegin(); it != queue.rend() && !(*it)->slot.empty(); ++it)
          if ((*it)->slot == entry->slot) {
            const State::EntryPtr old = *it;
            old->was_replaced = true;
            wakes = state_->cancel(old, kByNewer);
            break;
          }
      queue.push_back(std::move(entry));
    }
  }
  state_->bell.ring();
  if (wakes) state_->wake();
  return answer;
}

Client::Answer Client::call(std::string command, Map args, Done done) {
  return call(std::move(command), std::move(args), std::move(done), How());
}

Client::Answer Client::call(std::string command, Map args, Done done, How how) {
  const bool wants_progress = static_cast<bool>(how.progress);
  return add(std::make_shared<Entry>(Entry{.what = Entry::What::command,
                                           .command = std::move(command),
                                           .args = std::move(args),
                                           .in = std::move(how.in.state_),
                                           .as_job = how.job,
                                           .slot = std::move(how.slot),
                                           .done = std::move(done),
                                           .shown = std::move(how.progress),
                                           .wants_progress = wants_progress}));
}

Client::Answer Client::start(std::string command, Map args, Done done) {
  How how;
  how.job = true;
  return call(std::move(command), std::move(args), std::move(done), std::move(how));
}

Client::Answer Client::run(std::string what, Work work, Done done) {
  RMP_CHECK(static_cast<bool>(work), "empty work for a client");
  return add(std::make_shared<Entry>(Entry{.what = Entry::What::work,
                                           .command = std::move(what),
                                           .work = std::move(work),
                                           .done = std::move(done)}));
}

Client::Edits Client::open_edits(bool is_draft, std::string label, Done done) {
  Edits edits;
  edits.state_ = std::make_shared<EditsState>();
  edits.state_->is_draft = is_draft;
  edits.state_->label = label;
  {
    const std::lock_guard lock(state_->mutex);
    edits.state_->id = state_->next_edits++;
  }
  (void)add(std::make_shared<Entry>(Entry{.what = Entry::What::open,
                                          .command = std::move(label),
                                          .in = edits.state_,
                                          .done = std::move(done)}));
  return edits;
}

Client::Edits Client::begin_gesture(std::string label, Done done) {
  return open_edits(false, std::move(label), std::move(done));
}

Client::Edits Client::open_draft(std::string label, Done done) {
  return open_edits(true, std::move(label), std::move(done));
}

Client::Answer Client::update(const Edits& edits, std::string command, Map args, Done done,
                              std::string slot) {
  RMP_CHECK(edits.state_ != nullptr, "an update of no gesture or draft");
  How how;
  how.in = edits;
  how.slot = std::to_string(edits.state_->id) + "/" + (slot.empty() ? command : std::move(slot));
  return call(std::move(command), std::move(args), std::move(done), std::move(how));
}

Client::Answer Client::commit(const Edits& edits, Done done) {
  RMP_CHECK(edits.state_ != nullptr, "an end of no gesture or draft");
  return add(std::make_shared<Entry>(
      Entry{.what = Entry::What::commit, .in = edits.state_, .done = std::move(done)}));
}

Client::Answer Client::cancel(const Edits& edits, Done done) {
  RMP_CHECK(edits.state_ != nullptr, "an end of no gesture or draft");
  bool wakes = false;
  {
    const std::lock_guard lock(state_->mutex);
    wakes = state_->cancel_all(kByHost, [&](const Entry& e) {
      return e.in == edits.state_ && e.what == Entry::What::command;
    });
  }
  if (wakes) state_->wake();
  return add(std::make_shared<Entry>(
      Entry{.what = Entry::What::cancel, .in = edits.state_, .done = std::move(done)}));
}

Result<std::uint64_t> Client::draft_number(const Edits& edits) const {
  RMP_CHECK(edits.state_ != nullptr, "a number of no draft");
  const EditsState& e = *edits.state_;
  if (!e.is_draft)
    return error(ErrorCode::invalid_argument, text::quote(e.label) + " is a gesture, not a draft",
                 "Edits of a gesture are in the document already; open a draft to preview them.");
  {
    const std::lock_guard lock(state_->mutex);
    if (e.number != 0) return e.number;
  }
  return state_->not_open(e);
}

bool Client::cancel(const Answer& answer) {
  if (!answer.held_) return false;
  const State::EntryPtr& entry = answer.held_->entry;
  bool wakes = false;
  {
    const std::lock_guard lock(state_->mutex);
    if (entry->at == Entry::At::end) return false;
    wakes = state_->cancel(entry, kByHost);
  }
  if (wakes) state_->wake();
  return true;
}

void Client::cancel_all() {
  bool wakes = false;
  {
    const std::lock_guard lock(state_->mutex);
    wakes = state_->cancel_all(kByHost);
  }
  if (wakes) state_->wake();
}

bool Client::deliver(std::chrono::microseconds at_most) {
  const std::shared_ptr<State> state = state_;  // a callback may destroy this
  const auto end = Clock::now() + at_most;
  {
    const std::lock_guard lock(state->mutex);
    state->is_woken = false;
  }
  const auto is_over = [&] { return Clock::now() >= end; };
  const auto is_gone = [&] {
    const std::lock_guard lock(state->mutex);
    return state->is_host_gone;
  };
  /// Comes back later, also when a callback throws.
  struct Again {
    State& state;
    ~Again() {
      bool wakes = false;
      {
        const std::lock_guard lock(state.mutex);
        wakes = state.has_news() && !state.is_host_gone && state.needs_wake();
      }
      if (wakes) state.wake();
    }
  } again{*state};

  while (!is_gone()) {
    if (auto batch = state->batch) {  // kept also while a callback delivers the rest of it
      const Event& event = (*batch)[state->next_event++];
      if (state->next_event == batch->size()) state->batch = nullptr;
      state->options.on_event(event);
      if (state->batch != batch) state->throw_away(std::move(batch));
      if (is_over()) break;
      continue;
    }
    if (state->tell_next()) {
      if (is_over()) break;
    } else if (!state->begin_round()) {
      break;
    }
  }
  const std::lock_guard lock(state->mutex);
  return !state->is_host_gone && state->has_news();
}

void Client::close() {
  bool wakes = false;
  {
    const std::lock_guard lock(state_->mutex);
    state_->is_ending = true;
    wakes = state_->cancel_all(kByEnd);
  }
  state_->bell.ring();
  if (wakes) state_->wake();
}

bool Client::is_closed() const {
  const std::lock_guard lock(state_->mutex);
  return state_->is_closed;
}

std::size_t Client::waiting() const {
  const std::lock_guard lock(state_->mutex);
  return state_->queue.size();
}

bool Client::has_news() const {
  const std::lock_guard lock(state_->mutex);
  return state_->has_news();
}

bool Client::is_idle() const {
  const State& s = *state_;
  const auto waits_for_host = [&s](const Entry& e) {
    return s.options.waits_for_host && e.what == Entry::What::command &&
           s.options.waits_for_host(e.command);
  };
  const std::lock_guard lock(s.mutex);
  if (s.has_news()) return false;
  const bool is_at_work = s.running ? !waits_for_host(*s.running) : !s.queue.empty();
  return !is_at_work && std::all_of(s.jobs.begin(), s.jobs.end(),
                                    [&](const auto& each) { return waits_for_host(*each.second); });
}

}  // namespace robomosp::ioci
