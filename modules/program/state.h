// SPDX-License-Identifier: Apache-2.0
// Decoded code and the state of a machine; for the files of this folder (layer: data processing,
// program).
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <robomosp/sdk/program_numbers.h>
#include <robomosp/sdk/program_tables.h>

#include "program/machine.h"
#include "program/real_literal.h"

namespace robomosp::program {

inline constexpr std::uint32_t kNone = RMP_NONE;

/// Eight bytes of a value: INT, BOOL, CHAR and SEMAPHORE sign-extended, REAL as its bits, STRING,
/// LIST and FILE as handles (zero = empty).
struct Slot {
  std::uint64_t bits = 0;
  [[nodiscard]] std::int32_t integer() const { return static_cast<std::int32_t>(bits); }
  [[nodiscard]] double real() const { return std::bit_cast<double>(bits); }
  static Slot of(std::int64_t v) { return {static_cast<std::uint64_t>(v)}; }
  static Slot of_real(double v) { return {std::bit_cast<std::uint64_t>(v)}; }
};

// Handles are bit patterns that no finite REAL and no INT has, so that they are recognised in
// slots.
inline constexpr std::uint64_t kTagMask = 0xffff'0000'0000'0000;
inline constexpr std::uint64_t kTextTag = 0xfff5'0000'0000'0000;
inline constexpr std::uint64_t kListTag = 0xfff6'0000'0000'0000;
inline constexpr std::uint64_t kFileTag = 0xfff7'0000'0000'0000;
inline constexpr std::uint64_t kConstantText = std::uint64_t{1} << 40;

// Addresses: [0, globals) are globals, then the stack of the process; with a bit, elements of a
// list (its number, its slot), or constants.
inline constexpr std::uint64_t kListAddress = std::uint64_t{1} << 62;
inline constexpr std::uint64_t kConstantAddress = std::uint64_t{1} << 61;

enum Space : std::uint8_t { kFrame = 0, kGlobal = 1, kConstant = 2 };

/// Operations decoded from three-address code.
enum class Do : std::uint16_t {
  copy1,
  copy_n,
  copy_deep,
  zero_n,
  int_to_real,
  int_to_char,
  char_to_text,
  negate_int,
  negate_real,
  not_,
  add_int,
  subtract_int,
  multiply_int,
  div_int,
  mod_int,
  add_real,
  subtract_real,
  multiply_real,
  divide_real,
  equal_int,
  not_equal_int,
  less_int,
  less_equal_int,
  greater_int,
  greater_equal_int,
  equal_real,
  not_equal_real,
  less_real,
  less_equal_real,
  greater_real,
  greater_equal_real,
  compare_text,  ///< n = rmp_instruction_op
  exor,
  compose,     ///< n: 0 POSE @ POSE, 1 POSE @ POSITION, 2 ORI @ ORI, 3 ORI @ POSITION
  address,     ///< r (two slots): address of a
  field,       ///< r: address in a (two slots) + n
  element,     ///< r: address in a, element b of type n
  element_of,  ///< the same; a is the value itself
  load1,
  load_n,
  load_deep,
  load_char,
  store1,
  store_n,
  store_deep,
  store_char,
  read_signal,
  write_signal,
  refresh,
  timeout_known,
  call,
  intrinsic,
  make_list,
  jump,
  jump_if,
  jump_unless,
  return_,
  end_without_value,
  wait_time,
  wait_begin,
  wait_test,
  pause,
  halt,
  until_test,
  move,
  start,
  stop,
  continue_,
  cancel,
  enable,
  disable,
  interrupt_test,
  teach,
  number  ///< function n of a (b) of REAL: r REAL
};

struct Op {
  Do code = Do::jump;
  std::uint8_t sa = kFrame, sb = kFrame, sr = kFrame;
  std::uint32_t a = 0, b = 0, r = 0, n = 0;
};

/// The address of a value.
struct Place {
  std::uint8_t space = kFrame;
  bool is_reference = false;  ///< the two slots hold its address
  std::uint32_t offset = 0;
  std::uint32_t type = 0;
};

struct TypeInfo {
  std::uint32_t slots = 0;  ///< of a value
  std::uint32_t shape = 0;  ///< equal for types with values that can be copied to each other
  std::uint32_t kind = 0, element = 0, element_slots = 0;
  std::int32_t lower = 0;
  std::uint32_t length = 0;  ///< array
  bool has_list = false;
};

enum class Fn : std::uint8_t {
  number,
  size_of,
  cross,
  dot,
  ori_xyz,
  ori_yxz,
  ori_zyx,
  ori_zyz2,
  ori_rs,
  ori_vang,
  ori_quat,
  ori_mat,
  ori_mult,
  angle_x,
  angle_y,
  angle_z,
  angle_z2,
  quat_a,
  quat_b,
  quat_c,
  quat_d,
  rot_angle,
  rot_axis,
  vector_n,
  vector_o,
  vector_a,
  inv,
  trafo,
  trafo_inv,
  compare,
  concat,
  length,
  locate,
  extract,
  delete_,
  list_add,
  list_insert,
  list_delete,
  list_clear,
  list_index,
  open,
  close,
  eof,
  eol,
  write,
  writeln,
  read,
  readln,
  acquire,
  release,
  get_status,
  abs_int,
  for_step,      ///< computed STEP of a FOR: 0 is a fault
  robot_joints,  ///< R_JOINT_ACT, R_ROBTARGET_ACT, R_SPEED_ACT: state of the process's robot
  robot_target,
  robot_flange,
  robot_speed,
  act_robot,  ///< R_ACT_ROB; with an argument, selects it
  brake
};

struct IntrinsicCall {
  Fn fn = Fn::number;
  NumberFunction number = NumberFunction::same;
  std::uint32_t symbol = 0;  ///< its name
  std::vector<Place> arguments;
  Place result;
  bool has_result = false;
  std::uint32_t robot = kNone;  ///< symbol of the argument
};
struct CallInfo {
  std::uint32_t routine = 0;
  struct Argument {
    Place from;
    std::uint32_t to = 0;  ///< slot of the callee's frame
    bool is_place = false;
  };
  std::vector<Argument> arguments;
  Place result;
  bool has_result = false;
};
struct MoveAttribute {
  std::uint32_t attribute = 0;
  Place value;
  std::uint32_t robot = kNone;  ///< ACT_ROB: the symbol
};
struct MoveInfo {
  std::uint32_t interpolation = 0;
  bool is_incremental = false;
  std::vector<Place> targets;
  std::vector<MoveAttribute> attributes;
  std::uint32_t until = kNone;   ///< first op of the condition
  std::uint32_t action = kNone;  ///< routine
  std::uint32_t condition = kNone;
  std::uint32_t order = 0;  ///< number of MOVE statements before it in its routine
};
struct WaitInfo {
  std::uint32_t begin = 0, test = 0;  ///< ops
  std::uint32_t condition = kNone;
  std::uint32_t order = 0;
};
/// Inputs of a condition.
struct ConditionInfo {
  std::vector<std::uint32_t> signals;
  bool each_cycle = false;
};
struct LiveField {
  std::uint32_t kind = 0;  ///< 0 joints, 1 target, 2 speed
  std::uint32_t offset = 0, type = 0;
};
struct RoutineInfo {
  std::uint32_t first = 0, count = 0;  ///< ops
  std::uint32_t frame = 0;             ///< slots
  std::uint32_t zeroed = 0;            ///< of these from the first: parameters, locals
  std::uint32_t parameters = 0;        ///< slots
  std::uint32_t result_slots = 0;
  std::uint32_t condition = kNone;
};

/// Index for debuggers, built on first use.
struct DebugIndex {
  /// First ops of statements by file, line and column; earlier ones first at one place.
  std::vector<std::uint32_t> statements;
  std::unordered_map<std::string, std::vector<std::uint32_t>> symbols;  ///< by name in capitals
  std::unordered_map<std::string, std::uint32_t> routines;  ///< the same; the last of equal names
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> locals;  ///< symbols of a routine
};

struct Machine::Code {
  std::shared_ptr<const CompiledProgram> program;
  Limits limits;
  std::vector<TypeInfo> types;
  std::vector<Op> ops;
  std::vector<std::uint32_t> instruction_of;  ///< by op
  std::vector<std::uint32_t> routine_of_op;
  std::vector<RoutineInfo> routines;
  std::vector<Slot> constants;
  std::vector<std::string> constant_texts;
  std::vector<std::uint32_t> constant_slot;  ///< by constant
  std::uint32_t globals = 0;
  std::vector<Place> place_of;               ///< by symbol; offset kNone = none
  std::vector<std::uint32_t> taught_offset;  ///< by symbol: its copy of taught values; kNone = none
  std::vector<CallInfo> calls;
  std::vector<IntrinsicCall> intrinsics;
  std::vector<MoveInfo> moves;
  std::vector<WaitInfo> waits;
  std::vector<ConditionInfo> conditions;
  std::vector<std::vector<LiveField>> live;  ///< by number in Op::n of refresh
  std::vector<std::uint32_t> live_symbol;
  /// Robots selectable by R_ACT_ROB: symbol, index in `live`; only robots of matching type.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> robots;
  std::vector<std::uint32_t> data_lists;     ///< routines
  std::vector<std::uint32_t> statement_ops;  ///< first op of each statement, ascending
  // System variables: offsets of globals; kNone = not in the program.
  std::uint32_t r_speed = kNone, r_speed_ori = kNone, r_acc = kNone, r_move_time = kNone,
                r_c_cp = kNone, r_c_speed = kNone, r_wobble_amplitude = kNone,
                r_wobble_length = kNone, r_speed_ptp = kNone, r_acc_ptp = kNone, r_c_ptp = kNone,
                r_timeout = kNone;

  [[nodiscard]] const rmp_code& tables() const { return program->code(); }
  [[nodiscard]] const rmp_code_type& type(std::uint32_t t) const {
    return row<rmp_code_type>(tables().types, t);
  }
  [[nodiscard]] const rmp_code_field& field(std::uint32_t f) const {
    return row<rmp_code_field>(tables().fields, f);
  }
  [[nodiscard]] const rmp_code_symbol& symbol(std::uint32_t s) const {
    return row<rmp_code_symbol>(tables().symbols, s);
  }
  [[nodiscard]] const rmp_code_routine& routine(std::uint32_t r) const {
    return row<rmp_code_routine>(tables().routines, r);
  }
  [[nodiscard]] const rmp_code_instruction& instruction(std::uint32_t op) const {
    return row<rmp_code_instruction>(tables().instructions, instruction_of[op]);
  }
  [[nodiscard]] std::string routine_name(std::uint32_t r) const {
    return symbol(routine(r).symbol).name;
  }
  /// As written in a declaration.
  [[nodiscard]] std::string type_name(std::uint32_t t) const;
  [[nodiscard]] Signal signal(std::uint32_t symbol) const;
  [[nodiscard]] const DebugIndex& debug_index() const;  ///< [any thread]
  /// First op of the first statement of a file at or after a line; kNone = none.
  [[nodiscard]] std::uint32_t statement_at(std::uint32_t file, std::uint32_t line) const;

 private:
  mutable std::once_flag is_indexed_;
  mutable DebugIndex index_;
};

/// Breakpoints; copies of a machine share them until one is changed.
struct BreakpointSet {
  struct One {
    Breakpoint what;  ///< without its hits
    std::uint32_t op = kNone;
  };
  std::map<std::uint32_t, One> all;                                       ///< by number
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> numbers;  ///< by op, ascending
  std::vector<bool> is_at;                                                ///< by op
};
/// Hits of breakpoints, by number; only nonzero ones.
using BreakpointHits = std::map<std::uint32_t, std::uint64_t>;

/// Texts, lists and files, by handle.
struct Heap {
  struct List {
    std::vector<Slot> slots;
    bool is_used = false, is_marked = false;
  };
  struct Text {
    std::shared_ptr<const std::string> text;
    bool is_marked = false;
  };
  struct File {
    std::string name, text;
    char mode = 0;  ///< R, W, A; 0 = closed
    std::size_t at = 0;
    rmp_span span{};  ///< of the statement that opened it, or wrote to it last
  };
  std::vector<Text> texts;
  std::vector<std::uint32_t> free_texts;
  std::vector<List> lists;
  std::vector<std::uint32_t> free_lists;
  std::vector<File> files;
  std::uint64_t bytes = 0;  ///< of texts, lists and files, including garbage
  std::uint64_t collect_at = 1 << 20;
};

enum class FrameKind : std::uint8_t { call, data_list, action, interrupt };
enum class Waits : std::uint8_t {
  nothing,
  time,
  motion,
  condition,
  semaphore,
  pause,
  line,
  brake  ///< until the robots of `braked` are at rest
};
/// The wait state of a process, which an interrupt can suspend.
struct WaitState {
  Waits kind = Waits::nothing;
  double until = 0;
  std::uint32_t most_open = 0;  ///< motion: continues if at most this many are open
  bool is_behind = false;       ///< its statement is the previous one
  bool own_level = false;       ///< motion: counts those of its interrupt level only
  std::uint32_t move = kNone;   ///< motion with UNTIL: row of Code::moves
  bool is_aborted = false;      ///< by UNTIL
  std::uint64_t motion = 0;     ///< motion of UNTIL
  bool is_granted = false;      ///< semaphore, pause
  std::uint64_t address = 0;    ///< semaphore
  std::uint64_t ticket = 0;
  std::uint64_t looked = ~std::uint64_t{0};  ///< State::progress at the last evaluation of its
                                             ///< condition
  std::string message;
  std::vector<std::uint64_t> braked;  ///< brake: motions
  bool holds = false;                 ///< brake: they are held rather than ended
};
struct Frame {
  std::uint32_t routine = 0;
  std::uint32_t base = 0;  ///< of its slots in the stack
  std::uint32_t back = 0;  ///< op at which to continue
  FrameKind kind = FrameKind::call;
  bool is_condition = false;   ///< it evaluates a condition of UNTIL or an interrupt
  std::uint32_t wait = kNone;  ///< WAIT FOR with a condition being evaluated
  double deadline = 0, timeout = 0;
  bool has_deadline = false;
  bool is_waived = false;    ///< WAIT FOR continues as if its condition held
  std::uint64_t result = 0;  ///< address; of `result_slots`
  bool has_result = false;
  std::vector<WaitState> put_aside;  ///< interrupt: of the process; at most one
  std::int32_t priority = 0;         ///< interrupt
  std::vector<std::uint64_t> held;   ///< interrupt: motions that BRAKE holds until it has ended
};
struct OpenMotion {
  std::uint64_t number = 0;
  std::uint32_t level = 0;  ///< nested interrupts when it began
  bool approximates = false;
  rmp_span span{};
  std::uint32_t robot = kNone;  ///< symbol; kNone = the program's own
};
struct EnabledInterrupt {
  std::uint32_t routine = 0;
  std::int32_t priority = 0;
  bool was_true = true;
  bool is_pending = false;
  std::uint64_t looked = ~std::uint64_t{0};
};
struct Process {
  std::uint32_t routine = 0;
  std::int32_t priority = 0;
  std::vector<Slot> stack;
  std::vector<Frame> frames;
  std::uint32_t pc = 0;
  WaitState wait;
  std::vector<OpenMotion> open;
  std::vector<EnabledInterrupt> interrupts;
  std::uint32_t level = 0;  ///< running interrupts
  bool is_stopped = false;
  bool is_ended = false;
  std::uint32_t robot = kNone;      ///< R_ACT_ROB: the selected symbol
  std::size_t condition_depth = 0;  ///< frames when a condition of UNTIL or WHEN started; 0 = none
  std::uint64_t used = 0;           ///< used part of the slice of this run()
  std::string input;                ///< operator input not read yet
  std::uint64_t counted = 0;        ///< its bytes counted in State::process_bytes
  [[nodiscard]] std::uint64_t bytes() const {
    return stack.size() * sizeof(Slot) + frames.size() * sizeof(Frame) + input.size();
  }
};

struct Machine::State {
  std::vector<Slot> globals;
  std::deque<Process> processes;
  std::vector<std::uint32_t> order;       ///< of them: those of higher priority first
  std::vector<std::uint32_t> process_at;  ///< by routine: which of them; kNone = none yet
  std::vector<std::uint32_t>
      enabled_by;                   ///< by routine of an interrupt: which of them; kNone = none
  std::uint64_t process_bytes = 0;  ///< of all processes at the last count
  std::uint64_t looks = 0;          ///< number of checks whether a process can continue
  Heap heap;
  double now = 0;
  bool has_begun = false;
  std::uint64_t next_motion = 1, next_ticket = 1, progress = 0, instructions = 0;
  bool has_taught = false;
  std::vector<bool> is_taught;  ///< by symbol
  rmp_span timeout_unknown{};   ///< WAIT FOR with a TIMEOUT that a flat run cannot decide
  bool is_timeout_unknown = false;
  Status status;
  // Debugger.
  std::shared_ptr<BreakpointSet> breakpoints;  ///< null = there are none
  std::shared_ptr<BreakpointHits> hits;        ///< null = no hits
  std::uint32_t next_breakpoint = 1;
  bool is_stepping = false, wants_pause = false;
  std::uint32_t entry_op = kNone;  ///< where it stops once
  bool entry_counts = false;
  StepKind step = StepKind::into;
  std::uint32_t step_process = 0;
  std::size_t step_depth = 0;
  rmp_span step_from{};
  std::uint32_t resume_op = kNone;  ///< where it stopped: not again at once
  std::uint32_t resume_process = kNone;
  /// Stop once at the place of another, stopped run.
  struct Again {
    std::uint32_t op = kNone;  ///< kNone = nowhere
    std::uint32_t process = 0;
    std::uint64_t instructions = 0;  ///< instructions executed there; 0 = any number
    std::string condition;           ///< "" = none
    double until = 0;                ///< [s]
    StopReason reason = StopReason::step;
    std::uint32_t breakpoint = 0;
  };
  Again again;
  std::uint32_t running = 0;  ///< routine of the process that is calling the world
  // Journal.
  bool keeps_journal = false;
  std::vector<bool> has_run;  ///< by op
  std::vector<EndedWait> timeouts;
};

/// Data shared by copies, for modification: created if null, copied if shared.
template <class T>
T& own_part(std::shared_ptr<T>& part) {
  if (!part) part = std::make_shared<T>();
#if defined(__SANITIZE_THREAD__)  // without support for fences: always copies
  part = std::make_shared<T>(*part);
#else
  if (part.use_count() > 1) part = std::make_shared<T>(*part);
  else std::atomic_thread_fence(std::memory_order_acquire);
#endif
  return *part;
}

/// Callbacks of a flat run (trace.cpp).
class Observer {
 public:
  virtual ~Observer() = default;
  /// Called when WAIT FOR reads an unknown signal. Returns true if it was recorded and the program
  /// continues as if the condition held; false = a fault.
  virtual Result<bool> unknown_wait(std::uint32_t process, const WaitInfo&, double timeout) = 0;
  virtual Result<void> waits_for_time(std::uint32_t process, double seconds, const rmp_span&) = 0;
  virtual Result<void> halts(std::uint32_t process, const rmp_span&) = 0;
  /// Called before a motion begins; its process is at that statement.
  virtual Result<void> moves(std::uint32_t process, const MoveInfo&) = 0;
  /// Called before a process calls the world, with its position.
  virtual void running(std::uint32_t process, const rmp_span&) = 0;
};

/// Runs the processes of a state (execute.cpp, processes.cpp, intrinsics.cpp, values.cpp).
class Run {
 public:
  Run(const Machine::Code& code, Machine::State& state, World* world,
      const std::atomic<bool>* cancel, Observer* observer)
      : c_(code), s_(state), world_(world), cancel_(cancel), observer_(observer) {}
  void run(double now);

  // ---- values (values.cpp); also for the debugger ----
  [[nodiscard]] std::string_view text_of(Slot) const;
  Slot new_text(std::string text);
  [[nodiscard]] Heap::List* list_of(Slot);
  [[nodiscard]] const Heap::List* list_of(Slot) const;
  Slot new_list();
  /// `count` slots at an address; nullptr = invalid (damaged code).
  [[nodiscard]] Slot* at(Process&, std::uint64_t address, std::uint64_t count, bool writes);
  /// Copies the lists in a value, in place. The address stays valid where a pointer would not.
  bool deepen(Process&, std::uint32_t type, std::uint64_t address);
  /// True if this many more bytes fit, possibly after garbage collection; else it is a fault.
  bool has_room(std::uint64_t more);
  [[nodiscard]] bool equal(std::uint32_t type, const Slot* a, const Slot* b) const;
  void append_text(std::uint32_t type, const Slot* slots, std::string& out, std::size_t most) const;
  [[nodiscard]] std::uint64_t bytes() const;
  void collect();

 private:
  friend class Debugger;
  enum class Next : std::uint8_t { go_on, wait, end, stop, condition_true, condition_false };
  // ---- processes.cpp ----
  bool look(Process&);
  bool look_at(Process&);
  /// Updates the memory sum by the current size of a process.
  void count_bytes(Process&);
  /// True if no action of other processes in this run() can wake it, except by wake().
  [[nodiscard]] bool sleeps(const Process&) const;
  /// Schedules it again in this run().
  void wake(const Process&);
  bool interrupts(Process&);
  Next condition(Process&, std::uint32_t op);
  bool poll(Process&);
  void abort_all(Process&, AbortReason);
  /// True if BRAKE holds a motion.
  [[nodiscard]] bool is_held(std::uint64_t motion) const;
  /// Resumes motions held by a frame.
  bool release(const std::vector<std::uint64_t>& motions);
  void write_files();
  void tell();
  void start_process(std::uint32_t routine, std::int32_t priority);
  void disable_all(Process&);
  [[nodiscard]] Process* process_of(std::uint32_t routine);
  bool push_frame(Process&, std::uint32_t routine, std::uint32_t back, FrameKind kind);
  // ---- execute.cpp ----
  Next execute(Process&);
  template <bool kDebug>
  Next loop(Process&);
  bool stops_here(Process&, std::uint32_t op, std::uint64_t used);
  /// Evaluates the condition of a breakpoint. Fails if it cannot be evaluated there.
  Result<bool> holds(Process&, const std::string& condition);
  /// The text of a log point with its values.
  [[nodiscard]] std::string log_text(Process&, const std::string& log);
  void say_log(Process&, std::uint32_t op, const std::string& log);
  bool element(Process&, const Op&, std::uint64_t address, std::uint64_t character, Slot index,
               Slot* out);
  bool make_list(Process&, const Op&);
  Next call(Process&, const Op&);
  Next leave(Process&, const Op&);
  // ---- seldom.cpp ----
  /// What the loop does after an operation: the next one, that of Process::pc, or leave the slice.
  enum class Then : std::uint8_t {
    next,
    jump,
    wait,
    stop,
    fault,
    lost,  ///< an address that does not exist
    condition_true,
    condition_false
  };
  /// Runs the operation at Process::pc, which the loop does not run itself. `base`: of each Space.
  Then seldom(Process&, const Op&, Slot* const* base);
  bool may_act(const Process&, const char* what);
  bool store_char(Process&, std::uint64_t address, std::string text, std::uint64_t index, char to);
  bool read_signal(Process&, const Op&, Slot* out, bool& is_skipped);
  bool write_signal(Process&, const Op&, Slot value);
  Then wait_time(Process&, double seconds);
  Then wait_begin(Process&, const Op&, Slot timeout);
  Then wait_test(Process&, const Op&, Slot condition);
  Then pause(Process&, std::string message);
  Then halt(Process&);
  Then move(Process&, std::uint32_t which);
  Then teach(Process&, const Op&);
  bool control(Process&, const Op&);
  bool fail(std::string message, std::string hint = {});
  bool fail(const Error&);
  bool must_wait(Process&);
  bool begin_motion(Process&, std::uint32_t move);
  [[nodiscard]] Target target_of(std::uint32_t type, const Slot*) const;
  [[nodiscard]] bool is_whole_joint(std::uint32_t type, std::uint32_t k) const;
  [[nodiscard]] PlainPose pose_of(const Slot*) const;
  [[nodiscard]] Slot* slots(Process&, const Place&);
  [[nodiscard]] std::uint64_t address_of(const Process&, const Place&) const;
  bool put_target(std::uint32_t type, const Target&, Slot*);
  bool refresh(Process&, const Op&);
  // ---- intrinsics.cpp ----
  enum class Did : std::uint8_t { done, waits, failed };
  struct Intrinsic;  // intrinsics.h
  Did intrinsic(Process&, const IntrinsicCall&);
  Did read(Process&, const IntrinsicCall&);
  Did write(Process&, const IntrinsicCall&);
  Heap::File* file_of(Process&, const Place&);
  Did brake(Process&, const IntrinsicCall&, std::int32_t mode);
  Did act_robot(Process&, const IntrinsicCall&);

  const Machine::Code& c_;
  Machine::State& s_;
  World* world_;
  const std::atomic<bool>* cancel_;
  Observer* observer_;
  Process* p_ = nullptr;
  /// Processes to be run in this run(), by priority: -priority, routine.
  std::set<std::pair<std::int64_t, std::uint32_t>> awake_;
  std::uint32_t at_ = 0;         ///< op
  std::uint64_t cost_ = 0;       ///< of long copies, in instructions
  std::uint32_t last_test_ = 0;  ///< op at which the last condition ended
};

// ---- numbers.cpp: geometry of programs ----
void compose_orientations(const double* a, const double* b, double* out);
void rotate_position(const double* q, const double* v, double* out);
PlainPose compose_poses(const PlainPose&, const PlainPose&);
PlainPose inverse_pose(const PlainPose&);
/// Rotation about axis 0, 1, 2 by degrees; exact at right angles.
void axis_rotation(int axis, double degrees, double* q);
/// Three rotations, one behind the other.
void three_rotations(const int* axes, const double* degrees, double* q);
/// Quaternion of a matrix's columns; false = they are not right-handed axes.
bool columns_to_quaternion(const double* n, const double* o, const double* a, double* q);
/// Rotation matrix, row-major.
void quaternion_to_matrix(const double* q, double* m);
/// Angles 0 .. 360 of a mode ('RS', 'XYZ', 'YXZ', 'ZYX', 'ZYZ2'): those about x, y, z, and the
/// second about z. False = unknown mode. `has` has a bit for each angle of the mode.
bool angles_of(std::string_view mode, const double* q, double (&out)[4], unsigned& has);

}  // namespace robomosp::program
