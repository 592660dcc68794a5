// SPDX-License-Identifier: Apache-2.0
// Post of the KUKA Robot Language: a .src with all routines and a .dat with data and points
// (layer: data processing, plugin posts).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::posts {

class Krl final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::posts
