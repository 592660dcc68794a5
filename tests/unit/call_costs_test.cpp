// SPDX-License-Identifier: Apache-2.0
// How many allocations commands take that scripts call in loops, from Lua and back. Not timed: a
// time would be that of the machine.
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "kernel/literal.h"
#include "kernel/part_faults.h"
#include "lua/lua_state.h"
#include "support/allocations.h"

namespace robomosp {
namespace {

class CallCosts : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!ROBOMOSP_COUNTS_MEMORY) GTEST_SKIP() << "a sanitizer has its own operators";
    ioci::ApplicationOptions options;
    options.plugins = false;
    auto app = ioci::Application::create(options);
    ASSERT_TRUE(app.ok());
    app_ = std::move(*app);
    state_.emplace(*app_, session_);
  }
  void run(const std::string& code) {
    const auto done = state_->run_string(code, "test");
    ASSERT_TRUE(done.ok()) << done.error().sentence();
  }
  /// Of one call of many; `i` counts on.
  double allocations(const std::string& call) {
    const std::string loop = "for _ = 1, 200 do i = (i or 0) + 1 " + call + " end";
    run(loop);
    const std::size_t before = test::allocations;
    run(loop);
    return static_cast<double>(test::allocations - before) / 200;
  }

  std::unique_ptr<ioci::Application> app_;
  ioci::Session session_{"test"};
  std::optional<lua::LuaState> state_;
};

TEST_F(CallCosts, ACommandWithoutArguments) { EXPECT_LE(allocations("version()"), 3.5); }

TEST_F(CallCosts, ForwardKinematics) {
  run("arm = robot.create{name = 'arm', links = {{a = 0.4}, {a = 0.3, alpha = 1.5}, {a = 0.2}, {a "
      "= 0.1, alpha = 1}, {a = 0.1}, {a = 0.1}}}\nq = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6}");
  EXPECT_LE(allocations("arm:fk{q = q}"), 8.5);
}

/// Worlds of 100 and of 5,000 objects, each of its own solid.
constexpr const char* kWorlds = R"(
  function filled(count)
    local w, all = world.create{name = 'w' .. count}, {}
    ioci.transaction(function()
      for i = 1, count do
        all[i] = {what = solid.create{name = 's' .. count .. '_' .. i,
                  root = {kind = 'sphere', radius = 1}}, name = 'o' .. i, position = {i, 0, 0}}
      end
    end)
    w:add_objects(all)
    return w
  end
  few, many = filled(100), filled(5000)
  collectgarbage()
)";

TEST_F(CallCosts, WhatListsObjectsWorksAsMuchForEachOfManyAsOfFew) {
  run(kWorlds);
  for (const char* call : {"objects()", "describe()"}) {
    const auto of = [&](const std::string& world) {
      const std::string code = "collectgarbage('stop') local r = " + world + ":" + call +
                               " r = nil collectgarbage('restart') collectgarbage()";
      run(code);
      const std::size_t before = test::allocations;
      run(code);
      return static_cast<double>(test::allocations - before);
    };
    const double few = of("few"), many = of("many");
    EXPECT_LE(many, 50.5 * few) << call << " " << few << " " << many;
    EXPECT_GE(many, 25 * few) << call << " " << few << " " << many;
  }
}

TEST_F(CallCosts, LongAnswersAreNotCollectedAgainAndAgain) {
  run(kWorlds);
  // Each collection marks and sweeps every row that is alive. With the pause of Lua itself there
  // are 14 for 10 answers.
  run("local n, rest = 0, {}\n"
      "rest.__gc = function() n = n + 1 setmetatable({}, rest) end\n"
      "setmetatable({}, rest)\n"
      "for _ = 1, 10 do many:objects() end\n"
      "rest.__gc = nil\n"
      "assert(n >= 1 and n <= 7, n .. ' collections')");
}

TEST_F(CallCosts, AnObjectIsAddedToALargeWorldAsToASmallOne) {
  run("solid.create{name = 'brick', root = {kind = 'box', x = 1, y = 1, z = 1}}\n"
      "small, large = world.create{name = 'small'}, world.create{name = 'large'}\n"
      "local many = {} for i = 1, 10000 do many[i] = {what = 'brick', name = 'o' .. i} end\n"
      "large:add_objects(many)");
  const double few = allocations("small:add_object{what = 'brick', name = 'n' .. i}");
  EXPECT_LE(allocations("large:add_object{what = 'brick', name = 'n' .. i}"), few + 8);
}

/// The check of the parts of an argument beside the whole call; rows are of the busiest tables.
TEST_F(CallCosts, PartsAreCheckedOnceEachHoweverManyThereAre) {
  struct Table {
    const char *command, *argument, *row;
  };
  constexpr Table kTables[] = {
      {"robot.create", "links", "{a = 0.3, alpha = 0.5, d = 0.1}"},
      {"world.add_objects", "objects", "{what = \"brick\", name = \"o\", position = {1, 0, 0}}"},
      {"task.create", "steps", "{step = \"move\", pose = \"home\", speed = 0.5}"},
      {"trajectory.create", "segments",
       "{shape = \"line\", points = {{0, 0, 0}, {0.1, 0, 0}}, speed = 0.1}"}};
  for (const Table& t : kTables) {
    const ParamSpec& param = *find_param(app_->commands.find(t.command)->params, t.argument);
    const auto row = read_literal(t.row);
    ASSERT_TRUE(row.ok()) << row.error().sentence();
    const auto of = [&](std::size_t rows) {
      const Value all(List(rows, *row));
      EXPECT_TRUE(part_faults(param, all, t.argument).empty()) << t.command;
      const std::size_t before = test::allocations;
      (void)part_faults(param, all, t.argument);
      return static_cast<double>(test::allocations - before);
    };
    const double few = of(10), many = of(1000), most = of(20'000);
    std::cout << "Note: the parts of " << t.command << "{" << t.argument << "=} take " << most / 2e4
              << " allocations a row.\n";
    EXPECT_LE(many, 100 * few) << t.command;
    EXPECT_LE(most, 21 * many + 100) << t.command;  // longer paths
    EXPECT_LE(most / 2e4, 32) << t.command;
  }
}

TEST_F(CallCosts, AParameterIsAddedToALongChainAsToAShortOne) {
  run("s = solid.create{name = 'brick', root = {kind = 'box', x = 1, y = 1, z = 1}}\n"
      "s:set_parameter('p0', '1 mm')");
  const std::string add = "s:set_parameter('p' .. i, 'p' .. i - 1 .. ' + 1 mm')";
  const double few = allocations(add);
  for (int k = 0; k < 3; ++k) allocations(add);
  EXPECT_LE(allocations(add), few + 8);
}

}  // namespace
}  // namespace robomosp
