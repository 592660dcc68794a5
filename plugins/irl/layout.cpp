// SPDX-License-Identifier: Apache-2.0
// The usual layout of a source: lines stay lines, their blanks change. Comments and strings keep
// every byte, and the tokens before and after are the same; it is looked at, each time.
#include <algorithm>
#include <utility>

#include "editing.h"

namespace robomosp::irl {
namespace {

using Id = std::uint32_t;

struct Item {
  std::uint32_t begin = 0, end = 0;
  Id token = kNone;  ///< kNone = a comment
};

class Layout {
 public:
  Layout(const Source& s, const SourceLayout& how, std::vector<Item> items)
      : s_(s), how_(how), items_(std::move(items)) {
    starts_.resize(s.tokens.size());
    of_motion_.resize(s.tokens.size());
    for (const Node& n : s.nodes) {
      if (n.kind == N::until) of_motion_[n.token] = true;
      if (begins_line(n.kind)) starts_[n.token] = true;
    }
    eol_ = s.text.find("\r\n") != std::string_view::npos &&
                   2 * std::count(s.text.begin(), s.text.end(), '\r') >
                       std::count(s.text.begin(), s.text.end(), '\n')
               ? "\r\n"
               : "\n";
  }

  std::string run() {
    std::string out;
    out.reserve(s_.text.size() + 64);
    levels();
    for (std::size_t i = 0; i < items_.size(); ++i) {
      const Item& x = items_[i];
      const std::size_t lines = i == 0 ? 1 : newlines(items_[i - 1].end, x.begin);
      if (i == 0 || lines > 0) {
        if (i > 0)
          for (std::size_t k = 0; k < std::min<std::size_t>(lines, 2); ++k) out += eol_;
        out.append(std::size_t{level(i)} * how_.indent, ' ');
      } else {
        out.append(blanks(i), ' ');
      }
      std::string word(s_.text.substr(x.begin, x.end - x.begin));
      if (x.token != kNone && s_.tokens[x.token].kind >= Tok::k_program &&
          how_.words != SourceCase::keep)
        for (char& c : word) {
          if (how_.words == SourceCase::upper && c >= 'a' && c <= 'z')
            c = static_cast<char>(c - 'a' + 'A');
          if (how_.words == SourceCase::lower && c >= 'A' && c <= 'Z')
            c = static_cast<char>(c - 'A' + 'a');
        }
      out += word;
    }
    if (!items_.empty()) out += eol_;
    return out;
  }

 private:
  static bool begins_line(N k) {
    switch (k) {
      case N::program:
      case N::module:
      case N::specification:
      case N::use_data_list:
      case N::import_:
      case N::export_:
      case N::const_section:
      case N::var_section:
      case N::type_section:
      case N::signal_section:
      case N::var_decl:
      case N::type_decl:
      case N::robot_decl:
      case N::signal_decl:
      case N::procedure:
      case N::function:
      case N::process:
      case N::interrupt: return true;
      default:
        return (k >= N::assign && k <= N::arm) || (k >= N::case_ && k <= N::move) ||
               k == N::process_stmt || k == N::teach || k == N::broken;
    }
  }
  static bool closes(Tok k) {
    switch (k) {
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
      case Tok::k_endloop:
      case Tok::k_endcase:
      case Tok::k_endrecord: return true;
      default: return false;
    }
  }
  [[nodiscard]] std::size_t newlines(Id from, Id to) const {
    return static_cast<std::size_t>(std::count(s_.text.begin() + from, s_.text.begin() + to, '\n'));
  }

  // ---- how deep each token is ----
  enum class Open : std::uint8_t { routine, section, body, record, statement, cases, arm };
  struct Frame {
    Open what;
    Id level;  ///< of the line that opens it
  };
  [[nodiscard]] Id inner() const {
    if (open_.empty()) return 0;
    return open_.back().level + (open_.back().what == Open::routine ? 0 : 1);
  }
  /// Takes off frames up to one of a kind, which is taken as well; its level.
  Id close(Open what) {
    for (std::size_t i = open_.size(); i-- > 0;) {
      if (open_[i].what != what) continue;
      const Id level = open_[i].level;
      open_.resize(i);
      return level;
    }
    return inner();
  }
  void drop(Open what) {
    if (!open_.empty() && open_.back().what == what) open_.pop_back();
  }
  void levels() {
    levels_.resize(s_.tokens.size());
    before_.resize(s_.tokens.size());
    Id statement = 0;
    for (Id t = 0; t < s_.tokens.size(); ++t) {
      const Tok k = s_.tokens[t].kind;
      before_[t] = inner();
      const bool is_wait_for = k == Tok::k_for && t > 0 && s_.tokens[t - 1].kind == Tok::k_wait;
      bool is_line = starts_[t];
      switch (k) {
        case Tok::k_const:
        case Tok::k_var:
        case Tok::k_type:
        case Tok::k_signal:
          drop(Open::section);
          levels_[t] = statement = inner();
          open_.push_back({Open::section, statement});
          continue;
        case Tok::k_procedure:
        case Tok::k_function:
        case Tok::k_process:
        case Tok::k_interrupt:
          drop(Open::section);
          levels_[t] = statement = inner();
          open_.push_back({Open::routine, statement});
          continue;
        case Tok::k_system_specification:
        case Tok::k_datalist:
        case Tok::k_import:
        case Tok::k_export:
          drop(Open::section);
          levels_[t] = statement = inner();
          continue;
        case Tok::k_begin:
          drop(Open::section);
          levels_[t] = statement = inner();
          open_.push_back({Open::body, statement});
          continue;
        case Tok::k_endprogram:
        case Tok::k_endmodule:
          open_.clear();
          levels_[t] = statement = 0;
          continue;
        case Tok::k_endproc:
        case Tok::k_endfct:
        case Tok::k_endprocess:
        case Tok::k_endinterrupt: levels_[t] = statement = close(Open::routine); continue;
        case Tok::k_record:
          if (is_line || starts_line_of_type(t)) statement = inner();
          levels_[t] = is_line ? statement : statement + 2;
          open_.push_back({Open::record, statement});
          continue;
        case Tok::k_endrecord: levels_[t] = statement = close(Open::record); continue;
        case Tok::k_if:
        case Tok::k_while:
        case Tok::k_repeat:
        case Tok::k_loop:
        case Tok::k_for:
          if (is_wait_for) break;
          levels_[t] = statement = inner();
          open_.push_back({Open::statement, statement});
          continue;
        case Tok::k_else:
        case Tok::k_elsif:
          levels_[t] = statement = close(Open::statement);
          open_.push_back({Open::statement, statement});
          continue;
        case Tok::k_endif:
        case Tok::k_endwhile:
        case Tok::k_endfor:
        case Tok::k_endloop: levels_[t] = statement = close(Open::statement); continue;
        case Tok::k_until:
          if (of_motion_[t]) break;
          levels_[t] = statement = close(Open::statement);
          continue;
        case Tok::k_case:
          levels_[t] = statement = inner();
          open_.push_back({Open::cases, statement});
          continue;
        case Tok::k_when:
          if (!open_.empty() &&
              (open_.back().what == Open::arm || open_.back().what == Open::cases)) {
            drop(Open::arm);
            levels_[t] = statement = inner();
            open_.push_back({Open::arm, statement});
            continue;
          }
          break;  // of an interrupt
        case Tok::k_default:
          drop(Open::arm);
          levels_[t] = statement = inner();
          open_.push_back({Open::arm, statement});
          continue;
        case Tok::k_endcase: levels_[t] = statement = close(Open::cases); continue;
        case Tok::k_then:
        case Tok::k_do:
        case Tok::k_of: levels_[t] = statement; continue;
        case Tok::end: levels_[t] = 0; continue;
        default: break;
      }
      if (is_line) statement = inner();
      levels_[t] = is_line ? statement : statement + 2;
    }
  }
  /// Whether a RECORD is the first of its declaration.
  [[nodiscard]] bool starts_line_of_type(Id t) const {
    return t > 0 &&
           (s_.tokens[t - 1].kind == Tok::semicolon || s_.tokens[t - 1].kind == Tok::k_type);
  }
  [[nodiscard]] Id level(std::size_t item) const {
    if (items_[item].token != kNone) return levels_[items_[item].token];
    // A comment goes with what follows, and with what is before where that ends.
    std::size_t next = item;
    while (next < items_.size() && items_[next].token == kNone) ++next;
    if (next == items_.size()) return 0;
    const Id t = items_[next].token;
    const Tok k = s_.tokens[t].kind;
    const bool is_end = closes(k) || (k == Tok::k_until && !of_motion_[t]);
    if (k == Tok::k_when || k == Tok::k_default) return levels_[t];
    return is_end ? before_[t] : levels_[t];
  }

  // ---- blanks within a line ----
  [[nodiscard]] bool is_operand(Id t) const {
    switch (s_.tokens[t].kind) {
      case Tok::name:
      case Tok::integer:
      case Tok::real:
      case Tok::string:
      case Tok::rparen:
      case Tok::rbracket: return true;
      default: return false;
    }
  }
  [[nodiscard]] std::size_t blanks(std::size_t item) const {
    const Item &a = items_[item - 1], &b = items_[item];
    if (b.token == kNone) return std::max<std::size_t>(1, b.begin - a.end);
    if (a.token == kNone) return 1;
    const Tok x = s_.tokens[a.token].kind, y = s_.tokens[b.token].kind;
    if (y == Tok::semicolon || y == Tok::comma || y == Tok::rparen || y == Tok::rbracket ||
        y == Tok::colon)
      return 0;
    if (x == Tok::lparen || x == Tok::lbracket) return 0;
    if (x == Tok::dots || y == Tok::dots) return y == Tok::dot || x == Tok::dot ? 1 : 0;
    if (y == Tok::dot) return x == Tok::integer || x == Tok::real || x == Tok::dot ? 1 : 0;
    if (x == Tok::dot) return y == Tok::dot ? 1 : 0;
    if (y == Tok::lparen) {
      if (x != Tok::name) return 1;
      const bool is_head = a.token > 0 && (s_.tokens[a.token - 1].kind == Tok::k_procedure ||
                                           s_.tokens[a.token - 1].kind == Tok::k_function);
      return is_head || is_word_of_place(upper(s_.word(s_.tokens[a.token]))) ? 1 : 0;
    }
    if (y == Tok::lbracket) return x == Tok::name || x == Tok::rbracket || x == Tok::rparen ? 0 : 1;
    if ((x == Tok::minus || x == Tok::plus) && (a.token == 0 || !is_operand(a.token - 1))) return 0;
    return 1;
  }

  const Source& s_;
  const SourceLayout& how_;
  std::vector<Item> items_;
  std::vector<bool> starts_, of_motion_;
  std::vector<Frame> open_;
  std::vector<Id> levels_, before_;
  std::string eol_;
};

std::vector<Item> items_of(const Source& s) {
  std::vector<Item> out;
  Id from = 0;
  for (Id t = 0; t < s.tokens.size(); ++t) {
    const Token& x = s.tokens[t];
    each_gap(s.text, from, x.begin, [&](Gap g, Id b, Id e) {
      if (g != Gap::blanks) out.push_back({b, e, kNone});
    });
    from = x.end;
    if (x.kind != Tok::end) out.push_back({x.begin, x.end, t});
  }
  return out;
}

}  // namespace

Result<std::string> lay_out(std::string_view name, std::string_view text,
                            const SourceLayout& layout) {
  constexpr std::uint32_t kMostIndent = 16;
  if (layout.indent > kMostIndent)
    return error(
        ErrorCode::invalid_argument,
        "the indentation of a level must be 0 to 16 blanks, not " + std::to_string(layout.indent),
        {}, "indent");
  Names names;
  Faults faults;
  Source s;
  s.name = name;
  s.text = text;
  scan(s, names, faults);
  if (!faults.all.empty()) {
    const Fault& f = faults.all.front();
    return error(
        ErrorCode::syntax, f.message + ", so the text keeps its layout", f.hint,
        std::string(name) + ":" + std::to_string(f.at.line) + ":" + std::to_string(f.at.column));
  }
  const std::string_view extension = name.size() > 4 ? name.substr(name.size() - 4) : name;
  parse(s, upper(extension) == ".DLS" ? Unit::data_list : Unit::program, names, faults);
  std::string out = Layout(s, layout, items_of(s)).run();
  // The same tokens and comments.
  Source t;
  Faults none;
  t.text = out;
  scan(t, names, none);
  const std::vector<Item> before = items_of(s), after = items_of(t);
  bool is_same = before.size() == after.size() && none.all.empty();
  for (std::size_t i = 0; is_same && i < before.size(); ++i) {
    const std::string_view x = text.substr(before[i].begin, before[i].end - before[i].begin),
                           y = t.text.substr(after[i].begin, after[i].end - after[i].begin);
    const bool is_word =
        before[i].token != kNone && s.tokens[before[i].token].kind >= Tok::k_program;
    is_same = (before[i].token == kNone) == (after[i].token == kNone) &&
              (before[i].token == kNone ||
               s.tokens[before[i].token].kind == t.tokens[after[i].token].kind) &&
              (is_word ? upper(x) == upper(y) : x == y);
  }
  if (!is_same)
    return error(ErrorCode::internal,
                 "the layout would change more than blanks, so the text stays unchanged",
                 "Correct the faults that program.check reports first.", std::string(name));
  return out;
}

}  // namespace robomosp::irl
