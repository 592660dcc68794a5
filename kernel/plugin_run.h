// SPDX-License-Identifier: Apache-2.0
// Where the providers of plugins run: in the program, or in a process of the plugin's own
// (layer: core).
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
  ApartLimits limits{};  ///< of a process of its own
  /// Where not in_process: only these providers run there ("numeric", "ik numeric",
  /// "robomosp.ik/1 numeric"), and the rest of the plugin in the program; empty = all.
  std::vector<std::string> only{};
  bool operator==(const PluginRun&) const = default;
};

/// A program opens a file once, so this is one for all: what the user wishes for each file, and
/// where it runs. Files are absolute, without links. [any thread]
class PluginRuns {
 public:
  using Wishes = std::map<std::filesystem::path, PluginRun>;
  [[nodiscard]] static PluginRuns& of_program();
  /// The wishes for files that are loaded from now on; the others run in the program.
  void set_wishes(Wishes);
  /// What this thread asked for, else what is wished.
  [[nodiscard]] PluginRun wished(const std::filesystem::path& file) const;

  /// The process of a file's plugin; null = it runs in the program, or is not loaded.
  [[nodiscard]] std::shared_ptr<ProviderProcess> process(const std::filesystem::path& file) const;
  /// How a file runs that is loaded; `only` in full, as in "robomosp.ik/1 numeric".
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

/// What this thread loads until the scope ends runs so, whatever is wished. A file that is loaded
/// and runs elsewhere is moved: what it made until then stays where it is. `refusal` says why it
/// was not.
class PluginRunScope {
 public:
  explicit PluginRunScope(const PluginRun& run);
  ~PluginRunScope();
  PluginRunScope(const PluginRunScope&) = delete;
  PluginRunScope& operator=(const PluginRunScope&) = delete;
  /// Of this thread; null = none.
  [[nodiscard]] static PluginRunScope* current();

  const PluginRun run;
  std::optional<Error> refusal;

 private:
  PluginRunScope* before_;
};

}  // namespace robomosp
