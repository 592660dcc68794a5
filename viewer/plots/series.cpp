// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/plots/series.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace robomosp::viewer {
namespace {

constexpr std::size_t kBlock = 16;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
/// Up to so many samples on a pixel are drawn one by one.
constexpr std::size_t kFewOnAPixel = 3;

}  // namespace

Series::Series(TimesPtr times, Numbers64 values)
    : times_(std::move(times)), values_(std::move(values)) {
  if (times_ && values_.size() > times_->size()) values_.resize(times_->size());
  build(0);
}

std::size_t Series::size() const { return times_ ? std::min(times_->size(), values_.size()) : 0; }

void Series::append(const double* values, std::size_t count) {
  const std::size_t from = values_.size();
  values_.insert(values_.end(), values, values + count);
  build(from);
}

void Series::cut(std::size_t rows) {
  if (rows >= values_.size()) return;
  values_.resize(rows);
  build(rows);
}

void Series::build(std::size_t from) {
  std::size_t below = values_.size();
  for (std::size_t level = 0; below > kBlock; ++level) {
    const std::size_t count = (below + kBlock - 1) / kBlock;
    from /= kBlock;
    if (level == levels_.size()) {
      levels_.emplace_back();
      from = 0;
    }
    std::vector<Pair>& blocks = levels_[level];
    blocks.resize(count);
    for (std::size_t b = from; b < count; ++b) {
      Pair p{kInfinity, -kInfinity};
      const std::size_t end = std::min(below, (b + 1) * kBlock);
      for (std::size_t i = b * kBlock; i < end; ++i) {
        const Pair each = level == 0 ? (std::isfinite(values_[i]) ? Pair{values_[i], values_[i]}
                                                                  : Pair{kInfinity, -kInfinity})
                                     : levels_[level - 1][i];
        p.low = std::min(p.low, each.low);
        p.high = std::max(p.high, each.high);
      }
      blocks[b] = p;
    }
    below = count;
    if (below <= kBlock) {
      levels_.resize(level + 1);
      return;
    }
  }
  levels_.clear();
}

Series::Pair Series::extremes(std::size_t first, std::size_t last) const {
  Pair p{kInfinity, -kInfinity};
  const auto add = [&](const Pair& each) {
    p.low = std::min(p.low, each.low);
    p.high = std::max(p.high, each.high);
  };
  std::size_t i = first;
  while (i < last) {
    // The largest block that begins here and ends in time.
    std::size_t size = 1, level = 0;
    while (level < levels_.size() && i % (size * kBlock) == 0 && i + size * kBlock <= last) {
      size *= kBlock;
      ++level;
    }
    if (level > 0) add(levels_[level - 1][i / size]);
    else if (std::isfinite(values_[i])) add({values_[i], values_[i]});
    i += size;
  }
  return p;
}

std::optional<std::pair<double, double>> Series::extremes() const {
  const Pair p = extremes(0, size());
  if (p.low > p.high) return std::nullopt;
  return std::pair(p.low, p.high);
}

std::optional<double> Series::at(double time) const {
  const std::size_t n = size();
  if (n == 0) return std::nullopt;
  const Numbers64& t = *times_;
  if (!(time >= t[0]) || !(time <= t[n - 1])) return std::nullopt;
  const auto above = static_cast<std::size_t>(
      std::lower_bound(t.begin(), t.begin() + static_cast<std::ptrdiff_t>(n), time) - t.begin());
  double v = values_[above];
  if (above > 0 && t[above] > time) {
    const double share = (time - t[above - 1]) / (t[above] - t[above - 1]);
    v = values_[above - 1] + share * (values_[above] - values_[above - 1]);
  }
  return std::isfinite(v) ? std::optional(v) : std::nullopt;
}

std::optional<double> Series::step_at(double time) const {
  const std::size_t n = size();
  if (n == 0 || !(time >= (*times_)[0])) return std::nullopt;
  const auto end = times_->begin() + static_cast<std::ptrdiff_t>(n);
  const auto after =
      static_cast<std::size_t>(std::upper_bound(times_->begin(), end, time) - times_->begin());
  const double v = values_[after - 1];
  return std::isfinite(v) ? std::optional(v) : std::nullopt;
}

Series::Line Series::line(double from, double to, int pixels) const {
  Line out;
  const std::size_t n = size();
  if (n == 0 || !(to > from) || pixels < 1) return out;
  const auto begin = times_->begin(), end = begin + static_cast<std::ptrdiff_t>(n);
  auto first = static_cast<std::size_t>(std::lower_bound(begin, end, from) - begin);
  auto last = static_cast<std::size_t>(std::upper_bound(begin, end, to) - begin);
  if (first > 0) --first;
  if (last < n) ++last;
  const auto columns = static_cast<std::size_t>(pixels);
  if (last - first <= kFewOnAPixel * columns) {
    out.x.assign(begin + static_cast<std::ptrdiff_t>(first),
                 begin + static_cast<std::ptrdiff_t>(last));
    out.y.assign(values_.begin() + static_cast<std::ptrdiff_t>(first),
                 values_.begin() + static_cast<std::ptrdiff_t>(last));
    for (double& v : out.y)
      if (!std::isfinite(v)) v = kGap;
    return out;
  }
  out.x.reserve(2 * columns + 4);
  out.y.reserve(2 * columns + 4);
  const double width = (to - from) / static_cast<double>(pixels);
  std::size_t i = first;
  double before = 0;
  for (std::size_t k = 0; k <= columns && i < last; ++k) {
    // The last column takes the sample beyond the range.
    const double edge = from + width * static_cast<double>(k + 1);
    const std::size_t next =
        k == columns ? last
                     : static_cast<std::size_t>(
                           std::lower_bound(begin + static_cast<std::ptrdiff_t>(i),
                                            begin + static_cast<std::ptrdiff_t>(last), edge) -
                           begin);
    if (next == i) continue;
    const Pair p = extremes(i, next);
    const double x = ((*times_)[i] + (*times_)[next - 1]) / 2;
    if (p.low > p.high) {
      out.x.push_back(x);
      out.y.push_back(kGap);
    } else {
      // The nearer extreme first, so that the line does not cross the column twice.
      const bool is_low_first = std::fabs(p.low - before) < std::fabs(p.high - before);
      out.x.push_back(x);
      out.y.push_back(is_low_first ? p.low : p.high);
      if (p.high > p.low) {
        out.x.push_back(x);
        out.y.push_back(is_low_first ? p.high : p.low);
      }
      before = out.y.back();
    }
    i = next;
  }
  return out;
}

}  // namespace robomosp::viewer
