// SPDX-License-Identifier: Apache-2.0
// The factories of this plugin, and their shared code (layer: plugin).
#pragma once

#include <string>
#include <utility>

#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>

#include "spatial/print.h"

namespace robomosp::path_analytic {

/// Control points closer than this count as equal [m]; far below the accuracy of robots.
inline constexpr double kSamePoint = 1e-9;
/// Orientations closer than this count as equal [rad].
inline constexpr double kSameRotation = 1e-9;

inline Error bad(std::string message, std::string hint) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

/// A parameter that must be above 0.
inline Result<double> positive(const Params& params, const char* name, const char* unit) {
  const double value = params.real(name);
  if (value > 0 && value < 1e300) return value;
  return bad(std::string(name) + " is " + spatial::print_number(value) + " " + unit,
             "It must be above 0.");
}

/// Checks `count` control points, all of them poses; `shape` as in "an arc", `which` describes
/// them.
Result<void> check_points(std::span<const Pose> points, std::size_t count, const char* shape,
                          const char* which);

struct LineFactory final : CurveFactory {
  Result<std::unique_ptr<Curve>> make(std::span<const Pose>, const Params&) const override;
};
struct ArcFactory final : CurveFactory {
  Result<std::unique_ptr<Curve>> make(std::span<const Pose>, const Params&) const override;
};
struct ArcCentreFactory final : CurveFactory {
  Result<std::unique_ptr<Curve>> make(std::span<const Pose>, const Params&) const override;
};
struct HelixFactory final : CurveFactory {
  Result<std::unique_ptr<Curve>> make(std::span<const Pose>, const Params&) const override;
};
struct CircleFactory final : CurveFactory {
  Result<std::unique_ptr<Curve>> make(std::span<const Pose>, const Params&) const override;
};

struct ConstantSpeedFactory final : MotionLawFactory {
  Result<std::unique_ptr<MotionLaw>> make(const LawTask&, const Params&) const override;
};
struct ConstantAccelerationFactory final : MotionLawFactory {
  Result<std::unique_ptr<MotionLaw>> make(const LawTask&, const Params&) const override;
};
struct TrapezoidalFactory final : MotionLawFactory {
  Result<std::unique_ptr<MotionLaw>> make(const LawTask&, const Params&) const override;
};
struct SCurveFactory final : MotionLawFactory {
  Result<std::unique_ptr<MotionLaw>> make(const LawTask&, const Params&) const override;
};
struct CubicFactory final : MotionLawFactory {
  Result<std::unique_ptr<MotionLaw>> make(const LawTask&, const Params&) const override;
};
struct QuinticFactory final : MotionLawFactory {
  Result<std::unique_ptr<MotionLaw>> make(const LawTask&, const Params&) const override;
};
struct CycloidalFactory final : MotionLawFactory {
  Result<std::unique_ptr<MotionLaw>> make(const LawTask&, const Params&) const override;
};

struct FixedFactory final : OrientationFactory {
  Result<std::unique_ptr<Orientation>> make(const OrientationTask&, const Params&) const override;
};
struct SlerpFactory final : OrientationFactory {
  Result<std::unique_ptr<Orientation>> make(const OrientationTask&, const Params&) const override;
};
struct SlerpPointsFactory final : OrientationFactory {
  Result<std::unique_ptr<Orientation>> make(const OrientationTask&, const Params&) const override;
};
struct SquadFactory final : OrientationFactory {
  Result<std::unique_ptr<Orientation>> make(const OrientationTask&, const Params&) const override;
};
struct AnglesFactory final : OrientationFactory {
  Result<std::unique_ptr<Orientation>> make(const OrientationTask&, const Params&) const override;
};
struct TangentFactory final : OrientationFactory {
  Result<std::unique_ptr<Orientation>> make(const OrientationTask&, const Params&) const override;
};

}  // namespace robomosp::path_analytic
