// SPDX-License-Identifier: Apache-2.0
// Proxies: objects of the SDK's interfaces whose functions run on the other side of a channel, and
// how the other side serves them. Both ends use them: the program for what a plugin makes, the
// plugin's process for what the program lends it (layer: core).
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "kernel/provider_process/calls.h"

namespace robomosp::apart {

struct InterfaceWire {
  std::string_view id;  ///< "robomosp.ik/1"
  Serve serve = nullptr;
  /// A proxy of a provider of the other side, as a pointer to the class of the interface; asks the
  /// other side for what is asked of it without a chance to fail.
  Result<void*> (*proxy)(std::shared_ptr<Remote>) = nullptr;
  /// Owns a provider of this side.
  std::shared_ptr<void> (*own)(void* made) = nullptr;
};

/// nullptr = its providers cannot be in a process of their own; not_apart() says why.
[[nodiscard]] const InterfaceWire* interface_wire(std::string_view interface_id);
[[nodiscard]] std::string not_apart(std::string_view interface_id);

}  // namespace robomosp::apart
