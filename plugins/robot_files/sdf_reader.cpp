// SPDX-License-Identifier: Apache-2.0
// SDF (http://sdformat.org/spec): links with poses of their own, joints between any two of them;
// poses count from the model, or from the frame that relative_to names.
#include <tinyxml2.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "left_out.h"
#include "read.h"
#include "sdf_models.h"
#include "shape_mass.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::robot_files {
namespace {

constexpr std::string_view kModel[] = {"link",       "joint",        "frame",
                                       "pose",       "static",       "include",
                                       "model",      "self_collide", "allow_auto_disable",
                                       "enable_wind"};
constexpr std::string_view kLink[] = {"pose",        "inertial",       "visual",
                                      "collision",   "gravity",        "self_collide",
                                      "enable_wind", "velocity_decay", "must_be_base_link"};
constexpr std::string_view kSdfJoint[] = {"pose",  "parent",  "child",        "axis",
                                          "axis2", "physics", "thread_pitch", "screw_thread_pitch"};
constexpr std::string_view kAxis[] = {"xyz", "limit", "dynamics", "mimic",
                                      "use_parent_model_frame"};

/// The version of the file that the element stands in; the newest where it says none.
double version_of(const Element& e) {
  const Element* root = e.GetDocument()->RootElement();
  const auto v = root ? number(*root, "version", 2) : Result<double>(2.0);
  return v.ok() ? *v : 2;
}

class SdfReader {
 public:
  SdfReader(const Element& root, const Options& options, Documents& documents)
      : root_(root), options_(options), models_(documents, options.folder) {}

  Result<Mechanism> run() {
    RMP_TRY(models_.read(root_));
    m_.name = std::string(word(models_.model(), "name"));
    is_static_ = is_yes(text_of(models_.model(), "static"), false);
    RMP_TRY(links());
    RMP_TRY(joints());
    roots();
    tell();
    return std::move(m_);
  }

 private:
  // --- links -----------------------------------------------------------------------------------

  Result<void> links() {
    for (const Scoped& l : models_.links()) {
      const Element& e = *l.e;
      if (m_.bodies.size() >= kMostBodies) return fault(e, "there are more than 10000 links");
      Body b;
      b.name = l.name;
      if (!index_.emplace(b.name, static_cast<std::int32_t>(m_.bodies.size())).second)
        return fault(e, "link " + in_quotes(b.name) + " stands twice", "Rename one of them.");
      left_out_.elements(e, kLink);
      RMP_TRY_ASSIGN(b.rest, models_.pose_of(e, b.name));
      RMP_TRY(inertial(l, b));
      const char* wanted = options_.collision ? "collision" : "visual";
      const char* other = options_.collision ? "visual" : "collision";
      const char* take = e.FirstChildElement(wanted) ? wanted : other;
      if (take == wanted && e.FirstChildElement(other)) ++both_;
      for (const Element* s = e.FirstChildElement(take); s; s = s->NextSiblingElement(take)) {
        RMP_TRY_ASSIGN(auto made, shape(l, *s));
        if (made) b.shapes.push_back(std::move(*made));
      }
      m_.bodies.push_back(std::move(b));
    }
    return {};
  }

  /// inertial auto="true": the collision shapes with their density.
  Result<void> automatic(const Scoped& link, const Element& inertial, Body& b) {
    RMP_TRY_ASSIGN(const double of_link, real_of(inertial, "density", 1000));
    std::vector<MassProperties> all;
    for (const Element* c = link.e->FirstChildElement("collision"); c;
         c = c->NextSiblingElement("collision")) {
      RMP_TRY_ASSIGN(const double density, real_of(*c, "density", of_link));
      RMP_TRY_ASSIGN(const auto s, shape(link, *c));
      auto m = s ? shape_mass(*s, mesh_masses_, MeshInertia::exact) : std::nullopt;
      if (!m || !(density >= 0 && density <= kGreatest)) {
        left_out_.add("the mass of a mesh in <inertial auto=\"true\"> that is neither STL nor OBJ");
        continue;
      }
      m->mass *= density;
      m->inertia = spatial::scale(m->inertia, density);
      all.push_back(*m);
    }
    b.mass = spatial::combine(all);
    ++inferred_;
    return {};
  }

  Result<void> inertial(const Scoped& link, Body& b) {
    MassProperties m;
    m.mass = 1;
    m.inertia = {1, 1, 1};
    const Element* e = link.e->FirstChildElement("inertial");
    if (!e) {
      assumed_.push_back(b.name);
      b.mass = m;
      return {};
    }
    if (is_yes(word(*e, "auto"), false)) return automatic(link, *e, b);
    RMP_TRY_ASSIGN(m.mass, real_of(*e, "mass", 1));
    if (const Element* i = e->FirstChildElement("inertia")) {
      const std::pair<const char*, double*> elements[] = {
          {"ixx", &m.inertia.xx}, {"iyy", &m.inertia.yy}, {"izz", &m.inertia.zz},
          {"ixy", &m.inertia.xy}, {"iyz", &m.inertia.yz}, {"ixz", &m.inertia.xz}};
      for (const auto& [name, to] : elements) {
        RMP_TRY_ASSIGN(*to, real_of(*i, name, *to));
      }
    }
    for (const double v : {m.mass, m.inertia.xx, m.inertia.yy, m.inertia.zz, m.inertia.xy,
                           m.inertia.yz, m.inertia.xz})
      if (!(std::fabs(v) <= kGreatest)) return fault(*e, "a mass or inertia is beyond 1e12");
    RMP_TRY_ASSIGN(const Pose at, models_.pose_in(link, *e, b.name));
    b.mass = spatial::in_frame(m, at);
    return {};
  }

  /// None where there is nothing that can be taken.
  Result<std::optional<Shape>> shape(const Scoped& link, const Element& e) {
    if (++shapes_ > kMostShapes) return fault(e, "there are more than 100000 shapes");
    const Element* g = e.FirstChildElement("geometry");
    const Element* form = g ? g->FirstChildElement() : nullptr;
    if (!form) return std::optional<Shape>();
    Shape s;
    RMP_TRY_ASSIGN(s.pose, models_.pose_in(link, e, link.name));
    const std::string_view kind = form->Name();
    if (kind == "box") {
      RMP_TRY_ASSIGN(s.size, triple_of(*form, "size", {1, 1, 1}));
    } else if (kind == "cylinder" || kind == "capsule") {
      s.kind = kind == "cylinder" ? Shape::Kind::cylinder : Shape::Kind::capsule;
      RMP_TRY_ASSIGN(s.size[0], real_of(*form, "radius", kind == "cylinder" ? 1 : 0.5));
      RMP_TRY_ASSIGN(s.size[1], real_of(*form, "length", 1));
    } else if (kind == "sphere") {
      s.kind = Shape::Kind::sphere;
      RMP_TRY_ASSIGN(s.size[0], real_of(*form, "radius", 1));
    } else if (kind == "ellipsoid") {
      s.kind = Shape::Kind::ellipsoid;
      RMP_TRY_ASSIGN(s.size, triple_of(*form, "radii", {1, 1, 1}));
    } else if (kind == "mesh") {
      s.kind = Shape::Kind::mesh;
      const std::string uri(text_of(*form, "uri"));
      const std::filesystem::path file = mesh_file(uri, models_.folder_of(e), *options_.reach);
      if (file.empty()) {
        missing_.insert(uri);
        return std::optional<Shape>();
      }
      s.path = file.string();
      RMP_TRY_ASSIGN(s.scale, triple_of(*form, "scale", {1, 1, 1}));
      for (const double k : s.scale)
        if (k == 0 || std::fabs(k) > 1e6)
          return fault(*form, "a mesh cannot be scaled by this number", "Give 1 1 1.");
      if (form->FirstChildElement("submesh"))
        m_.notes.push_back("The whole mesh " + in_quotes(uri) + " was taken, not its submesh.");
    } else {
      left_out_.add("a shape <" + std::string(kind).substr(0, 40) + ">");
      return std::optional<Shape>();
    }
    if (const Element* mat = e.FirstChildElement("material"))
      if (const Element* c = mat->FirstChildElement("diffuse")) {
        RMP_TRY_ASSIGN(auto v, numbers(*c, inner(*c), "diffuse"));
        if (v.size() == 3) v.push_back(1);
        if (v.size() != 4)
          return fault(*c, "a colour must have 3 or 4 numbers", "Correct the file.");
        s.colour = Colour{static_cast<float>(v[0]), static_cast<float>(v[1]),
                          static_cast<float>(v[2]), static_cast<float>(v[3])};
      }
    return std::optional<Shape>(std::move(s));
  }

  // --- joints ----------------------------------------------------------------------------------

  Result<void> joints() {
    std::set<std::string> names;
    for (const Scoped& j : models_.joints()) {
      const Element& e = *j.e;
      if (!names.insert(j.name).second)
        return fault(e, "joint " + in_quotes(j.name) + " stands twice", "Rename one of them.");
      left_out_.elements(e, kSdfJoint);
      std::int32_t ends[2]{};
      for (int k = 0; k < 2; ++k) {
        const std::string said(text_of(e, k == 0 ? "parent" : "child"));
        const std::string link = models_.link_of(SdfModels::full_name(j, said));
        const auto it = index_.find(link);
        if (said.empty() || (it == index_.end() && (link != "world" || k == 1)))
          return fault(e,
                       "joint " + in_quotes(j.name) + " is attached to " + in_quotes(said) +
                           ", which is not a link of the model",
                       models_.missing().empty()
                           ? "Name one of its links."
                           : "Perhaps it is in model " + in_quotes(models_.missing()) +
                                 ", which was not found beside the file or above it.");
        ends[k] = it == index_.end() ? -1 : it->second;
      }
      if (ends[0] == ends[1]) return fault(e, "its parent is its own child", "Correct the file.");
      RMP_TRY(joint(j, ends[0], ends[1]));
    }
    return {};
  }

  /// Whether a body is attached to another one, or is it.
  bool hangs_on(std::int32_t body, std::int32_t on) const {
    for (; body >= 0; body = m_.bodies[static_cast<std::size_t>(body)].parent)
      if (body == on) return true;
    return false;
  }

  Result<void> joint(const Scoped& scoped, std::int32_t parent, std::int32_t child) {
    const Element& e = *scoped.e;
    const std::string& name = scoped.name;
    Body& b = m_.bodies[static_cast<std::size_t>(child)];
    RMP_TRY_ASSIGN(const Pose child_T_joint, joint_pose(scoped, b.name));
    std::vector<Joint> made;
    const std::string_view type = word(e, "type");
    const auto axis_joint = [&](const char* which, Joint::Kind kind) -> Result<void> {
      Joint j;
      j.name = made.empty() ? name : name + "_2";
      j.kind = kind;
      RMP_TRY(axis(scoped, which, b.name, child_T_joint, type == "continuous", j));
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
      RMP_TRY(screw(e, made));
    } else if (type == "gearbox") {
      m_.notes.push_back("Joint " + in_quotes(name) +
                         " is a gearbox between two joints and was left out; use mimic instead.");
      return {};
    } else if (type != "fixed") {
      return fault(e, in_quotes(type) + " is not a type of joint",
                   "Types are revolute, continuous, prismatic, fixed, ball, universal and "
                   "revolute2.");
    }
    // Also a joint whose child carries its parent closes a loop.
    if (has_parent_.contains(child) || hangs_on(parent, child))
      return close(e, name, parent, child, child_T_joint, made);
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

  /// Of the child's frame, also where the child is a frame on the link.
  Result<Pose> joint_pose(const Scoped& j, const std::string& link) {
    const std::string child = SdfModels::full_name(j, text_of(*j.e, "child"));
    if (child == link) return models_.pose_in(j, *j.e, link);  // to the bit
    RMP_TRY_ASSIGN(const Pose joint, models_.pose_of(*j.e, j.name));
    RMP_TRY_ASSIGN(const Pose body, models_.pose_of(*j.e, link));
    return spatial::compose(spatial::inverse(body), joint);
  }

  /// The way along the axis follows the turn.
  Result<void> screw(const Element& e, std::vector<Joint>& made) {
    Joint way = made[0];
    way.name += "_way";
    way.kind = Joint::Kind::prismatic;
    way.follows = made[0].name;
    way.lower = -kUnlimited;
    way.upper = way.max_velocity = way.max_force = kUnlimited;
    way.viscous = way.coulomb = way.stiffness = way.rest = 0;
    RMP_TRY_ASSIGN(const double pitch, real_of(e, "screw_thread_pitch", 0));
    RMP_TRY_ASSIGN(const double old, real_of(e, "thread_pitch", 0));
    // Metres a turn; the old word is minus radians a metre.
    way.ratio = pitch != 0 ? pitch / (2 * std::numbers::pi) : old != 0 ? -1 / old : 0;
    if (way.ratio == 0 || std::fabs(way.ratio) > kGreatest)
      return fault(e, "a screw has no pitch", "Give <screw_thread_pitch> in metres per turn.");
    made.push_back(std::move(way));
    return {};
  }

  Result<void> axis(const Scoped& scoped, const char* which, const std::string& link,
                    const Pose& child_T_joint, bool is_continuous, Joint& j) {
    const Element& e = *scoped.e;
    const Element* a = e.FirstChildElement(which);
    if (a) left_out_.elements(*a, kAxis);
    if (!a) return fault(e, "it has no <" + std::string(which) + ">", "Give xyz of its axis.");
    RMP_TRY_ASSIGN(const Vec3 given, triple_of(*a, "xyz", {0, 0, 1}));
    RMP_TRY_ASSIGN(const Vec3 unit, unit_vector(*a, given));
    const Element* xyz = a->FirstChildElement("xyz");
    const std::string in = xyz ? std::string(word(*xyz, "expressed_in")) : std::string();
    // Before 1.5 axes counted in the model's frame.
    const bool in_model =
        is_yes(text_of(*a, "use_parent_model_frame"), version_of(e) < 1.45) && in.empty();
    if (in_model || !in.empty()) {
      RMP_TRY_ASSIGN(const Pose from, models_.pose_of(e, SdfModels::full_name(scoped, in)));
      RMP_TRY_ASSIGN(const Pose at, models_.pose_of(e, link));
      j.axis = spatial::rotate_back(at, spatial::rotate(from, unit));
    } else {
      j.axis = spatial::rotate(child_T_joint, unit);
    }
    if (const Element* l = a->FirstChildElement("limit")) {
      RMP_TRY_ASSIGN(const double lower, real_of(*l, "lower", -kUnlimited));
      RMP_TRY_ASSIGN(const double upper, real_of(*l, "upper", kUnlimited));
      RMP_TRY_ASSIGN(const double effort, real_of(*l, "effort", -1));
      RMP_TRY_ASSIGN(const double velocity, real_of(*l, "velocity", -1));
      if (!is_continuous) {
        j.lower = std::fabs(lower) > kGreatest ? -kUnlimited : lower;
        j.upper = std::fabs(upper) > kGreatest ? kUnlimited : upper;
      }
      // Negative: none.
      j.max_force = effort < 0 || effort > kGreatest ? kUnlimited : effort;
      j.max_velocity = velocity < 0 || velocity > kGreatest ? kUnlimited : velocity;
    }
    if (const Element* d = a->FirstChildElement("dynamics")) {
      RMP_TRY_ASSIGN(j.viscous, real_of(*d, "damping", 0));
      RMP_TRY_ASSIGN(j.coulomb, real_of(*d, "friction", 0));
      RMP_TRY_ASSIGN(j.stiffness, real_of(*d, "spring_stiffness", 0));
      RMP_TRY_ASSIGN(j.rest, real_of(*d, "spring_reference", 0));
    }
    if (const Element* f = a->FirstChildElement("mimic")) {
      j.follows = SdfModels::full_name(scoped, word(*f, "joint"));
      if (word(*f, "axis") == "axis2") j.follows += "_2";
      RMP_TRY_ASSIGN(j.ratio, real_of(*f, "multiplier", 1));
      RMP_TRY_ASSIGN(const double offset, real_of(*f, "offset", 0));
      RMP_TRY_ASSIGN(const double reference, real_of(*f, "reference", 0));
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
      l.in_b.R = turn_z_to(joints[0].axis);
    } else if (joints.size() == 1 && joints[0].kind == Joint::Kind::spherical) {
      l.kind = "point";
    } else {
      m_.notes.push_back("Joint " + in_quotes(name) + " (" + place(e) +
                         ") closes a loop, which only revolute, ball and fixed joints can do; the "
                         "loop was left open.");
      return {};
    }
    RMP_TRY_ASSIGN(const Pose b,
                   models_.pose_of(e, m_.bodies[static_cast<std::size_t>(child)].name));
    Pose a;
    if (parent >= 0) {
      RMP_TRY_ASSIGN(a, models_.pose_of(e, m_.bodies[static_cast<std::size_t>(parent)].name));
    }
    l.in_a = spatial::compose(spatial::inverse(a), spatial::compose(b, l.in_b));
    m_.loops.push_back(std::move(l));
    ++closed_;
    return {};
  }

  /// Poses become relative to the parents; what is attached to nothing floats, or stands if it is
  /// static.
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
                         (floating == 1 ? " link floats" : " links float") +
                         ", since no joint connects " + (floating == 1 ? "it" : "them") +
                         " to the world; add a fixed joint if this is not intended.");
  }

  void tell() {
    if (closed_ > 0)
      m_.notes.push_back(std::to_string(closed_) + (closed_ == 1 ? " joint" : " joints") +
                         " of links with another parent became loops.");
    if (!assumed_.empty())
      m_.notes.push_back(std::to_string(assumed_.size()) + " links, such as " +
                         in_quotes(assumed_[0]) +
                         ", have no <inertial>: they weigh 1 kg with 1 kg m^2, SDF's default.");
    if (both_ > 0)
      m_.notes.push_back(std::string("Links have one set of shapes here: the ") +
                         (options_.collision ? "visual" : "collision") + " shapes of " +
                         std::to_string(both_) + " links were left out.");
    tell_missing(missing_, *options_.reach, m_.notes);
    if (inferred_ > 0)
      m_.notes.push_back("The masses of " + std::to_string(inferred_) +
                         (inferred_ == 1 ? " link" : " links") +
                         " were computed from the collision shapes, as the file requests.");
    for (const Element* e : models_.models()) left_out_.elements(*e, kModel);
    left_out_.tell(m_.notes);
    m_.notes.insert(m_.notes.end(), models_.notes().begin(), models_.notes().end());
    m_.notes.emplace_back("Joints are named by the links they move.");
  }

  const Element& root_;
  const Options& options_;
  SdfModels models_;
  LeftOut left_out_;
  Mechanism m_;
  bool is_static_ = false;
  std::map<std::string, std::int32_t> index_;
  std::set<std::int32_t> has_parent_;
  std::set<std::string> missing_;
  MeshMasses mesh_masses_;
  std::vector<std::string> assumed_;
  std::size_t shapes_ = 0, both_ = 0, closed_ = 0, inferred_ = 0;
};

}  // namespace

Result<Mechanism> read_sdf(const Element& sdf, const Options& options, Documents& documents) {
  return SdfReader(sdf, options, documents).run();
}

}  // namespace robomosp::robot_files
