// SPDX-License-Identifier: Apache-2.0
// Joint trajectories of ROS 2 (YAML and JSON) (layer: plugin post_joint_trajectory).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::post {

class JointTrajectory final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::post
