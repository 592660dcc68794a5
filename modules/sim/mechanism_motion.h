// SPDX-License-Identifier: Apache-2.0
// The motion of one mechanism under forces as an initial value problem: coordinates and velocities,
// closed loops, joints held by friction or at their limits (layer: application, sim).
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/integrator.h>

#include "kernel/quiet_progress.h"
#include "sim/simulate.h"

namespace robomosp::sim {

/// Behaviour of joints at their limits.
enum class AtLimit { stop, report, ignore };

struct MotionOptions {
  bool friction = true;  ///< viscous and Coulomb friction of the joints
  double breakaway = 1;  ///< static over Coulomb friction, >= 1
  AtLimit at_limit = AtLimit::stop;
  double restitution = 0;    ///< speed after a stop over speed before, 0..1
  double rest_speed = 1e-3;  ///< a rebound slower than this comes to rest [rad/s or m/s]
  /// Torques (dof() numbers), before motor limits; null = those of set_torques().
  std::function<void(double t, std::span<double> tau)> torques;
  std::function<Result<BaseMotion>(double t)> base;  ///< null = at rest
  /// At a tip, base axes; null = none.
  std::function<Result<TipWrench>(double t, std::span<const double> q)> wrench;
  std::int32_t tip = 0;  ///< where `wrench` acts
  /// Adds forces from outside to those on the joints (dof() numbers); null = none.
  std::function<Result<void>(double t, std::span<const double> q, std::span<const double> qd,
                             std::span<double> tau)>
      outside;
  const Progress* whole = nullptr;  ///< cancels the solvers; must outlive the motion
};

/// An event at a joint, for notes.
struct MotionEvent {
  double time = 0;
  std::size_t joint = 0;  ///< index in RobotModel::joints
  enum class Kind { limit, rest, leaves, sticks, slides, report } kind = Kind::limit;
  bool is_upper = false;  ///< of limits
  double speed = 0;       ///< at which a limit was reached [rad/s or m/s]
};

/// x = (q, qd). Joints held by friction or by a stop keep qd at exactly 0: the holding force
/// follows from the mechanism's mobility. If it exceeds what friction or the stop can provide, or a
/// sliding joint comes to rest, that is an event (no smoothed sign; after Karnopp, J. Dyn. Sys.
/// Meas. Control 107, 1985, with events instead of a dead zone). One thread.
class MechanismMotion final : public OdeSystem {
 public:
  /// `dynamics` is prepared for its model, which may have loops if the provider supports them.
  MechanismMotion(Bound<ForwardDynamics> dynamics, MotionOptions options);

  [[nodiscard]] std::size_t size() const override { return coordinates_ + velocities_; }
  [[nodiscard]] std::size_t positions() const override { return coordinates_; }
  Result<void> rate(double t, std::span<const double> x, std::span<double> dx) override;
  void project(std::span<double> x) override;
  [[nodiscard]] std::size_t events() const override;
  void event_values(double t, std::span<const double> x, std::span<double> g) override;
  bool at_event(double t, std::size_t index, std::span<double> x) override;

  /// Sets constant torques (dof() numbers); used if the options have no function.
  void set_torques(std::span<const double> tau);
  /// Sets velocities that are mere rounding errors to zero where they would set the sign of Coulomb
  /// friction: for a planned state, before the first settle().
  void bring_to_rest(std::span<double> x) const;
  /// Determines which joints are held, initially and after every jump of torques.
  Result<void> settle(double t, std::span<double> x);

  /// Accelerations, and forces of friction and stops at a state: `held` is the force of stops and
  /// sticking friction on the joints, `friction` all friction as a force on the joints.
  struct Forces {
    std::vector<double> qdd, tau, friction, stop;
  };
  Result<void> forces(double t, std::span<const double> x, Forces& out);
  /// Greatest residual of the loops [m, rad].
  [[nodiscard]] double loop_error(std::span<const double> q);

  [[nodiscard]] const std::vector<MotionEvent>& happened() const { return happened_; }
  [[nodiscard]] const RobotModel& model() const { return *dynamics_.model; }
  [[nodiscard]] bool has_friction() const;
  [[nodiscard]] bool has_stops() const { return !stops_.empty(); }
  /// A failure that could not be returned where it occurred.
  [[nodiscard]] const std::optional<Error>& failure() const { return failure_; }

 private:
  /// Friction and holding of one entry of qd.
  struct Entry {
    double viscous = 0, coulomb_positive = 0, coulomb_negative = 0;
    std::size_t joint = 0;  ///< for messages
    int slides = 0;         ///< direction of Coulomb friction; 0 = at rest or none
    bool is_held = false;
    double low = 0, high = 0;  ///< range of the holding force [N m or N]
    [[nodiscard]] bool has_coulomb() const { return coulomb_positive > 0 || coulomb_negative < 0; }
  };
  struct Stop {
    std::size_t joint = 0, entry = 0, coordinate = 0;
    double ratio = 1, offset = 0, value = 0;
    bool is_upper = false, is_touched = false;
    /// Distance to the stop, > 0 inside the limit.
    [[nodiscard]] double way(std::span<const double> q) const {
      const double at = ratio * q[coordinate] + offset;
      return is_upper ? value - at : at - value;
    }
    /// Direction of qd towards the stop.
    [[nodiscard]] double into() const { return (is_upper ? 1 : -1) * (ratio < 0 ? -1.0 : 1.0); }
  };

  Result<void> evaluate(double t, std::span<const double> x);
  Result<void> mobility_columns(std::span<const double> q, const std::vector<std::size_t>& entries);
  void applied(double t, std::span<const double> qd);
  void coordinate_rates(std::span<const double> q, std::span<const double> qd,
                        std::span<double> dq) const;
  Result<void> settle(double t, std::span<double> x, std::size_t freed, int direction);
  Result<void> let_go(double t, std::size_t entry, std::span<double> x);
  void release(std::size_t entry, int direction);
  void hit(double t, Stop& stop, std::span<double> x);
  void push(std::size_t entry, double impulse_to, std::span<double> x);
  void happen(double t, MotionEvent::Kind kind, std::size_t joint, bool is_upper = false,
              double speed = 0) {
    happened_.push_back({t, joint, kind, is_upper, speed});
  }
  [[nodiscard]] static double margin(const Entry& e, double force);

  Bound<ForwardDynamics> dynamics_;
  MotionOptions options_;
  std::size_t coordinates_, velocities_, loop_rows_;
  std::vector<Entry> entries_;
  std::vector<std::size_t> watched_;  ///< entries with an event: friction or stops
  std::vector<Stop> stops_;
  std::vector<std::size_t> held_;
  std::vector<double> torques_, tau_, applied_, loaded_, qdd_, held_force_;
  std::vector<double> q_, columns_, column_q_, column_tau_, scratch_;
  std::vector<Pose> frames_;
  std::vector<double> residual_, jacobian_;
  std::vector<MotionEvent> happened_;
  std::optional<Error> failure_;
  QuietProgress quiet_;
};

}  // namespace robomosp::sim
