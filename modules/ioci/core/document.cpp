// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/commands.h"
#include "kernel/permit.h"

namespace robomosp::ioci {
namespace {

Result<Value> list_records(CommandContext& ctx, const Map& args) {
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
  RMP_TRY(require(Effect::edits));
  ctx.app.document.clear(ctx.app.author(ctx.session));
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

Result<Value> cache_kept(CommandContext& ctx, const Map&) {
  const auto& files = ctx.app.derived.files();
  if (!files)
    return Value(Map{{"on", false},
                     {"folder", ""},
                     {"files", 0},
                     {"bytes", 0},
                     {"limit", 0},
                     {"found", 0},
                     {"written", 0},
                     {"refused", 0}});
  const FileCache::State s = files->state();
  const auto number = [](std::uint64_t n) { return Value(static_cast<std::int64_t>(n)); };
  return Value(Map{{"on", true},
                   {"folder", files->folder().string()},
                   {"files", number(s.files)},
                   {"bytes", number(s.bytes)},
                   {"limit", number(files->limit())},
                   {"found", number(s.hits)},
                   {"written", number(s.written)},
                   {"refused", number(s.refused)}});
}

Result<Value> cache_clear_kept(CommandContext& ctx, const Map&) {
  const auto& files = ctx.app.derived.files();
  return Value(files ? static_cast<std::int64_t>(files->clear()) : std::int64_t{0});
}

Result<Value> cache_enable(CommandContext& ctx, const Map& args) {
  ctx.app.derived.set_enabled(flag(args, "on"));
  return Value();
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

}  // namespace

RMP_COMMANDS(document_commands) {
  std::vector<CommandSpec> all;
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
       .run = list_records});
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
                 .summary = "Reports how often computed values were found or had to be made.",
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
      {.name = "cache.kept",
       .classic = "",
       .summary = "Shows the folder and the size of the geometry cache.",
       .details = "Meshes, moments and shapes for collision are kept in files by a fingerprint of "
                  "all that they were computed from, so that the next run finds them; results are "
                  "the same to the last bit. The program's option --no-cache and the environment "
                  "variable ROBOMOSP_CACHE=off turn it off; ROBOMOSP_CACHE may name another "
                  "folder, ROBOMOSP_CACHE_MIB another limit.",
       .example = "local kept = cache.kept()\nassert(kept.bytes >= 0)",
       .params = {},
       .returns = {"map",
                   "",
                   "",
                   {field("on", "bool", "", "Whether anything is kept."),
                    field("folder", "string", "", "Where; empty when off."),
                    field("files", "int", "", "Values kept there, by this run and others."),
                    field("bytes", "int", "", "What they take on the disk."),
                    field("limit", "int", "",
                          "Bytes from which those go that were used longest ago."),
                    field("found", "int", "", "Values that this run found."),
                    field("written", "int", "", "Values that this run has kept."),
                    field("refused", "int", "", "Files that were damaged, and removed.")}},
       .effect = Effect::reads,
       .run = cache_kept});
  all.push_back({.name = "cache.clear_kept",
                 .classic = "",
                 .summary = "Removes the geometry that is kept from run to run.",
                 .details = "What is in memory stays (cache.clear). Other files in that folder are "
                            "left alone.",
                 .example = "assert(cache.clear_kept() >= 0)\nassert(cache.kept().files == 0)",
                 .params = {},
                 .returns = {"int", "", "How many files were removed.", {}},
                 .effect = Effect::files_write,
                 .run = cache_clear_kept});
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
                    field("source", "string", "", "The part of the program that posted it."),
                    field("repeated", "int", "", "How often the same was left out before it.")}},
       .effect = Effect::reads,
       .run = message_list});
  return all;
}

}  // namespace robomosp::ioci
