// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/desktop.h"

#include <algorithm>
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <utility>

#include <QApplication>
#include <QElapsedTimer>
#include <QFile>
#include <QTemporaryDir>
#include <QTimer>

#include "viewer/desktop/automation.h"
#include "viewer/desktop/desk.h"
#include "viewer/desktop/end_signals.h"
#include "viewer/desktop/main_window.h"
#include "viewer/desktop/messages.h"
#include "viewer/desktop/start_times.h"
#include "viewer/desktop/tour.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/style_images.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr int kPollMs = 30;
constexpr int kScreenshotAfterMs = 1000;
constexpr int kLongestWaitMs = 90000;
constexpr int kCheckSettingsAfterMs = 2500;
constexpr const char* kSafeMode =
    "Safe mode: the settings and layouts of the user are left out and stay as they are, plugins "
    "that are not part of the program are not loaded, and pictures are drawn by software.";

int refused(const Error& reason) {
  std::fprintf(stderr, "error: %s\n", reason.sentence().c_str());
  return reason.code == ErrorCode::io || reason.code == ErrorCode::internal ||
                 reason.code == ErrorCode::unsupported
             ? 1
             : 3;
}

std::unique_ptr<QApplication> new_application() {
  static int count = 1;
  static char name[] = "robomosp-desktop";
  static char* arguments[] = {name, nullptr};
  auto application = std::make_unique<QApplication>(count, arguments);
  QApplication::setApplicationName("robomosp-desktop");
  QApplication::setApplicationDisplayName("ROBOMOSP");
  // Qt takes the locale of the system; numbers in files must not follow it.
  std::setlocale(LC_NUMERIC, "C");
  return application;
}

/// What the command line says about the first view.
void show_as_wished(ViewTab& view, const DesktopOptions& options) {
  ViewLook look = view.look();
  look.style = options.style;
  look.has_edges = options.has_edges;
  look.has_hidden_edges = options.has_hidden_edges;
  look.is_perspective = options.camera.perspective;
  if (options.camera.view != Camera::View::custom) look.view = options.camera.view;
  look.layers = options.layers;
  view.set_look(look);
  view.start_from(options.camera);
  if (options.explode > 0) view.live().explode(options.explode);
  if (options.at && view.recording()) {
    if (*options.at > view.player().to())
      std::fprintf(stderr, "warning: --at: the motion takes %g s, and its end is shown.\n",
                   view.player().to());
    view.player().play(false);
    view.player().set_time(*options.at);
  }
  if (options.map.empty()) return;
  const Handle what = view.what();
  (void)view.live().compute_map(what, options.map, options.map_robot,
                                [&view, options](const Result<Value>& r) {
                                  if (!r.ok()) return;
                                  Map map{{"recording", *r}, {"opacity", options.map_opacity}};
                                  if (!options.map_cut.empty()) map.set("cut", options.map_cut);
                                  if (!options.map_robot.empty())
                                    map.set("robot", options.map_robot);
                                  (void)view.live().show_map(std::move(map));
                                });
}

/// Photographs the window once it has been settled for a while, and ends.
class Photographer : public QObject {
 public:
  Photographer(MainWindow& window, std::string file, int& status)
      : QObject(&window), window_(window), file_(std::move(file)), status_(status) {
    connect(&timer_, &QTimer::timeout, this, [this] { look(); });
    timer_.start(kPollMs);
    since_.start();
  }

 private:
  void look() {
    settled_ = window_.is_settled() ? settled_ + 1 : 0;
    const bool is_ready = settled_ > 3 && since_.elapsed() > kScreenshotAfterMs;
    if (!is_ready && since_.elapsed() < kLongestWaitMs) return;
    timer_.stop();
    const auto png = photograph_of(window_);
    QFile file(shown(file_));
    if (!png.ok()) {
      status_ = refused(png.error());
    } else if (!file.open(QIODevice::WriteOnly) ||
               file.write(png->data(), static_cast<qint64>(png->size())) < 0) {
      status_ = refused(error(ErrorCode::io, "cannot write the picture \"" + file_ + "\"",
                              "Check that the folder exists and may be written."));
    }
    window_.close_now();
  }
  MainWindow& window_;
  std::string file_;
  int& status_;
  int settled_ = 0;
  QTimer timer_;
  QElapsedTimer since_;
};

}  // namespace

int run_desktop(ioci::Application& app, DesktopOptions options) {
  std::unique_ptr<QApplication> application;
  if (QCoreApplication::instance() == nullptr) application = new_application();
  StartTimes unused;
  StartTimes& times = options.start_times ? *options.start_times : unused;
  times.reached("Qt started");
  // In safe mode, and for pictures of the window, a file that is gone afterwards. A screenshot has
  // the theme and layout of the user.
  std::optional<QTemporaryDir> folder;
  QString settings_file;
  const bool ends_by_itself = !options.screenshot.empty() || !options.tour.empty();
  if (options.is_safe || ends_by_itself) {
    settings_file = folder.emplace().filePath("desktop.ini");
    if (!options.is_safe && options.tour.empty())
      QFile::copy(Settings::file_of_user(), settings_file);
  }
  auto* const running = qobject_cast<QApplication*>(QCoreApplication::instance());
  {
    const Settings settings(settings_file);
    set_theme(*running,
              make_theme(settings.is_dark(), settings.zoom(), settings.has_strong_borders()));
  }
  times.reached("theme set");
  auto desk = Desk::open(app, options.plugin_path);
  if (!desk.ok()) return refused(desk.error());
  times.reached("session opened");
  int status = 0;
  {
    MainWindow::Options wanted;
    wanted.settings_file = settings_file;
    wanted.software_view = options.software_view;
    wanted.is_safe = options.is_safe;
    wanted.has_whole_start = true;
    if (options.is_safe) {
      app.messages.post(Severity::info, "safe_mode", kSafeMode, "desktop");
      std::fprintf(stderr, "robomosp-desktop: %s\n", kSafeMode);
    }
    MainWindow window(**desk, std::move(wanted));
    times.reached("window built");
    for (const Message& m : app.messages.recent())
      if (m.severity >= Severity::info && m.code != "audit")
        window.messages().add(m.severity, shown(m.text), m.fault);
    if (options.size[0] > 0) window.resize(options.size[0], options.size[1]);
    bool is_first = true;
    for (ioci::OpenRequest& request : options.open) {
      const bool plays = request.simulates && !options.at;
      window.open(std::move(request), plays,
                  [&options, is_first = std::exchange(is_first, false)](ViewTab& view) {
                    if (is_first) show_as_wished(view, options);
                  });
    }
    if (ends_by_itself)
      (*desk)->failed.add(&window, [&](const Error& e) {
        status = refused(e);
        if (options.tour.empty()) window.close_now();
      });
    bool has_reported = false;
    const auto check_settings = [&app, &has_reported, &settings_file] {
      if (has_reported) return;
      const auto problem = Settings(settings_file).write();
      if (!problem) return;
      has_reported = true;
      app.messages.post(Severity::warning, "settings", problem->sentence(), "desktop");
    };
    // Not while the start is waited for.
    QTimer::singleShot(kCheckSettingsAfterMs, &window, check_settings);
    window.show();
    const EndSignals end_signals([&](int signal) {
      // Unsaved work is kept for the next start, which offers it.
      if (!app.unsaved().empty())
        if (const auto kept = app.keep_unsaved(0); !kept.ok())
          std::fprintf(stderr, "warning: %s\n", kept.error().sentence().c_str());
      window.end_now();
      remove_style_images();
      folder.reset();
      std::fprintf(stderr, "robomosp-desktop: ended by signal %d\n", signal);
      std::_Exit(128 + signal);
    });
    times.reached("window shown");
    std::unique_ptr<StartWatch> watch;
    if (options.start_times) watch = std::make_unique<StartWatch>(window, times);
    if (!options.screenshot.empty()) new Photographer(window, options.screenshot, status);
    if (!options.tour.empty())
      new Tour(window, options.tour,
               options.size[0] > 0 ? QSize(options.size[0], options.size[1]) : QSize(1600, 1000),
               options.tour_pictures, [&](const Result<void>& r) {
                 if (!r.ok()) status = refused(r.error());
                 window.close_now();
               });
    QApplication::exec();
    check_settings();
  }
  desk->reset();
  return status;
}

}  // namespace robomosp::viewer
