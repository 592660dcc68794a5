// SPDX-License-Identifier: Apache-2.0
// What forms are drawn from: choices, a form as text, JSON Schema, types with names.
#include "ioci/core/commands.h"
#include "ioci/core/interface_words.h"
#include "ioci/schema/choices.h"
#include "kernel/known_provider.h"
#include "kernel/type.h"
#include "kernel/type_forms.h"
#include "model/field_types.h"

namespace robomosp::ioci {
namespace {

/// What a form is of: a command, the parameters of a provider, or a kind of record.
struct FormOf {
  std::string name, doc;
  Schema fields;
  bool loads = false;  ///< records of the library by their names
};

Result<FormOf> form_of(CommandContext& ctx, const Map& args) {
  const std::string command = text_of(args, "command"), interface = text_of(args, "interface");
  if (!command.empty()) {
    const CommandSpec* spec = ctx.app.commands.find(command);
    if (!spec) return ctx.app.commands.unknown(command);
    return FormOf{spec->name, spec->summary, spec->params, spec->effect.has(Effect::edits)};
  }
  if (const std::string word = text_of(args, "kind"); !word.empty()) {
    const auto kind = kind_from(word);
    if (!kind) {
      std::vector<std::string> known;
      for (const Kind k : all_kinds()) known.emplace_back(to_string(k));
      return unknown_name("kind of record", word, known);
    }
    return FormOf{word, "A record.", model::record_fields(model::info(*kind))};
  }
  if (interface.empty())
    return error(ErrorCode::invalid_argument, "no command, kind of record or provider is given",
                 "Give command = \"robot.fk\", kind = \"robot\", or interface = \"ik\" and "
                 "provider = \"numeric\".",
                 "command");
  RMP_TRY_ASSIGN(const std::string id, interface_of_word(interface));
  RMP_TRY_ASSIGN(const ProviderInfo info,
                 known_provider(ctx.app.registry, id, text_of(args, "provider")));
  return FormOf{info.interface_id + " " + info.name, info.summary, info.schema};
}

Map given_of(const Map& args) {
  const Value* given = args.find("given");
  return given && given->as_map() ? *given->as_map() : Map();
}

Result<Value> run_choices(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const FormOf form, form_of(ctx, args));
  RMP_TRY_ASSIGN(auto found, choices_of(ctx, form.fields, text_of(args, "argument"), given_of(args),
                                        text_of(args, "prefix"), form.loads,
                                        static_cast<std::size_t>(integer(args, "at_most"))));
  List out;
  out.reserve(found.size());
  for (Choice& c : found) {
    std::string label = std::move(c.label);
    if (label.empty()) label = c.value.as_string() ? *c.value.as_string() : c.value.text();
    Map one;
    one.append("value", std::move(c.value));
    one.append("label", Value(std::move(label)));
    if (!c.doc.empty()) one.append("doc", Value(std::move(c.doc)));
    if (!c.why_not.empty()) one.append("why_not", Value(std::move(c.why_not)));
    out.emplace_back(std::move(one));
  }
  return Value(std::move(out));
}

Result<Value> run_form(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const FormOf form, form_of(ctx, args));
  return Value(form.name + ": " + form.doc + "\n" + form_text(form.fields, given_of(args)));
}

Result<Value> run_json(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const FormOf form, form_of(ctx, args));
  return Value(json_schema(form.fields, form.name, form.doc));
}

Result<Value> run_misfit(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const FormOf form, form_of(ctx, args));
  return Value(misfit(form.fields, given_of(args)));
}

Result<Value> run_types(CommandContext&, const Map&) {
  List out;
  for (const std::string& name : named_types()) {
    const TypeTree& t = *named_type(name);
    out.emplace_back(Map{{"name", name}, {"declared", type_text(t)}, {"form", type_value(t)}});
  }
  return Value(std::move(out));
}

std::vector<ParamSpec> form_params() {
  return {optional("command", "string", "", "The command that the form is of."),
          optional("kind", "string", "", "Or the kind of record."),
          optional("interface", "string", "", "Or the interface of a provider, such as \"ik\"."),
          noted(optional("provider", "string", "", "The provider; the default one if left out."),
                "@when(interface is present)")};
}

std::vector<ParamSpec> with_form(std::vector<ParamSpec> more) {
  std::vector<ParamSpec> out = form_params();
  for (ParamSpec& p : more) out.push_back(std::move(p));
  return out;
}

}  // namespace

RMP_COMMANDS(schema_commands) {
  const ParamSpec given =
      optional("given", "map", "", "The arguments that are given so far, by name.");
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "schema.choices",
       .classic = "",
       .summary = "Lists the values that can be given for an argument now.",
       .details =
           "The arguments given so far decide: links are those of the robot that `id` names, tips "
           "those of the robot `robot` of the world `id`. While none of them decides, members of "
           "all records in the document are listed. Of commands that edit, records of the "
           "library follow those of the document. Records, members, providers, words, files and "
           "units have choices; free texts and numbers have none. A form and the completion of the "
           "console use this command.",
       .example = with_arm("local links = schema.choices{command = \"robot.link\", argument = "
                           "\"link\", given = {id = \"arm\"}}\nassert(#links == 6)\n"
                           "local base = schema.choices{command = \"robot.add_tool\", argument = "
                           "\"link\", given = {id = \"arm\"}, prefix = \"b\"}\n"
                           "assert(base[1].value == \"base\")"),
       .params = with_form(
           {needed("argument", "string", "",
                   "The argument, or a part of it such as \"step.robot\" or \"links[2].parent\"."),
            given, defaulted("prefix", "string", "", "", "Only those that begin so."),
            between(defaulted("at_most", "int", "", 1000,
                              "Choices to list; a prefix leads to the others."),
                    1, 10000)}),
       .returns = {"list",
                   "",
                   "",
                   {field("value", "any", "", "What to give."),
                    field("label", "string", "",
                          "Text to show for the value: the label of a word, else the value."),
                    field("doc", "string", "", "One sentence, if there is one."),
                    field("why_not", "string", "",
                          "Why the command would reject it now, if it would.")}},
       .effect = Effect::reads,
       .sometimes = Effect::files_read,
       .run = run_choices});
  all.push_back(
      {.name = "schema.form",
       .classic = "",
       .summary = "Shows the arguments of a command as a form of plain text.",
       .details = "Headings are groups, * marks what must be given, and fields that do not matter "
                  "for the given values are left out.",
       .example = "local form = schema.form{command = \"robot.create\", given = {name = \"arm\"}}\n"
                  "assert(form:find(\"* name: string = \\\"arm\\\"\", 1, true))",
       .params = with_form({given}),
       .returns = {"string", "", "The form.", {}},
       .effect = Effect::reads,
       .run = run_form});
  all.push_back(
      {.name = "schema.json",
       .classic = "",
       .summary = "Exports the arguments of a command as JSON Schema (draft 2020-12).",
       .details = "Members that begin with x- hold what JSON Schema cannot express: x-unit, "
                  "x-record, x-member with x-of, x-provider, x-when.",
       .example = "local s = schema.json{command = \"robot.fk\"}\nassert(s.required[1] == \"id\")\n"
                  "assert(s.properties.tip[\"x-member\"] == \"tip\")",
       .params = form_params(),
       .returns = {"map", "", "The schema.", {}},
       .effect = Effect::reads,
       .run = run_json});
  all.push_back(
      {.name = "schema.misfit",
       .classic = "",
       .summary = "Checks the form of arguments without running the command.",
       .details = "Names, records and files are not looked up; the command does that.",
       .example = "assert(schema.misfit{command = \"robot.fk\", given = {id = \"arm\", q = {0}}} "
                  "== \"\")\nassert(schema.misfit{command = \"robot.fk\", given = {q = {0}}} == "
                  "\"id: no value is given; a robot is required\")",
       .params = with_form({given}),
       .returns =
           {"string", "", "What does not fit, with its place; empty if everything does.", {}},
       .effect = Effect::reads,
       .run = run_misfit});
  all.push_back({.name = "schema.types",
                 .classic = "",
                 .summary = "Lists the types with names that arguments refer to.",
                 .details = "In `ioci.describe` and here, a form {kind = \"named\", name = "
                            "\"step\"} means the type of that name.",
                 .example = "local found\nfor _, t in ipairs(schema.types()) do\n"
                            "  if t.name == \"step\" then found = t end\nend\n"
                            "assert(found.form.decided_by == \"step\")",
                 .params = {},
                 .returns = {"list",
                             "",
                             "",
                             {field("name", "string", "", "Its name."),
                              field("declared", "string", "", "Its text."),
                              field("form", "map", "", "The type as nested tables.")}},
                 .effect = Effect::reads,
                 .run = run_types});
  return all;
}

}  // namespace robomosp::ioci
