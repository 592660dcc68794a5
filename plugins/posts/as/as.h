// SPDX-License-Identifier: Apache-2.0
// Kawasaki AS: programs, transformations and joints in one file (layer: plugin).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::post::as {

class As final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::post::as
