// SPDX-License-Identifier: Apache-2.0
#include "recording/residual.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernel/text.h"
#include "recording/pairing.h"

namespace robomosp::recording {
namespace {

using Columns = std::vector<std::pair<const Column*, const Column*>>;  // measured, model

Result<Columns> common_columns(const Recording& measured, const Recording& model,
                               std::span<const std::string> columns) {
  std::vector<const Column*> chosen;
  if (columns.empty()) {
    for (const Column& c : measured.columns)
      if (c.name != "time" && model.find(c.name)) chosen.push_back(&c);
    if (chosen.empty())
      return error(ErrorCode::invalid_argument, "they have no common columns",
                   "Use the same column names in both, such as q1, q2 and so on.");
  } else {
    RMP_TRY_ASSIGN(chosen, measured.select(columns));
  }
  Columns out;
  for (const Column* c : chosen) {
    if (c->name == "time") continue;
    const std::string name = c->name;
    auto found = model.select(std::span(&name, 1));
    if (!found.ok()) return std::move(found).error().in(text::quote(model.title));
    if (found->front()->unit != c->unit)
      return error(ErrorCode::invalid_argument,
                   "column " + text::quote(name) + " was measured in " + text::quote(c->unit) +
                       " and the model gives " + text::quote(found->front()->unit),
                   "Compare quantities of one unit.");
    out.emplace_back(c, found->front());
  }
  if (out.empty())
    return error(ErrorCode::invalid_argument, "no column except the time is compared",
                 "Name others in columns.");
  return out;
}

/// About the mean, of the finite values; 1 where they do not vary.
double spread(const std::vector<double>& values) {
  double mean = 0, squares = 0;
  std::size_t n = 0;
  for (const double v : values)
    if (std::isfinite(v)) mean += v, ++n;
  if (n == 0) return 1;
  mean /= static_cast<double>(n);
  for (const double v : values)
    if (std::isfinite(v)) squares += (v - mean) * (v - mean);
  const double s = std::sqrt(squares / static_cast<double>(n));
  return s > 0 ? s : 1;
}

/// The measured rows that are looked at for a shift.
constexpr std::size_t kShiftRows = 2000;
constexpr int kShiftGrid = 400;

/// Of a shift: the variances of the residuals over their columns' spread, and how many rows count.
struct Misfit {
  double mean = 0;
  std::size_t rows = 0;
};

}  // namespace

std::string residual_name(std::string_view column) {
  std::size_t digits = column.size();
  while (digits > 0 && column[digits - 1] >= '0' && column[digits - 1] <= '9') --digits;
  return std::string(column.substr(0, digits)) + "_residual" + std::string(column.substr(digits));
}

Result<Recording> residual(const Recording& measured, const Recording& model,
                           std::span<const std::string> columns, double shift) {
  RMP_TRY_ASSIGN(const Columns both, common_columns(measured, model, columns));
  RMP_TRY_ASSIGN(const Pairing pairing, pair(measured, model, shift));
  Recording out;
  out.title = measured.title + ": measured minus model";
  out.world = measured.world;
  out.robot = measured.robot;
  out.dof = measured.dof;
  Column first;
  if (const Column* time = measured.find("time"); time && model.find("time")) {
    first = {"time", time->unit, time->doc, {}};
  } else {
    first = {"row", "", "row of both", {}};
  }
  for (const auto& row : pairing.rows) first.values.push_back(row.at);
  out.columns.push_back(std::move(first));
  for (const auto& [a, b] : both) {
    Column c;
    c.name = residual_name(a->name);
    c.unit = a->unit;
    c.doc = a->name + ", measured minus model";
    c.values.reserve(pairing.rows.size());
    for (const auto& row : pairing.rows)
      c.values.push_back(a->values[row.first] - row.of(b->values));
    out.columns.push_back(std::move(c));
  }
  if (shift != 0)
    out.notes.push_back("The model was shifted by " + text::print_rounded(std::fabs(shift)) +
                        " s " + (shift > 0 ? "later" : "earlier") + " than the measured times.");
  return out;
}

Result<double> best_shift(const Recording& measured, const Recording& model,
                          std::span<const std::string> columns, double most, Progress& progress) {
  RMP_TRY_ASSIGN(const Columns both, common_columns(measured, model, columns));
  if (!measured.find("time") || !model.find("time"))
    return error(ErrorCode::invalid_argument, "one of them has no time to shift",
                 "Give both a column \"time\".");
  // Fewer rows of what was measured; the model stays whole.
  Recording some;
  const std::size_t rows = measured.rows(), step = std::max<std::size_t>(1, rows / kShiftRows);
  std::vector<const Column*> kept{measured.find("time")};
  for (const auto& each : both) kept.push_back(each.first);
  for (const Column* c : kept) {
    Column thin{c->name, c->unit, "", {}};
    for (std::size_t i = 0; i < rows; i += step) thin.values.push_back(c->values[i]);
    some.columns.push_back(std::move(thin));
  }
  std::vector<double> scale;
  for (const auto& each : both) scale.push_back(1 / spread(each.second->values));
  const auto misfit = [&](double shift) {
    Misfit m;
    const auto pairing = pair(some, model, shift);
    if (!pairing.ok()) return m;
    for (std::size_t c = 0; c < both.size(); ++c) {
      // About the mean: an offset of a joint says nothing of the time.
      double sum = 0, squares = 0;
      std::size_t n = 0;
      for (const auto& row : pairing->rows) {
        const double off =
            (some.columns[c + 1].values[row.first] - row.of(both[c].second->values)) * scale[c];
        if (std::isfinite(off)) sum += off, squares += off * off, ++n;
      }
      if (n == 0) continue;
      const double mean = sum / static_cast<double>(n);
      m.mean += std::max(0.0, squares / static_cast<double>(n) - mean * mean);
      m.rows += n;
    }
    m.rows /= both.size();
    return m;
  };
  std::vector<Misfit> grid;
  std::size_t widest = 0;
  const double grain = 2 * most / kShiftGrid;
  for (int i = 0; i <= kShiftGrid; ++i) {
    if (progress.cancelled())
      return error(ErrorCode::cancelled, "the search for the shift was cancelled");
    grid.push_back(misfit(-most + grain * i));
    widest = std::max(widest, grid.back().rows);
  }
  int best = -1;
  for (int i = 0; i <= kShiftGrid; ++i) {
    const Misfit& m = grid[static_cast<std::size_t>(i)];
    if (m.rows > 0 && 2 * m.rows >= widest &&
        (best < 0 || m.mean < grid[static_cast<std::size_t>(best)].mean))
      best = i;
  }
  if (best < 0)
    return error(
        ErrorCode::invalid_argument,
        "their times do not overlap for any shift within " + text::print_rounded(most) + " s",
        "Compare recordings of the same time range, or allow a larger shift.");
  // Golden section between the neighbours; beyond the ends nothing was asked for.
  const double ratio = (std::sqrt(5.0) - 1) / 2;
  const auto value = [&](double shift) {
    const Misfit m = misfit(shift);
    return m.rows > 0 && 2 * m.rows >= widest ? m.mean : std::numeric_limits<double>::infinity();
  };
  double low = std::max(-most, -most + grain * (best - 1)),
         high = std::min(most, -most + grain * (best + 1));
  double x = high - ratio * (high - low), y = low + ratio * (high - low);
  double at_x = value(x), at_y = value(y);
  while (high - low > 1e-6 * most) {
    if (progress.cancelled())
      return error(ErrorCode::cancelled, "the search for the shift was cancelled");
    if (at_x < at_y) high = y, y = x, at_y = at_x, x = high - ratio * (high - low), at_x = value(x);
    else low = x, x = y, at_x = at_y, y = low + ratio * (high - low), at_y = value(y);
  }
  return (low + high) / 2;
}

std::vector<ResidualStatistics> residual_statistics(const Recording& r) {
  std::vector<ResidualStatistics> out;
  for (std::size_t k = 1; k < r.columns.size(); ++k) {
    const Column& c = r.columns[k];
    ResidualStatistics s;
    s.name = c.name;
    s.unit = c.unit;
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < c.values.size(); ++i) {
      const double v = c.values[i];
      if (!std::isfinite(v)) continue;
      ++s.samples;
      sum += v;
      squares += v * v;
      if (std::fabs(v) > s.greatest || s.samples == 1)
        s.greatest = std::fabs(v), s.at = r.columns[0].values[i];
    }
    if (s.samples > 0) {
      const auto n = static_cast<double>(s.samples);
      s.mean = sum / n;
      s.rms = std::sqrt(squares / n);
      double about = 0;
      for (const double v : c.values)
        if (std::isfinite(v)) about += (v - s.mean) * (v - s.mean);
      s.deviation = std::sqrt(about / n);
    }
    out.push_back(std::move(s));
  }
  return out;
}

}  // namespace robomosp::recording
