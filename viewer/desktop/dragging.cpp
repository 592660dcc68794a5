// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/dragging.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include <QDragEnterEvent>
#include <QDragMoveEvent>
#include <QDropEvent>
#include <QJsonArray>
#include <QJsonDocument>
#include <QJsonObject>
#include <QMimeData>
#include <QPainter>

#include "kernel/text.h"
#include "viewer/desktop/values.h"
#include "viewer/desktop/view_tab.h"
#include "viewer/gizmo/view_tools.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr double kFootprint = 0.2;  ///< radius of the ring for what has no known size [m]
constexpr double kRounding = 1e-3;  ///< of places on the floor [m]
constexpr double kFarthest = 1e3;   ///< a floor further away is not meant [m]

double rounded(double v) { return std::round(v / kRounding) * kRounding; }

}  // namespace

QString lua_of(const DraggedRow& row) {
  const QString name = shown(text::quote(row.name));
  if (!row.path.empty()) return name;
  if (row.kind == "recording" || row.kind == "run") return name;
  return shown(row.kind) + (row.is_shipped() ? ".get(" : "(") + name + ")";
}

std::unique_ptr<QMimeData> mime_of(const std::vector<DraggedRow>& rows) {
  auto data = std::make_unique<QMimeData>();
  QJsonArray all;
  QStringList texts;
  QByteArray columns;
  for (const DraggedRow& row : rows) {
    all.append(QJsonObject{{"kind", shown(row.kind)},
                           {"name", shown(row.name)},
                           {"record_kind", shown(row.record.kind)},
                           {"number", static_cast<double>(row.record.number)},
                           {"path", shown(row.path)}});
    texts += lua_of(row);
    if (row.record.kind == "recording" && !row.path.empty())
      columns += QByteArray::fromStdString(row.path) + '\n';
  }
  if (!columns.isEmpty()) data->setData(kColumnMime, columns);
  data->setData(kRowsMime, QJsonDocument(all).toJson(QJsonDocument::Compact));
  data->setText(texts.join(", "));
  return data;
}

std::vector<DraggedRow> dragged_rows(const QMimeData* data) {
  std::vector<DraggedRow> out;
  if (!data || !data->hasFormat(kRowsMime)) return out;
  for (const QJsonValue& each : QJsonDocument::fromJson(data->data(kRowsMime)).array()) {
    const QJsonObject o = each.toObject();
    DraggedRow row;
    row.kind = utf8(o["kind"].toString());
    row.name = utf8(o["name"].toString());
    row.record = {utf8(o["record_kind"].toString()),
                  static_cast<std::uint64_t>(o["number"].toDouble())};
    row.path = utf8(o["path"].toString());
    out.push_back(std::move(row));
  }
  return out;
}

Result<Placing> placing_of(const DraggedRow& row) {
  if (!row.path.empty())
    return error(ErrorCode::invalid_argument, "\"" + row.name + "\" is a part of a record",
                 "Drag a whole robot, object or solid.");
  // A record of the library is loaded by its name, in the same step.
  const Value what = row.is_shipped() ? Value(row.name) : Value(row.record);
  if (row.kind == "robot") return Placing{"world.add_robot", {{"robot", what}}};
  if (row.kind == "object" || row.kind == "solid")
    return Placing{"world.add_object", {{"what", what}}};
  if (row.kind == "trajectory") return Placing{"world.add_trajectory", {{"trajectory", what}}};
  if (row.kind == "task") return Placing{"world.add_task", {{"task", what}}};
  if (row.kind == "program") return Placing{"world.add_program", {{"program", what}}};
  return error(ErrorCode::invalid_argument, "a " + row.kind + " has no place in a world",
               "Drag a robot, object, solid, trajectory, task or program.");
}

void place_rows(Desk& desk, const Handle& world, const std::vector<DraggedRow>& rows,
                const std::optional<Vec3>& position) {
  ioci::Client::Edits step;
  if (rows.size() > 1)
    step = desk.client().begin_gesture("add " + std::to_string(rows.size()) + " members");
  const auto placed = std::make_shared<Selection>();
  for (const DraggedRow& row : rows) {
    auto placing = placing_of(row);
    if (!placing.ok()) {
      desk.failed(placing.error());
      continue;
    }
    placing->args.set("id", world);
    const bool has_place = placing->command == "world.add_robot" ||
                           placing->command == "world.add_object" ||
                           placing->command == "world.add_trajectory";
    if (position && has_place)
      placing->args.set("position", List{(*position)[0], (*position)[1], (*position)[2]});
    const char* list = row.kind == "robot"        ? "robots."
                       : row.kind == "trajectory" ? "trajectories."
                       : row.kind == "task"       ? "tasks."
                       : row.kind == "program"    ? "programs."
                                                  : "objects.";
    desk.act_in(step, std::move(placing->command), std::move(placing->args),
                [&desk, world, list, placed](const Result<Value>& r) {
                  if (!r.ok()) return desk.failed(r.error());
                  const std::string* name = r->as_string();
                  if (!name) return;
                  placed->push_back({world, list + *name});
                  desk.select(*placed);
                });
  }
  if (step)
    desk.client().commit(step, [&desk](const Result<Value>& r) {
      if (!r.ok()) desk.failed(r.error());
    });
}

// --- the outline of what is dropped ----------------------------------------------------------

/// Draws over the picture where the rows will be. Lets the mouse through.
class DropTarget::Preview : public QWidget {
 public:
  explicit Preview(ViewTab& view) : QWidget(&view.display()), view_(view) {
    setObjectName("drop_preview");
    setAccessibleName("Where the dragged rows will be");
    setToolTip(QString());
    setAttribute(Qt::WA_TransparentForMouseEvents);
    setAttribute(Qt::WA_NoSystemBackground);
    hide();
  }
  QString name, hindrance;
  std::optional<Vec3> at;
  std::optional<std::array<Vec3, 2>> box;  ///< of a solid, in its own frame [m]

 protected:
  void paintEvent(QPaintEvent*) override {
    const Theme& t = theme();
    QPainter p(this);
    p.setRenderHint(QPainter::Antialiasing);
    const QColor ink = hindrance.isEmpty() ? t.accent : t.fault;
    const auto place = [camera = view_.tools().screen()](const Vec3& point) {
      return camera.project(point);
    };
    p.setPen(QPen(ink, t.px(2)));
    QString words = name;
    QPointF label(t.gap, t.gap);
    if (at && hindrance.isEmpty()) {
      const Vec3 c = *at;
      if (box) {
        std::array<std::optional<QPointF>, 8> corners;
        for (std::size_t i = 0; i < 8; ++i)
          corners[i] = place({c[0] + (*box)[i & 1][0], c[1] + (*box)[(i >> 1) & 1][1],
                              c[2] + (*box)[(i >> 2) & 1][2]});
        for (std::size_t i = 0; i < 8; ++i)
          for (const std::size_t bit : {1U, 2U, 4U})
            if ((i & bit) == 0 && corners[i] && corners[i | bit])
              p.drawLine(*corners[i], *corners[i | bit]);
      } else {
        QPolygonF ring;
        for (int i = 0; i <= 48; ++i) {
          const double a = 2 * std::numbers::pi * i / 48;
          if (const auto q =
                  place({c[0] + kFootprint * std::cos(a), c[1] + kFootprint * std::sin(a), c[2]}))
            ring << *q;
        }
        p.drawPolyline(ring);
      }
      for (const Vec3& d : {Vec3{kFootprint / 2, 0, 0}, Vec3{0, kFootprint / 2, 0}})
        if (const auto a = place({c[0] - d[0], c[1] - d[1], c[2]}),
            b = place({c[0] + d[0], c[1] + d[1], c[2]});
            a && b)
          p.drawLine(*a, *b);
      if (const auto q = place(c)) label = *q + QPointF(t.gap, t.gap);
      words += "  x " + shown_number(1e3 * c[0], 0) + "  y " + shown_number(1e3 * c[1], 0) +
               "  z " + shown_number(1e3 * c[2], 0) + " mm";
    } else if (!hindrance.isEmpty()) {
      words = hindrance;
    }
    paint_label(p, label, words, t.label_ground, t.label);
  }

 private:
  ViewTab& view_;
};

DropTarget::DropTarget(Desk& desk, ViewTab& view)
    : QObject(&view), desk_(desk), view_(view), preview_(new Preview(view)) {
  view.setAcceptDrops(true);
  view.installEventFilter(this);
}

bool DropTarget::is_showing() const { return preview_->isVisible(); }

std::optional<Vec3> DropTarget::point_at(QPointF place) const {
  if (const auto hit = view_.display().pick(place)) return hit->point;
  const Ray ray = view_.tools().screen().ray(place);
  if (std::abs(ray.direction[2]) < 1e-9) return std::nullopt;
  const double s = -ray.origin[2] / ray.direction[2];
  if (s <= 0 || s > kFarthest) return std::nullopt;
  return Vec3{rounded(ray.origin[0] + s * ray.direction[0]),
              rounded(ray.origin[1] + s * ray.direction[1]), 0};
}

QString DropTarget::hindrance(const std::vector<DraggedRow>& rows) const {
  if (view_.what().kind != "world") return "Drop it on the picture of a world.";
  for (const DraggedRow& row : rows)
    if (const auto placing = placing_of(row); !placing.ok()) {
      QString text = shown(placing.error().sentence());
      text[0] = text[0].toUpper();
      return text;
    }
  return {};
}

void DropTarget::ask_box(const DraggedRow& row) {
  preview_->box.reset();
  // Of the library nothing is loaded before it is dropped.
  if (row.kind != "solid" || row.is_shipped()) return;
  desk_.ask("solid.bounds", {{"id", row.record}}, *this, [this, row](const Result<Value>& r) {
    if (!r.ok() || rows_.empty() || rows_.front().record != row.record) return;
    if (const auto low = vec_at(map_of(*r), "min"), high = vec_at(map_of(*r), "max"); low && high) {
      preview_->box = std::array{*low, *high};
      preview_->update();
    }
  });
}

QPoint DropTarget::enter_pane(QPointF in_view) {
  Display& display = view_.display();
  const QPoint place = display.mapFrom(&view_, in_view.toPoint());
  display.activate_pane(display.pane_at(place));
  return place;
}

bool DropTarget::eventFilter(QObject* object, QEvent* event) {
  switch (event->type()) {
    case QEvent::DragEnter:
    case QEvent::DragMove: {
      auto* drag = static_cast<QDragMoveEvent*>(event);
      if (event->type() == QEvent::DragEnter) {
        rows_ = dragged_rows(drag->mimeData());
        if (rows_.empty()) return false;
        preview_->name = shown(rows_.front().name);
        if (rows_.size() > 1) preview_->name += QString(" and %1 more").arg(rows_.size() - 1);
        ask_box(rows_.front());
      }
      if (rows_.empty()) return false;
      const QPoint place = enter_pane(drag->position());
      preview_->hindrance = hindrance(rows_);
      preview_->at = point_at(place);
      preview_->setGeometry(view_.display().rect());
      preview_->show();
      preview_->raise();
      preview_->update();
      // Accepted even if it cannot be dropped, so that the reason is shown and moves go on.
      if (preview_->hindrance.isEmpty()) drag->acceptProposedAction();
      else drag->setDropAction(Qt::IgnoreAction), drag->accept();
      return true;
    }
    case QEvent::DragLeave:
      if (rows_.empty()) return false;
      rows_.clear();
      preview_->hide();
      return true;
    case QEvent::Drop: {
      auto* drop = static_cast<QDropEvent*>(event);
      const auto rows = std::exchange(rows_, {});
      preview_->hide();
      if (rows.empty()) return false;
      drop->acceptProposedAction();
      if (const QString why = hindrance(rows); !why.isEmpty()) {
        desk_.failed(error(ErrorCode::invalid_argument, utf8(why)));
        return true;
      }
      const auto at = point_at(enter_pane(drop->position()));
      if (!at)
        desk_.failed(error(ErrorCode::invalid_argument, "there is no floor at this place",
                           "Drop it below the horizon."));
      else place_rows(desk_, view_.what(), rows, at);
      return true;
    }
    default: return QObject::eventFilter(object, event);
  }
}

}  // namespace robomosp::viewer
