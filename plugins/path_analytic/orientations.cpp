// SPDX-License-Identifier: Apache-2.0
// Orientations "fixed" and "slerp" (layer: plugin).
#include "makers.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::path_analytic {
namespace {

/// Turns at a constant rate about an axis fixed in the trajectory's frame.
class Slerp final : public Orientation {
 public:
  Slerp(const spatial::Matrix3& start, const Vec3& whole) : whole_(whole) { start_.R = start; }
  void evaluate(std::span<const double> w, std::span<const CurveSample>,
                std::span<OrientationSample> out) const override {
    Pose turned;
    for (std::size_t i = 0; i < w.size(); ++i) {
      turned.R = spatial::rotation_exp(spatial::scale(whole_, w[i]));
      out[i] = {spatial::compose(turned, start_).R, whole_, {}};
    }
  }

 private:
  Pose start_;
  Vec3 whole_;  ///< rotation vector from the first to the last orientation [rad]
};

}  // namespace

Result<std::unique_ptr<Orientation>> FixedMaker::make(const OrientationTask& task,
                                                      const Params&) const {
  if (task.points.empty()) return bad("there is no point to take the orientation of", {});
  return std::unique_ptr<Orientation>(new Slerp(task.points.front().R, {}));
}

Result<std::unique_ptr<Orientation>> SlerpMaker::make(const OrientationTask& task,
                                                      const Params&) const {
  if (task.points.empty()) return bad("there is no point to take the orientation of", {});
  const Pose &first = task.points.front(), &last = task.points.back();
  Vec3 whole = spatial::rotation_difference(first.R, last.R);
  if (spatial::norm(whole) < kSameRotation) whole = {};
  return std::unique_ptr<Orientation>(new Slerp(first.R, whole));
}

}  // namespace robomosp::path_analytic
