// SPDX-License-Identifier: Apache-2.0
#include "program_post/read_back.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <robomosp/sdk/post_writer.h>

#include "kernel/text.h"
#include "model/controller.h"
#include "program_check/check_program.h"
#include "program_post/part_of_robot.h"
#include "program_post/robot_kinematics.h"
#include "program_post/robots.h"
#include "program_post/run_c.h"
#include "robotics/kinematics.h"
#include "spatial/pose.h"

namespace robomosp::program_post {
namespace {

using program_check::CheckedProgram, program_source::Workshop;

/// How a signal is called: its name, and the number and name that the controller's profile gives.
struct Called {
  std::string name, target;
  std::int32_t number = 0;
  std::uint32_t kind = 0, type = 0;
  std::int32_t width = 1;
  bool is_inverted = false;  ///< at the controller
};
std::vector<Called> signals_of(const rmp_code& code, const model::Controller* profile) {
  std::vector<Called> out;
  for (std::uint32_t i = 0; i < code.symbols.count; ++i) {
    const auto& s = row<rmp_code_symbol>(code.symbols, i);
    if (s.kind != RMP_SYMBOL_INPUT && s.kind != RMP_SYMBOL_OUTPUT) continue;
    Called c{s.name, {}, s.address, s.kind, s.type, s.width, false};
    for (std::size_t k = 0; profile && k < profile->signals.size(); ++k) {
      const auto& p = profile->signals[k];
      if (post::upper(p.name) != post::upper(s.name)) continue;
      c.target = p.target;
      c.is_inverted = p.is_inverted && c.type == RMP_TYPE_BOOL;
      if (p.number >= 0) c.number = p.number;
    }
    out.push_back(std::move(c));
  }
  return out;
}
bool same_word(std::string_view a, std::string_view b) { return post::upper(a) == post::upper(b); }

/// The number that a name ends with, such as 3 of do3; nothing = with none.
std::optional<std::int32_t> number_in(std::string_view name) {
  const std::size_t last = name.find_last_not_of("0123456789");
  if (last == std::string_view::npos || last + 1 == name.size() || name.size() - last > 9)
    return std::nullopt;
  return static_cast<std::int32_t>(*text::read_int(name.substr(last + 1)));
}
/// Whether `read` is what the post makes of `own`: by its name, else by its number.
bool is_called(const Called& own, const Called& read) {
  if (own.kind != read.kind || own.type != read.type || own.width != read.width) return false;
  if (same_word(own.name, read.name)) return true;
  if (!own.target.empty()) return same_word(own.target, read.name);
  return own.number == number_in(read.name).value_or(read.number);
}

/// The signal of the world that a name of the program means; empty = none.
std::string wire_of(const model::PlacedProgram& placed, const model::World& world,
                    const std::string& name) {
  for (const model::ProgramBinding& b : placed.bindings)
    if (b.kind != model::BindingKind::robot && same_word(b.name, name))
      return b.kind == model::BindingKind::signal ? b.to : std::string();
  for (const model::Signal& s : world.signals)
    if (same_word(s.name, name)) return s.name;
  return {};
}

/// The external axes of a controller, in its order; `joint` is the number of the additional joint
/// of the program, from 0.
struct Externals {
  std::vector<PostAxis> axes;
  bool is_on_carriage = false;     ///< poses are measured from the carriage of a rail
  bool is_none = false;            ///< the target has none: the rail stays where it is
  std::vector<CarriedAxis> bound;  ///< additional joints of the world
};
Result<Externals> externals_of(const Workshop& with, const ProviderInfo& target,
                               const model::Controller* record, PostCell& cell) {
  Externals out;
  robotics::ControllerProfile profile;
  if (record) profile.record = *record;
  RMP_TRY(profile.fill());
  if (cell.carrier) {
    out.bound = cell.carrier->axes;
    RMP_TRY_ASSIGN(const auto post, with.from.registry.create<Post>(target.name));
    RMP_TRY_ASSIGN(const auto kind, rail_kind(target, post->capabilities(), profile.view));
    out.is_none = kind == RailKind::none;
    out.is_on_carriage = cell.is_on_rail() && kind != RailKind::base;
  }
  // The post tells what the profile contradicts.
  if (cell.robot) RMP_TRY(profile.use(std::move(cell.maker), cell.robot_name, cell.rail));
  if (cell.carrier && !out.is_none) carry_axes(profile, cell);
  // Names are the profile's, which ends here.
  for (PostAxis a : profile.axes) {
    a.name = {};
    if (a.external && a.of_robot == 0 && a.joint >= 0) out.axes.push_back(a);
  }
  return out;
}

/// Bindings of a program that was read back, by those of the program itself; gives the outputs of
/// the world that no name of it is found for.
std::set<std::string> rebind(model::PlacedProgram& placed, const model::World& world,
                             const std::vector<Called>& own, const std::vector<Called>& read,
                             bool keeps_tool, const Externals& externals) {
  std::set<std::string> missed;
  for (const Called& o : own)
    if (o.kind == RMP_SYMBOL_OUTPUT &&
        std::none_of(read.begin(), read.end(), [&](const Called& r) { return is_called(o, r); }))
      if (const std::string wire = wire_of(placed, world, o.name); !wire.empty())
        missed.insert(wire);
  std::vector<model::ProgramBinding> out;
  for (const model::ProgramBinding& b : placed.bindings) {
    if (b.kind == model::BindingKind::robot && b.name.empty()) {
      model::ProgramBinding robot = b;
      robot.frame.clear();
      if (!keeps_tool) robot.tool.clear();
      if (robot.to.empty()) robot.to = placed.robot;
      out.push_back(std::move(robot));
    }
    // Additional joints go by their numbers, as the controller has them.
    const bool is_number =
        !b.name.empty() && b.name.find_first_not_of("0123456789") == std::string::npos;
    if (!is_number || b.kind == model::BindingKind::robot) continue;
    if (externals.axes.empty()) out.push_back(b);
    for (std::size_t k = 0; k < externals.axes.size(); ++k)
      if (text::read_int(b.name) == externals.axes[k].joint + 1) {
        out.push_back(b);
        out.back().name = std::to_string(k + 1);
      }
  }
  for (const Called& r : read) {
    const auto same =
        std::find_if(own.begin(), own.end(), [&](const Called& o) { return is_called(o, r); });
    if (same == own.end()) continue;
    const auto bound = std::find_if(
        placed.bindings.begin(), placed.bindings.end(), [&](const model::ProgramBinding& b) {
          return b.kind != model::BindingKind::robot && same_word(b.name, same->name);
        });
    model::ProgramBinding b;
    if (bound != placed.bindings.end()) {
      b = *bound;
    } else if (const auto wire = std::find_if(
                   world.signals.begin(), world.signals.end(),
                   [&](const model::Signal& s) { return same_word(s.name, same->name); });
               wire != world.signals.end()) {
      b.kind = model::BindingKind::signal;
      b.to = wire->name;
    } else if (same_word(same->name, "gripper") && same->kind == RMP_SYMBOL_OUTPUT) {
      b.kind = model::BindingKind::grip;
    } else {
      continue;
    }
    b.name = r.name;
    out.push_back(std::move(b));
  }
  placed.bindings = std::move(out);
  return missed;
}

/// The tool in the world at the end of a motion, as planned: that of `tool`, whatever the motion
/// itself moves, so that what hangs on the robot is looked at and not what a program says of it.
std::optional<Pose> world_T_end(const program_check::Check& c, const task::InspectedMotion& m,
                                const task::InspectedMotion& tool) {
  if (m.robot >= c.inspection->robots.size() || m.q_target.empty()) return std::nullopt;
  const task::InspectedRobot& robot = c.inspection->robots[m.robot];
  if (m.q_target.size() != robot.model->coordinate_count()) return std::nullopt;
  Pose base_T_joint;
  if (tool.tip_joint >= 0) {
    std::vector<Pose> frames(robot.model->joints.size());
    robotics::forward_kinematics(*robot.model, m.q_target, frames);
    base_T_joint = frames[static_cast<std::size_t>(tool.tip_joint)];
  }
  return spatial::compose(robot.world_T_base, spatial::compose(base_T_joint, tool.joint_T_tip));
}
double angle_between(const Pose& a, const Pose& b) {
  const auto p = post::quaternion(a.R), q = post::quaternion(b.R);
  double dot = 0;
  for (std::size_t i = 0; i < 4; ++i) dot += p[i] * q[i];
  return 2 * std::acos(std::min(1.0, std::fabs(dot))) * post::kDegree;
}
double millimetres_between(const Pose& a, const Pose& b) {
  return 1000 * std::hypot(a.p[0] - b.p[0], a.p[1] - b.p[1], a.p[2] - b.p[2]);
}

/// A change of a signal of the world.
struct Change {
  std::string signal;
  double time = 0, value = 0;
};
std::vector<Change> changes_of(const recording::Recording& r, const std::set<std::string>& but) {
  std::vector<Change> out;
  for (const recording::Column& c : r.columns) {
    if (!c.name.starts_with("signal.") || but.contains(c.name.substr(7))) continue;
    for (std::size_t i = 1; i < c.values.size(); ++i)
      if (c.values[i] != c.values[i - 1])
        out.push_back({c.name.substr(7), r.columns.front().values[i], c.values[i]});
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const Change& a, const Change& b) { return a.time < b.time; });
  return out;
}

/// Of the joints of the robot that moves first, in rad/s; 0 = none has a limit.
double slowest_joint(const program_check::Check& c) {
  double least = 0;
  if (c.motions.empty() || c.motions[0].motion.robot >= c.inspection->robots.size()) return least;
  for (const JointModel& j : c.inspection->robots[c.motions[0].motion.robot].model->joints)
    if (j.type == JointType::revolute && j.max_velocity > 0 && std::isfinite(j.max_velocity))
      least = least == 0 ? j.max_velocity : std::min(least, j.max_velocity);
  return least;
}

constexpr double kReadBackMm = 0.1, kReadBackDegrees = 0.05, kSameJoint = 0.5;
constexpr double kSameShare = 0.02, kSameSeconds = 0.1;  ///< of the time of a whole run

/// What runs beside the program.
struct Reading {
  const std::vector<program_check::MotionReport>& motions;
  const program_check::Check& robots;  ///< of its motions
  std::vector<Change> changes;
  std::optional<double> seconds;  ///< nothing = its language has no times
  bool is_commanded = false;      ///< ends are where it went, not where motions were to go
};

class Beside {
 public:
  /// `own_changes`: of signals that both switch. `missed`: signals of the world that `read` has
  /// not.
  Beside(const program_check::Check& own, std::vector<Change> own_changes, const Reading& read,
         const std::set<std::string>& missed, const Externals& externals, RunBeside& out)
      : own_(own),
        own_changes_(std::move(own_changes)),
        read_(read),
        missed_(missed),
        externals_(externals),
        out_(out) {}
  void run() {
    motions();
    times();
    signals();
  }

 private:
  void tell(const char* kind, const rmp_span& at, std::string text) {
    if (told_.emplace(kind, at.line).second)
      out_.differences.push_back({kind, at.file, at.line, std::move(text)});
  }
  /// Ends one after the other: what was read back may have more motions, such as pieces of an arc.
  void motions() {
    const auto& a = own_.motions;
    const auto& b = read_.motions;
    out_.motions = a.size(), out_.read_motions = b.size();
    std::size_t next = 0;
    for (const program_check::MotionReport& m : a) {
      const bool is_cut = read_.is_commanded && m.motion.is_cut;
      const auto here = is_cut ? recorded_end(m.motion) : world_T_end(own_, m.motion, m.motion);
      if (!here || !m.motion.is_carried_out) continue;
      // How far a robot goes on behind UNTIL is its own, and increments begin there.
      is_behind_cut_ = is_cut || (is_behind_cut_ && m.motion.is_incremental);
      const rmp_span& at = m.motion.place.span;
      if (next >= b.size()) {
        tell("motion", at, "what was read back ends before this motion");
        return;
      }
      std::size_t match = b.size(), nearest = next;
      double least = 0;
      for (std::size_t k = next; k < b.size() && k < next + 2000; ++k) {
        const auto there = world_T_end(read_.robots, b[k].motion, m.motion);
        if (!there) continue;
        const double mm = millimetres_between(*here, *there),
                     degrees = angle_between(*here, *there);
        if (k == next || mm < least) nearest = k, least = mm;
        if (mm <= kReadBackMm && degrees <= kReadBackDegrees) {
          match = k;
          break;
        }
        // Only pieces of one motion are passed over.
        if (a.size() == b.size()) break;
      }
      const std::size_t k = match < b.size() ? match : nearest;
      const auto there = world_T_end(read_.robots, b[k].motion, m.motion);
      additional(m.motion, next, k);
      next = k + 1;
      if (!there) {
        tell("point", at, "what was read back does not come to an end of this motion");
        continue;
      }
      ++out_.compared;
      const double mm = millimetres_between(*here, *there), degrees = angle_between(*here, *there);
      if (is_behind_cut_) {
        if (match == b.size())
          tell("until", at,
               "behind UNTIL the tool is " + text::print_rounded(mm, 4) +
                   " mm in the world from where the run stops");
        continue;
      }
      out_.most_mm = std::max(out_.most_mm, mm);
      out_.most_degrees = std::max(out_.most_degrees, degrees);
      if (match == b.size()) {
        tell(mm > kReadBackMm ? "point" : "orientation", at,
             "the tool ends " + text::print_rounded(mm, 4) + " mm and " +
                 text::print_rounded(degrees, 4) +
                 " degrees in the world from where the run has it");
        continue;
      }
      joints(m.motion, b[k].motion);
    }
  }
  /// Where the run is at the end of a motion that was cut.
  std::optional<Pose> recorded_end(task::InspectedMotion m) const {
    const recording::Recording& r = *own_.recording;
    const std::string name = own_.inspection->robots[m.robot].name;
    const auto& times = r.columns.front().values;
    const auto row = static_cast<std::size_t>(
        std::lower_bound(times.begin(), times.end(), m.end - 1e-9) - times.begin());
    for (std::size_t i = 0; i < m.q_target.size(); ++i)
      for (const recording::Column& c : r.columns)
        if (c.name == name + ".q" + std::to_string(i + 1) && !c.values.empty())
          m.q_target[i] = c.values[std::min(row, c.values.size() - 1)];
    return world_T_end(own_, m, m);
  }
  /// Additional joints at the end of a motion, as far as the program gives them; those that the
  /// reader leaves out are where they were.
  void additional(const task::InspectedMotion& a, std::size_t from, std::size_t to) {
    for (std::size_t k = from; k <= to && k < read_.motions.size(); ++k) {
      const auto& given = read_.motions[k].motion.additional;
      if (given.size() > additional_.size()) additional_.resize(given.size(), 0.0);
      std::copy(given.begin(), given.end(), additional_.begin());
    }
    std::vector<double> wanted = a.additional;
    // As the joints count; where the controller has none, they are not compared.
    constexpr double kNotThere = std::numeric_limits<double>::quiet_NaN();
    for (const CarriedAxis& each : externals_.bound)
      if (each.number <= wanted.size())
        wanted[each.number - 1] =
            externals_.is_none ? kNotThere : joint_of(each, wanted[each.number - 1], false);
    if (!read_.is_commanded && !externals_.axes.empty()) {
      // As the controller counts its external axes.
      std::vector<double> there;
      for (const PostAxis& e : externals_.axes) {
        const auto n = static_cast<std::size_t>(e.joint);
        there.push_back(n < wanted.size() ? e.sign * wanted[n] + e.offset : kNotThere);
      }
      wanted = std::move(there);
    }
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      const double got = i < additional_.size() ? additional_[i] : 0;
      if (!(std::fabs(got - wanted[i]) > kSameJoint)) continue;
      tell("additional", a.place.span,
           "additional joint " + std::to_string(i + 1) + " ends at " + text::print_rounded(got, 4) +
               ", and in the run at " + text::print_rounded(wanted[i], 4));
      return;
    }
  }
  void joints(const task::InspectedMotion& a, const task::InspectedMotion& b) {
    if (a.q_target.size() != b.q_target.size()) return;
    double most = 0;
    std::size_t which = 0;
    const auto& joints = own_.inspection->robots[a.robot].model->joints;
    for (std::size_t i = 0; i < a.q_target.size(); ++i) {
      const bool is_linear = i < joints.size() && joints[i].type == JointType::prismatic;
      const double d =
          std::fabs(a.q_target[i] - b.q_target[i]) * (is_linear ? 1000 : post::kDegree);
      if (d > most) most = d, which = i;
    }
    out_.most_joint = std::max(out_.most_joint, most);
    if (most > kSameJoint)
      tell("configuration", a.place.span,
           own_.inspection->robots[a.robot].maker->before_joint(which) + "joint " +
               std::to_string(which + 1) + " ends " + text::print_rounded(most, 4) +
               " degrees or mm from where the run has it");
  }
  void times() {
    out_.seconds = own_.duration, out_.read_seconds = read_.seconds.value_or(0);
    out_.has_times = read_.seconds.has_value();
    if (!read_.seconds) return;
    const double by = std::fabs(out_.seconds - out_.read_seconds);
    if (by > kSameSeconds && by > kSameShare * out_.seconds)
      tell("time", {},
           "the run takes " + text::print_rounded(out_.seconds, 5) + " s, what was read back " +
               text::print_rounded(out_.read_seconds, 5) + " s");
  }
  void signals() {
    for (const std::string& each : missed_)
      tell("signal", {},
           "signal " + text::quote(each) +
               " is not compared, since the reader has no output of its number and kind");
    const auto& a = own_changes_;
    const auto& b = read_.changes;
    out_.changes = a.size(), out_.read_changes = b.size();
    for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
      if (a[i].signal == b[i].signal && a[i].value == b[i].value) continue;
      tell("output", {},
           "at t = " + text::print_rounded(a[i].time, 5) + " s signal " + text::quote(a[i].signal) +
               " becomes " + text::print_rounded(a[i].value, 5) + ", and as it was read back " +
               text::quote(b[i].signal) + " becomes " + text::print_rounded(b[i].value, 5));
      return;
    }
    if (a.size() != b.size())
      tell("output", {},
           "signals of the world change " + std::to_string(a.size()) +
               " times in the run, and as it was read back " + std::to_string(b.size()));
  }

  const program_check::Check& own_;
  std::vector<Change> own_changes_;
  const Reading& read_;
  const std::set<std::string>& missed_;  ///< signals of the world
  const Externals& externals_;
  RunBeside& out_;
  std::vector<double> additional_;  ///< as they were read
  bool is_behind_cut_ = false;
  std::set<std::pair<std::string, std::uint32_t>> told_;
};

/// The place of a checked program in its world; an empty one where it runs alone.
model::PlacedProgram placed_of(const CheckedProgram& c) {
  for (const model::PlacedProgram& p : c.snapshot->get(c.world)->programs)
    if (p.name == c.name) return p;
  return {};
}
const recording::Column* signal_column(const recording::Recording& r, const std::string& signal) {
  for (const recording::Column& c : r.columns)
    if (c.name == "signal." + signal) return &c;
  return nullptr;
}

/// A program in C: compiled and run beside the run of the program.
Result<void> run_c_beside(const Workshop& shop, const PostedFiles& files, bool is_pa10,
                          const model::Controller* profile, const CheckedProgram& own,
                          const PostCell& cell, const Externals& externals, RunBeside& out) {
  out.reader = is_pa10 ? "the C compiler and a recorder of the PA-10's library"
                       : "the C compiler and a recorder of ROBOMOSP's client";
  if (profile && !(profile->prologue.empty() && profile->epilogue.empty())) {
    out.not_run =
        "the profile has lines of C (prologue, epilogue), and what a record says is not run here";
    return {};
  }
  const model::World& world = *own.snapshot->get(own.world);
  const model::PlacedProgram placed = placed_of(own);
  CInputs with;
  with.is_pa10 = is_pa10;
  std::unique_ptr<HostKinematics> kinematics;
  if (cell.robot) {
    RMP_TRY_ASSIGN(auto bound, shop.bind_ik(cell.robot, cell.ik));
    kinematics = std::make_unique<HostKinematics>(cell.robot, std::move(bound), shop.progress);
    with.start = cell.start;
    with.start.resize(cell.robot->coordinate_count(), 0.0);
  }
  with.kinematics = kinematics.get();
  const auto called = signals_of(own.code->code(), profile);
  std::map<int, std::pair<std::string, bool>> wires;  // outputs by number
  for (const Called& c : called) {
    const std::string wire = wire_of(placed, world, c.name);
    const recording::Column* column =
        wire.empty() ? nullptr : signal_column(*own.check.recording, wire);
    if (c.kind == RMP_SYMBOL_OUTPUT) {
      if (column) wires[c.number] = {wire, c.is_inverted};
      continue;
    }
    double value = column && !column->values.empty() ? column->values.front() : 0;
    for (std::size_t i = 1; column && i < column->values.size(); ++i)
      if (column->values[i] != value) {
        out.not_run = "input " + text::quote(c.name) +
                      " changes in the run, and a program in C is run with inputs that stay";
        return {};
      }
    if (c.is_inverted) value = value == 0;
    with.inputs[c.number] = value;
  }
  RMP_TRY_ASSIGN(const CCommands c, run_c(files, with, shop.progress));
  if (!c.not_run.empty()) {
    out.not_run = c.not_run;
    return {};
  }
  std::vector<program_check::MotionReport> motions;
  const std::size_t robot = own.check.motions.empty() ? 0 : own.check.motions.front().motion.robot;
  for (const CCommands::End& e : c.ends) {
    program_check::MotionReport m;
    m.motion.robot = robot;
    m.motion.q_target = e.q;
    m.motion.additional = e.additional;
    if (cell.is_on_rail()) {
      // Its joints are those of the arm; what it sets besides carries it.
      const Carrier& carrier = *cell.carrier;
      const std::vector<double> chain = chain_at(carrier, e.additional);
      m.motion.q_target.insert(m.motion.q_target.begin(), chain.begin(),
                               chain.begin() + static_cast<std::ptrdiff_t>(carrier.rail));
    }
    m.motion.is_carried_out = true;
    motions.push_back(std::move(m));
  }
  // Signals as they change: what an output is switched to again is no change.
  std::set<std::string> others;
  std::map<std::string, double> now;
  for (const recording::Column& column : own.check.recording->columns)
    if (column.name.starts_with("signal.")) others.insert(column.name.substr(7));
  for (const auto& [number, wire] : wires) {
    others.erase(wire.first);
    now[wire.first] = signal_column(*own.check.recording, wire.first)->values.front();
  }
  Reading read{motions, own.check, {}, {}, true};
  if (c.has_times) read.seconds = c.seconds;
  for (const CCommands::Output& o : c.outputs) {
    const auto it = wires.find(o.number);
    if (it == wires.end()) continue;
    const double value = it->second.second ? double(o.value == 0) : o.value;
    if (std::exchange(now[it->second.first], value) != value)
      read.changes.push_back({it->second.first, o.time, value});
  }
  const std::set<std::string> none;
  Beside(own.check, changes_of(*own.check.recording, others), read, none, externals, out).run();
  const auto axis_of = [&](std::size_t joint) {
    const auto& robots = own.check.inspection->robots;
    return robots.size() == 1 ? robots.front().maker->before_joint(joint) : std::string();
  };
  if (!c.rates.empty() && cell.robot)
    for (std::size_t i = 0; i < c.rates.size() && i < cell.robot->joints.size(); ++i) {
      const double most = cell.robot->joints[i].max_velocity;
      if (!std::isfinite(most) || !(most > 0) || c.rates[i] <= most * 1.01) continue;
      out.differences.push_back({"time", 0, 0,
                                 axis_of(i) + "joint " + std::to_string(i + 1) +
                                     " goes from one of its " + std::to_string(c.cycles) +
                                     " cycles to the next with " +
                                     text::print_rounded(100 * c.rates[i] / most, 4) +
                                     " % of its greatest speed, which the run keeps to"});
      break;
    }
  return {};
}

}  // namespace

Result<RunBeside> run_beside(const Workshop& with, const CellWish& wish, AnyId controller,
                             const std::string& asked_symbol, const PostedFiles& files,
                             const ProviderInfo& target) {
  RunBeside out;
  const model::Controller* profile = nullptr;
  if (controller.number != 0)
    profile = &std::get<model::OtherContent>(with.snapshot().find(controller)->body)
                   .as<model::Controller>();
  // Only what our own posts write is compiled and run.
  const bool is_c = target.shipped && (target.name == "c" || target.name == "pa10");
  ReadBack read;
  if (!is_c) {
    RMP_TRY_ASSIGN(read, read_posted(with, files, profile));
  }
  out.reader = read.reader;
  out.not_said = read.not_said.size();
  if (!is_c && !read.program) {
    out.not_run = read.not_read;
    return out;
  }
  program_check::CheckTask asked;
  asked.program = wish.program;
  asked.place = wish.place;
  if (program_source::places_of(with.snapshot(), wish.program).empty()) asked.robot = wish.robot;
  asked.frees_unbound = true;
  asked.contacts = asked.torques = false;
  asked.clearance = 0;
  asked.condition = 1e12;
  RMP_TRY_ASSIGN(const CheckedProgram own, check_program(with, asked));
  std::string symbol = asked_symbol;
  if (const auto moved = robots_that_move(own.code->code()); symbol.empty() && moved.size() == 1)
    symbol = moved.front();
  RMP_TRY_ASSIGN(PostCell cell, post_cell(with, wish, own.code, symbol));
  RMP_TRY_ASSIGN(const Externals externals, externals_of(with, target, profile, cell));
  if (is_c) {
    RMP_TRY(run_c_beside(with, files, target.name == "pa10", profile, own, cell, externals, out));
    return out;
  }
  // What 100 % of a joint's speed are is the robot's: that of its slowest one.
  if (const double slowest = slowest_joint(own.check); slowest > 0) {
    RMP_TRY_ASSIGN(read, read_posted(with, files, profile, slowest));
    if (!read.program) {
      out.not_run = read.not_read;
      return out;
    }
  }
  program_check::InItsPlace instead;
  std::set<std::string> missed;
  instead.code = read.program;
  // CRCL leaves the tool to the robot, whose controlled point it is.
  instead.moves_flange = target.name != "crcl";
  const auto own_signals = signals_of(own.code->code(), profile),
             read_signals = signals_of(read.program->code(), nullptr);
  instead.bind = [&](model::PlacedProgram& placed, const model::World& world) {
    missed = rebind(placed, world, own_signals, read_signals, !instead.moves_flange, externals);
  };
  if (cell.carrier) {
    instead.is_on_carriage = externals.is_on_carriage;
    for (std::size_t k = 0; k < externals.axes.size(); ++k)
      instead.counted[k + 1] = {externals.axes[k].sign, externals.axes[k].offset};
  }
  auto again = check_program(with, asked, &instead);
  if (!again.ok()) {
    if (again.error().code == ErrorCode::cancelled) return std::move(again).error();
    out.not_run =
        "as reader " + read.reader + " has it, it does not run: " + again.error().sentence();
    return out;
  }
  const Reading beside{again->check.motions, again->check,
                       changes_of(*again->check.recording, missed), again->check.duration, false};
  Beside(own.check, changes_of(*own.check.recording, missed), beside, missed, externals, out).run();
  return out;
}

std::string beside_sentence(const RunBeside& b) {
  if (!b.not_run.empty())
    return "The post was not compared with the run: " + b.not_run +
           (b.not_run.ends_with('.') ? "" : ".");
  std::string out =
      "Read back by " + b.reader + " and run in the same world: " + std::to_string(b.compared) +
      " of " + std::to_string(b.motions) + " ends of motions, at most " +
      text::print_rounded(b.most_mm, 3) + " mm, " + text::print_rounded(b.most_degrees, 3) +
      " degrees and, of a joint, " + text::print_rounded(b.most_joint, 3) +
      " degrees or mm apart; " +
      (b.has_times ? text::print_rounded(b.read_seconds, 5) + " s for " +
                         text::print_rounded(b.seconds, 5) + " s; "
                   : std::string("no times, which its library has none of; ")) +
      std::to_string(b.read_changes) + " changes of signals for " + std::to_string(b.changes) + ".";
  if (b.not_said > 0)
    out += " The reader left " + std::to_string(b.not_said) +
           (b.not_said == 1 ? " statement out." : " statements out.");
  return out;
}

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

}  // namespace robomosp::program_post
