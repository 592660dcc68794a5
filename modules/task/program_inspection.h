// SPDX-License-Identifier: Apache-2.0
// Data of a check run of a program: every motion with its place and time, and the faults, without
// an end at the first one (layer: application, task).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <robomosp/sdk/program_code.h>
#include <robomosp/sdk/robot_model.h>

#include "model/basics.h"
#include "program/machine.h"
#include "robotics/maker_axes.h"

namespace robomosp::task {

/// A place of a run: position in the program, and time.
struct ProgramPlace {
  rmp_span span{};
  std::uint32_t process = 0;              ///< routine
  std::vector<program::CallPlace> calls;  ///< innermost first
  std::size_t count = 1;                  ///< number of visits so far, including this one
  double time = 0;                        ///< [s]
};

/// The fault of a motion, in numbers.
struct MotionTrouble {
  std::int32_t joint = -1;             ///< of the robot, from 0; -1 = unknown
  double value = 0;                    ///< required joint value [rad or m]
  double excess = 0;                   ///< beyond its limit [rad or m], or distance from the target
                                       ///< [m]
  std::optional<Pose> world_T_target;  ///< not reached
};

/// A motion that a program began.
struct InspectedMotion {
  ProgramPlace place;
  std::size_t robot = 0;     ///< row of ProgramInspection::robots
  std::uint64_t number = 0;  ///< of the machine
  std::uint32_t interpolation = RMP_MOVE_PTP;
  bool is_incremental = false;
  bool has_until = false;
  bool is_cut = false;          ///< by UNTIL, or its process was ended
  bool is_carried_out = false;  ///< else it failed, and the robot was placed at its end, or stayed
  bool is_jump = false;         ///< the robot was placed at its end: the path there is unknown
  bool is_displaced = false;    ///< the robot was not at the position assumed by the program
  double start = 0, end = 0;    ///< [s]
  double speed = 0;             ///< set by the program [mm/s]; of PTP [%]
  double asked_status = -1;     ///< STATUS of its last target; -1 = any
  std::int32_t tip_joint = -1;
  Pose joint_T_tip;
  std::optional<Pose> base_T_frame;   ///< of its targets
  std::optional<Pose> base_T_target;  ///< its last target, where it is one in space
  std::vector<double> q_target;       ///< joints at its end, as planned [rad or m]
  std::vector<double> additional;     ///< additional joints of its last target [degrees or mm]
  std::string error, hint;            ///< if it is not carried out
  bool is_unreachable = false;        ///< error: no joint values; else the motion itself is
                                      ///< impossible
  MotionTrouble trouble;
  /// For a failing path: world_T_tip along it, and whether the robot reaches it.
  std::vector<Pose> way;
  std::vector<bool> is_reached;
};

/// Another event to report.
struct InspectedEvent {
  enum class Kind : std::uint8_t {
    fault,    ///< of the program: it ended there
    grip,     ///< a grip found nothing
    signal,   ///< WAIT FOR with a condition that can never be true; it continued as if it were
    stuck,    ///< waits that nothing ends (semaphore, other); the program ended there
    timeout,  ///< WAIT FOR timed out
    ignored,  ///< an attribute that is not executed
    pause,    ///< PAUSE without an operator
    output,   ///< an output that cannot have its value
  };
  Kind kind = Kind::fault;
  ProgramPlace place;
  std::string message, hint;
  std::vector<std::string> signals;  ///< names in the program
};

struct InspectedRobot {
  std::string name;
  std::shared_ptr<const RobotModel> model;
  Pose world_T_base;
  model::ProviderChoice ik;
  std::shared_ptr<const robotics::MakerAxes> maker;  ///< axes of its maker, for messages
};

/// Filled while a program runs. With it, a run continues after faults that would end it: a failed
/// motion leaves the robot at its end if that is reachable, else in place; a wait that can never
/// end is waived, once per place. [the run's thread]
struct ProgramInspection {
  // ---- inputs ----
  double most_speed = 0, most_speed_orientation = 0;  ///< [mm/s, degrees/s] of paths; 0 = none
  std::size_t most_motions = 100'000;                 ///< limit of recorded motions
  // ---- results ----
  std::vector<InspectedRobot> robots;
  std::vector<InspectedMotion> motions;
  std::vector<InspectedEvent> events;
  std::vector<std::size_t> additional;  ///< rows of the robots moved by its additional joints
  std::size_t motions_left_out = 0;
  std::size_t events_left_out = 0;
  std::size_t motions_slowed = 0;           ///< by most_speed
  std::optional<program::Machine> machine;  ///< its state at the end
  double end = 0;                           ///< of the program [s]
  std::vector<std::string> companions;      ///< programs and tasks running at the same time
  bool is_over = false;                     ///< it ended normally
  bool is_dead = false;                     ///< it ended by a fault
  bool is_out_of_time = false;              ///< the run's most_time was exceeded
  std::string run_error, run_hint;          ///< why the run ended, if not by this program
  // ---- while it runs ----
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, std::size_t> counts;
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, std::size_t> waived;
  std::map<std::size_t, Pose> wanted;  ///< base_T_tip, by actor: the position assumed by the
                                       ///< program
};

}  // namespace robomosp::task
