// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/window/graphics_report.h"

#include <memory>

#include <QDir>
#include <QFontDatabase>
#include <QGuiApplication>
#include <QLibraryInfo>
#include <QScreen>

#include "viewer/scene/offscreen.h"
#include "viewer/window/window_opengl.h"

namespace robomosp::viewer {
std::string graphics_report(bool has_display) {
  std::string out = "  Qt " + std::string(qVersion()) + "\n";
  std::unique_ptr<QGuiApplication> application;
  static int count = 1;
  static char name[] = "robomosp-desktop";
  static char* arguments[] = {name, nullptr};
  if (!has_display) qputenv("QT_QPA_PLATFORM", "offscreen");
  if (!QCoreApplication::instance())
    application = std::make_unique<QGuiApplication>(count, arguments);
  const QString platform = QGuiApplication::platformName();
  if (has_display) {
    out += "  display: platform " + platform.toStdString();
    for (const QScreen* screen : QGuiApplication::screens())
      out += ", screen " + std::to_string(screen->size().width()) + " x " +
             std::to_string(screen->size().height()) + " at " +
             QString::number(screen->devicePixelRatio()).toStdString();
    out += "\n";
  } else {
    out += "  missing: a display; pictures can be drawn into files (--render)\n";
  }
  if (platform == "xcb" || platform.startsWith("wayland")) {
    const WindowOpenGl window = window_opengl();
    out += window.renderer.isEmpty()
               ? "  missing: OpenGL in windows; the window draws through EGL instead\n"
               : "  OpenGL in windows: " + window.renderer.toStdString() + ", OpenGL " +
                     window.version.toStdString() + "\n";
  }
  const auto egl = OffscreenRenderer::create(64, 64, Quality::fast);
  out += egl.ok() ? "  OpenGL through EGL: " + egl->renderer_name() + "\n"
                  : "  missing: OpenGL through EGL: " + egl.error().sentence() + "\n";
  const QStringList families = QFontDatabase::families();
  for (const auto& [family, instead] :
       {std::pair{"Inter", "DejaVu Sans"}, std::pair{"JetBrains Mono", "DejaVu Sans Mono"}})
    out += families.contains(family)
               ? "  font: " + std::string(family) + "\n"
               : "  missing: the font " + std::string(family) + "; " + instead + " is used\n";
  const QString plugins = QLibraryInfo::path(QLibraryInfo::PluginsPath);
  out += "  plugins of Qt: " + plugins.toStdString() + ", platforms " +
         QDir(plugins + "/platforms")
             .entryList({"*.so"}, QDir::Files)
             .replaceInStrings("libq", "")
             .replaceInStrings(".so", "")
             .join(", ")
             .toStdString() +
         "\n";
  return out;
}

}  // namespace robomosp::viewer
