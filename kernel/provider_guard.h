// SPDX-License-Identifier: Apache-2.0
// Guards: every provider that the registry hands out stands behind one, whoever wrote it. A guard
// refuses what the provider's tags do not say that it serves, names the provider in what it throws,
// and looks at what it returns before anybody uses it (layer: core).
#pragma once

#include "kernel/registry.h"

namespace robomosp {

/// Puts a made provider behind the guard of its interface; takes it over and gives what is to be
/// used in its place, an object of the same interface. What has no guard comes back itself.
[[nodiscard]] void* guard_provider(const ProviderInfo& info, void* made);

/// What a guard says of an answer that cannot be used: `what` the provider did.
[[nodiscard]] Error broken_answer(const std::string& provider, const std::string& what);

}  // namespace robomosp
