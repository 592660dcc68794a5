// SPDX-License-Identifier: GPL-3.0-or-later
// Imported meshes made fit for boolean operations: corners welded, needless triangles removed, all
// triangles turned outwards; what cannot be repaired is refused (layer: plugin).
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <span>

#include "first_equals.h"
#include "orient.h"
#include "self_cuts.h"
#include "tessellate.h"

namespace robomosp::csg_cgal {
namespace {

/// Corners within this part of the size are welded when the mesh is open otherwise.
constexpr double kWeld = 1e-6;
/// Faces meeting at a smaller angle are one: cos 30 degrees.
constexpr double kSmooth = 0.866;
/// Triangles whose normals differ by less than this [rad] are one plane.
constexpr double kFlat = 1e-6;

Error wrong(std::string what, std::string hint) {
  return error(ErrorCode::invalid_argument, std::move(what), std::move(hint));
}

std::string place_text(const Vec3& p) {
  return "(" + millimetres_text(p[0]) + ", " + millimetres_text(p[1]) + ", " +
         millimetres_text(p[2]) + ")";
}

std::string count_text(std::size_t n, const char* what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

constexpr std::uint32_t kNone = ~0U;

/// The sides of triangles, whichever way they run, and who has them.
class Sides {
 public:
  Sides(const std::vector<Triangle>& triangles, std::size_t corners)
      : first_(corners + 1, 0), uses_(3 * triangles.size()) {
    const auto each = [&](auto&& see) {
      for (std::uint32_t t = 0; t < triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
          const auto [low, high] = std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]);
          see(low, high, t);
        }
    };
    each([&](std::uint32_t low, std::uint32_t, std::uint32_t) { ++first_[low + 1]; });
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    each([&](std::uint32_t low, std::uint32_t high, std::uint32_t t) {
      uses_[next[low]++] = {high, t};
    });
    for (std::size_t v = 0; v < corners; ++v)
      std::sort(uses_.begin() + first_[v], uses_.begin() + first_[v + 1]);
  }
  struct Use {
    std::uint32_t high, triangle;
    auto operator<=>(const Use&) const = default;
  };
  /// Of the side between two corners, by triangle.
  [[nodiscard]] std::span<const Use> at(std::uint32_t a, std::uint32_t b) const {
    const auto [low, high] = std::minmax(a, b);
    std::uint32_t begin = first_[low];
    while (uses_[begin].high != high) ++begin;
    return run(begin, first_[low + 1]);
  }
  /// Calls `see` with the corners and users of every side in their order.
  template <class See>
  void each(See&& see) const {
    for (std::uint32_t low = 0; low + 1 < first_.size(); ++low)
      for (std::uint32_t i = first_[low]; i < first_[low + 1];) {
        const auto users = run(i, first_[low + 1]);
        see(low, users[0].high, users);
        i += static_cast<std::uint32_t>(users.size());
      }
  }
  /// For each side k of each triangle, from its corner k on, the other triangle there; kNone where
  /// there are not two.
  [[nodiscard]] std::vector<Triangle> neighbours(const std::vector<Triangle>& triangles) const {
    std::vector<Triangle> all(triangles.size(), {kNone, kNone, kNone});
    for (std::uint32_t t = 0; t < triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        if (const auto users = at(triangles[t][k], triangles[t][(k + 1) % 3]); users.size() == 2)
          all[t][k] = users[users[0].triangle == t ? 1 : 0].triangle;
    return all;
  }

 private:
  [[nodiscard]] std::span<const Use> run(std::uint32_t begin, std::uint32_t limit) const {
    std::uint32_t end = begin + 1;
    while (end < limit && uses_[end].high == uses_[begin].high) ++end;
    return std::span(uses_).subspan(begin, end - begin);
  }
  std::vector<std::uint32_t> first_;  ///< by the lower corner
  std::vector<Use> uses_;
};

class Repair {
 public:
  Repair(const CsgGeometry& geometry, double scale) {
    for (std::size_t i = 0; i + 2 < geometry.points.size(); i += 3)
      points_.push_back(snapped(Vec3{geometry.points[i] * scale, geometry.points[i + 1] * scale,
                                     geometry.points[i + 2] * scale}));
    for (std::size_t i = 0; i + 2 < geometry.triangles.size(); i += 3)
      triangles_.push_back(
          {geometry.triangles[i], geometry.triangles[i + 1], geometry.triangles[i + 2]});
    for (const Vec3& p : points_) box_.add(p);
  }

  Result<ImportedMesh> run(std::vector<std::string>& notes, const Host& host) {
    weld_equal();
    if (!is_whole()) RMP_TRY(mend(notes));
    if (triangles_.empty()) return wrong("the mesh has no triangles with area", "Check the file.");
    split_corners();
    ImportedMesh out;
    PatchMesh& mesh = out.mesh;
    mesh.points = std::move(points_);
    mesh.triangles = std::move(triangles_);
    forget_unused(mesh);
    out.neighbours = std::move(across_);
    out.tree = BoxTree(mesh.points, mesh.triangles, 0);
    if (const auto two = self_cut(mesh, out.tree, host))
      return wrong("the mesh cuts itself, for example at " + place_text(mesh.corners((*two)[0])[0]),
                   "Repair it in the program it came from.");
    orient_outwards(mesh, out.neighbours);
    std::size_t flipped = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      if (is_reverse(mesh.triangles[t], before_[t])) ++flipped;
    if (flipped > 0)
      notes.push_back(count_text(flipped, "triangle") +
                      " of the mesh that faced inwards were flipped");
    return out;
  }

 private:
  /// Whether nothing is to be mended: every triangle has area, every side one other triangle that
  /// runs along it the other way.
  bool is_whole() {
    for (const Triangle& t : triangles_)
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0] || long_side_of_sliver(t)) return false;
    auto all = neighbours_of(triangles_, points_.size());
    if (!all) return false;
    for (const Triangle& n : *all)
      if (n[0] == n[1] && n[1] == n[2]) return false;  // back to back
    across_ = std::move(*all);
    before_ = triangles_;
    return true;
  }

  Result<void> mend(std::vector<std::string>& notes) {
    drop_needless();
    if (open_sides().first > 0) {
      const std::size_t before = welded_;
      weld_near(kWeld * box_.diagonal());
      drop_needless();
      if (welded_ > before)
        notes.push_back(count_text(welded_ - before, "corner") + " of the mesh less than " +
                        millimetres_text(kWeld * box_.diagonal()) +
                        " from another were welded to it");
    }
    if (split_slivers()) drop_needless();
    if (dropped_ > 0)
      notes.push_back(count_text(dropped_, "triangle") +
                      " of the mesh without area or with the corners of another were removed");
    if (triangles_.empty()) return {};
    const auto [open, where] = open_sides();
    if (open > 0)
      return wrong("the mesh is not closed: " + count_text(open, "edge") +
                       " with a triangle on one side only, the first at " + place_text(where),
                   "Close it in the program it came from.");
    return turn_alike();
  }

  void map_corners(const std::vector<std::uint32_t>& to) {
    for (std::uint32_t v = 0; v < to.size(); ++v)
      if (to[v] != v) ++welded_;
    for (Triangle& t : triangles_)
      for (std::uint32_t& v : t) v = to[v];
  }

  /// Formats such as STL repeat every corner.
  void weld_equal() {
    const auto first = first_equals(
        points_.size(),
        [&](std::uint32_t v) {
          std::uint64_t key = 0;
          for (const double x : points_[v])
            key = stirred(key, std::bit_cast<std::uint64_t>(x + 0.0));
          return key;
        },
        [&](std::uint32_t v, std::uint32_t w) { return points_[v] == points_[w]; });
    std::vector<std::uint32_t> number(points_.size());
    std::uint32_t count = 0;
    for (std::uint32_t v = 0; v < points_.size(); ++v) {
      if (first[v] == v) points_[count] = points_[v];
      number[v] = first[v] == v ? count++ : number[first[v]];
    }
    points_.resize(count);
    for (Triangle& t : triangles_)
      for (std::uint32_t& v : t) v = number[v];
  }

  void weld_near(double reach) {
    std::vector<std::uint32_t> to(points_.size());
    std::iota(to.begin(), to.end(), 0U);
    std::map<std::array<std::int64_t, 3>, std::vector<std::uint32_t>> cells;
    const auto cell = [&](const Vec3& p, std::size_t k) {
      return static_cast<std::int64_t>(std::floor((p[k] - box_.low[k]) / reach));
    };
    std::set<std::uint32_t> used;
    for (const Triangle& t : triangles_) used.insert(t.begin(), t.end());
    for (const std::uint32_t v : used) {
      const Vec3& p = points_[v];
      const std::array<std::int64_t, 3> at{cell(p, 0), cell(p, 1), cell(p, 2)};
      for (int k = 0; k < 27 && to[v] == v; ++k) {
        const auto near = cells.find({at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1});
        if (near == cells.end()) continue;
        for (const std::uint32_t w : near->second)
          if (norm(points_[w] - p) < reach) {
            to[v] = w;
            break;
          }
      }
      if (to[v] == v) cells[at].push_back(v);
    }
    map_corners(to);
  }

  void drop_needless() {
    std::vector<Triangle> sorted, kept;
    for (const Triangle& t : triangles_) {
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      kept.push_back(t);
      sorted.push_back(t);
      std::sort(sorted.back().begin(), sorted.back().end());
    }
    const auto first = first_equals(
        kept.size(),
        [&](std::uint32_t t) { return stirred(stirred(sorted[t][0], sorted[t][1]), sorted[t][2]); },
        [&](std::uint32_t t, std::uint32_t u) { return sorted[t] == sorted[u]; });
    std::size_t count = 0;
    for (std::uint32_t t = 0; t < kept.size(); ++t)
      if (first[t] == t) kept[count++] = kept[t];
    kept.resize(count);
    dropped_ += triangles_.size() - count;
    triangles_ = std::move(kept);
  }

  [[nodiscard]] Sides sides() const { return {triangles_, points_.size()}; }
  [[nodiscard]] std::pair<std::size_t, Vec3> open_sides() const {
    std::size_t open = 0;
    Vec3 where{};
    sides().each([&](std::uint32_t a, std::uint32_t b, const auto& users) {
      if (users.size() == 1 && open++ == 0) where = (points_[a] + points_[b]) * 0.5;
    });
    return {open, where};
  }

  /// The number of the longest side when the corners lie on one line.
  [[nodiscard]] std::optional<std::size_t> long_side_of_sliver(const Triangle& t) const {
    const Vec3 &a = points_[t[0]], &b = points_[t[1]], &c = points_[t[2]];
    const std::array<double, 3> length{norm(b - a), norm(c - b), norm(a - c)};
    const auto longest =
        static_cast<std::size_t>(std::max_element(length.begin(), length.end()) - length.begin());
    if (norm(cross(b - a, c - a)) > 4 * kGrid * length[longest]) return std::nullopt;
    return longest;
  }

  /// A triangle whose corners lie on one line goes; its neighbour at the longest side is divided
  /// at the corner between. False when there was none.
  bool split_slivers() {
    bool is_any = false;
    for (int round = 0; round < 8; ++round) {
      std::vector<std::uint32_t> slivers;
      for (std::uint32_t t = 0; t < triangles_.size(); ++t)
        if (long_side_of_sliver(triangles_[t])) slivers.push_back(t);
      if (slivers.empty()) return is_any;
      const Sides all = sides();
      std::vector<bool> is_touched(triangles_.size());
      bool is_done = true;
      for (const std::uint32_t t : slivers) {
        if (is_touched[t]) continue;
        const Triangle tri = triangles_[t];
        const std::size_t longest = *long_side_of_sliver(tri);
        const std::uint32_t from = tri[longest], to = tri[(longest + 1) % 3],
                            between = tri[(longest + 2) % 3];
        const auto users = all.at(from, to);
        if (users.size() != 2) continue;
        const std::uint32_t other = users[users[0].triangle == t ? 1 : 0].triangle;
        if (is_touched[other]) continue;
        const Triangle n = triangles_[other];
        for (std::size_t k = 0; k < 3; ++k) {
          if (std::minmax(n[k], n[(k + 1) % 3]) != std::minmax(from, to)) continue;
          triangles_[other] = {n[k], between, n[(k + 2) % 3]};
          triangles_[t] = {between, n[(k + 1) % 3], n[(k + 2) % 3]};
        }
        is_touched[t] = is_touched[other] = true;
        ++dropped_;
        is_done = false;
        is_any = true;
      }
      if (is_done) return is_any;
    }
    return is_any;
  }

  /// Neighbours run through their common side in opposite directions.
  Result<void> turn_alike() {
    const Sides all = sides();
    std::optional<Vec3> crowded;
    all.each([&](std::uint32_t a, std::uint32_t b, const auto& users) {
      if (users.size() > 2 && !crowded) crowded = (points_[a] + points_[b]) * 0.5;
    });
    if (crowded)
      return wrong(
          "more than two triangles of the mesh meet in one edge, at " + place_text(*crowded),
          "Separate the parts that touch there.");
    across_ = all.neighbours(triangles_);
    std::vector<char> state(triangles_.size(), 0);
    std::vector<std::uint32_t> open;
    const auto runs = [&](std::uint32_t t, std::uint32_t from, std::uint32_t to) {
      for (std::size_t k = 0; k < 3; ++k)
        if (triangles_[t][k] == from && triangles_[t][(k + 1) % 3] == to) return true;
      return false;
    };
    before_ = triangles_;
    for (std::uint32_t seed = 0; seed < triangles_.size(); ++seed) {
      if (state[seed]) continue;
      state[seed] = 1;
      open.push_back(seed);
      while (!open.empty()) {
        const std::uint32_t t = open.back();
        open.pop_back();
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
          const std::uint32_t other = across_[t][k];
          const bool is_alike = runs(other, b, a);
          if (state[other] && !is_alike)
            return wrong("the mesh has only one side, like a Moebius strip", "Check the file.");
          if (state[other]) continue;
          if (!is_alike) {
            std::swap(triangles_[other][1], triangles_[other][2]);
            std::swap(across_[other][0], across_[other][2]);
          }
          state[other] = 1;
          open.push_back(other);
        }
      }
    }
    return {};
  }

  /// A corner where several fans of triangles meet is there once for each of them.
  void split_corners() {
    std::vector<std::uint32_t> first(points_.size() + 1, 0), users(3 * triangles_.size());
    for (const Triangle& t : triangles_)
      for (const std::uint32_t v : t) ++first[v + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      for (const std::uint32_t v : triangles_[t]) users[next[v]++] = t;
    const std::size_t count = points_.size();
    const std::vector<Triangle> original = triangles_;
    std::vector<std::uint32_t> seen_at(triangles_.size(), kNone), open;
    for (std::uint32_t v = 0; v < count; ++v) {
      std::uint32_t name = v;
      for (std::uint32_t i = first[v]; i < first[v + 1]; ++i) {
        if (seen_at[users[i]] == v) continue;
        if (i > first[v]) {
          name = static_cast<std::uint32_t>(points_.size());
          points_.push_back(Vec3(points_[v]));
        }
        seen_at[users[i]] = v;
        open.push_back(users[i]);
        while (!open.empty()) {
          const std::uint32_t t = open.back();
          open.pop_back();
          for (std::size_t k = 0; k < 3; ++k) {
            if (original[t][k] == v) triangles_[t][k] = name;
            if (original[t][k] != v && original[t][(k + 1) % 3] != v) continue;
            const std::uint32_t other = across_[t][k];
            if (other == kNone || seen_at[other] == v) continue;
            seen_at[other] = v;
            open.push_back(other);
          }
        }
      }
    }
    // Compared after orientation, which keeps the names of corners.
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const bool was_turned = is_reverse(original[t], before_[t]);
      before_[t] = triangles_[t];
      if (was_turned) std::swap(before_[t][1], before_[t][2]);
    }
  }

  static bool is_reverse(const Triangle& a, const Triangle& b) {
    for (std::size_t k = 0; k < 3; ++k)
      if (a[k] == b[0]) return a[(k + 1) % 3] != b[1];
    return false;
  }

  void forget_unused(PatchMesh& mesh) {
    std::vector<std::uint32_t> number(mesh.points.size(), kNone);
    std::vector<Vec3> kept;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        std::uint32_t& n = number[mesh.triangles[t][k]];
        if (n == kNone) {
          n = static_cast<std::uint32_t>(kept.size());
          kept.push_back(mesh.points[mesh.triangles[t][k]]);
        }
      }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        mesh.triangles[t][k] = number[mesh.triangles[t][k]];
        before_[t][k] = number[before_[t][k]];
      }
    mesh.points = std::move(kept);
  }

  std::vector<Vec3> points_;
  std::vector<Triangle> triangles_, before_;  ///< before_: as given, but for its corners' names
  std::vector<Triangle> across_;              ///< the neighbours of each triangle
  Box3 box_;
  std::size_t welded_ = 0, dropped_ = 0;
};

/// Faces: runs of triangles that meet smoothly. A face all of whose triangles lie in a plane is
/// one.
/// `deviation`: how far the triangles may be off the solid they stand for [m].
void find_faces(PatchMesh& mesh, const std::vector<Triangle>& across, std::uint64_t key,
                double deviation) {
  const std::size_t n = mesh.triangles.size();
  std::vector<Vec3> normal(n);
  for (std::size_t t = 0; t < n; ++t) normal[t] = unit(mesh.area_vector(t));
  mesh.patch_of.assign(n, kNone);
  std::vector<std::uint32_t> open;
  for (std::uint32_t seed = 0; seed < n; ++seed) {
    if (mesh.patch_of[seed] != kNone) continue;
    const auto number = static_cast<std::uint32_t>(mesh.patches.size());
    Patch patch;
    patch.id = mixed(key, number);
    patch.point = mesh.points[mesh.triangles[seed][0]];
    patch.axis = normal[seed];
    bool is_flat = true;
    double straightest = 1;  // cosine of the greatest angle between neighbours
    mesh.patch_of[seed] = number;
    open.push_back(seed);
    while (!open.empty()) {
      const std::uint32_t t = open.back();
      open.pop_back();
      is_flat = is_flat && norm(normal[t] - patch.axis) < kFlat;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t next = across[t][k];
        if (mesh.patch_of[next] != kNone) continue;
        const double cosine = dot(normal[t], normal[next]);
        if (cosine < kSmooth) continue;
        straightest = std::min(straightest, cosine);
        mesh.patch_of[next] = number;
        open.push_back(next);
      }
    }
    patch.kind = is_flat ? Patch::Kind::plane : Patch::Kind::free;
    patch.deviation = deviation;
    // A surface that turns by the angle a from triangle to triangle is longer by a^2 / 24 along,
    // and as much across; twice that for triangles that are not all alike.
    if (deviation > 0) patch.area_error = 4 * (1 - straightest) / 12;
    mesh.patches.push_back(patch);
  }
}

}  // namespace

Result<ImportedMesh> imported_mesh(const CsgGeometry& geometry, double scale, std::uint64_t key,
                                   std::vector<std::string>& notes, const Host& host) {
  if (geometry.points.size() % 3 != 0 || geometry.triangles.size() % 3 != 0)
    return wrong("the mesh has incomplete corners or triangles", "Check the file.");
  if (geometry.triangles.empty()) return wrong("the mesh has no triangles", "Check the file.");
  for (const double x : geometry.points)
    if (!std::isfinite(x) || std::abs(x * scale) > kCsgGreatestLength)
      return wrong("a corner of the mesh is not a number within " +
                       csg_number_text(kCsgGreatestLength) + " m",
                   "Check the file's unit.");
  for (const std::uint32_t v : geometry.triangles)
    if (v >= geometry.points.size() / 3)
      return wrong("a triangle of the mesh names corner " + std::to_string(v) + " of " +
                       std::to_string(geometry.points.size() / 3),
                   "Check the file.");
  RMP_TRY_ASSIGN(ImportedMesh made, Repair(geometry, scale).run(notes, host));
  if (!(volume_of(made.mesh) > 0)) return wrong("the mesh encloses no volume", "Check the file.");
  find_faces(made.mesh, made.neighbours, key, geometry.deviation * scale);
  return made;
}

}  // namespace robomosp::csg_cgal
