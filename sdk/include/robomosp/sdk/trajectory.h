// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.segment/2: one piece of a Cartesian trajectory (layer: contract, std only).
#pragma once

#include <memory>
#include <span>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// State of the tool along a path, in the trajectory's frame.
struct PathSample {
  Pose pose;
  Vec3 velocity{};              ///< of the tool's origin [m/s]
  Vec3 angular_velocity{};      ///< [rad/s]
  Vec3 acceleration{};          ///< [m/s^2]
  Vec3 angular_acceleration{};  ///< [rad/s^2]
};

/// A segment ready to be sampled. Immutable. [any thread]
class Segment {
 public:
  virtual ~Segment() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  [[nodiscard]] virtual double duration() const = 0;  ///< [s], > 0
  [[nodiscard]] virtual double length() const = 0;    ///< path length of the tool's origin [m]
  /// Fills out[i] for times[i]; times outside 0..duration() are held at the ends (rates zero).
  virtual Result<void> sample(std::span<const double> times, std::span<PathSample> out) const = 0;
};

/// Interface robomosp.segment/2: makes segments of one shape.
class SegmentFactory {
 public:
  using Interface = SegmentFactory;
  static constexpr const char* kInterfaceId = "robomosp.segment/2";
  virtual ~SegmentFactory() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Builds a segment from its control poses. Wrong number of points, coincident or collinear
  /// points and non-positive speeds are errors that name them. [any thread]
  virtual Result<std::unique_ptr<Segment>> make(std::span<const Pose> points,
                                                const Params&) const = 0;
};

}  // namespace robomosp
