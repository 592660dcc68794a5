// SPDX-License-Identifier: Apache-2.0
// Providers "dormand_prince", "runge_kutta4" and "symplectic" (integrators) (layer: plugin).
#include <robomosp/sdk/integrator.h>
#include <robomosp/sdk/plugin.h>

#include "dormand_prince.h"
#include "methods.h"

namespace robomosp::integrators {
namespace {

const rmp_param kDormandPrinceParams[] = {
    {"norm", "enum", "",
     "Norm of the errors of the state's numbers: root mean square, or the greatest.", "rms",
     "rms|max", 1, 0},
    {"max_step", "real", "s", "Longest step; 0 = only limited by the error.", "0", nullptr, 0, 1e9},
    {"max_steps", "int", "", "A run that takes more steps than this is an error.", "1000000",
     nullptr, 1, 1e12},
};
const rmp_param kSymplecticParams[] = {
    {"method", "enum", "",
     "Velocity Verlet (order 2), Yoshida's composition of it (order 4), or semi-implicit Euler "
     "(order 1).",
     "verlet", "verlet|yoshida4|euler", 1, 0},
};

}  // namespace
}  // namespace robomosp::integrators

RMP_PLUGIN("org.robomosp.integrators", "0.1.0", "Apache-2.0",
           "Integration of motions: variable step, fixed step, symplectic.",
           RMP_PROVIDER(robomosp::integrators::DormandPrince, "dormand_prince",
                        "Runge-Kutta 5(4) with error control and dense output.", "adaptive,order=5",
                        robomosp::integrators::kDormandPrinceParams),
           RMP_PROVIDER_NO_PARAMS(robomosp::integrators::RungeKutta4, "runge_kutta4",
                                  "The classical Runge-Kutta method with a fixed step.",
                                  "fixed_step,order=4"),
           RMP_PROVIDER(robomosp::integrators::Symplectic, "symplectic",
                        "Fixed step; keeps the energy of free motions within bounds.",
                        "fixed_step,order=2,symplectic", robomosp::integrators::kSymplecticParams))
