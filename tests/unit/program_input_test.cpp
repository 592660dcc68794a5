// SPDX-License-Identifier: Apache-2.0
// Programs in worlds that ask: PAUSE, READ and files.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/program_run.h"

namespace robomosp {
namespace {

using ioci::Session;
using recording::RecordingPtr;
using test::ProgramRun;

class ProgramInput : public ProgramRun {
 protected:
  Value start(Map with = {}) {
    return call("world.start_run", {{"id", cell_}, {"of", "tasks"}, {"with", std::move(with)}});
  }
  Value go(const Value& live) { return call("run.continue", {{"id", live}}); }
  std::vector<std::string> notes(const Value& live) {
    const Value made = call("run.recording", {{"id", live}});
    return app().recordings.find(made.as_handle()->number)->notes;
  }
  Value put_sum() {
    return put("sum",
               "READLN(a);\n"       // 4
               "WAIT 0.1 SEC;\n"    // 5
               "READLN(b);\n"       // 6
               "WRITELN(a + b);\n"  // 7
               "WAIT 0.1 SEC;\n",
               "VAR INT: a, b;\n");
  }
};

TEST_F(ProgramInput, PauseStopsALiveRunUntilItIsContinued) {
  put("stops", "WAIT 0.2 SEC;\nPAUSE 'turn the part';\nWRITELN('on');\nPAUSE;\nWAIT 0.1 SEC;\n");
  put("beside", "WAIT 0.3 SEC;\nWRITELN('beside');\n");
  const Value live = start();
  const Value first = go(live);
  EXPECT_EQ(at(first, "reason").text(), "pause");
  EXPECT_EQ(at(first, "message").text(), "turn the part");
  EXPECT_EQ(at(first, "program").text(), "stops");
  EXPECT_EQ(*at(first, "line").as_int(), 4);
  EXPECT_EQ(at(first, "is_stopped").text(), "true");
  EXPECT_NEAR(at(first, "time").number(), 0.2, 1e-9);
  EXPECT_EQ(notes(live).size(), 1U);
  const Value second = go(live);
  EXPECT_EQ(*at(second, "line").as_int(), 6);
  EXPECT_EQ(at(second, "message").text(), "");
  EXPECT_NEAR(at(second, "time").number(), 0.2, 1e-9);
  EXPECT_EQ(at(go(live), "is_complete").text(), "true");
  const auto said = notes(live);
  ASSERT_EQ(said.size(), 4U);
  EXPECT_EQ(said[0], "t = 0.2 s: stops is at PAUSE: turn the part");
  EXPECT_EQ(said[1], "t = 0.2 s: stops: on");
  // Nobody stands beside a run that is recorded at once.
  const RecordingPtr r = run();
  EXPECT_TRUE(has_note(
      r, "stops is at PAUSE: turn the part; no operator is connected, and the program continues"));
  EXPECT_NEAR(column(r, "time").back(), 0.3, 1e-9);
}

TEST_F(ProgramInput, PausesOfProcessesAndPlayedRunsStopToo) {
  put("two", "START other;\nWAIT 0.1 SEC;\nPAUSE 'main';\n",
      "PROCESS other;\nBEGIN\nWAIT 0.05 SEC;\nPAUSE 'other';\nWAIT 0.05 SEC;\nPAUSE "
      "'again';\nENDPROCESS;\n");
  const Value live = start();
  EXPECT_EQ(at(go(live), "message").text(), "other");
  const Value both = go(live);  // at the same time
  EXPECT_NEAR(at(both, "time").number(), 0.1, 1e-9);
  EXPECT_EQ(at(both, "reason").text(), "pause");
  EXPECT_EQ(at(go(live), "is_complete").text(), "true");
  EXPECT_EQ(notes(live).size(), 3U);
}

TEST_F(ProgramInput, ReadWaitsForALineOfALiveRun) {
  put_sum();
  const Value live = start();
  const Value asked = go(live);
  EXPECT_EQ(at(asked, "reason").text(), "input");
  EXPECT_EQ(*at(asked, "line").as_int(), 4);
  EXPECT_EQ(at(go(live), "reason").text(), "input");  // nobody has answered
  EXPECT_EQ(*at(call("run.input", {{"id", live}, {"text", "40"}}), "unread").as_int(), 1);
  const Value again = go(live);
  EXPECT_EQ(at(again, "reason").text(), "input");
  EXPECT_EQ(*at(again, "line").as_int(), 6);
  EXPECT_NEAR(at(again, "time").number(), 0.1, 1e-9);
  EXPECT_NE(fails("run.input", {{"id", live}, {"text", "1\n2"}}).sentence().find("end of line"),
            std::string::npos);
  call("run.input", {{"id", live}, {"text", "2"}});
  EXPECT_EQ(at(go(live), "is_complete").text(), "true");
  EXPECT_EQ(notes(live).back(), "t = 0.1 s: sum: 42");
  EXPECT_NE(fails("run.input", {{"id", live}, {"text", "3"}}).sentence().find("has ended"),
            std::string::npos);
}

TEST_F(ProgramInput, WhatWasTypedCountsOverARefreshAndNotOverAReset) {
  put_sum();
  const Value live = start();
  go(live);
  call("run.input", {{"id", live}, {"text", "5"}});
  EXPECT_EQ(*at(go(live), "line").as_int(), 6);
  call("run.input", {{"id", live}, {"text", "6"}});
  call("run.step", {{"id", live}});
  call("run.refresh", {{"id", live}});
  EXPECT_EQ(at(go(live), "is_complete").text(), "true");
  const auto said = notes(live);
  EXPECT_EQ(std::count(said.begin(), said.end(), "t = 0.1 s: sum: 11"), 1);
  call("run.reset", {{"id", live}});
  const Value asked = go(live);
  EXPECT_EQ(at(asked, "reason").text(), "input");
  EXPECT_EQ(*at(asked, "line").as_int(), 4);
}

TEST_F(ProgramInput, RunsThatAreRecordedAtOnceTakeLines) {
  const Value sum = put_sum();
  EXPECT_TRUE(has_note(run({{"lines", List{"1", "2"}}}), "sum: 3"));
  EXPECT_NE(fault().find("sum.irl:4:1: READ waits for line 1, and no lines were given. Give lines"),
            std::string::npos)
      << fault();
  EXPECT_NE(fault({{"lines", List{"1"}}}).find("sum.irl:6:1: READ waits for line 2, and 1 were"),
            std::string::npos);
  EXPECT_NE(fault({{"lines", List{"one", "2"}}}).find("sum.irl:4:1"), std::string::npos);
  EXPECT_NE(fault({{"lines", "1"}}).find("lines: \"1\" is not "), std::string::npos);
  EXPECT_NE(fault({{"lines", List{"1\n2"}}}).find("end of line"), std::string::npos);
  EXPECT_TRUE(call("program.run", {{"id", sum}, {"lines", List{"3", "4"}}}).as_handle());
  put("more", "READLN(a);\nWRITELN(a);\n", "VAR STRING: a;\n");
  EXPECT_NE(fault({{"lines", List{"1", "2"}}}).find("lines are for one program, but 2 run"),
            std::string::npos);
  const RecordingPtr both =
      run({{"lines", Map{{"sum", List{"1", "2"}}, {"more", List{"a word"}}}}});
  EXPECT_TRUE(has_note(both, "sum: 3"));
  EXPECT_TRUE(has_note(both, "more: a word"));
  EXPECT_NE(fault({{"lines", Map{{"nobody", List{"1"}}}}}).find("no program \"nobody\""),
            std::string::npos);
  // A live run begins with them, and asks for more.
  const Value live = start({{"program", "sum"}, {"lines", List{"7"}}});
  EXPECT_EQ(*at(go(live), "line").as_int(), 6);
}

TEST_F(ProgramInput, FilesAreThoseOfTheFolderOfTheRun) {
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) / "robomosp_program_files";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder / "in");
  std::ofstream(folder / "in" / "numbers.txt") << "3\n4\n5\n";
  put("adds",
      "OPEN(f, 'in/numbers.txt', 'R');\n"
      "WHILE NOT EOF(f)\nREADLN(f, n);\nsum := sum + n;\nENDWHILE;\nCLOSE(f);\n"
      "OPEN(f, 'sum.txt', 'W');\nWRITELN(f, sum);\nCLOSE(f);\n"
      "OPEN(f, 'sum.txt', 'A');\nWRITELN(f, 'more');\nCLOSE(f);\n"
      "WRITELN(sum);\n",
      "VAR FILE: f; INT: n, sum;\n");
  const auto written = [&] {
    std::ifstream in(folder / "sum.txt");
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  EXPECT_NE(fault().find("adds.irl:4:1: the program opens the file \"in/numbers.txt\", but the run "
                         "has no folder for files. Give files = a folder."),
            std::string::npos)
      << fault();
  EXPECT_TRUE(has_note(run({{"files", folder.string()}}), "adds: 12"));
  EXPECT_EQ(written(), "12\nmore\n");
  // On the thread of a live run as well.
  std::filesystem::remove(folder / "sum.txt");
  EXPECT_EQ(at(go(start({{"files", folder.string()}})), "is_complete").text(), "true");
  EXPECT_EQ(written(), "12\nmore\n");
  // A session without the right, and one that is confined to a folder.
  for (const Effect effect : {Effect::files_read, Effect::files_write}) {
    Session guest("guest");
    guest.deny(effect);
    const auto refused =
        app().dispatch(guest, "world.run_task", {{"id", cell_}, {"files", folder.string()}});
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::permission) << refused.error().sentence();
  }
  auto root = app().file_root(folder);
  ASSERT_TRUE(root.ok());
  Session confined("confined");
  confined.confine(*root);
  std::filesystem::remove(folder / "sum.txt");
  const auto made = app().dispatch(confined, "world.run_task", {{"id", cell_}});
  EXPECT_TRUE(made.ok()) << made.error().sentence();
  EXPECT_EQ(written(), "12\nmore\n");
  call("world.remove_program", {{"id", cell_}, {"name", "adds"}});
  int number = 0;
  for (const char* name : {"../numbers.txt", "/etc/hostname", "", "in/../../x"}) {
    const std::string leaves = "leaves" + std::to_string(++number);
    put(leaves, "OPEN(f, '" + std::string(name) + "', 'R');\n", "VAR FILE: f;\n");
    const std::string said = fault({{"files", folder.string()}});
    EXPECT_NE(said.find(leaves + ".irl:4:1: "), std::string::npos) << said;
    call("world.remove_program", {{"id", cell_}, {"name", leaves}});
  }
  put("none", "OPEN(f, 'none.txt', 'R');\n", "VAR FILE: f;\n");
  EXPECT_NE(fault({{"files", folder.string()}}).find("none.irl:4:1"), std::string::npos);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace robomosp
