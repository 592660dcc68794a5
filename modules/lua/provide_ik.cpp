// SPDX-License-Identifier: Apache-2.0
// Inverse kinematics written in Lua (layer: application, lua).
#include <algorithm>
#include <cmath>

#include <robomosp/sdk/ik.h>

#include "kernel/text.h"
#include "lua/provide.h"
#include "robotics/kinematics.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::lua {
namespace {

/// fn(model, target, seed, tolerance) -> q | list of q | nil, reason
class LuaIk final : public IkSolver, private BoundScript {
 public:
  explicit LuaIk(ProviderPtr p) : BoundScript(std::move(p)) {}

  Result<void> prepare(const RobotModel& model, const Params& params) override {
    return bind(model, params);
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
};

}  // namespace

void* make_lua_ik(ProviderPtr p) { return static_cast<IkSolver*>(new LuaIk(std::move(p))); }

}  // namespace robomosp::lua
