// SPDX-License-Identifier: GPL-3.0-or-later
// RunDriver: joins a live run with a player, so that transport and ruler drive the run by its
// commands (layer: GUI).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <QObject>
#include <QPointer>
#include <QTimer>

#include "viewer/desktop/desk.h"
#include "viewer/desktop/player.h"

namespace robomosp::viewer {

/// [GUI thread]
class RunDriver : public QObject {
 public:
  RunDriver(Desk& desk, Handle run, Player& player, QObject* parent = nullptr);
  /// Ends the simulation; its rows stay.
  void stop();
  [[nodiscard]] const Handle& run() const { return run_; }

 private:
  void take(const Map& state);
  /// Takes the state that a command returned. An event that came meanwhile is newer: it may be
  /// delivered before the answer to an earlier question.
  void take_answer(const Map& state);
  void seek(double time);
  void end_drag();
  void ask_state();

  Desk& desk_;
  const Handle run_;
  QPointer<Player> player_;
  std::optional<double> first_;                   ///< time of the first row [s]
  std::optional<double> wanted_time_;             ///< of the newest seek while one runs
  std::shared_ptr<const ioci::RunState> newest_;  ///< of events since the last question
  bool is_seeking_ = false;
  double seek_time_ = 0;  ///< [s]
  QTimer seek_end_;       ///< until a drag counts as ended
};

}  // namespace robomosp::viewer
