// SPDX-License-Identifier: Apache-2.0
#include "scene/tool_ellipsoids.h"

#include <algorithm>
#include <utility>

#include "model/placement.h"
#include "robotics/coordinates.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "robotics/singularity.h"
#include "robotics/tip_motion.h"
#include "scene/ids.h"
#include "spatial/pose.h"

namespace robomosp::scene {

std::vector<render::Item> tool_ellipsoids(const std::string& owner, const RobotModel& model,
                                          const Pose& world_T_base,
                                          std::span<const Pose> joint_frames,
                                          const ShownEllipsoids& shown) {
  std::vector<render::Item> out;
  if (model.dof() == 0 || model.tips.empty() || !(shown.velocity || shown.force)) return out;
  const auto motion = robotics::tip_motion(model, 0, joint_frames);
  const auto e = robotics::ellipsoid(motion.jacobian, robotics::TwistPart::translation,
                                     motion.self_motion_twists);
  Pose axes;
  axes.R = e.axes;
  Pose at = spatial::compose(world_T_base, axes);
  at.p = spatial::transform(world_T_base, robotics::tip_pose(model, 0, joint_frames).p);
  const double size = 0.2 * robotics::reach(model, 0);
  const auto add = [&](std::size_t number, const char* name, const Vec3& half, const Colour& c) {
    out.push_back(ellipsoid_item(item_id(owner, kEllipsoidBody, number), owner + " " + name, at,
                                 drawn_lengths(half, size), c));
  };
  if (shown.velocity) add(0, "velocity ellipsoid", e.velocity, {0.15F, 0.45F, 0.9F, 0.45F});
  if (shown.force) add(1, "force ellipsoid", e.force, {0.95F, 0.5F, 0.1F, 0.45F});
  return out;
}

Result<MovingEllipsoids> MovingEllipsoids::build(const Source& source, AnyId id,
                                                 const recording::Recording* recording,
                                                 Progress& progress) {
  MovingEllipsoids out;
  if (recording && !recording->columns.empty()) out.times_ = recording->columns.front().values;
  const auto add = [&](RobotId robot, const std::string& owner, const Pose& world_T_mounting,
                       const std::vector<double>& placed, bool is_main) -> Result<void> {
    const model::Robot* record = source.snapshot.get(robot);
    if (!record) return {};
    auto model = source.derived.robot_model(source.snapshot, robot, {0, 0, -9.81}, progress);
    if (!model.ok())
      return progress.cancelled() ? Result<void>(std::move(model).error()) : Result<void>{};
    Robot r{owner, *model, spatial::compose(world_T_mounting, (*model)->base), {}};
    const std::size_t n = r.model->coordinate_count();
    std::vector<const recording::Column*> columns;
    for (std::size_t k = 0; recording && k < n; ++k) {
      const std::string name = (is_main ? "" : owner + ".") + ("q" + std::to_string(k + 1));
      if (const recording::Column* c = recording->find(name)) columns.push_back(c);
    }
    if (columns.size() == n && n > 0) {
      for (std::size_t i = 0; i < out.times_.size(); ++i)
        for (const recording::Column* c : columns) r.q.push_back(c->values[i]);
    } else {
      r.q = placed.size() == n ? placed : robotics::home_joint_values(*record);
    }
    if (n > 0 && r.q.size() >= n) out.robots_.push_back(std::move(r));
    return {};
  };
  if (id.kind == Kind::robot)
    RMP_TRY(add(RobotId{id.number}, source.snapshot.find(id)->name, Pose{}, {}, true));
  const model::World* world =
      id.kind == Kind::world ? source.snapshot.get(WorldId{id.number}) : nullptr;
  if (world)
    for (const model::PlacedRobot& p : world->robots)
      RMP_TRY(add(p.robot, p.name, model::pose(p.placement), p.q,
                  recording && recording->robot == p.name));
  return out;
}

std::vector<render::Item> MovingEllipsoids::at(double time, const ShownEllipsoids& shown) const {
  std::vector<render::Item> out;
  for (const Robot& r : robots_) {
    const std::size_t n = r.model->coordinate_count(), rows = r.q.size() / n;
    std::vector<double> q(r.q.begin(), r.q.begin() + static_cast<std::ptrdiff_t>(n));
    if (rows > 1) {
      const auto after = std::upper_bound(times_.begin(), times_.end(), time);
      const auto b =
          std::min<std::size_t>(static_cast<std::size_t>(after - times_.begin()), rows - 1);
      const std::size_t a = b > 0 ? b - 1 : 0;
      const double span = times_[b] - times_[a];
      const double u = span > 0 ? std::clamp((time - times_[a]) / span, 0.0, 1.0) : 0.0;
      // Quaternions may be of any length.
      for (std::size_t k = 0; k < n; ++k) q[k] = (1 - u) * r.q[a * n + k] + u * r.q[b * n + k];
    }
    std::vector<Pose> frames(r.model->joints.size());
    robotics::forward_kinematics(*r.model, q, frames);
    for (render::Item& item : tool_ellipsoids(r.owner, *r.model, r.world_T_base, frames, shown))
      out.push_back(std::move(item));
  }
  return out;
}

}  // namespace robomosp::scene
