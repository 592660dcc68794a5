// SPDX-License-Identifier: Apache-2.0
// Settings of readers of controllers' programs as they are when nobody gives any, and pulses of an
// arm.
#pragma once

#include <span>
#include <string_view>

#include <robomosp/sdk/params.h>

namespace robomosp::test {

class ReaderSettings final : public Params {
 public:
  [[nodiscard]] bool has(std::string_view) const override { return true; }
  [[nodiscard]] double real(std::string_view name) const override {
    if (name == "tcp_speed" || name == "speed") return 1.0;
    if (name == "roll") return 0;
    if (name == "max_speed") return 2.0;
    if (name == "c_ptp_mm") return 0.1;
    return name == "pl_mm" ? 0.01 : 3.141592653589793;
  }
  [[nodiscard]] long long integer(std::string_view) const override { return 0; }
  [[nodiscard]] bool boolean(std::string_view) const override { return false; }
  [[nodiscard]] std::string_view text(std::string_view) const override { return {}; }
  /// Of INFORM: pulses per degree of six axes and one more.
  [[nodiscard]] std::span<const double> reals(std::string_view) const override {
    static constexpr double kPulses[] = {1000, 1000, 1000, 800, 800, 500, 100};
    return kPulses;
  }
  [[nodiscard]] Pose pose(std::string_view) const override { return {}; }
};

}  // namespace robomosp::test
