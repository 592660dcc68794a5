// SPDX-License-Identifier: Apache-2.0
#include "robotics/twist.h"

#include <algorithm>

#include "spatial/pose.h"

namespace robomosp::robotics {
namespace {

using spatial::add;
using spatial::axis;
using spatial::cross;
using spatial::scale;
using spatial::sub;

Vec3 three(std::span<const double> of, std::int32_t first) {
  if (of.empty()) return {};
  const auto k = static_cast<std::size_t>(first);
  return {of[k], of[k + 1], of[k + 2]};
}
double ratio(const JointModel& j) { return j.is_coupled() ? j.coupling.ratio : 1.0; }
double scalar(const JointModel& j, std::span<const double> of) {
  return of.empty() ? 0.0 : ratio(j) * of[static_cast<std::size_t>(j.v_index)];
}

/// Calls `slide(column, frame, axis)` and `turn(column, frame, axis)` for each velocity on the way
/// from the base to `joint`; column in entries of qd, with the factor of followers.
template <class Slide, class Turn>
void each_column(const RobotModel& model, std::int32_t joint, Slide&& slide, Turn&& turn) {
  for (std::int32_t i = joint; i >= 0; i = model.joints[static_cast<std::size_t>(i)].parent) {
    const JointModel& j = model.joints[static_cast<std::size_t>(i)];
    const auto at = static_cast<std::size_t>(i);
    auto column = static_cast<std::size_t>(j.v_index);
    if (j.type == JointType::revolute) turn(column, at, std::size_t{2}, ratio(j));
    if (j.type == JointType::prismatic) slide(column, at, std::size_t{2}, ratio(j));
    if (j.type == JointType::free)
      for (std::size_t k = 0; k < 3; ++k) slide(column++, at, k, 1.0);
    if (j.type == JointType::spherical || j.type == JointType::free)
      for (std::size_t k = 0; k < 3; ++k) turn(column++, at, k, 1.0);
  }
}

void add_to(std::span<double> columns, std::size_t column, std::size_t row, const Vec3& v,
            double factor) {
  for (std::size_t k = 0; k < 3; ++k) columns[6 * column + row + k] += factor * v[k];
}

}  // namespace

void joint_motions(const RobotModel& model, std::span<const Pose> joint_frames,
                   std::span<const double> qd, std::span<const double> qdd,
                   std::span<FrameMotion> motions) {
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const JointModel& j = model.joints[i];
    const Pose& own = joint_frames[i];
    FrameMotion m;
    // What the joint adds: velocity u and turning w relative to the parent, with their rates.
    Vec3 u{}, ud{}, w{}, wd{};
    switch (j.type) {
      case JointType::revolute:
        w = scale(axis(own, 2), scalar(j, qd)), wd = scale(axis(own, 2), scalar(j, qdd));
        break;
      case JointType::prismatic:
        u = scale(axis(own, 2), scalar(j, qd)), ud = scale(axis(own, 2), scalar(j, qdd));
        break;
      case JointType::spherical:
        w = spatial::rotate(own, three(qd, j.v_index));
        wd = spatial::rotate(own, three(qdd, j.v_index));
        break;
      case JointType::free:
        u = spatial::rotate(own, three(qd, j.v_index));
        w = spatial::rotate(own, three(qd, j.v_index + 3));
        // The linear velocity is in axes that turn with the joint.
        ud = add(spatial::rotate(own, three(qdd, j.v_index)), cross(w, u));
        wd = spatial::rotate(own, three(qdd, j.v_index + 3));
        break;
    }
    if (j.parent < 0) {
      m = {u, w, ud, wd};
    } else {
      const auto p = static_cast<std::size_t>(j.parent);
      const FrameMotion& up = motions[p];
      const Vec3 r = sub(own.p, joint_frames[p].p);
      const Vec3 wr = cross(up.w, r);
      m.v = add(add(up.v, wr), u);
      m.w = add(up.w, w);
      m.a = add(add(add(up.a, cross(up.alpha, r)), cross(up.w, wr)),
                add(scale(cross(up.w, u), 2), ud));
      m.alpha = add(add(up.alpha, wd), cross(up.w, w));
    }
    motions[i] = m;
  }
}

FrameMotion carried_motion(std::int32_t joint, const Vec3& place,
                           std::span<const Pose> joint_frames,
                           std::span<const FrameMotion> motions) {
  if (joint < 0) return {};
  FrameMotion m = motions[static_cast<std::size_t>(joint)];
  const Vec3 r = sub(place, joint_frames[static_cast<std::size_t>(joint)].p);
  const Vec3 wr = cross(m.w, r);
  m.v = add(m.v, wr);
  m.a = add(m.a, add(cross(m.alpha, r), cross(m.w, wr)));
  return m;
}

void point_jacobian(const RobotModel& model, std::int32_t joint, const Vec3& place,
                    std::span<const Pose> joint_frames, std::span<double> jacobian) {
  std::fill(jacobian.begin(), jacobian.end(), 0.0);
  each_column(
      model, joint,
      [&](std::size_t column, std::size_t i, std::size_t k, double f) {
        add_to(jacobian, column, 0, axis(joint_frames[i], k), f);
      },
      [&](std::size_t column, std::size_t i, std::size_t k, double f) {
        const Vec3 z = axis(joint_frames[i], k);
        add_to(jacobian, column, 0, cross(z, sub(place, joint_frames[i].p)), f);
        add_to(jacobian, column, 3, z, f);
      });
}

void point_jacobian_rate(const RobotModel& model, std::int32_t joint, const Vec3& place,
                         std::span<const Pose> joint_frames, std::span<const FrameMotion> motions,
                         std::span<double> rate) {
  std::fill(rate.begin(), rate.end(), 0.0);
  const FrameMotion point = carried_motion(joint, place, joint_frames, motions);
  each_column(
      model, joint,
      [&](std::size_t column, std::size_t i, std::size_t k, double f) {
        add_to(rate, column, 0, cross(motions[i].w, axis(joint_frames[i], k)), f);
      },
      [&](std::size_t column, std::size_t i, std::size_t k, double f) {
        const Vec3 z = axis(joint_frames[i], k), zd = cross(motions[i].w, z);
        add_to(rate, column, 0,
               add(cross(zd, sub(place, joint_frames[i].p)), cross(z, sub(point.v, motions[i].v))),
               f);
        add_to(rate, column, 3, zd, f);
      });
}

void express_columns(const Pose& axes_T_base, std::span<double> columns) {
  for (std::size_t i = 0; i + 2 < columns.size(); i += 3) {
    const Vec3 v = spatial::rotate(axes_T_base, Vec3{columns[i], columns[i + 1], columns[i + 2]});
    std::copy(v.begin(), v.end(), columns.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

}  // namespace robomosp::robotics
