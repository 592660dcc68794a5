// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/window/window.h"

#include <algorithm>
#include <clocale>
#include <cmath>
#include <cstdio>
#include <memory>

#include <QAction>
#include <QApplication>
#include <QElapsedTimer>
#include <QPainter>
#include <QTimer>

#include "viewer/window/display.h"
#include "viewer/window/theme.h"
#include "viewer/window/viewer_window.h"

namespace robomosp::viewer {
namespace {

int refuse(const Error& reason) {
  std::fprintf(stderr, "%s\n", reason.sentence().c_str());
  return 1;
}

/// Qt ends the whole program if it finds no display; ask first.
bool has_display() {
  return qEnvironmentVariableIsSet("DISPLAY") || qEnvironmentVariableIsSet("WAYLAND_DISPLAY") ||
         qEnvironmentVariableIsSet("QT_QPA_PLATFORM");
}

std::unique_ptr<QApplication> make_application() {
  static int count = 1;
  static char name[] = "robomosp";
  static char* arguments[] = {name, nullptr};
  auto application = std::make_unique<QApplication>(count, arguments);
  // Qt takes the locale of the system; numbers in files must not follow it.
  std::setlocale(LC_NUMERIC, "C");
  apply_dark_theme(*application);
  return application;
}

Result<void> save_window(ViewerWindow& window, const std::string& path) {
  // The OpenGL part of a grabbed window may be missing; paint it in from its own framebuffer.
  QImage picture = window.grab().toImage();
  QPainter painter(&picture);
  Display& display = window.display();
  painter.drawImage(QRect(display.mapTo(&window, QPoint(0, 0)), display.size()), display.shown());
  painter.end();
  if (picture.save(QString::fromStdString(path), "PNG")) return {};
  return error(ErrorCode::io, "cannot write the picture \"" + path + "\"",
               "Check that the folder exists and may be written.");
}

}  // namespace

int run_window(const Frame& frame, const Playback& playback, const WindowOptions& options) {
  if (QCoreApplication::instance() == nullptr && !has_display()) {
    return refuse(error(ErrorCode::unsupported,
                        "cannot open a window, because there is no display: neither DISPLAY nor "
                        "WAYLAND_DISPLAY is set",
                        "Start the program in a desktop session, or draw the picture into a file "
                        "instead."));
  }
  std::unique_ptr<QApplication> application;
  if (QCoreApplication::instance() == nullptr) application = make_application();

  auto display = Display::create(options.quality, options.software_view);
  if (!display) return refuse(display.error());
  ViewerWindow window(std::move(display).value());
  window.setWindowTitle(QString::fromStdString(options.title));
  window.resize(std::clamp(options.width, 480, 16000), std::clamp(options.height, 360, 16000));
  window.on_pick = options.on_pick;
  window.set_frame(frame);
  window.set_playback(playback);
  window.set_speed(options.speed);
  if (auto* refine = window.findChild<QAction*>("refine")) refine->setChecked(options.refine);
  window.show();
  if (options.play) window.play(true);

  int status = 0;
  const double after = std::isfinite(options.screenshot_after) ? options.screenshot_after : 0;
  QElapsedTimer shown;
  QTimer watch;
  QObject::connect(&watch, &QTimer::timeout, &window, [&] {
    if (window.display().pictures_drawn() == 0) return;
    if (!shown.isValid()) {
      shown.start();
      if (options.on_shown) options.on_shown(window);
      if (options.screenshot.empty()) watch.stop();
      return;
    }
    const double waited = 1e-3 * static_cast<double>(shown.elapsed());
    if (waited < after) return;
    const bool may_improve = options.refine && !window.is_playing() && waited < after + 60;
    if (may_improve && !window.display().is_refined()) return;
    watch.stop();
    if (const auto saved = save_window(window, options.screenshot); !saved)
      status = refuse(saved.error());
    window.close();
  });
  watch.start(20);
  QApplication::exec();
  return status;
}

}  // namespace robomosp::viewer
