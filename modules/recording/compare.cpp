// SPDX-License-Identifier: Apache-2.0
#include "recording/compare.h"

#include <algorithm>
#include <cmath>

#include "kernel/text.h"
#include "recording/pairing.h"

namespace robomosp::recording {
namespace {

ColumnDifference difference(const Pairing& pairing, const Column& a, const Column& b) {
  ColumnDifference d;
  d.name = a.name;
  d.unit = a.unit;
  std::vector<double> x, y;
  for (const auto& row : pairing.rows) {
    const double other = row.of(b.values);
    if (!std::isfinite(a.values[row.first]) || !std::isfinite(other)) continue;
    x.push_back(a.values[row.first]);
    y.push_back(other);
    if (const double off = std::fabs(y.back() - x.back()); off > d.greatest || x.size() == 1)
      d.greatest = off, d.at = row.at;
  }
  d.samples = x.size();
  if (x.empty()) return d;
  // Sums about the means, since values are often large beside what they vary by.
  const auto n = static_cast<double>(x.size());
  double mx = 0, my = 0;
  for (std::size_t i = 0; i < x.size(); ++i) mx += x[i] / n, my += y[i] / n;
  double xx = 0, yy = 0, xy = 0, squares = 0, spread = 0;
  d.mean = my - mx;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double u = x[i] - mx, v = y[i] - my, off = y[i] - x[i];
    xx += u * u, yy += v * v, xy += u * v;
    squares += off * off;
    spread += (off - d.mean) * (off - d.mean);
  }
  d.rms = std::sqrt(squares / n);
  d.deviation = std::sqrt(spread / n);
  // What varies by rounding only does not vary.
  const double nothing = 1e-13;
  const bool varies = std::sqrt(xx / n) > nothing * std::fabs(mx) &&
                      std::sqrt(yy / n) > nothing * std::fabs(my) && xx > 0 && yy > 0;
  if (varies) d.correlation = std::clamp(xy / std::sqrt(xx * yy), -1.0, 1.0);
  return d;
}

}  // namespace

Result<std::vector<ColumnDifference>> compare(const Recording& first, const Recording& other,
                                              std::span<const std::string> columns) {
  RMP_TRY_ASSIGN(const Pairing pairing, pair(first, other));
  std::vector<const Column*> chosen;
  if (columns.empty()) {
    for (const Column& c : first.columns)
      if (c.name != "time" && other.find(c.name)) chosen.push_back(&c);
    if (chosen.empty())
      return error(ErrorCode::invalid_argument, "they have no common columns",
                   "Compare recordings of the same quantities.");
  } else {
    RMP_TRY_ASSIGN(chosen, first.select(columns));
  }
  std::vector<ColumnDifference> out;
  for (const Column* c : chosen) {
    const std::string name = c->name;
    auto found = other.select(std::span(&name, 1));
    if (!found.ok()) return std::move(found).error().in(text::quote(other.title));
    const Column& with = *found->front();
    if (with.unit != c->unit)
      return error(ErrorCode::invalid_argument,
                   "column " + text::quote(name) + " is in " + text::quote(c->unit) + " and in " +
                       text::quote(with.unit),
                   "Compare quantities of one unit.");
    out.push_back(difference(pairing, *c, with));
  }
  return out;
}

}  // namespace robomosp::recording
