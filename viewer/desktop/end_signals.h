// SPDX-License-Identifier: GPL-3.0-or-later
// EndSignals: SIGTERM, SIGINT and SIGHUP as an event of the window (layer: GUI).
#pragma once

#include <array>
#include <functional>

#include <QObject>

class QSocketNotifier;

namespace robomosp::viewer {

/// Calls `end` on the window's thread when the system asks the program to end. The second signal
/// ends it at once. One at a time. [GUI thread]
class EndSignals : public QObject {
 public:
  explicit EndSignals(std::function<void(int signal)> end, QObject* parent = nullptr);
  ~EndSignals() override;

 private:
  std::function<void(int)> end_;
  std::array<int, 2> pipe_{-1, -1};
  QSocketNotifier* notifier_ = nullptr;
};

}  // namespace robomosp::viewer
