// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.orientation/2: how the tool turns along a Cartesian segment (layer: contract,
// std only).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/params.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// An orientation at a path parameter w, and how it changes with w. With the rotation matrix R:
/// dR/dw = [turn]x R, so `turn` is the angular velocity at dw/dt = 1/s; both in the
/// trajectory's frame.
struct OrientationSample {
  std::array<double, 9> R{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< row-major
  Vec3 turn{};                                         ///< [rad]
  Vec3 bend{};                                         ///< d(turn)/dw [rad]
};

/// What an orientation may follow.
struct OrientationTask {
  std::uint32_t struct_size = sizeof(OrientationTask);  ///< see plugin.h
  std::span<const Pose> points;                         ///< the control poses
  std::span<const double> shares;  ///< path parameter at each of them, rising from 0..1
  const Curve* curve = nullptr;    ///< [borrowed for the call]
};

/// An orientation along a path. Immutable. [any thread]
class Orientation {
 public:
  virtual ~Orientation() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Fills out[i] for the share w[i] in 0..1; along[i] is the curve there with derivatives with
  /// respect to w.
  virtual Result<void> evaluate(std::span<const double> w, std::span<const CurveSample> along,
                                std::span<OrientationSample> out) const = 0;
};

/// Interface robomosp.orientation/2.
class OrientationFactory {
 public:
  using Interface = OrientationFactory;
  static constexpr const char* kInterfaceId = "robomosp.orientation/2";
  virtual ~OrientationFactory() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// [any thread]
  virtual Result<std::unique_ptr<Orientation>> make(const OrientationTask&,
                                                    const Params&) const = 0;
};

}  // namespace robomosp
