// SPDX-License-Identifier: Apache-2.0
#include "program_post/scalars.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include <robomosp/sdk/post_writer.h>

#include "program_post/effects.h"
#include "program_post/rewriter.h"
#include "program_post/walk.h"

namespace robomosp::program_post {
namespace {

using Id = std::uint32_t;

class Scalars final : public Rewriter {
 public:
  Scalars(ProgramTables& t, const PostCapabilities& caps, std::vector<Remark>& remarks)
      : Rewriter(t),
        title_(caps.title),
        remarks_(remarks),
        no_records_((caps.features & kPostRecords) == 0),
        no_functions_((caps.features & kPostFunctions) == 0 &&
                      (caps.features & kPostProcedures) != 0),
        no_out_((caps.features & kPostOutParameters) == 0 &&
                (caps.features & kPostProcedures) != 0),
        no_short_((caps.features & kPostShortCircuit) == 0 && (caps.features & kPostIf) != 0 &&
                  (caps.features & kPostBooleans) != 0),
        has_locals_((caps.features & kPostLocals) != 0),
        has_exit_((caps.features & (kPostExit | kPostGoto)) != 0),
        has_recursion_((caps.features & kPostRecursion) != 0),
        effects_(t) {}
  /// Only calls of routines that call themselves, from within such.
  Scalars(ProgramTables& t, std::string_view title, const InnerCalls& inner,
          std::vector<Remark>& remarks)
      : Rewriter(t),
        title_(title),
        remarks_(remarks),
        no_records_(false),
        no_functions_(false),
        no_out_(false),
        no_short_(false),
        has_locals_(true),
        has_exit_(true),
        effects_(t),
        inner_(&inner) {}

  void run() {
    find_split();
    first_symbols_ = static_cast<Id>(t_.symbols.size());
    split_symbols();
    signatures();
    if (!is_any()) return;
    if (no_out_) find_named();
    const auto routines = static_cast<Id>(t_.routines.size());
    std::vector<Chain> starts(routines);
    initial_values(starts);
    for (Id r = 0; r < routines; ++r) {
      if (!is_asked_for(r)) continue;
      routine_ = r;
      Id condition = t_.routines[r].condition;
      if (!is_refused(condition, "conditions of interrupts")) condition = asked_again(condition);
      const Id priority = asked_again(t_.routines[r].priority);
      Chain all = starts[r];
      append(all, block(t_.routines[r].body));
      t_.routines[r].condition = condition;
      t_.routines[r].priority = priority;
      t_.routines[r].body = all.head;
    }
  }

 private:
  struct Leaf {
    std::string name;      ///< "_a_b"
    std::vector<Id> path;  ///< fields
    Id type = RMP_NONE;    ///< with the arrays around it
  };
  struct Signature {
    bool is_changed = false;
    bool gives_by_place = false;  ///< its result comes by places
    std::vector<Id> results;      ///< symbols that take the result
    std::vector<Id> old;          ///< parameters as they were
  };
  /// A value of a record: parts of variables.
  struct Partial {
    Id root = RMP_NONE;
    std::vector<Id> path, indices;
    Id type = RMP_NONE;
  };

  void fault(const rmp_span& span, std::string message, std::string hint) {
    remarks_.push_back({RMP_FAULT_ERROR, span, std::move(message), std::move(hint)});
  }

  // ---- types ----
  void find_split() {
    is_split_.assign(t_.types.size(), false);
    if (!no_records_) return;
    for (Id t = 0; t < t_.types.size(); ++t) {
      const auto& x = t_.types[t];
      if (x.kind == RMP_TYPE_RECORD && x.role == RMP_ROLE_NONE) is_split_[t] = true;
      if (x.kind == RMP_TYPE_ARRAY) is_split_[t] = is_split_[x.element];
    }
  }
  [[nodiscard]] bool is_split(Id t) const { return t < is_split_.size() && is_split_[t]; }
  Id array_type(Id like, Id element) {
    const auto [it, is_new] =
        arrays_.try_emplace({t_.types[like].lower, t_.types[like].upper, element});
    if (is_new) {
      it->second = static_cast<Id>(t_.types.size());
      rmp_code_type t = t_.types[like];
      t.name = "";
      t.element = element;
      t_.types.push_back(t);
    }
    return it->second;
  }
  const std::vector<Leaf>& leaves_of_type(Id t) {
    if (const auto it = leaf_types_.find(t); it != leaf_types_.end()) return it->second;
    std::vector<Leaf> out;
    const rmp_code_type x = t_.types[t];
    if (x.kind == RMP_TYPE_ARRAY) {
      for (Leaf l : leaves_of_type(x.element)) {
        l.type = array_type(t, l.type);
        out.push_back(std::move(l));
      }
    } else {
      for (Id k = 0; k < x.field_count; ++k) {
        const rmp_code_field f = t_.fields[x.first_field + k];
        if (!is_split(f.type)) {
          out.push_back({std::string("_") + f.name, {k}, f.type});
          continue;
        }
        for (const Leaf& inner : leaves_of_type(f.type)) {
          Leaf l{std::string("_") + f.name + inner.name, {k}, inner.type};
          l.path.insert(l.path.end(), inner.path.begin(), inner.path.end());
          out.push_back(std::move(l));
        }
      }
    }
    return leaf_types_.emplace(t, std::move(out)).first->second;
  }

  // ---- symbols ----
  /// One symbol for each part of one that is a record, behind all others.
  std::vector<Id> parts_of(Id s, std::uint32_t kind) {
    std::vector<Id> out;
    const rmp_code_symbol from = t_.symbols[s];
    for (const Leaf& l : leaves_of_type(from.type)) {
      rmp_code_symbol x = from;
      x.kind = kind;
      x.name = t_.keep(from.name + l.name);
      x.type = l.type;
      x.value = x.constant = RMP_NONE;
      out.push_back(static_cast<Id>(t_.symbols.size()));
      t_.symbols.push_back(x);
    }
    return out;
  }
  void split_symbols() {
    for (Id s = 0; s < first_symbols_; ++s) {
      const auto kind = t_.symbols[s].kind;
      if ((kind != RMP_SYMBOL_VARIABLE && kind != RMP_SYMBOL_CONSTANT) ||
          !is_split(t_.symbols[s].type))
        continue;
      parts_[s] = parts_of(s, kind);
    }
  }
  Id result_symbol(Id r, Id type, const std::string& name, bool is_parameter) {
    rmp_code_symbol x{};
    x.kind = is_parameter ? RMP_SYMBOL_PARAMETER : RMP_SYMBOL_VARIABLE;
    x.mode = is_parameter ? RMP_MODE_OUT : RMP_MODE_IN;
    x.name = t_.keep(name);
    x.type = type;
    x.scope = t_.routines[is_parameter ? r : 0].scope;
    x.routine = is_parameter ? r : RMP_NONE;
    x.value = x.constant = RMP_NONE;
    x.span = t_.routines[r].span;
    t_.symbols.push_back(x);
    return static_cast<Id>(t_.symbols.size() - 1);
  }
  void signatures() {
    signatures_.resize(t_.routines.size());
    for (Id r = 1; r < t_.routines.size(); ++r) {
      const rmp_code_routine x = t_.routines[r];
      Signature& s = signatures_[r];
      for (Id k = 0; k < x.parameter_count; ++k) s.old.push_back(x.first_parameter + k);
      if (x.kind != RMP_ROUTINE_PROCEDURE && x.kind != RMP_ROUTINE_FUNCTION) continue;
      s.gives_by_place = x.kind == RMP_ROUTINE_FUNCTION && (no_functions_ || is_split(x.result));
      s.is_changed = s.gives_by_place;
      bool has_out = false;
      for (const Id p : s.old) {
        const bool is_out = t_.symbols[p].mode != RMP_MODE_IN;
        s.is_changed = s.is_changed || is_split(t_.symbols[p].type) || (is_out && no_out_);
        has_out = has_out || (is_out && no_out_);
      }
      if (!s.is_changed) continue;
      if (x.is_recursive && has_recursion_ && no_out_ && (has_out || s.gives_by_place))
        fault(x.span,
              title_ + " has no parameters passed by reference, and " + t_.symbols[x.symbol].name +
                  ", which has one, is recursive",
              "Post the flattened program (form = \"flat\"), or write it with a loop.");
      // Parameters are rows one behind the other: all are made anew.
      std::vector<Id> rest;
      for (const Id p : s.old)
        if (no_out_ && t_.symbols[p].mode != RMP_MODE_IN) rest.push_back(p);
      const auto first = static_cast<Id>(t_.symbols.size());
      Id count = 0;
      for (const Id p : s.old) {
        if (no_out_ && t_.symbols[p].mode != RMP_MODE_IN) continue;
        if (is_split(t_.symbols[p].type)) {
          parts_[p] = parts_of(p, RMP_SYMBOL_PARAMETER);
          count += static_cast<Id>(parts_[p].size());
        } else {
          const rmp_code_symbol copy = t_.symbols[p];
          moved_[p] = static_cast<Id>(t_.symbols.size());
          t_.symbols.push_back(copy);
          ++count;
        }
      }
      if (s.gives_by_place) {
        const std::string name = std::string(t_.symbols[x.symbol].name) + "_result";
        if (is_split(x.result))
          for (const Leaf& l : leaves_of_type(x.result))
            s.results.push_back(result_symbol(r, l.type, name + l.name, !no_out_));
        else s.results.push_back(result_symbol(r, x.result, name, !no_out_));
        if (!no_out_) count += static_cast<Id>(s.results.size());
      }
      // What is changed there stands with the program.
      for (const Id p : rest) {
        rmp_code_symbol copy = t_.symbols[p];
        copy.kind = RMP_SYMBOL_VARIABLE;
        copy.mode = RMP_MODE_IN;
        copy.name = t_.keep(std::string(t_.symbols[x.symbol].name) + "_" + copy.name);
        copy.scope = t_.routines[0].scope;
        copy.routine = RMP_NONE;
        moved_[p] = static_cast<Id>(t_.symbols.size());
        t_.symbols.push_back(copy);
        if (is_split(copy.type)) parts_[p] = parts_of(moved_[p], RMP_SYMBOL_VARIABLE);
      }
      rmp_code_routine& to = t_.routines[r];
      to.first_parameter = first;
      to.parameter_count = count;
      if (s.gives_by_place) {
        to.kind = RMP_ROUTINE_PROCEDURE;
        to.result = RMP_TYPE_VOID;
        if (to.symbol != RMP_NONE) t_.symbols[to.symbol].type = RMP_TYPE_VOID;
      }
    }
  }
  [[nodiscard]] bool is_asked_for(Id r) const {
    return inner_ == nullptr || inner_->group[r] != RMP_NONE;
  }
  /// Whether it is a call that leads back to where it stands.
  [[nodiscard]] bool is_inner(const rmp_code_expression& x) const {
    if (inner_ == nullptr || x.op != RMP_EXPR_CALL || inner_->group[routine_] == RMP_NONE)
      return false;
    return inner_->group[t_.symbols[x.symbol].routine] == inner_->group[routine_];
  }
  [[nodiscard]] bool is_any() {
    if (inner_ != nullptr) return true;
    if (!parts_.empty() || no_short_ || effects_.is_any()) return true;
    for (const Signature& s : signatures_)
      if (s.is_changed) return true;
    for (Id e = 0; e < t_.expressions.size(); ++e)
      if (is_split(ex(e).type)) return true;
    return false;
  }

  // ---- what needs statements before it ----
  [[nodiscard]] bool is_place(Id e) const {
    return ex(e).op == RMP_EXPR_SYMBOL || ex(e).op == RMP_EXPR_FIELD || ex(e).op == RMP_EXPR_INDEX;
  }
  /// Whether a value that is not asked for may be a fault, or do something.
  bool matters(Id e) {
    if (is_known(e)) return false;
    const rmp_code_expression x = ex(e);
    if (x.op == RMP_EXPR_CALL) return true;
    if ((x.op == RMP_EXPR_DIVIDE || x.op == RMP_EXPR_DIV || x.op == RMP_EXPR_MOD) &&
        !is_known(operand(e, 1)))
      return true;
    if (x.op == RMP_EXPR_INTRINSIC) {
      static const std::set<std::string, std::less<>> kHarmless{"SIN",   "COS", "ATAN", "ATAN2",
                                                                "FLOAT", "ABS", "ORD",  "LENGTH"};
      if (!kHarmless.contains(post::upper(t_.symbols[x.symbol].name))) return true;
    }
    if (x.op == RMP_EXPR_INDEX && !is_known(operand(e, 1))) return true;
    for (Id k = 0; k < x.count; ++k)
      if (matters(operand(e, k))) return true;
    return false;
  }
  /// Whether one of these values changes what another one reads.
  bool is_disordered(const std::vector<Id>& all) {
    for (std::size_t k = 0; k < all.size(); ++k)
      if (is_disturbed(all, k)) return true;
    return false;
  }
  /// Whether a value would be another one if one of those behind it were computed first: it is
  /// kept in a variable before.
  bool is_disturbed(const std::vector<Id>& all, std::size_t k) {
    if (!effects_.is_any()) return false;
    for (std::size_t j = k + 1; j < all.size(); ++j)
      if (effects_.depend(all[k], all[j])) return true;
    return false;
  }
  /// The same of an operand. The right side of AND and OR is computed behind the left anyway, and
  /// the object of an index where the element is read.
  bool is_disturbed(Id e, Id k) {
    if (!may_hoist_ || ex(e).op == RMP_EXPR_AND || ex(e).op == RMP_EXPR_OR || !effects_.changes(e))
      return false;
    return is_disturbed(operands(e), k);
  }
  std::vector<Id> operands(Id e) const {
    std::vector<Id> out;
    for (Id k = 0; k < ex(e).count; ++k) out.push_back(operand(e, k));
    return out;
  }
  /// Indices of a place in the order in which they are computed.
  std::vector<Id> indices(Id e) const {
    std::vector<Id> out;
    for (; ex(e).op == RMP_EXPR_FIELD || ex(e).op == RMP_EXPR_INDEX; e = operand(e, 0))
      if (ex(e).op == RMP_EXPR_INDEX) out.insert(out.begin(), operand(e, 1));
    return out;
  }
  /// Whether the indices of a place are kept before the next one is computed.
  bool keeps_indices(Id object, Id next) {
    if (!may_hoist_) return false;
    if (needs(next)) return true;
    const std::vector<Id> before = indices(object);
    return std::any_of(before.begin(), before.end(),
                       [&](Id i) { return effects_.depend(i, next); });
  }
  /// Whether the order of parts matters anywhere within an expression.
  bool has_disorder(Id e) {
    if (!effects_.changes(e)) return false;
    const bool is_element = ex(e).op == RMP_EXPR_FIELD || ex(e).op == RMP_EXPR_INDEX;
    if (ex(e).op != RMP_EXPR_AND && ex(e).op != RMP_EXPR_OR &&
        is_disordered(is_element ? indices(e) : operands(e)))
      return true;
    for (Id k = 0; k < ex(e).count; ++k)
      if (has_disorder(operand(e, k))) return true;
    return false;
  }
  /// The last operand that needs statements before it; what is left of it is kept in variables.
  Id last_needing(Id e) {
    const Id count = ex(e).count;
    for (Id k = count; may_hoist_ && k-- > 1;)
      if (needs(operand(e, k))) return k;
    return 0;
  }
  /// The same of a place: a record that is made on the spot gets a variable, and an index that is
  /// written for each part of one is computed once.
  bool place_needs(Id e) {
    if (effects_.changes(e) && is_disordered(indices(e))) return true;
    const bool is_whole = is_split(ex(e).type) && leaves_of_type(ex(e).type).size() > 1;
    bool is_record = is_split(ex(e).type);
    while (ex(e).op == RMP_EXPR_FIELD || ex(e).op == RMP_EXPR_INDEX) {
      if (ex(e).op == RMP_EXPR_INDEX) {
        const Id i = operand(e, 1);
        if (needs(i)) return true;
        if (is_whole && !is_known(i) && ex(i).op != RMP_EXPR_SYMBOL) return true;
      }
      e = operand(e, 0);
      is_record = is_record || is_split(ex(e).type);
    }
    if (ex(e).op == RMP_EXPR_SYMBOL) return false;
    return is_record || needs(e);
  }
  bool needs(Id e) {
    if (e == RMP_NONE || is_known(e)) return false;
    if (e < needs_.size() && needs_[e] != 0) return needs_[e] == 2;
    const rmp_code_expression x = ex(e);
    bool out = false;
    if (x.op == RMP_EXPR_CALL) out = signatures_[t_.symbols[x.symbol].routine].is_changed;
    if (no_short_ && (x.op == RMP_EXPR_AND || x.op == RMP_EXPR_OR)) out = matters(operand(e, 1));
    if (out && x.op == RMP_EXPR_CALL) {
      // Only values that are passed may do without.
      const Signature& s = signatures_[t_.symbols[x.symbol].routine];
      out = s.gives_by_place;
      for (const Id p : s.old) out = out || (no_out_ && t_.symbols[p].mode != RMP_MODE_IN);
    }
    out = out || is_inner(x);
    if (x.op == RMP_EXPR_FIELD || x.op == RMP_EXPR_INDEX) {
      out = place_needs(e);
      if (needs_.size() <= e) needs_.resize(t_.expressions.size(), 0);
      needs_[e] = out ? 2 : 1;
      return out;
    }
    for (Id k = 0; !out && k < x.count; ++k) out = needs(operand(e, k));
    if (!out && x.op != RMP_EXPR_AND && x.op != RMP_EXPR_OR && effects_.changes(e))
      out = is_disordered(operands(e));
    if (needs_.size() <= e) needs_.resize(t_.expressions.size(), 0);
    needs_[e] = out ? 2 : 1;
    return out;
  }
  /// Whether statements before a condition would come at another time than it.
  bool is_refused(Id e, const char* what) {
    if (e == RMP_NONE) return false;
    if (!calls_changed(e)) {
      if (!has_disorder(e)) return false;
      fault(ex(e).span,
            "which part of this condition " + title_ +
                " computes first is not defined, and a function in it changes variables read by "
                "another part",
            "Test a signal or a variable, or write a loop around the call.");
      return true;
    }
    fault(ex(e).span, title_ + " has no functions within " + what + " used as values there",
          "Test a signal or a variable, or write a loop around the call.");
    return true;
  }
  bool calls_changed(Id e) {
    const rmp_code_expression x = ex(e);
    if (x.op == RMP_EXPR_CALL &&
        (signatures_[t_.symbols[x.symbol].routine].is_changed || is_inner(x)))
      return true;
    for (Id k = 0; k < x.count; ++k)
      if (calls_changed(operand(e, k))) return true;
    return false;
  }

  // ---- values ----
  void emit(Id s) { append(out_, s); }
  Id temporary(Id type, const rmp_span& span) {
    return new_variable(type, "t", has_locals_ ? routine_ : 0, span);
  }
  /// The value as it is now.
  Id settled(Id e) {
    if (ex(e).constant != RMP_NONE || ex(e).op == RMP_EXPR_LITERAL) return e;
    const rmp_span span = ex(e).span;
    const Id type = ex(e).type;
    if (type == RMP_TYPE_SEMAPHORE || t_.types[type].kind == RMP_TYPE_LIST) return e;
    const Id t = temporary(type, span);
    emit(assignment(variable(t, span), e, span));
    return variable(t, span);
  }
  /// An index that is written several times.
  Id simple(Id e) {
    if (ex(e).constant != RMP_NONE || ex(e).op == RMP_EXPR_SYMBOL) return e;
    return settled(e);
  }
  [[nodiscard]] Id moved(Id s) const {
    const auto it = moved_.find(s);
    return it == moved_.end() ? s : it->second;
  }
  /// A value that is no record, in parts of what there is.
  Id rewritten(Id e) {
    if (e == RMP_NONE || is_known(e)) return e;
    const rmp_code_expression x = ex(e);
    switch (x.op) {
      case RMP_EXPR_LITERAL: return e;
      case RMP_EXPR_SYMBOL: {
        const Id s = moved(x.symbol);
        if (s == x.symbol) return e;
        return expression(RMP_EXPR_SYMBOL, x.type, x.span, {}, s, x.constant);
      }
      case RMP_EXPR_FIELD:
        if (is_split(ex(operand(e, 0)).type)) {
          auto p = partial(operand(e, 0));
          if (!p) return e;
          p->path.push_back(x.symbol);
          return part(*p, leaf_number(*p), x.span);
        }
        break;
      case RMP_EXPR_CALL: return call_value(e);
      case RMP_EXPR_AND:
      case RMP_EXPR_OR:
        if (may_hoist_ && needs(operand(e, 1))) return by_if(e);
        break;
      default: break;
    }
    return with_operands(e);
  }
  /// The same operation of rewritten operands, each computed once and in order.
  Id with_operands(Id e) {
    const rmp_code_expression x = ex(e);
    std::vector<Id> all;
    bool changed = false;
    const Id last = last_needing(e);
    for (Id k = 0; k < x.count; ++k) {
      const Id o = operand(e, k);
      const bool later = k < last || is_disturbed(e, k);
      const bool is_object = k == 0 && (x.op == RMP_EXPR_FIELD || x.op == RMP_EXPR_INDEX);
      Id v = is_object && later && is_place(o) ? placed(o, true) : rewritten(o);
      if (later && !is_object) v = settled(v);
      changed = changed || v != o;
      all.push_back(v);
    }
    if (!changed) return e;
    return expression(x.op, x.type, x.span, all, x.symbol, x.constant);
  }
  /// t := a; IF t THEN t := b; ENDIF;
  Id by_if(Id e) {
    const rmp_code_expression x = ex(e);
    const Id first = operand(e, 0), second = operand(e, 1);
    const Id t = temporary(RMP_TYPE_BOOL, x.span);
    const Id a = rewritten(first);
    emit(assignment(variable(t, x.span), a, x.span));
    Chain outer = std::exchange(out_, Chain{});
    const Id b = rewritten(second);
    emit(assignment(variable(t, x.span), b, x.span));
    const Chain inner = std::exchange(out_, outer);
    Id asked = variable(t, x.span);
    if (x.op == RMP_EXPR_OR) asked = expression(RMP_EXPR_NOT, RMP_TYPE_BOOL, x.span, {asked});
    emit(if_then(asked, inner.head, x.span));
    return variable(t, x.span);
  }

  // ---- records ----
  Partial fresh(Id type, const rmp_span& span) {
    const Id s = new_variable(type, "t", has_locals_ ? routine_ : 0, span);
    parts_[s] = parts_of(s, RMP_SYMBOL_VARIABLE);
    return {s, {}, {}, type};
  }
  /// Where a record stands. One that is made on the spot gets variables.
  std::optional<Partial> partial(Id e) {
    const rmp_code_expression x = ex(e);
    switch (x.op) {
      case RMP_EXPR_SYMBOL:
        if (!parts_.contains(x.symbol)) break;
        return Partial{x.symbol, {}, {}, x.type};
      case RMP_EXPR_FIELD:
      case RMP_EXPR_INDEX: {
        auto p = partial(operand(e, 0));
        if (!p) return p;
        if (x.op == RMP_EXPR_FIELD) {
          p->path.push_back(x.symbol);
        } else {
          const Id i = operand(e, 1);
          if (keeps_indices(operand(e, 0), i))
            for (Id& before : p->indices) before = settled(before);
          p->indices.push_back(rewritten(i));
        }
        p->type = x.type;
        return p;
      }
      case RMP_EXPR_MAKE: {
        if (!may_hoist_) break;
        const auto values = leaf_values(e);
        const Partial p = fresh(x.type, x.span);
        for (std::size_t k = 0; k < values.size(); ++k)
          emit(assignment(part(p, k, x.span), values[k], x.span));
        return p;
      }
      case RMP_EXPR_CALL: {
        if (!may_hoist_) break;
        const Partial p = fresh(x.type, x.span);
        call(e, parts_.at(p.root));
        return p;
      }
      default: break;
    }
    fault(x.span, title_ + " has no records, and this one cannot be split here",
          "Assign it to a variable first.");
    return std::nullopt;
  }
  /// Number of the part that a path leads to, among those of its root; the first within it.
  std::size_t leaf_number(const Partial& p) {
    const auto& all = leaves_of_type(t_.symbols[p.root].type);
    // Leaves stand in the order of their paths.
    const auto at = std::lower_bound(all.begin(), all.end(), p.path,
                                     [](const Leaf& l, const auto& path) { return l.path < path; });
    const bool is_one = at != all.end() && at->path.size() >= p.path.size() &&
                        std::equal(p.path.begin(), p.path.end(), at->path.begin());
    return is_one ? static_cast<std::size_t>(at - all.begin()) : 0;
  }
  /// Part `number` of the root, with the indices so far.
  Id part(const Partial& p, std::size_t number, const rmp_span& span) {
    Id e = variable(parts_.at(p.root)[number], span);
    for (const Id i : p.indices) {
      const Id element = t_.types[ex(e).type].element;
      e = expression(RMP_EXPR_INDEX, element, span, {e, i});
    }
    return e;
  }
  /// All parts of a record that stands somewhere.
  std::vector<Id> parts(Partial p, const rmp_span& span, bool settle = false) {
    const std::size_t n = leaves_of_type(p.type).size();
    const std::size_t first = leaf_number(p);
    if ((n > 1 || settle) && may_hoist_)
      for (Id& i : p.indices) i = settle ? settled(i) : simple(i);
    std::vector<Id> out;
    for (std::size_t k = 0; k < n; ++k) out.push_back(part(p, first + k, span));
    return out;
  }
  std::vector<Id> leaf_values(Id e) {
    const rmp_code_expression x = ex(e);
    std::vector<Id> out;
    if (x.op != RMP_EXPR_MAKE) {
      if (auto p = partial(e)) return parts(std::move(*p), x.span);
      return std::vector<Id>(leaves_of_type(x.type).size(), e);
    }
    std::vector<std::vector<Id>> each;
    const Id last = last_needing(e);
    for (Id k = 0; k < x.count; ++k) {
      const Id o = operand(e, k);
      each.push_back(is_split(ex(o).type) ? leaf_values(o) : std::vector<Id>{rewritten(o)});
      if (k < last || is_disturbed(e, k))
        for (Id& v : each.back()) v = settled(v);
    }
    if (t_.types[x.type].kind != RMP_TYPE_ARRAY) {
      for (const auto& values : each) out.insert(out.end(), values.begin(), values.end());
      return out;
    }
    // The parts of the elements, array by array.
    const auto leaves = leaves_of_type(x.type);
    for (std::size_t l = 0; l < leaves.size(); ++l) {
      std::vector<Id> column;
      for (const auto& values : each) column.push_back(values[l]);
      out.push_back(expression(RMP_EXPR_MAKE, leaves[l].type, x.span, column));
    }
    return out;
  }

  // ---- calls ----
  [[nodiscard]] Id root_of(Id e) const {
    while (ex(e).op == RMP_EXPR_FIELD || ex(e).op == RMP_EXPR_INDEX) e = operand(e, 0);
    return ex(e).op == RMP_EXPR_SYMBOL ? ex(e).symbol : RMP_NONE;
  }
  /// Symbols that each routine names, and what it calls.
  void find_named() {
    named_.assign(t_.routines.size(), {});
    called_.assign(t_.routines.size(), {});
    for (Id r = 0; r < t_.routines.size(); ++r) {
      std::vector<Id> expressions;
      each_statement(t_, t_.routines[r].body, [&](const rmp_code_statement& s) {
        for (const Id e : {s.a, s.b, s.c}) expressions.push_back(e);
        if (s.symbol != RMP_NONE) named_[r].insert(s.symbol);
        if (s.motion == RMP_NONE) return;
        const auto& m = t_.motions[s.motion];
        each_value(t_, m, [&](Id e) { expressions.push_back(e); });
        if (m.action != RMP_NONE) called_[r].insert(m.action);
      });
      std::set<Id> seen;
      while (!expressions.empty()) {
        const Id e = expressions.back();
        expressions.pop_back();
        if (e == RMP_NONE || !seen.insert(e).second) continue;
        if (ex(e).op == RMP_EXPR_SYMBOL && ex(e).symbol != RMP_NONE) named_[r].insert(ex(e).symbol);
        if (ex(e).op == RMP_EXPR_CALL) called_[r].insert(t_.symbols[ex(e).symbol].routine);
        for (Id k = 0; k < ex(e).count; ++k) expressions.push_back(operand(e, k));
      }
    }
  }
  /// Whether a routine, or one that it calls, names the symbol. Few are asked for: what all of them
  /// reach would be the square of a program whose routines call each other.
  bool routine_names(Id routine, Id symbol) const {
    std::vector<Id> open{routine};
    std::set<Id> seen{routine};
    while (!open.empty()) {
      const Id r = open.back();
      open.pop_back();
      if (named_[r].contains(symbol)) return true;
      for (const Id inner : called_[r])
        if (seen.insert(inner).second) open.push_back(inner);
    }
    return false;
  }
  /// An argument; `later`: what comes behind it may change it.
  std::vector<Id> argument(Id a, bool is_out, bool later) {
    const bool settle = later || (is_out && no_out_);
    std::vector<Id> values;
    if (is_out && is_split(ex(a).type)) {
      auto p = partial(a);
      if (p) return parts(std::move(*p), ex(a).span, settle);
      return {};
    }
    if (is_out) return {placed(a, settle)};
    if (is_split(ex(a).type)) values = leaf_values(a);
    else values = {rewritten(a)};
    if (later)
      for (Id& v : values) v = settled(v);
    return values;
  }
  /// The same of one that leads back: all that it takes and gives goes through variables of the
  /// program.
  void inner_call(Id e, const std::vector<Id>& results) {
    const rmp_code_expression x = ex(e);
    const Id r = t_.symbols[x.symbol].routine;
    struct Sent {
      Id variable, value;
    };
    std::vector<Sent> in, back;
    const Id last = last_needing(e);
    for (Id k = 0; k < x.count; ++k) {
      const Id p = t_.routines[r].first_parameter + k;
      const Id sent = inner_->sent.at(p);
      if (t_.symbols[p].mode != RMP_MODE_IN) {
        const Id place = placed(operand(e, k), true);
        in.push_back({sent, place});
        back.push_back({sent, place});
        continue;
      }
      Id v = rewritten(operand(e, k));
      if (k < last || is_disturbed(e, k)) v = settled(v);
      in.push_back({sent, v});
    }
    const auto counter = [&](std::size_t) { return temporary(RMP_TYPE_INT, x.span); };
    for (const Sent& s : in) emit(copied(variable(s.variable, x.span), s.value, x.span, counter));
    const Id i = statement(RMP_STMT_CALL, x.span);
    const Id made = expression(RMP_EXPR_CALL, x.type, x.span, {}, x.symbol);
    st(i).a = made;
    emit(i);
    if (!results.empty()) {
      const Id value = variable(inner_->result.at(r), x.span);
      emit(copied(variable(results[0], x.span), value, x.span, counter));
    }
    for (const Sent& s : back) emit(copied(s.value, variable(s.variable, x.span), x.span, counter));
  }
  /// A call as a statement; a result goes to `results`, one symbol for each part.
  void call(Id e, const std::vector<Id>& results) {
    const rmp_code_expression x = ex(e);
    if (is_inner(x)) return inner_call(e, results);
    const Id r = t_.symbols[x.symbol].routine;
    const Signature s = signatures_[r];
    std::vector<Id> all;
    std::vector<std::pair<Id, Id>> in, back;  // place, value
    std::set<Id> changed;
    const Id last = last_needing(e);
    for (Id k = 0; k < x.count; ++k) {
      const Id a = operand(e, k);
      const Id p = s.old[k];
      const bool is_out = t_.symbols[p].mode != RMP_MODE_IN;
      const std::vector<Id> values = argument(a, is_out, k < last || is_disturbed(e, k));
      if (is_out && no_out_) {
        const Id root = root_of(a);
        const bool is_twice = !changed.insert(root).second;
        if (root != RMP_NONE && (has_recursion_ || t_.routines[r].is_recursive == 0) &&
            (is_twice || routine_names(r, root)))
          fault(x.span,
                title_ + " has no parameters passed by reference, and " +
                    t_.symbols[t_.routines[r].symbol].name + " reaches " + t_.symbols[root].name +
                    (is_twice ? " by two of them" : " and also by its name"),
                "Pass another variable, and copy it back after the call.");
        const auto it = parts_.find(p);
        const std::vector<Id> to = it != parts_.end() ? it->second : std::vector<Id>{moved(p)};
        for (std::size_t n = 0; n < values.size() && n < to.size(); ++n) {
          in.emplace_back(to[n], values[n]);
          back.emplace_back(to[n], values[n]);
        }
        continue;
      }
      all.insert(all.end(), values.begin(), values.end());
    }
    for (const auto& [to, from] : in) emit(assignment(variable(to, x.span), from, x.span));
    if (s.gives_by_place && !no_out_)
      for (const Id t : results) all.push_back(variable(t, x.span));
    const Id type = s.gives_by_place ? static_cast<Id>(RMP_TYPE_VOID) : x.type;
    const Id made = expression(RMP_EXPR_CALL, type, x.span, all, x.symbol);
    if (!s.gives_by_place && !results.empty()) {
      emit(assignment(variable(results[0], x.span), made, x.span));
    } else {
      const Id i = statement(RMP_STMT_CALL, x.span);
      st(i).a = made;
      emit(i);
    }
    if (s.gives_by_place && no_out_)
      for (std::size_t k = 0; k < results.size() && k < s.results.size(); ++k)
        emit(assignment(variable(results[k], x.span), variable(s.results[k], x.span), x.span));
    for (const auto& [from, to] : back) emit(assignment(to, variable(from, x.span), x.span));
  }
  Id call_value(Id e) {
    const rmp_code_expression x = ex(e);
    if (!may_hoist_) return with_operands(e);
    if (!needs_statement(e)) {
      // Only its arguments are others: records part by part.
      const Signature s = signatures_[t_.symbols[x.symbol].routine];
      std::vector<Id> all;
      const Id last = last_needing(e);
      for (Id k = 0; k < x.count; ++k) {
        const auto values = argument(operand(e, k), t_.symbols[s.old[k]].mode != RMP_MODE_IN,
                                     k < last || is_disturbed(e, k));
        all.insert(all.end(), values.begin(), values.end());
      }
      return expression(RMP_EXPR_CALL, x.type, x.span, all, x.symbol, x.constant);
    }
    const Id t = temporary(x.type, x.span);
    call(e, {t});
    return variable(t, x.span);
  }
  bool needs_statement(Id e) {
    if (is_inner(ex(e))) return true;
    const Signature& s = signatures_[t_.symbols[ex(e).symbol].routine];
    if (s.gives_by_place) return true;
    for (const Id p : s.old)
      if (no_out_ && t_.symbols[p].mode != RMP_MODE_IN) return true;
    return false;
  }
  /// A place that is no record, with its indices as they are now.
  Id placed(Id e, bool settle) {
    const rmp_code_expression x = ex(e);
    if (x.op == RMP_EXPR_INDEX) {
      const Id object =
          placed(operand(e, 0), settle || keeps_indices(operand(e, 0), operand(e, 1)));
      Id i = rewritten(operand(e, 1));
      if (settle) i = settled(i);
      if (object == operand(e, 0) && i == operand(e, 1)) return e;
      return expression(RMP_EXPR_INDEX, x.type, x.span, {object, i}, x.symbol, x.constant);
    }
    if (x.op == RMP_EXPR_FIELD && is_split(ex(operand(e, 0)).type)) {
      auto p = partial(operand(e, 0));
      if (!p) return e;
      if (settle)
        for (Id& i : p->indices) i = settled(i);
      p->path.push_back(x.symbol);
      return part(*p, leaf_number(*p), x.span);
    }
    if (x.op == RMP_EXPR_FIELD) {
      const Id object = placed(operand(e, 0), settle);
      if (object == operand(e, 0)) return e;
      return expression(RMP_EXPR_FIELD, x.type, x.span, {object}, x.symbol, x.constant);
    }
    return rewritten(e);
  }

  // ---- first values ----
  /// Those that are copied from what has been taken apart, or need statements, become assignments
  /// at the beginning, in their order.
  void initial_values(std::vector<Chain>& starts) {
    std::set<Id> late;
    for (Id s = 0; s < first_symbols_; ++s) {
      const rmp_code_symbol x = t_.symbols[s];
      if (x.value == RMP_NONE || (x.kind != RMP_SYMBOL_VARIABLE && x.kind != RMP_SYMBOL_CONSTANT &&
                                  x.kind != RMP_SYMBOL_ROBOT))
        continue;
      const Id r = x.routine == RMP_NONE ? 0 : x.routine;
      if (!is_asked_for(r)) continue;
      routine_ = r;
      const bool is_late =
          depends(x.value, late) || calls_changed(x.value) || has_disorder(x.value);
      const auto it = parts_.find(s);
      if (it == parts_.end() && !is_late) {
        // Parameters are others now.
        const Id value = asked_again(x.value);
        t_.symbols[s].value = value;
        continue;
      }
      out_ = {};
      if (!is_late) {
        may_hoist_ = false;
        const auto values = leaf_values(x.value);
        may_hoist_ = true;
        for (std::size_t k = 0; k < it->second.size() && k < values.size(); ++k) {
          t_.symbols[it->second[k]].value = values[k];
          if (x.kind == RMP_SYMBOL_CONSTANT)
            t_.symbols[it->second[k]].constant = ex(values[k]).constant;
        }
        continue;
      }
      late.insert(s);
      t_.symbols[s].value = RMP_NONE;
      // A constant that is computed is a variable that nobody assigns again.
      if (x.kind == RMP_SYMBOL_CONSTANT) {
        t_.symbols[s].kind = RMP_SYMBOL_VARIABLE;
        if (it != parts_.end())
          for (const Id p : it->second) t_.symbols[p].kind = RMP_SYMBOL_VARIABLE;
      }
      if (it == parts_.end()) {
        const Id v = rewritten(x.value);
        emit(assignment(variable(s, x.span), v, x.span));
      } else {
        const auto values = leaf_values(x.value);
        for (std::size_t k = 0; k < it->second.size() && k < values.size(); ++k)
          emit(assignment(variable(parts_.at(s)[k], x.span), values[k], x.span));
      }
      append(starts[r], std::exchange(out_, Chain{}).head);
    }
  }
  /// Whether a value reads a variable that has been taken apart, or gets its value late.
  bool depends(Id e, const std::set<Id>& late) {
    const rmp_code_expression x = ex(e);
    if (is_known(e)) return false;
    if (x.op == RMP_EXPR_SYMBOL && x.symbol != RMP_NONE &&
        (parts_.contains(x.symbol) || late.contains(x.symbol)))
      return true;
    for (Id k = 0; k < x.count; ++k)
      if (depends(operand(e, k), late)) return true;
    return false;
  }

  // ---- statements ----
  Id block(Id first) {
    if (++depth_ > kDeepest) {
      --depth_;
      return first;
    }
    Chain outer = std::exchange(out_, Chain{});
    for (Id i = first; i != RMP_NONE;) {
      const Id next = st(i).next;
      st(i).next = RMP_NONE;
      one(i);
      i = next;
    }
    const Chain made = std::exchange(out_, outer);
    --depth_;
    return made.head;
  }
  void one(Id i) {
    const rmp_code_statement s = st(i);
    switch (s.op) {
      case RMP_STMT_ASSIGN: assign(i); return;
      case RMP_STMT_CALL: call_statement(i); return;
      case RMP_STMT_IF: arms(i, s.body, s.span); return;
      case RMP_STMT_CASE: {
        const Id selector = rewritten(s.a);
        for (Id a = s.body; a != RMP_NONE; a = st(a).next) {
          const Id body = block(st(a).body);
          st(a).body = body;
        }
        st(i).a = selector;
        emit(i);
        return;
      }
      case RMP_STMT_WHILE:
      case RMP_STMT_REPEAT: loop(i); return;
      case RMP_STMT_LOOP: {
        const Id body = block(s.body);
        st(i).body = body;
        emit(i);
        return;
      }
      case RMP_STMT_FOR:
      case RMP_STMT_FOR_DOWN: {
        Id from = rewritten(s.a);
        const std::vector<Id> all{s.a, s.b, s.c};
        if (needs(s.b) || needs(s.c) || is_disturbed(all, 0)) from = settled(from);
        Id to = rewritten(s.b);
        if (s.c != RMP_NONE && (needs(s.c) || is_disturbed(all, 1))) to = settled(to);
        const Id by = rewritten(s.c);
        const Id body = block(s.body);
        st(i).a = from;
        st(i).b = to;
        st(i).c = by;
        st(i).symbol = moved(s.symbol);
        st(i).body = body;
        emit(i);
        return;
      }
      case RMP_STMT_RETURN: return_(i); return;
      case RMP_STMT_WAIT_FOR: {
        Id limit = rewritten(s.b);
        // It is asked for once, however often the language writes it.
        if (effects_.changes(s.b)) limit = settled(limit);
        st(i).b = limit;
        if (!is_refused(s.a, "WAIT FOR")) {
          const Id c = asked_again(s.a);
          st(i).a = c;
        }
        emit(i);
        return;
      }
      case RMP_STMT_WAIT_TIME:
      case RMP_STMT_PAUSE: {
        const Id a = rewritten(s.a);
        st(i).a = a;
        emit(i);
        return;
      }
      case RMP_STMT_MOVE: move(i); return;
      case RMP_STMT_TEACH:
        if (parts_.contains(s.symbol))
          fault(s.span, title_ + " has no records, and this one is taught as a whole",
                "Teach its parts as separate variables.");
        emit(i);
        return;
      default: emit(i); return;
    }
  }
  /// Without statements before it: it is looked at again and again.
  Id asked_again(Id e) {
    const bool before = std::exchange(may_hoist_, false);
    const Id c = rewritten(e);
    may_hoist_ = before;
    return c;
  }
  bool names(Id e, Id root) {
    const rmp_code_expression x = ex(e);
    if (x.op == RMP_EXPR_CALL) return true;
    if (x.op == RMP_EXPR_SYMBOL) {
      if (x.symbol == root) return true;
      // A parameter may be another name of the same.
      return x.symbol != RMP_NONE && t_.symbols[x.symbol].kind == RMP_SYMBOL_PARAMETER &&
             t_.symbols[x.symbol].mode != RMP_MODE_IN;
    }
    for (Id k = 0; k < x.count; ++k)
      if (names(operand(e, k), root)) return true;
    return false;
  }
  void assign(Id i) {
    const rmp_code_statement s = st(i);
    // The value first, then where it goes.
    std::vector<Id> in_order = indices(s.a);
    in_order.insert(in_order.begin(), s.b);
    const bool is_kept = needs(s.a) || is_disturbed(in_order, 0);
    if (!is_split(ex(s.a).type)) {
      Id v = rewritten(s.b);
      if (is_kept) v = settled(v);
      const Id to = placed(s.a, false);
      st(i).a = to;
      st(i).b = v;
      emit(i);
      return;
    }
    const Id root = root_of(s.a);
    const bool is_param = root != RMP_NONE && t_.symbols[root].kind == RMP_SYMBOL_PARAMETER;
    const bool is_made = ex(s.b).op == RMP_EXPR_MAKE;
    auto values = leaf_values(s.b);
    // Part by part the others would see what the first have got.
    if ((is_made && (is_param || names(s.b, root))) || is_kept)
      for (Id& v : values) v = settled(v);
    auto p = partial(s.a);
    if (!p) return;
    const auto to = parts(std::move(*p), s.span);
    for (std::size_t k = 0; k < to.size() && k < values.size(); ++k)
      emit(assignment(to[k], values[k], s.span));
  }
  void call_statement(Id i) {
    const rmp_code_statement s = st(i);
    const rmp_code_expression x = ex(s.a);
    if (x.op == RMP_EXPR_CALL) {
      const Signature& sign = signatures_[t_.symbols[x.symbol].routine];
      std::vector<Id> results;
      if (sign.gives_by_place)
        for (const Id r : std::vector<Id>(sign.results))
          results.push_back(temporary(t_.symbols[r].type, s.span));
      call(s.a, results);
      return;
    }
    const std::string name = post::upper(t_.symbols[x.symbol].name);
    const bool is_write = name == "WRITE" || name == "WRITELN";
    const bool reads = name == "READ" || name == "READLN";
    std::vector<Id> all;
    Id last = last_needing(s.a);
    // A record that is made on the spot gets a variable to be written from.
    for (Id k = x.count; k-- > last + 1;)
      if (is_split(ex(operand(s.a, k)).type) && !is_place(operand(s.a, k))) {
        last = k;
        break;
      }
    for (Id k = 0; k < x.count; ++k) {
      const Id a = operand(s.a, k);
      const auto kind = t_.types[ex(a).type].kind;
      const bool is_stream = kind == RMP_TYPE_LIST || kind == RMP_TYPE_TEXT ||
                             kind == RMP_TYPE_FILE || kind == RMP_TYPE_SEMAPHORE;
      const bool later = k < last || is_disturbed(s.a, k);
      if (is_split(ex(a).type)) {
        if (!is_write || (k > 0 && t_.types[ex(operand(s.a, 0)).type].kind == RMP_TYPE_FILE)) {
          fault(ex(a).span, title_ + " has no records, and " + name + " takes one as a whole",
                "Pass the parts one by one.");
          continue;
        }
        written(a, later, all);
      } else if (is_stream || reads) {
        all.push_back(placed(a, later));
      } else {
        const Id v = rewritten(a);
        all.push_back(later ? settled(v) : v);
      }
    }
    const Id made = expression(RMP_EXPR_INTRINSIC, x.type, x.span, all, x.symbol, x.constant);
    st(i).a = made;
    emit(i);
  }
  /// A record as WRITE shows it: (a, b), and [x, y] for arrays of them.
  void written(Id e, bool later, std::vector<Id>& to) {
    const rmp_span span = ex(e).span;
    auto p = partial(e);
    if (!p) return;
    for (Id& i : p->indices) i = simple(i);
    show(*p, p->type, span, later, to);
  }
  void show(const Partial& p, Id type, const rmp_span& span, bool later, std::vector<Id>& to) {
    const rmp_code_type x = t_.types[type];
    if (to.size() > 2000) return;
    if (x.kind == RMP_TYPE_ARRAY) {
      to.push_back(text("[", span));
      for (std::int64_t k = x.lower; k <= x.upper && k - x.lower < 1000; ++k) {
        if (k > x.lower) to.push_back(text(", ", span));
        Partial inner = p;
        inner.indices.push_back(literal(t_.integer(k), span));
        inner.type = x.element;
        show(inner, x.element, span, later, to);
      }
      if (std::int64_t{x.upper} - x.lower >= 1000)
        fault(span, "this array is too long to write element by element", "Write it in a loop.");
      to.push_back(text("]", span));
      return;
    }
    to.push_back(text("(", span));
    for (Id k = 0; k < x.field_count; ++k) {
      if (k) to.push_back(text(", ", span));
      const Id of = t_.fields[x.first_field + k].type;
      Partial inner = p;
      inner.path.push_back(k);
      inner.type = of;
      if (is_split(of)) {
        show(inner, of, span, later, to);
      } else {
        const Id v = part(inner, leaf_number(inner), span);
        to.push_back(later ? settled(v) : v);
      }
    }
    to.push_back(text(")", span));
  }
  /// IF and its arms from one on; an arm that needs statements before it begins an IF of its own.
  void arms(Id i, Id first, const rmp_span& span) {
    const Id condition = rewritten(st(first).a);
    const Id body = block(st(first).body);
    st(first).a = condition;
    st(first).body = body;
    st(i).body = first;
    emit(i);
    Id last = first;
    for (Id a = st(first).next; a != RMP_NONE; a = st(a).next) {
      if (st(a).a != RMP_NONE && needs(st(a).a)) {
        const Id otherwise = statement(RMP_STMT_ARM, st(a).span);
        const Id inner = statement(RMP_STMT_IF, span);
        Chain outer = std::exchange(out_, Chain{});
        arms(inner, a, span);
        const Chain made = std::exchange(out_, outer);
        st(otherwise).body = made.head;
        st(last).next = otherwise;
        return;
      }
      const Id c = rewritten(st(a).a);
      const Id b = block(st(a).body);
      st(a).a = c;
      st(a).body = b;
      last = a;
    }
  }
  void loop(Id i) {
    const rmp_code_statement s = st(i);
    if (!needs(s.a)) {
      const Id c = rewritten(s.a);
      const Id body = block(s.body);
      st(i).a = c;
      st(i).body = body;
      emit(i);
      return;
    }
    if (!has_exit_) {
      // t := c; WHILE t ... t := c; ENDWHILE, and REPEAT ... t := c; UNTIL t
      const Id t = temporary(RMP_TYPE_BOOL, s.span);
      const auto ask = [&] {
        const Id c = rewritten(s.a);
        emit(assignment(variable(t, s.span), c, s.span));
      };
      if (s.op == RMP_STMT_WHILE) ask();
      Chain outer = std::exchange(out_, Chain{});
      Chain body;
      append(body, block(s.body));
      ask();
      append(body, std::exchange(out_, outer).head);
      const Id c = variable(t, s.span);
      st(i).a = c;
      st(i).body = body.head;
      emit(i);
      return;
    }
    // LOOP ... IF c THEN EXIT; ENDIF; ENDLOOP
    Chain outer = std::exchange(out_, Chain{});
    Chain body;
    if (s.op == RMP_STMT_REPEAT) append(body, block(s.body));
    Id c = rewritten(s.a);
    if (s.op == RMP_STMT_WHILE) c = expression(RMP_EXPR_NOT, RMP_TYPE_BOOL, s.span, {c});
    const Id leave = statement(RMP_STMT_EXIT, s.span);
    emit(if_then(c, leave, s.span));
    append(body, std::exchange(out_, outer).head);
    if (s.op == RMP_STMT_WHILE) append(body, block(s.body));
    st(i).op = RMP_STMT_LOOP;
    st(i).a = RMP_NONE;
    st(i).body = body.head;
    emit(i);
  }
  void return_(Id i) {
    const rmp_code_statement s = st(i);
    const Signature& sign = signatures_[routine_];
    if (s.a == RMP_NONE || !sign.gives_by_place) {
      const Id a = rewritten(s.a);
      st(i).a = a;
      emit(i);
      return;
    }
    const std::vector<Id> values =
        is_split(ex(s.a).type) ? leaf_values(s.a) : std::vector<Id>{rewritten(s.a)};
    for (std::size_t k = 0; k < values.size() && k < sign.results.size(); ++k)
      emit(assignment(variable(sign.results[k], s.span), values[k], s.span));
    st(i).a = RMP_NONE;
    emit(i);
  }
  void move(Id i) {
    rmp_code_motion m = t_.motions[st(i).motion];
    std::vector<Id> all;
    for (Id k = 0; k < m.target_count; ++k) all.push_back(t_.links[m.first_target + k]);
    for (Id k = 0; k < m.attribute_count; ++k)
      all.push_back(t_.attributes[m.first_attribute + k].value);
    std::vector<Id> made;
    bool changed = false;
    std::size_t last = 0;
    for (std::size_t k = all.size(); k-- > 1 && last == 0;)
      if (needs(all[k])) last = k;
    for (std::size_t k = 0; k < all.size(); ++k) {
      Id v = rewritten(all[k]);
      if (k < last || is_disturbed(all, k)) v = settled(v);
      changed = changed || v != all[k];
      made.push_back(v);
    }
    if (m.until != RMP_NONE && !is_refused(m.until, "UNTIL")) {
      const Id u = asked_again(m.until);
      changed = changed || u != m.until;
      m.until = u;
    }
    if (changed) {
      m.first_target = static_cast<Id>(t_.links.size());
      t_.links.insert(t_.links.end(), made.begin(), made.begin() + m.target_count);
      const Id first = static_cast<Id>(t_.attributes.size());
      for (Id k = 0; k < m.attribute_count; ++k) {
        rmp_code_attribute a = t_.attributes[m.first_attribute + k];
        a.value = made[m.target_count + k];
        t_.attributes.push_back(a);
      }
      m.first_attribute = first;
      t_.motions.push_back(m);
      st(i).motion = static_cast<Id>(t_.motions.size() - 1);
    }
    emit(i);
  }

  static constexpr int kDeepest = 1200;
  std::string title_;
  std::vector<Remark>& remarks_;
  bool no_records_, no_functions_, no_out_, no_short_, has_locals_, has_exit_;
  bool has_recursion_ = false;  ///< where there is none, recursion.h has told
  std::vector<bool> is_split_;
  std::map<std::tuple<std::int32_t, std::int32_t, Id>, Id> arrays_;
  std::map<Id, std::vector<Leaf>> leaf_types_;
  std::map<Id, std::vector<Id>> parts_;  ///< of a symbol: those that it has become
  std::map<Id, Id> moved_;
  std::vector<Signature> signatures_;
  std::vector<std::uint8_t> needs_;           ///< 0 = not looked at, 1 = no, 2 = yes
  std::vector<std::set<Id>> named_, called_;  ///< by routine
  Effects effects_;
  const InnerCalls* inner_ = nullptr;
  Id first_symbols_ = 0, routine_ = 0;
  Chain out_;
  bool may_hoist_ = true;
  int depth_ = 0;
};

}  // namespace

void to_scalars(ProgramTables& tables, const PostCapabilities& caps, std::vector<Remark>& remarks) {
  Scalars(tables, caps, remarks).run();
}

void to_statements(ProgramTables& tables, std::string_view title, const InnerCalls& inner,
                   std::vector<Remark>& remarks) {
  Scalars(tables, title, inner, remarks).run();
}

}  // namespace robomosp::program_post
