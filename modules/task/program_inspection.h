// SPDX-License-Identifier: Apache-2.0
// What a check of a program asks of its run: every motion with its place and time, and what went
// wrong, without an end at the first fault (layer: application, task).
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

/// A place of a run: where the program was, and when.
struct ProgramPlace {
  rmp_span span{};
  std::uint32_t process = 0;              ///< routine
  std::vector<program::CallPlace> calls;  ///< innermost first
  std::size_t count = 1;                  ///< how often it had come there, this time included
  double time = 0;                        ///< [s]
};

/// What went wrong with a motion, in numbers.
struct MotionTrouble {
  std::int32_t joint = -1;             ///< of the robot, from 0; -1 = none known
  double value = 0;                    ///< that the joint would have [rad or m]
  double excess = 0;                   ///< beyond its limit [rad or m], or short of the target [m]
  std::optional<Pose> world_T_target;  ///< that is not reached
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
  bool is_carried_out = false;  ///< else it failed, and the robot was put at its end, or stays
  bool is_jump = false;         ///< the robot was put at its end: nothing on the way is known
  bool is_displaced = false;    ///< the robot was not where the program takes it to be
  double start = 0, end = 0;    ///< [s]
  double speed = 0;             ///< that the program gives [mm/s]; of PTP [%]
  double asked_status = -1;     ///< STATUS of its last target; -1 = any
  std::int32_t tip_joint = -1;
  Pose joint_T_tip;
  std::optional<Pose> base_T_frame;   ///< of its targets
  std::optional<Pose> base_T_target;  ///< its last target, where it is one in space
  std::vector<double> q_target;       ///< joints at its end, as planned [rad or m]
  std::vector<double> additional;     ///< additional joints of its last target [degrees or mm]
  std::string error, hint;            ///< where it is not carried out
  bool is_unreachable = false;        ///< error: no joint values, else it is not possible at all
  MotionTrouble trouble;
  /// Of a path that fails: world_T_tip along it, and whether the robot reaches it.
  std::vector<Pose> way;
  std::vector<bool> is_reached;
};

/// Something else than a motion that is worth a word.
struct InspectedEvent {
  enum class Kind : std::uint8_t {
    fault,    ///< of the program: it ended there
    grip,     ///< a grip found nothing
    signal,   ///< WAIT FOR of what can never come; it went on as if it had
    stuck,    ///< waits that nobody ends (semaphore, other); the program ended there
    timeout,  ///< WAIT FOR ran out of time
    ignored,  ///< an attribute that is not carried out
    pause,    ///< PAUSE, which nobody ends
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

/// Is filled while a program runs. Given to a run, a program goes on behind what would end it: a
/// motion that fails leaves the robot at its end where that is reached, else where it was; a wait
/// that can never end is waived, once a place. [the run's thread]
struct ProgramInspection {
  // ---- asked ----
  double most_speed = 0, most_speed_orientation = 0;  ///< [mm/s, degrees/s] of paths; 0 = none
  std::size_t most_motions = 100'000;                 ///< that are kept
  // ---- told ----
  std::vector<InspectedRobot> robots;
  std::vector<InspectedMotion> motions;
  std::vector<InspectedEvent> events;
  std::vector<std::size_t> additional;  ///< rows of the robots that its additional joints move
  std::size_t motions_left_out = 0;
  std::size_t events_left_out = 0;
  std::size_t motions_slowed = 0;           ///< by most_speed
  std::optional<program::Machine> machine;  ///< as it is at the end
  double end = 0;                           ///< of the program [s]
  std::vector<std::string> companions;      ///< programs and tasks that ran beside it
  bool is_over = false;                     ///< it came to its end
  bool is_dead = false;                     ///< it ended by a fault
  bool is_out_of_time = false;              ///< the run's most_time was up
  std::string run_error, run_hint;          ///< why the run ended, of others than the program
  // ---- while it runs ----
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, std::size_t> counts;
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, std::size_t> waived;
  std::map<std::size_t, Pose> wanted;  ///< base_T_tip, by actor: where the program takes it to be
};

}  // namespace robomosp::task
