// SPDX-License-Identifier: Apache-2.0
#include "sim/physics.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "sim/physics_simulation.h"
#include "spatial/pose.h"

namespace robomosp::sim {

Result<recording::RecordingPtr> PhysicsSimulation::operator()(Progress& progress) {
  RMP_TRY(check_times());
  RMP_TRY(add_objects(progress));
  RMP_TRY(add_robots(progress));
  RMP_TRY(plan(progress));
  RMP_TRY(create());
  RMP_TRY(go(progress));
  return record();
}

Result<void> PhysicsSimulation::read() {
  const PhysicsState state{sizeof(PhysicsState), poses_,   velocities_,
                           angular_velocities_,  joint_q_, joint_qd_};
  RMP_TRY(guarded(provider_, [&] { return world_->read(state); }));
  for (Actor& a : actors_) a.read(poses_, velocities_, angular_velocities_, joint_q_, joint_qd_);
  return {};
}

std::string PhysicsSimulation::body_name(std::size_t body) const {
  for (const Thing& thing : things_)
    if (index(thing.body) == body) return "object " + text::quote(thing.name);
  for (const Actor& a : actors_) {
    const std::size_t first = index(a.base_body), count = a.model->joints.size();
    if (body < first || body > first + count) continue;
    return "robot " + text::quote(a.placed->name) +
           (body == first ? ", its base" : ", " + a.joint_words(body - first - 1));
  }
  return "body " + std::to_string(body + 1);
}

Error PhysicsSimulation::named(Error e) const {
  constexpr std::string_view kBody = "body ";
  std::size_t number = 0;
  if (!e.where.starts_with(kBody)) return e;
  const char* const begin = e.where.data() + kBody.size();
  const auto [end, code] = std::from_chars(begin, e.where.data() + e.where.size(), number);
  if (code == std::errc{} && number > 0)
    e.where =
        body_name(number - 1) + e.where.substr(static_cast<std::size_t>(end - e.where.data()));
  return e;
}

Result<void> PhysicsSimulation::go(Progress& progress) {
  prepare_columns();
  RMP_TRY(sample(time_of(first_)));
  std::size_t next_event = 0;
  for (std::int64_t tick = first_; tick < ticks_; ++tick) {
    const double t = time_of(tick), end = time_of(tick + 1);
    if (tick % 64 == 0) {
      progress.report(t / duration_, "contact physics");
      if (progress.cancelled())
        return error(ErrorCode::cancelled, "the simulation was cancelled", {},
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
    RMP_TRY(carry(t, end));
    RMP_TRY(pull(t, end));
    RMP_TRY(step(t, end, progress));
    if (tick == first_) note_overlaps();
    if ((tick + 1) % every_ == 0 || tick + 1 == ticks_) RMP_TRY(sample(end));
  }
  // What happens at the very end changes nothing that is recorded.
  for (; next_event < events_.size() && events_[next_event].tick <= ticks_; ++next_event)
    RMP_TRY(
        act(events_[next_event]).in("action " + std::to_string(events_[next_event].action + 1)));
  return {};
}

Result<void> PhysicsSimulation::carry(double t, double end) {
  for (const PhysicsCarried& c : carried_) {
    const Actor& a = actors_[c.actor];
    if (c.joint < 0 || !(a.acts || a.is_dynamic[index(c.joint)])) continue;  // it stands
    const std::size_t joint = index(c.joint);
    Pose from = poses_[index(a.base_body) + 1 + joint], to = from;
    if (!a.is_dynamic[joint]) {
      from = spatial::compose(a.world_T_base, a.now[joint]);
      to = spatial::compose(a.world_T_base, a.next[joint]);
    }
    RMP_TRY(move_body(*world_, provider_, c.object, spatial::compose(from, c.joint_T_object),
                      spatial::compose(to, c.joint_T_object), end - t));
  }
  return {};
}

Result<void> PhysicsSimulation::step(double t, double end, Progress& progress) {
  auto done = guarded(provider_, [&]() -> Result<void> {
    RMP_TRY(world_->step(end - t, 1, forces_, progress));
    world_->contacts(contacts_);
    return {};
  });
  if (done.ok()) done = read();
  if (done.ok()) return {};
  return named(std::move(done).error()).in("t = " + text::print_rounded(t) + " s");
}

Result<void> PhysicsSimulation::act(const Event& event) {
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
    for (std::size_t i = carried_.size(); i-- > 0;) {
      if (carried_[i].actor != who || (named >= 0 && carried_[i].object != named)) continue;
      const Pose at = poses_[index(carried_[i].object)];
      RMP_TRY(move_body(*world_, provider_, carried_[i].object, at, at, run_.step));
      out_.notes.push_back(text::quote(things_[index(carried_[i].object)].name) +
                           " was released at " + text::print_rounded(event.time) +
                           " s and stays there: it has no mass or is fixed");
      carried_.erase(carried_.begin() + static_cast<std::ptrdiff_t>(i));
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
    if (index(other) < things_.size() && things_[index(other)].is_movable) touched.push_back(other);
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
        "Move it against the object (for example 0.2 mm into it), or name the object.");
  for (const std::int32_t body : touched) {
    RMP_TRY(hold(who, link, body));
    out_.notes.push_back(text::quote(a.placed->name) + " grasped " +
                         text::quote(things_[index(body)].name) + " at " +
                         text::print_rounded(event.time) + " s");
  }
  return {};
}

Result<recording::RecordingPtr> simulate_physics(const Simulator& simulator, const PhysicsRun& run,
                                                 Progress& progress, RowSink* sink,
                                                 const RunState* from) {
  PhysicsSimulation simulation(simulator, run, sink, from);
  auto done = simulation(progress);
  if (!done.ok() && simulator.snapshot.get(run.world))
    return std::move(done).error().in(simulator.snapshot.describe(AnyId(run.world)));
  return done;
}

}  // namespace robomosp::sim
