// SPDX-License-Identifier: Apache-2.0
#include "program_source/compile.h"

#include <cstdint>
#include <optional>
#include <utility>

#include <robomosp/sdk/program_tables.h>

#include "kernel/text.h"
#include "motion/provider_params.h"
#include "program_source/bound_values.h"
#include "program_source/text_faults.h"

namespace robomosp::program_source {
namespace {

/// What the program's variables begin with, as its bindings say; none where they say nothing.
Result<std::vector<BoundValue>> values_of(const Workshop& with,
                                          std::span<const ProgramPlace> places,
                                          const rmp_code& plain) {
  std::vector<BoundValue> out;
  std::optional<ProgramPlace> first;
  for (const ProgramPlace& x : places) {
    if (!gives_values(*x.placed)) continue;
    RMP_TRY_ASSIGN(auto values, bound_values(with, x, plain));
    if (!first) {
      first = x, out = std::move(values);
    } else if (values != out) {
      return error(ErrorCode::invalid_argument,
                   "the points of the program differ as " + describe(with.snapshot(), *first) +
                       " and as " + describe(with.snapshot(), x),
                   "Give world or name_there, or remove the program from all placements but one.");
    }
  }
  return out;
}

}  // namespace

Result<Compiled> compile(const Workshop& with, AnyId id, std::span<const ProgramPlace> places,
                         const std::string* text) {
  const model::Program& p = *program_in(with.snapshot(), id);
  const std::string where = with.snapshot().describe(id);
  if (p.files.empty())
    return error(ErrorCode::invalid_argument, "it has no source", "Set it with program.set_file.",
                 where);
  RMP_TRY_ASSIGN(const ProviderInfo info,
                 with.from.registry.find(Language::kInterfaceId, p.language));
  RMP_TRY_ASSIGN(const auto language, with.from.registry.create<Language>(info.name));
  model::ProviderChoice choice;
  choice.name = info.name;
  RMP_TRY_ASSIGN(const auto params,
                 motion::checked_params(info, choice, "provider " + text::quote(info.name)));
  Compiled out;
  for (const model::ProgramFile& f : p.files) out.texts.push_back(text_of_file(f));
  if (text) out.texts.front() = *text;
  std::vector<SourceFile> files;
  for (std::size_t i = 0; i < p.files.size(); ++i)
    files.push_back({p.files[i].name, out.texts[i], {}});
  LanguageTask task;
  task.files = files;
  auto made = language->compile(task, *params, with.progress);
  if (!made.ok()) return named_once(std::move(made).error(), where);
  out.program = std::move(made).value();
  if (out.code().has_errors) return out;
  auto found = values_of(with, places, out.code());
  if (!found.ok()) return named_once(std::move(found).error(), where);  // bindings know it
  if (found->empty()) return out;
  if (!language->extension(kGivenValues))
    return error(ErrorCode::unsupported,
                 "the language " + text::quote(info.name) +
                     " does not support values from outside the program",
                 "Remove the bindings of points and values: program.unbind.", where);
  std::vector<GivenValue> values;
  for (const BoundValue& v : *found) values.push_back({v.name, v.field, v.text, {}});
  task.values = values;
  made = language->compile(task, *params, with.progress);
  if (!made.ok()) return named_once(std::move(made).error(), where);
  out.program = std::move(made).value();
  return out;
}

Result<Compiled> compile_whole(const Workshop& with, AnyId id, std::span<const ProgramPlace> places,
                               const std::string* text) {
  RMP_TRY_ASSIGN(Compiled out, compile(with, id, places, text));
  const rmp_code& c = out.code();
  if (!c.has_errors) return out;
  std::uint32_t errors = 0;
  const rmp_code_fault* first = nullptr;
  for (std::uint32_t i = 0; i < c.faults.count; ++i) {
    const auto& f = row<rmp_code_fault>(c.faults, i);
    if (f.severity != RMP_FAULT_ERROR) continue;
    if (errors++ == 0) first = &f;
  }
  std::string hint = first->hint;
  if (errors > 1)
    hint += (hint.empty() ? "" : " ") + std::string("program.check lists all ") +
            std::to_string(errors) + " errors.";
  const std::string where = with.snapshot().describe(id);
  // Positions in a text that replaces the file are not those of the record.
  const FaultyText in =
      text ? FaultyText{.where = where} : FaultyText{id, program_in(with.snapshot(), id), where};
  std::vector<Fault> faults = source_faults(in, c);
  std::erase_if(faults, [](const Fault& f) { return f.severity != Severity::error; });
  return with_faults(
      error(ErrorCode::syntax, first->message, hint,
            where + ", " + row<rmp_code_file>(c.files, first->span.file).name + ":" +
                std::to_string(first->span.line) + ":" + std::to_string(first->span.column)),
      faults);
}

Result<std::shared_ptr<const CompiledProgram>> compile_program(const Workshop& with, AnyId id,
                                                               const ProgramPlace* place) {
  const auto places = place ? std::vector{*place} : places_of(with.snapshot(), id);
  RMP_TRY_ASSIGN(Compiled made, compile_whole(with, id, places));
  return std::shared_ptr<const CompiledProgram>(std::move(made.program));
}

}  // namespace robomosp::program_source
