// SPDX-License-Identifier: Apache-2.0
#include "sim/recording_columns.h"

#include <algorithm>
#include <cmath>

namespace robomosp::sim {
namespace {

Column* column(Recording& r, const std::string& stem, std::size_t entry) {
  const std::string name = stem + std::to_string(entry + 1);
  const auto at = std::find_if(r.columns.begin(), r.columns.end(),
                               [&](const Column& c) { return c.name == name; });
  return at == r.columns.end() ? nullptr : &*at;
}

}  // namespace

void mark_limits(Recording& recording, const RobotModel& model) {
  const auto mark = [&](const std::string& stem, std::int32_t entry, double lower, double upper) {
    if (Column* c = column(recording, stem, static_cast<std::size_t>(entry))) {
      c->lower = lower;
      c->upper = upper;
    }
  };
  for (const JointModel& joint : model.joints) {
    if (joint.is_coupled() || coordinate_count(joint.type) != 1) continue;
    mark("q", joint.q_index, joint.lower, joint.upper);
    mark("qd", joint.v_index, -joint.max_velocity, joint.max_velocity);
    mark("qdd", joint.v_index, -joint.max_acceleration, joint.max_acceleration);
    mark("qddd", joint.v_index, -joint.max_jerk, joint.max_jerk);
    mark("tau", joint.v_index, -joint.max_force, joint.max_force);
  }
}

}  // namespace robomosp::sim
