// SPDX-License-Identifier: Apache-2.0
// What a run of contact physics consists of: bodies, joints, controllers, the engine's world.
#include <algorithm>
#include <cmath>
#include <utility>

#include "collision/cache.h"
#include "collision/collision.h"
#include "model/placement.h"
#include "motion/provider_params.h"
#include "robotics/build_model.h"
#include "robotics/coordinates.h"
#include "robotics/grip.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "robotics/link_geometry.h"
#include "sim/forward_simulation.h"
#include "sim/physics_simulation.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/principal.h"

namespace robomosp::sim {
namespace {

using collision::collision_model;
using collision::PassedPair;

constexpr double kMostPhysicsSteps = 1e8;  ///< between samples
/// What a link weighs at least [kg], and the least principal moment as a share of the greatest and
/// for its mass (the square of 1 mm): engines need all of them above zero.
constexpr double kLeastMass = 1e-3, kLeastShare = 1e-4, kLeastGyration2 = 1e-6;

/// With moments that an engine takes; says whether something was changed.
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
               "Friction must be at least 0, restitution from 0 to 1.");
}

}  // namespace

Result<void> PhysicsSimulation::check_times() {
  world_record_ = sim_.snapshot.get(run_.world);
  if (!world_record_)
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  if (!(run_.step > 0) || !(run_.sample_time > 0) || !std::isfinite(run_.step) ||
      !std::isfinite(run_.sample_time))
    return error(ErrorCode::invalid_argument, "the step is not a positive time",
                 "Give a step such as 0.001 s.");
  RMP_TRY(check_surface(run_.friction, run_.restitution));
  const double every = std::max(1.0, std::round(run_.sample_time / run_.step));
  if (every > kMostPhysicsSteps)
    return error(ErrorCode::invalid_argument, "the samples are too far apart",
                 "Give a shorter sample_time.");
  every_ = static_cast<std::int64_t>(every);
  return {};
}

PhysicsBody& PhysicsSimulation::add_body(std::vector<ShapePiece> pieces, const Pose& pose) {
  PhysicsBody& body = bodies_.emplace_back();
  for (const ShapePiece& p : pieces) body.shape.shapes.push_back(p.shape());
  pieces_.push_back(std::move(pieces));
  body.pose = pose;
  body.friction = run_.friction;
  body.restitution = run_.restitution;
  return body;
}

Result<void> PhysicsSimulation::add_objects(Progress& progress) {
  std::vector<PhysicsObjectSettings> settings(world_record_->objects.size());
  if (!run_.objects.empty()) {
    std::unordered_map<std::string_view, std::size_t> numbers;
    for (std::size_t i = 0; i < settings.size(); ++i)
      numbers.try_emplace(world_record_->objects[i].name, i);
    for (const PhysicsObjectSettings& s : run_.objects) {
      const auto at = numbers.find(s.name);
      if (at == numbers.end()) return is_missing(world_record_->objects, "object", s.name);
      settings[at->second] = s;
    }
  }
  if (from_)
    for (std::size_t i = 0; i < from_->objects.size(); ++i)
      before_.try_emplace(from_->objects[i].name, i);
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
      RMP_TRY_ASSIGN(const auto mass, sim_.derived.mass(sim_.snapshot, o.what, progress).in(where));
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

const RunState::Body* PhysicsSimulation::before_of(const std::string& name) const {
  const auto at = before_.find(name);
  return at == before_.end() ? nullptr : &from_->objects[at->second];
}

Result<void> PhysicsSimulation::add_robots(Progress& progress) {
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
    a.axes = robotics::MakerAxes::for_messages(a.record);
    if (!a.record)
      return error(ErrorCode::stale_handle, "the robot no longer exists", "Add it again.", where);
    const Pose mounting = model::pose(a.placed->placement);
    RMP_TRY_ASSIGN(
        a.model, sim_.derived
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
    a.path.emplace(a.model, a.q);
    RMP_TRY(a.path->start_at(a.q).in(where));
    a.now.resize(a.model->joints.size());
    a.next = a.now;
    if (a.settings.drive == RobotDrive::controlled) {
      const auto& choice =
          a.settings.controller.name.empty() ? a.record->controller : a.settings.controller;
      RMP_TRY_ASSIGN(a.controller, bind_controller(sim_.registry, a.model,
                                                   a.record->inverse_dynamics, choice, progress)
                                       .in(where));
      a.memory.assign(a.controller.solver->state_size(), 0.0);
      a.scratch.assign(a.controller.solver->scratch_size(), 0.0);
      if (before && before->memory.size() == a.memory.size()) a.memory = before->memory;
    }
    actors_.push_back(std::move(a));
  }
  return {};
}

Result<void> PhysicsSimulation::create() {
  NoProgress none;
  for (std::size_t i = 0; i < actors_.size(); ++i) RMP_TRY(add_bodies(actors_[i], i, none));
  RMP_TRY(place_attached());
  velocities_.resize(bodies_.size()), angular_velocities_.resize(bodies_.size());
  RMP_TRY_ASSIGN(const ProviderInfo info,
                 sim_.registry.find(PhysicsEngine::kInterfaceId, run_.engine.name));
  RMP_TRY_ASSIGN(const auto engine, sim_.registry.create<PhysicsEngine>(info.name));
  RMP_TRY_ASSIGN(const auto params,
                 motion::checked_params(info, run_.engine, "provider " + text::quote(info.name)));
  provider_ = info.name;
  poses_.resize(bodies_.size());
  joint_q_.resize(joints_.size()), joint_qd_ = joint_q_, forces_ = joint_q_;
  // An engine gives angles within a turn: what is missing is seen in a first world and taken off
  // the limits of the second.
  for (int attempt = 0; attempt < 2; ++attempt) {
    std::vector<PhysicsJoint> joints = joints_;
    for (const Actor& a : actors_) a.take_turns_off(joints);
    auto made = guarded(info.name, [&] {
      return engine->create(bodies_, joints, world_record_->gravity, *params);
    });
    if (!made.ok()) return named(std::move(made).error());
    if (!*made)
      return error(ErrorCode::plugin_failed,
                   "provider " + text::quote(info.name) + " made no world",
                   "Report it to the provider's author or choose another provider.");
    world_ = std::move(*made);
    RMP_TRY(read());
    bool is_right = true;
    for (Actor& a : actors_) is_right = a.find_turns(joint_q_) && is_right;
    if (is_right) break;
  }
  RMP_TRY(read());
  RMP_TRY(hold_again());
  RMP_TRY(hold_attached());
  for (const Actor& a : actors_)
    if (a.settings.self_contact) RMP_TRY(pass_over(a, none));
  return {};
}

Result<void> PhysicsSimulation::hold_again() {
  if (!from_) return {};
  for (const RunState::Held& h : from_->held) {
    const auto thing = std::find_if(things_.begin(), things_.end(), [&](const Thing& t) {
      return t.name == h.object && t.is_movable;
    });
    for (std::size_t who = 0; who < actors_.size() && thing != things_.end(); ++who) {
      const Actor& a = actors_[who];
      for (std::size_t j = 0; a.placed->name == h.robot && j < a.model->joints.size(); ++j) {
        if (a.model->joints[j].name != h.joint) continue;
        RMP_TRY(hold(who, a.base_body + 1 + static_cast<std::int32_t>(j), thing->body));
      }
    }
  }
  return {};
}

Result<void> PhysicsSimulation::place_attached() {
  for (const model::Attachment& a : world_record_->attachments) {
    RMP_TRY_ASSIGN(const std::size_t object, find(things_, "object", a.object));
    RMP_TRY_ASSIGN(const std::size_t who, find(world_record_->robots, "robot", a.robot));
    const Actor& actor = actors_[who];
    const auto grip = robotics::find_grip(*actor.record, *actor.model, a.link);
    if (!grip)
      return error(ErrorCode::unknown_name,
                   "robot " + text::quote(a.robot) + " has no link or tool " + text::quote(a.link),
                   "Attach it again (world.attach).", "object " + text::quote(a.object));
    const PhysicsCarried carried{
        who, grip->joint, things_[object].body,
        spatial::compose(grip->joint_T_link, model::pose(a.tool_T_object))};
    attached_.push_back(carried);
    if (from_ && things_[object].is_movable) continue;  // it is where it was
    const Pose link = grip->joint < 0
                          ? actor.world_T_base
                          : spatial::compose(actor.world_T_base, actor.now[index(grip->joint)]);
    PhysicsBody& body = bodies_[index(carried.object)];
    body.pose = spatial::compose(link, carried.joint_T_object);
    body.velocity = body.angular_velocity = {};
  }
  return {};
}

Result<void> PhysicsSimulation::hold_attached() {
  for (const PhysicsCarried& a : attached_) {
    const Thing& thing = things_[index(a.object)];
    const auto& robot = *actors_[a.actor].placed;
    if (!from_)
      out_.notes.push_back(text::quote(robot.name) + " holds " + text::quote(thing.name) +
                           " from the start");
    const auto was_held = [&](const RunState::Held& h) {
      return h.robot == robot.name && h.object == thing.name;
    };
    if (!thing.is_movable) {
      if (!from_ || std::any_of(from_->held.begin(), from_->held.end(), was_held))
        carried_.push_back(a);
    } else if (!from_) {
      RMP_TRY(hold(a.actor, actors_[a.actor].base_body + 1 + a.joint, a.object));
    }
  }
  return {};
}

Result<void> PhysicsSimulation::hold(std::size_t actor, std::int32_t link, std::int32_t object) {
  RMP_TRY_ASSIGN(const std::int32_t number,
                 guarded(provider_, [&] { return world_->attach(link, object); }));
  held_.push_back({number, object, link, actor});
  return {};
}

Result<void> PhysicsSimulation::pass_over(const Actor& a, Progress& progress) {
  RMP_TRY_ASSIGN(const auto collision, collision_model(sim_, AnyId(a.placed->robot), progress)
                                           .in("robot " + text::quote(a.placed->name)));
  const auto body = [&](std::int32_t b) {
    return a.base_body + 1 + collision->bodies()[index(b)].joint;
  };
  for (const PassedPair& p : collision->passed()) {
    const std::int32_t first = body(p.pair.a), second = body(p.pair.b);
    if (first != second) RMP_TRY(guarded(provider_, [&] { return world_->ignore(first, second); }));
  }
  return {};
}

Result<void> PhysicsSimulation::add_bodies(Actor& a, std::size_t number, Progress& progress) {
  const std::string where = "robot " + text::quote(a.placed->name);
  RMP_TRY_ASSIGN(auto shapes,
                 sim_.derived.robot_shapes(sim_.snapshot, a.placed->robot, progress).in(where));
  const auto frames = robotics::link_frames(*a.record);
  // Beside designed parts generated bodies are for pictures and clearances: nothing is pushed by
  // what nobody designed.
  const std::vector<bool> is_generated = robotics::generated_bodies(*a.record);
  const bool all_generated =
      a.record->base_parts.empty() && std::all_of(a.record->links.begin(), a.record->links.end(),
                                                  [](const auto& l) { return l.parts.empty(); });
  for (std::size_t b = 0; b < shapes.size() && !all_generated; ++b) {
    if (!is_generated[b] || shapes[b].empty()) continue;
    shapes[b].clear();
    for (const model::AttachedTool& t : a.record->attached) {
      if (static_cast<std::size_t>(t.link + 1) != b) continue;
      RMP_TRY_ASSIGN(const auto own, sim_.derived.shapes(sim_.snapshot, t.what, progress));
      for (ShapePiece p : *own) {
        p.pose = spatial::compose(model::pose(t.placement), p.pose);
        shapes[b].push_back(std::move(p));
      }
    }
    if (!shapes[b].empty()) continue;
    untouched_.push_back(a.placed->name + "." +
                         (b == 0 ? std::string("base") : a.record->links[b - 1].name));
  }
  std::vector<std::vector<ShapePiece>> of_body(a.model->joints.size() + 1);
  for (std::size_t b = 0; b < shapes.size(); ++b) {
    const auto joint = b == 0 ? -1 : frames[b - 1].joint;
    for (ShapePiece& p : shapes[b]) {
      if (b > 0) p.pose = spatial::compose(frames[b - 1].joint_T_link, p.pose);
      of_body[index(joint + 1)].push_back(std::move(p));
    }
  }
  MotionReference::Sample start;
  RMP_TRY(a.path->at(time_of(first_), start));
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

void PhysicsSimulation::carry_over(Actor& a, const RunState::Robot& before,
                                   const MotionReference::Sample& path) {
  a.qd = path.qd;
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

}  // namespace robomosp::sim
