// SPDX-License-Identifier: Apache-2.0
// Where a robot can work: reachable volume, reachability and manipulability maps, joint slices.
#include <algorithm>
#include <cmath>

#include "ioci/core/commands.h"
#include "ioci/core/watchers.h"
#include "robotics/home.h"
#include "robotics/joint_sampler.h"
#include "robotics/maker_axes.h"
#include "sim/member_axes.h"
#include "sim/workspace_maps.h"

namespace robomosp::ioci {
namespace {

using model::Robot;
using robotics::TwistPart;

/// What the three commands share.
struct Asked {
  std::shared_ptr<const RobotModel> model;
  std::vector<double> q;
  std::size_t tip = 0;
  std::optional<sim::RobotContact> contact;  ///< none = not looked at
};

/// The robot among the objects and the other robots of the world that is given.
Result<std::optional<sim::RobotContact>> contact_in_world(CommandContext& ctx, const Map& args) {
  const AnyId world = ref(args, "world");
  const sim::Simulator simulator{ctx.app.registry, ctx.app.derived, ctx.snapshot()};
  RMP_TRY_ASSIGN(const auto model, ctx.app.collision_models.find(simulator, world, ctx.progress));
  const std::string placed = has(args, "placed") ? text_of(args, "placed") : "";
  std::vector<std::string> known;
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < model->robots().size(); ++i) {
    const collision::CollisionRobot& r = model->robots()[i];
    if (r.record != typed<Robot>(args)) continue;
    known.push_back(r.name);
    if (placed.empty() || placed == r.name) found.push_back(i);
  }
  if (found.size() == 1) return std::optional(sim::RobotContact(model, found.front()));
  if (known.empty())
    return error(ErrorCode::invalid_argument,
                 name_in(ctx, ref(args, "id")) + " is not in " + name_in(ctx, world),
                 "Add it to the world, or name a world that contains it.", "world");
  if (found.empty()) return unknown_name("robot", placed, known);
  return error(ErrorCode::invalid_argument,
               name_in(ctx, ref(args, "id")) + " is in the world as " + text::enumerate(known),
               "Give one of these names as placed.", "placed");
}

Result<Asked> asked(CommandContext& ctx, const Map& args) {
  Asked a;
  RMP_TRY_ASSIGN(a.model, model_of(ctx, args));
  const Robot& robot = content<Robot>(ctx, args);
  a.q = robotics::home_joint_values(robot);
  if (has(args, "q")) {
    RMP_TRY_ASSIGN(a.q, read_q(*args.find("q"), robot, a.model->joints, "q"));
  }
  if (has(args, "tip")) {
    std::vector<std::string> known;
    for (const TipModel& t : a.model->tips) known.push_back(t.name);
    const auto it = std::find(known.begin(), known.end(), text_of(args, "tip"));
    if (it == known.end()) return unknown_name("tip", text_of(args, "tip"), known);
    a.tip = static_cast<std::size_t>(it - known.begin());
  }
  if (has(args, "placed") && !has(args, "world"))
    return error(ErrorCode::invalid_argument,
                 "placed is the robot's name in a world, but no world is given",
                 "Give the world, or leave it out.", "placed");
  if (has(args, "world")) {
    RMP_TRY_ASSIGN(a.contact, contact_in_world(ctx, args));
  } else if (flag(args, "collisions")) {
    const sim::Simulator simulator{ctx.app.registry, ctx.app.derived, ctx.snapshot()};
    RMP_TRY_ASSIGN(const auto model,
                   ctx.app.collision_models.find(simulator, ref(args, "id"), ctx.progress));
    a.contact.emplace(model, 0);
  }
  return a;
}

TwistPart twist_part_of(const Map& args) {
  const std::string part = text_of(args, "part");
  return part == "translation" ? TwistPart::translation
         : part == "rotation"  ? TwistPart::rotation
                               : TwistPart::all;
}

Result<robotics::Workspace> workspace_of(CommandContext& ctx, const Map& args, const Asked& a) {
  robotics::WorkspaceOptions o;
  o.tip = a.tip;
  o.samples = static_cast<std::size_t>(integer(args, "samples"));
  o.voxel = has(args, "voxel") ? real(args, "voxel") : 0;
  o.seed = static_cast<std::uint64_t>(integer(args, "seed"));
  o.part = twist_part_of(args);
  o.length = real(args, "length");
  if (has(args, "lower") != has(args, "upper"))
    return error(ErrorCode::invalid_argument, "a region needs two corners",
                 "Give both lower and upper, or neither.");
  if (has(args, "lower")) o.region = {vec3(args, "lower"), vec3(args, "upper")};
  if (a.contact) o.filter = sim::without_collisions(*a.contact, ctx.progress);
  return robotics::workspace(*a.model, a.q, o, ctx.progress);
}

Handle kept(CommandContext& ctx, recording::Recording recording) {
  return {"recording", ctx.app.recordings.add(
                           std::make_shared<const recording::Recording>(std::move(recording)))};
}

/// Size, error and growth as a sentence, since either number alone misleads.
std::string reading_of(const robotics::Workspace& w) {
  if (w.dimension == 0) return "The tip stays at one place.";
  const char* unit = w.dimension == 3 ? "m^3" : w.dimension == 2 ? "m^2" : "m";
  const auto percent = text::print_rounded(100 * w.growth(), 2);
  return text::print_rounded(w.all.size, 4) + " +- " + text::print_rounded(w.all.error, 2) + " " +
         unit + "; the second half of the samples added " + percent +
         (w.is_settled() ? " %; use smaller voxels for more detail."
                         : " %: places are still missing and the true size is greater. Take more "
                           "samples or greater voxels.");
}

Map size_map(const robotics::Workspace& w) {
  const std::string_view what = w.dimension == 3 ? "volume" : w.dimension == 2 ? "area" : "length";
  Map out{{"dimension", w.dimension},  {"what", what},
          {"size", w.all.size},        {"error", w.all.error},
          {"half_size", w.half.size},  {"growth", w.growth()},
          {"settled", w.is_settled()}, {"reading", reading_of(w)},
          {"voxels", w.all.voxels},    {"surface", w.all.surface},
          {"voxel", w.grid.size},      {"counted", w.counted}};
  out.set("lower", vec_value(w.lower, "m"));
  out.set("upper", vec_value(w.upper, "m"));
  return out;
}

/// Runs a command whose errors speak of joints, with the maker's axes in them.
template <Result<Value> (*command)(CommandContext&, const Map&)>
Result<Value> with_axes(CommandContext& ctx, const Map& args) {
  auto done = command(ctx, args);
  if (done.ok()) return done;
  const auto axes = robotics::MakerAxes::for_messages(&content<Robot>(ctx, args));
  const auto model = model_of(ctx, args);
  return model.ok() ? axes->in_error(**model, std::move(done).error()) : std::move(done).error();
}

Result<Value> workspace(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Asked a, asked(ctx, args));
  RMP_TRY_ASSIGN(const auto w, workspace_of(ctx, args, a));
  Map out = size_map(w);
  out.set("recording", kept(ctx, sim::workspace_recording(*a.model, w)));
  return Value(std::move(out));
}

Result<Value> reachability(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Asked a, asked(ctx, args));
  RMP_TRY_ASSIGN(const auto w, workspace_of(ctx, args, a));
  model::ProviderChoice choice = content<Robot>(ctx, args).ik;
  sim::ReachOptions o;
  o.rolls = static_cast<std::size_t>(integer(args, "rolls"));
  if (has(args, "provider")) {
    RMP_TRY_ASSIGN(choice, read_provider(*args.find("provider"), "provider"));
  } else if (o.rolls == 0) {
    choice = {};
    choice.name = "numeric";
  }
  RMP_TRY_ASSIGN(const auto ik, ctx.app.solvers.ik(ctx.app.registry, a.model, choice));
  o.tip = static_cast<std::int32_t>(a.tip);
  o.directions = static_cast<std::size_t>(integer(args, "directions"));
  o.tolerance = {real(args, "position_tolerance"), real(args, "rotation_tolerance")};
  o.collision = a.contact ? &*a.contact : nullptr;
  std::vector<Vec3> points;
  for (std::size_t v = 0; v < w.hits.size(); ++v)
    if (w.hits[v]) points.push_back(w.places.empty() ? w.grid.centre(v) : w.places[v]);
  RMP_TRY_ASSIGN(const auto share,
                 sim::reachability(ctx.app.registry, ik, points, o, ctx.progress));
  recording::Recording r = sim::workspace_recording(*a.model, w);
  r.title = a.model->name + ": reachability";
  r.columns.insert(r.columns.begin() + 3,
                   {"share", "", "of the tool's directions that can be had", share});
  double sum = 0;
  std::size_t dexterous = 0, none = 0;
  for (const double s : share) {
    sum += s;
    dexterous += s > 1 - 1e-9;
    none += s < 1e-9;
  }
  const auto count = static_cast<double>(share.size());
  Map out = size_map(w);
  out.set("mean_share", Value(sum / count));
  out.set("dexterous", Value(static_cast<double>(dexterous) / count));
  out.set("unreached", Value(static_cast<double>(none) / count));
  out.set("provider", ik.provider);
  out.set("recording", kept(ctx, std::move(r)));
  return Value(std::move(out));
}

Result<robotics::SliceAxis> read_axis(const RobotModel& m, const Map& args, const std::string& name,
                                      const std::string& range, std::size_t count) {
  const auto number = integer(args, name);
  for (std::size_t j = 0; j < m.joints.size(); ++j) {
    const JointModel& joint = m.joints[j];
    if (joint.is_coupled() || joint.q_index != number - 1) continue;
    if (coordinate_count(joint.type) != 1) break;
    robotics::JointRange limits = robotics::joint_range(m, j);
    const std::vector<double> given = reals(args, range);
    if (!given.empty()) {
      if (given.size() != 2 || !(given[0] < given[1]))
        return error(ErrorCode::invalid_argument,
                     "a range must be two numbers, the smaller one first",
                     "Give one such as {-1, 1}.", range);
      limits = {given[0], given[1]};
    }
    if (!std::isfinite(limits.lower) || !std::isfinite(limits.upper)) {
      if (joint.type == JointType::prismatic)
        return error(ErrorCode::invalid_argument,
                     "joint " + text::quote(joint.name) + " has no limits", "Give its range.",
                     range);
      limits = {-3.14159265358979323846, 3.14159265358979323846};
    }
    return robotics::SliceAxis{j, limits.lower, limits.upper, count};
  }
  return error(ErrorCode::invalid_argument,
               "coordinate " + std::to_string(number) + " is not a joint of one coordinate",
               "Give the number of a revolute or prismatic joint in q.", name);
}

Result<Value> joint_slice(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Asked a, asked(ctx, args));
  robotics::SliceOptions o;
  o.tip = a.tip;
  o.part = twist_part_of(args);
  o.length = real(args, "length");
  const auto count = static_cast<std::size_t>(integer(args, "count"));
  RMP_TRY_ASSIGN(o.axes[0], read_axis(*a.model, args, "a", "a_range", count));
  RMP_TRY_ASSIGN(o.axes[1], read_axis(*a.model, args, "b", "b_range", count));
  if (o.axes[0].joint == o.axes[1].joint)
    return error(ErrorCode::invalid_argument, "both joints are the same", "Give two joints.", "b");
  if (a.contact) o.filter = sim::without_collisions(*a.contact, ctx.progress);
  RMP_TRY_ASSIGN(const auto slice, robotics::joint_slice(*a.model, a.q, o, ctx.progress));
  std::vector<double> curve;
  for (const auto& x : slice.curve) curve.insert(curve.end(), x.begin(), x.end());
  double best = 0;
  for (const auto& n : slice.nodes) best = std::max(best, n.manipulability);
  Map out{{"rank", slice.rank}, {"best", best}, {"singular", slice.curve.size()}};
  out.set("curve", slice.curve.empty()
                       ? Value(List{})
                       : Value(NumericArray(std::move(curve), slice.curve.size(), 2)));
  out.set("collisions", Value(static_cast<std::int64_t>(std::count(
                            slice.collides.begin(), slice.collides.end(), std::uint8_t{1}))));
  recording::Recording r = sim::slice_recording(*a.model, o, slice);
  sim::name_axes(r, *a.model, *robotics::MakerAxes::for_messages(&content<Robot>(ctx, args)));
  out.set("recording", kept(ctx, std::move(r)));
  return Value(std::move(out));
}

Schema shared_params(Schema first) {
  first.push_back(
      optional("q", "any", "rad or m",
               "Values of the joints that are not moved, or a named pose; home if omitted."));
  first.push_back(optional("tip", "string", "", "Name of the tip; the first if omitted."));
  first.push_back(choice("part", {"all", "translation", "rotation"},
                         "Part of the velocity for the manipulability."));
  first.push_back(
      above_zero(defaulted("length", "real", "m", 1.0, "Length that divides linear velocities.")));
  first.push_back(
      defaulted("collisions", "bool", "", false,
                "Leaves out (in slices: marks) configurations in which the robot touches itself."));
  first.push_back(
      optional("world", "ref:world", "",
               "Also leaves out (marks) configurations in which the robot touches its surroundings "
               "in this world; other robots are at the joint values shown."));
  first.push_back(optional("placed", "string", "",
                           "The robot's name in the world, if it is there several times."));
  return first;
}

Schema space_params(std::int64_t samples) {
  Schema s = shared_params({self("robot")});
  s.push_back(between(defaulted("samples", "int", "", samples, "Configurations."), 16, 1e7));
  s.push_back(above_zero(
      optional("voxel", "real", "m", "Edge length of a voxel; 1/40 of the extent if omitted.")));
  s.push_back(between(defaulted("seed", "int", "", 1, "Seed of the samples."), 0, 1e15));
  s.push_back(optional("lower", "vec3", "m", "Least corner of the region considered."));
  s.push_back(optional("upper", "vec3", "m", "Greatest corner of the region considered."));
  return s;
}

std::vector<ParamSpec> size_fields() {
  return {field("dimension", "int", "",
                "3, or 2 if the tip stays in a plane, 1 if it stays on a line or there is a single "
                "joint."),
          field("what", "string", "", "volume, area or length."),
          field("size", "real", "", "Size of the reached region [m^3, m^2 or m]."),
          field("error", "real", "",
                "Error of the size, in the same unit: half of the voxels on the surface; for a "
                "single joint that of the ends of its curve."),
          field("half_size", "real", "", "The size after half of the samples."),
          field("growth", "real", "", "Growth by the second half of the samples, over the size."),
          field("settled", "bool", "", "Whether that growth is less than the error and than 5 %."),
          field("reading", "string", "", "Size, error and growth in a sentence."),
          field("voxels", "int", "", "Number of reached voxels."),
          field("surface", "int", "", "Number of them on the surface."),
          field("voxel", "real", "m", "Edge length of a voxel."),
          field("counted", "int", "", "Samples within the region and free of collisions."),
          field("lower", "vec3", "m", "Least corner of the box around the reached points."),
          field("upper", "vec3", "m", "Greatest corner of it."),
          field("recording", "handle", "", "The voxels, one row each.")};
}

}  // namespace

RMP_COMMANDS(workspace_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "robot.workspace",
       .classic = "",
       .summary =
           "Samples the workspace of the tool: volume with its error, voxels, manipulability.",
       .details = "Joints without limits make one full turn. The recording has x, y, z (mounting "
                  "frame), samples, surface, manipulability and mean_manipulability of each voxel.",
       .example = "local arm = robot.get(\"twolink\")\nlocal w = arm:workspace{samples = 4000}\n"
                  "assert(w.what == \"area\" and #w.recording:values(\"x\") == w.voxels)",
       .params = with_watch(space_params(2000000)),
       .returns = {"map", "", "", size_fields()},
       .effect = Effect::simulates,
       .run = with_axes<workspace>});
  Schema reach = space_params(50000);
  reach.push_back(between(
      defaulted("directions", "int", "", 32,
                "Number of directions of the tool's z axis, evenly distributed over the sphere."),
      1, 10000));
  reach.push_back(between(defaulted("rolls", "int", "", 4,
                                    "Number of rotations about the tool's z axis tried for each "
                                    "direction; 0 = the rotation is free."),
                          0, 360));
  reach.push_back(optional("provider", "any", "", "Solver; by default the robot's own."));
  reach.push_back(above_zero(
      defaulted("position_tolerance", "real", "m", 1e-6, "Tolerance for reaching a pose.")));
  reach.push_back(above_zero(
      defaulted("rotation_tolerance", "real", "rad", 1e-6, "Tolerance for reaching a pose.")));
  std::vector<ParamSpec> reach_fields = size_fields();
  for (ParamSpec& p : std::vector<ParamSpec>{
           field("mean_share", "real", "", "Mean share of the directions over the voxels."),
           field("dexterous", "real", "", "Share of the voxels with all directions."),
           field("unreached", "real", "", "Share of the voxels with no direction."),
           field("provider", "string", "", "The solver.")})
    reach_fields.push_back(std::move(p));
  all.push_back(
      {.name = "robot.reachability",
       .classic = "",
       .summary = "Maps the number of possible tool directions at each place.",
       .details = "The voxels of robot.workspace, with the column share: the share of the "
                  "directions that inverse kinematics reaches at the centre of the voxel.",
       .example = "local arm = robot \"puma560\"\n"
                  "local m = arm:reachability{samples = 2000, voxel = 0.3, directions = 8}\n"
                  "assert(m.mean_share > 0 and m.mean_share < 1)",
       .params = with_watch(std::move(reach)),
       .returns = {"map", "", "", std::move(reach_fields)},
       .effect = Effect::simulates,
       .run = with_axes<reachability>});
  Schema slice{self("robot"),
               between(defaulted("a", "int", "", 1, "First joint, by its place in q."), 1, 1e6),
               between(defaulted("b", "int", "", 2, "Second joint, by its place in q."), 1, 1e6)};
  slice = shared_params(std::move(slice));
  slice.push_back(
      optional("a_range", "real[]", "", "Range from and to; the joint limits if omitted."));
  slice.push_back(
      optional("b_range", "real[]", "", "Range from and to; the joint limits if omitted."));
  slice.push_back(
      between(defaulted("count", "int", "", 61, "Number of nodes along each axis."), 2, 2000));
  all.push_back(
      {.name = "robot.joint_slice",
       .classic = "",
       .summary = "Maps the Jacobian over two joints and finds its singular curves.",
       .details = "The recording has both joints, manipulability, condition, least, collision and "
                  "singular of each node.",
       .example = "local arm = robot.get(\"twolink\")\n"
                  "local s = arm:joint_slice{part = \"translation\", count = 20}\n"
                  "assert(#s.recording:values(\"manipulability\") == 400 and s.rank == 2)",
       .params = with_watch(std::move(slice)),
       .returns = {"map",
                   "",
                   "",
                   {field("rank", "int", "", "Greatest rank of the Jacobian's part."),
                    field("best", "real", "", "Greatest manipulability."),
                    field("singular", "int", "", "Number of points of singular curves."),
                    field("curve", "array", "", "Those points, one per row."),
                    field("collisions", "int", "", "Nodes in which the robot touches something."),
                    field("recording", "handle", "", "The nodes, one row each.")}},
       .effect = Effect::simulates,
       .run = with_axes<joint_slice>});
  return all;
}

}  // namespace robomosp::ioci
