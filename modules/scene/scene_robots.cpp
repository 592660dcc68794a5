// SPDX-License-Identifier: Apache-2.0
// Robots of a scene, what they hold, and their ghosts.
#include <utility>

#include "model/placement.h"
#include "scene/scene_model_impl.h"

namespace robomosp::scene {
namespace {

Bounds box_of_robot(const Shape& shape, const std::vector<Pose>& bodies) {
  Bounds box = empty_box();
  for (std::size_t b = 0; b < shape.boxes.size(); ++b) grow(box, moved(shape.boxes[b], bodies[b]));
  return box;
}

}  // namespace

Result<void> SceneModel::Impl::show_robots(Work& w) {
  const auto& list = w.now->robots;
  const Extras& extras_now = w.wanted.extras;
  w.next->robots.clear();
  std::map<std::string, RobotState> still;
  for (const model::PlacedRobot& r : list)
    if (const auto at = robot_states.find(r.name); at != robot_states.end())
      still.insert(robot_states.extract(at));
  robot_states = std::move(still);
  if (w.is_anew || w.affected.contains(what)) {
    std::unordered_set<AnyId> used;
    for (const model::PlacedRobot& r : list) used.insert(AnyId(r.robot));
    store.keep_robots(used);
  }
  std::size_t built = 0;
  for (const model::PlacedRobot& r : list) {
    const model::Robot* record = w.wanted.snapshot->get(r.robot);
    const std::vector<double>* q = &r.q;
    if (const auto at = extras_now.robot_q.find(r.name); at != extras_now.robot_q.end())
      q = &at->second;
    if (w.wanted.motion)
      if (const auto at = w.wanted.motion->q.find(r.name); at != w.wanted.motion->q.end())
        q = &at->second;
    RMP_TRY_ASSIGN(MemberPtr member,
                   robot_member(w, r.name, true, r.robot, model::pose(r.placement),
                                record ? shown_q(*record, *q) : std::vector<double>{}));
    if (!member) continue;
    w.next->robots.push_back(std::move(member));
    ++built;
    if (r.name == extras_now.path_robot) {
      w.path_robot = &r;
      w.path_base = robot_states.at(r.name).base;
    }
  }
  if (w.path_robot || built != 1) return {};
  for (const model::PlacedRobot& r : list)
    if (r.name == std::as_const(w.next->robots).front()->name) {
      w.path_robot = &r;
      w.path_base = robot_states.at(r.name).base;
    }
  return {};
}

Result<MemberPtr> SceneModel::Impl::robot_member(Work& w, const std::string& name, bool is_placed,
                                                 RobotId id, const Pose& world_T_mounting,
                                                 const std::vector<double>& q) {
  RMP_TRY_ASSIGN(const ShapeStore::Robot* robot, store.robot(id, w.detail, w.progress));
  if (!robot->is_current) w.is_exact = false;
  if (robot->failure) {
    if (is_placed) w.next->troubles.push_back(robot->failure->sentence());
    else w.next->failure = robot->failure;
  }
  if (!robot->base) {
    robot_states.erase(name);
    return MemberPtr();
  }
  RobotState& at = robot_states[name];
  const bool is_same_place = at.posed && at.base == robot->base && at.q == q &&
                             same(at.world_T_mounting, world_T_mounting);
  if (is_same_place && at.member && !w.is_anew && !w.has_other_extras) return at.member;
  auto m = std::make_shared<Member>();
  m->kind = MemberKind::robot;
  m->is_placed = is_placed;
  m->name = name;
  m->what = AnyId(id);
  if (!is_same_place) {
    at.base = robot->base;
    at.world_T_mounting = world_T_mounting;
    at.q = q;
    at.member = nullptr;
    at.posed.emplace(robot->base, world_T_mounting);
  }
  // Values of a robot that is not computed anew yet may be others.
  at.posed->pose(shown_q(*robot->base->record, q), m->bodies);
  const Extras& extras_now = w.wanted.extras;
  layer_of(*m, ShapeLayer::bodies) = robot->bodies;
  if (extras_now.com || extras_now.ellipsoids.velocity || extras_now.ellipsoids.force)
    layer_of(*m, ShapeLayer::posed) = robot_posed(*at.posed, name, extras_now);
  if (extras_now.frames) layer_of(*m, ShapeLayer::frames) = robot->frames;
  if (extras_now.dh_rows)
    layer_of(*m, ShapeLayer::rows) = robot_rows(*robot->base, shown_q(*robot->base->record, q));
  if (extras_now.labels)
    layer_of(*m, ShapeLayer::labels) = label_of(*m, robot->bodies->boxes.front(), at.member);
  m->box = box_of_robot(*robot->bodies, m->bodies);
  at.member = m;
  return MemberPtr(std::move(m));
}

void SceneModel::Impl::hold_objects(Work& w) {
  for (const model::Attachment& a : w.now->attachments) {
    const auto at = robot_states.find(a.robot);
    if (at == robot_states.end() || !at->second.posed) continue;
    const auto grip = at->second.posed->grip_of(a);
    if (grip.ok()) w.held[a.object] = at->second.posed->place(*grip);
    else w.next->troubles.push_back(grip.error().sentence());
  }
}

Result<void> SceneModel::Impl::show_ghosts(Work& w) {
  w.next->ghosts.clear();
  std::size_t number = 0;
  for (const Ghost& ghost : w.wanted.extras.ghosts) {
    ++number;
    const MemberPtr* of = nullptr;
    for (const MemberPtr& m : std::as_const(w.next->robots))
      if (m->name == ghost.robot || !m->is_placed) of = &m;
    if (!of) {
      w.next->troubles.push_back("there is no robot \"" + ghost.robot +
                                 "\" to show at other joint values");
      continue;
    }
    const RobotState& at = robot_states.at((*of)->name);
    auto m = std::make_shared<Member>(**of);
    m->kind = MemberKind::ghost;
    m->name += " " + std::to_string(number);
    m->shapes = {};
    m->touching.clear();
    layer_of(*m, ShapeLayer::bodies) = (*of)->shape(ShapeLayer::bodies);
    PosedRobot posed(at.base, at.world_T_mounting);
    posed.pose(shown_q(*at.base->record, ghost.q), m->bodies);
    m->box = box_of_robot(*m->shape(ShapeLayer::bodies), m->bodies);
    w.next->ghosts.push_back(std::move(m));
  }
  return {};
}

}  // namespace robomosp::scene
