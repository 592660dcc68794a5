// SPDX-License-Identifier: Apache-2.0
#include "sim/simulate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "collision/cache.h"
#include "collision/collision.h"
#include "document/world_index.h"
#include "evaluation/payload.h"
#include "kernel/check.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "motion/cartesian_path.h"
#include "robotics/batch_kinematics.h"
#include "robotics/home.h"
#include "robotics/joint_label.h"
#include "robotics/single_joints.h"
#include "sim/loaded_runs.h"
#include "sim/member_axes.h"
#include "sim/recording_columns.h"
#include "sim/retime.h"
#include "sim/robot_motion.h"
#include "sim/run_setup.h"
#include "spatial/pose.h"

namespace robomosp::sim {
namespace {

using collision::collision_model;
using collision::CollisionModel;
using collision::CollisionRobot;
using evaluation::attached_model;
using recording::Column;
using recording::Recording;
using recording::RecordingPtr;

template <class Placed>
Result<const Placed*> placed_member(const document::WorldIndex& index, document::MemberList list,
                                    const std::vector<Placed>& all, std::string_view kind,
                                    const std::string& name, const std::string& world) {
  if (const auto at = index.find(list, name)) return &all[*at];
  std::vector<std::string> names;
  for (const auto& p : all) names.push_back(p.name);
  std::string hint = text::did_you_mean(name, names);
  if (hint.empty())
    hint = names.empty() ? "It has none; add one first." : "It has " + text::enumerate(names) + ".";
  return error(
      ErrorCode::unknown_name,
      "world " + text::quote(world) + " has no " + std::string(kind) + " " + text::quote(name),
      hint);
}

}  // namespace

Result<RunSetup> prepare_run(const Simulator& sim, const Run& run, Progress& progress) {
  const model::World* world = sim.snapshot.get(run.world);
  if (!world)
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  const std::string world_name = sim.snapshot.find(AnyId(run.world))->name;
  const auto index = document::world_index(sim.snapshot, run.world);
  RMP_TRY_ASSIGN(const model::PlacedRobot* robot,
                 placed_member(*index, document::MemberList::robots, world->robots, "robot",
                               run.robot, world_name));
  RMP_TRY_ASSIGN(const model::PlacedTrajectory* trajectory,
                 placed_member(*index, document::MemberList::trajectories, world->trajectories,
                               "trajectory", run.trajectory, world_name));
  const model::Robot* robot_record = sim.snapshot.get(robot->robot);
  const model::Trajectory* trajectory_record = sim.snapshot.get(trajectory->trajectory);
  if (!robot_record || !trajectory_record)
    return error(ErrorCode::stale_handle, "its robot or trajectory no longer exists",
                 "Add it again.", "world " + text::quote(world_name));

  RunSetup setup;
  setup.title = run.robot + " on " + run.trajectory;
  setup.task.where = "world " + text::quote(world_name) + ", robot " + text::quote(run.robot) +
                     ", trajectory " + text::quote(run.trajectory);
  setup.task.ik = robot_record->ik;
  setup.task.axes = robotics::MakerAxes::for_messages(robot_record);
  setup.inverse_dynamics = robot_record->inverse_dynamics;
  const Pose mounting = model::pose(robot->placement);
  RMP_TRY_ASSIGN(setup.model,
                 sim.derived.robot_model(sim.snapshot, robot->robot,
                                         spatial::rotate_back(mounting, world->gravity), progress));
  RMP_TRY_ASSIGN(setup.model,
                 attached_model(sim, run.world, *robot, std::move(setup.model), progress));
  setup.world_T_base = spatial::compose(mounting, setup.model->base);
  if (const std::string why = robotics::why_not_single_joints(*setup.model); !why.empty())
    return error(ErrorCode::unsupported, why + ", and cannot follow a trajectory yet",
                 setup.model->loops.empty()
                     ? "Move it by its joint values with tasks or world.simulate_dynamics."
                     : "robot.close finds its closed configurations.",
                 setup.task.where);

  const std::size_t dof = setup.model->dof();
  setup.task.start = robot->q.empty() ? robotics::home_joint_values(*robot_record) : robot->q;
  if (setup.task.start.size() != dof)
    return error(ErrorCode::invalid_argument,
                 "the world places it with " + std::to_string(setup.task.start.size()) +
                     " joint values, but it has " + std::to_string(dof) + " joints",
                 "Set its joint values again.", setup.task.where);
  for (std::size_t j = 0; j < dof; ++j)
    setup.task.start[j] =
        std::clamp(setup.task.start[j], setup.model->joints[j].lower, setup.model->joints[j].upper);

  RobotMotionTask& task = setup.task;
  task.model = setup.model;
  task.trajectory = trajectory_record;
  task.name = run.trajectory;
  task.base_T_trajectory =
      spatial::compose(spatial::inverse(setup.world_T_base), model::pose(trajectory->placement));
  task.step = run.sample_time > 0 ? run.sample_time : trajectory_record->sample_time;
  task.tolerance = run.tolerance;
  task.objective = run.objective;
  task.begins_on_path = run.begins_on_path;
  task.stored = motion::stored_in(sim.snapshot);
  if (robot->base_trajectory.empty()) return setup;

  RMP_TRY_ASSIGN(const model::PlacedTrajectory* way,
                 placed_member(*index, document::MemberList::trajectories, world->trajectories,
                               "trajectory", robot->base_trajectory, world_name));
  const model::Trajectory* way_record = sim.snapshot.get(way->trajectory);
  if (!way_record)
    return error(ErrorCode::stale_handle, "the trajectory of its base no longer exists",
                 "Add it again.", setup.task.where);
  RMP_TRY_ASSIGN(auto path, motion::Path::build(sim.registry, way->name, *way_record, task.stored));
  setup.base_trajectory = way->name;
  setup.gravity = world->gravity;
  setup.base = std::make_shared<const BasePath>(std::move(path), model::pose(way->placement));
  task.base_T_trajectory = model::pose(trajectory->placement);
  task.base = [base = setup.base, mounting_T_base = setup.model->base](double t) {
    return base->base(t, mounting_T_base);
  };
  return setup;
}

Result<void> only_standing(const RunSetup& setup, const std::string& what) {
  if (!setup.base) return {};
  return error(ErrorCode::unsupported,
               "its base moves along " + text::quote(setup.base_trajectory) + ", and " + what +
                   " support fixed bases only",
               "world.set_base{kind = \"fixed\"} fixes the base where it is placed.",
               setup.task.where);
}

namespace {

/// Obstacles that a robot of a world keeps away from.
struct Obstacles {
  std::shared_ptr<const CollisionModel> model;
  std::unique_ptr<collision::AskedClearance> field;
};
Result<Obstacles> obstacles(const Simulator& sim, const Run& run, Progress& progress) {
  Obstacles out;
  RMP_TRY_ASSIGN(out.model, collision_model(sim, run.world, progress));
  const auto& robots = out.model->robots();
  const auto at = std::find_if(robots.begin(), robots.end(),
                               [&](const CollisionRobot& r) { return r.name == run.robot; });
  RMP_CHECK(at != robots.end(), "a robot of the world is missing from its collision model");
  RMP_TRY_ASSIGN(out.field, out.model->field(static_cast<std::size_t>(at - robots.begin()),
                                             run.influence, progress));
  return out;
}

void add_joint_columns(Recording& recording, const RobotModel& model, const std::string& stem,
                       const std::string& what, const std::string& rotary_unit,
                       const std::string& linear_unit, std::span<const double> table) {
  const std::size_t dof = model.dof(), rows = table.size() / dof, first = recording.columns.size();
  for (std::size_t j = 0; j < dof; ++j) {
    const bool rotary = model.joints[j].type == JointType::revolute;
    recording.columns.push_back({stem + std::to_string(j + 1), rotary ? rotary_unit : linear_unit,
                                 what + " of " + robotics::joint_label(model, j),
                                 std::vector<double>(rows)});
  }
  constexpr std::size_t kBlock = 256;  // rows of the table that stay in the nearest cache
  for (std::size_t begin = 0; begin < rows; begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, rows);
    for (std::size_t j = 0; j < dof; ++j) {
      std::vector<double>& values = recording.columns[first + j].values;
      for (std::size_t i = begin; i < end; ++i) values[i] = table[i * dof + j];
    }
  }
}

}  // namespace

Result<Recording> kinematic_recording(const Run& run, const RunSetup& setup, const RobotMotion& t) {
  const RobotModel& model = *setup.model;
  Recording recording;
  recording.world = run.world;
  recording.robot = run.robot;
  recording.trajectory = run.trajectory;
  recording.dof = model.dof();
  recording.notes = t.notes;
  recording.columns.push_back({"time", "s", "time along the trajectory", t.times});
  add_joint_columns(recording, model, "q", "position", "rad", "m", t.q);
  add_joint_columns(recording, model, "qd", "velocity", "rad/s", "m/s", t.qd);
  add_joint_columns(recording, model, "qdd", "acceleration", "rad/s^2", "m/s^2", t.qdd);
  std::array<Column, 3> tip{Column{"x", "m", "tool position in the world", {}},
                            Column{"y", "m", "tool position in the world", {}},
                            Column{"z", "m", "tool position in the world", {}}};
  const robotics::BatchKinematics kinematics(model);
  std::vector<double> scratch(kinematics.scratch_size());
  std::vector<Pose> poses(t.times.size());
  kinematics.tip_poses(0, t.q, poses, scratch);
  for (Column& c : tip) c.values.reserve(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Pose base = setup.world_T_base;
    if (setup.base) {
      RMP_TRY_ASSIGN(const PathSample now, setup.task.base(t.times[i]));
      base = now.pose;
    }
    const Vec3 p = spatial::transform(base, poses[i].p);
    for (std::size_t k = 0; k < 3; ++k) tip[k].values.push_back(p[k]);
  }
  for (auto& c : tip) recording.columns.push_back(std::move(c));
  recording.columns.push_back(
      {"position_error", "m", "distance of the tool from the trajectory", t.position_error});
  recording.columns.push_back(
      {"rotation_error", "rad", "remaining angle to the desired orientation", t.rotation_error});
  if (!t.approach.empty())
    recording.columns.push_back({recording::kApproachColumn, "",
                                 "1 while the joints approach the trajectory, 0 along it",
                                 t.approach});
  name_axes(recording, model, *setup.task.axes);
  mark_limits(recording, model);
  if (setup.base)
    recording.notes.push_back("The base moves along " + text::quote(setup.base_trajectory) +
                              "; pictures show it where it is placed.");
  return recording;
}

namespace {

/// Where a joint exceeds a limit, and by how much at most: a sentence each.
void note_limits(const Simulator& sim, Recording& recording, const RobotModel& model,
                 const std::string& stem, const std::string& what, double JointModel::*limit) {
  const std::vector<double>& times = recording.columns.front().values;
  const Column* approach = recording.find(recording::kApproachColumn);
  const robotics::MakerAxes axes = member_axes(sim.snapshot, recording.world, recording.robot);
  for (std::size_t j = 0; j < model.dof(); ++j) {
    const Column* column = recording.find(stem + std::to_string(j + 1));
    const double most = model.joints[j].*limit;
    if (!column || !std::isfinite(most)) continue;
    std::optional<std::size_t> first;
    std::size_t worst = 0;
    for (std::size_t i = 0; i < column->values.size(); ++i) {
      if (std::fabs(column->values[i]) > most * (1 + 1e-9) && !first) first = i;
      if (std::fabs(column->values[i]) > std::fabs(column->values[worst])) worst = i;
    }
    if (!first) continue;
    recording.notes.push_back(
        axes.before_joint(j) + (axes.known() ? "joint " : "Joint ") + std::to_string(j + 1) + " (" +
        model.joints[j].name + ") exceeds its " + what + " limit of " + text::print_rounded(most) +
        " " + column->unit + " from t = " + text::print_rounded(times[*first]) +
        " s; most at t = " + text::print_rounded(times[worst]) + " s, by " +
        text::print_rounded(std::fabs(column->values[worst]) - most) + " " + column->unit +
        (approach && approach->values[worst] != 0 ? ", in an approach." : "."));
  }
}

Result<RobotMotion> kinematics(const Simulator& sim, const Run& run, const RunSetup& setup,
                               Progress& progress) {
  Obstacles around;
  RobotMotionTask task = setup.task;
  if (run.objective == IkObjective::clearance) {
    RMP_TRY(only_standing(setup, "objectives of clearance"));
    RMP_TRY_ASSIGN(around, obstacles(sim, run, progress).in(task.where));
    task.clearance = around.field.get();
  }
  auto motion = robot_motion(sim.registry, task, progress);
  if (around.field) RMP_TRY(around.field->outcome().in(task.where));
  return motion;
}

void note_kinematic_limits(const Simulator& sim, Recording& recording, const RobotModel& model) {
  note_limits(sim, recording, model, "qd", "velocity", &JointModel::max_velocity);
  note_limits(sim, recording, model, "qdd", "acceleration", &JointModel::max_acceleration);
}

}  // namespace

Result<RecordingPtr> Simulator::inverse_kinematics(const Run& run, Progress& progress) const {
  RMP_TRY_ASSIGN(const RunSetup setup, prepare_run(*this, run, progress));
  RMP_TRY_ASSIGN(const RobotMotion t, kinematics(*this, run, setup, progress));
  RMP_TRY_ASSIGN(Recording recording, kinematic_recording(run, setup, t));
  recording.title = setup.title + ": inverse kinematics";
  note_kinematic_limits(*this, recording, *setup.model);
  return std::make_shared<const Recording>(std::move(recording));
}

namespace {

/// Coulomb friction of joints that rest in one row alone, because they start or stop there with an
/// acceleration: that of the motion that begins or ends, which the solvers leave out at rest. Zero
/// elsewhere, also where a joint turns around, as friction does so too. Empty when there is none.
Result<std::vector<double>> friction_of_starts(const RobotMotion& t, std::size_t dof,
                                               const Bound<InverseDynamics>& dynamics,
                                               Progress& progress) {
  constexpr double kRest = 1e-9, kCreepingSpeed = 1e-6;  // [rad/s or m/s]
  const std::size_t rows = t.times.size();
  std::vector<double> creeping(rows * dof, 0.0);
  bool any = false;
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < dof; ++j) {
      const double a = t.qdd[i * dof + j];
      if (std::fabs(t.qd[i * dof + j]) > kRest || a == 0) continue;
      const double before = i > 0 ? t.qd[(i - 1) * dof + j] : 0;
      const double after = i + 1 < rows ? t.qd[(i + 1) * dof + j] : 0;
      const bool starts = std::fabs(after) > kRest && (after > 0) == (a > 0);
      const bool stops = std::fabs(before) > kRest && (before > 0) != (a > 0);
      if (starts == stops) continue;
      creeping[i * dof + j] = std::copysign(kCreepingSpeed, starts ? after : before);
      any = true;
    }
  if (!any) return std::vector<double>();
  DynamicsBatch batch;
  batch.count = rows;
  batch.q = t.q, batch.qd = creeping, batch.qdd = t.qdd;
  batch.terms = kFrictionTerm;
  RMP_TRY_ASSIGN(auto out, torques(dynamics, batch, progress));
  // At twice the rate viscous friction is twice as great; what is left of both is Coulomb's.
  for (double& v : creeping) v *= 2;
  RMP_TRY_ASSIGN(const auto twice, torques(dynamics, batch, progress));
  for (std::size_t k = 0; k < out.size(); ++k)
    out[k] = creeping[k] == 0 ? 0.0 : 2 * out[k] - twice[k];
  return out;
}

/// How the base moves in the world in each row; one row for all if it stands.
Result<std::vector<PathSample>> base_of_rows(const RunSetup& setup,
                                             const std::vector<double>& times) {
  std::vector<PathSample> out;
  if (!setup.base) {
    out.emplace_back().pose = setup.world_T_base;
    return out;
  }
  for (const double t : times) {
    RMP_TRY_ASSIGN(const PathSample now, setup.task.base(t));
    out.push_back(now);
  }
  return out;
}

/// The load of a run in each row, with its columns.
Result<ActingLoad> add_load(Recording& recording, const TipLoad& given, const RunSetup& setup,
                            const RobotMotion& t) {
  if (!given.is_given()) return ActingLoad{};
  RMP_TRY_ASSIGN(const auto base, base_of_rows(setup, t.times));
  return add_load_columns(recording, given, *setup.model, {t.times, t.q, t.qd, base, t.approach});
}

/// tau of the motion in total and by its parts.
Result<void> add_torques(const Simulator& sim, Recording& recording, const TipLoad& given,
                         const RunSetup& setup, const RobotMotion& t,
                         const Bound<InverseDynamics>& dynamics, Progress& progress) {
  struct Part {
    const char* stem;
    const char* what;
    std::uint32_t terms;
  };
  RMP_TRY_ASSIGN(const ActingLoad acting,
                 add_load(recording, given, setup, t).in(setup.task.where));
  constexpr std::array<Part, 6> kDynamicsParts{
      {{"tau", "torque", kAllTerms},
       {"tau_gravity", "gravity part of the torque", kGravityTerm},
       {"tau_inertial", "inertial part of the torque", kInertialTerm},
       {"tau_velocity", "velocity part of the torque", kVelocityTerm},
       {"tau_friction", "friction part of the torque", kFrictionTerm},
       {"tau_external", "part of the torque due to the force at the tip", kExternalTerm}}};
  RMP_TRY_ASSIGN(const auto starts, friction_of_starts(t, setup.model->dof(), dynamics, progress));
  std::vector<BaseMotion> base;
  if (setup.base)
    for (const double t_now : t.times) {
      RMP_TRY_ASSIGN(const BaseMotion felt,
                     setup.base->felt(t_now, setup.model->base, setup.gravity));
      base.push_back(felt);
    }
  for (const auto& part : kDynamicsParts) {
    if (part.terms == kExternalTerm && acting.in_base.empty()) continue;
    DynamicsBatch batch;
    batch.base = base;
    batch.tip = acting.in_base;
    batch.tip_index = acting.tip;
    batch.count = t.times.size();
    batch.q = t.q;
    batch.qd = t.qd;
    batch.qdd = t.qdd;
    batch.terms = part.terms;
    RMP_TRY_ASSIGN(auto tau, torques(dynamics, batch, progress));
    if ((part.terms & kFrictionTerm) != 0)
      for (std::size_t k = 0; k < starts.size(); ++k) tau[k] += starts[k];
    add_joint_columns(recording, *setup.model, part.stem, part.what, "N m", "N", tau);
  }
  mark_limits(recording, *setup.model);
  note_limits(sim, recording, *setup.model, "tau", "torque", &JointModel::max_force);
  return {};
}

}  // namespace

Result<RecordingPtr> inverse_dynamics(const Simulator& sim, const Run& run, const TipLoad& load,
                                      Progress& progress) {
  RMP_TRY_ASSIGN(const RunSetup setup, prepare_run(sim, run, progress));
  RMP_TRY_ASSIGN(const RobotMotion t, kinematics(sim, run, setup, progress));
  RMP_TRY_ASSIGN(const auto dynamics,
                 bind_inverse_dynamics(sim.registry, setup.model, setup.inverse_dynamics));
  RMP_TRY_ASSIGN(Recording recording, kinematic_recording(run, setup, t));
  recording.title = setup.title + ": inverse dynamics";
  note_kinematic_limits(sim, recording, *setup.model);
  RMP_TRY(add_torques(sim, recording, load, setup, t, dynamics, progress));
  return std::make_shared<const Recording>(std::move(recording));
}

Result<RecordingPtr> time_optimal(const Simulator& sim, const Run& run, const RetimeOptions& wanted,
                                  const TipLoad& load, Progress& progress) {
  RMP_TRY_ASSIGN(const RunSetup setup, prepare_run(sim, run, progress));
  RMP_TRY(only_standing(setup, "time-optimal runs"));
  std::optional<BoundTipLoad> bound;
  if (load.is_given()) {
    RMP_TRY_ASSIGN(bound, BoundTipLoad::create(load, *setup.model).in(setup.task.where));
    if (bound->uses_time())
      return error(
          ErrorCode::invalid_argument,
          "a force over time cannot be used: a time-optimal run computes the time at each point",
          "Give a constant, or an expression or a recording over `path`.", setup.task.where);
  }
  RMP_TRY_ASSIGN(const RobotMotion slow, kinematics(sim, run, setup, progress));
  RMP_TRY_ASSIGN(const auto dynamics,
                 bind_inverse_dynamics(sim.registry, setup.model, setup.inverse_dynamics));
  RetimeOptions options = wanted;
  TipWay way;
  if (bound) {
    RMP_TRY_ASSIGN(const auto base, base_of_rows(setup, slow.times));
    way = tip_way(*setup.model, bound->tip(), slow.times, slow.q, slow.qd, base, slow.approach);
    options.load = {&*bound, setup.world_T_base, way.length};
  }
  auto timed =
      retime(sim.registry, *setup.model, slow, &dynamics, options, setup.task.where, progress);
  if (!timed.ok()) return setup.task.axes->in_error(*setup.model, std::move(timed).error());
  const RobotMotion& t = *timed;
  RMP_TRY_ASSIGN(Recording recording, kinematic_recording(run, setup, t));
  recording.title = setup.title + ": time-optimal";
  RMP_TRY(add_torques(sim, recording, load, setup, t, dynamics, progress));
  return std::make_shared<const Recording>(std::move(recording));
}

Result<RecordingPtr> Simulator::inverse_dynamics(const Run& run, Progress& progress) const {
  return sim::inverse_dynamics(*this, run, TipLoad{}, progress);
}

Result<RecordingPtr> Simulator::time_optimal(const Run& run, const RetimeOptions& options,
                                             Progress& progress) const {
  return sim::time_optimal(*this, run, options, TipLoad{}, progress);
}

}  // namespace robomosp::sim
