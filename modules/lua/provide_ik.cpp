// SPDX-License-Identifier: Apache-2.0
// Inverse kinematics written in Lua (layer: application, lua).
#include <algorithm>
#include <cmath>
#include <cstring>

#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/ik_branches.h>

#include "kernel/text.h"
#include "lua/provide.h"
#include "robotics/closure.h"
#include "robotics/coordinates.h"
#include "robotics/kinematics.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::lua {
namespace {

/// What the script's `clearance` reads.
struct Obstacles {
  const RobotModel* model;
  const ClearanceField* field;
};

/// fn(model, target, seed, asked) -> q | list of q | nil, reason; and if its table has `branches`
/// and the function `branch`(model, q, tip, params) -> a number a choice, it names its branches.
class LuaIk final : public IkSolver, public IkBranches, private BoundScript {
 public:
  explicit LuaIk(ProviderPtr p) : BoundScript(std::move(p)) {}

  [[nodiscard]] const void* extension(const char* id) const override {
    const bool is_named = !choices_.empty() && std::strcmp(id, IkBranches::kExtensionId) == 0;
    return is_named ? static_cast<const IkBranches*>(this) : nullptr;
  }
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(bind(model, params));
    Call call_script(*p_);
    return call_script.run(
        [&](Impl&, lua_State* L) -> Result<void> { return read_branches(call_script, L); });
  }
  [[nodiscard]] std::span<const IkBranchChoice> choices(std::int32_t /*tip*/) const override {
    return choices_;
  }
  void measure(std::int32_t tip, std::span<const double> q, std::span<double> out) const override {
    Call call_script(*p_);
    const std::size_t n = model_->coordinate_count(), width = choices_.size();
    const auto done = call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      push_model(impl, L, *model_, true);
      const int model = lua_gettop(L);
      push_params(impl, L, p_->schema, params_.get());
      const int params = model + 1;
      for (std::size_t i = 0; (i + 1) * n <= q.size(); ++i) {
        auto one = measure_one(call_script, impl, L, model, params, tip, q.subspan(i * n, n));
        if (!one.ok()) {
          report(impl, one.error());
          return std::move(one).error();
        }
        std::copy(one->begin(), one->end(), out.begin() + static_cast<std::ptrdiff_t>(i * width));
      }
      return {};
    });
    // Without an answer all branches meet; why has been told.
    if (!done.ok()) std::fill(out.begin(), out.end(), 0.0);
  }

  Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                     Progress& progress) const override {
    Call call_script(*p_, &progress);
    return call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      RMP_TRY(check(batch));
      const std::size_t n = model_->coordinate_count(),
                        goals = std::max<std::size_t>(1, batch.goals.size());
      push_model(impl, L, *model_, true);
      const int model = lua_gettop(L);
      push_params(impl, L, p_->schema, params_.get());
      const Obstacles obstacles{model_, batch.clearance};
      const Borrowed<const Obstacles> borrowed(L, &obstacles);
      const int params = lua_gettop(L) - 1, kept = params + 1;
      std::vector<double> previous;
      for (std::size_t i = 0; i < batch.samples(); ++i) {
        if (progress.cancelled())
          return error(ErrorCode::cancelled, "inverse kinematics was cancelled");
        progress.report(static_cast<double>(i) / static_cast<double>(batch.samples()),
                        "inverse kinematics in Lua");
        lua_settop(L, kept);
        call_script.push_function(L, "solve");
        lua_pushvalue(L, model);
        const auto targets = batch.targets.subspan(i * goals, goals);
        push(impl, L, pose_value(targets.front()));
        push_seed(impl, L, batch, i, n, previous, *model_);
        push_question(impl, L, batch, i, targets, borrowed);
        lua_pushvalue(L, params);
        RMP_TRY(call(impl, L, 5, 2));
        RMP_TRY(read(L, batch, targets, results[i]));
        if (batch.continuous && results[i].q.size() >= n)
          previous.assign(results[i].q.begin(),
                          results[i].q.begin() + static_cast<std::ptrdiff_t>(n));
      }
      return {};
    });
  }

 private:
  static bool is_whole(const IkBatch& b) {
    return b.goals.empty() || (b.goals.size() == 1 && b.goals[0].parts == kIkPose);
  }
  /// branches = {{"elbow", "up", "down"}, ...}: a choice's name, the word for a measure above 0 and
  /// the one for a measure below.
  Result<void> read_branches(const Call& call_script, lua_State* L) {
    choices_.clear();
    words_.clear();
    const bool has_function = call_script.push_optional(L, "branch");
    if (has_function) lua_pop(L, 1);
    lua_rawgeti(L, LUA_REGISTRYINDEX, p_->ref);
    if (!lua_istable(L, -1)) return {};
    lua_getfield(L, -1, "branches");
    RMP_TRY_ASSIGN(const Value given, to_value(L, -1));
    if (given.is_nil() && !has_function) return {};
    const auto wrong = [](std::string what) {
      return error(
          ErrorCode::invalid_argument, std::move(what),
          "Write branches = {{\"elbow\", \"up\", \"down\"}} and branch = function(model, q) "
          "return {...} end, a positive or negative number per choice.");
    };
    if (!has_function) return wrong("it has branches but no function branch to distinguish them");
    const List* list = given.as_list();
    if (!list || list->empty()) return wrong("it has a function branch but no list of branches");
    std::vector<std::string> words;
    for (const Value& row : *list) {
      const List* three = row.as_list();
      const bool is_choice = three && three->size() == 3 &&
                             std::all_of(three->begin(), three->end(), [](const Value& v) {
                               return v.as_string() && !text::trim(*v.as_string()).empty() &&
                                      v.as_string()->size() <= kLongestWord;
                             });
      if (!is_choice) return wrong("a branch must be a name and two words");
      for (const Value& v : *three) words.push_back(*v.as_string());
      for (std::size_t k = words.size() - 2; k < words.size(); ++k)
        for (std::size_t other = 0; other < k; ++other)
          if (other % 3 != 0 && words[other] == words[k])
            return wrong("two branches have the word " + text::quote(words[k]));
    }
    words_ = std::move(words);
    for (std::size_t i = 0; i + 2 < words_.size(); i += 3)
      choices_.push_back({words_[i].c_str(), words_[i + 1].c_str(), words_[i + 2].c_str(), {}});
    return {};
  }
  Result<std::vector<double>> measure_one(const Call& call_script, Impl& impl, lua_State* L,
                                          int model, int params, std::int32_t tip,
                                          std::span<const double> q) const {
    lua_settop(L, params);
    call_script.push_function(L, "branch");
    lua_pushvalue(L, model);
    push_vector(impl, L, q);
    lua_pushinteger(L, tip + 1);
    lua_pushvalue(L, params);
    RMP_TRY(call(impl, L, 4, 1));
    std::vector<double> out;
    if (lua_type(L, -1) == LUA_TNUMBER && choices_.size() == 1) {
      out = {lua_tonumber(L, -1)};
    } else {
      RMP_TRY_ASSIGN(out, read_finite(*p_, L, -1, choices_.size(), "the result of branch"));
    }
    for (const double x : out)
      if (!(std::fabs(x) <= 1 + 1e-9))
        return failed(*p_, "branch returned " + text::print(x) + ", which is not within -1 to 1",
                      "Its sign selects the branch; it is 0 where two branches meet.");
    return out;
  }
  /// Names of branches are an aside of an answer: without them it stands, and a message says why.
  void report(Impl& impl, const Error& e) const {
    const std::string said =
        "The branches of provider " + text::quote(p_->name) + " are not available: " + e.sentence();
    for (const Message& m : program_of(impl).app.messages.recent(20))
      if (m.text == said) return;
    program_of(impl).app.messages.post(Severity::warning, "branches", said, "lua");
  }

  /// One whole pose of one tip is for every solver; the rest for those that say so.
  Result<void> check(const IkBatch& b) const {
    const auto needs = [&](bool asked, const char* tag, const char* what) -> Result<void> {
      if (!asked || p_->has_tag(tag)) return {};
      return error(
          ErrorCode::unsupported,
          "provider " + text::quote(p_->name) + " does not declare support for " + what,
          std::string("If it does, write tags = {\"") + tag + "\"}; else choose another provider.");
    };
    RMP_TRY(needs(!is_whole(b), "goals", "several goals or parts of a pose"));
    RMP_TRY(needs(b.objective != IkObjective::none, "objectives", "objectives"));
    return needs(!b.arm_angles.empty(), "arm_angle", "arm angles");
  }

  static void push_seed(Impl& impl, lua_State* L, const IkBatch& batch, std::size_t i,
                        std::size_t n, const std::vector<double>& previous,
                        const RobotModel& model) {
    if (!previous.empty()) push_vector(impl, L, previous);
    else if (batch.seeds.size() >= (i + 1) * n) push_vector(impl, L, batch.seeds.subspan(i * n, n));
    else if (batch.seeds.size() >= n && n > 0) push_vector(impl, L, batch.seeds.first(n));
    else push_vector(impl, L, robotics::neutral_coordinates(model));
  }

  /// The script's fourth argument: how near, which tip, and what else is asked.
  static void push_question(Impl& impl, lua_State* L, const IkBatch& b, std::size_t i,
                            std::span<const Pose> targets,
                            const Borrowed<const Obstacles>& borrowed) {
    static constexpr const char* kObjectives[] = {"none", "centre", "manipulability", "limits",
                                                  "clearance"};
    lua_createtable(L, 0, 8);
    set_number(L, "position", b.tolerance.position);
    set_number(L, "rotation", b.tolerance.rotation);
    lua_pushinteger(L, (b.goals.empty() ? b.tip : b.goals[0].tip) + 1);
    lua_setfield(L, -2, "tip");
    lua_pushboolean(L, b.all_solutions ? 1 : 0);
    lua_setfield(L, -2, "all");
    set_text(L, "objective", kObjectives[static_cast<std::size_t>(b.objective)]);
    if (b.clearance) {
      borrowed.push_function<clearance>(L);
      lua_setfield(L, -2, "clearance");
    }
    if (!b.arm_angles.empty())
      set_number(L, "arm_angle", b.arm_angles[i < b.arm_angles.size() ? i : 0]);
    lua_createtable(L, static_cast<int>(b.goals.size()), 0);
    for (std::size_t g = 0; g < b.goals.size(); ++g) {
      lua_createtable(L, 0, 4);
      lua_pushinteger(L, b.goals[g].tip + 1);
      lua_setfield(L, -2, "tip");
      set_pose(impl, L, "target", targets[g]);
      set_number(L, "weight", b.goals[g].weight);
      set_directions(L, "parts", b.goals[g].parts);
      lua_rawseti(L, -2, static_cast<lua_Integer>(g + 1));
    }
    lua_setfield(L, -2, "goals");
  }

  /// clearance(q) -> distance, its gradient by the velocities. Valid within the call only.
  static Result<int> clearance(Impl& impl, lua_State* L) {
    RMP_TRY_ASSIGN(const Obstacles* obstacles, Borrowed<const Obstacles>::get(L));
    RMP_TRY_ASSIGN(const auto q, to_reals(L, 1, "q"));
    if (q.size() != obstacles->model->coordinate_count())
      return error(ErrorCode::invalid_argument,
                   "q has " + std::to_string(q.size()) + " numbers; " +
                       std::to_string(obstacles->model->coordinate_count()) + " are needed",
                   "Write clearance(q).");
    std::vector<double> gradient(obstacles->model->dof());
    lua_pushnumber(L, obstacles->field->distance(q, gradient));
    push_vector(impl, L, gradient);
    return 2;
  }

  /// The script's answer, judged by forward kinematics and the limits, not by its word.
  Result<void> read(lua_State* L, const IkBatch& batch, std::span<const Pose> targets,
                    IkResult& out) const {
    const std::size_t n = model_->coordinate_count();
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
        RMP_TRY_ASSIGN(auto q, read_finite(*p_, L, -1, n, "the solution"));
        lua_pop(L, 1);
        solutions.push_back(std::move(q));
        if (!batch.all_solutions) break;
      }
    } else {
      RMP_TRY_ASSIGN(auto q, read_finite(*p_, L, answer, n, "the solution"));
      solutions.push_back(std::move(q));
    }
    lua_settop(L, answer - 1);
    for (const auto& q : solutions) judge(q, batch, targets, out);
    if (solutions.empty()) out.detail = "the script returned no solution";
    return {};
  }

  void judge(const std::vector<double>& q, const IkBatch& batch, std::span<const Pose> targets,
             IkResult& out) const {
    std::vector<Pose> frames(model_->joints.size());
    robotics::forward_kinematics(*model_, q, frames);
    double dp = 0, dr = 0;
    if (is_whole(batch)) {  // parts of poses and several goals are judged by the caller
      const std::int32_t tip = batch.goals.empty() ? batch.tip : batch.goals[0].tip;
      const Pose reached = robotics::tip_pose(*model_, static_cast<std::size_t>(tip), frames);
      dp = spatial::distance(targets[0].p, reached.p);
      dr = spatial::norm(spatial::rotation_difference(reached.R, targets[0].R));
    }
    IkStatus status = IkStatus::solved;
    std::string detail;
    if (dp > batch.tolerance.position || dr > batch.tolerance.rotation) {
      status = IkStatus::not_converged;
      detail = "the script's solution misses the target by " + text::print_rounded(dp, 3) +
               " m and " + text::print_rounded(dr, 3) + " rad";
    } else if (const double gap = open_by(frames);
               gap > std::max(batch.tolerance.position, batch.tolerance.rotation)) {
      status = IkStatus::not_converged;
      detail = "the script's solution leaves loops open by " + text::print_rounded(gap, 3);
    } else if (const auto j = robotics::joint_outside_limits(*model_, q); j >= 0) {
      status = IkStatus::joint_limit;
      detail = "joint " + text::quote(model_->joints[static_cast<std::size_t>(j)].name) +
               " is outside its limits";
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
  [[nodiscard]] double open_by(std::span<const Pose> frames) const {
    std::vector<double> residual(robotics::loop_rows(*model_));
    robotics::loop_residual(*model_, frames, residual);
    double most = 0;
    for (const double x : residual) most = std::max(most, std::fabs(x));
    return most;
  }

  static constexpr std::size_t kLongestWord = 60;
  std::vector<std::string> words_;  ///< that choices_ points to
  std::vector<IkBranchChoice> choices_;
};

}  // namespace

RMP_LUA_PROVIDER(IkSolver, LuaIk, "solve");

}  // namespace robomosp::lua
