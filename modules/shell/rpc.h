// SPDX-License-Identifier: Apache-2.0
// JSON-RPC 2.0 over the command table: answers to single messages, and the loop over standard input
// and output (layer: application, shell).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "ioci/application.h"
#include "lua/lua_state.h"

namespace robomosp::shell {

/// Longest line that is read [bytes].
inline constexpr std::size_t kLongestLine = std::size_t{8} << 20;

/// Methods are the commands, plus "lua.eval" {code}. [application thread]
class RpcServer {
 public:
  RpcServer(ioci::Application& app, ioci::Session& session, lua::LuaState& lua)
      : app_(app), session_(session), lua_(lua) {}

  /// Answer to one line without its newline; nullopt when nothing is to be sent (notifications,
  /// blank lines).
  [[nodiscard]] std::optional<std::string> answer(std::string_view line);
  /// What a script printed since the last lua.eval; set LuaOptions::print to append here.
  std::string printed;
  /// Answer to a line that was longer than kLongestLine.
  [[nodiscard]] static std::string too_long();

 private:
  [[nodiscard]] std::optional<std::string> answer_one(const Value& message);
  [[nodiscard]] Result<Value> run(const std::string& method, const Value* params);
  [[nodiscard]] std::string success(const Value& id, const Value& result) const;
  [[nodiscard]] static std::string failure(const Value& id, int code, std::string_view message,
                                           const Error* data = nullptr);

  ioci::Application& app_;
  ioci::Session& session_;
  lua::LuaState& lua_;
};

/// Reads lines from descriptor `in`, answers on `out`, until the end of input, a `quit` command or
/// an interrupt. Returns the program's exit code.
int serve(ioci::Application& app, ioci::Session& session, RpcServer& server, int in, int out);

}  // namespace robomosp::shell
