// SPDX-License-Identifier: Apache-2.0
#include "recording/compare.h"

#include <algorithm>
#include <cmath>

#include "kernel/text.h"

namespace robomosp::recording {
namespace {

/// Where the rows of one recording stand between those of another.
struct Pairing {
  struct Row {
    std::size_t first, other;
    double share;  ///< of the other's next row
    double at;
  };
  std::vector<Row> rows;
};

/// A hair beyond the ends that both share counts as within: times that were rounded.
constexpr double kRounding = 1e-9;

Result<Pairing> pair(const Recording& first, const Recording& other) {
  Pairing out;
  const Column *t = first.find("time"), *u = other.find("time");
  if (!t || !u) {
    if (first.rows() != other.rows())
      return error(ErrorCode::invalid_argument,
                   "they have " + std::to_string(first.rows()) + " and " +
                       std::to_string(other.rows()) +
                       " rows and no time to tell which belong "
                       "together",
                   "Give both a column \"time\", or as many rows.");
    for (std::size_t i = 0; i < first.rows(); ++i)
      out.rows.push_back({i, i, 0, static_cast<double>(i + 1)});
    return out;
  }
  if (t->values.empty() || u->values.empty())
    return error(ErrorCode::invalid_argument, "one of them has no rows", "Compare others.");
  const double hair = kRounding * std::max(std::fabs(u->values.back()), 1e-3);
  for (std::size_t i = 0; i < t->values.size(); ++i) {
    const double at = t->values[i];
    if (!(at >= u->values.front() - hair && at <= u->values.back() + hair)) continue;
    const auto after = std::upper_bound(u->values.begin(), u->values.end(), at);
    std::size_t k =
        after == u->values.begin() ? 0 : static_cast<std::size_t>(after - u->values.begin()) - 1;
    if (k + 1 >= u->values.size()) {
      out.rows.push_back({i, k, 0, at});
      continue;
    }
    const double share = (at - u->values[k]) / (u->values[k + 1] - u->values[k]);
    out.rows.push_back({i, k, std::clamp(share, 0.0, 1.0), at});
  }
  if (out.rows.empty())
    return error(ErrorCode::invalid_argument,
                 "they have no time in common: one is from " +
                     text::print_rounded(t->values.front()) + " s to " +
                     text::print_rounded(t->values.back()) + " s, the other from " +
                     text::print_rounded(u->values.front()) + " s to " +
                     text::print_rounded(u->values.back()) + " s",
                 "Compare recordings of the same time.");
  return out;
}

ColumnDifference difference(const Pairing& pairing, const Column& a, const Column& b) {
  ColumnDifference d;
  d.name = a.name;
  d.unit = a.unit;
  std::vector<double> x, y;
  for (const auto& row : pairing.rows) {
    const double other = row.share == 0 ? b.values[row.other]
                                        : b.values[row.other] * (1 - row.share) +
                                              b.values[row.other + 1] * row.share;
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
      return error(ErrorCode::invalid_argument, "they have no column in common",
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
