// SPDX-License-Identifier: GPL-3.0-or-later
// The poses of a Playback, under the viewer's name (layer: GUI).
#pragma once

#include "scene/playback.h"
#include "viewer/frame.h"

namespace robomosp::viewer {

using scene::check;
using scene::duration;
using scene::poses_at;

}  // namespace robomosp::viewer
