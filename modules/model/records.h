// SPDX-License-Identifier: Apache-2.0
// The records a user can save: materials, solids, objects, robots, trajectories, worlds, tasks
// (layer: data processing). Plain values; other records are named by id only. SI and radians.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/robot_model.h>

#include "kernel/ids.h"

namespace robomosp::model {

/// How the three angles of a Placement make a rotation matrix.
enum class AngleNotation : std::uint8_t {
  rpy,  ///< roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll), angles given (roll, pitch, yaw)
  xyz,  ///< R = Rx(a) Ry(b) Rz(c)
  zyz,  ///< R = Rz(a) Ry(b) Rz(c)
};

/// What the three numbers of a Placement's position are.
enum class PositionNotation : std::uint8_t {
  cartesian,    ///< x, y, z [m]
  cylindrical,  ///< radius [m], angle about z from x [rad], z [m]
  spherical,    ///< radius [m], angle about z from x [rad], angle from z [rad]
};

/// A placement as the user wrote it; `pose()` in model/placement.h turns it into a matrix.
struct Placement {
  Vec3 position{};  ///< by `coordinates` [m, rad]
  Vec3 angles{};    ///< [rad]
  AngleNotation notation = AngleNotation::rpy;
  PositionNotation coordinates = PositionNotation::cartesian;
  bool operator==(const Placement&) const = default;
};

/// A named number that expressions of its record may use; worlds' parameters are known to all
/// records as `world.name`.
struct Parameter {
  std::string name;
  std::string expression;  ///< "" = a plain number
  std::string unit;        ///< SI; "" = dimensionless
  double value = 0;        ///< [unit]; of the expression, when there is one
  std::string description;
  bool operator==(const Parameter&) const = default;
};

/// Parameters of a record, and which of its numbers are expressions over them: path as in the set
/// commands ("bore.radius", "chord") -> expression. The numbers hold the last values.
struct Parametric {
  std::vector<Parameter> parameters;
  std::map<std::string, std::string> expressions;
  bool operator==(const Parametric&) const = default;
};

/// Values measured on the real thing; they replace the computed ones, which stay known.
struct MeasuredMass {
  MassProperties mass;  ///< in the record's frame
  std::string source;   ///< how and by whom
};

/// A chosen provider with the values given for its parameters, by name. Empty name = the default.
struct ProviderChoice {
  using Param = std::variant<bool, std::int64_t, double, std::string, std::vector<double>>;
  std::string name;
  std::map<std::string, Param> params;  ///< SI
  bool operator==(const ProviderChoice&) const = default;
};

struct Material {
  std::string description;
  std::string source;              ///< where the density comes from
  double density = 1000;           ///< [kg/m^3]; 0 = a look without mass
  Colour colour;                   ///< base (diffuse) colour, sRGB; a = opacity
  double shininess = 0.3;          ///< 0 matt .. 1 mirror-like
  double metalness = 0.0;          ///< 0 paint or plastic .. 1 bare metal
  std::optional<Colour> ambient;   ///< colour in the shade; none = the base colour
  std::optional<Colour> specular;  ///< colour of highlights; none = by metalness
  Colour emission{0, 0, 0, 1};     ///< light of its own
};

/// One node of a solid's CSG tree, flat, parents before children.
struct SolidNode {
  CsgKind kind = CsgKind::box;
  std::string name;               ///< unique within the solid; how commands address the node
  std::int32_t parent = -1;       ///< index of the parent, -1 for the root (node 0)
  Placement placement;            ///< parent_T_node
  std::array<double, 6> sizes{};  ///< in order of kCsgNodes [m, rad or 1]
  std::shared_ptr<const CsgProfile> profile{};    ///< of a prism or revolution
  std::shared_ptr<const CsgGeometry> geometry{};  ///< of an imported node
  std::string select{};                           ///< edges of a fillet or chamfer, see CsgNode
  ProviderChoice primitive{};                     ///< of a custom node (robomosp.primitive/1)
  bool is_global = false;                         ///< placement is solid_T_node
};

struct Solid {
  std::string description;
  MaterialId material;  ///< may be none: then the solid has no mass
  double chord = 1e-4;  ///< tessellation: greatest chord distance [m]
  std::vector<SolidNode> nodes;
  Parametric parametric;
  std::optional<MeasuredMass> measured;
};

/// A part of an object: a solid or another object at a place.
struct ObjectPart {
  std::string name;
  AnyId what;           ///< solid or object
  Placement placement;  ///< object_T_part
  MaterialId material;  ///< overrides the solid's own; may be none
};

/// What happens where parts overlap.
enum class Overlap : std::uint8_t {
  once,  ///< shared volume counts once, for the part listed first
  sum,   ///< every part counts in full
};

struct Object {
  std::string description;
  Overlap overlap = Overlap::once;
  std::vector<ObjectPart> parts;
  Parametric parametric;
  std::optional<MeasuredMass> measured;
};

enum class Convention : std::uint8_t { dh, mdh };

/// One row of a Denavit-Hartenberg table. The joint's variable adds to theta (revolute) or d
/// (prismatic). Standard (dh): link i = Rz(theta) Tz(d) Tx(a) Rx(alpha) after link i-1.
/// Modified (mdh, Craig): link i = Rx(alpha) Tx(a) Rz(theta) Tz(d) after link i-1.
struct DhRow {
  double a = 0;      ///< [m]
  double alpha = 0;  ///< [rad]
  double d = 0;      ///< [m]
  double theta = 0;  ///< [rad]
  bool operator==(const DhRow&) const = default;
};

/// How a link moves in its parent. The axis of one-axis joints is z of the joint's frame.
enum class JointKind : std::uint8_t {
  revolute,
  prismatic,
  fixed,
  universal,    ///< turns about z, then about the new x: two coordinates [rad]
  cylindrical,  ///< slides along z [m], turns about z [rad]
  planar,       ///< slides along x and y [m], turns about z [rad]
  spherical,    ///< unit quaternion w x y z
  free,         ///< position x y z [m], then the quaternion w x y z; of a floating base
};

/// Motor and friction, at the motor side as published (joint side = times G or G^2).
struct Drive {
  double motor_inertia = 0;     ///< Jm [kg m^2]
  double gear_ratio = 1;        ///< G, may be negative
  double viscous = 0;           ///< B [N m s/rad]
  double coulomb_positive = 0;  ///< Tc+ >= 0 [N m]
  double coulomb_negative = 0;  ///< Tc- <= 0 [N m]
  bool operator==(const Drive&) const = default;
};

/// A spring across a joint of one coordinate.
struct Spring {
  double stiffness = 0;  ///< [N m/rad or N/m]
  double rest = 0;       ///< [rad or m]
  bool operator==(const Spring&) const = default;
};

/// The joint follows the joint of an earlier link: q = ratio * q_of + offset.
struct Mimic {
  std::int32_t link = -1;  ///< index of the link whose joint is followed
  double ratio = 1;        ///< [1, m/rad or rad/m]
  double offset = 0;       ///< [rad or m]
  bool operator==(const Mimic&) const = default;
};

/// A designed body: an object or solid at a place in the link's frame.
struct BodyPart {
  AnyId what;           ///< object or solid
  Placement placement;  ///< link_T_part
};

struct Link {
  std::string name;
  std::int32_t parent = -1;  ///< index of the parent link (< own index), -1 = base
  JointKind joint = JointKind::revolute;
  DhRow row;
  std::optional<Convention> convention;  ///< of this row; none = the robot's
  /// Instead of a row: parent-link_T_link at rest, with the joint's axis in the link's frame.
  std::optional<Placement> origin;
  Vec3 axis{0, 0, 1};          ///< unit vector; counts only with an origin
  std::optional<Mimic> mimic;  ///< of a joint of one coordinate
  bool passive = false;        ///< has no motor
  double lower = -std::numeric_limits<double>::infinity();  ///< [rad or m]
  double upper = std::numeric_limits<double>::infinity();
  double max_velocity = std::numeric_limits<double>::infinity();
  double max_acceleration = std::numeric_limits<double>::infinity();
  double max_jerk = std::numeric_limits<double>::infinity();   ///< [rad/s^3 or m/s^3]
  double max_force = std::numeric_limits<double>::infinity();  ///< torque or force [N m or N]
  Drive drive;
  Spring spring;
  std::optional<MassProperties> given;  ///< published values, in the link frame
  std::vector<BodyPart> parts;
  bool visible = true;
};

/// Where the links' masses come from.
enum class MassSource : std::uint8_t {
  given,     ///< the published values of the links; links without them have no mass
  designed,  ///< the designed parts; links without parts fall back to the given values
};

/// A named joint vector, such as "home" or "ready".
struct NamedPose {
  std::string name;
  std::vector<double> q;  ///< the model's coordinates [rad, m or 1]
};

/// What a loop closure holds together, in the frame on link a.
enum class LoopKind : std::uint8_t {
  point,     ///< the origins meet (a ball joint)
  revolute,  ///< and the z axes are one (a hinge)
  planar,    ///< the origins meet in x and y (a hinge of a plane mechanism)
  weld,      ///< the frames are one
};

/// Closes a loop: a frame on one link stays with a frame on another.
struct LoopClosure {
  std::string name;
  LoopKind kind = LoopKind::revolute;
  std::int32_t link_a = -1, link_b = -1;  ///< -1 = base
  Placement in_a, in_b;                   ///< link_T_frame
};

/// A tool frame on a link, with what hangs there.
struct RobotTool {
  std::string name;
  std::int32_t link = -1;                 ///< -1 = base
  Placement placement;                    ///< link_T_tool
  std::optional<MassProperties> payload;  ///< in the tool's frame
};

/// Whether collision checks look at a pair of bodies, against what they would do by themselves. A
/// robot's bodies are named by link, or "base"; a world's are "table", "arm.forearm", "arm.base",
/// and "arm" stands for all of them. A name that nothing has is without effect.
struct PairRule {
  std::string a, b;
  bool is_allowed = true;  ///< to touch: the pair is passed over; false = it is always checked
  std::string reason;      ///< why, for people
  bool operator==(const PairRule&) const = default;
};

struct Robot {
  std::string description;
  std::string source;  ///< where the parameters come from
  Convention convention = Convention::dh;
  MassSource mass_source = MassSource::given;
  Placement base;  ///< mounting_T_base (a world adds its own placement before it)
  std::vector<BodyPart> base_parts;
  std::vector<Link> links;                ///< parents before children
  Placement tool;                         ///< last link_T_tool
  std::optional<MassProperties> payload;  ///< carried at `tool`, in the tool's frame
  std::vector<RobotTool> tools;           ///< further tools
  std::vector<LoopClosure> loops;
  std::vector<NamedPose> poses;
  std::vector<PairRule> pair_rules;  ///< of its own bodies
  ProviderChoice ik, inverse_dynamics, forward_dynamics, controller;
  Colour skin_colour{0.93F, 0.93F, 0.91F, 1.0F};  ///< generated bodies: tubes
  Colour skin_accent{0.20F, 0.21F, 0.23F, 1.0F};  ///< generated bodies: joints
  Parametric parametric;
};

/// How a segment follows the one before it. Where the two do not meet in position, orientation or
/// velocity, a smooth piece is put between them.
struct Transition {
  bool is_smooth = true;  ///< false = none: the two must meet, and the velocity may jump
  double distance = 0;    ///< of the cut from the corner on both sides, along the path [m]; 0 = by
                          ///< the neighbours' lengths
  double speed = 0;       ///< greatest within the piece [m/s]; 0 = of the neighbours
  bool operator==(const Transition&) const = default;
};

/// A segment of a trajectory: a shape (a provider of robomosp.curve/1, segment/1 or
/// joint_segment/1) with its control poses or joint vectors; or another trajectory, run again.
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

struct Trajectory {
  std::string description;
  double sample_time = 0.01;  ///< default time between samples [s]
  std::vector<TrajectorySegment> segments;
};

}  // namespace robomosp::model

#include "model/task.h"

namespace robomosp::model {

struct PlacedObject {
  std::string name;     ///< unique in the world
  AnyId what;           ///< object or solid
  Placement placement;  ///< world_T_object
};
struct PlacedRobot {
  std::string name;
  RobotId robot;
  Placement placement;    ///< world_T_mounting
  std::vector<double> q;  ///< joint values shown; empty = the pose "home" or zeros
};
struct PlacedTrajectory {
  std::string name;
  TrajectoryId trajectory;
  Placement placement;  ///< world_T_trajectory
};

struct World {
  std::string description;
  Vec3 gravity{0, 0, -9.81};  ///< [m/s^2]
  std::vector<PlacedObject> objects;
  std::vector<PlacedRobot> robots;
  std::vector<PlacedTrajectory> trajectories;
  std::vector<PlacedFrame> frames;
  std::vector<PlacedLight> lights;
  std::vector<PlacedTask> tasks;
  std::vector<Signal> signals;
  std::vector<Attachment> attachments;  ///< at most one an object
  std::vector<PairRule> pair_rules;
  Parametric parametric;  ///< its parameters are known to all records as `<name>.<parameter>`
};

using Body = std::variant<Material, Solid, Object, Robot, Trajectory, World, Task>;

/// A record: a name, unique per kind, and its content. Immutable once in a document.
struct Record {
  std::string name;
  std::string file;  ///< where it was loaded from or saved to; "" = never
  Body body;
  [[nodiscard]] Kind kind() const { return static_cast<Kind>(body.index()); }
};

/// Kind of a record type: kind_of<Solid> == Kind::solid.
template <class R>
struct KindOf;
template <>
struct KindOf<Material> {
  static constexpr Kind value = Kind::material;
};
template <>
struct KindOf<Solid> {
  static constexpr Kind value = Kind::solid;
};
template <>
struct KindOf<Object> {
  static constexpr Kind value = Kind::object;
};
template <>
struct KindOf<Robot> {
  static constexpr Kind value = Kind::robot;
};
template <>
struct KindOf<Trajectory> {
  static constexpr Kind value = Kind::trajectory;
};
template <>
struct KindOf<World> {
  static constexpr Kind value = Kind::world;
};
template <>
struct KindOf<Task> {
  static constexpr Kind value = Kind::task;
};
template <class R>
inline constexpr Kind kind_of = KindOf<R>::value;

/// Calls fn(AnyId, std::string_view field) for every record that `body` refers to, in order.
template <class Fn>
void for_each_reference(const Body& body, Fn&& fn);

}  // namespace robomosp::model

#include "model/references.inl"
