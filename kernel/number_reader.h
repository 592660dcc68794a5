// SPDX-License-Identifier: Apache-2.0
// Whoever reads the numbers that are given as texts, such as "bore/2", where these are no
// quantities (layer: core).
#pragma once

#include <optional>
#include <string_view>

#include <robomosp/sdk/result.h>

namespace robomosp {

/// Asked by check_value() for every text that should be a real and is no quantity.
class NumberReader {
 public:
  NumberReader() = default;
  NumberReader(const NumberReader&) = delete;
  NumberReader& operator=(const NumberReader&) = delete;
  virtual ~NumberReader() = default;

  /// The number of a text in the SI unit `unit`, within [min, max] if its value is; none = the text
  /// means no number here, and check_value() says so.
  virtual std::optional<Result<double>> read(std::string_view text, std::string_view unit,
                                             double min, double max) = 0;

  /// The innermost of this thread; null = none.
  [[nodiscard]] static NumberReader* current() noexcept;

  /// Makes a reader the current one of this thread until the scope ends; null = there is none.
  class Scope {
   public:
    explicit Scope(NumberReader* reader) noexcept;
    ~Scope();
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    NumberReader* before_;
  };
};

}  // namespace robomosp
