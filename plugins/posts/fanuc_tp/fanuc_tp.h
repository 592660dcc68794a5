// SPDX-License-Identifier: Apache-2.0
// FANUC TP programs (.LS) (layer: plugin post_fanuc_tp).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::post {

class FanucTp final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::post
