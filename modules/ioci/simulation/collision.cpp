// SPDX-License-Identifier: Apache-2.0
// Collision: what touches, how far bodies are apart, whole paths, and the pairs that are checked.
#include <algorithm>
#include <cmath>
#include <limits>

#include "collision/collision.h"
#include "ioci/core/commands.h"
#include "spatial/vec.h"

namespace robomosp::ioci {
namespace {

using collision::CollisionModel;
using model::Robot;
using model::World;
using ModelPtr = std::shared_ptr<const collision::CollisionModel>;

bool is_world(const Map& args) { return ref(args, "id").kind == Kind::world; }

Result<ModelPtr> collision_model(CommandContext& ctx, const Map& args) {
  return ctx.app.collision_models.find({ctx.app.registry, ctx.app.derived, ctx.snapshot()},
                                       ref(args, "id"), ctx.progress);
}

/// Joint values of one robot as given.
Result<std::vector<double>> robot_q(CommandContext& ctx, const collision::CollisionRobot& r,
                                    const Value& value, const std::string& path) {
  return read_q(value, *ctx.snapshot().get(r.record), r.model->joints, path);
}

/// The configuration asked for: `q` of a robot; of a world a table of them by the robots' names.
Result<std::vector<double>> configuration(CommandContext& ctx, const Map& args,
                                          const CollisionModel& m) {
  std::vector<double> q = m.shown();
  const Value* given = args.find("q");
  if (!given || given->is_nil()) return q;
  const auto put = [&](const collision::CollisionRobot& r, const Value& value,
                       const std::string& path) -> Result<void> {
    RMP_TRY_ASSIGN(const auto own, robot_q(ctx, r, value, path));
    std::copy(own.begin(), own.end(), q.begin() + static_cast<std::ptrdiff_t>(r.first));
    return {};
  };
  const Map* by_name = given->as_map();
  if (!by_name) {
    if (m.robots().size() != 1)
      return error(ErrorCode::invalid_argument,
                   "the world has " + std::to_string(m.robots().size()) +
                       " robots, but the joint values name none of them",
                   "Give a table such as {arm = {0, 0.5, 0}}.", "q");
    RMP_TRY(put(m.robots().front(), *given, "q"));
    return q;
  }
  for (const auto& [name, value] : *by_name) {
    std::vector<std::string> known;
    const collision::CollisionRobot* robot = nullptr;
    for (const auto& r : m.robots()) {
      known.push_back(r.name);
      if (r.name == name) robot = &r;
    }
    if (!robot) return unknown_name("robot", name, known).in("q");
    RMP_TRY(put(*robot, value, "q." + name));
  }
  return q;
}

Value name_of(const CollisionModel& m, std::int32_t body) {
  return Value(m.bodies()[static_cast<std::size_t>(body)].name);
}

Map pair_row(const CollisionModel& m, const CollisionPair& pair) {
  return Map{{"a", name_of(m, pair.a)}, {"b", name_of(m, pair.b)}};
}

Map contact_row(const CollisionModel& m, const collision::Contact& c) {
  Map row = pair_row(m, c.pair);
  row.set("distance", Value(c.at.distance));
  row.set("on_a", vec_value(c.at.on_a, "m"));
  row.set("on_b", vec_value(c.at.on_b, "m"));
  return row;
}

/// The bodies that a name speaks of: one, or all of a robot.
Result<std::vector<std::int32_t>> bodies_named(CommandContext& ctx, const Map& args,
                                               const CollisionModel& m, const char* which) {
  const std::string name = text_of(args, which);
  std::vector<std::int32_t> out;
  std::vector<std::string> known;
  for (std::size_t i = 0; i < m.bodies().size(); ++i) {
    const collision::CollisionBody& b = m.bodies()[i];
    known.push_back(b.name);
    if (b.name == name) return std::vector{static_cast<std::int32_t>(i)};
    if (!is_world(args) || b.robot < 0 || b.is_held) continue;
    const std::string& robot = m.robots()[static_cast<std::size_t>(b.robot)].name;
    known.push_back(robot);
    if (robot == name) out.push_back(static_cast<std::int32_t>(i));
  }
  if (!out.empty()) return out;
  const auto& shapeless = m.shapeless();
  if (std::find(shapeless.begin(), shapeless.end(), name) != shapeless.end())
    return error(ErrorCode::invalid_argument,
                 text::quote(name) + " has no shape, so nothing can touch it", "Give it a part.",
                 name_in(ctx, ref(args, "id")));
  return unknown_name("body", name, known).in(name_in(ctx, ref(args, "id")));
}

/// The pairs that a and b ask for, whether they are checked or not; none = those that are checked.
Result<std::optional<std::vector<CollisionPair>>> pairs_asked(CommandContext& ctx, const Map& args,
                                                              const CollisionModel& m) {
  if (!has(args, "a") && !has(args, "b")) return std::optional<std::vector<CollisionPair>>{};
  const char* const first = has(args, "a") ? "a" : "b";
  RMP_TRY_ASSIGN(const auto a, bodies_named(ctx, args, m, first));
  std::vector<std::int32_t> b;
  if (has(args, "a") && has(args, "b")) {
    RMP_TRY_ASSIGN(b, bodies_named(ctx, args, m, "b"));
  } else {
    for (std::size_t i = 0; i < m.bodies().size(); ++i)
      if (std::find(a.begin(), a.end(), static_cast<std::int32_t>(i)) == a.end())
        b.push_back(static_cast<std::int32_t>(i));
  }
  std::vector<CollisionPair> out;
  for (const std::int32_t x : a)
    for (const std::int32_t y : b)
      if (x != y) out.push_back({x, y});
  if (out.empty())
    return error(ErrorCode::invalid_argument, "both names are the same body", "Name two bodies.",
                 name_in(ctx, ref(args, "id")));
  return std::optional(std::move(out));
}

Result<Value> collisions(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ModelPtr m, collision_model(ctx, args));
  RMP_TRY_ASSIGN(const auto q, configuration(ctx, args, *m));
  RMP_TRY_ASSIGN(const auto asked, pairs_asked(ctx, args, *m));
  RMP_TRY_ASSIGN(const auto hits,
                 asked ? m->touching(q, *asked, ctx.progress) : m->collisions(q, ctx.progress));
  List out;
  for (const CollisionPair& p : hits) out.emplace_back(pair_row(*m, p));
  return Value(std::move(out));
}

Result<Value> distances(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ModelPtr m, collision_model(ctx, args));
  RMP_TRY_ASSIGN(const auto q, configuration(ctx, args, *m));
  const double within =
      has(args, "within") ? real(args, "within") : std::numeric_limits<double>::infinity();
  RMP_TRY_ASSIGN(const auto asked, pairs_asked(ctx, args, *m));
  RMP_TRY_ASSIGN(auto rows, asked ? m->between(q, *asked, within, ctx.progress)
                                  : m->near(q, within, ctx.progress));
  std::erase_if(rows, [&](const auto& c) { return !(c.at.distance < within); });
  std::stable_sort(rows.begin(), rows.end(),
                   [](const auto& x, const auto& y) { return x.at.distance < y.at.distance; });
  List out;
  for (const collision::Contact& c : rows) out.emplace_back(contact_row(*m, c));
  return Value(std::move(out));
}

Result<Value> clearance(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ModelPtr m, collision_model(ctx, args));
  RMP_TRY_ASSIGN(const auto q, configuration(ctx, args, *m));
  const bool is_exact = flag(args, "exact") || !m->has_bounds();
  const double tolerance = is_exact ? 0 : real(args, "tolerance");
  RMP_TRY_ASSIGN(const auto nearest, m->clearance(q, tolerance, ctx.progress));
  if (nearest.front().pair.a < 0)
    return error(ErrorCode::invalid_argument, "nothing in it can touch, so there is no distance",
                 "Add an object or a robot, or allow fewer pairs to touch.",
                 name_in(ctx, ref(args, "id")));
  const PairDistance& at = nearest.front().at;
  // Two points of the bodies are so far apart; rounding is no bound.
  const double most = spatial::distance(at.on_a, at.on_b);
  const double bound =
      is_exact || !(at.distance > 0) || !(most > at.distance * (1 + 1e-9)) ? 0 : most - at.distance;
  Map row = contact_row(*m, nearest.front());
  row.set("bound", Value(bound));
  row.set("exact", Value(bound == 0));
  return Value(std::move(row));
}

/// Waypoints of all robots from a recording, or from a list of one robot's joint values.
struct Waypoints {
  std::vector<double> q;
  std::vector<double> times;  ///< of a recording [s]
};
Result<Waypoints> waypoints(CommandContext& ctx, const Map& args, const CollisionModel& m) {
  Waypoints w;
  if (has(args, "recording") == has(args, "path"))
    return error(ErrorCode::invalid_argument, "a path must be either a recording or a list",
                 "Give one of recording and path.");
  if (has(args, "recording")) {
    const auto recording = ctx.recording(*args.find("recording")->as_handle());
    RMP_TRY_ASSIGN(w.q, collision::configurations(m, *recording));
    w.times = recording->columns.front().values;
    return w;
  }
  const collision::CollisionRobot* robot = nullptr;
  std::vector<std::string> known;
  for (const auto& r : m.robots()) {
    known.push_back(r.name);
    if (!has(args, "robot") ? m.robots().size() == 1 : r.name == text_of(args, "robot")) robot = &r;
  }
  if (!robot && has(args, "robot")) return unknown_name("robot", text_of(args, "robot"), known);
  if (!robot)
    return error(
        ErrorCode::invalid_argument,
        "the world has " + std::to_string(known.size()) + " robots, but no moving robot is named",
        "Give robot, its name in the world.");
  const List* list = args.find("path")->as_list();
  if (!list || list->empty())
    return error(ErrorCode::invalid_argument, "the path is not a list of joint values",
                 "Give one such as {\"home\", {0, 0.5, 0}}.", "path");
  for (std::size_t i = 0; i < list->size(); ++i) {
    RMP_TRY_ASSIGN(const auto own,
                   robot_q(ctx, *robot, (*list)[i], "path[" + std::to_string(i + 1) + "]"));
    std::vector<double> all = m.shown();
    std::copy(own.begin(), own.end(), all.begin() + static_cast<std::ptrdiff_t>(robot->first));
    w.q.insert(w.q.end(), all.begin(), all.end());
  }
  return w;
}

Result<Value> check_path(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ModelPtr m, collision_model(ctx, args));
  RMP_TRY_ASSIGN(const Waypoints w, waypoints(ctx, args, *m));
  RMP_TRY_ASSIGN(const auto contact, m->check_path(w.q, real(args, "tolerance"), ctx.progress));
  List shapeless;
  for (const std::string& name : m->shapeless()) shapeless.emplace_back(name);
  Map out{{"is_free", !contact.has_value()}, {"shapeless", std::move(shapeless)}};
  if (!contact) return Value(std::move(out));
  const std::size_t i = contact->segment;
  out.set("segment", Value(i + 1));
  out.set("share", Value(contact->share));
  if (!w.times.empty()) {
    const double begin = w.times[i], end = i + 1 < w.times.size() ? w.times[i + 1] : begin;
    out.set("time", Value(begin + contact->share * (end - begin)));
  }
  for (const auto& [name, value] : contact_row(*m, contact->contact)) out.set(name, value);
  return Value(std::move(out));
}

std::string_view word(collision::PairReason r) {
  switch (r) {
    case collision::PairReason::adjacent: return "adjacent";
    case collision::PairReason::always: return "always";
    case collision::PairReason::rule: return "rule";
  }
  return "rule";
}

Result<Value> allowed_pairs(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ModelPtr m, collision_model(ctx, args));
  List out;
  for (const collision::PassedPair& p : m->passed()) {
    Map row = pair_row(*m, p.pair);
    row.set("why", Value(std::string(word(p.reason))));
    row.set("reason", Value(p.text));
    out.emplace_back(std::move(row));
  }
  return Value(std::move(out));
}

Result<Value> checked_pairs(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ModelPtr m, collision_model(ctx, args));
  List out;
  for (const CollisionPair& p : m->pairs()) out.emplace_back(pair_row(*m, p));
  return Value(std::move(out));
}

bool is_pair(const model::CollisionPairRule& r, const std::string& a, const std::string& b) {
  return (r.a == a && r.b == b) || (r.a == b && r.b == a);
}

/// The names that rules of a record may have: bodies, and a world's robots as a whole.
Result<void> check_names(CommandContext& ctx, const Map& args, std::span<const std::string> names) {
  RMP_TRY_ASSIGN(const ModelPtr m, collision_model(ctx, args));
  std::vector<std::string> known;
  for (const auto& b : m->bodies()) known.push_back(b.name);
  if (is_world(args))
    for (const auto& r : m->robots()) known.push_back(r.name);
  for (const std::string& name : names)
    if (std::find(known.begin(), known.end(), name) == known.end())
      return unknown_name("body", name, known).in(name_in(ctx, ref(args, "id")));
  return {};
}

template <class Fn>
Result<void> change_rules(CommandContext& ctx, const Map& args, Fn&& fn) {
  const AnyId id = ref(args, "id");
  const auto in = [&](auto& record) { return fn(record.pair_rules); };
  auto done = is_world(args) ? change<World>(ctx, id, in) : change<Robot>(ctx, id, in);
  if (!done.ok()) return std::move(done).error().in(name_in(ctx, id));
  return {};
}

Result<Value> set_rule(CommandContext& ctx, const Map& args, bool is_allowed) {
  const std::string a = text_of(args, "a"), b = text_of(args, "b");
  RMP_TRY(check_names(ctx, args, std::vector{a, b}));
  RMP_TRY(
      change_rules(ctx, args, [&](std::vector<model::CollisionPairRule>& rules) -> Result<void> {
        std::erase_if(rules, [&](const auto& r) { return is_pair(r, a, b); });
        rules.push_back({a, b, is_allowed, has(args, "reason") ? text_of(args, "reason") : ""});
        return {};
      }));
  return Value();
}
Result<Value> allow_pair(CommandContext& ctx, const Map& args) { return set_rule(ctx, args, true); }
Result<Value> forbid_pair(CommandContext& ctx, const Map& args) {
  return set_rule(ctx, args, false);
}

Result<Value> forget_pair(CommandContext& ctx, const Map& args) {
  const std::string a = text_of(args, "a"), b = text_of(args, "b");
  RMP_TRY(
      change_rules(ctx, args, [&](std::vector<model::CollisionPairRule>& rules) -> Result<void> {
        if (std::erase_if(rules, [&](const auto& r) { return is_pair(r, a, b); }) == 0)
          return error(ErrorCode::unknown_name,
                       "there is no rule for " + text::quote(a) + " and " + text::quote(b),
                       "Rules are created by allow_pair, forbid_pair and find_allowed_pairs.");
        return {};
      }));
  return Value();
}

Result<Value> find_allowed_pairs(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ModelPtr m, collision_model(ctx, args));
  const auto samples = static_cast<std::size_t>(integer(args, "samples"));
  RMP_TRY_ASSIGN(
      const auto found,
      m->sample_pairs(samples, static_cast<std::uint64_t>(integer(args, "seed")), ctx.progress));
  List out;
  std::vector<model::CollisionPairRule> made;
  const auto keep = [&](const CollisionPair& pair, bool always) {
    const std::string& a = m->bodies()[static_cast<std::size_t>(pair.a)].name;
    const std::string& b = m->bodies()[static_cast<std::size_t>(pair.b)].name;
    made.push_back({a, b, true,
                    std::string(always ? "touch always in " : "touch never in ") +
                        std::to_string(samples) + " samples"});
    Map row = pair_row(*m, pair);
    row.set("always", Value(always));
    out.emplace_back(std::move(row));
  };
  for (const collision::SampledPair& s : found) {
    const bool is_forced = [&] {
      for (const auto& r : content<Robot>(ctx, args).pair_rules)
        if (is_pair(r, m->bodies()[static_cast<std::size_t>(s.pair.a)].name,
                    m->bodies()[static_cast<std::size_t>(s.pair.b)].name))
          return true;
      return false;
    }();
    if (!is_forced) keep(s.pair, s.always);
  }
  RMP_TRY(
      change_rules(ctx, args, [&](std::vector<model::CollisionPairRule>& rules) -> Result<void> {
        rules.insert(rules.end(), made.begin(), made.end());
        return {};
      }));
  return Value(std::move(out));
}

std::string with_table(const char* rest) {
  return with_arm(
             "solid.create{name = \"table\", root = {kind = \"box\", x = 0.6, y = 0.6, z = 0.1}}\n"
             "local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm, q = "
             "\"ready\"}\n"
             "cell:add_object{what = \"table\", position = {0.8, 0, 0.2}}\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(collision_commands) {
  std::vector<CommandSpec> all;
  const auto add = [&](std::string name, std::string summary, std::string details,
                       std::string example, Schema params, ReturnSpec returns, Effect effect,
                       Result<Value> (*run)(CommandContext&, const Map&)) {
    all.push_back({.name = std::move(name),
                   .classic = "",
                   .summary = std::move(summary),
                   .details = std::move(details),
                   .example = std::move(example),
                   .params = std::move(params),
                   .returns = std::move(returns),
                   .effect = effect,
                   .run = run});
  };
  const ParamSpec a_field = field("a", "string", "", "One body."),
                  b_field = field("b", "string", "", "The other body.");
  const std::vector<ParamSpec> contact_fields{
      a_field, b_field,
      field(
          "distance", "real", "m",
          "0 or less if they touch: minus the penetration depth for convex shapes, 0 for meshes."),
      field("on_a", "vec3", "m", "Nearest point of a, in the world."),
      field("on_b", "vec3", "m", "Nearest point of b, in the world.")};
  const ParamSpec world_q = optional("q", "any", "rad or m",
                                     "Joint values or a named pose; for several robots a table by "
                                     "their names. By default as the world shows them.");
  std::vector<ParamSpec> clearance_fields = contact_fields;
  clearance_fields.push_back(
      field("bound", "real", "m",
            "Upper bound of the difference between the least distance and the returned one."));
  clearance_fields.push_back(field("exact", "bool", "", "Whether it is the least distance."));
  const ParamSpec exact = defaulted(
      "exact", "bool", "", false,
      "Computes the exact least distance, which takes longer if meshes are near each other.");
  const ParamSpec tolerance =
      between(defaulted("tolerance", "real", "m", 0.002,
                        "Greatest amount by which the result may be below the least distance; it "
                        "is never below half of it. 0 with exact."),
              1e-9, 1e9);
  const std::string conservative =
      "The result never exceeds the least distance, and may be smaller by up to `tolerance` if "
      "meshes are near each other: `bound` gives the possible difference. With exact it is the "
      "least distance.";
  const ParamSpec robot_q_spec =
      optional("q", "any", "rad or m", "Joint values or a named pose; home if omitted.");
  const std::string what =
      "Bodies are objects (\"table\"), robots' bases (\"arm.base\") and links (\"arm.elbow\"). "
      "allowed_pairs lists the pairs that are never checked.";
  const std::string any_pair =
      " With a and b, the result is for any two bodies, whether they are checked or not; with one "
      "of them, for that body and all others.";
  const ParamSpec one_body = optional("a", "string", "", "Only pairs with this body, or robot."),
                  other_body = optional("b", "string", "", "And with this one.");

  add("world.collisions", "Lists the pairs of bodies that touch.", what + any_pair,
      with_table("assert(#cell:collisions() == 0)\n"
                 "assert(#cell:collisions{q = {arm = {0, -0.3, 0.3, 0, 1, 0}}} > 0)"),
      {self("world"), world_q, one_body, other_body}, {"list", "", "Pairs.", {a_field, b_field}},
      Effect::reads, collisions);
  add("robot.self_collisions", "Lists the pairs of a robot's own bodies that touch.",
      "Bodies are \"base\" and the links by their names." + any_pair,
      with_arm("assert(#arm:self_collisions{q = \"ready\"} == 0)"),
      {self("robot"), robot_q_spec, one_body, other_body},
      {"list", "", "Pairs.", {a_field, b_field}}, Effect::reads, collisions);
  add("world.distances", "Lists the distances of bodies, the nearest first.", what + any_pair,
      with_table("local d = cell:distances{within = 0.5}\n"
                 "assert(#d > 0 and d[1].distance <= d[#d].distance)\n"
                 "assert(#cell:distances{a = \"arm.base\", b = \"table\"} == 1)"),
      {self("world"), world_q,
       above_zero(optional("within", "real", "m", "Only pairs nearer than this.")), one_body,
       other_body},
      {"list", "", "Pairs.", contact_fields}, Effect::reads, distances);
  add("world.clearance", "Returns the least distance between bodies, with the nearest points.",
      conservative + " " + what,
      with_table("local c = cell:clearance{exact = true}\n"
                 "local d = 0\nfor i = 1, 3 do d = d + (c.on_a[i] - c.on_b[i])^2 end\n"
                 "assert(math.abs(math.sqrt(d) - c.distance) < 1e-9)"),
      {self("world"), world_q, exact, tolerance}, {"map", "", "", clearance_fields}, Effect::reads,
      clearance);
  add("robot.clearance", "Returns the least distance between a robot's own bodies.",
      conservative + " Neighbours and other pairs that are allowed to touch do not count.",
      with_arm("local told = arm:clearance{q = \"ready\"}\n"
               "local least = arm:clearance{q = \"ready\", exact = true}\n"
               "assert(told.distance > 0 and told.distance <= least.distance)\n"
               "assert(least.distance <= told.distance + told.bound + 1e-12)"),
      {self("robot"), robot_q_spec, exact, tolerance}, {"map", "", "", clearance_fields},
      Effect::reads, clearance);
  std::vector<ParamSpec> path_fields{
      field("is_free", "bool", "", "True if nothing comes nearer than the tolerance."),
      field("shapeless", "list", "",
            "Names of members without a shape, which cannot touch anything."),
      field("segment", "int", "",
            "Segment between waypoints: 1 = between the first and the second."),
      field("share", "real", "", "Position along the segment, 0..1."),
      field("time", "real", "s", "Its time, for a recording.")};
  path_fields.insert(path_fields.end(), contact_fields.begin(), contact_fields.end());
  add("world.check_path",
      "Checks a whole motion, including the intervals between samples, and returns the first "
      "contact.",
      "Joints move uniformly from sample to sample. An interval counts as free once the distances "
      "at its ends add up to more than the bodies can move against each other meanwhile, so that "
      "thin bodies cannot be missed.",
      with_table("local r = cell:check_path{path = {\"ready\", {0, -0.3, 0.3, 0, 1, 0}}}\n"
                 "assert(not r.is_free and (r.a == \"table\" or r.b == \"table\"))\n"
                 "assert(cell:check_path{path = {\"ready\", {0.1, -0.9, 0.6, 0, 1, "
                 "0}}}.is_free)"),
      {self("world"), optional("recording", "ref:recording", "", "The motion."),
       optional("path", "list", "", "Instead: joint values or poses, in order."),
       optional("robot", "string", "", "Name in the world of the robot that moves along path."),
       above_zero(
           defaulted("tolerance", "real", "m", 1e-4,
                     "Bodies nearer than this count as touching; smaller values take longer."))},
      {"map", "", "", path_fields}, Effect::reads, check_path);

  for (const bool of_world : {false, true}) {
    const std::string kind = of_world ? "world" : "robot";
    const auto example = [&](const char* robot, const char* world) {
      return of_world ? with_table(world) : with_arm(robot);
    };
    const Schema pair{self(kind), needed("a", "string", "", "A body."),
                      needed("b", "string", "", "Another body.")};
    Schema rule = pair;
    rule.push_back(optional("reason", "string", "", "Reason, for readers."));
    const std::string names = of_world ? "Names are \"table\", \"arm.elbow\", \"arm.base\"; "
                                         "\"arm\" means all bodies of a robot."
                                       : "Names are \"base\" and those of the links.";
    add(kind + ".allowed_pairs", "Lists the pairs that are allowed to touch and are not checked.",
        "Neighbours (connected by a single joint or a closed loop) and pairs that touch in every "
        "one of 64 sampled configurations are found anew each time; rules are made by allow_pair "
        "and find_allowed_pairs, and removed by forget_pair.",
        example("assert(arm:allowed_pairs()[1].why == \"adjacent\")",
                "assert(#cell:allowed_pairs() > 0)"),
        {self(kind)},
        {"list",
         "",
         "",
         {a_field, b_field, field("why", "string", "", "adjacent, always or rule."),
          field("reason", "string", "", "Reason of a rule.")}},
        Effect::reads, allowed_pairs);
    add(kind + ".checked_pairs", "Lists the pairs that are checked.", names,
        example("assert(#arm:checked_pairs() > 0)", "assert(#cell:checked_pairs() > 0)"),
        {self(kind)}, {"list", "", "", {a_field, b_field}}, Effect::reads, checked_pairs);
    add(kind + ".allow_pair", "Allows two bodies to touch: they are no longer checked.", names,
        example(
            "local p = arm:checked_pairs()[1]\narm:allow_pair{a = p.a, b = p.b, reason = "
            "\"a cable\"}\nfor _, r in ipairs(arm:checked_pairs()) do assert(not (r.a == p.a "
            "and r.b == p.b)) end",
            "cell:allow_pair{a = \"arm\", b = \"table\"}\nassert(#cell:collisions{q = {0, -0.3, "
            "0.3, 0, 1, 0}} == 0)"),
        rule, {}, Effect::edits, allow_pair);
    add(kind + ".forbid_pair",
        "Checks two bodies in any case, even neighbours and bodies that never move.", names,
        example("local p = arm:allowed_pairs()[1]\narm:forbid_pair(p.a, p.b)\n"
                "for _, r in ipairs(arm:allowed_pairs()) do assert(not (r.a == p.a and r.b == "
                "p.b)) end",
                "cell:allow_pair(\"arm\", \"table\")\ncell:forbid_pair(\"arm\", \"table\")\n"
                "assert(#cell:collisions{q = {0, -0.3, 0.3, 0, 1, 0}} > 0)"),
        rule, {}, Effect::edits, forbid_pair);
    add(kind + ".forget_pair", "Removes a rule for two bodies.", names,
        example("local p = arm:checked_pairs()[1]\nlocal n = #arm:checked_pairs()\n"
                "arm:allow_pair(p.a, p.b)\narm:forget_pair(p.a, p.b)\n"
                "assert(#arm:checked_pairs() == n)",
                "cell:allow_pair(\"arm\", \"table\")\ncell:forget_pair(\"arm\", \"table\")\n"
                "assert(#cell:collisions{q = {0, -0.3, 0.3, 0, 1, 0}} > 0)"),
        pair, {}, Effect::edits, forget_pair);
  }
  ParamSpec samples = defaulted("samples", "int", "", std::int64_t{10000},
                                "Number of random configurations within the limits.");
  samples.min = 100;
  samples.max = 1e7;
  ParamSpec seed = defaulted("seed", "int", "", std::int64_t{1}, "Seed of the random numbers.");
  seed.min = 0;
  seed.max = 4294967295.0;
  add("robot.find_allowed_pairs",
      "Finds the pairs of a robot's bodies that never or always touch, and excludes them from "
      "checks.",
      "Samples configurations within the joint limits and writes a rule for each such pair into "
      "the robot. A pair that never touched in the samples may still touch between them: more "
      "samples make this less likely. Existing rules of pairs are kept.",
      with_arm("local n = #arm:checked_pairs()\nlocal found = arm:find_allowed_pairs{samples = "
               "200}\nassert(#arm:checked_pairs() == n - #found)"),
      {self("robot"), samples, seed},
      {"list",
       "",
       "The new rules.",
       {a_field, b_field,
        field("always", "bool", "", "Whether they always touch; false = never.")}},
      Effect::edits, find_allowed_pairs);
  return all;
}

}  // namespace robomosp::ioci
