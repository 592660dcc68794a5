// SPDX-License-Identifier: Apache-2.0
#include "spatial/surface_cuts.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>

#include "spatial/vec.h"

namespace robomosp::spatial {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
constexpr std::size_t kLeaf = 8;  ///< triangles in a leaf of the tree
constexpr std::uint32_t kNone = ~0U;

struct Box {
  Vec3 low{}, high{};
  void add(const Box& b) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], b.low[k]);
      high[k] = std::max(high[k], b.high[k]);
    }
  }
  [[nodiscard]] bool meets(const Box& b) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (low[k] > b.high[k] || high[k] < b.low[k]) return false;
    return true;
  }
};

double volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return dot(sub(a, d), cross(sub(b, d), sub(c, d)));
}

class Cuts {
 public:
  Cuts(std::span<const double> points, std::span<const std::uint32_t> triangles)
      : points_(points), triangles_(triangles) {
    const std::size_t n = triangles.size() / 3;
    for (std::uint32_t t = 0; t < n; ++t) {
      const Triangle v = corners(t);
      Box b{at(v[0]), at(v[0])};
      b.add({at(v[1]), at(v[1])});
      b.add({at(v[2]), at(v[2])});
      boxes_.push_back(b);
    }
    order_.resize(n);
    std::iota(order_.begin(), order_.end(), 0U);
    if (n > 0) build();
  }

  std::vector<SurfaceCut> run(std::size_t first, std::size_t most) {
    std::vector<SurfaceCut> found;
    std::vector<std::uint32_t> open;
    for (auto t = static_cast<std::uint32_t>(first); t < boxes_.size(); ++t) {
      open.assign(1, 0);
      while (!open.empty()) {
        const Node& node = nodes_[open.back()];
        open.pop_back();
        if (!node.box.meets(boxes_[t])) continue;
        if (node.left != kNone) {
          open.push_back(node.left);
          open.push_back(node.right);
          continue;
        }
        for (std::size_t i = node.first; i < node.end; ++i) {
          const std::uint32_t other = order_[i];
          if (other >= t || !boxes_[other].meets(boxes_[t])) continue;
          if (const auto place = cut(t, other)) found.push_back({{t, other}, *place});
          if (found.size() >= most) return found;
        }
      }
    }
    return found;
  }

 private:
  struct Node {
    Box box;
    std::uint32_t left = kNone, right = kNone;
    std::size_t first = 0, end = 0;
  };

  [[nodiscard]] Vec3 at(std::uint32_t v) const {
    const double* p = points_.data() + 3 * std::size_t{v};
    return {p[0], p[1], p[2]};
  }
  [[nodiscard]] Triangle corners(std::uint32_t t) const {
    const std::uint32_t* v = triangles_.data() + 3 * std::size_t{t};
    return {v[0], v[1], v[2]};
  }

  void build() {
    nodes_.push_back({{}, kNone, kNone, 0, order_.size()});
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      Node node = nodes_[n];
      node.box = boxes_[order_[node.first]];
      for (std::size_t i = node.first; i < node.end; ++i) node.box.add(boxes_[order_[i]]);
      if (node.end - node.first > kLeaf) {
        const Vec3 size = sub(node.box.high, node.box.low);
        const auto axis =
            static_cast<std::size_t>(std::max_element(size.begin(), size.end()) - size.begin());
        const std::size_t middle = (node.first + node.end) / 2;
        const auto from = order_.begin();
        std::nth_element(from + static_cast<std::ptrdiff_t>(node.first),
                         from + static_cast<std::ptrdiff_t>(middle),
                         from + static_cast<std::ptrdiff_t>(node.end),
                         [&](std::uint32_t a, std::uint32_t b) {
                           return boxes_[a].low[axis] + boxes_[a].high[axis] <
                                  boxes_[b].low[axis] + boxes_[b].high[axis];
                         });
        node.left = static_cast<std::uint32_t>(nodes_.size());
        node.right = node.left + 1;
        nodes_[n] = node;
        nodes_.push_back({{}, kNone, kNone, node.first, middle});
        nodes_.push_back({{}, kNone, kNone, middle, node.end});
        continue;
      }
      nodes_[n] = node;
    }
  }

  /// Where a side passes through the inside of a triangle.
  [[nodiscard]] std::optional<Vec3> pierced(std::uint32_t from, std::uint32_t to,
                                            const Triangle& t) const {
    const Vec3 p = at(from), q = at(to), a = at(t[0]), b = at(t[1]), c = at(t[2]);
    const double above = volume(a, b, c, p), below = volume(a, b, c, q);
    if (!(above * below < 0)) return std::nullopt;
    const double u = volume(p, q, a, b), v = volume(p, q, b, c), w = volume(p, q, c, a);
    if (!((u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0))) return std::nullopt;
    return add(p, scale(sub(q, p), above / (above - below)));
  }

  [[nodiscard]] std::optional<Vec3> cut(std::uint32_t one, std::uint32_t other) const {
    const Triangle a = corners(one), b = corners(other);
    const auto has = [](const Triangle& t, std::uint32_t v) {
      return t[0] == v || t[1] == v || t[2] == v;
    };
    const auto side_through = [&](const Triangle& of, const Triangle& through) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = of[k], to = of[(k + 1) % 3];
        if (has(through, from) || has(through, to)) continue;
        if (const auto place = pierced(from, to, through)) return place;
      }
      return std::optional<Vec3>{};
    };
    if (const auto place = side_through(a, b)) return place;
    return side_through(b, a);
  }

  std::span<const double> points_;
  std::span<const std::uint32_t> triangles_;
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace

std::vector<SurfaceCut> surface_cuts(std::span<const double> points,
                                     std::span<const std::uint32_t> triangles, std::size_t first,
                                     std::size_t most) {
  return Cuts(points, triangles).run(first, most);
}

}  // namespace robomosp::spatial
