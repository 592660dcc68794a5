// SPDX-License-Identifier: Apache-2.0
// What a Lua state in this process has beside its commands: the application itself, the solvers
// that its scripts provide, and those that came with records
// (layer: application, lua, internal).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "ioci/core/application.h"
#include "lua/internal.h"

namespace robomosp::lua {

class KeptScripts;

struct ProgramState final : LuaState::Impl {
  ProgramState(ioci::Application& a, ioci::Session& s, LuaOptions o);
  ~ProgramState() override;
  void catch_up() override;
  void before_close() override;
  [[nodiscard]] std::string record_hint(const std::string& name) override;
  Result<void> take_functions(lua_State*, const ioci::CommandSpec&, int table) override;

  ioci::Application& app;
  ioci::Session& session;
  std::vector<std::shared_ptr<LuaProvider>> providers;
  std::unique_ptr<KeptScripts> kept;  ///< those of them that came with records
  std::string plugin;                 ///< file of the plugin that is being run; "" = none
};

/// Of a state that provides, completes or runs kept scripts, which an untrusted one never does.
[[nodiscard]] inline ProgramState& program_of(LuaState::Impl& impl) {
  return static_cast<ProgramState&>(impl);
}
[[nodiscard]] inline const ProgramState& program_of(const LuaState::Impl& impl) {
  return static_cast<const ProgramState&>(impl);
}

}  // namespace robomosp::lua
