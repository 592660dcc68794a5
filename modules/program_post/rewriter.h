// SPDX-License-Identifier: Apache-2.0
// Rows for passes to add to the tables of a program (layer: data processing, program_post).
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string_view>
#include <vector>

#include <robomosp/sdk/program_tables.h>

namespace robomosp::program_post {

/// Statements one behind the other.
struct Chain {
  std::uint32_t head = RMP_NONE, tail = RMP_NONE;
};

class Rewriter {
 public:
  explicit Rewriter(ProgramTables& tables) : t_(tables) {}

 protected:
  rmp_code_statement& st(std::uint32_t i) { return t_.statements[i]; }
  [[nodiscard]] const rmp_code_expression& ex(std::uint32_t i) const { return t_.expressions[i]; }
  [[nodiscard]] std::uint32_t operand(std::uint32_t e, std::uint32_t k) const {
    return t_.links[ex(e).first + k];
  }
  /// Whether it is a number, a truth value or a text that is known.
  [[nodiscard]] bool is_known(std::uint32_t e) const {
    return ex(e).constant != RMP_NONE && t_.types[ex(e).type].kind <= RMP_TYPE_STRING;
  }

  std::uint32_t expression(std::uint32_t op, std::uint32_t type, const rmp_span& span,
                           std::span<const std::uint32_t> operands, std::uint32_t symbol = RMP_NONE,
                           std::uint32_t constant = RMP_NONE) {
    rmp_code_expression e{};
    e.op = op;
    e.type = type;
    e.symbol = symbol;
    e.constant = constant;
    e.first = static_cast<std::uint32_t>(t_.links.size());
    e.count = static_cast<std::uint32_t>(operands.size());
    e.span = span;
    t_.links.insert(t_.links.end(), operands.begin(), operands.end());
    t_.expressions.push_back(e);
    return static_cast<std::uint32_t>(t_.expressions.size() - 1);
  }
  std::uint32_t expression(std::uint32_t op, std::uint32_t type, const rmp_span& span,
                           std::initializer_list<std::uint32_t> operands,
                           std::uint32_t symbol = RMP_NONE, std::uint32_t constant = RMP_NONE) {
    return expression(op, type, span, std::span(operands.begin(), operands.size()), symbol,
                      constant);
  }
  std::uint32_t literal(std::uint32_t constant, const rmp_span& span) {
    return expression(RMP_EXPR_LITERAL, t_.constants[constant].type, span, {}, RMP_NONE, constant);
  }
  std::uint32_t real(double v, const rmp_span& span) { return literal(t_.real(v), span); }
  std::uint32_t truth(bool v, const rmp_span& span) {
    return literal(t_.integer(v ? 1 : 0, RMP_TYPE_BOOL), span);
  }
  std::uint32_t text(std::string_view s, const rmp_span& span) { return literal(t_.text(s), span); }
  std::uint32_t statement(std::uint32_t op, const rmp_span& span) {
    rmp_code_statement s{};
    s.op = op;
    s.next = s.a = s.b = s.c = s.body = s.symbol = s.motion = RMP_NONE;
    s.span = span;
    t_.statements.push_back(s);
    return static_cast<std::uint32_t>(t_.statements.size() - 1);
  }
  /// A variable of a routine; of routine 0 it is the program's.
  std::uint32_t new_variable(std::uint32_t type, std::string_view name, std::uint32_t routine,
                             const rmp_span& span) {
    rmp_code_symbol s{};
    s.kind = RMP_SYMBOL_VARIABLE;
    s.type = type;
    s.name = t_.keep(name);
    s.scope = t_.routines[routine].scope;
    s.routine = routine == 0 ? RMP_NONE : routine;
    s.value = s.constant = RMP_NONE;
    s.span = span;
    t_.symbols.push_back(s);
    return static_cast<std::uint32_t>(t_.symbols.size() - 1);
  }
  std::uint32_t variable(std::uint32_t symbol, const rmp_span& span) {
    return expression(RMP_EXPR_SYMBOL, t_.symbols[symbol].type, span, {}, symbol);
  }
  std::uint32_t assignment(std::uint32_t place, std::uint32_t value, const rmp_span& span) {
    const std::uint32_t i = statement(RMP_STMT_ASSIGN, span);
    st(i).a = place;
    st(i).b = value;
    return i;
  }
  std::uint32_t if_then(std::uint32_t condition, std::uint32_t then, const rmp_span& span) {
    const std::uint32_t i = statement(RMP_STMT_IF, span);
    const std::uint32_t arm = statement(RMP_STMT_ARM, span);
    st(arm).a = condition;
    st(arm).body = then;
    st(i).body = arm;
    return i;
  }
  /// Statements that give a place the value of another expression: of a place element by element
  /// and field by field, since many languages assign no arrays and records as a whole. `counter(n)`
  /// is a variable that the n-th loop within another counts by; indices of both are computed for
  /// each element.
  template <class Counter>
  std::uint32_t copied(std::uint32_t to, std::uint32_t from, const rmp_span& span,
                       Counter&& counter, std::size_t within = 0) {
    const rmp_code_type type = t_.types[ex(to).type];
    const std::uint32_t op = ex(from).op;
    const bool is_place = op == RMP_EXPR_SYMBOL || op == RMP_EXPR_FIELD || op == RMP_EXPR_INDEX;
    if (!is_place) return assignment(to, from, span);
    if (type.kind == RMP_TYPE_RECORD && type.role == RMP_ROLE_NONE) {
      Chain all;
      for (std::uint32_t k = 0; k < type.field_count; ++k) {
        const std::uint32_t of = t_.fields[type.first_field + k].type;
        const std::uint32_t a = expression(RMP_EXPR_FIELD, of, span, {to}, k);
        const std::uint32_t b = expression(RMP_EXPR_FIELD, of, span, {from}, k);
        append(all, copied(a, b, span, counter, within));
      }
      return all.head;
    }
    const rmp_code_type other = t_.types[ex(from).type];
    if (type.kind != RMP_TYPE_ARRAY || other.kind != RMP_TYPE_ARRAY)
      return assignment(to, from, span);
    // Arrays of one length may have other bounds.
    const std::uint32_t n = counter(within);
    const std::uint32_t a = expression(RMP_EXPR_INDEX, type.element, span, {to, variable(n, span)});
    std::uint32_t i = variable(n, span);
    if (const auto by = std::int64_t{other.lower} - type.lower; by != 0)
      i = expression(by > 0 ? RMP_EXPR_ADD : RMP_EXPR_SUBTRACT, RMP_TYPE_INT, span,
                     {i, literal(t_.integer(by > 0 ? by : -by), span)});
    const std::uint32_t b = expression(RMP_EXPR_INDEX, other.element, span, {from, i});
    const std::uint32_t body = copied(a, b, span, counter, within + 1);
    return for_each(n, type, body, span);
  }
  /// A loop over the indices of an array.
  std::uint32_t for_each(std::uint32_t counter, const rmp_code_type& array, std::uint32_t body,
                         const rmp_span& span) {
    const std::uint32_t from = literal(t_.integer(array.lower), span);
    const std::uint32_t to = literal(t_.integer(array.upper), span);
    const std::uint32_t i = statement(RMP_STMT_FOR, span);
    st(i).symbol = counter;
    st(i).a = from;
    st(i).b = to;
    st(i).body = body;
    return i;
  }
  void append(Chain& to, std::uint32_t first) {
    if (first == RMP_NONE) return;
    if (to.tail == RMP_NONE) to.head = first;
    else st(to.tail).next = first;
    to.tail = first;
    while (st(to.tail).next != RMP_NONE) to.tail = st(to.tail).next;
  }

  ProgramTables& t_;
};

}  // namespace robomosp::program_post
