// SPDX-License-Identifier: Apache-2.0
// Columns by expressions over the others.
#include <algorithm>
#include <cmath>

#include "kernel/expression.h"
#include "kernel/text.h"
#include "sim/joint_rates.h"
#include "sim/recording_columns.h"

namespace robomosp::sim {
namespace {

using recording::Column;
using recording::Recording;
using recording::RecordingPtr;

/// A column as the names of an expression find it.
struct Source {
  const Column* column;
  units::Dimension dimension;
};

Result<std::vector<Source>> sources_of(const Recording& r, const Expression& e) {
  std::vector<Source> out;
  for (const Expression::Name& name : e.names()) {
    const std::string spelled = Expression::spell(name);
    RMP_TRY_ASSIGN(const auto found, r.select(std::span(&spelled, 1)));
    if (found.size() != 1 || found.front()->name != spelled)
      return error(ErrorCode::invalid_argument,
                   text::quote(spelled) + " are " + std::to_string(found.size()) + " columns",
                   "Name one, such as " + found.front()->name + ".");
    RMP_TRY_ASSIGN(const auto unit, units::parse(found.front()->unit));
    out.push_back({found.front(), unit.dimension});
  }
  return out;
}

}  // namespace

Result<RecordingPtr> with_watch(const Recording& recording, const std::string& name,
                                std::string_view expression, const std::string& unit, Watch watch) {
  RMP_TRY(Expression::check_name(name, "column"));
  if (name == "time")
    return error(ErrorCode::invalid_argument, "the column time cannot be replaced",
                 "Give the new column another name.");
  RMP_TRY_ASSIGN(const Expression e, Expression::compile(expression));
  RMP_TRY_ASSIGN(const auto sources, sources_of(recording, e));
  const Column* time = recording.find("time");
  if (watch != Watch::value && !time)
    return error(ErrorCode::invalid_argument, "the recording has no time",
                 "Rates and integrals need a column \"time\".");
  std::size_t row = 0;
  const Expression::Lookup lookup = [&](const Expression::Name& wanted) -> Result<Quantity> {
    const auto& names = e.names();
    const auto at =
        static_cast<std::size_t>(std::find(names.begin(), names.end(), wanted) - names.begin());
    return Quantity{sources[at].column->values[row], sources[at].dimension};
  };
  Column out{name, unit, std::string(expression), {}};
  units::Dimension dimension{};
  for (; row < recording.rows(); ++row) {
    auto value = e.evaluate(lookup);
    if (!value.ok()) {
      const std::string at = time ? "t = " + text::print_rounded(time->values[row]) + " s"
                                  : "row " + std::to_string(row + 1);
      return std::move(value).error().in(at);
    }
    dimension = value->dimension;
    out.values.push_back(value->value);
  }
  if (watch != Watch::value) {
    const char* what = watch == Watch::rate ? "rate of " : "integral of ";
    out.doc = what + out.doc;
    dimension[2] += watch == Watch::rate ? -1 : 1;
    out.values = watch == Watch::rate ? rate_of(time->values, out.values)
                                      : integral_of(time->values, out.values);
  }
  if (unit.empty()) {
    out.unit = units::si_name(dimension);
  } else {
    RMP_TRY_ASSIGN(const auto wanted, units::parse(unit));
    if (!same_kind(wanted.dimension, dimension))
      return error(ErrorCode::invalid_argument,
                   text::quote(std::string(expression)) + " gives " + units::kind_of(dimension) +
                       ", not " + units::kind_of(wanted.dimension),
                   "Its unit is " + text::quote(units::si_name(dimension)) + ".", "unit");
    if (wanted.factor != 1)
      return error(
          ErrorCode::invalid_argument, "columns are in SI units, not in " + text::quote(unit),
          "Give " + text::quote(units::si_name(wanted.dimension)) + ", or leave the unit out.",
          "unit");
  }
  Recording all = recording;
  const auto same = std::find_if(all.columns.begin(), all.columns.end(),
                                 [&](const Column& c) { return c.name == name; });
  if (same != all.columns.end()) *same = std::move(out);
  else all.columns.push_back(std::move(out));
  return std::make_shared<const Recording>(std::move(all));
}

}  // namespace robomosp::sim
