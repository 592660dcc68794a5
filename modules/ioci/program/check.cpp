// SPDX-License-Identifier: Apache-2.0
// Programs checked before they are posted: a run in a copy of their world, with faults at the
// lines of the source, the tool's way in their colours, and joints over time.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/program/check_program.h"
#include "ioci/program/in_world.h"
#include "ioci/program/rows.h"
#include "ioci/program/workshop.h"
#include "ioci/view/picture.h"
#include "ioci/world/members.h"
#include "ioci/world/pair_remedy.h"
#include "kernel/fault.h"
#include "program_check/shown_run.h"
#include "program_post/points.h"
#include "program_source/text_faults.h"
#include "scene/build.h"

namespace robomosp::ioci {
namespace {

using program_check::Check;
using CheckFault = program_check::Fault;
using program_check::FaultKind;
using program_check::file_name, program_check::routine_name, program_check::sentence_of,
    program_check::where_of;
using program_check::kNone;
using program_check::MotionReport;
using text::print_rounded;

const char* motion_word(std::uint32_t interpolation) {
  switch (interpolation) {
    case RMP_MOVE_LIN: return "LIN";
    case RMP_MOVE_CIRCLE: return "CIRCLE";
    case RMP_MOVE_PATH: return "PATH";
    default: return "PTP";
  }
}
/// Spans of MOVE statements whose targets are not known before the run.
std::set<std::pair<std::uint32_t, std::uint32_t>> computed_motions(const rmp_code& code) {
  const auto known = program_post::known_points(code, nullptr, nullptr);
  std::set<std::uint32_t> expressions;
  for (const PostPoint& p : known.points) expressions.insert(p.expression);
  std::set<std::pair<std::uint32_t, std::uint32_t>> out;
  for (std::uint32_t i = 0; i < code.motions.count; ++i) {
    const auto& m = row_of<rmp_code_motion>(code.motions, i);
    for (std::uint32_t k = 0; k < m.target_count; ++k)
      if (!expressions.contains(row_of<std::uint32_t>(code.links, m.first_target + k)))
        out.emplace(m.span.file, m.span.line);
  }
  return out;
}

Map motion_row(const CheckedProgram& c, std::size_t i) {
  const rmp_code& code = c.code->code();
  const MotionReport& m = c.check.motions[i];
  const auto& one = m.motion;
  Map row{{"file", file_name(code, one.place.span.file)},
          {"line", static_cast<std::int64_t>(one.place.span.line)},
          {"run", static_cast<std::int64_t>(one.place.count)},
          {"kind", motion_word(one.interpolation)},
          {"robot", one.robot < c.check.inspection->robots.size()
                        ? c.check.inspection->robots[one.robot].name
                        : std::string()},
          {"start", one.start},
          {"duration", std::max(0.0, one.end - one.start)},
          {"end", vec_value(m.end, "m")},
          {"carried_out", one.is_carried_out},
          {"speed_share", m.utilisation}};
  if (m.utilised >= 0) row.set("fastest_joint", Value(static_cast<std::int64_t>(m.utilised + 1)));
  if (std::isfinite(m.clearance)) {
    row.set("clearance", Value(m.clearance));
    row.set("nearest", Value(m.nearest));
  }
  if (m.condition > 0 && std::isfinite(m.condition)) row.set("condition", Value(m.condition));
  if (one.is_carried_out && std::isfinite(m.manipulability))
    row.set("manipulability", Value(m.manipulability));
  if (m.has_fault) row.set("worst", Value(std::string(program_check::to_string(m.worst))));
  return row;
}

/// Targets that the program computes, as they were reached.
List computed_targets(const CheckedProgram& c, std::size_t most, std::size_t& left_out) {
  const rmp_code& code = c.code->code();
  const auto computed = computed_motions(code);
  List out;
  for (const MotionReport& m : c.check.motions) {
    const auto& one = m.motion;
    if (!computed.contains({one.place.span.file, one.place.span.line})) continue;
    if (out.size() >= most) {
      ++left_out;
      continue;
    }
    Map row{{"file", file_name(code, one.place.span.file)},
            {"line", static_cast<std::int64_t>(one.place.span.line)},
            {"run", static_cast<std::int64_t>(one.place.count)},
            {"time", one.end},
            {"reached", one.is_carried_out && !one.is_cut},
            {"q", NumericArray(one.q_target)}};
    if (one.base_T_target) {
      row.set("position", vec_value(one.base_T_target->p, "m"));
      row.set("pose", Value(pose_map(*one.base_T_target)));
    }
    out.emplace_back(std::move(row));
  }
  return out;
}

Fault run_fault(const CommandContext&, AnyId program, const CheckedProgram&, const CheckFault&);

Result<void> draw(CommandContext& ctx, const Map& args, const CheckedProgram& c,
                  const std::string& file) {
  RMP_TRY_ASSIGN(render::Options options, read_picture(args));
  const CheckFault* first = program_check::shown_fault(c.check);
  scene::Extras extras;
  extras.frames = flag(args, "frames");
  extras.paths = scene::ShownPath::none;
  const scene::Source source{*c.snapshot, ctx.app.derived, ctx.app.registry};
  RMP_TRY_ASSIGN(scene::Built built, scene::build(source, AnyId(c.world), extras, ctx.progress));
  RMP_TRY(apply_visibility(ctx, args, AnyId(c.world), built));
  RMP_TRY_ASSIGN(const auto playback,
                 scene::build_playback(source, c.world, *c.check.recording, ctx.progress));
  scene::pose_at(built.scene, playback, first ? first->at : c.check.duration);
  // Frames that nobody asked for would stand among the marks.
  if (!extras.frames)
    std::erase_if(built.scene.triads, [](const render::Triad& t) { return !t.label.empty(); });
  const std::size_t unnamed = program_check::mark_run(built.scene, c);
  if (options.look.caption.empty() && first)
    options.look.caption = program_check::caption_of(c, *first, unnamed);
  RMP_TRY_ASSIGN(options.look.section, read_section(ctx, args, built.scene));
  RMP_TRY_ASSIGN(const auto drawer, renderer(ctx.app));
  RMP_TRY_ASSIGN(const std::string bytes, draw_png(*drawer, built.scene, options, ctx.progress));
  return io::write_file(file, bytes);
}

Result<Value> check(CommandContext& ctx, const Map& args) {
  const std::string file = has(args, "picture") ? text_of(args, "picture") : "";
  const std::string plot_name = has(args, "plot") ? text_of(args, "plot") : "";
  if (!file.empty())
    RMP_TRY(check_new_file(file, ".png", "Pictures are written as PNG files only."));
  RMP_TRY_ASSIGN(const CheckedProgram c, check_program(workshop_of(ctx), check_task(args)));
  const rmp_code& code = c.code->code();
  const Check& found = c.check;
  const auto most = static_cast<std::size_t>(integer(args, "most"));
  Map left_out;
  List faults, motions, not_run, not_checked;
  PairTrials trials(ctx);
  for (const CheckFault& f : found.faults) {
    if (faults.size() >= most) break;
    Map row = fault_row(c, f);
    Fault fault = run_fault(ctx, ref(args, "id"), c, f);
    trials.look_at(fault);
    row.set("fault", fault_map(fault));
    faults.emplace_back(std::move(row));
  }
  if (found.faults.size() > most)
    left_out.set("faults", Value(static_cast<std::int64_t>(found.faults.size() - most)));
  for (std::size_t i = 0; i < found.motions.size() && motions.size() < most; ++i)
    motions.emplace_back(motion_row(c, i));
  if (const std::size_t all = found.motions.size() + found.inspection->motions_left_out; all > most)
    left_out.set("motions", Value(static_cast<std::int64_t>(all - motions.size())));
  std::size_t targets_left_out = 0;
  List targets = computed_targets(c, most, targets_left_out);
  if (targets_left_out) left_out.set("targets", Value(static_cast<std::int64_t>(targets_left_out)));
  for (const auto& u : found.not_run) {
    if (not_run.size() >= most) break;
    not_run.emplace_back(Map{{"file", file_name(code, u.file)},
                             {"from", static_cast<std::int64_t>(u.first)},
                             {"to", static_cast<std::int64_t>(u.last)},
                             {"routine", routine_name(code, u.routine)},
                             {"never_called", u.is_whole_routine}});
  }
  if (found.not_run.size() > most)
    left_out.set("not_run", Value(static_cast<std::int64_t>(found.not_run.size() - most)));
  for (const std::string& n : found.not_checked) not_checked.emplace_back(n);
  // Time by line.
  std::map<std::tuple<std::uint32_t, std::uint32_t>, std::pair<std::size_t, double>> by_line;
  for (const MotionReport& m : found.motions) {
    auto& line = by_line[{m.motion.place.span.file, m.motion.place.span.line}];
    ++line.first;
    if (m.motion.is_carried_out) line.second += std::max(0.0, m.motion.end - m.motion.start);
  }
  List lines;
  for (const auto& [where, of] : by_line) {
    if (lines.size() >= most) break;
    lines.emplace_back(Map{{"file", file_name(code, std::get<0>(where))},
                           {"line", static_cast<std::int64_t>(std::get<1>(where))},
                           {"motions", static_cast<std::int64_t>(of.first)},
                           {"duration", of.second}});
  }
  if (by_line.size() > most)
    left_out.set("lines", Value(static_cast<std::int64_t>(by_line.size() - most)));
  const auto count = [&](program_check::Severity s) {
    return static_cast<std::int64_t>(found.count(s));
  };
  std::string report;
  for (const CheckFault& f : found.faults) {
    if (f.severity == program_check::Severity::note) continue;
    report += sentence_of(code, f) + "\n";
  }
  Map cycle{{"total", found.duration},
            {"moving", found.moving},
            {"waiting", std::max(0.0, found.duration - found.moving)},
            {"complete", found.inspection->is_over && !found.inspection->is_out_of_time},
            {"slowed", static_cast<std::int64_t>(found.inspection->motions_slowed)},
            {"lines", std::move(lines)}};
  Map thresholds{{"clearance", c.options.clearance},
                 {"touch", c.options.touch},
                 {"condition", c.options.condition},
                 {"sample_time", real(args, "sample_time")}};
  Map out{{"correct", found.count(program_check::Severity::error) == 0},
          {"errors", count(program_check::Severity::error)},
          {"warnings", count(program_check::Severity::warning)},
          {"notes", count(program_check::Severity::note)},
          {"faults", std::move(faults)},
          {"cycle_time", std::move(cycle)},
          {"motions", std::move(motions)},
          {"targets", std::move(targets)},
          {"statements", static_cast<std::int64_t>(found.statements)},
          {"statements_run", static_cast<std::int64_t>(found.statements_run)},
          {"not_run", std::move(not_run)},
          {"not_checked", std::move(not_checked)},
          {"thresholds", std::move(thresholds)},
          {"left_out", std::move(left_out)},
          {"report", std::move(report)}};
  if (!file.empty()) {
    RMP_TRY(draw(ctx, args, c, file));
    out.set("picture", Value(file));
  }
  if (!plot_name.empty()) {
    RMP_TRY_ASSIGN(const recording::Plot plot, program_check::limits_plot(c));
    RMP_TRY_ASSIGN(const std::string bytes, recording::plot_file(plot, plot_name));
    RMP_TRY(io::write_file(plot_name, bytes));
    out.set("plot", Value(plot_name));
  }
  if (flag(args, "record"))
    out.set("recording", Value(Handle{"recording", ctx.app.recordings.add(found.recording)}));
  return Value(std::move(out));
}

const FaultCodes kProgramCodes{
    {"program.reach", ErrorCode::unreachable, "No joint values bring the tool to a target."},
    {"program.joint_limit", ErrorCode::unreachable, "A joint goes beyond its limits."},
    {"program.speed", ErrorCode::conflict, "A joint is faster than it can be."},
    {"program.acceleration", ErrorCode::conflict, "A joint passes its acceleration limit."},
    {"program.torque", ErrorCode::conflict, "A joint needs more torque than it has."},
    {"program.contact", ErrorCode::conflict, "Bodies touch during a motion."},
    {"program.clearance", ErrorCode::conflict, "Bodies come closer than wanted."},
    {"program.singularity", ErrorCode::unreachable,
     "A straight motion passes close to a singular configuration."},
    {"program.configuration", ErrorCode::unreachable,
     "A straight motion leaves its configuration, or ends in another than wanted."},
    {"program.motion", ErrorCode::invalid_argument, "A motion is not possible."},
    {"program.controller", ErrorCode::unsupported,
     "A motion passes what the controller's record allows."},
    {"program.signal", ErrorCode::conflict,
     "A signal that is waited for never comes, or an output cannot have its value."},
    {"program.timeout", ErrorCode::conflict, "A WAIT FOR ran out of time."},
    {"program.grip", ErrorCode::conflict, "A gripper finds nothing."},
    {"program.until", ErrorCode::conflict, "The condition of an UNTIL never came true."},
    {"program.program", ErrorCode::conflict, "A program ends with a fault."},
    {"program.ignored", ErrorCode::unsupported, "An attribute is not carried out."},
};

/// The joints of a robot at a time of the run.
std::vector<double> joints_at(const recording::Recording& r, const std::string& robot,
                              double time) {
  std::vector<double> q;
  if (r.rows() == 0 || robot.empty()) return q;
  const std::vector<double>& times = r.columns.front().values;
  const auto at =
      std::min(static_cast<std::size_t>(std::lower_bound(times.begin(), times.end(), time - 1e-9) -
                                        times.begin()),
               times.size() - 1);
  for (std::size_t j = 1;; ++j) {
    const recording::Column* column = r.find(robot + ".q" + std::to_string(j));
    if (!column) return q;
    q.push_back(column->values[at]);
  }
}

/// What mends a fault by other arguments of the check, or by a rule of the world.
void offer_remedies(Fault& out, const CheckFault& f, const Handle& world) {
  FaultRemedy r;
  if (f.kind == FaultKind::clearance && f.has_values && f.value > 0) {
    // Of the places of one line the fault has the least distance.
    const double bound = std::floor(f.value * 1e4) / 1e4;
    r.label = "Accept a clearance of " + print_rounded(bound, 4) + " m";
    r.args.set("clearance", bound);
    r.command = "program.check_run";
    r.repeats = r.is_tried = true;
    out.remedies.push_back(std::move(r));
  } else if (f.kind == FaultKind::contact && world.number != 0 && !f.a.empty()) {
    out.remedies.push_back(allow_pair_remedy(world, f.a, f.b));
  }
}

/// A fault of a run as data: its line, its time, and what of the robot shows it.
Fault run_fault(const CommandContext& ctx, AnyId program, const CheckedProgram& c,
                const CheckFault& f) {
  const rmp_code& code = c.code->code();
  Fault out = make_fault("program." + std::string(program_check::to_string(f.kind)), f.message,
                         f.hint, where_of(code, f.place.span));
  const model::Record& record = *ctx.snapshot().find(program);
  out.subject.record = Application::handle(program);
  out.subject.path =
      program_source::line_path(std::get<model::OtherContent>(record.body).as<model::Program>(),
                                file_name(code, f.place.span.file), f.place.span.line);
  out.severity = f.severity == program_check::Severity::error     ? Severity::error
                 : f.severity == program_check::Severity::warning ? Severity::warning
                                                                  : Severity::info;
  out.subject.name = record.name;
  out.subject.file = file_name(code, f.place.span.file);
  out.subject.line = out.subject.end_line = f.place.span.line;
  out.subject.column = f.place.span.column;
  out.subject.end_column = f.place.span.column + (f.place.span.end - f.place.span.begin);
  out.extent.from = f.from;
  out.extent.to = f.to;
  out.extent.at = f.at;
  if (f.motion != kNone) out.extent.motion = f.motion + 1;
  FaultWitness& w = out.witness;
  // A world that was made for the check is gone after it.
  const Handle world = ctx.snapshot().find(c.world) ? Application::handle(c.world) : Handle{};
  w.robot = f.robot;
  if (world.number != 0) w.q = joints_at(*c.check.recording, f.robot, f.at);
  if (f.joint >= 0) {
    FaultJoint joint;
    joint.number = static_cast<std::size_t>(f.joint) + 1;
    joint.name = "joint " + std::to_string(joint.number);
    if (f.has_values && std::isfinite(f.value)) joint.value = f.value;
    if (f.has_values) joint.limit = f.limit;
    joint.unit = f.unit;
    w.joints.push_back(std::move(joint));
  }
  if (!f.a.empty()) w.bodies = {f.a, f.b};
  if (f.has_position) w.points.push_back({"", f.position[0], f.position[1], f.position[2]});
  if (f.has_values) {
    if (std::isfinite(f.value)) w.value = f.value;
    w.limit = f.limit;
    if (std::isfinite(f.excess)) w.excess = f.excess;
    w.unit = f.unit;
  }
  if (!w.is_empty()) w.scene = world;
  offer_remedies(out, f, world);
  return out;
}

}  // namespace

Map fault_row(const CheckedProgram& c, const CheckFault& f) {
  const rmp_code& code = c.code->code();
  List calls;
  for (const auto& call : f.place.calls)
    calls.emplace_back(Map{{"routine", call.name},
                           {"file", file_name(code, call.span.file)},
                           {"line", static_cast<std::int64_t>(call.span.line)}});
  Map row{{"severity", std::string(program_check::to_string(f.severity))},
          {"kind", std::string(program_check::to_string(f.kind))},
          {"file", file_name(code, f.place.span.file)},
          {"line", static_cast<std::int64_t>(f.place.span.line)},
          {"column", static_cast<std::int64_t>(f.place.span.column)},
          {"message", f.message + "."},
          {"hint", f.hint},
          {"process", routine_name(code, f.place.process)},
          {"calls", std::move(calls)},
          {"run", static_cast<std::int64_t>(f.place.count)},
          {"times", static_cast<std::int64_t>(f.times)},
          {"time", f.at},
          {"from", f.from},
          {"to", f.to},
          {"text", sentence_of(code, f)}};
  if (!f.robot.empty()) row.set("robot", Value(f.robot));
  if (f.joint >= 0) row.set("joint", Value(static_cast<std::int64_t>(f.joint + 1)));
  if (f.has_values) {
    if (std::isfinite(f.value)) row.set("value", Value(f.value));
    row.set("limit", Value(f.limit));
    if (std::isfinite(f.excess)) row.set("excess", Value(f.excess));
    row.set("unit", Value(f.unit));
  }
  if (!f.a.empty()) row.set("a", Value(f.a)), row.set("b", Value(f.b));
  if (!f.signals.empty()) {
    List names;
    for (const std::string& s : f.signals) names.emplace_back(s);
    row.set("signals", Value(std::move(names)));
  }
  if (f.has_position) row.set("position", vec_value(f.position, "m"));
  return row;
}

Schema check_params() {
  return {
      optional("world", "ref:world", "", "The world, if several have the program."),
      optional("name_there", "string", "", "Its name there, if the world has it several times."),
      optional("robot", "ref:robot", "",
               "For a program that is in no world: the robot that runs it alone."),
      optional("profile", "ref:controller", "",
               "A controller: the limits of its axes are checked, and its greatest speeds limit "
               "the cycle time."),
      defaulted("alone", "bool", "", false,
                "Runs it without the other programs and tasks of its world."),
      choice("unbound", {"error", "free"},
             "Whether signals without a binding are an error or belong to the program."),
      between(defaulted("clearance", "real", "m", 0.005,
                        "A smaller clearance is a warning; 0 finds contacts only."),
              0, 10),
      between(
          defaulted("condition", "real", "", 100.0,
                    "Limit of the condition number of the Jacobian, with lengths divided by the "
                    "robot's reach: above it, straight motions are too close to a singularity."),
          1, 1e12),
      defaulted("contacts", "bool", "", true, "Checks contacts and clearances."),
      defaulted("torques", "bool", "", true, "Compares torques with their limits."),
      above_zero(defaulted("sample_time", "real", "s", 0.02, "Time between rows.")),
      above_zero(defaulted("most_time", "real", "s", 3600.0,
                           "The run ends at this time, with a message.")),
      above_zero(
          optional("duration", "real", "s",
                   "Limit for programs without an end; the run ends there, with a message."))};
}

program_check::CheckTask check_task(const Map& args) {
  program_check::CheckTask out;
  out.program = ref(args, "id");
  out.place = place_wish(args);
  out.robot = typed<model::Robot>(args, "robot");
  out.profile = ref(args, "profile");
  out.alone = flag(args, "alone");
  out.frees_unbound = text_of(args, "unbound") == "free";
  out.contacts = flag(args, "contacts");
  out.torques = flag(args, "torques");
  out.clearance = real(args, "clearance");
  out.condition = real(args, "condition");
  out.sample_time = real(args, "sample_time");
  out.most_time = real(args, "most_time");
  if (has(args, "duration")) out.most_time = std::min(out.most_time, real(args, "duration"));
  return out;
}

RMP_COMMANDS(program_check_commands) {
  CommandSpec c;
  c.name = "program.check_run";
  c.summary = "Checks a program by a run in a copy of its world, before it is posted.";
  c.details =
      "The program runs with all other programs and tasks of its world, and continues after "
      "faults: after a failed motion the robot is placed at its target if that can be reached, and "
      "a wait that nothing ends is skipped. Checked are reach, limits of the joints (position, "
      "velocity, acceleration, torque, and those of a controller's axes), contacts and clearance "
      "along the motions, closeness to a singularity and changes of the configuration on straight "
      "motions, waits that nothing ends or that time out, grips that find nothing, faults of the "
      "program itself, and lines that did not run. The document does not change.\nFaults of the "
      "same kind and line are merged into one, described by the worst, with their number. The "
      "picture shows the tool's path with its faults in colours, the plot shows the joints against "
      "their limits and the clearance over time.";
  c.example = with_arm(
      "local far = program.create{name = \"far\", source = [[\n"
      "PROGRAM far;\n"
      "VAR\n"
      "  POSE: away := POSE(POSITION(9000.0, 0.0, 100.0), ORIZYX(0.0, 180.0, 0.0));\n"
      "BEGIN\n"
      "  WAIT 0.5 SEC;\n"
      "  MOVE PTP away;\n"
      "ENDPROGRAM;\n"
      "]]}\n"
      "local c = far:check_run{robot = arm}\n"
      "assert(not c.correct and c.faults[1].kind == \"reach\" and c.faults[1].line == 6)");
  c.params = {self("program")};
  for (ParamSpec& p : check_params()) c.params.push_back(std::move(p));
  c.params.push_back(between(defaulted("most", "int", "", std::int64_t{200},
                                       "Greatest number of faults, motions, targets and lines "
                                       "listed; left_out counts the others."),
                             1, 100000));
  c.params.push_back(optional("picture", "path", "", "A picture of the tool's path, *.png."));
  c.params.push_back(optional("plot", "path", "", "A plot over time: *.svg, *.png or *.pdf."));
  c.params.push_back(defaulted("record", "bool", "", false, "Keeps the run as a recording."));
  for (ParamSpec& p : picture_params(
           {.has_mass = false, .has_parts = false, .has_members = true, .has_fading = true}))
    c.params.push_back(std::move(p));
  c.returns = {
      "map",
      "",
      "",
      {field("correct", "bool", "", "Whether there are no errors."),
       field("errors", "int", "", "Number of errors."),
       field("warnings", "int", "", "Number of warnings."),
       field("notes", "int", "", "Number of notes."),
       field("faults", "list", "",
             "Tables, errors first: severity, kind (reach, joint_limit, speed, acceleration, "
             "torque, contact, clearance, singularity, configuration, motion, controller, signal, "
             "timeout, grip, until, program, ignored); file, line, column; message and hint; "
             "process, calls (innermost first), run (how often its line had started), times; time, "
             "from and to [s]; robot, joint, value, limit, excess and unit; bodies a and b; "
             "signals; position [m]; text, a sentence with all of this; fault."),
       field("cycle_time", "map", "",
             "total, moving, waiting [s]; complete; slowed, motions slowed by the controller's "
             "speed limits; lines, one table each: file, line, motions, duration."),
       field("motions", "list", "",
             "Tables, as carried out: file, line, run, kind, robot, start, duration, end, "
             "speed_share (of the joints' velocity limits), clearance, nearest, condition, "
             "manipulability, worst."),
       field("targets", "list", "",
             "Values of computed targets: file, line, run, time, position, pose, q, reached."),
       field("statements", "int", "", "Statements of the program."),
       field("statements_run", "int", "", "Statements that ran."),
       field("not_run", "list", "",
             "Lines that did not run: file, from, to, routine, never_called."),
       field("not_checked", "list", "", "What could not be checked, one sentence each."),
       field("thresholds", "map", "", "clearance, touch [m], condition, sample_time [s]."),
       field("left_out", "map", "", "Number of rows missing in each list; empty: none."),
       field("report", "string", "", "One line for each error and warning."),
       field("picture", "string", "", "The file."), field("plot", "string", "", "The file."),
       field("recording", "handle", "", "The run.")}};
  c.effect = Effect::simulates;
  // With `robot` it makes a world in a transaction that nobody commits.
  // Plots of pixels are drawn by another program.
  c.sometimes = Effects(Effect::files_write) | Effect::edits | Effect::processes;
  c.run = check;
  c.runs = RunKind::task;
  return {std::move(c)};
}

}  // namespace robomosp::ioci
