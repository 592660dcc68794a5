// SPDX-License-Identifier: Apache-2.0
// A robot of a physical world: its desired motion, the links and joints simulated by the engine,
// and the forces on them (layer: application, sim).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/physics.h>

#include "robotics/maker_axes.h"
#include "sim/motion_reference.h"
#include "sim/physics.h"

namespace robomosp::sim {

/// The path of a robot: actions of the run in sequence, at rest between them.
class RobotPath {
 public:
  RobotPath(std::shared_ptr<const RobotModel> model, std::vector<double> start);

  [[nodiscard]] bool is_empty() const { return pieces_.empty(); }
  [[nodiscard]] double end() const { return pieces_.empty() ? 0 : pieces_.back().end; }
  [[nodiscard]] const std::vector<double>& last() const {
    return pieces_.empty() ? start_ : pieces_.back().to;
  }
  [[nodiscard]] const std::vector<double>& start() const { return start_; }
  /// Closes the loops first; an error if that is impossible.
  Result<void> start_at(std::vector<double> q);
  /// The minimum-jerk quintic; for a robot with loops, of the joints with motors, and the others
  /// follow.
  Result<void> add(double begin, double duration, const std::vector<double>& to);
  Result<void> add(double begin, MotionReference motion);
  /// External source of the motion from now on, instead of actions.
  using Leader = std::function<void(double t, MotionReference::Sample&)>;
  void follow(Leader leader) { leader_ = std::move(leader); }
  Result<void> at(double t, MotionReference::Sample& s) const;

 private:
  struct Piece {
    double begin, end;
    std::vector<double> from, to;
    std::optional<MotionReference> motion;  ///< empty = the quintic
  };
  [[nodiscard]] Result<std::vector<double>> closed(const std::vector<double>& from,
                                                   const std::vector<double>& to) const;
  static void quintic(const Piece& piece, double t, MotionReference::Sample& s);
  std::shared_ptr<const RobotModel> model_;
  std::vector<double> start_;
  std::vector<Piece> pieces_;
  Leader leader_;
  std::vector<bool> held_;              ///< velocities of joints with motors
  mutable std::vector<double> branch_;  ///< closed configuration at the previous time
};

/// A joint that grips with a force instead of following the robot's motion.
struct PhysicsGrip {
  std::size_t joint = 0;        ///< of the model
  double force = 0, speed = 0;  ///< [N or N m], with the sign as direction; [m/s or rad/s] > 0
  bool is_on = false;
};

/// Places a body that the engine does not move, so that it reaches `to` in `dt` [s].
Result<void> move_body(PhysicsWorld& world, const std::string& provider, std::int32_t body,
                       const Pose& from, const Pose& to, double dt);

struct PhysicsActor {
  const model::PlacedRobot* placed = nullptr;
  const model::Robot* record = nullptr;
  std::shared_ptr<const robotics::MakerAxes> axes;  ///< of the robot's maker, for messages
  std::shared_ptr<const RobotModel> model;
  PhysicsRobotSettings settings;
  Pose world_T_base;
  std::optional<RobotPath> path;
  std::int32_t base_body = 0;           ///< joint j moves body base_body + 1 + j
  std::vector<bool> is_dynamic;         ///< of joint j: the engine simulates its body
  std::vector<std::int32_t> joint;      ///< the engine's joint of joint j, -1 = none
  std::vector<double> turns;            ///< whole turns missing in the engine's angle of joint j
  std::vector<PhysicsGrip> grips;       ///< one per joint
  std::vector<Pose> now, next;          ///< base_T_joint
  std::vector<double> q, qd, tau;       ///< current values
  std::vector<double> begin;            ///< q at the start of the engine's world
  std::vector<double> memory, scratch;  ///< of the controller
  std::vector<std::size_t> cut;         ///< ticks with a clipped torque, one per entry of tau
  Bound<Controller> controller;
  bool acts = false;

  [[nodiscard]] bool is_driven() const { return settings.drive != RobotDrive::moved; }
  [[nodiscard]] double joint_value(std::size_t j, std::span<const double> of_q) const;
  /// `axis A2, joint "shoulder"`
  [[nodiscard]] std::string joint_words(std::size_t j) const;
  /// Adds or finds the grip of a joint.
  Result<std::size_t> grip_of(const std::string& joint_name, double force, double speed);
  /// Selects the bodies simulated by the engine: all links of driven robots; of moved ones the
  /// gripping joints, the joints after them and their followers.
  Result<void> choose_dynamic();
  /// Joints and closed loops between the bodies simulated by the engine; fills `joint`.
  void add_joints(std::vector<PhysicsJoint>& joints);
  /// Removes whole turns from the limits and couplings of `joints`.
  void take_turns_off(std::vector<PhysicsJoint>& joints) const;
  /// Velocities of the joints' bodies for q and qd, world axes; `now` is for q.
  void body_velocities(std::vector<Vec3>& linear, std::vector<Vec3>& angular) const;
  /// Compares the engine's angles at the start; false if whole turns were found.
  bool find_turns(std::span<const double> joint_q);
  /// Reads q and qd of the joints simulated by the engine.
  void read(std::span<const Pose> poses, std::span<const Vec3> velocities,
            std::span<const Vec3> angular_velocities, std::span<const double> joint_q,
            std::span<const double> joint_qd);
  /// Torques of the controller, springs, grips; written to `forces` and the world.
  Result<void> drive(double t, double end, double step, const std::string& provider,
                     PhysicsWorld& world, std::span<const Pose> poses, std::span<double> forces,
                     MotionReference::Sample& wanted);
  /// Places the links that the engine does not simulate, and moves them towards their pose at
  /// `end`.
  Result<void> move(double t, double end, const std::string& provider, PhysicsWorld& world,
                    MotionReference::Sample& wanted);

 private:
  Result<void> control(double t, double step, MotionReference::Sample& wanted);
};

}  // namespace robomosp::sim
