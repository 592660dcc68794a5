// SPDX-License-Identifier: Apache-2.0
// Orientation "angles": roll, pitch and yaw change in proportion (layer: plugin).
#include <cmath>
#include <numbers>

#include "factories.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::path_analytic {
namespace {

/// What angles that are given and the orientation of their pose may differ by [rad].
constexpr double kSameAngles = 1e-6;

/// R = base Rz(yaw) Ry(pitch) Rx(roll), each angle linear in the share of the way.
class Angles final : public Orientation {
 public:
  Angles(const Pose& base, const Vec3& first, const Vec3& change)
      : base_(base), first_(first), change_(change) {}
  Result<void> evaluate(std::span<const double> w, std::span<const CurveSample>,
                        std::span<OrientationSample> out) const override {
    using namespace spatial;
    const auto& [roll, pitch, yaw] = change_;
    for (std::size_t i = 0; i < w.size(); ++i) {
      const Vec3 a = add(first_, scale(change_, w[i]));
      const double cy = std::cos(a[2]), sy = std::sin(a[2]), cp = std::cos(a[1]);
      // The axes that the three angles turn about, and what each adds to the angular velocity.
      const Vec3 by_yaw{0, 0, yaw}, by_pitch{-sy * pitch, cy * pitch, 0},
          by_roll{cy * cp * roll, sy * cp * roll, -std::sin(a[1]) * roll};
      const Vec3 turn = add(by_yaw, add(by_pitch, by_roll));
      const Vec3 bend = add(cross(by_yaw, by_pitch), cross(add(by_yaw, by_pitch), by_roll));
      Pose r;
      r.R = from_rpy(a);
      out[i] = {compose(base_, r).R, rotate(base_, turn), rotate(base_, bend)};
    }
    return {};
  }

 private:
  Pose base_;
  Vec3 first_, change_;  ///< roll, pitch, yaw [rad]
};

/// The parameter's three angles, else those of the rotation; true when they were given.
Result<bool> read_angles(const Params& params, const char* name, const spatial::Matrix3& otherwise,
                         Vec3& out) {
  const auto given = params.reals(name);
  if (given.empty()) {
    out = spatial::to_rpy(otherwise);
    return false;
  }
  if (given.size() != 3)
    return bad(std::string(name) + " has " + std::to_string(given.size()) + " numbers",
               "Give roll, pitch, yaw.");
  out = {given[0], given[1], given[2]};
  return true;
}

}  // namespace

Result<std::unique_ptr<Orientation>> AnglesFactory::make(const OrientationTask& task,
                                                         const Params& params) const {
  if (task.points.empty()) return bad("there is no point to take the orientation from", {});
  const Pose &start = task.points.front(), &end = task.points.back();
  Vec3 first, last;
  RMP_TRY_ASSIGN([[maybe_unused]] const bool has_first,
                 read_angles(params, "first", start.R, first));
  // The frame that the angles are counted in.
  Pose base, counted;
  counted.R = spatial::from_rpy(first);
  base.R = start.R;
  base = spatial::compose(base, spatial::inverse(counted));
  base.p = {};
  Pose end_in_base;
  end_in_base.R = end.R;
  end_in_base = spatial::compose(spatial::inverse(base), end_in_base);
  RMP_TRY_ASSIGN(const bool has_last, read_angles(params, "last", end_in_base.R, last));
  if (!has_last) {  // the short way of each
    for (std::size_t k = 0; k < 3; ++k)
      last[k] = first[k] + std::remainder(last[k] - first[k], 2 * std::numbers::pi);
  } else if (spatial::norm(spatial::rotation_difference(spatial::from_rpy(last), end_in_base.R)) >
             kSameAngles) {
    return bad("the angles in last are not those of the last pose",
               "Correct one of them, or leave last out.");
  }
  return std::unique_ptr<Orientation>(new Angles(base, first, spatial::sub(last, first)));
}

}  // namespace robomosp::path_analytic
