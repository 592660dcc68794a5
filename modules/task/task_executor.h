// SPDX-License-Identifier: Apache-2.0
// The robots, objects and signals of a world while tasks run, with their history (layer:
// application, task).
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "kernel/expression.h"
#include "motion/cartesian_path.h"
#include "motion/weave.h"
#include "robotics/build_model.h"
#include "robotics/maker_axes.h"
#include "sim/robot_motion.h"
#include "sim/simulate.h"
#include "sim/stepped_physics.h"
#include "spatial/jet.h"

namespace robomosp::task {

class TaskExecutor {
 public:
  static Result<TaskExecutor> create(const sim::Simulator&, WorldId, double step, Progress&);

  /// Adds contact physics from now on (t = 0): free objects fall, touch and slide. Its step is
  /// shortened so that rows fall on steps.
  Result<void> add_physics(const sim::PhysicsRun&, Progress&);
  /// The first instant after `now` at which physics has moved objects; infinity without physics.
  [[nodiscard]] double next_step(double now) const;
  /// Advances physics to t [s], before other events at that time.
  Result<void> go_to(double t, Progress&);

  /// Starts a move at time t; returns its end time.
  Result<double> move(const model::TaskStep&, const std::string& robot, const std::string& where,
                      double t, Progress&);
  /// An object out of reach stays in place, with a note on the distance.
  Result<void> attach(const model::TaskStep&, const std::string& robot, double t, Progress&);
  /// The same, wherever the object is.
  Result<void> take(const model::TaskStep&, const std::string& robot, double t);
  Result<void> detach(const std::string& object, double t);
  /// Updates robots that follow frames with the motions of the frames known at t.
  Result<void> refresh_following(double t);
  /// End of a robot's last task move [s].
  [[nodiscard]] double busy_until(const std::string& robot) const;
  /// Sets a signal to the value of an expression.
  Result<void> set(const std::string& signal, const std::string& expression, double t);
  [[nodiscard]] Result<bool> is_true(const std::string& condition, double t) const;

  /// Inputs that can change the value of a condition.
  struct Watched {
    bool motion = false;  ///< poses or rates of robots or objects
    bool time = false;
  };
  [[nodiscard]] Result<Watched> watched(const std::string& condition) const;
  /// The first time in (from, to] at which a condition is true while no signal changes and no move
  /// begins; empty = never. It is evaluated at the rate of the recording's rows, and the instant of
  /// a change to true is bisected to the last bit: a condition that is true for less than a row may
  /// be missed, and the instant returned is never too early.
  [[nodiscard]] Result<std::optional<double>> first_true(const std::string& condition, double from,
                                                         double to, Progress&) const;
  void note(double t, const std::string& text);

  [[nodiscard]] recording::Recording recording(double end) const;
  /// Rows at these increasing times, with all columns so far. Notes are those after `told`.
  [[nodiscard]] recording::Recording table(std::vector<double> times, std::size_t told = 0) const;
  [[nodiscard]] double step() const { return step_; }
  /// Number of changes of signals, and of tasks started by programs.
  [[nodiscard]] std::size_t changes() const { return changes_; }

  // ---- tasks started by programs, by their indices in the world ----
  struct Started {
    bool is_of_program = false;  ///< does not start by itself
    bool is_wanted = false;      ///< must start now
    bool is_running = false;     ///< from then to its end
    bool is_done = false;        ///< from its end until it is started again
  };
  [[nodiscard]] const std::vector<Started>& started() const { return started_; }
  void give_to_program(std::size_t task) { started_[task].is_of_program = true; }
  /// False = it is still running, and continues.
  bool start_task(std::size_t task);
  void task_begins(std::size_t task) { started_[task].is_wanted = false; }
  void task_ends(std::size_t task);

  // ---- for observers ----
  /// Signals by name with their values now, in the order of the world.
  [[nodiscard]] std::vector<std::pair<std::string, double>> signals() const;
  /// Sets a signal from time t on; false = unknown name.
  bool set_signal(const std::string& name, double value, double t);
  /// Robots that tasks can move, with their joint values at a time.
  [[nodiscard]] std::vector<std::pair<std::string, std::vector<double>>> joints(double t) const;
  /// The current state of an object that was gripped or released.
  struct Carried {
    std::string object;
    double since = 0;   ///< [s]
    std::string robot;  ///< "" = not held
    std::string link;   ///< its carrier; "" = the robot's base
    Pose pose;          ///< link_T_object, or world_T_object
  };
  [[nodiscard]] std::vector<Carried> carried() const;
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  friend class ProgramActor;
  friend class ProgramCell;  // programs' motions, signals and grips (program_actor.h)
  struct Move {
    double start = 0;
    sim::RobotMotion motion;
  };
  struct Grip {
    std::int32_t joint = -1;
    Pose joint_T_grip;
  };
  // ---- moves relative to moving frames (following.cpp) ----
  /// A pose in the world, or on a joint of a robot that moves it.
  struct Anchor {
    std::optional<std::size_t> carrier;  ///< the robot; empty = fixed
    std::int32_t joint = -1;             ///< of the carrier
    Pose at;                             ///< joint_T_place, or world_T_place
  };
  /// A move of a tip to a moving place, or away from one.
  struct Following {
    enum class Kind : std::uint8_t { joints, straight, along };
    Kind kind = Kind::joints;
    model::TaskStep step;
    std::string where, name;  ///< for messages: of the step, of the frame
    Grip tip;
    sim::Bound<IkSolver> ik;     ///< of the robot with that tip
    Anchor from, to;             ///< of the tip; `to` of a trajectory: of its frame
    std::vector<double> goal{};  ///< joint values instead of `to`; empty = none
    double start = 0, end = 0;   ///< of the move; afterwards the tip stays with `to` [s]
    double path_begin = 0;       ///< when it reaches the trajectory [s]
    std::shared_ptr<const motion::Path> path{};  ///< the trajectory, in its frame
    std::vector<spatial::Jet> law{};  ///< fractions of a straight path at equal fractions of time
    double stops = std::numeric_limits<double>::infinity();  ///< when it can no longer follow [s]
    std::string why_it_stops{};
    bool is_dynamic = false;  ///< it has followed a motion; false = everything is at rest so far
    std::array<std::array<double, 3>, 2> seen{};  ///< known motions of the carriers
    Progress* progress = nullptr;                 ///< of the run
    [[nodiscard]] double share(double share_of_time) const;
  };
  struct Actor {
    const model::PlacedRobot* placed = nullptr;
    const model::Robot* record = nullptr;
    std::shared_ptr<const RobotModel> model;
    /// A chain with one joint per coordinate, for timing laws of robots with coupled joints or
    /// closed loops. Null for robots with independent joints.
    std::shared_ptr<const RobotModel> axes;
    std::shared_ptr<const robotics::MakerAxes> maker;  ///< axes of its maker, for messages
    Pose world_T_base;
    std::vector<double> start;
    std::vector<Move> moves;
    /// Centre point of a held object used by moves without a tool, "torch.tip"; "" = none.
    std::string tcp;
    double busy_until = 0;               ///< end of the last task move [s]
    std::optional<Following> following;  ///< of that move
  };
  /// Pose of an object from a time on.
  struct Held {
    double from = 0;
    std::size_t actor = 0;
    bool is_held = false;
    std::int32_t joint = -1;  ///< of the actor, -1 = its base
    Pose pose;                ///< joint_T_object, or world_T_object
  };
  struct Thing {
    const model::PlacedObject* placed = nullptr;
    std::vector<Held> history;
    bool is_missed = false;  ///< the last attempt to grip it was out of reach
  };
  struct Wire {
    const model::Signal* signal = nullptr;
    std::vector<std::pair<double, double>> history;  ///< time, value from then on
  };
  /// The anchor of `frame` (with its current pose) for robot `who`: on its carrier if another robot
  /// holds it.
  [[nodiscard]] Anchor anchor(const std::string& frame, std::size_t who,
                              const Pose& world_T_frame) const;
  [[nodiscard]] Pose pose_at(const Anchor&, double t) const;  ///< in the world
  /// True if its carrier has further motion after t.
  [[nodiscard]] bool moves_after(const Anchor&, double t) const;
  /// Changes when its carrier gets other moves.
  [[nodiscard]] std::array<double, 3> signature(const Anchor&) const;
  [[nodiscard]] double share_at(const Following&, double t) const;
  /// Desired pose of the tip, in the world; for a joint move its end.
  [[nodiscard]] Result<Pose> wanted_pose(const Following&, double t) const;
  /// The same with velocities and accelerations, in the frame of the robot's base.
  [[nodiscard]] Result<PathSample> wanted_sample(const Following&, const Pose& world_T_base,
                                                 double t) const;
  /// Joints of a robot for the desired tip poses at these times; fewer rows if the frame leaves its
  /// reach after the move's end.
  Result<void> solve(const Following&, const Actor&, std::span<const double> times,
                     std::span<const double> seed, sim::RobotMotion& out) const;
  [[nodiscard]] std::vector<double> row_times(const Following&, double from, double to) const;
  /// The greatest fraction of its velocity limit, or root of the fraction of its acceleration
  /// limit, used by a joint.
  [[nodiscard]] static double beyond_limits(const Actor&, const sim::RobotMotion&, double speed,
                                            std::size_t* joint = nullptr, double* when = nullptr);
  /// The rest of a move from t on, in times of the run; for a search only up to the move's end.
  Result<sim::RobotMotion> followed(const Following&, std::size_t who, double t,
                                    bool is_search) const;
  Result<double> law_of_line(const model::TaskStep&, Following&, const Pose& from,
                             const Pose& to) const;
  /// The frames that a move follows or leaves; empty = it does not depend on moving frames.
  Result<std::optional<Following>> following_of(const model::TaskStep&, std::size_t who,
                                                const std::string& where, double t, Progress&);
  /// Starts the move; returns its end time.
  Result<double> begin_following(Following, std::size_t who, double t);
  /// Extends a joint move in progress as its limits now require.
  Result<void> give_time(Following&, std::size_t who, double t);
  /// Updates its moves from t on, from the known motions of the carriers.
  Result<void> follow_on(std::size_t who, double t);

  // ---- reach of grippers, for tasks and programs (reach.cpp) ----
  /// Default reach: greatest distance of an object from its gripper [m].
  static constexpr double kReach = 0.005;
  /// A gripper: a tool at its point, or a link (a belt's surface, a table) including its bodies.
  struct Gripper {
    Vec3 world_point;                                            ///< origin of tool or link [m]
    std::vector<std::pair<Pose, std::array<Vec3, 2>>> bodies{};  ///< world_T_body and its box
    bool is_link = false;
  };
  /// `link` as in tip(): "" is the robot's tool, or its last link if it has none.
  [[nodiscard]] Result<Gripper> gripper(std::size_t actor, const std::string& link, const Grip&,
                                        double t, Progress&) const;
  /// From the box of an object to the point, or to the nearest body [m].
  [[nodiscard]] Result<double> distance(const Gripper&, const Thing&, double t, Progress&) const;
  struct Reached {
    std::vector<std::string> objects;  ///< within the reach, nearest first
    std::string nearest;               ///< of all objects; "" = the world has none
    double distance = 0;               ///< of the nearest [m]
  };
  [[nodiscard]] Result<Reached> reached(const Gripper&, double reach, double t, Progress&) const;
  /// "part is 1.5 m away from the tool of left, which reaches 5 mm"
  [[nodiscard]] static std::string missed(const std::string& robot, const Gripper&,
                                          const std::string& object, double away, double reach);

  // ---- for programs (program_moves.cpp) ----
  /// Parameters of a program's motion for its robot.
  struct Drive {
    model::Trajectory trajectory;
    Pose base_T_trajectory;
    std::optional<Grip> tip;                            ///< the tip that follows it; empty = a
                                                        ///< joint motion
    std::vector<double> from;                           ///< joint values at its start
    double velocity_share = 1, acceleration_share = 1;  ///< of the joints' limits, as fractions
    std::optional<motion::Weave> weave;                 ///< added to its paths
    double weave_speed = 0;                             ///< along the path, at most [m/s]
  };
  Result<sim::RobotMotion> driven(std::size_t actor, const Drive&, const std::string& where,
                                  double t, Progress&) const;
  /// A model with the joints' limits reduced by a factor.
  [[nodiscard]] static std::shared_ptr<const RobotModel> slowed(
      const std::shared_ptr<const RobotModel>&, double velocity_share, double acceleration_share);
  /// Times of the samples of a motion that begins at t [s]: its ends, the rows between, and more if
  /// it weaves. ErrorCode::unsupported if it weaves too fast.
  Result<std::vector<double>> sample_times(double t, double duration, const Drive&) const;
  /// Number of parts into which the time between rows is divided for that.
  [[nodiscard]] Result<double> parts_of_row(const Drive&) const;
  /// End time of the last move.
  [[nodiscard]] static double moved_until(const Actor&);
  void push(std::size_t actor, double start, sim::RobotMotion);
  /// Appends a motion that begins at `start`, before the last one ends: the rest of that one is
  /// superposed. False = joints would be too fast, and nothing was changed.
  bool push_blended(std::size_t actor, double start, sim::RobotMotion, double velocity_share);
  /// Brakes robots on their paths from t on within their joints' limits, all by the same law, so
  /// that they stay synchronised; returns when all are at rest. Moves that have not begun are
  /// dropped. `way` = distance covered along their paths, in time [s].
  double brake(std::span<const std::size_t> actors, double t, double* way = nullptr);
  void set_wire(std::size_t wire, double value, double t);

  TaskExecutor(const sim::Simulator& sim, double step) : sim_(&sim), step_(step) {}
  [[nodiscard]] Result<std::size_t> actor(const std::string& name) const;
  /// For a tool or link; "" = the robot's tool.
  [[nodiscard]] Result<Grip> grip(const Actor&, const std::string& link) const;
  /// The same, also for an object that the robot holds, or a centre point of one; "" = the active
  /// centre point, else the robot's tool.
  [[nodiscard]] Result<Grip> tip(std::size_t actor, const std::string& name) const;
  /// Deactivates the centre points of an object.
  void led_by_own_tool(const std::string& object);
  /// object_T_tcp of an object of the world.
  [[nodiscard]] Result<Pose> centre_point(const Thing&, const std::string& name) const;
  /// The object named before the dot, or by the whole text.
  [[nodiscard]] const Thing* thing_of(const std::string& object_or_point, std::string& point) const;
  [[nodiscard]] Result<Pose> frame(const std::string& name, double t) const;
  [[nodiscard]] Result<const Expression*> compiled(const std::string& expression) const;
  [[nodiscard]] Result<double> evaluate(const std::string& expression, std::string_view unit,
                                        double t) const;
  /// `left.q1`, `left.qd1`, `left.x` (of its tool), `part.x`.
  [[nodiscard]] Result<Quantity> member_value(const Expression::Name& name, double t) const;
  [[nodiscard]] static bool is_rotary(const Actor&, std::size_t coordinate);
  /// `axis A2, joint "shoulder"` of joint `j` of its model.
  [[nodiscard]] static std::string joint_words(const Actor&, std::size_t j);
  [[nodiscard]] static bool can_move(const Actor&);
  /// Joint values, rates and accelerations at a time.
  struct JointState {
    std::vector<double> q, qd, qdd;
  };
  [[nodiscard]] static JointState sample(const Actor&, double t);
  static void sample(const Actor&, double t, JointState&);
  [[nodiscard]] Pose world_T_joint(const Actor&, std::int32_t joint, double t) const;
  [[nodiscard]] Pose pose_of(const Thing&, double t) const;
  /// Adds the new notes of physics.
  void note_physics(double t);
  /// True if physics currently moves it.
  [[nodiscard]] bool is_loose(const Thing&) const;
  [[nodiscard]] std::size_t place_of(const Thing& thing) const {
    return static_cast<std::size_t>(&thing - things_.data());
  }
  class Ways;
  /// The move as a trajectory of one segment.
  Result<model::Trajectory> trajectory_of(const model::TaskStep&, const Actor&, const Grip& tip,
                                          double t, Pose& world_T_trajectory) const;
  /// The samples of the move, of all coordinates.
  Result<sim::RobotMotion> motion_of(const model::TaskStep&, std::size_t actor,
                                     const std::string& where, double t, Progress&);
  /// Completes a `trajectory` of the joints with motors by the coordinates without motors.
  static Result<void> complete(const Actor&, model::Trajectory& trajectory,
                               const std::vector<double>& now);
  /// Moves the coordinates without motors so that the loops stay closed. If the goal has all
  /// coordinates, they must reach it.
  static Result<void> close(const Actor&, const std::vector<double>& goal, sim::RobotMotion&);

  const sim::Simulator* sim_;
  const model::World* world_ = nullptr;
  WorldId id_;
  double step_;
  std::vector<Actor> actors_;
  std::vector<Thing> things_;
  std::vector<Wire> wires_;
  std::vector<Started> started_;
  std::unordered_map<std::string, std::size_t> actor_of_, thing_of_, wire_of_, frame_of_, task_of_;
  std::vector<std::string> notes_;
  std::size_t note_bytes_ = 0;
  std::set<std::pair<std::string, std::string>> told_;  ///< robot and note of its moves, already
                                                        ///< reported
  std::size_t changes_ = 0;
  mutable std::unordered_map<std::string, Expression> compiled_;
  std::shared_ptr<sim::SteppedPhysics> physics_;  ///< null = none
  std::int64_t rows_of_physics_ = 0;              ///< of physics, stored in the objects' history
  std::size_t physics_notes_ = 0;                 ///< number of its notes already in notes_
};

}  // namespace robomosp::task
