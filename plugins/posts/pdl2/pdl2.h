// SPDX-License-Identifier: Apache-2.0
// Comau PDL2: a program with its routines (layer: plugin).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::post::pdl2 {

class Pdl2 final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::post::pdl2
