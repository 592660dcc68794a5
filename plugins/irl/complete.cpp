// SPDX-License-Identifier: Apache-2.0
// What may stand at a place, from the tokens before it and the names that are known there: the line
// itself need not be whole.
#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "editing.h"

namespace robomosp::irl {
namespace {

using Id = std::uint32_t;

constexpr std::array<AttributeWord, 16> kAttributeWords{{
    {"SPEED", "SPEED := REAL", "Speed of the tool along the path [mm/s]."},
    {"SPEED_ORI", "SPEED_ORI := REAL", "Speed of its orientation [degrees/s]."},
    {"ACC", "ACC := REAL", "Acceleration [% of the greatest]."},
    {"TIME", "TIME := REAL", "Time of the whole motion [s]; -1 is none."},
    {"C_CP", "C_CP := REAL", "Distance from the target where the next motion may begin [mm]."},
    {"C_SPEED", "C_SPEED := REAL", "Speed in the transition to the next motion [%]."},
    {"C_PASS", "C_PASS := BOOL", "Whether it passes its target without a stop."},
    {"WOBBLE", "WOBBLE := BOOL", "Whether the tool weaves."},
    {"ACT_ROB", "ACT_ROB := robot", "The robot that moves."},
    {"DEVICE", "DEVICE := INT", "The device that moves."},
    {"ADAX_CONTROL", "ADAX_CONTROL := INT", "What additional axes do meanwhile."},
    {"SPEED_PTP", "SPEED_PTP := REAL", "Speed of the joints [% of the greatest]."},
    {"ACC_PTP", "ACC_PTP := REAL", "Acceleration of the joints [% of the greatest]."},
    {"C_PTP", "C_PTP := REAL", "Where the next motion of the joints may begin [%]."},
    {"TOOL", "TOOL := POSE", "Tool centre point, seen from the flange, for this motion."},
    {"FRAME", "FRAME := POSE", "Frame that the targets are in, seen from the base."},
}};

struct WordDoc {
  std::string_view word, doc;
};
constexpr WordDoc kDocs[] = {
    {"PROGRAM", "Begins a program: PROGRAM name; ... BEGIN ... ENDPROGRAM;"},
    {"MODULE",
     "Begins a module, whose names other files import: MODULE name; EXPORT a; ... ENDMODULE;"},
    {"SYSTEM_SPECIFICATION", "The cell that the program is for: SYSTEM_SPECIFICATION 'cell.ssi';"},
    {"DATALIST", "A file of taught values: DATALIST 'points.dls';"},
    {"IMPORT", "Takes names of a module: IMPORT a, b FROM tools;"},
    {"EXPORT", "Names of a module that others may import: EXPORT a, b;"},
    {"CONST", "Constants: CONST REAL: height := 50.0;"},
    {"VAR", "Variables: VAR INT: i, n := 3;"},
    {"TYPE", "Types: TYPE RECORD REAL: A, B; ENDRECORD: PAIR;"},
    {"SIGNAL", "Signals: SIGNAL INPUT BOOL: ready AT 1;"},
    {"RECORD", "A type with fields: RECORD REAL: A, B; ENDRECORD"},
    {"ARRAY", "A type with elements: ARRAY [1..3] OF INT"},
    {"LIST", "A type with any number of elements: LIST OF POSE"},
    {"PROCEDURE", "PROCEDURE name (IN INT: a; OUT REAL: b); ... BEGIN ... ENDPROC;"},
    {"FUNCTION", "FUNCTION name (IN INT: a): REAL; ... BEGIN ... RETURN value; ENDFCT;"},
    {"PROCESS", "Runs beside the program once it is started: PROCESS name; BEGIN ... ENDPROCESS;"},
    {"INTERRUPT",
     "Runs when its condition becomes true and it is enabled: INTERRUPT name WHEN condition; BEGIN "
     "... ENDINTERRUPT;"},
    {"IF", "IF condition THEN ... ELSIF condition THEN ... ELSE ... ENDIF;"},
    {"WHILE", "WHILE condition DO ... ENDWHILE;"},
    {"FOR", "FOR i := 1 TO 10 STEP 2 DO ... ENDFOR;"},
    {"REPEAT", "REPEAT ... UNTIL condition;"},
    {"LOOP", "Repeats for ever, until EXIT: LOOP ... ENDLOOP;"},
    {"EXIT", "Leaves the innermost loop."},
    {"CASE", "CASE value OF WHEN 1, 2: ... DEFAULT: ... ENDCASE;"},
    {"GOTO", "Continues behind a label: GOTO name;"},
    {"LABEL", "A place that GOTO leads to: LABEL name:"},
    {"RETURN", "Leaves a routine; a function gives its value: RETURN value;"},
    {"WAIT", "WAIT 0.5 SEC; or WAIT FOR condition TIMEOUT 5.0;"},
    {"PAUSE", "Waits for the operator: PAUSE 'message';"},
    {"HALT", "Ends the program."},
    {"MOVE",
     "Moves the robot: MOVE PTP a; MOVE LIN a SPEED := 80.0; MOVE CIRCLE via, end; MOVE PATH a, b, "
     "c;"},
    {"MOVE_INC", "Moves by a difference, in the base's axes: MOVE_INC LIN d;"},
    {"PTP", "Joint by joint, all at once."},
    {"LIN", "Along a straight line."},
    {"CIRCLE", "Along an arc: through the first target to the second."},
    {"PATH", "Along one smooth curve through all targets."},
    {"UNTIL", "Ends REPEAT, or a motion early: MOVE LIN a UNTIL touched DO stop;"},
    {"START", "Starts a process."},
    {"STOP", "Holds a process until CONTINUE."},
    {"CONTINUE", "Resumes a stopped process."},
    {"CANCEL", "Ends a process."},
    {"ENABLE", "Lets an interrupt happen."},
    {"DISABLE", "Keeps an interrupt from happening."},
    {"TEACH", "Gives variables their taught values, of a list of data."},
    {"AND", "Looks at its right side only where the left one is true."},
    {"OR", "Looks at its right side only where the left one is false."},
    {"EXOR", "True where one side is true and the other is not."},
    {"NOT", "Looser than what compares: NOT a = b is NOT (a = b)."},
    {"DIV", "Whole quotient, towards zero."},
    {"MOD", "Remainder of DIV."},
    {"IN", "A parameter that is only read."},
    {"OUT", "A parameter that is given a value."},
    {"INOUT", "A parameter that is read and written."},
    {"SEC", "Seconds: WAIT 0.5 SEC;"},
    {"STEP", "Step of a FOR loop: at least 1, or one computed that is not 0."},
    {"TIMEOUT", "Longest time of WAIT FOR [s]; R_TIMEOUT is TRUE behind it."},
    {"AT", "Number of a signal, and its width: AT 3, 8"},
    {"FROM", "The module that names come from."},
    {"PRIORITY", "Priority of a process or an interrupt, an INT."},
    {"INPUT", "A signal that is read: INPUT BOOL: ready AT 1;"},
    {"OUTPUT", "A signal that is written: OUTPUT BOOL: grip AT 2;"},
    {"ROBOT", "A robot of a cell: ROBOT arm := R_SPEC_TYPE(...);"}};

/// Where a place lies in its file.
enum class Region : std::uint8_t { head, values, types, signals, parameters, routine_head, body };

class Completer {
 public:
  Completer(const Analysis& a, std::uint32_t file, std::uint32_t at)
      : a_(a), s_(*a.source(file)), file_(file), at_(at) {
    // The tokens before the word that is being typed.
    const auto it = std::lower_bound(s_.tokens.begin(), s_.tokens.end(), at,
                                     [](const Token& t, Id place) { return t.begin < place; });
    before_ = static_cast<std::size_t>(it - s_.tokens.begin());
    begin_ = end_ = at;
    if (before_ > 0) {
      const Token& t = s_.tokens[before_ - 1];
      const bool is_word = t.kind == Tok::name || t.kind >= Tok::k_program;
      if (is_word && t.begin < at && at <= t.end) {
        begin_ = t.begin;
        end_ = t.end;
        prefix_ = upper(s_.text.substr(begin_, at - begin_));
        --before_;
      }
    }
    look_back();
  }

  [[nodiscard]] bool is_inside_text() const {
    const Id from = before_ > 0 ? s_.tokens[before_ - 1].end : 0;
    if (before_ > 0 && from > at_) return true;  // a number or a string
    if (before_ > 0 && from == at_) {
      const Token& t = s_.tokens[before_ - 1];
      if (t.kind == Tok::integer || t.kind == Tok::real) return true;
      if (t.kind == Tok::string) return t.end - t.begin < 2 || s_.text[t.end - 1] != '\'';
    }
    bool inside = false;
    each_gap(s_.text, from, begin_, [&](Gap g, Id, Id e) {
      if (g == Gap::comment && e == begin_ && (s_.text[e - 1] != '}' || e > at_)) inside = true;
    });
    // A comment that ends behind the place.
    if (!inside && begin_ == end_) {
      const Id to =
          before_ < s_.tokens.size() ? s_.tokens[before_].begin : static_cast<Id>(s_.text.size());
      each_gap(s_.text, from, std::max(from, to), [&](Gap g, Id b, Id e) {
        if (g == Gap::comment && b < at_ && (at_ < e || s_.text[e - 1] != '}')) inside = true;
      });
    }
    return inside;
  }

  /// Names of files within the quotes of a head.
  bool files(std::span<const SourceFile> all) {
    if (before_ == 0) return false;
    std::size_t i = before_ - 1;
    const Token& t = s_.tokens[i];
    if (t.kind != Tok::string || i == 0 || at_ <= t.begin || at_ > t.end) return false;
    const Tok head = s_.tokens[i - 1].kind;
    if (head != Tok::k_system_specification && head != Tok::k_datalist) return false;
    const bool is_closed = t.end - t.begin > 1 && s_.text[t.end - 1] == '\'';
    if (is_closed && at_ == t.end) return true;
    begin_ = t.begin + 1;
    end_ = is_closed ? t.end - 1 : t.end;
    prefix_ = upper(s_.text.substr(begin_, at_ - begin_));
    const std::string_view wanted = head == Tok::k_datalist ? ".DLS" : ".SSI";
    for (std::size_t f = 0; f < all.size(); ++f) {
      const std::string name = upper(all[f].name);
      if (f == file_ || name.size() < 4 || name.substr(name.size() - 4) != wanted) continue;
      add(all[f].name, "", "", SourceTokenKind::string, 0);
    }
    return true;
  }

  std::vector<SourceCompletion> run(std::span<const SourceFile> all) {
    if (files(all) || is_inside_text()) return finish();
    if (last() == Tok::dot) {
      fields();
      return finish();
    }
    switch (region_) {
      case Region::body: body(); break;
      case Region::head: head(all); break;
      case Region::values:
      case Region::types:
      case Region::signals: section(); break;
      case Region::parameters: parameters(); break;
      case Region::routine_head: routine_head(); break;
    }
    return finish();
  }

  SourceSignature call();

 private:
  [[nodiscard]] Tok last() const { return before_ > 0 ? s_.tokens[before_ - 1].kind : Tok::end; }
  [[nodiscard]] std::string word(std::size_t token) const {
    return upper(s_.word(s_.tokens[token]));
  }

  /// The region of the place, its routine, and where its statement begins.
  void look_back() {
    int depth = 0;
    bool is_known = false, has_statement = false;
    statement_ = 0;
    std::size_t i = before_;
    while (i > 0) {
      const Tok k = s_.tokens[--i].kind;
      if (k == Tok::rparen || k == Tok::rbracket) ++depth;
      if (k == Tok::lparen || k == Tok::lbracket) {
        --depth;
        if (!is_known && !has_statement && depth < 0) depth_ = -depth;
      }
      const bool ends = k == Tok::semicolon || k == Tok::k_begin || k == Tok::k_then ||
                        k == Tok::k_else || k == Tok::k_loop || k == Tok::k_repeat ||
                        k == Tok::k_const || k == Tok::k_var || k == Tok::k_type ||
                        k == Tok::k_signal || k == Tok::k_do || k == Tok::k_record ||
                        (k == Tok::colon && ends_label(i));
      const bool begins = k == Tok::k_if || k == Tok::k_while || k == Tok::k_case ||
                          k == Tok::k_goto || k == Tok::k_label || k == Tok::k_return ||
                          k == Tok::k_wait || k == Tok::k_pause || k == Tok::k_move ||
                          k == Tok::k_move_inc ||
                          (k == Tok::k_for && (i == 0 || s_.tokens[i - 1].kind != Tok::k_wait));
      if (!has_statement && begins) {
        has_statement = true;
        statement_ = i;
      }
      if (!has_statement && ends) {
        has_statement = true;
        statement_ = i + 1;
        // DO of "UNTIL c DO name" is no end; one of a loop has WHILE or FOR before it.
        if (k == Tok::k_do && of_motion(i)) has_statement = false;
      }
      if (!is_known) {
        is_known = true;
        switch (k) {
          case Tok::k_begin: region_ = Region::body; break;
          case Tok::k_const:
          case Tok::k_var: region_ = Region::values; break;
          case Tok::k_type: region_ = Region::types; break;
          case Tok::k_signal: region_ = Region::signals; break;
          case Tok::k_procedure:
          case Tok::k_function:
          case Tok::k_process:
          case Tok::k_interrupt: {
            // Before the ";" of its head, or behind it.
            int open = 0;
            bool is_over = false;
            for (std::size_t j = i + 1; j < before_; ++j) {
              const Tok x = s_.tokens[j].kind;
              if (x == Tok::lparen) ++open;
              if (x == Tok::rparen) --open;
              if (x == Tok::semicolon && open <= 0) is_over = true;
            }
            region_ = is_over ? Region::head : open > 0 ? Region::parameters : Region::routine_head;
            break;
          }
          case Tok::k_endproc:
          case Tok::k_endfct:
          case Tok::k_endprocess:
          case Tok::k_endinterrupt:
          case Tok::k_program:
          case Tok::k_module: region_ = Region::head; break;
          default: is_known = false; break;
        }
      }
      if (k == Tok::k_endproc || k == Tok::k_endfct || k == Tok::k_endprocess ||
          k == Tok::k_endinterrupt)
        break;
      if (k == Tok::k_procedure || k == Tok::k_function || k == Tok::k_process ||
          k == Tok::k_interrupt) {
        routine_ = i;
        break;
      }
    }
    if (!is_known && s_.nodes.size() > 0 && s_.nodes[0].kind == N::data_list)
      region_ = Region::body;
    scope_ = a_.scope_of(file_);
    if (routine_ == kNoToken || routine_ + 1 >= s_.tokens.size()) return;
    // Its own scope, by the place of its name.
    const Id begin = s_.tokens[routine_ + 1].begin;
    if (const Use* u = a_.use_from(file_, begin); u && u->kind == Use::symbol)
      if (const rmp_code_symbol& x = a_.out.symbols[u->id]; x.kind == RMP_SYMBOL_ROUTINE)
        scope_ = a_.out.routines[x.routine].scope;
  }
  /// Whether a colon is that of a label or of an arm of CASE.
  [[nodiscard]] bool ends_label(std::size_t colon) const {
    if (colon >= 2 && s_.tokens[colon - 2].kind == Tok::k_label) return true;
    for (std::size_t i = colon; i > 0; --i) {
      const Tok k = s_.tokens[i - 1].kind;
      if (k == Tok::k_when || k == Tok::k_default) return true;
      if (k != Tok::name && k != Tok::integer && k != Tok::comma && k != Tok::string &&
          k != Tok::minus && k != Tok::plus)
        return false;
    }
    return false;
  }
  [[nodiscard]] bool of_motion(std::size_t token) const {
    while (token > 0) {
      const Tok k = s_.tokens[--token].kind;
      if (k == Tok::k_until) return true;
      if (k == Tok::semicolon || k == Tok::k_while || k == Tok::k_for) return false;
    }
    return false;
  }

  // ---- items ----
  void add(std::string_view label, std::string detail, std::string doc, SourceTokenKind kind,
           std::uint32_t rank) {
    if (!prefix_.empty()) {
      const std::string big = upper(label);
      if (big.compare(0, prefix_.size(), prefix_) != 0) {
        if (big.find(prefix_) == std::string::npos) return;
        rank += 10;
      }
    }
    if (!seen_.insert(upper(label)).second) return;
    SourceCompletion one;
    one.label = one.insert = std::string(label);
    one.detail = std::move(detail);
    one.doc = std::move(doc);
    one.kind = kind;
    one.begin = begin_;
    one.end = end_;
    one.rank = rank;
    out_.push_back(std::move(one));
  }
  void add_word(std::string_view w, std::uint32_t rank = 5) {
    add(w, "", std::string(word_doc(w)), SourceTokenKind::keyword, rank);
  }
  void add_words(std::initializer_list<std::string_view> words, std::uint32_t rank = 5) {
    for (const std::string_view w : words) add_word(w, rank);
  }
  std::vector<SourceCompletion> finish() {
    std::sort(out_.begin(), out_.end(), [](const SourceCompletion& x, const SourceCompletion& y) {
      return std::pair(x.rank, std::string_view(x.label)) <
             std::pair(y.rank, std::string_view(y.label));
    });
    return std::move(out_);
  }
  /// Names that are known at the place and pass.
  template <class Pass>
  void symbols(Pass&& pass) {
    const auto& known = a_.checker().known_names();
    std::uint32_t rank = 1;
    for (Id s = scope_; s < known.size(); s = a_.out.scopes[s].parent) {
      const std::uint32_t kind = a_.out.scopes[s].kind;
      const std::uint32_t its = kind == RMP_SCOPE_ROUTINE      ? 1
                                : kind == RMP_SCOPE_PREDEFINED ? 4
                                : kind == RMP_SCOPE_SYSTEM     ? 3
                                                               : 2;
      rank = std::max(rank, its);
      for (const auto& [name, symbol] : known[s]) {
        const rmp_code_symbol& x = a_.out.symbols[symbol];
        if (!pass(x)) continue;
        // What does not fit is not described, too.
        if (!prefix_.empty() && a_.names.upper(name).find(prefix_) == std::string::npos) continue;
        Use u;
        u.id = symbol;
        add(x.name, a_.detail(u), a_.doc(u), a_.kind(u), rank);
      }
    }
  }
  [[nodiscard]] std::uint32_t routine_kind(const rmp_code_symbol& x) const {
    return x.kind == RMP_SYMBOL_ROUTINE ? a_.out.routines[x.routine].kind : kNone;
  }
  void types() {
    symbols([](const rmp_code_symbol& x) { return x.kind == RMP_SYMBOL_TYPE; });
    add_words({"ARRAY", "RECORD", "LIST"});
  }
  void values() {
    symbols([&](const rmp_code_symbol& x) {
      if (x.kind == RMP_SYMBOL_ROUTINE)
        return routine_kind(x) == RMP_ROUTINE_FUNCTION || routine_kind(x) == RMP_ROUTINE_PROCESS;
      if (x.kind == RMP_SYMBOL_TYPE) return x.type == kNone || x.type > RMP_TYPE_PROCESS;
      if (x.kind == RMP_SYMBOL_INTRINSIC) {
        for (const Intrinsic& i : intrinsics())
          if (i.name == x.name) return !i.result.empty();
      }
      return true;
    });
    add_words({"NOT"});
  }

  // ---- regions ----
  void head(std::span<const SourceFile> all) {
    const Tok k = last();
    if (k == Tok::end) return add_words({"PROGRAM", "MODULE"});
    if (k == Tok::k_program || k == Tok::k_module) return;
    std::size_t i = before_;
    while (i > 0 && s_.tokens[i - 1].kind != Tok::semicolon) --i;
    const bool is_import = i < before_ && s_.tokens[i].kind == Tok::k_import;
    const bool is_export = i < before_ && s_.tokens[i].kind == Tok::k_export;
    if (is_export) return symbols([&](const rmp_code_symbol& x) { return x.scope == scope_; });
    if (is_import) {
      for (std::size_t f = 0; f < all.size(); ++f) {
        const std::string name(all[f].name);
        if (f != file_ && name.size() > 4 && upper(name).substr(name.size() - 4) == ".IRL")
          add(name.substr(0, name.size() - 4), "", "", SourceTokenKind::program, 1);
      }
      if (k != Tok::k_import && k != Tok::comma) add_word("FROM");
      return;
    }
    if (k != Tok::semicolon) return;
    add_words({"CONST", "VAR", "TYPE", "SIGNAL", "BEGIN"});
    if (routine_ != kNoToken) return;
    add_words({"PROCEDURE", "FUNCTION", "PROCESS", "INTERRUPT", "SYSTEM_SPECIFICATION", "DATALIST",
               "IMPORT", "EXPORT", "ENDPROGRAM", "ENDMODULE"});
  }
  void section() {
    const Tok k = last();
    const bool is_word = k == Tok::name;
    if (k == Tok::assign || k == Tok::lparen || k == Tok::lbracket || k == Tok::dots ||
        (k >= Tok::equal && k <= Tok::at) || k == Tok::k_and || k == Tok::k_or || k == Tok::k_not ||
        k == Tok::k_div || k == Tok::k_mod || k == Tok::k_exor)
      return values();
    if (k == Tok::comma) return depth_ > 0 ? values() : void();
    if (k == Tok::colon) return;  // a new name
    if (k == Tok::k_of) return types();
    if (is_word) {
      const std::string w = word(before_ - 1);
      if (region_ == Region::signals && (w == "INPUT" || w == "OUTPUT")) return types();
      if (region_ == Region::signals && w == "AT") return values();
      if (region_ == Region::signals) return add_word("AT");
      return;
    }
    if (k == Tok::rbracket) return add_word("OF");
    if (k != Tok::semicolon && k != Tok::k_const && k != Tok::k_var && k != Tok::k_type &&
        k != Tok::k_signal && k != Tok::k_record)
      return;
    if (region_ == Region::signals) {
      add_words({"INPUT", "OUTPUT"}, 0);
    } else {
      types();
      if (region_ == Region::types) add_words({"ROBOT", "ENDRECORD"});
    }
    if (k == Tok::k_record) return;
    add_words({"BEGIN", "CONST", "VAR", "TYPE", "SIGNAL"}, 6);
    if (routine_ == kNoToken)
      add_words({"PROCEDURE", "FUNCTION", "PROCESS", "INTERRUPT", "ENDPROGRAM", "ENDMODULE"}, 6);
  }
  void parameters() {
    const Tok k = last();
    if (k == Tok::lparen || k == Tok::semicolon) {
      add_words({"IN", "OUT", "INOUT"}, 0);
      types();
    } else if (k == Tok::k_in || k == Tok::k_out || k == Tok::k_inout || k == Tok::k_of) {
      types();
    }
  }
  void routine_head() {
    const Tok k = last();
    const Tok kind = s_.tokens[routine_].kind;
    if (k == Tok::colon && kind == Tok::k_function) return types();
    if (k == Tok::k_when || (k >= Tok::equal && k <= Tok::at) || k == Tok::k_and ||
        k == Tok::k_or || k == Tok::k_not)
      return values();
    if (k == Tok::name && kind == Tok::k_process) add_word("PRIORITY");
    if (k == Tok::name && kind == Tok::k_interrupt) add_words({"PRIORITY", "WHEN"});
  }
  void begin_statement() {
    symbols([&](const rmp_code_symbol& x) {
      switch (x.kind) {
        case RMP_SYMBOL_VARIABLE:
        case RMP_SYMBOL_OUTPUT: return true;
        case RMP_SYMBOL_PARAMETER: return x.mode != RMP_MODE_IN;
        case RMP_SYMBOL_ROUTINE: return routine_kind(x) == RMP_ROUTINE_PROCEDURE;
        case RMP_SYMBOL_INTRINSIC:
          for (const Intrinsic& i : intrinsics())
            if (i.name == x.name) return i.result.empty() || i.result == "R";
          return false;
        default: return false;
      }
    });
    add_words({"IF",    "WHILE",    "FOR",    "REPEAT", "LOOP",    "EXIT", "CASE",     "GOTO",
               "LABEL", "RETURN",   "WAIT",   "PAUSE",  "HALT",    "MOVE", "MOVE_INC", "START",
               "STOP",  "CONTINUE", "CANCEL", "ENABLE", "DISABLE", "TEACH"});
    // What ends something that is open above.
    std::vector<Tok> open;
    for (std::size_t i = 0, from = first_of_body(); i + from < before_; ++i) {
      const std::size_t t = from + i;
      const Tok k = s_.tokens[t].kind;
      const bool waits = t > 0 && s_.tokens[t - 1].kind == Tok::k_wait;
      if (k == Tok::k_if || k == Tok::k_while || (k == Tok::k_for && !waits) ||
          k == Tok::k_repeat || k == Tok::k_loop || k == Tok::k_case)
        open.push_back(k);
      const bool ends = k == Tok::k_endif || k == Tok::k_endwhile || k == Tok::k_endfor ||
                        k == Tok::k_endloop || k == Tok::k_endcase ||
                        (k == Tok::k_until && !open.empty() && open.back() == Tok::k_repeat);
      if (ends && !open.empty()) open.pop_back();
    }
    if (open.empty()) {
      const Tok r = routine_ == kNoToken ? Tok::k_program : s_.tokens[routine_].kind;
      return add_word(r == Tok::k_procedure   ? "ENDPROC"
                      : r == Tok::k_function  ? "ENDFCT"
                      : r == Tok::k_process   ? "ENDPROCESS"
                      : r == Tok::k_interrupt ? "ENDINTERRUPT"
                                              : "ENDPROGRAM");
    }
    switch (open.back()) {
      case Tok::k_if: return add_words({"ENDIF", "ELSE", "ELSIF"});
      case Tok::k_while: return add_word("ENDWHILE");
      case Tok::k_for: return add_word("ENDFOR");
      case Tok::k_repeat: return add_word("UNTIL");
      case Tok::k_loop: return add_word("ENDLOOP");
      default: return add_words({"ENDCASE", "WHEN", "DEFAULT"});
    }
  }
  [[nodiscard]] std::size_t first_of_body() const {
    std::size_t i = before_;
    while (i > 0 && s_.tokens[i - 1].kind != Tok::k_begin) --i;
    return i;
  }
  void labels() {
    std::size_t to = before_;
    while (to < s_.tokens.size() && s_.tokens[to].kind != Tok::k_endproc &&
           s_.tokens[to].kind != Tok::k_endfct && s_.tokens[to].kind != Tok::k_endprocess &&
           s_.tokens[to].kind != Tok::k_endinterrupt && s_.tokens[to].kind != Tok::k_endprogram)
      ++to;
    for (std::size_t i = first_of_body(); i + 1 < to; ++i)
      if (s_.tokens[i].kind == Tok::k_label && s_.tokens[i + 1].kind == Tok::name)
        add(s_.word(s_.tokens[i + 1]), "LABEL", "", SourceTokenKind::label, 0);
  }
  void attributes() {
    std::set<std::string> given;
    for (std::size_t i = statement_; i + 1 < s_.tokens.size(); ++i) {
      if (s_.tokens[i].kind == Tok::semicolon) break;
      if (s_.tokens[i].kind == Tok::name && s_.tokens[i + 1].kind == Tok::assign)
        given.insert(word(i));
    }
    for (const AttributeWord& w : kAttributeWords)
      if (!given.contains(std::string(w.name)))
        add(w.name, std::string(w.detail), std::string(w.doc), SourceTokenKind::attribute, 0);
    add_word("UNTIL");
  }
  void body() {
    const Tok k = last();
    const std::size_t first = statement_;
    if (first >= before_) return begin_statement();
    const Tok head = s_.tokens[first].kind;
    if (k == Tok::k_move || k == Tok::k_move_inc)
      return add_words({"PTP", "LIN", "CIRCLE", "PATH"}, 0);
    if (k == Tok::k_goto) return labels();
    if (k == Tok::k_label) return;
    if (head == Tok::name) {
      const std::string w = word(first);
      const bool is_next = first + 1 == before_;
      if (is_next && (w == "START" || w == "STOP" || w == "CONTINUE" || w == "CANCEL"))
        symbols([&](const rmp_code_symbol& x) { return routine_kind(x) == RMP_ROUTINE_PROCESS; });
      if (is_next && (w == "ENABLE" || w == "DISABLE"))
        symbols([&](const rmp_code_symbol& x) { return routine_kind(x) == RMP_ROUTINE_INTERRUPT; });
      if (w == "TEACH" && (is_next || k == Tok::comma))
        return symbols([&](const rmp_code_symbol& x) {
          return x.kind == RMP_SYMBOL_VARIABLE && x.routine == kNone;
        });
    }
    const bool is_motion = (head == Tok::k_move || head == Tok::k_move_inc);
    const bool is_interpolation = is_motion && before_ == first + 2;
    const bool is_operand =
        !is_interpolation && (k == Tok::name || k == Tok::integer || k == Tok::real ||
                              k == Tok::string || k == Tok::rparen || k == Tok::rbracket);
    if (is_motion && depth_ == 0 && before_ > first + 2 && (is_operand || k == Tok::comma))
      attributes();
    if (!is_operand) {
      if (is_motion && k == Tok::k_do)
        return symbols(
            [&](const rmp_code_symbol& x) { return routine_kind(x) == RMP_ROUTINE_PROCEDURE; });
      if (k == Tok::colon) return begin_statement();  // behind a label or an arm
      values();
      if (k == Tok::k_wait) add_word("FOR", 0);
      return;
    }
    // Behind a value: what may follow it.
    add_words({"AND", "OR", "EXOR", "DIV", "MOD"});
    if (head == Tok::k_if || head == Tok::k_elsif) add_word("THEN", 0);
    if (head == Tok::k_while || head == Tok::k_for) add_word("DO", 0);
    if (head == Tok::k_for) add_words({"TO", "DOWNTO", "STEP"}, 0);
    if (head == Tok::k_case) add_words({"OF", "WHEN"}, 0);
    if (head == Tok::k_wait) add_words({"SEC", "TIMEOUT"}, 0);
    // In a line of its own a statement may begin: heads need no word at their end.
    const std::string_view between =
        s_.text.substr(s_.tokens[before_ - 1].end, begin_ - s_.tokens[before_ - 1].end);
    if (between.find('\n') != std::string_view::npos) begin_statement();
  }

  // ---- fields ----
  void fields() {
    const Id t = type_before(before_ - 1);
    if (t == kNone || t <= RMP_TYPE_PROCESS) return;
    const rmp_code_type& x = a_.out.types[t];
    if (x.kind != RMP_TYPE_RECORD) return;
    for (Id k = 0; k < x.field_count; ++k) {
      Use u;
      u.kind = Use::field;
      u.id = x.first_field + k;
      add(a_.out.fields[u.id].name,
          a_.type_name(a_.out.fields[u.id].type) + ": " + a_.out.fields[u.id].name, a_.doc(u),
          SourceTokenKind::field, k < 9 ? k : 9);
    }
  }
  /// Type of the place that ends before a token, such as "." in a.b[i].
  [[nodiscard]] Id type_before(std::size_t dot) const {
    std::vector<std::pair<std::size_t, int>> steps;  // token of a name; or elements
    std::size_t i = dot;
    while (true) {
      if (i == 0) return kNone;
      const Tok k = s_.tokens[i - 1].kind;
      if (k == Tok::rbracket || k == Tok::rparen) {
        int depth = 0, commas = 0;
        std::size_t j = i;
        while (j > 0) {
          const Tok x = s_.tokens[--j].kind;
          if (x == Tok::rbracket || x == Tok::rparen) ++depth;
          if (x == Tok::comma && depth == 1) ++commas;
          if ((x == Tok::lbracket || x == Tok::lparen) && --depth == 0) break;
          if (x == Tok::semicolon) return kNone;
        }
        if (depth != 0) return kNone;
        if (k == Tok::rbracket) steps.emplace_back(kNoToken, commas + 1);
        i = j;
        continue;
      }
      if (k != Tok::name) return kNone;
      steps.emplace_back(i - 1, 0);
      if (i >= 2 && s_.tokens[i - 2].kind == Tok::dot) {
        i -= 2;
        continue;
      }
      break;
    }
    Id type = kNone;
    bool is_first = true;
    for (auto it = steps.rbegin(); it != steps.rend(); ++it) {
      if (it->first == kNoToken) {
        for (int n = 0; n < it->second; ++n) {
          if (type == kNone) return kNone;
          if (a_.out.types[type].kind != RMP_TYPE_ARRAY && a_.out.types[type].kind != RMP_TYPE_LIST)
            return kNone;
          type = a_.out.types[type].element;
        }
        continue;
      }
      const std::string name = word(it->first);
      if (std::exchange(is_first, false)) {
        const Id s = a_.lookup(scope_, name);
        if (s == kNone) return kNone;
        type = type_of(s);
      } else {
        if (type == kNone || a_.out.types[type].kind != RMP_TYPE_RECORD) return kNone;
        const rmp_code_type& x = a_.out.types[type];
        Id found = kNone;
        for (Id k = 0; k < x.field_count; ++k)
          if (upper(a_.out.fields[x.first_field + k].name) == name)
            found = a_.out.fields[x.first_field + k].type;
        type = found;
      }
    }
    return type;
  }
  [[nodiscard]] Id type_of(Id symbol) const {
    const rmp_code_symbol& x = a_.out.symbols[symbol];
    if (x.kind != RMP_SYMBOL_INTRINSIC) return x.type;
    for (const Intrinsic& i : intrinsics()) {
      if (i.name != x.name || i.result.empty()) continue;
      const Id t = a_.lookup(scope_, Analysis::parameter_name(i.result[0]));
      return t == kNone ? kNone : a_.out.symbols[t].type;
    }
    return kNone;
  }

  static constexpr std::size_t kNoToken = static_cast<std::size_t>(-1);
  const Analysis& a_;
  const Source& s_;
  std::uint32_t file_, at_;
  std::size_t before_ = 0;  ///< tokens before the word that is typed
  Id begin_ = 0, end_ = 0;  ///< of that word
  std::string prefix_;      ///< of it, before the place; upper case
  Region region_ = Region::head;
  std::size_t statement_ = 0;
  std::size_t routine_ = kNoToken;
  int depth_ = 0;  ///< brackets that are open in the statement
  Id scope_ = kNone;
  std::set<std::string> seen_;
  std::vector<SourceCompletion> out_;
};

SourceSignature Completer::call() {
  SourceSignature out;
  if (is_inside_text() && before_ > 0 && s_.tokens[before_ - 1].kind != Tok::string &&
      s_.tokens[before_ - 1].kind != Tok::integer && s_.tokens[before_ - 1].kind != Tok::real)
    return out;
  // The bracket that is open before the place.
  int depth = 0;
  std::uint32_t commas = 0;
  std::size_t i = before_;
  while (i > 0 && s_.tokens[i - 1].begin >= at_) --i;
  std::size_t open = kNoToken;
  while (i > 0) {
    const Tok k = s_.tokens[--i].kind;
    if (k == Tok::rparen || k == Tok::rbracket) ++depth;
    if (k == Tok::lparen || k == Tok::lbracket) {
      if (depth == 0) {
        // Brackets that only group, or an index: what is around them counts.
        if (k == Tok::lparen && i > 0 && s_.tokens[i - 1].kind == Tok::name) {
          open = i;
          break;
        }
        commas = 0;
        continue;
      }
      --depth;
    }
    if (k == Tok::comma && depth == 0) ++commas;
    if (k == Tok::semicolon || k == Tok::k_begin || k == Tok::k_procedure || k == Tok::k_function)
      return out;
  }
  if (open == kNoToken) return out;
  if (open >= 2 &&
      (s_.tokens[open - 2].kind == Tok::k_procedure || s_.tokens[open - 2].kind == Tok::k_function))
    return out;  // it is being declared
  const Id symbol = a_.lookup(scope_, s_.word(s_.tokens[open - 1]));
  if (symbol == kNone) return out;
  const rmp_code_symbol& x = a_.out.symbols[symbol];
  Use u;
  u.id = symbol;
  std::vector<std::string> parts;
  std::string behind;
  if (x.kind == RMP_SYMBOL_ROUTINE) {
    const rmp_code_routine& r = a_.out.routines[x.routine];
    for (Id k = 0; k < r.parameter_count; ++k)
      parts.push_back(a_.parameter_text(r.first_parameter + k));
    if (r.kind == RMP_ROUTINE_FUNCTION) behind = ": " + a_.type_name(r.result);
  } else if (x.kind == RMP_SYMBOL_INTRINSIC) {
    for (const Intrinsic& in : intrinsics()) {
      if (in.name != x.name) continue;
      for (const char p : in.parameters) parts.push_back(Analysis::parameter_name(p));
      if (in.parameters == "w" || in.parameters == "m") commas = 0;
      if (!in.result.empty()) behind = ": " + Analysis::parameter_name(in.result[0]);
    }
  } else if (x.kind == RMP_SYMBOL_TYPE && x.type != kNone && x.type > RMP_TYPE_PROCESS) {
    const rmp_code_type& t = a_.out.types[x.type];
    for (Id k = 0; t.kind == RMP_TYPE_RECORD && k < t.field_count; ++k) {
      const rmp_code_field& f = a_.out.fields[t.first_field + k];
      parts.push_back(a_.type_name(f.type) + ": " + f.name);
    }
    if (t.kind != RMP_TYPE_RECORD) parts.push_back(a_.type_name(t.element) + ": ...");
    if (t.kind != RMP_TYPE_RECORD) commas = 0;
  } else {
    return out;
  }
  out.label = std::string(x.name) + "(";
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (k) out.label += x.kind == RMP_SYMBOL_ROUTINE ? "; " : ", ";
    out.parameters.push_back(static_cast<std::uint32_t>(out.label.size()));
    out.label += parts[k];
    out.parameters.push_back(static_cast<std::uint32_t>(out.label.size()));
  }
  out.label += ")" + behind;
  out.doc = a_.doc(u);
  out.active = commas;
  return out;
}

}  // namespace

std::span<const AttributeWord> attribute_words() { return kAttributeWords; }
std::string_view word_doc(std::string_view big) {
  for (const auto& [word, doc] : kDocs)
    if (word == big) return doc;
  return {};
}
bool is_word_of_place(std::string_view big) {
  static constexpr std::string_view kWords[] = {
      "SEC",   "FROM",     "AT",     "STEP",   "TIMEOUT", "PRIORITY", "ROBOT",
      "INPUT", "OUTPUT",   "PTP",    "LIN",    "CIRCLE",  "PATH",     "START",
      "STOP",  "CONTINUE", "CANCEL", "ENABLE", "DISABLE", "TEACH"};
  return std::find(std::begin(kWords), std::end(kWords), big) != std::end(kWords);
}

std::vector<SourceCompletion> complete(const Analysis& a, std::span<const SourceFile> files,
                                       std::uint32_t file, std::uint32_t at) {
  return Completer(a, file, at).run(files);
}
SourceSignature signature(const Analysis& a, std::uint32_t file, std::uint32_t at) {
  return Completer(a, file, at).call();
}

}  // namespace robomosp::irl
