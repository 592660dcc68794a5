// SPDX-License-Identifier: Apache-2.0
// Commands on single segments of a trajectory: what they are, and how they are changed.
#include <algorithm>

#include "ioci/core/commands.h"
#include "ioci/trajectory/segments.h"
#include "motion/cartesian_path.h"

namespace robomosp::ioci {
namespace {

using model::Trajectory;
using model::TrajectorySegment;

/// The argument `name`, numbered from 1, as an index; `count` are allowed.
Result<std::size_t> index_of(const Map& args, const char* name, std::size_t count) {
  const auto i = integer(args, name);
  if (i >= 1 && i <= static_cast<std::int64_t>(count)) return static_cast<std::size_t>(i - 1);
  return error(
      ErrorCode::invalid_argument, "there is no segment " + std::to_string(i),
      count == 0 ? "It has none." : "Segments are numbered 1 to " + std::to_string(count) + ".",
      name);
}

Result<Value> set_segment(CommandContext& ctx, const Map& args) {
  return change_trajectory(ctx, args, [&](Trajectory& t) -> Result<void> {
    RMP_TRY_ASSIGN(const auto i, index_of(args, "index", t.segments.size()));
    RMP_TRY_ASSIGN(t.segments[i],
                   update_segment(ctx, t.segments[i], *args.find("segment"), "segment"));
    return {};
  });
}

Result<Value> insert_segment(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(auto segment, read_segment(ctx, *args.find("segment"), "segment"));
  return change_trajectory(ctx, args, [&](Trajectory& t) -> Result<void> {
    RMP_TRY_ASSIGN(const auto i, index_of(args, "index", t.segments.size() + 1));
    t.segments.insert(t.segments.begin() + static_cast<std::ptrdiff_t>(i), segment);
    return {};
  });
}

Result<Value> move_segment(CommandContext& ctx, const Map& args) {
  return change_trajectory(ctx, args, [&](Trajectory& t) -> Result<void> {
    RMP_TRY_ASSIGN(const auto from, index_of(args, "index", t.segments.size()));
    RMP_TRY_ASSIGN(const auto to, index_of(args, "to", t.segments.size()));
    const auto at = [&](std::size_t i) {
      return t.segments.begin() + static_cast<std::ptrdiff_t>(i);
    };
    if (from < to) std::rotate(at(from), at(from + 1), at(to + 1));
    else std::rotate(at(to), at(from), at(from + 1));
    return {};
  });
}

Result<Value> set_transition(CommandContext& ctx, const Map& args) {
  return change_trajectory(ctx, args, [&](Trajectory& t) -> Result<void> {
    RMP_TRY_ASSIGN(const auto i, index_of(args, "index", t.segments.size()));
    if (i == 0)
      return error(ErrorCode::invalid_argument, "nothing comes before segment 1",
                   "A transition belongs to the following segment; give 2 or more.", "index");
    model::Transition& transition = t.segments[i].transition;
    transition = {};
    transition.is_smooth = text_of(args, "kind") != "none";
    const bool has_sizes = has(args, "distance") || has(args, "speed");
    if (!transition.is_smooth && has_sizes)
      return error(ErrorCode::invalid_argument, "no transition has a distance or a speed",
                   "Leave them out, or give kind = \"smooth\".");
    if (has(args, "distance")) transition.distance = real(args, "distance");
    if (has(args, "speed")) transition.speed = real(args, "speed");
    return {};
  });
}

/// What one row of the list says of a segment's record.
void add_record(const CommandContext& ctx, const TrajectorySegment& s, Map& row) {
  if (s.stored) {
    row.set("trajectory", ref_value(ctx.snapshot(), AnyId(s.stored)));
    return;
  }
  row.set("shape", s.shape.name);
  if (!s.law.name.empty()) row.set("law", s.law.name);
  if (!s.orientation.name.empty()) row.set("orientation", s.orientation.name);
  if (!s.turning.name.empty()) row.set("turning", s.turning.name);
}

Result<Value> segments(CommandContext& ctx, const Map& args) {
  const Trajectory& t = content<Trajectory>(ctx, args);
  List rows;
  if (std::any_of(t.segments.begin(), t.segments.end(),
                  [&](const TrajectorySegment& s) { return moves_joints(ctx, s); })) {
    // Only a robot determines their times and where the tool is.
    for (std::size_t i = 0; i < t.segments.size(); ++i) {
      Map row{{"number", i + 1},
              {"kind", moves_joints(ctx, t.segments[i]) ? "joint segment" : "segment"}};
      add_record(ctx, t.segments[i], row);
      rows.emplace_back(std::move(row));
    }
    return Value(std::move(rows));
  }
  if (t.segments.empty()) return Value(std::move(rows));
  RMP_TRY_ASSIGN(const auto path, path_of(ctx, args));
  for (const motion::Path::Piece& piece : path->pieces()) {
    Map row{{"number", piece.number},
            {"kind", piece.is_transition ? "transition" : "segment"},
            {"start", piece.start},
            {"duration", piece.segment->duration()},
            {"length", piece.segment->length()}};
    if (!piece.is_transition) add_record(ctx, t.segments[piece.number - 1], row);
    rows.emplace_back(std::move(row));
  }
  return Value(std::move(rows));
}

/// A trajectory of two lines round a corner, then `rest`.
std::string with_corner(const char* rest) {
  return with_stroke(
             "stroke:add_segment({shape = \"line\", points = {{0.5, 0.2, 0.3, 0, 0, 0}, {0.5, 0.2, "
             "0.4, 0, 0, 0}}})\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(trajectory_segment_commands) {
  const ParamSpec index = needed("index", "int", "", "Its number, 1 is the first.");
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "trajectory.set_segment",
       .classic = "",
       .summary = "Changes the given properties of a segment.",
       .details = std::string("A new shape drops the parameters of the old one, and so do another "
                              "law or orientation; the rest is kept. ") +
                  kSegmentDoc,
       .example = with_stroke(
           "stroke:set_segment(1, {speed = \"50 mm/s\"})\nassert(math.abs(stroke:duration() - 4) < "
           "1e-12)\nstroke:set_segment(1, {law = \"quintic\", duration = 3})\n"
           "assert(math.abs(stroke:duration() - 3) < 1e-12)"),
       .params = {self("trajectory"), index, needed("segment", "map", "", "The changes.")},
       .returns = {},
       .effect = Effect::edits,
       .run = set_segment});
  all.push_back(
      {.name = "trajectory.insert_segment",
       .classic = "",
       .summary = "Puts a segment before another one, or at the end.",
       .details = kSegmentDoc,
       .example = with_stroke(
           "stroke:insert_segment(1, {shape = \"line\", points = {{0.5, 0, 0.4, 0, 0, 0}, {0.5, 0, "
           "0.3, 0, 0, 0}}, law = \"quintic\"})\nassert(#stroke:describe().segments == 2)"),
       .params = {self("trajectory"),
                  needed("index", "int", "", "The number that it will have, 1 is the first."),
                  needed("segment", "map", "", "The segment.")},
       .returns = {},
       .effect = Effect::edits,
       .run = insert_segment});
  all.push_back({.name = "trajectory.move_segment",
                 .classic = "",
                 .summary = "Moves a segment to another place in the order.",
                 .details = "Its transition moves with it.",
                 .example = with_corner("stroke:move_segment(1, 2)\n"
                                        "assert(stroke:segments()[1].length < 0.11)"),
                 .params = {self("trajectory"), index,
                            needed("to", "int", "", "The number that it will have.")},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = move_segment});
  all.push_back(
      {.name = "trajectory.set_transition",
       .classic = "",
       .summary = "Sets the transition of a segment from the one before.",
       .details =
           "If the two do not meet in position, orientation or velocity, a smooth piece is "
           "inserted between them, unless transitions are disabled: then a gap is an error and the "
           "velocity may jump. Parameters that are not given are chosen from the neighbours.",
       .example =
           with_corner("stroke:set_transition{index = 2, distance = \"5 mm\"}\n"
                       "assert(stroke:segments()[2].kind == \"transition\")\n"
                       "stroke:set_transition(2, \"none\")\nassert(#stroke:segments() == 2)"),
       .params = {self("trajectory"), needed("index", "int", "", "The segment to which it leads."),
                  choice("kind", {"smooth", "none"}, "Whether there is a transition."),
                  between(optional("distance", "real", "m",
                                   "Distance of the cut from the corner; at most 45 % of a "
                                   "neighbour's time is cut."),
                          0, 1e6),
                  between(optional("speed", "real", "m/s",
                                   "Greatest speed within it; faster neighbours slow down to it."),
                          0, 1e6)},
       .returns = {},
       .effect = Effect::edits,
       .run = set_transition});
  all.push_back(
      {.name = "trajectory.segments",
       .classic = "",
       .summary = "Lists the pieces of a trajectory, including the transitions.",
       .details = "A segment that runs a stored trajectory gives as many rows as that has. With "
                  "segments that move joints there are no times: these depend on a robot.",
       .example = with_corner("local rows = stroke:segments()\n"
                              "assert(#rows == 3 and rows[2].kind == \"transition\")\n"
                              "assert(rows[3].start > rows[2].start and rows[3].number == 2)"),
       .params = {self("trajectory")},
       .returns = {"list",
                   "",
                   "",
                   {field("number", "int", "",
                          "Number of the segment, or of the segment to which a transition leads."),
                    field("kind", "string", "", "segment, transition or joint segment."),
                    field("start", "real", "s", "Time at which it begins."),
                    field("duration", "real", "s", "Time."),
                    field("length", "real", "m", "Length of the tool's path."),
                    field("shape", "string", "", "Shape of the segment."),
                    field("law", "string", "", "Motion law, if one is named."),
                    field("orientation", "string", "", "Orientation, if one is named."),
                    field("turning", "string", "", "Motion law of its rotation, if it has one."),
                    field("trajectory", "string", "", "The stored trajectory that it runs.")}},
       .effect = Effect::reads,
       .run = segments});
  return all;
}

}  // namespace robomosp::ioci
