// SPDX-License-Identifier: Apache-2.0
// Live runs of programs that go on after an edit: where they stand then, and what happens where
// they cannot come there any more.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/program_run.h"

namespace robomosp {
namespace {

using recording::RecordingPtr;
using test::ProgramRun;

class ProgramRefresh : public ProgramRun {
 protected:
  void SetUp() override {
    ProgramRun::SetUp();
    put("count",
        "FOR i := 1 TO 5\n"  // 7
        "  add(i);\n"        // 8
        "  WAIT 0.1 SEC;\n"  // 9
        "  MOVE_INC LIN POSE(POSITION(0.0, 0.0, 10.0), ORIZYX(0.0, 0.0, 0.0));\n"
        "ENDFOR;\n"           // 11
        "WRITELN('end');\n"   // 12
        "WAIT 0.1 SEC;\n",    // 13
        "VAR INT: i, sum;\n"  // 2
        "PROCEDURE add (IN INT: n);\n"
        "BEGIN sum := sum + n;\n"  // 4
        "ENDPROC;\n");
    live_ = start();
  }
  /// Rows lie beside the instants at which the program goes on.
  Value start() {
    return call("world.start_run",
                {{"id", cell_}, {"of", "tasks"}, {"with", Map{{"sample_time", 0.03}}}});
  }
  Value stops(Map where) {
    where.set("id", live_);
    return call("run.set_breakpoint", where);
  }
  Value go() { return call("run.continue", {{"id", live_}}); }
  Value place() { return call("run.place", {{"id", live_}}); }
  Value refresh() { return call("run.refresh", {{"id", live_}}); }
  Error refused() { return fails("run.refresh", {{"id", live_}}); }
  /// Of a variable of the program.
  std::string value(const std::string& expression) {
    const Map args{{"id", live_}, {"expression", expression}, {"frame", 0}};
    return at(call("run.evaluate", args), "value").text();
  }
  double time() { return at(call("run.state", {{"id", live_}}), "time").number(); }
  RecordingPtr recorded() {
    const Value made = call("run.recording", {{"id", live_}});
    return app().recordings.find(made.as_handle()->number);
  }
  void edit(const std::string& from, const std::string& to, const std::string& program = "count") {
    std::string text = *call("program.source", {{"id", program}}).as_string();
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    call("program.set_file", {{"id", program}, {"name", program + ".irl"}, {"text", text}});
  }
  static void expect_equal(const RecordingPtr& a, const RecordingPtr& b) {
    ASSERT_EQ(a->columns.size(), b->columns.size());
    for (const auto& c : a->columns) EXPECT_EQ(c.values, column(b, c.name)) << c.name;
  }
  std::size_t notes_with(const std::string& part) {
    std::size_t n = 0;
    for (const std::string& note : recorded()->notes) n += note.find(part) != std::string::npos;
    return n;
  }
  Value live_;
};

TEST_F(ProgramRefresh, UneditedItStandsWhereItStoodAndGoesOnBitForBit) {
  const auto to_the_third = [&] {
    const Value b = stops({{"line", 8}, {"condition", "i = 3"}});
    const Value stood = go();
    EXPECT_EQ(*at(stood, "line").as_int(), 8);
    return b;
  };
  to_the_third();
  go();
  const RecordingPtr whole = recorded();
  live_ = start();
  const Value b = to_the_third();
  const double when = time();
  const Value now = refresh();
  EXPECT_EQ(at(now, "time").number(), when);
  const Value stood = place();
  EXPECT_EQ(at(stood, "reason").text(), "breakpoint");
  EXPECT_EQ(at(stood, "breakpoint").text(), at(b, "number").text());
  EXPECT_EQ(*at(stood, "line").as_int(), 8);
  EXPECT_EQ(at(stood, "is_stopped").text(), "true");
  EXPECT_EQ(at(stood, "is_past").text(), "false");
  EXPECT_EQ(value("i"), "3");
  EXPECT_EQ(value("sum"), "3");
  EXPECT_EQ(*at(call("run.step_into", {{"id", live_}}), "line").as_int(), 4);
  EXPECT_EQ(at(go(), "is_complete").text(), "true");
  expect_equal(whole, recorded());
  EXPECT_EQ(notes_with("count: end"), 1U);
  EXPECT_EQ(recorded()->notes.size(), whole->notes.size() + 1);  // that it went on
}

TEST_F(ProgramRefresh, StepsWithinOneInstantAreFoundAgain) {
  call("world.remove_program", {{"id", cell_}, {"name", "count"}});
  put("adds",
      "WAIT 0.1 SEC;\n"  // 4
      "FOR i := 1 TO 5\n"
      "  sum := sum + i;\n"  // 6
      "  sum := sum + 0;\n"  // 7
      "ENDFOR;\n"
      "WAIT 0.1 SEC;\n",
      "VAR INT: i, sum;\n");
  live_ = start();
  stops({{"line", 6}, {"condition", "i = 4"}});
  go();
  EXPECT_EQ(*at(call("run.step_over", {{"id", live_}}), "line").as_int(), 7);
  EXPECT_EQ(value("sum"), "10");
  refresh();
  const Value stood = place();
  EXPECT_EQ(at(stood, "reason").text(), "step");
  EXPECT_EQ(*at(stood, "line").as_int(), 7);
  EXPECT_EQ(value("i"), "4");
  EXPECT_EQ(value("sum"), "10");
  EXPECT_NEAR(time(), 0.1, 1e-12);
  EXPECT_EQ(at(go(), "is_complete").text(), "true");
}

TEST_F(ProgramRefresh, BreakpointsKeepTheirHits) {
  const Value b = stops({{"line", 8}, {"hits", ">= 4"}});
  while (value("i") != "3") call("run.step", {{"id", live_}});
  EXPECT_EQ(*at(call("run.breakpoints", {{"id", live_}}).as_list()->front(), "hits").as_int(), 2);
  refresh();
  EXPECT_EQ(*at(call("run.breakpoints", {{"id", live_}}).as_list()->front(), "hits").as_int(), 2);
  // It was set behind the first hit, so the fourth that it counts is the last of the program.
  EXPECT_EQ(at(go(), "reason").text(), "breakpoint");
  EXPECT_EQ(value("i"), "5");
  refresh();
  EXPECT_EQ(value("i"), "5");
  EXPECT_EQ(*at(call("run.breakpoints", {{"id", live_}}).as_list()->front(), "hits").as_int(), 4);
  EXPECT_EQ(at(place(), "breakpoint").text(), at(b, "number").text());
}

TEST_F(ProgramRefresh, ItComesThereWithoutStopsAndTellsNothingTwice) {
  stops({{"line", 8}, {"condition", "i = 2"}});
  stops({{"line", 4}, {"log", "n is {n}"}});
  go();
  call("run.step", {{"id", live_}});  // behind the breakpoint, at a row
  const double when = time();
  const RecordingPtr before = recorded();
  refresh();
  EXPECT_EQ(time(), when);
  EXPECT_EQ(at(place(), "is_stopped").text(), "false");
  EXPECT_EQ(notes_with("n is 2"), 1U);
  EXPECT_EQ(recorded()->notes.size(), before->notes.size() + 1);
  EXPECT_EQ(at(go(), "is_complete").text(), "true");
  EXPECT_EQ(notes_with("n is 2"), 1U);
  EXPECT_EQ(notes_with("n is 5"), 1U);
}

TEST_F(ProgramRefresh, AfterAnEditItStandsAtTheSameLineWithTheNewValues) {
  stops({{"line", 8}, {"condition", "i = 2"}});
  go();
  const double when = time();
  edit("sum := sum + n;", "sum := sum + 10 * n; sum := sum + 1;");
  EXPECT_EQ(at(call("run.state", {{"id", live_}}), "is_outdated").text(), "true");
  const Value now = refresh();
  EXPECT_EQ(at(now, "is_outdated").text(), "false");
  EXPECT_EQ(at(now, "time").number(), when);
  EXPECT_EQ(*at(place(), "line").as_int(), 8);
  EXPECT_EQ(value("i"), "2");
  EXPECT_EQ(value("sum"), "11");
  EXPECT_NE(call("run.program_text", {{"id", live_}}).as_string()->find("10 * n"),
            std::string::npos);
  go();
  EXPECT_EQ(value("sum"), "155");
}

TEST_F(ProgramRefresh, BackInWhatIsRecordedItGoesOnFromThere) {
  stops({{"line", 8}, {"condition", "i = 4"}});
  go();
  const Value earlier = call("run.seek", {{"id", live_}, {"time", 0.09}});
  EXPECT_EQ(value("sum"), "1");
  edit("TO 5", "TO 4");
  refresh();
  EXPECT_EQ(time(), at(earlier, "time").number());
  EXPECT_EQ(value("sum"), "1");
  EXPECT_EQ(at(place(), "is_past").text(), "false");
  EXPECT_EQ(at(go(), "reason").text(), "breakpoint");
  EXPECT_EQ(at(go(), "is_complete").text(), "true");
  EXPECT_EQ(value("sum"), "10");
}

TEST_F(ProgramRefresh, AProgramThatIsOverBeforeIsRefusedAndTheOldRunGoesOn) {
  call("run.finish", {{"id", live_}});
  const RecordingPtr whole = recorded();
  live_ = start();
  stops({{"line", 8}, {"condition", "i = 4"}});
  go();
  const double when = time();
  edit("TO 5", "TO 1");
  const std::string said = refused().sentence();
  EXPECT_NE(said.find("it is over at t = "), std::string::npos) << said;
  EXPECT_NE(said.find("now, before t = "), std::string::npos) << said;
  EXPECT_NE(said.find("run.seek"), std::string::npos) << said;
  const Value state = call("run.state", {{"id", live_}});
  EXPECT_EQ(at(state, "time").number(), when);
  EXPECT_EQ(at(state, "is_outdated").text(), "true");
  EXPECT_EQ(at(place(), "breakpoint").text(), "1");
  EXPECT_EQ(value("sum"), "6");
  EXPECT_NE(call("run.program_text", {{"id", live_}}).as_string()->find("TO 5"), std::string::npos);
  EXPECT_EQ(at(go(), "is_complete").text(), "true");
  EXPECT_EQ(value("sum"), "15");
  EXPECT_EQ(column(recorded(), "ur5.q2").back(), column(whole, "ur5.q2").back());
  EXPECT_EQ(recorded()->notes, whole->notes);
  // Earlier, the edited program comes there, too.
  call("run.seek", {{"id", live_}, {"time", 0.06}});
  refresh();
  EXPECT_EQ(at(go(), "is_complete").text(), "true");
  EXPECT_EQ(value("sum"), "1");
}

TEST_F(ProgramRefresh, WhatIsWrongNowIsASentenceAndTheOldRunGoesOn) {
  const auto stays = [&](const std::string& part) {
    const double when = time();
    const std::string sum = value("sum");
    const std::string said = refused().sentence();
    EXPECT_NE(said.find(part), std::string::npos) << said;
    EXPECT_EQ(time(), when);
    EXPECT_EQ(value("sum"), sum);
    EXPECT_FALSE(at(call("run.state", {{"id", live_}}), "is_over").text() == "true");
    call("run.step", {{"id", live_}});
    EXPECT_GT(time(), when);
  };
  stops({{"line", 8}, {"condition", "i = 3"}});
  go();
  edit("WAIT 0.1 SEC;", "WAIT 0.1 SECS;");
  stays("count.irl");
  edit("WAIT 0.1 SECS;", "WAIT 0.1 SEC;");
  edit("sum := sum + n;", "sum := sum DIV (n - 1);");  // line 4, when n is 1
  stays("count.irl:4");
  edit("sum := sum DIV (n - 1);", "sum := sum + n;");
  edit("VAR INT", "SIGNAL INPUT BOOL: gone AT 1; VAR INT");
  stays("no signal for gone");
  edit("SIGNAL INPUT BOOL: gone AT 1; VAR INT", "VAR INT");
  call("world.remove_member", {{"id", cell_}, {"member", "ur5"}});
  stays("robot");
  EXPECT_EQ(at(go(), "is_complete").text(), "true");
  EXPECT_EQ(value("sum"), "15");
}

TEST_F(ProgramRefresh, ABreakpointWithoutAPlaceIsKeptAndSaid) {
  const Value b = stops({{"line", 12}});
  call("run.step", {{"id", live_}});
  const std::string source = *call("program.source", {{"id", "count"}}).as_string();
  edit("WRITELN('end');\nWAIT 0.1 SEC;\n", "");
  refresh();
  EXPECT_EQ(notes_with("breakpoint 1 stops nowhere: program \"count\": there is no statement in "
                       "line 12 or after it"),
            1U);
  EXPECT_EQ(call("run.breakpoints", {{"id", live_}}).as_list()->size(), 1U);
  call("program.set_file", {{"id", "count"}, {"name", "count.irl"}, {"text", source}});
  refresh();
  const Value stood = go();
  EXPECT_EQ(at(stood, "breakpoint").text(), at(b, "number").text());
  EXPECT_EQ(*at(stood, "line").as_int(), 12);
}

TEST_F(ProgramRefresh, AProgramThatLeftTheWorldEndsThere) {
  put("beside", "WAIT 0.2 SEC;\nWRITELN('beside');\nWAIT 2.0 SEC;\n");
  live_ = start();
  stops({{"line", 4}, {"program", "beside"}});
  go();
  const double when = time();
  call("world.remove_program", {{"id", cell_}, {"name", "beside"}});
  refresh();
  EXPECT_EQ(time(), when);
  EXPECT_EQ(at(place(), "is_stopped").text(), "false");
  EXPECT_EQ(notes_with("breakpoint 1 stops nowhere: program \"beside\" is not run"), 1U);
  EXPECT_EQ(at(go(), "is_complete").text(), "true");
  EXPECT_EQ(value("sum"), "15");
}

TEST_F(ProgramRefresh, PausesAskAgainWhereTheyAsked) {
  put("asks",
      "WAIT 0.1 SEC;\n"
      "PAUSE 'one';\n"  // 4
      "PAUSE 'two';\n"  // 5
      "WAIT 0.1 SEC;\n");
  live_ = start();
  go();
  EXPECT_EQ(at(go(), "message").text(), "two");
  refresh();
  const Value stood = place();
  EXPECT_EQ(at(stood, "reason").text(), "pause");
  EXPECT_EQ(at(stood, "message").text(), "two");
  EXPECT_EQ(notes_with("PAUSE: one"), 1U);
  EXPECT_EQ(notes_with("PAUSE: two"), 1U);
  EXPECT_EQ(at(go(), "is_complete").text(), "true");
  // Beyond them nobody is asked.
  call("run.seek", {{"id", live_}, {"time", 0.15}});
  refresh();
  EXPECT_EQ(at(place(), "is_stopped").text(), "false");
  EXPECT_EQ(at(go(), "is_complete").text(), "true");
}

TEST_F(ProgramRefresh, BeforeTheFirstStatementItStandsThereAgain) {
  live_ = call("world.start_run", {{"id", cell_}, {"of", "tasks"}, {"entry", "stop"}});
  EXPECT_EQ(at(place(), "reason").text(), "entry");
  edit("TO 5", "TO 2");
  refresh();
  const Value stood = place();
  EXPECT_EQ(at(stood, "reason").text(), "entry");
  EXPECT_EQ(*at(stood, "line").as_int(), 7);
  EXPECT_EQ(at(go(), "is_complete").text(), "true");
  EXPECT_EQ(value("sum"), "3");
}

TEST_F(ProgramRefresh, OtherProgramsThatWaitDoNotMoveThePlace) {
  call("world.add_signal", {{"id", cell_}, {"name", "go"}});
  put("waits",
      "WAIT FOR go;\n"
      "FOR k := 1 TO 6\n"
      "  sums := sums + k;\n"  // 6
      "ENDFOR;\n"
      "WAIT 0.1 SEC;\n",
      "SIGNAL INPUT BOOL: go AT 1;\nVAR INT: k, sums;\n");
  put("sets", "WAIT 0.25 SEC;\ngo := TRUE;\nWAIT 0.5 SEC;\n", "SIGNAL OUTPUT BOOL: go AT 1;\n");
  live_ = start();
  stops({{"line", 8}, {"program", "count"}});
  const Value b = stops({{"line", 7}, {"program", "waits"}, {"condition", "k = 5"}});
  while (at(go(), "program").text() != "waits") {
  }
  const std::string sums = value("sums");
  refresh();
  EXPECT_EQ(at(place(), "program").text(), "waits");
  EXPECT_EQ(at(place(), "breakpoint").text(), at(b, "number").text());
  EXPECT_EQ(value("k"), "5");
  EXPECT_EQ(value("sums"), sums);
  EXPECT_NEAR(time(), 0.25, 1e-12);
}

TEST_F(ProgramRefresh, ValuesThatWereGivenCountAgain) {
  live_ =
      call("world.start_run", {{"id", cell_},
                               {"of", "tasks"},
                               {"with", Map{{"program", "count"}, {"values", Map{{"sum", 100}}}}}});
  const Value b = stops({{"line", 8}, {"condition", "i = 3"}});
  go();
  EXPECT_EQ(value("sum"), "103");
  refresh();
  EXPECT_EQ(at(place(), "breakpoint").text(), at(b, "number").text());
  EXPECT_EQ(value("sum"), "103");
  edit("sum := sum + n;", "sum := sum + 2 * n;");
  refresh();
  EXPECT_EQ(value("sum"), "106");
  call("run.reset", {{"id", live_}});
  EXPECT_EQ(at(go(), "breakpoint").text(), at(b, "number").text());
  EXPECT_EQ(value("sum"), "106");
}

TEST_F(ProgramRefresh, AFaultIsMendedWhereItStands) {
  edit("sum := sum + n;", "sum := sum + n DIV (3 - n);");
  live_ = start();
  const std::string said = fails("run.continue", {{"id", live_}}).sentence();
  EXPECT_NE(said.find("divides by zero"), std::string::npos) << said;
  EXPECT_EQ(at(place(), "reason").text(), "fault");
  const double when = time();
  EXPECT_GT(when, 0.2);
  edit("n DIV (3 - n)", "n");
  refresh();
  EXPECT_EQ(time(), when);
  EXPECT_EQ(at(go(), "is_complete").text(), "true");
  EXPECT_EQ(value("sum"), "15");
}

TEST_F(ProgramRefresh, ARunThatPlaysRestsAndGoesOn) {
  edit("TO 5", "TO 400");
  edit("0.0, 10.0), ORI", "0.0, 0.1), ORI");
  live_ = start();
  call("run.play", {{"id", live_}, {"speed", "max"}});
  while (time() < 0.5) {
  }
  edit("TO 400", "TO 300");
  const Value now = refresh();
  EXPECT_EQ(at(now, "is_playing").text(), "false");
  EXPECT_GE(at(now, "time").number(), 0.5);
  call("run.play", {{"id", live_}, {"speed", "max"}});
  EXPECT_EQ(at(call("run.finish", {{"id", live_}}), "is_complete").text(), "true");
  EXPECT_EQ(value("sum"), "45150");
}

TEST_F(ProgramRefresh, AResetThatCannotBeginLeavesTheRun) {
  stops({{"line", 8}, {"condition", "i = 3"}});
  go();
  const double when = time();
  edit("VAR INT", "SIGNAL INPUT BOOL: gone AT 1; VAR INT");
  EXPECT_NE(fails("run.reset", {{"id", live_}}).sentence().find("no signal for gone"),
            std::string::npos);
  EXPECT_EQ(time(), when);
  EXPECT_EQ(value("sum"), "3");
  EXPECT_EQ(at(go(), "is_complete").text(), "true");
  edit("SIGNAL INPUT BOOL: gone AT 1; VAR INT", "VAR INT");
  EXPECT_EQ(at(call("run.reset", {{"id", live_}}), "time").number(), 0);
  EXPECT_EQ(at(go(), "reason").text(), "breakpoint");  // with its breakpoint
  EXPECT_EQ(value("sum"), "3");
}

}  // namespace
}  // namespace robomosp
