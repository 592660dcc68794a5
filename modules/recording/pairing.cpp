// SPDX-License-Identifier: Apache-2.0
#include "recording/pairing.h"

#include <algorithm>
#include <cmath>

#include "kernel/text.h"

namespace robomosp::recording {
namespace {

/// A hair beyond the ends that both share counts as within: times that were rounded.
constexpr double kRounding = 1e-9;

}  // namespace

Result<Pairing> pair(const Recording& first, const Recording& other, double shift) {
  Pairing out;
  const Column *t = first.find("time"), *u = other.find("time");
  if ((!t || !u) && shift != 0)
    return error(ErrorCode::invalid_argument, "one of them has no time to shift",
                 "Leave the shift out, or give both a column \"time\".");
  if (!t || !u) {
    if (first.rows() != other.rows())
      return error(ErrorCode::invalid_argument,
                   "they have " + std::to_string(first.rows()) + " and " +
                       std::to_string(other.rows()) + " rows and no time to match them",
                   "Give both a column \"time\", or the same number of rows.");
    for (std::size_t i = 0; i < first.rows(); ++i)
      out.rows.push_back({i, i, 0, static_cast<double>(i + 1)});
    return out;
  }
  if (t->values.empty() || u->values.empty())
    return error(ErrorCode::invalid_argument, "one of them has no rows", "Compare others.");
  const double hair = kRounding * std::max(std::fabs(u->values.back()), 1e-3);
  for (std::size_t i = 0; i < t->values.size(); ++i) {
    const double at = t->values[i] + shift;
    if (!(at >= u->values.front() - hair && at <= u->values.back() + hair)) continue;
    const auto after = std::upper_bound(u->values.begin(), u->values.end(), at);
    std::size_t k =
        after == u->values.begin() ? 0 : static_cast<std::size_t>(after - u->values.begin()) - 1;
    if (k + 1 >= u->values.size()) {
      out.rows.push_back({i, k, 0, t->values[i]});
      continue;
    }
    const double share = (at - u->values[k]) / (u->values[k + 1] - u->values[k]);
    out.rows.push_back({i, k, std::clamp(share, 0.0, 1.0), t->values[i]});
  }
  if (out.rows.empty())
    return error(ErrorCode::invalid_argument,
                 "their times do not overlap: one is from " +
                     text::print_rounded(t->values.front() + shift) + " s to " +
                     text::print_rounded(t->values.back() + shift) + " s, the other from " +
                     text::print_rounded(u->values.front()) + " s to " +
                     text::print_rounded(u->values.back()) + " s",
                 "Compare recordings of the same time range.");
  return out;
}

}  // namespace robomosp::recording
