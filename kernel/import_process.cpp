// SPDX-License-Identifier: Apache-2.0
#include "kernel/import_process.h"

#include <charconv>
#include <string_view>
#include <utility>

#include "kernel/confined_process.h"
#include "kernel/file_root.h"
#include "kernel/import_wire.h"
#include "kernel/permit.h"
#include "kernel/process.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

constexpr double kSeconds = 600;
constexpr std::uint64_t kMemory = std::uint64_t{8} << 30;  // [bytes]

class InProcess final : public Importer {
 public:
  InProcess(std::unique_ptr<Importer> own, ImportProcess who)
      : own_(std::move(own)), who_(std::move(who)) {}
  [[nodiscard]] const void* extension(const char* id) const override { return own_->extension(id); }
  [[nodiscard]] std::string_view extensions() const override { return own_->extensions(); }

  Result<Imported> read(std::string_view path, const Params& params,
                        Progress& progress) const override {
    if (who_.only_confined && !current_file_root()) return own_->read(path, params, progress);
    import_wire::Request request{who_.plugin, who_.provider, std::string(path), {}};
    for (const std::string& name : who_.params) {
      if (!params.has(name)) continue;
      const auto reals = params.reals(name);
      request.params[name] = {params.real(name),
                              params.integer(name),
                              static_cast<std::uint8_t>(params.boolean(name)),
                              std::string(params.text(name)),
                              {reals.begin(), reals.end()},
                              params.pose(name)};
    }
    const std::string input = import_wire::encode(std::move(request));
    ProcessSpec spec;
    spec.program = helper_program("robomosp-importer");
    spec.input = input;
    spec.seconds = kSeconds;
    spec.memory = kMemory;
    spec.most_output = std::uint64_t{4} << 30;
    spec.line = [&](std::string_view line) { hear(line, progress); };
    const Permit* permit = current_permit();
    if (permit && permit->denied.has(Effect::processes)) RMP_TRY(require(Effect::processes));
    const std::filesystem::path plugin = who_.plugin;
    RMP_TRY_ASSIGN(const auto confined, ProcessConfinement::apply(spec, {plugin.parent_path()}));
    const PermitScope own(nullptr);  // the table cannot say which provider a file comes to
    auto output = run_process(spec, progress);
    const std::string who =
        "importer " + text::quote(who_.provider) + ", file " + text::quote(path);
    if (!output.ok()) {
      Error fault = std::move(output).error();
      if (fault.code == ErrorCode::cancelled) return fault;
      return error(ErrorCode::plugin_failed, "the process that read it failed: " + fault.message,
                   "Report it to the importer's author, with the file.", who);
    }
    import_wire::Answer answer;
    if (!import_wire::decode(*output, answer))
      return error(ErrorCode::plugin_failed, "the process exited without a reply",
                   "Report it to the importer's author, with the file.", who);
    if (!answer.is_ok) return std::move(answer.fault);
    return std::move(answer.imported);
  }

 private:
  /// A line of standard error: "\x1ep SHARE WHAT" is progress, "\x1el SEVERITY SOURCE\x1fTEXT" what
  /// it logs, another one what its libraries print.
  void hear(std::string_view line, Progress& progress) const {
    const auto number = [&](auto& value) {
      const auto read = std::from_chars(line.data(), line.data() + line.size(), value);
      line.remove_prefix(static_cast<std::size_t>(read.ptr - line.data()));
      if (!line.empty()) line.remove_prefix(1);
      return read.ec == std::errc();
    };
    if (line.starts_with("\x1ep ")) {
      line.remove_prefix(3);
      double share = 0;
      if (number(share)) progress.report(share, line);
    } else if (line.starts_with("\x1el ")) {
      line.remove_prefix(3);
      std::int32_t severity = 0;
      const bool is_number = number(severity);
      const std::size_t end = line.find('\x1f');
      if (!is_number || end == std::string_view::npos || !who_.log) return;
      who_.log(severity, std::string(line.substr(0, end)).c_str(),
               std::string(line.substr(end + 1)).c_str());
    } else if (who_.log && !line.empty()) {
      who_.log(0, who_.provider.c_str(), std::string(line).c_str());
    }
  }

  std::unique_ptr<Importer> own_;
  ImportProcess who_;
};

}  // namespace

std::unique_ptr<Importer> importer_in_process(std::unique_ptr<Importer> own, ImportProcess who) {
  return std::make_unique<InProcess>(std::move(own), std::move(who));
}

}  // namespace robomosp
