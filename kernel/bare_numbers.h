// SPDX-License-Identifier: Apache-2.0
// Quantities without a unit that were probably meant in another one: texts such as "200", whose
// author may have thought of millimetres, and numbers such as 90 for an angle in radians or 300 for
// the length of a link in metres. They are read in SI units and reported (layer: core).
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

  /// A number, as numbers() reports it.
  struct Unlikely {
    std::string path, unit;
    double value = 0;
  };
  /// A number was read as `unit`: one that is unlikely in it is collected. Angles from more than
  /// two turns up to 1080, which as degrees are three; lengths from 100 m to 100 km.
  static void number(std::string_view path, double value, std::string_view unit) {
    if (value > kLeastUnlikely || value < -kLeastUnlikely) judge(path, value, unit);
  }
  /// Collects a number that its reader knows to be unlikely in "rad", "m", "rad/s" or "m/s".
  static void unlikely(std::string_view path, double value, std::string_view unit);
  /// Drops what was collected in a unit: something better reports it.
  static void withdraw(std::string_view unit);
  /// `a = 300 is taken as 300 m. Write "300 mm" for millimetres.`, a sentence each, of those
  /// that were given as `is_given(value)` says; of many the first few and how many more.
  [[nodiscard]] std::vector<std::string> numbers(
      const std::function<bool(double value)>& is_given) const;

 private:
  static constexpr double kLeastUnlikely = 12.5;  ///< below two turns
  static void judge(std::string_view path, double value, std::string_view unit);
  BareNumbers* before_;
  std::vector<Found> found_;
  std::vector<Unlikely> unlikely_;
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
