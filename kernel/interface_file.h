// SPDX-License-Identifier: Apache-2.0
// InterfaceFile: what the program knows of an interface is registered by a file of its own
// (kernel/interfaces), and nothing else lists interfaces (layer: core).
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernel/registry.h"

namespace robomosp {

struct InterfaceEntry {
  std::string id;        ///< "robomosp.ik/1"
  std::string standard;  ///< the program's own default provider; "" = it has none
  /// Puts a made provider behind a guard, which it belongs to then; null = it is used as it is.
  void* (*guard)(const ProviderInfo& info, void* made) = nullptr;
  /// Ends a provider that is not used.
  void (*end)(void* made) = nullptr;
};

/// Of an interface whose providers are checked where they are used.
template <class Interface>
[[nodiscard]] InterfaceEntry plain_interface(std::string standard = {}) {
  return {Interface::kInterfaceId, std::move(standard), nullptr,
          [](void* made) { delete static_cast<Interface*>(made); }};
}
/// `Guard` is made from the provider's info and the provider; it refuses what the tags do not
/// claim, names the provider in what it throws, and looks at what it returns.
template <class Interface, class Guard>
[[nodiscard]] InterfaceEntry guarded_interface(std::string standard = {}) {
  InterfaceEntry entry = plain_interface<Interface>(std::move(standard));
  entry.guard = [](const ProviderInfo& info, void* made) -> void* {
    return static_cast<Interface*>(new Guard(info, static_cast<Interface*>(made)));
  };
  return entry;
}

/// Registers the interfaces of one source file when the program starts: RMP_INTERFACES makes one.
class InterfaceFile {
 public:
  /// An id that is there already is a defect: it aborts.
  InterfaceFile(const char* file, const std::vector<InterfaceEntry>& entries);
  /// nullptr = unknown here.
  [[nodiscard]] static const InterfaceEntry* find(std::string_view id);
  /// By id.
  [[nodiscard]] static std::vector<const InterfaceEntry*> all();
  [[nodiscard]] static const std::vector<std::string>& files();
};

}  // namespace robomosp

/// RMP_INTERFACES(wind, plain_interface<Wind>("breeze")), at the end of a file.
#define RMP_INTERFACES(name, ...) \
  static const ::robomosp::InterfaceFile name##_interfaces(__FILE__, {__VA_ARGS__})
