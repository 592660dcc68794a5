// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/view_info.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <QEvent>
#include <QPainter>

#include "viewer/desktop/values.h"
#include "viewer/gizmo/view_tools.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/number_fields.h"

namespace robomosp::viewer {
namespace {

constexpr double kInset = 8;  ///< of texts [px of the design]

/// As wide for every value, so that decimals do not jump.
QString fixed_number(double v, int digits, int width) {
  return shown_number(v, digits).rightJustified(width);
}

}  // namespace

QString angles_text(const Vec3& abc, bool is_aligned) {
  QString text;
  for (const auto& [name, angle] : {std::pair{"A ", abc[0]}, {"  B ", abc[1]}, {"  C ", abc[2]}}) {
    double degrees = std::remainder(angle * 180 / std::numbers::pi, 360.0);
    if (degrees < -179.95) degrees += 360;  // one sign for half a turn
    text += name + fixed_number(degrees, 1, !is_aligned ? 0 : text.isEmpty() ? 9 : 7);
  }
  return text + " deg";
}

ViewInfo::ViewInfo(Desk& desk, QWidget* parent) : QWidget(parent), desk_(desk) {
  setObjectName("view_info");
  setAccessibleName("Time, speed, place and orientation");
  setToolTip(
      "Time, speed, place and orientation of the tool, or of the selection; A B C turn about z y "
      "x\nrecording.values{id = ..., columns = ...}");
  setAttribute(Qt::WA_TransparentForMouseEvents);
  hide();
}

void ViewInfo::clear() {
  ++version_;
  recording_.reset();
  columns_.clear();
  values_.clear();
  rows_ = 0;
  refresh();
}

void ViewInfo::show_recording(const Handle& recording) {
  if (recording_ == recording) return;
  clear();
  recording_ = recording;
  const std::uint64_t version = version_;
  desk_.ask("recording.list", {}, *this, [this, version, recording](const Result<Value>& r) {
    if (!r.ok() || version != version_) return;
    for (const Value& each : list_of(*r))
      if (handle_at(map_of(each), "recording") == recording)
        title_ = shown(text_at(map_of(each), "title"));
    refresh();
  });
  desk_.ask("recording.columns", {{"id", recording}}, *this,
            [this, version](const Result<Value>& r) {
              if (r.ok() && version == version_) take(list_of(*r));
            });
}

void ViewInfo::take(const List& columns) {
  List wanted{"time"};
  for (const char* name : {"x", "y", "z", "roll", "pitch", "yaw"})
    for (const Value& each : columns) {
      const std::string* plain = each.as_string();
      if ((plain ? *plain : text_at(map_of(each), "name")) == name) wanted.emplace_back(name);
    }
  columns_.clear();
  for (const Value& each : wanted) columns_.push_back(*each.as_string());
  const std::uint64_t version = version_;
  desk_.ask("recording.values", {{"id", *recording_}, {"columns", wanted}}, *this,
            [this, version](const Result<Value>& r) {
              if (!r.ok() || version != version_) return;
              if (!r->as_array() || columns_.empty()) return;
              values_ = numbers_of(*r);
              rows_ = values_.size() / columns_.size();
              refresh();
            });
}

void ViewInfo::set_time(double time) {
  time_ = time;
  refresh();
}

std::pair<std::size_t, double> ViewInfo::row() const {
  const std::size_t n = columns_.size();
  std::size_t low = 0, high = rows_;  // the first row after the time
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (values_[middle * n] <= time_) low = middle + 1;
    else high = middle;
  }
  const std::size_t i = low == 0 ? 0 : low - 1;
  if (i + 1 >= rows_) return {i, 0};
  const double from = values_[i * n], to = values_[(i + 1) * n];
  return {i, to > from ? std::clamp((time_ - from) / (to - from), 0.0, 1.0) : 0};
}

std::optional<double> ViewInfo::at(const std::string& column) const {
  const auto found = std::find(columns_.begin(), columns_.end(), column);
  if (found == columns_.end() || rows_ == 0) return {};
  const std::size_t n = columns_.size(), k = static_cast<std::size_t>(found - columns_.begin());
  const auto [i, share] = row();
  const double a = values_[i * n + k];
  const double b = i + 1 < rows_ ? values_[(i + 1) * n + k] : a;
  const double v = a + share * (b - a);
  return std::isfinite(v) ? std::optional(v) : std::nullopt;
}

void ViewInfo::show_placed(const std::optional<Placed>& placed) {
  placed_ = placed;
  refresh();
}

void ViewInfo::refresh() {
  QStringList lines;
  QString title = title_;
  if (recording_ && rows_ > 0) {
    lines += "t " + fixed_number(time_, 3, 9) + " s";
    const auto x = at("x"), y = at("y"), z = at("z");
    const std::size_t n = columns_.size();
    if (x && y && z && rows_ > 1) {
      const std::size_t i = std::min(row().first, rows_ - 2);
      double way = 0;
      for (std::size_t k = 1; k < n; ++k)
        if (columns_[k].size() == 1)  // of x, y and z
          way = std::hypot(way, values_[(i + 1) * n + k] - values_[i * n + k]);
      const double step = values_[(i + 1) * n] - values_[i * n];
      if (step > 0 && std::isfinite(way))
        lines += "v " + fixed_number(1e3 * way / step, 1, 9) + " mm/s";
      lines += "x " + fixed_number(1e3 * *x, 1, 9) + "  y " + fixed_number(1e3 * *y, 1, 7) +
               "  z " + fixed_number(1e3 * *z, 1, 7) + " mm";
    }
    const auto roll = at("roll"), pitch = at("pitch"), yaw = at("yaw");
    if (roll && pitch && yaw) lines += angles_text({*yaw, *pitch, *roll}, true);
  } else if (!recording_ && placed_) {
    title = placed_->name;
    const Pose& pose = placed_->world_T_own;
    lines += "x " + fixed_number(1e3 * pose.p[0], 1, 9) + "  y " +
             fixed_number(1e3 * pose.p[1], 1, 7) + "  z " + fixed_number(1e3 * pose.p[2], 1, 7) +
             " mm";
    if (placed_->has_angles) {
      lines += angles_text(angles_about_zyx(pose), true);
    }
  }
  if (lines == lines_ && title == shown_title_ && isVisible() == !lines.isEmpty()) return;
  lines_ = lines;
  shown_title_ = title;
  setVisible(!lines_.isEmpty());
  const Theme& t = theme();
  QFont bold = t.menu;
  bold.setWeight(QFont::DemiBold);
  const QFontMetrics numbers(t.mono), words(bold);
  int width = words.horizontalAdvance(shown_title_);
  for (const QString& line : lines_) width = std::max(width, numbers.horizontalAdvance(line));
  resize(width + 2 * t.px(kInset),
         words.height() + t.px(4) + static_cast<int>(lines_.size()) * (numbers.height() + t.px(2)) +
             t.px(8));
  update();
}

void ViewInfo::changeEvent(QEvent* event) {
  QWidget::changeEvent(event);
  if (event->type() != QEvent::StyleChange) return;
  lines_.clear();
  refresh();
}

void ViewInfo::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  // Texts are readable in front of any body, and the body is visible behind them.
  QColor ground = t.panel;
  ground.setAlphaF(0.45F);
  p.setRenderHint(QPainter::Antialiasing);
  p.setPen(Qt::NoPen);
  p.setBrush(ground);
  p.drawRoundedRect(rect(), t.radius, t.radius);
  QFont bold = t.menu;
  bold.setWeight(QFont::DemiBold);
  p.setPen(t.text);
  p.setFont(bold);
  const QFontMetrics words(bold), numbers(t.mono);
  int y = t.px(4) + words.ascent();
  p.drawText(t.px(kInset), y, shown_title_);
  p.setFont(t.mono);
  y += words.descent() + t.px(4);
  for (const QString& line : lines_) {
    p.drawText(t.px(kInset), y + numbers.ascent(), line);
    y += numbers.height() + t.px(2);
  }
}

}  // namespace robomosp::viewer
