// SPDX-License-Identifier: Apache-2.0
#include "mechanism.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::ik_numeric {
namespace {

double reach(const RobotModel& model, std::size_t tip) {
  double length = spatial::norm(model.tips[tip].tool.p);
  for (std::int32_t j = model.tips[tip].joint; j >= 0;
       j = model.joints[static_cast<std::size_t>(j)].parent) {
    const JointModel& m = model.joints[static_cast<std::size_t>(j)];
    if (m.parent >= 0) length += spatial::norm(m.placement.p);
    const double range = m.upper - m.lower;
    if (m.type == JointType::prismatic && std::isfinite(range)) length += 0.5 * range;
  }
  return length;
}

// The limits of a joint that follows another one, given for the one followed.
void narrow(Velocity& v, const JointModel& follower) {
  const double r = follower.coupling.ratio, o = follower.coupling.offset;
  if (r == 0) return;
  const double a = (follower.lower - o) / r, b = (follower.upper - o) / r;
  v.lower = std::max(v.lower, std::min(a, b));
  v.upper = std::min(v.upper, std::max(a, b));
}

// a := a * exp(w / 2), w in the moving frame.
void turn(double* a, const Vec3& w) {
  const double speed = spatial::norm(w);
  const double s = speed > 1e-300 ? std::sin(speed / 2) / speed : 0.5, c = std::cos(speed / 2);
  const double x = s * w[0], y = s * w[1], z = s * w[2];
  const double r[4] = {
      a[0] * c - a[1] * x - a[2] * y - a[3] * z, a[0] * x + a[1] * c + a[2] * z - a[3] * y,
      a[0] * y - a[1] * z + a[2] * c + a[3] * x, a[0] * z + a[1] * y - a[2] * x + a[3] * c};
  const double n = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3]);
  for (int i = 0; i < 4; ++i) a[i] = r[i] / n;
}

// Where searches may start: the limits, or one turn or length where there is none.
double start_bound(const Velocity& v, bool upper) {
  const double limit = upper ? v.upper : v.lower;
  if (std::isfinite(limit)) return limit;
  const double half = v.turns ? std::numbers::pi : v.unit;
  const double other = upper ? v.lower : v.upper;
  const double centre = std::isfinite(other) ? other + (upper ? half : -half) : 0.0;
  return centre + (upper ? half : -half);
}

double* quaternion_of(const JointModel& j, double* q) {
  return q + j.q_index + (j.type == JointType::free ? 3 : 0);
}

bool has_quaternion(const JointModel& j) {
  return j.type == JointType::spherical || j.type == JointType::free;
}

}  // namespace

Mechanism make_mechanism(const RobotModel& model) {
  Mechanism m;
  m.model = &model;
  m.length = 0;
  for (std::size_t t = 0; t < model.tips.size(); ++t)
    m.length = std::max(m.length, reach(model, t));
  if (!(m.length > 1e-9)) m.length = 1;
  m.velocities.resize(model.dof());
  constexpr double kNone = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const JointModel& j = model.joints[i];
    if (j.is_coupled()) continue;
    const auto first = static_cast<std::size_t>(j.v_index);
    switch (j.type) {
      case JointType::revolute:
        m.velocities[first] = {i, j.q_index, j.lower, j.upper, 1, true};
        break;
      case JointType::prismatic:
        m.velocities[first] = {i, j.q_index, j.lower, j.upper, m.length, false};
        break;
      case JointType::spherical:
        for (std::size_t k = 0; k < 3; ++k)
          m.velocities[first + k] = {i, -1, -kNone, kNone, 1, true};
        break;
      case JointType::free:
        for (std::size_t k = 0; k < 6; ++k)
          m.velocities[first + k] = {i, -1, -kNone, kNone, k < 3 ? m.length : 1.0, k >= 3};
        break;
    }
  }
  for (const JointModel& j : model.joints)
    if (j.is_coupled()) narrow(m.velocities[static_cast<std::size_t>(j.v_index)], j);
  return m;
}

void advance(const Mechanism& m, std::span<const double> step, bool limits, std::span<double> q) {
  for (std::size_t i = 0; i < m.velocities.size(); ++i) {
    const Velocity& v = m.velocities[i];
    if (v.q < 0) continue;
    double& x = q[static_cast<std::size_t>(v.q)];
    x += step[i];
    if (limits) x = std::min(std::max(x, v.lower), v.upper);
  }
  for (const JointModel& j : m.model->joints) {
    if (!has_quaternion(j)) continue;
    auto s = static_cast<std::size_t>(j.v_index);
    double* a = quaternion_of(j, q.data());
    if (j.type == JointType::free) {
      Pose moved;
      moved.R = spatial::quaternion_rotation(a);
      const Vec3 way = spatial::rotate(moved, {step[s], step[s + 1], step[s + 2]});
      for (std::size_t k = 0; k < 3; ++k) q[static_cast<std::size_t>(j.q_index) + k] += way[k];
      s += 3;
    }
    turn(a, {step[s], step[s + 1], step[s + 2]});
  }
}

std::vector<double> middle_configuration(const Mechanism& m) {
  std::vector<double> q(m.model->coordinate_count(), 0.0);
  for (const Velocity& v : m.velocities)
    if (v.q >= 0 && std::isfinite(v.lower) && std::isfinite(v.upper))
      q[static_cast<std::size_t>(v.q)] = 0.5 * (v.lower + v.upper);
  mend(m, q);
  return q;
}

void random_configuration(const Mechanism& m, Random& random, std::span<double> q) {
  for (const Velocity& v : m.velocities)
    if (v.q >= 0)
      q[static_cast<std::size_t>(v.q)] =
          random.uniform(start_bound(v, false), start_bound(v, true));
  for (const JointModel& j : m.model->joints) {
    if (!has_quaternion(j)) continue;
    if (j.type == JointType::free)
      for (std::size_t k = 0; k < 3; ++k)
        q[static_cast<std::size_t>(j.q_index) + k] = random.uniform(-m.length, m.length);
    // Uniform over rotations (Shoemake, Graphics Gems III, 1992).
    const double u = random.uniform(0, 1), s = random.uniform(0, 2 * std::numbers::pi),
                 t = random.uniform(0, 2 * std::numbers::pi);
    double* a = quaternion_of(j, q.data());
    a[0] = std::sqrt(u) * std::cos(t), a[1] = std::sqrt(1 - u) * std::sin(s);
    a[2] = std::sqrt(1 - u) * std::cos(s), a[3] = std::sqrt(u) * std::sin(t);
  }
}

void mend(const Mechanism& m, std::span<double> q) {
  for (const Velocity& v : m.velocities)
    if (v.q >= 0) {
      double& x = q[static_cast<std::size_t>(v.q)];
      x = std::min(std::max(x, v.lower), v.upper);
    }
  for (const JointModel& j : m.model->joints) {
    if (!has_quaternion(j)) continue;
    double* a = quaternion_of(j, q.data());
    const double n = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2] + a[3] * a[3]);
    if (n > 1e-12)
      for (int i = 0; i < 4; ++i) a[i] /= n;
    else a[0] = 1, a[1] = a[2] = a[3] = 0;
  }
}

void forward(const RobotModel& model, std::span<const double> q, std::span<Pose> frames) {
  for (std::size_t i = 0; i < model.joints.size(); ++i)
    frames[i] =
        carried(model.joints[i].parent, spatial::joint_pose(model.joints[i], q.data()), frames);
}

Pose carried(std::int32_t joint, const Pose& local, std::span<const Pose> frames) {
  return joint < 0 ? local : spatial::compose(frames[static_cast<std::size_t>(joint)], local);
}

void add_jacobian(const RobotModel& model, std::int32_t joint, const Vec3& point,
                  std::span<const Pose> frames, double sign, Eigen::Ref<Eigen::MatrixXd> J) {
  for (std::int32_t i = joint; i >= 0; i = model.joints[static_cast<std::size_t>(i)].parent) {
    const JointModel& j = model.joints[static_cast<std::size_t>(i)];
    const Pose& own = frames[static_cast<std::size_t>(i)];
    const double f = sign * (j.is_coupled() ? j.coupling.ratio : 1.0);
    Eigen::Index column = j.v_index;
    const auto slide = [&](std::size_t k) {
      const Vec3 z = spatial::axis(own, k);
      for (std::size_t r = 0; r < 3; ++r) J(static_cast<Eigen::Index>(r), column) += f * z[r];
      ++column;
    };
    const auto turns = [&](std::size_t k) {
      const Vec3 z = spatial::axis(own, k);
      const Vec3 v = spatial::cross(z, spatial::sub(point, own.p));
      for (std::size_t r = 0; r < 3; ++r) {
        J(static_cast<Eigen::Index>(r), column) += f * v[r];
        J(static_cast<Eigen::Index>(r) + 3, column) += f * z[r];
      }
      ++column;
    };
    if (j.type == JointType::revolute) turns(2);
    if (j.type == JointType::prismatic) slide(2);
    if (j.type == JointType::free)
      for (std::size_t k = 0; k < 3; ++k) slide(k);
    if (has_quaternion(j))
      for (std::size_t k = 0; k < 3; ++k) turns(k);
  }
}

}  // namespace robomosp::ik_numeric
