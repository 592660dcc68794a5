// SPDX-License-Identifier: Apache-2.0
// Texts such as "200" that were read as quantities though they name no unit: whoever writes quotes
// may have thought of millimetres, so that what was taken is told (layer: core).
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace robomosp {

/// Collects what is read on this thread until the scope ends; of several the innermost.
class BareNumbers {
 public:
  struct Found {
    std::string path, text, unit;
  };
  BareNumbers() noexcept;
  ~BareNumbers();
  BareNumbers(const BareNumbers&) = delete;
  BareNumbers& operator=(const BareNumbers&) = delete;

  /// `x = "200" is taken as 200 m. Write "200 mm" for millimetres.`, a sentence each, of those that
  /// were given as `is_given(text)` says; of many the first few and how many more.
  [[nodiscard]] std::vector<std::string> sentences(
      const std::function<bool(std::string_view text)>& is_given) const;

  /// A text without a unit was read as `unit`.
  static void tell(std::string_view path, std::string_view text, std::string_view unit);

 private:
  BareNumbers* before_;
  std::vector<Found> found_;
};

/// For work whose numbers are texts by their nature, such as lines of the program of 2006: nothing
/// is collected on this thread until the scope ends.
class NumbersAreTexts {
 public:
  NumbersAreTexts() noexcept;
  ~NumbersAreTexts();
  NumbersAreTexts(const NumbersAreTexts&) = delete;
  NumbersAreTexts& operator=(const NumbersAreTexts&) = delete;

 private:
  bool before_;
};

}  // namespace robomosp
