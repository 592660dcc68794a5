// SPDX-License-Identifier: Apache-2.0
// The history of edits: steps of sessions, undo and redo, gestures; and the sessions themselves.
#include "ioci/core/commands.h"
#include "ioci/core/surroundings.h"

namespace robomosp::ioci {
namespace {

Value commit_value(const CommandContext& ctx, const document::Commit& commit) {
  List changed;
  const auto now = ctx.app.document.now();
  for (const AnyId id : commit.changed)
    if (now->find(id)) changed.emplace_back(Application::handle(id));
  return Map{{"label", commit.label},
             {"revision", static_cast<std::int64_t>(commit.revision)},
             {"changed", std::move(changed)}};
}

std::uint64_t number(const Map& args, std::string_view name) {
  return has(args, name) ? static_cast<std::uint64_t>(integer(args, name)) : 0;
}

std::uint64_t own_session(CommandContext& ctx) { return ctx.app.author(ctx.session).session; }

/// Whose steps are meant: the caller's, or those of a session that has ended when one of them is
/// named by its number.
std::optional<std::uint64_t> whose(CommandContext& ctx, std::uint64_t step) {
  const std::uint64_t mine = own_session(ctx);
  if (step == 0) return mine;
  const auto sessions = ctx.app.sessions();
  for (const document::HistoryEntry& e : ctx.app.document.history()) {
    if (e.number != step) continue;
    const std::uint64_t by = e.author.session;
    const bool is_open = std::any_of(sessions.begin(), sessions.end(),
                                     [by](const auto& s) { return s.number == by && s.is_open; });
    if (!is_open) return std::nullopt;
  }
  return mine;
}

Result<Value> undo(CommandContext& ctx, const Map& args) {
  const std::uint64_t step = number(args, "step");
  RMP_TRY_ASSIGN(const auto commit, ctx.app.document.undo(whose(ctx, step), step));
  return commit_value(ctx, commit);
}

Result<Value> redo(CommandContext& ctx, const Map& args) {
  const std::uint64_t step = number(args, "step");
  RMP_TRY_ASSIGN(const auto commit, ctx.app.document.redo(whose(ctx, step), step));
  return commit_value(ctx, commit);
}

Value text_list(const std::vector<std::string>& all) {
  List out;
  for (const auto& s : all) out.emplace_back(s);
  return out;
}

Result<Value> history(CommandContext& ctx, const Map& args) {
  const document::Document& document = ctx.app.document;
  const std::uint64_t me = own_session(ctx);
  const auto entries = document.history();
  const auto most = static_cast<std::size_t>(integer(args, "at_most"));
  List steps;
  for (std::size_t i = entries.size() - std::min(most, entries.size()); i < entries.size(); ++i) {
    const document::HistoryEntry& e = entries[i];
    List changed;
    for (const AnyId id : e.changed)
      if (ctx.snapshot().find(id)) changed.emplace_back(Application::handle(id));
    steps.emplace_back(Map{{"step", static_cast<std::int64_t>(e.number)},
                           {"session", e.author.name},
                           {"session_number", static_cast<std::int64_t>(e.author.session)},
                           {"mine", e.author.session == me},
                           {"label", e.label},
                           {"undone", e.undone},
                           {"changed", std::move(changed)}});
  }
  return Value(Map{{"undo", text_list(document.undo_labels(me))},
                   {"redo", text_list(document.redo_labels(me))},
                   {"steps", std::move(steps)},
                   {"forgotten", static_cast<std::int64_t>(document.forgotten_steps())},
                   {"bytes", document.history_bytes()},
                   {"memory", document.history_budget()},
                   {"revision", static_cast<std::int64_t>(ctx.app.document.now()->revision())}});
}

Result<Value> history_memory(CommandContext& ctx, const Map& args) {
  if (has(args, "bytes")) {
    RMP_TRY(ctx.app.document.set_history_budget(static_cast<std::size_t>(integer(args, "bytes"))));
    tell_setting(ctx.app, ctx.session, "history_memory", ctx.app.document.history_budget());
  }
  return Value(ctx.app.document.history_budget());
}

Result<Value> begin_gesture(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(
      const std::uint64_t made,
      ctx.app.document.begin_gesture(text_of(args, "label"), ctx.app.author(ctx.session)));
  return Value(static_cast<std::int64_t>(made));
}

/// A gesture of the caller's own.
Result<std::uint64_t> own_gesture(CommandContext& ctx, const Map& args) {
  const std::uint64_t wanted = number(args, "gesture");
  for (const auto& [open, who] : ctx.app.document.gestures())
    if (open == wanted && who.session == own_session(ctx)) return wanted;
  return error(ErrorCode::unknown_name,
               "there is no open gesture " + std::to_string(wanted) + " of session " +
                   text::quote(ctx.session.name()),
               "Open one with gesture.begin.");
}

Result<Value> update_gesture(CommandContext& ctx, const Map& args) {
  const Value* given = args.find("arguments");
  const Map none;
  return ctx.app.update_gesture(ctx.session, number(args, "gesture"), text_of(args, "command"),
                                given && given->as_map() ? *given->as_map() : none);
}

Result<Value> start_in_gesture(CommandContext& ctx, const Map& args) {
  const Value* given = args.find("arguments");
  RMP_TRY_ASSIGN(Handle job,
                 ctx.app.dispatch_async(ctx.session, text_of(args, "command"),
                                        given && given->as_map() ? *given->as_map() : Map{},
                                        {.gesture = number(args, "gesture"), .draft = 0}));
  return Value(std::move(job));
}

Result<Value> commit_gesture(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const std::uint64_t gesture, own_gesture(ctx, args));
  RMP_TRY(ctx.app.document.commit_gesture(gesture));
  return Value();
}

Result<Value> cancel_gesture(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const std::uint64_t gesture, own_gesture(ctx, args));
  RMP_TRY(ctx.app.document.cancel_gesture(gesture));
  return Value();
}

Result<Value> list_sessions(CommandContext& ctx, const Map&) {
  const std::uint64_t me = own_session(ctx);
  List out;
  for (const Application::SessionInfo& s : ctx.app.sessions())
    out.emplace_back(Map{{"number", static_cast<std::int64_t>(s.number)},
                         {"name", s.name},
                         {"kind", to_string(s.kind)},
                         {"mine", s.number == me},
                         {"open", s.is_open}});
  return Value(std::move(out));
}

const std::vector<ParamSpec> kCommitFields{
    field("label", "string", "", "The step that was undone or redone."),
    field("revision", "int", "", "Revision of the document after it."),
    field("changed", "list", "", "Handles of the changed records that still exist.")};

ParamSpec step_param() {
  return between(optional("step", "int", "",
                          "Number of the step in document.history: one of this session or of a "
                          "session that has ended; by default the newest one of this session."),
                 1, 9e15);
}

ParamSpec gesture_param() {
  return between(needed("gesture", "int", "", "Number returned by gesture.begin."), 1, 9e15);
}

}  // namespace

RMP_COMMANDS(history_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "document.undo",
       .classic = "",
       .summary = "Undoes the last step of this session.",
       .details = "Every editing command is one step, and so is a transaction group or a gesture. "
                  "Steps of other sessions are not affected. A step can be undone as long as the "
                  "records it changed are still as it left them; otherwise the error names who "
                  "changed what. Records loaded from the library stay as well.",
       .example = "local bolt = material.create{name = \"bolt steel\", density = "
                  "7850}\ndocument.undo()\nassert(#material.list() == 0)",
       .params = {step_param()},
       .returns = {"map", "", "", kCommitFields},
       .effect = Effect::edits,
       .run = undo,
       .own_transaction = true});
  all.push_back({.name = "document.redo",
                 .classic = "",
                 .summary = "Redoes the last undone step of this session.",
                 .details = "A new step of this session clears its list of steps to redo.",
                 .example =
                     "material.create{name = \"brass\", density = "
                     "8500}\ndocument.undo()\ndocument.redo()\nassert(#material.list() == 1)",
                 .params = {step_param()},
                 .returns = {"map", "", "", kCommitFields},
                 .effect = Effect::edits,
                 .run = redo,
                 .own_transaction = true});
  all.push_back(
      {.name = "document.history",
       .classic = "",
       .summary = "Lists the steps with their sessions, and which can be undone and redone.",
       .details = "The memory of the history is limited (document.history_memory); the oldest "
                  "steps are dropped first.",
       .example =
           "material.create{name = \"brass\", density = 8500}\nlocal h = document.history()\n"
           "assert(h.undo[1] == \"material.create\")\n"
           "assert(h.steps[#h.steps].label == \"material.create\" and h.steps[#h.steps].mine)",
       .params = {between(
           defaulted("at_most", "int", "", 1000, "Number of the newest steps to list."), 1, 1e9)},
       .returns =
           {"map",
            "",
            "",
            {field("undo", "list", "", "Labels of this session's steps, the next to undo first."),
             field("redo", "list", "", "Labels of this session's steps, the next to redo first."),
             field("steps", "list", "",
                   "Of all sessions, oldest first: step (its number), session, "
                   "session_number, mine, label, undone, changed (handles)."),
             field("forgotten", "int", "", "Steps dropped to stay within the memory limit."),
             field("bytes", "int", "", "Approximate memory used by the history."),
             field("memory", "int", "", "Memory limit."),
             field("revision", "int", "", "Incremented by every change.")}},
       .effect = Effect::reads,
       .run = history});
  all.push_back(
      {.name = "document.history_memory",
       .classic = "",
       .summary = "Reports or sets the memory limit of the history.",
       .details = "The oldest steps beyond the limit are dropped; the newest one is always kept.",
       .example = "document.history_memory(document.history_memory())",
       .params = {between(optional("bytes", "int", "", "The new limit, in bytes."), 0, 9e15)},
       .returns = {"int", "", "The limit, in bytes.", {}},
       .effect = Effect::reads,
       .sometimes = Effect::edits,
       .run = history_memory,
       .own_transaction = true});
  all.push_back(
      {.name = "gesture.begin",
       .classic = "",
       .summary = "Begins a gesture: updates that everybody sees at once and that become one step.",
       .details = "For dragging and sliders. Until the gesture is committed or cancelled, its "
                  "updates do not enter the history (nor clear the steps to redo), and other "
                  "sessions cannot change the same records. A session has one gesture at a time; "
                  "it is cancelled when the session ends.",
       .example =
           "material.create{name = \"brass\", density = 8500}\n"
           "local g = gesture.begin(\"density\")\n"
           "for d = 8501, 8510 do\n  gesture.update{gesture = g, command = \"material.set\", "
           "arguments = {id = \"brass\", density = d}}\nend\n"
           "gesture.commit(g)\nassert(#document.history().undo == 2)",
       .params = {needed("label", "string", "", "Label of its step.")},
       .returns = {"int", "", "Its number.", {}},
       .effect = Effect::edits,
       .run = begin_gesture,
       .own_transaction = true});
  all.push_back(
      {.name = "gesture.update",
       .classic = "",
       .summary = "Runs a command as an update of a gesture.",
       .details =
           "Edits are published at once, as a preview. Commands that edit nothing run as usual.",
       .example = "material.create{name = \"brass\", density = 8500}\n"
                  "local g = gesture.begin(\"density\")\n"
                  "gesture.update{gesture = g, command = \"material.set\", arguments = {id = "
                  "\"brass\", density = 8600}}\n"
                  "assert(material.describe(\"brass\").density == 8600)\ngesture.cancel(g)",
       .params = {gesture_param(), needed("command", "string", "", "Name of the command."),
                  optional("arguments", "map", "", "Its arguments, by name.")},
       .returns = {"any", "", "The result of the command.", {}},
       .effect = Effect::edits,
       .run = update_gesture,
       .own_transaction = true});
  all.push_back(
      {.name = "gesture.start",
       .classic = "",
       .summary = "Starts a command as a job; its edits join a gesture.",
       .details = "What it edits is published when it ends, as a preview. When the gesture has "
                  "ended by then, the job fails and nothing of it stays.",
       .example = "material.create{name = \"brass\", density = 8500}\n"
                  "local g = gesture.begin(\"density\")\n"
                  "gesture.start{gesture = g, command = \"material.set\", arguments = {id = "
                  "\"brass\", density = 8600}}:wait()\n"
                  "gesture.cancel(g)\nassert(material.describe(\"brass\").density == 8500)",
       .params = {gesture_param(), needed("command", "string", "", "Name of the command."),
                  optional("arguments", "map", "", "Its arguments by name.")},
       .returns = {"handle", "", "The job.", {}},
       .effect = Effect::edits,
       .run = start_in_gesture,
       .own_transaction = true});
  all.push_back({.name = "gesture.commit",
                 .classic = "",
                 .summary = "Ends a gesture as one step.",
                 .details = "A gesture that changed nothing leaves no step.",
                 .example = "local g = gesture.begin(\"drag\")\ngesture.commit(g)\n"
                            "assert(#document.history().undo == 0)",
                 .params = {gesture_param()},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = commit_gesture,
                 .own_transaction = true});
  all.push_back({.name = "gesture.cancel",
                 .classic = "",
                 .summary = "Ends a gesture and reverts all its changes.",
                 .details = "Undo and redo are the same as before it began.",
                 .example =
                     "material.create{name = \"brass\", density = 8500}\n"
                     "local g = gesture.begin(\"density\")\n"
                     "gesture.update{gesture = g, command = \"material.set\", arguments = {id = "
                     "\"brass\", density = 8600}}\n"
                     "gesture.cancel(g)\nassert(material.describe(\"brass\").density == 8500)",
                 .params = {gesture_param()},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = cancel_gesture,
                 .own_transaction = true});
  all.push_back(
      {.name = "session.list",
       .classic = "",
       .summary = "Lists the sessions: consoles, scripts, connections and windows.",
       .details = "Each has its own undo. Ended sessions are listed as well, since their steps are "
                  "still in the history.",
       .example = "local s = session.list()\nassert(s[#s].mine and s[#s].open)",
       .params = {},
       .returns = {"list",
                   "",
                   "",
                   {field("number", "int", "", "Incremented for each session, never reused."),
                    field("name", "string", "", "Its name."),
                    field("kind", "string", "", "console, script, connection or window."),
                    field("mine", "bool", "", "True for the calling session."),
                    field("open", "bool", "", "Whether it is still open.")}},
       .effect = Effect::reads,
       .run = list_sessions});
  return all;
}

}  // namespace robomosp::ioci
