// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/plots/time_axis.h"

#include <algorithm>
#include <cmath>

namespace robomosp::viewer {
namespace {

/// The shortest range that is shown, as a share of the whole one.
constexpr double kLeastShare = 1e-7;

}  // namespace

void TimeAxis::set_range(double from, double to) {
  if (!std::isfinite(from) || !std::isfinite(to)) from = to = 0;
  const bool was_all = !is_zoomed();
  from_ = from;
  to_ = std::max(from, to);
  if (was_all || low_ >= to_ || high_ <= from_) {
    low_ = from_;
    high_ = to_;
    changed();
  } else {
    show(low_, high_);
  }
}

void TimeAxis::show(double low, double high) {
  if (!std::isfinite(low) || !std::isfinite(high) || is_empty()) return;
  const double whole = to_ - from_;
  const double length = std::clamp(high - low, kLeastShare * whole, whole);
  const double middle = (low + high) / 2;
  low_ = std::clamp(middle - length / 2, from_, to_ - length);
  high_ = low_ + length;
  if (length >= whole) {
    low_ = from_;
    high_ = to_;
  }
  changed();
}

void TimeAxis::zoom(double factor, double about) {
  if (!std::isfinite(factor) || factor <= 0) return;
  show(about - (about - low_) * factor, about + (high_ - about) * factor);
}

void TimeAxis::pan(double by) {
  if (is_zoomed()) show(low_ + by, high_ + by);
}

void TimeAxis::set_place(double left, double width, double right) {
  const double length = std::max(1.0, width - left - right);
  if (left == left_ && length == length_ && right == right_) return;
  left_ = left;
  right_ = right;
  length_ = length;
  changed();
}

double TimeAxis::x_of(double time) const {
  return high_ > low_ ? left_ + length_ * (time - low_) / (high_ - low_) : left_;
}

double TimeAxis::time_at(double x) const {
  return std::clamp(low_ + (high_ - low_) * (x - left_) / length_, from_, to_);
}

double TimeAxis::tick(double px) const {
  const double least = std::max(1e-12, (high_ - low_) / length_ * px);
  const double power = std::pow(10.0, std::floor(std::log10(least)));
  for (const double by : {1.0, 2.0, 5.0, 10.0})
    if (by * power >= least * (1 - 1e-9)) return by * power;
  return 10 * power;
}

}  // namespace robomosp::viewer
