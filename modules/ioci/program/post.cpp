// SPDX-License-Identifier: Apache-2.0
// Programs to the languages of controllers, by providers of robomosp.post/1.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include <robomosp/sdk/post_writer.h>

#include "io/native.h"
#include "ioci/core/watchers.h"
#include "ioci/program/compiled.h"
#include "ioci/program/in_world.h"
#include "ioci/program/packs.h"
#include "ioci/program/post_cell.h"
#include "ioci/program/post_kinematics.h"
#include "ioci/program/post_output.h"
#include "ioci/program/post_profile.h"
#include "ioci/program/program_faults.h"
#include "ioci/program/program_files.h"
#include "ioci/program/read_back.h"
#include "ioci/robot/robots.h"
#include "kernel/file_root.h"
#include "model/controller.h"
#include "model/declare.h"
#include "model/program_kinds.h"
#include "motion/provider_params.h"
#include "program/flatten.h"
#include "program/trace.h"
#include "program_post/carriage.h"
#include "program_post/legalise.h"
#include "program_post/part_of_robot.h"
#include "program_post/points.h"
#include "program_source/source_text.h"
#include "robotics/kinematics.h"
#include "sim/ik_choice.h"

namespace robomosp::ioci {
namespace {

using model::Controller;
/// The tag of targets whose controllers move several robots, by programs that share variables.
constexpr const char* kSeveralRobots = "several_robots";

struct Asked {
  ProviderInfo info;
  std::shared_ptr<Post> post;
  std::unique_ptr<Params> params;
  std::unique_ptr<ControllerProfile> profile = std::make_unique<ControllerProfile>();
  std::unique_ptr<HostKinematics> kinematics;
  PostCell cell;
  std::string name;
  /// Of motions without TOOL.
  [[nodiscard]] Pose default_tool() const {
    if (cell.places.tool) return *cell.places.tool;
    const PostProfile& p = profile->view;
    return p.tool < 0 ? Pose{} : p.tools[static_cast<std::size_t>(p.tool)].pose;
  }
  std::vector<std::string> contradictions;  ///< of the profile to the robot
  /// What the controller does with additional joints of the world, and whether they are written.
  program_post::RailKind rail = program_post::RailKind::none;
  [[nodiscard]] bool carries() const {
    return cell.carrier && (cell.carrier->rail > 0 || rail != program_post::RailKind::none);
  }
};

/// A name that is an identifier.
std::string plain(std::string_view name) {
  std::string out;
  for (const char c : name)
    out += (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ? c : '_';
  return out.empty() ? "program" : out;
}

/// An option of the profile that is a number, `otherwise` where it has none.
template <class T>
Result<T> option_of(const PostProfile& profile, std::string_view name, T otherwise, T least, T most,
                    const char* hint) {
  for (const PostOption& o : profile.options) {
    if (o.name != name) continue;
    T v{};
    const auto r = std::from_chars(o.value.data(), o.value.data() + o.value.size(), v);
    if (r.ec == std::errc() && r.ptr == o.value.data() + o.value.size() && v >= least && v <= most)
      return v;
    return error(ErrorCode::invalid_argument,
                 "the option " + std::string(name) + " is " + text::quote(o.value) +
                     ", which is not from " + text::print_rounded(static_cast<double>(least)) +
                     " to " + text::print_rounded(static_cast<double>(most)),
                 hint, "controller " + text::quote(profile.name));
  }
  return otherwise;
}

/// The controller's record that the argument profile names, with its name; empty = none is given.
std::pair<std::string, Controller> given_profile(CommandContext& ctx, const Map& args) {
  if (!has(args, "profile")) return {};
  const model::Record* r = ctx.snapshot().find(ref(args, "profile"));
  return {r->name, std::get<model::OtherContent>(r->body).as<Controller>()};
}

/// Takes the additional joints of the world out of points, where the target has none and they stay.
void hide_rail(const program_post::Carrier& carrier, program_post::KnownPoints& points) {
  for (PostPoint& p : points.points) {
    if (p.external.empty()) continue;
    std::vector<double> left(p.external.begin(), p.external.end());
    for (const program_post::CarriedAxis& a : carrier.axes)
      if (a.number <= left.size()) left[a.number - 1] = 0;
    const bool is_empty = std::all_of(left.begin(), left.end(), [](double v) { return v == 0; });
    p.external = {};
    if (!is_empty) p.external = points.numbers.emplace_back(std::move(left));
  }
}

/// Writes it as one program, or as about so many parts besides; gives how many there are, and
/// whether a limit of the controller is passed.
struct Written {
  std::size_t parts = 0;
  double over = 0;  ///< the greatest share of a limit that it takes
};
Result<Written> write_in_parts(CommandContext& ctx, const Asked& asked, const rmp_code& as_written,
                               std::uint32_t form, std::size_t parts, Posted& out) {
  const PostCapabilities& caps = asked.post->capabilities();
  out.is_flat = form == kPostFlat;
  out.has_robot = asked.cell.robot != nullptr;
  std::optional<program_post::Carrier> carrier;
  if (asked.carries()) carrier = asked.cell.carrier;
  const auto known = [&](const rmp_code& of) {
    auto found = program_post::known_points(
        of, asked.cell.robot.get(), asked.kinematics.get(), asked.cell.start, asked.default_tool(),
        asked.profile->view.axes, carrier ? &*carrier : nullptr);
    if (carrier && asked.rail == program_post::RailKind::none) hide_rail(*carrier, found);
    return found;
  };
  auto placed = program_post::in_cell(as_written, asked.cell.places);
  if (carrier && carrier->rail > 0) {
    const rmp_code& whole = placed ? placed->code() : as_written;
    std::vector<program_post::Remark> remarks;
    auto carried = program_post::for_rail(whole, *carrier, known(whole), asked.rail, caps, remarks);
    for (const auto& r : remarks) out.fault(r.severity, r.span, r.message, r.hint);
    carrier->is_on_carriage = asked.rail != program_post::RailKind::base;
    placed = std::move(carried);
  }
  const rmp_code& code = placed ? placed->code() : as_written;
  program_post::LegaliseOptions options;
  program_post::KnownPoints before;
  if (program_post::wants_points(code, caps)) {
    before = known(code);
    options.points = before.points;
    RMP_TRY_ASSIGN(options.chord_mm,
                   option_of(asked.profile->view, "chord_mm", options.chord_mm, 1e-4, 1e3,
                             "Give the distance that straight pieces may be from an arc, in mm."));
  }
  RMP_TRY_ASSIGN(
      options.recursion_depth,
      option_of(
          asked.profile->view, "recursion_depth", options.recursion_depth, std::size_t{1},
          std::size_t{9999},
          "Give how many calls of a routine that calls itself are within each other at most."));
  options.parts = parts;
  options.name = asked.name;
  program_post::Legal legal = program_post::legalise(code, caps, options);
  for (const auto& r : legal.remarks) out.fault(r.severity, r.span, r.message, r.hint);
  const auto points = known(legal.tables->code());
  for (const auto& r : points.remarks) out.fault(r.severity, r.span, r.message, r.hint);
  for (const std::string& message : asked.contradictions)
    out.fault(RMP_FAULT_WARNING, row<rmp_code_routine>(code.routines, 0).span, message,
              "Remove sign, offset and joint from the profile's axis, or correct the robot's axes "
              "(robot.set_axes).");
  PostTask task;
  task.code = &legal.tables->code();
  task.form = form;
  task.name = asked.name;
  task.points = points.points;
  task.robot = asked.cell.robot.get();
  task.kinematics = asked.kinematics.get();
  task.profile = &asked.profile->view;
  const auto axes = task.profile->axes;
  // Without a robot the joints of a controller's program stay what they are.
  const bool are_makers = counts_maker_axes(code) && !asked.cell.robot;
  task.axes_are_unknown =
      !are_makers && std::none_of(axes.begin(), axes.end(), [](const PostAxis& a) {
        return is_of_robot(a) && a.origin != PostAxisOrigin::not_known;
      });
  RMP_TRY(asked.post->write(task, *asked.params, out, ctx.progress));
  Written written;
  written.parts = legal.parts;
  const auto over = [&](std::int64_t most, std::int64_t is, const char* what,
                        const std::string& file) {
    if (most > 0)
      written.over = std::max(written.over, static_cast<double>(is) / static_cast<double>(most));
    if (most > 0 && is > most)
      out.faults.push_back({RMP_FAULT_ERROR, row<rmp_code_routine>(code.routines, 0).span,
                            "the file " + file + " has " + std::to_string(is) + " " + what +
                                ", and the controller takes " + std::to_string(most),
                            "Split the program, or raise the limit in the controller's record."});
  };
  const auto& profile = asked.profile->view;
  for (const auto& [name, bytes] : out.files) {
    over(profile.max_bytes, static_cast<std::int64_t>(bytes.size()), "bytes", name);
    over(profile.max_lines > 0 ? profile.max_lines : caps.max_lines,
         std::count(bytes.begin(), bytes.end(), '\n'), "lines", name);
  }
  // Each file has the points of its own motions.
  std::vector<std::int64_t> points_used(1, 0);
  if (written.parts == 0) {
    for (const PostPoint& p : points.points) points_used[0] += p.motion != RMP_NONE;
  } else {
    const rmp_code& c = *task.code;
    points_used.assign(c.routines.count, 0);
    for (std::uint32_t r = 0; r < c.routines.count; ++r)
      for (std::uint32_t s = row<rmp_code_routine>(c.routines, r).body; s != RMP_NONE;
           s = row<rmp_code_statement>(c.statements, s).next)
        if (const auto m = row<rmp_code_statement>(c.statements, s).motion; m != RMP_NONE)
          points_used[r] += row<rmp_code_motion>(c.motions, m).target_count;
  }
  over(profile.max_points > 0 ? profile.max_points : caps.max_points,
       *std::max_element(points_used.begin(), points_used.end()), "points",
       out.files.empty() ? std::string("written") : out.files.front().first);
  out.form = form == kPostFlat ? "flat" : "structured";
  return written;
}

/// The program in one file, or, where it is too long for one and the target has such, in several.
Result<void> write_one(CommandContext& ctx, const Asked& asked, const rmp_code& code,
                       std::uint32_t form, Posted& out) {
  RMP_TRY_ASSIGN(const Written whole, write_in_parts(ctx, asked, code, form, 0, out));
  if (form != kPostFlat || whole.over <= 1 || out.errors() == 0 ||
      (asked.post->capabilities().features & kPostParts) == 0)
    return {};
  // Parts are of about equally many statements, not lines: more where one is still too long.
  auto count = static_cast<std::size_t>(std::ceil(std::min(whole.over, 1e6) * 1.05)) + 1;
  for (int tries = 0; tries < 5; ++tries) {
    Posted divided;
    RMP_TRY_ASSIGN(const Written w, write_in_parts(ctx, asked, code, form, count, divided));
    if (w.parts < 2) return {};
    if (divided.errors() == 0) {
      divided.faults.push_back(
          {RMP_FAULT_NOTE, row<rmp_code_routine>(code.routines, 0).span,
           "the program is too long for one file there, and is posted as " +
               std::to_string(w.parts) + " programs that " + asked.name + " calls",
           "The limits are in the controller's record (max_lines, max_points, max_bytes)."});
      out = std::move(divided);
      return {};
    }
    if (w.over <= 1) return {};
    count = count + std::max<std::size_t>(
                        1, static_cast<std::size_t>(static_cast<double>(count) * (w.over - 1)));
  }
  return {};
}

/// What of the profile a run in the world contradicts: the world counts.
void settle_places(Asked& asked, const rmp_code& code) {
  const PostProfile& p = asked.profile->view;
  const auto settle = [&](std::optional<Pose>& place, std::int32_t number,
                          std::span<const PostPlace> all, const char* what) {
    if (number < 0) return;
    const PostPlace& begins = all[static_cast<std::size_t>(number)];
    if (!place) place = Pose{};
    if (post::same_place(begins.pose, *place)) return;
    asked.cell.remarks.push_back(
        {RMP_FAULT_WARNING, row<rmp_code_routine>(code.routines, 0).span,
         "the " + std::string(what) + " " + text::quote(begins.name) +
             " that the profile begins with is not that of the run, which is written",
         "Give the profile the " + std::string(what) +
             " of the world, or the world that of the "
             "controller."});
  };
  if (asked.cell.is_placed || asked.cell.places.tool)
    settle(asked.cell.places.tool, p.tool, p.tools, "tool");
  if (asked.cell.is_placed) settle(asked.cell.places.frame, p.frame, p.frames, "frame");
}

/// What the controller does with the rail of a robot: by its target, or as the profile says.
Result<void> settle_rail(Asked& asked, const rmp_code& code) {
  using program_post::RailKind;
  if (!asked.cell.carrier) return {};
  RMP_TRY_ASSIGN(asked.rail,
                 rail_kind(asked.info, asked.post->capabilities(), asked.profile->view));
  if (!asked.cell.is_on_rail()) return {};
  const program_post::Carrier& c = *asked.cell.carrier;
  std::string what;
  for (const program_post::CarriedAxis& a : c.axes)
    if (a.rail >= 0)
      what += (what.empty() ? "" : ", ") + ("additional joint " + std::to_string(a.number)) + " (" +
              a.name + ")";
  const rmp_span head = row<rmp_code_routine>(code.routines, 0).span;
  if (asked.rail == RailKind::base)
    asked.cell.remarks.push_back(
        {RMP_FAULT_NOTE, head,
         "the robot is carried by " + what +
             ": targets are measured from the fixed base of the rail, and the controller has to "
             "know that these axes carry the robot",
         "The profile's option rail = carriage writes targets measured from the carriage."});
  else
    asked.cell.remarks.push_back(
        {RMP_FAULT_NOTE, head,
         "the robot is carried by " + what +
             ": targets are measured from the carriage, since the controller does not know what "
             "carries its robot",
         asked.rail == RailKind::none
             ? std::string("The rail stays where it is at the start.")
             : std::string("The profile's option rail = base writes them from the fixed base.")});
  return {};
}

Result<Asked> read_asked(CommandContext& ctx, const Map& args, const Compiled& made) {
  const rmp_code& code = made.code();
  Asked out;
  std::tie(out.profile->name, out.profile->record) = given_profile(ctx, args);
  std::string target = text_of(args, "target");
  if (target.empty()) target = out.profile->record.target;
  if (target.empty())
    return error(ErrorCode::invalid_argument, "no target is given",
                 "Give target = \"krl\" or a profile; program.targets lists them.", "target");
  if (has(args, "profile") && !out.profile->record.target.empty() &&
      out.profile->record.target != target)
    return error(ErrorCode::invalid_argument,
                 "controller " + text::quote(out.profile->name) + " is of the target " +
                     text::quote(out.profile->record.target) + ", not " + text::quote(target),
                 "Give the profile without a target.", "target");
  RMP_TRY(out.profile->fill());
  RMP_TRY_ASSIGN(out.info, ctx.app.registry.find(Post::kInterfaceId, target));
  RMP_TRY_ASSIGN(auto post, ctx.app.registry.create<Post>(out.info.name));
  out.post = std::shared_ptr<Post>(std::move(post));
  model::ProviderChoice choice;
  choice.name = out.info.name;
  if (const Value* given = args.find("params"); given && given->as_map()) {
    RMP_TRY_ASSIGN(
        choice, read_provider(Value(Map{{"name", out.info.name}, {"params", *given}}), "params"));
  }
  RMP_TRY_ASSIGN(out.params,
                 motion::checked_params(out.info, choice, "target " + text::quote(out.info.name)));
  std::string symbol = text_of(args, "only_robot");
  if (const auto moved = program_post::robots_that_move(code); symbol.empty() && moved.size() == 1)
    symbol = moved.front();
  RMP_TRY_ASSIGN(out.cell, post_cell(ctx, args, made.program, symbol));
  settle_places(out, code);
  RMP_TRY(settle_rail(out, code));
  if (out.cell.robot) {
    RMP_TRY_ASSIGN(auto bound, ctx.app.solvers.ik(ctx.app.registry, out.cell.robot, out.cell.ik));
    out.kinematics =
        std::make_unique<HostKinematics>(out.cell.robot, std::move(bound), ctx.progress);
    RMP_TRY_ASSIGN(out.contradictions,
                   out.profile->use(std::move(out.cell.maker), out.cell.robot_name, out.cell.rail));
  }
  if (out.carries() && out.rail != program_post::RailKind::none) carry_axes(*out.profile, out.cell);
  out.name = text_of(args, "name");
  if (out.name.empty()) out.name = out.profile->record.program;
  if (out.name.empty()) {
    out.name = plain(code.name);
    // Parts of one program may lie in one folder.
    if (has(args, "only_robot")) out.name += "_" + plain(text_of(args, "only_robot"));
  }
  return out;
}

/// The part of a program for the controller of one robot.
Result<program_post::Part> part_of(CommandContext& ctx, const Map& args, const Compiled& made,
                                   const std::string& robot, bool keeps_lines, bool shares) {
  program_post::PartTask task;
  const auto [name, record] = given_profile(ctx, args);
  std::vector<program_post::Line> lines;
  for (const auto& s : record.signals) lines.push_back({s.name, s.number, !s.kind.empty()});
  task.code = &made.code();
  task.text = made.texts.front();
  task.robot = robot;
  task.controller = name;
  task.lines = lines;
  task.keeps_lines = keeps_lines;
  task.shares = shares;
  return program_post::part_of_robot(task);
}

Fault posted_fault(const FaultyText& in, const rmp_code& code, const PostedFault& f) {
  const bool is_error = f.severity == RMP_FAULT_ERROR;
  return text_fault(
      is_error ? "program.not_posted" : "program.posted_otherwise", in,
      {f.severity, f.span,
       f.span.file < code.files.count ? row<rmp_code_file>(code.files, f.span.file).name : "",
       f.message, f.hint});
}

/// The source of a checked `id`, as a post sees it.
FaultyText posted_text(const CommandContext& ctx, const Map& args, std::string target = {}) {
  const AnyId id = ref(args, "id");
  return {id,
          &program_of(ctx, args),
          name_in(ctx, id),
          std::move(target),
          Post::kInterfaceId,
          ctx.snapshot().find(id)->name};
}

/// `e` with the errors of a post as its faults.
Error with_posted(Error e, const FaultyText& in, const rmp_code& code, const Posted& out,
                  const std::vector<FaultRemedy>& remedies = {}) {
  std::vector<Fault> faults;
  for (const PostedFault& f : out.faults)
    if (f.severity == RMP_FAULT_ERROR) faults.push_back(posted_fault(in, code, f));
  for (Fault& f : faults) f.remedies.insert(f.remedies.end(), remedies.begin(), remedies.end());
  return with_faults(std::move(e), faults);
}

List fault_list(const FaultyText& in, const rmp_code& code, const Posted& out) {
  static constexpr const char* kWords[] = {"error", "warning", "note"};
  List all;
  for (const PostedFault& f : out.faults)
    all.emplace_back(Map{
        {"severity", kWords[std::min<std::uint32_t>(f.severity, 2)]},
        {"file",
         f.span.file < code.files.count ? row<rmp_code_file>(code.files, f.span.file).name : ""},
        {"line", static_cast<std::int64_t>(f.span.line)},
        {"column", static_cast<std::int64_t>(f.span.column)},
        {"message", f.message + "."},
        {"hint", f.hint},
        {"fault", fault_map(posted_fault(in, code, f))}});
  return all;
}

/// The program as what it does in a run without a world.
Result<std::shared_ptr<const CompiledProgram>> flatten_it(CommandContext& ctx, const Map& args,
                                                          const Compiled& made) {
  program::TraceOptions options;
  if (const Value* given = args.find("inputs"); given && given->as_map())
    for (const auto& [name, value] : *given->as_map()) {
      const double* number = value.as_real();
      const auto* whole = value.as_int();
      const bool* is_on = value.as_bool();
      if (!number && !whole && !is_on)
        return error(ErrorCode::invalid_argument,
                     "the value of input " + text::quote(name) +
                         " is neither a number nor true or " + "false",
                     "Such as inputs = {part_here = true}.", "inputs");
      program::SignalValue v;
      if (number) v = {std::llround(*number), *number};
      if (whole) v = {*whole, static_cast<double>(*whole)};
      if (is_on) v = {*is_on ? 1 : 0, *is_on ? 1.0 : 0.0};
      if (number && !(std::fabs(*number) < 1e9))
        return error(ErrorCode::invalid_argument,
                     "the value of input " + text::quote(name) + " is beyond 1e9", {}, "inputs");
      options.inputs[name] = v;
    }
  if (has(args, "most_steps"))
    options.most_instructions = static_cast<std::uint64_t>(integer(args, "most_steps"));
  RMP_TRY_ASSIGN(const auto trace, program::trace(made.program, options, &ctx.progress));
  RMP_TRY_ASSIGN(auto tables, program::flatten(trace));
  return std::shared_ptr<const CompiledProgram>(std::move(tables));
}

/// The place that an error of a run tells as "file:line:column"; nothing = it tells none.
std::optional<rmp_span> place_in(const rmp_code& code, std::string_view where) {
  const auto words = text::split(where, ':');
  if (words.size() < 3) return std::nullopt;
  const auto line = text::read_int(words[words.size() - 2]);
  const auto column = text::read_int(words[words.size() - 1]);
  if (!line || !column || *line < 1 || *column < 1) return std::nullopt;
  std::string_view file = words[words.size() - 3];
  file.remove_prefix(std::min(file.rfind(' ') + 1, file.size()));  // behind "program ..., "
  for (std::uint32_t i = 0; i < code.files.count; ++i)
    if (row<rmp_code_file>(code.files, i).name == file)
      return rmp_span{i, static_cast<std::uint32_t>(*line), static_cast<std::uint32_t>(*column), 0,
                      0};
  return std::nullopt;
}

/// What program.check_run says of the program: in its world, or alone with the robot.
Result<Map> run_of(CommandContext& ctx, const Map& args) {
  Map asked{{"id", *args.find("id")}};
  for (const char* each : {"world", "name_there", "profile", "contacts", "picture", "plot"})
    if (has(args, each)) asked.set(each, *args.find(each));
  if (has(args, "robot") && places_of(ctx.snapshot(), ref(args, "id")).empty())
    asked.set("robot", *args.find("robot"));
  RMP_TRY_ASSIGN(const Value found, ctx.dispatch("program.check_run", asked));
  return *found.as_map();
}

/// The program, or the part of a robot, as its form says. `shares`: parts share variables.
Result<Posted> post_part(CommandContext& ctx, const Map& args, bool shares) {
  RMP_TRY_ASSIGN(Compiled made, compile_whole(ctx, args));
  RMP_TRY_ASSIGN(Asked asked, read_asked(ctx, args, made));
  std::vector<PostedFault> of_part;
  std::vector<program_post::MadeFor> made_for;
  bool is_divided = true;
  if (has(args, "only_robot")) {
    RMP_TRY_ASSIGN(const program_post::Part part,
                   part_of(ctx, args, made, text_of(args, "only_robot"), true, shares));
    for (const auto& r : part.remarks) {
      of_part.push_back({r.severity, r.span, r.message, r.hint});
      is_divided = is_divided && r.severity != RMP_FAULT_ERROR;
    }
    const auto all = program_post::robots_that_move(made.code());
    if (is_divided) {
      RMP_TRY_ASSIGN(made, compile_whole(ctx, args, nullptr, &part.text));
      made_for = part.made_for;
      if (shares) {
        const std::string robot = text_of(args, "only_robot");
        std::string base = asked.name;
        if (base.ends_with("_" + plain(robot))) base.resize(base.size() - plain(robot).size() - 1);
        const auto arm = std::find(all.begin(), all.end(), robot) - all.begin() + 1;
        asked.profile->share(part.shared, robot, static_cast<std::size_t>(arm),
                             base + "_" + plain(part.partner));
      }
    }
  }
  const rmp_code& code = made.code();
  const std::string form = text_of(args, "form");
  const PostCapabilities& caps = asked.post->capabilities();
  const bool takes_structure = (caps.forms & kPostStructured) != 0;
  const bool takes_flat = (caps.forms & kPostFlat) != 0;
  if ((form == "flat" && !takes_flat) || (form == "structured" && !takes_structure))
    return error(ErrorCode::unsupported, std::string(caps.title) + " takes no " + form + " program",
                 "Leave form out.", "form");
  Posted out;
  if (!is_divided) {
    out.form = form == "flat" || !takes_structure ? "flat" : "structured";
  } else if (form == "structured" || (form == "automatic" && takes_structure)) {
    RMP_TRY(write_one(ctx, asked, code, kPostStructured, out));
  }
  std::shared_ptr<const CompiledProgram> flat;
  const bool falls_back = form == "automatic" && takes_flat && takes_structure && out.errors() > 0;
  if (out.form.empty() || falls_back) {
    auto flattened = flatten_it(ctx, args, made);
    if (!flattened.ok() && !falls_back) {
      // Where faults are asked for, it is one of them: the program's, not the command's.
      const bool is_of_program = (flattened.error().code == ErrorCode::unsupported ||
                                  flattened.error().code == ErrorCode::invalid_argument) &&
                                 place_in(code, flattened.error().where);
      if (!flag(args, "check") || !is_of_program)
        return named_once(std::move(flattened).error(), name_in(ctx, ref(args, "id")));
      out.form = "flat";
      out.faults.push_back({RMP_FAULT_ERROR, *place_in(code, flattened.error().where),
                            flattened.error().message, flattened.error().hint});
    } else if (flattened.ok()) {
      flat = std::move(flattened).value();
      Posted other;
      RMP_TRY(write_one(ctx, asked, flat->code(), kPostFlat, other));
      if (falls_back && other.errors() == 0) {
        const PostedFault& why =
            *std::find_if(out.faults.begin(), out.faults.end(),
                          [](const PostedFault& f) { return f.severity == RMP_FAULT_ERROR; });
        other.faults.insert(other.faults.begin(),
                            {RMP_FAULT_NOTE, why.span,
                             "the flattened program is posted, since " + why.message, ""});
      }
      if (!falls_back || other.errors() == 0) {
        out = std::move(other);
      } else {
        const PostedFault& why =
            *std::find_if(other.faults.begin(), other.faults.end(),
                          [](const PostedFault& f) { return f.severity == RMP_FAULT_ERROR; });
        out.faults.push_back({RMP_FAULT_NOTE, why.span,
                              "the flattened program is refused, too: " + why.message, why.hint});
      }
    } else {
      out.faults.push_back({RMP_FAULT_NOTE,
                            place_in(code, flattened.error().where)
                                .value_or(row<rmp_code_routine>(code.routines, 0).span),
                            "the program cannot be flattened either: " + flattened.error().message,
                            flattened.error().hint});
    }
  }
  // What was made for the part is of the place that it was made for.
  const auto to_place = [&](rmp_span& span) {
    for (const auto& m : made_for)
      if (span.file == 0 && span.begin >= m.begin && span.begin < m.end) {
        span = m.span;
        return;
      }
  };
  for (PostedFault& f : out.faults) to_place(f.span);
  for (PostedLine& l : out.lines) to_place(l.span);
  out.faults.insert(out.faults.begin(), of_part.begin(), of_part.end());
  out.faults.insert(out.faults.end(), asked.cell.remarks.begin(), asked.cell.remarks.end());
  return out;
}

/// A program for each robot, for a controller that moves them all.
Result<Posted> post_several(CommandContext& ctx, const Map& args,
                            const std::vector<std::string>& robots) {
  Posted out;
  for (const std::string& robot : robots) {
    Map own = args;
    own.set("only_robot", robot);
    if (has(args, "name")) own.set("name", text_of(args, "name") + "_" + plain(robot));
    RMP_TRY_ASSIGN(Posted part, post_part(ctx, own, true));
    out.files.insert(out.files.end(), part.files.begin(), part.files.end());
    out.lines.insert(out.lines.end(), part.lines.begin(), part.lines.end());
    for (PostedFault& f : part.faults)
      if (std::none_of(out.faults.begin(), out.faults.end(), [&](const PostedFault& o) {
            return o.severity == f.severity && o.span.file == f.span.file &&
                   o.span.begin == f.span.begin && o.message == f.message;
          }))
        out.faults.push_back(std::move(f));
    if (out.form.empty() || part.form == "flat") out.form = part.form;
  }
  return out;
}

Map beside_map(const RunBeside& b) {
  return {{"compared", b.not_run.empty()},
          {"reader", b.reader},
          {"why_not", b.not_run},
          {"motions", static_cast<std::int64_t>(b.motions)},
          {"read_motions", static_cast<std::int64_t>(b.read_motions)},
          {"ends", static_cast<std::int64_t>(b.compared)},
          {"most_distance", b.most_mm / 1000},
          {"most_angle", b.most_degrees / program_source::kDegreesPerRadian},
          {"most_joint", b.most_joint},
          {"time", b.seconds},
          {"has_times", b.has_times},
          {"read_time", b.read_seconds},
          {"changes", static_cast<std::int64_t>(b.changes)},
          {"read_changes", static_cast<std::int64_t>(b.read_changes)},
          {"not_said", static_cast<std::int64_t>(b.not_said)},
          {"text", beside_sentence(b)}};
}
/// What the comparison with the run found, as faults. Speeds of joints and blends have other units
/// at many controllers, so that other times are warnings; so is all where the reader left things
/// out.
void add_beside(const RunBeside& beside, const rmp_span& head, Posted& out) {
  std::string all = beside_sentence(beside);
  if (all.ends_with('.')) all.pop_back();
  // Of machines that hold the tool in one orientation nothing says which.
  const bool says_orientation = std::none_of(
      out.faults.begin(), out.faults.end(),
      [](const PostedFault& f) { return f.message.starts_with("the orientation is not written"); });
  out.faults.push_back({RMP_FAULT_NOTE, head, std::move(all), {}});
  for (const RunBeside::Difference& d : beside.differences) {
    if (d.kind == "orientation" && !says_orientation) continue;
    const bool is_error = beside.not_said == 0 && d.kind != "configuration" && d.kind != "time" &&
                          d.kind != "signal" && d.kind != "until";
    const rmp_span at = d.line > 0 ? rmp_span{d.file, d.line, 1, 0, 0} : head;
    const auto severity = is_error ? RMP_FAULT_ERROR : RMP_FAULT_WARNING;
    out.faults.push_back({static_cast<std::uint32_t>(severity),
                          at,
                          "the post read back is not what was run: " + d.text,
                          {}});
  }
}

/// The flattened program in place of a structured one, if that can be posted.
std::vector<FaultRemedy> flat_instead(CommandContext& ctx, const Map& args, const Asked& asked) {
  if (text_of(args, "form") != "structured" || (asked.post->capabilities().forms & kPostFlat) == 0)
    return {};
  Map flat = args;
  flat.set("form", "flat");
  flat.set("check", true);
  for (const char* more : {"run_check", "picture", "plot", "watch", "folder", "source_map"})
    flat.erase(more);
  const auto posted = ctx.dispatch("program.post", flat);
  if (!posted.ok() || !flag(*posted->as_map(), "correct")) return {};
  FaultRemedy r;
  r.label = "Post the flattened program";
  r.args.set("form", "flat");
  r.repeats = true;
  r.is_tried = true;
  return {std::move(r)};
}

Result<Value> post(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Compiled made, compile_whole(ctx, args));
  const rmp_code& code = made.code();
  RMP_TRY_ASSIGN(const Asked asked, read_asked(ctx, args, made));
  const auto& tags = asked.info.tags;
  const auto robots = program_post::robots_that_move(code);
  const bool are_several = robots.size() > 1 && !has(args, "only_robot") &&
                           std::find(tags.begin(), tags.end(), kSeveralRobots) != tags.end();
  RMP_TRY_ASSIGN(Posted out,
                 are_several ? post_several(ctx, args, robots) : post_part(ctx, args, false));
  const std::string where = name_in(ctx, ref(args, "id"));
  std::size_t errors = out.errors();
  Map run;
  std::int64_t run_errors = 0;
  for (const char* drawn : {"picture", "plot"})
    if (has(args, drawn) && !flag(args, "run_check"))
      return error(ErrorCode::invalid_argument,
                   std::string("a ") + drawn + " needs run_check = true",
                   "Give run_check = true, or leave it out.", drawn);
  if (flag(args, "run_check") && (errors == 0 || flag(args, "check"))) {
    RMP_TRY_ASSIGN(run, run_of(ctx, args));
    run_errors = *run.find("errors")->as_int();
    if (run_errors > 0 && !flag(args, "check")) {
      const Map& first = *run.find("faults")->as_list()->front().as_map();
      return error(
          ErrorCode::unsupported,
          "a run finds " + std::to_string(run_errors) + (run_errors == 1 ? " error" : " errors") +
              ", and nothing is written; the first: " + *first.find("text")->as_string(),
          "program.check_run lists them; without run_check the program is posted unchecked.",
          where);
    }
  }
  std::optional<RunBeside> beside;
  if (flag(args, "run_check") && errors == 0 && run_errors == 0) {
    RMP_TRY_ASSIGN(beside, run_beside(ctx, args, out.files, asked.info));
    add_beside(*beside, row<rmp_code_routine>(code.routines, 0).span, out);
    errors = out.errors();
  }
  if (errors > 0 && !flag(args, "check")) {
    const PostedFault& first =
        *std::find_if(out.faults.begin(), out.faults.end(),
                      [](const PostedFault& f) { return f.severity == RMP_FAULT_ERROR; });
    std::string hint = first.hint;
    if (errors > 1)
      hint += (hint.empty() ? "" : " ") + std::string("With check = true all ") +
              std::to_string(errors) + " errors are listed.";
    return with_posted(
        error(ErrorCode::unsupported, first.message, hint,
              where + ", " + row<rmp_code_file>(code.files, first.span.file).name + ":" +
                  std::to_string(first.span.line) + ":" + std::to_string(first.span.column)),
        posted_text(ctx, args, asked.info.name), code, out, flat_instead(ctx, args, asked));
  }
  List files;
  if (flag(args, "watch") && (flag(args, "check") || !has(args, "folder")))
    return error(ErrorCode::invalid_argument, "no files are written that could be kept up to date",
                 "Give a folder for the files, and leave check out.", "watch");
  if (errors == 0) {
    const bool is_written = has(args, "folder") && !flag(args, "check");
    const std::filesystem::path folder = text_of(args, "folder");
    if (is_written && file_kind(folder) != FileKind::folder)
      return error(ErrorCode::not_found, "there is no folder " + text::quote(folder.string()),
                   "Create it first.", "folder");
    for (const auto& [name, bytes] : out.files) {
      if (!is_written) {
        files.emplace_back(Map{{"name", name}, {"text", bytes}});
        continue;
      }
      if (!flag(args, "overwrite") && file_kind(folder / name) != FileKind::none)
        return error(ErrorCode::conflict,
                     "there is a file " + text::quote((folder / name).string()) + " already",
                     "Give overwrite = true to replace it, or another folder.");
    }
    if (is_written)
      for (const auto& [name, bytes] : out.files) {
        // Such as the application of VAL3, which is a folder.
        const auto inner = (folder / name).parent_path();
        if (file_kind(inner) != FileKind::folder) {
          RMP_TRY(make_folders(inner));
        }
        RMP_TRY(io::write_file(folder / name, bytes));
        files.emplace_back(Map{{"name", name}, {"path", (folder / name).string()}});
      }
    RMP_TRY(watch_drawing(ctx, "program.post", args));
  }
  List map;
  if (flag(args, "source_map"))
    for (const PostedLine& l : out.lines)
      map.emplace_back(Map{{"file", l.file},
                           {"line", static_cast<std::int64_t>(l.line)},
                           {"source", row<rmp_code_file>(code.files, l.span.file).name},
                           {"source_line", static_cast<std::int64_t>(l.span.line)}});
  List faults = fault_list(posted_text(ctx, args, asked.info.name), code, out);
  if (const Value* more = run.find("faults"))
    for (const Value& each : *more->as_list()) {
      const Map& f = *each.as_map();
      Map row;
      for (const char* name :
           {"severity", "file", "line", "column", "message", "hint", "kind", "fault"})
        row.set(name, *f.find(name));
      faults.emplace_back(std::move(row));
    }
  Map all{{"target", asked.info.name},
          {"form", out.form},
          {"correct", errors == 0 && run_errors == 0},
          {"files", std::move(files)},
          {"faults", std::move(faults)},
          {"source_map", std::move(map)}};
  if (flag(args, "run_check")) all.set("run", Value(std::move(run)));
  if (beside) all.set("read_back", Value(beside_map(*beside)));
  return Value(std::move(all));
}

Result<Value> part_of_robot(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Compiled made, compile_whole(ctx, args));
  RMP_TRY_ASSIGN(const program_post::Part part,
                 part_of(ctx, args, made, text_of(args, "robot"), false, false));
  const std::string where = name_in(ctx, ref(args, "id"));
  Posted out;
  for (const auto& r : part.remarks) out.fault(r.severity, r.span, r.message, r.hint);
  for (const PostedFault& f : out.faults)
    if (f.severity == RMP_FAULT_ERROR)
      return with_posted(
          error(ErrorCode::unsupported, f.message, f.hint,
                where + ", " + row<rmp_code_file>(made.code().files, f.span.file).name + ":" +
                    std::to_string(f.span.line) + ":" + std::to_string(f.span.column)),
          posted_text(ctx, args), made.code(), out);
  model::Program p = program_of(ctx, args);
  p.files.front().lines = lines_of(part.text);
  List faults = fault_list(posted_text(ctx, args), made.code(), out);
  const std::string name = text_of(args, "name");
  model::Record r;
  r.name = name;
  r.body = model::OtherContent(program_kind(), std::move(p));
  RMP_TRY_ASSIGN(const AnyId id, ctx.edit().add(std::move(r)));
  return Value(Map{{"program", Application::handle(id)}, {"faults", std::move(faults)}});
}

Result<Value> targets(CommandContext& ctx, const Map&) {
  List all;
  for (const ProviderInfo& info : ctx.app.registry.list()) {
    if (info.interface_id != Post::kInterfaceId || !info.enabled) continue;
    auto post = ctx.app.registry.create<Post>(info.name);
    if (!post.ok()) {
      all.emplace_back(Map{{"name", info.name}, {"title", post.error().sentence()}});
      continue;
    }
    const PostCapabilities& c = (*post)->capabilities();
    static constexpr const char* kBlending[] = {"none",   "distance", "percent",
                                                "radius", "zone",     "accuracy"};
    static constexpr const char* kSpeed[] = {"mm/s", "m/s", "mm/min", "percent", "time"};
    List lacks;
    static constexpr std::pair<std::uint64_t, const char*> kFeatures[] = {
        {kPostProcedures, "procedures"},
        {kPostFunctions, "functions"},
        {kPostRecursion, "recursion"},
        {kPostReals, "real variables"},
        {kPostStrings, "strings"},
        {kPostArrays, "arrays"},
        {kPostRecords, "records"},
        {kPostPoses, "variables of poses"},
        {kPostIf, "IF"},
        {kPostWhile, "WHILE"},
        {kPostProcesses, "parallel processes"},
        {kPostInterrupts, "interrupts"},
        {kPostWaitTimeout, "WAIT FOR with TIMEOUT"},
        {kPostUntil, "UNTIL"},
        {kPostVariableTargets, "computed targets"},
        {kPostMessages, "messages"}};
    for (const auto& [bit, word] : kFeatures)
      if ((c.features & bit) == 0) lacks.emplace_back(word);
    all.emplace_back(
        Map{{"name", info.name},
            {"title", std::string(c.title)},
            {"extensions", std::string(c.extensions)},
            {"structured", (c.forms & kPostStructured) != 0},
            {"flat", (c.forms & kPostFlat) != 0},
            {"speed", kSpeed[std::clamp(static_cast<int>(c.speed), 0, 4)]},
            {"blending", kBlending[std::clamp(static_cast<int>(c.blending), 0, 5)]},
            {"external_axes", static_cast<std::int64_t>(c.external_axes)},
            {"longest_name", static_cast<std::int64_t>(c.max_name)},
            {"lacks", std::move(lacks)},
            {"several_robots",
             std::find(info.tags.begin(), info.tags.end(), kSeveralRobots) != info.tags.end()},
            {"by", std::find(info.tags.begin(), info.tags.end(), kByTemplates) != info.tags.end()
                       ? "templates"
                       : "plugin"},
            {"origin", info.origin}});
  }
  return Value(std::move(all));
}

Result<Value> add_target(CommandContext& ctx, const Map& args) {
  std::filesystem::path file = text_of(args, "file");
  if (file_kind(file) == FileKind::folder) file /= kPackFile;
  RMP_TRY_ASSIGN(const auto pack,
                 read_pack(file, [](const std::filesystem::path& f, std::uint64_t most) {
                   return io::read_file(f, most);
                 }));
  // A pack replaces itself, so that it can be written step by step.
  RMP_TRY_ASSIGN(const std::string name, add_pack(ctx.app.registry, file, pack, true));
  return Value(name);
}

/// A program that moves, for examples.
std::string with_moves(const char* rest) {
  return std::string(
             "local lift = program.create{name = \"lift\", source = [[\n"
             "PROGRAM lift;\n"
             "VAR\n"
             "  POSE: place := POSE(POSITION(500.0, 0.0, 120.0), ORIZYX(0.0, 180.0, 0.0));\n"
             "BEGIN\n"
             "  MOVE LIN place SPEED := 80.0;\n"
             "ENDPROGRAM;\n"
             "]]}\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(post_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "program.post",
       .classic = "",
       .summary = "Writes a program in the language of a controller.",
       .details = "Constructs that the target cannot express are rewritten if possible (CASE to "
                  "IF, FOR to WHILE, REPEAT to jumps); otherwise they are an error at the line, "
                  "with a workaround: nothing is omitted. With a robot, targets get joints, "
                  "configuration and turns from its inverse kinematics, each starting at the one "
                  "before in the text.\nIn a world the program has the robot, frame and tool of "
                  "its run: targets are written in the frame it is bound to and for the tool that "
                  "the robot has there, by the controller's own means; if these are missing, the "
                  "post is refused.\nA profile is a record of kind controller (record.create, or "
                  "from the library) with its axes, signals, tools and limits.",
       .example = with_moves("local out = lift:post{target = \"krl\"}\n"
                             "assert(out.files[1].text:find(\"LIN XPLACE\"))"),
       .params =
           {self("program"),
            optional("target", "string", "",
                     "Provider of robomosp.post/1, such as krl; the profile's if omitted. "
                     "program.targets lists them."),
            optional("profile", "ref:controller", "", "The controller profile."),
            optional("robot", "ref:robot", "", "The robot that moves."),
            optional("only_robot", "string", "",
                     "A ROBOT of a program for several robots: the part for its controller is "
                     "posted (program.part_of_robot)."),
            optional("folder", "path", "",
                     "An existing folder for the files; if omitted, their texts are returned."),
            choice("form", {"automatic", "structured", "flat"},
                   "structured: the program as written; flat: its actions in a run without inputs; "
                   "automatic: flat if the target cannot express the program as written."),
            optional("inputs", "map", "",
                     "Values of inputs by name for a program that is flattened: those that its "
                     "flow depends on."),
            between(optional("most_steps", "int", "",
                             "Limit of instructions for flattening; 2e9 if omitted."),
                    1, 1e15),
            optional("name", "string", "",
                     "Name of the program on the controller; by default that of the profile or the "
                     "program."),
            defaulted("check", "bool", "", false,
                      "Only lists errors and warnings; writes nothing."),
            defaulted("run_check", "bool", "", false,
                      "Checks the program by a run as well (program.check_run), in its world or "
                      "alone with the robot, and refuses the post if the run has errors. Then the "
                      "posted files are read back if a reader supports them, run in the same "
                      "place, and compared: tool poses in the world, joints, time, signals; "
                      "different poses or signals are errors. C files are compiled by the user's "
                      "compiler (ROBOMOSP_CC, else cc) and run in a separate process."),
            optional("world", "ref:world", "",
                     "World that it is posted and checked for, if it is in several."),
            optional("name_there", "string", "",
                     "Its name there, if the world has it several times."),
            optional("contacts", "bool", "",
                     "With run_check: false skips contacts, which take most of its time."),
            optional("picture", "path", "", "With run_check: a picture of the tool's path, *.png."),
            optional("plot", "path", "",
                     "With run_check: a plot over time, *.svg, *.png or *.pdf."),
            defaulted("overwrite", "bool", "", false, "Whether existing files are replaced."),
            watch_file_field(),
            defaulted("source_map", "bool", "", false,
                      "Whether the source line of each posted line is returned."),
            optional("params", "map", "", "Parameters of the target.")},
       .returns = {"map",
                   "",
                   "",
                   {field("target", "string", "", "The provider."),
                    field("form", "string", "", "The posted form."),
                    field("correct", "bool", "", "Whether there are no errors."),
                    field("files", "list", "", "One table each: name, text or path."),
                    field("faults", "list", "",
                          "One table each: severity, file, line, column, message, hint, fault; of "
                          "run_check also kind."),
                    field("run", "map", "", "With run_check: the result of program.check_run."),
                    field("read_back", "map", "",
                          "With run_check, if neither run has errors: comparison of the posted "
                          "files with the program. compared, or why_not; reader; motions and "
                          "read_motions; ends, the number compared; most_distance [m] and "
                          "most_angle [rad] of the tool in the world, most_joint [degrees or mm]; "
                          "time and read_time [s], if the target has_times; changes and "
                          "read_changes of signals; not_said, what the reader left out; text."),
                    field("source_map", "list", "",
                          "One table per line: file, line, source, source_line.")}},
       .effect = Effect::reads,
       .sometimes =
           Effects(Effect::files_write) | Effect::simulates | Effect::edits | Effect::processes,
       .run = post});
  all.push_back(
      {.name = "program.part_of_robot",
       .classic = "",
       .summary =
           "Makes the part of a program for several robots that runs on the controller of one.",
       .details =
           "The program and its processes run on the controller of the robot that each moves; a "
           "process that moves nothing runs where it shares the most. Semaphores, BOOL and INT "
           "that two controllers share become lines between them, which the profile lists among "
           "its signals: NAME_released and NAME_acquired of a semaphore, the name of a variable, "
           "and NAME_starts of both robots. Anything else they share is an error at its line. "
           "program.post with only_robot posts the same.",
       .example =
           "local both = program.create{name = \"both\", source = [[\n"
           "PROGRAM both;\n"
           "TYPE\n"
           "  RECORD POSE: R_BASE, R_TOOL; ENDRECORD: R_SPEC_TYPE;\n"
           "  ROBOT left := R_SPEC_TYPE(POSE(POSITION(0.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0)),\n"
           "    POSE(POSITION(0.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0)));\n"
           "  ROBOT right := left;\n"
           "VAR POSE: a := POSE(POSITION(500.0, 0.0, 300.0), ORIZYX(0.0, 180.0, 0.0));\n"
           "PROCESS go;\n"
           "BEGIN\n"
           "  MOVE PTP a ACT_ROB := right;\n"
           "ENDPROCESS;\n"
           "BEGIN\n"
           "  START go;\n"
           "  MOVE PTP a ACT_ROB := left;\n"
           "ENDPROGRAM;\n"
           "]]}\n"
           "local part = both:part_of_robot{robot = \"right\", name = \"right\"}\n"
           "assert(part.program:source():find(\"PROCEDURE go\"))",
       .params = {self("program"), needed("robot", "string", "", "A ROBOT of the program."),
                  needed("name", "string", "", "Name of the part, unique among programs."),
                  optional("profile", "ref:controller", "",
                           "The controller; its signals may be lines to another one.")},
       .returns = {"map",
                   "",
                   "",
                   {field("program", "handle", "", "The part."),
                    field("faults", "list", "",
                          "Remarks, one table each: severity, file, line, column, message, hint, "
                          "fault.")}},
       .effect = Effect::edits,
       .run = part_of_robot});
  all.push_back(
      {.name = "program.add_target",
       .classic = "",
       .summary = "Adds a post target that is made of templates, without a compiler.",
       .details = "A text file with one template per construct; "
                  "docs/plugin_author/post_templates.md describes the form. Templates that are "
                  "missing for the features it claims are reported at once, one sentence each with "
                  "its place. A pack that is read again replaces itself. It stays until the "
                  "program ends; a pack in a folder of plugins is loaded at every start.",
       .example = "io.open(\"acme.post\", \"w\"):write([[\n"
                  "robomosp target 1\n"
                  "name: acme\n"
                  "file: {{name}}.acl\n"
                  "motions: lin\n"
                  "forms: flat\n"
                  "== program_begin\n"
                  "BEGIN {{name}}\n"
                  "== program_end\n"
                  "STOP\n"
                  "== lin\n"
                  "GO {{x|fixed:1}} {{y|fixed:1}} {{z|fixed:1}} {{a}} {{b}} {{c}}\n"
                  "== output_on\n"
                  "ON {{number}}\n"
                  "== output_off\n"
                  "OFF {{number}}\n"
                  "== wait_time\n"
                  "WAIT {{milliseconds}}\n"
                  "]]):close()\n"
                  "assert(program.add_target(\"acme.post\") == \"acme\")",
       .params = {needed("file", "path", "", "The pack: a file, or a folder with pack.post.")},
       .returns = {"string", "", "Its name, to be used as a target.", {}},
       .effect = Effect::files_read | Effect::providers,
       .run = add_target});
  all.push_back({.name = "program.targets",
                 .classic = "",
                 .summary = "Lists the controller languages that programs can be posted to.",
                 .details = "",
                 .example = "assert(#program.targets() >= 1)",
                 .params = {},
                 .returns = {"list",
                             "",
                             "One table each: name, title, extensions, structured, flat, speed, "
                             "blending, external_axes, longest_name, lacks, several_robots, by "
                             "(plugin or templates), origin (its file).",
                             {}},
                 .effect = Effect::reads,
                 .run = targets});
  return all;
}

}  // namespace robomosp::ioci
