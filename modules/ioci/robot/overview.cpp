// SPDX-License-Identifier: Apache-2.0
// A robot on one screen: rows, limits, masses, tools and solvers.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>

#include "ioci/core/commands.h"
#include "ioci/robot/robots.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "model/words.h"
#include "robotics/maker_axes.h"
#include "sim/ik_choice.h"

namespace robomosp::ioci {
namespace {

using model::JointKind;
using model::Link;
using model::Robot;

constexpr std::size_t kMostLinks = 24, kMostNames = 12;

std::string number(double v) { return text::print_rounded(v, 5); }

/// A table of Markdown; columns without a single entry are left out.
class Table {
 public:
  void column(std::string heading, bool is_text = false) {
    headings_.push_back(std::move(heading));
    is_text_.push_back(is_text);
  }
  void row(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }

  [[nodiscard]] std::string text() const {
    std::vector<bool> is_used(headings_.size(), false);
    for (const auto& r : rows_)
      for (std::size_t c = 0; c < r.size(); ++c) is_used[c] = is_used[c] || !r[c].empty();
    const auto line = [&is_used](const std::vector<std::string>& cells) {
      std::string out = "|";
      for (std::size_t c = 0; c < cells.size(); ++c) {
        if (!is_used[c]) continue;
        out += ' ';
        for (const char letter : cells[c]) out += letter == '|' ? "\\|" : std::string(1, letter);
        out += " |";
      }
      return out + "\n";
    };
    std::string out = line(headings_) + "|";
    for (std::size_t c = 0; c < headings_.size(); ++c)
      if (is_used[c]) out += is_text_[c] ? "---|" : "---:|";
    out += "\n";
    const std::size_t tail = kMostLinks / 4;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (rows_.size() > kMostLinks && i == kMostLinks - tail) {
        std::vector<std::string> gap(headings_.size());
        gap[0] = "... " + std::to_string(rows_.size() - kMostLinks) + " more";
        out += line(gap);
        i = rows_.size() - tail;
      }
      out += line(rows_[i]);
    }
    return out;
  }

 private:
  std::vector<std::string> headings_;
  std::vector<bool> is_text_;
  std::vector<std::vector<std::string>> rows_;
};

std::string triple(const Vec3& v, double scale = 1) {
  return number(v[0] / scale) + ", " + number(v[1] / scale) + ", " + number(v[2] / scale);
}

Vec3 rpy_of(const model::Placement& p) { return spatial::to_rpy(model::pose(p).R); }

/// What one link weighs and whether that is designed, as the robot's solvers count it.
Result<std::optional<double>> weight(CommandContext& ctx, const Robot& r, const Link& l) {
  if (r.mass_source == model::MassSource::designed && !l.parts.empty()) {
    RMP_TRY_ASSIGN(const auto parts, ctx.app.derived.mass(ctx.snapshot(), l.parts, ctx.progress));
    if (parts.mass.mass > 0) return std::optional(parts.mass.mass);
  }
  if (l.given) return std::optional(l.given->mass);
  return std::optional<double>();
}

std::string link_table(CommandContext& ctx, const Robot& r, double& total, std::string& fault) {
  Table table;
  table.column("link", true);
  table.column("on", true);
  table.column("joint", true);
  for (const char* heading : {"alpha", "a", "theta", "d"}) table.column(heading);
  table.column("origin", true);
  table.column("rpy", true);
  table.column("axis", true);
  for (const char* heading : {"lower", "upper", "speed", "acc", "force", "kg"})
    table.column(heading);
  const bool is_tree = [&] {
    for (std::size_t i = 0; i < r.links.size(); ++i)
      if (r.links[i].parent != static_cast<std::int32_t>(i) - 1) return true;
    return false;
  }();
  for (const Link& l : r.links) {
    const bool turns = l.joint == JointKind::revolute;
    const bool is_plain = turns || l.joint == JointKind::prismatic;
    const double unit = turns ? kDegree : 1;
    std::string joint(model::joint_word(l.joint));
    if (l.mimic) {
      const auto of = static_cast<std::size_t>(l.mimic->link);
      joint += " as " + (of < r.links.size() ? r.links[of].name : std::string("?"));
    } else if (l.passive) {
      joint += ", passive";
    }
    std::vector<std::string> cells{l.name,
                                   !is_tree ? ""
                                   : l.parent < 0
                                       ? "base"
                                       : r.links[static_cast<std::size_t>(l.parent)].name,
                                   std::move(joint)};
    if (l.origin) {
      cells.insert(cells.end(), 4, "");
      cells.push_back(triple(model::position(*l.origin)));
      const Vec3 rpy = rpy_of(*l.origin);
      cells.push_back(rpy == Vec3{} ? "" : triple(rpy, kDegree));
      cells.push_back(l.joint == JointKind::fixed ? "" : triple(l.axis));
    } else {
      // The joint's own place counts as zero in its column.
      cells.push_back(number(l.row.alpha / kDegree));
      cells.push_back(number(l.row.a));
      cells.push_back(number(l.row.theta / kDegree) + (turns ? " + q" : ""));
      cells.push_back(number(l.row.d) + (l.joint == JointKind::prismatic ? " + q" : ""));
      cells.insert(cells.end(), 3, "");
    }
    for (const double limit : {l.lower, l.upper, l.max_velocity, l.max_acceleration})
      cells.push_back(is_plain && std::isfinite(limit) ? number(limit / unit) : "");
    cells.push_back(is_plain && std::isfinite(l.max_force) ? number(l.max_force) : "");
    auto kg = weight(ctx, r, l);
    if (!kg.ok()) fault = kg.error().sentence();
    cells.push_back(kg.ok() && *kg ? number(**kg) : "");
    if (kg.ok() && *kg) total += **kg;
    table.row(std::move(cells));
  }
  return table.text();
}

/// "A1 = -q1 (-155 to 155 deg), A3 = q3 + 90 deg (-15 to 158 deg)": how the maker counts; nothing
/// where it is not known.
std::string axes_text(const Robot& r) {
  const auto axes = robotics::MakerAxes::of(r);
  if (!axes.ok()) return {};
  const auto term = [](double factor, std::size_t entry, bool is_first) {
    const double size = std::fabs(factor);
    return std::string(factor < 0 ? (is_first ? "-" : " - ") : (is_first ? "" : " + ")) +
           (size == 1 ? "" : number(size) + " ") + "q" + std::to_string(entry + 1);
  };
  std::string out;
  for (const PostAxis& a : axes->axes()) {
    const std::string unit = a.linear ? " mm" : " deg";
    out += (out.empty() ? "" : ", ") + std::string(a.name) + " = " +
           term(a.sign, static_cast<std::size_t>(a.joint), true);
    for (std::size_t k = 0; k < a.coupled.size(); ++k)
      if (a.coupled[k] != 0) out += term(a.coupled[k], k, false);
    if (a.offset != 0) out += (a.offset < 0 ? " - " : " + ") + number(std::fabs(a.offset)) + unit;
    if (std::isfinite(a.lower) && std::isfinite(a.upper) && a.lower < a.upper)
      out += " (" + number(a.lower) + " to " + number(a.upper) + unit + ")";
  }
  return out;
}

std::string tool_text(const Robot& r, std::int32_t link, const std::string& name,
                      const model::Placement& at, const std::optional<MassProperties>& payload) {
  std::string out = name;
  out +=
      " on " + (link < 0 ? std::string("the base") : r.links[static_cast<std::size_t>(link)].name);
  if (model::position(at) != Vec3{}) out += " at {" + triple(model::position(at)) + "} m";
  if (rpy_of(at) != Vec3{}) out += " turned by {" + triple(rpy_of(at), kDegree) + "} deg";
  if (payload) out += " carrying " + number(payload->mass) + " kg";
  return out;
}

/// "newton_euler (default)", or what the robot names.
std::string solver_text(const CommandContext& ctx, const model::ProviderChoice& chosen,
                        std::string_view interface_id) {
  if (!chosen.name.empty()) return chosen.name;
  const auto found = ctx.app.registry.find(interface_id, "");
  return found.ok() ? found->name + " (default)" : "none";
}

std::string ik_text(CommandContext& ctx, const Map& args, const Robot& r) {
  if (!r.ik.name.empty()) return r.ik.name;
  const auto built = model_of(ctx, args);
  if (built.ok())
    if (const auto found = sim::automatic_ik(ctx.app.registry, **built); found.ok())
      return found->provider + (found->is_closed_form ? " (closed form that fits)" : " (default)");
  return solver_text(ctx, r.ik, IkSolver::kInterfaceId);
}

Result<Value> overview(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  std::string out = ctx.snapshot().find(ref(args, "id"))->name;
  if (!r.description.empty()) out += ": " + r.description;
  out += "\n";
  if (!r.source.empty()) out += "Source: " + r.source + "\n";

  const auto moving =
      static_cast<std::size_t>(std::count_if(r.links.begin(), r.links.end(), [](const Link& l) {
        return l.joint != JointKind::fixed && !l.mimic;
      }));
  const bool has_rows =
      std::any_of(r.links.begin(), r.links.end(), [](const Link& l) { return !l.origin; });
  double total = 0;
  std::string fault;
  const std::string table = link_table(ctx, r, total, fault);
  out += std::to_string(moving) + (moving == 1 ? " joint" : " joints");
  if (has_rows)
    out += r.convention == model::Convention::dh ? ", standard Denavit-Hartenberg rows"
                                                 : ", modified Denavit-Hartenberg rows";
  out += "; deg, m, kg, N m, N; rates a second\n\n" + table + "\n";

  const auto note = [&out](const char* word, const std::string& what) {
    std::string head(word);
    head.resize(10, ' ');
    if (!what.empty()) out += "  " + head + what + "\n";
  };
  if (!fault.empty()) note("masses", fault);
  else if (total > 0)
    note("masses",
         number(total) + " kg in all, " +
             (r.mass_source == model::MassSource::designed ? "of the designed parts" : "as given"));
  else note("masses", "none: its torques are zero");
  if (model::position(r.base) != Vec3{} || rpy_of(r.base) != Vec3{})
    note("base", "at {" + triple(model::position(r.base)) + "} m, turned by {" +
                     triple(rpy_of(r.base), kDegree) + "} deg in its mounting");
  note("axes", axes_text(r));
  std::vector<std::string> tools;
  if (!r.links.empty())
    tools.push_back(
        tool_text(r, static_cast<std::int32_t>(r.links.size()) - 1, "tool", r.tool, r.payload));
  for (const model::RobotTool& t : r.tools)
    tools.push_back(tool_text(r, t.link, t.name, t.placement, t.payload));
  note("tools", text::enumerate_some(tools, kMostNames));
  tools.clear();
  for (const model::AttachedTool& t : r.attached) {
    const auto mass = ctx.app.derived.mass(ctx.snapshot(), t.what, ctx.progress);
    tools.push_back(tool_text(r, t.link, t.name, t.placement, std::nullopt) +
                    (mass.ok() ? " weighing " + number(mass->mass.mass) + " kg" : ""));
  }
  note("attached", text::enumerate_some(tools, kMostNames));
  if (!r.tcp.empty()) note("", "the robot's tool is " + r.tcp);
  std::vector<std::string> names;
  for (const model::LoopClosure& l : r.loops) names.push_back(l.name);
  note("loops", text::enumerate_some(names, kMostNames));
  names.clear();
  for (const model::NamedPose& p : r.poses) names.push_back(p.name);
  note("poses", text::enumerate_some(names, kMostNames));
  note("solvers", "inverse kinematics " + ik_text(ctx, args, r) + "; inverse dynamics " +
                      solver_text(ctx, r.inverse_dynamics, InverseDynamics::kInterfaceId) +
                      "; forward dynamics " +
                      solver_text(ctx, r.forward_dynamics, ForwardDynamics::kInterfaceId) +
                      (r.controller.name.empty() ? "" : "; controller " + r.controller.name));
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(robot_overview_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "robot.overview",
       .classic = "",
       .summary = "Shows a robot on one screen: rows, limits, masses, tools, solvers.",
       .details = "This is what the console prints for a robot. Angles are in degrees here; "
                  "robot.dh_table, robot.joints and robot.links return the same as numbers in SI.",
       .example = with_arm("assert(arm:overview():find(\"6 joints, standard Denavit\"))"),
       .params = {self("robot")},
       .returns = {"string", "", "Markdown.", {}},
       .effect = Effect::reads,
       .run = overview});
  return all;
}

}  // namespace robomosp::ioci
