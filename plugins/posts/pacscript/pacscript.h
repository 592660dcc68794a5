// SPDX-License-Identifier: Apache-2.0
// Denso PacScript: a file of Sub Main and its procedures (layer: plugin).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::post::pacscript {

class PacScript final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::post::pacscript
