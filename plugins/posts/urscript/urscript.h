// SPDX-License-Identifier: Apache-2.0
// URScript of Universal Robots (layer: plugin post_urscript).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::post {

class UrScript final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::post
