// SPDX-License-Identifier: Apache-2.0
#include "kernel/bare_numbers.h"

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

}  // namespace robomosp
