// SPDX-License-Identifier: Apache-2.0
// SDF (http://sdformat.org/spec): links with poses of their own, joints between any two of them;
// poses count from the model, or from the frame that relative_to names.
#include <tinyxml2.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "read.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::import_urdf {
namespace {

class Reader {
 public:
  Reader(const Element& root, const Options& options) : root_(root), options_(options) {}

  Result<Mechanism> run() {
    RMP_TRY(find_model());
    m_.name = std::string(word(*model_, "name"));
    is_static_ = is_yes(text_of(*model_, "static"), false);
    RMP_TRY(frames());
    RMP_TRY(links());
    RMP_TRY(joints());
    roots();
    tell();
    return std::move(m_);
  }

 private:
  struct Frame {
    const Element* e = nullptr;
    std::string base;  ///< its pose counts from there; "" = the model
    bool is_done = false;
    Pose pose;  ///< model_T_frame
  };

  static std::string_view text_of(const Element& e, const char* child) {
    const Element* c = e.FirstChildElement(child);
    return c ? inner(*c) : std::string_view();
  }
  static Result<double> real(const Element& e, const char* child, double otherwise) {
    const Element* c = e.FirstChildElement(child);
    if (!c || inner(*c).empty()) return otherwise;
    RMP_TRY_ASSIGN(const auto v, numbers(*c, inner(*c), child));
    if (v.size() != 1) return fault(*c, "one number was expected", "Correct the file.");
    return v[0];
  }
  static Result<Vec3> triple(const Element& e, const char* child, Vec3 otherwise) {
    const Element* c = e.FirstChildElement(child);
    if (c && !inner(*c).empty()) RMP_TRY(read(*c, inner(*c), child, otherwise));
    return otherwise;
  }

  Result<void> find_model() {
    const Element* at = &root_;
    if (const Element* w = root_.FirstChildElement("world")) at = w;
    model_ = at->FirstChildElement("model");
    if (!model_) return fault(root_, "it holds no <model>", "Give a robot's file.");
    for (const Element* e = model_->NextSiblingElement("model"); e;
         e = e->NextSiblingElement("model"))
      m_.notes.push_back("Model " + in_quotes(word(*e, "name")) +
                         " was left out: a file is read up to its first model.");
    if (const Element* p = model_->FirstChildElement("pose"); p && !inner(*p).empty())
      m_.notes.emplace_back("Where the model stands in its world was left out.");
    return {};
  }

  // --- frames ----------------------------------------------------------------------------------

  static Result<Pose> raw_pose(const Element& e) {
    Pose t;
    const Element* p = e.FirstChildElement("pose");
    if (!p || inner(*p).empty()) return t;
    if (word(*p, "rotation_format") == "quat_xyzw") {
      std::array<double, 7> v{};
      RMP_TRY(read(*p, inner(*p), "pose", v));
      if (!(std::hypot(std::hypot(v[3], v[4]), std::hypot(v[5], v[6])) > 1e-9))
        return fault(*p, "its quaternion has no length", "The neutral one is 0 0 0 1.");
      t.p = {v[0], v[1], v[2]};
      t.R = spatial::from_quaternion({v[6], v[3], v[4], v[5]});
      return t;
    }
    std::array<double, 6> v{};
    RMP_TRY(read(*p, inner(*p), "pose", v));
    const double turn = is_yes(word(*p, "degrees"), false) ? std::numbers::pi / 180 : 1;
    t.p = {v[0], v[1], v[2]};
    t.R = spatial::from_rpy({v[3] * turn, v[4] * turn, v[5] * turn});
    return t;
  }
  static std::string relative_to(const Element& e, const std::string& otherwise) {
    const Element* p = e.FirstChildElement("pose");
    if (!p) return otherwise;
    if (has(*p, "relative_to")) return std::string(word(*p, "relative_to"));
    if (has(*p, "frame") && !word(*p, "frame").empty()) return std::string(word(*p, "frame"));
    return otherwise;
  }

  Result<void> frames() {
    for (const Element* e = model_->FirstChildElement(); e; e = e->NextSiblingElement()) {
      const std::string_view kind = e->Name();
      if (kind != "link" && kind != "joint" && kind != "frame") continue;
      const std::string name(word(*e, "name"));
      if (name.empty()) return fault(*e, "it has no name", "Give it one.");
      if (frames_.size() >= 3 * kMostBodies)
        return fault(*e, "there are too many links and joints");
      std::string base;
      if (kind == "joint") base = std::string(text_of(*e, "child"));
      if (kind == "frame") base = std::string(word(*e, "attached_to"));
      // Joints may be named like links; only the first of a name is a frame.
      frames_.emplace(name, Frame{e, relative_to(*e, base), false, {}});
    }
    return {};
  }

  /// model_T_frame, following relative_to; a circle is an error.
  Result<Pose> pose_of(const Element& asked, const std::string& name) {
    std::vector<Frame*> chain;
    Pose at;
    for (std::string n = name;;) {
      if (n.empty() || n == "__model__" || n == "world") break;
      const auto it = frames_.find(n);
      if (it == frames_.end())
        return fault(asked, in_quotes(n) + " is not a frame of the model",
                     "Frames are its links, joints and frames.");
      if (it->second.is_done) {
        at = it->second.pose;
        break;
      }
      if (chain.size() > frames_.size())
        return fault(asked, "the frames of " + in_quotes(name) + " refer to each other in a circle",
                     "Correct relative_to.");
      chain.push_back(&it->second);
      n = it->second.base;
    }
    for (std::size_t i = chain.size(); i-- > 0;) {
      RMP_TRY_ASSIGN(const Pose own, raw_pose(*chain[i]->e));
      at = spatial::compose(at, own);
      chain[i]->pose = at;
      chain[i]->is_done = true;
    }
    return at;
  }
  /// The pose of something in a link: of its own, or relative to a frame.
  Result<Pose> pose_in(const Element& e, const std::string& link) {
    RMP_TRY_ASSIGN(const Pose own, raw_pose(e));
    const std::string base = relative_to(e, link);
    if (base == link) return own;
    RMP_TRY_ASSIGN(const Pose from, pose_of(e, base));
    RMP_TRY_ASSIGN(const Pose to, pose_of(e, link));
    return spatial::compose(spatial::inverse(to), spatial::compose(from, own));
  }

  // --- links -----------------------------------------------------------------------------------

  Result<void> links() {
    for (const Element* e = model_->FirstChildElement("link"); e;
         e = e->NextSiblingElement("link")) {
      if (m_.bodies.size() >= kMostBodies) return fault(*e, "there are more than 10000 links");
      Body b;
      b.name = std::string(word(*e, "name"));
      if (!index_.emplace(b.name, static_cast<std::int32_t>(m_.bodies.size())).second)
        return fault(*e, "link " + in_quotes(b.name) + " stands twice", "Rename one of them.");
      RMP_TRY_ASSIGN(b.rest, pose_of(*e, b.name));
      RMP_TRY(inertial(*e, b));
      const char* wanted = options_.collision ? "collision" : "visual";
      const char* other = options_.collision ? "visual" : "collision";
      const char* take = e->FirstChildElement(wanted) ? wanted : other;
      if (take == wanted && e->FirstChildElement(other)) ++both_;
      for (const Element* s = e->FirstChildElement(take); s; s = s->NextSiblingElement(take))
        RMP_TRY(shape(*s, b));
      m_.bodies.push_back(std::move(b));
    }
    return {};
  }

  Result<void> inertial(const Element& link, Body& b) {
    MassProperties m;
    m.mass = 1;
    m.inertia = {1, 1, 1};
    const Element* e = link.FirstChildElement("inertial");
    if (!e) {
      assumed_.push_back(b.name);
      b.mass = m;
      return {};
    }
    RMP_TRY_ASSIGN(m.mass, real(*e, "mass", 1));
    if (const Element* i = e->FirstChildElement("inertia")) {
      const std::pair<const char*, double*> elements[] = {
          {"ixx", &m.inertia.xx}, {"iyy", &m.inertia.yy}, {"izz", &m.inertia.zz},
          {"ixy", &m.inertia.xy}, {"iyz", &m.inertia.yz}, {"ixz", &m.inertia.xz}};
      for (const auto& [name, to] : elements) {
        RMP_TRY_ASSIGN(*to, real(*i, name, *to));
      }
    }
    for (const double v : {m.mass, m.inertia.xx, m.inertia.yy, m.inertia.zz, m.inertia.xy,
                           m.inertia.yz, m.inertia.xz})
      if (!(std::fabs(v) <= kGreatest)) return fault(*e, "a mass or inertia is beyond 1e12");
    RMP_TRY_ASSIGN(const Pose at, pose_in(*e, b.name));
    b.mass = spatial::in_frame(m, at);
    return {};
  }

  Result<void> shape(const Element& e, Body& b) {
    if (++shapes_ > kMostShapes) return fault(e, "there are more than 100000 shapes");
    const Element* g = e.FirstChildElement("geometry");
    const Element* form = g ? g->FirstChildElement() : nullptr;
    if (!form) return {};
    Shape s;
    RMP_TRY_ASSIGN(s.pose, pose_in(e, b.name));
    const std::string_view kind = form->Name();
    if (kind == "box") {
      RMP_TRY_ASSIGN(s.size, triple(*form, "size", {1, 1, 1}));
    } else if (kind == "cylinder" || kind == "capsule") {
      s.kind = kind == "cylinder" ? Shape::Kind::cylinder : Shape::Kind::capsule;
      RMP_TRY_ASSIGN(s.size[0], real(*form, "radius", kind == "cylinder" ? 1 : 0.5));
      RMP_TRY_ASSIGN(s.size[1], real(*form, "length", 1));
    } else if (kind == "sphere") {
      s.kind = Shape::Kind::sphere;
      RMP_TRY_ASSIGN(s.size[0], real(*form, "radius", 1));
    } else if (kind == "ellipsoid") {
      s.kind = Shape::Kind::ellipsoid;
      RMP_TRY_ASSIGN(s.size, triple(*form, "radii", {1, 1, 1}));
    } else if (kind == "mesh") {
      s.kind = Shape::Kind::mesh;
      const std::string uri(text_of(*form, "uri"));
      const std::filesystem::path file = mesh_file(uri, options_.folder);
      if (file.empty()) {
        missing_.insert(uri);
        return {};
      }
      s.path = file.string();
      RMP_TRY_ASSIGN(s.scale, triple(*form, "scale", {1, 1, 1}));
      for (const double k : s.scale)
        if (k == 0 || std::fabs(k) > 1e6)
          return fault(*form, "a mesh cannot be scaled by this number", "Give 1 1 1.");
      if (form->FirstChildElement("submesh"))
        m_.notes.push_back("The whole mesh " + in_quotes(uri) + " was taken, not its submesh.");
    } else {
      m_.notes.push_back("A shape <" + std::string(kind).substr(0, 40) + "> of link " +
                         in_quotes(b.name) + " was left out.");
      return {};
    }
    if (const Element* mat = e.FirstChildElement("material"))
      if (const Element* c = mat->FirstChildElement("diffuse")) {
        RMP_TRY_ASSIGN(auto v, numbers(*c, inner(*c), "diffuse"));
        if (v.size() == 3) v.push_back(1);
        if (v.size() != 4) return fault(*c, "a colour has 3 or 4 numbers", "Correct the file.");
        s.colour = Colour{static_cast<float>(v[0]), static_cast<float>(v[1]),
                          static_cast<float>(v[2]), static_cast<float>(v[3])};
      }
    b.shapes.push_back(std::move(s));
    return {};
  }

  // --- joints ----------------------------------------------------------------------------------

  Result<void> joints() {
    std::set<std::string> names;
    for (const Element* e = model_->FirstChildElement("joint"); e;
         e = e->NextSiblingElement("joint")) {
      const std::string name(word(*e, "name"));
      if (!names.insert(name).second)
        return fault(*e, "joint " + in_quotes(name) + " stands twice", "Rename one of them.");
      std::int32_t ends[2]{};
      for (int k = 0; k < 2; ++k) {
        const std::string link(text_of(*e, k == 0 ? "parent" : "child"));
        const auto it = index_.find(link);
        if (it == index_.end() && (link != "world" || k == 1))
          return fault(*e,
                       "joint " + in_quotes(name) + " hangs on " + in_quotes(link) +
                           ", which is not a link of the model",
                       "Name one of its links.");
        ends[k] = it == index_.end() ? -1 : it->second;
      }
      if (ends[0] == ends[1]) return fault(*e, "its parent is its child", "Correct the file.");
      RMP_TRY(joint(*e, name, ends[0], ends[1]));
    }
    return {};
  }

  Result<void> joint(const Element& e, const std::string& name, std::int32_t parent,
                     std::int32_t child) {
    Body& b = m_.bodies[static_cast<std::size_t>(child)];
    RMP_TRY_ASSIGN(const Pose child_T_joint, pose_in(e, b.name));
    std::vector<Joint> made;
    const std::string_view type = word(e, "type");
    const auto axis_joint = [&](const char* which, Joint::Kind kind) -> Result<void> {
      Joint j;
      j.name = made.empty() ? name : name + "_2";
      j.kind = kind;
      RMP_TRY(axis(e, which, b.name, child_T_joint, type == "continuous", j));
      made.push_back(std::move(j));
      return {};
    };
    if (type == "revolute" || type == "continuous")
      RMP_TRY(axis_joint("axis", Joint::Kind::revolute));
    else if (type == "prismatic") RMP_TRY(axis_joint("axis", Joint::Kind::prismatic));
    else if (type == "universal" || type == "revolute2") {
      RMP_TRY(axis_joint("axis", Joint::Kind::revolute));
      RMP_TRY(axis_joint("axis2", Joint::Kind::revolute));
    } else if (type == "ball") {
      Joint j;
      j.name = name;
      j.kind = Joint::Kind::spherical;
      made.push_back(std::move(j));
    } else if (type == "screw") {
      RMP_TRY(axis_joint("axis", Joint::Kind::revolute));
      m_.notes.push_back("Joint " + in_quotes(name) +
                         " is a screw; it only turns here, without sliding.");
    } else if (type == "gearbox") {
      m_.notes.push_back("Joint " + in_quotes(name) +
                         " is a gearbox between two joints and was left out; say it with mimic.");
      return {};
    } else if (type != "fixed") {
      return fault(e, in_quotes(type) + " is not a type of joint",
                   "Types are revolute, continuous, prismatic, fixed, ball, universal and "
                   "revolute2.");
    }
    if (has_parent_.contains(child)) return close(e, name, parent, child, child_T_joint, made);
    has_parent_.insert(child);
    b.parent = parent;
    for (Joint& j : made) {
      j.anchor = j.kind == Joint::Kind::prismatic ? Vec3{} : child_T_joint.p;
      // A point of the axis nearest to the link's origin: none is needed where it runs through it.
      if (j.kind == Joint::Kind::revolute)
        j.anchor = spatial::sub(j.anchor, spatial::scale(j.axis, spatial::dot(j.anchor, j.axis)));
      if (made.size() > 1) j.anchor = child_T_joint.p;
      if (spatial::norm(j.anchor) < 1e-12) j.anchor = {};
    }
    b.joints = std::move(made);
    return {};
  }

  Result<void> axis(const Element& e, const char* which, const std::string& link,
                    const Pose& child_T_joint, bool is_continuous, Joint& j) {
    const Element* a = e.FirstChildElement(which);
    if (!a) return fault(e, "it has no <" + std::string(which) + ">", "Give xyz of its axis.");
    RMP_TRY_ASSIGN(const Vec3 given, triple(*a, "xyz", {0, 0, 1}));
    RMP_TRY_ASSIGN(const Vec3 unit, unit_vector(*a, given));
    const Element* xyz = a->FirstChildElement("xyz");
    const std::string in = xyz ? std::string(word(*xyz, "expressed_in")) : std::string();
    if (is_yes(text_of(*a, "use_parent_model_frame"), false) || in == "__model__") {
      RMP_TRY_ASSIGN(const Pose at, pose_of(e, link));
      j.axis = spatial::rotate_back(at, unit);
    } else if (!in.empty()) {
      RMP_TRY_ASSIGN(const Pose from, pose_of(e, in));
      RMP_TRY_ASSIGN(const Pose at, pose_of(e, link));
      j.axis = spatial::rotate_back(at, spatial::rotate(from, unit));
    } else {
      j.axis = spatial::rotate(child_T_joint, unit);
    }
    if (const Element* l = a->FirstChildElement("limit")) {
      RMP_TRY_ASSIGN(const double lower, real(*l, "lower", -kUnlimited));
      RMP_TRY_ASSIGN(const double upper, real(*l, "upper", kUnlimited));
      RMP_TRY_ASSIGN(const double effort, real(*l, "effort", -1));
      RMP_TRY_ASSIGN(const double velocity, real(*l, "velocity", -1));
      if (!is_continuous) {
        j.lower = std::fabs(lower) > kGreatest ? -kUnlimited : lower;
        j.upper = std::fabs(upper) > kGreatest ? kUnlimited : upper;
      }
      // Negative: none.
      j.max_force = effort < 0 || effort > kGreatest ? kUnlimited : effort;
      j.max_velocity = velocity < 0 || velocity > kGreatest ? kUnlimited : velocity;
    }
    if (const Element* d = a->FirstChildElement("dynamics")) {
      RMP_TRY_ASSIGN(j.viscous, real(*d, "damping", 0));
      RMP_TRY_ASSIGN(j.coulomb, real(*d, "friction", 0));
      RMP_TRY_ASSIGN(j.stiffness, real(*d, "spring_stiffness", 0));
      RMP_TRY_ASSIGN(j.rest, real(*d, "spring_reference", 0));
    }
    if (const Element* f = a->FirstChildElement("mimic")) {
      j.follows = std::string(word(*f, "joint"));
      if (word(*f, "axis") == "axis2") j.follows += "_2";
      RMP_TRY_ASSIGN(j.ratio, real(*f, "multiplier", 1));
      RMP_TRY_ASSIGN(const double offset, real(*f, "offset", 0));
      RMP_TRY_ASSIGN(const double reference, real(*f, "reference", 0));
      j.offset = offset - j.ratio * reference;
    }
    for (const double v : {j.viscous, j.coulomb, j.stiffness, j.rest, j.ratio, j.offset})
      if (!(std::fabs(v) <= kGreatest)) return fault(*a, "a number is beyond 1e12");
    return {};
  }

  /// A second joint of a link closes a loop.
  Result<void> close(const Element& e, const std::string& name, std::int32_t parent,
                     std::int32_t child, const Pose& child_T_joint,
                     const std::vector<Joint>& joints) {
    Loop l;
    l.name = name;
    l.a = parent;
    l.b = child;
    l.in_b = child_T_joint;
    if (joints.empty()) l.kind = "weld";
    else if (joints.size() == 1 && joints[0].kind == Joint::Kind::revolute) {
      l.kind = "revolute";
      const Vec3& z = joints[0].axis;
      const Vec3 across{0.0 - z[1], z[0], 0};
      const double sine = spatial::norm(across);
      if (sine > 1e-12) l.in_b.R = spatial::from_axis_angle(across, std::atan2(sine, z[2]));
      else l.in_b.R = z[2] > 0 ? Pose{}.R : spatial::rotation_x(std::numbers::pi).R;
    } else if (joints.size() == 1 && joints[0].kind == Joint::Kind::spherical) {
      l.kind = "point";
    } else {
      return fault(e,
                   "joint " + in_quotes(name) +
                       " closes a loop, which only revolute, ball and "
                       "fixed joints can",
                   "Cut the loop at another joint.");
    }
    RMP_TRY_ASSIGN(const Pose b, pose_of(e, m_.bodies[static_cast<std::size_t>(child)].name));
    Pose a;
    if (parent >= 0) {
      RMP_TRY_ASSIGN(a, pose_of(e, m_.bodies[static_cast<std::size_t>(parent)].name));
    }
    l.in_a = spatial::compose(spatial::inverse(a), spatial::compose(b, l.in_b));
    m_.loops.push_back(std::move(l));
    ++closed_;
    return {};
  }

  /// Poses become relative to the parents; what hangs on nothing floats, or stands if it is static.
  void roots() {
    std::vector<Pose> in_model;
    for (const Body& b : m_.bodies) in_model.push_back(b.rest);
    std::size_t floating = 0;
    for (std::size_t i = 0; i < m_.bodies.size(); ++i) {
      Body& b = m_.bodies[i];
      if (b.parent >= 0)
        b.rest = spatial::compose(spatial::inverse(in_model[static_cast<std::size_t>(b.parent)]),
                                  in_model[i]);
      if (has_parent_.contains(static_cast<std::int32_t>(i)) || is_static_) continue;
      Joint j;
      j.name = b.name + "_free";
      j.kind = Joint::Kind::free;
      j.passive = true;
      b.joints = {std::move(j)};
      ++floating;
    }
    if (floating > 0)
      m_.notes.push_back(std::to_string(floating) +
                         (floating == 1 ? " link floats" : " links float") + ", as no joint ties " +
                         (floating == 1 ? "it" : "them") +
                         " to the world; make the joint fixed where that is not meant.");
  }

  void tell() {
    if (closed_ > 0)
      m_.notes.push_back(std::to_string(closed_) + (closed_ == 1 ? " joint" : " joints") +
                         " of links that have another parent became loops.");
    if (!assumed_.empty())
      m_.notes.push_back(std::to_string(assumed_.size()) + " links, such as " +
                         in_quotes(assumed_[0]) +
                         ", have no <inertial>: they weigh 1 kg with 1 kg m^2, SDF's default.");
    if (both_ > 0)
      m_.notes.push_back(std::string("Links have one set of shapes here: the ") +
                         (options_.collision ? "visual" : "collision") + " shapes of " +
                         std::to_string(both_) + " links were left out.");
    for (const std::string& f : missing_)
      m_.notes.push_back("Mesh " + in_quotes(f) + " was not found; its shape was left out.");
    std::set<std::string> others;
    const std::set<std::string_view> known{"link", "joint",  "frame",
                                           "pose", "static", "self_collide"};
    for (const Element* e = model_->FirstChildElement(); e; e = e->NextSiblingElement())
      if (!known.contains(e->Name())) others.insert(std::string(e->Name()).substr(0, 40));
    for (const std::string& n : others) m_.notes.push_back("Elements <" + n + "> were left out.");
    m_.notes.emplace_back("Joints are named by the links they move.");
  }

  const Element& root_;
  const Options& options_;
  const Element* model_ = nullptr;
  Mechanism m_;
  bool is_static_ = false;
  std::map<std::string, Frame> frames_;
  std::map<std::string, std::int32_t> index_;
  std::set<std::int32_t> has_parent_;
  std::set<std::string> missing_;
  std::vector<std::string> assumed_;
  std::size_t shapes_ = 0, both_ = 0, closed_ = 0;
};

}  // namespace

Result<Mechanism> read_sdf(const Element& sdf, const Options& options, Documents&) {
  return Reader(sdf, options).run();
}

}  // namespace robomosp::import_urdf
