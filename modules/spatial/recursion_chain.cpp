// SPDX-License-Identifier: Apache-2.0
#include "spatial/recursion_chain.h"

#include <algorithm>
#include <cmath>

#include "spatial/body_tree.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::spatial::recursions {
void Chain::add_body(const JointModel& joint) {
  Body b{};
  b.joint = spatial::joint_constants(joint);
  b.column = mechanism_.columns;
  mechanism_.columns += static_cast<std::size_t>(velocity_count(joint.type));
  b.mass = b.carried = joint.body.mass;
  const Vec3 first = spatial::scale(joint.body.com, joint.body.mass);
  std::copy(first.begin(), first.end(), b.first);
  const Sym3 I = spatial::inertia_about(joint.body, Vec3{});
  const double half = (I.xx + I.yy + I.zz) / 2;
  const double inertia[6] = {I.xx, I.yy, I.zz, I.xy, I.yz, I.xz};
  const double second[6] = {half - I.xx, half - I.yy, half - I.zz, -I.xy, -I.yz, -I.xz};
  std::copy_n(inertia, 6, b.inertia);
  std::copy_n(second, 6, b.second);
  if (velocity_count(joint.type) == 1) {
    b.armature = joint.armature;
    b.viscous = joint.friction.viscous;
    b.coulomb_positive = joint.friction.coulomb_positive;
    b.coulomb_negative = joint.friction.coulomb_negative;
    b.stiffness = joint.spring.stiffness;
    b.rest = joint.spring.rest;
  }
  b.resists = b.armature != 0 || b.viscous != 0 || b.coulomb_positive != 0 ||
              b.coulomb_negative != 0 || b.stiffness != 0;
  mechanism_.resists = mechanism_.resists || b.resists;
  mechanism_.coupled = mechanism_.coupled || joint.is_coupled();
  bodies_.push_back(b);
}

void Chain::add_entries(const JointModel& joint, std::size_t index) {
  if (joint.is_coupled()) return;
  const auto first = static_cast<std::size_t>(joint.v_index);
  for (std::int32_t k = 0; k < velocity_count(joint.type); ++k) {
    entry_parent_[first + static_cast<std::size_t>(k)] = joint.v_index + k - 1;
    joint_of_[first + static_cast<std::size_t>(k)] = index;
  }
  entry_parent_[first] = -1;
  if (joint.parent >= 0) {
    const spatial::JointConstants& up = bodies_[static_cast<std::size_t>(joint.parent)].joint;
    entry_parent_[first] = up.v_index + up.velocity_count - 1;
  }
}

void Chain::add_tips(const RobotModel& model) {
  std::vector<std::size_t> starts;
  for (const TipModel& tip : model.tips) {
    starts.push_back(paths_.size());
    TipPath path{nullptr, 0, {tip.tool.p[0], tip.tool.p[1], tip.tool.p[2]}};
    for (std::int32_t j = tip.joint; j >= 0; j = model.joints[static_cast<std::size_t>(j)].parent) {
      paths_.push_back(j);
      ++path.count;
    }
    std::reverse(paths_.begin() + static_cast<std::ptrdiff_t>(starts.back()), paths_.end());
    tips_.push_back(path);
  }
  for (std::size_t i = 0; i < tips_.size(); ++i) tips_[i].joints = paths_.data() + starts[i];
}

/// Bounds of the inertia about each joint, of the bodies stretched out beyond it: sums of mass,
/// first and second moments, moved by the distances between the joints.
void Chain::find_least_inertias() {
  struct Reach {
    double mass = 0, first = 0, second = 0;
  };
  std::vector<Reach> reach(bodies_.size());
  least_inertia_.assign(mechanism_.velocities, 0.0);
  for (std::size_t i = bodies_.size(); i-- > 0;) {
    const Body& b = bodies_[i];
    Reach& r = reach[i];
    r.mass += std::fabs(b.mass);
    r.first += std::hypot(b.first[0], b.first[1], b.first[2]);
    r.second += std::fabs(b.second[0]) + std::fabs(b.second[1]) + std::fabs(b.second[2]);
    const double ratio = b.joint.ratio * b.joint.ratio;
    for (std::int32_t k = 0; k < b.joint.velocity_count; ++k) {
      const bool slides =
          b.joint.type == JointType::prismatic || (b.joint.type == JointType::free && k < 3);
      least_inertia_[static_cast<std::size_t>(b.joint.v_index + k)] +=
          kCarried * ratio * ((slides ? r.mass : r.second) + std::fabs(b.armature));
    }
    if (b.joint.parent < 0) continue;
    Reach& up = reach[static_cast<std::size_t>(b.joint.parent)];
    const double l = std::hypot(b.joint.p[0], b.joint.p[1], b.joint.p[2]);
    up.mass += r.mass;
    up.first += r.first + r.mass * l;
    up.second += r.second + 2 * l * r.first + r.mass * l * l;
  }
}

Result<Chain> Chain::make(const RobotModel& model) {
  RMP_TRY(check_mechanism(model));
  Chain chain;
  chain.robot_ = model.name;
  Mechanism& m = chain.mechanism_;
  m.coordinates = model.coordinate_count();
  m.velocities = model.dof();
  chain.entry_parent_.assign(m.velocities, -1);
  chain.joint_of_.assign(m.velocities, 0);
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    chain.add_body(model.joints[i]);
    chain.add_entries(model.joints[i], i);
  }
  for (std::size_t i = chain.bodies_.size(); i-- > 0;)
    if (const std::int32_t up = chain.bodies_[i].joint.parent; up >= 0)
      chain.bodies_[static_cast<std::size_t>(up)].carried += chain.bodies_[i].carried;
  chain.add_tips(model);
  // A coupled joint ties branches together, so that no element of the inertia is known to be zero.
  m.dense = true;
  m.single_joints = model.is_simple();
  m.simple_chain = m.single_joints && model.is_serial();
  for (std::size_t i = 0; i < chain.bodies_.size(); ++i)
    if (const std::int32_t up = chain.bodies_[i].joint.parent;
        up >= 0 && static_cast<std::size_t>(up) + 1 != i)
      chain.bodies_[static_cast<std::size_t>(up)].branches = true;
  for (std::size_t k = 0; k < m.velocities; ++k) {
    const std::int32_t before = static_cast<std::int32_t>(k) - 1;
    if (m.coupled) chain.entry_parent_[k] = before;
    m.dense = m.dense && chain.entry_parent_[k] == before;
  }
  m.ordered = !m.coupled;
  for (std::size_t i = 0; i < chain.bodies_.size(); ++i) {
    const Body& b = chain.bodies_[i];
    m.ordered = m.ordered && b.joint.parent == static_cast<std::int32_t>(i) - 1 &&
                static_cast<std::size_t>(b.joint.v_index) == b.column;
  }
  std::copy(model.gravity.begin(), model.gravity.end(), m.gravity);
  m.bodies = chain.bodies_.data();
  m.count = chain.bodies_.size();
  chain.find_least_inertias();
  m.entry_parent = chain.entry_parent_.data();
  m.least_inertia = chain.least_inertia_.data();
  m.tips = chain.tips_.data();
  return chain;
}

}  // namespace robomosp::spatial::recursions
