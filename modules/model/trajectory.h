// SPDX-License-Identifier: Apache-2.0
// Trajectories: segments and transitions (layer: data processing, model). SI and radians.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/basics.h"
#include "model/fields.h"
#include "model/kind.h"

namespace robomosp::model {

/// The transition from the previous segment. If the two do not match in position, orientation or
/// velocity, a smooth piece is inserted between them.
struct Transition {
  bool is_smooth = true;  ///< false = none: the two must meet, and the velocity may jump
  double distance = 0;    ///< cut off on both sides of the corner, along the path [m]; 0 = from the
                          ///< neighbours' lengths
  double speed = 0;       ///< greatest speed in the piece [m/s]; 0 = of the neighbours
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
      .doc(
          "Distance from the corner, along the path on both sides; 0 depends on the neighbours' "
          "lengths.");
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
  ProviderChoice law;          ///< of a curve: how the tool moves along it; empty = constant_speed
  ProviderChoice orientation;  ///< of a curve: how the tool turns; empty = slerp
  ProviderChoice turning;      ///< of a curve: a separate timing law for the rotation, over the
                               ///< segment's duration; empty = the tool turns with the path
  std::vector<Placement> points;
  std::vector<std::vector<double>> joints;  ///< of a joint segment [rad or m]
  TrajectoryId stored;                      ///< run this one instead; then no shape
  Placement placement;                      ///< trajectory_T_stored
  Transition transition;                    ///< from the segment before
};
template <class V>
constexpr void fields(V& v, Of<TrajectorySegment>) {
  constexpr auto is_stored = [](const void* s) {
    // While a file is read, the other trajectory is not known yet.
    const auto& segment = *static_cast<const TrajectorySegment*>(s);
    return segment.stored || segment.shape.name.empty();
  };
  constexpr auto is_own = [](const void* s) {
    return !static_cast<const TrajectorySegment*>(s)->stored;
  };
  v("shape", &TrajectorySegment::shape)
      .counts_if(is_own)
      .doc("Curve or joint motion, with its parameters and those of its laws.");
  v("law", &TrajectorySegment::law).counts_if(is_own).doc("Motion law of the tool along a curve.");
  v("orientation", &TrajectorySegment::orientation)
      .counts_if(is_own)
      .doc("Orientation of the tool along a curve.");
  v("turning", &TrajectorySegment::turning)
      .counts_if(is_own)
      .doc("A separate motion law for the rotation.");
  v("points", &TrajectorySegment::points).counts_if(is_own).doc("Control poses.");
  v("joints", &TrajectorySegment::joints)
      .unit(kByJoint)
      .counts_if(is_own)
      .doc("Joint vectors of a segment that moves joints.");
  v("stored", &TrajectorySegment::stored).doc("Another trajectory to run instead.");
  v("placement", &TrajectorySegment::placement)
      .flat()
      .counts_if(is_stored)
      .doc("Frame of that one in the trajectory's.");
  v("transition", &TrajectorySegment::transition).doc("Transition from the segment before.");
}

/// Edges of a solid that a trajectory follows, with parameters. Its segments are recomputed when
/// the solid changes. In the solid's frame.
struct EdgePath {
  SolidId solid;
  std::vector<std::int64_t> edges;   ///< in order; numbers of solid.edges, 1 = the first
  bool is_reversed = false;          ///< in the opposite direction
  Vec3 from{};                       ///< direction from which the tool comes; 0 = between the faces
  double tilt = 0;                   ///< rotation of the tool about the path [rad]
  double lead = 0;                   ///< then about the tool's y [rad]
  double stand_off = 0;              ///< distance from the edge, along the tool [m]
  double lead_in = 0, lead_out = 0;  ///< straight extension before the first edge, after the last
                                     ///< [m]
  double approach = 0, retract = 0;  ///< along the tool [m]
  double speed = 0;                  ///< along the edges [m/s]
  double travel_speed = 0;           ///< of approach, retract and corners [m/s]; 0 = speed
  double acceleration = 0;           ///< [m/s^2]; 0 = the default of the motion law
  double chord = 0;                  ///< for edges other than lines and arcs [m]; 0 = the solid's
  bool operator==(const EdgePath&) const = default;
};
template <class V>
constexpr void fields(V& v, Of<EdgePath>) {
  v("solid", &EdgePath::solid).needed().doc("The solid with the edges.");
  v("edges", &EdgePath::edges).doc("In order: numbers of solid.edges.");
  v("is_reversed", &EdgePath::is_reversed).doc("Follow the edges in the other direction.");
  v("from", &EdgePath::from)
      .doc("Direction from which the tool comes, in the solid's frame; 0 is between the faces.");
  v("tilt", &EdgePath::tilt).unit("rad").doc("Rotation of the tool about the path.");
  v("lead", &EdgePath::lead).unit("rad").doc("Subsequent rotation about the tool's y axis.");
  v("stand_off", &EdgePath::stand_off)
      .unit("m")
      .at_least(0)
      .doc("Distance from the edge, along the tool.");
  v("lead_in", &EdgePath::lead_in)
      .unit("m")
      .at_least(0)
      .doc("Length straight on before the first edge.");
  v("lead_out", &EdgePath::lead_out)
      .unit("m")
      .at_least(0)
      .doc("Length straight on after the last edge.");
  v("approach", &EdgePath::approach)
      .unit("m")
      .at_least(0)
      .doc("Length along the tool to the first point.");
  v("retract", &EdgePath::retract)
      .unit("m")
      .at_least(0)
      .doc("Length along the tool from the last point.");
  v("speed", &EdgePath::speed).unit("m/s").above(0).needed().doc("Speed along the edges.");
  v("travel_speed", &EdgePath::travel_speed)
      .unit("m/s")
      .at_least(0)
      .doc("Speed of approach, retract and corners; 0 is the speed along the edges.");
  v("acceleration", &EdgePath::acceleration)
      .unit("m/s^2")
      .at_least(0)
      .doc(
          "Acceleration at the start and end of the speed profile; 0 is the default of the motion "
          "law.");
  v("chord", &EdgePath::chord)
      .unit("m")
      .at_least(0)
      .doc(
          "Greatest distance of a chord from an edge that is not a line or arc; 0 is the solid's.");
}

struct Trajectory {
  std::string description;
  double sample_time = 0.01;  ///< default time between samples [s]
  std::vector<TrajectorySegment> segments;
  Parametric parametric = {};
  std::optional<EdgePath> along = {};  ///< source of the segments; empty = given directly
};
template <class V>
constexpr void fields(V& v, Of<Trajectory>) {
  v("description", &Trajectory::description).doc("Its description.");
  v("parametric", &Trajectory::parametric).flat().doc("Parameters and expressions.");
  v("sample_time", &Trajectory::sample_time).unit("s").above(0).doc("Time between its samples.");
  v("segments", &Trajectory::segments).doc("Segments, in order.");
  v("along", &Trajectory::along)
      .doc("Edges of a solid that the segments follow when the solid changes.");
}

}  // namespace robomosp::model
