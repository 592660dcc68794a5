// SPDX-License-Identifier: Apache-2.0
// The files of scene/replay as texts; replay_files.cpp is made of them when the tree is built
// (layer: application, scene). Internal to modules/scene.
#pragma once

#include <string_view>

namespace robomosp::scene {

extern const std::string_view kReplayPage;    ///< page.html, with @NAME@ where texts go
extern const std::string_view kReplayStyle;   ///< style.css
extern const std::string_view kReplayScript;  ///< all scripts, one after the other

}  // namespace robomosp::scene
