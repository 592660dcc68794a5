// SPDX-License-Identifier: Apache-2.0
#include "document/digest.h"

namespace robomosp::document {

namespace {

using namespace model;

/// Feeds fields; one overload a type, so that a record's list of fields reads as such.
class Feeder {
 public:
  Feeder(Fingerprinter& fp, const FeedReference& reference) : fp_(fp), reference_(reference) {}

  void operator()(const Material& m) {
    all(m.description, m.source, m.density, m.colour, m.shininess, m.metalness, m.ambient,
        m.specular, m.emission);
  }
  void operator()(const Solid& s) {
    all(s.description, AnyId(s.material), s.chord, s.nodes, s.parametric, s.measured);
  }
  void operator()(const Object& o) {
    all(o.description, static_cast<int>(o.overlap), o.parts, o.parametric, o.measured);
  }
  void operator()(const Robot& r) {
    all(r.description, r.source, static_cast<int>(r.convention), static_cast<int>(r.mass_source),
        r.base, r.base_parts, r.links, r.tool, r.payload, r.tools, r.loops, r.poses, r.pair_rules,
        r.ik, r.inverse_dynamics, r.forward_dynamics, r.controller, r.skin_colour, r.skin_accent,
        r.parametric);
  }
  void operator()(const Trajectory& t) { all(t.description, t.sample_time, t.segments); }
  void operator()(const World& w) {
    all(w.description, w.gravity, w.objects, w.robots, w.trajectories, w.frames, w.lights, w.tasks,
        w.signals, w.attachments, w.pair_rules, w.parametric);
  }
  void operator()(const Task& t) { all(t.description, t.steps); }

 private:
  template <class... T>
  void all(const T&... values) {
    (add(values), ...);
  }
  template <class T>
  void add(const std::vector<T>& list) {
    fp_.add(static_cast<std::int64_t>(list.size()));
    for (const T& v : list) add(v);
  }
  void add(const std::vector<double>& list) { fp_.add(std::span<const double>(list)); }
  void add(const std::string& s) { fp_.add(std::string_view(s)); }
  void add(double v) { fp_.add(v); }
  void add(bool v) { fp_.add(v); }
  void add(int v) { fp_.add(static_cast<std::int64_t>(v)); }
  void add(std::int64_t v) { fp_.add(v); }
  void add(const Vec3& v) { fp_.add(std::span<const double>(v)); }
  void add(const Colour& c) {
    all(static_cast<double>(c.r), static_cast<double>(c.g), static_cast<double>(c.b),
        static_cast<double>(c.a));
  }
  void add(AnyId id) {
    fp_.add(static_cast<bool>(id));
    if (id) reference_(fp_, id);
  }
  void add(const Placement& p) {
    all(p.position, p.angles, static_cast<int>(p.notation), static_cast<int>(p.coordinates));
  }
  template <class T>
  void add(const std::optional<T>& v) {
    fp_.add(v.has_value());
    if (v) add(*v);
  }
  void add(const Parameter& p) { all(p.name, p.expression, p.unit, p.value, p.description); }
  void add(const Parametric& p) {
    all(p.parameters, static_cast<std::int64_t>(p.expressions.size()));
    for (const auto& [path, expression] : p.expressions) all(path, expression);
  }
  void add(const MeasuredMass& m) { all(m.mass, m.source); }
  void add(const std::array<double, 2>& p) { all(p[0], p[1]); }
  void add(const CsgCurve& c) { all(static_cast<int>(c.kind), c.points); }
  void add(const CsgLoop& l) { all(l.start, l.curves); }
  void add(const ProviderChoice& p) {
    all(p.name, static_cast<std::int64_t>(p.params.size()));
    for (const auto& [name, value] : p.params) {
      all(name, static_cast<int>(value.index()));
      std::visit([this](const auto& v) { add(v); }, value);
    }
  }
  void add(const SolidNode& n) {
    all(static_cast<int>(n.kind), n.name, static_cast<int>(n.parent), n.placement);
    fp_.add(std::span<const double>(n.sizes));
    all(n.select, n.primitive, n.is_global, static_cast<bool>(n.profile),
        static_cast<bool>(n.geometry));
    if (n.profile) add(n.profile->loops);
    if (n.geometry)
      all(static_cast<int>(n.geometry->form), static_cast<std::int64_t>(n.geometry->digest[0]),
          static_cast<std::int64_t>(n.geometry->digest[1]));
  }
  void add(const ObjectPart& p) { all(p.name, p.what, p.placement, AnyId(p.material)); }
  void add(const BodyPart& p) { all(p.what, p.placement); }
  void add(const MassProperties& m) {
    all(m.mass, m.com, m.inertia.xx, m.inertia.yy, m.inertia.zz, m.inertia.xy, m.inertia.yz,
        m.inertia.xz);
  }
  void add(const Mimic& m) { all(static_cast<int>(m.link), m.ratio, m.offset); }
  void add(Convention c) { add(static_cast<int>(c)); }
  void add(const Link& l) {
    all(l.name, static_cast<int>(l.parent), static_cast<int>(l.joint), l.row.a, l.row.alpha,
        l.row.d, l.row.theta, l.convention, l.origin, l.axis, l.mimic, l.passive, l.lower, l.upper,
        l.max_velocity, l.max_acceleration, l.max_jerk, l.max_force, l.drive.motor_inertia,
        l.drive.gear_ratio, l.drive.viscous, l.drive.coulomb_positive, l.drive.coulomb_negative,
        l.spring.stiffness, l.spring.rest, l.given, l.parts, l.visible);
  }
  void add(const RobotTool& t) { all(t.name, static_cast<int>(t.link), t.placement, t.payload); }
  void add(const LoopClosure& l) {
    all(l.name, static_cast<int>(l.kind), static_cast<int>(l.link_a), static_cast<int>(l.link_b),
        l.in_a, l.in_b);
  }
  void add(const NamedPose& p) { all(p.name, p.q); }
  void add(const PairRule& p) { all(p.a, p.b, p.is_allowed, p.reason); }
  void add(const Transition& t) { all(t.is_smooth, t.distance, t.speed); }
  void add(const TrajectorySegment& s) {
    all(s.shape, s.law, s.orientation, s.turning, s.points, s.joints, AnyId(s.stored), s.placement,
        s.transition);
  }
  void add(const PlacedObject& p) { all(p.name, p.what, p.placement); }
  void add(const PlacedRobot& p) { all(p.name, AnyId(p.robot), p.placement, p.q); }
  void add(const PlacedTrajectory& p) { all(p.name, AnyId(p.trajectory), p.placement); }
  void add(const PlacedFrame& p) { all(p.name, p.placement); }
  void add(const PlacedLight& p) {
    all(p.name, static_cast<int>(p.kind), p.placement, p.colour, p.intensity, p.angle);
  }
  void add(const PlacedTask& p) { all(p.name, AnyId(p.task), p.robot); }
  void add(const Signal& s) {
    all(s.name, static_cast<int>(s.kind), s.unit, s.initial, s.from, s.to, s.description);
  }
  void add(const Attachment& a) { all(a.object, a.robot, a.link, a.tool_T_object); }
  void add(const TaskStep& s) {
    all(static_cast<int>(s.kind), static_cast<int>(s.parent), s.robot, AnyId(s.trajectory), s.pose,
        s.joints, s.target, s.frame, s.profile, s.is_straight, s.speed, s.tool_speed, s.duration,
        s.object, s.link, s.signal, s.expression, s.timeout, AnyId(s.task), s.count, s.text);
  }

  Fingerprinter& fp_;
  const FeedReference& reference_;
};

std::size_t bytes(const ProviderChoice& p) {
  std::size_t n = p.name.size();
  for (const auto& [name, value] : p.params) {
    n += 96 + name.size();
    if (const auto* s = std::get_if<std::string>(&value)) n += s->size();
    if (const auto* v = std::get_if<std::vector<double>>(&value)) n += 8 * v->size();
  }
  return n;
}

std::size_t bytes(const Parametric& p) {
  std::size_t n = p.parameters.size() * sizeof(Parameter);
  for (const auto& v : p.parameters)
    n += v.name.size() + v.expression.size() + v.description.size();
  for (const auto& [path, expression] : p.expressions) n += 96 + path.size() + expression.size();
  return n;
}

std::size_t bytes(const std::vector<PairRule>& rules) {
  std::size_t n = rules.size() * sizeof(PairRule);
  for (const auto& r : rules) n += r.a.size() + r.b.size() + r.reason.size();
  return n;
}

struct Size {
  std::size_t operator()(const Material& m) const { return m.description.size() + m.source.size(); }
  std::size_t operator()(const Solid& s) const {
    std::size_t n = s.description.size() + s.nodes.size() * sizeof(SolidNode) + bytes(s.parametric);
    // Profiles and geometries are shared between the versions of a record; an edit copies none.
    for (const auto& node : s.nodes) n += node.name.size() + node.select.size();
    return n;
  }
  std::size_t operator()(const Object& o) const {
    std::size_t n =
        o.description.size() + o.parts.size() * sizeof(ObjectPart) + bytes(o.parametric);
    for (const auto& p : o.parts) n += p.name.size();
    return n;
  }
  std::size_t operator()(const Robot& r) const {
    std::size_t n = r.description.size() + r.source.size() + bytes(r.ik) +
                    bytes(r.inverse_dynamics) + bytes(r.forward_dynamics) +
                    r.base_parts.size() * sizeof(BodyPart) + r.links.size() * sizeof(Link) +
                    bytes(r.parametric) + bytes(r.pair_rules);
    for (const auto& l : r.links) n += l.name.size() + l.parts.size() * sizeof(BodyPart);
    for (const auto& p : r.poses) n += sizeof(NamedPose) + p.name.size() + 8 * p.q.size();
    return n;
  }
  std::size_t operator()(const Trajectory& t) const {
    std::size_t n = t.description.size();
    for (const auto& s : t.segments)
      n += sizeof(TrajectorySegment) + bytes(s.shape) + bytes(s.law) + bytes(s.orientation) +
           bytes(s.turning) + s.points.size() * sizeof(Placement) +
           (s.joints.empty() ? 0 : 8 * s.joints.size() * s.joints.front().size());
    return n;
  }
  std::size_t operator()(const World& w) const {
    std::size_t n = w.description.size() + w.objects.size() * sizeof(PlacedObject) +
                    w.robots.size() * sizeof(PlacedRobot) +
                    w.trajectories.size() * sizeof(PlacedTrajectory) + bytes(w.parametric) +
                    bytes(w.pair_rules);
    for (const auto& r : w.robots) n += 8 * r.q.size();
    return n + w.frames.size() * sizeof(PlacedFrame) + w.lights.size() * sizeof(PlacedLight) +
           w.tasks.size() * sizeof(PlacedTask) + w.signals.size() * sizeof(Signal) +
           w.attachments.size() * sizeof(Attachment);
  }
  std::size_t operator()(const Task& t) const {
    std::size_t n = t.description.size() + t.steps.size() * sizeof(TaskStep);
    for (const auto& s : t.steps) n += s.expression.size() + s.text.size() + 8 * s.joints.size();
    return n;
  }
};

}  // namespace

void feed(Fingerprinter& fp, const model::Body& body, const FeedReference& reference) {
  fp.add(to_string(static_cast<Kind>(body.index())));
  std::visit(Feeder(fp, reference), body);
}

Fingerprint record_fingerprint(const model::Record& record) {
  Fingerprinter fp("record/1");
  fp.add(std::string_view(record.name)).add(std::string_view(record.file));
  feed(fp, record.body, [](Fingerprinter& f, AnyId id) {
    f.add(static_cast<std::int64_t>(id.kind)).add(static_cast<std::int64_t>(id.number));
  });
  return fp.finish();
}

std::size_t record_bytes(const model::Record& record) {
  return sizeof(model::Record) + record.name.size() + record.file.size() +
         std::visit(Size{}, record.body);
}

}  // namespace robomosp::document
