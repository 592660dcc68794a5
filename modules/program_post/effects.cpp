// SPDX-License-Identifier: Apache-2.0
#include "program_post/effects.h"

#include <algorithm>

#include "program_post/components.h"
#include "program_post/walk.h"

namespace robomosp::program_post {

using Id = std::uint32_t;

Effects::Effects(const ProgramTables& tables) : t_(tables) {
  std::set<Id> open;
  for (const rmp_code_routine& r : t_.routines) {
    std::vector<bool>& all = is_changed_.emplace_back();
    for (Id k = 0; k < r.parameter_count; ++k)
      all.push_back(t_.symbols[r.first_parameter + k].mode != RMP_MODE_IN);
  }
  for (const rmp_code_expression& e : t_.expressions) {
    if (e.op != RMP_EXPR_CALL || e.constant != RMP_NONE) continue;
    const Id r = t_.symbols[e.symbol].routine;
    if (t_.routines[r].kind == RMP_ROUTINE_FUNCTION) open.insert(r);
  }
  own_.resize(t_.routines.size());
  calls_.resize(t_.routines.size());
  std::vector<bool> is_seen(t_.routines.size(), false);
  for (const Id r : open) is_seen[r] = true;
  while (!open.empty()) {
    const Id r = open.extract(open.begin()).value();
    add_routine(r, own_[r], calls_[r]);
    for (const Id inner : calls_[r])
      if (!is_seen[inner]) is_seen[inner] = true, open.insert(inner);
    // What is its own is gone when it ends; parameters that it changes are told by its calls.
    const auto is_own = [&](Id s) { return s != RMP_NONE && t_.symbols[s].routine == r; };
    std::erase_if(own_[r].read, is_own);
    std::erase_if(own_[r].changed, is_own);
  }
  component_ = components(calls_.size(), [&](Id r) -> const std::set<Id>& { return calls_[r]; });
  for (Id r = 0; r < component_.size(); ++r) {
    if (members_.size() <= component_[r]) members_.resize(component_[r] + 1);
    members_[component_[r]].push_back(r);
  }
  // What a component leads to has a lower number.
  for (const auto& members : members_) {
    const Id self = static_cast<Id>(changes_any_.size());
    changes_any_.push_back(std::any_of(members.begin(), members.end(), [&](Id r) {
      return !own_[r].changed.empty() ||
             std::any_of(calls_[r].begin(), calls_[r].end(), [&](Id inner) {
               return component_[inner] != self && changes_any_[component_[inner]];
             });
    }));
  }
  for (Id r = 0; r < t_.routines.size(); ++r)
    is_any_ = is_any_ || (is_seen[r] && t_.routines[r].kind == RMP_ROUTINE_FUNCTION &&
                          (changes_any_[component_[r]] ||
                           std::count(is_changed_[r].begin(), is_changed_[r].end(), true) > 0));
}

const Effects::Touched& Effects::outlasting(Id routine) {
  const auto [at, is_new] = outlasting_.try_emplace(component_[routine]);
  if (!is_new) return at->second;
  Touched& out = at->second;
  std::vector<Id> open{component_[routine]};
  std::set<Id> seen{open.front()};
  while (!open.empty()) {
    const Id c = open.back();
    open.pop_back();
    for (const Id r : members_[c]) {
      out.read.insert(own_[r].read.begin(), own_[r].read.end());
      out.changed.insert(own_[r].changed.begin(), own_[r].changed.end());
      for (const Id inner : calls_[r])
        if (seen.insert(component_[inner]).second) open.push_back(component_[inner]);
    }
  }
  return out;
}

Id Effects::operand(Id e, Id k) const { return t_.links[t_.expressions[e].first + k]; }

void Effects::touch(Id symbol, std::set<Id>& to) const {
  if (symbol == RMP_NONE) return;
  const rmp_code_symbol& s = t_.symbols[symbol];
  if (s.kind == RMP_SYMBOL_INPUT || s.kind == RMP_SYMBOL_OUTPUT) to.insert(RMP_NONE);
  // R_SPEED and its kin are what motions ask for.
  if (s.kind == RMP_SYMBOL_VARIABLE && s.scope != RMP_NONE &&
      t_.scopes[s.scope].kind == RMP_SCOPE_PREDEFINED)
    to.insert(RMP_NONE);
  if (s.kind == RMP_SYMBOL_VARIABLE || s.kind == RMP_SYMBOL_PARAMETER ||
      s.kind == RMP_SYMBOL_ROBOT || s.kind == RMP_SYMBOL_OUTPUT)
    to.insert(symbol);
}

void Effects::add_place(Id e, Touched& to) const {
  while ((t_.expressions[e].op == RMP_EXPR_FIELD || t_.expressions[e].op == RMP_EXPR_INDEX) &&
         t_.expressions[e].count > 0)
    e = operand(e, 0);
  if (t_.expressions[e].op == RMP_EXPR_SYMBOL) touch(t_.expressions[e].symbol, to.changed);
}

void Effects::add_expression(Id first, Touched& to, std::set<Id>& calls) const {
  std::vector<Id> open{first};
  while (!open.empty()) {
    const Id e = open.back();
    open.pop_back();
    if (e == RMP_NONE) continue;
    const rmp_code_expression& x = t_.expressions[e];
    if (x.constant != RMP_NONE && t_.types[x.type].kind <= RMP_TYPE_STRING) continue;
    if (x.op == RMP_EXPR_SYMBOL) touch(x.symbol, to.read);
    if (x.op == RMP_EXPR_CALL) {
      const Id r = t_.symbols[x.symbol].routine;
      calls.insert(r);
      for (Id k = 0; k < x.count && k < is_changed_[r].size(); ++k)
        if (is_changed_[r][k]) add_place(operand(e, k), to);
    }
    for (Id k = 0; k < x.count; ++k) open.push_back(operand(e, k));
  }
}

void Effects::add_routine(Id r, Touched& to, std::set<Id>& calls) const {
  each_statement(t_, t_.routines[r].body, [&](const rmp_code_statement& s) {
    for (const Id e : {s.a, s.b, s.c}) add_expression(e, to, calls);
    switch (s.op) {
      case RMP_STMT_ASSIGN: add_place(s.a, to); break;
      case RMP_STMT_FOR:
      case RMP_STMT_FOR_DOWN: touch(s.symbol, to.changed); break;
      case RMP_STMT_CALL:
        if (t_.expressions[s.a].op == RMP_EXPR_CALL) break;
        // READ, LIST_ADD and their kin change what they are given; WRITE is seen.
        to.changed.insert(RMP_NONE);
        for (Id k = 0; k < t_.expressions[s.a].count; ++k) add_place(operand(s.a, k), to);
        break;
      case RMP_STMT_IF:
      case RMP_STMT_ARM:
      case RMP_STMT_CASE:
      case RMP_STMT_WHILE:
      case RMP_STMT_REPEAT:
      case RMP_STMT_LOOP:
      case RMP_STMT_EXIT:
      case RMP_STMT_GOTO:
      case RMP_STMT_LABEL:
      case RMP_STMT_RETURN: break;
      case RMP_STMT_TEACH: touch(s.symbol, to.changed); [[fallthrough]];
      default: to.changed.insert(RMP_NONE); break;
    }
    if (s.motion == RMP_NONE) return;
    const rmp_code_motion& m = t_.motions[s.motion];
    each_value(t_, m, [&](Id e) { add_expression(e, to, calls); });
    if (m.action != RMP_NONE) calls.insert(m.action);
  });
}

bool Effects::changes(Id e) {
  if (!is_any_ || e == RMP_NONE) return false;
  if (changes_.size() <= e) changes_.resize(t_.expressions.size(), 0);
  if (changes_[e] != 0) return changes_[e] == 2;
  const rmp_code_expression& x = t_.expressions[e];
  bool out = false;
  if (x.constant == RMP_NONE || t_.types[x.type].kind > RMP_TYPE_STRING) {
    if (x.op == RMP_EXPR_CALL) {
      const Id r = t_.symbols[x.symbol].routine;
      out = changes_any_[component_[r]] ||
            std::count(is_changed_[r].begin(), is_changed_[r].end(), true) > 0;
    }
    for (Id k = 0; !out && k < x.count; ++k) out = changes(operand(e, k));
  }
  changes_[e] = out ? 2 : 1;
  return out;
}

Effects::Touched Effects::of(Id e) {
  Touched out;
  std::set<Id> calls;
  add_expression(e, out, calls);
  for (const Id r : calls) {
    const Touched& more = outlasting(r);
    out.read.insert(more.read.begin(), more.read.end());
    out.changed.insert(more.changed.begin(), more.changed.end());
  }
  return out;
}

bool Effects::is_reference(Id s) const {
  return s != RMP_NONE && t_.symbols[s].kind == RMP_SYMBOL_PARAMETER &&
         t_.symbols[s].mode != RMP_MODE_IN;
}

bool Effects::meet(const std::set<Id>& a, const std::set<Id>& b) const {
  for (const Id x : a) {
    if (b.contains(x)) return true;
    for (const Id y : b) {
      if (x == RMP_NONE || y == RMP_NONE) continue;
      const auto is_shared = [&](Id s) {
        return is_reference(s) || t_.symbols[s].routine == RMP_NONE;
      };
      if ((is_reference(x) && is_shared(y)) || (is_reference(y) && is_shared(x))) return true;
    }
  }
  return false;
}

bool Effects::depend(Id a, Id b) {
  if (a == RMP_NONE || b == RMP_NONE || (!changes(a) && !changes(b))) return false;
  const Touched x = of(a), y = of(b);
  return meet(x.changed, y.read) || meet(x.read, y.changed) || meet(x.changed, y.changed);
}

}  // namespace robomosp::program_post
