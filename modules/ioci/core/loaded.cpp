// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/loaded.h"

#include "io/legacy.h"
#include "io/native.h"
#include "ioci/core/watchers.h"
#include "kernel/file_root.h"

namespace robomosp::ioci {

ParamSpec reload_field() {
  return defaulted("reload", "bool", "", false,
                   "Reread a file that is already in the document, and those it refers to that "
                   "have changed on disk; their records are updated from the files.");
}

ParamSpec overwrite_field() {
  return defaulted("overwrite", "bool", "", false,
                   "Also replace files that another program changed since they were read or saved "
                   "here.");
}

Result<io::Loaded> load_file(CommandContext& ctx, const std::filesystem::path& file,
                             io::Reload reload, std::optional<Kind> wanted) {
  RMP_TRY_ASSIGN(auto loaded, io::load(ctx.edit(), file, ctx.app.library, wanted, reload));
  for (const std::string& note : loaded.notes)
    ctx.app.messages.post(Severity::info, "file_note", note, "io");
  for (const std::string& warning : loaded.warnings)
    ctx.app.messages.post(Severity::warning, "file_changed", warning, "io");
  if (reload == io::Reload::yes && io::is_legacy_file(file))
    ctx.app.messages.post(Severity::info, "file_note",
                          text::quote(file.string()) +
                              " is a file of ROBOMOSP 1.4, which is read anew every time; what is "
                              "in the document already stays.",
                          "io");
  return loaded;
}

io::SaveOptions save_options(const Map& args, std::vector<std::filesystem::path>& replaced) {
  return {flag(args, "overwrite"), &replaced};
}

Result<void> write_named_file(CommandContext& ctx, const std::filesystem::path& file,
                              std::string_view bytes) {
  const bool replaces = file_kind(file) == FileKind::file &&
                        !ctx.app.watchers->draws(file.string()) && !io::file_holds(file, bytes);
  RMP_TRY(io::write_file(file, bytes));
  if (replaces) report_replaced(ctx, Severity::info, {file});
  return {};
}

void report_replaced(CommandContext& ctx, Severity severity,
                     const std::vector<std::filesystem::path>& replaced) {
  for (const auto& file : replaced)
    ctx.app.messages.post(
        severity, "file_replaced",
        "The file " + text::quote(file.string()) + " held something else, which was replaced.",
        "io");
}

}  // namespace robomosp::ioci
