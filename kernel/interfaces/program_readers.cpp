// SPDX-License-Identifier: Apache-2.0
// Guard of readers of programs: what one hands over is looked at before anybody follows its
// numbers.
#include <cctype>
#include <memory>
#include <mutex>
#include <string>

#include <robomosp/sdk/program_reader.h>

#include "kernel/interface_file.h"
#include "kernel/provider_guard.h"
#include "kernel/text.h"
#include "kernel/utf8.h"

namespace robomosp {
namespace {

std::uint64_t lines_of(std::string_view text) {
  std::uint64_t n = 1;
  for (const char c : text) n += c == '\n';
  return n;
}

/// What is wrong with what a reader made; "" = nothing.
std::string fault_of(const ReadProgram& made, const ProgramReaderTask& task) {
  const auto files = made.files();
  if (files.empty()) return "made no file";
  if (files.size() > 1000) return "made more than 1000 files";
  std::vector<std::uint64_t> made_lines, read_lines;
  for (const ReadFile& f : files) {
    if (f.name.empty() || f.name == "." || f.name == ".." ||
        f.name.find_first_of(std::string_view("/\\\0", 3)) != std::string_view::npos)
      return "made a file with an invalid name";
    if (text::first_bad_byte(f.name) != std::string_view::npos ||
        text::first_bad_byte(f.text) != std::string_view::npos)
      return "made a text that is not UTF-8";
    made_lines.push_back(lines_of(f.text));
  }
  for (std::size_t i = 0; i < files.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (files[i].name == files[k].name) return "made two files with the same name";
  for (const SourceFile& f : task.files) read_lines.push_back(lines_of(f.text));
  for (const rmp_code_fault& f : made.faults()) {
    if (!f.message || !f.hint || text::first_bad_byte(f.message) != std::string_view::npos ||
        text::first_bad_byte(f.hint) != std::string_view::npos)
      return "made a fault without a message";
    if (f.severity > RMP_FAULT_NOTE || f.span.file >= read_lines.size() || f.span.line == 0 ||
        f.span.line > read_lines[f.span.file] || f.span.begin > f.span.end ||
        f.span.end > task.files[f.span.file].text.size())
      return "made a fault with an invalid position";
  }
  const ReadLine* last = nullptr;
  for (const ReadLine& l : made.lines()) {
    if (l.irl_file >= made_lines.size() || l.irl_line == 0 || l.irl_line > made_lines[l.irl_file] ||
        l.file >= read_lines.size() || l.line == 0 || l.line > read_lines[l.file])
      return "made a line without an origin";
    if (last && (l.irl_file < last->irl_file ||
                 (l.irl_file == last->irl_file && l.irl_line < last->irl_line)))
      return "made lines that are not in order";
    last = &l;
  }
  return {};
}

class GuardedProgramReader final : public ProgramReader {
 public:
  GuardedProgramReader(const ProviderInfo& info, ProgramReader* inner)
      : name_(info.name), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  /// Rows that are no extension are left out.
  [[nodiscard]] std::span<const ReaderFormat> formats() const override {
    std::call_once(asked_, [&] {
      for (const ReaderFormat& f : inner_->formats()) {
        bool good = f.extension && f.controller && *f.extension;
        for (const char* c = f.extension; good && *c; ++c)
          good = (*c >= 'a' && *c <= 'z') || (*c >= '0' && *c <= '9');
        if (good) formats_.push_back(f);
      }
    });
    return formats_;
  }
  [[nodiscard]] std::int32_t claims(const SourceFile& file) const override {
    return inner_->claims(file);
  }
  Result<std::vector<std::string>> needs(const SourceFile& file) const override {
    return asked(name_, [&] { return inner_->needs(file); });
  }
  Result<std::unique_ptr<ReadProgram>> read(const ProgramReaderTask& task, const Params& params,
                                            Progress& told) const override {
    if (task.files.empty())
      return error(ErrorCode::invalid_argument, "there is no file to read", {},
                   "provider \"" + name_ + "\"");
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto made, asked(name_, [&] { return inner_->read(task, params, progress); }));
    if (!made) return broken_answer(name_, "made no program");
    const std::string fault = fault_of(*made, task);
    if (!fault.empty()) return broken_answer(name_, fault);
    return made;
  }

 private:
  std::string name_;
  std::unique_ptr<ProgramReader> inner_;
  mutable std::once_flag asked_;
  mutable std::vector<ReaderFormat> formats_;
};

}  // namespace

RMP_INTERFACES(program_readers, guarded_interface<ProgramReader, GuardedProgramReader>());

}  // namespace robomosp
