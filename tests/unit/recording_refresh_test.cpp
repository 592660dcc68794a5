// SPDX-License-Identifier: Apache-2.0
// Recordings that know how they were made: made again after edits, by hand or by themselves.
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "ioci/core/origins.h"
#include "ioci/core/watchers.h"
#include "lua/lua_state.h"
#include "support/program.h"

namespace robomosp::lua {
namespace {

namespace fs = std::filesystem;

class RecordingRefresh : public test::ProgramTest {
 protected:
  void SetUp() override {
    (void)app().watchers->settle();
    ProgramTest::SetUp();
    for (const auto& [number, r] : app().recordings.list()) app().recordings.remove(number);
    (void)app().watchers->remove([](const ioci::WatchStatus&) { return true; });
    folder_ = fs::temp_directory_path() / ("recording-refresh-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    LuaOptions options;
    options.print = [](std::string_view) {};
    state_ = std::make_unique<LuaState>(app(), session_, options);
    run("file = function(name) return '" + folder_.string() + "/' .. name end");
  }
  void TearDown() override {
    (void)app().watchers->settle();
    (void)app().watchers->remove([](const ioci::WatchStatus&) { return true; });
    state_.reset();
    fs::remove_all(folder_);
  }
  void run(const std::string& code) {
    const auto r = state_->run_string(code, "test.lua");
    EXPECT_TRUE(r.ok()) << code << "\n" << (r.ok() ? "" : r.error().sentence());
  }
  std::string eval(const std::string& code) {
    const auto r = state_->eval(code);
    return r.ok() ? *r : "error: " + r.error().sentence();
  }
  /// An arm that swings, in a cell with a stroke, a box and a task.
  void make_cell() {
    run(R"(
      arm = robot.create{name = "arm", convention = "dh", links = {
        {a = 0.5, lower = -3, upper = 3, mass = 1, com = {-0.25, 0, 0}},
        {a = 0.4, lower = -3, upper = 3, mass = 1, com = {-0.2, 0, 0}}},
        poses = {ready = {0.3, 0.8}}}
      material.create{name = "wood", density = 600}
      solid.create{name = "box", material = "wood", root = {kind = "box", x = 0.1, y = 0.1, z = 0.1}}
      cell = world.create{name = "cell"}
      cell:add_robot{robot = arm, q = "ready"}
      cell:add_object{what = "box", position = {0, 0, 2}}
      local p = arm:fk{q = "ready"}
      local x, a = p.position, p.rpy
      trajectory.create{name = "stroke", sample_time = 0.05, segments = {{shape = "line", points = {
        {x[1], x[2], x[3], a[1], a[2], a[3]}, {x[1] - 0.02, x[2], x[3], a[1], a[2], a[3]}}}}}
      trajectory.create{name = "swing", sample_time = 0.05, segments = {{shape = "ptp",
        joints = {{0.3, 0.8}, {0.5, 0.6}}}}}
      cell:add_trajectory{trajectory = "stroke"}
      cell:add_trajectory{trajectory = "swing"}
      task.create{name = "shift", steps = {{step = "move", pose = "ready", duration = 2}}}
      cell:add_task{task = "shift", robot = "arm"})");
  }
  bool told(const std::string& code, const std::string& part) {
    for (const Message& m : app().messages.recent(1000))
      if (m.code == code && m.text.find(part) != std::string::npos) return true;
    return false;
  }
  std::string bytes(const char* name) const {
    std::ifstream in(folder_ / name, std::ios::binary);
    return std::string((std::istreambuf_iterator<char>(in)), {});
  }
  ioci::Session session_{"test"};
  std::unique_ptr<LuaState> state_;
  fs::path folder_;
};

TEST_F(RecordingRefresh, EveryKindOfRecordingIsMadeAgainFromTheRecordsOfNow) {
  make_cell();
  // How it is made, and an edit that must change it.
  const std::pair<const char*, const char*> kinds[] = {
      {"arm:simulate{q = 'ready', qd = {1, -0.5}, duration = 0.1}",
       "arm:set_link{link = 2, mass = 2}"},
      {"cell:simulate_dynamics{robot = 'arm', qd = {1, -0.5}, duration = 0.1}",
       "arm:set_link{link = 2, a = 0.3}"},
      {"cell:simulate_physics{duration = 0.1}", "cell:place{member = 'box', position = {0, 0, 1}}"},
      {"trajectory.record('swing_line', {step = 0.05})",
       "trajectory.set_segment('swing_line', 1, {speed = 0.5})"},
      {"cell:forward_kinematics{robot = 'arm', trajectory = 'swing'}",
       "arm:set_link{link = 2, a = 0.35}"},
      {"arm:workspace{samples = 2000}", "arm:set_link{link = 2, a = 0.2}"},
      {"arm:joint_slice{count = 10}", "arm:set_link{link = 2, a = 0.25}"},
      {"cell:run_task{task = 'shift'}", "arm:set_pose{name = 'ready', q = {0.4, 0.7}}"}};
  run("trajectory.create{name = 'swing_line', segments = {{shape = 'line', points = "
      "{{0, 0, 0}, {1, 0, 0}}}}}");
  for (const auto& [make, edit] : kinds) {
    SCOPED_TRACE(make);
    const std::string before =
        eval("r = " + std::string(make) +
             "; if type(r) == 'table' then r = r.recording end; n = #r:columns()");
    ASSERT_EQ(before.find("error"), std::string::npos) << before;
    EXPECT_EQ(eval("r:is_stale().stale"), "false");
    EXPECT_EQ(eval("r:refresh().made"), "false");
    run("save = function(name) r:save(file(name)) end; save('before.rec')");
    ASSERT_EQ(eval(edit).find("error"), std::string::npos) << eval(edit);
    EXPECT_EQ(eval("r:is_stale().stale"), "true");
    EXPECT_EQ(eval("#r:is_stale().changed > 0"), "true");
    EXPECT_NE(eval("#r:notes() > 0 and r:notes()[#r:notes()]").find("It is older than"),
              std::string::npos);
    EXPECT_EQ(eval("r:refresh().made"), "true") << eval("r:refresh()");
    EXPECT_EQ(eval("r:is_stale().stale"), "false");
    run("save('after.rec')");
    EXPECT_TRUE(bytes("before.rec") != bytes("after.rec"));
    // The same as what a new one is.
    run("f = " + std::string(make) + "; if type(f) == 'table' then f = f.recording end");
    run("f:save(file('fresh.rec')); f:remove()");
    EXPECT_TRUE(bytes("after.rec") == bytes("fresh.rec"));
    // Undo brings the old one back, bit for bit.
    run("document.undo(); r:refresh(); save('undone.rec')");
    EXPECT_TRUE(bytes("undone.rec") == bytes("before.rec"));
    run("r:remove()");
  }
  EXPECT_EQ(app().recordings.list().size(), 0U);  // no second ones were left
}

TEST_F(RecordingRefresh, AddedColumnsAreAddedAgain) {
  make_cell();
  run("r = arm:simulate{q = 'ready', qd = {1, -0.5}, duration = 0.1}; r:compute{'power'}; "
      "r:watch{name = 'twice', expression = '2*q1', unit = 'rad'}");
  run("names = {}; for i, c in ipairs(r:columns()) do names[i] = c.name end");
  run("arm:set_link{link = 2, mass = 3}; assert(r:refresh().made)");
  EXPECT_EQ(
      eval("same = true; for i, c in ipairs(r:columns()) do same = same and c.name == names[i] "
           "end; return same and #names == #r:columns()"),
      "true");
  EXPECT_EQ(eval("math.abs(r:values('twice')[5] - 2 * r:values('q1')[5]) < 1e-12"), "true");
}

TEST_F(RecordingRefresh, WhatCannotBeMadeAgainSaysWhy) {
  make_cell();
  run("r = arm:simulate{q = 'ready', qd = {1, -0.5}, duration = 0.1}; r:save(file('run.rec')); "
      "old = recording.load(file('run.rec'))");
  EXPECT_NE(eval("old:refresh()").find("it was read from the file"), std::string::npos);
  EXPECT_NE(eval("old:follow()").find("it was read from the file"), std::string::npos);
  EXPECT_EQ(eval("old:is_stale().stale"), "false");
  EXPECT_EQ(eval("old:is_stale().can_refresh"), "false");
  run("live = arm:start_run('dynamics', {q = 'ready', qd = {1, -0.5}, duration = 0.1}); "
      "live:finish(); "
      "part = live:recording()");
  EXPECT_NE(eval("part:refresh()").find("live run"), std::string::npos);
  EXPECT_NE(
      eval("arm:start_run('dynamics', {q = 'ready', qd = {1, -0.5}, duration = 0.1, watch = true})")
          .find("a live run cannot be watched"),
      std::string::npos);
  const std::uint64_t foreign = app().recordings.add(app().recordings.list().front().second);
  EXPECT_NE(eval("recording.refresh('recording#" + std::to_string(foreign) + "')")
                .find("no command of this run made it"),
            std::string::npos)
      << eval("recording.refresh('recording#" + std::to_string(foreign) + "')");
  run("alone = robot.create{name = 'alone', convention = 'dh', links = {{a = 1, mass = 1}}}; "
      "gone = alone:simulate{q = {0}, duration = 0.1}; alone:remove()");
  EXPECT_NE(eval("gone:is_stale().changed[1]").find("robot \"alone\" is gone"), std::string::npos);
  const std::string said = eval("gone:refresh()");
  EXPECT_NE(said.find("cannot be made again: robot \"alone\" is gone"), std::string::npos) << said;
  run("document.undo(); assert(not gone:is_stale().stale)");
  // Saving a record is no change of what it is.
  run("arm:save(file('arm.rbt'))");
  EXPECT_EQ(eval("r:is_stale().stale"), "false");
  // What is compared or drawn while it is old says so.
  run("arm:set_link{link = 2, mass = 4}; r:plot{columns = 'q1'}");
  EXPECT_TRUE(told("stale_recording", "recording.plot: recording#"));
  run("r:compare{with = old}");
  EXPECT_TRUE(told("stale_recording", "recording.compare: recording#"));
}

TEST_F(RecordingRefresh, WatchedRecordingsAndFilesFollowEdits) {
  make_cell();
  run("r = arm:simulate{q = 'ready', qd = {1, -0.5}, duration = 0.1, watch = true}; "
      "r:plot{file = file('run.svg'), columns = {'q1', 'q2'}, watch = true}; "
      "page = r:replay{file = file('run.html'), watch = true}; "
      "trajectory.plot{id = 'stroke', file = file('stroke.svg'), watch = true}");
  EXPECT_EQ(eval("#recording.watched()"), "4");
  const std::string plot = bytes("run.svg"), page = bytes("run.html"), stroke = bytes("stroke.svg");
  EXPECT_NE(page.find("data-reload=\"2000\""), std::string::npos);
  run("arm:set_link{link = 2, mass = 5}");
  EXPECT_EQ(eval("#recording.watched{wait = true}"), "4");
  EXPECT_EQ(eval("r:is_stale().stale"), "false");
  EXPECT_TRUE(bytes("run.svg") != plot);
  EXPECT_TRUE(bytes("run.html") != page);
  EXPECT_TRUE(bytes("stroke.svg") == stroke);  // nothing of it changed
  EXPECT_NE(bytes("run.html").find("data-reload"), std::string::npos);
  run("document.undo(); recording.watched{wait = true}");
  EXPECT_TRUE(bytes("run.svg") == plot);
  run("document.redo(); recording.watched{wait = true}");
  EXPECT_TRUE(bytes("run.svg") != plot);
  run("document.undo(); trajectory.set{id = 'stroke', sample_time = 0.02}; "
      "recording.watched{wait = true}");
  EXPECT_TRUE(bytes("stroke.svg") != stroke);
  // Ended, nothing follows.
  EXPECT_EQ(eval("recording.unwatch{file = file('run.svg')}"), "1");
  EXPECT_NE(eval("recording.unwatch{file = file('run.svg')}").find("is not watched"),
            std::string::npos);
  EXPECT_EQ(eval("recording.unwatch()"), "3");
  const std::string last = bytes("run.html");
  run("arm:set_link{link = 2, mass = 6}; recording.watched{wait = true}");
  EXPECT_TRUE(bytes("run.html") == last);
  EXPECT_EQ(eval("r:is_stale().stale"), "true");
  // Without a file there is nothing to keep.
  EXPECT_NE(eval("r:plot{columns = 'q1', watch = true}").find("no file"), std::string::npos);
}

TEST_F(RecordingRefresh, PostsFollowEdits) {
  const auto source = [](const char* speed) {
    return std::string(
               "[[\nPROGRAM lift;\nVAR\n  POSE: place := POSE(POSITION(500.0, 0.0, 120.0), "
               "ORIZYX(0.0, 180.0, 0.0));\nBEGIN\n  MOVE LIN place SPEED := ") +
           speed + ";\nENDPROGRAM;\n]]";
  };
  run("lift = program.create{name = 'lift', source = " + source("80.0") + "}");
  EXPECT_NE(eval("lift:post{target = 'krl', watch = true}").find("no files are written"),
            std::string::npos);
  run("lift:post{target = 'krl', folder = file('.'), watch = true}");
  EXPECT_EQ(eval("#recording.watched()"), "1");
  const std::string first = bytes("LIFT.src");
  EXPECT_NE(first.find("0.08"), std::string::npos) << first;
  run("lift:set_file{name = 'lift.irl', text = " + source("90.0") +
      "}; recording.watched{wait = true}");
  EXPECT_EQ(eval("recording.watched()[1].state"), "current")
      << eval("recording.watched()[1].fault");
  EXPECT_NE(bytes("LIFT.src").find("0.09"), std::string::npos) << bytes("LIFT.src");
  run("document.undo(); recording.watched{wait = true}");
  EXPECT_TRUE(bytes("LIFT.src") == first);
}

TEST_F(RecordingRefresh, FailuresAreMessagesAndEndWhenTheirCauseDoes) {
  make_cell();
  run("r = arm:simulate{q = 'ready', qd = {1, -0.5}, duration = 0.1, watch = true}; "
      "r:plot{file = file('run.svg'), columns = 'q1', watch = true}");
  const std::string plot = bytes("run.svg");
  // An edit after which it cannot be computed succeeds.
  EXPECT_EQ(eval("arm:remove_pose{name = 'ready'}").find("error"), std::string::npos)
      << eval("arm:remove_pose{name = 'ready'}");
  EXPECT_EQ(eval("recording.watched{wait = true}[1].state"), "failed");
  EXPECT_NE(eval("recording.watched()[1].fault").find("cannot be made again"), std::string::npos);
  EXPECT_TRUE(told("watch", "could not follow the last edit"));
  EXPECT_TRUE(bytes("run.svg") == plot);
  run("document.undo(); recording.watched{wait = true}");
  EXPECT_EQ(eval("recording.watched()[1].state"), "current");
  EXPECT_EQ(eval("recording.watched()[2].state"), "current");
  EXPECT_EQ(eval("recording.watched()[1].fault"), "");
  // A recording that is removed takes what draws it along; a cleared document all.
  run("r:remove(); arm:set_link{link = 2, mass = 2}; recording.watched{wait = true}");
  EXPECT_EQ(eval("#recording.watched()"), "0");
  run("r = arm:simulate{q = 'ready', qd = {1, -0.5}, duration = 0.1, watch = true}; "
      "document.clear()");
  EXPECT_EQ(eval("#recording.watched()"), "0");
  EXPECT_TRUE(told("watch", "The document was cleared"));
}

TEST_F(RecordingRefresh, GesturesAreFollowedWhenTheyEnd) {
  make_cell();
  run("r = arm:simulate{q = 'ready', qd = {1, -0.5}, duration = 0.1, watch = true}; first = "
      "r:values('q2')[11]");
  run("g = gesture.begin('mass'); for m = 2, 20 do gesture.update{gesture = g, command = "
      "'robot.set_link', arguments = {id = 'arm', link = 2, mass = m}} end");
  run("recording.watched{wait = true}");
  EXPECT_EQ(eval("r:values('q2')[11] == first"), "true");
  run("gesture.commit(g); recording.watched{wait = true}");
  EXPECT_EQ(eval("r:values('q2')[11] == first"), "false");
  EXPECT_EQ(eval("r:is_stale().stale"), "false");
  run("document.undo(); recording.watched{wait = true}");
  EXPECT_EQ(eval("r:values('q2')[11] == first"), "true");
}

TEST_F(RecordingRefresh, AHundredWatchersFollowManyEditsAndTheLastOneWins) {
  make_cell();
  run("all = {}; for i = 1, 100 do all[i] = arm:simulate{q = {0.01 * i, 0}, qd = {1, -0.5}, "
      "duration = 0.05, watch "
      "= "
      "true} end");
  EXPECT_EQ(eval("#recording.watched()"), "100");
  run("for m = 1, 50 do arm:set_link{link = 2, mass = m} end");
  EXPECT_EQ(eval("#recording.watched{wait = true}"), "100");
  run("new = arm:simulate{q = {1, 0}, qd = {1, -0.5}, duration = 0.05}");
  EXPECT_EQ(eval("all[100]:values('q2')[6] == new:values('q2')[6]"), "true");
  EXPECT_EQ(eval("for i = 1, 100 do if all[i]:is_stale().stale then return i end end"), "");
  EXPECT_EQ(
      eval("n = 0; for _, w in ipairs(recording.watched()) do if w.state == 'current' then n = "
           "n + 1 end end; return n"),
      "100");
}

TEST_F(RecordingRefresh, AnEditWithoutWatchersCostsWhatItDid) {
  make_cell();
  const auto cost = [&](int edits) {
    const auto begin = std::chrono::steady_clock::now();
    run("for i = 1, " + std::to_string(edits) +
        " do material.set{id = 'wood', density = 600 + i} end");
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() / edits;
  };
  cost(200);
  const double without = cost(2000);
  run("r = arm:simulate{q = 'ready', qd = {1, -0.5}, duration = 0.05}");  // a recording that nobody
                                                                          // watches
  const double beside = cost(2000);
  RecordProperty("microseconds_without", std::to_string(1e6 * without));
  RecordProperty("microseconds_beside", std::to_string(1e6 * beside));
  EXPECT_LT(beside, 5 * without + 1e-4);  // nothing is looked at, whatever else the machine does
}

TEST_F(RecordingRefresh, ValuesOfOnesOwnMakeARecordingLikeAnyOther) {
  run(R"(
    own = recording.create{title = "own", columns = {
      {name = "angle", unit = "deg", values = {0, 90, 180}, doc = "of the crank"},
      {name = "way", values = array({1, 2, 3}, "m")},
      {name = "q", unit = "rad", values = {{0, 1}, {2, 3}, {4, 5}}},
      {name = "count", values = linalg.ones(3, 1)}}}
    names = {}
    for i, c in ipairs(own:columns()) do names[i] = c.name .. " [" .. c.unit .. "]" end
    assert(table.concat(names, " ") == "angle [rad] way [m] q1 [rad] q2 [rad] count1 []")
    assert(math.abs(own:values("angle")[3] - math.pi) < 1e-15)
    assert(own:values("q2")[2] == 3)
    assert(own:columns()[1].doc == "of the crank")
    own:save(file("own.rec"))
    assert(recording.load(file("own.rec")):values("q1")[3] == 4)
    own:csv{file = file("own.csv")}
    assert(own:plot{columns = "way"}:find("angle"))
    own:watch{name = "rate", expression = "angle/way"}
    assert(not own:is_stale().can_refresh))");
  const auto refused = [&](const std::string& columns) {
    return eval("recording.create{columns = {" + columns + "}}");
  };
  EXPECT_NE(refused("").find("there are no values"), std::string::npos) << refused("");
  EXPECT_NE(refused("{name = 'a', values = {}}").find("there are no values"), std::string::npos);
  EXPECT_NE(refused("{name = 'a'}").find("a column needs a name and values"), std::string::npos);
  EXPECT_NE(refused("7").find("columns[1]: 7 is not "), std::string::npos) << refused("7");
  EXPECT_NE(refused("{name = '7', values = {1}}").find("is not the name"), std::string::npos);
  EXPECT_NE(refused("{name = 'a', values = {1, 'x'}}").find("entry 2"), std::string::npos)
      << refused("{name = 'a', values = {1, 'x'}}");
  EXPECT_NE(refused("{name = 'a', values = {{1, 2}, {3}}}").find("row 2"), std::string::npos);
  EXPECT_NE(refused("{name = 'a', values = 3}").find("columns[1].values: 3 is not a list"),
            std::string::npos);
  EXPECT_NE(refused("{name = 'a', unit = 'furlong', values = {1}}").find("furlong"),
            std::string::npos);
  EXPECT_NE(refused("{name = 'a', units = 'm', values = {1}}")
                .find("columns[1]: \"units\" is not a parameter. Did you mean \"unit\"?"),
            std::string::npos);
  EXPECT_NE(refused("{name = 'a', values = {1}}, {name = 'a', values = {1}}").find("two columns"),
            std::string::npos);
  EXPECT_NE(refused("{name = 'a', values = {1}}, {name = 'b', values = {1, 2}}")
                .find("\"b\" has 2 values, but \"a\" has 1"),
            std::string::npos);
  EXPECT_NE(refused("{name = 'time', values = {0, 0}}").find("does not increase"),
            std::string::npos);
  // What a logarithmic axis has no place for is counted.
  run(R"(
    signs = recording.create{columns = {{name = "step", values = {1, 2, 3}},
      {name = "error", unit = "m", values = {0, 1, -1}}}}
    signs:plot{columns = "error", log = "y"})");
  EXPECT_TRUE(told("logarithmic_axis", "2 of 3 samples have a value of 0 or less"));
  // It shows itself by what it holds.
  const std::string shown = eval("own");
  EXPECT_NE(shown.find("own\n3 samples\n"), std::string::npos) << shown;
  EXPECT_NE(shown.find("way [m], q1 and q2 [rad], count1"), std::string::npos) << shown;
  EXPECT_TRUE(eval("tostring(own)").starts_with("recording"));
  // Values without a number are gaps, as in tables.
  run("assert(recording.create{columns = {{name = 'a', values = {0/0, 1e300, "
      "1/0}}}}:values('a')[2] "
      "== 1e300)");
}

}  // namespace
}  // namespace robomosp::lua
