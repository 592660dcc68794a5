// SPDX-License-Identifier: Apache-2.0
#include "io/print.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <tuple>
#include <vector>

#include "io/expressions.h"
#include "io/geometry.h"
#include "io/syntax.h"
#include "kernel/text.h"
#include "kernel/units.h"
#include "model/placement.h"
#include "model/words.h"
#include "robotics/coordinates.h"

namespace robomosp::io {

namespace {

using namespace model;
using text::quote;

constexpr std::size_t kMostIndent = 40;  ///< levels; deeper trees do not move further right

std::string name(const std::string& s) { return is_word(s) ? s : quote(s); }
std::string quantity(double v, std::string_view unit) { return units::print_quantity(v, unit); }

template <class Numbers>
std::string tuple(const Numbers& numbers, std::string_view unit) {
  std::string s = "(";
  for (std::size_t i = 0; i < std::size(numbers); ++i)
    s += (i ? ", " : "") + quantity(numbers[i], unit);
  return s + ")";
}

/// Fewest digits that give the same float again.
std::string shortest(float v) {
  for (int digits = 1; digits < 9; ++digits) {
    std::string s = text::print_rounded(static_cast<double>(v), digits);
    const auto back = text::read_real(s);
    if (back && static_cast<float>(*back) == v) return s;
  }
  return text::print_rounded(static_cast<double>(v), 9);
}
std::string tuple(const Colour& c) {
  std::string s = "(" + shortest(c.r) + ", " + shortest(c.g) + ", " + shortest(c.b);
  if (c.a != 1.0F) s += ", " + shortest(c.a);
  return s + ")";
}
bool same(const Colour& a, const Colour& b) {
  return a.r == b.r && a.g == b.g && a.b == b.b && a.a == b.a;
}

std::string parameter(const ProviderChoice::Param& p) {
  struct Visitor {
    std::string operator()(bool v) const { return v ? "true" : "false"; }
    std::string operator()(std::int64_t v) const { return std::to_string(v); }
    std::string operator()(double v) const {
      // A real stays a real: 5 would read back as an integer.
      std::string s = text::print(v);
      return s.find_first_of(".ein") == std::string::npos ? s + ".0" : s;
    }
    std::string operator()(const std::string& v) const { return quote(v); }
    std::string operator()(const std::vector<double>& v) const { return tuple(v, ""); }
  };
  return std::visit(Visitor{}, p);
}

/// Behind a number and on its line, the name would be taken for the number's unit: teeth 20  m 2.
bool reads_as_unit(std::string_view name) {
  const std::size_t end = name.find_first_of("._-");
  return units::parse(name.substr(0, end)).ok();
}

class Printer {
 public:
  Printer(const document::Snapshot& snapshot, const Record& record,
          const std::filesystem::path& file, const PathOf& path_of)
      : snapshot_(snapshot), file_(file), path_of_(path_of), texts_(record.body) {}

  std::string run(const Record& r) {
    line("robomosp " + std::string(to_string(r.kind())) + " " + std::to_string(kVersion));
    line("name " + name(r.name));
    std::visit([this](const auto& body) { print(body); }, r.body);
    return std::move(out_);
  }

 private:
  void print(const Material& m) {
    const Material d;
    words("description", m.description);
    words("source", m.source);
    line("density " + quantity(m.density, "kg/m^3") + " kg/m^3");
    if (!same(m.colour, d.colour)) line("colour " + tuple(m.colour));
    if (m.shininess != d.shininess) line("shininess " + quantity(m.shininess, ""));
    if (m.metalness != d.metalness) line("metalness " + quantity(m.metalness, ""));
    if (m.ambient) line("ambient " + tuple(*m.ambient));
    if (m.specular) line("specular " + tuple(*m.specular));
    if (!same(m.emission, d.emission)) line("emission " + tuple(m.emission));
  }

  void print(const Solid& s) {
    words("description", s.description);
    if (s.material) line("material " + quote(path_of_(s.material)));
    if (differs(s.chord, Solid{}.chord)) line("chord " + quantity(s.chord, "m"));
    named_parameters(s.parametric);
    measured(s.measured);
    if (s.nodes.empty()) return;
    // Pre-order with an explicit stack; children keep their order.
    std::vector<std::vector<std::size_t>> inner(s.nodes.size());
    for (std::size_t i = 1; i < s.nodes.size(); ++i)
      inner[static_cast<std::size_t>(s.nodes[i].parent)].push_back(i);
    struct Step {
      std::size_t node, next;
    };
    std::vector<Step> stack;
    const auto enter = [&](std::size_t i) {
      const SolidNode& n = s.nodes[i];
      const CsgNodeInfo& info = csg_info(n.kind);
      const std::string start = std::string(info.name) + " " + name(n.name);
      const std::vector<std::string> fields = node_fields(n);
      if (info.children == CsgChildren::none && !n.profile) return block(start, fields);
      std::string line = start + " {";
      for (const auto& f : fields) line += "  " + f;
      open(line);
      if (n.profile) profile(*n.profile);
      if (info.children == CsgChildren::none) return close();
      stack.push_back({i, 0});
    };
    enter(0);
    while (!stack.empty()) {
      Step& top = stack.back();
      if (top.next == inner[top.node].size()) {
        stack.pop_back();
        close();
      } else {
        enter(inner[top.node][top.next++]);
      }
    }
  }

  /// What stands on the node's line: all but its profile and inner nodes.
  std::vector<std::string> node_fields(const SolidNode& n) {
    std::vector<std::string> fields = placement(n.placement);
    if (n.is_global) fields.emplace_back("frame global");
    for (std::string& f : sizes(n)) fields.push_back(std::move(f));
    if (!n.select.empty()) fields.push_back("select " + quote(n.select));
    if (n.geometry) {
      fields.push_back("geometry " + quote(geometry_file_name(file_, *n.geometry)));
      if (!n.geometry->source.empty()) fields.push_back("source " + quote(n.geometry->source));
    }
    if (n.kind != CsgKind::custom) return fields;
    std::string primitive = "primitive " + name(n.primitive.name);
    if (!n.primitive.params.empty()) {
      std::string inner;
      for (const auto& [key, value] : n.primitive.params)
        inner += (inner.empty()        ? " "
                  : reads_as_unit(key) ? "\n" + std::string(2 * depth_ + 4, ' ')
                                       : "  ") +
                 key + " " + parameter(value) + behind(value);
      primitive += " {" + inner + " }";
    }
    fields.push_back(std::move(primitive));
    return fields;
  }

  std::string behind(const ProviderChoice::Param& p) const {
    const double* number = std::get_if<double>(&p);
    return number ? texts_.behind(*number) : std::string();
  }

  void profile(const CsgProfile& p) {
    open("profile {");
    for (const CsgLoop& l : p.loops) {
      if (!l.curves.empty() && l.curves[0].kind == CsgCurve::Kind::circle) {
        const auto& points = l.curves[0].points;
        block("loop", {"circle " + tuple(points[0], "m"), "radius " + quantity(points[1][0], "m")});
        continue;
      }
      open("loop {");
      line("start " + tuple(l.start, "m"));
      for (const CsgCurve& c : l.curves) {
        std::string s = c.kind == CsgCurve::Kind::line  ? "line"
                        : c.kind == CsgCurve::Kind::arc ? "arc"
                                                        : "spline";
        for (const auto& point : c.points) s += " " + tuple(point, "m");
        line(s);
      }
      close();
    }
    close();
  }

  /// Sizes that are not their default.
  std::vector<std::string> sizes(const SolidNode& n) {
    const CsgNodeInfo& info = csg_info(n.kind);
    std::vector<std::string> fields;
    for (std::size_t k = 0; k < csg_size_count(n.kind); ++k) {
      const CsgSize& size = info.sizes[k];
      if (size.required || differs(n.sizes[k], size.default_value))
        fields.push_back(std::string(size.name) + " " + quantity(n.sizes[k], size.unit));
    }
    return fields;
  }

  void print(const Object& o) {
    words("description", o.description);
    named_parameters(o.parametric);
    if (o.overlap != Overlap::once) line("overlap sum");
    measured(o.measured);
    for (const auto& p : o.parts) {
      std::vector<std::string> fields = body(p.what, p.placement);
      if (p.material) fields.push_back("material " + quote(path_of_(p.material)));
      block("part " + name(p.name), fields);
    }
  }

  void measured(const std::optional<MeasuredMass>& m) {
    if (!m) return;
    const Sym3& s = m->mass.inertia;
    std::vector<std::string> fields{
        "mass " + quantity(m->mass.mass, "kg"), "com " + tuple(m->mass.com, "m"),
        "inertia " + tuple(std::array{s.xx, s.yy, s.zz, s.xy, s.yz, s.xz}, "kg m^2")};
    if (!m->source.empty()) fields.push_back("source " + quote(m->source));
    block("measured", fields);
  }

  void print(const Robot& r) {
    words("description", r.description);
    words("source", r.source);
    named_parameters(r.parametric);
    line(r.convention == Convention::dh ? "convention dh" : "convention mdh");
    if (r.mass_source != MassSource::given) line("masses designed");
    if (differs(r.base)) block("base", placement(r.base));
    for (const auto& p : r.base_parts) block("base_part", body(p.what, p.placement));
    for (std::size_t i = 0; i < r.links.size(); ++i) link(r, i);
    if (differs(r.tool)) block("tool", placement(r.tool));
    if (r.payload) block("payload", mass(*r.payload));
    for (const auto& t : r.tools) tool(r, t);
    for (const auto& l : r.loops) loop(r, l);
    for (const auto& p : r.poses) line("pose " + name(p.name) + " " + joint_values(r, p.q));
    pair_rules(r.pair_rules);
    provider("ik", r.ik);
    provider("inverse_dynamics", r.inverse_dynamics);
    provider("forward_dynamics", r.forward_dynamics);
    provider("controller", r.controller);
    const Robot d;
    std::vector<std::string> skin;
    if (!same(r.skin_colour, d.skin_colour)) skin.push_back("colour " + tuple(r.skin_colour));
    if (!same(r.skin_accent, d.skin_accent)) skin.push_back("accent " + tuple(r.skin_accent));
    if (!skin.empty()) block("skin", skin);
  }

  void link(const Robot& r, std::size_t i) {
    const Link& l = r.links[i];
    const Link d;
    const bool slides = l.joint == JointKind::prismatic;
    open("link " + name(l.name) + " {");
    if (l.parent != static_cast<std::int32_t>(i) - 1) line("parent " + link_name(r, l.parent));
    if (l.joint != JointKind::revolute) line("joint " + std::string(joint_word(l.joint)));
    if (l.convention) line(*l.convention == Convention::dh ? "convention dh" : "convention mdh");
    if (l.origin) {
      block("origin", placement(*l.origin));
      if (differs(l.axis, d.axis)) line("axis " + tuple(l.axis, ""));
    }
    if (!l.origin)
      block("row", {"a " + quantity(l.row.a, "m"), "alpha " + quantity(l.row.alpha, "rad"),
                    "d " + quantity(l.row.d, "m"), "theta " + quantity(l.row.theta, "rad")});
    if (l.mimic) {
      std::vector<std::string> fields{"link " + link_name(r, l.mimic->link)};
      if (differs(l.mimic->ratio, 1)) fields.push_back("ratio " + quantity(l.mimic->ratio, ""));
      if (differs(l.mimic->offset, 0))
        fields.push_back("offset " + quantity(l.mimic->offset, slides ? "m" : "rad"));
      block("mimic", fields);
    }
    if (l.passive) line("passive true");
    if (differs(l.lower, d.lower) || differs(l.upper, d.upper))
      line("limits " + pair(l.lower, l.upper, slides ? "m" : "rad"));
    if (differs(l.max_velocity, d.max_velocity))
      line("max_velocity " + quantity(l.max_velocity, slides ? "m/s" : "rad/s"));
    if (differs(l.max_acceleration, d.max_acceleration))
      line("max_acceleration " + quantity(l.max_acceleration, slides ? "m/s^2" : "rad/s^2"));
    if (differs(l.max_jerk, d.max_jerk))
      line("max_jerk " + quantity(l.max_jerk, slides ? "m/s^3" : "rad/s^3"));
    if (differs(l.max_force, d.max_force))
      line("max_force " + quantity(l.max_force, slides ? "N" : "N m"));
    std::vector<std::string> drive;
    if (differs(l.drive.motor_inertia, 0))
      drive.push_back("motor_inertia " + quantity(l.drive.motor_inertia, "kg m^2"));
    if (differs(l.drive.gear_ratio, 1))
      drive.push_back("gear_ratio " + quantity(l.drive.gear_ratio, ""));
    if (differs(l.drive.viscous, 0))
      drive.push_back("viscous " + quantity(l.drive.viscous, "N m s/rad"));
    if (differs(l.drive.coulomb_positive, 0) || differs(l.drive.coulomb_negative, 0))
      drive.push_back("coulomb " + pair(l.drive.coulomb_positive, l.drive.coulomb_negative, "N m"));
    if (!drive.empty()) block("drive", drive);
    std::vector<std::string> spring;
    if (differs(l.spring.stiffness, 0))
      spring.push_back("stiffness " + quantity(l.spring.stiffness, slides ? "N/m" : "N m/rad"));
    if (differs(l.spring.rest, 0))
      spring.push_back("rest " + quantity(l.spring.rest, slides ? "m" : "rad"));
    if (!spring.empty()) block("spring", spring);
    if (l.given) block("given", mass(*l.given));
    for (const auto& p : l.parts) block("part", body(p.what, p.placement));
    if (!l.visible) line("visible false");
    close();
  }

  [[nodiscard]] static std::string link_name(const Robot& r, std::int32_t link) {
    return link < 0 ? std::string("base") : name(r.links[static_cast<std::size_t>(link)].name);
  }
  /// "mass ...  com (...)  inertia (...)", without what is zero.
  [[nodiscard]] std::vector<std::string> mass(const MassProperties& m) const {
    const Sym3& s = m.inertia;
    const std::array inertia{s.xx, s.yy, s.zz, s.xy, s.yz, s.xz};
    std::vector<std::string> fields{"mass " + quantity(m.mass, "kg")};
    if (differs(m.com, {})) fields.push_back("com " + tuple(m.com, "m"));
    if (inertia != std::array<double, 6>{}) fields.push_back("inertia " + tuple(inertia, "kg m^2"));
    return fields;
  }
  void tool(const Robot& r, const RobotTool& t) {
    std::vector<std::string> fields{"link " + link_name(r, t.link)};
    for (auto& f : placement(t.placement)) fields.push_back(std::move(f));
    if (!t.payload) return block("tool " + name(t.name), fields);
    std::string line = "tool " + name(t.name) + " {";
    for (const auto& f : fields) line += "  " + f;
    open(line);
    block("payload", mass(*t.payload));
    close();
  }
  void loop(const Robot& r, const LoopClosure& l) {
    open("loop " + name(l.name) + " {");
    line("kind " + std::string(loop_word(l.kind)));
    for (const auto& [word, link, at] :
         {std::tuple("a", l.link_a, &l.in_a), {"b", l.link_b, &l.in_b}}) {
      std::vector<std::string> fields{"link " + link_name(r, link)};
      for (auto& f : placement(*at)) fields.push_back(std::move(f));
      block(word, fields);
    }
    close();
  }

  void print(const Trajectory& t) {
    words("description", t.description);
    if (t.sample_time != Trajectory{}.sample_time)
      line("sample_time " + quantity(t.sample_time, "s"));
    for (const auto& s : t.segments) {
      if (s.stored) {
        open("segment {");
        line("trajectory " + quote(path_of_(s.stored)));
        for (const auto& field : placement(s.placement)) line(field);
      } else {
        open("segment " + name(s.shape.name) + " {");
        parameters(s.shape);
        provider("law", s.law);
        provider("orientation", s.orientation);
        provider("turning", s.turning);
        for (const auto& p : s.points) block("point", placement(p));
        for (const auto& q : s.joints) line("joints " + joint_values(Robot{}, q));
      }
      transition(s.transition);
      close();
    }
  }

  void transition(const Transition& t) {
    if (t == Transition{}) return;
    if (!t.is_smooth) return line("transition none");
    std::vector<std::string> fields;
    if (t.distance != 0) fields.push_back("distance " + quantity(t.distance, "m"));
    if (t.speed != 0) fields.push_back("speed " + quantity(t.speed, "m/s"));
    block("transition", fields);
  }

  void print(const World& w) {
    words("description", w.description);
    named_parameters(w.parametric);
    if (differs(w.gravity, World{}.gravity)) line("gravity " + tuple(w.gravity, "m/s^2"));
    for (const auto& o : w.objects) block("object " + name(o.name), body(o.what, o.placement));
    for (const auto& r : w.robots) {
      std::vector<std::string> fields{"robot " + quote(path_of_(r.robot))};
      for (auto& f : placement(r.placement)) fields.push_back(std::move(f));
      if (!r.q.empty()) {
        const Robot* robot = snapshot_.get(r.robot);
        fields.push_back("q " + joint_values(robot ? *robot : Robot{}, r.q));
      }
      block("robot " + name(r.name), fields);
    }
    for (const auto& t : w.trajectories) {
      std::vector<std::string> fields{"trajectory " + quote(path_of_(t.trajectory))};
      for (auto& f : placement(t.placement)) fields.push_back(std::move(f));
      block("trajectory " + name(t.name), fields);
    }
    for (const auto& f : w.frames) block("frame " + name(f.name), placement(f.placement));
    for (const auto& l : w.lights) light(l);
    for (const auto& t : w.tasks) {
      std::vector<std::string> fields{"task " + quote(path_of_(t.task))};
      if (!t.robot.empty()) fields.push_back("robot " + quote(t.robot));
      block("task " + name(t.name), fields);
    }
    for (const auto& s : w.signals) signal(s);
    for (const auto& a : w.attachments) {
      std::vector<std::string> fields{"object " + quote(a.object), "robot " + quote(a.robot)};
      if (!a.link.empty()) fields.push_back("link " + quote(a.link));
      for (auto& f : placement(a.tool_T_object)) fields.push_back(std::move(f));
      block("attachment", fields);
    }
    pair_rules(w.pair_rules);
  }
  void light(const PlacedLight& l) {
    const PlacedLight d;
    constexpr const char* kKinds[] = {"sun", "point", "spot"};
    std::vector<std::string> fields{std::string("kind ") +
                                    kKinds[static_cast<std::size_t>(l.kind)]};
    for (auto& f : placement(l.placement)) fields.push_back(std::move(f));
    if (!same(l.colour, d.colour)) fields.push_back("colour " + tuple(l.colour));
    if (l.intensity != d.intensity) fields.push_back("intensity " + quantity(l.intensity, ""));
    if (l.angle != d.angle) fields.push_back("angle " + quantity(l.angle, "rad"));
    block("light " + name(l.name), fields);
  }
  void signal(const Signal& s) {
    std::vector<std::string> fields{s.kind == SignalKind::digital ? "kind digital"
                                                                  : "kind analogue"};
    if (s.initial != 0) fields.push_back("initial " + quantity(s.initial, ""));
    for (const auto& [word, text] : {std::pair("unit ", &s.unit),
                                     {"from ", &s.from},
                                     {"to ", &s.to},
                                     {"description ", &s.description}})
      if (!text->empty()) fields.push_back(word + quote(*text));
    block("signal " + name(s.name), fields);
  }

  void print(const Task& t) {
    words("description", t.description);
    std::vector<std::int32_t> open{-1};
    for (std::size_t i = 0; i < t.steps.size(); ++i) {
      const TaskStep& s = t.steps[i];
      while (open.back() != s.parent) {
        open.pop_back();
        close();
      }
      const std::string word(to_string(s.kind));
      const auto fields = step(s);
      if (!is_block(s.kind)) {
        block(word, fields);
        continue;
      }
      open_step(word, fields);
      open.push_back(static_cast<std::int32_t>(i));
    }
    for (; open.size() > 1; open.pop_back()) close();
  }
  void open_step(const std::string& word, const std::vector<std::string>& fields) {
    std::string start = word + " {";
    for (const auto& f : fields) start += " " + f;
    open(start);
  }
  [[nodiscard]] std::vector<std::string> step(const TaskStep& s) const {
    std::vector<std::string> fields;
    const auto text = [&](const char* field, const std::string& value) {
      if (!value.empty()) fields.push_back(std::string(field) + " " + quote(value));
    };
    const auto number = [&](const char* field, double value, double standard, const char* unit) {
      if (value != standard)
        fields.push_back(std::string(field) + " " + units::print_with_unit(value, unit));
    };
    const bool is_move = s.kind == StepKind::move;
    text("robot", s.robot);
    if (s.trajectory) text("trajectory", path_of_(s.trajectory));
    text("pose", s.pose);
    if (!s.joints.empty()) fields.push_back("joints " + joint_values(Robot{}, s.joints));
    if (s.target) {
      std::string target = "target {";
      for (const auto& f : placement(*s.target)) target += " " + f;
      fields.push_back(target + " }");
    }
    text("frame", s.frame);
    if (!s.profile.empty()) fields.push_back("profile " + s.profile);
    if (s.is_straight) fields.emplace_back("path straight");
    number("speed", s.speed, 1, "");
    number("tool_speed", s.tool_speed, 0, "m/s");
    number(is_move ? "duration" : "time", s.duration, 0, "s");
    text("object", s.object);
    text(is_move ? "tool" : "link", s.link);
    text("signal", s.signal);
    text(s.kind == StepKind::set ? "value" : "condition", s.expression);
    number("timeout", s.timeout, 0, "s");
    if (s.task) text("task", path_of_(s.task));
    if (s.kind == StepKind::repeat) fields.push_back("count " + std::to_string(s.count));
    text("text", s.text);
    return fields;
  }

  void pair_rules(const std::vector<PairRule>& rules) {
    for (const auto& p : rules) {
      std::vector<std::string> fields{"a " + quote(p.a), "b " + quote(p.b)};
      if (!p.reason.empty()) fields.push_back("reason " + quote(p.reason));
      block(p.is_allowed ? "allowed_pair" : "checked_pair", fields);
    }
  }

  // ---- numbers: a number of the record itself is followed by its expression ----

  [[nodiscard]] std::string quantity(const double& v, std::string_view unit) const {
    return io::quantity(v, unit) + texts_.behind(v);
  }
  template <class Numbers>
  [[nodiscard]] std::string tuple(const Numbers& numbers, std::string_view unit) const {
    std::string s = "(";
    for (std::size_t i = 0; i < std::size(numbers); ++i)
      s += (i ? ", " : "") + quantity(numbers[i], unit);
    return s + ")";
  }
  static std::string tuple(const Colour& c) { return io::tuple(c); }
  [[nodiscard]] std::string pair(const double& a, const double& b, std::string_view unit) const {
    return "(" + quantity(a, unit) + ", " + quantity(b, unit) + ")";
  }
  /// Whether a number must be written although it is the default.
  [[nodiscard]] bool differs(const double& v, double standard) const {
    return v != standard || texts_.has(v);
  }
  [[nodiscard]] bool differs(const Placement& p) const { return p != Placement{} || texts_.has(p); }
  [[nodiscard]] bool differs(const Vec3& v, const Vec3& standard) const {
    return differs(v[0], standard[0]) || differs(v[1], standard[1]) || differs(v[2], standard[2]);
  }
  /// "at (...)  rpy (...)", without what is zero.
  [[nodiscard]] std::vector<std::string> placement(const Placement& p) const {
    std::vector<std::string> fields;
    if (differs(p.position, {}) || p.coordinates != PositionNotation::cartesian) {
      const auto units = position_units(p.coordinates);
      fields.push_back(
          std::string(word_of(p.coordinates)) + " (" + quantity(p.position[0], units[0]) + ", " +
          quantity(p.position[1], units[1]) + ", " + quantity(p.position[2], units[2]) + ")");
    }
    if (differs(p.angles, {}) || p.notation != AngleNotation::rpy)
      fields.push_back(std::string(word_of(p.notation)) + " " + tuple(p.angles, "rad"));
    return fields;
  }
  void named_parameters(const Parametric& p) {
    for (const Parameter& v : p.parameters) line(print_parameter(v));
  }

  // ---- parts of records ----

  std::vector<std::string> body(AnyId what, const Placement& at) {
    std::vector<std::string> fields{std::string(to_string(what.kind)) + " " +
                                    quote(path_of_(what))};
    for (auto& f : placement(at)) fields.push_back(std::move(f));
    return fields;
  }
  [[nodiscard]] std::string joint_values(const Robot& r, const std::vector<double>& q) const {
    const std::vector<std::string_view> joint_units = robotics::coordinate_units(r);
    const bool fits = joint_units.size() == q.size();
    std::string s = "(";
    for (std::size_t i = 0; i < q.size(); ++i)
      s += (i ? ", " : "") + quantity(q[i], fits ? joint_units[i] : "");
    return s + ")";
  }
  void provider(const std::string& field, const ProviderChoice& p) {
    if (p.name.empty() && p.params.empty()) return;
    const std::string start = p.name.empty() ? field : field + " " + name(p.name);
    if (p.params.empty()) return line(start);
    open(start + " {");
    parameters(p);
    close();
  }
  void parameters(const ProviderChoice& p) {
    for (const auto& [key, value] : p.params) line(key + " " + parameter(value));
  }
  void words(const std::string& field, const std::string& s) {
    if (!s.empty()) line(field + " " + quote(s));
  }

  // ---- lines ----

  void line(const std::string& s) {
    out_.append(2 * std::min(depth_, kMostIndent), ' ');
    out_ += s;
    out_ += '\n';
  }
  void open(const std::string& s) {
    line(s);
    ++depth_;
  }
  void close() {
    --depth_;
    line("}");
  }
  /// `start { field  field }` on one line.
  void block(const std::string& start, const std::vector<std::string>& fields) {
    std::string s = start + " {";
    for (std::size_t i = 0; i < fields.size(); ++i) s += (i ? "  " : " ") + fields[i];
    line(s + " }");
  }

  const document::Snapshot& snapshot_;
  const std::filesystem::path& file_;
  const PathOf& path_of_;
  ExpressionTexts texts_;
  std::string out_;
  std::size_t depth_ = 0;
};

}  // namespace

Result<std::string> print_record(const document::Snapshot& snapshot, const Record& record,
                                 const std::filesystem::path& file, const PathOf& path_of) {
  return Printer(snapshot, record, file, path_of).run(record);
}

}  // namespace robomosp::io
