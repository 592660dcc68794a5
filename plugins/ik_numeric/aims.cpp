// SPDX-License-Identifier: Apache-2.0
#include "aims.h"

#include <bit>
#include <cmath>

#include <robomosp/sdk/eigen.h>

#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::ik_numeric {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d skew(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return m;
}

// How the rotation vector r changes with an angular velocity in the outer axes (the inverse left
// Jacobian of SO(3): Barfoot, State Estimation for Robotics, 2017, eq. 7.77).
Matrix3d log_rate(const Vector3d& r) {
  const double t = r.norm();
  const double k =
      t < 1e-4 ? 1.0 / 12 + t * t / 720 : 1 / (t * t) - (1 + std::cos(t)) / (2 * t * std::sin(t));
  const Matrix3d s = skew(r);
  // At the half turn the factor has no bound; any direction downhill will do there.
  return Matrix3d::Identity() - 0.5 * s + std::min(k, 1e3) * s * s;
}

constexpr double kLoopWeight = 4;  // against goals, which must not pull a loop open

}  // namespace

Aims::Aims(const Mechanism& m, std::span<const IkGoal> goals)
    : mechanism_(m), goals_(goals.begin(), goals.end()), frames_(m.model->joints.size()) {
  Eigen::Index rows = 0;
  for (const IkGoal& g : goals_) rows += std::popcount(g.parts & kIkPose);
  for (const LoopModel& l : m.model->loops) rows += std::popcount(l.fixed & kLoopWeld);
  const auto n = static_cast<Eigen::Index>(m.model->dof());
  error_.setZero(rows);
  jacobian_.setZero(rows, n);
  twist_.setZero(6, n);
}

// Rows of a frame `at` that shall be at `wanted`, in the axes of `wanted`; twist_ holds the
// Jacobian of at's motion relative to wanted's.
void Aims::frame_rows(const Pose& at, const Pose& wanted, std::uint32_t parts, double weight,
                      bool jacobian, Eigen::Index& row) {
  const double root = std::sqrt(weight), scale = root / mechanism_.length;
  const Matrix3d W = rotation(wanted);
  const Vector3d d = W.transpose() * (map(at.p) - map(wanted.p));
  double place = 0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (!(parts & (kIkX << k))) continue;
    place += d[k] * d[k];
    error_[row] = -d[k] * scale;
    if (jacobian) jacobian_.row(row) = scale * (W.col(k).transpose() * twist_.topRows<3>());
    ++row;
  }
  miss_.position = std::max(miss_.position, std::sqrt(place));
  const std::uint32_t turns = parts & kIkRotation;
  if (!turns) return;
  const Matrix3d D = W.transpose() * rotation(at);
  Vector3d r;
  Matrix3d rate;
  double angle = 0;
  if (std::popcount(turns) == 2) {
    // Only one axis counts: the shortest turn that brings it home, whatever the spin about it.
    const Eigen::Index k = !(turns & kIkRotX) ? 0 : !(turns & kIkRotY) ? 1 : 2;
    const Vector3d a = D.col(k), u = Vector3d::Unit(k);
    const Vector3d s = u.cross(a);
    const double n = s.norm();
    angle = std::atan2(n, a[k]);
    const double f = n > 1e-9 ? angle / n : 1.0;
    r = f * s;
    if (n <= 1e-9 && a[k] < 0) r[(k + 1) % 3] = angle;
    // Along r the angle changes by the angular velocity about r; across, r turns about u.
    rate.setIdentity();
    if (n > 1e-9) {
      const Vector3d along = s / n, across = u.cross(along);
      const double c = std::max(-1.0, angle * a[k] / n);
      rate = along * along.transpose() + c * across * across.transpose() +
             angle * across * u.transpose();
    }
  } else {
    Pose delta;
    rotation(delta) = D;
    const Vec3 v = spatial::rotation_log(delta.R);
    r = map(v);
    rate = log_rate(r);
    for (Eigen::Index k = 0; k < 3; ++k)
      if (turns & (kIkRotX << k)) angle = std::hypot(angle, r[k]);
  }
  miss_.rotation = std::max(miss_.rotation, angle);
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (!(turns & (kIkRotX << k))) continue;
    error_[row] = -r[k] * root;
    if (jacobian)
      jacobian_.row(row) = root * (rate.row(k) * (W.transpose() * twist_.bottomRows<3>()));
    ++row;
  }
}

void Aims::evaluate(std::span<const Pose> targets, std::span<const double> q, bool jacobian) {
  const RobotModel& model = *mechanism_.model;
  forward(model, q, frames_);
  miss_ = {};
  Eigen::Index row = 0;
  for (std::size_t g = 0; g < goals_.size(); ++g) {
    const TipModel& tip = model.tips[static_cast<std::size_t>(goals_[g].tip)];
    const Pose at = carried(tip.joint, tip.tool, frames_);
    if (jacobian) {
      twist_.setZero();
      add_jacobian(model, tip.joint, at.p, frames_, 1, twist_);
    }
    frame_rows(at, targets[g], goals_[g].parts, goals_[g].weight, jacobian, row);
  }
  for (const LoopModel& l : model.loops) {
    const Pose a = carried(l.joint_a, l.in_a, frames_), b = carried(l.joint_b, l.in_b, frames_);
    if (jacobian) {
      // Motion of b relative to a, at b: a's axes turn with a, whose point under b is b's origin.
      twist_.setZero();
      add_jacobian(model, l.joint_b, b.p, frames_, 1, twist_);
      add_jacobian(model, l.joint_a, b.p, frames_, -1, twist_);
    }
    frame_rows(b, a, l.fixed, kLoopWeight, jacobian, row);
  }
  if (jacobian)
    for (std::size_t i = 0; i < mechanism_.velocities.size(); ++i)
      jacobian_.col(static_cast<Eigen::Index>(i)) *= mechanism_.velocities[i].unit;
}

Eigen::MatrixXd Aims::tip_jacobian(std::size_t goal) const {
  const RobotModel& model = *mechanism_.model;
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, static_cast<Eigen::Index>(model.dof()));
  add_jacobian(model, model.tips[static_cast<std::size_t>(goals_[goal].tip)].joint, tip(goal).p,
               frames_, 1, J);
  return J;
}

Pose Aims::tip(std::size_t goal) const {
  const TipModel& t = mechanism_.model->tips[static_cast<std::size_t>(goals_[goal].tip)];
  return carried(t.joint, t.tool, frames_);
}

}  // namespace robomosp::ik_numeric
