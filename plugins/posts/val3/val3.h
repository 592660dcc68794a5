// SPDX-License-Identifier: Apache-2.0
// Staubli VAL3: an application of a project, data and a file for each program (layer: plugin).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::post::val3 {

class Val3 final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::post::val3
