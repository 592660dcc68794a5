// SPDX-License-Identifier: Apache-2.0
#include "spatial/convex_hull.h"

#include <algorithm>
#include <limits>
#include <unordered_map>

#include "spatial/vec.h"

namespace robomosp::spatial {
namespace {

constexpr double kRelativeEps = 1e-10;

struct Face {
  std::array<std::uint32_t, 3> v{};
  std::array<std::int32_t, 3> next{};  ///< the face across the edge v[k] -> v[k + 1]
  Vec3 normal{};
  double offset = 0;
  std::vector<std::uint32_t> outside;  ///< points beyond the plane
  bool is_alive = true;
};

class Builder {
 public:
  explicit Builder(std::span<const Vec3> points) : points_(points) {}

  bool run() {
    if (!start()) return false;
    for (std::size_t f = 0; f < faces_.size(); ++f)
      if (faces_[f].is_alive && !faces_[f].outside.empty() && !grow(f)) return false;
    return true;
  }

  [[nodiscard]] Hull take() const {
    Hull hull;
    std::unordered_map<std::uint32_t, std::uint32_t> number;
    for (const Face& f : faces_) {
      if (!f.is_alive) continue;
      std::array<std::uint32_t, 3> t{};
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [it, is_new] =
            number.emplace(f.v[k], static_cast<std::uint32_t>(hull.points.size()));
        if (is_new) hull.points.push_back(points_[f.v[k]]);
        t[k] = it->second;
      }
      hull.triangles.push_back(t);
    }
    for (const Vec3& p : hull.points) hull.middle = add(hull.middle, p);
    hull.middle = scale(hull.middle, 1 / static_cast<double>(hull.points.size()));
    for (const auto& t : hull.triangles)
      hull.volume +=
          dot(sub(hull.points[t[0]], hull.middle),
              cross(sub(hull.points[t[1]], hull.middle), sub(hull.points[t[2]], hull.middle))) /
          6;
    return hull;
  }

 private:
  [[nodiscard]] double height(const Face& f, std::uint32_t point) const {
    return dot(f.normal, points_[point]) - f.offset;
  }

  std::int32_t add_face(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    Face f;
    f.v = {a, b, c};
    f.normal = unit(cross(sub(points_[b], points_[a]), sub(points_[c], points_[a])));
    f.offset =
        (dot(f.normal, points_[a]) + dot(f.normal, points_[b]) + dot(f.normal, points_[c])) / 3;
    faces_.push_back(std::move(f));
    return static_cast<std::int32_t>(faces_.size()) - 1;
  }

  /// A tetrahedron as large as is easily found; false when all points lie in a plane.
  bool start() {
    Vec3 low = points_[0], high = points_[0];
    std::array<std::uint32_t, 3> at_low{}, at_high{};
    for (std::uint32_t i = 0; i < points_.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        if (points_[i][k] < low[k]) low[k] = points_[i][k], at_low[k] = i;
        if (points_[i][k] > high[k]) high[k] = points_[i][k], at_high[k] = i;
      }
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
      if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
    eps_ = kRelativeEps * (high[axis] - low[axis]);
    const std::uint32_t a = at_low[axis], b = at_high[axis];
    if (!(eps_ > 0)) return false;
    const auto farthest = [&](auto&& measure) {
      std::uint32_t best = 0;
      double most = -1;
      for (std::uint32_t i = 0; i < points_.size(); ++i)
        if (const double d = measure(points_[i]); d > most) most = d, best = i;
      return std::pair(best, most);
    };
    const Vec3 along = unit(sub(points_[b], points_[a]));
    const auto [c, from_line] =
        farthest([&](const Vec3& p) { return norm(cross(along, sub(p, points_[a]))); });
    if (from_line <= 10 * eps_) return false;
    const Vec3 normal = unit(cross(sub(points_[b], points_[a]), sub(points_[c], points_[a])));
    const auto [d, from_plane] =
        farthest([&](const Vec3& p) { return std::fabs(dot(normal, sub(p, points_[a]))); });
    if (from_plane <= 10 * eps_) return false;
    const bool is_above = dot(normal, sub(points_[d], points_[a])) > 0;
    const std::uint32_t b2 = is_above ? c : b, c2 = is_above ? b : c;
    add_face(a, b2, c2);
    add_face(d, b2, a);
    add_face(d, c2, b2);
    add_face(d, a, c2);
    faces_[0].next = {1, 2, 3};
    faces_[1].next = {2, 0, 3};
    faces_[2].next = {3, 0, 1};
    faces_[3].next = {1, 0, 2};
    std::vector<std::uint32_t> all;
    for (std::uint32_t i = 0; i < points_.size(); ++i) all.push_back(i);
    assign(all, 0);
    return true;
  }

  /// Gives each point to the first face from `first` on that it is beyond of.
  void assign(const std::vector<std::uint32_t>& all, std::size_t first) {
    for (const std::uint32_t p : all)
      for (std::size_t f = first; f < faces_.size(); ++f)
        if (height(faces_[f], p) > eps_) {
          faces_[f].outside.push_back(p);
          break;
        }
  }

  /// Replaces all faces that the farthest point of face `f` sees by a cone from it.
  bool grow(std::size_t f) {
    const auto& beyond = faces_[f].outside;
    const std::uint32_t eye =
        *std::max_element(beyond.begin(), beyond.end(), [&](std::uint32_t p, std::uint32_t q) {
          return height(faces_[f], p) < height(faces_[f], q);
        });
    struct Edge {
      std::uint32_t to;
      std::int32_t face;  ///< that stays
      std::int32_t made = -1;
    };
    std::unordered_map<std::uint32_t, Edge> horizon;  // by its start
    std::vector<std::size_t> stack{f};
    std::vector<std::uint32_t> orphans;
    std::vector<std::uint32_t> order;
    faces_[f].is_alive = false;
    while (!stack.empty()) {
      Face& seen = faces_[stack.back()];
      stack.pop_back();
      orphans.insert(orphans.end(), seen.outside.begin(), seen.outside.end());
      seen.outside = {};
      for (std::size_t k = 0; k < 3; ++k) {
        Face& other = faces_[static_cast<std::size_t>(seen.next[k])];
        if (!other.is_alive) continue;
        if (height(other, eye) > eps_) {
          other.is_alive = false;
          stack.push_back(static_cast<std::size_t>(seen.next[k]));
        }
      }
      closed_.push_back(static_cast<std::size_t>(&seen - faces_.data()));
    }
    for (const std::size_t s : closed_)
      for (std::size_t k = 0; k < 3; ++k) {
        const Face& seen = faces_[s];
        if (!faces_[static_cast<std::size_t>(seen.next[k])].is_alive) continue;
        if (!horizon.emplace(seen.v[k], Edge{seen.v[(k + 1) % 3], seen.next[k]}).second)
          return false;
        order.push_back(seen.v[k]);
      }
    closed_.clear();
    const std::size_t first = faces_.size();
    for (const std::uint32_t from : order) {
      Edge& e = horizon.at(from);
      e.made = add_face(from, e.to, eye);
      Face& other = faces_[static_cast<std::size_t>(e.face)];
      for (std::size_t k = 0; k < 3; ++k)
        if (other.v[k] == e.to && other.v[(k + 1) % 3] == from) other.next[k] = e.made;
    }
    for (const std::uint32_t from : order) {
      const Edge& e = horizon.at(from);
      const auto after = horizon.find(e.to);
      if (after == horizon.end()) return false;
      faces_[static_cast<std::size_t>(e.made)].next[0] = e.face;
      faces_[static_cast<std::size_t>(e.made)].next[1] = after->second.made;
      faces_[static_cast<std::size_t>(after->second.made)].next[2] = e.made;
    }
    std::erase(orphans, eye);
    assign(orphans, first);
    return true;
  }

  std::span<const Vec3> points_;
  std::vector<Face> faces_;
  std::vector<std::size_t> closed_;
  double eps_ = 0;
};

}  // namespace

std::optional<Hull> convex_hull(std::span<const Vec3> points) {
  if (points.size() < 4 ||
      !std::all_of(points.begin(), points.end(), [](const Vec3& p) { return is_finite(p); }))
    return std::nullopt;
  Builder builder(points);
  if (!builder.run()) return std::nullopt;
  return builder.take();
}

std::vector<Vec3> vertices(const Mesh& mesh) {
  std::vector<Vec3> out(mesh.vertex_count());
  for (std::size_t i = 0; i < out.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) out[i][k] = static_cast<double>(mesh.positions[3 * i + k]);
  return out;
}

}  // namespace robomosp::spatial
