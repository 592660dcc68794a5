// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures without a window, display server or graphics card: EGL without a surface, OpenGL into
// memory (layer: GUI). This is what `render` on the command line and the tests use.
#pragma once

#include <memory>
#include <string>

#include <robomosp/sdk/result.h>

#include "viewer/frame.h"
#include "viewer/scene/image.h"
#include "viewer/scene/scene_view.h"

namespace robomosp::viewer {

/// A scene with its own OpenGL context that averages many passes into one still: each shifted
/// within the pixel, lit from another point of the lamp and of the sky. This gives anti-aliasing,
/// soft shadows and ambient occlusion at once. Belongs to the thread that made it; the context is
/// current only during its calls, and one that was current before (EGL) is again afterwards.
class OffscreenRenderer {
 public:
  /// Width and height 16..8192 px. Fails if the system offers no OpenGL through EGL.
  [[nodiscard]] static Result<OffscreenRenderer> create(int width, int height, Quality quality);
  OffscreenRenderer(OffscreenRenderer&&) noexcept;
  OffscreenRenderer& operator=(OffscreenRenderer&&) noexcept;
  ~OffscreenRenderer();

  /// What is drawn. After changing it, call `restart`.
  [[nodiscard]] SceneView& scene();
  /// Changes the size of the picture [px], held to 16..8192, and forgets the passes drawn so far.
  void resize(int width, int height);
  /// Forgets the passes drawn so far.
  void restart();
  /// Draws one more pass. Returns false when all have been drawn and it did nothing.
  bool step();
  /// Passes drawn and wanted.
  [[nodiscard]] int passes_done() const;
  [[nodiscard]] int passes_wanted() const;
  /// More passes look better and take longer, 1..1024; forgets those drawn so far.
  void set_passes(int count);
  /// The mean of the passes drawn so far with its opacity and projection.
  [[nodiscard]] render::Image picture() const;
  /// The mean of the passes drawn so far; black before the first.
  [[nodiscard]] Image image() const;
  /// Name of the OpenGL renderer, such as "llvmpipe (LLVM 15.0.6, 256 bits)".
  [[nodiscard]] const std::string& renderer_name() const;

 private:
  struct Impl;
  explicit OffscreenRenderer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Fails unless width and height are 16..8192 px.
[[nodiscard]] Result<void> check_size(int width, int height);

/// Draws a frame. The same frame gives the same bytes on the same machine.
[[nodiscard]] Result<Image> render_image(const Frame& frame, int width, int height,
                                         Quality quality = Quality::quality);

/// Draws a frame into a PNG file.
[[nodiscard]] Result<void> render_png(const Frame& frame, int width, int height, Quality quality,
                                      const std::string& path);

}  // namespace robomosp::viewer
