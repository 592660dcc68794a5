// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/tour.h"

#include <cmath>

#include <QDir>
#include <QFile>
#include <QLineEdit>
#include <QTreeView>

#include "viewer/desktop/automation.h"
#include "viewer/desktop/console.h"
#include "viewer/desktop/main_window.h"
#include "viewer/desktop/messages.h"
#include "viewer/desktop/navigator.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr int kTourPollMs = 40;
constexpr int kLongestStepMs = 60000;

}  // namespace

Tour::Tour(MainWindow& window, std::string folder, std::function<void(const Result<void>&)> done)
    : QObject(&window), window_(window), folder_(std::move(folder)), done_(std::move(done)) {
  for (const double zoom : {1.0, 1.5})
    for (const bool is_dark : {true, false}) add_round(is_dark, zoom);
  connect(&timer_, &QTimer::timeout, this, [this] { next(); });
  timer_.start(kTourPollMs);
  since_.start();
}

void Tour::add_round(bool is_dark, double zoom) {
  const std::string suffix = std::string(is_dark ? "-dark" : "-light") + (zoom > 1 ? "-150" : "");
  const auto photo = [&](const std::string& name, std::function<void()> act) {
    steps_.push_back({name + suffix, std::move(act)});
  };
  const auto open = [this](const char* what, bool plays) {
    ioci::OpenRequest request;
    request.what = what;
    request.simulates = plays;
    window_.open(std::move(request), plays);
  };
  add_act([this, is_dark, zoom] {
    window_.resize(1600, 1000);
    window_.set_theme_and_zoom(is_dark, zoom);
    window_.set_workspace(Workspace::motion);
    window_.reset_layout();
  });
  photo("start", [this] { window_.show_start(); });
  add_act([open] { open("pa10_circle", true); });
  add_act([this] {
    if (ViewTab* view = window_.current_view()) {
      view->player().play(false);
      view->player().set_time(3);
    }
  });
  photo("motion", [this] { window_.show_panel("timeline"); });
  add_act([this] {
    window_.set_workspace(Workspace::model);
    window_.reset_layout();
  });
  photo("model", [open] { open("strain_wave_gear", false); });
  add_act([this] {
    window_.set_workspace(Workspace::robot);
    window_.reset_layout();
  });
  add_act([open] { open("puma560", false); });
  photo("robot", [this] {
    if (ViewTab* view = window_.current_view()) {
      ViewLook look = view->look();
      look.layers = {"frames"};
      view->set_look(look);
    }
    window_.show_panel("console");
    window_.console().run("robot(\"puma560\"):overview()");
  });
  add_act([this] {
    if (ViewTab* view = window_.current_view()) {
      ViewLook look = view->look();
      look.layers.clear();
      view->set_look(look);
    }
    window_.set_workspace(Workspace::program);
    window_.reset_layout();
  });
  photo("messages", [this] {
    window_.show_panel("messages");
    window_.messages().add(Severity::info, "A message reports what was done.");
  });
  photo("search", [this] {
    window_.show_panel("navigator");
    window_.navigator().focus_search();
    if (auto* field = window_.findChild<QLineEdit*>("navigator_search")) field->setText("tool");
  });
  add_act([this] {
    if (auto* field = window_.findChild<QLineEdit*>("navigator_search")) field->clear();
  });
}

void Tour::next() {
  if (at_ >= steps_.size()) return finish({});
  Step& step = steps_[at_];
  if (!has_acted_) {
    has_acted_ = true;
    settled_ = 0;
    since_.restart();
    step.act();
    return;
  }
  settled_ = window_.is_settled() ? settled_ + 1 : 0;
  if (settled_ < 4 && since_.elapsed() < kLongestStepMs) return;
  if (!step.picture.empty()) {
    if (!QDir().mkpath(shown(folder_)))
      return finish(error(ErrorCode::io, "the folder \"" + folder_ + "\" cannot be made",
                          "Choose another one.", "--tour"));
    const auto png = photograph_of(window_);
    if (!png.ok()) return finish(png.error());
    QFile file(shown(folder_ + "/" + step.picture + ".png"));
    if (!file.open(QIODevice::WriteOnly) ||
        file.write(png->data(), static_cast<qint64>(png->size())) !=
            static_cast<qint64>(png->size()))
      return finish(error(ErrorCode::io, "cannot write \"" + utf8(file.fileName()) + "\"",
                          "Check that the folder may be written.", "--tour"));
  }
  ++at_;
  has_acted_ = false;
}

void Tour::finish(const Result<void>& result) {
  timer_.stop();
  if (done_) done_(result);
}

}  // namespace robomosp::viewer
