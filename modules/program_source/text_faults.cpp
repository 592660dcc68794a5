// SPDX-License-Identifier: Apache-2.0
#include "program_source/text_faults.h"

#include <algorithm>

#include <robomosp/sdk/program_tables.h>

#include "model/handle.h"
#include "program_source/place.h"

namespace robomosp::program_source {
namespace {

const FaultCodes kTextCodes{
    {"program.syntax", ErrorCode::syntax, "A program does not compile."},
    {"program.not_read", ErrorCode::unsupported,
     "A statement of a controller's program has no counterpart in IRL."},
    {"program.not_posted", ErrorCode::unsupported,
     "A statement cannot be written in the language of a controller."},
    {"program.posted_otherwise", ErrorCode::unsupported,
     "A post writes a statement in another form, or reports what the controller must have."},
};

/// Files that are copied into a remedy.
constexpr std::size_t kMostCopiedText = 64U << 10;

Severity severity_of(std::uint32_t severity) {
  return severity == RMP_FAULT_ERROR     ? Severity::error
         : severity == RMP_FAULT_WARNING ? Severity::warning
                                         : Severity::info;
}

/// The word after "Did you mean", without quotes; "" = the hint is another one.
std::string meant_word(std::string_view hint) {
  constexpr std::string_view kBegin = "Did you mean ";
  if (!hint.starts_with(kBegin)) return {};
  std::string_view word = hint.substr(kBegin.size());
  word = word.substr(0, word.find('?'));
  if (word.size() > 2 && word.front() == '"' && word.back() == '"')
    word = word.substr(1, word.size() - 2);
  const bool is_word = !word.empty() && word.find_first_of(" \"'()") == std::string_view::npos;
  return is_word ? std::string(word) : std::string();
}

void offer_word(Fault& f, const FaultyText& in, const TextFault& found) {
  const std::string word = meant_word(found.hint);
  if (word.empty() || !in.program || found.span.end <= found.span.begin) return;
  const auto file = std::find_if(in.program->files.begin(), in.program->files.end(),
                                 [&](const model::ProgramFile& g) { return g.name == found.file; });
  if (file == in.program->files.end()) return;
  std::string text = text_of_file(*file);
  if (found.span.end > text.size() || text.size() > kMostCopiedText) return;
  const std::string old = text.substr(found.span.begin, found.span.end - found.span.begin);
  if (old.find_first_of(" \n") != std::string::npos) return;  // more than the word
  text.replace(found.span.begin, old.size(), word);
  FaultRemedy r;
  r.label = "Write " + word + " instead of " + old;
  r.command = "program.set_file";
  r.args = {{"id", model::handle(in.record)}, {"name", found.file}, {"text", text}};
  r.untried = kUntriedByList;
  f.remedies.push_back(std::move(r));
}

}  // namespace

std::string line_path(const model::Program& program, std::string_view file, std::uint32_t line) {
  for (std::size_t i = 0; i < program.files.size(); ++i)
    if (program.files[i].name == file && line > 0 && line <= program.files[i].lines.size())
      return "files." + std::to_string(i + 1) + ".lines[" + std::to_string(line) + "]";
  return {};
}

Fault text_fault(const char* code, const FaultyText& in, const TextFault& found) {
  const std::string place =
      found.file + ":" + std::to_string(found.span.line) + ":" + std::to_string(found.span.column);
  std::string message = found.message;
  if (message.ends_with('.')) message.pop_back();
  Fault f = make_fault(code, std::move(message), found.hint,
                       in.where.empty() ? place : in.where + ", " + place);
  f.severity = severity_of(found.severity);
  FaultSubject& s = f.subject;
  if (in.program) {
    s.record = model::handle(in.record);
    s.name = in.name;
    s.path = line_path(*in.program, found.file, found.span.line);
  }
  s.provider = in.provider;
  s.interface_id = in.interface_id;
  s.file = found.file;
  s.line = s.end_line = found.span.line;
  s.column = found.span.column;
  s.end_column = found.span.column + (found.span.end - found.span.begin);
  offer_word(f, in, found);
  return f;
}

std::vector<Fault> source_faults(const FaultyText& in, const rmp_code& code) {
  std::vector<Fault> out;
  for (std::uint32_t i = 0; i < code.faults.count; ++i) {
    const auto& f = row<rmp_code_fault>(code.faults, i);
    out.push_back(text_fault(
        "program.syntax", in,
        {f.severity, f.span,
         f.span.file < code.files.count ? row<rmp_code_file>(code.files, f.span.file).name : "",
         f.message, f.hint}));
  }
  return out;
}

Error with_faults(Error e, const std::vector<Fault>& faults) {
  List all;
  for (const Fault& f : faults) all.emplace_back(fault_map(f));
  adopt_faults(e, Value(std::move(all)));
  return e;
}

}  // namespace robomosp::program_source
