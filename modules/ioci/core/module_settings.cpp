// SPDX-License-Identifier: Apache-2.0
// Settings of plugins' modules: records of a kind of their own, read and set by plugin.settings and
// plugin.set, and kept while their plugin is not there.
#include <algorithm>

#include "ioci/core/commands.h"
#include "ioci/core/modules.h"
#include "model/declare.h"
#include "model/plugin_settings.h"

namespace robomosp::ioci {
namespace {

using model::PluginSettings;
using Param = model::ProviderChoice::Param;

Value value_of(const Param& p) {
  return std::visit(
      [](const auto& v) -> Value {
        if constexpr (std::is_same_v<std::decay_t<decltype(v)>, std::vector<double>>)
          return NumericArray(v);
        else return v;
      },
      p);
}

Result<Param> param_of(const Value& v) {
  if (const bool* b = v.as_bool()) return Param(*b);
  if (const std::int64_t* i = v.as_int()) return Param(*i);
  if (const double* x = v.as_real()) return Param(*x);
  if (const std::string* s = v.as_string()) return Param(*s);
  if (const NumericArray* a = v.as_array()) return Param(a->data());
  return error(ErrorCode::invalid_argument, v.text() + " is not a value of a setting");
}

const PluginSettings* settings_in(const document::Snapshot& snapshot, std::string_view module) {
  const auto id = snapshot.find(settings_kind(), module);
  return id ? &std::get<model::OtherContent>(snapshot.find(*id)->body).as<PluginSettings>()
            : nullptr;
}

Result<const ParamSpec*> setting_named(const LoadedModule& m, std::string_view name) {
  std::vector<std::string> known;
  for (const ParamSpec& s : m.settings) {
    if (s.name == name) return &s;
    known.push_back(s.name);
  }
  if (known.empty())
    return error(ErrorCode::unknown_name, "plugin " + text::quote(m.name) + " has no settings");
  return unknown_name("setting of the plugin " + m.name, name, known);
}

/// Names of all modules that are loaded, and of those that the document has settings of.
std::vector<std::string> known_modules(const CommandContext& ctx) {
  std::vector<std::string> out;
  for (const LoadedModule* m : ctx.app.modules->list()) out.push_back(m->name);
  for (const AnyId id : ctx.snapshot().list(settings_kind()))
    if (const std::string& name = ctx.snapshot().find(id)->name;
        std::find(out.begin(), out.end(), name) == out.end())
      out.push_back(name);
  return out;
}

Result<Value> settings(CommandContext& ctx, const Map& args) {
  std::vector<std::string> names = known_modules(ctx);
  if (const std::string only = text_of(args, "plugin"); !only.empty()) {
    if (std::find(names.begin(), names.end(), only) == names.end())
      return unknown_name("plugin with settings", only, names);
    names = {only};
  }
  List out;
  for (const std::string& name : names) {
    const LoadedModule* m = ctx.app.modules->find(name);
    const PluginSettings* kept = settings_in(ctx.snapshot(), name);
    const auto add = [&](const std::string& setting, const ParamSpec* spec, const Param* given) {
      Map row{{"plugin", name}, {"setting", setting}, {"loaded", m != nullptr}};
      if (given) row.set("value", value_of(*given));
      else if (spec) row.set("value", *spec->default_value);
      row.set("given", given != nullptr);
      if (spec) {
        row.set("default", *spec->default_value);
        row.set("unit", spec->unit);
        row.set("doc", spec->doc);
        row.set("text", describe(*spec));
      }
      out.emplace_back(std::move(row));
    };
    if (m)
      for (const ParamSpec& spec : m->settings) {
        const auto given =
            kept ? kept->of.params.find(spec.name) : decltype(kept->of.params.end()){};
        add(spec.name, &spec, kept && given != kept->of.params.end() ? &given->second : nullptr);
      }
    if (kept)
      for (const auto& [setting, value] : kept->of.params)
        if (!m || !setting_named(*m, setting).ok()) add(setting, nullptr, &value);
  }
  return Value(std::move(out));
}

Result<Value> set(CommandContext& ctx, const Map& args) {
  const std::string name = text_of(args, "plugin");
  const auto id = ctx.snapshot().find(settings_kind(), name);
  const LoadedModule* m = ctx.app.modules->find(name);
  if (!has(args, "setting")) {
    if (has(args, "value"))
      return error(ErrorCode::invalid_argument, "there is a value but no setting",
                   "Give setting = ....", "setting");
    if (id) RMP_TRY(ctx.edit().remove(*id));
    else if (!m) return unknown_name("plugin with settings", name, known_modules(ctx));
    return Value();
  }
  const std::string setting = text_of(args, "setting");
  if (!m) {
    if (!id) return unknown_name("plugin with settings", name, known_modules(ctx));
    return error(
        ErrorCode::unsupported,
        "the plugin " + text::quote(name) + " is not loaded, so its settings cannot be checked",
        "They are kept unchanged until it is.");
  }
  RMP_TRY_ASSIGN(const ParamSpec* spec, setting_named(*m, setting));
  std::optional<Param> value;
  if (has(args, "value")) {
    RMP_TRY_ASSIGN(const Value checked, check_value(*spec, *args.find("value"), setting));
    RMP_TRY_ASSIGN(value, param_of(checked));
  }
  if (!id) {
    if (!value) return Value();
    PluginSettings fresh;
    fresh.of.name = name;
    fresh.of.params[setting] = *value;
    RMP_TRY(ctx.edit().add({name, "", model::OtherContent(settings_kind(), std::move(fresh))}));
    return Value();
  }
  RMP_TRY(ctx.edit().edit(*id, [&](model::Record& r) -> Result<void> {
    auto& params = std::get<model::OtherContent>(r.body).as<PluginSettings>().of.params;
    if (value) params[setting] = *value;
    else params.erase(setting);
    return {};
  }));
  return Value();
}

}  // namespace

Kind settings_kind() {
  static const Kind kind =
      model::register_kind_of<PluginSettings>("settings", ".settings", "settings");
  return kind;
}

Result<Value> setting_of(const document::Snapshot& snapshot, const LoadedModule& m,
                         std::string_view name) {
  RMP_TRY_ASSIGN(const ParamSpec* spec, setting_named(m, name));
  if (const PluginSettings* kept = settings_in(snapshot, m.name))
    if (const auto given = kept->of.params.find(std::string(name));
        given != kept->of.params.end()) {
      auto checked = check_value(*spec, value_of(given->second), name);
      if (!checked.ok())
        return std::move(checked).error().in("settings of the plugin " + text::quote(m.name));
      return checked;
    }
  return *spec->default_value;
}

void Modules::tell_absent(const document::Commit& commit) {
  for (const AnyId id : commit.changed) {
    if (id.kind != settings_kind()) continue;
    const model::Record* r = app_.document.now()->find(id);
    if (!r || find(r->name)) continue;
    app_.messages.post(Severity::warning, "plugin_absent",
                       "The document has settings of the plugin " + text::quote(r->name) +
                           ", which is not loaded; they are kept and saved as they are.",
                       "plugin");
  }
}

RMP_COMMANDS(module_setting_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "plugin.settings",
       .classic = "",
       .summary = "Lists the settings of plugins that are saved with the document.",
       .details = "Settings of a plugin that is not loaded are kept as they were set; only their "
                  "values are known. They are records of kind settings, each with its own file "
                  "(file.save_all, file.load).",
       .example = "for _, s in ipairs(plugin.settings()) do\n  assert(s.plugin ~= \"\")\nend",
       .params = {defaulted("plugin", "string", "", "", "Only settings of this plugin.")},
       .returns = {"list",
                   "",
                   "",
                   {field("plugin", "string", "", "The plugin's module."),
                    field("setting", "string", "", "Name of the setting."),
                    field("loaded", "bool", "", "Whether the plugin is loaded."),
                    field("value", "any", "", "The value in effect: as set, or the default."),
                    field("given", "bool", "", "Whether the document sets the value."),
                    field("default", "any", "", "The value in effect if none is set."),
                    field("unit", "string", "", "SI unit."),
                    field("doc", "string", "", "Its description."),
                    field("text", "string", "", "All of this in one line.")}},
       .effect = Effect::reads,
       .run = settings});
  all.push_back({.name = "plugin.set",
                 .classic = "",
                 .summary = "Sets a setting of a plugin in the document.",
                 .details = "Without a value the setting returns to its default; without a "
                            "setting, all settings of the plugin do, even if it is not loaded.",
                 .example = "local ok, e = pcall(plugin.set, \"no_such_plugin\", \"margin\", 0.1)\n"
                            "assert(not ok)",
                 .params = {needed("plugin", "string", "", "The plugin's module."),
                            optional("setting", "string", "", "Name of the setting."),
                            optional("value", "any", "", "Its value; strings may have units.")},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = set});
  return all;
}

}  // namespace robomosp::ioci
