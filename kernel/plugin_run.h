// SPDX-License-Identifier: Apache-2.0
// Selects where the providers of plugins run: in the program, or in a separate process (layer:
// core).
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/provider_process/provider_process.h"

namespace robomosp {

struct PluginRun {
  bool in_process = true;
  ApartLimits limits{};  ///< limits of a separate process
  /// If not in_process: the providers that run there ("numeric", "ik numeric", "robomosp.ik/1
  /// numeric"), while the rest of the plugin runs in the program; empty = all.
  std::vector<std::string> only{};
  bool operator==(const PluginRun&) const = default;
};

/// The settings of the user for each plugin file, and where it runs; one object per process, since
/// a program opens a file only once. Files are absolute, without links. [any thread]
class PluginRuns {
 public:
  using Wishes = std::map<std::filesystem::path, PluginRun>;
  [[nodiscard]] static PluginRuns& of_program();
  /// Settings for files loaded from now on; files without settings run in the program.
  void set_wishes(Wishes);
  /// The setting of this thread's PluginRunScope, else the user's.
  [[nodiscard]] PluginRun wished(const std::filesystem::path& file) const;

  /// The process of a file's plugin; null = it runs in the program or is not loaded.
  [[nodiscard]] std::shared_ptr<ProviderProcess> process(const std::filesystem::path& file) const;
  /// How a loaded file runs; `only` with full names, such as "robomosp.ik/1 numeric".
  [[nodiscard]] PluginRun present(const std::filesystem::path& file) const;
  [[nodiscard]] bool is_apart(const std::filesystem::path& file, std::string_view interface_id,
                              std::string_view provider) const;
  void set_process(const std::filesystem::path& file, std::shared_ptr<ProviderProcess>,
                   std::vector<std::string> only = {});

 private:
  mutable std::mutex mutex_;
  Wishes wishes_;  // guarded by mutex_
  struct Apart {
    std::shared_ptr<ProviderProcess> process;
    std::vector<std::string> only;
  };
  std::map<std::filesystem::path, Apart> processes_;  // guarded by mutex_
};

/// Sets where files loaded by this thread run until the scope ends, overriding the user's settings.
/// A loaded file that runs elsewhere is moved; objects created before stay where they are.
/// `refusal` gives the reason if it was not moved.
class PluginRunScope {
 public:
  explicit PluginRunScope(const PluginRun& run);
  ~PluginRunScope();
  PluginRunScope(const PluginRunScope&) = delete;
  PluginRunScope& operator=(const PluginRunScope&) = delete;
  /// The scope of this thread; null = none.
  [[nodiscard]] static PluginRunScope* current();

  const PluginRun run;
  std::optional<Error> refusal;

 private:
  PluginRunScope* before_;
};

}  // namespace robomosp
