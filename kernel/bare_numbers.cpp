// SPDX-License-Identifier: Apache-2.0
#include "kernel/bare_numbers.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "kernel/text.h"

namespace robomosp {
namespace {

constexpr std::size_t kMostTold = 3, kMostKept = 100;
thread_local BareNumbers* t_current = nullptr;
thread_local bool t_is_quiet = false;

}  // namespace

BareNumbers::BareNumbers() noexcept : before_(std::exchange(t_current, this)) {}
BareNumbers::~BareNumbers() { t_current = before_; }

NumbersAreTexts::NumbersAreTexts() noexcept : before_(std::exchange(t_is_quiet, true)) {}
NumbersAreTexts::~NumbersAreTexts() { t_is_quiet = before_; }

void BareNumbers::tell(std::string_view path, std::string_view text, std::string_view unit) {
  if (!t_current || t_is_quiet || unit.empty() || unit == "1") return;
  text = text::trim(text);
  const auto number = text::read_real(text);
  if (!number || *number == 0) return;  // nothing is nothing in every unit
  std::vector<Found>& found = t_current->found_;
  // A number may be looked at more than once on its way.
  for (const Found& f : found)
    if (f.path == path) return;
  if (found.size() < kMostKept)
    found.push_back({std::string(path), std::string(text), std::string(unit)});
}

std::vector<std::string> BareNumbers::sentences(
    const std::function<bool(std::string_view)>& is_given) const {
  std::vector<std::string> out;
  std::size_t more = 0;
  for (const Found& f : found_) {
    if (!is_given(f.text)) continue;
    if (out.size() == kMostTold) {
      ++more;
      continue;
    }
    std::string said = f.path + " = " + text::quote(f.text) + " is taken as " + f.text + " " +
                       f.unit + ", since it names no unit.";
    if (f.unit == "m") said += " Write " + text::quote(f.text + " mm") + " for millimetres.";
    if (f.unit == "rad") said += " Write " + text::quote(f.text + " deg") + " for degrees.";
    out.push_back(std::move(said));
  }
  if (more > 0) out.back() += " So are " + std::to_string(more) + " further texts without a unit.";
  return out;
}

void BareNumbers::judge(std::string_view path, double value, std::string_view unit) {
  constexpr double kTwoTurns = 4 * std::numbers::pi, kThreeTurnsInDegrees = 1080;
  constexpr double kLong = 100, kLongest = 1e5;  // [m]
  const double size = std::fabs(value);
  if (unit == "rad" ? size > kTwoTurns && size <= kThreeTurnsInDegrees
                    : unit == "m" && size >= kLong && size <= kLongest)
    unlikely(path, value, unit);
}

void BareNumbers::unlikely(std::string_view path, double value, std::string_view unit) {
  if (!t_current || t_is_quiet) return;
  std::vector<Unlikely>& found = t_current->unlikely_;
  for (const Unlikely& f : found)
    if (f.path == path) return;
  if (found.size() < kMostKept) found.push_back({std::string(path), std::string(unit), value});
}

void BareNumbers::withdraw(std::string_view unit) {
  if (t_current)
    std::erase_if(t_current->unlikely_, [unit](const Unlikely& f) { return f.unit == unit; });
}

std::vector<std::string> BareNumbers::numbers(const std::function<bool(double)>& is_given) const {
  struct Other {
    std::string_view si, unit, words;
    double in_unit;  ///< 0 = not shown
  };
  constexpr double kDegrees = 180 / std::numbers::pi;
  constexpr Other kOthers[] = {{"rad", "deg", "degrees", kDegrees},
                               {"rad/s", "deg/s", "degrees per second", kDegrees},
                               {"m", "mm", "millimetres", 0},
                               {"m/s", "mm/s", "millimetres per second", 0}};
  // "a" of a link's fields is the "links[1].a" of the whole.
  const auto is_within_another = [this](const Unlikely& f) {
    return std::any_of(unlikely_.begin(), unlikely_.end(), [&f](const Unlikely& other) {
      return other.value == f.value && other.unit == f.unit && other.path.size() > f.path.size() &&
             other.path.ends_with("." + f.path);
    });
  };
  std::vector<std::string> out;
  std::size_t more = 0;
  for (const Unlikely& f : unlikely_) {
    if (!is_given(f.value) || is_within_another(f)) continue;
    if (out.size() == kMostTold) {
      ++more;
      continue;
    }
    const std::string number = text::print(f.value);
    for (const Other& o : kOthers)
      if (o.si == f.unit)
        out.push_back(f.path + " = " + number + " is taken as " + number + " " + f.unit +
                      (o.in_unit > 0 ? ", which is " + text::print_rounded(f.value * o.in_unit, 4) +
                                           " " + std::string(o.unit)
                                     : std::string()) +
                      ". Write " + text::quote(number + " " + std::string(o.unit)) + " for " +
                      std::string(o.words) + ".");
  }
  if (more > 0)
    out.back() += " So are " + std::to_string(more) + " further numbers of unlikely size.";
  return out;
}

}  // namespace robomosp
