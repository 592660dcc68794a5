// SPDX-License-Identifier: Apache-2.0
// The cell as seen by a running program: signals, motions, kinematics, texts, files (layer: data
// processing, program). Lengths in mm, angles in degrees, as in programs.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/program_code.h>
#include <robomosp/sdk/result.h>

namespace robomosp::program {

/// A declared signal. Texts are valid as long as the program.
struct Signal {
  std::uint32_t symbol = RMP_NONE;     ///< row of the program's symbols
  std::string_view name;               ///< as declared
  std::int32_t address = 0;            ///< its number
  std::int32_t width = 1;              ///< number of bits from there on, 1 to 64
  std::uint32_t type = RMP_TYPE_BOOL;  ///< RMP_TYPE_BOOL, _INT or _REAL
  bool is_output = false;
};

/// a_T_b: a position [mm] and a unit quaternion, scalar first.
struct PlainPose {
  std::array<double, 3> position{0, 0, 0};
  std::array<double, 4> quaternion{1, 0, 0, 0};
  friend bool operator==(const PlainPose&, const PlainPose&) = default;
};

/// One target of a motion, or the current state of a robot. `role` determines which members apply.
struct Target {
  std::uint32_t role = RMP_ROLE_NONE;  ///< RMP_ROLE_POSE, _POSITION (keeps its orientation), ...
  PlainPose pose;                      ///< POSE, POSITION, ROBTARGET
  std::vector<double> joints;          ///< MAIN_JOINT, JOINT: the robot's [degrees, mm]
  std::vector<double> additional;      ///< ADD_JOINT, JOINT, ROBTARGET [degrees, mm]
  std::int32_t status = 0;             ///< ROBTARGET
  std::vector<std::int32_t> turns;     ///< ROBTARGET
  friend bool operator==(const Target&, const Target&) = default;
};

/// Effective attributes of a motion: those of the statement, else the current system variables
/// (R_SPEED, ...). `given` has bit 1 << RMP_ATTR_... for those of the statement.
struct MotionAttributes {
  std::uint32_t given = 0;
  double speed = 250;             ///< [mm/s]
  double speed_orientation = 90;  ///< [degrees/s]
  double acceleration = 100;      ///< [% of the greatest]
  double time = -1;               ///< of the whole motion [s]; negative = none
  double c_cp = 0;                ///< distance from its target at which it may leave its path for
                                  ///< the next [mm]
  double c_speed = 100;           ///< speed in the transition [%]
  bool passes = false;            ///< C_PASS: no stop at its target
  bool weaves = false;            ///< WOBBLE
  double wobble_amplitude = 2;    ///< to each side [mm]: R_WOBBLE_AMPLITUDE
  double wobble_length = 6;       ///< distance along the path for one oscillation [mm]:
                                  ///< R_WOBBLE_LENGTH
  double speed_ptp = 100;         ///< [% of the greatest]
  double acceleration_ptp = 100;  ///< [%]
  double c_ptp = 0;               ///< [%]
  std::int32_t device = 1;
  std::int32_t additional_axes = 0;       ///< ADAX_CONTROL
  std::optional<PlainPose> tool;          ///< flange_T_tool of this motion
  std::optional<PlainPose> frame;         ///< base_T_frame of the targets
  std::string robot;                      ///< ACT_ROB: name of the ROBOT; "" = the process's own
  std::uint32_t robot_symbol = RMP_NONE;  ///< the same, as a row of the symbols
  friend bool operator==(const MotionAttributes&, const MotionAttributes&) = default;
};

/// A motion that a program begins. The machine numbers motions from 1.
struct Motion {
  std::uint64_t number = 0;
  std::uint64_t after = 0;    ///< an unfinished motion of the same process that this one follows,
                              ///< possibly within its approximation; 0 = none
  std::uint32_t process = 0;  ///< routine of the process, 0 = the program itself
  std::uint32_t interpolation = RMP_MOVE_PTP;
  bool is_incremental =
      false;  ///< targets are added to the pose (joints) before, in the base frame
  std::vector<Target> targets;  ///< in sequence; CIRCLE: via point, end
  MotionAttributes attributes;
  bool has_until = false;     ///< the machine may abort it before its end
  bool approximates = false;  ///< the process continues to its next motion before this one is
                              ///< finished
  rmp_span span{};
};

enum class MotionState { running, done };
/// Why a motion ends before its target.
enum class AbortReason { until, cancel, halt };

/// Inputs of a program. BOOL is 0 or 1, REAL is `real`.
struct SignalValue {
  std::int64_t integer = 0;
  double real = 0;
};

/// The cell. Implemented by the user of a machine; called by run() only, on its thread. An error
/// ends the program with a fault at the current line: its message and hint are shown unchanged.
class World {
 public:
  virtual ~World() = default;

  /// Value of an input, or current value of an output. Nothing = unknown; then only conditions of
  /// WAIT FOR and UNTIL may read it (see trace.h), elsewhere it is a fault.
  virtual Result<std::optional<SignalValue>> read_signal(const Signal&) = 0;
  virtual Result<void> write_signal(const Signal&, SignalValue) = 0;

  /// Begins a motion now, or after Motion::after. It continues without further calls.
  virtual Result<void> begin_motion(const Motion&) = 0;
  /// Whether a motion is finished at the time of this run. An error = it failed in progress.
  virtual Result<MotionState> motion_state(std::uint64_t number) = 0;
  /// Brakes a motion and drops the rest of it and all motions after it. It is finished when
  /// motion_state() reports it, possibly later (braking takes time).
  virtual Result<void> abort_motion(std::uint64_t number, AbortReason) = 0;
  /// STOP and CONTINUE of a process: hold_motion() pauses its motion, a second function resumes it.
  virtual Result<void> hold_motion(std::uint64_t number) = 0;
  virtual Result<void> resume_motion(std::uint64_t number) = 0;

  /// BRAKE: true if the robot of a motion that is held, or was aborted, is at rest.
  virtual Result<bool> stands(std::uint64_t /*number*/) { return true; }
  /// True if two names denote one robot; RMP_NONE = the program's own.
  virtual Result<bool> same_robot(std::uint32_t a, std::uint32_t b) { return a == b; }

  /// Current state of a robot: all members of Target but `role`. `robot` is a row of the symbols,
  /// or RMP_NONE = the process's own; the same applies below.
  virtual Result<Target> robot_state(std::uint32_t robot, std::uint32_t process) = 0;
  /// Pose of its flange now, in the frame of the targets [mm].
  virtual Result<PlainPose> robot_flange(std::uint32_t robot, std::uint32_t process) = 0;
  /// Speed of its tool now [mm/s].
  virtual Result<double> robot_speed(std::uint32_t robot, std::uint32_t process) = 0;
  /// TRAFO: forward kinematics. `joints` and `additional` are given.
  virtual Result<Target> forward(const Target&, std::uint32_t process) = 0;
  /// TRAFOINV: inverse kinematics of a ROBTARGET, with its status and turns.
  virtual Result<Target> inverse(const Target&, std::uint32_t process) = 0;

  /// WRITE: a piece of text; WRITELN ends with '\n'.
  virtual Result<void> write_text(std::uint32_t process, std::string_view) = 0;
  /// Writes the text of a breakpoint that does not stop.
  virtual Result<void> log_text(std::uint32_t process, const rmp_span&, std::string_view text) {
    return write_text(process, std::string(text) + "\n");
  }
  /// READ without a file: the next line of the operator without its end; nothing = not available
  /// yet.
  virtual Result<std::optional<std::string>> read_line(std::uint32_t process) = 0;
  /// PAUSE: the process waits until Machine::resume_pause().
  virtual Result<void> pause(std::uint32_t process, std::string_view message) = 0;

  /// OPEN 'R': the whole file. Names are those of the program; a world returns an error for files
  /// it does not provide.
  virtual Result<std::string> read_file(std::string_view name) = 0;
  /// CLOSE of what was opened with 'W' (replaces) or 'A' (adds), also at the program's end.
  virtual Result<void> write_file(std::string_view name, std::string_view bytes, bool adds) = 0;
};

}  // namespace robomosp::program
