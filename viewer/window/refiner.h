// SPDX-License-Identifier: GPL-3.0-or-later
// Refiner: draws the still of best quality that replaces the picture of a display at rest, on a
// thread of the executor with a separate context (layer: GUI). Between stills it frees what it
// has drawn with.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <QImage>
#include <QTimer>

#include "viewer/frame.h"
#include "viewer/window/views.h"

namespace robomosp::viewer {

/// What a still shows.
struct StillRequest {
  Frame frame;
  std::shared_ptr<const Playback> playback;
  std::optional<double> time;  ///< [s]
  std::vector<std::uint64_t> selected;
  std::vector<SceneShot> shots;
  Stereo stereo = Stereo::none;
  QSize size;  ///< of the whole [px]
  bool is_dark = false;
  Colour accent;
  double zoom = 1;  ///< of texts
};

/// The process ends only after the pass that is being drawn. [GUI thread]
class Refiner {
 public:
  Refiner();
  ~Refiner();  ///< cancels; does not wait for the pass that is being drawn
  Refiner(const Refiner&) = delete;
  Refiner& operator=(const Refiner&) = delete;

  /// Draws this instead of what it draws now.
  void start(StillRequest request);
  /// Stops after the present pass.
  void cancel();
  /// True while it draws.
  [[nodiscard]] bool is_busy() const;

  /// Called with a first, coarser still and with the finished one.
  std::function<void(const QImage& still, bool is_finished)> on_still;
  /// Called once if the system draws no stills.
  std::function<void()> on_failure;

 private:
  struct State;
  static void work(const std::shared_ptr<State>& state);
  void run();
  std::shared_ptr<State> state_;
  QTimer free_;  ///< expires a while after the last still
};

}  // namespace robomosp::viewer
