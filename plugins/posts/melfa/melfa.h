// SPDX-License-Identifier: Apache-2.0
// MELFA-BASIC IV and V of Mitsubishi (layer: plugin post_melfa).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::post {

/// Lines numbered by tens, names of 8 characters.
class Melfa4 final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};
/// Steps numbered one by one, names of 16 characters.
class Melfa5 final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::post
