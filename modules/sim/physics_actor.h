// SPDX-License-Identifier: Apache-2.0
// A robot of a physical world: where it is to be over time, which of its links the engine moves, by
// which joints, and the forces on them (layer: application, sim).
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

/// The way of a robot: lines of the run one after the other, at rest between them.
class RobotPath {
 public:
  RobotPath(std::shared_ptr<const RobotModel> model, std::vector<double> start);

  [[nodiscard]] bool is_empty() const { return pieces_.empty(); }
  [[nodiscard]] double end() const { return pieces_.empty() ? 0 : pieces_.back().end; }
  [[nodiscard]] const std::vector<double>& last() const {
    return pieces_.empty() ? start_ : pieces_.back().to;
  }
  [[nodiscard]] const std::vector<double>& start() const { return start_; }
  /// Loops are closed first; an error where they cannot be.
  Result<void> start_at(std::vector<double> q);
  /// The quintic of minimum jerk; of a robot with loops the joints with motors, and the others
  /// follow.
  Result<void> add(double begin, double duration, const std::vector<double>& to);
  Result<void> add(double begin, MotionReference motion);
  /// Where somebody else says from now on, instead of along lines.
  using Leader = std::function<void(double t, MotionReference::Sample&)>;
  void follow(Leader leader) { leader_ = std::move(leader); }
  Result<void> at(double t, MotionReference::Sample& s) const;

 private:
  struct Piece {
    double begin, end;
    std::vector<double> from, to;
    std::optional<MotionReference> motion;  ///< none = the quintic
  };
  [[nodiscard]] Result<std::vector<double>> closed(const std::vector<double>& from,
                                                   const std::vector<double>& to) const;
  static void quintic(const Piece& piece, double t, MotionReference::Sample& s);
  std::shared_ptr<const RobotModel> model_;
  std::vector<double> start_;
  std::vector<Piece> pieces_;
  Leader leader_;
  std::vector<bool> held_;              ///< velocities of joints with motors
  mutable std::vector<double> branch_;  ///< closed configuration of the time before
};

/// A joint that grips with a force instead of following the robot's motion.
struct PhysicsGrip {
  std::size_t joint = 0;        ///< of the model
  double force = 0, speed = 0;  ///< [N or N m], the sign says where to; [m/s or rad/s] > 0
  bool is_on = false;
};

/// Places a body that the engine does not move, and lets it be at `to` in `dt` [s].
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
  std::vector<bool> is_dynamic;         ///< of joint j: the engine moves its body
  std::vector<std::int32_t> joint;      ///< the engine's joint of joint j, -1 = none
  std::vector<double> turns;            ///< what the engine's angle of joint j lacks, whole turns
  std::vector<PhysicsGrip> grips;       ///< one a joint
  std::vector<Pose> now, next;          ///< base_T_joint
  std::vector<double> q, qd, tau;       ///< as they are
  std::vector<double> begin;            ///< q where the engine's world began
  std::vector<double> memory, scratch;  ///< of the controller
  std::vector<std::size_t> cut;         ///< ticks with a torque cut, one an entry of tau
  Bound<Controller> controller;
  bool acts = false;

  [[nodiscard]] bool is_driven() const { return settings.drive != RobotDrive::moved; }
  [[nodiscard]] double joint_value(std::size_t j, std::span<const double> of_q) const;
  /// `axis A2, joint "shoulder"`
  [[nodiscard]] std::string joint_words(std::size_t j) const;
  /// Adds or finds the grip of a joint.
  Result<std::size_t> grip_of(const std::string& joint_name, double force, double speed);
  /// What the engine moves: all links of driven robots; of moved ones the joints that grip, what
  /// stands on them and what follows them.
  Result<void> choose_dynamic();
  /// Joints and closed loops between the bodies that the engine moves; fills `joint`.
  void add_joints(std::vector<PhysicsJoint>& joints);
  /// Whole turns that limits and couplings of `joints` must do without.
  void take_turns_off(std::vector<PhysicsJoint>& joints) const;
  /// Velocities of the joints' bodies that belong to q and qd, world axes; `now` is that of q.
  void body_velocities(std::vector<Vec3>& linear, std::vector<Vec3>& angular) const;
  /// Compares the engine's angles at the start; false where turns were found.
  bool find_turns(std::span<const double> joint_q);
  /// q and qd of what the engine moves.
  void read(std::span<const Pose> poses, std::span<const Vec3> velocities,
            std::span<const Vec3> angular_velocities, std::span<const double> joint_q,
            std::span<const double> joint_qd);
  /// Torques of the controller, springs, grips; into `forces` and the world.
  Result<void> drive(double t, double end, double step, const std::string& provider,
                     PhysicsWorld& world, std::span<const Pose> poses, std::span<double> forces,
                     MotionReference::Sample& wanted);
  /// Places the links that the engine does not move and lets them move to where they are at `end`.
  Result<void> move(double t, double end, const std::string& provider, PhysicsWorld& world,
                    MotionReference::Sample& wanted);

 private:
  Result<void> control(double t, double step, MotionReference::Sample& wanted);
};

}  // namespace robomosp::sim
