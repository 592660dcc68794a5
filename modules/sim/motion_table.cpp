// SPDX-License-Identifier: Apache-2.0
#include "sim/motion_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "kernel/text.h"
#include "robotics/joint_label.h"
#include "robotics/kinematics.h"
#include "sim/index.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::sim {
namespace {

using recording::Column;
using recording::Recording;

constexpr std::size_t kMostNotes = 12;

Column every(std::string name, std::string unit, std::string doc, std::span<const double> table,
             std::size_t width, std::size_t which) {
  Column c{std::move(name), std::move(unit), std::move(doc), {}};
  c.values.reserve(table.size() / width);
  for (std::size_t i = which; i < table.size(); i += width) c.values.push_back(table[i]);
  return c;
}

std::string seconds(double t) { return text::print_rounded(t, 5) + " s"; }

}  // namespace

MotionTable::MotionTable(const MechanismMotion& motion, const robotics::MakerAxes& axes)
    : model_(motion.model()),
      axes_(axes),
      has_friction_(motion.has_friction()),
      has_stops_(motion.has_stops()),
      has_loops_(!motion.model().loops.empty()),
      limits_(model_.dof(), std::numeric_limits<double>::infinity()),
      joint_of_(model_.dof()),
      is_rotary_(model_.dof(), true) {
  for (std::size_t i = 0; i < model_.joints.size(); ++i) {
    const JointModel& joint = model_.joints[i];
    if (joint.is_coupled()) continue;
    const std::int32_t count = velocity_count(joint.type);
    for (std::int32_t k = 0; k < count; ++k) {
      const std::size_t v = index(joint.v_index + k);
      joint_of_[v] = i;
      is_rotary_[v] = joint.type == JointType::prismatic ? false
                      : joint.type == JointType::free    ? k >= 3
                                                         : true;
      if (count == 1) limits_[v] = joint.max_force;
    }
  }
}

void MotionTable::add(double t, std::span<const double> x, const MechanismMotion::Forces& f) {
  const std::size_t c = model_.coordinate_count();
  times_.push_back(t);
  q_.insert(q_.end(), x.begin(), x.begin() + static_cast<std::ptrdiff_t>(c));
  qd_.insert(qd_.end(), x.begin() + static_cast<std::ptrdiff_t>(c), x.end());
  qdd_.insert(qdd_.end(), f.qdd.begin(), f.qdd.end());
  tau_.insert(tau_.end(), f.tau.begin(), f.tau.end());
  // As in inverse dynamics: what a motor would have to give against it.
  for (const double v : f.friction) friction_.push_back(v == 0 ? 0 : -v);
  for (const double v : f.stop) stop_.push_back(v);
}

void MotionTable::cut(std::size_t entry, double t, bool is_cut) {
  const auto open = std::find_if(cuts_.begin(), cuts_.end(), [entry](const Interval& i) {
    return i.entry == entry && i.is_open;
  });
  if (open != cuts_.end()) {
    open->to = t;
    open->is_open = is_cut;
  } else if (is_cut) {
    cuts_.push_back({entry, t, t, true});
  }
}

std::string MotionTable::label(std::size_t entry) const { return joint_label(joint_of_[entry]); }

std::string MotionTable::joint_label(std::size_t joint) const {
  const JointModel& j = model_.joints[joint];
  const bool has_axis = !j.is_coupled() && coordinate_count(j.type) == 1;
  return (has_axis ? axes_.before_joint(index(j.q_index)) : std::string()) +
         robotics::joint_label(model_, joint);
}

std::string MotionTable::limit_label(const MotionEvent& e) const {
  const JointModel& j = model_.joints[e.joint];
  if (!axes_.known() || j.is_coupled() || coordinate_count(j.type) != 1 || times_.empty())
    return joint_label(e.joint);
  // An axis may count other joints, too: where they were in the nearest row.
  const auto later = std::lower_bound(times_.begin(), times_.end(), e.time);
  auto row = static_cast<std::size_t>(later - times_.begin());
  if (row == times_.size() || (row > 0 && e.time - times_[row - 1] < times_[row] - e.time)) --row;
  const auto there = q(row);
  std::vector<double> at(there.begin(), there.end());
  at[index(j.q_index)] = e.is_upper ? j.upper : j.lower;
  return axes_.before_place(index(j.q_index), at) + robotics::joint_label(model_, e.joint);
}

void MotionTable::add_entries(Recording& out, const std::string& stem, const std::string& what,
                              const std::string& rotary, const std::string& linear,
                              std::span<const double> table) const {
  const std::size_t n = model_.dof();
  for (std::size_t v = 0; v < n; ++v)
    out.columns.push_back(every(stem + std::to_string(v + 1), is_rotary_[v] ? rotary : linear,
                                what + " of " + label(v), table, n, v));
}

void MotionTable::add_joint_columns(Recording& out, bool all_stops) const {
  const std::size_t c = model_.coordinate_count();
  out.columns.push_back({"time", "s", "time", times_});
  std::vector<std::string> units(c), names(c);
  for (std::size_t j = 0; j < model_.joints.size(); ++j) {
    const JointModel& joint = model_.joints[j];
    if (joint.is_coupled()) continue;
    const std::int32_t count = coordinate_count(joint.type);
    for (std::int32_t k = 0; k < count; ++k) {
      units[index(joint.q_index + k)] = joint.type == JointType::revolute        ? "rad"
                                        : joint.type == JointType::prismatic     ? "m"
                                        : joint.type == JointType::free && k < 3 ? "m"
                                                                                 : "";
      names[index(joint.q_index + k)] = joint_label(j);
    }
  }
  for (std::size_t k = 0; k < c; ++k)
    out.columns.push_back(
        every("q" + std::to_string(k + 1), units[k], "position of " + names[k], q_, c, k));
  add_entries(out, "qd", "velocity", "rad/s", "m/s", qd_);
  add_entries(out, "qdd", "acceleration", "rad/s^2", "m/s^2", qdd_);
  add_entries(out, "tau", "torque of the motor", "N m", "N", tau_);
  if (has_friction_) add_entries(out, "tau_friction", "friction", "N m", "N", friction_);
  if (has_stops_ &&
      (all_stops || std::any_of(stop_.begin(), stop_.end(), [](double v) { return v != 0; })))
    add_entries(out, "tau_stop", "force of the stop", "N m", "N", stop_);
}

Result<void> MotionTable::add_energy_columns(Recording& out, const Bound<InverseDynamics>& dynamics,
                                             Progress& progress) const {
  const std::size_t n = model_.dof(), c = model_.coordinate_count(), rows = times_.size();
  std::vector<double> kinetic(rows), potential(rows), energy(rows);
  std::vector<Pose> frames(model_.joints.size());
  for (std::size_t i = 0; i < rows; ++i) {
    // A row at a time: several at once are computed in lanes, in whose last bits a run that is
    // stepped would differ from one that is not.
    DynamicsBatch batch;
    batch.count = 1;
    batch.q = std::span<const double>(q_).subspan(i * c, c);
    // M qd is what accelerations of that size would take, without the matrix.
    batch.qdd = std::span<const double>(qd_).subspan(i * n, n);
    batch.terms = kInertialTerm;
    RMP_TRY_ASSIGN(const auto momentum, torques(dynamics, batch, progress));
    for (std::size_t k = 0; k < n; ++k) kinetic[i] += 0.5 * qd_[i * n + k] * momentum[k];
    robotics::forward_kinematics(model_, batch.q, frames);
    for (std::size_t j = 0; j < model_.joints.size(); ++j) {
      const JointModel& joint = model_.joints[j];
      potential[i] -= joint.body.mass *
                      spatial::dot(model_.gravity, spatial::transform(frames[j], joint.body.com));
      if (joint.spring.stiffness > 0 && coordinate_count(joint.type) == 1) {
        const double stretch = spatial::joint_value(joint, &q_[i * c]) - joint.spring.rest;
        potential[i] += 0.5 * joint.spring.stiffness * stretch * stretch;
      }
    }
    energy[i] = kinetic[i] + potential[i];
  }
  out.columns.push_back({"kinetic", "J", "kinetic energy of bodies and motors", kinetic});
  out.columns.push_back(
      {"potential", "J", "potential energy of weight (0 at the base) and springs", potential});
  out.columns.push_back({"energy", "J", "kinetic and potential energy", energy});
  return {};
}

Result<void> MotionTable::add_tip_columns(
    Recording& out, const std::function<Result<Pose>(double)>& world_T_base) const {
  if (model_.tips.empty()) return {};
  const std::size_t c = model_.coordinate_count();
  std::vector<Pose> frames(model_.joints.size());
  std::array<std::vector<double>, 3> tip;
  for (std::size_t i = 0; i < times_.size(); ++i) {
    robotics::forward_kinematics(model_, std::span<const double>(q_).subspan(i * c, c), frames);
    RMP_TRY_ASSIGN(const Pose base, world_T_base(times_[i]));
    const Vec3 p = spatial::transform(base, robotics::tip_pose(model_, 0, frames).p);
    for (std::size_t k = 0; k < 3; ++k) tip[k].push_back(p[k]);
  }
  const char* names[3] = {"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k)
    out.columns.push_back({names[k], "m", "of the tool in the world", std::move(tip[k])});
  return {};
}

Result<void> MotionTable::add_error_columns(Recording& out,
                                            const MotionReference& reference) const {
  const std::size_t n = model_.dof(), c = model_.coordinate_count();
  std::vector<double> errors(times_.size() * n), tip_error;
  std::vector<Pose> frames(model_.joints.size());
  MotionReference::Sample want;
  for (std::size_t i = 0; i < times_.size(); ++i) {
    const auto q = std::span<const double>(q_).subspan(i * c, c);
    RMP_TRY(reference.at(times_[i], want));
    for (const JointModel& joint : model_.joints) {
      if (joint.is_coupled()) continue;
      const std::size_t at = index(joint.q_index);
      double* e = &errors[i * n + index(joint.v_index)];
      const std::int32_t count = coordinate_count(joint.type);
      if (count == 1) {
        e[0] = want.q[at] - q[at];
        continue;
      }
      Pose is, should;
      is.R = spatial::quaternion_rotation(&q[at + index(count) - 4]);
      should.R = spatial::quaternion_rotation(&want.q[at + index(count) - 4]);
      if (joint.type == JointType::free) {
        const Vec3 way = spatial::rotate_back(
            is, Vec3{want.q[at] - q[at], want.q[at + 1] - q[at + 1], want.q[at + 2] - q[at + 2]});
        std::copy(way.begin(), way.end(), e);
        e += 3;
      }
      const Vec3 turn = spatial::rotation_log(spatial::compose(spatial::inverse(is), should).R);
      std::copy(turn.begin(), turn.end(), e);
    }
    if (model_.tips.empty()) continue;
    robotics::forward_kinematics(model_, q, frames);
    const Vec3 is = robotics::tip_pose(model_, 0, frames).p;
    if (!want.has_tip) {
      robotics::forward_kinematics(model_, want.q, frames);
      want.tip = robotics::tip_pose(model_, 0, frames);
    }
    tip_error.push_back(spatial::distance(want.tip.p, is));
  }
  add_entries(out, "error", "difference to the reference", "rad", "m", errors);
  if (!model_.tips.empty())
    out.columns.push_back(
        {"tip_error", "m", "distance of the tool from its reference", std::move(tip_error)});
  return {};
}

void MotionTable::add_friction_notes(const MechanismMotion& motion,
                                     std::vector<std::string>& notes) const {
  constexpr std::size_t kMostTimes = 3;
  using Kind = MotionEvent::Kind;
  for (std::size_t j = 0; j < model_.joints.size(); ++j)
    for (const auto& [kind, words] :
         {std::pair{Kind::sticks, " came to rest at "}, {Kind::slides, " moved again at "}}) {
      std::string when;
      std::size_t count = 0;
      for (const MotionEvent& e : motion.happened()) {
        const bool is_start = kind == Kind::sticks && e.time == 0;
        if (e.joint != j || e.kind != kind || is_start) continue;
        if (++count <= kMostTimes) when += (when.empty() ? "" : ", ") + seconds(e.time);
      }
      if (count == 0) continue;
      if (count > kMostTimes)
        when += " and " + std::to_string(count - kMostTimes) +
                (count == kMostTimes + 1 ? " time more" : " times more");
      notes.push_back(joint_label(j) + words + when);
    }
}

void MotionTable::add_notes(Recording& out, const MechanismMotion& motion) const {
  std::vector<std::string> notes;
  for (std::size_t v = 0; v < limits_.size(); ++v) {
    std::string when;
    std::size_t count = 0;
    for (const Interval& i : cuts_) {
      if (i.entry != v) continue;
      if (++count <= 3)
        when += (when.empty() ? "" : ", ") + ("from " + seconds(i.from)) + " to " + seconds(i.to);
    }
    if (count == 0) continue;
    if (count > 3) when += " and " + std::to_string(count - 3) + " times more";
    notes.push_back("the torque of " + label(v) + " was cut to " + text::print_rounded(limits_[v]) +
                    (is_rotary_[v] ? " N m " : " N ") + when);
  }
  std::size_t left_out = 0;
  for (const MotionEvent& e : motion.happened()) {
    const JointModel& joint = model_.joints[e.joint];
    const std::string who = limit_label(e);
    const std::string unit = joint.type == JointType::prismatic ? " m/s" : " rad/s";
    const std::string limit = e.is_upper ? "upper limit" : "lower limit";
    switch (e.kind) {
      case MotionEvent::Kind::sticks:
      case MotionEvent::Kind::slides:
      case MotionEvent::Kind::leaves: continue;
      default: break;
    }
    if (notes.size() >= kMostNotes) {
      ++left_out;
      continue;
    }
    const std::string speed = text::print_rounded(std::fabs(e.speed), 4) + unit;
    notes.push_back(e.kind == MotionEvent::Kind::report
                        ? who + " passed its " + limit + " at " + seconds(e.time) + " with " + speed
                        : who + " met its " + limit + " at " + seconds(e.time) + " with " + speed +
                              (e.kind == MotionEvent::Kind::rest ? " and stayed there" : ""));
  }
  if (left_out > 0) notes.push_back("limits were met " + std::to_string(left_out) + " times more");
  add_friction_notes(motion, notes);
  out.notes.insert(out.notes.end(), notes.begin(), notes.end());
}

}  // namespace robomosp::sim
