// SPDX-License-Identifier: Apache-2.0
// Breakpoints, steps, variables, and expressions that a debugger asks for.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <tuple>
#include <variant>

#include "kernel/letters.h"
#include "program/state.h"

namespace robomosp::program {
namespace {

constexpr int kMostDepth = 100;

/// A process that has begun and not ended; nullptr = there is none.
Process* begun_process(Machine::State& s, std::uint32_t routine) {
  if (routine >= s.process_at.size() || s.process_at[routine] == kNone) return nullptr;
  Process& p = s.processes[s.process_at[routine]];
  return p.is_ended ? nullptr : &p;
}

}  // namespace

/// Reads and evaluates an expression in one go; over a state that does not change.
class Debugger {
 public:
  struct Value {
    std::uint32_t type = RMP_TYPE_VOID;
    std::vector<Slot> own;     ///< of a computed value: one slot
    std::string text;          ///< of a computed string
    const Slot* at = nullptr;  ///< of what stands in memory
    std::uint64_t address = 0;
    std::uint64_t character = 0;  ///< of a string: from 1
    std::string name;
    bool is_known = false;  ///< made of numbers and texts that stand in the expression
    [[nodiscard]] const Slot* slots() const { return at ? at : own.data(); }
  };

  Debugger(const Machine::Code& code, Machine::State& state)
      : c_(code), run_(code, state, nullptr, nullptr, nullptr), s_(state) {}

  Result<Value> evaluate(std::string_view text, std::uint32_t process, std::uint32_t frame) {
    RMP_TRY(at_frame(process, frame));
    text_ = text;
    if (text.size() > 10'000) return wrong("the expression has more than 10000 characters");
    next();
    RMP_TRY_ASSIGN(Value v, either(0));
    if (kind_ != 'e') return wrong("\"" + word_ + "\" follows the expression");
    return v;
  }
  /// Whether it is a condition that may have a value in a routine: what it names is there, and its
  /// types fit. What only its values tell, such as an index that is too large, is not looked at.
  Result<void> check_condition(std::string_view text, std::uint32_t routine) {
    RMP_TRY_ASSIGN(const Value v, check(text, routine));
    return is_condition(v);
  }
  /// The same of any value; its type is what counts of it.
  Result<Value> check(std::string_view text, std::uint32_t routine) {
    is_reading_ = true;
    routine_ = routine;
    return evaluate_without_frame(text);
  }
  Result<bool> condition(std::string_view text, std::uint32_t process) {
    RMP_TRY_ASSIGN(const Value v, evaluate(text, process, 0));
    RMP_TRY(is_condition(v));
    return v.slots()->integer() != 0;
  }
  Result<Value> evaluate_without_frame(std::string_view text) {
    text_ = text;
    if (text.size() > 10'000) return wrong("the expression has more than 10000 characters");
    next();
    RMP_TRY_ASSIGN(Value v, either(0));
    if (kind_ != 'e') return wrong("\"" + word_ + "\" follows the expression");
    return v;
  }

  Variable tree(const std::string& name, std::uint32_t type, const Slot* slots,
                const VariableCut& cut, std::uint32_t depth = 0) const {
    Variable v;
    v.name = name;
    v.type = c_.type_name(type);
    run_.append_text(type, slots, v.value, cut.most_bytes);
    if (v.value.size() > cut.most_bytes) v.value.resize(cut.most_bytes);
    const TypeInfo& t = c_.types[type];
    if (t.kind == RMP_TYPE_RECORD) v.part_count = c_.type(type).field_count;
    else if (t.kind == RMP_TYPE_ARRAY) v.part_count = t.length;
    else if (t.kind == RMP_TYPE_LIST) {
      const Heap::List* l = run_.list_of(*slots);
      v.part_count = l && t.element_slots ? l->slots.size() / t.element_slots : 0;
      slots = l ? l->slots.data() : slots;
    }
    v.is_indexed = t.kind == RMP_TYPE_ARRAY || t.kind == RMP_TYPE_LIST;
    if (depth >= cut.depth) return v;
    v.first_part = depth == 0 ? std::min(cut.first_part, v.part_count) : 0;
    const auto n =
        v.first_part + std::min<std::uint64_t>(v.part_count - v.first_part, cut.most_parts);
    for (std::uint64_t k = 0; k < n; ++k) {
      if (t.kind == RMP_TYPE_RECORD && k < v.first_part) {
        slots += c_.types[c_.field(c_.type(type).first_field + static_cast<std::uint32_t>(k)).type]
                     .slots;
      } else if (k < v.first_part) {
        k = v.first_part - 1;
      } else if (t.kind == RMP_TYPE_RECORD) {
        const auto& f = c_.field(c_.type(type).first_field + static_cast<std::uint32_t>(k));
        v.parts.push_back(tree(f.name, f.type, slots, cut, depth + 1));
        slots += c_.types[f.type].slots;
      } else {
        const std::int64_t i =
            static_cast<std::int64_t>(k) + (t.kind == RMP_TYPE_ARRAY ? t.lower : 1);
        v.parts.push_back(tree("[" + std::to_string(i) + "]", t.element,
                               slots + k * t.element_slots, cut, depth + 1));
      }
    }
    return v;
  }
  Variable tree(const std::string& name, const Value& v, const VariableCut& cut) const {
    if (v.type == RMP_TYPE_STRING && !v.at) {
      Variable x;
      x.name = name;
      x.type = "STRING";
      x.value = v.text.substr(0, cut.most_bytes);
      return x;
    }
    return tree(name, v.type, v.slots(), cut);
  }

  Result<void> at_frame(std::uint32_t process, std::uint32_t frame) {
    Process* const p = begun_process(s_, process);
    process_ = p;
    frame_ = nullptr;
    if (frame == Machine::kNoFrame) {
      process_ = nullptr;
      return {};
    }
    if (!p) {
      if (frame == 0) return {};  // globals are there without one
      return error(ErrorCode::not_found,
                   "the process " + std::to_string(process) + " is not running");
    }
    if (frame >= p->frames.size())
      return error(ErrorCode::not_found,
                   "there are " + std::to_string(p->frames.size()) + " frames, and frame " +
                       std::to_string(frame) + " does not exist",
                   "0 is the innermost.");
    frame_ = &p->frames[p->frames.size() - 1 - frame];
    return {};
  }
  /// Slots of a variable as seen here; nullptr = it has none.
  Slot* slots_of(std::uint32_t symbol, std::uint64_t* address = nullptr,
                 std::uint64_t* character = nullptr) {
    const Place& x = c_.place_of[symbol];
    if (x.offset == kNone) return nullptr;
    std::uint64_t a = x.offset;
    if (x.space == kConstant) {
      if (address) *address = kConstantAddress | x.offset;
      return const_cast<Slot*>(c_.constants.data()) + x.offset;
    }
    if (x.space == kFrame) {
      if (!process_ || !frame_) return nullptr;
      a = s_.globals.size() + frame_->base + x.offset;
      if (x.is_reference) {
        const Slot* r = process_->stack.data() + frame_->base + x.offset;
        a = r[0].bits;
        if (character) *character = r[1].bits;
      }
      if (address) *address = a;
      return run_.at(*process_, a, c_.types[x.type].slots, false);
    }
    if (address) *address = a;
    return a + c_.types[x.type].slots <= s_.globals.size() ? s_.globals.data() + a : nullptr;
  }
  Slot* slots_at(std::uint64_t address, std::uint64_t count, bool writes) {
    if (process_) return run_.at(*process_, address, count, writes);
    Process none;
    return run_.at(none, address, count, writes);
  }
  Run& run() { return run_; }
  Process* process() { return process_; }

 private:
  [[nodiscard]] static Error wrong(std::string message, std::string hint = {}) {
    return error(ErrorCode::syntax, std::move(message), std::move(hint));
  }
  [[nodiscard]] static Error none(std::string message, std::string hint = {}) {
    return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
  }
  void next() {
    while (at_ < text_.size() &&
           (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n' || text_[at_] == '\r'))
      ++at_;
    word_.clear();
    if (at_ >= text_.size()) {
      kind_ = 'e';
      word_ = "the end";
      return;
    }
    const char c = text_[at_];
    if (text::is_letter(c)) {
      while (at_ < text_.size() &&
             (text::is_letter(text_[at_]) || text::is_digit(text_[at_]) || text_[at_] == '_'))
        word_ += text_[at_++];
      word_ = text::upper(word_);
      kind_ = 'n';
      for (const char* op : {"AND", "OR", "EXOR", "NOT", "DIV", "MOD"})
        if (word_ == op) kind_ = 'o';
      return;
    }
    if (text::is_digit(c)) {
      kind_ = 'i';
      const auto digits = [&] {
        while (at_ < text_.size() && text::is_digit(text_[at_])) word_ += text_[at_++];
      };
      digits();
      if (at_ + 1 < text_.size() && text_[at_] == '.' && text::is_digit(text_[at_ + 1])) {
        kind_ = 'r';
        word_ += text_[at_++];
        digits();
      }
      if (at_ < text_.size() && (text_[at_] == 'e' || text_[at_] == 'E')) {
        std::size_t k = at_ + 1;
        if (k < text_.size() && (text_[k] == '+' || text_[k] == '-')) ++k;
        if (k < text_.size() && text::is_digit(text_[k])) {
          kind_ = 'r';
          while (at_ < k) word_ += text_[at_++];
          digits();
        }
      }
      return;
    }
    if (c == '\'') {
      kind_ = 's';
      for (++at_; at_ < text_.size(); ++at_) {
        if (text_[at_] == '\'') {
          if (at_ + 1 < text_.size() && text_[at_ + 1] == '\'') ++at_;
          else break;
        }
        word_ += text_[at_];
      }
      if (at_ >= text_.size()) kind_ = '?';
      else ++at_;
      return;
    }
    kind_ = 'o';
    word_ = c;
    ++at_;
    if (at_ < text_.size() &&
        ((c == '<' && (text_[at_] == '>' || text_[at_] == '=')) || (c == '>' && text_[at_] == '=')))
      word_ += text_[at_++];
  }
  bool take(std::string_view op) {
    if (kind_ != 'o' || word_ != op) return false;
    next();
    return true;
  }
  static Value of(std::uint32_t type, Slot s) {
    Value v;
    v.type = type;
    v.own = {s};
    return v;
  }
  static Value truth(bool b) { return of(RMP_TYPE_BOOL, Slot::of(b)); }
  static Value known(Value v) {
    v.is_known = true;
    return v;
  }
  static Value typed(std::uint32_t type) { return of(type, Slot{}); }
  [[nodiscard]] Result<void> is_condition(const Value& v) const {
    if (v.type == RMP_TYPE_BOOL) return {};
    return none("a condition must be BOOL, but this is " + c_.type_name(v.type));
  }
  /// Only types count, as the value is not asked for or not there.
  [[nodiscard]] bool has_no_values() const { return is_reading_ || is_skipping_; }
  [[nodiscard]] bool counts(const Value& v) const { return !is_reading_ || v.is_known; }
  [[nodiscard]] std::string text_of(const Value& v) const {
    if (v.type == RMP_TYPE_CHAR) return std::string(1, static_cast<char>(v.slots()->integer()));
    return v.at ? std::string(run_.text_of(*v.at)) : v.text;
  }
  [[nodiscard]] static double number_of(const Value& v) {
    return v.type == RMP_TYPE_REAL ? v.slots()->real() : v.slots()->integer();
  }
  [[nodiscard]] static bool is_number(const Value& v) {
    return v.type == RMP_TYPE_INT || v.type == RMP_TYPE_REAL || v.type == RMP_TYPE_SEMAPHORE;
  }
  [[nodiscard]] static bool is_text(const Value& v) {
    return v.type == RMP_TYPE_STRING || v.type == RMP_TYPE_CHAR;
  }

  Result<Value> either(int depth) {
    if (depth > kMostDepth) return wrong("the expression is nested more than 100 levels deep");
    RMP_TRY_ASSIGN(Value a, both(depth));
    for (;;) {
      const bool is_or = kind_ == 'o' && word_ == "OR";
      if (!is_or && !(kind_ == 'o' && word_ == "EXOR")) return a;
      next();
      const bool skips = is_skipping_;
      if (is_or && a.type == RMP_TYPE_BOOL && counts(a) && a.slots()->integer())
        is_skipping_ = true;
      auto b = both(depth);
      is_skipping_ = skips;
      if (!b.ok()) return b;
      if (a.type != RMP_TYPE_BOOL || b->type != RMP_TYPE_BOOL)
        return none((is_or ? "OR" : "EXOR") + std::string(" joins conditions"));
      if (is_reading_) a = typed(RMP_TYPE_BOOL);
      if (!has_no_values()) {
        const bool x = a.slots()->integer(), y = b->slots()->integer();
        a = truth(is_or ? x || y : x != y);
      }
    }
  }
  Result<Value> both(int depth) {
    RMP_TRY_ASSIGN(Value a, inverted(depth));
    while (take("AND")) {
      const bool skips = is_skipping_;
      if (a.type == RMP_TYPE_BOOL && counts(a) && !a.slots()->integer()) is_skipping_ = true;
      auto b = inverted(depth);
      is_skipping_ = skips;
      if (!b.ok()) return b;
      if (a.type != RMP_TYPE_BOOL || b->type != RMP_TYPE_BOOL)
        return none("AND needs conditions on both sides");
      if (is_reading_) a = typed(RMP_TYPE_BOOL);
      if (!has_no_values()) a = truth(a.slots()->integer() && b->slots()->integer());
    }
    return a;
  }
  Result<Value> inverted(int depth) {
    if (!take("NOT")) return compared(depth);
    RMP_TRY_ASSIGN(Value a, compared(depth));
    if (a.type != RMP_TYPE_BOOL) return none("NOT must be followed by a condition");
    if (has_no_values()) return typed(RMP_TYPE_BOOL);
    return truth(!a.slots()->integer());
  }
  Result<Value> compared(int depth) {
    RMP_TRY_ASSIGN(Value a, sum(depth));
    std::string op;
    for (const char* o : {"=", "<>", "<=", ">=", "<", ">"})
      if (kind_ == 'o' && word_ == o) op = o;
    if (op.empty()) return a;
    next();
    RMP_TRY_ASSIGN(Value b, sum(depth));
    const bool is_order = op != "=" && op != "<>";
    if (!(is_number(a) && is_number(b)) && !(is_text(a) && is_text(b)) &&
        !(a.type == RMP_TYPE_BOOL && b.type == RMP_TYPE_BOOL && !is_order))
      return none("\"" + op + "\" cannot combine " + c_.type_name(a.type) + " and " +
                  c_.type_name(b.type));
    if (has_no_values()) return typed(RMP_TYPE_BOOL);
    int order = 0;
    if (is_number(a) && is_number(b)) {
      const double x = number_of(a), y = number_of(b);
      order = x < y ? -1 : x > y ? 1 : 0;
    } else if (is_text(a) && is_text(b)) {
      order = text_of(a).compare(text_of(b));
    } else {
      order = (a.slots()->integer() != 0) != (b.slots()->integer() != 0);
    }
    return truth(op == "="    ? order == 0
                 : op == "<>" ? order != 0
                 : op == "<"  ? order < 0
                 : op == "<=" ? order <= 0
                 : op == ">"  ? order > 0
                              : order >= 0);
  }
  Result<Value> joined(const Value& a, const Value& b, char op) {
    if (!is_number(a) || !is_number(b))
      return none("an operation has operands of types " + c_.type_name(a.type) + " and " +
                      c_.type_name(b.type),
                  "It needs numbers.");
    const bool is_real = a.type == RMP_TYPE_REAL || b.type == RMP_TYPE_REAL;
    if (is_real && (op == 'd' || op == 'm')) return none("DIV and MOD need INT operands");
    if (is_skipping_ || !counts(b) || (!counts(a) && !(op == 'd' || op == 'm' || op == '/')))
      return typed(is_real || op == '/' ? RMP_TYPE_REAL : RMP_TYPE_INT);
    RMP_TRY_ASSIGN(Value v, computed(a, b, op));
    v.is_known = a.is_known && b.is_known;
    return v;
  }
  Result<Value> computed(const Value& a, const Value& b, char op) {
    if (op == '/' ||
        ((a.type == RMP_TYPE_REAL || b.type == RMP_TYPE_REAL) && op != 'd' && op != 'm')) {
      const double x = number_of(a), y = number_of(b);
      if (op == '/' && y == 0) return none("this divides by zero");
      const double v = op == '+' ? x + y : op == '-' ? x - y : op == '*' ? x * y : x / y;
      if (!std::isfinite(v)) return none("the value is outside the range of REAL");
      return of(RMP_TYPE_REAL, Slot::of_real(v));
    }
    const std::int64_t x = a.slots()->integer(), y = b.slots()->integer();
    if ((op == 'd' || op == 'm') && y == 0) return none("this divides by zero");
    const std::int64_t v = op == '+'   ? x + y
                           : op == '-' ? x - y
                           : op == '*' ? x * y
                           : op == 'd' ? x / y
                                       : x % y;
    if (v > 2147483647 || v < -2147483648LL) return none("the value is outside the range of INT");
    return of(RMP_TYPE_INT, Slot::of(v));
  }
  Result<Value> sum(int depth) {
    RMP_TRY_ASSIGN(Value a, term(depth));
    for (;;) {
      const char op = take("+") ? '+' : take("-") ? '-' : '\0';
      if (!op) return a;
      RMP_TRY_ASSIGN(Value b, term(depth));
      RMP_TRY_ASSIGN(a, joined(a, b, op));
    }
  }
  Result<Value> term(int depth) {
    RMP_TRY_ASSIGN(Value a, factor(depth));
    for (;;) {
      const char op = take("*")     ? '*'
                      : take("/")   ? '/'
                      : take("DIV") ? 'd'
                      : take("MOD") ? 'm'
                                    : '\0';
      if (!op) return a;
      RMP_TRY_ASSIGN(Value b, factor(depth));
      RMP_TRY_ASSIGN(a, joined(a, b, op));
    }
  }
  Result<Value> factor(int depth) {
    if (depth > kMostDepth) return wrong("the expression is nested more than 100 levels deep");
    if (take("+")) return factor(depth + 1);
    if (take("-")) {
      RMP_TRY_ASSIGN(Value a, factor(depth + 1));
      if (a.type == RMP_TYPE_REAL) {
        Value v = of(RMP_TYPE_REAL, Slot::of_real(-number_of(a)));
        v.is_known = a.is_known;
        return v;
      }
      return joined(known(of(RMP_TYPE_INT, Slot::of(0))), a, '-');
    }
    if (take("(")) {
      RMP_TRY_ASSIGN(Value a, either(depth + 1));
      if (!take(")")) return wrong("\")\" is missing before " + word_);
      return a;
    }
    if (kind_ == 'i' || kind_ == 'r') {
      const bool is_real = kind_ == 'r';
      const char* end = word_.data() + word_.size();
      std::int32_t i = 0;
      double r = 0;
      if (is_real ? std::from_chars(word_.data(), end, r).ec != std::errc()
                  : std::from_chars(word_.data(), end, i).ec != std::errc())
        return wrong("the number " + word_ + " is beyond what " + (is_real ? "a REAL" : "an INT") +
                     " holds");
      next();
      return known(is_real ? of(RMP_TYPE_REAL, Slot::of_real(r)) : of(RMP_TYPE_INT, Slot::of(i)));
    }
    if (kind_ == 's') {
      Value v;
      v.type = RMP_TYPE_STRING;
      v.own = {Slot{}};
      v.text = word_;
      next();
      return v;
    }
    if (kind_ != 'n')
      return wrong("\"" + word_ + "\" is not a value",
                   "Values are names, fields, elements, numbers, strings, TRUE and FALSE.");
    return name(depth);
  }
  Result<Value> name(int depth) {
    const std::string wanted = word_;
    next();
    Value v;
    if (kind_ == 'o' && word_ == "(")
      return wrong(wanted + " is a call, and a debugger cannot call functions",
                   "Use names, fields, elements and operators.");
    if (wanted == "TRUE" || wanted == "FALSE") return known(truth(wanted == "TRUE"));
    RMP_TRY_ASSIGN(v, variable(wanted));
    for (;;) {
      if (take(".")) {
        if (kind_ != 'n') return wrong("the name of a field is missing before " + word_);
        const rmp_code_type& t = c_.type(v.type);
        if (t.kind != RMP_TYPE_RECORD) return none(c_.type_name(v.type) + " has no fields");
        std::uint32_t offset = 0, found = kNone;
        for (std::uint32_t k = 0; k < t.field_count && found == kNone; ++k) {
          const auto& f = c_.field(t.first_field + k);
          if (text::upper(f.name) == word_) found = f.type;
          else offset += c_.types[f.type].slots;
        }
        if (found == kNone) return none(c_.type_name(v.type) + " has no field " + word_);
        if (v.at) v.at += offset;
        v.address += offset;
        v.type = found;
        next();
        continue;
      }
      if (!take("[")) return v;
      do {
        RMP_TRY_ASSIGN(Value i, either(depth + 1));
        if (i.type != RMP_TYPE_INT) return none("an index must be an INT");
        if (has_no_values()) RMP_TRY(element(v, i));
        else RMP_TRY(index(v, i.slots()->integer()));
      } while (take(","));
      if (!take("]")) return wrong("\"]\" is missing before " + word_);
    }
  }
  static Error outside(std::int64_t i, std::int64_t low, std::int64_t high) {
    return none("the index " + std::to_string(i) + " is outside " + std::to_string(low) + ".." +
                std::to_string(high));
  }
  /// Only the type of an element; of an array its bounds, where the index is known.
  Result<void> element(Value& v, const Value& i) const {
    const TypeInfo& t = c_.types[v.type];
    if (t.kind != RMP_TYPE_ARRAY && t.kind != RMP_TYPE_STRING && t.kind != RMP_TYPE_LIST)
      return none(c_.type_name(v.type) + " has no elements");
    const std::int64_t k = i.slots()->integer();
    const std::int64_t last = std::int64_t{t.lower} + t.length - 1;
    if (t.kind == RMP_TYPE_ARRAY && !is_skipping_ && i.is_known && (k < t.lower || k > last))
      return outside(k, t.lower, last);
    v = typed(t.kind == RMP_TYPE_STRING ? std::uint32_t{RMP_TYPE_CHAR} : t.element);
    return {};
  }
  Result<void> index(Value& v, std::int64_t i) {
    const TypeInfo& t = c_.types[v.type];
    if (t.kind == RMP_TYPE_ARRAY) {
      const std::int64_t k = i - t.lower;
      if (k < 0 || k >= t.length) return outside(i, t.lower, std::int64_t{t.lower} + t.length - 1);
      const auto offset = static_cast<std::uint64_t>(k) * t.element_slots;
      v.at += offset;
      v.address += offset;
      v.type = t.element;
      return {};
    }
    if (t.kind == RMP_TYPE_STRING) {
      const std::string s = text_of(v);
      if (i < 1 || i > static_cast<std::int64_t>(s.size()))
        return outside(i, 1, static_cast<std::int64_t>(s.size()));
      v.own = {Slot::of(static_cast<unsigned char>(s[static_cast<std::size_t>(i - 1)]))};
      v.at = nullptr;
      v.character = static_cast<std::uint64_t>(i);
      v.type = RMP_TYPE_CHAR;
      return {};
    }
    if (t.kind != RMP_TYPE_LIST) return none(c_.type_name(v.type) + " has no elements");
    const Heap::List* l = run_.list_of(*v.at);
    const std::int64_t n =
        l && t.element_slots ? static_cast<std::int64_t>(l->slots.size() / t.element_slots) : 0;
    if (i < 1 || i > n) return outside(i, 1, n);
    const auto offset = static_cast<std::uint64_t>(i - 1) * t.element_slots;
    v.address = kListAddress |
                (static_cast<std::uint64_t>(static_cast<std::uint32_t>(v.at->bits)) << 32) | offset;
    v.at = l->slots.data() + offset;
    v.type = t.element;
    return {};
  }
  /// Of the innermost scope in which the name is: routine, program, modules and cell.
  Result<Value> variable(const std::string& wanted) {
    const rmp_code& t = c_.tables();
    const std::uint32_t routine = is_reading_ ? routine_ : frame_ ? frame_->routine : 0;
    std::uint32_t best = kNone;
    int best_rank = -1;
    static const std::vector<std::uint32_t> nothing;
    const auto found = c_.debug_index().symbols.find(wanted);
    const auto& named = found == c_.debug_index().symbols.end() ? nothing : found->second;
    for (const std::uint32_t s : named) {
      const auto& x = c_.symbol(s);
      if (c_.place_of[s].offset == kNone) continue;
      int rank = 0;
      if (c_.place_of[s].space == kFrame) {
        if (x.routine != routine || (!frame_ && !is_reading_)) continue;
        rank = 100;
      } else if (x.scope != kNone && x.scope < t.scopes.count) {
        rank = static_cast<int>(row<rmp_code_scope>(t.scopes, x.scope).kind) + 1;
        if (x.routine != kNone && x.routine != routine) continue;
      }
      if (rank > best_rank) {
        best_rank = rank;
        best = s;
      }
    }
    if (best == kNone) {
      for (const std::uint32_t s : named) {
        const auto& x = c_.symbol(s);
        if (x.kind == RMP_SYMBOL_INPUT || x.kind == RMP_SYMBOL_OUTPUT)
          return none("the signal " + std::string(x.name) + " is stored in the world",
                      "Read it from the world.");
      }
      return none("nothing that has a value is named " + wanted + " here");
    }
    Value v;
    v.type = c_.place_of[best].type;
    if (is_reading_) return typed(v.type);
    v.at = slots_of(best, &v.address, &v.character);
    v.name = c_.symbol(best).name;
    if (!v.at) return none(v.name + " has no value here");
    if (v.character && v.type == RMP_TYPE_CHAR) {
      const std::string s(run_.text_of(*v.at));
      if (v.character > s.size()) return none("the string has become shorter");
      v.own = {Slot::of(static_cast<unsigned char>(s[v.character - 1]))};
      v.at = nullptr;
    }
    return v;
  }

  const Machine::Code& c_;
  Run run_;
  Machine::State& s_;
  Process* process_ = nullptr;
  const Frame* frame_ = nullptr;
  std::string_view text_;
  std::size_t at_ = 0;
  char kind_ = 'e';
  std::string word_;
  bool is_reading_ = false, is_skipping_ = false;
  std::uint32_t routine_ = 0;  ///< in which names are looked up while it is read
};

Result<bool> Run::holds(Process& p, const std::string& condition) {
  return Debugger(c_, s_).condition(condition, p.routine);
}

std::string Run::log_text(Process& p, const std::string& log) {
  std::string out;
  for (std::size_t i = 0; i < log.size();) {
    const std::size_t end = log[i] == '{' ? log.find('}', i) : std::string::npos;
    if (end == std::string::npos) {
      out += log[i++];
      continue;
    }
    const std::string expression = log.substr(i + 1, end - i - 1);
    Debugger d(c_, s_);
    const auto v = d.evaluate(expression, p.routine, 0);
    VariableCut cut;
    cut.depth = 0;
    out += v.ok() ? d.tree("", *v, cut).value : "{" + expression + ": " + v.error().message + "}";
    i = end + 1;
  }
  return out;
}

void Run::say_log(Process& p, std::uint32_t op, const std::string& log) {
  if (!world_) return;
  const rmp_span span = c_.instruction_of[op] == kNone ? rmp_span{} : c_.instruction(op).span;
  // What a debugger says is no fault of the program.
  static_cast<void>(world_->log_text(p.routine, span, log_text(p, log)));
}

namespace {

/// Row of a file; "" = the program's own.
Result<std::uint32_t> file_row(const rmp_code& t, std::string_view name) {
  if (name.empty()) return std::uint32_t{0};
  for (std::uint32_t f = 0; f < t.files.count; ++f)
    if (text::upper(row<rmp_code_file>(t.files, f).name) == text::upper(name)) return f;
  std::string all;
  for (std::uint32_t f = 0; f < t.files.count && f < 10; ++f)
    all += (f ? ", " : "") + std::string(row<rmp_code_file>(t.files, f).name);
  return error(ErrorCode::not_found, "the program has no file " + std::string(name),
               "Its files are " + all + ".");
}

/// First op of the body of a routine, behind the initial values of its variables; kNone = it does
/// nothing.
std::uint32_t first_op(const Machine::Code& code, std::uint32_t routine) {
  const RoutineInfo& r = code.routines[routine];
  const rmp_code& t = code.tables();
  const std::uint32_t body = row<rmp_code_routine>(t.routines, routine).body;
  if (body >= t.statements.count) return kNone;
  const rmp_span& begin = row<rmp_code_statement>(t.statements, body).span;
  auto at = std::lower_bound(code.statement_ops.begin(), code.statement_ops.end(), r.first);
  for (; at != code.statement_ops.end() && *at < r.first + r.count; ++at) {
    const rmp_span& s = code.instruction(*at).span;
    if (s.file == begin.file && s.begin >= begin.begin) return *at;
  }
  return kNone;
}

}  // namespace

const DebugIndex& Machine::Code::debug_index() const {
  std::call_once(is_indexed_, [this] {
    index_.statements = statement_ops;
    const auto place = [this](std::uint32_t op) {
      const rmp_span& s = instruction(op).span;
      return std::tuple(s.file, s.line, s.column, op);
    };
    std::sort(index_.statements.begin(), index_.statements.end(),
              [&](std::uint32_t a, std::uint32_t b) { return place(a) < place(b); });
    for (std::uint32_t s = 0; s < tables().symbols.count; ++s) {
      index_.symbols[text::upper(symbol(s).name)].push_back(s);
      if (place_of[s].offset != kNone && place_of[s].space == kFrame)
        index_.locals[symbol(s).routine].push_back(s);
    }
    for (std::uint32_t r = 0; r < tables().routines.count; ++r)
      index_.routines[text::upper(routine_name(r))] = r;
  });
  return index_;
}

std::uint32_t Machine::Code::statement_at(std::uint32_t file, std::uint32_t line) const {
  const auto& all = debug_index().statements;
  const auto at =
      std::lower_bound(all.begin(), all.end(), std::pair(file, line),
                       [&](std::uint32_t op, const std::pair<std::uint32_t, std::uint32_t>& to) {
                         const rmp_span& s = instruction(op).span;
                         return std::pair(s.file, s.line) < to;
                       });
  return at != all.end() && instruction(*at).span.file == file ? *at : kNone;
}

Result<std::vector<rmp_span>> Machine::statements(std::string_view file) const {
  RMP_TRY_ASSIGN(const std::uint32_t wanted, file_row(code(), file));
  std::vector<rmp_span> out;
  for (const std::uint32_t op : code_->debug_index().statements)
    if (code_->instruction(op).span.file == wanted) out.push_back(code_->instruction(op).span);
  const auto key = [](const rmp_span& s) { return std::pair(s.line, s.column); };
  out.erase(std::unique(out.begin(), out.end(),
                        [&](const rmp_span& a, const rmp_span& b) { return key(a) == key(b); }),
            out.end());
  return out;
}

std::vector<Machine::RoutinePlace> Machine::routines() const {
  std::vector<RoutinePlace> out;
  for (std::uint32_t r = 0; r < code().routines.count; ++r)
    if (const std::uint32_t op = first_op(*code_, r); op != kNone)
      out.push_back({code_->routine_name(r), code_->instruction(op).span});
  return out;
}

std::string Machine::process_name(std::uint32_t process) const {
  return process < code().routines.count ? code_->routine_name(process) : std::string();
}

namespace {
/// Whether what stands in the braces of a log point may have a value in a routine.
Result<void> check_log(const Machine::Code& code, Machine::State& state, std::string_view log,
                       std::uint32_t routine) {
  for (std::size_t i = 0; i < log.size();) {
    const std::size_t end = log[i] == '{' ? log.find('}', i) : std::string_view::npos;
    if (end == std::string_view::npos) {
      ++i;
      continue;
    }
    const auto value = Debugger(code, state).check(log.substr(i + 1, end - i - 1), routine);
    if (!value.ok()) return value.error();
    i = end + 1;
  }
  return {};
}
}  // namespace

Result<Breakpoint> Machine::set_breakpoint(Breakpoint b) {
  const rmp_code& t = code();
  RMP_TRY_ASSIGN(std::uint32_t file, file_row(t, b.file));
  // The first statement at or behind the line; of several in one line the first one.
  std::uint32_t best = kNone;
  const DebugIndex& index = code_->debug_index();
  if (!b.routine.empty()) {
    if (const auto found = index.routines.find(text::upper(b.routine));
        found != index.routines.end())
      best = first_op(*code_, found->second);
    if (best == kNone) {
      std::string known;
      for (std::uint32_t r = 0; r < t.routines.count && r < 20; ++r)
        known += (r ? ", " : "") + code_->routine_name(r);
      return error(ErrorCode::not_found,
                   "the program has no routine " + b.routine + " with statements",
                   "It has " + known + ".");
    }
    file = code_->instruction(best).span.file;
  } else {
    best = code_->statement_at(file, b.line);
  }
  if (best == kNone)
    return error(ErrorCode::not_found,
                 "there is no statement in line " + std::to_string(b.line) + " or after it",
                 "Choose a line with statements.");
  if (!b.condition.empty()) {
    const auto checked =
        Debugger(*code_, *state_).check_condition(b.condition, code_->routine_of_op[best]);
    if (!checked.ok()) return Error(checked.error()).in("the condition of a breakpoint");
  }
  if (!b.log.empty()) {
    const auto checked = check_log(*code_, *state_, b.log, code_->routine_of_op[best]);
    if (!checked.ok()) return Error(checked.error()).in("the text of a log point");
  }
  const rmp_code_file& f = row<rmp_code_file>(t.files, file);
  b.file = f.name;
  b.line = code_->instruction(best).span.line;
  b.column = code_->instruction(best).span.column;
  State& s = own();
  if (b.number == 0) b.number = s.next_breakpoint, b.hits = 0;
  s.next_breakpoint = std::max(s.next_breakpoint, b.number + 1);
  BreakpointSet& set = own_part(s.breakpoints);
  const std::uint64_t hits = std::exchange(b.hits, 0);
  set.all.emplace(b.number, BreakpointSet::One{b, best});
  std::vector<std::uint32_t>& here = set.numbers[best];
  here.insert(std::upper_bound(here.begin(), here.end(), b.number), b.number);
  if (hits > 0) own_part(s.hits)[b.number] = b.hits = hits;
  set.is_at.resize(code_->ops.size());
  set.is_at[best] = true;
  return b;
}

bool Machine::remove_breakpoint(std::uint32_t number) {
  if (!state_->breakpoints || !state_->breakpoints->all.contains(number)) return false;
  State& s = own();
  BreakpointSet& set = own_part(s.breakpoints);
  const auto found = set.all.find(number);
  const std::uint32_t op = found->second.op;
  set.all.erase(found);
  const auto at = set.numbers.find(op);
  std::erase(at->second, number);
  if (at->second.empty()) {
    set.numbers.erase(at);
    set.is_at[op] = false;
  }
  if (set.all.empty()) s.breakpoints = nullptr;
  if (s.hits && s.hits->contains(number)) own_part(s.hits).erase(number);
  return true;
}
std::vector<Breakpoint> Machine::breakpoints() const {
  std::vector<Breakpoint> out;
  if (!state_->breakpoints) return out;
  out.reserve(state_->breakpoints->all.size());
  for (const auto& [number, one] : state_->breakpoints->all) {
    out.push_back(one.what);
    if (!state_->hits) continue;
    if (const auto hits = state_->hits->find(number); hits != state_->hits->end())
      out.back().hits = hits->second;
  }
  return out;
}

void Machine::step(StepKind kind, std::uint32_t process) {
  State& s = own();
  s.is_stepping = true;
  s.step = kind;
  s.step_process = process;
  s.step_depth = 1;
  s.step_from = {kNone, 0, 0, 0, 0};
  if (const auto at = place_of(process)) {
    s.step_depth = at->depth;
    if (at->span.line > 0) s.step_from = at->span;
  }
}
void Machine::pause() { own().wants_pause = true; }
void Machine::stop_on_entry(bool counts) {
  State& s = own();
  s.entry_op = first_op(*code_, 0);
  s.entry_counts = counts;
}

bool Machine::has_instructions_of(const Machine& other) const {
  const auto &a = code_->ops, &b = other.code_->ops;
  return code_ == other.code_ ||
         std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Op& x, const Op& y) { return x.code == y.code; });
}

bool Machine::stop_as(const Machine& other, double until, bool exactly) {
  const State& theirs = *other.state_;
  const auto& stop = theirs.status.stop;
  if (theirs.status.state != RunState::stopped || !stop) return false;
  State::Again again;
  again.until = until;
  again.reason = stop->reason;
  again.breakpoint = stop->breakpoint;
  const bool is_same = has_instructions_of(other);
  if (is_same) {
    for (const Process& p : theirs.processes)
      if (p.routine == stop->process && !p.is_ended) again.op = p.pc;
    again.process = stop->process;
  } else {
    const auto& routines = code_->debug_index().routines;
    const auto process = routines.find(text::upper(other.process_name(stop->process)));
    const rmp_table& files = other.code().files;
    if (stop->span.file >= files.count || process == routines.end()) return false;
    const auto file = file_row(code(), row<rmp_code_file>(files, stop->span.file).name);
    if (!file.ok()) return false;
    again.op = code_->statement_at(*file, stop->span.line);
    again.process = process->second;
  }
  if (again.op == kNone) return false;
  if (exactly) {
    if (!is_same || state_->instructions > theirs.instructions) return false;
    again.instructions = theirs.instructions;
  } else if (stop->reason == StopReason::breakpoint && theirs.breakpoints) {
    const auto at = theirs.breakpoints->all.find(stop->breakpoint);
    if (at != theirs.breakpoints->all.end()) again.condition = at->second.what.condition;
  }
  State& s = own();
  s.entry_counts = again.reason == StopReason::entry && theirs.entry_counts;
  s.again = std::move(again);
  return true;
}

void Machine::keep_journal() {
  State& s = own();
  s.keeps_journal = true;
  s.has_run.resize(code_->ops.size());
}

std::vector<StatementPlace> Machine::statements() const {
  std::vector<StatementPlace> out;
  for (const std::uint32_t op : code_->statement_ops)
    out.push_back({code_->routine_of_op[op], code_->instruction(op).span,
                   op < state_->has_run.size() && state_->has_run[op]});
  return out;
}

std::vector<EndedWait> Machine::timeouts() const { return state_->timeouts; }

std::uint32_t Machine::running_process() const { return state_->running; }

bool Machine::waive_wait(std::uint32_t process) {
  State& s = own();
  for (Process& p : s.processes) {
    if (p.routine != process || p.is_ended || p.wait.kind != Waits::condition) continue;
    if (p.frames.back().wait == kNone) continue;
    p.frames.back().is_waived = true;
    ++s.progress;
    return true;
  }
  return false;
}

std::vector<CallPlace> Machine::call_stack(std::uint32_t process) const {
  std::vector<CallPlace> out;
  const Process* const p = begun_process(*state_, process);
  if (!p) return out;
  std::uint32_t op = p->pc;
  if (p->wait.is_behind && op > 0) --op;
  for (std::size_t k = p->frames.size(); k-- > 0;) {
    CallPlace x;
    x.routine = p->frames[k].routine;
    x.name = code_->routine_name(x.routine);
    if (op < code_->ops.size() && code_->instruction_of[op] != kNone)
      x.span = code_->instruction(op).span;
    x.statement_line = x.span.line;
    out.push_back(std::move(x));
    op = p->frames[k].back;
    if (op > 0 && p->frames[k].kind == FrameKind::call) --op;
  }
  return out;
}

std::optional<Machine::InnermostPlace> Machine::place_of(std::uint32_t process) const {
  const Process* const p = begun_process(*state_, process);
  if (!p || p->frames.empty()) return std::nullopt;
  InnermostPlace out;
  out.depth = p->frames.size();
  std::uint32_t op = p->pc;
  if (p->wait.is_behind && op > 0) --op;
  if (op < code_->ops.size() && code_->instruction_of[op] != kNone)
    out.span = code_->instruction(op).span;
  return out;
}

std::vector<Variable> Machine::variables(std::uint32_t process, std::uint32_t frame,
                                         const VariableCut& cut) const {
  std::vector<Variable> out;
  Debugger d(*code_, *state_);
  if (!d.at_frame(process, frame).ok() || !d.process()) return out;
  const Process& p = *d.process();
  const std::uint32_t routine = p.frames[p.frames.size() - 1 - frame].routine;
  const auto locals = code_->debug_index().locals.find(routine);
  if (locals == code_->debug_index().locals.end()) return out;
  for (const std::uint32_t s : locals->second) {
    const auto& x = code_->symbol(s);
    const Place& place = code_->place_of[s];
    std::uint64_t character = 0;
    const Slot* slots = d.slots_of(s, nullptr, &character);
    if (!slots) continue;
    Slot one;
    if (character && place.type == RMP_TYPE_CHAR) {
      const std::string_view text = d.run().text_of(*slots);
      if (character > text.size()) continue;
      one = Slot::of(static_cast<unsigned char>(text[character - 1]));
      slots = &one;
    }
    out.push_back(d.tree(x.name, place.type, slots, cut));
  }
  return out;
}

std::vector<Variable> Machine::globals(const VariableCut& cut) const {
  std::vector<Variable> out;
  Debugger d(*code_, *state_);
  const rmp_code& t = code();
  for (std::uint32_t s = 0; s < t.symbols.count; ++s) {
    const auto& x = code_->symbol(s);
    if (code_->place_of[s].offset == kNone || code_->place_of[s].space != kGlobal) continue;
    if (x.scope != kNone && x.scope < t.scopes.count &&
        row<rmp_code_scope>(t.scopes, x.scope).kind == RMP_SCOPE_PREDEFINED)
      continue;
    if (const Slot* slots = d.slots_of(s)) out.push_back(d.tree(x.name, x.type, slots, cut));
  }
  return out;
}

Result<Variable> Machine::evaluate(std::string_view expression, std::uint32_t process,
                                   std::uint32_t frame, const VariableCut& cut) const {
  Debugger d(*code_, *state_);
  RMP_TRY_ASSIGN(const auto v, d.evaluate(expression, process, frame));
  return d.tree(std::string(expression), v, cut);
}

Result<Variable> Machine::assign(std::string_view place, std::string_view expression,
                                 std::uint32_t process, std::uint32_t frame) {
  State& s = own();
  Debugger d(*code_, s);
  RMP_TRY_ASSIGN(auto to, d.evaluate(place, process, frame));
  RMP_TRY_ASSIGN(const auto v, Debugger(*code_, s).evaluate(expression, process, frame));
  const auto refused = [&](std::string message, std::string hint = {}) {
    return error(ErrorCode::invalid_argument, std::move(message), std::move(hint),
                 std::string(place));
  };
  if (to.name.empty())
    return refused("this is not a variable", "Name a variable, a field, an element.");
  if (to.address & kConstantAddress) return refused("a constant cannot be assigned");
  const std::uint32_t kind = code_->types[to.type].kind;
  Slot slot;
  if (kind == RMP_TYPE_REAL && (v.type == RMP_TYPE_INT || v.type == RMP_TYPE_REAL)) {
    slot = v.type == RMP_TYPE_REAL ? *v.slots() : Slot::of_real(v.slots()->integer());
  } else if (kind == RMP_TYPE_CHAR && (v.type == RMP_TYPE_CHAR || v.type == RMP_TYPE_INT)) {
    slot = *v.slots();
    if (slot.integer() < 0 || slot.integer() > 255)
      return refused("the code of a CHAR must be from 0 to 255");
  } else if (kind == RMP_TYPE_CHAR && v.type == RMP_TYPE_STRING) {
    const std::string text = v.at ? std::string(d.run().text_of(*v.at)) : v.text;
    if (text.size() != 1) return refused("a CHAR must be one character");
    slot = Slot::of(static_cast<unsigned char>(text[0]));
  } else if (kind == RMP_TYPE_STRING && v.type == RMP_TYPE_STRING) {
    slot = d.run().new_text(v.at ? std::string(d.run().text_of(*v.at)) : v.text);
  } else if ((kind == RMP_TYPE_INT && (v.type == RMP_TYPE_INT || v.type == RMP_TYPE_CHAR)) ||
             (kind == RMP_TYPE_BOOL && v.type == RMP_TYPE_BOOL)) {
    slot = *v.slots();
  } else if (kind >= RMP_TYPE_ARRAY && code_->types[v.type].shape == code_->types[to.type].shape &&
             v.at && !code_->types[to.type].has_list) {
    const std::uint32_t n = code_->types[to.type].slots;
    const std::vector<Slot> copy(v.at, v.at + n);
    Slot* at = d.slots_at(to.address, n, true);
    if (!at) return refused("it has no place");
    std::copy(copy.begin(), copy.end(), at);
    ++s.progress;
    return evaluate(place, process, frame);
  } else {
    return refused("it is " + code_->type_name(to.type) + ", but the value is " +
                   code_->type_name(v.type));
  }
  Slot* at = d.slots_at(to.address, 1, true);
  if (!at) return refused("it has no place");
  if (to.character) {
    std::string text(d.run().text_of(*at));
    if (to.character > text.size()) return refused("the string has become shorter");
    text[to.character - 1] = static_cast<char>(slot.integer());
    const Slot made = d.run().new_text(std::move(text));
    *d.slots_at(to.address, 1, true) = made;
  } else {
    *at = slot;
  }
  ++s.progress;
  return evaluate(place, process, frame);
}

}  // namespace robomosp::program
