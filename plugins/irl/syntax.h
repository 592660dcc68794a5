// SPDX-License-Identifier: Apache-2.0
// Source of IRL as tokens and as a tree (layer: data processing, plugin irl).
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

namespace robomosp::irl {

inline constexpr std::uint32_t kNone = 0xffffffffU;

/// Kinds of tokens. Keywords start at `k_program`.
enum class Tok : std::uint8_t {
  end,
  name,
  integer,
  real,
  string,
  unknown,
  // punctuation
  semicolon,
  colon,
  comma,
  dot,
  dots,
  lparen,
  rparen,
  lbracket,
  rbracket,
  assign,
  equal,
  not_equal,
  less,
  less_equal,
  greater,
  greater_equal,
  plus,
  minus,
  star,
  slash,
  at,
  // words
  k_program,
  k_endprogram,
  k_module,
  k_endmodule,
  k_system_specification,
  k_datalist,
  k_import,
  k_export,
  k_const,
  k_var,
  k_type,
  k_signal,
  k_record,
  k_endrecord,
  k_array,
  k_of,
  k_list,
  k_procedure,
  k_endproc,
  k_function,
  k_endfct,
  k_process,
  k_endprocess,
  k_interrupt,
  k_endinterrupt,
  k_begin,
  k_if,
  k_then,
  k_elsif,
  k_else,
  k_endif,
  k_while,
  k_do,
  k_endwhile,
  k_for,
  k_to,
  k_downto,
  k_endfor,
  k_repeat,
  k_until,
  k_loop,
  k_endloop,
  k_exit,
  k_case,
  k_when,
  k_default,
  k_endcase,
  k_goto,
  k_label,
  k_return,
  k_wait,
  k_pause,
  k_halt,
  k_move,
  k_move_inc,
  k_and,
  k_or,
  k_exor,
  k_not,
  k_div,
  k_mod,
  k_in,
  k_out,
  k_inout,
};

struct Token {
  Tok kind = Tok::end;
  std::uint32_t begin = 0, end = 0;  ///< bytes of the source
  std::uint32_t line = 1, column = 1;
  std::uint32_t name = kNone;  ///< of names: in Names
};

/// Numbered names, case-insensitive.
class Names {
 public:
  std::uint32_t number(std::string_view any_case);
  [[nodiscard]] const std::string& upper(std::uint32_t n) const { return all_[n]; }
  /// kNone = unused name.
  [[nodiscard]] std::uint32_t find(std::string_view any_case) const;

 private:
  /// Slot of a name, or where it must be inserted.
  [[nodiscard]] std::size_t slot_of(std::string_view any_case, std::uint32_t hash) const;
  std::deque<std::string> all_;
  std::vector<std::uint32_t> hashes_;  ///< by number
  std::vector<std::uint32_t> slots_;   ///< numbers, kNone = free; a power of two, at most half full
};
[[nodiscard]] std::string upper(std::string_view s);

/// A fault. `file` is a number of the compiler's.
struct Fault {
  std::uint32_t severity = 0;
  std::uint32_t file = 0;
  Token at;
  std::string message, hint;
};
/// Faults of one run: the first 100 errors are kept, or all for an editor.
class Faults {
 public:
  explicit Faults(std::uint32_t most = kMost) : most_(most) {}
  void error(std::uint32_t file, const Token& at, std::string message, std::string hint = {});
  void warning(std::uint32_t file, const Token& at, std::string message, std::string hint = {});
  void note(std::uint32_t file, const Token& at, std::string message, std::string hint = {});
  /// Drops the faults that came after the first `count`, `errors` of which are errors.
  void drop_after(std::size_t count, std::uint32_t errors);
  [[nodiscard]] bool is_full() const { return errors_ >= most_; }
  [[nodiscard]] std::uint32_t errors() const { return errors_; }
  std::vector<Fault> all;
  static constexpr std::uint32_t kMost = 100;

 private:
  std::uint32_t errors_ = 0, most_;
};

/// Kinds of tree nodes; children in order.
enum class N : std::uint8_t {
  program,
  module,
  data_list,  // heads, sections, routines, block
  specification,
  use_data_list,
  import_,
  export_,  // the token `last` is the string; names
  const_section,
  var_section,
  type_section,
  signal_section,
  var_decl,     // type, declarators
  declarator,   // [value]
  type_decl,    // type
  robot_decl,   // value
  signal_decl,  // type, address, [width]; flag 1 = output
  procedure,
  function,
  process,
  interrupt,  // [params], [result], [priority], [condition], sections, block
  params,
  param,  // param: type, declarators; flag = mode
  result,
  priority,
  condition,  // one child
  type_name,
  type_array,
  bounds,
  type_record,
  type_list,
  block,  // statements
  assign,
  call_stmt,
  if_,
  arm,
  labels,
  case_,
  while_,
  repeat,
  loop,
  for_,
  exit_,
  goto_,
  label,
  return_,
  wait_time,
  wait_for,
  pause,
  halt,
  move,
  targets,
  attribute,
  until,
  process_stmt,
  teach,
  // expressions
  integer,
  real,
  string,
  name,
  call,
  index,
  field,
  aggregate,
  list,
  negate,
  plus,
  not_,
  binary,
  bad,     // placeholder for an expression or type with a reported fault
  broken,  // a statement with a faulty head: its blocks
};

struct Node {
  N kind = N::block;
  std::uint8_t flag = 0;
  std::uint16_t depth = 0;  ///< levels below it, at most slightly more than kMostChain
  Tok op = Tok::end;        ///< binary operator, or first token of a statement
  std::uint32_t token = 0;  ///< first
  std::uint32_t last = 0;   ///< last
  std::uint32_t name = kNone;
  std::uint32_t name_token = 0;
  std::uint32_t first = kNone, next = kNone;  ///< child, sibling
};

/// A source file with its tokens and tree. Node 0 is the unit, if there is one.
struct Source {
  std::uint32_t file = 0;
  std::string_view name, text;
  std::vector<Token> tokens;
  std::vector<Node> nodes;
  [[nodiscard]] std::string_view word(const Token& t) const {
    return text.substr(t.begin, t.end - t.begin);
  }
};

/// Fills the tokens; the last one has the kind `end`.
void scan(Source&, Names&, Faults&);
enum class Unit : std::uint8_t { program, data_list };
/// Fills the nodes. Programs and modules are distinguished by their content. Blocks of routines may
/// be skipped if only declarations are needed; faults in them are then not reported.
void parse(Source&, Unit, Names&, Faults&, bool skips_bodies = false);
/// The source of a tree in the usual form, without comments.
[[nodiscard]] std::string print(const Source&);
/// Value of a string in quotes, or of a comment's word.
[[nodiscard]] std::string string_value(std::string_view quoted);
/// Words that cannot be names, in upper case.
[[nodiscard]] const std::vector<std::string_view>& reserved_words();

}  // namespace robomosp::irl
