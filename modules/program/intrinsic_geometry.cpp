// SPDX-License-Identifier: Apache-2.0
// Vectors, poses and orientations of the language.
#include <algorithm>
#include <cmath>

#include "program/intrinsics.h"
#include "program/real_literal.h"

namespace robomosp::program {

Run::Did Run::Intrinsic::geometry() {
  double v[3], w[3], r[7];
  switch (c.fn) {
    case Fn::cross:
      get(0, v, 3);
      get(1, w, 3);
      r[0] = v[1] * w[2] - v[2] * w[1];
      r[1] = v[2] * w[0] - v[0] * w[2];
      r[2] = v[0] * w[1] - v[1] * w[0];
      return reals(r, 3);
    case Fn::dot:
      get(0, v, 3);
      get(1, w, 3);
      r[0] = v[0] * w[0] + v[1] * w[1] + v[2] * w[2];
      return reals(r, 1);
    case Fn::inv: {
      const PlainPose i = inverse_pose(run.pose_of(in[0]));
      for (std::size_t k = 0; k < 3; ++k) r[k] = i.position[k];
      for (std::size_t k = 0; k < 4; ++k) r[3 + k] = i.quaternion[k];
      return reals(r, 7);
    }
    default: return unknown();
  }
}

Run::Did Run::Intrinsic::orientations() {
  double q[4], v[3], w[3];
  switch (c.fn) {
    case Fn::ori_xyz:
    case Fn::ori_yxz:
    case Fn::ori_zyx:
    case Fn::ori_zyz2:
    case Fn::ori_rs: {
      static constexpr int kAxes[5][3] = {{0, 1, 2}, {1, 0, 2}, {2, 1, 0}, {2, 1, 2}, {2, 1, 0}};
      const auto form = static_cast<std::size_t>(c.fn) - static_cast<std::size_t>(Fn::ori_xyz);
      double angles[3] = {number(0), number(1), number(2)};
      if (c.fn == Fn::ori_rs) std::swap(angles[0], angles[2]);
      three_rotations(kAxes[form], angles, q);
      return reals(q, 4);
    }
    case Fn::ori_vang: {
      get(0, v, 3);
      const double n = std::hypot(v[0], v[1], v[2]);
      if (!(n > 0) || !std::isfinite(n))
        return failed("ORIVANG gets an axis without a direction",
                      "Such as POSITION(0.0, 0.0, 1.0).");
      axis_rotation(0, number(1), q);
      const double s = q[1];
      for (int k = 0; k < 3; ++k) q[1 + k] = s * (v[k] / n);
      return reals(q, 4);
    }
    case Fn::ori_quat: {
      double most = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        q[k] = number(k);
        most = std::max(most, std::fabs(q[k]));
      }
      if (!(most > 0)) return failed("ORIQUAT gets four zeros, which are not an orientation");
      for (double& x : q) x /= most;
      const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
      for (double& x : q) x /= n;
      return reals(q, 4);
    }
    case Fn::ori_mat: {
      double a[3];
      get(0, v, 3);
      get(1, w, 3);
      get(2, a, 3);
      if (!columns_to_quaternion(v, w, a, q))
        return failed(
            "ORIMAT gets axes that are not of length one, at right angles and right-handed");
      return reals(q, 4);
    }
    case Fn::ori_mult: {
      double a[4], b[4];
      get(0, a, 4);
      get(1, b, 4);
      compose_orientations(a, b, q);
      return reals(q, 4);
    }
    default: return unknown();
  }
}

Run::Did Run::Intrinsic::parts_of_orientation() {
  double q[4], r[7];
  switch (c.fn) {
    case Fn::angle_x:
    case Fn::angle_y:
    case Fn::angle_z:
    case Fn::angle_z2: {
      if (!turned(1, q)) return Did::failed;
      double angles[4];
      unsigned has = 0;
      const std::string mode(run.text_of(*in[0]));
      const auto which = static_cast<unsigned>(c.fn) - static_cast<unsigned>(Fn::angle_x);
      if (!angles_of(mode, q, angles, has))
        return failed(name() + " has no mode '" + mode.substr(0, 40) + "'",
                      "Modes are 'RS', 'XYZ', 'YXZ', 'ZYX' and 'ZYZ2'.");
      if (!(has >> which & 1u)) return failed("the mode '" + mode + "' has no angle of " + name());
      return reals(angles + which, 1);
    }
    case Fn::quat_a:
    case Fn::quat_b:
    case Fn::quat_c:
    case Fn::quat_d:
      *out() = in[0][static_cast<std::size_t>(c.fn) - static_cast<std::size_t>(Fn::quat_a)];
      return Did::done;
    case Fn::rot_angle:
      if (!turned(0, q)) return Did::failed;
      r[0] = 2 * std::atan2(std::hypot(q[1], q[2], q[3]), std::fabs(q[0])) * kDegreesPerRadian;
      return reals(r, 1);
    case Fn::rot_axis: {
      if (!turned(0, q)) return Did::failed;
      const double n = std::hypot(q[1], q[2], q[3]);
      if (n < 1e-12)
        return failed("ROTAXIS has no value: the orientation has no rotation",
                      "Ask ROTANGLE first.");
      for (int k = 0; k < 3; ++k) r[k] = (q[0] < 0 ? -q[1 + k] : q[1 + k]) / n;
      return reals(r, 3);
    }
    case Fn::vector_n:
    case Fn::vector_o:
    case Fn::vector_a: {
      if (!turned(0, q)) return Did::failed;
      double m[9];
      quaternion_to_matrix(q, m);
      const std::size_t k = static_cast<std::size_t>(c.fn) - static_cast<std::size_t>(Fn::vector_n);
      r[0] = m[k];
      r[1] = m[3 + k];
      r[2] = m[6 + k];
      return reals(r, 3);
    }
    default: return unknown();
  }
}

}  // namespace robomosp::program
