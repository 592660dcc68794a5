// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/view_tab.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include <QEvent>
#include <QHBoxLayout>
#include <QLabel>
#include <QMenu>
#include <QToolBar>
#include <QToolButton>
#include <QVBoxLayout>

#include "kernel/text.h"
#include "scene/extras.h"
#include "scene/frame.h"
#include "scene/origin.h"
#include "viewer/desktop/actions.h"
#include "viewer/desktop/dragging.h"
#include "viewer/desktop/values.h"
#include "viewer/desktop/view_info.h"
#include "viewer/gizmo/hover.h"
#include "viewer/gizmo/measuring.h"
#include "viewer/gizmo/picking.h"
#include "viewer/gizmo/tool_bar.h"
#include "viewer/gizmo/view_tools.h"
#include "viewer/scene/linear.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/number_fields.h"

namespace robomosp::viewer {
namespace {

constexpr const char* kStyleWords[] = {"smooth", "flat", "wireframe", "hidden_line"};
constexpr double kWordsInBar = 1030;  ///< width of a view [px of the design]
constexpr const char* kAxisWords[] = {"x", "y", "z"};
/// By scene::ShownPath.
constexpr const char* kPathWords[] = {"none", "line", "arrows", "points", "frames"};

/// Least and greatest coordinates of all items, {} without any.
std::array<Vec3, 2> box_of_items(const viewer::Frame& frame) {
  constexpr double kFar = std::numeric_limits<double>::max();
  std::array<Vec3, 2> box{Vec3{kFar, kFar, kFar}, Vec3{-kFar, -kFar, -kFar}};
  for (const Item& item : frame.items) {
    if (!item.mesh) continue;
    const auto& p = item.mesh->positions;
    for (std::size_t v = 0; v + 2 < p.size(); v += 3) {
      const Vec3 at =
          transform(item.pose, {static_cast<double>(p[v]), static_cast<double>(p[v + 1]),
                                static_cast<double>(p[v + 2])});
      for (std::size_t i = 0; i < 3; ++i) {
        box[0][i] = std::min(box[0][i], at[i]);
        box[1][i] = std::max(box[1][i], at[i]);
      }
    }
  }
  return box[0][0] <= box[1][0] ? box : std::array<Vec3, 2>{};
}

}  // namespace

Result<std::unique_ptr<ViewTab>> ViewTab::create(Desk& desk, const Actions& actions,
                                                 bool software_view) {
  RMP_TRY_ASSIGN(
      std::unique_ptr<Display> display,
      Display::create({}, software_view ? DrawingMethod::image : DrawingMethod::automatic));
  return std::unique_ptr<ViewTab>(new ViewTab(desk, actions, std::move(display)));
}

ViewTab::ViewTab(Desk& desk, const Actions& actions, std::unique_ptr<Display> display)
    : desk_(desk), display_(display.release()) {
  setObjectName("view_tab");
  setAccessibleName("View");
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(0);
  make_bar(actions);
  column->addWidget(bar_);
  note_ = new QLabel;
  note_->setObjectName("view_note");
  note_->setAccessibleName("What the view does not show");
  note_->setToolTip("What the view does not show, and why");
  note_->setWordWrap(true);
  note_->setMargin(theme().gap / 2);
  note_->hide();
  column->addWidget(note_);
  display_->setAccessibleName("Picture");
  display_->setParent(this);
  column->addWidget(display_, 1);
  setFocusProxy(display_);
  info_ = new ViewInfo(desk_, display_);

  ioci::LiveView::Options options;
  options.wake = [this] {
    QMetaObject::invokeMethod(
        this, [this] { (void)live_->deliver(); }, Qt::QueuedConnection);
  };
  options.on_picture = [this](const ioci::LiveView::PicturePtr& p) { take(p); };
  live_ = desk_.base().open_beside(std::move(options));

  hidden_ = std::make_unique<HiddenMembers>();
  tools_ = std::make_unique<ViewTools>(
      desk_, *display_, [this] { return recording_.has_value() || run_.has_value(); },
      [this] { return player_.is_playing(); });
  tools_->on_box = [this](QRectF box, bool is_touching, Qt::KeyboardModifiers keys) {
    boxed(box, is_touching, keys);
  };
  tools_->find_hovered = [this](QPointF at) { return hovered_at(at); };
  tools_->hover().items_of = [this](const Selection& what) { return items_of(what); };
  tools_->on_refreshed = [this] { show_placed(); };
  tools_->on_show_all = [this] { show_all(); };
  tools_->measuring().motion = [this] {
    if (recording_) return Map{{"recording", *recording_}, {"at", player_.time()}};
    return run_ ? Map{{"run", *run_}} : Map();
  };
  player_.state_changed.add(this, [this] { tools_->refresh(); });
  display_->on_pick = [this](const std::optional<Pick>& hit) { picked(hit); };
  desk_.selection_changed.add(this, [this](const QObject*) { show_selection(); });
  player_.time_changed.add(this, [this](double time) {
    if (recording_) live_->show_recording(*recording_, time);
    info_->set_time(time);
  });
  apply_theme();
}

ViewTab::~ViewTab() = default;

void ViewTab::make_bar(const Actions& actions) {
  bar_ = new QToolBar;
  bar_->setObjectName("view_bar");
  bar_->setAccessibleName("Tools of the view");
  bar_->setMovable(false);
  const auto add = [&](const char* name) {
    QAction* action = actions.find(name);
    if (!action) return;
    bar_->addAction(action);
    if (QWidget* button = bar_->widgetForAction(action)) {
      button->setObjectName(QString("bar_") + name);
      button->setAccessibleName(action->text().remove('&'));
      button->setFocusPolicy(Qt::TabFocus);
    }
  };
  add_tool_buttons(desk_, actions, *bar_);
  for (const char* name : {"style_smooth", "style_flat", "style_wireframe", "style_hidden_line"})
    add(name);
  bar_->addSeparator();
  for (const char* name : {"show_edges", "show_grid", "show_axes"}) add(name);
  auto* gap = new QWidget;
  gap->setObjectName("view_bar_gap");
  gap->setAccessibleName("Gap");
  gap->setToolTip("Nothing");
  gap->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Preferred);
  bar_->addWidget(gap);
  for (const auto& [name, title, icon_name] : {std::tuple{"sections", "Section", "section"},
                                               std::tuple{"overlays", "Overlays", "layers"}}) {
    QAction* entry = actions.find(name);
    if (!entry) continue;
    auto* button = new QToolButton;
    button->setObjectName(QString("bar_") + name);
    button->setAccessibleName(title);
    button->setToolTip(entry->toolTip());
    button->setText(title);
    button->setIcon(icon(icon_name));
    button->setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
    button->setPopupMode(QToolButton::InstantPopup);
    button->setMenu(entry->menu());
    button->setFocusPolicy(Qt::TabFocus);
    bar_->addWidget(button);
  }
  bar_->addSeparator();
  for (const char* name :
       {"perspective", "four_views", "view_isometric", "fit", "fly_to_selection", "save_picture"})
    add(name);
}

void ViewTab::apply_theme() {
  const Theme& t = theme();
  bar_->setFixedHeight(t.bar);
  bar_->setIconSize(QSize(t.icon, t.icon));
  bar_->setStyleSheet(
      QString("QToolBar { background: %1; border: 0px; border-bottom: 1px solid %2; spacing: %3px; "
              "padding: 0px %3px; } QToolBar::separator { background: %2; width: 1px; margin: "
              "6px 4px; }")
          .arg(t.panel.name(), t.line.name())
          .arg(t.gap / 2));
  note_->setStyleSheet(
      QString("QLabel { background: %1; color: %2; }").arg(t.header.name(), t.warn.name()));
  display_->set_dark(t.is_dark);
  place_info();
  fit_bar();
}

/// Below the name of the first of four views.
void ViewTab::place_info() {
  info_->move(theme().px(8), theme().px(look_.has_four_views ? 30 : 8));
}

/// Two menus keep their icons only where the bar is narrow; what still does not fit is behind the
/// button at its end.
void ViewTab::fit_bar() {
  const bool has_words = width() >= theme().px(kWordsInBar);
  for (const char* name : {"bar_sections", "bar_overlays"})
    if (auto* button = bar_->findChild<QToolButton*>(name))
      button->setToolButtonStyle(has_words ? Qt::ToolButtonTextBesideIcon : Qt::ToolButtonIconOnly);
  if (auto* more = bar_->findChild<QToolButton*>("qt_toolbar_ext_button")) {
    more->setIcon(icon("more"));
    more->setAccessibleName("More tools of the view");
    more->setToolTip("More tools of the view");
  }
}

void ViewTab::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  fit_bar();
}

void ViewTab::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

void ViewTab::show_record(const Handle& what, const QString& name) {
  what_ = what;
  name_ = name;
  move_by({}, {});
  is_first_ = true;
  is_fitted_ = false;
  is_there_ = true;
  live_->show(what);
  for (const std::string& layer : look_.layers) (void)live_->show_layer(layer, true);
  changed();
}

void ViewTab::move_by(const std::optional<Handle>& recording, const std::optional<Handle>& run,
                      double from, double to) {
  recording_ = recording;
  run_ = run;
  tools_->set_run(run);
  player_.set_range(from, to);
  if (recording) info_->show_recording(*recording);
  else info_->clear();
}

void ViewTab::show_recording(const Handle& recording, double from, double to) {
  move_by(recording, {}, from, to);
  live_->show_recording(recording, from);
  info_->set_time(from);
  changed();
}

void ViewTab::show_run(const Handle& run) {
  move_by({}, run);
  live_->show_run(run);
  changed();
}

void ViewTab::rest() {
  move_by({}, {});
  live_->rest();
  changed();
}

void ViewTab::set_look(const ViewLook& look) {
  if (look == look_) return;
  for (const std::string& layer : scene::layer_names()) {
    const auto has = [&](const ViewLook& l) {
      return std::find(l.layers.begin(), l.layers.end(), layer) != l.layers.end();
    };
    if (has(look) == has(look_)) continue;
    if (const auto shown = live_->show_layer(layer, has(look)); !shown.ok())
      desk_.failed(shown.error());
  }
  const bool is_other_projection = look.is_perspective != look_.is_perspective;
  const bool is_other_view = look.view != look_.view;
  const bool is_other_count = look.has_four_views != look_.has_four_views;
  const bool is_other_stereo = !(look.stereo == look_.stereo);
  look_ = look;
  // Four views have no glasses.
  if (is_other_count && look_.has_four_views) look_.stereo = {};
  if (is_other_stereo && look_.stereo.mode != Stereo::none) look_.has_four_views = false;
  if (is_other_count || is_other_stereo) {
    display_->set_four_view(look_.has_four_views);
    if (display_->stereo() != look_.stereo) display_->set_stereo(look_.stereo);
    place_info();
    show_placed();
  }
  if (is_other_projection) display_->set_perspective(look_.is_perspective);
  if (is_other_view) display_->look(look_.view);
  display_->set_refining(look_.is_refined_at_rest);
  tools_->show_lights(look_.has_lights);
  apply_look();
  changed();
}

void ViewTab::apply_look() {
  frame_.style = look_.style;
  frame_.feature_edges = look_.has_edges;
  frame_.hidden_edges = look_.has_hidden_edges;
  frame_.grid = look_.has_grid;
  frame_.world_axes = look_.has_axes;
  frame_.section.reset();
  if (look_.section_axis >= 0) {
    const auto k = static_cast<std::size_t>(look_.section_axis);
    const auto [low, high] = box_of_items(frame_);
    Section section;
    section.normal = {};
    section.normal[k] = look_.is_section_turned ? -1 : 1;
    section.point[k] = low[k] + look_.section_share * (high[k] - low[k]);
    frame_.section = section;
  }
  if (picture_) display_->set_frame(frame_);
}

void ViewTab::take(const ioci::LiveView::PicturePtr& picture) {
  picture_ = picture;
  static_cast<render::Scene&>(frame_) = picture->scene;
  hidden_items_ = hidden_->apply(*picture->frame, frame_);
  bool has_other_members = false;
  if (!picture->only_moved) {
    std::set<std::string> members = scene::member_paths(*picture->frame);
    has_other_members = members != members_;
    members_ = std::move(members);
  }
  apply_fading();
  tools_->set_hidden(hidden_->names());
  for (Item& item : frame_.items)
    item.selected = std::binary_search(highlighted_.begin(), highlighted_.end(), item.id);
  if (std::exchange(is_first_, false)) {
    frame_.camera.view = look_.view;
    frame_.camera.perspective = look_.is_perspective;
    if (first_camera_) frame_.camera = *first_camera_;
    apply_look();
    show_selection();
    display_->set_refining(look_.is_refined_at_rest);
  } else {
    // What comes first is coarse, and not all of it: fit again unless somebody looks around
    // already.
    if (!is_fitted_ && !display_->is_touched()) display_->forget_camera();
    display_->set_frame(frame_);
    if (!picture->only_moved) show_selection();
  }
  is_fitted_ = is_fitted_ || picture->frame->is_exact;
  tools_->set_picture(picture_, frame_);
  const scene::Frame& frame = *picture->frame;
  QStringList sentences;
  if (frame.failure) sentences += shown(frame.failure->sentence());
  for (const std::string& sentence : picture->left_out) sentences += shown(sentence);
  note_->setText(sentences.mid(0, 3).join('\n'));
  note_->setVisible(!sentences.isEmpty());
  const bool is_there = frame.is_there;
  const QString name = frame.is_there ? shown(scene::name_of(frame, frame.what)) : name_;
  if (std::exchange(is_there_, is_there) != is_there || name != name_ || has_other_members) {
    name_ = name;
    changed();
  }
}

std::vector<std::uint64_t> ViewTab::items_of(const Selection& what) const {
  std::vector<std::uint64_t> out;
  if (!picture_ || !picture_->frame) return out;
  for (const Selected& s : what) {
    const auto kind = kind_from(s.record.kind);
    if (!kind) continue;
    const auto items = scene::items_of(*picture_->frame, {*kind, s.record.number}, s.path);
    out.insert(out.end(), items.begin(), items.end());
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

std::optional<Pose> ViewTab::selected_pose() const {
  if (!picture_ || !picture_->frame || desk_.selection().size() != 1) return {};
  const scene::Frame& frame = *picture_->frame;
  const Selected& s = desk_.selection().front();
  std::optional<Pose> found;
  if (s.record == record_handle(frame.what) && !s.path.empty())
    frame.for_each_member([&](const scene::MemberPtr& member) {
      if (!member->bodies.empty() && scene::member_path(*member) == s.path)
        found = member->world_T(0);
    });
  return found;
}

QString ViewTab::selection_pose() const {
  const std::optional<Pose> found = selected_pose();
  if (!found) return {};
  return QString("x %1  y %2  z %3 mm   ")
             .arg(shown_number(1e3 * found->p[0], 1), shown_number(1e3 * found->p[1], 1),
                  shown_number(1e3 * found->p[2], 1)) +
         angles_text(angles_about_zyx(*found), false);
}

void ViewTab::show_selection() {
  std::vector<std::uint64_t> items = items_of(desk_.selection());
  if (items == highlighted_) return;
  highlighted_ = std::move(items);
  for (Item& item : frame_.items)
    item.selected = std::binary_search(highlighted_.begin(), highlighted_.end(), item.id);
  display_->select(highlighted_);
  tools_->set_highlighted(highlighted_);
}

/// Not in four views, which are too small for it; the status bar has it, too.
void ViewTab::show_placed() {
  const auto placed = look_.has_four_views ? std::nullopt : tools_->placed();
  info_->show_placed(
      placed ? std::optional(ViewInfo::Placed{placed->name, placed->world_T_own, !placed->is_point})
             : std::nullopt);
}

Hovered ViewTab::hovered_at(QPointF at) const {
  if (!picture_ || !picture_->frame) return {};
  const auto hit = display_->pick(at);
  if (!hit) return {};
  const scene::Frame& frame = *picture_->frame;
  const auto element = scene::find_element(frame, hit->id);
  if (!element) return {};
  Hovered out;
  out.what = clicked(frame, *element, desk_.selection());
  if (out.what.empty()) return out;
  out.name = shown(words_of(frame, *element, out.what.front()));
  out.items = items_of(out.what);
  return out;
}

void ViewTab::picked(const std::optional<Pick>& hit) {
  Selection selection;
  if (hit && picture_) {
    const scene::Frame& frame = *picture_->frame;
    if (const auto element = scene::find_element(frame, hit->id))
      selection = clicked(frame, *element, desk_.selection());
  }
  // The display has selected the item by itself.
  highlighted_.clear();
  if (selection == desk_.selection()) show_selection();
  else desk_.select(std::move(selection), this);
  if (!hit) show_selection();
}

void ViewTab::boxed(QRectF box, bool is_touching, Qt::KeyboardModifiers keys) {
  if (!picture_ || !picture_->frame) return;
  const Selection found =
      viewer::boxed(*picture_->frame, frame_, tools_->screen(), box, is_touching, hidden_items_);
  const bool adds = keys.testFlag(Qt::ControlModifier),
             removes = keys.testFlag(Qt::ShiftModifier) || keys.testFlag(Qt::AltModifier);
  Selection selection = adds || removes ? desk_.selection() : Selection();
  for (const Selected& s : found) {
    std::erase(selection, s);
    if (!removes) selection.push_back(s);
  }
  desk_.select(std::move(selection), this);
}

void ViewTab::hide_selection() {
  if (!picture_ || !picture_->frame) return;
  const std::size_t before = hidden_->count();
  hidden_->hide(desk_.selection(), *picture_->frame);
  if (hidden_->count() == before)
    return desk_.failed(error(ErrorCode::unsupported, "no selected member is in this view",
                              "Select members of the world first."));
  hidden_changed(trigger_line("hide_selection"));
}

void ViewTab::isolate_selection() {
  if (!picture_ || !picture_->frame) return;
  hidden_->isolate(desk_.selection(), *picture_->frame);
  hidden_changed(trigger_line("isolate_selection"));
}

void ViewTab::show_all() {
  hidden_->show_all();
  hidden_changed(trigger_line("show_all"));
}

void ViewTab::show_member(const std::string& path, bool on) {
  if (!has_member(path) || hidden_->contains(path) != on) return;
  hidden_->toggle(path);
  hidden_changed(
      "window.show_member{record = " + utf8(lua_of({what_.kind, utf8(name_), what_, ""})) +
      ", member = " + text::quote(path) + ", shown = " + (on ? "true" : "false") + "}");
}

bool ViewTab::fade(const Selection& what, double opacity) {
  bool is_any = false;
  for (const Selected& each : what) {
    if (items_of({each}).empty()) continue;
    is_any = true;
    if (opacity_of(each) == opacity) continue;
    std::erase_if(faded_, [&](const Faded& f) { return f.what == each; });
    if (opacity < 1) faded_.push_back({each, opacity});
    has_new_fading_ = true;
    const auto kind = kind_from(each.record.kind);
    const std::string name =
        kind ? scene::name_of(*picture_->frame, {*kind, each.record.number}) : std::string();
    desk_.echo(
        "window.fade_member{record = " + utf8(lua_of({each.record.kind, name, each.record, ""})) +
        (each.path.empty() ? std::string() : ", member = " + text::quote(each.path)) +
        ", opacity = " + utf8(QString::number(opacity, 'g', 4)) + "}");
  }
  if (is_any && picture_) take(picture_);
  return is_any;
}

void ViewTab::fade_selection(double opacity) {
  if (!fade(desk_.selection(), opacity))
    desk_.failed(error(ErrorCode::unsupported, "no selected member is in this view",
                       "Select members of the world, links, parts or nodes first."));
}

double ViewTab::opacity_of(const Selected& what) const {
  for (const Faded& f : faded_)
    if (f.what == what) return f.opacity;
  return 1;
}

/// Members first, so that a part has its share where its member has one, too.
void ViewTab::apply_fading() {
  if (!picture_ || !picture_->frame) return;
  if (std::exchange(has_new_fading_, false) || !picture_->only_moved) {
    const Handle whole = record_handle(picture_->frame->what);
    std::stable_partition(faded_.begin(), faded_.end(),
                          [&whole](const Faded& f) { return f.what.record == whole; });
    shares_.clear();
    std::erase_if(faded_, [&](const Faded& f) {
      const std::vector<std::uint64_t> items = items_of({f.what});
      for (const std::uint64_t id : items) shares_[id] = f.opacity;
      return items.empty() && picture_->frame->is_exact;  // it is gone
    });
  }
  if (shares_.empty()) return;
  for (Item& item : frame_.items)
    if (const auto at = shares_.find(item.id); at != shares_.end())
      item.appearance.colour.a *= static_cast<float>(at->second);
}

void ViewTab::hidden_changed(const std::string& line) {
  desk_.echo(line);
  if (picture_) take(picture_);
  changed();
}

void ViewTab::view_from(Camera::View view) {
  look_.view = view;
  display_->look(view);
  changed();
}

void ViewTab::fit() { display_->fit(); }

void ViewTab::start_from(const Camera& camera) {
  first_camera_ = camera;
  if (!is_first_) {
    frame_.camera = camera;
    apply_look();
  }
}

void ViewTab::fly_to_selection() { display_->fly_to(highlighted_); }

bool ViewTab::is_settled() const {
  if (!picture_ || !picture_->frame) return false;
  if (!picture_->frame->is_exact && !picture_->frame->failure) return false;
  if (!player_.is_playing() && live_->is_busy()) return false;
  return !isVisible() ||
         (display_->pictures_drawn() > 0 && (player_.is_playing() || !display_->is_coarse()) &&
          (!look_.is_refined_at_rest || player_.is_playing() || display_->is_refined() ||
           !display_->can_refine()));
}

Map ViewTab::render_arguments() const {
  const OrbitCamera& camera = display_->camera();
  const Vec3 eye = camera.eye(), target = camera.target();
  Map args{
      {"id", what_},
      {"eye", List{eye[0], eye[1], eye[2]}},
      {"target", List{target[0], target[1], target[2]}},
      {"projection", camera.perspective() ? "perspective" : "orthographic"},
      {"size", List{std::clamp(camera.width(), 16, 8192), std::clamp(camera.height(), 16, 8192)}},
      {"style", kStyleWords[static_cast<std::size_t>(look_.style)]},
      {"edges", look_.has_edges},
      {"grid", look_.has_grid},
      {"axes", look_.has_axes},
      // Nothing of an earlier picture counts.
      {"zoom", 1.0},
      {"com", false},
      {"frames", false},
      {"ellipsoid", "none"},
      {"collisions", false},
      {"map", Value()},
      {"paths", kPathWords[static_cast<std::size_t>(live_->extras().paths)]},
      {"explode", live_->extras().explode},
      {"layers", Value()},
      {"without", Value()},
      {"fade", Value()},
      {"section", Value()},
      {"recording", Value()},
      {"at", Value()}};
  if (look_.style == Style::hidden_line) args.set("hidden", look_.has_hidden_edges);
  if (look_.section_axis >= 0 && frame_.section)
    args.set("section",
             Map{{"axis",
                  std::string(look_.is_section_turned ? "-" : "") + kAxisWords[look_.section_axis]},
                 {"offset", frame_.section->point[static_cast<std::size_t>(look_.section_axis)]}});
  if (!look_.layers.empty()) args.set("layers", List(look_.layers.begin(), look_.layers.end()));
  List without;
  for (const std::string& member : hidden_->names())  // pictures have no symbols of lights
    if (!member.starts_with("lights.")) without.emplace_back(member);
  if (!without.empty()) args.set("without", std::move(without));
  List fade;
  for (const Faded& f : faded_) {
    Map one;
    const auto kind = kind_from(f.what.record.kind);
    if (f.what.record != what_ && kind && picture_ && picture_->frame)
      one.set("what", f.what.record.kind + ":" +
                          scene::name_of(*picture_->frame, {*kind, f.what.record.number}));
    if (!f.what.path.empty()) one.set("path", f.what.path);
    one.set("opacity", f.opacity);
    fade.emplace_back(std::move(one));
  }
  if (!fade.empty()) args.set("fade", std::move(fade));
  if (recording_) {
    args.set("recording", *recording_);
    args.set("at", player_.time());
  }
  return args;
}

}  // namespace robomosp::viewer
