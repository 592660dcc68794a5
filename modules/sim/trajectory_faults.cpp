// SPDX-License-Identifier: Apache-2.0
#include "sim/trajectory_faults.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "collision/cache.h"
#include "kernel/text.h"
#include "motion/cartesian_path.h"
#include "robotics/joint_label.h"
#include "robotics/kinematics.h"
#include "sim/ik_reason.h"
#include "sim/joint_rates.h"
#include "sim/member_axes.h"
#include "sim/recording_columns.h"
#include "sim/run_setup.h"
#include "spatial/pose.h"

namespace robomosp::sim {
namespace {

using collision::collision_model;
using collision::configurations;
using collision::Contact;
using recording::Column;
using recording::Recording;
using recording::RecordingPtr;

using text::print_rounded;

std::string joint_name(const RobotModel& model, const robotics::MakerAxes& axes, std::size_t j) {
  return axes.before_joint(j) + robotics::joint_label(model, j);
}

/// Calls `found(first, last, worst)` for each run of samples whose `excess` is above 0; `worst` has
/// the greatest.
template <class Excess, class Found>
void each_stretch(std::size_t count, Excess&& excess, Found&& found) {
  for (std::size_t i = 0; i < count; ++i) {
    if (!(excess(i) > 0)) continue;
    std::size_t last = i, worst = i;
    for (; last + 1 < count && excess(last + 1) > 0; ++last)
      if (excess(last + 1) > excess(worst)) worst = last + 1;
    found(i, last, worst);
    i = last;
  }
}

void add_fault(PathCheck& check, PathFault fault) {
  for (std::size_t i = fault.first; i <= fault.last; ++i)
    check.states[i] = std::max(check.states[i], fault.kind);
  check.faults.push_back(std::move(fault));
}

/// `why`: the reason of ik_reason().
std::string reason_of(const IkResult& r, std::string why, const RobotModel& model,
                      const robotics::MakerAxes& axes) {
  if (why.empty() && r.status == IkStatus::out_of_reach) why = "it is out of reach";
  if (why.empty()) why = "the solver found no solution";
  // The solver may have told the joint already.
  if (const auto j = static_cast<std::size_t>(r.limiting_joint);
      r.limiting_joint >= 0 && why.find(model.joints[j].name) == std::string::npos)
    why += "; a limit of " + joint_name(model, axes, j) + " prevents it";
  return why;
}

void add_note(PathCheck& check, std::string text) {
  if (std::find(check.notes.begin(), check.notes.end(), text) == check.notes.end())
    check.notes.push_back(std::move(text));
}

struct Rate {
  const char* stem;
  const char* what;
};
constexpr Rate kRates[] = {
    {"qd", "velocity"}, {"qdd", "acceleration"}, {"qddd", "jerk"}, {"tau", "torque"}};

/// `from`: the sample that is the recording's first row.
void add_limits(PathCheck& check, const Recording& recording, const RobotModel& model,
                const robotics::MakerAxes& axes, std::size_t from) {
  for (const Rate& rate : kRates)
    for (std::size_t j = 0; j < model.dof(); ++j) {
      const Column* c = recording.find(rate.stem + std::to_string(j + 1));
      if (!c || (!std::isfinite(c->lower) && !std::isfinite(c->upper))) continue;
      const double slack = 1e-9 * std::max(std::fabs(c->lower), std::fabs(c->upper));
      const auto beyond = [&](std::size_t i) {
        return std::max(c->values[i] - c->upper, c->lower - c->values[i]) - slack;
      };
      each_stretch(c->values.size(), beyond,
                   [&](std::size_t first, std::size_t last, std::size_t at) {
                     const double limit = c->values[at] > 0 ? c->upper : c->lower;
                     const double excess = std::fabs(c->values[at] - limit);
                     add_fault(check, {PathState::limit,
                                       from + first,
                                       from + last,
                                       from + at,
                                       joint_name(model, axes, j) + " exceeds its " + rate.what +
                                           " limit of " + print_rounded(std::fabs(limit)) + " " +
                                           c->unit + " by " + print_rounded(excess) + " " + c->unit,
                                       static_cast<std::int32_t>(j),
                                       excess,
                                       c->unit,
                                       {},
                                       {}});
                   });
    }
}

Result<void> add_collisions(PathCheck& check, const Simulator& sim, const Recording& recording,
                            std::size_t from, Progress& progress) {
  constexpr double kTouching = 1e-4;  ///< what comes nearer touches [m]
  RMP_TRY_ASSIGN(const auto model, collision_model(sim, AnyId(recording.world), progress));
  if (!model->shapeless().empty())
    add_note(check, "Without a shape and therefore never in contact: " +
                        text::enumerate(model->shapeless()) + ".");
  RMP_TRY_ASSIGN(const auto q, configurations(*model, recording));
  RMP_TRY_ASSIGN(const auto contact, model->check_path(q, kTouching, progress));
  if (!contact) return {};
  const auto fault = [&](const Contact& c, std::size_t first, std::size_t last, std::size_t at) {
    const auto name = [&](std::int32_t body) {
      return model->bodies()[static_cast<std::size_t>(body)].name;
    };
    const double depth = std::max(0.0, -c.at.distance);
    add_fault(check, {PathState::collision, from + first, from + last, from + at,
                      model->describe(c.pair) + " touch" +
                          (depth > 0 ? ", " + print_rounded(depth, 3) + " m deep" : ""),
                      -1, depth, "m", name(c.pair.a), name(c.pair.b)});
  };
  RMP_TRY_ASSIGN(const auto least, model->clearance(q, progress));
  bool is_at_sample = false;
  each_stretch(
      least.size(), [&](std::size_t i) { return kTouching - least[i].at.distance; },
      [&](std::size_t first, std::size_t last, std::size_t at) {
        is_at_sample = true;
        fault(least[at], first, last, at);
      });
  if (!is_at_sample) fault(contact->contact, contact->segment, contact->segment, contact->segment);
  return {};
}

/// Bodies that touch where the robot stands before it begins, as one fault in front of all others.
Result<void> add_start_contacts(PathCheck& check, const Simulator& sim, const Run& run,
                                const RunSetup& setup, Progress& progress) {
  constexpr double kTouching = 1e-4;  // [m]
  const std::size_t dof = setup.model->dof();
  RobotMotion still;
  still.times = {0};
  still.q = check.start;
  still.qd.resize(dof), still.qdd.resize(dof);
  still.position_error = {0}, still.rotation_error = {0};
  RMP_TRY_ASSIGN(const Recording recording, kinematic_recording(run, setup, still));
  RMP_TRY_ASSIGN(const auto model, collision_model(sim, AnyId(recording.world), progress));
  RMP_TRY_ASSIGN(const auto q, configurations(*model, recording));
  RMP_TRY_ASSIGN(const std::vector<Contact> touching, model->near(q, kTouching, progress));
  if (touching.empty()) return {};
  const auto worst = std::min_element(
      touching.begin(), touching.end(),
      [](const Contact& a, const Contact& b) { return a.at.distance < b.at.distance; });
  const double depth = std::max(0.0, -worst->at.distance);
  PathFault f;
  f.kind = PathState::collision;
  f.is_start = true;
  f.why = model->describe(worst->pair) + " touch" +
          (depth > 0 ? ", " + print_rounded(depth, 3) + " m deep" : "");
  if (touching.size() > 1)
    f.why += ", and " + std::to_string(touching.size() - 1) +
             (touching.size() > 2 ? " other pairs touch" : " other pair touches");
  f.excess = depth, f.unit = "m";
  f.a = model->bodies()[static_cast<std::size_t>(worst->pair.a)].name;
  f.b = model->bodies()[static_cast<std::size_t>(worst->pair.b)].name;
  check.faults.insert(check.faults.begin(), std::move(f));
  return {};
}

/// Limits and contact of samples in a row that are all reached; `from` is the first of them.
Result<void> check_motion(PathCheck& out, const Simulator& sim, const RunSetup& setup,
                          RecordingPtr recording, bool collisions, std::size_t from,
                          Progress& progress) {
  const auto limited = [&](double JointModel::*limit) {
    return std::any_of(setup.model->joints.begin(), setup.model->joints.end(),
                       [&](const JointModel& j) { return std::isfinite(j.*limit); });
  };
  std::vector<std::string> more;
  if (limited(&JointModel::max_jerk)) more.emplace_back("jerk");
  if (limited(&JointModel::max_force)) more.emplace_back("torque");
  for (const std::string& quantity : more) {
    auto with = with_quantities(sim, *recording, {&quantity, 1}, progress);
    if (with.ok()) recording = *with;
    else if (with.error().code == ErrorCode::cancelled) return std::move(with).error();
    else add_note(out, "The " + quantity + " is not checked: " + with.error().sentence());
  }
  std::vector<std::string> unlimited;
  for (const auto& [limit, what] : {std::pair{&JointModel::max_velocity, "velocity"},
                                    {&JointModel::max_acceleration, "acceleration"},
                                    {&JointModel::max_jerk, "jerk"},
                                    {&JointModel::max_force, "torque"}})
    if (!limited(limit)) unlimited.emplace_back(what);
  if (!unlimited.empty())
    add_note(out, "No joint of the robot has a limit of its " + text::enumerate(unlimited) +
                      ", so there was nothing to compare with.");
  add_limits(out, *recording, *setup.model,
             member_axes(sim.snapshot, recording->world, recording->robot), from);
  if (!collisions) return {};
  auto done = add_collisions(out, sim, *recording, from, progress);
  if (done.ok()) return {};
  if (done.error().code == ErrorCode::cancelled) return std::move(done).error();
  add_note(out, "Contact is not checked: " + done.error().sentence());
  return {};
}

/// Every sample by inverse kinematics; `unreachable` tells why the motion as a whole failed.
Result<PathCheck> follow(const Simulator& sim, const Run& run, const RunSetup& setup,
                         bool collisions, Error unreachable, Progress& progress) {
  const RobotMotionTask& task = setup.task;
  auto path = motion::Path::build(sim.registry, task.name, *task.trajectory, task.stored);
  // With joint segments there is no path in space to go on along.
  if (!path.ok())
    return path.error().code == ErrorCode::unsupported ? std::move(unreachable)
                                                       : std::move(path).error();
  PathCheck out;
  out.times = (*path)->sample_times(task.step);
  std::vector<PathSample> samples(out.times.size());
  RMP_TRY((*path)->sample(out.times, samples));
  std::vector<Pose> targets;
  for (PathSample& s : samples) {
    s = in_base(s, task.base_T_trajectory);
    targets.push_back(s.pose);
    out.poses.push_back(spatial::compose(setup.world_T_base, targets.back()));
  }
  RMP_TRY_ASSIGN(const auto ik, bind_ik(sim.registry, setup.model, task.ik));
  IkBatch batch;
  batch.tolerance = task.tolerance;
  batch.targets = targets;
  batch.seeds = task.start;
  batch.continuous = true;
  RMP_TRY_ASSIGN(const auto results, solve_ik(ik, batch, progress));
  const robotics::MakerAxes axes = member_axes(sim.snapshot, run.world, run.robot);
  const std::size_t dof = setup.model->dof();
  std::vector<double> before = task.start;  // where a solver gives no configuration, the last stays
  before.resize(dof, 0.0);
  for (const IkResult& r : results) {
    if (r.q.size() >= dof)
      before.assign(r.q.begin(), r.q.begin() + static_cast<std::ptrdiff_t>(dof));
    out.q.insert(out.q.end(), before.begin(), before.end());
  }
  out.states.assign(results.size(), PathState::good);
  const auto shortfall = [&](std::size_t i) {
    const IkResult& r = results[i];
    if (r.status == IkStatus::solved) return 0.0;
    return std::max({r.shortfall, r.position_error, r.rotation_error, 1e-12});
  };
  const auto why = [&](std::size_t i) {
    const std::size_t seed = (i > 0 ? i - 1 : 0) * dof;
    return ik_reason(sim.registry, ik, task.ik, results[i], targets[i],
                     std::span<const double>(out.q).subspan(seed, dof), axes, progress);
  };
  each_stretch(results.size(), shortfall, [&](std::size_t first, std::size_t last, std::size_t at) {
    const IkResult& r = results[at];
    add_fault(out, {PathState::unreachable,
                    first,
                    last,
                    at,
                    reason_of(r, why(at), *setup.model, axes),
                    r.limiting_joint,
                    std::max(r.shortfall, r.position_error),
                    "m",
                    {},
                    {}});
  });
  if (out.faults.empty()) return unreachable;  // such as an objective that failed
  // What is reached is checked stretch by stretch, each as a motion of its own.
  for (std::size_t first = 0; first < results.size(); ++first) {
    if (results[first].status != IkStatus::solved) continue;
    std::size_t end = first + 1;
    while (end < results.size() && results[end].status == IkStatus::solved) ++end;
    const std::size_t rows = end - first;
    RobotMotion part;
    part.times.assign(out.times.begin() + static_cast<std::ptrdiff_t>(first),
                      out.times.begin() + static_cast<std::ptrdiff_t>(end));
    part.q.assign(out.q.begin() + static_cast<std::ptrdiff_t>(first * dof),
                  out.q.begin() + static_cast<std::ptrdiff_t>(end * dof));
    part.qd.resize(rows * dof), part.qdd.resize(rows * dof);
    joint_rates(*setup.model, part.times, part.q, std::span(samples).subspan(first, rows), part.qd,
                part.qdd);
    for (std::size_t i = first; i < end; ++i) {
      part.position_error.push_back(results[i].position_error);
      part.rotation_error.push_back(results[i].rotation_error);
    }
    RMP_TRY_ASSIGN(Recording recording, kinematic_recording(run, setup, part));
    RMP_TRY(check_motion(out, sim, setup, std::make_shared<const Recording>(std::move(recording)),
                         collisions, first, progress));
    first = end;
  }
  out.notes.emplace_back(
      "Joint limits and contact are checked only at reachable points of the path.");
  return out;
}

}  // namespace

std::string_view to_string(PathState s) {
  switch (s) {
    case PathState::good: return "good";
    case PathState::limit: return "limit";
    case PathState::collision: return "collision";
    case PathState::unreachable: return "unreachable";
  }
  return "good";
}

std::size_t PathCheck::last_good() const {
  const auto bad =
      std::find_if(states.begin(), states.end(), [](PathState s) { return s != PathState::good; });
  return bad == states.begin() ? 0 : static_cast<std::size_t>(bad - states.begin()) - 1;
}

Result<PathCheck> check_path(const Simulator& sim, const Run& run, bool collisions,
                             Progress& progress) {
  RMP_TRY_ASSIGN(const RunSetup setup, prepare_run(sim, run, progress));
  RMP_TRY(only_standing(setup, "checks of trajectories"));
  PathCheck out;
  auto motion = sim.inverse_kinematics(run, progress);
  if (!motion.ok()) {
    if (motion.error().code != ErrorCode::unreachable) return std::move(motion).error();
    RMP_TRY_ASSIGN(out, follow(sim, run, setup, collisions, std::move(motion).error(), progress));
  } else {
    const RecordingPtr recording = *motion;
    if (recording->find(recording::kApproachColumn))
      add_note(out,
               "The joints are not at the start of the trajectory: the approach is also checked.");
    out.times = recording->columns.front().values;
    out.states.assign(out.times.size(), PathState::good);
    std::vector<Pose> frames(setup.model->joints.size());
    std::vector<const Column*> q;
    for (std::size_t j = 0; j < setup.model->dof(); ++j)
      q.push_back(recording->find("q" + std::to_string(j + 1)));
    for (std::size_t i = 0; i < out.times.size(); ++i) {
      for (const Column* c : q) out.q.push_back(c->values[i]);
      robotics::forward_kinematics(*setup.model, std::span(out.q).last(q.size()), frames);
      out.poses.push_back(
          spatial::compose(setup.world_T_base, robotics::tip_pose(*setup.model, 0, frames)));
    }
    RMP_TRY(check_motion(out, sim, setup, recording, collisions, 0, progress));
  }
  out.robot = run.robot;
  out.trajectory = run.trajectory;
  out.dof = setup.model->dof();
  std::stable_sort(out.faults.begin(), out.faults.end(),
                   [](const PathFault& a, const PathFault& b) { return a.first < b.first; });
  // A motion that begins where the robot stands has been checked there.
  out.start = setup.task.start;
  const bool begins_there = out.q.size() >= out.dof && out.start.size() == out.dof &&
                            std::equal(out.start.begin(), out.start.end(), out.q.begin(),
                                       [](double a, double b) { return std::fabs(a - b) < 1e-9; });
  if (collisions && !run.begins_on_path && !begins_there && out.start.size() == out.dof) {
    auto done = add_start_contacts(out, sim, run, setup, progress);
    if (!done.ok() && done.error().code == ErrorCode::cancelled) return std::move(done).error();
    if (!done.ok())
      add_note(out, "Contact at the start is not checked: " + done.error().sentence());
  }
  return out;
}

}  // namespace robomosp::sim
