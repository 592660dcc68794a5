// SPDX-License-Identifier: Apache-2.0
#include "robotics/maker_axes.h"

#include <cctype>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>

#include "kernel/text.h"
#include "robotics/coordinates.h"

namespace robomosp::robotics {

Result<MakerAxes> MakerAxes::of(const model::Robot& robot) {
  MakerAxes out;
  const std::size_t n = robot.axes.size();
  if (n == 0) return out;
  const std::vector<LinkJoints> joints = link_joints(robot);
  out.coordinates_ = coordinate_units(robot).size();
  out.names_.reserve(n);
  out.coupled_.reserve(n);
  std::vector<bool> counted(robot.links.size(), false);
  for (const model::MakerAxis& a : robot.axes) {
    const auto link = static_cast<std::size_t>(a.link);
    counted[link] = true;
    PostAxis x;
    x.name = out.names_.emplace_back(a.name);
    x.joint = joints[link].q;
    x.external = a.external;
    x.of_robot = a.external ? 1 : 0;
    x.linear = a.unit == model::AxisUnit::mm;
    x.sign = a.sign;
    x.origin = PostAxisOrigin::robot;
    const double unit = axis_scale(x, nullptr);
    x.offset = a.offset * unit;
    std::vector<double>& factors = out.coupled_.emplace_back();
    if (!a.coupled.empty()) {
      factors.assign(out.coordinates_, 0.0);
      for (const model::AxisCoupling& c : a.coupled)
        factors[static_cast<std::size_t>(joints[static_cast<std::size_t>(c.link)].q)] = c.ratio;
      x.coupled = factors;
    }
    const model::Link& moved = robot.links[link];
    out.joint_limits_.emplace_back(moved.lower, moved.upper);
    double lower = a.lower * unit, upper = a.upper * unit;
    const bool has_own = std::isfinite(a.lower) || std::isfinite(a.upper);
    if (!has_own && a.coupled.empty()) {
      lower = a.sign * moved.lower * unit + x.offset;
      upper = a.sign * moved.upper * unit + x.offset;
      if (a.sign < 0) std::swap(lower, upper);
    }
    if (lower < upper && (std::isfinite(lower) || std::isfinite(upper)))
      x.lower = lower, x.upper = upper;
    out.axes_.push_back(x);
  }
  for (std::size_t i = 0; i < robot.links.size(); ++i)
    if (joints[i].q_count > 0 && !counted[i])
      return error(ErrorCode::invalid_argument,
                   "no maker's axis is given for joint " + text::quote(robot.links[i].name),
                   "Give every joint its axis (robot.set_axes), or remove all axes.");
  if (!joints_from_axes(out.axes_, std::vector<double>(n, 0.0),
                        std::vector<double>(out.coordinates_, 0.0), nullptr))
    return error(
        ErrorCode::invalid_argument,
        "the maker's axes are linearly dependent: joint values cannot be computed from them",
        "Check the ratios of the coupled joints.");
  return out;
}

std::shared_ptr<const MakerAxes> MakerAxes::for_messages(const model::Robot* robot) {
  auto made = robot ? of(*robot) : Result<MakerAxes>(MakerAxes());
  return std::make_shared<const MakerAxes>(made.ok() ? std::move(*made) : MakerAxes());
}

const PostAxis* MakerAxes::of_entry(std::size_t entry) const {
  for (const PostAxis& a : axes_)
    if (a.joint == static_cast<std::int32_t>(entry)) return &a;
  return nullptr;
}

std::string MakerAxes::before_joint(std::size_t entry) const {
  const PostAxis* a = of_entry(entry);
  return a ? "axis " + std::string(a->name) + ", " : std::string();
}

std::string MakerAxes::place(const PostAxis& a, double value, std::span<const double> q) const {
  const std::string unit = a.linear ? " mm" : " deg";
  const auto range = [&](double lower, double upper) {
    return " (" + text::print_rounded(lower, 6) + " to " + text::print_rounded(upper, 6) + unit;
  };
  std::string out = "axis " + std::string(a.name) + " at " + text::print_rounded(value, 6) + unit;
  const bool has_range = std::isfinite(a.lower) && std::isfinite(a.upper) && a.lower < a.upper;
  const bool is_beyond = has_range && (value < a.lower || value > a.upper);
  if (has_range && (a.coupled.empty() || is_beyond)) return out + range(a.lower, a.upper) + "), ";
  if (a.coupled.empty() || q.empty()) return out + ", ";
  // The joint's range, moved by what the other joints add.
  const double scale = axis_scale(a, nullptr);
  const double own = (a.sign + a.coupled[static_cast<std::size_t>(a.joint)]) * scale;
  const double rest = value - own * q[static_cast<std::size_t>(a.joint)];
  auto [lower, upper] = joint_limits_[static_cast<std::size_t>(&a - axes_.data())];
  if (!std::isfinite(lower) || !std::isfinite(upper)) return out + ", ";
  lower = own * lower + rest, upper = own * upper + rest;
  if (lower > upper) std::swap(lower, upper);
  std::string others;
  for (std::size_t k = 0; k < a.coupled.size(); ++k) {
    const PostAxis* other = a.coupled[k] != 0 ? of_entry(k) : nullptr;
    const auto there = other && other != &a ? axis_value(*other, q, nullptr) : std::nullopt;
    if (!there) continue;
    others += (others.empty() ? " while " : " and ") + std::string(other->name) + " is at " +
              text::print_rounded(*there, 6) + (other->linear ? " mm" : " deg");
  }
  return out + range(lower, upper) + others + "), ";
}

std::string MakerAxes::before_place(std::size_t entry, std::span<const double> q) const {
  const PostAxis* a = of_entry(entry);
  const auto value = a ? axis_value(*a, q, nullptr) : std::nullopt;
  return value ? place(*a, *value, q) : std::string();
}

const PostAxis* MakerAxes::find(std::string_view name) const {
  for (const PostAxis& a : axes_)
    if (a.name == name) return &a;
  return nullptr;
}

namespace {

/// A joint that a text speaks of.
struct Mention {
  std::size_t end = 0;      ///< behind its words
  std::int32_t joint = -1;  ///< of the model; -1 = it is none
};

/// Reads `3`, `3 (elbow)`, `3 ("elbow")` or `"elbow"` behind the word "joint" at `at`.
Mention mention_at(const RobotModel& model, std::string_view words, std::size_t at) {
  const auto named = [&](std::string_view name) {
    for (std::size_t i = 0; i < model.joints.size(); ++i)
      if (model.joints[i].name == name) return static_cast<std::int32_t>(i);
    return std::int32_t{-1};
  };
  if (at < words.size() && words[at] == '"') {
    const std::size_t close = words.find('"', at + 1);
    if (close == std::string_view::npos) return {at, -1};
    return {close + 1, named(words.substr(at + 1, close - at - 1))};
  }
  std::size_t end = at;
  std::size_t number = 0;
  for (; end < words.size() && end < at + 9 && words[end] >= '0' && words[end] <= '9'; ++end)
    number = 10 * number + static_cast<std::size_t>(words[end] - '0');
  if (end == at || number == 0 || number > model.joints.size()) return {at, -1};
  const auto joint = static_cast<std::int32_t>(number - 1);
  const std::string& name = model.joints[number - 1].name;
  for (const std::string& in : {" (" + name + ")", " (\"" + name + "\")"})
    if (words.substr(end).starts_with(in)) return {end + in.size(), joint};
  if (words.substr(end).starts_with(" (\"")) {
    // The name counts: a solver may know a part of the robot, such as the arm on its rail.
    const std::size_t close = words.find("\")", end + 3);
    if (close == std::string_view::npos) return {end, -1};
    return {close + 2, named(words.substr(end + 3, close - end - 3))};
  }
  // A number alone is that of the joint only where each has one coordinate.
  return {end, model.is_simple() ? joint : -1};
}

/// The value [rad or m] of "would need 165 deg" at the beginning of a text.
std::optional<double> needed_value(std::string_view words) {
  constexpr std::string_view kWords = " would need ";
  if (!words.starts_with(kWords)) return std::nullopt;
  words.remove_prefix(kWords.size());
  const std::size_t space = words.find(' ');
  if (space == std::string_view::npos) return std::nullopt;
  const auto value = text::read_real(words.substr(0, space));
  words.remove_prefix(space + 1);
  const auto unit = words.substr(0, words.find_first_of(" ,;.:)"));
  if (!value) return std::nullopt;
  if (unit == "deg") return *value * std::numbers::pi / 180;
  if (unit == "mm") return *value / 1000;
  return unit == "m" || unit == "rad" ? value : std::nullopt;
}

/// Whether the words before a joint name its axis already.
bool is_named(std::string_view before, std::string_view axis) {
  const std::string words = "axis " + std::string(axis);
  const std::size_t at = before.rfind(words);
  if (at == std::string_view::npos || !before.ends_with(", ")) return false;
  const std::string_view since = before.substr(at + words.size());
  return since == ", " || (since.starts_with(" at ") && since.find("joint ") == since.npos &&
                           since.find(';') == since.npos);
}

}  // namespace

std::string MakerAxes::in_text(const RobotModel& model, std::string_view text) const {
  constexpr std::string_view kJoint = "joint ";
  std::string out;
  if (!known()) return std::string(text);
  std::size_t done = 0;
  std::size_t next = 0;
  for (std::size_t at = text.find(kJoint); at != std::string_view::npos;
       at = text.find(kJoint, next)) {
    next = at + 1;
    const auto before = static_cast<unsigned char>(at > 0 ? text[at - 1] : ' ');
    const bool is_word = before < 0x80 && std::isalnum(before) == 0 && before != '_';
    if (!is_word) continue;
    const Mention m = mention_at(model, text, at + kJoint.size());
    if (m.joint < 0) continue;
    next = m.end;
    const JointModel& joint = model.joints[static_cast<std::size_t>(m.joint)];
    if (joint.is_coupled() || coordinate_count(joint.type) != 1) continue;
    const PostAxis* const a = of_entry(static_cast<std::size_t>(joint.q_index));
    if (!a) continue;
    out += text.substr(done, at - done);
    done = at;
    if (is_named(out, a->name)) continue;
    const auto value = a->coupled.empty() ? needed_value(text.substr(m.end)) : std::nullopt;
    out += value ? place(*a, a->sign * *value * axis_scale(*a, nullptr) + a->offset, {})
                 : "axis " + std::string(a->name) + ", ";
  }
  return out += text.substr(done);
}

Error MakerAxes::in_error(const RobotModel& model, Error e) const {
  e.message = in_text(model, e.message);
  e.hint = in_text(model, e.hint);
  return e;
}

std::vector<double> MakerAxes::values(std::span<const double> q) const {
  std::vector<double> out;
  out.reserve(axes_.size());
  for (const PostAxis& a : axes_) out.push_back(axis_value(a, q, nullptr).value_or(std::nan("")));
  return out;
}

Result<std::vector<double>> MakerAxes::joints(std::span<const double> values) const {
  if (values.size() != axes_.size())
    return error(ErrorCode::invalid_argument,
                 std::to_string(values.size()) + " values are given, but the robot has " +
                     std::to_string(axes_.size()) + " axes",
                 "Give one value per axis, in degrees or mm.");
  auto q = joints_from_axes(axes_, values, std::vector<double>(coordinates_, 0.0), nullptr);
  if (!q)
    return error(
        ErrorCode::invalid_argument,
        "the maker's axes are linearly dependent: joint values cannot be computed from them",
        "Check the ratios of the coupled joints.");
  return std::move(*q);
}

}  // namespace robomosp::robotics
