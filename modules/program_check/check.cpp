// SPDX-License-Identifier: Apache-2.0
#include "program_check/check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>

#include "kernel/text.h"
#include "robotics/joint_label.h"
#include "robotics/kinematics.h"
#include "robotics/singularity.h"
#include "robotics/tip_motion.h"
#include "sim/ik_choice.h"
#include "sim/member_axes.h"
#include "sim/recording_columns.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::program_check {
namespace {

using recording::Column;
using recording::Recording;
using task::InspectedEvent;
using task::InspectedMotion;
using task::ProgramInspection;
using text::print_rounded;
using text::quote;

constexpr double kDegree = 180 / std::numbers::pi;
constexpr double kSame = 1e-9;  ///< times [s]

/// A number in the unit that people read: degrees and mm.
struct Shown {
  double factor = 1;
  std::string unit;
  [[nodiscard]] std::string text(double v, int digits = 4) const {
    return print_rounded(v * factor, digits) + " " + unit;
  }
};
Shown shown(const std::string& unit) {
  for (const auto& [si, factor, word] : {std::tuple{"rad", kDegree, "deg"}, {"m", 1e3, "mm"}})
    if (unit.starts_with(si) &&
        (unit.size() == std::string_view(si).size() || unit[std::string_view(si).size()] == '/'))
      return {factor, word + unit.substr(std::string_view(si).size())};
  return {1, unit};
}

std::vector<double> joints_at(const Recording& r, const task::InspectedRobot& robot,
                              std::size_t row) {
  std::vector<double> q;
  const std::size_t n = robot.model->coordinate_count();
  for (std::size_t j = 0; j < n; ++j) {
    const Column* c = r.find(robot.name + ".q" + std::to_string(j + 1));
    q.push_back(c ? c->values[row] : 0);
  }
  return q;
}

Pose pose_of_tip(const task::InspectedRobot& robot, const InspectedMotion& m,
                 const std::vector<double>& q) {
  std::vector<Pose> frames(robot.model->joints.size());
  robotics::forward_kinematics(*robot.model, q, frames);
  const Pose base_T_joint =
      m.tip_joint < 0 ? Pose{} : frames[static_cast<std::size_t>(m.tip_joint)];
  return spatial::compose(robot.world_T_base, spatial::compose(base_T_joint, m.joint_T_tip));
}

class Checker {
 public:
  Checker(const sim::Simulator& sim, const Options& options, Check& out, Progress& progress)
      : sim_(sim), options_(options), out_(out), told_(*out.inspection), progress_(progress) {}

  Result<void> run() {
    index();
    for (std::size_t i = 0; i < out_.motions.size(); ++i) motion_faults(i);
    for (std::size_t r = 0; r < told_.robots.size(); ++r) {
      const bool is_additional =
          motions_of_[r].empty() &&
          std::find(told_.additional.begin(), told_.additional.end(), r) != told_.additional.end();
      if (motions_of_[r].empty() && !is_additional) continue;
      RMP_TRY(limits(r));
      if (is_additional) continue;
      axis_limits(r);
      RMP_TRY(straight_motions(r));
    }
    events();
    if (options_.contacts) RMP_TRY(contacts_of_run());
    else out_.not_checked.emplace_back("Contacts: not requested.");
    coverage();
    finish();
    return {};
  }

 private:
  [[nodiscard]] const std::vector<double>& time() const {
    return out_.recording->columns.front().values;
  }
  [[nodiscard]] const task::InspectedRobot& robot(std::size_t r) const { return told_.robots[r]; }
  [[nodiscard]] std::string joint_name(std::size_t r, std::size_t j) const {
    const std::string& name = robot(r).model->joints[j].name;
    const std::string number = "joint " + std::to_string(j + 1);
    return name.empty() || name == number ? number : robotics::joint_label(*robot(r).model, j);
  }

  void index() {
    motions_of_.resize(told_.robots.size());
    for (const task::InspectedRobot& each : told_.robots)
      axes_.push_back(sim::member_axes(sim_.snapshot, out_.recording->world, each.name));
    const std::size_t rows = out_.recording->rows();
    is_jump_.assign(rows, false);
    for (std::size_t i = 0; i < out_.motions.size(); ++i) {
      const InspectedMotion& m = out_.motions[i].motion;
      if (m.robot >= told_.robots.size()) continue;
      motions_of_[m.robot].push_back(i);
      if (!m.is_jump) continue;
      for (std::size_t row = first_row(m.start - kSame); row < rows && time()[row] <= m.end + kSame;
           ++row)
        is_jump_[row] = true;
    }
    // Of which motion a row of a robot is.
    motion_at_.assign(told_.robots.size(), std::vector<std::size_t>(rows, kNone));
    for (std::size_t r = 0; r < told_.robots.size(); ++r)
      for (const std::size_t i : motions_of_[r]) {
        const InspectedMotion& m = out_.motions[i].motion;
        for (std::size_t row = first_row(m.start - kSame);
             row < rows && time()[row] <= m.end + kSame; ++row)
          motion_at_[r][row] = i;
      }
    // What its additional joints move goes along with the motions of its arms.
    for (const std::size_t r : told_.additional) {
      if (r >= told_.robots.size() || !motions_of_[r].empty()) continue;
      for (std::size_t i = 0; i < out_.motions.size(); ++i) {
        const InspectedMotion& m = out_.motions[i].motion;
        for (std::size_t row = first_row(m.start - kSame);
             row < rows && time()[row] <= m.end + kSame; ++row)
          motion_at_[r][row] = i;
      }
    }
  }
  [[nodiscard]] std::size_t first_row(double t) const {
    return static_cast<std::size_t>(std::lower_bound(time().begin(), time().end(), t) -
                                    time().begin());
  }
  /// The motion that a time belongs to, of any robot that the program moves: the one under way,
  /// else the last one before.
  [[nodiscard]] std::size_t motion_near(double t) const {
    std::size_t best = kNone;
    double latest = -1;
    for (std::size_t i = 0; i < out_.motions.size(); ++i) {
      const InspectedMotion& m = out_.motions[i].motion;
      if (m.start <= t + kSame && m.end >= t - kSame) return i;
      if (m.start <= t && m.start > latest) latest = m.start, best = i;
    }
    return best == kNone && !out_.motions.empty() ? 0 : best;
  }

  void add(Fault f) {
    if (f.motion != kNone) {
      MotionReport& m = out_.motions[f.motion];
      m.has_fault = true;
      m.worst = std::min(m.worst, f.severity);
    }
    const auto& s = f.place.span;
    const std::tuple key(
        s.file, s.line, s.column, f.kind, f.robot, f.joint, f.a, f.b,
        f.kind == FaultKind::ignored || f.kind == FaultKind::motion ? f.message : "");
    const auto [it, is_new] = rows_.emplace(key, out_.faults.size());
    if (is_new) {
      out_.faults.push_back(std::move(f));
      return;
    }
    Fault& old = out_.faults[it->second];
    const std::size_t times = old.times + 1;
    if (f.severity < old.severity ||
        (f.severity == old.severity && f.has_values && f.excess > old.excess))
      old = std::move(f);
    old.times = times;
  }
  [[nodiscard]] Fault fault_of(std::size_t i, FaultKind kind, Severity severity) const {
    Fault f;
    f.kind = kind, f.severity = severity;
    f.motion = i;
    if (i == kNone) return f;
    const InspectedMotion& m = out_.motions[i].motion;
    f.place = m.place;
    f.from = m.start, f.to = m.end, f.at = m.start;
    if (m.robot < told_.robots.size()) f.robot = robot(m.robot).name;
    return f;
  }

  /// A motion that could not be carried out.
  void motion_faults(std::size_t i) {
    const InspectedMotion& m = out_.motions[i].motion;
    if (m.is_carried_out) {
      if (m.has_until && !m.is_cut) {
        Fault f = fault_of(i, FaultKind::until, Severity::note);
        f.message = "the condition of UNTIL did not come true, and the motion reached its target";
        f.hint = "Set its signals in another program or task to check this case.";
        add(std::move(f));
      }
      return;
    }
    if (m.error.empty()) {
      jumped_.insert(i);
      return;
    }
    const auto& t = m.trouble;
    const bool is_of_joints = m.is_unreachable && t.joint >= 0 && !t.world_T_target;
    Fault f = fault_of(i,
                       is_of_joints       ? FaultKind::joint_limit
                       : m.is_unreachable ? FaultKind::reach
                                          : FaultKind::motion,
                       Severity::error);
    f.message = m.error, f.hint = m.hint;
    if (t.joint >= 0 && m.robot < told_.robots.size() &&
        static_cast<std::size_t>(t.joint) < robot(m.robot).model->joints.size()) {
      const JointModel& joint = robot(m.robot).model->joints[static_cast<std::size_t>(t.joint)];
      f.joint = t.joint;
      if (is_of_joints) {
        f.unit = joint.type == JointType::revolute ? "rad" : "m";
        f.value = t.value, f.excess = t.excess;
        f.limit = t.value > joint.upper ? joint.upper : joint.lower;
        f.has_values = true;
        f.message += ", " + shown(f.unit).text(t.excess) + " beyond its limit";
      }
    }
    if (!is_of_joints && t.excess > 0) {
      f.excess = t.excess, f.unit = "m", f.has_values = true;
    }
    if (t.world_T_target) f.has_position = true, f.position = t.world_T_target->p;
    if (!m.way.empty()) {
      const auto reached = std::count(m.is_reached.begin(), m.is_reached.end(), true);
      const double share =
          100.0 * static_cast<double>(reached) / static_cast<double>(m.is_reached.size());
      f.message += "; " + print_rounded(share, 3) + " % of the path is reached";
    }
    if (m.is_displaced)
      f.hint += (f.hint.empty() ? "" : " ") +
                std::string("It started elsewhere, since the previous motion failed.");
    add(std::move(f));
  }

  /// Positions, velocities, accelerations and torques of joints against their limits.
  Result<void> limits(std::size_t r) {
    const std::string& name = robot(r).name;
    const auto& joints = robot(r).model->joints;
    const auto limited = [&](double JointModel::*limit) {
      return std::any_of(joints.begin(), joints.end(),
                         [&](const JointModel& j) { return std::isfinite(j.*limit); });
    };
    recording::RecordingPtr rec = out_.recording;
    if (!options_.torques) {
      out_.not_checked.emplace_back("Torques: not requested.");
    } else if (limited(&JointModel::max_force)) {
      const std::string torque = "torque";
      auto with = sim::with_quantities_of(sim_, *rec, name, {&torque, 1}, progress_);
      if (with.ok()) rec = out_.recording = *with;
      else if (with.error().code == ErrorCode::cancelled) return std::move(with).error();
      else out_.not_checked.push_back("Torques of " + name + ": " + with.error().sentence());
    }
    std::vector<std::string> unlimited;
    for (const auto& [limit, what] : {std::pair{&JointModel::max_velocity, "velocity"},
                                      {&JointModel::max_acceleration, "acceleration"},
                                      {&JointModel::max_force, "torque"}})
      if (!limited(limit)) unlimited.emplace_back(what);
    if (std::any_of(joints.begin(), joints.end(),
                    [](const JointModel& j) { return std::isfinite(j.max_jerk); }))
      out_.not_checked.push_back("Jerk: joints of " + name +
                                 " have jerk limits, but a run has no jerk column.");
    for (const auto& [limit, what] : {std::pair{&JointModel::max_velocity, "velocity"},
                                      {&JointModel::max_acceleration, "acceleration"},
                                      {&JointModel::max_force, "torque"}}) {
      std::vector<std::string> without;
      for (std::size_t j = 0; j < joints.size(); ++j)
        if (!std::isfinite(joints[j].*limit))
          without.push_back(axes_[r].before_joint(j) + "joint " + std::to_string(j + 1));
      if (!without.empty() && without.size() < joints.size())
        out_.not_checked.push_back("Without a limit of the " + std::string(what) + ", of " + name +
                                   ": " + text::enumerate(without) + ".");
    }
    if (!unlimited.empty())
      out_.not_checked.push_back("No joint of " + name + " has a limit of its " +
                                 text::enumerate(unlimited) +
                                 ", so there was nothing to compare with.");
    struct Quantity {
      const char *stem, *what;
      FaultKind kind;
      Severity severity;
      const char* hint;
    };
    constexpr Quantity kQuantities[] = {
        {".q", "position", FaultKind::joint_limit, Severity::error,
         "Move the target, or choose another configuration (STATUS, TURNS)."},
        {".qd", "velocity", FaultKind::speed, Severity::error,
         "Give a lower SPEED or SPEED_ORI, or move there with PTP."},
        {".qdd", "acceleration", FaultKind::acceleration, Severity::warning,
         "Give a lower ACC, or a lower SPEED where the path bends."},
        {".tau", "torque", FaultKind::torque, Severity::error,
         "Give a lower ACC or SPEED, a lighter load, or a configuration nearer to the base."}};
    const std::size_t rows = rec->rows();
    for (const Quantity& q : kQuantities)
      for (std::size_t j = 0; j < joints.size(); ++j) {
        const Column* c = rec->find(name + q.stem + std::to_string(j + 1));
        if (!c || (!std::isfinite(c->lower) && !std::isfinite(c->upper))) continue;
        const double size = std::max(std::isfinite(c->lower) ? std::fabs(c->lower) : 0,
                                     std::isfinite(c->upper) ? std::fabs(c->upper) : 0);
        const double slack =
            std::max(1e-9, 1e-3 * size * (q.kind == FaultKind::joint_limit ? 0 : 1));
        const bool is_rate = q.kind == FaultKind::speed;
        // The worst row of each motion.
        struct Rows {
          std::size_t worst, first, last;
        };
        std::map<std::size_t, Rows> worst;
        const auto excess_at = [&](std::size_t row) {
          return std::max(c->values[row] - c->upper, c->lower - c->values[row]);
        };
        for (std::size_t row = 0; row < rows; ++row) {
          const std::size_t i = motion_at_[r][row];
          if (i == kNone || is_jump_[row] || !out_.motions[i].motion.is_carried_out) continue;
          if (is_rate && c->upper > 0 && out_.motions[i].motion.robot == r) {
            const double share = std::fabs(c->values[row]) / c->upper;
            if (share > out_.motions[i].utilisation) {
              out_.motions[i].utilisation = share;
              out_.motions[i].utilised = static_cast<std::int32_t>(j);
            }
          }
          if (!(excess_at(row) > slack)) continue;
          Rows& is = worst.emplace(i, Rows{row, row, row}).first->second;
          is.last = row;
          if (excess_at(row) > excess_at(is.worst)) is.worst = row;
        }
        for (const auto& [i, is] : worst) {
          const std::size_t row = is.worst;
          Fault f = fault_of(i, q.kind, q.severity);
          f.at = time()[row], f.from = time()[is.first], f.to = time()[is.last];
          f.joint = static_cast<std::int32_t>(j);
          f.has_values = true;
          f.value = c->values[row];
          f.limit = f.value > c->upper ? c->upper : c->lower;
          f.excess = excess_at(row);
          f.unit = c->unit;
          const Shown unit = shown(c->unit);
          const bool is_of_place = q.kind == FaultKind::joint_limit;
          f.message =
              (is_of_place ? axes_[r].before_place(j, q_at(r, row)) : axes_[r].before_joint(j)) +
              joint_name(r, j) + " of " + name + " has " +
              (is_of_place                         ? "a "
               : q.kind == FaultKind::acceleration ? "an "
                                                   : "a ") +
              q.what + " of " + unit.text(is_of_place ? f.value : std::fabs(f.value)) + ", " +
              unit.text(f.excess) + " beyond its limit of " +
              unit.text(is_of_place ? f.limit : std::fabs(f.limit));
          f.hint = q.hint;
          f.robot = name;
          place_of_tip(out_.motions[i].motion.robot, row, f);
          add(std::move(f));
        }
      }
    return {};
  }

  /// Joints against the axes of the controller's record, and of the robot where these are limited
  /// other than by the limits of their joints.
  void axis_limits(std::size_t r) {
    const std::string& name = robot(r).name;
    for (const AxisLimit& axis : options_.axes)
      if (axis.robot == name) axis_limit(r, axis, quote(options_.controller));
    const auto& joints = robot(r).model->joints;
    for (const PostAxis& a : axes_[r].axes()) {
      const auto entry = static_cast<std::size_t>(a.joint);
      if (a.joint < 0 || entry >= joints.size() || !(a.lower < a.upper)) continue;
      const double scale = axis_scale(a, nullptr);
      double lower = a.sign * joints[entry].lower * scale + a.offset,
             upper = a.sign * joints[entry].upper * scale + a.offset;
      if (lower > upper) std::swap(lower, upper);
      constexpr double kSameLimit = 1e-6;  // [degrees or mm]
      if (a.coupled.empty() && a.lower <= lower + kSameLimit && a.upper >= upper - kSameLimit)
        continue;
      AxisLimit own{name, std::string(a.name), entry, {}, a.offset, a.lower, a.upper};
      own.factors.emplace_back(entry, a.sign);
      for (std::size_t k = 0; k < a.coupled.size(); ++k)
        if (a.coupled[k] != 0) own.factors.emplace_back(k, a.coupled[k]);
      axis_limit(r, own, {});
    }
  }

  /// `controller`: with its quotes; "" = the axis is limited by the robot's record.
  void axis_limit(std::size_t r, const AxisLimit& axis, const std::string& controller) {
    const std::string& name = robot(r).name;
    const Column* c = nullptr;
    std::vector<std::pair<const Column*, double>> terms;
    for (const auto& [joint, factor] : axis.factors) {
      const Column* each = out_.recording->find(name + ".q" + std::to_string(joint + 1));
      if (joint == axis.joint) c = each;
      if (each) terms.emplace_back(each, factor);
      else
        out_.not_checked.push_back(
            "Axis " + axis.name + " of " +
            (controller.empty() ? "robot " + quote(name) : "controller " + controller) +
            " is of joint " + std::to_string(joint + 1) + ", which " + name + " does not have.");
    }
    if (!c || terms.size() < axis.factors.size() || !(axis.lower < axis.upper)) return;
    const double unit = c->unit == "rad" ? kDegree : 1e3;
    const auto value_at = [&](std::size_t row) {
      double sum = 0;
      for (const auto& [each, factor] : terms) sum += factor * each->values[row];
      return sum * unit + axis.offset;
    };
    std::map<std::size_t, std::pair<std::size_t, double>> worst;
    for (std::size_t row = 0; row < c->values.size(); ++row) {
      const std::size_t i = motion_at_[r][row];
      if (i == kNone || is_jump_[row]) continue;
      const double value = value_at(row);
      const double excess = std::max(value - axis.upper, axis.lower - value);
      if (!(excess > 1e-6)) continue;
      auto& w = worst[i];
      if (excess > w.second) w = {row, excess};
    }
    for (const auto& [i, w] : worst) {
      Fault f = fault_of(i, controller.empty() ? FaultKind::joint_limit : FaultKind::controller,
                         Severity::error);
      f.at = time()[w.first];
      f.joint = static_cast<std::int32_t>(axis.joint);
      f.has_values = true;
      f.value = value_at(w.first);
      f.limit = f.value > axis.upper ? axis.upper : axis.lower;
      f.excess = w.second;
      f.unit = c->unit == "rad" ? "deg" : "mm";
      f.message = "axis " + axis.name + " of " +
                  (controller.empty() ? "robot " + quote(name) : "controller " + controller) +
                  " would be at " + print_rounded(f.value, 5) + " " + f.unit + ", " +
                  print_rounded(f.excess, 4) + " " + f.unit + " beyond its limit of " +
                  print_rounded(f.limit, 5);
      f.hint = "Move the target, or correct the limit in the " +
               std::string(controller.empty() ? "robot's axes (robot.set_axes)."
                                              : "controller's record.");
      place_of_tip(r, w.first, f);
      add(std::move(f));
    }
  }

  [[nodiscard]] std::vector<double> q_at(std::size_t r, std::size_t row) const {
    return joints_at(*out_.recording, robot(r), row);
  }
  [[nodiscard]] Pose world_T_tip(std::size_t r, const InspectedMotion& m,
                                 const std::vector<double>& q) const {
    return pose_of_tip(robot(r), m, q);
  }
  void place_of_tip(std::size_t r, std::size_t row, Fault& f) const {
    f.position = world_T_tip(r, out_.motions[f.motion].motion, q_at(r, row)).p;
    f.has_position = true;
  }

  /// Singularities and configurations of motions whose tool goes along a path.
  Result<void> straight_motions(std::size_t r) {
    const task::InspectedRobot& who = robot(r);
    std::int32_t tip = -2;
    Pose placed;
    auto model = std::make_shared<RobotModel>(*who.model);
    sim::BranchNames names;
    double length = 1;
    for (const std::size_t i : motions_of_[r]) {
      const InspectedMotion& m = out_.motions[i].motion;
      if (!m.is_carried_out) continue;
      if (progress_.cancelled()) return error(ErrorCode::cancelled, "the check was cancelled");
      if (tip != m.tip_joint || !(placed.p == m.joint_T_tip.p && placed.R == m.joint_T_tip.R)) {
        tip = m.tip_joint, placed = m.joint_T_tip;
        auto made = std::make_shared<RobotModel>(*who.model);
        made->tips = {{"tool", tip, placed}};
        model = made;
        length = robotics::reach(*model, 0);
        auto bound = sim::bind_ik(sim_.registry, model, who.ik);
        names = bound.ok() ? sim::BranchNames(*bound, 0) : sim::BranchNames();
        if (names.empty() && is_told_.insert("branches " + who.name).second)
          out_.not_checked.push_back(
              "Configurations of " + who.name +
              ": its inverse kinematics does not tell them apart, so that it has no STATUS.");
      }
      std::vector<double> path;
      std::vector<std::size_t> rows;
      for (std::size_t row = first_row(m.start - kSame);
           row < time().size() && time()[row] <= m.end + kSame; ++row) {
        if (is_jump_[row]) continue;
        const std::vector<double> q = q_at(r, row);
        path.insert(path.end(), q.begin(), q.end());
        rows.push_back(row);
      }
      if (rows.empty()) continue;
      MotionReport& report = out_.motions[i];
      report.manipulability = std::numeric_limits<double>::infinity();
      std::size_t worst = 0, near_from = 1, near_to = 0;
      const std::size_t n = model->coordinate_count();
      for (std::size_t k = 0; k < rows.size(); ++k) {
        std::vector<Pose> frames(model->joints.size());
        const std::span<const double> q(path.data() + k * n, n);
        robotics::forward_kinematics(*model, q, frames);
        const auto motion = robotics::tip_motion(*model, 0, frames);
        const auto d = robotics::dexterity(motion.jacobian, robotics::TwistPart::all, length);
        report.manipulability = std::min(report.manipulability, d.yoshikawa);
        if (d.condition > report.condition) report.condition = d.condition, worst = k;
        if (d.condition > options_.condition) {
          if (near_from > near_to) near_from = rows[k];
          near_to = rows[k];
        }
      }
      const bool is_path = m.interpolation != RMP_MOVE_PTP;
      if (is_path && report.condition > options_.condition) {
        Fault f = fault_of(i, FaultKind::singularity, Severity::warning);
        f.at = time()[rows[worst]], f.from = time()[near_from], f.to = time()[near_to];
        f.has_values = true;
        f.value = report.condition, f.limit = options_.condition;
        f.excess = report.condition - options_.condition;
        f.message = std::isfinite(report.condition) && report.condition < 1e7
                        ? "the path comes near a singular configuration of " + who.name +
                              ": the condition number of its Jacobian is " +
                              print_rounded(report.condition, 3) + ", above " +
                              print_rounded(options_.condition, 4)
                        : "the path goes through a singular configuration of " + who.name;
        const std::span<const double> q(path.data() + worst * n, n);
        const auto s =
            robotics::singularity(*model, 0, q, robotics::TwistPart::all, 1 / options_.condition);
        if (!s.lost.empty())
          f.message += "; there it can hardly " + robotics::lost_words(s.lost.front()).substr(7);
        f.hint = "Move there with PTP, rotate the tool, or move the path away.";
        place_of_tip(r, rows[worst], f);
        add(std::move(f));
      }
      if (!is_path || names.empty()) continue;
      for (const sim::BranchChange& c : sim::branch_changes(names, path, 1)) {
        Fault f = fault_of(i, FaultKind::configuration, Severity::error);
        f.at = time()[rows[std::min(c.at, rows.size() - 1)]];
        f.message = "the straight motion changes the configuration of " + who.name + " from " +
                    sim::configuration_change(names, path, c) +
                    " on the path, which controllers reject";
        f.hint = "Move there with PTP, or give both ends of the path the same configuration.";
        place_of_tip(r, rows[std::min(c.at, rows.size() - 1)], f);
        add(std::move(f));
      }
      if (m.asked_status >= 0 && !m.is_cut) {
        std::uint32_t known = 0;
        const auto is = static_cast<std::int32_t>(
            names.status(std::span<const double>(path).subspan((rows.size() - 1) * n, n), known));
        const std::int32_t asked =
            static_cast<std::int32_t>(m.asked_status) & static_cast<std::int32_t>(known);
        if (is != asked) {
          Fault f = fault_of(i, FaultKind::configuration, Severity::warning);
          f.at = m.end;
          f.has_values = true;
          f.value = is, f.limit = asked;
          f.message = "the straight motion ends with STATUS " + std::to_string(is) +
                      ", but its target has " + std::to_string(asked) + " (" +
                      names.status_words() + ")";
          f.hint = "A straight motion keeps its configuration: give the target STATUS " +
                   std::to_string(is) + " or -1, or move to its start in the other one.";
          add(std::move(f));
        }
      }
    }
    return {};
  }

  void events() {
    for (const InspectedEvent& e : told_.events) {
      Fault f;
      f.place = e.place;
      f.message = e.message, f.hint = e.hint;
      f.signals = e.signals;
      f.at = f.from = f.to = e.place.time;
      switch (e.kind) {
        case InspectedEvent::Kind::fault: f.kind = FaultKind::program; break;
        case InspectedEvent::Kind::stuck:
        case InspectedEvent::Kind::signal:
        case InspectedEvent::Kind::output: f.kind = FaultKind::signal; break;
        case InspectedEvent::Kind::grip:
          f.kind = FaultKind::grip, f.severity = Severity::warning;
          break;
        case InspectedEvent::Kind::timeout:
          f.kind = FaultKind::timeout, f.severity = Severity::warning;
          break;
        case InspectedEvent::Kind::ignored:
        case InspectedEvent::Kind::pause:
          f.kind = FaultKind::ignored, f.severity = Severity::note;
          break;
      }
      add(std::move(f));
    }
  }

  Result<void> contacts_of_run() {
    auto found = contacts(sim_, *out_.recording, options_, is_jump_, progress_);
    if (!found.ok()) {
      if (found.error().code == ErrorCode::cancelled) return std::move(found).error();
      out_.not_checked.push_back("Contacts: " + found.error().sentence());
      return {};
    }
    for (std::string& n : found->notes) out_.not_checked.push_back(std::move(n));
    for (std::size_t r = 0; r < motion_at_.size(); ++r)
      for (std::size_t row = 0; row < found->clearance.size(); ++row) {
        const std::size_t i = motion_at_[r][row];
        if (i == kNone) continue;
        MotionReport& m = out_.motions[i];
        if (found->clearance[row] < m.clearance)
          m.clearance = found->clearance[row], m.nearest = found->nearest[row];
      }
    if (out_.motions.empty()) {
      if (!found->touches.empty())
        out_.not_checked.push_back(
            "Contacts are attributed to programs and tasks that move something, but this one moves "
            "nothing: " +
            std::to_string(found->touches.size()) + " were found.");
      return keep_clearance(std::move(found->clearance));
    }
    for (const Touch& t : found->touches) {
      const std::size_t row = std::min(first_row(t.at - kSame), is_jump_.size() - 1);
      // What a jump passes through says nothing; what it begins or ends in does.
      const bool is_start = t.is_touch && t.from <= time().front() + kSame;
      if (is_jump_[row] && !is_start && t.to < time()[row] + kSame) continue;
      std::size_t i = motion_near(t.at);
      // Of several robots, the one that is of the pair.
      for (std::size_t r = 0; r < motion_at_.size(); ++r) {
        const std::string stem = robot(r).name + ".";
        if (motion_at_[r][row] != kNone && (t.a.starts_with(stem) || t.b.starts_with(stem)))
          i = motion_at_[r][row];
      }
      if (!t.is_touch && !(options_.clearance > 0)) continue;
      Fault f = fault_of(i, t.is_touch ? FaultKind::contact : FaultKind::clearance,
                         t.is_touch ? Severity::error : Severity::warning);
      f.from = t.from, f.to = t.to, f.at = t.at;
      f.a = t.a, f.b = t.b;
      f.joint = -1;
      f.robot.clear();
      f.has_values = true;
      f.unit = "m";
      f.value = t.distance;
      f.limit = t.is_touch ? options_.touch : options_.clearance;
      f.excess = f.limit - t.distance;
      f.has_position = true, f.position = t.position;
      const double depth = -t.distance * 1000;
      f.message =
          (is_start ? "the run starts in contact: " : "") + t.a + " and " + t.b +
          (!t.is_touch ? " come within " + print_rounded(-depth, 3) + " mm, less than the " +
                             print_rounded(options_.clearance * 1000, 3) + " mm required"
           : depth > 0.05 ? " touch, " + print_rounded(depth, 3) + " mm deep"
                          : " touch") +
          ", from t = " + print_rounded(t.from, 5) + " s to " + print_rounded(t.to, 5) + " s";
      f.hint = !t.is_touch ? "Move the target away, or give a smaller clearance."
               : is_start  ? "Start from joint values without contact."
                           : "Add an intermediate point, or move one of the two.";
      add(std::move(f));
    }
    return keep_clearance(std::move(found->clearance));
  }
  Result<void> keep_clearance(std::vector<double> clearance) {
    Column c{"clearance", "m", "least distance of bodies that must not touch",
             std::move(clearance)};
    c.lower = options_.clearance;
    Recording with = *out_.recording;
    std::erase_if(with.columns, [](const Column& x) { return x.name == "clearance"; });
    with.columns.push_back(std::move(c));
    out_.recording = std::make_shared<const Recording>(std::move(with));
    return {};
  }

  /// Lines that did not run.
  void coverage() {
    if (!told_.machine) return;
    const auto all = told_.machine->statements();
    const rmp_code& code = told_.machine->code();
    const auto is_own = [&](const rmp_span& s) { return s.file < code.files.count && s.line > 0; };
    // Of a line several statements may be; it has run when one has.
    std::map<std::tuple<std::uint32_t, std::uint32_t>, std::map<std::uint32_t, bool>> lines;
    std::map<std::uint32_t, bool> routines;
    for (const auto& s : all) {
      if (!is_own(s.span)) continue;
      ++out_.statements;
      out_.statements_run += s.has_run;
      bool& has_run = lines[{s.span.file, s.routine}][s.span.line];
      has_run = has_run || s.has_run;
      bool& was_called = routines[s.routine];
      was_called = was_called || s.has_run;
    }
    for (const auto& [where, of] : lines) {
      UnrunLines* open = nullptr;
      for (const auto& [line, has_run] : of) {
        if (has_run) {
          open = nullptr;
          continue;
        }
        if (!open) {
          UnrunLines u;
          u.file = std::get<0>(where), u.routine = std::get<1>(where);
          u.first = line;
          u.is_whole_routine = !routines[u.routine];
          out_.not_run.push_back(u);
          open = &out_.not_run.back();
        }
        open->last = line;
      }
    }
  }

  /// What others move, whose limits are not this program's.
  void others() {
    std::vector<std::string> names;
    for (std::size_t r = 0; r < told_.robots.size(); ++r) {
      if (!motions_of_[r].empty() ||
          std::find(told_.additional.begin(), told_.additional.end(), r) != told_.additional.end())
        continue;
      const std::size_t n = robot(r).model->coordinate_count();
      bool moves = false;
      for (std::size_t j = 0; j < n && !moves; ++j)
        if (const Column* c = out_.recording->find(robot(r).name + ".q" + std::to_string(j + 1)))
          moves = std::any_of(c->values.begin(), c->values.end(),
                              [&](double v) { return std::fabs(v - c->values.front()) > 1e-9; });
      if (moves) names.push_back(robot(r).name);
    }
    if (!names.empty())
      out_.not_checked.push_back("Limits of " + text::enumerate(names) +
                                 ", which other programs or tasks move.");
  }

  void finish() {
    if (!told_.run_error.empty())
      out_.not_checked.push_back("The run ended early: " + told_.run_error);
    if (told_.is_out_of_time)
      out_.not_checked.push_back(
          "The run was ended after " + print_rounded(out_.duration, 6) +
          " s, and the rest was not checked; most_time and duration set the limit.");
    if (!jumped_.empty()) {
      std::set<std::uint32_t> lines;
      for (const std::size_t i : jumped_) lines.insert(out_.motions[i].motion.place.span.line);
      std::string list;
      for (const std::uint32_t l : lines) list += (list.empty() ? "" : ", ") + std::to_string(l);
      out_.not_checked.push_back("The paths of the motions of line " + list +
                                 ": the previous motion failed, so they started elsewhere, and the "
                                 "robot was placed at their ends.");
    }
    std::size_t failed = 0;
    for (const MotionReport& m : out_.motions)
      failed += !m.motion.is_carried_out && !m.motion.error.empty();
    if (failed)
      out_.not_checked.push_back("The cycle time lacks " + std::to_string(failed) +
                                 " motions that could not be executed.");
    if (told_.events_left_out)
      out_.not_checked.push_back(std::to_string(told_.events_left_out) +
                                 " events after the first " + std::to_string(told_.events.size()) +
                                 ".");
    others();
    if (told_.motions_left_out)
      out_.not_checked.push_back(std::to_string(told_.motions_left_out) +
                                 " motions after the first " + std::to_string(out_.motions.size()) +
                                 ".");
    for (MotionReport& m : out_.motions) {
      const InspectedMotion& one = m.motion;
      if (one.robot < told_.robots.size() && !one.q_target.empty())
        m.end = world_T_tip(one.robot, one, one.q_target).p;
      if (one.is_carried_out) out_.moving += std::max(0.0, one.end - one.start);
    }
    // Errors first, then by place; the rows keep what the motions refer to.
    std::stable_sort(out_.faults.begin(), out_.faults.end(), [](const Fault& x, const Fault& y) {
      return std::tuple(x.severity, x.place.span.file, x.place.span.line, x.place.span.column,
                        x.at) < std::tuple(y.severity, y.place.span.file, y.place.span.line,
                                           y.place.span.column, y.at);
    });
  }

  const sim::Simulator& sim_;
  const Options& options_;
  Check& out_;
  ProgramInspection& told_;
  Progress& progress_;
  std::vector<std::vector<std::size_t>> motions_of_, motion_at_;
  std::vector<robotics::MakerAxes> axes_;  ///< of the robots
  std::vector<bool> is_jump_;
  std::set<std::size_t> jumped_;
  std::set<std::string> is_told_;
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, FaultKind, std::string,
                      std::int32_t, std::string, std::string, std::string>,
           std::size_t>
      rows_;
};

}  // namespace

std::string_view to_string(Severity s) {
  switch (s) {
    case Severity::error: return "error";
    case Severity::warning: return "warning";
    case Severity::note: return "note";
  }
  return "";
}

std::string_view to_string(FaultKind k) {
  switch (k) {
    case FaultKind::reach: return "reach";
    case FaultKind::joint_limit: return "joint_limit";
    case FaultKind::speed: return "speed";
    case FaultKind::acceleration: return "acceleration";
    case FaultKind::torque: return "torque";
    case FaultKind::contact: return "contact";
    case FaultKind::clearance: return "clearance";
    case FaultKind::singularity: return "singularity";
    case FaultKind::configuration: return "configuration";
    case FaultKind::motion: return "motion";
    case FaultKind::controller: return "controller";
    case FaultKind::signal: return "signal";
    case FaultKind::timeout: return "timeout";
    case FaultKind::grip: return "grip";
    case FaultKind::until: return "until";
    case FaultKind::program: return "program";
    case FaultKind::ignored: return "ignored";
  }
  return "";
}

std::size_t Check::count(Severity s) const {
  return static_cast<std::size_t>(
      std::count_if(faults.begin(), faults.end(), [&](const Fault& f) { return f.severity == s; }));
}

ToolWay tool_way(const Check& check, std::size_t motion) {
  ToolWay out;
  const InspectedMotion& m = check.motions[motion].motion;
  if (!m.is_carried_out) {
    out.world_T_tip = m.way;
    return out;
  }
  const auto& robot = check.inspection->robots[m.robot];
  const std::vector<double>& time = check.recording->columns.front().values;
  for (auto row = static_cast<std::size_t>(
           std::lower_bound(time.begin(), time.end(), m.start - kSame) - time.begin());
       row < time.size() && time[row] <= m.end + kSame; ++row) {
    out.rows.push_back(row);
    out.world_T_tip.push_back(pose_of_tip(robot, m, joints_at(*check.recording, robot, row)));
  }
  return out;
}

Result<Check> check(const sim::Simulator& sim, task::TaskRun run, std::size_t checked,
                    const Options& options, Progress& progress) {
  Check out;
  out.inspection = std::make_shared<ProgramInspection>();
  out.inspection->most_speed = options.most_speed;
  out.inspection->most_speed_orientation = options.most_speed_orientation;
  run.programs[checked].inspection = out.inspection;
  progress.report(0, "run");
  RMP_TRY_ASSIGN(out.recording, task::run(sim, run, progress));
  out.duration = out.inspection->end;
  for (InspectedMotion& m : out.inspection->motions) {
    MotionReport report;
    report.motion = std::move(m);
    report.clearance = std::numeric_limits<double>::infinity();
    out.motions.push_back(std::move(report));
  }
  out.inspection->motions.clear();
  progress.report(0.4, "limits");
  RMP_TRY(Checker(sim, options, out, progress).run());
  return out;
}

}  // namespace robomosp::program_check
