// SPDX-License-Identifier: Apache-2.0
// Contact physics that somebody else's run takes along: who leads the robots says where they are,
// and asks where the objects have come to (layer: application, sim).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sim/motion_reference.h"
#include "sim/physics.h"

namespace robomosp::sim {

/// Where robots are, by their places in the world.
class RobotWays {
 public:
  virtual ~RobotWays() = default;
  /// q, and qd in the joints' velocities.
  virtual void at(std::size_t robot, double t, MotionReference::Sample& out) const = 0;
  /// Does not move from t [s] on, as far as is known.
  [[nodiscard]] virtual bool stands(std::size_t robot, double t) const = 0;
};

/// Steps of one length from t = 0 on. Robots move along their ways whatever they meet, as if their
/// motors had no limit. Objects by their places in the world. One thread.
class SteppedPhysics {
 public:
  /// Of the run world, step, friction, restitution, objects and engine count. What the world's
  /// robots hold at the start (world.attach) is held. The simulator must outlive it.
  static Result<std::unique_ptr<SteppedPhysics>> create(const Simulator&, PhysicsRun, Progress&);
  ~SteppedPhysics();

  /// The last whole step [s].
  [[nodiscard]] double now() const;
  [[nodiscard]] double step() const;
  /// All whole steps up to t [s]. Errors: the engine's; cancelled.
  Result<void> go_to(double t, const RobotWays&, Progress&);
  /// Has a mass and is not fixed.
  [[nodiscard]] bool is_movable(std::size_t object) const;
  /// world_T_object at t [s], which is not before the last whole step: on from there with its
  /// velocity.
  [[nodiscard]] Pose pose(std::size_t object, double t) const;
  /// Ties an object to a link (`joint` of the robot's model, -1 = its base) as they stand; what
  /// cannot move by itself is taken along.
  Result<void> hold(std::size_t object, std::size_t robot, std::int32_t joint,
                    const Pose& joint_T_object);
  /// What is not held is left alone.
  Result<void> let_go(std::size_t object);
  /// What of the world is not as the engine has it, and what its steps had to say; grows with them.
  [[nodiscard]] const std::vector<std::string>& notes() const;

 private:
  struct Parts;
  explicit SteppedPhysics(std::unique_ptr<Parts>);
  std::unique_ptr<Parts> parts_;
};

}  // namespace robomosp::sim
