// SPDX-License-Identifier: Apache-2.0
// A program running in a world: the bindings of its names, and its motions, signals and grips
// (layer: application, task).
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/language.h>

#include "model/world.h"
#include "program/machine.h"
#include "program/presets.h"
#include "robotics/maker_axes.h"
#include "sim/ik_choice.h"
#include "task/program_inspection.h"
#include "task/task_executor.h"

namespace robomosp::task {

/// Files opened by programs: names are those of the programs. [the run's thread]
class ProgramFolder {
 public:
  virtual ~ProgramFolder() = default;
  [[nodiscard]] virtual Result<std::string> read(std::string_view name) const = 0;
  /// `adds` = appends to the existing file.
  [[nodiscard]] virtual Result<void> write(std::string_view name, std::string_view bytes,
                                           bool adds) const = 0;
};

/// Relation of a program's additional joint to the joint: value = sign * joint + offset [degrees or
/// mm].
struct CountedJoint {
  double sign = 1, offset = 0;
};

/// A compiled program and the bindings of its names in a world.
struct ProgramInWorld {
  std::shared_ptr<const CompiledProgram> code;
  model::PlacedProgram placement;
  bool frees_unbound = false;  ///< unbound signals are separate ones of the program
  /// Motions without TOOL move the flange, as on a controller without a defined tool, rather than
  /// the robot's tool.
  bool moves_flange = false;
  /// A check run: it continues after faults and fills this. null = a normal run.
  std::shared_ptr<ProgramInspection> inspection = nullptr;
  std::vector<program::Preset> values = {};  ///< of variables, set before the first statement
  std::vector<std::string> lines = {};       ///< input of READ, one after another
  std::shared_ptr<const ProgramFolder> files = nullptr;  ///< null = it may open none
  /// Relations of additional joints, by number from 1; for others the maker's axes apply if the
  /// cell has R_MAKER_AXES, else the joints.
  std::map<std::size_t, CountedJoint> counted = {};
  /// Poses are measured from the carriage, not from the fixed base of the rail: as on controllers
  /// that do not model the rail.
  bool is_on_carriage = false;
};

struct TargetPlaces;

/// A value; copies run independently. [one thread]
class ProgramActor {
 public:
  /// Errors name unbound and wrongly bound names.
  static Result<ProgramActor> create(const TaskExecutor&, ProgramInWorld,
                                     std::vector<std::string>& notes);

  /// See task::target_places().
  static Result<TargetPlaces> target_places(const TaskExecutor&, ProgramInWorld,
                                            std::string_view symbol);

  /// Flag polled during computation for a request to pause. Must outlive this.
  void set_pause_wish(const std::atomic<bool>* wish) { pause_wish_ = wish; }
  /// For an interactive run: the input of READ, which may grow while the run is paused. Must
  /// outlive this. Without it, READ uses the program's lines.
  void set_lines(const std::vector<std::string>* lines) { typed_ = lines; }
  /// Sets whether an operator is present: then PAUSE, and READ without a line, wait for input
  /// (is_asking) instead of continuing, or failing.
  void set_attended(bool is_attended) { is_attended_ = is_attended; }
  /// True at PAUSE until run() is called again, or at READ until there is a line.
  [[nodiscard]] bool is_asking() const { return is_shown_ || wants_line_; }
  [[nodiscard]] bool wants_line() const { return wants_line_; }
  [[nodiscard]] std::size_t lines_read() const { return lines_read_; }
  /// Runs it at time `now` [s] until it waits, is over, or its debugger stops it.
  Result<void> run(TaskExecutor&, double now, Progress&);
  [[nodiscard]] const std::string& name() const { return names_->name; }
  /// Tasks of the world that it may start, by their indices there.
  [[nodiscard]] const std::set<std::size_t>& tasks() const { return names_->tasks; }
  [[nodiscard]] bool is_over() const;
  [[nodiscard]] bool is_stopped() const;  ///< by its debugger
  /// The time at which it continues if no signal changes; empty = never.
  [[nodiscard]] std::optional<double> next_time(double now, double cycle) const;
  /// True if a signal may make it continue.
  [[nodiscard]] bool waits_for_signals() const;
  /// Waits of its processes that nothing can end, each with its place, and what could end it:
  /// sentences.
  struct Stuck {
    std::vector<std::string> waits, hints;
  };
  [[nodiscard]] Stuck stuck() const;
  /// "towers.irl:12:3", the place where it waits.
  [[nodiscard]] std::string where() const;
  /// Its line at a time; 0 = before it began.
  [[nodiscard]] double line_at(double t) const;
  [[nodiscard]] program::Machine& machine() { return machine_; }
  [[nodiscard]] const program::Machine& machine() const { return machine_; }

  // ---- for checks (program_inspection.cpp) ----
  [[nodiscard]] ProgramInspection* inspection() const { return inspection_.get(); }
  /// Called if nothing can end its waits any more: those of WAIT FOR continue as if their
  /// conditions held. False = there is none, or one was waived before; then the program is over.
  bool waive(double now);
  /// Its run has ended.
  void finish(double now);

 private:
  friend class ProgramCell;
  struct RobotUse {
    std::size_t actor = 0;
    std::string frame, tool;
  };
  struct GripUse {
    RobotUse robot;
    std::string object;  ///< "" = the nearest
    double reach = 0;
  };
  struct SignalUse {
    enum Kind { wire, grip, free, task } kind = free;
    std::size_t at = 0;  ///< index of the wire, grip, or task of the world
    double value = 0;    ///< of a free input
  };
  struct JointUse {
    bool is_grip = false;
    std::size_t at = 0;  ///< index of the grip, or actor
    std::size_t joint = 0;
  };
  /// The bindings of its names. Constant.
  struct Names {
    std::string name;
    bool moves_flange = false;
    std::optional<RobotUse> own;
    std::map<std::uint32_t, RobotUse> robots;    ///< by symbol
    std::map<std::uint32_t, SignalUse> signals;  ///< by symbol
    std::vector<GripUse> grips;
    std::set<std::size_t> tasks;             ///< of the world, bound to signals
    std::map<std::size_t, JointUse> joints;  ///< additional ones, from 1
    /// Number of a robot's first joints that are additional ones: a rail. By actor.
    std::map<std::size_t, std::size_t> rails;
    std::map<std::int64_t, RobotUse> devices;     ///< by number, for DEVICE
    std::map<std::size_t, CountedJoint> counted;  ///< additional joints, from 1
    bool is_on_carriage = false;                  ///< poses are measured from the carriage
    /// The cell has no additional joints (R_NADDJ := 0): targets only have zeros required by the
    /// type.
    bool has_no_additional = false;
  };
  /// For a PTP under TIME with C_PASS, or after one: each joint follows a cubic.
  struct Passing {
    /// `open` = it ends at rest, unless a motion follows to which it can pass on.
    enum class End { open, passed, stop } end = End::open;
    bool is_from_rest = true;
    std::vector<double> rate;  ///< initial rate [rad/s or m/s]
    std::vector<double> to;    ///< joint values at its end
    std::uint32_t process = 0;
    rmp_span span{};
  };
  struct OpenMotion {
    std::size_t actor = 0;
    std::vector<std::size_t> along;  ///< other robots and mechanisms that it moves
    double along_from = 0;           ///< start time, without a stop [s]
    double start = 0, end = 0;
    double c_cp = 0, c_ptp = 0;
    double c_speed = 1;  ///< a fraction
    bool is_path = false;
    double speed = 0;                                   ///< along its path [m/s]; 0 = it has a TIME
    double speed_orientation = 0;                       ///< [rad/s]; 0 = it has a TIME
    double acceleration = 0, angular_acceleration = 0;  ///< of a path [m/s^2, rad/s^2]
    double velocity_share = 1, acceleration_share = 1;
    TaskExecutor::Grip tip;
    std::optional<Passing> passing;
    std::vector<std::pair<std::size_t, bool>> grips;  ///< actions at its end
  };
  /// A motion held by STOP, with the rest of it.
  struct HeldMotion {
    std::map<std::size_t, std::vector<TaskExecutor::Move>> moves;  ///< by actor
    double at = 0;           ///< where it was held, as a time of those [s]
    std::uint64_t with = 0;  ///< an earlier motion of the robot, held with it; 0 = none
    double began = 0;
  };
  struct Solver {
    std::size_t actor = 0;
    TaskExecutor::Grip tip;
    sim::Bound<IkSolver> ik;
    sim::BranchNames branches;
  };

  /// Relation of a program's joints and turns to those of a robot.
  struct CountedAxes {
    std::shared_ptr<const robotics::MakerAxes> maker;  ///< null = they are the robot's joints
    std::vector<PostAxis> arm;                         ///< of `maker`: those after a rail
  };

  ProgramActor(std::shared_ptr<const Names> names, program::Machine machine)
      : names_(std::move(names)), machine_(std::move(machine)) {}
  /// The maker's axis of a joint if it depends on that joint alone; empty = there is none.
  [[nodiscard]] static std::optional<CountedJoint> maker_counts(const TaskExecutor::Actor&,
                                                                std::size_t joint,
                                                                std::string* name = nullptr);
  /// Binds additional joints that the user has not bound: the maker's external axes that carry the
  /// robot, in the maker's order, if the program's MAIN_JOINT has the others.
  static void bind_external_axes(const rmp_code&, const TaskExecutor::Actor&, std::size_t actor,
                                 Names&);
  void note_line(double t);
  /// "towers.irl:12:3"
  [[nodiscard]] std::string place_text(const rmp_span&) const;
  Result<void> advance(TaskExecutor&, double now, Progress&);
  [[nodiscard]] ProgramPlace place(std::uint32_t process, const rmp_span&, double now);
  void tell(InspectedEvent::Kind, ProgramPlace, std::string message, std::string hint,
            std::vector<std::string> signals = {});

  std::shared_ptr<const Names> names_;
  program::Machine machine_;
  std::map<std::uint32_t, program::SignalValue> outputs_;
  std::map<std::uint64_t, OpenMotion> open_;
  std::map<std::size_t, double> told_accelerations_;  ///< by actor: greatest reported in a note
                                                      ///< [m/s^2]
  std::map<std::uint64_t, HeldMotion> held_;
  std::map<std::size_t, double> braked_until_;   ///< by actor: for motions it has aborted itself
                                                 ///< [s]
  std::vector<std::vector<std::string>> taken_;  ///< by grip
  std::vector<double> additional_;               ///< as set by the program
  const std::atomic<bool>* pause_wish_ = nullptr;
  std::string text_;
  std::vector<std::pair<double, std::uint32_t>> lines_;
  std::vector<std::shared_ptr<const Solver>> solvers_;
  std::map<std::size_t, CountedAxes> axes_;  ///< by actor, computed on demand
  ErrorCode code_ = ErrorCode::conflict;     ///< of its cell's last error
  std::shared_ptr<ProgramInspection> inspection_;
  program::Presets presets_;
  bool has_told_halt_ = false;
  const std::vector<std::string>* typed_ = nullptr;
  std::vector<std::string> own_lines_;
  std::shared_ptr<const ProgramFolder> files_;
  std::size_t lines_read_ = 0;
  bool is_attended_ = false;
  std::set<std::uint32_t> paused_;  ///< processes at PAUSE
  bool is_shown_ = false;           ///< PAUSE was shown; they continue with the next run()
  bool wants_line_ = false;
};

}  // namespace robomosp::task
