// SPDX-License-Identifier: GPL-3.0-or-later
// Drags of the tools of a view: from the mouse to commands of one gesture.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <QCursor>
#include <QPointer>

#include "kernel/units.h"
#include "viewer/desktop/values.h"
#include "viewer/gizmo/view_tools.h"
#include "viewer/scene/linear.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr double kFreeAngle = 0.1 * std::numbers::pi / 180;  ///< step of turns that do not snap
constexpr double kSnapReach = 12;                            ///< [px at zoom 1]
constexpr const char* kAxisLetters[] = {"X", "Y", "Z"};

QString gesture_label(const Grip grip, const std::vector<QString>& names) {
  return (is_turn(grip) ? "turn " : "move ") +
         (names.size() == 1 ? names.front() : QString("%1 members").arg(names.size()));
}

/// The step of free drags: a round length below half a pixel.
double free_step(double metres_per_pixel) {
  return std::pow(10.0, std::floor(std::log10(std::max(1e-9, 0.5 * metres_per_pixel))));
}

/// The nearest multiple. Dividing by a whole number keeps decimal fractions exact.
double rounded(double x, double step) {
  const double whole = std::round(x / step), inverse = 1 / step;
  return inverse > 1 && std::fabs(inverse - std::round(inverse)) < 1e-6 * inverse
             ? whole / std::round(inverse)
             : whole * step;
}

Handle handle_of_id(AnyId id) { return {std::string(to_string(id.kind)), id.number}; }

Value matrix_value(const Pose& t) {
  List rows;
  for (std::size_t r = 0; r < 3; ++r)
    rows.emplace_back(List{t.R[3 * r], t.R[3 * r + 1], t.R[3 * r + 2], t.p[r]});
  rows.emplace_back(List{0.0, 0.0, 0.0, 1.0});
  return Value(std::move(rows));
}

Pose inverse_of(const Pose& t) {
  Pose out;
  out.R = {t.R[0], t.R[3], t.R[6], t.R[1], t.R[4], t.R[7], t.R[2], t.R[5], t.R[8]};
  out.p = -1.0 * rotate_back(t, t.p);
  return out;
}

Pose composed(const Pose& a, const Pose& b) {
  Pose out;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 column = rotate(a, Vec3{b.R[i], b.R[i + 3], b.R[i + 6]});
    out.R[i] = column[0], out.R[i + 3] = column[1], out.R[i + 6] = column[2];
  }
  out.p = transform(a, b.p);
  return out;
}

}  // namespace

void ViewTools::begin_by_key(GizmoMode mode) {
  if (drag_ || targets_.empty()) {
    if (targets_.empty())
      desk_.failed(error(ErrorCode::unsupported,
                         hint_.isEmpty() ? "nothing that can be moved is selected" : utf8(hint_),
                         "Select an object, frame, node, tool or control point."));
    return;
  }
  gizmo_.mode = mode;
  const QPointF at = display_.mapFromGlobal(QCursor::pos());
  const bool is_inside = display_.rect().contains(at.toPoint());
  begin(mode == GizmoMode::turn ? Grip::turn_view : Grip::move_free, is_inside ? at : mouse_at_,
        true);
}

void ViewTools::cancel() {
  if (drag_) end(false);
}

void ViewTools::begin(Grip grip, QPointF at, bool is_by_key) {
  display_.setFocus(Qt::MouseFocusReason);
  Drag drag;
  drag.from = drag.at = at;
  drag.is_by_key = is_by_key;
  drag.targets = targets_;
  drag_ = std::move(drag);
  refusal_.clear();
  snapped_.reset();
  if (!targets_.empty() && targets_.back().movable.joints) q_ = targets_.back().movable.joints->q;
  set_grip(grip);
}

void ViewTools::set_grip(Grip grip) {
  drag_->motion = {};
  drag_->motion.grip = grip;
  gizmo_.dragged = grip;
  gizmo_.origin = drag_->targets.back().start.p;
  const ScreenCamera camera = screen();
  drag_->grip_point = gizmo_.point_on(grip, camera, drag_->from);
  drag_->last_angle = gizmo_.angle_on(grip, camera, drag_->from).value_or(0);
  drag_->swept = 0;
  if (drag_->is_begun) drag_to(drag_->at, drag_->keys);
  else redraw();
}

void ViewTools::drag_to(QPointF at, Qt::KeyboardModifiers keys) {
  drag_->at = at;
  drag_->keys = keys;
  const ScreenCamera camera = screen();
  GizmoMotion& m = drag_->motion;
  gizmo_.origin = drag_->targets.back().start.p;
  snapped_.reset();
  if (is_turn(m.grip)) {
    if (const auto angle = gizmo_.angle_on(m.grip, camera, at)) {
      double by = *angle - drag_->last_angle;
      by -= 2 * std::numbers::pi * std::round(by / (2 * std::numbers::pi));
      drag_->last_angle = *angle;
      drag_->swept += by;
    }
    const bool snaps = desk_.tools.is_snapping != keys.testFlag(Qt::ControlModifier);
    const double step = snaps ? desk_.tools.angle : kFreeAngle;
    m.angle = step * std::round(drag_->swept / step);
  } else if (const auto p = gizmo_.point_on(m.grip, camera, at); p && drag_->grip_point) {
    const Vec3 by = *p - *drag_->grip_point;
    m.offset = m.grip == Grip::move_free ? by : rotate_back(gizmo_.axes, by);
    snap(camera);
  }
  apply();
}

/// Rounds the offset, or takes the one to what is under the mouse.
void ViewTools::snap(const ScreenCamera& camera) {
  const ToolSettings& tools = desk_.tools;
  GizmoMotion& m = drag_->motion;
  const Vec3 start = drag_->targets.back().start.p;
  const bool snaps = tools.is_snapping != drag_->keys.testFlag(Qt::ControlModifier);
  const double fine = free_step(camera.metres_per_pixel(start));
  std::array<bool, 3> free{true, true, true};
  const int k = axis_of(m.grip);
  if (m.grip != Grip::move_free)
    for (int i = 0; i < 3; ++i)
      free[static_cast<std::size_t>(i)] = is_plane(m.grip) ? i != k : i == k;
  if (snaps && frame_) {
    std::vector<std::string> names;
    for (const Target& t : drag_->targets) names.push_back(t.movable.path);
    const auto is_moved = [&](std::uint64_t id) {
      return std::find(highlighted_.begin(), highlighted_.end(), id) != highlighted_.end();
    };
    snapped_ = snapper_.find(*frame_, camera, drag_->at, theme().px(kSnapReach), tools, is_moved,
                             [&](QPointF at) -> std::optional<Pick> {
                               auto hit = display_.pick(at);
                               if (hit && is_moved(hit->id)) hit.reset();
                               return hit;
                             });
    if (snapped_) {
      const Vec3 by = snapped_->point - start;
      const Vec3 local = m.grip == Grip::move_free ? by : rotate_back(gizmo_.axes, by);
      for (std::size_t i = 0; i < 3; ++i) m.offset[i] = free[i] ? local[i] : 0;
      return;
    }
  }
  const double step = snaps && tools.snaps_grid && tools.grid > 0 ? tools.grid : fine;
  for (std::size_t i = 0; i < 3; ++i) m.offset[i] = free[i] ? rounded(m.offset[i], step) : 0;
}

/// A typed number in millimetres or degrees, or with its unit.
std::optional<double> ViewTools::typed_value() const {
  if (!drag_ || drag_->typed.isEmpty()) return std::nullopt;
  const bool turns = is_turn(drag_->motion.grip);
  bool is_plain = false;
  (void)drag_->typed.toDouble(&is_plain);
  const std::string text = utf8(drag_->typed) + (is_plain ? (turns ? " deg" : " mm") : "");
  const auto value = units::read_quantity(text, turns ? "rad" : "m");
  return value.ok() && std::isfinite(*value) ? std::optional(*value) : std::nullopt;
}

/// Sends what the drag has come to, a typed value before the mouse.
void ViewTools::apply() {
  if (!drag_) return;
  GizmoMotion& m = drag_->motion;
  if (const auto typed = typed_value()) {
    snapped_.reset();
    if (is_turn(m.grip)) {
      m.angle = *typed;
    } else {
      // Of a plane or the whole space a number is along the first free axis.
      if (m.grip == Grip::move_free) m.grip = gizmo_.dragged = Grip::move_x;
      const int k = axis_of(m.grip), along = is_plane(m.grip) ? (k + 1) % 3 : k;
      m.offset = {};
      m.offset[static_cast<std::size_t>(along)] = *typed;
    }
  }
  send();
  const ScreenCamera camera = screen();
  gizmo_.origin = drag_->targets.back().start.p;
  gizmo_.origin = gizmo_.moved(drag_->targets.back().start, m, camera).p;
  gizmo_.is_refused = !refusal_.isEmpty();
  redraw();
}

void ViewTools::send() {
  const ScreenCamera camera = screen();
  ioci::Client& client = desk_.client();
  gizmo_.origin = drag_->targets.back().start.p;
  if (!drag_->is_begun) {
    std::vector<QString> names;
    for (const Target& t : drag_->targets) names.push_back(shown(t.movable.label));
    drag_->label = utf8(gesture_label(drag_->motion.grip, names));
    gesture_ = client.begin_gesture(drag_->label);
    drag_->is_begun = true;
  }
  refusal_.clear();
  if (drag_->targets.size() == 1 && drag_->targets.front().movable.joints) {
    wanted_tool_ = gizmo_.moved(drag_->targets.front().start, drag_->motion, camera);
    return solve();
  }
  std::map<std::string, Value> now;
  std::map<std::string, std::pair<Handle, std::string>> places;
  for (const Target& t : drag_->targets) {
    const auto edits = scene::assignments(t.movable, gizmo_.moved(t.start, drag_->motion, camera));
    if (!edits.ok()) {
      refusal_ = shown(edits.error().sentence());
      continue;
    }
    const Handle record = handle_of_id(t.movable.record);
    for (const scene::Assignment& a : *edits) {
      const std::string key = record.kind + std::to_string(record.number) + " " + a.path;
      now.emplace(key, a.value);
      places.emplace(key, std::pair(record, a.path));
    }
  }
  // What an earlier update moved is where it began: only the gesture knows the old value.
  const bool is_back = std::any_of(drag_->sent.begin(), drag_->sent.end(),
                                   [&](const auto& each) { return !now.contains(each.first); });
  if (is_back) {
    client.cancel(gesture_);
    drag_->sent.clear();
    gesture_ = client.begin_gesture(drag_->label);
  }
  for (auto& [key, value] : now) {
    const auto at = drag_->sent.find(key);
    if (at != drag_->sent.end() && at->second == value) continue;
    const auto& [record, path] = places.at(key);
    const QPointer<ViewTools> self = this;
    client.update(
        gesture_, "record.set", {{"id", record}, {"path", path}, {"value", value}},
        [self](const Result<Value>& r) {
          if (!self || r.ok() || r.error().code == ErrorCode::cancelled) return;
          if (!self->drag_) return self->desk_.failed(r.error());
          self->refusal_ = shown(r.error().sentence());
          self->gizmo_.is_refused = true;
          self->redraw();
        },
        key);
    drag_->sent.insert_or_assign(key, value);
  }
}

/// Joint values for the newest pose of the tool. One question at a time: the next one begins where
/// the answer of the last one is.
void ViewTools::solve() {
  if (is_solving_ || !wanted_tool_ || !drag_) return;
  const scene::Movable::Joints& joints = *drag_->targets.front().movable.joints;
  const Pose target =
      composed(inverse_of(joints.world_T_mounting), *std::exchange(wanted_tool_, {}));
  List seed;
  for (const double q : q_) seed.emplace_back(q);
  is_solving_ = true;
  const QPointer<ViewTools> self = this;
  desk_.ask("robot.solve_ik",
            {{"id", handle_of_id(joints.robot)}, {"target", matrix_value(target)}, {"seed", seed}},
            [self, member = joints.member,
             world = handle_of_id(drag_->targets.front().movable.record)](const Result<Value>& r) {
              if (!self) return;
              self->is_solving_ = false;
              if (!self->drag_ || !self->gesture_) return;
              const Map* m = r.ok() ? r->as_map() : nullptr;
              const Value* q = m ? m->find("q") : nullptr;
              if (q && text_at(*m, "status") == "solved") {
                self->q_ = numbers_of(*q);
                List values;
                for (const double v : self->q_) values.emplace_back(v);
                self->desk_.client().update(self->gesture_, "world.set_robot_q",
                                            {{"id", world}, {"robot", member}, {"q", values}});
                self->refusal_.clear();
              } else {
                const std::string detail = m ? text_at(*m, "detail") : std::string();
                self->refusal_ = !r.ok()           ? shown(r.error().sentence())
                                 : !detail.empty() ? shown(detail)
                                                   : QString("The tool cannot reach this pose.");
              }
              self->gizmo_.is_refused = !self->refusal_.isEmpty();
              if (self->wanted_tool_) return self->solve();
              if (self->drag_->is_ending) return self->end_solved();
              self->redraw();
            });
}

void ViewTools::end(bool keep) {
  if (!drag_) return;
  const bool has_typed_nonsense = keep && !drag_->typed.isEmpty() && !typed_value();
  if (has_typed_nonsense) {
    refusal_ = QString("\"%1\" is no %2.")
                   .arg(drag_->typed, is_turn(drag_->motion.grip) ? "angle" : "length");
    gizmo_.is_refused = true;
    return redraw();
  }
  // The newest pose of the tool counts, even if the mouse was faster than the solver.
  if (drag_->is_begun && is_solving_ && keep) {
    drag_->is_ending = true;
    return;
  }
  if (keep) end_solved();
  else close_gesture(false);
}

void ViewTools::end_solved() {
  // A typed value is reached exactly or not at all; the mouse leaves what it reached last.
  const bool keep = refusal_.isEmpty() || drag_->typed.isEmpty();
  if (!refusal_.isEmpty())
    desk_.noted(drag_->targets.front().movable.joints && keep
                    ? "The robot keeps its last pose: " + refusal_
                    : refusal_);
  close_gesture(keep);
}

void ViewTools::close_gesture(bool keep) {
  const bool is_begun = drag_ && drag_->is_begun;
  drag_.reset();
  wanted_tool_.reset();
  snapped_.reset();
  refusal_.clear();
  gizmo_.dragged = Grip::none;
  gizmo_.is_refused = false;
  if (is_begun) {
    ++ends_open_;
    const QPointer<ViewTools> self = this;
    const auto done = [self](const Result<Value>& r) {
      if (!self) return;
      --self->ends_open_;
      if (!r.ok() && r.error().code != ErrorCode::cancelled) self->desk_.failed(r.error());
      self->refresh();
    };
    if (keep) desk_.client().commit(gesture_, done);
    else desk_.client().cancel(gesture_, done);
    gesture_ = {};
  }
  refresh();
}

QString ViewTools::readout() const {
  if (!drag_) return {};
  const GizmoMotion& m = drag_->motion;
  const QString typed = drag_->typed;
  const int k = axis_of(m.grip);
  if (is_turn(m.grip)) {
    const QString name = k < 0 ? QString("view") : QString(kAxisLetters[k]);
    return name + " " +
           (typed.isEmpty() ? shown_number(m.angle * 180 / std::numbers::pi, 1) + QChar(0x00B0)
                            : typed + "|");
  }
  QStringList parts;
  for (int i = 0; i < 3; ++i) {
    const bool is_free = m.grip == Grip::move_free || (is_plane(m.grip) ? i != k : i == k);
    if (!is_free) continue;
    const bool is_typed = !typed.isEmpty() && parts.isEmpty();
    parts +=
        QString(kAxisLetters[i]) + " " +
        (is_typed ? typed + "|" : shown_number(1e3 * m.offset[static_cast<std::size_t>(i)], 2));
  }
  return parts.join("  ") + " mm";
}

}  // namespace robomosp::viewer
