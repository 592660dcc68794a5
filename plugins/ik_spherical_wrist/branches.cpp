// SPDX-License-Identifier: Apache-2.0
// C. S. G. Lee, M. Ziegler, A geometric approach in solving the inverse kinematics of PUMA robots,
// IEEE Transactions on Aerospace and Electronic Systems AES-20 (1984): the indicators ARM and
// ELBOW, written in axes instead of rows so that they mean the same whichever way an axis points.
#include "branches.h"

#include <algorithm>
#include <cmath>

#include "spatial/subproblems.h"

namespace robomosp::ik_spherical_wrist {
namespace {

using spatial::add;
using spatial::ArmJoint;
using spatial::cross;
using spatial::dot;
using spatial::norm;
using spatial::scale;
using spatial::SinCos;
using spatial::sub;
using spatial::turned;

constexpr IkBranchChoice kChoices[] = {{"shoulder", "right", "left", {}},
                                       {"elbow", "up", "down", {}},
                                       {"wrist", "no flip", "flip", {}}};

Vec3 about(const ArmJoint& j, double t, const Vec3& p) {
  return add(j.point, turned(j.axis, SinCos{std::sin(t), std::cos(t)}, sub(p, j.point)));
}
Vec3 across(const Vec3& v, const Vec3& h) { return sub(v, scale(h, dot(h, v))); }
double within_one(double x) { return std::clamp(x, -1.0, 1.0); }

}  // namespace

std::span<const IkBranchChoice> branch_choices(const Family& family) {
  const std::span<const IkBranchChoice> all(kChoices);
  return family.names_arm ? all : all.last(1);
}

void measure_branch(const Family& family, std::span<const double> q, std::span<double> out) {
  const auto& j = family.arm.joints;
  const Vec3 h5 = j[4].axis;
  const Vec3 h6 = turned(h5, SinCos{std::sin(q[4]), std::cos(q[4])}, j[5].axis);
  const double sines = norm(cross(j[3].axis, h5)) * norm(cross(h5, j[5].axis));
  const double wrist = within_one(dot(cross(j[3].axis, h6), h5) / sines);
  if (!family.names_arm) {
    out[0] = wrist;
    return;
  }
  // Joint 1 turns all of this together, so that it is looked at where joint 1 is 0.
  const Vec3 h1 = j[0].axis, h2 = j[1].axis;
  const Vec3 behind3 = about(j[3], q[3], family.wrist);
  const Vec3 wrist_at = about(j[1], q[1], about(j[2], q[2], behind3));
  const Vec3 from_1 = sub(wrist_at, j[0].point);
  const double turn = dot(h1, cross(h2, from_1)) / family.arm.length;
  // Where the arm stands beside axis 1, its side says what is left; else the way axis 2 points.
  const double beside = dot(h2, from_1) < -kSame * family.arm.length ? -1 : 1;
  out[0] = within_one(beside * turn);
  const Vec3 end = family.form == Form::three_parallel ? j[3].point : family.wrist;
  const Vec3 upper = across(sub(j[2].point, j[1].point), h2);
  const Vec3 fore = across(sub(about(j[2], q[2], end), j[2].point), h2);
  const double bent = dot(h2, cross(fore, upper)) / (norm(fore) * norm(upper));
  out[1] = within_one(turn < 0 ? -bent : bent);
  out[2] = wrist;
}

}  // namespace robomosp::ik_spherical_wrist
