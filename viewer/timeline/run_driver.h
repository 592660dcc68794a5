// SPDX-License-Identifier: GPL-3.0-or-later
// RunDriver: joins a live run with a player, so that transport and ruler drive the run by its
// commands (layer: GUI).
#pragma once

#include <cstdint>
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
  void seek(double time);
  void end_drag();
  void ask_state();

  Desk& desk_;
  const Handle run_;
  QPointer<Player> player_;
  std::optional<double> first_;        ///< time of the first row [s]
  std::optional<double> wanted_time_;  ///< of the newest seek while one runs
  bool is_seeking_ = false;
  double seek_time_ = 0;  ///< [s]
  QTimer seek_end_;       ///< until a drag counts as ended
};

}  // namespace robomosp::viewer
