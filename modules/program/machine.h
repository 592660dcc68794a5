// SPDX-License-Identifier: Apache-2.0
// The machine that runs three-address code: processes, waits, motions, interrupts, and debugging
// (layer: data processing, program). It has no clock, robot or files: run() gets the time, and a
// World provides the rest.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/language.h>
#include <robomosp/sdk/program_code.h>
#include <robomosp/sdk/result.h>

#include "program/world.h"

namespace robomosp::program {

/// Limits of a running program; exceeding one is a fault at its line.
struct Limits {
  std::uint32_t most_frames = 10'000;  ///< nested calls of one process
  std::uint64_t most_bytes = std::uint64_t{256}
                             << 20;  ///< variables, stacks, strings, lists, files
  std::uint64_t slice = 1'000'000;   ///< instructions of one process per run(); the rest follow in
                                     ///< the next. Long copies count as several.
  std::uint64_t most_instructions = 0;  ///< of the whole program; 0 = no limit
};

/// An entry of the call stack.
struct CallPlace {
  std::uint32_t routine = 0;         ///< row of the routines
  std::string name;                  ///< of the routine
  rmp_span span{};                   ///< its position
  std::uint32_t statement_line = 0;  ///< line of that position
};

/// Why a program cannot continue.
struct Fault {
  std::string message;  ///< without a trailing period
  std::string hint;     ///< a sentence, or ""
  std::uint32_t process = 0;
  rmp_span span{};
  std::string file;                            ///< name of span.file
  std::vector<CallPlace> calls;                ///< innermost first
  [[nodiscard]] std::string sentence() const;  ///< file:line:column: message. hint
};

enum class WaitKind {
  time,       ///< WAIT t SEC
  motion,     ///< a motion that is not finished
  condition,  ///< WAIT FOR
  semaphore,
  pause,      ///< PAUSE: resume_pause()
  line,       ///< READ: a line of the operator
  stopped,    ///< STOP: until CONTINUE
  interrupt,  ///< a routine of its interrupt waits (see the next Wait of that process)
};
/// What a process waits for. Event-driven callers call run() again at `until`, when a motion in
/// `motions` is finished, or when a signal in `signals` changes; and in each of their cycles if
/// `each_cycle` is set.
struct Wait {
  std::uint32_t process = 0;  ///< routine
  WaitKind kind = WaitKind::time;
  std::optional<double> until;         ///< time at which it ends [s], also of a TIMEOUT
  std::vector<std::uint64_t> motions;  ///< unfinished ones, oldest first
  std::vector<std::uint32_t> signals;  ///< symbols in the condition of WAIT FOR or UNTIL
  bool each_cycle = false;  ///< the condition reads the robot's state or calls a function
  std::string message;      ///< of a PAUSE
  rmp_span span{};
};

enum class RunState {
  waiting,   ///< every process waits for something: Status::waits
  busy,      ///< a slice was used up: run() again, at the same time or later
  over,      ///< all processes have ended, or HALT
  fault,     ///< Status::fault
  stopped,   ///< by the debugger: Status::stop
  cancelled  ///< by the flag that was given
};
enum class StopReason { breakpoint, step, motion, pause_wish, entry };
/// Where the debugger has stopped the program.
struct Stop {
  StopReason reason = StopReason::step;
  std::uint32_t process = 0;
  std::uint32_t breakpoint = 0;  ///< its number
  rmp_span span{};
  std::string message;  ///< of a breakpoint with a condition that cannot be evaluated: a sentence;
                        ///< else ""
};
struct Status {
  RunState state = RunState::waiting;
  bool is_halted = false;              ///< over, by HALT
  rmp_span halted_at{};                ///< that HALT
  std::vector<Wait> waits;             ///< waiting, busy: of processes and their interrupts
  std::vector<std::uint32_t> watched;  ///< signals in the conditions of enabled interrupts
  bool watches_each_cycle = false;     ///< such a condition must be evaluated in each cycle
  std::optional<Fault> fault;
  std::optional<Stop> stop;
  std::uint64_t instructions = 0;  ///< so far, of all processes
};

/// A WAIT FOR that ended by its TIMEOUT.
struct EndedWait {
  std::uint32_t process = 0;
  double time = 0;  ///< [s]
  rmp_span span{};
};
/// A statement, and whether it has run.
struct StatementPlace {
  std::uint32_t routine = 0;  ///< row of the routines
  rmp_span span{};
  bool has_run = false;
};

/// A breakpoint: a place, optionally with a condition (an IRL expression over names visible there:
/// fields, indices, numbers, strings, operators and parentheses, no calls; if it cannot be
/// evaluated, the program stops with a message), and a range of hits: after `ignore`, up to
/// `until`, each `every`th.
struct Breakpoint {
  std::uint32_t number = 0;  ///< given by the machine
  std::string file;          ///< "" = the program's own
  std::uint32_t line = 0;    ///< moved to the next line with a statement
  std::string condition;
  std::uint64_t ignore = 0;  ///< hits to skip before it stops
  std::uint64_t until = 0;   ///< the last hit at which it stops; 0 = no end
  std::uint64_t every = 1;   ///< counted from the first hit
  std::uint64_t hits = 0;
  std::string routine;       ///< instead of file and line: the beginning of this routine
  std::uint32_t column = 0;  ///< of the statement, set by the machine
  /// Instead of stopping, logs this text (World::log_text), with the values of expressions in
  /// braces.
  std::string log;
  bool is_enabled = true;
};
enum class StepKind { into, over, out, motion };

/// A variable as a tree. Records and arrays have parts, others a value.
struct Variable {
  std::string name;   ///< "[3]" of an element
  std::string type;   ///< "INT", "ARRAY [1..3] OF PEG"
  std::string value;  ///< as WRITE shows it; of records and arrays too
  std::vector<Variable> parts;
  std::uint64_t part_count = 0;  ///< total number; `parts` may be cut
  std::uint64_t first_part = 0;  ///< number of the first of `parts`, from 0
  bool is_indexed = false;       ///< its parts are elements: of an array or list
};
/// Limits for reading a variable.
struct VariableCut {
  std::uint32_t depth = 8;
  std::uint32_t most_parts = 200;   ///< of one record, array or list
  std::uint64_t first_part = 0;     ///< of the variable itself; parts within begin at the first
  std::uint32_t most_bytes = 4096;  ///< of a value's text
};

/// A running program: a value, copied in constant time (copies share unchanged parts), so that each
/// row of a recording can have one. Copies run independently. [one thread each; copies on any]
///
/// Order: run() runs every process that can continue, by priority (PRIORITY of PROCESS; the program
/// has 0, and so have processes without one), equal ones by the number of their routine, until each
/// waits; equal inputs give equal runs.
///
/// Motions: a process waits until its motion is finished. If the motion has an approximation (C_CP
/// or C_PTP above zero, or C_PASS) and no UNTIL, the process continues to compute; it waits again
/// before anything but computing (signals, texts, WAIT, robot state, processes, ...), so that all
/// its inputs and outputs happen after the motion. The next motion is passed on with Motion::after,
/// and may blend; at most two motions of one process are open.
///
/// Interrupts belong to the process that enables them. When the condition changes from false to
/// true, the process is held, the routine runs, and the process continues. A motion in progress is
/// not affected. Higher priorities interrupt lower ones; other interrupts that occur meanwhile are
/// pending once and run later. UNTIL and WAIT FOR of the process are suspended until the routine
/// has ended.
///
/// WAIT FOR, UNTIL and interrupts evaluate their conditions once per run(), and again when another
/// process has run. UNTIL aborts the motion, waits until the robot is at rest, then calls DO.
class Machine {
 public:
  /// Decodes a program. Errors describe code that no compiler would generate.
  static Result<Machine> load(std::shared_ptr<const CompiledProgram>, const Limits& = {});

  /// Runs the program up to time `now` [s], which must not decrease.
  const Status& run(double now, World&, const std::atomic<bool>* cancel = nullptr);
  /// The latest status; before the first run the program is `busy`.
  [[nodiscard]] const Status& status() const;
  /// Ends PAUSE of a process. False = it is not paused.
  bool resume_pause(std::uint32_t process = 0);
  /// Resets to the state after load(). Breakpoints stay.
  void restart();

  [[nodiscard]] const rmp_code& code() const;
  [[nodiscard]] const std::shared_ptr<const CompiledProgram>& compiled() const;
  [[nodiscard]] std::uint64_t instructions() const;
  /// Number of times that processes were checked for whether they can continue.
  [[nodiscard]] std::uint64_t looks() const;
  /// Memory of variables, stacks, strings and lists [bytes].
  [[nodiscard]] std::uint64_t bytes() const;
  /// Running processes (0 = the program), in order.
  [[nodiscard]] std::vector<std::uint32_t> processes() const;

  // ---- for checks of programs (debugging.cpp) ----
  /// From now on, records which statements have run and which waits timed out; this slows runs down
  /// as much as a breakpoint.
  void keep_journal();
  /// Statements of all routines in the order of their code.
  [[nodiscard]] std::vector<StatementPlace> statements() const;
  [[nodiscard]] std::vector<EndedWait> timeouts() const;
  /// The process that is calling the world, within run().
  [[nodiscard]] std::uint32_t running_process() const;
  /// Lets a process at WAIT FOR continue as if its condition held. False = it is at none.
  bool waive_wait(std::uint32_t process);

  // ---- debugger (debugging.cpp) ----
  /// Sets a breakpoint and returns it with its number and line; a given number, which must be
  /// unused, is kept with its hits. Errors: unknown file, no statement from that line on, or an
  /// invalid condition.
  Result<Breakpoint> set_breakpoint(Breakpoint);
  bool remove_breakpoint(std::uint32_t number);
  [[nodiscard]] std::vector<Breakpoint> breakpoints() const;
  /// Before run(): sets where a stopped process stops next. All processes run meanwhile. `motion`
  /// stops where any process is about to begin a motion.
  void step(StepKind, std::uint32_t process = 0);
  /// Stops before the next instruction of any process.
  void pause();
  /// Before the first run(): stops before the first statement. `counts` = breakpoints set there
  /// meanwhile also count.
  void stop_on_entry(bool counts);
  /// Stops once, at the latest at time `until` [s], where another, stopped run is: if `exactly`,
  /// where the same process reaches the same instruction after the same number of instructions;
  /// else at the same statement, or for other code the same line, if the condition of a breakpoint
  /// holds. False = that place does not exist any more, or the other run is not stopped.
  bool stop_as(const Machine& other, double until, bool exactly);
  /// True if both have the same instructions, whatever their constants.
  [[nodiscard]] bool has_instructions_of(const Machine& other) const;
  /// Beginnings of the statements of a file ("" = the program's own), in order of lines. Errors
  /// list the existing files.
  [[nodiscard]] Result<std::vector<rmp_span>> statements(std::string_view file) const;
  /// Procedures, functions, processes and interrupts, with the beginning of their bodies.
  struct RoutinePlace {
    std::string name;
    rmp_span span{};
  };
  [[nodiscard]] std::vector<RoutinePlace> routines() const;
  /// Name of a process's routine; for 0 the program's name.
  [[nodiscard]] std::string process_name(std::uint32_t process) const;
  /// The semaphore variable that a process waits for; "" = none, or local to a routine.
  [[nodiscard]] std::string semaphore_of(std::uint32_t process) const;
  /// Innermost first; empty = unknown process.
  [[nodiscard]] std::vector<CallPlace> call_stack(std::uint32_t process = 0) const;
  /// Position of the innermost call of a process, at constant cost; nothing = unknown process.
  struct InnermostPlace {
    rmp_span span{};
    std::size_t depth = 0;  ///< calls
  };
  [[nodiscard]] std::optional<InnermostPlace> place_of(std::uint32_t process = 0) const;
  /// Variables of a frame (0 = innermost): parameters, then locals, in order of declaration.
  [[nodiscard]] std::vector<Variable> variables(std::uint32_t process, std::uint32_t frame,
                                                const VariableCut& = {}) const;
  /// Variables of the program, its modules and its cell, without system variables.
  [[nodiscard]] std::vector<Variable> globals(const VariableCut& = {}) const;
  /// Instead of a frame: the scope of program and modules.
  static constexpr std::uint32_t kNoFrame = 0xffffffffU;
  /// An expression (as in Breakpoint::condition), evaluated in a frame.
  [[nodiscard]] Result<Variable> evaluate(std::string_view expression, std::uint32_t process = 0,
                                          std::uint32_t frame = 0, const VariableCut& = {}) const;
  /// Sets a variable (or a field, an element) to the value of an expression.
  Result<Variable> assign(std::string_view place, std::string_view expression,
                          std::uint32_t process = 0, std::uint32_t frame = 0);

  // The implementation, in the files of this folder only.
  struct Code;
  struct State;
  Machine(const Machine&);
  Machine(Machine&&) noexcept;
  Machine& operator=(const Machine&);
  Machine& operator=(Machine&&) noexcept;
  ~Machine();

 private:
  friend class Tracer;
  Machine(std::shared_ptr<const Code>, std::shared_ptr<State>);
  State& own();
  std::shared_ptr<const Code> code_;
  std::shared_ptr<State> state_;
};

}  // namespace robomosp::program
