// SPDX-License-Identifier: Apache-2.0
#include "scene/live_scene.h"

#include <chrono>
#include <functional>
#include <utility>

#include "kernel/call_queue.h"

namespace robomosp::scene {
namespace {

/// How long a coarse frame waits for solvers of scripts altogether.
constexpr std::chrono::milliseconds kCoarsePatience{50};
/// So often an update may be stopped though nothing newer is wanted.
constexpr int kMostStops = 3;

}  // namespace

/// Stops when something newer is wanted.
class LiveScene::Interruptible final : public Progress {
 public:
  Interruptible(const LiveScene& scene, std::uint64_t version, bool yields)
      : scene_(scene), version_(version), yields_(yields) {}
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override {
    const std::lock_guard lock(scene_.mutex_);
    return scene_.is_ending_ || (yields_ && scene_.version_ != version_);
  }

 private:
  const LiveScene& scene_;
  std::uint64_t version_;
  bool yields_;
};

LiveScene::LiveScene(evaluation::Derived& derived, const Registry& registry, AnyId what,
                     Executor& executor, collision::CollisionCache* collision_models)
    : derived_(derived),
      registry_(registry),
      executor_(executor),
      model_(derived, registry, what, collision_models) {
  frame_ = model_.frame();
}

LiveScene::~LiveScene() {
  std::unique_lock lock(mutex_);
  is_ending_ = true;
  changed_.wait(lock, [this] { return !is_working_; });
}

template <class Change>
void LiveScene::want(const Change& change) {
  {
    const std::lock_guard lock(mutex_);
    if (!change(wanted_)) return;
    ++version_;
    if (is_working_ || !wanted_.snapshot) return;
    is_working_ = true;
  }
  // Without the lock: the executor runs it here if the system gives it no thread.
  executor_.run([this] { work(); });
}

void LiveScene::follow(document::SnapshotPtr snapshot) {
  if (!snapshot) return;
  want([&snapshot](Wanted& w) {
    if (snapshot == w.snapshot) return false;
    w.snapshot.swap(snapshot);  // the old one goes without the lock
    return true;
  });
}

void LiveScene::show(Extras extras) {
  want([&extras](Wanted& w) {
    std::swap(w.extras, extras);
    return true;
  });
}

Result<void> LiveScene::show_layer(std::string_view name, bool is_shown) {
  Result<void> out;
  want([&](Wanted& w) {
    out = set_layer(w.extras, name, is_shown);
    return out.ok();
  });
  return out;
}

void LiveScene::move(MotionPtr motion) {
  want([&motion](Wanted& w) {
    if (motion == w.motion) return false;
    w.motion.swap(motion);
    return true;
  });
}

void LiveScene::refresh() {
  want([this](Wanted&) { return is_to_forget_ = true; });
}

FramePtr LiveScene::frame() const {
  const std::lock_guard lock(mutex_);
  return frame_;
}

bool LiveScene::is_busy() const {
  const std::lock_guard lock(mutex_);
  return wanted_.snapshot && shown_ != version_;
}

void LiveScene::on_frame(std::function<void()> wake) {
  auto shared = wake ? std::make_shared<const std::function<void()>>(std::move(wake)) : nullptr;
  const std::lock_guard lock(mutex_);
  wake_.swap(shared);
}

void LiveScene::publish(const FramePtr& frame) {
  std::shared_ptr<const std::function<void()>> wake;
  FramePtr old;
  {
    const std::lock_guard lock(mutex_);
    if (frame == frame_) return;
    old = std::exchange(frame_, frame);
    wake = wake_;
  }
  if (wake) (*wake)();
}

void LiveScene::work() {
  for (;;) {
    Wanted wanted;
    std::uint64_t version = 0;
    bool forgets = false;
    {
      const std::lock_guard lock(mutex_);
      if (is_ending_ || shown_ == version_) {
        is_working_ = false;
        changed_.notify_all();  // with the lock: who waits may destroy this
        return;
      }
      wanted = wanted_;
      version = version_;
      forgets = std::exchange(is_to_forget_, false);
    }
    if (forgets) model_.forget();
    // The coarse one comes however fast wishes follow each other; the exact one gives way to them.
    Interruptible coarse(*this, version, false), exact(*this, version, true);
    auto frame = [&] {
      // What scripts whose thread is busy have to give follows with the exact one.
      const auto end = std::chrono::steady_clock::now() + kCoarsePatience;
      const std::function<bool()> gives_up = [end] {
        return std::chrono::steady_clock::now() >= end;
      };
      const CallQueue::PatientScope patient(gives_up);
      return model_.update(wanted, Detail::coarse, coarse);
    }();
    if (frame.ok()) {
      publish(*frame);
      if (!(*frame)->is_exact) {
        // Solvers of scripts are waited for as long as their thread is busy: a frame with a failure
        // instead would have to be replaced when the thread is free.
        const std::function<bool()> gives_up = [&exact] { return exact.cancelled(); };
        const CallQueue::PatientScope patient(gives_up);
        frame = model_.update(wanted, Detail::exact, exact);
        if (frame.ok()) publish(*frame);
      }
    }
    const std::lock_guard lock(mutex_);
    // What was stopped by something newer continues with that. A script may be stopped with a
    // command of its session, and is asked again, but a provider that always says so is not.
    stops_ = frame.ok() || version != version_ ? 0 : stops_ + 1;
    if (frame.ok() || stops_ == kMostStops) {
      shown_ = version;
      stops_ = 0;
    }
    changed_.notify_all();
  }
}

Result<FramePtr> LiveScene::settle(Progress& progress) {
  std::unique_lock lock(mutex_);
  while (wanted_.snapshot && shown_ != version_) {
    if (progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
    changed_.wait_for(lock, std::chrono::milliseconds(50));
  }
  return frame_;
}

}  // namespace robomosp::scene
