// SPDX-License-Identifier: Apache-2.0
// Recursive descent with one place to look ahead, which goes on behind a fault at the next
// statement. Depth is bounded, since each level of a source takes one of this program's stack.
#include <string>
#include <utility>

#include "syntax.h"

namespace robomosp::irl {
namespace {

constexpr int kMostDepth = 200;
constexpr int kMostChain = 500;

class Parser {
 public:
  Parser(Source& s, Names& names, Faults& faults) : s_(s), names_(names), faults_(faults) {
    for (auto [word, number] :
         {std::pair{"SEC", &sec_},  {"FROM", &from_},       {"AT", &at_word_},
          {"STEP", &step_},         {"TIMEOUT", &timeout_}, {"PRIORITY", &priority_},
          {"ROBOT", &robot_},       {"INPUT", &input_},     {"OUTPUT", &output_},
          {"PTP", &ptp_},           {"LIN", &lin_},         {"CIRCLE", &circle_},
          {"PATH", &path_},         {"START", &start_},     {"STOP", &stop_},
          {"CONTINUE", &continue_}, {"CANCEL", &cancel_},   {"ENABLE", &enable_},
          {"DISABLE", &disable_},   {"TEACH", &teach_}})
      *number = names_.number(word);
  }

  void skip_bodies(bool skips) { skips_bodies_ = skips; }
  void unit(Unit kind) {
    s_.nodes.reserve(s_.tokens.size());
    if (kind == Unit::data_list) {
      const Id n = make(N::data_list);
      Tail tail(*this, n);
      tail.add(block());
      if (!is(Tok::end))
        fault("a data list can contain only lines such as \"place := POSE(...);\" only");
      finish(n);
      return;
    }
    const bool is_module = is(Tok::k_module);
    const Id n = make(is_module ? N::module : N::program);
    if (!is(Tok::k_program) && !is_module) {
      fault("a program must begin with PROGRAM and its name, not with " + shown(),
            "Such as: PROGRAM towers;");
      if (!is_section() && !is(Tok::k_begin)) return;
    } else {
      next();
      name_of(n, is_module ? "the module" : "the program");
      expect(Tok::semicolon, "\";\"", "behind the name");
    }
    Tail tail(*this, n);
    declarations(tail, true);
    if (!is_module && is(Tok::k_begin)) {
      next();
      tail.add(body());
    }
    const Tok end = is_module ? Tok::k_endmodule : Tok::k_endprogram;
    const char* word = is_module ? "ENDMODULE" : "ENDPROGRAM";
    if (is(Tok::end)) {
      fault(std::string("the source ends without ") + word,
            std::string("Write ") + word + "; at the end.");
    } else if (expect(end, word, "at the end")) {
      expect(Tok::semicolon, "\";\"", std::string("behind ") + word);
      if (!is(Tok::end))
        fault(shown() + " follows the end", "A file can contain only one program or module.");
    }
    finish(n);
  }

 private:
  using Id = std::uint32_t;

  // ---- tokens ----
  [[nodiscard]] const Token& tok(std::size_t ahead = 0) const {
    const std::size_t i = at_ + ahead;
    return s_.tokens[i < s_.tokens.size() ? i : s_.tokens.size() - 1];
  }
  [[nodiscard]] bool is(Tok k) const { return tok().kind == k; }
  [[nodiscard]] bool is_word(std::uint32_t word, std::size_t ahead = 0) const {
    return tok(ahead).kind == Tok::name && tok(ahead).name == word;
  }
  void next() {
    if (at_ + 1 < s_.tokens.size()) ++at_;
  }
  [[nodiscard]] std::string shown() const {
    if (is(Tok::end)) return "the end of the source";
    std::string_view w = s_.word(tok());
    return "\"" + std::string(w.substr(0, 40)) + (w.size() > 40 ? "..." : "") + "\"";
  }
  /// One fault at a place: those that follow from it are not said.
  void fault(std::string message, std::string hint = {}) {
    if (last_fault_ != at_ || !has_fault_)
      faults_.error(s_.file, tok(), std::move(message), std::move(hint));
    last_fault_ = at_;
    has_fault_ = true;
    is_lost_ = true;
  }
  /// A missing sign is said where it belongs: behind the last word that was right.
  bool expect(Tok k, const std::string& what, const std::string& where, std::string hint = {}) {
    if (is(k)) {
      next();
      return true;
    }
    if (k == Tok::semicolon && at_ > 0) {
      if (last_fault_ != at_ || !has_fault_) {
        Token behind = s_.tokens[at_ - 1];
        behind.column += behind.end - behind.begin;
        behind.begin = behind.end;
        faults_.error(s_.file, behind, "\";\" is missing " + where + ", before " + shown(),
                      std::move(hint));
      }
      last_fault_ = at_;
      has_fault_ = true;
      // Forgotten at the end of a line or a block: what follows is as whole as what was before.
      is_lost_ = is_lost_ || (tok().line == s_.tokens[at_ - 1].line && !ends_block(tok().kind));
      return false;
    }
    fault(what + " is missing " + where + ", before " + shown(), std::move(hint));
    return false;
  }
  [[nodiscard]] bool is_section() const {
    switch (tok().kind) {
      case Tok::k_const:
      case Tok::k_var:
      case Tok::k_type:
      case Tok::k_signal:
      case Tok::k_procedure:
      case Tok::k_function:
      case Tok::k_process:
      case Tok::k_interrupt:
      case Tok::k_system_specification:
      case Tok::k_datalist:
      case Tok::k_import:
      case Tok::k_export: return true;
      default: return false;
    }
  }
  [[nodiscard]] static bool ends_block(Tok k) {
    switch (k) {
      case Tok::end:
      case Tok::k_endprogram:
      case Tok::k_endmodule:
      case Tok::k_endproc:
      case Tok::k_endfct:
      case Tok::k_endprocess:
      case Tok::k_endinterrupt:
      case Tok::k_endif:
      case Tok::k_else:
      case Tok::k_elsif:
      case Tok::k_endwhile:
      case Tok::k_endfor:
      case Tok::k_until:
      case Tok::k_endloop:
      case Tok::k_endcase:
      case Tok::k_when:
      case Tok::k_default: return true;
      default: return false;
    }
  }
  [[nodiscard]] static bool begins_statement(Tok k) {
    switch (k) {
      case Tok::k_if:
      case Tok::k_while:
      case Tok::k_for:
      case Tok::k_repeat:
      case Tok::k_loop:
      case Tok::k_case:
      case Tok::k_exit:
      case Tok::k_goto:
      case Tok::k_label:
      case Tok::k_return:
      case Tok::k_wait:
      case Tok::k_pause:
      case Tok::k_halt:
      case Tok::k_move:
      case Tok::k_move_inc: return true;
      default: return false;
    }
  }
  /// Behind a fault: on to behind the next semicolon, or before a word that begins or ends
  /// something.
  void recover() {
    is_lost_ = false;
    while (!is(Tok::end)) {
      if (is(Tok::semicolon)) {
        next();
        return;
      }
      if (ends_block(tok().kind) || begins_statement(tok().kind) || is_section() ||
          is(Tok::k_begin) || is(Tok::k_endrecord))
        return;
      next();
    }
  }

  // ---- nodes ----
  Id make(N kind) {
    Node n;
    n.kind = kind;
    n.token = n.last = static_cast<std::uint32_t>(at_);
    s_.nodes.push_back(n);
    return static_cast<Id>(s_.nodes.size() - 1);
  }
  Node& node(Id n) { return s_.nodes[n]; }
  Id finish(Id n) {
    node(n).last = static_cast<std::uint32_t>(at_ > node(n).token ? at_ - 1 : at_);
    return n;
  }
  /// Appends children to a node.
  class Tail {
   public:
    Tail(Parser& p, Id owner) : p_(p), owner_(owner) {
      last_ = p_.node(owner).first;
      while (last_ != kNone && p_.node(last_).next != kNone) last_ = p_.node(last_).next;
    }
    void add(Id child) {
      if (child == kNone) return;
      if (last_ == kNone) p_.node(owner_).first = child;
      else p_.node(last_).next = child;
      last_ = child;
      Node& owner = p_.node(owner_);
      const int below = p_.node(child).depth + 1;
      if (below > owner.depth) owner.depth = static_cast<std::uint16_t>(below);
    }

   private:
    Parser& p_;
    Id owner_, last_;
  };
  /// Whether there is room for one level more; else it has been said, and the source is given up.
  class Level {
   public:
    explicit Level(Parser& p) : p_(p) { ++p_.depth_; }
    ~Level() { --p_.depth_; }
    Level(const Level&) = delete;
    Level& operator=(const Level&) = delete;
    [[nodiscard]] bool is_deep() const {
      if (p_.depth_ <= kMostDepth) return false;
      p_.fault("the source is nested more than " + std::to_string(kMostDepth) + " levels deep",
               "Put the inner part into a procedure or a variable.");
      p_.at_ = p_.s_.tokens.size() - 1;  // what follows would be faults of this one
      p_.last_fault_ = p_.at_;
      return true;
    }

   private:
    Parser& p_;
  };
  bool name_of(Id n, const std::string& what) {
    if (is(Tok::name)) {
      node(n).name = tok().name;
      node(n).name_token = static_cast<std::uint32_t>(at_);
      next();
      return true;
    }
    const bool is_reserved = tok().kind >= Tok::k_program;
    fault("the name of " + what + " is missing, before " + shown(),
          is_reserved ? shown() + " is a keyword of the language, not a name." : "");
    return false;
  }

  // ---- declarations ----
  void declarations(Tail& tail, bool is_outer) {
    while (!faults_.is_full()) {
      switch (tok().kind) {
        case Tok::k_system_specification:
        case Tok::k_datalist: {
          if (!is_outer) {
            fault(shown() + " is allowed only in the head of the program");
            recover();
            next_if_stuck();
            break;
          }
          const Id n = make(is(Tok::k_datalist) ? N::use_data_list : N::specification);
          next();
          node(n).name_token = static_cast<std::uint32_t>(at_);
          if (expect(Tok::string, "the name of a file in quotes", "here", "Such as: 'cell.ssi'"))
            expect(Tok::semicolon, "\";\"", "behind the name of the file");
          if (is_lost_) recover();
          else tail.add(finish(n));
          break;
        }
        case Tok::k_import:
        case Tok::k_export: {
          const Id n = make(is(Tok::k_import) ? N::import_ : N::export_);
          const bool is_import = is(Tok::k_import);
          next();
          Tail names(*this, n);
          do {
            const Id one = make(N::name);
            if (!name_of(one, "what is " + std::string(is_import ? "imported" : "exported"))) break;
            names.add(finish(one));
          } while (accept(Tok::comma));
          if (!is_lost_ && is_import && is_word(from_)) {
            next();
            name_of(n, "the module");
          }
          if (!is_lost_) expect(Tok::semicolon, "\";\"", "behind the names");
          if (is_lost_) recover();
          tail.add(finish(n));
          break;
        }
        case Tok::k_const: tail.add(section(N::const_section)); break;
        case Tok::k_var: tail.add(section(N::var_section)); break;
        case Tok::k_type: tail.add(section(N::type_section)); break;
        case Tok::k_signal: tail.add(section(N::signal_section)); break;
        case Tok::k_procedure:
          tail.add(routine(N::procedure, Tok::k_endproc, "ENDPROC", "the procedure"));
          break;
        case Tok::k_function:
          tail.add(routine(N::function, Tok::k_endfct, "ENDFCT", "the function"));
          break;
        case Tok::k_process:
          tail.add(routine(N::process, Tok::k_endprocess, "ENDPROCESS", "the process"));
          break;
        case Tok::k_interrupt:
          tail.add(routine(N::interrupt, Tok::k_endinterrupt, "ENDINTERRUPT", "the interrupt"));
          break;
        default: {
          if (is(Tok::k_begin) || is(Tok::k_endprogram) || is(Tok::k_endmodule) || is(Tok::end))
            return;
          if (!is_outer && ends_block(tok().kind)) return;
          const std::size_t before = at_;
          fault(shown() + " is not a declaration",
                "Declarations begin with CONST, TYPE, VAR, SIGNAL, PROCEDURE, FUNCTION, PROCESS or "
                "INTERRUPT; write statements behind BEGIN.");
          // Statements without their BEGIN are one fault, and not one each.
          is_lost_ = false;
          while (!is(Tok::end) && !is_section() && !is(Tok::k_begin) && !is(Tok::k_endprogram) &&
                 !is(Tok::k_endmodule) && !is(Tok::k_endproc) && !is(Tok::k_endfct) &&
                 !is(Tok::k_endprocess) && !is(Tok::k_endinterrupt))
            next();
          if (at_ == before) {
            next();
            accept(Tok::semicolon);
          } else if (is_outer && (is(Tok::k_endproc) || is(Tok::k_endfct) ||
                                  is(Tok::k_endprocess) || is(Tok::k_endinterrupt))) {
            next();
            accept(Tok::semicolon);
          }
        }
      }
    }
  }
  bool accept(Tok k) {
    if (!is(k)) return false;
    next();
    return true;
  }
  void next_if_stuck() {
    if (stuck_ == at_) next();
    stuck_ = at_;
  }

  Id section(N kind) {
    const Id n = make(kind);
    next();
    Tail tail(*this, n);
    while (!faults_.is_full() && !is_section() && !is(Tok::k_begin) && !ends_block(tok().kind)) {
      const std::size_t before = at_;
      Id d = kNone;
      if (kind == N::type_section) d = type_declaration();
      else if (kind == N::signal_section) d = signal();
      else d = variables("behind the declaration");
      if (is_lost_) recover();
      else tail.add(d);
      if (at_ == before) {
        // A word that begins a statement ends the section; its place is said by declarations().
        if (begins_statement(tok().kind)) break;
        next();
      }
    }
    return finish(n);
  }
  Id variables(const std::string& where) {
    const Id n = make(N::var_decl);
    Tail tail(*this, n);
    tail.add(type());
    if (is_lost_) return n;
    if (!expect(Tok::colon, "\":\"", "behind the type", "The type comes first: INT: a, b;"))
      return n;
    declarators(tail, true);
    if (!is_lost_) expect(Tok::semicolon, "\";\"", where);
    return finish(n);
  }
  void declarators(Tail& tail, bool may_have_value) {
    do {
      const Id one = make(N::declarator);
      if (!name_of(one, "a variable")) return;
      if (may_have_value && accept(Tok::assign)) Tail(*this, one).add(expression());
      tail.add(finish(one));
    } while (!is_lost_ && accept(Tok::comma));
  }
  Id type_declaration() {
    if (is_word(robot_)) {
      const Id n = make(N::robot_decl);
      next();
      if (name_of(n, "the robot") && expect(Tok::assign, "\":=\"", "behind the robot's name",
                                            "Such as: ROBOT arm := R_SPEC_TYPE(...);"))
        Tail(*this, n).add(expression());
      if (!is_lost_) expect(Tok::semicolon, "\";\"", "behind the robot");
      return finish(n);
    }
    const Id n = make(N::type_decl);
    Tail tail(*this, n);
    tail.add(type());
    if (!is_lost_ &&
        expect(Tok::colon, "\":\"", "behind the type",
               "The name of a type comes after it: RECORD ... ENDRECORD: NAME;") &&
        name_of(n, "the type"))
      expect(Tok::semicolon, "\";\"", "behind the type's name");
    return finish(n);
  }
  Id signal() {
    const Id n = make(N::signal_decl);
    if (!is_word(input_) && !is_word(output_)) {
      fault(shown() + " is neither INPUT nor OUTPUT", "Such as: INPUT BOOL: ready AT 1;");
      return n;
    }
    node(n).flag = is_word(output_) ? 1 : 0;
    next();
    Tail tail(*this, n);
    tail.add(type());
    if (is_lost_ || !expect(Tok::colon, "\":\"", "behind the signal's type") ||
        !name_of(n, "the signal"))
      return n;
    if (!is_word(at_word_)) {
      fault("AT and the signal's number are missing, before " + shown(),
            "Such as: INPUT BOOL: ready AT 1;");
      return n;
    }
    next();
    tail.add(expression());
    if (!is_lost_ && accept(Tok::comma)) tail.add(expression());
    if (!is_lost_) expect(Tok::semicolon, "\";\"", "behind the signal");
    return finish(n);
  }
  Id type() { return whole(any_type()); }
  Id any_type() {
    const Level level(*this);
    if (level.is_deep()) return make(N::bad);
    if (is(Tok::k_array)) {
      const Id n = make(N::type_array);
      Tail tail(*this, n);
      next();
      if (!expect(Tok::lbracket, "\"[\"", "behind ARRAY", "Such as: ARRAY [1..3] OF INT")) return n;
      do {
        const Id b = make(N::bounds);
        Tail both(*this, b);
        both.add(expression());
        if (is_lost_ || !expect(Tok::dots, "\"..\"", "between the bounds")) return n;
        both.add(expression());
        if (is_lost_) return n;
        tail.add(finish(b));
      } while (accept(Tok::comma));
      if (!expect(Tok::rbracket, "\"]\"", "behind the bounds") ||
          !expect(Tok::k_of, "OF", "behind the bounds of the array"))
        return n;
      tail.add(type());
      return finish(n);
    }
    if (is(Tok::k_list)) {
      const Id n = make(N::type_list);
      next();
      if (expect(Tok::k_of, "OF", "behind LIST")) Tail(*this, n).add(type());
      return finish(n);
    }
    if (is(Tok::k_record)) {
      const Id n = make(N::type_record);
      const Token open = tok();
      Tail tail(*this, n);
      next();
      while (!is(Tok::k_endrecord)) {
        if (is(Tok::end) || is_section() || is(Tok::k_begin) || ends_block(tok().kind)) {
          fault("ENDRECORD is missing for the RECORD of line " + std::to_string(open.line) +
                ", before " + shown());
          return n;
        }
        const std::size_t before = at_;
        const Id d = variables("behind the field");
        if (is_lost_) recover();
        else tail.add(d);
        if (at_ == before) next();
      }
      next();
      return finish(n);
    }
    const Id n = make(N::type_name);
    if (is(Tok::name)) {
      node(n).name = tok().name;
      node(n).name_token = static_cast<std::uint32_t>(at_);
      next();
    } else {
      fault(shown() + " is not a type",
            "Types are INT, REAL, BOOL, CHAR, STRING, "
            "ARRAY, RECORD, LIST, and names of types.");
    }
    return finish(n);
  }

  Id routine(N kind, Tok end, const char* end_word, const std::string& what) {
    const Id n = make(kind);
    const Token open = tok();
    const Level level(*this);
    if (level.is_deep()) return n;
    next();
    Tail tail(*this, n);
    if (name_of(n, what)) {
      if ((kind == N::procedure || kind == N::function) && is(Tok::lparen)) tail.add(params());
      if (!is_lost_ && kind == N::function &&
          expect(Tok::colon, "\":\" and the type of the result", "behind the function's head",
                 "Such as: FUNCTION twice (IN INT: a): INT;")) {
        const Id r = make(N::result);
        Tail(*this, r).add(type());
        tail.add(finish(r));
      }
      if (!is_lost_ && (kind == N::process || kind == N::interrupt) && is_word(priority_)) {
        next();
        const Id p = make(N::priority);
        Tail(*this, p).add(expression());
        tail.add(finish(p));
      }
      if (!is_lost_ && kind == N::interrupt &&
          expect(Tok::k_when, "WHEN and a condition", "behind the interrupt's name",
                 "Such as: INTERRUPT stop WHEN emergency;")) {
        const Id c = make(N::condition);
        Tail(*this, c).add(expression());
        tail.add(finish(c));
      }
      if (!is_lost_) expect(Tok::semicolon, "\";\"", "behind the head of " + what);
    }
    if (is_lost_) recover();
    declarations(tail, false);
    if (expect(Tok::k_begin, "BEGIN", "in " + what,
               "The statements of " + what + " are written between BEGIN and " + end_word + ".")) {
      tail.add(body());
      if (is(end)) {
        next();
        if (!expect(Tok::semicolon, "\";\"", std::string("behind ") + end_word)) is_lost_ = false;
      } else {
        fault(std::string(end_word) + " is missing for " + what + " of line " +
              std::to_string(open.line) + ", before " + shown());
        is_lost_ = false;
        // The end of another kind of routine is meant as this one's.
        if (is(Tok::k_endproc) || is(Tok::k_endfct) || is(Tok::k_endprocess) ||
            is(Tok::k_endinterrupt)) {
          next();
          accept(Tok::semicolon);
        }
      }
    } else {
      is_lost_ = false;
      accept_end(end);
    }
    return finish(n);
  }
  void accept_end(Tok end) {
    if (accept(end)) accept(Tok::semicolon);
  }
  Id params() {
    const Id n = make(N::params);
    Tail tail(*this, n);
    next();
    if (accept(Tok::rparen)) return finish(n);
    do {
      if (is(Tok::rparen)) break;  // a last ";" is harmless
      const Id p = make(N::param);
      if (is(Tok::k_out)) node(p).flag = 1;
      if (is(Tok::k_inout)) node(p).flag = 2;
      if (is(Tok::k_in) || is(Tok::k_out) || is(Tok::k_inout)) next();
      Tail inner(*this, p);
      inner.add(type());
      if (is_lost_ || !expect(Tok::colon, "\":\"", "behind the parameter's type",
                              "The type comes first: (IN INT: a, b; OUT REAL: c)"))
        return n;
      declarators(inner, false);
      if (is_lost_) return n;
      tail.add(finish(p));
    } while (accept(Tok::semicolon));
    expect(Tok::rparen, "\")\"", "behind the parameters");
    return finish(n);
  }

  // ---- statements ----
  /// The block of a routine or of the program.
  Id body() {
    if (!skips_bodies_) return block();
    const Id n = make(N::block);
    while (!is_section() && !ends_body(tok().kind)) next();
    return finish(n);
  }
  [[nodiscard]] static bool ends_body(Tok k) {
    return k == Tok::end || k == Tok::k_endproc || k == Tok::k_endfct || k == Tok::k_endprocess ||
           k == Tok::k_endinterrupt || k == Tok::k_endprogram || k == Tok::k_endmodule;
  }
  Id block() {
    const Id n = make(N::block);
    Tail tail(*this, n);
    while (!faults_.is_full() && !ends_block(tok().kind)) {
      if (is_section()) {
        // A routine behind the statements: what is before has lost its end.
        if (depth_ <= 2) return finish(n);
        break;
      }
      const std::size_t before = at_;
      if (accept(Tok::semicolon)) continue;
      const Id s = statement();
      if (is_lost_) recover();
      else tail.add(s);
      if (at_ == before) next();
    }
    return finish(n);
  }
  void semicolon(const std::string& behind) {
    if (!is_lost_) expect(Tok::semicolon, "\";\"", "behind " + behind);
  }
  /// The word that ends a compound statement, and its semicolon.
  void end_of(Tok end, const char* word, const char* begin, const Token& open) {
    if (is_lost_) return;
    if (is(end)) {
      next();
      semicolon(word);
      return;
    }
    fault(std::string(word) + " is missing for the " + begin + " of line " +
          std::to_string(open.line) + ", before " + shown());
    is_lost_ = false;
  }
  /// The head of a compound statement is wrong: its inside is read all the same.
  void head() {
    if (is_lost_) recover();
  }

  Id statement() {
    const Level level(*this);
    if (level.is_deep()) return kNone;
    const Token open = tok();
    switch (tok().kind) {
      case Tok::k_if: {
        const Id n = make(N::if_);
        Tail tail(*this, n);
        bool is_else = false;
        do {
          const Id arm = make(N::arm);
          node(arm).flag = is_else = is(Tok::k_else);
          next();
          Tail inner(*this, arm);
          if (!is_else) {
            inner.add(expression());
            head();
            accept(Tok::k_then);
          }
          inner.add(block());
          tail.add(finish(arm));
        } while (is(Tok::k_elsif) ? !is_else : is(Tok::k_else) && !is_else);
        if (is(Tok::k_else) || is(Tok::k_elsif)) {
          fault(shown() + " follows the ELSE of its IF", "ELSE must come last, and only once.");
          is_lost_ = false;
          while (is(Tok::k_else) || is(Tok::k_elsif)) {
            next();
            block();
          }
        }
        end_of(Tok::k_endif, "ENDIF", "IF", open);
        return finish(n);
      }
      case Tok::k_while: {
        const Id n = make(N::while_);
        next();
        Tail tail(*this, n);
        tail.add(expression());
        head();
        accept(Tok::k_do);
        tail.add(block());
        end_of(Tok::k_endwhile, "ENDWHILE", "WHILE", open);
        return finish(n);
      }
      case Tok::k_for: {
        const Id n = make(N::for_);
        next();
        Tail tail(*this, n);
        if (name_of(n, "the loop's variable") &&
            expect(Tok::assign, "\":=\"", "behind the loop's variable")) {
          tail.add(expression());
          if (!is_lost_) {
            if (is(Tok::k_to) || is(Tok::k_downto)) {
              node(n).flag = is(Tok::k_downto);
              next();
              tail.add(expression());
              if (!is_lost_ && is_word(step_)) {
                next();
                tail.add(expression());
              }
            } else {
              fault("TO or DOWNTO is missing, before " + shown(), "Such as: FOR i := 1 TO 10");
            }
          }
        }
        if (is_lost_) {
          node(n).kind = N::broken;
          node(n).first = kNone;
        }
        head();
        accept(Tok::k_do);
        Tail(*this, n).add(block());
        end_of(Tok::k_endfor, "ENDFOR", "FOR", open);
        return finish(n);
      }
      case Tok::k_repeat: {
        const Id n = make(N::repeat);
        next();
        Tail tail(*this, n);
        tail.add(block());
        if (expect(Tok::k_until, "UNTIL", "for the REPEAT of line " + std::to_string(open.line))) {
          tail.add(expression());
          semicolon("the condition");
        } else {
          node(n).kind = N::broken;
          is_lost_ = false;
        }
        return finish(n);
      }
      case Tok::k_loop: {
        const Id n = make(N::loop);
        next();
        Tail(*this, n).add(block());
        end_of(Tok::k_endloop, "ENDLOOP", "LOOP", open);
        return finish(n);
      }
      case Tok::k_case: return case_statement(open);
      case Tok::k_exit: return word(N::exit_, "EXIT");
      case Tok::k_halt: return word(N::halt, "HALT");
      case Tok::k_goto: {
        const Id n = make(N::goto_);
        next();
        if (name_of(n, "the label")) semicolon("the label's name");
        return finish(n);
      }
      case Tok::k_label: {
        const Id n = make(N::label);
        next();
        if (name_of(n, "the label")) expect(Tok::colon, "\":\"", "behind the label's name");
        return finish(n);
      }
      case Tok::k_return:
      case Tok::k_pause: {
        const Id n = make(is(Tok::k_return) ? N::return_ : N::pause);
        const std::string what = is(Tok::k_return) ? "RETURN" : "PAUSE";
        next();
        if (!is(Tok::semicolon)) Tail(*this, n).add(expression());
        semicolon(what);
        return finish(n);
      }
      case Tok::k_wait: {
        const Id n = make(N::wait_time);
        next();
        Tail tail(*this, n);
        if (accept(Tok::k_for)) {
          node(n).kind = N::wait_for;
          tail.add(expression());
          if (!is_lost_ && is_word(timeout_)) {
            next();
            tail.add(expression());
          }
        } else {
          tail.add(expression());
          if (!is_lost_) {
            if (is_word(sec_)) next();
            else
              fault("SEC is missing behind the time, before " + shown(),
                    "Write WAIT 0.5 SEC; or WAIT FOR condition;");
          }
        }
        semicolon("WAIT");
        return finish(n);
      }
      case Tok::k_move:
      case Tok::k_move_inc: return move();
      case Tok::name: break;
      default: {
        const Id n = make(N::halt);
        std::string hint;
        if (tok().kind == Tok::k_do || tok().kind == Tok::k_then || tok().kind == Tok::k_to)
          hint = "It belongs after the head of a statement that begins above.";
        fault(shown() + " is not a statement", hint);
        return n;
      }
    }
    for (const std::uint32_t w : {start_, stop_, continue_, cancel_, enable_, disable_})
      if (is_word(w) && tok(1).kind == Tok::name) {
        const Id n = make(N::process_stmt);
        node(n).flag = w == start_      ? 0
                       : w == stop_     ? 1
                       : w == continue_ ? 2
                       : w == cancel_   ? 3
                       : w == enable_   ? 4
                                        : 5;
        next();
        name_of(n, "the process");
        semicolon("the name");
        return finish(n);
      }
    if (is_word(teach_) && tok(1).kind == Tok::name) {
      const Id n = make(N::teach);
      next();
      Tail tail(*this, n);
      do {
        const Id v = make(N::name);
        if (!name_of(v, "a variable")) break;
        tail.add(finish(v));
      } while (accept(Tok::comma));
      semicolon("the variables");
      return finish(n);
    }
    const Id n = make(N::call_stmt);
    const Id what = primary();
    Tail tail(*this, n);
    tail.add(what);
    if (is_lost_) return n;
    if (accept(Tok::assign)) {
      node(n).kind = N::assign;
      tail.add(expression());
      semicolon("the value");
      return finish(n);
    }
    if (is(Tok::equal)) {
      fault("\"=\" compares and does not assign", "Write \":=\" to give a variable a value.");
      return n;
    }
    if (node(what).kind != N::call && node(what).kind != N::name) {
      fault("\":=\" is missing, before " + shown(),
            "A statement that begins with a variable must assign it.");
      return n;
    }
    semicolon("the call");
    return finish(n);
  }
  Id word(N kind, const char* text) {
    const Id n = make(kind);
    next();
    semicolon(text);
    return finish(n);
  }
  Id case_statement(const Token& open) {
    const Id n = make(N::case_);
    next();
    Tail tail(*this, n);
    tail.add(expression());
    if (!is_lost_) expect(Tok::k_of, "OF", "behind the value of CASE");
    head();
    if (!is(Tok::k_when) && !is(Tok::k_default) && !is(Tok::k_endcase)) {
      fault("WHEN is missing, before " + shown(), "Such as: CASE i OF WHEN 1, 2: ... ENDCASE;");
      is_lost_ = false;
      block();
    }
    bool has_default = false;
    while (is(Tok::k_when) || is(Tok::k_default)) {
      const Id arm = make(N::arm);
      Tail inner(*this, arm);
      if (has_default) {
        fault("a case follows DEFAULT", "DEFAULT must come last, and only once.");
        is_lost_ = false;
      }
      if (accept(Tok::k_default)) {
        node(arm).flag = 1;
        has_default = true;
      } else {
        next();
        const Id labels = make(N::labels);
        Tail each(*this, labels);
        do each.add(expression());
        while (!is_lost_ && accept(Tok::comma));
        inner.add(finish(labels));
      }
      if (!is_lost_) expect(Tok::colon, "\":\"", "behind the values of the arm");
      head();
      inner.add(block());
      tail.add(finish(arm));
    }
    end_of(Tok::k_endcase, "ENDCASE", "CASE", open);
    return finish(n);
  }
  Id move() {
    const Id n = make(N::move);
    node(n).flag = is(Tok::k_move_inc);
    next();
    const std::uint32_t kinds[] = {ptp_, lin_, circle_, path_};
    std::uint32_t kind = 0;
    while (kind < 4 && !is_word(kinds[kind])) ++kind;
    if (kind == 4) {
      fault(shown() + " is not one of PTP, LIN, CIRCLE and PATH", "Such as: MOVE LIN place;");
      return n;
    }
    node(n).flag = static_cast<std::uint8_t>(node(n).flag | (kind << 1U));
    next();
    Tail tail(*this, n);
    const Id targets = make(N::targets);
    Tail each(*this, targets);
    const auto is_attribute = [&](std::size_t ahead) {
      return tok(ahead).kind == Tok::name && tok(ahead + 1).kind == Tok::assign;
    };
    each.add(expression());
    while (!is_lost_ && is(Tok::comma) && !is_attribute(1)) {
      next();
      each.add(expression());
    }
    tail.add(finish(targets));
    while (!is_lost_ && (is_attribute(0) || (is(Tok::comma) && is_attribute(1)))) {
      accept(Tok::comma);
      const Id a = make(N::attribute);
      name_of(a, "an attribute");
      next();
      Tail(*this, a).add(expression());
      tail.add(finish(a));
    }
    if (!is_lost_ && is(Tok::k_until)) {
      const Id u = make(N::until);
      next();
      Tail inner(*this, u);
      inner.add(expression());
      if (!is_lost_ && accept(Tok::k_do)) name_of(u, "the procedure");
      tail.add(finish(u));
    }
    semicolon("the motion");
    return finish(n);
  }

  // ---- expressions, from loose to tight ----
  [[nodiscard]] int binding(Tok k) const {
    switch (k) {
      case Tok::k_or:
      case Tok::k_exor: return 1;
      case Tok::k_and: return 2;
      case Tok::equal:
      case Tok::not_equal:
      case Tok::less:
      case Tok::less_equal:
      case Tok::greater:
      case Tok::greater_equal: return 4;
      case Tok::plus:
      case Tok::minus: return 5;
      case Tok::star:
      case Tok::slash:
      case Tok::k_div:
      case Tok::k_mod:
      case Tok::at: return 6;
      default: return 0;
    }
  }
  /// What is not whole is never looked at again.
  Id whole(Id n) {
    if (is_lost_) {
      node(n).kind = N::bad;
      node(n).first = kNone;
      node(n).depth = 0;
    }
    return n;
  }
  Id expression(int least = 1) { return whole(binary(least)); }
  Id binary(int least) {
    const Level level(*this);
    if (level.is_deep()) return make(N::bad);
    Id left = kNone;
    if (is(Tok::k_not)) {
      // NOT is looser than what compares: NOT a = b is NOT (a = b).
      left = make(N::not_);
      if (least > 3) {
        fault("NOT follows an operator that binds tighter", "Put it in parentheses: (NOT a)");
        return left;
      }
      next();
      Tail(*this, left).add(expression(3));
      finish(left);
      least = least < 2 ? 1 : 2;
    } else {
      left = unary();
    }
    bool has_compared = node(left).kind == N::not_;
    while (!is_lost_) {
      const int b = binding(tok().kind);
      if (b == 0 || b < least) break;
      if (b == 4 && has_compared) {
        fault("comparisons cannot be chained", "Put one comparison in parentheses.");
        break;
      }
      if (b >= 4 && node(left).kind == N::not_) break;
      has_compared = b == 4;
      if (node(left).depth >= kMostChain) {
        fault("an expression combines more than " + std::to_string(kMostChain) + " values",
              "Split it over several assignments.");
        break;
      }
      const Id n = make(N::binary);
      node(n).op = tok().kind;
      node(n).name_token = static_cast<std::uint32_t>(at_);
      node(n).token = node(left).token;
      next();
      Tail tail(*this, n);
      tail.add(left);
      tail.add(expression(b == 4 ? 5 : b + 1));
      left = finish(n);
    }
    return left;
  }
  Id unary() {
    if (is(Tok::minus) || is(Tok::plus)) {
      const Level level(*this);
      if (level.is_deep()) return make(N::bad);
      const Id n = make(is(Tok::minus) ? N::negate : N::plus);
      next();
      Tail(*this, n).add(unary());
      return finish(n);
    }
    return primary();
  }
  Id arguments(Tok close, const char* sign, Tail& tail) {
    if (accept(close)) return kNone;
    do tail.add(expression());
    while (!is_lost_ && accept(Tok::comma));
    if (!is_lost_) expect(close, sign, "behind the values");
    return kNone;
  }
  Id primary() {
    const Level level(*this);
    if (level.is_deep()) return make(N::bad);
    Id n = kNone;
    switch (tok().kind) {
      case Tok::integer:
        n = make(N::integer);
        next();
        return n;
      case Tok::real:
        n = make(N::real);
        next();
        return n;
      case Tok::string:
        n = make(N::string);
        next();
        return n;
      case Tok::lparen: {
        n = make(N::aggregate);
        next();
        Tail tail(*this, n);
        if (is(Tok::rparen)) {
          fault("there is nothing between the parentheses");
          return n;
        }
        arguments(Tok::rparen, "\")\"", tail);
        const Id only = node(n).first;
        finish(n);
        // Parentheses round one value only group.
        if (!is_lost_ && only != kNone && node(only).next == kNone) node(n).flag = 1;
        return n;
      }
      case Tok::lbracket: {
        n = make(N::list);
        next();
        Tail tail(*this, n);
        arguments(Tok::rbracket, "\"]\"", tail);
        return finish(n);
      }
      case Tok::name: break;
      default:
        n = make(N::bad);
        fault(shown() + " is not a value",
              tok().kind >= Tok::k_program ? shown() + " is a keyword of the language, not a name."
                                           : "");
        return n;
    }
    n = make(N::name);
    name_of(n, "a variable");
    if (is(Tok::lparen)) {
      node(n).kind = N::call;
      next();
      Tail tail(*this, n);
      arguments(Tok::rparen, "\")\"", tail);
      finish(n);
    }
    int chain = 0;
    while (!is_lost_ && (is(Tok::dot) || is(Tok::lbracket))) {
      if (++chain > kMostDepth) {
        fault("a place is more than " + std::to_string(kMostDepth) + " levels deep");
        break;
      }
      const Id outer = make(is(Tok::dot) ? N::field : N::index);
      node(outer).token = node(n).token;
      Tail tail(*this, outer);
      tail.add(n);
      if (accept(Tok::dot)) {
        name_of(outer, "a field");
      } else {
        next();
        if (is(Tok::rbracket)) fault("the index is missing between the brackets");
        else arguments(Tok::rbracket, "\"]\"", tail);
      }
      n = finish(outer);
    }
    return n;
  }

  Source& s_;
  Names& names_;
  Faults& faults_;
  std::size_t at_ = 0, last_fault_ = 0, stuck_ = 0;
  bool has_fault_ = false;
  bool is_lost_ = false;  ///< behind a fault that nobody has recovered from
  int depth_ = 0;
  bool skips_bodies_ = false;
  std::uint32_t sec_ = 0, from_ = 0, at_word_ = 0, step_ = 0, timeout_ = 0, priority_ = 0,
                robot_ = 0, input_ = 0, output_ = 0, ptp_ = 0, lin_ = 0, circle_ = 0, path_ = 0,
                start_ = 0, stop_ = 0, continue_ = 0, cancel_ = 0, enable_ = 0, disable_ = 0,
                teach_ = 0;
};

}  // namespace

void parse(Source& source, Unit unit, Names& names, Faults& faults, bool skips_bodies) {
  Parser parser(source, names, faults);
  parser.skip_bodies(skips_bodies);
  parser.unit(unit);
}

}  // namespace robomosp::irl
