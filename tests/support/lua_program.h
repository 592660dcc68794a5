// SPDX-License-Identifier: Apache-2.0
// Fixture on the whole program with a Lua state, for commands as scripts give them.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "lua/lua_state.h"
#include "support/program.h"

namespace robomosp::test {

class LuaProgramTest : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    state_ = std::make_unique<lua::LuaState>(app(), session_, lua::LuaOptions{});
  }
  void run(std::string_view code) {
    auto r = state_->eval(code);
    ASSERT_TRUE(r.ok()) << r.error().sentence() << "\n" << code;
  }
  /// What the console would show: the value, or the sentence of the error.
  std::string eval(std::string_view code) {
    auto r = state_->eval(code);
    return r.ok() ? *r : r.error().sentence();
  }
  ioci::Session session_{"test"};
  std::unique_ptr<lua::LuaState> state_;
};

}  // namespace robomosp::test
