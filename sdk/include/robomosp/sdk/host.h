// SPDX-License-Identifier: Apache-2.0
// Host: what the program offers to a provider (rmp_host), in C++ (layer: contract helper, inline
// only, not part of the ABI).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/threads.h>

namespace robomosp {

/// A provider keeps one, made from what its constructor is given:
///   class Mine final : public IkSolver {
///     explicit Mine(const rmp_host* host) : host_(host) {}
/// Functions that the program is too old for are errors, or do nothing. [any thread]
class Host {
 public:
  explicit Host(const rmp_host* host) : host_(host) {}

  enum class Severity : std::int32_t { debug = 0, info = 1, warning = 2, error = 3 };
  /// Arrives in the program's messages. `source` names the plugin.
  void log(Severity severity, const std::string& source, const std::string& text) const {
    if (host_ && RMP_HAS(host_, log) && host_->log)
      host_->log(static_cast<std::int32_t>(severity), source.c_str(), text.c_str());
  }

  /// A provider of another plugin; an empty name = the default one.
  template <class Interface>
  [[nodiscard]] Result<std::unique_ptr<Interface>> create(const std::string& name = {}) const {
    if (!host_ || !RMP_HAS(host_, create) || !host_->create)
      return error(ErrorCode::unsupported,
                   "this program gives plugins no access to other providers",
                   "Update it; the plugin is newer.");
    std::array<char, 512> why{};
    void* made = host_->create(Interface::kInterfaceId, name.c_str(), why.data(),
                               static_cast<std::uint32_t>(why.size()));
    if (!made) return error(ErrorCode::plugin_failed, why.data());
    return std::unique_ptr<Interface>(static_cast<Interface*>(made));
  }

  /// Names of all enabled providers of an interface.
  template <class Interface>
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> found;
    if (host_ && RMP_HAS(host_, list) && host_->list)
      host_->list(Interface::kInterfaceId, &found, [](void* to, const char* name, const char*) {
        static_cast<std::vector<std::string>*>(to)->emplace_back(name);
      });
    return found;
  }

  /// What a later program offers by this id, or nullptr.
  [[nodiscard]] const void* extension(const char* id) const {
    return host_ && RMP_HAS(host_, extension) && host_->extension ? host_->extension(id) : nullptr;
  }

  /// The program's threads, or nullptr.
  [[nodiscard]] const rmp_threads* threads() const {
    const auto* t = static_cast<const rmp_threads*>(extension(RMP_THREADS));
    return t && RMP_HAS(t, spread) && t->spread ? t : nullptr;
  }
  /// Threads that spread() has at most, at least 1.
  [[nodiscard]] std::size_t cores() const {
    const rmp_threads* t = threads();
    return t ? std::max<std::size_t>(1, t->cores) : 1;
  }
  /// Calls part(0) ... part(parts - 1), at most `at_once` of them at once, on threads that the
  /// whole program shares, and returns when all are done. The calling thread works too, and does
  /// all of it when the cores are taken, or when the program hands out no threads. `part` must not
  /// throw, nor wait for another part.
  template <class Part>
  void spread(std::size_t parts, std::size_t at_once, Part&& part) const {
    const rmp_threads* t = parts > 1 && at_once > 1 ? threads() : nullptr;
    if (!t) {
      for (std::size_t i = 0; i < parts; ++i) part(i);
      return;
    }
    using Called = std::remove_reference_t<Part>;
    t->spread(
        parts, at_once, [](void* context, std::size_t i) { (*static_cast<Called*>(context))(i); },
        const_cast<void*>(static_cast<const void*>(std::addressof(part))));
  }

  /// The table itself, to run a program (rmp_host::run).
  [[nodiscard]] const rmp_host* table() const { return host_; }

 private:
  const rmp_host* host_;
};

}  // namespace robomosp
