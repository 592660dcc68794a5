// SPDX-License-Identifier: GPL-3.0-or-later
// What the door of the plugin render_osg finds in its engine.
#include "viewer/plugin/renderer.h"

/// Makes the renderer.
extern "C" __attribute__((visibility("default"))) robomosp::render::Renderer*
robomosp_render_osg_create() {
  return new robomosp::viewer::OsgRenderer();
}
