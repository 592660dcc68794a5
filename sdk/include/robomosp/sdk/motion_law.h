// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.motion_law/2: how far along its curve the tool is at a time (layer: contract,
// std only).
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

/// What a law has to run along.
struct LawTask {
  std::uint32_t struct_size = sizeof(LawTask);  ///< see plugin.h
  double length = 0;  ///< of the curve [m]; 0 = the tool turns on the spot
  double turn = 0;  ///< greatest |dR/dw| along it, w the path parameter: see orientation.h [rad]
};

/// Path parameter, 0..1, and its derivatives with respect to time.
struct LawSample {
  double share = 0;
  double rate = 0;          ///< [1/s]
  double acceleration = 0;  ///< [1/s^2]
  double jerk = 0;          ///< [1/s^3]
};

/// A law ready to be sampled. Immutable. [any thread]
class MotionLaw {
 public:
  virtual ~MotionLaw() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  [[nodiscard]] virtual double duration() const = 0;  ///< [s], > 0
  /// Fills out[i] for times[i]; outside 0..duration() the share is held at 0 or 1, rates are zero.
  virtual Result<void> sample(std::span<const double> times, std::span<LawSample> out) const = 0;
};

/// Interface robomosp.motion_law/2.
class MotionLawFactory {
 public:
  using Interface = MotionLawFactory;
  static constexpr const char* kInterfaceId = "robomosp.motion_law/2";
  virtual ~MotionLawFactory() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Speeds, limits or a duration are the provider's parameters. An impossible combination (a
  /// duration too short for the limits, end speeds above the speed) is an error that says the
  /// nearest possible value. [any thread]
  virtual Result<std::unique_ptr<MotionLaw>> make(const LawTask&, const Params&) const = 0;
};

}  // namespace robomosp
