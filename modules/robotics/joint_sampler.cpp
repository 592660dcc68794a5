// SPDX-License-Identifier: Apache-2.0
#include "robotics/joint_sampler.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace robomosp::robotics {
namespace {

/// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014) of a counter.
std::uint64_t mixed(std::uint64_t z) {
  z = (z + 1) * 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}
double unit(std::uint64_t z) { return static_cast<double>(z >> 11) * 0x1.0p-53; }

/// The root of x^(d+1) = x + 1 above 1.
double golden_ratio(std::size_t d) {
  double x = 2;
  for (int i = 0; i < 64; ++i) x = std::pow(1 + x, 1.0 / static_cast<double>(d + 1));
  return x;
}

/// A rotation evenly spread (Shoemake, Graphics Gems III, 1992, page 124).
void put_rotation(double a, double b, double c, double* q) {
  const double r = std::sqrt(1 - a), s = std::sqrt(a), t = 2 * std::numbers::pi;
  q[0] = s * std::cos(t * c), q[1] = r * std::sin(t * b);
  q[2] = r * std::cos(t * b), q[3] = s * std::sin(t * c);
}

}  // namespace

JointRange joint_range(const RobotModel& model, std::size_t joint) {
  JointRange range{model.joints[joint].lower, model.joints[joint].upper};
  for (const JointModel& j : model.joints) {
    if (j.coupling.of != static_cast<std::int32_t>(joint) || j.coupling.ratio == 0) continue;
    double low = (j.lower - j.coupling.offset) / j.coupling.ratio;
    double high = (j.upper - j.coupling.offset) / j.coupling.ratio;
    if (low > high) std::swap(low, high);
    range.lower = std::max(range.lower, low);
    range.upper = std::min(range.upper, high);
  }
  return range;
}

Result<JointSampler> JointSampler::make(const RobotModel& model, std::size_t tip,
                                        std::span<const double> fixed, std::uint64_t seed) {
  const std::string where = "robot \"" + model.name + "\"";
  if (!model.loops.empty())
    return error(ErrorCode::unsupported,
                 "the robot has closed loops, so its joints cannot be set one by one",
                 "Request the tree without its loops.", where);
  JointSampler s;
  s.fixed_.assign(fixed.begin(), fixed.end());
  s.seed_ = mixed(seed);
  std::vector<bool> moves(model.joints.size(), false);
  for (std::int32_t j = model.tips[tip].joint; j >= 0;) {
    const JointModel& joint = model.joints[static_cast<std::size_t>(j)];
    moves[static_cast<std::size_t>(joint.is_coupled() ? joint.coupling.of : j)] = true;
    j = joint.parent;
  }
  std::size_t digits = 0;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (!moves[j]) continue;
    const JointModel& joint = model.joints[j];
    Entry e;
    e.q = static_cast<std::size_t>(joint.q_index);
    e.digit = digits;
    e.is_ball = joint.type == JointType::spherical;
    if (joint.type == JointType::free)
      return error(ErrorCode::unsupported,
                   "joint \"" + joint.name + "\" moves freely, so the workspace is unbounded",
                   "Fix the base of the robot.", where);
    if (!e.is_ball) {
      auto [lower, upper] = joint_range(model, j);
      const bool is_turning = joint.type == JointType::revolute;
      if (!is_turning && !(std::isfinite(lower) && std::isfinite(upper)))
        return error(ErrorCode::invalid_argument,
                     "the prismatic joint \"" + joint.name +
                         "\" has no limits, so the workspace is unbounded",
                     "Give it limits.", where);
      if (!(lower <= upper))
        return error(ErrorCode::invalid_argument,
                     "the joint \"" + joint.name +
                         "\" has no value within its limits and those of the joints that follow it",
                     "Widen them.", where);
      const double turn = 2 * std::numbers::pi;
      if (!std::isfinite(lower)) lower = std::isfinite(upper) ? upper - turn : -turn / 2;
      if (!std::isfinite(upper)) upper = lower + turn;
      // Over a whole turn the limits are no faces of what the tip can reach.
      e.is_limited = !is_turning || upper - lower < turn * (1 - 1e-9);
      e.lower = lower, e.upper = upper;
    }
    digits += e.is_ball ? 3 : 1;
    s.entries_.push_back(e);
  }
  if (s.entries_.empty())
    return error(ErrorCode::invalid_argument,
                 "no joint moves the tip \"" + model.tips[tip].name + "\"",
                 "Choose a tip that moves.", where);
  const double ratio = golden_ratio(digits);
  for (std::size_t k = 0; k < digits; ++k) {
    const double share = std::pow(ratio, -static_cast<double>(k + 1));
    s.steps_.push_back(static_cast<std::uint64_t>(share * 0x1.0p64));
    s.starts_.push_back(mixed(s.seed_ + k));
  }
  return s;
}

void JointSampler::sample(std::uint64_t index, std::span<double> q) const {
  std::copy(fixed_.begin(), fixed_.end(), q.begin());
  std::uint64_t coins = mixed(seed_ ^ mixed(index));
  const bool is_on_faces = index % 2 == 1;
  const auto digit = [&](std::size_t k) { return unit(starts_[k] + index * steps_[k]); };
  std::size_t thrown = 0;
  for (const Entry& e : entries_) {
    if (e.is_ball) {
      put_rotation(digit(e.digit), digit(e.digit + 1), digit(e.digit + 2), &q[e.q]);
      continue;
    }
    q[e.q] = e.lower + (e.upper - e.lower) * digit(e.digit);
    if (!is_on_faces || !e.is_limited) continue;
    if (thrown++ == 32) coins = mixed(coins), thrown = 1;
    const std::uint64_t coin = coins & 3U;
    coins >>= 2U;
    if (coin == 0) q[e.q] = e.lower;
    if (coin == 1) q[e.q] = e.upper;
  }
}

}  // namespace robomosp::robotics
