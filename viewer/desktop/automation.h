// SPDX-License-Identifier: GPL-3.0-or-later
// Automation: the commands window.* in the window: they find widgets by their object names, press
// keys and mouse buttons as a user does, and read what is shown (layer: GUI).
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string_view>

#include <QObject>
#include <QPointer>

#include "ioci/client/window_host.h"
#include "viewer/desktop/desk.h"

class QWidget;

namespace robomosp::viewer {

class MainWindow;

class Automation : public ioci::WindowHost {
 public:
  /// Makes it the window of the application. [GUI thread]
  static std::shared_ptr<Automation> install(MainWindow& window);
  /// Waiting callers end with an error. [GUI thread]
  static void remove(Automation& automation, ioci::Application& app);

  /// [any thread but the GUI's]
  Result<Value> act(std::string_view what, const Map& args, Progress& progress) override;
  /// The same without waiting; "settle" returns at once whether the window is settled.
  /// [GUI thread]
  Result<Value> act_here(std::string_view what, const Map& args);

 private:
  explicit Automation(MainWindow& window);
  /// Runs `call` on the GUI thread and waits for it.
  Result<Value> on_window(const std::function<Result<Value>()>& call, Progress& progress);
  Result<Value> wait_settled(double at_most, Progress& progress);
  [[nodiscard]] Result<QWidget*> find(const std::string& path) const;
  Result<Value> actions() const;
  Result<Value> trigger(const Map& args);
  Result<Value> open(const Map& args);
  Result<Value> set(const Map& args);
  Result<Value> set_keys(const Map& args);
  Result<Value> widgets(const Map& args) const;
  Result<Value> click(const Map& args);
  Result<Value> drag(const Map& args);
  Result<Value> type(const Map& args);
  Result<Value> read(const Map& args) const;
  Result<Value> select(const Map& args);
  Result<Value> show_member(const Map& args);
  Result<Value> fade_member(const Map& args);
  Result<Value> photograph(const Map& args) const;

  QPointer<QObject> window_;  ///< a MainWindow
  [[nodiscard]] MainWindow& window() const;
  std::mutex gate_;  ///< held while something is handed to the window, and while that leaves
  std::atomic<bool> is_gone_{false};
};

/// A picture of a widget with its views, as PNG. [GUI thread]
[[nodiscard]] Result<std::string> photograph_of(QWidget& widget);

}  // namespace robomosp::viewer
