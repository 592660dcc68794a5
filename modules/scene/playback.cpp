// SPDX-License-Identifier: Apache-2.0
#include "scene/playback.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <unordered_map>

namespace robomosp::scene {
namespace {

using Quaternion = std::array<double, 4>;  // w, x, y, z

// Shepperd's method: start from the largest of the four components, which never divides by a small
// number. S. W. Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1 (1978) 223.
Quaternion quaternion_of(const std::array<double, 9>& R) {
  const double trace = R[0] + R[4] + R[8];
  if (trace >= R[0] && trace >= R[4] && trace >= R[8]) {
    const double w = 0.5 * std::sqrt(std::max(0.0, 1 + trace)), s = 0.25 / w;
    return {w, (R[7] - R[5]) * s, (R[2] - R[6]) * s, (R[3] - R[1]) * s};
  }
  if (R[0] >= R[4] && R[0] >= R[8]) {
    const double x = 0.5 * std::sqrt(std::max(0.0, 1 + R[0] - R[4] - R[8])), s = 0.25 / x;
    return {(R[7] - R[5]) * s, x, (R[1] + R[3]) * s, (R[2] + R[6]) * s};
  }
  if (R[4] >= R[8]) {
    const double y = 0.5 * std::sqrt(std::max(0.0, 1 - R[0] + R[4] - R[8])), s = 0.25 / y;
    return {(R[2] - R[6]) * s, (R[1] + R[3]) * s, y, (R[5] + R[7]) * s};
  }
  const double z = 0.5 * std::sqrt(std::max(0.0, 1 - R[0] - R[4] + R[8])), s = 0.25 / z;
  return {(R[3] - R[1]) * s, (R[2] + R[6]) * s, (R[5] + R[7]) * s, z};
}

std::array<double, 9> matrix_of(const Quaternion& q) {
  const auto [w, x, y, z] = q;
  return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
          2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
          2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
}

Quaternion slerp(const Quaternion& a, Quaternion b, double u) {
  double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  if (cosine < 0) {
    for (double& x : b) x = -x;
    cosine = -cosine;
  }
  const double angle = std::acos(std::min(cosine, 1.0));
  // Below this angle the chord and the arc agree to the last bit that a picture can show.
  const bool is_small = angle < 1e-6;
  const double wa = is_small ? 1 - u : std::sin((1 - u) * angle) / std::sin(angle);
  const double wb = is_small ? u : std::sin(u * angle) / std::sin(angle);
  Quaternion q{};
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    q[i] = wa * a[i] + wb * b[i];
    sum += q[i] * q[i];
  }
  for (double& x : q) x /= std::sqrt(sum);
  return q;
}

Pose between(const Pose& a, const Pose& b, double u) {
  Pose t{matrix_of(slerp(quaternion_of(a.R), quaternion_of(b.R), u)), {}};
  for (std::size_t i = 0; i < 3; ++i) t.p[i] = (1 - u) * a.p[i] + u * b.p[i];
  return t;
}

bool is_finite(const Pose& t) {
  const auto finite = [](double x) { return std::isfinite(x); };
  return std::all_of(t.R.begin(), t.R.end(), finite) && std::all_of(t.p.begin(), t.p.end(), finite);
}

}  // namespace

Result<void> check(const Playback& playback) {
  const std::size_t wanted = playback.times.size() * playback.ids.size();
  if (playback.poses.size() != wanted) {
    return error(ErrorCode::invalid_argument,
                 "the playback has " + std::to_string(playback.poses.size()) + " poses, but " +
                     std::to_string(playback.times.size()) + " times and " +
                     std::to_string(playback.ids.size()) + " moving items need " +
                     std::to_string(wanted),
                 "Give one pose per time and item, time-major.");
  }
  for (std::size_t i = 0; i < playback.times.size(); ++i) {
    const bool is_increasing = i == 0 || playback.times[i] > playback.times[i - 1];
    if (!std::isfinite(playback.times[i]) || !is_increasing) {
      return error(ErrorCode::invalid_argument,
                   "time number " + std::to_string(i + 1) +
                       " of the playback is not larger than the previous one",
                   "Give finite, strictly increasing times in seconds.");
    }
  }
  for (std::size_t i = 0; i < playback.poses.size(); ++i) {
    if (!is_finite(playback.poses[i])) {
      return error(ErrorCode::invalid_argument,
                   "pose number " + std::to_string(i + 1) + " of the playback is not finite",
                   "Check the computation of the motion.");
    }
  }
  return {};
}

double duration(const Playback& playback) {
  return playback.times.size() < 2 ? 0.0 : playback.times.back() - playback.times.front();
}

std::vector<Pose> poses_at(const Playback& playback, double time) {
  const std::size_t n = playback.ids.size();
  if (playback.times.empty() || n == 0 || playback.poses.size() != n * playback.times.size())
    return {};
  const auto begin = playback.times.begin();
  const auto after =
      static_cast<std::size_t>(std::upper_bound(begin, playback.times.end(), time) - begin);
  const std::size_t last = playback.times.size() - 1;
  const std::size_t i = after == 0 ? 0 : after - 1, j = std::min(i + (after == 0 ? 0 : 1), last);
  const double span = playback.times[j] - playback.times[i];
  const double u = span > 0 ? (time - playback.times[i]) / span : 0.0;
  std::vector<Pose> result;
  result.reserve(n);
  for (std::size_t k = 0; k < n; ++k) {
    const Pose& a = playback.poses[i * n + k];
    const Pose& b = playback.poses[j * n + k];
    result.push_back(u > 0 ? between(a, b, std::min(u, 1.0)) : a);
  }
  return result;
}

void pose_at(render::Scene& scene, const Playback& playback, double time) {
  const auto poses = poses_at(playback, time);
  std::unordered_map<std::uint64_t, const Pose*> by_id;
  for (std::size_t i = 0; i < poses.size(); ++i) by_id[playback.ids[i]] = &poses[i];
  const auto move = [&](auto& all) {
    for (auto& one : all)
      if (const auto at = by_id.find(one.id); at != by_id.end()) one.pose = *at->second;
  };
  move(scene.items);
  move(scene.triads);
}

}  // namespace robomosp::scene
