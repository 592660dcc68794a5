// SPDX-License-Identifier: Apache-2.0
// Several files of a KUKA backup read as one program: which routines and declarations the program
// uses, and which name a file means where several files declare it (plugin program_readers).
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "reader.h"

namespace robomosp::readers {

inline const Style kKrlStyle{.comment = ";",
                             .quotes = "\"",
                             .name_first = "_$",
                             .name_rest = "_$",
                             .signs = {"==", "<>", "<=", ">="},
                             .has_lines = true,
                             .joins_in_brackets = false,
                             .hex = {}};

/// A routine of a .src: bytes of its text, and the names in it.
struct KrlRoutine {
  std::string name;  ///< lower-case, as all names here
  bool is_global = false;
  std::uint32_t begin = 0, end = 0;
  std::set<std::string> used, locals;
};
/// A line of a .dat. Enumerators are named with "#" before them.
struct KrlDataLine {
  std::uint32_t begin = 0;
  bool is_global = false;
  std::vector<std::string> declared, named;
};
/// IMPORT type alias IS /R1/module..name
struct KrlImport {
  std::string alias, module, name;
};
struct KrlFile {
  std::string module;  ///< the file's name without its extension
  bool is_data = false, is_config = false, is_submit = false;
  std::vector<KrlRoutine> routines;
  std::vector<KrlDataLine> lines;
  std::vector<KrlImport> imports;
};

/// The files of a program as a whole. The program is the first file with its .dat; of the others
/// only what it uses counts.
class KrlBackup {
 public:
  explicit KrlBackup(std::span<const SourceFile>);
  /// Whether the program uses the routine that begins at this byte of a file.
  [[nodiscard]] bool is_used(std::size_t file, std::uint32_t begin) const;
  /// Whether this byte of a .src is in a routine that the program uses.
  [[nodiscard]] bool is_in_used(std::size_t file, std::uint32_t byte) const;
  /// First bytes of the lines of a .dat that count.
  [[nodiscard]] const std::set<std::uint32_t>& lines(std::size_t file) const {
    return used_lines_[file];
  }
  /// Whether a file is the program's own.
  [[nodiscard]] bool is_own(std::size_t file) const {
    return module_of_[file] == 0 && !files_[file].is_submit;
  }
  /// Whether a file is the program of the submit interpreter.
  [[nodiscard]] bool is_submit(std::size_t file) const { return files_[file].is_submit; }
  /// Renames the names of a file that mean something else in another file:
  /// XP1 of the second file is "XP1.weld2".
  void give_new_names(std::size_t file, std::vector<Token>& tokens);
  /// Names of a file, whatever is wrong with it.
  [[nodiscard]] const KrlFile& names(std::size_t file) const { return files_[file]; }
  /// Whether the program uses a name, such as "$out[3]".
  [[nodiscard]] bool uses(const std::string& name) const { return used_names_.contains(name); }

 private:
  /// A place where names are declared: a module, or all of them.
  static constexpr int kGlobal = -1;
  using Scoped = std::pair<int, std::string>;

  void follow(std::deque<Scoped>& open, const Scoped& name);
  [[nodiscard]] const KrlRoutine* routine_at(std::size_t file, std::uint32_t byte) const;
  [[nodiscard]] std::string renamed(int module, const std::string& name) const;
  [[nodiscard]] std::string canonical(int scope, const std::string& name) const;

  std::vector<KrlFile> files_;
  std::vector<int> module_of_;
  std::vector<std::string> modules_;
  std::map<Scoped, std::vector<std::pair<std::size_t, std::size_t>>> routines_, lines_;
  std::map<Scoped, Scoped> imports_;
  std::set<Scoped> seen_;
  std::set<std::pair<std::size_t, std::uint32_t>> used_routines_;
  std::vector<std::set<std::uint32_t>> used_lines_;
  std::set<std::string> used_names_;
  std::map<std::string, std::vector<int>> owners_;  ///< of a name, in order of their claim to it
  std::map<std::string, std::string> global_module_;
  std::deque<std::string> texts_;
  std::map<std::string, std::string_view, std::less<>> interned_;
};

}  // namespace robomosp::readers
