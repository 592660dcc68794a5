// SPDX-License-Identifier: Apache-2.0
#include "shell/plugin_check.h"

#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>

#include <robomosp/sdk/module.h>

#include "ioci/core/application.h"
#include "ioci/core/modules.h"
#include "kernel/interface_file.h"
#include "kernel/plugin_loader.h"
#include "kernel/process.h"
#include "kernel/registry.h"
#include "kernel/text.h"
#include "remote/json.h"

namespace robomosp::shell {
using remote::error_map;
using remote::from_json;
using remote::to_json;

namespace {

constexpr double kSeconds = 30;  // for loading the file and making every provider

/// Makes one instance of a provider; "" or what went wrong.
std::string create_fault(const Registry& registry, const ProviderInfo& p) {
  const auto made = registry.create_raw(p.interface_id, p.name);
  if (!made.ok()) return made.error().sentence();
  if (const InterfaceEntry* entry = InterfaceFile::find(p.interface_id); entry && entry->end)
    entry->end(*made);
  return "";
}

Map inspect(const std::string& file) {
  Registry registry;
  PluginLoader loader(registry);
  loader.set_search_path(PluginLoader::search_path({}));
  const PluginReport& r = loader.load(file);
  List providers, remarks;
  for (const ProviderInfo& p : registry.list()) {
    Map one{{"interface", p.interface_id}, {"name", p.name}, {"summary", p.summary}};
    if (std::string fault = create_fault(registry, p); !fault.empty())
      one.set("fault", std::move(fault));
    providers.emplace_back(std::move(one));
  }
  for (const std::string& remark : r.remarks) remarks.emplace_back(remark);
  // Of a module that can be made, what of its commands would be left out.
  ioci::CommandTable commands;
  if (!registry.list(Module::kInterfaceId).empty()) ioci::register_commands(commands);
  for (const ProviderInfo& p : registry.list(Module::kInterfaceId))
    if (create_fault(registry, p).empty())
      for (const std::string& fault : ioci::module_faults(registry, p, commands))
        remarks.emplace_back(fault);
  Map out{{"file", r.file.string()},
          {"loaded", r.loaded},
          {"id", r.id},
          {"version", r.version},
          {"license", r.license},
          {"summary", r.summary},
          {"providers", std::move(providers)},
          {"remarks", std::move(remarks)}};
  if (r.refusal) out.set("error", error_map(*r.refusal));
  return out;
}

std::string text_of(const Map& m, const char* key) {
  const Value* v = m.find(key);
  return v && v->as_string() ? *v->as_string() : std::string();
}

/// All that the child writes until it ends, or nullopt after kSeconds.
std::optional<std::string> read_all(int fd) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(kSeconds));
  std::string out;
  char chunk[4096];
  for (;;) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left <= 0) return std::nullopt;
    pollfd ready{fd, POLLIN, 0};
    const int n = ::poll(&ready, 1, static_cast<int>(left));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return out;
    if (n == 0) return std::nullopt;
    const ssize_t got = ::read(fd, chunk, sizeof chunk);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return out;
    out.append(chunk, static_cast<std::size_t>(got));
  }
}

PluginCheck broken(const std::string& file, std::string what) {
  const Error e =
      error(ErrorCode::plugin_refused, std::move(what),
            "Do not install it; report it to its author.", "plugin " + text::quote(file));
  return {3, e.sentence(), Map{{"file", file}, {"loaded", false}, {"error", error_map(e)}}};
}

PluginCheck summary(Map report) {
  PluginCheck out;
  const Value* fault = report.find("error");
  if (fault && fault->as_map()) {
    Error e;
    e.message = text_of(*fault->as_map(), "message");
    e.where = text_of(*fault->as_map(), "where");
    e.hint = text_of(*fault->as_map(), "hint");
    out.text = e.sentence();
    out.exit_code = 3;
  } else {
    const Value* providers = report.find("providers");
    const bool has_any = providers && providers->as_list() && !providers->as_list()->empty();
    out.text = text_of(report, "id") + " " + text_of(report, "version") + " (" +
               text_of(report, "license") +
               "): " + (has_any ? "accepted" : "accepted, but none of its providers can be used");
    if (!has_any) out.exit_code = 3;
    if (has_any)
      for (const Value& p : *providers->as_list()) {
        const Map& m = *p.as_map();
        out.text += "\n  " + text_of(m, "interface") + " " + text_of(m, "name") + ": ";
        const std::string bad = text_of(m, "fault");
        out.text += bad.empty() ? text_of(m, "summary") : "cannot be made. " + bad;
        if (!bad.empty()) out.exit_code = 3;
      }
  }
  if (const Value* remarks = report.find("remarks"); remarks && remarks->as_list())
    for (const Value& r : *remarks->as_list())
      out.text += "\n  " + (r.as_string() ? *r.as_string() : std::string());
  out.report = std::move(report);
  return out;
}

}  // namespace

PluginCheck check_plugin(const std::string& file) {
  int ends[2];
  if (::pipe(ends) != 0)
    return broken(file, std::string("the check could not start: ") + std::strerror(errno));
  const pid_t child = ::fork();
  if (child < 0)
    return broken(file, std::string("the check could not start: ") + std::strerror(errno));
  if (child == 0) {
    ::setpgid(0, 0);  // so that what the plugin starts is stopped with it
    ::close(ends[0]);
    const std::string text = to_json(inspect(file));
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t n = ::write(ends[1], text.data() + done, text.size() - done);
      if (n <= 0) break;
      done += static_cast<std::size_t>(n);
    }
    ::_exit(0);
  }
  ::close(ends[1]);
  const auto said = read_all(ends[0]);
  ::close(ends[0]);
  // A child that said all and still runs is of no more use, nor is one that says nothing.
  siginfo_t ended{};
  const bool is_over =
      ::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
      ended.si_pid != 0;
  if (!said) ::kill(-child, SIGKILL);
  if (!said && !is_over) ::kill(child, SIGKILL);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!said)
    return broken(file, "it was not done within " + text::print_rounded(kSeconds) +
                            " s of being loaded and making its providers, and was stopped");
  const std::string& text = *said;
  if (WIFSIGNALED(status))
    return broken(file, std::string("it ended the check with signal ") +
                            std::to_string(WTERMSIG(status)) + " (" +
                            ::strsignal(WTERMSIG(status)) + ")");
  auto report = from_json(text);
  if (!report.ok() || !report->as_map())
    return broken(file, "it ended the process that checked it");
  return summary(std::move(*report->as_map()));
}

namespace {

namespace fs = std::filesystem;

/// Where the suites are built, once for each version of the SDK's prefix.
Result<fs::path> suites_folder(const fs::path& sdk) {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  if (cache && *cache == '/') folder = cache;
  else if (home && *home) folder = fs::path(home) / ".cache";
  else
    return error(ErrorCode::io, "there is no home folder to build the suites in",
                 "Set HOME or XDG_CACHE_HOME.");
  std::string name = sdk.string();
  std::replace(name.begin(), name.end(), '/', '_');
  return folder / "robomosp" / "suites" / (RMP_SDK_VERSION + name);
}

Result<void> run_cmake(const std::vector<std::string>& words, const char* doing) {
  ProcessSpec spec;
  spec.program = program_on_path("cmake");
  if (spec.program.empty())
    return error(ErrorCode::unsupported, "the suites are built with CMake, which is not installed",
                 "Install cmake, a C++ compiler and GoogleTest.");
  spec.arguments = words;
  spec.seconds = 3600;
  spec.memory = std::uint64_t{256} << 30;
  std::string last;
  spec.line = [&](std::string_view line) { last = last.empty() ? std::string(line) : last; };
  NoProgress none;
  auto done = run_process(spec, none);
  if (done.ok()) return {};
  return error(ErrorCode::plugin_failed,
               std::string(doing) + " the suites failed: " + done.error().message +
                   (last.empty() ? "" : ", beginning with: " + last),
               "A C++ compiler and GoogleTest are needed.");
}

/// The program with the suites: as it was installed, or built where it is not there yet.
Result<fs::path> suites_program(const fs::path& sdk) {
  std::error_code none;
  const fs::path installed = sdk / "libexec" / "robomosp" / "robomosp-plugin-suites";
  if (fs::is_regular_file(installed, none)) return installed;
  const fs::path source = sdk / "share" / "robomosp" / "suites";
  std::error_code failed;
  if (!fs::is_directory(source, failed))
    return error(ErrorCode::not_found,
                 "there is no SDK with suites in " + text::quote(sdk.string()),
                 "Install the SDK beside this program, or name its prefix with --sdk.");
  RMP_TRY_ASSIGN(const fs::path folder, suites_folder(sdk));
  const fs::path program = folder / "robomosp-plugin-suites";
  if (!fs::is_regular_file(program, failed))
    std::fputs("Building the suites of the SDK; this takes some minutes, once.\n", stderr);
  const std::vector<std::string> configure{"-S", source.string(), "-B", folder.string(),
                                           "-DCMAKE_PREFIX_PATH=" + sdk.string()};
  RMP_TRY(run_cmake(configure, "configuring"));
  RMP_TRY(run_cmake({"--build", folder.string()}, "building"));
  return program;
}

}  // namespace

Result<int> test_plugin(const std::string& file, const std::string& sdk,
                        const std::vector<std::string>& arguments) {
  std::error_code failed;
  const fs::path full = fs::absolute(file, failed);
  if (failed || !fs::is_regular_file(full, failed))
    return error(ErrorCode::not_found, "there is no plugin file " + text::quote(file),
                 "Check the path.");
  const PluginCheck check = check_plugin(full.string());
  if (check.exit_code != 0) return error(ErrorCode::plugin_refused, check.text);
  RMP_TRY_ASSIGN(
      const fs::path program,
      suites_program(sdk.empty() ? executable_folder().parent_path() : fs::absolute(sdk, failed)));
  std::vector<std::string> words{program.string(), full.string()};
  // What controllers ask, forward dynamics are compared with and posts are judged by, unless the
  // caller names another.
  const fs::path prefix = executable_folder().parent_path();
  const fs::path plugins = prefix / "lib" / "robomosp" / "plugins";
  for (const auto& [option, own] :
       {std::pair("--dynamics", plugins / "dynamics_newton_euler.so"),
        {"--language", plugins / "irl.so"},
        {"--constructs", prefix / "share" / "robomosp" / "post_test" / "constructs.txt"}})
    if (fs::is_regular_file(own, failed)) words.insert(words.end(), {option, own.string()});
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& w : words) argv.push_back(w.data());
  argv.push_back(nullptr);
  std::fflush(nullptr);
  ::execv(argv[0], argv.data());
  return error(ErrorCode::io, "the suites cannot be started: " + std::string(std::strerror(errno)),
               "Remove " + text::quote(program.parent_path().string()) + " and try again.");
}

}  // namespace robomosp::shell
