// SPDX-License-Identifier: Apache-2.0
// Renderers built against robomosp.renderer/1 (layer: core).
#pragma once

namespace robomosp {

/// A renderer of today (render::Renderer*) around one of then, which it owns.
[[nodiscard]] void* renderer_of_1(void* made);

}  // namespace robomosp
