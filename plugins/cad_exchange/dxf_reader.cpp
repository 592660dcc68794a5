// SPDX-License-Identifier: Apache-2.0
// Format: Autodesk, DXF Reference (group codes of the ENTITIES and BLOCKS sections).
#include "dxf_reader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "spline2d.h"

namespace robomosp::cad_exchange {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kTurn = 2 * kPi;
/// Ends of pieces nearer than this share of the drawing's size meet.
constexpr double kJoinShare = 1e-6;
/// Splines are followed within this share of the drawing's size.
constexpr double kSplineShare = 1e-6;
constexpr double kFarthest = 1e9;  ///< coordinates beyond are damage [units]
constexpr int kDeepest = 16;       ///< blocks within blocks
constexpr std::size_t kMostEntities = 1'000'000;

struct Group {
  int code = 0;
  std::string_view text;
};

Error bad_dxf(std::string message, std::string hint = "Check that the file is complete.") {
  return error(ErrorCode::syntax, std::move(message), std::move(hint));
}

std::string_view trim(std::string_view s) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!s.empty() && blank(s.front())) s.remove_prefix(1);
  while (!s.empty() && blank(s.back())) s.remove_suffix(1);
  return s;
}

Result<std::vector<Group>> groups_of(std::string_view bytes) {
  if (bytes.starts_with("AutoCAD Binary DXF"))
    return error(ErrorCode::unsupported, "the file is a binary DXF", "Save it as a text DXF.");
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  std::vector<Group> out;
  std::size_t line = 0;
  const auto next = [&]() {
    const std::size_t end = std::min(bytes.find('\n'), bytes.size());
    const std::string_view l = bytes.substr(0, end);
    bytes.remove_prefix(std::min(end + 1, bytes.size()));
    ++line;
    return trim(l);
  };
  while (!bytes.empty()) {
    const std::string_view code = next();
    if (code.empty() && bytes.empty()) break;
    Group g;
    const auto [end, failed] = std::from_chars(code.data(), code.data() + code.size(), g.code);
    if (failed != std::errc() || end != code.data() + code.size())
      return bad_dxf("line " + std::to_string(line) + " should be a group code, not \"" +
                         std::string(code.substr(0, 40)) + "\"",
                     "Check that the file is a text DXF.");
    if (bytes.empty()) return bad_dxf("the file ends within a group");
    g.text = next();
    out.push_back(g);
    if (g.code == 0 && g.text == "EOF") break;
  }
  if (out.empty()) return bad_dxf("the file is empty");
  return out;
}

double dxf_number(std::string_view s) {
  if (s.starts_with('+')) s.remove_prefix(1);
  double v = 0;
  std::from_chars(s.data(), s.data() + s.size(), v);
  return std::isfinite(v) && std::abs(v) <= kFarthest ? v : 0;
}

struct Entity {
  std::string_view kind;
  std::vector<Group> groups;

  [[nodiscard]] std::string_view text(int code) const {
    for (const Group& g : groups)
      if (g.code == code) return g.text;
    return {};
  }
  [[nodiscard]] bool has(int code) const {
    return std::any_of(groups.begin(), groups.end(),
                       [&](const Group& g) { return g.code == code; });
  }
  [[nodiscard]] double real(int code, double otherwise = 0) const {
    return has(code) ? dxf_number(text(code)) : otherwise;
  }
  [[nodiscard]] int integer(int code) const {
    return static_cast<int>(std::clamp(real(code), -1e9, 1e9));
  }
  /// All values of a code, in order.
  [[nodiscard]] std::vector<double> all(int code) const {
    std::vector<double> out;
    for (const Group& g : groups)
      if (g.code == code) out.push_back(dxf_number(g.text));
    return out;
  }
};

/// x' = a x + c y + e, y' = b x + d y + f: where a block is inserted.
struct Placing {
  double a = 1, b = 0, c = 0, d = 1, e = 0, f = 0;
  [[nodiscard]] Point2 operator()(const Point2& p) const {
    return {a * p[0] + c * p[1] + e, b * p[0] + d * p[1] + f};
  }
  [[nodiscard]] Placing after(const Placing& in) const {  // this o in
    return {a * in.a + c * in.b, b * in.a + d * in.b,     a * in.c + c * in.d,
            b * in.c + d * in.d, a * in.e + c * in.f + e, b * in.e + d * in.f + f};
  }
  /// Circles stay circles.
  [[nodiscard]] bool keeps_circles() const {
    const double size = std::hypot(a, b);
    return std::abs(std::hypot(c, d) - size) <= 1e-9 * size &&
           std::abs(a * c + b * d) <= 1e-9 * size * size;
  }
};

struct Piece {
  Point2 start{};
  CsgCurve curve;
  [[nodiscard]] Point2 end() const { return curve.points.back(); }
};

double distance(const Point2& a, const Point2& b) { return std::hypot(a[0] - b[0], a[1] - b[1]); }

Piece reversed(const Piece& p) {
  Piece r;
  r.start = p.end();
  r.curve.kind = p.curve.kind;
  r.curve.points.assign(p.curve.points.rbegin() + 1, p.curve.points.rend());
  r.curve.points.push_back(p.start);
  return r;
}

class DxfReader {
 public:
  DxfReader(std::vector<Group> groups, double unit) : groups_(std::move(groups)), unit_(unit) {}

  Result<Scene> run() {
    RMP_TRY(sections());
    choose_unit();
    for (const Entity& e : entities_) {
      RMP_TRY(add(e, {}, 0));
    }
    for (const auto& [kind, n] : skipped_)
      note(std::to_string(n) + " " + kind + (n == 1 ? " was" : " were") +
           " left out; only outlines and meshes are read.");
    if (off_plane_ > 0)
      note(std::to_string(off_plane_) +
           (off_plane_ == 1 ? " entity that is" : " entities that are") +
           " not in the plane z = 0 were projected onto it.");
    close_loops();
    add_mesh();
    if (scene_.profile.loops.empty() && scene_.shapes.empty()) {
      std::string why;
      for (const std::string& n : scene_.notes) why += (why.empty() ? "" : " ") + n;
      return error(ErrorCode::unsupported, "the drawing contains no closed outline and no mesh",
                   why);
    }
    return std::move(scene_);
  }

 private:
  void note(std::string text) { scene_.notes.push_back(std::move(text)); }

  // --- sections ------------------------------------------------------------------------------

  Result<void> sections() {
    std::string_view section;
    std::string block;
    std::vector<Entity>* target = nullptr;
    for (std::size_t i = 0; i < groups_.size();) {
      const Group& g = groups_[i];
      if (g.code == 0 && g.text == "SECTION") {
        section = i + 1 < groups_.size() && groups_[i + 1].code == 2 ? groups_[i + 1].text : "";
        target = section == "ENTITIES" ? &entities_ : nullptr;
        i += 2;
        continue;
      }
      if (section == "HEADER" && g.code == 9 && g.text == "$INSUNITS" && i + 1 < groups_.size())
        insunits_ = static_cast<int>(dxf_number(groups_[i + 1].text));
      if (g.code != 0) {
        ++i;
        continue;
      }
      Entity e;
      e.kind = g.text;
      std::size_t end = i + 1;
      while (end < groups_.size() && groups_[end].code != 0) e.groups.push_back(groups_[end++]);
      i = end;
      if (section == "BLOCKS" && e.kind == "BLOCK") {
        block = std::string(e.text(2));
        bases_[block] = {e.real(10), e.real(20)};
        target = &blocks_[block];
        continue;
      }
      if (e.kind == "ENDBLK" || e.kind == "ENDSEC") {
        target = nullptr;
        continue;
      }
      if (target) target->push_back(std::move(e));
    }
    return {};
  }

  void choose_unit() {
    double stated = 0;
    switch (insunits_) {
      case 1: stated = 0.0254; break;
      case 2: stated = 0.3048; break;
      case 4: stated = 1e-3; break;
      case 5: stated = 1e-2; break;
      case 6: stated = 1; break;
      case 8: stated = 2.54e-8; break;
      case 9: stated = 2.54e-5; break;
      case 10: stated = 0.9144; break;
      case 13: stated = 1e-6; break;
      case 14: stated = 0.1; break;
      default: break;
    }
    if (stated > 0) {
      if (unit_ > 0 && std::abs(unit_ - stated) > 1e-12 * stated)
        note("The drawing states its own unit, so the given one was not used.");
      unit_ = stated;
    } else if (!(unit_ > 0)) {
      unit_ = 1e-3;
      note("The drawing states no unit; it was read as millimetres. Give unit= if it differs.");
    }
  }

  // --- entities ------------------------------------------------------------------------------

  /// The object coordinate system of a flat entity: mirrored when its normal points down.
  static Placing frame(const Entity& e, const Placing& at) {
    if (!(e.real(230, 1) < 0)) return at;
    return at.after({-1, 0, 0, 1, 0, 0});
  }

  Result<void> add(const Entity& e, const Placing& at, int depth) {
    if (++count_ > kMostEntities)
      return error(ErrorCode::unsupported, "the drawing has more than a million entities",
                   "Export only what is needed.");
    // POLYLINE, VERTEX... SEQEND stand one after the other.
    if (e.kind == "VERTEX") {
      if (polyline_) polyline_->second.push_back(e);
      return {};
    }
    if (e.kind == "SEQEND") {
      if (polyline_) polyline(polyline_->first, polyline_->second, polyline_at_);
      polyline_.reset();
      return {};
    }
    if (e.kind == "POLYLINE") {
      polyline_.emplace(e, std::vector<Entity>{});
      polyline_at_ = at;
      return {};
    }
    if (std::abs(e.real(30)) > 0 && e.kind != "3DFACE" && e.kind != "INSERT") ++off_plane_;
    if (e.kind == "LINE") {
      line(at({e.real(10), e.real(20)}), at({e.real(11), e.real(21)}));
    } else if (e.kind == "CIRCLE") {
      ellipse({e.real(10), e.real(20)}, {e.real(40), 0}, 1, 0, kTurn, frame(e, at));
    } else if (e.kind == "ARC") {
      const double from = e.real(50) * kPi / 180, to = e.real(51) * kPi / 180;
      ellipse({e.real(10), e.real(20)}, {e.real(40), 0}, 1, from, to, frame(e, at));
    } else if (e.kind == "ELLIPSE") {
      const double ratio = e.real(230, 1) < 0 ? -e.real(40, 1) : e.real(40, 1);
      ellipse({e.real(10), e.real(20)}, {e.real(11), e.real(21)}, ratio, e.real(41),
              e.real(42, kTurn), at);
    } else if (e.kind == "LWPOLYLINE") {
      lwpolyline(e, frame(e, at));
    } else if (e.kind == "SPLINE") {
      spline(e, at);
    } else if (e.kind == "3DFACE") {
      face(e, at);
    } else if (e.kind == "INSERT") {
      return insert(e, at, depth);
    } else if (!e.kind.empty() && e.kind != "VIEWPORT") {
      ++skipped_[std::string(e.kind.substr(0, 30))];
    }
    return {};
  }

  Result<void> insert(const Entity& e, const Placing& at, int depth) {
    const std::string name(e.text(2));
    const auto block = blocks_.find(name);
    if (block == blocks_.end()) {
      note("The block \"" + name + "\" is not in the file.");
      return {};
    }
    if (depth >= kDeepest)
      return bad_dxf("blocks are nested more than " + std::to_string(kDeepest) + " deep",
                     "Explode the blocks in the program the drawing comes from.");
    const double turn = e.real(50) * kPi / 180, sx = e.real(41, 1), sy = e.real(42, 1);
    const Point2 base = bases_[name];
    const Placing own{std::cos(turn) * sx, std::sin(turn) * sx, -std::sin(turn) * sy,
                      std::cos(turn) * sy, e.real(10),          e.real(20)};
    const Placing inner = frame(e, at).after(own).after({1, 0, 0, 1, -base[0], -base[1]});
    if (std::abs(inner.a * inner.d - inner.b * inner.c) < 1e-18) return {};
    for (const Entity& child : block->second) RMP_TRY(add(child, inner, depth + 1));
    return {};
  }

  void line(const Point2& from, const Point2& to) {
    if (distance(from, to) > 0) pieces_.push_back({from, {CsgCurve::Kind::line, {to}}});
  }

  /// centre + major cos t + minor sin t; minor is major turned left, times ratio.
  void ellipse(const Point2& centre, const Point2& major, double ratio, double from, double to,
               const Placing& at) {
    double sweep = std::fmod(to - from, kTurn);
    if (sweep <= 1e-12) sweep += kTurn;
    if (!(std::hypot(major[0], major[1]) > 0) || !(std::abs(ratio) > 0)) return;
    const auto point = [&](double t) {
      return at({centre[0] + major[0] * std::cos(t) - ratio * major[1] * std::sin(t),
                 centre[1] + major[1] * std::cos(t) + ratio * major[0] * std::sin(t)});
    };
    const bool is_round = std::abs(std::abs(ratio) - 1) < 1e-12 && at.keeps_circles();
    const bool is_whole = sweep > kTurn - 1e-9;
    if (is_round && is_whole) {
      const Point2 c = at(centre);
      CsgLoop loop;
      loop.start = point(0);
      loop.curves.push_back({CsgCurve::Kind::circle, {c, {distance(c, point(0)), 0}}});
      whole_.push_back(std::move(loop));
      return;
    }
    if (is_round) {
      const Point2 start = point(from), end = point(from + sweep);
      if (distance(start, end) > 0)
        pieces_.push_back({start, {CsgCurve::Kind::arc, {point(from + sweep / 2), end}}});
      return;
    }
    // An ellipse as a rational quadratic B-spline, exactly; quarters at most.
    BSpline s;
    s.degree = 2;
    const int quarters = std::max(1, static_cast<int>(std::ceil(sweep / (kPi / 2) - 1e-9)));
    const double step = sweep / quarters;
    s.knots = {0, 0, 0};
    s.points.push_back(point(from));
    s.weights.push_back(1);
    const Point2 middle = at(centre);
    for (int q = 0; q < quarters; ++q) {
      const double t = from + q * step, w = std::cos(step / 2);
      const Point2 on = point(t + step / 2);
      s.points.push_back(
          {middle[0] + (on[0] - middle[0]) / w, middle[1] + (on[1] - middle[1]) / w});
      s.weights.push_back(w);
      s.points.push_back(point(t + step));
      s.weights.push_back(1);
      s.knots.insert(s.knots.end(), {q + 1.0, q + 1.0});
    }
    s.knots.push_back(quarters);
    if (is_whole) s.points.back() = s.points.front();
    curve(s);
  }

  /// A bulge is the tangent of a quarter of the arc's angle; positive runs left round.
  void bulged(const Point2& from, const Point2& to, double bulge, const Placing& at) {
    const Point2 a = at(from), b = at(to);
    if (!(distance(a, b) > 0)) return;
    if (std::abs(bulge) < 1e-12 || !at.keeps_circles()) {
      if (std::abs(bulge) >= 1e-12) note("An arc in a stretched block became a straight line.");
      line(a, b);
      return;
    }
    const Point2 way{to[0] - from[0], to[1] - from[1]};
    const Point2 top{(from[0] + to[0]) / 2 + way[1] * bulge / 2,
                     (from[1] + to[1]) / 2 - way[0] * bulge / 2};
    pieces_.push_back({a, {CsgCurve::Kind::arc, {at(top), b}}});
  }

  void lwpolyline(const Entity& e, const Placing& at) {
    struct Vertex {
      Point2 p{};
      double bulge = 0;
    };
    std::vector<Vertex> v;
    for (const Group& g : e.groups) {
      if (g.code == 10) v.push_back({{dxf_number(g.text), 0}, 0});
      else if (v.empty()) continue;
      else if (g.code == 20) v.back().p[1] = dxf_number(g.text);
      else if (g.code == 42) v.back().bulge = dxf_number(g.text);
    }
    for (std::size_t i = 0; i + 1 < v.size(); ++i) bulged(v[i].p, v[i + 1].p, v[i].bulge, at);
    if ((e.integer(70) & 1) != 0 && v.size() > 1)
      bulged(v.back().p, v.front().p, v.back().bulge, at);
  }

  void polyline(const Entity& head, const std::vector<Entity>& vertices, const Placing& placed) {
    const int flags = head.integer(70);
    if ((flags & 64) != 0) return polyface(vertices, placed);
    if ((flags & 16) != 0) return polygon_mesh(head, vertices, placed);
    const Placing at = (flags & 8) != 0 ? placed : frame(head, placed);
    std::vector<const Entity*> v;
    for (const Entity& e : vertices)
      if ((e.integer(70) & 16) == 0) v.push_back(&e);  // not the frame of a fitted spline
    const auto point = [](const Entity& e) { return Point2{e.real(10), e.real(20)}; };
    for (std::size_t i = 0; i + 1 < v.size(); ++i)
      bulged(point(*v[i]), point(*v[i + 1]), v[i]->real(42), at);
    if ((flags & 1) != 0 && v.size() > 1)
      bulged(point(*v.back()), point(*v.front()), v.back()->real(42), at);
  }

  void spline(const Entity& e, const Placing& at) {
    BSpline s;
    s.degree = std::clamp(e.integer(71), 0, 100);
    s.knots = e.all(40);
    s.weights = e.all(41);
    const auto points = [&](int x) {
      const auto xs = e.all(x), ys = e.all(x + 10);
      std::vector<Point2> out;
      for (std::size_t i = 0; i < std::min(xs.size(), ys.size()); ++i)
        out.push_back(at({xs[i], ys[i]}));
      return out;
    };
    s.points = points(10);
    if (std::all_of(s.weights.begin(), s.weights.end(), [](double w) { return w == 1; }))
      s.weights.clear();
    std::vector<Point2> fit = points(11);
    fit.erase(std::unique(fit.begin(), fit.end()), fit.end());
    if (!s.is_sound()) {
      if (fit.size() < 2) {
        note("A SPLINE with inconsistent knots and points was left out.");
        return;
      }
      note("A SPLINE has fit points only; it was drawn through them.");
      through(fit);
      return;
    }
    // Written by this program: the fit points give the very curve.
    if (fit.size() >= 2 && follows(s, fit)) {
      through(fit);
      return;
    }
    curve(s);
  }

  /// Whether the natural spline through `fit` is the curve.
  static bool follows(const BSpline& s, const std::vector<Point2>& fit) {
    const NaturalSpline n(fit);
    const double tolerance = 1e-9 * n.length();
    for (int i = 0; i <= 64; ++i) {
      const double share = i / 64.0;
      if (distance(n.at(share * n.length()), s.at(s.first() + share * (s.last() - s.first()))) >
          tolerance)
        return false;
    }
    return true;
  }

  void through(const std::vector<Point2>& points) {
    Piece p{points.front(), {CsgCurve::Kind::spline, {points.begin() + 1, points.end()}}};
    if (points.size() == 2) p.curve.kind = CsgCurve::Kind::line;
    pieces_.push_back(std::move(p));
  }

  void curve(const BSpline& s) {
    if (s.degree == 1) {
      for (std::size_t i = 0; i + 1 < s.points.size(); ++i) line(s.points[i], s.points[i + 1]);
      return;
    }
    Point2 low = s.points[0], high = s.points[0];
    for (const Point2& p : s.points)
      for (std::size_t k = 0; k < 2; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    const auto corners = s.corners();
    for (std::size_t i = 1; i < corners.size(); ++i) {
      double off = 0;
      const auto points =
          follow(s, corners[i - 1], corners[i], kSplineShare * distance(low, high), off);
      if (points.size() < 2) continue;
      through(points);
      worst_ = std::max(worst_, off);
    }
    ++followed_;
  }

  // --- meshes --------------------------------------------------------------------------------

  void triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
    for (const Vec3& p : {a, b, c}) {
      mesh_.triangles.push_back(static_cast<std::uint32_t>(mesh_.points.size() / 3));
      mesh_.points.insert(mesh_.points.end(), p.begin(), p.end());
    }
  }
  static Vec3 corner(const Entity& e, int code, const Placing& at) {
    const Point2 p = at({e.real(code), e.real(code + 10)});
    return {p[0], p[1], e.real(code + 20)};
  }

  void face(const Entity& e, const Placing& at) {
    const Vec3 a = corner(e, 10, at), b = corner(e, 11, at), c = corner(e, 12, at);
    const Vec3 d = e.has(13) ? corner(e, 13, at) : c;
    triangle(a, b, c);
    if (d != c) triangle(a, c, d);
  }

  void polyface(const std::vector<Entity>& vertices, const Placing& at) {
    std::vector<Vec3> points;
    for (const Entity& v : vertices)
      if ((v.integer(70) & 64) != 0) points.push_back(corner(v, 10, at));
    for (const Entity& v : vertices) {
      const int flags = v.integer(70);
      if ((flags & 128) == 0 || (flags & 64) != 0) continue;
      std::vector<std::size_t> ring;
      for (int code = 71; code <= 74; ++code) {
        const int i = std::abs(v.integer(code));  // negative: the edge is invisible
        if (i == 0) break;
        if (static_cast<std::size_t>(i) > points.size()) {
          ring.clear();
          note("A face of a polyface mesh refers to a missing corner; it was left out.");
          break;
        }
        ring.push_back(static_cast<std::size_t>(i) - 1);
      }
      for (std::size_t k = 1; k + 1 < ring.size(); ++k)
        triangle(points[ring[0]], points[ring[k]], points[ring[k + 1]]);
    }
  }

  void polygon_mesh(const Entity& head, const std::vector<Entity>& vertices, const Placing& at) {
    const auto m = static_cast<std::size_t>(std::max(0, head.integer(71)));
    const auto n = static_cast<std::size_t>(std::max(0, head.integer(72)));
    if (m < 2 || n < 2 || m > kMostEntities || n > kMostEntities || m * n > vertices.size()) {
      note("A polygon mesh is incomplete; it was left out.");
      return;
    }
    const bool wraps_m = (head.integer(70) & 1) != 0, wraps_n = (head.integer(70) & 32) != 0;
    const auto at_grid = [&](std::size_t i, std::size_t j) {
      return corner(vertices[(i % m) * n + j % n], 10, at);
    };
    for (std::size_t i = 0; i + (wraps_m ? 0 : 1) < m; ++i)
      for (std::size_t j = 0; j + (wraps_n ? 0 : 1) < n; ++j) {
        triangle(at_grid(i, j), at_grid(i + 1, j), at_grid(i + 1, j + 1));
        triangle(at_grid(i, j), at_grid(i + 1, j + 1), at_grid(i, j + 1));
      }
  }

  void add_mesh() {
    if (mesh_.triangles.empty()) return;
    for (double& x : mesh_.points) x *= unit_;
    mesh_.name = "mesh";
    Node n;
    n.name = mesh_.name;
    n.shape = 0;
    scene_.shapes.push_back(std::move(mesh_));
    scene_.nodes.push_back(std::move(n));
  }

  // --- loops ---------------------------------------------------------------------------------

  [[nodiscard]] double size() const {
    Point2 low{kFarthest, kFarthest}, high{-kFarthest, -kFarthest};
    const auto grow = [&](const Point2& p) {
      for (std::size_t k = 0; k < 2; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    };
    for (const Piece& p : pieces_) {
      grow(p.start);
      grow(p.end());
    }
    return pieces_.empty() ? 0 : distance(low, high);
  }

  /// Joins pieces end to end in any order and direction.
  void close_loops() {
    const double tolerance = kJoinShare * size();
    if (followed_ > 0) {
      char text[160];
      std::snprintf(text, sizeof text,
                    "%zu curved outline%s followed by splines through points, within %.2g mm.",
                    followed_, followed_ == 1 ? " is" : "s are", worst_ * unit_ * 1e3);
      note(text);
    }
    // Ends by cell, so that a neighbour is found without looking at all.
    using Cell = std::pair<std::int64_t, std::int64_t>;
    std::multimap<Cell, std::size_t> ends;  // 2 i = start of piece i, 2 i + 1 = its end
    const auto cell = [&](const Point2& p) {
      const double step = tolerance > 0 ? 2 * tolerance : 1;
      const auto index = [&](double x) {
        return static_cast<std::int64_t>(std::clamp(std::floor(x / step), -1e18, 1e18));
      };
      return Cell{index(p[0]), index(p[1])};
    };
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      ends.emplace(cell(pieces_[i].start), 2 * i);
      ends.emplace(cell(pieces_[i].end()), 2 * i + 1);
    }
    std::vector<char> used(pieces_.size(), 0);
    const auto neighbour = [&](const Point2& p) -> std::optional<std::size_t> {
      const Cell home = cell(p);
      std::optional<std::size_t> best;
      double nearest = tolerance;
      for (std::int64_t dx = -1; dx <= 1; ++dx)
        for (std::int64_t dy = -1; dy <= 1; ++dy) {
          const auto [from, to] = ends.equal_range({home.first + dx, home.second + dy});
          for (auto it = from; it != to; ++it) {
            const Piece& q = pieces_[it->second / 2];
            const double d = distance(p, it->second % 2 ? q.end() : q.start);
            if (used[it->second / 2] || d > nearest) continue;
            best = it->second;
            nearest = d;
          }
        }
      return best;
    };
    std::size_t open = 0;
    for (std::size_t first = 0; first < pieces_.size(); ++first) {
      if (used[first]) continue;
      used[first] = 1;
      CsgLoop loop;
      loop.start = pieces_[first].start;
      loop.curves.push_back(pieces_[first].curve);
      Point2 tip = pieces_[first].end();
      while (distance(tip, loop.start) > tolerance) {
        const auto next = neighbour(tip);
        if (!next) break;
        used[*next / 2] = 1;
        const Piece piece = *next % 2 ? reversed(pieces_[*next / 2]) : pieces_[*next / 2];
        loop.curves.push_back(piece.curve);
        tip = piece.end();
      }
      const bool is_there_and_back = loop.curves.size() == 2 &&
                                     loop.curves[0].kind == CsgCurve::Kind::line &&
                                     loop.curves[1].kind == CsgCurve::Kind::line;
      if (distance(tip, loop.start) > tolerance || is_there_and_back) {
        ++open;
        if (!open_at_) open_at_ = tip;
        continue;
      }
      loop.curves.back().points.back() = loop.start;
      whole_.push_back(std::move(loop));
    }
    if (open > 0) {
      char text[200];
      std::snprintf(
          text, sizeof text,
          "%zu line%s not close to an outline and %s left out; the first ends at (%.6g, %.6g).",
          open, open == 1 ? " does" : "s do", open == 1 ? "was" : "were", (*open_at_)[0],
          (*open_at_)[1]);
      note(text);
    }
    for (CsgLoop& loop : whole_) {
      for (double& x : loop.start) x *= unit_;
      for (CsgCurve& c : loop.curves)
        for (Point2& p : c.points)
          for (double& x : p) x *= unit_;
      scene_.profile.loops.push_back(std::move(loop));
    }
  }

  std::vector<Group> groups_;
  double unit_;
  int insunits_ = 0;
  std::vector<Entity> entities_;
  std::map<std::string, std::vector<Entity>> blocks_;
  std::map<std::string, Point2> bases_;
  std::optional<std::pair<Entity, std::vector<Entity>>> polyline_;
  Placing polyline_at_;
  std::vector<Piece> pieces_;
  std::vector<CsgLoop> whole_;
  Shape mesh_;
  Scene scene_;
  std::map<std::string, std::size_t> skipped_;
  std::size_t count_ = 0, off_plane_ = 0, followed_ = 0;
  double worst_ = 0;  ///< of the splines [units]
  std::optional<Point2> open_at_;
};

}  // namespace

Result<Scene> read_dxf(std::string_view bytes, double unit) {
  RMP_TRY_ASSIGN(auto groups, groups_of(bytes));
  return DxfReader(std::move(groups), unit).run();
}

}  // namespace robomosp::cad_exchange
