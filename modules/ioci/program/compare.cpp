// SPDX-License-Identifier: Apache-2.0
// One program for several controllers side by side: by the lines of its source, what each says,
// what one cannot say or says otherwise, and whether the points are the same when the code is read
// back.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <variant>

#include <robomosp/sdk/post_axes.h>
#include <robomosp/sdk/post_writer.h>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/program/compiled.h"
#include "ioci/program/post_cell.h"
#include "ioci/program/post_profile.h"
#include "ioci/program/program_files.h"
#include "ioci/program/program_kind.h"
#include "ioci/program/read_back.h"
#include "ioci/program/rows.h"
#include "ioci/program/source_text.h"
#include "program/state.h"
#include "program/trace.h"
#include "program_post/part_of_robot.h"

namespace robomosp::ioci {
namespace {

constexpr double kSameMm = 0.01, kSameDegrees = 0.01, kSameSpeed = 0.01;

/// What languages say otherwise than IRL, which has PTP speeds and C_PTP in % and C_CP in mm.
/// Nothing = the same.
struct Units {
  std::string_view target;
  const char *speed_ptp, *blend_ptp, *blend_cp;
};
constexpr Units kUnits[] = {{"krl", nullptr, nullptr, nullptr},
                            {"rapid", "mm/s of the tool", "mm (zones)", nullptr},
                            {"urscript", "rad/s", "mm (radii)", nullptr},
                            {"fanuc_tp", nullptr, "CNT of 0 to 100", "CNT of 0 to 100"},
                            {"melfa4", nullptr, "mm (Cnt)", nullptr},
                            {"melfa5", nullptr, "mm (Cnt)", nullptr},
                            {"val3", nullptr, "mm (leave and reach)", nullptr},
                            {"gcode", "nothing, since G0 is as fast as the machine",
                             "mm of tolerance (G64)", "mm of tolerance (G64)"}};
constexpr Units kAsIrl{"the program", nullptr, nullptr, nullptr};
/// Of others nothing is known, so that they are like none.
Units units_of(std::string_view target) {
  for (const Units& u : kUnits)
    if (u.target == target) return u;
  return {target, "units of its own", "units of its own", "units of its own"};
}
bool same_unit(const char* a, const char* b) {
  return a == b ||
         (a && b && std::string_view(a) == b && std::string_view(a) != "units of its own");
}

/// A target of a motion as a program reaches it.
struct Reached {
  std::uint32_t line = 0;
  std::uint32_t interpolation = RMP_MOVE_PTP;
  bool is_joints = false, is_place = false;
  bool is_step = false;  ///< from where only the run knows, by mm and turn in the base's axes
  bool has_until = false;
  std::array<double, 3> mm{};
  std::array<double, 4> turn{1, 0, 0, 0};
  program::PlainPose tool;     ///< on the flange
  std::vector<double> joints;  ///< [degrees, mm]
  std::optional<std::int32_t> status;
  double speed = 0;  ///< of paths [mm/s], of PTP [%]
  double c_cp = 0, c_ptp = 0;
  std::vector<double> additional;  ///< joints of the world by number [degrees or mm], if there are
};
/// How a program counts additional joints of the world.
struct Carried {
  const program_post::Carrier* carrier = nullptr;  ///< null = it has none
  std::span<const PostAxis> axes;  ///< external ones of a controller, in its order; empty = own
  bool is_controllers = false;     ///< they are read back
  bool is_on_carriage = false;     ///< it measures poses from the carriage
  bool has_no_additional = false;  ///< zeros only fill the type (R_NADDJ := 0)
  /// Puts joints where a target says.
  void set(const program::Target& t, bool is_step, std::vector<double>& now) const {
    for (std::size_t k = 0; k < t.additional.size(); ++k) {
      if (has_no_additional && t.additional[k] == 0) continue;
      std::size_t number = k;
      program_post::CarriedAxis counted;
      if (is_controllers && !axes.empty()) {
        if (k >= axes.size()) continue;
        number = static_cast<std::size_t>(axes[k].joint);
        counted.sign = axes[k].sign, counted.offset = axes[k].offset;
      } else if (!is_controllers) {
        for (const program_post::CarriedAxis& a : carrier->axes)
          if (a.number == k + 1) counted = a;
      }
      if (number >= now.size()) now.resize(number + 1, 0.0);
      const double v = program_post::joint_of(counted, t.additional[k], is_step);
      now[number] = is_step ? now[number] + v : v;
    }
  }
};
program::PlainPose plain_pose(const Pose& p) {
  program::PlainPose out;
  out.position = {p.p[0] * 1000, p.p[1] * 1000, p.p[2] * 1000};
  out.quaternion = post::quaternion(p.R);
  return out;
}
const char* compared_motion_word(std::uint32_t interpolation) {
  switch (interpolation) {
    case RMP_MOVE_LIN: return "LIN";
    case RMP_MOVE_CIRCLE: return "CIRCLE";
    case RMP_MOVE_PATH: return "PATH";
    default: return "PTP";
  }
}

/// Whether a motion stops at its target all the same: nothing that moves follows at once.
bool stops(const program::Trace& t, std::size_t i) {
  if (std::get<program::TracedMotion>(t.entries[i].what).until) return true;
  for (std::size_t k = i + 1; k < t.entries.size(); ++k) {
    if (t.entries[k].process != t.entries[i].process) continue;
    const auto* next = std::get_if<program::TracedMotion>(&t.entries[k].what);
    return !next || next->until;
  }
  return true;
}
/// `cell`: what a world says of targets and tool, which a controller's program says itself.
std::vector<Reached> reached(const program::Trace& t, const program_post::CellPlaces& cell,
                             const Carried& carried) {
  std::vector<Reached> out;
  std::vector<double> additional;
  if (carried.carrier)
    for (const program_post::CarriedAxis& a : carried.carrier->axes) {
      additional.resize(std::max(additional.size(), a.number), 0.0);
      additional[a.number - 1] = a.start;
    }
  program::PlainPose base_T_frame = plain_pose(cell.frame.value_or(Pose{}));
  const program::PlainPose flange_T_tool = plain_pose(cell.tool.value_or(Pose{}));
  for (std::size_t i = 0; i < t.entries.size(); ++i) {
    const program::TraceEntry& e = t.entries[i];
    const auto* m = std::get_if<program::TracedMotion>(&e.what);
    if (!m) continue;
    const bool is_end = stops(t, i);
    if (carried.carrier)
      for (const program::Target& target : m->motion.targets)
        carried.set(target, m->motion.is_incremental, additional);
    if (carried.carrier && carried.is_on_carriage)
      base_T_frame = plain_pose(program_post::carriage_at(*carried.carrier, additional));
    for (std::size_t k = 0; k < m->motion.targets.size(); ++k) {
      const program::Target& target = m->motion.targets[k];
      Reached one;
      one.additional = additional;
      one.line = e.span.line;
      one.interpolation = m->motion.interpolation;
      one.tool = m->motion.attributes.tool.value_or(flange_T_tool);
      const auto& a = m->motion.attributes;
      const bool is_ptp = one.interpolation == RMP_MOVE_PTP;
      one.has_until = m->until.has_value();
      // Where a time is given, the speed is what comes of it.
      one.speed = a.time > 0 ? -1 : is_ptp ? a.speed_ptp : a.speed;
      one.c_cp = is_ptp || is_end ? 0 : a.c_cp;
      one.c_ptp = is_ptp && !is_end ? a.c_ptp : 0;
      const bool is_known = k < m->absolute.size() && m->absolute[k];
      if (!is_known && m->motion.is_incremental && target.joints.empty()) {
        program::PlainPose by = target.pose;
        if (target.role == RMP_ROLE_POSITION) by.quaternion = {1, 0, 0, 0};
        if (a.frame) {
          program::PlainPose f = *a.frame;
          f.position = {0, 0, 0};
          by = program::compose_poses(program::compose_poses(f, by), program::inverse_pose(f));
        }
        program::PlainPose base = base_T_frame;
        base.position = {0, 0, 0};
        by = program::compose_poses(program::compose_poses(base, by), program::inverse_pose(base));
        one.is_step = true;
        one.mm = by.position, one.turn = by.quaternion;
      } else if (is_known || target.role == RMP_ROLE_POSITION) {
        const program::PlainPose p =
            program::compose_poses(base_T_frame, is_known ? *m->absolute[k] : target.pose);
        one.is_place = target.role == RMP_ROLE_POSITION;
        one.mm = p.position, one.turn = p.quaternion;
        if (target.role == RMP_ROLE_ROBTARGET && target.status >= 0) one.status = target.status;
      } else {
        one.is_joints = true;
        one.joints = target.joints;
      }
      out.push_back(std::move(one));
    }
  }
  return out;
}

/// An output that gets a value, or a wait for a time.
struct Deed {
  std::uint32_t line = 0;
  bool is_wait = false;
  std::int32_t address = 0;
  std::string name;
  bool is_real = false;
  double value = 0;  ///< [s] of a wait
};
/// Outputs of several bits are these bits, unless `whole`.
std::vector<Deed> deeds(const program::Trace& t, bool whole) {
  const rmp_code& c = t.program->code();
  std::vector<Deed> out;
  for (const program::TraceEntry& e : t.entries) {
    Deed one;
    one.line = e.span.line;
    if (const auto* w = std::get_if<program::TracedWrite>(&e.what)) {
      const auto& s = row_of<rmp_code_symbol>(c.symbols, w->symbol);
      one.address = s.address, one.name = s.name, one.is_real = s.type == RMP_TYPE_REAL;
      one.value = one.is_real ? w->value.real : static_cast<double>(w->value.integer);
      if (s.type != RMP_TYPE_INT || s.width <= 1 || whole) {
        out.push_back(one);
        continue;
      }
      for (std::int32_t bit = 0; bit < s.width; ++bit) {
        one.address = s.address + bit;
        one.name = std::string(s.name) + " (bit " + std::to_string(bit) + ")";
        one.value = static_cast<double>((w->value.integer >> bit) & 1);
        out.push_back(one);
      }
    } else if (const auto* d = std::get_if<program::TracedWait>(&e.what)) {
      // Waits for conditions are said in many ways; those for a time in one.
      if (d->condition || d->seconds <= 0) continue;
      one.is_wait = true, one.value = d->seconds;
      out.push_back(one);
    }
  }
  return out;
}

/// How far two targets are apart.
struct Apart {
  bool is_comparable = false;
  double mm = 0, degrees = 0;
};
Apart apart(const Reached& a, const Reached& b) {
  Apart out;
  if (a.is_joints != b.is_joints || a.is_step != b.is_step) return out;
  if (a.is_joints) {
    if (a.joints.size() != b.joints.size()) return out;
    out.is_comparable = true;
    for (std::size_t k = 0; k < a.joints.size(); ++k)
      out.degrees = std::max(out.degrees, std::fabs(a.joints[k] - b.joints[k]));
    return out;
  }
  out.is_comparable = true;
  out.mm = std::hypot(a.mm[0] - b.mm[0], a.mm[1] - b.mm[1], a.mm[2] - b.mm[2]);
  if (a.is_place || b.is_place) return out;
  double dot = 0;
  for (std::size_t k = 0; k < 4; ++k) dot += a.turn[k] * b.turn[k];
  out.degrees = 2 * std::acos(std::min(1.0, std::fabs(dot))) * kDegreesPerRadian;
  return out;
}

struct Line {
  std::string file;
  std::size_t number = 0;
  std::string text;
};
struct SideFault {
  std::string severity, file, message, hint;
  std::uint32_t line = 0;
};
struct Side {
  std::string target, title, profile, form;
  ProviderInfo info;
  std::string label;  ///< what was asked for: the target, or the controller
  bool is_correct = false;
  std::vector<std::pair<std::string, std::string>> files;
  /// Lines by the file and line of the source; line 0 = of no line.
  std::map<std::pair<std::string, std::uint32_t>, std::vector<Line>> lines;
  std::map<std::pair<std::string, std::size_t>, std::pair<std::string, std::uint32_t>>
      source_of;  ///< the same the other way
  std::vector<SideFault> faults;
  std::string reader, not_read;     ///< which reads it back, or why none did
  std::vector<SideFault> not_said;  ///< what the reader could not say: at lines of the source
  std::vector<Reached> reached;
  std::shared_ptr<ControllerProfile> axes;  ///< how the controller counts the robot's
  std::vector<Deed> bits, whole;
  Units units{};
  std::size_t compared = 0;  ///< with the program
  double most_mm = 0, most_degrees = 0;
  PostCapabilities capabilities;
};

struct Difference {
  std::string kind;  ///< cannot, otherwise, missing, form, unread, motion, point, additional,
                     ///< configuration, speed, blend, output
  std::string file;
  std::uint32_t line = 0;
  std::size_t side = 0;
  std::string text;
};

const rmp_code_symbol* input_named(const rmp_code& code, std::string_view name) {
  const std::string wanted = post::upper(name);
  for (std::uint32_t i = 0; i < code.symbols.count; ++i)
    if (const auto& s = row_of<rmp_code_symbol>(code.symbols, i);
        s.kind == RMP_SYMBOL_INPUT && post::upper(s.name) == wanted)
      return &s;
  return nullptr;
}
/// Values of the program's inputs as those of what was read back: the same line of the controller
/// may have another name there.
program::TraceOptions inputs_of(const rmp_code& program, const program::TraceOptions& options,
                                const rmp_code& read) {
  program::TraceOptions out = options;
  out.inputs.clear();
  for (const auto& [name, value] : options.inputs) {
    if (const rmp_code_symbol* same = input_named(read, name)) {
      out.inputs[same->name] = value;
      continue;
    }
    const rmp_code_symbol* own = input_named(program, name);
    for (std::uint32_t i = 0; own && i < read.symbols.count; ++i)
      if (const auto& s = row_of<rmp_code_symbol>(read.symbols, i);
          s.kind == RMP_SYMBOL_INPUT && s.type == own->type && s.address == own->address)
        out.inputs[s.name] = value;
  }
  return out;
}

/// Runs through what an independent reader makes of the files.
Result<void> read_back(CommandContext& ctx, const rmp_code& program, const PostCell& cell,
                       const program::TraceOptions& options, Side& side) {
  RMP_TRY_ASSIGN(const ReadBack read,
                 read_posted(ctx, side.files, side.axes ? &side.axes->record : nullptr));
  side.not_read = read.not_read;
  // What it could not say is told; all the rest is compared.
  for (const ReadBack::Unread& u : read.not_said) {
    SideFault told{"error", "", u.message, "", 0};
    if (const auto at = side.source_of.find({u.file, u.line}); at != side.source_of.end())
      std::tie(told.file, told.line) = at->second;
    side.not_said.push_back(std::move(told));
  }
  if (!read.program) return {};
  auto traced = program::trace(read.program, inputs_of(program, options, read.program->code()),
                               &ctx.progress);
  if (!traced.ok()) {
    if (traced.error().code == ErrorCode::cancelled) return std::move(traced).error();
    side.not_read = "as reader " + read.reader +
                    " has it, it cannot be run through: " + traced.error().sentence();
    return {};
  }
  side.reader = read.reader;
  std::vector<PostAxis> externals;
  Carried carried;
  if (cell.carrier) {
    carried.carrier = &*cell.carrier;
    carried.is_controllers = true;
    carried.has_no_additional = cell_number(read.program->code(), "R_NADDJ", 1) == 0;
    RMP_TRY_ASSIGN(const auto kind, rail_kind(side.info, side.capabilities, side.axes->view));
    carried.is_on_carriage = cell.is_on_rail() && kind != program_post::RailKind::base;
    for (const PostAxis& a : side.axes->axes)
      if (a.external && a.of_robot == 0 && a.joint >= 0) externals.push_back(a);
    carried.axes = externals;
  }
  side.reached = reached(*traced, {}, carried);
  if (counts_maker_axes(read.program->code()) && side.axes)
    for (Reached& r : side.reached) {
      if (!r.is_joints || r.joints.empty()) continue;
      const auto& axes = side.axes->view.axes;
      std::size_t count = r.joints.size();
      for (const PostAxis& a : axes)
        if (is_of_robot(a) && a.joint >= 0)
          count = std::max(count, static_cast<std::size_t>(a.joint) + 1);
      const auto q = joints_from_axes(axes, r.joints, std::vector<double>(count, 0.0), nullptr);
      if (!q) continue;
      r.joints = *q;
      for (std::size_t j = 0; j < q->size(); ++j)
        for (const PostAxis& a : axes)
          if (a.joint == static_cast<std::int32_t>(j))
            r.joints[j] = (*q)[j] * axis_scale(a, nullptr);
    }
  side.bits = deeds(*traced, false);
  side.whole = deeds(*traced, true);
  return {};
}

std::vector<std::string> split_lines(const std::string& text) {
  std::vector<std::string> out;
  for (std::string_view line : text::split(text, '\n')) {
    if (line.ends_with('\r')) line.remove_suffix(1);
    out.emplace_back(line);
  }
  while (!out.empty() && out.back().empty()) out.pop_back();
  return out;
}

Result<Side> post_side(CommandContext& ctx, const Map& args, const PostCell& cell,
                       const std::shared_ptr<const CompiledProgram>& program,
                       const std::string& symbol, const std::string& asked) {
  Side out;
  Map post{{"id", *args.find("id")}, {"check", true}, {"source_map", true}};
  if (const auto profile = ctx.snapshot().find(controller_kind(), asked)) {
    post.set("profile", Application::handle(*profile));
    out.profile = asked;
  } else {
    post.set("target", Value(asked));
  }
  for (const char* each : {"robot", "world", "name_there", "form", "inputs"})
    if (has(args, each)) post.set(each, *args.find(each));
  out.axes = std::make_shared<ControllerProfile>();
  if (const auto profile = ctx.snapshot().find(controller_kind(), asked)) {
    const model::Record* r = ctx.snapshot().find(*profile);
    out.axes->name = r->name;
    out.axes->record = std::get<model::OtherContent>(r->body).as<model::Controller>();
  }
  RMP_TRY(out.axes->fill());
  if (cell.is_placed) {
    // Each side owns the names of its axes.
    RMP_TRY_ASSIGN(PostCell own, post_cell(ctx, args, program, symbol));
    RMP_TRY(out.axes->use(std::move(own.maker), own.robot_name, own.rail));  // the post tells
  } else if (has(args, "robot")) {
    RMP_TRY_ASSIGN(auto maker, robotics::MakerAxes::of(content<model::Robot>(ctx, args, "robot")));
    RMP_TRY(out.axes->use(std::move(maker), name_in(ctx, ref(args, "robot")),
                          cell.rail));  // the post tells
  }
  RMP_TRY_ASSIGN(const Value found, ctx.dispatch("program.post", post));
  const Map& map = *found.as_map();
  out.target = *map.find("target")->as_string();
  out.label = out.profile.empty() ? out.target : out.profile;
  out.form = *map.find("form")->as_string();
  out.is_correct = *map.find("correct")->as_bool();
  RMP_TRY_ASSIGN(const auto made, ctx.app.registry.create<Post>(out.target));
  out.capabilities = made->capabilities();
  RMP_TRY_ASSIGN(out.info, ctx.app.registry.find(Post::kInterfaceId, out.target));
  if (cell.carrier) {
    RMP_TRY_ASSIGN(const auto kind, rail_kind(out.info, out.capabilities, out.axes->view));
    if (kind != program_post::RailKind::none) carry_axes(*out.axes, cell);
  }
  out.title = std::string(out.capabilities.title);
  for (const Value& each : *map.find("faults")->as_list()) {
    const Map& f = *each.as_map();
    out.faults.push_back({*f.find("severity")->as_string(), *f.find("file")->as_string(),
                          *f.find("message")->as_string(), *f.find("hint")->as_string(),
                          static_cast<std::uint32_t>(*f.find("line")->as_int())});
  }
  for (const Value& each : *map.find("files")->as_list()) {
    const Map& f = *each.as_map();
    out.files.emplace_back(*f.find("name")->as_string(), *f.find("text")->as_string());
  }
  out.units = units_of(out.target);
  auto& source = out.source_of;
  for (const Value& each : *map.find("source_map")->as_list()) {
    const Map& l = *each.as_map();
    source[{*l.find("file")->as_string(), static_cast<std::size_t>(*l.find("line")->as_int())}] = {
        *l.find("source")->as_string(),
        static_cast<std::uint32_t>(*l.find("source_line")->as_int())};
  }
  for (const auto& [name, text] : out.files) {
    const std::vector<std::string> lines = split_lines(text);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const auto at = source.find({name, i + 1});
      const auto key =
          at == source.end() ? std::pair<std::string, std::uint32_t>{"", 0} : at->second;
      out.lines[key].push_back({name, i + 1, lines[i]});
    }
  }
  return out;
}

struct Comparison {
  std::vector<Side> sides;
  std::vector<std::pair<std::string, std::vector<std::string>>> source;  ///< files and their lines
  std::vector<Difference> differences;
  std::vector<Reached> reached;  ///< of the source
  std::vector<Deed> bits, whole;
  std::string not_traced;
  std::vector<std::string> not_compared;  ///< sentences
  std::size_t compared = 0;               ///< targets of which two sides or more were read back
  double most_mm = 0, most_degrees = 0;
};

std::string at_speed(const Reached& r) {
  return text::print_rounded(r.speed, 4) + (r.interpolation == RMP_MOVE_PTP ? " %" : " mm/s");
}
std::string blend_words(const Reached& r) {
  if (r.interpolation == RMP_MOVE_PTP)
    return r.c_ptp > 0 ? "C_PTP " + text::print_rounded(r.c_ptp, 4) + " %" : "no C_PTP";
  return r.c_cp > 0 ? "C_CP " + text::print_rounded(r.c_cp, 4) + " mm" : "no C_CP";
}

/// A program of motions as one of two.
struct Moves {
  std::string of;
  const std::vector<Reached>* all = nullptr;
  Units units;
};
/// What two programs of motions differ in; `count` gets how many points, and how far apart.
void compare_motions(Comparison& c, const std::string& file, const Moves& left, const Moves& right,
                     std::size_t side, std::size_t& count, double& most_mm, double& most_degrees) {
  const std::vector<Reached>&a = *left.all, &b = *right.all;
  const std::string &of_a = left.of, &of_b = right.of;
  std::set<std::pair<std::string, std::uint32_t>> told;
  const auto tell = [&](const char* kind, std::uint32_t line, std::string text) {
    if (told.emplace(kind, line).second)
      c.differences.push_back({kind, file, line, side, std::move(text)});
  };
  if (a.size() != b.size())
    tell("motion", 0,
         of_a + " comes to " + std::to_string(a.size()) + " targets, " + of_b + " to " +
             std::to_string(b.size()) + "; the first " +
             std::to_string(std::min(a.size(), b.size())) + " are compared");
  std::array<bool, 3> not_alike{};
  const auto unlike = [&](std::size_t which, const char* what, const char* of_irl, const char* in_a,
                          const char* in_b) {
    if (std::exchange(not_alike[which], true)) return;
    c.not_compared.push_back(std::string(what) + " of " + of_a + " and " + of_b + ": " + of_a +
                             " says " + (in_a ? in_a : of_irl) + ", " + of_b + " " +
                             (in_b ? in_b : of_irl) + ".");
  };
  for (std::size_t k = 0; k < a.size() && k < b.size(); ++k) {
    // The lines of the source are those of its own trace, which is in the same order.
    const std::uint32_t line = k < c.reached.size() ? c.reached[k].line : 0;
    if (a[k].interpolation != b[k].interpolation) {
      tell("motion", line,
           of_a + " goes by " + compared_motion_word(a[k].interpolation) + ", " + of_b + " by " +
               compared_motion_word(b[k].interpolation));
      continue;
    }
    if (a[k].has_until != b[k].has_until)
      tell("motion", line,
           (a[k].has_until ? of_a : of_b) + " ends early by a condition, " +
               (a[k].has_until ? of_b : of_a) + " goes to its target");
    const Apart d = apart(a[k], b[k]);
    if (!d.is_comparable) {
      const auto word = [](const Reached& r) {
        return r.is_joints ? std::to_string(r.joints.size()) + " joints"
               : r.is_step ? std::string("a step from where it is")
                           : std::string("a place");
      };
      tell("point", line, of_a + " gives " + word(a[k]) + ", " + of_b + " " + word(b[k]));
    } else {
      ++count;
      most_mm = std::max(most_mm, d.mm);
      most_degrees = std::max(most_degrees, d.degrees);
      if (d.mm > kSameMm || d.degrees > kSameDegrees)
        tell("point", line,
             "the target in " + of_a + " is " + text::print_rounded(d.mm, 4) + " mm and " +
                 text::print_rounded(d.degrees, 4) + " degrees from that in " + of_b);
    }
    for (std::size_t n = 0; n < a[k].additional.size() && n < b[k].additional.size(); ++n)
      if (std::fabs(a[k].additional[n] - b[k].additional[n]) > kSameMm)
        tell("additional", line,
             "additional joint " + std::to_string(n + 1) + " goes to " +
                 text::print_rounded(a[k].additional[n], 6) + " in " + of_a + " and to " +
                 text::print_rounded(b[k].additional[n], 6) + " in " + of_b);
    if (a[k].status && b[k].status && *a[k].status != *b[k].status)
      tell("configuration", line,
           of_a + " says configuration " + std::to_string(*a[k].status) + ", " + of_b + " " +
               std::to_string(*b[k].status));
    else if (a[k].status.has_value() != b[k].status.has_value() && !a[k].is_joints)
      tell("configuration", line,
           (a[k].status ? of_a : of_b) + " fixes the configuration (" +
               std::to_string(a[k].status ? *a[k].status : *b[k].status) + "), " +
               (a[k].status ? of_b : of_a) + " leaves it to the controller");
    if (!a[k].is_joints && !b[k].is_joints) {
      Reached one, other;
      one.mm = a[k].tool.position, one.turn = a[k].tool.quaternion;
      other.mm = b[k].tool.position, other.turn = b[k].tool.quaternion;
      if (const Apart t = apart(one, other); t.mm > kSameMm || t.degrees > kSameDegrees) {
        most_mm = std::max(most_mm, t.mm);
        most_degrees = std::max(most_degrees, t.degrees);
        tell("point", line,
             "the tool in " + of_a + " is " + text::print_rounded(t.mm, 4) + " mm and " +
                 text::print_rounded(t.degrees, 4) + " degrees from that in " + of_b);
      }
    }
    const bool is_ptp = a[k].interpolation == RMP_MOVE_PTP;
    if (a[k].speed >= 0 && b[k].speed >= 0) {
      if (is_ptp && !same_unit(left.units.speed_ptp, right.units.speed_ptp))
        unlike(0, "Speeds of PTP", "% of the greatest", left.units.speed_ptp,
               right.units.speed_ptp);
      else if (std::fabs(a[k].speed - b[k].speed) > kSameSpeed * std::max(a[k].speed, b[k].speed))
        tell("speed", line,
             of_a + " goes at " + at_speed(a[k]) + ", " + of_b + " at " + at_speed(b[k]));
    }
    if (is_ptp && !same_unit(left.units.blend_ptp, right.units.blend_ptp)) {
      if ((a[k].c_ptp > 0) != (b[k].c_ptp > 0))
        tell("blend", line,
             (a[k].c_ptp > 0 ? of_a : of_b) + " goes on without a stop, " +
                 (a[k].c_ptp > 0 ? of_b : of_a) + " has no blend, as it was read back");
      if (a[k].c_ptp > 0 || b[k].c_ptp > 0)
        unlike(1, "How far PTP motions blend", "% (C_PTP)", left.units.blend_ptp,
               right.units.blend_ptp);
    } else if (!is_ptp && !same_unit(left.units.blend_cp, right.units.blend_cp)) {
      if (a[k].c_cp > 0 || b[k].c_cp > 0)
        unlike(2, "How far motions along paths blend", "mm (C_CP)", left.units.blend_cp,
               right.units.blend_cp);
    } else if (std::fabs(a[k].c_cp - b[k].c_cp) > 0.01 * std::max(a[k].c_cp, b[k].c_cp) ||
               std::fabs(a[k].c_ptp - b[k].c_ptp) > 0.01 * std::max(a[k].c_ptp, b[k].c_ptp)) {
      tell("blend", line,
           of_a + " has " + blend_words(a[k]) + ", " + of_b + " " + blend_words(b[k]));
    }
  }
}

/// Outputs and times of a program and what was read back, one for one. A controller may number its
/// outputs otherwise, but each is always the same one.
void compare_deeds(Comparison& c, const std::string& file, Side& read, std::size_t side) {
  const bool whole = c.bits.size() != read.bits.size() && c.whole.size() == read.whole.size();
  const std::vector<Deed>& a = whole ? c.whole : c.bits;
  const std::vector<Deed>& b = whole ? read.whole : read.bits;
  std::map<std::pair<std::int32_t, bool>, std::pair<std::int32_t, std::string>> known;
  std::set<std::uint32_t> told;
  const auto tell = [&](std::uint32_t line, std::string text) {
    if (told.insert(line).second)
      c.differences.push_back({"output", file, line, side, std::move(text)});
  };
  const auto word = [](const Deed& d) {
    return d.is_wait ? "waits " + text::print_rounded(d.value, 6) + " s"
                     : "sets output " + d.name + " to " + text::print_rounded(d.value, 6);
  };
  for (std::size_t k = 0; k < a.size() && k < b.size(); ++k) {
    bool is_same =
        a[k].is_wait == b[k].is_wait && a[k].is_real == b[k].is_real &&
        std::fabs(a[k].value - b[k].value) <= 1e-3 * std::max(1.0, std::fabs(a[k].value));
    if (is_same && !a[k].is_wait) {
      const auto it =
          known.try_emplace({a[k].address, a[k].is_real}, std::pair{b[k].address, b[k].name}).first;
      is_same = it->second == std::pair{b[k].address, b[k].name};
    }
    if (is_same) continue;
    tell(a[k].line, "the program " + word(a[k]) + ", " + read.label + " " + word(b[k]) +
                        (read.not_said.empty() ? "" : ", as it was read back"));
    // Behind it nothing stands at its place.
    return;
  }
  if (a.size() != b.size())
    tell(a.size() > b.size() ? a[b.size()].line : 0,
         "the program has " + std::to_string(a.size()) + " outputs and waits for a time, " +
             read.label + " as it was read back " + std::to_string(b.size()));
}

/// Values of inputs, of those that the program has, each of its type.
Result<std::map<std::string, program::SignalValue>> input_values(const rmp_code& code,
                                                                 const Map& given) {
  std::map<std::string, program::SignalValue> out;
  std::vector<std::string> names;
  for (std::uint32_t i = 0; i < code.symbols.count; ++i)
    if (const auto& s = row_of<rmp_code_symbol>(code.symbols, i); s.kind == RMP_SYMBOL_INPUT)
      names.emplace_back(s.name);
  for (const auto& [name, value] : given) {
    const rmp_code_symbol* symbol = input_named(code, name);
    if (!symbol) {
      if (names.empty())
        return error(ErrorCode::invalid_argument,
                     "the program has no input " + text::quote(name) + ", and no others",
                     "Leave inputs out.", "inputs");
      Error e = unknown_name("input", name, names);
      e.where = "inputs";
      return e;
    }
    const bool* is_on = value.as_bool();
    const auto* integer = value.as_int();
    const double* number = value.as_real();
    const auto wrong = [&](const char* type, const char* such) {
      return error(
          ErrorCode::invalid_argument,
          "input " + text::quote(symbol->name) + " is a " + type + ", and not " + value.text(),
          "Such as inputs = {" + std::string(symbol->name) + " = " + such + "}.", "inputs");
    };
    program::SignalValue v;
    if (symbol->type == RMP_TYPE_BOOL) {
      if (!is_on) return wrong("BOOL", "true");
      v = {*is_on ? 1 : 0, *is_on ? 1.0 : 0.0};
    } else if (symbol->type == RMP_TYPE_INT) {
      const bool is_whole = number && std::floor(*number) == *number && std::fabs(*number) < 1e9;
      if (!integer && !is_whole) return wrong("INT", "3");
      const std::int64_t whole = integer ? *integer : std::llround(*number);
      v = {whole, static_cast<double>(whole)};
    } else {
      if (!integer && !(number && std::fabs(*number) < 1e9)) return wrong("REAL", "2.5");
      const double x = number ? *number : static_cast<double>(*integer);
      v = {std::llround(x), x};
    }
    out[name] = v;
  }
  return out;
}

Result<Comparison> compared(CommandContext& ctx, const Map& args,
                            const std::vector<std::string>& targets) {
  Comparison out;
  RMP_TRY_ASSIGN(const Compiled made, compile_whole(ctx, args));
  const model::Program& p = program_of(ctx, args);
  for (std::size_t i = 0; i < p.files.size(); ++i)
    out.source.emplace_back(p.files[i].name, p.files[i].lines);
  const std::string main_file = p.files.front().name;
  program::TraceOptions options;
  if (const Value* given = args.find("inputs"); given && given->as_map()) {
    RMP_TRY_ASSIGN(options.inputs, input_values(made.code(), *given->as_map()));
  }
  const auto moved = program_post::robots_that_move(made.code());
  const std::string symbol = moved.size() == 1 ? moved.front() : std::string();
  RMP_TRY_ASSIGN(const PostCell cell, post_cell(ctx, args, made.program, symbol));
  Carried carried;
  if (cell.carrier) {
    carried.carrier = &*cell.carrier;
    carried.has_no_additional = cell.carrier->has_no_additional;
  }
  auto traced = program::trace(made.program, options, &ctx.progress);
  if (traced.ok())
    out.reached = reached(*traced, cell.places, carried), out.bits = deeds(*traced, false),
    out.whole = deeds(*traced, true);
  else if (traced.error().code == ErrorCode::cancelled) return std::move(traced).error();
  else out.not_traced = traced.error().sentence();
  for (const std::string& each : targets) {
    RMP_TRY_ASSIGN(Side side, post_side(ctx, args, cell, made.program, symbol, each));
    if (side.is_correct && !side.files.empty()) {
      RMP_TRY(read_back(ctx, made.code(), cell, options, side));
    } else if (!side.is_correct) {
      side.not_read = "it cannot be posted";
    }
    out.sides.push_back(std::move(side));
  }
  for (std::size_t s = 0; s < out.sides.size(); ++s) {
    const Side& side = out.sides[s];
    for (const SideFault& f : side.faults)
      out.differences.push_back(
          {f.severity == "error" ? "cannot" : "otherwise", f.file, f.line, s,
           side.label + ": " + f.message + (f.hint.empty() ? "" : " " + f.hint)});
    if (s > 0 && side.is_correct && out.sides[0].is_correct && side.form != out.sides[0].form)
      out.differences.push_back({"form", main_file, 0, s,
                                 out.sides[0].label + " is " + out.sides[0].form + ", " +
                                     side.label + " is " + side.form});
    if (side.reader.empty()) continue;
    for (const SideFault& f : side.not_said)
      out.differences.push_back({"unread", f.file.empty() ? main_file : f.file, f.line, s,
                                 side.target + " is read back without this: " + f.message});
    const Moves own{side.label, &side.reached, side.units};
    if (out.not_traced.empty()) {
      Side& to = out.sides[s];
      compare_motions(out, main_file, {"the program", &out.reached, kAsIrl}, own, s, to.compared,
                      to.most_mm, to.most_degrees);
      compare_deeds(out, main_file, to, s);
    }
    for (std::size_t o = 0; o < s; ++o)
      if (const Side& other = out.sides[o]; !other.reader.empty())
        compare_motions(out, main_file, {other.label, &other.reached, other.units}, own, s,
                        out.compared, out.most_mm, out.most_degrees);
  }
  // Lines that one says and another does not.
  for (const auto& [file, lines] : out.source)
    for (std::uint32_t l = 1; l <= lines.size(); ++l) {
      std::string with, without;
      for (const Side& side : out.sides) {
        if (!side.is_correct) continue;
        std::string& list = side.lines.contains({file, l}) ? with : without;
        list += (list.empty() ? "" : ", ") + side.label;
      }
      if (!with.empty() && !without.empty())
        out.differences.push_back(
            {"missing", file, l, 0,
             with + " has lines for it, " + without + " has none of its own"});
    }
  std::stable_sort(out.differences.begin(), out.differences.end(),
                   [](const Difference& a, const Difference& b) {
                     return std::tie(a.file, a.line) < std::tie(b.file, b.line);
                   });
  return out;
}

// ---- as text, Markdown, HTML ----

constexpr const char* kSpeedWords[] = {"mm/s", "m/s", "mm/min", "percent", "time"};
constexpr const char* kBlendWords[] = {"none", "distance", "percent", "radius", "zone", "accuracy"};
struct Convention {
  std::string what;
  std::vector<std::string> of;
};
std::vector<Convention> conventions(const Comparison& c) {
  std::vector<Convention> out{{"language", {}}, {"form", {}},         {"speed of paths", {}},
                              {"blending", {}}, {"longest name", {}}, {"additional axes", {}},
                              {"profile", {}},  {"posted", {}},       {"read back by", {}}};
  for (const Side& s : c.sides) {
    const PostCapabilities& k = s.capabilities;
    std::size_t errors = 0;
    for (const SideFault& f : s.faults) errors += f.severity == "error";
    const std::string values[] = {
        s.title,
        s.form,
        kSpeedWords[std::clamp(static_cast<int>(k.speed), 0, 4)],
        kBlendWords[std::clamp(static_cast<int>(k.blending), 0, 5)],
        k.max_name > 0 ? std::to_string(k.max_name) : "any",
        std::to_string(k.external_axes),
        s.profile.empty() ? "none" : s.profile,
        s.is_correct ? "yes"
                     : "no, " + std::to_string(errors) + (errors == 1 ? " error" : " errors"),
        s.reader.empty() ? "nobody: " + s.not_read : s.reader};
    for (std::size_t i = 0; i < out.size(); ++i) out[i].of.push_back(values[i]);
  }
  return out;
}
std::string far(double mm, double degrees) {
  return "at most " + text::print_rounded(mm, 3) + " mm and " + text::print_rounded(degrees, 3) +
         " degrees apart";
}
/// What was looked at, and what was not.
std::string points_sentence(const Comparison& c) {
  std::size_t read = 0;
  std::string out;
  for (const Side& s : c.sides) read += !s.reader.empty();
  if (read < 2)
    out = "The points of the targets are not compared with each other: " + std::to_string(read) +
          " of " + std::to_string(c.sides.size()) + (read == 1 ? " was" : " were") + " read back.";
  else if (c.compared == 0)
    out = "No points are compared: what was read back has no motions in common.";
  else
    out = std::to_string(c.compared) +
          " points read back and compared: " + far(c.most_mm, c.most_degrees) + ".";
  for (const Side& s : c.sides) {
    if (s.reader.empty()) {
      out += " Not looked at: " + s.label + ", since " + s.not_read +
             (s.not_read.ends_with('.') ? "" : ".");
      continue;
    }
    if (c.not_traced.empty())
      out += " " + s.label + " and the program: " + std::to_string(s.compared) + " of " +
             std::to_string(c.reached.size()) + " points, " + far(s.most_mm, s.most_degrees) + ".";
    if (!s.not_said.empty())
      out += " Of " + s.label + " the reader left " + std::to_string(s.not_said.size()) +
             (s.not_said.size() == 1 ? " thing" : " things") + " out; the rest is compared.";
  }
  if (!c.not_traced.empty())
    out += " The program itself is not compared: " + c.not_traced +
           (c.not_traced.ends_with('.') ? "" : ".");
  for (const std::string& s : c.not_compared) out += " Not compared: " + s;
  return out;
}
std::string place_of_difference(const Difference& d) {
  return d.line == 0 ? d.file : d.file + ":" + std::to_string(d.line);
}
std::set<std::uint32_t> lines_that_differ(const Comparison& c, const std::string& file,
                                          const char* kind) {
  std::set<std::uint32_t> out;
  for (const Difference& d : c.differences)
    if (d.file == file && (!kind || d.kind == kind)) out.insert(d.line);
  return out;
}

/// Columns of equal width; what is longer is cut with "~".
std::string cell(const std::string& s, std::size_t width) {
  if (s.size() <= width) return s + std::string(width - s.size(), ' ');
  return s.substr(0, width - 1) + "~";
}
std::string as_text(const Comparison& c, std::size_t width) {
  std::string out;
  for (const Convention& k : conventions(c)) {
    out += cell(k.what, 16);
    for (const std::string& v : k.of) out += "  " + v;
    out += "\n";
  }
  out += points_sentence(c) + "\n\n";
  for (const Difference& d : c.differences)
    out += place_of_difference(d) + ": " + d.kind + ": " + d.text + "\n";
  for (const auto& [file, lines] : c.source) {
    out += "\n=== " + file;
    for (const Side& s : c.sides) out += " | " + s.label;
    out += "\n";
    const auto differ = lines_that_differ(c, file, nullptr);
    for (std::uint32_t l = 0; l <= lines.size(); ++l) {
      std::size_t rows = l > 0 ? 1 : 0;
      std::vector<const std::vector<Line>*> of;
      for (const Side& s : c.sides) {
        const auto it = s.lines.find(l > 0 ? std::pair(file, l) : std::pair(std::string(), l));
        of.push_back(it == s.lines.end() || (l == 0 && file != c.source.front().first)
                         ? nullptr
                         : &it->second);
        if (of.back()) rows = std::max(rows, of.back()->size());
      }
      for (std::size_t r = 0; r < rows; ++r) {
        std::string row = r == 0 && l > 0 ? std::to_string(l) : "";
        row = std::string(row.size() < 4 ? 4 - row.size() : 0, ' ') + row +
              (r == 0 && differ.contains(l) && l > 0 ? "! " : "  ") +
              cell(r == 0 && l > 0 ? lines[l - 1] : "", width);
        for (const auto* side : of)
          row += " | " + cell(side && r < side->size() ? (*side)[r].text : "", width);
        while (row.ends_with(' ')) row.pop_back();
        out += row + "\n";
      }
    }
  }
  return out;
}

std::string html(std::string_view s) {
  std::string out;
  for (const char c : s) switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  return out;
}
std::string as_html(const Comparison& c, const std::string& title) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<title>" + html(title) +
      "</title>\n<style>\nbody{font:14px/1.4 sans-serif;margin:1.5em;color:#1d2330}\n"
      "h1{font-size:1.4em}h2{font-size:1.1em;margin-top:1.6em}\n"
      "table{border-collapse:collapse}td,th{text-align:left;vertical-align:top;padding:2px 10px;"
      "border-bottom:1px solid #e3e6ec}\n"
      "th{background:#f0f2f6;position:sticky;top:0}\n"
      "table.code td{font:12.5px/1.45 monospace;white-space:pre-wrap;overflow-wrap:anywhere}\n"
      "table.code{width:100%;table-layout:fixed}\n"
      "td.n,th.n{color:#7a8294;text-align:right;width:3.2em;padding-right:6px}\n"
      "tr.point td,tr.cannot td{background:#fde8e8}tr.otherwise td,tr.speed td,tr.blend td,"
      "tr.configuration td,tr.motion td,tr.output td,tr.unread td{background:#fff3d6}tr.missing "
      "td{background:#eef3fd}\n"
      "td .f{color:#7a8294}.why{color:#8a4b00;font-family:sans-serif;white-space:normal}\n"
      ".why.cannot{color:#a11}\n</style></head><body>\n<h1>" +
      html(title) + "</h1>\n<table>\n<tr><th></th>";
  for (const Side& s : c.sides) out += "<th>" + html(s.label) + "</th>";
  out += "</tr>\n";
  for (const Convention& k : conventions(c)) {
    out += "<tr><td>" + html(k.what) + "</td>";
    for (const std::string& v : k.of) out += "<td>" + html(v) + "</td>";
    out += "</tr>\n";
  }
  out += "</table>\n<p>" + html(points_sentence(c)) + "</p>\n<h2>Differences</h2>\n";
  if (c.differences.empty()) out += "<p>None.</p>\n";
  else {
    out += "<table>\n<tr><th>line</th><th>kind</th><th></th></tr>\n";
    for (const Difference& d : c.differences)
      out += "<tr class=\"" + d.kind + "\"><td>" +
             (d.line ? "<a href=\"#" + html(d.file) + "-" + std::to_string(d.line) + "\">" : "") +
             html(place_of_difference(d)) + (d.line ? "</a>" : "") + "</td><td>" + d.kind +
             "</td><td>" + html(d.text) + "</td></tr>\n";
    out += "</table>\n";
  }
  bool is_first = true;
  for (const auto& [file, lines] : c.source) {
    out += "<h2>" + html(file) +
           "</h2>\n<table class=\"code\">\n<tr><th class=\"n\"></th><th>IRL</th>";
    for (const Side& s : c.sides) out += "<th>" + html(s.label) + "</th>";
    out += "</tr>\n";
    for (std::uint32_t l = is_first ? 0 : 1; l <= lines.size(); ++l) {
      // The worst kind of the line colours it.
      std::string kind, why;
      for (const char* each : {"cannot", "point", "motion", "output", "unread", "configuration",
                               "speed", "blend", "otherwise", "missing"})
        if (kind.empty() && l > 0 && lines_that_differ(c, file, each).contains(l)) kind = each;
      out += "<tr" + (kind.empty() ? "" : " class=\"" + kind + "\"") +
             (l > 0 ? " id=\"" + html(file) + "-" + std::to_string(l) + "\"" : "") +
             "><td class=\"n\">" + (l > 0 ? std::to_string(l) : "") + "</td><td>" +
             (l > 0 ? html(lines[l - 1]) : "<span class=\"f\">of no line</span>") + "</td>";
      for (std::size_t k = 0; k < c.sides.size(); ++k) {
        const Side& s = c.sides[k];
        const auto it = s.lines.find(l > 0 ? std::pair(file, l) : std::pair(std::string(), l));
        out += "<td>";
        if (it != s.lines.end()) {
          for (std::size_t i = 0; i < it->second.size(); ++i)
            out += (i ? "\n" : "") + html(it->second[i].text);
        }
        for (const SideFault& f : s.faults)
          if (f.file == file && f.line == l && f.severity != "note")
            out += "<div class=\"why " + std::string(f.severity == "error" ? "cannot" : "") +
                   "\">" + html(f.message) + "</div>";
        out += "</td>";
      }
      out += "</tr>\n";
    }
    out += "</table>\n";
    is_first = false;
  }
  return out + "</body></html>\n";
}

std::string markdown(std::string_view s) {
  std::string out;
  for (const char c : s) {
    if (c == '|') out += "\\|";
    else out += c;
  }
  return out;
}
std::string code_cell(const std::vector<std::string>& lines) {
  std::string out;
  for (const std::string& l : lines) {
    if (l.find_first_not_of(' ') == std::string::npos) continue;
    const std::string ticks = l.find('`') == std::string::npos ? "`" : "``";
    out += (out.empty() ? "" : "<br>") + ticks + markdown(l) + ticks;
  }
  return out;
}
std::string as_markdown(const Comparison& c, const std::string& title) {
  std::string out = "# " + title + "\n\n| |";
  for (const Side& s : c.sides) out += " " + s.label + " |";
  out += "\n|---|";
  for (std::size_t i = 0; i < c.sides.size(); ++i) out += "---|";
  out += "\n";
  for (const Convention& k : conventions(c)) {
    out += "| " + k.what + " |";
    for (const std::string& v : k.of) out += " " + markdown(v) + " |";
    out += "\n";
  }
  out += "\n" + points_sentence(c) + "\n\n## Differences\n\n";
  if (c.differences.empty()) out += "None.\n";
  else {
    out += "| line | kind | |\n|---|---|---|\n";
    for (const Difference& d : c.differences)
      out += "| " + place_of_difference(d) + " | " + d.kind + " | " + markdown(d.text) + " |\n";
  }
  bool is_first = true;
  for (const auto& [file, lines] : c.source) {
    out += "\n## " + file + "\n\n| | IRL |";
    for (const Side& s : c.sides) out += " " + s.label + " |";
    out += "\n|---|---|";
    for (std::size_t i = 0; i < c.sides.size(); ++i) out += "---|";
    out += "\n";
    for (std::uint32_t l = is_first ? 0 : 1; l <= lines.size(); ++l) {
      out += "| " + (l > 0 ? std::to_string(l) : std::string()) + " | " +
             (l > 0 ? code_cell({lines[l - 1]}) : "of no line") + " |";
      for (const Side& s : c.sides) {
        const auto it = s.lines.find(l > 0 ? std::pair(file, l) : std::pair(std::string(), l));
        std::vector<std::string> texts;
        if (it != s.lines.end())
          for (const Line& one : it->second) texts.push_back(one.text);
        out += " " + code_cell(texts) + " |";
      }
      out += "\n";
    }
    is_first = false;
  }
  return out;
}

Result<Value> compare_targets(CommandContext& ctx, const Map& args) {
  std::vector<std::string> targets;
  for (const Value& each : *args.find("targets")->as_list()) {
    if (!each.as_string())
      return error(ErrorCode::invalid_argument, each.text() + " is not the name of a target",
                   "Such as targets = {\"krl\", \"rapid\"}, or names of controllers.", "targets");
    if (std::find(targets.begin(), targets.end(), *each.as_string()) != targets.end())
      return error(
          ErrorCode::invalid_argument,
          text::quote(*each.as_string()) + " is given twice, but a target is compared with others",
          "Give each once; a controller's name counts as a separate target.", "targets");
    targets.push_back(*each.as_string());
  }
  if (targets.size() < 2 || targets.size() > 6)
    return error(ErrorCode::invalid_argument,
                 std::to_string(targets.size()) + " targets are given, but 2 to 6 can be compared",
                 "Such as targets = {\"krl\", \"rapid\"}.", "targets");
  const std::string file = has(args, "file") ? text_of(args, "file") : "";
  const bool is_html = file.ends_with(".html"), is_markdown = file.ends_with(".md"),
             is_text = file.ends_with(".txt");
  if (!file.empty() && !is_html && !is_markdown && !is_text)
    return error(ErrorCode::invalid_argument,
                 text::quote(file) + " is neither a .html, .md nor .txt file",
                 "Give one of these extensions.", "file");
  RMP_TRY_ASSIGN(const Comparison c, compared(ctx, args, targets));
  std::string title = ctx.snapshot().find(ref(args, "id"))->name + ":";
  for (const Side& s : c.sides) title += (&s == &c.sides.front() ? " " : ", ") + s.label;
  const std::string text = as_text(c, static_cast<std::size_t>(integer(args, "width")));
  if (!file.empty())
    RMP_TRY(io::write_file(file, is_html       ? as_html(c, title)
                                 : is_markdown ? as_markdown(c, title)
                                               : text));
  const auto most = static_cast<std::size_t>(integer(args, "most"));
  List sides, differences, rows;
  for (const Side& s : c.sides) {
    std::int64_t errors = 0, warnings = 0;
    for (const SideFault& f : s.faults)
      errors += f.severity == "error", warnings += f.severity == "warning";
    sides.emplace_back(Map{{"target", s.target},
                           {"title", s.title},
                           {"profile", s.profile},
                           {"form", s.form},
                           {"correct", s.is_correct},
                           {"errors", errors},
                           {"warnings", warnings},
                           {"reader", s.reader},
                           {"not_read", s.not_read},
                           {"not_said", static_cast<std::int64_t>(s.not_said.size())},
                           {"compared", static_cast<std::int64_t>(s.compared)},
                           {"most_distance", s.most_mm / 1000},
                           {"most_angle", s.most_degrees / kDegreesPerRadian}});
  }
  List not_compared;
  for (const std::string& each : c.not_compared) not_compared.emplace_back(each);
  for (const Difference& d : c.differences) {
    if (differences.size() >= most) break;
    differences.emplace_back(Map{{"kind", d.kind},
                                 {"file", d.file},
                                 {"line", static_cast<std::int64_t>(d.line)},
                                 {"target", c.sides[d.side].label},
                                 {"text", d.text}});
  }
  std::size_t all = 0;
  for (const auto& [name, lines] : c.source)
    for (std::uint32_t l = 1; l <= lines.size(); ++l) {
      ++all;
      if (rows.size() >= most) continue;
      List says;
      for (const Side& s : c.sides) {
        std::string texts;
        if (const auto it = s.lines.find({name, l}); it != s.lines.end())
          for (const Line& one : it->second) texts += (texts.empty() ? "" : "\n") + one.text;
        says.emplace_back(std::move(texts));
      }
      rows.emplace_back(Map{{"file", name},
                            {"line", static_cast<std::int64_t>(l)},
                            {"source", lines[l - 1]},
                            {"says", std::move(says)},
                            {"differs", lines_that_differ(c, name, nullptr).contains(l)}});
    }
  Map left_out;
  if (c.differences.size() > most)
    left_out.set("differences", Value(static_cast<std::int64_t>(c.differences.size() - most)));
  if (all > most) left_out.set("rows", Value(static_cast<std::int64_t>(all - most)));
  Map out{{"targets", std::move(sides)},       {"differences", std::move(differences)},
          {"rows", std::move(rows)},           {"compared", static_cast<std::int64_t>(c.compared)},
          {"most_distance", c.most_mm / 1000}, {"most_angle", c.most_degrees / kDegreesPerRadian},
          {"points", points_sentence(c)},      {"not_compared", std::move(not_compared)},
          {"left_out", std::move(left_out)},   {"text", text}};
  if (!c.not_traced.empty()) out.set("not_traced", Value(c.not_traced));
  if (!file.empty()) out.set("file", Value(file));
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(program_compare_commands) {
  CommandSpec c;
  c.name = "program.compare_targets";
  c.summary = "Compares the code of a program for several controllers, side by side.";
  c.details =
      "For each line of the source: the code of each target, what one target cannot express or "
      "expresses differently, and lines that only one has. If an independent reader supports a "
      "target, its files are read back and run, and motions, points, configurations, speeds and "
      "blends are compared with each other and with the program, and outputs and waits for a time "
      "with the program. Quantities that languages give in different units are listed but not "
      "compared. A name in targets is a target or a controller.";
  c.example =
      "local lift = program.create{name = \"lift\", source = [[\n"
      "PROGRAM lift;\n"
      "VAR\n"
      "  POSE: place := POSE(POSITION(500.0, 0.0, 120.0), ORIZYX(0.0, 180.0, 0.0));\n"
      "BEGIN\n"
      "  MOVE LIN place SPEED := 80.0;\n"
      "ENDPROGRAM;\n"
      "]]}\n"
      "local c = lift:compare_targets{targets = {\"krl\", \"melfa5\"}}\n"
      "assert(c.compared == 1 and c.most_distance < 1e-5)";
  c.params = {
      self("program"),
      needed("targets", "list", "", "Two to six targets, or names of controllers."),
      optional("robot", "ref:robot", "", "The robot that moves."),
      optional("world", "ref:world", "",
               "World that defines the frames of its targets and the tool it moves."),
      optional("name_there", "string", "", "Its name there, if the world has it several times."),
      choice("form", {"automatic", "structured", "flat"}, "As in program.post."),
      optional("inputs", "map", "",
               "Values of the program's inputs by name, of the declared types."),
      optional("file", "path", "", "A page with the codes side by side: *.html, *.md or *.txt."),
      between(defaulted("width", "int", "", std::int64_t{44}, "Width of a column of the text."), 12,
              400),
      between(defaulted("most", "int", "", std::int64_t{500},
                        "Greatest number of differences and rows listed."),
              1, 1000000)};
  c.returns = {
      "map",
      "",
      "",
      {field("targets", "list", "",
             "Tables: target, title, profile, form, correct, errors, warnings; reader that read it "
             "back, or not_read, the reason; not_said, the part of it that the reader could not "
             "express; compared, most_distance and most_angle from the program's points."),
       field("differences", "list", "",
             "Tables by line: kind (cannot, otherwise, missing, form, unread, motion, "
             "point, additional, configuration, speed, blend, output), file, line, target, "
             "text."),
       field("rows", "list", "",
             "Tables, one per line of the source: file, line, source, says (one text per target), "
             "differs."),
       field("compared", "int", "",
             "Number of points compared between two targets; 0 means that distances are unknown."),
       field("most_distance", "real", "m", "Greatest distance between them."),
       field("most_angle", "real", "rad", "Greatest distance between them."),
       field("points", "string", "", "The comparison in sentences, and what was not checked."),
       field("not_compared", "list", "", "Sentences: quantities given in different units."),
       field("not_traced", "string", "", "Why the program itself could not be run."),
       field("left_out", "map", "", "Number of rows missing in each list."),
       field("text", "string", "", "Everything as text."),
       field("file", "string", "", "The page.")}};
  c.effect = Effect::reads;
  c.sometimes = Effect::files_write;
  c.run = compare_targets;
  return {std::move(c)};
}

}  // namespace robomosp::ioci
