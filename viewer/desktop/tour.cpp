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
#include "viewer/desktop/stories.h"
#include "viewer/desktop/values.h"
#include "viewer/desktop/widget_page.h"
#include "viewer/forms/command_palette.h"
#include "viewer/theme/theme.h"
#include "viewer/timeline/timeline.h"

namespace robomosp::viewer {
namespace {

constexpr int kTourPollMs = 40;
constexpr int kLongestStepMs = 60000;

}  // namespace

Tour::Tour(MainWindow& window, std::string folder, QSize size,
           std::function<void(const Result<void>&)> done)
    : QObject(&window),
      window_(window),
      folder_(std::move(folder)),
      size_(size),
      done_(std::move(done)) {
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
    window_.resize(size_);
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
  const auto look_at = [this](const std::function<void(ViewLook&)>& change) {
    ViewTab* view = window_.current_view();
    if (!view) return;
    ViewLook look = view->look();
    change(look);
    view->set_look(look);
  };
  photo("four_views", [look_at] { look_at([](ViewLook& look) { look.has_four_views = true; }); });
  photo("overlays", [look_at] {
    look_at([](ViewLook& look) {
      look.has_four_views = false;
      look.layers = {"centres_of_mass", "path_speeds", "velocity_ellipsoids"};
    });
  });
  photo("stereo", [look_at] {
    look_at([](ViewLook& look) {
      look.layers.clear();
      look.stereo.mode = Stereo::anaglyph;
    });
  });
  add_act([look_at] { look_at([](ViewLook& look) { look.stereo = {}; }); });
  // Torques and speeds, with segments, limits and clearance.
  add_act([this] {
    window_.console().run(
        "tour_run = world(\"pa10_circle\"):inverse_dynamics{robot = \"pa10\", trajectory = "
        "\"circle\", sample_time = 0.2, clearance = true}; return tour_run");
  });
  add_act([this] {
    window_.desk().ask("recording.list", {}, [this](const Result<Value>& r) {
      if (!r.ok() || list_of(*r).empty()) return;
      if (const auto run = handle_at(map_of(list_of(*r).back()), "recording"))
        window_.timeline().on_open(*run);
    });
  });
  add_act([this] {
    if (ViewTab* view = window_.current_view()) view->player().set_time(20);
  });
  photo("timeline", [] {});
  add_act([this] {
    if (ViewTab* view = window_.current_view()) window_.desk().select({{view->what(), {}}});
  });
  photo("palette", [this] { window_.palette().open_command("world.check_path"); });
  add_act([this] { window_.palette().hide(); });
  // A small screen.
  photo("small", [this] { window_.resize(QSize(1366, 768).boundedTo(size_)); });
  add_act([this] { window_.resize(size_); });
  add_act([this] {
    window_.set_workspace(Workspace::model);
    window_.reset_layout();
  });
  photo("model", [open] { open("strain_wave_gear", false); });
  add_act([this] {
    window_.set_workspace(Workspace::robot);
    window_.reset_layout();
  });
  add_act([this] {
    window_.desk().ask("robot.get", {{"name", "puma560"}}, [this](const Result<Value>& r) {
      if (const Handle* robot = r.ok() ? r->as_handle() : nullptr) {
        window_.open_view(*robot, "puma560");
        window_.desk().select({{*robot, {}}});
      }
    });
  });
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
  photo("story", [this] {
    if (const Story* story = story_named("solid")) window_.begin_story(*story, true);
  });
  photo("help", [this] { window_.show_page("user/solids.md"); });
  photo("connections", [this] { window_.show_panel("connections"); });
  photo("shortcuts", [this] { window_.show_panel("shortcuts"); });
  photo("search", [this] {
    window_.show_panel("navigator");
    window_.navigator().focus_search();
    if (auto* field = window_.findChild<QLineEdit*>("navigator_search")) field->setText("tool");
  });
  add_act([this] {
    if (auto* field = window_.findChild<QLineEdit*>("navigator_search")) field->clear();
  });
  add_widgets(suffix);
}

void Tour::add_widgets(const std::string& suffix) {
  steps_.push_back({"widgets" + suffix,
                    [this] {
                      widgets_ = new WidgetPage(&window_);
                      widgets_->lower();
                      widgets_->show();
                    },
                    &widgets_});
  add_act([this] { delete widgets_; });
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
  const bool waits = window_.desk().has_calls() ||
                     (window_.palette().isVisible() && !window_.palette().has_form());
  settled_ = window_.is_settled() && !waits ? settled_ + 1 : 0;
  if (settled_ < 4 && since_.elapsed() < kLongestStepMs) return;
  if (!step.picture.empty()) {
    if (!QDir().mkpath(shown(folder_)))
      return finish(error(ErrorCode::io, "the folder \"" + folder_ + "\" cannot be made",
                          "Choose another one.", "--tour"));
    const auto png = step.of && *step.of ? photograph_of(**step.of) : photograph_of(window_);
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
