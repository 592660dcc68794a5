// SPDX-License-Identifier: Apache-2.0
#include "spatial/serial_arm.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::spatial {
namespace {

constexpr std::size_t kMost = kMostArmJoints;

using Columns = std::array<double, 6 * kMost>;
using Square = std::array<std::array<double, kMost + 4>, kMost + 3>;

// Solves the n equations a[i] x = a[i][n] by elimination with pivoting; false when singular.
bool solve(Square& a, std::size_t n) {
  for (std::size_t c = 0; c < n; ++c) {
    std::size_t pivot = c;
    for (std::size_t r = c + 1; r < n; ++r)
      if (std::fabs(a[r][c]) > std::fabs(a[pivot][c])) pivot = r;
    if (!(std::fabs(a[pivot][c]) > 1e-300)) return false;
    std::swap(a[pivot], a[c]);
    for (std::size_t r = 0; r < n; ++r) {
      if (r == c) continue;
      const double f = a[r][c] / a[c][c];
      for (std::size_t k = c; k <= n; ++k) a[r][k] -= f * a[c][k];
    }
  }
  for (std::size_t r = 0; r < n; ++r) a[r][n] /= a[r][r];
  return true;
}

struct Miss {
  Vec3 position{}, rotation{};  ///< from tip to target [m], [rad]
};
Miss miss(const Pose& tip, const Pose& target) {
  return {sub(target.p, tip.p), rotation_difference(tip.R, target.R)};
}

}  // namespace

Result<SerialArm> serial_arm(const RobotModel& model, std::size_t tip, std::size_t most) {
  SerialArm arm;
  std::vector<std::size_t> way;
  for (std::int32_t j = model.tips[tip].joint; j >= 0;
       j = model.joints[static_cast<std::size_t>(j)].parent)
    way.push_back(static_cast<std::size_t>(j));
  std::reverse(way.begin(), way.end());
  if (way.empty() || way.size() > std::min(most, kMost))
    return error(ErrorCode::unsupported,
                 "its tip is carried by " + std::to_string(way.size()) + " joints",
                 "Choose another provider, such as numeric.");
  Pose at;
  arm.length = 0;
  for (const std::size_t index : way) {
    const JointModel& j = model.joints[index];
    if (j.type != JointType::revolute || j.is_coupled())
      return error(ErrorCode::unsupported,
                   "joint \"" + j.name + "\" is " +
                       (j.is_coupled() ? "coupled to another one" : "not revolute"),
                   "Choose another provider, such as numeric.");
    at = compose(at, j.placement);
    arm.length += norm(j.placement.p);
    arm.joints.push_back({axis(at, 2), at.p, j.placement, j.lower, j.upper,
                          static_cast<std::size_t>(j.q_index), index, j.name});
  }
  arm.tool = model.tips[tip].tool;
  arm.tip_at_zero = compose(at, arm.tool);
  arm.length += norm(arm.tool.p);
  if (!(arm.length > 0)) arm.length = 1;
  return arm;
}

Pose arm_tip(const SerialArm& arm, std::span<const double> q) {
  Pose at;
  for (std::size_t i = 0; i < arm.size(); ++i)
    at = compose(at, joint_pose(arm.joints[i].placement, JointType::revolute, q[i]));
  return compose(at, arm.tool);
}

Pose arm_jacobian(const SerialArm& arm, std::span<const double> q, std::span<double> jacobian) {
  std::array<Pose, kMost> frames;
  Pose at;
  for (std::size_t i = 0; i < arm.size(); ++i)
    frames[i] = at = compose(at, joint_pose(arm.joints[i].placement, JointType::revolute, q[i]));
  const Pose tip = compose(at, arm.tool);
  for (std::size_t i = 0; i < arm.size(); ++i) {
    const Vec3 z = axis(frames[i], 2), v = cross(z, sub(tip.p, frames[i].p));
    for (std::size_t k = 0; k < 3; ++k) {
      jacobian[6 * i + k] = v[k];
      jacobian[6 * i + 3 + k] = z[k];
    }
  }
  return tip;
}

double closest_position(const SerialArm& arm, const Pose& target, std::span<double> q) {
  const std::size_t n = arm.size();
  Columns j;
  double damping = 1e-3 * arm.length * arm.length;
  Miss e = miss(arm_jacobian(arm, q, j), target);
  // The orientation weighs so much that no step trades it for position.
  const auto merit = [&](const Miss& m) {
    return norm(m.position) + 10 * arm.length * norm(m.rotation);
  };
  for (int step = 0; step < 300; ++step) {
    Square a{};
    for (std::size_t r = 0; r < n; ++r) {
      for (std::size_t c = 0; c < n; ++c)
        for (std::size_t k = 0; k < 3; ++k) a[r][c] += j[6 * r + k] * j[6 * c + k];
      a[r][r] += damping;
      for (std::size_t k = 0; k < 3; ++k) {
        a[r][n + k] = a[n + k][r] = j[6 * r + 3 + k];
        a[r][n + 3] += j[6 * r + k] * e.position[k];
      }
    }
    for (std::size_t k = 0; k < 3; ++k) {
      a[n + k][n + k] = -1e-12;  // keeps it regular where a direction of turning is lost
      a[n + k][n + 3] = e.rotation[k];
    }
    if (!solve(a, n + 3)) break;
    double longest = 0;
    for (std::size_t i = 0; i < n; ++i) longest = std::max(longest, std::fabs(a[i][n + 3]));
    const double scale = longest > 0.5 ? 0.5 / longest : 1;
    std::array<double, kMost> next;
    for (std::size_t i = 0; i < n; ++i) next[i] = q[i] + scale * a[i][n + 3];
    Columns next_j;
    const Miss next_e = miss(arm_jacobian(arm, {next.data(), n}, next_j), target);
    if (merit(next_e) < merit(e)) {
      const bool settled = merit(e) - merit(next_e) < 1e-14 * merit(e);
      std::copy_n(next.begin(), n, q.begin());
      e = next_e;
      j = next_j;
      damping *= 0.3;
      if (settled) break;
    } else {
      damping = std::max(damping, 1e-12) * 4;
      if (longest < 1e-11) break;
    }
  }
  return norm(e.position);
}

double closest_pose(const SerialArm& arm, const Pose& target, std::span<double> q) {
  const std::size_t n = arm.size();
  const double per_length = 1 / arm.length;
  for (std::size_t i = 0; i < n; ++i)
    q[i] = std::clamp(q[i], arm.joints[i].lower, arm.joints[i].upper);
  Columns j;
  const auto measure = [&](std::span<const double> at, std::array<double, 6>& e, Columns& jac) {
    const Miss m = miss(arm_jacobian(arm, at, jac), target);
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      e[k] = m.position[k] * per_length;
      e[3 + k] = m.rotation[k];
      for (std::size_t i = 0; i < n; ++i) jac[6 * i + k] *= per_length;
    }
    for (const double x : e) sum += x * x;
    return sum;
  };
  std::array<double, 6> e;
  double cost = measure(q, e, j), damping = 1e-3;
  for (int step = 0; step < 120; ++step) {
    std::array<std::size_t, kMost> movable;
    std::size_t m = 0;
    for (std::size_t i = 0; i < n; ++i) {
      double push = 0;
      for (std::size_t k = 0; k < 6; ++k) push += j[6 * i + k] * e[k];
      const bool held =
          (q[i] <= arm.joints[i].lower && push < 0) || (q[i] >= arm.joints[i].upper && push > 0);
      if (!held) movable[m++] = i;
    }
    if (m == 0) break;
    Square a{};
    for (std::size_t r = 0; r < m; ++r) {
      for (std::size_t c = 0; c < m; ++c)
        for (std::size_t k = 0; k < 6; ++k)
          a[r][c] += j[6 * movable[r] + k] * j[6 * movable[c] + k];
      a[r][r] += damping;
      for (std::size_t k = 0; k < 6; ++k) a[r][m] += j[6 * movable[r] + k] * e[k];
    }
    if (!solve(a, m)) break;
    std::array<double, kMost> next;
    std::copy_n(q.begin(), n, next.begin());
    double longest = 0;
    for (std::size_t r = 0; r < m; ++r) {
      const ArmJoint& joint = arm.joints[movable[r]];
      double& x = next[movable[r]];
      x = std::clamp(x + std::clamp(a[r][m], -1.0, 1.0), joint.lower, joint.upper);
      longest = std::max(longest, std::fabs(x - q[movable[r]]));
    }
    Columns next_j;
    std::array<double, 6> next_e;
    const double next_cost = measure({next.data(), n}, next_e, next_j);
    if (next_cost < cost) {
      const bool settled = cost - next_cost < 1e-13 * cost;
      std::copy_n(next.begin(), n, q.begin());
      cost = next_cost;
      e = next_e;
      j = next_j;
      damping *= 0.3;
      if (settled) break;
    } else {
      damping *= 5;
      if (longest < 1e-10 || damping > 1e12) break;
    }
  }
  return cost;
}

std::array<double, 6> lost_direction(const SerialArm& arm, std::span<const double> q,
                                     double tolerance) {
  const std::size_t n = arm.size();
  Columns j;
  arm_jacobian(arm, q, j);
  const double per_length = 1 / arm.length;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < 3; ++k) j[6 * i + k] *= per_length;
  // One-sided Jacobi on the rows of J: it finds small singular values to full accuracy.
  std::array<std::array<double, kMost>, 6> rows{};
  std::array<std::array<double, 6>, 6> u{};
  for (std::size_t r = 0; r < 6; ++r) {
    u[r][r] = 1;
    for (std::size_t i = 0; i < n; ++i) rows[r][i] = j[6 * i + r];
  }
  for (int sweep = 0; sweep < 30; ++sweep) {
    double off = 0;
    for (std::size_t r = 0; r < 6; ++r)
      for (std::size_t s = r + 1; s < 6; ++s) {
        double rr = 0, ss = 0, rs = 0;
        for (std::size_t i = 0; i < n; ++i) {
          rr += rows[r][i] * rows[r][i];
          ss += rows[s][i] * rows[s][i];
          rs += rows[r][i] * rows[s][i];
        }
        if (std::fabs(rs) <= 1e-17 * std::sqrt(rr * ss) || rs == 0) continue;
        off = std::max(off, std::fabs(rs) / std::sqrt(rr * ss));
        const double zeta = (ss - rr) / (2 * rs);
        const double t = (zeta >= 0 ? 1.0 : -1.0) / (std::fabs(zeta) + std::hypot(1.0, zeta));
        const double c = 1 / std::hypot(1.0, t), d = c * t;
        const auto turn = [&](double& a, double& b) {
          const double x = a;
          a = c * x - d * b;
          b = d * x + c * b;
        };
        for (std::size_t i = 0; i < n; ++i) turn(rows[r][i], rows[s][i]);
        for (std::size_t k = 0; k < 6; ++k) turn(u[r][k], u[s][k]);
      }
    if (off < 1e-15) break;
  }
  std::size_t least = 0;
  double small = INFINITY, great = 0;
  for (std::size_t r = 0; r < 6; ++r) {
    double size = 0;
    for (std::size_t i = 0; i < n; ++i) size += rows[r][i] * rows[r][i];
    if (size < small) small = size, least = r;
    great = std::max(great, size);
  }
  if (std::sqrt(small) > tolerance * std::sqrt(great)) return {};
  // In metres the direction that J^T annuls has its linear part divided by the length.
  std::array<double, 6> out = u[least];
  double size = 0;
  for (std::size_t k = 0; k < 3; ++k) out[k] *= per_length;
  for (const double x : out) size += x * x;
  for (double& x : out) x /= std::sqrt(size);
  return out;
}

}  // namespace robomosp::spatial
