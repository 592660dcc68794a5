// SPDX-License-Identifier: Apache-2.0
// Configurations spread evenly over a robot's joint space, with the faces, edges and corners of its
// limits (layer: data processing, robotics). [any thread]
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

namespace robomosp::robotics {

/// The i-th configuration depends on the robot, the seed and i alone. Even ones are an additive
/// recurrence with the powers of the generalised golden ratio (Roberts, 2018), shifted by the seed
/// (Cranley, Patterson, SIAM J. Numer. Anal. 13(6), 1976); in odd ones, each joint with limits
/// closer than a turn is at one of them with probability 1/2. Joints without limits: revolute
/// -pi..pi, ball all rotations.
class JointSampler {
 public:
  /// Moves the joints that carry `tip`; the others stay at `fixed` (coordinate_count() numbers).
  /// Rejects free joints and prismatic ones without limits, which are unbounded, and closed loops.
  static Result<JointSampler> make(const RobotModel& model, std::size_t tip,
                                   std::span<const double> fixed, std::uint64_t seed);
  /// q: coordinate_count() numbers.
  void sample(std::uint64_t index, std::span<double> q) const;

 private:
  struct Entry {
    std::size_t q = 0;  ///< first of its coordinates
    bool is_ball = false, is_limited = false;
    double lower = 0, upper = 0;
    std::size_t digit = 0;  ///< of the recurrence
  };
  std::vector<Entry> entries_;
  std::vector<double> fixed_;
  std::vector<std::uint64_t> steps_, starts_;  ///< fractions of 2^64
  std::uint64_t seed_ = 0;
};

/// The range of a joint of one coordinate in which the joints coupled to it also stay within their
/// limits; infinite if unlimited [rad or m].
struct JointRange {
  double lower, upper;
};
[[nodiscard]] JointRange joint_range(const RobotModel& model, std::size_t joint);

}  // namespace robomosp::robotics
