// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <map>
#include <mutex>

#include "ioci/core/commands.h"
#include "ioci/core/example_arguments.h"
#include "ioci/core/result_types.h"
#include "kernel/literal.h"
#include "kernel/type.h"
#include "kernel/type_forms.h"

#ifndef ROBOMOSP_VERSION
#define ROBOMOSP_VERSION "0"
#endif

namespace robomosp::ioci {
namespace {

/// What commands of a file are for; a file that is not here is called by its name.
struct Purpose {
  std::string_view file, words;
};
/// In the order in which help lists them.
constexpr Purpose kPurposes[] = {
    {"record", "find, name, copy, save, remove"},
    {"records", "find, name, copy, save, remove"},
    {"robot", "what it is"},
    {"world", "what it is"},
    {"overview", "what it is"},
    {"links", "links and joints"},
    {"tools", "tools and payloads"},
    {"loops", "closed loops"},
    {"base", "where its base is"},
    {"parameters", "parameters and expressions"},
    {"kinematics", "forward kinematics"},
    {"inverse_kinematics", "inverse kinematics"},
    {"differential_kinematics", "velocities and singularities"},
    {"workspace", "workspace and dexterity"},
    {"dynamics", "dynamics"},
    {"mass", "masses"},
    {"forward_dynamics", "simulation"},
    {"live", "live runs"},
    {"live_runs", "live runs"},
    {"collision", "collision and clearance"},
    {"target", "what a world shows and aims at"},
    {"view", "pictures"},
    {"files", "files"},
    {"import_export", "foreign files"},
    {"code", "code for a controller"},
};

/// The file each command comes from, without folder and ending.
std::map<std::string, std::string> files_of_commands() {
  std::map<std::string, std::string> out;
  for (const auto& [file, make] : CommandFile::all())
    for (const CommandSpec& spec : make())
      out[spec.name] = std::filesystem::path(file).stem().string();
  return out;
}

std::string padded(std::string s, std::size_t width) {
  s.resize(std::max(s.size(), width), ' ');
  return s;
}

/// The commands of a topic; many are grouped by what they are for.
std::string list_of(const std::vector<const CommandSpec*>& specs) {
  constexpr std::size_t kUngrouped = 15;
  std::size_t longest = 0;
  for (const CommandSpec* spec : specs) longest = std::max(longest, spec->name.size());
  const auto line = [longest](const CommandSpec& spec, std::string_view indent) {
    return std::string(indent) + padded(spec.name, longest) + "  " + spec.summary + "\n";
  };
  std::string out;
  if (specs.size() <= kUngrouped) {
    for (const CommandSpec* spec : specs) out += line(*spec, "");
    return out;
  }
  const auto files = files_of_commands();
  std::map<std::pair<std::size_t, std::string>, std::vector<const CommandSpec*>> groups;
  for (const CommandSpec* spec : specs) {
    std::size_t at = std::size(kPurposes);
    std::string words = "of plugin " + spec->plugin;
    if (const auto file = files.find(spec->name); file != files.end()) {
      words = file->second;
      std::replace(words.begin(), words.end(), '_', ' ');
      for (std::size_t i = 0; i < std::size(kPurposes); ++i)
        if (kPurposes[i].file == file->second) {
          words = kPurposes[i].words;
          // Files of one purpose are one group.
          for (at = 0; kPurposes[at].words != words;) ++at;
          break;
        }
    }
    groups[{at, words}].push_back(spec);
  }
  for (const auto& [key, members] : groups) {
    out += (out.empty() ? "" : "\n") + key.second + "\n";
    for (const CommandSpec* spec : members) out += line(*spec, "  ");
  }
  return out;
}

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
  std::vector<const CommandSpec*> found;
  for (const CommandSpec* spec : table.list())
    if (spec->name.starts_with(topic + ".")) found.push_back(spec);
  if (!found.empty()) return Value(list_of(found));
  // A method by its name alone, also as it is typed: ":solve_ik".
  const std::string method = "." + topic.substr(topic.find_last_of(":.") + 1);
  for (const CommandSpec* spec : table.list())
    if (spec->name.ends_with(method)) found.push_back(spec);
  if (found.size() == 1) return Value(help_text(*found.front()));
  if (!found.empty()) return Value(list_of(found));
  Error e = table.unknown(topic);
  std::vector<std::string> names;
  for (const CommandSpec* spec : table.list()) names.push_back(spec->name);
  const bool is_misspelt = !text::did_you_mean(topic, names).empty();
  if (const auto near = table.apropos(topic);
      !near.empty() && !is_misspelt && topic.find('.') == std::string::npos)
    e.hint = "apropos(" + text::quote(topic) + ") finds " + near.front()->name +
             (near.size() > 1 ? " and " + std::to_string(near.size() - 1) + " more." : ".");
  return e;
}

Result<Value> apropos(CommandContext& ctx, const Map& args) {
  List out;
  for (const CommandSpec* spec : ctx.app.commands.apropos(text_of(args, "words")))
    out.emplace_back(Map{{"name", spec->name}, {"summary", spec->summary}});
  return Value(std::move(out));
}

Value describe_params(const std::vector<ParamSpec>& params, bool inputs) {
  List out;
  for (const ParamSpec& p : params) out.emplace_back(param_value(p, inputs));
  return out;
}

std::string_view run_word(RunKind runs) {
  return runs == RunKind::simulation ? "simulation" : runs == RunKind::task ? "task" : "";
}

List effect_words(Effects effects) {
  List out;
  for (const Effect e : effects.list()) out.emplace_back(to_string(e));
  return out;
}

Map description_of(const CommandSpec& spec) {
  Map out{{"name", spec.name},
          {"classic", spec.classic},
          {"plugin", spec.plugin},
          {"summary", spec.summary},
          {"details", spec.details},
          {"example", spec.example},
          {"effects", effect_words(spec.effect)},
          {"sometimes", effect_words(spec.sometimes)},
          {"takes_expressions", spec.takes_expressions},
          {"runs", std::string(run_word(spec.runs))},
          {"params", describe_params(spec.params, true)},
          {"returns", Map{{"type", plain_type(spec.returns.type)},
                          {"declared", spec.returns.type},
                          {"unit", spec.returns.unit},
                          {"doc", spec.returns.doc},
                          {"form", type_value(type_tree(result_type(spec.returns)))},
                          {"fields", describe_params(spec.returns.fields, false)}}}};
  if (const std::string_view text = example_arguments(spec.name); !text.empty())
    if (auto example = read_literal(text); example.ok())
      out.set("example_arguments", std::move(*example));
  return out;
}

/// Descriptions of commands, each made once: specs do not change, and stay where they are.
/// [any thread]
class Descriptions {
 public:
  explicit Descriptions(Application&) {}
  /// Shared with all results that have it: a table of all commands has some 100,000 values.
  Value of(const CommandSpec& spec) {
    const std::lock_guard lock(mutex_);
    const auto [it, is_new] = all_.try_emplace(&spec);
    if (is_new) it->second = std::make_shared<const Map>(description_of(spec));
    return Value(it->second);
  }

 private:
  std::mutex mutex_;
  std::map<const CommandSpec*, std::shared_ptr<const Map>> all_;  // guarded by mutex_
};

Result<Value> table(CommandContext& ctx, const Map& args) {
  const std::string only = text_of(args, "command");
  auto& descriptions = ctx.app.kept<Descriptions>();
  List out;
  if (!only.empty()) {
    const CommandSpec* spec = ctx.app.commands.find(only);
    if (!spec) return ctx.app.commands.unknown(only);
    out.emplace_back(descriptions.of(*spec));
    return Value(std::move(out));
  }
  const auto specs = ctx.app.commands.list();
  out.reserve(specs.size());
  for (const CommandSpec* spec : specs) out.emplace_back(descriptions.of(*spec));
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
  all.push_back(
      {.name = "help",
       .classic = "help",
       .summary = "Explains a command, or lists the commands of a topic.",
       .details = "",
       .example = "assert(help(\"robot.dh_table\"):find(\"mGetDHP\"))",
       .params = {defaulted(
           "topic", "string", "", "",
           "A command, a method by its name alone such as \"solve_ik\", a classic spelling such as "
           "\"PRobot mGetDHP\", or the part of a command before the dot.")},
       .returns = {"string", "", "Markdown.", {}},
       .effect = Effect::reads,
       .run = help});
  all.push_back({.name = "apropos",
                 .classic = "apropos",
                 .summary = "Lists the commands that match all the given words, best match first.",
                 .details = "Names and summaries count most, then the rest of the help. Synonyms "
                            "are found too (\"film\" finds recording.video), and so are beginnings "
                            "of words and misspelled words if no exact match exists.",
                 .example = "assert(#apropos(\"inverse kinematic\") >= 2)\n"
                            "assert(#apropos(\"jacobain\") > 0)",
                 .params = {needed("words", "string", "", "Words, separated by blanks.")},
                 .returns = {"list",
                             "",
                             "",
                             {field("name", "string", "", "The command."),
                              field("summary", "string", "", "Its summary.")}},
                 .effect = Effect::reads,
                 .run = apropos});
  all.push_back(
      {.name = "ioci.describe",
       .classic = "",
       .summary = "Returns the command table as data.",
       .details = "Front ends and editors build their menus and completion from it.",
       .example = "local t = ioci.describe(\"robot.fk\")\nassert(t[1].params[1].name == \"id\")",
       .params = {defaulted("command", "string", "", "", "Only this command.")},
       .returns =
           {"list",
            "",
            "",
            {field("name", "string", "", "The command."),
             field("classic", "string", "",
                   "Lines of the 2006 program that call it, separated by |; in parentheses "
                   "the order of its words if it differs from that of the arguments."),
             field("plugin", "string", "", "Plugin that adds the command; empty = built in."),
             field("summary", "string", "", "One sentence about the command."),
             field("details", "string", "", "More."), field("example", "string", "", "Lua."),
             field("example_arguments", "map", "",
                   "Arguments that the example gives the command, if it gives any."),
             field("effects", "list", "", "Its effects besides returning a value."),
             field("sometimes", "list", "", "Effects that it has with some arguments only."),
             field("takes_expressions", "bool", "",
                   "Whether its numbers may be expressions over parameters."),
             field("runs", "string", "", "simulation or task, if it runs one."),
             field("params", "list<type:parameter_facts>", "",
                   "Each argument: name, type, unit, doc, required; where they apply default, "
                   "min or above, max, infinite, choices, words (choices with descriptions), "
                   "label, group, order, advanced, when (the condition under which it "
                   "counts), step, logarithmic, shown_unit, example, since, deprecated, "
                   "effect, declared (the type in full) and form (the type as nested tables; "
                   "schema.types lists the named ones)."),
             field("returns",
                   "map{type: string; declared: string; unit: string; doc: string; form: map; "
                   "fields: list<type:parameter_facts>}",
                   "",
                   "Type, declared type, unit, doc and fields of the result, and form (the type as "
                   "nested tables).")}},
       .effect = Effect::reads,
       .run = table});
  all.push_back(
      {.name = "version",
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
                    field("abi_tag", "string", "", "The interface a plugin must be built with.")}},
       .effect = Effect::reads,
       .run = version});
  all.push_back({.name = "quit",
                 .classic = "quit|exit",
                 .summary = "Ends the program when the running script has finished.",
                 .details = "",
                 .example = "quit()",
                 .params = {},
                 .returns = {},
                 .effect = Effect::stops,
                 .run = quit});
  return all;
}

}  // namespace robomosp::ioci
