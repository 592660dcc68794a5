// SPDX-License-Identifier: Apache-2.0
// The tree as source: one statement a line, two blanks a level, words in capitals, parentheses only
// where they were.
#include "syntax.h"

namespace robomosp::irl {
namespace {

class Printer {
 public:
  explicit Printer(const Source& s) : s_(s) {}
  std::string run() {
    if (s_.nodes.empty()) return {};
    const Node& n = s_.nodes[0];
    if (n.kind == N::data_list) {
      --depth_;
      block(n.first);
      return std::move(out_);
    }
    const bool is_module = n.kind == N::module;
    line((is_module ? "MODULE " : "PROGRAM ") + name(n) + ";");
    --depth_;
    parts(n.first);
    ++depth_;
    line(is_module ? "ENDMODULE;" : "ENDPROGRAM;");
    return std::move(out_);
  }

 private:
  using Id = std::uint32_t;
  [[nodiscard]] const Node& at(Id n) const { return s_.nodes[n]; }
  [[nodiscard]] std::string name(const Node& n) const {
    return n.name == kNone ? "" : std::string(s_.word(s_.tokens[n.name_token]));
  }
  [[nodiscard]] std::string word(const Node& n) const {
    return std::string(s_.word(s_.tokens[n.token]));
  }
  void line(const std::string& text) {
    out_.append(static_cast<std::size_t>(2 * depth_), ' ');
    out_ += text + "\n";
  }
  void block(Id n) {
    if (n == kNone) return;
    ++depth_;
    for (Id s = at(n).first; s != kNone; s = at(s).next) statement(at(s));
    --depth_;
  }
  [[nodiscard]] std::string names(Id n) const {
    std::string out;
    for (; n != kNone; n = at(n).next) out += (out.empty() ? "" : ", ") + name(at(n));
    return out;
  }
  std::string list(Id n) {
    std::string out;
    for (; n != kNone; n = at(n).next) {
      if (!out.empty()) out += ", ";
      out += expression(n);
    }
    return out;
  }

  /// Sections, routines and the block of a program or routine.
  void parts(Id n) {
    ++depth_;
    for (; n != kNone; n = at(n).next) {
      const Node& x = at(n);
      switch (x.kind) {
        case N::specification:
          line("SYSTEM_SPECIFICATION " + std::string(s_.word(s_.tokens[x.name_token])) + ";");
          break;
        case N::use_data_list:
          line("DATALIST " + std::string(s_.word(s_.tokens[x.name_token])) + ";");
          break;
        case N::import_:
        case N::export_:
          line((x.kind == N::import_ ? "IMPORT " : "EXPORT ") + names(x.first) +
               (x.name == kNone ? "" : " FROM " + name(x)) + ";");
          break;
        case N::const_section: section("CONST", x); break;
        case N::var_section: section("VAR", x); break;
        case N::type_section: section("TYPE", x); break;
        case N::signal_section: section("SIGNAL", x); break;
        case N::procedure: routine("PROCEDURE ", "ENDPROC;", x); break;
        case N::function: routine("FUNCTION ", "ENDFCT;", x); break;
        case N::process: routine("PROCESS ", "ENDPROCESS;", x); break;
        case N::interrupt: routine("INTERRUPT ", "ENDINTERRUPT;", x); break;
        case N::block:
          line("BEGIN");
          block(n);
          break;
        default: break;
      }
    }
    --depth_;
  }
  void section(const char* word, const Node& x) {
    line(word);
    ++depth_;
    for (Id d = x.first; d != kNone; d = at(d).next) {
      const Node& n = at(d);
      if (n.kind == N::var_decl) line(variables(n) + ";");
      else if (n.kind == N::robot_decl)
        line("ROBOT " + name(n) + " := " + expression(n.first) + ";");
      else if (n.kind == N::type_decl) line(type(n.first) + ": " + name(n) + ";");
      else if (n.kind == N::signal_decl)
        line(std::string(n.flag ? "OUTPUT " : "INPUT ") + type(n.first) + ": " + name(n) + " AT " +
             list(at(n.first).next) + ";");
    }
    --depth_;
  }
  std::string variables(const Node& n) {
    std::string out = type(n.first) + ":";
    for (Id d = at(n.first).next; d != kNone; d = at(d).next) {
      out += (d == at(n.first).next ? " " : ", ") + name(at(d));
      if (at(d).first != kNone) out += " := " + expression(at(d).first);
    }
    return out;
  }
  std::string type(Id t) {
    if (t == kNone) return {};
    const Node& n = at(t);
    switch (n.kind) {
      case N::type_list: return "LIST OF " + type(n.first);
      case N::type_record: {
        std::string out = "RECORD";
        for (Id d = n.first; d != kNone; d = at(d).next) out += " " + variables(at(d)) + ";";
        return out + " ENDRECORD";
      }
      case N::type_array: {
        std::string out = "ARRAY [";
        Id b = n.first;
        for (; at(b).kind == N::bounds; b = at(b).next) {
          if (b != n.first) out += ", ";
          out += expression(at(b).first);
          out += "..";
          out += expression(at(at(b).first).next);
        }
        return out + "] OF " + type(b);
      }
      default: return name(n);
    }
  }
  void routine(const std::string& word, const char* end, const Node& x) {
    std::string head = word + name(x);
    Id n = x.first;
    for (; n != kNone; n = at(n).next) {
      const Node& c = at(n);
      if (c.kind == N::params) {
        static constexpr const char* kModes[] = {"IN ", "OUT ", "INOUT "};
        head += " (";
        for (Id p = c.first; p != kNone; p = at(p).next)
          head += (p == c.first ? "" : "; ") + std::string(kModes[at(p).flag]) + variables(at(p));
        head += ")";
      } else if (c.kind == N::result) {
        head += ": " + type(c.first);
      } else if (c.kind == N::priority) {
        head += " PRIORITY " + expression(c.first);
      } else if (c.kind == N::condition) {
        head += " WHEN " + expression(c.first);
      } else {
        break;
      }
    }
    line(head + ";");
    --depth_;
    parts(n);
    ++depth_;
    line(end);
  }

  void statement(const Node& n) {
    switch (n.kind) {
      case N::assign:
        line(expression(n.first) + " := " + expression(at(n.first).next) + ";");
        break;
      case N::call_stmt: line(expression(n.first) + ";"); break;
      case N::if_: {
        const char* word = "IF ";
        for (Id a = n.first; a != kNone; a = at(a).next) {
          const Node& arm = at(a);
          if (arm.flag) {
            line("ELSE");
            block(arm.first);
          } else {
            line(word + expression(arm.first) + " THEN");
            block(at(arm.first).next);
          }
          word = "ELSIF ";
        }
        line("ENDIF;");
        break;
      }
      case N::while_:
        line("WHILE " + expression(n.first) + " DO");
        block(at(n.first).next);
        line("ENDWHILE;");
        break;
      case N::for_: {
        const Id to = at(n.first).next;
        Id body = at(to).next;
        std::string head = "FOR " + name(n) + " := " + expression(n.first) +
                           (n.flag ? " DOWNTO " : " TO ") + expression(to);
        if (at(body).kind != N::block) {
          head += " STEP " + expression(body);
          body = at(body).next;
        }
        line(head + " DO");
        block(body);
        line("ENDFOR;");
        break;
      }
      case N::repeat:
        line("REPEAT");
        block(n.first);
        line("UNTIL " + expression(at(n.first).next) + ";");
        break;
      case N::loop:
        line("LOOP");
        block(n.first);
        line("ENDLOOP;");
        break;
      case N::case_:
        line("CASE " + expression(n.first) + " OF");
        ++depth_;
        for (Id a = at(n.first).next; a != kNone; a = at(a).next) {
          const Node& arm = at(a);
          if (arm.flag) {
            line("DEFAULT:");
            block(arm.first);
          } else {
            line("WHEN " + list(at(arm.first).first) + ":");
            block(at(arm.first).next);
          }
        }
        --depth_;
        line("ENDCASE;");
        break;
      case N::exit_: line("EXIT;"); break;
      case N::halt: line("HALT;"); break;
      case N::goto_: line("GOTO " + name(n) + ";"); break;
      case N::label: line("LABEL " + name(n) + ":"); break;
      case N::return_:
        line(n.first == kNone ? "RETURN;" : "RETURN " + expression(n.first) + ";");
        break;
      case N::pause:
        line(n.first == kNone ? "PAUSE;" : "PAUSE " + expression(n.first) + ";");
        break;
      case N::wait_time: line("WAIT " + expression(n.first) + " SEC;"); break;
      case N::wait_for: {
        const Id limit = at(n.first).next;
        line("WAIT FOR " + expression(n.first) +
             (limit == kNone ? "" : " TIMEOUT " + expression(limit)) + ";");
        break;
      }
      case N::move: {
        static constexpr const char* kKinds[] = {"PTP ", "LIN ", "CIRCLE ", "PATH "};
        std::string text = std::string(n.flag & 1U ? "MOVE_INC " : "MOVE ") + kKinds[n.flag >> 1U] +
                           list(at(n.first).first);
        for (Id a = at(n.first).next; a != kNone; a = at(a).next) {
          if (at(a).kind == N::attribute) {
            text += " " + name(at(a)) + " := " + expression(at(a).first);
          } else {
            text += " UNTIL " + expression(at(a).first);
            if (at(a).name != kNone) text += " DO " + name(at(a));
          }
        }
        line(text + ";");
        break;
      }
      case N::process_stmt: {
        static constexpr const char* kWords[] = {"START ",  "STOP ",   "CONTINUE ",
                                                 "CANCEL ", "ENABLE ", "DISABLE "};
        line(kWords[n.flag] + name(n) + ";");
        break;
      }
      case N::teach: line("TEACH " + names(n.first) + ";"); break;
      default: break;
    }
  }

  std::string expression(Id id) {
    if (id == kNone) return {};
    const Node& n = at(id);
    switch (n.kind) {
      case N::integer:
      case N::real:
      case N::string: return word(n);
      case N::name: return name(n);
      case N::call: return name(n) + "(" + list(n.first) + ")";
      case N::field: return expression(n.first) + "." + name(n);
      case N::index: return expression(n.first) + "[" + list(at(n.first).next) + "]";
      case N::aggregate: return "(" + list(n.first) + ")";
      case N::list: return "[" + list(n.first) + "]";
      case N::negate: return "-" + expression(n.first);
      case N::plus: return "+" + expression(n.first);
      case N::not_: return "NOT " + expression(n.first);
      case N::binary:
        return expression(n.first) + " " + upper(s_.word(s_.tokens[n.name_token])) + " " +
               expression(at(n.first).next);
      default: return {};
    }
  }

  const Source& s_;
  std::string out_;
  int depth_ = 0;
};

}  // namespace

std::string print(const Source& source) { return Printer(source).run(); }

}  // namespace robomosp::irl
