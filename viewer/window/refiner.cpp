// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/window/refiner.h"

#include <malloc.h>

#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <utility>

#include <QCoreApplication>

#include "kernel/executor.h"
#include "viewer/scene/offscreen.h"

namespace robomosp::viewer {
namespace {

/// After this time without a new still, geometry and buffers are freed.
constexpr int kFreeMs = 4000;

QImage image_copy(const Image& image) {
  return QImage(image.rgb.data(), image.width, image.height, 3 * image.width, QImage::Format_RGB888)
      .convertToFormat(QImage::Format_RGB32);
}

/// The tasks that draw, of all displays. Never destroyed: tasks use it until the process ends.
struct Drawing {
  std::mutex mutex;
  std::condition_variable none;
  int tasks = 0;  ///< guarded by mutex
  std::atomic<bool> is_ending = false;
};
Drawing& drawing() {
  static auto* const all = new Drawing;
  return *all;
}

/// Software OpenGL compiles on the thread that draws, with objects that are destroyed when the
/// process ends: drawing must have ended before.
void end_drawing() {
  Drawing& all = drawing();
  all.is_ending = true;
  std::unique_lock lock(all.mutex);
  all.none.wait(lock, [&] { return all.tasks == 0; });
}

}  // namespace

struct Refiner::State {
  std::mutex mutex;
  // Guarded by mutex:
  std::optional<StillRequest> wanted;
  std::uint64_t version = 0;  ///< counts up with each start and cancel
  bool is_running = false, is_to_free = false, is_closed = false, is_drawing = false;
  Refiner* owner = nullptr;  ///< null once closed; used by the GUI thread only
  // Of the task that runs:
  std::unique_ptr<OffscreenRenderer> renderer;

  bool is_current(std::uint64_t v) {
    const std::lock_guard lock(mutex);
    return !is_closed && version == v && !drawing().is_ending;
  }
};

Refiner::Refiner() : state_(std::make_shared<State>()) {
  state_->owner = this;
  free_.setSingleShot(true);
  free_.setInterval(kFreeMs);
  QObject::connect(&free_, &QTimer::timeout, [this] {
    {
      const std::lock_guard lock(state_->mutex);
      state_->is_to_free = true;
    }
    run();
  });
}

Refiner::~Refiner() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->is_closed = true;
    state_->owner = nullptr;
    state_->wanted.reset();
  }
  run();  // frees the renderer
}

void Refiner::start(StillRequest request) {
  free_.stop();
  {
    const std::lock_guard lock(state_->mutex);
    state_->wanted = std::move(request);
    ++state_->version;
  }
  run();
}

void Refiner::cancel() {
  const std::lock_guard lock(state_->mutex);
  ++state_->version;
  state_->wanted.reset();
  if (!state_->is_closed && !free_.isActive()) free_.start();
}

bool Refiner::is_busy() const {
  const std::lock_guard lock(state_->mutex);
  return state_->wanted.has_value() || state_->is_drawing;
}

void Refiner::run() {
  {
    const std::lock_guard lock(state_->mutex);
    if (std::exchange(state_->is_running, true)) return;
  }
  // Registered after the display has drawn, so that it is called before the end of OpenGL.
  [[maybe_unused]] static const int is_registered = std::atexit(end_drawing);
  Executor::of_process().run([state = state_]() mutable {
    Drawing& all = drawing();
    {
      const std::lock_guard lock(all.mutex);
      ++all.tasks;
    }
    if (!all.is_ending) work(state);
    state.reset();  // with its renderer, if the display is gone
    const std::lock_guard lock(all.mutex);
    if (--all.tasks == 0) all.none.notify_all();
  });
}

void Refiner::work(const std::shared_ptr<State>& state) {
  // Hands a call to the GUI thread; there it is dropped if the display is gone or wants another.
  const auto post = [&](std::uint64_t version, std::function<void(Refiner&)> call) {
    QCoreApplication* application = QCoreApplication::instance();
    if (!application || !state->is_current(version)) return;
    QMetaObject::invokeMethod(
        application,
        [state, version, call = std::move(call)] {
          if (state->owner && state->is_current(version)) call(*state->owner);
        },
        Qt::QueuedConnection);
  };
  for (;;) {
    std::optional<StillRequest> request;
    std::uint64_t version = 0;
    bool frees = false;
    {
      const std::lock_guard lock(state->mutex);
      state->is_drawing = false;
      if (drawing().is_ending) state->wanted.reset();
      request = std::exchange(state->wanted, std::nullopt);
      version = state->version;
      frees = std::exchange(state->is_to_free, false) || state->is_closed;
      if (!request && !frees) {
        state->is_running = false;
        return;
      }
      state->is_drawing = request.has_value();
    }
    if (!request) {
      const bool had = std::exchange(state->renderer, nullptr) != nullptr;
      // Otherwise the C library keeps the memory for later.
      if (had) malloc_trim(0);
      const std::lock_guard lock(state->mutex);
      if (!state->is_closed) continue;
      state->is_running = false;
      return;
    }
    if (!state->renderer) {
      const QSize size = request->shots.front().rect.size();
      auto made = OffscreenRenderer::create(size.width(), size.height(), Quality::quality);
      if (!made) {
        post(version, [](Refiner& r) {
          if (r.on_failure) r.on_failure();
        });
        continue;
      }
      state->renderer = std::make_unique<OffscreenRenderer>(std::move(made).value());
    }
    OffscreenRenderer& renderer = *state->renderer;
    SceneView& scene = renderer.scene();
    scene.set_dark(request->is_dark);
    scene.set_accent(request->accent);
    scene.set_zoom(request->zoom);
    scene.sync(request->frame);
    scene.set_playback(request->playback);
    if (request->time) scene.set_time(*request->time);
    scene.select(request->selected);
    // A coarser picture first, then the finished one.
    std::vector<QImage> images(request->shots.size());
    const auto draw = [&](std::size_t i, int passes) {
      const SceneShot& shot = request->shots[i];
      if (passes == 0 || request->shots.size() > 1 || renderer.passes_done() == 0) {
        renderer.resize(shot.rect.width(), shot.rect.height());
        scene.camera() = shot.camera;
        scene.camera().set_viewport(shot.rect.width(), shot.rect.height());
        scene.set_shift(shot.shift);
      }
      while (renderer.passes_done() < passes && renderer.step())
        if (!state->is_current(version)) return false;
      images[i] = image_copy(renderer.image());
      return true;
    };
    renderer.restart();
    const int all = renderer.passes_wanted();
    bool is_whole = true;
    for (const int passes : {all / 4, all}) {
      for (std::size_t i = 0; i < images.size() && is_whole; ++i) is_whole = draw(i, passes);
      if (!is_whole) break;
      const QImage still = composed(request->shots, images, request->stereo, request->size);
      const bool is_finished = passes == all;
      post(version, [still, is_finished](Refiner& r) {
        if (is_finished) r.free_.start();
        if (r.on_still) r.on_still(still, is_finished);
      });
    }
  }
}

}  // namespace robomosp::viewer
