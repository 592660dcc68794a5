// SPDX-License-Identifier: Apache-2.0
// DXF out (layer: plugin). Drawings of lines, arcs and circles and meshes are written as R12, which
// every program reads; splines need R2000.
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "spatial/pose.h"
#include "spline2d.h"
#include "writers.h"

namespace robomosp::cad_exchange {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

class DxfWriter {
 public:
  DxfWriter(double unit, bool is_new) : scale_(1 / unit), is_new_(is_new) {}

  void text(int code, std::string_view value) {
    out_ += std::to_string(code) + "\n" + std::string(value) + "\n";
  }
  void real(int code, double v) {
    char buffer[40];
    auto r = std::to_chars(buffer, buffer + sizeof buffer, v == 0 ? 0.0 : v);
    std::string s(buffer, r.ptr);
    if (s.find_first_of(".en") == std::string::npos) s += ".0";
    text(code, s);
  }
  void integer(int code, long long v) { text(code, std::to_string(v)); }
  void point(int code, const Point2& p, double z = 0) {
    real(code, p[0] * scale_);
    real(code + 10, p[1] * scale_);
    real(code + 20, z * scale_);
  }
  void begin(const char* kind, const char* marker, const std::string& layer) {
    text(0, kind);
    if (is_new_) {
      char handle[20];
      std::snprintf(handle, sizeof handle, "%X", ++handle_);
      text(5, handle);
      text(100, "AcDbEntity");
    }
    text(8, layer);
    if (is_new_) text(100, marker);
  }

  void line(const Point2& a, const Point2& b, const std::string& layer) {
    begin("LINE", "AcDbLine", layer);
    point(10, a);
    point(11, b);
  }
  void circle(const Point2& centre, double radius, const std::string& layer) {
    begin("CIRCLE", "AcDbCircle", layer);
    point(10, centre);
    real(40, radius * scale_);
  }
  /// DXF arcs run left round; one that runs right is written from its end.
  void arc(const Point2& a, const Point2& b, const Point2& c, const std::string& layer) {
    const double bx = b[0] - a[0], by = b[1] - a[1], cx = c[0] - a[0], cy = c[1] - a[1];
    const double twice = 2 * (bx * cy - by * cx), bb = bx * bx + by * by, cc = cx * cx + cy * cy;
    if (!(std::abs(twice) > 1e-12 * std::sqrt(bb * cc))) {
      line(a, c, layer);
      return;
    }
    const Point2 from_a{(cy * bb - by * cc) / twice, (bx * cc - cx * bb) / twice};
    const Point2 centre{a[0] + from_a[0], a[1] + from_a[1]};
    const auto angle = [&](const Point2& p) {
      const double v = std::atan2(p[1] - centre[1], p[0] - centre[0]) * kDegrees;
      return v < 0 ? v + 360 : v;
    };
    begin("ARC", "AcDbCircle", layer);
    point(10, centre);
    real(40, std::hypot(from_a[0], from_a[1]) * scale_);
    if (is_new_) text(100, "AcDbArc");
    real(50, angle(twice > 0 ? a : c));
    real(51, angle(twice > 0 ? c : a));
  }
  /// Cubic Bezier pieces, and the points it passes through for readers that know the kind of
  /// spline.
  void spline(const std::vector<Point2>& points, const std::string& layer) {
    const NaturalSpline s(points);
    const auto control = s.bezier();
    begin("SPLINE", "AcDbSpline", layer);
    integer(70, 8);  // planar
    integer(71, 3);
    integer(72, static_cast<long long>(control.size() + 4));
    integer(73, static_cast<long long>(control.size()));
    integer(74, static_cast<long long>(points.size()));
    const auto& t = s.parameters();
    for (std::size_t i = 0; i < t.size(); ++i)
      for (int k = 0; k < (i == 0 || i + 1 == t.size() ? 4 : 3); ++k) real(40, t[i] * scale_);
    for (const Point2& p : control) point(10, p);
    for (const Point2& p : points) point(11, p);
  }

  void loop(const CsgLoop& l, const std::string& layer) {
    Point2 tip = l.start;
    for (const CsgCurve& c : l.curves) {
      switch (c.kind) {
        case CsgCurve::Kind::circle: circle(c.points[0], c.points[1][0], layer); return;
        case CsgCurve::Kind::line: line(tip, c.points.back(), layer); break;
        case CsgCurve::Kind::arc: arc(tip, c.points[0], c.points[1], layer); break;
        case CsgCurve::Kind::spline: {
          std::vector<Point2> points{tip};
          points.insert(points.end(), c.points.begin(), c.points.end());
          if (points.size() == 2) line(tip, points[1], layer);
          else spline(points, layer);
          break;
        }
      }
      tip = c.points.back();
    }
    if (tip != l.start) line(tip, l.start, layer);
  }

  void faces(const Mesh& m, const Pose& at, const std::string& layer) {
    for (std::size_t t = 0; t < m.triangle_count(); ++t) {
      begin("3DFACE", "AcDbFace", layer);
      for (int c = 0; c < 4; ++c) {
        const std::size_t v =
            3 * std::size_t{m.triangles[3 * t + static_cast<std::size_t>(std::min(c, 2))]};
        const Vec3 p = spatial::transform(
            at, {static_cast<double>(m.positions[v]), static_cast<double>(m.positions[v + 1]),
                 static_cast<double>(m.positions[v + 2])});
        point(10 + c, {p[0], p[1]}, p[2]);
      }
    }
  }

  [[nodiscard]] std::string take() { return std::move(out_); }

 private:
  double scale_;
  bool is_new_;
  int handle_ = 0x100;
  std::string out_;
};

/// Layer names may hold letters, digits, - and _ in R12.
std::string layer_of(const std::string& name) {
  std::string out;
  for (const char c : name.substr(0, 31))
    out += (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-'
               ? c
               : '_';
  return out.empty() ? "0" : out;
}

}  // namespace

Result<std::string> write_dxf(std::span<const ExportItem> items, const MeshOptions& options) {
  bool has_spline = false, has_any = false;
  for (const ExportItem& item : items) {
    has_any = has_any || item.profile || item.mesh;
    if (!item.profile) continue;
    for (const CsgLoop& l : item.profile->loops)
      for (const CsgCurve& c : l.curves)
        has_spline = has_spline || c.kind == CsgCurve::Kind::spline;
  }
  if (!has_any)
    return error(ErrorCode::invalid_argument, "there is nothing to draw",
                 "Export a solid or object.");
  const int units = options.unit_name == "in"   ? 1
                    : options.unit_name == "ft" ? 2
                    : options.unit_name == "cm" ? 5
                    : options.unit_name == "m"  ? 6
                                                : 4;
  DxfWriter w(options.unit, has_spline);
  w.text(0, "SECTION");
  w.text(2, "HEADER");
  w.text(9, "$ACADVER");
  w.text(1, has_spline ? "AC1015" : "AC1009");
  w.text(9, "$INSUNITS");
  w.integer(70, units);
  w.text(9, "$MEASUREMENT");
  w.integer(70, units <= 2 ? 0 : 1);
  w.text(0, "ENDSEC");
  w.text(0, "SECTION");
  w.text(2, "ENTITIES");
  std::vector<Pose> poses;
  for (const ExportItem& item : items) {
    poses.push_back(item.parent < 0 ? item.pose
                                    : spatial::compose(poses[static_cast<std::size_t>(item.parent)],
                                                       item.pose));
    const std::string layer = layer_of(item.name);
    if (item.profile)
      for (const CsgLoop& l : item.profile->loops) w.loop(l, layer);
    else if (item.mesh) w.faces(*item.mesh, poses.back(), layer);
  }
  w.text(0, "ENDSEC");
  w.text(0, "EOF");
  return w.take();
}

}  // namespace robomosp::cad_exchange
