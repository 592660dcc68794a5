// SPDX-License-Identifier: Apache-2.0
// Which arguments are secrets, and a command as a line of Lua without them: what logs, events and
// recorded macros show (layer: application).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "kernel/value.h"

namespace robomosp::ioci {

class Application;
struct CommandSpec;

/// The rule of secrets: an argument, or an entry of a map within one at any depth, is a secret when
/// one of the words of its name is token, password, passphrase, secret or credential, in any case,
/// and the last one is not file. So `token` and `api_token` are, `token_file` is not. What holds a
/// secret must be named so. [any thread]
[[nodiscard]] bool is_secret(std::string_view argument);
/// Stands where a secret was.
inline constexpr std::string_view kRedacted = "(secret)";
/// Whether there are secrets among arguments, at any depth.
[[nodiscard]] bool has_secrets(const Map& args);
/// The arguments with kRedacted in place of secrets.
[[nodiscard]] Map without_secrets(const Map& args);

/// A value as Lua that gives it back: handles by the names of their records, else as "robot#17".
/// Numbers that are not finite become 1/0, -1/0 and 0/0. It stops soon after `most` bytes.
[[nodiscard]] std::string lua_text(const Application&, const Value&,
                                   std::size_t most = static_cast<std::size_t>(-1));

struct LuaLine {
  std::string text;
  bool is_whole = true;  ///< it can be run: no secret was in it, and it was not too long
};
/// A call of a command as one line of Lua, `robot.set_link{id = "pa10", link = 3, lower = -1}`,
/// without its secrets; cut when it is longer than about `most` bytes.
[[nodiscard]] LuaLine lua_line(const Application&, const CommandSpec&, const Map& args,
                               std::size_t most = std::size_t{64} << 10);

}  // namespace robomosp::ioci
