// SPDX-License-Identifier: Apache-2.0
#include "robotics/controller_profile.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string_view>
#include <utility>

#include "kernel/text.h"
#include "kernel/unknown_name.h"
#include "model/placement.h"

namespace robomosp::robotics {
namespace {

/// Kind of signals that are variables which several programs share.
constexpr const char* kShared = "shared";

Result<std::int32_t> find_place(const std::vector<model::ControllerPlace>& all,
                                const std::string& name, const char* what,
                                const std::string& where) {
  if (name.empty()) return std::int32_t{-1};
  std::vector<std::string> names;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].name == name) return static_cast<std::int32_t>(i);
    names.push_back(all[i].name);
  }
  return unknown_name(what, name, names).in(where);
}

}  // namespace

Result<void> ControllerProfile::fill() {
  const std::string where = "controller " + text::quote(name);
  // Where one axis has a sign or an offset, those of the others are 1 and 0.
  const bool is_given = std::any_of(
      record.axes.begin(), record.axes.end(),
      [](const model::ControllerAxis& a) { return !a.is_external && (a.sign || a.offset != 0); });
  for (const auto& a : record.axes) {
    if (a.sign == 0)
      return error(ErrorCode::invalid_argument, "the sign of axis " + text::quote(a.name) + " is 0",
                   "It is 1 or -1.", where);
    axes.push_back({a.name,
                    a.joint - 1,
                    a.is_external,
                    a.is_linear,
                    double(a.sign.value_or(1)),
                    a.offset,
                    a.pulses,
                    a.lower,
                    a.upper,
                    {},
                    is_given ? PostAxisOrigin::profile : PostAxisOrigin::not_known,
                    0,
                    {}});
  }
  for (const auto& s : record.signals)
    signals.push_back({s.name, s.target, s.number, s.kind, s.is_inverted, {}});
  for (const auto& p : record.tools)
    tools.push_back({p.name, p.number, model::pose(p.placement), p.mass, {}, {}});
  for (const auto& p : record.frames)
    frames.push_back({p.name, p.number, model::pose(p.placement), 0, {}, {}});
  for (const auto& o : record.options) options.push_back({o.name, o.value, {}});
  for (const auto& l : record.prologue) prologue += l + "\n";
  for (const auto& l : record.epilogue) epilogue += l + "\n";
  view.name = name;
  view.axes = axes;
  view.signals = signals;
  view.tools = tools;
  view.frames = frames;
  RMP_TRY_ASSIGN(view.tool, find_place(record.tools, record.tool, "tool", where));
  RMP_TRY_ASSIGN(view.frame, find_place(record.frames, record.frame, "frame", where));
  view.prologue = prologue;
  view.epilogue = epilogue;
  view.length_digits = record.length_digits;
  view.angle_digits = record.angle_digits;
  view.speed_digits = record.speed_digits;
  view.max_points = record.max_points;
  view.max_lines = record.max_lines;
  view.max_bytes = record.max_bytes;
  view.max_speed = record.max_speed * 1000;
  view.max_speed_ori = record.max_speed_ori * 180 / std::numbers::pi;
  view.options = options;
  return {};
}

Result<std::vector<std::string>> ControllerProfile::use(MakerAxes&& of_robot,
                                                        const std::string& robot,
                                                        std::span<const RailJoint> rail) {
  std::vector<std::string> told;
  maker = std::move(of_robot);
  if (!maker.known()) return told;
  std::vector<PostAxis> all(maker.axes().begin(), maker.axes().end());
  if (auto made = axes_behind_rail(all, rail); !made.ok())
    return std::move(made).error().in("robot " + text::quote(robot));
  std::vector<bool> is_used(axes.size(), false);
  const auto same_name = [](std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
      return std::tolower(static_cast<unsigned char>(x)) ==
             std::tolower(static_cast<unsigned char>(y));
    });
  };
  const auto is_named = [&](const PostAxis& own) {
    return std::any_of(maker.axes().begin(), maker.axes().end(),
                       [&](const PostAxis& a) { return same_name(a.name, own.name); });
  };
  const auto match = [&](const PostAxis& a) {
    for (std::size_t i = 0; i < axes.size(); ++i)
      if (!is_used[i] && same_name(axes[i].name, a.name)) return i;
    for (std::size_t i = 0; i < axes.size(); ++i)
      if (!is_used[i] && axes[i].external == a.external && (a.of_robot & 1) == 0 &&
          axes[i].joint == a.joint && !is_named(axes[i]))
        return i;
    return axes.size();
  };
  const auto shown = [](double v) { return text::print_rounded(v, 9); };
  const std::string of = " of controller " + text::quote(name);
  for (PostAxis& a : all) {
    const std::size_t i = match(a);
    if (i == axes.size()) continue;
    is_used[i] = true;
    const PostAxis& own = axes[i];
    const model::ControllerAxis& given = record.axes[i];
    std::string differs;
    const auto add = [&](const std::string& what) {
      differs += (differs.empty() ? "" : ", ") + what;
    };
    if (own.external != a.external) add(own.external ? "an external axis" : "no external axis");
    else if ((own.external && a.of_robot != 0) || own.joint != a.joint)
      add((own.external ? "additional joint " : "joint ") + std::to_string(own.joint + 1) +
          " instead of joint " + std::to_string(a.joint + 1));
    if (given.sign && own.sign != a.sign)
      add("sign " + shown(own.sign) + " instead of " + shown(a.sign));
    if ((given.sign || given.offset != 0) && !(std::fabs(own.offset - a.offset) < 1e-9))
      add("offset " + shown(own.offset) + " instead of " + shown(a.offset));
    if (!differs.empty())
      told.push_back("axis " + text::quote(own.name) + of + " has " + differs + " of robot " +
                     text::quote(robot) + ": the robot's counts");
    if (own.external == a.external) a.name = own.name;
    if (own.external == a.external && is_of_robot(a)) a.of_robot += 2;
    a.pulses = own.pulses;
    if (own.lower < own.upper) a.lower = own.lower, a.upper = own.upper;
  }
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (is_used[i]) continue;
    if (axes[i].external) all.push_back(axes[i]);
    else
      told.push_back("axis " + text::quote(axes[i].name) + of + " is none of robot " +
                     text::quote(robot) + " and is not written");
  }
  std::stable_partition(all.begin(), all.end(), [](const PostAxis& a) { return !a.external; });
  axes = std::move(all);
  view.axes = axes;
  return told;
}

void ControllerProfile::carry(std::span<const AdditionalAxis> bound, std::size_t slots) {
  if (std::any_of(record.axes.begin(), record.axes.end(),
                  [](const model::ControllerAxis& a) { return a.is_external; }))
    return;
  const bool has_external =
      std::any_of(axes.begin(), axes.end(), [](const PostAxis& a) { return a.external; });
  for (std::size_t n = 1; n <= slots; ++n) {
    const auto one = std::find_if(bound.begin(), bound.end(),
                                  [&](const AdditionalAxis& a) { return a.number == n; });
    if (has_external && one == bound.end()) continue;
    if (std::any_of(axes.begin(), axes.end(), [&](const PostAxis& a) {
          return a.external && a.of_robot == 0 && a.joint == static_cast<std::int32_t>(n) - 1;
        }))
      continue;
    PostAxis a;
    a.name = carried.emplace_back(
        one != bound.end() && !one->name.empty() ? one->name : "E" + std::to_string(n));
    a.joint = static_cast<std::int32_t>(n) - 1;
    a.external = true;
    if (one != bound.end()) {
      a.linear = one->is_linear, a.sign = one->sign, a.offset = one->offset;
      const double p = one->sign * one->lower + one->offset,
                   q = one->sign * one->upper + one->offset;
      if (std::isfinite(p) || std::isfinite(q)) a.lower = std::min(p, q), a.upper = std::max(p, q);
      if (!one->name.empty()) a.origin = PostAxisOrigin::robot;
    }
    axes.push_back(a);
  }
  view.axes = axes;
}

void ControllerProfile::share(const std::vector<std::string>& names, const std::string& robot,
                              std::size_t arm, const std::string& with) {
  shared = names;
  for (const std::string& n : shared) signals.push_back({n, n, -1, kShared, false, {}});
  view.signals = signals;
  number = std::to_string(arm);
  partner = with;
  std::vector<PostOption> own{{"shared_with", partner, {}}};
  for (const char* each : {"arm", "timer"}) {
    std::string_view value = number;
    for (const PostOption& o : options)
      if (o.name == std::string(each) + "_" + robot) value = o.value;
    own.push_back({each, value, {}});
  }
  options.insert(options.begin(), own.begin(), own.end());
  view.options = options;
}

}  // namespace robomosp::robotics
