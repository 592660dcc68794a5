// SPDX-License-Identifier: Apache-2.0
// Builds the typed program from the tree: names, types, constants (layer: data processing, plugin
// irl).
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <robomosp/sdk/language.h>
#include <robomosp/sdk/program_tables.h>

#include "intrinsics.h"
#include "syntax.h"

namespace robomosp::irl {

/// A use of a name in a source.
struct Use {
  enum Kind : std::uint8_t { symbol, field, attribute };
  std::uint32_t file = 0, begin = 0, end = 0;
  std::uint32_t id = kNone;  ///< symbol; row of the fields; attribute of a motion
  Kind kind = symbol;
  bool is_declaration = false;
};

/// How much of a program is checked.
enum class Depth : std::uint8_t {
  all,
  declarations,
  heads  ///< of declarations only; the tree is limited to them, too
};

class Checker {
 public:
  using Id = std::uint32_t;
  Checker(ProgramTables& out, Names& names, Faults& faults, std::span<const SourceFile> files,
          Progress& progress);
  /// Before run(): sets initial values of the program's variables and constants.
  void give(std::span<const GivenValue> values) { given_ = values; }
  /// Reads and checks the first file and those it names. False = cancelled.
  bool run();

  /// From now on, records every name as it is encountered, some more than once.
  void tell_uses(std::vector<Use>& to) { uses_ = &to; }
  /// Before run(): skips statements.
  void look_at(Depth depth) { depth_ = depth; }
  [[nodiscard]] std::deque<Source>& sources() { return sources_; }
  /// By scope: number of a name -> symbol.
  [[nodiscard]] const std::vector<std::unordered_map<std::uint32_t, Id>>& known_names() const {
    return known_;
  }
  [[nodiscard]] const std::vector<Id>& field_names() const { return field_names_; }
  [[nodiscard]] const std::vector<Id>& symbol_names() const { return symbol_names_; }
  /// As shown in messages; kNone = "?".
  [[nodiscard]] std::string shown_type(Id type) const { return shown(type); }

 private:
  static constexpr Id kBad = kNone;  ///< type of an expression with a reported fault

  // ---- units (checker.cpp) ----
  Source& load(std::string_view name, std::string_view text, Unit unit);
  /// By its name, ignoring case and folders; kNone = not among the files.
  [[nodiscard]] Id find_file(std::string_view name) const;
  void check_unit(Source& s, Id scope);
  void import(const Node& n);
  Id module_scope(const Node& at, std::uint32_t name);
  void data_list(std::string_view name, const Node* at);
  void mark_recursion();

  // ---- declarations (checker.cpp) ----
  Id new_scope(std::uint32_t kind, Id parent, std::string_view name, const rmp_span& span);
  Id declare(std::uint32_t kind, const Node& n, Id type);
  [[nodiscard]] Id lookup(std::uint32_t name) const;
  [[nodiscard]] std::string suggestion(std::uint32_t name) const;
  void sections(Id first);
  void variables(const Node& section);
  /// Initial value of a declarator: its own, or a given one.
  Id given(const Node& declarator, Id type, Id value);
  void types(const Node& section);
  void signals(const Node& section);
  void routine_head(const Node& n);
  void routine_body(const Node& n, Id routine);
  Id type(Id n);
  Id record(const Node& n);
  Id array_of(Id element, std::int32_t lower, std::int32_t upper);
  Id list_of(Id element);
  void give_role(Id type, std::uint32_t name, const Node& at);
  std::optional<std::int32_t> constant_int(Id n, const std::string& what);
  [[nodiscard]] std::uint64_t slots(Id type) const { return slots_[type]; }
  Id add_type(const rmp_code_type& t);

  // ---- statements (statements.cpp) ----
  Id block(Id n);
  Id statement(const Node& n);
  Id add_statement(std::uint32_t op, const Node& n);
  Id motion(const Node& n);
  Id boolean(Id n, const std::string& what);
  Id number(Id n, const std::string& what);
  bool check_place(Id expression, const Node& at, const std::string& what);
  Id robot_choice(const Node& n);
  void warn_without_effect(Id place, const Node& n);
  bool always_returns(Id n) const;
  Id routine_named(const Node& n, std::uint32_t kind, const char* what);
  void resolve_gotos();

  // ---- expressions (expressions.cpp) ----
  Id expression(Id n, Id expected = kBad);
  Id expression_of_name(const Node& n);
  Id call(const Node& n, Id symbol);
  [[nodiscard]] bool is_robot(Id expression) const;
  Id intrinsic(const Node& n, Id symbol);
  Id make(const Node& n, Id type, Id first_argument);
  Id component(Id n, Id type, const std::string& what);
  Id first_component(Id value, Id type);
  Id zero(Id type, const rmp_span& span);
  Id binary(const Node& n);
  Id fold(std::uint32_t op, Id a, Id b, Id type, const Node& n);
  /// Converts to a value of this type; else reports what `what` needs.
  Id convert(Id expression, Id to, const Node& at, const std::string& what);
  [[nodiscard]] bool converts(Id from, Id to) const;
  Id add(std::uint32_t op, Id type, const rmp_span& span, std::initializer_list<Id> operands,
         Id symbol = kNone, Id constant = kNone);
  Id add_with(std::uint32_t op, Id type, const rmp_span& span, const std::vector<Id>& operands,
              Id symbol = kNone);
  Id bad(const Node& n);
  Id literal(Id constant, const rmp_span& span);
  [[nodiscard]] Id type_of(Id expression) const { return out_.expressions[expression].type; }
  [[nodiscard]] const rmp_code_constant* known(Id expression) const;
  [[nodiscard]] std::string shown(Id type) const;
  [[nodiscard]] bool is_pure(Id expression) const;
  Id named_type(std::string_view name) const;

  // ---- both ----
  [[nodiscard]] const Node& at(Id n) const { return s_->nodes[n]; }
  [[nodiscard]] rmp_span span(const Node& n) const;
  [[nodiscard]] rmp_span name_span(const Node& n) const;
  [[nodiscard]] std::string written(const Node& n) const;
  void fail(const Node& n, std::string message, std::string hint = {});
  void fail_name(const Node& n, std::string message, std::string hint = {});
  void warn(const Node& n, std::string message, std::string hint = {});
  Id child(const Node& n, int i) const;
  /// Records the meaning of a node's name.
  void use(const Node& n, Id id, Use::Kind kind = Use::symbol, bool is_declaration = false) {
    if (!uses_ || id == kNone || n.name == kNone) return;
    const Token& t = s_->tokens[n.name_token];
    uses_->push_back({s_->file, t.begin, t.end, id, kind, is_declaration});
  }

  ProgramTables& out_;
  Names& names_;
  Faults& faults_;
  std::span<const SourceFile> files_;
  Progress& progress_;

  std::deque<Source> sources_;
  Source* s_ = nullptr;
  Id scope_ = kNone, routine_ = kNone;
  std::vector<std::unordered_map<std::uint32_t, Id>> known_;  ///< by scope: name -> symbol
  std::vector<std::uint64_t> slots_;                          ///< by type
  std::unordered_map<std::string, Id> structural_;
  std::vector<Id> field_names_;                          ///< by field
  std::map<std::pair<Id, std::uint32_t>, Id> field_at_;  ///< first field of a record, name -> field
  std::vector<Id> symbol_names_;
  std::unordered_map<std::uint32_t, Id> modules_;  ///< name -> scope
  /// Names of files without folders and extensions, in capitals -> the first such file except the
  /// program's.
  std::unordered_map<std::string, std::size_t> module_files_;
  std::set<std::uint32_t> loading_;
  std::vector<std::set<std::uint32_t>> exports_;  ///< by scope; only of modules
  std::unordered_map<Id, std::pair<Source*, Id>> bodies_;
  std::set<Id> taught_;
  std::set<Id> misfits_;  ///< records with a predefined name but other fields
  std::vector<std::pair<Id, Node>> teaches_;
  std::vector<std::set<Id>> calls_;  ///< by routine
  int loops_ = 0;
  int returns_ = 0;
  std::vector<Id> blocks_;
  Id next_block_ = 0;
  struct Goto {
    Id statement = 0;
    Node at;
    std::vector<Id> blocks;
  };
  std::vector<Goto> gotos_;
  std::unordered_map<std::uint32_t, std::pair<Id, Id>> labels_;  ///< name -> symbol, block
  bool is_cancelled_ = false;
  std::vector<Use>* uses_ = nullptr;
  std::span<const GivenValue> given_;
  std::string given_text_;          ///< one line each
  Source* given_source_ = nullptr;  ///< created with the first one
  std::vector<bool> is_given_;      ///< used by a declaration
  Depth depth_ = Depth::all;
};

/// Generates the instructions of a program without faults.
void lower(ProgramTables& out);

}  // namespace robomosp::irl
