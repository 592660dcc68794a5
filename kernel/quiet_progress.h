// SPDX-License-Identifier: Apache-2.0
// QuietProgress: hands on the wish to stop and no reports, for parts of a whole that reports itself
// (layer: core).
#pragma once

#include <string_view>

#include <robomosp/sdk/progress.h>

namespace robomosp {

/// `whole` outlives it. [any thread]
class QuietProgress final : public Progress {
 public:
  explicit QuietProgress(const Progress& whole) : whole_(whole) {}
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return whole_.cancelled(); }

 private:
  const Progress& whole_;
};

}  // namespace robomosp
