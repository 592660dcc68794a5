// SPDX-License-Identifier: Apache-2.0
#include "ioci/commands.h"
#include "kernel/check.h"

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

Result<Value> undo(CommandContext& ctx, const Map&) {
  RMP_TRY_ASSIGN(const auto commit, ctx.app.document.undo());
  return commit_value(ctx, commit);
}

Result<Value> redo(CommandContext& ctx, const Map&) {
  RMP_TRY_ASSIGN(const auto commit, ctx.app.document.redo());
  return commit_value(ctx, commit);
}

Value words(const std::vector<std::string>& all) {
  List out;
  for (const auto& s : all) out.emplace_back(s);
  return out;
}

Result<Value> history(CommandContext& ctx, const Map&) {
  return Value(Map{{"undo", words(ctx.app.document.undo_labels())},
                   {"redo", words(ctx.app.document.redo_labels())},
                   {"revision", static_cast<std::int64_t>(ctx.snapshot().revision())}});
}

Result<Value> list(CommandContext& ctx, const Map& args) {
  List out;
  const std::string wanted = text_of(args, "kind");
  for (const AnyId id : ctx.snapshot().list())
    if (wanted == "all" || wanted == to_string(id.kind)) out.emplace_back(Application::handle(id));
  return Value(std::move(out));
}

Result<Value> referrers(CommandContext& ctx, const Map& args) {
  List out;
  for (const AnyId id : ctx.snapshot().referrers(ref(args, "record")))
    out.emplace_back(Application::handle(id));
  return Value(std::move(out));
}

Result<Value> clear(CommandContext& ctx, const Map&) {
  ctx.app.document.clear();
  return Value();
}

Result<Value> digest(CommandContext& ctx, const Map&) {
  return Value(ctx.app.document.content_digest());
}

Result<Value> cache_stats(CommandContext& ctx, const Map&) {
  const auto s = ctx.app.derived.stats();
  return Value(Map{{"hits", static_cast<std::int64_t>(s.hits)},
                   {"misses", static_cast<std::int64_t>(s.misses)},
                   {"entries", s.entries},
                   {"bytes", s.bytes}});
}

Result<Value> cache_clear(CommandContext& ctx, const Map&) {
  ctx.app.derived.clear();
  return Value();
}

Result<Value> cache_enable(CommandContext& ctx, const Map& args) {
  ctx.app.derived.set_enabled(flag(args, "on"));
  return Value();
}

Result<Value> job_list(CommandContext& ctx, const Map&) {
  List out;
  for (const JobStatus& s : ctx.app.jobs.list())
    out.emplace_back(Map{{"id", Handle{"job", s.id}},
                         {"label", s.label},
                         {"state", to_string(s.state)},
                         {"fraction", s.fraction},
                         {"what", s.what}});
  return Value(std::move(out));
}

Result<Value> job_cancel(CommandContext& ctx, const Map& args) {
  const Value* id = args.find("id");
  return Value(ctx.app.jobs.cancel(id->as_handle()->number));
}

Result<Value> message_list(CommandContext& ctx, const Map& args) {
  List out;
  const std::string least = text_of(args, "severity");
  const auto rank = [](std::string_view s) {
    return s == "error" ? 3 : s == "warning" ? 2 : s == "info" ? 1 : 0;
  };
  for (const Message& m :
       ctx.app.messages.recent(static_cast<std::size_t>(integer(args, "at_most"))))
    if (rank(to_string(m.severity)) >= rank(least))
      out.emplace_back(Map{{"severity", to_string(m.severity)},
                           {"code", m.code},
                           {"text", m.text},
                           {"source", m.source},
                           {"repeated", static_cast<std::int64_t>(m.repeated)}});
  return Value(std::move(out));
}

const std::vector<ParamSpec> kCommitFields{
    field("label", "string", "", "The step that was taken back or made again."),
    field("revision", "int", "", "Revision of the document now."),
    field("changed", "list", "", "Handles of the records that changed and still exist.")};

}  // namespace

std::vector<CommandSpec> document_commands() {
  std::vector<CommandSpec> all;
  all.push_back({.name = "document.undo",
                 .classic = "",
                 .summary = "Takes back the last step.",
                 .details = "Every command that edits is one step, and so is a transaction group.",
                 .example = "local bolt = material.create{name = \"bolt steel\", density = "
                            "7850}\ndocument.undo()\nassert(#material.list() == 0)",
                 .params = {},
                 .returns = {"map", "", "", kCommitFields},
                 .effect = Effect::edits,
                 .run = undo,
                 .own_transaction = true});
  all.push_back(
      {.name = "document.redo",
       .classic = "",
       .summary = "Makes the last step that was taken back again.",
       .details = "",
       .example = "material.create{name = \"brass\", density = "
                  "8500}\ndocument.undo()\ndocument.redo()\nassert(#material.list() == 1)",
       .params = {},
       .returns = {"map", "", "", kCommitFields},
       .effect = Effect::edits,
       .run = redo,
       .own_transaction = true});
  all.push_back(
      {.name = "document.history",
       .classic = "",
       .summary = "Lists the steps that can be taken back and made again.",
       .details = "",
       .example = "material.create{name = \"brass\", density = "
                  "8500}\nassert(document.history().undo[1] == \"material.create\")",
       .params = {},
       .returns = {"map",
                   "",
                   "",
                   {field("undo", "list", "", "Labels, the next step to take back first."),
                    field("redo", "list", "", "Labels, the next step to make again first."),
                    field("revision", "int", "", "Counts up with every change.")}},
       .effect = Effect::reads,
       .run = history});
  all.push_back(
      {.name = "document.list",
       .classic = "",
       .summary = "Lists all records, in order of creation.",
       .details = "",
       .example =
           "material.create{name = \"brass\", density = 8500}\nassert(#document.list() == 1)",
       .params = {choice("kind",
                         {"all", "material", "solid", "object", "robot", "trajectory", "world"},
                         "Only records of this kind.")},
       .returns = {"list", "", "Handles.", {}},
       .effect = Effect::reads,
       .run = list});
  all.push_back({.name = "document.referrers",
                 .classic = "",
                 .summary = "Lists the records that refer to a record.",
                 .details = "A record that others refer to cannot be removed.",
                 .example = "local brass = material.create{name = \"brass\", density = "
                            "8500}\nsolid.create{name = \"pin\", material = \"brass\", root = "
                            "{kind = \"cylinder\", radius = 0.01, height = 0.05}}\n"
                            "assert(#document.referrers(brass) == 1)",
                 .params = {needed("record", "ref:material|solid|object|robot|trajectory|world", "",
                                   "The record.")},
                 .returns = {"list", "", "Handles.", {}},
                 .effect = Effect::reads,
                 .run = referrers});
  all.push_back({.name = "document.clear",
                 .classic = "",
                 .summary = "Forgets all records and the history.",
                 .details = "This cannot be taken back. Recordings stay.",
                 .example = "material.create{name = \"brass\", density = "
                            "8500}\ndocument.clear()\nassert(#document.list() == 0)",
                 .params = {},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = clear,
                 .own_transaction = true});
  all.push_back({.name = "document.digest",
                 .classic = "",
                 .summary = "Gives a text that is equal for documents of equal content.",
                 .details = "Ids and revisions do not matter for it; names, files and content do.",
                 .example = "local before = document.digest()\nmaterial.create{name = \"brass\", "
                            "density = 8500}\ndocument.undo()\nassert(document.digest() == before)",
                 .params = {},
                 .returns = {"string", "", "", {}},
                 .effect = Effect::reads,
                 .run = digest});
  all.push_back({.name = "cache.stats",
                 .classic = "",
                 .summary = "Tells how often computed values were found or had to be made.",
                 .details = "",
                 .example = "local s = cache.stats()\nassert(s.entries >= 0)",
                 .params = {},
                 .returns = {"map",
                             "",
                             "",
                             {field("hits", "int", "", "Values found."),
                              field("misses", "int", "", "Values made."),
                              field("entries", "int", "", "Values kept."),
                              field("bytes", "int", "", "Memory they take.")}},
                 .effect = Effect::reads,
                 .run = cache_stats});
  all.push_back({.name = "cache.clear",
                 .classic = "",
                 .summary = "Drops all computed values; they are made again when needed.",
                 .details = "",
                 .example = "cache.clear()\nassert(cache.stats().entries == 0)",
                 .params = {},
                 .returns = {},
                 .effect = Effect::simulates,
                 .run = cache_clear});
  all.push_back(
      {.name = "cache.enable",
       .classic = "",
       .summary = "Turns the remembering of computed values on or off.",
       .details = "Results are the same either way; without it everything is computed anew.",
       .example = "cache.enable(false)\ncache.enable(true)",
       .params = {defaulted("on", "bool", "", true, "Whether values are remembered.")},
       .returns = {},
       .effect = Effect::simulates,
       .run = cache_enable});
  all.push_back(
      {.name = "job.list",
       .classic = "",
       .summary = "Lists the jobs of this session of the program.",
       .details = "",
       .example = "assert(#job.list() >= 0)",
       .params = {},
       .returns = {"list",
                   "",
                   "",
                   {field("id", "handle", "", "The job."),
                    field("label", "string", "", "What it does."),
                    field("state", "string", "", "waiting, running, done, failed or cancelled."),
                    field("fraction", "real", "", "How far it is, 0 to 1."),
                    field("what", "string", "", "What it does just now.")}},
       .effect = Effect::reads,
       .run = job_list});
  all.push_back({.name = "job.cancel",
                 .classic = "",
                 .summary = "Stops a job.",
                 .details = "It leaves no trace in the document.",
                 .example = "for _, j in ipairs(job.list()) do\n  job.cancel(j.id)\nend",
                 .params = {self("job")},
                 .returns = {"bool", "", "False when it was finished already.", {}},
                 .effect = Effect::simulates,
                 .run = job_cancel});
  all.push_back(
      {.name = "message.list",
       .classic = "",
       .summary = "Lists the latest messages, oldest first.",
       .details = "",
       .example = "material.create{name = \"brass\", density = 8500}\nlocal all = "
                  "message.list()\nassert(all[#all].code == \"audit\")",
       .params = {between(defaulted("at_most", "int", "", 100, "How many are looked through."), 1,
                          100000),
                  choice("severity", {"debug", "info", "warning", "error"},
                         "Leave out what is less severe.")},
       .returns = {"list",
                   "",
                   "",
                   {field("severity", "string", "", "debug, info, warning or error."),
                    field("code", "string", "", "Stable word for the sort of message."),
                    field("text", "string", "", "The sentence."),
                    field("source", "string", "", "Who says it."),
                    field("repeated", "int", "", "How often the same was left out before it.")}},
       .effect = Effect::reads,
       .run = message_list});
  return all;
}

}  // namespace robomosp::ioci
