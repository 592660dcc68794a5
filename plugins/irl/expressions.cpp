// SPDX-License-Identifier: Apache-2.0
// Expressions: types, conversions, constants.
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "checker.h"

namespace robomosp::irl {
namespace {

using Id = std::uint32_t;
constexpr std::int64_t kMostInt = std::numeric_limits<std::int32_t>::max();

bool is_number(Id t) { return t == RMP_TYPE_INT || t == RMP_TYPE_REAL; }
bool is_basic(Id t) { return t <= RMP_TYPE_PROCESS; }
double value_of(const rmp_code_constant& c) {
  return c.kind == RMP_CONSTANT_REAL ? c.real : static_cast<double>(c.integer);
}
std::uint32_t op_of(Tok t) {
  switch (t) {
    case Tok::plus: return RMP_EXPR_ADD;
    case Tok::minus: return RMP_EXPR_SUBTRACT;
    case Tok::star: return RMP_EXPR_MULTIPLY;
    case Tok::slash: return RMP_EXPR_DIVIDE;
    case Tok::k_div: return RMP_EXPR_DIV;
    case Tok::k_mod: return RMP_EXPR_MOD;
    case Tok::equal: return RMP_EXPR_EQUAL;
    case Tok::not_equal: return RMP_EXPR_NOT_EQUAL;
    case Tok::less: return RMP_EXPR_LESS;
    case Tok::less_equal: return RMP_EXPR_LESS_EQUAL;
    case Tok::greater: return RMP_EXPR_GREATER;
    case Tok::greater_equal: return RMP_EXPR_GREATER_EQUAL;
    case Tok::k_and: return RMP_EXPR_AND;
    case Tok::k_or: return RMP_EXPR_OR;
    case Tok::k_exor: return RMP_EXPR_EXOR;
    default: return RMP_EXPR_COMPOSE;
  }
}

}  // namespace

Id Checker::add(std::uint32_t op, Id type, const rmp_span& span, std::initializer_list<Id> operands,
                Id symbol, Id constant) {
  rmp_code_expression e{};
  e.op = op;
  e.type = type;
  e.symbol = symbol;
  e.constant = constant;
  e.first = static_cast<Id>(out_.links.size());
  e.count = static_cast<Id>(operands.size());
  e.span = span;
  out_.links.insert(out_.links.end(), operands.begin(), operands.end());
  out_.expressions.push_back(e);
  return static_cast<Id>(out_.expressions.size() - 1);
}
Id Checker::add_with(std::uint32_t op, Id type, const rmp_span& span,
                     const std::vector<Id>& operands, Id symbol) {
  const Id e = add(op, type, span, {}, symbol);
  out_.expressions[e].count = static_cast<Id>(operands.size());
  out_.links.insert(out_.links.end(), operands.begin(), operands.end());
  return e;
}
Id Checker::literal(Id constant, const rmp_span& span) {
  return add(RMP_EXPR_LITERAL, out_.constants[constant].type, span, {}, kNone, constant);
}
Id Checker::bad(const Node& n) { return add(RMP_EXPR_LITERAL, kBad, span(n), {}); }
const rmp_code_constant* Checker::known(Id e) const {
  const Id c = out_.expressions[e].constant;
  return c == kNone ? nullptr : &out_.constants[c];
}

std::string Checker::shown(Id t) const {
  static constexpr const char* kBasic[] = {"nothing", "INT",  "REAL", "CHAR",      "BOOL",
                                           "STRING",  "TEXT", "FILE", "SEMAPHORE", "process"};
  if (t == kBad) return "?";
  if (is_basic(t)) return kBasic[t];
  const rmp_code_type& x = out_.types[t];
  if (*x.name) return x.name;
  if (x.kind == RMP_TYPE_LIST) return "LIST OF " + shown(x.element);
  if (x.kind == RMP_TYPE_ARRAY)
    return "ARRAY [" + std::to_string(x.lower) + ".." + std::to_string(x.upper) + "] OF " +
           shown(x.element);
  return "RECORD";
}

bool Checker::converts(Id from, Id to) const {
  if (from == to || from == kBad || to == kBad) return true;
  if (from == RMP_TYPE_INT && to == RMP_TYPE_REAL) return true;
  if ((from == RMP_TYPE_INT && to == RMP_TYPE_CHAR) ||
      (from == RMP_TYPE_CHAR && (to == RMP_TYPE_INT || to == RMP_TYPE_STRING)))
    return true;
  if (is_basic(from) || is_basic(to)) return false;
  const rmp_code_type &a = out_.types[from], &b = out_.types[to];
  // Arrays of one length and one type of element are the same to whoever copies them.
  return a.kind == RMP_TYPE_ARRAY && b.kind == RMP_TYPE_ARRAY && a.element == b.element &&
         std::int64_t{a.upper} - a.lower == std::int64_t{b.upper} - b.lower;
}

Id Checker::convert(Id e, Id to, const Node& where, const std::string& what) {
  const Id from = type_of(e);
  if (from == to || from == kBad || to == kBad) return e;
  const rmp_code_constant* c = known(e);
  const rmp_span at_span = out_.expressions[e].span;
  if (from == RMP_TYPE_STRING && to == RMP_TYPE_CHAR && c) {
    if (c->text_size == 1)
      return literal(out_.integer(static_cast<unsigned char>(c->text[0]), RMP_TYPE_CHAR), at_span);
    fail(where, what + " needs one character, but this string has " + std::to_string(c->text_size));
    return bad(where);
  }
  if (!converts(from, to)) {
    std::string hint;
    if (from == RMP_TYPE_REAL && to == RMP_TYPE_INT)
      hint = "Use ROUND or TRUNC to make it a whole number.";
    else if (to == RMP_TYPE_BOOL && is_number(from)) hint = "Compare it: value <> 0";
    else if (from == RMP_TYPE_BOOL && is_number(to)) hint = "TRUE and FALSE are not numbers.";
    // A program may declare a record of the same name.
    fail(where,
         what + " needs " + shown(to) + ", but this is " +
             (shown(from) == shown(to) ? "a record of the same name from another declaration"
                                       : shown(from)),
         hint);
    return bad(where);
  }
  if (c && to == RMP_TYPE_REAL) return literal(out_.real(static_cast<double>(c->integer)), at_span);
  if (c && from == RMP_TYPE_INT && to == RMP_TYPE_CHAR) {
    if (c->integer >= 0 && c->integer <= 255)
      return literal(out_.integer(c->integer, RMP_TYPE_CHAR), at_span);
    fail(where,
         "the code of a CHAR must be from 0 to 255, but this is " + std::to_string(c->integer));
    return bad(where);
  }
  if (c && from == RMP_TYPE_CHAR && to == RMP_TYPE_INT)
    return literal(out_.integer(c->integer), at_span);
  if (c && from == RMP_TYPE_CHAR && to == RMP_TYPE_STRING) {
    const char one = static_cast<char>(c->integer);
    if (static_cast<unsigned char>(one) >= ' ')
      return literal(out_.text(std::string_view(&one, 1)), at_span);
  }
  return add(RMP_EXPR_CONVERT, to, at_span, {e});
}

bool Checker::is_pure(Id e) const {
  // Deep trees are bounded by the parser.
  const rmp_code_expression& x = out_.expressions[e];
  if (x.constant != kNone) return true;
  if (x.op == RMP_EXPR_SYMBOL) return out_.symbols[x.symbol].kind == RMP_SYMBOL_CONSTANT;
  if (x.op == RMP_EXPR_CALL) return false;
  if (x.op == RMP_EXPR_INTRINSIC) {
    const std::string_view name = out_.symbols[x.symbol].name;
    if (name == "TRAFO" || name == "TRAFOINV" || name == "EOF" || name == "EOL" ||
        name == "GETSTATUS" || name.substr(0, 2) == "R_")
      return false;
  }
  for (Id k = 0; k < x.count; ++k)
    if (!is_pure(out_.links[x.first + k])) return false;
  return true;
}

/// A type of the language or of the cell, whatever has its name in the program.
Id Checker::named_type(std::string_view name) const {
  const Id n = names_.find(name);
  if (n == kNone) return kBad;
  constexpr Id kPredefinedScope = 0, kCellScope = 1;
  for (const Id scope : {kPredefinedScope, kCellScope}) {
    if (scope >= known_.size()) continue;
    const auto found = known_[scope].find(n);
    if (found != known_[scope].end() && out_.symbols[found->second].kind == RMP_SYMBOL_TYPE)
      return out_.symbols[found->second].type;
  }
  return kBad;
}

Id Checker::zero(Id type, const rmp_span& where) {
  if (type == kBad) return add_with(RMP_EXPR_MAKE, kBad, where, {});  // that has been said
  if (type == RMP_TYPE_REAL) return literal(out_.real(0), where);
  if (type == RMP_TYPE_STRING) return literal(out_.text(""), where);
  if (is_basic(type)) return literal(out_.integer(0, type), where);
  const rmp_code_type t = out_.types[type];
  std::vector<Id> parts;
  if (t.kind == RMP_TYPE_ARRAY)
    for (std::int64_t i = t.lower; i <= t.upper; ++i) parts.push_back(zero(t.element, where));
  for (Id k = 0; t.kind == RMP_TYPE_RECORD && k < t.field_count; ++k)
    parts.push_back(zero(out_.fields[t.first_field + k].type, where));
  return add_with(RMP_EXPR_MAKE, type, where, parts);
}

/// One value where several belong: it is the first, and the others are zero.
Id Checker::first_component(Id value, Id type) {
  const rmp_span where = out_.expressions[value].span;
  std::vector<Id> chain;
  Id t = type;
  while (t != kBad && !is_basic(t) && out_.types[t].kind != RMP_TYPE_LIST) {
    chain.push_back(t);
    t = out_.types[t].kind == RMP_TYPE_ARRAY ? out_.types[t].element
                                             : out_.fields[out_.types[t].first_field].type;
  }
  if (t == kBad || !converts(type_of(value), t) || slots(type) > 64) return kNone;
  Node none;
  Id e = convert(value, t, none, "");
  for (auto it = chain.rbegin(); it != chain.rend(); ++it) {
    const rmp_code_type x = out_.types[*it];
    std::vector<Id> parts{e};
    if (x.kind == RMP_TYPE_ARRAY)
      for (std::int64_t i = std::int64_t{x.lower} + 1; i <= x.upper; ++i)
        parts.push_back(zero(x.element, where));
    for (Id k = 1; x.kind == RMP_TYPE_RECORD && k < x.field_count; ++k)
      parts.push_back(zero(out_.fields[x.first_field + k].type, where));
    e = add_with(RMP_EXPR_MAKE, *it, where, parts);
  }
  return e;
}

Id Checker::component(Id n, Id type, const std::string& what) {
  const Id e = expression(n, type);
  const Id from = type_of(e);
  const bool is_scalar = from == RMP_TYPE_INT || from == RMP_TYPE_REAL || from == RMP_TYPE_BOOL ||
                         from == RMP_TYPE_CHAR;
  if (is_scalar && type != kBad && !is_basic(type) && out_.types[type].role != RMP_ROLE_POSITION &&
      out_.types[type].role != RMP_ROLE_ORIENTATION && out_.types[type].role != RMP_ROLE_POSE &&
      out_.types[type].role != RMP_ROLE_ROBTARGET)
    if (const Id filled = first_component(e, type); filled != kNone) return filled;
  return convert(e, type, at(n), what);
}

/// The arguments of TypeName(...), (...) or [...] as a value of the type.
Id Checker::make(const Node& n, Id type, Id first) {
  const rmp_code_type t = out_.types[type];
  std::uint64_t count = 0;
  for (Id a = first; a != kNone; a = at(a).next) ++count;
  const std::uint64_t wanted = t.kind == RMP_TYPE_RECORD ? t.field_count
                               : t.kind == RMP_TYPE_ARRAY
                                   ? static_cast<std::uint64_t>(std::int64_t{t.upper} - t.lower + 1)
                                   : count;
  if (is_basic(type)) {
    fail(n, shown(type) + " has no parts and cannot be constructed",
         "Assign the value, or use FLOAT, ROUND, TRUNC, CHR or ORD.");
    return bad(n);
  }
  if (count != wanted) {
    std::string fields;
    for (Id k = 0; t.kind == RMP_TYPE_RECORD && k < t.field_count && k < 12; ++k)
      fields += (k ? ", " : "") + std::string(out_.fields[t.first_field + k].name);
    fail(n,
         shown(type) + " consists of " + std::to_string(wanted) + " values, but here " +
             (count == 1 ? "is 1" : "are " + std::to_string(count)),
         fields.empty() ? "" : "They are " + fields + ", in this order.");
    for (Id a = first; a != kNone; a = at(a).next) expression(a);
    return bad(n);
  }
  std::vector<Id> parts;
  Id k = 0;
  bool is_bad = false;
  for (Id a = first; a != kNone; a = at(a).next, ++k) {
    const bool is_record = t.kind == RMP_TYPE_RECORD;
    const Id part = is_record ? out_.fields[t.first_field + k].type : t.element;
    const std::string what =
        is_record
            ? std::string("field ") + out_.fields[t.first_field + k].name + " of " + shown(type)
            : "an element of " + shown(type);
    parts.push_back(component(a, part, what));
    is_bad = is_bad || type_of(parts.back()) == kBad;
  }
  if (is_bad) return bad(n);
  if (const rmp_code_constant* status = t.role == RMP_ROLE_ROBTARGET ? known(parts[1]) : nullptr) {
    const Node& where = at(at(first).next);
    if (status->integer < -1) {
      fail(where, "STATUS must not be negative, but this is " + std::to_string(status->integer),
           "-1 means any; otherwise one bit for each branch of the robot's inverse kinematics.");
      return bad(n);
    }
    if (status->integer > 7)
      warn(where, "STATUS " + std::to_string(status->integer) + " has branches beyond the third",
           "Robots with fewer branches reject it, and posts write 0 to 7.");
  }
  return add_with(RMP_EXPR_MAKE, type, span(n), parts);
}

Id Checker::expression(Id id, Id expected) {
  const Node& n = at(id);
  switch (n.kind) {
    case N::integer: {
      const std::string_view w = s_->word(s_->tokens[n.token]);
      std::int64_t v = 0;
      const auto r = std::from_chars(w.data(), w.data() + w.size(), v);
      if (r.ec == std::errc() && v <= kMostInt) return literal(out_.integer(v), span(n));
      fail(n, "an INT is at most 2147483647", "Write it as a REAL, with \".0\".");
      return bad(n);
    }
    case N::real: {
      const std::string_view w = s_->word(s_->tokens[n.token]);
      double v = 0;
      const auto r = std::from_chars(w.data(), w.data() + w.size(), v);
      if (r.ec == std::errc()) return literal(out_.real(v), span(n));
      fail(n, "this number is outside the range of REAL", "A REAL is at most about 1.8e308.");
      return bad(n);
    }
    case N::string: return literal(out_.text(string_value(s_->word(s_->tokens[n.token]))), span(n));
    case N::name:
    case N::call: return expression_of_name(n);
    case N::field: {
      const Id of = expression(n.first);
      const Id t = type_of(of);
      if (t == kBad) return bad(n);
      if (is_basic(t) || out_.types[t].kind != RMP_TYPE_RECORD) {
        fail_name(n, shown(t) + " has no fields");
        return bad(n);
      }
      const rmp_code_type& x = out_.types[t];
      if (const auto found = field_at_.find({x.first_field, n.name}); found != field_at_.end()) {
        use(n, x.first_field + found->second, Use::field);
        return add(RMP_EXPR_FIELD, out_.fields[x.first_field + found->second].type, span(n), {of},
                   found->second);
      }
      std::string all;
      for (Id k = 0; k < x.field_count && k < 20; ++k)
        all += (k ? ", " : "") + std::string(out_.fields[x.first_field + k].name);
      fail_name(n, shown(t) + " has no field " + written(n), "Its fields are " + all + ".");
      return bad(n);
    }
    case N::index: {
      Id of = expression(n.first);
      for (Id i = at(n.first).next; i != kNone; i = at(i).next) {
        const Id t = type_of(of);
        const Id index = number(i, "an index");
        if (t == kBad || type_of(index) == kBad) return bad(n);
        const std::uint32_t kind = out_.types[t].kind;
        if (kind != RMP_TYPE_ARRAY && kind != RMP_TYPE_LIST && kind != RMP_TYPE_STRING) {
          fail(at(i), shown(t) + " has no elements");
          return bad(n);
        }
        const rmp_code_constant* c = known(index);
        if (c && kind == RMP_TYPE_ARRAY &&
            (c->integer < out_.types[t].lower || c->integer > out_.types[t].upper)) {
          fail(at(i), "the index " + std::to_string(c->integer) + " is outside " +
                          std::to_string(out_.types[t].lower) + ".." +
                          std::to_string(out_.types[t].upper));
          return bad(n);
        }
        if (c && kind != RMP_TYPE_ARRAY && c->integer < 1) {
          fail(at(i), "the index " + std::to_string(c->integer) + " is below 1, the first");
          return bad(n);
        }
        const Id element = kind == RMP_TYPE_STRING ? Id{RMP_TYPE_CHAR} : out_.types[t].element;
        of = add(RMP_EXPR_INDEX, element, span(n), {of, index});
      }
      return of;
    }
    case N::aggregate:
      if (n.flag) return expression(n.first, expected);
      if (expected == kBad || is_basic(expected)) {
        fail(n, "the type of these values is unknown here",
             "Write the name of the type before them: POSITION(0.0, 0.0, 0.0)");
        for (Id a = n.first; a != kNone; a = at(a).next) expression(a);
        return bad(n);
      }
      return make(n, expected, n.first);
    case N::list: {
      if (expected != kBad && !is_basic(expected) && out_.types[expected].kind != RMP_TYPE_RECORD)
        return make(n, expected, n.first);
      if (n.first == kNone) {
        fail(n, "the type of these brackets is unknown here");
        return bad(n);
      }
      std::vector<Id> parts;
      Id element = kBad;
      bool is_bad = false;
      for (Id a = n.first; a != kNone; a = at(a).next) {
        parts.push_back(expression(a, element));
        const Id t = type_of(parts.back());
        if (t == kBad) is_bad = true;
        else if (element == kBad || (element == RMP_TYPE_INT && t == RMP_TYPE_REAL)) element = t;
      }
      if (is_bad) return bad(n);
      Id a = n.first;
      for (Id& p : parts) {
        p = convert(p, element, at(a), "an element");
        is_bad = is_bad || type_of(p) == kBad;
        a = at(a).next;
      }
      if (is_bad) return bad(n);
      return add_with(RMP_EXPR_MAKE, array_of(element, 1, static_cast<std::int32_t>(parts.size())),
                      span(n), parts);
    }
    case N::negate:
    case N::plus: {
      const Node& inner = at(n.first);
      if (n.kind == N::negate && inner.kind == N::integer &&
          s_->word(s_->tokens[inner.token]) == "2147483648")
        return literal(out_.integer(-kMostInt - 1), span(n));
      const Id e = expression(n.first);
      const Id t = type_of(e);
      if (t == kBad) return e;
      if (!is_number(t)) {
        fail(n, "a sign must be followed by a number, but this is " + shown(t));
        return bad(n);
      }
      if (n.kind == N::plus) return e;
      if (const rmp_code_constant* c = known(e)) {
        if (c->kind == RMP_CONSTANT_REAL) return literal(out_.real(-c->real), span(n));
        if (-c->integer <= kMostInt) return literal(out_.integer(-c->integer), span(n));
        fail(n, "this value is outside the range of INT");
        return bad(n);
      }
      return add(RMP_EXPR_NEGATE, t, span(n), {e});
    }
    case N::not_: {
      const Id e = boolean(n.first, "NOT");
      if (type_of(e) == kBad) return bad(n);
      if (const rmp_code_constant* c = known(e))
        return literal(out_.integer(!c->integer, RMP_TYPE_BOOL), span(n));
      return add(RMP_EXPR_NOT, RMP_TYPE_BOOL, span(n), {e});
    }
    case N::binary: return binary(n);
    default: return bad(n);
  }
}

Id Checker::expression_of_name(const Node& n) {
  const Id symbol = lookup(n.name);
  use(n, symbol);
  if (symbol == kNone) {
    fail_name(n, "there is no name " + written(n), suggestion(n.name));
    for (Id a = n.first; a != kNone; a = at(a).next) expression(a);
    return bad(n);
  }
  const rmp_code_symbol sym = out_.symbols[symbol];
  switch (sym.kind) {
    case RMP_SYMBOL_TYPE:
      if (n.kind == N::call) return sym.type == kBad ? bad(n) : make(n, sym.type, n.first);
      fail_name(n, written(n) + " is a type, not a value",
                "Construct values with " + written(n) + "(...).");
      return bad(n);
    case RMP_SYMBOL_ROUTINE: {
      const rmp_code_routine& r = out_.routines[sym.routine];
      if (r.kind == RMP_ROUTINE_FUNCTION || r.kind == RMP_ROUTINE_PROCEDURE) return call(n, symbol);
      if (r.kind == RMP_ROUTINE_PROCESS && n.kind == N::name)
        return add(RMP_EXPR_SYMBOL, RMP_TYPE_PROCESS, span(n), {}, symbol);
      fail_name(n, written(n) + " cannot be called",
                "Start a process with START " + written(n) + ";");
      return bad(n);
    }
    case RMP_SYMBOL_INTRINSIC: return intrinsic(n, symbol);
    case RMP_SYMBOL_LABEL: fail_name(n, written(n) + " is a label, not a value"); return bad(n);
    default: break;
  }
  if (n.kind == N::call) {
    fail_name(n, written(n) + " is not a function",
              "Write elements in square brackets: " + written(n) + "[1]");
    for (Id a = n.first; a != kNone; a = at(a).next) expression(a);
    return bad(n);
  }
  if (sym.type == kBad) return bad(n);
  return add(RMP_EXPR_SYMBOL, sym.type, span(n), {}, symbol, sym.constant);
}

Id Checker::call(const Node& n, Id symbol) {
  const Id callee = out_.symbols[symbol].routine;
  const rmp_code_routine r = out_.routines[callee];
  if (routine_ != kNone) calls_[routine_].insert(callee);
  std::vector<Id> arguments;
  std::uint32_t count = 0;
  for (Id a = n.first; a != kNone; a = at(a).next) ++count;
  if (count != r.parameter_count) {
    std::string all;
    for (Id k = 0; k < r.parameter_count; ++k) {
      const rmp_code_symbol& p = out_.symbols[r.first_parameter + k];
      all += (k ? ", " : "") + shown(p.type) + " " + p.name;
    }
    fail_name(n,
              written(n) + " takes " + std::to_string(r.parameter_count) + " arguments, but here " +
                  (count == 1 ? "is 1" : "are " + std::to_string(count)),
              all.empty() ? "" : "They are " + all + ".");
    for (Id a = n.first; a != kNone; a = at(a).next) expression(a);
    return bad(n);
  }
  bool is_bad = false;
  Id k = 0;
  for (Id a = n.first; a != kNone; a = at(a).next, ++k) {
    const rmp_code_symbol p = out_.symbols[r.first_parameter + k];
    const std::string what = std::string("parameter ") + p.name + " of " + written(n);
    Id e = expression(a, p.type);
    if (p.mode == RMP_MODE_IN) {
      e = convert(e, p.type, at(a), what);
    } else if (type_of(e) != kBad) {
      if (!check_place(e, at(a), what + " (" + (p.mode == RMP_MODE_OUT ? "OUT" : "INOUT") + ")")) {
        e = bad(at(a));
      } else if (type_of(e) != p.type && p.type != kBad) {
        fail(at(a), what + " is written to and needs a " + shown(p.type) + ", but this is " +
                        shown(type_of(e)));
        e = bad(at(a));
      }
    }
    is_bad = is_bad || type_of(e) == kBad;
    arguments.push_back(e);
  }
  if (is_bad) return bad(n);
  return add_with(RMP_EXPR_CALL, r.result, span(n), arguments, symbol);
}

/// Whether an expression is the name of a robot.
bool Checker::is_robot(Id e) const {
  const rmp_code_expression& x = out_.expressions[e];
  return x.op == RMP_EXPR_SYMBOL && out_.symbols[x.symbol].kind == RMP_SYMBOL_ROBOT;
}

Id Checker::intrinsic(const Node& n, Id symbol) {
  const Intrinsic* in = nullptr;
  for (const Intrinsic& i : intrinsics())
    if (i.name == out_.symbols[symbol].name) in = &i;
  std::vector<Id> arguments, nodes;
  for (Id a = n.first; a != kNone; a = at(a).next) nodes.push_back(a);
  const auto failed = [&](Id node, const std::string& message, const std::string& hint = {}) {
    fail(node == kNone ? n : at(node), message, hint);
    return bad(n);
  };
  const std::string name(in->name);
  const auto without_type = [&](bool is_joint) {
    return failed(
        kNone,
        name + " is of " + (is_joint ? "JOINT" : "ROBTARGET") + ", but the cell has no such type",
        "Declare it in the cell, as in the standard cell.");
  };
  const bool is_brake = in->parameters == "q";
  const char many =
      in->parameters == "w" || in->parameters == "m" || is_brake ? in->parameters[0] : '\0';
  if (is_brake && nodes.size() > 2) {
    for (const Id a : nodes) expression(a);
    return failed(nodes[2], name + " takes only a mode and a robot", std::string(in->doc));
  }
  if (!many && nodes.size() != in->parameters.size()) {
    for (const Id a : nodes) expression(a);
    return failed(kNone,
                  name + " takes " + std::to_string(in->parameters.size()) +
                      " arguments, but here " +
                      (nodes.size() == 1 ? "is 1" : "are " + std::to_string(nodes.size())),
                  std::string(in->doc));
  }
  Id element = kBad, result_number = RMP_TYPE_INT;
  bool is_bad = false;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const Node& a = at(nodes[k]);
    const char p = many ? many : in->parameters[k];
    const std::string what = "argument " + std::to_string(k + 1) + " of " + name;
    Id wanted = kBad;
    if (p == 'i' || (p == 'q' && k == 0)) wanted = RMP_TYPE_INT;
    else if (p == 'r') wanted = RMP_TYPE_REAL;
    else if (p == 'c') wanted = RMP_TYPE_CHAR;
    else if (p == 's') wanted = RMP_TYPE_STRING;
    else if (p == 'p') wanted = named_type("POSITION");
    else if (p == 'o') wanted = named_type("ORIENTATION");
    else if (p == 'P') wanted = named_type("POSE");
    else if (p == 'J') wanted = named_type("JOINT");
    else if (p == 'T') wanted = named_type("ROBTARGET");
    else if (p == 'e') wanted = element;
    if (wanted == kBad && (p == 'J' || p == 'T')) return without_type(p == 'J');
    Id e = expression(nodes[k], wanted);
    const Id t = type_of(e);
    if (t == kBad) {
      is_bad = true;
      arguments.push_back(e);
      continue;
    }
    const std::uint32_t kind = out_.types[t].kind;
    const bool is_file = kind == RMP_TYPE_FILE || kind == RMP_TYPE_TEXT;
    if (wanted != kBad) {
      e = convert(e, wanted, a, what);
      const rmp_code_constant* mode = p == 'q' ? known(e) : nullptr;
      if (mode && type_of(e) != kBad && mode->integer != 0 && mode->integer != 1)
        return failed(nodes[k], name + " has no mode " + std::to_string(mode->integer),
                      "0 ends the motion, 1 holds it until the interrupt's routine has ended.");
    } else if (p == 'q') {
      if (!is_robot(e))
        return failed(nodes[k], what + " needs the name of a robot, but this is " + shown(t),
                      "Such as: BRAKE(0, arm); where the cell has ROBOT arm := ...;");
    } else if (p == 'n') {
      if (!is_number(t)) return failed(nodes[k], what + " needs a number, but this is " + shown(t));
      result_number = t;
    } else if (p == 'F' || p == 'S' || p == 'L' || p == 'B') {
      const bool fits = p == 'F'   ? is_file
                        : p == 'S' ? kind == RMP_TYPE_SEMAPHORE
                        : p == 'L' ? kind == RMP_TYPE_LIST
                                   : kind == RMP_TYPE_STRING;
      const char* needed = p == 'F'   ? "a FILE or TEXT"
                           : p == 'S' ? "a SEMAPHORE"
                           : p == 'L' ? "a list"
                                      : "a STRING";
      if (!fits) return failed(nodes[k], what + " needs " + needed + ", but this is " + shown(t));
      if (!check_place(e, a, what)) return bad(n);
      element = kind == RMP_TYPE_LIST ? out_.types[t].element : kBad;
    } else if (p == 'l') {
      if (kind != RMP_TYPE_LIST)
        return failed(nodes[k], what + " needs a list, but this is " + shown(t));
      element = out_.types[t].element;
    } else if (p == 'a') {
      if (kind != RMP_TYPE_LIST && kind != RMP_TYPE_ARRAY && kind != RMP_TYPE_STRING)
        return failed(nodes[k],
                      what + " needs an array, a list or a string, but this is " + shown(t));
    } else if (p == 'x') {
      if (kind != RMP_TYPE_PROCESS)
        return failed(nodes[k], what + " needs a process, but this is " + shown(t));
    } else if (p == 'w' || p == 'm') {
      if (is_file && k > 0) return failed(nodes[k], "the file is the first argument of " + name);
      if (kind == RMP_TYPE_SEMAPHORE || kind == RMP_TYPE_PROCESS || t == RMP_TYPE_VOID)
        return failed(nodes[k], shown(t) + " is not a value that " + name + " knows");
      if ((p == 'm' || is_file) && !check_place(e, a, what)) return bad(n);
      if (p == 'm' && !is_file && kind > RMP_TYPE_STRING)
        return failed(
            nodes[k],
            name + " reads numbers, characters, BOOL and strings, but this is " + shown(t));
    }
    is_bad = is_bad || type_of(e) == kBad;
    arguments.push_back(e);
  }
  if (is_bad) return bad(n);
  Id result = RMP_TYPE_VOID;
  const std::string_view r = in->result;
  if (r == "i") result = RMP_TYPE_INT;
  else if (r == "r") result = RMP_TYPE_REAL;
  else if (r == "n") result = result_number;
  else if (r == "c") result = RMP_TYPE_CHAR;
  else if (r == "b") result = RMP_TYPE_BOOL;
  else if (r == "s") result = RMP_TYPE_STRING;
  else if (r == "p") result = named_type("POSITION");
  else if (r == "o") result = named_type("ORIENTATION");
  else if (r == "P") result = named_type("POSE");
  else if (r == "J") result = named_type("JOINT");
  else if (r == "T") result = named_type("ROBTARGET");
  else if (r == "R") {
    for (Id t = 0; t < out_.types.size() && result == RMP_TYPE_VOID; ++t)
      if (out_.types[t].role == RMP_ROLE_ROBOT) result = t;
    if (result == RMP_TYPE_VOID)
      return failed(kNone, name + " is a robot, but the cell declares none",
                    "Declare its R_SPEC_TYPE, and ROBOT arm := R_SPEC_TYPE(...); there.");
  }
  if (result == kBad) return without_type(r == "J");
  // Functions of numbers that are known are numbers that are known.
  std::vector<double> x;
  for (const Id a : arguments) {
    const rmp_code_constant* c = known(a);
    if (!c || c->kind == RMP_CONSTANT_TEXT) break;
    x.push_back(value_of(*c));
  }
  if (!many && !x.empty() && x.size() == arguments.size() && is_basic(result)) {
    if (const auto y = evaluate(in->name, x)) {
      if (result == RMP_TYPE_REAL) return literal(out_.real(*y), span(n));
      const double most = result == RMP_TYPE_CHAR ? 255.0 : static_cast<double>(kMostInt);
      const double least = result == RMP_TYPE_CHAR ? 0.0 : -static_cast<double>(kMostInt) - 1;
      if (*y < least || *y > most)
        return failed(kNone,
                      "the value of " + name + " is beyond what " + shown(result) + " holds");
      return literal(out_.integer(static_cast<std::int64_t>(*y), result), span(n));
    }
    return failed(kNone, name + " has no value here", std::string(in->doc));
  }
  return add_with(RMP_EXPR_INTRINSIC, result, span(n), arguments, symbol);
}

Id Checker::binary(const Node& n) {
  const std::uint32_t op = op_of(n.op);
  const Id first = n.first, second = at(first).next;
  Id a = expression(first), b = expression(second);
  const Id ta = type_of(a), tb = type_of(b);
  if (ta == kBad || tb == kBad) return bad(n);
  const std::string sign = upper(s_->word(s_->tokens[n.name_token]));
  const auto failed = [&](const std::string& hint = {}) {
    Node where = n;
    where.token = where.last = n.name_token;
    fail(where, "\"" + sign + "\" cannot combine " + shown(ta) + " and " + shown(tb), hint);
    return bad(n);
  };
  const auto both = [&](Id t) {
    a = convert(a, t, at(first), sign);
    b = convert(b, t, at(second), sign);
  };
  switch (op) {
    case RMP_EXPR_AND:
    case RMP_EXPR_OR:
    case RMP_EXPR_EXOR:
      if (ta != RMP_TYPE_BOOL || tb != RMP_TYPE_BOOL)
        return failed("It combines conditions; there is no operator for bits.");
      return fold(op, a, b, RMP_TYPE_BOOL, n);
    case RMP_EXPR_ADD:
    case RMP_EXPR_SUBTRACT:
    case RMP_EXPR_MULTIPLY:
    case RMP_EXPR_DIVIDE: {
      if (!is_number(ta) || !is_number(tb)) {
        if (op == RMP_EXPR_ADD && (ta == RMP_TYPE_STRING || tb == RMP_TYPE_STRING))
          return failed("Use CONCAT for strings.");
        if (op == RMP_EXPR_MULTIPLY && !is_basic(ta)) return failed("Use \"@\" for poses.");
        return failed();
      }
      const Id t = op == RMP_EXPR_DIVIDE || ta == RMP_TYPE_REAL || tb == RMP_TYPE_REAL
                       ? RMP_TYPE_REAL
                       : RMP_TYPE_INT;
      both(t);
      return fold(op, a, b, t, n);
    }
    case RMP_EXPR_DIV:
    case RMP_EXPR_MOD:
      if (ta != RMP_TYPE_INT || tb != RMP_TYPE_INT) return failed("It combines whole numbers.");
      return fold(op, a, b, RMP_TYPE_INT, n);
    case RMP_EXPR_COMPOSE: {
      const auto role = [&](Id t) { return out_.types[t].role; };
      if (role(ta) == RMP_ROLE_ROBTARGET) {
        // What is composed of a target is its pose.
        return failed("Use its pose: target.PSE");
      }
      const bool fits = (role(ta) == RMP_ROLE_POSE &&
                         (role(tb) == RMP_ROLE_POSE || role(tb) == RMP_ROLE_POSITION)) ||
                        (role(ta) == RMP_ROLE_ORIENTATION &&
                         (role(tb) == RMP_ROLE_ORIENTATION || role(tb) == RMP_ROLE_POSITION));
      if (!fits)
        return failed(
            "It combines POSE @ POSE, POSE @ POSITION, ORIENTATION @ ORIENTATION "
            "and ORIENTATION @ POSITION.");
      return add(op, tb, span(n), {a, b});
    }
    default: break;
  }
  // Comparisons.
  const bool is_order = op >= RMP_EXPR_LESS;
  if (is_number(ta) && is_number(tb)) {
    if (ta != tb) both(RMP_TYPE_REAL);
    return fold(op, a, b, RMP_TYPE_BOOL, n);
  }
  // 'a' is a string as well as a character.
  if (ta == RMP_TYPE_CHAR && tb == RMP_TYPE_STRING && known(b) && known(b)->text_size == 1)
    b = convert(b, RMP_TYPE_CHAR, at(second), sign);
  else if (tb == RMP_TYPE_CHAR && ta == RMP_TYPE_STRING && known(a) && known(a)->text_size == 1)
    a = convert(a, RMP_TYPE_CHAR, at(first), sign);
  else if ((ta == RMP_TYPE_CHAR && tb == RMP_TYPE_STRING) ||
           (tb == RMP_TYPE_CHAR && ta == RMP_TYPE_STRING))
    both(RMP_TYPE_STRING);
  if (type_of(a) != type_of(b)) return failed();
  const Id t = type_of(a);
  if (t == RMP_TYPE_BOOL && !is_order) return fold(op, a, b, RMP_TYPE_BOOL, n);
  if (t == RMP_TYPE_CHAR || t == RMP_TYPE_STRING) return fold(op, a, b, RMP_TYPE_BOOL, n);
  return failed(is_basic(t) ? "" : "Compare their fields or elements.");
}

Id Checker::fold(std::uint32_t op, Id a, Id b, Id type, const Node& n) {
  const rmp_span where = span(n);
  const rmp_code_constant *ca = known(a), *cb = known(b);
  if ((op == RMP_EXPR_DIV || op == RMP_EXPR_MOD || op == RMP_EXPR_DIVIDE) && cb &&
      value_of(*cb) == 0) {
    Node divisor = at(at(n.first).next);
    fail(divisor, "this divides by zero");
    return bad(n);
  }
  // What is known on the left decides alone.
  if (ca && !cb && (op == RMP_EXPR_AND || op == RMP_EXPR_OR)) {
    if ((ca->integer != 0) == (op == RMP_EXPR_OR))
      return literal(out_.integer(ca->integer, RMP_TYPE_BOOL), where);
    return b;
  }
  if (!ca || !cb) return add(op, type, where, {a, b});
  const auto truth = [&](bool v) { return literal(out_.integer(v, RMP_TYPE_BOOL), where); };
  if (op >= RMP_EXPR_EQUAL && op <= RMP_EXPR_GREATER_EQUAL) {
    int order = 0;
    if (ca->kind == RMP_CONSTANT_TEXT) {
      order = std::string_view(ca->text, ca->text_size)
                  .compare(std::string_view(cb->text, cb->text_size));
    } else {
      const double x = value_of(*ca), y = value_of(*cb);
      order = x < y ? -1 : x > y ? 1 : 0;
    }
    switch (op) {
      case RMP_EXPR_EQUAL: return truth(order == 0);
      case RMP_EXPR_NOT_EQUAL: return truth(order != 0);
      case RMP_EXPR_LESS: return truth(order < 0);
      case RMP_EXPR_LESS_EQUAL: return truth(order <= 0);
      case RMP_EXPR_GREATER: return truth(order > 0);
      default: return truth(order >= 0);
    }
  }
  if (type == RMP_TYPE_BOOL) {
    const bool x = ca->integer != 0, y = cb->integer != 0;
    return truth(op == RMP_EXPR_AND ? x && y : op == RMP_EXPR_OR ? x || y : x != y);
  }
  if (type == RMP_TYPE_REAL) {
    const double x = value_of(*ca), y = value_of(*cb);
    const double v = op == RMP_EXPR_ADD        ? x + y
                     : op == RMP_EXPR_SUBTRACT ? x - y
                     : op == RMP_EXPR_MULTIPLY ? x * y
                                               : x / y;
    if (std::isfinite(v)) return literal(out_.real(v), where);
  } else {
    const std::int64_t x = ca->integer, y = cb->integer;
    const std::int64_t v = op == RMP_EXPR_ADD        ? x + y
                           : op == RMP_EXPR_SUBTRACT ? x - y
                           : op == RMP_EXPR_MULTIPLY ? x * y
                           : op == RMP_EXPR_DIV      ? x / y
                                                     : x % y;
    if (v <= kMostInt && v >= -kMostInt - 1) return literal(out_.integer(v), where);
  }
  fail(n, "this value is beyond what " + shown(type) + " holds",
       type == RMP_TYPE_INT ? "An INT is from -2147483648 to 2147483647." : "");
  return bad(n);
}

}  // namespace robomosp::irl
