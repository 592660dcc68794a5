// SPDX-License-Identifier: Apache-2.0
// The Debug Adapter Protocol for programs of robots: messages with their length over two
// descriptors (layer: application, remote).
#pragma once

#include <functional>
#include <string_view>

#include "ioci/core/application.h"
#include "lua/lua_state.h"

namespace robomosp::remote {

/// Answers an editor on `in` and `out` until it disconnects, or the input ends. Gives the exit code
/// of the program: 0 where disconnect came before. `printed` is set to what takes the texts that
/// scripts print, as long as this lasts. [the session's thread; one more reads]
[[nodiscard]] int serve_debugger(ioci::Application& app, ioci::Session& session, lua::LuaState& lua,
                                 std::function<void(std::string_view)>& printed, int in, int out);

}  // namespace robomosp::remote
