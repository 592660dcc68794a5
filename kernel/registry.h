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
  bool shipped = false;    ///< it came with the program: it may be a default without being chosen
  bool is_script = false;  ///< written in Lua: it answers on the thread of its script
};

/// Thread-safe; no lock is held while a provider is created. What changes it needs the permit of
/// Effect::providers. [any thread]
class Registry {
 public:
  /// Creates the interface object (void* to the interface class); errors are sentences.
  using Create = std::function<Result<void*>()>;
  /// Refuses a second provider of the same interface and name unless `replace`.
  Result<void> add(ProviderInfo, Create, bool replace = false);
  bool remove(std::string_view interface_id, std::string_view name);
  Result<void> set_enabled(std::string_view interface_id, std::string_view name, bool);

  /// Empty name = the default: the one chosen for the run (set_default), else the document's, which
  /// is an error while it is not there, else the user's, else the program's own
  /// (standard_provider), else the first enabled one that came with the program, without the tags
  /// "approximate" and "partial" if there is one. What was only found is never a default while the
  /// program has one; where it has none, the only one there is.
  [[nodiscard]] Result<ProviderInfo> find(std::string_view interface_id,
                                          std::string_view name) const;
  /// Those that came with the program first, so that who takes the first that can do something
  /// takes none that was only found.
  [[nodiscard]] std::vector<ProviderInfo> list(std::string_view interface_id = {}) const;
  /// Chooses for this run; an empty name takes the choice back.
  Result<void> set_default(std::string_view interface_id, std::string_view name);
  /// The same for all runs of the user; weaker than the document's choice.
  Result<void> set_user_default(std::string_view interface_id, std::string_view name);
  /// What the document chooses, in place of what it chose before: names by interface id. A name
  /// that is not there is kept, so that no other provider computes in its place unseen.
  void set_document_defaults(std::map<std::string, std::string>);

  /// Why providers that somebody may ask for are not there, by interface id and name: what is said
  /// in place of "there is no ...". Each an error's message and hint.
  using Reasons =
      std::map<std::pair<std::string, std::string>, std::pair<std::string, std::string>>;
  void set_absent_reasons(Reasons);

  /// Makes an instance: auto ik = registry.create<IkSolver>("numeric"). Absence is an error that
  /// names the available ones.
  template <class I>
  [[nodiscard]] Result<std::shared_ptr<I>> create(std::string_view name) const {
    auto made = create_raw(I::kInterfaceId, name);
    if (!made.ok()) return std::move(made).error();
    return std::shared_ptr<I>(static_cast<I*>(*made));
  }
  /// Counts up with every add, remove, enable and default change. Part of fingerprints.
  [[nodiscard]] std::uint64_t revision() const;
  /// As create(), without the type: a pointer to the class of the interface, for who deletes it.
  [[nodiscard]] Result<void*> create_raw(std::string_view interface_id,
                                         std::string_view name) const;
  /// A choice of a default that holds, and who made it: "session", "document" or "user".
  struct Choice {
    std::string name, by;
  };
  /// By interface id, of those that somebody chose.
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

/// Calls into a provider and turns whatever it throws into ErrorCode::plugin_failed naming it.
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
