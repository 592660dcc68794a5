// SPDX-License-Identifier: Apache-2.0
#include "model/parametric.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <utility>

#include "kernel/text.h"

namespace robomosp::model {

namespace {

using text::quote;

/// A number in a record: in place, or a coordinate of a profile, which is shared and so copied when
/// it is written.
struct Located {
  double* number = nullptr;
  std::string_view unit;
  SolidNode* node = nullptr;  ///< of a profile's number
  std::size_t loop = 0, curve = 0, point = 0, axis = 0;
  bool is_start = false;

  [[nodiscard]] double* in(CsgProfile& profile) const {
    CsgLoop& l = profile.loops[loop];
    return is_start ? &l.start[axis] : &l.curves[curve].points[point][axis];
  }
};

/// Takes "word." off the front.
bool take(std::string_view& path, std::string_view word) {
  if (path.size() <= word.size() || !path.starts_with(word) || path[word.size()] != '.')
    return false;
  path.remove_prefix(word.size() + 1);
  return true;
}
/// Takes "12." off the front: a place in a list, counted from 1.
std::optional<std::size_t> take_index(std::string_view& path, std::size_t size) {
  const auto dot = path.find('.');
  const auto i = dot == std::string_view::npos ? std::nullopt : text::read_int(path.substr(0, dot));
  if (!i || *i < 1 || *i > static_cast<std::int64_t>(size)) return std::nullopt;
  path.remove_prefix(dot + 1);
  return static_cast<std::size_t>(*i - 1);
}
std::optional<std::size_t> axis(std::string_view path) {
  if (path.size() != 1 || path[0] < 'x' || path[0] > 'z') return std::nullopt;
  return static_cast<std::size_t>(path[0] - 'x');
}

std::optional<Located> locate(Placement& p, std::string_view path) {
  if (take(path, "position")) {
    const auto i = axis(path);
    if (!i) return std::nullopt;
    const bool is_angle = (p.coordinates == PositionNotation::cylindrical && *i == 1) ||
                          (p.coordinates == PositionNotation::spherical && *i >= 1);
    return Located{&p.position[*i], is_angle ? "rad" : "m"};
  }
  constexpr std::string_view kNotations[] = {"rpy", "xyz", "zyz"};
  if (!take(path, kNotations[static_cast<std::size_t>(p.notation)])) return std::nullopt;
  const auto i = axis(path);
  if (!i) return std::nullopt;
  return Located{&p.angles[*i], "rad"};
}

std::optional<Located> locate_profile(SolidNode& n, std::string_view path) {
  const auto loop = take_index(path, n.profile->loops.size());
  if (!loop) return std::nullopt;
  const CsgLoop& l = n.profile->loops[*loop];
  const bool is_circle = !l.curves.empty() && l.curves[0].kind == CsgCurve::Kind::circle;
  Located at{nullptr, "m", &n, *loop};
  if (is_circle && path == "radius") {
    at.point = 1;
    return l.curves[0].points.size() == 2 ? std::optional(at) : std::nullopt;
  }
  auto point = take_index(path, std::size_t{1} << 30);
  if (!point || (path != "x" && path != "y")) return std::nullopt;
  at.axis = path == "y" ? 1 : 0;
  if (is_circle) return *point == 0 ? std::optional(at) : std::nullopt;
  if (*point == 0) {
    at.is_start = true;
    return at;
  }
  --*point;
  for (at.curve = 0; at.curve < l.curves.size(); ++at.curve) {
    const std::size_t count = l.curves[at.curve].points.size();
    if (*point < count) {
      at.point = *point;
      return at;
    }
    *point -= count;
  }
  return std::nullopt;
}

/// Whole numbers, texts and lists among the parameters are none.
std::optional<Located> locate(ProviderChoice& choice, std::string_view path) {
  const auto it = choice.params.find(std::string(path));
  double* number = it == choice.params.end() ? nullptr : std::get_if<double>(&it->second);
  return number ? std::optional(Located{number, kAnyUnit}) : std::nullopt;
}

std::optional<Located> locate(SolidNode& n, std::string_view path) {
  const CsgNodeInfo& info = csg_info(n.kind);
  for (std::size_t k = 0; k < csg_size_count(n.kind); ++k)
    if (info.sizes[k].name == path) return Located{&n.sizes[k], info.sizes[k].unit};
  if (n.profile && take(path, "profile")) return locate_profile(n, path);
  if (n.kind == CsgKind::custom && take(path, "primitive")) return locate(n.primitive, path);
  return locate(n.placement, path);
}
std::optional<Located> locate(ObjectPart& p, std::string_view path) {
  return locate(p.placement, path);
}
std::optional<Located> locate(PlacedObject& p, std::string_view path) {
  return locate(p.placement, path);
}
std::optional<Located> locate(PlacedRobot& p, std::string_view path) {
  return locate(p.placement, path);
}
std::optional<Located> locate(PlacedTrajectory& p, std::string_view path) {
  return locate(p.placement, path);
}
std::optional<Located> locate(PlacedFrame& p, std::string_view path) {
  return locate(p.placement, path);
}
std::optional<Located> locate(PlacedLight& p, std::string_view path) {
  return locate(p.placement, path);
}

std::optional<Located> locate(std::vector<BodyPart>& parts, std::string_view path) {
  const auto i = take_index(path, parts.size());
  return i ? locate(parts[*i].placement, path) : std::nullopt;
}

std::optional<Located> locate(Link& l, std::string_view path) {
  const bool slides = l.joint == JointKind::prismatic;
  const struct {
    std::string_view name;
    double* number;
    std::string_view unit;
  } numbers[] = {{"a", &l.row.a, "m"},
                 {"alpha", &l.row.alpha, "rad"},
                 {"d", &l.row.d, "m"},
                 {"theta", &l.row.theta, "rad"},
                 {"lower", &l.lower, slides ? "m" : "rad"},
                 {"upper", &l.upper, slides ? "m" : "rad"},
                 {"max_velocity", &l.max_velocity, slides ? "m/s" : "rad/s"},
                 {"max_acceleration", &l.max_acceleration, slides ? "m/s^2" : "rad/s^2"},
                 {"max_jerk", &l.max_jerk, slides ? "m/s^3" : "rad/s^3"},
                 {"max_force", &l.max_force, slides ? "N" : "N m"},
                 {"stiffness", &l.spring.stiffness, slides ? "N/m" : "N m/rad"},
                 {"rest", &l.spring.rest, slides ? "m" : "rad"},
                 {"motor_inertia", &l.drive.motor_inertia, "kg m^2"},
                 {"gear_ratio", &l.drive.gear_ratio, ""},
                 {"viscous", &l.drive.viscous, "N m s/rad"},
                 {"coulomb_positive", &l.drive.coulomb_positive, "N m"},
                 {"coulomb_negative", &l.drive.coulomb_negative, "N m"}};
  for (const auto& n : numbers)
    if (n.name == path) return Located{n.number, n.unit};
  if (l.given && path == "mass") return Located{&l.given->mass, "kg"};
  if (l.given && take(path, "com")) {
    const auto i = axis(path);
    return i ? std::optional(Located{&l.given->com[*i], "m"}) : std::nullopt;
  }
  if (l.origin && take(path, "origin")) return locate(*l.origin, path);
  if (l.mimic && path == "mimic.ratio") return Located{&l.mimic->ratio, ""};
  if (l.mimic && path == "mimic.offset") return Located{&l.mimic->offset, slides ? "m" : "rad"};
  if (take(path, "parts")) return locate(l.parts, path);
  return std::nullopt;
}

std::optional<Located> locate(RobotTool& t, std::string_view path) {
  return locate(t.placement, path);
}
std::optional<Located> locate(LoopClosure& l, std::string_view path) {
  if (take(path, "a")) return locate(l.in_a, path);
  if (take(path, "b")) return locate(l.in_b, path);
  return std::nullopt;
}

/// A named element of a list. Names may hold dots, so each is tried.
template <class T>
std::optional<Located> locate_in(std::vector<T>& list, std::string_view path) {
  for (T& element : list) {
    std::string_view rest = path;
    if (take(rest, element.name))
      if (auto at = locate(element, rest)) return at;
  }
  return std::nullopt;
}

std::optional<Located> locate(Material&, std::string_view) { return std::nullopt; }
std::optional<Located> locate(Trajectory&, std::string_view) { return std::nullopt; }
std::optional<Located> locate(Task&, std::string_view) { return std::nullopt; }
std::optional<Located> locate(Solid& s, std::string_view path) {
  if (path == "chord") return Located{&s.chord, "m"};
  return locate_in(s.nodes, path);
}
std::optional<Located> locate(Object& o, std::string_view path) { return locate_in(o.parts, path); }
std::optional<Located> locate(Robot& r, std::string_view path) {
  if (auto at = locate_in(r.links, path)) return at;
  std::string_view rest = path;
  if (take(rest, "base")) return locate(r.base, rest);
  if (take(rest, "tool")) return locate(r.tool, rest);
  if (take(rest, "base_parts")) return locate(r.base_parts, rest);
  if (take(rest, "tools")) return locate_in(r.tools, rest);
  if (take(rest, "loops")) return locate_in(r.loops, rest);
  return std::nullopt;
}
std::optional<Located> locate(World& w, std::string_view path) {
  if (auto at = locate_in(w.objects, path)) return at;
  if (auto at = locate_in(w.robots, path)) return at;
  if (auto at = locate_in(w.trajectories, path)) return at;
  if (auto at = locate_in(w.frames, path)) return at;
  if (auto at = locate_in(w.lights, path)) return at;
  const auto i = take(path, "gravity") ? axis(path) : std::nullopt;
  return i ? std::optional(Located{&w.gravity[*i], "m/s^2"}) : std::nullopt;
}
std::optional<Located> locate(Body& body, std::string_view path) {
  return std::visit([path](auto& b) { return locate(b, path); }, body);
}

/// An expression of a record, read.
struct Compiled {
  std::string where;  ///< path, or `parameter "wall"`
  Expression expression;
};
template <class Fn>
void for_each_text(const Parametric& p, Fn&& fn) {
  for (const Parameter& v : p.parameters)
    if (!v.expression.empty()) fn("parameter " + quote(v.name), v.expression);
  for (const auto& [path, expression] : p.expressions) fn(path, expression);
}
/// Those that can be read; the others are faults that resolve() tells.
std::vector<Compiled> compiled(const Parametric& p) {
  std::vector<Compiled> out;
  for_each_text(p, [&](std::string where, const std::string& expression) {
    auto e = Expression::compile(expression);
    if (e.ok()) out.push_back({std::move(where), std::move(*e)});
  });
  return out;
}

/// The parameters of a record, evaluated in the order of their dependencies.
class Resolver {
 public:
  Resolver(Parametric& p, std::string_view own_name, bool is_world, const WorldParameters& worlds)
      : p_(p), own_name_(own_name), is_world_(is_world), worlds_(worlds) {}

  Result<void> run() {
    for (std::size_t i = 0; i < p_.parameters.size(); ++i) {
      const Parameter& v = p_.parameters[i];
      RMP_TRY(Expression::check_name(v.name, "parameter"));
      if (!index_.emplace(v.name, i).second)
        return error(ErrorCode::conflict, "there are two parameters named " + quote(v.name),
                     "Give each its own name.");
    }
    state_.resize(p_.parameters.size());
    for (std::size_t i = 0; i < p_.parameters.size(); ++i) {
      const std::string& text = p_.parameters[i].expression;
      if (text.empty()) {
        state_[i] = State::done;
        expressions_.emplace_back();
        continue;
      }
      auto e = Expression::compile(text);
      if (!e.ok()) return std::move(e).error().in("parameter " + quote(p_.parameters[i].name));
      expressions_.push_back(std::move(*e));
    }
    for (std::size_t i = 0; i < p_.parameters.size(); ++i) RMP_TRY(evaluate_from(i));
    return {};
  }

  /// The number of an expression; none when it uses a world that is not there.
  Result<std::optional<double>> value(const Expression& e, std::string_view unit) const {
    for (const auto& n : e.names()) {
      if (is_own(n)) continue;
      if (is_world_)
        return error(ErrorCode::invalid_argument,
                     quote(e.text()) + " uses " + Expression::spell(n) + " of another world",
                     "The expressions of a world use its own parameters only.");
      if (!worlds_(n)) return std::optional<double>();
    }
    const auto names = lookup(p_, is_world_ ? own_name_ : std::string_view(), worlds_);
    if (unit == kAnyUnit) {
      RMP_TRY_ASSIGN(const Quantity q, e.evaluate(names));
      return std::optional(q.value);
    }
    RMP_TRY_ASSIGN(const double v, e.evaluate(names, unit));
    return std::optional(v);
  }

 private:
  enum class State : std::uint8_t { waiting, open, done };

  [[nodiscard]] bool is_own(const Expression::Name& n) const {
    return n.scope.empty() || (is_world_ && n.scope == own_name_);
  }

  /// Depth first with a stack of our own: what a parameter uses comes before it.
  Result<void> evaluate_from(std::size_t start) {
    if (state_[start] == State::done) return {};
    std::vector<std::pair<std::size_t, std::size_t>> path{{start, 0}};
    state_[start] = State::open;
    while (!path.empty()) {
      const auto [i, next] = path.back();
      const auto& names = expressions_[i]->names();
      if (next == names.size()) {
        Parameter& v = p_.parameters[i];
        auto got = value(*expressions_[i], v.unit);
        if (!got.ok()) return std::move(got).error().in("parameter " + quote(v.name));
        if (*got) v.value = **got;
        state_[i] = State::done;
        path.pop_back();
        continue;
      }
      ++path.back().second;
      const auto used = is_own(names[next]) ? index_.find(names[next].name) : index_.end();
      if (used == index_.end() || state_[used->second] == State::done) continue;
      if (state_[used->second] == State::open) return circle(path, used->second);
      state_[used->second] = State::open;
      path.emplace_back(used->second, 0);
    }
    return {};
  }
  [[nodiscard]] Error circle(const std::vector<std::pair<std::size_t, std::size_t>>& path,
                             std::size_t first) const {
    std::string names;
    bool is_inside = false;
    for (const auto& [i, next] : path) {
      is_inside = is_inside || i == first;
      if (is_inside) names += p_.parameters[i].name + " > ";
    }
    names += p_.parameters[first].name;
    return error(ErrorCode::conflict,
                 "parameter " + quote(p_.parameters[first].name) + " depends on itself: " + names,
                 "Give one of them a plain value.");
  }

  Parametric& p_;
  std::string_view own_name_;
  bool is_world_;
  const WorldParameters& worlds_;
  std::unordered_map<std::string_view, std::size_t> index_;
  std::vector<std::optional<Expression>> expressions_;
  std::vector<State> state_;
};

// ---- following edits ----

using Renamed = std::pair<std::string, std::string>;

/// The one element whose name differs, when the lists are as long as each other.
template <class T>
void find_renamed(const std::vector<T>& before, const std::vector<T>& after,
                  std::vector<Renamed>& out) {
  if (before.size() != after.size()) return;
  const T* old = nullptr;
  const T* now = nullptr;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i].name == after[i].name) continue;
    if (old) return;
    old = &before[i];
    now = &after[i];
  }
  if (old) out.emplace_back(old->name, now->name);
}

std::vector<Renamed> renamed_elements(const Body& before, const Body& after) {
  std::vector<Renamed> out;
  if (const auto* a = std::get_if<Solid>(&before))
    find_renamed(a->nodes, std::get<Solid>(after).nodes, out);
  if (const auto* a = std::get_if<Object>(&before))
    find_renamed(a->parts, std::get<Object>(after).parts, out);
  if (const auto* a = std::get_if<Robot>(&before))
    find_renamed(a->links, std::get<Robot>(after).links, out);
  if (const auto* a = std::get_if<World>(&before)) {
    const World& b = std::get<World>(after);
    find_renamed(a->objects, b.objects, out);
    find_renamed(a->robots, b.robots, out);
    find_renamed(a->trajectories, b.trajectories, out);
  }
  return out;
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

}  // namespace

Parametric* parametric_of(Body& body) {
  struct Visitor {
    Parametric* operator()(Material&) const { return nullptr; }
    Parametric* operator()(Trajectory&) const { return nullptr; }
    Parametric* operator()(Task&) const { return nullptr; }
    Parametric* operator()(Solid& b) const { return &b.parametric; }
    Parametric* operator()(Object& b) const { return &b.parametric; }
    Parametric* operator()(Robot& b) const { return &b.parametric; }
    Parametric* operator()(World& b) const { return &b.parametric; }
  };
  return std::visit(Visitor{}, body);
}
const Parametric* parametric_of(const Body& body) {
  return parametric_of(const_cast<Body&>(body));  // only its address is taken
}

std::optional<PathNumber> number_at(const Body& body, std::string_view path) {
  const auto at = locate(const_cast<Body&>(body), path);  // only read below
  if (!at) return std::nullopt;
  if (at->number) return PathNumber{*at->number, at->unit};
  return PathNumber{*at->in(const_cast<CsgProfile&>(*at->node->profile)), at->unit};
}

const double* number_in(const Body& body, std::string_view path) {
  const auto at = locate(const_cast<Body&>(body), path);  // only its address is taken
  if (!at) return nullptr;
  return at->number ? at->number : at->in(const_cast<CsgProfile&>(*at->node->profile));
}

bool set_number(Body& body, std::string_view path, double value) {
  const auto at = locate(body, path);
  if (!at) return false;
  if (at->number) {
    *at->number = value;
    return true;
  }
  if (same_bits(*at->in(const_cast<CsgProfile&>(*at->node->profile)), value)) return true;
  auto profile = std::make_shared<CsgProfile>(*at->node->profile);
  *at->in(*profile) = value;
  at->node->profile = std::move(profile);
  return true;
}

Quantity quantity_of(const Parameter& p) {
  const auto unit = units::parse(p.unit);
  return {p.value, unit.ok() ? unit->dimension : units::Dimension{}, false};
}

const Parameter* find_parameter(const Parametric& p, std::string_view name) {
  for (const Parameter& v : p.parameters)
    if (v.name == name) return &v;
  return nullptr;
}

Expression::Lookup lookup(const Parametric& p, std::string_view own_name,
                          const WorldParameters& worlds) {
  return [&p, own_name, &worlds](const Expression::Name& n) -> Result<Quantity> {
    if (n.scope.empty() || n.scope == own_name) {
      if (const Parameter* v = find_parameter(p, n.name)) return quantity_of(*v);
      std::vector<std::string> known;
      for (const Parameter& v : p.parameters) known.push_back(v.name);
      std::string hint = text::did_you_mean(n.name, known);
      if (hint.empty())
        hint = known.empty() ? "Add it with set_parameter."
                             : "Parameters are " + text::enumerate(known) + ".";
      return error(ErrorCode::unknown_name, "there is no parameter " + quote(n.name),
                   std::move(hint));
    }
    if (const auto q = worlds(n)) return *q;
    return error(ErrorCode::unknown_name,
                 "there is no world " + quote(n.scope) + " with a parameter " + quote(n.name),
                 "Load the world, or add the parameter to it with world.set_parameter.");
  };
}

Result<void> resolve(Body& body, std::string_view own_name, const WorldParameters& worlds) {
  Parametric* p = parametric_of(body);
  if (!p || (p->parameters.empty() && p->expressions.empty())) return {};
  const bool is_world = std::holds_alternative<World>(body);
  Resolver resolver(*p, own_name, is_world, worlds);
  RMP_TRY(resolver.run());
  for (const auto& [path, text] : p->expressions) {
    const auto number = number_at(body, path);
    if (!number)
      return error(ErrorCode::unknown_name, quote(path) +
                                                " names no number that can be an "
                                                "expression");
    auto e = Expression::compile(text);
    if (!e.ok()) return std::move(e).error().in(path);
    auto value = resolver.value(*e, number->unit);
    if (!value.ok()) return std::move(value).error().in(path);
    if (*value) set_number(body, path, **value);
  }
  return {};
}

std::vector<Expression::Name> world_mentions(const Body& body) {
  std::vector<Expression::Name> out;
  const Parametric* p = parametric_of(body);
  if (!p || body.index() == static_cast<std::size_t>(Kind::world)) return out;
  for (const Compiled& c : compiled(*p))
    for (const auto& n : c.expression.names())
      if (!n.scope.empty() && std::find(out.begin(), out.end(), n) == out.end()) out.push_back(n);
  return out;
}

std::vector<std::string> uses_of(const Body& body, const Expression::Name& name) {
  std::vector<std::string> out;
  if (const Parametric* p = parametric_of(body))
    for (Compiled& c : compiled(*p)) {
      const auto& names = c.expression.names();
      if (std::find(names.begin(), names.end(), name) != names.end())
        out.push_back(std::move(c.where));
    }
  return out;
}

void rename_in(Body& body, const std::function<Expression::Name(const Expression::Name&)>& rename) {
  Parametric* p = parametric_of(body);
  if (!p) return;
  const auto rewrite = [&](std::string& text) {
    const auto e = Expression::compile(text);
    if (e.ok()) text = e->renamed(rename);
  };
  for (Parameter& v : p->parameters)
    if (!v.expression.empty()) rewrite(v.expression);
  for (auto& [path, text] : p->expressions) rewrite(text);
}

void follow_edit(const Body& before, Body& after) {
  const Parametric* old = parametric_of(before);
  Parametric* now = parametric_of(after);
  if (!old || !now || old->expressions.empty()) return;
  std::optional<std::vector<Renamed>> renamed;
  for (const auto& [path, text] : old->expressions) {
    const auto it = now->expressions.find(path);
    if (it == now->expressions.end() || it->second != text) continue;  // the edit's own affair
    const auto number = number_at(before, path);
    std::string target = path;
    auto found = number_at(after, path);
    if (!found) {
      if (!renamed) renamed = renamed_elements(before, after);
      for (const auto& [from, to] : *renamed) {
        std::string_view rest = path;
        if (!take(rest, from)) continue;
        target = to + "." + std::string(rest);
        found = number_at(after, target);
      }
    }
    const bool is_kept = found && number && same_bits(found->value, number->value);
    if (is_kept && target == path) continue;
    now->expressions.erase(it);
    if (is_kept) now->expressions.emplace(std::move(target), text);
  }
}

}  // namespace robomosp::model
