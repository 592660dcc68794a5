// SPDX-License-Identifier: Apache-2.0
// What a world of contact physics reports of its steps (layer: contract, std only).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

namespace robomosp {

/// Something that a run did not do as asked, or that its answer depends on. One sentence, about one
/// or two bodies where they are not -1; it names them "body 3" (counted from 1) nowhere else.
struct PhysicsNote {
  std::int32_t a = -1, b = -1;
  std::string text;  ///< what follows the names of the bodies, or a whole sentence without bodies
};

/// Of a world, by PhysicsWorld::extension(PhysicsNotes::kId). One thread at a time, as the world.
class PhysicsNotes {
 public:
  static constexpr const char* kId = "robomosp.physics_notes/1";
  virtual ~PhysicsNotes() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// All notes since the world was made, in the order in which they arose; a few dozen at most.
  [[nodiscard]] virtual Result<std::vector<PhysicsNote>> notes() const = 0;
};

}  // namespace robomosp
