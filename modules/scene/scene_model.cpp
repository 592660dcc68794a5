// SPDX-License-Identifier: Apache-2.0
#include "scene/scene_model.h"

#include <utility>

#include "document/changed.h"
#include "scene/ids.h"
#include "scene/scene_model_impl.h"

namespace robomosp::scene {
namespace {

bool same_extras(const Extras& a, const Extras& b) {
  return a.com == b.com && a.frames == b.frames && a.ellipsoids.velocity == b.ellipsoids.velocity &&
         a.ellipsoids.force == b.ellipsoids.force && a.q == b.q && a.robot_q == b.robot_q &&
         a.paths == b.paths && a.path_speeds == b.path_speeds && a.path_faults == b.path_faults &&
         a.path_robot == b.path_robot && a.labels == b.labels && a.dh_rows == b.dh_rows &&
         a.dimensions == b.dimensions && a.contacts == b.contacts && a.clearances == b.clearances &&
         a.clearances_below == b.clearances_below && a.ghosts == b.ghosts;
}

}  // namespace

ShapePtr label_of(const Member& m, const Bounds& own_box, const MemberPtr& before) {
  Vec3 place{};
  if (diagonal(own_box) > 0)
    place = {0.5 * (own_box[0][0] + own_box[1][0]), 0.5 * (own_box[0][1] + own_box[1][1]),
             own_box[1][2]};
  const ShapePtr& old = before ? before->shape(ShapeLayer::labels) : ShapePtr();
  if (old && old->labels.front().what.text == m.name && old->labels.front().what.place == place)
    return old;
  auto shape = std::make_shared<Shape>();
  Element<render::Label> e;
  e.what.place = place;
  e.what.text = m.name;
  e.group = kNoteBody + 1;
  shape->labels.push_back(std::move(e));
  return shape;
}

SceneModel::Impl::Impl(evaluation::Derived& d, const Registry& r, AnyId id,
                       collision::CollisionCache* given)
    : what(id), models(given ? *given : own_models), store(d, r) {
  auto empty = std::make_shared<Frame>();
  empty->what = id;
  frame = std::move(empty);
}

Result<void> SceneModel::Impl::show_alone(Work& w) {
  const document::Snapshot& snapshot = *w.wanted.snapshot;
  const std::string& name = snapshot.find(what)->name;
  const MemberPtr before = frame->bodies.empty() || w.is_anew ? MemberPtr() : frame->bodies.front();
  w.next->bodies.clear();
  w.next->robots.clear();
  if (what.kind == Kind::robot) {
    const auto& robot = *snapshot.get(RobotId{what.number});
    const std::vector<double>* q = &w.wanted.extras.q;
    if (w.wanted.motion)
      if (const auto at = w.wanted.motion->q.find(name); at != w.wanted.motion->q.end())
        q = &at->second;
    RMP_TRY_ASSIGN(const MemberPtr member,
                   robot_member(w, name, false, RobotId{what.number}, Pose{}, shown_q(robot, *q)));
    if (member) w.next->robots.push_back(member);
    RMP_TRY(show_ghosts(w));
    return show_proximity(w);
  }
  if (what.kind != Kind::object && what.kind != Kind::solid && what.kind != Kind::material) {
    w.next->failure =
        error(ErrorCode::invalid_argument, snapshot.describe(what) + " has no body to show",
              "Show the world it is placed in.");
    return {};
  }
  RMP_TRY_ASSIGN(const MemberPtr member, object_member(w, name, false, what, Pose{}, before));
  w.next->failure = member->shape(ShapeLayer::bodies)->failure;
  w.next->bodies.push_back(member);
  return {};
}

Result<void> SceneModel::Impl::show_world(Work& w) {
  RMP_TRY(show_robots(w));
  hold_objects(w);
  RMP_TRY(show_objects(w));
  show_places(w);
  RMP_TRY(show_trajectories(w));
  RMP_TRY(show_ghosts(w));
  return show_proximity(w);
}

Result<FramePtr> SceneModel::Impl::update(const Wanted& wanted, Detail detail, Progress& progress) {
  const document::Snapshot& now = *wanted.snapshot;
  const bool has_other_extras = !same_extras(extras, wanted.extras);
  const bool is_first = frame->number == 0;
  std::vector<AnyId> changed;
  if (!is_first && frame->snapshot != wanted.snapshot)
    changed = document::changed_records(*frame->snapshot, now);
  if (!is_first && !is_forgotten && changed.empty() && !has_other_extras &&
      motion == wanted.motion && (frame->is_exact || detail == Detail::coarse))
    return frame;

  store.renew(wanted.snapshot);
  Work w{wanted,
         detail,
         progress,
         {now, store.derived(), store.registry(), &models},
         std::make_shared<Frame>(*frame)};
  w.has_other_extras = has_other_extras;
  w.outstanding = outstanding;
  for (const AnyId id : document::dependents(now, std::move(changed))) w.affected.insert(id);
  w.next->number = frame->number + 1;
  w.next->snapshot = wanted.snapshot;
  w.next->is_there = now.find(what) != nullptr;
  w.next->failure.reset();
  w.next->troubles.clear();
  w.next->since = {};
  w.is_anew = is_first || is_forgotten || !frame->is_there;
  if (what.kind == Kind::world) {
    w.now = now.get(WorldId{what.number});
    w.before = w.is_anew ? nullptr : frame->snapshot->get(WorldId{what.number});
  }
  if (!w.next->is_there) {
    for (MemberList* list :
         {&w.next->bodies, &w.next->robots, &w.next->trajectories, &w.next->frames, &w.next->lights,
          &w.next->ghosts, &w.next->clearances})
      list->clear();
    robot_states.clear();
    w.outstanding.clear();
    w.next->failure =
        error(ErrorCode::stale_handle, "the record no longer exists", "Open or create one.");
  } else if (auto shown = what.kind == Kind::world ? show_world(w) : show_alone(w); !shown.ok()) {
    // What was made for this frame is not part of the last one, from which the next is made.
    for (auto& [name, robot] : robot_states) robot.member = nullptr;
    return std::move(shown).error();
  }
  w.next->is_exact = w.is_exact && store.coarse().empty();
  w.next->since = changes_between(is_first ? nullptr : frame.get(), *w.next);
  frame = std::move(w.next);
  extras = wanted.extras;
  motion = wanted.motion;
  held = std::move(w.held);
  coarse = store.coarse();
  outstanding = std::move(w.outstanding);
  proximity = std::move(w.proximity);
  is_forgotten = false;
  return frame;
}

SceneModel::SceneModel(evaluation::Derived& derived, const Registry& registry, AnyId what,
                       collision::CollisionCache* collision_models)
    : impl_(std::make_unique<Impl>(derived, registry, what, collision_models)) {}
SceneModel::~SceneModel() = default;

const FramePtr& SceneModel::frame() const { return impl_->frame; }

Result<FramePtr> SceneModel::update(const Wanted& wanted, Detail detail, Progress& progress) {
  return impl_->update(wanted, detail, progress);
}

void SceneModel::forget() {
  impl_->store.forget();
  impl_->robot_states.clear();
  impl_->is_forgotten = true;
}

}  // namespace robomosp::scene
