// SPDX-License-Identifier: Apache-2.0
// Pulls of live runs of contact physics.
#include <algorithm>
#include <utility>

#include "robotics/grip.h"
#include "sim/physics_simulation.h"
#include "spatial/pose.h"

namespace robomosp::sim {

std::optional<PhysicsPulled> PhysicsSimulation::pulled_body(const Pull& pull, double dt) const {
  PhysicsPulled out;
  double mass = 0;
  Pose body_T_point;
  if (!pull.object.empty()) {
    const auto thing = std::find_if(things_.begin(), things_.end(),
                                    [&](const Thing& t) { return t.name == pull.object; });
    if (thing == things_.end() || !thing->is_movable) return std::nullopt;
    out.body = index(thing->body);
    mass = bodies_[out.body].mass.mass;
  } else {
    const auto actor = std::find_if(actors_.begin(), actors_.end(),
                                    [&](const Actor& a) { return a.placed->name == pull.robot; });
    if (actor == actors_.end() || !actor->is_driven()) return std::nullopt;
    const auto link = robotics::find_grip(*actor->record, *actor->model, pull.link);
    if (!link || link->joint < 0) return std::nullopt;
    out.body = index(actor->base_body + 1 + link->joint);
    body_T_point = link->joint_T_link;
    for (std::size_t j = 0; j < actor->model->joints.size(); ++j)
      mass += bodies_[index(actor->base_body) + 1 + j].mass.mass;
  }
  const MassProperties& own = bodies_[out.body].mass;
  out.point = pull.point ? spatial::transform(body_T_point, *pull.point) : own.com;
  out.spring = PullSpring(pull, mass, least_mass_at(own, out.point), dt);
  return out;
}

void PhysicsSimulation::find_pulled(double t, double end) {
  pulled_.clear();
  while (pulled_.size() < pulls_->all().size()) {
    auto found = pulled_body(pulls_->all()[pulled_.size()], end - t);
    if (found) pulled_.push_back(*std::move(found));
    else pulls_->drop(pulled_.size(), t, out_.notes);
  }
}

Result<void> PhysicsSimulation::pull(double t, double end) {
  if (!run_.pulls) return {};
  if (!pulls_) pulls_.emplace(*run_.pulls);
  if (pulls_->update(t, out_.notes)) find_pulled(t, end);
  for (std::size_t i = 0; i < pulled_.size(); ++i) {
    const auto& [body, point, spring] = pulled_[i];
    const Vec3 arm = spatial::rotate(poses_[body], point);
    const Vec3 at = spatial::add(poses_[body].p, arm);
    const Vec3 velocity =
        spatial::add(velocities_[body], spatial::cross(angular_velocities_[body], arm));
    const Vec3 force = spring.force(at, velocity, pulls_->all()[i].to);
    pulls_->report(i, at, spatial::norm(force));
    auto pushed = guarded(provider_, [&] {
      return world_->push(static_cast<std::int32_t>(body), force, spatial::cross(arm, force));
    });
    if (!pushed.ok()) return std::move(pushed).error().in("t = " + text::print_rounded(t) + " s");
  }
  return {};
}

}  // namespace robomosp::sim
