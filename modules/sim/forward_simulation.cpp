// SPDX-License-Identifier: Apache-2.0
#include "sim/forward_simulation.h"

#include <algorithm>
#include <cmath>

#include "evaluation/payload.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "motion/provider_params.h"
#include "robotics/closure.h"
#include "robotics/grip.h"
#include "robotics/kinematics.h"
#include "robotics/maker_axes.h"
#include "sim/closed_dynamics.h"
#include "sim/dynamics_choice.h"
#include "sim/index.h"
#include "sim/motion_reference.h"
#include "sim/motion_table.h"
#include "sim/recording_columns.h"
#include "sim/stoppable_dynamics.h"
#include "spatial/pose.h"

namespace robomosp::sim {
namespace {

using evaluation::attached_model;
using recording::Recording;
using recording::RecordingPtr;

/// Loops that cannot be closed better than this at the start are an error [m, rad].
constexpr double kOpenLoop = 1e-6;
constexpr double kMostSamples = 1e7;
constexpr double kMostTicks = 1e8;
/// Beyond it no joint value or velocity is accepted as an argument, and none is recorded.
constexpr double kMostOfAState = 1e12;

std::vector<double> neutral(const RobotModel& model) {
  std::vector<double> q(model.coordinate_count(), 0.0);
  for (const JointModel& joint : model.joints)
    if (const std::int32_t count = coordinate_count(joint.type); count > 1)
      q[index(joint.q_index + count - 4)] = 1;
  return q;
}

/// A robot at its place.
struct Placed {
  const model::Robot* record = nullptr;
  std::shared_ptr<const RobotModel> model;
  std::string where, title;
  Vec3 gravity{0, 0, -9.81};  ///< world axes
  Pose world_T_mounting;
  std::vector<double> q;  ///< where it stands
  const model::World* world = nullptr;
  std::string base_trajectory;  ///< of the world, how its mounting moves
};

template <class Member>
Result<const Member*> named_member(const std::vector<Member>& all, const std::string& kind,
                                   const std::string& name, const std::string& where) {
  std::vector<std::string> names;
  for (const Member& m : all) {
    if (m.name == name) return &m;
    names.push_back(m.name);
  }
  std::string hint = text::did_you_mean(name, names);
  if (hint.empty())
    hint = names.empty() ? "It has none; add one first." : "It has " + text::enumerate(names) + ".";
  return error(ErrorCode::unknown_name, "it has no " + kind + " " + text::quote(name), hint, where);
}

Result<Placed> place_robot(const Simulator& sim, const ForwardRun& run, Progress& progress) {
  Placed p;
  RobotId id = run.record;
  const model::PlacedRobot* placed = nullptr;
  const document::Snapshot& s = sim.snapshot;
  if (run.world.number != 0) {
    p.world = s.get(run.world);
    if (!p.world)
      return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
    const std::string world = "world " + text::quote(s.find(AnyId(run.world))->name);
    RMP_TRY_ASSIGN(const model::PlacedRobot* robot,
                   named_member(p.world->robots, "robot", run.robot, world));
    id = robot->robot;
    placed = robot;
    p.where = world + ", robot " + text::quote(run.robot);
    p.title = run.robot;
    p.gravity = p.world->gravity;
    p.world_T_mounting = model::pose(robot->placement);
    p.q = robot->q;
    p.base_trajectory = robot->base_trajectory;
  }
  p.record = s.get(id);
  if (!p.record)
    return error(ErrorCode::stale_handle, "the robot no longer exists", "Add it again.");
  if (!p.world) {
    p.title = s.find(AnyId(id))->name;
    p.where = "robot " + text::quote(p.title);
  }
  RMP_TRY_ASSIGN(p.model,
                 sim.derived.robot_model(s, id, spatial::rotate_back(p.world_T_mounting, p.gravity),
                                         progress));
  if (placed) {
    RMP_TRY_ASSIGN(p.model, attached_model(sim, run.world, *placed, std::move(p.model), progress));
  }
  if (p.q.empty())
    for (const auto& pose : p.record->poses)
      if (pose.name == "home") p.q = pose.q;
  if (p.q.size() != p.model->coordinate_count()) p.q = neutral(*p.model);
  return p;
}

/// A trajectory of the world, as a path in the world.
struct WorldPath {
  std::shared_ptr<const motion::Path> path;
  Pose world_T_path;
};
Result<WorldPath> path_of(const Simulator& sim, const Placed& p, const std::string& name) {
  if (!p.world)
    return error(ErrorCode::invalid_argument, "a robot outside a world has no trajectories",
                 "Use world.simulate_dynamics, or a recording.", p.where);
  RMP_TRY_ASSIGN(const model::PlacedTrajectory* placed,
                 named_member(p.world->trajectories, "trajectory", name, p.where));
  const model::Trajectory* record = sim.snapshot.get(placed->trajectory);
  if (!record)
    return error(ErrorCode::stale_handle, "the trajectory no longer exists", "Add it again.",
                 p.where);
  RMP_TRY_ASSIGN(auto path,
                 motion::Path::build(sim.registry, name, *record, motion::stored_in(sim.snapshot)));
  return WorldPath{std::move(path), model::pose(placed->placement)};
}

class PartProgress final : public Progress {
 public:
  PartProgress(Progress& whole, double from, double share)
      : whole_(whole), from_(from), share_(share) {}
  void report(double fraction, std::string_view what) override {
    whole_.report(from_ + share_ * fraction, what);
  }
  [[nodiscard]] bool cancelled() const override { return whole_.cancelled(); }

 private:
  Progress& whole_;
  double from_, share_;
};

/// Keeps the samples that were asked for, with the forces there, and the last state.
class Sampler final : public OdeSink {
 public:
  /// Called with every row that was added, for whoever looks on. Returns true if the forces from
  /// outside change there: the integrator ends at the row, and another run continues from it.
  using Publish = std::function<Result<bool>(double t, std::span<const double> x,
                                             const MechanismMotion::Forces& forces)>;
  Sampler(MechanismMotion& motion, MotionTable& table, std::span<const double> times,
          Publish publish)
      : motion_(motion), table_(table), times_(times), publish_(std::move(publish)) {}

  bool sample(double t, std::span<const double> x) override {
    last.assign(x.begin(), x.end());
    last_time = t;
    if (next_ >= times_.size() || t != times_[next_]) return true;
    ++next_;
    if (auto done = check_size(t, x); !done.ok()) {
      failure = std::move(done).error();
      return false;
    }
    if (auto done = motion_.forces(t, x, forces_); !done.ok()) {
      failure = std::move(done).error();
      return false;
    }
    table_.add(t, x, forces_);
    if (!publish_) return true;
    auto seen = publish_(t, x, forces_);
    if (!seen.ok()) failure = std::move(seen).error();
    else is_interrupted = *seen;
    return seen.ok() && !is_interrupted;
  }
  /// Those not yet given, up to a time.
  [[nodiscard]] std::span<const double> due(double limit) const {
    const auto end = std::upper_bound(times_.begin(), times_.end(), limit);
    return times_.subspan(next_, static_cast<std::size_t>(end - times_.begin()) - next_);
  }
  std::vector<double> last;
  double last_time = 0;         ///< [s]
  bool is_interrupted = false;  ///< at the last sample
  std::optional<Error> failure;

 private:
  /// A motion that grows without bound, whether by the integrator or by its forces, is an error.
  [[nodiscard]] Result<void> check_size(double t, std::span<const double> x) const {
    const auto grown =
        std::find_if(x.begin(), x.end(), [](double v) { return !(std::fabs(v) <= kMostOfAState); });
    if (grown == x.end()) return {};
    const auto at = static_cast<std::size_t>(grown - x.begin());
    const bool is_rate = at >= motion_.positions();
    const std::size_t entry = is_rate ? at - motion_.positions() : at;
    const RobotModel& m = motion_.model();
    const JointModel* joint = nullptr;
    for (const JointModel& j : m.joints)
      if (!j.is_coupled() && index(is_rate ? j.v_index : j.q_index) <= entry) joint = &j;
    return error(ErrorCode::invalid_argument,
                 std::string("the motion grows without bound: the ") +
                     (is_rate ? "velocity" : "position") + " of joint " +
                     text::quote(joint ? joint->name : std::to_string(entry + 1)) + " is " +
                     text::print_rounded(*grown, 3),
                 "Give a shorter step or control period, or look for gains that are too high or a "
                 "force that drives the motion.",
                 "t = " + text::print_rounded(t) + " s");
  }

  MechanismMotion& motion_;
  MotionTable& table_;
  std::span<const double> times_;
  Publish publish_;
  std::size_t next_ = 0;
  MechanismMotion::Forces forces_;
};

/// The whole run of one robot.
class Simulation {
 public:
  Simulation(const Simulator& sim, const ForwardRun& run, RowSink* sink, const RunState* from)
      : sim_(sim), run_(run), sink_(sink), from_(from) {}

  Result<RecordingPtr> operator()(Progress& progress) {
    RMP_TRY_ASSIGN(placed_, place_robot(sim_, run_, progress));
    axes_ = robotics::MakerAxes::for_messages(placed_.record);
    auto done = simulate(progress);
    if (!done.ok()) done = axes_->in_error(model(), std::move(done).error());
    if (!done.ok() && !done.error().where.starts_with(placed_.where))
      return std::move(done).error().in(placed_.where);
    return done;
  }

 private:
  [[nodiscard]] const RobotModel& model() const { return *placed_.model; }

  Result<void> find_reference(Progress& progress) {
    if (!run_.trajectory.empty()) {
      // The joints that put the tip on the path, and their rates, as the kinematic simulation has
      // them.
      RMP_TRY_ASSIGN(const WorldPath path, path_of(sim_, placed_, run_.trajectory));
      Run along{run_.world, run_.robot, run_.trajectory, 0, run_.tolerance};
      PartProgress part(progress, 0, 0.1);
      RMP_TRY_ASSIGN(const auto recording, sim_.inverse_kinematics(along, part));
      RMP_TRY_ASSIGN(auto reference, MotionReference::from_recording(model(), *recording));
      if (const recording::Column* c = recording->find(recording::kApproachColumn))
        approach_ = c->values;
      // The tool's path as seen from a base of a way of its own is not one that stands.
      if (!follows_own_base_) {
        RMP_TRY_ASSIGN(const Pose base, world_T_base(0));
        reference.follow(path.path, spatial::compose(spatial::inverse(base), path.world_T_path));
      }
      reference_ = std::move(reference);
    } else if (run_.recorded_q) {
      RMP_TRY_ASSIGN(reference_, MotionReference::from_recording(model(), *run_.recorded_q));
    } else if (run_.is_controlled) {
      const RunState::Robot* before = from_ ? from_->robot(placed_.title) : nullptr;
      std::vector<double> q = !run_.hold.empty() ? run_.hold
                              : before           ? before->start
                              : !run_.q.empty()  ? run_.q
                                                 : placed_.q;
      RMP_TRY(check_size("the configuration to hold", q.size(), model().coordinate_count()));
      RMP_TRY(close_held(q));
      reference_ = MotionReference(model(), std::move(q));
    }
    return {};
  }

  /// Joints without motors go to where those with one put them.
  Result<void> close_held(std::vector<double>& q) const {
    if (model().loops.empty()) return {};
    robotics::Closure c =
        robotics::close_loops(model(), q, q, robotics::actuated_velocities(model()));
    if (!c.is_closed)
      return error(ErrorCode::invalid_argument,
                   "loop " + text::quote(model().loops[c.worst_loop].name) + " is open by " +
                       text::print_rounded(c.residual, 3) +
                       " m or rad at the configuration to hold",
                   "Give joint values that close it, such as those of robot.close.");
    q = std::move(c.q);
    return {};
  }

  Result<void> base_by_expressions() {
    RMP_TRY_ASSIGN(base_, BasePath::by_expressions(*run_.base_motion, placed_.world_T_mounting, 0,
                                                   run_.duration > 0 ? run_.duration : duration_));
    return {};
  }

  Result<void> find_start() {
    MotionReference::Sample s;
    if (reference_) RMP_TRY(reference_->at(0, s));
    const bool follows = !run_.trajectory.empty() || run_.recorded_q;
    std::vector<double> q = !run_.q.empty() ? run_.q : follows ? s.q : placed_.q;
    std::vector<double> qd = !run_.qd.empty()            ? run_.qd
                             : follows && run_.q.empty() ? s.qd
                                                         : std::vector<double>(model().dof(), 0.0);
    RMP_TRY(check_size("q", q.size(), model().coordinate_count()));
    RMP_TRY(check_size("qd", qd.size(), model().dof()));
    if (!from_) {
      first_q_ = q;
    } else if (const RunState::Robot* before = from_->robot(placed_.title)) {
      RMP_TRY(check_fits(before->q.size(), q.size()));
      RMP_TRY(check_fits(before->qd.size(), qd.size()));
      start_ = from_->time;
      first_q_ = before->start;
      q = before->q, qd = before->qd;
    }
    x_ = std::move(q);
    x_.insert(x_.end(), qd.begin(), qd.end());
    return {};
  }

  [[nodiscard]] Result<void> check_size(const std::string& what, std::size_t is,
                                        std::size_t should) const {
    if (is == should) return {};
    return error(ErrorCode::invalid_argument,
                 what + " has " + std::to_string(is) + " numbers, but " + std::to_string(should) +
                     " are needed",
                 "Give one for each coordinate of q and each velocity of qd and tau.");
  }

  [[nodiscard]] Result<Pose> world_T_base(double t) const {
    Pose mounting = placed_.world_T_mounting;
    if (base_) {
      RMP_TRY_ASSIGN(mounting, base_->world_T_mounting(t));
    }
    return spatial::compose(mounting, model().base);
  }

  /// What acts at a tip; the way of the reference's tip where it depends on that.
  Result<void> find_load(MotionOptions& options) {
    if (!run_.load.is_given()) return {};
    RMP_TRY_ASSIGN(load_, BoundTipLoad::create(run_.load, model()));
    const bool has_path = reference_ && reference_->times().size() > 1;
    if (load_->uses_path() || (load_->takes_path() && has_path)) RMP_TRY(find_way());
    options.tip = load_->tip();
    options.wrench = [this](double t, std::span<const double> q) { return wrench_at(t, q); };
    return {};
  }

  /// What acts at the tip of the load, in the base's axes.
  Result<TipWrench> wrench_at(double t, std::span<const double> q) {
    RMP_TRY_ASSIGN(const TipWrench given, load_->at(t, way_at(t)));
    Pose base, tip;
    if (load_->axes() == LoadAxes::world) {
      RMP_TRY_ASSIGN(base, world_T_base(t));
    } else if (load_->axes() == LoadAxes::tool) {
      frames_.resize(model().joints.size());
      robotics::forward_kinematics(model(), q, frames_);
      tip = robotics::tip_pose(model(), static_cast<std::size_t>(load_->tip()), frames_);
    }
    return load_->in_base(given, base, model().base, tip);
  }

  /// What acted at the tip in each row, in the world's axes.
  Result<void> add_wrench_columns(Recording& out, const MotionTable& table) {
    if (!load_) return {};
    auto columns = wrench_columns(model().tips[static_cast<std::size_t>(load_->tip())].name);
    recording::Column path{"path", "m", "path length of the tip along the reference", {}};
    for (std::size_t i = 0; i < table.times().size(); ++i) {
      const double t = table.times()[i];
      RMP_TRY_ASSIGN(const TipWrench now, wrench_at(t, table.q(i)));
      RMP_TRY_ASSIGN(const Pose base, world_T_base(t));
      const Vec3 force = spatial::rotate(base, now.force),
                 moment = spatial::rotate(base, now.moment);
      for (std::size_t k = 0; k < 3; ++k) {
        columns[k].values.push_back(force[k]);
        columns[3 + k].values.push_back(moment[k]);
      }
      path.values.push_back(way_at(t));
    }
    for (recording::Column& c : columns) out.columns.push_back(std::move(c));
    if (way_.width == 1) out.columns.push_back(std::move(path));
    return {};
  }

  /// Way of the tip along the reference: its length at each of the reference's times.
  Result<void> find_way() {
    if (!reference_ || reference_->times().size() < 2)
      return error(ErrorCode::invalid_argument,
                   "a force over `path` is given, but the robot follows no path",
                   "Give a trajectory or a recording as reference, or a force over `time`.");
    const std::span<const double> times = reference_->times();
    std::vector<double> q, qd;
    std::vector<PathSample> base;
    MotionReference::Sample s;
    for (const double t : times) {
      RMP_TRY(reference_->at(t, s));
      q.insert(q.end(), s.q.begin(), s.q.end());
      qd.insert(qd.end(), s.qd.begin(), s.qd.end());
      PathSample& now = base.emplace_back();
      if (base_) {
        RMP_TRY_ASSIGN(now, base_->base(t, model().base));
      } else {
        RMP_TRY_ASSIGN(now.pose, world_T_base(t));
      }
    }
    way_.times.assign(times.begin(), times.end());
    way_.width = 1;
    way_.values = tip_way(model(), load_->tip(), times, q, qd, base, approach_).length;
    return {};
  }
  /// NaN where nobody asked for it.
  [[nodiscard]] double way_at(double t) const {
    double out = std::nan("");
    if (way_.width == 1) way_.at(t, std::span(&out, 1));
    return out;
  }

  Result<void> find_surroundings(MotionOptions& options) {
    options.friction = run_.friction;
    options.breakaway = run_.breakaway;
    options.at_limit = run_.at_limit;
    options.restitution = run_.restitution;
    if (base_)
      options.base = [this](double t) { return base_->felt(t, model().base, placed_.gravity); };
    RMP_TRY(find_load(options));
    if (run_.pulls) {
      pulls_.emplace(*run_.pulls);
      options.outside = [this](double t, std::span<const double> q, std::span<const double> qd,
                               std::span<double> tau) { return pull(t, q, qd, tau); };
    }
    if (run_.is_controlled) return {};
    if (run_.recorded_tau) {
      RMP_TRY_ASSIGN(torques_, timed_rows(*run_.recorded_tau, "tau", model().dof()));
      options.torques = [this](double t, std::span<double> tau) { torques_.at(t, tau); };
    } else if (!run_.tau.empty()) {
      RMP_TRY(check_size("tau", run_.tau.size(), model().dof()));
    }
    return {};
  }

  /// The robot's own choice; without one, for closed loops the first provider that knows them.
  [[nodiscard]] model::ProviderChoice forward_choice() const {
    model::ProviderChoice choice = placed_.record->forward_dynamics;
    if (!choice.name.empty() || model().loops.empty()) return choice;
    for (const ProviderInfo& p : sim_.registry.list(ForwardDynamics::kInterfaceId))
      if (p.enabled && std::find(p.tags.begin(), p.tags.end(), "loops") != p.tags.end()) {
        choice.name = p.name;
        break;
      }
    return choice;
  }

  Result<RecordingPtr> simulate(Progress& progress) {
    if (run_.is_controlled && (!run_.tau.empty() || run_.recorded_tau))
      return error(ErrorCode::invalid_argument, "it has both torques and a controller",
                   "Give one of them.");
    follows_own_base_ =
        run_.base_trajectory.empty() && !run_.base_motion && !placed_.base_trajectory.empty();
    const std::string& way = follows_own_base_ ? placed_.base_trajectory : run_.base_trajectory;
    if (!way.empty()) {
      if (run_.base_motion)
        return error(ErrorCode::invalid_argument,
                     "its mounting has both a trajectory and expressions", "Give one of them.");
      RMP_TRY_ASSIGN(WorldPath path, path_of(sim_, placed_, way));
      base_.emplace(std::move(path.path), path.world_T_path);
    } else if (run_.base_motion && run_.duration > 0) {
      RMP_TRY(base_by_expressions());
    }
    RMP_TRY(find_reference(progress));
    RMP_TRY(find_start());
    RMP_TRY_ASSIGN(const auto times, sample_times());
    if (run_.base_motion && !base_) RMP_TRY(base_by_expressions());
    MotionOptions options;
    options.whole = &progress;
    RMP_TRY(find_surroundings(options));
    RMP_TRY_ASSIGN(auto forward,
                   bind_forward_dynamics(sim_.registry, placed_.model, forward_choice()));
    if (is_long_chain(sim_.registry, model(), forward_choice())) accelerated_by_ = forward.provider;
    // Energies of the tree are those of the closed mechanism.
    RMP_TRY_ASSIGN(inverse_, bind_tree_dynamics(sim_.registry, placed_.model,
                                                placed_.record->inverse_dynamics));
    RMP_TRY_ASSIGN(integrator_, bind_integrator(sim_.registry, placed_.model, run_.integrator));
    if (run_.is_controlled) {
      const auto& choice =
          run_.controller.name.empty() ? placed_.record->controller : run_.controller;
      RMP_TRY_ASSIGN(controller_,
                     bind_controller(sim_.registry, placed_.model, placed_.record->inverse_dynamics,
                                     choice, progress));
    }
    MechanismMotion motion(std::move(forward), std::move(options));
    if (!run_.tau.empty()) motion.set_torques(run_.tau);
    motion.project(x_);
    if (!from_) motion.bring_to_rest(x_);
    if (const double open = motion.loop_error(std::span(x_).first(motion.positions()));
        open > kOpenLoop)
      return error(ErrorCode::invalid_argument,
                   "its loops cannot be closed from its initial configuration; " +
                       text::print_rounded(open, 3) + " m or rad remain open",
                   "Start from a configuration that closes them.");
    RMP_TRY(check_start(motion));
    if (pulls_ && pulls_->update(start_, pull_notes_)) find_pulled(start_);
    MotionTable table(motion, *axes_);
    Sampler sampler(motion, table, times, publisher(motion, progress));
    RMP_TRY(run_.is_controlled ? run_controlled(motion, table, sampler, progress)
                               : run_open(motion, table, sampler, progress));
    return record(motion, table, progress);
  }

  /// Hands every row on with the state there; null where nobody looks on.
  Sampler::Publish publisher(MechanismMotion& motion, Progress& progress) {
    if (!sink_) return {};
    return [this, &motion, &progress](double t, std::span<const double> x,
                                      const MechanismMotion::Forces& forces) -> Result<bool> {
      for (std::size_t i = 0; i < pulled_.size(); ++i)
        pulls_->report(i, pulled_[i].at, pulled_[i].size);
      MotionTable row(motion, *axes_);
      row.add(t, x, forces);
      Recording part = described();
      part.notes = pull_notes_;
      RMP_TRY(add_columns(part, row, true, progress));
      auto state = std::make_shared<RunState>();
      state->time = t;
      const auto middle = x.begin() + static_cast<std::ptrdiff_t>(motion.positions());
      state->robots.push_back(
          {placed_.title, first_q_, {x.begin(), middle}, {middle, x.end()}, memory_, {}});
      if (t >= duration_) sink_->end_with_next();
      RMP_TRY(sink_->take(part, 0, std::move(state)));
      // The run waited in take(), and what is pulled may have changed meanwhile.
      const bool is_other = pulls_ && pulls_->update(t, pull_notes_);
      if (is_other) find_pulled(t);
      return is_other;
    };
  }

  /// Finds the links that are pulled from t [s] on.
  void find_pulled(double t) {
    pulled_.clear();
    while (pulled_.size() < pulls_->all().size()) {
      const Pull& p = pulls_->all()[pulled_.size()];
      const bool is_own = p.object.empty() && (p.robot.empty() || p.robot == placed_.title);
      const auto link = is_own ? robotics::find_grip(*placed_.record, model(), p.link)
                               : std::optional<robotics::LinkFrame>();
      if (!link || link->joint < 0) {
        pulls_->drop(pulled_.size(), t, pull_notes_);
        continue;
      }
      Pulled& out = pulled_.emplace_back();
      double mass = 0;
      for (const JointModel& j : model().joints) mass += j.body.mass;
      out.spring = PullSpring(p, mass);
      const JointModel& joint = model().joints[index(link->joint)];
      const Vec3 point =
          p.point ? spatial::transform(link->joint_T_link, *p.point) : joint.body.com;
      // The pulled point as a tip, for its Jacobian.
      out.model = model();
      out.model.tips = {TipModel{"", link->joint, spatial::translation(point)}};
      out.jacobian.assign(6 * model().dof(), 0.0);
    }
  }

  /// Adds the pulls to forces on the joints. The damping counts velocities relative to the base.
  Result<void> pull(double t, std::span<const double> q, std::span<const double> qd,
                    std::span<double> tau) {
    if (pulled_.empty()) return {};
    RMP_TRY_ASSIGN(const Pose base, world_T_base(t));
    pull_frames_.resize(model().joints.size());
    robotics::forward_kinematics(model(), q, pull_frames_);
    for (std::size_t i = 0; i < pulled_.size(); ++i) {
      Pulled& p = pulled_[i];
      robotics::geometric_jacobian(p.model, 0, pull_frames_, robotics::JacobianFrame::base,
                                   p.jacobian);
      Vec3 velocity{};
      for (std::size_t v = 0; v < qd.size(); ++v)
        for (std::size_t k = 0; k < 3; ++k) velocity[k] += p.jacobian[6 * v + k] * qd[v];
      p.at = spatial::transform(base, robotics::tip_pose(p.model, 0, pull_frames_).p);
      const Vec3 force = p.spring.force(p.at, spatial::rotate(base, velocity), pulls_->all()[i].to);
      p.size = spatial::norm(force);
      const Vec3 in_base = spatial::rotate_back(base, force);
      for (std::size_t v = 0; v < tau.size(); ++v)
        for (std::size_t k = 0; k < 3; ++k) tau[v] += p.jacobian[6 * v + k] * in_base[k];
    }
    return {};
  }

  Result<void> check_start(const MechanismMotion& motion) const {
    if (run_.at_limit != AtLimit::stop || !motion.has_stops()) return {};
    for (const JointModel& joint : model().joints) {
      if (coordinate_count(joint.type) != 1) continue;
      const double q = spatial::joint_value(joint, x_.data());
      if (q >= joint.lower - 1e-9 && q <= joint.upper + 1e-9) continue;
      return error(
          ErrorCode::invalid_argument,
          (joint.is_coupled() ? std::string()
                              : axes_->before_place(index(joint.q_index),
                                                    std::span(x_).first(motion.positions()))) +
              "joint " + text::quote(joint.name) + " starts at " + text::print_rounded(q) +
              ", outside its limits",
          "Start within the limits, or give limits = \"report\".");
    }
    return {};
  }

  Result<std::vector<double>> sample_times() {
    duration_ = run_.duration > 0 ? run_.duration : reference_ ? reference_->duration() : 0;
    if (!(duration_ > 0))
      return error(ErrorCode::invalid_argument, "no duration of the simulation is given",
                   "Give a duration such as duration = 2.");
    if (!(run_.sample_time > 0) || duration_ / run_.sample_time > kMostSamples)
      return error(ErrorCode::invalid_argument,
                   "a sample time of " + text::print_rounded(run_.sample_time) +
                       " s does not fit " + text::print_rounded(duration_) + " s",
                   "Give a longer sample time.");
    std::vector<double> times;
    const auto count = static_cast<std::size_t>(duration_ / run_.sample_time + 1e-9);
    for (std::size_t i = 0; i <= count; ++i)
      times.push_back(std::min(static_cast<double>(i) * run_.sample_time, duration_));
    if (duration_ - times.back() > 1e-9 * run_.sample_time) times.push_back(duration_);
    times.back() = duration_;
    std::erase_if(times, [this](double t) { return t < start_; });
    if (times.empty()) times.push_back(start_ = duration_);
    return times;
  }

  Result<void> go(MechanismMotion& motion, Sampler& sampler, double start, double end, double step,
                  Progress& progress) {
    const auto due = sampler.due(end);
    std::vector<double> times(due.begin(), due.end());
    if (times.empty() || times.back() < end) times.push_back(end);
    OdeRun ode;
    ode.start = start, ode.end = end, ode.x0 = x_, ode.sample_times = times;
    ode.relative_tolerance = run_.relative_tolerance;
    ode.absolute_tolerance = run_.absolute_tolerance;
    ode.step = step;
    auto done = guarded(integrator_.provider,
                        [&] { return integrator_.solver->run(motion, ode, sampler, progress); });
    if (motion.failure()) return *motion.failure();
    if (sampler.failure) return *sampler.failure;
    if (!done.ok() && !sampler.is_interrupted) return std::move(done).error();
    if (!done.ok()) done = OdeStatistics{};
    statistics_.steps += done->steps, statistics_.rejected += done->rejected;
    statistics_.rates += done->rates, statistics_.events += done->events;
    statistics_.end = done->end;
    if (sampler.last.size() != x_.size() || (done->end != end && !sampler.is_interrupted))
      return error(ErrorCode::plugin_failed,
                   "provider " + text::quote(integrator_.provider) +
                       " ended at t = " + text::print_rounded(done->end) + " s instead of " +
                       text::print_rounded(end) + " s",
                   "Report it to the provider's author or choose another integrator.");
    x_ = sampler.last;
    return {};
  }

  /// go(), continued wherever the forces from outside change.
  Result<void> advance(MechanismMotion& motion, Sampler& sampler, double start, double end,
                       double step, Progress& progress) {
    RMP_TRY(go(motion, sampler, start, end, step, progress));
    while (std::exchange(sampler.is_interrupted, false)) {
      RMP_TRY(motion.settle(sampler.last_time, x_));
      if (sampler.last_time < end)
        RMP_TRY(go(motion, sampler, sampler.last_time, end, step, progress));
    }
    return {};
  }

  Result<void> run_open(MechanismMotion& motion, MotionTable& table, Sampler& sampler,
                        Progress& progress) {
    RMP_TRY(motion.settle(start_, x_));
    if (start_ < duration_)
      RMP_TRY(advance(motion, sampler, start_, duration_, run_.step, progress));
    else sampler.sample(start_, x_);
    if (sampler.failure) return *sampler.failure;
    for (std::size_t v = 0; v < model().dof(); ++v) {
      const double limit = table.limit_of(v);
      for (std::size_t i = 0; i < table.times().size(); ++i)
        table.cut(v, table.times()[i], std::isfinite(limit) && std::fabs(table.tau(i, v)) >= limit);
    }
    return {};
  }

  /// Torques are held from tick to tick, as a digital controller holds them.
  Result<void> run_controlled(MechanismMotion& motion, MotionTable& table, Sampler& sampler,
                              Progress& progress) {
    const double period = run_.control_period;
    if (!(period > 0) || duration_ / period > kMostTicks)
      return error(ErrorCode::invalid_argument,
                   "a control period of " + text::print_rounded(period) + " s does not fit",
                   "Give a period such as 0.001 s.");
    const std::size_t n = model().dof();
    std::vector<double> scratch(controller_.solver->scratch_size()), tau(n), cut(n);
    memory_.assign(controller_.solver->state_size(), 0.0);
    const RunState::Robot* before = from_ ? from_->robot(placed_.title) : nullptr;
    if (before && before->memory.size() == memory_.size()) memory_ = before->memory;
    MotionReference::Sample want;
    const auto ticks = static_cast<std::size_t>(std::ceil(duration_ / period - 1e-9));
    const auto first = static_cast<std::size_t>(start_ / period + 1e-9);
    for (std::size_t k = first; k < ticks; ++k) {
      const double t = k == first ? start_ : static_cast<double>(k) * period,
                   end = k + 1 == ticks ? duration_ : static_cast<double>(k + 1) * period;
      if (progress.cancelled())
        return error(ErrorCode::cancelled, "the simulation was cancelled", {},
                     "t = " + text::print_rounded(t) + " s");
      RMP_TRY(reference_->at(t, want));
      ControlInput in;
      in.time = t, in.dt = k == 0 ? 0 : period;
      in.q = std::span<const double>(x_).first(motion.positions());
      in.qd = std::span<const double>(x_).subspan(motion.positions());
      in.q_desired = want.q, in.qd_desired = want.qd, in.qdd_desired = want.qdd;
      if (want.has_tip) {
        in.tip_desired = &want.tip;
        in.tip_velocity_desired = want.tip_velocity;
        in.tip_acceleration_desired = want.tip_acceleration;
      }
      std::fill(tau.begin(), tau.end(), std::nan(""));
      auto done = guarded(controller_.provider,
                          [&] { return controller_.solver->torques(in, memory_, scratch, tau); });
      if (!done.ok()) return std::move(done).error().in("t = " + text::print_rounded(t) + " s");
      for (std::size_t v = 0; v < n; ++v) {
        if (!std::isfinite(tau[v]))
          return error(ErrorCode::plugin_failed,
                       "provider " + text::quote(controller_.provider) +
                           " returned a torque that is not a number",
                       "Lower the gains or shorten the control period; else report it to the "
                       "provider's author.",
                       "t = " + text::print_rounded(t) + " s");
        table.cut(v, t, std::fabs(tau[v]) > table.limit_of(v));
      }
      motion.set_torques(tau);
      RMP_TRY(motion.settle(t, x_));
      PartProgress part(progress, 0.1 + 0.9 * t / duration_, 0);
      RMP_TRY(advance(motion, sampler, t, end, std::min(run_.step, period), part));
    }
    if (first >= ticks) {
      RMP_TRY(motion.settle(start_, x_));
      sampler.sample(start_, x_);
      if (sampler.failure) return *sampler.failure;
    }
    for (std::size_t v = 0; v < n; ++v) table.cut(v, duration_, false);
    return {};
  }

  /// The recording without columns.
  [[nodiscard]] Recording described() const {
    Recording out;
    out.title = placed_.title + (run_.trajectory.empty() ? "" : " on " + run_.trajectory) +
                (run_.is_controlled ? ": motion under " + controller_.provider : ": motion");
    out.world = run_.world;
    out.robot = run_.world.number != 0 ? run_.robot : placed_.title;
    out.trajectory = run_.trajectory;
    out.dof = model().dof();
    out.base_moves = base_.has_value();
    return out;
  }

  Result<void> add_columns(Recording& out, const MotionTable& table, bool all_stops,
                           Progress& progress) {
    table.add_joint_columns(out, all_stops);
    RMP_TRY(table.add_energy_columns(out, inverse_, progress));
    RMP_TRY(table.add_tip_columns(out, [this](double t) { return world_T_base(t); }));
    RMP_TRY(add_wrench_columns(out, table));
    if (reference_) RMP_TRY(table.add_error_columns(out, *reference_));
    mark_limits(out, model());
    return {};
  }

  Result<RecordingPtr> record(MechanismMotion& motion, const MotionTable& table,
                              Progress& progress) {
    Recording out = described();
    RMP_TRY(add_columns(out, table, false, progress));
    out.notes = pull_notes_;
    table.add_notes(out, motion);
    if (load_) {
      const auto note = run_.load.is_over_path ? load_->note_on_cover(0, way_.values.back())
                                               : load_->note_on_cover(start_, duration_);
      if (note) out.notes.push_back(*note);
    }
    if (!accelerated_by_.empty())
      out.notes.push_back("accelerations by " + accelerated_by_ + ", since it has " +
                          std::to_string(model().dof()) + " velocities, " +
                          std::to_string(kLongChain) +
                          " or more, and no solver is chosen (forward_dynamics of the robot)");
    out.notes.push_back(
        "integrated by " + integrator_.provider + ": " + std::to_string(statistics_.steps) +
        " steps, " + std::to_string(statistics_.rejected) + " rejected, " +
        std::to_string(statistics_.rates) + " evaluations, " + std::to_string(statistics_.events) +
        " events, tolerance " + text::print_rounded(run_.relative_tolerance, 3) + " relative and " +
        text::print_rounded(run_.absolute_tolerance, 3) + " absolute" +
        (run_.loosened > 1 ? ", " + text::print_rounded(run_.loosened, 3) +
                                 " times the default ones, since the mechanism has " +
                                 std::to_string(model().dof()) + " velocities"
                           : std::string()));
    const double mean =
        (duration_ - start_) / static_cast<double>(std::max<std::int64_t>(1, statistics_.steps));
    // Of a fixed step it is the step that was given.
    if (model().dof() >= kLongChain && mean < 0.5 * run_.step)
      out.notes.push_back(
          "its steps were " + text::print_rounded(1e3 * mean, 3) +
          " ms on average: longer chains need more steps for the same tolerance; looser tolerances "
          "(relative_tolerance, absolute_tolerance) need fewer unless the motion is stiff");
    return std::make_shared<const Recording>(std::move(out));
  }

  const Simulator& sim_;
  const ForwardRun& run_;
  RowSink* sink_;
  const RunState* from_;
  Placed placed_;
  std::shared_ptr<const robotics::MakerAxes> axes_;
  std::optional<BasePath> base_;
  bool follows_own_base_ = false;  ///< that of the world, not one of the run
  std::optional<MotionReference> reference_;
  TimedRows torques_;
  std::optional<BoundTipLoad> load_;
  std::vector<Pose> frames_;      ///< scratch of wrench_at()
  TimedRows way_;                 ///< of the tip along the reference [m]; width 0 = nobody asks
  std::vector<double> approach_;  ///< 1 in rows of the reference that lead to the trajectory
  Bound<InverseDynamics> inverse_;
  Bound<Integrator> integrator_;
  Bound<Controller> controller_;
  std::string accelerated_by_;                ///< where the length of the chain chose the solver
  std::vector<double> x_, first_q_, memory_;  ///< the state; q at time 0; of the controller
  double start_ = 0, duration_ = 0;
  OdeStatistics statistics_;
  /// A link that is pulled.
  struct Pulled {
    RobotModel model;  ///< its only tip is the pulled point
    PullSpring spring;
    std::vector<double> jacobian;
    Vec3 at{};        ///< in the world, at the last evaluation [m]
    double size = 0;  ///< of the force there [N]
  };
  std::optional<PullsInForce> pulls_;
  std::vector<Pulled> pulled_;  ///< one per pull
  std::vector<Pose> pull_frames_;
  std::vector<std::string> pull_notes_;
};

template <class Solver, class Prepare>
Result<Bound<Solver>> bind_solver(const Registry& registry, std::shared_ptr<const RobotModel> model,
                                  const model::ProviderChoice& choice, Prepare&& prepare) {
  RMP_TRY_ASSIGN(const ProviderInfo info, registry.find(Solver::kInterfaceId, choice.name));
  RMP_TRY_ASSIGN(auto solver, registry.create<Solver>(info.name));
  RMP_TRY_ASSIGN(auto params,
                 motion::checked_params(info, choice, "provider " + text::quote(info.name)));
  RMP_TRY(guarded(info.name, [&] { return prepare(*solver, *params); }));
  return Bound<Solver>{std::move(model), std::move(solver), info.name};
}

}  // namespace

Result<Bound<Controller>> bind_controller(const Registry& registry,
                                          std::shared_ptr<const RobotModel> model,
                                          const model::ProviderChoice& dynamics,
                                          const model::ProviderChoice& choice,
                                          const Progress& run) {
  // What the controller is bound to lives as long as it does.
  struct Kept {
    std::shared_ptr<const RobotModel> seen;
    std::shared_ptr<const StoppableDynamics> asked;
    std::shared_ptr<Controller> controller;
  };
  const auto kept = std::make_shared<Kept>();
  const bool is_closed = !model->loops.empty();
  kept->seen = is_closed ? model_with_all_motors(*model) : model;
  RMP_TRY_ASSIGN(const auto tree, bind_tree_dynamics(registry, kept->seen, dynamics));
  kept->asked = std::make_shared<const StoppableDynamics>(tree.solver, run);
  auto bound =
      bind_solver<Controller>(registry, model, choice, [&](Controller& c, const Params& params) {
        return c.prepare(*kept->seen, *kept->asked, params);
      });
  if (!bound.ok()) return bound;
  kept->controller = std::move(bound->solver);
  if (is_closed) {
    RMP_TRY_ASSIGN(kept->controller, close_controller(std::move(model), kept->controller));
  }
  bound->solver = std::shared_ptr<Controller>(kept, kept->controller.get());
  return bound;
}
Result<Bound<Integrator>> bind_integrator(const Registry& registry,
                                          std::shared_ptr<const RobotModel> model,
                                          const model::ProviderChoice& choice) {
  return bind_solver<Integrator>(
      registry, std::move(model), choice,
      [](Integrator& i, const Params& params) { return i.prepare(params); });
}

double loosening(std::size_t velocities) {
  constexpr double kRounded = 1000;
  const double longer = static_cast<double>(velocities) / kRounded;
  return longer > 1 ? longer * longer : 1;
}

Result<RecordingPtr> forward_dynamics(const Simulator& simulator, const ForwardRun& run,
                                      Progress& progress, RowSink* sink, const RunState* from) {
  return Simulation(simulator, run, sink, from)(progress);
}

}  // namespace robomosp::sim
