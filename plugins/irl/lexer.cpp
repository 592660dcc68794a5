// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <utility>

#include "syntax.h"

namespace robomosp::irl {
namespace {

constexpr std::array<std::pair<std::string_view, Tok>, 64> kKeywords{{
    {"PROGRAM", Tok::k_program},
    {"ENDPROGRAM", Tok::k_endprogram},
    {"MODULE", Tok::k_module},
    {"ENDMODULE", Tok::k_endmodule},
    {"SYSTEM_SPECIFICATION", Tok::k_system_specification},
    {"DATALIST", Tok::k_datalist},
    {"IMPORT", Tok::k_import},
    {"EXPORT", Tok::k_export},
    {"CONST", Tok::k_const},
    {"VAR", Tok::k_var},
    {"TYPE", Tok::k_type},
    {"SIGNAL", Tok::k_signal},
    {"RECORD", Tok::k_record},
    {"ENDRECORD", Tok::k_endrecord},
    {"ARRAY", Tok::k_array},
    {"OF", Tok::k_of},
    {"LIST", Tok::k_list},
    {"PROCEDURE", Tok::k_procedure},
    {"ENDPROC", Tok::k_endproc},
    {"FUNCTION", Tok::k_function},
    {"ENDFCT", Tok::k_endfct},
    {"PROCESS", Tok::k_process},
    {"ENDPROCESS", Tok::k_endprocess},
    {"INTERRUPT", Tok::k_interrupt},
    {"ENDINTERRUPT", Tok::k_endinterrupt},
    {"BEGIN", Tok::k_begin},
    {"IF", Tok::k_if},
    {"THEN", Tok::k_then},
    {"ELSIF", Tok::k_elsif},
    {"ELSE", Tok::k_else},
    {"ENDIF", Tok::k_endif},
    {"WHILE", Tok::k_while},
    {"DO", Tok::k_do},
    {"ENDWHILE", Tok::k_endwhile},
    {"FOR", Tok::k_for},
    {"TO", Tok::k_to},
    {"DOWNTO", Tok::k_downto},
    {"ENDFOR", Tok::k_endfor},
    {"REPEAT", Tok::k_repeat},
    {"UNTIL", Tok::k_until},
    {"LOOP", Tok::k_loop},
    {"ENDLOOP", Tok::k_endloop},
    {"EXIT", Tok::k_exit},
    {"CASE", Tok::k_case},
    {"WHEN", Tok::k_when},
    {"DEFAULT", Tok::k_default},
    {"ENDCASE", Tok::k_endcase},
    {"GOTO", Tok::k_goto},
    {"LABEL", Tok::k_label},
    {"RETURN", Tok::k_return},
    {"WAIT", Tok::k_wait},
    {"PAUSE", Tok::k_pause},
    {"HALT", Tok::k_halt},
    {"MOVE", Tok::k_move},
    {"MOVE_INC", Tok::k_move_inc},
    {"AND", Tok::k_and},
    {"OR", Tok::k_or},
    {"EXOR", Tok::k_exor},
    {"NOT", Tok::k_not},
    {"DIV", Tok::k_div},
    {"MOD", Tok::k_mod},
    {"IN", Tok::k_in},
    {"OUT", Tok::k_out},
    {"INOUT", Tok::k_inout},
}};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_part(char c) { return is_letter(c) || is_digit(c) || c == '_'; }

class Scanner {
 public:
  Scanner(Source& s, Names& names, Faults& faults) : s_(s), names_(names), faults_(faults) {
    for (const auto& [word, kind] : kKeywords)
      if (!word.empty()) words_.emplace_back(names_.number(word), kind);
    for (const auto& [n, kind] : words_) {
      if (by_number_.size() <= n) by_number_.resize(n + 1, Tok::name);
      by_number_[n] = kind;
    }
  }
  void run() {
    s_.tokens.reserve(s_.text.size() / 4 + 8);
    while (true) {
      skip();
      begin_ = at_;
      if (at_ >= s_.text.size()) break;
      one();
    }
    add(Tok::end);
  }

 private:
  [[nodiscard]] char peek(std::size_t ahead = 0) const {
    return at_ + ahead < s_.text.size() ? s_.text[at_ + ahead] : '\0';
  }
  [[nodiscard]] Token here(std::size_t begin, std::size_t end) const {
    Token t;
    t.begin = static_cast<std::uint32_t>(begin);
    t.end = static_cast<std::uint32_t>(end);
    t.line = line_;
    t.column = static_cast<std::uint32_t>(begin - line_begin_ + 1);
    return t;
  }
  void add(Tok kind, std::uint32_t name = kNone) {
    Token t = here(begin_, at_);
    t.kind = kind;
    t.name = name;
    s_.tokens.push_back(t);
  }
  void newline() {
    ++line_;
    line_begin_ = at_ + 1;
  }
  void skip() {
    for (; at_ < s_.text.size(); ++at_) {
      const char c = s_.text[at_];
      if (c == '\n') {
        newline();
      } else if (c == '{') {
        const Token open = here(at_, at_ + 1);
        while (at_ < s_.text.size() && s_.text[at_] != '}') {
          if (s_.text[at_] == '\n') newline();
          ++at_;
        }
        if (at_ == s_.text.size()) {
          faults_.error(s_.file, open, "this comment has no end", "Close it with \"}\".");
          return;
        }
      } else if (c != ' ' && c != '\t' && c != '\r' && c != '\f') {
        return;
      }
    }
  }
  void one() {
    const char c = peek();
    if (is_letter(c)) {
      while (is_part(peek())) ++at_;
      const std::uint32_t n = names_.number(s_.text.substr(begin_, at_ - begin_));
      return add(n < by_number_.size() ? by_number_[n] : Tok::name, n);
    }
    if (is_digit(c)) return number();
    if (c == '\'') return string();
    ++at_;
    const auto two = [&](char second, Tok both, Tok alone) {
      if (peek() != second) return add(alone);
      ++at_;
      add(both);
    };
    switch (c) {
      case ';': return add(Tok::semicolon);
      case ',': return add(Tok::comma);
      case '(': return add(Tok::lparen);
      case ')': return add(Tok::rparen);
      case '[': return add(Tok::lbracket);
      case ']': return add(Tok::rbracket);
      case '=': return add(Tok::equal);
      case '+': return add(Tok::plus);
      case '-': return add(Tok::minus);
      case '*': return add(Tok::star);
      case '/': return add(Tok::slash);
      case '@': return add(Tok::at);
      case ':': return two('=', Tok::assign, Tok::colon);
      case '.': return two('.', Tok::dots, Tok::dot);
      case '>': return two('=', Tok::greater_equal, Tok::greater);
      case '<':
        if (peek() == '>') {
          ++at_;
          return add(Tok::not_equal);
        }
        return two('=', Tok::less_equal, Tok::less);
      default: break;
    }
    // A run of what no program has is one fault.
    while (at_ < s_.text.size() &&
           (static_cast<unsigned char>(peek()) >= 128 || (peek() == c && c != '\n')))
      ++at_;
    const bool is_text = static_cast<unsigned char>(c) >= 128;
    std::string hint;
    if (c == '"') hint = "Write strings in single quotes: 'text'.";
    else if (c == '}') hint = "A comment begins with \"{\"; comments cannot be nested.";
    else if (is_text) hint = "Letters of other alphabets are allowed in comments and strings only.";
    else if (c == '_') hint = "Names begin with a letter.";
    faults_.error(s_.file, here(begin_, at_),
                  is_text ? "a character that is not part of the language"
                  : c >= ' ' && c < 127
                      ? std::string("\"") + c + "\" is not a character of the language"
                      : "a control character (code " +
                            std::to_string(static_cast<unsigned char>(c)) + ") is in the source",
                  hint);
  }
  void number() {
    while (is_digit(peek())) ++at_;
    Tok kind = Tok::integer;
    if (peek() == '.' && is_digit(peek(1))) {
      kind = Tok::real;
      ++at_;
      while (is_digit(peek())) ++at_;
    }
    if (peek() == 'e' || peek() == 'E') {
      const std::size_t sign = peek(1) == '+' || peek(1) == '-' ? 2 : 1;
      if (is_digit(peek(sign))) {
        kind = Tok::real;
        at_ += sign;
        while (is_digit(peek())) ++at_;
      }
    }
    add(kind);
    if (is_letter(peek()) || peek() == '_')
      faults_.error(s_.file, here(begin_, at_ + 1), "a letter directly follows a number",
                    "Names begin with a letter; put a blank between a number and a word.");
  }
  void string() {
    ++at_;
    while (true) {
      if (at_ >= s_.text.size() || peek() == '\n') {
        faults_.error(s_.file, here(begin_, at_), "this string has no end",
                      "Close it with a single quote in its line; a quote within is doubled.");
        break;
      }
      if (peek() == '\'') {
        ++at_;
        if (peek() != '\'') break;
      } else if (static_cast<unsigned char>(peek()) < ' ' && peek() != '\t' && peek() != '\r') {
        faults_.error(s_.file, here(at_, at_ + 1), "a control character is in a string",
                      "Write it with CHR and CONCAT.");
      }
      ++at_;
    }
    add(Tok::string);
  }

  Source& s_;
  Names& names_;
  Faults& faults_;
  std::vector<std::pair<std::uint32_t, Tok>> words_;
  std::vector<Tok> by_number_;
  std::size_t at_ = 0, begin_ = 0, line_begin_ = 0;
  std::uint32_t line_ = 1;
};

}  // namespace

std::string upper(std::string_view s) {
  std::string out(s);
  for (char& c : out)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return out;
}

namespace {
char big(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; }
/// FNV-1a of the upper case, with its bits mixed at the end.
std::uint32_t hash_of(std::string_view any_case) {
  std::uint32_t h = 2166136261U;
  for (const char c : any_case) h = (h ^ static_cast<unsigned char>(big(c))) * 16777619U;
  return h ^ (h >> 15U);
}
}  // namespace

std::size_t Names::slot_of(std::string_view any_case, std::uint32_t hash) const {
  const std::size_t mask = slots_.size() - 1;
  for (std::size_t i = hash & mask;; i = (i + 1) & mask) {
    const std::uint32_t n = slots_[i];
    if (n == kNone) return i;
    if (hashes_[n] == hash && all_[n].size() == any_case.size() &&
        std::equal(any_case.begin(), any_case.end(), all_[n].begin(),
                   [](char a, char b) { return big(a) == b; }))
      return i;
  }
}
std::uint32_t Names::number(std::string_view any_case) {
  if (slots_.size() < 2 * (all_.size() + 1)) {
    slots_.assign(std::max<std::size_t>(1024, slots_.size() * 2), kNone);
    const std::size_t mask = slots_.size() - 1;
    for (std::uint32_t n = 0; n < all_.size(); ++n) {
      std::size_t i = hashes_[n] & mask;
      while (slots_[i] != kNone) i = (i + 1) & mask;
      slots_[i] = n;
    }
  }
  const std::uint32_t hash = hash_of(any_case);
  const std::size_t i = slot_of(any_case, hash);
  if (slots_[i] != kNone) return slots_[i];
  const auto n = static_cast<std::uint32_t>(all_.size());
  all_.push_back(irl::upper(any_case));
  hashes_.push_back(hash);
  slots_[i] = n;
  return n;
}
std::uint32_t Names::find(std::string_view any_case) const {
  return slots_.empty() ? kNone : slots_[slot_of(any_case, hash_of(any_case))];
}

void Faults::error(std::uint32_t file, const Token& at, std::string message, std::string hint) {
  if (errors_ < most_) all.push_back({0, file, at, std::move(message), std::move(hint)});
  ++errors_;
}
void Faults::warning(std::uint32_t file, const Token& at, std::string message, std::string hint) {
  if (all.size() < std::size_t{2} * most_)
    all.push_back({1, file, at, std::move(message), std::move(hint)});
}
void Faults::note(std::uint32_t file, const Token& at, std::string message, std::string hint) {
  if (all.size() < std::size_t{2} * most_)
    all.push_back({2, file, at, std::move(message), std::move(hint)});
}
void Faults::drop_after(std::size_t count, std::uint32_t errors) {
  if (count < all.size()) all.resize(count);
  errors_ = errors;
}

std::string string_value(std::string_view quoted) {
  std::string out;
  if (quoted.size() < 2) return out;
  const std::size_t end = quoted.back() == '\'' ? quoted.size() - 1 : quoted.size();
  for (std::size_t i = 1; i < end; ++i) {
    out += quoted[i];
    if (quoted[i] == '\'') ++i;
  }
  return out;
}

const std::vector<std::string_view>& reserved_words() {
  static const std::vector<std::string_view> all = [] {
    std::vector<std::string_view> words;
    for (const auto& [word, kind] : kKeywords)
      if (!word.empty()) words.push_back(word);
    return words;
  }();
  return all;
}

void scan(Source& source, Names& names, Faults& faults) { Scanner(source, names, faults).run(); }

}  // namespace robomosp::irl
