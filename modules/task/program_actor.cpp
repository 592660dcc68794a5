// SPDX-License-Identifier: Apache-2.0
#include "task/program_actor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <robomosp/sdk/program_turns.h>

#include "kernel/text.h"
#include "model/placement.h"
#include "motion/cartesian_path.h"
#include "robotics/grip.h"
#include "robotics/kinematics.h"
#include "sim/ik_choice.h"
#include "sim/joint_rates.h"
#include "spatial/passing.h"
#include "spatial/pose.h"
#include "spatial/quintic.h"
#include "spatial/rotation.h"

namespace robomosp::task {

using program::MotionAttributes;
using program::PlainPose;
using program::SignalValue;
using program::Target;
using text::quote;

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kMillimetre = 1e-3;
constexpr double kSame = 1e-9;        ///< times and ways this near are the same
constexpr double kSameJoints = 1e-6;  ///< sim::robot_motion takes these as the same
/// 100 % of ACC: acceleration of the tool [m/s^2] and of its turning [rad/s^2].
constexpr double kFullAcceleration = 2.5, kFullTurning = 10;
/// Of motions under TIME, which only the joints bound [m/s, rad/s].
constexpr double kAnySpeed = 1e6;
constexpr double kWithin = 1 + 1e-6;  ///< of a limit
/// What cubics between targets may have beyond a joint's greatest speed, with a note.
constexpr double kMostExcess = 1.1;
constexpr int kMostSlices = 100;  ///< of computing at one instant
constexpr int kTries = 5;         ///< of ever shorter transitions
constexpr double kPi = std::numbers::pi, kTurn = 2 * kPi;

Pose to_pose(const PlainPose& p) {
  Pose out;
  out.R = spatial::from_quaternion(
      {p.quaternion[0], p.quaternion[1], p.quaternion[2], p.quaternion[3]});
  for (std::size_t k = 0; k < 3; ++k) out.p[k] = p.position[k] * kMillimetre;
  return out;
}
PlainPose to_plain(const Pose& p) {
  PlainPose out;
  const spatial::Quaternion q = spatial::to_quaternion(p.R);
  out.quaternion = {q.w, q.x, q.y, q.z};
  for (std::size_t k = 0; k < 3; ++k) out.position[k] = p.p[k] / kMillimetre;
  return out;
}
std::string place(const Vec3& p) {
  std::string s = "(";
  for (std::size_t k = 0; k < 3; ++k) s += (k ? ", " : "") + text::print_rounded(p[k] * 1000);
  return s + ") mm";
}
bool same_pose(const Pose& a, const Pose& b) {
  const PlainPose x = to_plain(a), y = to_plain(b);
  return x == y;
}
double angle_between(const Pose& a, const Pose& b) {
  const spatial::Quaternion q = spatial::to_quaternion(spatial::compose(spatial::inverse(a), b).R);
  return 2 * std::atan2(std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z), std::fabs(q.w));
}
double distance(const Vec3& a, const Vec3& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

}  // namespace

/// The world as one run of a program sees it.
class ProgramCell final : public program::World {
 public:
  ProgramCell(ProgramActor& actor, TaskExecutor& executor, double now, Progress& progress)
      : a_(actor), n_(*actor.names_), x_(executor), now_(now), progress_(progress) {}

  Result<std::optional<SignalValue>> read_signal(const program::Signal& s) override {
    const auto use = n_.signals.find(s.symbol);
    SignalValue v;
    if (use == n_.signals.end()) return std::optional(v);
    if (use->second.kind == ProgramActor::SignalUse::task && !s.is_output)
      return std::optional(value_of(s, x_.started()[use->second.at].is_done ? 1 : 0));
    if (use->second.kind != ProgramActor::SignalUse::wire) {
      if (s.is_output) {
        if (const auto at = a_.outputs_.find(s.symbol); at != a_.outputs_.end()) v = at->second;
        return std::optional(v);
      }
      return std::optional(value_of(s, use->second.value));
    }
    return std::optional(value_of(s, x_.wires_[use->second.at].history.back().second));
  }
  Result<void> write_signal(const program::Signal& s, SignalValue v) override {
    const auto use = n_.signals.find(s.symbol);
    if (use == n_.signals.end()) return {};
    const SignalValue before = std::exchange(a_.outputs_[s.symbol], v);
    if (use->second.kind == ProgramActor::SignalUse::free) return {};
    if (use->second.kind == ProgramActor::SignalUse::grip) {
      if ((before.integer != 0) == (v.integer != 0)) return {};
      return checked(grip(use->second.at, v.integer != 0));
    }
    if (use->second.kind == ProgramActor::SignalUse::task) {
      if (v.integer == 0 || before.integer != 0) return {};
      const std::string task = "task " + quote(x_.world_->tasks[use->second.at].name);
      if (x_.start_task(use->second.at)) x_.note(now_, n_.name + " starts " + task);
      else x_.note(now_, n_.name + " does not start " + task + ", which runs still");
      return {};
    }
    const TaskExecutor::Wire& w = x_.wires_[use->second.at];
    const double value = s.type == RMP_TYPE_REAL ? v.real : static_cast<double>(v.integer);
    if (w.signal->kind == model::SignalKind::digital && value != 0 && value != 1) {
      if (a_.inspection_) {
        tell(InspectedEvent::Kind::output,
             "the digital signal " + quote(w.signal->name) + " cannot be " +
                 text::print_rounded(value),
             "It is 0 or 1. Make it analogue, or bind another one.", {std::string(s.name)});
        return {};
      }
      return fails(ErrorCode::invalid_argument,
                   "the digital signal " + quote(w.signal->name) + " cannot be " +
                       text::print_rounded(value),
                   "It is 0 or 1. Make it analogue, or bind another one.");
    }
    x_.set_wire(use->second.at, value, now_);
    return {};
  }

  Result<void> begin_motion(const program::Motion& m) override {
    return checked(a_.inspection_ ? inspect(m) : begin(m));
  }
  Result<program::MotionState> motion_state(std::uint64_t number) override {
    const auto it = a_.open_.find(number);
    if (it == a_.open_.end()) return program::MotionState::done;
    if (a_.held_.contains(number) || now_ < it->second.end - kSame)
      return program::MotionState::running;
    const auto grips = std::move(it->second.grips);
    a_.open_.erase(it);
    for (const auto& [at, takes] : grips) {
      auto done = checked(grip(at, takes));
      if (!done.ok()) return std::move(done).error();
    }
    return program::MotionState::done;
  }
  Result<void> abort_motion(std::uint64_t number, program::AbortReason) override {
    const auto it = a_.open_.find(number);
    if (it == a_.open_.end()) return {};
    a_.held_.erase(number);
    const std::size_t who = it->second.actor;
    const std::vector<std::size_t> all = moved_by(it->second);
    const double stands = x_.brake(all, now_);
    for (const std::size_t one : all) a_.braked_until_[one] = stands;
    if (a_.inspection_)
      for (InspectedMotion& told : a_.inspection_->motions)
        if (told.number >= number && told.robot == who && told.end > stands)
          told.end = std::max(told.start, stands), told.is_cut = true;
    for (auto& [other, open] : a_.open_)
      if (open.actor == who && other >= number) {
        open.end = stands, open.grips.clear();
        open.passing.reset();
      }
    return {};
  }
  Result<void> hold_motion(std::uint64_t number) override {
    const auto it = a_.open_.find(number);
    if (it == a_.open_.end() || a_.held_.contains(number)) return {};
    ProgramActor::HeldMotion held;
    for (const auto& [other, already] : a_.held_)
      if (const auto of = a_.open_.find(other); other < number && already.with == 0 &&
                                                of != a_.open_.end() &&
                                                of->second.actor == it->second.actor)
        held.with = other;
    if (held.with != 0) {
      a_.held_.emplace(number, std::move(held));
      return {};
    }
    const std::vector<std::size_t> all = moved_by(it->second);
    for (const std::size_t who : all) {
      auto& moves = held.moves[who];
      moves = x_.actors_[who].moves;
      if (moves.size() > 3) moves.erase(moves.begin(), moves.end() - 3);
    }
    double way = 0;
    x_.brake(all, now_, &way);
    held.at = now_ + way, held.began = now_;
    for (auto& [other, open] : a_.open_)
      if (open.actor == it->second.actor && open.passing)
        open.passing->end = ProgramActor::Passing::End::stop;
    a_.held_.emplace(number, std::move(held));
    return {};
  }
  Result<void> resume_motion(std::uint64_t number) override {
    const auto it = a_.open_.find(number);
    const auto held = a_.held_.find(number);
    if (it == a_.open_.end() || held == a_.held_.end()) return {};
    if (held->second.with != 0) {
      a_.held_.erase(held);
      return {};
    }
    double start = now_, left = 0;
    const double at = held->second.at, step = x_.step();
    std::map<std::size_t, TaskExecutor::Actor> as_they_were;
    for (const auto& [who, moves] : held->second.moves) {
      start = std::max(start, TaskExecutor::moved_until(x_.actors_[who]));
      TaskExecutor::Actor& one = as_they_were.emplace(who, x_.actors_[who]).first->second;
      one.moves = moves;
      left = std::max(left, TaskExecutor::moved_until(one) - at);
    }
    const double rise = std::min(0.25, 2 * left), total = left + rise / 2;
    for (const auto& [who, one] : as_they_were) {
      sim::RobotMotion m;
      for (double t = 0;;
           t = std::min(total, (std::floor((start + t) / step * (1 + 1e-12)) + 1) * step - start)) {
        const double u = t < rise ? t * t / (2 * rise) : t - rise / 2;
        const double rate = t < rise ? t / rise : 1, by = t < rise ? 1 / rise : 0;
        const auto s = TaskExecutor::sample(one, at + std::min(left, u));
        m.times.push_back(t);
        for (std::size_t j = 0; j < s.q.size(); ++j) {
          m.q.push_back(s.q[j]);
          m.qd.push_back(t >= total ? 0 : rate * s.qd[j]);
          m.qdd.push_back(rate * rate * s.qdd[j] + by * s.qd[j]);
        }
        if (t >= total) break;
      }
      x_.push(who, start, std::move(m));
    }
    for (auto& [other, open] : a_.open_)
      if (open.actor == it->second.actor && other >= number) open.end = start + total;
    it->second.along_from = start;
    a_.held_.erase(held);
    return {};
  }

  /// Behind a run: motions that were to pass their targets, and that nothing follows.
  Result<void> settle() {
    for (auto& [number, open] : a_.open_) {
      if (!open.passing || open.passing->end != ProgramActor::Passing::End::open) continue;
      if (open.start > now_ + kSame && !a_.is_over()) continue;
      auto done = stops(open);
      if (done.ok()) continue;
      if (a_.inspection_ && done.error().code != ErrorCode::cancelled) {
        for (InspectedMotion& told : a_.inspection_->motions)
          if (told.number == number && told.error.empty())
            fails_at(told, done.error()), told.trouble = trouble_;
        continue;
      }
      a_.code_ = done.error().code;
      return std::move(done).error().in("program " + quote(n_.name) + ", " +
                                        a_.place_text(open.passing->span));
    }
    return {};
  }

  Result<bool> stands(std::uint64_t number) override {
    const auto it = a_.open_.find(number);
    if (it == a_.open_.end()) return true;
    const std::vector<std::size_t> all = moved_by(it->second);
    return std::all_of(all.begin(), all.end(), [&](std::size_t who) {
      return TaskExecutor::moved_until(x_.actors_[who]) <= now_ + kSame;
    });
  }
  Result<bool> same_robot(std::uint32_t a, std::uint32_t b) override {
    if (a == b) return true;
    RMP_TRY_ASSIGN(const ProgramActor::RobotUse* one, robot_of(a));
    RMP_TRY_ASSIGN(const ProgramActor::RobotUse* other, robot_of(b));
    return one->actor == other->actor;
  }

  Result<Target> robot_state(std::uint32_t robot, std::uint32_t) override {
    auto state = [&]() -> Result<Target> {
      RMP_TRY_ASSIGN(const ProgramActor::RobotUse* use, robot_of(robot));
      const auto q = TaskExecutor::sample(x_.actors_[use->actor], now_).q;
      return state_at(*use, q);
    }();
    if (!state.ok()) a_.code_ = state.error().code;
    return state;
  }
  Result<double> robot_speed(std::uint32_t robot, std::uint32_t) override {
    RMP_TRY_ASSIGN(const ProgramActor::RobotUse* use, robot_of(robot));
    RMP_TRY_ASSIGN(const TaskExecutor::Grip tip, x_.tip(use->actor, use->tool));
    constexpr double h = 1e-4;  // [s]
    const auto& robot_now = x_.actors_[use->actor];
    const auto at = [&](double t) {
      return base_T_tip(use->actor, tip, TaskExecutor::sample(robot_now, std::max(0.0, t)).q).p;
    };
    return distance(at(now_ + h), at(now_ - h)) / (now_ < h ? now_ + h : 2 * h) / kMillimetre;
  }
  Result<Target> forward(const Target& given, std::uint32_t) override {
    auto made = [&]() -> Result<Target> {
      RMP_TRY_ASSIGN(const ProgramActor::RobotUse* use, robot_of(RMP_NONE));
      RMP_TRY_ASSIGN(auto q, joints_of(use->actor, given.joints));
      const auto now = TaskExecutor::sample(x_.actors_[use->actor], now_).q;
      q.insert(q.begin(), now.begin(),
               now.begin() + static_cast<std::ptrdiff_t>(rail_of(use->actor)));
      RMP_TRY_ASSIGN(Target out, state_at(*use, q));
      out.additional = given.additional;
      return out;
    }();
    if (!made.ok()) a_.code_ = made.error().code;
    return made;
  }
  Result<Target> inverse(const Target& given, std::uint32_t) override {
    auto made = [&]() -> Result<Target> {
      RMP_TRY_ASSIGN(const ProgramActor::RobotUse* use, robot_of(RMP_NONE));
      RMP_TRY_ASSIGN(const TaskExecutor::Grip tip, x_.tip(use->actor, use->tool));
      RMP_TRY_ASSIGN(const Pose frame, base_T_frame(*use, nullptr));
      const auto seed = TaskExecutor::sample(x_.actors_[use->actor], now_).q;
      RMP_TRY_ASSIGN(const auto q,
                     configuration(use->actor, tip, spatial::compose(frame, to_pose(given.pose)),
                                   seed, given.role == RMP_ROLE_ROBTARGET ? &given : nullptr));
      RMP_TRY_ASSIGN(Target out, state_at(*use, q));
      out.additional = given.additional;
      return out;
    }();
    if (!made.ok()) a_.code_ = made.error().code;
    return made;
  }

  Result<void> write_text(std::uint32_t, std::string_view piece) override {
    a_.text_ += piece;
    for (std::size_t end; (end = a_.text_.find('\n')) != std::string::npos;) {
      x_.note(now_, n_.name + ": " + a_.text_.substr(0, end));
      a_.text_.erase(0, end + 1);
    }
    return {};
  }
  Result<void> log_text(std::uint32_t, const rmp_span& span, std::string_view text) override {
    x_.note(now_, n_.name + ", line " + std::to_string(span.line) + ": " + std::string(text));
    return {};
  }
  Result<std::optional<std::string>> read_line(std::uint32_t) override {
    const std::vector<std::string>& lines = a_.typed_ ? *a_.typed_ : a_.own_lines_;
    if (a_.lines_read_ < lines.size()) return std::optional(lines[a_.lines_read_++]);
    if (a_.is_attended_) {
      a_.wants_line_ = true;
      return std::optional<std::string>();
    }
    return fails(
        ErrorCode::not_found,
        "READ asks for line " + std::to_string(a_.lines_read_ + 1) + ", and " +
            (lines.empty() ? "nobody answers" : std::to_string(lines.size()) + " were given"),
        "Give lines = {...}, or start a live run, which waits for run.input.");
  }
  Result<void> pause(std::uint32_t process, std::string_view message) override {
    x_.note(now_, n_.name + " is at PAUSE" + (message.empty() ? "" : ": ") + std::string(message) +
                      (a_.typed_ ? "" : "; nobody is asked, and it goes on"));
    if (a_.inspection_)
      tell(InspectedEvent::Kind::pause, "PAUSE: nobody is asked in a check, and it goes on", "");
    a_.paused_.insert(process);
    return {};
  }
  Result<std::string> read_file(std::string_view name) override {
    if (!a_.files_) return has_no_files("opens", name);
    auto bytes = a_.files_->read(name);
    if (!bytes.ok()) a_.code_ = bytes.error().code;
    return bytes;
  }
  Result<void> write_file(std::string_view name, std::string_view bytes, bool adds) override {
    if (!a_.files_) return has_no_files("writes", name);
    return checked(a_.files_->write(name, bytes, adds));
  }

 private:
  /// The robot of a motion, and what goes along and was not given another motion since.
  [[nodiscard]] std::vector<std::size_t> moved_by(const ProgramActor::OpenMotion& open) const {
    std::vector<std::size_t> out{open.actor};
    for (const std::size_t who : open.along)
      if (const auto& moves = x_.actors_[who].moves;
          !moves.empty() && moves.back().start <= open.along_from)
        out.push_back(who);
    return out;
  }
  Error has_no_files(const char* does, std::string_view name) {
    return fails(ErrorCode::unsupported,
                 std::string("the program ") + does + " the file " + quote(name) +
                     ", and the run has no folder for files",
                 "Give files = a folder.");
  }
  Error fails(ErrorCode code, std::string message, std::string hint = {}) {
    a_.code_ = code;
    return error(code, std::move(message), std::move(hint));
  }
  Result<void> checked(Result<void> done) {
    if (!done.ok()) a_.code_ = done.error().code;
    return done;
  }
  static SignalValue value_of(const program::Signal& s, double value) {
    SignalValue v;
    v.real = value;
    v.integer = s.type == RMP_TYPE_BOOL
                    ? value != 0
                    : static_cast<std::int64_t>(std::clamp(std::round(value), -9.0e18, 9.0e18));
    return v;
  }
  void note_once(const std::string& said) {
    if (x_.told_.emplace(n_.name, said).second) x_.note(now_, n_.name + ": " + said);
    if (a_.inspection_) tell(InspectedEvent::Kind::ignored, said, "");
  }
  void tell(InspectedEvent::Kind kind, std::string message, std::string hint,
            std::vector<std::string> signals = {}) {
    const std::uint32_t process = a_.machine_.running_process();
    const auto calls = a_.machine_.call_stack(process);
    a_.tell(kind, a_.place(process, calls.empty() ? rmp_span{} : calls.front().span, now_),
            std::move(message), std::move(hint), std::move(signals));
  }

  Result<const ProgramActor::RobotUse*> robot_of(std::uint32_t symbol) {
    if (symbol != RMP_NONE)
      if (const auto it = n_.robots.find(symbol); it != n_.robots.end()) return &it->second;
    if (symbol == RMP_NONE && n_.own) return &*n_.own;
    return error(ErrorCode::invalid_argument, "no robot of the world is bound to the program's",
                 "program.bind{kind = \"robot\", to = ...} gives it one.");
  }
  Pose base_T_tip(std::size_t who, const TaskExecutor::Grip& tip, std::span<const double> q) const {
    const RobotModel& model = *x_.actors_[who].model;
    if (tip.joint < 0) return tip.joint_T_grip;
    std::vector<Pose> frames(model.joints.size());
    robotics::forward_kinematics(model, q, frames);
    return spatial::compose(frames[static_cast<std::size_t>(tip.joint)], tip.joint_T_grip);
  }
  /// Of what targets are in.
  Result<Pose> base_T_frame(const ProgramActor::RobotUse& use, const PlainPose* given) const {
    Pose out{};
    if (!use.frame.empty()) {
      RMP_TRY_ASSIGN(const Pose world_T_frame, x_.frame(use.frame, now_));
      out = spatial::compose(spatial::inverse(x_.actors_[use.actor].world_T_base), world_T_frame);
    }
    return given ? spatial::compose(out, to_pose(*given)) : out;
  }
  Result<std::vector<double>> joints_of(std::size_t who, const std::vector<double>& given) const {
    const TaskExecutor::Actor& robot = x_.actors_[who];
    const std::size_t rail = rail_of(who);
    if (given.size() + rail != robot.start.size())
      return error(ErrorCode::invalid_argument,
                   "the target has " + std::to_string(given.size()) + " joints, robot " +
                       quote(robot.placed->name) + " " + std::to_string(robot.start.size()) +
                       (rail == 0 ? std::string()
                                  : ", of which " + std::to_string(rail) + " are additional"),
                   "Give the program the cell of this robot (SYSTEM_SPECIFICATION).");
    std::vector<double> q;
    for (std::size_t j = 0; j < given.size(); ++j)
      q.push_back(given[j] * (TaskExecutor::is_rotary(robot, rail + j) ? kDegree : kMillimetre));
    return q;
  }
  /// How many of a robot's first joints are additional axes of the program: a rail.
  [[nodiscard]] std::size_t rail_of(std::size_t who) const {
    const auto it = n_.rails.find(who);
    return it == n_.rails.end() ? 0 : it->second;
  }
  /// base_T_carriage: what the arm stands on, with the first joint values of `q`.
  [[nodiscard]] Pose base_T_carriage(std::size_t who, std::span<const double> q) const {
    Pose out{};
    const RobotModel& model = *x_.actors_[who].model;
    for (std::size_t j = 0; j < rail_of(who); ++j)
      out = spatial::compose(out, moved_joint(model.joints[j], q[j]));
    return out;
  }
  /// parent_T_joint of a joint of one coordinate.
  static Pose moved_joint(const JointModel& joint, double q) {
    Pose by{};
    if (joint.type == JointType::prismatic) by.p = {0, 0, q};
    else by.R = spatial::from_quaternion({std::cos(q / 2), 0, 0, std::sin(q / 2)});
    return spatial::compose(joint.placement, by);
  }
  /// A robot behind its rail: the joints that solvers of its arm move.
  [[nodiscard]] std::shared_ptr<RobotModel> arm_of(std::size_t who,
                                                   const TaskExecutor::Grip& tip) const {
    auto model = std::make_shared<RobotModel>(*x_.actors_[who].model);
    const auto rail = static_cast<std::int32_t>(rail_of(who));
    model->joints.erase(model->joints.begin(), model->joints.begin() + rail);
    for (JointModel& j : model->joints) j.parent = std::max(-1, j.parent - rail);
    model->number_coordinates();
    model->tips = {{"tool", std::max(-1, tip.joint - rail), tip.joint_T_grip}};
    return model;
  }

  std::shared_ptr<const ProgramActor::Solver> solver(std::size_t who, const TaskExecutor::Grip& tip,
                                                     Result<void>& failed) {
    for (const auto& s : a_.solvers_)
      if (s->actor == who && s->tip.joint == tip.joint &&
          same_pose(s->tip.joint_T_grip, tip.joint_T_grip))
        return s;
    const TaskExecutor::Actor& robot = x_.actors_[who];
    auto model = arm_of(who, tip);
    auto bound = sim::bind_ik(x_.sim_->registry, std::move(model), robot.record->ik);
    if (!bound.ok()) {
      Error e = std::move(bound).error();
      // What is left of an arm is not what its solver is for.
      if (const std::size_t rail = rail_of(who); rail > 0)
        e = error(
            e.code,
            (rail == 1 ? std::string("joint 1 is bound as an additional one")
                       : "joints 1 to " + std::to_string(rail) + " are bound as additional ones") +
                ", and for what is left " + e.message,
            "program.unbind gives them back to the arm; additional are those of a rail that "
            "carries it.",
            "robot " + quote(robot.placed->name));
      failed = std::move(e);
      return nullptr;
    }
    auto made = std::make_shared<ProgramActor::Solver>();
    made->actor = who, made->tip = tip, made->ik = std::move(*bound);
    made->branches = sim::BranchNames(made->ik, 0);
    a_.solvers_.push_back(made);
    return made;
  }
  /// Bit k is set where the arm is on the second way of choice k.
  static std::int32_t status_of(const sim::BranchNames& names, std::span<const double> q) {
    std::int32_t out = 0;
    const std::vector<double> m = names.measure(q);
    for (std::size_t k = 0; k < m.size(); ++k)
      if (m[k] < 0) out |= 1 << k;
    return out;
  }
  [[nodiscard]] std::vector<std::int32_t> turns_of(const TaskExecutor::Actor& robot,
                                                   std::span<const double> q,
                                                   std::size_t rail) const {
    const double from = turns_from(a_.machine_.code());
    std::vector<std::int32_t> out;
    for (std::size_t j = rail; j < q.size(); ++j)
      out.push_back(TaskExecutor::is_rotary(robot, j) ? turn_of(q[j] / kDegree, from) : 0);
    return out;
  }
  Result<Target> state_at(const ProgramActor::RobotUse& use, const std::vector<double>& q) {
    const TaskExecutor::Actor& robot = x_.actors_[use.actor];
    RMP_TRY_ASSIGN(const TaskExecutor::Grip tip, x_.tip(use.actor, use.tool));
    RMP_TRY_ASSIGN(const Pose frame, base_T_frame(use, nullptr));
    Target out;
    out.pose = to_plain(spatial::compose(spatial::inverse(frame), base_T_tip(use.actor, tip, q)));
    const std::size_t rail = rail_of(use.actor);
    for (std::size_t j = rail; j < q.size(); ++j)
      out.joints.push_back(q[j] / (TaskExecutor::is_rotary(robot, j) ? kDegree : kMillimetre));
    out.additional = additional_now();
    Result<void> failed;
    if (const auto s = solver(use.actor, tip, failed))
      if (!s->branches.empty()) out.status = status_of(s->branches, std::span(q).subspan(rail));
    out.turns = turns_of(robot, q, rail);
    return out;
  }
  [[nodiscard]] std::vector<double> additional_now() const {
    std::vector<double> out = a_.additional_;
    for (const auto& [number, use] : n_.joints) {
      if (use.is_grip) continue;
      if (out.size() < number) out.resize(number);
      const TaskExecutor::Actor& robot = x_.actors_[use.at];
      out[number - 1] = TaskExecutor::sample(robot, now_).q[use.joint] /
                        (TaskExecutor::is_rotary(robot, use.joint) ? kDegree : kMillimetre);
    }
    return out;
  }

  /// A joint angle in the whole turn that is wanted, or the nearest to `seed` within the limits.
  static double turned(const JointModel& joint, double q, double seed) {
    double best = q;
    for (int k = -3; k <= 3; ++k) {
      const double other = q + k * kTurn;
      if (other < joint.lower || other > joint.upper) continue;
      if (std::fabs(other - seed) < std::fabs(best - seed) - kSame) best = other;
    }
    return best;
  }
  /// The configuration for a pose: of the branch and turns that a ROBTARGET names, else the
  /// nearest.
  /// The joints of its rail stay as the seed has them.
  Result<std::vector<double>> configuration(std::size_t who, const TaskExecutor::Grip& tip,
                                            const Pose& base_T_target,
                                            const std::vector<double>& all, const Target* target) {
    const TaskExecutor::Actor& robot = x_.actors_[who];
    const std::size_t rail = rail_of(who);
    const std::vector<double> seed(all.begin() + static_cast<std::ptrdiff_t>(rail), all.end());
    const Pose arm_T_target =
        spatial::compose(spatial::inverse(base_T_carriage(who, all)), base_T_target);
    Result<void> failed;
    const auto s = solver(who, tip, failed);
    if (!s) return std::move(failed).error();
    IkBatch batch;
    batch.targets = {&arm_T_target, 1};
    batch.seeds = seed;
    batch.all_solutions = true;
    RMP_TRY_ASSIGN(const auto results, sim::solve_ik(s->ik, batch, progress_));
    const IkResult& r = results.front();
    const std::size_t n = seed.size();
    if (r.status != IkStatus::solved) {
      trouble_ = {};
      trouble_.joint = r.limiting_joint;
      trouble_.excess = std::max(r.shortfall, r.position_error);
      trouble_.world_T_target = spatial::compose(robot.world_T_base, base_T_target);
      return error(ErrorCode::unreachable,
                   "robot " + quote(robot.placed->name) + " does not reach " +
                       place(base_T_target.p) +
                       " from its base: " + (r.detail.empty() ? "there is no solution" : r.detail),
                   "Move the target or the robot.");
    }
    const bool has_status = target && target->status >= 0;
    if (has_status && s->branches.empty())
      note_once("STATUS is not heeded: the inverse kinematics of " + robot.placed->name +
                " names no branches");
    const std::int32_t mask = (1 << std::min<std::size_t>(s->branches.choices().size(), 30)) - 1;
    if (has_status && !s->branches.empty() && (target->status & ~mask) != 0)
      return error(ErrorCode::invalid_argument,
                   "a target has STATUS " + std::to_string(target->status) + ", and robot " +
                       quote(robot.placed->name) + " has no such branch (" + s->branches.words() +
                       ")",
                   "It is 0 to " + std::to_string(mask) + ", or -1 for any.");
    std::vector<double> best;
    double least = 0;
    std::set<std::int32_t> others;
    bool is_turn_missing = false;
    const double from = turns_from(a_.machine_.code());
    for (std::size_t i = 0; i + n <= r.q.size(); i += n) {
      std::vector<double> q(r.q.begin() + static_cast<std::ptrdiff_t>(i),
                            r.q.begin() + static_cast<std::ptrdiff_t>(i + n));
      if (has_status && !s->branches.empty()) {
        const std::int32_t own = status_of(s->branches, q);
        if (own != (target->status & mask)) {
          others.insert(own);
          continue;
        }
      }
      const std::size_t turns =
          has_status ? std::min(target->turns.size(), n) : 0;  // of the last joints
      bool fits = true;
      for (std::size_t j = 0; j < n; ++j) {
        if (!TaskExecutor::is_rotary(robot, rail + j)) continue;
        const JointModel& joint = robot.model->joints[rail + j];
        if (j + turns < n || is_any_turn(target->turns[j + turns - n])) {
          q[j] = turned(joint, q[j], seed[j]);
          continue;
        }
        q[j] = in_turn(q[j] / kDegree, target->turns[j + turns - n], from, seed[j] / kDegree) *
               kDegree;
        fits = fits && q[j] >= joint.lower - kSame && q[j] <= joint.upper + kSame;
      }
      if (!fits) {
        is_turn_missing = true;
        continue;
      }
      double way = 0;
      for (std::size_t j = 0; j < n; ++j) way += (q[j] - seed[j]) * (q[j] - seed[j]);
      if (best.empty() || way < least - kSame) best = std::move(q), least = way;
    }
    if (!best.empty()) {
      best.insert(best.begin(), all.begin(), all.begin() + static_cast<std::ptrdiff_t>(rail));
      return best;
    }
    trouble_ = {};
    trouble_.world_T_target = spatial::compose(robot.world_T_base, base_T_target);
    if (is_turn_missing)
      return error(ErrorCode::unreachable,
                   "robot " + quote(robot.placed->name) + " cannot come to " +
                       place(base_T_target.p) + " with these turns of its last joints",
                   "Give TURNS of 0, or a target without them (a POSE).");
    std::vector<std::string> reach;
    for (const std::int32_t o : others) reach.push_back(std::to_string(o));
    return error(ErrorCode::unreachable,
                 "robot " + quote(robot.placed->name) + " does not reach " +
                     place(base_T_target.p) + " with STATUS " + std::to_string(target->status) +
                     " (" + s->branches.words() + ")",
                 "It does with STATUS " + text::enumerate(reach) + ", or with a POSE, or with -1.");
  }

  Result<void> grip(std::size_t at, bool takes) {
    const ProgramActor::GripUse& use = n_.grips[at];
    const TaskExecutor::Actor& robot = x_.actors_[use.robot.actor];
    std::vector<std::string>& taken = a_.taken_[at];
    if (!takes) {
      for (const std::string& object : std::exchange(taken, {})) {
        const auto what = x_.thing_of_.find(object);
        const auto& last = x_.things_[what->second].history.back();
        if (last.is_held && last.actor == use.robot.actor) RMP_TRY(x_.detach(object, now_));
      }
      return {};
    }
    RMP_TRY_ASSIGN(const TaskExecutor::Grip tip, x_.tip(use.robot.actor, use.robot.tool));
    const Pose tool = spatial::compose(x_.world_T_joint(robot, tip.joint, now_), tip.joint_T_grip);
    RMP_TRY_ASSIGN(auto near, x_.touching(tool.p, use.reach, now_, progress_));
    std::erase_if(near, [&](const std::string& object) {
      const auto& last = x_.things_[x_.thing_of_.find(object)->second].history.back();
      return last.is_held && last.actor == use.robot.actor;
    });
    const bool is_near = use.object.empty()
                             ? !near.empty()
                             : std::find(near.begin(), near.end(), use.object) != near.end();
    if (!is_near) {
      if (a_.inspection_)
        tell(InspectedEvent::Kind::grip,
             "the gripper of " + robot.placed->name + " shuts, and " +
                 (use.object.empty() ? std::string("nothing is") : use.object + " is not") +
                 " within " + text::print_rounded(use.reach * 1000) + " mm of its tool",
             "Move the target to the object, or give the grip a greater reach (program.bind).");
      x_.note(now_, n_.name + ": the gripper of " + robot.placed->name + " shuts, and " +
                        (use.object.empty() ? "nothing" : use.object + " is not") +
                        (use.object.empty() ? " is" : "") + " within " +
                        text::print_rounded(use.reach * 1000) + " mm of its tool");
      return {};
    }
    model::TaskStep step;
    step.kind = model::StepKind::attach;
    step.object = use.object.empty() ? near.front() : use.object;
    const bool is_member =
        robotics::find_grip(*robot.record, *robot.model, use.robot.tool).has_value();
    step.link = is_member ? use.robot.tool : std::string();
    RMP_TRY(x_.attach(step, robot.placed->name, now_));
    taken.push_back(step.object);
    return {};
  }

  /// Poses as base_T_tool, and their joint values where they are given so.
  struct Goal {
    bool is_joints = false;
    std::vector<double> q;
    Pose pose;
    const Target* target = nullptr;
  };
  struct Along {
    std::size_t actor = 0;
    std::vector<double> to;
    sim::RobotMotion motion;
  };
  /// Who moves, with which tool, in which frame, and from when on.
  struct Beginning {
    const ProgramActor::RobotUse* use = nullptr;
    const ProgramActor::OpenMotion* before = nullptr;  ///< that this one may run into
    double start = 0;
    TaskExecutor::Grip tip;
    Pose frame;
    // Of additional axes, and of ADAX_CONTROL:
    std::vector<double> rail_to;        ///< values of the joints before the chain at its end
    std::optional<std::size_t> device;  ///< the positioner that the path is seen from
    std::vector<double> device_from, device_to;  ///< its joint values at the start, and the end
    TaskExecutor::Grip device_tip;
    Pose reference_from, reference_to;  ///< base_T_reference, at the motion's start and end
    std::vector<Along> along;           ///< other robots and mechanisms, and where they go
    std::vector<std::pair<std::size_t, bool>> grips;  ///< at its end
    std::vector<double> additional;                   ///< as they are then
    bool reference_is_carriage = false;
    [[nodiscard]] bool is_tied() const { return !rail_to.empty() || device.has_value(); }
  };
  Result<Goal> goal(const program::Motion& m, const Target& t, const Beginning& b,
                    const Goal& before) {
    const std::size_t who = b.use->actor, rail = rail_of(who);
    const Pose& frame = b.frame;
    const TaskExecutor::Grip& tip = b.tip;
    Goal out;
    out.target = t.role == RMP_ROLE_ROBTARGET ? &t : nullptr;
    if (t.role == RMP_ROLE_MAIN_JOINT || t.role == RMP_ROLE_JOINT) {
      out.is_joints = true;
      RMP_TRY_ASSIGN(out.q, joints_of(who, t.joints));
      if (m.is_incremental)
        for (std::size_t j = 0; j < out.q.size(); ++j) out.q[j] += before.q[rail + j];
      out.q.insert(out.q.begin(), b.rail_to.begin(), b.rail_to.end());
      for (std::size_t j = rail; j < out.q.size(); ++j) {
        const JointModel& joint = x_.actors_[who].model->joints[j];
        if (out.q[j] >= joint.lower - kSame && out.q[j] <= joint.upper + kSame) continue;
        const double unit = TaskExecutor::is_rotary(x_.actors_[who], j) ? kDegree : kMillimetre;
        trouble_ = {};
        trouble_.joint = static_cast<std::int32_t>(j);
        trouble_.value = out.q[j];
        trouble_.excess = std::max(out.q[j] - joint.upper, joint.lower - out.q[j]);
        return error(ErrorCode::unreachable,
                     "joint " + std::to_string(j - rail + 1) + " of " +
                         quote(x_.actors_[who].placed->name) + " cannot go to " +
                         text::print_rounded(out.q[j] / unit),
                     "It goes from " + text::print_rounded(joint.lower / unit) + " to " +
                         text::print_rounded(joint.upper / unit) + ".");
      }
      out.pose = base_T_tip(who, tip, out.q);
      return out;
    }
    if (t.role == RMP_ROLE_ADD_JOINT) {
      if (b.is_tied() && m.attributes.additional_axes != 0) {
        out.pose = before.pose;  // the tool stays in what the path is in
        return out;
      }
      out = before;
      out.is_joints = true;
      return out;
    }
    Pose p = to_pose(t.pose);
    if (m.is_incremental) {
      // By this much in the axes of the targets' frame.
      const Pose now = spatial::compose(spatial::inverse(frame), before.pose);
      Pose turn = p, place_only;
      turn.p = {0, 0, 0};
      place_only.R = now.R;
      Pose next = spatial::compose(turn, place_only);
      if (t.role == RMP_ROLE_POSITION) next = place_only;
      for (std::size_t k = 0; k < 3; ++k) next.p[k] = now.p[k] + p.p[k];
      out.pose = spatial::compose(frame, next);
      return out;
    }
    out.pose = spatial::compose(frame, p);
    if (t.role == RMP_ROLE_POSITION) out.pose.R = before.pose.R;
    return out;
  }

  /// DEVICE: 1 is the robot itself, others are of the robot's R_DEVICES, where it has them.
  Result<const ProgramActor::RobotUse*> device_of(const MotionAttributes& at) {
    if (at.device == 1) return robot_of(at.robot_symbol);
    std::int64_t number = at.device;
    if (!at.robot.empty()) {
      const auto listed =
          a_.machine_.evaluate(at.robot + ".R_DEVICES[" + std::to_string(at.device) + "]", 0,
                               program::Machine::kNoFrame);
      const auto read = listed.ok() ? text::read_int(listed->value) : std::nullopt;
      if (read) number = *read;
    }
    const auto it = n_.devices.find(number);
    if (it != n_.devices.end()) return &it->second;
    const std::string word = std::to_string(number);
    return error(ErrorCode::invalid_argument,
                 "DEVICE is " + std::to_string(at.device) +
                     (number == at.device ? std::string()
                                          : ", which is device " + word + " of " + at.robot) +
                     ", and the world has none of that number",
                 number < 1 ? std::string("Name one that the robot has in R_DEVICES.")
                            : "program.bind{kind = \"robot\", name = \"" + word +
                                  "\", to = ...} gives it a robot of the world.");
  }
  /// Whether nothing moves a robot but the brakes, of what the program has ended itself.
  [[nodiscard]] bool is_braked(std::size_t who) const {
    const auto it = a_.braked_until_.find(who);
    return it != a_.braked_until_.end() &&
           TaskExecutor::moved_until(x_.actors_[who]) <= it->second + kSame;
  }
  Result<Beginning> beginning(const program::Motion& m) {
    const MotionAttributes& at = m.attributes;
    Beginning out;
    RMP_TRY_ASSIGN(out.use, device_of(at));
    const std::size_t who = out.use->actor;
    const TaskExecutor::Actor& robot = x_.actors_[who];
    const std::string& name = robot.placed->name;
    if (!TaskExecutor::can_move(robot) || robot.axes)
      return error(ErrorCode::unsupported,
                   "robot " + quote(name) +
                       " has closed loops, joints that follow others or joints of several "
                       "coordinates, which programs cannot move yet",
                   "Move it by a task.");
    // Where and when it begins.
    if (m.after)
      if (const auto it = a_.open_.find(m.after); it != a_.open_.end() && it->second.actor == who)
        out.before = &it->second;
    const double free_from = TaskExecutor::moved_until(robot);
    // What the program has ended itself comes to rest before.
    const bool waits = out.before || is_braked(who);
    if (!waits && free_from > now_ + kSame)
      return error(ErrorCode::conflict,
                   "robot " + quote(name) +
                       " is still moved by another program, process or task "
                       "at t = " +
                       text::print_rounded(now_) + " s",
                   "Let one wait for a signal or semaphore of the other.");
    out.start = waits ? std::max(now_, free_from) : now_;
    const bool takes_along = std::any_of(m.targets.begin(), m.targets.end(),
                                         [](const Target& t) { return !t.additional.empty(); });
    for (const auto& [joint, other] : n_.joints)
      if (takes_along && !out.before && !other.is_grip && is_braked(other.at))
        out.start = std::max(out.start, TaskExecutor::moved_until(x_.actors_[other.at]));
    if (at.tool) {
      RMP_TRY_ASSIGN(out.tip,
                     x_.grip(robot, robot.record->links.empty() ? std::string()
                                                                : robot.record->links.back().name));
      out.tip.joint_T_grip = spatial::compose(out.tip.joint_T_grip, to_pose(*at.tool));
    } else {
      RMP_TRY_ASSIGN(out.tip, x_.tip(who, out.use->tool));
    }
    RMP_TRY_ASSIGN(out.frame, base_T_frame(*out.use, at.frame ? &*at.frame : nullptr));
    RMP_TRY(additional(m, out));
    RMP_TRY(tie(m, out));
    return out;
  }
  /// What the path of a motion is in: ADAX_CONTROL.
  Result<void> tie(const program::Motion& m, Beginning& out) {
    constexpr std::int32_t kKeep = 1, kKeepRelative = 2, kOfDevice = 3;
    const MotionAttributes& at = m.attributes;
    const std::int32_t control = at.additional_axes;
    const std::size_t who = out.use->actor;
    const std::vector<double> q = TaskExecutor::sample(x_.actors_[who], out.start).q;
    if (control < 0 || control > kOfDevice)
      return error(ErrorCode::invalid_argument,
                   "ADAX_CONTROL is " + std::to_string(control) + ", which means nothing",
                   "Give 0, TCP_KEEP, TCP_KEEP_REL or DEVICE_REL.");
    if (control == 0 && rail_of(who) > 0) {
      out.reference_from = base_T_carriage(who, q);
      out.reference_to = base_T_carriage(who, out.rail_to);
      out.reference_is_carriage = true;
    }
    if (control <= kKeep) return {};
    const std::string word = control == kKeepRelative ? "TCP_KEEP_REL" : "DEVICE_REL";
    std::set<std::size_t> devices;
    for (const auto& [number, use] : n_.joints)
      if (!use.is_grip && use.at != who) devices.insert(use.at);
    if (devices.size() != 1)
      return error(ErrorCode::invalid_argument,
                   devices.empty()
                       ? "ADAX_CONTROL is " + word + ", and no additional joint is a positioner's"
                       : "ADAX_CONTROL is " + word + ", and the additional joints are of " +
                             std::to_string(devices.size()) + " devices",
                   "program.bind{kind = \"joint\", name = \"1\", to = ...} names the joints of "
                   "one positioner.");
    const std::size_t device = *devices.begin();
    out.device = device;
    out.device_from = TaskExecutor::sample(x_.actors_[device], out.start).q;
    out.device_to = out.device_from;
    for (const Along& one : out.along)
      if (one.actor == device) out.device_to = one.to;
    RMP_TRY_ASSIGN(out.device_tip, x_.tip(device, {}));
    const Pose base_T_device = spatial::compose(spatial::inverse(x_.actors_[who].world_T_base),
                                                x_.actors_[device].world_T_base);
    out.reference_from =
        spatial::compose(base_T_device, base_T_tip(device, out.device_tip, out.device_from));
    out.reference_to =
        spatial::compose(base_T_device, base_T_tip(device, out.device_tip, out.device_to));
    if (control == kOfDevice)
      out.frame =
          at.frame ? spatial::compose(out.reference_to, to_pose(*at.frame)) : out.reference_to;
    return {};
  }

  Result<void> begin(const program::Motion& m) {
    RMP_TRY_ASSIGN(const Beginning b, beginning(m));
    return begin(m, b);
  }
  Result<void> begin(const program::Motion& m, const Beginning& b) {
    const MotionAttributes& at = m.attributes;
    const ProgramActor::OpenMotion* const before = b.before;
    const std::size_t who = b.use->actor;
    const TaskExecutor::Actor& robot = x_.actors_[who];
    const std::string& name = robot.placed->name;
    const double start = b.start;
    const TaskExecutor::Grip& tip = b.tip;
    // PTP from one target to another that takes a TIME of its own.
    const bool is_timed_ptp =
        m.interpolation == RMP_MOVE_PTP && at.time > 0 && m.targets.size() == 1 && b.along.empty();
    const bool passes = is_timed_ptp && at.passes && !(at.c_ptp > 0);
    if (!passes) tell_unheeded(at);
    Goal from;
    from.q = TaskExecutor::sample(robot, start).q;
    from.pose = base_T_tip(who, tip, from.q);
    TaskExecutor::Drive d;
    d.from = from.q;
    std::vector<double> to = from.q;
    RMP_TRY(drive(m, b, from, d, &to));
    // Additional joints go along, in the same time.
    ProgramActor::OpenMotion open;
    std::vector<Along> along = b.along;
    open.grips = b.grips;
    for (const Along& one : along) open.along.push_back(one.actor);
    open.along_from = start;
    if (b.is_tied() && m.interpolation != RMP_MOVE_PTP) {
      open.actor = who, open.tip = tip, open.start = start;
      RMP_TRY_ASSIGN(const double total, begin_tied(b, from.q, d, start, at.time));
      a_.additional_ = b.additional;
      open.end = start + total;
      a_.open_[m.number] = std::move(open);
      return {};
    }
    const std::string where;
    sim::RobotMotion motion;
    double least = 0;
    for (Along& one : along) {
      RMP_TRY_ASSIGN(one.motion, move_along(one, 0, start));
      if (!one.motion.times.empty()) least = std::max(least, one.motion.times.back());
    }
    const auto plan = [&](double when) -> Result<sim::RobotMotion> {
      if (d.trajectory.segments.empty()) return sim::RobotMotion{};
      RMP_TRY_ASSIGN(auto made, x_.driven(who, d, where, when, progress_));
      if (made.times.back() < least && !along.empty()) {
        if (d.trajectory.segments.size() == 1)
          d.trajectory.segments[0].shape.params["duration"] = least;
        RMP_TRY_ASSIGN(made, x_.driven(who, d, where, when, progress_));
      }
      if (m.interpolation != RMP_MOVE_PTP && at.time > 0)
        RMP_TRY(keeps_speeds(who, made, std::max(at.time, made.times.back())));
      return made;
    };
    open.actor = who, open.tip = tip;
    open.velocity_share = d.velocity_share, open.acceleration_share = d.acceleration_share;
    open.c_cp = m.interpolation == RMP_MOVE_PTP ? 0 : at.c_cp * kMillimetre;
    open.c_ptp = m.interpolation == RMP_MOVE_PTP ? at.c_ptp : 0;
    open.c_speed = m.interpolation == RMP_MOVE_PTP ? 1 : at.c_speed / 100;
    open.speed = m.interpolation == RMP_MOVE_PTP || at.time > 0 ? 0 : at.speed * kMillimetre;
    open.start = open.end = start;
    if (before && (before->c_cp > 0 || before->c_ptp > 0) && before->c_speed > 0 && along.empty() &&
        !d.trajectory.segments.empty()) {
      RMP_TRY_ASSIGN(const bool is_blended, blend(m.after, *before, who, open, plan));
      if (is_blended) {
        a_.additional_ = b.additional;
        a_.open_[m.number] = std::move(open);
        return {};
      }
      note_once(
          "a transition was left out where it would pass the limits of the joints or the "
          "length of the next motion, or where C_SPEED is next to nothing; " +
          name + " stops there");
    }
    if (before && (before->c_cp > 0 || before->c_ptp > 0) && !along.empty())
      note_once("a transition was left out where additional axes move; " + name + " stops there");
    bool is_behind = false;  // it begins with a rate
    std::vector<double> rate(from.q.size(), 0.0);
    if (before && before->passing) {
      ProgramActor::OpenMotion& last = a_.open_[m.after];
      if (is_timed_ptp && can_pass(last)) {
        RMP_TRY_ASSIGN(rate, pass(last, to, at.time));
        is_behind = true;
      } else {
        RMP_TRY(stops(last));
        note_once("C_PASS is left out where no PTP of one target with a TIME follows at once; " +
                  name + " stops there");
      }
    }
    if (passes || is_behind) {
      open.passing = ProgramActor::Passing{};
      open.passing->is_from_rest = !is_behind;
      open.passing->rate = rate, open.passing->to = to;
      open.passing->process = m.process, open.passing->span = m.span;
      motion = cubics(from.q, rate, to, std::vector<double>(to.size(), 0.0), at.time);
      if (!passes) {
        open.passing->end = ProgramActor::Passing::End::stop;
        RMP_TRY(keeps_limits(open, from.q, {}, at.time, nullptr));
      }
    } else {
      RMP_TRY_ASSIGN(motion, plan(start));
      // TIME at the target is spent there.
      if (motion.times.empty() && at.time > 0) motion = cubics(from.q, rate, from.q, rate, at.time);
    }
    double total = motion.times.empty() ? 0 : motion.times.back();
    for (Along& one : along) {
      if (!one.motion.times.empty() && one.motion.times.back() < total - kSame) {
        RMP_TRY_ASSIGN(one.motion, move_along(one, total, start));
      }
      if (!one.motion.times.empty()) total = std::max(total, one.motion.times.back());
      x_.push(one.actor, start, std::move(one.motion));
    }
    x_.push(who, start, std::move(motion));
    a_.additional_ = b.additional;
    open.end = start + total;
    a_.open_[m.number] = std::move(open);
    return {};
  }

  // ---- PTP under TIME with C_PASS: targets that are passed without a stop ----
  /// All joints by cubics, with values [rad or m] and rates at both ends.
  static sim::RobotMotion cubics(std::span<const double> from, std::span<const double> from_rate,
                                 std::span<const double> to, std::span<const double> to_rate,
                                 double duration) {
    sim::RobotMotion m;
    m.times = {0, duration};
    for (const double t : m.times)
      for (std::size_t j = 0; j < from.size(); ++j) {
        const spatial::Jet s =
            spatial::cubic(to[j] - from[j], from_rate[j], to_rate[j], duration, t);
        m.q.push_back(t > 0 ? to[j] : from[j]);
        m.qd.push_back(t > 0 ? to_rate[j] : from_rate[j]);
        m.qdd.push_back(s.dd);
      }
    return m;
  }
  /// Whether the robot is still to come to, or on, a motion that ends as what follows lets it.
  [[nodiscard]] bool can_pass(const ProgramActor::OpenMotion& open) const {
    const auto& moves = x_.actors_[open.actor].moves;
    return open.passing && open.passing->end == ProgramActor::Passing::End::open &&
           now_ < open.end - kSame && !moves.empty() &&
           std::fabs(moves.back().start - open.start) < kSame;
  }
  /// Lets a motion pass its target on the way to the next one; with which rates it does.
  Result<std::vector<double>> pass(ProgramActor::OpenMotion& open, const std::vector<double>& next,
                                   double next_time) {
    const TaskExecutor::Actor& robot = x_.actors_[open.actor];
    const std::vector<double> from = TaskExecutor::sample(robot, open.start).q,
                              &to = open.passing->to;
    const double time = open.end - open.start;
    std::vector<double> rate, bend;
    for (std::size_t j = 0; j < to.size(); ++j) {
      const double way = to[j] - from[j], way_on = next[j] - to[j];
      rate.push_back(spatial::passing_rate(way, time, way_on, next_time));
      bend.push_back(2 * (way_on / next_time - way / time) / (time + next_time));
    }
    RMP_TRY(keeps_limits(open, from, rate, time, &bend));
    open.passing->end = ProgramActor::Passing::End::passed;
    if (now_ <= open.start + kSame) {
      x_.actors_[open.actor].moves.back().motion = cubics(from, open.passing->rate, to, rate, time);
    } else {
      const auto s = TaskExecutor::sample(robot, now_);
      x_.push(open.actor, now_, cubics(s.q, s.qd, to, rate, open.end - now_));
    }
    return rate;
  }
  /// Nothing follows that a motion could pass on to. From rest it then goes as without C_PASS.
  Result<void> stops(ProgramActor::OpenMotion& open) {
    if (!can_pass(open)) return {};
    ProgramActor::Passing& p = *open.passing;
    p.end = ProgramActor::Passing::End::stop;
    TaskExecutor::Actor& robot = x_.actors_[open.actor];
    const std::vector<double> from = TaskExecutor::sample(robot, open.start).q;
    double way = 0;
    for (std::size_t j = 0; j < from.size(); ++j) way = std::max(way, std::fabs(p.to[j] - from[j]));
    if (!p.is_from_rest || now_ > open.start + kSame)
      return keeps_limits(open, from, {}, open.end - open.start, nullptr);
    if (way < kSameJoints) return {};
    TaskExecutor::Drive d;
    d.from = from;
    d.velocity_share = open.velocity_share, d.acceleration_share = open.acceleration_share;
    model::TrajectorySegment s;
    s.shape.name = "ptp";
    s.shape.params["profile"] = std::string("trapezoidal");
    s.shape.params["duration"] = open.end - open.start;
    s.joints = {p.to};
    d.trajectory.segments.push_back(std::move(s));
    RMP_TRY_ASSIGN(auto motion, x_.driven(open.actor, d, {}, open.start, progress_));
    robot.moves.pop_back();
    x_.push(open.actor, open.start, std::move(motion));
    return {};
  }
  /// Of a motion from `from` that ends with `rate` (none = rest). What its targets ask for, before
  /// it and behind it by `bend` [rad/s^2 or m/s^2], is an error where a joint has not as much; what
  /// only its cubic has more than that is a note.
  Result<void> keeps_limits(const ProgramActor::OpenMotion& open, std::span<const double> from,
                            const std::vector<double>& rate, double time,
                            const std::vector<double>* bend) {
    const ProgramActor::Passing& p = *open.passing;
    const TaskExecutor::Actor& robot = x_.actors_[open.actor];
    struct Worst {
      double share = kWithin, value = 0, limit = 0;
      std::size_t joint = 0;
    } asked_speed, asked_turn, speed, turn;
    const auto look = [](Worst& worst, std::size_t j, double value, double limit) {
      const double share = std::fabs(value) / limit;
      if (share > worst.share) worst = {share, std::fabs(value), limit, j};
    };
    for (std::size_t j = 0; j < p.to.size(); ++j) {
      const JointModel& joint = robot.model->joints[j];
      const double v = joint.max_velocity * open.velocity_share,
                   a = joint.max_acceleration * open.acceleration_share;
      const double way = p.to[j] - from[j], end = rate.empty() ? 0 : rate[j];
      look(asked_speed, j, way / time, v);
      if (bend) look(asked_turn, j, (*bend)[j], a);
      if (p.is_from_rest || !bend) look(asked_turn, j, 2 * way / (time * time), a);
      look(speed, j, spatial::greatest_rate(way, p.rate[j], end, time), v);
      for (const double t : {0.0, time})
        look(turn, j, spatial::cubic(way, p.rate[j], end, time, t).dd, a);
    }
    if (speed.share > kMostExcess && asked_speed.share == kWithin) asked_speed = speed;
    const auto words = [&](const Worst& w, const char* per) {
      const double unit = TaskExecutor::is_rotary(robot, w.joint) ? kDegree : kMillimetre;
      const std::string word = (unit == kDegree ? " degrees/s" : " mm/s") + std::string(per);
      return "at " + text::print_rounded(w.value / unit, 4) + word + ", and its greatest is " +
             text::print_rounded(w.limit / unit, 4);
    };
    const auto name = [&](const Worst& w) {
      return "joint " + std::to_string(w.joint - std::min(w.joint, rail_of(open.actor)) + 1) +
             " of " + quote(robot.placed->name);
    };
    for (const auto* w : {&asked_speed, &asked_turn}) {
      if (w->share == kWithin) continue;
      const bool is_speed = w == &asked_speed;
      trouble_ = {};
      trouble_.joint = static_cast<std::int32_t>(w->joint);
      return error(
          ErrorCode::unreachable,
          "TIME of " + text::print_rounded(time) + " s of the motion to the target in " +
              place_of(p.span) + " is too short: " + name(*w) +
              (is_speed ? " would go " : " would be accelerated ") +
              words(*w, is_speed ? "" : "^2"),
          "Give TIME of " +
              text::print_rounded(
                  std::ceil(time * (is_speed ? w->share : std::sqrt(w->share)) * 1000) / 1000) +
              " s or more.");
    }
    for (const auto* w : {&speed, &turn}) {
      if (w->share == kWithin) continue;
      const bool is_speed = w == &speed;
      const std::string what = name(*w) + (is_speed ? " goes " : " is accelerated ");
      if (!x_.told_.emplace(n_.name, "C_PASS: " + what).second) continue;
      const std::string said = what + words(*w, is_speed ? "" : "^2") +
                               ": so it passes targets in their TIMEs (C_PASS, " +
                               place_of(p.span) + ")";
      x_.note(now_, n_.name + ": " + said);
      if (a_.inspection_) tell(InspectedEvent::Kind::ignored, said, "Give longer TIMEs.");
    }
    return {};
  }
  [[nodiscard]] std::string place_of(const rmp_span& s) const {
    return "line " + std::to_string(s.line);
  }

  /// A motion under TIME has no speed of its own: the joints bound it.
  Result<void> keeps_speeds(std::size_t who, const sim::RobotMotion& m, double time) {
    const TaskExecutor::Actor& robot = x_.actors_[who];
    const std::size_t n = robot.start.size();
    double worst = kWithin, fastest = 0;
    std::size_t which = n;
    for (std::size_t k = 0; k < m.qd.size(); ++k) {
      const double rate = std::fabs(m.qd[k]),
                   share = rate / robot.model->joints[k % n].max_velocity;
      if (share > worst) worst = share, fastest = rate, which = k % n;
    }
    if (which == n) return {};
    const bool is_rotary = TaskExecutor::is_rotary(robot, which);
    const double unit = is_rotary ? kDegree : kMillimetre;
    const std::string word = is_rotary ? " degrees/s" : " mm/s";
    trouble_ = {};
    trouble_.joint = static_cast<std::int32_t>(which);
    return error(ErrorCode::unreachable,
                 "TIME of " + text::print_rounded(time) + " s is too short: joint " +
                     std::to_string(which - std::min(which, rail_of(who)) + 1) + " of " +
                     quote(robot.placed->name) + " would go at " +
                     text::print_rounded(fastest / unit, 4) + word + ", and its greatest is " +
                     text::print_rounded(robot.model->joints[which].max_velocity / unit, 4),
                 "Give TIME of " + text::print_rounded(std::ceil(time * worst * 1000) / 1000) +
                     " s or more.");
  }

  void tell_unheeded(const MotionAttributes& at) {
    if (at.passes && !(at.c_cp > 0) && !(at.c_ptp > 0))
      note_once(
          "C_PASS without C_CP or C_PTP is carried out in PTP of one target with a TIME only: the "
          "motion stops at its target");
  }

  /// The targets of a motion; with `solves` each has joint values.
  /// Poses are those in the robot's base at the motion's end.
  Result<std::vector<Goal>> goals_of(const program::Motion& m, const Beginning& b, const Goal& from,
                                     bool solves) {
    std::vector<Goal> goals;
    Goal before = from;
    if (b.is_tied()) {
      if (m.targets.size() > 1 &&
          (m.interpolation == RMP_MOVE_PTP || m.interpolation == RMP_MOVE_LIN))
        return error(ErrorCode::unsupported,
                     "several targets in one motion, while additional axes move with it",
                     "Give each target a MOVE of its own.");
      std::copy(b.rail_to.begin(), b.rail_to.end(), before.q.begin());
      before.pose = spatial::compose(
          b.reference_to, spatial::compose(spatial::inverse(b.reference_from), from.pose));
    }
    for (const Target& t : m.targets) {
      const bool is_kept = t.role == RMP_ROLE_ADD_JOINT && !b.is_tied();
      RMP_TRY_ASSIGN(Goal next, goal(m, t, b, before));
      if (solves && !next.is_joints && !is_kept) {
        RMP_TRY_ASSIGN(next.q,
                       configuration(b.use->actor, b.tip, next.pose, before.q, next.target));
      } else if (next.q.empty()) {
        next.q = before.q;
      }
      if (!is_kept) goals.push_back(next);
      before = std::move(next);
    }
    return goals;
  }

  /// The segments of a motion; of PTP also the joint values at its end.
  Result<void> drive(const program::Motion& m, const Beginning& b, const Goal& begins,
                     TaskExecutor::Drive& d, std::vector<double>* end = nullptr) {
    const TaskExecutor::Grip& tip = b.tip;
    Goal from = begins;
    const MotionAttributes& at = m.attributes;
    const bool is_ptp = m.interpolation == RMP_MOVE_PTP;
    RMP_TRY_ASSIGN(std::vector<Goal> goals, goals_of(m, b, from, is_ptp));
    if (goals.empty()) return {};
    if (end && is_ptp) *end = goals.back().q;
    if (b.is_tied() && !is_ptp) {
      // As seen from what the path is in.
      from.pose = spatial::compose(spatial::inverse(b.reference_from), from.pose);
      for (Goal& g : goals) g.pose = spatial::compose(spatial::inverse(b.reference_to), g.pose);
    }
    const auto share = [&](double percent, const char* what) -> Result<double> {
      if (!(percent > 0) || percent > 100)
        return error(
            ErrorCode::invalid_argument,
            std::string(what) + " of " + text::print_rounded(percent) + " % is not possible",
            "Give more than 0 and at most 100.");
      return percent / 100;
    };
    if (is_ptp) {
      RMP_TRY_ASSIGN(d.velocity_share, share(at.speed_ptp, "SPEED_PTP"));
      RMP_TRY_ASSIGN(d.acceleration_share, share(at.acceleration_ptp, "ACC_PTP"));
      std::vector<double> ways;
      double all = 0;
      std::vector<double> q = from.q;
      for (const Goal& g : goals) {
        double way = 0, square = 0;
        for (std::size_t j = 0; j < q.size(); ++j) {
          way = std::max(way, std::fabs(g.q[j] - q[j]));
          square += (g.q[j] - q[j]) * (g.q[j] - q[j]);
        }
        if (std::sqrt(square) < kSameJoints) way = 0;
        ways.push_back(way);
        all += way;
        q = g.q;
      }
      for (std::size_t i = 0; i < goals.size(); ++i) {
        if (ways[i] == 0) continue;
        model::TrajectorySegment s;
        s.shape.name = "ptp";
        s.shape.params["profile"] = std::string("trapezoidal");
        if (at.time > 0) s.shape.params["duration"] = at.time * ways[i] / all;
        s.joints = {goals[i].q};
        d.trajectory.segments.push_back(std::move(s));
      }
      return {};
    }
    if (!(at.speed > 0) || !(at.speed_orientation > 0))
      return error(ErrorCode::invalid_argument,
                   "a speed of " + text::print_rounded(at.speed) + " mm/s and " +
                       text::print_rounded(at.speed_orientation) + " degrees/s is not possible",
                   "SPEED and SPEED_ORI are above 0.");
    RMP_TRY_ASSIGN(const double acceleration, share(at.acceleration, "ACC"));
    d.tip = tip;
    if (at.weaves && at.wobble_amplitude > 0) {
      double way = 0;
      Vec3 last = from.pose.p;
      for (const Goal& g : goals) way += distance(last, g.pose.p), last = g.pose.p;
      d.weave = motion::Weave{at.wobble_amplitude * kMillimetre, at.wobble_length * kMillimetre};
      // Under TIME: twice the mean speed, over arcs longer than their chords.
      d.weave_speed = at.time > 0 ? kPi * way / at.time : at.speed * kMillimetre;
    }
    const auto segment = [&](const char* shape, std::vector<Pose> points, double part) {
      model::TrajectorySegment s;
      s.shape.name = shape;
      s.law.name = "trapezoidal";
      if (std::string_view(shape) == "cubic_spline") s.orientation.name = "squad";
      for (const Pose& p : points) s.points.push_back(model::placement(p));
      const bool is_timed = at.time > 0;
      if (is_timed) s.shape.params["duration"] = at.time * part;
      s.shape.params["speed"] = is_timed ? kAnySpeed : at.speed * kMillimetre;
      s.shape.params["angular_speed"] = is_timed ? kAnySpeed : at.speed_orientation * kDegree;
      s.shape.params["acceleration"] = kFullAcceleration * acceleration;
      s.shape.params["angular_acceleration"] = kFullTurning * acceleration;
      d.trajectory.segments.push_back(std::move(s));
    };
    if (m.interpolation == RMP_MOVE_CIRCLE) {
      segment("arc", {from.pose, goals.front().pose, goals.back().pose}, 1);
    } else if (m.interpolation == RMP_MOVE_PATH) {
      std::vector<Pose> points{from.pose};
      for (const Goal& g : goals)
        if (distance(points.back().p, g.pose.p) > kSame) points.push_back(g.pose);
      if (points.size() > 1) segment("cubic_spline", points, 1);
    } else {
      double all = 0;
      Pose p = from.pose;
      std::vector<double> parts;
      for (const Goal& g : goals) {
        const double way = distance(p.p, g.pose.p) + 1e-3 * angle_between(p, g.pose);
        parts.push_back(way < kSame ? 0 : way);
        all += parts.back();
        p = g.pose;
      }
      p = from.pose;
      for (std::size_t i = 0; i < goals.size(); ++i) {
        if (parts[i] > 0) segment("line", {p, goals[i].pose}, parts[i] / all);
        p = goals[i].pose;
      }
    }
    return {};
  }

  /// Lets the motion begin where the one before may be left. False = it is not possible.
  template <class Plan>
  Result<bool> blend(std::uint64_t number, const ProgramActor::OpenMotion& before, std::size_t who,
                     ProgramActor::OpenMotion& open, Plan&& plan) {
    const TaskExecutor::Actor& robot = x_.actors_[who];
    const double end = TaskExecutor::moved_until(robot);
    const std::vector<double> q_end = TaskExecutor::sample(robot, end).q,
                              q_start = TaskExecutor::sample(robot, before.start).q;
    const Vec3 tip_end = base_T_tip(who, before.tip, q_end).p;
    const double halfway = before.start + (end - before.start) / 2;
    const auto is_near = [&](double t) {
      const std::vector<double> q = TaskExecutor::sample(robot, t).q;
      if (before.c_cp > 0)
        return distance(base_T_tip(who, before.tip, q).p, tip_end) <= before.c_cp;
      double way = 0, left = 0;
      for (std::size_t j = 0; j < q.size(); ++j) {
        way = std::max(way, std::fabs(q_end[j] - q_start[j]));
        left = std::max(left, std::fabs(q_end[j] - q[j]));
      }
      return left <= way * std::min(before.c_ptp, 100.0) / 200;
    };
    const double earliest = std::max(now_, halfway);
    double at = end;
    while (at > earliest && is_near(std::max(earliest, at - x_.step())))
      at = std::max(earliest, at - x_.step());
    if (at > earliest) {
      double low = std::max(earliest, at - x_.step());
      for (int i = 0; i < 40; ++i) {
        const double middle = (low + at) / 2;
        (is_near(middle) ? at : low) = middle;
      }
    }
    double overlap = end - at;
    bool is_slowed = before.c_speed >= 1;
    for (int tries = 0; tries < kTries && overlap > x_.step() / 4; ++tries, overlap /= 2) {
      RMP_TRY_ASSIGN(sim::RobotMotion motion, plan(end - overlap));
      if (motion.times.size() < 2) return false;
      const double lasts = motion.times.back();
      if (lasts < 2 * overlap) {
        overlap = lasts;  // halved next
        continue;
      }
      if (!std::exchange(is_slowed, true)) {
        // C_SPEED: the later it leaves its path, the slower it crosses.
        const double most = slow_crossing(before, who, motion, overlap);
        if (most < overlap) {
          overlap = 2 * most;  // halved next
          continue;
        }
      }
      if (!x_.push_blended(who, end - overlap, std::move(motion), 1)) continue;
      open.start = end - overlap;
      open.end = open.start + lasts;
      a_.open_[number].end = end - overlap;
      return true;
    }
    return false;
  }

  /// Velocity of a tool of a robot that moves so [m/s].
  Vec3 tip_velocity(std::size_t who, const TaskExecutor::Grip& tip,
                    const TaskExecutor::Actor& moved, double t) const {
    constexpr double h = 1e-4;  // [s]
    const double from = std::max(0.0, t - h), to = t + h;
    const Vec3 a = base_T_tip(who, tip, TaskExecutor::sample(moved, from).q).p,
               b = base_T_tip(who, tip, TaskExecutor::sample(moved, to).q).p;
    Vec3 out{};
    for (std::size_t k = 0; k < 3; ++k) out[k] = (b[k] - a[k]) / (to - from);
    return out;
  }
  /// The longest time that `next` may begin before the end of `before`, at most `overlap`, so that
  /// the tool crosses with no more than C_SPEED % of the speed [s].
  double slow_crossing(const ProgramActor::OpenMotion& before, std::size_t who,
                       const sim::RobotMotion& next, double overlap) {
    constexpr std::size_t kCount = 200;
    const TaskExecutor::Actor& robot = x_.actors_[who];
    TaskExecutor::Actor after = robot;
    after.moves = {{0, next}};
    after.start.assign(next.q.begin(),
                       next.q.begin() + static_cast<std::ptrdiff_t>(robot.start.size()));
    const double end = TaskExecutor::moved_until(robot);
    double speed = before.speed;
    if (!(speed > 0))  // of its TIME: the greatest that it has
      for (std::size_t k = 0; k <= kCount; ++k) {
        const Vec3 v = tip_velocity(who, before.tip, robot,
                                    before.start + (end - before.start) * static_cast<double>(k) /
                                                       static_cast<double>(kCount));
        speed = std::max(speed, std::hypot(v[0], v[1], v[2]));
      }
    std::vector<Vec3> leaving, coming;
    const double step = overlap / static_cast<double>(kCount);
    for (std::size_t k = 0; k <= kCount; ++k) {
      const double u = step * static_cast<double>(k);
      leaving.push_back(tip_velocity(who, before.tip, robot, end - overlap + u));
      coming.push_back(tip_velocity(who, before.tip, after, u));
    }
    const double wanted = before.c_speed * speed;
    const auto least = [&](std::size_t count) {
      double out = HUGE_VAL;
      for (std::size_t k = 0; k <= count; ++k) {
        const Vec3 &a = leaving[kCount - count + k], &b = coming[k];
        out = std::min(out, std::hypot(a[0] + b[0], a[1] + b[1], a[2] + b[2]));
      }
      return out;
    };
    std::size_t count = kCount;
    while (count > 0 && least(count) > wanted) --count;
    return step * static_cast<double>(count);
  }

  Result<sim::RobotMotion> move_along(const Along& one, double duration, double start) {
    TaskExecutor::Drive d;
    d.from = TaskExecutor::sample(x_.actors_[one.actor], start).q;
    double way = 0;
    for (std::size_t j = 0; j < d.from.size(); ++j)
      way = std::max(way, std::fabs(one.to[j] - d.from[j]));
    if (way < kSameJoints) return sim::RobotMotion{};
    model::TrajectorySegment s;
    s.shape.name = "ptp";
    s.shape.params["profile"] = std::string("trapezoidal");
    if (duration > 0) s.shape.params["duration"] = duration;
    s.joints = {one.to};
    d.trajectory.segments.push_back(std::move(s));
    return x_.driven(one.actor, d, {}, start, progress_);
  }
  /// What additional joints do: grips at the motion's end, and joints that go along.
  Result<void> additional(const program::Motion& m, Beginning& b) {
    const double start = b.start;
    std::vector<Along>& along = b.along;
    std::vector<double>& values = b.additional;
    values = a_.additional_;
    const std::size_t rail = rail_of(b.use->actor);
    if (rail > 0) {
      const auto now = TaskExecutor::sample(x_.actors_[b.use->actor], start).q;
      b.rail_to.assign(now.begin(), now.begin() + static_cast<std::ptrdiff_t>(rail));
    }
    for (const Target& t : m.targets) {
      if (t.role != RMP_ROLE_ADD_JOINT && t.role != RMP_ROLE_JOINT && t.role != RMP_ROLE_ROBTARGET)
        continue;
      for (std::size_t k = 0; k < t.additional.size(); ++k) {
        if (values.size() <= k) values.resize(k + 1);
        const double was = values[k],
                     value = m.is_incremental ? was + t.additional[k] : t.additional[k];
        const auto use = n_.joints.find(k + 1);
        if (use == n_.joints.end()) {
          if (value != was)
            return error(ErrorCode::invalid_argument,
                         "additional joint " + std::to_string(k + 1) + " is bound to nothing",
                         "program.bind{kind = \"joint\", name = \"" + std::to_string(k + 1) +
                             "\", to = ...} gives it a joint of the world.");
          continue;
        }
        values[k] = value;
        if (use->second.is_grip) {
          if ((was > 0.5) != (value > 0.5)) b.grips.emplace_back(use->second.at, value > 0.5);
          continue;
        }
        const TaskExecutor::Actor& other = x_.actors_[use->second.at];
        const bool is_own = use->second.at == b.use->actor;
        auto one = std::find_if(along.begin(), along.end(),
                                [&](const Along& a) { return a.actor == use->second.at; });
        if (!is_own && one == along.end()) {
          if (TaskExecutor::moved_until(other) > start + kSame)
            return error(ErrorCode::conflict,
                         "robot " + quote(other.placed->name) + " is moved already",
                         "Let one wait for a signal of the other.");
          one =
              along.insert(along.end(), {use->second.at, TaskExecutor::sample(other, start).q, {}});
        }
        const double q =
            value * (TaskExecutor::is_rotary(other, use->second.joint) ? kDegree : kMillimetre);
        const JointModel& joint = other.model->joints[use->second.joint];
        if (q < joint.lower - kSame || q > joint.upper + kSame)
          return error(
              ErrorCode::unreachable,
              "additional joint " + std::to_string(k + 1) + " cannot go to " +
                  text::print_rounded(value),
              "It is joint " + quote(joint.name) + " of " + quote(other.placed->name) + ".");
        (is_own ? b.rail_to : one->to)[use->second.joint] = q;
      }
    }
    return {};
  }

  // ---- motions whose path is in what additional axes move ----
  /// What moves as `s` in a frame that moves as `frame`.
  static PathSample carried(const PathSample& frame, const PathSample& s) {
    using namespace spatial;
    const Vec3 r = rotate(frame.pose, s.pose.p), v = rotate(frame.pose, s.velocity),
               turns = rotate(frame.pose, s.angular_velocity);
    const Vec3 &w = frame.angular_velocity, &wd = frame.angular_acceleration;
    PathSample out;
    out.pose = compose(frame.pose, s.pose);
    out.velocity = add(frame.velocity, add(cross(w, r), v));
    out.angular_velocity = add(w, turns);
    out.acceleration = add(frame.acceleration,
                           add(add(cross(wd, r), cross(w, cross(w, r))),
                               add(scale(cross(w, v), 2), rotate(frame.pose, s.acceleration))));
    out.angular_acceleration =
        add(wd, add(rotate(frame.pose, s.angular_acceleration), cross(w, turns)));
    return out;
  }
  /// A joint's frame, and what stands in it, of a robot whose joints go from one vector to another
  /// by `share`, with its derivatives by the time.
  static PathSample moving(const RobotModel& model, std::int32_t joint, const Pose& joint_T_at,
                           std::span<const double> from, std::span<const double> to,
                           const spatial::Jet& share) {
    std::vector<std::size_t> chain;
    for (std::int32_t j = joint; j >= 0; j = model.joints[static_cast<std::size_t>(j)].parent)
      chain.push_back(static_cast<std::size_t>(j));
    PathSample out, still;
    for (std::size_t i = chain.size(); i-- > 0;) {
      const JointModel& one = model.joints[chain[i]];
      const double way = to[chain[i]] - from[chain[i]], q = from[chain[i]] + share.v * way;
      still.pose = one.placement;
      out = carried(out, still);
      PathSample by;
      if (one.type == JointType::prismatic) {
        by.pose.p = {0, 0, q};
        by.velocity = {0, 0, share.d * way}, by.acceleration = {0, 0, share.dd * way};
      } else {
        by.pose.R = spatial::from_quaternion({std::cos(q / 2), 0, 0, std::sin(q / 2)});
        by.angular_velocity = {0, 0, share.d * way};
        by.angular_acceleration = {0, 0, share.dd * way};
      }
      out = carried(out, by);
    }
    still.pose = joint_T_at;
    return carried(out, still);
  }
  /// How long axes need from one vector to another by spatial::ease, within their limits [s].
  static double least_time(const RobotModel& model, std::span<const double> from,
                           std::span<const double> to) {
    double out = 0;
    for (std::size_t j = 0; j < to.size(); ++j) {
      const JointModel& joint = model.joints[j];
      const double way = std::fabs(to[j] - from[j]);
      const double v = std::isfinite(joint.max_velocity) ? joint.max_velocity : 1;
      const double a = std::isfinite(joint.max_acceleration) ? joint.max_acceleration : 4 * v;
      out = std::max({out, 1.875 * way / v, std::sqrt(10 / std::sqrt(3.0) * way / a)});
    }
    return out;
  }
  /// Begins a path of a tool together with its additional axes; how long it takes [s].
  Result<double> begin_tied(const Beginning& b, const std::vector<double>& q0,
                            const TaskExecutor::Drive& d, double start, double time) {
    const std::size_t who = b.use->actor, rail = b.rail_to.size();
    const TaskExecutor::Actor& robot = x_.actors_[who];
    std::shared_ptr<const motion::Path> path;
    if (!d.trajectory.segments.empty()) {
      RMP_TRY_ASSIGN(path, motion::Path::build(x_.sim_->registry, "motion", d.trajectory, {}));
    }
    std::optional<motion::Weaving> weaving;
    if (path && d.weave) {
      RMP_TRY_ASSIGN(weaving, motion::Weaving::over(path, *d.weave));
    }
    double total = std::max({path ? path->duration() : 0.0, time,
                             least_time(*robot.model, std::span(q0).first(rail), b.rail_to)});
    for (const Along& one : b.along) {
      const TaskExecutor::Actor& other = x_.actors_[one.actor];
      total =
          std::max(total, least_time(*other.model, TaskExecutor::sample(other, start).q, one.to));
    }
    if (!(total > kSame)) return 0.0;
    // The path takes as long as the slowest axis.
    const double rate = path ? path->duration() / total : 1;
    RMP_TRY_ASSIGN(const std::vector<double> times, x_.sample_times(start, total, d));
    std::vector<PathSample> samples(times.size());
    if (path) {
      std::vector<double> own = times;
      for (double& t : own) t *= rate;
      RMP_TRY(path->sample(own, samples));
      if (weaving) RMP_TRY(weaving->move(own, samples));
      for (PathSample& s : samples) {
        s.velocity = spatial::scale(s.velocity, rate);
        s.angular_velocity = spatial::scale(s.angular_velocity, rate);
        s.acceleration = spatial::scale(s.acceleration, rate * rate);
        s.angular_acceleration = spatial::scale(s.angular_acceleration, rate * rate);
      }
    } else {
      const Pose stays =
          spatial::compose(spatial::inverse(b.reference_from), base_T_tip(who, b.tip, q0));
      for (PathSample& s : samples) s.pose = stays;
    }
    const auto share = [&](double t) {
      spatial::Jet s = spatial::ease(std::clamp(t / total, 0.0, 1.0));
      s.d /= total, s.dd /= total * total;
      return s;
    };
    const auto last_of_rail = static_cast<std::int32_t>(rail) - 1;
    std::vector<double> rail_from(q0.begin(), q0.begin() + static_cast<std::ptrdiff_t>(rail));
    const bool is_in_carriage = !b.device && b.reference_is_carriage;
    std::vector<Pose> targets;
    for (std::size_t i = 0; i < times.size(); ++i) {
      PathSample& s = samples[i];
      if (is_in_carriage) {
        targets.push_back(s.pose);
        continue;
      }
      if (b.device) {
        const TaskExecutor::Actor& device = x_.actors_[*b.device];
        PathSample base;
        base.pose = spatial::compose(spatial::inverse(robot.world_T_base), device.world_T_base);
        s = carried(
            carried(base, moving(*device.model, b.device_tip.joint, b.device_tip.joint_T_grip,
                                 b.device_from, b.device_to, share(times[i]))),
            s);
      }
      if (rail > 0)
        s = sim::seen_from(
            moving(*robot.model, last_of_rail, Pose{}, rail_from, b.rail_to, share(times[i])), s);
      targets.push_back(s.pose);
    }
    Result<void> failed;
    const auto solves = solver(who, b.tip, failed);
    if (!solves) return std::move(failed).error();
    IkBatch batch;
    const std::vector<double> seed(q0.begin() + static_cast<std::ptrdiff_t>(rail), q0.end());
    batch.targets = targets;
    batch.seeds = seed;
    batch.continuous = true;
    RMP_TRY_ASSIGN(const auto results, sim::solve_ik(solves->ik, batch, progress_));
    const std::size_t n = seed.size();
    std::vector<double> q, qd(times.size() * n), qdd(times.size() * n);
    for (std::size_t i = 0; i < results.size(); ++i) {
      const IkResult& r = results[i];
      if (r.status != IkStatus::solved) {
        trouble_ = {};
        trouble_.joint =
            r.limiting_joint < 0 ? -1 : r.limiting_joint + static_cast<std::int32_t>(rail);
        trouble_.excess = std::max(r.shortfall, r.position_error);
        return error(ErrorCode::unreachable,
                     "robot " + quote(robot.placed->name) +
                         " cannot follow at t = " + text::print_rounded(times[i]) +
                         " s of the motion, while additional axes " +
                         "move: " + (r.detail.empty() ? "there is no solution" : r.detail),
                     "Move the target or the robot, or let the axes go elsewhere.");
      }
      q.insert(q.end(), r.q.begin(), r.q.begin() + static_cast<std::ptrdiff_t>(n));
    }
    sim::joint_rates(*arm_of(who, b.tip), times, q, samples, qd, qdd);
    const auto all = [&](std::size_t actor, std::span<const double> from,
                         std::span<const double> to, bool has_arm) {
      sim::RobotMotion m;
      m.times = times;
      for (std::size_t i = 0; i < times.size(); ++i) {
        const spatial::Jet s = share(times[i]);
        for (std::size_t j = 0; j < to.size(); ++j) {
          m.q.push_back(from[j] + s.v * (to[j] - from[j]));
          m.qd.push_back(s.d * (to[j] - from[j]));
          m.qdd.push_back(s.dd * (to[j] - from[j]));
        }
        for (std::size_t j = 0; has_arm && j < n; ++j) {
          m.q.push_back(q[i * n + j]);
          m.qd.push_back(qd[i * n + j]);
          m.qdd.push_back(qdd[i * n + j]);
        }
      }
      x_.push(actor, start, std::move(m));
    };
    for (const Along& one : b.along) {
      const auto from = TaskExecutor::sample(x_.actors_[one.actor], start).q;
      all(one.actor, from, one.to, false);
    }
    all(who, rail_from, b.rail_to, true);
    return total;
  }

  // ---- checks ----
  /// Begins a motion and tells of it. One that fails is no end: the robot is put to its end where
  /// that is reached.
  Result<void> inspect(const program::Motion& asked) {
    ProgramInspection& told = *a_.inspection_;
    program::Motion m = asked;
    InspectedMotion out;
    out.place = a_.place(m.process, m.span, now_);
    out.number = m.number;
    out.interpolation = m.interpolation;
    out.is_incremental = m.is_incremental;
    out.has_until = m.has_until;
    const bool is_ptp = m.interpolation == RMP_MOVE_PTP;
    out.speed = is_ptp ? m.attributes.speed_ptp : m.attributes.speed;
    if (!is_ptp && !(m.attributes.time > 0)) {
      const auto slow = [](double& is, double most) {
        if (!(most > 0) || is <= most) return false;
        is = most;
        return true;
      };
      const bool a = slow(m.attributes.speed, told.most_speed);
      const bool b = slow(m.attributes.speed_orientation, told.most_speed_orientation);
      if (a || b) ++told.motions_slowed;
    }
    if (!m.targets.empty() && m.targets.back().role == RMP_ROLE_ROBTARGET)
      out.asked_status = m.targets.back().status;
    trouble_ = {};
    auto b = beginning(m);
    if (!b.ok()) {
      out.start = out.end = now_;
      fails_at(out, std::move(b).error());
      a_.open_[m.number] = ended_at(0, now_);
      keep(std::move(out));
      return {};
    }
    const std::size_t who = b->use->actor;
    TaskExecutor::Actor& robot = x_.actors_[who];
    out.robot = who;
    out.tip_joint = b->tip.joint;
    out.joint_T_tip = b->tip.joint_T_grip;
    out.base_T_frame = b->frame;
    out.start = out.end = b->start;
    Goal from;
    from.q = TaskExecutor::sample(robot, b->start).q;
    const auto wanted = told.wanted.find(who);
    out.is_displaced = wanted != told.wanted.end();
    from.pose = out.is_displaced ? wanted->second : base_T_tip(who, b->tip, from.q);
    // Where it is to end, whether it comes there or not.
    const auto goals = goals_of(m, *b, from, false);
    if (goals.ok() && !goals->empty()) out.base_T_target = goals->back().pose;
    const MotionTrouble of_goal = trouble_;
    trouble_ = {};
    if (!out.is_displaced) {
      auto done = begin(m, *b);
      if (done.ok()) {
        out.is_carried_out = true;
        const ProgramActor::OpenMotion& open = a_.open_[m.number];
        out.start = open.start, out.end = open.end;
        out.q_target = TaskExecutor::sample(robot, TaskExecutor::moved_until(robot)).q;
        // What runs into it is over where it begins.
        for (std::size_t k = told.motions.size(); k-- > 0;)
          if (told.motions[k].robot == who) {
            if (told.motions[k].end > out.start + kSame) told.motions[k].end = out.start;
            break;
          }
        keep(std::move(out));
        return {};
      }
      if (done.error().code == ErrorCode::cancelled) return done;
      out.trouble = trouble_;
      if (out.trouble.joint < 0 && !out.trouble.world_T_target) out.trouble = of_goal;
      if (!out.trouble.world_T_target && out.base_T_target)
        out.trouble.world_T_target = spatial::compose(robot.world_T_base, *out.base_T_target);
      if (!is_ptp && done.error().code == ErrorCode::unreachable)
        RMP_TRY(look_along(m, *b, from, out));
      fails_at(out, std::move(done).error());
    }
    // It is put to its end.
    const double now = std::max(b->start, TaskExecutor::moved_until(robot));
    double end = now;
    trouble_ = {};
    const auto ends = goals_of(m, *b, from, true);
    if (ends.ok() && !ends->empty()) {
      sim::RobotMotion jump;
      jump.times = {0, x_.step()};
      jump.q = TaskExecutor::sample(robot, now).q;
      const std::size_t n = jump.q.size();
      jump.q.insert(jump.q.end(), ends->back().q.begin(), ends->back().q.end());
      jump.qd.assign(2 * n, 0.0), jump.qdd.assign(2 * n, 0.0);
      x_.push(who, now, std::move(jump));
      end = now + x_.step();
      out.is_jump = true;
      out.q_target = ends->back().q;
      told.wanted.erase(who);
    } else {
      if (out.error.empty()) {  // it was displaced, and is no nearer now
        out.trouble = trouble_;
        if (ends.ok()) fails_at(out, error(ErrorCode::conflict, "the motion has no target"));
        else if (ends.error().code == ErrorCode::cancelled) return ends.error();
        else fails_at(out, ends.error());
      }
      if (out.base_T_target) told.wanted[who] = *out.base_T_target;
    }
    out.start = now, out.end = end;
    ProgramActor::OpenMotion open = ended_at(who, end);
    open.tip = b->tip;
    open.grips = b->grips;  // of its additional joints, which still take place
    a_.additional_ = b->additional;
    a_.open_[m.number] = std::move(open);
    keep(std::move(out));
    return {};
  }
  /// Where along a path the robot cannot follow, and by how much.
  Result<void> look_along(const program::Motion& m, const Beginning& b, const Goal& from,
                          InspectedMotion& out) {
    constexpr std::size_t kMostSamples = 400;
    const std::size_t who = b.use->actor;
    TaskExecutor::Drive d;
    d.from = from.q;
    if (b.is_tied() || !drive(m, b, from, d).ok()) return {};
    auto path = motion::Path::build(x_.sim_->registry, "motion", d.trajectory, {});
    Result<void> failed;
    const auto s = solver(who, b.tip, failed);
    if (!path.ok() || !s) return {};
    const double lasts = (*path)->sample_times(1e9).back();
    const std::vector<double> times =
        (*path)->sample_times(std::max(x_.step(), lasts / kMostSamples));
    std::vector<PathSample> samples(times.size());
    if (!(*path)->sample(times, samples).ok()) return {};
    if (d.weave) {
      const auto weaving = motion::Weaving::over(*path, *d.weave);
      if (!weaving.ok() || !weaving->move(times, samples).ok()) return {};
    }
    std::vector<Pose> targets;
    for (const PathSample& one : samples)
      targets.push_back(sim::in_base(one, d.base_T_trajectory).pose);
    IkBatch batch;
    batch.targets = targets;
    batch.seeds = from.q;
    batch.continuous = true;
    auto results = sim::solve_ik(s->ik, batch, progress_);
    if (!results.ok()) {
      if (results.error().code == ErrorCode::cancelled) return std::move(results).error();
      return {};
    }
    for (std::size_t i = 0; i < results->size(); ++i) {
      const IkResult& r = (*results)[i];
      const bool is_reached = r.status == IkStatus::solved;
      out.way.push_back(spatial::compose(x_.actors_[who].world_T_base, targets[i]));
      out.is_reached.push_back(is_reached);
      const double excess = std::max(r.shortfall, r.position_error);
      if (is_reached || (out.trouble.excess > 0 && excess <= out.trouble.excess)) continue;
      out.trouble.joint = r.limiting_joint;
      out.trouble.excess = excess;
      out.trouble.world_T_target = out.way.back();
    }
    return {};
  }
  static ProgramActor::OpenMotion ended_at(std::size_t who, double end) {
    ProgramActor::OpenMotion open;
    open.actor = who, open.start = open.end = end;
    return open;
  }
  void fails_at(InspectedMotion& out, const Error& e) const {
    out.is_carried_out = false;
    out.error = e.message, out.hint = e.hint;
    out.is_unreachable = e.code == ErrorCode::unreachable;
  }
  void keep(InspectedMotion out) {
    ProgramInspection& told = *a_.inspection_;
    if (told.motions.size() < told.most_motions) told.motions.push_back(std::move(out));
    else ++told.motions_left_out;
  }

  ProgramActor& a_;
  const ProgramActor::Names& n_;
  TaskExecutor& x_;
  double now_;
  Progress& progress_;
  MotionTrouble trouble_;  ///< of the last error of a motion, for checks
};

Result<void> ProgramActor::advance(TaskExecutor& executor, double now, Progress& progress) {
  ProgramCell cell(*this, executor, now, progress);
  const auto resume = [&] {
    for (const std::uint32_t process : std::exchange(paused_, {})) machine_.resume_pause(process);
  };
  if (std::exchange(is_shown_, false)) resume();
  wants_line_ = false;
  for (int slices = 0;;) {
    const program::Status& s = machine_.run(now, cell);
    note_line(now);
    if (s.state == program::RunState::fault) {
      const program::Fault& f = *s.fault;
      return error(code_, f.message, f.hint,
                   "program " + quote(name()) + ", " + f.file + ":" + std::to_string(f.span.line) +
                       ":" + std::to_string(f.span.column));
    }
    if (s.state == program::RunState::stopped) {
      auto given = presets_.give(machine_);
      if (!given.ok()) return std::move(given).error().in("program " + quote(name()));
      if (*given) continue;
    }
    if (s.state == program::RunState::busy) {
      if (progress.cancelled()) return error(ErrorCode::cancelled, "the run was cancelled");
      if (pause_wish_ && pause_wish_->load()) {
        machine_.pause();
        continue;
      }
      if (++slices < kMostSlices) continue;
      return error(
          ErrorCode::conflict, "it computes without end at t = " + text::print_rounded(now) + " s",
          "Put a motion or a WAIT into the loop.", "program " + quote(name()) + ", " + where());
    }
    if (paused_.empty() || s.state != program::RunState::waiting) break;
    if (is_attended_) {
      is_shown_ = true;
      break;
    }
    resume();
  }
  if (!is_stopped()) RMP_TRY(cell.settle());
  if (is_over() && !text_.empty()) {
    executor.note(now, name() + ": " + text_);
    text_.clear();
  }
  if (is_over() && machine_.status().is_halted && !std::exchange(has_told_halt_, true))
    executor.note(now, name() + " is at HALT, " + place_text(machine_.status().halted_at));
  return {};
}

bool ProgramActor::is_over() const {
  return machine_.status().state == program::RunState::over ||
         (inspection_ && inspection_->is_dead);
}
bool ProgramActor::is_stopped() const {
  return machine_.status().state == program::RunState::stopped;
}

std::optional<double> ProgramActor::next_time(double now, double cycle) const {
  const program::Status& s = machine_.status();
  std::optional<double> next;
  const auto at = [&](double t) { next = next ? std::min(*next, t) : t; };
  // A machine that was stopped, or is new, goes on at once.
  if (s.state == program::RunState::busy || s.state == program::RunState::stopped || is_asking())
    return now;
  if (is_over()) {
    // A program that ends while its last motion runs is over when that is.
    for (const auto& [number, open] : open_)
      if (open.end > now + kSame) at(open.end);
    return next;
  }
  for (const program::Wait& w : s.waits) {
    if (w.until) at(std::max(now, *w.until));
    for (const std::uint64_t number : w.motions)
      if (const auto it = open_.find(number); it != open_.end() && !held_.contains(number))
        at(std::max(now, it->second.end));
    if (w.each_cycle) at(cycle);
  }
  if (s.watches_each_cycle) at(cycle);
  return next;
}

bool ProgramActor::waits_for_signals() const {
  const program::Status& s = machine_.status();
  if (!s.watched.empty()) return true;
  return std::any_of(s.waits.begin(), s.waits.end(),
                     [](const program::Wait& w) { return !w.signals.empty(); });
}

ProgramActor::Stuck ProgramActor::stuck() const {
  Stuck out;
  const rmp_code& c = machine_.code();
  for (const program::Wait& w : machine_.status().waits) {
    std::string what, hint;
    switch (w.kind) {
      case program::WaitKind::condition: {
        for (const std::uint32_t s : w.signals)
          what += (what.empty() ? "" : ", ") +
                  std::string(static_cast<const rmp_code_symbol*>(rmp_row(&c.symbols, s))->name);
        hint = what.empty() ? "Let another process change what the condition looks at, or give "
                              "the wait a TIMEOUT."
                            : "Let a task set these signals before.";
        what = what.empty() ? " waits for variables" : " waits for " + what;
        break;
      }
      case program::WaitKind::semaphore: {
        const std::string name = machine_.semaphore_of(w.process);
        what = " waits for " + (name.empty() ? "a semaphore" : "the semaphore " + name);
        hint = "Let another process RELEASE it.";
        break;
      }
      case program::WaitKind::stopped:
        what = " is held by STOP";
        hint = "Let another process CONTINUE it.";
        break;
      default: continue;
    }
    std::string who = "program " + text::quote(name());
    if (w.process != 0) who += ", process " + machine_.process_name(w.process);
    if (w.kind != program::WaitKind::stopped) who += ", " + place_text(w.span);
    out.waits.push_back(who + what);
    if (std::find(out.hints.begin(), out.hints.end(), hint) == out.hints.end())
      out.hints.push_back(hint);
  }
  if (out.waits.empty()) {
    out.waits.push_back("program " + text::quote(name()) + ", " + where() + " waits");
    out.hints.emplace_back("Let another process or task go on.");
  }
  return out;
}

std::string ProgramActor::where() const {
  const auto calls = machine_.call_stack(0);
  return calls.empty() ? "its end" : place_text(calls.front().span);
}

std::string ProgramActor::place_text(const rmp_span& s) const {
  const rmp_code& c = machine_.code();
  std::string file;
  if (s.file < c.files.count)
    file = static_cast<const rmp_code_file*>(rmp_row(&c.files, s.file))->name;
  return file + ":" + std::to_string(s.line) + ":" + std::to_string(s.column);
}

void ProgramActor::note_line(double t) {
  const program::Status& s = machine_.status();
  std::uint32_t line = s.halted_at.line;
  if (!s.is_halted) {
    const auto at = s.state == program::RunState::over ? std::nullopt : machine_.place_of(0);
    if (!at) return;
    line = at->span.line;
  }
  if (!lines_.empty() && lines_.back().second == line) return;
  if (!lines_.empty() && lines_.back().first == t) lines_.back().second = line;
  else lines_.emplace_back(t, line);
}

double ProgramActor::line_at(double t) const {
  const auto after = std::upper_bound(lines_.begin(), lines_.end(), t,
                                      [](double x, const auto& l) { return x < l.first; });
  return after == lines_.begin() ? 0 : std::prev(after)->second;
}

}  // namespace robomosp::task
