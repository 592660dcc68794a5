// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/gizmo/hover.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <unordered_set>
#include <utility>

#include <QFontMetrics>
#include <QPainter>

#include "viewer/gizmo/view_tools.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr int kHoverRestMs = 60;
constexpr double kHoverWidth = 1.6;  ///< of the outline [px of the design]
constexpr float kHoverOpacity = 0.8F;
constexpr std::size_t kMostOutlined = 300'000;  ///< triangles

/// Pixels that the items cover.
struct CoverMask {
  int left = 0, top = 0, width = 0, height = 0;  ///< in the view [px]
  std::vector<std::uint8_t> is_on;
};

/// Pixels with their middle in a triangle.
void cover(CoverMask& mask, std::array<QPointF, 3> p) {
  std::sort(p.begin(), p.end(), [](QPointF a, QPointF b) { return a.y() < b.y(); });
  const double high = p[2].y() - p[0].y();
  if (!(high > 1e-9)) return;
  const auto first = [](double from, double least) {
    return static_cast<int>(std::max(std::ceil(from - 0.5), least));
  };
  const auto last = [](double to, double most) {
    return static_cast<int>(std::min(std::floor(to - 0.5), most));
  };
  if (p[2].y() < 0 || p[0].y() > mask.height) return;
  for (int y = first(p[0].y(), 0), end = last(p[2].y(), mask.height - 1); y <= end; ++y) {
    const double middle = y + 0.5;
    const auto on_side = [&](QPointF a, QPointF b) {
      const double t = (middle - a.y()) / std::max(b.y() - a.y(), 1e-9);
      return a.x() + t * (b.x() - a.x());
    };
    const double one = on_side(p[0], p[2]);
    const double other = middle < p[1].y() ? on_side(p[0], p[1]) : on_side(p[1], p[2]);
    const double low = std::min(one, other), most = std::max(one, other);
    if (!(most >= 0) || !(low <= mask.width)) continue;
    const int from = first(low, 0), to = last(most, mask.width - 1);
    if (to >= from)
      std::memset(mask.is_on.data() + static_cast<std::ptrdiff_t>(y) * mask.width + from, 1,
                  static_cast<std::size_t>(to - from + 1));
  }
}

/// Places of the vertices of an item in the picture of a camera [px]; not finite behind the eye.
std::vector<QPointF> pixels_of(const Item& item, const OrbitCamera& camera) {
  const Matrix4 p = camera.projection(0.01, 1000), v = camera.view();
  // Rows x, y and w of clip_T_item.
  std::array<std::array<double, 4>, 3> rows{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t row = k == 2 ? 3 : k;
    std::array<double, 4> r{};
    for (std::size_t c = 0; c < 4; ++c)
      for (std::size_t i = 0; i < 4; ++i) r[c] += p[4 * row + i] * v[4 * i + c];
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < 3; ++i) rows[k][c] += r[i] * item.pose.R[3 * i + c];
    rows[k][3] = r[3];
    for (std::size_t i = 0; i < 3; ++i) rows[k][3] += r[i] * item.pose.p[i];
  }
  const Mesh& mesh = *item.mesh;
  std::vector<QPointF> out(mesh.positions.size() / 3);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto x = static_cast<double>(mesh.positions[3 * i]),
               y = static_cast<double>(mesh.positions[3 * i + 1]),
               z = static_cast<double>(mesh.positions[3 * i + 2]);
    const auto dot_row = [&](const std::array<double, 4>& r) {
      return r[0] * x + r[1] * y + r[2] * z + r[3];
    };
    const double w = dot_row(rows[2]);
    constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();
    out[i] = w > 1e-6 ? QPointF(0.5 * (dot_row(rows[0]) / w + 1) * camera.width(),
                                0.5 * (1 - dot_row(rows[1]) / w) * camera.height())
                      : QPointF(kNowhere, kNowhere);
  }
  return out;
}

/// A line outside of the pixels that are on.
QImage line_around(const CoverMask& mask, double width, const QColor& colour) {
  const auto reach = static_cast<int>(std::ceil(width + 0.5));
  std::vector<float> line(mask.is_on.size(), 0.0F);
  const auto at = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(mask.width) +
           static_cast<std::size_t>(x);
  };
  const auto is_off = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < mask.width && y < mask.height && mask.is_on[at(x, y)] == 0;
  };
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) {
      if (mask.is_on[at(x, y)] == 0) continue;
      if (!is_off(x - 1, y) && !is_off(x + 1, y) && !is_off(x, y - 1) && !is_off(x, y + 1))
        continue;
      for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx) {
          if (!is_off(x + dx, y + dy)) continue;
          const double share = std::clamp(width + 1 - std::hypot(dx, dy), 0.0, 1.0);
          float& there = line[at(x + dx, y + dy)];
          there = std::max(there, static_cast<float>(share));
        }
    }
  QImage out(mask.width, mask.height, QImage::Format_ARGB32_Premultiplied);
  for (int y = 0; y < mask.height; ++y) {
    auto* row = reinterpret_cast<QRgb*>(out.scanLine(y));
    for (int x = 0; x < mask.width; ++x) {
      const float a = line[at(x, y)] * kHoverOpacity;
      const auto part = [a](int c) {
        return static_cast<int>(std::lround(a * static_cast<float>(c)));
      };
      row[x] = qRgba(part(colour.red()), part(colour.green()), part(colour.blue()), part(255));
    }
  }
  return out;
}

}  // namespace

std::optional<ItemOutline> outline_around(const Frame& frame,
                                          const std::vector<std::uint64_t>& items,
                                          const Display::View& view, double ratio, double width,
                                          const QColor& colour) {
  std::vector<const Item*> shown;
  std::size_t triangles = 0;
  const std::unordered_set<std::uint64_t> wanted(items.begin(), items.end());
  for (const Item& item : frame.items) {
    if (!item.mesh || !wanted.contains(item.id)) continue;
    triangles += item.mesh->triangles.size() / 3;
    shown.push_back(&item);
  }
  if (shown.empty() || triangles > kMostOutlined) return std::nullopt;
  std::vector<std::vector<QPointF>> places;
  double left = view.camera.width(), top = view.camera.height(), right = 0, bottom = 0;
  for (const Item* item : shown) {
    places.push_back(pixels_of(*item, view.camera));
    for (const QPointF& p : places.back()) {
      if (!std::isfinite(p.x())) continue;
      left = std::min(left, p.x()), right = std::max(right, p.x());
      top = std::min(top, p.y()), bottom = std::max(bottom, p.y());
    }
  }
  const double margin = std::ceil(width) + 2;
  CoverMask mask;
  mask.left = static_cast<int>(std::floor(std::max(left - margin, 0.0)));
  mask.top = static_cast<int>(std::floor(std::max(top - margin, 0.0)));
  mask.width = static_cast<int>(std::min(right + margin, 1.0 * view.camera.width())) - mask.left;
  mask.height = static_cast<int>(std::min(bottom + margin, 1.0 * view.camera.height())) - mask.top;
  if (mask.width <= 0 || mask.height <= 0) return std::nullopt;
  mask.is_on.resize(static_cast<std::size_t>(mask.width) * static_cast<std::size_t>(mask.height));
  const QPointF corner(mask.left, mask.top);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const std::vector<QPointF>& at = places[i];
    const auto& t = shown[i]->mesh->triangles;
    for (std::size_t k = 0; k + 2 < t.size(); k += 3) {
      if (t[k] >= at.size() || t[k + 1] >= at.size() || t[k + 2] >= at.size()) continue;
      const std::array<QPointF, 3> p{at[t[k]] - corner, at[t[k + 1]] - corner,
                                     at[t[k + 2]] - corner};
      if (std::isfinite(p[0].x()) && std::isfinite(p[1].x()) && std::isfinite(p[2].x()))
        cover(mask, p);
    }
  }
  if (std::find(mask.is_on.begin(), mask.is_on.end(), 1) == mask.is_on.end()) return std::nullopt;
  ItemOutline out{line_around(mask, width, colour), view.place.topLeft() + corner / ratio};
  out.image.setDevicePixelRatio(ratio);
  return out;
}

Hover::Hover(Desk& desk, Display& display, std::function<void(const QRect&)> redraw)
    : desk_(desk), display_(display), redraw_(std::move(redraw)) {
  rest_.setSingleShot(true);
  rest_.setInterval(kHoverRestMs);
  connect(&rest_, &QTimer::timeout, this, [this] { look(); });
  desk_.hover_changed.add(this, [this](const QObject* from) {
    if (from == this || !display_.isVisible()) return;
    is_inside_ = false;
    is_elsewhere_ = !desk_.hovered().empty();
    if (is_elsewhere_) return rest_.start();
    rest_.stop();
    show({}, false);
  });
}

void Hover::set_frame(const viewer::Frame& frame) {
  frame_ = &frame;
  ++frames_;
  check();
}

void Hover::move(QPointF at) {
  at_ = at;
  is_inside_ = true;
  is_elsewhere_ = false;
  rest_.start();
}

void Hover::clear() {
  rest_.stop();
  const bool was_here = std::exchange(is_inside_, false);
  is_elsewhere_ = false;
  show({}, false);
  if (was_here) desk_.hover({}, this);
}

void Hover::check() {
  if (shown_.what.empty()) return;
  const Display::View now = is_elsewhere_ ? display_.active_view() : display_.view_at(at_);
  if (drawn_for_ == frames_ && now.camera == view_.camera && now.place == view_.place) return;
  forget();
  if (is_inside_ || is_elsewhere_) rest_.start();
}

void Hover::look() {
  if (!frame_ || !display_.isVisible()) return;
  ++looks_;
  if (is_elsewhere_) {
    Hovered rows;
    rows.what = desk_.hovered();
    if (items_of) rows.items = items_of(rows.what);
    return show(std::move(rows), false);
  }
  if (!is_inside_) return;
  Hovered found = find ? find(at_) : Hovered();
  const Selection what = found.what;
  show(std::move(found), true);
  desk_.hover(what, this);
}

void Hover::show(Hovered what, bool is_here) {
  const Display::View now = is_here ? display_.view_at(at_) : display_.active_view();
  const bool is_same = what.what == shown_.what && what.name == shown_.name &&
                       what.items == shown_.items && drawn_for_ == frames_ &&
                       now.camera == view_.camera && now.place == view_.place;
  if (is_same) {
    if (shown_.name.isEmpty() || label_at_ == at_) return;
    const QRect before = label_place();
    label_at_ = at_;
    return redraw_(before | label_place());
  }
  forget();
  if (what.what.empty()) return;
  shown_ = std::move(what);
  label_at_ = at_;
  view_ = now;
  drawn_for_ = frames_;
  // The two pictures of a stereo pair are taken from elsewhere.
  const std::unordered_set<std::uint64_t> wanted(shown_.items.begin(), shown_.items.end());
  const bool has_line =
      display_.stereo().mode == Stereo::none &&
      std::any_of(frame_->items.begin(), frame_->items.end(),
                  [&](const Item& item) { return !item.selected && wanted.contains(item.id); });
  const double ratio = display_.devicePixelRatioF();
  if (has_line)
    outline_ = outline_around(*frame_, shown_.items, view_, ratio,
                              ratio * theme().px(10 * kHoverWidth) / 10.0, theme().accent);
  redraw_(place_shown());
}

/// Shows nothing.
void Hover::forget() {
  if (!shown_.what.empty()) redraw_(place_shown());
  outline_.reset();
  shown_ = {};
}

/// The part of the display with what is shown; all of it for marks without an outline.
QRect Hover::place_shown() const {
  if (!outline_) return display_.rect();
  const QRect line = QRectF(outline_->at, outline_->image.deviceIndependentSize()).toAlignedRect();
  return shown_.name.isEmpty() ? line : line | label_place();
}

QRect Hover::label_place() const {
  const Theme& t = theme();
  const QSize text =
      QFontMetrics(t.mono)
          .boundingRect(QRect(0, 0, t.px(420), t.px(400)), Qt::TextWordWrap, shown_.name)
          .size();
  QRectF box(label_at_ + QPointF(t.px(14), t.px(18)), text + QSize(t.gap, t.gap / 2));
  const QRectF all = view_.place;
  if (box.right() > all.right() - 2) box.moveRight(std::max(label_at_.x() - 4, all.left()));
  if (box.bottom() > all.bottom() - 2) box.moveBottom(label_at_.y() - 6);
  return box.toAlignedRect().adjusted(-1, -1, 1, 1);
}

void Hover::paint(QPainter& painter) const {
  if (outline_) painter.drawImage(outline_->at, outline_->image);
  if (shown_.name.isEmpty()) return;
  const Theme& t = theme();
  paint_label(painter, QPointF(label_place().topLeft()) + QPointF(1, 1), shown_.name,
              t.label_ground, t.label);
}

}  // namespace robomosp::viewer
