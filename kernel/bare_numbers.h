// SPDX-License-Identifier: Apache-2.0
// Quantities without a unit that were probably meant in another one: texts such as "200", possibly
// written in millimetres, and numbers such as 90 for an angle in radians or 300 for the length of a
// link in metres. They are read in SI units and reported (layer: core).
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace robomosp {

/// Collects such quantities read on this thread until the scope ends; the innermost scope collects.
class BareNumbers {
 public:
  struct Found {
    std::string path, text, unit;
  };
  BareNumbers() noexcept;
  ~BareNumbers();
  BareNumbers(const BareNumbers&) = delete;
  BareNumbers& operator=(const BareNumbers&) = delete;

  /// `x = "200" is taken as 200 m. Write "200 mm" for millimetres.`: one sentence for each text for
  /// which `is_given(text)` is true; if there are many, the first few and the count of the others.
  [[nodiscard]] std::vector<std::string> sentences(
      const std::function<bool(std::string_view text)>& is_given) const;

  /// True if nothing was collected, as of most calls.
  [[nodiscard]] bool empty() const { return found_.empty() && unlikely_.empty(); }

  /// Records that a text without a unit was read as `unit`.
  static void tell(std::string_view path, std::string_view text, std::string_view unit);

  /// A number, as numbers() reports it.
  struct Unlikely {
    std::string path, unit;
    double value = 0;
  };
  /// Records a number read as `unit` if its value is unlikely: angles above two turns and up to
  /// 1080 (three turns in degrees), lengths from 100 m to 100 km.
  static void number(std::string_view path, double value, std::string_view unit) {
    if (!is_likely(value)) judge(path, value, unit);
  }
  /// True if number() ignores the value in every unit.
  [[nodiscard]] static constexpr bool is_likely(double value) {
    return value <= kLeastUnlikely && value >= -kLeastUnlikely;
  }
  /// Records a number that its reader knows to be unlikely in "rad", "m", "rad/s" or "m/s".
  static void unlikely(std::string_view path, double value, std::string_view unit);
  /// Drops what was collected in a unit, if a more specific message reports it.
  static void withdraw(std::string_view unit);
  /// `a = 300 is taken as 300 m. Write "300 mm" for millimetres.`: one sentence for each number for
  /// which `is_given(value)` is true; if there are many, the first few and the count of the others.
  [[nodiscard]] std::vector<std::string> numbers(
      const std::function<bool(double value)>& is_given) const;

 private:
  static constexpr double kLeastUnlikely = 12.5;  ///< below two turns
  static void judge(std::string_view path, double value, std::string_view unit);
  BareNumbers* before_;
  std::vector<Found> found_;
  std::vector<Unlikely> unlikely_;
};

/// Disables the collection on this thread until the scope ends, for input in which all numbers are
/// texts, such as lines of the program of 2006.
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
