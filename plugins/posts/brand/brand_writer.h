// SPDX-License-Identifier: Apache-2.0
// BrandWriter: shared by the posts of VAL3, AS, PacScript, PDL2 and the PA-10 library. Records and
// arrays become plain variables, geometric values become transforms, a motion is resolved into
// targets, speeds and blending (layer: plugins/posts, header only).
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/post_writer.h>

namespace robomosp::post::brand {

/// Type of a variable of the target.
enum class Kind { none, integer, real, boolean, string, transform };

struct Bounds {
  std::int32_t lower = 0, upper = 0;
  [[nodiscard]] std::int64_t size() const { return std::int64_t{upper} - lower + 1; }
};
/// A number of a motion: known, or computed at run time.
struct Number {
  std::optional<double> known;
  std::string text;  ///< if unknown
};
/// Target of a motion.
struct Goal {
  bool is_joints = false;
  std::vector<double> axes;      ///< of the controller [degrees or mm], if is_joints
  std::vector<double> external;  ///< of the profile's external axes
  std::optional<Pose> pose;      ///< frame_T_tip, if known
  std::string text;              ///< else the transform, in the target's language
  const PostPoint* point = nullptr;
};
/// A tool or a frame of a motion.
struct Placing {
  std::optional<Pose> pose;  ///< empty = unchanged since the start
  std::string text;          ///< computed at run time
  bool operator==(const Placing& o) const {
    const auto same = [](const std::optional<Pose>& a, const std::optional<Pose>& b) {
      return a.has_value() == b.has_value() && (!a || (a->p == b->p && a->R == b->R));
    };
    return same(pose, o.pose) && text == o.text;
  }
};
struct Move {
  std::vector<Goal> goals;
  bool is_ptp = false, incremental = false;
  Number speed, speed_ori, acc;  ///< [mm/s or %], [degrees/s], [%]
  Number blend;                  ///< [mm or %]
  bool passes = false;           ///< continues without a stop
  Placing tool, frame;
};
/// A part of a variable that has a name in the target.
struct Leaf {
  std::string suffix;
  std::uint32_t type = 0;
  std::vector<Bounds> bounds;
  std::vector<std::uint32_t> path;  ///< fields; RMP_NONE = an index
};

class BrandWriter : public Writer {
 public:
  using Writer::Writer;

 protected:
  // ---- syntax of the target ----
  virtual std::string transform(const Pose&) = 0;
  virtual std::string translation(const std::string& x, const std::string& y,
                                  const std::string& z) = 0;
  /// Rotation about axis 0, 1, 2 by degrees.
  virtual std::string rotation(std::size_t axis, const std::string& degrees) = 0;
  virtual Text product(const Text& a, const Text& b) = 0;
  virtual Text inverse_of(const Text& a) = 0;
  /// x, y, z of a transform [mm].
  virtual std::string component(const std::string& of, std::size_t axis) = 0;
  virtual void set_component(const std::string& of, std::size_t axis, const std::string& to) = 0;
  virtual std::string element(const std::string& name, const std::vector<std::string>& indices,
                              const std::vector<Bounds>& bounds) = 0;
  virtual void assign_text(const std::string& place, Kind, const std::string& value) = 0;
  virtual void declare_leaf(const std::string& name, Kind, const std::vector<Bounds>&,
                            std::uint32_t routine) = 0;
  virtual std::string zero(Kind k) {
    switch (k) {
      case Kind::real: return "0.0";
      case Kind::boolean: return "FALSE";
      case Kind::string: return string_literal("").text;
      case Kind::transform: return transform(Pose{});
      default: return "0";
    }
  }
  virtual int most_dimensions() const { return 1; }
  /// Name of a variable from its wish; targets with type marks add them.
  virtual std::string spelled(std::uint32_t /*symbol*/, Kind, const std::string& name) {
    return name;
  }
  virtual void write_move(const Motion&, const Move&) = 0;
  /// Waits for motions that run in parallel with the program.
  virtual void settle() {}
  virtual bool has_external() const { return false; }
  virtual bool has_speed_ori() const { return false; }
  virtual bool has_acc() const { return true; }

  // ---- types ----
  [[nodiscard]] Kind kind(std::uint32_t t) const {
    switch (type(t).kind) {
      case RMP_TYPE_INT: return Kind::integer;
      case RMP_TYPE_REAL: return Kind::real;
      case RMP_TYPE_BOOL: return Kind::boolean;
      case RMP_TYPE_STRING: return Kind::string;
      default: break;
    }
    const std::uint32_t r = role(t);
    return r == RMP_ROLE_POSITION || r == RMP_ROLE_ORIENTATION || r == RMP_ROLE_POSE
               ? Kind::transform
               : Kind::none;
  }
  /// Parts of a type; empty = it cannot be expressed.
  std::optional<std::vector<Leaf>> leaves(std::uint32_t t) {
    std::vector<Leaf> out;
    std::vector<std::pair<std::uint32_t, Leaf>> open{{t, {}}};
    while (!open.empty()) {
      auto [at, so_far] = std::move(open.back());
      open.pop_back();
      if (kind(at) != Kind::none) {
        so_far.type = at;
        if (so_far.bounds.size() > static_cast<std::size_t>(most_dimensions())) return std::nullopt;
        out.push_back(std::move(so_far));
      } else if (type(at).kind == RMP_TYPE_ARRAY) {
        so_far.bounds.push_back({type(at).lower, type(at).upper});
        so_far.path.push_back(RMP_NONE);
        open.emplace_back(type(at).element, std::move(so_far));
      } else if (type(at).kind == RMP_TYPE_RECORD && role(at) == RMP_ROLE_NONE) {
        for (std::uint32_t k = type(at).field_count; k-- > 0;) {
          Leaf next = so_far;
          next.suffix += std::string("_") + field_row(type(at).first_field + k).name;
          next.path.push_back(k);
          open.emplace_back(field_row(type(at).first_field + k).type, std::move(next));
        }
      } else {
        return std::nullopt;
      }
      if (out.size() > 1000) return std::nullopt;
    }
    return out;
  }

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
  void ptp(const Motion& m) override { resolve(m); }
  void lin(const Motion& m) override { resolve(m); }
  void circle(const Motion& m) override { resolve(m); }

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

  // ---- motions ----
  Number value(const Attribute& a, double otherwise) {
    Number n;
    if (a.known) n.known = *a.known;
    else if (a.expression != RMP_NONE) n.text = text(a.expression);
    else n.known = otherwise;
    if (n.known && !std::isfinite(*n.known)) fail("a number of this motion is not finite");
    return n;
  }
  Placing placing(const Attribute& a, std::int32_t number, std::span<const PostPlace> places) {
    Placing out;
    if (!a.given) {
      if (number >= 0 && static_cast<std::size_t>(number) < places.size())
        out.pose = places[static_cast<std::size_t>(number)].pose;
      return out;
    }
    if (const PostPoint* p = point(a.expression); p && p->has_pose) out.pose = p->pose;
    else out.text = text(a.expression);
    return out;
  }
  bool is_sane(const Pose& p) {
    for (const double x : p.p)
      if (!std::isfinite(x) || std::fabs(x) > 1e6) {
        fail(std::isfinite(x) ? "a target is more than 1000 km away" : "a target is not finite",
             "Check the numbers it is built from.");
        return false;
      }
    for (const double x : p.R)
      if (!std::isfinite(x)) {
        fail("the orientation of a target is not finite", "Check the numbers it is built from.");
        return false;
      }
    return true;
  }
  std::optional<Goal> goal(const Target& t, bool is_ptp) {
    Goal g;
    g.point = t.point;
    const bool is_joints = t.role == RMP_ROLE_JOINT || t.role == RMP_ROLE_MAIN_JOINT;
    if (t.role == RMP_ROLE_ADD_JOINT) {
      fail("a motion of additional joints only cannot be posted",
           "Add the robot's target (JOINT or ROBTARGET), or switch the gripper with a signal.");
      return std::nullopt;
    }
    if (t.role == RMP_ROLE_POSITION) {
      fail("a target that keeps the present orientation cannot be posted",
           "Write POSE(position, orientation).");
      return std::nullopt;
    }
    if (t.point) g.external = outer(*t.point);
    if (is_joints) {
      if (!t.point) {
        fail("joint values computed at run time cannot be posted",
             "Build the target from constants, or post the flattened program (form = \"flat\").");
        return std::nullopt;
      }
      if (is_ptp || !t.point->has_pose) {
        if (!is_ptp) {
          fail("a straight motion to joint values needs their pose, which is unknown",
               "Name the robot: program.post{robot = ...}.");
          return std::nullopt;
        }
        g.is_joints = true;
        g.axes = axes(*t.point);
        for (const double x : g.axes)
          if (!std::isfinite(x) || std::fabs(x) > 1e7) {
            fail("a joint value of this target is not a usable number",
                 "Check what it is built from.");
            return std::nullopt;
          }
        if (g.axes.empty()) return std::nullopt;
      }
    }
    if (g.is_joints) return g;
    if (t.point && t.point->has_pose) {
      if (!is_sane(t.point->pose)) return std::nullopt;
      no_turns(t.point);
      g.pose = t.point->pose;
      return g;
    }
    if (t.role != RMP_ROLE_POSE) {
      fail("a target of this kind cannot be posted if it is computed at run time",
           "Make it a POSE, or post the flattened program (form = \"flat\").");
      return std::nullopt;
    }
    g.text = text(t.expression);
    return g.text.empty() ? std::nullopt : std::optional<Goal>(g);
  }
  std::vector<double> outer(const PostPoint& p) {
    const bool in_profile = std::any_of(profile_.axes.begin(), profile_.axes.end(),
                                        [](const PostAxis& a) { return a.external; });
    const bool moved =
        std::any_of(p.external.begin(), p.external.end(), [](double x) { return x != 0; });
    if (!in_profile || !has_external()) {
      if (moved || (in_profile && !has_external()))
        fail(has_external()
                 ? "the profile names no external axes for the additional joints of this target"
                 : std::string(caps_.title) + " has no external axes in targets",
             has_external()
                 ? "Add axes with is_external = true to the profile."
                 : "Move them with signals, or remove them from the profile and the target.");
      return {};
    }
    // A target without additional joints leaves them unchanged.
    if (p.external.empty()) return {};
    return external_axes(p);
  }
  bool is_given(const Motion& m, std::uint32_t a, double usual) {
    return m[a].given && (!m[a].known || *m[a].known != usual);
  }
  void resolve(const Motion& m) {
    Move out;
    const std::uint32_t errors = errors_;
    out.is_ptp = m.interpolation == RMP_MOVE_PTP;
    out.incremental = m.incremental;
    const std::string title(caps_.title);
    if ((m[RMP_ATTR_TIME].known && *m[RMP_ATTR_TIME].known >= 0) ||
        (!m[RMP_ATTR_TIME].known && m[RMP_ATTR_TIME].expression != RMP_NONE))
      fail(title + " has no motions with a given duration", "Give SPEED instead of TIME.");
    if (is_given(m, RMP_ATTR_WOBBLE, 0))
      fail(title + " has no weaving here", "Remove WOBBLE, and weave with the welding equipment.");
    if (is_given(m, RMP_ATTR_DEVICE, 1) || is_given(m, RMP_ATTR_ADAX_CONTROL, 0))
      fail(title + " has no DEVICE or ADAX_CONTROL", "Remove the attribute.");
    if ((m[RMP_ATTR_C_SPEED].known && *m[RMP_ATTR_C_SPEED].known != 100) ||
        (!m[RMP_ATTR_C_SPEED].known && m[RMP_ATTR_C_SPEED].expression != RMP_NONE))
      warn("the speed in the transition (C_SPEED) is left to the controller");
    if (!has_speed_ori() && !out.is_ptp && m[RMP_ATTR_SPEED_ORI].given)
      warn("the speed of the orientation (SPEED_ORI) is left to the controller");
    const std::uint32_t acc = out.is_ptp ? RMP_ATTR_ACC_PTP : RMP_ATTR_ACC;
    if (!has_acc() && is_given(m, acc, 100)) warn("the acceleration is left to the controller");
    out.speed = value(m[out.is_ptp ? RMP_ATTR_SPEED_PTP : RMP_ATTR_SPEED], out.is_ptp ? 100 : 250);
    out.speed_ori = value(m[RMP_ATTR_SPEED_ORI], 90);
    out.acc = value(m[acc], 100);
    out.blend = value(m[out.is_ptp ? RMP_ATTR_C_PTP : RMP_ATTR_C_CP], 0);
    check(out.speed, out.is_ptp, "speed");
    if (out.acc.known && !(*out.acc.known > 0 && *out.acc.known <= 100))
      fail("an acceleration of " + trimmed(*out.acc.known, 3) + " % is outside 0 to 100",
           "Give a percentage of the maximum.");
    if (out.blend.known && *out.blend.known < 0) fail("a blending distance is negative");
    if (m[RMP_ATTR_C_PASS].given && !m[RMP_ATTR_C_PASS].known)
      fail("C_PASS cannot be posted if it is computed at run time", "Write TRUE or FALSE.");
    const bool pass = m[RMP_ATTR_C_PASS].known && *m[RMP_ATTR_C_PASS].known != 0;
    out.passes = pass || !out.blend.text.empty() || (out.blend.known && *out.blend.known > 0);
    if (pass && out.blend.known && *out.blend.known == 0) {
      out.blend.known = number_option("pass", out.is_ptp ? 10 : 5);
      note("C_PASS without a distance is posted as " + trimmed(*out.blend.known, 3) +
               (out.is_ptp ? " %" : " mm"),
           "Give C_CP or C_PTP, or set the profile's option pass.");
    }
    out.tool = placing(m[RMP_ATTR_TOOL], profile_.tool, profile_.tools);
    out.frame = placing(m[RMP_ATTR_FRAME], profile_.frame, profile_.frames);
    for (const Placing* p : {&out.tool, &out.frame})
      if (p->pose) static_cast<void>(is_sane(*p->pose));
    for (const Target& t : m.targets) {
      auto g = goal(t, out.is_ptp);
      if (!g) return;
      out.goals.push_back(std::move(*g));
    }
    if (m.incremental && !is_translation(out)) return;
    if (m.interpolation == RMP_MOVE_CIRCLE && (out.goals.size() != 2 || m.incremental)) {
      fail("a circle needs a via point and an end point, both absolute");
      return;
    }
    if (errors_ == errors) write_move(m, out);
  }
  void check(const Number& n, bool is_ptp, const char* what) {
    if (!n.known) return;
    if (!(*n.known > 0))
      fail(std::string("a ") + what + " of " + trimmed(*n.known, 6) + " moves nothing",
           "Give a value above zero.");
    else if (is_ptp && *n.known > 100)
      fail(std::string("a ") + what + " of " + trimmed(*n.known, 3) + " % exceeds 100 %",
           "SPEED_PTP is a percentage of the maximum, up to 100.");
    else if (!is_ptp && profile_.max_speed > 0 && *n.known > profile_.max_speed)
      fail(std::string("a ") + what + " of " + trimmed(*n.known, 3) +
               " mm/s is above the robot's " + trimmed(profile_.max_speed, 3),
           "Give a lower SPEED.");
  }
  bool is_translation(const Move& m) {
    for (const Goal& g : m.goals) {
      bool straight = !g.is_joints && g.pose;
      for (std::size_t i = 0; straight && i < 9; ++i)
        straight = std::fabs(g.pose->R[i] - (i % 4 == 0 ? 1.0 : 0.0)) < 1e-12;
      if (straight) continue;
      fail("an increment of joints or of an orientation, or an unknown increment, cannot be posted",
           "Write the target itself, or post the flattened program (form = \"flat\").");
      return false;
    }
    return true;
  }
  /// A number for use inside a text.
  std::string shown(const Number& n, int digits) {
    return n.known ? number(*n.known, digits) : n.text;
  }

  /// Blending distance in millimetres: C_CP itself; C_PTP by the profile's option c_ptp_mm, the
  /// distance for 100 %.
  Number blend_mm(const Move& m) {
    if (!m.is_ptp || !m.passes) return m.blend;
    const double full = number_option("c_ptp_mm", 100);
    if (!m.blend.known) {
      note("C_PTP is posted as a distance, 100 % being " + trimmed(full, 3) + " mm",
           "The profile's option c_ptp_mm sets this distance.");
      return {std::nullopt, "(" + m.blend.text + ") * " + trimmed(full / 100, 6, 1)};
    }
    Number mm;
    mm.known = *m.blend.known * full / 100;
    note("C_PTP of " + trimmed(*m.blend.known, 3) + " % is posted as " + trimmed(*mm.known, 3) +
             " mm",
         "The profile's option c_ptp_mm sets the distance for 100 %.");
    return mm;
  }
  static std::string plain(double v) {
    if (!std::isfinite(v)) return "0.0";
    return without_exponent(v);
  }
  /// Numbers without exponents, since not every controller reads those.
  std::string real_literal(double v) override { return plain(v); }

  // ---- calls ----
  /// A new variable of the current routine; only if functions become procedures.
  virtual std::string temporary(Kind) { return "t"; }
  virtual std::string call_line(const std::string& name, const std::string& arguments) {
    return "CALL " + name + "(" + arguments + ")";
  }
  virtual bool has_functions() const { return false; }
  /// If functions are not supported, one is called before the statement, and returns its value by a
  /// parameter.
  Text call_function(std::uint32_t r, std::span<const std::uint32_t> arguments) override {
    if (has_functions()) return Writer::call_function(r, arguments);
    if (!may_call_) {
      fail(
          "a function of the program cannot be posted in a condition that is evaluated repeatedly, "
          "since " +
              std::string(caps_.title) + " has no functions",
          "Assign its value to a variable before, and at the end of the loop.");
      return {};
    }
    const std::string all = list(arguments);
    const std::string to = temporary(kind(routine(r).result));
    line(call_line(routine_name(r), all + (all.empty() ? "" : ", ") + to));
    return {to};
  }
  /// Rejects routines that these languages lack within a program.
  void refuse_beside(std::uint32_t r) {
    if (routine(r).kind == RMP_ROUTINE_PROCESS)
      cannot("parallel processes", "Post them as separate programs.");
    if (routine(r).kind == RMP_ROUTINE_INTERRUPT)
      cannot("interrupts", "Test the condition in the program.");
  }
  void call(std::uint32_t r, std::span<const std::uint32_t> arguments) override {
    std::string all = list(arguments);
    if (routine(r).kind == RMP_ROUTINE_FUNCTION && !has_functions())
      all += (all.empty() ? "" : ", ") + temporary(kind(routine(r).result));
    line(call_line(routine_name(r), all));
  }
  /// A condition that is evaluated more than once, or elsewhere than at its position.
  std::string asked_again(std::uint32_t condition) {
    may_call_ = false;
    std::string s = text(condition);
    may_call_ = true;
    return s;
  }
  /// For programs that run ahead of their motions: waits for these before reading signals.
  void settle_for(std::uint32_t condition) {
    if (reads_signals(condition)) settle();
  }
  void loop_asks(std::uint32_t condition) {
    settle_for(condition);
    reads_.push_back(reads_signals(condition));
  }
  void loop_asks_again() {
    if (reads_.back()) settle();
    reads_.pop_back();
  }
  /// The range of FOR in the target's language: from, to and, unless it is 1, the added step.
  /// `sign` is the precedence of a sign.
  std::string range(std::uint32_t from, std::uint32_t to, std::uint32_t step, bool down,
                    const char* to_word, const char* step_word, int sign) {
    std::string out = text(from);
    out += to_word + text(to);
    if (step == RMP_NONE) return out + (down ? step_word + std::string("-1") : "");
    const Text by = expr(step);
    return out + step_word + (down ? "-" + within(by, sign) : by.text);
  }
  /// An index with another origin, shifted.
  static std::string counted(const std::string& index, std::int64_t shift) {
    std::int64_t number = 0;
    const auto r = std::from_chars(index.data(), index.data() + index.size(), number);
    if (r.ec == std::errc() && r.ptr == index.data() + index.size())
      return std::to_string(number + shift);
    if (shift == 0) return index;
    return index + (shift > 0 ? " + " : " - ") + std::to_string(shift > 0 ? shift : -shift);
  }
  /// Indices, one after another; `first` is the number of the first element in the target.
  static std::string counted(const std::vector<std::string>& indices,
                             const std::vector<Bounds>& bounds, std::int64_t first,
                             const char* between = ", ") {
    std::string out;
    for (std::size_t k = 0; k < indices.size(); ++k)
      out += (k ? between : "") + counted(indices[k], first - std::int64_t{bounds[k].lower});
    return out;
  }
  /// Values of a message as words and numbers, one after another; nothing = a fault was reported.
  std::optional<std::string> message_text(std::span<const std::uint32_t> values,
                                          const char* between) {
    std::string all;
    for (const std::uint32_t v : values) {
      if (!is_word(v)) return std::nullopt;
      all += (all.empty() ? "" : between) + text(v);
    }
    return all;
  }
  bool is_word(std::uint32_t value) {
    const Kind k = kind(expression(value).type);
    if (k != Kind::none && k != Kind::transform) return true;
    cannot("messages of " + type_name(expression(value).type), "Write its parts.");
    return false;
  }
  /// For a wait in languages that count milliseconds.
  void warn_of_rounding(std::uint32_t seconds) {
    const auto k = known(seconds);
    if (k && std::fabs(*k * 1000 - std::round(*k * 1000)) > 1e-9)
      warn("the time is rounded to milliseconds");
  }
  /// Checks that a signal has a number and is not analogue; reports a fault otherwise.
  bool is_numbered(const Signal& s) {
    if (s.type == RMP_TYPE_REAL) cannot("analog signals", "Use an INT of several bits.");
    if (!s.target.empty())
      fail("signals of " + std::string(caps_.title) + " have numbers, and the profile names one " +
               s.target,
           "Give number instead of target in the profile.");
    return s.type != RMP_TYPE_REAL && s.target.empty();
  }
  static std::vector<std::string_view> lines_of(std::string_view s) {
    std::vector<std::string_view> out;
    while (!s.empty()) {
      const std::size_t end = std::min(s.find('\n'), s.size());
      out.push_back(s.substr(0, end));
      s.remove_prefix(std::min(end + 1, s.size()));
    }
    return out;
  }
  /// A string in these quotes; characters that cannot be written are an error.
  Text quoted(std::string_view s, char quote) {
    for (const char c : s)
      if (c == quote || c == '\\' || c < ' ' || c > '~') {
        cannot("strings with quotes, backslashes or characters beyond ASCII",
               "Rewrite it without them.");
        return {};
      }
    return {quote + std::string(s) + quote};
  }
  static bool is_identity(const Pose& p) { return p.p == Pose{}.p && p.R == Pose{}.R; }

  // ---- signals ----
  /// TRUE or FALSE of an output: its constant, or nothing.
  std::optional<bool> constant_bool(std::uint32_t e, bool inverted) const {
    const auto k = known(e);
    return k ? std::optional<bool>((*k != 0) != inverted) : std::nullopt;
  }
  bool reads_signals(std::uint32_t e) const {
    std::vector<std::uint32_t> open{e};
    while (!open.empty()) {
      const std::uint32_t i = open.back();
      open.pop_back();
      if (i == RMP_NONE) continue;
      const auto& x = expression(i);
      if (x.op == RMP_EXPR_SYMBOL && x.symbol != RMP_NONE &&
          (symbol(x.symbol).kind == RMP_SYMBOL_INPUT || symbol(x.symbol).kind == RMP_SYMBOL_OUTPUT))
        return true;
      for (const std::uint32_t o : links(x.first, x.count)) open.push_back(o);
    }
    return false;
  }
  /// True if it depends on signals and constants only.
  bool is_of_signals_only(std::uint32_t e) const {
    std::vector<std::uint32_t> open{e};
    while (!open.empty()) {
      const auto& x = expression(open.back());
      open.pop_back();
      if (x.constant != RMP_NONE) continue;
      if (x.op == RMP_EXPR_SYMBOL &&
          (x.symbol == RMP_NONE || symbol(x.symbol).kind != RMP_SYMBOL_INPUT))
        return false;
      if (x.op == RMP_EXPR_CALL || x.op == RMP_EXPR_INTRINSIC) return false;
      for (const std::uint32_t o : links(x.first, x.count)) open.push_back(o);
    }
    return true;
  }
  /// Checks that the result of a function, a parameter or a local has a kind that the target
  /// supports.
  bool check_parameters(std::uint32_t r) {
    bool all_right = true;
    for (std::uint32_t k = 0; k < routine(r).parameter_count; ++k) {
      const auto& p = symbol(routine(r).first_parameter + k);
      if (kind(p.type) != Kind::none) continue;
      at_ = p.span;
      cannot("parameters of " + type_name(p.type), "Use a variable of the program instead.");
      all_right = false;
    }
    return all_right;
  }
  [[nodiscard]] std::uint32_t parameter(std::uint32_t r, std::uint32_t k) const {
    return routine(r).first_parameter + k;
  }

 private:
  std::map<std::pair<std::uint32_t, std::string>, std::uint64_t> keys_;
  std::vector<std::uint32_t> to_set_;
  std::vector<bool> reads_;  ///< of the enclosing WHILEs: whether they read signals

 protected:
  bool may_call_ = true;
};

}  // namespace robomosp::post::brand
