// SPDX-License-Identifier: Apache-2.0
#include "evaluation/features.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "evaluation/derived.h"
#include "kernel/schema.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::evaluation {
namespace {

using Kind_ = CsgFeature::Kind;

constexpr std::size_t kMostFeatures = 1'000'000;

struct KindWord {
  std::string_view word;
  CsgFeature::Kind kind;
};
constexpr KindWord kKindWords[] = {
    {"plane", Kind_::plane},   {"cylinder", Kind_::cylinder}, {"cone", Kind_::cone},
    {"sphere", Kind_::sphere}, {"torus", Kind_::torus},       {"line", Kind_::line},
    {"circle", Kind_::circle}, {"corner", Kind_::corner},     {"other", Kind_::other}};

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

bool is_axis(const CsgFeature& f) {
  return f.kind == Kind_::cylinder || f.kind == Kind_::cone || f.kind == Kind_::torus ||
         f.kind == Kind_::circle || f.kind == Kind_::line;
}
bool fits(const CsgFeature& f, FeatureUse use) {
  switch (use) {
    case FeatureUse::face: return f.kind == Kind_::plane;
    case FeatureUse::axis: return is_axis(f);
    default: return f.kind != Kind_::other;
  }
}
std::string words_of(FeatureUse use) {
  switch (use) {
    case FeatureUse::face: return "a plane";
    case FeatureUse::axis: return "a cylinder, cone, torus, circle or line";
    default: return "a point or has one";
  }
}

/// Conditions of a selector such as `largest hole radius 5 mm near (0.1, 0, 0)`.
struct Selector {
  std::optional<CsgFeature::Kind> kind;
  bool hole = false, shaft = false, largest = false, smallest = false;
  std::optional<double> radius;
  std::optional<Vec3> side, near;
};

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
  ParamSpec length;
  length.type = "real";
  length.unit = "m";
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
      const auto checked = check_value(length, Value(quantity), path);
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
        const auto checked = check_value(length, Value(one), path);
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

}  // namespace

std::string_view kind_word(CsgFeature::Kind kind) {
  for (const KindWord& k : kKindWords)
    if (k.kind == kind) return k.word;
  return "other";
}

Result<Features> features_of(Derived& derived, const document::Snapshot& snapshot, AnyId what,
                             Progress& progress) {
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
      const model::Object& o = std::get<model::Object>(snapshot.find(step.what)->body);
      for (auto p = o.parts.rbegin(); p != o.parts.rend(); ++p)
        stack.push_back({p->what, spatial::compose(step.placement, model::pose(p->placement))});
      continue;
    }
    RMP_TRY_ASSIGN(const auto found,
                   derived.features(snapshot, SolidId{step.what.number}, progress));
    if (out.size() + found->size() > kMostFeatures)
      return error(ErrorCode::unsupported, "it has too many faces and edges to choose from", {},
                   snapshot.describe(what));
    for (CsgFeature f : *found) {
      f.point = spatial::transform(step.placement, f.point);
      f.direction = spatial::rotate(step.placement, f.direction);
      out.push_back(f);
    }
  }
  return out;
}

Result<CsgFeature> choose_feature(const Features& all, const FeatureSelector& given, FeatureUse use,
                                  const std::string& whose, std::string_view path) {
  if (const double* number = std::get_if<double>(&given)) {
    const double index = *number;
    if (!(index >= 1) || index > static_cast<double>(all.size()) || index != std::floor(index))
      return error(ErrorCode::unknown_name,
                   whose + " has " + std::to_string(all.size()) + " features, so there is no " +
                       text::print(index),
                   "Features are numbered from 1.", std::string(path));
    const CsgFeature& f = all[static_cast<std::size_t>(index) - 1];
    if (fits(f, use)) return f;
    return error(ErrorCode::invalid_argument,
                 "feature " + text::print(index) + " of " + whose + " is a " +
                     std::string(kind_word(f.kind)) + ", but this mate needs " + words_of(use),
                 {}, std::string(path));
  }
  const std::string words(text::trim(std::get<std::string>(given)));
  if (const auto fixed = datum(words)) {
    if (fits(*fixed, use)) return *fixed;
    return error(ErrorCode::invalid_argument,
                 text::quote(words) + " is not suitable; this mate needs " + words_of(use), {},
                 std::string(path));
  }
  RMP_TRY_ASSIGN(const Selector s, read_selector(words, path));
  std::vector<const CsgFeature*> left;
  for (const CsgFeature& f : all) {
    if (!fits(f, use)) continue;
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
    if (is_axis(a) && is_axis(b) && a.kind == b.kind && a.kind != Kind_::circle)
      return spatial::norm(spatial::cross(a.direction, b.direction)) < 1e-9 &&
             spatial::norm(spatial::cross(between, a.direction)) < 1e-9 && a.radius == b.radius &&
             spatial::norm(between) < 1e-9;
    return a.kind == b.kind && spatial::norm(between) < 1e-9;
  };
  if (left.empty())
    return error(ErrorCode::unknown_name,
                 text::quote(words) + " fits no feature of " + whose + " that is " + words_of(use),
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

Result<CsgFeature> feature_of(Derived& derived, const document::Snapshot& snapshot, AnyId what,
                              const FeatureSelector& selector, FeatureUse use,
                              const std::string& whose, std::string_view path, Progress& progress) {
  const std::string* words = std::get_if<std::string>(&selector);
  if (words && datum(text::trim(*words))) return choose_feature({}, selector, use, whose, path);
  RMP_TRY_ASSIGN(const Features all, features_of(derived, snapshot, what, progress));
  return choose_feature(all, selector, use, whose, path);
}

std::array<double, 9> feature_rotation(const CsgFeature& f) {
  if (f.direction == Vec3{}) return Pose{}.R;
  return turned(least_turn({0, 0, 1}, f.direction), Pose{}).R;
}

Pose mated(const Pose& before, const CsgFeature& own, const CsgFeature& on, const Mate& mate) {
  Pose after = before;
  const Vec3 along = on.direction;
  if (mate.use != FeatureUse::point) {
    const Vec3 now = spatial::rotate(before, own.direction);
    Vec3 wanted = along;
    if (mate.use == FeatureUse::face) wanted = spatial::scale(along, mate.flip ? 1 : -1);
    else if ((spatial::dot(now, along) < 0) != mate.flip) wanted = spatial::scale(along, -1);
    after = turned(least_turn(now, wanted), before);
    if (mate.angle != 0) after = turned(spatial::from_axis_angle(along, mate.angle), after);
  }
  Vec3 target = on.point;
  if (mate.use == FeatureUse::face && !mate.centre) {  // stays where it is across the plane
    const Vec3 here = spatial::transform(before, own.point);
    const double height = spatial::dot(spatial::sub(here, on.point), along);
    target = spatial::sub(here, spatial::scale(along, height));
  }
  if (mate.use != FeatureUse::point)
    target = spatial::add(target, spatial::scale(along, mate.offset));
  after.p = spatial::sub(target, spatial::rotate(after, own.point));
  return after;
}

}  // namespace robomosp::evaluation
