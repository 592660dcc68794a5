// SPDX-License-Identifier: Apache-2.0
// The task of a joint motion, checked, and its sampling joint by joint (layer: plugin).
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/joint_segment.h>

#include "spatial/print.h"
#include "spatial/ramps.h"

namespace robomosp::joint_motion {

using spatial::Motion1;
using spatial::print_number;

Error bad(std::string message, std::string hint);
inline std::string joint_name(std::size_t j) { return "joint " + std::to_string(j + 1); }

/// Joint vectors and limits of the motion between them; infinity = no limit. [rad or m, s]
struct Task {
  std::size_t dof = 0, count = 0;  ///< `count` joint vectors
  std::vector<double> q;           ///< row-major
  std::vector<double> lower, upper, velocity, acceleration, jerk;
  [[nodiscard]] double at(std::size_t point, std::size_t joint) const {
    return q[point * dof + joint];
  }
};

/// Reads points and limits; the parameters velocity, acceleration and jerk lower the robot's,
/// speed_share scales the velocity. At least `least` points are required.
Result<Task> read_task(std::size_t dof, std::span<const double> points, const JointLimits&,
                       const Params&, std::size_t least);
/// Rejects equal consecutive points.
Result<void> check_apart(const Task&);
/// A value of JointEnds: zero when left out.
Result<std::vector<double>> end_values(std::span<const double> given, const Task&,
                                       const char* what);
/// The value requested by the caller at an end, or else the parameter of that name.
std::span<const double> end_or(std::span<const double> asked, const Params&, const char* name);
/// Checks for a joint limit required by a law.
Result<void> need(const std::vector<double>& limits, const char* what, std::size_t joint,
                  const char* parameter);

/// A motion of all joints defined joint by joint.
class JointwiseSegment : public JointSegment {
 public:
  JointwiseSegment(std::size_t dof, double duration) : dof_(dof), duration_(duration) {}
  [[nodiscard]] double duration() const final { return duration_; }
  Result<void> sample(std::span<const double> times, const JointSamples& out) const final;

 protected:
  /// 0 <= t <= duration().
  [[nodiscard]] virtual Motion1 at(std::size_t joint, double t) const = 0;

 private:
  std::size_t dof_;
  double duration_;
};

struct PtpFactory final : JointSegmentFactory {
  Result<std::unique_ptr<JointSegment>> make(std::size_t, std::span<const double>,
                                             const JointLimits&, const JointEnds&,
                                             const Params&) const override;
};
struct SplineFactory final : JointSegmentFactory {
  Result<std::unique_ptr<JointSegment>> make(std::size_t, std::span<const double>,
                                             const JointLimits&, const JointEnds&,
                                             const Params&) const override;
};
struct TimeOptimalFactory final : JointSegmentFactory {
  Result<std::unique_ptr<JointSegment>> make(std::size_t, std::span<const double>,
                                             const JointLimits&, const JointEnds&,
                                             const Params&) const override;
};

}  // namespace robomosp::joint_motion
