// SPDX-License-Identifier: Apache-2.0
// An interface of a test's own: what a header of sdk/ would hold.
#pragma once

#include <robomosp/sdk/result.h>

namespace robomosp::test {

/// Interface robomosp.taste/1. [any thread]
class Taster {
 public:
  using Interface = Taster;
  static constexpr const char* kInterfaceId = "robomosp.taste/1";
  virtual ~Taster() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// How good a share of salt [0..1] is, 0..1.
  virtual Result<double> taste(double salt) const = 0;
};

}  // namespace robomosp::test
