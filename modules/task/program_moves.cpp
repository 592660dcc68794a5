// SPDX-License-Identifier: Apache-2.0
// Motions of programs: with shares of the joints' limits, one running into the next, and braked.
#include <algorithm>
#include <cmath>

#include "kernel/text.h"
#include "spatial/pose.h"
#include "task/lead.h"
#include "task/program_cell.h"
#include "task/task_executor.h"

namespace robomosp::task {
namespace {

constexpr double kLeastWay = 1e-9;   ///< a joint that moves less stands [rad or m]
constexpr double kAssumedSpeed = 1;  ///< of joints without a limit [rad/s or m/s]
constexpr double kBrakeRise = 0.25;  ///< of joints without a limit: full speed to rest [s]

/// Times from t on at which a motion of `duration` has samples: its ends, and the rows between.
std::vector<double> sample_times(double t, double duration, double step) {
  std::vector<double> out{0};
  const double lead = lead_of(t, step);
  for (std::size_t k = 1;; ++k) {
    const double at = step * static_cast<double>(k) - lead;
    if (at >= duration - 1e-9 * step) break;
    if (at > 1e-9 * step) out.push_back(at);
  }
  if (duration > 0) out.push_back(duration);
  return out;
}

}  // namespace

std::shared_ptr<const RobotModel> TaskExecutor::slowed(
    const std::shared_ptr<const RobotModel>& model, double velocity_share,
    double acceleration_share) {
  if (velocity_share == 1 && acceleration_share == 1) return model;
  auto out = std::make_shared<RobotModel>(*model);
  for (JointModel& j : out->joints) {
    // What a robot lacks is assumed as sim::robot_motion does, which says so.
    if (!std::isfinite(j.max_velocity)) j.max_velocity = kAssumedSpeed;
    if (!std::isfinite(j.max_acceleration)) j.max_acceleration = j.max_velocity / kBrakeRise;
    if (!std::isfinite(j.max_jerk)) j.max_jerk = j.max_acceleration / kBrakeRise;
    j.max_velocity *= velocity_share;
    j.max_acceleration *= acceleration_share;
    j.max_jerk *= acceleration_share;
  }
  return out;
}

double TaskExecutor::moved_until(const Actor& a) {
  return a.moves.empty() ? 0 : a.moves.back().start + a.moves.back().motion.times.back();
}

Result<double> TaskExecutor::parts_of_row(const Drive& d) const {
  if (!d.weave) return 1.0;
  // Every swing has its samples, however far the rows are apart.
  constexpr double kSamples = 24;                         // of a swing to both sides
  constexpr double kLeast = 1.0e-4;                       // between them [s]
  const double swings = d.weave_speed / d.weave->length;  // a second
  const double parts = std::max(1.0, std::ceil(step_ * kSamples * swings));
  if (step_ / parts >= kLeast || parts == 1) return parts;
  return error(ErrorCode::unsupported,
               "weaving of " + text::print_rounded(d.weave->length * 1000) + " mm at " +
                   text::print_rounded(d.weave_speed * 1000) + " mm/s is " +
                   text::print_rounded(swings) + " swings per second, too fast for a robot",
               "Move more slowly, or give R_WOBBLE_LENGTH a larger value.");
}

Result<std::vector<double>> TaskExecutor::sample_times(double t, double duration,
                                                       const Drive& d) const {
  RMP_TRY_ASSIGN(const double parts, parts_of_row(d));
  return task::sample_times(t, duration, step_ / parts);
}

Result<sim::RobotMotion> TaskExecutor::driven(std::size_t who, const Drive& d,
                                              const std::string& where, double t,
                                              Progress& progress) const {
  const Actor& a = actors_[who];
  sim::RobotMotionTask task;
  task.start = d.from;
  task.model = slowed(a.model, d.velocity_share, d.acceleration_share);
  if (d.tip) {
    auto with_tool = std::make_shared<RobotModel>(*task.model);
    with_tool->tips = {{"tool", d.tip->joint, d.tip->joint_T_grip}};
    task.model = std::move(with_tool);
  }
  task.ik = a.record->ik;
  task.axes = a.maker;
  task.is_at_start = true;
  task.trajectory = &d.trajectory;
  task.name = "motion";
  task.where = where;
  task.base_T_trajectory = d.base_T_trajectory;
  RMP_TRY_ASSIGN(const double parts, parts_of_row(d));
  task.step = step_ / parts;
  task.weave = d.weave;
  task.lead = lead_of(t, task.step);
  RMP_TRY_ASSIGN(auto m, sim::robot_motion(sim_->registry, task, progress));
  if (m.times.empty() || m.times.front() > 0) {
    m.times.insert(m.times.begin(), 0.0);
    m.q.insert(m.q.begin(), task.start.begin(), task.start.end());
    for (auto* table : {&m.qd, &m.qdd}) table->insert(table->begin(), task.start.size(), 0.0);
  }
  return m;
}

void TaskExecutor::push(std::size_t who, double start, sim::RobotMotion m) {
  if (m.times.size() < 2) return;
  for (const std::string& n : m.notes)
    if (told_.emplace(actors_[who].placed->name, n).second)
      note(start, actors_[who].placed->name + ": " + n);
  actors_[who].moves.push_back({start, std::move(m)});
}

bool TaskExecutor::push_blended(std::size_t who, double start, sim::RobotMotion m,
                                double velocity_share) {
  const Actor& a = actors_[who];
  const std::size_t n = a.start.size();
  const JointState end = sample(a, moved_until(a));
  for (std::size_t i = 0; i < m.times.size(); ++i) {
    const JointState rest = sample(a, start + m.times[i]);
    for (std::size_t j = 0; j < n; ++j) {
      const std::size_t k = i * n + j;
      m.q[k] += rest.q[j] - end.q[j];
      m.qd[k] += rest.qd[j];
      m.qdd[k] += rest.qdd[j];
      const JointModel& joint = a.model->joints[j];
      if (std::fabs(m.qd[k]) > kWithin * joint.max_velocity * std::max(velocity_share, 1.0) ||
          m.q[k] < joint.lower - kLeastWay || m.q[k] > joint.upper + kLeastWay)
        return false;
    }
  }
  push(who, start, std::move(m));
  return true;
}

double TaskExecutor::brake(std::span<const std::size_t> whose, double t, double* way) {
  if (way) *way = 0;
  std::vector<std::size_t> moving;
  // The way is run through ever more slowly: by T it has come T/2 further.
  double T = 0;
  for (const std::size_t who : whose) {
    Actor& a = actors_[who];
    // What the robot passes on to without a stop it still brakes along.
    const auto first = std::find_if(a.moves.begin(), a.moves.end(), [&](const Move& m) {
      const auto rates = std::span(m.motion.qd).first(a.start.size());
      return m.start > t && std::all_of(rates.begin(), rates.end(),
                                        [](double v) { return std::fabs(v) < kLeastWay; });
    });
    a.moves.erase(first, a.moves.end());
    if (moved_until(a) <= t) continue;
    moving.push_back(who);
    const JointState now = sample(a, t);
    for (std::size_t j = 0; j < now.qd.size(); ++j) {
      const double limit = a.model->joints[j].max_acceleration;
      T = std::max(T, std::isfinite(limit) && limit > 0  ? std::fabs(now.qd[j]) / limit
                      : std::fabs(now.qd[j]) > kLeastWay ? kBrakeRise
                                                         : 0);
    }
  }
  if (moving.empty()) return t;
  if (T == 0) T = step_;
  std::vector<sim::RobotMotion> braked;
  constexpr int kSlowerTries = 8;
  for (int tries = 0; tries < kSlowerTries; ++tries, T *= 1.5) {
    braked.assign(moving.size(), {});
    bool is_within = true;
    for (std::size_t k = 0; k < moving.size(); ++k) {
      const Actor& a = actors_[moving[k]];
      const double left = moved_until(a) - t;
      sim::RobotMotion& m = braked[k];
      for (const double x : task::sample_times(t, T, step_)) {
        const double u = std::min(left, x - x * x / (2 * T)), rate = u < left ? 1 - x / T : 0;
        const JointState s = sample(a, t + u);
        m.times.push_back(x);
        for (std::size_t j = 0; j < s.q.size(); ++j) {
          const double qdd = rate * rate * s.qdd[j] - (u < left ? s.qd[j] / T : 0);
          m.q.push_back(s.q[j]);
          m.qd.push_back(rate * s.qd[j]);
          m.qdd.push_back(x == T ? 0 : qdd);
          const double limit = std::max(a.model->joints[j].max_acceleration, std::fabs(s.qdd[j]));
          is_within = is_within && !(std::fabs(qdd) > limit * (1 + 1e-3));
        }
      }
    }
    if (is_within) break;
  }
  const double took = braked.front().times.back();
  for (std::size_t k = 0; k < moving.size(); ++k) {
    Actor& a = actors_[moving[k]];
    if (way) *way = std::max(*way, std::min(moved_until(a) - t, took / 2));
    while (!a.moves.empty() && a.moves.back().start > t) a.moves.pop_back();
    a.moves.push_back({t, std::move(braked[k])});
  }
  return t + took;
}

void TaskExecutor::set_wire(std::size_t wire, double value, double t) {
  Wire& w = wires_[wire];
  if (w.history.back().second == value) return;
  w.history.emplace_back(t, value);
  ++changes_;
}

}  // namespace robomosp::task
