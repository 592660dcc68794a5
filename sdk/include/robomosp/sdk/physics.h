// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.physics/1: rigid bodies with contact, in fixed deterministic steps
// (layer: contract, std only).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// One body of the physical world.
struct PhysicsBody {
  ShapedBody shape;     ///< in the body's frame; no shapes = no contact
  MassProperties mass;  ///< in the body's frame; mass 0 = immovable, or moved by move()
  Pose pose;            ///< world_T_body at the start
  Vec3 velocity{}, angular_velocity{};
  double friction = 0.5;     ///< Coulomb coefficient [-]
  double restitution = 0.0;  ///< 0..1 [-]
  std::uint32_t group = 0;   ///< bodies of one group (a robot) touch only where `self` is set
  bool self = false;
  Room room{};
};

/// A joint between two bodies; body -1 = the world. The axis is z of `in_a`.
struct PhysicsJoint {
  std::int32_t a = -1, b = -1;
  /// 0 revolute, 1 prismatic, 2 fixed, 3 ball, 4 the directions of `fixed` (a closed loop)
  std::int32_t type = 0;
  Pose in_a, in_b;              ///< joint frame in either body
  double lower = 0, upper = 0;  ///< [rad or m]; lower > upper = unlimited
  double viscous = 0;           ///< [N m s/rad or N s/m]
  double coulomb = 0;           ///< [N m or N]
  double armature = 0;          ///< motor inertia seen at the joint [kg m^2 or kg]
  /// The earlier joint that a revolute or prismatic one follows, q = ratio * q_of + offset; -1 =
  /// none.
  std::int32_t follows = -1;
  double ratio = 1, offset = 0;
  std::uint32_t fixed = 0;  ///< of type 4: LoopDirection (robot_model.h), axes of `in_a`
  Room room{};
};

/// State of all bodies, body-fastest, and of the joints; empty spans are not filled.
struct PhysicsState {
  std::uint32_t struct_size = sizeof(PhysicsState);  ///< see plugin.h
  std::span<Pose> poses;
  std::span<Vec3> velocities, angular_velocities;
  std::span<double> joint_positions, joint_velocities;  ///< [rad or m, per s]
};

/// A point where two bodies touched in the last step.
struct PhysicsContact {
  std::int32_t a = -1, b = -1;  ///< bodies
  Vec3 point{}, normal{};       ///< in the world; the normal points to body a
  double depth = 0;             ///< [m]
  Vec3 force{};                 ///< on body a [N]
};

/// A running world; one thread at a time.
class PhysicsWorld {
 public:
  virtual ~PhysicsWorld() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Advances `steps` steps of `dt` [s] with joint forces held (one a joint, N m or N). Equal calls
  /// from equal states give equal bits.
  virtual Result<void> step(double dt, std::int32_t steps, std::span<const double> forces,
                            Progress&) = 0;
  virtual Result<void> read(const PhysicsState& out) const = 0;
  /// Contacts of the last step, in a fixed order.
  virtual void contacts(std::vector<PhysicsContact>& out) const = 0;
  /// Ties two bodies at their present poses (a gripper that holds); gives a number for release().
  virtual Result<std::int32_t> attach(std::int32_t a, std::int32_t b) = 0;
  virtual Result<void> release(std::int32_t attachment) = 0;
  /// Places an immovable body and gives it the velocity that contacts see (a conveyor).
  virtual Result<void> move(std::int32_t body, const Pose& pose, Vec3 velocity,
                            Vec3 angular_velocity) = 0;
  // What a simple engine need not have: it refuses joints that follow and those of type 4 as well.
  /// Lets a motor move a revolute or prismatic joint at a speed with no more than this force [N m
  /// or N] from now on, besides the forces of step(); 0 = without it.
  virtual Result<void> servo(std::int32_t /*joint*/, double /*velocity*/, double /*force*/) {
    return missing("motors of limited force");
  }
  /// A force at the origin of a body's frame and a torque, world axes, held during the next call of
  /// step() only; several add up.
  virtual Result<void> push(std::int32_t /*body*/, Vec3 /*force*/, Vec3 /*torque*/) {
    return missing("forces on single bodies");
  }
  /// Two bodies never touch from now on.
  virtual Result<void> ignore(std::int32_t /*a*/, std::int32_t /*b*/) {
    return missing("pairs of bodies that do not touch");
  }

 private:
  static Error missing(const char* what) {
    return error(ErrorCode::unsupported, std::string("this physics engine has no ") + what,
                 "Choose another engine: engine = \"ode\".");
  }
};

/// Interface robomosp.physics/1.
class PhysicsEngine {
 public:
  using Interface = PhysicsEngine;
  static constexpr const char* kInterfaceId = "robomosp.physics/1";
  virtual ~PhysicsEngine() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  virtual Result<std::unique_ptr<PhysicsWorld>> create(std::span<const PhysicsBody> bodies,
                                                       std::span<const PhysicsJoint> joints,
                                                       Vec3 gravity, const Params&) const = 0;
};

}  // namespace robomosp
