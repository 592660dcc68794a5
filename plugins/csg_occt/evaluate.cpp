// SPDX-License-Identifier: Apache-2.0
#include "evaluate.h"

#include <algorithm>
#include <unordered_set>

#include "content.h"
#include "modifiers.h"
#include "primitives.h"
#include "prismatic.h"
#include "scaling.h"
#include "touching.h"

#include <BRepCheck_Analyzer.hxx>

namespace robomosp::csg_occt {
namespace {

constexpr std::size_t kMostNotes = 20;
constexpr std::size_t kMostRecent = 1'000;
// An operation is split into "all but what changed" and "what changed" when at most this many
// items changed since its last evaluation and enough others did not.
constexpr std::size_t kMostChanged = 2, kLeastKept = 3;
// Shortcuts that fail may look at so many times the terms there are, however deep the tree.
constexpr std::size_t kShortcutBudget = 8;

/// A solid of one item, moved into the operation's frame.
struct Operand {
  Solid solid;
  std::vector<TopoDS_Shape> turned;  ///< by turns_of; empty when it cannot be turned
  std::size_t item = 0;
};

/// Groups of operands whose boxes meet. None when it is cancelled.
std::vector<std::vector<std::size_t>> groups(const std::vector<Operand>& operands,
                                             const Progress& progress) {
  std::vector<const Bnd_Box*> boxes;
  for (const Operand& o : operands) boxes.push_back(&o.solid.box);
  return touching_sets(
      boxes, [&](std::size_t a, std::size_t b) { return operands[a].item != operands[b].item; },
      progress);
}

/// Pairs that meet among the operands of one operation. Open CASCADE looks at all of them before it
/// can be told to stop.
constexpr std::size_t kMostPairs = 1'000'000;

Result<void> check_pairs(const std::vector<const Operand*>& operands, const Progress& progress) {
  if (operands.size() * operands.size() < 2 * kMostPairs) return {};
  const auto low = [](const Operand* o) { return o->solid.box.CornerMin().X(); };
  std::vector<const Operand*> order = operands, active;
  std::sort(order.begin(), order.end(),
            [&](const Operand* a, const Operand* b) { return low(a) < low(b); });
  std::size_t count = 0;
  for (const Operand* o : order) {
    if (progress.cancelled()) return cancelled_error();
    std::erase_if(active, [&](const Operand* a) { return a->solid.box.CornerMax().X() < low(o); });
    for (const Operand* a : active) count += boxes_meet(a->solid.box, o->solid.box) ? 1 : 0;
    if (count > kMostPairs)
      return error(ErrorCode::invalid_argument,
                   "of " + std::to_string(operands.size()) + " solids more than " +
                       std::to_string(kMostPairs) + " pairs meet, too many for one operation",
                   "Combine them in groups first, or leave out those that lie inside others.");
    active.push_back(o);
  }
  return {};
}

std::string kind_text(CsgKind kind) {
  std::string text(csg_info(kind).name);
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

class Evaluator {
 public:
  Evaluator(const Plan& plan, const CsgTree& tree, TermCache& cache, FaceMemory& faces,
            TopologyGate& gate, Shortcut shortcut, Progress& progress)
      : plan_(plan),
        shortcut_(shortcut),
        shortcut_budget_(shortcut == Shortcut::off ? 0 : kShortcutBudget * plan.terms.size()),
        tree_(tree),
        cache_(cache),
        faces_(faces),
        gate_(gate),
        progress_(progress),
        values_(plan.terms.size()) {}

  Result<ValuePtr> run() {
    std::vector<std::size_t> open{plan_.root.term};
    std::vector<bool> opened(plan_.terms.size(), false);
    while (!open.empty()) {
      if (progress_.cancelled()) return cancelled_error();
      const std::size_t t = open.back();
      const Term& term = plan_.terms[t];
      if (!values_[t]) values_[t] = cache_.find(term.key);
      if (values_[t]) {
        open.pop_back();
        continue;
      }
      if (!opened[t]) {
        opened[t] = true;
        RMP_TRY_ASSIGN(values_[t], take_shortcut(t));
        if (values_[t]) {
          cache_.put(term.key, values_[t]);
          open.pop_back();
          continue;
        }
        if (shortcut_ == Shortcut::only)
          return error(ErrorCode::unsupported, "the shortcut for prisms does not apply");
        for (auto item = term.items.rbegin(); item != term.items.rend(); ++item)
          if (!values_[item->term] && !is_primitive(item->term)) open.push_back(item->term);
        if (open.back() != t) continue;
      }
      Result<ValuePtr> made = compute(term);
      if (!made) return in_node(std::move(made).error(), term);
      values_[t] = *made;
      cache_.put(term.key, values_[t]);
      ++finished_;
      open.pop_back();
    }
    const ValuePtr& all = values_[plan_.root.term];
    if (all->solids.empty()) return nothing_left();
    return all;
  }

 private:
  /// Why an operation may be empty. Within others it is nothing, as an empty set is; a solid is
  /// not.
  static const char* why_empty(CsgKind kind) {
    return kind == CsgKind::difference
               ? "Nothing remains of the first solid; make the others smaller."
               : "The solids have no common volume; move them together.";
  }
  /// The error of a root that is empty, at the operation that made it so.
  Error nothing_left() const {
    std::size_t t = plan_.root.term;
    for (bool goes_on = true; goes_on;) {
      goes_on = false;
      for (const Item& item : plan_.terms[t].items) {
        const bool is_empty = values_[item.term] && values_[item.term]->solids.empty();
        if (!is_empty) {
          if (plan_.terms[t].kind == CsgKind::difference) break;  // only the first counts
          continue;
        }
        t = item.term;
        goes_on = true;
        break;
      }
    }
    const Term& term = plan_.terms[t];
    return in_node(error(ErrorCode::invalid_argument, "the result is empty", why_empty(term.kind)),
                   term);
  }

  Error in_node(Error e, const Term& term) const {
    if (e.code == ErrorCode::cancelled || !e.where.empty()) return e;
    e.message = kind_text(tree_.nodes[term.node].kind) + ": " + e.message;
    e.where = csg_node_text(tree_.nodes[term.node], term.node);
    return e;
  }

  double fraction(double within) const {
    return 0.95 * (static_cast<double>(finished_) + within) /
           static_cast<double>(plan_.terms.size());
  }

  bool is_primitive(std::size_t t) const {
    return plan_.terms[t].items.empty() && !has_content(plan_.terms[t].kind);
  }

  // Primitives are quicker built than waited for: every evaluation makes its own, so that solids
  // with a size in common share no topology.
  Result<ValuePtr> primitive(const Term& term) {
    ValuePtr& known = primitives_[term.key];
    if (known) return known;
    Result<ValuePtr> made = guarded("the primitive", [&]() -> Result<ValuePtr> {
      auto value = std::make_shared<Value>();
      if (has_content(term.kind)) {
        RMP_TRY_ASSIGN(Content content, build_content(tree_.nodes[term.node], faces_, progress_));
        value->solids = std::move(content.solids);
        for (std::string& note : content.notes) value->notes.push_back({{}, std::move(note)});
        value->lineage = {gate_.new_number()};
        for (const Solid& solid : value->solids) faces_.set_verified(solid.shape);
        return ValuePtr(value);
      }
      if (term.kind == CsgKind::ellipsoid) {
        std::array<double, 3> half{};
        for (std::size_t k = 0; k < 3; ++k) half[k] = term.sizes[k] * kMillimetresPerMetre;
        RMP_TRY_ASSIGN(Solid solid, ellipsoid(half, faces_, progress_));
        value->solids.push_back(std::move(solid));
      } else {
        value->solids.push_back(measured(build_primitive(term.kind, term.sizes), faces_));
      }
      if (!(value->solids[0].volume > 0))
        return error(ErrorCode::plugin_failed, "the solid has no volume",
                     "Make its sizes less different from each other.");
      value->lineage = {gate_.new_number()};
      faces_.set_verified(value->solids[0].shape);
      return ValuePtr(value);
    });
    if (!made) return in_node(std::move(made).error(), term);
    known = *made;
    return made;
  }

  Result<bool> are_primitives_apart(const Term& term) {
    if (term.kind != CsgKind::union_) return false;
    for (const Item& item : term.items)
      if (!is_primitive(item.term)) return false;
    std::vector<Operand> operands;
    for (std::size_t i = 0; i < term.items.size(); ++i) {
      RMP_TRY_ASSIGN(const ValuePtr value, primitive(plan_.terms[term.items[i].term]));
      operands.push_back({value->solids[0], {}, i});
      operands.back().solid.box = operands.back().solid.box.Transformed(term.items[i].pose);
    }
    return groups(operands, progress_).size() == operands.size();
  }

  /// Null when the general way has to be gone.
  Result<ValuePtr> take_shortcut(std::size_t t) {
    const Term& term = plan_.terms[t];
    if (!is_csg_operation(term.kind) || term.general || term.items.size() > shortcut_budget_)
      return ValuePtr();
    // Solids that are only put together are quicker put together.
    RMP_TRY_ASSIGN(const bool apart, are_primitives_apart(term));
    if (apart) return ValuePtr();
    Result<ValuePtr> made = guarded("the operation", [&]() -> Result<ValuePtr> {
      std::size_t cost = 0;
      auto outcome = build_prismatic(plan_, t, faces_, progress_, cost);
      shortcut_budget_ -= std::min(shortcut_budget_, cost);
      if (progress_.cancelled()) return cancelled_error();
      if (!outcome) return ValuePtr();
      if (shortcut_ == Shortcut::only)
        for (const Solid& solid : outcome->solids)
          if (!BRepCheck_Analyzer(solid.shape).IsValid())
            return error(ErrorCode::plugin_failed, "the shortcut made an invalid solid");
      auto value = std::make_shared<Value>();
      value->solids = std::move(outcome->solids);
      value->notes = std::move(outcome->notes);
      if (value->notes.size() > kMostNotes) value->notes.resize(kMostNotes);
      value->lineage = {gate_.new_number()};
      return ValuePtr(value);
    });
    if (!made) return in_node(std::move(made).error(), term);
    return made;
  }

  /// A fillet, a chamfer, a mirror image or a stretched solid.
  Result<ValuePtr> modify(const Term& term) {
    return guarded("the operation", [&]() -> Result<ValuePtr> {
      ValuePtr& child = values_[term.items[0].term];
      if (!child) {
        RMP_TRY_ASSIGN(child, primitive(plan_.terms[term.items[0].term]));
        ++finished_;
      }
      auto value = std::make_shared<Value>();
      value->notes = child->notes;
      for (Note& note : value->notes) note.path.insert(note.path.begin(), 0);
      if (child->solids.empty()) {
        value->lineage = child->lineage;
        return ValuePtr(value);
      }
      const auto claim = gate_.claim(child->lineage, progress_);
      if (!claim) return cancelled_error();
      // A mirror image is a copy, as what is stretched; the others keep the faces they do not
      // touch.
      const bool is_stretch = term.kind == CsgKind::scale;
      value->lineage =
          term.kind == CsgKind::mirror || is_stretch ? Lineage{gate_.new_number()} : child->lineage;
      progress_.report(fraction(0), kind_text(term.kind));
      std::vector<Operand> operands;
      append_operands(term, 0, operands);
      std::vector<Solid> solids;
      for (Operand& o : operands) solids.push_back(std::move(o.solid));
      if (is_stretch) {
        RMP_TRY_ASSIGN(
            value->solids,
            stretched(solids, {term.sizes[0], term.sizes[1], term.sizes[2]}, faces_, progress_));
        return ValuePtr(value);
      }
      RMP_TRY_ASSIGN(value->solids,
                     run_modifier(tree_.nodes[term.node], solids, faces_, progress_));
      return ValuePtr(value);
    });
  }

  Result<ValuePtr> compute(const Term& term) {
    if (term.items.empty()) return primitive(term);
    if (is_csg_modifier(term.kind)) return modify(term);
    return guarded("the operation", [&]() -> Result<ValuePtr> {
      auto value = std::make_shared<Value>();
      Stock stock = find_stock(term);
      value->lineage = stock.value ? stock.value->lineage : Lineage();
      for (std::size_t i = 0; i < term.items.size(); ++i) {
        ValuePtr& item = values_[term.items[i].term];
        if (stock.value && stock.kept[i] && !item) continue;  // a primitive that is not needed
        if (!item) {
          RMP_TRY_ASSIGN(item, primitive(plan_.terms[term.items[i].term]));
          ++finished_;
        }
        for (const Note& note : item->notes)
          if (value->notes.size() < kMostNotes) {
            value->notes.push_back(note);
            value->notes.back().path.insert(value->notes.back().path.begin(),
                                            static_cast<std::uint32_t>(i));
          }
        if (!(stock.value && stock.kept[i])) merge(value->lineage, item->lineage);
      }
      const auto claim = gate_.claim(value->lineage, progress_);
      if (!claim) return cancelled_error();
      std::vector<Operand> operands;
      for (std::size_t i = 0; i < term.items.size(); ++i)
        if (!(stock.value && stock.kept[i])) append_operands(term, i, operands);
      if (term.kind == CsgKind::intersection) {
        RMP_TRY(intersect(term, operands, *value));
      } else {
        RMP_TRY(combine_by_edit(term, operands, stock, *value));
      }
      if (value->solids.empty() && has_content_in(term) && value->notes.size() < kMostNotes)
        value->notes.push_back({{},
                                term.kind == CsgKind::difference
                                    ? "is empty: nothing remains of the first solid"
                                    : "is empty: the solids have no common volume"});
      return ValuePtr(value);
    });
  }

  /// Whether an operation had something to begin with, so that it is empty by itself.
  bool has_content_in(const Term& term) const {
    if (term.kind == CsgKind::union_) return false;
    for (const Item& item : term.items) {
      const bool is_empty = values_[item.term] && values_[item.term]->solids.empty();
      if (term.kind == CsgKind::difference) return !is_empty;
      if (is_empty) return false;
    }
    return true;
  }

  void append_operands(const Term& term, std::size_t i, std::vector<Operand>& operands) const {
    const Item& item = term.items[i];
    const Term& source = plan_.terms[item.term];
    for (const Solid& s : values_[item.term]->solids) {
      Operand operand{s, {}, i};
      if (!is_identity(item.pose)) {
        operand.solid.shape = placed(s.shape, item.pose);
        operand.solid.box = s.box.Transformed(item.pose);
      }
      for (const gp_Trsf& turn : turns_of(source.kind, source.sizes))
        operand.turned.push_back(placed(s.shape, item.pose * turn));
      operands.push_back(std::move(operand));
    }
  }

  static Key item_key(const Plan& plan, const Item& item) {
    Key key = plan.terms[item.term].key;
    key.mix(item.pose);
    return key;
  }

  static Operand stock_operand(const Solid& solid) { return {solid, {}, 0}; }

  /// What an earlier evaluation of an operation left to start from.
  struct Stock {
    std::vector<bool> kept;  ///< items in it; empty when there are too few
    Key key;
    ValuePtr value;  ///< null until it is made
  };

  // While a user drags one hole, all other holes stay: cutting those once and keeping that stock
  // turns every later step of the drag into one small cut.
  Stock find_stock(const Term& term) {
    Stock stock;
    if (term.kind == CsgKind::intersection) return stock;
    std::vector<Key> keys;
    for (const Item& item : term.items) keys.push_back(item_key(plan_, item));
    Key context;
    context.mix(static_cast<std::uint64_t>(term.kind));
    context.mix(keys[0]);
    const std::vector<Key> before = cache_.exchange_recent(context, keys);
    const std::unordered_set<Key, KeyHash> known(before.begin(), before.end());
    std::vector<bool> kept(keys.size());
    std::size_t kept_count = 0;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      kept[i] = i == 0 || known.contains(keys[i]);
      kept_count += kept[i] ? 1U : 0U;
    }
    const std::size_t changed = keys.size() - kept_count;
    if (changed == 0 || changed > kMostChanged || kept_count < kLeastKept) return stock;
    stock.key.mix(static_cast<std::uint64_t>(term.kind));
    for (std::size_t i = 0; i < keys.size(); ++i)
      if (kept[i]) {
        stock.key.mix(plan_.terms[term.items[i].term].key);
        stock.key.mix(term.items[i].pose);
      }
    stock.kept = std::move(kept);
    stock.value = cache_.find(stock.key);
    return stock;
  }

  /// `operands` lacks those of a stock that is made already.
  Result<void> combine_by_edit(const Term& term, const std::vector<Operand>& operands, Stock& stock,
                               Value& value) {
    if (stock.kept.empty()) return combine(term, operands, value, 0, 1);
    if (!stock.value) {
      std::vector<Operand> some;
      for (const Operand& o : operands)
        if (stock.kept[o.item]) some.push_back(o);
      auto made = std::make_shared<Value>();
      RMP_TRY(combine(term, some, *made, 0, 0.8));
      made->lineage = value.lineage;
      stock.value = made;
      cache_.put(stock.key, stock.value);
    }
    for (const Note& note : stock.value->notes)
      if (note.path.empty() && value.notes.size() < kMostNotes) value.notes.push_back(note);
    std::vector<Operand> rest;
    for (const Solid& s : stock.value->solids) rest.push_back(stock_operand(s));
    for (const Operand& o : operands)
      if (!stock.kept[o.item]) rest.push_back(o);
    return combine(term, rest, value, 0.8, 1);
  }

  Result<void> combine(const Term& term, const std::vector<Operand>& operands, Value& value,
                       double from, double to) {
    return term.kind == CsgKind::union_ ? unite(operands, value, from, to)
                                        : cut(operands, value, from, to);
  }

  Result<void> apply(CsgKind kind, const std::vector<const Operand*>& objects,
                     const std::vector<const Operand*>& tools, Value& value, double from,
                     double to) {
    std::vector<const Operand*> all = objects;
    all.insert(all.end(), tools.begin(), tools.end());
    RMP_TRY(check_pairs(all, progress_));
    BooleanCall call;
    call.kind = kind;
    for (const auto* list : {&objects, &tools})
      for (const Operand* o : *list)
        call.turned.resize(std::max(call.turned.size(), o->turned.size()));
    const auto fill = [&](const std::vector<const Operand*>& list, std::vector<Solid>& solids,
                          std::vector<TopoDS_Shape> BooleanCall::Turned::*turned) {
      for (const Operand* o : list) {
        solids.push_back(o->solid);
        for (std::size_t t = 0; t < call.turned.size(); ++t)
          (call.turned[t].*turned).push_back(t < o->turned.size() ? o->turned[t] : o->solid.shape);
      }
    };
    fill(objects, call.objects, &BooleanCall::Turned::objects);
    fill(tools, call.tools, &BooleanCall::Turned::tools);
    RMP_TRY_ASSIGN(BooleanOutcome outcome,
                   run_boolean(call, faces_, progress_, fraction(from), fraction(to)));
    if (!outcome.remedy.empty()) value.notes.push_back({{}, outcome.remedy});
    std::move(outcome.solids.begin(), outcome.solids.end(), std::back_inserter(value.solids));
    return {};
  }

  Result<void> unite(const std::vector<Operand>& operands, Value& value, double from, double to) {
    const auto all = groups(operands, progress_);
    if (progress_.cancelled()) return cancelled_error();
    for (const auto& group : all) {
      if (progress_.cancelled()) return cancelled_error();
      if (group.size() == 1) {
        value.solids.push_back(operands[group[0]].solid);
        continue;
      }
      std::vector<const Operand*> tools;
      for (std::size_t k = 1; k < group.size(); ++k) tools.push_back(&operands[group[k]]);
      RMP_TRY(apply(CsgKind::union_, {&operands[group[0]]}, tools, value, from, to));
    }
    return {};
  }

  Result<void> cut(const std::vector<Operand>& operands, Value& value, double from, double to) {
    std::vector<bool> used(operands.size(), false);
    for (const Operand& object : operands) {
      if (object.item != 0) continue;
      if (progress_.cancelled()) return cancelled_error();
      std::vector<const Operand*> tools;
      for (std::size_t k = 0; k < operands.size(); ++k)
        if (operands[k].item != 0 && boxes_meet(object.solid.box, operands[k].solid.box)) {
          tools.push_back(&operands[k]);
          used[k] = true;
        }
      if (tools.empty()) value.solids.push_back(object.solid);
      else RMP_TRY(apply(CsgKind::difference, {&object}, tools, value, from, to));
    }
    std::size_t last_told = 0;
    for (std::size_t k = 0; k < operands.size(); ++k) {
      const std::size_t item = operands[k].item;
      if (item == 0 || used[k] || item == last_told || value.notes.size() >= kMostNotes) continue;
      if (operands.front().item != 0) continue;  // nothing to cut
      last_told = item;
      value.notes.push_back(
          {{static_cast<std::uint32_t>(item)}, "cuts nothing: it does not reach the solid"});
    }
    return {};
  }

  Result<void> intersect(const Term& term, const std::vector<Operand>& operands, Value& value) {
    std::vector<Operand> current, next;
    for (const Operand& o : operands)
      if (o.item == 0) current.push_back(o);
    const std::size_t items = term.items.size();
    for (std::size_t i = 1; i < items; ++i) {
      next.clear();
      for (const Operand& a : current) {
        if (progress_.cancelled()) return cancelled_error();
        std::vector<const Operand*> tools;
        for (const Operand& o : operands)
          if (o.item == i && boxes_meet(a.solid.box, o.solid.box)) tools.push_back(&o);
        if (tools.empty()) continue;
        Value step;
        RMP_TRY(apply(CsgKind::intersection, {&a}, tools, step, double(i - 1) / double(items),
                      double(i) / double(items)));
        value.notes.insert(value.notes.end(), step.notes.begin(), step.notes.end());
        for (Solid& s : step.solids) next.push_back({std::move(s), {}, 0});
      }
      std::swap(current, next);
    }
    for (Operand& o : current) value.solids.push_back(std::move(o.solid));
    return {};
  }

  const Plan& plan_;
  Shortcut shortcut_;
  std::size_t shortcut_budget_;
  const CsgTree& tree_;
  TermCache& cache_;
  FaceMemory& faces_;
  TopologyGate& gate_;
  Progress& progress_;
  std::vector<ValuePtr> values_;
  std::unordered_map<Key, ValuePtr, KeyHash> primitives_;
  std::size_t finished_ = 0;
};

}  // namespace

ValuePtr TermCache::find(const Key& key) {
  const std::lock_guard lock(mutex_);
  const auto found = index_.find(key);
  if (found == index_.end()) return {};
  entries_.splice(entries_.begin(), entries_, found->second);
  return found->second->value;
}

void TermCache::put(const Key& key, ValuePtr value) {
  std::vector<ValuePtr> dropped;  // freed after the lock: a B-rep can take a while to free
  const std::lock_guard lock(mutex_);
  if (index_.contains(key)) return;
  entries_.push_front({key, std::move(value)});
  index_[key] = entries_.begin();
  while (entries_.size() > limit_) {
    dropped.push_back(std::move(entries_.back().value));
    index_.erase(entries_.back().key);
    entries_.pop_back();
  }
}

std::vector<Key> TermCache::exchange_recent(const Key& context, std::vector<Key> now) {
  const std::lock_guard lock(mutex_);
  if (recent_.size() >= kMostRecent && !recent_.contains(context)) recent_.clear();
  std::swap(recent_[context], now);
  return now;
}

Result<ValuePtr> evaluate_plan(const Plan& plan, const CsgTree& tree, TermCache& cache,
                               FaceMemory& faces, TopologyGate& gate, Shortcut shortcut,
                               Progress& progress) {
  return Evaluator(plan, tree, cache, faces, gate, shortcut, progress).run();
}

}  // namespace robomosp::csg_occt
