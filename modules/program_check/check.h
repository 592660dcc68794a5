// SPDX-License-Identifier: Apache-2.0
// Checks of robot programs before they are posted: a run in a world that examines every motion,
// with faults at the lines of the source (layer: application, program_check).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "collision/collision.h"
#include "recording/recording.h"
#include "sim/simulate.h"
#include "task/program_inspection.h"
#include "task/run.h"

namespace robomosp::program_check {

enum class Severity : std::uint8_t { error, warning, note };
[[nodiscard]] std::string_view to_string(Severity);

enum class FaultKind : std::uint8_t {
  reach,          ///< no joint values bring the tool there
  joint_limit,    ///< a joint beyond its limits
  speed,          ///< a joint faster than it can
  acceleration,   ///< a joint's acceleration
  torque,         ///< of a joint
  contact,        ///< bodies touch
  clearance,      ///< bodies come nearer than required
  singularity,    ///< a straight motion near a singular configuration
  configuration,  ///< a straight motion leaves its configuration, or ends in another than requested
  motion,         ///< impossible, such as a speed of 0
  controller,     ///< beyond what the controller's record allows
  signal,         ///< waited for, but never set; an output that cannot have its value
  timeout,        ///< WAIT FOR timed out
  grip,           ///< found no object
  until,          ///< never came true
  program,        ///< the program ends with a fault
  ignored,        ///< an attribute that is not executed
};
[[nodiscard]] std::string_view to_string(FaultKind);

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

struct Fault {
  FaultKind kind = FaultKind::program;
  Severity severity = Severity::error;
  task::ProgramPlace place;    ///< of the worst
  std::string message, hint;   ///< of the worst; the message without a period
  std::size_t times = 1;       ///< number of motions (waits, ...) of its line with this fault
  std::size_t motion = kNone;  ///< row of Check::motions of the worst
  double from = 0, to = 0;     ///< time of the worst case, and interval around it [s]
  double at = 0;               ///< [s]
  std::string robot;
  std::int32_t joint = -1;  ///< from 0
  bool has_values = false;
  double value = 0, limit = 0, excess = 0;
  std::string unit;  ///< of these, SI
  std::string a, b;  ///< bodies
  std::vector<std::string> signals;
  bool has_position = false;
  Vec3 position{};  ///< in the world [m]
};

/// A motion as executed.
struct MotionReport {
  task::InspectedMotion motion;
  double clearance = 0;        ///< least of its rows [m]; infinite = nothing near, or not checked
  std::string nearest;         ///< "arm.forearm and table"
  double condition = 0;        ///< greatest along it; 0 = not checked
  double manipulability = 0;   ///< least along it (Yoshikawa)
  double utilisation = 0;      ///< greatest fraction of a joint's velocity limit
  std::int32_t utilised = -1;  ///< that joint
  Severity worst = Severity::note;
  bool has_fault = false;
  Vec3 end{};  ///< of the tool in the world [m]
};

/// Consecutive lines of one routine that did not run.
struct UnrunLines {
  std::uint32_t file = 0, first = 0, last = 0;
  std::uint32_t routine = 0;
  bool is_whole_routine = false;  ///< it was never called
};

/// Of an axis of the controller [degrees or mm]: its value is the sum of factor * joint, and the
/// offset.
struct AxisLimit {
  std::string robot;  ///< its name in the world
  std::string name;
  std::size_t joint = 0;                                ///< the axis's own joint; entry of q
  std::vector<std::pair<std::size_t, double>> factors;  ///< of entries of q in degrees or mm
  double offset = 0, lower = 0, upper = 0;
};

struct Options {
  double clearance = 0.005;  ///< warning below this distance [m]; 0 = contacts only
  double touch = 1e-4;       ///< contact below this distance [m]
  double condition = 100;    ///< greatest condition number of the Jacobian for a straight motion
  bool contacts = true;
  bool torques = true;
  std::vector<AxisLimit> axes;                        ///< of the controller
  double most_speed = 0, most_speed_orientation = 0;  ///< of the controller [mm/s, degrees/s]
  std::string controller;                             ///< its name
};

struct Check {
  std::vector<Fault> faults;  ///< errors first, then by line
  std::vector<MotionReport> motions;
  std::vector<UnrunLines> not_run;
  std::size_t statements = 0, statements_run = 0;
  std::vector<std::string> not_checked;  ///< checks that could not be made, a sentence each
  recording::RecordingPtr recording;
  std::shared_ptr<task::ProgramInspection> inspection;
  double duration = 0;  ///< of the program [s]
  double moving = 0;    ///< time in motions [s]
  [[nodiscard]] std::size_t count(Severity) const;
};

/// Runs programs and tasks of a world together; programs[checked] is examined, and continues after
/// its faults. The document is not changed. Errors: names without a meaning in the world, a
/// cancelled run.
[[nodiscard]] Result<Check> check(const sim::Simulator&, task::TaskRun, std::size_t checked,
                                  const Options&, Progress&);

/// The path of the tool along a motion: rows of the recording and poses in the world. For a motion
/// that failed, its planned path, without rows.
struct ToolWay {
  std::vector<std::size_t> rows;
  std::vector<Pose> world_T_tip;
};
[[nodiscard]] ToolWay tool_way(const Check&, std::size_t motion);

/// A stretch of rows with contact, or too little clearance.
struct Touch {
  std::string a, b;
  double from = 0, to = 0, at = 0;  ///< [s]; at: the worst case
  double distance = 0;              ///< the least; negative = penetration depth [m]
  Vec3 position{};                  ///< [m]
  bool is_touch = false;
};
struct Contacts {
  std::vector<Touch> touches;        ///< only unintended ones
  std::vector<double> clearance;     ///< by row, of pairs that are not intended to touch [m]
  std::vector<std::string> nearest;  ///< by row
  std::size_t meant = 0;             ///< stretches of intended contact between a gripper and its
                                     ///< part, or a part and its support
  std::vector<std::string> notes;
};
/// Contacts of a recording of several robots. Intended are: a robot and the object it is about to
/// grip or has just released; a held object until it is clear of its former support, and at its
/// destination up to a depth of 1 mm.
[[nodiscard]] Result<Contacts> contacts(const sim::Simulator&, const recording::Recording&,
                                        const Options&, const std::vector<bool>& is_jump,
                                        Progress&);

/// Objects held by robots in a row of a recording, and poses of the world's objects.
[[nodiscard]] Result<collision::ObjectPlaces> places_at(const model::World&,
                                                        const recording::Recording&,
                                                        std::size_t row);

}  // namespace robomosp::program_check
