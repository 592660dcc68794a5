// SPDX-License-Identifier: Apache-2.0
#include "sim/tip_load.h"

#include <algorithm>
#include <cmath>

#include "kernel/text.h"
#include "motion/provider_params.h"
#include "robotics/kinematics.h"
#include "sim/put_column.h"
#include "spatial/pose.h"

namespace robomosp::sim {

using recording::Column;
using recording::Recording;

namespace {

constexpr double kMostForce = 1e12;  ///< [N or N m]

const char* load_unit(std::size_t k) { return k < 3 ? "N" : "N m"; }

Result<double> checked_force(double value, const std::string& where) {
  if (std::isfinite(value) && std::fabs(value) <= kMostForce) return value;
  return error(ErrorCode::invalid_argument,
               text::print_rounded(value) + " is not a usable force or moment",
               "Give numbers from -1e12 to 1e12.", where);
}

/// Nodes and weights of the Gauss-Legendre quadrature of five points on [0, 1] (Abramowitz and
/// Stegun 1964, table 25.4).
constexpr std::array<std::array<double, 2>, 5> kGaussLegendre{
    {{0.5, 0.28444444444444444},
     {0.23076534494715845, 0.23931433524968324},
     {0.76923465505284155, 0.23931433524968324},
     {0.046910077030668004, 0.11846344252809454},
     {0.95308992296933200, 0.11846344252809454}}};

/// Length of the cubic from p0 with velocity v0 to p1 with v1 in time h.
double hermite_length(const Vec3& p0, const Vec3& v0, const Vec3& p1, const Vec3& v1, double h) {
  double sum = 0;
  for (const auto& [x, weight] : kGaussLegendre) {
    double square = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double d = 6 * x * (1 - x) * (p1[k] - p0[k]) +
                       h * ((1 - x) * (1 - 3 * x) * v0[k] + x * (3 * x - 2) * v1[k]);
      square += d * d;
    }
    sum += weight * std::sqrt(square);
  }
  return sum;
}

std::string wrench_doc(std::size_t k, std::string_view tip) {
  return std::string(k < 3 ? "force" : "moment") + " on the robot at " + text::quote(tip) +
         ", world's axes";
}

}  // namespace

Result<std::vector<double>> load_column(const Recording& r, const std::string& name,
                                        const char* si_unit, const std::string& where) {
  const Column* const c = r.find(name);
  if (!c) {
    std::vector<std::string> known;
    for (const Column& one : r.columns) known.push_back(one.name);
    std::string hint = text::did_you_mean(name, known);
    if (hint.empty()) hint = "recording.columns lists those it has.";
    return error(ErrorCode::unknown_name, "the recording has no column " + text::quote(name), hint,
                 where);
  }
  std::vector<double> out = c->values;
  if (!c->unit.empty()) {
    RMP_TRY_ASSIGN(const units::Unit unit, units::parse(c->unit));
    RMP_TRY_ASSIGN(const units::Unit wanted, units::parse(si_unit));
    if (!same_kind(unit.dimension, wanted.dimension))
      return error(
          ErrorCode::invalid_argument,
          "column " + text::quote(name) + " is in " + c->unit + ", and " + si_unit + " is needed",
          "Name another column: tip_columns.", where);
    if (unit.factor != 1)
      for (double& v : out) v = units::to_si(v, unit);
  }
  for (std::size_t i = 0; i < out.size(); ++i)
    if (!std::isfinite(out[i]))
      return error(ErrorCode::invalid_argument,
                   "column " + text::quote(name) + " has no number in row " + std::to_string(i + 1),
                   "Leave rows out with recording.part.", where);
  return out;
}

Result<std::shared_ptr<const TipForce>> bind_tip_force(const Registry& registry,
                                                       const model::ProviderChoice& choice) {
  RMP_TRY_ASSIGN(const ProviderInfo info, registry.find(TipForce::kInterfaceId, choice.name));
  RMP_TRY_ASSIGN(const auto force, registry.create<TipForce>(info.name));
  RMP_TRY_ASSIGN(const auto params,
                 motion::checked_params(info, choice, "provider " + text::quote(info.name)));
  RMP_TRY(guarded(info.name, [&] { return force->prepare(*params); }));
  return std::shared_ptr<const TipForce>(force);
}

bool TipLoad::is_given() const {
  return recorded || force ||
         std::any_of(constant.begin(), constant.end(), [](double v) { return v != 0; }) ||
         std::any_of(expressions.begin(), expressions.end(),
                     [](const std::string& e) { return !e.empty(); });
}

Result<BoundTipLoad> BoundTipLoad::create(const TipLoad& load, const RobotModel& model) {
  BoundTipLoad out;
  out.load_ = load;
  if (!load.tip.empty()) {
    std::vector<std::string> known;
    for (const TipModel& t : model.tips) known.push_back(t.name);
    const auto it = std::find(known.begin(), known.end(), load.tip);
    if (it == known.end()) {
      std::string hint = text::did_you_mean(load.tip, known);
      if (hint.empty()) hint = "It has " + text::enumerate(known) + ".";
      return error(ErrorCode::unknown_name,
                   "robot " + text::quote(model.name) + " has no tip " + text::quote(load.tip),
                   hint, "tip");
    }
    out.tip_ = static_cast<std::int32_t>(it - known.begin());
  } else if (load.recorded && load.columns.empty()) {
    out.tip_ = tip_of_wrench(*load.recorded, model).value_or(0);
  }
  for (std::size_t k = 0; k < 6; ++k) {
    RMP_TRY(checked_force(load.constant[k], kLoadNumbers[k]));
    if (load.expressions[k].empty()) continue;
    auto compiled = Expression::compile(load.expressions[k]);
    if (!compiled.ok()) return std::move(compiled).error().in(kLoadNumbers[k]);
    for (const Expression::Name& n : compiled->names()) {
      const bool is_known = n.scope.empty() && (n.name == "time" || n.name == "path");
      if (!is_known)
        return error(ErrorCode::unknown_name, "there is no " + Expression::spell(n) + " here",
                     "Forces are expressions of `time` [s] and `path` [m], such as "
                     "-20 N * sin(2 rad/s * time) or 5 N + 10 N/m * path.",
                     kLoadNumbers[k]);
      (n.name == "time" ? out.uses_time_ : out.uses_path_) = true;
    }
    out.expressions_[k] = std::move(compiled).value();
  }
  if (load.recorded) RMP_TRY(out.read_columns());
  if (load.force) out.uses_time_ = true;
  return out;
}

Result<void> BoundTipLoad::read_columns() {
  const recording::Recording& r = *load_.recorded;
  std::vector<std::string> names = load_.columns;
  if (names.empty()) {
    const bool is_numbered = r.find("wrench1") != nullptr || r.find("fx") == nullptr;
    for (std::size_t k = 0; k < 6; ++k)
      names.push_back(is_numbered
                          ? "wrench" + std::to_string(k + 1)
                          : std::string(1, k < 3 ? 'f' : 'm') + std::string(1, "xyz"[k % 3]));
  }
  if (names.size() != 3 && names.size() != 6)
    return error(ErrorCode::invalid_argument, std::to_string(names.size()) + " columns are named",
                 "Name three of a force, or six of a force and a moment.", "tip_columns");
  const char* const key = load_.is_over_path ? "path" : "time";
  RMP_TRY_ASSIGN(rows_.times, load_column(r, key, load_.is_over_path ? "m" : "s", "tip_wrench"));
  if (rows_.times.empty())
    return error(ErrorCode::invalid_argument, "the recording has no rows",
                 "Give another recording.", "tip_wrench");
  if (!std::is_sorted(rows_.times.begin(), rows_.times.end()))
    return error(ErrorCode::invalid_argument,
                 "its column " + text::quote(key) + " decreases from one row to the next",
                 "Give a recording in which it increases.", "tip_wrench");
  rows_.width = 6;
  rows_.values.assign(6 * rows_.times.size(), 0.0);
  for (std::size_t k = 0; k < names.size(); ++k) {
    RMP_TRY_ASSIGN(const auto values, load_column(r, names[k], load_unit(k), "tip_wrench"));
    for (std::size_t i = 0; i < values.size(); ++i) {
      RMP_TRY_ASSIGN(rows_.values[6 * i + k], checked_force(values[i], "tip_wrench"));
    }
  }
  (load_.is_over_path ? uses_path_ : uses_time_) = true;
  return {};
}

Result<TipWrench> BoundTipLoad::at(double time, double path) const {
  std::array<double, 6> w{};
  if (!rows_.times.empty()) rows_.at(load_.is_over_path ? path : time, w);
  for (std::size_t k = 0; k < 6; ++k) {
    w[k] += load_.constant[k];
    if (!expressions_[k]) continue;
    const auto lookup = [&](const Expression::Name& n) -> Result<Quantity> {
      return n.name == "time" ? Quantity{time, {0, 0, 1, 0}} : Quantity{path, {1, 0, 0, 0}};
    };
    auto value = expressions_[k]->evaluate(lookup, load_unit(k));
    if (!value.ok())
      return std::move(value)
          .error()
          .in(kLoadNumbers[k])
          .in("t = " + text::print_rounded(time) + " s");
    RMP_TRY_ASSIGN(const double fits, checked_force(*value, kLoadNumbers[k]));
    w[k] += fits;
  }
  if (load_.force) {
    auto given = load_.force->at(time, path);
    if (!given.ok())
      return std::move(given).error().in("tip_force").in("t = " + text::print_rounded(time) + " s");
    for (std::size_t k = 0; k < 6; ++k) {
      RMP_TRY_ASSIGN(
          const double fits,
          checked_force(k < 3 ? given->force[k] : given->moment[k - 3], kLoadNumbers[k]));
      w[k] += fits;
    }
  }
  return TipWrench{{w[0], w[1], w[2]}, {w[3], w[4], w[5]}};
}

TipWrench BoundTipLoad::in_base(const TipWrench& given, const Pose& world_T_base,
                                const Pose& mounting_T_base, const Pose& base_T_tip) const {
  using namespace spatial;
  switch (load_.axes) {
    case LoadAxes::world:
      return {rotate_back(world_T_base, given.force), rotate_back(world_T_base, given.moment)};
    case LoadAxes::base:
      return {rotate_back(mounting_T_base, given.force),
              rotate_back(mounting_T_base, given.moment)};
    case LoadAxes::tool: break;
  }
  return {rotate(base_T_tip, given.force), rotate(base_T_tip, given.moment)};
}

std::optional<std::string> BoundTipLoad::note_on_cover(double from, double to) const {
  if (rows_.times.empty()) return std::nullopt;
  const double first = rows_.times.front(), last = rows_.times.back(),
               near = 1e-9 * std::max({1.0, std::fabs(from), std::fabs(to)});
  if (from >= first - near && to <= last + near) return std::nullopt;
  const std::string unit = load_.is_over_path ? " m" : " s";
  return "tip_wrench has rows from " + text::print_rounded(first) + " to " +
         text::print_rounded(last) + unit + ", but the run goes from " + text::print_rounded(from) +
         " to " + text::print_rounded(to) + unit + ": outside its rows the nearest row applies.";
}

TipWay tip_way(const RobotModel& model, std::int32_t tip, std::span<const double> times,
               std::span<const double> q, std::span<const double> qd,
               std::span<const PathSample> base, std::span<const double> approach) {
  const std::size_t n = model.dof(), c = model.coordinate_count(),
                    at = static_cast<std::size_t>(tip);
  TipWay out;
  out.base_T_tip.reserve(times.size());
  out.length.reserve(times.size());
  std::vector<Pose> frames(model.joints.size());
  std::vector<double> jacobian(6 * n);
  Vec3 p_before{}, v_before{};
  for (std::size_t i = 0; i < times.size(); ++i) {
    robotics::forward_kinematics(model, q.subspan(i * c, c), frames);
    out.base_T_tip.push_back(robotics::tip_pose(model, at, frames));
    robotics::geometric_jacobian(model, at, frames, robotics::JacobianFrame::base, jacobian);
    Vec3 seen{};
    for (std::size_t j = 0; j < n; ++j)
      for (std::size_t k = 0; k < 3; ++k) seen[k] += jacobian[6 * j + k] * qd[i * n + j];
    const PathSample& b = base[base.size() == 1 ? 0 : i];
    const Vec3 arm = spatial::rotate(b.pose, out.base_T_tip.back().p),
               p = spatial::add(b.pose.p, arm);
    const Vec3 v = spatial::add(spatial::rotate(b.pose, seen),
                                spatial::add(b.velocity, spatial::cross(b.angular_velocity, arm)));
    const double before = out.length.empty() ? 0 : out.length.back();
    // An interval belongs to the approach where the row at its end does.
    const bool counts = i > 0 && (approach.empty() || approach[i] == 0);
    out.length.push_back(
        before +
        (counts ? hermite_length(p_before, v_before, p, v, times[i] - times[i - 1]) : 0.0));
    p_before = p, v_before = v;
  }
  return out;
}

std::array<Column, 6> wrench_columns(std::string_view tip) {
  std::array<Column, 6> out;
  for (std::size_t k = 0; k < 6; ++k)
    out[k] = {"wrench" + std::to_string(k + 1), load_unit(k), wrench_doc(k, tip), {}};
  return out;
}

std::optional<std::int32_t> tip_of_wrench(const Recording& r, const RobotModel& model) {
  const Column* const first = r.find("wrench1");
  for (std::size_t t = 0; first && t < model.tips.size(); ++t)
    if (first->doc == wrench_doc(0, model.tips[t].name)) return static_cast<std::int32_t>(t);
  return std::nullopt;
}

Result<ActingLoad> add_load_columns(Recording& out, const TipLoad& given, const RobotModel& model,
                                    const LoadedRows& rows) {
  RMP_TRY_ASSIGN(const BoundTipLoad load, BoundTipLoad::create(given, model));
  ActingLoad acting;
  acting.tip = load.tip();
  if (rows.times.empty()) return acting;
  const TipWay way =
      tip_way(model, load.tip(), rows.times, rows.q, rows.qd, rows.base, rows.approach);
  const std::string& tip = model.tips[static_cast<std::size_t>(load.tip())].name;
  std::array<Column, 6> columns = wrench_columns(tip);
  for (std::size_t i = 0; i < rows.times.size(); ++i) {
    RMP_TRY_ASSIGN(const TipWrench now, load.at(rows.times[i], way.length[i]));
    const Pose& world_T_base = rows.base[rows.base.size() == 1 ? 0 : i].pose;
    acting.in_base.push_back(load.in_base(now, world_T_base, model.base, way.base_T_tip[i]));
    const Vec3 force = spatial::rotate(world_T_base, acting.in_base.back().force),
               moment = spatial::rotate(world_T_base, acting.in_base.back().moment);
    for (std::size_t k = 0; k < 3; ++k) {
      columns[k].values.push_back(force[k]);
      columns[3 + k].values.push_back(moment[k]);
    }
  }
  for (Column& c : columns) put_column(out, std::move(c));
  put_column(
      out, {"path", "m", "distance of " + text::quote(tip) + " along the trajectory", way.length});
  const auto note = given.is_over_path ? load.note_on_cover(0, way.length.back())
                                       : load.note_on_cover(rows.times.front(), rows.times.back());
  if (note) out.notes.push_back(*note);
  return acting;
}

}  // namespace robomosp::sim
