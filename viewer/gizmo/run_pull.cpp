// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/gizmo/run_pull.h"

#include <cmath>
#include <utility>

#include <QMouseEvent>
#include <QPainter>
#include <QPointer>

#include "scene/origin.h"
#include "viewer/desktop/values.h"
#include "viewer/gizmo/view_tools.h"
#include "viewer/scene/linear.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr int kRestMs = 300;    ///< the mouse rests if it does not move for this time
constexpr double kStep = 1e-4;  ///< places are sent with this resolution [m]

List sent_place(const Vec3& v) {
  List out;
  for (const double x : v) out.emplace_back(std::round(x / kStep) / (1 / kStep));
  return out;
}

QString quoted(const std::string& name) { return QChar('"') + shown(name) + QChar('"'); }

}  // namespace

RunPull::RunPull(Desk& desk, Display& display, std::function<void()> redraw)
    : desk_(desk), display_(display), redraw_(std::move(redraw)) {
  rest_.setSingleShot(true);
  rest_.setInterval(kRestMs);
  connect(&rest_, &QTimer::timeout, this, [this] { echo_place(); });
  desk_.events.add(this, [this](const ioci::Event& e) {
    if (e.topic == ioci::Topic::run && e.run && run_ && e.run->run == run_->number)
      take(e.run->state);
  });
}

RunPull::~RunPull() { end(); }

void RunPull::set_run(const std::optional<Handle>& run) {
  if (run == run_) return;
  end();
  is_pressed_ = false;
  refused_.clear();
  run_ = run;
  pullable_.clear();
  is_known_ = false;
  if (!run_) return;
  const QPointer<RunPull> self = this;
  desk_.ask("run.state", {{"id", *run_}}, [self, run = *run_](const Result<Value>& r) {
    // What an event said meanwhile is newer.
    if (self && r.ok() && self->run_ == run && !self->is_known_) self->take(map_of(*r));
  });
}

void RunPull::take(const Map& state) {
  if (!state.find("pullable")) return;
  is_known_ = true;
  is_playing_ = flag_at(state, "is_playing");
  is_over_ = flag_at(state, "is_complete") || flag_at(state, "is_over");
  pullable_.clear();
  for (const Value& name : list_at(state, "pullable"))
    if (const std::string* text = name.as_string()) pullable_.insert(*text);
  if (!held_) return;
  for (const Value& each : list_at(state, "pulls")) {
    const Map& pull = map_of(each);
    const bool is_own = held_->link.empty() ? text_at(pull, "object") == held_->member
                                            : text_at(pull, "link") == held_->link &&
                                                  text_at(pull, "robot") == held_->member;
    if (!is_own || !pull.find("at")) continue;
    force_ = number_at(pull, "force");
    has_force_ = true;
  }
  if (is_over_) end();
  redraw_();
}

std::optional<RunPull::Body> RunPull::body_under(const QPointF& at) const {
  if (!picture_ || !picture_->frame) return std::nullopt;
  const auto hit = display_.pick(at);
  if (!hit) return std::nullopt;
  const auto element = scene::find_element(*picture_->frame, hit->id);
  if (!element || element->kind != scene::ElementKind::item) return std::nullopt;
  const scene::MemberPtr& member = element->member;
  const bool is_robot = member->kind == scene::MemberKind::robot;
  if (!is_robot && (member->kind != scene::MemberKind::body || !member->is_placed))
    return std::nullopt;
  const auto& shape = member->shape(element->layer);
  if (!shape || element->index >= shape->items.size()) return std::nullopt;
  Body out;
  out.member = member->name;
  out.words = utf8(quoted(member->name));
  if (is_robot) {
    const auto origin = scene::pick(*picture_->frame, *element);
    if (!origin.ok() || origin->link.empty()) return std::nullopt;
    out.link = origin->link;
    out.words = utf8("link " + quoted(origin->link) + " of " + quoted(member->name));
    // Bodies of a robot are its base and links; a tool belongs to the link that carries it.
    const auto& of = shape->items[element->index].of;
    out.body = of.link >= 0 ? of.link : shape->items[element->index].body;
  }
  if (out.body < 0 || static_cast<std::size_t>(out.body) >= member->bodies.size())
    return std::nullopt;
  const Pose pose = member->world_T(out.body);
  out.point = rotate_back(pose, hit->point - pose.p);
  out.to = hit->point;
  return out;
}

std::optional<Pose> RunPull::world_T(const Body& body) const {
  if (!picture_ || !picture_->frame) return std::nullopt;
  const scene::MemberList& members =
      body.link.empty() ? picture_->frame->bodies : picture_->frame->robots;
  for (const scene::MemberPtr& m : members)
    if (m->name == body.member && static_cast<std::size_t>(body.body) < m->bodies.size())
      return m->world_T(body.body);
  return std::nullopt;
}

std::optional<Vec3> RunPull::point() const {
  const auto pose = held_ ? world_T(*held_) : std::nullopt;
  return pose ? std::optional(transform(*pose, held_->point)) : std::nullopt;
}

Map RunPull::arguments(const Body& body, bool with_place) const {
  Map out{{"id", *run_}};
  if (body.link.empty()) {
    out.set("object", body.member);
  } else {
    out.set("robot", body.member);
    out.set("link", body.link);
  }
  if (with_place) {
    out.set("point", sent_place(body.point));
    out.set("to", sent_place(body.to));
  }
  return out;
}

void RunPull::press(const QMouseEvent& event) {
  is_pressed_ = false;
  refused_.clear();
  is_spent_ = false;
  if (!run_ || held_ || event.button() != Qt::LeftButton || event.modifiers() != Qt::NoModifier)
    return;
  is_pressed_ = true;
  pressed_at_ = event.position();
}

bool RunPull::move(const QMouseEvent& event, const ScreenCamera& camera) {
  const bool is_down = event.buttons().testFlag(Qt::LeftButton);
  if (!is_down) {
    is_pressed_ = false;
    is_spent_ = false;
    if (!refused_.isEmpty()) {
      refused_.clear();
      redraw_();
    }
    // The button went up where nobody reported it.
    if (held_) end();
    return false;
  }
  if (is_pressed_ && !held_) {
    if ((event.position() - pressed_at_).manhattanLength() < Display::kLeastDrag) return false;
    is_pressed_ = false;
    // Not when it was pressed: of four views the press has activated the one that is picked in.
    auto body = body_under(pressed_at_);
    if (!body) return false;
    if (!is_known_ || is_over_ || !pullable_.contains(body->member)) {
      refused_ = !is_known_ ? QString("The state of the run is not known yet")
                 : is_over_ ? QString(
                                  "Nothing is left to compute: go back and choose Continue "
                                  "from the time shown in the menu of the timeline")
                 : pullable_.empty()
                     ? QString("Nothing to pull: no forces act in this run")
                     : shown(body->words) + " cannot be pulled: forces do not move it here";
      redraw_();
      return false;
    }
    begin(*std::move(body));
  }
  if (!held_) return is_spent_;
  // In the plane of the picture through the place that is held.
  const Ray ray = camera.ray(event.position());
  const Vec3 n = camera.camera.backward();
  const double along = dot(n, ray.direction);
  if (along < -1e-9) {
    held_->to = ray.origin + (dot(n, held_->to - ray.origin) / along) * ray.direction;
    send();
    rest_.start();
    redraw_();
  }
  return true;
}

bool RunPull::release(const QMouseEvent& event) {
  if (event.button() != Qt::LeftButton) return held_.has_value();
  is_pressed_ = false;
  if (!refused_.isEmpty()) {
    refused_.clear();
    redraw_();
  }
  const bool is_own = std::exchange(is_spent_, false);
  end();
  return is_own;
}

void RunPull::begin(Body body) {
  held_ = std::move(body);
  ++number_;
  has_force_ = false;
  is_spent_ = true;
  force_ = 0;
  has_newer_ = false;
  is_waiting_ = true;
  desk_.act("run.pull", arguments(*held_, true), of_this_pull([this](const Result<Value>& r) {
              if (r.ok()) return sent();
              // It has not begun, so that nothing is released.
              held_.reset();
              rest_.stop();
              redraw_();
              desk_.failed(r.error());
            }));
}

Desk::Done RunPull::of_this_pull(Desk::Done done) {
  return [self = QPointer<RunPull>(this), number = number_,
          done = std::move(done)](const Result<Value>& r) {
    if (!self) return;
    if (self->held_ && self->number_ == number) done(r);
    else if (!r.ok()) self->desk_.failed(r.error());
  };
}

void RunPull::sent() {
  is_waiting_ = false;
  if (std::exchange(has_newer_, false)) send();
}

/// One call at a time; the newest place counts.
void RunPull::send() {
  has_newer_ = is_waiting_;
  if (is_waiting_ || !run_ || !held_) return;
  is_waiting_ = true;
  desk_.ask("run.pull", arguments(*held_, true), of_this_pull([this](const Result<Value>& r) {
              if (r.ok()) return sent();
              // The run ended, was moved back or removed meanwhile.
              end();
              desk_.failed(r.error());
            }));
}

/// A drag is many calls for the window, and one line for each place where the mouse rests.
void RunPull::echo_place() {
  if (!held_ || !run_) return;
  if (is_waiting_) return rest_.start();
  desk_.act("run.pull", arguments(*held_, true), of_this_pull([this](const Result<Value>& r) {
              if (r.ok()) return;
              end();
              desk_.failed(r.error());
            }));
}

void RunPull::end() {
  rest_.stop();
  has_newer_ = false;
  if (!held_ || !run_) return;
  const Body body = *std::exchange(held_, std::nullopt);
  // A run that was removed meanwhile has no pulls any more.
  desk_.act("run.release", arguments(body, false), [](const Result<Value>&) {});
  redraw_();
}

QString RunPull::readout() const {
  if (!held_) return {};
  if (!is_playing_)
    return has_force_ ? QString("%1 N, paused: acts when the run plays").arg(force_, 0, 'g', 3)
                      : QString("Paused: acts when the run plays");
  return has_force_ ? QString("%1 N").arg(force_, 0, 'g', 3) : QString();
}

QString RunPull::hint() const { return refused_; }

void RunPull::paint(QPainter& painter, const ScreenCamera& camera) const {
  const Theme& t = theme();
  if (!refused_.isEmpty())
    paint_label(painter, QPointF(t.gap, display_.height() - t.px(48)),
                refused_ + ". The drag turns the view.", t.label_ground, t.label);
  const auto at = point();
  if (!at) return;
  const auto from = camera.project(*at), to = camera.project(held_->to);
  if (!from || !to) return;
  painter.setPen(QPen(t.label_ground, t.px(4)));
  painter.drawLine(*from, *to);
  painter.setPen(QPen(t.accent, t.px(2)));
  painter.drawLine(*from, *to);
  painter.setBrush(t.accent);
  painter.drawEllipse(*from, t.px(4), t.px(4));
  painter.setBrush(Qt::NoBrush);
  painter.drawEllipse(*to, t.px(6), t.px(6));
  if (const QString text = readout(); !text.isEmpty())
    paint_label(painter, *to + QPointF(t.px(12), t.px(12)), text, t.accent_fill, t.on_accent);
}

}  // namespace robomosp::viewer
