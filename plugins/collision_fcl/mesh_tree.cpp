// SPDX-License-Identifier: Apache-2.0
#include "mesh_tree.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::collision_fcl {
namespace {

using namespace spatial;

constexpr std::uint32_t kLeaf = 4;  ///< triangles that are not divided further

/// Around a core, in the frame of the mesh.
Box box_of(const Core& core, const Pose& mesh_T_core) {
  Vec3 low{}, high{};
  std::uint32_t hint = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    Vec3 along{};
    along[k] = 1;
    const Vec3 d = rotate_back(mesh_T_core, along);
    high[k] = transform(mesh_T_core, support(core, d, hint))[k] + core.margin;
    low[k] = transform(mesh_T_core, support(core, scale(d, -1), hint))[k] - core.margin;
  }
  return {scale(add(low, high), 0.5), scale(sub(high, low), 0.5)};
}

}  // namespace

MeshTree::MeshTree(std::span<const Vec3> points,
                   std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::vector<std::array<Vec3, 3>> given;
  std::vector<Box> boxes;
  for (const auto& t : triangles) {
    given.push_back({points[t[0]], points[t[1]], points[t[2]]});
    boxes.push_back(box_around(given.back()));
  }
  // Halved by the middles of the boxes along the longest side, without recursion: a mesh of a line
  // of triangles is as deep as any other.
  std::vector<std::uint32_t> order(given.size());
  std::iota(order.begin(), order.end(), 0U);
  struct Job {
    std::uint32_t node, first, count;
  };
  nodes_.emplace_back();
  std::vector<Job> jobs{{0, 0, static_cast<std::uint32_t>(given.size())}};
  while (!jobs.empty()) {
    const Job job = jobs.back();
    jobs.pop_back();
    const auto begin = order.begin() + job.first, end = begin + job.count;
    Box box = boxes[*begin];
    for (auto i = begin; i != end; ++i) box = around(box, boxes[*i]);
    nodes_[job.node].box = box;
    if (job.count <= kLeaf) {
      nodes_[job.node].first = job.first;
      nodes_[job.node].count = job.count;
      continue;
    }
    const auto longest = static_cast<std::size_t>(
        std::max_element(box.half.begin(), box.half.end()) - box.half.begin());
    const std::uint32_t half = job.count / 2;
    std::nth_element(begin, begin + half, end, [&](std::uint32_t a, std::uint32_t b) {
      return boxes[a].centre[longest] < boxes[b].centre[longest];
    });
    const auto child = static_cast<std::uint32_t>(nodes_.size());
    nodes_[job.node].first = child;
    nodes_.resize(nodes_.size() + 2);
    jobs.push_back({child, job.first, half});
    jobs.push_back({child + 1, job.first + half, job.count - half});
  }
  for (const std::uint32_t i : order) corners_.push_back(given[i]);
}

Apart MeshTree::separation(const Core& core, const Pose& core_T_mesh, double interest) const {
  const Box box = box_of(core, inverse(core_T_mesh));
  Apart best;
  best.state = Apart::State::beyond;
  best.distance = interest;
  Core triangle;
  triangle.kind = Core::Kind::triangle;
  struct Open {
    double gap;
    std::uint32_t node;
  };
  std::vector<Open> open{{gap(nodes_[0].box, box), 0}};
  while (!open.empty()) {
    const Open next = open.back();
    open.pop_back();
    if (next.gap > best.distance) continue;
    const Node& node = nodes_[next.node];
    if (node.count == 0) {
      Open a{gap(nodes_[node.first].box, box), node.first};
      Open b{gap(nodes_[node.first + 1].box, box), node.first + 1};
      if (a.gap < b.gap) std::swap(a, b);
      open.push_back(a);
      open.push_back(b);  // the nearer one first
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      triangle.corners = corners_[i];
      const Apart at = collision_fcl::separation(core, triangle, core_T_mesh, best.distance);
      if (at.state == Apart::State::overlap ||
          (at.state == Apart::State::apart && at.distance <= 0)) {
        best = at;
        best.state = Apart::State::overlap;
        return best;
      }
      if (at.state == Apart::State::apart && at.distance <= best.distance) best = at;
    }
  }
  return best;
}

}  // namespace robomosp::collision_fcl
