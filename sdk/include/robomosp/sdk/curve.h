// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.curve/2: the geometry of a Cartesian segment, without its timing (layer:
// contract, std only). A motion law (motion_law.h) runs the tool along it; an orientation
// (orientation.h) turns the tool along it.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// A place on a curve and its derivatives with respect to the curve's parameter u.
struct CurveSample {
  Vec3 p{};   ///< [m]
  Vec3 d1{};  ///< dp/du [m per unit of u]
  Vec3 d2{};  ///< d2p/du2
  Vec3 d3{};  ///< d3p/du3
};

/// A curve ready to be evaluated. Immutable. [any thread]
class Curve {
 public:
  virtual ~Curve() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// The parameter u runs over 0..end(), end() > 0. Any parameter will do: the host walks the curve
  /// by its length, unless is_timed().
  [[nodiscard]] virtual double end() const = 0;
  /// Fills out[i] for u[i], each within 0..end().
  virtual Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const = 0;
  /// The parameter of every control point, rising, one for each: where the curve passes it or is
  /// drawn to it most. Orientations given by point are met there.
  [[nodiscard]] virtual std::vector<double> knots() const = 0;
  /// The parameter is time [s]: without another law the tool is at evaluate(t) at the time t.
  [[nodiscard]] virtual bool is_timed() const { return false; }
  /// |d1| is the same everywhere: the host may walk by u instead of by measured length.
  [[nodiscard]] virtual bool is_even() const { return false; }
};

/// Interface robomosp.curve/2: makes curves of one shape.
class CurveFactory {
 public:
  using Interface = CurveFactory;
  static constexpr const char* kInterfaceId = "robomosp.curve/2";
  virtual ~CurveFactory() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Builds a curve from its control poses, in the trajectory's frame; only their positions shape
  /// it, unless the shape specifies otherwise. A wrong number of points, coincident or collinear
  /// ones and sizes out of range are errors that name them. Points that are all at one place make a
  /// curve of no length only where the shape is a line (the tool turns on the spot). [any thread]
  virtual Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                              const Params&) const = 0;
};

}  // namespace robomosp
