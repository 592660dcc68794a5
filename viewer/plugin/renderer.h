// SPDX-License-Identifier: GPL-3.0-or-later
// OsgRenderer: the interface robomosp.renderer/2 by OpenSceneGraph and EGL (layer: GUI).
#pragma once

#include <memory>

#include <robomosp/sdk/render.h>

namespace robomosp::viewer {

/// Keeps its OpenGL contexts from picture to picture. One picture at a time. [any thread]
class OsgRenderer final : public render::Renderer {
 public:
  OsgRenderer();
  ~OsgRenderer() override;
  Result<render::Image> draw(const render::Scene&, const render::Options&,
                             Progress&) const override;
  Result<std::string> png(const render::Image&) const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace robomosp::viewer
