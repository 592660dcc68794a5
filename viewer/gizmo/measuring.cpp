// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/gizmo/measuring.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <QClipboard>
#include <QGuiApplication>
#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>
#include <QPointer>

#include "ioci/client/call_text.h"
#include "scene/measure.h"
#include "scene/origin.h"
#include "viewer/desktop/values.h"
#include "viewer/gizmo/picking.h"
#include "viewer/gizmo/view_tools.h"
#include "viewer/scene/linear.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr double kMeasureReach = 12;  ///< [px at zoom 1]

QString length_text(double metres) { return shown_number(1e3 * metres, 2) + " mm"; }
/// With the greatest error that the command gives, unless it is below what is shown.
QString length_text(double metres, double bound) {
  return bound > 5e-6 ? length_text(metres) + " " + QChar(0x00B1) + " " + length_text(bound)
                      : length_text(metres);
}
QString angle_text(double radians) {
  return shown_number(radians * 180 / std::numbers::pi, 2) + QChar(0x00B0);
}

Vec3 place_at(const Map& map, const char* key) { return vec_at(map, key).value_or(Vec3{}); }

/// What a face or edge is on its own; "" = nothing beside its place.
QString about(const Map& feature) {
  const double radius = number_at(feature, "radius"), length = number_at(feature, "length");
  const std::string kind = text_at(feature, "kind");
  QString text;
  if (radius > 0 && kind != "cone" && kind != "torus")
    text = "radius " + length_text(radius) + ", diameter " + length_text(2 * radius);
  else if (radius > 0) text = "radius " + length_text(radius);
  else if (length > 0) text = "length " + length_text(length);
  else return text;
  return flag_at(feature, "is_of_mesh") ? text + " (of the mesh)" : text;
}

}  // namespace

std::optional<SnapTarget> Measuring::under(QPointF at) {
  if (!frame_) return std::nullopt;
  ToolSettings kinds;
  kinds.snaps_face = true;
  const Display::View view = display_.view_at(at);
  return snapper_.find(
      *frame_, {view.camera, display_.devicePixelRatioF(), view.place.topLeft()}, at,
      theme().px(kMeasureReach), kinds, [](std::uint64_t) { return false; },
      [this](QPointF place) { return display_.pick(place); });
}

void Measuring::forget() {
  all_.clear();
  first_.reset();
  display_.redrawn();
}

bool Measuring::take(QEvent& event) {
  switch (event.type()) {
    case QEvent::MouseMove: {
      const auto& mouse = static_cast<const QMouseEvent&>(event);
      if (mouse.buttons() != Qt::NoButton) return false;
      hovered_ = under(mouse.position());
      display_.redrawn();
      return true;
    }
    case QEvent::MouseButtonPress: {
      const auto& mouse = static_cast<const QMouseEvent&>(event);
      if (mouse.button() != Qt::LeftButton || mouse.modifiers() != Qt::NoModifier) return false;
      display_.activate_at(mouse.position());
      const auto target = under(mouse.position());
      if (!target) return false;  // on empty ground the mouse turns the view
      hold(*target);
      return true;
    }
    case QEvent::ShortcutOverride:
    case QEvent::KeyPress: {
      const auto& key = static_cast<const QKeyEvent&>(event);
      const bool is_escape =
          key.key() == Qt::Key_Escape && (first_ || !all_.empty()) && !key.modifiers();
      const bool is_copy = key.matches(QKeySequence::Copy) && !all_.empty();
      if (!is_escape && !is_copy) return false;
      if (event.type() == QEvent::ShortcutOverride) {
        event.accept();
        return true;
      }
      if (is_escape) {
        forget();
        return true;
      }
      QStringList texts;
      for (const Measurement& m : all_) texts += QString(m.text).replace(QChar(0x2212), '-');
      QGuiApplication::clipboard()->setText(texts.join('\n'));
      return true;
    }
    default: return false;
  }
}

void Measuring::hold(const SnapTarget& target) {
  if (!first_) {
    first_ = target;
    if (target.kind != SnapTarget::Kind::corner) measure_one(target);
    display_.redrawn();
    return;
  }
  measure(*std::exchange(first_, std::nullopt), target);
}

void Measuring::add(Measurement m) {
  all_.push_back(std::move(m));
  display_.redrawn();
}

Map Measuring::place_of(const SnapTarget& target) const {
  const auto element = picture_ && picture_->frame
                           ? scene::find_element(*picture_->frame, target.item)
                           : std::nullopt;
  if (!element) return {};
  const auto origin = scene::pick(*picture_->frame, *element);
  if (!origin.ok()) return {};
  const char* as = "face";
  if (target.kind == SnapTarget::Kind::corner) as = "corner";
  if (target.kind == SnapTarget::Kind::edge || target.kind == SnapTarget::Kind::centre) as = "edge";
  const Vec3& at = target.kind == SnapTarget::Kind::centre ? target.on : target.point;
  Map place{{"as", as}, {"place", List{at[0], at[1], at[2]}}};
  if (const std::string body = scene::body_of(*origin); !body.empty()) place.set("body", body);
  return place;
}

void Measuring::ask(Map arguments, const std::function<void(const Map&)>& done) {
  const Handle what = record_handle(picture_->frame->what);
  if (motion)
    for (const auto& [key, value] : motion()) arguments.set(key, value);
  const std::string command = what.kind + ".measure";
  Map args{{"id", what}}, shown{{"id", scene::name_of(*picture_->frame, picture_->frame->what)}};
  for (const auto& [key, value] : arguments) {
    args.set(key, value);
    shown.set(key, value);
  }
  // No event reports a command that only reads.
  desk_.echo(ioci::call_text(command, shown).line);
  ++asking_;
  const QPointer<Measuring> self = this;
  desk_.act(command, std::move(args), [self, done](const Result<Value>& r) {
    if (!self) return;
    --self->asking_;
    if (!r.ok()) return self->desk_.failed(r.error());
    if (r->as_map()) done(*r->as_map());
  });
}

void Measuring::measure_one(const SnapTarget& target) {
  Map place = place_of(target);
  if (place.empty()) return;
  ask({{"a", std::move(place)}}, [this, at = target.point](const Map& result) {
    const Map& a = map_at(result, "a");
    const QString text = about(a);
    if (text.isEmpty()) return;
    const bool is_edge = text_at(a, "kind") == "line";
    add({is_edge ? place_at(a, "start") : at, is_edge ? place_at(a, "finish") : at, text});
  });
}

void Measuring::measure(const SnapTarget& a, const SnapTarget& b) {
  const Map from = place_of(a), to = place_of(b);
  if (from.empty() || to.empty()) return;
  ask({{"a", from}, {"b", to}}, [this](const Map& r) {
    const Vec3 by = place_at(r, "offset");
    QString text = length_text(number_at(r, "distance"), number_at(r, "bound"));
    text += "   x " + shown_number(1e3 * by[0], 2) + "  y " + shown_number(1e3 * by[1], 2) +
            "  z " + shown_number(1e3 * by[2], 2);
    if (r.find("angle")) text += "   " + angle_text(number_at(r, "angle"));
    for (const auto& [key, word] :
         {std::pair{"axis_distance", "axes "}, std::pair{"plane_distance", "planes "},
          std::pair{"centre_distance", "centres "}})
      if (r.find(key) && std::fabs(number_at(r, key) - number_at(r, "distance")) > 5e-6)
        text += "   " + QString(word) + length_text(number_at(r, key));
    add({place_at(r, "from"), place_at(r, "to"), text});
  });
  // Of two bodies the clearance, too.
  const std::string one = text_at(from, "body"), other = text_at(to, "body");
  if (one.empty() || other.empty() || one == other) return;
  ask({{"a", Map{{"body", one}}}, {"b", Map{{"body", other}}}}, [this](const Map& r) {
    add({place_at(r, "from"), place_at(r, "to"),
         "clearance " + length_text(number_at(r, "distance"), number_at(r, "bound"))});
  });
}

void Measuring::paint(QPainter& painter, const ScreenCamera& camera) const {
  const Theme& t = theme();
  const double d = t.px(4);
  const auto mark = [&](const Vec3& at) {
    if (const auto p = camera.project(at)) painter.drawEllipse(*p, d, d);
  };
  for (const Measurement& m : all_) {
    const auto from = camera.project(m.from), to = camera.project(m.to);
    if (!from || !to) continue;
    painter.setPen(QPen(t.accent, t.px(2)));
    painter.setBrush(t.label_ground);
    painter.drawLine(*from, *to);
    mark(m.from);
    mark(m.to);
    paint_label(painter, 0.5 * (*from + *to) + QPointF(t.px(8), t.px(6)), m.text, t.label_ground,
                t.label);
  }
  for (const auto* each : {&first_, &hovered_}) {
    if (!*each) continue;
    painter.setBrush(Qt::NoBrush);
    painter.setPen(QPen(t.accent, t.px(2)));
    if ((*each)->line.size() > 1) painter.drawPolyline((*each)->line);
    mark((*each)->point);
    if (each == &hovered_)
      if (const auto p = camera.project((*each)->point))
        paint_label(painter, *p + QPointF(t.px(10), -t.px(24)), word_of((*each)->kind),
                    t.label_ground, t.label);
  }
}

}  // namespace robomosp::viewer
