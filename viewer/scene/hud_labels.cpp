// SPDX-License-Identifier: GPL-3.0-or-later
// Labels over the picture: white on dark plates that never cover each other, the nearest first.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "viewer/scene/hud.h"
#include "viewer/scene/linear.h"
#include "viewer/scene/osg_geometry.h"

namespace robomosp::viewer {
namespace {

// Nominal pixels of a picture 800 pixels high.
constexpr double kLabelSize = 13, kPlateInset = 5, kPlateHeight = 19, kPlateRadius = 3,
                 kLabelOffset = 10, kRim = 4;
constexpr Colour kPlate{0x14 / 255.0F, 0x17 / 255.0F, 0x1B / 255.0F, 0.91F}, kWhite{1, 1, 1, 1},
    kLeader{1, 1, 1, 0.75F};
/// Places tried for a label before it is left out.
constexpr int kPlaces = 14;

/// Left, lower, right and upper edge of a label on the screen [px].
using Plate = std::array<double, 4>;

bool overlap(const Plate& a, const Plate& b) {
  return a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
}

/// Where labels are, in cells, so that each compares itself with its neighbours only.
class Taken {
 public:
  explicit Taken(double cell) : cell_(cell) {}
  [[nodiscard]] bool is_free(const Plate& p) const {
    bool is_so = true;
    visit(p, [&](std::pair<int, int> at) {
      const auto cell = cells_.find(at);
      if (cell == cells_.end()) return;
      for (const Plate& other : cell->second) is_so = is_so && !overlap(p, other);
    });
    return is_so;
  }
  void add(const Plate& p) {
    visit(p, [&](std::pair<int, int> at) { cells_[at].push_back(p); });
  }

 private:
  template <class See>
  void visit(const Plate& p, See&& see) const {
    const auto cell = [&](double v) { return static_cast<int>(std::floor(v / cell_)); };
    for (int x = cell(p[0]); x <= cell(p[2]); ++x)
      for (int y = cell(p[1]); y <= cell(p[3]); ++y) see({x, y});
  }
  double cell_;
  std::map<std::pair<int, int>, std::vector<Plate>> cells_;
};

/// Triangles with colours, in pixels.
class Shapes {
 public:
  explicit Shapes(bool is_linear) : is_linear_(is_linear) {}
  void plate(const Plate& p, double radius, const Colour& colour) {
    constexpr int kSteps = 3;  // of a quarter of a circle
    std::vector<osg::Vec3> rim;
    const std::array<std::array<double, 2>, 4> middles{{{p[2] - radius, p[3] - radius},
                                                        {p[0] + radius, p[3] - radius},
                                                        {p[0] + radius, p[1] + radius},
                                                        {p[2] - radius, p[1] + radius}}};
    for (std::size_t corner = 0; corner < 4; ++corner)
      for (int k = 0; k <= kSteps; ++k) {
        const double a =
            std::numbers::pi / 2 * (static_cast<double>(corner) + static_cast<double>(k) / kSteps);
        rim.push_back(point(middles[corner][0] + radius * std::cos(a),
                            middles[corner][1] + radius * std::sin(a)));
      }
    for (std::size_t i = 1; i + 1 < rim.size(); ++i) triangle(rim[0], rim[i], rim[i + 1], colour);
  }
  void line(double x0, double y0, double x1, double y1, double width, const Colour& colour) {
    const double length = std::hypot(x1 - x0, y1 - y0);
    if (!(length > 0)) return;
    const double nx = -(y1 - y0) / length * 0.5 * width, ny = (x1 - x0) / length * 0.5 * width;
    const osg::Vec3 a = point(x0 + nx, y0 + ny), b = point(x0 - nx, y0 - ny),
                    c = point(x1 - nx, y1 - ny), d = point(x1 + nx, y1 + ny);
    triangle(a, b, c, colour);
    triangle(a, c, d, colour);
  }
  [[nodiscard]] osg::ref_ptr<osg::Geometry> geometry() const {
    osg::ref_ptr<osg::Geometry> g = new osg::Geometry;
    g->setVertexArray(corners_);
    g->setColorArray(colours_, osg::Array::BIND_PER_VERTEX);
    g->addPrimitiveSet(
        new osg::DrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(corners_->size())));
    g->setUseDisplayList(false);
    g->setUseVertexBufferObjects(true);
    return g;
  }
  [[nodiscard]] bool empty() const { return corners_->empty(); }

 private:
  static osg::Vec3 point(double x, double y) {
    return {static_cast<float>(x), static_cast<float>(y), 0};
  }
  void triangle(const osg::Vec3& a, const osg::Vec3& b, const osg::Vec3& c, const Colour& colour) {
    for (const osg::Vec3& p : {a, b, c}) corners_->push_back(p);
    colours_->insert(
        colours_->end(), 3,
        is_linear_ ? linear_of(colour) : osg::Vec4f(colour.r, colour.g, colour.b, colour.a));
  }
  bool is_linear_;
  osg::ref_ptr<osg::Vec3Array> corners_ = new osg::Vec3Array;
  osg::ref_ptr<osg::Vec4Array> colours_ = new osg::Vec4Array;
};

}  // namespace

double Hud::width_of(const osgText::Text& text) {
  const osg::BoundingBox box = text.getBoundingBox();
  return box.valid() ? static_cast<double>(box.xMax() - box.xMin()) : 0;
}

osgText::Text& Hud::text_of(std::size_t n, const std::string& text) {
  while (labels_.size() <= n) labels_.push_back(new_text());
  osgText::Text& t = *labels_[n];
  t.setNodeMask(~0U);
  t.setText(text, osgText::String::ENCODING_UTF8);
  return t;
}

/// Labels are to the right of their points, or to the left at the right edge of the picture. Where
/// they would cover a nearer one, they move up or down and a line leads to their point; where no
/// place is free, they are left out and counted in the lower right corner.
std::size_t Hud::place_labels(const OrbitCamera& camera, const std::vector<Label>& labels,
                              double scale, bool is_linear) {
  struct Seen {
    double x, y, depth;  ///< y upwards [px], depth [m]
    const Label* label;
  };
  const double w = camera.width(), h = camera.height();
  std::vector<Seen> seen;
  for (const Label& label : labels) {
    const auto at = camera.project(label.place);
    if (!at || (*at)[0] < 0 || (*at)[0] > w || (*at)[1] < 0 || (*at)[1] > h) continue;
    seen.push_back(
        {(*at)[0], h - (*at)[1], dot(camera.eye() - label.place, camera.backward()), &label});
  }
  std::stable_sort(seen.begin(), seen.end(),
                   [](const Seen& a, const Seen& b) { return a.depth < b.depth; });
  grounds_->removeDrawables(0, grounds_->getNumDrawables());
  Shapes shapes(is_linear);
  const double height = kPlateHeight * scale, off = kLabelOffset * scale, rim = kRim * scale,
               inset = kPlateInset * scale, step = 1.15 * height;
  Taken taken(2 * height);
  std::size_t used = 0, left_out = 0;
  for (const Seen& s : seen) {
    osgText::Text& t = text_of(used, s.label->text);
    t.setAlignment(osgText::Text::LEFT_CENTER);
    put(t, 0, 0, kLabelSize * scale, kWhite, is_linear);
    const double wide = width_of(t) + 2 * inset;
    double x = s.x + off;
    if (x + wide > w - rim) x = s.x - off - wide;
    x = std::round(std::clamp(x, rim, std::max(rim, w - rim - wide)));
    std::optional<Plate> found;
    for (int k = 0; k < kPlaces && !found; ++k) {
      // Beside, below, above, further below and so on.
      double y = s.y - off + (k % 2 == 0 ? 1 : -1) * ((k + 1) / 2) * step;
      y = std::round(std::clamp(y, rim + 0.5 * height, std::max(rim, h - rim - 0.5 * height)));
      const Plate plate{x, y - 0.5 * height, x + wide, y + 0.5 * height};
      if (taken.is_free(plate)) found = plate;
    }
    if (!found) {
      ++left_out;
      continue;
    }
    taken.add(*found);
    const double middle = 0.5 * ((*found)[1] + (*found)[3]);
    if (std::abs(middle - s.y) > 1.2 * height)
      shapes.line(s.x, s.y, s.x < x ? x : x + wide, middle, std::max(1.0, scale), kLeader);
    shapes.plate(*found, kPlateRadius * scale, kPlate);
    put(t, x + inset, middle, kLabelSize * scale, kWhite, is_linear);
    ++used;
  }
  if (left_out > 0) {
    osgText::Text& t = text_of(used++, "+" + std::to_string(left_out) + " labels, zoom in");
    t.setAlignment(osgText::Text::LEFT_CENTER);
    put(t, 0, 0, kLabelSize * scale, kWhite, is_linear);
    const double wide = width_of(t) + 2 * inset, x = std::round(w - 3 * rim - wide),
                 y = std::round(3 * rim + 0.5 * height);
    shapes.plate({x, y - 0.5 * height, x + wide, y + 0.5 * height}, kPlateRadius * scale, kPlate);
    put(t, x + inset, y, kLabelSize * scale, kWhite, is_linear);
  }
  labels_shown_ = seen.size() - left_out;
  labels_left_out_ = left_out;
  if (!shapes.empty()) grounds_->addDrawable(shapes.geometry());
  return used;
}

}  // namespace robomosp::viewer
