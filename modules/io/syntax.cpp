// SPDX-License-Identifier: Apache-2.0
#include "io/syntax.h"

#include <charconv>
#include <cstdio>

#include "kernel/text.h"
#include "kernel/units.h"
#include "kernel/utf8.h"

namespace robomosp::io {

namespace {

using text::quote;

constexpr std::size_t kMostFields = 4'000'000;
constexpr std::size_t kLongestQuoted = 40;  ///< of a file's own text in a message

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_word_char(char c) { return is_letter(c) || is_digit(c) || c == '-' || c == '.'; }
bool is_unit_char(char c) {
  return is_letter(c) || is_digit(c) || c == '^' || c == '/' || c == '*' || c == '.' || c == '%' ||
         c == '-';
}

std::string shown(std::string_view s) {
  if (s.size() <= kLongestQuoted) return quote(s);
  std::size_t n = kLongestQuoted;
  while (n > 0 && (static_cast<unsigned char>(s[n]) & 0xC0) == 0x80) --n;  // whole characters
  return quote(std::string(s.substr(0, n)) + "...");
}

enum class TokenKind : std::uint8_t {
  end,
  word,
  number,
  string,
  open,
  close,
  open_tuple,
  close_tuple,
  comma,
  equals
};

struct Token {
  TokenKind kind = TokenKind::end;
  std::uint32_t offset = 0;
  std::string_view text, unit;
};

class Parser {
 public:
  Parser(Syntax& s, std::size_t start) : s_(s), p_(start) {}

  Result<void> run() {
    RMP_TRY(advance());
    for (;;) {
      switch (token_.kind) {
        case TokenKind::end:
          if (open_.empty()) return {};
          return s_.at(token_.offset, ErrorCode::syntax, "the file ends inside a block",
                       "The block of " + quote(field(open_.back()).name) + ", which starts at " +
                           s_.place(field(open_.back()).offset) + ", is not closed.");
        case TokenKind::close:
          if (open_.empty())
            return fail("there is no block for this \"}\" to close",
                        "Remove it, or add the \"{\" that is missing.");
          field(open_.back()).end = size();
          open_.pop_back();
          RMP_TRY(advance());
          break;
        case TokenKind::word: RMP_TRY(read_field()); break;
        default: return fail("the name of a field is expected here, not " + describe());
      }
    }
  }

 private:
  [[nodiscard]] Field& field(std::int32_t i) { return s_.fields[static_cast<std::size_t>(i)]; }
  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(s_.fields.size()); }
  [[nodiscard]] Error fail(std::string message, std::string hint = {}) const {
    return s_.at(token_.offset, ErrorCode::syntax, std::move(message), std::move(hint));
  }
  [[nodiscard]] std::string describe() const {
    switch (token_.kind) {
      case TokenKind::end: return "the end of the file";
      case TokenKind::word: return shown(token_.text);
      case TokenKind::number: return "the number " + std::string(token_.text);
      case TokenKind::string: return "the text " + shown(unescape(token_.text));
      default: return quote(token_.text);
    }
  }

  Result<void> read_field() {
    if (s_.fields.size() >= kMostFields)
      return fail("the file has more than " + std::to_string(kMostFields) + " fields",
                  "Split it into several files.");
    Field f;
    f.name = token_.text;
    f.offset = token_.offset;
    f.parent = open_.empty() ? -1 : open_.back();
    const bool is_suspect = f.offset == behind_number_;
    RMP_TRY(advance());
    RMP_TRY(read_argument(f));
    f.has_values = (f.argument == Argument::word || f.argument == Argument::string) &&
                   token_.kind == TokenKind::open_tuple && f.name != "parameter";
    if (f.has_values) {
      f.first_number = static_cast<std::uint32_t>(s_.numbers.size());
      RMP_TRY(read_tuple(f));
    }
    if (f.name == "parameter" && !f.has_values &&
        (f.argument == Argument::word || f.argument == Argument::string) &&
        (token_.kind == TokenKind::number || token_.kind == TokenKind::equals)) {
      f.has_values = true;
      f.first_number = static_cast<std::uint32_t>(s_.numbers.size());
      f.numbers = 1;
      RMP_TRY(read_number());
      if (token_.kind == TokenKind::string) {
        f.remark = token_.text;
        RMP_TRY(advance());
      }
    }
    f.has_block = token_.kind == TokenKind::open;
    if (!f.has_block && f.argument == Argument::none && is_suspect) return misspelt_unit(f);
    if (!f.has_block && f.argument == Argument::none)
      return fail(quote(f.name) + " has no value",
                  "A field must be a name and a value, or a name and a block in braces.");
    if (is_suspect && f.argument == Argument::word && starts_value(token_.kind))
      return misspelt_unit(f);
    s_.fields.push_back(f);
    s_.fields.back().end = size();
    if (!f.has_block) return {};
    open_.push_back(static_cast<std::int32_t>(s_.fields.size()) - 1);
    return advance();
  }

  /// A word behind a number that makes no field: `x 20 mmm`.
  [[nodiscard]] Error misspelt_unit(const Field& f) const {
    const Error e = units::parse(f.name).error();
    return s_.at(f.offset, ErrorCode::syntax, e.message, e.hint);
  }
  static bool starts_value(TokenKind k) {
    return k == TokenKind::number || k == TokenKind::string || k == TokenKind::open_tuple;
  }

  Result<void> read_argument(Field& f) {
    f.argument_offset = token_.offset;
    f.text = token_.text;
    switch (token_.kind) {
      case TokenKind::word: f.argument = Argument::word; return advance();
      case TokenKind::string: f.argument = Argument::string; return advance();
      case TokenKind::number:
        f.argument = Argument::number;
        f.first_number = static_cast<std::uint32_t>(s_.numbers.size());
        f.numbers = 1;
        return read_number();
      case TokenKind::equals:
        f.argument = Argument::number;
        f.first_number = static_cast<std::uint32_t>(s_.numbers.size());
        f.numbers = 1;
        return read_number();
      case TokenKind::open_tuple:
        f.argument = Argument::tuple;
        f.first_number = static_cast<std::uint32_t>(s_.numbers.size());
        return read_tuples(f);
      default: return {};
    }
  }

  /// `20 mm`, `20 mm = "bore"` or `= "bore"`: the token is the number or the sign.
  Result<void> read_number() {
    const bool is_missing = token_.kind == TokenKind::equals;
    s_.numbers.push_back({is_missing ? std::string_view() : token_.text,
                          is_missing ? std::string_view() : token_.unit, token_.offset});
    if (!is_missing) RMP_TRY(advance());
    if (token_.kind != TokenKind::equals) return {};
    RMP_TRY(advance());
    if (token_.kind != TokenKind::string || text::trim(token_.text).empty())
      return fail("an expression in double quotes is expected after the =",
                  "Such as: radius 10 mm = \"bore/2\"");
    s_.numbers.back().expression = token_.text;
    s_.numbers.back().expression_offset = token_.offset;
    return advance();
  }

  /// `(0, 1) (2, 3)`: all of one length.
  Result<void> read_tuples(Field& f) {
    while (token_.kind == TokenKind::open_tuple) {
      const std::uint32_t offset = token_.offset, before = f.numbers;
      RMP_TRY(read_tuple(f));
      ++f.tuples;
      const std::uint32_t length = f.numbers - before;
      if (length * f.tuples != f.numbers)
        return s_.at(offset, ErrorCode::syntax,
                     "these parentheses hold " + std::to_string(length) +
                         " numbers, those before them " + std::to_string(before / (f.tuples - 1)));
    }
    return {};
  }

  Result<void> read_tuple(Field& f) {
    RMP_TRY(advance());
    if (token_.kind == TokenKind::close_tuple) return advance();
    for (;;) {
      const bool is_infinite = token_.kind == TokenKind::word && token_.text == "inf";
      if (token_.kind != TokenKind::number && token_.kind != TokenKind::equals && !is_infinite)
        return fail("a number is expected here, not " + describe());
      const bool has_unit = !token_.unit.empty();
      ++f.numbers;
      RMP_TRY(read_number());
      if (token_.kind == TokenKind::close_tuple) return advance();
      if (token_.kind == TokenKind::word && !has_unit) {
        const auto unit = units::parse(token_.text);
        if (!unit.ok()) return fail(unit.error().message, unit.error().hint);
      }
      if (token_.kind != TokenKind::comma)
        return fail("\",\" or \")\" is expected here, not " + describe());
      RMP_TRY(advance());
    }
  }

  // Lexer: token_ is the next token not yet used.
  Result<void> advance() {
    skip();
    const std::string_view all = s_.text;
    token_ = {TokenKind::end, static_cast<std::uint32_t>(p_), {}, {}};
    if (p_ >= all.size()) return {};
    const char c = all[p_];
    const auto single = [&](TokenKind kind) {
      token_.kind = kind;
      token_.text = all.substr(p_++, 1);
      return Result<void>{};
    };
    switch (c) {
      case '{': return single(TokenKind::open);
      case '}': return single(TokenKind::close);
      case '(': return single(TokenKind::open_tuple);
      case ')': return single(TokenKind::close_tuple);
      case ',': return single(TokenKind::comma);
      case '=': return single(TokenKind::equals);
      case '"': return lex_string();
      default: break;
    }
    if (is_letter(c)) {
      std::size_t e = p_;
      while (e < all.size() && is_word_char(all[e])) ++e;
      token_.kind = TokenKind::word;
      token_.text = all.substr(p_, e - p_);
      p_ = e;
      return {};
    }
    if (is_digit(c) || c == '-' || c == '+' || c == '.') return lex_number();
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) {
      char hex[8];
      std::snprintf(hex, sizeof hex, "0x%02X", static_cast<unsigned>(byte));
      return fail("the control character " + std::string(hex) + " is not allowed here",
                  "Check that this is a text file.");
    }
    std::size_t e = p_ + 1;
    while (e < all.size() && (static_cast<unsigned char>(all[e]) & 0xC0) == 0x80) ++e;
    return fail("the character " + quote(all.substr(p_, e - p_)) + " is not allowed here",
                byte >= 0x80 ? "Put text with such letters in double quotes." : "");
  }

  void skip() {
    const std::string_view all = s_.text;
    while (p_ < all.size()) {
      const char c = all[p_];
      if (c == '#') {
        while (p_ < all.size() && all[p_] != '\n') ++p_;
      } else if (c == ' ' || c == '\t' || c == '\n' || c == '\r') {
        ++p_;
      } else {
        return;
      }
    }
  }

  Result<void> lex_string() {
    const std::string_view all = s_.text;
    const std::size_t start = p_ + 1;
    std::size_t e = start;
    for (;; ++e) {
      if (e >= all.size() || all[e] == '\n')
        return fail("the text that starts here has no closing \"",
                    "A text ends on the line where it starts; write \\n for a new line.");
      if (all[e] == '"') break;
      if (all[e] != '\\') continue;
      if (e + 1 < all.size() &&
          std::string_view("\"\\ntr").find(all[e + 1]) != std::string_view::npos) {
        ++e;
        continue;
      }
      token_.offset = static_cast<std::uint32_t>(e);
      return fail("a \\ in a text must be followed by \", \\, n, t or r",
                  "Write \\\\ for a backslash itself.");
    }
    token_.kind = TokenKind::string;
    token_.text = all.substr(start, e - start);
    p_ = e + 1;
    return {};
  }

  Result<void> lex_number() {
    const std::string_view all = s_.text;
    std::size_t start = p_;
    if (all[start] == '+') ++start;
    double value = 0;
    const char* const last = all.data() + all.size();
    const auto got = std::from_chars(all.data() + start, last, value);
    std::size_t e = static_cast<std::size_t>(got.ptr - all.data());
    const bool joined =
        e < all.size() && (all[e] == '.' || all[e] == '-' || all[e] == '+' || is_digit(all[e]));
    if (got.ec == std::errc::invalid_argument || joined || (start > p_ && all[start] == '-')) {
      e = p_ + 1;
      while (e < all.size() && (is_word_char(all[e]) || all[e] == '+')) ++e;
      return fail(shown(all.substr(p_, e - p_)) + " is not a number");
    }
    if (got.ec == std::errc::result_out_of_range)
      return fail(shown(all.substr(p_, e - p_)) + " is outside the range of real numbers");
    token_.kind = TokenKind::number;
    token_.text = all.substr(start, e - start);
    p_ = e;
    return lex_unit();
  }

  /// The unit is the longest run of unit words after the number, on the same line.
  Result<void> lex_unit() {
    const std::string_view all = s_.text;
    const std::size_t start = p_;
    std::size_t begin = std::string_view::npos;
    for (std::size_t p = p_;;) {
      while (p < all.size() && (all[p] == ' ' || all[p] == '\t')) ++p;
      if (p >= all.size() ||
          !(is_letter(all[p]) || all[p] == '%' || all[p] == '/' || all[p] == '*'))
        break;
      std::size_t e = p;
      while (e < all.size() && is_unit_char(all[e])) ++e;
      if (begin == std::string_view::npos && (all[p] == '/' || all[p] == '*')) break;
      const std::size_t from = begin == std::string_view::npos ? p : begin;
      const auto unit = units::parse(all.substr(from, e - from));
      if (!unit.ok()) {
        if (p != start) {  // the next field, or a misspelt unit
          if (begin == std::string_view::npos) behind_number_ = static_cast<std::uint32_t>(p);
          break;
        }
        token_.offset = static_cast<std::uint32_t>(p);
        return fail(unit.error().message, unit.error().hint);
      }
      begin = from;
      token_.unit = all.substr(from, e - from);
      p = p_ = e;
    }
    return {};
  }

  Syntax& s_;
  std::size_t p_;
  Token token_;
  std::uint32_t behind_number_ = 0;  ///< offset of the last word that follows a number without unit
  std::vector<std::int32_t> open_;   ///< fields whose blocks are open
};

/// The first line: `robomosp <kind> <version>`. Returns the offset after it.
Result<std::size_t> read_header(Syntax& s) {
  const std::string_view all = s.text;
  const std::size_t start = all.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  std::size_t end = all.find('\n', start);
  if (end == std::string_view::npos) end = all.size();
  std::string_view line = all.substr(start, end - start);
  line = text::trim(line.substr(0, line.find('#')));
  std::vector<std::string_view> words;
  for (std::size_t p = 0; p < line.size();) {
    const std::size_t e = std::min(line.find_first_of(" \t", p), line.size());
    if (e > p) words.push_back(line.substr(p, e - p));
    p = e + 1;
  }
  const auto offset = static_cast<std::uint32_t>(start);
  if (words.empty() || words[0] != "robomosp")
    return s.at(
        offset, ErrorCode::syntax, "this is not a robomosp file",
        "Its first line must be such as \"robomosp robot 1\"; CAD and mesh files are read by "
        "import.");
  const auto version = words.size() == 3 ? text::read_int(words[2]) : std::nullopt;
  if (!version || *version < 1)
    return s.at(offset, ErrorCode::syntax,
                "the first line must be \"robomosp\", a kind and a version",
                "Such as \"robomosp robot 1\".");
  if (*version > kVersion)
    return s.at(static_cast<std::uint32_t>(words[2].data() - all.data()), ErrorCode::unsupported,
                "the file was written by a newer version of the program: its format is " +
                    std::string(words[2]) + ", this program reads up to " +
                    std::to_string(kVersion),
                "Update the program.");
  s.kind = std::string(words[1]);
  s.kind_offset = static_cast<std::uint32_t>(words[1].data() - all.data());
  return end;
}

}  // namespace

std::string Syntax::place(std::uint32_t offset) const {
  std::size_t line = 1, column = 1;
  const std::size_t start = text.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  for (std::size_t i = start; i < offset && i < text.size(); ++i) {
    if (text[i] == '\n') {
      ++line;
      column = 1;
    } else if ((static_cast<unsigned char>(text[i]) & 0xC0) != 0x80) {
      ++column;  // characters, as editors count
    }
  }
  return file + ":" + std::to_string(line) + ":" + std::to_string(column);
}

Error Syntax::at(std::uint32_t offset, ErrorCode code, std::string message,
                 std::string hint) const {
  return error(code, std::move(message), std::move(hint), place(offset));
}

bool is_word(std::string_view s) {
  if (s.empty() || !is_letter(s.front())) return false;
  for (const char c : s)
    if (!is_word_char(c)) return false;
  return true;
}

std::string unescape(std::string_view inside) {
  std::string out;
  out.reserve(inside.size());
  for (std::size_t i = 0; i < inside.size(); ++i) {
    if (inside[i] != '\\' || i + 1 == inside.size()) {
      out += inside[i];
      continue;
    }
    switch (const char c = inside[++i]) {
      case 'n': out += '\n'; break;
      case 't': out += '\t'; break;
      case 'r': out += '\r'; break;
      default: out += c; break;
    }
  }
  return out;
}

Result<Syntax> parse(std::string file, std::string_view text) {
  Syntax s;
  s.file = std::move(file);
  s.text = text;
  if (const std::size_t bad = text::first_bad_byte(text); bad != std::string_view::npos)
    return s.at(
        static_cast<std::uint32_t>(bad), ErrorCode::syntax,
        text[bad] == '\0' ? "this is a binary file, not a text" : "this byte is not UTF-8 text",
        "Robomosp files are plain text in UTF-8; CAD and mesh files are read by import.");
  RMP_TRY_ASSIGN(const std::size_t start, read_header(s));
  RMP_TRY(Parser(s, start).run());
  return s;
}

}  // namespace robomosp::io
