// SPDX-License-Identifier: Apache-2.0
// The machine of programs: calls, motions, signals, waits, processes, interrupts, files, faults.
#include <atomic>
#include <cmath>
#include <map>
#include <string>

#include "intrinsics.h"
#include "program/presets.h"
#include "support/program_world.h"

namespace robomosp::program {
namespace {

using namespace testing;

/// What a program writes; its fault behind it.
std::string written(const std::string& text, const Limits& limits = {}) {
  Machine m = loaded(text, limits);
  TestWorld w;
  const Status& s = run_to_end(m, w);
  return w.text + fault_of(s);
}
std::string body(const std::string& statements, const std::string& declarations = "") {
  return "PROGRAM p;\n" + declarations + "\nBEGIN\n" + statements + "\nENDPROGRAM;\n";
}

TEST(Machine, RunsCallsLoopsAndTexts) {
  EXPECT_EQ(written(R"(PROGRAM p;
TYPE RECORD INT: height; POSITION: foot; ENDRECORD: PEG;
VAR ARRAY [-1..2] OF PEG: pegs; INT: i, sum; STRING: s; LIST OF INT: l;
FUNCTION fact(IN INT: n): INT;
BEGIN
  IF n <= 1 THEN RETURN 1; ENDIF;
  RETURN n * fact(n - 1);
ENDFCT;
PROCEDURE twice(INOUT INT: a; OUT REAL: r);
VAR INT: old;
BEGIN
  old := a;
  a := old + a;
  r := a / 4;
ENDPROC;
VAR REAL: q;
BEGIN
  FOR i := -1 TO 2 pegs[i].height := i * 10; pegs[i].foot.Y := i; ENDFOR;
  FOR i := 2 DOWNTO -1 STEP 2 sum := sum + pegs[i].height; ENDFOR;
  twice(pegs[2].height, q);
  s := CONCAT('a', 'bc'); s[2] := 'x';
  LIST_ADD(l, 3); LIST_ADD(l, 5); LIST_INSERT(l, 1, 7);
  WRITELN(fact(10), ' ', sum, ' ', pegs[2].height, ' ', q, ' ', s, ' ', l, LIST_INDEX(l, 5));
  WRITELN(pegs);
ENDPROGRAM;)"),
            "3628800 20 40 10.0 axc [7, 3, 5]3\n[(-10, (0.0, -1.0, 0.0)), (0, (0.0, 0.0, 0.0)), "
            "(10, (0.0, 1.0, 0.0)), (40, (0.0, 2.0, 0.0))]\n");
}

TEST(Machine, LocalsAreZeroEachTimeAndOfEachCall) {
  const std::string text = R"(PROGRAM p;
PROCEDURE q(IN INT: n);
VAR INT: mine; STRING: s; LIST OF INT: l;
BEGIN
  mine := mine + n; s := CONCAT(s, 'x'); LIST_ADD(l, n);
  IF n > 0 THEN q(n - 1); ENDIF;
  WRITE(mine, s, l, ' ');
ENDPROC;
BEGIN q(2); q(1); ENDPROGRAM;)";
  EXPECT_EQ(written(text), "0x[0] 1x[1] 2x[2] 0x[0] 1x[1] ");
  // The same when the code comes from its text.
  auto back = read_code_text(code_text(compiled(text)->code()));
  ASSERT_TRUE(back.ok()) << back.error().sentence();
  auto m = Machine::load(std::shared_ptr<const CompiledProgram>(std::move(back).value()));
  ASSERT_TRUE(m.ok()) << m.error().sentence();
  TestWorld w;
  EXPECT_EQ(fault_of(run_to_end(*m, w)), "");
  EXPECT_EQ(w.text, "0x[0] 1x[1] 2x[2] 0x[0] 1x[1] ");
}

TEST(Machine, ValuesAreCopiedNotShared) {
  EXPECT_EQ(
      written(body("a[1] := [1]; b := a; LIST_ADD(b[1], 2); LIST_ADD(ll, b[1]); LIST_ADD(b[1], 3);"
                   "lm := ll; LIST_ADD(lm[1], 9); s := 'abc'; t := s; t[1] := 'z';"
                   "WRITELN(a, b, ll, lm, s, t);",
                   "VAR ARRAY [1..1] OF LIST OF INT: a, b; LIST OF LIST OF INT: ll, lm;"
                   "STRING: s, t;")),
      "[[1]][[1, 2, 3]][[1, 2]][[1, 2, 9]]abczbc\n");
}

TEST(Machine, FaultsNameThePlaceAndTheCalls) {
  Machine m = loaded(R"(PROGRAM p;
VAR ARRAY [1..3] OF INT: a;
PROCEDURE inner(IN INT: i);
BEGIN
  a[i] := 1;
ENDPROC;
PROCEDURE outer;
BEGIN
  inner(4);
ENDPROC;
BEGIN
  outer;
ENDPROGRAM;)");
  TestWorld w;
  const Status& s = run_to_end(m, w);
  ASSERT_EQ(s.state, RunState::fault);
  EXPECT_EQ(s.fault->sentence(), "p.irl:5:3: the index 4 is outside 1..3.");
  ASSERT_EQ(s.fault->calls.size(), 3u);
  EXPECT_EQ(s.fault->calls[0].name, "inner");
  EXPECT_EQ(s.fault->calls[1].span.line, 9u);
  EXPECT_EQ(s.fault->calls[2].span.line, 12u);
  // It stays so.
  EXPECT_EQ(m.run(w.now, w).state, RunState::fault);
}

TEST(Machine, WhatGoesWrongIsOneSentence) {
  const std::string d =
      "SIGNAL OUTPUT INT: lamp AT 10, 4; "
      "VAR INT: i := 2147483647, z; REAL: r := 1.0e308, q; STRING: s; LIST OF INT: l;"
      "CHAR: c; POSE: pose; ORIENTATION: o; FILE: f; ARRAY [0..1] OF INT: a;"
      "FUNCTION none(IN INT: x): INT; BEGIN IF x = 1 THEN RETURN 2; ENDIF; ENDFCT;"
      "PROCEDURE deep; BEGIN deep; ENDPROC;";
  const std::pair<const char*, const char*> kWrong[] = {
      {"i := i + 1;", "the value of + is outside the range of INT"},
      {"i := -i - 2;", "the value of - is outside the range of INT"},
      {"i := i * i;", "the value of * is outside"},
      {"z := i DIV z;", "this divides by zero"},
      {"z := i MOD z;", "this divides by zero"},
      {"q := r / q;", "this divides by zero"},
      {"q := r * 10.0;", "the value of * is outside the range of REAL"},
      {"q := SQRT(-r);", "SQRT has no value at -1.0e+308"},
      {"q := 90.0; q := TAN(q);", "TAN has no value at 90.0"},
      {"z := ROUND(r);", "the value of ROUND is outside the range of INT"},
      {"c := i;", "the code of a CHAR must be from 0 to 255, but this is 2147483647"},
      {"c := s[1 + z];", "the index 1 is outside 1..0"},
      {"LIST_DELETE(l, 1);", "the place 1 is outside 1..0"},
      {"l[1 + z] := 1;", "the index 1 is outside 1..0"},
      {"s := EXTRACT('abc', 2, 3);", "EXTRACT is of 3 characters from 2 on, and the string has 3"},
      {"MOVE LIN ROBTARGET(((1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0)), z - 2, 0, 0.0);",
       "the STATUS of a target is -2, but it must not be negative"},
      {"MOVE LIN pose;", "the orientation of a target is not a unit quaternion: its length is 0.0"},
      {"q := ANGLEX('RS', o);", "the orientation that ANGLEX gets is not a unit quaternion"},
      {"o := ORIZYX(1.0,2.0,3.0); q := ANGLEX('XXX', o);", "ANGLEX has no mode 'XXX'"},
      {"o := ORIMAT(POSITION(1.0,0.0,0.0), POSITION(0.0,1.0,0.0), POSITION(0.0,0.0,-1.0));",
       "ORIMAT gets axes that are not"},
      {"lamp := 16;", "the value 16 does not fit in the 4 bits of lamp"},
      {"WAIT q - 1.0 SEC;", "WAIT is of -1.0 s"},
      {"READ(f, i);", "the file is not open"},
      {"OPEN(f, 'none', 'R');", "there is no file \"none\""},
      {"OPEN(f, 'none', 'Q');", "OPEN has no mode 'Q'"},
      {"z := none(2);", "the function none reached its end without a RETURN"},
      {"deep;", "more than 10000 calls are nested"},
      {"a[z + 2] := 1;", "the index 2 is outside 0..1"},
      {"s := 'x'; LOOP s := CONCAT(s, s); ENDLOOP;", "bytes allowed"},
      {"LOOP LIST_ADD(l, 1); ENDLOOP;", "bytes allowed"},
      {"pose.ORI := ORIZYX(0.0,0.0,0.0); R_SPEED := 0.0; MOVE LIN pose;", "SPEED is 0.0"},
      {"pose.ORI := ORIZYX(0.0,0.0,0.0); R_ACC := 101.0; MOVE PTP pose;", "ACC is 101.0"},
  };
  Limits limits;
  limits.most_bytes = 4 << 20;
  for (const auto& [statement, sentence] : kWrong) {
    const std::string out = written(body(statement, d), limits);
    EXPECT_NE(out.find(sentence), std::string::npos) << statement << "\n" << out;
    const bool is_inside = std::string(statement).find("none(2)") != std::string::npos ||
                           std::string(statement) == "deep;";
    EXPECT_NE(out.find(is_inside ? "p.irl:2:" : "p.irl:4:"), std::string::npos) << statement << "\n"
                                                                                << out;
  }
}

TEST(Machine, MotionsGoOnWhileTheProcessComputes) {
  Machine m =
      loaded(body("MOVE LIN q C_CP := 5.0; i := 1; MOVE LIN q C_CP := 5.0; i := 2; "
                  "MOVE LIN q; i := 3; g := TRUE; MOVE LIN q C_CP := 5.0; i := 4; g := FALSE;",
                  "SIGNAL OUTPUT BOOL: g AT 1;\nVAR INT: i; "
                  "POSE: q := POSE(POSITION(1.0,2.0,3.0), ORIZYX(0.0,0.0,0.0));"));
  TestWorld w;
  m.run(0, w);
  // Two are handed over; the third waits until the first is done.
  ASSERT_EQ(w.motions.size(), 2u);
  EXPECT_EQ(w.motions[1].after, 1u);
  EXPECT_EQ(m.evaluate("i")->value, "2");
  ASSERT_EQ(m.status().waits.size(), 1u);
  EXPECT_EQ(m.status().waits[0].motions, (std::vector<std::uint64_t>{1, 2}));
  w.now = 0.5;
  m.run(w.now, w);
  EXPECT_EQ(w.motions.size(), 2u);
  w.now = 1;
  m.run(w.now, w);
  ASSERT_EQ(w.motions.size(), 3u);
  EXPECT_EQ(m.evaluate("i")->value, "2");
  w.now = 3;
  m.run(w.now, w);
  EXPECT_EQ(w.motions.size(), 4u);
  // The output is written behind its motion.
  EXPECT_EQ(m.evaluate("i")->value, "4");
  EXPECT_EQ(w.writes.size(), 1u);
  w.now = 4;
  EXPECT_EQ(m.run(w.now, w).state, RunState::over);
  EXPECT_EQ(w.write_times, (std::vector<double>{3, 4}));
}

TEST(Machine, WaitForHasATimeout) {
  Machine m =
      loaded(body("WAIT FOR a TIMEOUT 0.5; WRITE(R_TIMEOUT); WAIT FOR a TIMEOUT 5.0; "
                  "WRITE(R_TIMEOUT);",
                  "SIGNAL INPUT BOOL: a AT 1;"));
  TestWorld w;
  m.run(0, w);
  EXPECT_EQ(m.status().waits[0].until, std::optional<double>(0.5));
  w.now = 0.5;
  m.run(w.now, w);
  EXPECT_EQ(w.text, "TRUE");
  w.inputs["a"] = {1, 0};
  w.now = 1;
  EXPECT_EQ(m.run(w.now, w).state, RunState::over);
  EXPECT_EQ(w.text, "TRUEFALSE");
}

TEST(Machine, UntilCallsItsProcedureBehindTheMotion) {
  Machine m = loaded(body("MOVE LIN q UNTIL a AND n > 3 DO found; WRITE('after');",
                          "SIGNAL INPUT BOOL: a AT 1; INPUT INT: n AT 2;\nVAR "
                          "POSE: q := POSE(POSITION(1.0,2.0,3.0), ORIZYX(0.0,0.0,0.0));"
                          "PROCEDURE found; BEGIN WRITE('found '); ENDPROC;"));
  TestWorld w;
  w.braking = 0.2;
  m.run(0, w);
  EXPECT_EQ(m.status().waits[0].signals.size(), 2u);
  w.inputs["a"] = {1, 0};
  w.now = 0.25;
  m.run(w.now, w);
  EXPECT_TRUE(w.aborted.empty());
  w.inputs["n"] = {4, 0};
  w.now = 0.5;
  m.run(w.now, w);
  ASSERT_EQ(w.aborted.size(), 1u);
  EXPECT_EQ(w.text, "");
  w.now = 0.6;
  m.run(w.now, w);
  EXPECT_EQ(w.text, "");
  w.now = 0.7;
  EXPECT_EQ(m.run(w.now, w).state, RunState::over);
  EXPECT_EQ(w.text, "found after");
}

TEST(Machine, ProcessesRunByPriorityAndNumber) {
  Machine m = loaded(R"(PROGRAM p;
VAR SEMAPHORE: s; INT: k;
PROCESS low PRIORITY -1; BEGIN ACQUIRE(s); WRITE('low '); ENDPROCESS;
PROCESS high PRIORITY 5; BEGIN ACQUIRE(s); WRITE('high '); WAIT 1.0 SEC; WRITE('end '); ENDPROCESS;
PROCESS none; BEGIN ACQUIRE(s); WRITE('none '); LOOP WAIT 0.1 SEC; k := k + 1; ENDLOOP; ENDPROCESS;
BEGIN
  WRITE(GETSTATUS(low));
  START low; START none; START high;
  WAIT 0.1 SEC;
  WRITE(GETSTATUS(low), ' ');
  RELEASE(s); RELEASE(s);
  WAIT 0.05 SEC;
  STOP none; WRITE(GETSTATUS(none)); k := 100;
  WAIT 1.0 SEC;
  WRITE(k, GETSTATUS(high), ' ');
  CONTINUE none; WAIT 0.15 SEC; WRITE(k > 100); CANCEL none; WRITE(GETSTATUS(none));
  RELEASE(s);
ENDPROGRAM;)");
  TestWorld w;
  const Status& s = run_to_end(m, w);
  EXPECT_EQ(fault_of(s), "");
  EXPECT_EQ(w.text, "03 high none 2end 1000 TRUE0low ");
}

TEST(Machine, InterruptsComeOnTheEdgeAndByPriority) {
  Machine m = loaded(R"(PROGRAM p;
SIGNAL INPUT BOOL: a AT 1; INPUT BOOL: b AT 2; OUTPUT BOOL: g AT 3;
VAR POSE: q := POSE(POSITION(1.0,2.0,3.0), ORIZYX(0.0,0.0,0.0)); INT: n;
INTERRUPT low PRIORITY 1 WHEN a; BEGIN g := TRUE; WRITE('low< '); WAIT 0.5 SEC; WRITE('>low '); ENDINTERRUPT;
INTERRUPT high PRIORITY 2 WHEN b AND n = 0; BEGIN WRITE('high '); ENDINTERRUPT;
BEGIN
  ENABLE low; ENABLE high;
  MOVE LIN q;
  WRITE('moved ');
  DISABLE low;
  MOVE LIN q;
ENDPROGRAM;)");
  TestWorld w;
  m.run(0, w);
  EXPECT_EQ(m.status().watched.size(), 2u);
  w.inputs["a"] = {1, 0};
  w.now = 0.1;
  m.run(w.now, w);
  EXPECT_EQ(w.text, "low< ");
  EXPECT_EQ(w.writes.size(), 1u);  // at once, while the motion goes on
  w.inputs["b"] = {1, 0};
  w.now = 0.2;
  m.run(w.now, w);
  EXPECT_EQ(w.text, "low< high ");
  w.now = 0.3;  // b stays: no edge
  m.run(w.now, w);
  w.now = 0.6;
  m.run(w.now, w);
  EXPECT_EQ(w.text, "low< high >low ");
  w.now = 1;
  m.run(w.now, w);
  EXPECT_EQ(w.text, "low< high >low moved ");
  w.inputs["a"] = {0, 0};
  w.now = 1.1;
  m.run(w.now, w);
  w.inputs["a"] = {1, 0};
  w.now = 1.2;
  m.run(w.now, w);
  w.now = 2;
  EXPECT_EQ(m.run(w.now, w).state, RunState::over);
  EXPECT_EQ(w.text, "low< high >low moved ");
}

TEST(Machine, AnAssignmentHasItsValueBeforeTheCallsOfItsPlace) {
  Machine m = [] {
    auto made = Machine::load(compiled({{"p.irl", R"(PROGRAM p;
VAR INT: i := 1; ARRAY [1..4] OF INT: a;
FUNCTION next: INT; BEGIN i := i + 1; RETURN i; ENDFCT;
BEGIN
  a[next] := i;
  a[next] := i + next;
  WRITE(a);
ENDPROGRAM;)"}}));
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().sentence());
    return std::move(made).value();
  }();
  TestWorld w;
  m.run(0, w);
  // 1 to a[2], then 2 + 3 to a[4].
  EXPECT_EQ(w.text, "[0, 1, 0, 5]");
}

TEST(Machine, HaltPauseTeachAndFiles) {
  Machine m = [] {
    auto made = Machine::load(compiled({{"p.irl", R"(PROGRAM p;
DATALIST 'p.dls';
VAR INT: a, b; POSITION: q; TEXT: t; FILE: f; STRING: s; REAL: r; BOOL: x; CHAR: c;
BEGIN
  TEACH a, q;
  WRITE(a, q, b, ' ');
  PAUSE 'look';
  OPEN(t, 'out.txt', 'W'); WRITELN(t, 'line ', 5); WRITE(t, 2.5, ' TRUE x'); CLOSE(t);
  OPEN(t, 'out.txt', 'R'); READLN(t, s); READ(t, r, x); READ(t, c); READ(t, c);
  WRITE(s, '|', r, x, c, EOF(t), EOL(t)); CLOSE(t);
  OPEN(f, 'values', 'W'); WRITE(f, 'two lines', 7); CLOSE(f);
  OPEN(f, 'values', 'R'); READ(f, s, b); WRITE(s, b); CLOSE(f);
  READLN(a, r); WRITE(' ', a + r);
  HALT;
  WRITE('never');
ENDPROGRAM;)"},
                                        {"p.dls", "a := 7;\nq := POSITION(1.0, 2.0, 3.0);\n"}}));
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().sentence());
    return std::move(made).value();
  }();
  TestWorld w;
  m.run(0, w);
  EXPECT_EQ(w.text, "7(1.0, 2.0, 3.0)0 ");
  EXPECT_EQ(w.pauses, (std::vector<std::string>{"look"}));
  ASSERT_EQ(m.status().waits.size(), 1u);
  EXPECT_EQ(m.status().waits[0].message, "look");
  EXPECT_FALSE(m.resume_pause(5));
  EXPECT_TRUE(m.resume_pause());
  m.run(1, w);
  ASSERT_EQ(m.status().waits.size(), 1u);
  EXPECT_EQ(m.status().waits[0].kind, WaitKind::line);
  w.lines = {"3", "0.5 and more"};
  m.run(2, w);
  m.run(3, w);
  EXPECT_EQ(w.text, "7(1.0, 2.0, 3.0)0 line 5|2.5TRUExTRUETRUEtwo lines7 3.5");
  EXPECT_EQ(w.files["out.txt"], "line 5\n2.5 TRUE x");
  EXPECT_EQ(m.status().state, RunState::over);
  EXPECT_TRUE(m.status().is_halted);
}

TEST(Machine, RobotStateAndKinematics) {
  Machine m = loaded(R"(PROGRAM p;
TYPE RECORD JOINT: R_JOINT_ACT; ROBTARGET: R_ROBTARGET_ACT; REAL: R_SPEED_ACT; INT: other; ENDRECORD: R_SPEC_TYPE;
TYPE RECORD INT: x; ENDRECORD: DUMMY;
TYPE ROBOT arm := R_SPEC_TYPE(JOINT(MAIN_JOINT(0.0,0.0,0.0,0.0,0.0,0.0),ADD_JOINT(0.0)),
  ROBTARGET(POSE(POSITION(0.0,0.0,0.0),ORIZYX(0.0,0.0,0.0)),0,[0,0],ADD_JOINT(0.0)), 0.0, 5);
VAR ROBTARGET: t; JOINT: j;
BEGIN
  WRITE(arm.R_JOINT_ACT.M_JOINT.A2, ' ', arm.R_SPEED_ACT, ' ', arm.other, ' ', arm.R_ROBTARGET_ACT.STATUS);
  t := TRAFO(arm.R_JOINT_ACT); WRITE(' ', t.PSE.POS);
  j := TRAFOINV(t); WRITE(' ', j.M_JOINT.A1);
  t.PSE.POS.X := 2000.0;
  j := TRAFOINV(t);
ENDPROGRAM;)");
  TestWorld w;
  w.state.joints = {10, 20, 30, 40, 50, 60};
  w.state.status = 4;
  w.state.turns = {1};
  const Status& s = run_to_end(m, w);
  EXPECT_EQ(w.text, "20.0 12.5 5 4 (10.0, 1.0, 2.0) 10.0");
  EXPECT_EQ(fault_of(s), "p.irl:12:3: the target is out of reach. Move it nearer.");
}

TEST(Machine, CopiesRunByThemselves) {
  Machine a = loaded(body(
      "FOR i := 1 TO 5 WAIT 1.0 SEC; LIST_ADD(l, i); s := CONCAT(s, 'x'); ENDFOR; WRITE(l, s);",
      "VAR INT: i; LIST OF INT: l; STRING: s;"));
  TestWorld w;
  std::vector<Machine> rows;
  for (int t = 0; t < 5; ++t) {
    a.run(t, w);
    rows.push_back(a);
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    TestWorld other;
    for (int t = static_cast<int>(k); t <= 5; ++t) rows[k].run(t, other);
    EXPECT_EQ(other.text, "[1, 2, 3, 4, 5]xxxxx") << k;
  }
  a.restart();
  EXPECT_EQ(a.status().state, RunState::busy);
  TestWorld again;
  EXPECT_EQ(run_to_end(a, again).state, RunState::over);
  EXPECT_EQ(again.text, "[1, 2, 3, 4, 5]xxxxx");
}

TEST(Machine, SlicesCancelAndBounds) {
  Limits limits;
  limits.slice = 1000;
  Machine m = loaded(
      body("LOOP i := i + 1; IF i = 5000 THEN EXIT; ENDIF; ENDLOOP; WRITE(i);", "VAR INT: i;"),
      limits);
  TestWorld w;
  int runs = 0;
  while (m.run(0, w).state == RunState::busy) ++runs;
  EXPECT_EQ(w.text, "5000");
  EXPECT_GT(runs, 10);
  EXPECT_LT(runs, 40);
  Machine endless = loaded(body("LOOP ENDLOOP;"), limits);
  std::atomic<bool> cancel{true};
  EXPECT_EQ(endless.run(0, w, &cancel).state, RunState::cancelled);
  cancel = false;
  EXPECT_EQ(endless.run(0, w, &cancel).state, RunState::busy);
  limits.most_instructions = 20'000;
  Machine bounded = loaded(body("LOOP ENDLOOP;"), limits);
  while (bounded.run(0, w).state == RunState::busy) {
  }
  EXPECT_NE(fault_of(bounded.status()).find("more than 20000 instructions"), std::string::npos);
  // Time does not fall.
  Machine back = loaded(body("WAIT 5.0 SEC;"));
  back.run(3, w);
  EXPECT_NE(fault_of(back.run(2, w)).find("Give a time that is not before the previous one"),
            std::string::npos);
  // Many strings and lists are no leak.
  limits = {};
  limits.most_bytes = 3 << 20;
  Machine strings = loaded(body("FOR i := 1 TO 200000 s := CONCAT('abc', 'def'); LIST_CLEAR(l); "
                                "LIST_ADD(l, s); ENDFOR; WRITE(l);",
                                "VAR INT: i; STRING: s; LIST OF STRING: l;"),
                           limits);
  TestWorld w2;
  EXPECT_EQ(fault_of(run_to_end(strings, w2)), "");
  EXPECT_EQ(w2.text, "[abcdef]");
  // A program whose variables do not fit is refused.
  auto big =
      Machine::load(compiled(body("a[1] := 1;", "VAR ARRAY [1..1000000] OF INT: a;")), limits);
  ASSERT_FALSE(big.ok());
  EXPECT_NE(big.error().sentence().find("3145728 bytes"), std::string::npos);
}

TEST(Machine, DebuggerStopsStepsAndChanges) {
  Machine m = loaded(R"(PROGRAM p;
TYPE RECORD INT: x; ARRAY [2..3] OF REAL: v; ENDRECORD: REC;
VAR INT: i; REC: r; LIST OF INT: l; STRING: s := 'abc';
POSE: q := POSE(POSITION(1.0,2.0,3.0), ORIZYX(0.0,0.0,0.0));
PROCEDURE add(IN INT: n; INOUT INT: total);
VAR INT: here;
BEGIN
  here := n * 2;
  total := total + here;
ENDPROC;
BEGIN
  FOR i := 1 TO 5
    add(i, r.x);
    r.v[2] := r.x / 2;
  ENDFOR;
  LIST_ADD(l, i);
  MOVE LIN q;
  WRITELN(r.x);
ENDPROGRAM;)");
  TestWorld w;
  Breakpoint b;
  b.line = 9;
  b.condition = "n >= 2 AND here = 2 * n";
  b.ignore = 1;
  auto set = m.set_breakpoint(b);
  ASSERT_TRUE(set.ok()) << set.error().sentence();
  EXPECT_EQ(set->line, 9u);
  ASSERT_EQ(m.run(0, w).state, RunState::stopped);
  EXPECT_EQ(m.status().stop->reason, StopReason::breakpoint);
  EXPECT_EQ(m.evaluate("n")->value, "3");
  EXPECT_EQ(m.evaluate("total")->value, "6");
  EXPECT_EQ(m.evaluate("i + R.X", 0, 1)->value, "9");
  const auto stack = m.call_stack();
  ASSERT_EQ(stack.size(), 2u);
  EXPECT_EQ(stack[0].name, "add");
  EXPECT_EQ(stack[0].span.line, 9u);
  EXPECT_EQ(stack[1].span.line, 13u);
  const auto locals = m.variables(0, 0);
  ASSERT_EQ(locals.size(), 3u);
  EXPECT_EQ(locals[1].name, "total");
  EXPECT_EQ(locals[1].value, "6");
  EXPECT_EQ(locals[2].value, "6");
  // Set a variable behind a reference, and go on.
  auto changed = m.assign("total", "1000");
  ASSERT_TRUE(changed.ok()) << changed.error().sentence();
  m.remove_breakpoint(set->number);
  m.step(StepKind::out);
  ASSERT_EQ(m.run(0, w).state, RunState::stopped);
  EXPECT_EQ(m.call_stack().size(), 1u);
  EXPECT_EQ(m.evaluate("r.x")->value, "1006");
  EXPECT_EQ(m.status().stop->span.line, 14u);
  EXPECT_TRUE(m.assign("r.v[3]", "-2.5e1 * 2").ok());
  EXPECT_EQ(m.evaluate("r")->value, "(1006, [3.0, -50.0])");
  const auto globals = m.globals();
  const auto found =
      std::find_if(globals.begin(), globals.end(), [](const Variable& v) { return v.name == "r"; });
  ASSERT_NE(found, globals.end());
  EXPECT_EQ(found->type, "REC");
  ASSERT_EQ(found->parts.size(), 2u);
  EXPECT_EQ(found->parts[1].type, "ARRAY [2..3] OF REAL");
  EXPECT_EQ(found->parts[1].parts[1].name, "[3]");
  EXPECT_EQ(found->parts[1].parts[1].value, "-50.0");
  m.step(StepKind::motion);
  ASSERT_EQ(m.run(0, w).state, RunState::stopped);
  EXPECT_EQ(m.status().stop->reason, StopReason::motion);
  EXPECT_TRUE(w.motions.empty());
  EXPECT_EQ(m.status().stop->span.line, 17u);
  for (const auto& [place, value, sentence] :
       {std::tuple{"i", "'x'", "it is INT, but the value is STRING"},
        std::tuple{"nothing", "1", "nothing that has a value is named NOTHING"},
        std::tuple{"r.y", "1", "REC has no field Y"}, std::tuple{"l[2]", "1", "outside 1..1"},
        std::tuple{"r.v[1]", "1", "outside 2..3"}, std::tuple{"5", "1", "this is not a variable"},
        std::tuple{"i", "1 +", "the end"},
        std::tuple{"i", "SIN(1.0)", "a debugger cannot call functions"}}) {
    const auto refused = m.assign(place, value);
    ASSERT_FALSE(refused.ok()) << place;
    EXPECT_NE(refused.error().sentence().find(sentence), std::string::npos)
        << refused.error().sentence();
  }
  EXPECT_TRUE(m.assign("s[2]", "'Z'").ok());
  EXPECT_EQ(m.evaluate("s")->value, "aZc");
  m.pause();
  EXPECT_EQ(m.run(0, w).state, RunState::waiting);  // the motion at which it stood
  w.now = 1;
  ASSERT_EQ(m.run(w.now, w).state, RunState::stopped);
  EXPECT_EQ(m.status().stop->reason, StopReason::pause_wish);
  EXPECT_EQ(run_to_end(m, w).state, RunState::over);
  b.line = 99;
  EXPECT_FALSE(m.set_breakpoint(b).ok());
  b.line = 9;
  b.condition = "i = = 1";
  EXPECT_FALSE(m.set_breakpoint(b).ok());
  b.condition = "";
  b.file = "other.irl";
  EXPECT_FALSE(m.set_breakpoint(b).ok());
}

TEST(Machine, RefusesConditionsThatNoLineCanHave) {
  Machine m = loaded(R"(PROGRAM p;
TYPE RECORD INT: a; ENDRECORD: REC;
VAR INT: i, sum; BOOL: is_on; REC: r; ARRAY [1..3] OF INT: v; LIST OF INT: l; STRING: s;
PROCEDURE add(IN INT: n);
BEGIN
  sum := sum + n;
ENDPROC;
BEGIN
  add(1);
ENDPROGRAM;)");
  const auto refusal = [&m](std::uint32_t line, const char* condition) {
    Breakpoint b;
    b.line = line;
    b.condition = condition;
    const auto set = m.set_breakpoint(b);
    return set.ok() ? std::string() : set.error().sentence();
  };
  for (const auto& [line, condition, sentence] :
       {std::tuple{6u, "zz = 1", "nothing that has a value is named ZZ"},
        std::tuple{6u, "sum", "a condition must be BOOL, but this is INT"},
        std::tuple{6u, "1 DIV 0 = 1", "divides by zero"},
        std::tuple{6u, "sum DIV 0 = 1", "divides by zero"},
        std::tuple{6u, "sum = 'a'", "cannot combine INT and STRING"},
        std::tuple{6u, "v[9] = 1", "the index 9 is outside 1..3"},
        std::tuple{6u, "is_on AND v[-1] = 1", "outside 1..3"},
        std::tuple{6u, "sum[1] = 1", "INT has no elements"},
        std::tuple{6u, "r.b = 1", "REC has no field B"}, std::tuple{6u, "NOT sum", "condition"},
        std::tuple{6u, "is_on OR sum", "OR joins conditions"},
        std::tuple{6u, "r.a + is_on > 1", "INT and BOOL"},
        std::tuple{6u, "add(1)", "a debugger cannot call functions"},
        std::tuple{9u, "n = 1", "named N"}}) {
    EXPECT_NE(refusal(line, condition).find(sentence), std::string::npos)
        << condition << ": " << refusal(line, condition);
  }
  for (const char* condition :
       {"n = 1", "is_on", "v[n] = 1 AND l[n] > 2", "r.a DIV n = 2.5 OR s[1] = 'a'", "v[3] = -1",
        "NOT (is_on EXOR n < 3)", "FALSE AND v[n] DIV sum = 1", "l[9] = 1"})
    EXPECT_EQ(refusal(6, condition), "") << condition;
}

TEST(Machine, StopsWhereAConditionHasNoValueAndSaysWhy) {
  Machine m = loaded(R"(PROGRAM p;
VAR INT: i, sum; ARRAY [1..3] OF INT: v;
BEGIN
  FOR i := 0 TO 4
    sum := sum + 1;
  ENDFOR;
ENDPROGRAM;)");
  Breakpoint b;
  b.line = 5;
  b.condition = "i > 0 AND v[i] = 1";  // asked from 1 on, without a value at 4
  b.log = "never";
  const auto set = m.set_breakpoint(b);
  ASSERT_TRUE(set.ok()) << set.error().sentence();
  TestWorld w;
  ASSERT_EQ(m.run(0, w).state, RunState::stopped);
  EXPECT_EQ(m.status().stop->reason, StopReason::breakpoint);
  EXPECT_EQ(m.status().stop->breakpoint, set->number);
  EXPECT_EQ(m.status().stop->message,
            "The condition of the breakpoint has no value here: the index 4 is outside 1..3.");
  EXPECT_EQ(m.evaluate("i")->value, "4");
  EXPECT_EQ(m.breakpoints().front().hits, 0u);
  EXPECT_EQ(run_to_end(m, w).state, RunState::over);
  EXPECT_EQ(m.evaluate("sum")->value, "5");
}

TEST(Machine, KnowsEveryFunctionOfTheLanguage) {
  const std::string head =
      "PROGRAM p; TYPE RECORD INT: x; ENDRECORD: R_SPEC_TYPE; ROBOT arm := R_SPEC_TYPE(1);"
      "VAR INT: i := 1; REAL: r := 1.0; CHAR: c; BOOL: b; STRING: s := 'ab';"
      "POSITION: p1; ORIENTATION: o; POSE: q; JOINT: j; ROBTARGET: t; SEMAPHORE: m;"
      "LIST OF INT: l; FILE: f; PROCESS side; BEGIN ENDPROCESS; BEGIN ";
  const std::map<char, std::string> kArguments{
      {'i', "i"},  {'r', "r"}, {'n', "i"}, {'c', "c"},     {'b', "b"}, {'s', "s"},
      {'p', "p1"}, {'o', "o"}, {'P', "q"}, {'J', "j"},     {'T', "t"}, {'x', "side"},
      {'S', "m"},  {'L', "l"}, {'F', "f"}, {'B', "s"},     {'e', "i"}, {'l', "l"},
      {'a', "s"},  {'w', "r"}, {'m', "i"}, {'q', "0, arm"}};
  for (const irl::Intrinsic& x : irl::intrinsics()) {
    std::string call(x.name);
    call += '(';
    for (const char p : x.parameters) call += (call.back() == '(' ? "" : ", ") + kArguments.at(p);
    call += ')';
    if (x.result == "R") call = "R_ACT_ROB := arm; i := R_ACT_ROB.x";
    const bool is_statement = x.result.empty() || x.result == "R";
    const std::string text = head + (is_statement ? call : "WRITE(" + call + ")") + "; ENDPROGRAM;";
    auto m = Machine::load(compiled(text));
    EXPECT_TRUE(m.ok()) << text << (m.ok() ? "" : m.error().sentence());
  }
}

TEST(Machine, AComputedStepCountsBothWaysAndIsNotZero) {
  const std::string vars = "VAR INT: i, n, least := -2147483648;";
  const std::pair<const char*, const char*> kLoops[] = {
      {"n := -2; FOR i := 5 TO 0 STEP n WRITE(i, ' '); ENDFOR; WRITE('|', i);", "5 3 1 |1"},
      {"n := 2; FOR i := 0 TO 5 STEP n WRITE(i, ' '); ENDFOR; WRITE('|', i);", "0 2 4 |4"},
      {"n := 2; FOR i := 5 TO 0 STEP n WRITE(i); ENDFOR; WRITE('|', i);", "|5"},
      {"n := -1; FOR i := 0 TO 3 STEP n WRITE(i); ENDFOR; WRITE('|', i);", "|0"},
      {"n := 2; FOR i := 5 DOWNTO 0 STEP n WRITE(i, ' '); ENDFOR; WRITE('|', i);", "5 3 1 |1"},
      {"n := -2; FOR i := 0 DOWNTO 5 STEP n WRITE(i, ' '); ENDFOR; WRITE('|', i);", "0 2 4 |4"},
      // The last value is the end of what an INT holds.
      {"n := least; FOR i := 2147483647 TO least STEP n WRITE(i, ' '); ENDFOR; WRITE('|', i);",
       "2147483647 -1 |-1"},
      {"n := least; FOR i := least DOWNTO 5 STEP n WRITE(i, ' '); ENDFOR; WRITE('|', i);",
       "-2147483648 0 |0"},
      // It is computed once.
      {"n := -1; FOR i := 3 TO 1 STEP n n := 7; WRITE(i, ' '); ENDFOR; WRITE('|', n);", "3 2 1 |7"},
      {"FOR i := 1 TO 3 STEP n WRITE(i); ENDFOR;",
       "p.irl:4:1: STEP of the FOR is 0, so the loop would never end. A positive STEP counts "
       "upwards, a negative one downwards."},
      {"FOR i := 1 DOWNTO 3 STEP n WRITE(i); ENDFOR;", "p.irl:4:1: STEP of the FOR is 0"}};
  for (const auto& [loop, said] : kLoops) {
    EXPECT_EQ(written(body(loop, vars)).substr(0, std::string(said).size()), said) << loop;
    // The same when the code comes from its text.
    auto back = read_code_text(code_text(compiled(body(loop, vars))->code()));
    ASSERT_TRUE(back.ok()) << back.error().sentence();
    auto m = Machine::load(std::shared_ptr<const CompiledProgram>(std::move(back).value()));
    ASSERT_TRUE(m.ok()) << m.error().sentence();
    TestWorld w;
    const std::string fault = fault_of(run_to_end(*m, w));
    EXPECT_EQ((w.text + (fault.empty() ? "" : "p.irl" + fault)).substr(0, 5),
              std::string(said).substr(0, 5))
        << loop;
  }
}

/// A cell with two robots.
const std::string kTwoRobots =
    R"(TYPE RECORD JOINT: R_JOINT_ACT; REAL: R_SPEED; ENDRECORD: R_SPEC_TYPE;
CONST JOINT: zero := JOINT(MAIN_JOINT(0.0,0.0,0.0,0.0,0.0,0.0),ADD_JOINT(0.0));
TYPE ROBOT arm := R_SPEC_TYPE(zero, 1.0); ROBOT hand := R_SPEC_TYPE(zero, 2.0);
SIGNAL INPUT BOOL: near AT 1;
VAR POSE: a := POSE(POSITION(1.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0)); INT: mode;
)";

TEST(Machine, BrakeEndsTheMotionThatAnInterruptCameInto) {
  Machine m = loaded("PROGRAM p;\n" + kTwoRobots + R"(
INTERRUPT stop WHEN near; BEGIN WRITE('< '); BRAKE; WRITE('stands '); WAIT 0.2 SEC; WRITE('> '); ENDINTERRUPT;
BEGIN
  ENABLE stop; MOVE LIN a, a UNTIL FALSE; WRITE('next '); MOVE LIN a; WRITE('end');
ENDPROGRAM;)");
  TestWorld w;
  w.motion_seconds = 5;
  w.braking = 0.3;
  for (; w.now < 1; w.now += 0.01) m.run(w.now, w);
  w.inputs["near"] = {1, 0};
  m.run(w.now, w);
  EXPECT_EQ(w.text, "< ");
  ASSERT_EQ(m.status().waits.size(), 2u);
  EXPECT_EQ(m.status().waits[0].kind, WaitKind::motion);
  EXPECT_EQ(m.status().waits[0].motions, std::vector<std::uint64_t>{1});
  EXPECT_EQ(m.status().waits[1].kind, WaitKind::interrupt);
  EXPECT_EQ(fault_of(run_to_end(m, w)), "");
  // The process goes on behind the motion, and its UNTIL has not held.
  EXPECT_EQ(w.text, "< stands > next end");
  EXPECT_EQ(w.aborted,
            (std::vector<std::pair<std::uint64_t, AbortReason>>{{1, AbortReason::until}}));
  ASSERT_EQ(w.begun.size(), 2u);
  EXPECT_NEAR(w.begun[1], 1.5, 0.03);  // braking and the wait of the routine
}

TEST(Machine, BrakeHoldsAMotionUntilTheInterruptsRoutineHasEnded) {
  Machine m = loaded("PROGRAM p;\n" + kTwoRobots + R"(
INTERRUPT hold WHEN near; BEGIN BRAKE(1); WRITE('held '); WAIT 2.0 SEC; WRITE('on '); ENDINTERRUPT;
BEGIN
  ENABLE hold; MOVE LIN a; WRITE('end');
ENDPROGRAM;)");
  TestWorld w;
  w.motion_seconds = 3;
  for (; w.now < 1; w.now += 0.01) m.run(w.now, w);
  w.inputs["near"] = {1, 0};
  EXPECT_EQ(fault_of(run_to_end(m, w)), "");
  EXPECT_EQ(w.text, "held on end");
  EXPECT_EQ(w.held, std::vector<std::uint64_t>{1});
  EXPECT_EQ(w.resumed, std::vector<std::uint64_t>{1});
  EXPECT_TRUE(w.aborted.empty());
}

TEST(Machine, BrakeOfARobotIsOfItsMotionsWhoeverMovesIt) {
  Machine m = loaded("PROGRAM p;\n" + kTwoRobots + R"(
PROCESS left; BEGIN MOVE LIN a ACT_ROB := arm; WRITE('left '); MOVE LIN a ACT_ROB := hand; WRITE('hand '); ENDPROCESS;
PROCESS right; BEGIN R_ACT_ROB := hand; MOVE LIN a; WRITE('right '); ENDPROCESS;
BEGIN
  START left; START right; WAIT 1.0 SEC; BRAKE(mode, arm); WRITE('braked ');
ENDPROGRAM;)");
  TestWorld w;
  w.motion_seconds = 4;
  w.braking = 0.5;
  EXPECT_EQ(fault_of(run_to_end(m, w)), "");
  // What the other process begins meanwhile is not braked.
  EXPECT_TRUE(w.text == "braked left right hand " || w.text == "left braked right hand ") << w.text;
  ASSERT_EQ(w.motions.size(), 3u);
  EXPECT_EQ(w.motions[0].attributes.robot, "arm");
  EXPECT_EQ(w.motions[1].attributes.robot, "hand");  // by R_ACT_ROB
  ASSERT_EQ(w.aborted.size(), 1u);
  EXPECT_EQ(w.aborted[0].first, 1u);
  EXPECT_NEAR(w.begun[2], 1.5, 0.03);
}

TEST(Machine, BrakeSaysWhatItCannotDo) {
  const auto run = [](const std::string& declarations, const std::string& statements) {
    Machine m = loaded("PROGRAM p;\n" + kTwoRobots + declarations + "\nBEGIN\n" + statements +
                       "\nENDPROGRAM;");
    TestWorld w;
    w.motion_seconds = 100;
    w.inputs["near"] = {0, 0};
    for (; w.now < 0.5; w.now += 0.01) m.run(w.now, w);
    w.inputs["near"] = {1, 0};
    const Status& s = run_to_end(m, w, 300);
    return w.text + (s.fault ? s.fault->message : std::string());
  };
  EXPECT_EQ(run("", "mode := 2; BRAKE(mode);"), "BRAKE has no mode 2");
  EXPECT_EQ(
      run("", "BRAKE(1);"),
      "BRAKE(1) holds a motion until the routine of an interrupt has ended, but this is not one");
  EXPECT_EQ(run("", "BRAKE; WRITE('nothing moves');"), "nothing moves");
  EXPECT_EQ(run("INTERRUPT it WHEN near; BEGIN BRAKE(1); MOVE LIN a; ENDINTERRUPT;",
                "ENABLE it; MOVE LIN a;"),
            "BRAKE holds a motion of this process, and another motion cannot begin before it ends");
  EXPECT_EQ(run("FUNCTION f: BOOL; BEGIN BRAKE; RETURN TRUE; ENDFCT;", "MOVE LIN a UNTIL f();"),
            "a condition of UNTIL or WHEN brakes");
}

TEST(Machine, SignalsHaveValuesThatTheyCanHold) {
  const auto program = compiled(
      "PROGRAM p; SIGNAL INPUT BOOL: b AT 1; INPUT INT: four AT 2, 4; INPUT INT: n AT 6; INPUT "
      "REAL: "
      "r AT 1; BEGIN ENDPROGRAM;");
  const rmp_code& c = program->code();
  const auto said = [&](const std::string& name, double value) {
    for (std::uint32_t s = 0; s < c.symbols.count; ++s)
      if (const auto& x = row<rmp_code_symbol>(c.symbols, s); x.name == name) {
        const auto fits = fits_signal(x, value);
        return fits.ok() ? std::string() : fits.error().sentence();
      }
    return std::string("no such signal");
  };
  for (const auto& [name, value] : {std::pair("b", 0.0),
                                    {"b", 1.0},
                                    {"four", 0.0},
                                    {"four", 15.0},
                                    {"n", -2147483648.0},
                                    {"n", 2147483647.0},
                                    {"r", -0.5},
                                    {"r", 1e300}})
    EXPECT_EQ(said(name, value), "") << name << " " << value;
  EXPECT_EQ(said("b", 0.5), "the input b cannot be 0.5. It must be a BOOL: TRUE (1) or FALSE (0).");
  EXPECT_EQ(said("four", 99), "the input four cannot be 99. Its 4 bits hold 0 to 15.");
  EXPECT_EQ(said("n", 0.5), "the input n cannot be 0.5. It must be an INT, a whole number.");
  for (const auto& [name, value] : {std::pair("b", 1e300),
                                    {"b", -1.0},
                                    {"four", -1.0},
                                    {"four", 16.0},
                                    {"n", 2147483648.0},
                                    {"n", std::nan("")},
                                    {"r", std::nan("")}})
    EXPECT_NE(said(name, value), "") << name << " " << value;
}

TEST(Machine, ALogPointWhoseTextHasNoValueIsRefused) {
  Machine m = loaded(body("i := 1;\ni := 2;", "VAR INT: i; ARRAY [1..2] OF INT: a;"));
  Breakpoint b;
  b.line = 4;
  b.log = "i is {i}, {zz} is not";
  const auto refused = m.set_breakpoint(b);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().sentence().find("the text of a log point"), std::string::npos)
      << refused.error().sentence();
  EXPECT_NE(refused.error().sentence().find("named ZZ"), std::string::npos)
      << refused.error().sentence();
  // What only its values tell is said when it comes there.
  b.log = "i is {i}, {a[i]}, {a[i + 5]} { and this";
  ASSERT_TRUE(m.set_breakpoint(b).ok());
  TestWorld w;
  EXPECT_EQ(fault_of(run_to_end(m, w)), "");
  EXPECT_EQ(
      w.text,
      "i is 0, {a[i]: the index 0 is outside 1..2}, {a[i + 5]: the index 5 is outside 1..2} { "
      "and this\n");
}

TEST(Machine, ProgramsReadWhatTheirRobotDoes) {
  Machine m = loaded("PROGRAM p;\n" + kTwoRobots + R"(
VAR JOINT: j; ROBTARGET: t;
BEGIN
  MOVE LIN a C_CP := 5.0;  { it is read behind the motion }
  j := R_JOINT_ACT; t := R_ROBTARGET_ACT;
  WRITE(j.M_JOINT.A2, ' ', R_JOINT_ACT.M_JOINT.A3, ' ', t.STATUS, ' ', R_ROBTARGET_ACT.PSE.POS.X, ' ', R_SPEED_ACT);
  WRITE(' ', R_FLANGE_ACT.POS);
  R_ACT_ROB := hand;
  WRITE(' ', R_ACT_ROB.R_SPEED, ' ', R_ACT_ROB.R_JOINT_ACT.M_JOINT.A1);
ENDPROGRAM;)");
  TestWorld w;
  w.state.joints = {10, 20, 30, 40, 50, 60};
  w.state.status = 4;
  w.state.pose.position = {7, 8, 9};
  EXPECT_EQ(fault_of(run_to_end(m, w)), "");
  EXPECT_EQ(w.text, "20.0 30.0 4 7.0 12.5 (1.0, 2.0, 3.0) 2.0 10.0");
  EXPECT_GE(w.now, 1);
  Machine none =
      loaded("PROGRAM p;\n" + kTwoRobots + "BEGIN WRITE(R_ACT_ROB.R_SPEED); ENDPROGRAM;");
  TestWorld other;
  EXPECT_EQ(fault_of(run_to_end(none, other)).substr(0, 60),
            std::string("p.irl:7:7: R_ACT_ROB has not been set to a robot yet. Choose one first")
                .substr(0, 60));
}

TEST(Machine, TargetsAndAttributesAreThoseOfTheirStatement) {
  // The original kept targets by a pointer to a temporary that was used again.
  Machine m = loaded(R"(PROGRAM p;
VAR INT: i;
FUNCTION spot(IN INT: n): POSE;
BEGIN
  RETURN POSE(POSITION(n, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0));
ENDFCT;
BEGIN
  MOVE PATH spot(1), spot(2), spot(3);
  FOR i := 4 TO 5 MOVE LIN spot(i) SPEED := 10.0 * i, C_PASS := TRUE; ENDFOR;
ENDPROGRAM;)");
  TestWorld w;
  EXPECT_EQ(fault_of(run_to_end(m, w)), "");
  std::string xs;
  for (const Motion& x : w.motions)
    for (const Target& t : x.targets) xs += std::to_string(std::lround(t.pose.position[0]));
  EXPECT_EQ(xs, "12345");
  EXPECT_EQ(w.motions[2].attributes.speed, 50);
  EXPECT_EQ(w.motions[2].attributes.given, (1u << RMP_ATTR_SPEED) | (1u << RMP_ATTR_C_PASS));
  EXPECT_TRUE(w.motions[2].approximates);
  // What a program does not say is what the language's variables begin with.
  EXPECT_EQ(w.motions[0].attributes, MotionAttributes{});
}

TEST(Machine, AConditionIsNotPutOffByAFullSlice) {
  Limits limits;
  limits.slice = 200;
  Machine m = loaded(R"(PROGRAM p;
SIGNAL INPUT BOOL: a AT 1;
VAR INT: i;
FUNCTION busy: BOOL;
VAR INT: k;
BEGIN
  FOR k := 1 TO 10 ENDFOR;
  RETURN a;
ENDFCT;
INTERRUPT it WHEN busy(); BEGIN WRITE('it '); ENDINTERRUPT;
BEGIN
  ENABLE it;
  LOOP i := i + 1; IF i > 20000 THEN EXIT; ENDIF; ENDLOOP;
  WRITE(i);
ENDPROGRAM;)",
                     limits);
  TestWorld w;
  for (int k = 0; k < 2000 && m.run(w.now, w).state == RunState::busy; ++k) {
    if (k == 50) w.inputs["a"] = {1, 0};
    w.now += 0.001;
  }
  EXPECT_EQ(fault_of(m.status()), "");
  EXPECT_EQ(w.text, "it 20001");
}

TEST(Machine, StepIntoGoesStatementByStatement) {
  Machine m = loaded(
      "PROGRAM p;\nVAR INT: i;\nFUNCTION f(IN INT: n): INT;\nBEGIN\n  RETURN n + 1;\n"
      "ENDFCT;\nBEGIN\n  i := f(1);\n  i := f(i) + f(0);\n  i := 0;\nENDPROGRAM;\n");
  TestWorld w;
  Breakpoint b;
  b.line = 8;
  ASSERT_TRUE(m.set_breakpoint(b).ok());
  std::string lines;
  m.run(0, w);
  while (m.status().state == RunState::stopped) {
    lines += std::to_string(m.status().stop->span.line) + " ";
    m.step(StepKind::into);
    m.run(0, w);
  }
  EXPECT_EQ(lines, "8 5 8 9 5 9 5 9 10 ");
  m.restart();
  lines = "";
  m.run(0, w);
  while (m.status().state == RunState::stopped) {
    lines += std::to_string(m.status().stop->span.line) + " ";
    m.step(StepKind::over);
    m.run(0, w);
  }
  EXPECT_EQ(lines, "8 9 10 ");
}

/// Processes that `text` begins, started by the program from the first to the last.
std::string started(int count, const std::string& text, const std::string& behind = "") {
  std::string declared = "VAR INT: k; SEMAPHORE: s;\n", starts;
  for (int i = 0; i < count; ++i) {
    const std::string name = "q" + std::to_string(i);
    declared += "PROCESS " + name + "; BEGIN " + text + " k := k + 1; ENDPROCESS;\n";
    starts += "START " + name + ";\n";
  }
  return body(starts + behind, declared);
}

TEST(Machine, StartingProcessesIsLinearInTheirNumber) {
  struct Case {
    const char* waits;
    const char* behind;
  };
  for (const Case& c : {Case{"WAIT 1.0 SEC;", ""}, Case{"", ""},
                        Case{"ACQUIRE(s); RELEASE(s);", "WAIT 1.0 SEC; RELEASE(s);"}})
    for (const int count : {10, 1'000, 10'000}) {
      Machine m = loaded(started(count, c.waits, c.behind));
      TestWorld w;
      m.run(0, w);
      // Once when it is started, once when it waits; the program itself twice for each.
      EXPECT_LE(m.looks(), 4U * static_cast<unsigned>(count) + 4U) << c.waits << count;
      EXPECT_GE(m.looks(), static_cast<unsigned>(count)) << c.waits << count;
      w.now = 1;
      const Status& s = m.run(1, w);
      EXPECT_EQ(s.state, RunState::over) << c.waits << count << fault_of(s);
      EXPECT_LE(m.looks(), 8U * static_cast<unsigned>(count) + 8U) << c.waits << count;
      const auto k = m.evaluate("k", 0, Machine::kNoFrame);
      ASSERT_TRUE(k.ok()) << k.error().sentence();
      EXPECT_EQ(k->value, std::to_string(count)) << c.waits;
    }
}

TEST(Machine, TheBytesOfProcessesAreThoseOfTheirStacks) {
  // The sum that is kept goes up with what a recursion takes and down when its process is over.
  Machine m = loaded(R"(PROGRAM p;
PROCEDURE deep(IN INT: n); VAR ARRAY [1..100] OF INT: a;
BEGIN IF n > 0 THEN deep(n - 1); ELSE WAIT 1.0 SEC; ENDIF; ENDPROC;
PROCESS one; BEGIN deep(50); ENDPROCESS;
BEGIN
  START one; WAIT 2.0 SEC;
  START one; WAIT 2.0 SEC;
ENDPROGRAM;)");
  TestWorld w;
  const auto bytes_at = [&](double t) {
    w.now = t;
    m.run(t, w);
    return m.bytes();
  };
  const std::uint64_t deep = bytes_at(0), ended = bytes_at(1), again = bytes_at(2);
  EXPECT_GE(deep, ended + 50 * 100 * 8);
  EXPECT_EQ(bytes_at(3), ended);
  EXPECT_EQ(again, deep);
}

}  // namespace
}  // namespace robomosp::program
