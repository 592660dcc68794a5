// SPDX-License-Identifier: Apache-2.0
#include "sim/live_run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <utility>

#include "kernel/call_queue.h"
#include "kernel/jobs.h"
#include "kernel/text.h"
#include "kernel/turns.h"

namespace robomosp::sim {
namespace {

using recording::Column;
using recording::Recording;
using recording::RecordingPtr;

using namespace std::chrono_literals;

constexpr double kNever = -std::numeric_limits<double>::infinity();
/// How often a call that waits looks whether the user gave up.
constexpr auto kLook = 50ms;
/// The simulation looks at the clock again after [s].
constexpr double kLeastNap = 1e-3, kMostNap = 3600;

/// Sums of steps differ from times of rows by rounding [s].
double tolerance(double t) { return 1e-9 * std::max(1.0, std::fabs(t)); }

std::string at_time(double t) { return "t = " + text::print_rounded(t) + " s"; }

Recording without_rows(const Recording& r) {
  Recording out;
  out.title = r.title, out.world = r.world, out.robot = r.robot, out.trajectory = r.trajectory;
  out.dof = r.dof, out.voxel = r.voxel, out.base_moves = r.base_moves;
  for (const Column& c : r.columns)
    out.columns.push_back({c.name, c.unit, c.doc, {}, c.lower, c.upper});
  return out;
}

}  // namespace

Result<void> check_fits(std::size_t was, std::size_t is) {
  if (was == is) return {};
  return error(ErrorCode::conflict,
               "it has " + std::to_string(is) + " joint values now and had " + std::to_string(was) +
                   " before, so its state does not fit",
               "Restart it: run.reset.");
}

Error over_before(std::optional<double> end, double from) {
  return error(ErrorCode::conflict,
               "it is over " +
                   (end ? "at " + at_time(*end) + " now, before " : std::string("now before ")) +
                   at_time(from) + ", where it should continue",
               "Go back (run.seek) and refresh it there, or restart it: run.reset.");
}

Result<void> hand_on(const Recording& table, double from, RowSink& sink) {
  if (table.columns.empty() || table.columns.front().name != "time")
    return error(ErrorCode::invalid_argument, "the recording has no time as its first column",
                 "Give one of a motion.");
  const std::vector<double>& times = table.columns.front().values;
  if (!times.empty() && times.back() < from - tolerance(from))
    return over_before(times.back(), from);
  for (std::size_t row = 0; row < times.size(); ++row) {
    if (times[row] < from - tolerance(from)) continue;
    auto state = std::make_shared<RunState>();
    state->time = times[row];
    RMP_TRY(sink.take(table, row, std::move(state)));
  }
  return {};
}

/// What the simulation of one part hands its rows to.
class LiveRun::Gate final : public RowSink {
 public:
  Gate(LiveRun& run, std::stop_token stop) : run_(run), stop_(std::move(stop)) {}
  Result<void> take(const Recording& table, std::size_t row, RunStatePtr state) override {
    if (!is_admitted_) RMP_TRY(run_.admit(stop_));
    is_admitted_ = true;
    return run_.take(table, row, std::move(state), std::exchange(notes_before_, 0),
                     std::exchange(rests_behind_next_, false), ends_with_next_, stop_);
  }
  bool has_notes(std::size_t count) override {
    if (is_admitted_) notes_before_ = count;
    return is_admitted_;
  }
  void end_with_next() override { ends_with_next_ = true; }
  void rest_behind_next() override { rests_behind_next_ = true; }
  Result<void> rest(const Recording& table) override {
    // Without one there is no row yet.
    return is_admitted_ ? run_.rest(table, std::exchange(notes_before_, 0), stop_) : Result<void>();
  }
  [[nodiscard]] bool is_admitted() const { return is_admitted_; }

 private:
  LiveRun& run_;
  std::stop_token stop_;
  bool is_admitted_ = false;        ///< its rows are the run's
  bool rests_behind_next_ = false;  ///< as the simulation said
  bool ends_with_next_ = false;     ///< as the simulation said
  std::size_t notes_before_ = 0;    ///< that the next table leaves out
};

LiveRun::LiveRun(Clock clock) : clock_(std::move(clock)) {
  if (!clock_)
    clock_ = [] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
          .count();
    };
}

LiveRun::~LiveRun() {
  const std::lock_guard control(control_);
  join();
}

void LiveRun::join() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

// ---- the simulation's thread ----

Result<void> LiveRun::take(const Recording& table, std::size_t row, RunStatePtr state,
                           std::size_t notes_before, bool rests, bool is_last,
                           const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  append(table, row, std::move(state), notes_before);
  has_last_ = is_last;
  if (rests) rest_here();
  return wait_behind_row(lock, stop);
}

void LiveRun::rest_here() {
  // Whoever waits for more gets what there is; the wish stays its own.
  position_ = head_time();
  speed_ = 0;
  want_rows_ = states_.size();
  want_time_ = kNever;
  ++rests_;
}

Result<void> LiveRun::rest(const Recording& table, std::size_t notes_before,
                           const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  take_notes(table, notes_before);
  if (!note_counts_.empty()) note_counts_.back() = table_.notes.size();
  rest_here();
  // Nothing but a new wish goes on from here, even one for the row that there is.
  is_resting_ = true;
  changed_.notify_all();
  changed_.wait(lock, stop, [this, seen = wish_] { return wish_ != seen && is_wanted(); });
  is_resting_ = false;
  if (stop.stop_requested()) return error(ErrorCode::cancelled, "the run was cancelled");
  return {};
}

Result<void> LiveRun::wait_behind_row(std::unique_lock<std::mutex>& lock,
                                      const std::stop_token& stop) {
  is_resting_ = true;
  changed_.notify_all();
  while (!is_wanted() && !stop.stop_requested()) {
    const auto is_new = [this, seen = wish_] { return wish_ != seen || is_wanted(); };
    if (speed_ > 0) {
      const double left = (head_time() - clock_target()) / speed_;
      changed_.wait_for(
          lock, stop, std::chrono::duration<double>(std::clamp(left, kLeastNap, kMostNap)), is_new);
    } else {
      changed_.wait(lock, stop, is_new);
    }
  }
  is_resting_ = false;
  if (stop.stop_requested()) return error(ErrorCode::cancelled, "the run was cancelled");
  return {};
}

bool LiveRun::is_wanted() const {
  const double head = head_time();
  return states_.size() < want_rows_ || head + tolerance(head) < want_time_ ||
         (speed_ > 0 && clock_target() >= head);
}

// ---- the table ----

bool LiveRun::has_columns_of(const Recording& table) const {
  std::size_t found = 0;
  for (std::size_t c = 0; c < source_of_.size(); ++c) {
    if (source_of_[c] < 0) continue;
    const auto from = static_cast<std::size_t>(source_of_[c]);
    if (from >= table.columns.size() || table.columns[from].name != table_.columns[c].name)
      return false;
    ++found;
  }
  return found == table.columns.size();
}

void LiveRun::match_columns(const Recording& table, std::size_t row) {
  const std::size_t before = states_.size();
  std::vector<std::string> added, gone;
  source_of_.assign(table_.columns.size(), -1);
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const Column& column = table.columns[c];
    const auto known = std::find_if(table_.columns.begin(), table_.columns.end(),
                                    [&](const Column& x) { return x.name == column.name; });
    if (known != table_.columns.end()) {
      source_of_[static_cast<std::size_t>(known - table_.columns.begin())] =
          static_cast<std::ptrdiff_t>(c);
      known->lower = column.lower, known->upper = column.upper;
      continue;
    }
    table_.columns.push_back({column.name, column.unit, column.doc,
                              std::vector<double>(before, column.values[row]), column.lower,
                              column.upper});
    source_of_.push_back(static_cast<std::ptrdiff_t>(c));
    added.push_back(column.name);
  }
  for (std::size_t c = 0; c < table_.columns.size(); ++c)
    if (source_of_[c] < 0) gone.push_back(table_.columns[c].name);
  if (before == 0) return;
  if (!added.empty()) restart(0);  // rows of before have values of these, too
  if (!added.empty())
    old_notes_.push_back("new from " + at_time(head_time()) +
                         " on, unchanged before it: " + text::enumerate(added));
  if (!gone.empty())
    old_notes_.push_back("ended at " + at_time(head_time()) +
                         ", unchanged after it: " + text::enumerate(gone));
}

void LiveRun::take_notes(const Recording& table, std::size_t before) {
  std::vector<std::string>& all = table_.notes;
  const std::size_t first = old_notes_.size() + before;
  if (all.size() == first + table.notes.size()) return;
  if (before == 0) {
    all = old_notes_;
  } else if (all.size() < first) {
    // The latest of the parts before have come behind what this one has told.
    const auto missing = static_cast<std::ptrdiff_t>(first - all.size());
    all.insert(all.end() - static_cast<std::ptrdiff_t>(before), old_notes_.end() - missing,
               old_notes_.end());
  } else {
    all.resize(first);
  }
  all.insert(all.end(), table.notes.begin(), table.notes.end());
}

void LiveRun::append(const Recording& table, std::size_t row, RunStatePtr state,
                     std::size_t notes_before) {
  if (states_.empty()) {
    table_ = without_rows(table);
    source_of_.resize(table.columns.size());
    for (std::size_t c = 0; c < source_of_.size(); ++c)
      source_of_[c] = static_cast<std::ptrdiff_t>(c);
  }
  if (!has_columns_of(table)) match_columns(table, row);
  const double time = table.columns.front().values[row];
  if (std::exchange(is_first_, false) &&
      std::fabs(time - head_time()) <= tolerance(time)) {  // the row that it goes on from
    states_.back() = std::move(state);
  } else {
    for (std::size_t c = 0; c < table_.columns.size(); ++c) {
      std::vector<double>& values = table_.columns[c].values;
      values.push_back(source_of_[c] < 0
                           ? values.back()
                           : table.columns[static_cast<std::size_t>(source_of_[c])].values[row]);
    }
    states_.push_back(std::move(state));
    note_counts_.push_back(0);
  }
  take_notes(table, notes_before);
  note_counts_.back() = table_.notes.size();
}

double LiveRun::first_time() const {
  return states_.empty() ? 0 : table_.columns.front().values.front();
}
double LiveRun::head_time() const {
  return states_.empty() ? 0 : table_.columns.front().values.back();
}

std::size_t LiveRun::row_at(double time) const {
  if (states_.empty()) return 0;
  const std::vector<double>& times = table_.columns.front().values;
  const auto after = std::upper_bound(times.begin(), times.end(), time + tolerance(time));
  return after == times.begin() ? 0 : static_cast<std::size_t>(after - times.begin()) - 1;
}

// ---- the clock ----

double LiveRun::clock_target() const {
  return std::isinf(speed_) ? speed_ : position_ + speed_ * (clock_() - played_at_);
}

LiveRun::Place LiveRun::place() const {
  if (speed_ == 0) return {position_, position_, false};
  Place p;
  p.wanted = clock_target();
  p.time = std::clamp(p.wanted, first_time(), head_time());
  p.is_playing = speed_ < 0 ? p.wanted > first_time() : !is_finished_ || p.wanted < head_time();
  return p;
}

void LiveRun::stand(double time) {
  position_ = time;
  speed_ = 0;
  want_rows_ = states_.size();
  want_time_ = kNever;
  ++wish_;
}

// ---- what the application asks for ----

template <class Done>
Result<void> LiveRun::await(std::unique_lock<std::mutex>& lock, Progress& progress,
                            Done&& is_done) {
  while (!wait_serving(lock, changed_, kLook, is_done)) {
    progress.report(fraction_, what_);
    if (!progress.cancelled()) continue;
    stand(place().time);
    return error(ErrorCode::cancelled, "waiting for the simulation was cancelled; it is paused");
  }
  return {};
}

template <class Prepare>
Result<void> LiveRun::replace(Source source, RunStatePtr from, Progress& progress,
                              Prepare&& prepare) {
  const bool goes_on = from != nullptr;
  const double begin = goes_on ? from->time : 0;
  std::unique_lock lock(mutex_);
  admission_ = Admission::none;
  refusal_.reset();
  std::jthread made(
      [this, source = std::move(source), from = std::move(from)](const std::stop_token& stop) {
        turns::compute();
        Gate gate(*this, stop);
        StopProgress with(stop, [&](double fraction, std::string_view what) {
          const std::lock_guard own(mutex_);
          fraction_ = fraction, what_ = what;
        });
        auto done = [&]() -> Result<RecordingPtr> {
          try {
            return source(from.get(), gate, with);
          } catch (const std::exception& e) {
            return error(ErrorCode::internal, std::string("the simulation threw: ") + e.what());
          } catch (...) {
            return error(ErrorCode::internal, "the simulation threw an unknown exception");
          }
        }();
        {
          const std::lock_guard own(mutex_);
          if (!gate.is_admitted()) {
            admission_ = Admission::refused;
            if (!done.ok()) refusal_ = std::move(done).error();
          } else {
            if (!stop.stop_requested()) {
              if (done.ok()) take_notes(**done, 0);
              else failure_ = std::move(done).error();
              is_complete_ = !failure_;
            }
            is_finished_ = true, is_resting_ = false;
          }
        }
        changed_.notify_all();
      });
  auto waited = await(lock, progress, [this] {
    return admission_ == Admission::asked || admission_ == Admission::refused;
  });
  if (!waited.ok() || admission_ == Admission::refused) {
    auto refusal = refusal_;
    lock.unlock();
    made.request_stop();
    made.join();
    if (!waited.ok()) return waited;
    if (refusal) return std::move(*refusal);
    return goes_on ? over_before(std::nullopt, begin)
                   : error(ErrorCode::invalid_argument, "the simulation has no rows",
                           "Give it a duration.");
  }
  lock.unlock();
  join();
  lock.lock();
  prepare();
  is_resting_ = is_finished_ = is_complete_ = has_last_ = false;
  fraction_ = 0;
  failure_.reset();
  thread_ = std::move(made);
  admission_ = Admission::given;
  changed_.notify_all();
  return await(lock, progress, [this] { return (!states_.empty() && !is_first_) || is_finished_; });
}

Result<void> LiveRun::admit(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  admission_ = Admission::asked;
  changed_.notify_all();
  changed_.wait(lock, stop, [this] { return admission_ == Admission::given; });
  if (stop.stop_requested()) return error(ErrorCode::cancelled, "the run was cancelled");
  return {};
}

Error LiveRun::moved() const {
  return error(ErrorCode::conflict, "another command moved the run meanwhile",
               "run.state returns its present state.");
}

Error LiveRun::missing() const {
  if (failure_) return *failure_;
  return error(ErrorCode::conflict, "the run was cancelled at " + at_time(head_time()),
               "run.refresh continues it, run.reset restarts it.");
}

Result<void> LiveRun::start(Source source, Progress& progress) {
  const std::lock_guard control(control_);
  return start_anew(std::move(source), progress);
}

Result<void> LiveRun::start_anew(Source source, Progress& progress) {
  {
    const std::lock_guard lock(mutex_);
    stand(place().time);
  }
  RMP_TRY(replace(std::move(source), nullptr, progress, [this] {
    table_ = {};
    source_of_.clear(), states_.clear(), old_notes_.clear(), note_counts_.clear();
    is_first_ = false;
    restart(0);
    stand(0);
    want_rows_ = 1;
  }));
  const std::lock_guard lock(mutex_);
  position_ = first_time();
  return {};
}

Result<void> LiveRun::refresh(Source source, Progress& progress) {
  const std::lock_guard control(control_);
  std::unique_lock lock(mutex_);
  if (states_.empty()) {
    lock.unlock();
    return start_anew(std::move(source), progress);
  }
  const double time = place().time;
  stand(time);
  const std::size_t rows = row_at(time) + 1;
  RunStatePtr from = states_[rows - 1];
  lock.unlock();
  return replace(std::move(source), std::move(from), progress, [this, rows] {
    for (Column& c : table_.columns) c.values.resize(rows);
    states_.resize(rows);
    note_counts_.resize(rows);
    restart(rows);
    if (table_.notes.size() > note_counts_.back()) table_.notes.resize(note_counts_.back());
    table_.notes.push_back("continued at " + at_time(head_time()) +
                           " with the world as it was then");
    old_notes_ = table_.notes;
    stand(head_time());
    is_first_ = true;
  });
}

Result<void> LiveRun::step(std::int64_t rows, Progress& progress) {
  std::unique_lock lock(mutex_);
  if (states_.empty()) return missing();
  const double time = place().time;
  std::int64_t to = static_cast<std::int64_t>(row_at(time)) + rows;
  // Back from between two rows is to the one before.
  if (rows < 0 && table_.columns.front().values[row_at(time)] + tolerance(time) < time) ++to;
  const auto target = static_cast<std::size_t>(std::max<std::int64_t>(to, 0));
  stand(time);
  const std::uint64_t rests = rests_;
  want_rows_ = std::max(want_rows_, target + 1);
  changed_.notify_all();
  RMP_TRY(await(lock, progress, [&, mine = wish_] {
    return states_.size() > target || is_finished_ || wish_ != mine || rests_ != rests;
  }));
  if (rests_ != rests && states_.size() <= target) return {};
  if (states_.size() <= target && !is_finished_) return moved();
  if (states_.empty()) return missing();
  const std::size_t reached = std::min(target, states_.size() - 1);
  stand(table_.columns.front().values[reached]);
  if (reached < target && !is_complete_) return missing();
  return {};
}

Result<void> LiveRun::go_to(double time, Progress& progress) {
  std::unique_lock lock(mutex_);
  if (states_.empty()) return missing();
  stand(place().time);
  const std::uint64_t rests = rests_;
  want_time_ = time;
  changed_.notify_all();
  const auto is_there = [&] { return head_time() + tolerance(head_time()) >= time; };
  RMP_TRY(await(lock, progress, [&, mine = wish_] {
    return is_there() || is_finished_ || wish_ != mine || rests_ != rests;
  }));
  if (rests_ != rests && !is_there()) return {};
  if (!is_there() && !is_finished_) return moved();
  stand(std::clamp(time, first_time(), head_time()));
  if (!is_there() && !is_complete_) return missing();
  return {};
}

Result<void> LiveRun::finish(Progress& progress) {
  std::unique_lock lock(mutex_);
  if (states_.empty()) return missing();
  stand(place().time);
  const std::uint64_t rests = rests_;
  want_time_ = std::numeric_limits<double>::infinity();
  changed_.notify_all();
  RMP_TRY(await(lock, progress,
                [&, mine = wish_] { return is_finished_ || wish_ != mine || rests_ != rests; }));
  if (rests_ != rests && !is_finished_) return {};
  if (!is_finished_) return moved();
  stand(head_time());
  if (!is_complete_) return missing();
  return {};
}

void LiveRun::play(double speed) {
  {
    const std::lock_guard lock(mutex_);
    stand(place().time);
    speed_ = speed;
    played_at_ = clock_();
  }
  changed_.notify_all();
}

Result<void> LiveRun::pause(Progress& progress) {
  std::unique_lock lock(mutex_);
  stand(place().time);
  changed_.notify_all();
  return await(lock, progress, [this] { return is_resting_ || is_finished_; });
}

Result<void> LiveRun::catch_up(Progress& progress) {
  std::unique_lock lock(mutex_);
  return await(lock, progress, [this] { return is_finished_ || (is_resting_ && !is_wanted()); });
}

void LiveRun::stop() {
  const std::lock_guard control(control_);
  {
    const std::lock_guard lock(mutex_);
    stand(place().time);
  }
  join();
}

bool LiveRun::is_playing() const {
  const std::lock_guard lock(mutex_);
  return place().is_playing;
}

LiveRun::Shown LiveRun::shown() const {
  const std::lock_guard lock(mutex_);
  const Place p = place();
  Shown s;
  s.time = p.time;
  s.row = row_at(p.time);
  s.rows = states_.size();
  s.recorded = head_time();
  s.speed = p.is_playing ? speed_ : 0;
  s.is_complete = is_complete_;
  s.has_last = has_last_ || is_complete_;
  s.restarts = restarts_;
  s.is_over = is_finished_ && p.time + tolerance(p.time) >= s.recorded;
  if (p.is_playing && speed_ > 0 && !std::isinf(speed_) && !is_finished_)
    s.lag = std::max(0.0, p.wanted - s.recorded);
  s.failure = failure_;
  s.notes = table_.notes.size();
  if (s.rows > 0)
    for (const Column& c : table_.columns) s.values.push_back(c.values[s.row]);
  return s;
}

/// Rows from `kept` on are other ones from now on.
void LiveRun::restart(std::size_t kept) {
  ++restarts_;
  while (!kept_.empty() && kept_.back().second >= kept) kept_.pop_back();
  kept_.emplace_back(restarts_, kept);
}

Result<LiveRun::Piece> LiveRun::piece(std::size_t from, std::optional<std::size_t> restarts,
                                      std::size_t most, std::span<const std::string> names) const {
  const std::lock_guard lock(mutex_);
  Piece out{.from = from, .recorded = states_.size(), .restarts = restarts_, .columns = {}};
  if (restarts) {
    // Of all that were dropped since, the first row; the numbers rise.
    const auto since = std::find_if(kept_.begin(), kept_.end(),
                                    [&](const auto& k) { return k.first > *restarts; });
    if (since != kept_.end()) out.from = std::min(out.from, since->second);
  }
  out.from = std::min(out.from, out.recorded);
  const std::size_t end = out.from + std::min(most, out.recorded - out.from);
  const auto add = [&](const Column& c) {
    out.columns.push_back(
        {c.name, c.unit, c.doc,
         std::vector<double>(c.values.begin() + static_cast<std::ptrdiff_t>(out.from),
                             c.values.begin() + static_cast<std::ptrdiff_t>(end)),
         c.lower, c.upper});
  };
  if (names.empty()) {
    for (const Column& c : table_.columns) add(c);
    return out;
  }
  RMP_TRY_ASSIGN(const auto chosen, table_.select(names));
  for (const Column* c : chosen) add(*c);
  return out;
}

std::vector<std::string> LiveRun::notes(std::size_t from, std::size_t most) const {
  const std::lock_guard lock(mutex_);
  const std::size_t first = std::min(from, table_.notes.size());
  const std::size_t end = first + std::min(most, table_.notes.size() - first);
  return {table_.notes.begin() + static_cast<std::ptrdiff_t>(first),
          table_.notes.begin() + static_cast<std::ptrdiff_t>(end)};
}

RecordingPtr LiveRun::recording() const {
  const std::lock_guard lock(mutex_);
  return std::make_shared<const Recording>(table_);
}

Recording LiveRun::head() const {
  const std::lock_guard lock(mutex_);
  return without_rows(table_);
}

}  // namespace robomosp::sim
