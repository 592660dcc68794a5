// SPDX-License-Identifier: Apache-2.0
// What earlier processes left unsaved when they ended otherwise than they should.
#include "io/recovery_journal.h"
#include "ioci/core/commands.h"
#include "kernel/permit.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;

Error none_there() {
  return error(ErrorCode::not_found, "there is no unsaved work to restore",
               "recovery.list lists the work found.");
}

/// The journal that `file` names; the newest one without it.
Result<fs::path> wanted(CommandContext& ctx, const Map& args) {
  const auto found = io::found_journals(ctx.app.recovery_folder);
  if (!has(args, "file")) {
    if (found.empty()) return none_there();
    return found.back().file;
  }
  const std::string file = text_of(args, "file");
  std::vector<std::string> known;
  for (const auto& j : found) {
    if (j.file == file || j.file.filename() == file) return j.file;
    known.push_back(j.file.filename().string());
  }
  if (known.empty()) return none_there();
  return unknown_name("journal", file, known);
}

/// What other sessions left unsaved lies in no folder of this one.
Result<void> check_may_look(const CommandContext& ctx) {
  if (!ctx.session.files()) return {};
  return error(ErrorCode::permission,
               "unsaved work of earlier runs is outside the folder of this session's files",
               "Restore it in a session of the program itself.");
}

Result<Value> list_recoverable(CommandContext& ctx, const Map&) {
  RMP_TRY(require(Effect::files_read));
  RMP_TRY(check_may_look(ctx));
  List out;
  for (const auto& j : io::found_journals(ctx.app.recovery_folder))
    out.emplace_back(Map{{"file", j.file.string()},
                         {"program", j.program},
                         {"time", j.time},
                         {"records", j.records},
                         {"unread", j.unread}});
  return Value(std::move(out));
}

Result<Value> restore(CommandContext& ctx, const Map& args) {
  RMP_TRY(require(Effect::files_read));
  RMP_TRY(check_may_look(ctx));
  RMP_TRY_ASSIGN(const fs::path file, wanted(ctx, args));
  RMP_TRY_ASSIGN(auto journal, io::ClaimedJournal::claim(file));
  std::vector<std::string> notes;
  RMP_TRY_ASSIGN(auto tx, ctx.app.document.begin("recovery.restore", ctx.app.author(ctx.session)));
  RMP_TRY_ASSIGN(const auto loaded, journal.restore(tx, ctx.app.library, notes));
  RMP_TRY(tx.commit());  // a journal that could not be taken over stays on offer
  for (const std::string& note : notes)
    ctx.app.messages.post(Severity::warning, "recovery", note, "recovery");
  // Kept until the program ends as it should: by then the work is saved, or meant to be dropped.
  {
    const AppLock::Hold hold(ctx.app.lock, "recovery.restore");
    ctx.app.restored_journals.push_back(std::move(journal));
  }
  List out;
  for (const AnyId id : loaded) out.emplace_back(Application::handle(id));
  return Value(std::move(out));
}

Result<Value> discard(CommandContext& ctx, const Map& args) {
  RMP_TRY(require(Effect::files_write));
  RMP_TRY(check_may_look(ctx));
  RMP_TRY_ASSIGN(const fs::path file, wanted(ctx, args));
  RMP_TRY_ASSIGN(auto journal, io::ClaimedJournal::claim(file));
  journal.discard();
  return Value(file.string());
}

ParamSpec which_recovery() {
  return optional("file", "string", "",
                  "The journal, named as in recovery.list; the newest one if omitted.");
}

}  // namespace

RMP_COMMANDS(recovery_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "recovery.list",
       .classic = "",
       .summary = "Lists the unsaved work of earlier runs.",
       .details = "Every edit is written to a journal file, at most 5 s later. The journal remains "
                  "after a crash, a kill or a power cut, and if unsaved work was kept when a "
                  "console was left; otherwise the program removes it when it ends.",
       .example = "for _, j in ipairs(recovery.list()) do\n  assert(j.records > 0)\nend",
       .params = {},
       .returns = {"list",
                   "",
                   "Oldest first.",
                   {field("file", "string", "", "The journal."),
                    field("program", "string", "", "Program that wrote it."),
                    field("time", "string", "", "Time of the last write."),
                    field("records", "int", "", "Records that it contains."),
                    field("unread", "int", "", "Bytes at its end that were cut off.")}},
       .effect = Effect::files_read,
       .run = list_recoverable});
  all.push_back(
      {.name = "recovery.restore",
       .classic = "",
       .summary = "Loads recovered unsaved work into the document, as one step.",
       .details =
           "Records keep their files, so saving writes to the original places. A record is renamed "
           "if its name is taken. The journal stays until this program ends normally.",
       .example = "if #recovery.list() > 0 then\n  recovery.restore()\nend",
       .params = {which_recovery()},
       .returns = {"list", "", "Handles of the restored records.", {}},
       .effect = Effect::files_read | Effect::edits,
       .run = restore,
       .own_transaction = true});
  all.push_back({.name = "recovery.discard",
                 .classic = "",
                 .summary = "Deletes recovered unsaved work.",
                 .details = "It cannot be restored afterwards.",
                 .example = "local none = pcall(recovery.discard, \"no_such.journal\")\n"
                            "assert(not none)",
                 .params = {which_recovery()},
                 .returns = {"string", "", "The journal that was removed.", {}},
                 .effect = Effect::files_write,
                 .run = discard});
  return all;
}

}  // namespace robomosp::ioci
