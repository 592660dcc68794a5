// SPDX-License-Identifier: Apache-2.0
#include "program_check/shown_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <robomosp/sdk/program_tables.h>

#include "kernel/text.h"
#include "scene/path_lines.h"
#include "sim/member_axes.h"

namespace robomosp::program_check {
namespace {

using text::print_rounded;

struct Look {
  Colour colour;
  const char* word;
};
const Look kGood{{0.13F, 0.58F, 0.22F, 1}, "good"};
Look look_of(const Fault& f) {
  switch (f.kind) {
    case FaultKind::reach:
    case FaultKind::joint_limit:
    case FaultKind::motion: return {{0.86F, 0.10F, 0.10F, 1}, "no reach"};
    case FaultKind::contact: return {{0.58F, 0.14F, 0.68F, 1}, "contact"};
    case FaultKind::clearance: return {{0.80F, 0.55F, 0.86F, 1}, "too near"};
    case FaultKind::singularity: return {{0.10F, 0.45F, 0.85F, 1}, "singular"};
    case FaultKind::configuration: return {{0.05F, 0.25F, 0.55F, 1}, "branch"};
    default: return {{0.96F, 0.58F, 0.04F, 1}, "limit"};
  }
}
bool is_drawn(const Fault& f) { return f.severity != Severity::note && f.motion != kNone; }

constexpr std::size_t kMostNames = 16;  ///< of places in a picture

/// Balls where faults are, and words beside the worst; those that are near each other share them.
/// Gives how many places have no word, as there would be too many. `size`: of the tool's way [m].
std::size_t place_marks(const Check& check, double size, std::vector<scene::MarkedPlace>& out) {
  struct Place {
    const Fault* first;
    std::set<std::uint32_t> lines;
    std::vector<const Fault*> others;  ///< a ball each, without a word
  };
  std::vector<Place> all;
  const auto gap = [](const Fault& a, const Fault& b) {
    return std::hypot(a.position[0] - b.position[0], a.position[1] - b.position[1],
                      a.position[2] - b.position[2]);
  };
  constexpr double kOne = 0.05;  ///< what is nearer is one ball [m]
  for (const Fault& f : check.faults) {
    if (!is_drawn(f) || !f.has_position) continue;
    const std::uint32_t line = f.place.span.line;
    Place* at = nullptr;
    double least = INFINITY;
    for (Place& p : all) {
      // Of one line a word serves further around than for others.
      const double reach = std::max(kOne, (p.lines.contains(line) ? 0.2 : 0.08) * size);
      const double d = gap(*p.first, f);
      if (d < reach && d < least) at = &p, least = d;
    }
    if (!at) {
      all.push_back({&f, {line}, {}});
      continue;
    }
    at->lines.insert(line);
    const auto is_there = [&](const Fault* o) { return gap(*o, f) < kOne; };
    if (!is_there(at->first) && std::none_of(at->others.begin(), at->others.end(), is_there))
      at->others.push_back(&f);
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Place& p = all[i];
    out.push_back({p.first->position, i < kMostNames ? lines_text(p.lines) : std::string(),
                   look_of(*p.first).colour});
    for (const Fault* f : p.others) out.push_back({f->position, {}, look_of(*f).colour});
  }
  return all.size() - std::min(all.size(), kMostNames);
}

}  // namespace

std::string file_name(const rmp_code& code, std::uint32_t file) {
  return file < code.files.count ? row<rmp_code_file>(code.files, file).name : "";
}
std::string routine_name(const rmp_code& code, std::uint32_t routine) {
  if (routine >= code.routines.count) return "";
  const auto& r = row<rmp_code_routine>(code.routines, routine);
  return r.symbol < code.symbols.count ? row<rmp_code_symbol>(code.symbols, r.symbol).name : "";
}
std::string where_of(const rmp_code& code, const rmp_span& s) {
  return file_name(code, s.file) + ":" + std::to_string(s.line) + ":" + std::to_string(s.column);
}

std::string sentence_of(const rmp_code& code, const Fault& f) {
  std::string out = where_of(code, f.place.span) + ": " + std::string(to_string(f.severity)) +
                    ": " + std::string(to_string(f.kind)) + ": " + f.message + ".";
  if (!f.hint.empty()) out += " " + f.hint;
  std::string more = "t = " + print_rounded(f.at, 5) + " s";
  if (f.place.count > 1 || f.times > 1) more += ", run " + std::to_string(f.place.count);
  if (f.times > 1) more += ", " + std::to_string(f.times) + " in all";
  for (std::size_t k = 0; k + 1 < f.place.calls.size(); ++k)
    more += (k == 0 ? ", in " : ", from ") + f.place.calls[k].name + " called in line " +
            std::to_string(f.place.calls[k + 1].span.line);
  return out + " (" + more + ")";
}

std::string lines_text(const std::set<std::uint32_t>& lines) {
  constexpr std::size_t kMostLines = 4;
  std::vector<std::string> words;
  for (const std::uint32_t l : lines) words.push_back(std::to_string(l));
  if (words.size() == 1) return "line " + words.front();
  if (words.size() > kMostLines + 1) {
    const std::string more = std::to_string(words.size() - kMostLines) + " more";
    words.resize(kMostLines);
    words.push_back(more);
  }
  const std::string last = words.back();
  words.pop_back();
  return "lines " + text::join(words, ", ") + " and " + last;
}
std::string shortened(std::string_view s, std::size_t most) {
  if (s.size() <= most) return std::string(s);
  const std::size_t blank = s.rfind(' ', most);
  const std::size_t end = blank == std::string_view::npos || blank == 0 ? s.find(' ') : blank;
  if (end == std::string_view::npos) return std::string(s);
  const auto left_out = std::count(s.begin() + static_cast<std::ptrdiff_t>(end), s.end(), ' ');
  return std::string(s.substr(0, end)) + " ... (" + std::to_string(left_out) +
         (left_out == 1 ? " more word)" : " more words)");
}

const Fault* shown_fault(const Check& check) {
  for (const Fault& f : check.faults)
    if (is_drawn(f) && f.severity != Severity::note) return &f;
  return nullptr;
}

std::size_t mark_run(render::Scene& scene, const CheckedProgram& c) {
  std::vector<scene::MarkedStretch> stretches;
  std::vector<scene::MarkedPlace> places;
  const auto& time = c.check.recording->columns.front().values;
  for (std::size_t i = 0; i < c.check.motions.size(); ++i) {
    const ToolWay way = tool_way(c.check, i);
    // The worst that is wrong at each point.
    std::vector<const Fault*> at(way.world_T_tip.size(), nullptr);
    for (const Fault& f : c.check.faults) {
      if (!is_drawn(f)) continue;
      // Bodies touch over several motions; their fault stands at the line of the worst.
      const bool is_of_bodies = f.kind == FaultKind::contact || f.kind == FaultKind::clearance;
      if (f.motion != i && !(is_of_bodies && !way.rows.empty())) continue;
      for (std::size_t k = 0; k < at.size(); ++k) {
        const bool is_in = way.rows.empty() ? k >= c.check.motions[i].motion.is_reached.size() ||
                                                  !c.check.motions[i].motion.is_reached[k]
                                            : time[way.rows[k]] >= f.from - 1e-6 &&
                                                  time[way.rows[k]] <= f.to + 1e-6;
        if (is_in && (!at[k] || f.severity < at[k]->severity)) at[k] = &f;
      }
    }
    for (std::size_t k = 0; k < at.size();) {
      std::size_t end = k + 1;
      while (end < at.size() && at[end] == at[k]) ++end;
      const Look look = at[k] ? look_of(*at[k]) : kGood;
      scene::MarkedStretch s;
      s.colour = look.colour, s.kind = look.word, s.is_good = !at[k];
      for (std::size_t n = k > 0 ? k - 1 : k; n < end; ++n) s.poses.push_back(way.world_T_tip[n]);
      stretches.push_back(std::move(s));
      k = end;
    }
  }
  std::vector<Pose> way;
  for (const auto& one : stretches) way.insert(way.end(), one.poses.begin(), one.poses.end());
  const std::size_t unnamed = place_marks(c.check, scene::size_of(way), places);
  scene::mark_stretches(scene, c.name, stretches, places);
  return unnamed;
}

std::string caption_of(const CheckedProgram& c, const Fault& first, std::size_t unnamed) {
  constexpr std::size_t kLongest = 220;
  std::string out =
      shortened(where_of(c.code->code(), first.place.span) + ": " + first.message, kLongest);
  const auto others = std::count_if(c.check.faults.begin(), c.check.faults.end(), is_drawn) - 1;
  if (others > 0)
    out += "; " + std::to_string(others) + (others == 1 ? " more fault" : " more faults");
  if (unnamed > 0) out += ", " + std::to_string(unnamed) + " places without a word";
  return out;
}

Result<recording::Plot> limits_plot(const CheckedProgram& c) {
  const recording::Recording& r = *c.check.recording;
  recording::Plot out;
  out.title = c.name + ": joints against their limits";
  out.x_label = "time [s]";
  out.is_tight = true;
  const std::vector<double>& time = r.columns.front().values;
  std::set<std::string> robots;
  for (const MotionReport& m : c.check.motions)
    if (m.motion.robot < c.check.inspection->robots.size())
      robots.insert(c.check.inspection->robots[m.motion.robot].name);
  // Where the robot was put to its target, nothing moved.
  std::vector<bool> is_jump(time.size(), false);
  for (const MotionReport& m : c.check.motions) {
    if (!m.motion.is_jump) continue;
    for (std::size_t row = 0; row < time.size(); ++row) {
      const double step = row > 0 ? time[row] - time[row - 1] : 0.0;
      if (time[row] >= m.motion.start - 1.5 * step - 1e-9 &&
          time[row] <= m.motion.end + 1.5 * step + 1e-9)
        is_jump[row] = true;
    }
  }
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  const auto panel = [&](const std::string& robot, const char* stem, const std::string& label) {
    const robotics::MakerAxes axes = sim::member_axes(*c.snapshot, c.world, robot);
    recording::PlotPanel p;
    p.y_label = label;
    p.lower = -1, p.upper = 1;
    for (std::size_t j = 1;; ++j) {
      const auto* column = r.find(robot + stem + std::to_string(j));
      if (!column) break;
      if (!std::isfinite(column->lower) || !std::isfinite(column->upper) ||
          !(column->upper > column->lower))
        continue;
      recording::PlotLine line;
      const PostAxis* const axis = axes.of_entry(j - 1);
      line.name =
          (axis ? std::string(axis->name) + ", " : std::string()) + "joint " + std::to_string(j);
      line.colour = j - 1;
      line.x = time;
      const double middle = 0.5 * (column->upper + column->lower),
                   half = 0.5 * (column->upper - column->lower);
      const bool is_place = std::string_view(stem) == ".q";
      for (std::size_t row = 0; row < time.size(); ++row)
        line.y.push_back(is_jump[row] && !is_place ? kNothing
                                                   : (column->values[row] - middle) / half);
      p.lines.push_back(std::move(line));
    }
    if (!p.lines.empty()) out.panels.push_back(std::move(p));
  };
  for (const std::string& robot : robots) {
    const std::string of = robots.size() > 1 ? robot + " " : "";
    panel(robot, ".q", of + "position / limit");
    panel(robot, ".qd", of + "velocity / limit");
    panel(robot, ".tau", of + "torque / limit");
  }
  if (const auto* column = r.find("clearance")) {
    recording::PlotPanel p;
    p.y_label = "clearance [mm]";
    recording::PlotLine line;
    line.name = "clearance";
    line.x = time;
    bool has_value = false;
    for (std::size_t row = 0; row < time.size(); ++row) {
      const double v = column->values[row];
      line.y.push_back(std::isfinite(v) && !is_jump[row] ? v * 1000 : kNothing);
      has_value = has_value || std::isfinite(v);
    }
    p.lower = c.options.clearance * 1000;
    p.lines.push_back(std::move(line));
    if (has_value) out.panels.push_back(std::move(p));
  }
  if (out.panels.empty())
    return error(ErrorCode::unsupported, "no joint has limits, and nothing can touch",
                 "Leave plot out.", "plot");
  for (const Fault& f : c.check.faults) {
    if (f.severity == Severity::note) continue;
    const Look look = look_of(f);
    const auto hex = [](float v) {
      static constexpr char kDigits[] = "0123456789abcdef";
      const auto b = static_cast<unsigned>(std::clamp(v, 0.0F, 1.0F) * 255.0F + 0.5F);
      return std::string{kDigits[b >> 4U], kDigits[b & 15U]};
    };
    // A line is named once where it has several faults at a time.
    const std::string word = "line " + std::to_string(f.place.span.line);
    const bool is_named = std::any_of(out.marks.begin(), out.marks.end(), [&](const auto& m) {
      return m.text == word && f.from <= m.to + 1e-9 && f.to >= m.from - 1e-9;
    });
    if (is_named) continue;
    out.marks.push_back({f.from, std::max(f.to, f.from),
                         "line " + std::to_string(f.place.span.line),
                         "#" + hex(look.colour.r) + hex(look.colour.g) + hex(look.colour.b)});
  }
  std::stable_sort(out.marks.begin(), out.marks.end(),
                   [](const auto& a, const auto& b) { return a.from < b.from; });
  out.samples = time.size() * out.panels.size();
  out.height = 110 + 190 * static_cast<int>(out.panels.size());
  return out;
}

}  // namespace robomosp::program_check
