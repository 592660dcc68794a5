// SPDX-License-Identifier: Apache-2.0
// Expressions of steps over time, signals and the places of members, and when they turn true.
#include <algorithm>
#include <array>
#include <cmath>

#include "kernel/text.h"
#include "robotics/kinematics.h"
#include "spatial/pose.h"
#include "task/members.h"
#include "task/task_executor.h"

namespace robomosp::task {
namespace {

constexpr std::size_t kAskEvery = 1024;  ///< looks between two questions whether to go on

std::string as_number(const std::string& condition) { return "if(" + condition + ", 1, 0)"; }

Result<Quantity> quantity(double value, std::string_view unit) {
  RMP_TRY_ASSIGN(const auto own, units::parse(unit));
  return Quantity{value, own.dimension};
}

bool is_time(const Expression::Name& name) { return name.scope.empty() && name.name == "time"; }

}  // namespace

Result<const Expression*> TaskExecutor::compiled(const std::string& expression) const {
  if (const auto it = compiled_.find(expression); it != compiled_.end()) return &it->second;
  RMP_TRY_ASSIGN(Expression e, Expression::compile(expression));
  return &compiled_.emplace(expression, std::move(e)).first->second;
}

Result<Quantity> TaskExecutor::member_value(const Expression::Name& name, double t) const {
  constexpr std::string_view kAxes = "xyz";
  const std::string& field = name.name;
  const std::size_t axis = field.size() == 1 ? kAxes.find(field) : std::string_view::npos;
  if (const auto thing = thing_of_.find(name.scope); thing != thing_of_.end()) {
    if (axis != std::string_view::npos)
      return quantity(pose_of(things_[thing->second], t).p[axis], "m");
    return error(ErrorCode::unknown_name,
                 "an object has no " + text::quote(field) + " for conditions",
                 "Conditions can use its x, y and z in the world.");
  }
  RMP_TRY_ASSIGN(const std::size_t who, find_member(actor_of_, name.scope, "robot or object"));
  const Actor& a = actors_[who];
  if (axis != std::string_view::npos) {
    RMP_TRY_ASSIGN(const Grip tool, grip(a, {}));
    const Pose tip = spatial::compose(world_T_joint(a, tool.joint, t), tool.joint_T_grip);
    return quantity(tip.p[axis], "m");
  }
  const bool is_rate = field.starts_with("qd");
  const std::int64_t number =
      field.starts_with("q") ? text::read_int(field.substr(is_rate ? 2 : 1)).value_or(0) : 0;
  if (!can_move(a) || number < 1 || number > static_cast<std::int64_t>(a.start.size()))
    return error(
        ErrorCode::unknown_name,
        "robot " + text::quote(name.scope) + " has no " + text::quote(field) + " for conditions",
        "Conditions can use q1, qd1, ... of its joints, and x, y and z of its tool in the world.");
  const JointState s = sample(a, t);
  const auto j = static_cast<std::size_t>(number - 1);
  const bool turns = is_rotary(a, j);
  return is_rate ? quantity(s.qd[j], turns ? "rad/s" : "m/s")
                 : quantity(s.q[j], turns ? "rad" : "m");
}

Result<double> TaskExecutor::evaluate(const std::string& expression, std::string_view unit,
                                      double t) const {
  RMP_TRY_ASSIGN(const Expression* const e, compiled(expression));
  return e->evaluate(
      [&](const Expression::Name& name) -> Result<Quantity> {
        if (is_time(name)) return quantity(t, "s");
        if (!name.scope.empty()) return member_value(name, t);
        RMP_TRY_ASSIGN(const std::size_t at, find_member(wire_of_, name.name, "signal"));
        return quantity(wires_[at].history.back().second, wires_[at].signal->unit);
      },
      unit);
}

Result<bool> TaskExecutor::is_true(const std::string& condition, double t) const {
  RMP_TRY_ASSIGN(const double v, evaluate(as_number(condition), "", t));
  return v != 0;
}

Result<TaskExecutor::Watched> TaskExecutor::watched(const std::string& condition) const {
  RMP_TRY_ASSIGN(const Expression* const e, compiled(as_number(condition)));
  Watched out;
  for (const Expression::Name& name : e->names()) {
    out.time = out.time || is_time(name);
    out.motion = out.motion || !name.scope.empty();
  }
  return out;
}

Result<std::optional<double>> TaskExecutor::first_true(const std::string& condition, double from,
                                                       double to, Progress& progress) const {
  double before = from;
  for (std::size_t looks = 1; before < to; ++looks) {
    if (looks % kAskEvery == 0 && progress.cancelled())
      return error(ErrorCode::cancelled, "the run was cancelled");
    double at = std::min(to, step_ * (std::floor(before / step_ * (1 + 1e-12)) + 1));
    if (!(at > before)) at = to;
    RMP_TRY_ASSIGN(const bool is_met, is_true(condition, at));
    if (is_met) {
      for (;;) {
        const double middle = before + (at - before) / 2;
        if (!(middle > before && middle < at)) return std::optional(at);
        RMP_TRY_ASSIGN(const bool is_met_there, is_true(condition, middle));
        (is_met_there ? at : before) = middle;
      }
    }
    before = at;
  }
  return std::optional<double>{};
}

}  // namespace robomosp::task
