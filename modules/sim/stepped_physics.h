// SPDX-License-Identifier: Apache-2.0
// Contact physics coupled to another run: the caller provides the motion of the robots, and reads
// the poses of the objects (layer: application, sim).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sim/motion_reference.h"
#include "sim/physics.h"

namespace robomosp::sim {

/// Motions of robots, by their indices in the world.
class RobotWays {
 public:
  virtual ~RobotWays() = default;
  /// q, and qd in the joints' velocities.
  virtual void at(std::size_t robot, double t, MotionReference::Sample& out) const = 0;
  /// True if it is at rest from t [s] on, as far as known.
  [[nodiscard]] virtual bool stands(std::size_t robot, double t) const = 0;
};

/// Steps of constant length from t = 0 on. Robots follow their motions regardless of contact, as if
/// their motors had no limit. Objects by their indices in the world. One thread.
class SteppedPhysics {
 public:
  /// Uses world, step, friction, restitution, objects and engine of the run. Objects attached to
  /// robots at the start (world.attach) are held. The simulator must outlive it.
  static Result<std::unique_ptr<SteppedPhysics>> create(const Simulator&, PhysicsRun, Progress&);
  ~SteppedPhysics();

  /// The last whole step [s].
  [[nodiscard]] double now() const;
  [[nodiscard]] double step() const;
  /// Runs all whole steps up to t [s]. Errors: the engine's; cancelled.
  Result<void> go_to(double t, const RobotWays&, Progress&);
  /// True if it has a mass and is not fixed.
  [[nodiscard]] bool is_movable(std::size_t object) const;
  /// world_T_object at t [s], which is not before the last whole step: extrapolated from there with
  /// its velocity.
  [[nodiscard]] Pose pose(std::size_t object, double t) const;
  /// Attaches an object to a link (`joint` of the robot's model, -1 = its base) at their current
  /// poses; an object that cannot move by itself is carried.
  Result<void> hold(std::size_t object, std::size_t robot, std::int32_t joint,
                    const Pose& joint_T_object);
  /// Releases an object; no effect if it is not held.
  Result<void> let_go(std::size_t object);
  /// Properties of the world that the engine does not support, and notes of its steps; grows with
  /// them.
  [[nodiscard]] const std::vector<std::string>& notes() const;

 private:
  struct Parts;
  explicit SteppedPhysics(std::unique_ptr<Parts>);
  std::unique_ptr<Parts> parts_;
};

}  // namespace robomosp::sim
