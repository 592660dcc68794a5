// SPDX-License-Identifier: Apache-2.0
#include "motion/weave.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "kernel/text.h"
#include "spatial/pose.h"
#include "spatial/quintic.h"

namespace robomosp::motion {
namespace {

constexpr double kLeastWay = 1e-6;     ///< of a piece that has swings [m]
constexpr double kLeastSpeed = 1e-9;   ///< [m/s]
constexpr double kLeastAngle = 0.087;  ///< sine of the angle between the way and the tool's z
constexpr double kNear = 1e-4;         ///< between samples for the turning of the sides [s]

/// Where the side of a sample points, and how fast that turns.
struct Side {
  Vec3 n{}, rate{};
};
/// Nothing = it stands, or its z is along its way (`is_along`).
std::optional<Side> side_of(const PathSample& s, bool& is_along) {
  using namespace spatial;
  is_along = false;
  const double v = norm(s.velocity);
  if (!(v > kLeastSpeed)) return std::nullopt;
  const Vec3 along = scale(s.velocity, 1 / v);
  const Vec3 along_rate =
      scale(sub(s.acceleration, scale(along, dot(s.acceleration, along))), 1 / v);
  const Vec3 z = rotate(s.pose, Vec3{0, 0, 1});
  const Vec3 z_rate = cross(s.angular_velocity, z);
  const Vec3 across = cross(z, along);
  const double sine = norm(across);
  if (sine < kLeastAngle) {
    is_along = true;
    return std::nullopt;
  }
  const Vec3 rate = add(cross(z_rate, along), cross(z, along_rate));
  Side out;
  out.n = scale(across, 1 / sine);
  out.rate = scale(sub(rate, scale(out.n, dot(out.n, rate))), 1 / sine);
  return out;
}

/// How far it is to the side, and its first two derivatives by the way.
std::array<double, 3> swing(const Weave& w, double s, double whole) {
  const double rise = std::min(w.length, whole / 2);
  const bool is_rising = s < whole / 2;
  const double x = std::clamp((is_rising ? s : whole - s) / rise, 0.0, 1.0);
  const spatial::Jet e = spatial::ease(x);
  const double e1 = (is_rising ? 1 : -1) * e.d / rise, e2 = e.dd / (rise * rise);
  const double k = 2 * std::numbers::pi / w.length;
  const double sine = w.amplitude * std::sin(k * s), cosine = w.amplitude * std::cos(k * s);
  return {e.v * sine, e1 * sine + e.v * k * cosine,
          e2 * sine + 2 * e1 * k * cosine - e.v * k * k * sine};
}

}  // namespace

Result<Weaving> Weaving::over(std::shared_ptr<const Path> path, const Weave& weave) {
  Weaving out;
  out.weave_ = weave;
  for (const Path::Piece& p : path->pieces()) {
    Piece one;
    one.start = p.start;
    one.duration = p.segment->duration();
    // Between these times the speed is taken as a line, as under a trapezoidal law.
    const auto count =
        static_cast<std::size_t>(std::clamp(std::ceil(one.duration * 2000), 256.0, 200'000.0));
    std::vector<double> times(count + 1);
    for (std::size_t i = 0; i <= count; ++i)
      times[i] = one.duration * static_cast<double>(i) / static_cast<double>(count);
    std::vector<PathSample> samples(times.size());
    RMP_TRY(p.segment->sample(times, samples));
    one.way.resize(times.size());
    one.speed.resize(times.size());
    for (std::size_t i = 0; i <= count; ++i) {
      one.speed[i] = spatial::norm(samples[i].velocity);
      if (i > 0)
        one.way[i] =
            one.way[i - 1] + (one.speed[i] + one.speed[i - 1]) / 2 * (times[i] - times[i - 1]);
    }
    out.pieces_.push_back(std::move(one));
  }
  out.path_ = std::move(path);
  return out;
}

const Weaving::Piece& Weaving::piece_at(double t) const {
  auto after = std::upper_bound(pieces_.begin(), pieces_.end(), t,
                                [](double x, const Piece& p) { return x < p.start; });
  return after == pieces_.begin() ? *after : *std::prev(after);
}

Result<void> Weaving::move(std::span<const double> times, std::span<PathSample> samples) const {
  using namespace spatial;
  if (!(weave_.amplitude > 0) || pieces_.empty()) return {};
  // The path a little before and behind each sample, within its piece.
  std::vector<double> near;
  near.reserve(2 * times.size());
  for (const double t : times) {
    const Piece& p = piece_at(t);
    const double h = std::min(kNear, p.duration / 1000);
    near.push_back(std::max(t - h, p.start));
    near.push_back(std::min(t + h, p.start + p.duration * (1 - 1e-12)));
  }
  std::vector<PathSample> around(near.size());
  RMP_TRY(path_->sample(near, around));
  for (std::size_t i = 0; i < times.size(); ++i) {
    const Piece& p = piece_at(times[i]);
    const double whole = p.way.back();
    if (!(whole > kLeastWay)) continue;
    const double step = p.duration / static_cast<double>(p.way.size() - 1);
    const double u = std::clamp(times[i] - p.start, 0.0, p.duration);
    const std::size_t k = std::min(static_cast<std::size_t>(u / step), p.way.size() - 2);
    const double h = u - static_cast<double>(k) * step;
    const double way =
        p.way[k] + p.speed[k] * h + (p.speed[k + 1] - p.speed[k]) / (2 * step) * h * h;
    const auto [d, d1, d2] = swing(weave_, way, whole);
    PathSample& s = samples[i];
    bool is_along = false, is_along_near = false;
    const auto now = side_of(s, is_along);
    const auto before = side_of(around[2 * i], is_along_near);
    const auto behind = side_of(around[2 * i + 1], is_along_near);
    if (is_along)
      return error(ErrorCode::unsupported,
                   "the tool cannot swing to its sides at t = " + text::print_rounded(times[i]) +
                       " s of the motion: its z axis is along its path",
                   "Rotate the tool, or remove WOBBLE.");
    const auto& side = now ? now : before ? before : behind;
    if (!side) continue;  // it stands there, at an end
    const double v = norm(s.velocity);
    const double a = v > kLeastSpeed ? dot(s.acceleration, s.velocity) / v : 0;
    const double rate = d1 * v, second = d2 * v * v + d1 * a;
    Vec3 turning{};
    const double between = near[2 * i + 1] - near[2 * i];
    if (before && behind && between > 0)
      turning = scale(sub(behind->rate, before->rate), 1 / between);
    s.pose.p = add(s.pose.p, scale(side->n, d));
    s.velocity = add(s.velocity, add(scale(side->n, rate), scale(side->rate, d)));
    s.acceleration = add(s.acceleration, add(scale(side->n, second),
                                             add(scale(side->rate, 2 * rate), scale(turning, d))));
  }
  return {};
}

}  // namespace robomosp::motion
