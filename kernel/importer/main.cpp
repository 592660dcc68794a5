// SPDX-License-Identifier: Apache-2.0
// The program robomosp-importer: reads one foreign file with one importer of one plugin, as its
// standard input asks (kernel/import_wire.h), and writes what was imported to its standard output.
// Whatever the importer does to the process, it does it here (kernel/import_process.h). With the
// word `confine` it starts another program instead, or itself, that can open certain folders only.
#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <robomosp/sdk/io.h>
#include <robomosp/sdk/plugin.h>

#include "kernel/import_wire.h"
#include "kernel/importer/confine.h"

namespace {

using namespace robomosp;

class WireParams final : public Params {
 public:
  explicit WireParams(const std::map<std::string, import_wire::Parameter>& all) : all_(all) {}
  bool has(std::string_view name) const override { return find(name) != nullptr; }
  double real(std::string_view name) const override { return has(name) ? find(name)->real : 0; }
  long long integer(std::string_view name) const override {
    return has(name) ? find(name)->integer : 0;
  }
  bool boolean(std::string_view name) const override { return has(name) && find(name)->boolean; }
  std::string_view text(std::string_view name) const override {
    return has(name) ? std::string_view(find(name)->text) : std::string_view();
  }
  std::span<const double> reals(std::string_view name) const override {
    return has(name) ? std::span<const double>(find(name)->reals) : std::span<const double>();
  }
  Pose pose(std::string_view name) const override { return has(name) ? find(name)->pose : Pose{}; }

 private:
  const import_wire::Parameter* find(std::string_view name) const {
    const auto it = all_.find(std::string(name));
    return it == all_.end() ? nullptr : &it->second;
  }
  const std::map<std::string, import_wire::Parameter>& all_;
};

std::string one_line(std::string_view text) {
  std::string out(text.substr(0, 2000));
  std::replace_if(
      out.begin(), out.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return out;
}
class LineProgress final : public Progress {
 public:
  void report(double share, std::string_view what) override {
    std::fprintf(stderr, "\x1ep %.4f %s\n", share, one_line(what).c_str());
  }
  bool cancelled() const override { return false; }  // the host ends the process
};
void log_line(std::int32_t severity, const char* source, const char* text) {
  std::fprintf(stderr, "\x1el %d %s\x1f%s\n", severity, one_line(source ? source : "").c_str(),
               one_line(text ? text : "").c_str());
}

import_wire::Answer failed(ErrorCode code, std::string message) {
  import_wire::Answer answer;
  answer.fault = error(code, std::move(message), "Report it to the importer's author.");
  return answer;
}

import_wire::Answer read(const import_wire::Request& request) {
  void* library = ::dlopen(request.plugin.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  void* symbol = library ? ::dlsym(library, "rmp_plugin_entry_v1") : nullptr;
  if (!symbol)
    return failed(ErrorCode::plugin_refused, "the plugin cannot be opened in a process of its own");
  rmp_plugin_entry_fn entry = nullptr;
  std::memcpy(&entry, &symbol, sizeof entry);
  static const rmp_host host{sizeof(rmp_host), RMP_SDK_VERSION, &log_line, nullptr,
                             nullptr,          nullptr,         nullptr};
  const rmp_plugin* plugin = entry();
  for (std::uint32_t i = 0; plugin && i < plugin->provider_count; ++i) {
    const rmp_provider& row = rmp_provider_at(*plugin, i);
    if (std::string_view(row.interface_id) != Importer::kInterfaceId ||
        request.provider != row.name)
      continue;
    char why[512] = "no reason given";
    const std::unique_ptr<Importer> importer(
        static_cast<Importer*>(row.create(&host, why, sizeof why)));
    if (!importer) return failed(ErrorCode::plugin_failed, why);
    LineProgress progress;
    auto imported = importer->read(request.path, WireParams(request.params), progress);
    import_wire::Answer answer;
    answer.is_ok = imported.ok();
    if (answer.is_ok) answer.imported = std::move(imported).value();
    else answer.fault = std::move(imported).error();
    return answer;
  }
  return failed(ErrorCode::unknown_name,
                "the plugin has no importer \"" + request.provider + "\" any more");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "confine") return run_confined(argc - 2, argv + 2);
  std::string input;
  char part[65536];
  while (const std::size_t n = std::fread(part, 1, sizeof part, stdin)) input.append(part, n);
  // What libraries print belongs to standard error: the answer is alone on standard output.
  const int answer_to = ::dup(STDOUT_FILENO);
  import_wire::Request request;
  if (answer_to < 0 || ::dup2(STDERR_FILENO, STDOUT_FILENO) < 0 ||
      !import_wire::decode(input, request)) {
    std::fputs("robomosp-importer is started by robomosp.\n", stderr);
    return 2;
  }
  std::string output;
  const std::string who = "provider \"" + request.provider + "\" threw";
  try {
    output = import_wire::encode(read(request));
  } catch (const std::exception& e) {
    output = import_wire::encode(failed(ErrorCode::plugin_failed, who + ": " + e.what()));
  } catch (...) {  // NOLINT: whatever a plugin throws
    output = import_wire::encode(failed(ErrorCode::plugin_failed, who + " an unknown exception"));
  }
  for (std::size_t done = 0; done < output.size();) {
    const ssize_t n = ::write(answer_to, output.data() + done, output.size() - done);
    if (n <= 0) return 1;
    done += static_cast<std::size_t>(n);
  }
  std::fflush(nullptr);
  ::_exit(0);  // what its static objects do at the end is of no account
}
