// SPDX-License-Identifier: Apache-2.0
// The typed program as three-address code. Values are computed from left to right; of an assignment
// the right side comes first.
#include <unordered_map>
#include <utility>
#include <vector>

#include "checker.h"

namespace robomosp::irl {
namespace {

using Id = std::uint32_t;
using Operand = rmp_code_operand;

class Lowering {
 public:
  explicit Lowering(ProgramTables& p) : p_(p) {}

  void run() {
    for (Id r = 0; r < p_.routines.size(); ++r) {
      p_.routines[r].first_instruction = static_cast<Id>(p_.instructions.size());
      labels_ = temporaries_ = base_ = most_ = 0;
      named_.clear();
      exits_.clear();
      at_ = p_.routines[r].span;
      if (r == 0) initialise(kNone);
      if (p_.routines[r].condition != kNone) {
        const Operand c = value(p_.routines[r].condition);
        emit(RMP_OP_INTERRUPT_TEST, c, {}, {});
      }
      initialise(r);
      statements(p_.routines[r].body);
      rmp_code_routine& out = p_.routines[r];
      out.instruction_count = static_cast<Id>(p_.instructions.size()) - out.first_instruction;
      out.temporary_count = most_;
      out.label_count = labels_;
    }
  }

 private:
  // ---- operands ----
  static Operand number(std::uint64_t n) {
    return {RMP_OPERAND_NUMBER, 0, static_cast<std::int64_t>(n)};
  }
  static Operand word(Id w) { return {RMP_OPERAND_WORD, 0, w}; }
  static Operand label_operand(Id l) { return {RMP_OPERAND_LABEL, 0, l}; }
  static Operand routine(Id r) { return {RMP_OPERAND_ROUTINE, 0, r}; }
  Operand variable(Id s) const { return {RMP_OPERAND_VARIABLE, p_.symbols[s].type, s}; }
  Operand constant(Id c) const { return {RMP_OPERAND_CONSTANT, p_.constants[c].type, c}; }
  Operand temporary(Id type, std::uint32_t kind = RMP_OPERAND_TEMPORARY) {
    const Operand t{kind, type, temporaries_++};
    most_ = temporaries_ > most_ ? temporaries_ : most_;
    return t;
  }
  void emit(std::uint32_t op, const Operand& a, const Operand& b, const Operand& r) {
    p_.instructions.push_back({op, a, b, r, at_});
  }
  Id new_label() { return labels_++; }
  void set_label(Id l) { emit(RMP_OP_LABEL, {}, {}, label_operand(l)); }
  void jump(Id l) { emit(RMP_OP_JUMP, {}, {}, label_operand(l)); }

  [[nodiscard]] const rmp_code_expression& e(Id x) const { return p_.expressions[x]; }
  [[nodiscard]] Id operand(Id x, Id k) const { return p_.links[e(x).first + k]; }
  [[nodiscard]] bool has_call(Id x) const {
    if (e(x).constant != kNone) return false;
    if (e(x).op == RMP_EXPR_CALL) return true;
    for (Id k = 0; k < e(x).count; ++k)
      if (has_call(operand(x, k))) return true;
    return false;
  }
  /// A value that what is computed next cannot change.
  Operand settled(const Operand& o, bool may_change) {
    if (!may_change || o.kind != RMP_OPERAND_VARIABLE) return o;
    const Operand t = temporary(o.type);
    emit(RMP_OP_COPY, o, {}, t);
    return t;
  }

  // ---- values ----
  Operand value(Id x) {
    const rmp_code_expression n = e(x);
    if (n.constant != kNone) return constant(n.constant);
    switch (n.op) {
      case RMP_EXPR_SYMBOL:
        if (p_.symbols[n.symbol].kind == RMP_SYMBOL_ROUTINE)
          return routine(p_.symbols[n.symbol].routine);
        return variable(n.symbol);
      case RMP_EXPR_FIELD:
      case RMP_EXPR_INDEX: {
        const Operand from = place(x);
        const Operand t = temporary(n.type);
        emit(RMP_OP_LOAD, from, {}, t);
        return t;
      }
      case RMP_EXPR_CALL:
      case RMP_EXPR_INTRINSIC: return call(x);
      case RMP_EXPR_MAKE: {
        arguments(x);
        const Operand t = temporary(n.type);
        emit(RMP_OP_MAKE, {}, number(n.count), t);
        return t;
      }
      case RMP_EXPR_CONVERT: return unary(RMP_OP_CONVERT, x);
      case RMP_EXPR_NEGATE: return unary(RMP_OP_NEGATE, x);
      case RMP_EXPR_NOT: return unary(RMP_OP_NOT, x);
      case RMP_EXPR_AND:
      case RMP_EXPR_OR: {
        // The second only where the first does not decide.
        const Operand t = temporary(RMP_TYPE_BOOL);
        const Id done = new_label();
        emit(RMP_OP_COPY, value(operand(x, 0)), {}, t);
        emit(n.op == RMP_EXPR_AND ? RMP_OP_JUMP_UNLESS : RMP_OP_JUMP_IF, t, {},
             label_operand(done));
        emit(RMP_OP_COPY, value(operand(x, 1)), {}, t);
        set_label(done);
        return t;
      }
      default: break;
    }
    static constexpr std::uint32_t kOps[] = {
        RMP_OP_ADD,  RMP_OP_SUBTRACT,   RMP_OP_MULTIPLY, RMP_OP_DIVIDE,
        RMP_OP_DIV,  RMP_OP_MOD,        RMP_OP_EQUAL,    RMP_OP_NOT_EQUAL,
        RMP_OP_LESS, RMP_OP_LESS_EQUAL, RMP_OP_GREATER,  RMP_OP_GREATER_EQUAL,
        RMP_OP_EXOR, RMP_OP_EXOR,       RMP_OP_EXOR,     RMP_OP_COMPOSE};
    const Operand a = settled(value(operand(x, 0)), has_call(operand(x, 1)));
    const Operand b = value(operand(x, 1));
    const Operand t = temporary(n.type);
    emit(kOps[n.op - RMP_EXPR_ADD], a, b, t);
    return t;
  }
  Operand unary(std::uint32_t op, Id x) {
    const Operand a = value(operand(x, 0));
    const Operand t = temporary(e(x).type);
    emit(op, a, {}, t);
    return t;
  }
  /// Where an expression stands: a variable, or a place within one.
  Operand place(Id x) {
    const rmp_code_expression n = e(x);
    if (n.op == RMP_EXPR_FIELD) {
      const Operand of = place(operand(x, 0));
      const Operand p = temporary(n.type, RMP_OPERAND_REFERENCE);
      emit(RMP_OP_FIELD, of, number(n.symbol), p);
      return p;
    }
    if (n.op == RMP_EXPR_INDEX) {
      const Operand of = place(operand(x, 0));
      const Operand i = value(operand(x, 1));
      const Operand p = temporary(n.type, RMP_OPERAND_REFERENCE);
      emit(RMP_OP_ELEMENT, of, i, p);
      return p;
    }
    return value(x);
  }
  /// Whether argument `k` of a call is a place.
  [[nodiscard]] bool is_place(const rmp_code_expression& n, Id k) const {
    if (n.op == RMP_EXPR_CALL) {
      const rmp_code_routine& r = p_.routines[p_.symbols[n.symbol].routine];
      return p_.symbols[r.first_parameter + k].mode != RMP_MODE_IN;
    }
    if (n.op != RMP_EXPR_INTRINSIC) return false;
    const std::string_view name = p_.symbols[n.symbol].name;
    for (const Intrinsic& i : intrinsics()) {
      if (i.name != name) continue;
      if (i.parameters == "m") return true;
      const Id t = e(p_.links[n.first + k]).type;
      if (i.parameters == "w") return k == 0 && (t == RMP_TYPE_FILE || t == RMP_TYPE_TEXT);
      const char p = k < i.parameters.size() ? i.parameters[k] : '\0';
      return p == 'F' || p == 'L' || p == 'S' || p == 'B';
    }
    return false;
  }
  void arguments(Id x) {
    const rmp_code_expression n = e(x);
    std::vector<Operand> all;
    // Whether what comes behind an argument calls a function, which may change a variable.
    std::vector<bool> calls_behind(n.count, false);
    for (Id k = n.count; k-- > 1;) calls_behind[k - 1] = calls_behind[k] || has_call(operand(x, k));
    for (Id k = 0; k < n.count; ++k) {
      const Id a = operand(x, k);
      all.push_back(is_place(n, k) ? place(a) : settled(value(a), calls_behind[k]));
    }
    for (Id k = 0; k < n.count; ++k)
      emit(is_place(n, k) ? RMP_OP_ARGUMENT_PLACE : RMP_OP_ARGUMENT, all[k], {}, {});
  }
  Operand call(Id x) {
    const rmp_code_expression n = e(x);
    arguments(x);
    const Operand result = n.type == RMP_TYPE_VOID ? Operand{} : temporary(n.type);
    if (n.op == RMP_EXPR_CALL)
      emit(RMP_OP_CALL, routine(p_.symbols[n.symbol].routine), number(n.count), result);
    else emit(RMP_OP_INTRINSIC, {RMP_OPERAND_INTRINSIC, 0, n.symbol}, number(n.count), result);
    return result;
  }
  /// To the label where a condition is `sense`.
  void branch(Id x, bool sense, Id label) {
    const rmp_code_expression n = e(x);
    if (n.constant == kNone && n.op == RMP_EXPR_NOT) return branch(operand(x, 0), !sense, label);
    if (n.constant == kNone && (n.op == RMP_EXPR_AND || n.op == RMP_EXPR_OR)) {
      if ((n.op == RMP_EXPR_OR) == sense) {
        branch(operand(x, 0), sense, label);
        branch(operand(x, 1), sense, label);
      } else {
        const Id past = new_label();
        branch(operand(x, 0), !sense, past);
        branch(operand(x, 1), sense, label);
        set_label(past);
      }
      return;
    }
    const Operand c = value(x);
    emit(sense ? RMP_OP_JUMP_IF : RMP_OP_JUMP_UNLESS, c, {}, label_operand(label));
  }

  /// A function that no source names: a step as it is, where it is not 0.
  Id step_check() {
    if (step_check_ == kNone) {
      rmp_code_symbol x{};
      x.kind = RMP_SYMBOL_INTRINSIC;
      x.name = p_.keep("FOR_STEP");
      x.routine = x.value = x.constant = kNone;
      step_check_ = static_cast<Id>(p_.symbols.size());
      p_.symbols.push_back(x);
    }
    return step_check_;
  }

  // ---- statements ----
  /// Of the variables of a routine, kNone = of those of the program, modules and cell.
  void initialise(Id r) {
    if (by_routine_.empty()) {
      by_routine_.resize(p_.routines.size() + 1);
      for (Id s = 0; s < p_.symbols.size(); ++s) {
        const rmp_code_symbol& x = p_.symbols[s];
        const bool has_place = x.kind == RMP_SYMBOL_VARIABLE || x.kind == RMP_SYMBOL_ROBOT ||
                               (x.kind == RMP_SYMBOL_CONSTANT && x.constant == kNone);
        if (has_place && x.value != kNone)
          by_routine_[x.routine == kNone ? p_.routines.size() : x.routine].push_back(s);
      }
    }
    for (const Id s : by_routine_[r == kNone ? p_.routines.size() : r]) {
      at_ = p_.symbols[s].span;
      temporaries_ = base_;
      const Operand v = value(p_.symbols[s].value);
      emit(RMP_OP_COPY, v, {}, variable(s));
    }
  }
  void statements(Id s) {
    for (; s != kNone; s = p_.statements[s].next) {
      at_ = p_.statements[s].span;
      temporaries_ = base_;
      statement(p_.statements[s]);
    }
  }
  void loop_body(const rmp_code_statement& s, Id out) {
    const Id before = base_;
    base_ = temporaries_;
    exits_.push_back(out);
    statements(s.body);
    exits_.pop_back();
    base_ = before;
    at_ = s.span;
  }
  Id label_of(Id symbol) {
    const auto [it, is_new] = named_.try_emplace(symbol, 0);
    if (is_new) it->second = new_label();
    return it->second;
  }

  void statement(const rmp_code_statement s) {  // a copy: tables grow
    switch (s.op) {
      case RMP_STMT_ASSIGN: {
        const Operand v = settled(value(s.b), has_call(s.a));
        if (e(s.a).op == RMP_EXPR_SYMBOL) return emit(RMP_OP_COPY, v, {}, variable(e(s.a).symbol));
        const Operand to = place(s.a);
        return emit(RMP_OP_STORE, v, {}, to);
      }
      case RMP_STMT_CALL: call(s.a); return;
      case RMP_STMT_IF: {
        const Id done = new_label();
        for (Id a = s.body; a != kNone; a = p_.statements[a].next) {
          const rmp_code_statement arm = p_.statements[a];
          at_ = arm.span;
          temporaries_ = base_;
          const Id next = new_label();
          if (arm.a != kNone) branch(arm.a, false, next);
          statements(arm.body);
          if (arm.next != kNone) jump(done);
          set_label(next);
        }
        return set_label(done);
      }
      case RMP_STMT_CASE: {
        const Operand v = settled(value(s.a), true);
        const Id done = new_label();
        std::vector<std::pair<Id, Id>> arms;
        Id otherwise = done;
        for (Id a = s.body; a != kNone; a = p_.statements[a].next) {
          const rmp_code_statement arm = p_.statements[a];
          at_ = arm.span;
          arms.emplace_back(a, new_label());
          if (arm.count == 0) otherwise = arms.back().second;
          for (Id k = 0; k < arm.count; ++k) {
            const Operand t = temporary(RMP_TYPE_BOOL);
            emit(RMP_OP_EQUAL, v, value(p_.links[arm.first + k]), t);
            emit(RMP_OP_JUMP_IF, t, {}, label_operand(arms.back().second));
            --temporaries_;
          }
        }
        jump(otherwise);
        for (const auto& [a, l] : arms) {
          set_label(l);
          statements(p_.statements[a].body);
          jump(done);
        }
        return set_label(done);
      }
      case RMP_STMT_WHILE: {
        const Id again = new_label(), out = new_label();
        set_label(again);
        branch(s.a, false, out);
        loop_body(s, out);
        jump(again);
        return set_label(out);
      }
      case RMP_STMT_REPEAT: {
        const Id again = new_label(), out = new_label();
        set_label(again);
        loop_body(s, out);
        branch(s.a, false, again);
        return set_label(out);
      }
      case RMP_STMT_LOOP: {
        const Id again = new_label(), out = new_label();
        set_label(again);
        loop_body(s, out);
        jump(again);
        return set_label(out);
      }
      case RMP_STMT_FOR:
      case RMP_STMT_FOR_DOWN: {
        const bool is_up = s.op == RMP_STMT_FOR;
        const Operand i = variable(s.symbol);
        const Operand from = value(s.a);
        // Limit and step are computed once, before the variable changes.
        const Operand first = settled(from, has_call(s.b) || s.c != kNone);
        const Operand to = settled(value(s.b), true);
        Operand step = s.c == kNone ? constant(p_.integer(1)) : settled(value(s.c), true);
        // Which way a computed step goes is known when it runs; 0 goes nowhere, and is a fault.
        const bool is_known = s.c == kNone || e(s.c).constant != kNone;
        Operand goes_up{};
        if (!is_known) {
          const Operand checked = temporary(RMP_TYPE_INT);
          emit(RMP_OP_ARGUMENT, step, {}, {});
          emit(RMP_OP_INTRINSIC, {RMP_OPERAND_INTRINSIC, 0, step_check()}, number(1), checked);
          step = checked;
          goes_up = temporary(RMP_TYPE_BOOL);
          emit(is_up ? RMP_OP_GREATER : RMP_OP_LESS, step, constant(p_.integer(0)), goes_up);
        }
        emit(RMP_OP_COPY, first, {}, i);
        const Id again = new_label(), out = new_label();
        const Operand t = temporary(RMP_TYPE_BOOL);
        // Leaves the loop where `a` is beyond `b`.
        const auto leave_beyond = [&](const Operand& a, const Operand& b) {
          if (is_known) {
            emit(is_up ? RMP_OP_GREATER : RMP_OP_LESS, a, b, t);
          } else {
            const Id down = new_label(), either = new_label();
            emit(RMP_OP_JUMP_UNLESS, goes_up, {}, label_operand(down));
            emit(RMP_OP_GREATER, a, b, t);
            jump(either);
            set_label(down);
            emit(RMP_OP_LESS, a, b, t);
            set_label(either);
          }
          emit(RMP_OP_JUMP_IF, t, {}, label_operand(out));
        };
        leave_beyond(i, to);
        set_label(again);
        loop_body(s, out);
        // The last value is not passed by, so that the greatest INT may be one.
        const Operand left = temporary(RMP_TYPE_REAL);
        const Operand x = temporary(RMP_TYPE_REAL), y = temporary(RMP_TYPE_REAL);
        emit(RMP_OP_CONVERT, i, {}, x);
        emit(RMP_OP_CONVERT, to, {}, y);
        const bool is_forward = is_up || !is_known;
        emit(RMP_OP_SUBTRACT, is_forward ? y : x, is_forward ? x : y, left);
        emit(RMP_OP_CONVERT, step, {}, x);
        if (is_known) {
          emit(RMP_OP_LESS, left, x, t);
          emit(RMP_OP_JUMP_IF, t, {}, label_operand(out));
        } else {
          if (!is_up) emit(RMP_OP_NEGATE, x, {}, x);
          leave_beyond(x, left);
        }
        emit(is_up ? RMP_OP_ADD : RMP_OP_SUBTRACT, i, step, i);
        jump(again);
        return set_label(out);
      }
      case RMP_STMT_EXIT:
        if (!exits_.empty()) jump(exits_.back());
        return;
      case RMP_STMT_GOTO: return jump(label_of(s.symbol));
      case RMP_STMT_LABEL: return set_label(label_of(s.symbol));
      case RMP_STMT_RETURN: {
        const Operand v = s.a == kNone ? Operand{} : value(s.a);
        return emit(RMP_OP_RETURN, v, {}, {});
      }
      case RMP_STMT_WAIT_TIME: {
        const Operand v = value(s.a);
        return emit(RMP_OP_WAIT_TIME, v, {}, {});
      }
      case RMP_STMT_WAIT_FOR: {
        const Operand limit = s.b == kNone ? Operand{} : value(s.b);
        emit(RMP_OP_WAIT_BEGIN, limit, {}, {});
        const Id again = new_label();
        set_label(again);
        const Operand c = value(s.a);
        return emit(RMP_OP_WAIT_TEST, c, {}, label_operand(again));
      }
      case RMP_STMT_PAUSE: {
        const Operand v = s.a == kNone ? Operand{} : value(s.a);
        return emit(RMP_OP_PAUSE, v, {}, {});
      }
      case RMP_STMT_HALT: return emit(RMP_OP_HALT, {}, {}, {});
      case RMP_STMT_MOVE: return move(p_.motions[s.motion]);
      case RMP_STMT_START:
      case RMP_STMT_STOP:
      case RMP_STMT_CONTINUE:
      case RMP_STMT_CANCEL:
      case RMP_STMT_ENABLE:
      case RMP_STMT_DISABLE: {
        const Id r = p_.symbols[s.symbol].routine;
        Operand priority{};
        if ((s.op == RMP_STMT_START || s.op == RMP_STMT_ENABLE) && p_.routines[r].priority != kNone)
          priority = value(p_.routines[r].priority);
        return emit(RMP_OP_START + (s.op - RMP_STMT_START), routine(r), priority, {});
      }
      case RMP_STMT_TEACH: return emit(RMP_OP_TEACH, variable(s.symbol), {}, {});
      default: return;
    }
  }

  void move(const rmp_code_motion m) {
    std::vector<Operand> targets, values;
    std::vector<Id> all;
    for (Id k = 0; k < m.target_count; ++k) all.push_back(p_.links[m.first_target + k]);
    for (Id k = 0; k < m.attribute_count; ++k)
      all.push_back(p_.attributes[m.first_attribute + k].value);
    std::vector<bool> calls_behind(all.size(), false);
    for (std::size_t k = all.size(); k-- > 1;)
      calls_behind[k - 1] = calls_behind[k] || has_call(all[k]);
    std::vector<Operand> operands;
    for (std::size_t k = 0; k < all.size(); ++k)
      operands.push_back(settled(value(all[k]), calls_behind[k]));
    for (Id k = 0; k < m.target_count; ++k) emit(RMP_OP_TARGET, operands[k], {}, {});
    for (Id k = 0; k < m.attribute_count; ++k)
      emit(RMP_OP_ATTRIBUTE, operands[m.target_count + k],
           word(p_.attributes[m.first_attribute + k].attribute), {});
    if (m.until != kNone) {
      const Id past = new_label();
      emit(RMP_OP_UNTIL, m.action == kNone ? Operand{} : routine(m.action), {},
           label_operand(past));
      const Operand c = value(m.until);
      emit(RMP_OP_UNTIL_TEST, c, {}, {});
      set_label(past);
    }
    emit(RMP_OP_MOVE, word(m.interpolation), number(m.is_incremental), {});
  }

  ProgramTables& p_;
  Id labels_ = 0, temporaries_ = 0, base_ = 0, most_ = 0, step_check_ = kNone;
  std::unordered_map<Id, Id> named_;
  std::vector<Id> exits_;
  std::vector<std::vector<Id>> by_routine_;
  rmp_span at_{};
};

}  // namespace

void lower(ProgramTables& out) { Lowering(out).run(); }

}  // namespace robomosp::irl
