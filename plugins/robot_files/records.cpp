// SPDX-License-Identifier: Apache-2.0
#include "records.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

#include <robomosp/sdk/names.h>

#include "mesh_file.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::robot_files {
namespace {

std::string print_value(double v) {
  char buffer[32];
  const auto r = std::to_chars(buffer, buffer + sizeof buffer, v == 0 ? 0.0 : v);
  return {buffer, r.ptr};
}
std::string limit(double v) { return std::isinf(v) ? (v > 0 ? "inf" : "-inf") : print_value(v); }
std::string tuple(const Vec3& v) {
  return "(" + print_value(v[0]) + ", " + print_value(v[1]) + ", " + print_value(v[2]) + ")";
}
std::string text(std::string_view s) {
  std::string out = "\"";
  for (const char c : s) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
  }
  return out + '"';
}
std::string placement(const Pose& t) {
  std::string out;
  if (t.p != Vec3{}) out += " at " + tuple(t.p);
  if (t.R != Pose{}.R) out += " rpy " + tuple(spatial::to_rpy(t.R));
  return out;
}

class Names {
 public:
  explicit Names(std::initializer_list<std::string> taken = {}) : taken_(taken) {}
  std::string take(std::string_view wanted, std::string_view otherwise) {
    std::string apart(wanted);  // "arm::rod" and "arm:rod" stay two names
    std::replace(apart.begin(), apart.end(), ':', '_');
    const std::string base = valid_name(apart, otherwise);
    std::string name = base;
    for (std::size_t& i = next_[base]; !taken_.insert(name).second;)
      name = base + "_" + std::to_string(++i + 1);
    return name;
  }

 private:
  std::set<std::string> taken_;
  std::map<std::string, std::size_t> next_;
};

/// A mesh that stands in the robot's file; a mirroring scale turns its triangles.
CsgGeometry written(const MeshFile& m, const Vec3& scale) {
  CsgGeometry g;
  g.form = CsgGeometry::Form::mesh;
  g.points = m.points;
  for (std::size_t i = 0; i < g.points.size(); ++i) g.points[i] *= scale[i % 3];
  g.triangles = m.triangles;
  if (scale[0] * scale[1] * scale[2] < 0)
    for (std::size_t t = 0; t + 2 < g.triangles.size(); t += 3)
      std::swap(g.triangles[t], g.triangles[t + 1]);
  return g;
}

const char* joint_word(Joint::Kind k) {
  switch (k) {
    case Joint::Kind::revolute: return "revolute";
    case Joint::Kind::prismatic: return "prismatic";
    case Joint::Kind::universal: return "universal";
    case Joint::Kind::cylindrical: return "cylindrical";
    case Joint::Kind::planar: return "planar";
    case Joint::Kind::spherical: return "spherical";
    case Joint::Kind::free: return "free";
  }
  return "fixed";
}
bool has_one_coordinate(Joint::Kind k) {
  return k == Joint::Kind::revolute || k == Joint::Kind::prismatic;
}

class Recorder {
 public:
  Recorder(Mechanism m, const Options& options) : m_(std::move(m)), options_(options) {}

  Result<Imported> run() {
    out_.notes = std::move(m_.notes);
    const std::string name = valid_name(options_.name.empty() ? m_.name : options_.name, "robot");
    RMP_TRY(sort());
    std::string robot = "robomosp robot 1\nname " + text(name) + "\nsource " +
                        text("imported from " + options_.source) + "\nmasses given\n";
    for (const Shape& s : m_.ground)
      if (const std::string part = this->part(s, name + "_base"); !part.empty())
        robot += "base_part {" + part + " }\n";
    if (m_.ground_mass) robot += given("base_mass", *m_.ground_mass, "the base");
    name_links();
    has_shapes_ =
        !m_.ground.empty() || std::any_of(m_.bodies.begin(), m_.bodies.end(),
                                          [](const Body& body) { return !body.shapes.empty(); });
    for (const std::size_t b : order_) robot += links(b);
    for (const Loop& l : m_.loops) robot += loop(l);
    for (const NamedPose& p : m_.poses) robot += pose(p);
    if (!renamed_.empty())
      note("Names that are not valid here, or were used twice, were changed: " + listed(renamed_) +
           ".");
    if (looks_ > 0)
      note(
          "Colours became materials without density; the links have the masses given in the file.");
    out_.records.push_back({name + ".rbt", std::move(robot)});
    return std::move(out_);
  }

 private:
  void note(std::string sentence) { out_.notes.push_back(std::move(sentence)); }

  static std::string listed(const std::vector<std::string>& names) {
    std::string out;
    for (std::size_t i = 0; i < names.size() && i < 5; ++i) out += (i ? ", " : "") + names[i];
    if (names.size() > 5) out += " and " + std::to_string(names.size() - 5) + " more";
    return out;
  }

  /// Parents first, followed joints first, else by the file's order.
  Result<void> sort() {
    std::map<std::string, std::size_t> body_of;
    for (std::size_t b = 0; b < m_.bodies.size(); ++b)
      for (const Joint& j : m_.bodies[b].joints) body_of.emplace(j.name, b);
    const auto find = [&](const std::string& joint) -> const Joint* {
      const auto it = body_of.find(joint);
      if (it == body_of.end()) return nullptr;
      for (const Joint& j : m_.bodies[it->second].joints)
        if (j.name == joint) return &j;
      return nullptr;
    };
    for (Body& body : m_.bodies)
      for (std::size_t k = 0; k < body.joints.size(); ++k) {
        Joint& j = body.joints[k];
        if (j.follows.empty()) continue;
        const Joint* of = find(j.follows);
        bool is_before = true;  // of two joints of one body the first can be followed
        for (std::size_t i = k; i < body.joints.size(); ++i)
          is_before = is_before && body.joints[i].name != j.follows;
        if (of && is_before && has_one_coordinate(of->kind) && has_one_coordinate(j.kind)) continue;
        note("Joint " + in_quotes(j.name) + " moves independently: it cannot follow " +
             in_quotes(j.follows) + ".");
        j.follows.clear();
      }
    while (!sort_once(body_of)) {
      // What is left waits for each other: one coupling of it is let go.
      bool is_helped = false;
      for (std::size_t b = 0; b < m_.bodies.size() && !is_helped; ++b) {
        if (std::find(order_.begin(), order_.end(), b) != order_.end()) continue;
        for (Joint& j : m_.bodies[b].joints) {
          if (j.follows.empty()) continue;
          note("Joint " + in_quotes(j.name) + " moves independently: it follows " +
               in_quotes(j.follows) + " in a circle.");
          j.follows.clear();
          is_helped = true;
        }
      }
      if (!is_helped)
        return error(ErrorCode::invalid_argument, "its links form a cycle",
                     "Every link except the root needs one parent.");
    }
    return {};
  }

  bool sort_once(const std::map<std::string, std::size_t>& body_of) {
    order_.clear();
    std::vector<std::vector<std::size_t>> next(m_.bodies.size());
    std::vector<std::size_t> waits(m_.bodies.size(), 0);
    const auto after = [&](std::size_t first, std::size_t then) {
      if (first == then) return;
      next[first].push_back(then);
      ++waits[then];
    };
    for (std::size_t b = 0; b < m_.bodies.size(); ++b) {
      if (m_.bodies[b].parent >= 0) {
        if (static_cast<std::size_t>(m_.bodies[b].parent) == b) waits[b] = 1;
        after(static_cast<std::size_t>(m_.bodies[b].parent), b);
      }
      for (const Joint& j : m_.bodies[b].joints)
        if (!j.follows.empty()) after(body_of.at(j.follows), b);
    }
    std::set<std::size_t> ready;
    for (std::size_t b = 0; b < waits.size(); ++b)
      if (waits[b] == 0) ready.insert(b);
    while (!ready.empty()) {
      const std::size_t b = *ready.begin();
      ready.erase(ready.begin());
      order_.push_back(b);
      for (const std::size_t n : next[b])
        if (--waits[n] == 0) ready.insert(n);
    }
    return order_.size() == m_.bodies.size();
  }

  /// A body whose last joint's axis does not run through its origin has a fixed link of its own.
  static bool has_own_link(const Body& b) {
    return b.joints.empty() || b.joints.back().anchor != Vec3{};
  }

  void name_links() {
    Names names{"base"};
    body_names_.resize(m_.bodies.size());
    // Bodies first, so that they keep their names.
    for (const std::size_t b : order_) {
      body_names_[b] = names.take(m_.bodies[b].name, "link");
      if (body_names_[b] != m_.bodies[b].name)
        renamed_.push_back(in_quotes(m_.bodies[b].name) + " is " + in_quotes(body_names_[b]));
    }
    for (const std::size_t b : order_) {
      const Body& body = m_.bodies[b];
      for (std::size_t k = 0; k < body.joints.size(); ++k) {
        const bool is_body = k + 1 == body.joints.size() && !has_own_link(body);
        joint_links_.emplace(
            body.joints[k].name,
            is_body ? body_names_[b] : names.take(body.joints[k].name, body_names_[b] + "_joint"));
      }
    }
  }

  std::string links(std::size_t b) {
    const Body& body = m_.bodies[b];
    std::string out;
    std::string parent =
        body.parent < 0 ? "base" : body_names_[static_cast<std::size_t>(body.parent)];
    Pose origin = body.rest;
    Vec3 at{};
    for (std::size_t k = 0; k < body.joints.size(); ++k) {
      const Joint& j = body.joints[k];
      origin = spatial::compose(origin, spatial::translation(spatial::sub(j.anchor, at)));
      at = j.anchor;
      const std::string name = joint_links_.at(j.name);
      const bool is_last = k + 1 == body.joints.size() && !has_own_link(body);
      out += "link " + text(name) + " {\n  parent " + text(parent) + "\n  joint " +
             joint_word(j.kind) + "\n  origin {" + placement(origin) + " }\n" + fields(j);
      if (is_last) out += content(b);
      // The file gives bodies, and none here: nothing is generated in its place.
      if (has_shapes_ && (!is_last || body.shapes.empty())) out += "  visible false\n";
      out += "}\n";
      parent = name;
      origin = Pose{};
    }
    if (has_own_link(body)) {
      origin = spatial::compose(origin, spatial::translation(spatial::scale(at, -1)));
      out += "link " + text(body_names_[b]) + " {\n  parent " + text(parent) +
             "\n  joint fixed\n  origin {" + placement(origin) + " }\n" + content(b) + "}\n";
    }
    return out;
  }

  std::string fields(const Joint& j) {
    std::string out;
    const bool has_axis = j.kind != Joint::Kind::spherical && j.kind != Joint::Kind::free;
    if (has_axis && j.axis != Vec3{0, 0, 1}) out += "  axis " + tuple(j.axis) + "\n";
    if (!j.follows.empty())
      out += "  mimic { link " + text(joint_links_.at(j.follows)) + "  ratio " +
             print_value(j.ratio) + "  offset " + print_value(j.offset) + " }\n";
    if (j.passive) out += "  passive true\n";
    if (!has_one_coordinate(j.kind)) {
      std::vector<std::string> lost;
      if (std::isfinite(j.lower) || std::isfinite(j.upper) || std::isfinite(j.max_velocity) ||
          std::isfinite(j.max_force))
        lost.emplace_back("limits");
      if (j.viscous != 0) lost.emplace_back("damping");
      if (j.coulomb != 0) lost.emplace_back("friction");
      if (j.stiffness != 0) lost.emplace_back("spring");
      if (j.armature != 0) lost.emplace_back("motor inertia");
      std::string all;
      for (std::size_t i = 0; i < lost.size(); ++i)
        all += (i == 0 ? "" : i + 1 == lost.size() ? " and " : ", ") + lost[i];
      if (!lost.empty())
        note("Joint " + in_quotes(j.name) + " is " + joint_word(j.kind) + ": its " + all +
             (lost.size() == 1 && lost[0] != "limits" ? " was" : " were") + " left out.");
      return out;
    }
    double lower = j.lower, upper = j.upper;
    if (lower > upper) {
      std::swap(lower, upper);
      note("The limits of joint " + in_quotes(j.name) +
           " were swapped: the lower one was above the upper one.");
    }
    if (std::isfinite(lower) || std::isfinite(upper))
      out += "  limits (" + limit(lower) + ", " + limit(upper) + ")\n";
    const auto greatest = [&](const char* word, double v, const char* what) {
      if (std::isinf(v)) return;
      if (v > 0) out += std::string("  ") + word + " " + print_value(v) + "\n";
      else
        note("The maximum " + std::string(what) + " of joint " + in_quotes(j.name) + " is " +
             print_value(v) + " in the file; it was treated as unlimited.");
    };
    greatest("max_velocity", j.max_velocity, "velocity");
    greatest("max_acceleration", j.max_acceleration, "acceleration");
    greatest("max_jerk", j.max_jerk, "jerk");
    greatest("max_force", j.max_force, "force");
    const double viscous = at_least_zero(j, j.viscous, "damping"),
                 coulomb = at_least_zero(j, j.coulomb, "friction"),
                 armature = at_least_zero(j, j.armature, "armature"),
                 stiffness = at_least_zero(j, j.stiffness, "stiffness");
    const double backward = j.coulomb_negative < 0 ? coulomb : j.coulomb_negative;
    if (viscous != 0 || coulomb != 0 || backward != 0 || armature != 0)
      out += "  drive { motor_inertia " + print_value(armature) + "  viscous " +
             print_value(viscous) + "  coulomb (" + print_value(coulomb) + ", " +
             print_value(-backward) + ") }\n";
    if (stiffness != 0)
      out += "  spring { stiffness " + print_value(stiffness) + "  rest " + print_value(j.rest) +
             " }\n";
    return out;
  }

  double at_least_zero(const Joint& j, double v, const char* what) {
    if (v >= 0) return v;
    note("The " + std::string(what) + " of joint " + in_quotes(j.name) +
         " is negative and was left out.");
    return 0;
  }

  /// A block with mass, centre and inertia; "" for a negative mass, which a note reports.
  std::string given(const char* word, const MassProperties& m, const std::string& of) {
    if (m.mass < 0) {
      note("The mass of " + of + " is negative and was left out.");
      return {};
    }
    Sym3 i = m.inertia;
    // Exporters round what is zero to either side.
    const double rounding =
        1e-12 * std::max({1.0, std::fabs(i.xx), std::fabs(i.yy), std::fabs(i.zz)});
    for (double* x : {&i.xx, &i.yy, &i.zz})
      if (*x < 0 && *x > -rounding) *x = 0;
    return std::string(word) + " { mass " + print_value(m.mass) + "  com " + tuple(m.com) +
           "  inertia (" + print_value(i.xx) + ", " + print_value(i.yy) + ", " + print_value(i.zz) +
           ", " + print_value(i.xy) + ", " + print_value(i.yz) + ", " + print_value(i.xz) + ") }\n";
  }

  std::string content(std::size_t b) {
    const Body& body = m_.bodies[b];
    std::string out;
    if (body.mass) out += given("  given", *body.mass, in_quotes(body.name));
    for (const Shape& s : body.shapes)
      if (const std::string p = part(s, body_names_[b]); !p.empty()) out += "  part {" + p + " }\n";
    return out;
  }

  std::string loop(const Loop& l) {
    const auto side = [&](std::int32_t body, const Pose& t) {
      return " { link " + text(body < 0 ? "base" : body_names_[static_cast<std::size_t>(body)]) +
             placement(t) + " }";
    };
    return "loop " + text(loop_names_.take(l.name, "loop")) + " { kind " + l.kind + "  a" +
           side(l.a, l.in_a) + "  b" + side(l.b, l.in_b) + " }\n";
  }

  /// The coordinates in the order of the links; those of followers are not among them.
  std::string pose(const NamedPose& p) {
    const std::map<std::string, std::vector<double>> values(p.values.begin(), p.values.end());
    std::string all;
    for (const std::size_t b : order_)
      for (const Joint& j : m_.bodies[b].joints) {
        const auto known = values.find(j.name);
        if (!j.follows.empty() || known == values.end()) continue;
        for (const double v : known->second) all += (all.empty() ? "" : ", ") + print_value(v);
      }
    return "pose " + text(pose_names_.take(p.name, "pose")) + " (" + all + ")\n";
  }

  /// `solid "x.csg" at ...`, or "" when the shape has no extent.
  std::string part(const Shape& s, const std::string& on) {
    const std::string file = solid(s, on);
    if (file.empty()) return {};
    Pose t = s.pose;
    // What stands on z = 0 here is centred there.
    if (s.kind == Shape::Kind::box)
      t = spatial::compose(t, spatial::translation({0, 0, -s.size[2] / 2}));
    if (s.kind == Shape::Kind::cylinder)
      t = spatial::compose(t, spatial::translation({0, 0, -s.size[1] / 2}));
    return " solid " + text(file) + placement(t);
  }

  std::string solid(const Shape& s, const std::string& on) {
    const std::size_t used = s.kind == Shape::Kind::box || s.kind == Shape::Kind::ellipsoid      ? 3
                             : s.kind == Shape::Kind::cylinder || s.kind == Shape::Kind::capsule ? 2
                             : s.kind == Shape::Kind::sphere                                     ? 1
                                                             : 0;
    for (std::size_t i = 0; i < used; ++i)
      if (!(s.size[i] > 0 && s.size[i] < 1e6)) {
        note("A shape of " + in_quotes(on) + " with the size " + print_value(s.size[i]) +
             " m was left out.");
        return {};
      }
    std::string node;
    switch (s.kind) {
      case Shape::Kind::box:
        node = "box body { x " + print_value(s.size[0]) + "  y " + print_value(s.size[1]) + "  z " +
               print_value(s.size[2]) + " }\n";
        break;
      case Shape::Kind::cylinder:
        node = "cylinder body { radius " + print_value(s.size[0]) + "  height " +
               print_value(s.size[1]) + " }\n";
        break;
      case Shape::Kind::sphere:
        node = "sphere body { radius " + print_value(s.size[0]) + " }\n";
        break;
      case Shape::Kind::capsule: {
        const std::string r = print_value(s.size[0]), half = print_value(s.size[1] / 2);
        node = "union body {\n  cylinder middle { at (0, 0, -" + half + ")  radius " + r +
               "  height " + print_value(s.size[1]) + " }\n  sphere below { at (0, 0, -" + half +
               ")  radius " + r + " }\n  sphere above { at (0, 0, " + half + ")  radius " + r +
               " }\n}\n";
        break;
      }
      case Shape::Kind::ellipsoid:
        node = "ellipsoid body { x " + print_value(s.size[0]) + "  y " + print_value(s.size[1]) +
               "  z " + print_value(s.size[2]) + " }\n";
        break;
      case Shape::Kind::mesh: node = "mesh " + tuple(s.scale) + s.path; break;
    }
    const std::string look = material(s);
    std::string& known = solids_[{node, look}];
    if (!known.empty()) return known;
    const bool is_mesh = s.kind == Shape::Kind::mesh;
    const std::string name = solid_names_.take(
        on + "_" + (is_mesh ? std::filesystem::path(s.path).stem().string() : "shape"), "shape");
    std::string record = "robomosp solid 1\nname " + text(name) + "\n";
    if (!look.empty()) record += "material " + text(look) + "\n";
    if (is_mesh) {
      if (s.mesh) out_.geometries.push_back({name + ".ply", written(*s.mesh, s.scale)});
      else out_.foreign.push_back({name + ".ply", s.path, s.scale, "m"});
      node = "imported body { geometry " + text(name + ".ply") + "  source " +
             text(std::filesystem::path(s.path).filename().string()) + " }\n";
    }
    out_.records.push_back({name + ".csg", record + node});
    return known = name + ".csg";
  }

  /// The file of the material of a shape's colour; "" without one.
  std::string material(const Shape& s) {
    if (!s.colour) return {};
    const auto tone = [](float x) {
      const double v = std::isfinite(x) ? std::clamp(static_cast<double>(x), 0.0, 1.0) : 0.0;
      return print_value(std::round(v * 1e4) / 1e4);
    };
    const Colour& c = *s.colour;
    std::string colour = "colour (" + tone(c.r) + ", " + tone(c.g) + ", " + tone(c.b);
    if (c.a < 1) colour += ", " + tone(c.a);
    colour += ")\n";
    std::string& file = looks_of_[colour];
    if (!file.empty()) return file;
    ++looks_;
    const std::string name = material_names_.take(
        valid_name(options_.name.empty() ? m_.name : options_.name, "robot") + "_colour", "colour");
    file = name + ".mtr";
    out_.records.push_back({file, "robomosp material 1\nname " + text(name) + "\ndescription " +
                                      text("Colour from " + options_.source) + "\ndensity 0\n" +
                                      colour});
    return file;
  }

  Mechanism m_;
  bool has_shapes_ = false;  ///< the file gives bodies
  const Options& options_;
  Imported out_;
  std::vector<std::size_t> order_;
  std::vector<std::string> body_names_, renamed_;
  std::map<std::string, std::string> joint_links_;
  Names solid_names_, material_names_, loop_names_, pose_names_;
  std::map<std::pair<std::string, std::string>, std::string> solids_;
  std::map<std::string, std::string> looks_of_;
  std::size_t looks_ = 0;
};

}  // namespace

Result<Imported> records(Mechanism m, const Options& options) {
  return Recorder(std::move(m), options).run();
}

}  // namespace robomosp::robot_files
