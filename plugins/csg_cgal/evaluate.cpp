// SPDX-License-Identifier: GPL-3.0-or-later
#include "evaluate.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <robomosp/sdk/csg_check.h>

#include "tessellate.h"

namespace robomosp::csg_cgal {
namespace {

struct Item {
  std::size_t term = 0;
  Affine pose;                 ///< term's frame in the frame of the term that uses it
  std::uint64_t instance = 0;  ///< tells the faces of copies apart; 0 = the one
};

/// A primitive, or an operation on items. For a difference, items[0] is what is cut.
struct Term {
  CsgKind kind = CsgKind::box;
  std::size_t node = 0;  ///< the node of the user's tree to name in messages
  std::vector<Item> items;
};

/// What a node amounts to in its parent's eyes. `kind` is the operation on the items, or, when
/// `single`, there is one item and no operation left to do.
struct Form {
  bool single = false;
  CsgKind kind = CsgKind::union_;
  std::size_t node = 0;
  std::vector<Item> items;
};

// Patterns of patterns may place so many solids in all.
constexpr double kMostCopies = 20'000;

class Planner {
 public:
  Planner(const CsgTree& tree, const Progress& progress) : tree_(tree), progress_(progress) {}

  Result<void> run() {
    RMP_TRY(check());
    std::vector<Form> forms(tree_.nodes.size());
    for (std::size_t i = forms.size(); i-- > 0;) {
      stop_if_cancelled(progress_);
      const CsgNode& node = tree_.nodes[i];
      std::vector<Form> parts;
      for (std::size_t child = links_.first_child[i]; child != 0;
           child = links_.next_sibling[child]) {
        parts.push_back(std::move(forms[child]));
        move_by(parts.back(), poses_[child]);
      }
      if (is_csg_operation(node.kind)) forms[i] = combine(i, std::move(parts));
      else if (is_csg_modifier(node.kind)) {
        RMP_TRY_ASSIGN(forms[i], copies(i, std::move(parts.front())));
      } else forms[i] = {true, node.kind, i, {add({node.kind, i, {}})}};
    }
    move_by(forms[0], poses_[0]);
    root = as_item(std::move(forms[0]));
    return {};
  }

  std::vector<Term> terms;  ///< items come before the terms that use them
  Item root;

 private:
  Result<void> check() {
    RMP_TRY_ASSIGN(links_, check_csg_tree(tree_, kRigid));
    for (std::size_t i = 0; i < tree_.nodes.size(); ++i) {
      const CsgNode& node = tree_.nodes[i];
      poses_.push_back(*to_affine(node.placement));
      RMP_TRY(check_kind(node, i));
    }
    return {};
  }

  Form combine(std::size_t i, std::vector<Form> parts) {
    if (parts.size() == 1) return std::move(parts.front());
    const CsgKind kind = tree_.nodes[i].kind;
    Form form{false, kind, i, {}};
    for (std::size_t k = 0; k < parts.size(); ++k) {
      Form& part = parts[k];
      bool absorb = part.single;
      if (kind == CsgKind::difference)
        absorb |= part.kind == (k == 0 ? CsgKind::difference : CsgKind::union_);
      else absorb |= part.kind == kind;
      if (!absorb) form.items.push_back(as_item(std::move(part)));
      else form.items.insert(form.items.end(), part.items.begin(), part.items.end());
    }
    return form;
  }

  /// A mirror or pattern is a union of copies, a scale one copy.
  Result<Form> copies(std::size_t i, Form part) {
    const CsgNode& node = tree_.nodes[i];
    const auto& s = node.sizes;
    std::vector<Affine> where;
    if (node.kind == CsgKind::scale) {
      Affine stretch;
      for (std::size_t k = 0; k < 3; ++k) stretch.A[4 * k] = s[k];
      where.push_back(stretch);
    } else if (node.kind == CsgKind::mirror) {
      const Vec3 given{s[0], s[1], s[2]};
      if (norm(given) == 0)
        return error(ErrorCode::invalid_argument, "mirror normal is (0, 0, 0)",
                     "Give it a direction.", csg_node_text(node, i));
      const Vec3 n = unit(given);
      Affine mirror;
      for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t c = 0; c < 3; ++c)
          mirror.A[3 * r + c] = (r == c ? 1 : 0) - 2 * n[r] * n[c];
      mirror.t = n * (2 * s[3]);
      if (s[4] != 0) where.emplace_back();
      where.push_back(cleaned(mirror));
    } else {
      const int count = static_cast<int>(s[0]);
      for (int k = 0; k < count; ++k) {
        Affine copy;
        if (node.kind == CsgKind::linear_pattern) {
          copy.t = Vec3{s[1], s[2], s[3]} * k;
        } else {
          const bool is_full = std::abs(std::abs(s[1]) - kCsgFullTurn) < 1e-9;
          const double step = s[1] / std::max(1, is_full ? count : count - 1),
                       c = std::cos(step * k), sn = std::sin(step * k);
          copy.A = {c, -sn, 0, sn, c, 0, 0, 0, 1};
        }
        where.push_back(cleaned(copy));
      }
    }
    if (where.size() > 1 && where[0].A == where[1].A && where[0].t == where[1].t)
      where.resize(1);  // all at one place
    if (where.size() == 1) {
      move_by(part, where.front());
      return part;
    }
    const Item item = as_item(std::move(part));
    const double placed = weights_[item.term] * static_cast<double>(where.size());
    if (placed > kMostCopies)
      return error(ErrorCode::invalid_argument,
                   "the pattern makes " + csg_number_text(placed) + " copies; at most " +
                       csg_number_text(kMostCopies) + " are made, including nested patterns",
                   "Reduce the count.", csg_node_text(node, i));
    Form form{false, CsgKind::union_, i, {}};
    for (std::size_t k = 0; k < where.size(); ++k)
      form.items.push_back({item.term, where[k] * item.pose,
                            k == 0 ? item.instance : mixed(mixed(item.instance, i), k)});
    return form;
  }

  static void move_by(Form& form, const Affine& pose) {
    if (pose.is_identity()) return;
    for (Item& item : form.items) item.pose = pose * item.pose;
  }

  Item as_item(Form form) {
    if (form.single) return form.items.front();
    return add({form.kind, form.node, std::move(form.items)});
  }

  Item add(Term term) {
    double weight = term.items.empty() ? 1 : 0;
    for (const Item& item : term.items) weight += weights_[item.term];
    weights_.push_back(weight);
    terms.push_back(std::move(term));
    return {terms.size() - 1, {}, 0};
  }

  const CsgTree& tree_;
  const Progress& progress_;
  CsgLinks links_;
  std::vector<Affine> poses_;
  std::vector<double> weights_;  // primitives that each term places
};

class Evaluator {
 public:
  Evaluator(const CsgTree& tree, const Planner& plan, Imports& imports, Progress& progress)
      : tree_(tree), plan_(plan), imports_(imports), progress_(progress) {}

  Result<Evaluated> run() {
    std::vector<std::optional<ExactSolid>> values(plan_.terms.size());
    std::vector<bool> is_nothing(plan_.terms.size(), false);
    RMP_TRY(import_all(values));
    std::vector<std::size_t> uses(plan_.terms.size(), 0);
    for (const Term& t : plan_.terms)
      for (const Item& item : t.items) ++uses[item.term];
    for (std::size_t t = 0; t < plan_.terms.size(); ++t) {
      stop_if_cancelled(progress_);
      const Term& term = plan_.terms[t];
      const CsgNode& node = tree_.nodes[term.node];
      progress_.report(static_cast<double>(t) / static_cast<double>(plan_.terms.size()),
                       "evaluating triangles");
      if (values[t]) continue;
      if (term.items.empty()) {
        RMP_TRY_ASSIGN(values[t], primitive(node, term.node).in(csg_node_text(node, term.node)));
        continue;
      }
      std::vector<ExactSolid> operands;
      std::vector<std::size_t> nodes;
      bool is_empty = false;  // an empty operand is nothing, as an empty set is
      for (std::size_t k = 0; k < term.items.size() && !is_empty; ++k) {
        const Item& item = term.items[k];
        if (!is_nothing[item.term]) {
          operands.push_back(values[item.term]->moved(item.pose, item.instance));
          nodes.push_back(plan_.terms[item.term].node);
        } else if (term.kind == CsgKind::intersection ||
                   (term.kind == CsgKind::difference && k == 0)) {
          is_empty = true;
        }
      }
      if (is_empty || operands.empty()) {
        is_nothing[t] = true;
      } else {
        RMP_TRY_ASSIGN(
            const BooleanOutcome made,
            operate(term, std::move(operands), nodes).in(csg_node_text(node, term.node)));
        if (!made.remedy.empty())
          notes_.push_back(csg_node_text(node, term.node) + ": " + made.remedy + ".");
        values[t] = made.solid;
        if (made.solid.empty() || !(made.solid.volume() > 0)) {
          is_nothing[t] = true;
          const bool is_difference = term.kind == CsgKind::difference;
          nothing_left_ =
              error(ErrorCode::invalid_argument, "the result is empty",
                    is_difference ? "Nothing remains of the first solid; make the others smaller."
                                  : "The solids have no common volume; move them together.",
                    csg_node_text(node, term.node));
          notes_.push_back(csg_node_text(node, term.node) +
                           (is_difference ? " is empty: nothing remains of the first solid."
                                          : " is empty: the solids have no common volume."));
        }
      }
      for (const Item& item : term.items)
        if (--uses[item.term] == 0) values[item.term].reset();
    }
    if (is_nothing[plan_.root.term]) return *nothing_left_;
    ExactSolid solid = values[plan_.root.term]->moved(plan_.root.pose, plan_.root.instance);
    add_closing_notes(solid);
    return Evaluated{std::move(solid), std::move(notes_)};
  }

 private:
  static std::uint64_t key_of(const CsgNode& node, std::size_t index) {
    const std::uint64_t key = mixed(0, static_cast<std::uint64_t>(node.kind));
    return node.name.empty() ? mixed(key, index) : mixed(key, node.name);
  }

  static Result<ExactSolid> primitive(const CsgNode& node, std::size_t index) {
    RMP_TRY_ASSIGN(PatchMesh mesh, tessellate(node, key_of(node, index)));
    return ExactSolid::from(std::move(mesh));
  }

  Result<void> import_all(std::vector<std::optional<ExactSolid>>& values) {
    std::vector<Imports::Wish> wishes;
    std::vector<std::size_t> terms;
    for (std::size_t t = 0; t < plan_.terms.size(); ++t) {
      const Term& term = plan_.terms[t];
      if (!term.items.empty() || term.kind != CsgKind::imported) continue;
      wishes.push_back({&tree_.nodes[term.node], key_of(tree_.nodes[term.node], term.node)});
      terms.push_back(t);
    }
    auto made = imports_.get(wishes);
    stop_if_cancelled(progress_);
    for (std::size_t i = 0; i < terms.size(); ++i) {
      const std::size_t index = plan_.terms[terms[i]].node;
      const std::string where = csg_node_text(tree_.nodes[index], index);
      RMP_TRY_ASSIGN(Import import, std::move(made[i]).in(where));
      for (const std::string& r : import.repairs) notes_.push_back(where + ": " + r + ".");
      values[terms[i]] = std::move(import.solid);
    }
    return {};
  }

  /// `nodes` are those of the operands.
  Result<BooleanOutcome> operate(const Term& term, std::vector<ExactSolid> operands,
                                 const std::vector<std::size_t>& nodes) {
    switch (term.kind) {
      case CsgKind::difference: {
        const ExactSolid first = operands.front();
        std::vector<ExactSolid> tools;
        for (std::size_t k = 1; k < operands.size(); ++k) {
          if (first.box().meets(operands[k].box())) {
            tools.push_back(std::move(operands[k]));
            continue;
          }
          const std::size_t n = nodes[k];
          notes_.push_back(csg_node_text(tree_.nodes[n], n) +
                           ": cuts nothing: it does not reach the solid.");
        }
        return subtract(first, std::move(tools), progress_);
      }
      case CsgKind::intersection: return intersect(std::move(operands), progress_);
      default: return unite(std::move(operands), progress_);
    }
  }

  void add_closing_notes(const ExactSolid& solid) {
    const PatchMesh& mesh = solid.mesh();
    double deviation = 0;
    for (const std::uint32_t p : mesh.patch_of)
      deviation = std::max(deviation, mesh.patches[p].deviation);
    if (deviation > 0)
      notes_.push_back("Computed from triangles: curved faces are within " +
                       millimetres_text(deviation) + " of their shape.");
    const auto parts = parts_of(solid.neighbours());
    const std::size_t count =
        parts.empty() ? 0 : *std::max_element(parts.begin(), parts.end()) + std::size_t{1};
    std::vector<double> six_volumes(count, 0.0);
    for (std::size_t t = 0; t < parts.size(); ++t) {
      const auto [a, b, c] = mesh.corners(t);
      six_volumes[parts[t]] += dot(a, cross(b, c));
    }
    const auto pieces = std::count_if(six_volumes.begin(), six_volumes.end(),
                                      [](double v) { return v > 0; });  // the others are cavities
    if (pieces > 1)
      notes_.push_back("The solid consists of " + std::to_string(pieces) + " separate pieces.");
  }

  const CsgTree& tree_;
  const Planner& plan_;
  Imports& imports_;
  Progress& progress_;
  std::vector<std::string> notes_;
  std::optional<Error> nothing_left_;  ///< of the last operation that was empty by itself
};

}  // namespace

Result<Evaluated> evaluate_tree(const CsgTree& tree, Imports& imports, Progress& progress) {
  Planner plan(tree, progress);
  RMP_TRY(plan.run());
  return Evaluator(tree, plan, imports, progress).run();
}

}  // namespace robomosp::csg_cgal
