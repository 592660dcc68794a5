// SPDX-License-Identifier: Apache-2.0
// Modules: additions of plugins to the program through robomosp.module/1: commands in the table,
// settings in the document, hooks around runs (layer: application, ioci only).
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <shared_mutex>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/module.h>

#include "ioci/core/command.h"
#include "kernel/permit.h"
#include "kernel/registry.h"

namespace robomosp::ioci {

/// A loaded module; lives as long as the application.
struct LoadedModule {
  std::string name, origin, version, summary;
  std::shared_ptr<const Module> module;
  Schema settings;
  std::uint32_t runs = 0;
};

/// [any thread]
class Modules {
 public:
  explicit Modules(Application& app) : app_(app) {}
  /// Creates the new modules of the registry and adds their commands to the table. Unusable parts
  /// are remarks in the report of the plugin's file. Returns the names of the new modules. [holds
  /// Application::plugins_mutex, or before anything runs]
  std::vector<std::string> adopt();
  /// nullptr = not loaded. The pointer stays valid.
  [[nodiscard]] const LoadedModule* find(std::string_view name) const;
  [[nodiscard]] std::vector<const LoadedModule*> list() const;
  /// True if any module subscribes to this ModuleRun.
  [[nodiscard]] bool watches(std::uint32_t kind) const {
    return (watched_.load(std::memory_order_relaxed) & kind) != 0;
  }
  /// Warns about settings in a commit that belong to a plugin that is not loaded.
  void tell_absent(const document::Commit&);

 private:
  Application& app_;
  mutable std::shared_mutex mutex_;
  std::vector<std::unique_ptr<const LoadedModule>> all_;  // guarded by mutex_
  std::vector<std::string> failed_;                       // guarded by mutex_: not tried again
  std::atomic<std::uint32_t> watched_{0};
  std::atomic<std::uint64_t> runs_{0};
  friend class ModuleRunScope;
};

/// The commands of a module as entries of the table; reasons for commands that cannot be added are
/// in `faults`. `module` must outlive them.
[[nodiscard]] std::vector<CommandSpec> commands_of(const LoadedModule& module,
                                                   std::vector<std::string>& faults);
/// Reads the tables of a new module. An error = it cannot be used at all.
[[nodiscard]] Result<LoadedModule> read_module(const ProviderInfo& info,
                                               std::shared_ptr<const Module> module);
/// Findings of `robomosp plugin check`: everything that would be left out of a table with these
/// commands.
[[nodiscard]] std::vector<std::string> module_faults(const Registry& registry,
                                                     const ProviderInfo& info,
                                                     const CommandTable& commands);

/// Hooks around one run, on the thread that runs it.
class ModuleRunScope {
 public:
  ModuleRunScope(Modules& modules, CommandContext& ctx, const CommandSpec& spec, const Map& args,
                 std::uint32_t kind, bool is_job);
  /// Calls the modules; the first that refuses ends the run.
  Result<void> begin();
  /// Calls the end hooks, of modules with a called begin hook only.
  void end(const Result<Value>& result);

 private:
  template <class Call>
  void with(const LoadedModule& m, const std::string& work, Call&& call);
  Modules& modules_;
  CommandContext& ctx_;
  const CommandSpec& spec_;
  ModuleValue args_;
  ModuleRunNotice notice_;
  std::vector<const LoadedModule*> asked_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
};

// --- values --------------------------------------------------------------------------------

[[nodiscard]] ModuleValue to_module(const Value& value);
/// An error for a value that a module may not return: an unknown type, numbers that do not fill
/// their matrix, nesting deeper than 64.
[[nodiscard]] Result<Value> from_module(const ModuleValue& value);
/// "" or the reason why a value is not such a result: "it is a string, not a real".
[[nodiscard]] std::string result_fault(const ReturnSpec& spec, const Value& value);

// --- settings ------------------------------------------------------------------------------

/// The kind of records that hold settings of plugins; registered with the first call.
[[nodiscard]] Kind settings_kind();
/// A setting as the records have it, or its default.
[[nodiscard]] Result<Value> setting_of(const document::Snapshot& snapshot, const LoadedModule& m,
                                       std::string_view name);

}  // namespace robomosp::ioci
