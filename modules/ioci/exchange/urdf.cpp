// SPDX-License-Identifier: Apache-2.0
// Robots as URDF: links and joints as XML, meshes in files beside it, and a report of what URDF has
// no words for. (URDF in, as well as MJCF and SDF, is the command import.)
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include <robomosp/sdk/io.h>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/exchange/exported.h"
#include "robotics/build_model.h"
#include "robotics/coordinates.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::ioci {
namespace {

/// URDF requires limits where a robot may have none; importers take what is beyond 1e12 for none.
constexpr double kNoLimit = 1e16;

std::string escaped(std::string_view s) {
  std::string out;
  for (const char c : s) {
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else if (c == '"') out += "&quot;";
    else out += c;
  }
  return out;
}
std::string three(const Vec3& v) {
  return text::print(v[0]) + " " + text::print(v[1]) + " " + text::print(v[2]);
}
bool is_identity(const Pose& t) { return t.p == Vec3{} && t.R == Pose{}.R; }

class UrdfWriter {
 public:
  struct Wishes {
    std::string package;      ///< of ROS; "" = meshes are named relative to the file
    bool with_bodies = true;  ///< write the shapes
  };
  UrdfWriter(CommandContext& ctx, RobotId id, std::filesystem::path file, Wishes wishes,
             std::shared_ptr<const RobotModel> model)
      : ctx_(ctx),
        id_(id),
        robot_(*ctx.snapshot().get(id)),
        model_(std::move(model)),
        file_(std::move(file)),
        wishes_(std::move(wishes)) {}

  Result<Value> run() {
    const std::string name = ctx_.snapshot().find(AnyId(id_))->name;
    frames_ = robotics::link_frames(robot_);
    joints_ = robotics::link_joints(robot_);
    // Links keep their names; what is added takes others.
    for (const model::Link& l : robot_.links) links_taken_.insert(l.name);
    base_ = free_name("base", links_taken_);
    RMP_TRY(bodies());
    xml_ = "<?xml version=\"1.0\"?>\n<robot name=\"" + escaped(name) + "\">\n";
    if (const Pose t = model_->base; !is_identity(t)) {
      const std::string mounting = free_name("mounting", links_taken_);
      xml_ += "  <link name=\"" + mounting + "\"/>\n";
      fixed(mounting, base_, t);
      notes_.push_back("The base stands on a link " + text::quote(mounting) +
                       " of its own, the root.");
    }
    link(base_, {}, body_xml(0));
    for (std::size_t i = 0; i < robot_.links.size(); ++i) add_link(i);
    tools();
    xml_ += joint_xml_ + "</robot>\n";
    report();
    RMP_TRY(io::write_file(file_, xml_));
    for (const std::string& n : notes_)
      ctx_.app.messages.post(Severity::info, "export_note", n, "export");
    List notes, meshes;
    for (const std::string& n : notes_) notes.emplace_back(n);
    for (const std::string& m : meshes_) meshes.emplace_back(m);
    return Value(Map{{"file", file_.string()},
                     {"links", link_count_},
                     {"joints", joint_count_},
                     {"meshes", std::move(meshes)},
                     {"notes", std::move(notes)}});
  }

 private:
  static std::string free_name(const std::string& wanted, std::set<std::string>& taken) {
    std::string name = wanted;
    for (int i = 2; !taken.insert(name).second; ++i) name = wanted + "_" + std::to_string(i);
    return name;
  }

  // --- elements ------------------------------------------------------------------------------

  static std::string origin(const Pose& t) {
    return "<origin xyz=\"" + three(t.p) + "\" rpy=\"" + three(spatial::to_rpy(t.R)) + "\"/>";
  }

  void link(const std::string& name, const MassProperties& mass, const std::string& shapes) {
    ++link_count_;
    xml_ += "  <link name=\"" + escaped(name) + "\"";
    if (mass.mass == 0 && is_zero(mass.inertia) && shapes.empty()) {
      xml_ += "/>\n";
      return;
    }
    xml_ += ">\n";
    if (mass.mass != 0 || !is_zero(mass.inertia)) {
      const Sym3& i = mass.inertia;
      const auto part = [](const char* n, double v) {
        return std::string(" ") + n + "=\"" + text::print(v) + "\"";
      };
      xml_ += "    <inertial>\n      <origin xyz=\"" + three(mass.com) +
              "\" rpy=\"0 0 0\"/>\n      <mass value=\"" + text::print(mass.mass) +
              "\"/>\n      <inertia" + part("ixx", i.xx) + part("ixy", i.xy) + part("ixz", i.xz) +
              part("iyy", i.yy) + part("iyz", i.yz) + part("izz", i.zz) + "/>\n    </inertial>\n";
    }
    xml_ += shapes + "  </link>\n";
  }
  static bool is_zero(const Sym3& s) {
    return s.xx == 0 && s.yy == 0 && s.zz == 0 && s.xy == 0 && s.yz == 0 && s.xz == 0;
  }

  void joint(const std::string& name, const char* type, const std::string& parent,
             const std::string& child, const Pose& at, const std::string& rest = {}) {
    ++joint_count_;
    joint_xml_ += "  <joint name=\"" + escaped(name) + "\" type=\"" + type +
                  "\">\n    <parent link=\"" + escaped(parent) + "\"/>\n    <child link=\"" +
                  escaped(child) + "\"/>\n    " + origin(at) + "\n" + rest + "  </joint>\n";
  }
  void fixed(const std::string& parent, const std::string& child, const Pose& at) {
    joint(free_name(child + "_fixed", joints_taken_), "fixed", parent, child, at);
  }

  // --- structure -----------------------------------------------------------------------------

  void add_link(std::size_t i) {
    const model::Link& l = robot_.links[i];
    const robotics::LinkFrame& at = frames_[i];
    const std::string parent =
        l.parent < 0 ? base_ : robot_.links[static_cast<std::size_t>(l.parent)].name;
    const Pose parent_T_joint =
        l.parent < 0 ? Pose{}
                     : spatial::inverse(frames_[static_cast<std::size_t>(l.parent)].joint_T_link);
    const robotics::LinkJoints& own = joints_[i];
    if (own.joint_count == 0) {
      link(l.name, {}, body_xml(i + 1));
      fixed(parent, l.name, spatial::compose(parent_T_joint, at.joint_T_link));
      if (l.given && l.given->mass != 0) ++merged_;
      return;
    }
    std::string below = parent;
    Pose before = parent_T_joint;
    for (std::int32_t k = 0; k < own.joint_count; ++k) {
      const auto j = static_cast<std::size_t>(own.joint + k);
      const JointModel& m = model_->joints[j];
      const bool is_last = k + 1 == own.joint_count;
      // A URDF joint is in its child link's frame. The link's frame can be that when the joint's
      // axis runs through its origin.
      const Pose& t = at.joint_T_link;
      const bool is_direct =
          is_last &&
          (m.type == JointType::prismatic ||
           (m.type == JointType::revolute && t.p[0] == 0 && t.p[1] == 0) || is_identity(t));
      const Pose turn = is_direct ? t : Pose{};
      const std::string name =
          is_direct ? l.name : free_name(l.name + (is_last ? "_body" : "_part"), links_taken_);
      const Pose origin_pose = spatial::compose(spatial::compose(before, m.placement), turn);
      std::string child = name;
      if (m.type == JointType::spherical) {
        below = ball(l.name, below, origin_pose);
        link(name, spatial::in_frame(m.body, spatial::inverse(turn)),
             is_direct ? body_xml(i + 1) : std::string());
        joint(urdf_joint(j), "continuous", below, name, {}, axis_xml({1, 0, 0}) + numbers(m));
      } else {
        link(name, spatial::in_frame(m.body, spatial::inverse(turn)),
             is_direct ? body_xml(i + 1) : std::string());
        const bool is_endless = std::isinf(m.lower) && std::isinf(m.upper);
        const char* type = m.type == JointType::free        ? "floating"
                           : m.type == JointType::prismatic ? "prismatic"
                           : is_endless                     ? "continuous"
                                                            : "revolute";
        const Vec3 axis = spatial::rotate_back(turn, {0, 0, 1});
        joint(urdf_joint(j), type, below, name, origin_pose,
              (m.type == JointType::free ? std::string() : axis_xml(axis)) + numbers(m));
      }
      report_joint(m);
      below = child;
      before = Pose{};
      if (is_last && !is_direct) {
        link(l.name, {}, body_xml(i + 1));
        fixed(name, l.name, t);
        ++split_;
      }
    }
    if (own.joint_count > 1) sequences_.push_back(l.name);
    if (!l.origin) ++rows_;
  }

  /// Two joints of a ball joint, about z and y, without bodies; the third is the caller's.
  std::string ball(const std::string& name, std::string below, Pose at) {
    const Vec3 axes[] = {{0, 0, 1}, {0, 1, 0}};
    const char* suffix[] = {"_z", "_y"};
    for (int k = 0; k < 2; ++k) {
      const std::string child = free_name(name + suffix[k], links_taken_);
      link(child, {}, {});
      joint(free_name(child, joints_taken_), "continuous", below, child, at, axis_xml(axes[k]));
      below = child;
      at = Pose{};
    }
    balls_.push_back(name);
    return below;
  }

  std::string urdf_joint(std::size_t j) {
    std::string& name = joint_names_[j];
    if (name.empty()) name = free_name(model_->joints[j].name, joints_taken_);
    return name;
  }

  static std::string axis_xml(const Vec3& a) { return "    <axis xyz=\"" + three(a) + "\"/>\n"; }

  std::string numbers(const JointModel& m) {
    std::string out;
    if (coordinate_count(m.type) != 1) return m.passive ? own_words(" passive=\"true\"") : out;
    const auto value = [](double v) {
      return text::print(std::isinf(v) ? (v > 0 ? kNoLimit : -kNoLimit) : v);
    };
    const bool has_range = std::isfinite(m.lower) || std::isfinite(m.upper);
    const bool needs_limit = has_range || m.type == JointType::prismatic;
    if (needs_limit || std::isfinite(m.max_velocity) || std::isfinite(m.max_force)) {
      out += "    <limit";
      if (needs_limit) out += " lower=\"" + value(m.lower) + "\" upper=\"" + value(m.upper) + "\"";
      out +=
          " effort=\"" + value(m.max_force) + "\" velocity=\"" + value(m.max_velocity) + "\"/>\n";
      if (std::isinf(m.max_force) || std::isinf(m.max_velocity) ||
          (needs_limit && (std::isinf(m.lower) || std::isinf(m.upper))))
        ++unlimited_;
    }
    const JointFriction& f = m.friction;
    if (f.viscous != 0 || f.coulomb_positive != 0)
      out += "    <dynamics damping=\"" + text::print(f.viscous) + "\" friction=\"" +
             text::print(f.coulomb_positive) + "\"/>\n";
    if (m.is_coupled())
      out += "    <mimic joint=\"" + escaped(urdf_joint(static_cast<std::size_t>(m.coupling.of))) +
             "\" multiplier=\"" + text::print(m.coupling.ratio) + "\" offset=\"" +
             text::print(m.coupling.offset) + "\"/>\n";
    std::string own;
    const auto add = [&](const char* what, double v) {
      own += std::string(" ") + what + "=\"" + text::print(v) + "\"";
    };
    if (m.armature != 0) add("armature", m.armature);
    if (m.spring.stiffness != 0) add("stiffness", m.spring.stiffness), add("rest", m.spring.rest);
    if (f.coulomb_negative != -f.coulomb_positive) add("friction_backward", -f.coulomb_negative);
    if (std::isfinite(m.max_acceleration)) add("acceleration", m.max_acceleration);
    if (std::isfinite(m.max_jerk)) add("jerk", m.max_jerk);
    if (m.passive) own += " passive=\"true\"";
    if (!own.empty()) out += own_words(own);
    return out;
  }
  static std::string own_words(const std::string& attributes) {
    return "    <robomosp" + attributes + "/>\n";
  }

  void tools() {
    const auto tool = [&](const std::string& wanted, std::int32_t on, const Pose& at) {
      const std::string name = free_name(wanted, links_taken_);
      link(name, {}, {});
      fixed(on < 0 ? base_ : robot_.links[static_cast<std::size_t>(on)].name, name, at);
    };
    for (const model::RobotTool& t : robot_.tools) tool(t.name, t.link, model::pose(t.placement));
    // The last link carries the tool for whoever reads the file.
    const Pose at = model::pose(robot_.tool);
    if (!is_identity(at) || !robot_.tools.empty())
      tool("tool", static_cast<std::int32_t>(robot_.links.size()) - 1, at);
  }

  // --- bodies --------------------------------------------------------------------------------

  std::string& body_xml(std::size_t b) { return bodies_[b]; }

  Result<void> bodies() {
    bodies_.resize(robot_.links.size() + 1);
    if (!wishes_.with_bodies) {
      notes_.emplace_back("Shapes were not written, as bodies = false says.");
      return {};
    }
    RMP_TRY_ASSIGN(const auto drawn,
                   ctx_.app.derived.robot_bodies(ctx_.snapshot(), id_, ctx_.progress));
    if (drawn.generated) {
      for (std::size_t b = 0; b < drawn.bodies.size(); ++b)
        for (const evaluation::Drawable& d : drawn.bodies[b]) {
          RMP_TRY_ASSIGN(const std::string mesh,
                         write_mesh(b == 0 ? base_ : robot_.links[b - 1].name, *d.mesh));
          shape(bodies_[b], mesh, d.placement, d.colour, false);
        }
      notes_.emplace_back(
          "The robot has no designed bodies: those that are drawn for it were written as visual "
          "shapes, without collision shapes.");
      return {};
    }
    for (std::size_t b = 0; b <= robot_.links.size(); ++b) {
      if (b > 0 && !robot_.links[b - 1].visible) continue;
      const auto& parts = b == 0 ? robot_.base_parts : robot_.links[b - 1].parts;
      for (const model::BodyPart& p : parts)
        RMP_TRY(add_part(bodies_[b], p.what, model::pose(p.placement)));
    }
    return {};
  }

  Result<void> add_part(std::string& to, AnyId what, const Pose& at) {
    struct Open {
      AnyId what;
      Pose pose;
      MaterialId material;
    };
    std::vector<Open> stack{{what, at, {}}};
    while (!stack.empty()) {
      const Open open = stack.back();
      stack.pop_back();
      if (open.what.kind == Kind::object) {
        const auto* object = ctx_.snapshot().get(ObjectId{open.what.number});
        for (std::size_t i = object ? object->parts.size() : 0; i-- > 0;) {
          const model::ObjectPart& p = object->parts[i];
          stack.push_back({p.what, spatial::compose(open.pose, model::pose(p.placement)),
                           open.material.number ? open.material : p.material});
        }
        continue;
      }
      const SolidId id{open.what.number};
      const auto* solid = ctx_.snapshot().get(id);
      if (!solid) continue;
      Colour colour;
      if (const auto* m =
              ctx_.snapshot().get(open.material.number ? open.material : solid->material))
        colour = m->colour;
      if (primitive(to, *solid, open.pose, colour)) continue;
      std::string& mesh = solid_meshes_[open.what.number];
      if (mesh.empty()) {
        RMP_TRY_ASSIGN(const auto made, ctx_.app.derived.mesh(ctx_.snapshot(), id, ctx_.progress));
        RMP_TRY_ASSIGN(mesh, write_mesh(ctx_.snapshot().find(open.what)->name, *made));
      }
      shape(to, mesh, open.pose, colour, true);
    }
    return {};
  }

  /// Boxes, cylinders and spheres are said exactly; false = the solid is none.
  bool primitive(std::string& to, const model::Solid& s, const Pose& at, const Colour& colour) {
    if (s.nodes.size() != 1) return false;
    const model::SolidNode& n = s.nodes[0];
    const auto size = [&](std::size_t i) { return text::print(n.sizes[i]); };
    Pose t = spatial::compose(at, model::pose(n.placement));
    std::string form;
    double lift = 0;
    if (n.kind == CsgKind::box && n.sizes[3] == 0) {
      form = "<box size=\"" + size(0) + " " + size(1) + " " + size(2) + "\"/>";
      lift = n.sizes[2] / 2;
    } else if (n.kind == CsgKind::cylinder && n.sizes[2] == 0) {
      form = "<cylinder radius=\"" + size(0) + "\" length=\"" + size(1) + "\"/>";
      lift = n.sizes[1] / 2;
    } else if (n.kind == CsgKind::sphere) {
      form = "<sphere radius=\"" + size(0) + "\"/>";
    } else {
      return false;
    }
    shape(to, form, spatial::compose(t, spatial::translation({0, 0, lift})), colour, true);
    return true;
  }

  static void shape(std::string& to, const std::string& form, const Pose& at, const Colour& c,
                    bool collides) {
    const auto tone = [](float v) { return text::print_rounded(static_cast<double>(v), 4); };
    const std::string inside =
        "      " + origin(at) + "\n      <geometry>" + form + "</geometry>\n";
    const std::string colour = tone(c.r) + " " + tone(c.g) + " " + tone(c.b) + " " + tone(c.a);
    std::string look = colour;
    std::replace(look.begin(), look.end(), ' ', '_');
    to += "    <visual>\n" + inside + "      <material name=\"colour_" + look +
          "\"><color rgba=\"" + colour + "\"/></material>\n    </visual>\n";
    if (collides) to += "    <collision>\n" + inside + "    </collision>\n";
  }

  /// Writes an STL file in metres; `<mesh filename=.../>` for it.
  Result<std::string> write_mesh(const std::string& wanted, const Mesh& mesh) {
    std::string plain;
    for (const char c : wanted)
      plain +=
          (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-'
              ? c
              : '_';
    const std::filesystem::path folder = file_.stem().string() + "_meshes";
    const std::filesystem::path local = folder / (free_name(plain, meshes_taken_) + ".stl");
    for (const ProviderInfo& info : ctx_.app.registry.list(Exporter::kInterfaceId)) {
      if (!info.enabled) continue;
      RMP_TRY_ASSIGN(const auto exporter, ctx_.app.registry.create<Exporter>(info.name));
      const auto known = text::split(exporter->extensions(), ',');
      if (std::find(known.begin(), known.end(), "stl") == known.end()) continue;
      Map values;
      for (const ParamSpec& p : info.schema)
        if (p.name == "unit") values.set("unit", "m");
      RMP_TRY_ASSIGN(Map checked, check(info.schema, values));
      const auto params = make_params(std::move(checked));
      ExportItem item;
      item.name = plain;
      item.mesh = &mesh;
      ExportTask task;
      const std::string own = local.filename().string();
      task.extension = "stl";
      task.name = own;
      task.items = std::span(&item, 1);
      RMP_TRY_ASSIGN(const auto files, guarded(info.name, [&] {
                       return exporter->write(task, *params, ctx_.progress);
                     }));
      RMP_TRY(write_exported(files, file_.parent_path() / local, info.name));
      meshes_.push_back((file_.parent_path() / local).string());
      const std::string uri = wishes_.package.empty()
                                  ? local.generic_string()
                                  : "package://" + wishes_.package + "/" + local.generic_string();
      return "<mesh filename=\"" + escaped(uri) + "\"/>";
    }
    return error(ErrorCode::unsupported, "no plugin can write STL files for its bodies",
                 "plugin.list tells which plugins were found.");
  }

  // --- report --------------------------------------------------------------------------------

  void report_joint(const JointModel& m) {
    if (m.armature != 0) motors_.push_back(m.name);
    if (m.spring.stiffness != 0) springs_.push_back(m.name);
    if (m.friction.coulomb_negative != -m.friction.coulomb_positive) uneven_.push_back(m.name);
    if (m.passive) passive_.push_back(m.name);
    if (std::isfinite(m.max_acceleration) || std::isfinite(m.max_jerk)) jerks_.push_back(m.name);
  }

  static std::string counted(std::size_t n, const char* one, const char* more) {
    return std::to_string(n) + " " + (n == 1 ? one : more);
  }
  void note(const std::vector<std::string>& of, const std::string& what) {
    if (of.empty()) return;
    std::vector<std::string> names;
    for (std::size_t i = 0; i < of.size() && i < 6; ++i) names.push_back(text::quote(of[i]));
    if (of.size() > 6) names.push_back(std::to_string(of.size() - 6) + " more");
    notes_.push_back(what + ": " + text::enumerate(names) + ".");
  }

  void report() {
    const char* const own =
        " has no word in URDF; it stands in an element <robomosp> that only this program reads";
    if (rows_ > 0)
      notes_.push_back("The Denavit-Hartenberg rows of " + counted(rows_, "link", "links") +
                       " became origins and axes.");
    if (split_ > 0)
      notes_.push_back(counted(split_, "link has a frame", "links have frames") +
                       " beside the joint's axis, so that a link named \"..._body\" moves and "
                       "carries the frame.");
    if (merged_ > 0)
      notes_.push_back("The masses of " + counted(merged_, "fixed link", "fixed links") +
                       " were added to the moving links that carry them.");
    note(balls_,
         "URDF has no ball joint: three continuous joints about z, y and x without bodies "
         "between stand for it, with other coordinates");
    note(sequences_, "Joints of several axes became sequences of joints without bodies between");
    note(motors_, std::string("Motor inertia at the joint") + own);
    note(springs_, std::string("A spring") + own);
    note(uneven_, std::string("Coulomb friction that differs by direction") + own);
    note(passive_, std::string("That a joint has no motor") + own);
    note(jerks_, std::string("A limit of acceleration or jerk") + own);
    if (unlimited_ > 0)
      notes_.push_back(counted(unlimited_, "joint has", "joints have") +
                       " limits missing that URDF requires; they say 1e16.");
    std::vector<std::string> loops;
    for (const model::LoopClosure& l : robot_.loops) loops.push_back(l.name);
    note(loops, "URDF has no closed loops; these were left open");
    bool has_payload = robot_.payload.has_value();
    for (const model::RobotTool& t : robot_.tools) has_payload = has_payload || t.payload;
    if (has_payload) notes_.emplace_back("Payloads were added to the links that carry them.");
    if (!robot_.poses.empty()) notes_.emplace_back("Named poses were left out.");
    if (!robot_.pair_rules.empty())
      notes_.emplace_back("Rules of which bodies may touch were left out; SRDF files say them.");
    if (!robot_.parametric.parameters.empty() || !robot_.parametric.expressions.empty())
      notes_.emplace_back("Expressions were written as the numbers that they have now.");
  }

  CommandContext& ctx_;
  RobotId id_;
  const model::Robot& robot_;
  std::shared_ptr<const RobotModel> model_;
  std::filesystem::path file_;
  Wishes wishes_;
  std::string base_, xml_, joint_xml_;
  std::vector<robotics::LinkFrame> frames_;
  std::vector<robotics::LinkJoints> joints_;
  std::vector<std::string> bodies_, meshes_, notes_;
  std::set<std::string> links_taken_, joints_taken_, meshes_taken_;
  std::map<std::size_t, std::string> joint_names_;
  std::map<std::uint64_t, std::string> solid_meshes_;
  std::vector<std::string> balls_, sequences_, motors_, springs_, uneven_, passive_, jerks_;
  std::size_t link_count_ = 0, joint_count_ = 0, split_ = 0, merged_ = 0, rows_ = 0, unlimited_ = 0;
};

Result<Value> export_urdf(CommandContext& ctx, const Map& args) {
  const model::Robot& robot = content<model::Robot>(ctx, args);
  const std::string where = name_in(ctx, ref(args, "id"));
  for (const model::Link& l : robot.links)
    if (l.name.empty())
      return error(ErrorCode::invalid_argument, "one of its links has no name",
                   "URDF needs names; give it one.", where);
  RMP_TRY_ASSIGN(auto model, model_of(ctx, args));
  UrdfWriter::Wishes wishes;
  if (has(args, "package")) wishes.package = text_of(args, "package");
  wishes.with_bodies = flag(args, "bodies");
  return UrdfWriter(ctx, typed<model::Robot>(args), text_of(args, "file"), std::move(wishes),
                    std::move(model))
      .run()
      .in(where);
}

}  // namespace

RMP_COMMANDS(robot_exchange_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "robot.export_urdf",
       .classic = "",
       .summary = "Writes the robot as a URDF file, with its meshes beside it.",
       .details =
           "Links, joints, limits, masses, friction and followers are said in URDF's own words, "
           "boxes, cylinders and spheres exactly; other bodies become STL files in a folder "
           "`<file>_meshes`. What URDF has no words for stands in an element `<robomosp>` of the "
           "joint, which other programs pass over (motor inertia, springs, passive joints, uneven "
           "friction, limits of acceleration), or is left out (closed loops, poses). `notes` tells "
           "all of it, a sentence each. Masses are those that solvers see, payloads included. "
           "`import` reads the file back: with equal poses and torques, but for what notes tell.",
       .example = with_arm("local done = arm:export_urdf{file = \"example.urdf\"}\n"
                           "assert(done.joints >= 6)\nlocal back = import{file = \"example.urdf\", "
                           "name = \"back\"}\nassert(back[1].name == \"back\")"),
       .params = {self("robot"), needed("file", "path", "", "The file, *.urdf."),
                  optional("package", "string", "",
                           "ROS package that the file is for: meshes are then named "
                           "package://<package>/..."),
                  defaulted("bodies", "bool", "", true,
                            "False leaves out the shapes: joints and masses only.")},
       .returns = {"map",
                   "",
                   "",
                   {field("file", "string", "", "The file."),
                    field("links", "int", "", "Links in it."),
                    field("joints", "int", "", "Joints in it, fixed ones too."),
                    field("meshes", "list", "", "The mesh files written."),
                    field("notes", "list", "", "What was changed or left out, a sentence each.")}},
       .effect = Effect::files_write,
       .sometimes = Effect::processes,
       .run = export_urdf});
  return all;
}

}  // namespace robomosp::ioci
