// SPDX-License-Identifier: Apache-2.0
#include "sim/physics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "kernel/text.h"
#include "model/placement.h"
#include "motion/provider_params.h"
#include "robotics/build_model.h"
#include "robotics/coordinates.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "sim/collision.h"
#include "sim/collision_cache.h"
#include "sim/forward_simulation.h"
#include "sim/motion_reference.h"
#include "sim/physics_actor.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/principal.h"
#include "spatial/rotation.h"

namespace robomosp::sim {
namespace {

using document::ShapePiece;
using Kind = PhysicsAction::Kind;

constexpr double kMostSteps = 1e8;
constexpr double kMostNumbers = 2e8;  ///< in a recording
/// What a link weighs at least [kg], and the least principal moment as a share of the greatest and
/// for its mass (the square of 1 mm): engines need all of them above zero.
constexpr double kLeastMass = 1e-3, kLeastShare = 1e-4, kLeastGyration2 = 1e-6;
/// A motion that begins farther from where the robot is would be a jump [rad or m].
constexpr double kJump = 1e-4;

std::size_t index(std::int32_t i) { return static_cast<std::size_t>(i); }

/// With moments that an engine takes; tells whether something was changed.
bool make_inert(MassProperties& m) {
  bool changed = false;
  if (m.mass < kLeastMass) m.mass = kLeastMass, changed = true;
  const spatial::Principal p = spatial::principal(m.inertia);
  const double least = std::max(kLeastShare * p.moments[2], kLeastGyration2 * m.mass);
  if (p.moments[0] >= least) return changed;
  Pose axes;
  axes.R = p.axes;
  m.inertia =
      spatial::rotate(axes, Sym3{std::max(p.moments[0], least), std::max(p.moments[1], least),
                                 std::max(p.moments[2], least), 0, 0, 0});
  return true;
}

Result<void> check_surface(double friction, double restitution) {
  if (friction >= 0 && std::isfinite(friction) && restitution >= 0 && restitution <= 1) return {};
  return error(ErrorCode::invalid_argument, "its friction or restitution is out of range",
               "Friction is at least 0, restitution from 0 to 1.");
}

struct Thing {
  std::string name;
  std::int32_t body = 0;
  bool is_movable = false;
  std::array<double, 4> quaternion{};  ///< as last recorded
};

using Actor = PhysicsActor;

struct Event {
  double time = 0;
  std::int64_t tick = 0;
  std::size_t action = 0;
};
struct Held {
  std::int32_t attachment = 0, object = 0, link = 0;
  std::size_t actor = 0;
};

class Simulation {
 public:
  Simulation(const Simulator& sim, const PhysicsRun& run, RowSink* sink, const RunState* from)
      : sim_(sim), run_(run), sink_(sink), from_(from) {}

  Result<RecordingPtr> operator()(Progress& progress) {
    RMP_TRY(check_times());
    RMP_TRY(add_objects(progress));
    RMP_TRY(add_robots(progress));
    RMP_TRY(plan(progress));
    RMP_TRY(create());
    RMP_TRY(go(progress));
    return record();
  }

 private:
  // ---- what there is ----

  Result<void> check_times() {
    world_record_ = sim_.snapshot.get(run_.world);
    if (!world_record_)
      return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
    if (!(run_.step > 0) || !(run_.sample_time > 0) || !std::isfinite(run_.step) ||
        !std::isfinite(run_.sample_time))
      return error(ErrorCode::invalid_argument, "the step is not a positive time",
                   "Give a step such as 0.001 s.");
    RMP_TRY(check_surface(run_.friction, run_.restitution));
    const double every = std::max(1.0, std::round(run_.sample_time / run_.step));
    if (every > kMostSteps)
      return error(ErrorCode::invalid_argument, "the samples are too far apart",
                   "Give a shorter sample_time.");
    every_ = static_cast<std::int64_t>(every);
    return {};
  }

  template <class Member>
  [[nodiscard]] Result<std::size_t> find(const std::vector<Member>& all, std::string_view kind,
                                         const std::string& name) const {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (all[i].name == name) return i;
      names.push_back(all[i].name);
    }
    std::string hint = text::did_you_mean(name, names);
    if (hint.empty())
      hint =
          names.empty() ? "It has none; add one first." : "It has " + text::enumerate(names) + ".";
    return error(ErrorCode::unknown_name,
                 "the world has no " + std::string(kind) + " " + text::quote(name), hint);
  }

  /// A body with its shapes, which are kept as long as the world.
  PhysicsBody& add_body(std::vector<ShapePiece> pieces, const Pose& pose) {
    PhysicsBody& body = bodies_.emplace_back();
    for (const ShapePiece& p : pieces) body.shape.shapes.push_back(p.shape());
    pieces_.push_back(std::move(pieces));
    body.pose = pose;
    body.friction = run_.friction;
    body.restitution = run_.restitution;
    return body;
  }

  Result<void> add_objects(Progress& progress) {
    std::vector<PhysicsObjectSettings> settings(world_record_->objects.size());
    for (const PhysicsObjectSettings& s : run_.objects) {
      RMP_TRY_ASSIGN(const std::size_t i, find(world_record_->objects, "object", s.name));
      settings[i] = s;
    }
    for (std::size_t i = 0; i < settings.size(); ++i) {
      const model::PlacedObject& o = world_record_->objects[i];
      const PhysicsObjectSettings& s = settings[i];
      const std::string where = "object " + text::quote(o.name);
      RMP_TRY_ASSIGN(const auto shapes,
                     sim_.derived.shapes(sim_.snapshot, o.what, progress).in(where));
      PhysicsBody& body = add_body(*shapes, model::pose(o.placement));
      if (s.friction) body.friction = *s.friction;
      if (s.restitution) body.restitution = *s.restitution;
      RMP_TRY(check_surface(body.friction, body.restitution).in(where));
      if (!s.is_fixed) {
        RMP_TRY_ASSIGN(const auto mass,
                       sim_.derived.mass(sim_.snapshot, o.what, progress).in(where));
        if (mass.mass.mass > 0) {
          body.mass = mass.mass;
          if (make_inert(body.mass)) inert_.push_back(o.name);
        }
      }
      Thing thing{o.name, static_cast<std::int32_t>(bodies_.size()) - 1, body.mass.mass > 0};
      if (thing.is_movable) body.velocity = s.velocity, body.angular_velocity = s.angular_velocity;
      if (const RunState::Body* before = before_of(o.name)) {
        body.pose = before->pose;
        if (thing.is_movable)
          body.velocity = before->velocity, body.angular_velocity = before->angular_velocity;
        thing.quaternion = before->quaternion;
      }
      things_.push_back(std::move(thing));
    }
    return {};
  }

  /// Where an object that could move was before the world was edited.
  [[nodiscard]] const RunState::Body* before_of(const std::string& name) const {
    if (from_)
      for (const RunState::Body& b : from_->objects)
        if (b.name == name) return &b;
    return nullptr;
  }

  Result<void> add_robots(Progress& progress) {
    std::vector<PhysicsRobotSettings> settings(world_record_->robots.size());
    for (const PhysicsRobotSettings& s : run_.robots) {
      RMP_TRY_ASSIGN(const std::size_t i, find(world_record_->robots, "robot", s.name));
      settings[i] = s;
    }
    for (std::size_t i = 0; i < settings.size(); ++i) {
      Actor a;
      a.placed = &world_record_->robots[i];
      a.settings = settings[i];
      a.acts = a.settings.drive != RobotDrive::moved;
      const std::string where = "robot " + text::quote(a.placed->name);
      a.record = sim_.snapshot.get(a.placed->robot);
      if (!a.record)
        return error(ErrorCode::stale_handle, "the robot no longer exists", "Add it again.", where);
      const Pose mounting = model::pose(a.placed->placement);
      RMP_TRY_ASSIGN(
          a.model,
          sim_.derived
              .robot_model(sim_.snapshot, a.placed->robot,
                           spatial::rotate_back(mounting, world_record_->gravity), progress)
              .in(where));
      a.world_T_base = spatial::compose(mounting, a.model->base);
      a.q = a.placed->q;
      if (a.q.empty()) a.q = robotics::home_joint_values(*a.record);
      if (a.q.size() != a.model->coordinate_count()) a.q = robotics::neutral_coordinates(*a.record);
      a.qd.assign(a.model->dof(), 0.0), a.tau = a.qd;
      a.cut.assign(a.model->dof(), 0);
      const RunState::Robot* before = from_ ? from_->robot(a.placed->name) : nullptr;
      if (before) {
        RMP_TRY(check_fits(before->q.size(), a.q.size()).in(where));
        a.q = before->start;
      }
      a.way.emplace(a.model, a.q);
      RMP_TRY(a.way->start_at(a.q).in(where));
      a.now.resize(a.model->joints.size());
      a.next = a.now;
      if (a.settings.drive == RobotDrive::controlled) {
        const auto& choice =
            a.settings.controller.name.empty() ? a.record->controller : a.settings.controller;
        // What it asks of joints without motors is carried by the others through the loops.
        auto driven = a.model;
        if (!a.model->loops.empty()) {
          RobotModel all = *a.model;
          for (JointModel& j : all.joints) j.passive = false;
          driven = std::make_shared<const RobotModel>(std::move(all));
        }
        RMP_TRY_ASSIGN(a.inverse,
                       bind_inverse_dynamics(sim_.registry, driven, a.record->inverse_dynamics));
        RMP_TRY_ASSIGN(a.controller,
                       bind_controller(sim_.registry, driven, a.inverse, choice).in(where));
        a.memory.assign(a.controller.solver->memory_size(), 0.0);
        a.scratch.assign(a.controller.solver->scratch_size(), 0.0);
        if (before && before->memory.size() == a.memory.size()) a.memory = before->memory;
      }
      actors_.push_back(std::move(a));
    }
    return {};
  }

  // ---- what happens ----

  Result<void> plan(Progress& progress) {
    double end = 0;
    std::string robot = actors_.size() == 1 ? actors_[0].placed->name : std::string();
    for (std::size_t i = 0; i < run_.actions.size(); ++i) {
      const PhysicsAction& action = run_.actions[i];
      const double begin = action.time.value_or(end);
      if (!action.robot.empty()) robot = action.robot;
      auto planned = plan_one(action, i, begin, robot, progress);
      if (!planned.ok()) return std::move(planned).error().in("action " + std::to_string(i + 1));
      end = *planned;
      last_end_ = std::max(last_end_, end);
    }
    std::stable_sort(events_.begin(), events_.end(),
                     [](const Event& x, const Event& y) { return x.tick < y.tick; });
    duration_ = run_.duration > 0 ? run_.duration : last_end_;
    if (!(duration_ > 0) || duration_ / run_.step > kMostSteps)
      return error(ErrorCode::invalid_argument,
                   duration_ > 0
                       ? "the step is too short for " + text::print_rounded(duration_) + " s"
                       : std::string("how long to simulate is not said"),
                   "Give a duration such as duration = 2, and a step such as 0.001 s.");
    ticks_ = static_cast<std::int64_t>(std::ceil(duration_ / run_.step - 1e-9));
    if (from_)
      first_ =
          std::min(ticks_, static_cast<std::int64_t>(std::ceil(from_->time / run_.step - 1e-9)));
    std::erase_if(events_, [this](const Event& e) { return e.tick < first_; });
    return {};
  }

  /// When it ends.
  Result<double> plan_one(const PhysicsAction& action, std::size_t number, double begin,
                          const std::string& robot, Progress& progress) {
    if (!(begin >= 0) || !std::isfinite(begin) || !(action.duration >= 0) ||
        !std::isfinite(action.duration))
      return error(ErrorCode::invalid_argument, "its time or duration is not a time",
                   "Give times that are not negative.");
    if (action.kind == Kind::wait) return begin + action.duration;
    if (robot.empty())
      return error(ErrorCode::invalid_argument, "which robot acts is not said",
                   "Name it: robot = ...");
    std::vector<PlacedName> names;
    for (const Actor& a : actors_) names.push_back({a.placed->name});
    RMP_TRY_ASSIGN(const std::size_t who, find(names, "robot", robot));
    Actor& a = actors_[who];
    a.acts = true;
    if (action.kind == Kind::grip) {
      if (a.settings.drive == RobotDrive::limp) return is_limp(robot);
      if (!(action.speed >= 0) || !std::isfinite(action.speed))
        return error(ErrorCode::invalid_argument, "its speed is not a speed",
                     "Give a speed above 0, or leave it out.");
      RMP_TRY_ASSIGN(grip_of_[number], a.grip_of(action.joint, action.force, action.speed));
    }
    if (action.kind != Kind::move) {
      if (!action.object.empty()) {
        RMP_TRY_ASSIGN(const std::size_t what, find(things_, "object", action.object));
        if (!things_[what].is_movable)
          return error(ErrorCode::invalid_argument,
                       text::quote(action.object) + " cannot move: it is fixed or has no mass",
                       "Give its solids a material, or take it off the fixed objects.");
      }
      if (action.kind == Kind::grasp) RMP_TRY(tip_of(a, action.tool));
      const auto tick = static_cast<std::int64_t>(std::ceil(begin / run_.step - 1e-9));
      events_.push_back({begin, tick, number});
      actor_of_[number] = who;
      return begin + action.duration;
    }
    if (a.settings.drive == RobotDrive::limp) return is_limp(robot);
    if (begin < a.way->end() - 1e-9)
      return error(ErrorCode::invalid_argument,
                   "it begins at " + text::print_rounded(begin) + " s, before robot " +
                       text::quote(robot) + " has ended its move at " +
                       text::print_rounded(a.way->end()) + " s",
                   "Begin later, or leave the time out.");
    return plan_move(a, action, begin, progress);
  }

  static Error is_limp(const std::string& robot) {
    return error(ErrorCode::invalid_argument,
                 "robot " + text::quote(robot) + " is limp, so it does not follow a motion",
                 "Let it be moved or controlled.");
  }

  struct PlacedName {
    std::string name;
  };

  Result<double> plan_move(Actor& a, const PhysicsAction& action, double begin,
                           Progress& progress) {
    const int given = static_cast<int>(!action.q.empty()) + static_cast<int>(!!action.recorded) +
                      static_cast<int>(!action.trajectory.empty());
    if (given != 1)
      return error(ErrorCode::invalid_argument,
                   given == 0 ? "where the robot moves is not said"
                              : "it has more than one of q, recording and trajectory",
                   "Give one of q, recording and trajectory.");
    if (!action.q.empty()) {
      if (action.q.size() != a.model->coordinate_count())
        return error(ErrorCode::invalid_argument,
                     "q has " + std::to_string(action.q.size()) + " numbers, but " +
                         std::to_string(a.model->coordinate_count()) + " are needed",
                     "Give one for each coordinate.");
      if (a.model->dof() != a.model->coordinate_count())
        return error(ErrorCode::unsupported,
                     "robots with spherical or free joints move along recordings only",
                     "Give a recording.");
      for (const double x : action.q)
        if (!std::isfinite(x))
          return error(ErrorCode::invalid_argument, "q holds a number that is not finite",
                       "Correct it.");
      const double duration = action.duration > 0 ? action.duration : least_duration(a, action.q);
      if (!std::isfinite(duration))
        return error(ErrorCode::invalid_argument,
                     "how long the move takes is not said, and not all joints have a greatest "
                     "velocity",
                     "Give its duration.");
      if (duration > 0) RMP_TRY(a.way->add(begin, duration, action.q));
      return begin + duration;
    }
    RecordingPtr recorded = action.recorded;
    if (!action.trajectory.empty()) {
      Run along{run_.world, a.placed->name, action.trajectory, 0, {}};
      RMP_TRY_ASSIGN(recorded, sim_.inverse_kinematics(along, progress));
    }
    RMP_TRY_ASSIGN(auto motion, MotionReference::from_recording(*a.model, *recorded));
    MotionReference::Sample s;
    motion.at(0, s);
    if (a.way->is_empty() && begin == 0) {
      a.q = s.q;
      RMP_TRY(a.way->start_at(s.q));
    }
    double jump = 0;
    for (std::size_t i = 0; i < s.q.size(); ++i)
      jump = std::max(jump, std::fabs(s.q[i] - a.way->last()[i]));
    if (jump > kJump)
      return error(ErrorCode::invalid_argument,
                   "the motion begins " + text::print_rounded(jump, 3) +
                       " rad or m away from where the robot is then",
                   "Move there first, or place the robot there.");
    a.way->add(begin, std::move(motion));
    return a.way->end() + action.duration;
  }

  /// The quintic's greatest velocity is 15/8 of the mean one.
  static double least_duration(const Actor& a, std::span<const double> to) {
    double most = 0;
    for (const JointModel& joint : a.model->joints) {
      if (joint.is_coupled()) continue;
      const std::size_t i = index(joint.q_index);
      const double way = std::fabs(to[i] - a.way->last()[i]);
      if (way == 0) continue;
      most = std::max(most, std::isfinite(joint.max_velocity)
                                ? 1.875 * way / joint.max_velocity
                                : std::numeric_limits<double>::infinity());
    }
    return most;
  }

  [[nodiscard]] static Result<std::int32_t> tip_of(const Actor& a, const std::string& tool) {
    std::vector<std::string> names;
    for (const TipModel& tip : a.model->tips) {
      if (tool.empty() || tip.name == tool) return a.base_body + 1 + tip.joint;
      names.push_back(tip.name);
    }
    return error(ErrorCode::unknown_name,
                 "robot " + text::quote(a.placed->name) + " has no tool " + text::quote(tool),
                 "It has " + text::enumerate(names) + ".");
  }

  // ---- the engine's world ----

  Result<void> create() {
    NoProgress none;
    for (std::size_t i = 0; i < actors_.size(); ++i) RMP_TRY(add_bodies(actors_[i], i, none));
    velocities_.resize(bodies_.size()), angular_velocities_.resize(bodies_.size());
    RMP_TRY_ASSIGN(const ProviderInfo info,
                   sim_.registry.find(PhysicsEngine::kInterfaceId, run_.engine.name));
    RMP_TRY_ASSIGN(const auto engine, sim_.registry.create<PhysicsEngine>(info.name));
    RMP_TRY_ASSIGN(const auto params,
                   motion::checked_params(info, run_.engine, "provider " + text::quote(info.name)));
    provider_ = info.name;
    poses_.resize(bodies_.size());
    joint_q_.resize(joints_.size()), joint_qd_ = joint_q_, forces_ = joint_q_;
    // An engine tells angles within a turn: what is missing is seen in a first world and taken off
    // the limits of the second.
    for (int attempt = 0; attempt < 2; ++attempt) {
      std::vector<PhysicsJoint> joints = joints_;
      for (const Actor& a : actors_) a.take_turns_off(joints);
      auto made = guarded(info.name, [&] {
        return engine->create(bodies_, joints, world_record_->gravity, *params);
      });
      if (!made.ok()) return std::move(made).error();
      if (!*made)
        return error(ErrorCode::plugin_failed,
                     "provider " + text::quote(info.name) + " made no world",
                     "Report it to the provider's author or choose another provider.");
      world_ = std::move(*made);
      read();
      bool is_right = true;
      for (Actor& a : actors_) is_right = a.find_turns(joint_q_) && is_right;
      if (is_right) break;
    }
    read();
    RMP_TRY(hold_again());
    for (const Actor& a : actors_)
      if (a.settings.self_contact) RMP_TRY(pass_over(a, none));
    return {};
  }

  /// What was held before the world was edited, as far as it is still there.
  Result<void> hold_again() {
    if (!from_) return {};
    for (const RunState::Held& h : from_->held) {
      const auto thing = std::find_if(things_.begin(), things_.end(), [&](const Thing& t) {
        return t.name == h.object && t.is_movable;
      });
      for (std::size_t who = 0; who < actors_.size() && thing != things_.end(); ++who) {
        const Actor& a = actors_[who];
        for (std::size_t j = 0; a.placed->name == h.robot && j < a.model->joints.size(); ++j) {
          if (a.model->joints[j].name != h.joint) continue;
          const std::int32_t link = a.base_body + 1 + static_cast<std::int32_t>(j);
          RMP_TRY_ASSIGN(const std::int32_t number,
                         guarded(provider_, [&] { return world_->attach(link, thing->body); }));
          held_.push_back({number, thing->body, link, who});
        }
      }
    }
    return {};
  }

  /// Pairs of links that collision checks pass over do not touch.
  Result<void> pass_over(const Actor& a, Progress& progress) {
    RMP_TRY_ASSIGN(const auto collision, collision_model(sim_, AnyId(a.placed->robot), progress)
                                             .in("robot " + text::quote(a.placed->name)));
    const auto body = [&](std::int32_t b) {
      return a.base_body + 1 + collision->bodies()[index(b)].joint;
    };
    for (const PassedPair& p : collision->passed()) {
      const std::int32_t first = body(p.pair.a), second = body(p.pair.b);
      if (first != second)
        RMP_TRY(guarded(provider_, [&] { return world_->ignore(first, second); }));
    }
    return {};
  }

  Result<void> add_bodies(Actor& a, std::size_t number, Progress& progress) {
    const std::string where = "robot " + text::quote(a.placed->name);
    RMP_TRY_ASSIGN(auto shapes,
                   sim_.derived.robot_shapes(sim_.snapshot, a.placed->robot, progress).in(where));
    const auto frames = robotics::link_frames(*a.record);
    std::vector<std::vector<ShapePiece>> of_body(a.model->joints.size() + 1);
    for (std::size_t b = 0; b < shapes.size(); ++b) {
      const auto joint = b == 0 ? -1 : frames[b - 1].joint;
      for (ShapePiece& p : shapes[b]) {
        if (b > 0) p.pose = spatial::compose(frames[b - 1].joint_T_link, p.pose);
        of_body[index(joint + 1)].push_back(std::move(p));
      }
    }
    MotionReference::Sample start;
    a.way->at(time_of(first_), start);
    a.q = start.q;
    RMP_TRY(a.choose_dynamic());
    std::vector<Vec3> linear(a.now.size()), angular(a.now.size());
    if (const RunState::Robot* before = from_ ? from_->robot(a.placed->name) : nullptr) {
      carry_over(a, *before, start);
      robotics::forward_kinematics(*a.model, a.q, a.now);
      a.body_velocities(linear, angular);
    } else {
      robotics::forward_kinematics(*a.model, a.q, a.now);
    }
    a.begin = a.q;
    a.base_body = static_cast<std::int32_t>(bodies_.size());
    for (std::size_t b = 0; b < of_body.size(); ++b) {
      const Pose at = b == 0 ? a.world_T_base : spatial::compose(a.world_T_base, a.now[b - 1]);
      PhysicsBody& body = add_body(std::move(of_body[b]), at);
      body.group = static_cast<std::uint32_t>(number + 1);
      if (a.settings.friction) body.friction = *a.settings.friction;
      if (a.settings.restitution) body.restitution = *a.settings.restitution;
      RMP_TRY(check_surface(body.friction, body.restitution).in(where));
      body.self = a.settings.self_contact;
      if (b == 0 || !a.is_dynamic[b - 1]) continue;
      const JointModel& joint = a.model->joints[b - 1];
      body.velocity = linear[b - 1], body.angular_velocity = angular[b - 1];
      body.mass = joint.body;
      if (make_inert(body.mass)) inert_.push_back(a.placed->name + "." + joint.name);
    }
    a.add_joints(joints_);
    return {};
  }

  /// Joints that the engine moves are where they were before the world was edited, the others
  /// where their way is.
  static void carry_over(Actor& a, const RunState::Robot& before,
                         const MotionReference::Sample& way) {
    a.qd = way.qd;
    for (std::size_t j = 0; j < a.model->joints.size(); ++j) {
      const JointModel& m = a.model->joints[j];
      if (!a.is_dynamic[j] || m.is_coupled()) continue;
      for (std::int32_t k = 0; k < coordinate_count(m.type); ++k)
        a.q[index(m.q_index + k)] = before.q[index(m.q_index + k)];
      for (std::int32_t k = 0; k < velocity_count(m.type); ++k)
        a.qd[index(m.v_index + k)] = before.qd[index(m.v_index + k)];
    }
    for (const RunState::Grip& g : before.grips)
      for (PhysicsGrip& grip : a.grips)
        if (a.model->joints[grip.joint].name == g.joint)
          grip.is_on = true, grip.force = g.force, grip.speed = g.speed;
  }

  // ---- the run ----

  void read() {
    world_->read({poses_, velocities_, angular_velocities_, joint_q_, joint_qd_});
    for (Actor& a : actors_) a.read(poses_, velocities_, angular_velocities_, joint_q_, joint_qd_);
  }

  [[nodiscard]] double time_of(std::int64_t tick) const {
    return std::min(static_cast<double>(tick) * run_.step, duration_);
  }

  Result<void> go(Progress& progress) {
    prepare_columns();
    RMP_TRY(sample(time_of(first_)));
    std::size_t next_event = 0;
    for (std::int64_t tick = first_; tick < ticks_; ++tick) {
      const double t = time_of(tick), end = time_of(tick + 1);
      if (tick % 64 == 0) {
        progress.report(t / duration_, "contact physics");
        if (progress.cancelled())
          return error(ErrorCode::cancelled, "the simulation was stopped", {},
                       "t = " + text::print_rounded(t) + " s");
      }
      for (; next_event < events_.size() && events_[next_event].tick <= tick; ++next_event)
        RMP_TRY(act(events_[next_event])
                    .in("action " + std::to_string(events_[next_event].action + 1))
                    .in("t = " + text::print_rounded(t) + " s"));
      for (Actor& a : actors_) {
        const std::string at = "t = " + text::print_rounded(t) + " s";
        RMP_TRY(a.drive(t, end, run_.step, provider_, *world_, poses_, forces_, wanted_).in(at));
        if (!a.is_driven()) RMP_TRY(a.move(t, end, provider_, *world_, wanted_).in(at));
      }
      auto done = guarded(provider_, [&] { return world_->step(end - t, 1, forces_, progress); });
      if (!done.ok()) return std::move(done).error().in("t = " + text::print_rounded(t) + " s");
      RMP_TRY(guarded(provider_, [&]() -> Result<void> {
        world_->contacts(contacts_);
        return {};
      }));
      read();
      if ((tick + 1) % every_ == 0 || tick + 1 == ticks_) RMP_TRY(sample(end));
    }
    // What happens at the very end changes nothing that is recorded.
    for (; next_event < events_.size() && events_[next_event].tick <= ticks_; ++next_event)
      RMP_TRY(
          act(events_[next_event]).in("action " + std::to_string(events_[next_event].action + 1)));
    return {};
  }

  Result<void> act(const Event& event) {
    const PhysicsAction& action = run_.actions[event.action];
    const std::size_t who = actor_of_.at(event.action);
    Actor& a = actors_[who];
    if (action.kind == Kind::grip) {
      PhysicsGrip& grip = a.grips[grip_of_.at(event.action)];
      grip.is_on = true;
      grip.force = action.force;
      if (action.speed > 0) grip.speed = action.speed;
      return {};
    }
    std::int32_t named = -1;
    for (const Thing& thing : things_)
      if (!action.object.empty() && thing.name == action.object) named = thing.body;
    if (action.kind == Kind::release) {
      std::size_t count = 0;
      for (PhysicsGrip& grip : a.grips)
        if (action.object.empty() && grip.is_on) grip.is_on = false, ++count;
      for (std::size_t i = held_.size(); i-- > 0;) {
        if (held_[i].actor != who || (named >= 0 && held_[i].object != named)) continue;
        RMP_TRY(guarded(provider_, [&] { return world_->release(held_[i].attachment); }));
        held_.erase(held_.begin() + static_cast<std::ptrdiff_t>(i));
        ++count;
      }
      if (count > 0) return {};
      return error(ErrorCode::invalid_argument,
                   "robot " + text::quote(a.placed->name) + " does not hold " +
                       (named >= 0 ? text::quote(action.object) : std::string("anything")),
                   "Grasp or grip before you release.");
    }
    RMP_TRY_ASSIGN(const std::int32_t link, tip_of(a, action.tool));
    std::vector<std::int32_t> touched;
    for (const PhysicsContact& c : contacts_) {
      if (c.a != link && c.b != link) continue;
      const std::int32_t other = c.a == link ? c.b : c.a;
      if (index(other) < things_.size() && things_[index(other)].is_movable)
        touched.push_back(other);
    }
    std::sort(touched.begin(), touched.end());
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    if (named >= 0) {
      if (!std::binary_search(touched.begin(), touched.end(), named))
        out_.notes.push_back(text::quote(action.object) + " was grasped at " +
                             text::print_rounded(event.time) + " s though the tool of " +
                             text::quote(a.placed->name) + " did not touch it");
      touched = {named};
    }
    std::erase_if(touched, [&](std::int32_t body) {
      return std::any_of(held_.begin(), held_.end(),
                         [&](const Held& h) { return h.actor == who && h.object == body; });
    });
    if (touched.empty())
      return error(
          ErrorCode::invalid_argument,
          "the tool of robot " + text::quote(a.placed->name) + " touches no object that can move",
          "Move it against the object (0.2 mm into it, say), or name the object.");
    for (const std::int32_t body : touched) {
      RMP_TRY_ASSIGN(const std::int32_t number,
                     guarded(provider_, [&] { return world_->attach(link, body); }));
      held_.push_back({number, body, link, who});
      out_.notes.push_back(text::quote(a.placed->name) + " grasped " +
                           text::quote(things_[index(body)].name) + " at " +
                           text::print_rounded(event.time) + " s");
    }
    return {};
  }

  // ---- the recording ----

  std::size_t add_column(std::string name, std::string unit, std::string doc) {
    out_.columns.push_back({std::move(name), std::move(unit), std::move(doc), {}});
    return out_.columns.size() - 1;
  }

  void prepare_columns() {
    out_.world = run_.world;
    out_.title = sim_.snapshot.find(AnyId(run_.world))->name + ": contact physics";
    if (!inert_.empty())
      out_.notes.push_back(text::enumerate(inert_) + (inert_.size() == 1 ? " has" : " have") +
                           " no mass or no inertia about some axis and got the least that the "
                           "engine takes");
    add_column("time", "s", "time");
    const auto first =
        std::find_if(actors_.begin(), actors_.end(), [](const Actor& a) { return a.acts; });
    const Actor* main = first != actors_.end() ? &*first : actors_.empty() ? nullptr : &actors_[0];
    if (main) {
      out_.robot = main->placed->name;
      out_.dof = main->model->dof();
      add_robot_columns(*main, "");
    }
    for (const Actor& a : actors_)
      if (&a != main) add_robot_columns(a, a.placed->name + ".");
    for (const Thing& thing : things_) {
      if (!thing.is_movable) continue;
      for (const char* axis : {"x", "y", "z"})
        add_column(thing.name + "." + axis, "m", std::string(axis) + " of " + thing.name);
      for (const char* part : {"qw", "qx", "qy", "qz"})
        add_column(thing.name + "." + part, "", "quaternion of " + thing.name);
      add_column(thing.name + ".contact_force", "N", "size of all contact forces on " + thing.name);
    }
    add_column("contacts", "", "points of contact");
    add_column("contact_force", "N", "sum of the sizes of the contact forces");
  }

  void add_robot_columns(const Actor& a, const std::string& prefix) {
    recorded_.push_back(&a);
    std::vector<const JointModel*> of_q(a.model->coordinate_count()), of_v(a.model->dof());
    for (const JointModel& j : a.model->joints) {
      if (j.is_coupled()) continue;
      for (std::int32_t k = 0; k < coordinate_count(j.type); ++k) of_q[index(j.q_index + k)] = &j;
      for (std::int32_t k = 0; k < velocity_count(j.type); ++k) of_v[index(j.v_index + k)] = &j;
    }
    const auto slides = [](const JointModel* j) { return j->type == JointType::prismatic; };
    for (std::size_t i = 0; i < of_q.size(); ++i)
      add_column(prefix + "q" + std::to_string(i + 1),
                 coordinate_count(of_q[i]->type) > 1 ? ""
                 : slides(of_q[i])                   ? "m"
                                                     : "rad",
                 "position of joint " + of_q[i]->name);
    for (std::size_t i = 0; i < of_v.size(); ++i)
      add_column(prefix + "qd" + std::to_string(i + 1), slides(of_v[i]) ? "m/s" : "rad/s",
                 "velocity of joint " + of_v[i]->name);
    if (a.settings.drive == RobotDrive::moved) return;
    for (std::size_t i = 0; i < of_v.size(); ++i)
      add_column(prefix + "tau" + std::to_string(i + 1), slides(of_v[i]) ? "N" : "N m",
                 "force of the motor of joint " + of_v[i]->name);
  }

  Result<void> sample(double t) {
    std::size_t c = 0;
    const auto put = [&](double x) { out_.columns[c++].values.push_back(x); };
    if (static_cast<double>(out_.rows() + 1) * static_cast<double>(out_.columns.size()) >
        kMostNumbers)
      return error(ErrorCode::invalid_argument, "the recording becomes too long",
                   "Give a longer sample_time.");
    put(t);
    for (const Actor* a : recorded_) {
      for (const double x : a->q) put(x);
      for (const double x : a->qd) put(x);
      if (a->settings.drive != RobotDrive::moved)
        for (const double x : a->tau) put(x);
    }
    std::vector<Vec3> force(bodies_.size());
    double sum = 0;
    for (const PhysicsContact& contact : contacts_) {
      if (contact.a < 0 || contact.b < 0 || index(contact.a) >= force.size() ||
          index(contact.b) >= force.size())
        continue;
      force[index(contact.a)] = spatial::add(force[index(contact.a)], contact.force);
      force[index(contact.b)] = spatial::sub(force[index(contact.b)], contact.force);
      sum += spatial::norm(contact.force);
    }
    for (Thing& thing : things_) {
      if (!thing.is_movable) continue;
      const Pose& pose = poses_[index(thing.body)];
      const auto [w, x, y, z] = spatial::to_quaternion(pose.R);
      std::array<double, 4> quaternion{w, x, y, z};
      // q and -q are one rotation: the one nearer to the row before is written.
      double same = 0;
      for (std::size_t k = 0; k < 4; ++k) same += quaternion[k] * thing.quaternion[k];
      for (double& p : quaternion) p = same < 0 ? -p : p;
      thing.quaternion = quaternion;
      for (const double p : pose.p) put(p);
      for (const double p : quaternion) put(p);
      put(spatial::norm(force[index(thing.body)]));
    }
    put(static_cast<double>(contacts_.size()));
    put(sum);
    for (const Column& column : out_.columns)
      if (!std::isfinite(column.values.back()))
        return error(
            ErrorCode::plugin_failed,
            "provider " + text::quote(provider_) + " returned a state that is not a number",
            "Use a shorter step; else report it to the provider's author.",
            "t = " + text::print_rounded(t) + " s");
    return sink_ ? sink_->take(out_, out_.rows() - 1, state(t)) : Result<void>();
  }

  /// What a run needs to go on from here.
  [[nodiscard]] RunStatePtr state(double t) const {
    auto s = std::make_shared<RunState>();
    s->time = t;
    for (const Thing& thing : things_) {
      const std::size_t b = index(thing.body);
      if (thing.is_movable)
        s->objects.push_back(
            {thing.name, poses_[b], velocities_[b], angular_velocities_[b], thing.quaternion});
    }
    for (const Actor& a : actors_) {
      RunState::Robot r{a.placed->name, a.way->start(), a.q, a.qd, a.memory, {}};
      for (const PhysicsGrip& g : a.grips)
        if (g.is_on) r.grips.push_back({a.model->joints[g.joint].name, g.force, g.speed});
      s->robots.push_back(std::move(r));
    }
    for (const Held& h : held_) {
      const Actor& a = actors_[h.actor];
      const std::int32_t joint = h.link - a.base_body - 1;
      if (joint >= 0)
        s->held.push_back(
            {a.placed->name, a.model->joints[index(joint)].name, things_[index(h.object)].name});
    }
    return s;
  }

  /// Name of the joint that an entry of tau belongs to.
  static std::string name_of_entry(const Actor& a, std::size_t entry) {
    for (const JointModel& j : a.model->joints)
      if (!j.is_coupled() && index(j.v_index) == entry) return j.name;
    return {};
  }

  Result<RecordingPtr> record() {
    for (const Actor& a : actors_)
      for (std::size_t j = 0; j < a.cut.size(); ++j)
        if (a.cut[j] > 0)
          out_.notes.push_back("the torque of joint " + text::quote(name_of_entry(a, j)) + " of " +
                               text::quote(a.placed->name) + " was cut in " +
                               std::to_string(a.cut[j]) + " of " + std::to_string(ticks_) +
                               " steps");
    return std::make_shared<const Recording>(std::move(out_));
  }

  const Simulator& sim_;
  const PhysicsRun& run_;
  RowSink* sink_;
  const RunState* from_;
  const model::World* world_record_ = nullptr;
  std::vector<PhysicsBody> bodies_;
  std::vector<std::vector<ShapePiece>> pieces_;  ///< keeps the meshes
  std::vector<PhysicsJoint> joints_;
  std::vector<Thing> things_;  ///< thing i is body i
  std::vector<Actor> actors_;
  std::vector<Event> events_;
  std::map<std::size_t, std::size_t> actor_of_;  ///< of grasps, grips and releases
  std::map<std::size_t, std::size_t> grip_of_;   ///< of grips, in their actor
  std::vector<Held> held_;
  double last_end_ = 0, duration_ = 0;
  std::int64_t first_ = 0, ticks_ = 0, every_ = 1;
  std::string provider_;
  std::unique_ptr<PhysicsWorld> world_;
  std::vector<Pose> poses_;
  std::vector<Vec3> velocities_, angular_velocities_;
  std::vector<double> joint_q_, joint_qd_, forces_;
  std::vector<PhysicsContact> contacts_;
  MotionReference::Sample wanted_;
  std::vector<const Actor*> recorded_;
  std::vector<std::string> inert_;
  Recording out_;
};

}  // namespace

Result<RecordingPtr> simulate_physics(const Simulator& simulator, const PhysicsRun& run,
                                      Progress& progress, RowSink* sink, const RunState* from) {
  Simulation simulation(simulator, run, sink, from);
  auto done = simulation(progress);
  if (!done.ok() && simulator.snapshot.get(run.world))
    return std::move(done).error().in(simulator.snapshot.describe(AnyId(run.world)));
  return done;
}

}  // namespace robomosp::sim
