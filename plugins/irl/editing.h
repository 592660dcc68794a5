// SPDX-License-Identifier: Apache-2.0
// A program as an editor has it: read once, asked often (layer: data processing, plugin irl).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/language_editing.h>
#include <robomosp/sdk/program_tables.h>

#include "checker.h"

namespace robomosp::irl {

/// What lies between two tokens.
enum class Gap : std::uint8_t { blanks, comment, unknown };
/// Takes [from, to) apart, which holds no tokens.
void each_gap(std::string_view text, std::uint32_t from, std::uint32_t to,
              const std::function<void(Gap, std::uint32_t, std::uint32_t)>& tell);

/// A program that was read and checked, whatever is wrong with it.
class Analysis {
 public:
  using Id = std::uint32_t;
  /// `files` stay while this is there; the first is the program.
  Analysis(std::span<const SourceFile> files, Depth depth);
  Analysis(const Analysis&) = delete;
  Analysis& operator=(const Analysis&) = delete;
  /// False = cancelled.
  bool run(Progress& progress);

  /// A file of the task as it was read; nullptr = the program names it nowhere.
  [[nodiscard]] const Source* source(Id task_file) const;
  /// Number among the files of the task of one of the compiler's; kNone = it is of the language.
  [[nodiscard]] Id task_file(Id compiled) const {
    return compiled < task_files_.size() ? task_files_[compiled] : kNone;
  }
  /// Names of a file in order, each once.
  [[nodiscard]] const std::vector<Use>& uses(Id task_file) const { return uses_[task_file]; }
  /// The name at a place, or that ends there; nullptr = none that is known.
  [[nodiscard]] const Use* use_at(Id task_file, Id at) const;
  [[nodiscard]] const Use* use_from(Id task_file, Id begin) const;

  [[nodiscard]] SourceTokenKind kind(const Use& use) const;
  /// Its declaration in a line.
  [[nodiscard]] std::string detail(const Use& use) const;
  /// The comment beside its declaration, or what the language says of it.
  [[nodiscard]] std::string doc(const Use& use) const;
  /// Where it is declared; file kNone = in none of the task.
  [[nodiscard]] SourceRange declared(const Use& use) const;
  [[nodiscard]] bool is_predefined(const Use& use) const;

  /// Scope that the names of a file are in, outside of its routines.
  [[nodiscard]] Id scope_of(Id task_file) const;
  /// kNone = nobody has it.
  [[nodiscard]] Id lookup(Id scope, std::string_view name) const;
  [[nodiscard]] std::string type_name(Id type) const { return checker_->shown_type(type); }
  /// Text of a parameter of an intrinsic (intrinsics.h).
  [[nodiscard]] static std::string parameter_name(char letter);
  [[nodiscard]] std::string parameter_text(Id symbol) const;

  ProgramTables out;
  Names names;
  Faults faults;
  [[nodiscard]] const Checker& checker() const { return *checker_; }

 private:
  [[nodiscard]] std::string value_text(Id expression) const;
  [[nodiscard]] std::string comment_beside(const rmp_span& span) const;

  std::span<const SourceFile> files_;
  std::unique_ptr<Checker> checker_;
  Depth depth_ = Depth::all;
  std::vector<Use> raw_;
  std::vector<std::vector<Use>> uses_;  ///< by file of the task
  std::vector<Id> task_files_;          ///< by file of the compiler
  std::vector<const Source*> sources_;  ///< by file of the task
};

/// A motion's attribute, for editors.
struct AttributeWord {
  std::string_view name, detail, doc;
};
[[nodiscard]] std::span<const AttributeWord> attribute_words();
/// A sentence about a word of the language; "" = none.
[[nodiscard]] std::string_view word_doc(std::string_view upper);
/// Words that mean something in their place only, such as SEC.
[[nodiscard]] bool is_word_of_place(std::string_view upper);

/// Items for a place of a file (complete.cpp).
[[nodiscard]] std::vector<SourceCompletion> complete(const Analysis& a,
                                                     std::span<const SourceFile> files,
                                                     std::uint32_t file, std::uint32_t at);
[[nodiscard]] SourceSignature signature(const Analysis& a, std::uint32_t file, std::uint32_t at);
/// The usual layout (layout.cpp).
[[nodiscard]] Result<std::string> lay_out(std::string_view name, std::string_view text,
                                          const SourceLayout& layout);

/// The program of a task for editors; keeps a copy of its texts.
[[nodiscard]] std::unique_ptr<EditedProgram> edit(std::span<const SourceFile> files);

}  // namespace robomosp::irl
