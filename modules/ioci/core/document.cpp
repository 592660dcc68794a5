// SPDX-License-Identifier: Apache-2.0
#include "io/recovery_journal.h"
#include "ioci/core/commands.h"
#include "ioci/core/surroundings.h"
#include "kernel/fault.h"
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
  return Value(document::content_digest(ctx.snapshot()));
}

Result<Value> unsaved(CommandContext& ctx, const Map&) {
  List out;
  const document::Snapshot& now = ctx.snapshot();
  for (const AnyId id : now.list()) {
    if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
    const model::Record& r = *now.find(id);
    if (!r.file.empty()) {
      RMP_TRY(require(Effect::files_read));
      const OwnWorkScope own;
      if (!io::is_unsaved(now, id, ctx.app.library)) continue;
    }
    out.emplace_back(Map{{"id", Application::handle(id)},
                         {"name", r.name},
                         {"kind", to_string(id.kind)},
                         {"file", r.file},
                         {"why", r.file.empty() ? "no file" : "differs"}});
  }
  return Value(std::move(out));
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
  tell_setting(ctx.app, ctx.session, "cache", flag(args, "on"));
  return Value();
}

Result<Value> message_list(CommandContext& ctx, const Map& args) {
  List out;
  const std::string least = text_of(args, "severity");
  const auto rank = [](std::string_view s) {
    return s == "error" ? 3 : s == "warning" ? 2 : s == "info" ? 1 : 0;
  };
  for (const Message& m :
       ctx.app.messages.recent(static_cast<std::size_t>(integer(args, "at_most")))) {
    if (rank(to_string(m.severity)) < rank(least)) continue;
    Map row{{"severity", to_string(m.severity)},
            {"code", m.code},
            {"text", m.text},
            {"source", m.source},
            {"repeated", static_cast<std::int64_t>(m.repeated)}};
    if (m.fault) row.set("fault", fault_map(*m.fault));
    out.emplace_back(std::move(row));
  }
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
  all.push_back(
      {.name = "document.unsaved",
       .classic = "",
       .summary = "Lists the records that are not saved: those that differ from their files, or "
                  "have none.",
       .details = "A file that somebody else has changed or removed counts as different. The "
                  "topic unsaved of event.subscribe reports when the list changes.",
       .example = "material.create{name = \"brass\", density = 8500}\n"
                  "local left = document.unsaved()\n"
                  "assert(#left == 1 and left[1].name == \"brass\" and left[1].why == \"no "
                  "file\")",
       .params = {},
       .returns = {"list",
                   "",
                   "In order of creation.",
                   {field("id", "handle", "", "The record."),
                    field("name", "string", "", "Its name."),
                    field("kind", "string", "", "Its kind."),
                    field("file", "string", "", "Its file; empty when it has none."),
                    field("why", "string", "", "no file, or differs.")}},
       .effect = Effect::reads,
       .sometimes = Effect::files_read,
       .run = unsaved});
  all.push_back({.name = "document.clear",
                 .classic = "",
                 .summary = "Removes all records and the history from the document.",
                 .details = "This cannot be undone. Recordings are kept.",
                 .example = "material.create{name = \"brass\", density = "
                            "8500}\ndocument.clear()\nassert(#document.list() == 0)",
                 .params = {},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = clear,
                 .own_transaction = true});
  all.push_back({.name = "document.digest",
                 .classic = "",
                 .summary = "Returns a text that is equal for documents with equal content.",
                 .details = "It depends on names, files and content, not on ids and revisions.",
                 .example = "local before = document.digest()\nmaterial.create{name = \"brass\", "
                            "density = 8500}\ndocument.undo()\nassert(document.digest() == before)",
                 .params = {},
                 .returns = {"string", "", "", {}},
                 .effect = Effect::reads,
                 .run = digest});
  all.push_back(
      {.name = "cache.stats",
       .classic = "",
       .summary =
           "Reports how often computed values were found in the cache or had to be computed.",
       .details = "",
       .example = "local s = cache.stats()\nassert(s.entries >= 0)",
       .params = {},
       .returns = {"map",
                   "",
                   "",
                   {field("hits", "int", "", "Values found."),
                    field("misses", "int", "", "Values computed."),
                    field("entries", "int", "", "Values kept."),
                    field("bytes", "int", "", "Memory used by the values.")}},
       .effect = Effect::reads,
       .run = cache_stats});
  all.push_back({.name = "cache.clear",
                 .classic = "",
                 .summary = "Drops all computed values; they are computed again on demand.",
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
       .details = "Meshes, moments and collision shapes are kept in files under a fingerprint of "
                  "all the data they were computed from, so that the next run finds them; results "
                  "are identical to the last bit. The option --no-cache of the program and the "
                  "environment variable ROBOMOSP_CACHE=off disable the cache; ROBOMOSP_CACHE may "
                  "also name another folder, ROBOMOSP_CACHE_MIB another limit.",
       .example = "local kept = cache.kept()\nassert(kept.bytes >= 0)",
       .params = {},
       .returns = {"map",
                   "",
                   "",
                   {field("on", "bool", "", "Whether the cache is enabled."),
                    field("folder", "string", "", "Its folder; empty if disabled."),
                    field("files", "int", "",
                          "Values in the cache, stored by this run and others."),
                    field("bytes", "int", "", "Their size on disk."),
                    field("limit", "int", "",
                          "Size limit: beyond it the least recently used values are removed."),
                    field("found", "int", "", "Values that this run found."),
                    field("written", "int", "", "Values that this run has stored."),
                    field("refused", "int", "", "Damaged files that were removed.")}},
       .effect = Effect::reads,
       .run = cache_kept});
  all.push_back(
      {.name = "cache.clear_kept",
       .classic = "",
       .summary = "Removes the geometry that is kept between runs.",
       .details =
           "Values in memory are kept (see cache.clear). Other files in the folder are left alone.",
       .example = "assert(cache.clear_kept() >= 0)\nassert(cache.kept().files == 0)",
       .params = {},
       .returns = {"int", "", "Number of files removed.", {}},
       .effect = Effect::files_write,
       .run = cache_clear_kept});
  all.push_back(
      {.name = "cache.enable",
       .classic = "",
       .summary = "Turns the cache of computed values on or off.",
       .details = "Results are the same with and without it; without the cache everything is "
                  "computed again.",
       .example = "cache.enable(false)\ncache.enable(true)",
       .params = {defaulted("on", "bool", "", true, "Whether computed values are cached.")},
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
       .params = {between(
                      defaulted("at_most", "int", "", 100, "Number of messages to look through."),
                      1, 100000),
                  choice("severity", {"debug", "info", "warning", "error"},
                         "Least severity to list.")},
       .returns = {"list",
                   "",
                   "",
                   {field("severity", "string", "", "debug, info, warning or error."),
                    field("code", "string", "", "Stable identifier of the type of message."),
                    field("text", "string", "", "The text of the message."),
                    field("source", "string", "", "The part of the program that posted it."),
                    field("repeated", "int", "",
                          "Number of identical messages left out before this one."),
                    field("fault", "map", "", "The message as data, of messages about faults.")}},
       .effect = Effect::reads,
       .run = message_list});
  return all;
}

}  // namespace robomosp::ioci
