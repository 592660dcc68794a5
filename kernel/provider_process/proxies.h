// SPDX-License-Identifier: Apache-2.0
// Proxies: objects of the SDK's interfaces with functions that run on the other side of a channel,
// and the code that serves them there. Both ends use them: the program for the plugin's objects,
// the plugin's process for objects that the program lends it (layer: core).
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
  /// Creates a proxy of a provider of the other side, as a pointer to the interface class; reads in
  /// advance what its functions return without a chance to fail.
  Result<void*> (*proxy)(std::shared_ptr<Remote>) = nullptr;
  /// Takes ownership of a provider of this side.
  std::shared_ptr<void> (*own)(void* made) = nullptr;
};

/// nullptr = its providers cannot run in a separate process; not_apart() returns the reason.
[[nodiscard]] const InterfaceWire* interface_wire(std::string_view interface_id);
[[nodiscard]] std::string not_apart(std::string_view interface_id);
/// True if not_apart() has a reason for this interface.
[[nodiscard]] bool runs_in_program_only(std::string_view interface_id);

}  // namespace robomosp::apart
