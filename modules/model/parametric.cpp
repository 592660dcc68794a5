// SPDX-License-Identifier: Apache-2.0
#include "model/parametric.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "kernel/text.h"
#include "model/data.h"
#include "model/field_path.h"

namespace robomosp::model {

namespace {

using text::quote;

/// A coordinate of a profile, "1.3.x": loop and point from 1, of a circle "2.radius". The loops of
/// a profile are drawn point by point, whatever curves join them, so they have paths of their own.
const double* in_profile(const CsgProfile& profile, std::string_view path) {
  const auto take_index = [&path](std::size_t size) -> std::optional<std::size_t> {
    const auto dot = path.find('.');
    const auto i =
        dot == std::string_view::npos ? std::nullopt : text::read_int(path.substr(0, dot));
    if (!i || *i < 1 || *i > static_cast<std::int64_t>(size)) return std::nullopt;
    path.remove_prefix(dot + 1);
    return static_cast<std::size_t>(*i - 1);
  };
  const auto loop = take_index(profile.loops.size());
  if (!loop) return nullptr;
  const CsgLoop& l = profile.loops[*loop];
  const bool is_circle = !l.curves.empty() && l.curves[0].kind == CsgCurve::Kind::circle;
  if (is_circle && path == "radius")
    return l.curves[0].points.size() == 2 ? l.curves[0].points[1].data() : nullptr;
  auto point = take_index(std::size_t{1} << 30);
  if (!point || (path != "x" && path != "y")) return nullptr;
  const std::size_t axis = path == "y" ? 1 : 0;
  if (is_circle) return *point == 0 ? &l.curves[0].points[0][axis] : nullptr;
  if (*point == 0) return &l.start[axis];
  --*point;
  for (const CsgCurve& c : l.curves) {
    if (*point < c.points.size()) return &c.points[*point][axis];
    *point -= c.points.size();
  }
  return nullptr;
}

/// A number that may be an expression.
struct Located {
  double* number = nullptr;
  std::string_view unit;
};

/// The units of a robot's joint coordinates, as robotics::coordinate_units() has them.
std::string_view unit_of_coordinate(const Robot& robot, std::size_t i) {
  const auto units = [](JointKind kind) -> std::string_view {  // a letter each
    switch (kind) {
      case JointKind::revolute: return "r";
      case JointKind::prismatic: return "m";
      case JointKind::fixed: return "";
      case JointKind::universal: return "rr";
      case JointKind::cylindrical: return "mr";
      case JointKind::planar: return "mmr";
      case JointKind::spherical: return "1111";
      case JointKind::free: return "mmm1111";
    }
    return "";
  };
  for (const Link& l : robot.links) {
    if (l.mimic) continue;
    const std::string_view own = units(l.joint);
    if (i < own.size()) return own[i] == 'r' ? "rad" : own[i] == 'm' ? "m" : "";
    i -= own.size();
  }
  return kByJoint;  // more values than coordinates: a fault that the check of the record reports
}

/// The unit of a number, also where another part of the record determines it.
std::string_view unit_in(const Body& body, const Place& at) {
  if (at.type->shape == Shape::setting) return kAnyUnit;
  if (const auto* robot = std::get_if<Robot>(&body)) {
    if (at.type->shape == Shape::reals)
      for (const NamedPose& pose : robot->poses)
        if (&pose.q == at.data) return unit_of_coordinate(*robot, at.component);
    if (at.field->name == "ratio")
      for (const Link& l : robot->links) {
        if (!l.mimic || &l.mimic->ratio != at.data) continue;
        const auto leader = static_cast<std::size_t>(l.mimic->link);
        const bool slides = l.joint == JointKind::prismatic;
        const bool leader_slides =
            leader < robot->links.size() && robot->links[leader].joint == JointKind::prismatic;
        return slides == leader_slides ? "" : slides ? "m/rad" : "rad/m";
      }
  }
  if (const auto* world = std::get_if<World>(&body); world && at.field->name == "initial")
    for (const Signal& signal : world->signals)
      if (&signal.initial == at.data) return signal.unit;
  if (at.type->shape == Shape::reals && at.field->si_unit == kByJoint) return kByJoint;
  return at.unit();
}

/// With `for_change` what versions of the record share is copied on the way to the number.
std::optional<Located> locate(Body& body, std::string_view path, bool for_change) {
  const MutableContent record = content(body);
  const auto at = for_change ? find_for_change(record, path) : find(record, path);
  if (at && at->may_be_expression && at->number()) return Located{at->number(), unit_in(body, *at)};
  constexpr std::string_view kProfile = ".profile.";
  const auto dot = path.rfind(kProfile);
  if (dot == std::string_view::npos) return std::nullopt;
  const std::string_view of_profile = path.substr(0, dot + kProfile.size() - 1);
  const auto shared = find(record, of_profile);
  if (!shared || !shared->may_be_expression || shared->type->element != &type_of<CsgProfile>() ||
      !shared->type->held(shared->data))
    return std::nullopt;
  const void* profile =
      for_change ? shared->type->hold(shared->data) : shared->type->held(shared->data);
  const double* number =
      in_profile(*static_cast<const CsgProfile*>(profile), path.substr(dot + kProfile.size()));
  if (!number) return std::nullopt;
  return Located{const_cast<double*>(number), "m"};  // ours when it is for change
}

/// An expression of a record, read.
struct Compiled {
  std::string where;  ///< path, or `parameter "wall"`
  Expression expression;
};
/// A point that is not of a number, as in `cell.bore`: without one no world is mentioned.
bool may_mention_worlds(std::string_view text) {
  for (std::size_t at = text.find('.'); at != std::string_view::npos; at = text.find('.', at + 1))
    if (at + 1 == text.size() || text[at + 1] < '0' || text[at + 1] > '9') return true;
  return false;
}

/// Those that can be read; the others are faults that resolve() reports.
std::vector<Compiled> compiled(const Parametric& p, bool only_worlds = false) {
  std::vector<Compiled> out;
  const auto read = [&](const std::string& text, const auto& where) {
    if (text.empty() || (only_worlds && !may_mention_worlds(text))) return;
    auto e = Expression::compile(text);
    if (e.ok()) out.push_back({where(), std::move(*e)});
  };
  for (const Parameter& v : p.parameters)
    read(v.expression, [&v] { return "parameter " + quote(v.name); });
  for (const auto& [path, text] : p.expressions) read(text, [&path = path] { return path; });
  return out;
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

/// Parameters of a record, evaluated in the order of their dependencies.
class Resolver {
 public:
  Resolver(Parametric& p, std::string_view own_name, bool is_world, const WorldParameters& worlds)
      : p_(p), all_(p.parameters), own_name_(own_name), is_world_(is_world), worlds_(worlds) {}

  /// All of them.
  Result<void> run() {
    std::vector<std::size_t> all(all_.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    return run(std::move(all));
  }

  /// Those at `which`; the others have their values already.
  Result<void> run(std::vector<std::size_t> which) {
    which_ = std::move(which);
    for (std::size_t k = 0; k < which_.size(); ++k) {
      const Parameter& v = all_[which_[k]];
      RMP_TRY(Expression::check_name(v.name, "parameter"));
      if (!index_.emplace(v.name, k).second)
        return error(ErrorCode::conflict, "there are two parameters named " + quote(v.name),
                     "Give each its own name.");
    }
    state_.resize(which_.size());
    for (std::size_t k = 0; k < which_.size(); ++k) {
      const Parameter& v = all_[which_[k]];
      values_.push_back(v.value);
      if (v.expression.empty()) {
        state_[k] = State::done;
        expressions_.emplace_back();
        continue;
      }
      auto e = Expression::compile(v.expression);
      if (!e.ok()) return std::move(e).error().in("parameter " + quote(v.name));
      expressions_.push_back(std::move(*e));
    }
    for (std::size_t k = 0; k < which_.size(); ++k) RMP_TRY(evaluate_from(k));
    bool is_written = false;
    for (std::size_t k = 0; k < which_.size(); ++k)
      if (!same_bits(all_[which_[k]].value, values_[k])) {
        p_.parameters[which_[k]].value = values_[k];
        is_written = true;
      }
    if (!is_written) return {};
    index_.clear();  // its names may have gone with their blocks
    for (std::size_t k = 0; k < which_.size(); ++k) index_.emplace(name(k), k);
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
    const auto others = lookup(p_, is_world_ ? own_name_ : std::string_view(), worlds_);
    const Expression::Lookup names = [&](const Expression::Name& n) -> Result<Quantity> {
      const auto own = is_own(n) ? index_.find(n.name) : index_.end();
      if (own == index_.end()) return others(n);
      Quantity q = quantity_of(all_[which_[own->second]]);
      q.value = values_[own->second];
      return q;
    };
    if (unit == kAnyUnit || unit == kByJoint) {
      RMP_TRY_ASSIGN(const Quantity q, e.evaluate(names));
      RMP_TRY_ASSIGN(const double v, in_unit(q, unit, e.text()));
      return std::optional(v);
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
        const Parameter& v = all_[which_[i]];
        auto got = value(*expressions_[i], v.unit);
        if (!got.ok()) return std::move(got).error().in("parameter " + quote(v.name));
        if (*got) values_[i] = **got;
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
      if (is_inside) names += name(i) + " > ";
    }
    names += name(first);
    return error(ErrorCode::conflict,
                 "parameter " + quote(name(first)) + " depends on itself: " + names,
                 "Give one of them a plain value.");
  }

  [[nodiscard]] const std::string& name(std::size_t k) const { return all_[which_[k]].name; }

  Parametric& p_;
  const LongList<Parameter>& all_;  ///< of p_, for reading
  std::string_view own_name_;
  bool is_world_;
  const WorldParameters& worlds_;
  std::vector<std::size_t> which_;  ///< places of those that are evaluated; these have, in order:
  std::unordered_map<std::string_view, std::size_t> index_;
  std::vector<std::optional<Expression>> expressions_;
  std::vector<State> state_;
  std::vector<double> values_;
};

/// Whether a name stands in a text by itself, whatever it means there.
bool has_word(std::string_view text, std::string_view word) {
  const auto goes_on = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  for (auto at = text.find(word); at != text.npos; at = text.find(word, at + 1))
    if ((at == 0 || !goes_on(text[at - 1])) &&
        (at + word.size() == text.size() || !goes_on(text[at + word.size()])))
      return true;
  return false;
}

/// What an edit leaves to be evaluated.
struct Affected {
  std::vector<std::size_t> parameters;                                        ///< places, ascending
  std::vector<const std::pair<const std::string, std::string>*> expressions;  ///< of numbers
};

/// More parameters than these are evaluated together with all others.
constexpr std::size_t kFewAffected = 16;

/// What changed since `before` and, by name, what may depend on it; none = it takes all to tell.
std::optional<Affected> affected(const Body& body, const Parametric& now, const Body& before) {
  const Parametric* old = parametric_of(before);
  if (!old) return std::nullopt;
  const auto &is = now.parameters, &was = old->parameters;
  if (is.size() < was.size()) return std::nullopt;
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < is.size() && places.size() <= kFewAffected; ++i) {
    if (i % is.kBlock == 0 && is.shares_block(was, i)) {
      i += is.kBlock - 1;
      continue;
    }
    if (i >= was.size()) {
      for (std::size_t k = 0; k < i; ++k)
        if (is[k].name == is[i].name) return std::nullopt;
      places.push_back(i);
    } else if (is[i].name != was[i].name) {
      return std::nullopt;
    } else if (!(is[i] == was[i]) || !same_bits(is[i].value, was[i].value)) {
      places.push_back(i);
    }
  }
  // What stands in `places` grows while it is gone through.
  for (std::size_t done = 0; done < places.size(); ++done) {
    if (places.size() > kFewAffected) return std::nullopt;
    const std::string& name = is[places[done]].name;
    for (std::size_t i = 0; i < is.size(); ++i)
      if (has_word(is[i].expression, name) &&
          std::find(places.begin(), places.end(), i) == places.end())
        places.push_back(i);
  }
  Affected out;
  for (const auto& each : now.expressions) {
    const auto known = old->expressions.find(each.first);
    const bool is_new = known == old->expressions.end() || known->second != each.second;
    if (!is_new && std::none_of(places.begin(), places.end(),
                                [&](std::size_t i) { return has_word(each.second, is[i].name); })) {
      const auto a = number_at(body, each.first), b = number_at(before, each.first);
      if (a && b && same_bits(a->value, b->value) && a->unit == b->unit) continue;
    }
    out.expressions.push_back(&each);
  }
  std::sort(places.begin(), places.end());
  out.parameters = std::move(places);
  return out;
}

// ---- following edits ----

/// Whether two elements of a list are the same but for the places of others in their lists, which
/// change when elements are put in or taken out.
bool is_alike(const Type& t, const void* a, const void* b) {
  if (t.shape != Shape::structure) return equal(Content{&t, a}, Content{&t, b});
  return std::all_of(t.fields.begin(), t.fields.end(), [&](const Field& f) {
    return !f.index_in.empty() || equal(Content{f.type, f.in(a)}, Content{f.type, f.in(b)});
  });
}

/// Where the elements of a list are after an edit.
class Elements {
 public:
  Elements(const Type& list, const void* before, const void* after)
      : list_(list),
        before_(before),
        after_(after),
        n_(list.length(before)),
        m_(list.length(after)) {}

  /// The place after the edit of the one that was at `i`; none = it was removed.
  std::optional<std::size_t> place(std::size_t i) {
    const std::string* name = name_of(*list_.element, list_.at(before_, i));
    return name && !name->empty() ? by_name(i, *name) : by_content(i);
  }

 private:
  [[nodiscard]] bool has_name(const void* list, std::size_t i, const std::string& name) const {
    return *name_of(*list_.element, list_.at(list, i)) == name;
  }
  [[nodiscard]] std::optional<std::size_t> find(const void* list, std::size_t count,
                                                const std::string& name) const {
    for (std::size_t k = 0; k < count; ++k)
      if (has_name(list, k, name)) return k;
    return std::nullopt;
  }
  [[nodiscard]] std::optional<std::size_t> by_name(std::size_t i, const std::string& name) const {
    if (i < m_ && has_name(after_, i, name)) return i;
    if (const auto found = find(after_, m_, name)) return found;
    // Another name at the same place is a new name, unless the list had an element of that name.
    const bool is_renamed =
        n_ == m_ && !find(before_, n_, *name_of(*list_.element, list_.at(after_, i)));
    return is_renamed ? std::optional(i) : std::nullopt;
  }
  [[nodiscard]] bool is_alike_at(std::size_t i, std::size_t j) const {
    return is_alike(*list_.element, list_.at(before_, i), list_.at(after_, j));
  }
  std::optional<std::size_t> by_content(std::size_t i) {
    if (n_ == m_) {
      if (is_alike_at(i, i)) return i;
      for (std::size_t j = 0; j < m_; ++j)
        if (is_alike_at(i, j) && !is_alike_at(j, j)) return j;  // moved
      return i;                                                 // edited where it is
    }
    if (!is_aligned_) {
      is_aligned_ = true;
      const std::size_t least = std::min(n_, m_);
      while (same_front_ < least && is_alike_at(same_front_, same_front_)) ++same_front_;
      while (same_back_ < least - same_front_ &&
             is_alike_at(n_ - 1 - same_back_, m_ - 1 - same_back_))
        ++same_back_;
    }
    if (i < same_front_) return i;
    if (i >= n_ - same_back_) return i + m_ - n_;
    for (std::size_t j = same_front_; j < m_ - same_back_; ++j)
      if (is_alike_at(i, j)) return j;
    return std::nullopt;
  }

  const Type& list_;
  const void *before_, *after_;
  std::size_t n_, m_;  ///< lengths
  bool is_aligned_ = false;
  std::size_t same_front_ = 0, same_back_ = 0;  ///< elements that both lists begin and end with
};

/// Finds the paths of numbers after an edit.
class Followed {
 public:
  Followed(const Body& before, const Body& after)
      : before_(content(before)), after_(content(after)) {}

  /// The path of the same number; none = an element on the way to it was removed.
  std::optional<std::string> path(const std::string& old) {
    // Points of profiles have paths of their own: these are followed as far as the profile.
    constexpr std::string_view kProfile = ".profile.";
    std::vector<PathStep> steps = steps_of(before_, old);
    if (const auto dot = old.rfind(kProfile); steps.empty() && dot != std::string::npos)
      steps = steps_of(before_, std::string_view(old).substr(0, dot + kProfile.size() - 1));
    std::string out = old;
    Content was = before_, is = after_;
    std::ptrdiff_t shift = 0;
    for (const PathStep& step : steps) {
      if (!enter(was) || !enter(is)) return std::nullopt;
      if (step.member) {
        was = {step.member->type, step.member->in(was.data)};
        is = {step.member->type, step.member->in(is.data)};
        continue;
      }
      if (step.element >= was.type->length(was.data)) return std::nullopt;
      const auto place = elements(was, is).place(step.element);
      if (!place) return std::nullopt;
      const void* now = is.type->at(is.data, *place);
      const std::string_view spelled =
          std::string_view(old).substr(step.begin, step.end - step.begin);
      const std::string* old_name =
          name_of(*was.type->element, was.type->at(was.data, step.element));
      const std::string* new_name = name_of(*is.type->element, now);
      const std::string word =
          old_name && *old_name == spelled && new_name ? *new_name : std::to_string(*place + 1);
      out.replace(static_cast<std::size_t>(static_cast<std::ptrdiff_t>(step.begin) + shift),
                  spelled.size(), word);
      shift +=
          static_cast<std::ptrdiff_t>(word.size()) - static_cast<std::ptrdiff_t>(spelled.size());
      was = {was.type->element, was.type->at(was.data, step.element)};
      is = {is.type->element, now};
    }
    return out;
  }

 private:
  /// Goes into what is optional or shared; false = there is nothing.
  static bool enter(Content& at) {
    while (at.type->shape == Shape::optional || at.type->shape == Shape::shared) {
      at = {at.type->element, at.type->held(at.data)};
      if (!at.data) return false;
    }
    return true;
  }
  Elements& elements(const Content& was, const Content& is) {
    return lists_.try_emplace(was.data, *was.type, was.data, is.data).first->second;
  }

  Content before_, after_;
  std::unordered_map<const void*, Elements> lists_;  ///< by the list before the edit
};

}  // namespace

Parametric* parametric_of(Body& body) {
  const MutableContent record = content(body);
  const Field* f = record.type->field("parametric");
  return f && f->type == &type_of<Parametric>() ? static_cast<Parametric*>(f->in(record.data))
                                                : nullptr;
}
const Parametric* parametric_of(const Body& body) {
  return parametric_of(const_cast<Body&>(body));  // only its address is taken
}

std::optional<PathNumber> number_at(const Body& body, std::string_view path) {
  const auto at = locate(const_cast<Body&>(body), path, false);  // only read
  return at ? std::optional(PathNumber{*at->number, at->unit}) : std::nullopt;
}

const double* number_in(const Body& body, std::string_view path) {
  const auto at = locate(const_cast<Body&>(body), path, false);  // only its address is taken
  return at ? at->number : nullptr;
}

bool set_number(Body& body, std::string_view path, double value) {
  const auto now = locate(body, path, false);
  if (!now) return false;
  if (!same_bits(*now->number, value)) *locate(body, path, true)->number = value;
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

Result<double> in_unit(const Quantity& q, std::string_view unit, std::string_view text) {
  if (unit == kAnyUnit || q.fits_any) return q.value;
  if (unit == kByJoint) {
    const units::Dimension length{1, 0, 0, 0}, angle{0, 0, 0, 1};
    if (q.dimension == length || q.dimension == angle || q.dimension == units::Dimension{})
      return q.value;
    return error(ErrorCode::invalid_argument,
                 quote(text) + " is " + units::kind_of(q.dimension) + ", not a joint value",
                 "A joint value is an angle or a length; of a quaternion it is a plain number.");
  }
  RMP_TRY_ASSIGN(const units::Unit wanted, units::parse(unit));
  if (same_kind(q.dimension, wanted.dimension)) return q.value;
  return error(ErrorCode::invalid_argument, quote(text) + " is " + units::kind_of(q.dimension) +
                                                ", not " + units::kind_of(wanted.dimension));
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

namespace {

using PathAndText = std::pair<const std::string, std::string>;

/// Writes a number that is an expression.
Result<void> set_by(const PathAndText& each, Body& body, const Resolver& resolver) {
  const auto& [path, text] = each;
  const auto number = number_at(body, path);
  if (!number)
    return error(ErrorCode::unknown_name,
                 quote(path) + " names no number that can be an expression");
  auto e = Expression::compile(text);
  if (!e.ok()) return std::move(e).error().in(path);
  auto value = resolver.value(*e, number->unit);
  if (!value.ok()) return std::move(value).error().in(path);
  if (*value) set_number(body, path, **value);
  return {};
}

/// False where it does not go so: what is wrong then is found by a look at all.
bool resolve_affected(Body& body, Parametric& p, const Body& before, Resolver& resolver) {
  auto some = affected(body, p, before);
  if (!some || !resolver.run(std::move(some->parameters)).ok()) return false;
  return std::all_of(some->expressions.begin(), some->expressions.end(),
                     [&](const PathAndText* each) { return set_by(*each, body, resolver).ok(); });
}

}  // namespace

Result<void> resolve(Body& body, std::string_view own_name, const WorldParameters& worlds,
                     const Body* before) {
  Parametric* p = parametric_of(body);
  if (!p || (p->parameters.empty() && p->expressions.empty())) return {};
  const bool is_world = std::holds_alternative<World>(body);
  if (before) {
    Resolver resolver(*p, own_name, is_world, worlds);
    if (resolve_affected(body, *p, *before, resolver)) return {};
  }
  Resolver resolver(*p, own_name, is_world, worlds);
  RMP_TRY(resolver.run());
  for (const auto& each : p->expressions) RMP_TRY(set_by(each, body, resolver));
  return {};
}

bool mentions_worlds(const Body& body) {
  const Parametric* p = parametric_of(body);
  if (!p || kind_of_body(body) == Kind::world) return false;
  const auto is_one = [](const std::string& text) {
    if (!may_mention_worlds(text)) return false;
    const auto e = Expression::compile(text);
    return e.ok() && std::any_of(e->names().begin(), e->names().end(),
                                 [](const auto& n) { return !n.scope.empty(); });
  };
  return std::any_of(p->parameters.begin(), p->parameters.end(),
                     [&](const Parameter& v) { return is_one(v.expression); }) ||
         std::any_of(p->expressions.begin(), p->expressions.end(),
                     [&](const auto& each) { return is_one(each.second); });
}

std::vector<Expression::Name> world_mentions(const Body& body) {
  std::vector<Expression::Name> out;
  const Parametric* p = parametric_of(body);
  if (!p || kind_of_body(body) == Kind::world) return out;
  for (const Compiled& c : compiled(*p, true))
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
  for (std::size_t i = 0; i < p->parameters.size(); ++i)
    if (!std::as_const(p->parameters)[i].expression.empty()) rewrite(p->parameters[i].expression);
  for (auto& [path, text] : p->expressions) rewrite(text);
}

void follow_edit(const Body& before, Body& after) {
  const Parametric* old = parametric_of(before);
  Parametric* now = parametric_of(after);
  if (!old || !now || old->expressions.empty()) return;
  Followed followed(before, after);
  std::vector<std::pair<std::string, std::string>> moved;  // path and text
  for (const auto& [path, text] : old->expressions) {
    const auto it = now->expressions.find(path);
    if (it == now->expressions.end() || it->second != text) continue;  // the edit's own affair
    const auto target = followed.path(path);
    const auto number = number_at(before, path);
    const auto found = target ? number_at(after, *target) : std::nullopt;
    const bool is_kept = found && number && same_bits(found->value, number->value);
    if (is_kept && *target == path) continue;
    now->expressions.erase(it);
    if (is_kept) moved.emplace_back(*target, text);
  }
  // Behind all others: elements may have changed places.
  for (auto& [path, text] : moved) now->expressions.emplace(std::move(path), std::move(text));
}

}  // namespace robomosp::model
