// SPDX-License-Identifier: Apache-2.0
// Tasks of worlds that programs start and wait for.
#include <string>

#include <gtest/gtest.h>

#include "support/program_run.h"

namespace robomosp {
namespace {

class ProgramTasks : public test::ProgramRun {
 protected:
  void SetUp() override {
    ProgramRun::SetUp();
    call("world.add_signal", {{"id", cell_}, {"name", "horn"}});
    task("feed", List{Map{{"step", "set"}, {"signal", "horn"}, {"value", 1}},
                      Map{{"step", "wait"}, {"time", 0.5}},
                      Map{{"step", "set"}, {"signal", "horn"}, {"value", 0}}});
  }
  void task(const std::string& name, const List& steps) {
    call("task.create", {{"name", name}, {"steps", steps}});
    call("world.add_task", {{"id", cell_}, {"task", name}});
  }
  Value put_bound(const std::string& name, const std::string& body) {
    const Value p = put(name, body,
                        "SIGNAL\n  OUTPUT BOOL: start AT 1;\n  INPUT BOOL: done AT 2;\n"
                        "VAR\n  INT: i;\n");
    for (const char* signal : {"start", "done"})
      call("program.bind", {{"id", p}, {"kind", "task"}, {"name", signal}, {"to", "feed"}});
    return p;
  }
  /// Seconds at which a column rises above a half.
  static std::vector<double> rises(const recording::RecordingPtr& r, const std::string& name) {
    std::vector<double> out;
    const auto &t = column(r, "time"), &v = column(r, name);
    for (std::size_t i = 0; i < v.size(); ++i)
      if (v[i] > 0.5 && (i == 0 || v[i - 1] <= 0.5)) out.push_back(t[i]);
    return out;
  }
};

TEST_F(ProgramTasks, AnOutputStartsATaskAndAnInputTellsItsEnd) {
  put_bound("twice",
            "FOR i := 1 TO 2\n"
            "  WAIT 1.0 SEC;\n"
            "  start := TRUE;\n"
            "  IF done THEN WRITELN('too early'); ENDIF;\n"
            "  WAIT FOR done;\n"
            "  start := FALSE;\n"
            "ENDFOR;\n"
            "WRITELN('fed');\n");
  const auto r = run();
  ASSERT_TRUE(r);
  const auto at = rises(r, "signal.horn");
  ASSERT_EQ(at.size(), 2U);  // and not at the start, by itself
  EXPECT_NEAR(at[0], 1.0, 1e-9);
  EXPECT_NEAR(at[1], 2.5, 1e-9);
  EXPECT_TRUE(has_note(r, "twice: fed"));
  EXPECT_FALSE(has_note(r, "too early"));
  EXPECT_TRUE(has_note(r, "t = 0 s: task \"feed\" begins when program \"twice\" starts it"));
  EXPECT_TRUE(has_note(r, "t = 2.5 s: twice starts task \"feed\""));
  EXPECT_NEAR(column(r, "time").back(), 3.0, 1e-9);
}

TEST_F(ProgramTasks, ATaskThatRunsIsNotStartedAgainAndThatIsSaid) {
  put_bound("hasty",
            "start := TRUE;\n"
            "WAIT 0.2 SEC;\n"
            "start := FALSE;\n"
            "start := TRUE;\n"
            "WAIT FOR done;\n");
  const auto r = run();
  ASSERT_TRUE(r);
  EXPECT_EQ(rises(r, "signal.horn").size(), 1U);
  EXPECT_TRUE(has_note(r, "t = 0.2 s: hasty does not start task \"feed\", which is still running"));
}

TEST_F(ProgramTasks, AProgramThatRunsAloneTakesItsTasksAlong) {
  task("other", List{Map{{"step", "wait"}, {"time", 7.0}}});
  put_bound("alone", "start := TRUE;\nWAIT FOR done;\n");
  const auto r = run({{"program", "alone"}});
  ASSERT_TRUE(r);
  EXPECT_NEAR(column(r, "time").back(), 0.5, 1e-9);  // without the other task
  EXPECT_NEAR(column(run(), "time").back(), 7.0, 1e-9);
}

TEST_F(ProgramTasks, ATaskThatIsNotStartedDoesNotKeepTheRun) {
  put_bound("idle", "WAIT 0.1 SEC;\n");
  EXPECT_NEAR(column(run(), "time").back(), 0.1, 1e-9);
}

TEST_F(ProgramTasks, ALiveRunIsTheSame) {
  put_bound("twice", "start := TRUE;\nWAIT FOR done;\nWAIT 0.1 SEC;\n");
  const auto whole = run();
  const Value live = call("world.start_run", {{"id", cell_}, {"of", "tasks"}});
  call("run.continue", {{"id", live}});
  const Value made = call("run.recording", {{"id", live}});
  const auto rows = app().recordings.find(made.as_handle()->number);
  EXPECT_EQ(column(rows, "signal.horn"), column(whole, "signal.horn"));
  EXPECT_EQ(column(rows, "time"), column(whole, "time"));
}

TEST_F(ProgramTasks, WhatIsNoTaskOrNoBoolIsRefused) {
  const Value p = put("wrong", "level := 3;\n", "SIGNAL\n  OUTPUT INT: level AT 1, 4;\n");
  call("program.bind", {{"id", p}, {"kind", "task"}, {"name", "level"}, {"to", "feed"}});
  EXPECT_NE(fault().find("\"level\" is not a BOOL"), std::string::npos) << fault();
  call("world.remove_program", {{"id", cell_}, {"name", "wrong"}});
  const Value q = put_bound("lost", "start := TRUE;\n");
  call("program.bind", {{"id", q}, {"kind", "task"}, {"name", "start"}, {"to", "fead"}});
  EXPECT_NE(fault().find("no task \"fead\""), std::string::npos) << fault();
  EXPECT_NE(fault().find("feed"), std::string::npos);
  const std::string no_name =
      fails("program.bind", {{"id", q}, {"kind", "task"}, {"name", "start"}}).sentence();
  EXPECT_NE(no_name.find("needs to"), std::string::npos) << no_name;
}

}  // namespace
}  // namespace robomosp
