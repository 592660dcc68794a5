// SPDX-License-Identifier: Apache-2.0
// G-code (RS274) (layer: plugin post_gcode).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::post {

class GCode final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::post
