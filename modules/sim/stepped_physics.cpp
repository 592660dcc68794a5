// SPDX-License-Identifier: Apache-2.0
#include "sim/stepped_physics.h"

#include <cmath>
#include <limits>
#include <utility>

#include "sim/physics_simulation.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::sim {
namespace {

constexpr std::int64_t kAskEvery = 64;  ///< steps between looks at whether it is cancelled

}  // namespace

struct SteppedPhysics::Parts {
  Parts(const Simulator& sim, PhysicsRun wanted)
      : run(std::move(wanted)), simulation(sim, run, nullptr, nullptr) {}

  PhysicsRun run;
  PhysicsSimulation simulation;
  const RobotWays* ways = nullptr;  ///< during go_to
  std::vector<bool> stands;         ///< the engine has robot i where it stands
  std::int64_t tick = 0;
};

SteppedPhysics::SteppedPhysics(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
SteppedPhysics::~SteppedPhysics() = default;

Result<std::unique_ptr<SteppedPhysics>> SteppedPhysics::create(const Simulator& sim,
                                                               PhysicsRun wanted,
                                                               Progress& progress) {
  std::unique_ptr<SteppedPhysics> out(
      new SteppedPhysics(std::make_unique<Parts>(sim, std::move(wanted))));
  Parts& parts = *out->parts_;
  PhysicsSimulation& s = parts.simulation;
  s.duration_ = std::numeric_limits<double>::infinity();
  const auto build = [&]() -> Result<void> {
    RMP_TRY(s.check_times());
    RMP_TRY(s.add_objects(progress));
    RMP_TRY(s.add_robots(progress));
    return s.create();
  };
  auto built = build();
  if (!built.ok()) return std::move(built).error().in("contact physics");
  for (std::size_t i = 0; i < s.actors_.size(); ++i) {
    s.actors_[i].acts = true;
    s.actors_[i].next = s.actors_[i].now;
    s.actors_[i].path->follow(
        [&parts, i](double t, MotionReference::Sample& sample) { parts.ways->at(i, t, sample); });
  }
  parts.stands.assign(s.actors_.size(), false);
  s.note_differences();
  return out;
}

double SteppedPhysics::now() const { return static_cast<double>(parts_->tick) * parts_->run.step; }
double SteppedPhysics::step() const { return parts_->run.step; }

Result<void> SteppedPhysics::go_to(double t, const RobotWays& ways, Progress& progress) {
  Parts& parts = *parts_;
  PhysicsSimulation& s = parts.simulation;
  parts.ways = &ways;
  const auto whole = static_cast<std::int64_t>(std::floor(t / parts.run.step * (1 + 1e-12)));
  while (parts.tick < whole) {
    if (parts.tick % kAskEvery == 0 && progress.cancelled())
      return error(ErrorCode::cancelled, "the run was cancelled");
    const double from = now(), to = static_cast<double>(parts.tick + 1) * parts.run.step;
    for (std::size_t i = 0; i < s.actors_.size(); ++i) {
      const bool stands = ways.stands(i, from);
      if (stands && parts.stands[i]) continue;
      RMP_TRY(s.actors_[i].move(from, to, s.provider_, *s.world_, s.wanted_));
      parts.stands[i] = stands;
    }
    RMP_TRY(s.carry(from, to));
    RMP_TRY(s.step(from, to, progress).in("contact physics"));
    if (parts.tick == 0) s.note_overlaps();
    ++parts.tick;
  }
  return s.note_engine();
}

bool SteppedPhysics::is_movable(std::size_t object) const {
  return parts_->simulation.things_[object].is_movable;
}

Pose SteppedPhysics::pose(std::size_t object, double t) const {
  const PhysicsSimulation& s = parts_->simulation;
  const std::size_t body = index(s.things_[object].body);
  Pose out = s.poses_[body];
  const double dt = t - now();
  if (!(dt > 0)) return out;
  out.p = spatial::add(out.p, spatial::scale(s.velocities_[body], dt));
  const Pose turn{spatial::rotation_exp(spatial::scale(s.angular_velocities_[body], dt)), {}};
  out.R = spatial::compose(turn, Pose{out.R, {}}).R;
  return out;
}

Result<void> SteppedPhysics::hold(std::size_t object, std::size_t robot, std::int32_t joint,
                                  const Pose& joint_T_object) {
  PhysicsSimulation& s = parts_->simulation;
  RMP_TRY(let_go(object));
  const std::int32_t body = s.things_[object].body;
  if (!s.things_[object].is_movable) {
    s.carried_.push_back({robot, joint, body, joint_T_object});
    return {};
  }
  return s.hold(robot, s.actors_[robot].base_body + 1 + joint, body);
}

Result<void> SteppedPhysics::let_go(std::size_t object) {
  PhysicsSimulation& s = parts_->simulation;
  const std::int32_t body = s.things_[object].body;
  for (std::size_t i = s.held_.size(); i-- > 0;) {
    if (s.held_[i].object != body) continue;
    RMP_TRY(guarded(s.provider_, [&] { return s.world_->release(s.held_[i].attachment); }));
    s.held_.erase(s.held_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  for (std::size_t i = s.carried_.size(); i-- > 0;) {
    if (s.carried_[i].object != body) continue;
    const Pose at = s.poses_[index(body)];
    RMP_TRY(move_body(*s.world_, s.provider_, body, at, at, s.run_.step));
    s.carried_.erase(s.carried_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return {};
}

const std::vector<std::string>& SteppedPhysics::notes() const {
  return parts_->simulation.out_.notes;
}

}  // namespace robomosp::sim
