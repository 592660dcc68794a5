// SPDX-License-Identifier: Apache-2.0
// What resists at a joint, viscous and Coulomb friction, springs and motor inertia, for numbers T:
// one sample (double) or one a lane; for sources of robomosp_lanes(). Trees with other joints have
// it in body_tree.cpp; joints that stick and slip are sim/mechanism_motion.cpp's (layer: data
// processing, spatial).
#pragma once

#include "spatial/recursion_scratch.h"
#include "spatial/rest.h"

namespace robomosp::spatial::recursions::RMP_LANES {

// Adds the chosen terms to tau. Friction of a joint that rests is none.
template <class T>
void add_resistance(const Mechanism& m, std::uint32_t terms, const T* q, const T* qd, const T* qdd,
                    T* tau) {
  for (std::size_t j = 0; j < m.count; ++j) {
    const Body& b = m.bodies[j];
    if (!b.resists) continue;
    const spatial::JointConstants& k = b.joint;
    T force{};
    if (terms & kInertialTerm) force += qdd[k.v_index] * (k.ratio * b.armature);
    if (terms & kFrictionTerm) {
      const T rate = qd[k.v_index] * k.ratio, none{};
      force += rate * b.viscous;
      force += select(rate > spatial::kRestSpeed, splat<T>(b.coulomb_positive), none);
      force += select(rate < -spatial::kRestSpeed, splat<T>(b.coulomb_negative), none);
    }
    if (terms & kSpringTerm) force += (q[k.q_index] * k.ratio + (k.offset - b.rest)) * b.stiffness;
    tau[k.v_index] += force * k.ratio;
  }
}

}  // namespace robomosp::spatial::recursions::RMP_LANES
