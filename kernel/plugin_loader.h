// SPDX-License-Identifier: Apache-2.0
// PluginLoader: finds plugin files, checks them, and registers their providers (layer: core).
// Plugins are opened with RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE and never unloaded.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/messages.h"
#include "kernel/registry.h"

namespace robomosp {

/// What was decided about one file.
struct PluginReport {
  std::filesystem::path file;
  bool loaded = false;
  std::string id, version, license, summary;  ///< when the entry could be read
  std::vector<std::string> providers;         ///< "robomosp.ik/1 numeric"
  std::vector<std::string> remarks;           ///< providers skipped and why
  std::optional<Error> refusal;
};

class PluginLoader {
 public:
  /// `messages`, if given, hears of refusals and what plugins log while being made; it outlives the
  /// providers. Of several loaders the one made last is heard.
  explicit PluginLoader(Registry& registry, Messages* messages = nullptr);
  ~PluginLoader();
  PluginLoader(const PluginLoader&) = delete;
  PluginLoader& operator=(const PluginLoader&) = delete;
  /// Folders in order of precedence: those given, ROBOMOSP_PLUGIN_PATH, the user's
  /// ~/.local/share/robomosp/plugins, <executable>/../<libdir>/robomosp/plugins.
  [[nodiscard]] static std::vector<std::filesystem::path> search_path(
      const std::vector<std::filesystem::path>& given);

  /// A name ("my_ik") looked for in the search path, or a path to a file. The six refusals are told
  /// apart: not found (folders listed), dlopen failed, no entry, newer entry, ABI tag differs
  /// (both shown), provider unknown (skipped; the rest loads). A file already loaded is not loaded
  /// again. The reference holds until the next load. [application thread]
  const PluginReport& load(std::string_view name_or_path);
  /// Every *.so of the search path, first of a file name wins. [application thread]
  void load_all();
  void set_search_path(std::vector<std::filesystem::path> path) { path_ = std::move(path); }
  [[nodiscard]] const std::vector<PluginReport>& reports() const { return reports_; }

 private:
  const PluginReport& load_resolved(const std::filesystem::path& found);
  const PluginReport& not_found(std::string_view name,
                                const std::vector<std::filesystem::path>& looked_in);
  const PluginReport& keep(PluginReport report);
  Registry& registry_;
  Messages* messages_;
  std::vector<std::filesystem::path> path_ = search_path({});
  std::vector<PluginReport> reports_;
};

/// Interface ids this program knows ("robomosp.csg/1", ...).
[[nodiscard]] const std::vector<std::string>& known_interfaces();

/// Folder of the running executable; share folder `<executable>/../share/robomosp`.
[[nodiscard]] std::filesystem::path executable_folder();

}  // namespace robomosp
