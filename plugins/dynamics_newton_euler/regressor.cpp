// SPDX-License-Identifier: Apache-2.0
// The force on a body is linear in its ten parameters (Atkeson, An, Hollerbach, Estimation of
// Inertial Parameters of Manipulator Loads and Links, IJRR 1986): f = A(v, a) pi.
#include <algorithm>

#include "further.h"

namespace robomosp::newton_euler {
namespace {

using namespace spatial;

constexpr std::size_t kParameters = 10;

/// A body of parameter p alone: m, m x, m y, m z, then Ixx Iyy Izz Ixy Iyz Ixz.
RigidInertia unit_inertia(std::size_t p) {
  RigidInertia i;
  double* const at[] = {&i.mass,      &i.first[0],  &i.first[1],  &i.first[2],  &i.second.xx,
                        &i.second.yy, &i.second.zz, &i.second.xy, &i.second.yz, &i.second.xz};
  *at[p] = 1;
  return i;
}

void add_sample(const BodyTree& tree, const TreeState& state, double sign, const TreeScratch& s,
                std::span<double> y) {
  const std::size_t width = kParameters * tree.bodies.size();
  sweep(tree, state, s.bodies, s.columns);
  for (std::size_t i = 0; i < tree.bodies.size(); ++i) {
    const MovingBody& m = s.bodies[i];
    const Screw v = motion_into(m.pose, m.velocity), a = motion_into(m.pose, m.acceleration);
    for (std::size_t p = 0; p < kParameters; ++p) {
      const RigidInertia unit = unit_inertia(p);
      const Screw f = force_out(m.pose, add(multiply(unit, a), cross_force(v, multiply(unit, v))));
      for (auto up = static_cast<std::int32_t>(i); up >= 0;
           up = tree.bodies[static_cast<std::size_t>(up)].parent) {
        const TreeBody& b = tree.bodies[static_cast<std::size_t>(up)];
        for (std::int32_t k = 0; k < b.columns; ++k)
          y[static_cast<std::size_t>(b.v_index + k) * width + kParameters * i + p] +=
              sign * dot(s.columns[static_cast<std::size_t>(b.column + k)], f);
      }
    }
  }
}

}  // namespace

Result<void> regressor(const BodyTree& tree, const DynamicsBatch& batch, std::span<double> y,
                       Progress& progress) {
  const std::size_t size = tree.velocities * kParameters * tree.bodies.size();
  RMP_TRY(check_batch(tree, batch, tree_scratch(tree), y.size(), size));
  const TreeScratch s = take_scratch(tree, batch.scratch.data());
  std::fill(y.begin(), y.end(), 0.0);
  for (std::size_t i = 0; i < batch.count; ++i) {
    if (progress.cancelled())
      return error(ErrorCode::cancelled, "the dynamics computation was cancelled");
    const std::span<double> out = y.subspan(i * size, size);
    TreeState state = state_of(tree, batch, i, batch.terms, false);
    // A turning base belongs to the inertial term; see tree_torques().
    if (!(batch.terms & kInertialTerm)) {
      TreeState still;
      still.q = state.q;
      std::swap(still.base_velocity, state.base_velocity);
      if (batch.terms & kVelocityTerm) {
        state.base_velocity = still.base_velocity;
        add_sample(tree, still, -1, s, out);
      }
    }
    add_sample(tree, state, 1, s, out);
  }
  return {};
}

}  // namespace robomosp::newton_euler
