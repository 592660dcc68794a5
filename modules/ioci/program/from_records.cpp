// SPDX-License-Identifier: Apache-2.0
// Programs of robots made of what a world has already: tasks, trajectories, recordings.
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <set>

#include "ioci/core/commands.h"
#include "ioci/program/source_text.h"
#include "ioci/world/members.h"
#include "kernel/expression.h"
#include "model/program.h"
#include "model/program_kinds.h"
#include "motion/segment.h"
#include "program_post/cell.h"
#include "robotics/grip.h"
#include "robotics/single_joints.h"
#include "spatial/passing.h"
#include "spatial/pose.h"
#include "task/members.h"
#include "task/task_executor.h"

namespace robomosp::ioci {
namespace {

using model::StepKind;
using model::TaskStep;
using model::World;
using text::quote;

constexpr double kMm = 1e3, kPercent = 100;
/// Of straight moves of tasks that give none [m/s] (task/moves.cpp).
constexpr double kToolSpeed = 0.25;

/// A robot of a world as programs see it.
struct Arm {
  std::string name;
  const model::Robot* record = nullptr;
  std::shared_ptr<const RobotModel> model;
  Pose base_T_world;
};

Result<Arm> arm_of(CommandContext& ctx, const World& w, std::size_t which) {
  const model::PlacedRobot& placed = w.robots[which];
  Arm a;
  a.name = placed.name;
  a.record = ctx.snapshot().get(placed.robot);
  const Pose mounting = model::pose(placed.placement);
  RMP_TRY_ASSIGN(a.model, ctx.app.derived.robot_model(ctx.snapshot(), placed.robot,
                                                      spatial::rotate_back(mounting, w.gravity),
                                                      ctx.progress));
  a.base_T_world = spatial::inverse(spatial::compose(mounting, a.model->base));
  if (const std::string why = robotics::why_not_single_joints(*a.model); !why.empty())
    return error(ErrorCode::unsupported,
                 "robot " + quote(a.name) + ": " + why + ", which programs do not support",
                 "Use another robot.");
  return a;
}

/// A program while it is written, with what its reader has to be told.
class Source {
 public:
  explicit Source(const Arm& arm) : arm_(arm) {}

  IrlNames names;
  IrlLines body;
  std::vector<std::string> notes;

  void note(const std::string& text) {
    if (std::find(notes.begin(), notes.end(), text) == notes.end()) notes.push_back(text);
  }
  [[nodiscard]] Result<std::string> joints(std::span<const double> q) const {
    if (q.size() != arm_.model->joints.size())
      return error(ErrorCode::invalid_argument, "robot " + quote(arm_.name) + " has " +
                                                    std::to_string(arm_.model->joints.size()) +
                                                    " joints, but " + std::to_string(q.size()) +
                                                    " values are given");
    std::string out = "MAIN_JOINT(";
    for (std::size_t j = 0; j < q.size(); ++j)
      out += (j ? ", " : "") +
             irl_real(q[j] * (arm_.model->joints[j].type == JointType::revolute ? kDegreesPerRadian
                                                                                : kMm));
    return out + ")";
  }
  [[nodiscard]] const Arm& arm() const { return arm_; }

 private:
  const Arm& arm_;
};

/// TOOL of motions to places, where the robot has another tool than its flange: the program then
/// says what it moves wherever it is posted. Empty = none.
std::string tool_words(const Arm& arm) {
  const robotics::LinkFrame flange = robotics::flange_frame(*arm.record);
  const TipModel& tip = arm.model->tips.front();
  if (tip.joint != flange.joint) return {};
  const auto tool = program_post::unless_identity(
      spatial::compose(spatial::inverse(flange.joint_T_link), tip.tool));
  return tool ? " TOOL := " + irl_pose(*tool) : std::string();
}
/// Statements of motions to places, with `words` behind their attributes.
std::string with_tool(const std::string& text, const std::string& words) {
  if (words.empty()) return text;
  std::string out;
  bool is_motion = false;
  for (const std::string_view line : text::split(text, '\n')) {
    const std::size_t first = line.find_first_not_of(' ');
    if (first != std::string_view::npos && line.substr(first).starts_with("MOVE "))
      is_motion = line.find("JOINT(") == std::string_view::npos;
    std::string own(line);
    if (const std::size_t end = own.find(';'); is_motion && end != std::string::npos) {
      own.insert(end, words);
      is_motion = false;
    }
    out += own + "\n";
  }
  out.pop_back();
  return out;
}

/// The record, of a program whose declarations are `head`.
Result<Value> finish(CommandContext& ctx, const Map& args, const Source& source,
                     const std::string& stem, const std::string& from, const std::string& head,
                     const std::string& routines) {
  const std::string name = has(args, "name") ? text_of(args, "name") : stem;
  IrlNames names;
  const std::string id = names.name("", name);
  const std::string cell = irl_cell(source.arm().model->joints.size());
  std::string text = "PROGRAM " + id + ";\n" + irl_comment(from) + "\n";
  for (const std::string& n : source.notes) text += irl_comment(n) + "\n";
  if (!cell.empty()) text += "SYSTEM_SPECIFICATION '" + id + ".ssi';\n";
  const std::string tool = tool_words(source.arm());
  text += head + with_tool(routines, tool) + "BEGIN\n" + with_tool(source.body.text(), tool) +
          "ENDPROGRAM;\n";
  model::Program p;
  p.description = from;
  const auto add = [&](const std::string& file, const std::string& all) {
    model::ProgramFile f{file, {}};
    for (const std::string_view line : text::split(all, '\n')) f.lines.emplace_back(line);
    p.files.push_back(std::move(f));
  };
  add(id + ".irl", text);
  if (!cell.empty()) add(id + ".ssi", cell);
  for (const std::string& n : source.notes)
    ctx.app.messages.post(Severity::warning, "program_differs", n, "program");
  model::Record r;
  r.name = name;
  r.body = model::OtherContent(program_kind(), std::move(p));
  RMP_TRY_ASSIGN(const AnyId made, ctx.edit().add(std::move(r)));
  return Value(Application::handle(made));
}

// ---- trajectories ----

const double* real_param(const model::TrajectorySegment& s, const char* name) {
  const auto it = s.shape.params.find(name);
  return it == s.shape.params.end() ? nullptr : std::get_if<double>(&it->second);
}

/// 100 % of ACC (task/program_cell.h).
constexpr double kFullAcceleration = 2.5;  // [m/s^2]

/// SPEED and what goes with it, of a segment whose law is a trapezoid.
Result<std::string> trapezoid_words(CommandContext& ctx, const model::TrajectorySegment& s,
                                    Source& source) {
  RMP_TRY_ASSIGN(const auto providers, motion::providers_of(ctx.app.registry, s, "segment"));
  RMP_TRY_ASSIGN(const auto params, motion::params_of(providers, s, "segment"));
  const double acceleration = params.law->real("acceleration");
  std::string out = " SPEED := " + irl_real(kMm * params.law->real("speed"));
  out += " SPEED_ORI := " + irl_real(kDegreesPerRadian * params.law->real("angular_speed"));
  if (acceleration < kFullAcceleration)
    out += " ACC := " + irl_real(kPercent * acceleration / kFullAcceleration);
  if (acceleration > kFullAcceleration)
    source.note("Accelerations above 2.5 m/s^2 are 2.5 m/s^2 in the program, which takes longer.");
  return out;
}

/// The motions of a trajectory that stands at `base_T_trajectory`.
class Motions {
 public:
  Motions(CommandContext& ctx, Source& source, std::int64_t samples)
      : ctx_(ctx), source_(source), samples_(samples) {}

  Result<void> write(const model::Trajectory& t, const Pose& base_T, int depth = 0) {
    constexpr int kDeepest = 60;
    if (depth > kDeepest)
      return error(ErrorCode::conflict, "its stored trajectories refer to each other",
                   "Remove one of them.");
    for (std::size_t i = 0; i < t.segments.size(); ++i) {
      const auto done = segment(t.segments[i], base_T, depth);
      if (!done.ok()) return Error(done.error()).in("segment " + std::to_string(i + 1));
      if (i + 1 < t.segments.size()) flush(&t.segments[i + 1].transition);
    }
    flush(nullptr);
    return {};
  }

 private:
  /// A motion is written when it is known how the next one follows.
  void flush(const model::Transition* next) {
    if (pending_.empty()) return;
    std::string line = pending_;
    pending_.clear();
    if (next && next->is_smooth && next->distance > 0) {
      line += " C_CP := " + irl_real(kMm * next->distance);
    } else if (next && next->is_smooth) {
      source_.note(
          "Where segments do not meet, the program stops: transitions without a distance have no "
          "counterpart in the language.");
    }
    source_.body.add(line + ";");
  }
  Result<void> segment(const model::TrajectorySegment& s, const Pose& base_T, int depth) {
    if (s.stored) {
      const model::Trajectory* stored = ctx_.snapshot().get(s.stored);
      if (!stored)
        return error(ErrorCode::stale_handle, "its trajectory no longer exists",
                     "Give another one.");
      return write(*stored, spatial::compose(base_T, model::pose(s.placement)), depth + 1);
    }
    RMP_TRY_ASSIGN(const auto providers, motion::providers_of(ctx_.app.registry, s, "segment"));
    if (providers.is_joint()) return joint_segment(s, base_T);
    RMP_TRY_ASSIGN(const auto made, motion::make_segment(ctx_.app.registry, s, "segment"));
    const double duration = made->duration();
    std::string attributes;
    const double* speed = real_param(s, "speed");
    const std::string& law = s.law.name;
    if (speed && !s.shape.params.contains("duration") && law == "trapezoidal") {
      RMP_TRY_ASSIGN(attributes, trapezoid_words(ctx_, s, source_));
    } else if (speed && !s.shape.params.contains("duration") &&
               (law.empty() || law == "constant_speed")) {
      attributes = " SPEED := " + irl_real(kMm * *speed);
      source_.note(
          "Segments at constant speed start and end at rest in the program, which takes longer, "
          "except where they are blended.");
    } else {
      attributes = " TIME := " + irl_real(duration);
      if (!law.empty() && law != "trapezoidal")
        source_.note("Segments of the law " + quote(law) +
                     " keep their duration, with a trapezoidal profile.");
    }
    std::vector<PathSample> at(1);
    const double begin = 0;
    RMP_TRY(made->sample(std::span(&begin, 1), at));
    approach(spatial::compose(base_T, at[0].pose));
    const auto place = [&](double t) -> Result<std::string> {
      std::vector<PathSample> one(1);
      RMP_TRY(made->sample(std::span(&t, 1), one));
      last_ = spatial::compose(base_T, one[0].pose);
      return irl_pose(last_);
    };
    if (s.shape.name == "line") {
      RMP_TRY_ASSIGN(const std::string to, place(duration));
      pending_ = "MOVE LIN " + to + attributes;
    } else if (s.shape.name == "arc" && s.points.size() == 3) {
      RMP_TRY_ASSIGN(const std::string to, place(duration));
      pending_ = "MOVE CIRCLE " + irl_pose(spatial::compose(base_T, model::pose(s.points[1]))) +
                 ", " + to + attributes;
    } else {
      std::string line = "MOVE PATH ";
      for (std::int64_t k = 1; k <= samples_; ++k) {
        RMP_TRY_ASSIGN(const std::string to,
                       place(duration * static_cast<double>(k) / static_cast<double>(samples_)));
        line += (k > 1 ? ",\n    " : "") + to;
      }
      pending_ = line + attributes;
      source_.note("Segments of the shape " + quote(s.shape.name) + " are paths through " +
                   std::to_string(samples_) + " points of them.");
    }
    return {};
  }
  Result<void> joint_segment(const model::TrajectorySegment& s, const Pose& base_T) {
    std::string attributes;
    if (const double* d = real_param(s, "duration"))
      attributes = " TIME := " + irl_real(*d / static_cast<double>(std::max<std::size_t>(
                                                   1, s.joints.size() + s.points.size())));
    else if (const double* share = real_param(s, "speed_share"))
      attributes = " SPEED_PTP := " + irl_real(kPercent * *share);
    if (s.shape.name != "ptp")
      source_.note("Segments of the shape " + quote(s.shape.name) +
                   " are joint motions from one of their points to the next.");
    std::vector<std::string> places;
    for (const auto& q : s.joints) {
      RMP_TRY_ASSIGN(std::string to, source_.joints(q));
      places.push_back(std::move(to));
    }
    for (const auto& p : s.points)
      places.push_back(irl_pose(spatial::compose(base_T, model::pose(p))));
    for (const std::string& to : places) {
      flush(nullptr);
      pending_ = "MOVE PTP " + to + attributes;
    }
    is_known_ = false;
    return {};
  }
  /// To the begin of a segment, where the one before does not end there.
  void approach(const Pose& begin) {
    constexpr double kSame = 1e-6;
    bool is_there = is_known_;
    for (std::size_t k = 0; k < 3; ++k)
      is_there = is_there && std::fabs(begin.p[k] - last_.p[k]) < kSame;
    for (std::size_t k = 0; k < 9; ++k)
      is_there = is_there && std::fabs(begin.R[k] - last_.R[k]) < kSame;
    if (!is_there) {
      const bool is_first = !is_known_ && pending_.empty();
      flush(nullptr);
      source_.body.add((is_first ? "MOVE PTP " : "MOVE LIN ") + irl_pose(begin) + ";");
    }
    last_ = begin;
    is_known_ = true;
  }

  CommandContext& ctx_;
  Source& source_;
  std::int64_t samples_;
  std::string pending_;
  Pose last_;
  bool is_known_ = false;
};

Result<Value> from_trajectory(CommandContext& ctx, const Map& args) {
  const World& w = content<World>(ctx, args, "world");
  const std::string where = name_in(ctx, ref(args, "world"));
  RMP_TRY_ASSIGN(const std::size_t robot,
                 find_robot(ctx, typed<World>(args, "world"), *args.find("robot"), where));
  RMP_TRY_ASSIGN(const std::size_t which, find_trajectory(ctx, typed<World>(args, "world"),
                                                          *args.find("trajectory"), where));
  RMP_TRY_ASSIGN(const Arm arm, arm_of(ctx, w, robot));
  const model::PlacedTrajectory& placed = w.trajectories[which];
  Source source(arm);
  source.body.in();
  Motions motions(ctx, source, integer(args, "points"));
  auto done = motions.write(*ctx.snapshot().get(placed.trajectory),
                            spatial::compose(arm.base_T_world, model::pose(placed.placement)));
  if (!done.ok()) return std::move(done).error().in("trajectory " + quote(placed.name));
  return finish(ctx, args, source, placed.name,
                "Of the trajectory " + placed.name + " for the robot " + arm.name + " of " + where,
                {}, {});
}

// ---- tasks ----

/// Joint values of a robot, where they are known.
using Known = std::optional<std::vector<double>>;

bool is_same(const Known& a, const Known& b) {
  constexpr double kSame = 1e-9;
  if (!a || !b || a->size() != b->size()) return !a && !b;
  for (std::size_t j = 0; j < a->size(); ++j)
    if (std::fabs((*a)[j] - (*b)[j]) > kSame) return false;
  return true;
}

/// How moves of a task go from where a robot stands, as runs carry them out.
class Rehearsal {
 public:
  static Result<Rehearsal> create(CommandContext& ctx, WorldId world, const std::string& robot) {
    constexpr double kStep = 0.02;  // [s]
    Rehearsal out(ctx, robot);
    RMP_TRY_ASSIGN(auto executor,
                   task::TaskExecutor::create(*out.simulator_, world, kStep, ctx.progress));
    out.executor_ = std::make_unique<task::TaskExecutor>(std::move(executor));
    return out;
  }
  [[nodiscard]] Known start() const { return joints(0); }
  struct Went {
    double time = 0;  ///< [s]
    std::vector<double> q;
  };
  /// Nothing = it cannot go from there.
  std::optional<Went> from(const std::vector<double>& q, const TaskStep& step) {
    TaskStep there;
    there.kind = StepKind::move;
    there.joints = q;
    const auto stands = executor_->move(there, robot_, {}, now_, ctx_->progress);
    if (!stands.ok()) return std::nullopt;
    now_ = *stands;
    const auto end = executor_->move(step, robot_, {}, now_, ctx_->progress);
    if (!end.ok()) return std::nullopt;
    const double took = *end - std::exchange(now_, *end);
    const Known at = joints(now_);
    if (!at) return std::nullopt;
    return Went{took, *at};
  }

 private:
  Rehearsal(CommandContext& ctx, std::string robot)
      : ctx_(&ctx),
        robot_(std::move(robot)),
        simulator_(std::make_unique<sim::Simulator>(
            sim::Simulator{ctx.app.registry, ctx.app.derived, ctx.snapshot()})) {}
  [[nodiscard]] Known joints(double t) const {
    for (const auto& [name, q] : executor_->joints(t))
      if (name == robot_) return q;
    return std::nullopt;
  }
  CommandContext* ctx_;
  std::string robot_;
  std::unique_ptr<sim::Simulator> simulator_;
  std::unique_ptr<task::TaskExecutor> executor_;
  double now_ = 0;
};

/// With what procedures begin: known only where all their calls agree.
using Entries = std::map<std::uint64_t, Known>;

class TaskWriter {
 public:
  TaskWriter(CommandContext& ctx, const World& world, Source& source, Rehearsal& rehearsal,
             Entries& entries)
      : ctx_(ctx),
        world_(world),
        source_(source),
        rehearsal_(rehearsal),
        entries_(entries),
        stands_{{"", rehearsal.start()}} {
    for (std::size_t i = 0; i < world.signals.size(); ++i) {
      const model::Signal& s = world.signals[i];
      signals_[s.name] = {source.names.name("signal " + s.name, s.name),
                          s.kind == model::SignalKind::digital};
    }
  }

  Result<void> run(const model::PlacedTask& placed) {
    const model::Task* task = ctx_.snapshot().get(placed.task);
    if (!task) return error(ErrorCode::stale_handle, "the task no longer exists", "Give another.");
    source_.body.in();
    return steps(*task, placed.robot, source_.body, {placed.task.number});
  }
  [[nodiscard]] std::string head() const {
    IrlLines out;
    if (!used_.empty() || has_gripper_) out.add("SIGNAL");
    out.in();
    for (std::size_t i = 0; i < world_.signals.size(); ++i) {
      const model::Signal& s = world_.signals[i];
      if (!used_.contains(s.name)) continue;
      const IrlSignal& own = signals_.at(s.name);
      out.add(std::string(written_.contains(s.name) ? "OUTPUT " : "INPUT ") +
              (own.is_bool ? "BOOL: " : "REAL: ") + own.name + " AT " + std::to_string(i + 1) +
              ";");
    }
    if (has_gripper_)
      out.add("OUTPUT BOOL: " + gripper_ + " AT " + std::to_string(world_.signals.size() + 1) +
              ";");
    out.out();
    if (deepest_ > 0) out.add("VAR");
    out.in();
    for (int d = 1; d <= deepest_; ++d) out.add("INT: " + counter(d) + ";");
    return out.text();
  }
  /// Whether procedures were written for a begin that a later call has not.
  [[nodiscard]] bool is_again() const { return is_again_; }
  [[nodiscard]] const std::string& routines() const { return routines_; }

 private:
  [[nodiscard]] std::string counter(int depth) const {
    return source_.names.name("round " + std::to_string(depth), "round_" + std::to_string(depth));
  }
  Result<std::string> expression(const std::string& e) {
    RMP_TRY_ASSIGN(std::string out, irl_expression(e, signals_));
    RMP_TRY_ASSIGN(const Expression known, Expression::compile(e));
    for (const Expression::Name& n : known.names())
      if (n.scope.empty()) used_.insert(n.name);
    return out;
  }
  /// Steps whose parent is `parent`, from `at` on; gives where they end.
  Result<std::size_t> block(const model::Task& task, std::int32_t parent, std::size_t at,
                            const std::string& robot, IrlLines& out,
                            const std::vector<std::uint64_t>& calls, int depth) {
    while (at < task.steps.size() && task.steps[at].parent == parent) {
      auto next = step(task, at, robot, out, calls, depth);
      if (!next.ok()) {
        Error e = std::move(next).error();
        return e.where.starts_with("step")
                   ? e
                   : std::move(e).in("step " + std::to_string(at + 1) + " (" +
                                     std::string(to_string(task.steps[at].kind)) + ")");
      }
      at = *next;
    }
    return at;
  }
  Result<void> steps(const model::Task& task, const std::string& robot, IrlLines& out,
                     const std::vector<std::uint64_t>& calls) {
    RMP_TRY_ASSIGN(const std::size_t end, block(task, -1, 0, robot, out, calls, 0));
    if (end == task.steps.size()) return {};
    return error(ErrorCode::conflict, "its blocks are not in order", "Edit its steps.");
  }
  Result<std::size_t> step(const model::Task& task, std::size_t at, const std::string& robot,
                           IrlLines& out, const std::vector<std::uint64_t>& calls, int depth) {
    const TaskStep& s = task.steps[at];
    const std::string who = s.robot.empty() ? robot : s.robot;
    const bool names_robot =
        s.kind == StepKind::move || s.kind == StepKind::attach || s.kind == StepKind::call;
    if (names_robot && who != source_.arm().name)
      return error(ErrorCode::unsupported,
                   who.empty() ? "it names no robot"
                               : "it is a task of robot " + quote(who) +
                                     ", but the program is for " + quote(source_.arm().name),
                   "A program is for one robot; make a task for each.");
    switch (s.kind) {
      case StepKind::move: RMP_TRY(move(s, out)); break;
      case StepKind::attach:
        has_led_ = has_led_ || !s.tcp.empty();
        if (!s.tcp.empty())
          source_.note("The tool centre point " + quote(s.tcp) + " of " + quote(s.object) +
                       " is moved by the task; the program uses the robot's tool.");
        if (s.reach > 0)
          source_.note("The grip of " + quote(s.object) + " reaches " +
                       text::print_rounded(s.reach * 1000) +
                       " mm in the task; program.bind{kind = \"grip\", reach = ...} sets the same "
                       "for the program's grip.");
        grip(out, true, s.object);
        break;
      case StepKind::detach: grip(out, false, s.object); break;
      case StepKind::set: {
        const auto own = signals_.find(s.signal);
        if (own == signals_.end())
          return error(ErrorCode::unknown_name, "the world has no signal " + quote(s.signal),
                       "Add one with world.add_signal.");
        used_.insert(s.signal), written_.insert(s.signal);
        RMP_TRY_ASSIGN(const Expression e, Expression::compile(s.expression));
        if (own->second.is_bool && e.is_literal()) {
          const bool is_one = e.print() == "1";
          if (!is_one && e.print() != "0")
            return error(ErrorCode::invalid_argument, "a digital signal cannot be " + e.print(),
                         "It is 0 or 1.");
          out.add(own->second.name + " := " + (is_one ? "TRUE;" : "FALSE;"));
          break;
        }
        if (own->second.is_bool)
          return error(ErrorCode::unsupported,
                       "the digital signal " + quote(s.signal) +
                           " is set to a computed number, but in a program it is a BOOL",
                       "Use two steps in an if.");
        RMP_TRY_ASSIGN(const std::string value, expression(s.expression));
        out.add(own->second.name + " := " + value + ";");
        break;
      }
      case StepKind::wait: {
        if (s.expression.empty()) {
          out.add("WAIT " + irl_real(s.duration) + " SEC;");
          break;
        }
        RMP_TRY_ASSIGN(const std::string condition, expression(s.expression));
        if (s.timeout <= 0) {
          out.add("WAIT FOR " + condition + ";");
          break;
        }
        out.add("WAIT FOR " + condition + " TIMEOUT " + irl_real(s.timeout) + ";");
        out.add("IF R_TIMEOUT THEN WRITELN(" + irl_string("waited too long for " + s.expression) +
                "); HALT; ENDIF;");
        break;
      }
      case StepKind::call: {
        RMP_TRY_ASSIGN(const std::string name, procedure(s.task, who, calls));
        out.add(name + "();");
        break;
      }
      case StepKind::repeat: {
        deepest_ = std::max(deepest_, depth + 1);
        if (calls.size() > 1) {
          in_procedure_ = std::max(in_procedure_, depth + 1);
        }
        const Stands before = stands_;
        const std::string round = counter(depth + 1);
        const auto body = [&](IrlLines& lines) {
          return block(task, static_cast<std::int32_t>(at), at + 1, robot, lines, calls, depth + 1);
        };
        if (s.count > 1) {
          // The second round may begin elsewhere than the first.
          RMP_TRY_ASSIGN(const Known second, tried(body, before));
          if (before.size() > 1 || !is_same(second, before.front().q)) {
            RMP_TRY_ASSIGN(const Known third, tried(body, {{"", second}}));
            stands_.clear();
            for (const Stand& b : before)
              stands_.push_back({round + " = 1" + (b.when.empty() ? "" : " AND " + b.when), b.q});
            stands_.push_back({round + " > 1", is_same(second, third) ? second : Known{}});
          }
        }
        out.add("FOR " + round + " := 1 TO " + std::to_string(s.count));
        out.in();
        RMP_TRY_ASSIGN(const std::size_t end, body(out));
        out.out();
        out.add("ENDFOR;");
        if (s.count > 1) stands_ = {{"", stands_.back().q}};
        return end;
      }
      case StepKind::when: {
        RMP_TRY_ASSIGN(const std::string condition, expression(s.expression));
        const Stands before = stands_;
        out.add("IF " + condition + " THEN");
        out.in();
        RMP_TRY_ASSIGN(std::size_t end, block(task, static_cast<std::int32_t>(at), at + 1, robot,
                                              out, calls, depth));
        out.out();
        const bool has_else = end < task.steps.size() &&
                              task.steps[end].kind == StepKind::otherwise &&
                              task.steps[end].parent == s.parent;
        const Stands then = std::exchange(stands_, before);
        if (has_else) {
          out.add("ELSE");
          out.in();
          RMP_TRY_ASSIGN(
              end, block(task, static_cast<std::int32_t>(end), end + 1, robot, out, calls, depth));
          out.out();
        }
        out.add("ENDIF;");
        if (!is_same(known(then), known(stands_)) || !known(then)) {
          const bool is_unmoved = then.size() == before.size() && stands_.size() == before.size() &&
                                  std::equal(then.begin(), then.end(), stands_.begin(),
                                             [](const Stand& a, const Stand& b) {
                                               return a.when == b.when && is_same(a.q, b.q);
                                             });
          if (!is_unmoved) stands_ = {{"", {}}};
        }
        return end;
      }
      case StepKind::otherwise:
        return error(ErrorCode::conflict, "no \"if\" is before it", "Edit the task's steps.");
      case StepKind::message: out.add("WRITELN(" + irl_string(s.text) + ");"); break;
    }
    return at + 1;
  }
  void grip(IrlLines& out, bool takes, const std::string& object) {
    if (!has_gripper_) {
      gripper_ = source_.names.name("gripper", "gripper");
      has_gripper_ = true;
      source_.note("Objects are grasped and released with the output " + gripper_ + ".");
    }
    out.add(gripper_ + " := " + (takes ? "TRUE; " : "FALSE; ") +
            irl_comment((takes ? "takes " : "lets go ") + object));
  }
  Result<std::string> procedure(TaskId id, const std::string& robot,
                                const std::vector<std::uint64_t>& calls) {
    const model::Record* record = ctx_.snapshot().find(AnyId(id));
    const model::Task* task = ctx_.snapshot().get(id);
    if (!record || !task)
      return error(ErrorCode::stale_handle, "the task that it calls no longer exists",
                   "Give another one.");
    if (std::find(calls.begin(), calls.end(), id.number) != calls.end())
      return error(ErrorCode::conflict, "task " + quote(record->name) + " calls itself",
                   "Use a repeat.");
    const std::string key = "task " + std::to_string(id.number);
    const std::string name = source_.names.name(key, record->name);
    // It knows where it begins if all that call it do.
    const auto [entry, is_new] = entries_.try_emplace(id.number, known(stands_));
    if (!is_new && entry->second && !is_same(entry->second, known(stands_))) {
      entry->second.reset();
      is_again_ = true;
    }
    const auto made = made_.find(id.number);
    if (made != made_.end()) {
      stands_ = {{"", made->second}};
      return name;
    }
    stands_ = {{"", entry->second}};
    IrlLines out;
    out.in();
    std::vector<std::uint64_t> inner = calls;
    inner.push_back(id.number);
    const int before = std::exchange(in_procedure_, 0);
    auto done = steps(*task, robot, out, inner);
    if (!done.ok()) return std::move(done).error().in("task " + quote(record->name));
    // Its rounds are its own: a caller may be in the middle of some.
    std::string variables;
    for (int d = 1; d <= in_procedure_; ++d)
      variables += (d == 1 ? "VAR\n" : "") + std::string("  INT: ") + counter(d) + ";\n";
    in_procedure_ = before;
    stands_ = {{"", known(stands_)}};
    made_[id.number] = stands_.front().q;
    routines_ += "PROCEDURE " + name + " ();\n" + variables + "BEGIN\n" + out.text() + "ENDPROC;\n";
    return name;
  }
  /// Where the robot may stand, each under a condition over rounds; "" = always.
  struct Stand {
    std::string when;
    Known q;
  };
  using Stands = std::vector<Stand>;
  static Known known(const Stands& all) {
    for (const Stand& s : all)
      if (!is_same(s.q, all.front().q)) return std::nullopt;
    return all.front().q;
  }
  /// Where a block ends that begins with `from`, without a word.
  template <class Body>
  Result<Known> tried(const Body& body, const Stands& from) {
    const auto kept = std::tuple(source_.notes, used_, written_, has_gripper_, routines_, deepest_,
                                 in_procedure_, made_, has_led_);
    const Stands before = std::exchange(stands_, from);
    IrlLines nowhere;
    const auto end = body(nowhere);
    std::tie(source_.notes, used_, written_, has_gripper_, routines_, deepest_, in_procedure_,
             made_, has_led_) = kept;
    const Known at = known(std::exchange(stands_, before));
    if (!end.ok()) return end.error();
    return at;
  }
  /// The line of a move, from wherever the robot may stand: `motion`, its attributes, and what is
  /// behind them. Then it stands elsewhere.
  void carry_out(const TaskStep& s, IrlLines& out, const std::string& motion,
                 const std::string& attributes, const std::string& behind, const Known& goal) {
    const std::string profile = s.profile.empty() ? "quintic" : s.profile;
    const bool is_other = !s.is_straight && profile != "trapezoidal";
    const bool is_known = !has_led_ || goal;
    std::vector<std::string> lines;
    for (Stand& stand : stands_) {
      const auto went =
          stand.q && is_known ? rehearsal_.from(*stand.q, s) : std::optional<Rehearsal::Went>{};
      std::string own = attributes;
      if (is_other && s.duration > 0) {
        source_.note("Joint motions with the profile " + profile +
                     " keep their duration in the program, with a trapezoidal profile.");
      } else if (is_other) {
        TaskStep plain = s;
        plain.profile = "trapezoidal";
        const auto least = went ? rehearsal_.from(*stand.q, plain) : went;
        constexpr double kSame = 1e-9;  // [s]
        if (went && least && went->time >= least->time - kSame) {
          if (went->time > kSame) own = " TIME := " + irl_real(went->time);
          source_.note("Joint motions with the profile " + profile +
                       " keep their duration in the program, with a trapezoidal profile.");
        } else {
          source_.note("Joint motions with the profile " + profile +
                       " are trapezoidal in the program and take a different time" +
                       (went ? "" : " if their start is unknown; a step with a time keeps it") +
                       ".");
        }
      }
      lines.push_back(motion + own + ";" + behind);
      stand.q = went ? Known(went->q) : goal;
    }
    const bool is_one = std::all_of(lines.begin(), lines.end(),
                                    [&](const std::string& l) { return l == lines.front(); });
    for (std::size_t k = 0; k < (is_one ? 1 : lines.size()); ++k) {
      const bool is_last = is_one || k + 1 == lines.size();
      if (!is_last) {
        out.add("IF " + stands_[k].when + " THEN");
        out.in();
      }
      out.add(lines[k]);
      if (is_last) break;
      out.out();
      out.add("ELSE");
      out.in();
    }
    for (std::size_t k = 1; !is_one && k < lines.size(); ++k) {
      out.out();
      out.add("ENDIF;");
    }
    if (const Known at = known(stands_)) stands_ = {{"", at}};
  }
  Result<void> move(const TaskStep& s, IrlLines& out) {
    if (!s.link.empty())
      return error(ErrorCode::unsupported,
                   quote(s.link) + " goes to the target, but a program moves the robot's tool",
                   "Make it the robot's tool, or leave the step's tool out.");
    if (s.trajectory) {
      Pose base_T = source_.arm().base_T_world;
      if (!s.frame.empty() || s.target) {
        RMP_TRY_ASSIGN(const Pose f, frame(s.frame));
        base_T = spatial::compose(base_T, f);
        if (s.target) base_T = spatial::compose(base_T, model::pose(*s.target));
      }
      const model::Trajectory* t = ctx_.snapshot().get(s.trajectory);
      if (!t)
        return error(ErrorCode::stale_handle, "its trajectory no longer exists", "Give another.");
      // Motions write to the body; here the lines belong to the block.
      Source own(source_.arm());
      constexpr std::int64_t kSamples = 20;
      RMP_TRY(Motions(ctx_, own, kSamples).write(*t, base_T));
      for (const std::string& n : own.notes) source_.note(n);
      for (const std::string_view line : text::split(own.body.text(), '\n'))
        if (!line.empty()) out.add(line);
      for (Stand& stand : stands_) {
        const auto went =
            stand.q && !has_led_ ? rehearsal_.from(*stand.q, s) : std::optional<Rehearsal::Went>{};
        stand.q = went ? Known(went->q) : Known{};
      }
      return {};
    }
    std::string attributes;
    if (s.duration > 0) attributes = " TIME := " + irl_real(s.duration);
    else if (s.is_straight) {
      model::TrajectorySegment line;
      line.shape.name = "line";
      line.law.name = "trapezoidal";
      line.shape.params["speed"] = s.tool_speed > 0 ? s.tool_speed : kToolSpeed;
      RMP_TRY_ASSIGN(attributes, trapezoid_words(ctx_, line, source_));
    } else if (s.speed < 1) attributes = " SPEED_PTP := " + irl_real(kPercent * s.speed);
    if (s.target) {
      RMP_TRY_ASSIGN(const Pose f, frame(s.frame));
      const Pose base_T_frame = spatial::compose(source_.arm().base_T_world, f);
      carry_out(s, out,
                std::string(s.is_straight ? "MOVE LIN " : "MOVE PTP ") +
                    irl_pose(spatial::compose(base_T_frame, model::pose(*s.target))),
                attributes, {}, {});
      return {};
    }
    std::vector<double> q = s.joints;
    if (q.empty()) {
      RMP_TRY_ASSIGN(q, task::named_pose(*source_.arm().record, source_.arm().name, s.pose));
    }
    RMP_TRY_ASSIGN(const std::string to, source_.joints(q));
    carry_out(s, out, "MOVE PTP " + to, attributes,
              s.joints.empty() ? " " + irl_comment(s.pose) : std::string(), q);
    return {};
  }
  /// world_T_frame. Objects that move stand for where they are at the start.
  Result<Pose> frame(const std::string& name) {
    if (name.empty()) return Pose{};
    for (const model::PlacedFrame& f : world_.frames)
      if (f.name == name) return model::pose(f.placement);
    for (const model::PlacedObject& o : world_.objects)
      if (o.name == name) {
        source_.note("Targets in the frame of " + quote(name) +
                     " are those of its pose at the start.");
        return model::pose(o.placement);
      }
    return error(ErrorCode::unknown_name, "the world has no frame or object " + quote(name),
                 "Add one with world.add_frame.");
  }

  CommandContext& ctx_;
  const World& world_;
  Source& source_;
  std::map<std::string, IrlSignal> signals_;
  std::set<std::string> used_, written_;
  bool has_gripper_ = false;
  std::string gripper_, routines_;
  int deepest_ = 0, in_procedure_ = 0;
  std::map<std::uint64_t, Known> made_;  ///< procedures, and where they end
  Rehearsal& rehearsal_;
  Entries& entries_;
  Stands stands_;
  bool is_again_ = false;
  bool has_led_ = false;  ///< a centre point of an object has led moves of the task
};

Result<Value> from_task(CommandContext& ctx, const Map& args) {
  const World& w = content<World>(ctx, args, "world");
  const std::string where = name_in(ctx, ref(args, "world"));
  RMP_TRY_ASSIGN(const std::size_t which,
                 find_task(ctx, typed<World>(args, "world"), *args.find("task"), where));
  const model::PlacedTask& placed = w.tasks[which];
  std::string robot = placed.robot;
  if (robot.empty()) {
    const model::Task* task = ctx.snapshot().get(placed.task);
    for (std::size_t i = 0; task && robot.empty() && i < task->steps.size(); ++i)
      robot = task->steps[i].robot;
    if (robot.empty())
      return error(ErrorCode::invalid_argument, "no step names a robot",
                   "Give the task a robot in the world.", where + ", task " + quote(placed.name));
  }
  RMP_TRY_ASSIGN(const std::size_t arm_at,
                 find_robot(ctx, typed<World>(args, "world"), Value(robot), where));
  RMP_TRY_ASSIGN(const Arm arm, arm_of(ctx, w, arm_at));
  RMP_TRY_ASSIGN(Rehearsal rehearsal,
                 Rehearsal::create(ctx, typed<World>(args, "world"), arm.name));
  model::PlacedTask mine = placed;
  mine.robot = robot;
  Entries entries;
  for (;;) {
    Source source(arm);
    TaskWriter writer(ctx, w, source, rehearsal, entries);
    auto done = writer.run(mine);
    if (!done.ok()) return std::move(done).error().in("task " + quote(placed.name));
    if (writer.is_again()) continue;
    return finish(ctx, args, source, placed.name,
                  "Of the task " + placed.name + " for the robot " + arm.name + " of " + where,
                  writer.head(), writer.routines());
  }
}

// ---- recordings ----

/// Rows whose joints, passed as a run passes targets (spatial::passing_rate), give all the others
/// within `tolerance`: of each stretch the row that is furthest off is kept, until none is.
std::vector<std::size_t> kept_rows(std::span<const recording::Column* const> q,
                                   const std::vector<double>& time, double tolerance) {
  const std::size_t rows = time.size();
  std::vector<std::size_t> kept{0};
  // Two motions at least: one alone passes nothing, and goes by another law.
  if (rows > 2) kept.push_back(rows / 2);
  if (rows > 1) kept.push_back(rows - 1);
  for (bool is_within = false; !is_within;) {
    is_within = true;
    std::vector<std::vector<double>> rates;  // of each joint, at the rows kept
    for (const recording::Column* c : q) {
      std::vector<double>& rate = rates.emplace_back(kept.size(), 0.0);
      for (std::size_t k = 1; k + 1 < kept.size(); ++k) {
        const std::size_t a = kept[k - 1], m = kept[k], b = kept[k + 1];
        rate[k] = spatial::passing_rate(c->values[m] - c->values[a], time[m] - time[a],
                                        c->values[b] - c->values[m], time[b] - time[m]);
      }
    }
    std::vector<std::size_t> next{0};
    for (std::size_t k = 0; k + 1 < kept.size(); ++k) {
      const std::size_t a = kept[k], b = kept[k + 1];
      double worst = tolerance;
      std::size_t at = 0;
      for (std::size_t i = a + 1; i < b; ++i)
        for (std::size_t j = 0; j < q.size(); ++j) {
          const std::vector<double>& v = q[j]->values;
          const double way = spatial::cubic(v[b] - v[a], rates[j][k], rates[j][k + 1],
                                            time[b] - time[a], time[i] - time[a])
                                 .v;
          const double off = std::fabs(v[i] - v[a] - way);
          if (off > worst) worst = off, at = i;
        }
      if (at != 0) next.push_back(at), is_within = false;
      next.push_back(b);
    }
    kept = std::move(next);
  }
  return kept;
}

Result<Value> from_recording(CommandContext& ctx, const Map& args) {
  const auto r = ctx.recording(*args.find("recording")->as_handle());
  const World* w = ctx.snapshot().get(r->world);
  if (!w)
    return error(ErrorCode::stale_handle, "the world of the recording no longer exists",
                 "Use a recording of an open world.", "recording");
  const std::string where = name_in(ctx, AnyId(r->world));
  std::string name = has(args, "robot") ? text_of(args, "robot") : r->robot;
  if (name.empty() && w->robots.size() == 1) name = w->robots[0].name;
  if (name.empty())
    return error(ErrorCode::invalid_argument, "the recording contains several robots",
                 "Name it: robot = ...", "robot");
  RMP_TRY_ASSIGN(const std::size_t arm_at, find_robot(ctx, r->world, Value(name), where));
  RMP_TRY_ASSIGN(const Arm arm, arm_of(ctx, *w, arm_at));
  const recording::Column* time = r->find("time");
  std::vector<const recording::Column*> q;
  for (std::size_t j = 1; j <= arm.model->joints.size(); ++j) {
    const std::string column = "q" + std::to_string(j);
    const recording::Column* c = r->robot == name ? r->find(column) : nullptr;
    if (!c) c = r->find(name + "." + column);
    if (c) q.push_back(c);
  }
  if (!time || time->values.empty() || q.size() != arm.model->joints.size())
    return error(ErrorCode::invalid_argument,
                 "the recording lacks joints of robot " + quote(name) + " over the time",
                 "Simulate it again, or name another robot.", "recording");
  for (std::size_t i = 0; i < time->values.size(); ++i)
    for (const recording::Column* c : q)
      if (!std::isfinite(c->values[i]))
        return error(
            ErrorCode::invalid_argument,
            "row " + std::to_string(i + 1) + " of the recording has no number in " + quote(c->name),
            "Use a recording without gaps.", "recording");
  for (std::size_t i = 1; i < time->values.size(); ++i)
    if (!(time->values[i] > time->values[i - 1]))
      return error(
          ErrorCode::invalid_argument,
          "row " + std::to_string(i + 1) + " of the recording is not later than the previous one",
          "Use a recording with increasing times.", "recording");
  Source source(arm);
  source.body.in();
  const std::vector<std::size_t> rows = kept_rows(q, time->values, real(args, "tolerance"));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    std::vector<double> at;
    for (const recording::Column* c : q) at.push_back(c->values[rows[k]]);
    RMP_TRY_ASSIGN(const std::string to, source.joints(at));
    std::string line = "MOVE PTP " + to;
    if (k > 0) {
      line += " TIME := " + irl_real(time->values[rows[k]] - time->values[rows[k - 1]]);
      if (k + 1 < rows.size()) line += " C_PASS := TRUE";
    }
    source.body.add(line + ";");
  }
  source.note(std::to_string(rows.size()) + " of " + std::to_string(time->values.size()) +
              " rows are kept and passed without a stop; the joints stay within " +
              irl_real(kDegreesPerRadian * real(args, "tolerance")) + " degrees (" +
              irl_real(kMm * real(args, "tolerance")) + " mm of sliding joints) of the others.");
  const std::string title = r->title.empty() ? "recording" : r->title;
  return finish(ctx, args, source, name + " recorded", "Of the recording " + title, {}, {});
}

std::string with_cell_of_task(const char* rest) {
  return with_arm(
             "local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm}\n"
             "cell:add_signal{name = \"ready\"}\n"
             "task.create{name = \"serve\", steps = {\n"
             "  {step = \"wait\", condition = \"ready == 1\"},\n"
             "  {step = \"repeat\", count = 2, steps = {\n"
             "    {step = \"move\", joints = {0.1, 0.2, 0.3, 0, 0, 0}, speed = 0.5},\n"
             "    {step = \"move\", joints = {0, 0, 0, 0, 0, 0}}}}}}\n"
             "cell:add_task{task = \"serve\", robot = \"arm\"}\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(program_from_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec name =
      optional("name", "string", "", "Name of the program; by default that of its source.");
  all.push_back(
      {.name = "program.from_task",
       .classic = "",
       .summary = "Makes a program from a task of a world.",
       .details = "Moves, grips, signals, waits, calls and blocks become statements of the "
                  "language, targets become poses in the robot's base. A step that the language "
                  "cannot express is an error that names it: steps of other robots, conditions "
                  "over places and time, tools of single steps. Messages and the head of the "
                  "source list what is expressed differently.",
       .example = with_cell_of_task("local p = program.from_task{world = cell, task = \"serve\"}\n"
                                    "assert(p:check().correct)\n"
                                    "assert(p:source():find(\"WAIT FOR ready = TRUE\"))"),
       .params = {needed("world", "ref:world", "", "The world."),
                  needed("task", "any", "", "Task of it, by name."), name},
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits,
       .run = from_task});
  all.push_back(
      {.name = "program.from_trajectory",
       .classic = "",
       .summary = "Makes a program from a trajectory of a world, for one of its robots.",
       .details = "Lines become MOVE LIN, arcs MOVE CIRCLE, joint motions MOVE PTP, and other "
                  "curves MOVE PATH through points on them. If a segment begins elsewhere, the "
                  "robot moves there first. Speeds or times are those of the segments.",
       .example = example_run("local p = program.from_trajectory{world = cell, robot = \"arm\",\n"
                              "  trajectory = \"stroke\"}\n"
                              "assert(p:check().correct and p:source():find(\"MOVE LIN\"))"),
       .params = {needed("world", "ref:world", "", "The world."),
                  needed("robot", "any", "", "Robot of it, by name."),
                  needed("trajectory", "any", "", "Trajectory of it, by name."),
                  between(defaulted("points", "int", "", 20,
                                    "Number of points for a curve that is neither line nor arc."),
                          2, 100'000),
                  name},
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits,
       .run = from_trajectory});
  all.push_back(
      {.name = "program.from_recording",
       .classic = "",
       .summary = "Makes a program from the joint motion in a recording.",
       .details = "It keeps as few rows as reproduce the motion within the tolerance; each becomes "
                  "a MOVE PTP that takes the time between the rows and passes without a stop.",
       .example = example_run("local run = cell:inverse_kinematics{robot = \"arm\", trajectory = "
                              "\"stroke\"}\n"
                              "local p = program.from_recording{recording = run}\n"
                              "assert(p:check().correct and p:source():find(\"C_PASS\"))"),
       .params = {needed("recording", "ref:recording", "", "The recording."),
                  optional("robot", "string", "", "The robot, if the recording has several."),
                  above_zero(
                      defaulted("tolerance", "real", "", 1e-3,
                                "Greatest error of the joints between the kept rows [rad or m].")),
                  name},
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits,
       .run = from_recording});
  return all;
}

}  // namespace robomosp::ioci
