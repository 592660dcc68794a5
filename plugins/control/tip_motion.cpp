// SPDX-License-Identifier: Apache-2.0
#include "tip_motion.h"

#include <algorithm>

#include "spatial/pose.h"

namespace robomosp::control {
namespace {

using namespace spatial;

/// A joint's frame and its motion, all in the base's axes.
struct Moving {
  Pose frame;
  Vec3 v{}, w{}, a{}, wd{};  // of its origin; accelerations with all qdd at 0
};
static_assert(sizeof(Moving) % sizeof(double) == 0 && alignof(Moving) == alignof(double));

void add_column(std::span<double> jacobian, std::int32_t index, double ratio, const Vec3& linear,
                const Vec3& angular) {
  double* out = &jacobian[6 * static_cast<std::size_t>(index)];
  for (std::size_t k = 0; k < 3; ++k) {
    out[k] += ratio * linear[k];
    out[3 + k] += ratio * angular[k];
  }
}

}  // namespace

std::size_t tip_motion_scratch(const RobotModel& model) {
  return model.joints.size() * (sizeof(Moving) / sizeof(double));
}

TipMotion tip_motion(const RobotModel& model, std::span<const double> q, std::span<const double> qd,
                     std::span<double> jacobian, std::span<double> scratch) {
  Moving* moving = reinterpret_cast<Moving*>(scratch.data());
  const Moving ground;
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const JointModel& joint = model.joints[i];
    const Moving& up = joint.parent < 0 ? ground : moving[joint.parent];
    Moving m;
    m.frame = compose(up.frame, joint_pose(joint, q.data()));
    const Vec3 r = sub(m.frame.p, up.frame.p);
    m.w = up.w;
    m.wd = up.wd;
    m.v = add(up.v, cross(up.w, r));
    m.a = add(up.a, add(cross(up.wd, r), cross(up.w, cross(up.w, r))));
    const double* rate = &qd[static_cast<std::size_t>(joint.v_index)];
    const double ratio = joint.is_coupled() ? joint.coupling.ratio : 1;
    if (joint.type == JointType::prismatic) {
      const Vec3 u = scale(axis(m.frame, 2), ratio * rate[0]);
      m.v = add(m.v, u);
      m.a = add(m.a, scale(cross(up.w, u), 2));
    } else if (joint.type == JointType::revolute) {
      const Vec3 u = scale(axis(m.frame, 2), ratio * rate[0]);
      m.w = add(m.w, u);
      m.wd = add(m.wd, cross(up.w, u));
    } else {
      // Velocities are given in the moving frame, so with qdd = 0 they turn with it.
      if (joint.type == JointType::free) {
        const Vec3 u = rotate(m.frame, Vec3{rate[0], rate[1], rate[2]});
        rate += 3;
        const Vec3 w = add(up.w, rotate(m.frame, Vec3{rate[0], rate[1], rate[2]}));
        m.v = add(m.v, u);
        m.a = add(m.a, add(cross(up.w, u), cross(w, u)));
      }
      const Vec3 u = rotate(m.frame, Vec3{rate[0], rate[1], rate[2]});
      m.w = add(m.w, u);
      m.wd = add(m.wd, cross(up.w, u));
    }
    moving[i] = m;
  }
  TipMotion out;
  std::fill(jacobian.begin(), jacobian.end(), 0.0);
  const TipModel& tip = model.tips.front();
  const Moving& last = tip.joint < 0 ? ground : moving[tip.joint];
  out.pose = compose(last.frame, tip.tool);
  for (std::int32_t i = tip.joint; i >= 0; i = model.joints[static_cast<std::size_t>(i)].parent) {
    const JointModel& joint = model.joints[static_cast<std::size_t>(i)];
    const Pose& frame = moving[i].frame;
    const Vec3 r = sub(out.pose.p, frame.p);
    const double ratio = joint.is_coupled() ? joint.coupling.ratio : 1;
    if (joint.type == JointType::prismatic) {
      add_column(jacobian, joint.v_index, ratio, axis(frame, 2), {});
    } else if (joint.type == JointType::revolute) {
      add_column(jacobian, joint.v_index, ratio, cross(axis(frame, 2), r), axis(frame, 2));
    } else {
      std::int32_t index = joint.v_index;
      if (joint.type == JointType::free)
        for (std::size_t k = 0; k < 3; ++k) add_column(jacobian, index++, 1, axis(frame, k), {});
      for (std::size_t k = 0; k < 3; ++k)
        add_column(jacobian, index++, 1, cross(axis(frame, k), r), axis(frame, k));
    }
  }
  const Vec3 r = sub(out.pose.p, last.frame.p);
  const Vec3 v = add(last.v, cross(last.w, r));
  const Vec3 a = add(last.a, add(cross(last.wd, r), cross(last.w, cross(last.w, r))));
  for (std::size_t k = 0; k < 3; ++k) {
    out.velocity[k] = v[k], out.velocity[3 + k] = last.w[k];
    out.bias[k] = a[k], out.bias[3 + k] = last.wd[k];
  }
  return out;
}

}  // namespace robomosp::control
