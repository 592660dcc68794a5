// SPDX-License-Identifier: Apache-2.0
// Poses that are the identity up to rounding (layer: data processing, spatial). [any thread]
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>

#include <robomosp/sdk/types.h>

namespace robomosp::spatial {

/// The pose itself, or empty if it is the identity: within 1e-9 m, 1e-9 of a direction.
[[nodiscard]] inline std::optional<Pose> unless_identity(const Pose& p) {
  constexpr double kSame = 1e-9;
  double away = 0;
  for (const double x : p.p) away = std::fmax(away, std::fabs(x));
  for (std::size_t i = 0; i < 9; ++i)
    away = std::fmax(away, std::fabs(p.R[i] - (i % 4 == 0 ? 1.0 : 0.0)));
  return away < kSame ? std::nullopt : std::optional(p);
}

}  // namespace robomosp::spatial
