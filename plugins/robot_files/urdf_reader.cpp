// SPDX-License-Identifier: Apache-2.0
// URDF (http://wiki.ros.org/urdf/XML). A joint's frame is its child link's; rpy are fixed axes x,
// y, z, which is Rz(y) Ry(p) Rx(r).
#include <tinyxml2.h>

#include <cmath>
#include <map>
#include <set>

#include "left_out.h"
#include "read.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::robot_files {
namespace {

Result<Pose> origin_of(const Element& e) {
  Pose t;
  const Element* o = e.FirstChildElement("origin");
  if (!o) return t;
  RMP_TRY_ASSIGN(t.p, vec3(*o, "xyz", {}));
  RMP_TRY_ASSIGN(const Vec3 rpy, vec3(*o, "rpy", {}));
  t.R = spatial::from_rpy(rpy);
  return t;
}

Result<MassProperties> inertial(const Element& e) {
  MassProperties m;
  RMP_TRY_ASSIGN(const Pose at, origin_of(e));
  if (const Element* mass = e.FirstChildElement("mass")) {
    RMP_TRY_ASSIGN(m.mass, number(*mass, "value", 0));
    if (std::fabs(m.mass) > kGreatest) return fault(*mass, "the mass is beyond 1e12 kg");
  }
  if (const Element* i = e.FirstChildElement("inertia")) {
    struct {
      const char* name;
      double& to;
    } const elements[] = {{"ixx", m.inertia.xx}, {"iyy", m.inertia.yy}, {"izz", m.inertia.zz},
                          {"ixy", m.inertia.xy}, {"iyz", m.inertia.yz}, {"ixz", m.inertia.xz}};
    for (const auto& [name, to] : elements) {
      RMP_TRY_ASSIGN(to, number(*i, name, 0));
      if (std::fabs(to) > kGreatest) return fault(*i, "an inertia is beyond 1e12 kg m^2");
    }
  }
  return spatial::in_frame(m, at);
}

class UrdfReader {
 public:
  UrdfReader(const Element& robot, const Options& options) : robot_(robot), options_(options) {}

  Result<Mechanism> run() {
    m_.name = std::string(word(robot_, "name"));
    for (const Element* e = robot_.FirstChildElement("material"); e;
         e = e->NextSiblingElement("material")) {
      auto known = material(*e);
      if (!known.ok()) return std::move(known).error();
    }
    RMP_TRY(links());
    RMP_TRY(joints());
    RMP_TRY(tree());
    tell();
    return std::move(m_);
  }

 private:
  struct Found {
    std::optional<Colour> colour;
  };
  Result<void> links() {
    for (const Element* e = robot_.FirstChildElement("link"); e;
         e = e->NextSiblingElement("link")) {
      if (links_.size() >= kMostBodies) return fault(*e, "there are more than 10000 links");
      const std::string name(word(*e, "name"));
      if (name.empty()) return fault(*e, "a link has no name", "Give it a name.");
      Body body;
      body.name = name;
      if (const Element* i = e->FirstChildElement("inertial")) {
        RMP_TRY_ASSIGN(body.mass, inertial(*i));
      }
      constexpr std::string_view kUrdfLink[] = {"inertial", "visual", "collision"};
      left_out_.elements(*e, kUrdfLink);
      RMP_TRY(shapes(*e, body));
      if (!index_.emplace(name, links_.size()).second)
        return fault(*e, "link " + in_quotes(name) + " stands twice", "Rename one of them.");
      links_.push_back(std::move(body));
    }
    if (links_.empty()) return fault(robot_, "it has no link", "Give a robot with links.");
    return {};
  }

  Result<void> shapes(const Element& link, Body& body) {
    const char* wanted = options_.collision ? "collision" : "visual";
    const char* other = options_.collision ? "visual" : "collision";
    const bool has_wanted = link.FirstChildElement(wanted) != nullptr;
    if (has_wanted && link.FirstChildElement(other)) ++both_;
    if (!has_wanted && link.FirstChildElement(other)) substituted_.push_back(body.name);
    const char* take = has_wanted ? wanted : other;
    for (const Element* e = link.FirstChildElement(take); e; e = e->NextSiblingElement(take)) {
      if (++shape_count_ > kMostShapes) return fault(*e, "there are more than 100000 shapes");
      RMP_TRY(shape(*e, body));
    }
    return {};
  }

  Result<void> shape(const Element& e, Body& body) {
    const Element* g = e.FirstChildElement("geometry");
    const Element* form = g ? g->FirstChildElement() : nullptr;
    if (!form) {
      m_.notes.push_back("A shape of link " + in_quotes(body.name) + " has no geometry.");
      return {};
    }
    Shape s;
    RMP_TRY_ASSIGN(s.pose, origin_of(e));
    const std::string_view kind = form->Name();
    if (kind == "box") {
      s.kind = Shape::Kind::box;
      RMP_TRY_ASSIGN(s.size, vec3(*form, "size", {}));
    } else if (kind == "cylinder" || kind == "capsule") {
      s.kind = kind == "cylinder" ? Shape::Kind::cylinder : Shape::Kind::capsule;
      RMP_TRY_ASSIGN(s.size[0], number(*form, "radius", 0));
      RMP_TRY_ASSIGN(s.size[1], number(*form, "length", 0));
    } else if (kind == "sphere") {
      s.kind = Shape::Kind::sphere;
      RMP_TRY_ASSIGN(s.size[0], number(*form, "radius", 0));
    } else if (kind == "mesh") {
      s.kind = Shape::Kind::mesh;
      const std::string uri(word(*form, "filename"));
      const std::filesystem::path file = mesh_file(uri, options_.folder, *options_.reach);
      if (file.empty()) {
        missing_.insert(uri);
        return {};
      }
      s.path = file.string();
      if (has(*form, "scale")) {
        // One number for all axes is not in the specification, but it is found.
        RMP_TRY_ASSIGN(const auto scale, numbers(*form, word(*form, "scale"), "scale"));
        if (scale.size() == 1) s.scale = {scale[0], scale[0], scale[0]};
        else RMP_TRY(read(*form, word(*form, "scale"), "scale", s.scale));
      }
      for (const double k : s.scale)
        if (k == 0 || std::fabs(k) > 1e6)
          return fault(*form, "a mesh cannot be scaled by this number", "Give 1 1 1.");
    } else {
      m_.notes.push_back("A shape <" + std::string(kind).substr(0, 40) + "> of link " +
                         in_quotes(body.name) + " is of unknown kind and was left out.");
      return {};
    }
    if (const Element* mat = e.FirstChildElement("material")) {
      RMP_TRY_ASSIGN(const Found found, material(*mat));
      s.colour = found.colour;
    }
    body.shapes.push_back(std::move(s));
    return {};
  }

  /// A colour, of the material itself or of an earlier one of its name.
  Result<Found> material(const Element& e) {
    const std::string name(word(e, "name"));
    if (e.FirstChildElement("texture")) has_texture_ = true;
    if (const Element* c = e.FirstChildElement("color")) {
      std::array<double, 4> rgba{};
      RMP_TRY(read(*c, word(*c, "rgba"), "rgba", rgba));
      const Colour colour{static_cast<float>(rgba[0]), static_cast<float>(rgba[1]),
                          static_cast<float>(rgba[2]), static_cast<float>(rgba[3])};
      if (!name.empty()) colours_.emplace(name, colour);
      return Found{colour};
    }
    const auto it = colours_.find(name);
    return Found{it == colours_.end() ? std::nullopt : std::optional(it->second)};
  }

  Result<void> joints() {
    std::set<std::string> names;
    for (const Element* e = robot_.FirstChildElement("joint"); e;
         e = e->NextSiblingElement("joint")) {
      const std::string name(word(*e, "name"));
      if (name.empty()) return fault(*e, "a joint has no name", "Give it a name.");
      if (!names.insert(name).second)
        return fault(*e, "joint " + in_quotes(name) + " stands twice", "Rename one of them.");
      std::size_t ends[2]{};
      for (int k = 0; k < 2; ++k) {
        const char* which = k == 0 ? "parent" : "child";
        const Element* end = e->FirstChildElement(which);
        const std::string link(end ? word(*end, "link") : std::string_view());
        const auto it = index_.find(link);
        if (it == index_.end())
          return fault(*e,
                       "the " + std::string(which) + " of joint " + in_quotes(name) + ", link " +
                           in_quotes(link) + ", is not in the file",
                       "Name one of its links.");
        ends[k] = it->second;
      }
      Body& child = links_[ends[1]];
      if (has_parent_.contains(ends[1]))
        return fault(*e, "link " + in_quotes(child.name) + " is the child of two joints",
                     "URDF has trees only; describe a closed loop with a loop in a robomosp file.");
      has_parent_.insert(ends[1]);
      child.parent = static_cast<std::int32_t>(ends[0]);
      RMP_TRY_ASSIGN(child.rest, origin_of(*e));
      RMP_TRY(joint(*e, name, child));
      order_.push_back(ends[1]);
    }
    return {};
  }

  Result<void> joint(const Element& e, const std::string& name, Body& child) {
    constexpr std::string_view kJoint[] = {"parent",     "child",    "origin",
                                           "axis",       "limit",    "dynamics",
                                           "mimic",      "robomosp", "safety_controller",
                                           "calibration"};
    left_out_.elements(e, kJoint);
    Joint j;
    j.name = name;
    const std::string_view type = word(e, "type");
    if (type == "fixed") return {};
    if (type == "revolute" || type == "continuous") j.kind = Joint::Kind::revolute;
    else if (type == "prismatic") j.kind = Joint::Kind::prismatic;
    else if (type == "floating") j.kind = Joint::Kind::free;
    else if (type == "planar") j.kind = Joint::Kind::planar;
    else if (type == "spherical" || type == "ball") j.kind = Joint::Kind::spherical;
    else
      return fault(e, in_quotes(type) + " is not a type of joint",
                   "Types are revolute, continuous, prismatic, fixed, floating and planar.");
    if (const Element* a = e.FirstChildElement("axis")) {
      RMP_TRY_ASSIGN(const Vec3 axis, vec3(*a, "xyz", {1, 0, 0}));
      RMP_TRY_ASSIGN(j.axis, unit_vector(*a, axis));
    } else {
      j.axis = {1, 0, 0};  // the specification's default
    }
    if (const Element* l = e.FirstChildElement("limit")) {
      const auto bounded = [](double v, double none) {
        return std::fabs(v) > kGreatest ? none : v;
      };
      if (type == "revolute" || type == "prismatic") {
        RMP_TRY_ASSIGN(const double lower, number(*l, "lower", 0));
        RMP_TRY_ASSIGN(const double upper, number(*l, "upper", 0));
        j.lower = bounded(lower, -kUnlimited);
        j.upper = bounded(upper, kUnlimited);
      }
      RMP_TRY_ASSIGN(const double velocity, number(*l, "velocity", kUnlimited));
      RMP_TRY_ASSIGN(const double effort, number(*l, "effort", kUnlimited));
      RMP_TRY_ASSIGN(const double acceleration, number(*l, "acceleration", kUnlimited));
      RMP_TRY_ASSIGN(const double jerk, number(*l, "jerk", kUnlimited));
      j.max_acceleration = bounded(acceleration, kUnlimited);
      j.max_jerk = bounded(jerk, kUnlimited);
      j.max_velocity = bounded(velocity, kUnlimited);
      j.max_force = bounded(effort, kUnlimited);
    } else if (type == "revolute" || type == "prismatic") {
      m_.notes.push_back("Joint " + in_quotes(name) +
                         " has no limits in the file, so it has none.");
    }
    if (const Element* d = e.FirstChildElement("dynamics")) {
      RMP_TRY_ASSIGN(j.viscous, number(*d, "damping", 0));
      RMP_TRY_ASSIGN(j.coulomb, number(*d, "friction", 0));
      if (std::fabs(j.viscous) > kGreatest || std::fabs(j.coulomb) > kGreatest)
        return fault(*d, "damping or friction is beyond 1e12");
    }
    RMP_TRY(own_words(e, j));
    if (const Element* f = e.FirstChildElement("mimic")) {
      j.follows = std::string(word(*f, "joint"));
      RMP_TRY_ASSIGN(j.ratio, number(*f, "multiplier", 1));
      RMP_TRY_ASSIGN(j.offset, number(*f, "offset", 0));
      if (std::fabs(j.ratio) > kGreatest || std::fabs(j.offset) > kGreatest)
        return fault(*f, "multiplier or offset is beyond 1e12");
    }
    if (e.FirstChildElement("safety_controller")) ++safety_;
    if (e.FirstChildElement("calibration")) ++calibration_;
    if (type == "planar") planar_.push_back(name);
    child.joints.push_back(std::move(j));
    return {};
  }

  /// What robot.export_urdf writes beside what URDF has words for.
  Result<void> own_words(const Element& e, Joint& j) {
    const Element* own = e.FirstChildElement("robomosp");
    if (!own) return {};
    RMP_TRY_ASSIGN(j.armature, number(*own, "armature", 0));
    RMP_TRY_ASSIGN(j.stiffness, number(*own, "stiffness", 0));
    RMP_TRY_ASSIGN(j.rest, number(*own, "rest", 0));
    RMP_TRY_ASSIGN(j.coulomb_negative, number(*own, "friction_backward", -1));
    RMP_TRY_ASSIGN(j.max_acceleration, number(*own, "acceleration", j.max_acceleration));
    RMP_TRY_ASSIGN(j.max_jerk, number(*own, "jerk", j.max_jerk));
    for (const double v : {j.armature, j.stiffness, j.rest, j.coulomb_negative})
      if (std::fabs(v) > kGreatest) return fault(*own, "a number is beyond 1e12");
    j.passive = is_yes(word(*own, "passive"), false);
    return {};
  }

  /// The root becomes the base; the others keep the order of their joints.
  Result<void> tree() {
    std::vector<std::size_t> roots;
    for (std::size_t i = 0; i < links_.size(); ++i)
      if (!has_parent_.contains(i)) roots.push_back(i);
    if (roots.empty())
      return fault(robot_, "its links form a cycle",
                   "Every link except the root needs one parent.");
    if (roots.size() > 1)
      return fault(
          robot_,
          "it has several trees: links " + in_quotes(links_[roots[0]].name) + " and " +
              in_quotes(links_[roots[1]].name) + (roots.size() > 2 ? " and others" : "") +
              " have no parent",
          "Join them with a fixed or floating joint, or import each from a separate file.");
    const Body& root = links_[roots[0]];
    m_.ground = root.shapes;
    if (root.name != "base")
      m_.notes.push_back("Link " + in_quotes(root.name) + ", the root, is the robot's base.");
    m_.ground_mass = root.mass;
    std::vector<std::int32_t> at(links_.size(), -1);
    for (std::size_t k = 0; k < order_.size(); ++k) at[order_[k]] = static_cast<std::int32_t>(k);
    for (const std::size_t i : order_) {
      Body body = std::move(links_[i]);
      body.parent = at[static_cast<std::size_t>(body.parent)];
      m_.bodies.push_back(std::move(body));
    }
    return {};
  }

  void tell() {
    if (!m_.bodies.empty())
      m_.notes.push_back(
          "Joints are named by the links they move; the joints' own names were left out.");
    if (both_ > 0)
      m_.notes.push_back(std::string("Links have one set of shapes here: the ") +
                         (options_.collision ? "visual" : "collision") + " shapes of " +
                         std::to_string(both_) + (both_ == 1 ? " link" : " links") +
                         " were left out.");
    if (!substituted_.empty())
      m_.notes.push_back(std::to_string(substituted_.size()) + " links, such as " +
                         in_quotes(substituted_[0]) + ", have " +
                         (options_.collision ? "visual" : "collision") +
                         " shapes only, which were used.");
    tell_missing(missing_, *options_.reach, m_.notes);
    if (has_texture_) m_.notes.emplace_back("Textures were left out.");
    if (safety_ > 0)
      m_.notes.push_back("Safety controllers of " + std::to_string(safety_) +
                         " joints were left out.");
    if (calibration_ > 0)
      m_.notes.push_back("Calibrations of " + std::to_string(calibration_) +
                         " joints were left out.");
    for (const std::string& j : planar_)
      m_.notes.push_back("Joint " + in_quotes(j) +
                         " is planar; URDF does not define its sliding axes, so two axes normal to "
                         "the joint axis were chosen.");
    constexpr std::string_view kRobot[] = {"link", "joint", "material"};
    left_out_.elements(robot_, kRobot);
    left_out_.tell(m_.notes);
    std::size_t without = 0;
    for (const Body& b : m_.bodies)
      if (!b.joints.empty() && !b.mass) ++without;
    if (without > 0)
      m_.notes.push_back(std::to_string(without) +
                         (without == 1 ? " moving link has" : " moving links have") +
                         " no <inertial> and therefore no mass.");
  }

  const Element& robot_;
  const Options& options_;
  Mechanism m_;
  LeftOut left_out_;
  std::vector<Body> links_;
  std::map<std::string, std::size_t> index_;
  std::map<std::string, Colour> colours_;
  std::set<std::size_t> has_parent_;
  std::vector<std::size_t> order_;
  std::vector<std::string> substituted_, planar_;
  std::set<std::string> missing_;
  std::size_t both_ = 0, shape_count_ = 0, safety_ = 0, calibration_ = 0;
  bool has_texture_ = false;
};

}  // namespace

Result<Mechanism> read_urdf(const Element& robot, const Options& options) {
  return UrdfReader(robot, options).run();
}

}  // namespace robomosp::robot_files
