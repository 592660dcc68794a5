// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/kept_plugin_runs.h"

#include <cmath>
#include <cstdint>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "io/native.h"
#include "ioci/core/chosen_providers.h"
#include "kernel/text.h"

namespace robomosp::ioci {

namespace {
constexpr double kMebibyte = 1 << 20;

std::string quoted(const std::vector<std::string>& words) {
  std::ostringstream out;
  for (const std::string& word : words) out << std::quoted(word) << ' ';
  return out.str();
}

}  // namespace

std::filesystem::path kept_plugin_runs_file() {
  const std::filesystem::path beside = chosen_providers_file();
  return beside.empty() ? beside : beside.parent_path() / "plugins";
}

// One file a line: seconds, MiB, "confined" or "free", providers in quotes (none = all), and the
// rest of the line is its path.
PluginRuns::Wishes kept_plugin_runs() {
  PluginRuns::Wishes out;
  std::ifstream in(kept_plugin_runs_file());
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    double seconds = 0, memory = 0;
    std::string how, file;
    std::vector<std::string> only;
    if (!(words >> seconds >> memory >> how)) continue;
    while ((words >> std::ws).peek() == '"') words >> std::quoted(only.emplace_back());
    if (!std::getline(words, file)) continue;
    if (!(seconds > 0) || !(memory >= 1) || memory > 1e9 || (how != "confined" && how != "free"))
      continue;
    PluginRun run;
    run.in_process = false;
    run.limits = {seconds, static_cast<std::uint64_t>(memory * kMebibyte), how == "confined"};
    run.only = std::move(only);
    out[file] = run;
  }
  return out;
}

Result<void> keep_plugin_run(const std::filesystem::path& file, const PluginRun& run) {
  const std::filesystem::path settings = kept_plugin_runs_file();
  if (settings.empty())
    return error(ErrorCode::io, "there is no home folder to keep the choice in",
                 "Set HOME or XDG_CONFIG_HOME, or leave keep out.");
  if (file.string().find('\n') != std::string::npos)
    return error(ErrorCode::unsupported, "a file name with more than one line cannot be kept",
                 "Rename it.");
  auto kept = kept_plugin_runs();
  if (run.in_process) kept.erase(file);
  else kept[file] = run;
  std::string text =
      "# Plugins that run in processes of their own: plugin.load{run_in_process = false, keep = "
      "\"user\"}.\n# Seconds without an answer, MiB, confined or free, \"providers\" if not all, "
      "file.\n";
  for (const auto& [path, one] : kept)
    text += text::print(one.limits.seconds) + " " +
            text::print(static_cast<double>(one.limits.memory) / kMebibyte) + " " +
            (one.limits.confined ? "confined " : "free ") + quoted(one.only) + path.string() + "\n";
  std::error_code failed;
  std::filesystem::create_directories(settings.parent_path(), failed);  // write_file says it
  return io::write_file(settings, text);
}

}  // namespace robomosp::ioci
