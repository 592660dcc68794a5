// SPDX-License-Identifier: Apache-2.0
#include "spatial/surface_moments.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "spatial/convex_hull.h"
#include "spatial/vec.h"

namespace robomosp::spatial {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr std::uint32_t kNoTriangle = ~0U;
/// Corners nearer than this share of the size are one when the surface is open.
constexpr double kNear = 1e-6;
/// Rays each way and axis. Their places are shifted by irrational shares of a cell, so that they do
/// not run along the edges of shapes that were drawn on a grid.
constexpr std::size_t kRays = 96;
constexpr double kShiftU = 0.41421356237309515, kShiftV = 0.7320508075688772;
/// With N trials that all failed, the chance of success is below 3 / N at 95 %.
constexpr double kRuleOfThree = 3;
constexpr std::size_t kMostFaults = 1000;

/// Integrals of 1, x, y, z, xx, yy, zz, xy, yz, xz.
using Integrals = std::array<double, 10>;

Integrals& operator+=(Integrals& a, const Integrals& b) {
  for (std::size_t i = 0; i < 10; ++i) a[i] += b[i];
  return a;
}

/// Of the tetrahedron from the origin to a triangle, with its sign.
Integrals tetrahedron(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double v = dot(a, cross(b, c)) / 6;
  const Vec3 s = add(a, add(b, c));
  const auto second = [&](std::size_t i, std::size_t j) {
    return v / 20 * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]);
  };
  return {v,
          v * s[0] / 4,
          v * s[1] / 4,
          v * s[2] / 4,
          second(0, 0),
          second(1, 1),
          second(2, 2),
          second(0, 1),
          second(1, 2),
          second(0, 2)};
}

Moments about_origin(const Integrals& i, const Vec3& centre, double area) {
  Moments m;
  m.exact = false;
  m.volume = i[0];
  m.area = area;
  const Vec3 first{i[1], i[2], i[3]};
  m.first = add(first, scale(centre, m.volume));
  const auto shifted = [&](double about_centre, std::size_t a, std::size_t b) {
    return about_centre + centre[a] * first[b] + centre[b] * first[a] +
           m.volume * centre[a] * centre[b];
  };
  m.second = {shifted(i[4], 0, 0), shifted(i[5], 1, 1), shifted(i[6], 2, 2),
              shifted(i[7], 0, 1), shifted(i[8], 1, 2), shifted(i[9], 0, 2)};
  return m;
}

struct Edge {
  std::uint32_t from, to, triangle;
};

class Surface {
 public:
  Surface(std::span<const double> points, std::span<const std::uint32_t> triangles) {
    points_.resize(points.size() / 3);
    for (std::size_t i = 0; i < points_.size(); ++i)
      points_[i] = {points[3 * i] + 0.0, points[3 * i + 1] + 0.0, points[3 * i + 2] + 0.0};
    out_.triangles.assign(triangles.begin(), triangles.end());
    out_.moments.exact = false;
    measure();
    for (Vec3& p : points_) p = sub(p, centre_);
    std::vector<std::uint32_t> same = equal_corners();
    take(same);
    if (!open_edges().empty()) {
      join_near(same);
      take(same);
    }
  }

  SurfaceMoments run() {
    if (triangles_.empty()) return std::move(out_);
    if (!open_edges().empty()) turn_alike();
    fill();
    find_pieces();
    cast_rays();
    sum();
    return std::move(out_);
  }

 private:
  void measure() {
    constexpr double kInf = std::numeric_limits<double>::infinity();
    Vec3 low{kInf, kInf, kInf}, high{-kInf, -kInf, -kInf};
    for (const std::uint32_t v : out_.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], points_[v][k]);
        high[k] = std::max(high[k], points_[v][k]);
      }
    if (out_.triangles.empty()) return;
    for (std::size_t k = 0; k < 3; ++k) {
      centre_[k] = low[k] / 2 + high[k] / 2;
      half_[k] = high[k] / 2 - low[k] / 2;
    }
  }
  [[nodiscard]] double size() const { return 2 * std::max({half_[0], half_[1], half_[2]}); }

  /// For each corner the first one at its place.
  [[nodiscard]] std::vector<std::uint32_t> equal_corners() const {
    std::vector<std::uint32_t> order(points_.size()), same(points_.size());
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return points_[a] < points_[b]; });
    for (std::size_t i = 0; i < order.size(); ++i)
      same[order[i]] =
          i > 0 && points_[order[i]] == points_[order[i - 1]] ? same[order[i - 1]] : order[i];
    return same;
  }

  void join_near(std::vector<std::uint32_t>& same) const {
    const double reach = kNear * size();
    if (!(reach > 0)) return;
    std::map<std::array<std::int64_t, 3>, std::vector<std::uint32_t>> cells;
    for (std::uint32_t v = 0; v < points_.size(); ++v) {
      if (same[v] != v) {
        same[v] = same[same[v]];
        continue;
      }
      const Vec3& p = points_[v];
      std::array<std::int64_t, 3> at{};
      bool is_inside = true;  // corners that no triangle uses may be anywhere
      for (std::size_t k = 0; k < 3; ++k) {
        is_inside = is_inside && std::fabs(p[k]) <= half_[k] * 1.001 + reach;
        at[k] = is_inside ? static_cast<std::int64_t>(std::floor(p[k] / reach)) : 0;
      }
      if (!is_inside) continue;
      for (int n = 0; n < 27 && same[v] == v; ++n) {
        const auto near = cells.find({at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1});
        if (near == cells.end()) continue;
        for (const std::uint32_t w : near->second)
          if (distance(points_[w], p) < reach) {
            same[v] = w;
            break;
          }
      }
      if (same[v] == v) cells[at].push_back(v);
    }
  }

  /// The triangles by the joined corners. Of those that stand there several times one way, one
  /// stays; a pair that faces both ways encloses nothing and goes, unless most triangles are such
  /// pairs, as programs write them whose faces have two sides.
  void take(const std::vector<std::uint32_t>& same) {
    triangles_.clear();
    source_.clear();
    struct Seen {
      Triangle sorted;
      std::uint32_t number;
      bool is_even;
    };
    std::vector<Seen> all;
    for (std::size_t i = 0; i + 2 < out_.triangles.size(); i += 3) {
      const Triangle t{same[out_.triangles[i]], same[out_.triangles[i + 1]],
                       same[out_.triangles[i + 2]]};
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      Triangle s = t;
      std::sort(s.begin(), s.end());
      const auto first = static_cast<std::size_t>(std::find(t.begin(), t.end(), s[0]) - t.begin());
      all.push_back({s, static_cast<std::uint32_t>(triangles_.size()), t[(first + 1) % 3] == s[1]});
      triangles_.push_back(t);
      source_.push_back(static_cast<std::uint32_t>(i / 3));
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const Seen& a, const Seen& b) { return a.sorted < b.sorted; });
    std::size_t in_pairs = 0;
    const auto runs = [&](auto&& see) {
      for (std::size_t i = 0; i < all.size();) {
        std::size_t end = i, even = 0;
        for (; end < all.size() && all[end].sorted == all[i].sorted; ++end)
          even += all[end].is_even ? 1U : 0U;
        see(i, end, even);
        i = end;
      }
    };
    runs([&](std::size_t i, std::size_t end, std::size_t even) {
      if (even > 0 && even < end - i) in_pairs += end - i;
    });
    const bool has_two_sides = 2 * in_pairs > all.size();
    std::vector<bool> stays(triangles_.size());
    runs([&](std::size_t i, std::size_t end, std::size_t even) {
      const std::size_t odd = end - i - even;
      if (even == odd && !has_two_sides) return;
      const bool wants_even = even > odd || (even == odd && all[i].is_even);
      for (std::size_t k = i; k < end; ++k)
        if (all[k].is_even == wants_even) {
          stays[all[k].number] = true;
          return;
        }
    });
    std::size_t count = 0;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if (!stays[t]) continue;
      triangles_[count] = triangles_[t];
      source_[count++] = source_[t];
    }
    triangles_.resize(count);
    source_.resize(count);
  }

  /// All sides of triangles, those of one line together.
  [[nodiscard]] std::vector<Edge> edges() const {
    std::vector<Edge> all;
    all.reserve(3 * triangles_.size());
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        all.push_back({triangles_[t][k], triangles_[t][(k + 1) % 3], t});
    std::sort(all.begin(), all.end(), [](const Edge& a, const Edge& b) {
      const auto x = std::minmax(a.from, a.to), y = std::minmax(b.from, b.to);
      return x != y ? x < y : a.triangle < b.triangle;
    });
    return all;
  }
  template <class See>
  static void each_line(const std::vector<Edge>& all, See&& see) {
    for (std::size_t i = 0; i < all.size();) {
      std::size_t end = i;
      while (end < all.size() &&
             std::minmax(all[end].from, all[end].to) == std::minmax(all[i].from, all[i].to))
        ++end;
      see(std::span(all).subspan(i, end - i));
      i = end;
    }
  }

  /// What is left of the sides after those of opposite direction have paired off.
  [[nodiscard]] std::vector<std::pair<std::uint32_t, std::uint32_t>> open_edges() const {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> open;
    each_line(edges(), [&](std::span<const Edge> line) {
      int balance = 0;
      for (const Edge& e : line) balance += e.from < e.to ? 1 : -1;
      const auto [low, high] = std::minmax(line[0].from, line[0].to);
      for (; balance > 0; --balance) open.emplace_back(low, high);
      for (; balance < 0; ++balance) open.emplace_back(high, low);
    });
    return open;
  }

  /// Neighbours over lines of two triangles are made to agree; the larger part of a piece decides.
  void turn_alike() {
    std::vector<std::array<std::uint32_t, 3>> across(triangles_.size(),
                                                     {kNoTriangle, kNoTriangle, kNoTriangle});
    const auto side = [&](const Edge& e) -> std::uint32_t& {
      std::size_t k = 0;
      while (triangles_[e.triangle][k] != e.from) ++k;
      return across[e.triangle][k];
    };
    each_line(edges(), [&](std::span<const Edge> line) {
      if (line.size() != 2 || line[0].triangle == line[1].triangle) return;
      side(line[0]) = line[1].triangle;
      side(line[1]) = line[0].triangle;
    });
    std::vector<char> seen(triangles_.size(), 0), flip(triangles_.size(), 0);
    std::vector<std::uint32_t> piece;
    for (std::uint32_t start = 0; start < triangles_.size(); ++start) {
      if (seen[start]) continue;
      piece.assign(1, start);
      seen[start] = 1;
      std::size_t flipped = 0;
      for (std::size_t at = 0; at < piece.size(); ++at) {
        const std::uint32_t i = piece[at];
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t j = across[i][k];
          if (j == kNoTriangle || seen[j]) continue;
          const std::uint32_t a = triangles_[i][k], b = triangles_[i][(k + 1) % 3];
          bool is_same_way = false;
          for (std::size_t m = 0; m < 3; ++m)
            is_same_way |= triangles_[j][m] == a && triangles_[j][(m + 1) % 3] == b;
          seen[j] = 1;
          flip[j] = static_cast<char>(is_same_way != (flip[i] != 0));
          flipped += flip[j] ? 1U : 0U;
          piece.push_back(j);
        }
      }
      const bool invert = 2 * flipped > piece.size();
      for (const std::uint32_t i : piece)
        if ((flip[i] != 0) != invert) {
          turn(i);
          ++out_.turned;
        }
    }
  }
  void turn(std::uint32_t t) {
    std::swap(triangles_[t][1], triangles_[t][2]);
    if (t < source_.size()) {
      const std::size_t i = 3 * std::size_t{source_[t]};
      std::swap(out_.triangles[i + 1], out_.triangles[i + 2]);
    }
  }

  /// Closed walks along the open edges, none through a corner twice; as many open edges end in a
  /// corner as begin there, for triangles are closed walks and pairs cancel.
  [[nodiscard]] std::vector<std::vector<std::uint32_t>> rims() {
    const auto open = open_edges();
    out_.open_edges = open.size();
    std::map<std::uint32_t, std::vector<std::uint32_t>> next;
    for (const auto& [from, to] : open) next[from].push_back(to);
    std::vector<std::vector<std::uint32_t>> found;
    std::map<std::uint32_t, std::size_t> place;
    for (auto& [start, ways] : next) {
      while (!ways.empty()) {
        std::vector<std::uint32_t> path{start};
        place.clear();
        place[start] = 0;
        while (!path.empty()) {
          auto& out = next[path.back()];
          if (out.empty()) break;
          const std::uint32_t to = out.back();
          out.pop_back();
          const auto before = place.find(to);
          if (before == place.end()) {
            place[to] = path.size();
            path.push_back(to);
            continue;
          }
          const std::size_t from = before->second;
          found.emplace_back(path.begin() + static_cast<std::ptrdiff_t>(from), path.end());
          for (std::size_t i = from + 1; i < path.size(); ++i) place.erase(path[i]);
          path.resize(from + 1);
        }
      }
    }
    return found;
  }

  void fill() {
    for (const auto& rim : rims()) {
      SurfaceFault fault;
      Vec3 low = points_[rim[0]], high = low, middle{};
      for (const std::uint32_t v : rim) {
        fault.line.push_back(points_[v]);
        middle = add(middle, scale(points_[v], 1.0 / static_cast<double>(rim.size())));
        for (std::size_t k = 0; k < 3; ++k) {
          low[k] = std::min(low[k], points_[v][k]);
          high[k] = std::max(high[k], points_[v][k]);
        }
      }
      for (std::size_t k = 0; k < 3; ++k) fault.size = std::max(fault.size, high[k] - low[k]);
      if (const auto hull = convex_hull(fault.line)) unsure_ += hull->volume;
      fault.at = add(middle, centre_);
      for (Vec3& p : fault.line) p = add(p, centre_);
      if (out_.faults.size() < kMostFaults) out_.faults.push_back(std::move(fault));
      const auto hub = static_cast<std::uint32_t>(points_.size());
      points_.push_back(middle);
      // The triangles run along the rim, so that the filling runs against it.
      for (std::size_t i = 0; i < rim.size(); ++i)
        triangles_.push_back({rim[(i + 1) % rim.size()], rim[i], hub});
    }
  }

  void find_pieces() {
    std::vector<std::uint32_t> root(points_.size());
    std::iota(root.begin(), root.end(), 0U);
    const auto find = [&](std::uint32_t v) {
      while (root[v] != v) v = root[v] = root[root[v]];
      return v;
    };
    for (const Triangle& t : triangles_)
      for (std::size_t k = 1; k < 3; ++k) root[find(t[k])] = find(t[0]);
    std::map<std::uint32_t, std::uint32_t> number;
    for (const Triangle& t : triangles_) {
      const auto [it, is_new] =
          number.emplace(find(t[0]), static_cast<std::uint32_t>(volume_.size()));
      if (is_new) volume_.push_back(0);
      piece_.push_back(it->second);
      volume_[it->second] += dot(points_[t[0]], cross(points_[t[1]], points_[t[2]])) / 6;
    }
  }

  struct Crossing {
    std::uint32_t ray, piece;
    double depth;
    int sign;  ///< +1 where the ray goes in, of a piece that faces outwards
  };

  /// Where the rays along an axis cross; sorted along each.
  [[nodiscard]] std::vector<Crossing> crossings(std::size_t axis) const {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double du = 2 * half_[u] / kRays, dv = 2 * half_[v] / kRays;
    std::vector<Crossing> all;
    if (!(du > 0) || !(dv > 0)) return all;
    const auto first = [](double low, double half, double step, double shift) {
      const double i = std::ceil((low + half) / step - shift);
      return static_cast<std::size_t>(std::clamp(i, 0.0, static_cast<double>(kRays)));
    };
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const Triangle& tri = triangles_[t];
      const auto [ulow, uhigh] =
          std::minmax({points_[tri[0]][u], points_[tri[1]][u], points_[tri[2]][u]});
      const auto [vlow, vhigh] =
          std::minmax({points_[tri[0]][v], points_[tri[1]][v], points_[tri[2]][v]});
      const std::size_t i0 = first(ulow, half_[u], du, kShiftU),
                        i1 = first(uhigh, half_[u], du, kShiftU),
                        j0 = first(vlow, half_[v], dv, kShiftV),
                        j1 = first(vhigh, half_[v], dv, kShiftV);
      for (std::size_t i = i0; i < i1; ++i)
        for (std::size_t j = j0; j < j1; ++j) {
          const double pu = (static_cast<double>(i) + kShiftU) * du - half_[u],
                       pv = (static_cast<double>(j) + kShiftV) * dv - half_[v];
          // Each side is judged from its lower corner, the same for both triangles there.
          std::array<double, 3> w{};
          for (std::size_t k = 0; k < 3; ++k) {
            std::uint32_t a = tri[(k + 1) % 3], b = tri[(k + 2) % 3];
            const bool is_swapped = a > b;
            if (is_swapped) std::swap(a, b);
            const Vec3 &p = points_[a], &q = points_[b];
            w[k] = (q[u] - p[u]) * (pv - p[v]) - (q[v] - p[v]) * (pu - p[u]);
            if (is_swapped) w[k] = -w[k];
          }
          const bool is_up = w[0] > 0 && w[1] > 0 && w[2] > 0;
          const bool is_down = w[0] < 0 && w[1] < 0 && w[2] < 0;
          if (!is_up && !is_down) continue;
          const double sum = w[0] + w[1] + w[2];
          const double depth = (w[0] * points_[tri[0]][axis] + w[1] * points_[tri[1]][axis] +
                                w[2] * points_[tri[2]][axis]) /
                               sum;
          all.push_back(
              {static_cast<std::uint32_t>(i * kRays + j), piece_[t], depth, is_up ? -1 : 1});
        }
    }
    std::sort(all.begin(), all.end(), [](const Crossing& a, const Crossing& b) {
      return std::tie(a.ray, a.depth, a.sign, a.piece) < std::tie(b.ray, b.depth, b.sign, b.piece);
    });
    return all;
  }

  template <class See>
  static void each_ray(const std::vector<Crossing>& all, See&& see) {
    for (std::size_t i = 0; i < all.size();) {
      std::size_t end = i;
      int balance = 0;
      for (; end < all.size() && all[end].ray == all[i].ray; ++end) balance += all[end].sign;
      if (balance == 0) see(std::span(all).subspan(i, end - i));
      i = end;
    }
  }

  /// Pieces that face inwards and stand in no other are turned; then what rays find enclosed more
  /// than once, or inside out, is corrected.
  void cast_rays() {
    const std::array<std::vector<Crossing>, 3> all{crossings(0), crossings(1), crossings(2)};
    std::vector<int> facing(volume_.size(), 1);
    if (std::any_of(volume_.begin(), volume_.end(), [](double v) { return v < 0; })) {
      std::vector<std::size_t> inside(volume_.size(), 0), outside(volume_.size(), 0);
      std::vector<int> around(volume_.size(), 0);
      for (const auto& some : all)
        each_ray(some, [&](std::span<const Crossing> ray) {
          // How often the pieces that face outwards enclose the place, and each inward piece.
          int enclosed = 0;
          for (const Crossing& c : ray) {
            if (volume_[c.piece] >= 0) {
              enclosed += c.sign;
              continue;
            }
            if (around[c.piece] == 0) ++(enclosed > 0 ? inside : outside)[c.piece];
            around[c.piece] += c.sign;
          }
          for (const Crossing& c : ray) around[c.piece] = 0;
        });
      for (std::size_t p = 0; p < volume_.size(); ++p)
        if (volume_[p] < 0 && outside[p] >= inside[p]) facing[p] = -1;
    }
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      if (facing[piece_[t]] < 0) turn(t);
    for (std::size_t axis = 0; axis < 3; ++axis) correct(axis, all[axis], facing);
  }

  void correct(std::size_t axis, const std::vector<Crossing>& all, const std::vector<int>& facing) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double du = 2 * half_[u] / kRays, dv = 2 * half_[v] / kRays;
    each_ray(all, [&](std::span<const Crossing> ray) {
      ++rays_;
      int enclosed = 0;
      Vec3 p{};
      p[u] = (static_cast<double>(ray[0].ray / kRays) + kShiftU) * du - half_[u];
      p[v] = (static_cast<double>(ray[0].ray % kRays) + kShiftV) * dv - half_[v];
      for (std::size_t k = 0; k + 1 < ray.size(); ++k) {
        enclosed += ray[k].sign * facing[ray[k].piece];
        const double from = ray[k].depth, to = ray[k + 1].depth, length = to - from;
        const int change = (enclosed > 0 ? 1 : 0) - enclosed;
        // Faces that touch, by rounding one behind the other, are no fault.
        if (change == 0 || length <= kNear * size()) continue;
        const double w = change * du * dv;
        const double one = (to * to - from * from) / 2;
        const double two = (to * to * to - from * from * from) / 3;
        Integrals part{};
        part[0] = w * length;
        part[1 + axis] = w * one;
        part[1 + u] = w * length * p[u];
        part[1 + v] = w * length * p[v];
        part[4 + axis] = w * two;
        part[4 + u] = w * length * p[u] * p[u];
        part[4 + v] = w * length * p[v] * p[v];
        const auto mixed = [&](std::size_t a, std::size_t b, double value) {
          // xy, yz, xz by the axis that is not in them
          constexpr std::array<std::size_t, 3> kSlot{8, 9, 7};
          part[kSlot[3 - a - b]] = value;
        };
        mixed(u, v, w * length * p[u] * p[v]);
        mixed(axis, u, w * one * p[u]);
        mixed(axis, v, w * one * p[v]);
        correction_[axis] += part;
        excess_[axis] += std::abs(change) * length * du * dv;
        p[axis] = (from + to) / 2;
        if (length > deepest_) {
          deepest_ = length;
          deepest_at_ = p;
        }
      }
    });
  }

  void sum() {
    Integrals total{};
    double area = 0;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const Vec3 &a = points_[triangles_[t][0]], &b = points_[triangles_[t][1]],
                 &c = points_[triangles_[t][2]];
      total += tetrahedron(a, b, c);
      if (t < source_.size()) area += norm(cross(sub(b, a), sub(c, a))) / 2;
    }
    // The three directions see the same places; how they differ tells how well.
    const double excess = (excess_[0] + excess_[1] + excess_[2]) / 3;
    double spread = 0;
    Integrals mean{};
    for (std::size_t i = 0; i < 10; ++i) {
      for (const Integrals& c : correction_) mean[i] += c[i] / 3;
    }
    for (const Integrals& c : correction_) spread = std::max(spread, std::fabs(c[0] - mean[0]));
    total += mean;
    out_.overlap = excess;
    if (excess > 0) {
      SurfaceFault fault;
      fault.kind = SurfaceFault::Kind::overlap;
      fault.at = add(deepest_at_, centre_);
      fault.size = deepest_;
      out_.faults.push_back(std::move(fault));
    }
    const double missed =
        rays_ > 0 ? kRuleOfThree / static_cast<double>(rays_) * std::fabs(total[0]) : 0;
    const double error = unsure_ + 2 * spread + excess / static_cast<double>(kRays) + missed;
    const double reach_squared = dot(half_, half_);
    const double trace = total[4] + total[5] + total[6];
    const auto hull = convex_hull(points_of_triangles());
    constexpr double kBoundRounding = 1e-9;
    const bool fits = total[0] > 0 && trace > 0 && error < total[0] && hull &&
                      total[0] <= hull->volume * (1 + kBoundRounding) + error;
    if (!fits && hull) {
      total = {};
      for (const auto& t : hull->triangles)
        total += tetrahedron(hull->points[t[0]], hull->points[t[1]], hull->points[t[2]]);
      out_.is_hull = true;
    }
    if (!hull) total = {};  // it lies in a plane
    out_.moments = about_origin(total, centre_, area);
    out_.moments.relative_error =
        out_.is_hull   ? 1
        : total[0] > 0 ? std::min(1.0, std::max(error / total[0], error * reach_squared / trace))
                       : 0;
  }

  [[nodiscard]] std::vector<Vec3> points_of_triangles() const {
    std::vector<bool> used(points_.size());
    std::vector<Vec3> some;
    for (std::size_t t = 0; t < source_.size(); ++t)
      for (const std::uint32_t v : triangles_[t])
        if (!used[v]) {
          used[v] = true;
          some.push_back(points_[v]);
        }
    return some;
  }

  SurfaceMoments out_;
  std::vector<Vec3> points_;           ///< about the middle of the box
  std::vector<Triangle> triangles_;    ///< fillings behind those of the file
  std::vector<std::uint32_t> source_;  ///< number of the given triangle
  std::vector<std::uint32_t> piece_;   ///< of each triangle
  std::vector<double> volume_;         ///< of each piece, as it faces
  Vec3 centre_{}, half_{};
  double unsure_ = 0;  ///< volume that fillings may differ by
  std::array<Integrals, 3> correction_{};
  std::array<double, 3> excess_{};
  std::size_t rays_ = 0;
  double deepest_ = 0;
  Vec3 deepest_at_{};
};

}  // namespace

SurfaceMoments surface_moments(std::span<const double> points,
                               std::span<const std::uint32_t> triangles) {
  return Surface(points, triangles).run();
}

std::string state_in_words(const SurfaceMoments& m) {
  std::string out;
  const auto say = [&](const std::string& text) { out += (out.empty() ? "" : ", ") + text; };
  if (m.open_edges > 0)
    say("open along " + std::to_string(m.open_edges) + (m.open_edges == 1 ? " edge" : " edges"));
  if (m.turned > 0)
    say(std::to_string(m.turned) + (m.turned == 1 ? " triangle" : " triangles") + " turned");
  if (m.overlap > 0) say("enclosing places more than once");
  return out;
}

}  // namespace robomosp::spatial
