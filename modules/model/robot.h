// SPDX-License-Identifier: Apache-2.0
// Robots: links, joints, loops, tools, poses (layer: data processing, model). SI and radians.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/robot_model.h>

#include "model/basics.h"
#include "model/fields.h"
#include "model/kind.h"

namespace robomosp::model {

enum class Convention : std::uint8_t { dh, mdh };
inline constexpr std::array<std::string_view, 2> kConventionWords{"dh", "mdh"};
constexpr std::span<const std::string_view> words(Of<Convention>) { return kConventionWords; }

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
template <class V>
constexpr void fields(V& v, Of<DhRow>) {
  v("a", &DhRow::a).unit("m").range(-1e4, 1e4).doc("Length of the common normal.");
  v("alpha", &DhRow::alpha).unit("rad").doc("Twist about the common normal.");
  v("d", &DhRow::d).unit("m").range(-1e4, 1e4).doc("Offset along the joint's axis.");
  v("theta", &DhRow::theta).unit("rad").doc("Angle about the joint's axis.");
}

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
/// In order of JointKind.
inline constexpr std::array<std::string_view, 8> kJointWords{
    "revolute", "prismatic", "fixed", "universal", "cylindrical", "planar", "spherical", "free"};
constexpr std::span<const std::string_view> words(Of<JointKind>) { return kJointWords; }

/// Motor and friction, at the motor side as published (joint side = times G or G^2).
struct Drive {
  double motor_inertia = 0;     ///< Jm [kg m^2]
  double gear_ratio = 1;        ///< G, may be negative
  double viscous = 0;           ///< B [N m s/rad]
  double coulomb_positive = 0;  ///< Tc+ >= 0 [N m]
  double coulomb_negative = 0;  ///< Tc- <= 0 [N m]
  bool operator==(const Drive&) const = default;
};
template <class V>
constexpr void fields(V& v, Of<Drive>) {
  v("motor_inertia", &Drive::motor_inertia)
      .unit("kg m^2")
      .at_least(0)
      .doc("Inertia of the rotor, at the motor.");
  v("gear_ratio", &Drive::gear_ratio)
      .doc("Revolutions of the motor per revolution of the joint; negative if it reverses.");
  v("viscous", &Drive::viscous)
      .unit("N m s/rad")
      .label("viscous friction")
      .at_least(0)
      .doc("Friction that grows with the motor's speed.");
  v("coulomb_positive", &Drive::coulomb_positive)
      .unit("N m")
      .label("Coulomb friction forwards")
      .at_least(0)
      .doc("Dry friction at positive speed.");
  v("coulomb_negative", &Drive::coulomb_negative)
      .unit("N m")
      .label("Coulomb friction backwards")
      .range(-std::numeric_limits<double>::infinity(), 0)
      .doc("Dry friction at negative speed, not above 0.");
}

/// A spring across a joint of one coordinate.
struct Spring {
  double stiffness = 0;  ///< [N m/rad or N/m]
  double rest = 0;       ///< [rad or m]
  bool operator==(const Spring&) const = default;
};
template <class V>
constexpr void fields(V& v, Of<Spring>) {
  v("stiffness", &Spring::stiffness)
      .unit("N m/rad|N/m")
      .at_least(0)
      .doc("Torque per angle, or force per distance, from rest.");
  v("rest", &Spring::rest).unit("rad|m").doc("Joint value without spring force.");
}

/// The joint follows the joint of an earlier link: q = ratio * q_of + offset.
struct Mimic {
  std::int32_t link = -1;  ///< index of the followed joint's link
  double ratio = 1;        ///< [1, m/rad or rad/m]
  double offset = 0;       ///< [rad or m]
  bool operator==(const Mimic&) const = default;
};
template <class V>
constexpr void fields(V& v, Of<Mimic>) {
  v("link", &Mimic::link)
      .index_of("links")
      .needed()
      .doc("The link with the joint that is followed.");
  v("ratio", &Mimic::ratio).doc("Ratio of the coordinates.");
  v("offset", &Mimic::offset).unit("rad|m").doc("Added to the product.");
}

/// A designed body: an object or solid at a place in the link's frame.
struct BodyPart {
  AnyId what;           ///< object or solid
  Placement placement;  ///< link_T_part
};
template <class V>
constexpr void fields(V& v, Of<BodyPart>) {
  v("what", &BodyPart::what)
      .refers_to({Kind::solid, Kind::object})
      .by_kind()
      .needed()
      .doc("The placed solid or object.");
  v("placement", &BodyPart::placement).flat().doc("Its frame in the link's.");
}

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
template <class V>
constexpr void fields(V& v, Of<Link>) {
  v.alternative([](const void* l) -> std::size_t {
    return static_cast<const Link*>(l)->joint == JointKind::prismatic ? 1 : 0;
  });
  v("name", &Link::name).needed().doc("Unique within the robot.");
  v("parent", &Link::parent).index_of("links").doc("The parent link, or the base.");
  v("joint", &Link::joint).doc("Type of the joint.");
  v("row", &Link::row)
      .flat()
      .flat_value()
      .counts_if([](const void* l) { return !static_cast<const Link*>(l)->origin; })
      .doc("Denavit-Hartenberg row.");
  v("convention", &Link::convention).doc("Convention of this row; none is that of the robot.");
  v("origin", &Link::origin).doc("Instead of a row: its frame at rest in the parent's.");
  v("axis", &Link::axis)
      .counts_if([](const void* l) { return static_cast<const Link*>(l)->origin.has_value(); })
      .doc("Axis of the joint in the link's frame; used with an origin.");
  v("mimic", &Link::mimic).doc("The joint follows that of an earlier link.");
  v("passive", &Link::passive).doc("Whether the joint has no motor.");
  v("lower", &Link::lower).unit("rad|m").infinite().doc("Least joint value.");
  v("upper", &Link::upper).unit("rad|m").infinite().doc("Greatest joint value.");
  v("max_velocity", &Link::max_velocity)
      .unit("rad/s|m/s")
      .above(0)
      .infinite()
      .doc("Greatest speed of the joint.");
  v("max_acceleration", &Link::max_acceleration)
      .unit("rad/s^2|m/s^2")
      .above(0)
      .infinite()
      .doc("Greatest acceleration of the joint.");
  v("max_jerk", &Link::max_jerk)
      .unit("rad/s^3|m/s^3")
      .above(0)
      .infinite()
      .doc("Greatest jerk of the joint.");
  v("max_force", &Link::max_force)
      .unit("N m|N")
      .above(0)
      .infinite()
      .doc("Greatest torque or force of the joint.");
  v("drive", &Link::drive).flat().doc("Motor, gear and friction.");
  v("spring", &Link::spring).flat().flat_value().doc("A spring across the joint.");
  v("given", &Link::given)
      .flat()
      .doc("Published mass, centre of mass and inertia in the link's frame.");
  v("parts", &Link::parts).doc("Designed bodies of the link.");
  v("visible", &Link::visible).doc("Whether it is drawn.");
}

/// Where the links' masses come from.
enum class MassSource : std::uint8_t {
  given,     ///< the published values of the links; links without them have no mass
  designed,  ///< the designed parts; links without parts fall back to the given values
};
inline constexpr std::array<std::string_view, 2> kMassSourceWords{"given", "designed"};
constexpr std::span<const std::string_view> words(Of<MassSource>) { return kMassSourceWords; }

/// A named joint vector, such as "home" or "ready".
struct NamedPose {
  std::string name;
  std::vector<double> q;  ///< the model's coordinates [rad, m or 1]
};
template <class V>
constexpr void fields(V& v, Of<NamedPose>) {
  v("name", &NamedPose::name).needed().doc("Name such as home.");
  v("q", &NamedPose::q).unit(kByJoint).needed().doc("Joint coordinates, in each joint's unit.");
}

/// Relative motion locked by a loop closure, in the frame on link a.
enum class LoopKind : std::uint8_t {
  point,     ///< the origins meet (a ball joint)
  revolute,  ///< and the z axes coincide (a hinge)
  planar,    ///< the origins meet in x and y (a hinge of a plane mechanism)
  weld,      ///< the frames coincide
};
/// In order of LoopKind.
inline constexpr std::array<std::string_view, 4> kLoopWords{"point", "revolute", "planar", "weld"};
constexpr std::span<const std::string_view> words(Of<LoopKind>) { return kLoopWords; }

/// Closes a loop: a frame on one link stays with a frame on another.
struct LoopClosure {
  std::string name;
  LoopKind kind = LoopKind::revolute;
  std::int32_t link_a = -1, link_b = -1;  ///< -1 = base
  Placement in_a, in_b;                   ///< link_T_frame
};
template <class V>
constexpr void fields(V& v, Of<LoopClosure>) {
  v("name", &LoopClosure::name).needed().doc("Unique among the robot's loops.");
  v("kind", &LoopClosure::kind).doc("Constraint of the joint that closes the loop.");
  v("link_a", &LoopClosure::link_a).index_of("links").doc("One link, or the base.");
  v("link_b", &LoopClosure::link_b).index_of("links").doc("The other link, or the base.");
  v("a", &LoopClosure::in_a).doc("Frame of the joint in the first link.");
  v("b", &LoopClosure::in_b).doc("Frame of the joint in the other link.");
}

/// A tool frame on a link, with its payload.
struct RobotTool {
  std::string name;
  std::int32_t link = -1;                 ///< -1 = base
  Placement placement;                    ///< link_T_tool
  std::optional<MassProperties> payload;  ///< in the tool's frame
};
template <class V>
constexpr void fields(V& v, Of<RobotTool>) {
  v("name", &RobotTool::name).needed().doc("Unique among the robot's tools.");
  v("link", &RobotTool::link)
      .index_of("links")
      .needed()
      .doc("The link that carries it, or the base.");
  v("placement", &RobotTool::placement).flat().doc("Its frame in the link's.");
  v("payload", &RobotTool::payload).doc("Payload, in its frame.");
}

/// An object or solid that is mounted on a link as a tool: body, mass and centre points in one.
struct AttachedTool {
  std::string name;
  AnyId what;              ///< object or solid
  std::int32_t link = -1;  ///< -1 = base
  Placement placement;     ///< link_T_object
};
template <class V>
constexpr void fields(V& v, Of<AttachedTool>) {
  v("name", &AttachedTool::name).needed().doc("Unique among the robot's links and tools.");
  v("what", &AttachedTool::what)
      .refers_to({Kind::solid, Kind::object})
      .by_kind()
      .needed()
      .doc("The object or solid used as the tool.");
  v("link", &AttachedTool::link)
      .index_of("links")
      .needed()
      .doc("The link that it is mounted on, or the base.");
  v("placement", &AttachedTool::placement).flat().doc("The frame of the object in the link's.");
}

/// Unit of a maker's axis.
enum class AxisUnit : std::uint8_t { deg, mm };
inline constexpr std::array<std::string_view, 2> kAxisUnitWords{"deg", "mm"};
constexpr std::span<const std::string_view> words(Of<AxisUnit>) { return kAxisUnitWords; }

/// Contribution of a further joint to a maker's axis.
struct AxisCoupling {
  std::int32_t link = -1;  ///< the link of that joint
  double ratio = 1;        ///< [1]
  bool operator==(const AxisCoupling&) const = default;
};
template <class V>
constexpr void fields(V& v, Of<AxisCoupling>) {
  v("link", &AxisCoupling::link)
      .index_of("links")
      .needed()
      .doc("The link with the joint that is added.");
  v("ratio", &AxisCoupling::ratio).doc("Factor of that joint's value.");
}

/// An axis with the name, sign and limits of the robot's maker, as shown by controllers: value =
/// sign * joint + the coupled joints times their ratios + offset.
struct MakerAxis {
  std::string name;                   ///< such as "A1"
  std::int32_t link = -1;             ///< index of the link moved by the joint
  std::int32_t sign = 1;              ///< 1 or -1
  double offset = 0;                  ///< [rad or m]
  std::vector<AxisCoupling> coupled;  ///< such as joint 2 in FANUC's J3
  AxisUnit unit = AxisUnit::deg;
  bool external = false;                                    ///< an external axis of the controller
  double lower = -std::numeric_limits<double>::infinity();  ///< of its value [rad or m]
  double upper = std::numeric_limits<double>::infinity();
};
template <class V>
constexpr void fields(V& v, Of<MakerAxis>) {
  v.alternative([](const void* a) -> std::size_t {
    return static_cast<const MakerAxis*>(a)->unit == AxisUnit::mm ? 1 : 0;
  });
  v("name", &MakerAxis::name).needed().doc("The maker's name, such as A1.");
  v("link", &MakerAxis::link)
      .index_of("links")
      .needed()
      .doc("The link with the joint of the axis.");
  v("sign", &MakerAxis::sign)
      .range(-1, 1)
      .doc("1, or -1 if the axis counts in the opposite direction.");
  v("offset", &MakerAxis::offset).unit("rad|m").doc("Value of the axis at joint value 0.");
  v("coupled", &MakerAxis::coupled).doc("Coupled joints of the axis.");
  v("unit", &MakerAxis::unit).doc("deg, or mm for a prismatic joint.");
  v("external", &MakerAxis::external).doc("Whether it is an external axis of the controller.");
  v("lower", &MakerAxis::lower)
      .unit("rad|m")
      .infinite()
      .doc("Least value of the axis, if it differs from the joint's own limits.");
  v("upper", &MakerAxis::upper).unit("rad|m").infinite().doc("Greatest value of the axis.");
}

struct Robot {
  std::string description;
  std::string source;  ///< source of the parameters
  Convention convention = Convention::dh;
  MassSource mass_source = MassSource::given;
  Placement base;  ///< mounting_T_base (a world adds its own placement before it)
  std::vector<BodyPart> base_parts;
  std::optional<MassProperties> base_mass;  ///< published values, in the frame of the base
  std::vector<Link> links;                  ///< parents before children
  Placement tool;                           ///< last link_T_tool
  std::optional<MassProperties> payload;    ///< carried at `tool`, in the tool's frame
  std::vector<RobotTool> tools;             ///< further tools
  std::vector<AttachedTool> attached;       ///< objects mounted as tools
  /// Centre point of an attached tool that is the robot's tool instead of `tool`, "torch.tip", or
  /// "torch" for the object's own frame; it is on the last link. "" = `tool` counts.
  std::string tcp;
  std::vector<LoopClosure> loops;
  std::vector<NamedPose> poses;
  std::vector<MakerAxis> axes;                ///< in the controller's order; empty = not known
  std::vector<CollisionPairRule> pair_rules;  ///< of the robot's bodies
  ProviderChoice ik, inverse_dynamics, forward_dynamics, controller;
  Colour skin_colour{0.93F, 0.93F, 0.91F, 1.0F};  ///< generated bodies: tubes
  Colour skin_accent{0.20F, 0.21F, 0.23F, 1.0F};  ///< generated bodies: joints
  Parametric parametric;
};
template <class V>
constexpr void fields(V& v, Of<Robot>) {
  v("description", &Robot::description).doc("Its description.");
  v("source", &Robot::source).doc("Source of the parameters.");
  v("parametric", &Robot::parametric).flat().doc("Parameters and expressions.");
  v("convention", &Robot::convention)
      .doc("Convention of its Denavit-Hartenberg rows: standard or modified.");
  v("mass_source", &Robot::mass_source)
      .doc("Whether the links' masses are the published ones or those of the designed parts.");
  v("base", &Robot::base).doc("Pose of the base in the mounting frame.");
  v("base_parts", &Robot::base_parts).doc("Designed bodies of the base.");
  v("base_mass", &Robot::base_mass)
      .doc("Published mass, centre of mass and inertia of the base in its frame.");
  v("links", &Robot::links).by_names().doc("Links with the joint before each, parents first.");
  v("tool", &Robot::tool).doc("Frame of the tool in that of the last link.");
  v("payload", &Robot::payload).doc("Payload at the tool, in its frame.");
  v("tools", &Robot::tools).doc("Additional tools.");
  v("attached", &Robot::attached).doc("Objects mounted as tools.");
  v("tcp", &Robot::tcp)
      .doc("Centre point of an attached tool that is the robot's tool, such as torch.tip.");
  v("loops", &Robot::loops).doc("Joints that close kinematic loops.");
  v("poses", &Robot::poses).doc("Named joint vectors.");
  v("axes", &Robot::axes)
      .file("axis")
      .doc("The axes as the maker counts them, in the controller's order; none if not known.");
  v("pair_rules", &Robot::pair_rules)
      .doc("Pairs of its own bodies that may touch, or that are always checked.");
  v("ik", &Robot::ik).label("inverse kinematics").doc("Solver of the inverse kinematics.");
  v("inverse_dynamics", &Robot::inverse_dynamics).doc("Solver of the inverse dynamics.");
  v("forward_dynamics", &Robot::forward_dynamics).doc("Solver of the forward dynamics.");
  v("controller", &Robot::controller).doc("Controller of forward simulations.");
  v("skin_colour", &Robot::skin_colour).doc("Colour of generated links.");
  v("skin_accent", &Robot::skin_accent).doc("Colour of generated joints.");
}

}  // namespace robomosp::model
