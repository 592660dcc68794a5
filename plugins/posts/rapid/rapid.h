// SPDX-License-Identifier: Apache-2.0
// Post of ABB RAPID: one module with its data, points and routines (layer: data processing, plugin
// posts).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::posts {

class Rapid final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::posts
