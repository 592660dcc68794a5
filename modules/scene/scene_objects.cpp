// SPDX-License-Identifier: Apache-2.0
// Objects of a scene: only those are looked at whose block of the world's list, record or holder
// changed.
#include <algorithm>
#include <utility>

#include "model/placement.h"
#include "scene/scene_model_impl.h"

namespace robomosp::scene {
namespace {

using Objects = model::LongList<model::PlacedObject>;

/// Whether two lists have the same objects in the same order; `see` gets the places of those that
/// were moved.
template <class See>
bool same_members(const Objects& before, const Objects& now, See&& see) {
  if (before.size() != now.size()) return false;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (before.shares_block(now, i)) {
      i += Objects::kBlock - 1 - i % Objects::kBlock;
      continue;
    }
    const model::PlacedObject &a = before[i], &b = now[i];
    if (a.name != b.name || a.what != b.what) return false;
    if (!(a.placement == b.placement)) see(i);
  }
  return true;
}

const model::World* world_of(const document::RecordPtr& record) {
  return record ? std::get_if<model::World>(&record->body) : nullptr;
}

}  // namespace

bool SceneModel::Impl::can_be_finer(const Work& w, AnyId id) const {
  return coarse.contains(id) && (w.detail == Detail::exact || store.has_exact(id));
}

void SceneModel::Impl::index_objects(Work& w) {
  const document::RecordPtr now = w.wanted.snapshot->share(what);
  if (indexed == now) return;
  const model::World* last = world_of(indexed);
  const bool is_known = last && same_members(last->objects, w.now->objects, [](std::size_t) {});
  indexed = now;
  if (is_known) return;
  object_at.clear();
  users.clear();
  for (std::size_t i = 0; i < w.now->objects.size(); ++i) {
    object_at.emplace(w.now->objects[i].name, i);
    users[w.now->objects[i].what].push_back(i);
  }
  store.keep_bodies(users);
}

Result<void> SceneModel::Impl::show_objects(Work& w) {
  const Objects& list = w.now->objects;
  index_objects(w);
  std::vector<std::size_t> touched;
  const auto touch = [&](std::size_t i) { touched.push_back(i); };
  const auto touch_users = [&](AnyId id) {
    if (const auto at = users.find(id); at != users.end())
      touched.insert(touched.end(), at->second.begin(), at->second.end());
  };
  const auto touch_named = [&](const std::string& name) {
    if (const auto at = object_at.find(name); at != object_at.end()) touch(at->second);
  };
  const bool is_same_list = w.before && same_members(w.before->objects, list, touch);
  if (!is_same_list || w.has_other_extras) {
    touched.clear();
    for (std::size_t i = 0; i < list.size(); ++i) touch(i);
  } else {
    for (const AnyId id : w.affected) touch_users(id);
    for (const AnyId id : coarse)
      if (can_be_finer(w, id)) touch_users(id);
    for (const Motion* m : {motion.get(), w.wanted.motion.get()})
      if (m && motion != w.wanted.motion)
        for (const auto& [name, pose] : m->objects) touch_named(name);
    for (const auto& [name, pose] : held)
      if (const auto at = w.held.find(name); at == w.held.end() || !same(at->second, pose))
        touch_named(name);
    for (const auto& [name, pose] : w.held)
      if (!held.contains(name)) touch_named(name);
    std::sort(touched.begin(), touched.end());
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  }
  if (w.detail == Detail::exact) {
    std::unordered_set<AnyId> missing;
    AnyId last;  // neighbours often are of the same record
    for (const std::size_t i : touched) {
      if (list[i].what == last) continue;
      last = list[i].what;
      if (!store.has_exact(last)) missing.insert(last);
    }
    RMP_TRY(store.prepare({missing.begin(), missing.end()}, w.progress));
  }
  std::unordered_map<std::string_view, const MemberPtr*> old;
  const bool is_new_list = !is_same_list || w.has_other_extras;
  if (!is_same_list)
    for (const MemberPtr& m : frame->bodies) old[m->name] = &m;
  if (is_new_list) w.next->bodies.clear();
  for (const std::size_t i : touched) {
    const model::PlacedObject& o = list[i];
    Pose pose = model::pose(o.placement);
    if (const auto hand = w.held.find(o.name); hand != w.held.end()) pose = hand->second;
    if (const Motion* m = w.wanted.motion.get())
      if (const auto at = m->objects.find(o.name); at != m->objects.end()) pose = at->second;
    MemberPtr before;
    if (is_same_list) {
      before = frame->bodies[i];
    } else if (const auto at = old.find(o.name); at != old.end() && !w.is_anew) {
      before = *at->second;
    }
    RMP_TRY_ASSIGN(MemberPtr member, object_member(w, o.name, true, o.what, pose, before));
    if (is_new_list) w.next->bodies.push_back(std::move(member));
    else if (member != before) w.next->bodies[i] = std::move(member);
  }
  return {};
}

Result<MemberPtr> SceneModel::Impl::object_member(Work& w, const std::string& name, bool is_placed,
                                                  AnyId id, const Pose& pose,
                                                  const MemberPtr& before) {
  // An update that was cancelled may have dropped shapes that this frame shows again after an undo.
  const bool keeps_bodies = before && before->what == id && before->name == name && !w.is_anew &&
                            !w.affected.contains(id) && !can_be_finer(w, id) &&
                            (!w.has_other_extras || store.has(id));
  if (keeps_bodies && !w.has_other_extras && same(before->bodies.front(), pose)) return before;
  auto m = keeps_bodies ? std::make_shared<Member>(*before) : std::make_shared<Member>();
  if (!keeps_bodies) {
    m->kind = id.kind == Kind::material ? MemberKind::material : MemberKind::body;
    m->is_placed = is_placed;
    m->name = name;
    m->what = id;
    RMP_TRY_ASSIGN(layer_of(*m, ShapeLayer::bodies), store.bodies(id, w.detail, w.progress));
  }
  const Shape& bodies = *m->shape(ShapeLayer::bodies);
  if (!keeps_bodies || w.has_other_extras) {
    const Extras& shown = w.wanted.extras;
    const bool has_layers = id.kind != Kind::material;
    ShapePtr mark;
    if (has_layers && shown.com && store.has_exact(id)) {
      RMP_TRY_ASSIGN(mark, store.mark(id, w.progress));
    } else if (has_layers && shown.com) {
      w.is_exact = false;
    }
    layer_of(*m, ShapeLayer::marks) = std::move(mark);
    layer_of(*m, ShapeLayer::frames) = has_layers && shown.frames ? store.frames(id) : ShapePtr();
    layer_of(*m, ShapeLayer::dimensions) =
        has_layers && shown.dimensions ? store.dimensions(id) : ShapePtr();
    layer_of(*m, ShapeLayer::labels) =
        shown.labels
            ? label_of(*m, bodies.boxes.empty() ? empty_box() : bodies.boxes.front(), before)
            : ShapePtr();
  }
  const bool rests = keeps_bodies && same(before->bodies.front(), pose);
  if (!rests) {
    m->bodies.assign(1, pose);
    m->box = bodies.boxes.empty() ? empty_box() : moved(bodies.boxes.front(), pose);
  }
  if (before && before->what == id && before->name == name && before->shapes == m->shapes &&
      same(before->bodies.front(), pose))
    return before;
  return MemberPtr(std::move(m));
}

}  // namespace robomosp::scene
