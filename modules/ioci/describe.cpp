// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "ioci/segments.h"
#include "ioci/task_steps.h"
#include "ioci/solid_nodes.h"
#include "model/words.h"

namespace robomosp::ioci {
namespace {

Value number_or_nil(double v) { return std::isfinite(v) ? Value(v) : Value(); }

void set_if(Map& m, std::string key, Value v) {
  if (!v.is_nil()) m.set(std::move(key), std::move(v));
}

struct Describe {
  const document::Snapshot& s;
  Map& m;

  void operator()(const model::Material& x) const {
    m.set("density", x.density);
    m.set("colour", colour_value(x.colour));
    m.set("shininess", x.shininess);
    m.set("metalness", x.metalness);
    m.set("opacity", static_cast<double>(x.colour.a));
    if (x.ambient) m.set("ambient", colour_value(*x.ambient));
    if (x.specular) m.set("specular", colour_value(*x.specular));
    m.set("emission", colour_value(x.emission));
    m.set("description", x.description);
    m.set("source", x.source);
  }
  void operator()(const model::Solid& x) const {
    m.set("description", x.description);
    set_if(m, "material", ref_value(s, x.material));
    m.set("chord", x.chord);
    List nodes;
    for (const model::SolidNode& n : x.nodes) {
      Map node =
          node_map(x, static_cast<std::size_t>(&n - x.nodes.data()), *m.find("name")->as_string());
      node.erase("expressions");  // they are told for the solid
      if (n.parent >= 0) node.set("parent", x.nodes[static_cast<std::size_t>(n.parent)].name);
      nodes.emplace_back(std::move(node));
    }
    m.set("nodes", std::move(nodes));
    set_measured(x.measured);
  }
  void set_measured(const std::optional<model::MeasuredMass>& x) const {
    if (!x) return;
    Map measured = *mass_value(x->mass).as_map();
    measured.set("source", x->source);
    m.set("measured", std::move(measured));
  }
  void operator()(const model::Object& x) const {
    m.set("description", x.description);
    set_measured(x.measured);
    m.set("overlap", x.overlap == model::Overlap::once ? "once" : "sum");
    List parts;
    for (const model::ObjectPart& p : x.parts) {
      Map part{{"name", p.name},
               {"what", ref_value(s, p.what)},
               {"kind", to_string(p.what.kind)},
               {"placement", placement_value(p.placement)}};
      set_if(part, "material", ref_value(s, p.material));
      parts.emplace_back(std::move(part));
    }
    m.set("parts", std::move(parts));
  }
  [[nodiscard]] Value bodies(const std::vector<model::BodyPart>& parts) const {
    List out;
    for (const model::BodyPart& p : parts)
      out.emplace_back(Map{{"what", ref_value(s, p.what)},
                           {"kind", to_string(p.what.kind)},
                           {"placement", placement_value(p.placement)}});
    return out;
  }
  void operator()(const model::Robot& x) const {
    m.set("description", x.description);
    m.set("source", x.source);
    m.set("convention", x.convention == model::Convention::dh ? "dh" : "mdh");
    m.set("mass_source", x.mass_source == model::MassSource::given ? "given" : "designed");
    m.set("base", placement_value(x.base));
    m.set("base_parts", bodies(x.base_parts));
    List links;
    for (const model::Link& l : x.links) {
      Map link{{"name", l.name},
               {"parent", l.parent < 0 ? std::string("base")
                                       : x.links[static_cast<std::size_t>(l.parent)].name},
               {"joint", model::joint_word(l.joint)}};
      if (l.origin) {
        link.set("origin", placement_value(*l.origin));
        link.set("axis", vec_value(l.axis));
      } else {
        link.set("a", l.row.a);
        link.set("alpha", l.row.alpha);
        link.set("d", l.row.d);
        link.set("theta", l.row.theta);
      }
      if (l.convention)
        link.set("convention", *l.convention == model::Convention::dh ? "dh" : "mdh");
      if (l.mimic)
        link.set("mimic", Map{{"link", x.links[static_cast<std::size_t>(l.mimic->link)].name},
                              {"ratio", l.mimic->ratio},
                              {"offset", l.mimic->offset}});
      if (l.passive) link.set("passive", true);
      if (!(l.spring == model::Spring{})) {
        link.set("stiffness", l.spring.stiffness);
        link.set("rest", l.spring.rest);
      }
      set_if(link, "lower", number_or_nil(l.lower));
      set_if(link, "upper", number_or_nil(l.upper));
      set_if(link, "max_velocity", number_or_nil(l.max_velocity));
      set_if(link, "max_acceleration", number_or_nil(l.max_acceleration));
      set_if(link, "max_jerk", number_or_nil(l.max_jerk));
      set_if(link, "max_force", number_or_nil(l.max_force));
      link.set("drive", Map{{"motor_inertia", l.drive.motor_inertia},
                            {"gear_ratio", l.drive.gear_ratio},
                            {"viscous", l.drive.viscous},
                            {"coulomb_positive", l.drive.coulomb_positive},
                            {"coulomb_negative", l.drive.coulomb_negative}});
      if (l.given) link.set("given", mass_value(*l.given));
      link.set("parts", bodies(l.parts));
      link.set("visible", l.visible);
      links.emplace_back(std::move(link));
    }
    m.set("links", std::move(links));
    m.set("tool", placement_value(x.tool));
    Map poses;
    for (const model::NamedPose& p : x.poses) poses.set(p.name, NumericArray(p.q));
    m.set("poses", std::move(poses));
    m.set("ik", provider_value(x.ik));
    m.set("inverse_dynamics", provider_value(x.inverse_dynamics));
    m.set("forward_dynamics", provider_value(x.forward_dynamics));
    m.set("controller", provider_value(x.controller));
    m.set("skin_colour", colour_value(x.skin_colour));
    m.set("skin_accent", colour_value(x.skin_accent));
  }
  void operator()(const model::Trajectory& x) const {
    m.set("description", x.description);
    m.set("sample_time", x.sample_time);
    List segments;
    for (const model::TrajectorySegment& segment : x.segments)
      segments.push_back(segment_value(s, segment));
    m.set("segments", std::move(segments));
  }
  void operator()(const model::World& x) const {
    m.set("description", x.description);
    m.set("gravity", vec_value(x.gravity, "m/s^2"));
    List objects, robots, trajectories;
    for (const auto& o : x.objects)
      objects.emplace_back(Map{{"name", o.name},
                               {"what", ref_value(s, o.what)},
                               {"kind", to_string(o.what.kind)},
                               {"placement", placement_value(o.placement)}});
    for (const auto& r : x.robots)
      robots.emplace_back(Map{{"name", r.name},
                              {"robot", ref_value(s, r.robot)},
                              {"placement", placement_value(r.placement)},
                              {"q", NumericArray(r.q)}});
    for (const auto& t : x.trajectories)
      trajectories.emplace_back(Map{{"name", t.name},
                                    {"trajectory", ref_value(s, t.trajectory)},
                                    {"placement", placement_value(t.placement)}});
    m.set("objects", std::move(objects));
    m.set("robots", std::move(robots));
    m.set("trajectories", std::move(trajectories));
    set_members(m, s, x);
  }
  void operator()(const model::Task& x) const {
    m.set("description", x.description);
    m.set("steps", steps_value(s, x));
  }
};

}  // namespace

Map describe_record(const document::Snapshot& snapshot, AnyId id) {
  const model::Record* r = snapshot.find(id);
  Map m{{"name", r->name}, {"kind", to_string(id.kind)}, {"file", r->file}};
  std::visit(Describe{snapshot, m}, r->body);
  if (const model::Parametric* p = model::parametric_of(r->body)) {
    if (!p->parameters.empty()) m.set("parameters", parameters_value(*p));
    if (!p->expressions.empty()) m.set("expressions", expressions_map(*p));
  }
  return m;
}

}  // namespace robomosp::ioci
