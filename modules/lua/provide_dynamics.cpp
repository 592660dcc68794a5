// SPDX-License-Identifier: Apache-2.0
// Inverse and forward dynamics written in Lua (layer: application, lua).
#include <algorithm>

#include <robomosp/sdk/dynamics.h>

#include "lua/provide.h"
#include "robotics/kinematics.h"

namespace robomosp::lua {
namespace {

double friction(const JointModel& j, double qd) {
  return j.friction.viscous * qd + (qd > 0   ? j.friction.coulomb_positive
                                    : qd < 0 ? j.friction.coulomb_negative
                                             : 0.0);
}

bool pushes(std::span<const TipWrench> tip) {
  return std::any_of(tip.begin(), tip.end(),
                     [](const TipWrench& w) { return w.force != Vec3{} || w.moment != Vec3{}; });
}

/// J^T w of sample i at the tip it acts at.
std::vector<double> wrench_torques(const RobotModel& model, const DynamicsBatch& b, std::size_t i,
                                   std::span<const double> q) {
  const std::size_t dof = model.dof();
  std::vector<Pose> frames(dof);
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

/// Adds `sign` times what the joints' friction and springs and the wrench at the tip take of tau.
void add_joint_side(const RobotModel& model, const DynamicsBatch& b, std::size_t i, double sign,
                    std::span<const double> q, std::span<const double> qd,
                    std::vector<double>& tau) {
  for (std::size_t j = 0; j < tau.size(); ++j) {
    const JointModel& joint = model.joints[j];
    if (b.terms & kFrictionTerm) tau[j] += sign * friction(joint, qd[j]);
    if (b.terms & kSpringTerm) tau[j] += sign * joint.spring.stiffness * (q[j] - joint.spring.rest);
  }
  if (!(b.terms & kExternalTerm) || !pushes(b.tip)) return;
  const auto w = wrench_torques(model, b, i, q);
  for (std::size_t j = 0; j < tau.size(); ++j) tau[j] -= sign * w[j];
}

/// What a script's function cannot be told.
Result<void> check_batch(const RobotModel& model, const DynamicsBatch& b) {
  if (!b.base.empty())
    return error(ErrorCode::unsupported, "a solver written in Lua knows no moving base",
                 "Choose another provider, such as newton_euler.");
  if (b.tip_index < 0 || static_cast<std::size_t>(b.tip_index) >= model.tips.size())
    return error(ErrorCode::invalid_argument,
                 "there is no tip " + std::to_string(b.tip_index) + " for the wrench to act at",
                 "Choose one of the " + std::to_string(model.tips.size()) + " tips.");
  return {};
}

std::span<const double> sample(std::span<const double> all, std::size_t i, std::size_t dof,
                               const std::vector<double>& zero) {
  return all.empty() ? std::span<const double>(zero) : all.subspan(i * dof, dof);
}

/// A script's function of (model, a, b, c), called many times with the same model.
class DynamicsScript {
 public:
  DynamicsScript(const LuaProvider& p, const RobotModel& model) : p_(p), model_(model) {}

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
        RMP_TRY(call(impl, L, 5, 1));
        return read_finite(p_, L, -1, model_.dof(), "the result");
      };
      return body(evaluate);
    });
  }

 private:
  const LuaProvider& p_;
  const RobotModel& model_;
};

/// fn(model, q, qd, qdd) -> tau of gravity, inertia (armature included) and velocity; friction,
/// springs and the wrench at the tip are added here.
class LuaInverseDynamics final : public InverseDynamics, private BoundScript {
 public:
  explicit LuaInverseDynamics(ProviderPtr p) : BoundScript(std::move(p)) {}
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
            const auto q = b.q.subspan(i * dof, dof), qd = sample(b.qd, i, dof, zero),
                       qdd = sample(b.qdd, i, dof, zero);
            RMP_TRY_ASSIGN(auto sum, rigid_body(f, b.terms, q, qd, qdd, zero));
            add_joint_side(*model_, b, i, 1, q, qd, sum);
            std::copy(sum.begin(), sum.end(), tau.begin() + static_cast<std::ptrdiff_t>(i * dof));
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
            const auto q = b.q.subspan(i * dof, dof);
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
/// tau it is given, and a model without gravity stands for the gravity term left out.
class LuaForwardDynamics final : public ForwardDynamics, private BoundScript {
 public:
  explicit LuaForwardDynamics(ProviderPtr p) : BoundScript(std::move(p)) {}
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    return bind(model, params);
  }
  [[nodiscard]] std::size_t scratch_size() const override { return 0; }

  Result<void> accelerations(const DynamicsBatch& b, std::span<double> qdd,
                             Progress& progress) const override {
    RMP_TRY(check_batch(*model_, b));
    const std::size_t dof = model_->dof();
    const std::vector<double> zero(dof, 0.0);
    return DynamicsScript(*p_, *model_)
        .run("accelerations", (b.terms & kGravityTerm) != 0, params_.get(),
             [&](const auto& f) -> Result<void> {
               for (std::size_t i = 0; i < b.count; ++i) {
                 if (progress.cancelled())
                   return error(ErrorCode::cancelled, "forward dynamics was cancelled");
                 const auto q = b.q.subspan(i * dof, dof), qd = sample(b.qd, i, dof, zero),
                            given = sample(b.tau, i, dof, zero);
                 std::vector<double> tau(given.begin(), given.end());
                 add_joint_side(*model_, b, i, -1, q, qd, tau);
                 RMP_TRY_ASSIGN(
                     const auto out,
                     f(q, (b.terms & kVelocityTerm) ? qd : std::span<const double>(zero), tau));
                 std::copy(out.begin(), out.end(),
                           qdd.begin() + static_cast<std::ptrdiff_t>(i * dof));
               }
               return {};
             });
  }
};

}  // namespace

void* make_lua_inverse_dynamics(ProviderPtr p) {
  return static_cast<InverseDynamics*>(new LuaInverseDynamics(std::move(p)));
}
void* make_lua_forward_dynamics(ProviderPtr p) {
  return static_cast<ForwardDynamics*>(new LuaForwardDynamics(std::move(p)));
}

}  // namespace robomosp::lua
