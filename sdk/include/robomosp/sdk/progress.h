// SPDX-License-Identifier: Apache-2.0
// Progress: how long work reports and learns that it was cancelled (layer: contract, std only).
#pragma once

#include <string_view>

namespace robomosp {

/// Last argument of everything that can exceed 50 ms. Implemented by the host. [any thread]
class Progress {
 public:
  virtual ~Progress() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Reports how far the work is; fraction in 0..1, `what` a few words for the user.
  virtual void report(double fraction, std::string_view what) = 0;
  /// True once the user asked to stop; return ErrorCode::cancelled within 100 ms of that.
  [[nodiscard]] virtual bool cancelled() const = 0;
};

/// A Progress that shows nothing and never cancels; for tests and short calls.
class NoProgress final : public Progress {
 public:
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return false; }
};

}  // namespace robomosp
