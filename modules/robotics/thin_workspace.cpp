// SPDX-License-Identifier: Apache-2.0
#include "robotics/thin_workspace.h"

#include <algorithm>
#include <cmath>

#include "spatial/vec.h"

namespace robomosp::robotics {
namespace {

/// Relative to the fastest column: below, a column is rounding.
constexpr double kUnmovedTip = 1e-7;

Vec3 linear_column(std::span<const double> jacobian, std::size_t column) {
  return {jacobian[6 * column], jacobian[6 * column + 1], jacobian[6 * column + 2]};
}

}  // namespace

TipMobility tip_mobility(std::span<const double> jacobians, std::size_t velocities) {
  TipMobility m;
  const std::size_t count = velocities ? jacobians.size() / (6 * velocities) : 0;
  std::vector<double> longest(velocities, 0.0);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < velocities; ++j)
      longest[j] = std::max(longest[j],
                            spatial::norm(linear_column(jacobians.subspan(6 * velocities * i), j)));
  for (const double l : longest) m.fastest = std::max(m.fastest, l);
  std::size_t moving = 0;
  for (std::size_t j = 0; j < velocities; ++j)
    if (longest[j] > kUnmovedTip * m.fastest) {
      ++moving;
      m.only = static_cast<std::ptrdiff_t>(j);
    }
  if (moving != 1) m.only = -1;
  return m;
}

WorkspaceSize curve_length(std::span<CurvePoint> points, double gap) {
  WorkspaceSize s;
  std::sort(points.begin(), points.end(),
            [](const CurvePoint& a, const CurvePoint& b) { return a.q < b.q; });
  double widest = 0, fastest = 0;
  std::size_t runs = points.empty() ? 0 : 1;
  for (std::size_t i = 0; i < points.size(); ++i) {
    fastest = std::max(fastest, points[i].speed);
    if (i == 0) continue;
    const double step = points[i].q - points[i - 1].q;
    if (step >= gap) {
      ++runs;
      continue;
    }
    widest = std::max(widest, step);
    s.size += 0.5 * (points[i].speed + points[i - 1].speed) * step;
  }
  s.error = (static_cast<double>(2 * runs) * widest) * fastest + 1e-12 * s.size;
  return s;
}

}  // namespace robomosp::robotics
