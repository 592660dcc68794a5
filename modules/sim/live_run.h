// SPDX-License-Identifier: Apache-2.0
// LiveRun: a simulation that computes on a thread of its own, no further than it is asked for:
// stepped, played in real time or as fast as possible, paused, run backwards over what is recorded
// (layer: application, sim).
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

/// The simulation waits behind every row until the next one is wanted: by a step, by a time that is
/// asked for, or by the clock while it is played. It keeps a state with every row. Calls that wait
/// end with ErrorCode::cancelled within 100 ms of the user's wish, and the run is paused then. A
/// call that waits while another one moves the run ends with ErrorCode::conflict. [any thread]
class LiveRun {
 public:
  /// Computes and hands on every row; `from` = where to go on, none = the start. The result's notes
  /// become the run's. Called on the run's thread, so it owns or shares what it reads.
  using Source =
      std::function<Result<recording::RecordingPtr>(const RunState* from, RowSink&, Progress&)>;
  /// Seconds that only grow. [any thread]
  using Clock = std::function<double()>;

  /// An empty clock is the computer's.
  explicit LiveRun(Clock clock = {});
  ~LiveRun();  ///< stops and joins
  LiveRun(const LiveRun&) = delete;
  LiveRun& operator=(const LiveRun&) = delete;

  /// Starts, or starts again without what was recorded, and waits for the first row. Paused then.
  /// Where there is none, it stays paused with what it had.
  Result<void> start(Source source, Progress& progress);
  /// Goes on from the row that is shown with another source; rows behind it are dropped. Waits for
  /// the first row. Where there is none, it stays paused with its old source and all its rows.
  Result<void> refresh(Source source, Progress& progress);

  /// So many rows on, or back when negative, and paused there; computes what is missing.
  Result<void> step(std::int64_t rows, Progress& progress);
  /// To a time [s] and paused there; computes what is missing. Beyond the end it is the end.
  Result<void> go_to(double time, Progress& progress);
  /// Computes to the end and shows it.
  Result<void> finish(Progress& progress);
  /// Lets the time run: 1 = as the clock does, kAsFastAsPossible, negative = backwards over what is
  /// recorded. Returns at once. `speed` is not 0.
  void play(double speed);
  /// Stops the time and waits until the simulation rests.
  Result<void> pause(Progress& progress);
  /// Waits until the simulation has made what is wanted by now. Not while it plays without end.
  Result<void> catch_up(Progress& progress);
  /// Ends the simulation; what is recorded stays.
  void stop();
  /// To be called when a clock other than the computer's has changed.
  void wake() { changed_.notify_all(); }

  struct Shown {
    double time = 0;           ///< that is shown [s]
    std::size_t row = 0;       ///< the last one at or before it
    std::size_t rows = 0;      ///< recorded
    double recorded = 0;       ///< time of the last one [s]
    double speed = 0;          ///< 0 = paused
    double lag = 0;            ///< how far the simulation is behind the clock [s]
    bool is_over = false;      ///< it is shown to its end
    bool is_complete = false;  ///< nothing is left to compute
    std::size_t restarts = 0;  ///< how often it began, or went on, with another source
    std::optional<Error> failure;
    std::size_t notes = 0;       ///< so far
    std::vector<double> values;  ///< of the row, one a column
  };
  [[nodiscard]] Shown shown() const;
  [[nodiscard]] bool is_playing() const;  ///< the time runs
  /// Notes from number `from` on, 0 = the first, at most `most`.
  [[nodiscard]] std::vector<std::string> notes(std::size_t from, std::size_t most) const;
  /// A copy of what is recorded.
  [[nodiscard]] recording::RecordingPtr recording() const;
  /// Names, units and the rest of the recording without its rows.
  [[nodiscard]] recording::Recording head() const;
  /// Rows of what is recorded, from one that a reader wants on.
  struct Piece {
    std::size_t from = 0;      ///< index of the first row of this piece
    std::size_t recorded = 0;  ///< rows that there are
    std::size_t restarts = 0;
    std::vector<recording::Column> columns;  ///< with the piece's rows only
  };
  /// Rows from `from` on, at most `most`, of columns by name (empty = all; see
  /// recording::Recording::select). For a reader who has the rows up to `from` as they were after
  /// `restarts`, the piece begins further ahead where rows were dropped since. Costs what it gives.
  [[nodiscard]] Result<Piece> piece(std::size_t from, std::optional<std::size_t> restarts,
                                    std::size_t most, std::span<const std::string> names) const;

 private:
  class Gate;
  /// What is shown, by the clock where it is played.
  struct Place {
    double time = 0;
    double wanted = 0;  ///< what the clock asks for
    bool is_playing = false;
  };
  // All of these with mutex_ held.
  [[nodiscard]] Place place() const;
  [[nodiscard]] std::size_t row_at(double time) const;
  [[nodiscard]] double first_time() const;
  [[nodiscard]] double head_time() const;
  [[nodiscard]] double clock_target() const;
  [[nodiscard]] bool is_wanted() const;
  [[nodiscard]] Error missing() const;                         ///< why nothing more is computed
  [[nodiscard]] Error moved() const;                           ///< another call said where it goes
  Result<void> start_anew(Source source, Progress& progress);  ///< with control_ held
  void stand(double time);
  void restart(std::size_t kept);
  void append(const recording::Recording& table, std::size_t row, RunStatePtr state,
              std::size_t notes_before);
  /// `before` = notes of this part that the table leaves out.
  void take_notes(const recording::Recording& table, std::size_t before);
  /// Finds the columns of a table, and adds those that are new, at a row with so many before it.
  void match_columns(const recording::Recording& table, std::size_t row);
  [[nodiscard]] bool has_columns_of(const recording::Recording& table) const;
  /// Lets a source compute to its first row beside the one that there is, and then takes that one's
  /// place; `prepare` is called then. With control_ held.
  template <class Prepare>
  Result<void> replace(Source source, RunStatePtr from, Progress& progress, Prepare&& prepare);
  /// Waits until a new source may take the old one's place.
  Result<void> admit(const std::stop_token& stop);

  Result<void> take(const recording::Recording& table, std::size_t row, RunStatePtr state,
                    std::size_t notes_before, bool rests, const std::stop_token& stop);
  /// Rests as the simulation wants, not before row one was wanted. With mutex_ held.
  void rest_here();
  Result<void> wait_behind_row(std::unique_lock<std::mutex>& lock, const std::stop_token& stop);
  Result<void> rest(const recording::Recording& table, std::size_t notes_before,
                    const std::stop_token& stop);
  void join();
  /// Until `is_done` holds; `lock` holds mutex_.
  template <class Done>
  Result<void> await(std::unique_lock<std::mutex>& lock, Progress& progress, Done&& is_done);

  Clock clock_;
  std::mutex control_;  ///< held by who starts, restarts or ends the simulation; before mutex_
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  // Guarded by mutex_:
  recording::Recording table_;
  std::vector<std::ptrdiff_t> source_of_;  ///< column of the simulation's table; -1 = it has none
  std::vector<RunStatePtr> states_;        ///< one a row
  std::vector<std::string> old_notes_;     ///< of the parts before a refresh
  std::vector<std::size_t> note_counts_;   ///< of table_.notes, one a row
  /// Rows that were kept at each start and refresh. Of those of before, the least is what matters,
  /// so no number is followed by a lesser one.
  std::vector<std::pair<std::size_t, std::size_t>> kept_;  ///< (restarts, rows)
  std::size_t restarts_ = 0;
  std::uint64_t wish_ = 0;  ///< counts changes of what is wanted
  std::size_t want_rows_ = 1;
  double want_time_ = 0;
  double speed_ = 0, position_ = 0;  ///< where it stands, or was played from [s]
  double played_at_ = 0;             ///< by the clock [s]
  bool is_resting_ = false;          ///< the simulation waits behind a row
  bool is_finished_ = true;          ///< no simulation runs
  bool is_complete_ = false;         ///< it ran to its end
  bool is_first_ = false;            ///< the next row is the first after a refresh
  std::uint64_t rests_ = 0;          ///< counts the rests that it wanted
  double fraction_ = 0;              ///< as the simulation reports
  std::string what_;
  std::optional<Error> failure_;
  /// A source that is to take the place of the one that there is.
  enum class Admission : std::uint8_t { none, asked, given, refused };
  Admission admission_ = Admission::none;
  std::optional<Error> refusal_;  ///< why it has no row; none = it says nothing

  std::jthread thread_;  ///< last, so that it ends before what it uses
};

}  // namespace robomosp::sim
