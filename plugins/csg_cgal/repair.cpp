// SPDX-License-Identifier: GPL-3.0-or-later
// Imported meshes made fit for boolean operations: corners welded, needless triangles removed, all
// triangles turned outwards; what cannot be repaired is refused (layer: plugin).
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <unordered_map>

#include "exact_solid.h"
#include "tessellate.h"

namespace robomosp::csg_cgal {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

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

  Result<PatchMesh> run(std::vector<std::string>& notes) {
    weld_equal();
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
    split_slivers();
    drop_needless();
    if (dropped_ > 0)
      notes.push_back(count_text(dropped_, "triangle") +
                      " of the mesh without area or there twice were removed");
    if (triangles_.empty()) return wrong("the mesh has no triangles with area", "Check the file.");
    const auto [open, where] = open_sides();
    if (open > 0)
      return wrong("the mesh is not closed: " + count_text(open, "edge") +
                       " with a triangle on one side only, the first at " + place_text(where),
                   "Close it in the program it came from.");
    RMP_TRY(turn_alike());
    split_corners();
    PatchMesh mesh;
    mesh.points = points_;
    mesh.triangles = triangles_;
    forget_unused(mesh);
    std::array<std::uint32_t, 2> witness{};
    if (!orient_outwards(mesh, witness))
      return wrong(
          "the mesh cuts itself, for example at " + place_text(mesh.corners(witness[0])[0]),
          "Repair it in the program it came from.");
    std::size_t flipped = 0;
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      if (is_reverse(mesh.triangles[t], before_[t])) ++flipped;
    if (flipped > 0)
      notes.push_back(count_text(flipped, "triangle") +
                      " of the mesh that faced inwards were turned round");
    return mesh;
  }

 private:
  void map_corners(const std::vector<std::uint32_t>& to) {
    for (std::uint32_t v = 0; v < to.size(); ++v)
      if (to[v] != v) ++welded_;
    for (Triangle& t : triangles_)
      for (std::uint32_t& v : t) v = to[v];
  }

  void weld_equal() {
    std::vector<std::uint32_t> to(points_.size());
    std::map<Vec3, std::uint32_t> first;
    for (std::uint32_t v = 0; v < points_.size(); ++v)
      to[v] = first.try_emplace(points_[v], v).first->second;
    map_corners(to);
    welded_ = 0;  // formats such as STL repeat every corner
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
    std::map<Triangle, std::size_t> seen;  // sorted corners
    std::vector<Triangle> kept;
    for (const Triangle& t : triangles_) {
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
        ++dropped_;
        continue;
      }
      Triangle sorted = t;
      std::sort(sorted.begin(), sorted.end());
      if (!seen.emplace(sorted, kept.size()).second) {
        ++dropped_;
        continue;
      }
      kept.push_back(t);
    }
    triangles_ = std::move(kept);
  }

  using Side = std::pair<std::uint32_t, std::uint32_t>;
  static Side side_of(const Triangle& t, std::size_t k) {
    return std::minmax(t[k], t[(k + 1) % 3]);
  }
  [[nodiscard]] std::map<Side, std::vector<std::uint32_t>> sides() const {
    std::map<Side, std::vector<std::uint32_t>> all;
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) all[side_of(triangles_[t], k)].push_back(t);
    return all;
  }
  [[nodiscard]] std::pair<std::size_t, Vec3> open_sides() const {
    std::size_t open = 0;
    Vec3 where{};
    for (const auto& [side, users] : sides())
      if (users.size() == 1 && open++ == 0)
        where = (points_[side.first] + points_[side.second]) * 0.5;
    return {open, where};
  }

  /// A triangle whose corners lie on one line goes; its neighbour at the longest side is divided
  /// at the corner between.
  void split_slivers() {
    for (int round = 0; round < 8; ++round) {
      const auto all = sides();
      std::vector<bool> is_touched(triangles_.size());
      bool is_done = true;
      const std::size_t count = triangles_.size();
      for (std::uint32_t t = 0; t < count; ++t) {
        if (is_touched[t]) continue;
        const Triangle tri = triangles_[t];
        const Vec3 &a = points_[tri[0]], &b = points_[tri[1]], &c = points_[tri[2]];
        const std::array<double, 3> length{norm(b - a), norm(c - b), norm(a - c)};
        const auto longest = static_cast<std::size_t>(
            std::max_element(length.begin(), length.end()) - length.begin());
        if (norm(cross(b - a, c - a)) > 4 * kGrid * length[longest]) continue;
        const std::uint32_t between = tri[(longest + 2) % 3];
        const auto& users = all.at(side_of(tri, longest));
        if (users.size() != 2) continue;
        const std::uint32_t other = users[0] == t ? users[1] : users[0];
        if (is_touched[other]) continue;
        const Triangle n = triangles_[other];
        for (std::size_t k = 0; k < 3; ++k) {
          if (side_of(n, k) != side_of(tri, longest)) continue;
          triangles_[other] = {n[k], between, n[(k + 2) % 3]};
          triangles_[t] = {between, n[(k + 1) % 3], n[(k + 2) % 3]};
        }
        is_touched[t] = is_touched[other] = true;
        ++dropped_;
        is_done = false;
      }
      if (is_done) return;
    }
  }

  /// Neighbours run through their common side in opposite directions.
  Result<void> turn_alike() {
    const auto all = sides();
    for (const auto& [side, users] : all)
      if (users.size() > 2)
        return wrong("more than two triangles of the mesh meet in one edge, at " +
                         place_text((points_[side.first] + points_[side.second]) * 0.5),
                     "Separate the parts that touch there.");
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
          const auto& users = all.at(std::minmax(a, b));
          const std::uint32_t other = users[0] == t ? users[1] : users[0];
          const bool is_alike = runs(other, b, a);
          if (state[other] && !is_alike)
            return wrong("the mesh has only one side, like a Moebius strip", "Check the file.");
          if (state[other]) continue;
          if (!is_alike) std::swap(triangles_[other][1], triangles_[other][2]);
          state[other] = 1;
          open.push_back(other);
        }
      }
    }
    return {};
  }

  /// A corner where several fans of triangles meet is there once for each of them.
  void split_corners() {
    const auto all = sides();
    std::vector<std::vector<std::uint32_t>> users(points_.size());
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      for (const std::uint32_t v : triangles_[t]) users[v].push_back(t);
    const std::size_t count = points_.size();
    const std::vector<Triangle> original = triangles_;
    for (std::uint32_t v = 0; v < count; ++v) {
      std::set<std::uint32_t> rest(users[v].begin(), users[v].end());
      for (bool is_first = true; !rest.empty(); is_first = false) {
        std::uint32_t name = v;
        if (!is_first) {
          name = static_cast<std::uint32_t>(points_.size());
          points_.push_back(Vec3(points_[v]));
        }
        std::vector<std::uint32_t> open{*rest.begin()};
        rest.erase(rest.begin());
        while (!open.empty()) {
          const std::uint32_t t = open.back();
          open.pop_back();
          for (std::size_t k = 0; k < 3; ++k) {
            const Side side = side_of(original[t], k);
            if (side.first != v && side.second != v) continue;
            for (const std::uint32_t next : all.at(side))
              if (rest.erase(next) > 0) open.push_back(next);
          }
          for (std::size_t k = 0; k < 3; ++k)
            if (original[t][k] == v) triangles_[t][k] = name;
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
    std::vector<std::uint32_t> number(mesh.points.size(), ~0U);
    std::vector<Vec3> kept;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        std::uint32_t& n = number[mesh.triangles[t][k]];
        if (n == ~0U) {
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
  Box3 box_;
  std::size_t welded_ = 0, dropped_ = 0;
};

/// Faces: runs of triangles that meet smoothly. A face all of whose triangles lie in a plane is
/// one.
/// `deviation`: how far the triangles may be off the solid they stand for [m].
void find_faces(PatchMesh& mesh, std::uint64_t key, double deviation) {
  const std::size_t n = mesh.triangles.size();
  std::vector<Vec3> normal(n);
  for (std::size_t t = 0; t < n; ++t) normal[t] = unit(mesh.area_vector(t));
  std::unordered_map<std::uint64_t, std::uint32_t> across;  // directed side -> triangle
  const auto side = [](std::uint32_t a, std::uint32_t b) { return (std::uint64_t{a} << 32U) | b; };
  for (std::uint32_t t = 0; t < n; ++t)
    for (std::size_t k = 0; k < 3; ++k)
      across[side(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3])] = t;
  mesh.patch_of.assign(n, ~0U);
  std::vector<std::uint32_t> open;
  for (std::uint32_t seed = 0; seed < n; ++seed) {
    if (mesh.patch_of[seed] != ~0U) continue;
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
        const auto next = across.find(side(mesh.triangles[t][(k + 1) % 3], mesh.triangles[t][k]));
        if (next == across.end() || mesh.patch_of[next->second] != ~0U) continue;
        const double cosine = dot(normal[t], normal[next->second]);
        if (cosine < kSmooth) continue;
        straightest = std::min(straightest, cosine);
        mesh.patch_of[next->second] = number;
        open.push_back(next->second);
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

Result<PatchMesh> imported_mesh(const CsgGeometry& geometry, double scale, std::uint64_t key,
                                std::vector<std::string>& notes) {
  if (geometry.points.size() % 3 != 0 || geometry.triangles.size() % 3 != 0)
    return wrong("the mesh has incomplete corners or triangles", "Check the file.");
  if (geometry.triangles.empty()) return wrong("the mesh has no triangles", "Check the file.");
  for (const double x : geometry.points)
    if (!std::isfinite(x) || std::abs(x * scale) > kGreatestLength)
      return wrong(
          "a corner of the mesh is not a number within " + number_text(kGreatestLength) + " m",
          "Check the file's unit.");
  for (const std::uint32_t v : geometry.triangles)
    if (v >= geometry.points.size() / 3)
      return wrong("a triangle of the mesh names corner " + std::to_string(v) + " of " +
                       std::to_string(geometry.points.size() / 3),
                   "Check the file.");
  RMP_TRY_ASSIGN(PatchMesh mesh, Repair(geometry, scale).run(notes));
  if (!(volume_of(mesh) > 0)) return wrong("the mesh encloses no volume", "Check the file.");
  find_faces(mesh, key, geometry.deviation * scale);
  return mesh;
}

}  // namespace robomosp::csg_cgal
