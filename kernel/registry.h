// SPDX-License-Identifier: Apache-2.0
// Registry: providers by (interface id, name); built-in, plugin and Lua ones look the same
// (layer: core).
#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/result.h>

#include "kernel/app_lock.h"
#include "kernel/schema.h"

namespace robomosp {

struct ProviderInfo {
  std::string interface_id;  ///< "robomosp.ik/1"
  std::string name;
  std::string summary;
  std::vector<std::string> tags;  ///< "closed_form", "dof=6"
  std::string origin;             ///< plugin file, or "lua"
  std::string version;            ///< of the plugin
  Schema schema;
  bool enabled = true;
  bool shipped = false;    ///< part of the installation: it may be a default without being selected
  bool is_script = false;  ///< written in Lua: it runs on the thread of its script
};

/// Thread-safe; no lock is held while a provider is created. Changes need the permit of
/// Effect::providers. [any thread]
class Registry {
 public:
  /// Creates the interface object (void* to the interface class); an error is a sentence.
  using Create = std::function<Result<void*>()>;
  /// Rejects a second provider of the same interface and name unless `replace`.
  Result<void> add(ProviderInfo, Create, bool replace = false);
  bool remove(std::string_view interface_id, std::string_view name);
  Result<void> set_enabled(std::string_view interface_id, std::string_view name, bool);

  /// Finds a provider; an empty name selects the default. Order: the run's choice (set_default);
  /// the document's, which is an error while it is missing; the user's; the program's own
  /// (standard_provider); the first enabled shipped one, without the tags "approximate" and
  /// "partial" if possible. A provider that is not shipped is never a default while the program has
  /// one; if it has none, the only provider is.
  [[nodiscard]] Result<ProviderInfo> find(std::string_view interface_id,
                                          std::string_view name) const;
  /// Lists shipped providers first, so that callers that use the first suitable one prefer them.
  [[nodiscard]] std::vector<ProviderInfo> list(std::string_view interface_id = {}) const;
  /// Selects the default for this run; an empty name clears the choice.
  Result<void> set_default(std::string_view interface_id, std::string_view name);
  /// The same for all runs of the user; the document's choice takes precedence.
  Result<void> set_user_default(std::string_view interface_id, std::string_view name);
  /// Replaces the document's choices: names by interface id. A missing name is kept, so that no
  /// other provider silently replaces it.
  void set_document_defaults(std::map<std::string, std::string>);

  /// Reasons why known providers are unavailable, by interface id and name; they replace "there is
  /// no ...". Each is an error's message and hint.
  using Reasons =
      std::map<std::pair<std::string, std::string>, std::pair<std::string, std::string>>;
  void set_absent_reasons(Reasons);

  /// Creates an instance: auto ik = registry.create<IkSolver>("numeric"). If it is missing, the
  /// error names the available ones.
  template <class I>
  [[nodiscard]] Result<std::shared_ptr<I>> create(std::string_view name) const {
    auto made = create_raw(I::kInterfaceId, name);
    if (!made.ok()) return std::move(made).error();
    return std::shared_ptr<I>(static_cast<I*>(*made));
  }
  /// Incremented by every add, remove, enable and default change. Part of fingerprints.
  [[nodiscard]] std::uint64_t revision() const;
  /// As create(), but untyped: a pointer to the interface class; the caller owns it.
  [[nodiscard]] Result<void*> create_raw(std::string_view interface_id,
                                         std::string_view name) const;
  /// The effective default and its source: "session", "document" or "user".
  struct Choice {
    std::string name, by;
  };
  /// The selected defaults by interface id.
  [[nodiscard]] std::map<std::string, Choice> chosen() const;

 private:
  struct Entry {
    ProviderInfo info;
    Create create;
  };
  // Both with mutex_ held.
  [[nodiscard]] const Entry* locate(std::string_view interface_id, std::string_view name) const;
  [[nodiscard]] Error absent(std::string_view interface_id, std::string_view name) const;
  mutable std::mutex mutex_;
  std::vector<Entry> entries_;                                      // guarded by mutex_
  using Choices = std::map<std::string, std::string, std::less<>>;  ///< names by interface id
  Result<void> choose(Choices&, std::string_view interface_id, std::string_view name);
  Choices session_, document_, user_;  // guarded by mutex_
  Reasons reasons_;                    // guarded by mutex_
  std::uint64_t revision_ = 0;         // guarded by mutex_
};

/// The program's own default of an interface ("numeric"); "" = it has none.
[[nodiscard]] std::string_view standard_provider(std::string_view interface_id);

/// Calls a provider and converts any exception to ErrorCode::plugin_failed naming it.
template <class Fn>
auto guarded(std::string_view provider, Fn&& fn) -> decltype(fn()) {
  AppLock::expect_free();
  try {
    return fn();
  } catch (const std::exception& e) {
    return error(ErrorCode::plugin_failed,
                 "provider \"" + std::string(provider) + "\" threw: " + e.what(),
                 "Report it to the provider's author or choose another provider.");
  } catch (...) {
    return error(ErrorCode::plugin_failed,
                 "provider \"" + std::string(provider) + "\" threw an unknown exception",
                 "Report it to the provider's author or choose another provider.");
  }
}

}  // namespace robomosp
