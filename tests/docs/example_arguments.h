// SPDX-License-Identifier: Apache-2.0
// What the examples of commands call them with, for tests that call every command in their own way.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>

#include "docs/examples.h"
#include "lua/lua_state.h"

namespace robomosp::test {

/// The arguments that an example gives to its command; taken by a stand-in that then fails, so that
/// the document is as the command would find it.
inline std::optional<Map>& taken() {
  static std::optional<Map> one;
  return one;
}
inline Result<Value> take(ioci::CommandContext& ctx, const Map& args) {
  taken().emplace();
  for (const auto& [name, value] : args)
    if (const Value* given = ctx.given(name)) taken()->set(name, *given);
  return error(ErrorCode::cancelled, "taken");
}

/// Runs the example up to the first call of its command.
inline std::optional<Map> arguments_of(const ioci::CommandSpec& spec) {
  ioci::Application& app = examples_app();
  app.document.clear();
  for (const auto& [number, recording] : app.recordings.list()) app.recordings.remove(number);
  auto& open = const_cast<ioci::CommandSpec&>(spec);  // the table is this test's own
  const auto run = std::exchange(open.run, take);
  const auto effect = std::exchange(open.effect, Effects(Effect::reads));
  const auto sometimes = std::exchange(open.sometimes, Effects());
  taken().reset();
  {
    ioci::Session session("example");
    lua::LuaState lua(
        app, session,
        {.print = [](std::string_view) {},
         .module_path = {std::filesystem::path(ROBOMOSP_SOURCE_DIR) / "scripts/lib"}});
    (void)lua.run_string(spec.example, spec.name).ok();
  }
  open.run = run;
  open.effect = effect;
  open.sometimes = sometimes;
  return taken();
}

}  // namespace robomosp::test
