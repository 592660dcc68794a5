// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/shape.h"
#include "spatial/pose.h"

namespace robomosp::scene {
namespace {

void include_point(Bounds& box, const Vec3& at) {
  for (std::size_t i = 0; i < 3; ++i) {
    box[0][i] = std::min(box[0][i], at[i]);
    box[1][i] = std::max(box[1][i], at[i]);
  }
}

}  // namespace

Bounds empty_box() {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  return {{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}}};
}

void grow(Bounds& box, const Bounds& other) {
  for (std::size_t i = 0; i < 3; ++i) {
    box[0][i] = std::min(box[0][i], other[0][i]);
    box[1][i] = std::max(box[1][i], other[1][i]);
  }
}

Bounds moved(const Bounds& box, const Pose& pose) {
  Bounds out = empty_box();
  if (box[0][0] > box[1][0]) return out;
  for (unsigned corner = 0; corner < 8; ++corner)
    include_point(out, spatial::transform(pose, {box[corner & 1U][0], box[(corner >> 1U) & 1U][1],
                                                 box[(corner >> 2U) & 1U][2]}));
  return out;
}

double diagonal(const Bounds& box) {
  const double d = std::hypot(box[1][0] - box[0][0], box[1][1] - box[0][1], box[1][2] - box[0][2]);
  return box[0][0] <= box[1][0] && std::isfinite(d) ? d : 0.0;
}

Bounds box_of(const Mesh& mesh, const Pose& pose) {
  Bounds box = empty_box();
  const auto& p = mesh.positions;
  for (std::size_t v = 0; v + 2 < p.size(); v += 3)
    include_point(
        box, spatial::transform(pose, {static_cast<double>(p[v]), static_cast<double>(p[v + 1]),
                                       static_cast<double>(p[v + 2])}));
  return box;
}

}  // namespace robomosp::scene
