// SPDX-License-Identifier: Apache-2.0
// Subscriptions of front ends: event.subscribe, event.take, event.unsubscribe.
#include "ioci/core/commands.h"
#include "ioci/core/room_parts.h"
#include "ioci/core/surroundings.h"
#include "kernel/fault.h"

namespace robomosp::ioci {
namespace {

std::uint32_t kind_bit(Kind kind) { return std::uint32_t{1} << static_cast<unsigned>(kind); }

template <class Words>
std::vector<std::string> event_words(const Words& all) {
  std::vector<std::string> out;
  for (const auto each : all) out.emplace_back(to_string(each));
  return out;
}

Result<Value> subscribe(CommandContext& ctx, const Map& args) {
  EventFilter f;
  if (const Value* topics = args.find("topics"); topics && topics->as_list()) {
    f.topics = 0;
    for (const Value& word : *topics->as_list()) {
      const std::string name = word.as_string() ? *word.as_string() : word.text();
      const auto at = std::find_if(std::begin(kAllTopics), std::end(kAllTopics),
                                   [&name](Topic t) { return to_string(t) == name; });
      if (at == std::end(kAllTopics))
        return unknown_name("topic", name, event_words(kAllTopics)).in("topics");
      f.topics |= bit(*at);
    }
  }
  if (const Value* kinds = args.find("kinds"); kinds && kinds->as_list()) {
    f.kinds = 0;
    for (const Value& word : *kinds->as_list()) {
      const std::string name = word.as_string() ? *word.as_string() : word.text();
      const auto kind = kind_from(name);
      if (!kind) return unknown_name("kind", name, event_words(all_kinds())).in("kinds");
      f.kinds |= kind_bit(*kind);
    }
  }
  if (const Value* records = args.find("records"); records && records->as_list())
    for (const Value& record : *records->as_list()) {
      auto handle = ctx.app.resolve(ctx.snapshot(), "any", record);
      if (!handle.ok()) return std::move(handle).error().in("records");
      RMP_TRY_ASSIGN(const AnyId id, Application::record_id(ctx.snapshot(), *handle));
      f.records.push_back(id);
    }
  const std::uint64_t session = ctx.app.author(ctx.session).session;
  if (!flag(args, "own")) f.not_of = session;
  f.previews = flag(args, "previews");
  f.severity = severity_from(text_of(args, "severity")).value_or(f.severity);
  f.most = static_cast<std::size_t>(integer(args, "most"));
  f.rate = real(args, "rate");
  f.reads = flag(args, "reads");
  const std::uint32_t wanted = f.topics;
  ctx.app.kept<Surroundings>().prepare(wanted);
  const std::uint64_t token = ctx.app.events.subscribe(std::move(f));
  ctx.app.keep_subscription(ctx.session, token);
  in_rooms(&RoomPart::subscribed, ctx.app);
  ctx.app.kept<Surroundings>().begin(wanted);
  return Value(static_cast<std::int64_t>(token));
}

Result<std::uint64_t> own_subscription(CommandContext& ctx, const Map& args) {
  const auto token = static_cast<std::uint64_t>(integer(args, "subscription"));
  if (ctx.app.has_subscription(ctx.session, token)) return token;
  return error(ErrorCode::unknown_name,
               "there is no subscription " + std::to_string(token) + " of session " +
                   text::quote(ctx.session.name()),
               "Create one with event.subscribe.");
}

Result<Value> take(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const std::uint64_t token, own_subscription(ctx, args));
  RMP_TRY_ASSIGN(const auto events,
                 ctx.app.events.take(token, static_cast<std::size_t>(integer(args, "at_most"))));
  List out;
  for (const Event& e : events) out.emplace_back(event_value(e));
  return Value(std::move(out));
}

Result<Value> unsubscribe(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const std::uint64_t token, own_subscription(ctx, args));
  ctx.app.end_subscription(ctx.session, token);
  return Value();
}

ParamSpec which_subscription() {
  return between(needed("subscription", "int", "", "Number returned by event.subscribe."), 1, 9e15);
}

}  // namespace

RMP_COMMANDS(event_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "event.subscribe",
       .classic = "",
       .summary = "Subscribes to events: changes of the document, messages, jobs, runs, "
                  "recordings, commands, providers, sessions, settings, drafts.",
       .details = "Events are queued until event.take fetches them, in order and each once. If too "
                  "many are queued, changes are merged into one event, which gives the number of "
                  "merged commits, and the oldest messages are dropped, which the next event "
                  "reports. Of the rows appended to a recording only the newest event is queued. A "
                  "subscription ends with its session. A command is reported when it ends, as a "
                  "line of Lua that runs it again, without arguments named as tokens, passwords or "
                  "secrets.",
       .example = "local s = event.subscribe{topics = {\"change\"}, kinds = {\"material\"}}\n"
                  "material.create{name = \"brass\", density = 8500}\n"
                  "material.set{id = \"brass\", density = 8600}\n"
                  "local all = event.take(s)\n"
                  "assert(#all == 2 and #all[1].added == 1 and #all[2].edited == 1)",
       .params =
           {optional("topics", "list", "",
                     "Some of change, message, job, run, recording, command, provider, session, "
                     "unsaved, setting, memory, draft; all if omitted."),
            optional("kinds", "list", "", "Kinds of records to report changes of; all if omitted."),
            optional("records", "list", "",
                     "Only changes of these records and of those they depend on."),
            defaulted("own", "bool", "", true,
                      "Include changes made by this session and commands that it calls."),
            defaulted("previews", "bool", "", true, "Include the updates of gestures."),
            defaulted("reads", "bool", "", false, "With commands that only read."),
            choice("severity", {"info", "debug", "warning", "error"},
                   "Least severity of the messages to report."),
            between(defaulted("most", "int", "", 256, "Greatest number of queued events."), 2, 1e6),
            between(defaulted("rate", "real", "1/s", kUsualRate,
                              "Greatest rate of events about the state of a playing run; a "
                              "queued one is replaced by the next."),
                    1e-3, kHighestRate)},
       .returns = {"int", "", "The subscription.", {}},
       .effect = Effect::reads,
       .run = subscribe});
  all.push_back(
      {.name = "event.take",
       .classic = "",
       .summary = "Fetches the queued events of a subscription.",
       .details = "",
       .example = "local s = event.subscribe{}\nmaterial.create{name = \"brass\", density = 8500}\n"
                  "assert(event.take(s)[1].kind == \"edit\" and #event.take(s) <= 1)",
       .params = {which_subscription(), between(defaulted("at_most", "int", "", 1000,
                                                          "Greatest number of events to fetch."),
                                                1, 1e6)},
       .returns =
           {"list",
            "",
            "Oldest first.",
            {field("topic", "string", "", "Subject, as in event.subscribe."),
             field("revision", "int", "", "Of a change: revision of the document after it."),
             field("first_revision", "int", "", "Revision of the first commit merged into it."),
             field("commits", "int", "", "Number of commits merged into it; 1 unless merged."),
             field("kind", "string", "",
                   "Of the last commit: edit, load, save, undo, redo, preview, kept (a gesture "
                   "became a step), cancelled, clear. Of a recording: added, appended, replaced "
                   "(rows and columns may differ), removed."),
             field("label", "string", "", "Label of the last commit, or of a job."),
             field("session", "string", "",
                   "Session that made the last commit, called the command, started the job, opened "
                   "the draft or changed the setting."),
             field("session_number", "int", "", "Its number."),
             field("added", "list", "", "Handles."),
             field("removed", "list", "", "Removed records: tables with id and name."),
             field("edited", "list", "",
                   "Edited records: tables with id and the fields that differ."),
             field("left_out", "int", "", "Number of events other than changes dropped before it."),
             field("command", "string", "", "Name of a command."),
             field("line", "string", "", "The call as Lua."),
             field("whole", "bool", "",
                   "false if the line cannot be run, because secrets or overlong values are left "
                   "out of it."),
             field("seconds", "real", "s", "Duration of the command."),
             field("only_reads", "bool", "", "Whether the command changes nothing."),
             field("outcome", "string", "", "done, failed (with code and text) or cancelled."),
             field("job", "handle", "", "Job that the command ran in, if any."),
             field("gesture", "int", "", "Gesture that the command or job was a part of, if any."),
             field("draft", "int", "",
                   "Draft that the command or job was a part of, if any; of a draft, its number."),
             field("what", "string", "",
                   "Of a provider: registered, withdrawn, replaced, enabled, disabled, "
                   "default (with interface, name and who chose it, by). Of a session: "
                   "opened, closed. Of unsaved: changed (with count, and handles in "
                   "unsaved and saved). Of a setting: program or document (with name and "
                   "value). Of memory: fine, low, critical (with bytes available, total, "
                   "used). Of a draft: opened, edited, accepted, discarded (with handles "
                   "in changed)."),

             field("severity", "string", "",
                   "Severity of a message, which also has code, text, source and repeated."),
             field("id", "handle", "", "The job, run or recording."),
             field("title", "string", "", "Title of a recording."),
             field("rows", "int", "", "Number of rows of a recording."),
             field("state", "any", "",
                   "Of a job: its state, with fraction and what; of a run: the result of "
                   "run.state.")}},
       .effect = Effect::reads,
       .run = take});
  all.push_back({.name = "event.unsubscribe",
                 .classic = "",
                 .summary = "Ends a subscription.",
                 .details = "",
                 .example = "local s = event.subscribe{}\nevent.unsubscribe(s)\n"
                            "assert(not pcall(event.take, s))",
                 .params = {which_subscription()},
                 .returns = {},
                 .effect = Effect::reads,
                 .run = unsubscribe});
  return all;
}

}  // namespace robomosp::ioci
