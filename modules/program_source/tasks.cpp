// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "kernel/expression.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "program_source/from_records.h"
#include "program_source/motions.h"
#include "sim/simulate.h"
#include "spatial/pose.h"
#include "task/members.h"
#include "task/task_executor.h"

namespace robomosp::program_source {
namespace {

using model::StepKind;
using model::TaskStep;
using model::World;
using text::quote;

/// Of straight moves of tasks that give none [m/s] (task/moves.cpp).
constexpr double kToolSpeed = 0.25;

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
  static Result<Rehearsal> create(const evaluation::Sources& from, WorldId world,
                                  const std::string& robot, Progress& progress) {
    constexpr double kStep = 0.02;  // [s]
    Rehearsal out(from, robot, progress);
    RMP_TRY_ASSIGN(auto executor,
                   task::TaskExecutor::create(*out.simulator_, world, kStep, progress));
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
    const auto stands = executor_->move(there, robot_, {}, now_, *progress_);
    if (!stands.ok()) return std::nullopt;
    now_ = *stands;
    const auto end = executor_->move(step, robot_, {}, now_, *progress_);
    if (!end.ok()) return std::nullopt;
    const double took = *end - std::exchange(now_, *end);
    const Known at = joints(now_);
    if (!at) return std::nullopt;
    return Went{took, *at};
  }

 private:
  Rehearsal(const evaluation::Sources& from, std::string robot, Progress& progress)
      : progress_(&progress),
        robot_(std::move(robot)),
        simulator_(std::make_unique<sim::Simulator>(sim::Simulator{from})) {}
  [[nodiscard]] Known joints(double t) const {
    for (const auto& [name, q] : executor_->joints(t))
      if (name == robot_) return q;
    return std::nullopt;
  }
  Progress* progress_;
  std::string robot_;
  std::unique_ptr<sim::Simulator> simulator_;
  std::unique_ptr<task::TaskExecutor> executor_;
  double now_ = 0;
};

/// With what procedures begin: known only where all their calls agree.
using Entries = std::map<std::uint64_t, Known>;

class TaskWriter {
 public:
  TaskWriter(const evaluation::Sources& from, const World& world, Source& source,
             Rehearsal& rehearsal, Entries& entries)
      : from_(from),
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
    const model::Task* task = from_.snapshot.get(placed.task);
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
    const model::Record* record = from_.snapshot.find(AnyId(id));
    const model::Task* task = from_.snapshot.get(id);
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
      const model::Trajectory* t = from_.snapshot.get(s.trajectory);
      if (!t)
        return error(ErrorCode::stale_handle, "its trajectory no longer exists", "Give another.");
      // Motions write to the body; here the lines belong to the block.
      Source own(source_.arm());
      constexpr std::int64_t kSamples = 20;
      RMP_TRY(write_motions(from_, own, *t, base_T, kSamples));
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
      RMP_TRY_ASSIGN(attributes, trapezoid_words(from_, line, source_));
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
  /// world_T_frame. Objects that move are taken where they are at the start.
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

  const evaluation::Sources& from_;
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

}  // namespace

Result<WrittenProgram> from_task(const evaluation::Sources& from, WorldId world, std::size_t which,
                                 const std::string& name, Progress& progress) {
  const World& w = *from.snapshot.get(world);
  const std::string where = name_of(from, world);
  const model::PlacedTask& placed = w.tasks[which];
  std::string robot = placed.robot;
  if (robot.empty()) {
    const model::Task* task = from.snapshot.get(placed.task);
    for (std::size_t i = 0; task && robot.empty() && i < task->steps.size(); ++i)
      robot = task->steps[i].robot;
    if (robot.empty())
      return error(ErrorCode::invalid_argument, "no step names a robot",
                   "Give the task a robot in the world.", where + ", task " + quote(placed.name));
  }
  RMP_TRY_ASSIGN(const Arm arm, arm_named(from, world, robot, progress));
  RMP_TRY_ASSIGN(Rehearsal rehearsal, Rehearsal::create(from, world, arm.name, progress));
  model::PlacedTask mine = placed;
  mine.robot = robot;
  Entries entries;
  for (;;) {
    Source source(arm);
    TaskWriter writer(from, w, source, rehearsal, entries);
    auto done = writer.run(mine);
    if (!done.ok()) return std::move(done).error().in("task " + quote(placed.name));
    if (writer.is_again()) continue;
    return finished(source, name.empty() ? placed.name : name,
                    "Of the task " + placed.name + " for the robot " + arm.name + " of " + where,
                    writer.head(), writer.routines());
  }
}

}  // namespace robomosp::program_source
