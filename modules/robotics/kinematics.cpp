// SPDX-License-Identifier: Apache-2.0
#include "robotics/kinematics.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/LU>

#include "robotics/kinematics_kernels.h"
#include "spatial/pose.h"

namespace robomosp::robotics {
namespace {}  // namespace

void forward_kinematics(const RobotModel& model, std::span<const double> q,
                        std::span<Pose> joint_frames) {
  // One configuration alone gains nothing from wider vectors.
  static const kernels::Table& kernel = kernels::table(spatial::InstructionSet::avx2);
  const std::size_t n = model.joints.size(), coordinates = model.coordinate_count();
  const std::size_t samples = n > 0 ? joint_frames.size() / n : 0;
  for (std::size_t i = 0; i < samples; ++i)
    kernel.frames(model.joints.data(), n, q.data() + i * coordinates, joint_frames[i * n].R.data());
}

Pose tip_pose(const RobotModel& model, std::size_t tip, std::span<const Pose> joint_frames) {
  return carried(model.tips[tip].joint, model.tips[tip].tool, joint_frames);
}

void link_poses(std::span<const LinkFrame> links, std::span<const Pose> joint_frames,
                std::span<Pose> base_T_link) {
  for (std::size_t i = 0; i < links.size(); ++i)
    base_T_link[i] = carried(links[i].joint, links[i].joint_T_link, joint_frames);
}

void geometric_jacobian(const RobotModel& model, std::size_t tip,
                        std::span<const Pose> joint_frames, JacobianFrame frame,
                        std::span<double> jacobian) {
  std::fill(jacobian.begin(), jacobian.end(), 0.0);
  const Pose at = tip_pose(model, tip, joint_frames);
  const auto expressed = [&](const Vec3& v) {
    switch (frame) {
      case JacobianFrame::world: return spatial::rotate(model.base, v);
      case JacobianFrame::tip: return spatial::rotate_back(at, v);
      case JacobianFrame::base: break;
    }
    return v;
  };
  for (std::int32_t j = model.tips[tip].joint; j >= 0;
       j = model.joints[static_cast<std::size_t>(j)].parent) {
    const JointModel& joint = model.joints[static_cast<std::size_t>(j)];
    const Pose& own = joint_frames[static_cast<std::size_t>(j)];
    const double ratio = joint.is_coupled() ? joint.coupling.ratio : 1.0;
    double* column = jacobian.data() + 6 * joint.v_index;
    // Coupled joints add to the column of the joint they follow.
    const auto add = [&](const Vec3& v, std::size_t row) {
      for (std::size_t k = 0; k < 3; ++k) column[row + k] += ratio * v[k];
    };
    const auto slide = [&](std::size_t k) { add(expressed(spatial::axis(own, k)), 0); };
    const auto turn = [&](std::size_t k) {
      const Vec3 z = spatial::axis(own, k);
      add(expressed(spatial::cross(z, spatial::sub(at.p, own.p))), 0);
      add(expressed(z), 3);
    };
    if (joint.type == JointType::revolute) turn(2);
    if (joint.type == JointType::prismatic) slide(2);
    if (joint.type == JointType::free)
      for (std::size_t k = 0; k < 3; ++k, column += 6) slide(k);
    if (joint.type == JointType::spherical || joint.type == JointType::free)
      for (std::size_t k = 0; k < 3; ++k, column += 6) turn(k);
  }
}

double manipulability(std::span<const double> jacobian) {
  const auto n = static_cast<Eigen::Index>(jacobian.size() / 6);
  const Eigen::Map<const Eigen::Matrix<double, 6, Eigen::Dynamic>> J(jacobian.data(), 6, n);
  if (n >= 6) {
    const Eigen::Matrix<double, 6, 6> g = J * J.transpose();
    return std::sqrt(std::max(0.0, g.determinant()));
  }
  // At most 5 x 5, so that nothing is allocated.
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 5, 5> g = J.transpose() * J;
  return n == 0 ? 0.0 : std::sqrt(std::max(0.0, g.determinant()));
}

}  // namespace robomosp::robotics
