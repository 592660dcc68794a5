// SPDX-License-Identifier: Apache-2.0
#include "further.h"

namespace robomosp::newton_euler {
namespace {

using namespace spatial;

constexpr std::size_t kSamplesPerLook = 64;  // between two looks at Progress

Energy energy_of(const BodyTree& tree, const DynamicsBatch& batch, std::size_t sample) {
  const TreeScratch s = take_scratch(tree, batch.scratch.data());
  TreeState state;
  state.q = batch.q.data() + sample * tree.coordinates;
  if (!batch.qd.empty()) state.qd = batch.qd.data() + sample * tree.velocities;
  Vec3 gravity = tree.gravity;
  if (!batch.base.empty()) {
    const BaseMotion& base = batch.base[batch.base.size() == 1 ? 0 : sample];
    gravity = base.gravity;
    state.base_velocity.angular = base.angular_velocity;
  }
  sweep(tree, state, s.bodies, s.columns);
  Energy e;
  double mass = 0;
  Vec3 first{};
  for (std::size_t i = 0; i < tree.bodies.size(); ++i) {
    const TreeBody& b = tree.bodies[i];
    const MovingBody& m = s.bodies[i];
    const Screw momentum = multiply(m.inertia, m.velocity);
    e.kinetic += 0.5 * dot(momentum, m.velocity);
    e.momentum = add(e.momentum, momentum.linear);
    e.angular_momentum = add(e.angular_momentum, momentum.angular);
    mass += m.inertia.mass;
    first = add(first, m.inertia.first);
    if (b.columns != 1) continue;
    if (state.qd) {
      const double rate = b.ratio * state.qd[b.v_index];
      e.kinetic += 0.5 * b.armature * rate * rate;
    }
    const double stretch = b.ratio * state.q[b.q_index] + b.offset - b.spring.rest;
    if (b.spring.stiffness != 0) e.potential += 0.5 * b.spring.stiffness * stretch * stretch;
  }
  e.potential -= dot(gravity, first);
  if (mass != 0) e.com = scale(first, 1 / mass);
  return e;
}

}  // namespace

std::size_t further_scratch(const BodyTree& tree) { return tree_scratch(tree); }

Result<void> energy(const BodyTree& tree, const DynamicsBatch& batch, std::span<Energy> out,
                    Progress& progress) {
  RMP_TRY(check_batch(tree, batch, tree_scratch(tree), out.size(), 1));
  for (std::size_t i = 0; i < batch.count; ++i) {
    if (i % kSamplesPerLook == 0 && progress.cancelled())
      return error(ErrorCode::cancelled, "the dynamics computation was cancelled");
    out[i] = energy_of(tree, batch, i);
  }
  return {};
}

}  // namespace robomosp::newton_euler
