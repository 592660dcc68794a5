// SPDX-License-Identifier: Apache-2.0
// Commands that make recordings again from the records as they are now, by hand or after each edit.
#include <algorithm>

#include "ioci/core/commands.h"
#include "ioci/core/origins.h"
#include "ioci/core/watchers.h"
#include "ioci/recording/recording_argument.h"
#include "kernel/file_root.h"
#include "kernel/permit.h"

namespace robomosp::ioci {
namespace {

List sentences(const std::vector<std::string>& all) {
  List out;
  for (const std::string& s : all) out.emplace_back(s);
  return out;
}

/// Why a recording cannot be made again; "" = it can.
std::string why_not(const OriginPtr& origin) {
  return origin ? origin->fixed : std::string("no command of this run made it");
}

Result<Value> is_stale(CommandContext& ctx, const Map& args) {
  (void)ctx.recording(*args.find("id")->as_handle());  // it is there
  const OriginPtr origin = ctx.app.origins->find(number_of(args));
  Map out;
  std::vector<std::string> changes;
  if (origin && origin->fixed.empty())
    changes = changes_since(ctx.app, ctx.snapshot(), origin->inputs);
  out.set("stale", !changes.empty());
  out.set("changed", sentences(changes));
  out.set("can_refresh", why_not(origin).empty());
  out.set("why_not", why_not(origin));
  out.set("command", origin ? origin->made.command : std::string());
  return Value(std::move(out));
}

Result<Value> refresh(CommandContext& ctx, const Map& args) {
  const std::uint64_t number = number_of(args);
  const auto was = ctx.recording(*args.find("id")->as_handle());
  const OriginPtr origin = ctx.app.origins->find(number);
  const std::string who = "recording#" + std::to_string(number);
  if (const std::string why = why_not(origin); !why.empty())
    return error(ErrorCode::unsupported, who + " cannot be made again: " + why,
                 "Make a new one with its command.");
  const auto changes = changes_since(ctx.app, ctx.snapshot(), origin->inputs);
  const auto answer = [&](bool made, std::size_t rows) {
    return Value(Map{{"made", made},
                     {"changed", sentences(changes)},
                     {"command", origin->made.command},
                     {"rows", rows}});
  };
  if (changes.empty() && !flag(args, "always")) return answer(false, was->rows());
  for (const auto& [name, value] : origin->made.args)
    if (const Handle* h = value.as_handle())
      for (const auto& [id, record] : origin->inputs.records)
        if (Application::handle(id) == *h && !ctx.snapshot().find(id))
          return error(ErrorCode::not_found,
                       who + " cannot be made again: " + h->kind + " " + text::quote(record->name) +
                           " is gone",
                       "Undo enables it again.");
  // Its files lie where those of the session that made it do, whoever asks now; a session that has
  // a folder of its own keeps to that.
  Permit as_made = *current_permit();
  if (!as_made.files) as_made.files = origin->files;
  const PermitScope permitted(&as_made);
  auto made = ctx.dispatch(origin->made.command, origin->made.args);
  if (!made.ok()) {
    Error e = std::move(made).error();
    if (e.code == ErrorCode::cancelled) return e;
    e.message = who + " cannot be made again: " + e.message;
    return e;
  }
  const std::uint64_t fresh = recording_in(*made);
  // Whatever happens, the second one does not stay.
  const std::unique_ptr<void, std::function<void(void*)>> gone(
      &ctx, [&](void*) { ctx.app.recordings.remove(fresh); });
  for (const RecordingOrigin::Step& step : origin->added) {
    Map step_args = step.args;
    step_args.set("id", Handle{"recording", fresh});
    auto done = ctx.dispatch(step.command, step_args);
    if (!done.ok()) return std::move(done).error().in(step.command + " of " + who);
  }
  auto is = ctx.app.recordings.find(fresh);
  if (!is) return error(ErrorCode::conflict, "the recording was removed meanwhile");
  const std::size_t rows = is->rows();
  RMP_TRY(ctx.app.recordings.replace(number, was, std::move(is)));
  ctx.app.origins->move(fresh, number);
  ctx.app.watchers->look(&ctx.session);
  return answer(true, rows);
}

Result<Value> watched(CommandContext& ctx, const Map& args) {
  if (flag(args, "wait") && !ctx.app.watchers->settle([&] { return ctx.progress.cancelled(); }))
    return error(ErrorCode::cancelled, "the wait was cancelled");
  List out;
  for (const WatchStatus& w : ctx.app.watchers->list()) {
    Map row{{"watch", w.number}, {"what", w.what}};
    if (w.recording != 0) row.set("recording", Handle{"recording", w.recording});
    row.set("file", w.file);
    row.set("state", w.state);
    row.set("fault", w.fault);
    out.emplace_back(std::move(row));
  }
  return Value(std::move(out));
}

Result<Value> unwatch(CommandContext& ctx, const Map& args) {
  const std::uint64_t recording =
      has(args, "recording") ? args.find("recording")->as_handle()->number : 0;
  std::string file = text_of(args, "file");
  if (const FileRoot* root = current_file_root(); root && !file.empty())  // as it was read then
    file = (root->folder() / file).lexically_normal().string();
  const auto number =
      has(args, "watch") ? static_cast<std::uint64_t>(integer(args, "watch")) : std::uint64_t{0};
  const std::size_t ended = ctx.app.watchers->remove([&](const WatchStatus& w) {
    return (recording == 0 || w.recording == recording) && (file.empty() || w.file == file) &&
           (number == 0 || w.number == number);
  });
  if (ended == 0 && (recording != 0 || number != 0 || !file.empty()))
    return error(ErrorCode::unknown_name, "that is not watched",
                 "recording.watched() lists the watched ones.");
  return Value(ended);
}

Result<Value> follow(CommandContext& ctx, const Map& args) {
  (void)ctx.recording(*args.find("id")->as_handle());
  RMP_TRY(ctx.app.watchers->add_recording(number_of(args)));
  ctx.app.watchers->look();
  return Value();
}

std::string with_run(const char* rest) {
  return with_arm("local run = arm:simulate{q = \"ready\", duration = 0.1}\n") + rest;
}

}  // namespace

RMP_COMMANDS(recording_refresh_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "recording.refresh",
       .classic = "",
       .summary = "Makes a recording again from the present records.",
       .details = "Runs the same command with the same arguments; columns that were added "
                  "(recording.compute, recording.watch) are added again. The handle stays valid. "
                  "If nothing it was made from has changed, nothing is done.",
       .example = with_run("assert(not run:refresh().made)\n"
                           "arm:set_payload{mass = 1}\n"
                           "assert(run:refresh().made)"),
       .params = {self("recording"),
                  defaulted("always", "bool", "", false, "Also if nothing has changed.")},
       .returns = {"map",
                   "",
                   "",
                   {field("made", "bool", "", "Whether it was made again."),
                    field("changed", "list", "", "The changes, one sentence each."),
                    field("command", "string", "", "Command that made it."),
                    field("rows", "int", "", "Number of rows it now has.")}},
       .effect = Effect::simulates,
       .sometimes = Effect::files_read | Effect::files_write | Effect::processes,
       .run = refresh});
  all.push_back(
      {.name = "recording.is_stale",
       .classic = "",
       .summary = "Reports whether the records that a recording was made from have changed.",
       .details =
           "The records named by its command are compared, with all records they refer to, the "
           "document's settings and default providers, and other recordings that it used.",
       .example = with_run("assert(not run:is_stale().stale)\n"
                           "arm:set_payload{mass = 1}\n"
                           "assert(run:is_stale().stale)"),
       .params = {self("recording")},
       .returns = {"map",
                   "",
                   "",
                   {field("stale", "bool", "",
                          "Whether making it again would give another result."),
                    field("changed", "list", "", "The changes, one sentence each."),
                    field("can_refresh", "bool", "", "Whether recording.refresh can make it."),
                    field("why_not", "string", "", "Why it cannot."),
                    field("command", "string", "", "Command that made it.")}},
       .effect = Effect::reads,
       .run = is_stale});
  all.push_back({.name = "recording.follow",
                 .classic = "",
                 .summary = "Makes a recording again after each edit from now on.",
                 .details = "The same as the argument watch of the command that makes it.",
                 .example = with_run("run:follow()\nassert(#recording.watched() == 1)"),
                 .params = {self("recording")},
                 .returns = {},
                 .effect = Effect::simulates,
                 .run = follow});
  all.push_back(
      {.name = "recording.watched",
       .classic = "",
       .summary = "Lists the recordings and files that follow edits.",
       .details = "A job updates them after each edit; unfinished work is abandoned when the next "
                  "edit comes. A failure is reported as a message and does not affect the edit.",
       .example = with_run("run:follow()\nassert(recording.watched{wait = true}[1].state == "
                           "\"current\")"),
       .params = {defaulted("wait", "bool", "", false, "Wait until they are up to date.")},
       .returns = {"list",
                   "",
                   "",
                   {field("watch", "int", "", "Its number."),
                    field("what", "string", "", "recording, or the command that draws."),
                    field("recording", "handle", "",
                          "The recording; none for a file drawn from records only."),
                    field("file", "string", "", "The file that is drawn."),
                    field("state", "string", "", "current, waiting, working or failed."),
                    field("fault", "string", "", "Error of the last attempt.")}},
       .effect = Effect::reads,
       .run = watched});
  all.push_back({.name = "recording.unwatch",
                 .classic = "",
                 .summary = "Ends the updates of recordings and files after edits.",
                 .details = "Ends all of them, or those that the arguments name.",
                 .example = with_run("run:follow()\nassert(recording.unwatch() == 1)"),
                 .params = {optional("recording", "ref:recording", "", "Those of this recording."),
                            optional("file", "string", "", "The one that draws this file."),
                            optional("watch", "int", "", "The one with this number.")},
                 .returns = {"int", "", "Number of updates ended.", {}},
                 .effect = Effect::simulates,
                 .run = unwatch});
  return all;
}

}  // namespace robomosp::ioci
