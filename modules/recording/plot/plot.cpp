// SPDX-License-Identifier: Apache-2.0
// From recordings to the description of a plot, and into files.
#include "recording/plot/plot.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernel/text.h"
#include "recording/plot/column_of.h"
#include "recording/plot/file.h"
#include "recording/plot/layout.h"

namespace robomosp::recording {
namespace {

std::string label_of(const Column& c) {
  return c.unit.empty() ? c.name : c.name + " [" + c.unit + "]";
}

/// The common stem of the names, "tau" of tau1..tau7, with the unit.
std::string axis_label(const PlotPanel& panel, const std::string& unit) {
  std::string stem = panel.lines.front().name;
  for (const PlotLine& line : panel.lines) {
    std::size_t n = 0;
    while (n < stem.size() && n < line.name.size() && stem[n] == line.name[n]) ++n;
    stem.resize(n);
  }
  while (!stem.empty() && stem.back() == '_') stem.pop_back();
  if (unit.empty()) return stem;
  return stem.empty() ? "[" + unit + "]" : stem + " [" + unit + "]";
}

/// A column of another recording that is drawn over one of the first.
Result<const Column*> same_column(const Recording& other, const Column& c) {
  auto found = column_of(other, c.name);
  if (!found.ok()) return std::move(found).error().in(text::quote(other.title));
  if ((*found)->unit != c.unit)
    return error(ErrorCode::invalid_argument,
                 "its column " + text::quote(c.name) + " is in " + text::quote((*found)->unit) +
                     " instead of " + text::quote(c.unit),
                 "Draw them in two plots.", text::quote(other.title));
  return found;
}

/// The names as they are told apart beside each other.
std::vector<std::string> source_names(const std::vector<const Recording*>& recordings) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    std::string name = recordings[i]->title;
    if (std::find(names.begin(), names.end(), name) != names.end() || name.empty())
      name += (name.empty() ? "recording " : " ") + std::to_string(i + 1);
    names.push_back(std::move(name));
  }
  return names;
}

Result<void> add_path(const PlotRequest& request, Plot& out) {
  std::vector<std::string> names = request.columns;
  if (names.empty()) names = {"x", "y", "z"};
  if (names.size() != 3)
    return error(ErrorCode::invalid_argument,
                 "a path in space needs three columns, " + std::to_string(names.size()) +
                     (names.size() == 1 ? " is given" : " are given"),
                 "Give such as {\"x\", \"y\", \"z\"}, or leave them out.", "columns");
  PlotPanel panel;
  for (std::size_t s = 0; s < request.recordings.size(); ++s) {
    const Recording& r = *request.recordings[s];
    PlotLine line;
    line.name = out.sources.empty() ? r.title : out.sources[s];
    line.colour = line.source = s;
    std::vector<double>* into[3] = {&line.x, &line.y, &line.z};
    std::string* labels[3] = {&out.x_label, &panel.y_label, &out.z_label};
    for (std::size_t k = 0; k < 3; ++k) {
      auto c = column_of(r, names[k]);
      if (!c.ok()) return std::move(c).error().in(text::quote(r.title));
      *into[k] = (*c)->values;
      if (s == 0) *labels[k] = label_of(**c);
    }
    panel.lines.push_back(std::move(line));
  }
  out.is_path = true;
  out.panels.push_back(std::move(panel));
  return {};
}

/// The name of the column along the horizontal axis.
std::string x_column_name(const Recording& first, const std::string& wanted) {
  if (!wanted.empty()) return wanted;
  return first.find("time") || first.columns.empty() ? "time" : first.columns.front().name;
}

Result<void> add_panels(const PlotRequest& request, Plot& out) {
  const Recording& first = *request.recordings.front();
  const Column* x = first.find("time");
  out.is_tight = request.x.empty() || request.x == "time";
  if (!request.x.empty()) {
    RMP_TRY_ASSIGN(x, column_of(first, request.x));
  } else if (!x && !first.columns.empty()) {
    x = &first.columns.front();  // what is no motion has no time
    out.is_tight = std::is_sorted(x->values.begin(), x->values.end());
  }
  std::vector<const Column*> columns;
  if (!request.columns.empty()) {
    RMP_TRY_ASSIGN(columns, first.select(request.columns));
  } else {
    for (const Column& c : first.columns)
      if (&c != x && c.name != "time") columns.push_back(&c);
  }
  if (columns.empty() || !x)
    return error(ErrorCode::invalid_argument, "there is nothing to plot",
                 "Name at least one column.");
  out.x_label = label_of(*x);
  std::vector<const Column*> of_panel;  // whose unit and limits a panel has
  for (const Column* c : columns) {
    const auto fits = [&](const Column* p) {
      return !request.each_alone && p->unit == c->unit &&
             (!request.limits || (p->lower == c->lower && p->upper == c->upper));
    };
    const auto at = std::find_if(of_panel.begin(), of_panel.end(), fits);
    const auto which = static_cast<std::size_t>(at - of_panel.begin());
    if (at == of_panel.end()) {
      of_panel.push_back(c);
      out.panels.emplace_back();
      if (request.limits) {
        out.panels.back().lower = c->lower;
        out.panels.back().upper = c->upper;
      }
    }
    PlotPanel& panel = out.panels[which];
    const std::size_t colour = panel.lines.size() / request.recordings.size();
    for (std::size_t s = 0; s < request.recordings.size(); ++s) {
      const Recording& r = *request.recordings[s];
      RMP_TRY_ASSIGN(const Column* const over, same_column(r, *c));
      RMP_TRY_ASSIGN(const Column* const along, same_column(r, *x));
      panel.lines.push_back({c->name, along->values, over->values, {}, colour, s});
    }
  }
  for (std::size_t p = 0; p < out.panels.size(); ++p)
    out.panels[p].y_label = axis_label(out.panels[p], of_panel[p]->unit);
  out.is_metric = out.panels.size() == 1 && x->unit == "m" && of_panel.front()->unit == "m" &&
                  x != columns.front();
  return {};
}

/// The decadic logarithm; not a number where there is none.
double log_of(double v) { return v > 0 ? std::log10(v) : std::nan(""); }

bool is_above_zero(double v) { return v > 0 && std::isfinite(v); }

/// The same plot with logarithmic axes: lines and limits become logarithms, what is not above 0 a
/// gap that is counted.
Result<void> take_logarithms(const PlotRequest& request, const std::string& x_name, Plot& out) {
  out.log_x = request.log_x;
  out.log_y = request.log_y;
  out.is_metric = false;  // no scale of lengths
  const auto no_place = [](const std::string& name, const char* axis) {
    return error(ErrorCode::invalid_argument,
                 "no value of " + text::quote(name) +
                     " is above 0, so a logarithmic axis has no place for it",
                 std::string("Leave the column or the logarithmic axis ") + axis + " out.", "log");
  };
  for (PlotPanel& panel : out.panels) {
    for (PlotLine& line : panel.lines) {
      if (out.log_x && std::none_of(line.x.begin(), line.x.end(), is_above_zero))
        return no_place(x_name, "x");
      if (out.log_y && std::none_of(line.y.begin(), line.y.end(), is_above_zero))
        return no_place(line.name, "y");
      const std::size_t count = std::min(line.x.size(), line.y.size());
      out.samples += count;
      for (std::size_t i = 0; i < count; ++i)
        out.left_out += (out.log_x && line.x[i] <= 0) || (out.log_y && line.y[i] <= 0);
      // A sample without a place along one axis does not stretch the other one.
      for (std::size_t i = 0; i < count; ++i) {
        const bool is_seen = (!out.log_x || line.x[i] > 0) && (!out.log_y || line.y[i] > 0);
        if (!is_seen) line.x[i] = line.y[i] = std::nan("");
        if (out.log_x) line.x[i] = log_of(line.x[i]);
        if (out.log_y) line.y[i] = log_of(line.y[i]);
      }
    }
    if (!out.log_y) continue;
    constexpr double kNoLimit = std::numeric_limits<double>::infinity();
    panel.lower = panel.lower > 0 ? std::log10(panel.lower) : -kNoLimit;
    panel.upper = panel.upper > 0 ? std::log10(panel.upper) : kNoLimit;
  }
  return {};
}

}  // namespace

Result<Plot> plot(const PlotRequest& request) {
  if (request.recordings.empty() || request.recordings.front()->rows() == 0)
    return error(ErrorCode::invalid_argument, "there is nothing to plot",
                 "Give a recording that has samples.");
  Plot out;
  out.title = request.title.empty() ? request.recordings.front()->title : request.title;
  if (request.recordings.size() > 1) out.sources = source_names(request.recordings);
  if (request.is_path && (request.log_x || request.log_y))
    return error(ErrorCode::invalid_argument, "a path in space has no logarithmic axes",
                 "Leave them out, or draw columns over x.", "log");
  RMP_TRY(request.is_path ? add_path(request, out) : add_panels(request, out));
  if (request.log_x || request.log_y)
    RMP_TRY(take_logarithms(request, x_column_name(*request.recordings.front(), request.x), out));
  constexpr int kLeast = 520, kAround = 120;
  const int of_panel = request.each_alone ? 96 : 130;
  out.width = request.width;
  out.height = request.height > 0
                   ? request.height
                   : std::max(kLeast, kAround + of_panel * static_cast<int>(out.panels.size()));
  return out;
}

std::string to_svg(const Plot& plot) { return drawn(plot).svg(); }

Result<std::string> plot_file(const Plot& plot, const std::string& name) {
  return drawing_file({plot.width, plot.height, [&] { return drawn(plot).svg(); },
                       [&] { return drawn(plot).gnuplot(); }},
                      name);
}

}  // namespace robomosp::recording
