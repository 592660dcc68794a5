// SPDX-License-Identifier: Apache-2.0
// Motions of programs that are checked: looked at, and carried out as far as they can be.
#include <algorithm>
#include <cmath>
#include <set>

#include "task/program_cell.h"

namespace robomosp::task {

Result<void> ProgramCell::inspect(const program::Motion& asked) {
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
  if (!m.targets.empty()) out.additional = m.targets.back().additional;
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

Result<void> ProgramCell::look_along(const program::Motion& m, const Beginning& b, const Goal& from,
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

ProgramActor::OpenMotion ProgramCell::ended_at(std::size_t who, double end) {
  ProgramActor::OpenMotion open;
  open.actor = who, open.start = open.end = end;
  return open;
}

void ProgramCell::fails_at(InspectedMotion& out, const Error& e) const {
  out.is_carried_out = false;
  out.error = e.message, out.hint = e.hint;
  out.is_unreachable = e.code == ErrorCode::unreachable;
}

void ProgramCell::keep(InspectedMotion out) {
  ProgramInspection& told = *a_.inspection_;
  if (told.motions.size() < told.most_motions) told.motions.push_back(std::move(out));
  else ++told.motions_left_out;
}

}  // namespace robomosp::task
