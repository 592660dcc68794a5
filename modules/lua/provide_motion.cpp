// SPDX-License-Identifier: Apache-2.0
// Controllers and integrators written in Lua (layer: application, lua).
#include <algorithm>
#include <cmath>

#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/integrator.h>

#include "kernel/text.h"
#include "lua/provide.h"

namespace robomosp::lua {
namespace {

void note_old_word(Impl& impl, const std::string& what, const std::string& was,
                   const std::string& is) {
  program_of(impl).app.messages.post(
      Severity::info, "old_word",
      what + " is called \"" + is + "\" now; \"" + was + "\" is its old name.");
}

/// Reads `now.q_desired` and its like, the old names of `now.q_desired`.
int read_old_word(lua_State* L) {
  constexpr std::string_view kWas = "_wanted";
  if (lua_type(L, 2) != LUA_TSTRING) return 0;
  const std::string was = lua_tostring(L, 2);
  if (!was.ends_with(kWas)) return 0;
  const std::string is = was.substr(0, was.size() - kWas.size()) + "_desired";
  lua_getmetatable(L, 1);
  if (lua_getfield(L, -1, was.c_str()) == LUA_TNIL) {  // once each
    lua_pushboolean(L, 1);
    lua_setfield(L, -3, was.c_str());
    note_old_word(impl_of(L), "What a controller is to follow", "now." + was, "now." + is);
  }
  lua_pushlstring(L, is.data(), is.size());
  lua_rawget(L, 1);
  return 1;
}

/// fn(model, now, state, params) -> tau. `now` holds time, dt, q, qd, q_desired, qd_desired,
/// qdd_desired, and of the mechanism gravity (torques), bias (with Coriolis and centrifugal ones)
/// and inertia (matrix); the list `state` is the run's own: as many numbers as the field `state`
/// of the provider's table says, 0 at the start.
class LuaController final : public Controller, private BoundScript {
 public:
  explicit LuaController(ProviderPtr p) : BoundScript(std::move(p)) {}

  Result<void> prepare(const RobotModel& model, const InverseDynamics& dynamics,
                       const Params& params) override {
    RMP_TRY(bind(model, params));
    dynamics_ = &dynamics;
    state_ = 0;
    Call call_script(*p_);
    return call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      lua_rawgeti(L, LUA_REGISTRYINDEX, p_->ref);
      if (!lua_istable(L, -1)) return {};
      if (lua_getfield(L, -1, "state") == LUA_TNIL) {
        lua_pop(L, 1);
        if (lua_getfield(L, -1, "memory") == LUA_TNIL) return {};
        note_old_word(impl, "How many numbers the controller " + text::quote(p_->name) + " keeps",
                      "memory", "state");
      }
      const lua_Integer count = lua_isinteger(L, -1) ? lua_tointeger(L, -1) : -1;
      if (count < 0 || count > 1000000)
        return failed(*p_, "state is not a count of numbers", "Write state = 6.");
      state_ = static_cast<std::size_t>(count);
      return {};
    });
  }
  [[nodiscard]] std::size_t state_size() const override { return state_; }
  [[nodiscard]] std::size_t scratch_size() const override {
    return dynamics_->scratch_size() + model_->dof();
  }

  Result<void> torques(const ControlInput& in, std::span<double> state, std::span<double> scratch,
                       std::span<double> tau) const override {
    if (state.size() < state_ || scratch.size() < scratch_size() || tau.size() != model_->dof())
      return error(ErrorCode::invalid_argument, "state, scratch or tau is too short");
    Call call_script(*p_);
    return call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      call_script.push_function(L, "torques");
      push_model(impl, L, *model_, true);
      RMP_TRY(push_now(impl, L, in, scratch, tau));
      lua_createtable(L, static_cast<int>(state_), 0);
      const int kept = lua_gettop(L);
      for (std::size_t i = 0; i < state_; ++i) {
        lua_pushnumber(L, state[i]);
        lua_rawseti(L, kept, static_cast<lua_Integer>(i + 1));
      }
      lua_pushvalue(L, kept);
      lua_insert(L, 1);  // a hold on it that outlives the call
      push_params(impl, L, p_->schema, params_.get());
      RMP_TRY(call(impl, L, 4, 1));
      RMP_TRY_ASSIGN(const auto out, read_finite(*p_, L, -1, tau.size(), "the torques"));
      std::copy(out.begin(), out.end(), tau.begin());
      if (state_ == 0) return {};
      RMP_TRY_ASSIGN(const auto after, read_finite(*p_, L, 1, state_, "the state"));
      std::copy(after.begin(), after.end(), state.begin());
      return {};
    });
  }

 private:
  /// What the controller sees, with the weight and the bias of the moment: most controllers written
  /// in a script compensate them.
  Result<void> push_now(Impl& impl, lua_State* L, const ControlInput& in, std::span<double> scratch,
                        std::span<double> tau) const {
    lua_createtable(L, 0, 11);
    set_number(L, "time", in.time);
    set_number(L, "dt", in.dt);
    const std::pair<const char*, std::span<const double>> vectors[] = {
        {"q", in.q},
        {"qd", in.qd},
        {"q_desired", in.q_desired},
        {"qd_desired", in.qd_desired},
        {"qdd_desired", in.qdd_desired}};
    for (const auto& [name, values] : vectors) {
      push_vector(impl, L, values);
      lua_setfield(L, -2, name);
    }
    if (in.tip_desired) {
      push(impl, L, pose_value(*in.tip_desired));
      lua_setfield(L, -2, "tip_desired");
      push_vector(impl, L, in.tip_velocity_desired);
      lua_setfield(L, -2, "tip_velocity_desired");
    }
    DynamicsBatch batch;
    batch.count = 1, batch.q = in.q, batch.scratch = scratch;
    NoProgress none;
    batch.terms = kGravityTerm | kSpringTerm;
    RMP_TRY(dynamics_->torques(batch, tau, none));
    push_vector(impl, L, tau, "N m");
    lua_setfield(L, -2, "gravity");
    batch.qd = in.qd;
    batch.terms = kGravityTerm | kSpringTerm | kVelocityTerm;
    RMP_TRY(dynamics_->torques(batch, tau, none));
    push_vector(impl, L, tau, "N m");
    lua_setfield(L, -2, "bias");
    std::vector<double> m(model_->dof() * model_->dof());
    batch.qd = {};
    RMP_TRY(dynamics_->inertia(batch, m, none));
    push_array(impl, L, NumericArray(std::move(m), model_->dof(), model_->dof()));
    lua_setfield(L, -2, "inertia");
    if (luaL_newmetatable(L, "robomosp.controller_input")) {
      lua_pushcfunction(L, read_old_word);
      lua_setfield(L, -2, "__index");
    }
    lua_setmetatable(L, -2);
    return {};
  }

  const InverseDynamics* dynamics_ = nullptr;
  std::size_t state_ = 0;
};

/// fn(rate, t, x, h, params) -> x at t + h, where rate(t, x) gives dx. The steps are the run's
/// `step` long and end at every sample; events are looked for at their ends.
class LuaIntegrator final : public Integrator {
 public:
  explicit LuaIntegrator(ProviderPtr p) : p_(std::move(p)) {}
  Result<void> prepare(const Params& params) override {
    params_ = Kept(p_->schema, params);
    return {};
  }
  Result<OdeStatistics> run(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                            Progress& progress) const override {
    if (run.x0.size() != system.size() || !(run.step > 0) || run.end < run.start)
      return error(ErrorCode::invalid_argument, "the run has no state, step or time",
                   "Give a state, a step above 0 and an end after the start.");
    OdeStatistics done;
    std::vector<double> x(run.x0.begin(), run.x0.end());
    system.project(x);
    Events events(system);
    events.arm(run.start, x);
    double t = run.start;
    std::size_t next = 0;
    const auto give = [&]() -> bool {
      for (; next < run.sample_times.size() && run.sample_times[next] <= t; ++next)
        if (!sink.sample(t, x)) return false;
      return true;
    };
    done.end = t;
    bool go_on = give();
    while (go_on && t < run.end) {
      if (progress.cancelled()) return error(ErrorCode::cancelled, "the integration was cancelled");
      const double limit = next < run.sample_times.size() ? run.sample_times[next] : run.end;
      const double h = limit - t <= run.step * (1 + 1e-9) ? limit - t : run.step;
      RMP_TRY_ASSIGN(auto ahead, step(system, t, x, h, done));
      double taken = h;
      std::vector<std::size_t> fired = events.fired(t + h, ahead);
      if (!fired.empty()) {
        // Halving from the start of the step down to its rounding.
        double low = 0;
        while (taken - low > 1e-15 * std::max(1.0, std::fabs(t)) && taken - low > 1e-9 * h) {
          const double middle = low + (taken - low) / 2;
          RMP_TRY_ASSIGN(auto trial, step(system, t, x, middle, done));
          auto now = events.fired(t + middle, trial);
          if (now.empty()) low = middle;
          else taken = middle, ahead = std::move(trial), fired = std::move(now);
        }
      }
      ++done.steps;
      x = std::move(ahead);
      t = taken == h && h == limit - t ? limit : t + taken;
      system.project(x);
      for (const std::size_t i : fired) {
        ++done.events;
        go_on = system.at_event(t, i, x) && go_on;
      }
      events.arm(t, x, fired);
      done.end = t;
      go_on = give() && go_on;
    }
    return done;
  }

 private:
  /// Signs of the event functions; one that has just happened has none until it has left zero.
  class Events {
   public:
    explicit Events(OdeSystem& system)
        : system_(system), signs_(system.events()), values_(signs_.size()) {}
    void arm(double t, std::span<const double> x, const std::vector<std::size_t>& fired = {}) {
      if (signs_.empty()) return;
      system_.event_values(t, x, values_);
      for (std::size_t i = 0; i < signs_.size(); ++i) signs_[i] = sign(values_[i]);
      for (const std::size_t i : fired) signs_[i] = 0;
    }
    std::vector<std::size_t> fired(double t, std::span<const double> x) {
      std::vector<std::size_t> out;
      if (signs_.empty()) return out;
      system_.event_values(t, x, values_);
      for (std::size_t i = 0; i < signs_.size(); ++i)
        if (signs_[i] != 0 && sign(values_[i]) != signs_[i]) out.push_back(i);
      return out;
    }

   private:
    static int sign(double v) { return v > 0 ? 1 : v < 0 ? -1 : 0; }
    OdeSystem& system_;
    std::vector<int> signs_;
    std::vector<double> values_;
  };

  /// What the script's `rate` calls.
  struct Asked {
    OdeSystem* system;
    OdeStatistics* done;
  };
  static Result<int> rate(Impl& impl, lua_State* L) {
    RMP_TRY_ASSIGN(const Asked* asked, Borrowed<const Asked>::get(L));
    if (!lua_isnumber(L, 1))
      return error(ErrorCode::invalid_argument, "rate needs a time and a state",
                   "Write rate(t, x).");
    RMP_TRY_ASSIGN(const auto x, to_reals(L, 2, "x"));
    if (x.size() != asked->system->size())
      return error(ErrorCode::invalid_argument,
                   "x has " + std::to_string(x.size()) + " numbers instead of " +
                       std::to_string(asked->system->size()),
                   "Give the whole state.");
    std::vector<double> dx(x.size());
    ++asked->done->rates;
    RMP_TRY(asked->system->rate(lua_tonumber(L, 1), x, dx));
    push_vector(impl, L, dx);
    return 1;
  }

  Result<std::vector<double>> step(OdeSystem& system, double t, std::span<const double> x, double h,
                                   OdeStatistics& done) const {
    std::vector<double> out;
    const Asked asked{&system, &done};
    Call call_script(*p_);
    const auto ran = call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      const Borrowed<const Asked> borrowed(L, &asked);
      call_script.push_function(L, "step");
      borrowed.push_function<rate>(L);
      lua_pushnumber(L, t);
      push_vector(impl, L, x);
      lua_pushnumber(L, h);
      push_params(impl, L, p_->schema, params_.get());
      RMP_TRY(call(impl, L, 5, 1));
      RMP_TRY_ASSIGN(out, read_finite(*p_, L, -1, x.size(), "the state"));
      return {};
    });
    if (!ran.ok()) return ran.error();
    return out;
  }

  ProviderPtr p_;
  Kept params_;
};

}  // namespace

RMP_LUA_PROVIDER(Controller, LuaController, "torques");
RMP_LUA_PROVIDER(Integrator, LuaIntegrator, "step");

}  // namespace robomosp::lua
