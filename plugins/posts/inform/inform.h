// SPDX-License-Identifier: Apache-2.0
// INFORM jobs of Yaskawa Motoman (.JBI) (layer: plugin post_inform).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::post {

class Inform final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::post
