// SPDX-License-Identifier: GPL-3.0-or-later
// StartTimes: how long the program took to reach each step of its start, for --start-times
// (layer: GUI).
#pragma once

#include <string>
#include <vector>

#include <QObject>
#include <QTimer>

namespace robomosp::viewer {

class MainWindow;

/// Elapsed time since the system began the process, and processor time of all its threads.
class StartTimes {
 public:
  StartTimes();
  /// Notes that a step has ended now.
  void reached(std::string step);
  /// One line for each step: both times [s] and its name.
  [[nodiscard]] std::string table() const;

 private:
  struct Step {
    std::string name;
    double elapsed = 0, processor = 0;  ///< [s]
  };
  double begin_ = 0;  ///< of the process, on the clock of the system [s]
  std::vector<Step> steps_;
};

/// Notes when the window is painted and when it is usable: it has what it asked for, and its view
/// an exact picture. Then it prints the times and closes the window. [GUI thread]
class StartWatch : public QObject {
 public:
  StartWatch(MainWindow& window, StartTimes& times);

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  void look();
  MainWindow& window_;
  StartTimes& times_;
  QTimer timer_;
  bool is_painted_ = false;
  int looks_ = 0;
};

}  // namespace robomosp::viewer
