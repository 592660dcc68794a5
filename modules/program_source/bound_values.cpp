// SPDX-License-Identifier: Apache-2.0
#include "program_source/bound_values.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <robomosp/sdk/post_writer.h>

#include "evaluation/features.h"
#include "kernel/expression.h"
#include "kernel/text.h"
#include "kernel/unknown_name.h"
#include "model/parametric.h"
#include "model/placement.h"
#include "model/solid_edit.h"
#include "program_source/source_text.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::program_source {
namespace {

using model::BindingKind;
using model::PlacedProgram;
using model::ProgramBinding;
using text::quote;

bool same_symbol(std::string_view a, std::string_view b) {
  return post::upper(a) == post::upper(b);
}

/// Computes the values of one place.
class Binder {
 public:
  Binder(const Workshop& with, const ProgramPlace& place, const rmp_code& code)
      : with_(with),
        placed_(*place.placed),
        code_(code),
        world_(*with.snapshot().get(place.world)),
        world_body_(with.snapshot().find(AnyId(place.world))->body),
        world_name_(with.snapshot().find(AnyId(place.world))->name),
        worlds_(with.snapshot().world_parameters()) {}

  Result<BoundValue> value(const ProgramBinding& b) {
    RMP_TRY_ASSIGN(const rmp_code_symbol* const variable, variable_of(b));
    BoundValue out{variable->name, {}, {}};
    if (b.kind == BindingKind::value) {
      RMP_TRY_ASSIGN(out.text, number(b, *variable));
      return out;
    }
    RMP_TRY_ASSIGN(const Pose world_T_point, point(b));
    RMP_TRY_ASSIGN(const Pose world_T_frame, frame_of(b));
    const Pose p = spatial::compose(spatial::inverse(world_T_frame), world_T_point);
    switch (row<rmp_code_type>(code_.types, variable->type).role) {
      case RMP_ROLE_POSE: out.text = irl_pose(p); break;
      case RMP_ROLE_ROBTARGET: out.field = "PSE", out.text = irl_pose(p); break;
      case RMP_ROLE_POSITION: out.text = irl_position(p.p); break;
      case RMP_ROLE_ORIENTATION: out.text = irl_orientation(p.R); break;
      default:
        return error(ErrorCode::invalid_argument,
                     quote(variable->name) +
                         " is not a point: points are POSE, ROBTARGET, POSITION or ORIENTATION",
                     "Declare it as one of these, or bind a number with kind = \"value\".");
    }
    return out;
  }

 private:
  /// Whose parameters expressions know, and where a point stands.
  struct Place {
    Pose world_T_place;
    const model::Body* body = nullptr;
    std::string own_name;  ///< of a world's own record
    AnyId what;            ///< solid or object; none of frames
  };

  Result<const rmp_code_symbol*> variable_of(const ProgramBinding& b) const {
    std::vector<std::string> known;
    for (std::uint32_t i = 0; i < code_.symbols.count; ++i) {
      const auto& s = row<rmp_code_symbol>(code_.symbols, i);
      if ((s.kind != RMP_SYMBOL_VARIABLE && s.kind != RMP_SYMBOL_CONSTANT) ||
          s.routine != RMP_NONE || s.scope == RMP_NONE ||
          row<rmp_code_scope>(code_.scopes, s.scope).kind != RMP_SCOPE_PROGRAM)
        continue;
      if (same_symbol(s.name, b.name)) return &s;
      known.emplace_back(s.name);
    }
    return unknown_name("variable of the program", b.name, known);
  }

  Result<Place> place(const std::string& name) const {
    for (const model::PlacedObject& o : world_.objects) {
      if (o.name != name) continue;
      for (const model::Attachment& held : world_.attachments)
        if (held.object == name)
          return error(ErrorCode::unsupported,
                       quote(name) + " is held by robot " + quote(held.robot) +
                           ", and has no fixed placement",
                       "Bind the point to an object or frame at rest.");
      return Place{model::pose(o.placement), &with_.snapshot().find(o.what)->body, {}, o.what};
    }
    for (const model::PlacedFrame& f : world_.frames)
      if (f.name == name) return Place{model::pose(f.placement), &world_body_, world_name_, {}};
    if (name.empty()) return Place{Pose{}, &world_body_, world_name_, {}};
    std::vector<std::string> known;
    for (const model::PlacedObject& o : world_.objects) known.push_back(o.name);
    for (const model::PlacedFrame& f : world_.frames) known.push_back(f.name);
    return unknown_name("object or frame", name, known);
  }

  /// Where on the object: a centre point, a part, a node, or a feature.
  Result<Pose> on_it(const Place& at, const ProgramBinding& b) const {
    if (b.at.empty()) return Pose{};
    if (at.what == AnyId{})
      return error(ErrorCode::invalid_argument,
                   "the frame " + quote(b.to) + " has no " + quote(b.at), "Leave at out.");
    if (const auto* o =
            at.what.kind == Kind::object ? &std::get<model::Object>(*at.body) : nullptr) {
      for (const auto& tcp : o->tcps)
        if (tcp.name == b.at) return model::pose(tcp.placement);
      for (const auto& part : o->parts)
        if (part.name == b.at) return model::pose(part.placement);
    }
    if (const auto* s = at.what.kind == Kind::solid ? &std::get<model::Solid>(*at.body) : nullptr)
      for (std::size_t i = 0; i < s->nodes.size(); ++i)
        if (s->nodes[i].name == b.at) return model::solid_T_node(*s, i);
    evaluation::FeatureSelector selector = b.at;
    if (const auto index = text::read_int(b.at)) selector = static_cast<double>(*index);
    RMP_TRY_ASSIGN(const CsgFeature f,
                   evaluation::feature_of(with_.from.derived, with_.snapshot(), at.what, selector,
                                          evaluation::FeatureUse::point, quote(b.to), "at",
                                          with_.progress));
    return Pose{evaluation::feature_rotation(f), f.point};
  }

  Result<double> number(const std::string& expression, const Place& at, std::string_view unit,
                        const char* what) const {
    if (expression.empty()) return 0.0;
    auto read = Expression::compile(expression);
    if (!read.ok()) return std::move(read).error().in(what);
    static const model::Parametric kNoParameters;
    const model::Parametric* own = model::parametric_of(*at.body);
    auto value =
        read->evaluate(model::lookup(own ? *own : kNoParameters, at.own_name, worlds_), unit);
    if (!value.ok()) return std::move(value).error().in(what);
    return value;
  }

  Result<Pose> point(const ProgramBinding& b) const {
    RMP_TRY_ASSIGN(const Place at, place(b.to));
    RMP_TRY_ASSIGN(const Pose there, on_it(at, b));
    RMP_TRY_ASSIGN(const double x, number(b.x, at, "m", "x"));
    RMP_TRY_ASSIGN(const double y, number(b.y, at, "m", "y"));
    RMP_TRY_ASSIGN(const double z, number(b.z, at, "m", "z"));
    RMP_TRY_ASSIGN(const double roll, number(b.roll, at, "rad", "roll"));
    RMP_TRY_ASSIGN(const double pitch, number(b.pitch, at, "rad", "pitch"));
    RMP_TRY_ASSIGN(const double yaw, number(b.yaw, at, "rad", "yaw"));
    return spatial::compose(spatial::compose(at.world_T_place, there),
                            Pose{spatial::from_rpy({roll, pitch, yaw}), {x, y, z}});
  }

  /// What targets of the point's robot are in.
  Result<Pose> frame_of(const ProgramBinding& b) const {
    std::string robot = b.joint, frame;
    const auto of = [&](const ProgramBinding& r) { return r.to.empty() ? placed_.robot : r.to; };
    for (const ProgramBinding& r : placed_.bindings) {
      if (r.kind != BindingKind::robot) continue;
      const bool is_own = r.name.empty();
      if (b.joint.empty() ? !is_own : of(r) != b.joint) continue;
      if (robot.empty()) robot = of(r);
      if (frame.empty()) frame = r.frame;
    }
    if (!frame.empty()) {
      RMP_TRY_ASSIGN(const Place at, place(frame));
      return at.world_T_place;
    }
    if (robot.empty()) robot = placed_.robot;
    if (robot.empty() && world_.robots.size() == 1) robot = world_.robots.front().name;
    if (robot.empty())
      return error(
          ErrorCode::invalid_argument,
          "the point belongs to no robot: the world has " + std::to_string(world_.robots.size()),
          "Give the binding robot = one of them.");
    std::vector<std::string> known;
    for (const model::PlacedRobot& r : world_.robots) {
      known.push_back(r.name);
      if (r.name != robot) continue;
      const Pose mounting = model::pose(r.placement);
      RMP_TRY_ASSIGN(const auto model,
                     with_.from.derived.robot_model(with_.snapshot(), r.robot,
                                                  spatial::rotate_back(mounting, world_.gravity),
                                                  with_.progress));
      return spatial::compose(mounting, model->base);
    }
    return unknown_name("robot", robot, known);
  }

  /// In the language's units: mm, degrees, kg and s, and what is made of them.
  Result<std::string> number(const ProgramBinding& b, const rmp_code_symbol& variable) const {
    RMP_TRY_ASSIGN(const Place at, place(b.to));
    auto read = Expression::compile(b.expression);
    if (!read.ok()) return std::move(read).error().in("expression");
    static const model::Parametric kNoParameters;
    const model::Parametric* own = model::parametric_of(*at.body);
    auto found = read->evaluate(model::lookup(own ? *own : kNoParameters, at.own_name, worlds_));
    if (!found.ok()) return std::move(found).error().in("expression");
    constexpr std::size_t kLength = 0, kAngle = 3;
    const double value = found->value * std::pow(1e3, found->dimension[kLength]) *
                         std::pow(180 / std::numbers::pi, found->dimension[kAngle]);
    if (!std::isfinite(value))
      return error(ErrorCode::invalid_argument,
                   quote(b.expression) + " is outside the range of numbers of the language", {},
                   "expression");
    if (variable.type == RMP_TYPE_REAL) return irl_real(value);
    if (variable.type != RMP_TYPE_INT)
      return error(ErrorCode::invalid_argument,
                   quote(variable.name) + " is not a number: values are for REAL and INT",
                   "Bind a placement with kind = \"point\".");
    constexpr double kMost = 2147483647.0;
    const double whole = std::round(value);
    if (std::fabs(value - whole) > 1e-9 * std::max(1.0, std::fabs(value)) ||
        std::fabs(whole) > kMost)
      return error(ErrorCode::invalid_argument,
                   quote(b.expression) + " is " + text::print(value) + ", and " +
                       quote(variable.name) + " is an INT",
                   "Declare it REAL, or round it: round(...).", "expression");
    return std::to_string(static_cast<std::int64_t>(whole));
  }

  const Workshop& with_;
  const PlacedProgram& placed_;
  const rmp_code& code_;
  const model::World& world_;
  const model::Body& world_body_;
  std::string world_name_;
  model::WorldParameters worlds_;
};

}  // namespace

bool gives_values(const PlacedProgram& placed) {
  return std::any_of(placed.bindings.begin(), placed.bindings.end(),
                     [](const ProgramBinding& b) { return model::gives_value(b.kind); });
}

Result<std::vector<BoundValue>> bound_values(const Workshop& with, const ProgramPlace& place,
                                             const rmp_code& plain) {
  std::vector<BoundValue> out;
  if (!with.snapshot().get(place.world))
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  Binder binder(with, place, plain);
  for (const ProgramBinding& b : place.placed->bindings) {
    if (!model::gives_value(b.kind)) continue;
    auto one = binder.value(b);
    if (!one.ok())
      return std::move(one).error().in("program " + quote(place.placed->name) + ", " +
                                       std::string(to_string(b.kind)) + " " + quote(b.name));
    out.push_back(std::move(*one));
  }
  return out;
}

}  // namespace robomosp::program_source
