// SPDX-License-Identifier: Apache-2.0
// Inverse and forward dynamics written in Lua (layer: application, lua).
#include <algorithm>

#include <robomosp/sdk/dynamics.h>

#include "kernel/text.h"
#include "lua/provide.h"
#include "robotics/closure.h"
#include "robotics/kinematics.h"
#include "spatial/body_tree.h"

namespace robomosp::lua {
namespace {

bool pushes(std::span<const TipWrench> tip) {
  return std::any_of(tip.begin(), tip.end(),
                     [](const TipWrench& w) { return w.force != Vec3{} || w.moment != Vec3{}; });
}

/// J^T w of sample i at the tip it acts at.
std::vector<double> wrench_torques(const RobotModel& model, const DynamicsBatch& b, std::size_t i,
                                   std::span<const double> q) {
  const std::size_t dof = model.dof();
  std::vector<Pose> frames(model.joints.size());
  std::vector<double> jacobian(6 * dof), out(dof, 0.0);
  robotics::forward_kinematics(model, q, frames);
  robotics::geometric_jacobian(model, static_cast<std::size_t>(b.tip_index), frames,
                               robotics::JacobianFrame::base, jacobian);
  const TipWrench& w = b.tip.size() == 1 ? b.tip[0] : b.tip[i];
  for (std::size_t j = 0; j < dof; ++j)
    for (std::size_t k = 0; k < 3; ++k)
      out[j] += jacobian[6 * j + k] * w.force[k] + jacobian[6 * j + 3 + k] * w.moment[k];
  return out;
}

/// What the joints' friction and springs and the wrench at the tip take of tau.
std::vector<double> joint_side(const RobotModel& model, const spatial::BodyTree& tree,
                               const DynamicsBatch& b, std::size_t i) {
  std::vector<double> tau(model.dof(), 0.0);
  spatial::add_joint_forces(tree, b, i, b.terms & (kFrictionTerm | kSpringTerm), tau);
  if (!(b.terms & kExternalTerm) || !pushes(b.tip)) return tau;
  const std::size_t n = model.coordinate_count();
  const auto w = wrench_torques(model, b, i, b.q.subspan(i * n, n));
  for (std::size_t j = 0; j < tau.size(); ++j) tau[j] -= w[j];
  return tau;
}

/// What a script's function cannot be given.
Result<void> check_batch(const RobotModel& model, const DynamicsBatch& b) {
  if (!b.base.empty())
    return error(ErrorCode::unsupported, "a solver written in Lua does not support a moving base",
                 "Choose another provider, such as newton_euler.");
  if (b.tip_index < 0 || static_cast<std::size_t>(b.tip_index) >= model.tips.size())
    return error(ErrorCode::invalid_argument,
                 "there is no tip " + std::to_string(b.tip_index) + " for the wrench to act at",
                 "Choose one of the " + std::to_string(model.tips.size()) + " tips.");
  return {};
}

/// Velocities, accelerations or torques of sample i, `zero` (one of dof) where none are given.
std::span<const double> sample(std::span<const double> all, std::size_t i,
                               const std::vector<double>& zero) {
  return all.empty() ? std::span<const double>(zero) : all.subspan(i * zero.size(), zero.size());
}

/// What the adapters of dynamics keep besides.
class BoundDynamics : protected BoundScript {
 protected:
  using BoundScript::BoundScript;
  Result<void> bind(const RobotModel& model, const Params& params) {
    RMP_TRY(BoundScript::bind(model, params));
    RMP_TRY_ASSIGN(tree_, spatial::make_body_tree(model));
    return {};
  }
  [[nodiscard]] std::span<const double> configuration(const DynamicsBatch& b, std::size_t i) const {
    const std::size_t n = model_->coordinate_count();
    return b.q.subspan(i * n, n);
  }
  spatial::BodyTree tree_;
};

/// A script's function of (model, a, b, c), called many times with the same model. Its result has
/// dof numbers; with `forces` > 0 as many of its second result follow.
class DynamicsScript {
 public:
  DynamicsScript(const LuaProvider& p, const RobotModel& model, std::size_t forces = 0)
      : p_(p), model_(model), forces_(forces) {}

  template <class Body>
  Result<void> run(const char* function, bool with_gravity, const Params& params, Body&& body) {
    Call call_script(p_);
    return call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      push_model(impl, L, model_, with_gravity);
      const int model = lua_gettop(L);
      push_params(impl, L, p_.schema, params);
      const int values = lua_gettop(L);
      const auto evaluate = [&](std::span<const double> a, std::span<const double> b,
                                std::span<const double> c) -> Result<std::vector<double>> {
        lua_settop(L, values);
        call_script.push_function(L, function);
        lua_pushvalue(L, model);
        push_vector(impl, L, a);
        push_vector(impl, L, b);
        push_vector(impl, L, c);
        lua_pushvalue(L, values);
        RMP_TRY(call(impl, L, 5, 2));
        RMP_TRY_ASSIGN(auto out, read_finite(p_, L, -2, model_.dof(), "the result"));
        if (forces_ == 0) return out;
        if (lua_isnil(L, -1))
          return error(ErrorCode::unsupported,
                       "provider " + text::quote(p_.name) +
                           " does not return the forces that keep loops closed",
                       "Return them as its second result, or choose another provider.");
        RMP_TRY_ASSIGN(const auto forces,
                       read_finite(p_, L, -1, forces_, "the second result (forces of loops)"));
        out.insert(out.end(), forces.begin(), forces.end());
        return out;
      };
      return body(evaluate);
    });
  }

 private:
  const LuaProvider& p_;
  const RobotModel& model_;
  std::size_t forces_;
};

/// fn(model, q, qd, qdd) -> tau of gravity, inertia (armature included) and velocity; friction,
/// springs and the wrench at the tip are added here.
class LuaInverseDynamics final : public InverseDynamics, private BoundDynamics {
 public:
  explicit LuaInverseDynamics(ProviderPtr p) : BoundDynamics(std::move(p)) {}
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    return bind(model, params);
  }
  [[nodiscard]] std::size_t scratch_size() const override { return 0; }

  Result<void> torques(const DynamicsBatch& b, std::span<double> tau,
                       Progress& progress) const override {
    RMP_TRY(check_batch(*model_, b));
    const std::size_t dof = model_->dof();
    const std::vector<double> zero(dof, 0.0);
    return DynamicsScript(*p_, *model_)
        .run("torques", true, params_.get(), [&](const auto& f) -> Result<void> {
          for (std::size_t i = 0; i < b.count; ++i) {
            if (progress.cancelled())
              return error(ErrorCode::cancelled, "inverse dynamics was cancelled");
            RMP_TRY_ASSIGN(const auto sum,
                           rigid_body(f, b.terms, configuration(b, i), sample(b.qd, i, zero),
                                      sample(b.qdd, i, zero), zero));
            const auto side = joint_side(*model_, tree_, b, i);
            for (std::size_t j = 0; j < dof; ++j) tau[i * dof + j] = sum[j] + side[j];
          }
          return {};
        });
  }

  /// Column j is the torque of unit acceleration of joint j above the torque at rest.
  Result<void> inertia(const DynamicsBatch& b, std::span<double> m,
                       Progress& progress) const override {
    const std::size_t dof = model_->dof();
    const std::vector<double> zero(dof, 0.0);
    return DynamicsScript(*p_, *model_)
        .run("torques", true, params_.get(), [&](const auto& f) -> Result<void> {
          for (std::size_t i = 0; i < b.count; ++i) {
            if (progress.cancelled())
              return error(ErrorCode::cancelled, "the inertia matrix was cancelled");
            const auto q = configuration(b, i);
            const auto out = m.subspan(i * dof * dof, dof * dof);
            RMP_TRY_ASSIGN(const auto rest, f(q, zero, zero));
            for (std::size_t j = 0; j < dof; ++j) {
              std::vector<double> unit(dof, 0.0);
              unit[j] = 1;
              RMP_TRY_ASSIGN(const auto column, f(q, zero, unit));
              for (std::size_t k = 0; k < dof; ++k) out[k * dof + j] = column[k] - rest[k];
            }
            for (std::size_t j = 0; j < dof; ++j)
              for (std::size_t k = 0; k < j; ++k)
                out[j * dof + k] = out[k * dof + j] = (out[j * dof + k] + out[k * dof + j]) / 2;
          }
          return {};
        });
  }

 private:
  /// The terms are told apart by differences, so that the script needs one function only.
  template <class F>
  static Result<std::vector<double>> rigid_body(const F& f, std::uint32_t terms,
                                                std::span<const double> q,
                                                std::span<const double> qd,
                                                std::span<const double> qdd,
                                                const std::vector<double>& zero) {
    constexpr std::uint32_t kAll = kGravityTerm | kInertialTerm | kVelocityTerm;
    if ((terms & kAll) == 0) return zero;
    const bool inertial = terms & kInertialTerm, velocity = terms & kVelocityTerm,
               gravity = terms & kGravityTerm;
    RMP_TRY_ASSIGN(auto sum, f(q, velocity ? qd : std::span<const double>(zero),
                               inertial ? qdd : std::span<const double>(zero)));
    if (gravity) return sum;
    RMP_TRY_ASSIGN(const auto rest, f(q, zero, zero));
    for (std::size_t j = 0; j < sum.size(); ++j) sum[j] -= rest[j];
    return sum;
  }
};

/// fn(model, q, qd, tau) -> qdd without friction; friction, springs and the tip's wrench change the
/// tau it is given, and a model without gravity stands for the gravity term left out. Robots with
/// loops go to providers with the tag "loops" only: whether qdd meets them is not seen from it.
/// Such a one may return the forces that keep the loops closed as a second result.
class LuaForwardDynamics final : public ForwardDynamics, private BoundDynamics {
 public:
  explicit LuaForwardDynamics(ProviderPtr p) : BoundDynamics(std::move(p)) {}
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    if (!model.loops.empty() && !p_->has_tag("loops"))
      return error(ErrorCode::unsupported,
                   "provider " + text::quote(p_->name) +
                       " does not declare that its accelerations keep loops closed",
                   "If they do, write tags = {\"loops\"}; else choose another provider, such as "
                   "constrained.",
                   "robot " + text::quote(model.name));
    return bind(model, params);
  }
  [[nodiscard]] std::size_t scratch_size() const override { return 0; }

  Result<void> accelerations(const DynamicsBatch& b, std::span<double> qdd,
                             Progress& progress) const override {
    return run(b, qdd, {}, progress);
  }
  Result<void> constrained(const DynamicsBatch& b, std::span<double> qdd, std::span<double> forces,
                           Progress& progress) const override {
    if (model_->loops.empty()) return ForwardDynamics::constrained(b, qdd, forces, progress);
    return run(b, qdd, forces, progress);
  }

 private:
  Result<void> run(const DynamicsBatch& b, std::span<double> qdd, std::span<double> forces,
                   Progress& progress) const {
    RMP_TRY(check_batch(*model_, b));
    const std::size_t dof = model_->dof(), rows = robotics::loop_rows(*model_);
    const std::vector<double> zero(dof, 0.0);
    return DynamicsScript(*p_, *model_, forces.empty() ? 0 : rows)
        .run("accelerations", (b.terms & kGravityTerm) != 0, params_.get(),
             [&](const auto& f) -> Result<void> {
               for (std::size_t i = 0; i < b.count; ++i) {
                 if (progress.cancelled())
                   return error(ErrorCode::cancelled, "forward dynamics was cancelled");
                 const auto given = sample(b.tau, i, zero);
                 std::vector<double> tau(given.begin(), given.end());
                 const auto side = joint_side(*model_, tree_, b, i);
                 for (std::size_t j = 0; j < dof; ++j) tau[j] -= side[j];
                 RMP_TRY_ASSIGN(
                     const auto out,
                     f(configuration(b, i),
                       (b.terms & kVelocityTerm) ? sample(b.qd, i, zero) : std::span(zero), tau));
                 std::copy_n(out.begin(), dof, &qdd[i * dof]);
                 if (!forces.empty())
                   std::copy_n(out.begin() + static_cast<std::ptrdiff_t>(dof), rows,
                               &forces[i * rows]);
               }
               return {};
             });
  }
};

}  // namespace

RMP_LUA_PROVIDER(InverseDynamics, LuaInverseDynamics, "torques");
RMP_LUA_PROVIDER(ForwardDynamics, LuaForwardDynamics, "accelerations");

}  // namespace robomosp::lua
