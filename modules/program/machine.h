// SPDX-License-Identifier: Apache-2.0
// The machine that runs three-address code: processes, waits, motions, interrupts, and what a
// debugger asks (layer: data processing, program). It has no clock, no robot and no files of its
// own: the time is given to run(), the rest is asked of a World.
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

/// Bounds of a program that runs; what passes them is a fault at its line.
struct Limits {
  std::uint32_t most_frames = 10'000;  ///< calls within each other, of one process
  std::uint64_t most_bytes = std::uint64_t{256}
                             << 20;  ///< variables, stacks, strings, lists, files
  std::uint64_t slice = 1'000'000;  ///< instructions of one process in one run(); more go on in the
                                    ///< next. Long copies count as several.
  std::uint64_t most_instructions = 0;  ///< of the whole program; 0 = no bound
};

/// A line of the call stack.
struct CallPlace {
  std::uint32_t routine = 0;         ///< row of the routines
  std::string name;                  ///< of the routine
  rmp_span span{};                   ///< where it is
  std::uint32_t statement_line = 0;  ///< the same line, for lists
};

/// Why a program cannot go on.
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
  motion,     ///< a motion that is not done
  condition,  ///< WAIT FOR
  semaphore,
  pause,      ///< PAUSE: resume_pause()
  line,       ///< READ: a line of the operator
  stopped,    ///< STOP: until CONTINUE
  interrupt,  ///< its interrupt's routine runs and waits (see the next Wait of that process)
};
/// What a process waits for. A caller with events calls run() again when one of them comes: at
/// `until`, when a motion in `motions` is done, when a signal in `signals` changes; and in each of
/// its cycles where `each_cycle` says so.
struct Wait {
  std::uint32_t process = 0;  ///< routine
  WaitKind kind = WaitKind::time;
  std::optional<double> until;         ///< time at which it ends [s], also of a TIMEOUT
  std::vector<std::uint64_t> motions;  ///< that are not done, oldest first
  std::vector<std::uint32_t> signals;  ///< symbols in the condition of WAIT FOR or UNTIL
  bool each_cycle = false;  ///< the condition asks for the robot's state, or calls a function
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
/// Where the debugger has stopped it.
struct Stop {
  StopReason reason = StopReason::step;
  std::uint32_t process = 0;
  std::uint32_t breakpoint = 0;  ///< its number
  rmp_span span{};
  std::string message;  ///< of a breakpoint whose condition has no value: a sentence; ""
};
struct Status {
  RunState state = RunState::waiting;
  bool is_halted = false;              ///< over, by HALT
  rmp_span halted_at{};                ///< that HALT
  std::vector<Wait> waits;             ///< waiting, busy: of processes and their interrupts
  std::vector<std::uint32_t> watched;  ///< signals in the conditions of enabled interrupts
  bool watches_each_cycle = false;     ///< such a condition is to be looked at in each cycle
  std::optional<Fault> fault;
  std::optional<Stop> stop;
  std::uint64_t instructions = 0;  ///< so far, of all processes
};

/// A WAIT FOR whose TIMEOUT ran out.
struct EndedWait {
  std::uint32_t process = 0;
  double time = 0;  ///< [s]
  rmp_span span{};
};
/// A statement, and whether a run came there.
struct StatementPlace {
  std::uint32_t routine = 0;  ///< row of the routines
  rmp_span span{};
  bool has_run = false;
};

/// A breakpoint: a place, and perhaps a condition (an expression of IRL over what is visible there:
/// names, fields, indices, numbers, strings, operators and parentheses, no calls; one that has no
/// value when it comes there stops, and says so), and at which hits it stops: those behind `ignore`
/// and up to `until`, each `every`th.
struct Breakpoint {
  std::uint32_t number = 0;  ///< given by the machine
  std::string file;          ///< "" = the program's own
  std::uint32_t line = 0;    ///< moved to the next line with a statement
  std::string condition;
  std::uint64_t ignore = 0;  ///< hits before it stops
  std::uint64_t until = 0;   ///< the last hit at which it stops; 0 = no end
  std::uint64_t every = 1;   ///< of the hits counted from the first
  std::uint64_t hits = 0;
  std::string routine;       ///< instead of file and line: where this routine begins
  std::uint32_t column = 0;  ///< of the statement, given by the machine
  /// Instead of stopping this is said (World::log_text), with the values of what is in braces.
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
  std::uint64_t part_count = 0;  ///< how many there are; `parts` may be cut
  std::uint64_t first_part = 0;  ///< number of the first of `parts`, from 0
  bool is_indexed = false;       ///< its parts are elements: of an array or list
};
/// How much of a variable is wanted.
struct VariableCut {
  std::uint32_t depth = 8;
  std::uint32_t most_parts = 200;   ///< of one record, array or list
  std::uint64_t first_part = 0;     ///< of the variable itself; parts within begin at the first
  std::uint32_t most_bytes = 4096;  ///< of a value's text
};

/// A program that runs: a value, copied in constant time (copies share what neither has changed),
/// so that one may stand behind each row of a recording. Copies run by themselves.
/// [one thread each; copies on any]
///
/// Order: run() lets every process go on that can, those of higher priority first (PRIORITY of
/// PROCESS; the program has 0; none given = 0), equal ones by the number of their routine, until
/// each waits; equal inputs give equal runs.
///
/// Motions: a process waits until its motion is done. Where the motion has an approximation (C_CP
/// or C_PTP above zero, or C_PASS) and no UNTIL, the process goes on computing; it waits again
/// where anything but computing comes (signals, texts, WAIT, robot state, processes, ...), so that
/// whatever it says or asks has its place in time behind the motion. The next motion is handed
/// over with Motion::after, and may blend; at most two motions of one process are open.
///
/// Interrupts belong to the process that enables them. When the condition changes from false to
/// true, the process is held at its place, the routine runs, and the process goes on. A motion that
/// is under way goes on meanwhile. Higher priorities interrupt lower ones; what comes meanwhile is
/// kept once and comes later. UNTIL and WAIT FOR of the process rest until the routine has ended.
///
/// WAIT FOR and UNTIL and interrupts look at their conditions once in a run(), and again when
/// another process has gone on. UNTIL aborts the motion, waits until it stands, then calls DO.
class Machine {
 public:
  /// Decodes a program. Errors name what its code does that no compiler would write.
  static Result<Machine> load(std::shared_ptr<const CompiledProgram>, const Limits& = {});

  /// Lets the program go on at time `now` [s], which does not fall.
  const Status& run(double now, World&, const std::atomic<bool>* cancel = nullptr);
  /// The last one; before the first run the program is `busy`.
  [[nodiscard]] const Status& status() const;
  /// Ends PAUSE of a process. False = it is at none.
  bool resume_pause(std::uint32_t process = 0);
  /// To the state that load() has made. Breakpoints stay.
  void restart();

  [[nodiscard]] const rmp_code& code() const;
  [[nodiscard]] const std::shared_ptr<const CompiledProgram>& compiled() const;
  [[nodiscard]] std::uint64_t instructions() const;
  /// How often a process was asked so far whether it can go on.
  [[nodiscard]] std::uint64_t looks() const;
  /// Bytes that variables, stacks, strings and lists take.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Processes that have begun and not ended (0 = the program), in their order.
  [[nodiscard]] std::vector<std::uint32_t> processes() const;

  // ---- for checks of programs (debugging.cpp) ----
  /// From now on it remembers which statements have run and which waits timed out; runs take
  /// as long as with a breakpoint.
  void keep_journal();
  /// Statements of all routines in the order of their code.
  [[nodiscard]] std::vector<StatementPlace> statements() const;
  [[nodiscard]] std::vector<EndedWait> timeouts() const;
  /// The process that asks the world now, within run().
  [[nodiscard]] std::uint32_t running_process() const;
  /// Lets a process that is at WAIT FOR go on as if its condition held. False = it is at none.
  bool waive_wait(std::uint32_t process);

  // ---- debugger (debugging.cpp) ----
  /// Sets a breakpoint and tells it with its number and its line; one that has a number, which no
  /// other has, keeps it with its hits. Errors: there is no such file, no statement from that line
  /// on, or the condition is no expression.
  Result<Breakpoint> set_breakpoint(Breakpoint);
  bool remove_breakpoint(std::uint32_t number);
  [[nodiscard]] std::vector<Breakpoint> breakpoints() const;
  /// Before run(): where a process that stands stops next. All processes run meanwhile.
  /// `motion` stops where any process is about to begin a motion.
  void step(StepKind, std::uint32_t process = 0);
  /// Stops before the next instruction of whichever process.
  void pause();
  /// Before the first run(): stops before the first statement. `counts` = a breakpoint that is set
  /// there meanwhile stops it still.
  void stop_on_entry(bool counts);
  /// Stops once, at the latest at time `until` [s], as another run stands that its debugger has
  /// stopped: `exactly` where the same process comes to the same instruction after as many of them,
  /// else to the same statement, of other code to the same line, where the condition of a
  /// breakpoint holds. False = there is no such place any more, or the other one does not stand.
  bool stop_as(const Machine& other, double until, bool exactly);
  /// Whether both go through the same instructions, whatever their constants are.
  [[nodiscard]] bool has_instructions_of(const Machine& other) const;
  /// Where statements of a file begin ("" = the program's own), in order of lines. Errors name
  /// the files that there are.
  [[nodiscard]] Result<std::vector<rmp_span>> statements(std::string_view file) const;
  /// Names of procedures, functions, processes and interrupts, and where their bodies begin.
  struct RoutinePlace {
    std::string name;
    rmp_span span{};
  };
  [[nodiscard]] std::vector<RoutinePlace> routines() const;
  /// Name of the routine that a process is of; the program's for 0.
  [[nodiscard]] std::string process_name(std::uint32_t process) const;
  /// The variable whose semaphore a process waits for; "" = none, or one of a routine.
  [[nodiscard]] std::string semaphore_of(std::uint32_t process) const;
  /// Innermost first; empty = there is no such process.
  [[nodiscard]] std::vector<CallPlace> call_stack(std::uint32_t process = 0) const;
  /// Where the innermost call of a process is, however many there are; nothing = there is no such
  /// process.
  struct InnermostPlace {
    rmp_span span{};
    std::size_t depth = 0;  ///< calls
  };
  [[nodiscard]] std::optional<InnermostPlace> place_of(std::uint32_t process = 0) const;
  /// Variables of a frame (0 = innermost): parameters, then locals, in order of declaration.
  [[nodiscard]] std::vector<Variable> variables(std::uint32_t process, std::uint32_t frame,
                                                const VariableCut& = {}) const;
  /// Variables of the program, its modules and its cell; without those of the language's own.
  [[nodiscard]] std::vector<Variable> globals(const VariableCut& = {}) const;
  /// Instead of a frame: as program and modules see it.
  static constexpr std::uint32_t kNoFrame = 0xffffffffU;
  /// An expression (as in Breakpoint::condition) as seen in a frame.
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
