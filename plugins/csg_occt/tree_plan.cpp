// SPDX-License-Identifier: Apache-2.0
#include "tree_plan.h"

#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include <robomosp/sdk/csg_check.h>
#include <robomosp/sdk/csg_scale.h>
#include <robomosp/sdk/csg_select.h>

#include <gp.hxx>
#include <gp_Mat.hxx>
#include <gp_Quaternion.hxx>

#include "modifiers.h"
#include "primitives.h"
#include "profile.h"

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

// Patterns of patterns may place so many solids in all.
constexpr double kMostCopies = 100'000;

/// The product of two mirrorings and a motion: a motion again. Composed by hand because gp_Trsf
/// keeps a scale of its own, and OCCT locates no shape by one that is not exactly 1.
gp_Trsf rigid(const gp_Trsf& t) {
  const gp_Mat m = t.VectorialPart();
  gp_Trsf out;
  bool is_turned = false;
  for (int row = 1; row <= 3; ++row)
    for (int column = 1; column <= 3; ++column)
      is_turned |= m(row, column) != (row == column ? 1.0 : 0.0);
  if (!is_turned) {
    out.SetTranslation(gp_Vec(t.TranslationPart()));
    return out;
  }
  gp_Quaternion q(m);
  q.Normalize();
  out.SetTransformation(q, gp_Vec(t.TranslationPart()));
  return out;
}

/// A mirroring that maps the primitive onto itself.
std::optional<gp_Trsf> own_mirror(const Term& term) {
  gp_Trsf t;
  switch (term.kind) {
    case CsgKind::box:
    case CsgKind::cylinder:
    case CsgKind::cone:
    case CsgKind::sphere:
    case CsgKind::ellipsoid:
    case CsgKind::torus:
    case CsgKind::frustum: t.SetMirror(gp_Ax2(gp::Origin(), gp_Dir(1, 0, 0))); return t;
    case CsgKind::wedge:
    case CsgKind::pyramid: t.SetMirror(gp_Ax2(gp::Origin(), gp_Dir(0, 1, 0))); return t;
    case CsgKind::prism:
      t.SetMirror(gp_Ax2(gp_Pnt(0, 0, term.sizes[0] * kMillimetresPerMetre / 2), gp_Dir(0, 0, 1)));
      return t;
    case CsgKind::revolution: {
      const double half = term.sizes[0] / 2;
      t.SetMirror(gp_Ax2(gp::Origin(), gp_Dir(-std::sin(half), std::cos(half), 0)));
      return t;
    }
    default: return {};
  }
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
      if (is_csg_modifier(node.kind)) {
        RMP_TRY_ASSIGN(forms[i], modifier(i, std::move(forms[links_.first_child[i]])));
        continue;
      }
      if (!is_csg_operation(node.kind)) {
        forms[i] = primitive(i);
        continue;
      }
      std::vector<Form> parts;
      for (std::size_t child = links_.first_child[i]; child != 0;
           child = links_.next_sibling[child]) {
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
    RMP_TRY_ASSIGN(links_, check_csg_tree(tree_));
    for (std::size_t i = 0; i < tree_.nodes.size(); ++i) {
      const CsgNode& node = tree_.nodes[i];
      poses_.push_back(*to_trsf(node.placement));
      RMP_TRY(check_kind(node, i));
      if (node.kind == CsgKind::fillet || node.kind == CsgKind::chamfer)
        if (const auto tests = parse_csg_select(node.select); !tests) {
          Error refused = tests.error();
          refused.where = csg_node_text(node, i);
          return refused;
        }
    }
    return {};
  }

  Form primitive(std::size_t i) {
    const CsgNode& node = tree_.nodes[i];
    Term term{node.kind, i, node.sizes, {}};
    term.key.mix(static_cast<std::uint64_t>(node.kind));
    for (std::size_t k = 0; k < csg_size_count(node.kind); ++k) term.key.mix(node.sizes[k]);
    if (has_content(node.kind) && node.profile) mix(term.key, *node.profile);
    if (node.kind == CsgKind::imported) mix_text(term.key, node.geometry->brep);
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

  // Of the content itself: nobody has to be trusted to have digested it.
  static void mix_text(Key& key, std::string_view text) {
    key.mix(std::uint64_t{text.size()});
    key.mix(std::uint64_t{std::hash<std::string_view>()(text)});
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
      word = word << 8 | static_cast<unsigned char>(text[i]);
      if (i % 8 == 7 || i + 1 == text.size()) key.mix(std::exchange(word, 0));
    }
  }

  Result<Form> modifier(std::size_t i, Form child) {
    const CsgNode& node = tree_.nodes[i];
    const gp_Trsf& pose = poses_[links_.first_child[i]];
    switch (node.kind) {
      case CsgKind::mirror: move_by(child, pose); return mirror(i, std::move(child));
      case CsgKind::scale: move_by(child, pose); return stretched(i, std::move(child));
      case CsgKind::linear_pattern: {
        const gp_Vec step =
            gp_Vec(node.sizes[1], node.sizes[2], node.sizes[3]) * kMillimetresPerMetre;
        move_by(child, pose);
        const bool moves = step.Magnitude() > 0;
        return pattern(i, std::move(child), moves ? count_of(node.sizes[0]) : 1, [&](double k) {
          gp_Trsf t;
          t.SetTranslation(step * k);
          return t;
        });
      }
      case CsgKind::circular_pattern: {
        const std::size_t count = count_of(node.sizes[0]);
        const double angle = node.sizes[1];
        const bool is_full = std::abs(angle) >= kCsgFullTurn * (1 - 1e-12);
        const double step = angle / static_cast<double>(is_full || count == 1 ? count : count - 1);
        move_by(child, pose);
        return pattern(i, std::move(child), angle != 0 ? count : 1, [&](double k) {
          gp_Trsf t;
          t.SetTransformation(gp_Quaternion(gp_Vec(0, 0, 1), step * k), gp_Vec(0, 0, 0));
          return t;
        });
      }
      default: {
        // Edges are chosen in the child's frame, so the child's own placement comes afterwards.
        Term term{node.kind, i, node.sizes, {as_item(std::move(child))}};
        make_general(term.items[0].term);
        term.key.mix(static_cast<std::uint64_t>(node.kind));
        term.key.mix(node.sizes[0]);
        mix_text(term.key, node.select);
        mix_items(term);
        Form form{true, node.kind, i, {add(std::move(term))}};
        move_by(form, pose);
        return form;
      }
    }
  }

  template <class Place>
  Result<Form> pattern(std::size_t i, Form child, std::size_t count, Place&& place) {
    const Item item = as_item(std::move(child));
    const double copies = weights_[item.term] * static_cast<double>(count);
    if (copies > kMostCopies)
      return error(ErrorCode::invalid_argument,
                   "the pattern makes " + csg_number_text(copies) + " copies; at most " +
                       csg_number_text(kMostCopies) + " are made, including nested patterns",
                   "Reduce the count.", csg_node_text(tree_.nodes[i], i));
    if (count == 1) return Form{true, tree_.nodes[i].kind, i, {item}};
    Form form{false, CsgKind::union_, i, {}};
    for (std::size_t k = 0; k < count; ++k) {
      form.items.push_back(item);
      if (k > 0) form.items.back().pose = place(static_cast<double>(k)) * item.pose;
    }
    return form;
  }

  Form mirror(std::size_t i, Form child) {
    const CsgNode& node = tree_.nodes[i];
    if (!child.single && child.kind != CsgKind::union_)
      child = Form{true, child.kind, child.node, {as_item(std::move(child))}};
    const gp_Trsf image = mirror_trsf(node.sizes);
    Form form{false, CsgKind::union_, i, {}};
    if (node.sizes[4] != 0) form.items = child.items;
    for (const Item& item : child.items) form.items.push_back(mirrored(i, image, item));
    form.single = form.items.size() == 1;
    return form;
  }

  /// Primitives that stay primitives are those, elsewhere; all else is stretched as it is made.
  Form stretched(std::size_t i, Form child) {
    const CsgNode& node = tree_.nodes[i];
    const Vec3 factors{node.sizes[0], node.sizes[1], node.sizes[2]};
    if (factors == Vec3{1, 1, 1}) return child;
    std::vector<Item> items;
    for (const Item& item : child.items) {
      const Term& source = plan_.terms[item.term];
      if (!source.items.empty() || has_content(source.kind)) break;
      const auto made = scaled_primitive(as_node(source, item.pose), factors);
      if (!made) break;
      Term term{made->kind, source.node, made->sizes, {}};
      term.key.mix(static_cast<std::uint64_t>(term.kind));
      for (std::size_t k = 0; k < csg_size_count(term.kind); ++k) term.key.mix(term.sizes[k]);
      items.push_back(add(std::move(term)));
      const Vec3& p = made->placement.p;
      items.back().pose = item.pose;
      items.back().pose.SetTranslationPart(gp_Vec(p[0], p[1], p[2]) * kMillimetresPerMetre);
    }
    if (items.size() == child.items.size()) {
      child.items = std::move(items);
      return child;
    }
    Term term{CsgKind::scale, i, node.sizes, {as_item(std::move(child))}};
    term.key.mix(static_cast<std::uint64_t>(term.kind));
    for (const double f : factors) term.key.mix(f);
    mix_items(term);
    return Form{true, CsgKind::scale, i, {add(std::move(term))}};
  }

  static CsgNode as_node(const Term& term, const gp_Trsf& pose) {
    CsgNode node;
    node.kind = term.kind;
    node.sizes = term.sizes;
    const gp_Mat turn = pose.VectorialPart();
    const gp_XYZ& p = pose.TranslationPart();
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        node.placement.R[static_cast<std::size_t>(3 * r + c)] = turn(r + 1, c + 1);
    node.placement.p = {p.X() / kMillimetresPerMetre, p.Y() / kMillimetresPerMetre,
                        p.Z() / kMillimetresPerMetre};
    return node;
  }

  Item mirrored(std::size_t i, const gp_Trsf& image, const Item& item) {
    const Term& source = plan_.terms[item.term];
    if (const auto own = own_mirror(source)) return {item.term, rigid(image * item.pose * *own)};
    if (source.kind == CsgKind::mirror)
      return {source.items[0].term,
              rigid(image * item.pose * mirror_trsf(source.sizes) * source.items[0].pose)};
    Term term{CsgKind::mirror, i, tree_.nodes[i].sizes, {item}};
    term.key.mix(static_cast<std::uint64_t>(term.kind));
    for (std::size_t k = 0; k < 4; ++k) term.key.mix(term.sizes[k]);
    mix_items(term);
    return add(std::move(term));
  }

  static void move_by(Form& form, const gp_Trsf& pose) {
    if (is_identity(pose)) return;
    for (Item& item : form.items) item.pose = is_identity(item.pose) ? pose : pose * item.pose;
  }

  Item as_item(Form form) {
    if (form.single) return form.items.front();
    Term term{form.kind, form.node, {}, std::move(form.items)};
    term.key.mix(static_cast<std::uint64_t>(term.kind));
    mix_items(term);
    return add(std::move(term));
  }

  /// For everything that a fillet is made of, down to the fillets in it, which are so already.
  void make_general(std::size_t root) {
    std::vector<bool> is_below(root + 1, false);
    is_below[root] = true;
    for (std::size_t t = root + 1; t-- > 0;) {
      const Term& term = plan_.terms[t];
      if (!is_below[t] || term.kind == CsgKind::fillet || term.kind == CsgKind::chamfer) continue;
      for (const Item& item : term.items) is_below[item.term] = true;
    }
    for (std::size_t t = 0; t <= root; ++t) {
      Term& term = plan_.terms[t];
      if (!is_below[t] || term.items.empty()) continue;
      if (term.kind == CsgKind::fillet || term.kind == CsgKind::chamfer) continue;
      if (is_csg_operation(term.kind) && !term.general) {
        term.general = true;
        term.own.mix(std::uint64_t{1});
      }
      term.key = term.own;
      mix_items(term);
    }
  }

  void mix_items(Term& term) const {
    term.own = term.key;
    for (const Item& item : term.items) {
      term.key.mix(plan_.terms[item.term].key);
      term.key.mix(item.pose);
    }
  }

  Item add(Term term) {
    double weight = term.items.empty() ? 1 : 0;
    for (const Item& item : term.items) weight += weights_[item.term];
    weights_.push_back(weight);
    plan_.terms.push_back(std::move(term));
    return {plan_.terms.size() - 1, gp_Trsf()};
  }

  const CsgTree& tree_;
  Progress& progress_;
  CsgLinks links_;
  std::vector<gp_Trsf> poses_;
  std::vector<double> weights_;  // solids that the patterns in a term place
  Plan plan_;
};

}  // namespace

Result<Plan> make_plan(const CsgTree& tree, Progress& progress) {
  return Planner(tree, progress).run();
}

}  // namespace robomosp::csg_occt
