// SPDX-License-Identifier: Apache-2.0
// Trajectories along the edges of a solid: for seams, deburring, sealing.
#include "ioci/trajectory/along_edges.h"

#include <string>
#include <utility>

#include "ioci/core/commands.h"
#include "ioci/records/solid_edges.h"
#include "ioci/trajectory/segments.h"
#include "kernel/check.h"
#include "motion/edge_path.h"

namespace robomosp::ioci {
namespace {

using model::EdgePath;

Result<Value> along_edges(CommandContext& ctx, const Map& args) {
  EdgePath path;
  path.solid = typed<model::Solid>(args, "solid");
  path.is_reversed = flag(args, "reverse");
  if (has(args, "from")) {
    path.from = vec3(args, "from");
    if (path.from == Vec3{})
      return error(ErrorCode::invalid_argument, "from has no direction: its length is 0",
                   "Give the approach direction of the tool, or leave from out.", "from");
  }
  for (const auto& [word, number] : {std::pair<const char*, double*>{"tilt", &path.tilt},
                                     {"lead", &path.lead},
                                     {"stand_off", &path.stand_off},
                                     {"lead_in", &path.lead_in},
                                     {"lead_out", &path.lead_out},
                                     {"approach", &path.approach},
                                     {"retract", &path.retract},
                                     {"speed", &path.speed},
                                     {"travel_speed", &path.travel_speed},
                                     {"acceleration", &path.acceleration},
                                     {"chord", &path.chord}})
    if (has(args, word)) *number = real(args, word);
  RMP_TRY_ASSIGN(const auto all, edges_along(ctx, ctx.snapshot(), path));
  RMP_TRY_ASSIGN(const auto chosen, read_edges(*all, *args.find("edges")->as_list(), "edges"));
  for (const std::size_t e : chosen) path.edges.push_back(static_cast<std::int64_t>(e) + 1);
  model::Trajectory t;
  RMP_TRY_ASSIGN(t.segments, segments_along(ctx, *all, path));
  const std::string name = text_of(args, "name");
  t.description = text_of(args, "description");
  if (has(args, "sample_time")) t.sample_time = real(args, "sample_time");
  RMP_TRY(check_trajectory(ctx, name, t));
  if (flag(args, "follow")) t.along = std::move(path);
  const auto existing = ctx.snapshot().find(Kind::trajectory, name);
  if (!flag(args, "replace") || !existing) {
    RMP_TRY_ASSIGN(const auto made, ctx.edit().add(name, std::move(t)));
    return Value(Application::handle(made));
  }
  // Where it stands in worlds it goes on standing; what is not given stays as it was.
  RMP_TRY(change<model::Trajectory>(ctx, *existing, [&](model::Trajectory& old) -> Result<void> {
    old.segments = std::move(t.segments);
    old.along = std::move(t.along);
    drop_expressions(old, "segments");
    drop_expressions(old, "along");
    if (!t.description.empty()) old.description = std::move(t.description);
    if (has(args, "sample_time")) old.sample_time = t.sample_time;
    return {};
  }));
  return Value(Application::handle(*existing));
}

}  // namespace

Result<std::shared_ptr<const std::vector<CsgEdge>>> edges_along(const CommandContext& ctx,
                                                                const document::Snapshot& records,
                                                                const model::EdgePath& path) {
  const model::Solid* solid = records.get(path.solid);
  RMP_CHECK(solid, "edges of a solid that is not there");
  return ctx.app.derived.edges(records, path.solid, path.chord > 0 ? path.chord : solid->chord,
                               ctx.progress);
}

Result<std::vector<model::TrajectorySegment>> segments_along(const CommandContext& ctx,
                                                             const std::vector<CsgEdge>& all,
                                                             const model::EdgePath& path) {
  RMP_TRY_ASSIGN(const auto pieces, motion::edge_pieces(all, path));
  std::vector<model::TrajectorySegment> out;
  for (const motion::EdgePiece& piece : pieces) {
    List points;
    for (const Pose& t : piece.points) points.push_back(pose_value(t));
    Map table = piece.params;
    table.set("shape", piece.shape);
    table.set("points", std::move(points));
    table.set("orientation", piece.orientation);
    table.set("law", piece.law);
    table.set("transition", "none");
    RMP_TRY_ASSIGN(auto segment, read_segment(ctx, Value(std::move(table)),
                                              "segments[" + std::to_string(out.size() + 1) + "]"));
    out.push_back(std::move(segment));
  }
  return out;
}

void drop_expressions(model::Trajectory& t, std::string_view under) {
  std::erase_if(t.parametric.expressions, [&](const auto& e) {
    return e.first.starts_with(under) &&
           (e.first.size() == under.size() || e.first[under.size()] == '.');
  });
}

RMP_COMMANDS(along_edges_commands) {
  const double most = std::numeric_limits<double>::max();
  const auto length = [&](const char* name, const char* doc) {
    return between(defaulted(name, "real", "m", 0.0, doc), 0, most);
  };
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "trajectory.along_edges",
       .classic = "",
       .summary = "Makes a trajectory that follows edges of a solid, for a seam, a bead or a burr.",
       .details = "In the solid's frame. The tool's x axis points along the path, its z axis into "
                  "the part, midway between the two faces or away from the direction in `from`, "
                  "then rotated by tilt and lead. Lines and arcs are exact, other edges become "
                  "splines through their points. At a corner the tool stops and turns. When the "
                  "solid changes, the segments are made again in the same step of the history. If "
                  "an edge no longer exists then, or if you edit the segments yourself, they stay "
                  "unchanged and a message reports that they no longer follow the solid.",
       .example =
           "local plate = solid.create{name = \"plate\", root = {kind = \"box\", x = 0.2, y = 0.1, "
           "z = 0.01}}\n"
           "local seam = trajectory.along_edges{name = \"seam\", solid = plate,\n"
           "  edges = {{0.1, 0, 0.01}, {0, 0.05, 0.01}}, speed = \"20 mm/s\", acceleration = 1}\n"
           "assert(math.abs(seam:length() - 0.3) < 1e-9)",
       .params =
           {needed("name", "string", "", "Name, unique among trajectories."),
            needed("solid", "ref:solid", "", "The solid with the edges."),
            needed("edges", "list", "",
                   "In order: numbers of solid.edges, or places {x, y, z} [m], each for the edge "
                   "nearest to it."),
            above_zero(needed("speed", "real", "m/s", "Speed along the edges.")),
            defaulted("reverse", "bool", "", false, "Follow the edges in the other direction."),
            optional("from", "vec3", "",
                     "Direction from which the tool comes, in the solid's frame."),
            defaulted("tilt", "real", "rad", 0.0, "Rotation of the tool about the path."),
            defaulted("lead", "real", "rad", 0.0,
                      "Subsequent rotation about the tool's y axis: positive values point its tip "
                      "ahead."),
            length("stand_off",
                   "Distance from the edge, along the tool: so that the wire of a torch or the "
                   "drop of a nozzle does not count as a contact with the part."),
            length("lead_in", "Straight path before the first edge."),
            length("lead_out", "Straight path after the last edge."),
            length("approach", "Path along the tool axis to the first point."),
            length("retract", "Path along the tool axis from the last point."),
            above_zero(optional("travel_speed", "real", "m/s",
                                "Speed of approach and retract; by default speed.")),
            above_zero(optional("acceleration", "real", "m/s^2",
                                "Acceleration at the start and end of the speed profile; by "
                                "default that of the law.")),
            above_zero(
                optional("chord", "real", "m",
                         "For edges that are not lines or arcs: greatest distance of a chord "
                         "between two points from the edge; by default the chord of the solid.")),
            above_zero(optional("sample_time", "real", "s",
                                "Time between samples of a run that sets none.")),
            defaulted(
                "follow", "bool", "", true,
                "Make the segments again when the solid changes; false keeps them unchanged."),
            defaulted("replace", "bool", "", false,
                      "Replace the segments of an existing trajectory with this name: worlds that "
                      "run it then run the new ones."),
            optional("description", "string", "", "Its description.")},
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits,
       .run = along_edges});
  return all;
}

}  // namespace robomosp::ioci
