// SPDX-License-Identifier: Apache-2.0
// A robot of the library with closed loops, closed with its motors at given values.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "robotics/build_model.h"
#include "robotics/closure.h"
#include "robotics/coordinates.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "spatial/rotation.h"
#include "support/workbench.h"

namespace robomosp::test {

struct ClosedMechanism {
  explicit ClosedMechanism(const std::string& name) {
    Workbench bench;
    const RobotId id{bench.load("robots/" + name + ".rbt").number};
    record = *bench.document.now()->get(id);
    model = unwrap(robotics::build_robot_model(name, record, {}, {0, 0, -9.81}));
    home = robotics::home_joint_values(record);
    links = robotics::link_joints(record);
  }
  /// Index of a link's first coordinate.
  [[nodiscard]] std::size_t q_of(const std::string& link) const {
    for (std::size_t i = 0; i < record.links.size(); ++i)
      if (record.links[i].name == link) return static_cast<std::size_t>(links[i].q);
    ADD_FAILURE() << "no link " << link;
    return 0;
  }
  /// Closed with the motors at these values, from home.
  [[nodiscard]] robotics::Closure close(
      const std::vector<std::pair<std::string, double>>& motors) const {
    std::vector<double> target = home;
    for (const auto& [link, value] : motors) target[q_of(link)] = value;
    robotics::Closure c =
        robotics::close_loops(model, home, target, robotics::actuated_velocities(model));
    EXPECT_TRUE(c.is_closed) << c.residual;
    EXPECT_EQ(c.outside, -1);
    return c;
  }
  /// Closed with its last link, a free platform, at a pose; from home.
  [[nodiscard]] robotics::Closure close_at(const std::string& platform, const Pose& pose) const {
    const spatial::Quaternion o = spatial::to_quaternion(pose.R);
    std::vector<double> target = home;
    const double numbers[7] = {pose.p[0], pose.p[1], pose.p[2], o.w, o.x, o.y, o.z};
    std::copy_n(numbers, 7, target.begin() + static_cast<std::ptrdiff_t>(q_of(platform)));
    std::vector<bool> held(model.dof(), false);
    std::fill(held.end() - 6, held.end(), true);
    robotics::Closure c = robotics::close_loops(model, home, target, held);
    EXPECT_TRUE(c.is_closed) << c.residual;
    return c;
  }
  [[nodiscard]] std::vector<Pose> frames(const std::vector<double>& q) const {
    std::vector<Pose> out(model.joints.size());
    robotics::forward_kinematics(model, q, out);
    return out;
  }
  [[nodiscard]] Pose tip(const std::vector<double>& q, std::size_t i = 0) const {
    return robotics::tip_pose(model, i, frames(q));
  }

  model::Robot record;
  RobotModel model;
  std::vector<double> home;
  std::vector<robotics::LinkJoints> links;
};

}  // namespace robomosp::test
