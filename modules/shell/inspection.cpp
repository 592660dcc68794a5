// SPDX-License-Identifier: Apache-2.0
#include "shell/inspection.h"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/plugin.h>

#include "kernel/plugin_loader.h"
#include "kernel/process.h"
#include "kernel/text.h"
#include "remote/json.h"
#include "shell/console.h"
#include "shell/plugin_check.h"
#include "spatial/instruction_limit.h"

namespace robomosp::shell {

int run_plugin_list(const Settings& s, const Voice& voice) {
  Program p;
  if (auto started = start(p, s, voice, "plugin"); !started.ok())
    return voice.fail(started.error());
  return evaluate(p, voice, "plugin.list()");
}

int run_plugin_check(const Voice& voice, const std::string& file) {
  const PluginCheck check = check_plugin(file);
  if (voice.json())
    voice.line(remote::to_json(Map{{"ok", check.exit_code == 0}, {"value", check.report}}));
  else if (check.exit_code == 0) voice.line(check.text);
  else std::fprintf(stderr, "error: %s\n", check.text.c_str());
  return check.exit_code;
}

int run_plugin_test(const Voice& voice, const std::string& file, const std::string& sdk,
                    const std::vector<std::string>& arguments) {
  const auto tested = test_plugin(file, sdk, arguments);
  return tested.ok() ? *tested : voice.fail(tested.error());
}

int run_commands(const Settings& s, const Voice& voice, const std::string& folder) {
  Program p;
  if (auto started = start(p, s, voice, "commands"); !started.ok())
    return voice.fail(started.error());
  if (!folder.empty()) {
    const auto written = ioci::write_reference(p.app->commands, folder,
                                               [](const Value& v) { return remote::to_json(v); });
    if (!written.ok()) return voice.fail(written.error());
    voice.result({}, "The pages were written to " + folder + ".");
    return 0;
  }
  if (voice.json()) return evaluate(p, voice, "ioci.describe()");
  std::size_t longest = 0;
  for (const ioci::CommandSpec* spec : p.app->commands.list())
    longest = std::max(longest, spec->name.size());
  for (const ioci::CommandSpec* spec : p.app->commands.list())
    voice.line(spec->name + std::string(longest + 2 - spec->name.size(), ' ') + spec->summary);
  return 0;
}

/// What the window would draw with, as the program of the window reports it; "" without one.
/// Nothing of it is missing for this program.
std::string graphics_of_window() {
  const std::filesystem::path program = executable_folder() / "robomosp-desktop";
  std::error_code none;
  if (!std::filesystem::is_regular_file(program, none)) return {};
  ProcessSpec spec;
  spec.program = program;
  spec.arguments = {"--graphics"};
  spec.seconds = 20;
  NoProgress progress;
  const auto out = run_process(spec, progress);
  return out.ok() ? *out : "  not known: " + out.error().sentence() + "\n";
}

/// What the program found and what it misses; exit code 1 when something is missing.
int run_doctor(const Settings& s, const Voice& voice) {
  Program p;
  if (auto started = start(p, s, voice, "doctor"); !started.ok())
    return voice.fail(started.error());
  List missing, folders, plugins, providers;
  std::string text = "robomosp " ROBOMOSP_VERSION "\nLua      " + lua::lua_version() +
                     "\nSDK      " RMP_SDK_VERSION ", " RMP_ABI_TAG "\n\nplugin folders\n";
  std::error_code ec;
  std::vector<std::filesystem::path> given(s.plugin_path.begin(), s.plugin_path.end());
  for (const auto& folder : PluginLoader::search_path(given)) {
    const bool exists = std::filesystem::is_directory(folder, ec);
    text += "  " + folder.string() + (exists ? "" : " (absent)") + "\n";
    folders.emplace_back(Map{{"folder", folder.string()}, {"exists", exists}});
  }
  text += "plugins\n";
  for (const PluginReport& r : p.app->plugins.reports()) {
    text += "  " + r.file.filename().string() + ": " +
            (r.refusal ? "refused: " + r.refusal->sentence() : r.id + " " + r.version) + "\n";
    plugins.emplace_back(
        Map{{"file", r.file.string()}, {"loaded", r.loaded}, {"id", r.id}, {"version", r.version}});
    if (r.refusal) missing.emplace_back("plugin " + r.file.filename().string() + " was refused");
  }
  text += "providers\n";
  for (const std::string& id : known_interfaces()) {
    std::vector<std::string> names;
    for (const ProviderInfo& info : p.app->registry.list(id)) names.push_back(info.name);
    text += "  " + id + ": " + (names.empty() ? "none" : text::join(names, ", ")) + "\n";
    List list;
    for (const std::string& n : names) list.emplace_back(n);
    providers.emplace_back(Map{{"interface", id}, {"names", std::move(list)}});
    const bool is_needed = id == CsgEngine::kInterfaceId || id == IkSolver::kInterfaceId ||
                           id == InverseDynamics::kInterfaceId ||
                           id == ForwardDynamics::kInterfaceId || id == CurveFactory::kInterfaceId;
    if (names.empty() && is_needed) missing.emplace_back("no provider of " + id);
  }
  text += "library\n";
  for (const auto& folder : p.app->library) {
    const bool exists = std::filesystem::is_directory(folder, ec);
    text += "  " + folder.string() + (exists ? "" : " (absent)") + "\n";
    if (!exists) missing.emplace_back("the library folder " + folder.string() + " does not exist");
  }
  text += "history\n  " + history_file().string() + "\n";
  const AppLock::Stats lock = p.app->lock.stats();
  const double longest = std::chrono::duration<double>(lock.longest).count();
  text += "application lock\n  held " + std::to_string(lock.holds) + " times, the longest " +
          text::print_rounded(1e3 * longest, 3) + " ms" +
          (lock.longest_by.empty() ? "" : " by " + lock.longest_by) + "; " +
          std::to_string(lock.long_holds) + " times longer than " +
          std::to_string(AppLock::kLongestHold.count()) + " ms; " +
          std::to_string(lock.calls_within) + " calls of providers and scripts within\n\n";
  const std::string graphics = graphics_of_window();
  text += "graphics\n" +
          (graphics.empty() ? "  no window: robomosp-desktop is not installed\n" : graphics) + "\n";
  if (missing.empty()) text += "Nothing is missing.";
  for (const Value& m : missing) text += "missing: " + *m.as_string() + "\n";
  const bool is_healthy = missing.empty();
  voice.result(
      Map{{"version", ROBOMOSP_VERSION},
          {"lua", lua::lua_version()},
          {"abi_tag", RMP_ABI_TAG},
          {"plugin_folders", std::move(folders)},
          {"plugins", std::move(plugins)},
          {"providers", std::move(providers)},
          {"application_lock", Map{{"holds", static_cast<std::int64_t>(lock.holds)},
                                   {"long_holds", static_cast<std::int64_t>(lock.long_holds)},
                                   {"calls_within", static_cast<std::int64_t>(lock.calls_within)},
                                   {"longest", longest}}},
          {"missing", std::move(missing)}},
      text);
  return is_healthy ? 0 : 1;
}

}  // namespace robomosp::shell
