// SPDX-License-Identifier: Apache-2.0
// Dynamics of a robot at one instant: torques, accelerations, inertia, energy, momentum, partial
// derivatives, regressor, forces of closed loops.
#include <algorithm>
#include <cmath>

#include "ioci/core/commands.h"
#include "ioci/robot/array_units.h"
#include "ioci/robot/robots.h"
#include "ioci/robot/states.h"
#include "robotics/closure.h"
#include "robotics/coordinates.h"
#include "robotics/kinematics.h"
#include "robotics/maker_axes.h"
#include "sim/batches.h"
#include "sim/closed_dynamics.h"
#include "sim/dynamics.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

using model::Robot;

/// A state of a robot with what acts on it, or many of them, as the commands' arguments give it.
struct Instant {
  std::shared_ptr<const RobotModel> model;
  States q, qd, qdd, tau;
  std::size_t rows = 0;           ///< of the answer; 0 = one state was given, and one answer is
  std::vector<TipWrench> wrench;  ///< base axes; one for all states, or one each
  BaseMotion base;
  sim::FollowedRates followed;
  DynamicsBatch batch;
};

/// What a command wants of the loops of its states.
enum class Loops {
  pulled,  ///< they may be open: the solver pulls them together, and accelerations are its answer
  closed   ///< they and what moves them must keep them closed
};

Result<std::uint32_t> read_terms(const Value* given) {
  if (!given || given->is_nil()) return static_cast<std::uint32_t>(kAllTerms);
  const std::pair<const char*, std::uint32_t> words[] = {
      {"gravity", kGravityTerm},   {"inertial", kInertialTerm}, {"velocity", kVelocityTerm},
      {"friction", kFrictionTerm}, {"external", kExternalTerm}, {"spring", kSpringTerm}};
  std::vector<std::string> known;
  for (const auto& [word, bit] : words) known.emplace_back(word);
  std::uint32_t out = 0;
  for (const Value& v : *given->as_list()) {
    const std::string name = v.as_string() ? *v.as_string() : v.text();
    const auto it = std::find_if(std::begin(words), std::end(words),
                                 [&](const auto& w) { return name == w.first; });
    if (it == std::end(words)) return unknown_name("term", name, known).in("terms");
    out |= it->second;
  }
  return out;
}

Result<std::int32_t> read_tip(const RobotModel& m, const Map& args) {
  if (!has(args, "tip")) return 0;
  std::vector<std::string> known;
  const std::string wanted = text_of(args, "tip");
  for (std::size_t i = 0; i < m.tips.size(); ++i) {
    if (m.tips[i].name == wanted) return static_cast<std::int32_t>(i);
    known.push_back(m.tips[i].name);
  }
  return unknown_name("tip", wanted, known).in("robot " + text::quote(m.name));
}

/// Closes the loops of each state.
Result<void> close_states(CommandContext& ctx, const RobotModel& model, States& q) {
  const std::size_t width = model.coordinate_count();
  const auto held = robotics::actuated_velocities(model);
  std::vector<double> out(q.values().size());
  RMP_TRY(for_states(
      q.count(), kNanosecondsToClose, ctx.progress,
      [&](std::size_t first, std::size_t last, std::size_t) -> Result<void> {
        for (std::size_t i = first; i < last; ++i) {
          const std::span<const double> open = q.values().subspan(i * width, width);
          const robotics::Closure closed = robotics::close_loops(model, open, open, held);
          if (!closed.is_closed)
            return error(ErrorCode::unreachable,
                         "its loops do not close near these joint values" + in_row(q, i),
                         "Give joint values nearer to a closed configuration: robot.close.",
                         "robot " + text::quote(model.name));
          std::copy_n(closed.q.begin(), width,
                      out.begin() + static_cast<std::ptrdiff_t>(i * width));
        }
        return {};
      }));
  q.replace(std::move(out));
  return {};
}

/// The numbers of a force or moment: three, or a row of three a state. Empty when not given.
Result<std::vector<double>> read_wrench_part(const Map& args, const char* name, const char* unit,
                                             bool takes_rows) {
  if (!has(args, name)) return std::vector<double>();
  const Value& given = *args.find(name);
  const List* list = given.as_list();
  const NumericArray* array = given.as_array();
  const bool is_rows =
      array ? array->is_matrix() && array->cols() == 3 && (takes_rows || array->rows() == 1)
            : list && !list->empty() && (list->front().as_list() || list->front().as_array());
  std::vector<double> out;
  if (array && is_rows) {
    out.assign(array->data().begin(), array->data().end());
  } else {
    const ParamSpec three = field("", "vec3", unit, "");
    const List one{given};
    const List& rows = is_rows && takes_rows ? *list : one;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::string where =
          std::string(name) + (rows.size() > 1 ? "[" + std::to_string(i + 1) + "]" : "");
      RMP_TRY_ASSIGN(const Value checked, check_value(three, rows[i], where));
      for (const double v : reals(&checked)) out.push_back(v);
    }
  }
  RMP_TRY(check_size(out, name));
  return out;
}

/// The wrench at a tip, from the axes it is given in to those of the base that solvers want.
Result<void> read_wrench(const Map& args, Instant& c, bool takes_rows) {
  const bool is_given = has(args, "tip_force") || has(args, "tip_moment");
  if (has(args, "tip") && !is_given)
    return error(ErrorCode::invalid_argument, "a tip is named, but no wrench acts at it",
                 "Give tip_force or tip_moment, or leave the tip out.", "tip");
  if (!is_given) return {};
  RMP_TRY_ASSIGN(std::vector<double> force, read_wrench_part(args, "tip_force", "N", takes_rows));
  RMP_TRY_ASSIGN(std::vector<double> moment,
                 read_wrench_part(args, "tip_moment", "N m", takes_rows));
  std::size_t rows = std::max<std::size_t>(1, c.rows);
  for (const auto& [part, name] : {std::pair{&force, "tip_force"}, {&moment, "tip_moment"}}) {
    if (part->empty()) part->assign(3, 0.0);
    const std::size_t own = part->size() / 3;
    if (own == 1 || own == rows) continue;
    if (rows > 1 || c.rows > 0)
      return error(ErrorCode::invalid_argument,
                   "it has " + std::to_string(own) + " rows, but there are " +
                       std::to_string(rows) + " states",
                   "Give one row per state, or one for all.", name);
    rows = c.rows = own;  // one state under many wrenches
    for (States* s : {&c.q, &c.qd, &c.qdd, &c.tau})
      if (s->count() > 0) s->repeat(rows);
  }
  const bool is_tool = text_of(args, "tip_axes") == "tool";
  const std::size_t states = is_tool ? rows : std::max(force.size(), moment.size()) / 3,
                    width = c.model->coordinate_count();
  const auto row = [](const std::vector<double>& part, std::size_t i) {
    const double* at = &part[part.size() == 3 ? 0 : 3 * i];
    return Vec3{at[0], at[1], at[2]};
  };
  std::vector<Pose> frames(is_tool ? c.model->joints.size() : 0);
  c.wrench.reserve(states);
  for (std::size_t i = 0; i < states; ++i) {
    const Vec3 f = row(force, i), m = row(moment, i);
    if (!is_tool) {
      c.wrench.push_back(
          {spatial::rotate_back(c.model->base, f), spatial::rotate_back(c.model->base, m)});
      continue;
    }
    const std::size_t of = c.q.count() == 1 ? 0 : i;
    robotics::forward_kinematics(*c.model, c.q.values().subspan(of * width, width), frames);
    const Pose tip =
        robotics::tip_pose(*c.model, static_cast<std::size_t>(c.batch.tip_index), frames);
    c.wrench.push_back({spatial::rotate(tip, f), spatial::rotate(tip, m)});
  }
  c.batch.tip = c.wrench;
  return {};
}

/// `takes_rows`: whether the command's answer can have a row a state.
Result<void> read_instant(CommandContext& ctx, const Map& args, Instant& c, Loops loops,
                          std::uint32_t terms = 0, bool takes_rows = false) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(c.model, model_of(ctx, args));
  if (!takes_rows) RMP_TRY(refuse_rows(args, {"q", "qd", "qdd", "tau"}));
  RMP_TRY_ASSIGN(c.q, read_states(*args.find("q"), r, *c.model, "q"));
  note_degrees(ctx, *c.model, c.q.values().first(c.model->coordinate_count()));
  if (flag(args, "close")) RMP_TRY(close_states(ctx, *c.model, c.q));
  RMP_TRY_ASSIGN(c.qd, read_rates(args, "qd", r, *c.model));
  RMP_TRY_ASSIGN(c.qdd, read_rates(args, "qdd", r, *c.model));
  RMP_TRY_ASSIGN(c.tau, read_rates(args, "tau", r, *c.model));
  RMP_TRY_ASSIGN(c.rows, share_rows({&c.q, &c.qd, &c.qdd, &c.tau}));
  RMP_TRY_ASSIGN(c.batch.terms, read_terms(args.find("terms")));
  if (terms != 0) c.batch.terms = terms;
  RMP_TRY_ASSIGN(c.batch.tip_index, read_tip(*c.model, args));
  RMP_TRY(read_wrench(args, c, takes_rows));
  c.batch.count = std::max<std::size_t>(1, c.rows);
  c.batch.q = c.q.values();
  c.batch.qd = c.qd.values();
  c.batch.qdd = c.qdd.values();
  c.batch.tau = c.tau.values();
  // Given in the mounting frame, where poses are; solvers want the base's axes.
  const auto in_base = [&](const char* name) {
    return spatial::rotate_back(c.model->base, vec3(args, name));
  };
  if (has(args, "base_acceleration") || has(args, "base_angular_velocity") ||
      has(args, "base_angular_acceleration")) {
    c.base = {c.model->gravity, in_base("base_acceleration"), in_base("base_angular_velocity"),
              in_base("base_angular_acceleration")};
    c.batch.base = std::span(&c.base, 1);
  }
  const bool follows = flag(args, "close"), of_tree = flag(args, "tree");
  if (follows && of_tree)
    return error(ErrorCode::invalid_argument, "close and tree exclude each other",
                 "Give close = true or tree = true.", "tree");
  if (of_tree) return {};
  if (loops != Loops::closed && !follows) return {};
  const std::uint32_t asked = c.batch.terms;
  if (loops == Loops::pulled) c.batch.terms &= ~static_cast<std::uint32_t>(kInertialTerm);
  RMP_TRY(sim::check_loops(
      *c.model, c.batch, follows ? &c.followed : nullptr,
      [&c](std::size_t row) { return in_row(c.q, row); }, ctx.progress));
  c.batch.terms = asked;
  return {};
}

/// Says when joints without motors are left with forces that the motors cannot give.
void report_missing_motor(CommandContext& ctx, const Robot& robot, const RobotModel& m,
                          std::span<const double> tau) {
  const auto missing = sim::missing_motor(m, tau);
  if (!missing) return;
  for (const JointModel& j : m.joints) {
    if (j.is_coupled() || !j.passive) continue;
    const auto first = static_cast<std::size_t>(j.v_index);
    if (missing->entry < first ||
        missing->entry >= first + static_cast<std::size_t>(velocity_count(j.type)))
      continue;
    ctx.app.messages.post(Severity::warning, "missing_motor",
                          "robot " + text::quote(m.name) +
                              ": its motors do not hold every motion that its loops allow; what "
                              "they lack is in the entries of joints without motors, " +
                              text::print_rounded(missing->force, 4) + " at " +
                              robotics::MakerAxes::for_messages(&robot)->before_joint(
                                  static_cast<std::size_t>(j.q_index)) +
                              "joint " + text::quote(j.name) + ".",
                          "ioci");
    return;
  }
}

/// The solver asked for, else the robot's own; closed loops need one that knows them.
Result<model::ProviderChoice> inverse_choice(CommandContext& ctx, const Map& args) {
  if (has(args, "provider")) return read_provider(*args.find("provider"), "provider");
  return content<Robot>(ctx, args).inverse_dynamics;
}
Result<model::ProviderChoice> forward_choice(CommandContext& ctx, const Map& args,
                                             const RobotModel& m) {
  if (has(args, "provider")) return read_provider(*args.find("provider"), "provider");
  return sim::forward_choice(m, content<Robot>(ctx, args).forward_dynamics);
}
Result<sim::Bound<InverseDynamics>> inverse_solver(CommandContext& ctx, const Map& args,
                                                   const Instant& c) {
  RMP_TRY_ASSIGN(const auto choice, inverse_choice(ctx, args));
  if (flag(args, "tree")) return sim::bind_tree_dynamics(ctx.app.registry, c.model, choice);
  return ctx.app.solvers.inverse_dynamics(ctx.app.registry, c.model, choice);
}
Result<sim::Bound<ForwardDynamics>> forward_solver(CommandContext& ctx, const Map& args,
                                                   const Instant& c) {
  RMP_TRY_ASSIGN(const auto choice, forward_choice(ctx, args, *c.model));
  return ctx.app.solvers.forward_dynamics(ctx.app.registry, c.model, choice);
}

/// What torques are without masses; motors, friction, springs and a wrench still count.
std::string_view without_mass(const Instant& c) {
  const auto& joints = c.model->joints;
  const bool driven = std::any_of(joints.begin(), joints.end(), [](const JointModel& j) {
    return j.armature != 0 || j.friction.viscous != 0 || j.friction.coulomb_positive != 0 ||
           j.friction.coulomb_negative != 0 || j.spring.stiffness != 0;
  });
  return driven || !c.batch.tip.empty() ? ", so its links add nothing to its torques"
                                        : ", so its torques are zero";
}

/// The answer of a solver: `cols` numbers a state, which `compute(span)` puts there. One state's
/// are `rows` x `cols` of its own.
template <class Compute>
Result<Value> answered(const Instant& c, std::size_t rows, std::size_t cols, std::string unit,
                       Compute&& compute) {
  const std::size_t width = rows == 0 ? cols : rows * cols;
  const auto room = room_for(c.batch.count * width);
  RMP_TRY(compute(std::span<double>(room.get(), c.batch.count * width)));
  if (c.rows > 0) return Value(rows_of(room, c.rows, width, std::move(unit)));
  return Value(rows == 0 ? rows_of(room, cols, 0, std::move(unit))
                         : rows_of(room, rows, cols, std::move(unit)));
}

Result<Value> torques_of(CommandContext& ctx, const Map& args, const Instant& c) {
  RMP_TRY_ASSIGN(const auto bound, inverse_solver(ctx, args, c));
  return answered(c, 0, c.model->dof(), force_array_unit(*c.model),
                  [&](std::span<double> out) -> Result<void> {
                    RMP_TRY(sim::torques(bound, c.batch, out, ctx.progress));
                    if (!flag(args, "tree"))
                      report_missing_motor(ctx, content<Robot>(ctx, args), *c.model, out);
                    return {};
                  });
}

Result<Value> inverse_dynamics(CommandContext& ctx, const Map& args) {
  Instant c;
  RMP_TRY(read_instant(ctx, args, c, Loops::closed, 0, true));
  report_no_mass(ctx, *c.model, Severity::warning, without_mass(c));
  return torques_of(ctx, args, c);
}

Result<Value> gravity_torques(CommandContext& ctx, const Map& args) {
  Instant c;
  RMP_TRY(read_instant(ctx, args, c, Loops::closed, kGravityTerm, true));
  report_no_mass(ctx, *c.model, Severity::warning, ", so its torques are zero");
  return torques_of(ctx, args, c);
}

Result<Value> inertia(CommandContext& ctx, const Map& args) {
  Instant c;
  RMP_TRY(read_instant(ctx, args, c, Loops::closed, 0, true));
  RMP_TRY_ASSIGN(const auto bound, inverse_solver(ctx, args, c));
  const std::size_t n = c.model->dof();
  return answered(c, n, n, "", [&](std::span<double> out) {
    return sim::inertia(bound, c.batch, out, ctx.progress);
  });
}

Result<Value> forward_dynamics(CommandContext& ctx, const Map& args) {
  Instant c;
  RMP_TRY(read_instant(ctx, args, c, Loops::pulled, 0, true));
  RMP_TRY_ASSIGN(const auto bound, forward_solver(ctx, args, c));
  return answered(
      c, 0, c.model->dof(), rate_array_unit(*c.model, "/s^2"),
      [&](std::span<double> out) { return sim::accelerations(bound, c.batch, out, ctx.progress); });
}

Result<Energy> energy_of(CommandContext& ctx, const Map& args, Instant& c) {
  // Accelerations are no part of energies.
  RMP_TRY(read_instant(ctx, args, c, Loops::closed, kGravityTerm | kSpringTerm));
  RMP_TRY_ASSIGN(const auto bound, inverse_solver(ctx, args, c));
  RMP_TRY_ASSIGN(const auto out, sim::energies(bound, c.batch, ctx.progress));
  return out.front();
}

Result<Value> energy(CommandContext& ctx, const Map& args) {
  Instant c;
  RMP_TRY_ASSIGN(const Energy e, energy_of(ctx, args, c));
  return Value(
      Map{{"kinetic", e.kinetic}, {"potential", e.potential}, {"total", e.kinetic + e.potential}});
}

Result<Value> momentum(CommandContext& ctx, const Map& args) {
  Instant c;
  RMP_TRY_ASSIGN(const Energy e, energy_of(ctx, args, c));
  const Pose& base = c.model->base;
  // About the mounting frame's origin, in its axes.
  const Vec3 linear = spatial::rotate(base, e.momentum);
  const Vec3 angular =
      spatial::add(spatial::rotate(base, e.angular_momentum), spatial::cross(base.p, linear));
  return Value(Map{{"linear", vec_value(linear, "kg m/s")},
                   {"angular", vec_value(angular, "kg m^2/s")},
                   {"com", vec_value(spatial::transform(base, e.com), "m")}});
}

Result<Value> dynamics_derivatives(CommandContext& ctx, const Map& args) {
  Instant c;
  RMP_TRY(read_instant(ctx, args, c, Loops::pulled));
  const std::size_t n = c.model->dof();
  const auto matrix = [&](std::vector<double> v) { return NumericArray(std::move(v), n, n); };
  Map out;
  if (text_of(args, "of") == "accelerations") {
    if (flag(args, "tree"))
      return error(ErrorCode::invalid_argument,
                   "accelerations are always those of the closed mechanism",
                   "Leave tree out, or request the derivatives of torques.", "tree");
    RMP_TRY_ASSIGN(const auto bound, forward_solver(ctx, args, c));
    RMP_TRY_ASSIGN(auto d, sim::derivatives(bound, c.batch, ctx.progress));
    out.set("by_q", matrix(std::move(d.by_q)));
    out.set("by_qd", matrix(std::move(d.by_qd)));
    out.set("by_tau", matrix(std::move(d.by_tau)));
    out.set("numerical", d.numerical);
    return Value(std::move(out));
  }
  RMP_TRY_ASSIGN(const auto bound, inverse_solver(ctx, args, c));
  RMP_TRY_ASSIGN(auto d, sim::derivatives(bound, c.batch, ctx.progress));
  RMP_TRY_ASSIGN(auto m, sim::inertia(bound, c.batch, ctx.progress));
  out.set("by_q", matrix(std::move(d.by_q)));
  out.set("by_qd", matrix(std::move(d.by_qd)));
  out.set("by_qdd", matrix(std::move(m)));
  out.set("numerical", d.numerical);
  return Value(std::move(out));
}

Result<Value> regressor(CommandContext& ctx, const Map& args) {
  Instant c;
  RMP_TRY(read_instant(ctx, args, c, Loops::closed, kGravityTerm | kInertialTerm | kVelocityTerm));
  RMP_TRY_ASSIGN(const auto bound, inverse_solver(ctx, args, c));
  RMP_TRY_ASSIGN(auto y, sim::regressor(bound, c.batch, ctx.progress));
  std::vector<double> parameters;
  for (const JointModel& j : c.model->joints)
    for (const double x : spatial::inertial_parameters(j.body)) parameters.push_back(x);
  Map out;
  const std::size_t columns = parameters.size();
  out.set("matrix", NumericArray(std::move(y), c.model->dof(), columns));
  out.set("parameters", NumericArray(std::move(parameters)));
  return Value(std::move(out));
}

Result<Value> constraint_forces(CommandContext& ctx, const Map& args) {
  Instant c;
  const bool of_motion = has(args, "qdd");
  if (of_motion && has(args, "tau"))
    return error(ErrorCode::invalid_argument, "torques and accelerations are given",
                 "Give tau, or the motion's qdd to compute the motors' torques.", "qdd");
  RMP_TRY(read_instant(ctx, args, c, of_motion ? Loops::closed : Loops::pulled));
  if (c.model->loops.empty())
    return error(ErrorCode::invalid_argument, "it has no closed loops, so there are no loop forces",
                 "Add one: robot.add_loop.", "robot " + text::quote(c.model->name));
  std::vector<double> tau(c.batch.tau.begin(), c.batch.tau.end());
  tau.resize(c.model->dof());
  if (of_motion) {
    RMP_TRY_ASSIGN(const auto inverse,
                   ctx.app.solvers.inverse_dynamics(ctx.app.registry, c.model,
                                                    content<Robot>(ctx, args).inverse_dynamics));
    RMP_TRY_ASSIGN(tau, sim::torques(inverse, c.batch, ctx.progress));
    report_missing_motor(ctx, content<Robot>(ctx, args), *c.model, tau);
    c.batch.tau = tau;
    c.batch.qdd = {};
  }
  RMP_TRY_ASSIGN(const auto bound, forward_solver(ctx, args, c));
  RMP_TRY_ASSIGN(auto motion, sim::constrained(bound, c.batch, ctx.progress));
  std::vector<Pose> frames(c.model->joints.size());
  robotics::forward_kinematics(*c.model, c.q.values(), frames);
  std::vector<double> open(robotics::loop_rows(*c.model));
  robotics::loop_residual(*c.model, frames, open);
  List loops;
  std::size_t row = 0;
  for (const LoopModel& l : c.model->loops) {
    std::array<double, 6> w{}, gap{};
    for (std::size_t d = 0; d < 6; ++d)
      if (l.fixed & (1U << d)) {
        w[d] = motion.forces[row];
        gap[d] = open[row++];
      }
    loops.emplace_back(Map{{"name", l.name},
                           {"force", vec_value({w[0], w[1], w[2]}, "N")},
                           {"moment", vec_value({w[3], w[4], w[5]}, "N m")},
                           {"gap", vec_value({gap[0], gap[1], gap[2]}, "m")},
                           {"turn", vec_value({gap[3], gap[4], gap[5]}, "rad")}});
  }
  Map out;
  out.set("loops", std::move(loops));
  out.set("q", NumericArray(std::vector<double>(c.q.values().begin(), c.q.values().end()),
                            joint_array_unit(*c.model)));
  out.set("qdd", NumericArray(std::move(motion.qdd), rate_array_unit(*c.model, "/s^2")));
  out.set("tau", NumericArray(std::move(tau), force_array_unit(*c.model)));
  out.set("provider", bound.provider);
  return Value(std::move(out));
}

/// A four-bar of slender rods for examples, in a vertical plane: the drive stands along y.
std::string with_linkage(const char* rest) {
  return std::string(
             "local bar = robot.create{name = \"bar\", links = {\n"
             "  {name = \"crank\", a = 0.1, mass = 0.1, com = {-0.05, 0, 0}},\n"
             "  {name = \"coupler\", a = 0.35, mass = 0.35, com = {-0.175, 0, 0}, inertia = {0, "
             "0.0036, 0.0036, 0, 0, 0}, passive = true},\n"
             "  {name = \"rocker\", parent = \"base\", origin = {0.4, 0, 0, 0, 0, 0}, mass = 0.25, "
             "com = "
             "{0.125, 0, 0}, inertia = {0, 0.0013, 0.0013, 0, 0, 0}, passive = true}},\n"
             "  poses = {home = {0.6, 0.7, 1.8}}}\n"
             "bar:add_loop{name = \"pin\", kind = \"planar\", a = {link = \"coupler\"},\n"
             "  b = {link = \"rocker\", position = {0.25, 0, 0}}}\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(robot_dynamics_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec q =
      needed("q", "any", "rad or m", "Joint values, one per coordinate, or the name of a pose.");
  // Of the commands that answer a row a state.
  const ParamSpec q_rows = needed(
      "q", "any", "rad or m",
      "Joint values, one per coordinate, the name of a pose, or a matrix with one row per state.");
  const auto with_rows = [](ParamSpec p) {
    p.doc =
        p.doc.substr(0, p.doc.find(';')) + ", or one row per state" + p.doc.substr(p.doc.find(';'));
    return p;
  };
  const std::string rows_details =
      "With a matrix of states the result has one row per state; an argument given as one state "
      "applies to all rows.";
  const ParamSpec tip = optional("tip", "string", "",
                                 "Name of the tip at which the wrench acts; the first if omitted.");
  const ParamSpec gravity =
      between(optional("gravity", "vec3", "m/s^2",
                       "In the robot's mounting frame; {0, 0, -9.81} if omitted."),
              -kMostOfAJoint, kMostOfAJoint);
  const ParamSpec qd = optional("qd", "any", "rad/s or m/s", "Joint speeds; zeros if omitted.");
  const ParamSpec qdd =
      optional("qdd", "any", "rad/s^2 or m/s^2", "Joint accelerations; zeros if omitted.");
  const ParamSpec qdd_of_motion =
      optional("qdd", "any", "rad/s^2 or m/s^2",
               "Instead of tau: joint accelerations of a motion; the forces for it are computed.");
  const ParamSpec tau =
      optional("tau", "any", "N m or N", "Joint torques and forces; zeros if omitted.");
  const ParamSpec force =
      optional("tip_force", "any", "N", "Force that acts on the robot at the tip: x, y and z.");
  const ParamSpec moment =
      optional("tip_moment", "any", "N m", "Moment that acts on the robot about the tip's origin.");
  const auto wrench_rows = [](ParamSpec p) {
    p.doc.insert(p.doc.size() - 1, "; one for all, or one row per state");
    return p;
  };
  const ParamSpec tip_axes =
      choice("tip_axes", {"base", "tool"},
             "Axes of force and moment: those of the mounting frame, or the tip's own.");
  const ParamSpec terms = optional(
      "terms", "list", "",
      "Terms to include: gravity, inertial, velocity, friction, external, spring; all if omitted.");
  const ParamSpec base_a = between(
      optional("base_acceleration", "vec3", "m/s^2",
               "Acceleration of the base's origin, without gravity, in the mounting frame's axes."),
      -kMostOfAJoint, kMostOfAJoint);
  const ParamSpec base_w =
      between(optional("base_angular_velocity", "vec3", "rad/s",
                       "Angular velocity of the base, in the mounting frame's axes."),
              -kMostOfAJoint, kMostOfAJoint);
  const ParamSpec base_wd =
      between(optional("base_angular_acceleration", "vec3", "rad/s^2",
                       "Angular acceleration of the base, in the mounting frame's axes."),
              -kMostOfAJoint, kMostOfAJoint);
  const ParamSpec close =
      defaulted("close", "bool", "", false,
                "First closes the loops: joints without motors move to the positions given by the "
                "joints with motors, and their speeds and accelerations follow.");
  const ParamSpec tree = defaulted("tree", "bool", "", false,
                                   "Of the open tree after cutting the closed loops, with forces "
                                   "at all its joints; loops may be open.");
  const ParamSpec provider =
      optional("provider", "any", "",
               "Name of the solver, or {name = ..., params = {...}}; by default the robot's own.");

  all.push_back(
      {.name = "robot.inverse_dynamics",
       .classic = "",
       .summary = "Computes the joint torques and forces for a motion.",
       .details = "The sum of the terms gravity, inertial, velocity, friction, external and "
                  "spring, or of the requested terms. The wrench at the tip acts on the robot. "
                  "With closed loops the torques are those of the motors that move the closed "
                  "mechanism; with more motors than necessary the smallest ones are chosen; joints "
                  "without motors have 0. q, qd and qdd must keep the loops closed, or are "
                  "adjusted by `close`. robot.constraint_forces returns the forces in the loops "
                  "for the same motion. A joint no faster than 1e-9 rad/s or m/s is at rest: the "
                  "share of static friction in its torque is unknown, and none is counted. " +
                  rows_details,
       .example = with_arm("local tau = arm:inverse_dynamics{q = \"ready\", qd = {0.1, 0, 0, 0, 0, "
                           "0}, terms = {\"gravity\", \"velocity\"}}\nassert(#tau == 6)"),
       .params = {self("robot"), q_rows, with_rows(qd), with_rows(qdd), terms, gravity,
                  wrench_rows(force), wrench_rows(moment), provider, tip, base_a, base_w, base_wd,
                  tip_axes, close, tree},
       .returns =
           {"array", "N m or N", "One value per velocity; for a batch one row per state.", {}},
       .effect = Effect::reads,
       .run = inverse_dynamics});
  all.push_back(
      {.name = "robot.gravity_torques",
       .classic = "",
       .summary = "Computes the joint torques and forces that hold the robot still.",
       .details = "With closed loops those of the motors. " + rows_details,
       .example = with_arm("assert(math.abs(arm:gravity_torques{q = \"ready\"}[1]) < 1e-12)"),
       .params = {self("robot"), q_rows, gravity, provider, close, tree},
       .returns =
           {"array", "N m or N", "One value per velocity; for a batch one row per state.", {}},
       .effect = Effect::reads,
       .run = gravity_torques});
  all.push_back(
      {.name = "robot.inertia",
       .classic = "",
       .summary = "Computes the joint-space inertia matrix, including motors.",
       .details =
           "With closed loops it is the inertia at the motors, with zeros for joints without "
           "motors: rates that keep the loops closed have the same kinetic energy. For a matrix of "
           "states each row of the result is one matrix, row after row: m[i]:reshape(n, n).",
       .example = with_arm(
           "local m = arm:inertia{q = \"ready\"}\nassert(math.abs(m[1][2] - m[2][1]) < 1e-12)"),
       .params = {self("robot"), q_rows, provider, close, tree},
       .returns =
           {"matrix", "", "Velocities x velocities, symmetric; for a batch one row per state.", {}},
       .effect = Effect::reads,
       .run = inertia});
  all.push_back(
      {.name = "robot.forward_dynamics",
       .classic = "",
       .summary = "Computes the joint accelerations caused by torques.",
       .details =
           "For robots with closed loops the default solver is `constrained`; gaps of their loops "
           "are pulled together. For others with 24 velocities or more it is `articulated_body`, "
           "with a run time linear in their number, if no joint follows another one. " +
           rows_details,
       .example = with_arm("local q = arm:poses().ready\nlocal tau = arm:inverse_dynamics{q = q, "
                           "qdd = {1, 0, 0, 0, 0, 0}}\nlocal qdd = arm:forward_dynamics{q = q, tau "
                           "= tau, provider = \"articulated_body\"}\nassert(math.abs(qdd[1] - 1) < "
                           "1e-9)"),
       .params = {self("robot"), q_rows, with_rows(qd), with_rows(tau), gravity, wrench_rows(force),
                  wrench_rows(moment), provider, terms, tip, base_a, base_w, base_wd, close,
                  tip_axes},
       .returns = {"array",
                   "rad/s^2 or m/s^2",
                   "One value per velocity; for a batch one row per state.",
                   {}},
       .effect = Effect::reads,
       .run = forward_dynamics});
  all.push_back(
      {.name = "robot.energy",
       .classic = "",
       .summary = "Computes the kinetic and potential energy of the moving links.",
       .details = "Kinetic energy includes the motors, potential energy the springs; the potential "
                  "energy of weight is 0 at the base's origin.",
       .example = with_arm("local e = arm:energy{q = \"ready\", qd = {1, 0, 0, 0, 0, 0}}\nlocal m "
                           "= arm:inertia{q = \"ready\"}\nassert(math.abs(e.kinetic - m[1][1] / 2) "
                           "< 1e-12)"),
       .params = {self("robot"), q, qd, gravity, provider, close, tree},
       .returns = {"map",
                   "",
                   "",
                   {field("kinetic", "real", "J", "Kinetic energy of links and motors."),
                    field("potential", "real", "J", "Potential energy of weight and springs."),
                    field("total", "real", "J", "Their sum.")}},
       .effect = Effect::reads,
       .run = energy});
  all.push_back({.name = "robot.momentum",
                 .classic = "",
                 .summary = "Computes the momentum of the moving links and their centre of mass.",
                 .details = "In the axes of the mounting frame, about its origin.",
                 .example = with_arm("local p = arm:momentum{q = \"ready\", qd = {0, 0, 0, 0, 0, "
                                     "0}}\nassert(p.linear[1] == 0 and p.com[3] > 0)"),
                 .params = {self("robot"), q, qd, provider, close, tree},
                 .returns = {"map",
                             "",
                             "",
                             {field("linear", "vec3", "kg m/s", "Linear momentum."),
                              field("angular", "vec3", "kg m^2/s", "Angular momentum."),
                              field("com", "vec3", "m", "Centre of mass.")}},
                 .effect = Effect::reads,
                 .run = momentum});
  all.push_back(
      {.name = "robot.dynamics_derivatives",
       .classic = "",
       .summary = "Computes the partial derivatives of torques or accelerations with respect to "
                  "the state.",
       .details = "Row = result, column = variable. For ball and free joints \"by q\" means by "
                  "small rotations and translations along the moving frame. If a solver computes "
                  "no derivatives, central differences of order four are used. With closed loops, "
                  "derivatives of accelerations are available, and with `tree` those of the open "
                  "tree's torques.",
       .example =
           with_arm("local d = arm:dynamics_derivatives{q = \"ready\"}\nlocal m = arm:inertia{q = "
                    "\"ready\"}\nassert(d.by_qdd[2][3] == m[2][3] and not d.numerical)\nlocal f = "
                    "arm:dynamics_derivatives{q = \"ready\", of = \"accelerations\", provider = "
                    "\"articulated_body\"}\nlocal n = arm:dynamics_derivatives{q = \"ready\", of = "
                    "\"accelerations\", provider = \"inertia_matrix\"}\nassert(n.numerical and not "
                    "f.numerical)\nfor i = 1, 6 do assert(math.abs(n.by_q[i][2] - f.by_q[i][2]) < "
                    "1e-7) end"),
       .params = {self("robot"), q, qd, qdd, tau,
                  choice("of", {"torques", "accelerations"},
                         "Of the inverse dynamics at qdd, or of the forward dynamics at tau."),
                  terms, gravity, force, moment, provider, tip, base_a, base_w, base_wd, tip_axes,
                  tree},
       .returns = {"map",
                   "",
                   "",
                   {field("by_q", "matrix", "", "Derivatives by joint values."),
                    field("by_qd", "matrix", "", "Derivatives by joint speeds."),
                    field("by_qdd", "matrix", "",
                          "Derivatives of torques by accelerations: the inertia."),
                    field("by_tau", "matrix", "", "Derivatives of accelerations by torques."),
                    field("numerical", "bool", "", "Whether they were computed by differences.")}},
       .effect = Effect::reads,
       .run = dynamics_derivatives});
  all.push_back(
      {.name = "robot.regressor",
       .classic = "",
       .summary = "Computes the regressor: the matrix that gives the torques when multiplied by "
                  "masses and inertias.",
       .details = "tau = Y pi for gravity, inertial and velocity terms without motors: fitted to "
                  "measured torques, it identifies a robot. Ten parameters per joint: m, m x, m y, "
                  "m z, then Ixx, Iyy, Izz, Ixy, Iyz, Ixz about the joint frame's origin. With "
                  "closed loops tau is that of the motors.",
       .example = with_arm(
           "local y = arm:regressor{q = \"ready\"}\nlocal tau = arm:gravity_torques{q = "
           "\"ready\"}\nlocal sum = 0\nfor k = 1, #y.parameters do sum = sum + y.matrix[2][k] * "
           "y.parameters[k] end\nassert(math.abs(sum - tau[2]) < 1e-10)"),
       .params = {self("robot"), q, qd, qdd, gravity, provider, base_a, base_w, base_wd, close,
                  tree},
       .returns = {"map",
                   "",
                   "",
                   {field("matrix", "matrix", "", "Velocities x 10 parameters per joint."),
                    field("parameters", "real[]", "",
                          "The robot's own parameters, as in its model.")}},
       .effect = Effect::reads,
       .run = regressor});
  all.push_back(
      {.name = "robot.constraint_forces",
       .classic = "",
       .summary = "Computes the forces that keep closed loops together, and the accelerations.",
       .details =
           "By Lagrange multipliers. The force and moment of a loop act on its frame b, in the "
           "axes of frame a; if only one rotation is fixed, the moment is the component along that "
           "rotation. Redundant loops share their forces. With qdd instead of tau the motors' "
           "torques for that motion are computed first (robot.inverse_dynamics).",
       .example = with_linkage(
           "local c = bar:constraint_forces{q = \"home\", gravity = {0, -9.81, 0}, close = "
           "true}\nassert(#c.loops == 1 and math.abs(c.loops[1].gap[1]) < 1e-9)"),
       .params = {self("robot"), q, qd, tau, qdd_of_motion, gravity, force, moment, provider, terms,
                  tip, base_a, base_w, base_wd, close, tip_axes},
       .returns = {"map",
                   "",
                   "",
                   {field("loops", "list", "",
                          "One table per loop: name, force [N], moment [N m], and its errors gap "
                          "[m] and turn [rad]."),
                    field("q", "real[]", "rad or m",
                          "The joint values; with close those of the closed loops."),
                    field("qdd", "real[]", "rad/s^2 or m/s^2", "The accelerations."),
                    field("tau", "real[]", "N m or N", "The torques, as given or for qdd."),
                    field("provider", "string", "", "The solver.")}},
       .effect = Effect::reads,
       .run = constraint_forces});
  return all;
}

}  // namespace robomosp::ioci
