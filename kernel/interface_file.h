// SPDX-License-Identifier: Apache-2.0
// InterfaceFile: each interface is registered by a separate source file in kernel/interfaces; there
// is no list of interfaces elsewhere (layer: core).
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernel/registry.h"

namespace robomosp {

struct InterfaceEntry {
  std::string id;        ///< "robomosp.ik/1"
  std::string standard;  ///< the program's default provider; "" = none
  /// Wraps a created provider in a guard, which owns it from then on; null = it is used without
  /// one.
  void* (*guard)(const ProviderInfo& info, void* made) = nullptr;
  /// Destroys a provider that is not used.
  void (*end)(void* made) = nullptr;
};

/// For an interface with providers that are checked by their callers.
template <class Interface>
[[nodiscard]] InterfaceEntry plain_interface(std::string standard = {}) {
  return {Interface::kInterfaceId, std::move(standard), nullptr,
          [](void* made) { delete static_cast<Interface*>(made); }};
}
/// `Guard` is constructed from the provider's info and the provider; it rejects requests that the
/// tags do not cover, names the provider in its exceptions, and checks its results.
template <class Interface, class Guard>
[[nodiscard]] InterfaceEntry guarded_interface(std::string standard = {}) {
  InterfaceEntry entry = plain_interface<Interface>(std::move(standard));
  entry.guard = [](const ProviderInfo& info, void* made) -> void* {
    return static_cast<Interface*>(new Guard(info, static_cast<Interface*>(made)));
  };
  return entry;
}

/// Registers the interfaces of one source file at program start; defined by RMP_INTERFACES.
class InterfaceFile {
 public:
  /// Aborts if an id exists already, which is a defect.
  InterfaceFile(const char* file, const std::vector<InterfaceEntry>& entries);
  /// nullptr = unknown id.
  [[nodiscard]] static const InterfaceEntry* find(std::string_view id);
  /// Sorted by id.
  [[nodiscard]] static std::vector<const InterfaceEntry*> all();
  [[nodiscard]] static const std::vector<std::string>& files();
};

}  // namespace robomosp

/// RMP_INTERFACES(wind, plain_interface<Wind>("breeze")), at the end of a file.
#define RMP_INTERFACES(name, ...) \
  static const ::robomosp::InterfaceFile name##_interfaces(__FILE__, {__VA_ARGS__})
