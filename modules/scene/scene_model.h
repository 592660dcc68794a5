// SPDX-License-Identifier: Apache-2.0
// SceneModel: what build() and LiveScene share: the frames of a record, each made from the one
// before it by what changed (layer: application, scene).
#pragma once

#include <memory>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "collision/cache.h"
#include "evaluation/derived.h"
#include "kernel/registry.h"
#include "scene/extras.h"
#include "scene/frame.h"
#include "scene/motion.h"

namespace robomosp::scene {

/// What a frame is to show.
struct Wanted {
  document::SnapshotPtr snapshot;  ///< never null
  Extras extras;                   ///< all but `explode`, which is a matter of to_scene()
  MotionPtr motion;                ///< null = everything is placed as in the document
};

/// How much work a frame may cost.
enum class Detail : std::uint8_t {
  coarse,  ///< new shapes with coarse meshes; robots, paths, contacts and clearances that need
           ///< computing stay as they were, or are missing
  exact,
};

/// Compares the snapshot with the last one and makes anew what depends on the records that differ.
/// What only moves gets other poses and keeps its meshes. [one thread at a time]
class SceneModel {
 public:
  /// All must outlive it. `collision_models`: kept ones; null = it keeps its own.
  SceneModel(evaluation::Derived&, const Registry&, AnyId what,
             collision::CollisionCache* collision_models = nullptr);
  ~SceneModel();
  SceneModel(const SceneModel&) = delete;
  SceneModel& operator=(const SceneModel&) = delete;

  /// The frame for `wanted`: the last one itself, if that shows it already. The only error is
  /// ErrorCode::cancelled, after which the next call continues from the last frame.
  Result<FramePtr> update(const Wanted& wanted, Detail detail, Progress& progress);
  /// The last frame; an empty one with number 0 before the first.
  [[nodiscard]] const FramePtr& frame() const;
  /// Forgets all shapes, so that they are computed anew: when providers changed.
  void forget();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace robomosp::scene
