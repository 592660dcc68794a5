// SPDX-License-Identifier: Apache-2.0
// LiveRun: a simulation on a separate thread that computes only as far as requested: stepped,
// played in real time or as fast as possible, paused, played backwards over its recording (layer:
// application, sim).
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "recording/recording.h"
#include "sim/row_sink.h"

namespace robomosp::sim {

/// As fast as it computes, for LiveRun::play().
inline constexpr double kAsFastAsPossible = std::numeric_limits<double>::infinity();

/// The simulation waits after every row until the next one is requested: by a step, by a time, or
/// by the clock during playback. It keeps a state with every row. Waiting calls end with
/// ErrorCode::cancelled within 100 ms of a cancellation, and the run is then paused. A waiting call
/// ends with ErrorCode::conflict if another one moves the run. [any thread]
class LiveRun {
 public:
  /// Computes the rows and passes each on; `from` = where to continue, none = the start. The notes
  /// of the result become the run's. Called on the run's thread, so it must own or share its
  /// inputs.
  using Source =
      std::function<Result<recording::RecordingPtr>(const RunState* from, RowSink&, Progress&)>;
  /// Monotonic time in seconds. [any thread]
  using Clock = std::function<double()>;

  /// Empty = the computer's clock.
  explicit LiveRun(Clock clock = {});
  ~LiveRun();  ///< stops and joins
  LiveRun(const LiveRun&) = delete;
  LiveRun& operator=(const LiveRun&) = delete;

  /// Starts, or restarts and drops the recording, and waits for the first row; then paused. If no
  /// row is computed, it stays paused with its previous rows.
  Result<void> start(Source source, Progress& progress);
  /// Continues from the row shown with another source; later rows are dropped. Waits for the first
  /// row. If no row is computed, it stays paused with its old source and all its rows.
  Result<void> refresh(Source source, Progress& progress);

  /// Moves by this many rows, back if negative, and pauses; computes missing rows.
  Result<void> step(std::int64_t rows, Progress& progress);
  /// Moves to a time [s] and pauses; computes missing rows. Times beyond the end mean the end.
  Result<void> go_to(double time, Progress& progress);
  /// Computes to the end and shows it.
  Result<void> finish(Progress& progress);
  /// Starts playback at `speed` times real time: 1 = real time, kAsFastAsPossible, negative =
  /// backwards over the recording. Returns at once. `speed` is not 0.
  void play(double speed);
  /// Pauses playback and waits until the simulation is idle.
  Result<void> pause(Progress& progress);
  /// Waits until the simulation has computed everything requested by now. Not during endless
  /// playback.
  Result<void> catch_up(Progress& progress);
  /// Stops the simulation and keeps the recording.
  void stop();
  /// Must be called after a custom clock has changed.
  void wake() { changed_.notify_all(); }

  struct Shown {
    double time = 0;           ///< time shown [s]
    std::size_t row = 0;       ///< the last row at or before it
    std::size_t rows = 0;      ///< recorded
    double recorded = 0;       ///< time of the last row [s]
    double speed = 0;          ///< 0 = paused
    double lag = 0;            ///< delay of the simulation behind the clock [s]
    bool is_over = false;      ///< the end is shown
    bool is_complete = false;  ///< nothing is left to compute
    bool has_last = false;     ///< the last row is recorded, also where the run has not ended yet
    std::size_t restarts = 0;  ///< number of starts and refreshes
    std::optional<Error> failure;
    std::size_t notes = 0;       ///< so far
    std::vector<double> values;  ///< of the row, one per column
  };
  [[nodiscard]] Shown shown() const;
  [[nodiscard]] bool is_playing() const;  ///< playback is running
  /// Notes from number `from` on, 0 = the first, at most `most`.
  [[nodiscard]] std::vector<std::string> notes(std::size_t from, std::size_t most) const;
  /// A copy of the recorded rows.
  [[nodiscard]] recording::RecordingPtr recording() const;
  /// Names, units and the rest of the recording without its rows.
  [[nodiscard]] recording::Recording head() const;
  /// Recorded rows from an index on.
  struct Piece {
    std::size_t from = 0;      ///< index of the first row of this piece
    std::size_t recorded = 0;  ///< total number of rows
    std::size_t restarts = 0;
    std::vector<recording::Column> columns;  ///< with the piece's rows only
  };
  /// Rows from `from` on, at most `most`, of columns by name (empty = all; see
  /// recording::Recording::select). For a reader with the rows up to `from` as of `restarts`, the
  /// piece begins earlier if rows were dropped since. Cost proportional to its size.
  [[nodiscard]] Result<Piece> piece(std::size_t from, std::optional<std::size_t> restarts,
                                    std::size_t most, std::span<const std::string> names) const;

 private:
  class Gate;
  /// The position shown, by the clock during playback.
  struct Place {
    double time = 0;
    double wanted = 0;  ///< time requested by the clock
    bool is_playing = false;
  };
  // Call all of these with mutex_ held.
  [[nodiscard]] Place place() const;
  [[nodiscard]] std::size_t row_at(double time) const;
  [[nodiscard]] double first_time() const;
  [[nodiscard]] double head_time() const;
  [[nodiscard]] double clock_target() const;
  [[nodiscard]] bool is_wanted() const;
  [[nodiscard]] Error missing() const;                         ///< why no more rows are computed
  [[nodiscard]] Error moved() const;                           ///< another call moved the run
  Result<void> start_anew(Source source, Progress& progress);  ///< with control_ held
  void stand(double time);
  void restart(std::size_t kept);
  void append(const recording::Recording& table, std::size_t row, RunStatePtr state,
              std::size_t notes_before);
  /// `before` = notes of this part that the table omits.
  void take_notes(const recording::Recording& table, std::size_t before);
  /// Matches the columns of a table, and adds new ones, at a row with this many before it.
  void match_columns(const recording::Recording& table, std::size_t row);
  [[nodiscard]] bool has_columns_of(const recording::Recording& table) const;
  /// Lets a new source compute its first row alongside the current one, and then replaces that;
  /// `prepare` is called at that moment. With control_ held.
  template <class Prepare>
  Result<void> replace(Source source, RunStatePtr from, Progress& progress, Prepare&& prepare);
  /// Waits until a new source may replace the old one.
  Result<void> admit(const std::stop_token& stop);

  Result<void> take(const recording::Recording& table, std::size_t row, RunStatePtr state,
                    std::size_t notes_before, bool rests, bool is_last,
                    const std::stop_token& stop);
  /// Pauses on the simulation's request, but not before row one was requested. With mutex_ held.
  void rest_here();
  Result<void> wait_behind_row(std::unique_lock<std::mutex>& lock, const std::stop_token& stop);
  Result<void> rest(const recording::Recording& table, std::size_t notes_before,
                    const std::stop_token& stop);
  void join();
  /// Waits until `is_done` holds; `lock` holds mutex_.
  template <class Done>
  Result<void> await(std::unique_lock<std::mutex>& lock, Progress& progress, Done&& is_done);

  Clock clock_;
  std::mutex control_;  ///< held while starting, restarting or ending the simulation; lock it
                        ///< before mutex_
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  // Guarded by mutex_:
  recording::Recording table_;
  std::vector<std::ptrdiff_t> source_of_;  ///< column of the simulation's table; -1 = none
  std::vector<RunStatePtr> states_;        ///< one per row
  std::vector<std::string> old_notes_;     ///< of the parts before a refresh
  std::vector<std::size_t> note_counts_;   ///< of table_.notes, one per row
  /// Rows kept at each start and refresh. Only the minimum of later values matters, so the numbers
  /// never decrease.
  std::vector<std::pair<std::size_t, std::size_t>> kept_;  ///< (restarts, rows)
  std::size_t restarts_ = 0;
  std::uint64_t wish_ = 0;  ///< incremented by every request
  std::size_t want_rows_ = 1;
  double want_time_ = 0;
  double speed_ = 0, position_ = 0;  ///< current position, or where playback started [s]
  double played_at_ = 0;             ///< by the clock [s]
  bool is_resting_ = false;          ///< the simulation waits after a row
  bool is_finished_ = true;          ///< no simulation is running
  bool is_complete_ = false;         ///< it ran to its end
  bool has_last_ = false;            ///< no row follows
  bool is_first_ = false;            ///< the next row is the first after a refresh
  std::uint64_t rests_ = 0;          ///< number of pauses it requested
  double fraction_ = 0;              ///< as reported by the simulation
  std::string what_;
  std::optional<Error> failure_;
  /// State of a source that is to replace the current one.
  enum class Admission : std::uint8_t { none, asked, given, refused };
  Admission admission_ = Admission::none;
  std::optional<Error> refusal_;  ///< why it has no row; empty = not reported

  std::jthread thread_;  ///< last, so that it ends before the members it uses
};

}  // namespace robomosp::sim
