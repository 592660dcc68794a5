// SPDX-License-Identifier: Apache-2.0
#include "ioci/trajectory/segments.h"

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <utility>

#include "ioci/core/commands.h"
#include "ioci/core/record_params.h"
#include "ioci/records/field_values.h"
#include "kernel/number_reader.h"
#include "kernel/text.h"
#include "kernel/units.h"
#include "model/field_types.h"
#include "model/parametric.h"
#include "motion/cartesian_path.h"
#include "motion/provider_params.h"
#include "motion/segment.h"

namespace robomosp::ioci {
namespace {

using model::ProviderChoice;
using model::TrajectorySegment;

Result<ProviderChoice::Param> param_of(const Value& v, const std::string& path) {
  if (v.as_bool()) return ProviderChoice::Param(*v.as_bool());
  if (v.as_int()) return ProviderChoice::Param(*v.as_int());
  if (v.as_real()) return ProviderChoice::Param(*v.as_real());
  if (v.as_string()) return ProviderChoice::Param(*v.as_string());
  if (v.as_array() || v.as_list()) return ProviderChoice::Param(reals(&v));
  return error(ErrorCode::invalid_argument, v.text() + " is not a parameter's value", {}, path);
}

/// A table of names; an empty one of Lua comes as a list.
bool is_table(const Value& v) { return v.as_map() || (v.as_list() && v.as_list()->empty()); }
void add_all(const Value& table, Map& to) {
  if (const Map* m = table.as_map())
    for (const auto& [name, value] : *m) to.set(name, value);
}

/// `law = "trapezoidal"` or `law = {name = "trapezoidal", ...}`; its parameters go to `params`.
Result<void> read_choice(const Value& v, ProviderChoice& out, Map& params,
                         const std::string& path) {
  if (v.as_string()) {
    out.name = *v.as_string();
    return {};
  }
  const Map* table = v.as_map();
  const Value* name = table ? table->find("name") : nullptr;
  if (!table || (name && !name->as_string()))
    return error(ErrorCode::invalid_argument, v.text() + " is not a provider",
                 "Give its name, or a table with name and parameters.", path);
  if (name) out.name = *name->as_string();
  for (const auto& [key, value] : *table)
    if (key == "params" && is_table(value)) add_all(value, params);  // as segments are described
    else if (key != "name") params.set(key, value);
  return {};
}

/// `given`, each by the first owner that has a parameter of that name, to `out`; `words` are what
/// else may stand there, for the hint of an unknown one.
Result<void> read_params(std::span<const ProviderInfo* const> owners,
                         std::vector<std::string> words, const Map& given, ProviderChoice& out,
                         const std::string& path) {
  for (const ProviderInfo* info : owners)
    for (const ParamSpec& p : info->schema) words.push_back(p.name);
  for (const auto& [key, v] : given) {
    const std::string here = path + "." + key;
    const ParamSpec* spec = nullptr;
    for (std::size_t i = 0; i < owners.size() && !spec; ++i)
      spec = motion::find_parameter(*owners[i], key);
    if (!spec) {
      std::string hint = text::did_you_mean(key, words);
      if (hint.empty()) hint = "There are " + text::enumerate(words) + ".";
      return error(ErrorCode::unknown_name,
                   text::quote(owners.front()->name) + " has no parameter " + text::quote(key),
                   hint, path);
    }
    RMP_TRY_ASSIGN(const Value checked, check_value(*spec, v, here));
    RMP_TRY_ASSIGN(out.params[key], param_of(checked, here));
  }
  return {};
}

Result<model::Transition> read_transition(const CommandContext& ctx, const Value& v,
                                          const std::string& path) {
  model::Transition out;
  if (v.as_string() && *v.as_string() == "none") {
    out.is_smooth = false;
    return out;
  }
  if (v.as_string() && *v.as_string() == "smooth") return out;
  if (!v.as_map())
    return error(ErrorCode::invalid_argument, v.text() + " is not a transition",
                 "Give \"none\", \"smooth\" or {distance = ..., speed = ...}.", path);
  static const Schema schema{
      between(
          optional(
              "distance", "real", "m",
              "Distance of the cut from the corner; at most 45 % of a neighbour's time is cut."),
          0, 1e6),
      between(optional("speed", "real", "m/s", "Greatest speed within it."), 0, 1e6)};
  RMP_TRY_ASSIGN(const Map given, read_map(ctx, schema, v, path));
  if (has(given, "distance")) out.distance = real(given, "distance");
  if (has(given, "speed")) out.speed = real(given, "speed");
  return out;
}

/// Fields of TrajectorySegment that segments give in a form of their own; all others are as
/// declared.
constexpr std::string_view kOwnSegmentForms[] = {"shape",   "law",       "orientation",
                                                 "turning", "points",    "joints",
                                                 "stored",  "placement", "transition"};
template <class Fn>
void each_declared_field(Fn&& see) {
  for (const model::Field& f : model::type_of<TrajectorySegment>().fields)
    if (std::find(std::begin(kOwnSegmentForms), std::end(kOwnSegmentForms), f.name) ==
        std::end(kOwnSegmentForms))
      see(f);
}
/// One of these; null = there is no such field.
const model::Field* declared_segment_field(std::string_view name) {
  const model::Field* found = nullptr;
  each_declared_field([&](const model::Field& f) {
    if (f.name == name) found = &f;
  });
  return found;
}
Result<void> read_declared(const CommandContext& ctx, const model::Field& f, const Value& v,
                           TrajectorySegment& out, const std::string& path) {
  const ParamSpec* p = find_param(declared_segment_params(), f.name);
  RMP_CHECK(p, "a declared field of segments has no parameter");
  const Schema schema{*p};
  RMP_TRY_ASSIGN(const Map checked,
                 read_map(ctx, schema, Value(Map{{std::string(f.name), v}}), path));
  return set_field(f, &out, checked);
}

/// The rows of a list, or of a matrix such as a recording gives.
std::optional<List> rows_of(const Value& given) {
  if (given.as_list()) return *given.as_list();
  const NumericArray* array = given.as_array();
  if (!array || !array->is_matrix()) return {};
  List rows;
  for (std::size_t r = 0; r < array->rows(); ++r) {
    std::vector<double> row(array->cols());
    for (std::size_t c = 0; c < row.size(); ++c) row[c] = array->at(r, c);
    rows.emplace_back(NumericArray(std::move(row)));
  }
  return rows;
}

/// A position alone is a pose with the trajectory's axes.
Value with_axes(const Value& point) {
  List numbers;
  if (point.as_list()) numbers = *point.as_list();
  else if (const NumericArray* a = point.as_array(); a && !a->is_matrix())
    numbers.assign(a->data().begin(), a->data().end());
  if (numbers.size() != 3) return point;
  numbers.resize(6, Value(0.0));
  return Value(std::move(numbers));
}

Result<void> read_points(const Value& given, TrajectorySegment& out, const std::string& path) {
  const std::optional<List> list = rows_of(given);
  if (!list)
    return error(ErrorCode::invalid_argument, given.text() + " is not a list of poses",
                 "Give {{x, y, z, roll, pitch, yaw}, ...} or {{x, y, z}, ...}.", path);
  for (std::size_t i = 0; i < list->size(); ++i) {
    const Value point = with_axes((*list)[i]);
    RMP_TRY_ASSIGN(auto placement,
                   read_placement(&point, path + "[" + std::to_string(i + 1) + "]"));
    out.points.push_back(placement);
  }
  return {};
}

Result<void> read_joints(const Value& given, TrajectorySegment& out, const std::string& path) {
  const std::optional<List> list = rows_of(given);
  if (!list)
    return error(ErrorCode::invalid_argument, given.text() + " is not a list of joint vectors",
                 "Give {{q1, q2, ...}, ...}.", path);
  for (std::size_t i = 0; i < list->size(); ++i) {
    RMP_TRY_ASSIGN(auto q, read_joint_vector((*list)[i], path + "[" + std::to_string(i + 1) + "]"));
    out.joints.push_back(std::move(q));
  }
  return {};
}

Result<TrajectorySegment> read_stored(const CommandContext& ctx, const Map& given,
                                      const std::string& path) {
  TrajectorySegment out;
  static const Schema schema = [] {
    Schema s = placement_fields("The trajectory's frame.");
    s.push_back(needed("trajectory", "ref:trajectory", "", "The trajectory to run."));
    s.push_back(optional("transition", "any", "", "Transition from the segment before."));
    for (const ParamSpec& p : declared_segment_params()) s.push_back(p);
    return s;
  }();
  RMP_TRY_ASSIGN(const Map checked, read_map(ctx, schema, Value(given), path));
  out.stored = typed<model::Trajectory>(checked, "trajectory");
  Result<void> set;
  each_declared_field([&](const model::Field& f) {
    if (set.ok()) set = set_field(f, &out, checked);
  });
  RMP_TRY(set);
  RMP_TRY_ASSIGN(out.placement, read_placement_fields(given, path));
  if (has(checked, "transition")) {
    RMP_TRY_ASSIGN(out.transition,
                   read_transition(ctx, *checked.find("transition"), path + ".transition"));
  }
  return out;
}

}  // namespace

const Schema& declared_segment_params() {
  static const Schema all = [] {
    Schema out;
    each_declared_field([&](const model::Field& f) {
      out.push_back(model::field_param("trajectory", "segments." + std::string(f.name), f));
      out.back().required = false;
    });
    return out;
  }();
  return all;
}

Result<std::vector<double>> read_joint_vector(const Value& row, const std::string& path) {
  std::vector<double> q;
  if (row.as_list()) {
    // Angles and lengths alike: the robot is not known yet, so a unit is taken as it is written.
    for (std::size_t k = 0; k < row.as_list()->size(); ++k) {
      const Value& v = (*row.as_list())[k];
      const std::string at = path + "[" + std::to_string(k + 1) + "]";
      const bool is_length = v.as_string() && v.as_string()->ends_with('m');
      const bool is_quantity = !v.as_string() || units::read_quantity(*v.as_string(), "m").ok() ||
                               units::read_quantity(*v.as_string(), "rad").ok();
      const std::string unit(!is_quantity && NumberReader::current() ? model::kByJoint
                             : is_length                             ? "m"
                                                                     : "rad");
      RMP_TRY_ASSIGN(const Value number, check_value(needed(at, "real", unit, ""), v, at));
      q.push_back(*number.as_real());
    }
  } else {
    q = reals(&row);
  }
  if (q.empty())
    return error(ErrorCode::invalid_argument, row.text() + " is not a joint vector",
                 "Give one number per joint.", path);
  return q;
}

Result<TrajectorySegment> read_segment(const CommandContext& ctx, const Value& value,
                                       const std::string& path) {
  const Map* given = value.as_map();
  if (!given)
    return error(ErrorCode::invalid_argument, value.text() + " is not a segment",
                 "Give a table such as {shape = \"line\", points = {...}}.", path);
  if (given->find("trajectory")) return read_stored(ctx, *given, path);
  TrajectorySegment out;
  const Value* shape = given->find("shape");
  if (!shape || !shape->as_string())
    return error(ErrorCode::invalid_argument, "the segment has no shape", "Give shape = \"line\".",
                 path);
  out.shape.name = *shape->as_string();
  Map params, law, orientation, turning;
  for (const auto& [key, v] : *given) {
    const std::string here = path + "." + key;
    if (v.is_nil() || key == "shape") continue;
    if (key == "points") {
      RMP_TRY(read_points(v, out, here));
    } else if (key == "joints") {
      RMP_TRY(read_joints(v, out, here));
    } else if (key == "law") {
      RMP_TRY(read_choice(v, out.law, law, here));
    } else if (key == "orientation") {
      RMP_TRY(read_choice(v, out.orientation, orientation, here));
    } else if (key == "turning") {
      RMP_TRY(read_choice(v, out.turning, turning, here));
      if (out.turning.name.empty())
        return error(ErrorCode::invalid_argument, "the rotation timing law has no name",
                     "Give turning = \"cubic\" or {name = \"cubic\", ...}.", here);
      if (out.turning.name == "none") out.turning.name.clear();
    } else if (key == "transition") {
      RMP_TRY_ASSIGN(out.transition, read_transition(ctx, v, here));
    } else if (key == "params" && is_table(v)) {
      add_all(v, params);
    } else if (const model::Field* f = declared_segment_field(key)) {
      RMP_TRY(read_declared(ctx, *f, v, out, path));
    } else {
      params.set(key, v);
    }
  }
  RMP_TRY_ASSIGN(const motion::SegmentProviders providers,
                 motion::providers_of(ctx.app.registry, out, path));
  std::vector<std::string> words{"shape",       "points",  "joints",     "law",
                                 "orientation", "turning", "transition", "params"};
  each_declared_field([&](const model::Field& f) { words.emplace_back(f.name); });
  RMP_TRY(read_params(providers.owners(), std::move(words), params, out.shape, path));
  if (!providers.is_curve() && !(law.empty() && orientation.empty()))
    return error(
        ErrorCode::invalid_argument,
        text::quote(out.shape.name) + " is not a curve and has its own law and orientation",
        "Leave these tables out.", path);
  // In a table of its own, a parameter is that provider's, also where others have one of its name.
  RMP_TRY(read_params(std::array{&std::as_const(providers.law)}, {"name"}, law, out.law,
                      path + ".law"));
  RMP_TRY(read_params(std::array{&std::as_const(providers.orientation)}, {"name"}, orientation,
                      out.orientation, path + ".orientation"));
  RMP_TRY(read_params(std::array{&std::as_const(providers.turning)}, {"name"}, turning, out.turning,
                      path + ".turning"));
  return out;
}

Result<TrajectorySegment> update_segment(const CommandContext& ctx, const TrajectorySegment& old,
                                         const Value& value, const std::string& path) {
  const Map* given = value.as_map();
  if (!given || given->find("trajectory") || (old.stored && given->find("shape"))) {
    RMP_TRY_ASSIGN(TrajectorySegment out, read_segment(ctx, value, path));
    if (given && !given->find("transition")) out.transition = old.transition;
    return out;
  }
  Map merged = *given;
  if (old.stored) {
    merged.set("trajectory", ref_value(ctx.snapshot(), AnyId(old.stored)));
    RMP_TRY_ASSIGN(TrajectorySegment out, read_segment(ctx, Value(std::move(merged)), path));
    if (std::none_of(std::begin(kPlacementFields), std::end(kPlacementFields),
                     [&](std::string_view field) { return given->find(field) != nullptr; }))
      out.placement = old.placement;
    if (!given->find("transition")) out.transition = old.transition;
    return out;
  }
  // Names decide which parameters there may be.
  const auto name_of = [](const Value* v) -> std::string {
    if (v && v->as_map()) v = v->as_map()->find("name");
    return v && v->as_string() ? *v->as_string() : std::string();
  };
  TrajectorySegment named = old;
  const bool is_same_shape =
      !given->find("shape") || name_of(given->find("shape")) == old.shape.name;
  if (!is_same_shape) named.shape = {name_of(given->find("shape")), {}};
  if (given->find("law")) named.law = {name_of(given->find("law")), {}};
  if (given->find("orientation")) named.orientation = {name_of(given->find("orientation")), {}};
  merged.set("shape", named.shape.name);
  for (const auto& [key, choice] :
       {std::pair{"law", &named.law}, std::pair{"orientation", &named.orientation}})
    if (!choice->name.empty() && !given->find(key)) merged.set(key, choice->name);
  if (is_same_shape) {
    RMP_TRY_ASSIGN(const motion::SegmentProviders providers,
                   motion::providers_of(ctx.app.registry, named, path));
    Map params;
    for (const auto& [key, param] : old.shape.params)
      if (providers.parameter(key) && !given->find(key)) params.set(key, motion::value_of(param));
    if (const Value* more = given->find("params"); more && more->as_map())
      for (const auto& [key, v] : *more->as_map()) params.set(key, v);
    merged.set("params", std::move(params));
  }
  RMP_TRY_ASSIGN(TrajectorySegment out, read_segment(ctx, Value(std::move(merged)), path));
  if (!given->find("points") && !given->find("joints")) {
    out.points = old.points;
    out.joints = old.joints;
  }
  if (!given->find("law")) out.law = old.law;
  if (!given->find("orientation")) out.orientation = old.orientation;
  if (!given->find("turning")) out.turning = old.turning;
  if (!given->find("transition")) out.transition = old.transition;
  each_declared_field([&](const model::Field& f) {
    if (!given->find(f.name)) f.type->assign(f.in(&out), f.in(&std::as_const(old)));
  });
  return out;
}

bool moves_joints(const CommandContext& ctx, const TrajectorySegment& segment) {
  if (segment.stored) {
    const model::Trajectory* stored = ctx.snapshot().get(segment.stored);
    // A trajectory that runs itself is given by the path.
    return stored && std::any_of(stored->segments.begin(), stored->segments.end(),
                                 [&](const auto& s) { return !s.stored && moves_joints(ctx, s); });
  }
  const auto providers = motion::providers_of(ctx.app.registry, segment, "");
  return providers.ok() && providers->is_joint();
}

Result<void> check_trajectory(const CommandContext& ctx, const std::string& name,
                              const model::Trajectory& t) {
  if (t.segments.empty()) return {};
  RMP_TRY_ASSIGN(const auto notes,
                 motion::Path::check(ctx.app.registry, name, t, motion::stored_in(ctx.snapshot())));
  for (const std::string& note : notes)
    ctx.app.messages.post(Severity::warning, "transition", note, "ioci");
  return {};
}

Result<std::shared_ptr<const motion::Path>> path_of(const CommandContext& ctx, const Map& args) {
  return ctx.app.paths.find(ctx.app.registry, ctx.snapshot(), TrajectoryId{ref(args, "id").number});
}

Result<Value> change_trajectory(CommandContext& ctx, const Map& args,
                                const std::function<Result<void>(model::Trajectory&)>& fn) {
  const AnyId id = ref(args, "id");
  const std::string name = ctx.snapshot().find(id)->name;
  auto done = change<model::Trajectory>(ctx, id, [&](model::Trajectory& t) -> Result<void> {
    auto changed = fn(t);
    if (!changed.ok()) return std::move(changed).error().in("trajectory " + text::quote(name));
    return check_trajectory(ctx, name, t);
  });
  if (!done.ok()) return std::move(done).error();
  return Value();
}

std::string with_stroke(const char* rest) {
  return std::string(
             "local stroke = trajectory.create{name = \"stroke\", segments = {\n  {shape = "
             "\"line\", points = {{0.5, 0, 0.3, 0, 0, 0}, {0.5, \"200 mm\", 0.3, 0, 0, 0}}}}}\n") +
         rest;
}

Value segment_value(const document::Snapshot& s, const TrajectorySegment& segment) {
  Map out;
  if (segment.stored) {
    out.set("trajectory", ref_value(s, AnyId(segment.stored)));
    out.set("placement", placement_value(segment.placement));
  } else {
    out.set("shape", segment.shape.name);
    const Value shape = provider_value(segment.shape);
    out.set("params", *shape.as_map()->find("params"));
    if (!segment.joints.empty()) {
      List joints;
      for (const auto& q : segment.joints) joints.emplace_back(NumericArray(q));
      out.set("joints", std::move(joints));
    }
    if (!segment.points.empty() || segment.joints.empty()) {
      List points;
      for (const model::Placement& p : segment.points) points.emplace_back(placement_value(p));
      out.set("points", std::move(points));
    }
    if (segment.law != ProviderChoice{}) out.set("law", provider_value(segment.law));
    if (segment.orientation != ProviderChoice{})
      out.set("orientation", provider_value(segment.orientation));
    if (segment.turning != ProviderChoice{}) out.set("turning", provider_value(segment.turning));
  }
  const model::Transition& t = segment.transition;
  if (!t.is_smooth) out.set("transition", "none");
  else if (t != model::Transition{})
    out.set("transition", Map{{"distance", t.distance}, {"speed", t.speed}});
  const model::Type& type = model::type_of<TrajectorySegment>();
  each_declared_field([&](const model::Field& f) {
    if (Value v = changed_value(&s, type, f, &segment); !v.is_nil())
      out.set(std::string(f.name), std::move(v));
  });
  return Value(std::move(out));
}

namespace {

/// As segment_value() writes it: all parameters in tables of their own.
Result<TrajectorySegment> read_described(const CommandContext& ctx, const Map& given,
                                         const std::string& path) {
  TrajectorySegment out;
  for (const auto& [key, v] : given) {
    const std::string here = path + "." + key;
    if (v.is_nil() || key == "params") continue;
    if (key == "shape") {
      RMP_TRY_ASSIGN(out.shape,
                     read_provider(Map{{"name", v}, {"params", *given.find("params")}}, here));
    } else if (key == "points") {
      RMP_TRY(read_points(v, out, here));
    } else if (key == "joints") {
      RMP_TRY(read_joints(v, out, here));
    } else if (key == "law") {
      RMP_TRY_ASSIGN(out.law, read_provider(v, here));
    } else if (key == "orientation") {
      RMP_TRY_ASSIGN(out.orientation, read_provider(v, here));
    } else if (key == "turning") {
      RMP_TRY_ASSIGN(out.turning, read_provider(v, here));
    } else if (key == "transition") {
      RMP_TRY_ASSIGN(out.transition, read_transition(ctx, v, here));
    } else if (const model::Field* f = declared_segment_field(key)) {
      RMP_TRY(read_declared(ctx, *f, v, out, path));
    } else {
      return read_segment(ctx, Value(given), path);  // which names what it is not
    }
  }
  return out;
}

const OwnFormFile kSegmentForm(
    {.type = model::type_of<TrajectorySegment>,
     .of =
         [](const document::Snapshot& snapshot, const model::Content&, const void* p) {
           return std::optional(segment_value(snapshot, *static_cast<const TrajectorySegment*>(p)));
         },
     .read = [](const CommandContext& ctx, void* p, const Value& v,
                const std::string& path) -> Result<bool> {
       const Map* m = v.as_map();
       const Value* shape = m ? m->find("shape") : nullptr;
       const bool is_stored = m && m->find("trajectory");
       if (!is_stored &&
           (!shape || !shape->as_string() || m->find("placement") || m->find("stored")))
         return false;
       // A stored provider need not be loaded.
       RMP_TRY_ASSIGN(*static_cast<TrajectorySegment*>(p), m->find("params") && !is_stored
                                                               ? read_described(ctx, *m, path)
                                                               : read_segment(ctx, v, path));
       return true;
     }});

}  // namespace

}  // namespace robomosp::ioci
