// SPDX-License-Identifier: Apache-2.0
#include "face_memory.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRep_Tool.hxx>
#include <GCPnts_AbscissaPoint.hxx>
#include <Geom2dAdaptor_Curve.hxx>
#include <Geom2d_BSplineCurve.hxx>
#include <Geom2d_Curve.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <math.hxx>
#include <math_Vector.hxx>

namespace robomosp::csg_occt {
namespace {

constexpr int kFaceCacheLimit = 50'000;
constexpr double kQuarterTurn = 1.5707963267948966;
// Whole against halves; what a trimming curve of tolerance 1e-7 mm deserves.
constexpr double kRelativeTolerance = 1e-12;
// Where a curve is only as good as its tolerance, its integral need not be much better: halving on
// for digits that mean nothing took minutes for the threads of one bolt.
constexpr double kShareOfDoubt = 0.01;
constexpr int kDeepestHalving = 12;
// How far poles may be off the line that their spline is, of their size.
constexpr double kStraight = 1e-13;
// In all, for one edge of a face: what a damaged curve asks for has an end.
constexpr int kMostHalvings = 2'000;

// One entry per integral: volume, first (3), second (6), area.
constexpr std::size_t kIntegrals = 11;
using Sums = std::array<double, kIntegrals>;

void accumulate(Sums& into, const Sums& from, double factor) {
  for (std::size_t i = 0; i < kIntegrals; ++i) into[i] += factor * from[i];
}

template <int N>
struct GaussRule {
  std::array<double, N> x{}, w{};  // on -1..1
  GaussRule() {
    math_Vector points(1, N), weights(1, N);
    math::GaussPoints(N, points);
    math::GaussWeights(N, weights);
    for (int i = 0; i < N; ++i) {
      x[static_cast<std::size_t>(i)] = points(i + 1);
      w[static_cast<std::size_t>(i)] = weights(i + 1);
    }
  }
};
template <int N>
const GaussRule<N>& gauss() {
  static const GaussRule<N> rule;
  return rule;
}

/// By Green's theorem the integral of f over the trimmed domain is the sum over its oriented
/// boundary curves (u(t), v(t)) of the integral of v'(t) F(u(t), v(t)) dt with
/// F(u, v) = integral of f(s, v) ds from a fixed u0 to u. f is the flux of the position through
/// the surface, weighted: div(P) = 3, div(P x) = 4 x, div(P x y) = 5 x y.
class FaceIntegrator {
 public:
  FaceIntegrator(const TopoDS_Face& face, const Progress& progress)
      : progress_(progress),
        face_(TopoDS::Face(face.Oriented(TopAbs_FORWARD))),
        surface_(face_, false) {
    is_plane_ = surface_.GetType() == GeomAbs_Plane;
    if (is_plane_) plane_ = surface_.Plane();
    is_cylinder_ = surface_.GetType() == GeomAbs_Cylinder;
    if (is_cylinder_) cylinder_ = surface_.Cylinder();
    u0_ = surface_.FirstUParameter();
    if (!std::isfinite(u0_) || std::abs(u0_) > 1e50) u0_ = 0;
    switch (surface_.GetType()) {
      case GeomAbs_Sphere:
      case GeomAbs_Torus: v_is_angle_ = true; [[fallthrough]];
      case GeomAbs_Cylinder:
      case GeomAbs_Cone: u_is_angle_ = true; break;
      case GeomAbs_SurfaceOfRevolution:
        u_is_angle_ = true;
        has_knots_ = true;
        break;
      default: has_knots_ = surface_.GetType() != GeomAbs_Plane; break;
    }
    if (!has_knots_) return;
    TColStd_Array1OfReal u(1, surface_.NbUIntervals(GeomAbs_CN) + 1);
    surface_.UIntervals(u, GeomAbs_CN);
    u_knots_.assign(u.begin(), u.end());
    TColStd_Array1OfReal v(1, surface_.NbVIntervals(GeomAbs_CN) + 1);
    surface_.VIntervals(v, GeomAbs_CN);
    v_knots_.assign(v.begin(), v.end());
  }

  Integrals run() {
    Integrals result;
    for (TopExp_Explorer e(face_, TopAbs_VERTEX); e.More(); e.Next())
      reach_ = std::max(reach_, BRep_Tool::Pnt(TopoDS::Vertex(e.Current())).XYZ().Modulus());
    for (TopExp_Explorer e(face_, TopAbs_EDGE); e.More(); e.Next()) {
      const TopoDS_Edge& edge = TopoDS::Edge(e.Current());
      const bool forward = edge.Orientation() == TopAbs_FORWARD;
      if (!forward && edge.Orientation() != TopAbs_REVERSED) continue;
      double first = 0, last = 0;
      const Handle(Geom2d_Curve) curve = BRep_Tool::CurveOnSurface(edge, face_, first, last);
      if (curve.IsNull()) throw Standard_Failure("a face has an edge without a parameter curve");
      const Geom2dAdaptor_Curve trim(curve, first, last);
      result.trim_doubt += add_curve(edge, trim, forward ? 1.0 : -1.0);
    }
    result.volume = total_[0] / 3;
    for (std::size_t i = 0; i < 3; ++i) result.first[i] = total_[1 + i] / 4;
    for (std::size_t i = 0; i < 6; ++i) result.second[i] = total_[4 + i] / 5;
    result.area = total_[10];
    result.trim_doubt += unresolved_;
    return result;
  }

 private:
  /// Returns the area by which the curve may be off because it is only an approximation [mm^2].
  double add_curve(const TopoDS_Edge& edge, const Geom2dAdaptor_Curve& trim, double sign) {
    const double a = trim.FirstParameter(), b = trim.LastParameter();
    const GeomAbs_CurveType type = trim.GetType();
    if (const auto straight = straight_of(trim)) {
      const gp_Vec2d& d = straight->slope;
      // Along a line of constant v nothing is swept; this skips the rims of cylinders.
      if (d.Y() == 0) return 0;
      double turns = 0;
      if (is_cylinder_ && d.X() == 0) {
        add_cylinder_line(straight->origin.X(), trim.Value(a).Y(), trim.Value(b).Y(), sign);
        return 0;
      }
      // A polynomial of degree at most 4 along the line: four points are exact.
      if (is_plane_ || (u_is_angle_ && !v_is_angle_ && !has_knots_ && d.X() == 0)) {
        accumulate(total_, span<4>(trim, a, b), sign);
        return 0;
      }
      if (u_is_angle_) turns = std::max(turns, std::abs(d.X() * (b - a)) / kQuarterTurn);
      if (v_is_angle_) turns = std::max(turns, std::abs(d.Y() * (b - a)) / kQuarterTurn);
      if (has_knots_) {
        // A spline is another polynomial beyond every knot.
        const gp_Pnt2d& origin = straight->origin;
        std::vector<double> breaks{a, b};
        const auto add = [&](const std::vector<double>& knots, double from, double slope) {
          for (const double knot : knots)
            if (const double t = (knot - from) / slope; slope != 0 && t > a && t < b)
              breaks.push_back(t);
        };
        add(v_knots_, origin.Y(), d.Y());
        if (!u_is_angle_) add(u_knots_, origin.X(), d.X());
        std::sort(breaks.begin(), breaks.end());
        for (std::size_t i = 1; i < breaks.size(); ++i)
          fixed_pieces(trim, breaks[i - 1], breaks[i], std::max(2, pieces(turns)), sign);
        return 0;
      }
      fixed_pieces(trim, a, b, pieces(turns), sign);
      return 0;
    }
    if (is_plane_ && (type == GeomAbs_Circle || type == GeomAbs_Ellipse)) {
      fixed_pieces(trim, a, b, pieces((b - a) / kQuarterTurn), sign);
      return 0;
    }
    const double doubt = BRep_Tool::Degenerated(edge)
                             ? 0
                             : BRep_Tool::Tolerance(edge) *
                                   GCPnts_AbscissaPoint::Length(BRepAdaptor_Curve(edge), 1e-2);
    const int spans = trim.NbIntervals(GeomAbs_C2);
    TColStd_Array1OfReal knots(1, spans + 1);
    trim.Intervals(knots, GeomAbs_C2);
    std::vector<Part> parts;
    double area = 0;
    for (int i = 1; i <= spans; ++i) {
      if (progress_.cancelled()) throw Interrupted{};
      parts.push_back({knots(i), knots(i + 1), span<8>(trim, knots(i), knots(i + 1)), 0});
      area += std::abs(parts.back().sums[10]);
    }
    unresolved_ += adaptive(trim, std::move(parts), area, doubt, sign);
    return doubt;
  }

  /// A curve of the form origin + t slope.
  struct Straight {
    gp_Pnt2d origin;
    gp_Vec2d slope;
  };
  static std::optional<Straight> straight_of(const Geom2dAdaptor_Curve& trim) {
    if (trim.GetType() == GeomAbs_Line)
      return Straight{trim.Line().Location(), gp_Vec2d(trim.Line().Direction())};
    // Lines of solids that were stretched come as splines, whose poles lie on the line at the means
    // of their knots (Greville).
    if (trim.GetType() != GeomAbs_BSplineCurve || trim.IsRational()) return {};
    const double a = trim.FirstParameter(), b = trim.LastParameter();
    const gp_Pnt2d start = trim.Value(a), end = trim.Value(b);
    gp_Vec2d slope = gp_Vec2d(start, end) / (b - a);
    const double slack = kStraight * (1 + start.XY().Modulus() + end.XY().Modulus());
    for (const int i : {1, 2})
      if (std::abs(slope.XY().Coord(i) * (b - a)) < slack) slope.SetCoord(i, 0);
    const Handle(Geom2d_BSplineCurve) spline = trim.BSpline();
    const TColStd_Array1OfReal& knots = spline->KnotSequence();
    for (int i = 1; i <= spline->NbPoles(); ++i) {
      double mean = 0;
      for (int k = 1; k <= spline->Degree(); ++k) mean += knots(i + k) / spline->Degree();
      if (spline->Pole(i).Distance(start.Translated(slope * (mean - a))) > slack) return {};
    }
    return Straight{start.Translated(slope * -a), slope};
  }

  static int pieces(double turns) { return std::max(1, static_cast<int>(std::ceil(turns - 1e-9))); }

  // 12 points integrate the trigonometric polynomials met here (degree at most 5 over a quarter
  // turn) to rounding.
  void fixed_pieces(const Geom2dAdaptor_Curve& trim, double a, double b, int n, double sign) {
    for (int i = 0; i < n; ++i)
      accumulate(total_, span<12>(trim, a + (b - a) * i / n, a + (b - a) * (i + 1) / n), sign);
  }

  struct Part {
    double a, b;
    Sums sums;
    int depth;
  };

  // Tolerances are set by the size of the swept area and its distance from the origin, because a
  // single integral may vanish by symmetry.
  double adaptive(const Geom2dAdaptor_Curve& trim, std::vector<Part> open, double area,
                  double doubt, double sign) {
    const double r = std::max(reach_, std::sqrt(area));
    const double tolerance = std::max(kRelativeTolerance * area, kShareOfDoubt * doubt);
    int halvings = 0;
    double left_over = 0;  // area by which parts that were not halved further may be off
    while (!open.empty()) {
      if (progress_.cancelled()) throw Interrupted{};
      const Part part = open.back();
      open.pop_back();
      const double middle = (part.a + part.b) / 2;
      const Sums left = span<8>(trim, part.a, middle), right = span<8>(trim, middle, part.b);
      bool good = true;
      for (std::size_t i = 0; i < kIntegrals; ++i) {
        const double scale = i == 0 ? r : i < 4 ? r * r : i < 10 ? r * r * r : 1;
        good &= std::abs(left[i] + right[i] - part.sums[i]) <= tolerance * scale;
      }
      if (good || part.depth >= kDeepestHalving || halvings >= kMostHalvings) {
        accumulate(total_, left, sign);
        accumulate(total_, right, sign);
        if (halvings >= kMostHalvings && !good)
          left_over += std::abs(left[10] + right[10] - part.sums[10]);
      } else {
        ++halvings;
        open.push_back({part.a, middle, left, part.depth + 1});
        open.push_back({middle, part.b, right, part.depth + 1});
      }
    }
    return left_over;
  }

  template <int N>
  Sums span(const Geom2dAdaptor_Curve& trim, double a, double b) const {
    Sums sums{};
    const double half = (b - a) / 2, middle = (a + b) / 2;
    const auto& rule = gauss<N>();
    for (std::size_t i = 0; i < static_cast<std::size_t>(N); ++i) {
      gp_Pnt2d uv;
      gp_Vec2d tangent;
      trim.D1(middle + half * rule.x[i], uv, tangent);
      const double weight = half * rule.w[i] * tangent.Y();
      if (weight != 0) accumulate(sums, strip(uv.X(), uv.Y()), weight);
    }
    return sums;
  }

  // F(u, v): along one line of constant v from u0 to u.
  Sums strip(double u, double v) const {
    Sums sums{};
    const double length = u - u0_;
    if (length == 0) return sums;
    if (is_plane_) {  // integrands of degree 2 in u: two points are exact
      add_points<2>(sums, u0_, u, v);
    } else if (u_is_angle_) {
      const int n = pieces(std::abs(length) / kQuarterTurn);
      for (int i = 0; i < n; ++i)
        add_points<10>(sums, u0_ + length * i / n, u0_ + length * (i + 1) / n, v);
    } else {
      std::vector<double> breaks{u0_};
      for (const double knot : u_knots_)
        if ((knot - u0_) * (knot - u) < 0) breaks.push_back(knot);
      breaks.push_back(u);
      std::sort(breaks.begin(), breaks.end());
      const double sign = length < 0 ? -1 : 1;
      const int n = breaks.size() > 4 ? 1 : 4;
      Sums part{};
      for (std::size_t k = 1; k < breaks.size(); ++k) {
        const double from = breaks[k - 1], step = (breaks[k] - from) / n;
        for (int i = 0; i < n; ++i) add_points<20>(part, from + step * i, from + step * (i + 1), v);
      }
      accumulate(sums, part, sign);
    }
    return sums;
  }

  static void add_flux(Sums& sums, const gp_XYZ& p, const gp_XYZ& n, double weight) {
    const double flux = weight * p.Dot(n);
    const double x = p.X(), y = p.Y(), z = p.Z();
    sums[0] += flux;
    sums[1] += flux * x;
    sums[2] += flux * y;
    sums[3] += flux * z;
    sums[4] += flux * x * x;
    sums[5] += flux * y * y;
    sums[6] += flux * z * z;
    sums[7] += flux * x * y;
    sums[8] += flux * y * z;
    sums[9] += flux * x * z;
    sums[10] += weight * n.Modulus();
  }

  // A straight line up a cylinder: span<4>() of strip(), with each direction worked out once.
  void add_cylinder_line(double u, double v0, double v1, double sign) {
    const double length = u - u0_;
    if (length == 0) return;
    const gp_Ax3& frame = cylinder_.Position();
    const gp_XYZ x = frame.XDirection().XYZ() * cylinder_.Radius(),
                 y = frame.YDirection().XYZ() * cylinder_.Radius(), axis = frame.Direction().XYZ(),
                 origin = frame.Location().XYZ();
    const double outward = frame.Direct() ? 1 : -1;
    const int n = pieces(std::abs(length) / kQuarterTurn);
    const auto& around = gauss<10>();
    const auto& along = gauss<4>();
    const double half_v = (v1 - v0) / 2, middle_v = (v0 + v1) / 2, half_u = length / n / 2;
    for (int i = 0; i < n; ++i)
      for (std::size_t k = 0; k < 10; ++k) {
        const double angle = u0_ + half_u * (2 * i + 1 + around.x[k]);
        const gp_XYZ out = x * std::cos(angle) + y * std::sin(angle);
        const double weight = sign * half_v * half_u * around.w[k];
        for (std::size_t m = 0; m < 4; ++m)
          add_flux(total_, origin + out + axis * (middle_v + half_v * along.x[m]), out * outward,
                   weight * along.w[m]);
      }
  }

  template <int N>
  void add_points(Sums& sums, double a, double b, double v) const {
    const double half = (b - a) / 2, middle = (a + b) / 2;
    const auto& rule = gauss<N>();
    for (std::size_t i = 0; i < static_cast<std::size_t>(N); ++i) {
      gp_XYZ p, n;
      point_and_normal(middle + half * rule.x[i], v, p, n);
      add_flux(sums, p, n, half * rule.w[i]);
    }
  }

  void point_and_normal(double u, double v, gp_XYZ& p, gp_XYZ& n) const {
    if (is_plane_) {
      const gp_Ax3& frame = plane_.Position();
      const gp_XYZ& x = frame.XDirection().XYZ();
      const gp_XYZ& y = frame.YDirection().XYZ();
      p = frame.Location().XYZ() + x * u + y * v;
      n = x.Crossed(y);
      return;
    }
    gp_Pnt point;
    gp_Vec du, dv;
    surface_.D1(u, v, point, du, dv);
    p = point.XYZ();
    n = du.XYZ().Crossed(dv.XYZ());
  }

  const Progress& progress_;
  TopoDS_Face face_;
  BRepAdaptor_Surface surface_;
  gp_Pln plane_;
  gp_Cylinder cylinder_;
  bool is_plane_ = false, is_cylinder_ = false, u_is_angle_ = false, v_is_angle_ = false,
       has_knots_ = false;
  std::vector<double> u_knots_, v_knots_;
  double u0_ = 0;
  double reach_ = 0;       // greatest distance of a corner from the origin
  double unresolved_ = 0;  // area [mm^2] that halving had no time to settle
  Sums total_{};
};

}  // namespace

void Integrals::add(const Integrals& other) {
  volume += other.volume;
  area += other.area;
  for (std::size_t i = 0; i < 3; ++i) first[i] += other.first[i];
  for (std::size_t i = 0; i < 6; ++i) second[i] += other.second[i];
  trim_doubt += other.trim_doubt;
}

Integrals FaceMemory::of_face(const TopoDS_Face& face) { return of_face(face, NoProgress()); }

Integrals FaceMemory::of_face(const TopoDS_Face& face, const Progress& progress) {
  const TopoDS_Shape key = face.Oriented(TopAbs_FORWARD);
  {
    const std::lock_guard lock(mutex_);
    if (const Integrals* found = learnt_.Seek(key)) return *found;
    if (const Integrals* found = known_.Seek(key)) return *found;
  }
  if (progress.cancelled()) throw Interrupted{};
  const Integrals result = FaceIntegrator(face, progress).run();
  const std::lock_guard lock(mutex_);
  if (known_.Extent() >= kFaceCacheLimit) known_.Clear();
  known_.Bind(key, result);
  return result;
}

void FaceMemory::learn(const TopoDS_Face& face, const Integrals& integrals) {
  const std::lock_guard lock(mutex_);
  if (learnt_.Extent() >= kFaceCacheLimit) learnt_.Clear();
  learnt_.Bind(face.Oriented(TopAbs_FORWARD), integrals);
}

Integrals FaceMemory::of(const TopoDS_Shape& shape) { return of(shape, NoProgress()); }

Integrals FaceMemory::of(const TopoDS_Shape& shape, const Progress& progress) {
  Integrals sum;
  for (TopExp_Explorer e(shape, TopAbs_FACE); e.More(); e.Next()) {
    Integrals face = of_face(TopoDS::Face(e.Current()), progress);
    if (e.Current().Orientation() == TopAbs_REVERSED) {
      face.volume = -face.volume;
      for (double& x : face.first) x = -x;
      for (double& x : face.second) x = -x;
    }
    sum.add(face);
  }
  return sum;
}

bool FaceMemory::is_verified(const TopoDS_Shape& face) {
  const std::lock_guard lock(mutex_);
  return verified_.Contains(face);
}

void FaceMemory::set_verified(const TopoDS_Shape& solid) {
  const std::lock_guard lock(mutex_);
  if (verified_.Extent() >= kFaceCacheLimit) verified_.Clear();
  for (TopExp_Explorer e(solid, TopAbs_FACE); e.More(); e.Next()) verified_.Add(e.Current());
}

Moments to_moments(const Integrals& in, const gp_Trsf& pose, double extent) {
  Integrals m = in;
  if (!is_identity(pose)) {
    // x' = R x + p: first' = R first + V p; second' = R S R^T + (R first) p^T + p (R first)^T + V p
    // p^T
    const gp_Mat R = pose.VectorialPart();
    const gp_XYZ p = pose.TranslationPart();
    const gp_XYZ f = gp_XYZ(in.first[0], in.first[1], in.first[2]).Multiplied(R);
    const auto& s = in.second;
    const gp_Mat S(s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2]);
    const gp_Mat T = R.Multiplied(S).Multiplied(R.Transposed());
    const auto element = [&](int i, int j) {
      return T(i, j) + f.Coord(i) * p.Coord(j) + p.Coord(i) * f.Coord(j) +
             in.volume * p.Coord(i) * p.Coord(j);
    };
    for (int i = 0; i < 3; ++i)
      m.first[static_cast<std::size_t>(i)] = f.Coord(i + 1) + in.volume * p.Coord(i + 1);
    m.second = {element(1, 1), element(2, 2), element(3, 3),
                element(1, 2), element(2, 3), element(1, 3)};
  }
  Moments out;
  // Division, not multiplication by a rounded 1e-9: the powers of ten below 2^53 are exact.
  out.volume = m.volume / 1e9;
  out.area = m.area / 1e6;
  for (std::size_t i = 0; i < 3; ++i) out.first[i] = m.first[i] / 1e12;
  out.second = {m.second[0] / 1e15, m.second[1] / 1e15, m.second[2] / 1e15,
                m.second[3] / 1e15, m.second[4] / 1e15, m.second[5] / 1e15};
  // A strip of the curve's tolerance times its length, seen from the middle of the solid.
  if (in.trim_doubt > 0 && in.volume > 0) {
    out.exact = false;
    out.relative_error = in.trim_doubt * extent / 6 / in.volume;
  }
  return out;
}

}  // namespace robomosp::csg_occt
