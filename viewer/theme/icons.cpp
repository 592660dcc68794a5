// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/theme/icons.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include <QApplication>
#include <QIconEngine>
#include <QPainter>
#include <QPainterPath>

#include "viewer/theme/icon_paths.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr double kGrid = 16;

/// Reads the part of SVG's path notation that icons use: M L H V C S A Z and their relative forms.
class PathReader {
 public:
  explicit PathReader(std::string_view text) : rest_(text) {}

  QPainterPath read() {
    char command = 0;
    while (skip_space(), !rest_.empty()) {
      if (const char c = rest_.front(); (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z')) {
        command = c;
        rest_.remove_prefix(1);
      }
      if (!add(command)) break;
    }
    return path_;
  }

 private:
  void skip_space() {
    while (!rest_.empty() && (rest_.front() == ' ' || rest_.front() == ',')) rest_.remove_prefix(1);
  }
  double number() {
    skip_space();
    // Up to the second point: "1.5.5" means 1.5 and 0.5.
    std::size_t end = 0;
    bool has_point = false;
    while (end < rest_.size()) {
      const char c = rest_[end];
      const bool is_sign = c == '-' && end == 0;
      if (c == '.' ? has_point : !is_sign && (c < '0' || c > '9')) break;
      has_point = has_point || c == '.';
      ++end;
    }
    double value = 0;
    const std::string_view word = rest_.substr(0, end);
    (void)std::from_chars(word.data(), word.data() + word.size(), value);
    rest_.remove_prefix(std::max<std::size_t>(end, rest_.empty() ? 0 : 1));
    return value;
  }
  bool flag() {
    skip_space();
    const bool is_set = !rest_.empty() && rest_.front() == '1';
    if (!rest_.empty()) rest_.remove_prefix(1);
    return is_set;
  }
  QPointF point(bool is_relative) {
    const double x = number(), y = number();
    return is_relative ? path_.currentPosition() + QPointF(x, y) : QPointF(x, y);
  }
  bool add(char command) {
    const bool is_relative = command >= 'a';
    const QPointF at = path_.currentPosition();
    const QPointF before = last_control_.value_or(at);
    last_control_.reset();
    switch (is_relative ? static_cast<char>(command - 'a' + 'A') : command) {
      case 'M': {
        const QPointF to = path_.isEmpty() && is_relative ? point(false) : point(is_relative);
        path_.moveTo(to);
        return true;
      }
      case 'L': path_.lineTo(point(is_relative)); return true;
      case 'H': path_.lineTo(number() + (is_relative ? at.x() : 0), at.y()); return true;
      case 'V': path_.lineTo(at.x(), number() + (is_relative ? at.y() : 0)); return true;
      case 'C': {
        const QPointF a = point(is_relative), b = point(is_relative), to = point(is_relative);
        path_.cubicTo(a, b, to);
        last_control_ = b;
        return true;
      }
      case 'S': {
        const QPointF b = point(is_relative), to = point(is_relative);
        path_.cubicTo(2 * at - before, b, to);
        last_control_ = b;
        return true;
      }
      case 'A': {
        const double rx = number(), ry = number();
        (void)number();  // icons turn no ellipse
        const bool is_large = flag(), is_clockwise = flag();
        add_arc(rx, ry, is_large, is_clockwise, point(is_relative));
        return true;
      }
      case 'Z': path_.closeSubpath(); return true;
      default: return false;
    }
  }
  /// SVG 1.1, appendix F.6.5, without rotation.
  void add_arc(double rx, double ry, bool is_large, bool is_clockwise, QPointF to) {
    const QPointF from = path_.currentPosition();
    if (rx <= 0 || ry <= 0 || from == to) return path_.lineTo(to);
    const double x = (from.x() - to.x()) / (2 * rx), y = (from.y() - to.y()) / (2 * ry);
    const double square = x * x + y * y;
    const double grow = square > 1 ? std::sqrt(square) : 1;
    const double share = square > 1 ? 0 : std::sqrt((1 - square) / square);
    const double side = is_large == is_clockwise ? -share : share;
    const double a = rx * grow, b = ry * grow;
    const QPointF centre((from.x() + to.x()) / 2 + side * y * rx,
                         (from.y() + to.y()) / 2 - side * x * ry);
    const auto angle = [&](QPointF p) {
      return std::atan2(-(p.y() - centre.y()) / b, (p.x() - centre.x()) / a) * 180 /
             std::numbers::pi;
    };
    double sweep = angle(to) - angle(from);
    if (is_clockwise && sweep > 0) sweep -= 360;
    if (!is_clockwise && sweep < 0) sweep += 360;
    path_.arcTo(QRectF(centre.x() - a, centre.y() - b, 2 * a, 2 * b), angle(from), sweep);
  }

  std::string_view rest_;
  QPainterPath path_;
  std::optional<QPointF> last_control_;
};

const IconPath* find(std::string_view name) {
  const auto* at =
      std::lower_bound(std::begin(kIconPaths), std::end(kIconPaths), name,
                       [](const IconPath& p, std::string_view n) { return p.name < n; });
  return at != std::end(kIconPaths) && at->name == name ? at : nullptr;
}

void draw(const IconPath& icon, const QColor& colour, QPainter& painter, const QRectF& into) {
  painter.save();
  painter.setRenderHint(QPainter::Antialiasing);
  painter.translate(into.topLeft());
  painter.scale(into.width() / kGrid, into.height() / kGrid);
  painter.setPen(QPen(colour, icon.is_bold ? 2 : 1.3, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
  painter.setBrush(Qt::NoBrush);
  painter.drawPath(PathReader(icon.path).read());
  painter.restore();
}

class Engine : public QIconEngine {
 public:
  explicit Engine(const IconPath& path) : path_(path) {}
  void paint(QPainter* painter, const QRect& rect, QIcon::Mode mode, QIcon::State state) override {
    const Theme& t = theme();
    const QColor colour = mode == QIcon::Disabled ? t.disabled
                          : state == QIcon::On    ? t.accent
                          : mode == QIcon::Active ? t.text
                                                  : t.text_dim;
    const int side = std::min(rect.width(), rect.height());
    QRectF into(0, 0, side, side);
    into.moveCenter(QRectF(rect).center());
    draw(path_, colour, *painter, into);
  }
  QPixmap pixmap(const QSize& size, QIcon::Mode mode, QIcon::State state) override {
    QPixmap out(size);
    if (size.isEmpty()) return out;  // a button without space for its icon
    out.fill(Qt::transparent);
    QPainter painter(&out);
    paint(&painter, QRect(QPoint(), size), mode, state);
    return out;
  }
  QIconEngine* clone() const override { return new Engine(path_); }

 private:
  const IconPath& path_;
};

}  // namespace

QIcon icon(std::string_view name) {
  const IconPath* path = find(name);
  return path ? QIcon(new Engine(*path)) : QIcon();
}

QPixmap icon_pixmap(std::string_view name, const QColor& colour, int size,
                    double device_pixel_ratio) {
  const int side = static_cast<int>(std::lround(size * device_pixel_ratio));
  QPixmap out(side, side);
  out.fill(Qt::transparent);
  if (const IconPath* path = find(name)) {
    QPainter painter(&out);
    draw(*path, colour, painter, QRectF(0, 0, side, side));
  }
  out.setDevicePixelRatio(device_pixel_ratio);
  return out;
}

std::string_view icon_of_kind(std::string_view kind) {
  static constexpr std::pair<std::string_view, std::string_view> kOthers[] = {
      {"tip", "tool"},         {"pose", "target"},      {"segment", "segment_line"},
      {"step", "action"},      {"parameter", "matrix"}, {"camera", "camera"},
      {"solver", "console"},   {"folder", "folder"},    {"controller", "gauge"},
      {"machine", "material"}, {"session", "server"},   {"setting", "list"}};
  if (find(kind)) return kind;
  for (const auto& [of, name] : kOthers)
    if (of == kind) return name;
  return "box";
}

std::vector<std::string_view> icon_names() {
  std::vector<std::string_view> out;
  for (const IconPath& p : kIconPaths) out.push_back(p.name);
  return out;
}

}  // namespace robomosp::viewer
