// SPDX-License-Identifier: Apache-2.0
#include "robotics/maker_axes.h"

#include <cmath>
#include <cstdint>
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
    double lower = a.lower * unit, upper = a.upper * unit;
    const bool has_own = std::isfinite(a.lower) || std::isfinite(a.upper);
    if (!has_own && a.coupled.empty()) {
      const model::Link& l = robot.links[link];
      lower = a.sign * l.lower * unit + x.offset;
      upper = a.sign * l.upper * unit + x.offset;
      if (a.sign < 0) std::swap(lower, upper);
    }
    if (lower < upper && (std::isfinite(lower) || std::isfinite(upper)))
      x.lower = lower, x.upper = upper;
    out.axes_.push_back(x);
  }
  for (std::size_t i = 0; i < robot.links.size(); ++i)
    if (joints[i].q_count > 0 && !counted[i])
      return error(ErrorCode::invalid_argument,
                   "the maker's axes are given for " + std::to_string(n) +
                       (n == 1 ? " joint" : " joints") + ", but none for joint " +
                       text::quote(robot.links[i].name),
                   "Give every joint its axis (robot.set_axes), or remove all axes.");
  if (!joints_from_axes(out.axes_, std::vector<double>(n, 0.0),
                        std::vector<double>(out.coordinates_, 0.0), nullptr))
    return error(
        ErrorCode::invalid_argument,
        "the maker's axes are linearly dependent: joint values cannot be computed from them",
        "Check the ratios of the coupled joints.");
  return out;
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

std::string MakerAxes::before_place(std::size_t entry, std::span<const double> q) const {
  const PostAxis* a = of_entry(entry);
  const auto value = a ? axis_value(*a, q, nullptr) : std::nullopt;
  if (!value) return {};
  const std::string unit = a->linear ? " mm" : " deg";
  std::string out = "axis " + std::string(a->name) + " at " + text::print_rounded(*value, 6) + unit;
  if (a->coupled.empty() && std::isfinite(a->lower) && std::isfinite(a->upper) &&
      a->lower < a->upper)
    out += " (" + text::print_rounded(a->lower, 6) + " to " + text::print_rounded(a->upper, 6) +
           unit + ")";
  return out + ", ";
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
