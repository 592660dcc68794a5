// SPDX-License-Identifier: Apache-2.0
#include "program_post/post.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include <robomosp/sdk/post_writer.h>

#include "kernel/text.h"
#include "model/controller.h"
#include "motion/provider_params.h"
#include "program/flatten.h"
#include "program_post/carriage.h"
#include "program_post/legalise.h"
#include "program_post/points.h"
#include "program_post/robot_kinematics.h"
#include "program_post/robots.h"
#include "robotics/controller_profile.h"
#include "sim/ik_choice.h"

namespace robomosp::program_post {
namespace {

using model::Controller;
using program_source::Compiled, program_source::Workshop;

struct Asked {
  ProviderInfo info;
  std::shared_ptr<Post> post;
  std::unique_ptr<Params> params;
  std::unique_ptr<robotics::ControllerProfile> profile =
      std::make_unique<robotics::ControllerProfile>();
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
  RailKind rail = RailKind::none;
  [[nodiscard]] bool carries() const {
    return cell.carrier && (cell.carrier->rail > 0 || rail != RailKind::none);
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

/// A controller's record with its name; empty = number 0.
std::pair<std::string, Controller> controller_of(const document::Snapshot& snapshot, AnyId id) {
  if (id.number == 0) return {};
  const model::Record* r = snapshot.find(id);
  return {r->name, std::get<model::OtherContent>(r->body).as<Controller>()};
}

/// Takes the additional joints of the world out of points, where the target has none and they stay.
void hide_rail(const Carrier& carrier, KnownPoints& points) {
  for (PostPoint& p : points.points) {
    if (p.external.empty()) continue;
    std::vector<double> left(p.external.begin(), p.external.end());
    for (const CarriedAxis& a : carrier.axes)
      if (a.number <= left.size()) left[a.number - 1] = 0;
    const bool is_empty = std::all_of(left.begin(), left.end(), [](double v) { return v == 0; });
    p.external = {};
    if (!is_empty) p.external = points.numbers.emplace_back(std::move(left));
  }
}

/// The greatest share of a limit of the controller that the written files take; each limit that is
/// passed is a fault at `head`. `c` is the program as it was written, in so many parts.
double limits_taken(const Asked& asked, const rmp_span& head, const rmp_code& c,
                    const KnownPoints& points, std::size_t parts, Posted& out) {
  const PostCapabilities& caps = asked.post->capabilities();
  double taken = 0;
  const auto over = [&](std::int64_t most, std::int64_t is, const char* what,
                        const std::string& file) {
    if (most > 0) taken = std::max(taken, static_cast<double>(is) / static_cast<double>(most));
    if (most > 0 && is > most)
      out.faults.push_back({RMP_FAULT_ERROR, head,
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
  if (parts == 0) {
    for (const PostPoint& p : points.points) points_used[0] += p.motion != RMP_NONE;
  } else {
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
  return taken;
}

/// Writes it as one program, or as about so many parts besides; gives how many there are, and
/// whether a limit of the controller is passed.
struct Written {
  std::size_t parts = 0;
  double over = 0;  ///< the greatest share of a limit that it takes
};
Result<Written> write_in_parts(Progress& progress, const Asked& asked, const rmp_code& as_written,
                               std::uint32_t form, std::size_t parts, Posted& out) {
  const PostCapabilities& caps = asked.post->capabilities();
  out.is_flat = form == kPostFlat;
  out.has_robot = asked.cell.robot != nullptr;
  std::optional<Carrier> carrier;
  if (asked.carries()) carrier = asked.cell.carrier;
  const auto known = [&](const rmp_code& of) {
    auto found =
        known_points(of, asked.cell.robot.get(), asked.kinematics.get(), asked.cell.start,
                     asked.default_tool(), asked.profile->view.axes, carrier ? &*carrier : nullptr);
    if (carrier && asked.rail == RailKind::none) hide_rail(*carrier, found);
    return found;
  };
  auto placed = in_cell(as_written, asked.cell.places);
  if (carrier && carrier->rail > 0) {
    const rmp_code& whole = placed ? placed->code() : as_written;
    std::vector<Remark> remarks;
    auto carried = for_rail(whole, *carrier, known(whole), asked.rail, caps, remarks);
    for (const auto& r : remarks) out.fault(r.severity, r.span, r.message, r.hint);
    carrier->is_on_carriage = asked.rail != RailKind::base;
    placed = std::move(carried);
  }
  const rmp_code& code = placed ? placed->code() : as_written;
  LegaliseOptions options;
  KnownPoints before;
  if (wants_points(code, caps)) {
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
  Legal legal = legalise(code, caps, options);
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
  RMP_TRY(asked.post->write(task, *asked.params, out, progress));
  out.form = form == kPostFlat ? "flat" : "structured";
  const rmp_span head = row<rmp_code_routine>(code.routines, 0).span;
  return Written{legal.parts, limits_taken(asked, head, *task.code, points, legal.parts, out)};
}

/// The program in one file, or, where it is too long for one and the target has such, in several.
Result<void> write_one(Progress& progress, const Asked& asked, const rmp_code& code,
                       std::uint32_t form, Posted& out) {
  RMP_TRY_ASSIGN(const Written whole, write_in_parts(progress, asked, code, form, 0, out));
  if (form != kPostFlat || whole.over <= 1 || out.errors() == 0 ||
      (asked.post->capabilities().features & kPostParts) == 0)
    return {};
  // Parts are of about equally many statements, not lines: more where one is still too long.
  auto count = static_cast<std::size_t>(std::ceil(std::min(whole.over, 1e6) * 1.05)) + 1;
  for (int tries = 0; tries < 5; ++tries) {
    Posted divided;
    RMP_TRY_ASSIGN(const Written w, write_in_parts(progress, asked, code, form, count, divided));
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
  if (!asked.cell.carrier) return {};
  RMP_TRY_ASSIGN(asked.rail,
                 rail_kind(asked.info, asked.post->capabilities(), asked.profile->view));
  if (!asked.cell.is_on_rail()) return {};
  const Carrier& c = *asked.cell.carrier;
  std::string what;
  for (const CarriedAxis& a : c.axes)
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

Result<Asked> read_asked(const Workshop& with, const PostRequest& request, const Compiled& made) {
  const rmp_code& code = made.code();
  Asked out;
  std::tie(out.profile->name, out.profile->record) =
      controller_of(with.snapshot(), request.profile);
  std::string target = request.target;
  if (target.empty()) target = out.profile->record.target;
  if (target.empty())
    return error(ErrorCode::invalid_argument, "no target is given",
                 "Give target = \"krl\" or a profile; program.targets lists them.", "target");
  if (request.profile.number != 0 && !out.profile->record.target.empty() &&
      out.profile->record.target != target)
    return error(ErrorCode::invalid_argument,
                 "controller " + text::quote(out.profile->name) + " is of the target " +
                     text::quote(out.profile->record.target) + ", not " + text::quote(target),
                 "Give the profile without a target.", "target");
  RMP_TRY(out.profile->fill());
  RMP_TRY_ASSIGN(out.info, with.from.registry.find(Post::kInterfaceId, target));
  RMP_TRY_ASSIGN(auto post, with.from.registry.create<Post>(out.info.name));
  out.post = std::shared_ptr<Post>(std::move(post));
  model::ProviderChoice choice = request.params;
  choice.name = out.info.name;
  RMP_TRY_ASSIGN(out.params,
                 motion::checked_params(out.info, choice, "target " + text::quote(out.info.name)));
  std::string symbol = request.only_robot;
  if (const auto moved = robots_that_move(code); symbol.empty() && moved.size() == 1)
    symbol = moved.front();
  RMP_TRY_ASSIGN(out.cell, post_cell(with, request.cell(), made.program, symbol));
  settle_places(out, code);
  RMP_TRY(settle_rail(out, code));
  if (out.cell.robot) {
    RMP_TRY_ASSIGN(auto bound, with.bind_ik(out.cell.robot, out.cell.ik));
    out.kinematics =
        std::make_unique<HostKinematics>(out.cell.robot, std::move(bound), with.progress);
    RMP_TRY_ASSIGN(out.contradictions,
                   out.profile->use(std::move(out.cell.maker), out.cell.robot_name, out.cell.rail));
  }
  if (out.carries() && out.rail != RailKind::none) carry_axes(*out.profile, out.cell);
  out.name = request.name;
  if (out.name.empty()) out.name = out.profile->record.program;
  if (out.name.empty()) {
    out.name = plain(code.name);
    // Parts of one program may lie in one folder.
    if (!request.only_robot.empty()) out.name += "_" + plain(request.only_robot);
  }
  return out;
}

/// The program as what it does in a run without a world.
Result<std::shared_ptr<const CompiledProgram>> flatten_it(const Workshop& with,
                                                          const PostRequest& request,
                                                          const Compiled& made) {
  RMP_TRY_ASSIGN(const auto trace,
                 program::trace(made.program, request.flattening, &with.progress));
  RMP_TRY_ASSIGN(auto tables, program::flatten(trace));
  return std::shared_ptr<const CompiledProgram>(std::move(tables));
}

/// The place that an error of a run gives as "file:line:column"; nothing = it gives none.
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

/// The program, or the part of a robot, as its form says. `shares`: parts share variables.
Result<Posted> post_part(const Workshop& with, const PostRequest& request, const Compiled& whole,
                         Asked asked, bool shares) {
  Compiled made = whole;
  std::vector<PostedFault> of_part;
  std::vector<MadeFor> made_for;
  bool is_divided = true;
  if (!request.only_robot.empty()) {
    RMP_TRY_ASSIGN(const Part part,
                   part_of(with, request.profile, made, request.only_robot, true, shares));
    for (const auto& r : part.remarks) {
      of_part.push_back({r.severity, r.span, r.message, r.hint});
      is_divided = is_divided && r.severity != RMP_FAULT_ERROR;
    }
    const auto all = robots_that_move(made.code());
    if (is_divided) {
      const auto places =
          program_source::places_of(with.snapshot(), request.program, request.place);
      RMP_TRY_ASSIGN(made, compile_whole(with, request.program, places, &part.text));
      made_for = part.made_for;
      if (shares) {
        const std::string& robot = request.only_robot;
        std::string base = asked.name;
        if (base.ends_with("_" + plain(robot))) base.resize(base.size() - plain(robot).size() - 1);
        const auto arm = std::find(all.begin(), all.end(), robot) - all.begin() + 1;
        asked.profile->share(part.shared, robot, static_cast<std::size_t>(arm),
                             base + "_" + plain(part.partner));
      }
    }
  }
  const rmp_code& code = made.code();
  const PostForm form = request.form;
  const PostCapabilities& caps = asked.post->capabilities();
  const bool takes_structure = (caps.forms & kPostStructured) != 0;
  const bool takes_flat = (caps.forms & kPostFlat) != 0;
  if ((form == PostForm::flat && !takes_flat) || (form == PostForm::structured && !takes_structure))
    return error(ErrorCode::unsupported,
                 std::string(caps.title) + " takes no " + std::string(to_string(form)) + " program",
                 "Leave form out.", "form");
  Posted out;
  if (!is_divided) {
    out.form = form == PostForm::flat || !takes_structure ? "flat" : "structured";
  } else if (form == PostForm::structured || (form == PostForm::automatic && takes_structure)) {
    RMP_TRY(write_one(with.progress, asked, code, kPostStructured, out));
  }
  std::shared_ptr<const CompiledProgram> flat;
  const bool falls_back =
      form == PostForm::automatic && takes_flat && takes_structure && out.errors() > 0;
  if (out.form.empty() || falls_back) {
    auto flattened = flatten_it(with, request, made);
    if (!flattened.ok() && !falls_back) {
      // Where faults are asked for, it is one of them: the program's, not the command's.
      const bool is_of_program = (flattened.error().code == ErrorCode::unsupported ||
                                  flattened.error().code == ErrorCode::invalid_argument) &&
                                 place_in(code, flattened.error().where);
      if (!request.lists_faults || !is_of_program)
        return program_source::named_once(std::move(flattened).error(),
                                          with.snapshot().describe(request.program));
      out.form = "flat";
      out.faults.push_back({RMP_FAULT_ERROR, *place_in(code, flattened.error().where),
                            flattened.error().message, flattened.error().hint});
    } else if (flattened.ok()) {
      flat = std::move(flattened).value();
      Posted other;
      RMP_TRY(write_one(with.progress, asked, flat->code(), kPostFlat, other));
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
Result<Posted> post_several(const Workshop& with, const PostRequest& request, const Compiled& made,
                            const std::vector<std::string>& robots) {
  Posted out;
  for (const std::string& robot : robots) {
    PostRequest own = request;
    own.only_robot = robot;
    if (!request.name.empty()) own.name += "_" + plain(robot);
    RMP_TRY_ASSIGN(Asked asked, read_asked(with, own, made));
    RMP_TRY_ASSIGN(Posted part, post_part(with, own, made, std::move(asked), true));
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

}  // namespace

std::string_view to_string(PostForm form) {
  switch (form) {
    case PostForm::structured: return "structured";
    case PostForm::flat: return "flat";
    default: return "automatic";
  }
}

/// The part of a program for the controller of one robot.
Result<Part> part_of(const Workshop& with, AnyId profile, const Compiled& made,
                     const std::string& robot, bool keeps_lines, bool shares) {
  PartTask task;
  const auto [name, record] = controller_of(with.snapshot(), profile);
  std::vector<Line> lines;
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

Fault posted_fault(const program_source::FaultyText& in, const rmp_code& code,
                   const PostedFault& f) {
  const bool is_error = f.severity == RMP_FAULT_ERROR;
  return program_source::text_fault(
      is_error ? "program.not_posted" : "program.posted_otherwise", in,
      {f.severity, f.span,
       f.span.file < code.files.count ? row<rmp_code_file>(code.files, f.span.file).name : "",
       f.message, f.hint});
}

Result<PostResult> post(const Workshop& with, const PostRequest& request) {
  PostResult out;
  const auto places = program_source::places_of(with.snapshot(), request.program, request.place);
  RMP_TRY_ASSIGN(out.program, compile_whole(with, request.program, places));
  RMP_TRY_ASSIGN(Asked asked, read_asked(with, request, out.program));
  out.target = asked.info;
  out.has_flat = (asked.post->capabilities().forms & kPostFlat) != 0;
  const auto& tags = out.target.tags;
  const auto robots = robots_that_move(out.program.code());
  const bool are_several = robots.size() > 1 && request.only_robot.empty() &&
                           std::find(tags.begin(), tags.end(), kSeveralRobots) != tags.end();
  RMP_TRY_ASSIGN(out.posted, are_several
                                 ? post_several(with, request, out.program, robots)
                                 : post_part(with, request, out.program, std::move(asked), false));
  return out;
}

}  // namespace robomosp::program_post
