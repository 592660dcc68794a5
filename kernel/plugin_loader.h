// SPDX-License-Identifier: Apache-2.0
// PluginLoader: finds plugin files, checks them, and registers their providers (layer: core).
// Plugins are opened with RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE and never unloaded.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/messages.h"
#include "kernel/plugin_trial.h"
#include "kernel/registry.h"

namespace robomosp {

/// The outcome of loading one file.
struct PluginReport {
  std::filesystem::path file;
  bool loaded = false;
  bool shipped = false;                       ///< part of the program's installation
  std::string id, version, license, summary;  ///< when the entry could be read
  std::vector<std::string> providers;         ///< "robomosp.ik/1 numeric"
  std::vector<std::string> remarks;           ///< skipped providers, with reasons
  std::optional<Error> refusal;
};

class PluginLoader {
 public:
  /// `messages`, if given, receives refusals and the logs of plugins being created; it must outlive
  /// the providers. Of several loaders, the one created last receives logs.
  explicit PluginLoader(Registry& registry, Messages* messages = nullptr);
  ~PluginLoader();
  PluginLoader(const PluginLoader&) = delete;
  PluginLoader& operator=(const PluginLoader&) = delete;
  /// Folders in order of precedence: the given ones, ROBOMOSP_PLUGIN_PATH, the program's own
  /// <executable>/../<libdir>/robomosp/plugins, the user's ~/.local/share/robomosp/plugins and
  /// ~/.local/lib/robomosp/plugins.
  [[nodiscard]] static std::vector<std::filesystem::path> search_path(
      const std::vector<std::filesystem::path>& given);

  /// Loads a name ("my_ik") found in the search path, or a path to a file. There are six refusals:
  /// not found (folders listed), dlopen failed, no entry, newer entry, ABI tag differs (both
  /// shown), provider unknown (skipped; the rest loads). A file that is already loaded is not
  /// loaded again. The reference is valid until the next load. [application thread]
  const PluginReport& load(std::string_view name_or_path);
  /// Loads every *.so of the search path; of equal file names the first. [application thread]
  void load_all();
  /// From now on, files that are not shipped with the program are tried in a separate process
  /// before they are opened here, and files that ended a process are recorded in this folder
  /// (PluginTrials).
  void remember_failures(const std::filesystem::path& state = PluginTrials::state_folder());
  void set_trial_seconds(double seconds) { trial_seconds_ = seconds; }
  /// Checks whether a file can be opened without ending the process; an error gives the failure.
  [[nodiscard]] Result<void> try_out(const std::filesystem::path& file);
  void set_search_path(std::vector<std::filesystem::path> path) { path_ = std::move(path); }
  [[nodiscard]] const std::vector<PluginReport>& reports() const { return reports_; }
  /// Adds a later finding, one sentence, to the report of a file, and posts it.
  void remark(const std::filesystem::path& file, const std::string& sentence);

 private:
  const PluginReport& load_resolved(const std::filesystem::path& found, bool is_asked);
  [[nodiscard]] Result<void> admit(const std::filesystem::path& file, bool is_asked);
  const PluginReport& not_found(std::string_view name,
                                const std::vector<std::filesystem::path>& looked_in);
  const PluginReport& keep(PluginReport report);
  Registry& registry_;
  Messages* messages_;
  const Registry* before_ = nullptr;  ///< the registry that providers used before this loader was
                                      ///< created
  std::vector<std::filesystem::path> path_ = search_path({});
  std::vector<PluginReport> reports_;
  double trial_seconds_ = 10;
  std::unique_ptr<PluginTrials> trials_;
};

/// Interface ids this program knows ("robomosp.csg/1", ...).
[[nodiscard]] const std::vector<std::string>& known_interfaces();

/// Folder of the running executable; share folder `<executable>/../share/robomosp`.
[[nodiscard]] std::filesystem::path executable_folder();

}  // namespace robomosp
