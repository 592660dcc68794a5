// SPDX-License-Identifier: Apache-2.0
// Trajectories, frames and lights of a scene.
#include <algorithm>
#include <cmath>
#include <utility>

#include "model/placement.h"
#include "scene/ids.h"
#include "scene/path_shape.h"
#include "scene/places.h"
#include "scene/scene_model_impl.h"

namespace robomosp::scene {
namespace {

/// Whether runs along trajectories are the same in both worlds, as far as their ways go.
bool same_runs(const model::World& a, const model::World& b) {
  const auto robots = [](const model::PlacedRobot& x, const model::PlacedRobot& y) {
    return x.name == y.name && x.robot == y.robot && x.placement == y.placement && x.q == y.q &&
           x.base == y.base && x.base_trajectory == y.base_trajectory;
  };
  const auto ways = [](const model::PlacedTrajectory& x, const model::PlacedTrajectory& y) {
    return x.name == y.name && x.trajectory == y.trajectory && x.placement == y.placement;
  };
  const auto held = [](const model::Attachment& x, const model::Attachment& y) {
    return x.object == y.object && x.robot == y.robot && x.link == y.link &&
           x.tool_T_object == y.tool_T_object;
  };
  const auto equal = [](const auto& x, const auto& y, const auto& is_same) {
    return std::equal(x.begin(), x.end(), y.begin(), y.end(), is_same);
  };
  return equal(a.robots, b.robots, robots) && equal(a.trajectories, b.trajectories, ways) &&
         equal(a.attachments, b.attachments, held) && a.gravity == b.gravity;
}

/// The nearest of 1, 1.25, 1.6, 2, 2.5, ... (ten a decade), so that lengths which follow the size
/// of a world stay as they are while something in it is moved a little.
double preferred(double length) { return std::pow(10.0, std::round(10 * std::log10(length)) / 10); }

MemberPtr place_member(MemberKind kind, const std::string& name, AnyId world, const Pose& pose,
                       Shape shape) {
  auto m = std::make_shared<Member>();
  m->kind = kind;
  m->is_placed = true;
  m->name = name;
  m->what = world;
  layer_of(*m, ShapeLayer::bodies) = std::make_shared<const Shape>(std::move(shape));
  m->bodies = {pose};
  m->box = empty_box();
  return m;
}

/// The axes of a place, in its own frame.
Element<render::Triad> axes(render::Triad triad, std::uint32_t number) {
  Element<render::Triad> e;
  triad.id = 0;
  triad.pose = {};
  e.what = std::move(triad);
  e.group = kPlaceBody;
  e.number = number;
  return e;
}

/// Takes the members of the last frame that look and stand the same.
void keep_unchanged(MemberList& list, std::vector<MemberPtr> made) {
  const auto is_same = [](const Member& a, const Member& b) {
    const Shape &x = *a.shape(ShapeLayer::bodies), &y = *b.shape(ShapeLayer::bodies);
    const auto same_looks = [](const auto& s, const auto& t) { return same(s.what, t.what); };
    return a.name == b.name &&
           std::equal(x.triads.begin(), x.triads.end(), y.triads.begin(), y.triads.end(),
                      same_looks) &&
           std::equal(x.lights.begin(), x.lights.end(), y.lights.begin(), y.lights.end(),
                      same_looks);
  };
  list.resize(std::min(list.size(), made.size()));
  for (std::size_t i = 0; i < made.size(); ++i) {
    if (i >= list.size()) {
      list.push_back(std::move(made[i]));
      continue;
    }
    const MemberPtr& old = std::as_const(list)[i];
    if (!is_same(*old, *made[i])) {
      list[i] = std::move(made[i]);
    } else if (!same(old->bodies.front(), made[i]->bodies.front())) {
      auto moved_one = std::make_shared<Member>(*old);
      moved_one->bodies = made[i]->bodies;
      list[i] = std::move(moved_one);
    }
  }
}

}  // namespace

void SceneModel::Impl::show_places(Work& w) {
  if (w.now->frames.empty() && w.now->lights.empty()) {
    w.next->frames.clear();
    w.next->lights.clear();
    return;
  }
  Bounds all = empty_box();
  for (const MemberPtr& m : std::as_const(w.next->bodies)) grow(all, m->box);
  for (const MemberPtr& m : std::as_const(w.next->robots)) grow(all, m->box);
  const double size = diagonal(all) > 0 ? diagonal(all) : 0.1;
  const double length = std::clamp(preferred(0.08 * size), 0.02, 0.25);
  std::vector<MemberPtr> frames, lights;
  for (const model::PlacedFrame& f : w.now->frames) {
    Shape shape;
    shape.triads.push_back(axes(triad_of(f, length), 0));
    frames.push_back(
        place_member(MemberKind::frame, f.name, what, model::pose(f.placement), std::move(shape)));
  }
  for (const model::PlacedLight& l : w.now->lights) {
    Shape shape;
    Element<render::Light> lamp;
    lamp.what = lamp_of(l);
    lamp.what.pose = {};
    lamp.group = kPlaceBody;
    lamp.number = 2;
    shape.lights.push_back(lamp);
    if (w.wanted.extras.frames) shape.triads.push_back(axes(triad_of(l, length), 1));
    lights.push_back(
        place_member(MemberKind::light, l.name, what, model::pose(l.placement), std::move(shape)));
  }
  keep_unchanged(w.next->frames, std::move(frames));
  keep_unchanged(w.next->lights, std::move(lights));
}

Result<void> SceneModel::Impl::show_trajectories(Work& w) {
  const Extras& extras_now = w.wanted.extras;
  MemberList before;
  std::swap(before, w.next->trajectories);
  if (extras_now.paths == ShownPath::none) return {};
  const bool runs_anew = !w.before || !same_runs(*w.before, *w.now) || w.has_other_extras ||
                         std::any_of(w.now->robots.begin(), w.now->robots.end(),
                                     [&](const model::PlacedRobot& r) {
                                       return w.affected.contains(AnyId(r.robot));
                                     }) ||
                         std::any_of(w.now->trajectories.begin(), w.now->trajectories.end(),
                                     [&](const model::PlacedTrajectory& t) {
                                       return w.affected.contains(AnyId(t.trajectory));
                                     });
  std::unordered_map<std::string_view, const MemberPtr*> old;
  for (const MemberPtr& m : std::as_const(before)) old[m->name] = &m;
  for (const model::PlacedTrajectory& t : w.now->trajectories) {
    MemberPtr was;
    if (const auto at = old.find(t.name); at != old.end() && !w.is_anew) was = *at->second;
    if (was && was->what != AnyId(t.trajectory)) was = nullptr;
    const Pose pose = model::pose(t.placement);
    const bool is_checked = extras_now.path_faults && w.path_robot;
    const bool is_run = is_checked || moves_joints(*w.wanted.snapshot, t.trajectory);
    // What a check finds depends on loads, limits and obstacles: on the whole world.
    const bool is_anew = is_checked ? w.affected.contains(what) || runs_anew : is_run && runs_anew;
    const bool is_outstanding = was && outstanding.contains(t.name);
    if (was && !w.is_touched(AnyId(t.trajectory)) && !is_anew && !is_outstanding) {
      if (!same(was->bodies.front(), pose)) {
        auto m = std::make_shared<Member>(*was);
        m->bodies = {pose};
        was = std::move(m);
      }
      w.next->trajectories.push_back(std::move(was));
      continue;
    }
    ShapePtr shape;
    if (!is_run) {
      auto made = path_shape(w.source, t, extras_now);
      // A coarse frame does not wait for a script that is busy.
      const bool is_late = !made.ok() && made.error().code == ErrorCode::cancelled &&
                           w.detail == Detail::coarse && !w.progress.cancelled();
      if (made.ok()) shape = std::move(made).value();
      else if (made.error().code != ErrorCode::unsupported && !is_late)
        return std::move(made).error();
    }
    if (!shape && w.detail == Detail::coarse) {
      w.is_exact = false;
      w.outstanding.insert(t.name);
      if (was) w.next->trajectories.push_back(std::move(was));
      continue;
    }
    if (!shape && is_checked) {
      RMP_TRY_ASSIGN(shape, checked_path_shape(w.source, WorldId{what.number}, t, extras_now,
                                               *w.path_robot, w.progress));
    }
    if (!shape) {
      RMP_TRY_ASSIGN(shape, tool_path_shape(w.source, WorldId{what.number}, t, extras_now,
                                            w.path_base, w.path_robot, w.progress));
    }
    w.outstanding.erase(t.name);
    auto m = std::make_shared<Member>();
    m->kind = MemberKind::trajectory;
    m->is_placed = true;
    m->name = t.name;
    m->what = AnyId(t.trajectory);
    layer_of(*m, ShapeLayer::bodies) = std::move(shape);
    m->bodies = {pose};
    m->box = empty_box();
    w.next->trajectories.push_back(std::move(m));
  }
  return {};
}

}  // namespace robomosp::scene
