// SPDX-License-Identifier: Apache-2.0
#include "model/marked_numbers.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace robomosp::model {

namespace {

constexpr std::uint64_t kMarkedNan = 0x7ff8'5ab1'0000'0000U,
                        kMarkedNanMask = 0xffff'ffff'0000'0000U;

/// The double `steps` away from v: towards 0 or away from it; of 0, `steps` times the least one.
double stepped(double v, std::uint64_t steps, bool is_towards_zero, bool is_negative) {
  const auto bits = std::bit_cast<std::uint64_t>(v);
  constexpr std::uint64_t kSign = std::uint64_t{1} << 63;
  const std::uint64_t size = bits & ~kSign;
  if (size == 0) return std::bit_cast<double>(steps | (is_negative ? kSign : 0));
  if (is_towards_zero && size <= steps) return v;
  return std::bit_cast<double>((is_towards_zero ? size - steps : size + steps) | (bits & kSign));
}

}  // namespace

double marked_nan(std::uint32_t number) { return std::bit_cast<double>(kMarkedNan | number); }

std::optional<std::uint32_t> number_of_nan(double v) {
  const auto bits = std::bit_cast<std::uint64_t>(v);
  if ((bits & kMarkedNanMask) != kMarkedNan) return std::nullopt;
  return static_cast<std::uint32_t>(bits & ~kMarkedNanMask);
}

double MarkedNumbers::near(double value, double min, double max, std::string_view text) {
  auto place = std::find(texts_.begin(), texts_.end(), text);
  if (place == texts_.end()) place = texts_.insert(texts_.end(), std::string(text));
  // Sums and quotients of plain numbers are one or two steps beside what they would be exactly, so
  // that marks begin farther away.
  constexpr std::uint64_t kNearest = 8, kFarthest = 500;
  for (std::uint64_t steps = kNearest + by_bits_.size() % (kFarthest / 2); steps <= kFarthest;
       ++steps)
    for (const bool choice : {true, false}) {
      const double v = stepped(value, steps, choice, !choice);
      if (!std::isfinite(v) || v < min || v > max || v == value) continue;
      if (by_bits_.emplace(std::bit_cast<std::uint64_t>(v), place - texts_.begin()).second)
        return v;
    }
  return value;
}

const std::string* MarkedNumbers::find(double v) const {
  const auto found = by_bits_.find(std::bit_cast<std::uint64_t>(v));
  return found == by_bits_.end() ? nullptr : &texts_[found->second];
}

}  // namespace robomosp::model
