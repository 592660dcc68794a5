// SPDX-License-Identifier: Apache-2.0
// Shared by the adapters from a script's functions to the SDK's interfaces: the call into the
// script, its arguments and results (layer: application, lua, internal).
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/robot_model.h>

#include "kernel/permit.h"
#include "kernel/schema.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "lua/internal.h"
#include "lua/kept_scripts.h"

namespace robomosp::lua {

using ProviderPtr = std::shared_ptr<LuaProvider>;

/// An error of the provider, with its interface and name.
[[nodiscard]] Error failed(const LuaProvider& p, std::string message, std::string hint = {});

/// One call into the script, on the thread of its state: calls from other threads are handed over
/// and waited for. Checks that the script still exists, restores the stack, reports a script's
/// error with the provider's name and the script's line.
class Call {
 public:
  /// `progress` may be null; cancelling it ends the wait for the script's thread.
  explicit Call(const LuaProvider& p, const Progress* progress = nullptr)
      : p_(p), progress_(progress) {}

  /// Runs `body` protected; it pushes, calls and reads results on the given thread.
  using Body = std::function<Result<void>(Impl&, lua_State*)>;
  Result<void> run(const Body& body) {
    if (p_.calls->is_owner()) return run_here(body);
    Result<void> done;
    const Permit* permit = current_permit();
    const auto handed = [&] {
      const PermitScope permitted(permit);
      done = run_here(body);
    };
    switch (
        p_.calls->call(handed, p_.patience, [&] { return progress_ && progress_->cancelled(); })) {
      case CallQueue::Outcome::done: return done;
      case CallQueue::Outcome::given_up:
        return error(ErrorCode::cancelled, "the call of a solver written in Lua was cancelled");
      case CallQueue::Outcome::closed: return gone();
      case CallQueue::Outcome::late: break;
    }
    return failed(p_,
                  "the provider is written in Lua, and its script was busy for " +
                      text::print(std::chrono::duration<double>(p_.patience).count()) + " s",
                  "Make the script wait for the job (job:wait()), or choose a compiled provider.");
  }
  /// Pushes the provider's function, or the field `name` of its table.
  void push_function(lua_State* L, const char* name) const {
    lua_rawgeti(L, LUA_REGISTRYINDEX, p_.ref);
    if (!lua_istable(L, -1)) return;
    lua_getfield(L, -1, name);
    lua_remove(L, -2);
  }
  /// Pushes the field `name` of its table if that is a function, else nothing.
  [[nodiscard]] bool push_optional(lua_State* L, const char* name) const {
    lua_rawgeti(L, LUA_REGISTRYINDEX, p_.ref);
    if (lua_istable(L, -1)) {
      lua_getfield(L, -1, name);
      lua_remove(L, -2);
      if (lua_isfunction(L, -1)) return true;
    }
    lua_pop(L, 1);
    return false;
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

  [[nodiscard]] Error gone() const {
    return failed(p_, "its script was closed or has withdrawn it",
                  "Run the script again or choose another provider.");
  }

  /// Restores the stack.
  struct Frame {
    explicit Frame(lua_State* state) : L(state), top(lua_gettop(state)) {}
    ~Frame() { lua_settop(L, top); }
    Frame(const Frame&) = delete;
    Frame& operator=(const Frame&) = delete;
    lua_State* const L;
    const int top;
  };

  Result<void> run_here(const Body& body) {
    AppLock::expect_free();
    if (!p_.state) return gone();
    Impl& impl = *p_.state;
    const Permit narrow = KeptScripts::permit(program_of(impl));
    const PermitScope permitted(p_.is_kept ? &narrow : current_permit());
    const Frame frame(impl.current ? impl.current : impl.main);
    lua_State* L = frame.L;
    if (!lua_checkstack(L, 40))
      return failed(p_, "the Lua stack is full", "Reduce the call depth.");
    Job job{&body, {}};
    lua_pushcfunction(L, entry<run_job>);
    lua_pushlightuserdata(L, &job);
    auto done = call(impl, L, 1, 0);
    if (!done.ok()) job.failed = std::move(done).error();
    if (!job.failed) return {};
    if (job.failed->code == ErrorCode::cancelled || job.failed->code == ErrorCode::plugin_failed ||
        job.failed->code == ErrorCode::unsupported)
      return std::move(*job.failed);
    const std::string at = job.failed->where.empty() ? "" : job.failed->where + ": ";
    return failed(
        p_, at + job.failed->message,
        job.failed->hint.empty() ? "Correct the script that provides it." : job.failed->hint);
  }

  const LuaProvider& p_;
  const Progress* progress_;
};

void push_vector(Impl& impl, lua_State* L, std::span<const double> v, const char* unit = "");
void set_number(lua_State* L, const char* name, double v);
void set_vector(Impl& impl, lua_State* L, const char* name, std::span<const double> v,
                const char* unit = "");
void set_pose(Impl& impl, lua_State* L, const char* name, const Pose& pose);
void set_text(lua_State* L, const char* name, std::string_view text);
/// The list of directions of `bits`: 1 2 3 = along x y z, 4 5 6 = turns about them.
void set_directions(lua_State* L, const char* name, std::uint32_t bits);
/// A 3 x 3 matrix.
void set_inertia(Impl& impl, lua_State* L, const Sym3& inertia);
/// Rejects robots in which entry i of q is not joint i, for providers with the tag "simple".
Result<void> check_simple(const LuaProvider& p, const RobotModel& model);
/// Converts the refusal `nil, reason` of a script's function to an error of code unsupported. The
/// two results are on top.
Result<void> check_refusal(const LuaProvider& p, lua_State* L, std::string where);
/// The table `model` of scripts, see docs/plugin_author/lua.md; gravity is zero if omitted.
void push_model(Impl& impl, lua_State* L, const RobotModel& model, bool with_gravity);
/// A body as passed to scripts by collision and physics: the list of its shapes.
void push_shapes(Impl& impl, lua_State* L, const ShapedBody& body);
void push_params(Impl& impl, lua_State* L, const Schema& schema, const Params& params);

/// The values of a schema, kept beyond the life of the Params they came from.
class Kept {
 public:
  Kept() = default;
  Kept(const Schema& schema, const Params& p) {
    Map m;
    for (const ParamSpec& s : schema) {
      if (!p.has(s.name)) continue;
      const std::string_view type = plain_type(s.type);
      if (type == "bool") m.set(s.name, p.boolean(s.name));
      else if (type == "int") m.set(s.name, static_cast<std::int64_t>(p.integer(s.name)));
      else if (type == "real") m.set(s.name, p.real(s.name));
      else if (type == "real[]" || type == "vec3")
        m.set(s.name, NumericArray({p.reals(s.name).begin(), p.reals(s.name).end()}, s.unit));
      else if (type == "pose") m.set(s.name, pose_value(p.pose(s.name)));
      else m.set(s.name, p.text(s.name));
    }
    params_ = make_params(std::move(m));
  }
  [[nodiscard]] const Params& get() const { return *params_; }

 private:
  std::unique_ptr<Params> params_ = make_params({});
};

/// A value of the script that an adapter keeps between calls, such as a prepared scene.
class KeptValue {
 public:
  explicit KeptValue(ProviderPtr p) : p_(std::move(p)) {}
  ~KeptValue() {
    // Withdrawn values are already released; values that end on another thread are released later.
    if (ref_ == LUA_NOREF || !p_->calls->is_owner() || !p_->state) return;
    luaL_unref(p_->state->main, LUA_REGISTRYINDEX, ref_);
    std::erase(p_->values, ref_);
  }
  KeptValue(const KeptValue&) = delete;
  KeptValue& operator=(const KeptValue&) = delete;
  /// Takes the value on top, once.
  void keep(lua_State* L) {
    ref_ = luaL_ref(L, LUA_REGISTRYINDEX);
    p_->values.push_back(ref_);
  }
  void push(lua_State* L) const { lua_rawgeti(L, LUA_REGISTRYINDEX, ref_); }

 private:
  ProviderPtr p_;
  int ref_ = LUA_NOREF;
};

/// A C++ object accessible to a function passed to a script, for one call; later calls of the
/// function return an error. Its stack slot must stay until the object ends.
template <class T>
class Borrowed {
 public:
  Borrowed(lua_State* L, T* object)
      : slot_(static_cast<T**>(lua_newuserdatauv(L, sizeof(T*), 0))), index_(lua_gettop(L)) {
    *slot_ = object;
  }
  ~Borrowed() { *slot_ = nullptr; }
  Borrowed(const Borrowed&) = delete;
  Borrowed& operator=(const Borrowed&) = delete;
  template <Function fn>
  void push_function(lua_State* L) const {
    lua_pushvalue(L, index_);
    lua_pushcclosure(L, entry<fn>, 1);
  }
  /// Within the function.
  static Result<T*> get(lua_State* L) {
    T* object = *static_cast<T**>(lua_touserdata(L, lua_upvalueindex(1)));
    if (object) return object;
    return error(ErrorCode::invalid_argument, "this function belongs to a call that has ended",
                 "Use it only within the solver that received it.");
  }

 private:
  T** slot_;
  int index_;
};

/// A list of poses.
void push_poses(Impl& impl, lua_State* L, std::span<const Pose> poses);
/// `duration` of a provider's table: a number, or a function of two values on the stack [s]; above
/// 0.
Result<double> read_duration(Call& call_script, Impl& impl, lua_State* L, const LuaProvider& p,
                             int first, int second);

/// `count` finite numbers at a stack index.
Result<std::vector<double>> read_finite(const LuaProvider& p, lua_State* L, int index,
                                        std::size_t count, const char* what);
Result<Vec3> read_vec3(const LuaProvider& p, lua_State* L, int index, const char* what);
Result<Pose> read_pose(const LuaProvider& p, lua_State* L, int index, const char* what);

/// State of adapters of a robot's solvers: the script, the model, the values of the parameters.
class BoundScript {
 public:
  explicit BoundScript(ProviderPtr p) : p_(std::move(p)) {}
  Result<void> bind(const RobotModel& model, const Params& params) {
    RMP_TRY(check_simple(*p_, model));
    model_ = &model;
    params_ = Kept(p_->schema, params);
    return {};
  }

 protected:
  ProviderPtr p_;
  const RobotModel* model_ = nullptr;
  Kept params_;
};

/// How a script provides an interface: registered by the file with its adapter (RMP_LUA_PROVIDER),
/// without a central list.
struct LuaInterface {
  const char* interface_id;
  const char* function;  ///< field of the table form that must be a function
  /// The adapter as void* to the interface class, as the registry expects.
  void* (*create)(ProviderPtr);
};
class LuaInterfaceFile {
 public:
  LuaInterfaceFile(const char* file, const LuaInterface& entry);
  /// By interface id.
  [[nodiscard]] static const std::vector<LuaInterface>& all();
  [[nodiscard]] static const std::vector<std::string>& files();
};
template <class Interface, class Adapter>
[[nodiscard]] LuaInterface lua_interface(const char* function) {
  return {Interface::kInterfaceId, function, [](ProviderPtr p) -> void* {
            return static_cast<Interface*>(new Adapter(std::move(p)));
          }};
}

}  // namespace robomosp::lua

/// RMP_LUA_PROVIDER(Wind, LuaWind, "blow"), at the end of a file: interface, adapter, function.
#define RMP_LUA_PROVIDER(Interface, Adapter, function)           \
  static const ::robomosp::lua::LuaInterfaceFile Adapter##_file( \
      __FILE__, ::robomosp::lua::lua_interface<Interface, Adapter>(function))
