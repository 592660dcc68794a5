// SPDX-License-Identifier: Apache-2.0
#include "program_post/parts.h"

#include <string>
#include <vector>

#include "program_post/rewriter.h"

namespace robomosp::program_post {
namespace {

class Parts final : public Rewriter {
 public:
  Parts(ProgramTables& tables, std::string_view name) : Rewriter(tables), name_(name) {}

  std::size_t run(std::size_t count) {
    std::vector<std::uint32_t> all;
    for (std::uint32_t i = t_.routines[0].body; i != RMP_NONE; i = st(i).next) {
      switch (st(i).op) {
        case RMP_STMT_ASSIGN:
        case RMP_STMT_CALL:
        case RMP_STMT_WAIT_TIME:
        case RMP_STMT_WAIT_FOR:
        case RMP_STMT_PAUSE:
        case RMP_STMT_HALT:
        case RMP_STMT_RETURN:
        case RMP_STMT_MOVE: all.push_back(i); break;
        default: return 0;
      }
    }
    if (all.empty() || count < 2 || has_variables(all)) return 0;
    Chain program;
    std::vector<std::uint32_t> part;
    std::size_t made = 0;
    const auto end_part = [&] {
      if (part.empty()) return;
      append(program, call_of(part, ++made));
      part.clear();
    };
    const std::size_t size = (all.size() + count - 1) / count;
    for (std::size_t k = 0; k < all.size(); ++k) {
      const std::uint32_t i = all[k];
      const bool ends = st(i).op == RMP_STMT_HALT || st(i).op == RMP_STMT_RETURN;
      if (ends || (part.size() >= size && begins(i) && stops(all[k - 1]))) end_part();
      st(i).next = RMP_NONE;
      if (ends) append(program, i);
      else part.push_back(i);
    }
    end_part();
    t_.routines[0].body = program.head;
    return made;
  }

 private:
  /// Whether a statement asks for or changes what is no signal.
  bool has_variables(const std::vector<std::uint32_t>& all) {
    std::vector<std::uint32_t> open;
    for (const std::uint32_t i : all) {
      for (const std::uint32_t e : {st(i).a, st(i).b, st(i).c}) open.push_back(e);
      if (st(i).motion == RMP_NONE) continue;
      const rmp_code_motion& m = t_.motions[st(i).motion];
      if (m.action != RMP_NONE) return true;
      open.push_back(m.until);
      for (std::uint32_t k = 0; k < m.target_count; ++k)
        open.push_back(t_.links[m.first_target + k]);
      for (std::uint32_t k = 0; k < m.attribute_count; ++k)
        open.push_back(t_.attributes[m.first_attribute + k].value);
    }
    std::vector<bool> seen(t_.expressions.size(), false);
    while (!open.empty()) {
      const std::uint32_t e = open.back();
      open.pop_back();
      if (e == RMP_NONE || seen[e]) continue;
      seen[e] = true;
      if (ex(e).op == RMP_EXPR_CALL) return true;
      if (ex(e).op == RMP_EXPR_SYMBOL && ex(e).symbol != RMP_NONE &&
          t_.symbols[ex(e).symbol].kind == RMP_SYMBOL_VARIABLE)
        return true;
      for (std::uint32_t k = 0; k < ex(e).count; ++k) open.push_back(operand(e, k));
    }
    return false;
  }
  /// A motion that needs nothing of those before it.
  bool begins(std::uint32_t i) {
    if (st(i).op != RMP_STMT_MOVE) return false;
    const rmp_code_motion& m = t_.motions[st(i).motion];
    if (m.interpolation > RMP_MOVE_LIN || m.is_incremental != 0 || m.until != RMP_NONE)
      return false;
    for (std::uint32_t k = 0; k < m.target_count; ++k) {
      const std::uint32_t role = t_.types[ex(t_.links[m.first_target + k]).type].role;
      if (role == RMP_ROLE_POSITION || role == RMP_ROLE_ADD_JOINT) return false;
    }
    return true;
  }
  /// Whether it is no motion that runs into the next one.
  bool stops(std::uint32_t i) {
    if (st(i).op != RMP_STMT_MOVE) return true;
    const rmp_code_motion& m = t_.motions[st(i).motion];
    for (std::uint32_t k = 0; k < m.attribute_count; ++k) {
      const rmp_code_attribute& a = t_.attributes[m.first_attribute + k];
      if (a.attribute != RMP_ATTR_C_CP && a.attribute != RMP_ATTR_C_PTP &&
          a.attribute != RMP_ATTR_C_PASS)
        continue;
      if (ex(a.value).constant == RMP_NONE) return false;
      const rmp_code_constant& c = t_.constants[ex(a.value).constant];
      if (c.kind == RMP_CONSTANT_INT ? c.integer != 0 : c.real != 0) return false;
    }
    return true;
  }
  std::uint32_t call_of(const std::vector<std::uint32_t>& part, std::size_t number) {
    Chain body;
    for (const std::uint32_t i : part) append(body, i);
    const rmp_span span = st(part.front()).span;
    rmp_code_routine r{};
    r.kind = RMP_ROUTINE_PROCEDURE;
    r.scope = t_.routines[0].scope;
    r.result = RMP_TYPE_VOID;
    r.body = body.head;
    r.priority = r.condition = RMP_NONE;
    r.span = span;
    rmp_code_symbol s{};
    s.kind = RMP_SYMBOL_ROUTINE;
    s.type = RMP_TYPE_VOID;
    s.name = t_.keep(name_ + "_" + std::to_string(number));
    s.scope = t_.routines[0].scope;
    s.routine = static_cast<std::uint32_t>(t_.routines.size());
    s.value = s.constant = RMP_NONE;
    s.span = span;
    r.symbol = static_cast<std::uint32_t>(t_.symbols.size());
    t_.symbols.push_back(s);
    t_.routines.push_back(r);
    const std::uint32_t call = statement(RMP_STMT_CALL, span);
    const std::uint32_t what = expression(RMP_EXPR_CALL, RMP_TYPE_VOID, span, {}, r.symbol);
    st(call).a = what;
    return call;
  }

  std::string name_;
};

}  // namespace

std::size_t to_parts(ProgramTables& tables, std::size_t count, std::string_view name) {
  return Parts(tables, name).run(count);
}

}  // namespace robomosp::program_post
