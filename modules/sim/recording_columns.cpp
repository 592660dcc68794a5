// SPDX-License-Identifier: Apache-2.0
#include "sim/recording_columns.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <unordered_map>

#include <Eigen/Core>

#include "collision/collision.h"
#include "evaluation/payload.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "recording/limit_share.h"
#include "robotics/decompositions.h"
#include "robotics/kinematics.h"
#include "robotics/maker_axes.h"
#include "robotics/tip_motion.h"
#include "sim/closed_dynamics.h"
#include "sim/dynamics.h"
#include "sim/joint_rates.h"
#include "sim/member_axes.h"
#include "sim/put_column.h"
#include "spatial/euler.h"
#include "spatial/pose.h"

namespace robomosp::sim {
namespace {

using collision::with_clearance;
using evaluation::attached_loads;
using evaluation::load_stretches;
using evaluation::loaded_model;
using evaluation::loads_at;
using recording::Column;
using recording::Load;
using recording::Recording;
using recording::RecordingPtr;

/// How far the recorded tool may be from where the joints put it [m].
constexpr double kSamePlace = 1e-6;

constexpr std::array<RecordedQuantity, 12> kQuantities{
    {{"torque", "tau1, ..., tau_external1, ...",
      "of the motors, by inverse dynamics from q, qd and qdd, with the force and moment at a tip "
      "from wrench1 to wrench6 or the arguments"},
     {"jerk", "qddd1, ...", "derivative of the accelerations"},
     {"power", "power1, ..., total_power", "of the motors: torque by velocity, and their sum"},
     {"work", "work", "of all motors since the first row: the integral of their power"},
     {"energy", "kinetic, potential, energy", "of bodies, motors and springs"},
     {"axes", "axis_<name>, ...",
      "joints as the robot's maker counts them, in rad and m: direction, zero and coupling of its "
      "axes"},
     {"pose", "x, y, z, roll, pitch, yaw", "of the tool in the world, angles without jumps"},
     {"velocity", "vx, vy, vz, speed, wx, wy, wz", "of the tool in the world's axes"},
     {"force", "fx, fy, fz, mx, my, mz",
      "force and moment on the tool for which the motors' torques give this motion, world axes"},
     {"manipulability", "manipulability", "Yoshikawa's measure of the tool"},
     {"limits", "used_q1, ..., used_tau1, ..., limits_used",
      "shares of the limits, 1 = at the limit, and the greatest of all"},
     {"clearance", "clearance", "least distance of the robot's bodies to each other and to all"}}};

/// What a recording's numbers belong to.
struct Actor {
  std::shared_ptr<const RobotModel> model;
  model::ProviderChoice inverse_dynamics;
  Pose world_T_base;
  std::vector<Load> loads;     ///< what it carries when
  robotics::MakerAxes axes{};  ///< none where they are not known
};

Result<Actor> actor_of(const Simulator& sim, const Recording& r, Progress& progress) {
  Pose mounting;
  Vec3 gravity{0, 0, -9.81};
  RobotId id;
  const model::PlacedRobot* placed = nullptr;
  if (const model::World* world = sim.snapshot.get(r.world)) {
    for (const auto& robot : world->robots)
      if (robot.name == r.robot) placed = &robot;
    if (placed) id = placed->robot, mounting = model::pose(placed->placement);
    gravity = world->gravity;
  } else if (const auto found = sim.snapshot.find(Kind::robot, r.robot);
             found && r.world.number == 0) {
    id = RobotId{found->number};
  }
  const model::Robot* record = sim.snapshot.get(id);
  if (!record && r.robot.empty())
    for (const Column& c : r.columns)
      if (c.name.ends_with(".q1"))
        return error(ErrorCode::invalid_argument, "the recording contains several robots",
                     "Select one with robot, such as " +
                         text::quote(c.name.substr(0, c.name.size() - 3)) + ".");
  if (!record)
    return error(ErrorCode::stale_handle,
                 r.robot.empty()
                     ? "the recording does not belong to a robot"
                     : "the recording's robot " + text::quote(r.robot) + " no longer exists",
                 "Quantities of a robot need it; recording.watch needs only the columns.");
  const bool follows = placed && !placed->base_trajectory.empty();
  if (follows || r.base_moves)
    return error(ErrorCode::unsupported,
                 "the base of robot " + text::quote(r.robot) + " moves" +
                     (follows ? " along " + text::quote(placed->base_trajectory) : std::string()) +
                     ", but quantities of recordings are computed for fixed bases only",
                 "Its runs record x, y and z of the tool in the world, and torques.");
  Actor a;
  RMP_TRY_ASSIGN(a.model, sim.derived.robot_model(
                              sim.snapshot, id, spatial::rotate_back(mounting, gravity), progress));
  a.inverse_dynamics = record->inverse_dynamics;
  RMP_TRY_ASSIGN(a.axes, robotics::MakerAxes::of(*record));
  a.world_T_base = spatial::compose(mounting, a.model->base);
  if (r.loads) {
    for (const Load& load : *r.loads)
      if (load.robot == r.robot) a.loads.push_back(load);
  } else if (placed) {
    RMP_TRY_ASSIGN(a.loads, attached_loads(sim, r.world, *placed, *a.model));
  }
  return a;
}

/// Columns stem1..stemN as rows, entry-fastest.
Result<std::vector<double>> table(const Recording& r, const std::string& stem, std::size_t width) {
  std::vector<double> out(r.rows() * width);
  const Column* c = nullptr;
  for (std::size_t k = 0; k < width; ++k) {
    // Mostly they stand one behind the other.
    const std::string name = stem + std::to_string(k + 1);
    c = c && c + 1 < r.columns.data() + r.columns.size() && c[1].name == name ? c + 1
                                                                              : r.find(name);
    if (!c)
      return error(
          ErrorCode::invalid_argument, "the recording has no column " + text::quote(name),
          stem == "tau" ? "The quantity torque computes it." : "Record a motion of this robot.");
    for (std::size_t i = 0; i < r.rows(); ++i) out[i * width + k] = c->values[i];
  }
  return out;
}

Result<const Column*> time_of(const Recording& r) {
  const Column* time = r.find("time");
  if (time) return time;
  return error(ErrorCode::invalid_argument, "the recording has no time",
               "Rates and integrals need a column \"time\".");
}

/// Velocities and accelerations that a recording lacks, such as one of contact physics, as
/// derivatives of what it has; of robots whose coordinates are their joints' values.
void complete_rates(Recording& out, const RobotModel& model) {
  const Column* const time = out.find("time");
  if (!time || !model.is_simple()) return;
  const std::vector<double> times = time->values;
  const auto derive = [&](const std::string& from, const std::string& to, const std::string& what) {
    const Column* const c = out.find(from);
    if (!c || out.find(to)) return;
    const std::string unit =
        from.starts_with("qd") ? c->unit + "^2" : c->unit + "/s";  // rad/s, then rad/s^2
    put_column(out, {to, unit, what, rate_of(times, c->values)});
  };
  for (std::size_t k = 1; k <= model.dof(); ++k) {
    const std::string n = std::to_string(k);
    derive("q" + n, "qd" + n, "velocity of joint " + n + ", the derivative of its position");
    derive("qd" + n, "qdd" + n, "acceleration of joint " + n + ", the derivative of its velocity");
  }
  mark_limits(out, model);
}

Result<void> add_jerk(Recording& out, const RobotModel& model) {
  RMP_TRY_ASSIGN(const Column* const time, time_of(out));
  const std::vector<double> times = time->values;
  for (std::size_t k = 0; k < model.dof(); ++k) {
    const Column* c = out.find("qdd" + std::to_string(k + 1));
    if (!c) return table(out, "qdd", model.dof()).error();
    put_column(out,
               {"qddd" + std::to_string(k + 1), c->unit.starts_with("rad") ? "rad/s^3" : "m/s^3",
                "jerk of joint " + std::to_string(k + 1), rate_of(times, c->values)});
  }
  mark_limits(out, model);
  return {};
}

Result<std::vector<double>> add_power(Recording& out, std::size_t dof) {
  RMP_TRY_ASSIGN(const auto tau, table(out, "tau", dof));
  RMP_TRY_ASSIGN(const auto qd, table(out, "qd", dof));
  std::vector<double> total(out.rows());
  for (std::size_t k = 0; k < dof; ++k) {
    Column c{"power" + std::to_string(k + 1),
             "W",
             "power of the motor of joint " + std::to_string(k + 1),
             {}};
    for (std::size_t i = 0; i < out.rows(); ++i) {
      c.values.push_back(tau[i * dof + k] * qd[i * dof + k]);
      total[i] += c.values.back();
    }
    put_column(out, std::move(c));
  }
  put_column(out, {"total_power", "W", "power of all motors", total});
  return total;
}

/// A note where the rows' loops were open.
void note_closed(Recording& r, double gap) {
  if (!(gap > 1e-9)) return;
  const std::string note = "its loops were open by up to " + text::print_rounded(gap, 2) +
                           " m or rad; forces and energies are those with the loops closed";
  if (std::find(r.notes.begin(), r.notes.end(), note) == r.notes.end()) r.notes.push_back(note);
}

/// Calls `use(dynamics, batch)` for each stretch of rows in which the robot carries the same; the
/// batch has q and qd, and qdd where it is given. Closed loops are closed before.
template <class Use>
Result<void> each_load(Recording& r, const Simulator& sim, const Actor& a, std::vector<double> qdd,
                       Progress& progress, Use&& use) {
  const std::size_t n = a.model->dof(), nq = a.model->coordinate_count();
  RMP_TRY_ASSIGN(auto q, table(r, "q", nq));
  RMP_TRY_ASSIGN(auto qd, table(r, "qd", n));
  double gap = 0;
  RMP_TRY_ASSIGN(gap, close_rows(*a.model, q, qd, qdd, progress));
  note_closed(r, gap);
  const Column* const time = r.find("time");
  const std::vector<std::size_t> firsts = load_stretches(r, a.loads);
  for (std::size_t i = 0; i < firsts.size() && r.rows() > 0; ++i) {
    const std::size_t first = firsts[i], end = i + 1 < firsts.size() ? firsts[i + 1] : r.rows();
    const auto carried = time ? loads_at(a.loads, time->values[first]) : a.loads;
    RMP_TRY_ASSIGN(const auto model, loaded_model(sim, a.model, carried, progress));
    RMP_TRY_ASSIGN(const auto dynamics,
                   bind_inverse_dynamics(sim.registry, model, a.inverse_dynamics));
    DynamicsBatch batch;
    batch.count = end - first;
    batch.q = std::span(q).subspan(first * nq, batch.count * nq);
    batch.qd = std::span(qd).subspan(first * n, batch.count * n);
    if (!qdd.empty()) batch.qdd = std::span(qdd).subspan(first * n, batch.count * n);
    RMP_TRY(use(dynamics, batch));
  }
  return {};
}

/// The rows' torques with what is carried, n a row.
Result<std::vector<double>> motor_torques(Recording& r, const Simulator& sim, const Actor& a,
                                          std::uint32_t terms, Progress& progress,
                                          const ActingLoad& acting = {}) {
  RMP_TRY_ASSIGN(const auto qdd, table(r, "qdd", a.model->dof()));
  std::vector<double> out;
  out.reserve(qdd.size());
  RMP_TRY(
      each_load(r, sim, a, qdd, progress,
                [&](const Bound<InverseDynamics>& dynamics, DynamicsBatch batch) -> Result<void> {
                  batch.terms = terms;
                  if (!acting.in_base.empty()) {
                    const std::size_t first = out.size() / a.model->dof();
                    batch.tip = std::span(acting.in_base).subspan(first, batch.count);
                    batch.tip_index = acting.tip;
                  }
                  RMP_TRY_ASSIGN(const auto part, torques(dynamics, batch, progress));
                  out.insert(out.end(), part.begin(), part.end());
                  return {};
                }));
  return out;
}

/// The force and moment in the rows' columns wrench1 to wrench6.
Result<ActingLoad> recorded_wrench(const Recording& r, const Actor& a) {
  const RobotModel& m = *a.model;
  ActingLoad out;
  if (!r.find("wrench1")) return out;
  const auto tip = tip_of_wrench(r, m);
  if (!tip && m.tips.size() > 1) {
    std::vector<std::string> known;
    for (const TipModel& t : m.tips) known.push_back(t.name);
    return error(
        ErrorCode::invalid_argument,
        "the columns wrench1 to wrench6 do not specify the tip at which they act",
        "Give tip_wrench, the recording itself, and tip, one of " + text::enumerate(known) + ".",
        "robot " + text::quote(m.name));
  }
  out.tip = tip.value_or(0);
  std::array<std::vector<double>, 6> w;
  for (std::size_t k = 0; k < 6; ++k) {
    RMP_TRY_ASSIGN(w[k], load_column(r, "wrench" + std::to_string(k + 1), k < 3 ? "N" : "N m", ""));
  }
  for (std::size_t i = 0; i < r.rows(); ++i)
    out.in_base.push_back({spatial::rotate_back(a.world_T_base, Vec3{w[0][i], w[1][i], w[2][i]}),
                           spatial::rotate_back(a.world_T_base, Vec3{w[3][i], w[4][i], w[5][i]})});
  return out;
}

/// The load of the rows: the one given, in place of the recorded one.
Result<ActingLoad> load_of_rows(Recording& out, const Actor& a,
                                const std::optional<TipLoad>& load) {
  if (!load) return recorded_wrench(out, a);
  RMP_TRY_ASSIGN(const Column* const time, time_of(out));
  const std::vector<double> times = time->values;
  RMP_TRY_ASSIGN(const auto q, table(out, "q", a.model->coordinate_count()));
  RMP_TRY_ASSIGN(const auto qd, table(out, "qd", a.model->dof()));
  PathSample standing;
  standing.pose = a.world_T_base;
  const Column* const column = out.find(recording::kApproachColumn);
  const std::vector<double> approach = column ? column->values : std::vector<double>{};
  return add_load_columns(out, *load, *a.model, {times, q, qd, std::span(&standing, 1), approach});
}

Result<void> add_torque(Recording& out, const Simulator& sim, const Actor& a,
                        const std::optional<TipLoad>& load, Progress& progress) {
  const std::size_t n = a.model->dof();
  RMP_TRY_ASSIGN(const ActingLoad acting, load_of_rows(out, a, load));
  RMP_TRY_ASSIGN(const auto tau, motor_torques(out, sim, a, kAllTerms, progress, acting));
  if (const auto missing = missing_motor(*a.model, tau))
    out.notes.push_back("its motors cannot do all of this motion: tau" +
                        std::to_string(missing->entry + 1) +
                        ", of a joint without motor, is the missing torque");
  const auto add = [&](const char* stem, const std::string& doc, const std::vector<double>& rows) {
    for (std::size_t k = 0; k < n; ++k) {
      const std::string number = std::to_string(k + 1);
      const Column* rate = out.find("qd" + number);
      Column c{stem + number, rate->unit.starts_with("rad") ? "N m" : "N", doc + number, {}};
      for (std::size_t i = 0; i < out.rows(); ++i) c.values.push_back(rows[i * n + k]);
      put_column(out, std::move(c));
    }
  };
  add("tau", "torque of the motor of joint ", tau);
  if (!acting.in_base.empty()) {
    RMP_TRY_ASSIGN(const auto part, motor_torques(out, sim, a, kExternalTerm, progress, acting));
    add("tau_external", "part of the torque due to the force at the tip, joint ", part);
  }
  mark_limits(out, *a.model);
  return {};
}

/// Columns axis_<name> of the maker's axes.
Result<void> add_axes(Recording& out, const Actor& a) {
  if (!a.axes.known())
    return error(ErrorCode::unsupported, "the maker's axes of the robot are unknown",
                 "Set their names, signs and offsets with robot.set_axes.");
  std::vector<const Column*> joints;
  for (std::size_t k = 0; k < a.model->coordinate_count(); ++k) {
    joints.push_back(out.find("q" + std::to_string(k + 1)));
    if (!joints.back())
      return error(ErrorCode::invalid_argument,
                   "the recording has no column q" + std::to_string(k + 1),
                   "Its robot has changed since then; record it again.");
  }
  std::vector<Column> made;
  for (const PostAxis& axis : a.axes.axes()) {
    std::string name = "axis_" + std::string(axis.name);
    for (char& c : name)  // letters of other languages stay
      if (const auto byte = static_cast<unsigned char>(c); byte < 0x80 && !std::isalnum(byte))
        c = '_';
    const auto is_taken = [&](const std::string& wanted) {
      return std::any_of(made.begin(), made.end(),
                         [&](const Column& other) { return other.name == wanted; });
    };
    for (std::size_t n = 2; is_taken(name); ++n) {  // "J 1" and "J-1"
      const std::string next = name + "_" + std::to_string(n);
      if (!is_taken(next)) name = next;
    }
    Column c{
        name, axis.linear ? "m" : "rad", "axis " + std::string(axis.name) + " of the maker", {}};
    const double scale = axis_scale(axis, nullptr);
    if (axis.lower < axis.upper) c.lower = axis.lower / scale, c.upper = axis.upper / scale;
    std::vector<double> q(joints.size());
    for (std::size_t i = 0; i < out.rows(); ++i) {
      for (std::size_t k = 0; k < q.size(); ++k) q[k] = joints[k]->values[i];
      c.values.push_back(axis_value(axis, q, nullptr).value_or(0) / scale);
    }
    made.push_back(std::move(c));
  }
  for (Column& c : made) put_column(out, std::move(c));
  return {};
}

Result<void> add_energy(Recording& out, const Simulator& sim, const Actor& a, Progress& progress) {
  std::vector<Energy> all;
  RMP_TRY(each_load(
      out, sim, a, {}, progress,
      [&](const Bound<InverseDynamics>& dynamics, const DynamicsBatch& batch) -> Result<void> {
        RMP_TRY_ASSIGN(const auto part, energies(dynamics, batch, progress));
        all.insert(all.end(), part.begin(), part.end());
        return {};
      }));
  Column kinetic{"kinetic", "J", "kinetic energy of bodies and motors", {}},
      potential{"potential", "J", "potential energy of weight (0 at the base) and springs", {}},
      energy{"energy", "J", "kinetic and potential energy", {}};
  for (const Energy& e : all) {
    kinetic.values.push_back(e.kinetic);
    potential.values.push_back(e.potential);
    energy.values.push_back(e.kinetic + e.potential);
  }
  for (Column* c : {&kinetic, &potential, &energy}) put_column(out, std::move(*c));
  return {};
}

/// Poses and Jacobians of the tool in every row.
struct ToolTable {
  std::vector<Pose> pose;        ///< in the world
  std::vector<double> jacobian;  ///< base axes, 6 * dof a row
};

Result<ToolTable> tool_of(const Recording& r, const Actor& a) {
  const RobotModel& m = *a.model;
  const std::size_t c = m.coordinate_count(), n = m.dof();
  RMP_TRY_ASSIGN(const auto q, table(r, "q", c));
  ToolTable out;
  out.jacobian.resize(r.rows() * 6 * n);
  std::vector<Pose> frames(m.joints.size());
  for (std::size_t i = 0; i < r.rows(); ++i) {
    robotics::forward_kinematics(m, std::span(q).subspan(i * c, c), frames);
    out.pose.push_back(spatial::compose(a.world_T_base, robotics::tip_pose(m, 0, frames)));
    robotics::geometric_jacobian(m, 0, frames, robotics::JacobianFrame::base,
                                 std::span(out.jacobian).subspan(i * 6 * n, 6 * n));
  }
  return out;
}

/// The columns x, y, z tell whether robot and mounting are still those of the recording.
Result<void> check_place(const Recording& r, const ToolTable& tool) {
  const Column *x = r.find("x"), *y = r.find("y"), *z = r.find("z");
  if (!x || !y || !z) return {};
  for (std::size_t i = 0; i < r.rows(); ++i) {
    const double off =
        spatial::distance(tool.pose[i].p, Vec3{x->values[i], y->values[i], z->values[i]});
    if (off <= kSamePlace) continue;
    return error(ErrorCode::conflict,
                 "in row " + std::to_string(i + 1) + " the recorded tool is " +
                     text::print_rounded(off, 3) + " m from the position given by its joints",
                 "The robot has been changed or moved, or its mounting moves; record it again.");
  }
  return {};
}

void put_vectors(Recording& out, const std::array<const char*, 3>& names, const char* unit,
                 const char* doc, const std::vector<Vec3>& values) {
  for (std::size_t k = 0; k < 3; ++k) {
    Column c{names[k], unit, doc, {}};
    for (const Vec3& v : values) c.values.push_back(v[k]);
    put_column(out, std::move(c));
  }
}

void add_pose(Recording& out, const ToolTable& tool) {
  std::vector<Vec3> places, angles;
  for (const Pose& p : tool.pose) {
    places.push_back(p.p);
    Vec3 rpy = spatial::to_euler(spatial::kRollPitchYaw, p.R).angles;
    if (!angles.empty())
      for (std::size_t k = 0; k < 3; ++k)  // whole turns, so that nothing jumps at half a turn
        rpy[k] += 2 * M_PI * std::round((angles.back()[k] - rpy[k]) / (2 * M_PI));
    angles.push_back(rpy);
  }
  put_vectors(out, {"x", "y", "z"}, "m", "tool position in the world", places);
  put_vectors(out, {"roll", "pitch", "yaw"}, "rad", "R = Rz(yaw) Ry(pitch) Rx(roll) of the tool",
              angles);
}

Result<void> add_velocity(Recording& out, const Actor& a, const ToolTable& tool) {
  const std::size_t n = a.model->dof();
  RMP_TRY_ASSIGN(const auto qd, table(out, "qd", n));
  std::vector<Vec3> v(out.rows()), w(out.rows());
  Column speed{"speed", "m/s", "of the tool", {}};
  for (std::size_t i = 0; i < out.rows(); ++i) {
    std::array<double, 6> twist{};
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t e = 0; e < 6; ++e)
        twist[e] += tool.jacobian[(i * n + k) * 6 + e] * qd[i * n + k];
    v[i] = spatial::rotate(a.world_T_base, Vec3{twist[0], twist[1], twist[2]});
    w[i] = spatial::rotate(a.world_T_base, Vec3{twist[3], twist[4], twist[5]});
    speed.values.push_back(std::hypot(twist[0], twist[1], twist[2]));
  }
  put_vectors(out, {"vx", "vy", "vz"}, "m/s", "tool velocity in the world", v);
  put_column(out, std::move(speed));
  put_vectors(out, {"wx", "wy", "wz"}, "rad/s", "angular velocity of the tool in the world", w);
  return {};
}

/// The least force and moment F with J^T F = M qdd + c + g + springs + friction - tau - stops.
Result<void> add_force(Recording& out, const Simulator& sim, const Actor& a, const ToolTable& tool,
                       Progress& progress) {
  const std::size_t n = a.model->dof();
  if (!a.model->loops.empty())
    return error(ErrorCode::unsupported, "the force at the tool of closed loops is not computed",
                 "Request other quantities.");
  RMP_TRY_ASSIGN(const auto tau, table(out, "tau", n));
  RMP_TRY_ASSIGN(
      auto missing,
      motor_torques(out, sim, a, kGravityTerm | kInertialTerm | kVelocityTerm | kSpringTerm,
                    progress));
  for (std::size_t i = 0; i < missing.size(); ++i) missing[i] -= tau[i];
  for (const auto& [stem, sign] : {std::pair{"tau_friction", 1.0}, {"tau_stop", -1.0}})
    if (out.find(stem + std::string("1"))) {
      RMP_TRY_ASSIGN(const auto more, table(out, stem, n));
      for (std::size_t i = 0; i < missing.size(); ++i) missing[i] += sign * more[i];
    }
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;
  std::vector<Vec3> force(out.rows()), moment(out.rows());
  for (std::size_t i = 0; i < out.rows(); ++i) {
    const auto rows = static_cast<Eigen::Index>(n);
    const Eigen::Map<const RowMajor> jt(&tool.jacobian[i * 6 * n], rows, 6);
    const Eigen::Map<const Eigen::VectorXd> left(&missing[i * n], rows);
    const Eigen::VectorXd f =
        Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(jt).solve(left);
    force[i] = spatial::rotate(a.world_T_base, Vec3{f[0], f[1], f[2]});
    moment[i] = spatial::rotate(a.world_T_base, Vec3{f[3], f[4], f[5]});
  }
  put_vectors(out, {"fx", "fy", "fz"}, "N", "force on the tool, world's axes", force);
  put_vectors(out, {"mx", "my", "mz"}, "N m", "moment on the tool, world's axes", moment);
  return {};
}

/// With closed loops by the rates of the motors.
Result<void> add_manipulability(Recording& out, const Actor& a, const ToolTable& tool) {
  const RobotModel& m = *a.model;
  const std::size_t n = m.dof(), c = m.coordinate_count();
  Column measure{"manipulability", "", "Yoshikawa's measure of the tool", {}};
  std::vector<double> q;
  if (!m.loops.empty()) {
    RMP_TRY_ASSIGN(q, table(out, "q", c));
  }
  std::vector<Pose> frames(m.joints.size());
  for (std::size_t i = 0; i < out.rows(); ++i) {
    if (m.loops.empty()) {
      measure.values.push_back(
          robotics::manipulability(std::span(tool.jacobian).subspan(i * 6 * n, 6 * n)));
      continue;
    }
    robotics::forward_kinematics(m, std::span(q).subspan(i * c, c), frames);
    measure.values.push_back(robotics::manipulability(robotics::tip_motion(m, 0, frames).jacobian));
  }
  put_column(out, std::move(measure));
  return {};
}

Result<void> add_limit_columns(Recording& out) {
  Column all{"limits_used", "", "greatest fraction of a limit in use, 1 = at the limit",
             std::vector<double>(out.rows())};
  std::vector<Column> shares;
  for (const Column& c : out.columns) {
    if (!recording::has_limit_share(c.lower, c.upper)) continue;
    Column share{"used_" + c.name, "", "fraction of its limits that " + c.name + " uses", {}};
    for (std::size_t i = 0; i < out.rows(); ++i) {
      share.values.push_back(recording::limit_share(c.lower, c.upper, c.values[i]));
      all.values[i] = std::max(all.values[i], share.values.back());
    }
    shares.push_back(std::move(share));
  }
  if (shares.empty())
    return error(ErrorCode::invalid_argument, "no column of the recording has limits",
                 "Give the robot's joints limits and record it again.");
  for (Column& c : shares) put_column(out, std::move(c));
  put_column(out, std::move(all));
  return {};
}

}  // namespace

std::vector<double> rate_of(const std::vector<double>& time, const std::vector<double>& values) {
  std::vector<double> first(values.size()), second(values.size());
  differentiate(time, values, 1, first, second);
  return first;
}

std::vector<double> integral_of(const std::vector<double>& time,
                                const std::vector<double>& values) {
  const std::vector<double> slope = rate_of(time, values);
  std::vector<double> out(values.size());
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double h = time[i] - time[i - 1];
    out[i] =
        out[i - 1] + h / 2 * (values[i - 1] + values[i]) + h * h / 12 * (slope[i - 1] - slope[i]);
  }
  return out;
}

void mark_limits(Recording& recording, const RobotModel& model) {
  std::unordered_map<std::string_view, Column*> columns;
  for (Column& c : recording.columns) columns.try_emplace(c.name, &c);
  const auto mark = [&](const std::string& stem, std::int32_t entry, double lower, double upper) {
    const auto at = columns.find(stem + std::to_string(entry + 1));
    if (at == columns.end()) return;
    at->second->lower = lower;
    at->second->upper = upper;
  };
  for (const JointModel& joint : model.joints) {
    if (joint.is_coupled() || coordinate_count(joint.type) != 1) continue;
    mark("q", joint.q_index, joint.lower, joint.upper);
    mark("qd", joint.v_index, -joint.max_velocity, joint.max_velocity);
    mark("qdd", joint.v_index, -joint.max_acceleration, joint.max_acceleration);
    mark("qddd", joint.v_index, -joint.max_jerk, joint.max_jerk);
    mark("tau", joint.v_index, -joint.max_force, joint.max_force);
  }
}

std::span<const RecordedQuantity> recorded_quantities() { return kQuantities; }

Result<RecordingPtr> with_quantities(const Simulator& sim, const Recording& recording,
                                     std::span<const std::string> quantities, Progress& progress,
                                     const std::optional<TipLoad>& load) {
  if (load && std::find(quantities.begin(), quantities.end(), "torque") == quantities.end())
    return error(ErrorCode::invalid_argument,
                 "a force at a tip is given, but no requested quantity uses it",
                 "Request the quantity torque, or leave the force out.");
  Recording out = recording;
  std::optional<Actor> actor;
  std::optional<ToolTable> tool;
  for (const std::string& what : quantities) {
    if (std::none_of(kQuantities.begin(), kQuantities.end(),
                     [&](const RecordedQuantity& k) { return k.name == what; })) {
      std::vector<std::string> known;
      for (const RecordedQuantity& k : kQuantities) known.emplace_back(k.name);
      std::string hint = text::did_you_mean(what, known);
      if (hint.empty()) hint = "There are " + text::enumerate(known) + ".";
      return error(ErrorCode::unknown_name, "there is no quantity " + text::quote(what), hint);
    }
    if (what == "limits") {
      // Not every simulation marks them; columns of other sources may have some of their own.
      if (const auto of = actor_of(sim, out, progress); of.ok()) mark_limits(out, *of->model);
      RMP_TRY(add_limit_columns(out));
      continue;
    }
    if (what == "clearance") {
      if (!sim.snapshot.get(out.world))
        return error(ErrorCode::unsupported,
                     "the recording does not belong to a world, so its robot has no surroundings",
                     "Put the robot into a world and use world.simulate_dynamics.");
      RMP_TRY_ASSIGN(const auto more, with_clearance(sim, out, progress));
      out = *more;
      continue;
    }
    if (!actor) {
      RMP_TRY_ASSIGN(actor, actor_of(sim, out, progress));
    }
    const std::size_t dof = actor->model->dof();
    if (what == "axes") {
      RMP_TRY(add_axes(out, *actor));
      continue;
    }
    if (what != "pose" && what != "manipulability") complete_rates(out, *actor->model);
    const bool needs_tool = what == "pose" || what == "velocity" || what == "force";
    if (!tool && (needs_tool || what == "manipulability")) {
      RMP_TRY_ASSIGN(tool, tool_of(out, *actor));
    }
    if (needs_tool) RMP_TRY(check_place(out, *tool));
    if (what == "torque") {
      RMP_TRY(add_torque(out, sim, *actor, load, progress));
    } else if (what == "jerk") {
      RMP_TRY(add_jerk(out, *actor->model));
    } else if (what == "power") {
      RMP_TRY(add_power(out, dof));
    } else if (what == "work") {
      RMP_TRY_ASSIGN(const auto total, add_power(out, dof));
      RMP_TRY_ASSIGN(const Column* const time, time_of(out));
      put_column(out, {"work", "J", "work of all motors", integral_of(time->values, total)});
    } else if (what == "energy") {
      RMP_TRY(add_energy(out, sim, *actor, progress));
    } else if (what == "pose") {
      add_pose(out, *tool);
    } else if (what == "velocity") {
      RMP_TRY(add_velocity(out, *actor, *tool));
    } else if (what == "force") {
      RMP_TRY(add_force(out, sim, *actor, *tool, progress));
    } else {
      RMP_TRY(add_manipulability(out, *actor, *tool));
    }
  }
  if (actor) name_axes(out, *actor->model, actor->axes);
  return std::make_shared<const Recording>(std::move(out));
}

Result<RecordingPtr> with_quantities_of(const Simulator& sim, const Recording& recording,
                                        const std::string& robot,
                                        std::span<const std::string> quantities, Progress& progress,
                                        const std::optional<TipLoad>& load) {
  if (robot.empty() || robot == recording.robot)
    return with_quantities(sim, recording, quantities, progress, load);
  if (std::find(quantities.begin(), quantities.end(), "clearance") != quantities.end())
    return error(ErrorCode::invalid_argument, "the clearance is that of all robots together",
                 "Request it without a robot.");
  const std::string prefix = robot + ".";
  Recording own;
  own.world = recording.world;
  own.robot = robot;
  own.loads = recording.loads;
  for (const Column& c : recording.columns) {
    if (c.name == "time") own.columns.push_back(c);
    if (!c.name.starts_with(prefix)) continue;
    own.columns.push_back(c);
    own.columns.back().name = c.name.substr(prefix.size());
    const std::string& name = own.columns.back().name;
    own.dof += name.starts_with("qd") && !name.starts_with("qdd") ? 1 : 0;
  }
  if (!own.find("q1"))
    return error(ErrorCode::unknown_name,
                 "the recording has no joints of a robot " + text::quote(robot),
                 "recording.columns lists its columns.");
  RMP_TRY_ASSIGN(const auto done, with_quantities(sim, own, quantities, progress, load));
  Recording out = recording;
  for (Column c : done->columns) {
    if (c.name == "time") continue;
    c.name = prefix + c.name;
    put_column(out, std::move(c));
  }
  for (const std::string& note : done->notes) out.notes.push_back(robot + ": " + note);
  return std::make_shared<const Recording>(std::move(out));
}

}  // namespace robomosp::sim
