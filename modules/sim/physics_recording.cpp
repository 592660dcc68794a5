// SPDX-License-Identifier: Apache-2.0
// What a run of contact physics records.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <robomosp/sdk/physics_notes.h>

#include "evaluation/round_meshes.h"
#include "kernel/text.h"
#include "sim/base_motion.h"
#include "sim/physics_simulation.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::sim {
namespace {

using recording::Column;
using recording::Recording;

constexpr double kMostNumbers = 2e8;  ///< in a recording
/// What lies less deep in another at the start is rounding, or a touch that was asked for [m].
constexpr double kOverlap = 1e-4;
constexpr std::size_t kMostPairs = 5;  ///< that are named

}  // namespace

std::size_t PhysicsSimulation::add_column(std::string name, std::string unit, std::string doc) {
  out_.columns.push_back({std::move(name), std::move(unit), std::move(doc), {}});
  return out_.columns.size() - 1;
}

void PhysicsSimulation::note_differences() {
  if (!inert_.empty())
    out_.notes.push_back(
        text::enumerate(inert_) + (inert_.size() == 1 ? " has" : " have") +
        " no mass or no inertia about some axis and got the smallest values allowed by the engine");
  if (!untouched_.empty())
    out_.notes.push_back(text::enumerate(untouched_) + (untouched_.size() == 1 ? " has" : " have") +
                         " no designed parts and touch" + (untouched_.size() == 1 ? "es" : "") +
                         " nothing");
  for (const Actor& a : actors_)
    if (auto stands = note_on_standing_base(*a.placed, "contact physics does"))
      out_.notes.push_back(std::move(*stands));
  std::size_t ellipsoids = 0;
  for (const auto& body : pieces_)
    ellipsoids += static_cast<std::size_t>(std::count_if(
        body.begin(), body.end(), [](const ShapePiece& p) { return p.ellipsoid.has_value(); }));
  if (ellipsoids > 0)
    out_.notes.push_back((ellipsoids == 1
                              ? "1 ellipsoid collides as a polyhedron"
                              : std::to_string(ellipsoids) + " ellipsoids collide as polyhedra") +
                         std::string(" with 482 corners, within 0.5 % of its largest half axis"));
  note_meshes();
}

/// What imported meshes are taken for that look round.
void PhysicsSimulation::note_meshes() {
  std::vector<std::string> round, polygons;
  std::size_t fewest = evaluation::kFewestRoundSides;
  for (std::size_t i = 0; i < pieces_.size(); ++i)
    for (const ShapePiece& p : pieces_[i]) {
      if (p.sides == 0) continue;
      std::vector<std::string>& names = p.outside ? round : polygons;
      if (!p.outside) fewest = std::min(fewest, p.sides);
      if (names.empty() || names.back() != body_name(i)) names.push_back(body_name(i));
    }
  const auto named = [](std::vector<std::string> names) {
    const std::size_t more = names.size() > kMostPairs ? names.size() - kMostPairs : 0;
    names.resize(names.size() - more);
    if (more > 0) names.push_back(std::to_string(more) + " more");
    return text::enumerate(names);
  };
  if (!round.empty())
    out_.notes.push_back("the imported mesh of " + named(round) +
                         " collides as the surface of revolution through its corners");
  if (!polygons.empty())
    out_.notes.push_back("the imported mesh of " + named(polygons) + " rolls as a polygon with " +
                         std::to_string(fewest) + " sides; with " +
                         std::to_string(evaluation::kFewestRoundSides) +
                         " or more, about evenly spaced, a mesh is treated as round");
}

void PhysicsSimulation::note_overlaps() {
  if (from_) return;  // it was no start
  std::map<std::pair<std::int32_t, std::int32_t>, double> depths;
  for (const PhysicsContact& c : contacts_) {
    if (!(c.depth > kOverlap) || c.a < 0 || c.b < 0 || index(c.a) >= bodies_.size() ||
        index(c.b) >= bodies_.size())
      continue;
    double& depth = depths[{std::min(c.a, c.b), std::max(c.a, c.b)}];
    depth = std::max(depth, c.depth);
  }
  std::size_t told = 0;
  for (const auto& [pair, depth] : depths) {
    if (++told > kMostPairs) break;
    out_.notes.push_back(body_name(index(pair.first)) + " and " + body_name(index(pair.second)) +
                         " overlap by " + text::print_rounded(1e3 * depth, 3) +
                         " mm at the start: contact separates them without giving them velocity");
  }
  if (depths.size() > kMostPairs)
    out_.notes.push_back(std::to_string(depths.size() - kMostPairs) +
                         " more pairs of bodies overlap at the start");
}

Result<void> PhysicsSimulation::note_engine() {
  const void* const known = world_->extension(PhysicsNotes::kId);
  if (!known) return {};
  RMP_TRY_ASSIGN(const auto all, guarded(provider_, [&] {
                   return static_cast<const PhysicsNotes*>(known)->notes();
                 }));
  for (; engine_notes_ < all.size(); ++engine_notes_) {
    const PhysicsNote& n = all[engine_notes_];
    std::vector<std::string> names;
    for (const std::int32_t body : {n.a, n.b})
      if (body >= 0 && index(body) < bodies_.size()) names.push_back(body_name(index(body)));
    out_.notes.push_back((names.empty() ? "" : text::enumerate(names) + " ") + n.text);
  }
  return {};
}

void PhysicsSimulation::prepare_columns() {
  out_.world = run_.world;
  out_.title = sim_.snapshot.find(AnyId(run_.world))->name + ": contact physics";
  note_differences();
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
  add_column("contacts", "", "number of contact points");
  add_column("contact_force", "N", "sum of the sizes of the contact forces");
}

void PhysicsSimulation::add_robot_columns(const Actor& a, const std::string& prefix) {
  recorded_.push_back(&a);
  std::vector<const JointModel*> of_q(a.model->coordinate_count()), of_v(a.model->dof());
  for (const JointModel& j : a.model->joints) {
    if (j.is_coupled()) continue;
    for (std::int32_t k = 0; k < coordinate_count(j.type); ++k) of_q[index(j.q_index + k)] = &j;
    for (std::int32_t k = 0; k < velocity_count(j.type); ++k) of_v[index(j.v_index + k)] = &j;
  }
  const auto words = [&](const JointModel* j) {
    return (coordinate_count(j->type) == 1 ? a.axes->before_joint(index(j->q_index))
                                           : std::string()) +
           "joint " + j->name;
  };
  const auto slides = [](const JointModel* j) { return j->type == JointType::prismatic; };
  for (std::size_t i = 0; i < of_q.size(); ++i)
    add_column(prefix + "q" + std::to_string(i + 1),
               coordinate_count(of_q[i]->type) > 1 ? ""
               : slides(of_q[i])                   ? "m"
                                                   : "rad",
               "position of " + words(of_q[i]));
  for (std::size_t i = 0; i < of_v.size(); ++i)
    add_column(prefix + "qd" + std::to_string(i + 1), slides(of_v[i]) ? "m/s" : "rad/s",
               "velocity of " + words(of_v[i]));
  if (a.settings.drive == RobotDrive::moved) return;
  for (std::size_t i = 0; i < of_v.size(); ++i)
    add_column(prefix + "tau" + std::to_string(i + 1), slides(of_v[i]) ? "N" : "N m",
               "force of the motor of " + words(of_v[i]));
}

Result<void> PhysicsSimulation::sample(double t) {
  RMP_TRY(note_engine());
  std::size_t c = 0;
  const auto put = [&](double x) { out_.columns[c++].values.push_back(x); };
  if (static_cast<double>(out_.rows() + 1) * static_cast<double>(out_.columns.size()) >
      kMostNumbers)
    return error(ErrorCode::invalid_argument, "the recording would be too long",
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
      return error(ErrorCode::plugin_failed,
                   "provider " + text::quote(provider_) + " returned a state that is not a number",
                   "Use a shorter step; else report it to the provider's author.",
                   "t = " + text::print_rounded(t) + " s");
  if (!sink_) return {};
  if (t >= time_of(ticks_)) sink_->end_with_next();
  return sink_->take(out_, out_.rows() - 1, state(t));
}

RunStatePtr PhysicsSimulation::state(double t) const {
  auto s = std::make_shared<RunState>();
  s->time = t;
  for (const Thing& thing : things_) {
    const std::size_t b = index(thing.body);
    if (thing.is_movable)
      s->objects.push_back(
          {thing.name, poses_[b], velocities_[b], angular_velocities_[b], thing.quaternion});
  }
  for (const Actor& a : actors_) {
    RunState::Robot r{a.placed->name, a.path->start(), a.q, a.qd, a.memory, {}};
    for (const PhysicsGrip& g : a.grips)
      if (g.is_on) r.grips.push_back({a.model->joints[g.joint].name, g.force, g.speed});
    s->robots.push_back(std::move(r));
  }
  const auto add_held = [&](const Actor& a, std::int32_t joint, std::int32_t object) {
    s->held.push_back({a.placed->name,
                       joint < 0 ? std::string() : a.model->joints[index(joint)].name,
                       things_[index(object)].name});
  };
  for (const Held& h : held_) {
    const std::int32_t joint = h.link - actors_[h.actor].base_body - 1;
    if (joint >= 0) add_held(actors_[h.actor], joint, h.object);
  }
  for (const PhysicsCarried& c : carried_) add_held(actors_[c.actor], c.joint, c.object);
  return s;
}

std::string PhysicsSimulation::name_of_entry(const Actor& a, std::size_t entry) {
  for (std::size_t j = 0; j < a.model->joints.size(); ++j) {
    const JointModel& m = a.model->joints[j];
    if (!m.is_coupled() && entry >= index(m.v_index) &&
        entry < index(m.v_index + velocity_count(m.type)))
      return a.joint_words(j);
  }
  return {};
}

Result<recording::RecordingPtr> PhysicsSimulation::record() {
  for (const Actor& a : actors_)
    for (std::size_t j = 0; j < a.cut.size(); ++j)
      if (a.cut[j] > 0)
        out_.notes.push_back("the torque of " + name_of_entry(a, j) + " of " +
                             text::quote(a.placed->name) + " was cut in " +
                             std::to_string(a.cut[j]) + " of " + std::to_string(ticks_) + " steps");
  return std::make_shared<const Recording>(std::move(out_));
}

}  // namespace robomosp::sim
