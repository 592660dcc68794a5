// SPDX-License-Identifier: Apache-2.0
// NumberReader: reads numbers given as texts that are not quantities, such as "bore/2" (layer:
// core).
#pragma once

#include <optional>
#include <string_view>

#include <robomosp/sdk/result.h>

namespace robomosp {

/// Called by check_value() for every text in place of a real that is not a quantity.
class NumberReader {
 public:
  NumberReader() = default;
  NumberReader(const NumberReader&) = delete;
  NumberReader& operator=(const NumberReader&) = delete;
  virtual ~NumberReader() = default;

  /// The number of a text in the SI unit `unit`, checked to be within [min, max]; empty = the text
  /// is not a number in this context, and check_value() reports it.
  virtual std::optional<Result<double>> read(std::string_view text, std::string_view unit,
                                             double min, double max) = 0;

  /// The innermost reader of this thread; null = none.
  [[nodiscard]] static NumberReader* current() noexcept;

  /// Makes a reader the current one of this thread until the scope ends; null = no reader.
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
