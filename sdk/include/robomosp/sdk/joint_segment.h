// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.joint_segment/2: one piece of a joint-space trajectory, bound to a robot by
// its limits (layer: contract, std only).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

/// Limits of a robot's joints, one entry a joint; infinity = none. [rad or m, s] All borrowed for
/// the call.
struct JointLimits {
  std::uint32_t struct_size = sizeof(JointLimits);  ///< see plugin.h
  std::span<const double> lower, upper, velocity, acceleration, jerk;
};

/// Motion of all joints, row-major, one row of dof entries a time. Spans other than q may be empty:
/// not wanted.
struct JointSamples {
  std::span<double> q, qd, qdd, qddd;
};

/// A joint motion ready to be sampled. Immutable. [any thread]
class JointSegment {
 public:
  virtual ~JointSegment() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  [[nodiscard]] virtual double duration() const = 0;  ///< [s], > 0
  /// Times outside 0..duration() are held at the ends (rates zero).
  virtual Result<void> sample(std::span<const double> times, const JointSamples& out) const = 0;
};

/// Where a joint segment begins and ends in motion: velocities and accelerations of all joints;
/// empty = at rest.
struct JointEnds {
  std::uint32_t struct_size = sizeof(JointEnds);  ///< see plugin.h
  std::span<const double> start_velocity, end_velocity, start_acceleration, end_acceleration;
};

/// Interface robomosp.joint_segment/2.
class JointSegmentFactory {
 public:
  using Interface = JointSegmentFactory;
  static constexpr const char* kInterfaceId = "robomosp.joint_segment/2";
  virtual ~JointSegmentFactory() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// `points` are joint vectors one after the other, row-major, dof entries each. Points outside
  /// the limits, points that coincide and speeds above the limits are errors that name point and
  /// joint. [any thread]
  virtual Result<std::unique_ptr<JointSegment>> make(std::size_t dof,
                                                     std::span<const double> points,
                                                     const JointLimits&, const JointEnds&,
                                                     const Params&) const = 0;
};

}  // namespace robomosp
