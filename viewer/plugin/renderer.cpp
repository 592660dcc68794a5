// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/plugin/renderer.h"

#include <cmath>
#include <mutex>
#include <optional>
#include <utility>

#include "viewer/scene/image.h"
#include "viewer/scene/linear.h"
#include "viewer/scene/offscreen.h"

namespace robomosp::viewer {
namespace {

int passes_of(render::Quality quality) {
  switch (quality) {
    case render::Quality::draft: return 4;
    case render::Quality::normal: return 8;
    case render::Quality::high: return 24;
  }
  return 8;
}

Result<void> check(const render::Look& look) {
  if (look.section) {
    const double length = norm(look.section->normal);
    if (!is_finite(look.section->point) || !std::isfinite(length) || !(length > 0))
      return error(ErrorCode::invalid_argument, "the section has no direction",
                   "Give a normal that is not zero.", "section");
  }
  const Camera& c = look.camera;
  if (c.view == Camera::View::custom) {
    if (!c.eye || !c.target || !is_finite(*c.eye) || !is_finite(*c.target) ||
        norm(*c.eye - *c.target) < 1e-6)
      return error(ErrorCode::invalid_argument, "the eye is at the target or one is missing",
                   "Give two different points, eye and target.", "camera");
  }
  return {};
}

}  // namespace

struct OsgRenderer::Impl {
  std::mutex mutex;
  std::optional<OffscreenRenderer> fast, quality;  // guarded by mutex
};

OsgRenderer::OsgRenderer() : impl_(std::make_unique<Impl>()) {}
OsgRenderer::~OsgRenderer() = default;

Result<render::Image> OsgRenderer::draw(const render::Scene& scene, const render::Options& options,
                                        Progress& progress) const {
  RMP_TRY(check(options.look));
  const std::lock_guard lock(impl_->mutex);
  // Drawings have no light to be computed well.
  const bool is_fast = options.quality == render::Quality::draft ||
                       options.look.style == Style::wireframe ||
                       options.look.style == Style::hidden_line;
  auto& kept = is_fast ? impl_->fast : impl_->quality;
  RMP_TRY(check_size(options.width, options.height));
  if (!kept) {
    RMP_TRY_ASSIGN(auto made,
                   OffscreenRenderer::create(options.width, options.height,
                                             is_fast ? Quality::fast : Quality::quality));
    kept.emplace(std::move(made));
  }
  OffscreenRenderer& r = *kept;
  r.set_passes(passes_of(options.quality));
  Frame frame;
  static_cast<render::Scene&>(frame) = scene;
  static_cast<render::Look&>(frame) = options.look;
  r.scene().forget_camera();
  r.resize(options.width, options.height);
  r.scene().sync(frame);
  while (r.step()) {
    if (progress.cancelled())
      return error(ErrorCode::cancelled, "the picture was cancelled", "Draw it again.");
    progress.report(static_cast<double>(r.passes_done()) / r.passes_wanted(), "drawing");
  }
  render::Image image = r.picture();
  // The scene's meshes are let go; what the graphics library holds of them goes with them.
  r.scene().sync(Frame{});
  return image;
}

Result<std::string> OsgRenderer::png(const render::Image& image) const { return png_of(image); }

}  // namespace robomosp::viewer
