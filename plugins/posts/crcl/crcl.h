// SPDX-License-Identifier: Apache-2.0
// CRCL, the Canonical Robot Command Language of NIST: commands in XML, one behind the other, by the
// schema of 2019 (layer: plugin).
#pragma once

#include <robomosp/sdk/post.h>

namespace robomosp::post::crcl {

class Crcl final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override;
  Result<void> write(const PostTask&, const Params&, PostOutput&, Progress&) const override;
};

}  // namespace robomosp::post::crcl
