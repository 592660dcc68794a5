// SPDX-License-Identifier: Apache-2.0
// Principal moments and axes of inertia (layer: data processing, spatial). [any thread]
#pragma once

#include <array>

#include <robomosp/sdk/types.h>

namespace robomosp::spatial {

/// Principal moments, ascending [kg m^2], and axes as columns (right-handed, row-major).
struct Principal {
  Vec3 moments{};
  std::array<double, 9> axes{};
};
/// Eigenvalues and eigenvectors of a symmetric tensor.
[[nodiscard]] Principal principal(const Sym3& inertia);

}  // namespace robomosp::spatial
