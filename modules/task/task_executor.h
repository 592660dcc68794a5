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

  /// Contact physics from now on (t = 0): objects that nobody holds fall, touch and slide. Its step
  /// is shortened so that rows fall on steps.
  Result<void> add_physics(const sim::PhysicsRun&, Progress&);
  /// The first instant after `now` at which physics has moved objects; infinity without physics.
  [[nodiscard]] double next_step(double now) const;
  /// Lets physics go on to t [s], at which nothing has happened yet.
  Result<void> go_to(double t, Progress&);

  /// Starts a move at time t; gives when it ends.
  Result<double> move(const model::TaskStep&, const std::string& robot, const std::string& where,
                      double t, Progress&);
  /// An object out of reach stays where it is, which a note tells with the distance.
  Result<void> attach(const model::TaskStep&, const std::string& robot, double t, Progress&);
  /// The same, wherever the object is.
  Result<void> take(const model::TaskStep&, const std::string& robot, double t);
  Result<void> detach(const std::string& object, double t);
  /// Lets robots that follow frames go on by what has become known of the frames' motions at t.
  Result<void> refresh_following(double t);
  /// End of the last move that a task has given a robot [s].
  [[nodiscard]] double busy_until(const std::string& robot) const;
  /// Sets a signal to the value of an expression.
  Result<void> set(const std::string& signal, const std::string& expression, double t);
  [[nodiscard]] Result<bool> is_true(const std::string& condition, double t) const;

  /// What makes a condition change its truth.
  struct Watched {
    bool motion = false;  ///< places or rates of robots or objects
    bool time = false;
  };
  [[nodiscard]] Result<Watched> watched(const std::string& condition) const;
  /// The first time in (from, to] at which a condition is true while no signal changes and no move
  /// begins; none = it is not. It is looked at as often as the recording has rows, and where it has
  /// turned true the instant is bisected to the last bit: what is true for less than a row may be
  /// missed, and the instant that is found is never too early.
  [[nodiscard]] Result<std::optional<double>> first_true(const std::string& condition, double from,
                                                         double to, Progress&) const;
  void note(double t, const std::string& text);

  [[nodiscard]] recording::Recording recording(double end) const;
  /// Its rows at these times, which rise, and all columns that there are by now.
  /// Notes are those behind `told`.
  [[nodiscard]] recording::Recording table(std::vector<double> times, std::size_t told = 0) const;
  [[nodiscard]] double step() const { return step_; }
  /// Counts the changes of signals, and of tasks that programs start.
  [[nodiscard]] std::size_t changes() const { return changes_; }

  // ---- tasks that programs start, by their places in the world ----
  struct Started {
    bool is_of_program = false;  ///< does not begin by itself
    bool is_wanted = false;      ///< is to begin now
    bool is_running = false;     ///< from then to its end
    bool is_done = false;        ///< from its end until it is started again
  };
  [[nodiscard]] const std::vector<Started>& started() const { return started_; }
  void give_to_program(std::size_t task) { started_[task].is_of_program = true; }
  /// False = it runs still, and goes on.
  bool start_task(std::size_t task);
  void task_begins(std::size_t task) { started_[task].is_wanted = false; }
  void task_ends(std::size_t task);

  // ---- for who looks on from outside ----
  /// Signals by name with their values now, in the order of the world.
  [[nodiscard]] std::vector<std::pair<std::string, double>> signals() const;
  /// Sets a signal from time t on; false = the world has none of that name.
  bool set_signal(const std::string& name, double value, double t);
  /// Robots that tasks can move, with their joint values at a time.
  [[nodiscard]] std::vector<std::pair<std::string, std::vector<double>>> joints(double t) const;
  /// An object that was taken or let go, as it is now.
  struct Carried {
    std::string object;
    double since = 0;   ///< [s]
    std::string robot;  ///< "" = nobody holds it
    std::string link;   ///< that takes it along; "" = the robot's base
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
  // ---- moves into frames that move (following.cpp) ----
  /// A place in the world, or on a joint of a robot that moves it.
  struct Anchor {
    std::optional<std::size_t> carrier;  ///< the robot; none = it stands
    std::int32_t joint = -1;             ///< of the carrier
    Pose at;                             ///< joint_T_place, or world_T_place
  };
  /// A move of a tip to a place that may move, or away from one.
  struct Following {
    enum class Kind : std::uint8_t { joints, straight, along };
    Kind kind = Kind::joints;
    model::TaskStep step;
    std::string where, name;  ///< for messages: of the step, of the frame
    Grip tip;
    sim::Bound<IkSolver> ik;     ///< of the robot with that tip
    Anchor from, to;             ///< of the tip; `to` of a trajectory: of its frame
    std::vector<double> goal{};  ///< joint values instead of `to`; empty = none
    double start = 0, end = 0;   ///< of the move; the tip stays with `to` behind it [s]
    double path_begin = 0;       ///< when it comes to the trajectory [s]
    std::shared_ptr<const motion::Path> path{};  ///< the trajectory, in its frame
    std::vector<spatial::Jet> law{};  ///< shares of a straight way at even shares of time
    double stops = std::numeric_limits<double>::infinity();  ///< when it cannot follow on [s]
    std::string why_it_stops{};
    bool is_dynamic = false;  ///< it has followed a motion; false = all stands as yet
    std::array<std::array<double, 3>, 2> seen{};  ///< what it knows of the carriers' moves
    Progress* progress = nullptr;                 ///< of the run
    [[nodiscard]] double share(double share_of_time) const;
  };
  struct Actor {
    const model::PlacedRobot* placed = nullptr;
    const model::Robot* record = nullptr;
    std::shared_ptr<const RobotModel> model;
    /// A joint a coordinate, in a row: what a law needs to know of a robot whose joints follow
    /// others or close loops. Null for robots whose joints are their coordinates.
    std::shared_ptr<const RobotModel> axes;
    std::shared_ptr<const robotics::MakerAxes> maker;  ///< axes of its maker, for messages
    Pose world_T_base;
    std::vector<double> start;
    std::vector<Move> moves;
    /// Centre point of a held object that leads moves which name no tool, "torch.tip"; "" = none.
    std::string tcp;
    double busy_until = 0;               ///< end of the move that a task has given last [s]
    std::optional<Following> following;  ///< of that move
  };
  /// Where an object is from a time on.
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
    bool is_missed = false;  ///< the last that was to take it did not reach it
  };
  struct Wire {
    const model::Signal* signal = nullptr;
    std::vector<std::pair<double, double>> history;  ///< time, value from then on
  };
  /// Where `frame` (with its pose now) is for robot `who`: on its carrier if another robot holds
  /// it.
  [[nodiscard]] Anchor anchor(const std::string& frame, std::size_t who,
                              const Pose& world_T_frame) const;
  [[nodiscard]] Pose pose_at(const Anchor&, double t) const;  ///< in the world
  /// Whether its carrier still has a motion to go behind t.
  [[nodiscard]] bool moves_after(const Anchor&, double t) const;
  /// Changes when its carrier is given other moves.
  [[nodiscard]] std::array<double, 3> signature(const Anchor&) const;
  [[nodiscard]] double share_at(const Following&, double t) const;
  /// Of the tip, in the world; of a joint move where it ends.
  [[nodiscard]] Result<Pose> wanted_pose(const Following&, double t) const;
  /// The same with rates and accelerations, in the frame of the robot's base.
  [[nodiscard]] Result<PathSample> wanted_sample(const Following&, const Pose& world_T_base,
                                                 double t) const;
  /// Joints of a robot whose tip is as wanted at these times; fewer rows where the frame leaves its
  /// reach behind the move's end.
  Result<void> solve(const Following&, const Actor&, std::span<const double> times,
                     std::span<const double> seed, sim::RobotMotion& out) const;
  [[nodiscard]] std::vector<double> row_times(const Following&, double from, double to) const;
  /// The greatest share of its velocity, or root of its share of acceleration, that a joint takes.
  [[nodiscard]] static double beyond_limits(const Actor&, const sim::RobotMotion&, double speed,
                                            std::size_t* joint = nullptr, double* when = nullptr);
  /// The rest of a move from t on, in times of the run; of a search only up to the move's end.
  Result<sim::RobotMotion> followed(const Following&, std::size_t who, double t,
                                    bool is_search) const;
  Result<double> law_of_line(const model::TaskStep&, Following&, const Pose& from,
                             const Pose& to) const;
  /// What a move follows or leaves; none = it has nothing to do with what may move.
  Result<std::optional<Following>> following_of(const model::TaskStep&, std::size_t who,
                                                const std::string& where, double t, Progress&);
  /// Starts the move; gives when it ends.
  Result<double> begin_following(Following, std::size_t who, double t);
  /// Lets a joint move that has begun take as long as its limits need now.
  Result<void> give_time(Following&, std::size_t who, double t);
  /// Its moves from t on, by what the carriers are known to do.
  Result<void> follow_on(std::size_t who, double t);

  // ---- what is within reach of a gripper, of tasks and programs (reach.cpp) ----
  /// How far an object may be from what takes it, where nothing else is given [m].
  static constexpr double kReach = 0.005;
  /// What takes objects: a tool at its point, a link (a belt's cloth, a table) with its bodies too.
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
    std::vector<std::string> objects;  ///< no farther away than the reach, nearest first
    std::string nearest;               ///< of all; "" = the world has no objects
    double distance = 0;               ///< of the nearest [m]
  };
  [[nodiscard]] Result<Reached> reached(const Gripper&, double reach, double t, Progress&) const;
  /// "part is 1.5 m away from the tool of left, which reaches 5 mm"
  [[nodiscard]] static std::string missed(const std::string& robot, const Gripper&,
                                          const std::string& object, double away, double reach);

  // ---- for programs (program_moves.cpp) ----
  /// What a motion of a program asks of its robot.
  struct Drive {
    model::Trajectory trajectory;
    Pose base_T_trajectory;
    std::optional<Grip> tip;                            ///< that follows it; none = of joints
    std::vector<double> from;                           ///< joint values at its start
    double velocity_share = 1, acceleration_share = 1;  ///< of the joints' limits
    std::optional<motion::Weave> weave;                 ///< laid over its paths
    double weave_speed = 0;                             ///< along the path, at most [m/s]
  };
  Result<sim::RobotMotion> driven(std::size_t actor, const Drive&, const std::string& where,
                                  double t, Progress&) const;
  /// Which limits of the joints a model has, less a share.
  [[nodiscard]] static std::shared_ptr<const RobotModel> slowed(
      const std::shared_ptr<const RobotModel>&, double velocity_share, double acceleration_share);
  /// Times at which a motion that begins at t [s] has samples: its ends, the rows between, and more
  /// where it weaves. ErrorCode::unsupported where it weaves too fast.
  Result<std::vector<double>> sample_times(double t, double duration, const Drive&) const;
  /// Into how many parts the time between rows is divided for that.
  [[nodiscard]] Result<double> parts_of_row(const Drive&) const;
  /// The end of the last move that has been given.
  [[nodiscard]] static double moved_until(const Actor&);
  void push(std::size_t actor, double start, sim::RobotMotion);
  /// Puts a motion behind the last one so that it begins at `start`, before that ends: what is left
  /// of that one is added to it. False = joints would be too fast, and nothing was done.
  bool push_blended(std::size_t actor, double start, sim::RobotMotion, double velocity_share);
  /// Brakes robots on their ways from t on within their joints' limits, all by the same law, so
  /// that they stay together; when all stand. Moves that have not begun are dropped. `way` = how
  /// far on their way they come [s].
  double brake(std::span<const std::size_t> actors, double t, double* way = nullptr);
  void set_wire(std::size_t wire, double value, double t);

  TaskExecutor(const sim::Simulator& sim, double step) : sim_(&sim), step_(step) {}
  [[nodiscard]] Result<std::size_t> actor(const std::string& name) const;
  /// Of a tool or link; "" = the robot's tool.
  [[nodiscard]] Result<Grip> grip(const Actor&, const std::string& link) const;
  /// Likewise, or of an object that the robot holds, or of a centre point of one; "" = the one that
  /// leads, else the robot's tool.
  [[nodiscard]] Result<Grip> tip(std::size_t actor, const std::string& name) const;
  /// No centre point of the object leads moves any more.
  void led_by_own_tool(const std::string& object);
  /// object_T_tcp of an object of the world.
  [[nodiscard]] Result<Pose> centre_point(const Thing&, const std::string& name) const;
  /// The object whose name stands before the dot or is all of it.
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
  /// What physics has had to say since the last call.
  void note_physics(double t);
  /// Whether physics has it now.
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
  /// What the motors' joints of `trajectory` lack: the coordinates that no motor moves.
  static Result<void> complete(const Actor&, model::Trajectory& trajectory,
                               const std::vector<double>& now);
  /// Moves the coordinates without motors so that the loops stay closed. A goal of all coordinates
  /// must be what they come to.
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
  std::set<std::pair<std::string, std::string>> told_;  ///< robot and note of its moves
  std::size_t changes_ = 0;
  mutable std::unordered_map<std::string, Expression> compiled_;
  std::shared_ptr<sim::SteppedPhysics> physics_;  ///< null = none
  std::int64_t rows_of_physics_ = 0;              ///< whose places stand in the objects' history
  std::size_t physics_notes_ = 0;                 ///< of its notes, in notes_ already
};

}  // namespace robomosp::task
