// SPDX-License-Identifier: Apache-2.0
// ProgramTables: the tables of program_code.h, to be filled by a compiler; and the text form of
// three-address code, which is saved and read again (layer: contract helper, inline only, not part
// of the ABI).
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <deque>
#include <iterator>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include <robomosp/sdk/language.h>
#include <robomosp/sdk/program_code.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

/// Row `i` of a table with rows of this type.
template <class Row>
[[nodiscard]] const Row& row(const rmp_table& table, std::uint32_t i) {
  return *static_cast<const Row*>(rmp_row(&table, i));
}

/// Owns the tables of a program. Fill them, then seal().
class ProgramTables final : public CompiledProgram {
 public:
  std::vector<rmp_code_file> files;
  std::vector<rmp_code_fault> faults;
  std::vector<rmp_code_type> types;
  std::vector<rmp_code_field> fields;
  std::vector<rmp_code_constant> constants;
  std::vector<rmp_code_scope> scopes;
  std::vector<rmp_code_symbol> symbols;
  std::vector<rmp_code_routine> routines;
  std::vector<rmp_code_expression> expressions;
  std::vector<rmp_code_statement> statements;
  std::vector<rmp_code_motion> motions;
  std::vector<rmp_code_attribute> attributes;
  std::vector<std::uint32_t> links;
  std::vector<rmp_code_instruction> instructions;

  ProgramTables() = default;
  ProgramTables(const ProgramTables&) = delete;
  ProgramTables& operator=(const ProgramTables&) = delete;

  /// A copy that stays as long as the tables; equal texts are kept once. It ends with a zero.
  const char* keep(std::string_view text) {
    if (const auto found = kept_.find(text); found != kept_.end()) return found->second;
    const std::string& copy = texts_.emplace_back(text);
    kept_.emplace(std::string_view(copy), copy.c_str());
    return copy.c_str();
  }
  std::uint32_t integer(std::int64_t value, std::uint32_t type = RMP_TYPE_INT) {
    return add_constant({RMP_CONSTANT_INT, type, value, 0.0, "", 0}, {});
  }
  std::uint32_t real(double value) {
    return add_constant({RMP_CONSTANT_REAL, RMP_TYPE_REAL, 0, value, "", 0}, {});
  }
  std::uint32_t text(std::string_view value) {
    return add_constant({RMP_CONSTANT_TEXT, RMP_TYPE_STRING, 0, 0.0, keep(value), value.size()},
                        value);
  }
  void set_name(std::string_view name) { code_.name = keep(name); }
  /// Lets code() show what the tables hold now.
  void seal() {
    code_.struct_size = sizeof code_;
    code_.has_errors = 0;
    for (const rmp_code_fault& f : faults)
      if (f.severity == RMP_FAULT_ERROR) code_.has_errors = 1;
    if (!code_.name) code_.name = "";
    const auto show = [](rmp_table& to, const auto& rows) {
      to = {rows.data(), static_cast<std::uint32_t>(rows.size()), sizeof rows[0]};
    };
    show(code_.files, files);
    show(code_.faults, faults);
    show(code_.types, types);
    show(code_.fields, fields);
    show(code_.constants, constants);
    show(code_.scopes, scopes);
    show(code_.symbols, symbols);
    show(code_.routines, routines);
    show(code_.expressions, expressions);
    show(code_.statements, statements);
    show(code_.motions, motions);
    show(code_.attributes, attributes);
    show(code_.links, links);
    show(code_.instructions, instructions);
  }
  [[nodiscard]] const rmp_code& code() const override { return code_; }

 private:
  std::uint32_t add_constant(const rmp_code_constant& c, std::string_view text) {
    std::uint64_t bits = static_cast<std::uint64_t>(c.integer);
    if (c.kind == RMP_CONSTANT_REAL) __builtin_memcpy(&bits, &c.real, sizeof bits);
    const auto [it, is_new] = known_.try_emplace({c.kind, c.type, bits, std::string(text)},
                                                 static_cast<std::uint32_t>(constants.size()));
    if (is_new) constants.push_back(c);
    return it->second;
  }
  rmp_code code_{};
  std::deque<std::string> texts_;
  std::unordered_map<std::string_view, const char*> kept_;
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint64_t, std::string>, std::uint32_t>
      known_;
};

namespace code_text_detail {

inline constexpr std::string_view kOps[] = {
    "COPY",           "CONVERT",    "NEGATE",    "NOT",           "ADD",        "SUBTRACT",
    "MULTIPLY",       "DIVIDE",     "DIV",       "MOD",           "EQUAL",      "NOT_EQUAL",
    "LESS",           "LESS_EQUAL", "GREATER",   "GREATER_EQUAL", "EXOR",       "COMPOSE",
    "FIELD",          "ELEMENT",    "LOAD",      "STORE",         "ARGUMENT",   "ARGUMENT_PLACE",
    "CALL",           "INTRINSIC",  "MAKE",      "LABEL",         "JUMP",       "JUMP_IF",
    "JUMP_UNLESS",    "RETURN",     "WAIT_TIME", "WAIT_BEGIN",    "WAIT_TEST",  "PAUSE",
    "HALT",           "TARGET",     "ATTRIBUTE", "UNTIL",         "UNTIL_TEST", "MOVE",
    "START",          "STOP",       "CONTINUE",  "CANCEL",        "ENABLE",     "DISABLE",
    "INTERRUPT_TEST", "TEACH"};
inline constexpr std::string_view kMoves[] = {"PTP", "LIN", "CIRCLE", "PATH"};
inline constexpr std::string_view kAttributes[] = {
    "SPEED",   "SPEED_ORI", "ACC",          "TIME",      "C_CP",    "C_SPEED", "C_PASS", "WOBBLE",
    "ACT_ROB", "DEVICE",    "ADAX_CONTROL", "SPEED_PTP", "ACC_PTP", "C_PTP",   "TOOL",   "FRAME"};
inline constexpr std::string_view kSymbols[] = {"CONSTANT", "VARIABLE", "PARAMETER",
                                                "INPUT",    "OUTPUT",   "ROBOT"};

inline std::string quoted(std::string_view s) {
  std::string out = "'";
  for (const char c : s) {
    out += c;
    if (c == '\'') out += c;
  }
  return out + "'";
}
inline std::string real_text(double v) {
  char buffer[40];
  // Without an exponent where a person writes none: 100000.0, and not 1e+05.
  const double size = v < 0 ? -v : v;
  const bool is_plain = size == 0 || (size >= 1e-4 && size < 1e15);
  const auto end =
      is_plain ? std::to_chars(buffer, buffer + sizeof buffer, v, std::chars_format::fixed).ptr
               : std::to_chars(buffer, buffer + sizeof buffer, v).ptr;
  std::string s(buffer, end);
  return s.find_first_of(".e") == std::string::npos ? s + ".0" : s;
}
inline std::string constant_text(const rmp_code_constant& c) {
  if (c.kind == RMP_CONSTANT_TEXT) return quoted({c.text, c.text_size});
  if (c.kind == RMP_CONSTANT_REAL) return real_text(c.real);
  if (c.type == RMP_TYPE_BOOL) return c.integer ? "TRUE" : "FALSE";
  return (c.type == RMP_TYPE_CHAR ? "c" : "") + std::to_string(c.integer);
}
inline std::string type_text(std::uint32_t t) { return "T" + std::to_string(t); }

inline std::string operand_text(const rmp_code& code, const rmp_code_operand& o, std::uint32_t op) {
  const auto number = std::to_string(o.index);
  const auto at = static_cast<std::size_t>(o.index);
  switch (o.kind) {
    case RMP_OPERAND_CONSTANT:
      return constant_text(
          row<rmp_code_constant>(code.constants, static_cast<std::uint32_t>(o.index)));
    case RMP_OPERAND_VARIABLE: return "v" + number;
    case RMP_OPERAND_TEMPORARY: return "t" + number + ":" + type_text(o.type);
    case RMP_OPERAND_REFERENCE: return "p" + number + ":" + type_text(o.type);
    case RMP_OPERAND_LABEL: return "L" + number;
    case RMP_OPERAND_ROUTINE: return "r" + number;
    case RMP_OPERAND_NUMBER: return "#" + number;
    case RMP_OPERAND_WORD: return std::string(op == RMP_OP_MOVE ? kMoves[at] : kAttributes[at]);
    case RMP_OPERAND_INTRINSIC:
      return row<rmp_code_symbol>(code.symbols, static_cast<std::uint32_t>(o.index)).name;
    default: return "-";
  }
}

/// Splits a line into its four fields, strings whole. False = it has another number of them.
inline bool split(std::string_view line, std::string_view (&out)[4]) {
  std::size_t n = 0, i = 0;
  while (i < line.size()) {
    if (line[i] == ' ' || line[i] == '\t' || line[i] == '\r') {
      ++i;
      continue;
    }
    const std::size_t begin = i;
    if (line[i] == '\'') {
      for (++i; i < line.size(); ++i) {
        if (line[i] != '\'') continue;
        if (i + 1 < line.size() && line[i + 1] == '\'') ++i;
        else break;
      }
      if (i == line.size()) return false;
      ++i;
    } else {
      while (i < line.size() && line[i] != ' ' && line[i] != '\t' && line[i] != '\r') ++i;
    }
    if (n == 4) return false;
    out[n++] = line.substr(begin, i - begin);
  }
  return n == 4;
}
template <class T>
bool number(std::string_view s, T& out) {
  const auto r = std::from_chars(s.data(), s.data() + s.size(), out);
  return !s.empty() && r.ec == std::errc() && r.ptr == s.data() + s.size();
}
inline std::string unquoted(std::string_view s) {
  std::string out;
  for (std::size_t i = 1; i + 1 < s.size(); ++i) {
    out += s[i];
    if (s[i] == '\'') ++i;
  }
  return out;
}

/// What the fields of instructions may be, so that whoever runs them need not look: kinds that an
/// op takes, types that fit, numbers in range, arguments right before what takes them.
class Strict {
 public:
  explicit Strict(const ProgramTables& p) : p_(p) {}
  /// What is wrong with instruction `i` of routine `r`, which follows those that were looked at;
  /// nullptr = nothing.
  const char* fault(std::uint32_t r, const rmp_code_instruction& i) {
    if (r != routine_) {
      routine_ = r;
      set_.clear();
      arguments_.clear();
      targets_ = 0;
    }
    for (const rmp_code_operand* o : {&i.a, &i.b})
      if ((o->kind == RMP_OPERAND_TEMPORARY || o->kind == RMP_OPERAND_REFERENCE) && !is_set(*o))
        return "a temporary is used before it was set with this type";
    if (i.op == RMP_OP_STORE && i.r.kind == RMP_OPERAND_REFERENCE && !is_set(i.r))
      return "a place is used before it was set with this type";
    const bool takes = i.op == RMP_OP_CALL || i.op == RMP_OP_INTRINSIC || i.op == RMP_OP_MAKE;
    const bool gives = i.op == RMP_OP_ARGUMENT || i.op == RMP_OP_ARGUMENT_PLACE;
    if (!takes && !gives && !arguments_.empty())
      return "arguments must come directly before the CALL, INTRINSIC or MAKE that takes them";
    const char* wrong = one(i);
    if (takes) arguments_.clear();
    if (gives) arguments_.push_back(i);
    if (!wrong && i.op != RMP_OP_STORE &&
        (i.r.kind == RMP_OPERAND_TEMPORARY || i.r.kind == RMP_OPERAND_REFERENCE))
      set_[i.r.index] = {i.r.kind, i.r.type};
    return wrong;
  }
  /// At the end of a routine.
  [[nodiscard]] const char* fault_at_end() const {
    if (!arguments_.empty()) return "arguments are not followed by a CALL, INTRINSIC or MAKE";
    return targets_ > 0 ? "targets are not followed by a MOVE" : nullptr;
  }

 private:
  using O = rmp_code_operand;
  static bool none(const O& o) { return o.kind == RMP_OPERAND_NONE; }
  static bool value(const O& o) {
    return o.kind == RMP_OPERAND_CONSTANT || o.kind == RMP_OPERAND_VARIABLE ||
           o.kind == RMP_OPERAND_TEMPORARY;
  }
  static bool value(const O& o, std::uint32_t type) { return value(o) && o.type == type; }
  static bool reference(const O& o) { return o.kind == RMP_OPERAND_REFERENCE; }
  bool result(const O& o) const {
    if (o.kind == RMP_OPERAND_TEMPORARY) return true;
    return o.kind == RMP_OPERAND_VARIABLE &&
           p_.symbols[static_cast<std::size_t>(o.index)].kind != RMP_SYMBOL_INPUT;
  }
  bool place(const O& o) const {
    return reference(o) || (o.kind == RMP_OPERAND_VARIABLE && result(o));
  }
  static bool label(const O& o) { return o.kind == RMP_OPERAND_LABEL; }
  bool is_set(const O& o) const {
    const auto it = set_.find(o.index);
    return it != set_.end() && it->second.first == o.kind && it->second.second == o.type;
  }
  [[nodiscard]] const rmp_code_type& type(std::uint32_t t) const { return p_.types[t]; }
  [[nodiscard]] std::uint32_t kind(const O& o) const { return type(o.type).kind; }
  [[nodiscard]] std::uint32_t role(const O& o) const { return type(o.type).role; }
  /// Whether a value of type `a` may be used for one of type `b`.
  [[nodiscard]] bool fits(std::uint32_t a, std::uint32_t b) const {
    if (a == b) return true;
    const rmp_code_type &x = type(a), &y = type(b);
    return x.kind == RMP_TYPE_ARRAY && y.kind == RMP_TYPE_ARRAY && x.element == y.element &&
           std::int64_t{x.upper} - x.lower == std::int64_t{y.upper} - y.lower;
  }
  [[nodiscard]] bool routine(const O& o, std::uint32_t first, std::uint32_t last) const {
    if (o.kind != RMP_OPERAND_ROUTINE) return false;
    const std::uint32_t k = p_.routines[static_cast<std::size_t>(o.index)].kind;
    return k >= first && k <= last;
  }
  bool argument(const rmp_code_instruction& given, std::uint32_t wanted, std::uint32_t mode) const {
    const bool is_place = mode != RMP_MODE_IN;
    return (given.op == RMP_OP_ARGUMENT_PLACE) == is_place && given.a.kind != RMP_OPERAND_ROUTINE &&
           (is_place ? given.a.type == wanted : fits(given.a.type, wanted));
  }
  const char* call(const rmp_code_instruction& i) const {
    constexpr const char* kWrong =
        "CALL has a procedure or function, the number of its arguments, "
        "arguments of its parameters' types, and its result";
    if (!routine(i.a, RMP_ROUTINE_PROCEDURE, RMP_ROUTINE_FUNCTION)) return kWrong;
    const rmp_code_routine& r = p_.routines[static_cast<std::size_t>(i.a.index)];
    if (i.b.kind != RMP_OPERAND_NUMBER || arguments_.size() != r.parameter_count ||
        static_cast<std::uint64_t>(i.b.index) != arguments_.size())
      return kWrong;
    for (std::uint32_t k = 0; k < r.parameter_count; ++k) {
      const rmp_code_symbol& s = p_.symbols[r.first_parameter + k];
      if (!argument(arguments_[k], s.type, s.mode)) return kWrong;
    }
    const bool is_right =
        r.result == RMP_TYPE_VOID ? none(i.r) : result(i.r) && i.r.type == r.result;
    return is_right ? nullptr : kWrong;
  }
  const char* make(const rmp_code_instruction& i) const {
    constexpr const char* kWrong =
        "MAKE has the number of its arguments, one for each part of the record, array or list";
    if (!none(i.a) || i.b.kind != RMP_OPERAND_NUMBER || !result(i.r) ||
        static_cast<std::uint64_t>(i.b.index) != arguments_.size())
      return kWrong;
    const rmp_code_type& t = type(i.r.type);
    const std::uint64_t count = arguments_.size();
    const bool is_whole =
        t.kind == RMP_TYPE_RECORD ? count == t.field_count
        : t.kind == RMP_TYPE_ARRAY
            ? count == static_cast<std::uint64_t>(std::int64_t{t.upper} - t.lower + 1)
            : t.kind == RMP_TYPE_LIST;
    if (!is_whole) return kWrong;
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t part =
          t.kind == RMP_TYPE_RECORD ? p_.fields[t.first_field + k].type : t.element;
      if (!argument(arguments_[k], part, RMP_MODE_IN)) return kWrong;
    }
    return nullptr;
  }
  bool converts(std::uint32_t from, std::uint32_t to) const {
    const auto is = [&](std::uint32_t a, std::uint32_t b) { return from == a && to == b; };
    return is(RMP_TYPE_INT, RMP_TYPE_REAL) || is(RMP_TYPE_INT, RMP_TYPE_CHAR) ||
           is(RMP_TYPE_CHAR, RMP_TYPE_INT) || is(RMP_TYPE_CHAR, RMP_TYPE_STRING) ||
           (from != to && fits(from, to));
  }
  bool attribute(const O& a, const O& b) const {
    if (b.kind != RMP_OPERAND_WORD || !value(a)) return false;
    switch (b.index) {
      case RMP_ATTR_C_PASS:
      case RMP_ATTR_WOBBLE: return a.type == RMP_TYPE_BOOL;
      case RMP_ATTR_ACT_ROB: return role(a) == RMP_ROLE_ROBOT;
      case RMP_ATTR_DEVICE:
      case RMP_ATTR_ADAX_CONTROL: return a.type == RMP_TYPE_INT;
      case RMP_ATTR_TOOL:
      case RMP_ATTR_FRAME: return role(a) == RMP_ROLE_POSE;
      default: return a.type == RMP_TYPE_REAL;
    }
  }
  const char* one(const rmp_code_instruction& i) {
    const O &a = i.a, &b = i.b, &r = i.r;
    const auto must = [](bool is_right, const char* what) { return is_right ? nullptr : what; };
    const bool only_a = none(b) && none(r);
    const bool number_in = value(a) && (a.type == RMP_TYPE_INT || a.type == RMP_TYPE_REAL);
    switch (i.op) {
      case RMP_OP_COPY: {
        // The count of a semaphore is written as an INT.
        const bool is_count = a.kind == RMP_OPERAND_CONSTANT && a.type == RMP_TYPE_INT &&
                              r.type == RMP_TYPE_SEMAPHORE;
        return must(value(a) && none(b) && result(r) && (is_count || fits(a.type, r.type)),
                    "COPY has a value, and a variable or temporary of its type");
      }
      case RMP_OP_CONVERT:
        return must(value(a) && none(b) && result(r) && converts(a.type, r.type),
                    "CONVERT has a value, and a variable or temporary of a type that it becomes");
      case RMP_OP_NEGATE:
        return must(number_in && none(b) && result(r) && r.type == a.type,
                    "NEGATE has an INT or REAL, and its result");
      case RMP_OP_NOT:
        return must(value(a, RMP_TYPE_BOOL) && none(b) && result(r) && r.type == RMP_TYPE_BOOL,
                    "NOT has a BOOL, and its result");
      case RMP_OP_ADD:
      case RMP_OP_SUBTRACT:
      case RMP_OP_MULTIPLY:
        return must(number_in && value(b, a.type) && result(r) && r.type == a.type,
                    "this has two numbers of one type, and their result");
      case RMP_OP_DIVIDE:
        return must(value(a, RMP_TYPE_REAL) && value(b, RMP_TYPE_REAL) && result(r) &&
                        r.type == RMP_TYPE_REAL,
                    "DIVIDE has two REAL, and their result");
      case RMP_OP_DIV:
      case RMP_OP_MOD:
        return must(
            value(a, RMP_TYPE_INT) && value(b, RMP_TYPE_INT) && result(r) && r.type == RMP_TYPE_INT,
            "this has two INT, and their result");
      case RMP_OP_EQUAL:
      case RMP_OP_NOT_EQUAL:
      case RMP_OP_LESS:
      case RMP_OP_LESS_EQUAL:
      case RMP_OP_GREATER:
      case RMP_OP_GREATER_EQUAL:
        return must(value(a) && value(b, a.type) && a.type >= RMP_TYPE_INT &&
                        a.type <= RMP_TYPE_STRING && result(r) && r.type == RMP_TYPE_BOOL,
                    "this compares two values of one basic type, and its result is BOOL");
      case RMP_OP_EXOR:
        return must(value(a, RMP_TYPE_BOOL) && value(b, RMP_TYPE_BOOL) && result(r) &&
                        r.type == RMP_TYPE_BOOL,
                    "EXOR has two BOOL, and their result");
      case RMP_OP_COMPOSE: {
        const auto in = [&](const O& o) {
          return value(o) && role(o) >= RMP_ROLE_POSITION && role(o) <= RMP_ROLE_POSE;
        };
        return must(in(a) && in(b) && role(a) != RMP_ROLE_POSITION && result(r) &&
                        r.type == b.type && (role(b) == RMP_ROLE_POSITION || b.type == a.type),
                    "COMPOSE has a POSE or ORIENTATION, what it moves, and the result");
      }
      case RMP_OP_FIELD:
        return must(
            (value(a) || reference(a)) && kind(a) == RMP_TYPE_RECORD &&
                b.kind == RMP_OPERAND_NUMBER &&
                static_cast<std::uint64_t>(b.index) < type(a.type).field_count && reference(r) &&
                r.type ==
                    p_.fields[type(a.type).first_field + static_cast<std::uint32_t>(b.index)].type,
            "FIELD has a record, the number of a field, and a place of its type");
      case RMP_OP_ELEMENT: {
        const bool is_text = kind(a) == RMP_TYPE_STRING;
        const bool is_many = is_text || kind(a) == RMP_TYPE_ARRAY || kind(a) == RMP_TYPE_LIST;
        return must((value(a) || reference(a)) && is_many && value(b, RMP_TYPE_INT) &&
                        reference(r) &&
                        r.type == (is_text ? std::uint32_t{RMP_TYPE_CHAR} : type(a.type).element),
                    "ELEMENT has an array, list or string, an INT, and a place of an element's "
                    "type");
      }
      case RMP_OP_LOAD:
        return must(reference(a) && none(b) && result(r) && r.type == a.type,
                    "LOAD has a place, and a variable or temporary of its type");
      case RMP_OP_STORE:
        return must(value(a) && none(b) && reference(r) && fits(a.type, r.type),
                    "STORE has a value, and a place of its type");
      case RMP_OP_ARGUMENT:
        return must((value(a) || routine(a, RMP_ROUTINE_PROCESS, RMP_ROUTINE_PROCESS)) && only_a,
                    "ARGUMENT has a value");
      case RMP_OP_ARGUMENT_PLACE:
        return must(place(a) && only_a, "ARGUMENT_PLACE has a place that may be written to");
      case RMP_OP_CALL: return call(i);
      case RMP_OP_INTRINSIC:
        return must(a.kind == RMP_OPERAND_INTRINSIC && b.kind == RMP_OPERAND_NUMBER &&
                        static_cast<std::uint64_t>(b.index) == arguments_.size() &&
                        (none(r) || result(r)),
                    "INTRINSIC has a name, the number of its arguments, and its result");
      case RMP_OP_MAKE: return make(i);
      case RMP_OP_LABEL:
      case RMP_OP_JUMP: return must(none(a) && none(b) && label(r), "this has a label alone");
      case RMP_OP_JUMP_IF:
      case RMP_OP_JUMP_UNLESS:
      case RMP_OP_WAIT_TEST:
        return must(value(a, RMP_TYPE_BOOL) && none(b) && label(r), "this has a BOOL and a label");
      case RMP_OP_RETURN: {
        const std::uint32_t wanted = p_.routines[routine_].result;
        return must(
            only_a && (wanted == RMP_TYPE_VOID ? none(a) : value(a) && fits(a.type, wanted)),
            "RETURN has a value of a function's type, and none elsewhere");
      }
      case RMP_OP_WAIT_TIME: return must(value(a, RMP_TYPE_REAL) && only_a, "WAIT_TIME has a REAL");
      case RMP_OP_WAIT_BEGIN:
        return must((none(a) || value(a, RMP_TYPE_REAL)) && only_a,
                    "WAIT_BEGIN has a REAL or nothing");
      case RMP_OP_PAUSE:
        return must((none(a) || value(a, RMP_TYPE_STRING)) && only_a,
                    "PAUSE has a STRING or nothing");
      case RMP_OP_HALT: return must(none(a) && only_a, "HALT has nothing");
      case RMP_OP_TARGET:
        ++targets_;
        return must(value(a) && only_a && role(a) != RMP_ROLE_NONE && role(a) != RMP_ROLE_ROBOT &&
                        role(a) != RMP_ROLE_ORIENTATION,
                    "TARGET has a place or joints");
      case RMP_OP_ATTRIBUTE:
        return must(attribute(a, b) && none(r), "ATTRIBUTE has a value of its type, and its name");
      case RMP_OP_UNTIL:
        return must(
            (none(a) || (routine(a, RMP_ROUTINE_PROCEDURE, RMP_ROUTINE_PROCEDURE) &&
                         p_.routines[static_cast<std::size_t>(a.index)].parameter_count == 0)) &&
                none(b) && label(r),
            "UNTIL has a procedure without parameters or nothing, and a label");
      case RMP_OP_UNTIL_TEST:
      case RMP_OP_INTERRUPT_TEST: return must(value(a, RMP_TYPE_BOOL) && only_a, "this has a BOOL");
      case RMP_OP_MOVE: {
        const std::uint32_t given = std::exchange(targets_, 0);
        return must(a.kind == RMP_OPERAND_WORD && b.kind == RMP_OPERAND_NUMBER && b.index <= 1 &&
                        none(r) && given > 0 && (a.index != RMP_MOVE_CIRCLE || given == 2),
                    "MOVE has an interpolation, #0 or #1, and its targets before it");
      }
      case RMP_OP_START:
        return must(routine(a, RMP_ROUTINE_PROCESS, RMP_ROUTINE_PROCESS) &&
                        (none(b) || value(b, RMP_TYPE_INT)) && none(r),
                    "START has a process, and its priority or nothing");
      case RMP_OP_STOP:
      case RMP_OP_CONTINUE:
      case RMP_OP_CANCEL:
        return must(routine(a, RMP_ROUTINE_PROCESS, RMP_ROUTINE_PROCESS) && only_a,
                    "this has a process");
      case RMP_OP_ENABLE:
        return must(routine(a, RMP_ROUTINE_INTERRUPT, RMP_ROUTINE_INTERRUPT) &&
                        (none(b) || value(b, RMP_TYPE_INT)) && none(r),
                    "ENABLE has an interrupt, and its priority or nothing");
      case RMP_OP_DISABLE:
        return must(routine(a, RMP_ROUTINE_INTERRUPT, RMP_ROUTINE_INTERRUPT) && only_a,
                    "DISABLE has an interrupt");
      case RMP_OP_TEACH:
        return must(a.kind == RMP_OPERAND_VARIABLE && result(a) && only_a, "TEACH has a variable");
      default: return "there is no such instruction";
    }
  }

  const ProgramTables& p_;
  std::uint32_t routine_ = RMP_NONE;
  std::map<std::int64_t, std::pair<std::uint32_t, std::uint32_t>> set_;  ///< kind and type
  std::vector<rmp_code_instruction> arguments_;
  std::uint32_t targets_ = 0;
};

class Reader {
 public:
  Result<std::unique_ptr<ProgramTables>> read(std::string_view text) {
    for (std::uint32_t t = 0; t <= RMP_TYPE_PROCESS; ++t) {
      p_->types.push_back({t, 0, "", RMP_NONE, 0, 0, 0, 0, {}});
      slots_.push_back(1);
    }
    bool is_first = true;
    while (!text.empty()) {
      const std::size_t end = text.find('\n');
      std::string_view line = text.substr(0, end);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      ++line_;
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      if (std::exchange(is_first, false)) {
        if (line != "robomosp code 1")
          return fail("it does not begin with \"robomosp code 1\"",
                      "Another version needs a newer program.");
        continue;
      }
      if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
      std::string_view f[4];
      if (!split(line, f))
        return fail("a line has four fields, separated by blanks", "An empty field is \"-\".");
      RMP_TRY(one(f));
    }
    if (is_first) return fail("it is empty", "A file of code begins with \"robomosp code 1\".");
    if (in_routine_) return fail("the last routine has no END");
    if (p_->routines.empty()) return fail("it has no routine", "Routine 0 is the program.");
    for (const auto& [line, r] : routines_used_)
      if (r >= p_->routines.size())
        return fail("there is no routine r" + std::to_string(r), {}, line);
    for (const rmp_code_type& t : p_->types)
      if (t.kind == RMP_TYPE_RECORD && (t.field_count == 0 || !has_shape(t)))
        return fail("the record " + quoted(t.name) + " has no fields, or not those of its role #" +
                    std::to_string(t.role));
    if (p_->routines[0].kind != RMP_ROUTINE_PROGRAM)
      return fail("routine r0 is not of the kind #0", "Routine 0 is the program.");
    Strict strict(*p_);
    for (std::uint32_t r = 0; r < p_->routines.size(); ++r) {
      const rmp_code_routine& x = p_->routines[r];
      std::uint32_t line = 0;
      for (std::uint32_t k = 0; k < x.instruction_count; ++k) {
        line = lines_[x.first_instruction + k];
        if (const char* wrong = strict.fault(r, p_->instructions[x.first_instruction + k]))
          return fail(wrong, {}, line);
      }
      if (x.instruction_count == 0) continue;
      if (const char* wrong = strict.fault_at_end()) return fail(wrong, {}, line);
    }
    for (const rmp_code_symbol& s : names_) {
      p_->routines[s.routine].symbol = static_cast<std::uint32_t>(p_->symbols.size());
      p_->symbols.push_back(s);
    }
    for (std::uint32_t t = 0; t < p_->types.size(); ++t)
      if (p_->types[t].element != RMP_NONE && p_->types[t].element >= t)
        return fail("type " + type_text(t) + " is made of a later type");
    p_->seal();
    return std::move(p_);
  }

 private:
  static constexpr std::uint32_t kMost = 50'000'000;
  static constexpr std::uint64_t kMostSlots = 16'000'000;  ///< values that a type holds
  [[nodiscard]] Error fail(std::string message, std::string hint = {},
                           std::uint32_t line = 0) const {
    return error(ErrorCode::syntax, std::move(message), std::move(hint),
                 "line " + std::to_string(line ? line : line_) + " of three-address code");
  }
  /// Whether a record has the fields that motions look for.
  [[nodiscard]] bool has_shape(const rmp_code_type& t) const {
    const auto field = [&](std::uint32_t k) -> const rmp_code_type& {
      return p_->types[p_->fields[t.first_field + k].type];
    };
    const auto reals = [&](std::uint32_t count) {
      for (std::uint32_t k = 0; k < t.field_count; ++k)
        if (field(k).kind != RMP_TYPE_REAL) return false;
      return count == 0 || t.field_count == count;
    };
    switch (t.role) {
      case RMP_ROLE_POSITION: return reals(3);
      case RMP_ROLE_ORIENTATION: return reals(4);
      case RMP_ROLE_POSE:
        return t.field_count == 2 && field(0).role == RMP_ROLE_POSITION &&
               field(1).role == RMP_ROLE_ORIENTATION;
      case RMP_ROLE_MAIN_JOINT:
      case RMP_ROLE_ADD_JOINT: return reals(0);
      case RMP_ROLE_JOINT:
        return t.field_count == 2 && field(0).role == RMP_ROLE_MAIN_JOINT &&
               field(1).role == RMP_ROLE_ADD_JOINT;
      case RMP_ROLE_ROBTARGET:
        return t.field_count == 4 && field(0).role == RMP_ROLE_POSE &&
               field(1).kind == RMP_TYPE_INT && field(2).kind == RMP_TYPE_ARRAY &&
               field(2).element == RMP_TYPE_INT && field(3).role == RMP_ROLE_ADD_JOINT;
      default: return true;
    }
  }
  Result<std::uint32_t> index(std::string_view f, char prefix) const {
    std::uint32_t n = 0;
    if (f.empty() || f[0] != prefix || !number(f.substr(1), n) || n > kMost)
      return fail("\"" + std::string(f) + "\" is where a number after \"" + std::string(1, prefix) +
                  "\" belongs");
    return n;
  }
  Result<std::uint32_t> type(std::string_view f) const {
    RMP_TRY_ASSIGN(const std::uint32_t t, index(f, 'T'));
    if (t < p_->types.size()) return t;
    return fail("there is no type " + std::string(f) + " above");
  }
  Result<std::string> name(std::string_view f) const {
    if (f.size() >= 2 && f[0] == '\'') return unquoted(f);
    return fail("\"" + std::string(f) + "\" is where a quoted name is expected");
  }
  Result<void> one(std::string_view (&f)[4]) {
    if (in_routine_) return inside(f);
    if (!p_->routines.empty() && f[0] != "ROUTINE")
      return fail("declarations must come before the first routine");
    if (f[0] == "PROGRAM") {
      RMP_TRY_ASSIGN(const std::string n, name(f[1]));
      p_->set_name(n);
      return {};
    }
    if (f[0] == "FILE") {
      RMP_TRY_ASSIGN(const std::string n, name(f[1]));
      p_->files.push_back({p_->keep(n)});
      return {};
    }
    if (f[0] == "ARRAY" || f[0] == "LIST") {
      rmp_code_type t{};
      t.kind = f[0] == "LIST" ? RMP_TYPE_LIST : RMP_TYPE_ARRAY;
      RMP_TRY_ASSIGN(t.element, type(f[2]));
      RMP_TRY_ASSIGN(const std::string n, name(f[3]));
      t.name = p_->keep(n);
      const std::size_t dots = f[1].find("..");
      if (t.kind == RMP_TYPE_ARRAY &&
          (dots == std::string_view::npos || !number(f[1].substr(0, dots), t.lower) ||
           !number(f[1].substr(dots + 2), t.upper) || t.upper < t.lower))
        return fail("\"" + std::string(f[1]) + "\" are not valid array bounds", "Such as 1..3.");
      const std::uint64_t length =
          t.kind == RMP_TYPE_ARRAY ? static_cast<std::uint64_t>(std::int64_t{t.upper} - t.lower + 1)
                                   : 1;
      const std::uint64_t inner = t.kind == RMP_TYPE_ARRAY ? slots_[t.element] : 1;
      if (length > kMostSlots || length * inner > kMostSlots)
        return fail("a type holds more than " + std::to_string(kMostSlots) + " values");
      slots_.push_back(length * inner);
      p_->types.push_back(t);
      return {};
    }
    if (f[0] == "RECORD") {
      rmp_code_type t{};
      t.kind = RMP_TYPE_RECORD;
      t.element = RMP_NONE;
      RMP_TRY_ASSIGN(t.role, index(f[1], '#'));
      if (t.role > RMP_ROLE_ROBOT) return fail("there is no such role of a record");
      RMP_TRY_ASSIGN(const std::string n, name(f[3]));
      t.name = p_->keep(n);
      t.first_field = static_cast<std::uint32_t>(p_->fields.size());
      slots_.push_back(0);
      p_->types.push_back(t);
      return {};
    }
    if (f[0] == "MEMBER") {
      if (p_->types.back().kind != RMP_TYPE_RECORD) return fail("a MEMBER must follow its RECORD");
      RMP_TRY_ASSIGN(const std::uint32_t t, type(f[2]));
      if (t + 1 >= p_->types.size()) return fail("a record cannot contain itself");
      RMP_TRY_ASSIGN(const std::string n, name(f[3]));
      p_->fields.push_back({p_->keep(n), t, {}});
      ++p_->types.back().field_count;
      slots_.back() += slots_[t];
      if (slots_.back() > kMostSlots)
        return fail("a type holds more than " + std::to_string(kMostSlots) + " values");
      return {};
    }
    if (f[0] == "ROUTINE") return routine(f);
    if (f[0] == "AT") {
      if (last_symbol_ == RMP_NONE) return fail("AT must follow its INPUT or OUTPUT");
      std::int32_t address = 0, width = 0;
      if (f[1].empty() || f[1][0] != '#' || !number(f[1].substr(1), address) || f[2].empty() ||
          f[2][0] != '#' || !number(f[2].substr(1), width))
        return fail("AT needs a number and a width", "Such as: AT #3 #1 -");
      const rmp_code_symbol& signal = p_->symbols[last_symbol_];
      if (signal.kind != RMP_SYMBOL_INPUT && signal.kind != RMP_SYMBOL_OUTPUT)
        return fail("AT must follow its INPUT or OUTPUT");
      constexpr std::int32_t kWidest = 64;
      if (address < 0 || width < 1 || width > kWidest ||
          (signal.type == RMP_TYPE_BOOL && width != 1))
        return fail("a signal has a number from 0, and a width from 1 to 64, which is 1 for BOOL");
      p_->symbols[last_symbol_].address = address;
      p_->symbols[last_symbol_].width = width;
      return {};
    }
    if (f[0] == "OF") {
      if (last_symbol_ == RMP_NONE) return fail("OF must follow its VARIABLE");
      RMP_TRY_ASSIGN(const std::uint32_t r, index(f[1], 'r'));
      p_->symbols[last_symbol_].routine = r;
      routines_used_.emplace(line_, r);
      return {};
    }
    for (std::uint32_t k = 0; k < std::size(kSymbols); ++k)
      if (f[0] == kSymbols[k]) return symbol(k, 0, f);
    if (f[0] == "PARAMETER_OUT") return symbol(RMP_SYMBOL_PARAMETER, RMP_MODE_OUT, f);
    if (f[0] == "PARAMETER_INOUT") return symbol(RMP_SYMBOL_PARAMETER, RMP_MODE_INOUT, f);
    return fail("\"" + std::string(f[0]) + "\" is not allowed outside a routine",
                "Instructions belong between ROUTINE and END.");
  }
  Result<void> symbol(std::uint32_t kind, std::uint32_t mode, const std::string_view (&f)[4]) {
    RMP_TRY_ASSIGN(const std::uint32_t at, index(f[1], 'v'));
    // Numbers of what is not used are left out; a gap of millions is none of a compiler's.
    if (at > p_->symbols.size() + 1'000'000)
      return fail("the number of " + std::string(f[1]) + " is too great");
    RMP_TRY_ASSIGN(const std::uint32_t t, type(f[2]));
    RMP_TRY_ASSIGN(const std::string n, name(f[3]));
    rmp_code_symbol s{};
    s.kind = kind;
    s.mode = mode;
    s.name = p_->keep(n);
    s.type = t;
    s.scope = RMP_NONE;
    s.routine = RMP_NONE;
    s.value = s.constant = RMP_NONE;
    if (t == RMP_TYPE_VOID || t == RMP_TYPE_PROCESS)
      return fail(std::string(f[1]) + " is of a type that holds no value");
    if ((kind == RMP_SYMBOL_INPUT || kind == RMP_SYMBOL_OUTPUT) && t != RMP_TYPE_BOOL &&
        t != RMP_TYPE_INT && t != RMP_TYPE_REAL)
      return fail("a signal is BOOL, INT or REAL");
    if (!declared_.insert(at).second) return fail(std::string(f[1]) + " appears twice");
    rmp_code_symbol gap = s;
    gap.kind = RMP_SYMBOL_IMPORT;
    gap.name = "";
    while (p_->symbols.size() <= at) p_->symbols.push_back(gap);
    p_->symbols[at] = s;
    last_symbol_ = at;
    return {};
  }
  Result<void> routine(const std::string_view (&f)[4]) {
    RMP_TRY_ASSIGN(const std::uint32_t r, index(f[1], 'r'));
    if (r != p_->routines.size()) return fail("routines are numbered from r0, one by one");
    RMP_TRY_ASSIGN(const std::uint32_t kind, index(f[2], '#'));
    if (kind > RMP_ROUTINE_DATA_LIST) return fail("there is no such kind of routine");
    RMP_TRY_ASSIGN(const std::string n, name(f[3]));
    rmp_code_routine x{};
    x.kind = kind;
    x.scope = x.body = x.priority = x.condition = RMP_NONE;
    x.first_instruction = static_cast<std::uint32_t>(p_->instructions.size());
    // Its name is a separate symbol, behind those that have numbers in the text.
    rmp_code_symbol s{};
    s.kind = RMP_SYMBOL_ROUTINE;
    s.name = p_->keep(n);
    s.scope = s.value = s.constant = RMP_NONE;
    s.routine = r;
    names_.push_back(s);
    p_->routines.push_back(x);
    in_routine_ = true;
    labels_set_.clear();
    labels_used_.clear();
    return {};
  }
  Result<void> inside(const std::string_view (&f)[4]) {
    rmp_code_routine& r = p_->routines.back();
    if (f[0] == "PARAMETERS") {
      RMP_TRY_ASSIGN(r.parameter_count, index(f[2], '#'));
      RMP_TRY_ASSIGN(r.result, type(f[3]));
      if (r.parameter_count > 0) {
        RMP_TRY_ASSIGN(r.first_parameter, index(f[1], 'v'));
        for (std::uint32_t k = 0; k < r.parameter_count; ++k)
          if (!declared_.contains(r.first_parameter + k) ||
              p_->symbols[r.first_parameter + k].kind != RMP_SYMBOL_PARAMETER)
            return fail("v" + std::to_string(r.first_parameter + k) + " is no parameter");
        for (std::uint32_t k = 0; k < r.parameter_count; ++k)
          p_->symbols[r.first_parameter + k].routine =
              static_cast<std::uint32_t>(p_->routines.size() - 1);
      }
      return {};
    }
    if (f[0] == "LINE") {
      RMP_TRY_ASSIGN(span_.file, index(f[1], '#'));
      RMP_TRY_ASSIGN(span_.line, index(f[2], '#'));
      RMP_TRY_ASSIGN(span_.column, index(f[3], '#'));
      if (span_.file >= p_->files.size()) return fail("there is no such file above");
      return {};
    }
    if (f[0] == "END") {
      for (const std::uint32_t l : labels_used_)
        if (!labels_set_.contains(l))
          return fail("label L" + std::to_string(l) + " does not exist");
      r.instruction_count =
          static_cast<std::uint32_t>(p_->instructions.size()) - r.first_instruction;
      in_routine_ = false;
      span_ = {};
      return {};
    }
    for (std::uint32_t op = 0; op < std::size(kOps); ++op) {
      if (f[0] != kOps[op]) continue;
      rmp_code_instruction i{};
      i.op = op;
      i.span = span_;
      RMP_TRY_ASSIGN(i.a, operand(f[1], op));
      RMP_TRY_ASSIGN(i.b, operand(f[2], op));
      RMP_TRY_ASSIGN(i.r, operand(f[3], op));
      if (op == RMP_OP_LABEL && (i.r.kind != RMP_OPERAND_LABEL ||
                                 !labels_set_.insert(static_cast<std::uint32_t>(i.r.index)).second))
        return fail("a label is set once, such as: LABEL - - L2");
      p_->instructions.push_back(i);
      lines_.push_back(line_);
      return {};
    }
    return fail("there is no instruction \"" + std::string(f[0]) + "\"");
  }
  Result<rmp_code_operand> operand(std::string_view f, std::uint32_t op) {
    rmp_code_routine& r = p_->routines.back();
    const auto constant = [&](std::uint32_t c) {
      return rmp_code_operand{RMP_OPERAND_CONSTANT, p_->constants[c].type, c};
    };
    if (f == "-") return rmp_code_operand{};
    if (f[0] == '\'') return constant(p_->text(unquoted(f)));
    if (f == "TRUE" || f == "FALSE") return constant(p_->integer(f == "TRUE", RMP_TYPE_BOOL));
    for (std::uint32_t k = 0; op == RMP_OP_MOVE && k < std::size(kMoves); ++k)
      if (f == kMoves[k]) return rmp_code_operand{RMP_OPERAND_WORD, 0, k};
    for (std::uint32_t k = 0; op == RMP_OP_ATTRIBUTE && k < std::size(kAttributes); ++k)
      if (f == kAttributes[k]) return rmp_code_operand{RMP_OPERAND_WORD, 0, k};
    const bool is_number = (f[0] >= '0' && f[0] <= '9') || (f[0] == '-' && f.size() > 1);
    if (is_number) {
      std::int32_t whole = 0;
      double real = 0;
      if (number(f, whole)) return constant(p_->integer(whole));
      if (number(f, real) && std::isfinite(real)) return constant(p_->real(real));
      return fail("\"" + std::string(f) + "\" is neither a 32-bit number nor a REAL");
    }
    if (f.size() > 1 && f[1] >= '0' && f[1] <= '9') {
      switch (f[0]) {
        case 'c': {
          RMP_TRY_ASSIGN(const std::uint32_t c, index(f, 'c'));
          if (c > 255) return fail("a CHAR is a number from 0 to 255");
          return constant(p_->integer(c, RMP_TYPE_CHAR));
        }
        case 'v': {
          RMP_TRY_ASSIGN(const std::uint32_t v, index(f, 'v'));
          if (!declared_.contains(v)) return fail("there is no " + std::string(f) + " above");
          return rmp_code_operand{RMP_OPERAND_VARIABLE, p_->symbols[v].type, v};
        }
        case 't':
        case 'p': {
          const std::size_t colon = f.find(':');
          if (colon == std::string_view::npos)
            return fail("\"" + std::string(f) + "\" has no type", "Such as t3:T2.");
          RMP_TRY_ASSIGN(const std::uint32_t t, index(f.substr(0, colon), f[0]));
          RMP_TRY_ASSIGN(const std::uint32_t of, type(f.substr(colon + 1)));
          if (t > 1'000'000) return fail("a routine has at most 1000000 temporaries");
          r.temporary_count = std::max(r.temporary_count, t + 1);
          return rmp_code_operand{static_cast<std::uint32_t>(f[0] == 't' ? RMP_OPERAND_TEMPORARY
                                                                         : RMP_OPERAND_REFERENCE),
                                  of, t};
        }
        case 'L': {
          RMP_TRY_ASSIGN(const std::uint32_t l, index(f, 'L'));
          labels_used_.insert(l);
          r.label_count = std::max(r.label_count, l + 1);
          return rmp_code_operand{RMP_OPERAND_LABEL, 0, l};
        }
        case 'r': {
          RMP_TRY_ASSIGN(const std::uint32_t x, index(f, 'r'));
          routines_used_.emplace(line_, x);
          return rmp_code_operand{RMP_OPERAND_ROUTINE, 0, x};
        }
        case '#': {
          RMP_TRY_ASSIGN(const std::uint32_t x, index(f, '#'));
          return rmp_code_operand{RMP_OPERAND_NUMBER, 0, x};
        }
        default: break;
      }
    }
    if (op == RMP_OP_INTRINSIC && f[0] >= 'A' && f[0] <= 'Z') {
      auto [it, is_new] = intrinsics_.try_emplace(std::string(f), 0);
      if (is_new) {
        // Numbered behind all variables, once those are all known: the declarations come first.
        rmp_code_symbol s{};
        s.kind = RMP_SYMBOL_INTRINSIC;
        s.name = p_->keep(f);
        s.scope = s.routine = s.value = s.constant = RMP_NONE;
        it->second = static_cast<std::uint32_t>(p_->symbols.size());
        p_->symbols.push_back(s);
      }
      return rmp_code_operand{RMP_OPERAND_INTRINSIC, 0, it->second};
    }
    return fail("\"" + std::string(f) + "\" is not a field of an instruction");
  }

  std::unique_ptr<ProgramTables> p_ = std::make_unique<ProgramTables>();
  std::uint32_t line_ = 0;
  bool in_routine_ = false;
  rmp_span span_{};
  std::uint32_t last_symbol_ = RMP_NONE;
  std::set<std::uint32_t> declared_, labels_set_, labels_used_;
  std::set<std::pair<std::uint32_t, std::uint32_t>> routines_used_;  ///< with their line
  std::map<std::string, std::uint32_t, std::less<>> intrinsics_;
  std::vector<rmp_code_symbol> names_;
  std::vector<std::uint32_t> lines_;  ///< by instruction
  std::vector<std::uint64_t> slots_;  ///< values, by type
};

}  // namespace code_text_detail

/// The text form of a program's three-address code, for files: equal code gives equal text, and
/// read_code_text() gives the code again.
[[nodiscard]] inline std::string code_text(const rmp_code& code) {
  using namespace code_text_detail;
  std::string out = "robomosp code 1\nPROGRAM " + quoted(code.name) + " - -\n";
  for (std::uint32_t i = 0; i < code.files.count; ++i)
    out += "FILE " + quoted(row<rmp_code_file>(code.files, i).name) + " - -\n";
  for (std::uint32_t i = RMP_TYPE_PROCESS + 1; i < code.types.count; ++i) {
    const auto& t = row<rmp_code_type>(code.types, i);
    if (t.kind == RMP_TYPE_ARRAY)
      out += "ARRAY " + std::to_string(t.lower) + ".." + std::to_string(t.upper) + " " +
             type_text(t.element) + " " + quoted(t.name) + "\n";
    else if (t.kind == RMP_TYPE_LIST)
      out += "LIST - " + type_text(t.element) + " " + quoted(t.name) + "\n";
    else out += "RECORD #" + std::to_string(t.role) + " - " + quoted(t.name) + "\n";
    for (std::uint32_t k = 0; t.kind == RMP_TYPE_RECORD && k < t.field_count; ++k) {
      const auto& f = row<rmp_code_field>(code.fields, t.first_field + k);
      out += "MEMBER - " + type_text(f.type) + " " + quoted(f.name) + "\n";
    }
  }
  std::set<std::int64_t> used;
  for (std::uint32_t i = 0; i < code.instructions.count; ++i) {
    const auto& x = row<rmp_code_instruction>(code.instructions, i);
    for (const rmp_code_operand* o : {&x.a, &x.b, &x.r})
      if (o->kind == RMP_OPERAND_VARIABLE) used.insert(o->index);
  }
  for (std::uint32_t i = 0; i < code.routines.count; ++i) {
    const auto& r = row<rmp_code_routine>(code.routines, i);
    for (std::uint32_t k = 0; k < r.parameter_count; ++k) used.insert(r.first_parameter + k);
  }
  for (const std::int64_t v : used) {
    const auto& s = row<rmp_code_symbol>(code.symbols, static_cast<std::uint32_t>(v));
    std::string word(kSymbols[s.kind < std::size(kSymbols) ? s.kind : 1]);
    if (s.kind == RMP_SYMBOL_PARAMETER && s.mode != RMP_MODE_IN)
      word += s.mode == RMP_MODE_OUT ? "_OUT" : "_INOUT";
    out += word + " v" + std::to_string(v) + " " + type_text(s.type) + " " + quoted(s.name) + "\n";
    if (s.kind == RMP_SYMBOL_INPUT || s.kind == RMP_SYMBOL_OUTPUT)
      out += "AT #" + std::to_string(s.address) + " #" + std::to_string(s.width) + " -\n";
    else if (s.routine != RMP_NONE && s.kind != RMP_SYMBOL_PARAMETER)
      out += "OF r" + std::to_string(s.routine) + " - -\n";
  }
  for (std::uint32_t i = 0; i < code.routines.count; ++i) {
    const auto& r = row<rmp_code_routine>(code.routines, i);
    const auto& s = row<rmp_code_symbol>(code.symbols, r.symbol);
    out += "ROUTINE r" + std::to_string(i) + " #" + std::to_string(r.kind) + " " + quoted(s.name) +
           "\n";
    out += "PARAMETERS " +
           (r.parameter_count ? "v" + std::to_string(r.first_parameter) : std::string("-")) + " #" +
           std::to_string(r.parameter_count) + " " + type_text(r.result) + "\n";
    rmp_span at{};
    for (std::uint32_t k = 0; k < r.instruction_count; ++k) {
      const auto& x = row<rmp_code_instruction>(code.instructions, r.first_instruction + k);
      if (x.span.file != at.file || x.span.line != at.line || x.span.column != at.column) {
        at = x.span;
        out += "LINE #" + std::to_string(at.file) + " #" + std::to_string(at.line) + " #" +
               std::to_string(at.column) + "\n";
      }
      out += std::string(kOps[x.op]) + " " + operand_text(code, x.a, x.op) + " " +
             operand_text(code, x.b, x.op) + " " + operand_text(code, x.r, x.op) + "\n";
    }
    out += "END - - -\n";
  }
  return out;
}

/// Three-address code from its text form. What a reader of the tables relies on holds: numbers are
/// of existing rows, and labels are set once. Errors name the line.
[[nodiscard]] inline Result<std::unique_ptr<ProgramTables>> read_code_text(std::string_view text) {
  return code_text_detail::Reader().read(text);
}

}  // namespace robomosp
