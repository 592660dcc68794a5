// SPDX-License-Identifier: Apache-2.0
// Trajectories: segments and transitions (layer: data processing, model). SI and radians.
#pragma once

#include <string>
#include <vector>

#include "model/basics.h"
#include "model/fields.h"
#include "model/kind.h"

namespace robomosp::model {

/// How a segment follows the one before it. Where the two do not meet in position, orientation or
/// velocity, a smooth piece is put between them.
struct Transition {
  bool is_smooth = true;  ///< false = none: the two must meet, and the velocity may jump
  double distance = 0;    ///< of the cut from the corner on both sides, along the path [m]; 0 = by
                          ///< the neighbours' lengths
  double speed = 0;       ///< greatest within the piece [m/s]; 0 = of the neighbours
  bool operator==(const Transition&) const = default;
};
template <class V>
constexpr void fields(V& v, Of<Transition>) {
  constexpr auto is_smooth = [](const void* t) {
    return static_cast<const Transition*>(t)->is_smooth;
  };
  v("is_smooth", &Transition::is_smooth)
      .doc("False: the two must meet, and the velocity may jump.");
  v("distance", &Transition::distance)
      .counts_if(is_smooth)
      .unit("m")
      .at_least(0)
      .doc("From the corner, along the path on both sides; 0 goes by the neighbours' lengths.");
  v("speed", &Transition::speed)
      .counts_if(is_smooth)
      .unit("m/s")
      .at_least(0)
      .doc("Greatest speed within it; 0 is that of the neighbours.");
}

/// A segment of a trajectory: a shape (a provider of robomosp.curve/2, segment/2 or
/// joint_segment/2) with its control poses or joint vectors; or another trajectory, run again.
struct TrajectorySegment {
  ProviderChoice shape;        ///< "line", "circle", "ptp", ...; with the parameters of all three
  ProviderChoice law;          ///< of a curve: how the tool runs along it; none = constant_speed
  ProviderChoice orientation;  ///< of a curve: how the tool turns; none = slerp
  ProviderChoice turning;      ///< of a curve: a motion law of its own for the turn, over the
                               ///< segment's duration; none = the tool turns with the way
  std::vector<Placement> points;
  std::vector<std::vector<double>> joints;  ///< of a joint segment [rad or m]
  TrajectoryId stored;                      ///< run this one instead; then no shape
  Placement placement;                      ///< trajectory_T_stored
  Transition transition;                    ///< from the segment before
};
template <class V>
constexpr void fields(V& v, Of<TrajectorySegment>) {
  constexpr auto is_stored = [](const void* s) {
    // While a file is read the other trajectory is not known yet.
    const auto& segment = *static_cast<const TrajectorySegment*>(s);
    return segment.stored || segment.shape.name.empty();
  };
  constexpr auto is_own = [](const void* s) {
    return !static_cast<const TrajectorySegment*>(s)->stored;
  };
  v("shape", &TrajectorySegment::shape)
      .counts_if(is_own)
      .doc("Curve or motion of joints, with its parameters and those of its laws.");
  v("law", &TrajectorySegment::law).counts_if(is_own).doc("How the tool runs along a curve.");
  v("orientation", &TrajectorySegment::orientation)
      .counts_if(is_own)
      .doc("How the tool turns along a curve.");
  v("turning", &TrajectorySegment::turning)
      .counts_if(is_own)
      .doc("A motion law of its own for the turn.");
  v("points", &TrajectorySegment::points).counts_if(is_own).doc("Control poses.");
  v("joints", &TrajectorySegment::joints)
      .unit(kByJoint)
      .counts_if(is_own)
      .doc("Joint vectors of a segment that moves joints.");
  v("stored", &TrajectorySegment::stored).doc("Another trajectory that is run instead.");
  v("placement", &TrajectorySegment::placement)
      .flat()
      .counts_if(is_stored)
      .doc("Frame of that one in the trajectory's.");
  v("transition", &TrajectorySegment::transition).doc("From the segment before.");
}

struct Trajectory {
  std::string description;
  double sample_time = 0.01;  ///< default time between samples [s]
  std::vector<TrajectorySegment> segments;
  Parametric parametric = {};
};
template <class V>
constexpr void fields(V& v, Of<Trajectory>) {
  v("description", &Trajectory::description).doc("What it is, for people.");
  v("parametric", &Trajectory::parametric).flat().doc("Parameters and expressions.");
  v("sample_time", &Trajectory::sample_time).unit("s").above(0).doc("Time between its samples.");
  v("segments", &Trajectory::segments).doc("Run one after another.");
}

}  // namespace robomosp::model
