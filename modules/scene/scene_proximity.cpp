// SPDX-License-Identifier: Apache-2.0
// Contacts and clearances of a scene: bodies that touch are drawn red, lines show how near others
// are.
#include <algorithm>
#include <cmath>
#include <utility>

#include "collision/collision.h"
#include "evaluation/payload.h"
#include "kernel/text.h"
#include "scene/ids.h"
#include "scene/scene_model_impl.h"

namespace robomosp::scene {
namespace {

using collision::CollisionBody;
using collision::CollisionModel;
using CollisionModelPtr = std::shared_ptr<const CollisionModel>;

constexpr Colour kClearance{0.85F, 0.05F, 0.55F, 1.0F};
constexpr float kClearanceWidth = 4;  ///< [px]

/// Where a body of a collision model is in a scene.
struct BodyPlace {
  bool is_robots = false;
  std::string member;     ///< of the world; "" of a robot on its own
  AnyId what;             ///< the record of that
  std::int32_t body = 0;  ///< of the member
};

class BodyPlaces {
 public:
  /// `object_at` has the places of the world's objects by name; `world` null = a robot on its own.
  BodyPlaces(const document::Snapshot& snapshot, const model::World* world,
             const std::unordered_map<std::string, std::size_t>& object_at,
             const CollisionModel& model)
      : snapshot_(snapshot), world_(world), object_at_(object_at), model_(model) {}

  [[nodiscard]] BodyPlace of(std::int32_t number) const {
    const CollisionBody& b = model_.bodies()[static_cast<std::size_t>(number)];
    BodyPlace at;
    at.is_robots = b.robot >= 0 && !b.is_held;
    if (!at.is_robots) {
      at.member = b.name;
      at.what = object(b.name);
      return at;
    }
    const auto& robot = model_.robots()[static_cast<std::size_t>(b.robot)];
    at.member = robot.name;
    at.what = AnyId(robot.record);
    const std::string link = b.name.substr(robot.name.empty() ? 0 : robot.name.size() + 1);
    if (const model::Robot* record = snapshot_.get(robot.record))
      for (std::size_t i = 0; i < record->links.size(); ++i)
        if (record->links[i].name == link) at.body = static_cast<std::int32_t>(i) + 1;
    return at;
  }

 private:
  [[nodiscard]] AnyId object(const std::string& name) const {
    if (!world_) return {};
    const auto at = object_at_.find(name);
    return at == object_at_.end() ? AnyId{} : world_->objects[at->second].what;
  }
  const document::Snapshot& snapshot_;
  const model::World* world_;
  const std::unordered_map<std::string, std::size_t>& object_at_;
  const CollisionModel& model_;
};

/// The line of a pair, given in the world.
MemberPtr clearance_line(const CollisionModel& model, const BodyPlace& from, bool is_placed,
                         const collision::Contact& contact) {
  const PairDistance& at = contact.at;
  auto shape = std::make_shared<Shape>();
  Element<render::Line> line;
  line.what.points = {at.on_a, at.on_b};
  line.what.colour = kClearance;
  line.what.width = kClearanceWidth;
  line.body = kWorldBody;
  line.group = kLineBody;
  line.of.link = from.is_robots ? from.body : -1;
  Element<render::Label> label;
  for (std::size_t k = 0; k < 3; ++k) label.what.place[k] = 0.5 * (at.on_a[k] + at.on_b[k]);
  label.what.text = text::print_rounded(1000 * at.distance, 3) + " mm";
  label.body = kWorldBody;
  label.group = kNoteBody;
  label.of = line.of;
  shape->lines.push_back(std::move(line));
  shape->labels.push_back(std::move(label));
  auto m = std::make_shared<Member>();
  m->kind = MemberKind::clearance;
  m->is_placed = is_placed;
  m->name = model.describe(contact.pair);
  m->what = from.what;
  m->begins_at = from.member;
  m->box = empty_box();
  layer_of(*m, ShapeLayer::posed) = std::move(shape);
  return m;
}

bool has_member(const MemberList& list, const std::string& name) {
  return std::any_of(list.begin(), list.end(),
                     [&](const MemberPtr& m) { return m->name == name || !m->is_placed; });
}

/// The collision model of a world whose objects a run moves.
Result<CollisionModelPtr> moved_model(const evaluation::Sources& sources, WorldId id,
                                      const model::World& world, const Motion& motion,
                                      Progress& progress) {
  collision::ObjectPlaces places;
  places.moved = motion.objects;
  for (const model::PlacedRobot& r : world.robots) {
    RMP_TRY_ASSIGN(const auto robot,
                   sources.derived.robot_model(sources.snapshot, r.robot, {0, 0, -9.81}, progress));
    RMP_TRY_ASSIGN(auto loads, evaluation::attached_loads(sources, id, r, *robot));
    for (recording::Load& load : loads)
      if (!motion.objects.contains(load.object)) places.held.push_back(std::move(load));
  }
  return CollisionModel::of_world(sources, id, progress, &places);
}

}  // namespace

Result<SceneModel::Impl::Proximity> SceneModel::Impl::proximity_of(Work& w) {
  const Extras& asked = w.wanted.extras;
  const evaluation::Sources sources{store.registry(), store.derived(), *w.wanted.snapshot, &models};
  CollisionModelPtr model;
  if (w.now && w.wanted.motion && !w.wanted.motion->objects.empty()) {
    RMP_TRY_ASSIGN(
        model, moved_model(sources, WorldId{what.number}, *w.now, *w.wanted.motion, w.progress));
  } else {
    RMP_TRY_ASSIGN(model, collision::collision_model(sources, what, w.progress));
  }
  std::vector<double> q = model->shown();
  for (const collision::CollisionRobot& r : model->robots()) {
    const auto at = robot_states.find(w.now ? r.name : w.wanted.snapshot->find(what)->name);
    if (at == robot_states.end()) continue;
    std::copy_n(at->second.q.begin(), std::min(at->second.q.size(), r.model->coordinate_count()),
                q.begin() + static_cast<std::ptrdiff_t>(r.first));
  }
  Proximity out;
  const BodyPlaces places(*w.wanted.snapshot, w.now, object_at, *model);
  if (asked.contacts) {
    RMP_TRY_ASSIGN(const auto hits, model->collisions(q, w.progress));
    for (const CollisionPair& pair : hits)
      for (const std::int32_t number : {pair.a, pair.b}) {
        const BodyPlace at = places.of(number);
        out.touching[{at.is_robots, at.member}].push_back(at.body);
      }
    for (auto& [name, bodies] : out.touching) {
      std::sort(bodies.begin(), bodies.end());
      bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
    }
  }
  if (!asked.clearances) return out;
  std::vector<collision::Contact> pairs;
  if (asked.clearances_below > 0) {
    RMP_TRY_ASSIGN(pairs, model->near(q, asked.clearances_below, w.progress));
  } else {
    RMP_TRY_ASSIGN(pairs, model->clearance(q, w.progress));
  }
  for (const collision::Contact& c : pairs)
    if (c.pair.a >= 0 && c.at.distance > 0 && std::isfinite(c.at.distance))
      out.lines.push_back(clearance_line(*model, places.of(c.pair.a), w.now != nullptr, c));
  return out;
}

Result<void> SceneModel::Impl::show_proximity(Work& w) {
  const Extras& asked = w.wanted.extras;
  if (asked.contacts || asked.clearances) {
    const bool is_known = !w.is_anew && !w.has_other_extras && !w.affected.contains(what) &&
                          motion == w.wanted.motion && !proximity.is_outstanding;
    if (is_known || w.detail == Detail::coarse) {
      w.proximity = proximity;
      if (!is_known) {
        w.proximity.is_outstanding = true;
        w.is_exact = false;
        // What the old lines begin at may be gone.
        std::erase_if(w.proximity.lines, [&](const MemberPtr& m) {
          if (w.now && m->what.kind != Kind::robot) return !object_at.contains(m->begins_at);
          return !has_member(m->what.kind == Kind::robot ? w.next->robots : w.next->bodies,
                             m->begins_at);
        });
      }
    } else {
      auto made = proximity_of(w);
      if (made.ok()) w.proximity = std::move(made).value();
      else if (made.error().code == ErrorCode::cancelled) return std::move(made).error();
      else w.proximity.failure = made.error().sentence();
    }
  }
  if (w.proximity.failure) w.next->troubles.push_back(*w.proximity.failure);
  paint_touching(w);
  w.next->clearances.clear();
  for (const MemberPtr& m : w.proximity.lines) w.next->clearances.push_back(m);
  return {};
}

void SceneModel::Impl::paint_touching(Work& w) {
  const auto touching_of = [&](bool is_robots, const std::string& name) {
    const auto at = w.proximity.touching.find({is_robots, name});
    return at == w.proximity.touching.end() ? std::vector<std::int32_t>() : at->second;
  };
  for (std::size_t i = 0; i < w.next->robots.size(); ++i) {
    const MemberPtr& m = std::as_const(w.next->robots)[i];
    auto touching = touching_of(true, m->is_placed ? m->name : "");
    if (m->touching == touching) continue;
    auto painted = std::make_shared<Member>(*m);
    painted->touching = std::move(touching);
    robot_states[painted->name].member = painted;
    w.next->robots[i] = std::move(painted);
  }
  if (!w.now) return;
  for (const auto* last : {&proximity, &w.proximity})
    for (const auto& [who, bodies] : last->touching) {
      const auto at = who.first ? object_at.end() : object_at.find(who.second);
      if (at == object_at.end() || at->second >= w.next->bodies.size()) continue;
      const MemberPtr& m = std::as_const(w.next->bodies)[at->second];
      auto touching = touching_of(false, who.second);
      if (m->name != who.second || m->touching == touching) continue;
      auto painted = std::make_shared<Member>(*m);
      painted->touching = std::move(touching);
      w.next->bodies[at->second] = std::move(painted);
    }
}

}  // namespace robomosp::scene
