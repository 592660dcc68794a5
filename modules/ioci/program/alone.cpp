// SPDX-License-Identifier: Apache-2.0
// program.run_alone: a program without a world, its texts and outputs.
#include "program/alone.h"

#include <algorithm>
#include <cmath>

#include "ioci/core/commands.h"
#include "ioci/program/alone_inputs.h"
#include "ioci/program/in_world.h"
#include "ioci/program/program_files.h"
#include "model/program_kinds.h"
#include "motion/provider_params.h"

namespace robomosp::ioci {

Result<std::map<std::string, program::SignalValue>> read_inputs(const Value* given,
                                                                std::string_view path) {
  std::map<std::string, program::SignalValue> out;
  if (!given || given->is_nil()) return out;
  const Map* map = given->as_map();
  if (!map)
    return error(ErrorCode::invalid_argument,
                 "values must be a table with the names of inputs as keys",
                 "Give inputs = {part_here = true}.", std::string(path));
  for (const auto& [name, value] : *map) {
    program::SignalValue v;
    if (const bool* b = value.as_bool()) v.real = *b ? 1 : 0;
    else if (value.is_number()) v.real = value.number();
    else
      return error(ErrorCode::invalid_argument,
                   "the input " + text::quote(name) + " cannot be " + value.text(),
                   "Give a number, true or false.", std::string(path));
    if (!(std::fabs(v.real) <= 9.0e18))
      return error(ErrorCode::invalid_argument,
                   "the input " + text::quote(name) + " cannot be " + value.text(),
                   "Give a number within the range of INT.", std::string(path));
    v.integer = static_cast<std::int64_t>(v.real);
    out.emplace(name, v);
  }
  return out;
}

Result<std::vector<std::vector<std::string>>> read_lines(const Value* given,
                                                         const std::vector<std::string>& names,
                                                         std::string_view path) {
  std::vector<std::vector<std::string>> out(names.size());
  if (!given || given->is_nil()) return out;
  const auto texts = [&](const Value& value) -> Result<std::vector<std::string>> {
    const List* list = value.as_list();
    if (!list)
      return error(ErrorCode::invalid_argument,
                   "lines must be a list of texts, not " + value.text(),
                   "Give lines = {\"12\", \"yes\"}.", std::string(path));
    std::vector<std::string> all;
    for (const Value& one : *list) {
      all.push_back(one.as_string() ? *one.as_string() : one.text());
      if (all.back().find('\n') != std::string::npos)
        return error(ErrorCode::invalid_argument,
                     "line " + std::to_string(all.size()) + " has an end of line in it",
                     "Give each line as a separate text.", std::string(path));
    }
    return all;
  };
  // An empty table is an empty list of lines.
  if (const Map* map = given->as_map(); map && !map->empty()) {
    for (const auto& [name, value] : *map) {
      const auto at = std::find(names.begin(), names.end(), name);
      if (at == names.end()) return unknown_name("program", name, names);
      RMP_TRY_ASSIGN(out[static_cast<std::size_t>(at - names.begin())], texts(value));
    }
    return out;
  }
  if (const List* list = given->as_list(); given->as_map() || (list && list->empty())) return out;
  if (names.size() != 1)
    return error(ErrorCode::invalid_argument,
                 "lines are for one program, but " + std::to_string(names.size()) + " run",
                 "Give them by name: lines = {program_name = {...}}.", std::string(path));
  RMP_TRY_ASSIGN(out.front(), texts(*given));
  return out;
}

ParamSpec lines_field() {
  return optional("lines", "any", "",
                  "Input lines for READ, in order: a list for the only program, or a table of "
                  "lists by the names of programs. When they are used up, a live run waits for "
                  "run.input, and other runs end with an error.");
}

Result<std::shared_ptr<const CompiledProgram>> compile_now(Application& app, const Handle& handle,
                                                           Progress& progress) {
  const auto now = app.document.now();
  const model::Program* p = program_in(*now, AnyId{program_kind(), handle.number});
  if (!p) return error(ErrorCode::stale_handle, "the program no longer exists");
  RMP_TRY_ASSIGN(const ProviderInfo info, app.registry.find(Language::kInterfaceId, p->language));
  RMP_TRY_ASSIGN(const auto language, app.registry.create<Language>(info.name));
  model::ProviderChoice choice;
  choice.name = info.name;
  RMP_TRY_ASSIGN(const auto params,
                 motion::checked_params(info, choice, "provider " + text::quote(info.name)));
  std::vector<std::string> texts;
  for (const model::ProgramFile& f : p->files) texts.push_back(text_of_file(f));
  std::vector<SourceFile> files;
  for (std::size_t i = 0; i < texts.size(); ++i) files.push_back({p->files[i].name, texts[i], {}});
  LanguageTask task;
  task.files = files;
  RMP_TRY_ASSIGN(auto made, language->compile(task, *params, progress));
  if (made->code().has_errors)
    return error(ErrorCode::syntax, "the program has errors", "program.check lists them.");
  return std::shared_ptr<const CompiledProgram>(std::move(made));
}

namespace {

/// What the program writes is kept, and what it asks for was given before.
class Collector final : public program::Operator {
 public:
  Collector(std::vector<std::string> lines, std::size_t most)
      : lines_(std::move(lines)), most_(most) {}
  Result<void> says(std::string_view piece) override {
    if (text.size() + piece.size() > most_)
      return error(ErrorCode::unsupported,
                   "the program has written more than " + std::to_string(most_) + " bytes",
                   "Make it write less, or run it with `robomosp irl`, which has no such limit.");
    text += piece;
    return {};
  }
  Result<std::string> line() override {
    if (at_ < lines_.size()) return lines_[at_++];
    return error(ErrorCode::not_found,
                 "READ needs line " + std::to_string(at_ + 1) + ", and " +
                     std::to_string(lines_.size()) + " were given",
                 "Give more lines.");
  }
  Result<void> pause(std::string_view) override { return {}; }
  Result<void> time(double) override { return {}; }
  Result<void> does(double now, const std::string& file, std::uint32_t line,
                    const std::string& what) override {
    constexpr std::size_t kMost = 100'000;
    if (trace.size() >= kMost)
      return error(ErrorCode::unsupported,
                   "the program has executed more than " + std::to_string(kMost) + " actions",
                   "Run it without trace, or with `robomosp irl --trace`.");
    trace.emplace_back(Map{
        {"time", now}, {"file", file}, {"line", static_cast<std::int64_t>(line)}, {"what", what}});
    return {};
  }
  Result<std::string> read_file(std::string_view name) override { return no_files(name); }
  Result<void> write_file(std::string_view name, std::string_view, bool) override {
    return no_files(name);
  }
  std::string text;
  List trace;

 private:
  static Error no_files(std::string_view name) {
    return error(ErrorCode::unsupported,
                 "the program opens the file " + text::quote(std::string(name)),
                 "Run it with `robomosp irl`, which uses the files of its folder.");
  }
  const std::vector<std::string> lines_;
  const std::size_t most_;
  std::size_t at_ = 0;
};

Result<Value> run_alone(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  RMP_TRY_ASSIGN(const auto code, compile_program(ctx, id));
  program::AloneOptions options;
  RMP_TRY_ASSIGN(options.inputs, read_inputs(args.find("inputs"), "inputs"));
  RMP_TRY_ASSIGN(options.values, read_presets(args.find("values"), "values"));
  options.is_traced = flag(args, "trace");
  options.limits.most_instructions = static_cast<std::uint64_t>(integer(args, "most_instructions"));
  std::vector<std::string> lines;
  if (const Value* given = args.find("lines"); given && given->as_list())
    for (const Value& one : *given->as_list())
      lines.push_back(one.as_string() ? *one.as_string() : one.text());
  constexpr std::size_t kMostText = std::size_t{16} << 20;
  Collector user(std::move(lines), kMostText);
  auto ended = program::run_alone(code, options, user, ctx.progress);
  if (!ended.ok()) return named_once(std::move(ended).error(), name_in(ctx, id));
  Map outputs;
  for (const auto& [name, value] : ended->outputs) outputs.append(name, value);
  Map out{{"text", std::move(user.text)},
          {"is_halted", ended->is_halted},
          {"time", ended->time},
          {"motions", static_cast<std::int64_t>(ended->motions)},
          {"instructions", static_cast<std::int64_t>(ended->instructions)},
          {"outputs", std::move(outputs)}};
  if (options.is_traced) out.set("trace", std::move(user.trace));
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(program_alone_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "program.run_alone",
       .classic = "",
       .summary = "Runs a program without a world, and returns its output and its signals.",
       .details = "Motions take no time and reach their targets, waits end at once, PAUSE "
                  "continues. Inputs have the given values; reading an input without a value is an "
                  "error, and so is any use of a robot. program.run runs it with one.",
       .example = "local twice = program.create{name = \"twice\", source = [[\n"
                  "PROGRAM twice;\n"
                  "VAR\n"
                  "  INT: n := 2;\n"
                  "BEGIN\n"
                  "  WRITELN(n * 2);\n"
                  "ENDPROGRAM;\n"
                  "]]}\n"
                  "assert(twice:run_alone().text == \"4\\n\")\n"
                  "assert(twice:run_alone{values = {n = 5}}.text == \"10\\n\")",
       .params = {self("program"),
                  optional("inputs", "map", "", "Values of inputs, by their names."),
                  values_field(), optional("lines", "list", "", "Input lines for READ, in order."),
                  defaulted("trace", "bool", "", false, "Also return a trace of its steps."),
                  between(defaulted("most_instructions", "int", "", 2'000'000'000,
                                    "Limit: a program that takes more is an error."),
                          1, 9e15)},
       .returns = {"map",
                   "",
                   "A summary of the run.",
                   {field("text", "string", "", "Its output."),
                    field("is_halted", "bool", "", "Whether HALT ended the run."),
                    field("time", "real", "s", "Total time of its waits."),
                    field("motions", "int", "", "Number of motions begun."),
                    field("instructions", "int", "", "Number of instructions executed."),
                    field("outputs", "map", "", "The last values of its outputs."),
                    field("trace", "list", "",
                          "The trace, if requested: time, file, line, and action.")}},
       .effect = Effect::reads,
       .run = run_alone});
  return all;
}

}  // namespace robomosp::ioci
