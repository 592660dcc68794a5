// SPDX-License-Identifier: GPL-3.0-or-later
// Frame: the immutable description of one picture in the terms of the SDK, and Playback: how it
// moves (layer: GUI, but free of OSG and Qt). The application builds it; the scene draws it on
// screen or offscreen.
#pragma once

#include <robomosp/sdk/render.h>

#include "scene/playback.h"

namespace robomosp::viewer {

using render::Appearance;
using render::Background;
using render::Camera;
using render::Item;
using render::Line;
using render::MassMark;
using render::Section;
using render::Style;
using render::Triad;
using scene::Playback;

/// Everything in one picture, and how it is shown.
struct Frame : render::Scene, render::Look {};

}  // namespace robomosp::viewer
