// SPDX-License-Identifier: Apache-2.0
// Random configurations that are the same on every platform (layer: application, collision).
// Internal to modules/collision.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::collision {

/// SplitMix64 (Steele, Lea, Flood 2014): the same numbers on every platform.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double uniform(double low, double high) {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    z ^= z >> 31;
    return low + (high - low) * (static_cast<double>(z >> 11) * 0x1.0p-53);
  }
  void quaternion(double* q) {
    double length = 0;
    do {
      length = 0;
      for (int k = 0; k < 4; ++k) q[k] = uniform(-1, 1), length += q[k] * q[k];
    } while (length > 1 || length < 0.01);
    for (int k = 0; k < 4; ++k) q[k] /= std::sqrt(length);
  }

 private:
  std::uint64_t state_;
};

/// Uniform within the limits; within one turn or one metre about the middle for unlimited joints.
inline void random_configuration(const RobotModel& model, Random& random, double* q) {
  for (const JointModel& j : model.joints) {
    if (j.is_coupled()) continue;
    double* own = q + j.q_index;
    if (coordinate_count(j.type) == 1) {
      const double half = j.type == JointType::revolute ? std::numbers::pi : 0.5;
      const bool has_low = std::isfinite(j.lower), has_high = std::isfinite(j.upper);
      const double low = has_low ? j.lower : has_high ? j.upper - 2 * half : -half;
      const double high = has_high ? j.upper : low + 2 * half;
      *own = random.uniform(low, high);
      continue;
    }
    if (j.type == JointType::free) {
      for (int k = 0; k < 3; ++k) own[k] = random.uniform(-0.5, 0.5);
      own += 3;
    }
    random.quaternion(own);
  }
}

}  // namespace robomosp::collision
