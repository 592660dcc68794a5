// SPDX-License-Identifier: Apache-2.0
// Eigen views of the SDK's plain types, for plugins that use Eigen (layer: contract helper, not
// part of the ABI: inline only, and nothing owned by Eigen may cross the boundary).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <robomosp/sdk/types.h>

namespace robomosp {

[[nodiscard]] inline Eigen::Map<const Eigen::Vector3d> map(const Vec3& v) {
  return Eigen::Map<const Eigen::Vector3d>(v.data());
}
[[nodiscard]] inline Eigen::Map<Eigen::Vector3d> map(Vec3& v) {
  return Eigen::Map<Eigen::Vector3d>(v.data());
}
using RowMatrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
[[nodiscard]] inline Eigen::Map<const RowMatrix3> rotation(const Pose& t) {
  return Eigen::Map<const RowMatrix3>(t.R.data());
}
[[nodiscard]] inline Eigen::Map<RowMatrix3> rotation(Pose& t) {
  return Eigen::Map<RowMatrix3>(t.R.data());
}
[[nodiscard]] inline Eigen::Matrix3d matrix(const Sym3& s) {
  Eigen::Matrix3d m;
  m << s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz;
  return m;
}
/// Takes the upper triangle of m.
[[nodiscard]] inline Sym3 sym3(const Eigen::Ref<const Eigen::Matrix3d>& m) {
  return {m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(1, 2), m(0, 2)};
}
[[nodiscard]] inline Eigen::Isometry3d isometry(const Pose& t) {
  Eigen::Isometry3d i = Eigen::Isometry3d::Identity();
  i.linear() = rotation(t);
  i.translation() = map(t.p);
  return i;
}
[[nodiscard]] inline Pose pose(const Eigen::Isometry3d& i) {
  Pose t;
  rotation(t) = i.linear();
  map(t.p) = i.translation();
  return t;
}

}  // namespace robomosp
