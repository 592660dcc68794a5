// SPDX-License-Identifier: Apache-2.0
// Settings of readers of controllers' programs as they are when nobody gives any.
#pragma once

#include <span>
#include <string_view>

#include <robomosp/sdk/params.h>

namespace robomosp::test {

class ReaderSettings final : public Params {
 public:
  [[nodiscard]] bool has(std::string_view) const override { return true; }
  [[nodiscard]] double real(std::string_view name) const override {
    return name == "tcp_speed" ? 1.0 : name == "max_speed" ? 2.0 : 3.141592653589793;
  }
  [[nodiscard]] long long integer(std::string_view) const override { return 0; }
  [[nodiscard]] bool boolean(std::string_view) const override { return false; }
  [[nodiscard]] std::string_view text(std::string_view) const override { return {}; }
  [[nodiscard]] std::span<const double> reals(std::string_view) const override { return {}; }
  [[nodiscard]] Pose pose(std::string_view) const override { return {}; }
};

}  // namespace robomosp::test
