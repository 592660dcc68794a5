// SPDX-License-Identifier: Apache-2.0
#include "program_post/comparison.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <variant>

#include <robomosp/sdk/post_writer.h>

#include "kernel/text.h"
#include "program_post/carriage.h"

namespace robomosp::program_post::comparison {
namespace {

constexpr double kHalfTurn = 180 / std::numbers::pi;
constexpr double kSameMm = 0.01, kSameDegrees = 0.01, kSameSpeed = 0.01;

template <class Row>
const Row& compared_row(const rmp_table& t, std::uint32_t i) {
  return *static_cast<const Row*>(rmp_row(&t, i));
}

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
bool same_unit(const char* a, const char* b) {
  return a == b ||
         (a && b && std::string_view(a) == b && std::string_view(a) != "units of its own");
}

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
  out.degrees = 2 * std::acos(std::min(1.0, std::fabs(dot))) * kHalfTurn;
  return out;
}

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
    // The lines of the source come from the same trace, in the same order.
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

}  // namespace

Units units_of(std::string_view target) {
  for (const Units& u : kUnits)
    if (u.target == target) return u;
  return {target, "units of its own", "units of its own", "units of its own"};
}

void Carried::set(const program::Target& t, bool is_step, std::vector<double>& now) const {
  for (std::size_t k = 0; k < t.additional.size(); ++k) {
    if (has_no_additional && t.additional[k] == 0) continue;
    std::size_t number = k;
    CarriedAxis counted;
    if (is_controllers && !axes.empty()) {
      if (k >= axes.size()) continue;
      number = static_cast<std::size_t>(axes[k].joint);
      counted.sign = axes[k].sign, counted.offset = axes[k].offset;
    } else if (!is_controllers) {
      for (const CarriedAxis& a : carrier->axes)
        if (a.number == k + 1) counted = a;
    }
    if (number >= now.size()) now.resize(number + 1, 0.0);
    const double v = joint_of(counted, t.additional[k], is_step);
    now[number] = is_step ? now[number] + v : v;
  }
}

std::vector<Reached> reached(const program::Trace& t, const CellPlaces& cell,
                             const Carried& carried) {
  std::vector<Reached> out;
  std::vector<double> additional;
  if (carried.carrier)
    for (const CarriedAxis& a : carried.carrier->axes) {
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
      base_T_frame = plain_pose(carriage_at(*carried.carrier, additional));
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

std::vector<Deed> deeds(const program::Trace& t, bool whole) {
  const rmp_code& c = t.program->code();
  std::vector<Deed> out;
  for (const program::TraceEntry& e : t.entries) {
    Deed one;
    one.line = e.span.line;
    if (const auto* w = std::get_if<program::TracedWrite>(&e.what)) {
      const auto& s = compared_row<rmp_code_symbol>(c.symbols, w->symbol);
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

const rmp_code_symbol* input_named(const rmp_code& code, std::string_view name) {
  const std::string wanted = post::upper(name);
  for (std::uint32_t i = 0; i < code.symbols.count; ++i)
    if (const auto& s = compared_row<rmp_code_symbol>(code.symbols, i);
        s.kind == RMP_SYMBOL_INPUT && post::upper(s.name) == wanted)
      return &s;
  return nullptr;
}
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
      if (const auto& s = compared_row<rmp_code_symbol>(read.symbols, i);
          s.kind == RMP_SYMBOL_INPUT && s.type == own->type && s.address == own->address)
        out.inputs[s.name] = value;
  }
  return out;
}

void compare(Comparison& out) {
  const std::string main_file = out.source.front().first;
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
}

}  // namespace robomosp::program_post::comparison
