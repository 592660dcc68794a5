// SPDX-License-Identifier: Apache-2.0
// Signals, files, texts and the kinematics of a program's robots.
#include <algorithm>
#include <cmath>
#include <set>

#include "robotics/rail.h"
#include "task/program_cell.h"

namespace robomosp::task {

Result<std::optional<SignalValue>> ProgramCell::read_signal(const program::Signal& s) {
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

Result<void> ProgramCell::write_signal(const program::Signal& s, SignalValue v) {
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
    else x_.note(now_, n_.name + " does not start " + task + ", which is still running");
    return {};
  }
  const TaskExecutor::Wire& w = x_.wires_[use->second.at];
  const double value = s.type == RMP_TYPE_REAL ? v.real : static_cast<double>(v.integer);
  if (w.signal->kind == model::SignalKind::digital && value != 0 && value != 1) {
    if (a_.inspection_) {
      tell(InspectedEvent::Kind::output,
           "the digital signal " + quote(w.signal->name) + " cannot be " +
               text::print_rounded(value),
           "It must be 0 or 1. Make it analogue, or bind another one.", {std::string(s.name)});
      return {};
    }
    return fails(
        ErrorCode::invalid_argument,
        "the digital signal " + quote(w.signal->name) + " cannot be " + text::print_rounded(value),
        "It must be 0 or 1. Make it analogue, or bind another one.");
  }
  x_.set_wire(use->second.at, value, now_);
  return {};
}

Result<void> ProgramCell::begin_motion(const program::Motion& m) {
  return checked(a_.inspection_ ? inspect(m) : begin(m));
}

Result<program::MotionState> ProgramCell::motion_state(std::uint64_t number) {
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

Result<void> ProgramCell::abort_motion(std::uint64_t number, program::AbortReason) {
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

Result<void> ProgramCell::hold_motion(std::uint64_t number) {
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

Result<void> ProgramCell::resume_motion(std::uint64_t number) {
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

Result<void> ProgramCell::settle() {
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

Result<bool> ProgramCell::stands(std::uint64_t number) {
  const auto it = a_.open_.find(number);
  if (it == a_.open_.end()) return true;
  const std::vector<std::size_t> all = moved_by(it->second);
  return std::all_of(all.begin(), all.end(), [&](std::size_t who) {
    return TaskExecutor::moved_until(x_.actors_[who]) <= now_ + kSame;
  });
}

Result<bool> ProgramCell::same_robot(std::uint32_t a, std::uint32_t b) {
  if (a == b) return true;
  RMP_TRY_ASSIGN(const ProgramActor::RobotUse* one, robot_of(a));
  RMP_TRY_ASSIGN(const ProgramActor::RobotUse* other, robot_of(b));
  return one->actor == other->actor;
}

Result<Target> ProgramCell::robot_state(std::uint32_t robot, std::uint32_t) {
  auto state = [&]() -> Result<Target> {
    RMP_TRY_ASSIGN(const ProgramActor::RobotUse* use, robot_of(robot));
    const auto q = TaskExecutor::sample(x_.actors_[use->actor], now_).q;
    return state_at(*use, q);
  }();
  if (!state.ok()) a_.code_ = state.error().code;
  return state;
}

Result<program::PlainPose> ProgramCell::robot_flange(std::uint32_t robot, std::uint32_t) {
  auto pose = [&]() -> Result<program::PlainPose> {
    RMP_TRY_ASSIGN(const ProgramActor::RobotUse* use, robot_of(robot));
    const auto& actor = x_.actors_[use->actor];
    const auto q = TaskExecutor::sample(actor, now_).q;
    RMP_TRY_ASSIGN(const Pose frame, base_T_frame(*use, nullptr, q));
    const robotics::LinkFrame flange = robotics::flange_frame(*actor.record);
    return to_plain(spatial::compose(
        spatial::inverse(frame), base_T_tip(use->actor, {flange.joint, flange.joint_T_link}, q)));
  }();
  if (!pose.ok()) a_.code_ = pose.error().code;
  return pose;
}

Result<double> ProgramCell::robot_speed(std::uint32_t robot, std::uint32_t) {
  RMP_TRY_ASSIGN(const ProgramActor::RobotUse* use, robot_of(robot));
  RMP_TRY_ASSIGN(const TaskExecutor::Grip tip, own_tip(*use));
  constexpr double h = 1e-4;  // [s]
  const auto& robot_now = x_.actors_[use->actor];
  const auto at = [&](double t) {
    return base_T_tip(use->actor, tip, TaskExecutor::sample(robot_now, std::max(0.0, t)).q).p;
  };
  return distance(at(now_ + h), at(now_ - h)) / (now_ < h ? now_ + h : 2 * h) / kMillimetre;
}

Result<Target> ProgramCell::forward(const Target& given, std::uint32_t) {
  auto made = [&]() -> Result<Target> {
    RMP_TRY_ASSIGN(const ProgramActor::RobotUse* use, robot_of(RMP_NONE));
    RMP_TRY_ASSIGN(auto q, joints_of(use->actor, given.joints));
    auto now = TaskExecutor::sample(x_.actors_[use->actor], now_).q;
    set_rail(use->actor, given, now);
    q.insert(q.begin(), now.begin(),
             now.begin() + static_cast<std::ptrdiff_t>(rail_of(use->actor)));
    RMP_TRY_ASSIGN(Target out, state_at(*use, q));
    out.additional = given.additional;
    return out;
  }();
  if (!made.ok()) a_.code_ = made.error().code;
  return made;
}

Result<Target> ProgramCell::inverse(const Target& given, std::uint32_t) {
  auto made = [&]() -> Result<Target> {
    RMP_TRY_ASSIGN(const ProgramActor::RobotUse* use, robot_of(RMP_NONE));
    RMP_TRY_ASSIGN(const TaskExecutor::Grip tip, own_tip(*use));
    auto seed = TaskExecutor::sample(x_.actors_[use->actor], now_).q;
    set_rail(use->actor, given, seed);
    RMP_TRY_ASSIGN(const Pose frame, base_T_frame(*use, nullptr, seed));
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

Result<void> ProgramCell::write_text(std::uint32_t, std::string_view piece) {
  a_.text_ += piece;
  for (std::size_t end; (end = a_.text_.find('\n')) != std::string::npos;) {
    x_.note(now_, n_.name + ": " + a_.text_.substr(0, end));
    a_.text_.erase(0, end + 1);
  }
  return {};
}

Result<void> ProgramCell::log_text(std::uint32_t, const rmp_span& span, std::string_view text) {
  x_.note(now_, n_.name + ", line " + std::to_string(span.line) + ": " + std::string(text));
  return {};
}

Result<std::optional<std::string>> ProgramCell::read_line(std::uint32_t) {
  const std::vector<std::string>& lines = a_.typed_ ? *a_.typed_ : a_.own_lines_;
  if (a_.lines_read_ < lines.size()) return std::optional(lines[a_.lines_read_++]);
  if (a_.is_attended_) {
    a_.wants_line_ = true;
    return std::optional<std::string>();
  }
  return fails(
      ErrorCode::not_found,
      "READ waits for line " + std::to_string(a_.lines_read_ + 1) + ", and " +
          (lines.empty() ? "no lines were given" : std::to_string(lines.size()) + " were given"),
      "Give lines = {...}, or start a live run, which waits for run.input.");
}

Result<void> ProgramCell::pause(std::uint32_t process, std::string_view message) {
  x_.note(now_, n_.name + " is at PAUSE" + (message.empty() ? "" : ": ") + std::string(message) +
                    (a_.typed_ ? "" : "; no operator is connected, and the program continues"));
  if (a_.inspection_)
    tell(InspectedEvent::Kind::pause, "PAUSE: a check has no operator, and the program continues",
         "");
  a_.paused_.insert(process);
  return {};
}

Result<std::string> ProgramCell::read_file(std::string_view name) {
  if (!a_.files_) return has_no_files("opens", name);
  auto bytes = a_.files_->read(name);
  if (!bytes.ok()) a_.code_ = bytes.error().code;
  return bytes;
}

Result<void> ProgramCell::write_file(std::string_view name, std::string_view bytes, bool adds) {
  if (!a_.files_) return has_no_files("writes", name);
  return checked(a_.files_->write(name, bytes, adds));
}

std::vector<std::size_t> ProgramCell::moved_by(const ProgramActor::OpenMotion& open) const {
  std::vector<std::size_t> out{open.actor};
  for (const std::size_t who : open.along)
    if (const auto& moves = x_.actors_[who].moves;
        !moves.empty() && moves.back().start <= open.along_from)
      out.push_back(who);
  return out;
}

Error ProgramCell::has_no_files(const char* does, std::string_view name) {
  return fails(ErrorCode::unsupported,
               std::string("the program ") + does + " the file " + quote(name) +
                   ", but the run has no folder for files",
               "Give files = a folder.");
}

Error ProgramCell::fails(ErrorCode code, std::string message, std::string hint) {
  a_.code_ = code;
  return error(code, std::move(message), std::move(hint));
}

Result<void> ProgramCell::checked(Result<void> done) {
  if (!done.ok()) a_.code_ = done.error().code;
  return done;
}

SignalValue ProgramCell::value_of(const program::Signal& s, double value) {
  SignalValue v;
  v.real = value;
  v.integer = s.type == RMP_TYPE_BOOL
                  ? value != 0
                  : static_cast<std::int64_t>(std::clamp(std::round(value), -9.0e18, 9.0e18));
  return v;
}

void ProgramCell::note_once(const std::string& said) {
  if (x_.told_.emplace(n_.name, said).second) x_.note(now_, n_.name + ": " + said);
  if (a_.inspection_) tell(InspectedEvent::Kind::ignored, said, "");
}

void ProgramCell::tell(InspectedEvent::Kind kind, std::string message, std::string hint,
                       std::vector<std::string> signals) {
  const std::uint32_t process = a_.machine_.running_process();
  const auto calls = a_.machine_.call_stack(process);
  a_.tell(kind, a_.place(process, calls.empty() ? rmp_span{} : calls.front().span, now_),
          std::move(message), std::move(hint), std::move(signals));
}

Result<const ProgramActor::RobotUse*> ProgramCell::robot_of(std::uint32_t symbol) {
  if (symbol != RMP_NONE)
    if (const auto it = n_.robots.find(symbol); it != n_.robots.end()) return &it->second;
  if (symbol == RMP_NONE && n_.own) return &*n_.own;
  return error(ErrorCode::invalid_argument, "no robot of the world is bound to the program's robot",
               "Bind one with program.bind{kind = \"robot\", to = ...}.");
}

Pose ProgramCell::base_T_tip(std::size_t who, const TaskExecutor::Grip& tip,
                             std::span<const double> q) const {
  const RobotModel& model = *x_.actors_[who].model;
  if (tip.joint < 0) return tip.joint_T_grip;
  std::vector<Pose> frames(model.joints.size());
  robotics::forward_kinematics(model, q, frames);
  return spatial::compose(frames[static_cast<std::size_t>(tip.joint)], tip.joint_T_grip);
}

Result<Pose> ProgramCell::base_T_frame(const ProgramActor::RobotUse& use, const PlainPose* given,
                                       std::span<const double> q) const {
  Pose out{};
  if (!use.frame.empty()) {
    RMP_TRY_ASSIGN(const Pose world_T_frame, x_.frame(use.frame, now_));
    out = spatial::compose(spatial::inverse(x_.actors_[use.actor].world_T_base), world_T_frame);
  }
  if (n_.is_on_carriage) out = spatial::compose(base_T_carriage(use.actor, q), out);
  return given ? spatial::compose(out, to_pose(*given)) : out;
}

Result<std::vector<double>> ProgramCell::joints_of(std::size_t who,
                                                   const std::vector<double>& given, bool is_step) {
  const TaskExecutor::Actor& robot = x_.actors_[who];
  const std::size_t rail = rail_of(who);
  if (given.size() + rail != robot.start.size())
    return error(
        ErrorCode::invalid_argument,
        "the target has " + std::to_string(given.size()) + " joints, robot " +
            quote(robot.placed->name) + " " + std::to_string(robot.start.size()) +
            (rail == 0 ? std::string() : ", of which " + std::to_string(rail) + " are additional"),
        "Give the program the cell of this robot (SYSTEM_SPECIFICATION).");
  std::vector<double> q;
  const ProgramActor::CountedAxes& axes = axes_of(who);
  if (axes.maker && axes.arm.size() == given.size()) {
    const std::vector<double> zeros(robot.start.size(), 0.0);
    auto found = joints_from_axes(axes.arm, given, zeros, nullptr);
    const auto none =
        joints_from_axes(axes.arm, std::vector<double>(given.size(), 0.0), zeros, nullptr);
    if (found && none) {
      if (is_step)
        for (std::size_t j = 0; j < found->size(); ++j) (*found)[j] -= (*none)[j];
      q.assign(found->begin() + static_cast<std::ptrdiff_t>(rail), found->end());
      return q;
    }
  }
  for (std::size_t j = 0; j < given.size(); ++j)
    q.push_back(given[j] * (TaskExecutor::is_rotary(robot, rail + j) ? kDegree : kMillimetre));
  return q;
}

const ProgramActor::CountedAxes& ProgramCell::axes_of(std::size_t who) {
  const auto known = a_.axes_.find(who);
  if (known != a_.axes_.end()) return known->second;
  ProgramActor::CountedAxes& out = a_.axes_[who];
  if (!counts_maker_axes(a_.machine_.code())) return out;
  const TaskExecutor::Actor& robot = x_.actors_[who];
  auto made = robotics::MakerAxes::of(*robot.record);
  if (!made.ok() || !made->known()) {
    note_once("joints and turns of the program are the maker's axes, which robot " +
              robot.placed->name + " does not have: they are taken as its joints");
    return out;
  }
  const auto rail = static_cast<std::int32_t>(rail_of(who));
  for (const PostAxis& a : made->axes()) {
    if (a.joint < rail) continue;
    out.arm.push_back(a);
    out.arm.back().external = false;
  }
  out.maker = std::make_shared<const robotics::MakerAxes>(std::move(*made));
  return out;
}

std::pair<double, double> ProgramCell::turned_by(std::size_t who, std::size_t joint) {
  for (const PostAxis& a : axes_of(who).arm)
    if (a.joint == static_cast<std::int32_t>(joint) && a.coupled.empty()) return {a.sign, a.offset};
  return {1, 0};
}

std::size_t ProgramCell::rail_of(std::size_t who) const {
  const auto it = n_.rails.find(who);
  return it == n_.rails.end() ? 0 : it->second;
}

Pose ProgramCell::base_T_carriage(std::size_t who, std::span<const double> q) const {
  return robotics::base_T_carriage(*x_.actors_[who].model, rail_of(who), q);
}

double ProgramCell::joint_of_additional(std::size_t number, double value) const {
  const ProgramActor::JointUse& use = n_.joints.at(number);
  const double unit =
      TaskExecutor::is_rotary(x_.actors_[use.at], use.joint) ? kDegree : kMillimetre;
  const auto it = n_.counted.find(number);
  return unit * (it == n_.counted.end() ? value : (value - it->second.offset) / it->second.sign);
}

double ProgramCell::additional_of_joint(std::size_t number, double q) const {
  const ProgramActor::JointUse& use = n_.joints.at(number);
  const double value =
      q / (TaskExecutor::is_rotary(x_.actors_[use.at], use.joint) ? kDegree : kMillimetre);
  const auto it = n_.counted.find(number);
  return it == n_.counted.end() ? value : it->second.sign * value + it->second.offset;
}

void ProgramCell::set_rail(std::size_t who, const Target& given, std::span<double> q) const {
  if (n_.has_no_additional) return;
  for (const auto& [number, use] : n_.joints)
    if (!use.is_grip && use.at == who && number <= given.additional.size())
      q[use.joint] = joint_of_additional(number, given.additional[number - 1]);
}

std::int32_t ProgramCell::control_of(const program::Motion& m, std::size_t who) const {
  constexpr std::int32_t kKeep = 1;
  const std::int32_t given = m.attributes.additional_axes;
  const bool is_controllers = counts_maker_axes(a_.machine_.code()) && !n_.is_on_carriage;
  return given == 0 && is_controllers && rail_of(who) > 0 ? kKeep : given;
}

std::shared_ptr<RobotModel> ProgramCell::arm_of(std::size_t who,
                                                const TaskExecutor::Grip& tip) const {
  const auto rail = static_cast<std::int32_t>(rail_of(who));
  auto model = robotics::arm_behind_rail(*x_.actors_[who].model, rail_of(who));
  model->tips = {{"tool", std::max(-1, tip.joint - rail), tip.joint_T_grip}};
  return model;
}

std::shared_ptr<const ProgramActor::Solver> ProgramCell::solver(std::size_t who,
                                                                const TaskExecutor::Grip& tip,
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
              ", and for the remaining joints " + e.message,
          "program.unbind returns them to the arm; bind as additional joints only those of a rail "
          "that carries it.",
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

std::int32_t ProgramCell::status_of(const sim::BranchNames& names, std::span<const double> q) {
  std::uint32_t known = 0;
  return static_cast<std::int32_t>(names.status(q, known));
}

std::vector<std::int32_t> ProgramCell::turns_of(std::size_t who, std::span<const double> q,
                                                std::size_t rail) {
  const TaskExecutor::Actor& robot = x_.actors_[who];
  const double from = turns_from(a_.machine_.code());
  std::vector<std::int32_t> out;
  for (std::size_t j = rail; j < q.size(); ++j) {
    const auto [sign, offset] = turned_by(who, j);
    out.push_back(TaskExecutor::is_rotary(robot, j) ? turn_of(sign * q[j] / kDegree + offset, from)
                                                    : 0);
  }
  return out;
}

Result<TaskExecutor::Grip> ProgramCell::own_tip(const ProgramActor::RobotUse& use) const {
  if (!n_.moves_flange) return x_.tip(use.actor, use.tool);
  const robotics::LinkFrame flange = robotics::flange_frame(*x_.actors_[use.actor].record);
  return TaskExecutor::Grip{flange.joint, flange.joint_T_link};
}

Result<Target> ProgramCell::state_at(const ProgramActor::RobotUse& use,
                                     const std::vector<double>& q) {
  const TaskExecutor::Actor& robot = x_.actors_[use.actor];
  RMP_TRY_ASSIGN(const TaskExecutor::Grip tip, own_tip(use));
  RMP_TRY_ASSIGN(const Pose frame, base_T_frame(use, nullptr, q));
  Target out;
  out.pose = to_plain(spatial::compose(spatial::inverse(frame), base_T_tip(use.actor, tip, q)));
  const std::size_t rail = rail_of(use.actor);
  const auto& arm = axes_of(use.actor).arm;
  for (const PostAxis& a : arm) out.joints.push_back(axis_value(a, q, nullptr).value_or(0));
  for (std::size_t j = rail; arm.empty() && j < q.size(); ++j)
    out.joints.push_back(q[j] / (TaskExecutor::is_rotary(robot, j) ? kDegree : kMillimetre));
  out.additional = additional_now();
  Result<void> failed;
  if (const auto s = solver(use.actor, tip, failed))
    if (!s->branches.empty()) out.status = status_of(s->branches, std::span(q).subspan(rail));
  out.turns = turns_of(use.actor, q, rail);
  return out;
}

std::vector<double> ProgramCell::additional_now() const {
  std::vector<double> out = a_.additional_;
  for (const auto& [number, use] : n_.joints) {
    if (use.is_grip) continue;
    if (out.size() < number) out.resize(number);
    const TaskExecutor::Actor& robot = x_.actors_[use.at];
    out[number - 1] = additional_of_joint(number, TaskExecutor::sample(robot, now_).q[use.joint]);
  }
  return out;
}

double ProgramCell::turned(const JointModel& joint, double q, double seed) {
  double best = q;
  for (int k = -3; k <= 3; ++k) {
    const double other = q + k * kTurn;
    if (other < joint.lower || other > joint.upper) continue;
    if (std::fabs(other - seed) < std::fabs(best - seed) - kSame) best = other;
  }
  return best;
}

std::string ProgramCell::why_not(std::size_t who, const ProgramActor::Solver& solver,
                                 const IkResult& r, const Pose& arm_T_target,
                                 std::span<const double> seed) {
  const TaskExecutor::Actor& robot = x_.actors_[who];
  // Axes count the joints of a rail, too; the solver knows the arm behind it only.
  const std::string reason = rail_of(who) > 0
                                 ? robot.maker->in_text(*robot.model, r.detail)
                                 : sim::ik_reason(x_.sim_->registry, solver.ik, robot.record->ik, r,
                                                  arm_T_target, seed, *robot.maker, progress_);
  return reason.empty() ? "there is no solution" : reason;
}

Result<std::vector<double>> ProgramCell::configuration(std::size_t who,
                                                       const TaskExecutor::Grip& tip,
                                                       const Pose& base_T_target,
                                                       const std::vector<double>& all,
                                                       const Target* target) {
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
                     " from its base: " + why_not(who, *s, r, arm_T_target, seed),
                 "Move the target or the robot.");
  }
  const bool has_status = target && target->status >= 0;
  if (has_status && s->branches.empty())
    note_once("STATUS is ignored: the inverse kinematics of " + robot.placed->name +
              " does not tell configurations apart");
  std::uint32_t known = 0;
  (void)s->branches.status(seed, known);
  const auto mask = static_cast<std::int32_t>(known);
  if (has_status && !s->branches.empty() && (target->status & ~mask) != 0)
    return error(ErrorCode::invalid_argument,
                 "a target has STATUS " + std::to_string(target->status) + ", and robot " +
                     quote(robot.placed->name) + " has no such configuration (" +
                     s->branches.status_words() + ")",
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
      const auto [sign, offset] = turned_by(who, rail + j);
      q[j] = (in_turn(sign * q[j] / kDegree + offset, target->turns[j + turns - n], from,
                      sign * seed[j] / kDegree + offset) -
              offset) /
             sign * kDegree;
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
                 "robot " + quote(robot.placed->name) + " cannot reach " + place(base_T_target.p) +
                     " with these turns of its last joints",
                 "Give TURNS of -128 (any), or a target without turns (a POSE).");
  std::vector<std::string> reach;
  for (const std::int32_t o : others) reach.push_back(std::to_string(o));
  return error(ErrorCode::unreachable,
               "robot " + quote(robot.placed->name) + " does not reach " + place(base_T_target.p) +
                   " with STATUS " + std::to_string(target->status) + " (" +
                   s->branches.status_words() + ")",
               "It reaches the pose with STATUS " + text::enumerate(reach) +
                   ". Use one of these, -1 (any), or a POSE.");
}

Result<void> ProgramCell::grip(std::size_t at, bool takes) {
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
  RMP_TRY_ASSIGN(const TaskExecutor::Gripper from,
                 x_.gripper(use.robot.actor, use.robot.tool, tip, now_, progress_));
  RMP_TRY_ASSIGN(auto near, x_.reached(from, use.reach, now_, progress_));
  std::erase_if(near.objects, [&](const std::string& object) {
    const auto& last = x_.things_[x_.thing_of_.find(object)->second].history.back();
    return last.is_held && last.actor == use.robot.actor;
  });
  const auto& objects = near.objects;
  const bool is_near = use.object.empty()
                           ? !objects.empty()
                           : std::find(objects.begin(), objects.end(), use.object) != objects.end();
  if (!is_near) {
    const std::string& missed = use.object.empty() ? near.nearest : use.object;
    std::string what = "the gripper of " + robot.placed->name + " shuts, and " +
                       (use.object.empty() ? std::string("nothing is") : use.object + " is not") +
                       " within " + text::print_rounded(use.reach * 1000) + " mm of its tool";
    const auto thing = x_.thing_of_.find(missed);
    if (thing != x_.thing_of_.end()) {
      const auto& last = x_.things_[thing->second].history.back();
      if (!last.is_held || last.actor != use.robot.actor) {
        RMP_TRY_ASSIGN(const double away,
                       x_.distance(from, x_.things_[thing->second], now_, progress_));
        what += ": " + x_.missed(robot.placed->name, from, missed, away, use.reach);
      }
    }
    if (a_.inspection_)
      tell(InspectedEvent::Kind::grip, what,
           "Move the target to the object, or give the grip a larger reach (program.bind).");
    x_.note(now_, n_.name + ": " + what);
    return {};
  }
  model::TaskStep step;
  step.kind = model::StepKind::attach;
  step.object = use.object.empty() ? objects.front() : use.object;
  const bool is_member =
      robotics::find_grip(*robot.record, *robot.model, use.robot.tool).has_value();
  step.link = is_member ? use.robot.tool : std::string();
  RMP_TRY(x_.take(step, robot.placed->name, now_));
  taken.push_back(step.object);
  return {};
}

}  // namespace robomosp::task
