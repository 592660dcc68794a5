// SPDX-License-Identifier: Apache-2.0
// What a language may give to editors (layer: contract, std only): colours, completion, hover,
// definitions, references, new names, layout, outline. An extension of robomosp.language/1.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/language.h>
#include <robomosp/sdk/program_code.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// Bytes [begin, end) of a file of the task; `file` is its number there.
struct SourceRange {
  std::uint32_t file = 0;
  std::uint32_t begin = 0, end = 0;
};

/// What a piece of source is, for its colour.
enum class SourceTokenKind : std::uint32_t {
  keyword = 0,
  number = 1,
  string = 2,
  comment = 3,
  sign = 4,  ///< operators, brackets, separators
  name = 5,  ///< of nothing that is known
  constant = 6,
  variable = 7,
  parameter = 8,
  signal = 9,
  robot = 10,
  type = 11,
  field = 12,
  procedure = 13,
  function = 14,
  process = 15,  ///< and interrupts
  label = 16,
  attribute = 17,  ///< of a motion
  program = 18,    ///< and modules
  unknown = 19     ///< none of the language
};
inline constexpr std::uint32_t kSourceTokenKinds = 20;

struct SourceToken {
  SourceTokenKind kind = SourceTokenKind::unknown;
  std::uint32_t begin = 0, end = 0;  ///< bytes of the file's text
  bool is_declaration = false;       ///< here it is declared
  bool is_predefined = false;        ///< of the language itself
  Room room{};
};

/// A completion at a place.
struct SourceCompletion {
  std::string label;   ///< what is shown
  std::string insert;  ///< what replaces the bytes [begin, end) of the file
  std::string detail;  ///< its declaration in a line
  std::string doc;     ///< sentences; may be ""
  SourceTokenKind kind = SourceTokenKind::name;
  std::uint32_t begin = 0, end = 0;
  std::uint32_t rank = 0;  ///< those with small numbers first
  Room room{};
};

/// The description of the name or word at a place.
struct SourceHover {
  SourceRange range;   ///< of the word
  std::string detail;  ///< its declaration in a line; "" = none
  std::string doc;     ///< sentences; may be ""
  Room room{};
};

/// A place where a name is used or declared.
struct SourceReference {
  SourceRange range;
  bool is_declaration = false;
  Room room{};
};

/// Bytes that are replaced. Of one answer none overlap, and they are in order of file and place.
struct SourceEdit {
  SourceRange range;
  std::string text;
  Room room{};
};

/// A row of an outline; what is within another row comes behind it.
struct SourceSymbol {
  std::string name;
  std::string detail;
  SourceTokenKind kind = SourceTokenKind::name;
  std::uint32_t parent = RMP_NONE;             ///< row that it is within
  std::uint32_t begin = 0, end = 0;            ///< of all of it
  std::uint32_t name_begin = 0, name_end = 0;  ///< within that
  Room room{};
};

/// A call that is being written.
struct SourceSignature {
  std::string label;  ///< all of it in a line; "" = no call is being written here
  std::string doc;
  /// Bytes of the label, [begin, end) in pairs, that are the parameters.
  std::vector<std::uint32_t> parameters;
  std::uint32_t active = 0;  ///< parameter that is being written; may be behind the last
  Room room{};
};

/// Something wrong with a source.
struct SourceFault {
  std::uint32_t severity = RMP_FAULT_ERROR;
  SourceRange range;
  std::string message, hint;
  Room room{};
};

/// How words of the language are written.
enum class SourceCase : std::uint32_t { keep = 0, upper = 1, lower = 2 };
struct SourceLayout {
  std::uint32_t struct_size = sizeof(SourceLayout);  ///< see plugin.h
  std::uint32_t indent = 2;                          ///< blanks a level, 0..16
  SourceCase words = SourceCase::keep;
};

/// A program as an editor has it, right or wrong, with half of a line typed. It keeps what it needs
/// of the texts and is constant from when it is made. Files are numbered as in the task, places
/// are bytes, 0 to the length of the text. [any thread]
class EditedProgram {
 public:
  virtual ~EditedProgram() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// As compile() finds them; in files of the task.
  virtual Result<std::vector<SourceFault>> faults(Progress&) const = 0;
  /// In order, none overlap. Blanks are no tokens.
  virtual Result<std::vector<SourceToken>> tokens(std::uint32_t file, Progress&) const = 0;
  virtual Result<std::vector<SourceCompletion>> complete(std::uint32_t file, std::uint32_t at,
                                                         Progress&) const = 0;
  virtual Result<SourceHover> hover(std::uint32_t file, std::uint32_t at, Progress&) const = 0;
  /// Where the name at a place is declared; nothing = in no file of the task.
  virtual Result<std::vector<SourceRange>> definition(std::uint32_t file, std::uint32_t at,
                                                      Progress&) const = 0;
  /// Every place of the name at a place, in order of file and place.
  virtual Result<std::vector<SourceReference>> references(std::uint32_t file, std::uint32_t at,
                                                          Progress&) const = 0;
  /// Edits that give what is named at a place another name. An error where that is not possible, or
  /// where the program would mean something else; "" as the new name only asks whether it may be
  /// renamed, and gives the edit of the place itself.
  virtual Result<std::vector<SourceEdit>> rename(std::uint32_t file, std::uint32_t at,
                                                 std::string_view new_name, Progress&) const = 0;
  /// The text of a file in the usual layout: the same tokens and comments.
  virtual Result<std::string> format(std::uint32_t file, const SourceLayout&, Progress&) const = 0;
  virtual Result<std::vector<SourceSymbol>> outline(std::uint32_t file, Progress&) const = 0;
  virtual Result<SourceSignature> signature(std::uint32_t file, std::uint32_t at,
                                            Progress&) const = 0;
  /// What an editor may fold: statements, routines, comments of several lines.
  virtual Result<std::vector<SourceRange>> folds(std::uint32_t file, Progress&) const = 0;
};

/// What Language::extension(kExtensionId) points to, as `const LanguageEditing*`, where the
/// language has it; it stays as long as the language. [any thread]
class LanguageEditing {
 public:
  static constexpr const char* kExtensionId = "robomosp.language.editing/1";
  virtual ~LanguageEditing() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// The program of a task. Quick: what costs is done when it is asked for, and once.
  virtual Result<std::unique_ptr<EditedProgram>> open(const LanguageTask&) const = 0;
};

}  // namespace robomosp
