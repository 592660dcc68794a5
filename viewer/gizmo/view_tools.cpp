// SPDX-License-Identifier: GPL-3.0-or-later
// What the tools of a view show, and which events they take.
#include "viewer/gizmo/view_tools.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>
#include <QWidget>

#include "scene/origin.h"
#include "viewer/desktop/values.h"
#include "viewer/gizmo/hover.h"
#include "viewer/gizmo/measuring.h"
#include "viewer/gizmo/picking.h"
#include "viewer/gizmo/run_pull.h"
#include "viewer/scene/linear.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr double kHandleReach = 8;  ///< [px at zoom 1]
constexpr std::size_t kMostHandles = 500, kMostLights = 200;
constexpr double kLightReach = 11, kLightSize = 7, kLightAhead = 26;  ///< [px at zoom 1]

std::optional<AnyId> id_of_handle(const Handle& h) {
  const auto kind = kind_from(h.kind);
  if (!kind) return std::nullopt;
  return AnyId{*kind, h.number};
}

QString sentence_of(const Error& e) { return shown(e.sentence()); }

}  // namespace

/// Drawn over the picture, and over its still.
class ViewTools::Overlay : public QWidget {
 public:
  Overlay(ViewTools& tools, QWidget* parent) : QWidget(parent), tools_(tools) {
    setObjectName("view_overlay");
    setAccessibleName("Gizmo and marks");
    setToolTip(QString());
    setAttribute(Qt::WA_TransparentForMouseEvents);
    setAttribute(Qt::WA_NoSystemBackground);
    setFocusPolicy(Qt::NoFocus);
  }

 protected:
  void paintEvent(QPaintEvent*) override {
    QPainter painter(this);
    tools_.paint(painter);
  }

 private:
  ViewTools& tools_;
};

QString shown_number(double value, int digits) {
  QString text = QString::number(value, 'f', digits);
  // No minus before a zero.
  if (text.startsWith('-') && text.toDouble() == 0) text.remove(0, 1);
  return text.replace('-', QChar(0x2212));
}

namespace {
/// What paint_label() paints on.
QRectF label_box(QPainter& painter, QPointF at, const QString& text) {
  const Theme& t = theme();
  painter.setFont(t.mono);
  const QRectF inner =
      painter.fontMetrics().boundingRect(QRect(0, 0, t.px(420), t.px(400)), Qt::TextWordWrap, text);
  return {at, inner.size() + QSizeF(t.gap, t.gap / 2.0)};
}
}  // namespace

QRectF paint_label(QPainter& painter, QPointF at, const QString& text, const QColor& ground,
                   const QColor& colour) {
  const Theme& t = theme();
  const QRectF box = label_box(painter, at, text);
  painter.setPen(Qt::NoPen);
  painter.setBrush(ground);
  painter.drawRoundedRect(box, t.radius, t.radius);
  painter.setPen(colour);
  painter.drawText(box, Qt::AlignCenter | Qt::TextWordWrap, text);
  return box;
}

ViewTools::ViewTools(Desk& desk, Display& display, std::function<bool()> has_motion,
                     std::function<bool()> is_playing)
    : desk_(desk),
      display_(display),
      has_motion_(std::move(has_motion)),
      is_playing_(std::move(is_playing)),
      overlay_(new Overlay(*this, &display)),
      hover_(std::make_unique<Hover>(desk, display,
                                     [this](const QRect& part) { overlay_->update(part); })),
      measuring_(std::make_unique<Measuring>(desk, display)),
      pull_(std::make_unique<RunPull>(desk, display, [this] {
        if (pull_) describe();
        overlay_->update();
      })) {
  hover_->find = [this](QPointF at) { return hovered_at(at); };
  display_.installEventFilter(this);
  display_.setMouseTracking(true);
  overlay_->setGeometry(display_.rect());
  overlay_->show();
  display_.redrawn.add(this, [this] { redraw(); });
  desk_.tools.changed.add(this, [this] { refresh(); });
  desk_.selection_changed.add(this, [this](const QObject*) {
    tool_of_.clear();
    refresh();
  });
}

ViewTools::~ViewTools() {
  if (drag_ && gesture_) desk_.client().commit(gesture_);
}

ScreenCamera ViewTools::screen() const {
  const Display::View view = display_.active_view();
  return {view.camera, display_.devicePixelRatioF(), view.place.topLeft()};
}

void ViewTools::redraw() {
  overlay_->raise();
  place_gizmo();
  place_handles();
  place_lights();
  hover_->check();
  describe();
  overlay_->update();
}

void ViewTools::describe() {
  overlay_->setAccessibleDescription(drag_                 ? readout()
                                     : pull_->is_pulling() ? pull_->readout()
                                                           : hint_);
}

void ViewTools::set_picture(const ioci::LiveView::PicturePtr& picture, const viewer::Frame& frame) {
  picture_ = picture;
  frame_ = &frame;
  hover_->set_frame(frame);
  measuring_->set_picture(picture, frame);
  pull_->set_picture(picture);
  refresh();
}

void ViewTools::set_run(const std::optional<Handle>& run) { pull_->set_run(run); }

void ViewTools::set_highlighted(const std::vector<std::uint64_t>& items) {
  highlighted_ = items;
  seen_.reset();
  refresh();
}

void ViewTools::show_lights(bool on) {
  if (std::exchange(has_lights_, on) != on) redraw();
}

void ViewTools::set_hidden(const std::set<std::string>& members) {
  hidden_members_ = members;
  QStringList names;
  for (const std::string& each : members) {
    if (names.size() == 4) {
      names += QString("%1 more").arg(members.size() - 4);
      break;
    }
    names += shown(each.substr(each.find('.') + 1));
  }
  hidden_ = names.isEmpty() ? QString() : "Hidden: " + names.join(", ") + ". Alt+H shows all.";
}

void ViewTools::refresh() {
  if (desk_.tools.tool == Tool::measure || is_playing_()) hover_->clear();
  if (!drag_) find_targets();
  redraw();
  if (on_refreshed) on_refreshed();
}

/// What is selected and can be moved, as the document has it now.
void ViewTools::find_targets() {
  targets_.clear();
  hint_.clear();
  if (!picture_ || !picture_->frame || desk_.selection().empty()) return;
  const scene::Frame& frame = *picture_->frame;
  if (seen_for_ != desk_.selection() || !seen_) {
    seen_for_ = desk_.selection();
    seen_.reset();
    if (!highlighted_.empty()) seen_ = scene::find_element(frame, highlighted_.front());
  } else {
    // The same element of the newest member.
    scene::MemberPtr newest;
    frame.for_each_member([&](const scene::MemberPtr& m) {
      if (m->kind == seen_->member->kind && m->name == seen_->member->name) newest = m;
    });
    if (newest) seen_->member = newest;
    else seen_.reset();
  }
  const bool has_motion = has_motion_();
  for (const Selected& s : desk_.selection()) {
    const auto id = id_of_handle(s.record);
    if (!id) continue;
    const auto found = tool_of_.empty() ? scene::movable(frame, *id, s.path, seen_)
                                        : scene::movable_tool(frame, tool_of_);
    if (!found.ok()) {
      // What the view shows as a whole is selected to look at it, not to move it.
      if (!s.path.empty() || *id != frame.what) hint_ = sentence_of(found.error());
      continue;
    }
    // A recording shows joints and objects elsewhere than the document has them.
    const bool is_fixed_in_time =
        found->path.starts_with("segments.") || found->path.starts_with("frames.") ||
        found->path.starts_with("lights.") || found->path.starts_with("trajectories.");
    if (has_motion && !is_fixed_in_time) {
      hint_ = QStringLiteral(
          "A recording or run moves the picture. Choose Run > Back to the document to edit.");
      continue;
    }
    targets_.push_back({*found, found->world_T_own()});
    if (found->joints) break;
  }
  if (targets_.size() > 1)
    std::erase_if(targets_, [](const Target& t) { return t.movable.joints.has_value(); });
}

std::optional<ViewTools::Placed> ViewTools::placed() const {
  if (targets_.size() != 1 || !picture_ || !picture_->frame) return std::nullopt;
  const scene::Movable& m = targets_.front().movable;
  // A drag keeps its targets as they were when it began.
  const auto now = m.joints ? scene::movable_tool(*picture_->frame, m.joints->member)
                            : scene::movable(*picture_->frame, m.record, m.path, seen_);
  return Placed{shown(m.label).remove('"'), now.ok() ? now->world_T_own() : m.world_T_own(),
                m.path.starts_with("segments.")};
}

void ViewTools::place_gizmo() {
  const ToolSettings& tools = desk_.tools;
  const Theme& t = theme();
  gizmo_.size_px = t.px(84);
  gizmo_.reach_px = t.px(7);
  if (drag_) return;
  gizmo_.dragged = Grip::none;
  gizmo_.is_refused = false;
  const bool is_shown =
      !targets_.empty() && !is_playing_() && (tools.tool == Tool::move || tools.tool == Tool::turn);
  gizmo_.mode = !is_shown                  ? GizmoMode::hidden
                : tools.tool == Tool::turn ? GizmoMode::turn
                                           : GizmoMode::move;
  if (targets_.empty()) return;
  const scene::Movable& last = targets_.back().movable;
  const Pose own = last.world_T_own();
  gizmo_.origin = own.p;
  gizmo_.axes = Pose{};
  if (tools.axes == ToolAxes::own) gizmo_.axes.R = own.R;
  if (tools.axes == ToolAxes::parent) gizmo_.axes.R = last.world_T_parent.R;
  if (tools.axes == ToolAxes::frame && picture_ && picture_->frame) {
    const auto frame =
        scene::movable(*picture_->frame, picture_->frame->what, "frames." + tools.frame);
    if (frame.ok()) gizmo_.axes.R = frame->world_T_own().R;
    else hint_ = sentence_of(frame.error());
  }
}

void ViewTools::place_handles() {
  handles_.clear();
  if (!picture_ || !picture_->frame || drag_ || desk_.selection().size() != 1 ||
      desk_.tools.tool == Tool::measure || is_playing_())
    return;
  const ScreenCamera camera = screen();
  const scene::Frame& frame = *picture_->frame;
  const Selected& s = desk_.selection().front();
  auto id = id_of_handle(s.record);
  if (!id) return;
  if (*id == frame.what && s.path.starts_with("trajectories."))
    for (const scene::MemberPtr& m : frame.trajectories)
      if ("trajectories." + m->name == s.path) id = m->what;
  if (id->kind == Kind::trajectory) {
    for (const scene::ControlPoint& p : scene::control_points(frame, *id, seen_)) {
      if (handles_.size() >= kMostHandles) break;
      const auto at = camera.project(p.place);
      if (at) handles_.push_back({*at, shown(p.name), p.path, {}, p.path == s.path});
    }
    return;
  }
  if (*id == frame.what && s.path.starts_with("robots.") && !has_motion_()) {
    const std::string member = s.path.substr(7);
    const auto tool = scene::movable_tool(frame, member);
    if (!tool.ok()) return;
    if (const auto at = camera.project(tool->world_T_own().p))
      handles_.push_back({*at, shown(tool->label), {}, member, tool_of_ == member});
  }
}

/// Symbols of the lights of a world in all views, of one size at every distance.
void ViewTools::place_lights() {
  lights_.clear();
  if (!picture_ || !picture_->frame || !has_lights_) return;
  const scene::Frame& frame = *picture_->frame;
  if (frame.lights.empty()) return;
  const Handle world = record_handle(frame.what);
  for (const Display::View& view : display_.views()) {
    const ScreenCamera camera{view.camera, display_.devicePixelRatioF(), view.place.topLeft()};
    for (const scene::MemberPtr& m : frame.lights) {
      if (lights_.size() >= kMostLights) return;
      const scene::ShapePtr& shape = m->shape(scene::ShapeLayer::bodies);
      if (m->bodies.empty() || !shape || shape->lights.empty()) continue;
      LightMark mark;
      mark.path = scene::member_path(*m);
      if (hidden_members_.contains(mark.path)) continue;
      const Pose& pose = m->bodies.front();
      const auto at = camera.project(pose.p);
      if (!at || !view.place.contains(*at)) continue;
      const render::Light& light = shape->lights.front().what;
      mark.at = *at;
      mark.is_sun = light.kind == render::Light::Kind::sun;
      if (light.kind == render::Light::Kind::sun || light.kind == render::Light::Kind::spot) {
        const double length = theme().px(kLightAhead) * camera.metres_per_pixel(pose.p);
        mark.ahead = camera.project(pose.p - length * rotate(pose, {0, 0, 1}));
      }
      mark.colour = QColor::fromRgbF(std::clamp(light.colour.r, 0.0F, 1.0F),
                                     std::clamp(light.colour.g, 0.0F, 1.0F),
                                     std::clamp(light.colour.b, 0.0F, 1.0F));
      mark.name = shown(m->name);
      mark.member = m;
      mark.view = view.place;
      mark.is_selected = std::find(desk_.selection().begin(), desk_.selection().end(),
                                   Selected{world, mark.path}) != desk_.selection().end();
      lights_.push_back(std::move(mark));
    }
  }
}

const ViewTools::LightMark* ViewTools::light_at(QPointF at) const {
  const LightMark* nearest = nullptr;
  double least = theme().px(kLightReach);
  for (const LightMark& each : lights_) {
    const double away = std::hypot(each.at.x() - at.x(), each.at.y() - at.y());
    if (!each.view.contains(at) || away > least) continue;
    least = away;
    nearest = &each;
  }
  return nearest;
}

bool ViewTools::take_light(QPointF at) {
  const LightMark* light = light_at(at);
  if (!light || !picture_ || !picture_->frame) return false;
  desk_.select({{record_handle(picture_->frame->what), light->path}}, this);
  return true;
}

Hovered ViewTools::hovered_at(QPointF at) const {
  if (const LightMark* light = light_at(at); light && picture_ && picture_->frame)
    return {{{record_handle(picture_->frame->what), light->path}}, "light " + light->name, {}};
  return find_hovered ? find_hovered(at) : Hovered();
}

bool ViewTools::take_handle(QPointF at) {
  for (const Mark& h : handles_) {
    if (h.is_current || std::hypot(h.at.x() - at.x(), h.at.y() - at.y()) > theme().px(kHandleReach))
      continue;
    if (h.path.empty()) {
      tool_of_ = h.member;
      refresh();
      return true;
    }
    const Selected& s = desk_.selection().front();
    Selected point{s.record, h.path};
    if (s.path.starts_with("trajectories."))
      for (const scene::MemberPtr& m : picture_->frame->trajectories)
        if ("trajectories." + m->name == s.path)
          point.record = {std::string(to_string(m->what.kind)), m->what.number};
    desk_.select({point}, this);
    return true;
  }
  return false;
}

bool ViewTools::eventFilter(QObject*, QEvent* event) {
  if (!drag_ && desk_.tools.tool == Tool::measure && measuring_->take(*event)) return true;
  switch (event->type()) {
    case QEvent::Resize:
      overlay_->setGeometry(display_.rect());
      redraw();
      break;
    case QEvent::MouseButtonPress:
    case QEvent::MouseMove:
    case QEvent::MouseButtonRelease:
    case QEvent::MouseButtonDblClick:
      return mouse(*static_cast<QMouseEvent*>(event), event->type());
    case QEvent::Leave:
      hover_->clear();
      gizmo_.hovered = Grip::none;
      hovered_handle_ = -1;
      overlay_->update();
      break;
    case QEvent::Hide:
    case QEvent::WindowDeactivate:
    case QEvent::UngrabMouse:
      hover_->clear();
      pull_->end();
      break;
    case QEvent::ShortcutOverride:
      if (key(*static_cast<QKeyEvent*>(event), true)) {
        event->accept();
        return true;
      }
      break;
    case QEvent::KeyPress: return key(*static_cast<QKeyEvent*>(event), false);
    default: break;
  }
  return false;
}

bool ViewTools::mouse(QMouseEvent& event, QEvent::Type type) {
  const QPointF at = event.position();
  mouse_at_ = at;
  if (type != QEvent::MouseMove) hover_->clear();
  if (drag_ && drag_->is_ending) return true;
  if (type == QEvent::MouseMove && pull_->move(event, screen())) return true;
  if (type == QEvent::MouseButtonRelease && pull_->release(event)) return true;
  if (type != QEvent::MouseMove && pull_->is_pulling()) return true;
  if (type == QEvent::MouseButtonPress) {
    if (drag_) {
      // A click ends what a key began; the right button takes it back.
      end(event.button() != Qt::RightButton);
      return true;
    }
    if (event.button() != Qt::LeftButton) return false;
    // The gizmo is in the active view only: a press in another one does not take hold of it.
    const bool is_other_view = display_.activate_at(at);
    const bool has_light = event.modifiers() == Qt::NoModifier && light_at(at);
    const bool is_box =
        awaits_box_ || (desk_.tools.tool == Tool::select && !has_light && !display_.pick(at));
    if (!is_box && !is_other_view && take_handle(at)) return true;
    if (!is_box && !is_other_view)
      if (const Grip grip = gizmo_.hit(screen(), at); grip != Grip::none) {
        begin(grip, at, false);
        return true;
      }
    if (!is_box && has_light && take_light(at)) return true;
    if (is_box && on_box) {
      box_from_ = at;
      box_ = QRectF(at, at);
      return true;
    }
    pull_->press(event);
    return false;
  }
  if (type == QEvent::MouseMove) {
    if (drag_) {
      drag_to(at, event.modifiers());
      return true;
    }
    if (box_) {
      box_ = QRectF(box_from_, at);
      overlay_->update();
      return true;
    }
    if (event.buttons() != Qt::NoButton) return false;
    const bool is_here = display_.active_view().place.contains(at);
    const Grip grip = is_here ? gizmo_.hit(screen(), at) : Grip::none;
    int handle = -1;
    for (std::size_t i = 0; i < handles_.size(); ++i)
      if (std::hypot(handles_[i].at.x() - at.x(), handles_[i].at.y() - at.y()) <
          theme().px(kHandleReach))
        handle = static_cast<int>(i);
    const bool is_other = grip != gizmo_.hovered || handle != hovered_handle_;
    gizmo_.hovered = grip;
    hovered_handle_ = handle;
    if (is_other) overlay_->update();
    if (grip == Grip::none && handle < 0 && !is_playing_()) hover_->move(at);
    else hover_->clear();
    return false;
  }
  if (type == QEvent::MouseButtonRelease) {
    if (drag_ && !drag_->is_by_key) {
      end(true);
      return true;
    }
    if (box_) {
      const QRectF box = std::exchange(box_, std::nullopt)->normalized();
      awaits_box_ = false;
      overlay_->update();
      const bool is_click = box.width() < Display::kLeastDrag && box.height() < Display::kLeastDrag;
      if (is_click) {
        if (event.modifiers() == Qt::NoModifier) desk_.select({}, this);
      } else if (on_box) {
        // As in CAD: to the right what is inside, to the left what it touches.
        on_box(box, at.x() < box_from_.x(), event.modifiers());
      }
      return true;
    }
    return drag_.has_value();
  }
  // The second press of a double click on a handle must not fit the view.
  return drag_ || light_at(at) ||
         (display_.active_view().place.contains(at) && gizmo_.hit(screen(), at) != Grip::none);
}

bool ViewTools::key(QKeyEvent& event, bool is_override) {
  const int k = event.key();
  const Qt::KeyboardModifiers keys = event.modifiers() & ~Qt::KeypadModifier;
  if (!drag_) {
    if (keys == Qt::NoModifier && k == Qt::Key_Escape && pull_->is_pulling()) {
      if (!is_override) pull_->end();
      return true;
    }
    if (keys == Qt::NoModifier && k == Qt::Key_Escape && (box_ || awaits_box_)) {
      if (!is_override) {
        box_.reset();
        awaits_box_ = false;
        redraw();
      }
      return true;
    }
    // The menu Help has this key elsewhere.
    if (keys == Qt::AltModifier && k == Qt::Key_H && !hidden_.isEmpty() && on_show_all) {
      if (!is_override) on_show_all();
      return true;
    }
    if (keys == Qt::NoModifier && k == Qt::Key_B && on_box) {
      if (!is_override) {
        awaits_box_ = true;
        redraw();
      }
      return true;
    }
    return false;
  }
  if (drag_->is_ending) return false;
  // During a drag every key belongs to it.
  if (is_override) return !(keys & Qt::ControlModifier) || k == Qt::Key_Escape;
  const bool is_turning = is_turn(drag_->motion.grip);
  switch (k) {
    case Qt::Key_Escape: end(false); return true;
    case Qt::Key_Return:
    case Qt::Key_Enter: end(true); return true;
    case Qt::Key_Backspace:
      drag_->typed.chop(1);
      apply();
      return true;
    case Qt::Key_X:
    case Qt::Key_Y:
    case Qt::Key_Z: {
      const int i = k - Qt::Key_X;
      constexpr Grip kTurns[] = {Grip::turn_x, Grip::turn_y, Grip::turn_z};
      constexpr Grip kMoves[] = {Grip::move_x, Grip::move_y, Grip::move_z};
      constexpr Grip kPlanes[] = {Grip::move_yz, Grip::move_zx, Grip::move_xy};
      set_grip(is_turning ? kTurns[i] : keys.testFlag(Qt::ShiftModifier) ? kPlanes[i] : kMoves[i]);
      return true;
    }
    default: break;
  }
  const QString text = event.text();
  if (!text.isEmpty() && text.front().isPrint()) {
    drag_->typed += text;
    apply();
  }
  return true;
}

void ViewTools::paint(QPainter& painter) {
  const ScreenCamera camera = screen();
  const Theme& t = theme();
  painter.setRenderHint(QPainter::Antialiasing);
  hover_->paint(painter);
  paint_lights(painter);
  // What belongs to the active view does not reach into the others.
  painter.save();
  painter.setClipRect(display_.active_view().place);
  measuring_->paint(painter, camera);
  pull_->paint(painter, camera);
  const double r = t.px(4);
  for (std::size_t i = 0; i < handles_.size(); ++i) {
    const auto& h = handles_[i];
    const bool is_lit = static_cast<int>(i) == hovered_handle_;
    painter.setPen(QPen(t.label_ground, t.px(2)));
    painter.setBrush(h.is_current ? t.accent : t.label);
    const double size = is_lit ? 1.4 * r : r;
    if (h.path.empty())
      painter.drawRect(QRectF(h.at.x() - size, h.at.y() - size, 2 * size, 2 * size));
    else painter.drawEllipse(h.at, size, size);
    if (is_lit)
      paint_label(painter, h.at + QPointF(t.px(10), -t.px(24)), h.name, t.label_ground, t.label);
  }
  if (drag_ && snapped_) {
    painter.setBrush(Qt::NoBrush);
    painter.setPen(QPen(t.accent, t.px(2)));
    if (snapped_->line.size() > 1) painter.drawPolyline(snapped_->line);
    if (const auto at = camera.project(snapped_->point)) {
      const double d = t.px(5);
      if (snapped_->kind == SnapTarget::Kind::corner)
        painter.drawRect(QRectF(at->x() - d, at->y() - d, 2 * d, 2 * d));
      else painter.drawEllipse(*at, d, d);
      paint_label(painter, *at + QPointF(t.px(10), t.px(6)),
                  QString("%1 of %2").arg(word_of(snapped_->kind), shown(snapped_->name)),
                  t.label_ground, t.label);
    }
  }
  gizmo_.paint(painter, camera);
  if (box_) {
    const QRectF box = box_->normalized();
    const bool is_touching = box_->width() < 0;
    QColor fill = is_touching ? t.ok_fill : t.accent_fill;
    painter.setPen(QPen(fill, t.px(1), is_touching ? Qt::DashLine : Qt::SolidLine));
    fill.setAlphaF(0.18F);
    painter.setBrush(fill);
    painter.drawRect(box);
  }
  painter.restore();
  paint_readout(painter, camera);
}

/// A lamp: a disk in its colour with rays, those of a spot or a sun where it shines.
void ViewTools::paint_lights(QPainter& painter) const {
  const Theme& t = theme();
  painter.save();
  for (const LightMark& each : lights_) {
    painter.setClipRect(each.view);
    const bool is_lit =
        picture_ && picture_->frame && !hover_->what().empty() &&
        hover_->what().front() == Selected{record_handle(picture_->frame->what), each.path};
    const double r = t.px(is_lit ? 1.25 * kLightSize : kLightSize), ray = 1.9 * r;
    const QColor ink = each.is_selected || is_lit ? t.accent : t.label;
    const auto stroke = [&](const QPointF& from, const QPointF& to) {
      for (const auto& [colour, width] : {std::pair{t.label_ground, t.px(4)}, {ink, t.px(1.5)}}) {
        painter.setPen(QPen(colour, width, Qt::SolidLine, Qt::RoundCap));
        painter.drawLine(from, to);
      }
    };
    if (each.ahead) {
      // From the rim of the disk, as far as it is seen from the side.
      const QPointF by = *each.ahead - each.at;
      const double length = std::hypot(by.x(), by.y());
      if (length > ray) {
        const QPointF along = by / length, side(-along.y(), along.x());
        const double spread = each.is_sun ? 0.0 : 0.5;
        for (const double s : {-0.8, 0.0, 0.8})
          stroke(each.at + 1.35 * r * along + s * r * side,
                 each.at + length * along + s * (r + spread * (length - r)) * side);
      }
    }
    if (!each.ahead || each.is_sun)
      for (int i = 0; i < 8; ++i) {
        const double a = i * std::numbers::pi / 4;
        const QPointF way(std::cos(a), std::sin(a));
        stroke(each.at + 1.35 * r * way, each.at + ray * way);
      }
    painter.setPen(QPen(t.label_ground, t.px(4)));
    painter.setBrush(each.colour);
    painter.drawEllipse(each.at, r, r);
    painter.setPen(QPen(ink, t.px(1.5)));
    painter.drawEllipse(each.at, r, r);
  }
  painter.restore();
}

void ViewTools::paint_readout(QPainter& painter, const ScreenCamera& camera) const {
  const Theme& t = theme();
  double low = overlay_->height() - t.gap / 2.0;
  const auto stack = [&](const QString& text) {
    QRectF box = label_box(painter, QPointF(t.gap, 0), text);
    box.moveBottom(low);
    low = box.top() - t.gap / 2.0;
    paint_label(painter, box.topLeft(), text, t.label_ground, t.label);
  };
  if (!drag_ && !hint_.isEmpty() && desk_.tools.tool != Tool::select &&
      desk_.tools.tool != Tool::measure && !desk_.selection().empty() && !is_playing_())
    stack(hint_);
  if (!hidden_.isEmpty()) stack(hidden_);
  if (!drag_) return;
  const auto at = camera.project(gizmo_.origin);
  if (!at) return;
  // At the border of its view it would be cut off, or be over another one.
  const QRectF view = display_.active_view().place;
  const QPointF place(
      std::clamp(at->x() + t.px(24), view.left(), std::max(view.left(), view.right() - t.px(160))),
      std::clamp(at->y() + t.px(24), view.top(), std::max(view.top(), view.bottom() - t.px(60))));
  const QRectF box = paint_label(painter, place, readout(), t.accent_fill, t.on_accent);
  if (!refusal_.isEmpty())
    paint_label(painter, box.bottomLeft() + QPointF(0, t.px(4)), refusal_, t.fault_ground, t.fault);
}

}  // namespace robomosp::viewer
