// SPDX-License-Identifier: Apache-2.0
#include "kernel/condition.h"

#include <algorithm>

#include "kernel/text.h"

namespace robomosp {
namespace {

constexpr std::size_t kDeepestTest = 50;  ///< parentheses inside each other

bool is_word_char(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '.' || c == '-' || c == '+' || (static_cast<unsigned char>(c) & 0x80U) != 0;
}

bool is_absent_value(const Value* v) {
  if (!v || v->is_nil()) return true;
  if (const std::string* s = v->as_string()) return s->empty();
  if (const List* list = v->as_list()) return list->empty();
  if (const Map* map = v->as_map()) return map->empty();
  if (const NumericArray* a = v->as_array()) return a->size() == 0;
  return false;
}

bool equals_word(const Value& v, const std::string& word) {
  if (const std::string* s = v.as_string()) return *s == word;
  if (const bool* b = v.as_bool()) return word == (*b ? "true" : "false");
  if (v.is_number()) {
    const auto x = text::read_real(word);
    return x && *x == v.number();
  }
  return false;
}

}  // namespace

class ConditionParser {
 public:
  explicit ConditionParser(std::string_view text) : text_(text) { out_.text_ = text; }

  Result<Condition> all() {
    next();
    RMP_TRY(any_of(0));
    if (!word_.empty()) return fault("unexpected " + text::quote(word_));
    return std::move(out_);
  }

 private:
  Error fault(const std::string& what) const {
    return error(ErrorCode::syntax, what + " in the condition " + text::quote(text_),
                 "Write such as \"step is move and pose is absent\".");
  }
  void next() {
    while (at_ < text_.size() && text_[at_] == ' ') ++at_;
    const std::size_t from = at_;
    if (at_ < text_.size() && !is_word_char(text_[at_])) {
      ++at_;
    } else {
      while (at_ < text_.size() && is_word_char(text_[at_])) ++at_;
    }
    word_ = text_.substr(from, at_ - from);
  }
  bool take(std::string_view word) {
    if (word_ != word) return false;
    next();
    return true;
  }
  void add(Condition::Op op, std::size_t test = 0) { out_.steps_.push_back({op, test}); }

  Result<void> any_of(std::size_t depth) {
    RMP_TRY(all_of(depth));
    while (take("or")) {
      RMP_TRY(all_of(depth));
      add(Condition::Op::or_);
    }
    return {};
  }
  Result<void> all_of(std::size_t depth) {
    RMP_TRY(one(depth));
    while (take("and")) {
      RMP_TRY(one(depth));
      add(Condition::Op::and_);
    }
    return {};
  }
  Result<void> one(std::size_t depth) {
    if (depth > kDeepestTest) return fault("parentheses are nested too deep");
    bool is_negated = false;
    while (take("not")) is_negated = !is_negated;
    if (take("(")) {
      RMP_TRY(any_of(depth + 1));
      if (!take(")")) return fault("a parenthesis ) is missing");
    } else {
      RMP_TRY(test());
    }
    if (is_negated) add(Condition::Op::not_);
    return {};
  }
  Result<void> test() {
    if (word_.empty() || !is_word_char(word_.front()))
      return fault("the name of a field is missing");
    Condition::Test t;
    t.field = word_;
    next();
    if (!take("is")) return fault(text::quote(t.field) + " is not followed by \"is\"");
    t.is_negated = take("not");
    if (word_ == "present" || word_ == "absent") {
      t.state = word_;
      next();
    } else {
      do {
        if (word_.empty() || !is_word_char(word_.front()))
          return fault("a word is missing behind " + text::quote(t.field + " is"));
        t.words.emplace_back(word_);
        next();
      } while (take(","));
    }
    out_.tests_.push_back(std::move(t));
    add(Condition::Op::test, out_.tests_.size() - 1);
    return {};
  }

  std::string_view text_, word_;
  std::size_t at_ = 0;
  Condition out_;
};

Result<Condition> Condition::parse(std::string_view text) { return ConditionParser(text).all(); }

bool Condition::holds(const std::function<const Value*(std::string_view)>& value_of) const {
  if (steps_.empty()) return true;
  std::vector<char> stack;
  for (const Step& step : steps_) {
    if (step.op == Op::test) {
      const Test& t = tests_[step.test];
      const Value* v = value_of(t.field);
      const bool is =
          t.state == "absent" ? is_absent_value(v)
          : t.state == "present"
              ? !is_absent_value(v)
              : v && std::any_of(t.words.begin(), t.words.end(),
                                 [v](const std::string& word) { return equals_word(*v, word); });
      stack.push_back(is != t.is_negated);
      continue;
    }
    if (step.op == Op::not_) {
      stack.back() = !stack.back();
      continue;
    }
    const char last = stack.back();
    stack.pop_back();
    stack.back() = step.op == Op::and_ ? stack.back() && last : stack.back() || last;
  }
  return stack.back() != 0;
}

bool Condition::holds(const Map& fields) const {
  return holds([&fields](std::string_view name) -> const Value* {
    const Map* m = &fields;
    for (;;) {
      const auto dot = name.find('.');
      const Value* v = m->find(name.substr(0, dot));
      if (!v || dot == std::string_view::npos) return v;
      m = v->as_map();
      if (!m) return nullptr;
      name.remove_prefix(dot + 1);
    }
  });
}

}  // namespace robomosp
