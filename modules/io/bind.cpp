// SPDX-License-Identifier: Apache-2.0
#include "io/bind.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <unordered_map>

#include "document/validate.h"
#include "io/declared_reader.h"
#include "io/expressions.h"
#include "io/plain_fields.h"
#include "kernel/text.h"
#include "kernel/units.h"
#include "model/parametric.h"
#include "model/placement.h"
#include "model/solid_edit.h"
#include "model/words.h"
#include "robotics/coordinates.h"

namespace robomosp::io {

namespace {

using namespace model;
using text::quote;

/// The kind of node that a field is; a number, as in `fillet 2 mm`, is a size.
std::optional<CsgKind> csg_kind(const Field& f) {
  const CsgNodeInfo* info = f.argument == Argument::number ? nullptr : csg_info(f.name);
  return info ? std::optional(info->kind) : std::nullopt;
}

class Binder : public DeclaredReader {
 public:
  using DeclaredReader::DeclaredReader;

  Result<Bound> run() {
    const auto kind = kind_from(s_.kind);
    if (!kind) {
      std::vector<std::string> kinds;
      for (const Kind k : all_kinds()) kinds.emplace_back(to_string(k));
      std::string hint = text::did_you_mean(s_.kind, kinds);
      if (hint.empty()) hint = "Kinds are " + text::enumerate(kinds) + ".";
      return s_.at(s_.kind_offset, ErrorCode::syntax, quote(s_.kind) + " is not a kind of record",
                   hint);
    }
    switch (*kind) {
      case Kind::solid: RMP_TRY(solid()); break;
      case Kind::robot: RMP_TRY(robot()); break;
      case Kind::trajectory: RMP_TRY(trajectory()); break;
      case Kind::task: RMP_TRY(task()); break;
      default: RMP_TRY(declared_record(*kind)); break;
    }
    RMP_TRY(bind_expressions(s_, out_));
    return std::move(out_);
  }

 private:
  // ---- records ----

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
                     "a solid has a single top-level node, but this is the second",
                     "Put both inside a union, difference or intersection.");
      root = i;
    }
    if (root) RMP_TRY(nodes(s, *root));
    out_.record.body = std::move(s);
    return look_up_names();
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
    if (model::height_of(n.kind))
      rules.push_back(
          words("centred", {"false", "true"}, [&](std::size_t k) { n.is_centred = k == 1; }));
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
    const Target target{&type_of<SolidNode>(), &n, way_to<Solid>("nodes", index),
                        "node " + (n.name.empty() ? std::string(info.name) : quote(n.name)), 0};
    add_rules(target, plain_node_fields(), i, rules);
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
        return fail(i, "a loop with a circle cannot contain other curves",
                    "Put the other curves into a separate loop.");
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
      return fail(i, "an arc needs two points: a via point and its end");
    l.curves.push_back(std::move(c));
    return {};
  }

  Result<void> robot() {
    Robot r;
    std::unordered_map<std::string, Index> links, poses, tools, mounted, loops, axes;
    std::optional<Index> main_tool;
    std::vector<Index> pose_fields, loop_fields, axis_fields;
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
         mass_block("base_mass", "the base's mass properties", r.base_mass),
         repeated("link", [&](Index i) { return link(i, r, links); }),
         repeated("tool", [&](Index i) { return tool(i, r, main_tool, tools); }),
         repeated("attached", [&](Index i) { return attached(i, r, mounted); }),
         string("tcp", r.tcp),
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
         repeated("axis",
                  [&](Index i) -> Result<void> {
                    axis_fields.push_back(i);
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
    for (std::size_t k = 0; k < r.tools.size(); ++k)
      RMP_TRY(find_tool_link(tool_fields_[k], r, r.tools[k].link));
    for (std::size_t k = 0; k < r.attached.size(); ++k)
      RMP_TRY(find_tool_link(attached_fields_[k], r, r.attached[k].link));
    const std::vector<std::string_view> units = robotics::coordinate_units(r);
    for (const Index i : pose_fields) RMP_TRY(pose(i, r, units, poses));
    for (const Index i : axis_fields) RMP_TRY(maker_axis(i, r, axes));
    out_.record.body = std::move(r);
    return look_up_names();
  }

  /// `axis J3 { link forearm  sign -1  offset 90 deg  coupled { link upper_arm  ratio -1 } }`
  Result<void> maker_axis(Index i, Robot& r, std::unordered_map<std::string, Index>& named) {
    MakerAxis a;
    RMP_TRY(element(i, "axis", r.axes.size(), a.name, named));
    // The unit of its numbers may stand after them.
    for (Index k = i + 1; k < at(i).end; k = at(k).end)
      if (at(k).name == "unit" && at(k).text == "mm") a.unit = AxisUnit::mm;
    const char* const unit = a.unit == AxisUnit::mm ? "m" : "rad";
    double sign = 1;
    Rule of{"link", [&](Index k) { return any_link(k, r, a.link); }};
    of.is_required = true;
    Result<void> fields_read = block(
        i, "an axis",
        {std::move(of), number("sign", "", sign), number("offset", unit, a.offset),
         repeated("coupled",
                  [&](Index k) -> Result<void> {
                    RMP_TRY(need_block(k, true));
                    AxisCoupling& c = a.coupled.emplace_back();
                    Rule link_rule{"link", [&](Index n) { return any_link(n, r, c.link); }};
                    link_rule.is_required = true;
                    return block(k, "a coupled joint",
                                 {std::move(link_rule), number("ratio", "", c.ratio)});
                  }),
         words("unit", {"deg", "mm"}, [&](std::size_t k) { a.unit = static_cast<AxisUnit>(k); }),
         words("external", {"false", "true"}, [&](std::size_t k) { a.external = k == 1; }),
         Rule{"limits", [&](Index k) -> Result<void> {
                std::array<double, 2> v{};
                RMP_TRY(read_tuple(k, unit, v));
                a.lower = v[0];
                a.upper = v[1];
                return {};
              }}});
    RMP_TRY(std::move(fields_read));
    if (sign != 1 && sign != -1)
      return fail(i, "the sign of axis " + quote(a.name) + " is neither 1 nor -1");
    a.sign = sign < 0 ? -1 : 1;
    r.axes.push_back(std::move(a));
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
    std::vector<Rule> rules{
        Rule{"parent", [&](Index k) { return parent(k, r, l); }},
        words("joint", {kJointWords.begin(), kJointWords.end()},
              [&](std::size_t k) { l.joint = static_cast<JointKind>(k); }),
        words("convention", {"dh", "mdh"},
              [&](std::size_t k) { l.convention = static_cast<Convention>(k); }),
        placement_block("origin", l.origin),
        tuple("axis", "", l.axis),
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
        Rule{"drive",
             [&](Index k) -> Result<void> {
               RMP_TRY(need_block(k, true));
               std::vector<Rule> of_drive{Rule{"coulomb", [&](Index c) -> Result<void> {
                                                 std::array<double, 2> v{};
                                                 RMP_TRY(read_tuple(c, "N m", v));
                                                 l.drive.coulomb_positive = v[0];
                                                 l.drive.coulomb_negative = v[1];
                                                 return {};
                                               }}};
               const Target drive{&type_of<Drive>(), &l.drive, {}, "the drive", 0};
               add_rules(drive, plain_drive_fields(), k, of_drive);
               return block(k, "a drive", of_drive);
             }},
        mass_block("given", "the given mass properties", l.given),
        repeated("part", [&](Index k) -> Result<void> {
          const std::size_t p = l.parts.size();
          return body_part(k, "a part of link " + quote(l.name), l.parts,
                           [index, p](Body& b, AnyId id) {
                             std::get<Robot>(b).links[index].parts[p].what = id;
                           });
        })};
    const Target target{&type_of<Link>(), &l, way_to<Robot>("links", index),
                        "link " + quote(l.name), slides ? 1U : 0U};
    add_rules(target, plain_link_fields(), i, rules);
    RMP_TRY(block(i, "a link", rules));
    if (!has_row && !l.origin)
      return fail(i, "\"row\" is missing in a link",
                  "Give its row, or origin and axis of its joint.");
    if (has_row && l.origin)
      return fail(i, "link " + quote(l.name) + " has a row and an origin",
                  "Keep only one of them.");
    place_of_link_.emplace(l.name, static_cast<std::int32_t>(index));
    r.links.push_back(std::move(l));
    return {};
  }

  /// `tool { at (0, 0, 0.1) }` on the last link, or `tool camera { link wrist  at (0, 0, 0.1) }`.
  Result<void> tool(Index i, Robot& r, std::optional<Index>& main,
                    std::unordered_map<std::string, Index>& named) {
    if (at(i).argument == Argument::none) {
      if (main)
        return fail(i, "\"tool\" is given twice in a robot",
                    "The first one is at " + s_.place(at(*main).offset) +
                        ". Further tools need a name and a link.");
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
  Result<void> find_tool_link(Index i, const Robot& r, std::int32_t& link) {
    for (Index k = i + 1; k < at(i).end; k = at(k).end)
      if (at(k).name == "link") return any_link(k, r, link);
    return {};
  }

  /// `attached torch { object "mig_torch_22.part"  link flange  at (0, 0, 56 mm) }`
  Result<void> attached(Index i, Robot& r, std::unordered_map<std::string, Index>& named) {
    AttachedTool t;
    const std::size_t k = r.attached.size();
    RMP_TRY(element(i, "attached", k, t.name, named));
    std::vector<Rule> rules = body(
        "an attached tool", [k](Body& b, AnyId id) { std::get<Robot>(b).attached[k].what = id; });
    rules.push_back({"link", [](Index) -> Result<void> { return {}; }});
    rules.back().is_required = true;
    placement(rules, t.placement);
    RMP_TRY(block(i, "an attached tool", rules));
    RMP_TRY(need_body(i));
    attached_fields_.push_back(i);
    r.attached.push_back(std::move(t));
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

  /// Of the links read so far.
  [[nodiscard]] bool find_link(const std::string& name, std::int32_t& out) const {
    const auto found = place_of_link_.find(name);
    if (found == place_of_link_.end()) return false;
    out = found->second;
    return true;
  }
  static std::vector<std::string> link_names(const Robot& r, std::vector<std::string> first) {
    for (const Link& l : r.links) first.push_back(l.name);
    return first;
  }
  /// The link that a word names, or the base.
  Result<void> any_link(Index i, const Robot& r, std::int32_t& out) {
    std::string name;
    RMP_TRY(read_name(i, name, "link"));
    out = -1;
    if (name == "base" || find_link(name, out)) return {};
    const std::vector<std::string> names = link_names(r, {"base"});
    std::string hint = text::did_you_mean(name, names);
    if (hint.empty()) hint = "Links are " + text::enumerate(names) + ".";
    return s_.at(at(i).argument_offset, ErrorCode::unknown_name,
                 quote(name) + " is not a link of the robot", hint);
  }
  /// The link before link `l` that a word names.
  Result<void> earlier_link(Index i, const Robot& r, const Link& l, std::int32_t& out) {
    std::string name;
    RMP_TRY(read_name(i, name, "link"));
    if (find_link(name, out)) return {};
    std::string hint = text::did_you_mean(name, link_names(r, {}));
    if (hint.empty()) hint = "A joint can only follow that of an earlier link.";
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
    if (find_link(name, l.parent)) return {};
    std::string hint = text::did_you_mean(name, link_names(r, {"base"}));
    if (hint.empty()) hint = "The parent must be \"base\" or an earlier link.";
    return s_.at(at(i).argument_offset, ErrorCode::unknown_name,
                 quote(name) + " is not a link before link " + quote(l.name), hint);
  }

  Result<void> trajectory() {
    Trajectory t;
    std::vector<Rule> rules{name_rule(), string("description", t.description),
                            number("sample_time", "s", t.sample_time), parameter_rule(t.parametric),
                            repeated("segment", [&](Index i) -> Result<void> {
                              out_.places[{"segment", t.segments.size()}] = at(i).offset;
                              RMP_TRY_ASSIGN(auto s, at(i).argument == Argument::none
                                                         ? stored_segment(i, t)
                                                         : shaped_segment(i, t));
                              t.segments.push_back(std::move(s));
                              return {};
                            })};
    const Type& type = type_of<Trajectory>();
    add_rules({&type, &t, {}, {}, 0}, *type.field("along"), rules);
    RMP_TRY(block(kFile, "a trajectory", rules));
    out_.record.body = std::move(t);
    return look_up_names();
  }
  static Target segment_target(TrajectorySegment& s, const Trajectory& t) {
    const std::size_t k = t.segments.size();
    return {&type_of<TrajectorySegment>(), &s, way_to<Trajectory>("segments", k),
            "segment " + std::to_string(k + 1), 0};
  }
  /// `segment line { point { ... }  point { ... }  speed 10 mm/s  law trapezoidal { ... } }`
  Result<TrajectorySegment> shaped_segment(Index i, const Trajectory& t) {
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
    const Target target = segment_target(s, t);
    add_rules(target, plain_segment_fields(), i, rules);
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
    const Target target = segment_target(s, t);
    add_rules(target, plain_segment_fields(), i, rules);
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

  [[nodiscard]] static std::optional<StepKind> step_kind(const Field& f) {
    const auto it = std::find(std::begin(kStepWords), std::end(kStepWords), f.name);
    if (it == std::end(kStepWords) || !f.has_block) return std::nullopt;
    return static_cast<StepKind>(it - std::begin(kStepWords));
  }

  /// Steps stand in pre-order, so one pass over the fields makes the flat list at any depth.
  Result<void> task() {
    Task t;
    const Skip is_step = [&](Index i) { return step_kind(at(i)).has_value(); };
    RMP_TRY(block(kFile, "a task",
                  {name_rule(), string("description", t.description), parameter_rule(t.parametric)},
                  is_step));
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
    return look_up_names();
  }
  Result<void> step(Index i, std::size_t k, TaskStep& s) {
    const std::string shown = "step " + std::to_string(k + 1);
    const Target target{&type_of<TaskStep>(), &s, way_to<Task>("steps", k), shown, 0};
    std::vector<Rule> rules;
    add_rules(target, plain_step_fields(s.kind), i, rules);
    if (s.kind == StepKind::move) {
      static constexpr std::array<const char*, 4> kProfiles{"quintic", "trapezoidal", "s_curve",
                                                            "time_optimal"};
      rules.push_back(words("profile", {kProfiles.begin(), kProfiles.end()},
                            [&](std::size_t n) { s.profile = kProfiles[n]; }));
      rules.push_back(
          words("path", {"joint", "straight"}, [&](std::size_t n) { s.is_straight = n == 1; }));
    }
    const Skip is_inner = [&](Index n) { return is_block(s.kind) && step_kind(at(n)).has_value(); };
    return block(i, shown + " (" + std::string(to_string(s.kind)) + ")", rules, is_inner);
  }
  /// The path of an element of a list of the record, in memory.
  template <class R>
  static Way way_to(std::string_view list, std::size_t index) {
    return {{type_of<R>().field(list), 0}, {nullptr, index}};
  }

  std::unordered_map<std::string, std::int32_t> place_of_link_;  ///< of those read so far
  std::vector<Index> tool_fields_;                               ///< of the robot's further tools
  std::vector<Index> attached_fields_;                           ///< of the tools attached to it
};

}  // namespace

Result<Bound> bind(const Syntax& s) { return Binder(s).run(); }

}  // namespace robomosp::io
