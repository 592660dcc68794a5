// SPDX-License-Identifier: Apache-2.0
#include "program_post/compare_targets.h"

#include <algorithm>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include <robomosp/sdk/post_axes.h>
#include <robomosp/sdk/post_writer.h>

#include "kernel/text.h"
#include "model/controller.h"
#include "model/program_kinds.h"
#include "program_post/read_back.h"
#include "robotics/controller_profile.h"

namespace robomosp::program_post::comparison {
namespace {

using program_source::Workshop;

/// What was posted for a target, and how its controller counts the robot's axes.
struct PostedSide {
  Side side;
  ProviderInfo info;
  std::shared_ptr<robotics::ControllerProfile> axes;
};

/// Runs through what an independent reader makes of the files.
Result<void> read_back(const Workshop& with, const rmp_code& program, const PostCell& cell,
                       const program::TraceOptions& options, PostedSide& posted) {
  Side& side = posted.side;
  RMP_TRY_ASSIGN(const ReadBack read,
                 read_posted(with, side.files, posted.axes ? &posted.axes->record : nullptr));
  side.not_read = read.not_read;
  // What it could not write is reported; all the rest is compared.
  for (const ReadBack::Unread& u : read.not_said) {
    SideFault told{"error", "", u.message, "", 0};
    if (const auto at = side.source_of.find({u.file, u.line}); at != side.source_of.end())
      std::tie(told.file, told.line) = at->second;
    side.not_said.push_back(std::move(told));
  }
  if (!read.program) return {};
  auto traced = program::trace(read.program, inputs_of(program, options, read.program->code()),
                               &with.progress);
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
    RMP_TRY_ASSIGN(const auto kind, rail_kind(posted.info, side.capabilities, posted.axes->view));
    carried.is_on_carriage = cell.is_on_rail() && kind != RailKind::base;
    for (const PostAxis& a : posted.axes->axes)
      if (a.external && a.of_robot == 0 && a.joint >= 0) externals.push_back(a);
    carried.axes = externals;
  }
  side.reached = reached(*traced, {}, carried);
  if (counts_maker_axes(read.program->code()) && posted.axes)
    for (Reached& r : side.reached) {
      if (!r.is_joints || r.joints.empty()) continue;
      const auto& axes = posted.axes->view.axes;
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

Result<PostedSide> post_side(const Workshop& with, const PostRequest& request, const PostCell& cell,
                             const std::shared_ptr<const CompiledProgram>& program,
                             const std::string& symbol, const std::string& asked) {
  PostedSide posted;
  Side& out = posted.side;
  PostRequest own = request;
  own.lists_faults = true;
  const auto profile = with.snapshot().find(controller_kind(), asked);
  if (profile) {
    own.profile = *profile;
    out.profile = asked;
  } else {
    own.target = asked;
  }
  posted.axes = std::make_shared<robotics::ControllerProfile>();
  if (profile) {
    const model::Record* r = with.snapshot().find(*profile);
    posted.axes->name = r->name;
    posted.axes->record = std::get<model::OtherContent>(r->body).as<model::Controller>();
  }
  RMP_TRY(posted.axes->fill());
  if (cell.is_placed) {
    // Each side owns the names of its axes.
    RMP_TRY_ASSIGN(PostCell mine, post_cell(with, request.cell(), program, symbol));
    RMP_TRY(posted.axes->use(std::move(mine.maker), mine.robot_name,
                             mine.rail));  // the post reports it
  } else if (request.robot.number != 0) {
    RMP_TRY_ASSIGN(auto maker, robotics::MakerAxes::of(*with.snapshot().get(request.robot)));
    RMP_TRY(posted.axes->use(std::move(maker), with.snapshot().describe(AnyId(request.robot)),
                             cell.rail));  // the post reports it
  }
  RMP_TRY_ASSIGN(PostResult result, post(with, own));
  const rmp_code& code = result.program.code();
  Posted& made = result.posted;
  posted.info = result.target;
  out.target = result.target.name;
  out.label = out.profile.empty() ? out.target : out.profile;
  out.form = made.form;
  out.is_correct = made.errors() == 0;
  RMP_TRY_ASSIGN(const auto provider, with.from.registry.create<Post>(out.target));
  out.capabilities = provider->capabilities();
  if (cell.carrier) {
    RMP_TRY_ASSIGN(const auto kind, rail_kind(posted.info, out.capabilities, posted.axes->view));
    if (kind != RailKind::none) carry_axes(*posted.axes, cell);
  }
  out.title = std::string(out.capabilities.title);
  const auto file_name = [&](const rmp_span& span) {
    return std::string(span.file < code.files.count ? row<rmp_code_file>(code.files, span.file).name
                                                    : "");
  };
  static constexpr const char* kWords[] = {"error", "warning", "note"};
  for (const PostedFault& f : made.faults)
    out.faults.push_back({kWords[std::min<std::uint32_t>(f.severity, 2)], file_name(f.span),
                          f.message + ".", f.hint, f.span.line});
  if (out.is_correct) out.files = std::move(made.files);
  out.units = units_of(out.target);
  auto& source = out.source_of;
  for (const PostedLine& l : made.lines)
    source[{l.file, l.line}] = {file_name(l.span), l.span.line};
  for (const auto& [name, text] : out.files) {
    const std::vector<std::string> lines = split_lines(text);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const auto at = source.find({name, i + 1});
      const auto key =
          at == source.end() ? std::pair<std::string, std::uint32_t>{"", 0} : at->second;
      out.lines[key].push_back({name, i + 1, lines[i]});
    }
  }
  return posted;
}

}  // namespace

Result<Comparison> compare_targets(const Workshop& with, const PostRequest& request,
                                   const program_source::Compiled& made,
                                   std::span<const std::string> targets) {
  Comparison out;
  const model::Program& p = *program_source::program_in(with.snapshot(), request.program);
  for (std::size_t i = 0; i < p.files.size(); ++i)
    out.source.emplace_back(p.files[i].name, p.files[i].lines);
  const auto moved = robots_that_move(made.code());
  const std::string symbol = moved.size() == 1 ? moved.front() : std::string();
  RMP_TRY_ASSIGN(const PostCell cell, post_cell(with, request.cell(), made.program, symbol));
  Carried carried;
  if (cell.carrier) {
    carried.carrier = &*cell.carrier;
    carried.has_no_additional = cell.carrier->has_no_additional;
  }
  auto traced = program::trace(made.program, request.flattening, &with.progress);
  if (traced.ok())
    out.reached = reached(*traced, cell.places, carried), out.bits = deeds(*traced, false),
    out.whole = deeds(*traced, true);
  else if (traced.error().code == ErrorCode::cancelled) return std::move(traced).error();
  else out.not_traced = traced.error().sentence();
  for (const std::string& each : targets) {
    RMP_TRY_ASSIGN(PostedSide posted, post_side(with, request, cell, made.program, symbol, each));
    Side& side = posted.side;
    if (side.is_correct && !side.files.empty()) {
      RMP_TRY(read_back(with, made.code(), cell, request.flattening, posted));
    } else if (!side.is_correct) {
      side.not_read = "it cannot be posted";
    }
    out.sides.push_back(std::move(side));
  }
  compare(out);
  return out;
}

}  // namespace robomosp::program_post::comparison
