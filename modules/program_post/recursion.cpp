// SPDX-License-Identifier: Apache-2.0
#include "program_post/recursion.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

#include <robomosp/sdk/post_writer.h>

#include "program_post/components.h"
#include "program_post/rewriter.h"
#include "program_post/scalars.h"
#include "program_post/walk.h"

namespace robomosp::program_post {
namespace {

using Id = std::uint32_t;

/// What each routine calls and names, and which variables its parameters may stand for.
class Calls {
 public:
  explicit Calls(const ProgramTables& t) : t_(t) {
    all_.resize(t.routines.size());
    for (Id r = 0; r < all_.size(); ++r) add_block(t.routines[r].body, all_[r]);
    for (Id r = 0; r < all_.size(); ++r) {
      Of condition;
      add(t.routines[r].condition, condition);
      in_conditions_.insert(condition.routines.begin(), condition.routines.end());
      add(t.routines[r].condition, all_[r]);
      add(t.routines[r].priority, all_[r]);
    }
    for (const rmp_code_symbol& s : t.symbols)
      if (s.kind == RMP_SYMBOL_VARIABLE || s.kind == RMP_SYMBOL_CONSTANT)
        add(s.value, all_[s.routine == RMP_NONE ? 0 : s.routine]);
    by_callee_.resize(t.routines.size());
    for (Id r = 0; r < all_.size(); ++r)
      for (const Id e : all_[r].expressions)
        by_callee_[t.symbols[t.expressions[e].symbol].routine].emplace_back(r, e);
    find_roots();
  }
  struct Of {
    std::vector<Id> expressions;  ///< its calls
    std::set<Id> routines;        ///< that it calls, at the end of motions, too
    std::set<Id> actions;         ///< those at the end of motions
    std::set<Id> named;           ///< variables of the program
  };
  [[nodiscard]] const Of& of(Id r) const { return all_[r]; }
  /// Routines that conditions of interrupts call.
  [[nodiscard]] const std::set<Id>& in_conditions() const { return in_conditions_; }
  /// Calls of a routine: who calls, the expression.
  [[nodiscard]] const std::vector<std::pair<Id, Id>>& of_callee(Id r) const {
    return by_callee_[r];
  }
  /// With all that they call in turn.
  [[nodiscard]] std::vector<bool> reached_from(Id r) const {
    std::vector<bool> seen(all_.size(), false);
    std::vector<Id> open(all_[r].routines.begin(), all_[r].routines.end());
    while (!open.empty()) {
      const Id i = open.back();
      open.pop_back();
      if (seen[i]) continue;
      seen[i] = true;
      open.insert(open.end(), all_[i].routines.begin(), all_[i].routines.end());
    }
    return seen;
  }
  [[nodiscard]] Id root_of(Id e) const {
    while (t_.expressions[e].op == RMP_EXPR_FIELD || t_.expressions[e].op == RMP_EXPR_INDEX)
      e = t_.links[t_.expressions[e].first];
    return t_.expressions[e].op == RMP_EXPR_SYMBOL ? t_.expressions[e].symbol : RMP_NONE;
  }
  [[nodiscard]] bool is_reference(Id s) const {
    return t_.symbols[s].kind == RMP_SYMBOL_PARAMETER && t_.symbols[s].mode != RMP_MODE_IN;
  }
  [[nodiscard]] bool is_of_program(Id s) const { return t_.symbols[s].routine == RMP_NONE; }
  /// Variables of the program that a place may be in.
  [[nodiscard]] std::set<Id> globals(Id root) const {
    std::set<Id> out;
    if (root == RMP_NONE) return out;
    if (is_of_program(root)) out.insert(root);
    if (const auto it = roots_.find(root); it != roots_.end())
      for (const Id s : it->second)
        if (is_of_program(s)) out.insert(s);
    return out;
  }
  /// Whether two places of one routine may be in the same variable.
  [[nodiscard]] bool may_meet(Id a, Id b) const {
    if (a == RMP_NONE || b == RMP_NONE) return false;
    if (a == b || pairs_.contains(std::minmax(a, b))) return true;
    const auto stands_for = [&](Id p, Id s) {
      const auto it = roots_.find(p);
      return is_of_program(s) && it != roots_.end() && it->second.contains(s);
    };
    return stands_for(a, b) || stands_for(b, a);
  }

 private:
  void add(Id first, Of& to) {
    std::vector<Id> open{first};
    while (!open.empty()) {
      const Id e = open.back();
      open.pop_back();
      if (e == RMP_NONE) continue;
      const rmp_code_expression& x = t_.expressions[e];
      if (x.op == RMP_EXPR_SYMBOL) name(x.symbol, to);
      if (x.op == RMP_EXPR_CALL) {
        to.expressions.push_back(e);
        to.routines.insert(t_.symbols[x.symbol].routine);
      }
      for (Id k = 0; k < x.count; ++k) open.push_back(t_.links[x.first + k]);
    }
  }
  void name(Id s, Of& to) const {
    if (s == RMP_NONE || !is_of_program(s)) return;
    const auto kind = t_.symbols[s].kind;
    if (kind == RMP_SYMBOL_VARIABLE || kind == RMP_SYMBOL_ROBOT) to.named.insert(s);
  }
  void add_block(Id first, Of& to) {
    each_statement(t_, first, [&](const rmp_code_statement& s) {
      for (const Id e : {s.a, s.b, s.c}) add(e, to);
      if (s.op != RMP_STMT_GOTO && s.op != RMP_STMT_LABEL) name(s.symbol, to);
      if (s.motion == RMP_NONE) return;
      const rmp_code_motion& m = t_.motions[s.motion];
      each_value(t_, m, [&](Id e) { add(e, to); });
      if (m.action == RMP_NONE) return;
      to.actions.insert(m.action);
      to.routines.insert(m.action);
    });
  }
  /// By what they are given at the calls of all routines, until nothing more comes.
  void find_roots() {
    for (bool grows = true; grows;) {
      grows = false;
      for (const Of& r : all_)
        for (const Id e : r.expressions) grows = add_call(e) || grows;
    }
  }
  bool add_call(Id e) {
    const rmp_code_expression& x = t_.expressions[e];
    const Id first = t_.routines[t_.symbols[x.symbol].routine].first_parameter;
    bool grows = false;
    for (Id k = 0; k < x.count; ++k) {
      if (!is_reference(first + k)) continue;
      const Id root = root_of(t_.links[x.first + k]);
      if (root == RMP_NONE) continue;
      std::set<Id>& to = roots_[first + k];
      const std::size_t before = to.size();
      if (is_reference(root)) {
        const std::set<Id> more = roots_[root];
        to.insert(more.begin(), more.end());
      } else {
        to.insert(root);
      }
      grows = grows || to.size() != before;
      for (Id j = 0; j < k; ++j)
        if (is_reference(first + j) && may_meet(root_of(t_.links[x.first + j]), root))
          grows = pairs_.insert({first + j, first + k}).second || grows;
    }
    return grows;
  }

  const ProgramTables& t_;
  std::vector<Of> all_;
  std::set<Id> in_conditions_;
  std::vector<std::vector<std::pair<Id, Id>>> by_callee_;
  std::map<Id, std::set<Id>> roots_;   ///< by parameter: variables, not parameters that change them
  std::set<std::pair<Id, Id>> pairs_;  ///< parameters of one routine, the first one first
};

class Loops final : public Rewriter {
 public:
  Loops(ProgramTables& t, const PostCapabilities& caps, std::size_t most,
        std::vector<Remark>& remarks)
      : Rewriter(t),
        title_(caps.title),
        features_(caps.features),
        most_(static_cast<std::int64_t>(most)),
        remarks_(remarks) {}

  void run() {
    std::vector<Id> all;
    for (Id r = 0; r < t_.routines.size(); ++r)
      if (t_.routines[r].is_recursive != 0) all.push_back(r);
    const bool has_actions = std::any_of(t_.motions.begin(), t_.motions.end(),
                                         [](const auto& m) { return m.action != RMP_NONE; });
    if ((all.empty() && !has_actions) || has(kPostRecursion)) return;
    if (!all.empty() && !can_be_done(all)) return;
    find_own_symbols();
    {
      const Calls calls(t_);
      if (!are_actions_fine(calls)) return;
      find_groups(calls, all);
      std::erase_if(groups_, [&](const std::vector<Id>& g) { return !is_fine(g, calls); });
    }
    if (groups_.empty()) return;
    make_room();
    to_statements(t_, title_, inner_, remarks_);
    find_own_symbols();
    std::vector<Group> all_groups;
    for (const auto& g : groups_) all_groups.push_back(take_variables(g));
    for (rmp_code_expression& x : t_.expressions)
      if (x.op == RMP_EXPR_SYMBOL)
        if (const auto it = own_.find(x.symbol); it != own_.end()) x.symbol = it->second;
    for (const Group& g : all_groups) rewrite(g);
  }

 private:
  static constexpr int kMost = 3;  ///< steps within each other

  /// How a step ends.
  enum class End { none, jump, branch, choose, call, leave };
  /// Statements that are done one behind the other.
  struct Step {
    Chain code;
    End end = End::none;
    Id condition = RMP_NONE;  ///< of a branch; of a choice its statement, CASE
    std::vector<std::size_t> to;
    Id routine = RMP_NONE;  ///< whose it is
    Id callee = RMP_NONE;
    rmp_span span{};
    std::size_t ways = 0;      ///< that lead to it
    std::size_t number = 0;    ///< there; 0 = none yet
    bool is_numbered = false;  ///< begins behind a call, or with one
    std::set<Id> live;         ///< what it may read before it is given a value
  };

  /// What calls have to find again. One for all loops of a process, since one may stand within
  /// another.
  struct Stack {
    Id depth = RMP_NONE, back = RMP_NONE;
    std::map<Id, std::vector<Id>> columns;  ///< by type
  };
  /// Routines that become one loop, and its variables.
  struct Group {
    std::vector<Id> routines;
    Id driver = 0, at = 0;
    Stack* stack = nullptr;
  };

  /// Variables, constants and parameters by routine.
  void find_own_symbols() {
    own_symbols_.assign(t_.routines.size(), {});
    for (Id s = 0; s < t_.symbols.size(); ++s) {
      const rmp_code_symbol& x = t_.symbols[s];
      if (x.routine != RMP_NONE &&
          (x.kind == RMP_SYMBOL_VARIABLE || x.kind == RMP_SYMBOL_CONSTANT ||
           x.kind == RMP_SYMBOL_PARAMETER))
        own_symbols_[x.routine].push_back(s);
    }
  }
  [[nodiscard]] bool has(std::uint64_t feature) const { return (features_ & feature) == feature; }
  void fault(const rmp_span& span, std::string message, std::string hint) {
    remarks_.push_back({RMP_FAULT_ERROR, span, std::move(message), std::move(hint)});
  }
  [[nodiscard]] std::string name_of(Id r) const { return t_.symbols[t_.routines[r].symbol].name; }

  // ---- whether it can be done ----
  bool can_be_done(const std::vector<Id>& all) {
    static constexpr std::pair<std::uint64_t, const char*> kNeeds[] = {
        {kPostProcedures, "procedures"},
        {kPostIf, "IF"},
        {kPostWhile, "WHILE"},
        {kPostIntegers, "variables"},
        {kPostArrays, "arrays"}};
    std::string lacks;
    for (const auto& [feature, what] : kNeeds)
      if (!has(feature)) lacks += (lacks.empty() ? "" : ", ") + std::string(what);
    if (lacks.empty()) return true;
    for (const Id r : all)
      fault(t_.routines[r].span,
            title_ + " has no recursive routines, such as " + name_of(r) +
                " does, and lacks the features needed for a stack (" + lacks + ")",
            "Post the flattened program (form = \"flat\"), or write it with a loop.");
    return false;
  }
  void find_groups(const Calls& calls, const std::vector<Id>& all) {
    inner_.group.assign(t_.routines.size(), RMP_NONE);
    const std::vector<Id> of = components(
        t_.routines.size(), [&](Id r) -> const auto& { return calls.of(r).routines; });
    std::map<Id, Id> group_of;
    for (const Id r : all) {
      const auto [at, is_new] = group_of.try_emplace(of[r], static_cast<Id>(groups_.size()));
      if (is_new) groups_.emplace_back();
      groups_[at->second].push_back(r);
      inner_.group[r] = at->second;
    }
  }
  /// Whether values of a type are copied.
  [[nodiscard]] bool is_plain(Id type) const {
    const rmp_code_type& x = t_.types[type];
    if (x.kind == RMP_TYPE_ARRAY) return is_plain(x.element);
    if (x.kind != RMP_TYPE_RECORD) return x.kind <= RMP_TYPE_STRING && x.kind != RMP_TYPE_VOID;
    for (Id k = 0; k < x.field_count; ++k)
      if (!is_plain(t_.fields[x.first_field + k].type)) return false;
    return true;
  }
  /// No motion calls a routine at its end that leads back to where the motion is.
  bool are_actions_fine(const Calls& calls) {
    bool is_fine = true;
    for (Id r = 0; r < t_.routines.size(); ++r)
      for (const Id a : calls.of(r).actions)
        if (a == r || calls.reached_from(a)[r]) {
          is_fine = false;
          fault(t_.routines[r].span,
                title_ + " has no recursive routines, and " + name_of(r) +
                    " does so through the procedure called at the end of a motion (DO): " +
                    name_of(a),
                "Call it in a statement after the motion.");
        }
    return is_fine;
  }
  /// A signal, or a system variable.
  [[nodiscard]] bool is_seen(Id s) const {
    const rmp_code_symbol& x = t_.symbols[s];
    if (x.kind == RMP_SYMBOL_INPUT || x.kind == RMP_SYMBOL_OUTPUT) return true;
    return x.scope != RMP_NONE && t_.scopes[x.scope].kind == RMP_SCOPE_PREDEFINED;
  }
  bool is_fine(const std::vector<Id>& group, const Calls& calls) {
    const std::size_t before = remarks_.size();
    const Id id = inner_.group[group[0]];
    const std::string begins = title_ + " has no recursive routines";
    // Each of them leads to all others.
    const std::vector<bool> within = calls.reached_from(group[0]);
    // Who calls it.
    std::vector<bool> beside(t_.routines.size(), false);
    std::size_t roots = 0;
    Id root_of_all = 0;
    for (Id r = 0; r < t_.routines.size(); ++r) {
      const auto kind = t_.routines[r].kind;
      if (kind == RMP_ROUTINE_PROCEDURE || kind == RMP_ROUTINE_FUNCTION) continue;
      const std::vector<bool> reached = calls.reached_from(r);
      if (reached[group[0]]) {
        ++roots;
        root_of_all = r;
        continue;
      }
      beside[r] = true;
      for (std::size_t k = 0; k < reached.size(); ++k) beside[k] = beside[k] || reached[k];
    }
    if (roots > 1)
      fault(t_.routines[group[0]].span,
            begins + ", and " + name_of(group[0]) +
                ", which does, is called by several processes or interrupts",
            "Write another routine for each of them, or use a loop.");
    for (const Id c : calls.in_conditions())
      if (inner_.group[c] == id || calls.reached_from(c)[group[0]])
        fault(t_.routines[group[0]].span,
              begins + ", and " + name_of(group[0]) +
                  ", which does, is called by the condition of an interrupt",
              "Test a signal or a variable there.");
    for (const Id r : group) {
      for (const Id s : own_symbols_[r])
        if (!is_plain(t_.symbols[s].type))
          fault(t_.symbols[s].span,
                begins + ", and " + t_.symbols[s].name + " of " + name_of(r) +
                    " has a type that cannot be saved during recursion",
                "Declare it in the program, or use an ARRAY and a count.");
    }
    // What it changes by a parameter is a copy while it runs.
    std::set<Id> named, elsewhere;
    for (Id r = 0; r < t_.routines.size(); ++r) {
      const std::set<Id>& of = calls.of(r).named;
      if (within[r]) named.insert(of.begin(), of.end());
      if (beside[r]) elsewhere.insert(of.begin(), of.end());
    }
    for (const Id to : group)
      for (const auto& [from, e] : calls.of_callee(to)) {
        const rmp_code_expression& x = t_.expressions[e];
        const Id first = t_.routines[to].first_parameter;
        for (Id k = 0; k < x.count; ++k) {
          if (!calls.is_reference(first + k)) continue;
          const Id root = calls.root_of(operand(e, k));
          if (root == RMP_NONE) continue;
          // Where its own parameters are passed on, the call from elsewhere tells.
          const auto is_passed_on = [&](Id place) {
            return place != RMP_NONE && inner_.group[from] == id && calls.is_reference(place);
          };
          std::string how;
          for (Id j = 0; j < k; ++j) {
            const Id other = calls.root_of(operand(e, j));
            if (calls.is_reference(first + j) && calls.may_meet(other, root) &&
                (other == root || !is_passed_on(other) || !is_passed_on(root)))
              how = " by two of them";
          }
          if (is_seen(root)) how = ", which is visible to others meanwhile";
          if (!is_passed_on(root))
            for (const Id g : calls.globals(root)) {
              if (how.empty() && named.contains(g)) how = " and also by its name";
              if (how.empty() && elsewhere.contains(g))
                how = ", which another process or an interrupt reads or changes meanwhile";
            }
          if (!how.empty())
            fault(x.span,
                  begins + ", what " + name_of(to) +
                      " changes by a parameter is a copy, and it "
                      "reaches " +
                      t_.symbols[root].name + how,
                  "Pass another variable, and copy it back after the call.");
        }
      }
    roots_[group[0]] = root_of_all;
    if (remarks_.size() == before) return true;
    for (const Id r : group) inner_.group[r] = RMP_NONE;
    return false;
  }

  // ---- variables ----
  [[nodiscard]] Id place_of(Id r) const { return has(kPostLocals) ? r : 0; }
  Id copy_of(Id parameter, const std::string& name, Id routine) {
    return new_variable(t_.symbols[parameter].type, name, routine, t_.symbols[parameter].span);
  }
  /// Variables by which calls take and give values.
  void make_room() {
    // Numbers of groups are those of the list that is left.
    for (std::size_t g = 0; g < groups_.size(); ++g)
      for (const Id r : groups_[g]) {
        inner_.group[r] = static_cast<Id>(g);
        const rmp_code_routine x = t_.routines[r];
        for (Id k = 0; k < x.parameter_count; ++k) {
          const Id p = x.first_parameter + k;
          inner_.sent[p] = copy_of(p, name_of(r) + "_" + t_.symbols[p].name, 0);
        }
        if (x.kind == RMP_ROUTINE_FUNCTION)
          inner_.result[r] = new_variable(x.result, name_of(r) + "_result", 0, x.span);
      }
  }
  Id counter(std::size_t n) {
    while (counters_.size() <= n)
      counters_.push_back(new_variable(RMP_TYPE_INT, "k", place_of(driver_), span_));
    return counters_[n];
  }
  Id copy(Id to, Id from, const rmp_span& span) {
    return copied(to, from, span, [&](std::size_t n) { return counter(n); });
  }
  Id assign(Id s, Id value, const rmp_span& span) {
    return assignment(variable(s, span), value, span);
  }
  Id integer(std::int64_t v, const rmp_span& span) { return literal(t_.integer(v), span); }
  Id element(Id array, Id index, const rmp_span& span) {
    return expression(RMP_EXPR_INDEX, t_.types[t_.symbols[array].type].element, span,
                      {variable(array, span), variable(index, span)});
  }

  void rewrite(const Group& g) {
    const std::vector<Id>& group = g.routines;
    group_ = inner_.group[group[0]];
    span_ = t_.routines[group[0]].span;
    is_single_ = group.size() == 1;
    driver_ = g.driver;
    stack_ = g.stack;
    depth_ = stack_->depth;
    back_ = stack_->back;
    at_ = g.at;
    steps_.clear();
    counters_.clear();
    columns_of_.clear();
    used_columns_.clear();
    std::map<Id, std::size_t> begins;
    for (const Id r : group) begins[r] = take_apart(r);
    find_live();
    for (const Id r : group) give_zeros(r, begins.at(r));
    count_ways(begins);
    write(group, begins);
    for (const Id r : group) {
      t_.routines[r].is_recursive = 0;
      remarks_.push_back({RMP_FAULT_NOTE, t_.routines[r].span,
                          title_ + " has no recursive routines, such as " + name_of(r) +
                              " does: it is a loop with a stack there, for at most " +
                              std::to_string(most_) + " nested calls",
                          "The option recursion_depth of the controller's record sets this number; "
                          "one more call ends the program."});
    }
  }
  Id new_routine(const std::string& name, const rmp_code_routine& like) {
    rmp_code_scope scope = t_.scopes[like.scope];
    scope.name = t_.keep(name);
    t_.scopes.push_back(scope);
    rmp_code_symbol s{};
    s.kind = RMP_SYMBOL_ROUTINE;
    s.type = RMP_TYPE_VOID;
    s.name = t_.keep(name);
    s.scope = t_.routines[0].scope;
    s.routine = static_cast<Id>(t_.routines.size());
    s.value = s.constant = RMP_NONE;
    s.span = like.span;
    rmp_code_routine r{};
    r.kind = RMP_ROUTINE_PROCEDURE;
    r.symbol = static_cast<Id>(t_.symbols.size());
    r.scope = static_cast<Id>(t_.scopes.size() - 1);
    r.result = RMP_TYPE_VOID;
    r.body = r.priority = r.condition = RMP_NONE;
    r.span = like.span;
    t_.symbols.push_back(s);
    t_.routines.push_back(r);
    inner_.group.push_back(RMP_NONE);
    return s.routine;
  }
  /// Room for a value of each call.
  Id new_stack(Id element, const std::string& name) {
    rmp_code_type type{};
    type.kind = RMP_TYPE_ARRAY;
    type.role = RMP_ROLE_NONE;
    type.name = "";
    type.element = element;
    type.lower = 1;
    type.upper = static_cast<std::int32_t>(most_);
    type.span = span_;
    const auto t = static_cast<Id>(t_.types.size());
    t_.types.push_back(type);
    return new_variable(t, name, 0, span_);
  }
  Stack& stack_of(Id root) {
    Stack& s = stacks_[root];
    if (s.depth != RMP_NONE) return s;
    s.depth = new_variable(RMP_TYPE_INT, "stack_depth", 0, span_);
    s.back = new_stack(RMP_TYPE_INT, "stack_back");
    if (root == 0) return s;
    // A process that was cancelled within a loop begins anew.
    const rmp_span span = t_.routines[root].span;
    Chain body;
    append(body, assign(s.depth, integer(0, span), span));
    append(body, t_.routines[root].body);
    t_.routines[root].body = body.head;
    return s;
  }
  /// Parameters get variables of their own; what a routine has stands with the loop.
  Group take_variables(const std::vector<Id>& group) {
    Group g;
    g.routines = group;
    const std::string name = name_of(group[0]);
    const rmp_code_routine first = t_.routines[group[0]];
    span_ = first.span;
    const bool is_single = group.size() == 1;
    g.driver = is_single ? group[0] : new_routine(name + "_loop", first);
    const Id to = place_of(g.driver);
    g.at = new_variable(RMP_TYPE_INT, name + "_step", is_single ? to : 0, span_);
    g.stack = &stack_of(roots_.at(group[0]));
    for (const Id r : group)
      for (const Id s : own_symbols_[r]) {
        const auto kind = t_.symbols[s].kind;
        if (kind == RMP_SYMBOL_PARAMETER) {
          own_[s] = copy_of(s, t_.symbols[s].name, to);
          owner_[own_[s]] = r;
          continue;
        }
        if (kind == RMP_SYMBOL_VARIABLE) {
          owner_[s] = r;
          locals_[r].push_back(s);
        }
        t_.symbols[s].routine = to == 0 ? RMP_NONE : to;
        t_.symbols[s].scope = t_.routines[to].scope;
      }
    return g;
  }

  // ---- steps ----
  std::size_t new_step(Id r) {
    steps_.emplace_back().routine = r;
    return steps_.size() - 1;
  }
  void add(Id s) { append(steps_[now_].code, s); }
  void jump(std::size_t to) {
    steps_[now_].end = End::jump;
    steps_[now_].to = {to};
  }
  void branch(Id condition, std::size_t yes, std::size_t no, const rmp_span& span) {
    Step& s = steps_[now_];
    s.end = End::branch;
    s.condition = condition;
    s.to = {yes, no};
    s.span = span;
  }
  [[nodiscard]] bool leads_back(const rmp_code_statement& s) const {
    return s.op == RMP_STMT_CALL && ex(s.a).op == RMP_EXPR_CALL &&
           inner_.group[t_.symbols[ex(s.a).symbol].routine] == group_;
  }
  /// Whether a statement leaves the place where it stands: 1 = for a label, a call or what called
  /// the routine, 2 = for the end of the loop around it.
  std::uint8_t leaves(Id i) {
    if (leaves_.size() <= i) leaves_.resize(t_.statements.size(), 4);
    if (leaves_[i] != 4) return leaves_[i];
    std::uint8_t out = 0;
    switch (st(i).op) {
      case RMP_STMT_CALL: out = leads_back(st(i)) ? 1 : 0; break;
      case RMP_STMT_RETURN:
      case RMP_STMT_GOTO:
      case RMP_STMT_LABEL: out = 1; break;
      case RMP_STMT_EXIT: out = 2; break;
      default: {
        for (Id k = st(i).body; k != RMP_NONE; k = st(k).next)
          out = static_cast<std::uint8_t>(out | leaves(k));
        const auto op = st(i).op;
        if (op != RMP_STMT_IF && op != RMP_STMT_CASE && op != RMP_STMT_ARM)
          out = static_cast<std::uint8_t>(out & 1U);
      }
    }
    return leaves_[i] = out;
  }
  /// The routine as steps; gives the first: parameters, then the rest.
  std::size_t take_apart(Id r) {
    routine_ = r;
    labels_.clear();
    const rmp_code_routine x = t_.routines[r];
    const std::size_t begin = now_ = new_step(r);
    for (Id k = 0; k < x.parameter_count; ++k) {
      const Id p = x.first_parameter + k;
      add(copy(variable(own_.at(p), x.span), variable(inner_.sent.at(p), x.span), x.span));
    }
    const std::size_t body = new_step(r);
    jump(body);
    now_ = body;
    for (const Id s : locals_[r]) {
      const Id value = std::exchange(t_.symbols[s].value, RMP_NONE);
      if (value == RMP_NONE) continue;
      is_given_.insert(s);
      add(copy(variable(s, t_.symbols[s].span), value, t_.symbols[s].span));
    }
    lower(x.body, 0);
    leave(x.span);
    return begin;
  }
  void leave(const rmp_span& span) {
    const rmp_code_routine& x = t_.routines[routine_];
    for (Id k = 0; k < x.parameter_count; ++k) {
      const Id p = t_.routines[routine_].first_parameter + k;
      if (t_.symbols[p].mode != RMP_MODE_IN)
        add(copy(variable(inner_.sent.at(p), span), variable(own_.at(p), span), span));
    }
    steps_[now_].end = End::leave;
    steps_[now_].span = span;
  }
  void lower(Id first, std::size_t behind_loop) {
    for (Id i = first; i != RMP_NONE;) {
      const Id next = std::exchange(st(i).next, RMP_NONE);
      if (leaves(i) == 0) add(i);
      else one(i, behind_loop);
      i = next;
    }
  }
  /// What stands behind a jump is not come to but by a label.
  void nowhere() { now_ = new_step(routine_); }
  std::size_t step_of(Id label) {
    const auto [it, is_new] = labels_.try_emplace(label, 0);
    if (is_new) it->second = new_step(routine_);
    return it->second;
  }
  void one(Id i, std::size_t behind_loop) {
    const rmp_code_statement s = st(i);
    switch (s.op) {
      case RMP_STMT_CALL: {
        const std::size_t behind = new_step(routine_);
        Step& x = steps_[now_];
        x.end = End::call;
        x.callee = t_.symbols[ex(s.a).symbol].routine;
        x.to = {behind};
        x.span = s.span;
        steps_[behind].is_numbered = true;
        steps_[behind].span = s.span;
        now_ = behind;
        return;
      }
      case RMP_STMT_RETURN:
        if (s.a != RMP_NONE) add(copy(variable(inner_.result.at(routine_), s.span), s.a, s.span));
        leave(s.span);
        return nowhere();
      case RMP_STMT_EXIT: jump(behind_loop); return nowhere();
      case RMP_STMT_GOTO: jump(step_of(s.symbol)); return nowhere();
      case RMP_STMT_LABEL: {
        const std::size_t here = step_of(s.symbol);
        jump(here);
        now_ = here;
        return;
      }
      case RMP_STMT_IF: {
        const std::size_t behind = new_step(routine_);
        for (Id arm = s.body; arm != RMP_NONE; arm = st(arm).next) {
          const rmp_code_statement a = st(arm);
          if (a.a == RMP_NONE) {
            lower(a.body, behind_loop);
            break;
          }
          const std::size_t body = new_step(routine_), otherwise = new_step(routine_);
          branch(a.a, body, otherwise, a.span);
          now_ = body;
          lower(a.body, behind_loop);
          jump(behind);
          now_ = otherwise;
        }
        jump(behind);
        now_ = behind;
        return;
      }
      case RMP_STMT_CASE: {
        const std::size_t behind = new_step(routine_), here = now_;
        std::vector<std::size_t> to;
        for (Id arm = s.body; arm != RMP_NONE; arm = st(arm).next) {
          to.push_back(new_step(routine_));
          now_ = to.back();
          const Id body = std::exchange(st(arm).body, RMP_NONE);
          lower(body, behind_loop);
          jump(behind);
        }
        to.push_back(behind);
        steps_[here].end = End::choose;
        steps_[here].condition = i;
        steps_[here].to = std::move(to);
        steps_[here].span = s.span;
        now_ = behind;
        return;
      }
      case RMP_STMT_WHILE:
      case RMP_STMT_REPEAT:
      case RMP_STMT_LOOP: {
        const std::size_t again = new_step(routine_), behind = new_step(routine_);
        jump(again);
        now_ = again;
        if (s.op == RMP_STMT_WHILE) {
          const std::size_t body = new_step(routine_);
          branch(s.a, body, behind, s.span);
          now_ = body;
        }
        lower(s.body, behind);
        if (s.op == RMP_STMT_REPEAT) branch(s.a, behind, again, s.span);
        else jump(again);
        now_ = behind;
        return;
      }
      case RMP_STMT_FOR:
      case RMP_STMT_FOR_DOWN: for_loop(s); return;
      default: add(i); return;  // there are no others that have statements within
    }
  }
  /// A value that is computed before the loop.
  Id held(Id e, const char* name, const rmp_span& span) {
    if (e == RMP_NONE || is_known(e)) return e;
    const Id v = new_variable(ex(e).type, name, place_of(driver_), span);
    owner_[v] = routine_;
    add(assign(v, e, span));
    return variable(v, span);
  }
  /// v := from; IF v > to, behind; body: ...; IF to - v < step, behind; v := v + step; body.
  void for_loop(const rmp_code_statement& s) {
    const bool is_down = s.op == RMP_STMT_FOR_DOWN,
               is_known_step = s.c == RMP_NONE || is_known(s.c);
    const Id type = t_.symbols[s.symbol].type;
    const auto own = own_.find(s.symbol);
    const Id v = own == own_.end() ? s.symbol : own->second;
    const Id to = held(s.b, "last", s.span);
    Id by = held(s.c, "step", s.span);
    if (by == RMP_NONE) by = type == RMP_TYPE_REAL ? real(1, s.span) : integer(1, s.span);
    add(assign(v, s.a, s.span));
    const std::size_t body = new_step(routine_), more = new_step(routine_);
    const std::size_t behind = new_step(routine_);
    const auto here = [&] { return variable(v, s.span); };
    const auto is = [&](std::uint32_t op, Id a, Id b) {
      return expression(op, RMP_TYPE_BOOL, s.span, {a, b});
    };
    const auto next = [&] {
      return expression(is_down ? RMP_EXPR_SUBTRACT : RMP_EXPR_ADD, type, s.span, {here(), by});
    };
    // Which way a computed step goes is known when it runs; 0 goes nowhere.
    const auto goes_on = [&](Id at_up, Id at_down) {
      const Id zero = ex(by).type == RMP_TYPE_REAL ? real(0, s.span) : integer(0, s.span);
      const Id up = is(is_down ? RMP_EXPR_LESS : RMP_EXPR_GREATER, by, zero);
      const Id a = is(RMP_EXPR_AND, up, is(RMP_EXPR_LESS_EQUAL, at_up, to));
      const Id down = is(is_down ? RMP_EXPR_GREATER : RMP_EXPR_LESS, by, zero);
      const Id b = is(RMP_EXPR_AND, down, is(RMP_EXPR_GREATER_EQUAL, at_down, to));
      return is(RMP_EXPR_OR, a, b);
    };
    if (is_known_step) {
      branch(is(is_down ? RMP_EXPR_LESS : RMP_EXPR_GREATER, here(), to), behind, body, s.span);
    } else {
      branch(goes_on(here(), here()), body, behind, s.span);
      remarks_.push_back({RMP_FAULT_NOTE, s.span,
                          "a STEP of 0 at run time skips the loop on the controller, while the "
                          "interpreter raises a fault",
                          ""});
    }
    now_ = body;
    lower(s.body, behind);
    if (is_known_step) {
      const Id rest = is_down ? expression(RMP_EXPR_SUBTRACT, type, s.span, {here(), to})
                              : expression(RMP_EXPR_SUBTRACT, type, s.span, {to, here()});
      branch(is(RMP_EXPR_LESS, rest, by), behind, more, s.span);
    } else {
      branch(goes_on(next(), next()), more, behind, s.span);
    }
    now_ = more;
    add(assign(v, next(), s.span));
    jump(body);
    now_ = behind;
  }

  // ---- what has to be kept over a call ----
  void read(Id first, std::set<Id>& to) const {
    std::vector<Id> open{first};
    while (!open.empty()) {
      const Id e = open.back();
      open.pop_back();
      if (e == RMP_NONE) continue;
      if (ex(e).op == RMP_EXPR_SYMBOL && owner_.contains(ex(e).symbol)) to.insert(ex(e).symbol);
      for (Id k = 0; k < ex(e).count; ++k) open.push_back(operand(e, k));
    }
  }
  void read_own(const rmp_code_statement& s, std::set<Id>& to) const {
    for (const Id e : {s.a, s.b, s.c}) read(e, to);
    if (s.symbol != RMP_NONE && owner_.contains(s.symbol)) to.insert(s.symbol);
    if (s.motion != RMP_NONE) each_value(t_, t_.motions[s.motion], [&](Id e) { read(e, to); });
  }
  /// What is read from a block on, where `live` is what is read behind it.
  void before(Id first, std::set<Id>& live) const {
    std::vector<Id> all;
    for (Id i = first; i != RMP_NONE; i = t_.statements[i].next) all.push_back(i);
    for (; !all.empty(); all.pop_back()) {
      const rmp_code_statement& s = t_.statements[all.back()];
      if (s.op == RMP_STMT_ASSIGN && ex(s.a).op == RMP_EXPR_SYMBOL) {
        live.erase(ex(s.a).symbol);
        read(s.b, live);
      } else if (s.op == RMP_STMT_IF || s.op == RMP_STMT_CASE) {
        std::set<Id> any;
        bool is_all = false;
        for (Id arm = s.body; arm != RMP_NONE; arm = t_.statements[arm].next) {
          const rmp_code_statement& a = t_.statements[arm];
          std::set<Id> one = live;
          before(a.body, one);
          any.insert(one.begin(), one.end());
          read(a.a, any);
          is_all = is_all || (a.a == RMP_NONE && a.count == 0);
        }
        if (is_all) live = std::move(any);
        else live.insert(any.begin(), any.end());
        read(s.a, live);
      } else if (s.op == RMP_STMT_FOR || s.op == RMP_STMT_FOR_DOWN) {
        each_statement(t_, s.body, [&](const rmp_code_statement& x) { read_own(x, live); });
        live.erase(s.symbol);
        for (const Id e : {s.a, s.b, s.c}) read(e, live);
      } else {
        read_own(s, live);
        each_statement(t_, s.body, [&](const rmp_code_statement& x) { read_own(x, live); });
      }
    }
  }
  void find_live() {
    for (bool grows = true; grows;) {
      grows = false;
      for (std::size_t k = steps_.size(); k-- > 0;) {
        Step& s = steps_[k];
        std::set<Id> live;
        for (const std::size_t to : s.to)
          live.insert(steps_[to].live.begin(), steps_[to].live.end());
        if (s.end == End::branch) read(s.condition, live);
        if (s.end == End::choose) read(st(s.condition).a, live);
        before(s.code.head, live);
        if (live.size() == s.live.size()) continue;
        s.live = std::move(live);
        grows = true;
      }
    }
  }
  /// Variables without a value are zero each time that a routine begins.
  void give_zeros(Id r, std::size_t begin) {
    now_ = begin;
    const std::set<Id> live = steps_[steps_[begin].to[0]].live;
    for (const Id s : locals_[r])
      if (live.contains(s) && !is_given_.contains(s)) {
        const rmp_span span = t_.symbols[s].span;
        zero(variable(s, span), span, 0);
      }
  }
  void zero(Id place, const rmp_span& span, std::size_t within) {
    const Id type = ex(place).type;
    const rmp_code_type x = t_.types[type];
    if (x.kind == RMP_TYPE_ARRAY) {
      const Id n = counter(within);
      const Id each = expression(RMP_EXPR_INDEX, x.element, span, {place, variable(n, span)});
      const Chain outer = std::exchange(steps_[now_].code, Chain{});
      zero(each, span, within + 1);
      const Chain body = std::exchange(steps_[now_].code, outer);
      add(for_each(n, x, body.head, span));
    } else if (x.kind == RMP_TYPE_RECORD && x.role == RMP_ROLE_NONE) {
      for (Id k = 0; k < x.field_count; ++k)
        zero(expression(RMP_EXPR_FIELD, t_.fields[x.first_field + k].type, span, {place}, k), span,
             within);
    } else if (x.kind == RMP_TYPE_RECORD) {
      // A variable that nobody assigns is what the target begins with.
      const auto [it, is_new] = zeros_.try_emplace(type, 0);
      if (is_new) it->second = new_variable(type, "zero", 0, span);
      add(assignment(place, variable(it->second, span), span));
    } else {
      const Id value = x.kind == RMP_TYPE_REAL     ? real(0, span)
                       : x.kind == RMP_TYPE_STRING ? text("", span)
                                                   : literal(t_.integer(0, type), span);
      add(assignment(place, value, span));
    }
  }
  /// The room where a variable is kept: routines share it, since a call is of one of them.
  Id column(Id variable) {
    const auto it = columns_of_.find(variable);
    if (it != columns_of_.end()) return it->second;
    const Id r = owner_.at(variable), type = t_.symbols[variable].type;
    std::vector<Id>& all = stack_->columns[type];
    const std::size_t used = used_columns_[{r, type}]++;
    if (used == all.size()) all.push_back(new_stack(type, "stack_" + std::to_string(++stacked_)));
    return columns_of_[variable] = all[used];
  }

  // ---- the loop ----
  void count_ways(const std::map<Id, std::size_t>& begins) {
    std::vector<bool> seen(steps_.size(), false);
    std::vector<std::size_t> open;
    for (const auto& [r, begin] : begins) {
      open.push_back(begin);
      steps_[begin].is_numbered = true;
    }
    while (!open.empty()) {
      const std::size_t k = open.back();
      open.pop_back();
      if (seen[k]) continue;
      seen[k] = true;
      for (const std::size_t to : steps_[k].to) {
        ++steps_[to].ways;
        open.push_back(to);
      }
    }
  }
  std::size_t number(std::size_t k) {
    if (steps_[k].number == 0) {
      order_.push_back(k);
      steps_[k].number = order_.size();
    }
    return steps_[k].number;
  }
  void go(Chain& to, std::size_t k, int within) {
    if (stands_within(k) && within < kMost) return write_step(to, k, within + 1);
    const auto n = static_cast<std::int64_t>(number(k));
    append(to, assign(at_, integer(n, span_), span_));
  }
  [[nodiscard]] bool stands_within(std::size_t k) const {
    return steps_[k].ways == 1 && !steps_[k].is_numbered;
  }
  void write_step(Chain& to, std::size_t k, int within) {
    append(to, steps_[k].code.head);
    while (steps_[k].end == End::jump && stands_within(steps_[k].to[0])) {
      k = steps_[k].to[0];
      append(to, steps_[k].code.head);
    }
    const Step s = steps_[k];
    switch (s.end) {
      case End::none: return;
      case End::jump: return go(to, s.to[0], within);
      case End::branch: {
        Chain yes, no;
        go(yes, s.to[0], within);
        go(no, s.to[1], within);
        const Id i = if_then(s.condition, yes.head, s.span);
        const Id otherwise = statement(RMP_STMT_ARM, s.span);
        st(otherwise).body = no.head;
        st(st(i).body).next = otherwise;
        return append(to, i);
      }
      case End::choose: {
        std::size_t k2 = 0;
        Id last = RMP_NONE;
        bool has_default = false;
        for (Id arm = st(s.condition).body; arm != RMP_NONE; arm = st(arm).next) {
          Chain body;
          go(body, s.to[k2++], within);
          st(arm).body = body.head;
          has_default = has_default || st(arm).count == 0;
          last = arm;
        }
        if (!has_default) {
          Chain body;
          go(body, s.to.back(), within);
          const Id arm = statement(RMP_STMT_ARM, s.span);
          st(arm).body = body.head;
          if (last == RMP_NONE) st(s.condition).body = arm;
          else st(last).next = arm;
        }
        return append(to, s.condition);
      }
      case End::call: return write_call(to, s);
      case End::leave: return append(to, assign(at_, element(back_, depth_, s.span), s.span));
    }
  }
  /// Whether nothing is left to be done behind a call but to leave.
  [[nodiscard]] bool is_last(std::size_t k) const {
    std::size_t steps = 0;
    while (steps_[k].end == End::jump && steps_[k].code.head == RMP_NONE &&
           ++steps <= steps_.size())
      k = steps_[k].to[0];
    return steps_[k].end == End::leave && steps_[k].code.head == RMP_NONE;
  }
  void write_call(Chain& to, const Step& s) {
    const auto callee = static_cast<std::int64_t>(number(begins_.at(s.callee)));
    if (is_last(s.to[0])) return append(to, assign(at_, integer(callee, s.span), s.span));
    go_deeper(to, s.callee, s.span);
    for (const Id v : steps_[s.to[0]].live)
      append(to, copy(element(column(v), depth_, s.span), variable(v, s.span), s.span));
    const auto n = static_cast<std::int64_t>(number(s.to[0]));
    append(to, assignment(element(back_, depth_, s.span), integer(n, s.span), s.span));
    append(to, assign(at_, integer(callee, s.span), s.span));
  }
  /// depth := depth + 1, or the end.
  void go_deeper(Chain& to, Id callee, const rmp_span& span) {
    const Id full = expression(RMP_EXPR_GREATER_EQUAL, RMP_TYPE_BOOL, span,
                               {variable(depth_, span), integer(most_, span)});
    append(to, if_then(full, too_deep(callee, span), span));
    const Id more =
        expression(RMP_EXPR_ADD, RMP_TYPE_INT, span, {variable(depth_, span), integer(1, span)});
    append(to, assign(depth_, more, span));
  }
  void go_back(Chain& to, const rmp_span& span) {
    const Id less = expression(RMP_EXPR_SUBTRACT, RMP_TYPE_INT, span,
                               {variable(depth_, span), integer(1, span)});
    append(to, assign(depth_, less, span));
  }
  /// A message, where there are such, and the end of the program.
  Id too_deep(Id callee, const rmp_span& span) {
    Chain out;
    if (has(kPostMessages))
      for (Id k = 0; k < t_.symbols.size(); ++k) {
        if (t_.symbols[k].kind != RMP_SYMBOL_INTRINSIC ||
            post::upper(t_.symbols[k].name) != "WRITELN")
          continue;
        const Id call = statement(RMP_STMT_CALL, span);
        // Some controllers show 24 characters.
        const std::string name = name_of(callee);
        const Id what = text((name.size() > 14 ? "routine" : name) + ": too deep", span);
        const Id made = expression(RMP_EXPR_INTRINSIC, RMP_TYPE_VOID, span, {what}, k);
        st(call).a = made;
        append(out, call);
        break;
      }
    append(out, statement(RMP_STMT_HALT, span));
    return out.head;
  }
  void write(const std::vector<Id>& group, const std::map<Id, std::size_t>& begins) {
    begins_ = begins;
    order_.clear();
    for (const Id r : group) number(begins.at(r));
    // Steps get their numbers as they are come to.
    Chain body;
    for (std::size_t n = 0; n < order_.size(); ++n) {
      const std::size_t k = order_[n];
      Chain own;
      if (steps_[k].is_numbered && k != begins.at(steps_[k].routine)) take_back(own, k);
      write_step(own, k, 0);
      const Id here =
          expression(RMP_EXPR_EQUAL, RMP_TYPE_BOOL, span_,
                     {variable(at_, span_), integer(static_cast<std::int64_t>(n + 1), span_)});
      append(body, if_then(here, own.head, span_));
    }
    Chain loop;
    go_deeper(loop, group[0], span_);
    append(loop, assignment(element(back_, depth_, span_), integer(0, span_), span_));
    const Id i = statement(RMP_STMT_WHILE, span_);
    const Id goes_on = expression(RMP_EXPR_GREATER, RMP_TYPE_BOOL, span_,
                                  {variable(at_, span_), integer(0, span_)});
    st(i).a = goes_on;
    st(i).body = body.head;
    append(loop, i);
    go_back(loop, span_);
    if (!is_single_) t_.routines[driver_].body = loop.head;
    for (const Id r : group) wrap(r, begins.at(r), loop);
  }
  /// What a call kept.
  void take_back(Chain& to, std::size_t k) {
    const rmp_span span = steps_[k].span;
    for (const Id v : steps_[k].live)
      append(to, copy(variable(v, span), element(column(v), depth_, span), span));
    go_back(to, span);
  }
  /// The routine as others call it.
  void wrap(Id r, std::size_t begin, const Chain& loop) {
    const rmp_code_routine x = t_.routines[r];
    Chain all;
    const auto each = [&](bool is_back) {
      for (Id k = 0; k < x.parameter_count; ++k) {
        const Id p = x.first_parameter + k;
        if (is_back && t_.symbols[p].mode == RMP_MODE_IN) continue;
        const Id own = variable(p, x.span), sent = variable(inner_.sent.at(p), x.span);
        append(all, is_back ? wrap_copy(r, own, sent) : wrap_copy(r, sent, own));
      }
    };
    each(false);
    append(all,
           assign(at_, integer(static_cast<std::int64_t>(steps_[begin].number), x.span), x.span));
    if (is_single_) {
      append(all, loop.head);
    } else {
      const Id call = statement(RMP_STMT_CALL, x.span);
      const Id what =
          expression(RMP_EXPR_CALL, RMP_TYPE_VOID, x.span, {}, t_.routines[driver_].symbol);
      st(call).a = what;
      append(all, call);
    }
    each(true);
    if (x.kind == RMP_ROUTINE_FUNCTION) {
      const Id back = statement(RMP_STMT_RETURN, x.span);
      const Id value = variable(inner_.result.at(r), x.span);
      st(back).a = value;
      append(all, back);
    }
    t_.routines[r].body = all.head;
  }
  Id wrap_copy(Id r, Id to, Id from) {
    return copied(to, from, t_.routines[r].span, [&](std::size_t) {
      return new_variable(RMP_TYPE_INT, "k", place_of(r), t_.routines[r].span);
    });
  }

  std::string title_;
  std::uint64_t features_;
  std::int64_t most_;
  std::vector<Remark>& remarks_;
  std::vector<std::vector<Id>> groups_;
  InnerCalls inner_;
  // The group that is rewritten.
  Id group_ = 0, driver_ = 0, depth_ = 0, at_ = 0, back_ = 0, routine_ = 0;
  rmp_span span_{};
  bool is_single_ = true;
  std::vector<Step> steps_;
  std::size_t now_ = 0;
  std::vector<std::size_t> order_;
  std::map<Id, std::size_t> begins_, labels_;
  std::map<Id, Id> own_;    ///< by parameter: the variable in its place
  std::map<Id, Id> owner_;  ///< by variable: its routine
  std::vector<std::vector<Id>> own_symbols_;
  std::map<Id, std::vector<Id>> locals_;
  std::map<Id, Stack> stacks_;  ///< by process; 0 = the program
  std::map<Id, Id> roots_;      ///< by the first routine of a group
  std::size_t stacked_ = 0;
  std::set<Id> is_given_;  ///< those with a value of their own at the beginning
  Stack* stack_ = nullptr;
  std::map<Id, Id> columns_of_;                            ///< by variable
  std::map<std::pair<Id, Id>, std::size_t> used_columns_;  ///< by owner and type
  std::map<Id, Id> zeros_;                                 ///< by type
  std::vector<Id> counters_;
  std::vector<std::uint8_t> leaves_;
};

}  // namespace

void to_loops(ProgramTables& tables, const PostCapabilities& caps, std::size_t most,
              std::vector<Remark>& remarks) {
  Loops(tables, caps, most, remarks).run();
}

}  // namespace robomosp::program_post
