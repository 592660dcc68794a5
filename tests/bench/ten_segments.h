// SPDX-License-Identifier: Apache-2.0
// A trajectory of ten segments of mixed curves, laws and orientations, for benchmarks.
#pragma once

#include <utility>
#include <vector>

#include "model/records.h"

namespace robomosp::bench {

/// Within a box of about 0.5 x 1.8 x 0.2 m times `size`. Each segment begins where the one before
/// ends, turned by then; the corners are cut by transitions.
inline model::Trajectory ten_mixed_segments(double size = 1) {
  using model::Placement;
  model::Trajectory t;
  const auto place = [&](double x, double y, double z, double roll, double yaw) {
    return Placement{{size * x, size * y, size * z}, {roll, 0, yaw}, {}};
  };
  const auto add = [&](const char* shape, std::vector<Placement> points, const char* law,
                       const char* orientation) {
    model::TrajectorySegment s;
    s.shape.name = shape;
    s.points = std::move(points);
    s.law.name = law;
    s.orientation.name = orientation;
    t.segments.push_back(std::move(s));
  };
  for (int i = 0; i < 2; ++i) {
    const double y = 0.9 * i, a = 0.4 * i;
    add("line", {place(0, y, 0, 0, a), place(0.4, y, 0.1, 0.3, a)}, "trapezoidal", "slerp");
    add("arc",
        {place(0.4, y, 0.1, 0.3, a), place(0.5, y + 0.1, 0.1, 0.4, a),
         place(0.4, y + 0.2, 0.1, 0.3, a)},
        "constant_speed", "squad");
    add("cubic_spline",
        {place(0.4, y + 0.2, 0.1, 0.3, a), place(0.3, y + 0.3, 0.2, 0.3, a),
         place(0.1, y + 0.3, 0.1, 0, a + 0.2), place(0, y + 0.5, 0, 0, a + 0.3)},
        "s_curve", "squad");
    add("b_spline",
        {place(0, y + 0.5, 0, 0, a + 0.3), place(0.1, y + 0.6, 0, 0, a + 0.3),
         place(0.2, y + 0.5, 0.1, 0, a + 0.3), place(0.3, y + 0.6, 0.1, 0, a + 0.4),
         place(0.4, y + 0.6, 0, 0, a + 0.4)},
        "quintic", "slerp_points");
    add("line", {place(0.4, y + 0.6, 0, 0, a + 0.4), place(0, y + 0.9, 0, 0, a + 0.4)}, "s_curve",
        "slerp");
  }
  return t;
}

}  // namespace robomosp::bench
