// SPDX-License-Identifier: Apache-2.0
// Scenes of records that commands are asked about again and again, each made from the one before it
// (layer: application). Internal to modules/ioci.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <utility>

#include "ioci/core/commands.h"
#include "scene/extras.h"
#include "scene/frame.h"
#include "scene/motion.h"
#include "scene/scene_model.h"

namespace robomosp::ioci {

/// The scenes used last, the newest first. Kept with the application. [any thread]
class FollowedScenes {
 public:
  explicit FollowedScenes(Application&) {}

  /// The newest frame of a record, made from the one that was given last.
  Result<scene::FramePtr> frame(CommandContext& ctx, AnyId id, scene::Extras extras,
                                scene::MotionPtr motion) {
    const std::shared_ptr<Followed> followed = find(ctx, id);
    scene::Wanted wanted;
    wanted.snapshot = std::make_shared<const document::Snapshot>(ctx.snapshot());
    wanted.extras = std::move(extras);
    wanted.motion = std::move(motion);
    if (std::unique_lock lock(followed->mutex, std::try_to_lock); lock.owns_lock())
      return followed->model.update(wanted, scene::Detail::exact, ctx.progress);
    // Another session computes it at this moment; nobody waits for somebody else's scene.
    scene::SceneModel alone(ctx.app.derived, ctx.app.registry, id);
    return alone.update(wanted, scene::Detail::exact, ctx.progress);
  }

 private:
  struct Followed {
    Followed(CommandContext& ctx, AnyId what)
        : id(what),
          registry_revision(ctx.app.registry.revision()),
          model(ctx.app.derived, ctx.app.registry, what) {}
    const AnyId id;
    const std::uint64_t registry_revision;  ///< other providers may make other shapes
    std::mutex mutex;
    scene::SceneModel model;  ///< guarded by mutex
  };
  static constexpr std::size_t kKept = 4;

  std::shared_ptr<Followed> find(CommandContext& ctx, AnyId id) {
    const std::lock_guard lock(mutex_);
    auto at = std::find_if(kept_.begin(), kept_.end(), [&](const auto& f) {
      return f->id == id && f->registry_revision == ctx.app.registry.revision();
    });
    if (at == kept_.end()) at = kept_.insert(kept_.begin(), std::make_shared<Followed>(ctx, id));
    kept_.splice(kept_.begin(), kept_, at);
    while (kept_.size() > kKept) kept_.pop_back();
    return kept_.front();
  }
  std::mutex mutex_;
  std::list<std::shared_ptr<Followed>> kept_;  // guarded by mutex_
};

}  // namespace robomosp::ioci
