// SPDX-License-Identifier: Apache-2.0
#include "sim/simulate.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernel/check.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "motion/path.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "sim/collision.h"
#include "sim/collision_cache.h"
#include "sim/joint_rates.h"
#include "spatial/pose.h"

namespace robomosp::sim {
namespace {

using document::Snapshot;

template <class Placed>
Result<const Placed*> member(const std::vector<Placed>& all, std::string_view kind,
                             const std::string& name, const std::string& world) {
  std::vector<std::string> names;
  for (const auto& p : all) {
    if (p.name == name) return &p;
    names.push_back(p.name);
  }
  std::string hint = text::did_you_mean(name, names);
  if (hint.empty())
    hint = names.empty() ? "It has none; add one first." : "It has " + text::enumerate(names) + ".";
  return error(
      ErrorCode::unknown_name,
      "world " + text::quote(world) + " has no " + std::string(kind) + " " + text::quote(name),
      hint);
}

/// Everything a run needs, and the tip's path in the robot's base frame.
struct Setup {
  const Snapshot* snapshot = nullptr;
  std::string where, title;
  model::ProviderChoice ik, inverse_dynamics;
  std::shared_ptr<const RobotModel> model;
  Pose world_T_base;
  std::vector<double> start;  ///< seed of the first sample
  std::vector<double> times;
  std::vector<PathSample> path;  ///< base frame
};

PathSample in_base(const PathSample& s, const Pose& base_T_path) {
  using namespace spatial;
  return {compose(base_T_path, s.pose), rotate(base_T_path, s.velocity),
          rotate(base_T_path, s.angular_velocity), rotate(base_T_path, s.acceleration),
          rotate(base_T_path, s.angular_acceleration)};
}

Result<Setup> prepare(const Simulator& sim, const Run& run, Progress& progress) {
  const model::World* world = sim.snapshot.get(run.world);
  if (!world)
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  const std::string world_name = sim.snapshot.find(AnyId(run.world))->name;
  RMP_TRY_ASSIGN(const model::PlacedRobot* robot,
                 member(world->robots, "robot", run.robot, world_name));
  RMP_TRY_ASSIGN(const model::PlacedTrajectory* trajectory,
                 member(world->trajectories, "trajectory", run.trajectory, world_name));
  const model::Robot* robot_record = sim.snapshot.get(robot->robot);
  const model::Trajectory* trajectory_record = sim.snapshot.get(trajectory->trajectory);
  if (!robot_record || !trajectory_record)
    return error(ErrorCode::stale_handle, "its robot or trajectory no longer exists",
                 "Add it again.", "world " + text::quote(world_name));

  Setup setup;
  setup.snapshot = &sim.snapshot;
  setup.title = run.robot + " on " + run.trajectory;
  setup.where = "world " + text::quote(world_name) + ", robot " + text::quote(run.robot) +
                ", trajectory " + text::quote(run.trajectory);
  setup.ik = robot_record->ik;
  setup.inverse_dynamics = robot_record->inverse_dynamics;
  const Pose mounting = model::pose(robot->placement);
  RMP_TRY_ASSIGN(setup.model,
                 sim.derived.robot_model(sim.snapshot, robot->robot,
                                         spatial::rotate_back(mounting, world->gravity), progress));
  setup.world_T_base = spatial::compose(mounting, setup.model->base);
  if (!setup.model->is_simple() || !setup.model->loops.empty())
    return error(ErrorCode::unsupported,
                 "it has loops or joints that are not of one coordinate each, and cannot follow a "
                 "trajectory yet",
                 "robot.close finds its closed configurations.", setup.where);

  const std::size_t dof = setup.model->dof();
  setup.start = robot->q.empty() ? robotics::home_joint_values(*robot_record) : robot->q;
  if (setup.start.size() != dof)
    return error(ErrorCode::invalid_argument,
                 "the world places it with " + std::to_string(setup.start.size()) +
                     " joint values, but it has " + std::to_string(dof) + " joints",
                 "Set its joint values again.", setup.where);
  for (std::size_t j = 0; j < dof; ++j)
    setup.start[j] =
        std::clamp(setup.start[j], setup.model->joints[j].lower, setup.model->joints[j].upper);

  RMP_TRY_ASSIGN(const auto path,
                 motion::Path::build(sim.registry, run.trajectory, *trajectory_record,
                                     motion::stored_in(sim.snapshot)));
  const double step = run.sample_time > 0 ? run.sample_time : trajectory_record->sample_time;
  if (!(step > 0) || path->duration() / step > 1e7)
    return error(ErrorCode::invalid_argument,
                 "a sample time of " + text::print_rounded(step) +
                     " s gives too many samples for " + text::print_rounded(path->duration()) +
                     " s",
                 "Give a longer sample time.", setup.where);
  setup.times = path->sample_times(step);
  setup.path.resize(setup.times.size());
  path->sample(setup.times, setup.path);
  const Pose base_T_path =
      spatial::compose(spatial::inverse(setup.world_T_base), model::pose(trajectory->placement));
  for (auto& s : setup.path) s = in_base(s, base_T_path);
  return setup;
}

/// Obstacles that a robot of a world keeps away from.
struct Obstacles {
  std::shared_ptr<const CollisionModel> model;
  std::unique_ptr<ClearanceField> field;
};
Result<Obstacles> obstacles(const Simulator& sim, const Run& run, Progress& progress) {
  Obstacles out;
  RMP_TRY_ASSIGN(out.model, collision_model(sim, run.world, progress));
  const auto& robots = out.model->robots();
  const auto at = std::find_if(robots.begin(), robots.end(),
                               [&](const CollisionRobot& r) { return r.name == run.robot; });
  RMP_CHECK(at != robots.end(), "a robot of the world is missing from its collision model");
  out.field = out.model->field(static_cast<std::size_t>(at - robots.begin()), run.influence);
  return out;
}

/// Joint values along the path: one free solution for the start, then one branch followed.
Result<std::vector<double>> follow(const Simulator& sim, const Run& run, const Setup& setup,
                                   std::vector<double>& position_error,
                                   std::vector<double>& rotation_error, Progress& progress) {
  const std::size_t dof = setup.model->dof();
  RMP_TRY_ASSIGN(auto ik, bind_ik(sim.registry, setup.model, setup.ik));
  Obstacles around;
  if (run.objective == IkObjective::clearance) {
    RMP_TRY_ASSIGN(around, obstacles(sim, run, progress).in(setup.where));
  }
  std::vector<Pose> targets;
  targets.reserve(setup.path.size());
  for (const auto& s : setup.path) targets.push_back(s.pose);
  IkBatch batch;
  batch.tolerance = run.tolerance;
  batch.targets = std::span<const Pose>(targets).first(1);
  batch.seeds = setup.start;
  batch.objective = run.objective;
  batch.clearance = around.field.get();
  auto started = solve_ik(ik, batch, progress);
  // The robot's own solver may have no use for the objective; another one follows instead.
  if (!started.ok() && started.error().code == ErrorCode::unsupported) {
    const auto other = ik_with_tag(sim.registry, setup.ik, "objectives");
    RMP_TRY_ASSIGN(ik, bind_ik(sim.registry, setup.model, other));
    started = solve_ik(ik, batch, progress);
  }
  RMP_TRY_ASSIGN(auto first, std::move(started));
  std::vector<IkResult> results;
  if (first.front().status == IkStatus::solved) {
    const std::vector<double> seed(first.front().q.begin(),
                                   first.front().q.begin() + static_cast<std::ptrdiff_t>(dof));
    batch.targets = targets;
    batch.seeds = seed;
    batch.continuous = true;
    RMP_TRY_ASSIGN(results, solve_ik(ik, batch, progress));
  } else {
    results = std::move(first);
  }
  std::vector<double> q;
  q.reserve(targets.size() * dof);
  for (std::size_t i = 0; i < results.size(); ++i) {
    const IkResult& r = results[i];
    if (r.status != IkStatus::solved)
      return error(
          ErrorCode::unreachable,
          "at t = " + text::print_rounded(setup.times[i]) + " s (sample " + std::to_string(i + 1) +
              " of " + std::to_string(targets.size()) + ") the robot cannot follow: " +
              (r.detail.empty() ? "the solver found no solution" : r.detail),
          "Move the trajectory or the robot, or start from another configuration.", setup.where);
    q.insert(q.end(), r.q.begin(), r.q.begin() + static_cast<std::ptrdiff_t>(dof));
    position_error.push_back(r.position_error);
    rotation_error.push_back(r.rotation_error);
  }
  return q;
}

struct Tables {
  std::vector<double> q, qd, qdd, position_error, rotation_error;
};

Column take(std::string name, std::string unit, std::string doc, std::span<const double> table,
            std::size_t dof, std::size_t joint) {
  Column c{std::move(name), std::move(unit), std::move(doc), {}};
  c.values.reserve(table.size() / dof);
  for (std::size_t i = joint; i < table.size(); i += dof) c.values.push_back(table[i]);
  return c;
}

void add_joint_columns(Recording& recording, const RobotModel& model, const std::string& stem,
                       const std::string& what, const std::string& rotary_unit,
                       const std::string& linear_unit, std::span<const double> table) {
  for (std::size_t j = 0; j < model.dof(); ++j) {
    const bool rotary = model.joints[j].type == JointType::revolute;
    recording.columns.push_back(
        take(stem + std::to_string(j + 1), rotary ? rotary_unit : linear_unit,
             what + " of joint " + std::to_string(j + 1) + " (" + model.joints[j].name + ")", table,
             model.dof(), j));
  }
}

Recording kinematic_recording(const Run& run, const Setup& setup, const Tables& t) {
  const RobotModel& model = *setup.model;
  Recording recording;
  recording.world = run.world;
  recording.robot = run.robot;
  recording.trajectory = run.trajectory;
  recording.dof = model.dof();
  recording.columns.push_back({"time", "s", "time along the trajectory", setup.times});
  add_joint_columns(recording, model, "q", "position", "rad", "m", t.q);
  add_joint_columns(recording, model, "qd", "velocity", "rad/s", "m/s", t.qd);
  add_joint_columns(recording, model, "qdd", "acceleration", "rad/s^2", "m/s^2", t.qdd);
  std::array<Column, 3> tip{Column{"x", "m", "tool position in the world", {}},
                            Column{"y", "m", "tool position in the world", {}},
                            Column{"z", "m", "tool position in the world", {}}};
  std::vector<Pose> frames(model.joints.size());
  for (std::size_t i = 0; i < setup.times.size(); ++i) {
    robotics::forward_kinematics(
        model, std::span<const double>(t.q).subspan(i * model.dof(), model.dof()), frames);
    const Vec3 p = spatial::transform(setup.world_T_base, robotics::tip_pose(model, 0, frames).p);
    for (std::size_t k = 0; k < 3; ++k) tip[k].values.push_back(p[k]);
  }
  for (auto& c : tip) recording.columns.push_back(std::move(c));
  recording.columns.push_back(
      {"position_error", "m", "distance of the tool from the trajectory", t.position_error});
  recording.columns.push_back(
      {"rotation_error", "rad", "angle left to the wanted orientation", t.rotation_error});
  return recording;
}

/// First sample at which a joint is faster than it may be, a sentence each.
void note_speed_limits(Recording& recording, const RobotModel& model) {
  for (std::size_t j = 0; j < model.dof(); ++j) {
    const Column* qd = recording.find("qd" + std::to_string(j + 1));
    const double limit = model.joints[j].max_velocity;
    for (std::size_t i = 0; i < qd->values.size(); ++i)
      if (std::fabs(qd->values[i]) > limit) {
        recording.notes.push_back(
            "Joint " + std::to_string(j + 1) + " (" + model.joints[j].name +
            ") exceeds its velocity limit of " + text::print_rounded(limit) + " " + qd->unit +
            " from t = " + text::print_rounded(recording.columns.front().values[i]) + " s.");
        break;
      }
  }
}

Result<Tables> kinematics(const Simulator& sim, const Run& run, const Setup& setup,
                          Progress& progress) {
  Tables t;
  RMP_TRY_ASSIGN(t.q, follow(sim, run, setup, t.position_error, t.rotation_error, progress));
  t.qd.resize(t.q.size());
  t.qdd.resize(t.q.size());
  joint_rates(*setup.model, setup.times, t.q, setup.path, t.qd, t.qdd);
  return t;
}

}  // namespace

Result<RecordingPtr> Simulator::inverse_kinematics(const Run& run, Progress& progress) const {
  RMP_TRY_ASSIGN(const Setup setup, prepare(*this, run, progress));
  RMP_TRY_ASSIGN(const Tables t, kinematics(*this, run, setup, progress));
  Recording recording = kinematic_recording(run, setup, t);
  recording.title = setup.title + ": inverse kinematics";
  note_speed_limits(recording, *setup.model);
  return std::make_shared<const Recording>(std::move(recording));
}

Result<RecordingPtr> Simulator::inverse_dynamics(const Run& run, Progress& progress) const {
  RMP_TRY_ASSIGN(const Setup setup, prepare(*this, run, progress));
  RMP_TRY_ASSIGN(const Tables t, kinematics(*this, run, setup, progress));
  RMP_TRY_ASSIGN(const auto dynamics,
                 bind_inverse_dynamics(registry, setup.model, setup.inverse_dynamics));
  Recording recording = kinematic_recording(run, setup, t);
  recording.title = setup.title + ": inverse dynamics";
  note_speed_limits(recording, *setup.model);
  struct Part {
    const char* stem;
    const char* what;
    std::uint32_t terms;
  };
  constexpr std::array<Part, 5> kParts{
      {{"tau", "torque", kAllTerms},
       {"tau_gravity", "gravity part of the torque", kGravityTerm},
       {"tau_inertial", "inertial part of the torque", kInertialTerm},
       {"tau_velocity", "velocity part of the torque", kVelocityTerm},
       {"tau_friction", "friction part of the torque", kFrictionTerm}}};
  for (const auto& part : kParts) {
    DynamicsBatch batch;
    batch.count = setup.times.size();
    batch.q = t.q;
    batch.qd = t.qd;
    batch.qdd = t.qdd;
    batch.terms = part.terms;
    RMP_TRY_ASSIGN(const auto tau, torques(dynamics, batch, progress));
    add_joint_columns(recording, *setup.model, part.stem, part.what, "N m", "N", tau);
  }
  return std::make_shared<const Recording>(std::move(recording));
}

}  // namespace robomosp::sim
