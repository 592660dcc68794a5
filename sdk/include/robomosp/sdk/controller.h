// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.controller/1: joint forces from a state and what it should be
// (layer: contract, std only).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/params.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

namespace robomosp {

/// What a controller sees at a tick. Made by the host; may gain fields at the end.
struct ControlInput {
  std::uint32_t struct_size = sizeof(ControlInput);  ///< see plugin.h
  double time = 0;                                   ///< [s]
  double dt = 0;                                     ///< since the tick before; 0 at the first [s]
  std::span<const double> q, qd;                     ///< as measured
  std::span<const double> q_desired, qd_desired, qdd_desired;  ///< of the reference
  /// Reference of the tip 0 in the base frame, where the reference is Cartesian; else nullptr.
  const Pose* tip_desired = nullptr;
  std::array<double, 6> tip_velocity_desired{};      ///< (v, w), base axes, at the tip
  std::array<double, 6> tip_acceleration_desired{};  ///< its rate
};

/// Interface robomosp.controller/1. Holds no state between ticks but in `state`.
class Controller {
 public:
  using Interface = Controller;
  static constexpr const char* kInterfaceId = "robomosp.controller/1";
  virtual ~Controller() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Binds to a mechanism and to the inverse dynamics it may ask (the robot's own choice); both
  /// outlive it. [application thread or job]
  virtual Result<void> prepare(const RobotModel& model, const InverseDynamics& dynamics,
                               const Params& params) = 0;
  /// Numbers that a run keeps from tick to tick (integrals); the host starts them at 0.
  [[nodiscard]] virtual std::size_t state_size() const = 0;
  [[nodiscard]] virtual std::size_t scratch_size() const = 0;
  /// tau, dof() numbers; the host cuts them at the joints' max_force. Allocates nothing.
  /// [any thread] after prepare
  virtual Result<void> torques(const ControlInput& in, std::span<double> state,
                               std::span<double> scratch, std::span<double> tau) const = 0;
};

}  // namespace robomosp
