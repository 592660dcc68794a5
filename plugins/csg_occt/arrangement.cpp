// SPDX-License-Identifier: Apache-2.0
#include "arrangement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <unordered_map>

#include "leaders.h"
#include "occt_support.h"

namespace robomosp::csg_occt {
namespace {

constexpr std::uint32_t kNone = ~std::uint32_t{0};
/// Where borders meet, and regions of all cells (1 GB). A thousand boxes in one place have more.
constexpr std::size_t kMostMeetings = 10'000'000, kMostCovers = 250'000'000;

Point2 operator-(Point2 a, Point2 b) { return {a.x - b.x, a.y - b.y}; }
Point2 operator+(Point2 a, Point2 b) { return {a.x + b.x, a.y + b.y}; }
Point2 operator*(Point2 a, double f) { return {a.x * f, a.y * f}; }
double dot(Point2 a, Point2 b) { return a.x * b.x + a.y * b.y; }
double cross(Point2 a, Point2 b) { return a.x * b.y - a.y * b.x; }
double length(Point2 a) { return std::hypot(a.x, a.y); }
double distance(Point2 a, Point2 b) { return length(a - b); }
double angle_of(Point2 a) { return std::atan2(a.y, a.x); }

/// In [0, 2 pi).
double wrapped(double angle) {
  angle = std::fmod(angle, kTurn);
  if (angle < 0) angle += kTurn;
  return angle < kTurn ? angle : 0;
}

/// Points with numbers; two that are neither one nor clearly apart are refused.
class PointNumbers {
 public:
  std::uint32_t number(Point2 p) {
    const std::int64_t cx = cell(p.x), cy = cell(p.y);
    const std::int64_t x0 = cell(p.x - kClearance), x1 = cell(p.x + kClearance);
    const std::int64_t y0 = cell(p.y - kClearance), y1 = cell(p.y + kClearance);
    for (std::int64_t x = x0; x <= x1; ++x)
      for (std::int64_t y = y0; y <= y1; ++y)
        if (const auto found = first_.find(key(x, y)); found != first_.end())
          for (std::uint32_t i = found->second; i != kNone; i = next_[i]) {
            const double d = distance(points[i], p);
            if (d <= 2 * kSamePlace) return i;
            if (d < kClearance) is_unsure = true;
          }
    const auto id = static_cast<std::uint32_t>(points.size());
    points.push_back(p);
    auto& head = first_.try_emplace(key(cx, cy), kNone).first->second;
    next_.push_back(head);
    head = id;
    return id;
  }

  std::vector<Point2> points;
  bool is_unsure = false;

 private:
  static constexpr double kCell = 1e-2;
  static std::int64_t cell(double x) { return static_cast<std::int64_t>(std::floor(x / kCell)); }
  static std::uint64_t key(std::int64_t x, std::int64_t y) {
    return static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15ULL ^
           (static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4fULL >> 1);
  }
  std::unordered_map<std::uint64_t, std::uint32_t> first_;
  std::vector<std::uint32_t> next_;
};

struct Box2 {
  double x0, x1, y0, y1;
};

/// A border piece prepared for questions about points near it.
struct ArrangedPiece {
  bool is_circle = false, is_whole = false;
  Point2 from, to, centre, direction;  // direction of a line
  double size = 0;                     // length of a line, radius of a circle
  double start = 0, sweep = 0;         // angles of an arc
  Box2 box{};

  explicit ArrangedPiece(const BorderPiece& b) : is_circle(b.is_circular), from(b.from), to(b.to) {
    if (is_circle) {
      is_whole = b.is_whole_circle();
      centre = b.centre;
      size = b.radius;
      start = angle_of(from - centre);
      sweep = is_whole ? kTurn : wrapped(angle_of(to - centre) - start);
      box = {centre.x - size, centre.x + size, centre.y - size, centre.y + size};
    } else {
      size = distance(from, to);
      direction = size > 0 ? (to - from) * (1 / size) : Point2{1, 0};
      box = {std::min(from.x, to.x), std::max(from.x, to.x), std::min(from.y, to.y),
             std::max(from.y, to.y)};
    }
  }

  double extent() const { return is_circle ? size * sweep : size; }

  /// Whether a point on the carrier lies on the piece, or off it by no more than `slack`.
  bool reaches(Point2 p, double slack) const {
    if (!is_circle) {
      const double t = dot(p - from, direction);
      return t >= -slack && t <= size + slack;
    }
    if (is_whole) return true;
    const double a = wrapped(angle_of(p - centre) - start), s = slack / size;
    return a <= sweep + s || a >= kTurn - s;
  }

  double distance_to(Point2 p) const {
    const double ends = std::min(distance(p, from), distance(p, to));
    if (!is_circle) {
      const double t = dot(p - from, direction);
      return t > 0 && t < size ? std::abs(cross(direction, p - from)) : ends;
    }
    const double d = std::abs(distance(p, centre) - size);
    return is_whole || reaches(p, 0) ? d : ends;
  }
};

class Builder {
 public:
  Builder(const std::vector<BorderPiece>& borders, const Progress& progress)
      : borders_(borders), carriers_(borders.size()), progress_(progress) {
    for (const BorderPiece& b : borders) pieces_.emplace_back(b);
  }

  std::optional<Arrangement> run() {
    for (std::uint32_t i = 0; i < pieces_.size(); ++i) {
      if (!(pieces_[i].extent() > 10 * kClearance)) return {};
      if (pieces_[i].is_whole) continue;
      touch(i, pieces_[i].from);
      touch(i, pieces_[i].to);
    }
    if (!meet_all()) return {};
    if (!make_edges() || points_.is_unsure || progress_.cancelled()) return {};
    if (!sort_around_vertices() || progress_.cancelled()) return {};
    trace_cycles();
    if (!nest_components() || progress_.cancelled()) return {};
    if (!make_cells()) return {};
    return std::move(out_);
  }

 private:
  void touch(std::uint32_t piece, Point2 p) { on_.emplace_back(piece, points_.number(p)); }
  void touch(std::uint32_t a, std::uint32_t b, Point2 p) {
    const std::uint32_t v = points_.number(p);
    on_.emplace_back(a, v);
    on_.emplace_back(b, v);
  }

  // Pairs whose boxes meet, by a sweep along x.
  bool meet_all() {
    std::vector<std::uint32_t> order(pieces_.size()), active;
    std::iota(order.begin(), order.end(), std::uint32_t{0});
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return pieces_[a].box.x0 < pieces_[b].box.x0;
    });
    constexpr double slack = 2 * kClearance;
    for (const std::uint32_t i : order) {
      const Box2& box = pieces_[i].box;
      std::erase_if(active, [&](std::uint32_t j) { return pieces_[j].box.x1 + slack < box.x0; });
      for (const std::uint32_t j : active) {
        const Box2& other = pieces_[j].box;
        if (other.y1 + slack < box.y0 || box.y1 + slack < other.y0) continue;
        if (!meet(i, j) || points_.is_unsure) return false;
      }
      if (on_.size() > kMostMeetings || progress_.cancelled()) return false;
      active.push_back(i);
    }
    return true;
  }

  // False: too close to call.
  bool meet(std::uint32_t i, std::uint32_t j) {
    if (pieces_[i].is_circle && !pieces_[j].is_circle) std::swap(i, j);
    const ArrangedPiece &a = pieces_[i], &b = pieces_[j];
    if (!a.is_circle && !b.is_circle) return lines(i, j);
    if (!a.is_circle) return line_and_circle(i, j);
    return circles(i, j);
  }

  // Ends of one piece on or near the other.
  bool ends(std::uint32_t i, std::uint32_t j) {
    for (const auto& [own, other] : {std::pair{i, j}, std::pair{j, i}}) {
      if (pieces_[own].is_whole) continue;
      for (const Point2 p : {pieces_[own].from, pieces_[own].to}) {
        const double d = pieces_[other].distance_to(p);
        if (d <= kSamePlace) touch(other, p);
        else if (d < kClearance) return false;
      }
    }
    return true;
  }

  // Where the carriers touch in `p` without crossing, ends may come near only in `p` itself.
  bool tangent(std::uint32_t i, std::uint32_t j, Point2 p, bool is_exact) {
    const ArrangedPiece &a = pieces_[i], &b = pieces_[j];
    const bool is_met = a.reaches(p, kClearance) && b.reaches(p, kClearance);
    if (is_met && !is_exact) return false;
    if (is_met) {
      if (!a.reaches(p, kSamePlace) || !b.reaches(p, kSamePlace)) return false;
      touch(i, j, p);
    }
    for (const auto& [own, other] : {std::pair{&a, &b}, std::pair{&b, &a}}) {
      if (own->is_whole) continue;
      for (const Point2 end : {own->from, own->to})
        if (other->distance_to(end) < kClearance && !(is_met && distance(end, p) <= kSamePlace))
          return false;
    }
    return true;
  }

  bool is_clear_of_ends(const ArrangedPiece& piece, Point2 p) const {
    return piece.is_whole ||
           (distance(p, piece.from) > kClearance && distance(p, piece.to) > kClearance);
  }

  void cross_in(std::uint32_t i, std::uint32_t j, Point2 p) {
    const ArrangedPiece &a = pieces_[i], &b = pieces_[j];
    if (a.reaches(p, 0) && b.reaches(p, 0) && is_clear_of_ends(a, p) && is_clear_of_ends(b, p))
      touch(i, j, p);
  }

  bool lines(std::uint32_t i, std::uint32_t j) {
    const ArrangedPiece &a = pieces_[i], &b = pieces_[j];
    const double d0 = cross(a.direction, b.from - a.from), d1 = cross(a.direction, b.to - a.from);
    if (std::abs(d0) <= kSamePlace && std::abs(d1) <= kSamePlace) {
      carriers_.join(i, j);
      return ends(i, j);
    }
    const double sine = cross(a.direction, b.direction);
    const bool crosses_a = (d0 > 0) != (d1 > 0);
    const bool crosses_b =
        (cross(b.direction, a.from - b.from) > 0) != (cross(b.direction, a.to - b.from) > 0);
    if (std::abs(sine) < kLeastCrossing) {
      if (crosses_a && crosses_b) return false;
      for (const auto& [own, other] : {std::pair{&a, &b}, std::pair{&b, &a}})
        for (const Point2 p : {own->from, own->to})
          if (other->distance_to(p) < kClearance) return false;
      return true;
    }
    if (!ends(i, j)) return false;
    if (crosses_a && crosses_b) {
      const double t = cross(b.from - a.from, b.direction) / sine;
      cross_in(i, j, a.from + a.direction * t);
    }
    return true;
  }

  bool line_and_circle(std::uint32_t i, std::uint32_t j) {
    const ArrangedPiece &line = pieces_[i], &circle = pieces_[j];
    const double r = circle.size, t = dot(circle.centre - line.from, line.direction);
    const Point2 foot = line.from + line.direction * t;
    const double h = distance(foot, circle.centre);
    const Point2 nearest =
        h > 0 ? circle.centre + (foot - circle.centre) * (r / h) : circle.centre + Point2{r, 0};
    if (std::abs(h - r) <= kSamePlace) return tangent(i, j, nearest, true);
    if (h > r + kClearance) return true;
    if (h > r || std::sqrt((r - h) * (r + h)) < kLeastCrossing * r)
      return tangent(i, j, nearest, false);
    if (!ends(i, j)) return false;
    const double half = std::sqrt((r - h) * (r + h));
    cross_in(i, j, foot + line.direction * half);
    cross_in(i, j, foot - line.direction * half);
    return true;
  }

  bool circles(std::uint32_t i, std::uint32_t j) {
    const ArrangedPiece &a = pieces_[i], &b = pieces_[j];
    const double d = distance(a.centre, b.centre), sum = a.size + b.size,
                 difference = std::abs(a.size - b.size);
    if (d <= kSamePlace && difference <= kSamePlace) {
      carriers_.join(i, j);
      return ends(i, j);
    }
    if (d + difference < kClearance) return false;
    if (d > sum + kClearance || d < difference - kClearance) return true;
    if (d == 0) return false;
    const Point2 along = (b.centre - a.centre) * (1 / d);
    const Point2 outer = a.centre + along * a.size;
    const Point2 inner = a.size >= b.size ? outer : a.centre - along * a.size;
    if (std::abs(d - sum) <= kSamePlace) return tangent(i, j, outer, true);
    if (std::abs(d - difference) <= kSamePlace) return tangent(i, j, inner, true);
    if (d > sum) return tangent(i, j, outer, false);
    if (d < difference) return tangent(i, j, inner, false);
    const double x = (d + (a.size - b.size) * sum / d) / 2;
    const double square = (a.size - x) * (a.size + x);
    const double y = square > 0 ? std::sqrt(square) : 0;
    if (d * y < kLeastCrossing * a.size * b.size)
      return tangent(i, j, std::abs(d - sum) < std::abs(d - difference) ? outer : inner, false);
    if (!ends(i, j)) return false;
    const Point2 middle = a.centre + along * x, up{-along.y, along.x};
    cross_in(i, j, middle + up * y);
    cross_in(i, j, middle - up * y);
    return true;
  }

  bool make_edges() {
    // Carriers with their pieces, and the points on them.
    std::vector<std::uint32_t> carrier_of(pieces_.size(), kNone);
    std::vector<std::vector<std::uint32_t>> members, points;
    for (std::uint32_t i = 0; i < pieces_.size(); ++i) {
      const std::uint32_t root = carriers_.find(i);
      if (carrier_of[root] == kNone) {
        carrier_of[root] = static_cast<std::uint32_t>(out_.carriers.size());
        const ArrangedPiece& p = pieces_[root];
        Arrangement::Carrier c;
        c.is_circle = p.is_circle;
        c.origin = p.is_circle ? p.centre : p.from;
        if (p.is_circle) c.radius = p.size;
        else c.direction = p.direction;
        out_.carriers.push_back(std::move(c));
        members.emplace_back();
        points.emplace_back();
      }
      carrier_of[i] = carrier_of[root];
      members[carrier_of[i]].push_back(i);
    }
    for (const auto& [piece, point] : on_) points[carrier_of[piece]].push_back(point);
    for (std::uint32_t c = 0; c < out_.carriers.size(); ++c)
      if (!cut_carrier(c, members[c], points[c])) return false;
    out_.vertices.resize(points_.points.size());
    for (std::size_t v = 0; v < out_.vertices.size(); ++v) out_.vertices[v].p = points_.points[v];
    return true;
  }

  double place_on(const Arrangement::Carrier& c, std::uint32_t point) const {
    const Point2 p = points_.points[point] - c.origin;
    return c.is_circle ? wrapped(angle_of(p)) : dot(p, c.direction);
  }

  bool cut_carrier(std::uint32_t number, const std::vector<std::uint32_t>& members,
                   std::vector<std::uint32_t>& points) {
    Arrangement::Carrier& carrier = out_.carriers[number];
    if (points.empty())  // a circle that nothing meets
      points.push_back(points_.number(carrier.origin + Point2{carrier.radius, 0}));
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    std::vector<std::pair<double, std::uint32_t>> stops;
    for (const std::uint32_t p : points) stops.emplace_back(place_on(carrier, p), p);
    std::sort(stops.begin(), stops.end());
    const std::size_t n = stops.size();
    // Gap k lies between stop k and the next.
    std::vector<std::vector<std::uint32_t>> cover(n);
    for (const std::uint32_t m : members) {
      const std::uint32_t region = borders_[m].region;
      const ArrangedPiece& piece = pieces_[m];
      std::size_t first = 0, count = n;
      if (!piece.is_whole) {
        const auto stop_of = [&](Point2 p) {
          const std::uint32_t id = points_.number(p);
          return static_cast<std::size_t>(
              std::find_if(stops.begin(), stops.end(),
                           [&](const auto& s) { return s.second == id; }) -
              stops.begin());
        };
        std::size_t a = stop_of(piece.from), b = stop_of(piece.to);
        if (a == n || b == n || a == b) return false;
        if (!carrier.is_circle && a > b) std::swap(a, b);
        first = a;
        count = (b + n - a) % n;
      }
      for (std::size_t k = 0; k < count; ++k) {
        auto& regions = cover[(first + k) % n];
        const auto found = std::find(regions.begin(), regions.end(), region);
        if (found == regions.end()) regions.push_back(region);
        else regions.erase(found);  // crossed twice
      }
    }
    for (std::size_t k = 0; k < n; ++k) {
      if (cover[k].empty()) continue;
      Arrangement::Edge edge;
      edge.carrier = number;
      edge.from = stops[k].second;
      edge.to = stops[(k + 1) % n].second;
      edge.start = stops[k].first;
      edge.end = stops[(k + 1) % n].first;
      if (carrier.is_circle && k + 1 == n) edge.end += kTurn;
      carrier.edges.push_back(static_cast<std::uint32_t>(out_.edges.size()));
      out_.edges.push_back(edge);
      crossed_.push_back(std::move(cover[k]));
    }
    return true;
  }

  // A half-edge 2e runs along edge e with its left cell on the left, 2e + 1 against it.
  std::uint32_t start_of(std::uint32_t h) const {
    return h & 1 ? out_.edges[h / 2].to : out_.edges[h / 2].from;
  }

  struct Departure {
    double angle, bend;
    std::uint32_t half;
  };

  Departure departure(std::uint32_t h) const {
    const Arrangement::Edge& e = out_.edges[h / 2];
    const Arrangement::Carrier& c = out_.carriers[e.carrier];
    const double sign = h & 1 ? -1 : 1;
    if (!c.is_circle) return {angle_of(c.direction * sign), 0, h};
    const double at = h & 1 ? e.end : e.start;
    return {at + sign * kTurn / 4, sign / c.radius, h};
  }

  // Counterclockwise; departures in one direction by how they bend away from it.
  bool sort_around_vertices() {
    constexpr double kSameDirection = 1e-6;
    next_.assign(2 * out_.edges.size(), kNone);
    std::vector<std::vector<std::uint32_t>> leaving(out_.vertices.size());
    for (std::uint32_t h = 0; h < next_.size(); ++h) {
      leaving[start_of(h)].push_back(h);
      out_.vertices[start_of(h)].edges.push_back(h / 2);
    }
    std::vector<Departure> around;
    for (const auto& halves : leaving) {
      around.clear();
      for (const std::uint32_t h : halves) around.push_back(departure(h));
      if (around.empty()) continue;
      const double base = around.front().angle;
      for (Departure& d : around) {
        d.angle = wrapped(d.angle - base);
        if (d.angle > kTurn - kSameDirection) d.angle -= kTurn;
      }
      std::sort(around.begin(), around.end(),
                [](const Departure& a, const Departure& b) { return a.angle < b.angle; });
      for (std::size_t k = 0; k < around.size();) {
        std::size_t end = k + 1;
        while (end < around.size() && around[end].angle - around[k].angle < kSameDirection) ++end;
        std::sort(around.begin() + static_cast<std::ptrdiff_t>(k),
                  around.begin() + static_cast<std::ptrdiff_t>(end),
                  [](const Departure& a, const Departure& b) { return a.bend < b.bend; });
        for (std::size_t m = k + 1; m < end; ++m)
          if (around[m].bend - around[m - 1].bend < 1e-9) return false;
        if (end < around.size() && around[end].angle - around[end - 1].angle < kLeastCrossing / 2)
          return false;
        k = end;
      }
      const std::size_t n = around.size();
      for (std::size_t k = 0; k < n; ++k) next_[around[(k + 1) % n].half ^ 1] = around[k].half;
    }
    return true;
  }

  double twice_area_under(std::uint32_t h) const {
    const Arrangement::Edge& e = out_.edges[h / 2];
    const Point2 base = out_.vertices[0].p;  // keeps the products small
    const Point2 a = out_.vertices[e.from].p - base, b = out_.vertices[e.to].p - base;
    double twice = cross(a, b);
    const Arrangement::Carrier& c = out_.carriers[e.carrier];
    if (c.is_circle) {
      const double sweep = e.end - e.start;
      twice += c.radius * c.radius * (sweep - std::sin(sweep));
    }
    return h & 1 ? -twice : twice;
  }

  void trace_cycles() {
    cycle_of_.assign(next_.size(), kNone);
    for (std::uint32_t h = 0; h < next_.size(); ++h) {
      if (cycle_of_[h] != kNone) continue;
      const auto cycle = static_cast<std::uint32_t>(cycle_area_.size());
      double twice = 0;
      for (std::uint32_t g = h; cycle_of_[g] == kNone; g = next_[g]) {
        cycle_of_[g] = cycle;
        twice += twice_area_under(g);
      }
      cycle_area_.push_back(twice / 2);
    }
  }

  // A connected set of edges has one cycle around its outside; a ray from its outermost point finds
  // what it lies in.
  bool nest_components() {
    Leaders joined(out_.vertices.size());
    for (const Arrangement::Edge& e : out_.edges) joined.join(e.from, e.to);
    component_.resize(out_.edges.size());
    for (std::size_t e = 0; e < out_.edges.size(); ++e)
      component_[e] = joined.find(out_.edges[e].from);
    around_.assign(cycle_area_.size(), kNone);
    // Directions that nobody aligns parts with.
    for (const double turn : {0.3712, 1.1871, 2.7183})
      if (shoot_all(turn)) return true;
    return false;
  }

  bool shoot_all(double turn) {
    const Point2 w{std::cos(turn), std::sin(turn)}, n{-w.y, w.x};
    struct Outermost {
      double along = std::numeric_limits<double>::max(), across = 0;
      std::uint32_t cycle = kNone;
    };
    std::unordered_map<std::uint32_t, Outermost> outermost;
    std::vector<std::pair<double, double>> span(out_.edges.size());
    double low = std::numeric_limits<double>::max(), high = -low;
    for (std::uint32_t e = 0; e < out_.edges.size(); ++e) {
      const Arrangement::Edge& edge = out_.edges[e];
      const Arrangement::Carrier& c = out_.carriers[edge.carrier];
      const Point2 a = out_.vertices[edge.from].p, b = out_.vertices[edge.to].p;
      Outermost& most = outermost[component_[e]];
      const auto offer = [&](Point2 p) {
        if (dot(p, w) < most.along) most = {dot(p, w), dot(p, n), kNone};
      };
      offer(a);
      auto& [s0, s1] = span[e];
      s0 = std::min(dot(a, n), dot(b, n));
      s1 = std::max(dot(a, n), dot(b, n));
      if (c.is_circle) {
        s0 = dot(c.origin, n) - c.radius;
        s1 = dot(c.origin, n) + c.radius;
        if (wrapped(turn + kTurn / 2 - edge.start) < edge.end - edge.start)
          offer(c.origin - w * c.radius);
      }
      low = std::min(low, s0);
      high = std::max(high, s1);
    }
    // The cycle around the outside is the one with the least area.
    for (std::uint32_t h = 0; h < next_.size(); ++h) {
      std::uint32_t& cycle = outermost[component_[h / 2]].cycle;
      if (cycle == kNone || cycle_area_[cycle_of_[h]] < cycle_area_[cycle]) cycle = cycle_of_[h];
    }
    if (outermost.size() == 1) {
      outside_.push_back(outermost.begin()->second.cycle);
      return true;
    }
    const std::size_t rows = std::min<std::size_t>(out_.edges.size(), 4096);
    const double step = (high - low) / static_cast<double>(rows);
    const auto row = [&](double s) {
      return std::min(rows - 1, static_cast<std::size_t>(std::max(0.0, (s - low) / step)));
    };
    std::vector<std::vector<std::uint32_t>> in_row(rows);
    for (std::uint32_t e = 0; e < out_.edges.size(); ++e)
      for (std::size_t k = row(span[e].first - kClearance); k <= row(span[e].second + kClearance);
           ++k)
        in_row[k].push_back(e);
    outside_.clear();
    std::fill(around_.begin(), around_.end(), kNone);
    for (const auto& [component, most] : outermost) {
      double best = -std::numeric_limits<double>::max();
      std::uint32_t hit = kNone;
      for (const std::uint32_t e : in_row[row(most.across)]) {
        if (component_[e] == component || span[e].first > most.across ||
            span[e].second < most.across)
          continue;
        if (!hit_edge(e, w, n, most.along, most.across, best, hit)) return false;
      }
      outside_.push_back(most.cycle);
      if (hit != kNone) around_[most.cycle] = cycle_of_[hit];
    }
    return true;
  }

  // The nearest crossing before `along` so far. False: the ray grazes something.
  bool hit_edge(std::uint32_t e, Point2 w, Point2 n, double along, double across, double& best,
                std::uint32_t& hit) const {
    constexpr double kGraze = 1e-9;
    const Arrangement::Edge& edge = out_.edges[e];
    const Arrangement::Carrier& c = out_.carriers[edge.carrier];
    const auto offer = [&](double at, Point2 tangent) {
      if (at >= along || at <= best) return;
      best = at;
      hit = cross(tangent, w) > 0 ? 2 * e : 2 * e + 1;
    };
    if (!c.is_circle) {
      const Point2 a = out_.vertices[edge.from].p, b = out_.vertices[edge.to].p;
      const double sa = dot(a, n) - across, sb = dot(b, n) - across;
      if (std::abs(sa) < kGraze || std::abs(sb) < kGraze) return false;
      if ((sa > 0) == (sb > 0)) return true;
      offer(dot(a, w) + (dot(b, w) - dot(a, w)) * sa / (sa - sb), c.direction);
      return true;
    }
    const double s = across - dot(c.origin, n);
    if (std::abs(std::abs(s) - c.radius) < kGraze) return false;
    if (std::abs(s) > c.radius) return true;
    const double half = std::sqrt((c.radius - s) * (c.radius + s));
    for (const double x : {-half, half}) {
      const Point2 out = w * x + n * s;
      const double from_start = wrapped(angle_of(out) - edge.start), sweep = edge.end - edge.start;
      const double slack = kGraze / c.radius;
      if (sweep < kTurn - slack) {
        if (std::abs(from_start - sweep) < slack || from_start < slack ||
            from_start > kTurn - slack)
          return false;
        if (from_start > sweep) continue;
      }
      offer(dot(c.origin, w) + x, Point2{-out.y, out.x});
    }
    return true;
  }

  bool make_cells() {
    // A cycle around the outside of something belongs to the cell it lies in.
    std::vector<std::uint32_t> cell_of(cycle_area_.size(), kNone);
    std::vector<bool> is_outside(cycle_area_.size(), false);
    for (const std::uint32_t c : outside_) is_outside[c] = true;
    out_.cells.emplace_back();
    for (std::uint32_t c = 0; c < cycle_area_.size(); ++c) {
      if (is_outside[c]) continue;
      cell_of[c] = static_cast<std::uint32_t>(out_.cells.size());
      out_.cells.emplace_back();
    }
    std::vector<std::uint32_t> way;
    for (const std::uint32_t start : outside_) {
      way.clear();
      std::uint32_t c = start;
      while (c != kNone && cell_of[c] == kNone) {
        way.push_back(c);
        c = around_[c];
      }
      for (const std::uint32_t w : way) cell_of[w] = c == kNone ? 0 : cell_of[c];
    }
    for (std::uint32_t c = 0; c < cycle_area_.size(); ++c)
      out_.cells[cell_of[c]].area += cycle_area_[c];
    std::vector<std::vector<std::uint32_t>> borders(out_.cells.size());
    for (std::uint32_t e = 0; e < out_.edges.size(); ++e) {
      Arrangement::Edge& edge = out_.edges[e];
      edge.left = cell_of[cycle_of_[2 * e]];
      edge.right = cell_of[cycle_of_[2 * e + 1]];
      borders[edge.left].push_back(e);
      borders[edge.right].push_back(e);
    }
    // From the unbounded cell, which no region covers, across the borders.
    std::vector<bool> is_known(out_.cells.size(), false);
    std::vector<std::uint32_t> open{0};
    is_known[0] = true;
    std::size_t covered = 0;
    while (!open.empty()) {
      const std::uint32_t c = open.back();
      covered += out_.cells[c].regions.size();
      if (covered > kMostCovers || progress_.cancelled()) return false;
      open.pop_back();
      for (const std::uint32_t e : borders[c]) {
        const std::uint32_t other =
            out_.edges[e].left == c ? out_.edges[e].right : out_.edges[e].left;
        if (is_known[other]) continue;
        is_known[other] = true;
        std::vector<std::uint32_t> crossed = crossed_[e];
        std::sort(crossed.begin(), crossed.end());
        std::set_symmetric_difference(out_.cells[c].regions.begin(), out_.cells[c].regions.end(),
                                      crossed.begin(), crossed.end(),
                                      std::back_inserter(out_.cells[other].regions));
        open.push_back(other);
      }
    }
    return true;
  }

  const std::vector<BorderPiece>& borders_;
  std::vector<ArrangedPiece> pieces_;
  Leaders carriers_;
  const Progress& progress_;
  PointNumbers points_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> on_;  // piece, point
  std::vector<std::vector<std::uint32_t>> crossed_;          // regions whose border an edge is
  std::vector<std::uint32_t> next_, cycle_of_, component_;   // of half-edges, of edges
  std::vector<double> cycle_area_;
  std::vector<std::uint32_t> around_;   // the cycle that a cycle lies in
  std::vector<std::uint32_t> outside_;  // cycles around the outside of something
  Arrangement out_;
};

}  // namespace

std::optional<Arrangement> arrange(const std::vector<BorderPiece>& borders,
                                   const Progress& progress) {
  if (borders.empty()) return {};
  return Builder(borders, progress).run();
}

}  // namespace robomosp::csg_occt
