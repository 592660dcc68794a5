// SPDX-License-Identifier: Apache-2.0
// Adapts renderers built for robomosp.renderer/1 (layer: core).
#pragma once

namespace robomosp {

/// Wraps an old renderer, which it owns, as a current one (render::Renderer*).
[[nodiscard]] void* renderer_of_1(void* made);

}  // namespace robomosp
