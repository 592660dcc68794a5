// SPDX-License-Identifier: Apache-2.0
// Provider "fcl" of robomosp.collision/1 (layer: plugin, collision_fcl).
#pragma once

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/host.h>

namespace robomosp::collision_fcl {

class FclEngine final : public CollisionEngine {
 public:
  explicit FclEngine(const rmp_host* host) : host_(host) {}
  Result<std::unique_ptr<CollisionScene>> build(std::span<const ShapedBody> bodies, const Params&,
                                                Progress&) const override;

 private:
  Host host_;
};

}  // namespace robomosp::collision_fcl
