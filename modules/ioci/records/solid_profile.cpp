// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <optional>

#include "ioci/records/solid_nodes.h"
#include "kernel/units.h"

namespace robomosp::ioci {
namespace {

constexpr const char* kLoopHint =
    "A loop is {start = {x, y}, curves = {{line = {x, y}}, {arc = {{x, y}, {x, y}}}, {spline = "
    "{{x, y}, ...}}}}, {circle = {{x, y}, radius}}, {rectangle = {x, y}}, {polygon = {{x, y}, "
    "...}}, {slot = {length, radius}} or {regular = {sides = 6, radius = r}}.";

Error fault(const std::string& path, std::string message) {
  return error(ErrorCode::invalid_argument, std::move(message), kLoopHint, path);
}

/// The entries of a list or of an array of numbers; nullopt = neither.
std::optional<List> items_of(const Value& v) {
  if (const List* list = v.as_list()) return *list;
  if (const NumericArray* a = v.as_array()) {
    if (!a->is_matrix()) return List(a->data().begin(), a->data().end());
    List rows;
    for (std::size_t r = 0; r < a->rows(); ++r) {
      List row;
      for (std::size_t c = 0; c < a->cols(); ++c) row.emplace_back(a->at(r, c));
      rows.emplace_back(std::move(row));
    }
    return rows;
  }
  return std::nullopt;
}

/// A length times a factor; of an expression, the expression.
Value times(const Value& length, double factor) {
  if (length.is_number()) return length.number() * factor;
  const std::string* s = length.as_string();
  if (!s) return length;
  if (const auto read = units::read_quantity(*s, "m"); read.ok()) return *read * factor;
  return "(" + *s + ")*(" + text::print(factor) + ")";
}
Value plus(const Value& a, const Value& b) {
  if (a.is_number() && b.is_number()) return a.number() + b.number();
  const auto term = [](const Value& v) {
    return v.as_string() ? "(" + *v.as_string() + ")" : "(" + text::print(v.number()) + " m)";
  };
  return term(a) + " + " + term(b);
}

class ProfileReader {
 public:
  explicit ProfileReader(CommandContext& ctx) : ctx_(ctx) {}

  Result<CsgProfile> run(const Value& value, const std::string& path) {
    const auto loops = items_of(value);
    const bool is_single = value.as_map() || (loops && is_start(*loops));
    if (is_single) {
      RMP_TRY(loop(value, path));
      return std::move(profile_);
    }
    if (!loops || loops->empty())
      return fault(path, loops ? "the profile has no loops" : value.text() + " is not a profile");
    for (std::size_t i = 0; i < loops->size(); ++i)
      RMP_TRY(loop((*loops)[i], path + "[" + std::to_string(i + 1) + "]"));
    return std::move(profile_);
  }

 private:
  using Point = std::array<double, 2>;

  static bool is_start(const List& list) {
    const Map* first = list.empty() ? nullptr : list.front().as_map();
    return first && first->size() == 1 && first->find("start");
  }

  /// One number, which may be an expression; `name` is the path's last part.
  Result<double> number(const Value& v, const std::string& name, const std::string& prefix,
                        const std::string& path) {
    const Schema schema{field(name, "real", "m", "")};
    RMP_TRY_ASSIGN(const Map read, ctx_.expressions.read(schema, Map{{name, v}}, path, prefix));
    RMP_TRY_ASSIGN(const Value checked, check_value(schema[0], *read.find(name), path));
    return checked.number();
  }
  Result<Point> point(const Value& v, const std::string& path) {
    const auto items = items_of(v);
    if (!items || items->size() != 2) return fault(path, v.text() + " is not a point {x, y}");
    const std::string prefix =
        "profile." + std::to_string(profile_.loops.size() + 1) + "." + std::to_string(++points_);
    RMP_TRY_ASSIGN(const double x, number((*items)[0], "x", prefix, path + "[1]"));
    RMP_TRY_ASSIGN(const double y, number((*items)[1], "y", prefix, path + "[2]"));
    return Point{x, y};
  }
  Result<void> points(const Value& v, std::vector<Point>& out, const std::string& path) {
    const auto items = items_of(v);
    if (!items) return fault(path, v.text() + " is not a list of points");
    for (std::size_t i = 0; i < items->size(); ++i) {
      RMP_TRY_ASSIGN(const Point p, point((*items)[i], path + "[" + std::to_string(i + 1) + "]"));
      out.push_back(p);
    }
    return {};
  }

  Result<void> loop(const Value& value, const std::string& path) {
    points_ = 0;
    CsgLoop l;
    if (const List* list = value.as_list()) {
      if (!is_start(*list)) return fault(path, "the loop does not begin with {start = {x, y}}");
      RMP_TRY_ASSIGN(l.start, point(*list->front().as_map()->find("start"), path + ".start"));
      for (std::size_t i = 1; i < list->size(); ++i)
        RMP_TRY(curve((*list)[i], l, path + "[" + std::to_string(i + 1) + "]"));
      profile_.loops.push_back(std::move(l));
      return {};
    }
    const Map* map = value.as_map();
    if (!map) return fault(path, value.text() + " is not a loop");
    if (const Value* start = map->find("start")) {
      for (const auto& [key, v] : *map)
        if (key != "start" && key != "curves")
          return fault(path, text::quote(key) + " does not fit a loop");
      RMP_TRY_ASSIGN(l.start, point(*start, path + ".start"));
      const Value* curves = map->find("curves");
      const auto items = curves ? items_of(*curves) : std::nullopt;
      if (!items) return fault(path, "the loop has no curves");
      for (std::size_t i = 0; i < items->size(); ++i)
        RMP_TRY(curve((*items)[i], l, path + ".curves[" + std::to_string(i + 1) + "]"));
      profile_.loops.push_back(std::move(l));
      return {};
    }
    if (map->size() != 1) return fault(path, "this is not a loop");
    const auto& [word, v] = *map->begin();
    const std::string here = path + "." + word;
    if (word == "circle") return circle(v, here);
    if (word == "polygon") return polygon(v, here);
    if (word == "regular") return regular(v, here);
    if (word == "rectangle" || word == "slot") {
      const auto two = items_of(v);
      if (!two || two->size() != 2)
        return fault(here, word == "slot" ? "a slot needs a length and a radius"
                                          : "a rectangle needs two sides");
      return word == "slot" ? slot((*two)[0], (*two)[1], here)
                            : rectangle((*two)[0], (*two)[1], here);
    }
    static const std::vector<std::string> known{"start",   "circle",    "polygon",
                                                "regular", "rectangle", "slot"};
    Error e = fault(path, text::quote(word) + " is not a kind of loop");
    if (const std::string meant = text::did_you_mean(word, known); !meant.empty())
      e.hint = meant + " " + e.hint;
    return e;
  }

  Result<void> curve(const Value& value, CsgLoop& l, const std::string& path) {
    const Map* map = value.as_map();
    if (!map || map->size() != 1) return fault(path, value.text() + " is not a curve");
    const auto& [word, v] = *map->begin();
    const std::string here = path + "." + word;
    CsgCurve c;
    if (word == "line") {
      RMP_TRY_ASSIGN(const Point end, point(v, here));
      c.points = {end};
    } else if (word == "arc" || word == "spline") {
      c.kind = word == "arc" ? CsgCurve::Kind::arc : CsgCurve::Kind::spline;
      RMP_TRY(points(v, c.points, here));
      if (word == "arc" && c.points.size() != 2)
        return fault(here, "an arc needs two points, one on the arc and its end");
    } else {
      return fault(path, text::quote(word) + " is not a kind of curve");
    }
    l.curves.push_back(std::move(c));
    return {};
  }

  Result<void> circle(const Value& v, const std::string& path) {
    const auto two = items_of(v);
    if (!two || two->size() != 2) return fault(path, "a circle needs a centre and a radius");
    RMP_TRY_ASSIGN(const Point centre, point((*two)[0], path + "[1]"));
    RMP_TRY_ASSIGN(const double radius,
                   number((*two)[1], "radius",
                          "profile." + std::to_string(profile_.loops.size() + 1), path + "[2]"));
    profile_.loops.push_back({{}, {{CsgCurve::Kind::circle, {centre, {radius, 0}}}}});
    return {};
  }

  Result<void> polygon(const Value& v, const std::string& path) {
    std::vector<Point> corners;
    RMP_TRY(points(v, corners, path));
    if (corners.size() < 3) return fault(path, "a polygon needs at least three corners");
    CsgLoop l;
    l.start = corners[0];
    for (std::size_t i = 1; i < corners.size(); ++i)
      l.curves.push_back({CsgCurve::Kind::line, {corners[i]}});
    profile_.loops.push_back(std::move(l));
    return {};
  }

  Result<void> rectangle(const Value& x, const Value& y, const std::string& path) {
    const Value left = times(x, -0.5), right = times(x, 0.5), low = times(y, -0.5),
                high = times(y, 0.5);
    return polygon(List{List{left, low}, List{right, low}, List{right, high}, List{left, high}},
                   path);
  }

  /// Two half circles about (-length/2, 0) and (length/2, 0), and the lines between them.
  Result<void> slot(const Value& length, const Value& radius, const std::string& path) {
    const Value left = times(length, -0.5), right = times(length, 0.5), down = times(radius, -1),
                up = times(radius, 1);
    const Value outline = List{Map{{"start", List{left, down}}}, Map{{"line", List{right, down}}},
                               Map{{"arc", List{List{plus(right, up), 0.0}, List{right, up}}}},
                               Map{{"line", List{left, up}}},
                               Map{{"arc", List{List{plus(left, down), 0.0}, List{left, down}}}}};
    return loop(outline, path);
  }

  /// A regular polygon with a corner on the x axis.
  Result<void> regular(const Value& v, const std::string& path) {
    const Map* map = v.as_map();
    const Value* sides = map ? map->find("sides") : nullptr;
    const Value* radius = map ? map->find("radius") : nullptr;
    if (!sides || !radius || map->size() != 2)
      return fault(path, "a regular polygon needs sides and a radius");
    RMP_TRY_ASSIGN(const Value checked, check_value(between(field("", "int", "", ""), 3, 10000),
                                                    *sides, path + ".sides"));
    const auto n = static_cast<int>(checked.number());
    List corners;
    for (int k = 0; k < n; ++k) {
      const double angle = 2 * std::numbers::pi * k / n;
      corners.emplace_back(List{times(*radius, std::cos(angle)), times(*radius, std::sin(angle))});
    }
    return polygon(corners, path);
  }

  CommandContext& ctx_;
  CsgProfile profile_;
  std::size_t points_ = 0;  ///< of the present loop, so far
};

Value point_value(const std::array<double, 2>& p) { return NumericArray({p[0], p[1]}, "m"); }

}  // namespace

Result<std::shared_ptr<const CsgProfile>> read_profile(CommandContext& ctx, const Value& value,
                                                       const std::string& path) {
  RMP_TRY_ASSIGN(CsgProfile profile, ProfileReader(ctx).run(value, path));
  return std::make_shared<const CsgProfile>(std::move(profile));
}

Value profile_value(const CsgProfile& profile) {
  List loops;
  for (const CsgLoop& l : profile.loops) {
    if (!l.curves.empty() && l.curves[0].kind == CsgCurve::Kind::circle) {
      const auto& p = l.curves[0].points;
      loops.emplace_back(Map{{"circle", List{point_value(p[0]), p[1][0]}}});
      continue;
    }
    List curves;
    for (const CsgCurve& c : l.curves) {
      if (c.kind == CsgCurve::Kind::line) {
        curves.emplace_back(Map{{"line", point_value(c.points[0])}});
        continue;
      }
      List points;
      for (const auto& p : c.points) points.push_back(point_value(p));
      curves.emplace_back(
          Map{{c.kind == CsgCurve::Kind::arc ? "arc" : "spline", std::move(points)}});
    }
    loops.emplace_back(Map{{"start", point_value(l.start)}, {"curves", std::move(curves)}});
  }
  return loops;
}

std::string profile_help() {
  return "\n"
         "A profile is a list of closed loops; a loop within another is a hole. A loop is\n\n"
         "- `{start = {0, 0}, curves = {{line = {0.1, 0}}, {arc = {{0.12, 0.02}, {0.1, 0.04}}}, "
         "{spline = {{0.05, 0.05}, {0, 0.04}}}}}`: each curve begins at the end of the one before; "
         "an arc passes through a point before its end, a straight line closes the loop; "
         "the same may be written `{{start = {0, 0}}, {line = {0.1, 0}}, ...}`;\n"
         "- `{circle = {{0.05, 0.02}, \"8 mm\"}}`: centre and radius;\n"
         "- `{rectangle = {\"40 mm\", \"20 mm\"}}` about the origin, `{polygon = {{x, y}, ...}}`, "
         "`{slot = {length, radius}}` with its half circles about (-length/2, 0) and (length/2, "
         "0), `{regular = {sides = 6, radius = \"10 mm\"}}` with a corner on the x axis.\n\n"
         "A profile of a single loop may be that loop itself: `profile = {rectangle = {\"40 mm\", "
         "\"20 mm\"}}`. Its numbers are set by `\"web.profile.1.3.x\"` (loop and point; the start "
         "is point 1) and `\"web.profile.2.radius\"`.\n";
}

}  // namespace robomosp::ioci
