// SPDX-License-Identifier: GPL-3.0-or-later
// Player: the time of a recording or live run and its playback (layer: GUI). Only the time: whoever
// listens moves the scene.
#pragma once

#include <functional>
#include <optional>

#include <QElapsedTimer>
#include <QObject>
#include <QTimer>

#include "viewer/desktop/listeners.h"

namespace robomosp::viewer {

/// [GUI thread]
class Player : public QObject {
 public:
  explicit Player(QObject* parent = nullptr);

  /// The range of times [s]; an empty one has no motion. Stops, goes to its start, and ends what
  /// follow() began.
  void set_range(double from, double to);
  /// The same motion over other times: the present time and the playback stay.
  void change_range(double from, double to);
  void set_time(double time);  ///< [s], clamped to the range; not finite = ignored
  void play(bool on);          ///< from the other end if the time is at the end
  void step(int by);           ///< by rows of a run, or hundredths of the range
  /// Seconds per second; negative plays backwards. 0 and what is not finite is ignored.
  void set_speed(double speed);
  void set_loop(bool on) { is_looping_ = on; }

  /// A live run, which has its own clock: it is asked to play, and reports its time.
  struct Run {
    std::function<void(double time)> seek;
    std::function<void(bool on, double speed)> play;
    std::function<void(int rows)> step;
  };
  void follow(Run run);
  /// What the run reports: rows exist from `from` to `to` [s].
  void show_run(double from, double to, double time, bool is_playing);

  [[nodiscard]] double from() const { return from_; }
  [[nodiscard]] double to() const { return to_; }
  [[nodiscard]] double time() const { return time_; }
  [[nodiscard]] double speed() const { return speed_; }
  [[nodiscard]] bool has_motion() const { return run_ || to_ > from_; }
  [[nodiscard]] bool is_playing() const { return run_ ? is_run_playing_ : ticker_.isActive(); }
  [[nodiscard]] bool is_looping() const { return is_looping_; }
  [[nodiscard]] bool is_run() const { return run_.has_value(); }

  Listeners<double> time_changed;
  Listeners<> state_changed;  ///< range, speed, or whether it plays

 private:
  void tick();

  double from_ = 0, to_ = 0, time_ = 0, speed_ = 1;
  bool is_looping_ = true, is_run_playing_ = false;
  std::optional<Run> run_;
  QTimer ticker_;
  QElapsedTimer clock_;
};

}  // namespace robomosp::viewer
