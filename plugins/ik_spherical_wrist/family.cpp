// SPDX-License-Identifier: Apache-2.0
#include "family.h"

#include <algorithm>
#include <cmath>

#include "spatial/pose.h"
#include "spatial/print.h"

namespace robomosp::ik_spherical_wrist {
namespace {

using spatial::ArmJoint;
using spatial::cross;
using spatial::dot;
using spatial::norm;
using spatial::scale;
using spatial::sub;

bool parallel(const ArmJoint& a, const ArmJoint& b) { return norm(cross(a.axis, b.axis)) < kSame; }
bool perpendicular(const ArmJoint& a, const ArmJoint& b) {
  return std::fabs(dot(a.axis, b.axis)) < kSame;
}

// The point of axis a nearest to axis b, which is not parallel to it.
Vec3 nearest_on(const ArmJoint& a, const ArmJoint& b) {
  const Vec3 n = cross(a.axis, b.axis);
  const double t = dot(cross(sub(b.point, a.point), b.axis), n) / dot(n, n);
  return spatial::add(a.point, scale(a.axis, t));
}
double distance_to(const ArmJoint& a, const Vec3& p) {
  return norm(cross(a.axis, sub(p, a.point)));
}

std::string metres(double x) { return spatial::print_number(x, 3) + " m"; }

// Empty when the axes a, b, c meet in `point`, else what is wrong.
std::string why_not_meeting(const spatial::SerialArm& arm, Vec3& point) {
  const ArmJoint &a = arm.joints[3], &b = arm.joints[4], &c = arm.joints[5];
  if (parallel(a, b)) return "axes 4 and 5 are parallel";
  if (parallel(b, c)) return "axes 5 and 6 are parallel";
  point = nearest_on(b, a);
  const double miss = distance_to(a, point), last = distance_to(c, point);
  if (miss > kSame * arm.length) return "axis 5 passes axis 4 at " + metres(miss);
  if (last > kSame * arm.length)
    return "axis 6 passes the point where axes 4 and 5 meet at " + metres(last);
  return {};
}

std::string why_not_three_parallel(const spatial::SerialArm& arm, Vec3& point) {
  const auto& j = arm.joints;
  if (!parallel(j[1], j[2]) || !parallel(j[1], j[3])) return "axes 2, 3 and 4 are not parallel";
  if (parallel(j[0], j[1])) return "axis 1 is parallel to axes 2, 3 and 4";
  if (!perpendicular(j[3], j[4])) return "axis 5 is not perpendicular to axis 4";
  if (!perpendicular(j[4], j[5])) return "axis 6 is not perpendicular to axis 5";
  point = nearest_on(j[4], j[5]);
  const double miss = distance_to(j[5], point);
  if (miss > kSame * arm.length) return "axis 6 passes axis 5 at " + metres(miss);
  return {};
}

void set_rows(std::array<double, 9>& m, const Vec3& x, const Vec3& y, const Vec3& z) {
  m = {x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]};
}

ParallelArm constants(const Family& f) {
  const auto& j = f.arm.joints;
  ParallelArm c;
  c.three = f.form == Form::three_parallel;
  const Vec3 h1 = j[0].axis, h2 = j[1].axis;
  c.cos_tilt = dot(h1, h2);
  const Vec3 y = spatial::unit(sub(h2, scale(h1, c.cos_tilt))), x = cross(y, h1);
  c.sin_tilt = dot(h2, y);
  c.origin = j[0].point;
  set_rows(c.base_R, x, y, h1);
  const Vec3 e2 = cross(h2, x);
  const auto plane = [&](const Vec3& v) { return Vec3{dot(x, v), dot(e2, v), dot(h2, v)}; };
  c.offset = plane(sub(f.wrist, c.origin))[2];
  const Vec3 p2 = plane(sub(j[1].point, c.origin)), p3 = plane(sub(j[2].point, c.origin));
  const Vec3 p4 = plane(sub(j[3].point, c.origin)), w = plane(sub(f.wrist, c.origin));
  const Vec3 end = c.three ? p4 : w;
  c.at_x = p2[0], c.at_y = p2[1];
  c.l2x = p3[0] - p2[0], c.l2y = p3[1] - p2[1];
  c.l3x = end[0] - p3[0], c.l3y = end[1] - p3[1];
  c.l4x = w[0] - end[0], c.l4y = w[1] - end[1];
  c.length2 = std::hypot(c.l2x, c.l2y);
  c.length3 = std::hypot(c.l3x, c.l3y);
  c.reach = f.arm.length;
  c.sign3 = dot(h2, j[2].axis) < 0 ? -1 : 1;
  c.sign4 = dot(h2, j[3].axis) < 0 ? -1 : 1;
  const Vec3 wz = c.three ? h2 : j[3].axis, wy = j[4].axis, wx = cross(wy, wz);
  const Vec3 rows[3] = {wx, wy, wz}, columns[3] = {x, e2, h2};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t k = 0; k < 3; ++k) c.wrist_plane[3 * r + k] = dot(rows[r], columns[k]);
  c.bend = std::atan2(dot(j[5].axis, wx), dot(j[5].axis, wz));
  const double s = std::sin(c.bend), k = std::cos(c.bend);
  const Vec3 bent[3] = {sub(scale(wx, k), scale(wz, s)), wy,
                        spatial::add(scale(wx, s), scale(wz, k))};
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 in_tip = spatial::rotate_back(f.arm.tip_at_zero, bent[i]);
    for (std::size_t r = 0; r < 3; ++r) c.tip_wrist[3 * r + i] = in_tip[r];
  }
  return c;
}

Error refused(std::string message) {
  return error(ErrorCode::unsupported, std::move(message),
               "Choose another provider, such as numeric.");
}

}  // namespace

Result<Family> recognise(const RobotModel& model, std::size_t tip) {
  Family f;
  RMP_TRY_ASSIGN(f.arm, spatial::serial_arm(model, tip));
  if (f.arm.size() != 6)
    return refused("this closed form needs 6 revolute joints, but the tip \"" +
                   model.tips[tip].name + "\" is carried by " + std::to_string(f.arm.size()));
  const auto& j = f.arm.joints;
  const std::string wrist = why_not_meeting(f.arm, f.wrist);
  if (wrist.empty()) {
    if (parallel(j[0], j[1]) && parallel(j[1], j[2]))
      return refused("axes 1, 2 and 3 are parallel: the wrist cannot change its height");
    f.right_wrist = perpendicular(j[3], j[4]) && perpendicular(j[4], j[5]);
    f.form = parallel(j[1], j[2]) && f.right_wrist ? Form::two_parallel : Form::general;
    for (std::size_t i = 0; i < 3; ++i)
      if (i == 2 && distance_to(j[i], f.wrist) < kSame * f.arm.length)
        return refused("axis " + std::to_string(i + 1) +
                       " passes through the wrist point and therefore does not move it");
  } else {
    const std::string other = why_not_three_parallel(f.arm, f.wrist);
    if (!other.empty())
      return refused("it has neither a spherical wrist (" + wrist +
                     ") nor three parallel axes as UR arms have (" + other + ")");
    f.form = Form::three_parallel;
  }
  f.tip_wrist = spatial::transform(spatial::inverse(f.arm.tip_at_zero), f.wrist);
  if (f.form != Form::general) {
    f.lanes = constants(f);
    if (f.lanes.length2 < kSame * f.arm.length || f.lanes.length3 < kSame * f.arm.length)
      return refused("a link of its arm has no length perpendicular to axis 2");
  }
  const auto length_across = [&](const Vec3& from, const Vec3& to) {
    return norm(cross(j[1].axis, sub(to, from)));
  };
  f.names_arm = parallel(j[1], j[2]) && !parallel(j[0], j[1]) &&
                length_across(j[1].point, j[2].point) >= kSame * f.arm.length &&
                length_across(j[2].point, f.form == Form::three_parallel ? j[3].point : f.wrist) >=
                    kSame * f.arm.length;
  return f;
}

}  // namespace robomosp::ik_spherical_wrist
