// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.post/1: a compiled program to the files of a controller's own language
// (layer: contract, std only).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/program_code.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// What a language can express, to be summed by `|`. The rest is rewritten by the host if it can
/// (passes of the command program.post), or is an error at its line of the program.
enum PostFeature : std::uint64_t {
  kPostProcedures = 1ULL << 0U,
  kPostFunctions = 1ULL << 1U,      ///< of one result
  kPostParameters = 1ULL << 2U,     ///< that are only read
  kPostOutParameters = 1ULL << 3U,  ///< OUT and INOUT
  kPostRecursion = 1ULL << 4U,
  kPostLocals = 1ULL << 5U,  ///< variables of a routine, new at each call
  kPostIntegers = 1ULL << 6U,
  kPostReals = 1ULL << 7U,
  kPostBooleans = 1ULL << 8U,  ///< as values that are kept
  kPostStrings = 1ULL << 9U,
  kPostArrays = 1ULL << 10U,
  kPostRecords = 1ULL << 11U,      ///< of the user
  kPostPoses = 1ULL << 12U,        ///< variables of poses, with fields
  kPostPoseProduct = 1ULL << 13U,  ///< the operator @ and INV at run time
  kPostJointValues = 1ULL << 14U,  ///< variables of joints
  kPostFunctionsOfMath = 1ULL << 15U,
  kPostIf = 1ULL << 16U,
  kPostElsif = 1ULL << 17U,  ///< else they are nested
  kPostWhile = 1ULL << 18U,
  kPostRepeat = 1ULL << 19U,
  kPostLoop = 1ULL << 20U,
  kPostExit = 1ULL << 21U,
  kPostFor = 1ULL << 22U,
  kPostForStep = 1ULL << 23U,  ///< other steps than 1
  kPostCase = 1ULL << 24U,
  kPostGoto = 1ULL << 25U,
  kPostReturn = 1ULL << 26U,     ///< from within a routine
  kPostProcesses = 1ULL << 27U,  ///< parallel tasks, semaphores
  kPostInterrupts = 1ULL << 28U,
  kPostWaitFor = 1ULL << 29U,
  kPostWaitTimeout = 1ULL << 30U,
  kPostUntil = 1ULL << 31U,            ///< a motion ends early by a condition
  kPostVariableTargets = 1ULL << 32U,  ///< motions to what is computed at run time
  kPostVariableAttributes = 1ULL << 33U,
  kPostMessages = 1ULL << 34U,  ///< WRITE, WRITELN
  kPostFiles = 1ULL << 35U,
  kPostLists = 1ULL << 36U,
  kPostPause = 1ULL << 37U,
  kPostOutputsAreRead = 1ULL << 38U,  ///< an output's state is a value
  kPostTools = 1ULL << 39U,           ///< attribute TOOL
  kPostFrames = 1ULL << 40U,          ///< attribute FRAME
  kPostTime = 1ULL << 41U,            ///< attribute TIME
  kPostTeach = 1ULL << 42U,
  kPostShortCircuit = 1ULL << 43U,  ///< AND and OR look at their right side only where it counts
  /// In a flattened program procedures are separate programs in separate files: one that is
  /// too long is divided into such.
  kPostParts = 1ULL << 44U,
};

/// Motions that it has, to be summed by `|`. Circles that it has none of become chords, PATH a
/// sequence of LIN that blend, increments absolute targets where the pose before is known.
enum PostMotions : std::uint32_t {
  kPostPtpJoints = 1,
  kPostPtpPose = 2,
  kPostLinPose = 4,
  kPostLinJoints = 8,
  kPostCircle = 16,
  kPostPath = 32,
  kPostPtpIncrement = 64,
  kPostLinIncrement = 128,
};

enum class PostCircle : std::int32_t { none = 0, via = 1, centre = 2 };
/// How it says that a motion need not stop at its target.
enum class PostBlending : std::int32_t {
  none = 0,
  distance = 1,  ///< from the target [mm]
  percent = 2,
  radius = 3,    ///< [mm]; two may not overlap
  zone = 4,      ///< named steps
  accuracy = 5,  ///< passed within so much [mm]
};
enum class PostSpeed : std::int32_t {
  mm_per_s = 0,
  m_per_s = 1,
  mm_per_min = 2,
  percent = 3,  ///< of the profile's greatest
  time = 4,
};
enum class PostCase : std::int32_t { kept = 0, upper = 1, lower = 2 };
enum class PostCharset : std::int32_t { ascii = 0, latin1 = 1, utf8 = 2 };

/// What is fed to it, to be summed by `|`.
enum PostForm : std::uint32_t {
  kPostStructured = 1,  ///< the program as it was written
  kPostFlat = 2,        ///< what it did in a run: motions, outputs and waits, one behind the other
};

/// What a target can say. Constant data of the provider.
struct PostCapabilities {
  std::uint32_t struct_size = sizeof(PostCapabilities);  ///< see plugin.h
  std::uint32_t forms = kPostStructured | kPostFlat;     ///< PostForm
  std::uint64_t features = 0;                            ///< PostFeature
  std::uint32_t motions = 0;                             ///< PostMotions
  PostCircle circle = PostCircle::none;
  PostBlending blending = PostBlending::none;
  PostSpeed speed = PostSpeed::mm_per_s;
  std::int32_t external_axes = 0;  ///< at most
  std::int32_t max_name = 32;      ///< bytes of a name
  PostCase name_case = PostCase::kept;
  bool case_matters = false;  ///< whether names that differ in case only are two
  PostCharset charset = PostCharset::ascii;
  bool crlf = false;            ///< lines end with CR LF
  std::int32_t max_points = 0;  ///< of a program; 0 = any number
  std::int32_t max_lines = 0;
  std::int32_t max_nesting = 0;
  std::string_view reserved;    ///< words that are no names, separated by blanks
  std::string_view extensions;  ///< of its files, without dots, comma-separated; the main one first
  std::string_view title;       ///< such as "KUKA KRL"
};

/// Bits of a configuration, and their meaning.
enum PostStatus : std::uint32_t {
  kPostShoulderBehind = 1,  ///< the wrist is behind the first axis
  kPostElbowOther = 2,      ///< the elbow is bent in the other direction
  kPostWristFlipped = 4,
};

/// A target that is known before the program runs: the value of an expression.
struct PostPoint {
  std::uint32_t expression = RMP_NONE;
  std::uint32_t motion = RMP_NONE;     ///< the first that goes there; none = a tool or a frame
  std::uint32_t role = RMP_ROLE_NONE;  ///< rmp_type_role of the expression
  Pose pose;                           ///< frame_T_tip [m], where `has_pose`
  std::span<const double> q;           ///< of the robot [rad or m]; empty = not known
  std::span<const double> external;    ///< additional joints [degrees or mm], as the program says
  std::uint32_t status = 0;            ///< PostStatus of q, or as the program says
  std::uint32_t status_known = 0;      ///< which of them count
  bool has_pose = false;
  bool has_status = false;     ///< the program says it itself (ROBTARGET)
  const char* q_missing = "";  ///< why q is not known, a sentence without its period
  /// Whole turns of the joints from `turns_first` on, where the program says them itself; of q,
  /// where it is known, they follow (program_turns.h).
  std::span<const std::int32_t> turns;
  std::uint32_t turns_first = 0;
  double turns_from = -180;  ///< where turn 0 begins [degrees]
  std::array<std::uint64_t, 4> room{};
};

/// Kinematics of the robot that the program is for. Implemented by the host. [any thread]
class PostKinematics {
 public:
  virtual ~PostKinematics() = default;
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// base_T_tip of a configuration; the tip is the flange that TOOL of a motion is on.
  [[nodiscard]] virtual Result<Pose> forward(std::span<const double> q) const = 0;
  /// The configuration nearest the seed that puts the tip there, of those with this PostStatus (-1
  /// = any); ErrorCode::unreachable = there is none.
  [[nodiscard]] virtual Result<std::vector<double>> inverse(const Pose& base_T_tip,
                                                            std::span<const double> seed,
                                                            std::int64_t status) const = 0;
  /// PostStatus of a configuration; `known`: which bits this robot has.
  [[nodiscard]] virtual std::uint32_t status(std::span<const double> q,
                                             std::uint32_t& known) const = 0;
};

/// Where the sense and the zero of an axis are from.
enum class PostAxisOrigin : std::int32_t {
  not_known = 0,  ///< nobody gives them: the joint counts as it is
  profile = 1,    ///< the controller's profile gives a sign or an offset
  robot = 2,      ///< the maker's axes of the robot
};
/// How an axis of the controller is made of joints: value = sign * joint + offset, and the coupled
/// joints times their factors. post_axes.h computes it in both directions.
struct PostAxis {
  std::string_view name;    ///< such as "A1"
  std::int32_t joint = -1;  ///< entry of q; of the additional joints where `external`
  bool external = false;
  bool linear = false;  ///< mm, else degrees
  double sign = 1;
  double offset = 0;            ///< [degrees or mm]
  double pulses = 0;            ///< per degree or mm; 0 = not given
  double lower = 0, upper = 0;  ///< [degrees or mm], where lower < upper
  /// Factors of further joints, by entry of q; empty = none.
  std::span<const double> coupled{};
  PostAxisOrigin origin = PostAxisOrigin::not_known;
  /// 1: an external axis of the controller is a joint of the robot, and `joint` an entry of q; 2 is
  /// added where the name of an axis of the robot is from the profile.
  std::int32_t of_robot = 0;
  std::array<std::uint64_t, 5> room{};
};
/// How a signal of the program is called there.
struct PostSignal {
  std::string_view name;     ///< in the program
  std::string_view target;   ///< name there; "" = by number
  std::int32_t number = -1;  ///< there; -1 = as the program says
  std::string_view kind;     ///< a word of the target, such as "hand"; may be empty
  bool inverted = false;
  Room room{};
};
/// A tool or a frame that the controller keeps.
struct PostPlace {
  std::string_view name;
  std::int32_t number = -1;
  Pose pose;        ///< flange_T_tool, or base_T_frame [m]
  double mass = 0;  ///< of a tool [kg]
  Vec3 com{};       ///< in the flange's frame [m]
  Room room{};
};
/// Anything else that a target wants to know, as text.
struct PostOption {
  std::string_view name, value;
  Room room{};
};
/// The controller that the program is for: data that users keep. Made by the host.
struct PostProfile {
  std::uint32_t struct_size = sizeof(PostProfile);  ///< see plugin.h
  std::string_view name;
  std::span<const PostAxis> axes;  ///< in the controller's order, external ones behind
  std::span<const PostSignal> signals;
  std::span<const PostPlace> tools, frames;
  std::int32_t tool = -1, frame = -1;   ///< of `tools` and `frames`: in use at the start
  std::string_view prologue, epilogue;  ///< lines of the target's own language, as they are
  std::int32_t length_digits = 3, angle_digits = 4, speed_digits = 3;  ///< behind the point
  std::int32_t max_points = 0, max_lines = 0;  ///< of this controller; 0 = as the target's
  std::int32_t max_bytes = 0;                  ///< of a file
  double max_speed = 0;                        ///< of the tool [mm/s]; 0 = not given
  double max_speed_ori = 0;                    ///< [degrees/s]
  std::span<const PostOption> options;
};

/// What is written. Made by the host; may gain fields at the end.
struct PostTask {
  std::uint32_t struct_size = sizeof(PostTask);  ///< see plugin.h
  const rmp_code* code = nullptr;  ///< without errors; what the target cannot say is rewritten
  std::uint32_t form = kPostStructured;
  std::string_view name;              ///< of the program there: mangled, unique
  std::span<const PostPoint> points;  ///< by rising expression
  const RobotModel* robot = nullptr;  ///< nullptr = no robot was named
  const PostKinematics* kinematics = nullptr;
  const PostProfile* profile = nullptr;  ///< never nullptr
  /// 1 = neither robot nor profile define the axes of the controller: posts that write joint
  /// values, turns or a configuration warn. Check struct_size first.
  std::uint32_t axes_are_unknown = 0;
};

/// Where a post writes to. Implemented by the host; its calls are made from one thread.
class PostOutput {
 public:
  virtual ~PostOutput() = default;
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// A file, whole. Names may have folders ("app/app.pjx"); each comes once.
  virtual void file(std::string_view name, std::string_view bytes) = 0;
  /// Line `line` (1 is the first) of a file comes from there.
  virtual void from(std::string_view file, std::uint32_t line, const rmp_span& span) = 0;
  /// rmp_fault_severity. With an error no file is kept. What a target cannot express is an error,
  /// with a workaround in `hint`; a difference from the program (rounded, nearest) is a warning or
  /// a note.
  virtual void fault(std::uint32_t severity, const rmp_span& span, std::string_view message,
                     std::string_view hint) = 0;
};

/// Interface robomosp.post/1. [any thread]
class Post {
 public:
  using Interface = Post;
  static constexpr const char* kInterfaceId = "robomosp.post/1";
  virtual ~Post() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  [[nodiscard]] virtual const PostCapabilities& capabilities() const = 0;
  /// Equal tasks give equal files. Nothing of the program is left out without a fault. An error is
  /// what keeps the post itself from its work, such as being cancelled.
  virtual Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const = 0;
};

}  // namespace robomosp
