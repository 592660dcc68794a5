// SPDX-License-Identifier: Apache-2.0
// Providers of the interface of own_interface.h.
#include <cmath>
#include <stdexcept>

#include <robomosp/sdk/plugin.h>

#include "own_interface.h"

namespace {

using namespace robomosp;

class Sweet final : public test::Taster {
 public:
  Result<double> taste(double salt) const override { return 1 - salt; }
};
class Odd final : public test::Taster {
 public:
  Result<double> taste(double salt) const override {
    if (salt > 0.5) throw std::runtime_error("too salty");
    return std::nan("");
  }
};

}  // namespace

RMP_PLUGIN("org.robomosp.test_tasters", "1.0.0", "Apache-2.0", "Tasters of a test.",
           RMP_PROVIDER_NO_PARAMS(Sweet, "sweet", "Likes no salt.", ""),
           RMP_PROVIDER_NO_PARAMS(Odd, "odd", "Is wrong.", ""))
