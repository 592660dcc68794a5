// SPDX-License-Identifier: Apache-2.0
// The fixed-step providers (layer: plugin).
#pragma once

#include <robomosp/sdk/integrator.h>

namespace robomosp::integrators {

class RungeKutta4 final : public Integrator {
 public:
  Result<void> prepare(const Params& params) override;
  Result<OdeStatistics> run(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                            Progress&) const override;
};

class Symplectic final : public Integrator {
 public:
  enum class Method { euler, verlet, yoshida4 };
  Result<void> prepare(const Params& params) override;
  Result<OdeStatistics> run(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                            Progress&) const override;

 private:
  Method method_ = Method::verlet;
};

}  // namespace robomosp::integrators
