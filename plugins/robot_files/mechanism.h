// SPDX-License-Identifier: Apache-2.0
// Content of a robot file of another program, independent of its format (layer: plugin, std only).
// Metres, kilograms, radians; frames at rest, with all joint values 0.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::robot_files {

struct MeshFile;

inline constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// A visual or collision shape; box, cylinder, capsule and ellipsoid are about the origin, axis z.
struct Shape {
  enum class Kind : std::uint8_t { box, cylinder, sphere, capsule, ellipsoid, mesh };
  Kind kind = Kind::box;
  /// box: x y z; cylinder, capsule: radius, length (of the capsule without its caps); sphere:
  /// radius; ellipsoid: the three half axes [m].
  Vec3 size{};
  std::string path;  ///< mesh: its file, or its name if it is embedded in the robot's file
  std::shared_ptr<const MeshFile> mesh;  ///< embedded in the robot's file; null for a separate file
  Vec3 scale{1, 1, 1};                   ///< mesh
  Pose pose;                             ///< body_T_shape
  std::optional<Colour> colour;
};

struct Joint {
  enum class Kind : std::uint8_t {
    revolute,
    prismatic,
    universal,
    cylindrical,
    planar,
    spherical,
    free
  };
  std::string name;
  Kind kind = Kind::revolute;
  Vec3 anchor{};                                   ///< a point of the axis, body frame [m]
  Vec3 axis{0, 0, 1};                              ///< body frame
  double lower = -kUnlimited, upper = kUnlimited;  ///< [rad or m]
  double max_velocity = kUnlimited, max_force = kUnlimited;
  double max_acceleration = kUnlimited, max_jerk = kUnlimited;
  double viscous = 0, coulomb = 0, armature = 0, stiffness = 0, rest = 0;
  double coulomb_negative = -1;  ///< magnitude for the other direction; < 0 = as `coulomb`
  std::string follows;           ///< name of the joint it follows: q = ratio q_of + offset
  double ratio = 1, offset = 0;
  bool passive = false;
};

/// A body with its parent; several joints act in sequence. Without joints it is fixed.
struct Body {
  std::string name;
  std::int32_t parent = -1;  ///< index in any order; -1 = the ground
  Pose rest;                 ///< parent_T_body
  std::vector<Joint> joints;
  std::optional<MassProperties> mass;  ///< in the body's frame
  std::vector<Shape> shapes;
};

struct Loop {
  std::string name;
  const char* kind = "weld";  ///< point, revolute, planar or weld
  std::int32_t a = -1, b = -1;
  Pose in_a, in_b;
};

/// Values of all joints: one number, a quaternion w x y z, or a position and a quaternion.
struct NamedPose {
  std::string name;
  std::vector<std::pair<std::string, std::vector<double>>> values;  ///< joint, its coordinates
};

struct Mechanism {
  std::string name;
  std::vector<Shape> ground;
  std::optional<MassProperties> ground_mass;  ///< of the base, in its frame
  std::vector<Body> bodies;
  std::vector<Loop> loops;
  std::vector<NamedPose> poses;
  std::vector<std::string> notes;
};

}  // namespace robomosp::robot_files
