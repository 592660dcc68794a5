// SPDX-License-Identifier: Apache-2.0
// The solids that a solid or object consists of, and through which parts they got there (layer:
// application, scene). Internal to modules/scene. [any thread]
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "document/document.h"

namespace robomosp::scene {

/// A solid within an object, or one on its own.
struct LeafPart {
  /// A part of an object, by its place in the list.
  struct Step {
    ObjectId object;
    std::int32_t part = 0;
  };
  SolidId solid;
  std::string name;         ///< "gripper.finger"; the solid's name if it is not in an object
  Pose placement;           ///< outermost_T_solid
  MaterialId material;      ///< that it looks like; may be none
  std::vector<Step> steps;  ///< outermost first; none of a solid on its own
};

/// In the order of evaluation::Derived::drawables(), which draws each as one mesh, or as several
/// where the solid fails. References that lead nowhere are left out, as are solids beyond 100,000.
[[nodiscard]] std::vector<LeafPart> leaf_parts(const document::Snapshot&, AnyId solid_or_object);

}  // namespace robomosp::scene
