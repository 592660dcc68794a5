// SPDX-License-Identifier: Apache-2.0
// LiveScene: the scene of a record that follows the document, runs and what is to be shown,
// computed on threads of the executor (layer: application, scene). Why:
// docs/decisions/0095-live-scene.md.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string_view>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "evaluation/derived.h"
#include "kernel/executor.h"
#include "kernel/registry.h"
#include "scene/frame.h"
#include "scene/scene_model.h"

namespace robomosp::scene {

/// Whoever calls it never waits for what is computed: it notes what is wanted and returns. Only the
/// newest wish counts, so that it does not fall behind a gesture or a run. A frame with coarse
/// meshes may come first; an exact one follows. [any thread]
class LiveScene {
 public:
  /// All must outlive it.
  LiveScene(evaluation::Derived&, const Registry&, AnyId what,
            Executor& executor = Executor::of_process(),
            collision::CollisionCache* collision_models = nullptr);
  ~LiveScene();  ///< stops what is computed and waits until it has ended
  LiveScene(const LiveScene&) = delete;
  LiveScene& operator=(const LiveScene&) = delete;

  /// Shows the document at this snapshot: to be called after commits, previews of gestures
  /// included. Between two calls any number of commits may lie.
  void follow(document::SnapshotPtr);
  /// Shows this besides the bodies.
  void show(Extras);
  /// Turns a layer on or off by its name, see set_layer().
  Result<void> show_layer(std::string_view name, bool is_shown);
  /// Moves robots and objects to where a run or a recording has them; null = back to the document.
  void move(MotionPtr);
  /// Computes all shapes anew: when providers changed.
  void refresh();

  /// The newest frame; one with number 0 and nothing in it before the first.
  [[nodiscard]] FramePtr frame() const;
  /// Whether an exact frame of the newest wish is still to come.
  [[nodiscard]] bool is_busy() const;
  /// Called after each new frame by the thread that made it; it returns soon, and calls nothing of
  /// this scene but frame(). Replaces the one before.
  void on_frame(std::function<void()> wake);
  /// Waits until the newest wish is shown exactly and returns that frame; the only error is
  /// ErrorCode::cancelled, within 100 ms of the wish.
  Result<FramePtr> settle(Progress&);

 private:
  class Interruptible;
  /// Changes what is wanted with `change`, and sees to it that it is computed.
  template <class Change>
  void want(const Change& change);
  void work();
  void publish(const FramePtr& frame);
  evaluation::Derived& derived_;
  const Registry& registry_;
  Executor& executor_;
  SceneModel model_;  ///< of the thread that works
  int stops_ = 0;     ///< the same: of updates without something newer
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by mutex_:
  Wanted wanted_;
  std::uint64_t version_ = 0, shown_ = 0;  ///< of what is wanted, and of what is shown exactly
  bool is_working_ = false, is_ending_ = false, is_to_forget_ = false;
  FramePtr frame_;
  std::shared_ptr<const std::function<void()>> wake_;
};

}  // namespace robomosp::scene
