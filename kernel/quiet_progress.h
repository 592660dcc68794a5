// SPDX-License-Identifier: Apache-2.0
// QuietProgress: passes cancellation on but no reports, for the parts of work that reports itself
// as a whole (layer: core).
#pragma once

#include <string_view>

#include <robomosp/sdk/progress.h>

namespace robomosp {

/// `whole` must outlive it. [any thread]
class QuietProgress final : public Progress {
 public:
  explicit QuietProgress(const Progress& whole) : whole_(whole) {}
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return whole_.cancelled(); }

 private:
  const Progress& whole_;
};

}  // namespace robomosp
