// SPDX-License-Identifier: Apache-2.0
// MJCF (https://mujoco.readthedocs.io/en/stable/XMLreference.html): bodies nested in bodies, each
// with its joints; attributes that an element lacks come from its class of defaults.
#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <set>

#include "mjcf_couplings.h"
#include "read.h"
#include "shape_mass.h"
#include "spatial/convex_hull.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::robot_files {
namespace {

/// What the mechanism needs of an element, and what only contact, solver, drawing and sensors do,
/// which one sentence reports together. The rest is reported by name.
constexpr std::string_view kSections[] = {
    "compiler", "default", "asset", "worldbody", "actuator", "equality", "keyframe",
    "tendon",   "option",  "size",  "statistic", "visual",   "contact"};
constexpr std::string_view kCompiler[] = {
    "angle",      "autolimits",       "eulerseq",          "meshdir",      "texturedir",
    "assetdir",   "inertiafromgeom",  "inertiagrouprange", "settotalmass", "boundmass",
    "coordinate", "strippath",        "discardvisual",     "usethread",    "convexhull",
    "fusestatic", "exactmeshinertia", "saveinertial",      "conflict"};
constexpr std::string_view kMjcfJoint[] = {
    "name",           "class",          "type",        "pos",       "axis",
    "range",          "limited",        "ref",         "springref", "damping",
    "frictionloss",   "armature",       "stiffness",   "group",     "actuatorfrcrange",
    "margin",         "solreflimit",    "solimplimit", "user",      "actuatorfrclimited",
    "solreffriction", "solimpfriction", "align"};
constexpr std::string_view kBody[] = {"name",  "childclass", "pos",   "quat", "axisangle",
                                      "euler", "xyaxes",     "zaxis", "user", "sleep"};

class MjcfReader {
 public:
  MjcfReader(const Element& root, const Options& options, Documents& documents)
      : root_(root), options_(options), values_(documents, options.folder) {}

  Result<Mechanism> run() {
    m_.name = std::string(word(root_, "model"));
    RMP_TRY_ASSIGN(top_, values_.children(root_));
    for (const Element* e : top_)
      if (std::find(std::begin(kSections), std::end(kSections), std::string_view(e->Name())) ==
          std::end(kSections))
        left_out_.add("<" + std::string(e->Name()).substr(0, 40) + ">");
    for (const Element* e : sections("compiler")) RMP_TRY(compiler(*e));
    for (const Element* e : sections("default")) {
      RMP_TRY(report_defaults(*e));
      RMP_TRY(values_.defaults(*e));
    }
    RMP_TRY(assets());
    for (const Element* e : sections("worldbody")) RMP_TRY(bodies(*e));
    RMP_TRY(scale_masses());
    RMP_TRY_ASSIGN(const auto actuators, inside("actuator"));
    RMP_TRY_ASSIGN(const auto tendons, inside("tendon"));
    RMP_TRY_ASSIGN(const auto equalities, inside("equality"));
    RMP_TRY_ASSIGN(const auto keys, inside("keyframe"));
    RMP_TRY(read_actuators(bodies_, actuators, tendons));
    RMP_TRY(read_equalities(bodies_, equalities));
    RMP_TRY(read_keyframes(bodies_, keys));
    // Fixed tendons count by what their actuators drive.
    constexpr std::string_view kTendon[] = {"name", "class", "group", "margin", "rgba", "width"};
    for (const Element* e : tendons) {
      if (std::string_view(e->Name()) == "fixed") left_out_.attributes(*e, kTendon);
      else left_out_.add("<" + std::string(e->Name()).substr(0, 40) + "> in <tendon>");
    }
    RMP_TRY(values_.check_classes());
    tell();
    return std::move(m_);
  }

 private:
  struct Mesh {
    std::string file;
    std::shared_ptr<const MeshFile> corners;  ///< of one without a file
    Vec3 scale{1, 1, 1};
    std::optional<MeshInertia> rule;
  };
  struct Geom {
    Shape shape;
    bool is_drawn = true, collides = true;
  };

  // --- what stands above the bodies ----------------------------------------------------------

  std::vector<const Element*> sections(std::string_view name) const {
    std::vector<const Element*> out;
    for (const Element* e : top_)
      if (e->Name() == name) out.push_back(e);
    return out;
  }
  /// The elements inside all sections of a name.
  Result<std::vector<const Element*>> inside(std::string_view name) const {
    std::vector<const Element*> out;
    for (const Element* s : sections(name)) {
      RMP_TRY_ASSIGN(const auto all, values_.children(*s));
      out.insert(out.end(), all.begin(), all.end());
    }
    return out;
  }

  Result<void> compiler(const Element& e) {
    RMP_TRY(values_.compiler(e));
    left_out_.attributes(e, kCompiler);
    if (has(e, "assetdir")) mesh_folder_ = std::string(word(e, "assetdir"));
    if (has(e, "meshdir")) mesh_folder_ = std::string(word(e, "meshdir"));
    if (has(e, "inertiafromgeom")) from_geoms_ = std::string(word(e, "inertiafromgeom"));
    if (is_yes(word(e, "exactmeshinertia"), false)) rule_ = MeshInertia::exact;
    strips_paths_ = is_yes(word(e, "strippath"), strips_paths_);
    RMP_TRY_ASSIGN(total_mass_, number(e, "settotalmass", total_mass_));
    RMP_TRY_ASSIGN(least_mass_, number(e, "boundmass", least_mass_));
    if (std::fabs(total_mass_) > kGreatest || std::fabs(least_mass_) > kGreatest)
      return fault(e, "a mass is beyond 1e12 kg");
    if (has(e, "inertiagrouprange"))
      RMP_TRY(read(e, word(e, "inertiagrouprange"), "range", groups_));
    return {};
  }

  /// Springs and dampers by time constants and such may stand in the defaults of any class.
  Result<void> report_defaults(const Element& top) {
    std::vector<const Element*> stack{&top};
    while (!stack.empty()) {
      const Element& e = *stack.back();
      stack.pop_back();
      RMP_TRY_ASSIGN(const auto all, values_.children(e));
      for (const Element* c : all) {
        if (std::string_view(c->Name()) == "joint") left_out_.attributes(*c, kMjcfJoint);
        if (std::string_view(c->Name()) == "default") stack.push_back(c);
      }
    }
    return {};
  }

  /// A mesh whose corners stand in the file: with its faces, or else their convex hull. Null when
  /// there are none.
  Result<std::shared_ptr<const MeshFile>> written_mesh(const Element& e, const std::string& cls) {
    const std::string_view vertex = values_.value(e, cls, "vertex");
    if (vertex.empty()) return std::shared_ptr<const MeshFile>();
    auto m = std::make_shared<MeshFile>();
    RMP_TRY_ASSIGN(m->points, numbers(e, vertex, "vertex"));
    if (m->points.size() % 3 != 0)
      return fault(e, "its vertices are not three numbers each", "Correct vertex=\"...\".");
    const std::string_view face = values_.value(e, cls, "face");
    if (!face.empty()) {
      RMP_TRY_ASSIGN(const auto corners, numbers(e, face, "face"));
      const auto count = static_cast<double>(m->points.size() / 3);
      for (const double i : corners) {
        if (!(i >= 0 && i < count && i == std::floor(i)))
          return fault(e, "a face refers to a missing vertex", "They are numbered from 0.");
        m->triangles.push_back(static_cast<std::uint32_t>(i));
      }
      if (m->triangles.size() % 3 != 0)
        return fault(e, "its faces are not three vertices each", "Correct face=\"...\".");
      return std::shared_ptr<const MeshFile>(std::move(m));
    }
    std::vector<Vec3> points;
    for (std::size_t i = 0; i + 2 < m->points.size(); i += 3)
      points.push_back({m->points[i], m->points[i + 1], m->points[i + 2]});
    const auto hull = spatial::convex_hull(points);
    if (!hull)
      return fault(e, "its vertices lie in a plane, so it encloses no volume",
                   "Correct vertex=\"...\".");
    *m = {};
    for (const Vec3& p : hull->points) m->points.insert(m->points.end(), p.begin(), p.end());
    for (const auto& t : hull->triangles)
      m->triangles.insert(m->triangles.end(), t.begin(), t.end());
    return std::shared_ptr<const MeshFile>(std::move(m));
  }

  Result<void> assets() {
    RMP_TRY_ASSIGN(const auto all, inside("asset"));
    for (const Element* e : all) {
      const std::string_view kind = e->Name();
      const std::string cls = values_.class_of(*e, "main");
      if (kind == "mesh") {
        Mesh mesh;
        mesh.file = std::string(values_.value(*e, cls, "file"));
        if (strips_paths_) mesh.file = std::filesystem::path(mesh.file).filename().string();
        RMP_TRY(values_.list(*e, cls, "scale", mesh.scale));
        for (const double k : mesh.scale)
          if (k == 0 || std::fabs(k) > 1e6)
            return fault(*e, "a mesh cannot be scaled by this number", "Give 1 1 1.");
        const std::string_view rule = values_.value(*e, cls, "inertia");
        if (rule == "exact") mesh.rule = MeshInertia::exact;
        else if (rule == "convex") mesh.rule = MeshInertia::convex;
        else if (rule == "shell") mesh.rule = MeshInertia::shell;
        else if (rule == "legacy") mesh.rule = MeshInertia::legacy;
        else if (!rule.empty())
          return fault(*e, in_quotes(rule) + " is not a kind of inertia",
                       "Kinds are convex, exact, legacy and shell.");
        for (const char* a : {"refpos", "refquat"})
          if (has(*e, a)) left_out_.add(std::string(a) + " of <mesh>");
        std::string name(word(*e, "name"));
        if (name.empty()) name = std::filesystem::path(mesh.file).stem().string();
        if (mesh.file.empty()) {
          RMP_TRY_ASSIGN(mesh.corners, written_mesh(*e, cls));
        }
        meshes_[name] = std::move(mesh);
      } else if (kind == "material") {
        if (values_.value(*e, cls, "rgba").empty()) continue;
        RMP_TRY_ASSIGN(looks_[std::string(word(*e, "name"))], values_.colour(*e, cls));
      } else if (kind != "texture") {
        left_out_.add("<" + std::string(kind).substr(0, 40) + "> in <asset>");
      }
    }
    return {};
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
      Open open = std::move(stack.back());
      stack.pop_back();
      const Element& at = *open.e;
      if (std::string_view(at.Name()) == "body") {
        RMP_TRY_ASSIGN(open.body, body(at, open.body, open.frame));
        open.frame = {};
      } else if (&at != &world) {
        RMP_TRY_ASSIGN(const Pose t, values_.pose(at, {}));
        open.frame = spatial::compose(open.frame, t);
      }
      const std::string cls = has(at, "childclass") ? values_.class_of(at, open.cls) : open.cls;
      std::vector<Open> inside;
      RMP_TRY_ASSIGN(const auto all, values_.children(at));
      for (const Element* e : all) {
        const std::string_view kind = e->Name();
        const std::string own = values_.class_of(*e, cls);
        if (kind == "body" || kind == "frame") {
          inside.push_back({e, open.body, open.frame, cls});
        } else if (kind == "geom") {
          RMP_TRY(geom(*e, own, open.body, open.frame, geoms_[open.body]));
        } else if (kind == "joint" || kind == "freejoint") {
          if (open.body < 0)
            return fault(*e, "the world cannot have joints", "Put it into a body.");
          RMP_TRY(joint(*e, own, open.body, open.frame));
        } else if (kind == "inertial") {
          if (open.body >= 0) RMP_TRY(inertial(*e, open.body, open.frame));
        } else if (kind == "site") {
          RMP_TRY_ASSIGN(const Pose t, values_.pose(*e, own));
          bodies_.sites.insert_or_assign(std::string(word(*e, "name")),
                                         std::pair(open.body, spatial::compose(open.frame, t)));
          left_out_.add("<site>");
        } else {
          left_out_.add("<" + std::string(kind).substr(0, 40) + ">");
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
    left_out_.attributes(e, kBody);
    Body b;
    b.name = std::string(word(e, "name"));
    if (b.name.empty()) b.name = "body_" + std::to_string(m_.bodies.size() + 1);
    b.parent = parent;
    RMP_TRY_ASSIGN(const Pose at, values_.pose(e, {}));
    b.rest = spatial::compose(frame, at);
    const auto index = static_cast<std::int32_t>(m_.bodies.size());
    if (!bodies_.index.emplace(b.name, index).second)
      return fault(e, "body " + in_quotes(b.name) + " stands twice", "Rename one of them.");
    bodies_.world.push_back(
        parent < 0 ? b.rest
                   : spatial::compose(bodies_.world[static_cast<std::size_t>(parent)], b.rest));
    m_.bodies.push_back(std::move(b));
    return index;
  }

  Result<void> inertial(const Element& e, std::int32_t body, const Pose& frame) {
    MassProperties m;
    RMP_TRY_ASSIGN(const Pose at, values_.pose(e, {}));
    RMP_TRY_ASSIGN(m.mass, values_.first(e, {}, "mass", 0));
    if (has(e, "fullinertia")) {
      std::array<double, 6> v{};
      RMP_TRY(values_.list(e, {}, "fullinertia", v));
      m.inertia = {v[0], v[1], v[2], v[3], v[5], v[4]};  // xx yy zz xy xz yz
    } else if (has(e, "diaginertia")) {
      Vec3 v{};
      RMP_TRY(values_.list(e, {}, "diaginertia", v));
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
    left_out_.attributes(e, kMjcfJoint);
    const bool is_free = std::string_view(e.Name()) == "freejoint";
    const std::string_view type = is_free ? "free" : values_.value(e, cls, "type");
    if (type.empty() || type == "hinge") j.kind = Joint::Kind::revolute;
    else if (type == "slide") j.kind = Joint::Kind::prismatic;
    else if (type == "ball") j.kind = Joint::Kind::spherical;
    else if (type == "free") j.kind = Joint::Kind::free;
    else
      return fault(e, in_quotes(type) + " is not a type of joint",
                   "Types are hinge, slide, ball and free.");
    if (is_free || j.kind == Joint::Kind::free) {
      j.passive = true;
      if (is_yes(word(e, "align"), false))
        left_out_.add("align of <" + std::string(e.Name()) + ">");
      if (!is_free) RMP_TRY(resistance(e, cls, j));
      b.joints.push_back(std::move(j));
      return {};
    }
    RMP_TRY(values_.list(e, cls, "pos", j.anchor));
    j.anchor = spatial::transform(frame, j.anchor);
    if (j.kind != Joint::Kind::spherical) {
      RMP_TRY(values_.list(e, cls, "axis", j.axis));
      RMP_TRY_ASSIGN(const Vec3 axis, unit_vector(e, j.axis));
      j.axis = spatial::rotate(frame, axis);
    }
    // A slide's anchor does not matter.
    if (j.kind == Joint::Kind::prismatic) j.anchor = {};
    RMP_TRY(joint_numbers(e, cls, j));
    b.joints.push_back(std::move(j));
    return {};
  }

  Result<void> resistance(const Element& e, const std::string& cls, Joint& j) {
    RMP_TRY_ASSIGN(j.viscous, values_.first(e, cls, "damping", 0));
    RMP_TRY_ASSIGN(j.coulomb, values_.first(e, cls, "frictionloss", 0));
    RMP_TRY_ASSIGN(j.armature, values_.first(e, cls, "armature", 0));
    RMP_TRY_ASSIGN(j.stiffness, values_.first(e, cls, "stiffness", 0));
    return {};
  }

  Result<void> joint_numbers(const Element& e, const std::string& cls, Joint& j) {
    RMP_TRY(resistance(e, cls, j));
    const auto of_joint = [&](double v) {
      return j.kind == Joint::Kind::prismatic ? v : values_.angle(v);
    };
    RMP_TRY_ASSIGN(double ref, values_.first(e, cls, "ref", 0));
    RMP_TRY_ASSIGN(const double spring, values_.first(e, cls, "springref", 0));
    ref = of_joint(ref);
    bodies_.refs[j.name] = ref;
    j.rest = of_joint(spring) - ref;
    if (ref != 0)
      m_.notes.push_back("The value of joint " + in_quotes(j.name) +
                         " is measured from the position shown in the file, not from its ref.");
    const std::string_view range = values_.value(e, cls, "range"),
                           limited = values_.value(e, cls, "limited");
    if (!range.empty() && (limited == "true" || (limited != "false" && values_.autolimits()))) {
      std::array<double, 2> r{};
      RMP_TRY(values_.list(e, cls, "range", r));
      j.lower = of_joint(r[0]) - ref;
      j.upper = of_joint(r[1]) - ref;
    }
    const std::string_view force = values_.value(e, cls, "actuatorfrclimited");
    if (!values_.value(e, cls, "actuatorfrcrange").empty() &&
        (force == "true" || (force != "false" && values_.autolimits()))) {
      std::array<double, 2> r{};
      RMP_TRY(values_.list(e, cls, "actuatorfrcrange", r));
      j.max_force = std::max(std::fabs(r[0]), std::fabs(r[1]));
    }
    return {};
  }

  // --- geoms -----------------------------------------------------------------------------------

  Result<void> geom(const Element& e, const std::string& cls, std::int32_t body, const Pose& frame,
                    std::vector<Geom>& to) {
    if (++shapes_ > kMostShapes) return fault(e, "there are more than 100000 geoms");
    Geom g;
    const std::string_view type = values_.value(e, cls, "type");
    const std::string_view mesh = values_.value(e, cls, "mesh");
    if (type.empty() || type == "sphere")
      g.shape.kind = type.empty() && !mesh.empty() ? Shape::Kind::mesh : Shape::Kind::sphere;
    else if (type == "box") g.shape.kind = Shape::Kind::box;
    else if (type == "capsule") g.shape.kind = Shape::Kind::capsule;
    else if (type == "cylinder") g.shape.kind = Shape::Kind::cylinder;
    else if (type == "ellipsoid") g.shape.kind = Shape::Kind::ellipsoid;
    else if (type == "mesh") g.shape.kind = Shape::Kind::mesh;
    else {
      left_out_.add("<geom> of the type " + in_quotes(type));
      return {};
    }
    if (!mesh.empty() && g.shape.kind != Shape::Kind::mesh) {
      g.shape.kind = Shape::Kind::mesh;
      left_out_.add("fitting a simple shape to a mesh");
    }
    RMP_TRY_ASSIGN(g.shape.pose, values_.pose(e, cls));
    RMP_TRY(geom_size(e, cls, g.shape));
    g.shape.pose = spatial::compose(frame, g.shape.pose);
    const auto number_or = [&](const char* a, double otherwise) {
      return values_.first(e, cls, a, otherwise);
    };
    RMP_TRY_ASSIGN(const double contype, number_or("contype", 1));
    RMP_TRY_ASSIGN(const double conaffinity, number_or("conaffinity", 1));
    RMP_TRY_ASSIGN(const double group, number_or("group", 0));
    g.collides = contype != 0 || conaffinity != 0;
    g.is_drawn = group < 3;  // the viewer hides groups from 3 on
    if (!values_.value(e, cls, "rgba").empty()) {
      RMP_TRY_ASSIGN(g.shape.colour, values_.colour(e, cls));
    } else if (const auto it = looks_.find(std::string(values_.value(e, cls, "material")));
               it != looks_.end()) {
      g.shape.colour = it->second;
    }
    MeshInertia rule = rule_;
    if (g.shape.kind == Shape::Kind::mesh) {
      const auto it = meshes_.find(std::string(mesh));
      if (it == meshes_.end())
        return fault(e, "mesh " + in_quotes(mesh) + " is not among the assets",
                     "Add it as <mesh> to <asset>.");
      if (it->second.corners) {
        g.shape.path = it->first;
        g.shape.mesh = it->second.corners;
      } else if (it->second.file.empty()) {
        left_out_.add("a <mesh> without a file or vertices");
        unweighed_.insert(body);
        return {};
      } else {
        const std::filesystem::path folder = options_.folder / mesh_folder_;
        const std::filesystem::path file = mesh_file(it->second.file, folder, *options_.reach);
        g.shape.path = file.string();
        if (file.empty()) missing_.insert(it->second.file);
      }
      g.shape.scale = it->second.scale;
      rule = it->second.rule.value_or(rule_);
    }
    if (group >= groups_[0] && group <= groups_[1]) RMP_TRY(weigh(e, cls, body, g.shape, rule));
    if (g.shape.kind == Shape::Kind::mesh && g.shape.path.empty()) return {};
    to.push_back(std::move(g));
    return {};
  }

  Result<void> geom_size(const Element& e, const std::string& cls, Shape& s) {
    if (s.kind == Shape::Kind::mesh) return {};
    Vec3 half{};
    const std::string_view text = values_.value(e, cls, "size");
    if (!text.empty()) {
      RMP_TRY_ASSIGN(const auto n, numbers(e, text, "size"));
      for (std::size_t i = 0; i < n.size() && i < 3; ++i) half[i] = n[i];
    }
    double length = 2 * half[1];
    const bool is_long = s.kind == Shape::Kind::capsule || s.kind == Shape::Kind::cylinder;
    if (!values_.value(e, cls, "fromto").empty()) {
      std::array<double, 6> f{};
      RMP_TRY(values_.list(e, cls, "fromto", f));
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
                     const Shape& shape, MeshInertia rule) {
    if (body < 0) return {};
    RMP_TRY_ASSIGN(const double density, values_.first(e, cls, "density", 1000));
    RMP_TRY_ASSIGN(const double mass, values_.first(e, cls, "mass", -1));
    if (mass == 0 || (mass < 0 && density == 0)) return {};
    auto m = shape_mass(shape, mesh_masses_, rule);
    if (!m) {
      unweighed_.insert(body);
      // How much there is is known, though not how it lies about its place.
      if (mass > 0 && mass <= kGreatest) geom_masses_[body].push_back({mass, shape.pose.p, {}});
      return {};
    }
    if (shape.kind == Shape::Kind::mesh && rule == MeshInertia::legacy && mass < 0) {
      if (const auto enclosed = shape_mass(shape, mesh_masses_, MeshInertia::exact)) {
        const double more = m->mass / enclosed->mass - 1;
        if (more > 0.01) ++counted_more_;
        most_more_ = std::max(most_more_, more);
      }
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
    if (const auto it = geom_masses_.find(index); it != geom_masses_.end()) {
      b.mass = spatial::combine(it->second);
      ++inferred_;
    }
  }

  /// boundmass, then settotalmass, of the bodies; inertias of scaled bodies go along.
  Result<void> scale_masses() {
    double total = 0;
    for (Body& b : m_.bodies) {
      if (!b.mass || b.mass->mass <= 0) continue;
      b.mass->mass = std::max(b.mass->mass, least_mass_);
      total += b.mass->mass;
    }
    if (!(total_mass_ > 0) || !(total > 0)) return {};
    const double factor = total_mass_ / total;
    for (Body& b : m_.bodies)
      if (b.mass) {
        b.mass->mass *= factor;
        b.mass->inertia = spatial::scale(b.mass->inertia, factor);
      }
    return {};
  }

  void tell() {
    if (inferred_ > 0)
      m_.notes.push_back("The masses of " + std::to_string(inferred_) +
                         (inferred_ == 1 ? " body" : " bodies") +
                         " were computed from the geoms, since the file gives none.");
    if (counted_more_ > 0)
      m_.notes.push_back(
          "Masses of meshes follow MuJoCo's default rule \"legacy\", which for " +
          std::to_string(counted_more_) + (counted_more_ == 1 ? " geom is" : " geoms is") +
          " up to " + std::to_string(static_cast<long>(std::lround(100 * most_more_))) +
          " % more than they enclose. Set inertia=\"exact\" on their <mesh> for the exact mass.");
    if (!without_mass_.empty())
      m_.notes.push_back("The masses of " + std::to_string(without_mass_.size()) +
                         (without_mass_.size() == 1 ? " body" : " bodies") + ", such as " +
                         in_quotes(without_mass_[0]) +
                         ", lack meshes that were not found, cannot be read, or enclose no volume: "
                         "they have no mass, or a point mass if the file gives one. Give it as "
                         "<inertial>, or design the bodies here.");
    if (other_geoms_ > 0)
      m_.notes.push_back(std::to_string(other_geoms_) + " geoms that are not for " +
                         (options_.collision ? "contact" : "show") + " were left out.");
    tell_missing(missing_, *options_.reach, m_.notes);
    left_out_.tell(m_.notes);
    m_.notes.emplace_back("Links are named by bodies; contact and solver settings were left out.");
  }

  const Element& root_;
  const Options& options_;
  Mechanism m_;
  LeftOut left_out_;
  MjcfValues values_;
  MjcfBodies bodies_{m_, values_, left_out_, {}, {}, {}, {}};
  std::vector<const Element*> top_;  ///< the model's sections
  bool strips_paths_ = false;
  std::string mesh_folder_, from_geoms_ = "auto";
  double total_mass_ = -1, least_mass_ = 0;
  std::array<double, 2> groups_{0, 5};  ///< of geoms that have mass
  std::map<std::string, Mesh> meshes_;
  std::map<std::string, Colour> looks_;
  std::map<std::int32_t, std::vector<Geom>> geoms_;
  std::map<std::int32_t, std::vector<MassProperties>> geom_masses_;
  std::set<std::int32_t> unweighed_;
  MeshMasses mesh_masses_;
  MeshInertia rule_ = MeshInertia::legacy;  ///< of meshes that do not tell
  std::size_t counted_more_ = 0;            ///< geoms of more mass than they enclose
  double most_more_ = 0;
  std::set<std::string> joint_names_, missing_;
  std::vector<std::string> without_mass_;
  std::size_t joints_ = 0, shapes_ = 0, inferred_ = 0, other_geoms_ = 0;
};

}  // namespace

Result<Mechanism> read_mjcf(const Element& mujoco, const Options& options, Documents& documents) {
  return MjcfReader(mujoco, options, documents).run();
}

}  // namespace robomosp::robot_files
