// SPDX-License-Identifier: Apache-2.0
// Tokens of the languages that are read.
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "reader.h"

namespace robomosp::readers {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::string lower(std::string_view s) {
  std::string out(s);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

std::string_view stem(std::string_view file) { return file.substr(0, file.rfind('.')); }
std::string extension(std::string_view file) {
  const std::size_t dot = file.rfind('.');
  return dot == std::string_view::npos ? "" : lower(file.substr(dot + 1));
}

bool has_line(std::string_view text, std::string_view word) {
  while (!text.empty()) {
    std::size_t i = 0;
    while (i < text.size() && (text[i] == ' ' || text[i] == '\t')) ++i;
    if (text.size() - i >= word.size() && lower(text.substr(i, word.size())) == word &&
        (text.size() - i == word.size() ||
         !(is_letter(text[i + word.size()]) || is_digit(text[i + word.size()]))))
      return true;
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) break;
    text.remove_prefix(end + 1);
  }
  return false;
}

void Reader::scan(std::size_t file, const Style& style, const Part& part) {
  uses_.clear();
  const std::string_view text = files_[file].text.substr(0, part.end);
  tokens_.clear();
  colons_.clear();
  has_colons_ = false;
  comments_.clear();
  next_comment_ = 0;
  comment_file_ = static_cast<std::uint32_t>(file);
  at_ = 0;
  std::size_t i = part.begin, line_begin = 0;
  if (const std::size_t before = i == 0 ? std::string_view::npos : text.rfind('\n', i - 1);
      before != std::string_view::npos)
    line_begin = before + 1;
  std::uint32_t line = part.line;
  int brackets = 0;
  const auto at = [&](std::size_t begin, std::size_t end) {
    return At{static_cast<std::uint32_t>(file), line,
              static_cast<std::uint32_t>(begin - line_begin + 1), static_cast<std::uint32_t>(begin),
              static_cast<std::uint32_t>(end)};
  };
  const auto in = [](std::string_view set, char c) {
    return set.find(c) != std::string_view::npos;
  };
  const auto name_goes_on = [&](char c) {
    return is_letter(c) || is_digit(c) || in(style.name_rest, c) ||
           static_cast<unsigned char>(c) >= 0x80;
  };
  if (i == 0 && text.starts_with("\xEF\xBB\xBF")) i = 3;
  while (i < text.size()) {
    const char c = text[i];
    if (c == '\n') {
      if (style.has_lines && (!style.joins_in_brackets || brackets <= 0))
        tokens_.push_back({Tk::line, "\n", "\n", 0, false, at(i, i)});
      ++i;
      ++line;
      line_begin = i;
      continue;
    }
    if (c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v') {
      ++i;
      continue;
    }
    if (!style.comment.empty() && text.substr(i).starts_with(style.comment)) {
      std::size_t end = text.find('\n', i);
      if (end == std::string_view::npos) end = text.size();
      std::string words(text.substr(i + style.comment.size(), end - i - style.comment.size()));
      comments_.push_back({line, std::move(words)});
      i = end;
      continue;
    }
    if (in(style.quotes, c)) {
      std::size_t end = i + 1;
      while (end < text.size() && text[end] != '\n') {
        if (text[end] == c) {
          if (end + 1 < text.size() && text[end + 1] == c) ++end;
          else break;
        }
        ++end;
      }
      const bool is_closed = end < text.size() && text[end] == c;
      tokens_.push_back({Tk::text, text.substr(i + 1, end - i - 1), std::string(1, c), 0, false,
                         at(i, std::min(end + 1, text.size()))});
      if (!is_closed) fail(at(i, end), "this text does not end on its line");
      i = is_closed ? end + 1 : end;
      continue;
    }
    const bool is_hex = !style.hex.empty() && i + style.hex.size() < text.size() &&
                        lower(text.substr(i, style.hex.size())) == style.hex &&
                        std::isxdigit(static_cast<unsigned char>(text[i + style.hex.size()]));
    if (is_hex) {
      std::uint64_t n = 0;
      const auto r =
          std::from_chars(text.data() + i + style.hex.size(), text.data() + text.size(), n, 16);
      const auto end = static_cast<std::size_t>(r.ptr - text.data());
      tokens_.push_back(
          {Tk::number, text.substr(i, end - i), {}, static_cast<double>(n), true, at(i, end)});
      i = end;
      continue;
    }
    if (is_letter(c) || in(style.name_first, c) || static_cast<unsigned char>(c) >= 0x80) {
      std::size_t end = i + 1;
      while (end < text.size() && name_goes_on(text[end])) ++end;
      const std::string_view raw = text.substr(i, end - i);
      tokens_.push_back({Tk::name, raw, lower(raw), 0, false, at(i, end)});
      i = end;
      continue;
    }
    if (is_digit(c) ||
        (c == '.' && i + 1 < text.size() && is_digit(text[i + 1]) &&
         (tokens_.empty() || tokens_.back().kind != Tk::name || tokens_.back().at.end != i))) {
      double v = 0;
      const auto r = std::from_chars(text.data() + i, text.data() + text.size(), v);
      auto end = static_cast<std::size_t>(r.ptr - text.data());
      if (end <= i) end = i + 1;
      const std::string_view raw = text.substr(i, end - i);
      if (r.ec != std::errc()) {
        fail(at(i, end), "the number " + std::string(raw.substr(0, 40)) + " is out of range");
        v = 0;
      }
      const bool is_whole =
          raw.find_first_of(".eE") == std::string_view::npos && std::fabs(v) <= 2147483647.0;
      tokens_.push_back({Tk::number, raw, {}, v, is_whole, at(i, end)});
      i = end;
      continue;
    }
    std::size_t length = 1;
    for (const std::string_view sign : style.signs)
      if (text.substr(i).starts_with(sign)) {
        length = sign.size();
        break;
      }
    if (length == 1 && in("([", c)) ++brackets;
    if (length == 1 && in(")]", c)) --brackets;
    tokens_.push_back({Tk::sign, text.substr(i, length), std::string(text.substr(i, length)), 0,
                       false, at(i, i + length)});
    i += length;
  }
  if (style.has_lines) tokens_.push_back({Tk::line, "\n", "\n", 0, false, at(i, i)});
  tokens_.push_back({Tk::end, {}, {}, 0, false, at(i, i)});
}

const Token& Reader::peek(std::size_t n) const {
  return tokens_[std::min(at_ + n, tokens_.size() - 1)];
}
Token Reader::next() {
  const Token t = peek();
  if (t.kind != Tk::end) ++at_;
  return t;
}
bool Reader::is(std::string_view word, std::size_t n) const {
  const Token& t = peek(n);
  return (t.kind == Tk::name || t.kind == Tk::sign) && t.low == word;
}
bool Reader::accept(std::string_view word) {
  if (!is(word)) return false;
  ++at_;
  return true;
}
bool Reader::expect(std::string_view word) {
  if (accept(word)) return true;
  const Token& t = peek();
  bad(t.at, "\"" + std::string(word) + "\" is expected here, not " +
                (at_line_end() ? std::string("the end of the line")
                               : "\"" + std::string(t.raw.substr(0, 40)) + "\""));
  return false;
}
void Reader::skip_line() {
  while (!at_line_end()) ++at_;
  if (peek().kind == Tk::line) ++at_;
}

}  // namespace robomosp::readers
