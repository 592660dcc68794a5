// SPDX-License-Identifier: Apache-2.0
// Posts of C: a program in C99 that drives a robot through a small header of motions, implemented
// by the client of ROBOMOSP (c) or the library of the Mitsubishi PA-10 (pa10) (layer: data
// processing, plugin posts).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::posts {

class C99 final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

class Pa10 final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::posts
