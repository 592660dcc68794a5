// SPDX-License-Identifier: Apache-2.0
// Shared by integrators: a method takes one step at a time, and the run around it samples, finds
// events and projects (layer: data processing, spatial). With it, a new integrator is a Stepper of
// a few lines.
#pragma once

#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/integrator.h>

namespace robomosp::spatial {

/// Calls the system, counts calls, and reports where a rate is not finite or fails.
class Rates {
 public:
  Rates(OdeSystem& system, OdeStatistics& statistics) : system_(system), statistics_(statistics) {}
  /// False = a result is not finite.
  Result<bool> operator()(double t, std::span<const double> x, std::span<double> dx);
  [[nodiscard]] OdeSystem& system() const { return system_; }
  [[nodiscard]] OdeStatistics& statistics() const { return statistics_; }

 private:
  OdeSystem& system_;
  OdeStatistics& statistics_;
};

/// A method, bound to one run.
class Stepper {
 public:
  virtual ~Stepper() = default;
  /// Restarts from here: at the start, and after an event or a projection has changed x.
  virtual Result<void> restart(double t, std::span<const double> x) = 0;
  /// One accepted step towards `limit`, not beyond. Its result: `time()`, `state()`.
  virtual Result<void> step(double limit) = 0;
  [[nodiscard]] virtual double time() const = 0;
  [[nodiscard]] virtual std::span<const double> state() const = 0;
  /// The state within the last step.
  virtual Result<void> between(double t, std::span<double> x) = 0;
  /// Number of parts of a step between which events are looked for.
  [[nodiscard]] virtual int looks_for_events() const = 0;
};

/// Rejects spans of the wrong length, times that do not increase and invalid tolerances.
Result<void> check_run(const OdeSystem& system, const OdeRun& run);

/// The whole run of a method.
Result<OdeStatistics> integrate(Rates& rates, Stepper& stepper, const OdeRun& run, OdeSink& sink,
                                Progress& progress);

/// The body of Integrator::run for a class of Stepper made of (Rates&, const OdeRun&, options...).
template <class Steps, class... Options>
Result<OdeStatistics> run_steps(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                                Progress& progress, Options... options) {
  RMP_TRY(check_run(system, run));
  OdeStatistics statistics;
  Rates rates(system, statistics);
  Steps steps(rates, run, options...);
  return integrate(rates, steps, run, sink, progress);
}

[[nodiscard]] std::string at_time(double t);  ///< "t = 0.25 s"
[[nodiscard]] Error rate_not_finite(double t);

}  // namespace robomosp::spatial
