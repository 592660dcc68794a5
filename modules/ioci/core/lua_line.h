// SPDX-License-Identifier: Apache-2.0
// Commands as lines of Lua without their secrets, as events and recorded macros show them (layer:
// application).
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "kernel/value.h"

namespace robomosp::ioci {

class Application;
struct CommandSpec;

/// The reserved words of Lua 5.4.
inline constexpr std::array<std::string_view, 22> kLuaKeywords{
    "and",      "break",  "do",   "else", "elseif", "end",  "false", "for",
    "function", "goto",   "if",   "in",   "local",  "nil",  "not",   "or",
    "repeat",   "return", "then", "true", "until",  "while"};

/// A value as Lua that gives it back: handles by the names of their records, with the kind where
/// others have the name ("world:cell"), else as "robot#17".
/// Numbers that are not finite become 1/0, -1/0 and 0/0. It stops soon after `most` bytes.
[[nodiscard]] std::string lua_text(const Application&, const Value&,
                                   std::size_t most = static_cast<std::size_t>(-1));

/// The same without the document: handles become "robot#17".
[[nodiscard]] std::string lua_text(const Value&, std::size_t most = static_cast<std::size_t>(-1));
/// Whether a name can be a key of a table without brackets.
[[nodiscard]] bool is_lua_key(std::string_view);

struct LuaLine {
  std::string text;
  bool is_whole = true;  ///< it can be run: no secret was in it, and it was not too long
};
/// A call of a command as one line of Lua, `robot.set_link{id = "pa10", link = 3, lower = -1}`,
/// without its secrets; cut when it is longer than about `most` bytes.
[[nodiscard]] LuaLine lua_line(const Application&, const CommandSpec&, const Map& args,
                               std::size_t most = std::size_t{64} << 10);

}  // namespace robomosp::ioci
