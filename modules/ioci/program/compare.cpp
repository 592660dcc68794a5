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

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/program_reader.h>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/program/compiled.h"
#include "ioci/program/program_files.h"
#include "ioci/program/program_kind.h"
#include "motion/provider_params.h"
#include "program/trace.h"

namespace robomosp::ioci {
namespace {

constexpr double kDegree = 180 / std::numbers::pi;
constexpr double kSameMm = 0.01, kSameDegrees = 0.01, kSameSpeed = 0.01;

template <class Row>
const Row& row_of(const rmp_table& t, std::uint32_t i) {
  return *static_cast<const Row*>(rmp_row(&t, i));
}

/// A target of a motion as a program reaches it.
struct Reached {
  std::uint32_t line = 0;
  std::uint32_t interpolation = RMP_MOVE_PTP;
  bool is_joints = false, is_place = false;
  std::array<double, 3> mm{};
  std::array<double, 4> turn{1, 0, 0, 0};
  std::vector<double> joints;  ///< [degrees, mm]
  std::optional<std::int32_t> status;
  double speed = 0;  ///< of paths [mm/s], of PTP [%]
  double c_cp = 0, c_ptp = 0;
};
const char* motion_word(std::uint32_t interpolation) {
  switch (interpolation) {
    case RMP_MOVE_LIN: return "LIN";
    case RMP_MOVE_CIRCLE: return "CIRCLE";
    case RMP_MOVE_PATH: return "PATH";
    default: return "PTP";
  }
}

std::vector<Reached> reached(const program::Trace& t) {
  std::vector<Reached> out;
  for (const program::TraceEntry& e : t.entries) {
    const auto* m = std::get_if<program::TracedMotion>(&e.what);
    if (!m) continue;
    for (std::size_t k = 0; k < m->motion.targets.size(); ++k) {
      const program::Target& target = m->motion.targets[k];
      Reached one;
      one.line = e.span.line;
      one.interpolation = m->motion.interpolation;
      const auto& a = m->motion.attributes;
      const bool is_ptp = one.interpolation == RMP_MOVE_PTP;
      one.speed = is_ptp ? a.speed_ptp : a.speed;
      one.c_cp = is_ptp ? 0 : a.c_cp;
      one.c_ptp = is_ptp ? a.c_ptp : 0;
      const bool is_known = k < m->absolute.size() && m->absolute[k];
      if (is_known || target.role == RMP_ROLE_POSITION) {
        const program::PlainPose& p = is_known ? *m->absolute[k] : target.pose;
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

/// How far two targets are apart.
struct Apart {
  bool is_comparable = false;
  double mm = 0, degrees = 0;
};
Apart apart(const Reached& a, const Reached& b) {
  Apart out;
  if (a.is_joints != b.is_joints) return out;
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
  out.degrees = 2 * std::acos(std::min(1.0, std::fabs(dot))) * kDegree;
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
  bool is_correct = false;
  std::vector<std::pair<std::string, std::string>> files;
  /// Lines by the file and line of the source; line 0 = of no line.
  std::map<std::pair<std::string, std::uint32_t>, std::vector<Line>> lines;
  std::vector<SideFault> faults;
  std::string reader, not_read;  ///< which reads it back, or why none did
  std::vector<Reached> reached;
  PostCapabilities capabilities;
};

struct Difference {
  std::string
      kind;  ///< cannot, otherwise, missing, form, motion, point, configuration, speed, blend
  std::string file;
  std::uint32_t line = 0;
  std::size_t side = 0;
  std::string text;
};

Result<std::shared_ptr<const CompiledProgram>> compile_texts(
    CommandContext& ctx, const std::vector<std::pair<std::string, std::string>>& texts) {
  RMP_TRY_ASSIGN(const ProviderInfo info, ctx.app.registry.find(Language::kInterfaceId, "irl"));
  RMP_TRY_ASSIGN(const auto language, language_of(ctx, info.name));
  model::ProviderChoice choice;
  choice.name = info.name;
  RMP_TRY_ASSIGN(const auto params, motion::checked_params(info, choice, "provider irl"));
  std::vector<SourceFile> sources;
  for (const auto& [name, text] : texts) sources.push_back({name, text, {}});
  LanguageTask task;
  task.files = sources;
  RMP_TRY_ASSIGN(auto made, language->compile(task, *params, ctx.progress));
  const rmp_code& c = made->code();
  for (std::uint32_t i = 0; i < c.faults.count; ++i) {
    const auto& f = row_of<rmp_code_fault>(c.faults, i);
    if (f.severity == RMP_FAULT_ERROR)
      return error(ErrorCode::invalid_argument, std::string(f.message), f.hint);
  }
  return std::shared_ptr<const CompiledProgram>(std::move(made));
}

/// Runs through what an independent reader makes of the files.
Result<void> read_back(CommandContext& ctx, const program::TraceOptions& options, Side& side) {
  const std::string& name = side.files.front().first;
  const std::string& text = side.files.front().second;
  const auto dot = name.rfind('.');
  std::string extension = dot == std::string::npos ? "" : name.substr(dot + 1);
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  std::shared_ptr<ProgramReader> best;
  std::int32_t most = -1;
  ProviderInfo of;
  for (const ProviderInfo& info : ctx.app.registry.list(ProgramReader::kInterfaceId)) {
    if (!info.enabled) continue;
    RMP_TRY_ASSIGN(auto reader, ctx.app.registry.create<ProgramReader>(info.name));
    const auto formats = reader->formats();
    if (std::none_of(formats.begin(), formats.end(),
                     [&](const ReaderFormat& f) { return extension == f.extension; }))
      continue;
    const std::int32_t sure = reader->claims({name, text, {}});
    if (sure <= most) continue;
    most = sure, best = std::move(reader), of = info;
  }
  if (!best) {
    side.not_read = "no reader takes ." + extension;
    return {};
  }
  RMP_TRY_ASSIGN(const auto params,
                 motion::checked_values(of, Map{}, "reader " + text::quote(of.name)));
  std::vector<SourceFile> sources;
  for (const auto& [file, bytes] : side.files) sources.push_back({file, bytes, {}});
  ProgramReaderTask task;
  task.files = sources;
  auto read = best->read(task, *params, ctx.progress);
  if (!read.ok()) {
    if (read.error().code == ErrorCode::cancelled) return std::move(read).error();
    side.not_read = read.error().sentence();
    return {};
  }
  for (const rmp_code_fault& f : (*read)->faults())
    if (f.severity == RMP_FAULT_ERROR) {
      side.not_read = "reader " + of.name + ", line " + std::to_string(f.span.line) + ": " +
                      std::string(f.message);
      return {};
    }
  std::vector<std::pair<std::string, std::string>> texts;
  for (const ReadFile& f : (*read)->files()) texts.emplace_back(f.name, f.text);
  auto made = compile_texts(ctx, texts);
  if (!made.ok()) {
    if (made.error().code == ErrorCode::cancelled) return std::move(made).error();
    side.not_read = "what reader " + of.name + " made of it: " + made.error().sentence();
    return {};
  }
  auto traced = program::trace(*made, options, &ctx.progress);
  if (!traced.ok()) {
    if (traced.error().code == ErrorCode::cancelled) return std::move(traced).error();
    side.not_read = traced.error().sentence();
    return {};
  }
  side.reader = of.name;
  side.reached = reached(*traced);
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

Result<Side> post_side(CommandContext& ctx, const Map& args, const std::string& asked) {
  Side out;
  Map post{{"id", *args.find("id")}, {"check", true}, {"source_map", true}};
  if (const auto profile = ctx.snapshot().find(controller_kind(), asked)) {
    post.set("profile", Application::handle(*profile));
    out.profile = asked;
  } else {
    post.set("target", Value(asked));
  }
  for (const char* each : {"robot", "form", "inputs"})
    if (has(args, each)) post.set(each, *args.find(each));
  RMP_TRY_ASSIGN(const Value found, ctx.dispatch("program.post", post));
  const Map& map = *found.as_map();
  out.target = *map.find("target")->as_string();
  out.form = *map.find("form")->as_string();
  out.is_correct = *map.find("correct")->as_bool();
  RMP_TRY_ASSIGN(const auto made, ctx.app.registry.create<Post>(out.target));
  out.capabilities = made->capabilities();
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
  std::map<std::pair<std::string, std::size_t>, std::pair<std::string, std::uint32_t>> source;
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
  std::string not_traced;
  std::size_t compared = 0;  ///< targets of which two sides or more were read back
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

/// What two programs of motions differ in; `of` tells them apart.
void compare_motions(Comparison& c, const std::string& file, const std::vector<Reached>& a,
                     const std::vector<Reached>& b, const std::string& of_a,
                     const std::string& of_b, std::size_t side, bool counts) {
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
  for (std::size_t k = 0; k < a.size() && k < b.size(); ++k) {
    // The lines of the source are those of its own trace, which is in the same order.
    const std::uint32_t line = k < c.reached.size() ? c.reached[k].line : 0;
    if (a[k].interpolation != b[k].interpolation) {
      tell("motion", line,
           of_a + " goes by " + motion_word(a[k].interpolation) + ", " + of_b + " by " +
               motion_word(b[k].interpolation));
      continue;
    }
    const Apart d = apart(a[k], b[k]);
    if (!d.is_comparable) {
      tell("point", line,
           (a[k].is_joints ? of_a : of_b) + " gives joints, " + (a[k].is_joints ? of_b : of_a) +
               " a place");
    } else {
      if (counts) {
        ++c.compared;
        c.most_mm = std::max(c.most_mm, d.mm);
        c.most_degrees = std::max(c.most_degrees, d.degrees);
      }
      if (d.mm > kSameMm || d.degrees > kSameDegrees)
        tell("point", line,
             "the target in " + of_a + " is " + text::print_rounded(d.mm, 4) + " mm and " +
                 text::print_rounded(d.degrees, 4) + " degrees from that in " + of_b);
    }
    if (a[k].status && b[k].status && *a[k].status != *b[k].status)
      tell("configuration", line,
           of_a + " says configuration " + std::to_string(*a[k].status) + ", " + of_b + " " +
               std::to_string(*b[k].status));
    else if (a[k].status.has_value() != b[k].status.has_value() && !a[k].is_joints)
      tell("configuration", line,
           (a[k].status ? of_a : of_b) + " fixes the configuration (" +
               std::to_string(a[k].status ? *a[k].status : *b[k].status) + "), " +
               (a[k].status ? of_b : of_a) + " leaves it to the controller");
    if (std::fabs(a[k].speed - b[k].speed) > kSameSpeed * std::max(a[k].speed, b[k].speed))
      tell("speed", line,
           of_a + " goes at " + at_speed(a[k]) + ", " + of_b + " at " + at_speed(b[k]));
    if (std::fabs(a[k].c_cp - b[k].c_cp) > 0.01 * std::max(a[k].c_cp, b[k].c_cp) ||
        std::fabs(a[k].c_ptp - b[k].c_ptp) > 0.01 * std::max(a[k].c_ptp, b[k].c_ptp))
      tell("blend", line,
           of_a + " has " + blend_words(a[k]) + ", " + of_b + " " + blend_words(b[k]));
  }
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
  if (const Value* given = args.find("inputs"); given && given->as_map())
    for (const auto& [name, value] : *given->as_map()) {
      const bool* is_on = value.as_bool();
      const double* number = value.as_real();
      const auto* whole = value.as_int();
      if (is_on) options.inputs[name] = {*is_on ? 1 : 0, *is_on ? 1.0 : 0.0};
      if (whole) options.inputs[name] = {*whole, static_cast<double>(*whole)};
      if (number) options.inputs[name] = {std::llround(*number), *number};
    }
  auto traced = program::trace(made.program, options, &ctx.progress);
  if (traced.ok()) out.reached = reached(*traced);
  else if (traced.error().code == ErrorCode::cancelled) return std::move(traced).error();
  else out.not_traced = traced.error().sentence();
  for (const std::string& each : targets) {
    RMP_TRY_ASSIGN(Side side, post_side(ctx, args, each));
    if (side.is_correct && !side.files.empty()) {
      RMP_TRY(read_back(ctx, options, side));
    } else if (!side.is_correct) {
      side.not_read = "it is not posted";
    }
    out.sides.push_back(std::move(side));
  }
  for (std::size_t s = 0; s < out.sides.size(); ++s) {
    const Side& side = out.sides[s];
    for (const SideFault& f : side.faults)
      out.differences.push_back(
          {f.severity == "error" ? "cannot" : "otherwise", f.file, f.line, s,
           side.target + ": " + f.message + (f.hint.empty() ? "" : " " + f.hint)});
    if (s > 0 && side.is_correct && out.sides[0].is_correct && side.form != out.sides[0].form)
      out.differences.push_back({"form", main_file, 0, s,
                                 out.sides[0].target + " is " + out.sides[0].form + ", " +
                                     side.target + " is " + side.form});
    if (!side.reader.empty() && out.not_traced.empty())
      compare_motions(out, main_file, out.reached, side.reached, "the program", side.target, s,
                      false);
    for (std::size_t o = 0; o < s; ++o)
      if (!side.reader.empty() && !out.sides[o].reader.empty())
        compare_motions(out, main_file, out.sides[o].reached, side.reached, out.sides[o].target,
                        side.target, s, true);
  }
  // Lines that one says and another does not.
  for (const auto& [file, lines] : out.source)
    for (std::uint32_t l = 1; l <= lines.size(); ++l) {
      std::string with, without;
      for (const Side& side : out.sides) {
        if (!side.is_correct) continue;
        std::string& list = side.lines.contains({file, l}) ? with : without;
        list += (list.empty() ? "" : ", ") + side.target;
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
std::string points_sentence(const Comparison& c) {
  std::size_t read = 0;
  for (const Side& s : c.sides) read += !s.reader.empty();
  if (read < 2)
    return "The points are not compared: " + std::to_string(read) + " of " +
           std::to_string(c.sides.size()) + " was read back.";
  if (c.compared == 0)
    return "No points are compared: what was read back has no motions in common.";
  return std::to_string(c.compared) + " points read back and compared: at most " +
         text::print_rounded(c.most_mm, 3) + " mm and " + text::print_rounded(c.most_degrees, 3) +
         " degrees apart.";
}
std::string where_of(const Difference& d) {
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
    out += where_of(d) + ": " + d.kind + ": " + d.text + "\n";
  for (const auto& [file, lines] : c.source) {
    out += "\n=== " + file;
    for (const Side& s : c.sides) out += " | " + s.target;
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
      "tr.configuration td,tr.motion td{background:#fff3d6}tr.missing td{background:#eef3fd}\n"
      "td .f{color:#7a8294}.why{color:#8a4b00;font-family:sans-serif;white-space:normal}\n"
      ".why.cannot{color:#a11}\n</style></head><body>\n<h1>" +
      html(title) + "</h1>\n<table>\n<tr><th></th>";
  for (const Side& s : c.sides) out += "<th>" + html(s.target) + "</th>";
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
             html(where_of(d)) + (d.line ? "</a>" : "") + "</td><td>" + d.kind + "</td><td>" +
             html(d.text) + "</td></tr>\n";
    out += "</table>\n";
  }
  bool is_first = true;
  for (const auto& [file, lines] : c.source) {
    out += "<h2>" + html(file) +
           "</h2>\n<table class=\"code\">\n<tr><th class=\"n\"></th><th>IRL</th>";
    for (const Side& s : c.sides) out += "<th>" + html(s.target) + "</th>";
    out += "</tr>\n";
    for (std::uint32_t l = is_first ? 0 : 1; l <= lines.size(); ++l) {
      // The worst kind of the line colours it.
      std::string kind, why;
      for (const char* each :
           {"cannot", "point", "motion", "configuration", "speed", "blend", "otherwise", "missing"})
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
  for (const Side& s : c.sides) out += " " + s.target + " |";
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
      out += "| " + where_of(d) + " | " + d.kind + " | " + markdown(d.text) + " |\n";
  }
  bool is_first = true;
  for (const auto& [file, lines] : c.source) {
    out += "\n## " + file + "\n\n| | IRL |";
    for (const Side& s : c.sides) out += " " + s.target + " |";
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
      return error(ErrorCode::invalid_argument, each.text() + " is no name of a target",
                   "Such as targets = {\"krl\", \"rapid\"}, or names of controllers.", "targets");
    targets.push_back(*each.as_string());
  }
  if (targets.size() < 2 || targets.size() > 6)
    return error(ErrorCode::invalid_argument,
                 std::to_string(targets.size()) + " targets are given, and 2 to 6 are compared",
                 "Such as targets = {\"krl\", \"rapid\"}.", "targets");
  const std::string file = has(args, "file") ? text_of(args, "file") : "";
  const bool is_html = file.ends_with(".html"), is_markdown = file.ends_with(".md"),
             is_text = file.ends_with(".txt");
  if (!file.empty() && !is_html && !is_markdown && !is_text)
    return error(ErrorCode::invalid_argument,
                 text::quote(file) + " is neither a .html, .md nor .txt file",
                 "Give one of these endings.", "file");
  RMP_TRY_ASSIGN(const Comparison c, compared(ctx, args, targets));
  std::string title = ctx.snapshot().find(ref(args, "id"))->name + ":";
  for (const Side& s : c.sides)
    title += (s.target == c.sides.front().target ? " " : ", ") + s.target;
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
                           {"not_read", s.not_read}});
  }
  for (const Difference& d : c.differences) {
    if (differences.size() >= most) break;
    differences.emplace_back(Map{{"kind", d.kind},
                                 {"file", d.file},
                                 {"line", static_cast<std::int64_t>(d.line)},
                                 {"target", c.sides[d.side].target},
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
  std::size_t read = 0;
  for (const Side& s : c.sides) read += !s.reader.empty();
  Map out{{"targets", std::move(sides)},
          {"differences", std::move(differences)},
          {"rows", std::move(rows)},
          {"compared", static_cast<std::int64_t>(c.compared)},
          {"most_distance", c.most_mm / 1000},
          {"most_angle", c.most_degrees / kDegree},
          {"points", points_sentence(c)},
          {"left_out", std::move(left_out)},
          {"text", text}};
  if (!c.not_traced.empty()) out.set("not_traced", Value(c.not_traced));
  if (!file.empty()) out.set("file", Value(file));
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(program_compare_commands) {
  CommandSpec c;
  c.name = "program.compare_targets";
  c.summary = "Shows a program for several controllers side by side, and what differs.";
  c.details =
      "By the lines of the source: what each target says, what one cannot say or says otherwise, "
      "and lines that only one has. Where an independent reader takes a target's files, they are "
      "read back and run through, and motions, points, configurations, speeds and blends are "
      "compared with each other and with the program. A name in targets is a target or a "
      "controller's.";
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
      choice("form", {"automatic", "structured", "flat"}, "As of program.post."),
      optional("inputs", "map", "", "Values of inputs by name, as of program.post."),
      optional("file", "path", "", "A page with both codes side by side: *.html, *.md or *.txt."),
      between(defaulted("width", "int", "", std::int64_t{44}, "Of a column of the text."), 12, 400),
      between(defaulted("most", "int", "", std::int64_t{500}, "Differences and rows listed."), 1,
              1000000)};
  c.returns = {
      "map",
      "",
      "",
      {field("targets", "list", "",
             "Tables: target, title, profile, form, correct, errors, warnings; reader that read it "
             "back, or not_read, why not."),
       field("differences", "list", "",
             "Tables by line: kind (cannot, otherwise, missing, form, motion, point, "
             "configuration, speed, blend), file, line, target, text."),
       field("rows", "list", "",
             "Tables, a line of the source each: file, line, source, says (a text each target), "
             "differs."),
       field("compared", "int", "", "Points that were compared; 0 says nothing of the distances."),
       field("most_distance", "real", "m", "Between them."),
       field("most_angle", "real", "rad", "Between them."),
       field("points", "string", "", "The same as a sentence."),
       field("not_traced", "string", "", "Why the program itself could not be run through."),
       field("left_out", "map", "", "How many rows each list lacks."),
       field("text", "string", "", "All of it as text."),
       field("file", "string", "", "The page.")}};
  c.effect = Effect::reads;
  c.sometimes = Effect::files_write;
  c.run = compare_targets;
  return {std::move(c)};
}

}  // namespace robomosp::ioci
