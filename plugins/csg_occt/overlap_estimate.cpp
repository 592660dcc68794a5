// SPDX-License-Identifier: Apache-2.0
#include "overlap_estimate.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "engine.h"

#include <BRepAdaptor_Surface.hxx>
#include <BRepBuilderAPI_Copy.hxx>
#include <BRepGProp.hxx>
#include <GProp_GProps.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>

namespace robomosp::csg_occt {
namespace {

using Point = std::array<double, 3>;

/// Lines a side of the box in which the solids can meet.
constexpr std::size_t kLines = 192;
/// Distance of the triangles from the solids, as shares of that box and of the solid.
constexpr double kChordOfBox = 2e-5, kChordOfSolid = 5e-6;
/// Triangles of curved faces at first, about, and of a solid in the end.
constexpr double kMostCurved = 2000, kMostTriangles = 20000;
/// Coordinates of meshes are single precision.
constexpr double kSinglePrecision = 1.2e-7;

struct EstimateBox {
  Point low{}, high{};
  [[nodiscard]] double volume() const {
    double v = 1;
    for (std::size_t i = 0; i < 3; ++i) v *= std::max(0.0, high[i] - low[i]);
    return v;
  }
  [[nodiscard]] double diagonal() const {
    return std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
  }
};

EstimateBox estimate_box(const Bnd_Box& b) {
  if (b.IsVoid()) return {};
  const gp_Pnt l = b.CornerMin(), h = b.CornerMax();
  return {{l.X(), l.Y(), l.Z()}, {h.X(), h.Y(), h.Z()}};
}

EstimateBox common(const EstimateBox& a, const EstimateBox& b) {
  EstimateBox out;
  for (std::size_t i = 0; i < 3; ++i) {
    out.low[i] = std::max(a.low[i], b.low[i]);
    out.high[i] = std::max(out.low[i], std::min(a.high[i], b.high[i]));
  }
  return out;
}

EstimateBox around(const EstimateBox& a, const EstimateBox& b) {
  EstimateBox out = a;
  for (std::size_t i = 0; i < 3; ++i) {
    out.low[i] = std::min(a.low[i], b.low[i]);
    out.high[i] = std::max(a.high[i], b.high[i]);
  }
  return out;
}

/// A solid's triangles that come near the box.
struct Soup {
  std::vector<std::array<Point, 3>> triangles;
  double skin = 0;  ///< area within the box times the triangles' distance from the solid [mm^3]
};

double area_of(const std::array<Point, 3>& t) {
  Point u{}, v{};
  for (std::size_t i = 0; i < 3; ++i) {
    u[i] = t[1][i] - t[0][i];
    v[i] = t[2][i] - t[0][i];
  }
  return std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                    u[0] * v[1] - u[1] * v[0]) /
         2;
}

/// The piece of a triangle on one side of a plane through it; corners in turn.
std::vector<Point> clipped(const std::vector<Point>& in, std::size_t axis, double at, bool above) {
  std::vector<Point> out;
  for (std::size_t i = 0; i < in.size(); ++i) {
    const Point &a = in[i], &b = in[(i + 1) % in.size()];
    const double da = above ? a[axis] - at : at - a[axis], db = above ? b[axis] - at : at - b[axis];
    if (da >= 0) out.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
      Point c{};
      for (std::size_t k = 0; k < 3; ++k) c[k] = a[k] + (b[k] - a[k]) * da / (da - db);
      out.push_back(c);
    }
  }
  return out;
}

double area_within(const std::array<Point, 3>& t, const EstimateBox& box) {
  std::vector<Point> p(t.begin(), t.end());
  for (std::size_t i = 0; i < 3 && !p.empty(); ++i) {
    p = clipped(p, i, box.low[i], true);
    p = clipped(p, i, box.high[i], false);
  }
  double sum = 0;
  for (std::size_t i = 1; i + 1 < p.size(); ++i) sum += area_of({p[0], p[i], p[i + 1]});
  return sum;
}

/// Area of the faces that are no planes, cylinders or cones [mm^2].
double curved_area(const TopoDS_Shape& solid) {
  double sum = 0;
  for (TopExp_Explorer e(solid, TopAbs_FACE); e.More(); e.Next()) {
    const GeomAbs_SurfaceType type =
        BRepAdaptor_Surface(TopoDS::Face(e.Current()), false).GetType();
    if (type == GeomAbs_Plane || type == GeomAbs_Cylinder || type == GeomAbs_Cone) continue;
    GProp_GProps g;
    BRepGProp::SurfaceProperties(e.Current(), g, 1e-2);
    sum += std::abs(g.Mass());
  }
  return sum;
}

/// Nothing when the solid has no closed mesh.
Result<std::optional<Soup>> soup_of(const Solid& solid, const EstimateBox& box,
                                    Progress& progress) {
  Solid copy = solid;
  copy.shape = BRepBuilderAPI_Copy(solid.shape, true, false).Shape();
  const EstimateBox whole = estimate_box(solid.box);
  const double fine = std::max(kChordOfBox * box.diagonal(), kChordOfSolid * whole.diagonal());
  double chord = std::max(fine, curved_area(solid.shape) / (kMostCurved * whole.diagonal()));
  double farthest = 0;
  for (std::size_t i = 0; i < 3; ++i)
    farthest = std::max({farthest, std::abs(whole.low[i]), std::abs(whole.high[i])});
  const auto meshed = [&] {
    MeshQuality quality;
    quality.chord = chord / kMillimetresPerMetre;
    quality.angle = 0.2;
    return guarded("meshing the solid", [&]() -> Result<Mesh> {
      return mesh_solids({copy}, gp_Trsf(), quality, progress);
    });
  };
  auto mesh = meshed();
  if (mesh.ok() && chord > fine) {
    // As fine as a bearable number of triangles is, which grows no faster than the chord shrinks.
    const double bearable = chord * static_cast<double>(mesh->triangle_count()) / kMostTriangles;
    if (bearable < chord / 2) {
      chord = std::max(fine, bearable);
      mesh = meshed();
    }
  }
  if (!mesh.ok() && mesh.error().code == ErrorCode::cancelled) return mesh.error();
  if (!mesh.ok()) return std::optional<Soup>();
  const double off = chord + kSinglePrecision * farthest;
  Soup out;
  for (std::size_t t = 0; t < mesh->triangle_count(); ++t) {
    std::array<Point, 3> corners{};
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < 3; ++i)
        corners[c][i] =
            kMillimetresPerMetre *
            static_cast<double>(mesh->positions[3 * std::size_t{mesh->triangles[3 * t + c]} + i]);
    // What lies beside the box in two directions meets no line; along lines it counts.
    int beside = 0;
    bool is_out = false;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [low, high] = std::minmax({corners[0][i], corners[1][i], corners[2][i]});
      if (low > box.high[i] + off || high < box.low[i] - off) ++beside;
    }
    is_out = beside > 1;
    if (is_out) continue;
    if (beside == 0) out.skin += off * area_within(corners, box);
    out.triangles.push_back(corners);
  }
  return std::optional<Soup>(std::move(out));
}

struct Crossing {
  double at = 0;
  int turn = 0;  ///< +1 into the solid
};
using Interval = std::pair<double, double>;

/// Lines along one axis through the middles of a grid of cells.
class Lines {
 public:
  Lines(const EstimateBox& box, std::size_t axis)
      : axis_(axis), u_((axis + 1) % 3), v_((axis + 2) % 3), box_(box) {
    du_ = (box.high[u_] - box.low[u_]) / static_cast<double>(kLines);
    dv_ = (box.high[v_] - box.low[v_]) / static_cast<double>(kLines);
  }
  [[nodiscard]] double cell() const { return du_ * dv_; }
  /// Off the middle by a little, so that lines miss edges that lie on round numbers.
  [[nodiscard]] double u(std::size_t i) const {
    return box_.low[u_] + du_ * (static_cast<double>(i) + 0.4983);
  }
  [[nodiscard]] double v(std::size_t k) const {
    return box_.low[v_] + dv_ * (static_cast<double>(k) + 0.5019);
  }
  [[nodiscard]] std::size_t axis() const { return axis_; }
  [[nodiscard]] std::size_t u_axis() const { return u_; }
  [[nodiscard]] std::size_t v_axis() const { return v_; }

  [[nodiscard]] std::vector<std::vector<Crossing>> through(const Soup& soup) const {
    std::vector<std::vector<Crossing>> out(kLines * kLines);
    for (const auto& t : soup.triangles) {
      const double ax = t[0][u_], ay = t[0][v_], bx = t[1][u_], by = t[1][v_], cx = t[2][u_],
                   cy = t[2][v_];
      const double twice = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
      if (twice == 0) continue;
      const auto [i0, i1] =
          range(std::min({ax, bx, cx}), std::max({ax, bx, cx}), box_.low[u_], du_);
      const auto [k0, k1] =
          range(std::min({ay, by, cy}), std::max({ay, by, cy}), box_.low[v_], dv_);
      for (std::size_t i = i0; i < i1; ++i)
        for (std::size_t k = k0; k < k1; ++k) {
          const double x = u(i), y = v(k);
          const double wa = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / twice;
          const double wb = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / twice;
          const double wc = 1 - wa - wb;
          if (wa < 0 || wb < 0 || wc < 0) continue;
          out[i * kLines + k].push_back(
              {wa * t[0][axis_] + wb * t[1][axis_] + wc * t[2][axis_], twice < 0 ? 1 : -1});
        }
    }
    return out;
  }

 private:
  static std::pair<std::size_t, std::size_t> range(double low, double high, double from,
                                                   double step) {
    if (!(step > 0)) return {0, 0};
    const auto cell = [&](double x) {
      return static_cast<std::size_t>(
          std::clamp((x - from) / step, 0.0, static_cast<double>(kLines)));
    };
    return {cell(low), std::min(cell(high) + 1, kLines)};
  }
  std::size_t axis_, u_, v_;
  EstimateBox box_;
  double du_ = 0, dv_ = 0;
};

/// Where a line is inside; nothing when it missed the surface somewhere.
std::optional<std::vector<Interval>> inside(std::vector<Crossing>& all) {
  std::sort(all.begin(), all.end(),
            [](const Crossing& a, const Crossing& b) { return a.at < b.at; });
  std::vector<Interval> out;
  int depth = 0;
  double from = 0;
  for (const Crossing& c : all) {
    if (depth == 0) from = c.at;
    depth += c.turn;
    if (depth == 0) out.emplace_back(from, c.at);
  }
  if (depth != 0) return std::nullopt;
  return out;
}

void add_interval(Integrals& sum, const Lines& lines, double u, double v, double from, double to) {
  const double c = lines.cell(), length = to - from, half = (to * to - from * from) / 2,
               third = (to * to * to - from * from * from) / 3;
  Point q{};
  q[lines.u_axis()] = u;
  q[lines.v_axis()] = v;
  sum.volume += c * length;
  const std::size_t a = lines.axis();
  for (std::size_t i = 0; i < 3; ++i) sum.first[i] += c * (i == a ? half : q[i] * length);
  const auto product = [&](std::size_t i, std::size_t k) {
    if (i == a && k == a) return c * third;
    if (i == a) return c * q[k] * half;
    if (k == a) return c * q[i] * half;
    return c * q[i] * q[k] * length;
  };
  constexpr std::array<std::array<std::size_t, 2>, 6> kPairs{
      {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}}};
  for (std::size_t i = 0; i < 6; ++i) sum.second[i] += product(kPairs[i][0], kPairs[i][1]);
}

}  // namespace

Result<SharedVolume> measure_shared(const Solid& mine, const std::vector<const Solid*>& others,
                                    Progress& progress) {
  SharedVolume out;
  const EstimateBox own = estimate_box(mine.box);
  std::optional<EstimateBox> region;
  double boxes = 0;
  for (const Solid* s : others) {
    const EstimateBox b = common(own, estimate_box(s->box));
    boxes += b.volume();
    region = region ? around(*region, b) : b;
  }
  const double most = std::min(std::abs(mine.volume), boxes);
  if (!region || !(most > 0)) return out;
  RMP_TRY_ASSIGN(const auto first, soup_of(mine, *region, progress));
  std::vector<Soup> rest;
  for (const Solid* s : others) {
    if (!first) break;
    RMP_TRY_ASSIGN(auto soup, soup_of(*s, *region, progress));
    if (!soup) break;
    rest.push_back(std::move(*soup));
  }
  if (!first || rest.size() != others.size()) {
    out.deviation = most;
    return out;
  }
  std::array<Integrals, 3> along{};
  double missed = 0, coarsest = 0;  // [mm^3]
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Lines lines(*region, axis);
    if (!(lines.cell() > 0)) return out;
    coarsest = std::max(coarsest, lines.cell() * (region->high[axis] - region->low[axis]));
    auto a = lines.through(*first);
    std::vector<std::vector<std::vector<Crossing>>> b;
    for (const Soup& s : rest) {
      if (progress.cancelled()) return cancelled_error();
      b.push_back(lines.through(s));
    }
    for (std::size_t i = 0; i < kLines; ++i) {
      if (progress.cancelled()) return cancelled_error();
      for (std::size_t k = 0; k < kLines; ++k) {
        auto& line = a[i * kLines + k];
        if (line.empty()) continue;
        const auto of_mine = inside(line);
        std::vector<Interval> taken;
        bool is_whole = of_mine.has_value();
        for (auto& soup : b) {
          const auto some = inside(soup[i * kLines + k]);
          is_whole &= some.has_value();
          if (some) taken.insert(taken.end(), some->begin(), some->end());
        }
        if (!is_whole) {
          missed += lines.cell() * (line.back().at - line.front().at);
          continue;
        }
        std::sort(taken.begin(), taken.end());
        for (const Interval& m : *of_mine) {
          double from = m.first;
          for (const Interval& t : taken) {
            const double low = std::max(from, t.first), high = std::min(m.second, t.second);
            if (high <= low) continue;
            add_interval(along[axis], lines, lines.u(i), lines.v(k), low, high);
            from = high;
          }
        }
      }
    }
  }
  // Where faces slide along lines one direction is worse than the others: the middle one counts.
  std::array<std::size_t, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return along[a].volume < along[b].volume; });
  out.moments = along[order[1]];
  out.deviation =
      (along[order[2]].volume - along[order[0]].volume) + 4 * coarsest + missed + first->skin;
  for (const Soup& s : rest) out.deviation += s.skin;
  out.deviation = std::min(out.deviation, most);
  return out;
}

}  // namespace robomosp::csg_occt
