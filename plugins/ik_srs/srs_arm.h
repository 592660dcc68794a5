// SPDX-License-Identifier: Apache-2.0
// 7R arms with a spherical shoulder, an elbow and a spherical wrist: configurations by branch and
// arm angle, and the arm angles permitted by joint limits (layer: plugin).
#pragma once

#include <array>
#include <numbers>
#include <span>
#include <vector>

#include <robomosp/sdk/result.h>

#include "spatial/serial_arm.h"

namespace robomosp::ik_srs {

inline constexpr double kPi = std::numbers::pi, kTurn = 2 * kPi;

using Angles = std::array<double, 7>;

/// Three axes that intersect at right angles: R1 R2 R3 = to^T Rz(q1) Ry(q2 + bend) Rz(q3) from.
struct Ball {
  std::array<double, 9> to{};    ///< row-major, rows x, y, z: z along the first axis, y the second
  std::array<double, 9> from{};  ///< the same, rotated by `bend` about y
  double bend = 0;               ///< angle from the first to the third axis at q = 0 [rad]
};

struct SrsArm {
  spatial::SerialArm arm;
  Vec3 shoulder{}, wrist{};  ///< intersection of the axes at q = 0, in the base [m]
  Vec3 tip_wrist{};          ///< the wrist in the tip frame [m]
  Vec3 upper{}, fore{};      ///< shoulder to elbow, elbow to wrist at q = 0 [m]
  Vec3 reference{};          ///< unit, normal to axis 1: zero of the arm angle above the shoulder
  Ball first, last;
  double upper_across = 0, fore_across = 0;  ///< lengths normal to axis 4 [m]
  double offset = 0;                         ///< of the wrist from the shoulder along axis 4 [m]
  double least = 0, most = 0;                ///< distances from shoulder to wrist [m]
};

/// Recognises the arm of one tip; an error is one sentence with the violated condition.
[[nodiscard]] Result<SrsArm> recognise(const RobotModel& model, std::size_t tip);

/// An angle span [from, to] with from <= to; a full turn when to - from = 2 pi.
struct Interval {
  double from = 0, to = 0;
};

/// One target, prepared: the data independent of arm angle and branch. The arm angle rotates the
/// elbow about the line from shoulder to wrist, right-handed; at 0 the elbow is in the plane of
/// that line and axis 1, on the side to which axis 1 points.
class SrsTarget {
 public:
  /// `near`: angles kept where a shoulder or wrist is stretched.
  SrsTarget(const SrsArm& arm, const Pose& target, const Angles& near);

  /// Distance by which the wrist is out of reach [m]: 0 = within reach.
  [[nodiscard]] double gap() const { return gap_; }

  /// Branch bits: 1 elbow, 2 shoulder, 4 wrist. Angles in -pi .. pi.
  [[nodiscard]] Angles at(unsigned branch, double arm_angle) const;

  /// Arm angles in -pi .. pi for which all joints but the elbow are within limits, ascending; empty
  /// if there are none or the elbow violates its limits. Interval ends are where a joint reaches a
  /// limit: roots of a cos + b sin = c (Shimizu et al., IEEE T-RO 24, 2008).
  [[nodiscard]] std::vector<Interval> feasible(unsigned branch) const;

  [[nodiscard]] bool within_limits(const Angles& q) const;

 private:
  /// m0 + m1 cos + m2 sin of the arm angle, element by element.
  struct Wave {
    std::array<double, 9> m0{}, m1{}, m2{};
  };
  struct Elbow {
    double q4 = 0;
    Wave shoulder, wrist;
  };
  [[nodiscard]] Elbow elbow(int sign, const Pose& target) const;

  const SrsArm& arm_;
  Angles near_;
  Vec3 to_{};  ///< unit, from shoulder to wrist
  double gap_ = 0, distance_ = 0;
  Elbow elbow_[2];
};

/// The branch of a configuration, each from -1 to 1: shoulder (right above 0), elbow (up above 0),
/// wrist (flipped below 0); the signs of joints 2, 4 and 6, measured from the stretched arm.
[[nodiscard]] std::array<double, 3> branch_measures(const SrsArm& arm, const Angles& q);

/// The arm angle of a configuration [rad].
[[nodiscard]] double arm_angle(const SrsArm& arm, const Angles& q);

}  // namespace robomosp::ik_srs
