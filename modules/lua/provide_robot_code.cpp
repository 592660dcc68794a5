// SPDX-License-Identifier: Apache-2.0
// Source code of robots written by Lua (layer: application, lua).
#include <robomosp/sdk/robot_code.h>

#include "kernel/text.h"
#include "lua/provide.h"

namespace robomosp::lua {
namespace {

/// fn(model, name, parts, params) -> {{name = "arm.m", text = "..."}, ...} | nil, reason. `parts`
/// has a field that is true for each part asked for.
class LuaRobotCode final : public RobotCodeGenerator {
 public:
  explicit LuaRobotCode(ProviderPtr p) : p_(std::move(p)) {}

  Result<std::vector<CodeFile>> generate(const RobotModel& model, std::string_view name,
                                         std::uint32_t parts, const Params& params,
                                         Progress&) const override {
    RMP_TRY(check_simple(*p_, model));
    std::vector<CodeFile> files;
    Call call_script(*p_);
    const auto ran = call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      call_script.push_function(L, "generate");
      push_model(impl, L, model, true);
      lua_pushlstring(L, name.data(), name.size());
      push_parts(L, parts);
      push_params(impl, L, p_->schema, params);
      RMP_TRY(call(impl, L, 4, 2));
      RMP_TRY(check_refusal(*p_, L, "robot " + text::quote(model.name)));
      RMP_TRY_ASSIGN(files, read_files(L, lua_gettop(L) - 1));
      return {};
    });
    if (!ran.ok()) return ran.error();
    return files;
  }

 private:
  static void push_parts(lua_State* L, std::uint32_t parts) {
    static constexpr std::pair<const char*, std::uint32_t> kParts[] = {
        {"forward_kinematics", kCodeForwardKinematics},
        {"jacobian", kCodeJacobian},
        {"inverse_dynamics", kCodeInverseDynamics},
        {"inertia", kCodeInertia},
        {"forward_dynamics", kCodeForwardDynamics}};
    lua_createtable(L, 0, 5);
    for (const auto& [word, bit] : kParts) {
      if (!(parts & bit)) continue;
      lua_pushboolean(L, 1);
      lua_setfield(L, -2, word);
    }
  }

  Result<std::vector<CodeFile>> read_files(lua_State* L, int index) const {
    constexpr const char* kHint = "Return {{name = \"arm.m\", text = \"...\"}}.";
    std::vector<CodeFile> files;
    const auto count = lua_istable(L, index) ? static_cast<lua_Integer>(luaL_len(L, index)) : 0;
    if (count == 0)
      return failed(*p_,
                    lua_istable(L, index)
                        ? std::string("the list of files is empty")
                        : std::string("the files are a ") + luaL_typename(L, index),
                    kHint);
    for (lua_Integer i = 1; i <= count; ++i) {
      CodeFile file;
      lua_geti(L, index, i);
      for (const auto& [field, out] :
           {std::pair("name", &file.name), std::pair("text", &file.text)}) {
        if (lua_istable(L, -1)) lua_getfield(L, -1, field);
        else lua_pushnil(L);
        if (lua_type(L, -1) != LUA_TSTRING)
          return failed(*p_, "file " + std::to_string(i) + " has no " + field, kHint);
        std::size_t size = 0;
        const char* text = lua_tolstring(L, -1, &size);
        out->assign(text, size);
        lua_pop(L, 1);
      }
      lua_pop(L, 1);
      files.push_back(std::move(file));
    }
    return files;
  }

  ProviderPtr p_;
};

}  // namespace

RMP_LUA_PROVIDER(RobotCodeGenerator, LuaRobotCode, "generate");

}  // namespace robomosp::lua
