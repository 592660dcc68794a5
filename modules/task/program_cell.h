// SPDX-License-Identifier: Apache-2.0
// The world as seen by one run of a program: signals, texts and robots (program_cell.cpp), motions
// (program_cell_motions.cpp), targets passed without a stop (program_cell_passing.cpp), paths moved
// by additional axes (program_cell_tied.cpp) and checks of motions (program_cell_checks.cpp)
// (layer: application, task). Internal to modules/task/program_*.cpp.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/program_turns.h>

#include "kernel/text.h"
#include "model/placement.h"
#include "motion/cartesian_path.h"
#include "robotics/grip.h"
#include "robotics/kinematics.h"
#include "sim/ik_choice.h"
#include "sim/ik_reason.h"
#include "sim/joint_rates.h"
#include "spatial/passing.h"
#include "spatial/pose.h"
#include "spatial/quintic.h"
#include "spatial/rotation.h"
#include "task/program_actor.h"
#include "task/task_executor.h"

namespace robomosp::task {

using program::MotionAttributes;
using program::PlainPose;
using program::SignalValue;
using program::Target;
using text::quote;

inline constexpr double kDegree = std::numbers::pi / 180;
inline constexpr double kMillimetre = 1e-3;
inline constexpr double kSame = 1e-9;        ///< times and lengths this close are equal
inline constexpr double kSameJoints = 1e-6;  ///< sim::robot_motion treats these as equal
/// 100 % of ACC: acceleration of the tool [m/s^2] and of its rotation [rad/s^2].
inline constexpr double kFullAcceleration = 2.5, kFullTurning = 10;
/// Speed cap for motions with TIME: effectively unlimited, since joint limits bound them [m/s,
/// rad/s].
inline constexpr double kAnySpeed = 1e6;
inline constexpr double kWithin = 1 + 1e-6;  ///< of a limit
/// Tolerated overshoot of cubics between targets over a joint's greatest speed, with a note.
inline constexpr double kMostExcess = 1.1;
inline constexpr int kMostSlices = 100;  ///< of computing at one instant
inline constexpr int kTries = 5;         ///< of successively shorter transitions
inline constexpr double kPi = std::numbers::pi, kTurn = 2 * kPi;

inline Pose to_pose(const PlainPose& p) {
  Pose out;
  out.R = spatial::from_quaternion(
      {p.quaternion[0], p.quaternion[1], p.quaternion[2], p.quaternion[3]});
  for (std::size_t k = 0; k < 3; ++k) out.p[k] = p.position[k] * kMillimetre;
  return out;
}
inline PlainPose to_plain(const Pose& p) {
  PlainPose out;
  const spatial::Quaternion q = spatial::to_quaternion(p.R);
  out.quaternion = {q.w, q.x, q.y, q.z};
  for (std::size_t k = 0; k < 3; ++k) out.position[k] = p.p[k] / kMillimetre;
  return out;
}
inline std::string place(const Vec3& p) {
  std::string s = "(";
  for (std::size_t k = 0; k < 3; ++k) s += (k ? ", " : "") + text::print_rounded(p[k] * 1000);
  return s + ") mm";
}
inline bool same_pose(const Pose& a, const Pose& b) {
  const PlainPose x = to_plain(a), y = to_plain(b);
  return x == y;
}
inline double angle_between(const Pose& a, const Pose& b) {
  const spatial::Quaternion q = spatial::to_quaternion(spatial::compose(spatial::inverse(a), b).R);
  return 2 * std::atan2(std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z), std::fabs(q.w));
}
inline double distance(const Vec3& a, const Vec3& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// The world as seen by one run of a program.
class ProgramCell final : public program::World {
 public:
  ProgramCell(ProgramActor& actor, TaskExecutor& executor, double now, Progress& progress)
      : a_(actor), n_(*actor.names_), x_(executor), now_(now), progress_(progress) {}

  Result<std::optional<SignalValue>> read_signal(const program::Signal& s) override;
  Result<void> write_signal(const program::Signal& s, SignalValue v) override;

  Result<void> begin_motion(const program::Motion& m) override;
  Result<program::MotionState> motion_state(std::uint64_t number) override;
  Result<void> abort_motion(std::uint64_t number, program::AbortReason) override;
  Result<void> hold_motion(std::uint64_t number) override;
  Result<void> resume_motion(std::uint64_t number) override;

  /// After a run: ends motions that were to pass their targets if no motion follows.
  Result<void> settle();

  Result<bool> stands(std::uint64_t number) override;
  Result<bool> same_robot(std::uint32_t a, std::uint32_t b) override;

  Result<Target> robot_state(std::uint32_t robot, std::uint32_t) override;
  Result<program::PlainPose> robot_flange(std::uint32_t robot, std::uint32_t) override;
  Result<double> robot_speed(std::uint32_t robot, std::uint32_t) override;
  Result<Target> forward(const Target& given, std::uint32_t) override;
  Result<Target> inverse(const Target& given, std::uint32_t) override;

  Result<void> write_text(std::uint32_t, std::string_view piece) override;
  Result<void> log_text(std::uint32_t, const rmp_span& span, std::string_view text) override;
  Result<std::optional<std::string>> read_line(std::uint32_t) override;
  Result<void> pause(std::uint32_t process, std::string_view message) override;
  Result<std::string> read_file(std::string_view name) override;
  Result<void> write_file(std::string_view name, std::string_view bytes, bool adds) override;

 private:
  /// The robot of a motion, and the companions that have no later motion.
  [[nodiscard]] std::vector<std::size_t> moved_by(const ProgramActor::OpenMotion& open) const;
  Error has_no_files(const char* does, std::string_view name);
  Error fails(ErrorCode code, std::string message, std::string hint = {});
  Result<void> checked(Result<void> done);
  static SignalValue value_of(const program::Signal& s, double value);
  void note_once(const std::string& said);
  void tell(InspectedEvent::Kind kind, std::string message, std::string hint,
            std::vector<std::string> signals = {});

  Result<const ProgramActor::RobotUse*> robot_of(std::uint32_t symbol);
  Pose base_T_tip(std::size_t who, const TaskExecutor::Grip& tip, std::span<const double> q) const;
  /// Frame of the targets; `q` has at least the current joints of the rail.
  Result<Pose> base_T_frame(const ProgramActor::RobotUse& use, const PlainPose* given,
                            std::span<const double> q) const;
  /// Joint values [rad or m] after the rail, from a target's [degrees or mm]: by the maker's axes
  /// if the program uses them. Steps have no offset.
  Result<std::vector<double>> joints_of(std::size_t who, const std::vector<double>& given,
                                        bool is_step = false);
  /// The maker's axes of a robot if the program uses them (R_MAKER_AXES of its cell).
  const ProgramActor::CountedAxes& axes_of(std::size_t who);
  /// Value of an axis [degrees or mm] = first * joint + second, of a revolute joint.
  [[nodiscard]] std::pair<double, double> turned_by(std::size_t who, std::size_t joint);
  /// The joint value [rad or m] for an additional joint's value in the program [degrees or mm], and
  /// the inverse.
  [[nodiscard]] double joint_of_additional(std::size_t number, double value) const;
  [[nodiscard]] double additional_of_joint(std::size_t number, double q) const;
  /// Sets the joints of a robot's rail from a target.
  void set_rail(std::size_t who, const Target& given, std::span<double> q) const;
  /// The effective ADAX_CONTROL: controllers that model the rail keep the tool's path straight in
  /// the world, and so do their programs without the attribute.
  [[nodiscard]] std::int32_t control_of(const program::Motion& m, std::size_t who) const;
  /// Number of a robot's first joints that are additional axes of the program: a rail.
  [[nodiscard]] std::size_t rail_of(std::size_t who) const;
  /// base_T_carriage: the frame that carries the arm, for the first joint values of `q`.
  [[nodiscard]] Pose base_T_carriage(std::size_t who, std::span<const double> q) const;
  /// Why a robot's solver does not reach a target, in its maker's axes.
  [[nodiscard]] std::string why_not(std::size_t who, const ProgramActor::Solver& solver,
                                    const IkResult& r, const Pose& arm_T_target,
                                    std::span<const double> seed);
  /// A robot without its rail: the joints moved by solvers of its arm.
  [[nodiscard]] std::shared_ptr<RobotModel> arm_of(std::size_t who,
                                                   const TaskExecutor::Grip& tip) const;

  std::shared_ptr<const ProgramActor::Solver> solver(std::size_t who, const TaskExecutor::Grip& tip,
                                                     Result<void>& failed);
  /// Bit k is set if the arm is on the second side of choice k.
  static std::int32_t status_of(const sim::BranchNames& names, std::span<const double> q);
  [[nodiscard]] std::vector<std::int32_t> turns_of(std::size_t who, std::span<const double> q,
                                                   std::size_t rail);
  /// The tip moved by motions without TOOL.
  [[nodiscard]] Result<TaskExecutor::Grip> own_tip(const ProgramActor::RobotUse&) const;
  Result<Target> state_at(const ProgramActor::RobotUse& use, const std::vector<double>& q);
  [[nodiscard]] std::vector<double> additional_now() const;

  /// A joint angle in the requested turn, or the nearest to `seed` within the limits.
  static double turned(const JointModel& joint, double q, double seed);
  /// The configuration for a pose: with the branch and turns of a ROBTARGET, else the nearest. The
  /// joints of its rail keep the values of the seed.
  Result<std::vector<double>> configuration(std::size_t who, const TaskExecutor::Grip& tip,
                                            const Pose& base_T_target,
                                            const std::vector<double>& all, const Target* target);

  Result<void> grip(std::size_t at, bool takes);

  /// Poses as base_T_tool, and their joint values if these are given.
  struct Goal {
    bool is_joints = false;
    std::vector<double> q;
    Pose pose;
    const Target* target = nullptr;
  };
  struct Along {
    std::size_t actor = 0;
    std::vector<double> to;
    sim::RobotMotion motion;
  };
  /// Start of a motion: its robot, tool, frame and time.
  struct Beginning {
    const ProgramActor::RobotUse* use = nullptr;
    const ProgramActor::OpenMotion* before = nullptr;  ///< motion into which this one may blend
    double start = 0;
    TaskExecutor::Grip tip;
    Pose frame;
    // Of additional axes, and of ADAX_CONTROL:
    std::vector<double> rail_to;        ///< values of the joints before the chain at its end
    std::optional<std::size_t> device;  ///< the positioner to which the path is relative
    std::vector<double> device_from, device_to;  ///< its joint values at the start and the end
    TaskExecutor::Grip device_tip;
    Pose reference_from, reference_to;  ///< base_T_reference, at the motion's start and end
    std::vector<Along> along;           ///< other robots and mechanisms, and their targets
    std::vector<std::pair<std::size_t, bool>> grips;  ///< actions at its end
    std::vector<double> additional;                   ///< current values
    bool reference_is_carriage = false;
    [[nodiscard]] bool is_tied() const { return !rail_to.empty() || device.has_value(); }
  };
  Result<Goal> goal(const program::Motion& m, const Target& t, const Beginning& b,
                    const Goal& before);

  /// DEVICE: 1 is the robot itself, others are from the robot's R_DEVICES, if it has them.
  Result<const ProgramActor::RobotUse*> device_of(const MotionAttributes& at);
  /// True if a robot moves only by braking, from motions that the program has aborted itself.
  [[nodiscard]] bool is_braked(std::size_t who) const;
  Result<Beginning> beginning(const program::Motion& m);
  /// The reference of a motion's path: ADAX_CONTROL.
  Result<void> tie(const program::Motion& m, Beginning& out);

  Result<void> begin(const program::Motion& m);
  Result<void> begin(const program::Motion& m, const Beginning& b);

  // ---- PTP under TIME with C_PASS: targets passed without a stop ----
  /// All joints by cubics, with values [rad or m] and rates at both ends.
  static sim::RobotMotion cubics(std::span<const double> from, std::span<const double> from_rate,
                                 std::span<const double> to, std::span<const double> to_rate,
                                 double duration);
  /// True if the robot is before, or in, a motion with an end that depends on its successor.
  [[nodiscard]] bool can_pass(const ProgramActor::OpenMotion& open) const;
  /// Makes a motion pass its target towards the next one; returns the rates there.
  Result<std::vector<double>> pass(ProgramActor::OpenMotion& open, const std::vector<double>& next,
                                   double next_time);
  /// Called if no motion follows to pass on to. A motion from rest then runs as without C_PASS.
  Result<void> stops(ProgramActor::OpenMotion& open);
  /// Checks a motion from `from` that ends with `rate` (none = rest). If its targets require more
  /// than a joint's limits (before it, and after it by `bend` [rad/s^2 or m/s^2]), that is an
  /// error; an excess that only its cubic causes is a note.
  Result<void> keeps_limits(const ProgramActor::OpenMotion& open, std::span<const double> from,
                            const std::vector<double>& rate, double time,
                            const std::vector<double>* bend);
  [[nodiscard]] std::string place_of(const rmp_span& s) const;

  /// Checks a motion under TIME, which has no speed attribute: the joints bound it.
  Result<void> keeps_speeds(std::size_t who, const sim::RobotMotion& m, double time);

  void tell_unheeded(const MotionAttributes& at);

  /// The targets of a motion; with `solves` each has joint values. Poses are in the robot's base at
  /// the motion's end.
  Result<std::vector<Goal>> goals_of(const program::Motion& m, const Beginning& b, const Goal& from,
                                     bool solves);

  /// The segments of a motion; for PTP also the joint values at its end.
  Result<void> drive(const program::Motion& m, const Beginning& b, const Goal& begins,
                     TaskExecutor::Drive& d, std::vector<double>* end = nullptr);

  /// Starts the motion where the previous one may be left. False = impossible.
  template <class Plan>
  Result<bool> blend(std::uint64_t number, const ProgramActor::OpenMotion& before, std::size_t who,
                     ProgramActor::OpenMotion& open, Plan&& plan);

  /// Velocity of a robot's tool during a motion [m/s].
  Vec3 tip_velocity(std::size_t who, const TaskExecutor::Grip& tip,
                    const TaskExecutor::Actor& moved, double t) const;
  /// The longest time by which `next` may begin before the end of `before`, at most `overlap`, so
  /// that the tool's speed in the transition is at most C_SPEED % of the speed [s].
  double slow_crossing(const ProgramActor::OpenMotion& before, std::size_t who,
                       const sim::RobotMotion& next, double overlap);

  /// Greatest rates during a transition between motions.
  struct Crossing {
    double speed = 0, turning = 0, acceleration = 0;  ///< of the tool [m/s, rad/s, m/s^2]
    double acceleration_after = 0;                    ///< since the transition began [s]
    double joint_share = 0;                           ///< fraction of the joints' greatest speeds
  };
  /// Of `next` that begins `overlap` before the end of the robot's motions; 0 = of `next` alone.
  Crossing crossing(const TaskExecutor::Grip& tip, std::size_t who, const sim::RobotMotion& next,
                    double overlap) const;
  /// The longest time by which `next` may begin before the end of `before`, at most `overlap`, so
  /// that tool and joints never exceed the faster of the two motions' speeds [s].
  double kept_crossing(const ProgramActor::OpenMotion& before, const ProgramActor::OpenMotion& open,
                       std::size_t who, const sim::RobotMotion& next, double overlap) const;
  /// Adds a note if a transition exceeds the accelerations of its motions.
  void tell_acceleration(const ProgramActor::OpenMotion& before,
                         const ProgramActor::OpenMotion& open, const Crossing& made, double start);

  Result<sim::RobotMotion> move_along(const Along& one, double duration, double start);
  /// Effects of additional joints: grips at the motion's end, and companion joints.
  Result<void> additional(const program::Motion& m, Beginning& b);

  // ---- motions with a path relative to what additional axes move ----
  /// The motion `s` in a frame with the motion `frame`.
  static PathSample carried(const PathSample& frame, const PathSample& s);
  /// A joint's frame with a pose in it, for a robot with joints that move from one vector to
  /// another by `share`, with its time derivatives.
  static PathSample moving(const RobotModel& model, std::int32_t joint, const Pose& joint_T_at,
                           std::span<const double> from, std::span<const double> to,
                           const spatial::Jet& share);
  /// Least time of axes from one vector to another by spatial::ease, within their limits [s].
  static double least_time(const RobotModel& model, std::span<const double> from,
                           std::span<const double> to);
  /// Begins a path of a tool together with its additional axes; returns its duration [s].
  Result<double> begin_tied(const Beginning& b, const std::vector<double>& q0,
                            const TaskExecutor::Drive& d, double start, double time);

  // ---- checks ----
  /// Begins a motion and records it. A failed motion does not end the run: the robot is placed at
  /// its end if that is reachable.
  Result<void> inspect(const program::Motion& asked);
  /// Finds where along a path the robot cannot follow, and by how much.
  Result<void> look_along(const program::Motion& m, const Beginning& b, const Goal& from,
                          InspectedMotion& out);
  static ProgramActor::OpenMotion ended_at(std::size_t who, double end);
  void fails_at(InspectedMotion& out, const Error& e) const;
  void keep(InspectedMotion out);

  ProgramActor& a_;
  const ProgramActor::Names& n_;
  TaskExecutor& x_;
  double now_;
  Progress& progress_;
  MotionTrouble trouble_;  ///< of the last error of a motion, for checks
};

}  // namespace robomosp::task
