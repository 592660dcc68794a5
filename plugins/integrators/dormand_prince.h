// SPDX-License-Identifier: Apache-2.0
// Dormand and Prince's pair of orders 5 and 4 with dense output (layer: plugin). J. R. Dormand,
// P. J. Prince, J. Comp. Appl. Math. 6 (1980); step control, dense output and the test of stiffness
// after Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.4 to II.6, and
// Hairer, Wanner, II, IV.2.
#pragma once

#include <robomosp/sdk/integrator.h>

namespace robomosp::integrators {

class DormandPrince final : public Integrator {
 public:
  Result<void> prepare(const Params& params) override;
  Result<OdeStatistics> run(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                            Progress&) const override;

 private:
  bool greatest_error_ = false;  ///< the norm: greatest instead of root mean square
  double max_step_ = 0;          ///< [s]; 0 = none
  std::int64_t max_steps_ = 0;
};

}  // namespace robomosp::integrators
