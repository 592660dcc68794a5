// SPDX-License-Identifier: Apache-2.0
#include "kernel/literal.h"

#include <cmath>
#include <optional>

#include "kernel/text.h"
#include "kernel/value_text.h"

namespace robomosp {
namespace {

constexpr std::size_t kDeepestLiteral = 100;

bool is_name_start(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_name_char(char c) { return is_name_start(c) || (c >= '0' && c <= '9'); }

class LiteralReader {
 public:
  explicit LiteralReader(std::string_view text) : text_(text) {}

  Result<Value> all() {
    RMP_TRY_ASSIGN(Value v, value(0));
    skip();
    if (at_ < text_.size()) return fault("more text follows the value");
    return v;
  }

 private:
  Error fault(const std::string& what) const {
    return error(ErrorCode::syntax,
                 what + " at character " + std::to_string(at_ + 1) + " of " + text::quote(text_));
  }
  void skip() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\n' || text_[at_] == '\t'))
      ++at_;
  }
  bool take(char c) {
    skip();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  Result<Value> value(std::size_t depth) {
    skip();
    if (at_ >= text_.size()) return fault("a value is missing");
    const char c = text_[at_];
    if (c == '{') return table(depth);
    if (c == '"') {
      RMP_TRY_ASSIGN(std::string s, string());
      return Value(std::move(s));
    }
    if (is_name_start(c)) {
      const std::size_t from = at_;
      while (at_ < text_.size() && is_name_char(text_[at_])) ++at_;
      const std::string_view word = text_.substr(from, at_ - from);
      if (word == "true") return Value(true);
      if (word == "false") return Value(false);
      if (word == "nil") return Value();
      if (word == "inf") return Value(HUGE_VAL);
      if (word == "nan") return Value(std::nan(""));
      at_ = from;
      return fault(text::quote(word) + " is not a value; texts are written in quotes,");
    }
    const std::size_t from = at_;
    while (at_ < text_.size() && (is_name_char(text_[at_]) || text_[at_] == '.' ||
                                  text_[at_] == '-' || text_[at_] == '+'))
      ++at_;
    const std::string_view number = text_.substr(from, at_ - from);
    if (const auto i = text::read_int(number)) return Value(*i);
    if (const auto x = text::read_real(number)) return Value(*x);
    if (number == "-inf") return Value(-HUGE_VAL);
    at_ = from;
    return fault("there is no value");
  }

  Result<std::string> string() {
    std::string out;
    for (++at_; at_ < text_.size() && text_[at_] != '"'; ++at_) {
      if (text_[at_] != '\\') {
        out += text_[at_];
        continue;
      }
      if (++at_ == text_.size()) break;
      out += text_[at_] == 'n' ? '\n' : text_[at_] == 't' ? '\t' : text_[at_];
    }
    if (at_ >= text_.size()) return fault("a text has no closing quote");
    ++at_;
    return out;
  }

  Result<Value> table(std::size_t depth) {
    if (depth >= kDeepestLiteral)
      return fault("tables are nested more than " + std::to_string(kDeepestLiteral) + " deep");
    ++at_;
    List list;
    Map map;
    while (!take('}')) {
      skip();
      const std::size_t from = at_;
      std::optional<std::string> name;
      if (at_ < text_.size() && (is_name_start(text_[at_]) || text_[at_] == '[')) {
        if (text_[at_] == '[') {
          ++at_;
          skip();
          if (at_ >= text_.size() || text_[at_] != '"') return fault("a name in quotes is missing");
          RMP_TRY_ASSIGN(name, string());
          if (!take(']')) return fault("a bracket ] is missing");
        } else {
          const std::size_t begin = at_;
          while (at_ < text_.size() && is_name_char(text_[at_])) ++at_;
          name = text_.substr(begin, at_ - begin);
        }
        if (!take('=')) {
          name.reset();
          at_ = from;
        }
      }
      RMP_TRY_ASSIGN(Value v, value(depth + 1));
      if (!name) list.push_back(std::move(v));
      else if (map.find(*name)) return fault(text::quote(*name) + " is given twice");
      else map.append(*std::move(name), std::move(v));
      if (!list.empty() && !map.empty())
        return fault("a table has either names or a list of values");
      if (take(',') || take(';')) continue;
      if (!take('}')) return fault("a comma or a brace } is missing");
      break;
    }
    if (!map.empty()) return Value(std::move(map));
    return Value(std::move(list));
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

std::string number_text(double x) {
  if (std::isinf(x)) return x > 0 ? "inf" : "-inf";
  return text::print(x);
}

std::string quoted_literal(std::string_view s) {
  std::string out = "\"";
  for (const char c : s) {
    if (c == '"' || c == '\\') out += '\\';
    if (c == '\n') out += "\\n";
    else if (c == '\t') out += "\\t";
    else out += c;
  }
  return out + "\"";
}

/// Of anything but lists and maps; once it has more than `most` bytes it may end anywhere.
std::string literal_of_leaf(const Value& v, std::size_t most) {
  if (const bool* b = v.as_bool()) return *b ? "true" : "false";
  if (const std::int64_t* i = v.as_int()) return std::to_string(*i);
  if (const double* x = v.as_real()) return number_text(*x);
  if (const std::string* s = v.as_string())
    return quoted_literal(s->size() > most ? s->substr(0, most + 1) : *s);
  if (const Handle* h = v.as_handle())
    return quoted_literal(h->kind + "#" + std::to_string(h->number));
  const NumericArray* a = v.as_array();
  if (!a) return "nil";
  std::string out = "{";
  const std::size_t rows = a->is_matrix() ? a->rows() : 1;
  const std::size_t cols = a->is_matrix() ? a->cols() : a->size();
  for (std::size_t r = 0; r < rows && out.size() <= most; ++r) {
    if (a->is_matrix()) out += r ? ", {" : "{";
    for (std::size_t c = 0; c < cols && out.size() <= most; ++c)
      out += (c ? ", " : "") + number_text((*a)[r * cols + c]);
    if (a->is_matrix()) out += "}";
  }
  return out + "}";
}

}  // namespace

Result<Value> read_literal(std::string_view text) { return LiteralReader(text).all(); }

std::string literal(const Value& value) {
  return beginning_of_literal(value, static_cast<std::size_t>(-2));
}

std::string beginning_of_literal(const Value& value, std::size_t most) {
  return table_text(
      value, most, [most](const Value& v, bool) { return literal_of_leaf(v, most); },
      [](const std::string& name) {
        return (is_plain_name(name) ? name : "[" + quoted_literal(name) + "]") + " = ";
      });
}

}  // namespace robomosp
