// SPDX-License-Identifier: Apache-2.0
// Derived geometry as bytes, for files that keep it between runs (layer: application, evaluation).
// Internal to modules/evaluation. [any thread]
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/csg.h>

#include "evaluation/shapes.h"

namespace robomosp::evaluation {

/// Facts about a solid that need no engine.
struct SolidFacts {
  std::array<Vec3, 2> bounds{};
  std::vector<std::string> notes;
};

/// The value as bytes: equal values give equal bytes, and reading restores every bit.
[[nodiscard]] std::string to_bytes(const SolidFacts&);
[[nodiscard]] std::string to_bytes(const Mesh&);
[[nodiscard]] std::string to_bytes(const Moments&);
[[nodiscard]] std::string to_bytes(const std::vector<CsgFeature>&);
[[nodiscard]] std::string to_bytes(const CsgEngine::Partition&);
/// Pieces that share a mesh share it afterwards.
[[nodiscard]] std::string to_bytes(const std::vector<ShapePiece>&);

/// False if the bytes are not such a value: too short or too long, numbers not finite, or vertex
/// indices of triangles out of range.
[[nodiscard]] bool from_bytes(std::string_view, SolidFacts&);
[[nodiscard]] bool from_bytes(std::string_view, Mesh&);
[[nodiscard]] bool from_bytes(std::string_view, Moments&);
[[nodiscard]] bool from_bytes(std::string_view, std::vector<CsgFeature>&);
[[nodiscard]] bool from_bytes(std::string_view, CsgEngine::Partition&);
[[nodiscard]] bool from_bytes(std::string_view, std::vector<ShapePiece>&);

}  // namespace robomosp::evaluation
