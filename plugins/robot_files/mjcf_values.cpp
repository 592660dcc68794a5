// SPDX-License-Identifier: Apache-2.0
// Rules of https://mujoco.readthedocs.io/en/stable/modeling.html (default settings, frame
// orientations) and XMLreference.html (include).
#include "mjcf_values.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "files.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::robot_files {
namespace {

/// Kinds of actuators have one set of defaults.
std::string_view defaults_kind(std::string_view element) {
  for (const char* a :
       {"motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle", "adhesion"})
    if (element == a) return "general";
  return element;
}

}  // namespace

Result<std::vector<const Element*>> MjcfValues::children(const Element& e) const {
  std::vector<const Element*> out;
  std::vector<const Element*> stack{e.FirstChildElement()};
  while (!stack.empty()) {
    const Element* c = stack.back();
    if (!c) {
      stack.pop_back();
      continue;
    }
    stack.back() = c->NextSiblingElement();
    if (std::string_view(c->Name()) != "include") {
      out.push_back(c);
      continue;
    }
    // Relative to the robot's file; where that has none, to the file that includes.
    const std::filesystem::path name = std::string(word(*c, "file"));
    if (name.empty()) return fault(*c, "it includes no file", "Give file=\"part.xml\".");
    std::filesystem::path file = folder_ / name;
    if (const Source* s = source_of(*c); s && !files::exists(file))
      if (const auto beside = s->path.parent_path() / name; files::exists(beside)) file = beside;
    RMP_TRY_ASSIGN(const Element* root, documents_.open(*c, file));
    stack.push_back(root->FirstChildElement());
  }
  return out;
}

Result<void> MjcfValues::compiler(const Element& e) {
  if (word(e, "angle") == "radian") degrees_ = false;
  if (word(e, "angle") == "degree") degrees_ = true;
  if (word(e, "coordinate") == "global")
    return fault(e, "its coordinates are global", "Save it with a newer MuJoCo first.");
  autolimits_ = is_yes(word(e, "autolimits"), autolimits_);
  if (has(e, "eulerseq")) sequence_ = std::string(word(e, "eulerseq"));
  if (sequence_.size() != 3 || sequence_.find_first_not_of("xyzXYZ") != std::string::npos)
    return fault(e, in_quotes(sequence_) + " is not a sequence of Euler angles",
                 "Give three of x, y, z, X, Y and Z.");
  return {};
}

Result<void> MjcfValues::defaults(const Element& top) {
  struct Open {
    const Element* e;
    std::string name, above;
  };
  if (has(top, "class")) main_names_.insert(std::string(word(top, "class")));
  std::vector<Open> stack{{&top, "main", "main"}};
  while (!stack.empty()) {
    const Open open = stack.back();
    stack.pop_back();
    if (classes_.size() > kMostBodies) return fault(*open.e, "there are too many defaults");
    Class made = classes_[open.above];
    if (const auto known = classes_.find(open.name); known != classes_.end()) made = known->second;
    std::vector<Open> inside;
    RMP_TRY_ASSIGN(const auto all, children(*open.e));
    for (const Element* e : all) {
      if (std::string_view(e->Name()) == "default") {
        if (!has(*e, "class"))
          return fault(*e, "a class of defaults inside another one has no name",
                       "Give it as class=\"...\".");
        inside.push_back({e, std::string(word(*e, "class")), open.name});
        continue;
      }
      Attributes& to = made[std::string(defaults_kind(e->Name()))];
      for (const auto* a = e->FirstAttribute(); a; a = a->Next()) to[a->Name()] = a->Value();
    }
    classes_[open.name] = std::move(made);
    for (std::size_t i = inside.size(); i-- > 0;) stack.push_back(std::move(inside[i]));
  }
  return {};
}

std::string MjcfValues::class_of(const Element& e, const std::string& around) const {
  if (!has(e, "class") && !has(e, "childclass")) return around;
  const std::string name(word(e, has(e, "class") ? "class" : "childclass"));
  if (main_names_.contains(name)) return "main";
  if (!classes_.contains(name) && !unknown_class_)
    unknown_class_ = fault(e, "class " + in_quotes(name) + " is not among the defaults",
                           "Add it as <default class=...>, or remove the class.");
  return name;
}

Result<void> MjcfValues::check_classes() const {
  if (unknown_class_) return *unknown_class_;
  return {};
}

std::string_view MjcfValues::value(const Element& e, const std::string& cls,
                                   const char* attribute) const {
  if (has(e, attribute)) return word(e, attribute);
  const auto d = classes_.find(cls);
  if (d == classes_.end()) return {};
  const auto of = d->second.find(defaults_kind(e.Name()));
  if (of == d->second.end()) return {};
  const auto a = of->second.find(attribute);
  return a == of->second.end() ? std::string_view() : std::string_view(a->second);
}

Result<void> MjcfValues::list(const Element& e, const std::string& cls, const char* attribute,
                              std::span<double> out) const {
  const std::string_view v = value(e, cls, attribute);
  if (!v.empty()) RMP_TRY(read(e, v, attribute, out));
  return {};
}

Result<double> MjcfValues::first(const Element& e, const std::string& cls, const char* attribute,
                                 double otherwise) const {
  const std::string_view v = value(e, cls, attribute);
  if (v.empty()) return otherwise;
  RMP_TRY_ASSIGN(const auto n, numbers(e, v, attribute));
  if (n.empty() || std::fabs(n[0]) > kGreatest)
    return fault(e, std::string(attribute) + " is not a valid number", "Correct the file.");
  return n[0];
}

Result<Colour> MjcfValues::colour(const Element& e, const std::string& cls) const {
  std::array<double, 4> c{};
  RMP_TRY(list(e, cls, "rgba", c));
  return Colour{static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]),
                static_cast<float>(c[3])};
}

double MjcfValues::angle(double v) const { return degrees_ ? v * (std::numbers::pi / 180) : v; }

Result<Pose> MjcfValues::pose(const Element& e, const std::string& cls) const {
  Pose t;
  RMP_TRY(list(e, cls, "pos", t.p));
  constexpr const char* kNotations[] = {"quat", "axisangle", "euler", "xyaxes", "zaxis"};
  const auto own = std::find_if(std::begin(kNotations), std::end(kNotations),
                                [&](const char* n) { return has(e, n); });
  const auto any = own != std::end(kNotations)
                       ? own
                       : std::find_if(std::begin(kNotations), std::end(kNotations),
                                      [&](const char* n) { return !value(e, cls, n).empty(); });
  if (any == std::end(kNotations)) return t;
  const std::string_view notation = *any;
  if (notation == "quat") {
    std::array<double, 4> q{};
    RMP_TRY(list(e, cls, "quat", q));
    if (!(std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3])) > 1e-9))
      return fault(e, "its quaternion has no length", "The neutral one is 1 0 0 0.");
    t.R = spatial::from_quaternion({q[0], q[1], q[2], q[3]});
  } else if (notation == "axisangle") {
    std::array<double, 4> a{};
    RMP_TRY(list(e, cls, "axisangle", a));
    RMP_TRY_ASSIGN(const Vec3 axis, unit_vector(e, {a[0], a[1], a[2]}));
    t.R = spatial::from_axis_angle(axis, angle(a[3]));
  } else if (notation == "euler") {
    Vec3 a{};
    RMP_TRY(list(e, cls, "euler", a));
    Pose turn;
    for (std::size_t k = 0; k < 3; ++k) {
      const char c = sequence_[k];
      const double by = angle(a[k]);
      const Pose one = c == 'x' || c == 'X'   ? spatial::rotation_x(by)
                       : c == 'y' || c == 'Y' ? spatial::rotation_y(by)
                                              : spatial::rotation_z(by);
      // Lower case turns with the frame, upper case about axes that stay.
      turn = c >= 'a' ? spatial::compose(turn, one) : spatial::compose(one, turn);
    }
    t.R = turn.R;
  } else if (notation == "xyaxes") {
    std::array<double, 6> a{};
    RMP_TRY(list(e, cls, "xyaxes", a));
    RMP_TRY_ASSIGN(const Vec3 x, unit_vector(e, {a[0], a[1], a[2]}));
    Vec3 y{a[3], a[4], a[5]};
    y = spatial::sub(y, spatial::scale(x, spatial::dot(x, y)));
    RMP_TRY_ASSIGN(y, unit_vector(e, y));
    const Vec3 z = spatial::cross(x, y);
    t.R = {x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]};
  } else {
    Vec3 z{};
    RMP_TRY(list(e, cls, "zaxis", z));
    RMP_TRY_ASSIGN(z, unit_vector(e, z));
    t.R = turn_z_to(z);
  }
  return t;
}

}  // namespace robomosp::robot_files
