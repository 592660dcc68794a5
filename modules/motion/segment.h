// SPDX-License-Identifier: Apache-2.0
// A Cartesian segment built from its record, ready to be sampled (layer: data processing, motion).
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <string>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/trajectory.h>

#include "kernel/registry.h"
#include "model/records.h"

namespace robomosp::motion {

/// The providers of a segment, and the owner of each of its parameters. Parameters given beside the
/// shape (`speed 10 mm/s`) belong to the first of shape, law and orientation that declares them;
/// those of `turning` are in a separate table.
struct SegmentProviders {
  ProviderInfo shape;        ///< of robomosp.curve/2, segment/2 or joint_segment/2
  ProviderInfo law;          ///< of a curve
  ProviderInfo orientation;  ///< of a curve
  ProviderInfo turning;      ///< law of a curve's orientation; no name = it turns with the path

  [[nodiscard]] bool is_curve() const;
  [[nodiscard]] bool is_joint() const;
  /// The providers with parameters beside the shape.
  [[nodiscard]] std::array<const ProviderInfo*, 3> owners() const {
    return {&shape, &law, &orientation};
  }
  /// The first of them with a parameter of that name; null = none.
  [[nodiscard]] const ProviderInfo* owner(std::string_view name) const;
  /// That parameter; null = none.
  [[nodiscard]] const ParamSpec* parameter(std::string_view name) const;
};
/// `where` names the segment in errors.
Result<SegmentProviders> providers_of(const Registry&, const model::TrajectorySegment&,
                                      std::string_view where);

struct SegmentParams {
  std::shared_ptr<const Params> shape, law, orientation, turning;
  bool is_timed = false;  ///< a curve that may use its own times: no parameter of a law was given
};
/// The record's parameters, checked.
Result<SegmentParams> params_of(const SegmentProviders&, const model::TrajectorySegment&,
                                std::string_view where);

/// The greatest rates given to a segment's laws, defaults included; infinite = no limit.
struct SegmentLimits {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  double speed = kNone;                 ///< [m/s]
  double acceleration = kNone;          ///< [m/s^2]
  double jerk = kNone;                  ///< [m/s^3]
  double angular_speed = kNone;         ///< [rad/s]
  double angular_acceleration = kNone;  ///< [rad/s^2]
  double angular_jerk = kNone;          ///< [rad/s^3]
};

/// The segment of a record (not a stored one), and its limits if `limits` is not null. A line with
/// coincident ends is a wait of its `duration`, which may be zero. A joint segment is an error: it
/// needs a robot. [any thread]
Result<std::shared_ptr<const Segment>> make_segment(const Registry&,
                                                    const model::TrajectorySegment&,
                                                    std::string_view where,
                                                    SegmentLimits* limits = nullptr);

/// A segment in another frame: poses and rates multiplied by `a_T_b`.
std::shared_ptr<const Segment> placed_segment(const Pose& a_T_b, std::shared_ptr<const Segment>);

}  // namespace robomosp::motion
