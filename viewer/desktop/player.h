// SPDX-License-Identifier: GPL-3.0-or-later
// Player: the time of a recording and its playback (layer: GUI). Only the time: whoever listens
// moves the scene.
#pragma once

#include <QElapsedTimer>
#include <QObject>
#include <QTimer>

#include "viewer/desktop/listeners.h"

namespace robomosp::viewer {

/// [GUI thread]
class Player : public QObject {
 public:
  explicit Player(QObject* parent = nullptr);

  /// The range of times [s]; an empty one has no motion. Stops, and goes to its start.
  void set_range(double from, double to);
  void set_time(double time);    ///< [s], clamped to the range; not finite = ignored
  void play(bool on);            ///< from the start if the time is at the end
  void set_speed(double speed);  ///< seconds per second, > 0; others are ignored
  void set_loop(bool on) { is_looping_ = on; }

  [[nodiscard]] double from() const { return from_; }
  [[nodiscard]] double to() const { return to_; }
  [[nodiscard]] double time() const { return time_; }
  [[nodiscard]] double speed() const { return speed_; }
  [[nodiscard]] bool has_motion() const { return to_ > from_; }
  [[nodiscard]] bool is_playing() const { return ticker_.isActive(); }
  [[nodiscard]] bool is_looping() const { return is_looping_; }

  Listeners<double> time_changed;
  Listeners<> state_changed;  ///< range, speed, or whether it plays

 private:
  void tick();

  double from_ = 0, to_ = 0, time_ = 0, speed_ = 1;
  bool is_looping_ = true;
  QTimer ticker_;
  QElapsedTimer clock_;
};

}  // namespace robomosp::viewer
