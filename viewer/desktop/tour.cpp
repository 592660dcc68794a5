// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/tour.h"

#include <cstdio>
#include <string_view>

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
#include "viewer/forms/command_form.h"
#include "viewer/forms/command_palette.h"
#include "viewer/theme/theme.h"
#include "viewer/timeline/timeline.h"

namespace robomosp::viewer {
namespace {

constexpr int kTourPollMs = 40;
constexpr int kLongestStepMs = 60000;
constexpr double kTime = 3;  ///< of pictures of the motion [s]

/// The published circle made faster, with a way to it and from it, and torque limits of assumed
/// size, so that every band of the timeline has something to show.
constexpr const char* kMotion = R"(
way, arm = trajectory "circle", robot "pa10"
way:set_segment(1, {law = "s_curve", speed = "200 mm/s", acceleration = "400 mm/s^2"})
way:insert_segment(1, {shape = "line", law = "s_curve", speed = "250 mm/s",
  acceleration = "500 mm/s^2", points = {
    {0.558, 0.18, 0.8446, "180 deg", 0, "180 deg"}, {0.558, 0, 0.7346, "180 deg", 0, "180 deg"}}})
way:add_segment({shape = "line", law = "s_curve", speed = "300 mm/s",
  acceleration = "600 mm/s^2", points = {
    {0.558, 0, 0.7346, "180 deg", 0, "180 deg"},
    {0.558, -0.15, 0.8946, "180 deg", 0, "180 deg"}}})
way:set{sample_time = 0.02}
for i, most in ipairs{158, 86, 68, 68, 17, 17, 17} do
  record.set{id = arm, path = "links[" .. i .. "].max_force", value = most}
end)";

/// The link of the chapter on solids.
constexpr const char* kLink = R"(
link = solid.create{
  name = "arm_link", material = material "aluminium_6082",
  parameters = {length = "300 mm", bore = "42 mm", wall = "15 mm"},
  root = {kind = "difference", name = "body", children = {
    {kind = "union", name = "blank", children = {
      {kind = "cylinder", name = "hub", radius = "bore/2 + 2*wall", height = "60 mm"},
      {kind = "cylinder", name = "eye", radius = "bore/2 + wall", height = "60 mm",
       position = {"length", 0, 0}},
      {kind = "box", name = "web", x = "length", y = "bore + wall", z = "40 mm",
       position = {"length/2", 0, "10 mm"}}}},
    {kind = "cylinder", name = "hub_bore", radius = "bore/2", height = "70 mm",
     position = {0, 0, "-5 mm"}},
    {kind = "cylinder", name = "eye_bore", radius = "bore/2", height = "70 mm",
     position = {"length", 0, "-5 mm"}},
    {kind = "circular_pattern", name = "bolts", count = 6, children = {
      {kind = "cylinder", name = "bolt", radius = "3 mm", height = "70 mm",
       position = {"bore/2 + wall", 0, "-5 mm"}}}}}}})";

}  // namespace

Tour::Tour(MainWindow& window, std::string folder, QSize size, std::vector<std::string> only,
           std::function<void(const Result<void>&)> done)
    : QObject(&window),
      window_(window),
      folder_(std::move(folder)),
      size_(size),
      only_(std::move(only)),
      done_(std::move(done)) {
  const bool has_all = only_.empty();
  for (const double zoom : {1.0, 1.5})
    for (const bool is_dark : {true, false}) {
      const std::size_t first = steps_.size();
      add_round(is_dark, zoom);
      if (!has_all) keep_wanted(first);
    }
  connect(&timer_, &QTimer::timeout, this, [this] { next(); });
  timer_.start(kTourPollMs);
  since_.start();
}

void Tour::keep_wanted(std::size_t first) {
  std::size_t end = first;
  bool is_wanted = false;
  for (std::size_t i = first; i < steps_.size(); ++i) {
    if (!steps_[i].picture.empty()) {
      is_wanted = std::erase(only_, steps_[i].picture) > 0;
      if (!is_wanted) steps_[i].picture.clear();
    }
    if (is_wanted) end = i + 1;  // also what puts away the thing that was photographed
  }
  steps_.resize(end);
}

/// Opens the rows of the navigator along a path of their texts.
void Tour::expand(const QStringList& rows) {
  QTreeView& tree = window_.navigator().tree();
  const QAbstractItemModel& model = *tree.model();
  QModelIndex at;
  for (const QString& row : rows) {
    QModelIndex found;
    for (int i = 0; i < model.rowCount(at) && !found.isValid(); ++i)
      if (const QModelIndex each = model.index(i, 0, at); each.data().toString() == row)
        found = each;
    if (!found.isValid()) return;
    tree.expand(found);
    at = found;
  }
}

void Tour::add_round(bool is_dark, double zoom) {
  const std::string suffix = std::string(is_dark ? "-dark" : "-light") + (zoom > 1 ? "-150" : "");
  const auto photo = [&](const std::string& name, std::function<void()> act) {
    steps_.push_back({name + suffix, std::move(act)});
  };
  const auto run = [this](const char* lua) { window_.console().run(lua); };
  const auto clear = [this, run] {
    while (window_.current_view()) window_.actions().find("close_tab")->trigger();
    run("document.clear()");
  };
  add_act([this, is_dark, zoom, clear] {
    clear();
    window_.resize(size_);
    window_.set_theme_and_zoom(is_dark, zoom);
    window_.set_workspace(Workspace::motion);
    window_.reset_layout();
  });
  photo("start", [this] { window_.show_start(); });
  add_motion(photo);
  // A solid with its tree of nodes and its dimensions.
  add_act(clear);
  add_act([this] {
    window_.set_workspace(Workspace::model);
    window_.reset_layout();
  });
  add_act([run] { run(kLink); });
  add_act([run] { run("link:mass().mass"); });
  const auto open_record = [this](const char* kind, const char* name) {
    window_.desk().ask(std::string(kind) + ".get", {{"name", name}},
                       [this, name](const Result<Value>& r) {
                         const Handle* record = r.ok() ? r->as_handle() : nullptr;
                         if (!record) return;
                         window_.open_view(*record, name);
                         window_.desk().select({{*record, {}}});
                         window_.navigator().open_parts_of(*record);
                       });
  };
  add_act([open_record] { open_record("solid", "arm_link"); });
  add_act([this] {
    if (ViewTab* view = window_.current_view())
      window_.desk().select({{view->what(), "nodes.hub_bore"}});
    for (const QStringList& rows : {QStringList{"Solids", "arm_link", "body"},
                                    {"Solids", "arm_link", "body", "blank"},
                                    {"Solids", "arm_link", "body", "bolts"}})
      expand(rows);
  });
  photo("model", [this] {
    look_at([](ViewLook& look) { look.layers = {"dimensions", "centres_of_mass"}; });
  });
  add_act(clear);
  add_act([this] {
    window_.set_workspace(Workspace::robot);
    window_.reset_layout();
  });
  add_act([open_record] { open_record("robot", "puma560"); });
  photo("robot", [this, run] {
    look_at([](ViewLook& look) { look.layers = {"frames"}; });
    window_.show_panel("console");
    run("robot(\"puma560\"):overview()");
  });
  add_act([this] {
    look_at([](ViewLook& look) { look.layers.clear(); });
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

void Tour::look_at(const std::function<void(ViewLook&)>& change) {
  ViewTab* view = window_.current_view();
  if (!view) return;
  ViewLook look = view->look();
  change(look);
  view->set_look(look);
}

/// A robot on its trajectory: alone, in four views, with overlays, over time, in the palette and on
/// a small screen.
void Tour::add_motion(const std::function<void(const std::string&, std::function<void()>)>& photo) {
  const auto select_path = [this](const char* kind, const char* path) {
    return [this, kind, path] {
      ViewTab* view = window_.current_view();
      if (!view) return;
      if (std::string_view(kind) == "world") return window_.desk().select({{view->what(), path}});
      window_.desk().ask(std::string(kind) + ".get", {{"name", "circle"}},
                         [this, path](const Result<Value>& r) {
                           if (const Handle* h = r.ok() ? r->as_handle() : nullptr)
                             window_.desk().select({{*h, path}});
                         });
    };
  };
  const auto set_time = [this](double time) {
    return [this, time] {
      ViewTab* view = window_.current_view();
      if (!view) return;
      view->player().play(false);
      view->player().set_time(time);
    };
  };
  add_act([this] {
    ioci::OpenRequest request;
    request.what = "pa10_circle";
    request.simulates = false;
    window_.open(std::move(request), false);
  });
  add_act([this] { window_.console().run(kMotion); });
  // Torques and speeds, with segments, limits and clearance.
  add_act([this] {
    window_.console().run(
        "run = world \"pa10_circle\":inverse_dynamics{robot = \"pa10\", trajectory = "
        "\"circle\", clearance = true}");
  });
  add_act([this] {
    window_.desk().ask("recording.list", {}, [this](const Result<Value>& r) {
      if (!r.ok() || list_of(*r).empty()) return;
      if (const auto run = handle_at(map_of(list_of(*r).back()), "recording"))
        window_.timeline().on_open(*run);
    });
  });
  add_act(set_time(kTime));
  add_act([this] {
    expand({"pa10_circle", "pa10"});
    expand({"pa10_circle", "circle"});
    expand({"pa10_circle", "Objects"});
    look_at([](ViewLook& look) { look.layers = {"path_speeds"}; });
    window_.show_panel("timeline");
  });
  photo("motion", select_path("world", "robots.pa10"));
  photo("four_views", [this] { look_at([](ViewLook& look) { look.has_four_views = true; }); });
  photo("overlays", [this] {
    look_at([](ViewLook& look) {
      look.has_four_views = false;
      look.layers = {"centres_of_mass", "path_speeds", "velocity_ellipsoids"};
    });
  });
  photo("stereo", [this] {
    look_at([](ViewLook& look) {
      look.layers.clear();
      look.stereo.mode = Stereo::anaglyph;
    });
  });
  add_act([this] {
    look_at([](ViewLook& look) {
      look.stereo = {};
      look.layers = {"path_speeds"};
    });
  });
  photo("timeline", select_path("trajectory", "segments.2"));
  add_act([this] {
    window_.palette().open("invdyn");
    window_.palette().open_command(
        "world.inverse_dynamics",
        {{"id", "pa10_circle"}, {"robot", "pa10"}, {"trajectory", "circle"}, {"clearance", true}});
  });
  add_act([this] { window_.palette().form()->run(); });
  photo("palette", [] {});
  add_act([this] { window_.palette().hide(); });
  // A small screen.
  add_act(select_path("world", "robots.pa10"));
  photo("small", [this] { window_.resize(QSize(1366, 768).boundedTo(size_)); });
  add_act([this] { window_.resize(size_); });
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
  if (at_ >= steps_.size()) {
    if (only_.empty()) return finish({});
    return finish(error(ErrorCode::unknown_name, "the tour has no picture \"" + only_[0] + "\"",
                        "Names are such as motion-dark, start-light or small-dark-150.",
                        "--tour-pictures"));
  }
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
  if (settled_ < 4)
    std::fprintf(stderr, "warning: step %zu of the tour%s%s is not finished after %d s\n", at_ + 1,
                 step.picture.empty() ? "" : ", ", step.picture.c_str(), kLongestStepMs / 1000);
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
