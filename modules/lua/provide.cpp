// SPDX-License-Identifier: Apache-2.0
// Solvers written in Lua: adapters from a script's functions to the SDK's interfaces. They answer
// on the application thread only; what a script returns is checked before anything uses it.
#include <algorithm>
#include <cmath>
#include <functional>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/trajectory.h>

#include "kernel/schema.h"
#include "kernel/text.h"
#include "lua/internal.h"
#include "robotics/kinematics.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::lua {
namespace {

using ProviderPtr = std::shared_ptr<LuaProvider>;

Error failed(const LuaProvider& p, std::string message, std::string hint = {}) {
  return error(ErrorCode::plugin_failed, std::move(message), std::move(hint),
               p.interface_id + " " + text::quote(p.name));
}

/// One call into the script: checks thread and life, restores the stack, tells a script's error
/// with the provider's name and the script's line.
class Call {
 public:
  explicit Call(const LuaProvider& p) : p_(p) {
    if (!p.thread->is_current()) {
      ready_ = failed(p, "the provider is written in Lua and was called from another thread",
                      "Lua runs on the application thread only; choose a compiled provider for "
                      "background work.");
      return;
    }
    if (!p.state) {
      ready_ = failed(p, "the script that provided it was closed or has withdrawn it",
                      "Run the script again or choose another provider.");
      return;
    }
    impl_ = p.state;
    L_ = impl_->current ? impl_->current : impl_->main;
    top_ = lua_gettop(L_);
    if (!lua_checkstack(L_, 40)) ready_ = failed(p, "the Lua stack is full", "Call less deep.");
  }
  ~Call() {
    if (L_) lua_settop(L_, top_);
  }
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  /// Runs `body` protected; it pushes, calls and reads results on the given thread.
  using Body = std::function<Result<void>(Impl&, lua_State*)>;
  Result<void> run(const Body& body) {
    RMP_TRY(ready_);
    Job job{&body, {}};
    lua_pushcfunction(L_, entry<run_job>);
    lua_pushlightuserdata(L_, &job);
    auto done = call(*impl_, L_, 1, 0);
    if (!done.ok()) job.failed = std::move(done).error();
    if (!job.failed) return {};
    if (job.failed->code == ErrorCode::cancelled || job.failed->code == ErrorCode::plugin_failed)
      return std::move(*job.failed);
    const std::string at = job.failed->where.empty() ? "" : job.failed->where + ": ";
    return failed(
        p_, at + job.failed->message,
        job.failed->hint.empty() ? "Correct the script that provides it." : job.failed->hint);
  }
  /// Pushes the provider's function, or the field `name` of its table.
  void push_function(lua_State* L, const char* name) const {
    lua_rawgeti(L, LUA_REGISTRYINDEX, p_.ref);
    if (!lua_istable(L, -1)) return;
    lua_getfield(L, -1, name);
    lua_remove(L, -2);
  }

 private:
  struct Job {
    const Body* body;
    std::optional<Error> failed;
  };
  static Result<int> run_job(Impl& impl, lua_State* L) {
    auto& job = *static_cast<Job*>(lua_touserdata(L, 1));
    lua_settop(L, 0);
    auto r = (*job.body)(impl, L);
    if (!r.ok()) job.failed = std::move(r).error();
    return 0;
  }

  const LuaProvider& p_;
  Impl* impl_ = nullptr;
  lua_State* L_ = nullptr;
  int top_ = 0;
  Result<void> ready_;
};

// --- what a script is given
// -----------------------------------------------------------------------

void push_vector(Impl& impl, lua_State* L, std::span<const double> v, const char* unit = "") {
  push_array(impl, L, NumericArray(std::vector<double>(v.begin(), v.end()), unit));
}

void set_number(lua_State* L, const char* name, double v) {
  lua_pushnumber(L, v);
  lua_setfield(L, -2, name);
}

/// Scripts count joints and coordinates alike.
Result<void> need_simple(const RobotModel& model) {
  if (model.is_simple() && model.loops.empty()) return {};
  return error(ErrorCode::unsupported,
               "solvers written in Lua serve robots whose joints have one coordinate each, without "
               "followers and loops",
               "Choose another provider for it.", "robot " + text::quote(model.name));
}

void push_model(Impl& impl, lua_State* L, const RobotModel& model, bool with_gravity) {
  lua_createtable(L, 0, 6);
  lua_pushstring(L, model.name.c_str());
  lua_setfield(L, -2, "name");
  lua_pushinteger(L, static_cast<lua_Integer>(model.dof()));
  lua_setfield(L, -2, "dof");
  push(impl, L, pose_value(model.base));
  lua_setfield(L, -2, "base");
  const Vec3 gravity = with_gravity ? model.gravity : Vec3{};
  push_vector(impl, L, gravity, "m/s^2");
  lua_setfield(L, -2, "gravity");
  lua_createtable(L, static_cast<int>(model.joints.size()), 0);
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const JointModel& j = model.joints[i];
    lua_createtable(L, 0, 14);
    lua_pushstring(L, j.name.c_str());
    lua_setfield(L, -2, "name");
    lua_pushstring(L, j.type == JointType::revolute ? "revolute" : "prismatic");
    lua_setfield(L, -2, "type");
    lua_pushinteger(L, j.parent + 1);  // 0 = base; Lua counts joints from 1
    lua_setfield(L, -2, "parent");
    push(impl, L, pose_value(j.placement));
    lua_setfield(L, -2, "placement");
    set_number(L, "lower", j.lower);
    set_number(L, "upper", j.upper);
    set_number(L, "max_velocity", j.max_velocity);
    set_number(L, "max_acceleration", j.max_acceleration);
    set_number(L, "max_force", j.max_force);
    set_number(L, "mass", j.body.mass);
    push_vector(impl, L, j.body.com, "m");
    lua_setfield(L, -2, "com");
    const Sym3& s = j.body.inertia;
    push_array(
        impl, L,
        NumericArray({s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz}, 3, 3, "kg m^2"));
    lua_setfield(L, -2, "inertia");
    set_number(L, "armature", j.armature);
    lua_rawseti(L, -2, static_cast<lua_Integer>(i + 1));
  }
  lua_setfield(L, -2, "joints");
  lua_createtable(L, static_cast<int>(model.tips.size()), 0);
  for (std::size_t i = 0; i < model.tips.size(); ++i) {
    lua_createtable(L, 0, 3);
    lua_pushstring(L, model.tips[i].name.c_str());
    lua_setfield(L, -2, "name");
    lua_pushinteger(L, model.tips[i].joint + 1);
    lua_setfield(L, -2, "joint");
    push(impl, L, pose_value(model.tips[i].tool));
    lua_setfield(L, -2, "tool");
    lua_rawseti(L, -2, static_cast<lua_Integer>(i + 1));
  }
  lua_setfield(L, -2, "tips");
}

void push_params(Impl& impl, lua_State* L, const Schema& schema, const Params& params) {
  lua_createtable(L, 0, static_cast<int>(schema.size()));
  for (const ParamSpec& s : schema) {
    if (!params.has(s.name)) continue;
    if (s.type == "bool") lua_pushboolean(L, params.boolean(s.name) ? 1 : 0);
    else if (s.type == "int") lua_pushinteger(L, params.integer(s.name));
    else if (s.type == "real") lua_pushnumber(L, params.real(s.name));
    else if (s.type == "real[]") push_vector(impl, L, params.reals(s.name), s.unit.c_str());
    else if (s.type == "pose") push(impl, L, pose_value(params.pose(s.name)));
    else {
      const std::string_view t = params.text(s.name);
      lua_pushlstring(L, t.data(), t.size());
    }
    lua_setfield(L, -2, s.name.c_str());
  }
}

/// The values of a schema, kept beyond the life of the Params they came from.
class Kept {
 public:
  Kept() = default;
  Kept(const Schema& schema, const Params& p) {
    Map m;
    for (const ParamSpec& s : schema) {
      if (!p.has(s.name)) continue;
      if (s.type == "bool") m.set(s.name, p.boolean(s.name));
      else if (s.type == "int") m.set(s.name, static_cast<std::int64_t>(p.integer(s.name)));
      else if (s.type == "real") m.set(s.name, p.real(s.name));
      else if (s.type == "real[]")
        m.set(s.name, NumericArray({p.reals(s.name).begin(), p.reals(s.name).end()}, s.unit));
      else if (s.type == "pose") m.set(s.name, pose_value(p.pose(s.name)));
      else m.set(s.name, p.text(s.name));
    }
    params_ = make_params(std::move(m));
  }
  [[nodiscard]] const Params& get() const { return *params_; }

 private:
  std::unique_ptr<Params> params_ = make_params({});
};

// --- what a script gives back
// ---------------------------------------------------------------------

Result<std::vector<double>> read_finite(const LuaProvider& p, lua_State* L, int index,
                                        std::size_t count, const char* what) {
  auto numbers = to_reals(L, index, what);
  if (!numbers.ok())
    return failed(p, std::move(numbers).error().message, "Return a list of numbers.");
  if (numbers->size() != count)
    return failed(p,
                  std::string(what) + " has " + std::to_string(numbers->size()) + " numbers; " +
                      std::to_string(count) + " are needed",
                  "Return one number for each joint.");
  for (std::size_t i = 0; i < count; ++i)
    if (!std::isfinite((*numbers)[i]))
      return failed(p,
                    std::string(what) + " has an entry [" + std::to_string(i + 1) + "] that is " +
                        text::print((*numbers)[i]),
                    "Return finite numbers.");
  return std::move(*numbers);
}

Result<Pose> read_pose(const LuaProvider& p, lua_State* L, int index, const char* what) {
  ParamSpec spec;
  spec.name = what;
  spec.type = "pose";
  RMP_TRY_ASSIGN(const Value given, to_value(L, index));
  auto checked = check_value(spec, given, what);
  if (!checked.ok())
    return failed(p, std::move(checked).error().sentence(),
                  "Return a pose such as pose(0.1, 0, 0.2).");
  return *pose_from(*checked);
}

// --- inverse kinematics
// ------------------------------------------------------------------------------

/// fn(model, target, seed, tolerance) -> q | list of q | nil, reason
class LuaIk final : public IkSolver {
 public:
  explicit LuaIk(ProviderPtr p) : p_(std::move(p)) {}

  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(need_simple(model));
    model_ = &model;
    params_ = Kept(p_->schema, params);
    return {};
  }

  Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                     Progress& progress) const override {
    Call call_script(*p_);
    return call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      const std::size_t dof = model_->dof();
      push_model(impl, L, *model_, true);
      const int model = lua_gettop(L);
      push_params(impl, L, p_->schema, params_.get());
      const int params = lua_gettop(L);
      std::vector<double> previous;
      for (std::size_t i = 0; i < batch.targets.size(); ++i) {
        if (progress.cancelled())
          return error(ErrorCode::cancelled, "inverse kinematics was cancelled");
        progress.report(static_cast<double>(i) / static_cast<double>(batch.targets.size()),
                        "inverse kinematics in Lua");
        lua_settop(L, params);
        call_script.push_function(L, "solve");
        lua_pushvalue(L, model);
        push(impl, L, pose_value(batch.targets[i]));
        push_seed(impl, L, batch, i, dof, previous);
        lua_createtable(L, 0, 3);
        set_number(L, "position", batch.tolerance.position);
        set_number(L, "rotation", batch.tolerance.rotation);
        lua_pushinteger(L, batch.tip + 1);
        lua_setfield(L, -2, "tip");
        lua_pushvalue(L, params);
        RMP_TRY(call(impl, L, 5, 2));
        RMP_TRY(read(L, batch, batch.targets[i], results[i]));
        if (batch.continuous && results[i].q.size() >= dof)
          previous.assign(results[i].q.begin(),
                          results[i].q.begin() + static_cast<std::ptrdiff_t>(dof));
      }
      return {};
    });
  }

 private:
  static void push_seed(Impl& impl, lua_State* L, const IkBatch& batch, std::size_t i,
                        std::size_t dof, const std::vector<double>& previous) {
    if (!previous.empty()) push_vector(impl, L, previous);
    else if (batch.seeds.size() >= (i + 1) * dof)
      push_vector(impl, L, batch.seeds.subspan(i * dof, dof));
    else if (batch.seeds.size() >= dof) push_vector(impl, L, batch.seeds.first(dof));
    else push_vector(impl, L, std::vector<double>(dof, 0.0));
  }

  /// The script's answer, judged by forward kinematics and the limits, not by its word.
  Result<void> read(lua_State* L, const IkBatch& batch, const Pose& target, IkResult& out) const {
    const std::size_t dof = model_->dof();
    out = IkResult{};
    if (lua_isnil(L, -2)) {
      out.status = IkStatus::not_converged;
      if (lua_type(L, -1) == LUA_TSTRING) out.detail = lua_tostring(L, -1);
      if (out.detail == "out_of_reach") out.status = IkStatus::out_of_reach;
      if (out.detail == "joint_limit") out.status = IkStatus::joint_limit;
      return {};
    }
    lua_pop(L, 1);
    const int answer = lua_gettop(L);
    bool is_list = false;
    if (const ArrayBox* a = array_at(L, answer)) is_list = a->is_matrix();
    else if (lua_istable(L, answer)) {
      const int first = lua_rawgeti(L, answer, 1);
      is_list = first == LUA_TTABLE || array_at(L, -1) != nullptr;
      lua_pop(L, 1);
    }
    std::vector<std::vector<double>> solutions;
    if (is_list) {
      const auto count = static_cast<lua_Integer>(luaL_len(L, answer));
      for (lua_Integer k = 1; k <= count; ++k) {
        lua_geti(L, answer, k);
        RMP_TRY_ASSIGN(auto q, read_finite(*p_, L, -1, dof, "the solution"));
        lua_pop(L, 1);
        solutions.push_back(std::move(q));
        if (!batch.all_solutions) break;
      }
    } else {
      RMP_TRY_ASSIGN(auto q, read_finite(*p_, L, answer, dof, "the solution"));
      solutions.push_back(std::move(q));
    }
    lua_settop(L, answer - 1);
    for (const auto& q : solutions) judge(q, batch, target, out);
    if (solutions.empty()) out.detail = "the script returned no solution";
    return {};
  }

  void judge(const std::vector<double>& q, const IkBatch& batch, const Pose& target,
             IkResult& out) const {
    std::vector<Pose> frames(model_->joints.size());
    robotics::forward_kinematics(*model_, q, frames);
    const Pose reached = robotics::tip_pose(*model_, static_cast<std::size_t>(batch.tip), frames);
    const auto length = [](const Vec3& v) { return std::hypot(v[0], v[1], v[2]); };
    const double dp = length(
        {target.p[0] - reached.p[0], target.p[1] - reached.p[1], target.p[2] - reached.p[2]});
    const double dr = length(spatial::rotation_difference(reached.R, target.R));
    IkStatus status = IkStatus::solved;
    std::string detail;
    if (dp > batch.tolerance.position || dr > batch.tolerance.rotation) {
      status = IkStatus::not_converged;
      detail = "the script's answer misses the target by " + text::print_rounded(dp, 3) +
               " m and " + text::print_rounded(dr, 3) + " rad";
    }
    for (std::size_t j = 0; j < q.size() && status == IkStatus::solved; ++j) {
      const JointModel& joint = model_->joints[j];
      if (q[j] >= joint.lower && q[j] <= joint.upper) continue;
      status = IkStatus::joint_limit;
      detail = "joint " + text::quote(joint.name) + " is outside its limits";
    }
    const bool is_first = out.q.empty();
    if (!is_first && status != IkStatus::solved) return;
    if (!is_first && out.status != IkStatus::solved) out.q.clear();  // a valid one replaces it
    if (out.q.empty()) {
      out.status = status;
      out.position_error = dp;
      out.rotation_error = dr;
      out.detail = detail;
    }
    out.q.insert(out.q.end(), q.begin(), q.end());
  }

  ProviderPtr p_;
  const RobotModel* model_ = nullptr;
  Kept params_;
};

// --- dynamics
// ------------------------------------------------------------------------------------------

double friction(const JointModel& j, double qd) {
  return j.friction.viscous * qd + (qd > 0   ? j.friction.coulomb_positive
                                    : qd < 0 ? j.friction.coulomb_negative
                                             : 0.0);
}

bool pushes(std::span<const TipWrench> tip) {
  return std::any_of(tip.begin(), tip.end(),
                     [](const TipWrench& w) { return w.force != Vec3{} || w.moment != Vec3{}; });
}

/// J^T w of sample i at the first tip.
std::vector<double> wrench_torques(const RobotModel& model, const DynamicsBatch& b, std::size_t i,
                                   std::span<const double> q) {
  const std::size_t dof = model.dof();
  std::vector<Pose> frames(dof);
  std::vector<double> jacobian(6 * dof), out(dof, 0.0);
  robotics::forward_kinematics(model, q, frames);
  robotics::geometric_jacobian(model, 0, frames, robotics::JacobianFrame::base, jacobian);
  const TipWrench& w = b.tip.size() == 1 ? b.tip[0] : b.tip[i];
  for (std::size_t j = 0; j < dof; ++j)
    for (std::size_t k = 0; k < 3; ++k)
      out[j] += jacobian[6 * j + k] * w.force[k] + jacobian[6 * j + 3 + k] * w.moment[k];
  return out;
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

/// fn(model, q, qd, qdd) -> tau of gravity, inertia (armature included) and velocity; friction and
/// the wrench at the tip are added here.
class LuaInverseDynamics final : public InverseDynamics {
 public:
  explicit LuaInverseDynamics(ProviderPtr p) : p_(std::move(p)) {}
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(need_simple(model));
    model_ = &model;
    params_ = Kept(p_->schema, params);
    return {};
  }
  [[nodiscard]] std::size_t scratch_size() const override { return 0; }

  Result<void> torques(const DynamicsBatch& b, std::span<double> tau,
                       Progress& progress) const override {
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
            if (b.terms & kFrictionTerm)
              for (std::size_t j = 0; j < dof; ++j) sum[j] += friction(model_->joints[j], qd[j]);
            if ((b.terms & kExternalTerm) && pushes(b.tip)) {
              const auto w = wrench_torques(*model_, b, i, q);
              for (std::size_t j = 0; j < dof; ++j) sum[j] -= w[j];
            }
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

  ProviderPtr p_;
  const RobotModel* model_ = nullptr;
  Kept params_;
};

/// fn(model, q, qd, tau) -> qdd without friction; friction and the tip's wrench change the tau it
/// is given, and a model without gravity stands for the gravity term left out.
class LuaForwardDynamics final : public ForwardDynamics {
 public:
  explicit LuaForwardDynamics(ProviderPtr p) : p_(std::move(p)) {}
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(need_simple(model));
    model_ = &model;
    params_ = Kept(p_->schema, params);
    return {};
  }
  [[nodiscard]] std::size_t scratch_size() const override { return 0; }

  Result<void> accelerations(const DynamicsBatch& b, std::span<double> qdd,
                             Progress& progress) const override {
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
                 if (b.terms & kFrictionTerm)
                   for (std::size_t j = 0; j < dof; ++j)
                     tau[j] -= friction(model_->joints[j], qd[j]);
                 if ((b.terms & kExternalTerm) && pushes(b.tip)) {
                   const auto w = wrench_torques(*model_, b, i, q);
                   for (std::size_t j = 0; j < dof; ++j) tau[j] += w[j];
                 }
                 RMP_TRY_ASSIGN(
                     const auto out,
                     f(q, (b.terms & kVelocityTerm) ? qd : std::span<const double>(zero), tau));
                 std::copy(out.begin(), out.end(),
                           qdd.begin() + static_cast<std::ptrdiff_t>(i * dof));
               }
               return {};
             });
  }

 private:
  ProviderPtr p_;
  const RobotModel* model_ = nullptr;
  Kept params_;
};

// --- trajectory segments
// ---------------------------------------------------------------------------------

/// A path that a script described, sampled once when it was made: the SDK lets any thread sample a
/// segment, and Lua has only one. Quintic between the samples, so rates are continuous.
class SampledSegment final : public Segment {
 public:
  SampledSegment(double duration, std::vector<PathSample> samples)
      : duration_(duration), samples_(std::move(samples)) {
    for (std::size_t i = 1; i < samples_.size(); ++i) {
      const Vec3 &a = samples_[i - 1].pose.p, &b = samples_[i].pose.p;
      length_ += std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    }
  }
  [[nodiscard]] double duration() const override { return duration_; }
  [[nodiscard]] double length() const override { return length_; }

  void sample(std::span<const double> times, std::span<PathSample> out) const override {
    const double step = duration_ / static_cast<double>(samples_.size() - 1);
    for (std::size_t n = 0; n < times.size(); ++n) {
      if (times[n] <= 0 || times[n] >= duration_) {
        out[n] = PathSample{
            times[n] <= 0 ? samples_.front().pose : samples_.back().pose, {}, {}, {}, {}};
        if (times[n] < 0 || times[n] > duration_) continue;
        out[n] = times[n] <= 0 ? samples_.front() : samples_.back();
        continue;
      }
      const auto i = std::min(static_cast<std::size_t>(times[n] / step), samples_.size() - 2);
      out[n] =
          between(samples_[i], samples_[i + 1], step, times[n] / step - static_cast<double>(i));
    }
  }

 private:
  struct Motion {
    double x, v, a;
  };
  /// Quintic Hermite interpolation at u in 0..1 over a step h.
  static Motion hermite(const Motion& s, const Motion& e, double h, double u) {
    const double d0 = s.x, d1 = s.v * h, d2 = s.a * h * h / 2;
    const double dx = e.x - (d0 + d1 + d2), dv = e.v * h - (d1 + 2 * d2), da = e.a * h * h - 2 * d2;
    const double c3 = 10 * dx - 4 * dv + da / 2, c4 = -15 * dx + 7 * dv - da,
                 c5 = 6 * dx - 3 * dv + da / 2;
    return {d0 + u * (d1 + u * (d2 + u * (c3 + u * (c4 + u * c5)))),
            (d1 + u * (2 * d2 + u * (3 * c3 + u * (4 * c4 + u * 5 * c5)))) / h,
            (2 * d2 + u * (6 * c3 + u * (12 * c4 + u * 20 * c5))) / (h * h)};
  }
  static PathSample between(const PathSample& a, const PathSample& b, double h, double u) {
    PathSample out;
    for (std::size_t k = 0; k < 3; ++k) {
      const Motion m = hermite({a.pose.p[k], a.velocity[k], a.acceleration[k]},
                               {b.pose.p[k], b.velocity[k], b.acceleration[k]}, h, u);
      out.pose.p[k] = m.x;
      out.velocity[k] = m.v;
      out.acceleration[k] = m.a;
    }
    // The turn within one step is small, so its rotation vector may be treated as a position.
    const Vec3 turn = spatial::rotation_difference(a.pose.R, b.pose.R);
    Vec3 part{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Motion m = hermite({0, a.angular_velocity[k], a.angular_acceleration[k]},
                               {turn[k], b.angular_velocity[k], b.angular_acceleration[k]}, h, u);
      part[k] = m.x;
      out.angular_velocity[k] = m.v;
      out.angular_acceleration[k] = m.a;
    }
    Pose delta, start;
    delta.R = spatial::rotation_exp(part);
    start.R = a.pose.R;
    out.pose.R = spatial::compose(delta, start).R;
    return out;
  }

  double duration_, length_ = 0;
  std::vector<PathSample> samples_;
};

/// fn(points, params, t) -> pose, and the duration for t == nil; or {duration = number | fn,
/// sample = fn}.
class LuaSegmentMaker final : public SegmentMaker {
 public:
  explicit LuaSegmentMaker(ProviderPtr p) : p_(std::move(p)) {}

  Result<std::unique_ptr<Segment>> make(std::span<const Pose> points,
                                        const Params& params) const override {
    double duration = 0;
    std::vector<Pose> poses;
    Call call_script(*p_);
    const auto sampled = call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      lua_createtable(L, static_cast<int>(points.size()), 0);
      const int list = lua_gettop(L);
      for (std::size_t i = 0; i < points.size(); ++i) {
        push(impl, L, pose_value(points[i]));
        lua_rawseti(L, list, static_cast<lua_Integer>(i + 1));
      }
      push_params(impl, L, p_->schema, params);
      const int values = lua_gettop(L);
      call_script.push_function(L, "duration");
      if (lua_isfunction(L, -1)) {
        lua_pushvalue(L, list);
        lua_pushvalue(L, values);
        RMP_TRY(call(impl, L, 2, 1));
      }
      duration = lua_type(L, -1) == LUA_TNUMBER ? static_cast<double>(lua_tonumber(L, -1)) : 0.0;
      if (!(duration > 0) || !std::isfinite(duration))
        return failed(*p_, "the duration is not a number above 0 [s]",
                      "Return the duration when t is nil, or give duration = seconds.");
      const auto count = sample_count(duration);
      poses.reserve(count);
      const double step = duration / static_cast<double>(count - 1);
      for (std::size_t i = 0; i < count; ++i) {
        lua_settop(L, values);
        call_script.push_function(L, "sample");
        lua_pushvalue(L, list);
        lua_pushvalue(L, values);
        lua_pushnumber(L, i + 1 == count ? duration : step * static_cast<double>(i));
        RMP_TRY(call(impl, L, 3, 1));
        RMP_TRY_ASSIGN(const Pose pose, read_pose(*p_, L, -1, "the pose"));
        poses.push_back(pose);
      }
      return {};
    });
    if (!sampled.ok()) return sampled.error();
    return std::unique_ptr<Segment>(
        std::make_unique<SampledSegment>(duration, with_rates(poses, duration)));
  }

 private:
  /// 2 ms apart, within 201..20001 samples.
  static std::size_t sample_count(double duration) {
    return static_cast<std::size_t>(std::clamp(std::ceil(duration / 0.002), 200.0, 20000.0)) + 1;
  }

  /// Rates by finite differences of fourth order.
  static std::vector<PathSample> with_rates(const std::vector<Pose>& poses, double duration) {
    const std::size_t n = poses.size();
    const double h = duration / static_cast<double>(n - 1);
    std::vector<PathSample> out(n);
    for (std::size_t i = 0; i < n; ++i) {
      out[i].pose = poses[i];
      for (std::size_t k = 0; k < 3; ++k) {
        const auto at = [&](std::size_t j) { return poses[j].p[k]; };
        out[i].velocity[k] = first_difference(at, i, n, h);
        out[i].acceleration[k] = second_difference(at, i, n, h);
        // Orientation as the rotation vector from this sample to its neighbours.
        const auto turned = [&](std::size_t j) {
          return spatial::rotation_difference(poses[i].R, poses[j].R)[k];
        };
        out[i].angular_velocity[k] = first_difference(turned, i, n, h);
        out[i].angular_acceleration[k] = second_difference(turned, i, n, h);
      }
    }
    return out;
  }
  // Coefficients of fourth order on equidistant points: central ones inside, one-sided ones for the
  // last two points of either end (`x` counted from that end).
  template <class At>
  static double first_difference(const At& x, std::size_t i, std::size_t n, double h) {
    if (i >= 2 && i + 2 < n) return (x(i - 2) - 8 * x(i - 1) + 8 * x(i + 1) - x(i + 2)) / (12 * h);
    const bool at_start = i < 2;
    const auto y = [&](std::size_t k) { return x(at_start ? k : n - 1 - k); };
    const std::size_t k = at_start ? i : n - 1 - i;
    const double slope = k == 0 ? -25 * y(0) + 48 * y(1) - 36 * y(2) + 16 * y(3) - 3 * y(4)
                                : -3 * y(0) - 10 * y(1) + 18 * y(2) - 6 * y(3) + y(4);
    return (at_start ? slope : -slope) / (12 * h);
  }
  template <class At>
  static double second_difference(const At& x, std::size_t i, std::size_t n, double h) {
    if (i >= 2 && i + 2 < n)
      return (-x(i - 2) + 16 * x(i - 1) - 30 * x(i) + 16 * x(i + 1) - x(i + 2)) / (12 * h * h);
    const bool at_start = i < 2;
    const auto y = [&](std::size_t k) { return x(at_start ? k : n - 1 - k); };
    const std::size_t k = at_start ? i : n - 1 - i;
    const double bend =
        k == 0 ? 45 * y(0) - 154 * y(1) + 214 * y(2) - 156 * y(3) + 61 * y(4) - 10 * y(5)
               : 10 * y(0) - 15 * y(1) - 4 * y(2) + 14 * y(3) - 6 * y(4) + y(5);
    return bend / (12 * h * h);
  }

  ProviderPtr p_;
};

// --- registration
// ------------------------------------------------------------------------------------------

struct Adapter {
  const char* interface_id;
  void* (*create)(ProviderPtr);
  const char* function;  ///< field of the table form that must be a function
};

template <class I, class T>
void* make(ProviderPtr p) {
  return static_cast<I*>(new T(std::move(p)));
}

constexpr Adapter kAdapters[] = {
    {IkSolver::kInterfaceId, make<IkSolver, LuaIk>, "solve"},
    {InverseDynamics::kInterfaceId, make<InverseDynamics, LuaInverseDynamics>, "torques"},
    {ForwardDynamics::kInterfaceId, make<ForwardDynamics, LuaForwardDynamics>, "accelerations"},
    {SegmentMaker::kInterfaceId, make<SegmentMaker, LuaSegmentMaker>, "sample"},
};

Result<std::string> need_text(lua_State* L, int index, const char* what) {
  if (lua_type(L, index) == LUA_TSTRING) return std::string(lua_tostring(L, index));
  return error(ErrorCode::invalid_argument,
               std::string(what) + " must be a text, not a " + luaL_typename(L, index),
               "Write ioci.provide(\"robomosp.ik/1\", \"my_ik\", fn).");
}

std::string text_field(const Map& m, const char* name) {
  const Value* v = m.find(name);
  return v && v->as_string() ? *v->as_string() : std::string();
}

/// params = {{name = "gain", type = "real", unit = "", doc = "...", default = 1}, ...}
Result<Schema> read_schema(lua_State* L, int table) {
  Schema schema;
  lua_getfield(L, table, "params");
  auto given = to_value(L, -1);
  lua_pop(L, 1);
  if (!given.ok()) return std::move(given).error().in("params");
  if (given->is_nil()) return schema;
  if (!given->as_list())
    return error(ErrorCode::invalid_argument, "params is not a list",
                 "Write params = {{name = \"gain\", type = \"real\", default = 1}}.");
  for (const Value& row : *given->as_list()) {
    ParamSpec p;
    if (const Map* m = row.as_map()) {
      p.name = text_field(*m, "name");
      p.type = text_field(*m, "type");
      p.unit = text_field(*m, "unit");
      p.doc = text_field(*m, "doc");
      if (const Value* d = m->find("default")) p.default_value = *d;
      if (const Value* v = m->find("min"); v && v->is_number()) p.min = v->number();
      if (const Value* v = m->find("max"); v && v->is_number()) p.max = v->number();
      if (const Value* v = m->find("choices"); v && v->as_list())
        for (const Value& c : *v->as_list())
          p.choices.push_back(c.as_string() ? *c.as_string() : c.text());
    }
    static constexpr std::string_view kTypes[] = {"bool", "int",  "real",   "string",
                                                  "enum", "path", "real[]", "pose"};
    if (p.name.empty() ||
        std::find(std::begin(kTypes), std::end(kTypes), p.type) == std::end(kTypes))
      return error(ErrorCode::invalid_argument, "an entry of params has no name or no known type",
                   "Types: bool, int, real, string, enum, path, real[], pose.");
    p.required = !p.default_value;
    schema.push_back(std::move(p));
  }
  return schema;
}

void close(Impl& impl, LuaProvider& p) {
  impl.app.registry.remove(p.interface_id, p.name);
  luaL_unref(impl.main, LUA_REGISTRYINDEX, p.ref);
  p.ref = LUA_NOREF;
  p.state = nullptr;
}

bool withdraw(Impl& impl, std::string_view interface_id, std::string_view name) {
  const auto it = std::find_if(
      impl.providers.begin(), impl.providers.end(),
      [&](const ProviderPtr& p) { return p->interface_id == interface_id && p->name == name; });
  if (it == impl.providers.end()) return false;
  close(impl, **it);
  impl.providers.erase(it);
  return true;
}

/// ioci.provide(interface_id, name, fn | {fn fields, summary =, params =})
Result<int> ioci_provide(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const std::string interface_id, need_text(L, 1, "the interface id"));
  RMP_TRY_ASSIGN(const std::string name, need_text(L, 2, "the provider's name"));
  const auto* adapter =
      std::find_if(std::begin(kAdapters), std::end(kAdapters),
                   [&](const Adapter& a) { return interface_id == a.interface_id; });
  if (adapter == std::end(kAdapters)) {
    std::vector<std::string> ids;
    for (const Adapter& a : kAdapters) ids.emplace_back(a.interface_id);
    return error(ErrorCode::unknown_name,
                 text::quote(interface_id) + " is not an interface that Lua can provide",
                 text::did_you_mean(interface_id, ids) +
                     (text::nearest(interface_id, ids) ? " " : "") +
                     "Interfaces: " + text::enumerate(ids) + ".");
  }
  ProviderInfo info;
  if (lua_istable(L, 3)) {
    lua_getfield(L, 3, adapter->function);
    const bool has_function = lua_isfunction(L, -1);
    lua_pop(L, 1);
    if (!has_function)
      return error(ErrorCode::invalid_argument,
                   "the table has no function " + std::string(adapter->function),
                   "Write {" + std::string(adapter->function) + " = function(...) ... end}.");
    lua_getfield(L, 3, "summary");
    if (lua_type(L, -1) == LUA_TSTRING) info.summary = lua_tostring(L, -1);
    lua_pop(L, 1);
    RMP_TRY_ASSIGN(info.schema, read_schema(L, 3));
  } else if (!lua_isfunction(L, 3)) {
    return error(
        ErrorCode::invalid_argument,
        std::string("a provider is a function or a table of functions, not a ") +
            luaL_typename(L, 3),
        "Write ioci.provide(\"" + interface_id + "\", \"" + name + "\", function(...) ... end).");
  }
  info.interface_id = interface_id;
  info.name = name;
  info.origin = "lua";
  if (info.summary.empty()) info.summary = "Provided by the script " + place(L, 1) + ".";

  auto provider = std::make_shared<LuaProvider>();
  provider->thread = &impl.app.thread;
  provider->interface_id = interface_id;
  provider->name = name;
  provider->schema = info.schema;
  withdraw(impl, interface_id, name);  // a script that is run again replaces what it gave before
  RMP_TRY(impl.app.registry.add(
      std::move(info),
      [provider, create = adapter->create]() -> Result<void*> { return create(provider); }));
  lua_pushvalue(L, 3);
  provider->ref = luaL_ref(L, LUA_REGISTRYINDEX);
  provider->state = &impl;
  impl.providers.push_back(std::move(provider));
  return 0;
}

Result<int> ioci_withdraw(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const std::string interface_id, need_text(L, 1, "the interface id"));
  RMP_TRY_ASSIGN(const std::string name, need_text(L, 2, "the provider's name"));
  lua_pushboolean(L, withdraw(impl, interface_id, name) ? 1 : 0);
  return 1;
}

}  // namespace

void withdraw_all(Impl& impl) {
  for (const ProviderPtr& p : impl.providers) close(impl, *p);
  impl.providers.clear();
}

void open_providers(Impl&, lua_State* L) {
  lua_pushcfunction(L, entry<ioci_provide>);
  lua_setfield(L, -2, "provide");
  lua_pushcfunction(L, entry<ioci_withdraw>);
  lua_setfield(L, -2, "withdraw");
}

}  // namespace robomosp::lua
