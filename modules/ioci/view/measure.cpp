// SPDX-License-Identifier: Apache-2.0
// Measuring in worlds, robots, objects and solids: distances, angles, radii and axes of what a
// picture of them shows.
#include "scene/measure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "collision/collision.h"
#include "ioci/core/commands.h"
#include "ioci/core/runs.h"
#include "ioci/view/followed_scenes.h"
#include "ioci/view/run_motion.h"
#include "kernel/type.h"
#include "scene/motion.h"

namespace robomosp::ioci {
namespace {

using scene::MeasuredAs;
using scene::MeasuredFeature;
using scene::Measurement;

/// Scenes without paths, which are only measured. Kept with the application.
struct MeasuredScenes : FollowedScenes {
  using FollowedScenes::FollowedScenes;
};

constexpr std::pair<std::string_view, MeasuredAs> kAs[] = {
    {"body", MeasuredAs::body},     {"face", MeasuredAs::face},   {"edge", MeasuredAs::edge},
    {"corner", MeasuredAs::corner}, {"point", MeasuredAs::point}, {"frame", MeasuredAs::frame},
    {"tool", MeasuredAs::tool}};

/// The type of one end of a measurement.
const std::string& place_type() {
  static const std::string type = [] {
    std::string words;
    for (const auto& [word, as] : kAs) words += (words.empty() ? "" : "|") + std::string(word);
    return "map{body?: string \"A member, link or part; omitted, all that is shown.\"; as?: enum(" +
           words +
           ") \"What is measured there.\"; place?: vec3 [m] \"Point near which a face, edge or "
           "corner is taken.\"}";
  }();
  return type;
}

Result<scene::MeasuredPlace> read_place(CommandContext& ctx, const Map& args, const char* name) {
  RMP_TRY_ASSIGN(const Map given,
                 read_map(ctx, type_tree(place_type()).fields, *args.find(name), name));
  scene::MeasuredPlace out;
  if (has(given, "body")) out.body = text_of(given, "body");
  if (has(given, "place")) out.place = vec3(given, "place");
  out.as = !out.place ? MeasuredAs::body : out.body.empty() ? MeasuredAs::point : MeasuredAs::face;
  if (has(given, "as")) {
    const std::string word = text_of(given, "as");
    for (const auto& [each, as] : kAs)
      if (each == word) out.as = as;
  }
  return out;
}

/// Where a run or a recording has the members; null = where the document has them.
Result<scene::MotionPtr> given_motion(CommandContext& ctx, const Map& args, AnyId id) {
  const bool has_recording = has(args, "recording"), has_run = has(args, "run");
  if (has_recording && has_run)
    return error(ErrorCode::invalid_argument, "a recording and a run both move the world",
                 "Leave one of them out.", "run");
  if (has(args, "at") && !has_recording)
    return error(ErrorCode::invalid_argument, "a time needs a recording", "Give recording too.",
                 "at");
  if (has_run) {
    const Handle& run = *args.find("run")->as_handle();
    const LiveRunPtr found = ctx.app.runs->find(run.number);
    if (!found) throw StaleHandle{run};
    return run_motion(ctx.snapshot(), id, *found);
  }
  if (!has_recording) return scene::MotionPtr();
  const auto recording = ctx.recording(*args.find("recording")->as_handle());
  RMP_TRY_ASSIGN(scene::Motion at, scene::motion_at(ctx.snapshot(), WorldId{id.number}, *recording,
                                                    has(args, "at") ? real(args, "at") : 0.0));
  return scene::MotionPtr(std::make_shared<const scene::Motion>(std::move(at)));
}

/// Bodies of a collision model by a name as find_feature() takes it; none where it is only a part
/// of one.
std::vector<std::int32_t> bodies_of(const collision::CollisionModel& m, const std::string& name) {
  std::vector<std::int32_t> out;
  for (std::size_t i = 0; i < m.bodies().size(); ++i) {
    const std::string& each = m.bodies()[i].name;
    if (each == name || each.starts_with(name + ".")) out.push_back(static_cast<std::int32_t>(i));
  }
  return out;
}

/// The distance of two whole bodies by the engine of collisions, which knows round shapes exactly.
/// Nothing where it does not know both.
std::optional<Measurement> between_bodies(CommandContext& ctx, AnyId id,
                                          const std::vector<double>& robot_q, const std::string& a,
                                          const std::string& b) {
  if (a.empty() || b.empty() || (id.kind != Kind::world && id.kind != Kind::robot)) return {};
  const auto found = ctx.app.collision_models.find(
      {ctx.app.registry, ctx.app.derived, ctx.snapshot()}, id, ctx.progress);
  if (!found.ok()) return {};
  const collision::CollisionModel& m = **found;
  std::vector<CollisionPair> pairs;
  for (const std::int32_t x : bodies_of(m, a))
    for (const std::int32_t y : bodies_of(m, b))
      if (x != y) pairs.push_back({x, y});
  if (pairs.empty()) return {};
  const std::vector<double> q = robot_q.empty() ? m.shown() : robot_q;
  const auto rows = m.between(q, pairs, std::numeric_limits<double>::infinity(), ctx.progress);
  if (!rows.ok() || rows->empty()) return {};
  const auto least = std::min_element(rows->begin(), rows->end(), [](const auto& x, const auto& y) {
    return x.at.distance < y.at.distance;
  });
  if (!std::isfinite(least->at.distance)) return {};
  Measurement out;
  out.distance = std::max(0.0, least->at.distance);
  out.from = least->at.on_a;
  out.to = least->at.on_b;
  return out;
}

Map feature_map(const MeasuredFeature& f) {
  using FeatureKind = MeasuredFeature::Kind;
  Map m{{"kind", scene::word_of(f.kind)}};
  if (!f.body.empty()) m.set("body", f.body);
  const bool has_point =
      f.kind != FeatureKind::body && f.kind != FeatureKind::surface && f.kind != FeatureKind::curve;
  if (has_point) m.set("point", vec_value(f.point, "m"));
  if (f.direction != Vec3{}) m.set("direction", vec_value(f.direction));
  if (f.radius > 0) m.set("radius", f.radius);
  if (f.length > 0) {
    m.set("length", f.length);
    m.set("start", vec_value(f.ends[0], "m"));
    m.set("finish", vec_value(f.ends[1], "m"));
  }
  if (f.area > 0) m.set("area", f.area);
  if (f.angle > 0) m.set("angle", f.angle);
  if (f.is_inward) m.set("is_inward", true);
  m.set("is_of_mesh", f.is_of_mesh);
  return m;
}

Result<Value> measure_in(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  RMP_TRY_ASSIGN(const scene::MeasuredPlace a, read_place(ctx, args, "a"));
  std::optional<scene::MeasuredPlace> b;
  if (has(args, "b")) {
    RMP_TRY_ASSIGN(b, read_place(ctx, args, "b"));
  }
  scene::Extras extras;
  extras.paths = scene::ShownPath::none;
  if (has(args, "q")) {
    RMP_TRY_ASSIGN(const auto model, model_of(ctx, args));
    RMP_TRY_ASSIGN(extras.q,
                   read_q(*args.find("q"), content<model::Robot>(ctx, args), model->joints, "q"));
  }
  const std::vector<double> q = extras.q;
  RMP_TRY_ASSIGN(const scene::MotionPtr motion, given_motion(ctx, args, id));
  RMP_TRY_ASSIGN(const scene::FramePtr frame,
                 ctx.app.kept<MeasuredScenes>().frame(ctx, id, std::move(extras), motion));
  RMP_TRY_ASSIGN(const MeasuredFeature from,
                 scene::find_feature(*frame, ctx.app.derived, a, "a", ctx.progress));
  Map out{{"a", feature_map(from)}};
  if (!b) return Value(std::move(out));
  RMP_TRY_ASSIGN(const MeasuredFeature to,
                 scene::find_feature(*frame, ctx.app.derived, *b, "b", ctx.progress));
  std::optional<Measurement> m;
  const double bound = from.bound + to.bound;
  if (a.as == MeasuredAs::body && b->as == MeasuredAs::body && !motion && bound > 0) {
    m = between_bodies(ctx, id, q, a.body, b->body);
    if (m) m->bound = bound;  // of those that it knows by their triangles only
  }
  if (!m) {
    RMP_TRY_ASSIGN(m, scene::measure(from, to, ctx.progress));
  }
  out.set("b", feature_map(to));
  out.set("distance", m->distance);
  out.set("bound", m->bound);
  out.set("from", vec_value(m->from, "m"));
  out.set("to", vec_value(m->to, "m"));
  out.set("offset",
          vec_value({m->to[0] - m->from[0], m->to[1] - m->from[1], m->to[2] - m->from[2]}, "m"));
  if (m->angle) out.set("angle", *m->angle);
  if (m->axis_distance) out.set("axis_distance", *m->axis_distance);
  if (m->plane_distance) out.set("plane_distance", *m->plane_distance);
  if (m->centre_distance) out.set("centre_distance", *m->centre_distance);
  return Value(std::move(out));
}

ReturnSpec measured() {
  return {"map",
          "",
          "",
          {field("a", "map", "",
                 "What was found: kind (point, corner, line, circle, curve, plane, cylinder, cone, "
                 "sphere, torus, surface, body, frame), body, point (centre, middle of a line, "
                 "centroid of a plane, a point of an axis) [m], direction (axis, outward normal), "
                 "radius [m], length, start and finish of an edge [m], area of a face [m^2], angle "
                 "of an arc [rad], is_inward (the wall of a hole), is_of_mesh (taken from "
                 "triangles, since no engine knows the shape)."),
           field("b", "map", "", "The same of b."),
           field("distance", "real", "m", "Least distance of the two; 0 where they meet."),
           field("bound", "real", "m",
                 "Greatest error of the distance where a curved face is measured by its triangles; "
                 "0 if it is exact."),
           field("from", "vec3", "m", "The nearest point of a."),
           field("to", "vec3", "m", "The nearest point of b."),
           field("offset", "vec3", "m", "From the one to the other."),
           field("angle", "real", "rad",
                 "Angle between axes, planes, or an axis and a plane, 0 to 90 degrees; of two "
                 "frames the angle of the rotation between them."),
           field("axis_distance", "real", "m",
                 "Distance of the endless axes, or of an axis and a centre."),
           field("plane_distance", "real", "m",
                 "Distance of the endless plane from what is parallel to it, or from a centre."),
           field("centre_distance", "real", "m", "Distance of two centres.")}};
}

}  // namespace

RMP_COMMANDS(measure_commands) {
  const std::string plate =
      "local plate = solid.create{name = \"plate\", root = {kind = \"difference\", children = {\n"
      "  {kind = \"box\", x = 0.2, y = 0.1, z = 0.01},\n"
      "  {kind = \"cylinder\", radius = 0.01, height = 0.03, position = {0, 0, -0.01}}}}}\n";
  const std::string bore_check =
      "local bore = it:measure{a = {as = \"face\", place = {0.01, 0, 0.005}}}.a\n"
      "assert(bore.kind == \"cylinder\" and bore.is_inward)\n"
      "assert(math.abs(bore.radius - 0.01) < 1e-12)\n"
      "local across = it:measure{a = {as = \"face\", place = {0.1, 0, 0.005}},\n"
      "                          b = {as = \"face\", place = {-0.1, 0, 0.005}}}\n"
      "assert(math.abs(across.distance - 0.2) < 1e-12 and across.angle == 0)";
  struct Of {
    const char* kind;
    std::string example;
  };
  const Of kinds[] = {
      {"solid", plate + "local it = plate\n" + bore_check},
      {"object", plate + "local it = object.create{name = \"base\"}\nit:add_part{what = plate}\n" +
                     bore_check},
      {"robot", with_arm("local r = arm:measure{a = {body = \"base\", as = \"frame\"}, b = {as = "
                         "\"tool\"}, q = \"ready\"}\n"
                         "assert(r.centre_distance > 0 and r.distance == r.centre_distance)")},
      {"world",
       plate +
           "local cell = world.create{name = \"cell\"}\n"
           "cell:add_object{name = \"left\", what = plate}\n"
           "cell:add_object{name = \"right\", what = plate, position = {0.5, 0, 0}, rpy = {0, 0, "
           "\"90 deg\"}}\n"
           "local bores = cell:measure{a = {body = \"left\", as = \"face\", place = {0.01, 0, "
           "0.005}},\n"
           "                           b = {body = \"right\", as = \"face\", place = {0.51, 0, "
           "0.005}}}\n"
           "assert(math.abs(bores.axis_distance - 0.5) < 1e-12)\n"
           "local gap = cell:measure{a = {body = \"left\"}, b = {body = \"right\"}}\n"
           "assert(math.abs(gap.distance - 0.35) < 1e-6)"}};
  std::vector<CommandSpec> all;
  for (const Of& of : kinds) {
    const std::string kind = of.kind;
    CommandSpec c;
    c.name = kind + ".measure";
    c.summary = "Measures a body, face, edge, corner or frame, or the distance and angle of two.";
    c.details =
        "Each of a and b is a table: body is a member, link or part (" +
        std::string(kind == "world"   ? "\"table\", \"arm.elbow\", \"arm.base\""
                    : kind == "robot" ? "\"elbow\", \"base\""
                                      : "\"leg.foot\"") +
        "; omitted, all that is shown), as selects what is measured there, and place is the point "
        "near which a face, edge or corner is taken. Without as, a place on a body is a face, a "
        "place alone a point, and a body alone the whole body. frame is that of a member, link or "
        "base, tool that of a robot.";
    c.example = of.example;
    c.params = {self(kind), needed("a", place_type(), "", "What is measured."),
                optional("b", place_type(), "", "What it is measured to.")};
    if (kind == "robot")
      c.params.push_back(
          optional("q", "any", "rad or m", "Joint values or a named pose; home if omitted."));
    if (kind == "world") {
      c.params.push_back(optional("recording", "ref:recording", "",
                                  "Measures where a recording has the members."));
      c.params.push_back(optional("at", "real", "s", "The time within the recording."));
      c.params.push_back(
          optional("run", "ref:run", "", "Measures where a live run has the members now."));
    }
    c.returns = measured();
    c.effect = Effect::reads;
    c.run = measure_in;
    all.push_back(std::move(c));
  }
  return all;
}

}  // namespace robomosp::ioci
