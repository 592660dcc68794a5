// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.tip_force/1: force and moment on a robot at a tip while it moves
// (layer: contract, std only).
#pragma once

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/params.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

/// Interface robomosp.tip_force/1.
class TipForce {
 public:
  using Interface = TipForce;
  static constexpr const char* kInterfaceId = "robomosp.tip_force/1";
  virtual ~TipForce() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// [application thread or job]
  virtual Result<void> prepare(const Params& params) = 0;
  /// Force [N] and moment about the tip's origin [N m] on the robot, in the axes that the run
  /// chooses. `time` [s]; `path`: length of the tip's path since the trajectory began [m], NaN
  /// where the robot follows none. The same arguments give the same answer. Integrators call this
  /// at times that are not in order. [any thread] after prepare
  [[nodiscard]] virtual Result<TipWrench> at(double time, double path) const = 0;
};

}  // namespace robomosp
