// SPDX-License-Identifier: Apache-2.0
#include "tree_plan.h"

#include <cmath>

#include "primitives.h"

namespace robomosp::csg_occt {
namespace {

/// What a node amounts to in its parent's eyes. `kind` is the operation on the items, or, when
/// `single`, there is one item and no operation left to do.
struct Form {
  bool single = false;
  CsgKind kind = CsgKind::union_;
  std::size_t node = 0;
  std::vector<Item> items;
};

bool is_operation(CsgKind kind) {
  return kind == CsgKind::union_ || kind == CsgKind::difference || kind == CsgKind::intersection;
}

class Planner {
 public:
  Planner(const CsgTree& tree, Progress& progress) : tree_(tree), progress_(progress) {}

  Result<Plan> run() {
    RMP_TRY(check());
    const std::size_t n = tree_.nodes.size();
    std::vector<Form> forms(n);
    for (std::size_t i = n; i-- > 0;) {
      if (progress_.cancelled()) return cancelled_error();
      const CsgNode& node = tree_.nodes[i];
      if (!is_operation(node.kind)) {
        forms[i] = primitive(i);
        continue;
      }
      std::vector<Form> parts;
      for (std::size_t child = first_child_[i]; child != 0; child = next_sibling_[child]) {
        parts.push_back(std::move(forms[child]));
        move_by(parts.back(), poses_[child]);
      }
      forms[i] = combine(i, std::move(parts));
    }
    move_by(forms[0], poses_[0]);
    plan_.root = as_item(std::move(forms[0]));
    return std::move(plan_);
  }

 private:
  Result<void> check() {
    const auto& nodes = tree_.nodes;
    if (nodes.empty())
      return error(ErrorCode::invalid_argument, "the tree has no nodes",
                   "Give at least one primitive.");
    first_child_.assign(nodes.size(), 0);
    next_sibling_.assign(nodes.size(), 0);
    std::vector<std::size_t> last_child(nodes.size(), 0);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const CsgNode& node = nodes[i];
      const auto bad = [&](std::string what) {
        return error(ErrorCode::invalid_argument, std::move(what), {}, node_text(node, i));
      };
      if (i == 0 && node.parent != -1)
        return bad("parent is " + std::to_string(node.parent) +
                   "; the first node is the root and its parent must be -1");
      if (i > 0) {
        if (node.parent < 0 || static_cast<std::size_t>(node.parent) >= i)
          return bad("parent is " + std::to_string(node.parent) +
                     "; it must be the index of an earlier node (0.." + std::to_string(i - 1) +
                     ")");
        const auto p = static_cast<std::size_t>(node.parent);
        if (!is_operation(nodes[p].kind))
          return bad("parent " + node_text(nodes[p], p) +
                     " is a primitive; only union, difference and intersection have children");
        (first_child_[p] == 0 ? first_child_[p] : next_sibling_[last_child[p]]) = i;
        last_child[p] = i;
      }
      const auto pose = to_trsf(node.placement);
      if (!pose)
        return bad(
            "placement is not a rigid motion; its rotation must be orthonormal with determinant "
            "+1 and all its numbers finite");
      for (int axis = 0; axis < 3; ++axis)
        if (std::abs(node.placement.p[static_cast<std::size_t>(axis)]) > kGreatestLength)
          return bad("placement is " +
                     number_text(node.placement.p[static_cast<std::size_t>(axis)]) +
                     " m away; it must be within " + number_text(kGreatestLength) + " m");
      poses_.push_back(*pose);
      if (!is_operation(node.kind)) RMP_TRY(check_primitive(node, i));
    }
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (is_operation(nodes[i].kind) && first_child_[i] == 0)
        return error(ErrorCode::invalid_argument,
                     "operation has no children; it needs at least one solid", {},
                     node_text(nodes[i], i));
    return {};
  }

  Form primitive(std::size_t i) {
    const CsgNode& node = tree_.nodes[i];
    Term term{node.kind, i, node.sizes, {}, {}};
    term.key.mix(static_cast<std::uint64_t>(node.kind));
    for (std::size_t k = 0; k < primitive_size_count(node.kind); ++k) term.key.mix(node.sizes[k]);
    return {true, node.kind, i, {add(std::move(term))}};
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
      else if (form.items.empty()) form.items = std::move(part.items);
      else form.items.insert(form.items.end(), part.items.begin(), part.items.end());
    }
    return form;
  }

  static void move_by(Form& form, const gp_Trsf& pose) {
    if (is_identity(pose)) return;
    for (Item& item : form.items) item.pose = is_identity(item.pose) ? pose : pose * item.pose;
  }

  Item as_item(Form form) {
    if (form.single) return form.items.front();
    Term term{form.kind, form.node, {}, std::move(form.items), {}};
    term.key.mix(static_cast<std::uint64_t>(term.kind));
    for (const Item& item : term.items) {
      term.key.mix(plan_.terms[item.term].key);
      term.key.mix(item.pose);
    }
    return add(std::move(term));
  }

  Item add(Term term) {
    plan_.terms.push_back(std::move(term));
    return {plan_.terms.size() - 1, gp_Trsf()};
  }

  const CsgTree& tree_;
  Progress& progress_;
  std::vector<std::size_t> first_child_, next_sibling_;  // 0 = none: node 0 is nobody's child
  std::vector<gp_Trsf> poses_;
  Plan plan_;
};

}  // namespace

Result<Plan> make_plan(const CsgTree& tree, Progress& progress) {
  return Planner(tree, progress).run();
}

}  // namespace robomosp::csg_occt
