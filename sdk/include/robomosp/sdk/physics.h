// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.physics/1: rigid bodies with contact, in fixed deterministic steps
// (layer: contract, std only).
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// One body of the physical world.
struct PhysicsBody {
  const Mesh* shape = nullptr;  ///< closed mesh in the body's frame; nullptr = no contact
  MassProperties mass;          ///< in the body's frame; mass 0 = immovable
  Pose pose;                    ///< world_T_body at the start
  Vec3 velocity{}, angular_velocity{};
  double friction = 0.5;     ///< Coulomb coefficient [-]
  double restitution = 0.0;  ///< 0..1 [-]
};

/// A joint between two bodies; body -1 = the world. The axis is z of `in_a`.
struct PhysicsJoint {
  std::int32_t a = -1, b = -1;
  std::int32_t type = 0;        ///< 0 revolute, 1 prismatic, 2 fixed
  Pose in_a, in_b;              ///< joint frame in either body
  double lower = 0, upper = 0;  ///< [rad or m]; lower > upper = unlimited
};

/// State of all bodies, body-fastest.
struct PhysicsState {
  std::span<Pose> poses;
  std::span<Vec3> velocities, angular_velocities;
};

/// A running world; one thread at a time.
class PhysicsWorld {
 public:
  virtual ~PhysicsWorld() = default;
  /// Advances `steps` steps of `dt` [s] with joint forces held (one a joint, N m or N).
  virtual Result<void> step(double dt, std::int32_t steps, std::span<const double> forces,
                            Progress&) = 0;
  virtual void read(const PhysicsState& out) const = 0;
};

/// Interface robomosp.physics/1.
class PhysicsEngine {
 public:
  using Interface = PhysicsEngine;
  static constexpr const char* kInterfaceId = "robomosp.physics/1";
  virtual ~PhysicsEngine() = default;
  virtual Result<std::unique_ptr<PhysicsWorld>> create(std::span<const PhysicsBody> bodies,
                                                       std::span<const PhysicsJoint> joints,
                                                       Vec3 gravity, const Params&) const = 0;
};

}  // namespace robomosp
