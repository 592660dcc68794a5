// SPDX-License-Identifier: Apache-2.0
// BrandValues: records and arrays as plain variables, geometric values as transforms; places,
// declarations, assignments and expressions (layer: plugins/posts, header only).
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "brand_syntax.h"

namespace robomosp::post::brand {

class BrandValues : public BrandSyntax {
 public:
  using BrandSyntax::BrandSyntax;

 protected:
  // ---- places ----
  struct Place {
    std::uint32_t symbol = RMP_NONE;
    std::uint32_t type = RMP_NONE;
    std::string suffix;
    std::vector<std::string> indices;
    std::vector<Bounds> bounds;
    bool is_position = false;           ///< POS of a pose
    std::optional<std::size_t> number;  ///< X, Y, Z of it
    bool bad = false;
  };
  std::optional<Place> place(std::uint32_t e) {
    std::vector<std::uint32_t> chain;
    while (true) {
      const auto& x = expression(e);
      chain.push_back(e);
      if (x.op == RMP_EXPR_SYMBOL) break;
      if ((x.op != RMP_EXPR_FIELD && x.op != RMP_EXPR_INDEX) || x.count == 0) return std::nullopt;
      e = links(x.first, x.count)[0];
    }
    Place p;
    p.symbol = expression(chain.back()).symbol;
    const auto kind_of_symbol = symbol(p.symbol).kind;
    if (kind_of_symbol != RMP_SYMBOL_VARIABLE && kind_of_symbol != RMP_SYMBOL_PARAMETER &&
        kind_of_symbol != RMP_SYMBOL_CONSTANT)
      return std::nullopt;
    p.type = symbol(p.symbol).type;
    for (std::size_t i = chain.size() - 1; i-- > 0 && !p.bad;) extend(p, expression(chain[i]));
    return p;
  }
  void extend(Place& p, const rmp_code_expression& x) {
    if (x.op == RMP_EXPR_INDEX) {
      if (type(p.type).kind != RMP_TYPE_ARRAY) {
        cannot("parts of lists or strings by their number");
        p.bad = true;
        return;
      }
      p.bounds.push_back({type(p.type).lower, type(p.type).upper});
      p.indices.push_back(within(expr(links(x.first, x.count)[1]), 90));
      p.type = type(p.type).element;
      return;
    }
    const std::uint32_t r = role(p.type);
    if (r == RMP_ROLE_POSE && x.symbol == 0) p.is_position = true;
    else if (r == RMP_ROLE_POSITION) p.number = x.symbol;
    else if (kind(p.type) == Kind::transform) {
      cannot("parts of an orientation",
             "Keep the angles in variables, and build the orientation from them.");
      p.bad = true;
      return;
    } else {
      p.suffix += std::string("_") + field_row(type(p.type).first_field + x.symbol).name;
    }
    p.type = field_row(type(p.type).first_field + x.symbol).type;
  }
  std::string leaf_name(std::uint32_t s, const std::string& suffix, Kind k) {
    std::uint64_t key = s;
    if (!suffix.empty())
      key = (1ULL << 41U) + keys_.try_emplace({s, upper(suffix)}, keys_.size()).first->second;
    return spelled(s, k, names_.of(key, std::string(symbol(s).name) + suffix));
  }
  std::string whole(const Place& p) {
    const Kind k = p.is_position || p.number ? Kind::transform : kind(p.type);
    const std::string n = leaf_name(p.symbol, p.suffix, k);
    return p.indices.empty() ? n : element(n, p.indices, p.bounds);
  }
  Text text_of(const Place& p) {
    if (p.bad) return {};
    if (p.number) return {component(whole(p), *p.number)};
    if (p.is_position) {
      const std::string t = whole(p);
      return {translation(component(t, 0), component(t, 1), component(t, 2))};
    }
    if (kind(p.type) == Kind::none) {
      cannot("values of " + type_name(p.type) + " as a whole", "Use its parts one by one.");
      return {};
    }
    return {whole(p)};
  }

  // ---- declarations ----
  /// Where a variable is declared; those of the language have no such place.
  [[nodiscard]] rmp_span home(std::uint32_t s) const {
    return is_system(s) ? routine(0).span : symbol(s).span;
  }
  void declare(std::uint32_t s, std::uint32_t r) override {
    at_ = home(s);
    if (symbol(s).kind == RMP_SYMBOL_ROBOT) {
      cannot("variables of robots", "Remove it: the controller has one robot.");
      return;
    }
    const auto all = leaves(symbol(s).type);
    if (!all) {
      cannot("variables of " + type_name(symbol(s).type));
      return;
    }
    for (const Leaf& l : *all)
      declare_leaf(leaf_name(s, l.suffix, kind(l.type)), kind(l.type), l.bounds, r);
    to_set_.push_back(s);
  }
  /// Initial values, as assignments; call it from routine_code().
  void set_initial() {
    for (const std::uint32_t s : std::exchange(to_set_, {})) {
      at_ = home(s);
      const auto all = leaves(symbol(s).type);
      for (const Leaf& l : *all) set_leaf(s, l);
    }
  }
  void set_leaf(std::uint32_t s, const Leaf& l) {
    std::int64_t n = 1;
    for (const Bounds& b : l.bounds) n *= std::min<std::int64_t>(b.size(), 100'000);
    if (n > 10'000) {
      fail(std::string("the array ") + symbol(s).name + " has too many values to write",
           "Make it smaller, or post the flattened program (form = \"flat\").");
      return;
    }
    const Kind k = kind(l.type);
    const std::string base = leaf_name(s, l.suffix, k);
    std::vector<std::int32_t> at;
    for (const Bounds& b : l.bounds) at.push_back(b.lower);
    for (std::int64_t i = 0; i < n; ++i) {
      std::vector<std::string> indices;
      for (const std::int32_t x : at) indices.push_back(std::to_string(x));
      assign_text(indices.empty() ? base : element(base, indices, l.bounds), k,
                  initial(symbol(s).value, l, at, k));
      for (std::size_t d = at.size(); d-- > 0;) {
        if (++at[d] <= l.bounds[d].upper) break;
        at[d] = l.bounds[d].lower;
      }
    }
  }
  std::string initial(std::uint32_t e, const Leaf& l, const std::vector<std::int32_t>& at, Kind k) {
    std::size_t dimension = 0;
    for (const std::uint32_t step : l.path) {
      if (e == RMP_NONE) break;
      const auto& x = expression(e);
      const auto operands = links(x.first, x.count);
      const std::size_t i =
          step != RMP_NONE ? step
                           : static_cast<std::size_t>(at[dimension] - l.bounds[dimension].lower);
      if (step == RMP_NONE) ++dimension;
      if (x.op == RMP_EXPR_SYMBOL && x.symbol != RMP_NONE &&
          symbol(x.symbol).kind == RMP_SYMBOL_CONSTANT) {
        // A constant array or record: its value is at the elements.
        const auto& y = symbol(x.symbol).value;
        if (y != RMP_NONE && expression(y).op == RMP_EXPR_MAKE && i < expression(y).count) {
          e = links(expression(y).first, expression(y).count)[i];
          continue;
        }
      }
      if (x.op != RMP_EXPR_MAKE || i >= operands.size()) {
        fail("an initial value copied from another variable cannot be posted",
             "Write the values in the declaration, or assign them in statements.");
        return zero(k);
      }
      e = operands[i];
    }
    return e == RMP_NONE ? zero(k) : text(e);
  }

  // ---- statements ----
  void assign(std::uint32_t to, std::uint32_t value) override {
    if (reads_signals(value)) settle();
    const auto p = place(to);
    if (!p || p->bad) {
      if (!p) cannot("assignments to this place");
      return;
    }
    if (is_system(p->symbol)) {
      system_assigned(p->symbol, value);
      return;
    }
    if (p->number) {
      set_component(whole(*p), *p->number, text(value));
      return;
    }
    if (p->is_position) {
      const std::string v = text(value);
      for (std::size_t k = 0; k < 3; ++k) set_component(whole(*p), k, component(v, k));
      return;
    }
    if (kind(p->type) != Kind::none) {
      assign_text(whole(*p), kind(p->type), text(value));
      return;
    }
    assign_parts(*p, value);
  }
  /// Assigns a whole record or array, part by part.
  void assign_parts(const Place& to, std::uint32_t value) {
    const auto all = leaves(to.type);
    const auto from = place(value);
    const bool is_made = expression(value).op == RMP_EXPR_MAKE;
    const bool has_arrays = all && std::any_of(all->begin(), all->end(),
                                               [](const Leaf& l) { return !l.bounds.empty(); });
    if (!all || has_arrays || (!from && !is_made)) {
      cannot("assignments of " + type_name(to.type) + " as a whole",
             "Assign its parts one by one.");
      return;
    }
    for (const Leaf& l : *all) {
      Place a = to;
      a.suffix += l.suffix;
      a.type = l.type;
      std::string v;
      if (is_made) {
        v = initial(value, l, {}, kind(l.type));
      } else {
        Place b = *from;
        b.suffix += l.suffix;
        b.type = l.type;
        v = text_of(b).text;
      }
      assign_text(whole(a), kind(l.type), v);
    }
  }
  /// Called for assignments to R_SPEED and the like, which are variables of the program then.
  virtual void system_assigned(std::uint32_t s, std::uint32_t value) {
    assign_text(leaf_name(s, "", kind(symbol(s).type)), kind(symbol(s).type), text(value));
  }
  // ---- expressions ----
  Text variable(std::uint32_t s) override {
    Place p;
    p.symbol = s;
    p.type = symbol(s).type;
    return text_of(p);
  }
  Text field(std::uint32_t object, std::uint32_t, const rmp_code_expression& e) override {
    return part(object, e);
  }
  Text index(std::uint32_t object, std::uint32_t, const rmp_code_expression& e) override {
    return part(object, e);
  }
  Text part(std::uint32_t object, const rmp_code_expression& e) {
    auto p = place(object);
    if (!p) {
      if (e.op == RMP_EXPR_FIELD && role(expression(object).type) == RMP_ROLE_POSITION)
        return {component(within(expr(object), 100), e.symbol)};
      cannot("parts of a computed value", "Keep it in a variable first.");
      return {};
    }
    if (!p->bad) extend(*p, e);
    return p->bad ? Text{} : text_of(*p);
  }
  std::optional<Text> known_point(const PostPoint& p, const rmp_code_expression& e) override {
    if (!p.has_pose || kind(e.type) != Kind::transform) return std::nullopt;
    return Text{transform(p.pose)};
  }
  Text make(std::span<const std::uint32_t> o, const rmp_code_expression& e) override {
    switch (role(e.type)) {
      case RMP_ROLE_POSITION: return {translation(text(o[0]), text(o[1]), text(o[2]))};
      case RMP_ROLE_POSE: return product_of(o[0], o[1]);
      default: return Writer::make(o, e);
    }
  }
  Text intrinsic(std::string_view name, std::span<const std::uint32_t> a,
                 const rmp_code_expression& e) override {
    static constexpr struct {
      std::string_view name;
      std::array<std::size_t, 3> axes, arguments;
    } kOri[] = {{"ORIXYZ", {0, 1, 2}, {0, 1, 2}},
                {"ORIYXZ", {1, 0, 2}, {0, 1, 2}},
                {"ORIZYX", {2, 1, 0}, {0, 1, 2}},
                {"ORIZYZ2", {2, 1, 2}, {0, 1, 2}},
                {"ORIRS", {2, 1, 0}, {2, 1, 0}}};
    for (const auto& k : kOri) {
      if (k.name != name || a.size() != 3) continue;
      Text out{rotation(k.axes[0], text(a[k.arguments[0]]))};
      for (std::size_t i = 1; i < 3; ++i)
        out = product(out, Text{rotation(k.axes[i], text(a[k.arguments[i]]))});
      return out;
    }
    if (name == "ORIMULT" && a.size() == 2) return product_of(a[0], a[1]);
    if (name == "INV" && a.size() == 1) return inverse_of(expr(a[0]));
    if (name == "FLOAT" && a.size() == 1) return expr(a[0]);
    if (const auto f = function(name); !f.empty()) return {f + "(" + list(a) + ")"};
    return Writer::intrinsic(name, a, e);
  }
  /// The target's equivalent numeric function; "" = none.
  virtual std::string function(std::string_view) { return ""; }
  Text compose(std::uint32_t a, std::uint32_t b, const rmp_code_expression& e) override {
    if (role(e.type) == RMP_ROLE_POSITION) {
      cannot("positions transformed by @ at run time",
             "Write POSE(position, orientation) @ and use the resulting pose.");
      return {};
    }
    return product_of(a, b);
  }
  /// The left operand first: a call in it may write separate lines.
  Text product_of(std::uint32_t a, std::uint32_t b) {
    Text left = expr(a);
    return product(std::move(left), expr(b));
  }
  const Operator* operation(const rmp_code_expression& e) override {
    const auto o = links(e.first, e.count);
    if (!o.empty() && kind(expression(o[0]).type) == Kind::transform) {
      static constexpr Operator kNone{};
      return &kNone;
    }
    if (!o.empty() && kind(expression(o[0]).type) == Kind::none) return nullptr;
    return Writer::operation(e);
  }

 private:
  std::map<std::pair<std::uint32_t, std::string>, std::uint64_t> keys_;
  std::vector<std::uint32_t> to_set_;
};

}  // namespace robomosp::post::brand
