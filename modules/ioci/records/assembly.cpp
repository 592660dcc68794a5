// SPDX-License-Identifier: Apache-2.0
// Features of solids and parts, and parts placed on each other by them.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "ioci/core/commands.h"
#include "ioci/records/features.h"
#include "kernel/fresh_names.h"
#include "kernel/units.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

using model::Object;
using model::ObjectPart;
using Kind_ = CsgFeature::Kind;
using Features = std::vector<CsgFeature>;

constexpr std::size_t kMostFeatures = 1'000'000;

struct KindWord {
  std::string_view word;
  CsgFeature::Kind kind;
};
constexpr KindWord kKindWords[] = {
    {"plane", Kind_::plane},   {"cylinder", Kind_::cylinder}, {"cone", Kind_::cone},
    {"sphere", Kind_::sphere}, {"torus", Kind_::torus},       {"line", Kind_::line},
    {"circle", Kind_::circle}, {"corner", Kind_::corner},     {"other", Kind_::other}};

std::string_view kind_word_of(CsgFeature::Kind kind) {
  for (const KindWord& k : kKindWords)
    if (k.kind == kind) return k.word;
  return "other";
}

/// Features of a solid, or of all solids of an object, in its frame.
Result<Features> features_of(CommandContext& ctx, AnyId what) {
  struct Step {
    AnyId what;
    Pose placement;
  };
  Features out;
  std::vector<Step> stack{{what, {}}};
  while (!stack.empty()) {
    const Step step = stack.back();
    stack.pop_back();
    if (step.what.kind == Kind::object) {
      const Object& o = std::get<Object>(ctx.snapshot().find(step.what)->body);
      for (auto p = o.parts.rbegin(); p != o.parts.rend(); ++p)
        stack.push_back({p->what, spatial::compose(step.placement, model::pose(p->placement))});
      continue;
    }
    RMP_TRY_ASSIGN(const auto found, ctx.app.derived.features(
                                         ctx.snapshot(), SolidId{step.what.number}, ctx.progress));
    if (out.size() + found->size() > kMostFeatures)
      return error(ErrorCode::unsupported, "it has too many faces and edges to choose from", {},
                   name_in(ctx, what));
    for (CsgFeature f : *found) {
      f.point = spatial::transform(step.placement, f.point);
      f.direction = spatial::rotate(step.placement, f.direction);
      out.push_back(f);
    }
  }
  return out;
}

// --- selectors -----------------------------------------------------------------------------

struct Side {
  std::string_view word;
  Vec3 direction;
};
constexpr Side kSides[] = {{"top", {0, 0, 1}},   {"bottom", {0, 0, -1}}, {"right", {1, 0, 0}},
                           {"left", {-1, 0, 0}}, {"back", {0, 1, 0}},    {"front", {0, -1, 0}}};

/// What the frame itself offers: `origin`, `x axis`, `xy plane`.
std::optional<CsgFeature> datum(std::string_view words) {
  CsgFeature f;
  const auto with = [&](CsgFeature::Kind kind, Vec3 direction) {
    f.kind = kind;
    f.direction = direction;
    return f;
  };
  if (words == "origin") return with(Kind_::corner, {});
  if (words == "x axis") return with(Kind_::line, {1, 0, 0});
  if (words == "y axis") return with(Kind_::line, {0, 1, 0});
  if (words == "z axis") return with(Kind_::line, {0, 0, 1});
  if (words == "xy plane") return with(Kind_::plane, {0, 0, 1});
  if (words == "yz plane") return with(Kind_::plane, {1, 0, 0});
  if (words == "xz plane") return with(Kind_::plane, {0, 1, 0});
  return std::nullopt;
}

bool is_face_mate(const CsgFeature& f) { return f.kind == Kind_::plane; }
bool is_axis_mate(const CsgFeature& f) {
  return f.kind == Kind_::cylinder || f.kind == Kind_::cone || f.kind == Kind_::torus ||
         f.kind == Kind_::circle || f.kind == Kind_::line;
}
bool is_point_mate(const CsgFeature& f) { return f.kind != Kind_::other; }

/// Conditions of a selector such as `largest hole radius 5 mm near (0.1, 0, 0)`.
struct Selector {
  std::optional<CsgFeature::Kind> kind;
  bool hole = false, shaft = false, largest = false, smallest = false;
  std::optional<double> radius;
  std::optional<Vec3> side, near;
};

constexpr std::string_view kSelectorHint =
    "A selector is an index of the list of features, or words: top, bottom, left, right, front, "
    "back, largest, smallest, plane, cylinder, hole, shaft, cone, sphere, torus, circle, line, "
    "corner, radius 5 mm, near (x, y, z); or origin, x axis, xy plane and their like.";

Result<Selector> read_selector(std::string_view given, std::string_view path) {
  Selector s;
  std::string_view rest = text::trim(given);
  const auto fault = [&](std::string message) {
    return error(ErrorCode::invalid_argument, std::move(message), std::string(kSelectorHint),
                 std::string(path));
  };
  const auto take_word = [&] {
    rest = text::trim(rest);
    const auto end = rest.find_first_of(" \t(");
    const std::string_view word = rest.substr(0, end);
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end);
    return word;
  };
  if (rest.empty()) return fault("the selector is empty");
  while (!(rest = text::trim(rest)).empty()) {
    const std::string word(take_word());
    if (word == "largest") s.largest = true;
    else if (word == "smallest") s.smallest = true;
    else if (word == "hole") s.hole = true;
    else if (word == "shaft") s.shaft = true;
    else if (word == "radius") {
      // The quantity ends where the next word of a selector begins.
      const auto next = rest.find(" near");
      const std::string quantity(text::trim(rest.substr(0, next)));
      rest = next == std::string_view::npos ? std::string_view() : rest.substr(next);
      const auto checked = check_value(field("", "real", "m", ""), Value(quantity), path);
      const auto plain = text::read_real(quantity);
      if (!plain && !checked.ok()) return fault(text::quote(quantity) + " is not a radius");
      s.radius = plain ? *plain : checked->number();
    } else if (word == "near") {
      rest = text::trim(rest);
      const auto close = rest.find(')');
      if (!rest.starts_with('(') || close == std::string_view::npos)
        return fault("near needs a point in parentheses");
      Vec3 p{};
      std::size_t n = 0;
      for (const std::string_view each : text::split(rest.substr(1, close - 1), ',')) {
        const std::string one(text::trim(each));
        const auto plain = text::read_real(one);
        const auto checked = check_value(field("", "real", "m", ""), Value(one), path);
        if (n == 3 || (!plain && !checked.ok())) return fault("near needs three coordinates");
        p[n++] = plain ? *plain : checked->number();
      }
      if (n != 3) return fault("near needs three coordinates");
      s.near = p;
      rest.remove_prefix(close + 1);
    } else {
      bool known = false;
      for (const Side& side : kSides)
        if (side.word == word) {
          s.side = side.direction;
          known = true;
        }
      for (const KindWord& k : kKindWords)
        if (k.word == word) {
          s.kind = k.kind;
          known = true;
        }
      if (word == "face") known = true;  // "top face" reads well
      if (!known) return fault(text::quote(word) + " does not fit a selector");
    }
  }
  return s;
}

/// The one feature that a selector means; `wanted` are those that the mate can use.
template <class Wanted>
Result<CsgFeature> choose(const Features& all, const Value& given, Wanted&& wanted,
                          std::string_view wanted_words, const std::string& whose,
                          std::string_view path) {
  if (given.as_int() || given.as_real()) {
    const double index = given.number();
    if (!(index >= 1) || index > static_cast<double>(all.size()) || index != std::floor(index))
      return error(ErrorCode::unknown_name,
                   whose + " has " + std::to_string(all.size()) + " features, so there is no " +
                       text::print(index),
                   "Features are numbered from 1.", std::string(path));
    const CsgFeature& f = all[static_cast<std::size_t>(index) - 1];
    if (wanted(f)) return f;
    return error(ErrorCode::invalid_argument,
                 "feature " + text::print(index) + " of " + whose + " is a " +
                     std::string(kind_word_of(f.kind)) + ", but this mate needs " +
                     std::string(wanted_words),
                 {}, std::string(path));
  }
  if (!given.as_string())
    return error(ErrorCode::invalid_argument, given.text() + " is not a selector",
                 std::string(kSelectorHint), std::string(path));
  const std::string words(text::trim(*given.as_string()));
  if (const auto fixed = datum(words)) {
    if (wanted(*fixed)) return *fixed;
    return error(
        ErrorCode::invalid_argument,
        text::quote(words) + " is not suitable; this mate needs " + std::string(wanted_words), {},
        std::string(path));
  }
  RMP_TRY_ASSIGN(const Selector s, read_selector(words, path));
  std::vector<const CsgFeature*> left;
  for (const CsgFeature& f : all) {
    if (!wanted(f)) continue;
    const bool round = f.kind == Kind_::cylinder || f.kind == Kind_::cone;
    if (s.kind && f.kind != *s.kind) continue;
    if ((s.hole && !(round && f.inward)) || (s.shaft && !(round && !f.inward))) continue;
    if (s.radius && std::fabs(f.radius - *s.radius) > 1e-9 + 1e-6 * std::fabs(*s.radius)) continue;
    left.push_back(&f);
  }
  if (s.side) {
    // Faces that look that way; other features by where they are.
    const Vec3 d = *s.side;
    constexpr double kLooksThere = 1 - 1e-9;
    std::erase_if(left, [&](const CsgFeature* f) {
      return f->kind == Kind_::plane && spatial::dot(f->direction, d) < kLooksThere;
    });
    double furthest = -std::numeric_limits<double>::infinity();
    for (const auto* f : left) furthest = std::max(furthest, spatial::dot(f->point, d));
    std::erase_if(left,
                  [&](const CsgFeature* f) { return spatial::dot(f->point, d) < furthest - 1e-9; });
  }
  const auto keep_best = [&](auto&& measure) {
    double best = -std::numeric_limits<double>::infinity();
    for (const auto* f : left) best = std::max(best, measure(*f));
    std::erase_if(left,
                  [&](const CsgFeature* f) { return measure(*f) < best - 1e-9 * std::fabs(best); });
  };
  // A cylinder is large by its radius, a plane by its area, an edge by its length.
  const auto extent = [](const CsgFeature& f) { return f.radius > 0 ? f.radius : f.size; };
  if (s.near)
    keep_best([&](const CsgFeature& f) { return -spatial::norm(spatial::sub(f.point, *s.near)); });
  if (s.largest) keep_best(extent);
  if (s.smallest) keep_best([&](const CsgFeature& f) { return -extent(f); });
  // Several faces or edges of one plane, axis or point mean the same.
  const auto same = [&](const CsgFeature& a, const CsgFeature& b) {
    const Vec3 between = spatial::sub(a.point, b.point);
    if (is_axis_mate(a) && is_axis_mate(b) && a.kind == b.kind && a.kind != Kind_::circle)
      return spatial::norm(spatial::cross(a.direction, b.direction)) < 1e-9 &&
             spatial::norm(spatial::cross(between, a.direction)) < 1e-9 && a.radius == b.radius &&
             spatial::norm(between) < 1e-9;
    return a.kind == b.kind && spatial::norm(between) < 1e-9;
  };
  if (left.empty())
    return error(ErrorCode::unknown_name,
                 text::quote(words) + " fits no feature of " + whose + " that is " +
                     std::string(wanted_words),
                 std::string(kSelectorHint), std::string(path));
  for (const auto* f : left)
    if (!same(*f, *left.front()))
      return error(
          ErrorCode::conflict,
          text::quote(words) + " fits " + std::to_string(left.size()) + " features of " + whose,
          "Add largest, radius or near (x, y, z), or give an index of the list of "
          "features.",
          std::string(path));
  return *left.front();
}

// --- commands ------------------------------------------------------------------------------

Value feature_list(const Features& all) {
  List out;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const CsgFeature& f = all[i];
    Map m{{"index", static_cast<std::int64_t>(i + 1)},
          {"kind", kind_word_of(f.kind)},
          {"point", vec_value(f.point, "m")}};
    if (f.direction != Vec3{}) m.set("direction", vec_value(f.direction));
    if (f.radius > 0) m.set("radius", f.radius);
    if (f.size > 0) m.set("size", f.size);
    if (f.kind == Kind_::cylinder || f.kind == Kind_::cone || f.kind == Kind_::sphere)
      m.set("inward", f.inward);
    out.emplace_back(std::move(m));
  }
  return out;
}

Result<Value> assembly_features(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  if (!has(args, "part")) {
    RMP_TRY_ASSIGN(const Features all, features_of(ctx, id));
    return feature_list(all);
  }
  const Object& o = content<Object>(ctx, args);
  auto at = find_part(o, text_of(args, "part"));
  if (!at.ok()) return std::move(at).in(name_in(ctx, id)).error();
  RMP_TRY_ASSIGN(const Features all, features_of(ctx, o.parts[*at].what));
  return feature_list(all);
}

/// The least turn that takes unit vector `from` to `to`.
spatial::Matrix3 least_turn(const Vec3& from, const Vec3& to) {
  const Vec3 c = spatial::cross(from, to);
  const double s = spatial::norm(c), d = spatial::dot(from, to);
  if (s > 1e-12) return spatial::from_axis_angle(c, std::atan2(s, d));
  if (d > 0) return Pose{}.R;
  // Opposite: half a turn about the frame's axis that is most across, the same every time.
  Vec3 across{1, 0, 0};
  if (std::fabs(from[0]) > 0.9) across = {0, 0, 1};
  return spatial::from_axis_angle(
      spatial::sub(across, spatial::scale(from, spatial::dot(across, from))), std::numbers::pi);
}

Pose turned(const spatial::Matrix3& r, const Pose& t) {
  Pose out = spatial::compose(Pose{r, {}}, t);
  for (double& x : out.R)
    if (std::fabs(x) < 1e-15) x = 0;
  out.p = t.p;
  return out;
}

CsgFeature in_object(CsgFeature f, const Pose& t) {
  f.point = spatial::transform(t, f.point);
  f.direction = spatial::rotate(t, f.direction);
  return f;
}

struct Mate {
  std::string kind;
  bool flip = false, centre = true;
  double offset = 0, angle = 0;
};

/// Where a part goes: `own` is its feature in its frame, `on` the other in the object's.
Pose mated(const Pose& before, const CsgFeature& own, const CsgFeature& on, const Mate& mate) {
  Pose after = before;
  const Vec3 along = on.direction;
  if (mate.kind != "point") {
    const Vec3 now = spatial::rotate(before, own.direction);
    Vec3 wanted = along;
    if (mate.kind == "face") wanted = spatial::scale(along, mate.flip ? 1 : -1);
    else if ((spatial::dot(now, along) < 0) != mate.flip) wanted = spatial::scale(along, -1);
    after = turned(least_turn(now, wanted), before);
    if (mate.angle != 0) after = turned(spatial::from_axis_angle(along, mate.angle), after);
  }
  Vec3 target = on.point;
  if (mate.kind == "face" && !mate.centre) {  // stays where it is across the plane
    const Vec3 here = spatial::transform(before, own.point);
    const double height = spatial::dot(spatial::sub(here, on.point), along);
    target = spatial::sub(here, spatial::scale(along, height));
  }
  if (mate.kind != "point") target = spatial::add(target, spatial::scale(along, mate.offset));
  after.p = spatial::sub(target, spatial::rotate(after, own.point));
  return after;
}

/// Gives a part a placement as `object.set` does: expressions of the old one go.
Result<void> put(CommandContext& ctx, AnyId id, std::size_t at, const Pose& pose) {
  const Object& o = std::get<Object>(ctx.snapshot().find(id)->body);
  const ObjectPart& part = o.parts[at];
  const model::Placement placement = model::placement(pose, part.placement.notation);
  RMP_TRY(ctx.expressions.read_at(ctx.snapshot().find(id)->body, part.name + ".placement",
                                  placement_value(placement)));
  return change<Object>(ctx, id, [&](Object& edited) -> Result<void> {
    ctx.expressions.keep(edited.parametric);
    edited.parts[at].placement = placement;
    return {};
  });
}

Result<Value> place(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  const Object& o = content<Object>(ctx, args);
  const auto where = [&](auto r) { return std::move(r).in(name_in(ctx, id)).error(); };
  auto at = find_part(o, text_of(args, "part"));
  if (!at.ok()) return where(std::move(at));
  const ObjectPart& part = o.parts[*at];
  Mate mate{text_of(args, "mate"), flag(args, "flip"), flag(args, "centre"), real(args, "offset"),
            real(args, "angle")};
  const bool face = mate.kind == "face", axis = mate.kind == "axis";
  if (!face && !axis && (mate.offset != 0 || mate.angle != 0 || mate.flip))
    return error(ErrorCode::invalid_argument, "point to point has no offset, angle or flip",
                 "Leave them out, or mate faces or axes.", name_in(ctx, id));
  const auto wanted = [&](const CsgFeature& f) {
    return face ? is_face_mate(f) : axis ? is_axis_mate(f) : is_point_mate(f);
  };
  const std::string_view words = face   ? "a plane"
                                 : axis ? "a cylinder, cone, torus, circle or line"
                                        : "a point or has one";
  const auto feature = [&](AnyId what, const std::string& whose,
                           const char* name) -> Result<CsgFeature> {
    const Value& given = *args.find(name);
    if (given.as_string())
      if (const auto fixed = datum(text::trim(*given.as_string()))) {
        return choose({}, given, wanted, words, whose, name);
      }
    RMP_TRY_ASSIGN(const Features all, features_of(ctx, what));
    return choose(all, given, wanted, words, whose, name);
  };
  auto own = feature(part.what, "part " + text::quote(part.name), "feature");
  if (!own.ok()) return where(std::move(own));
  CsgFeature on;
  if (has(args, "on")) {
    auto other = find_part(o, text_of(args, "on"));
    if (!other.ok()) return where(std::move(other));
    if (*other == *at)
      return error(ErrorCode::invalid_argument,
                   "part " + text::quote(part.name) + " cannot be placed on itself",
                   "Name another part, or leave on out for the object's own frame.",
                   name_in(ctx, id));
    const ObjectPart& onto = o.parts[*other];
    auto chosen = feature(onto.what, "part " + text::quote(onto.name), "on_feature");
    if (!chosen.ok()) return where(std::move(chosen));
    on = in_object(*chosen, model::pose(onto.placement));
  } else {
    auto chosen =
        choose({}, *args.find("on_feature"), wanted, words, "the object's frame", "on_feature");
    if (!chosen.ok()) return where(std::move(chosen));
    on = *chosen;
  }
  const Pose after = mated(model::pose(part.placement), *own, on, mate);
  RMP_TRY(put(ctx, id, *at, after));
  return Value(pose_map(after));
}

Result<Value> move_part(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  auto done = change<Object>(ctx, id, [&](Object& o) -> Result<void> {
    RMP_TRY_ASSIGN(const std::size_t from, find_part(o, text_of(args, "part")));
    const std::int64_t to = integer(args, "to");
    if (to < 1 || to > static_cast<std::int64_t>(o.parts.size()))
      return error(ErrorCode::invalid_argument,
                   "there is no place " + std::to_string(to) + " among " +
                       std::to_string(o.parts.size()) + " parts",
                   "Places are numbered from 1.");
    const auto first = o.parts.begin();
    const auto target = static_cast<std::size_t>(to - 1);
    const auto f = static_cast<std::ptrdiff_t>(from), t = static_cast<std::ptrdiff_t>(target);
    if (from < target) std::rotate(first + f, first + f + 1, first + t + 1);
    else std::rotate(first + t, first + f, first + f + 1);
    return {};
  });
  if (!done.ok()) return std::move(done).in(name_in(ctx, id)).error();
  return Value();
}

Result<Value> duplicate_part(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  const Vec3 step = vec3(args, "step");
  const double turn = real(args, "turn");
  const auto count = static_cast<std::size_t>(integer(args, "count"));
  List made;
  auto done = change<Object>(ctx, id, [&](Object& o) -> Result<void> {
    RMP_TRY_ASSIGN(const std::size_t from, find_part(o, text_of(args, "part")));
    const ObjectPart original = o.parts[from];
    FreshNames taken;
    for (const ObjectPart& p : o.parts) taken.take(p.name);
    std::vector<ObjectPart> copies;
    for (std::size_t i = 1; i <= count; ++i) {
      ObjectPart copy = original;
      copy.name = taken.fresh(original.name);
      const auto k = static_cast<double>(i);
      if (turn != 0 || step != Vec3{}) {
        Pose t = spatial::compose(spatial::rotation_z(k * turn), model::pose(original.placement));
        t.p = spatial::add(t.p, spatial::scale(step, k));
        if (turn != 0) copy.placement = model::placement(t, original.placement.notation);
        copy.placement.position = t.p;
        copy.placement.coordinates = model::PositionRepresentation::cartesian;
      }
      made.emplace_back(copy.name);
      copies.push_back(std::move(copy));
    }
    o.parts.insert(o.parts.begin() + static_cast<std::ptrdiff_t>(from) + 1, copies.begin(),
                   copies.end());
    return {};
  });
  if (!done.ok()) return std::move(done).in(name_in(ctx, id)).error();
  return Value(std::move(made));
}

const char* const kStack =
    "material.create{name = \"steel\", density = 7850}\n"
    "solid.create{name = \"plate\", material = \"steel\", root = {kind = \"difference\", children "
    "= {{kind = \"box\", x = 0.1, y = 0.1, z = 0.02}, {kind = \"cylinder\", radius = 0.01, height "
    "= 0.1, position = {0.03, 0, -0.01}}}}}\n"
    "solid.create{name = \"pin\", material = \"steel\", root = {kind = \"cylinder\", radius = "
    "0.01, height = 0.05}}\n"
    "local stack = object.create{name = \"stack\", parts = {{what = \"plate\"}, {what = "
    "\"pin\"}}}\n";
std::string with_stack(const char* rest) { return std::string(kStack) + rest; }

ReturnSpec features_returns() {
  return {"list",
          "",
          "Faces, edges, corners.",
          {field("index", "int", "", "Number for selectors."),
           field("kind", "string", "",
                 "plane, cylinder, cone, sphere, torus, line, circle, corner or other."),
           field("point", "vec3", "m", "Centroid, centre, or the middle on the axis."),
           field("direction", "vec3", "", "Outward normal, axis, or direction of an edge."),
           field("radius", "real", "m", "Radius of a round feature."),
           field("size", "real", "", "Area of a face [m^2], length of an edge [m]."),
           field("inward", "bool", "", "True for the wall of a hole.")}};
}

}  // namespace

Result<CsgFeature> feature_of(CommandContext& ctx, AnyId what, const Value& selector,
                              const std::string& whose, std::string_view path) {
  const auto is_place = [](const CsgFeature& f) { return is_point_mate(f); };
  constexpr std::string_view kPlaceWords = "a point or has one";
  if (selector.as_string() && datum(text::trim(*selector.as_string())))
    return choose({}, selector, is_place, kPlaceWords, whose, path);
  RMP_TRY_ASSIGN(const Features all, features_of(ctx, what));
  return choose(all, selector, is_place, kPlaceWords, whose, path);
}

std::array<double, 9> feature_rotation(const CsgFeature& f) {
  if (f.direction == Vec3{}) return Pose{}.R;
  return turned(least_turn({0, 0, 1}, f.direction), Pose{}).R;
}

RMP_COMMANDS(assembly_commands) {
  std::vector<CommandSpec> all;
  all.push_back({.name = "object.features",
                 .classic = "",
                 .summary = "Lists faces, edges and corners of an object or of one of its parts.",
                 .details = "In the frame of the object, or of the part if one is named. The order "
                            "stays the same as long as the solids do not change.",
                 .example = with_stack("assert(#stack:features{part = \"pin\"} >= 3)"),
                 .params = {self("object"), optional("part", "string", "", "One of its parts.")},
                 .returns = features_returns(),
                 .effect = Effect::reads,
                 .run = assembly_features});
  all.push_back(
      {.name = "object.place",
       .classic = "",
       .summary = "Places a part on another, by a face, an axis or a point of each.",
       .details =
           "face: the part's face is placed flush against the other, centre on centre (with centre "
           "= false it only moves across the plane); flip makes both normals point in the same "
           "direction, "
           "offset is the gap. axis: the axis of the part's cylinder, hole, circle or straight "
           "edge is aligned with the other axis, point on point, offset along it; flip reverses "
           "it. point: the part moves so that both points coincide. The part is rotated as little "
           "as possible, then by angle about the other's normal or axis. The placement is computed "
           "once and stored; later changes of either part do not move it.\n\nA selector is an "
           "index of object.features{part = ...}, or a description: top, bottom, left, right, "
           "front, back (faces by the part's own axes), largest, smallest, plane, cylinder, hole, "
           "shaft, cone, sphere, torus, circle, line, corner, radius 5 mm, near (x, y, z), such as "
           "\"largest plane\" or \"hole radius 10 mm\"; or an element of the frame such as origin, "
           "x axis, xy plane. It must match exactly one feature.",
       .example = with_stack(
           "stack:place{part = \"pin\", feature = \"bottom\", on = \"plate\", on_feature = "
           "\"top\"}\nassert(math.abs(stack:describe().parts[2].placement.position[3] - 0.02) < "
           "1e-12)\nstack:place{part = \"pin\", mate = \"axis\", feature = \"shaft\", on = "
           "\"plate\", on_feature = \"hole radius 10 "
           "mm\"}\nassert(math.abs(stack:describe().parts[2].placement.position[1] - 0.03) < "
           "1e-12)"),
       .params = {self("object"), needed("part", "string", "", "The part that moves."),
                  needed("feature", "any", "", "Selector of the feature on it."),
                  optional("on", "string", "",
                           "The part that stays; by default the object's frame."),
                  needed("on_feature", "any", "", "Selector of the feature on that part."),
                  choice("mate", {"face", "axis", "point"}, "The features to align."),
                  defaulted("flip", "bool", "", false, "Reverse the direction."),
                  defaulted("offset", "real", "m", 0.0,
                            "Distance along the other's normal or axis."),
                  defaulted("angle", "real", "rad", 0.0, "Rotation about it."),
                  defaulted("centre", "bool", "", true, "For faces: centre on centre.")},
       .returns = {"map",
                   "",
                   "Pose of the part in the object.",
                   {field("pose", "pose", "", "4x4 matrix."),
                    field("position", "vec3", "m", "Its origin."),
                    field("rpy", "vec3", "rad", "Roll, pitch, yaw."),
                    field("quaternion", "array", "", "w, x, y, z.")}},
       .effect = Effect::edits,
       .run = place});
  all.push_back(
      {.name = "object.move_part",
       .classic = "",
       .summary = "Moves a part to another place in the list.",
       .details = "Volume shared by several parts belongs to the part listed first.",
       .example = with_stack(
           "stack:move_part{part = \"pin\", to = 1}\nassert(stack:describe().parts[1].name == "
           "\"pin\")"),
       .params = {self("object"), needed("part", "string", "", "Its name."),
                  needed("to", "int", "", "Its new place; 1 is the first.")},
       .returns = {},
       .effect = Effect::edits,
       .run = move_part});
  all.push_back(
      {.name = "object.duplicate_part",
       .classic = "",
       .summary = "Adds copies of a part that share its solid or object.",
       .details = "Each copy is moved by step from the one before, and rotated by turn about the "
                  "object's z axis: rows and rings.",
       .example = with_stack(
           "local names = stack:duplicate_part{part = \"pin\", count = 3, step = {0.02, 0, "
           "0}}\nassert(#names == 3 and "
           "math.abs(stack:describe().parts[5].placement.position[1] - 0.06) < 1e-12)"),
       .params = {self("object"), needed("part", "string", "", "Its name."),
                  between(defaulted("count", "int", "", std::int64_t{1}, "Number of copies."), 1,
                          10000),
                  optional("step", "vec3", "m", "Translation from one copy to the next."),
                  defaulted("turn", "real", "rad", 0.0, "Translation from one copy to the next.")},
       .returns = {"list", "", "Names of the copies.", {}},
       .effect = Effect::edits,
       .run = duplicate_part});
  return all;
}

}  // namespace robomosp::ioci
