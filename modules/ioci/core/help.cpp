// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "ioci/core/commands.h"

#ifndef ROBOMOSP_VERSION
#define ROBOMOSP_VERSION "0"
#endif

namespace robomosp::ioci {
namespace {

Result<Value> help(CommandContext& ctx, const Map& args) {
  const CommandTable& table = ctx.app.commands;
  const std::string topic = text_of(args, "topic");
  if (topic.empty()) {
    std::string out =
        "help(\"robot\") lists the commands on robots, help(\"robot.fk\") explains one, "
        "apropos(\"words\") searches.\n\nTopics:";
    std::string last;
    for (const CommandSpec* spec : table.list()) {
      const auto dot = spec->name.find('.');
      const std::string word = dot == std::string::npos ? spec->name : spec->name.substr(0, dot);
      if (word != last) out += " " + word;
      last = word;
    }
    return Value(out + "\n");
  }
  if (const CommandSpec* spec = table.find(topic)) return Value(help_text(*spec));
  const auto blank = topic.find(' ');
  if (const CommandSpec* spec = table.find_classic(
          topic.substr(0, blank), blank == std::string::npos ? "" : topic.substr(blank + 1)))
    return Value(help_text(*spec));
  std::string out;
  for (const CommandSpec* spec : table.list())
    if (spec->name.starts_with(topic + ".")) out += spec->name + ": " + spec->summary + "\n";
  if (out.empty()) return table.unknown(topic);
  return Value(std::move(out));
}

Result<Value> apropos(CommandContext& ctx, const Map& args) {
  List out;
  for (const CommandSpec* spec : ctx.app.commands.apropos(text_of(args, "words")))
    out.emplace_back(Map{{"name", spec->name}, {"summary", spec->summary}});
  return Value(std::move(out));
}

Value describe_params(const std::vector<ParamSpec>& params, bool inputs) {
  List out;
  for (const ParamSpec& p : params) {
    Map m{{"name", p.name}, {"type", p.type}, {"unit", p.unit}, {"doc", p.doc}};
    if (inputs) {
      m.set("required", p.required);
      if (p.default_value) m.set("default", *p.default_value);
      if (std::isfinite(p.min)) m.set("min", p.min);
      if (std::isfinite(p.max)) m.set("max", p.max);
    }
    if (!p.choices.empty()) {
      List choices;
      for (const auto& c : p.choices) choices.emplace_back(c);
      m.set("choices", std::move(choices));
    }
    out.emplace_back(std::move(m));
  }
  return out;
}

List words(Effects effects) {
  List out;
  for (const Effect e : effects.list()) out.emplace_back(to_string(e));
  return out;
}

Result<Value> table(CommandContext& ctx, const Map& args) {
  List out;
  const std::string only = text_of(args, "command");
  for (const CommandSpec* spec : ctx.app.commands.list()) {
    if (!only.empty() && spec->name != only) continue;
    out.emplace_back(
        Map{{"name", spec->name},
            {"classic", spec->classic},
            {"plugin", spec->plugin},
            {"summary", spec->summary},
            {"details", spec->details},
            {"example", spec->example},
            {"effects", words(spec->effect)},
            {"sometimes", words(spec->sometimes)},
            {"params", describe_params(spec->params, true)},
            {"returns", Map{{"type", spec->returns.type},
                            {"unit", spec->returns.unit},
                            {"doc", spec->returns.doc},
                            {"fields", describe_params(spec->returns.fields, false)}}}});
  }
  if (out.empty()) return ctx.app.commands.unknown(only);
  return Value(std::move(out));
}

Result<Value> version(CommandContext&, const Map&) {
  return Value(Map{{"version", ROBOMOSP_VERSION},
                   {"sdk", static_cast<std::int64_t>(RMP_SDK_ABI)},
                   {"abi_tag", RMP_ABI_TAG}});
}

Result<Value> quit(CommandContext& ctx, const Map&) {
  ctx.app.quit_requested = true;
  return Value();
}

}  // namespace

RMP_COMMANDS(help_commands) {
  std::vector<CommandSpec> all;
  all.push_back({.name = "help",
                 .classic = "help",
                 .summary = "Explains a command, or lists those of a topic.",
                 .details = "",
                 .example = "assert(help(\"robot.dh_table\"):find(\"mGetDHP\"))",
                 .params = {defaulted("topic", "string", "", "",
                                      "A command, a classic spelling such as \"PRobot mGetDHP\", "
                                      "or the part before the dot.")},
                 .returns = {"string", "", "Markdown.", {}},
                 .effect = Effect::reads,
                 .run = help});
  all.push_back(
      {.name = "apropos",
       .classic = "apropos",
       .summary = "Lists the commands whose name or summary contains all the words given.",
       .details = "",
       .example = "local found = apropos(\"inverse kinematics\")\nassert(#found >= 2)",
       .params = {needed("words", "string", "", "Words, separated by blanks.")},
       .returns = {"list",
                   "",
                   "",
                   {field("name", "string", "", "The command."),
                    field("summary", "string", "", "What it does.")}},
       .effect = Effect::reads,
       .run = apropos});
  all.push_back(
      {.name = "ioci.describe",
       .classic = "",
       .summary = "Gives the command table as data.",
       .details = "Front ends and editors build their menus and completion from it.",
       .example = "local t = ioci.describe(\"robot.fk\")\nassert(t[1].params[1].name == \"id\")",
       .params = {defaulted("command", "string", "", "", "Only this command.")},
       .returns =
           {"list",
            "",
            "",
            {field("name", "string", "", "The command."),
             field("classic", "string", "",
                   "Lines of the 2006 program that name it, separated by |; in parentheses the "
                   "order of its words where it is not that of the arguments."),
             field("plugin", "string", "", "Whose command it is; empty = the program's."),
             field("summary", "string", "", "One sentence."),
             field("details", "string", "", "More."), field("example", "string", "", "Lua."),
             field("effects", "list", "", "What it does besides returning a value."),
             field("sometimes", "list", "", "What it does with some arguments only."),
             field("params", "list", "",
                   "Name, type, unit, doc, required, default, min, max and choices of each "
                   "argument."),
             field("returns", "map", "", "Type, unit, doc and fields of the result.")}},
       .effect = Effect::reads,
       .run = table});
  all.push_back({.name = "version",
                 .classic = "version",
                 .summary = "Reports the versions of the program and of its plugin interface.",
                 .details = "",
                 .example = "assert(version().version ~= \"\")",
                 .params = {},
                 .returns = {"map",
                             "",
                             "",
                             {field("version", "string", "", "Version of the program."),
                              field("sdk", "int", "", "Revision of the plugin interface."),
                              field("abi_tag", "string", "", "What a plugin must be built with.")}},
                 .effect = Effect::reads,
                 .run = version});
  all.push_back({.name = "quit",
                 .classic = "quit|exit",
                 .summary = "Ends the program once the running script is done.",
                 .details = "",
                 .example = "quit()",
                 .params = {},
                 .returns = {},
                 .effect = Effect::stops,
                 .run = quit});
  return all;
}

}  // namespace robomosp::ioci
