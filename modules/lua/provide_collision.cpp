// SPDX-License-Identifier: Apache-2.0
// Collision written in Lua (layer: application, lua).
#include <algorithm>
#include <cmath>

#include <robomosp/sdk/collision.h>

#include "kernel/text.h"
#include "lua/provide.h"
#include "spatial/vec.h"

namespace robomosp::lua {
namespace {

/// The nearest points lie this much beside the distance at most, as a share of it and [m].
constexpr double kAgreement = 1e-6;
/// Asked when only a touch is asked for: what is farther need not be known [m].
constexpr double kNearby = 1e-6;

class LuaScene final : public CollisionScene {
 public:
  LuaScene(ProviderPtr p, const Params& params)
      : p_(std::move(p)), params_(p_->schema, params), bodies_(p_) {}

  /// Keeps of each body what the script's `prepare` makes of it, or its list of shapes.
  Result<void> prepare(std::span<const ShapedBody> bodies, Progress& progress) {
    Call call_script(*p_);
    return call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      push_params(impl, L, p_->schema, params_.get());
      lua_createtable(L, static_cast<int>(bodies.size()), 0);
      for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (progress.cancelled()) return error(ErrorCode::cancelled, "collision was cancelled");
        is_empty_.push_back(bodies[i].shapes.empty());
        if (call_script.push_optional(L, "prepare")) {
          push_shapes(impl, L, bodies[i]);
          lua_pushvalue(L, 1);
          RMP_TRY(call(impl, L, 2, 2));
          RMP_TRY(check_refusal(*p_, L, "body " + std::to_string(i + 1)));
          lua_pop(L, 1);
        } else {
          push_shapes(impl, L, bodies[i]);
        }
        lua_rawseti(L, 2, static_cast<lua_Integer>(i + 1));
      }
      bodies_.keep(L);
      return {};
    });
  }

  Result<void> distances(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                         double interest, std::span<PairDistance> out,
                         Progress& progress) const override {
    return each(poses, pairs, progress, [&](Asked& a) -> Result<void> {
      if (is_empty_[a.a] || is_empty_[a.b]) {
        out[a.index] = {interest, {}, {}};
        return {};
      }
      RMP_TRY_ASSIGN(out[a.index], distance(a, interest));
      return {};
    });
  }

  Result<void> collisions(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                          std::span<std::uint8_t> out, Progress& progress) const override {
    return each(poses, pairs, progress, [&](Asked& a) -> Result<void> {
      out[a.index] = 0;
      if (is_empty_[a.a] || is_empty_[a.b]) return {};
      if (!a.call.push_optional(a.L, "touches")) {
        RMP_TRY_ASSIGN(const PairDistance d, distance(a, kNearby));
        out[a.index] = d.distance <= 0 ? 1 : 0;
        return {};
      }
      push_pair(a);
      lua_pushvalue(a.L, a.params);
      RMP_TRY(call(a.impl, a.L, 5, 1));
      if (!lua_isboolean(a.L, -1))
        return failed(*p_, "touches returned " + names(a) + " with a " + luaL_typename(a.L, -1),
                      "Return true or false.");
      out[a.index] = lua_toboolean(a.L, -1) ? 1 : 0;
      return {};
    });
  }

 private:
  /// One pair of one sample on the way through a call.
  struct Asked {
    const Call& call;
    Impl& impl;
    lua_State* L;
    int params, bodies, placed;  ///< stack indices of tables
    std::size_t a, b;            ///< bodies
    std::size_t index;           ///< of the answer
  };

  template <class Answer>
  Result<void> each(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                    Progress& progress, const Answer& answer) const {
    const std::size_t count = is_empty_.size(), samples = count == 0 ? 0 : poses.size() / count;
    Call call_script(*p_);
    return call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      push_params(impl, L, p_->schema, params_.get());
      bodies_.push(L);
      for (std::size_t i = 0; i < samples; ++i) {
        progress.report(static_cast<double>(i) / static_cast<double>(samples), "collision in Lua");
        lua_settop(L, 2);
        lua_createtable(L, static_cast<int>(count), 0);
        for (std::size_t b = 0; b < count; ++b) {
          push(impl, L, pose_value(poses[i * count + b]));
          lua_rawseti(L, 3, static_cast<lua_Integer>(b + 1));
        }
        for (std::size_t k = 0; k < pairs.size(); ++k) {
          if (k % 64 == 0 && progress.cancelled())
            return error(ErrorCode::cancelled, "collision was cancelled");
          lua_settop(L, 3);
          Asked asked{call_script,
                      impl,
                      L,
                      1,
                      2,
                      3,
                      static_cast<std::size_t>(pairs[k].a),
                      static_cast<std::size_t>(pairs[k].b),
                      i * pairs.size() + k};
          RMP_TRY(answer(asked));
        }
      }
      return {};
    });
  }

  static std::string names(const Asked& a) {
    return "bodies " + std::to_string(a.a + 1) + " and " + std::to_string(a.b + 1);
  }
  static void push_pair(const Asked& a) {
    for (const int table : {a.bodies, a.placed}) {
      lua_rawgeti(a.L, table, static_cast<lua_Integer>(a.a + 1));
      lua_rawgeti(a.L, table, static_cast<lua_Integer>(a.b + 1));
    }
  }

  Result<PairDistance> distance(const Asked& a, double interest) const {
    lua_State* L = a.L;
    a.call.push_function(L, "distance");
    push_pair(a);
    lua_pushnumber(L, interest);
    lua_pushvalue(L, a.params);
    RMP_TRY(call(a.impl, L, 6, 3));
    constexpr const char* kHint = "Return a distance [m] and the nearest points of either body.";
    PairDistance d;
    d.distance = lua_type(L, -3) == LUA_TNUMBER ? lua_tonumber(L, -3) : std::nan("");
    if (std::isnan(d.distance) || d.distance == -HUGE_VAL)
      return failed(*p_,
                    "the distance of " + names(a) + " is " +
                        (lua_type(L, -3) == LUA_TNUMBER ? text::print(d.distance)
                                                        : "a " + std::string(luaL_typename(L, -3))),
                    kHint);
    if (d.distance >= interest) return PairDistance{interest, {}, {}};
    if (lua_isnil(L, -2) || lua_isnil(L, -1))
      return failed(*p_, "the distance of " + names(a) + " was returned without nearest points",
                    kHint);
    RMP_TRY_ASSIGN(d.on_a, read_vec3(*p_, L, -2, "the nearest point of the first body"));
    RMP_TRY_ASSIGN(d.on_b, read_vec3(*p_, L, -1, "the nearest point of the second body"));
    const double apart = spatial::distance(d.on_a, d.on_b);
    const bool no_depth = d.distance <= 0 && apart <= kAgreement;
    if (!no_depth &&
        std::fabs(apart - std::fabs(d.distance)) > kAgreement * std::max(1.0, std::fabs(apart)))
      return failed(*p_,
                    "the distance of " + names(a) + " is " + text::print_rounded(d.distance) +
                        " m but their nearest points are " + text::print_rounded(apart) +
                        " m apart",
                    kHint);
    return d;
  }

  ProviderPtr p_;
  Kept params_;
  KeptValue bodies_;
  std::vector<bool> is_empty_;
};

/// fn(a, b, world_T_a, world_T_b, interest, params) -> distance, point on a, point on b; or
/// {distance = fn, prepare = fn(shapes, params) -> what the others are given as a and b,
/// touches = fn(a, b, world_T_a, world_T_b, params) -> boolean}.
class LuaCollision final : public CollisionEngine {
 public:
  explicit LuaCollision(ProviderPtr p) : p_(std::move(p)) {}
  Result<std::unique_ptr<CollisionScene>> build(std::span<const ShapedBody> bodies,
                                                const Params& params,
                                                Progress& progress) const override {
    auto scene = std::make_unique<LuaScene>(p_, params);
    RMP_TRY(scene->prepare(bodies, progress));
    return std::unique_ptr<CollisionScene>(std::move(scene));
  }

 private:
  ProviderPtr p_;
};

}  // namespace

RMP_LUA_PROVIDER(CollisionEngine, LuaCollision, "distance");

}  // namespace robomosp::lua
