// SPDX-License-Identifier: Apache-2.0
#include "mesh_repair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "spatial/surface_cuts.h"

namespace robomosp::cad_exchange {
namespace {

using Point = std::array<double, 3>;
using Triangle = std::array<std::uint32_t, 3>;
using Edge = std::pair<std::uint32_t, std::uint32_t>;  ///< directed

/// Vertices nearer than this share of the size of the model are one when edges are open.
constexpr double kWeldShare = 1e-6;
/// A surface that encloses less than this share of its size cubed encloses rounding only.
constexpr double kLeastShare = 1e-9;
/// Holes with more corners are filled from their middle instead of ear by ear.
constexpr std::size_t kMostEars = 500;

struct EdgeHash {
  std::size_t operator()(const Edge& e) const {
    return std::hash<std::uint64_t>()((std::uint64_t{e.first} << 32) | e.second);
  }
};

Point sub(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

struct Surface {
  std::vector<Point> points;
  std::vector<Triangle> triangles;

  void renumber(const std::vector<std::uint32_t>& to) {
    for (Triangle& t : triangles)
      for (std::uint32_t& i : t) i = to[i];
  }
  std::size_t drop_degenerate() {
    return std::erase_if(
        triangles, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  }
  [[nodiscard]] double size() const {
    if (points.empty()) return 0;
    Point low = points[0], high = points[0];
    for (const Point& p : points)
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  }
  [[nodiscard]] double volume(std::size_t from, std::size_t to) const {
    if (from >= to) return 0;
    const Point& o = points[triangles[from][0]];
    double six = 0;
    for (std::size_t i = from; i < to; ++i) {
      const Triangle& t = triangles[i];
      six += dot(sub(points[t[0]], o), cross(sub(points[t[1]], o), sub(points[t[2]], o)));
    }
    return six / 6;
  }
};

void weld_exactly(Surface& s) {
  std::map<Point, std::uint32_t> first;
  std::vector<std::uint32_t> to(s.points.size());
  std::vector<Point> kept;
  for (std::size_t i = 0; i < s.points.size(); ++i) {
    Point p = s.points[i];
    for (double& x : p) x += 0.0;  // -0 is 0
    const auto [it, is_new] = first.try_emplace(p, static_cast<std::uint32_t>(kept.size()));
    if (is_new) kept.push_back(p);
    to[i] = it->second;
  }
  s.points = std::move(kept);
  s.renumber(to);
}

/// Joins each vertex to the first one within the tolerance; returns how many were.
std::size_t weld_near(Surface& s, double tolerance) {
  if (!(tolerance > 0)) return 0;
  std::map<std::array<std::int64_t, 3>, std::vector<std::uint32_t>> cells;
  std::vector<std::uint32_t> to(s.points.size());
  const auto cell = [&](const Point& p) {
    std::array<std::int64_t, 3> c{};
    for (std::size_t k = 0; k < 3; ++k)
      c[k] = static_cast<std::int64_t>(std::clamp(std::floor(p[k] / tolerance), -1e18, 1e18));
    return c;
  };
  std::size_t joined = 0;
  for (std::uint32_t i = 0; i < s.points.size(); ++i) {
    const auto home = cell(s.points[i]);
    to[i] = i;
    for (int n = 0; n < 27 && to[i] == i; ++n) {
      const auto it =
          cells.find({home[0] + n % 3 - 1, home[1] + n / 3 % 3 - 1, home[2] + n / 9 - 1});
      if (it == cells.end()) continue;
      for (const std::uint32_t j : it->second) {
        const Point d = sub(s.points[i], s.points[j]);
        if (dot(d, d) > tolerance * tolerance) continue;
        to[i] = j;
        break;
      }
    }
    if (to[i] == i) cells[home].push_back(i);
    else ++joined;
  }
  s.renumber(to);
  return joined;
}

/// Triangles of the same three corners: of a pair that faces both ways neither stays (it encloses
/// nothing), of one that stands twice the same way one does.
std::size_t drop_doubled(Surface& s) {
  const auto rotated = [](Triangle t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
  };
  std::map<Triangle, int> balance;
  for (const Triangle& t : s.triangles) {
    const Triangle r = rotated(t), mirrored{r[0], r[2], r[1]};
    if (r < mirrored) ++balance[r];
    else --balance[mirrored];
  }
  std::vector<Triangle> kept;
  for (const Triangle& t : s.triangles) {
    const Triangle r = rotated(t), mirrored{r[0], r[2], r[1]};
    int& left = balance[std::min(r, mirrored)];
    if ((left > 0) != (r < mirrored) || left == 0) continue;
    kept.push_back(t);
    left = 0;
  }
  const std::size_t gone = s.triangles.size() - kept.size();
  s.triangles = std::move(kept);
  return gone;
}

/// How often each directed edge is left after those of opposite direction have paired off.
std::map<Edge, int> open_edges(const Surface& s) {
  std::map<Edge, int> open;
  for (const Triangle& t : s.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if (const auto other = open.find({b, a}); other != open.end()) {
        if (--other->second == 0) open.erase(other);
      } else {
        ++open[{a, b}];
      }
    }
  return open;
}

/// Turns triangles so that neighbours over plain edges (of two triangles) agree, piece by piece;
/// the larger part of a piece decides. Returns how many were turned.
std::size_t agree(Surface& s) {
  std::unordered_map<Edge, std::vector<std::uint32_t>, EdgeHash> users;
  for (std::uint32_t i = 0; i < s.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = s.triangles[i][k], b = s.triangles[i][(k + 1) % 3];
      users[std::minmax(a, b)].push_back(i);
    }
  const auto runs = [&](std::uint32_t i, std::uint32_t a, std::uint32_t b) {
    const Triangle& t = s.triangles[i];
    return (t[0] == a && t[1] == b) || (t[1] == a && t[2] == b) || (t[2] == a && t[0] == b);
  };
  std::vector<char> seen(s.triangles.size(), 0), flip(s.triangles.size(), 0);
  std::size_t turned = 0;
  std::vector<std::uint32_t> piece;
  for (std::uint32_t start = 0; start < s.triangles.size(); ++start) {
    if (seen[start]) continue;
    piece.assign(1, start);
    seen[start] = 1;
    std::size_t flipped = 0;
    for (std::size_t at = 0; at < piece.size(); ++at) {
      const std::uint32_t i = piece[at];
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = s.triangles[i][k], b = s.triangles[i][(k + 1) % 3];
        const auto& both = users[std::minmax(a, b)];
        if (both.size() != 2) continue;
        const std::uint32_t j = both[0] == i ? both[1] : both[0];
        if (seen[j]) continue;
        seen[j] = 1;
        const bool same_way = runs(j, a, b);
        flip[j] = static_cast<char>(same_way != (flip[i] != 0));
        flipped += flip[j] ? 1U : 0U;
        piece.push_back(j);
      }
    }
    const bool invert = 2 * flipped > piece.size();
    for (const std::uint32_t i : piece) {
      if ((flip[i] != 0) == invert) continue;
      std::swap(s.triangles[i][1], s.triangles[i][2]);
      ++turned;
    }
  }
  return turned;
}

/// Directed cycles that use up the open edges: in every vertex as many begin as end, since each
/// triangle is a cycle itself and edges pair off in both directions.
std::vector<std::vector<std::uint32_t>> cycles(const std::map<Edge, int>& open) {
  std::map<std::uint32_t, std::vector<std::uint32_t>> next;
  for (const auto& [edge, count] : open)
    for (int i = 0; i < count; ++i) next[edge.first].push_back(edge.second);
  std::vector<std::vector<std::uint32_t>> found;
  for (auto& [start, ways] : next) {
    while (!ways.empty()) {
      std::vector<std::uint32_t> path{start};
      std::unordered_map<std::uint32_t, std::size_t> place{{start, 0}};
      for (;;) {
        auto& out = next[path.back()];
        if (out.empty()) break;  // the rest of this walk was used up as cycles
        const std::uint32_t to = out.back();
        out.pop_back();
        const auto before = place.find(to);
        if (before == place.end()) {
          place[to] = path.size();
          path.push_back(to);
          continue;
        }
        // Cut the cycle out, so that none passes a vertex twice.
        std::vector<std::uint32_t> cycle(path.begin() + static_cast<std::ptrdiff_t>(before->second),
                                         path.end());
        for (std::size_t i = before->second + 1; i < path.size(); ++i) place.erase(path[i]);
        path.resize(before->second + 1);
        found.push_back(std::move(cycle));
        if (path.size() == 1 && next[start].empty()) break;
      }
    }
  }
  return found;
}

/// Fills the hole whose rim is run as its triangles run it, so the filling runs it backwards.
void fill(Surface& s, std::vector<std::uint32_t> rim) {
  std::reverse(rim.begin(), rim.end());
  if (rim.size() < 3) return;
  Point normal{}, middle{};
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const Point &a = s.points[rim[i]], &b = s.points[rim[(i + 1) % rim.size()]];
    const Point n = cross(sub(a, s.points[rim[0]]), sub(b, s.points[rim[0]]));
    for (std::size_t k = 0; k < 3; ++k) {
      normal[k] += n[k];
      middle[k] += a[k] / static_cast<double>(rim.size());
    }
  }
  const auto corner = [&](std::size_t a, std::size_t b, std::size_t c) {
    return dot(normal, cross(sub(s.points[rim[b]], s.points[rim[a]]),
                             sub(s.points[rim[c]], s.points[rim[a]])));
  };
  while (rim.size() > 3 && rim.size() <= kMostEars) {
    const std::size_t n = rim.size();
    bool cut = false;
    for (std::size_t i = 0; i < n && !cut; ++i) {
      const std::size_t before = (i + n - 1) % n, after = (i + 1) % n;
      if (!(corner(before, i, after) > 0)) continue;
      bool is_empty = true;
      for (std::size_t j = 0; j < n && is_empty; ++j)
        is_empty = j == before || j == i || j == after ||
                   !(corner(before, i, j) >= 0 && corner(i, after, j) >= 0 &&
                     corner(after, before, j) >= 0);
      if (!is_empty) continue;
      s.triangles.push_back({rim[before], rim[i], rim[after]});
      rim.erase(rim.begin() + static_cast<std::ptrdiff_t>(i));
      cut = true;
    }
    if (!cut) break;
  }
  if (rim.size() == 3) {
    s.triangles.push_back({rim[0], rim[1], rim[2]});
    return;
  }
  // What does not come apart ear by ear (a twisted rim) is joined to its middle.
  const auto hub = static_cast<std::uint32_t>(s.points.size());
  s.points.push_back(middle);
  for (std::size_t i = 0; i < rim.size(); ++i)
    s.triangles.push_back({rim[i], rim[(i + 1) % rim.size()], hub});
}

void fill_holes(Surface& s, MeshRepair& done) {
  for (auto& rim : cycles(open_edges(s))) {
    Point low = s.points[rim[0]], high = low;
    for (const std::uint32_t i : rim)
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], s.points[i][k]);
        high[k] = std::max(high[k], s.points[i][k]);
      }
    for (std::size_t k = 0; k < 3; ++k)
      done.widest_hole = std::max(done.widest_hole, high[k] - low[k]);
    ++done.holes;
    fill(s, std::move(rim));
  }
}

std::string millimetres(const Point& p) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.4g, %.4g, %.4g) mm", p[0] * 1e3, p[1] * 1e3, p[2] * 1e3);
  return text;
}

/// Closes the surface; says why the result is none that can be vouched for, or "".
std::string close(Surface& s, MeshRepair& done) {
  done.welded = weld_near(s, kWeldShare * s.size());
  done.degenerate += s.drop_degenerate();
  if (!open_edges(s).empty()) {
    done.doubled = drop_doubled(s);
    done.turned = agree(s);
    const std::size_t before = s.triangles.size();
    fill_holes(s, done);
    std::vector<double> points;
    std::vector<std::uint32_t> triangles;
    for (const Point& p : s.points) points.insert(points.end(), p.begin(), p.end());
    for (const Triangle& t : s.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
    if (const auto cuts = spatial::surface_cuts(points, triangles, before, 1); !cuts.empty())
      return "filling its holes would cut the surface at " + millimetres(cuts[0].at);
    if (!open_edges(s).empty()) return "its holes could not be filled";
  }
  const double size = s.size();
  if (s.triangles.empty() ||
      !(std::fabs(s.volume(0, s.triangles.size())) > kLeastShare * size * size * size))
    return "it would enclose no volume when closed";
  return {};
}

/// Vertices in the order of their first use; unused ones go.
void compact(Surface& s) {
  constexpr std::uint32_t kNone = ~0U;
  std::vector<std::uint32_t> to(s.points.size(), kNone);
  std::vector<Point> kept;
  for (Triangle& t : s.triangles)
    for (std::uint32_t& i : t) {
      if (to[i] == kNone) {
        to[i] = static_cast<std::uint32_t>(kept.size());
        kept.push_back(s.points[i]);
      }
      i = to[i];
    }
  s.points = std::move(kept);
}

std::string count(std::size_t n, const char* one, const char* many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

}  // namespace

std::vector<std::string> MeshRepair::notes(const std::string& name) const {
  const std::string what = name.empty() ? "The mesh: " : "The mesh \"" + name + "\": ";
  std::vector<std::string> out;
  const auto say = [&](const std::string& text) { out.push_back(what + text); };
  if (welded)
    say(count(welded, "vertex very close to another was", "vertices very close to others were") +
        " joined.");
  if (degenerate)
    say(count(degenerate, "triangle", "triangles") + " without area " +
        (degenerate == 1 ? "was" : "were") + " left out.");
  if (doubled)
    say(count(doubled, "duplicate triangle was", "duplicate triangles were") + " left out.");
  if (turned)
    say(count(turned, "triangle was", "triangles were") + " flipped to match their neighbours.");
  if (holes) {
    char width[32];
    std::snprintf(width, sizeof width, "%.3g", widest_hole * 1e3);
    say(count(holes, "hole was", "holes were") + " filled, the widest " + width +
        " mm across; check the shape there.");
  }
  if (inside_out) say("it was inside out and was flipped.");
  if (open_edges)
    say(count(open_edges, "edge is", "edges are") + " open, one at " + millimetres(open_at) +
        (failure.empty() ? "" : ", and " + failure) +
        ". It is drawn and collides unchanged; operations on solids reject it.");
  return out;
}

MeshRepair repair(std::vector<double>& points, std::vector<std::uint32_t>& triangles, bool heal) {
  Surface s;
  s.points.resize(points.size() / 3);
  for (std::size_t i = 0; i < s.points.size(); ++i)
    s.points[i] = {points[3 * i], points[3 * i + 1], points[3 * i + 2]};
  s.triangles.resize(triangles.size() / 3);
  for (std::size_t i = 0; i < s.triangles.size(); ++i)
    s.triangles[i] = {triangles[3 * i], triangles[3 * i + 1], triangles[3 * i + 2]};

  MeshRepair done;
  weld_exactly(s);
  done.degenerate = s.drop_degenerate();
  if (heal && !open_edges(s).empty()) {
    Surface healed = s;
    MeshRepair further = done;
    further.failure = close(healed, further);
    if (further.failure.empty()) {
      s = std::move(healed);
      done = std::move(further);
    } else {
      done.failure = std::move(further.failure);
    }
  }
  if (heal && s.volume(0, s.triangles.size()) < 0) {
    done.inside_out = true;
    for (Triangle& t : s.triangles) std::swap(t[1], t[2]);
  }
  for (const auto& [edge, n] : open_edges(s)) {
    if (done.open_edges == 0)
      for (std::size_t k = 0; k < 3; ++k)
        done.open_at[k] = (s.points[edge.first][k] + s.points[edge.second][k]) / 2;
    done.open_edges += static_cast<std::size_t>(n);
  }
  done.volume = s.volume(0, s.triangles.size());
  compact(s);
  points.clear();
  for (const Point& p : s.points) points.insert(points.end(), p.begin(), p.end());
  triangles.clear();
  for (const Triangle& t : s.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
  return done;
}

}  // namespace robomosp::cad_exchange
