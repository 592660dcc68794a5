// SPDX-License-Identifier: Apache-2.0
// Guard of forces at tips: numbers that are finite.
#include <cmath>
#include <memory>
#include <string>

#include <robomosp/sdk/tip_force.h>

#include "kernel/interface_file.h"
#include "kernel/provider_guard.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

class GuardedTipForce final : public TipForce {
 public:
  GuardedTipForce(const ProviderInfo& info, TipForce* inner) : name_(info.name), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<void> prepare(const Params& params) override {
    return asked(name_, [&] { return inner_->prepare(params); });
  }
  Result<TipWrench> at(double time, double path) const override {
    auto given = asked(name_, [&] { return inner_->at(time, path); });
    if (!given.ok()) return given;
    for (std::size_t k = 0; k < 3; ++k)
      if (!std::isfinite(given->force[k]) || !std::isfinite(given->moment[k]))
        return broken_answer(name_, "returned a force that is not a number at t = " +
                                        text::print_rounded(time) + " s");
    return given;
  }

 private:
  std::string name_;
  std::unique_ptr<TipForce> inner_;
};

}  // namespace

RMP_INTERFACES(forces, guarded_interface<TipForce, GuardedTipForce>());

}  // namespace robomosp
