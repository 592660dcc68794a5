// SPDX-License-Identifier: GPL-3.0-or-later
// A window of the desktop on an application, for tests and benchmarks that drive it.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <utility>

#include <QApplication>
#include <QMouseEvent>
#include <QTemporaryDir>
#include <QTest>

#include "ioci/client/window_program.h"
#include "viewer/desktop/desk.h"
#include "viewer/desktop/main_window.h"
#include "viewer/desktop/values.h"

namespace robomosp::viewer {

/// A session beside the window's, as another program or a remote client has.
class OtherSession {
 public:
  explicit OtherSession(ioci::Application& app, std::string name = "other")
      : app_(app), session_(std::move(name)) {}
  Result<Value> call(const std::string& command, const Map& args) {
    return app_.dispatch(session_, command, args);
  }

 private:
  ioci::Application& app_;
  ioci::Session session_;
};

/// The application of a window, with the plugins and the library of this build, or with a copy of
/// the library.
inline std::unique_ptr<ioci::Application> start_program(
    bool keeps_unsaved = false,
    const std::filesystem::path& library = std::filesystem::path(ROBOMOSP_SOURCE_DIR) /
                                           "scripts/library") {
  ioci::WindowProgramOptions options;
  options.plugin_path = {ROBOMOSP_PLUGIN_DIR};
  options.library = {library};
  options.keeps_unsaved = keeps_unsaved;
  auto made = ioci::start_window_program(std::move(options));
  if (!made.ok()) {
    std::cerr << made.error().sentence() << '\n';
    std::abort();
  }
  return std::move(*made);
}

/// A window with its own session and settings.
class WindowHarness {
 public:
  /// Fine pictures, the stills of views at rest, take long on software OpenGL.
  explicit WindowHarness(ioci::Application& app, QSize size = {1200, 800},
                         bool has_fine_pictures = false)
      : app_(app) {
    auto made = Desk::open(app, {});
    if (!made.ok()) {
      std::cerr << made.error().sentence() << '\n';
      std::abort();
    }
    desk_ = std::move(*made);
    Settings(folder_.filePath("desktop.ini")).set_fine_pictures(has_fine_pictures);
    window_ = std::make_unique<MainWindow>(
        *desk_, MainWindow::Options{folder_.filePath("desktop.ini"), false});
    window_->resize(size);
    window_->show();
    QApplication::setActiveWindow(window_.get());
  }
  ~WindowHarness() {
    window_->close_now();
    window_.reset();
    desk_.reset();
  }
  WindowHarness(const WindowHarness&) = delete;
  WindowHarness& operator=(const WindowHarness&) = delete;

  [[nodiscard]] ioci::Application& app() const { return app_; }
  [[nodiscard]] Desk& desk() const { return *desk_; }
  [[nodiscard]] MainWindow& window() const { return *window_; }
  [[nodiscard]] QString file(const QString& name) const { return folder_.filePath(name); }

  static bool until(const std::function<bool()>& is_so, int patience_ms = 60000) {
    return QTest::qWaitFor(is_so, patience_ms);
  }
  /// False if the window does not come to rest.
  bool settle(int patience_ms = 60000) {
    int settled = 0;
    return until(
        [&] {
          settled = window_->is_settled() && !desk_->has_calls() ? settled + 1 : 0;
          return settled > 3;
        },
        patience_ms);
  }
  /// The result of a command in the window's session.
  Result<Value> call(const std::string& command, Map args) {
    const auto answer = desk_->ask(command, std::move(args), {});
    if (!until([&] { return answer.result() != nullptr; }))
      return error(ErrorCode::internal, command + " did not end");
    return *answer.result();
  }
  /// The record that a command makes; aborts if it makes none.
  Handle made(const std::string& command, Map args) {
    const auto r = call(command, std::move(args));
    if (r.ok() && r->as_handle()) return *r->as_handle();
    std::cerr << command << ": " << (r.ok() ? "no record" : r.error().sentence()) << '\n';
    std::abort();
  }

 private:
  ioci::Application& app_;
  QTemporaryDir folder_;
  std::unique_ptr<Desk> desk_;
  std::unique_ptr<MainWindow> window_;
};

/// Moves the mouse with a button held, without QTest, which waits for the real mouse.
inline void move_mouse(QWidget& widget, QPointF at, Qt::MouseButtons buttons = Qt::LeftButton,
                       Qt::KeyboardModifiers keys = {}) {
  QMouseEvent move(QEvent::MouseMove, at, widget.mapToGlobal(at), Qt::NoButton, buttons, keys);
  QApplication::sendEvent(&widget, &move);
}

}  // namespace robomosp::viewer
