// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/chosen_providers.h"
#include "ioci/core/commands.h"
#include "ioci/core/document_providers.h"
#include "ioci/core/interface_words.h"
#include "ioci/core/kept_plugin_runs.h"
#include "ioci/core/modules.h"
#include "ioci/core/result_types.h"
#include "ioci/core/surroundings.h"
#include "ioci/core/word_list.h"
#include "kernel/interface_adapters.h"
#include "kernel/known_provider.h"
#include "kernel/permit.h"
#include "kernel/plugin_faults.h"
#include "kernel/plugin_run.h"
#include "kernel/type.h"
#include "kernel/type_forms.h"

namespace robomosp::ioci {
namespace {

constexpr double kMiB = 1 << 20;

Map report_map(const PluginReport& r) {
  List providers, remarks;
  for (const auto& p : r.providers) providers.emplace_back(p);
  for (const auto& p : r.remarks) remarks.emplace_back(p);
  Map m{{"file", r.file.string()},
        {"loaded", r.loaded},
        {"id", r.id},
        {"version", r.version},
        {"license", r.license},
        {"summary", r.summary},
        {"providers", std::move(providers)},
        {"remarks", std::move(remarks)}};
  if (r.refusal) m.set("refusal", r.refusal->sentence());
  List faults;
  for (const Fault& f : plugin_faults(r)) faults.emplace_back(fault_map(f));
  m.set("faults", std::move(faults));
  const auto apart = r.loaded ? PluginRuns::of_program().process(r.file) : nullptr;
  const PluginRun run = r.loaded ? PluginRuns::of_program().present(r.file) : PluginRun{};
  m.set("run_in_process", apart == nullptr || !run.only.empty());
  if (apart) {
    if (!run.only.empty()) {
      List only;
      for (const std::string& one : run.only) only.emplace_back(one);
      m.set("apart", std::move(only));
    }
    m.set("seconds", apart->limits().seconds);
    m.set("memory", static_cast<double>(apart->limits().memory) / kMiB);
    m.set("confined", apart->limits().confined);
    m.set("process", apart->process());
    m.set("starts", static_cast<std::int64_t>(apart->starts()));
  }
  return m;
}

Result<Value> list_plugins(CommandContext& ctx, const Map&) {
  List out;
  const std::lock_guard lock(ctx.app.plugins_mutex);
  for (const PluginReport& r : ctx.app.plugins.reports()) out.emplace_back(report_map(r));
  // Scripts are what provides under the name of their file.
  std::map<std::string, PluginReport> scripts;
  for (const ProviderInfo& p : ctx.app.registry.list()) {
    if (!p.origin.ends_with(".lua")) continue;
    PluginReport& r = scripts[p.origin];
    r.file = p.origin;
    r.loaded = true;
    r.id = r.file.stem().string();
    r.summary = "A script.";
    r.providers.push_back(p.interface_id + " " + p.name);
  }
  for (const auto& [file, report] : scripts) out.emplace_back(report_map(report));
  return Value(std::move(out));
}

/// Machine code does what it likes, wherever its file lies.
Result<void> check_code_may_run(const CommandContext& ctx) {
  if (!ctx.session.files()) return {};
  return error(
      ErrorCode::permission,
      "a session confined to a folder cannot load plugins, since their code could not be confined",
      "Load the plugin in another session, or when the program starts.");
}

Result<Value> load(CommandContext& ctx, const Map& args) {
  RMP_TRY(check_code_may_run(ctx));
  if (const std::string file = text_of(args, "file"); file.ends_with(".lua"))
    return error(ErrorCode::unsupported, text::quote(file) + " is a script, not a shared library",
                 "Run it: dofile(" + text::quote(file) +
                     "). In a plugin folder it is run when the program starts.",
                 "file");
  if (const std::string file = text_of(args, "file"); file.ends_with(".post"))
    return error(ErrorCode::unsupported,
                 text::quote(file) + " is a pack of templates, not a shared library",
                 "program.add_target(" + text::quote(file) +
                     ") adds it. In a plugin folder it is a target whenever the program starts.",
                 "file");
  const bool keeps = text_of(args, "keep") == "user";
  const bool is_said = has(args, "run_in_process");
  if (!is_said && (keeps || has(args, "seconds") || has(args, "memory") || has(args, "confined") ||
                   has(args, "providers")))
    return error(ErrorCode::invalid_argument,
                 "seconds, memory, confined, providers and keep need run_in_process",
                 "Give run_in_process = false or true.", "run_in_process");
  if (keeps && !ctx.session.may(Effect::files_write))
    return error(ErrorCode::permission, "this session may not write files",
                 "Leave keep out to apply the choice to this run only.", "keep");
  PluginRun run;
  if (is_said) {
    run.in_process = flag(args, "run_in_process");
    if (has(args, "seconds")) run.limits.seconds = real(args, "seconds");
    if (has(args, "memory"))
      run.limits.memory = static_cast<std::uint64_t>(real(args, "memory") * kMiB);
    if (has(args, "confined")) run.limits.confined = flag(args, "confined");
    if (has(args, "providers")) {
      if (run.in_process)
        return error(
            ErrorCode::invalid_argument,
            "providers names those that run in a separate process, so run_in_process must be false",
            "Give run_in_process = false, or leave providers out.", "providers");
      RMP_TRY_ASSIGN(run.only, word_list(args, "providers"));
      if (run.only.empty())
        return error(ErrorCode::invalid_argument, "providers is empty",
                     "Name some, or give run_in_process = true.", "providers");
    }
  }
  std::optional<Error> stays;
  const PluginReport r = [&] {
    const std::lock_guard lock(ctx.app.plugins_mutex);
    std::optional<PluginRunScope> scope;
    if (is_said) scope.emplace(run);
    const std::filesystem::path file = ctx.app.plugins.load(text_of(args, "file")).file;
    if (scope) stays = scope->refusal;
    (void)ctx.app.modules->adopt();
    for (const PluginReport& report : ctx.app.plugins.reports())
      if (report.file == file) return report;
    return PluginReport{};
  }();
  if (r.refusal) return *r.refusal;
  // One with commands is moved when the program starts again.
  const bool is_later = stays && keeps && stays->where == "run_in_process";
  if (stays && !is_later) return *stays;
  if (keeps) {
    if (!run.only.empty()) run.only = PluginRuns::of_program().present(r.file).only;  // in full
    RMP_TRY(keep_plugin_run(r.file, run));
  }
  Map out = report_map(r);
  if (is_later) {
    List remarks;
    for (const auto& one : r.remarks) remarks.emplace_back(one);
    remarks.emplace_back("It adds commands, and runs where it ran until the program starts again.");
    out.set("remarks", std::move(remarks));
  }
  return Value(std::move(out));
}

Result<Value> check_plugin(CommandContext& ctx, const Map& args) {
  RMP_TRY(check_code_may_run(ctx));
  const std::filesystem::path file(text_of(args, "file"));
  std::error_code ignored;
  if (std::filesystem::is_regular_file(file, ignored)) {
    const std::lock_guard lock(ctx.app.plugins_mutex);
    if (const auto tried = ctx.app.plugins.try_out(file); !tried.ok()) {
      PluginReport report;
      report.file = file;
      report.refusal = tried.error();
      return Value(report_map(report));
    }
  }
  // A registry of its own: nothing of the plugin becomes available, and nothing needs a permit.
  const PermitScope apart(nullptr);
  Registry registry;
  PluginLoader loader(registry);
  loader.set_search_path(PluginLoader::search_path({}));
  PluginReport report = loader.load(text_of(args, "file"));
  for (const ProviderInfo& p : registry.list(Module::kInterfaceId))
    for (const std::string& fault : module_faults(registry, p, ctx.app.commands))
      report.remarks.push_back(fault);
  return Value(report_map(report));
}

Result<Value> provider_list(CommandContext& ctx, const Map& args) {
  std::string id;
  if (!text_of(args, "interface").empty()) {
    RMP_TRY_ASSIGN(id, interface_of_word(text_of(args, "interface")));
  }
  const auto chosen = ctx.app.registry.chosen();
  List out;
  for (const ProviderInfo& p : ctx.app.registry.list(id)) {
    const auto standard = ctx.app.registry.find(p.interface_id, "");
    const auto choice = chosen.find(p.interface_id);
    const bool is_chosen = choice != chosen.end() && choice->second.name == p.name;
    List tags;
    for (const auto& t : p.tags) tags.emplace_back(t);
    out.emplace_back(Map{
        {"interface", p.interface_id},
        {"name", p.name},
        {"summary", p.summary},
        {"origin", p.origin},
        {"version", p.version},
        {"tags", std::move(tags)},
        {"enabled", p.enabled},
        {"shipped", p.shipped},
        {"run_in_process", !PluginRuns::of_program().is_apart(p.origin, p.interface_id, p.name)},
        {"default", standard.ok() && standard->name == p.name},
        {"chosen", is_chosen ? choice->second.by : std::string()}});
  }
  return Value(std::move(out));
}

std::vector<ParamSpec> with_text(std::vector<ParamSpec> fields) {
  fields.push_back(field("text", "string", "", "All of this in one line."));
  return fields;
}

Result<Value> provider_params(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const std::string id, interface_of_word(text_of(args, "interface")));
  RMP_TRY_ASSIGN(const auto info, known_provider(ctx.app.registry, id, text_of(args, "name")));
  List out;
  for (const ParamSpec& p : info.schema) {
    Map m = param_value(p);
    const TypeNotes notes = notes_of(p);
    m.set("label", notes.label);
    m.set("group", notes.group);
    m.set("text", describe(p));
    out.emplace_back(std::move(m));
  }
  return Value(std::move(out));
}

Result<Value> provider_default(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const std::string id, interface_of_word(text_of(args, "interface")));
  const std::string keep = text_of(args, "keep");
  if (keep != "session" && !has(args, "name"))
    return error(ErrorCode::invalid_argument, "there is no name to keep", "Give name = ...",
                 "keep");
  if (keep == "document") {
    RMP_TRY(keep_document_provider(ctx, id, text_of(args, "name")));
    // A choice for this run is stronger; what the caller asked for now is to hold now.
    const auto chosen = ctx.app.registry.chosen();
    if (const auto it = chosen.find(id); it != chosen.end() && it->second.by == "session")
      RMP_TRY(ctx.app.registry.set_default(id, ""));
    return Value(text_of(args, "name"));
  }
  if (keep == "user" && (!ctx.session.may(Effect::files_write) || ctx.session.files()))
    return error(ErrorCode::permission,
                 ctx.session.files() ? "this session writes files in its folder only, but the "
                                       "choice is stored in the user's settings"
                                     : "this session may not write files",
                 "Leave keep out to apply the choice to this run only.", "keep");
  if (keep == "user") {
    RMP_TRY(ctx.app.registry.set_user_default(id, text_of(args, "name")));
    RMP_TRY(keep_chosen_provider(id, text_of(args, "name")));
    tell_setting(ctx.app, ctx.session, "provider." + text_of(args, "interface"),
                 text_of(args, "name"));
    RMP_TRY(ctx.app.registry.set_default(id, ""));  // which would be stronger
  } else if (has(args, "name")) {
    RMP_TRY(ctx.app.registry.set_default(id, text_of(args, "name")));
  }
  if (has(args, "name") && text_of(args, "name").empty() && !ctx.app.registry.find(id, "").ok())
    return Value(std::string());
  RMP_TRY_ASSIGN(const auto info, ctx.app.registry.find(id, ""));
  return Value(info.name);
}

Result<Value> enable(CommandContext& ctx, const Map& args, bool on) {
  RMP_TRY_ASSIGN(const std::string id, interface_of_word(text_of(args, "interface")));
  RMP_TRY(ctx.app.registry.set_enabled(id, text_of(args, "name"), on));
  return Value();
}
Result<Value> provider_enable(CommandContext& ctx, const Map& args) {
  return enable(ctx, args, true);
}
Result<Value> provider_disable(CommandContext& ctx, const Map& args) {
  return enable(ctx, args, false);
}

}  // namespace

Result<std::string> interface_of_word(const std::string& word) {
  std::vector<std::string> known;
  for (const std::string& id : known_interfaces()) {
    const auto dot = id.find('.'), slash = id.find('/');
    const std::string brief = id.substr(dot + 1, slash - dot - 1);
    if (word == id || word == brief || current_interface(word) == id) return id;
    known.push_back(brief);
  }
  return unknown_name("interface", word, known);
}

RMP_COMMANDS(plugin_commands) {
  std::vector<CommandSpec> all;
  const std::vector<ParamSpec> report{
      field("file", "string", "", "The file."),
      field("loaded", "bool", "", "Whether it was accepted."),
      field("id", "string", "", "Its identifier."),
      field("version", "string", "", "Its version."),
      field("license", "string", "", "Its licence."),
      field("summary", "string", "", "Its description."),
      field("providers", "list", "", "Its providers, such as \"robomosp.ik/1 numeric\"."),
      field("remarks", "list", "", "Providers and commands left out, with the reason."),
      field("refusal", "string", "", "Why it was rejected."),
      field("faults", "list<type:fault>", "", "The refusal, or the remarks, as faults."),
      field("run_in_process", "bool", "",
            "Whether its code runs in this program; false: only in a separate process."),
      field("apart", "list", "", "Providers that run in that process, if not all of them."),
      field("seconds", "real", "s",
            "Timeout: a call of that process without a sign of life for this time ends it."),
      field("memory", "real", "", "Address space of that process [MiB]."),
      field("confined", "bool", "",
            "Whether that process is kept from files, programs and the network."),
      field("process", "int", "", "Id of that process; 0 = none is running now."),
      field("starts", "int", "", "How often such a process was started.")};
  const ParamSpec interface =
      needed("interface", "string", "", "Such as \"ik\" or \"robomosp.ik/1\".");
  const ParamSpec name = needed("name", "string", "", "Name of the provider.");
  ParamSpec seconds = optional(
      "seconds", "real", "s",
      "Timeout: a call of that process without an answer for this time ends it; 60 if omitted.");
  seconds.min = 0.01;
  seconds.max = 1e6;
  ParamSpec memory =
      optional("memory", "real", "", "Address space of that process [MiB]; 4096 if omitted.");
  memory.min = 256;
  memory.max = 1e6;
  all.push_back(
      {.name = "plugin.list",
       .classic = "",
       .summary = "Lists the plugin files that were found, and whether each was loaded.",
       .details = "The fields about a process apply to plugins that run in one.",
       .example = "for _, p in ipairs(plugin.list()) do\n  assert(p.loaded or p.refusal)\nend",
       .params = {},
       .returns = {"list", "", "", report},
       .effect = Effect::reads,
       .run = list_plugins});
  all.push_back(
      {.name = "plugin.load",
       .classic = "",
       .summary = "Loads a plugin.",
       .details =
           "A plugin stays loaded until the program ends. With `run_in_process = false` its code "
           "never runs in this program: its providers are called in a separate process; a crash or "
           "a hang of that process is an error that names the plugin, and the next call starts it "
           "again. A plugin that is already loaded is moved, unless it adds commands; solvers in "
           "use finish where they are. With `providers` only those run there and the others in "
           "this program, which then opens the file as well. `keep = \"user\"` makes the choice "
           "apply whenever the file is found later.",
       .example = "local ok, e = pcall(plugin.load, \"no_such_plugin\")\nassert(not ok)\n"
                  "local p = plugin.load{file = \"ik_numeric\", run_in_process = false}\n"
                  "assert(not p.run_in_process)\n"
                  "p = plugin.load{file = \"ik_numeric\", run_in_process = false, providers = "
                  "{\"ik numeric\"}}\n"
                  "assert(p.apart[1] == \"robomosp.ik/1 numeric\")\n"
                  "plugin.load{file = \"ik_numeric\", run_in_process = true}",
       .params = {needed("file", "string", "", "A name to look for in the search path, or a path."),
                  optional("run_in_process", "bool", "",
                           "false: its providers run in a separate process; true: in this program; "
                           "if omitted: as kept earlier, otherwise in this program."),
                  optional("providers", "list", "",
                           "With run_in_process = false: only these providers, such as \"numeric\" "
                           "or \"ik numeric\"."),
                  seconds, memory,
                  optional("confined", "bool", "",
                           "Whether that process is kept from files, programs and the network; "
                           "true if omitted."),
                  choice("keep", {"session", "user"},
                         "Scope of the choice: this run, or every run of this user.")},
       .returns = {"map", "", "", report},
       .effect = Effect::loads_code | Effect::providers,
       // Files of strangers are tried in a process first, and some stay in one.
       .sometimes = Effect::processes | Effect::files_write,
       .run = load});
  all.push_back(
      {.name = "plugin.check",
       .classic = "",
       .summary =
           "Reports whether a plugin would be accepted, without making its providers available.",
       .details = "The code of the file is loaded for this check.",
       .example = "assert(plugin.check(\"no_such_plugin\").refusal)",
       .params = {needed("file", "string", "",
                         "A name to look for in the search path, or a path.")},
       .returns = {"map", "", "", report},
       .effect = Effect::loads_code,
       .sometimes = Effect::processes,
       .run = check_plugin});
  all.push_back(
      {.name = "provider.list",
       .classic = "",
       .summary = "Lists the providers of one interface, or of all.",
       .details = "",
       .example = "for _, p in ipairs(provider.list()) do\n  assert(p.name ~= \"\")\nend",
       .params = {defaulted("interface", "string", "", "",
                            "Such as \"ik\" or \"robomosp.ik/1\"; all if omitted.")},
       .returns = {"list",
                   "",
                   "",
                   {field("interface", "string", "", "The interface."),
                    field("name", "string", "", "Name of the provider."),
                    field("summary", "string", "", "Its summary."),
                    field("origin", "string", "", "Plugin file, or lua."),
                    field("version", "string", "", "Version of the plugin."),
                    field("tags", "list", "", "Capabilities and requirements."),
                    field("enabled", "bool", "", "Whether it may be selected."),
                    field("shipped", "bool", "", "Whether it is shipped with the program."),
                    field("run_in_process", "bool", "",
                          "Whether it runs in this program; false: in a process of its plugin."),
                    field("default", "bool", "", "Whether it is used if no provider is named."),
                    field(
                        "chosen", "string", "",
                        "Where the default was set: session, document, user (kept), or nothing.")}},
       .effect = Effect::reads,
       .run = provider_list});
  all.push_back({.name = "provider.params",
                 .classic = "",
                 .summary = "Lists the parameters of a provider.",
                 .details = "",
                 .example = "assert(#provider.params(\"curve\", \"circle\") >= 1)",
                 .params = {interface, name},
                 .returns = {"list", "", "", with_text(param_value_fields())},
                 .effect = Effect::reads,
                 .run = provider_params});
  all.push_back(
      {.name = "provider.default",
       .classic = "",
       .summary = "Reports or sets the provider that is used if none is named.",
       .details = "A provider never becomes the default just by being found: the built-in provider "
                  "stays the default until another is set for this run, with the document (`keep = "
                  "\"document\"`: saved, loaded and undone with it) or permanently (`keep = "
                  "\"user\"`). The setting for this run has the highest priority, then that of the "
                  "document. If the document's provider is missing, using it is an error; no other "
                  "one is used instead. An empty name removes the setting.",
       .example = "provider.default(\"ik\", provider.default(\"ik\"))",
       .params = {interface, optional("name", "string", "", "The new default."),
                  choice(
                      "keep", {"session", "document", "user"},
                      "Scope of the choice: this run, the document, or every run of this user.")},
       .returns = {"string", "", "The default.", {}},
       .effect = Effect::reads,
       .sometimes = Effect::providers | Effect::files_write | Effect::edits,
       .run = provider_default});
  all.push_back({.name = "provider.enable",
                 .classic = "",
                 .summary = "Allows a provider to be selected again.",
                 .details = "",
                 .example = "provider.enable(\"ik\", provider.default(\"ik\"))",
                 .params = {interface, name},
                 .returns = {},
                 .effect = Effect::providers,
                 .run = provider_enable});
  all.push_back({.name = "provider.disable",
                 .classic = "",
                 .summary = "Prevents a provider from being selected.",
                 .details = "Solvers that are in use finish their work.",
                 .example = "local name = provider.default(\"ik\")\nprovider.disable(\"ik\", "
                            "name)\nprovider.enable(\"ik\", name)",
                 .params = {interface, name},
                 .returns = {},
                 .effect = Effect::providers,
                 .run = provider_disable});
  return all;
}

}  // namespace robomosp::ioci
