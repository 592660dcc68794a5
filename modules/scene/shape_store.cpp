// SPDX-License-Identifier: Apache-2.0
#include "scene/shape_store.h"

#include <utility>

#include "document/changed.h"
#include "scene/body_shape.h"

namespace robomosp::scene {
namespace {

constexpr double kCoarser = 20;         ///< chord of a coarse mesh by that of the exact one
constexpr double kFrameOfSize = 0.12;   ///< length of a body's frames by its own size
constexpr double kSizeOfNothing = 0.1;  ///< [m]

}  // namespace

void ShapeStore::renew(const document::SnapshotPtr& snapshot) {
  if (snapshot_ == snapshot) return;
  if (snapshot_)
    for (const AnyId id :
         document::dependents(*snapshot, document::changed_records(*snapshot_, *snapshot))) {
      bodies_.erase(id);
      coarse_.erase(id);
      if (const auto at = robots_.find(id); at != robots_.end()) at->second.is_current = false;
    }
  snapshot_ = snapshot;
}

void ShapeStore::forget() {
  bodies_.clear();
  coarse_.clear();
  robots_.clear();
}

void ShapeStore::keep_bodies(const std::unordered_map<AnyId, std::vector<std::size_t>>& used) {
  std::erase_if(bodies_, [&](const auto& one) { return !used.contains(one.first); });
  std::erase_if(coarse_, [&](const AnyId id) { return !used.contains(id); });
}

void ShapeStore::keep_robots(const std::unordered_set<AnyId>& used) {
  std::erase_if(robots_, [&](const auto& one) { return !used.contains(one.first); });
}

bool ShapeStore::has_exact(AnyId what) const {
  return bodies_.contains(what) && !coarse_.contains(what);
}

Result<void> ShapeStore::prepare(const std::vector<AnyId>& bodies, Progress& progress) {
  std::vector<AnyId> missing;
  for (const AnyId id : bodies)
    if (!has_exact(id)) missing.push_back(id);
  if (missing.size() < 2) return {};
  return derived_.prepare(*snapshot_, missing, progress);
}

Result<ShapePtr> ShapeStore::bodies(AnyId what, Detail detail, Progress& progress) {
  const auto at = bodies_.find(what);
  if (at != bodies_.end() && (detail == Detail::coarse || !coarse_.contains(what)))
    return at->second.bodies;
  Body made;
  if (what.kind == Kind::material) {
    const auto* material = snapshot_->get(MaterialId{what.number});
    made.bodies = material_shape(material ? *material : model::Material{});
  } else if (detail == Detail::coarse) {
    RMP_TRY_ASSIGN(made.bodies, coarse_body_shape(source(), what, kCoarser, progress));
    coarse_.insert(what);
  } else {
    RMP_TRY_ASSIGN(made.bodies, body_shape(source(), what, progress));
    coarse_.erase(what);
  }
  return (bodies_[what] = std::move(made)).bodies;
}

Result<ShapePtr> ShapeStore::mark(AnyId what, Progress& progress) {
  Body& body = bodies_.at(what);
  if (!body.mark) {
    RMP_TRY_ASSIGN(body.mark, body_mark(source(), what, *body.bodies, progress));
  }
  return body.mark;
}

ShapePtr ShapeStore::frames(AnyId what) {
  Body& body = bodies_.at(what);
  if (!body.frames) {
    const double size = body.bodies->boxes.empty() ? 0 : diagonal(body.bodies->boxes[0]);
    body.frames = body_frames(*snapshot_, what, kFrameOfSize * (size > 0 ? size : kSizeOfNothing));
  }
  return body.frames;
}

ShapePtr ShapeStore::dimensions(AnyId what) {
  Body& body = bodies_.at(what);
  if (!body.dimensions) body.dimensions = body_dimensions(*body.bodies);
  return body.dimensions;
}

Result<const ShapeStore::Robot*> ShapeStore::robot(RobotId id, Detail detail, Progress& progress) {
  Robot& robot = robots_[AnyId(id)];
  if (robot.is_current || detail == Detail::coarse) return &robot;
  auto base = robot_base(source(), id, progress);
  if (!base.ok() && base.error().code == ErrorCode::cancelled) return std::move(base).error();
  robot = {};
  robot.is_current = true;
  if (!base.ok()) {
    robot.failure = std::move(base).error();
    return &robot;
  }
  robot.base = std::move(base).value();
  robot.bodies = robot_shape(*snapshot_, *robot.base);
  robot.frames = robot_frames(*robot.base);
  return &robot;
}

}  // namespace robomosp::scene
