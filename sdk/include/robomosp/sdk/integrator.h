// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.integrator/1: initial value problems x' = f(t, x) of simulated mechanisms
// (layer: contract, std only).
#pragma once

#include <cstdint>
#include <span>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

/// What is integrated; made by the host. One thread at a time.
/// A mechanical state is x = (q, qd): `positions` numbers of q, then the velocities; methods that
/// treat both alike (symplectic ones) use that, others do not look at it.
class OdeSystem {
 public:
  virtual ~OdeSystem() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  [[nodiscard]] virtual std::size_t size() const = 0;       ///< of x
  [[nodiscard]] virtual std::size_t positions() const = 0;  ///< of q within x
  /// dx = f(t, x).
  virtual Result<void> rate(double t, std::span<const double> x, std::span<double> dx) = 0;
  /// Brings x back to where it belongs: quaternions of length 1, loops closed.
  virtual void project(std::span<double> x) = 0;
  /// Functions with events as zeros (a limit reached, a joint that stops): how many, and their
  /// values.
  [[nodiscard]] virtual std::size_t events() const = 0;
  virtual void event_values(double t, std::span<const double> x, std::span<double> g) = 0;
  /// At the zero of event `index`: may change x (a rebound, a stick) and then returns true to
  /// continue, or false to end there.
  virtual bool at_event(double t, std::size_t index, std::span<double> x) = 0;
};

/// Where results go. One thread at a time.
class OdeSink {
 public:
  virtual ~OdeSink() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// The state at a time asked for, or at an event. Returning false ends the run.
  virtual bool sample(double t, std::span<const double> x) = 0;
};

struct OdeRun {
  std::uint32_t struct_size = sizeof(OdeRun);  ///< see plugin.h
  double start = 0, end = 1;                   ///< [s]
  std::span<const double> x0;                  ///< size() numbers
  std::span<const double> sample_times;        ///< rising, within start..end
  double relative_tolerance = 1e-10;           ///< of methods with error control
  double absolute_tolerance = 1e-12;
  double step = 1e-3;  ///< of fixed-step methods; first guess of the others [s]
};

struct OdeStatistics {
  std::int64_t steps = 0, rejected = 0, rates = 0, events = 0;
  double end = 0;  ///< where the run ended [s]
};

/// Interface robomosp.integrator/1.
class Integrator {
 public:
  using Interface = Integrator;
  static constexpr const char* kInterfaceId = "robomosp.integrator/1";
  virtual ~Integrator() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// [application thread or job]
  virtual Result<void> prepare(const Params& params) = 0;
  /// Runs to the end, an ending event, or an error that says at which t (step too small, rate not
  /// finite). Samples come in order of time. [any thread] after prepare
  virtual Result<OdeStatistics> run(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                                    Progress&) const = 0;
};

}  // namespace robomosp
