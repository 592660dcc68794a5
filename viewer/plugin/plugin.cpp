// SPDX-License-Identifier: GPL-3.0-or-later
// The door of the plugin render_osg: OpenSceneGraph is a heavy library that most runs never need,
// so it is opened with the first picture.
#include <robomosp/sdk/plugin.h>

#include "viewer/plugin/renderer.h"

using robomosp::viewer::OsgRenderer;

RMP_PLUGIN("org.robomosp.render_osg", "1.0", "GPL-3.0-or-later",
           "Pictures by OpenSceneGraph and EGL, without a window.",
           RMP_PROVIDER_NO_PARAMS(OsgRenderer, "osg",
                                  "Shaded pictures and line drawings by OpenGL, in software or by "
                                  "a graphics card.",
                                  "offscreen,section,hidden_line"))
