// SPDX-License-Identifier: Apache-2.0
// Command set of the Movemaster RV-M1 (layer: plugin post_movemaster).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::post {

class Movemaster final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::post
