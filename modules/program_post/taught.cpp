// SPDX-License-Identifier: Apache-2.0
#include "program_post/taught.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "program_post/rewriter.h"
#include "program_post/walk.h"

namespace robomosp::program_post {
namespace {

using Id = std::uint32_t;

class Taught final : public Rewriter {
 public:
  Taught(ProgramTables& t, std::vector<Remark>& remarks) : Rewriter(t), remarks_(remarks) {}

  bool run() {
    if (std::none_of(t_.statements.begin(), t_.statements.end(),
                     [](const rmp_code_statement& s) { return s.op == RMP_STMT_TEACH; }))
      return false;
    values();
    find_known();
    for (rmp_code_routine& r : t_.routines) {
      if (r.kind == RMP_ROUTINE_DATA_LIST) continue;
      const Id body = block(r.body);
      r.body = body;
    }
    return !known_.empty();
  }

 private:
  /// What lists of data say: the last value of a variable counts. They have no statements then.
  void values() {
    for (rmp_code_routine& r : t_.routines) {
      if (r.kind != RMP_ROUTINE_DATA_LIST) continue;
      for (Id i = std::exchange(r.body, RMP_NONE); i != RMP_NONE; i = st(i).next) {
        values_[ex(st(i).a).symbol] = st(i).b;
        empty(i);
      }
    }
  }
  /// A row that nobody comes to any more.
  void empty(Id i) {
    st(i).op = RMP_STMT_IF;
    st(i).a = st(i).b = st(i).c = st(i).body = st(i).symbol = RMP_NONE;
  }

  // ---- variables that have their value from the beginning ----
  [[nodiscard]] Id root_of(Id e) const {
    while ((ex(e).op == RMP_EXPR_FIELD || ex(e).op == RMP_EXPR_INDEX) && ex(e).count > 0)
      e = operand(e, 0);
    return ex(e).op == RMP_EXPR_SYMBOL ? ex(e).symbol : RMP_NONE;
  }
  /// Symbols that an expression names; the routines that it calls.
  void names(Id first, std::set<Id>& symbols, std::set<Id>& routines) const {
    std::vector<Id> open{first};
    while (!open.empty()) {
      const Id e = open.back();
      open.pop_back();
      if (e == RMP_NONE) continue;
      if (ex(e).op == RMP_EXPR_SYMBOL && ex(e).symbol != RMP_NONE) symbols.insert(ex(e).symbol);
      if (ex(e).op == RMP_EXPR_CALL) routines.insert(t_.symbols[ex(e).symbol].routine);
      for (Id k = 0; k < ex(e).count; ++k) open.push_back(operand(e, k));
    }
  }
  struct Named {
    std::set<Id> symbols, routines;
    bool jumps = false;
  };
  /// The same of one statement.
  void add_own(const rmp_code_statement& s, Named& to) const {
    const auto add = [&](Id e) { names(e, to.symbols, to.routines); };
    to.jumps = to.jumps || s.op == RMP_STMT_GOTO;
    for (const Id e : {s.a, s.b, s.c}) add(e);
    for (Id k = 0; k < s.count; ++k) add(t_.links[s.first + k]);
    if (s.symbol != RMP_NONE && s.op != RMP_STMT_GOTO && s.op != RMP_STMT_LABEL) {
      if (t_.symbols[s.symbol].kind == RMP_SYMBOL_ROUTINE)
        to.routines.insert(t_.symbols[s.symbol].routine);
      else if (s.op != RMP_STMT_TEACH) to.symbols.insert(s.symbol);
    }
    if (s.motion == RMP_NONE) return;
    const rmp_code_motion& m = t_.motions[s.motion];
    each_value(t_, m, add);
    if (m.action != RMP_NONE) to.routines.insert(m.action);
  }
  /// The same of a whole block.
  void names(Id first, Named& to) const {
    each_statement(t_, first, [&](const rmp_code_statement& s) { add_own(s, to); });
  }
  /// Those that a statement other than TEACH assigns, or that a call or a value of another variable
  /// at the beginning may reach.
  std::set<Id> other_ways() const {
    std::set<Id> out, routines;
    for (const rmp_code_statement& s : t_.statements) {
      if (s.op == RMP_STMT_ASSIGN) out.insert(root_of(s.a));
      if (s.op == RMP_STMT_FOR || s.op == RMP_STMT_FOR_DOWN) out.insert(s.symbol);
    }
    for (const rmp_code_expression& x : t_.expressions) {
      if (x.op != RMP_EXPR_CALL && x.op != RMP_EXPR_INTRINSIC) continue;
      const bool is_call = x.op == RMP_EXPR_CALL;
      const Id first =
          is_call ? t_.routines[t_.symbols[x.symbol].routine].first_parameter : RMP_NONE;
      for (Id k = 0; k < x.count; ++k) {
        const Id place = root_of(t_.links[x.first + k]);
        if (place == RMP_NONE) continue;
        // Which arguments procedures of the language change is theirs to know.
        if (is_call ? t_.symbols[first + k].mode != RMP_MODE_IN
                    : t_.types[x.type].kind == RMP_TYPE_VOID)
          out.insert(place);
      }
    }
    for (const rmp_code_symbol& s : t_.symbols) names(s.value, out, routines);
    return out;
  }
  /// TEACH at the beginning of the program, before anything that may read the variable.
  void find_known() {
    const std::set<Id> others = other_ways();
    std::set<Id> read;
    std::vector<bool> is_reached(t_.routines.size(), false);
    bool goes_on = true;
    const auto walk = [&](const auto& self, Id first) -> void {
      for (Id i = first; i != RMP_NONE && goes_on; i = st(i).next) {
        if (st(i).op == RMP_STMT_TEACH) {
          const Id s = st(i).symbol;
          if (values_.contains(s) && !others.contains(s) && !read.contains(s)) known_.insert(s);
          continue;
        }
        if (is_plain_block(i)) {
          self(self, st(st(i).body).body);
          continue;
        }
        Named all;
        add_own(t_.statements[i], all);
        names(t_.statements[i].body, all);
        if (all.jumps) goes_on = false;
        std::vector<Id> open(all.routines.begin(), all.routines.end());
        while (!open.empty()) {
          const Id r = open.back();
          open.pop_back();
          if (is_reached[r]) continue;
          is_reached[r] = true;
          Named inner;
          names(t_.routines[r].body, inner);
          names(t_.routines[r].condition, inner.symbols, inner.routines);
          all.symbols.insert(inner.symbols.begin(), inner.symbols.end());
          open.insert(open.end(), inner.routines.begin(), inner.routines.end());
        }
        read.insert(all.symbols.begin(), all.symbols.end());
      }
    };
    walk(walk, t_.routines[0].body);
    for (const Id s : known_) t_.symbols[s].value = values_.at(s);
  }

  // ---- statements ----
  /// TEACH of several variables is a block of its own.
  [[nodiscard]] bool is_plain_block(Id i) const {
    const rmp_code_statement& s = t_.statements[i];
    return s.op == RMP_STMT_IF && s.body != RMP_NONE && t_.statements[s.body].a == RMP_NONE &&
           t_.statements[s.body].next == RMP_NONE;
  }
  Id block(Id first) {
    Chain out;
    for (Id i = first; i != RMP_NONE;) {
      const Id next = std::exchange(st(i).next, RMP_NONE);
      if (is_plain_block(i)) {
        append(out, block(st(st(i).body).body));
        empty(i);
      } else if (st(i).op != RMP_STMT_TEACH) {
        inner(i);
        append(out, i);
      } else if (teach(i)) {
        append(out, i);
      }
      i = next;
    }
    return out.head;
  }
  void inner(Id i) {
    if (st(i).op != RMP_STMT_IF && st(i).op != RMP_STMT_CASE) {
      const Id body = block(st(i).body);
      st(i).body = body;
      return;
    }
    for (Id a = st(i).body; a != RMP_NONE; a = st(a).next) {
      const Id body = block(st(a).body);
      st(a).body = body;
    }
  }
  /// Whether a statement is left.
  bool teach(Id i) {
    const Id s = st(i).symbol;
    const auto value = values_.find(s);
    if (value == values_.end()) {
      const std::string name = t_.symbols[s].name;
      remarks_.push_back({RMP_FAULT_ERROR, st(i).span, name + " has no taught value",
                          "Assign one in a data list (" + name + " := ...;), or assign it."});
    }
    if (value == values_.end() || known_.contains(s)) {
      empty(i);
      return false;
    }
    const rmp_span span = st(i).span;
    const Id place = variable(s, span);
    st(i).op = RMP_STMT_ASSIGN;
    st(i).a = place;
    st(i).b = value->second;
    st(i).symbol = RMP_NONE;
    return true;
  }

  std::vector<Remark>& remarks_;
  std::map<Id, Id> values_;  ///< by variable: an expression
  std::set<Id> known_;
};

}  // namespace

bool to_taught_values(ProgramTables& tables, std::vector<Remark>& remarks) {
  return Taught(tables, remarks).run();
}

}  // namespace robomosp::program_post
