// SPDX-License-Identifier: Apache-2.0
// MJCF (https://mujoco.readthedocs.io/en/stable/XMLreference.html): bodies nested in bodies, each
// with its joints; attributes that an element lacks come from its class of defaults.
#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "read.h"
#include "shape_mass.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::import_urdf {
namespace {

using Attributes = std::map<std::string, std::string, std::less<>>;
struct Defaults {
  std::map<std::string, Attributes, std::less<>> elements;
};

class Reader {
 public:
  Reader(const Element& root, const Options& options) : root_(root), options_(options) {}

  Result<Mechanism> run() {
    m_.name = std::string(word(root_, "model"));
    RMP_TRY(check_children());
    RMP_TRY(compiler());
    defaults_["main"];
    for (const Element* e = root_.FirstChildElement("default"); e;
         e = e->NextSiblingElement("default"))
      RMP_TRY(read_defaults(*e));
    RMP_TRY(assets());
    for (const Element* e = root_.FirstChildElement("worldbody"); e;
         e = e->NextSiblingElement("worldbody"))
      RMP_TRY(bodies(*e));
    for (const Element* e = root_.FirstChildElement("actuator"); e;
         e = e->NextSiblingElement("actuator"))
      RMP_TRY(actuators(*e));
    for (const Element* e = root_.FirstChildElement("equality"); e;
         e = e->NextSiblingElement("equality"))
      RMP_TRY(equalities(*e));
    tell();
    return std::move(m_);
  }

 private:
  struct Mesh {
    std::string file;
    Vec3 scale{1, 1, 1};
  };
  struct Geom {
    Shape shape;
    bool is_drawn = true, collides = true;
  };

  // --- what stands above the bodies ----------------------------------------------------------

  Result<void> check_children() {
    const std::set<std::string_view> known{"compiler", "default", "asset", "worldbody", "actuator",
                                           "equality", "option",  "size",  "statistic", "visual"};
    std::set<std::string> others;
    for (const Element* e = root_.FirstChildElement(); e; e = e->NextSiblingElement()) {
      const std::string_view n = e->Name();
      if (n == "include")
        return fault(*e, "it includes another file",
                     "Save it as one file from MuJoCo first (mj_saveLastXML).");
      if (!known.contains(n)) others.insert(std::string(n).substr(0, 40));
    }
    for (const std::string& n : others) m_.notes.push_back("Elements <" + n + "> were left out.");
    return {};
  }

  Result<void> compiler() {
    for (const Element* e = root_.FirstChildElement("compiler"); e;
         e = e->NextSiblingElement("compiler")) {
      if (word(*e, "angle") == "radian") degrees_ = false;
      if (word(*e, "angle") == "degree") degrees_ = true;
      if (word(*e, "coordinate") == "global")
        return fault(*e, "its coordinates are global", "Save it with a newer MuJoCo first.");
      autolimits_ = is_yes(word(*e, "autolimits"), autolimits_);
      if (has(*e, "eulerseq")) sequence_ = std::string(word(*e, "eulerseq"));
      if (has(*e, "assetdir")) mesh_folder_ = std::string(word(*e, "assetdir"));
      if (has(*e, "meshdir")) mesh_folder_ = std::string(word(*e, "meshdir"));
      if (has(*e, "inertiafromgeom")) from_geoms_ = std::string(word(*e, "inertiafromgeom"));
      for (const char* a : {"settotalmass", "boundmass", "boundinertia", "balanceinertia"})
        if (has(*e, a))
          m_.notes.push_back("The compiler's " + std::string(a) + " was not applied.");
    }
    if (sequence_.size() != 3 || sequence_.find_first_not_of("xyzXYZ") != std::string::npos)
      return fault(root_, in_quotes(sequence_) + " is no sequence of Euler angles",
                   "It is three of x, y, z, X, Y and Z.");
    return {};
  }

  Result<void> read_defaults(const Element& top) {
    struct Open {
      const Element* e;
      std::string above;
    };
    std::vector<Open> stack{{&top, "main"}};
    while (!stack.empty()) {
      const Open open = stack.back();
      stack.pop_back();
      const std::string name =
          has(*open.e, "class") ? std::string(word(*open.e, "class")) : std::string("main");
      Defaults made = defaults_[open.above];
      if (defaults_.size() > kMostBodies) return fault(*open.e, "there are too many defaults");
      for (const Element* e = open.e->FirstChildElement(); e; e = e->NextSiblingElement()) {
        if (std::string_view(e->Name()) == "default") {
          stack.push_back({e, name});
          continue;
        }
        Attributes& to = made.elements[e->Name()];
        for (const auto* a = e->FirstAttribute(); a; a = a->Next()) to[a->Name()] = a->Value();
      }
      // A class's children see it as it is now.
      defaults_[name] = std::move(made);
    }
    return {};
  }

  Result<void> assets() {
    for (const Element* a = root_.FirstChildElement("asset"); a;
         a = a->NextSiblingElement("asset")) {
      for (const Element* e = a->FirstChildElement("mesh"); e; e = e->NextSiblingElement("mesh")) {
        const std::string cls = class_of(*e, "main");
        Mesh mesh;
        mesh.file = std::string(value(*e, cls, "file"));
        RMP_TRY(list(*e, cls, "scale", mesh.scale));
        for (const double k : mesh.scale)
          if (k == 0 || std::fabs(k) > 1e6)
            return fault(*e, "a mesh cannot be scaled by this number", "Give 1 1 1.");
        if (has(*e, "refpos") || has(*e, "refquat"))
          m_.notes.emplace_back("A mesh's refpos and refquat were not applied.");
        std::string name(word(*e, "name"));
        if (name.empty()) name = std::filesystem::path(mesh.file).stem().string();
        meshes_[name] = std::move(mesh);
      }
      for (const Element* e = a->FirstChildElement("material"); e;
           e = e->NextSiblingElement("material")) {
        const std::string cls = class_of(*e, "main");
        if (value(*e, cls, "rgba").empty()) continue;
        RMP_TRY_ASSIGN(looks_[std::string(word(*e, "name"))], colour(*e, cls));
      }
    }
    return {};
  }

  // --- attributes ------------------------------------------------------------------------------

  std::string class_of(const Element& e, const std::string& otherwise) const {
    return has(e, "class") ? std::string(word(e, "class")) : otherwise;
  }
  /// The attribute of the element, or of its class of defaults, or "".
  std::string_view value(const Element& e, const std::string& cls, const char* attribute,
                         const char* element = nullptr) const {
    if (has(e, attribute)) return word(e, attribute);
    const auto d = defaults_.find(cls);
    if (d == defaults_.end()) return {};
    const auto of = d->second.elements.find(std::string_view(element ? element : e.Name()));
    if (of == d->second.elements.end()) return {};
    const auto a = of->second.find(attribute);
    return a == of->second.end() ? std::string_view() : std::string_view(a->second);
  }
  Result<void> list(const Element& e, const std::string& cls, const char* attribute,
                    std::span<double> out) const {
    const std::string_view v = value(e, cls, attribute);
    if (!v.empty()) RMP_TRY(read(e, v, attribute, out));
    return {};
  }
  /// The first number, as some attributes may have further ones.
  Result<double> first(const Element& e, const std::string& cls, const char* attribute,
                       double otherwise) const {
    const std::string_view v = value(e, cls, attribute);
    if (v.empty()) return otherwise;
    RMP_TRY_ASSIGN(const auto n, numbers(e, v, attribute));
    if (n.empty() || std::fabs(n[0]) > kGreatest)
      return fault(e, std::string(attribute) + " is no number of a robot", "Correct the file.");
    return n[0];
  }
  Result<Colour> colour(const Element& e, const std::string& cls) const {
    std::array<double, 4> c{};
    RMP_TRY(list(e, cls, "rgba", c));
    return Colour{static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]),
                  static_cast<float>(c[3])};
  }
  [[nodiscard]] double angle(double v) const { return degrees_ ? v * (std::numbers::pi / 180) : v; }

  Result<Pose> pose(const Element& e, const std::string& cls) const {
    Pose t;
    RMP_TRY(list(e, cls, "pos", t.p));
    if (!value(e, cls, "quat").empty()) {
      std::array<double, 4> q{};
      RMP_TRY(list(e, cls, "quat", q));
      if (!(std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3])) > 1e-9))
        return fault(e, "its quaternion has no length", "The neutral one is 1 0 0 0.");
      t.R = spatial::from_quaternion({q[0], q[1], q[2], q[3]});
    } else if (!value(e, cls, "axisangle").empty()) {
      std::array<double, 4> a{};
      RMP_TRY(list(e, cls, "axisangle", a));
      RMP_TRY_ASSIGN(const Vec3 axis, unit_vector(e, {a[0], a[1], a[2]}));
      t.R = spatial::from_axis_angle(axis, angle(a[3]));
    } else if (!value(e, cls, "euler").empty()) {
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
    } else if (!value(e, cls, "xyaxes").empty()) {
      std::array<double, 6> a{};
      RMP_TRY(list(e, cls, "xyaxes", a));
      RMP_TRY_ASSIGN(const Vec3 x, unit_vector(e, {a[0], a[1], a[2]}));
      Vec3 y{a[3], a[4], a[5]};
      y = spatial::sub(y, spatial::scale(x, spatial::dot(x, y)));
      RMP_TRY_ASSIGN(y, unit_vector(e, y));
      const Vec3 z = spatial::cross(x, y);
      t.R = {x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]};
    } else if (!value(e, cls, "zaxis").empty()) {
      Vec3 z{};
      RMP_TRY(list(e, cls, "zaxis", z));
      RMP_TRY_ASSIGN(z, unit_vector(e, z));
      t.R = turn_z_to(z);
    }
    return t;
  }

  /// The least rotation that takes z to a unit vector.
  static std::array<double, 9> turn_z_to(const Vec3& to) {
    const Vec3 axis{0.0 - to[1], to[0], 0};
    const double sine = spatial::norm(axis);
    if (sine < 1e-12) return to[2] > 0 ? Pose{}.R : spatial::rotation_x(std::numbers::pi).R;
    return spatial::from_axis_angle(axis, std::atan2(sine, to[2]));
  }

  // --- bodies ----------------------------------------------------------------------------------

  Result<void> bodies(const Element& world) {
    struct Open {
      const Element* e;
      std::int32_t body;  ///< whose content stands in e; -1 = the ground
      Pose frame;         ///< body_T_frame of a <frame>
      std::string cls;
    };
    std::vector<Open> stack{{&world, -1, {}, "main"}};
    while (!stack.empty()) {
      const Open open = stack.back();
      stack.pop_back();
      const std::string cls =
          has(*open.e, "childclass") ? std::string(word(*open.e, "childclass")) : open.cls;
      std::vector<Open> inside;
      std::vector<Geom>& geoms = geoms_[open.body];
      for (const Element* e = open.e->FirstChildElement(); e; e = e->NextSiblingElement()) {
        const std::string_view kind = e->Name();
        if (kind == "body") {
          RMP_TRY_ASSIGN(const std::int32_t made, body(*e, open.body, open.frame));
          inside.push_back({e, made, {}, cls});
        } else if (kind == "frame") {
          RMP_TRY_ASSIGN(const Pose at, pose(*e, {}));
          inside.push_back({e, open.body, spatial::compose(open.frame, at), cls});
        } else if (kind == "geom") {
          RMP_TRY(geom(*e, class_of(*e, cls), open.body, open.frame, geoms));
        } else if (kind == "joint" || kind == "freejoint") {
          if (open.body < 0) return fault(*e, "the world cannot have joints");
          RMP_TRY(joint(*e, class_of(*e, cls), open.body, open.frame));
        } else if (kind == "inertial") {
          if (open.body >= 0) RMP_TRY(inertial(*e, open.body, open.frame));
        } else if (kind == "include") {
          return fault(*e, "it includes another file",
                       "Save it as one file from MuJoCo first (mj_saveLastXML).");
        } else {
          ++others_[std::string(kind).substr(0, 40)];
        }
      }
      for (std::size_t i = inside.size(); i-- > 0;) stack.push_back(std::move(inside[i]));
    }
    for (auto& [index, geoms] : geoms_) finish(index, geoms);
    geoms_.clear();
    return {};
  }

  Result<std::int32_t> body(const Element& e, std::int32_t parent, const Pose& frame) {
    if (m_.bodies.size() >= kMostBodies) return fault(e, "there are more than 10000 bodies");
    Body b;
    b.name = std::string(word(e, "name"));
    if (b.name.empty()) b.name = "body_" + std::to_string(m_.bodies.size() + 1);
    b.parent = parent;
    RMP_TRY_ASSIGN(const Pose at, pose(e, {}));
    b.rest = spatial::compose(frame, at);
    const auto index = static_cast<std::int32_t>(m_.bodies.size());
    if (!index_.emplace(b.name, index).second)
      return fault(e, "body " + in_quotes(b.name) + " stands twice", "Rename one of them.");
    world_.push_back(
        parent < 0 ? b.rest : spatial::compose(world_[static_cast<std::size_t>(parent)], b.rest));
    m_.bodies.push_back(std::move(b));
    return index;
  }

  Result<void> inertial(const Element& e, std::int32_t body, const Pose& frame) {
    MassProperties m;
    RMP_TRY_ASSIGN(const Pose at, pose(e, {}));
    RMP_TRY_ASSIGN(m.mass, first(e, {}, "mass", 0));
    if (has(e, "fullinertia")) {
      std::array<double, 6> v{};
      RMP_TRY(list(e, {}, "fullinertia", v));
      m.inertia = {v[0], v[1], v[2], v[3], v[5], v[4]};  // xx yy zz xy xz yz
    } else if (has(e, "diaginertia")) {
      Vec3 v{};
      RMP_TRY(list(e, {}, "diaginertia", v));
      m.inertia = {v[0], v[1], v[2]};
    }
    m_.bodies[static_cast<std::size_t>(body)].mass =
        spatial::in_frame(m, spatial::compose(frame, at));
    return {};
  }

  Result<void> joint(const Element& e, const std::string& cls, std::int32_t index,
                     const Pose& frame) {
    Body& b = m_.bodies[static_cast<std::size_t>(index)];
    if (++joints_ > kMostBodies) return fault(e, "there are more than 10000 joints");
    Joint j;
    j.name = std::string(word(e, "name"));
    if (j.name.empty())
      j.name = b.name + "_joint" + (b.joints.empty() ? "" : std::to_string(b.joints.size() + 1));
    if (!joint_names_.insert(j.name).second)
      return fault(e, "joint " + in_quotes(j.name) + " stands twice", "Rename one of them.");
    const bool is_free = std::string_view(e.Name()) == "freejoint";
    const std::string_view type = is_free ? "free" : value(e, cls, "type");
    if (type.empty() || type == "hinge") j.kind = Joint::Kind::revolute;
    else if (type == "slide") j.kind = Joint::Kind::prismatic;
    else if (type == "ball") j.kind = Joint::Kind::spherical;
    else if (type == "free") j.kind = Joint::Kind::free;
    else
      return fault(e, in_quotes(type) + " is not a type of joint",
                   "Types are hinge, slide, ball and free.");
    if (is_free || j.kind == Joint::Kind::free) {
      j.passive = true;
      b.joints.push_back(std::move(j));
      return {};
    }
    RMP_TRY(list(e, cls, "pos", j.anchor));
    j.anchor = spatial::transform(frame, j.anchor);
    if (j.kind != Joint::Kind::spherical) {
      RMP_TRY(list(e, cls, "axis", j.axis));
      RMP_TRY_ASSIGN(const Vec3 axis, unit_vector(e, j.axis));
      j.axis = spatial::rotate(frame, axis);
    }
    // A slide's anchor does not matter.
    if (j.kind == Joint::Kind::prismatic) j.anchor = {};
    RMP_TRY(joint_numbers(e, cls, j));
    b.joints.push_back(std::move(j));
    return {};
  }

  Result<void> joint_numbers(const Element& e, const std::string& cls, Joint& j) {
    RMP_TRY_ASSIGN(j.viscous, first(e, cls, "damping", 0));
    RMP_TRY_ASSIGN(j.coulomb, first(e, cls, "frictionloss", 0));
    RMP_TRY_ASSIGN(j.armature, first(e, cls, "armature", 0));
    RMP_TRY_ASSIGN(j.stiffness, first(e, cls, "stiffness", 0));
    const auto of_joint = [&](double v) { return j.kind == Joint::Kind::prismatic ? v : angle(v); };
    RMP_TRY_ASSIGN(double ref, first(e, cls, "ref", 0));
    RMP_TRY_ASSIGN(const double spring, first(e, cls, "springref", 0));
    ref = of_joint(ref);
    j.rest = of_joint(spring) - ref;
    if (ref != 0)
      m_.notes.push_back("The value of joint " + in_quotes(j.name) +
                         " counts from where the file shows it, not from its ref.");
    const std::string_view range = value(e, cls, "range"), limited = value(e, cls, "limited");
    if (!range.empty() && (limited == "true" || (limited != "false" && autolimits_))) {
      std::array<double, 2> r{};
      RMP_TRY(list(e, cls, "range", r));
      j.lower = of_joint(r[0]) - ref;
      j.upper = of_joint(r[1]) - ref;
    }
    if (!value(e, cls, "actuatorfrcrange").empty()) {
      std::array<double, 2> r{};
      RMP_TRY(list(e, cls, "actuatorfrcrange", r));
      j.max_force = std::min(std::fabs(r[0]), std::fabs(r[1]));
    }
    return {};
  }

  // --- geoms -----------------------------------------------------------------------------------

  Result<void> geom(const Element& e, const std::string& cls, std::int32_t body, const Pose& frame,
                    std::vector<Geom>& to) {
    if (++shapes_ > kMostShapes) return fault(e, "there are more than 100000 geoms");
    Geom g;
    const std::string_view type = value(e, cls, "type");
    const std::string_view mesh = value(e, cls, "mesh");
    if (type.empty() || type == "sphere")
      g.shape.kind = type.empty() && !mesh.empty() ? Shape::Kind::mesh : Shape::Kind::sphere;
    else if (type == "box") g.shape.kind = Shape::Kind::box;
    else if (type == "capsule") g.shape.kind = Shape::Kind::capsule;
    else if (type == "cylinder") g.shape.kind = Shape::Kind::cylinder;
    else if (type == "ellipsoid") g.shape.kind = Shape::Kind::ellipsoid;
    else if (type == "mesh") g.shape.kind = Shape::Kind::mesh;
    else {
      ++others_["geom type=" + in_quotes(type)];
      return {};
    }
    RMP_TRY_ASSIGN(g.shape.pose, pose(e, cls));
    RMP_TRY(geom_size(e, cls, g.shape));
    g.shape.pose = spatial::compose(frame, g.shape.pose);
    const auto number_or = [&](const char* a, double otherwise) {
      return first(e, cls, a, otherwise);
    };
    RMP_TRY_ASSIGN(const double contype, number_or("contype", 1));
    RMP_TRY_ASSIGN(const double conaffinity, number_or("conaffinity", 1));
    RMP_TRY_ASSIGN(const double group, number_or("group", 0));
    g.collides = contype != 0 || conaffinity != 0;
    g.is_drawn = group < 3;  // the viewer hides groups from 3 on
    if (!value(e, cls, "rgba").empty()) {
      RMP_TRY_ASSIGN(g.shape.colour, colour(e, cls));
    } else if (const auto it = looks_.find(std::string(value(e, cls, "material")));
               it != looks_.end()) {
      g.shape.colour = it->second;
    }
    RMP_TRY(weigh(e, cls, body, g.shape));
    if (g.shape.kind == Shape::Kind::mesh) {
      const auto it = meshes_.find(std::string(mesh));
      if (it == meshes_.end())
        return fault(e, "mesh " + in_quotes(mesh) + " is not among the assets",
                     "Add it as <mesh> to <asset>.");
      const std::filesystem::path folder = options_.folder / mesh_folder_;
      const std::filesystem::path file = mesh_file(it->second.file, folder);
      if (file.empty()) {
        missing_.insert(it->second.file);
        return {};
      }
      g.shape.path = file.string();
      g.shape.scale = it->second.scale;
    }
    to.push_back(std::move(g));
    return {};
  }

  Result<void> geom_size(const Element& e, const std::string& cls, Shape& s) {
    if (s.kind == Shape::Kind::mesh) return {};
    Vec3 half{};
    const std::string_view text = value(e, cls, "size");
    if (!text.empty()) {
      RMP_TRY_ASSIGN(const auto n, numbers(e, text, "size"));
      for (std::size_t i = 0; i < n.size() && i < 3; ++i) half[i] = n[i];
    }
    double length = 2 * half[1];
    const bool is_long = s.kind == Shape::Kind::capsule || s.kind == Shape::Kind::cylinder;
    if (!value(e, cls, "fromto").empty()) {
      std::array<double, 6> f{};
      RMP_TRY(list(e, cls, "fromto", f));
      const Vec3 from{f[0], f[1], f[2]}, to{f[3], f[4], f[5]};
      const Vec3 way = spatial::sub(to, from);
      RMP_TRY_ASSIGN(const Vec3 axis, unit_vector(e, way));
      length = spatial::norm(way);
      s.pose.p = spatial::scale(spatial::add(from, to), 0.5);
      s.pose.R = turn_z_to(axis);
      if (!is_long) half = {half[0], s.kind == Shape::Kind::box ? half[0] : half[0], length / 2};
    }
    if (is_long) s.size = {half[0], length, 0};
    else if (s.kind == Shape::Kind::sphere) s.size = {half[0], 0, 0};
    else if (s.kind == Shape::Kind::box) s.size = spatial::scale(half, 2);
    else s.size = half;
    for (const double v : s.size)
      if (!(std::fabs(v) <= 1e6)) return fault(e, "a size is beyond 1e6 m", "Correct the file.");
    return {};
  }

  /// What the geom adds to the inertia that is made of geoms.
  Result<void> weigh(const Element& e, const std::string& cls, std::int32_t body,
                     const Shape& shape) {
    if (body < 0) return {};
    RMP_TRY_ASSIGN(const double density, first(e, cls, "density", 1000));
    RMP_TRY_ASSIGN(const double mass, first(e, cls, "mass", -1));
    if (mass == 0 || (mass < 0 && density == 0)) return {};
    auto m = shape_mass(shape);
    if (!m) {
      unweighed_.insert(body);
      return {};
    }
    const double factor = mass > 0 ? mass / m->mass : density;
    m->mass *= factor;
    m->inertia = spatial::scale(m->inertia, factor);
    geom_masses_[body].push_back(*m);
    return {};
  }

  void finish(std::int32_t index, std::vector<Geom>& geoms) {
    std::vector<Shape>& to =
        index < 0 ? m_.ground : m_.bodies[static_cast<std::size_t>(index)].shapes;
    const auto wanted = [&](const Geom& g) { return options_.collision ? g.collides : g.is_drawn; };
    const bool has_wanted = std::any_of(geoms.begin(), geoms.end(), wanted);
    for (Geom& g : geoms) {
      if (has_wanted && !wanted(g)) {
        ++other_geoms_;
        continue;
      }
      to.push_back(std::move(g.shape));
    }
    if (index < 0) return;
    Body& b = m_.bodies[static_cast<std::size_t>(index)];
    const bool infers = from_geoms_ == "true" || (from_geoms_ != "false" && !b.mass);
    if (!infers) return;
    b.mass.reset();
    if (unweighed_.contains(index)) without_mass_.push_back(b.name);
    else if (const auto it = geom_masses_.find(index); it != geom_masses_.end()) {
      b.mass = spatial::combine(it->second);
      ++inferred_;
    }
  }

  // --- actuators and equalities ----------------------------------------------------------------

  Joint* find_joint(std::string_view name) {
    for (Body& b : m_.bodies)
      for (Joint& j : b.joints)
        if (j.name == name) return &j;
    return nullptr;
  }

  Result<void> actuators(const Element& list_of) {
    std::set<std::string> driven;
    std::vector<std::string> geared;
    for (const Element* e = list_of.FirstChildElement(); e; e = e->NextSiblingElement()) {
      const std::string cls = class_of(*e, "main");
      const std::string name(value(*e, cls, "joint"));
      if (name.empty()) {
        ++others_["actuator without joint"];
        continue;
      }
      driven.insert(name);
      RMP_TRY_ASSIGN(const double gear, first(*e, cls, "gear", 1));
      if (gear != 1) geared.push_back(name);
    }
    if (driven.empty()) return {};
    for (Body& b : m_.bodies)
      for (Joint& j : b.joints) j.passive = !driven.contains(j.name);
    m_.notes.emplace_back(
        "Joints with an actuator have a motor, the others are passive; gains and ranges of the "
        "actuators were left out.");
    if (!geared.empty())
      m_.notes.push_back("The gear of the actuators of " + std::to_string(geared.size()) +
                         " joints, such as " + in_quotes(geared[0]) +
                         ", was left out: torques count at the joint.");
    return {};
  }

  Result<void> equalities(const Element& list_of) {
    for (const Element* e = list_of.FirstChildElement(); e; e = e->NextSiblingElement()) {
      const std::string_view kind = e->Name();
      const std::string cls = class_of(*e, "main");
      if (value(*e, cls, "active") == "false") {
        m_.notes.push_back("An inactive equality <" + std::string(kind).substr(0, 40) +
                           "> was left out.");
      } else if (kind == "joint") {
        RMP_TRY(coupling(*e, cls));
      } else if ((kind == "connect" || kind == "weld") && has(*e, "body1")) {
        RMP_TRY(loop(*e, cls, kind == "weld"));
      } else {
        ++others_["equality " + std::string(kind).substr(0, 40)];
      }
    }
    return {};
  }

  Result<void> coupling(const Element& e, const std::string& cls) {
    const std::string first_name(word(e, "joint1")), second(word(e, "joint2"));
    Joint* j = find_joint(first_name);
    if (!j || (!second.empty() && !find_joint(second)))
      return fault(e, "an equality names a joint that is not there", "Name joints of the file.");
    std::array<double, 5> c{0, 1, 0, 0, 0};
    if (const std::string_view v = value(e, cls, "polycoef"); !v.empty()) {
      RMP_TRY_ASSIGN(const auto n, numbers(e, v, "polycoef"));
      for (std::size_t i = 0; i < n.size() && i < 5; ++i) c[i] = n[i];
    }
    for (const double v : c)
      if (!(std::fabs(v) <= kGreatest)) return fault(e, "a coefficient is beyond 1e12");
    if (second.empty()) {
      m_.notes.push_back("Joint " + in_quotes(first_name) +
                         " is held by an equality in the file; it is free here.");
      return {};
    }
    if (c[2] != 0 || c[3] != 0 || c[4] != 0)
      m_.notes.push_back("Joint " + in_quotes(first_name) + " follows " + in_quotes(second) +
                         " by a polynomial; only its linear part was kept.");
    j->follows = second;
    j->offset = c[0];
    j->ratio = c[1];
    return {};
  }

  Result<void> loop(const Element& e, const std::string& cls, bool is_weld) {
    const auto find = [&](const char* which) -> Result<std::int32_t> {
      const std::string name(word(e, which));
      if (name.empty() || name == "world") return -1;
      const auto it = index_.find(name);
      if (it == index_.end())
        return fault(e, "body " + in_quotes(name) + " is not in the file",
                     "Name one of its bodies.");
      return it->second;
    };
    Loop l;
    l.name = std::string(word(e, "name"));
    if (l.name.empty()) l.name = is_weld ? "weld" : "connect";
    RMP_TRY_ASSIGN(l.a, find("body1"));
    RMP_TRY_ASSIGN(l.b, find("body2"));
    const auto at = [&](std::int32_t b) {
      return b < 0 ? Pose{} : world_[static_cast<std::size_t>(b)];
    };
    l.kind = is_weld ? "weld" : "point";
    Vec3 anchor{};
    RMP_TRY(list(e, cls, "anchor", anchor));
    // b_T_a at rest, unless a weld gives it.
    Pose b_T_a = spatial::compose(spatial::inverse(at(l.b)), at(l.a));
    if (is_weld) {
      std::array<double, 7> r{0, 1, 0, 0, 0, 0, 0};
      RMP_TRY(list(e, cls, "relpose", r));
      if (r[3] != 0 || r[4] != 0 || r[5] != 0 || r[6] != 0) {
        Pose a_T_b;
        a_T_b.p = {r[0], r[1], r[2]};
        a_T_b.R = spatial::from_quaternion({r[3], r[4], r[5], r[6]});
        b_T_a = spatial::inverse(a_T_b);
      }
      l.in_b = b_T_a;
    } else {
      l.in_a = spatial::translation(anchor);
      l.in_b = spatial::compose(b_T_a, l.in_a);
    }
    m_.loops.push_back(std::move(l));
    return {};
  }

  void tell() {
    if (inferred_ > 0)
      m_.notes.push_back("The masses of " + std::to_string(inferred_) +
                         (inferred_ == 1 ? " body" : " bodies") +
                         " were computed from the geoms, as the file gives none.");
    for (const std::string& b : without_mass_)
      m_.notes.push_back("Body " + in_quotes(b) +
                         " has no mass: it is to be computed from a mesh. Give it as <inertial>, "
                         "or design it here.");
    if (other_geoms_ > 0)
      m_.notes.push_back(std::to_string(other_geoms_) + " geoms that are not for " +
                         (options_.collision ? "contact" : "show") + " were left out.");
    for (const std::string& f : missing_)
      m_.notes.push_back("Mesh " + in_quotes(f) + " was not found; its shape was left out.");
    for (const auto& [what, n] : others_)
      m_.notes.push_back("Left out: " + what + (n > 1 ? " (" + std::to_string(n) + ")" : "") + ".");
    m_.notes.emplace_back("Links are named by bodies; contact and solver settings were left out.");
  }

  const Element& root_;
  const Options& options_;
  Mechanism m_;
  bool degrees_ = true, autolimits_ = true;
  std::string sequence_ = "xyz", mesh_folder_, from_geoms_ = "auto";
  std::map<std::string, Defaults> defaults_;
  std::map<std::string, Mesh> meshes_;
  std::map<std::string, Colour> looks_;
  std::map<std::string, std::int32_t> index_;
  std::vector<Pose> world_;
  std::map<std::int32_t, std::vector<Geom>> geoms_;
  std::map<std::int32_t, std::vector<MassProperties>> geom_masses_;
  std::set<std::int32_t> unweighed_;
  std::set<std::string> joint_names_, missing_;
  std::map<std::string, std::size_t> others_;
  std::vector<std::string> without_mass_;
  std::size_t joints_ = 0, shapes_ = 0, inferred_ = 0, other_geoms_ = 0;
};

}  // namespace

Result<Mechanism> read_mjcf(const Element& mujoco, const Options& options) {
  return Reader(mujoco, options).run();
}

}  // namespace robomosp::import_urdf
