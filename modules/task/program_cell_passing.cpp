// SPDX-License-Identifier: Apache-2.0
// PTP under TIME with C_PASS: targets that are passed without a stop.
#include <algorithm>
#include <cmath>
#include <set>

#include "task/program_cell.h"

namespace robomosp::task {

sim::RobotMotion ProgramCell::cubics(std::span<const double> from,
                                     std::span<const double> from_rate, std::span<const double> to,
                                     std::span<const double> to_rate, double duration) {
  sim::RobotMotion m;
  m.times = {0, duration};
  for (const double t : m.times)
    for (std::size_t j = 0; j < from.size(); ++j) {
      const spatial::Jet s = spatial::cubic(to[j] - from[j], from_rate[j], to_rate[j], duration, t);
      m.q.push_back(t > 0 ? to[j] : from[j]);
      m.qd.push_back(t > 0 ? to_rate[j] : from_rate[j]);
      m.qdd.push_back(s.dd);
    }
  return m;
}

bool ProgramCell::can_pass(const ProgramActor::OpenMotion& open) const {
  const auto& moves = x_.actors_[open.actor].moves;
  return open.passing && open.passing->end == ProgramActor::Passing::End::open &&
         now_ < open.end - kSame && !moves.empty() &&
         std::fabs(moves.back().start - open.start) < kSame;
}

Result<std::vector<double>> ProgramCell::pass(ProgramActor::OpenMotion& open,
                                              const std::vector<double>& next, double next_time) {
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

Result<void> ProgramCell::stops(ProgramActor::OpenMotion& open) {
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

Result<void> ProgramCell::keeps_limits(const ProgramActor::OpenMotion& open,
                                       std::span<const double> from,
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
    return "at " + text::print_rounded(w.value / unit, 4) + word + ", but its maximum is " +
           text::print_rounded(w.limit / unit, 4);
  };
  const auto name = [&](const Worst& w) {
    return robot.maker->before_joint(w.joint) + "joint " +
           std::to_string(w.joint - std::min(w.joint, rail_of(open.actor)) + 1) + " of " +
           quote(robot.placed->name);
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
            (is_speed ? " would move " : " would be accelerated ") +
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
                             ": so it passes targets in their TIMEs (C_PASS, " + place_of(p.span) +
                             ")";
    x_.note(now_, n_.name + ": " + said);
    if (a_.inspection_) tell(InspectedEvent::Kind::ignored, said, "Give longer TIMEs.");
  }
  return {};
}

std::string ProgramCell::place_of(const rmp_span& s) const {
  return "line " + std::to_string(s.line);
}

}  // namespace robomosp::task
