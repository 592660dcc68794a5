// SPDX-License-Identifier: Apache-2.0
// Errors for unusable results of providers (layer: application, sim only).
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include <robomosp/sdk/result.h>

namespace robomosp::sim {

/// Adds the robot (`robot "pa10"`) to an error of a provider, unless the provider has named it.
[[nodiscard]] inline Error in_robot(Error e, const std::string& robot) {
  if (e.where == robot || e.where.starts_with(robot + ", ")) return e;
  return std::move(e).in(robot);
}

/// The error of a provider that violated its contract: `what` it did.
[[nodiscard]] inline Error broken(const std::string& provider, const std::string& what) {
  return error(ErrorCode::plugin_failed, "provider \"" + provider + "\" " + what,
               "Report it to the provider's author or choose another provider.");
}
inline constexpr const char* kNotANumber = "returned a value that is not a number";

[[nodiscard]] inline bool all_finite(std::span<const double> v) {
  return std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); });
}

}  // namespace robomosp::sim
