// SPDX-License-Identifier: Apache-2.0
// Commands for solvers in Lua that travel with records: provider.keep, kept, text, trust, distrust,
// forget.
#include <algorithm>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/interface_words.h"
#include "ioci/core/kept_solvers.h"

namespace robomosp::ioci {
namespace {

std::vector<std::string> names_of(const std::vector<KeptEntry>& all) {
  std::vector<std::string> out;
  for (const KeptEntry& e : all) out.push_back(e.solver.name);
  return out;
}

/// The one that the arguments name.
Result<KeptEntry> kept_one(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const std::string id, interface_of_word(text_of(args, "interface")));
  const std::string name = text_of(args, "name");
  const std::vector<KeptEntry> all = ctx.app.kept_solvers->list();
  for (const KeptEntry& e : all)
    if (e.solver.interface == id && e.solver.name == name) return e;
  return error(ErrorCode::unknown_name,
               "the document keeps no solver " + text::quote(name) + " of " + text::quote(id),
               all.empty() ? "Keep one with provider.keep."
                           : "It keeps " + text::enumerate(names_of(all)) + ".");
}

/// Those that the arguments name: one, all of an interface, or all.
Result<std::vector<KeptEntry>> kept_some(CommandContext& ctx, const Map& args) {
  if (has(args, "name") && !has(args, "interface"))
    return error(ErrorCode::invalid_argument, "the name is ambiguous: several solvers have it",
                 "Give the interface too.", "interface");
  if (has(args, "name")) {
    RMP_TRY_ASSIGN(auto one, kept_one(ctx, args));
    return std::vector<KeptEntry>{std::move(one)};
  }
  std::string id;
  if (has(args, "interface")) {
    RMP_TRY_ASSIGN(id, interface_of_word(text_of(args, "interface")));
  }
  std::vector<KeptEntry> all = ctx.app.kept_solvers->list();
  if (!id.empty()) std::erase_if(all, [&](const KeptEntry& e) { return e.solver.interface != id; });
  if (all.empty())
    return error(ErrorCode::unknown_name,
                 "the document keeps no solvers in Lua" +
                     (id.empty() ? std::string() : " of " + text::quote(id)),
                 "Keep one with provider.keep.");
  return all;
}

Result<std::string> text_given(CommandContext& ctx, const Map& args, const std::string& interface,
                               const std::string& name) {
  if (has(args, "text") && has(args, "file"))
    return error(ErrorCode::invalid_argument, "text and file are both given", "Give one of them.");
  if (has(args, "text")) return text_of(args, "text");
  if (has(args, "file")) return io::read_file(text_of(args, "file"), 2 * model::kMostKeptText);
  std::string text = ctx.app.kept_solvers->source_of(interface, name);
  if (!text.empty()) return text;
  return error(
      ErrorCode::unknown_name,
      "no script of this run has provided " + text::quote(name) + " of " + text::quote(interface),
      "Provide it with ioci.provide, or give text or file.");
}

/// The record given, or all that choose this solver.
Result<std::vector<AnyId>> keepers(CommandContext& ctx, const Map& args,
                                   const std::string& interface, const std::string& name) {
  std::vector<AnyId> out;
  if (has(args, "with")) {
    RMP_TRY_ASSIGN(const AnyId id,
                   Application::record_id(ctx.snapshot(), *args.find("with")->as_handle()));
    out.push_back(id);
    return out;
  }
  for (const AnyId id : ctx.snapshot().list())
    if (model::chooses(ctx.snapshot().find(id)->body, interface, name)) out.push_back(id);
  if (!out.empty()) return out;
  return error(
      ErrorCode::invalid_argument,
      "no record chooses the solver " + text::quote(name) + ", so no record would carry it",
      "Give the record that should keep it: with = ...", "with");
}

Result<Value> keep(CommandContext& ctx, const Map& args) {
  model::KeptSolver s;
  RMP_TRY_ASSIGN(s.interface, interface_of_word(text_of(args, "interface")));
  s.name = text_of(args, "name");
  RMP_TRY_ASSIGN(s.text, text_given(ctx, args, s.interface, s.name));
  for (const ProviderInfo& p : ctx.app.registry.list(s.interface))
    if (p.name == s.name && !p.is_script)
      return error(ErrorCode::conflict,
                   text::quote(s.name) + " of " + text::quote(s.interface) +
                       " already exists, from " + text::quote(p.origin),
                   "Give the solver another name.", "name");
  RMP_TRY_ASSIGN(const auto with, keepers(ctx, args, s.interface, s.name));
  for (const KeptEntry& e : ctx.app.kept_solvers->list()) {
    if (e.solver.interface != s.interface || e.solver.name != s.name) continue;
    // What it is called in its text stays known when it was renamed.
    if (e.solver.text == s.text) s.provides = e.solver.provides;
    for (const AnyId id : e.keepers)
      if (e.solver.text != s.text && std::find(with.begin(), with.end(), id) == with.end())
        return error(ErrorCode::conflict,
                     ctx.snapshot().describe(id) + " keeps a different text of the solver " +
                         text::quote(s.name),
                     "Give this one another name, or remove the other one with provider.forget.",
                     "name");
  }
  RMP_TRY(ctx.app.kept_solvers->try_out(s));
  List out;
  for (const AnyId id : with) {
    RMP_TRY(ctx.edit().edit(id, [&](model::Record& r) -> Result<void> {
      const auto it = std::find_if(r.solvers.begin(), r.solvers.end(), [&](const auto& old) {
        return old.interface == s.interface && old.name == s.name;
      });
      if (it == r.solvers.end()) r.solvers.push_back(s);
      else *it = s;
      return {};
    }));
    out.emplace_back(Application::handle(id));
  }
  // Who keeps a text has it run; in later runs, too, where this session may write that down.
  RMP_TRY(ctx.app.kept_solvers->trust(
      s.text, ctx.session.may(Effect::files_write) && !ctx.session.files()));
  return Value(std::move(out));
}

Result<Value> kept(CommandContext& ctx, const Map&) {
  List out;
  for (const KeptEntry& e : ctx.app.kept_solvers->list()) {
    List with, others;
    for (const AnyId id : e.keepers)
      if (ctx.snapshot().find(id)) with.emplace_back(Application::handle(id));
    for (const AnyId id : e.others)
      if (ctx.snapshot().find(id)) others.emplace_back(Application::handle(id));
    const std::string& t = e.solver.text;
    out.emplace_back(
        Map{{"interface", e.solver.interface},
            {"name", e.solver.name},
            {"with", std::move(with)},
            {"trusted", e.is_trusted},
            {"running", e.is_provided},
            {"lines", 1 + static_cast<std::int64_t>(std::count(t.begin(), t.end(), '\n')) -
                          (t.ends_with('\n') ? 1 : 0)},
            {"other_texts", std::move(others)},
            {"fault", e.fault}});
  }
  return Value(std::move(out));
}

Result<Value> text_of_kept(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const KeptEntry e, kept_one(ctx, args));
  return Value(e.solver.text);
}

Result<Value> trust(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto some, kept_some(ctx, args));
  const bool remember = flag(args, "remember");
  if (remember && (!ctx.session.may(Effect::files_write) || ctx.session.files()))
    return error(ErrorCode::permission,
                 ctx.session.files() ? "this session writes files in its folder only, but trust is "
                                       "stored in the user's settings"
                                     : "this session may not write files",
                 "Give remember = false to trust it for this run only.", "remember");
  List out;
  for (const KeptEntry& e : some) {
    RMP_TRY(ctx.app.kept_solvers->trust(e.solver.text, remember));
    out.emplace_back(described(ctx.snapshot(), e));
  }
  return Value(std::move(out));
}

Result<Value> distrust(CommandContext& ctx, const Map& args) {
  if (ctx.session.files())
    return error(
        ErrorCode::permission,
        "this session writes files in its folder only, but trust is stored in the user's settings",
        "Withdraw the trust in a session of the program itself.");
  RMP_TRY_ASSIGN(const auto some, kept_some(ctx, args));
  List out;
  for (const KeptEntry& e : some) {
    RMP_TRY(ctx.app.kept_solvers->distrust(e.solver.text));
    out.emplace_back(described(ctx.snapshot(), e));
  }
  return Value(std::move(out));
}

Result<Value> forget(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const std::string id, interface_of_word(text_of(args, "interface")));
  const std::string name = text_of(args, "name");
  std::optional<AnyId> only;
  if (has(args, "with")) {
    RMP_TRY_ASSIGN(only, Application::record_id(ctx.snapshot(), *args.find("with")->as_handle()));
  }
  List out;
  for (const AnyId each : ctx.snapshot().list()) {
    const model::Record& r = *ctx.snapshot().find(each);
    const auto is_it = [&](const model::KeptSolver& s) {
      return s.interface == id && s.name == name;
    };
    if ((only && *only != each) || std::none_of(r.solvers.begin(), r.solvers.end(), is_it))
      continue;
    RMP_TRY(ctx.edit().edit(each, [&](model::Record& edited) -> Result<void> {
      std::erase_if(edited.solvers, is_it);
      return {};
    }));
    out.emplace_back(Application::handle(each));
  }
  if (!out.empty()) return Value(std::move(out));
  if (only)
    return error(ErrorCode::unknown_name, ctx.snapshot().describe(*only) + " keeps no solver " +
                                              text::quote(name) + " of " + text::quote(id));
  RMP_TRY(kept_one(ctx, args));
  return Value(std::move(out));
}

/// A robot that keeps a solver; the rest of an example.
std::string with_kept(const char* rest) {
  return std::string(
             "local arm = robot.create{name = \"arm\", convention = \"dh\", links = {{a = 1}}}\n"
             "provider.keep{interface = \"inverse_dynamics\", name = \"weightless\", with = arm,\n"
             "  text = \"return function(model, q) return {0} end\"}\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(kept_solver_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec interface =
      needed("interface", "string", "", "Such as \"ik\" or \"robomosp.ik/1\".");
  const ParamSpec name = needed("name", "string", "", "Name of the solver.");
  const ParamSpec some_interface =
      optional("interface", "string", "", "Only those of this interface; all if omitted.");
  const ParamSpec some_name = optional("name", "string", "", "Only this solver.");
  const ReturnSpec records{"list", "", "The records.", {}};
  const ReturnSpec named{"list", "", "What was done, one line each.", {}};
  all.push_back(
      {.name = "provider.keep",
       .classic = "",
       .summary = "Keeps a Lua solver with records, so that their files contain it.",
       .details =
           "The text is a script that calls ioci.provide, or that returns the function or table; "
           "it must work by itself, without anything else the session has defined. By default it "
           "is the text with which this session provided the solver: the console's input, or the "
           "file. By default the records are those that select the solver. Whoever loads such a "
           "file can read the text and must trust it once (provider.trust) before any of it runs; "
           "it can compute and read the document, but has no access to files, programs or plugins. "
           "Saving, undo and duplicates include the text.",
       .example = with_kept("assert(provider.kept()[1].name == \"weightless\")"),
       .params = {interface, name,
                  optional("with", "ref:any", "",
                           "The record; by default all that select the solver."),
                  optional("text", "string", "", "The solver's text."),
                  optional("file", "path", "", "Or the file that contains it.")},
       .returns = records,
       .effect = Effect::edits | Effect::providers | Effect::loads_code,
       .sometimes = Effect::files_read | Effect::files_write,
       .run = keep});
  all.push_back(
      {.name = "provider.kept",
       .classic = "",
       .summary = "Lists the Lua solvers that the document's records contain.",
       .details = "",
       .example = with_kept("assert(provider.kept()[1].trusted)"),
       .params = {},
       .returns = {"list",
                   "",
                   "",
                   {field("interface", "string", "", "Its interface."),
                    field("name", "string", "", "Name of the solver."),
                    field("with", "list", "", "Records that contain it."),
                    field("trusted", "bool", "", "Whether it may run."),
                    field("running", "bool", "", "Whether it can be selected."),
                    field("lines", "int", "", "Number of lines of its text."),
                    field("other_texts", "list", "",
                          "Records that contain another text under this name, which is not used."),
                    field("fault", "string", "", "Why it does not run although it is trusted.")}},
       .effect = Effect::reads,
       .run = kept});
  all.push_back({.name = "provider.text",
                 .classic = "",
                 .summary = "Returns the text of a Lua solver that a record contains.",
                 .details = "The text is not run.",
                 .example = with_kept("assert(provider.text(\"inverse_dynamics\", "
                                      "\"weightless\"):find(\"return\"))"),
                 .params = {interface, name},
                 .returns = {"string", "", "The text.", {}},
                 .effect = Effect::reads,
                 .run = text_of_kept});
  all.push_back({.name = "provider.trust",
                 .classic = "",
                 .summary = "Allows Lua solvers that the document contains to run.",
                 .details = "Read them first: provider.text. The text is remembered as trusted, "
                            "whichever file contains it; a changed text must be trusted again.",
                 .example = with_kept("provider.distrust(\"inverse_dynamics\", \"weightless\")\n"
                                      "assert(#provider.trust{remember = false} == 1)"),
                 .params = {some_interface, some_name,
                            defaulted("remember", "bool", "", true,
                                      "True: in every run of this user; false: in this run only.")},
                 .returns = named,
                 .effect = Effect::providers | Effect::loads_code,
                 .sometimes = Effect::files_write,
                 .run = trust});
  all.push_back(
      {.name = "provider.distrust",
       .classic = "",
       .summary = "Forbids Lua solvers that the document contains to run.",
       .details = "They are withdrawn, and must be trusted again when they are loaded next.",
       .example = with_kept("provider.distrust()\nassert(not provider.kept()[1].trusted)"),
       .params = {some_interface, some_name},
       .returns = named,
       .effect = Effect::providers | Effect::files_write,
       .run = distrust});
  all.push_back(
      {.name = "provider.forget",
       .classic = "",
       .summary = "Removes a Lua solver from the records that contain it.",
       .details = "",
       .example = with_kept("provider.forget(\"inverse_dynamics\", \"weightless\")\n"
                            "assert(#provider.kept() == 0)"),
       .params = {interface, name, optional("with", "ref:any", "", "The record; all if omitted.")},
       .returns = records,
       .effect = Effect::edits,
       .run = forget});
  return all;
}

}  // namespace robomosp::ioci
