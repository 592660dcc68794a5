// SPDX-License-Identifier: Apache-2.0
#include "io/bind.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <unordered_map>

#include "document/validate.h"
#include "io/expressions.h"
#include "kernel/text.h"
#include "kernel/units.h"
#include "model/parametric.h"
#include "model/placement.h"
#include "model/words.h"
#include "robotics/coordinates.h"

namespace robomosp::io {

namespace {

using namespace model;
using text::quote;

constexpr Colour kNotWritten{-1, -1, -1, 1};  ///< no file can say this
constexpr std::uint32_t kFile =
    std::numeric_limits<std::uint32_t>::max();  ///< the outermost "block"

/// One field that a block may have.
struct Rule {
  std::string_view name;
  std::function<Result<void>(std::uint32_t)> read;  ///< gets the field's index
  bool is_repeated = false;
  bool is_required = false;
};

/// The kind of node that a field is; a number, as in `fillet 2 mm`, is a size.
std::optional<CsgKind> csg_kind(const Field& f) {
  const CsgNodeInfo* info = f.argument == Argument::number ? nullptr : csg_info(f.name);
  return info ? std::optional(info->kind) : std::nullopt;
}

class Binder {
 public:
  explicit Binder(const Syntax& s) : s_(s) {}

  Result<Bound> run() {
    const auto kind = kind_from(s_.kind);
    if (!kind) {
      std::vector<std::string> kinds;
      for (const Kind k : kAllKinds) kinds.emplace_back(to_string(k));
      std::string hint = text::did_you_mean(s_.kind, kinds);
      if (hint.empty()) hint = "Kinds are " + text::enumerate(kinds) + ".";
      return s_.at(s_.kind_offset, ErrorCode::syntax, quote(s_.kind) + " is not a kind of record",
                   hint);
    }
    switch (*kind) {
      case Kind::material: RMP_TRY(material()); break;
      case Kind::solid: RMP_TRY(solid()); break;
      case Kind::object: RMP_TRY(object()); break;
      case Kind::robot: RMP_TRY(robot()); break;
      case Kind::trajectory: RMP_TRY(trajectory()); break;
      case Kind::world: RMP_TRY(world()); break;
      case Kind::task: RMP_TRY(task()); break;
    }
    RMP_TRY(bind_expressions(s_, out_));
    return std::move(out_);
  }

 private:
  using Index = std::uint32_t;
  using Skip = std::function<bool(Index)>;

  // ---- records ----

  Result<void> material() {
    Material m;
    RMP_TRY(block(
        kFile, "a material",
        {name_rule(), string("description", m.description), string("source", m.source),
         number("density", "kg/m^3", m.density, true), colour("colour", m.colour),
         number("shininess", "", m.shininess), number("metalness", "", m.metalness),
         colour("ambient", m.ambient.emplace(kNotWritten)),
         colour("specular", m.specular.emplace(kNotWritten)), colour("emission", m.emission)}));
    for (auto* c : {&m.ambient, &m.specular})
      if ((*c)->r < 0) c->reset();
    out_.record.body = std::move(m);
    return {};
  }

  Result<void> solid() {
    Solid s;
    std::optional<Index> root;
    const Skip is_node = [&](Index i) { return csg_kind(at(i)).has_value(); };
    RMP_TRY(
        block(kFile, "a solid",
              {name_rule(), string("description", s.description),
               reference("material", {Kind::material}, "the solid",
                         [](Body& b, AnyId id) { std::get<Solid>(b).material = {id.number}; }),
               number("chord", "m", s.chord), parameter_rule(s.parametric), measured(s.measured)},
              is_node));
    for (Index i = 0; i < s_.fields.size(); i = at(i).end) {
      if (!is_node(i)) continue;
      if (root)
        return s_.at(at(i).offset, ErrorCode::syntax,
                     "a solid has a single top-level node, and this is the second",
                     "Put both inside a union, difference or intersection.");
      root = i;
    }
    if (root) RMP_TRY(nodes(s, *root));
    out_.record.body = std::move(s);
    return {};
  }

  /// Fields stand in pre-order, so one pass over them makes the flat tree at any depth.
  Result<void> nodes(Solid& s, Index root) {
    std::unordered_map<std::int32_t, std::int32_t> node_of;  // field -> node
    std::unordered_map<std::string_view, Index> named;
    std::vector<std::pair<std::size_t, std::string_view>> unnamed;
    for (Index i = root; i < at(root).end; ++i) {
      const Field& f = at(i);
      const auto parent = node_of.find(f.parent);
      const auto kind = csg_kind(f);
      if (!kind || (i != root && parent == node_of.end())) continue;
      SolidNode n;
      n.kind = *kind;
      n.parent = i == root ? -1 : parent->second;
      const std::size_t index = s.nodes.size();
      if (f.argument == Argument::none) {
        unnamed.emplace_back(index, f.name);
      } else {
        RMP_TRY(read_name(i, n.name, "node"));
        if (const auto [it, is_new] = named.emplace(f.text, i); !is_new)
          return twice("node", n.name, i, it->second);
      }
      RMP_TRY(node(i, index, n));
      out_.places[{"node", index}] = f.offset;
      node_of.emplace(static_cast<std::int32_t>(i), static_cast<std::int32_t>(index));
      s.nodes.push_back(std::move(n));
    }
    std::unordered_map<std::string_view, int> counts;
    for (const auto& [index, kind] : unnamed) {
      std::string name;
      do {
        name = std::string(kind) + "_" + std::to_string(++counts[kind]);
      } while (named.contains(name));
      s.nodes[index].name = std::move(name);
    }
    return {};
  }

  Result<void> node(Index i, std::size_t index, SolidNode& n) {
    const CsgNodeInfo& info = csg_info(n.kind);
    const bool is_operation = info.children != CsgChildren::none;
    std::vector<Rule> rules;
    for (std::size_t k = 0; k < csg_size_count(n.kind); ++k) {
      const CsgSize& size = info.sizes[k];
      if (!size.required) n.sizes[k] = size.default_value;
      rules.push_back(number(size.name, size.unit, n.sizes[k], size.required));
    }
    placement(rules, n.placement);
    rules.push_back(
        words("frame", {"parent", "global"}, [&](std::size_t k) { n.is_global = k == 1; }));
    if (n.kind == CsgKind::fillet || n.kind == CsgKind::chamfer)
      rules.push_back(string("select", n.select));
    if (n.kind == CsgKind::prism || n.kind == CsgKind::revolution)
      rules.push_back(Rule{"profile", [&](Index k) { return profile(k, n.profile); }, false, true});
    if (n.kind == CsgKind::custom) {
      rules.push_back(provider("primitive", n.primitive));
      rules.back().is_required = true;
    }
    GeometryReference geometry;
    if (n.kind == CsgKind::imported) {
      rules.push_back(Rule{"geometry",
                           [&](Index k) -> Result<void> {
                             geometry.offset = at(k).argument_offset;
                             RMP_TRY_ASSIGN(geometry.path, path(k));
                             return {};
                           },
                           false, true});
      rules.push_back(string("source", geometry.source));
    }
    const Skip is_inner = [&](Index k) { return csg_kind(at(k)).has_value(); };
    RMP_TRY(need_block(i));
    RMP_TRY(block(i, article(at(i).name), rules, is_inner));
    if (n.kind == CsgKind::imported) {
      geometry.node = index;
      out_.geometries.push_back(std::move(geometry));
    }
    if (is_operation) return {};
    for (Index k = i + 1; k < at(i).end; k = at(k).end)
      if (is_inner(k))
        return s_.at(at(k).offset, ErrorCode::syntax,
                     article(at(i).name) + " is a primitive and has no nodes inside",
                     "Put both inside a union, difference or intersection.");
    return {};
  }

  /// `profile { loop { ... } }`
  Result<void> profile(Index i, std::shared_ptr<const CsgProfile>& out) {
    CsgProfile p;
    RMP_TRY(need_block(i, true));
    RMP_TRY(block(i, "a profile", {repeated("loop", [&](Index k) { return loop(k, p); })}));
    out = std::make_shared<const CsgProfile>(std::move(p));
    return {};
  }

  /// `loop { start (0, 0)  line (1, 0)  arc (1, 1) (0, 1) }`, or `loop { circle (0, 0)  radius 1 }`
  Result<void> loop(Index i, CsgProfile& profile) {
    CsgLoop l;
    std::optional<std::array<double, 2>> start, centre;
    double radius = 0;
    bool has_radius = false;
    RMP_TRY(need_block(i, true));
    const auto point = [this](std::string_view name, std::optional<std::array<double, 2>>& to) {
      return Rule{name, [this, &to](Index k) { return read_tuple(k, "m", to.emplace()); }};
    };
    const auto curve = [&](std::string_view name, CsgCurve::Kind kind) {
      return repeated(name, [this, &l, kind](Index k) { return curves(k, kind, l); });
    };
    Rule radius_rule = number("radius", "m", radius);
    radius_rule.read = [read = radius_rule.read, &has_radius](Index k) {
      has_radius = true;
      return read(k);
    };
    RMP_TRY(block(i, "a loop",
                  {point("start", start), curve("line", CsgCurve::Kind::line),
                   curve("arc", CsgCurve::Kind::arc), curve("spline", CsgCurve::Kind::spline),
                   point("circle", centre), radius_rule}));
    if (centre) {
      if (start || !l.curves.empty())
        return fail(i, "a loop with a circle has nothing else in it",
                    "Put the other curves into a loop of their own.");
      if (!has_radius) return fail(i, "the circle of this loop has no radius");
      l.curves.push_back({CsgCurve::Kind::circle, {*centre, {radius, 0}}});
    } else {
      if (has_radius) return fail(i, "this loop has a radius but no circle");
      if (!start) return fail(i, "this loop has no start", "Such as: start (0, 0)");
      l.start = *start;
    }
    profile.loops.push_back(std::move(l));
    return {};
  }

  /// A line for each point, an arc for two, one spline through all.
  Result<void> curves(Index i, CsgCurve::Kind kind, CsgLoop& l) {
    RMP_TRY(no_block(i, true));
    const Field& f = at(i);
    if (f.argument != Argument::tuple || f.numbers != 2 * f.tuples)
      return s_.at(f.argument_offset, ErrorCode::syntax,
                   quote(f.name) + " needs points such as (10 mm, 0)");
    CsgCurve c{kind, {}};
    for (std::uint32_t k = 0; k < f.tuples; ++k) {
      const std::uint32_t n = f.first_number + 2 * k;
      RMP_TRY_ASSIGN(const double x, quantity(s_.numbers[n], "m"));
      RMP_TRY_ASSIGN(const double y, quantity(s_.numbers[n + 1], "m"));
      c.points.push_back({x, y});
      if (kind != CsgCurve::Kind::line) continue;
      l.curves.push_back(std::move(c));
      c = {kind, {}};
    }
    if (kind == CsgCurve::Kind::line) return {};
    if (kind == CsgCurve::Kind::arc && f.tuples != 2)
      return fail(i, "an arc needs two points: one on its way and its end");
    l.curves.push_back(std::move(c));
    return {};
  }

  Result<void> object() {
    Object o;
    std::unordered_map<std::string, Index> named;
    Result<void> fields_read = block(
        kFile, "an object",
        {name_rule(), string("description", o.description), parameter_rule(o.parametric),
         words("overlap", {"once", "sum"},
               [&](std::size_t k) { o.overlap = static_cast<Overlap>(k); }),
         measured(o.measured), repeated("part", [&](Index i) -> Result<void> {
           ObjectPart p;
           const std::size_t at_part = o.parts.size();
           RMP_TRY(element(i, "part", at_part, p.name, named));
           std::vector<Rule> rules = body("part " + quote(p.name), [at_part](Body& b, AnyId id) {
             std::get<Object>(b).parts[at_part].what = id;
           });
           rules.push_back(reference("material", {Kind::material}, "part " + quote(p.name),
                                     [at_part](Body& b, AnyId id) {
                                       std::get<Object>(b).parts[at_part].material = {id.number};
                                     }));
           placement(rules, p.placement);
           RMP_TRY(block(i, "a part", rules));
           RMP_TRY(need_body(i));
           o.parts.push_back(std::move(p));
           return {};
         })});
    RMP_TRY(std::move(fields_read));
    out_.record.body = std::move(o);
    return {};
  }

  Result<void> robot() {
    Robot r;
    std::unordered_map<std::string, Index> links, poses, tools, loops;
    std::optional<Index> main_tool;
    std::vector<Index> pose_fields, loop_fields;
    Result<void> fields_read = block(
        kFile, "a robot",
        {name_rule(),
         string("description", r.description),
         string("source", r.source),
         words("convention", {"dh", "mdh"},
               [&](std::size_t k) { r.convention = static_cast<Convention>(k); }),
         words("masses", {"given", "designed"},
               [&](std::size_t k) { r.mass_source = static_cast<MassSource>(k); }),
         parameter_rule(r.parametric),
         placement_block("base", r.base),
         repeated("base_part",
                  [&](Index i) -> Result<void> {
                    const std::size_t k = r.base_parts.size();
                    return body_part(i, "a base part", r.base_parts, [k](Body& b, AnyId id) {
                      std::get<Robot>(b).base_parts[k].what = id;
                    });
                  }),
         repeated("link", [&](Index i) { return link(i, r, links); }),
         repeated("tool", [&](Index i) { return tool(i, r, main_tool, tools); }),
         mass_block("payload", "the payload", r.payload),
         repeated("loop",
                  [&](Index i) -> Result<void> {
                    loop_fields.push_back(i);
                    return {};
                  }),
         repeated("pose",
                  [&](Index i) -> Result<void> {
                    pose_fields.push_back(i);
                    return {};
                  }),
         pair_rule("allowed_pair", true, r.pair_rules),
         pair_rule("checked_pair", false, r.pair_rules),
         provider("ik", r.ik),
         provider("inverse_dynamics", r.inverse_dynamics),
         provider("forward_dynamics", r.forward_dynamics),
         provider("controller", r.controller),
         Rule{"skin", [&](Index i) -> Result<void> {
                RMP_TRY(need_block(i, true));
                return block(i, "a skin",
                             {colour("colour", r.skin_colour), colour("accent", r.skin_accent)});
              }}});
    RMP_TRY(std::move(fields_read));
    for (const Index i : loop_fields) RMP_TRY(loop(i, r, loops));
    for (RobotTool& t : r.tools) RMP_TRY(find_tool_link(r, t));
    const std::vector<std::string_view> units = robotics::coordinate_units(r);
    for (const Index i : pose_fields) RMP_TRY(pose(i, r, units, poses));
    out_.record.body = std::move(r);
    return {};
  }

  /// `pose home (0, 90 deg)`
  Result<void> pose(Index i, Robot& r, const std::vector<std::string_view>& units,
                    std::unordered_map<std::string, Index>& named) {
    NamedPose p;
    RMP_TRY(element(i, "pose", r.poses.size(), p.name, named, false));
    const Field& f = at(i);
    if (f.has_block || !f.has_values)
      return fail(i, "pose " + quote(p.name) + " needs its joint values in parentheses");
    if (f.numbers != units.size())
      return s_.at(f.offset, ErrorCode::syntax,
                   "pose " + quote(p.name) + " has " + std::to_string(f.numbers) +
                       " joint values; the robot has " + robotics::counted_coordinates(r));
    for (std::uint32_t k = 0; k < f.numbers; ++k) {
      RMP_TRY_ASSIGN(const double v, quantity(s_.numbers[f.first_number + k], units[k]));
      p.q.push_back(v);
    }
    r.poses.push_back(std::move(p));
    return {};
  }

  Result<void> link(Index i, Robot& r, std::unordered_map<std::string, Index>& named) {
    Link l;
    const std::size_t index = r.links.size();
    l.parent = static_cast<std::int32_t>(index) - 1;
    RMP_TRY(element(i, "link", index, l.name, named));
    // The unit of limits depends on the joint, which may stand after them.
    for (Index k = i + 1; k < at(i).end; k = at(k).end)
      if (at(k).name == "joint") l.joint = joint_kind(at(k).text).value_or(l.joint);
    const bool slides = l.joint == JointKind::prismatic;
    bool has_row = false;
    Result<void> fields_read = block(
        i, "a link",
        {Rule{"parent", [&](Index k) { return parent(k, r, l); }},
         words("joint", {kJointWords.begin(), kJointWords.end()},
               [&](std::size_t k) { l.joint = static_cast<JointKind>(k); }),
         words("convention", {"dh", "mdh"},
               [&](std::size_t k) { l.convention = static_cast<Convention>(k); }),
         placement_block("origin", l.origin), tuple("axis", "", l.axis),
         Rule{"mimic",
              [&](Index k) -> Result<void> {
                RMP_TRY(need_block(k, true));
                Mimic& m = l.mimic.emplace();
                Rule link_rule{"link", [&](Index n) { return earlier_link(n, r, l, m.link); }};
                link_rule.is_required = true;
                return block(k, "a mimic joint",
                             {std::move(link_rule), number("ratio", "", m.ratio),
                              number("offset", slides ? "m" : "rad", m.offset)});
              }},
         words("passive", {"false", "true"}, [&](std::size_t k) { l.passive = k == 1; }),
         Rule{"row",
              [&](Index k) -> Result<void> {
                has_row = true;
                RMP_TRY(need_block(k, true));
                return block(k, "a DH row",
                             {number("a", "m", l.row.a), number("alpha", "rad", l.row.alpha),
                              number("d", "m", l.row.d), number("theta", "rad", l.row.theta)});
              }},
         Rule{"limits",
              [&](Index k) -> Result<void> {
                std::array<double, 2> v{};
                RMP_TRY(read_tuple(k, slides ? "m" : "rad", v));
                l.lower = v[0];
                l.upper = v[1];
                return {};
              }},
         number("max_velocity", slides ? "m/s" : "rad/s", l.max_velocity),
         number("max_acceleration", slides ? "m/s^2" : "rad/s^2", l.max_acceleration),
         number("max_jerk", slides ? "m/s^3" : "rad/s^3", l.max_jerk),
         number("max_force", slides ? "N" : "N m", l.max_force),
         Rule{"drive",
              [&](Index k) -> Result<void> {
                RMP_TRY(need_block(k, true));
                return block(k, "a drive",
                             {number("motor_inertia", "kg m^2", l.drive.motor_inertia),
                              number("gear_ratio", "", l.drive.gear_ratio),
                              number("viscous", "N m s/rad", l.drive.viscous),
                              Rule{"coulomb", [&](Index c) -> Result<void> {
                                     std::array<double, 2> v{};
                                     RMP_TRY(read_tuple(c, "N m", v));
                                     l.drive.coulomb_positive = v[0];
                                     l.drive.coulomb_negative = v[1];
                                     return {};
                                   }}});
              }},
         Rule{"spring",
              [&](Index k) -> Result<void> {
                RMP_TRY(need_block(k, true));
                return block(k, "a spring",
                             {number("stiffness", slides ? "N/m" : "N m/rad", l.spring.stiffness),
                              number("rest", slides ? "m" : "rad", l.spring.rest)});
              }},
         mass_block("given", "the given mass properties", l.given),
         repeated("part",
                  [&](Index k) -> Result<void> {
                    const std::size_t p = l.parts.size();
                    return body_part(k, "a part of link " + quote(l.name), l.parts,
                                     [index, p](Body& b, AnyId id) {
                                       std::get<Robot>(b).links[index].parts[p].what = id;
                                     });
                  }),
         words("visible", {"false", "true"}, [&](std::size_t k) { l.visible = k == 1; })});
    RMP_TRY(std::move(fields_read));
    if (!has_row && !l.origin)
      return fail(i, "\"row\" is missing in a link",
                  "Give its row, or origin and axis of its joint.");
    if (has_row && l.origin)
      return fail(i, "link " + quote(l.name) + " has a row and an origin",
                  "Keep the one that is meant.");
    r.links.push_back(std::move(l));
    return {};
  }

  /// `mass 2  com (0, 0, 0.1)  inertia (...)`
  Rule mass_block(std::string_view name, std::string what, std::optional<MassProperties>& out) {
    return {name, [this, what = std::move(what), &out](Index i) -> Result<void> {
              RMP_TRY(need_block(i, true));
              MassProperties& m = out.emplace();
              return block(i, what,
                           {number("mass", "kg", m.mass, true), tuple("com", "m", m.com),
                            Rule{"inertia", [&](Index c) -> Result<void> {
                                   std::array<double, 6> v{};
                                   RMP_TRY(read_tuple(c, "kg m^2", v));
                                   m.inertia = {v[0], v[1], v[2], v[3], v[4], v[5]};
                                   return {};
                                 }}});
            }};
  }

  /// `tool { at (0, 0, 0.1) }` on the last link, or `tool camera { link wrist  at (0, 0, 0.1) }`.
  Result<void> tool(Index i, Robot& r, std::optional<Index>& main,
                    std::unordered_map<std::string, Index>& named) {
    if (at(i).argument == Argument::none) {
      if (main)
        return fail(i, "\"tool\" is given twice in a robot",
                    "The first one is at " + s_.place(at(*main).offset) +
                        ". Further tools have a name and a link.");
      main = i;
      return placement_block("tool", r.tool).read(i);
    }
    RobotTool t;
    RMP_TRY(element(i, "tool", r.tools.size(), t.name, named));
    // Links may stand behind the tool, so that its link is found when all are read.
    std::vector<Rule> rules{Rule{"link", [](Index) -> Result<void> { return {}; }},
                            mass_block("payload", "the payload", t.payload)};
    rules.front().is_required = true;
    placement(rules, t.placement);
    RMP_TRY(block(i, "a tool", rules));
    tool_fields_.push_back(i);
    r.tools.push_back(std::move(t));
    return {};
  }
  Result<void> find_tool_link(const Robot& r, RobotTool& t) {
    const Index i = tool_fields_[static_cast<std::size_t>(&t - r.tools.data())];
    for (Index k = i + 1; k < at(i).end; k = at(k).end)
      if (at(k).name == "link") return any_link(k, r, t.link);
    return {};
  }

  /// `loop pin { kind planar  a { link coupler  at (...) }  b { link rocker  at (...) } }`
  Result<void> loop(Index i, Robot& r, std::unordered_map<std::string, Index>& named) {
    LoopClosure l;
    RMP_TRY(element(i, "loop", r.loops.size(), l.name, named));
    const auto side = [&](std::string_view name, std::int32_t& link, Placement& frame) {
      Rule rule{
          name, [&](Index k) -> Result<void> {
            RMP_TRY(need_block(k, true));
            std::vector<Rule> rules{Rule{"link", [&](Index n) { return any_link(n, r, link); }}};
            rules.front().is_required = true;
            placement(rules, frame);
            return block(k, "a side of a loop", rules);
          }};
      rule.is_required = true;
      return rule;
    };
    RMP_TRY(block(i, "a loop",
                  {words("kind", {kLoopWords.begin(), kLoopWords.end()},
                         [&](std::size_t k) { l.kind = static_cast<LoopKind>(k); }),
                   side("a", l.link_a, l.in_a), side("b", l.link_b, l.in_b)}));
    r.loops.push_back(std::move(l));
    return {};
  }

  /// The link that a word names, or the base.
  Result<void> any_link(Index i, const Robot& r, std::int32_t& out) {
    std::string name;
    RMP_TRY(read_name(i, name, "link"));
    out = -1;
    if (name == "base") return {};
    std::vector<std::string> names{"base"};
    for (std::size_t k = 0; k < r.links.size(); ++k) {
      if (r.links[k].name == name) {
        out = static_cast<std::int32_t>(k);
        return {};
      }
      names.push_back(r.links[k].name);
    }
    std::string hint = text::did_you_mean(name, names);
    if (hint.empty()) hint = "Links are " + text::enumerate(names) + ".";
    return s_.at(at(i).argument_offset, ErrorCode::unknown_name,
                 quote(name) + " is not a link of the robot", hint);
  }
  /// The link before link `l` that a word names.
  Result<void> earlier_link(Index i, const Robot& r, const Link& l, std::int32_t& out) {
    std::string name;
    RMP_TRY(read_name(i, name, "link"));
    std::vector<std::string> names;
    for (std::size_t k = 0; k < r.links.size(); ++k) {
      if (r.links[k].name == name) {
        out = static_cast<std::int32_t>(k);
        return {};
      }
      names.push_back(r.links[k].name);
    }
    std::string hint = text::did_you_mean(name, names);
    if (hint.empty()) hint = "A joint follows that of a link that stands before its own.";
    return s_.at(at(i).argument_offset, ErrorCode::unknown_name,
                 quote(name) + " is not a link before link " + quote(l.name), hint);
  }

  Result<void> parent(Index i, const Robot& r, Link& l) {
    std::string name;
    RMP_TRY(read_name(i, name, "parent"));
    if (name == "base") {
      l.parent = -1;
      return {};
    }
    std::vector<std::string> names{"base"};
    for (std::size_t k = 0; k < r.links.size(); ++k) {
      if (r.links[k].name == name) {
        l.parent = static_cast<std::int32_t>(k);
        return {};
      }
      names.push_back(r.links[k].name);
    }
    std::string hint = text::did_you_mean(name, names);
    if (hint.empty()) hint = "The parent is \"base\" or a link that stands before this one.";
    return s_.at(at(i).argument_offset, ErrorCode::unknown_name,
                 quote(name) + " is not a link before link " + quote(l.name), hint);
  }

  Result<void> trajectory() {
    Trajectory t;
    Result<void> fields_read =
        block(kFile, "a trajectory",
              {name_rule(), string("description", t.description),
               number("sample_time", "s", t.sample_time),
               repeated("segment", [&](Index i) -> Result<void> {
                 out_.places[{"segment", t.segments.size()}] = at(i).offset;
                 RMP_TRY_ASSIGN(auto s, at(i).argument == Argument::none ? stored_segment(i, t)
                                                                         : shaped_segment(i));
                 t.segments.push_back(std::move(s));
                 return {};
               })});
    RMP_TRY(std::move(fields_read));
    out_.record.body = std::move(t);
    return {};
  }
  /// `segment line { point { ... }  point { ... }  speed 10 mm/s  law trapezoidal { ... } }`
  Result<TrajectorySegment> shaped_segment(Index i) {
    TrajectorySegment s;
    RMP_TRY(read_name(i, s.shape.name, "segment"));
    RMP_TRY(need_block(i));
    std::vector<Rule> rules{provider("law", s.law), provider("orientation", s.orientation),
                            provider("turning", s.turning), transition(s.transition)};
    rules.push_back(repeated("point", [&](Index k) -> Result<void> {
      Placement p;
      RMP_TRY(need_block(k, true));
      std::vector<Rule> inner;
      placement(inner, p);
      RMP_TRY(block(k, "a point", inner));
      s.points.push_back(p);
      return {};
    }));
    rules.push_back(repeated("joints", [&](Index k) -> Result<void> {
      s.joints.emplace_back();
      return joint_values(k, s.joints.back());
    }));
    const auto is_parameter = [&](Index k) {
      return std::none_of(rules.begin(), rules.end(),
                          [&](const Rule& r) { return r.name == at(k).name; });
    };
    RMP_TRY(block(i, "a segment", rules, is_parameter));
    RMP_TRY(parameters(i, s.shape, is_parameter));
    return s;
  }
  /// `segment { trajectory "weld.tjc"  at (1, 0, 0) }`
  Result<TrajectorySegment> stored_segment(Index i, const Trajectory& t) {
    TrajectorySegment s;
    RMP_TRY(need_block(i, true));
    const std::size_t k = t.segments.size();
    std::vector<Rule> rules{
        reference(
            "trajectory", {Kind::trajectory}, "segment " + std::to_string(k + 1),
            [k](Body& b, AnyId id) { std::get<Trajectory>(b).segments[k].stored = {id.number}; }),
        transition(s.transition)};
    rules.front().is_required = true;
    placement(rules, s.placement);
    RMP_TRY(block(i, "a stored segment", rules));
    return s;
  }
  /// `transition none`, or `transition { distance 5 mm  speed 20 mm/s }`
  Rule transition(Transition& out) {
    return {"transition", [this, &out](Index i) -> Result<void> {
              if (at(i).argument == Argument::word && at(i).text == "none") {
                out.is_smooth = false;
                return no_block(i);
              }
              RMP_TRY(need_block(i, true));
              return block(
                  i, "a transition",
                  {number("distance", "m", out.distance), number("speed", "m/s", out.speed)});
            }};
  }

  Result<void> world() {
    World w;
    std::unordered_map<std::string, Index> named, signals;
    const auto member = [&](Index i, std::string_view list, std::size_t index, std::string& name) {
      return element(i, list, index, name, named);
    };
    Result<void> fields_read = block(
        kFile, "a world",
        {name_rule(), string("description", w.description), parameter_rule(w.parametric),
         tuple("gravity", "m/s^2", w.gravity), pair_rule("allowed_pair", true, w.pair_rules),
         pair_rule("checked_pair", false, w.pair_rules),
         repeated("object",
                  [&](Index i) -> Result<void> {
                    PlacedObject p;
                    const std::size_t k = w.objects.size();
                    RMP_TRY(member(i, "object", k, p.name));
                    auto rules = body("object " + quote(p.name), [k](Body& b, AnyId id) {
                      std::get<World>(b).objects[k].what = id;
                    });
                    placement(rules, p.placement);
                    RMP_TRY(block(i, "a placed object", rules));
                    RMP_TRY(need_body(i));
                    w.objects.push_back(std::move(p));
                    return {};
                  }),
         repeated("robot",
                  [&](Index i) -> Result<void> {
                    PlacedRobot p;
                    const std::size_t k = w.robots.size();
                    RMP_TRY(member(i, "robot", k, p.name));
                    std::vector<Rule> rules;
                    rules.push_back(reference("robot", {Kind::robot}, "robot " + quote(p.name),
                                              [k](Body& b, AnyId id) {
                                                std::get<World>(b).robots[k].robot = {id.number};
                                              }));
                    rules.back().is_required = true;
                    rules.push_back(Rule{"q", [&](Index q) { return joint_values(q, p.q); }});
                    placement(rules, p.placement);
                    RMP_TRY(block(i, "a placed robot", rules));
                    w.robots.push_back(std::move(p));
                    return {};
                  }),
         repeated("trajectory",
                  [&](Index i) -> Result<void> {
                    PlacedTrajectory p;
                    const std::size_t k = w.trajectories.size();
                    RMP_TRY(member(i, "trajectory", k, p.name));
                    std::vector<Rule> rules;
                    rules.push_back(
                        reference("trajectory", {Kind::trajectory}, "trajectory " + quote(p.name),
                                  [k](Body& b, AnyId id) {
                                    std::get<World>(b).trajectories[k].trajectory = {id.number};
                                  }));
                    rules.back().is_required = true;
                    placement(rules, p.placement);
                    RMP_TRY(block(i, "a placed trajectory", rules));
                    w.trajectories.push_back(std::move(p));
                    return {};
                  }),
         repeated("frame",
                  [&](Index i) -> Result<void> {
                    PlacedFrame p;
                    RMP_TRY(member(i, "frame", w.frames.size(), p.name));
                    std::vector<Rule> rules;
                    placement(rules, p.placement);
                    RMP_TRY(block(i, "a frame", rules));
                    w.frames.push_back(std::move(p));
                    return {};
                  }),
         repeated("light",
                  [&](Index i) -> Result<void> {
                    PlacedLight p;
                    RMP_TRY(member(i, "light", w.lights.size(), p.name));
                    std::vector<Rule> rules{
                        words("kind", {"sun", "point", "spot"},
                              [&](std::size_t k) { p.kind = static_cast<LightKind>(k); }),
                        colour("colour", p.colour), number("intensity", "", p.intensity),
                        number("angle", "rad", p.angle)};
                    placement(rules, p.placement);
                    RMP_TRY(block(i, "a light", rules));
                    w.lights.push_back(std::move(p));
                    return {};
                  }),
         repeated("task",
                  [&](Index i) -> Result<void> {
                    PlacedTask p;
                    const std::size_t k = w.tasks.size();
                    RMP_TRY(member(i, "task", k, p.name));
                    std::vector<Rule> rules{
                        reference("task", {Kind::task}, "task " + quote(p.name),
                                  [k](Body& b, AnyId id) {
                                    std::get<World>(b).tasks[k].task = {id.number};
                                  }),
                        string("robot", p.robot)};
                    rules.front().is_required = true;
                    RMP_TRY(block(i, "a placed task", rules));
                    w.tasks.push_back(std::move(p));
                    return {};
                  }),
         repeated("signal",
                  [&](Index i) -> Result<void> {
                    Signal s;
                    RMP_TRY(element(i, "signal", w.signals.size(), s.name, signals));
                    RMP_TRY(
                        block(i, "a signal",
                              {words("kind", {"digital", "analogue"},
                                     [&](std::size_t k) { s.kind = static_cast<SignalKind>(k); }),
                               string("unit", s.unit), number("initial", "", s.initial),
                               string("from", s.from), string("to", s.to),
                               string("description", s.description)}));
                    w.signals.push_back(std::move(s));
                    return {};
                  }),
         repeated("attachment", [&](Index i) -> Result<void> {
           Attachment a;
           RMP_TRY(need_block(i, true));
           std::vector<Rule> rules{string("object", a.object), string("robot", a.robot),
                                   string("link", a.link)};
           rules[0].is_required = rules[1].is_required = true;
           placement(rules, a.tool_T_object);
           RMP_TRY(block(i, "an attachment", rules));
           w.attachments.push_back(std::move(a));
           return {};
         })});
    RMP_TRY(std::move(fields_read));
    out_.record.body = std::move(w);
    return {};
  }

  [[nodiscard]] static std::optional<StepKind> step_kind(const Field& f) {
    const auto it = std::find(std::begin(kStepWords), std::end(kStepWords), f.name);
    if (it == std::end(kStepWords) || !f.has_block) return std::nullopt;
    return static_cast<StepKind>(it - std::begin(kStepWords));
  }

  /// Steps stand in pre-order, so one pass over the fields makes the flat list at any depth.
  Result<void> task() {
    Task t;
    const Skip is_step = [&](Index i) { return step_kind(at(i)).has_value(); };
    RMP_TRY(block(kFile, "a task", {name_rule(), string("description", t.description)}, is_step));
    std::unordered_map<std::int32_t, std::int32_t> step_of{{-1, -1}};  // block's field -> step
    for (Index i = 0; i < s_.fields.size(); ++i) {
      const auto kind = step_kind(at(i));
      const auto parent = step_of.find(at(i).parent);
      if (!kind || parent == step_of.end()) continue;
      const std::size_t k = t.steps.size();
      TaskStep s;
      s.kind = *kind;
      s.parent = parent->second;
      out_.places[{"step", k}] = at(i).offset;
      RMP_TRY(need_block(i, true));
      RMP_TRY(step(i, k, s));
      if (is_block(s.kind))
        step_of.emplace(static_cast<std::int32_t>(i), static_cast<std::int32_t>(k));
      t.steps.push_back(std::move(s));
    }
    out_.record.body = std::move(t);
    return {};
  }
  Result<void> step(Index i, std::size_t k, TaskStep& s) {
    std::vector<Rule> rules;
    const Rule actor = string("robot", s.robot);
    switch (s.kind) {
      case StepKind::move:
        rules = {
            actor,
            reference(
                "trajectory", {Kind::trajectory}, "step " + std::to_string(k + 1),
                [k](Body& b, AnyId id) { std::get<Task>(b).steps[k].trajectory = {id.number}; }),
            string("pose", s.pose),
            Rule{"joints", [&](Index q) { return joint_values(q, s.joints); }},
            placement_block("target", s.target),
            string("frame", s.frame),
            string("tool", s.link),
            words("profile", {"quintic", "trapezoidal", "s_curve", "time_optimal"},
                  [&](std::size_t n) {
                    constexpr const char* kProfiles[] = {"quintic", "trapezoidal", "s_curve",
                                                         "time_optimal"};
                    s.profile = kProfiles[n];
                  }),
            words("path", {"joint", "straight"}, [&](std::size_t n) { s.is_straight = n == 1; }),
            number("speed", "", s.speed),
            number("tool_speed", "m/s", s.tool_speed),
            number("duration", "s", s.duration)};
        break;
      case StepKind::attach:
        rules = {actor, string("object", s.object), string("link", s.link)};
        break;
      case StepKind::detach: rules = {string("object", s.object)}; break;
      case StepKind::set:
        rules = {string("signal", s.signal), string("value", s.expression)};
        break;
      case StepKind::wait:
        rules = {number("time", "s", s.duration), string("condition", s.expression),
                 number("timeout", "s", s.timeout)};
        break;
      case StepKind::call:
        rules = {actor, reference("task", {Kind::task}, "step " + std::to_string(k + 1),
                                  [k](Body& b, AnyId id) {
                                    std::get<Task>(b).steps[k].task = {id.number};
                                  })};
        rules.back().is_required = true;
        break;
      case StepKind::repeat: rules = {count("count", s.count)}; break;
      case StepKind::when: rules = {string("condition", s.expression)}; break;
      case StepKind::otherwise: break;
      case StepKind::message: rules = {string("text", s.text)}; break;
    }
    const Skip is_inner = [&](Index n) { return is_block(s.kind) && step_kind(at(n)).has_value(); };
    return block(i, "step " + std::to_string(k + 1) + " (" + std::string(to_string(s.kind)) + ")",
                 rules, is_inner);
  }
  Rule count(std::string_view name, std::int64_t& out) {
    return {name, [this, &out](Index i) -> Result<void> {
              RMP_TRY(no_block(i));
              RMP_TRY_ASSIGN(const Number n, single_number(i));
              const auto whole = n.unit.empty() ? text::read_int(n.text) : std::nullopt;
              if (!whole) return fail(i, quote(at(i).name) + " needs a whole number");
              out = *whole;
              return {};
            }};
  }

  // ---- blocks ----

  [[nodiscard]] const Field& at(Index i) const { return s_.fields[i]; }
  [[nodiscard]] static std::string article(std::string_view noun) {
    return document::with_article(noun);
  }
  [[nodiscard]] Error fail(Index i, std::string message, std::string hint = {}) const {
    return s_.at(at(i).offset, ErrorCode::syntax, std::move(message), std::move(hint));
  }
  [[nodiscard]] Error twice(std::string_view what, const std::string& name, Index i,
                            Index first) const {
    return s_.at(at(i).argument_offset, ErrorCode::conflict,
                 "there is already " + article(what) + " named " + quote(name),
                 "The first one is at " + s_.place(at(first).offset) + ".");
  }

  /// Reads the fields of a block (kFile: of the file) by its rules; `what` as in "a DH row".
  Result<void> block(Index owner, const std::string& what, const std::vector<Rule>& rules,
                     const Skip& skip = {}) {
    const Index first = owner == kFile ? 0 : owner + 1;
    const Index end = owner == kFile ? static_cast<Index>(s_.fields.size()) : at(owner).end;
    std::vector<std::optional<Index>> seen(rules.size());
    for (Index i = first; i < end; i = at(i).end) {
      if (skip && skip(i)) continue;
      const auto rule = std::find_if(rules.begin(), rules.end(),
                                     [&](const Rule& r) { return r.name == at(i).name; });
      if (rule == rules.end()) return unknown(i, what, rules);
      auto& before = seen[static_cast<std::size_t>(rule - rules.begin())];
      if (before && !rule->is_repeated)
        return fail(i, quote(rule->name) + " is given twice in " + what,
                    "The first one is at " + s_.place(at(*before).offset) + ".");
      before = i;
      RMP_TRY(rule->read(i));
    }
    for (std::size_t k = 0; k < rules.size(); ++k) {
      if (!rules[k].is_required || seen[k]) continue;
      const std::uint32_t offset = owner == kFile ? s_.kind_offset : at(owner).offset;
      return s_.at(offset, ErrorCode::syntax, quote(rules[k].name) + " is missing in " + what);
    }
    return {};
  }

  [[nodiscard]] Error unknown(Index i, const std::string& what,
                              const std::vector<Rule>& rules) const {
    std::vector<std::string> names;
    for (const Rule& r : rules) names.emplace_back(r.name);
    const std::string word(at(i).name);
    std::string hint = text::did_you_mean(word, names);
    if (hint.empty()) hint = "Fields are " + text::enumerate(names) + ".";
    return s_.at(at(i).offset, ErrorCode::unknown_name, quote(word) + " is not a field of " + what,
                 hint);
  }

  Result<void> need_argument(Index i) {
    if (at(i).argument != Argument::none) return {};
    return fail(i, article(at(i).name) + " needs a name",
                "Such as: " + std::string(at(i).name) + " first { ... }");
  }
  Result<void> need_block(Index i, bool without_name = false) {
    if (!at(i).has_block || at(i).has_values)
      return fail(i, quote(at(i).name) + " needs a block in braces");
    if (without_name && at(i).argument != Argument::none)
      return s_.at(at(i).argument_offset, ErrorCode::syntax,
                   quote(at(i).name) + " has a block but no name or value of its own");
    return {};
  }
  Result<void> no_block(Index i, bool several_tuples = false) {
    if (at(i).has_block) return fail(i, quote(at(i).name) + " has a value but no block");
    if (at(i).tuples > 1 && !several_tuples)
      return s_.at(at(i).argument_offset, ErrorCode::syntax,
                   quote(at(i).name) + " has its numbers in a single pair of parentheses");
    if (at(i).has_values)
      return s_.at(at(i).argument_offset, ErrorCode::syntax,
                   quote(at(i).name) + " has a single value");
    return {};
  }

  /// A named member of a list: `link elbow { ... }`.
  Result<void> element(Index i, std::string_view list, std::size_t index, std::string& name,
                       std::unordered_map<std::string, Index>& named, bool has_block = true) {
    out_.places[{list, index}] = at(i).offset;
    RMP_TRY(need_argument(i));
    RMP_TRY(read_name(i, name, list));
    if (has_block) RMP_TRY(need_block(i));
    if (const auto [it, is_new] = named.emplace(name, i); !is_new)
      return twice(list, name, i, it->second);
    return {};
  }

  // ---- rules ----

  Rule name_rule() {
    return {"name",
            [this](Index i) -> Result<void> {
              RMP_TRY(no_block(i));
              return read_name(i, out_.record.name, s_.kind);
            },
            false, true};
  }
  /// `parameter wall 7 mm = "bore/4 + 2 mm" "description"`
  Rule parameter_rule(Parametric& out) {
    return repeated("parameter", [this, &out](Index i) -> Result<void> {
      RMP_TRY_ASSIGN(Parameter p, read_parameter(s_, i));
      if (find_parameter(out, p.name))
        return s_.at(at(i).argument_offset, ErrorCode::conflict,
                     "there is already a parameter named " + quote(p.name));
      out.parameters.push_back(std::move(p));
      return {};
    });
  }
  Rule string(std::string_view name, std::string& out) {
    return {name, [this, &out](Index i) -> Result<void> {
              RMP_TRY(no_block(i));
              if (at(i).argument != Argument::string)
                return s_.at(at(i).argument_offset, ErrorCode::syntax,
                             quote(at(i).name) + " needs a text in double quotes");
              out = unescape(at(i).text);
              return {};
            }};
  }
  Rule number(std::string_view name, std::string_view unit, double& out, bool is_required = false) {
    return {name,
            [this, unit, &out](Index i) -> Result<void> {
              RMP_TRY(no_block(i));
              RMP_TRY_ASSIGN(const Number n, single_number(i));
              RMP_TRY_ASSIGN(out, quantity(n, unit));
              return {};
            },
            false, is_required};
  }
  Rule tuple(std::string_view name, std::string_view unit, Vec3& out) {
    return {name, [this, unit, &out](Index i) { return read_tuple(i, unit, out); }};
  }
  Rule measured(std::optional<MeasuredMass>& out) {
    return {"measured", [this, &out](Index i) -> Result<void> {
              RMP_TRY(need_block(i, true));
              MeasuredMass& m = out.emplace();
              return block(i, "a measured mass",
                           {number("mass", "kg", m.mass.mass, true), tuple("com", "m", m.mass.com),
                            Rule{"inertia",
                                 [&](Index k) -> Result<void> {
                                   std::array<double, 6> v{};
                                   RMP_TRY(read_tuple(k, "kg m^2", v));
                                   m.mass.inertia = {v[0], v[1], v[2], v[3], v[4], v[5]};
                                   return {};
                                 }},
                            string("source", m.source)});
            }};
  }

  Rule colour(std::string_view name, Colour& out) {
    return {name, [this, &out](Index i) -> Result<void> {
              RMP_TRY(no_block(i));
              const Field& f = at(i);
              if (f.argument != Argument::tuple || (f.numbers != 3 && f.numbers != 4))
                return fail(i, quote(f.name) + " needs three or four numbers in parentheses",
                            "Red, green and blue from 0 to 1, then the opacity.");
              std::array<double, 4> v{0, 0, 0, 1};
              for (std::uint32_t k = 0; k < f.numbers; ++k) {
                RMP_TRY_ASSIGN(v[k], quantity(s_.numbers[f.first_number + k], ""));
              }
              out = {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]),
                     static_cast<float>(v[3])};
              return {};
            }};
  }
  Rule words(std::string_view name, std::vector<std::string> choices,
             std::function<void(std::size_t)> set) {
    return {
        name, [this, choices = std::move(choices), set = std::move(set)](Index i) -> Result<void> {
          RMP_TRY(no_block(i));
          const Field& f = at(i);
          const auto it = f.argument == Argument::word
                              ? std::find(choices.begin(), choices.end(), f.text)
                              : choices.end();
          if (it == choices.end()) {
            std::string hint =
                f.argument == Argument::word ? text::did_you_mean(f.text, choices) : std::string();
            return s_.at(f.argument_offset, ErrorCode::syntax,
                         quote(f.name) + " must be " + or_list(choices), std::move(hint));
          }
          set(static_cast<std::size_t>(it - choices.begin()));
          return {};
        }};
  }
  static std::string or_list(const std::vector<std::string>& words) {
    std::string s;
    for (std::size_t i = 0; i < words.size(); ++i)
      s += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
    return s;
  }
  static Rule repeated(std::string_view name, std::function<Result<void>(Index)> read) {
    return {name, std::move(read), true, false};
  }
  Rule placement_block(std::string_view name, std::optional<Placement>& out) {
    return {name,
            [this, name, &out](Index i) { return placement_block(name, out.emplace()).read(i); }};
  }
  Rule placement_block(std::string_view name, Placement& out) {
    return {name, [this, &out](Index i) -> Result<void> {
              RMP_TRY(need_block(i, true));
              std::vector<Rule> rules;
              placement(rules, out);
              return block(i, article(at(i).name) + " placement", rules);
            }};
  }
  /// One of at, cylindrical, spherical, and one of rpy, xyz, zyz.
  void placement(std::vector<Rule>& rules, Placement& out) {
    const auto has_position = std::make_shared<std::optional<Index>>();
    for (const auto coordinates :
         {PositionNotation::cartesian, PositionNotation::cylindrical, PositionNotation::spherical})
      rules.push_back(
          {word_of(coordinates), [this, &out, has_position, coordinates](Index i) -> Result<void> {
             if (*has_position)
               return fail(
                   i, quote(at(i).name) + " cannot stand beside " + quote(at(**has_position).name),
                   "A placement has one position.");
             *has_position = i;
             out.coordinates = coordinates;
             return read_tuple(i, position_units(coordinates), out.position);
           }});
    const auto has_angles = std::make_shared<std::optional<Index>>();
    for (const auto notation : {AngleNotation::rpy, AngleNotation::xyz, AngleNotation::zyz})
      rules.push_back(
          {word_of(notation), [this, &out, has_angles, notation](Index i) -> Result<void> {
             if (*has_angles)
               return fail(
                   i, quote(at(i).name) + " cannot stand beside " + quote(at(**has_angles).name),
                   "A placement has one set of angles.");
             *has_angles = i;
             out.notation = notation;
             return read_tuple(i, "rad", out.angles);
           }});
  }
  Rule reference(std::string_view name, std::vector<Kind> kinds, std::string owner,
                 std::function<void(Body&, AnyId)> set) {
    return {
        name,
        [this, kinds = std::move(kinds), owner = std::move(owner),
         set = std::move(set)](Index i) -> Result<void> {
          RMP_TRY_ASSIGN(std::string file, path(i));
          out_.references.push_back({std::move(file), at(i).argument_offset, kinds, owner, set});
          return {};
        }};
  }
  Result<std::string> path(Index i) {
    RMP_TRY(no_block(i));
    const Field& f = at(i);
    if (f.argument != Argument::string)
      return s_.at(f.argument_offset, ErrorCode::syntax,
                   quote(f.name) + " needs a file's path in double quotes");
    std::string path = unescape(f.text);
    if (path.empty())
      return s_.at(f.argument_offset, ErrorCode::syntax,
                   "the path of " + quote(f.name) + " is empty");
    return path;
  }
  /// solid or object, exactly one of them (need_body).
  std::vector<Rule> body(const std::string& what, const std::function<void(Body&, AnyId)>& set) {
    std::vector<Rule> rules;
    rules.push_back(reference("solid", {Kind::solid}, what, set));
    rules.push_back(reference("object", {Kind::object}, what, set));
    return rules;
  }
  Result<void> need_body(Index owner) {
    std::optional<Index> found;
    for (Index i = owner + 1; i < at(owner).end; i = at(i).end) {
      if (at(i).name != "solid" && at(i).name != "object") continue;
      if (found)
        return fail(i, "a solid and an object cannot stand at one place",
                    "Make two parts of them.");
      found = i;
    }
    if (found) return {};
    return fail(owner, quote(at(owner).name) + " names neither a solid nor an object",
                "Such as: solid \"plate.csg\"");
  }
  Result<void> body_part(Index i, const std::string& what, std::vector<BodyPart>& parts,
                         const std::function<void(Body&, AnyId)>& set) {
    BodyPart p;
    RMP_TRY(need_block(i, true));
    auto rules = body(what, set);
    placement(rules, p.placement);
    RMP_TRY(block(i, what, rules));
    RMP_TRY(need_body(i));
    parts.push_back(p);
    return {};
  }
  /// `allowed_pair { a "base"  b "forearm"  reason "they never meet" }`
  Rule pair_rule(std::string_view name, bool is_allowed, std::vector<PairRule>& out) {
    return repeated(name, [this, is_allowed, &out](Index i) -> Result<void> {
      PairRule p;
      p.is_allowed = is_allowed;
      RMP_TRY(need_block(i, true));
      std::vector<Rule> rules{string("a", p.a), string("b", p.b), string("reason", p.reason)};
      rules[0].is_required = rules[1].is_required = true;
      RMP_TRY(block(i, "a pair of bodies", rules));
      out.push_back(std::move(p));
      return {};
    });
  }
  Rule provider(std::string_view name, ProviderChoice& out) {
    return {name, [this, &out](Index i) -> Result<void> {
              if (at(i).has_values) return no_block(i);
              if (at(i).argument != Argument::none) RMP_TRY(read_name(i, out.name, "provider"));
              return parameters(i, out);
            }};
  }
  /// Every field of the block, or those that `is_parameter`, are parameters of the provider.
  Result<void> parameters(Index owner, ProviderChoice& out, const Skip& is_parameter = {}) {
    for (Index i = owner + 1; i < at(owner).end; i = at(i).end) {
      if (is_parameter && !is_parameter(i)) continue;
      RMP_TRY(no_block(i));
      RMP_TRY_ASSIGN(auto value, parameter(i));
      if (!out.params.emplace(std::string(at(i).name), std::move(value)).second)
        return fail(i, "parameter " + quote(at(i).name) + " is given twice");
    }
    return {};
  }
  Result<ProviderChoice::Param> parameter(Index i) {
    const Field& f = at(i);
    using Param = ProviderChoice::Param;
    switch (f.argument) {
      case Argument::string: return Param(unescape(f.text));
      case Argument::word:
        if (f.text == "true" || f.text == "false") return Param(f.text == "true");
        if (f.text == "inf") return Param(std::numeric_limits<double>::infinity());
        return Param(std::string(f.text));
      case Argument::number: {
        const Number& n = s_.numbers[f.first_number];
        if (n.unit.empty() && n.expression.empty())  // those are reals
          if (const auto whole = text::read_int(n.text)) return Param(*whole);
        RMP_TRY_ASSIGN(const double v, any_quantity(n));
        return Param(v);
      }
      case Argument::tuple: {
        std::vector<double> v;
        for (std::uint32_t k = 0; k < f.numbers; ++k) {
          RMP_TRY_ASSIGN(const double x, any_quantity(s_.numbers[f.first_number + k]));
          v.push_back(x);
        }
        return Param(std::move(v));
      }
      case Argument::none: break;
    }
    return fail(i, quote(f.name) + " has no value");
  }

  // ---- values ----

  Result<Number> single_number(Index i) {
    const Field& f = at(i);
    if (f.argument == Argument::number) return s_.numbers[f.first_number];
    if (f.argument == Argument::word && f.text == "inf")
      return Number{f.text, {}, f.argument_offset};
    return s_.at(f.argument_offset, ErrorCode::syntax, quote(f.name) + " needs a number");
  }
  Result<double> quantity(const Number& n, std::string_view unit) {
    if (n.text.empty()) return 0;  // bind_expressions() computes it
    std::string s(n.text);
    if (!n.unit.empty()) s += " " + std::string(n.unit);
    auto v = units::read_quantity(s, unit);
    if (!v.ok()) return s_.at(n.offset, v.error().code, v.error().message, v.error().hint);
    return *v;
  }
  /// A number in whatever unit it has, in SI.
  Result<double> any_quantity(const Number& n) {
    RMP_TRY_ASSIGN(const double v, quantity({n.text, {}, n.offset}, ""));
    if (n.unit.empty()) return v;
    auto unit = units::parse(n.unit);
    if (!unit.ok())
      return s_.at(n.offset, unit.error().code, unit.error().message, unit.error().hint);
    return units::to_si(v, *unit);
  }
  /// Joint values of a robot that stands in another file: each an angle or a length.
  Result<void> joint_values(Index i, std::vector<double>& out) {
    RMP_TRY(no_block(i));
    const Field& f = at(i);
    if (f.argument != Argument::tuple)
      return fail(i, quote(f.name) + " needs numbers in parentheses");
    for (std::uint32_t k = 0; k < f.numbers; ++k) {
      const Number& n = s_.numbers[f.first_number + k];
      const auto unit = units::parse(n.unit);
      const bool is_length = unit.ok() && unit->dimension == units::Dimension{1, 0, 0, 0};
      RMP_TRY_ASSIGN(const double v, quantity(n, is_length ? "m" : "rad"));
      out.push_back(v);
    }
    return {};
  }
  template <std::size_t N>
  Result<void> read_tuple(Index i, std::string_view unit, std::array<double, N>& out) {
    std::array<std::string_view, N> same;
    same.fill(unit);
    return read_tuple(i, same, out);
  }
  template <std::size_t N>
  Result<void> read_tuple(Index i, const std::array<std::string_view, N>& unit,
                          std::array<double, N>& out) {
    RMP_TRY(no_block(i));
    const Field& f = at(i);
    if (f.argument != Argument::tuple || f.numbers != N)
      return s_.at(f.argument_offset, ErrorCode::syntax,
                   quote(f.name) + " needs " + std::to_string(N) + " numbers in parentheses" +
                       (f.argument == Argument::tuple ? "; it has " + std::to_string(f.numbers)
                                                      : std::string()));
    for (std::uint32_t k = 0; k < N; ++k) {
      RMP_TRY_ASSIGN(out[k], quantity(s_.numbers[f.first_number + k], unit[k]));
    }
    return {};
  }
  Result<void> read_name(Index i, std::string& out, std::string_view what) {
    const Field& f = at(i);
    if (f.argument != Argument::word && f.argument != Argument::string)
      return s_.at(f.argument_offset, ErrorCode::syntax, quote(f.name) + " needs a name");
    out = f.argument == Argument::word ? std::string(f.text) : unescape(f.text);
    if (document::is_name(out)) return {};
    Error e = document::bad_name(out, what);
    return s_.at(f.argument_offset, e.code, e.message, e.hint);
  }

  const Syntax& s_;
  Bound out_;
  std::vector<Index> tool_fields_;  ///< of the robot's further tools
};

}  // namespace

Result<Bound> bind(const Syntax& s) { return Binder(s).run(); }

}  // namespace robomosp::io
