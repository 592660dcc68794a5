// SPDX-License-Identifier: Apache-2.0
// The front end of IRL: what is accepted and what is refused, with the exact words and places; the
// printed form; three-address code and its text; random and broken sources; growth.
#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compile.h"
#include "intrinsics.h"
#include "irl_generator.h"
#include "support/mutator.h"
#include "support/seed.h"
#include "syntax.h"

namespace robomosp::irl {
namespace {

namespace fs = std::filesystem;

struct File {
  std::string name, text;
};
std::unique_ptr<ProgramTables> compiled_files(const std::vector<File>& files) {
  std::vector<SourceFile> all;
  for (const File& f : files) all.push_back({f.name, f.text, {}});
  NoProgress progress;
  auto made = compile(all, progress);
  EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().sentence());
  return made.ok() ? std::move(made).value() : nullptr;
}
std::unique_ptr<ProgramTables> compiled_files(const std::string& text) {
  return compiled_files(std::vector<File>{{"p.irl", text}});
}
/// "3:7 message. hint" for each fault; warnings begin with "warning ".
std::string faults(const ProgramTables& p) {
  std::string out;
  for (const rmp_code_fault& f : p.faults)
    out += (f.severity ? "warning " : "") +
           (f.span.file ? std::string(p.files[f.span.file].name) + ":" : std::string()) +
           std::to_string(f.span.line) + ":" + std::to_string(f.span.column) + " " + f.message +
           "." + (*f.hint ? " " + std::string(f.hint) : "") + "\n";
  return out;
}
std::string faults(const std::string& text) { return faults(*compiled_files(text)); }
/// The code of a program's own statements, without lines and without what is initialised.
std::string code(const std::string& text, std::uint32_t routine = 0) {
  const auto p = compiled_files(text);
  EXPECT_EQ(faults(*p), "");
  std::istringstream all(code_text(p->code()));
  std::string out, line;
  std::uint32_t r = 0;
  bool is_in = false;
  while (std::getline(all, line)) {
    if (line.starts_with("ROUTINE")) is_in = r++ == routine;
    else if (is_in && !line.starts_with("PARAMETERS") && !line.starts_with("LINE"))
      out += line + "\n";
  }
  return out;
}
std::vector<std::string> instructions(const std::string& code) {
  std::vector<std::string> out;
  std::istringstream lines(code);
  for (std::string l; std::getline(lines, l);) out.push_back(l);
  return out;
}
/// Statements in a program with some variables, in line 8.
std::string with(const std::string& statements) {
  return "PROGRAM p;\nSIGNAL INPUT BOOL: ready AT 1; OUTPUT BOOL: grip AT 2;\n"
         "VAR INT: i, j; REAL: r; BOOL: b; CHAR: c; STRING: s; ARRAY [-1..2] OF INT: a;\n"
         "POSE: pose; ROBTARGET: target; JOINT: joint; POSITION: pos; LIST OF INT: l; FILE: f;\n"
         "SEMAPHORE: sem;\nPROCEDURE done; BEGIN ENDPROC; PROCESS side; BEGIN ENDPROCESS;\n"
         "BEGIN\n" +
         statements + "\nENDPROGRAM;\n";
}
std::string reprinted(const std::string& text, Unit unit = Unit::program) {
  Names names;
  Faults f;
  Source s;
  s.text = text;
  scan(s, names, f);
  parse(s, unit, names, f);
  return print(s);
}

TEST(Irl, EveryConstructIsAccepted) {
  const char* kGood[] = {
      "i := 1;",
      "a[-1] := 5; a[i] := a[2] + 1;",
      "r := i;",
      "c := 'x'; c := 65; i := c;",
      "s := c; s := 'it''s'; c := s[1]; s[2] := 'y';",
      "IF i <> j AND j <> 3 OR NOT b THEN i := 1; ELSIF b THEN i := 2; ELSE i := 3; ENDIF;",
      "IF b i := 1; ENDIF;",
      "WHILE i < 3 i := i + 1; ENDWHILE;",
      "WHILE i < 3 DO i := i + 1; ENDWHILE;",
      "FOR i := 1 TO 3 j := j + i; ENDFOR;",
      "FOR i := 3 DOWNTO 1 STEP 2 DO EXIT; ENDFOR;",
      "REPEAT i := i + 1; UNTIL i > 3;",
      "LOOP EXIT; ENDLOOP;",
      "CASE i OF WHEN 1, 2: j := 1; WHEN -3: j := 2; DEFAULT: j := 3; ENDCASE;",
      "CASE s OF WHEN 'a': i := 1; ENDCASE;",
      "LABEL again: GOTO again;",
      "RETURN;",
      "WAIT 0.5 SEC;",
      "WAIT FOR ready = TRUE;",
      "WAIT FOR ready TIMEOUT 2.0;",
      "PAUSE; PAUSE 'go';",
      "HALT;",
      "done; done();",
      "MOVE LIN pose;",
      "move lin TARGET Speed := 100.0;",
      "MOVE PTP target SPEED_PTP := 50 C_PTP := 5, ACC_PTP := 10;",
      "MOVE PTP joint;",
      "MOVE PTP joint.M_JOINT; MOVE PTP joint.A_JOINT;",
      "MOVE CIRCLE pose, target C_CP := 1.0, SPEED_ORI := 20.0;",
      "MOVE PATH pose, pose, target SPEED := 80.0;",
      "MOVE_INC LIN pos; MOVE_INC PTP pose;",
      "MOVE LIN pose UNTIL ready;",
      "MOVE LIN pose SPEED := 8.0 UNTIL ready AND b DO done;",
      "MOVE LIN pose C_PASS := TRUE WOBBLE := FALSE TIME := -1.0 ACC := 50.0 C_SPEED := 10.0;",
      "MOVE LIN pose DEVICE := 1 ADAX_CONTROL := 0 TOOL := pose FRAME := pose @ pose;",
      "pose := pose @ INV(pose); pos := pose @ pos; pose.ORI := pose.ORI @ ORIZYX(1, 2, 3);",
      "target := ROBTARGET(((1, 2, 3), ORIZYX(4, 5, 6)), 4, 100, 0);",
      "START side; STOP side; CONTINUE side; CANCEL side; i := GETSTATUS(side);",
      "ACQUIRE(sem); RELEASE(sem);",
      "grip := ready; b := grip;",
      "LIST_ADD(l, 3); LIST_INSERT(l, 1, 2); LIST_DELETE(l, 1); i := l[1] + SIZEOF(l);",
      "i := LIST_INDEX(l, 3); LIST_CLEAR(l); l := [1, 2, 3]; l := [];",
      "OPEN(f, 'x.dat', 'W'); WRITE(f, i, r); WRITELN(f); CLOSE(f); b := EOF(f);",
      "READ(f, i); READLN(i, s); WRITELN('a', pose, a);",
      "r := SIN(i) + ABS(-2.5); i := ABS(-2) + ROUND(2.5) + TRUNC(r);",
      "i := 7 DIV 2 + 7 MOD 2; r := 7 / 2; b := b EXOR TRUE;",
      "b := 'a' < c; b := s >= 'abc';",
      "s := CONCAT(s, EXTRACT(s, 1, 2)); DELETE(s, 1, 1); i := LOCATE(s, 'x') + LENGTH(s);",
      "{ a comment\n of two lines } i := 1 { within } + 2;",
      "pose := ((1, 2, 3), (1, 0, 0, 0));"};
  for (const char* good : kGood) EXPECT_EQ(faults(with(good)), "") << good;
}

TEST(Irl, FaultsHaveTheirPlaceAndSayWhatToDo) {
  const std::pair<const char*, const char*> kBad[] = {
      {"k := 1;", "8:1 there is no name k.\n"},
      {"targe := target;", "8:1 there is no name targe. Did you mean target?\n"},
      {"i = 1;",
       "8:3 \"=\" compares and does not assign. Write \":=\" to give a variable a value.\n"},
      {"i := 1", "8:7 \";\" is missing behind the value, before \"ENDPROGRAM\".\n"},
      {"i := 2.5;",
       "8:6 this variable needs INT, but this is REAL. Use ROUND or TRUNC to make it a whole "
       "number.\n"},
      {"b := 1;", "8:6 this variable needs BOOL, but this is INT. Compare it: value <> 0\n"},
      {"i := 2147483648;", "8:6 an INT is at most 2147483647. Write it as a REAL, with \".0\".\n"},
      {"i := 2147483647 + 1;",
       "8:6 this value is beyond what INT holds. An INT is from -2147483648 to 2147483647.\n"},
      {"i := 1 DIV 0;", "8:12 this divides by zero.\n"},
      {"r := SQRT(-1.0);",
       "8:6 SQRT has no value here. Square root of a number that is not negative.\n"},
      {"a[3] := 1;", "8:3 the index 3 is outside -1..2.\n"},
      {"pos.W := 1.0;", "8:5 POSITION has no field W. Its fields are X, Y, Z.\n"},
      {"pos := POSITION(1, 2);",
       "8:8 POSITION consists of 3 values, but here are 2. They are X, Y, Z, in this order.\n"},
      {"ready := TRUE;", "8:1 ready is an input, which can only be read.\n"},
      {"TRUE := b;", "8:1 TRUE is a constant and cannot be assigned.\n"},
      {"MOVE LIN joint;",
       "8:10 MOVE LIN moves along a path to a position, but this is JOINT. Use MOVE PTP, or "
       "TRAFO(...) for the pose that the joints reach.\n"},
      {"MOVE CIRCLE pose;",
       "8:13 CIRCLE needs two targets, a point on the arc and the end. Such as: MOVE CIRCLE via, "
       "end;\n"},
      {"MOVE LIN pose SPEED := -1.0;", "8:24 SPEED must be above zero.\n"},
      {"MOVE LIN pose SPED := 1.0;",
       "8:15 a motion has no attribute SPED. Attributes are SPEED, SPEED_ORI, ACC, TIME, C_CP, "
       "C_SPEED, C_PASS, WOBBLE, ACT_ROB, DEVICE, ADAX_CONTROL, SPEED_PTP, ACC_PTP, C_PTP, TOOL, "
       "FRAME.\n"},
      {"MOVE PTP pose SPEED := 100.0;",
       "warning 8:15 SPEED has no effect on MOVE PTP. Joint motions have SPEED_PTP, ACC_PTP and "
       "C_PTP.\n"},
      {"MOVE pose;",
       "8:6 \"pose\" is not one of PTP, LIN, CIRCLE and PATH. Such as: MOVE LIN place;\n"},
      {"WAIT 1.0;",
       "8:9 SEC is missing behind the time, before \";\". Write WAIT 0.5 SEC; or WAIT FOR "
       "condition;\n"},
      {"EXIT;", "8:1 EXIT is outside a loop. Use RETURN to leave a routine.\n"},
      {"GOTO nowhere;", "8:6 there is no label nowhere in this routine.\n"},
      {"GOTO in; WHILE b LABEL in: ENDWHILE;",
       "8:6 the name of the label is missing, before \"in\". \"in\" is a keyword of the language, "
       "not a name.\n8:24 the name of the label is missing, before \"in\". \"in\" is a keyword of "
       "the language, not a name.\n"},
      {"GOTO x; WHILE b LABEL x: ENDWHILE;",
       "8:6 GOTO leads into a statement from outside. A label can be reached only from its block "
       "and from blocks inside it.\n"},
      {"done(1);", "8:1 done takes 0 arguments, but here is 1.\n"},
      {"i;", "8:1 i is not a procedure, and this has no effect. Assign a variable with \":=\".\n"},
      {"IF i THEN ENDIF;", "8:4 IF needs BOOL, but this is INT. Compare it: value <> 0\n"},
      {"IF b THEN i := 1;", "9:1 ENDIF is missing for the IF of line 8, before \"ENDPROGRAM\".\n"},
      {"b := 1 < 2 < 3;",
       "8:12 comparisons cannot be chained. Put one comparison in parentheses.\n"},
      {"b := i AND b;",
       "8:8 \"AND\" cannot combine INT and BOOL. It combines conditions; there is no operator for "
       "bits.\n"},
      {"s := 'a' + 'b';", "8:10 \"+\" cannot combine STRING and STRING. Use CONCAT for strings.\n"},
      {"s := 'open;",
       "8:6 this string has no end. Close it with a single quote in its line; a quote within is "
       "doubled.\n8:12 \";\" is missing behind the value, before \"ENDPROGRAM\".\n"},
      {"s := \"x\";",
       "8:6 \"\"\" is not a character of the language. Write strings in single quotes: "
       "'text'.\n8:8 \"\"\" is not a character of the language. Write strings in single quotes: "
       "'text'.\n8:7 there is no name "
       "x.\n"},
      {"f := f;", "8:1 a FILE cannot be assigned.\n"},
      {"START done;", "8:7 done is no process.\n"},
      {"r := SIN(1, 2);",
       "8:6 SIN takes 1 arguments, but here are 2. Sine of an angle in "
       "degrees.\n"},
      {"pose := target @ pose;",
       "8:16 \"@\" cannot combine ROBTARGET and POSE. Use its pose: target.PSE\n"},
      {"CASE i OF WHEN 1: WHEN 1: ENDCASE;", "8:24 this value already has a case.\n"},
      {"FOR i := 1 TO 3 STEP 0 ENDFOR;",
       "8:22 STEP must be at least 1, but this is 0. Use DOWNTO to count downwards.\n"},
      {"FOR i := 1 TO 3 STEP i ENDFOR;", ""},
      {"BRAKE(2);",
       "8:7 BRAKE has no mode 2. 0 ends the motion, 1 holds it until the interrupt's routine has "
       "ended.\n"},
      {"BRAKE(0, i);",
       "8:10 argument 2 of BRAKE needs the name of a robot, but this is INT. Such as: BRAKE(0, "
       "arm); where the cell has ROBOT arm := ...;\n"},
      {"BRAKE(0, i, i);",
       "8:13 BRAKE takes only a mode and a robot. Brakes the motion that an interrupt came "
       "into, or that of a robot: BRAKE(mode, robot). Mode 0 ends the motion; 1 holds it until the "
       "interrupt's routine has ended.\n"},
      {"R_JOINT_ACT := TRAFOINV(target);",
       "8:1 an assignment needs a variable, but this is a value.\n"},
      {"R_ACT_ROB := i;",
       "8:14 R_ACT_ROB needs the name of a robot, but this is INT. Such as: R_ACT_ROB := arm; "
       "where "
       "the cell has ROBOT arm := ...;\n"},
      {"i := R_ACT_ROB.x;",
       "8:6 R_ACT_ROB is a robot, but the cell declares none. Declare its R_SPEC_TYPE, and ROBOT "
       "arm "
       ":= R_SPEC_TYPE(...); there.\n"},
      {"MOVE LIN pose TIME := 0;", "8:23 TIME must be above zero, or -1 for none.\n"},
      {"target := ROBTARGET(pose, -2, [0, 0], ADD_JOINT(0.0));",
       "8:27 STATUS must not be negative, but this is -2. -1 means any; otherwise one bit for each "
       "branch of the robot's inverse kinematics.\n"},
      {"target := ROBTARGET(pose, 8, [0, 0], ADD_JOINT(0.0));",
       "warning 8:27 STATUS 8 has branches beyond the third. Robots with fewer branches reject it, "
       "and posts write 0 to 7.\n"},
      {"R_SCALE_FORW := 1.0;",
       "warning 8:1 R_SCALE_FORW has no effect on motions. Its meaning is unknown. Speeds are set "
       "by R_SPEED, R_SPEED_PTP and R_ACC.\n"},
      {"CASE i OF 1: i := 2; ENDCASE;",
       "8:11 WHEN is missing, before \"1\". Such as: CASE i OF WHEN 1, 2: ... ENDCASE;\n"},
      {"RETURN 1;", "8:8 RETURN has a value, but this is not a function.\n"},
  };
  for (const auto& [text, expected] : kBad) {
    const std::string found = faults(with(text));
    if (std::string_view(text).starts_with("s := ")) {
      // Faults are in order of their place.
      std::vector<std::string> a, b;
      std::istringstream x(found), y(expected);
      for (std::string l; std::getline(x, l);) a.push_back(l);
      for (std::string l; std::getline(y, l);) b.push_back(l);
      std::sort(a.begin(), a.end());
      std::sort(b.begin(), b.end());
      EXPECT_EQ(a, b) << text;
    } else {
      EXPECT_EQ(found, expected) << text;
    }
  }
}

TEST(Irl, FieldsOfRobotsThatNothingLooksAtAreSaid) {
  const std::string cell =
      "PROGRAM p; TYPE RECORD JOINT: R_JOINT_ACT; REAL: R_SPEED; ARRAY [1..2] OF INT: R_DEVICES;"
      " INT: mine; ENDRECORD: R_SPEC_TYPE;\n"
      "TYPE ROBOT arm := R_SPEC_TYPE(JOINT(MAIN_JOINT(0.0,0.0,0.0,0.0,0.0,0.0),ADD_JOINT(0.0)),"
      "1.0,[1,2],3);\n"
      "VAR POSE: a := POSE(POSITION(1.0,0.0,0.0), ORIZYX(0.0,0.0,0.0));\nBEGIN\n";
  EXPECT_EQ(faults(cell + "arm.mine := 1; arm.R_DEVICES[1] := 2; R_ACT_ROB := arm; "
                          "MOVE PTP a ACT_ROB := arm; BRAKE(1, arm);\nENDPROGRAM;"),
            "");
  EXPECT_EQ(faults(cell + "arm.R_SPEED := 2.0;\narm.R_JOINT_ACT.M_JOINT.A1 := 3.0;\n"
                          "MOVE PTP a ACT_ROB := R_ACT_ROB;\nENDPROGRAM;"),
            "warning 5:1 the field R_SPEED of a robot has no effect on its motions. The system "
            "variables apply: R_SPEED, R_SPEED_ORI, R_ACC, R_C_CP, R_C_SPEED, R_SPEED_PTP, "
            "R_ACC_PTP and R_C_PTP.\n"
            "warning 6:1 R_JOINT_ACT is the state of the robot, and an assigned value is lost. "
            "Move it with a motion.\n"
            "7:23 ACT_ROB needs the name of a robot. Name one declared by the cell: ROBOT name := "
            "...; R_ACT_ROB applies without ACT_ROB.\n");
}

// A cell of 2006 has INT joints. Where a record of a known name does not fit, its declaration is
// the error, and what is made of it says nothing more.
TEST(Irl, JointsOfCellsMayBeWholeNumbersAndMisfitsAreSaidOnce) {
  const auto cell = [](const std::string& number, const std::string& statements) {
    return "PROGRAM p; TYPE\nRECORD " + number +
           ": A1, A2; ENDRECORD: MAIN_JOINT;\nRECORD INT: AA1; ENDRECORD: ADD_JOINT;\n"
           "RECORD MAIN_JOINT: M_JOINT; ADD_JOINT: A_JOINT; ENDRECORD: JOINT;\n"
           "RECORD POSE: PSE; INT: STATUS; ARRAY [1..2] OF INT: TURNS; ADD_JOINT: A_JOINT; "
           "ENDRECORD: ROBTARGET;\nVAR ROBTARGET: dest; JOINT: home; INT: n;\nBEGIN\n" +
           statements + "ENDPROGRAM;";
  };
  const std::string moves =
      "dest.A_JOINT.AA1 := 1;\nn := dest.A_JOINT.AA1;\nMOVE LIN dest;\nMOVE PTP home;\n";
  EXPECT_EQ(faults(cell("INT", moves)), "");
  EXPECT_EQ(faults(cell("REAL", moves)), "");
  EXPECT_EQ(faults(cell("STRING", moves)),
            "2:35 MAIN_JOINT has a meaning for motions and holds REAL or INT fields only. Give "
            "it another name, or these fields.\n");
  EXPECT_EQ(faults("PROGRAM p; TYPE\nRECORD REAL: X; ENDRECORD: POSE;\nVAR POSE: a;\nBEGIN\n"
                   "MOVE LIN a;\nENDPROGRAM;"),
            "5:10 this POSE is a record declared by the program, which motions do not support. "
            "Rename the record, and give the motion the POSE of the language or cell.\n");
}

TEST(Irl, DeclarationsAreChecked) {
  EXPECT_EQ(faults("PROGRAM p; CONST INT: n := 3; VAR ARRAY [1..n, 0..n-1] OF REAL: m; "
                   "BEGIN m[1, 2] := 1; m[1][0] := 2; ENDPROGRAM;"),
            "");
  EXPECT_EQ(faults("PROGRAM p; VAR INT: n; ARRAY [1..n] OF INT: a; ENDPROGRAM;"),
            "1:34 the bound of an array must be known before run time. Use numbers and "
            "constants only.\n");
  EXPECT_EQ(faults("PROGRAM p; VAR ARRAY [3..1] OF INT: a; ENDPROGRAM;"),
            "1:23 the upper bound 1 is below the lower one, 3.\n");
  EXPECT_EQ(faults("PROGRAM p; VAR ARRAY [1..5000, 1..5000] OF INT: a; ENDPROGRAM;"),
            "1:16 this array holds more than 16000000 values.\n");
  EXPECT_EQ(faults("PROGRAM p; VAR INT: a;\n REAL: A; ENDPROGRAM;"),
            "2:8 A is already declared. The first one is in line 1.\n");
  EXPECT_EQ(faults("PROGRAM p; VAR a: INT; ENDPROGRAM;"), "1:16 there is no type a.\n");
  EXPECT_EQ(faults("PROGRAM p; CONST INT: n; ENDPROGRAM;"),
            "1:23 the constant n has no value. Such as: INT: n := 3;\n");
  EXPECT_EQ(faults("PROGRAM p; TYPE RECORD INT: a, a; ENDRECORD: R; ENDPROGRAM;"),
            "1:32 the record has a field a already.\n");
  EXPECT_EQ(faults("PROGRAM p; FUNCTION f: INT; BEGIN ENDFCT; BEGIN ENDPROGRAM;"),
            "1:21 the function f has no RETURN. Such as: RETURN value;\n");
  EXPECT_EQ(faults("PROGRAM p; PROCEDURE q (OUT INT: a); BEGIN a := 1; ENDPROC; BEGIN q(5); "
                   "ENDPROGRAM;"),
            "1:69 parameter a of q (OUT) needs a variable, but this is a value.\n");
  EXPECT_EQ(faults("PROGRAM p; PROCEDURE q (IN INT: a); BEGIN a := 1; ENDPROC; BEGIN ENDPROGRAM;"),
            "1:43 a is an IN parameter, which can only be read. Make it INOUT, or copy it to a "
            "variable.\n");
  EXPECT_EQ(faults("PROGRAM p; BEGIN"),
            "1:17 the source ends without ENDPROGRAM. Write ENDPROGRAM; at the end.\n");
  EXPECT_EQ(faults("hello"),
            "1:1 a program must begin with PROGRAM and its name, not with \"hello\". Such as: "
            "PROGRAM towers;\n");
  EXPECT_EQ(faults("PROGRAM p; { open"),
            "1:12 this comment has no end. Close it with \"}\".\n1:18 the source ends without "
            "ENDPROGRAM. Write ENDPROGRAM; at the end.\n");
  EXPECT_EQ(faults("PROGRAM p; SYSTEM_SPECIFICATION 'cell.ssi'; BEGIN ENDPROGRAM;"),
            "1:12 the system specification 'cell.ssi' is not among the program's files. Add the "
            "file to the program: program.set_file.\n");
}

TEST(Irl, SeveralFaultsAreFoundInOneRun) {
  EXPECT_EQ(
      faults("PROGRAM p;\nVAR INT: i\nREAL: r;\nBEGIN\ni := ;\nr := 1;\nIF i = THEN r := 2; "
             "ENDIF;\nMOVE i;\nr := 'x';\nENDPROGRAM;\n"),
      "2:11 \";\" is missing behind the declaration, before \"REAL\".\n5:6 \";\" is not a "
      "value.\n7:8 \"THEN\" is not a value. \"THEN\" is a keyword of the language, not a "
      "name.\n8:6 \"i\" is not one of PTP, LIN, CIRCLE and PATH. Such as: MOVE LIN place;\n9:6 "
      "this variable needs REAL, but this is STRING.\n");
}

TEST(Irl, CellsModulesAndListsOfDataAreFilesOfTheProgram) {
  const std::string cell =
      "PROGRAM cell; CONST INT: n := 2; TYPE RECORD REAL: A1, A2, A3, A4, A5; ENDRECORD: "
      "MAIN_JOINT;"
      "RECORD REAL: G; ENDRECORD: ADD_JOINT; RECORD MAIN_JOINT: M; ADD_JOINT: A; ENDRECORD: JOINT; "
      "ENDPROGRAM;";
  const std::string tools =
      "MODULE tools; EXPORT twice, K; CONST INT: K := 7, hidden := 8;\n"
      "FUNCTION twice (IN INT: x): INT; BEGIN RETURN 2 * x; ENDFCT; ENDMODULE;";
  const std::string program =
      "PROGRAM p; SYSTEM_SPECIFICATION 'CELL.ssi'; DATALIST 'p.dls'; IMPORT twice, K FROM tools;\n"
      "VAR JOINT: home; POSE: place; INT: i;\n"
      "BEGIN TEACH place, i; home := JOINT(MAIN_JOINT(1, 2, 3, 4, 5), ADD_JOINT(0)); "
      "i := twice(K) + n; MOVE PTP home; ENDPROGRAM;";
  const std::string list = "place := POSE(POSITION(1, 2, 3), ORIZYX(0, 180, 0));\ni := 4;\n";
  EXPECT_EQ(faults(*compiled_files(std::vector<File>{
                {"p.irl", program}, {"cell.ssi", cell}, {"tools.irl", tools}, {"p.dls", list}})),
            "");
  EXPECT_EQ(faults(*compiled_files(std::vector<File>{{"p.irl", program},
                                                     {"cell.ssi", cell},
                                                     {"tools.irl", tools},
                                                     {"p.dls", "place := 3;\ni := 1;"}})),
            "p.dls:1:10 this variable needs POSE, but this is INT.\n");
  const std::string hidden = "PROGRAM p; IMPORT hidden FROM tools; ENDPROGRAM;";
  EXPECT_EQ(faults(*compiled_files(std::vector<File>{{"p.irl", hidden}, {"tools.irl", tools}})),
            "1:19 module tools exports no hidden. Name it in the module's EXPORT.\n");
  const std::string a = "MODULE a; IMPORT b; ENDMODULE;", b = "MODULE b; IMPORT a; ENDMODULE;";
  EXPECT_EQ(faults(*compiled_files(std::vector<File>{
                {"p.irl", "PROGRAM p; IMPORT a; ENDPROGRAM;"}, {"a.irl", a}, {"b.irl", b}})),
            "b.irl:1:18 module A imports itself, through its imports.\n");
}

TEST(Irl, ValuesThatAreKnownAreComputed) {
  // Each against the value by hand.
  const std::pair<const char*, const char*> kValues[] = {
      {"i := 2 + 3 * 4;", "COPY 14 - "},
      {"i := -7 DIV 2;", "COPY -3 - "},
      {"i := -7 MOD 2;", "COPY -1 - "},
      {"r := 7 / 2;", "COPY 3.5 - "},
      {"r := SIN(30) ;", "COPY 0.49"},
      {"r := SIN(180);", "COPY 0.0 - "},
      {"r := COS(90);", "COPY 0.0 - "},
      {"r := COS(-450);", "COPY 0.0 - "},
      {"r := TAN(180);", "COPY 0.0 - "},
      {"r := ATAN(0);", "COPY 0.0 - "},
      {"r := ASIN(-1);", "COPY -90.0 - "},
      {"r := ATAN2(1, 1);", "COPY 45.0 - "},
      {"i := ROUND(-2.5);", "COPY -3 - "},
      {"i := TRUNC(-2.7);", "COPY -2 - "},
      {"c := CHR(65);", "COPY c65 - "},
      {"i := ORD('A');", "COPY 65 - "},
      {"b := 1 < 2.5 AND 'a' < 'b';", "COPY TRUE - "},
      {"b := NOT 1 = 2;", "COPY TRUE - "},
      {"i := -2147483648;", "COPY -2147483648 - "}};
  for (const auto& [statement, expected] : kValues) {
    const std::string all = code(with(statement));
    EXPECT_NE(all.find(expected), std::string::npos) << statement << "\n" << all;
  }
  EXPECT_DOUBLE_EQ(*evaluate("SIN", std::vector<double>{30}), 0.49999999999999994);
  EXPECT_FALSE(evaluate("TAN", std::vector<double>{270}));
  EXPECT_FALSE(evaluate("ACOS", std::vector<double>{1.5}));
}

TEST(Irl, RelationsBindTighterThanAnd) {
  // Parentheses change nothing, and the second is looked at only where the first holds.
  const auto same = [](const char* condition) {
    return code(std::string("PROGRAM p; VAR INT: i, j; BOOL: b; BEGIN b := ") + condition +
                "; ENDPROGRAM;");
  };
  EXPECT_EQ(instructions(same("i <> j AND j <> 3")), instructions(same("(i <> j) AND (j <> 3)")));
  EXPECT_EQ(instructions(same("NOT i = j")), instructions(same("NOT (i = j)")));
  EXPECT_EQ(instructions(same("b OR b AND b")), instructions(same("b OR (b AND b)")));
  const std::string text =
      code("PROGRAM p; VAR INT: i, j; BEGIN IF i <> j AND j <> 3 THEN i := 1; ENDIF; ENDPROGRAM;");
  EXPECT_NE(text.find("NOT_EQUAL v"), std::string::npos);
  EXPECT_LT(text.find("JUMP_UNLESS"), text.rfind("NOT_EQUAL"));
}

TEST(Irl, RecursionIsKnown) {
  const auto p = compiled_files(
      "PROGRAM p; PROCEDURE a (IN INT: n); BEGIN IF n > 0 THEN b(n); ENDIF; ENDPROC;"
      "PROCEDURE b (IN INT: n); BEGIN a(n - 1); c; ENDPROC; PROCEDURE c; BEGIN ENDPROC;"
      "BEGIN a(3); ENDPROGRAM;");
  ASSERT_EQ(faults(*p), "");
  EXPECT_EQ(p->routines[0].is_recursive, 0U);
  EXPECT_EQ(p->routines[1].is_recursive, 1U);
  EXPECT_EQ(p->routines[2].is_recursive, 1U);
  EXPECT_EQ(p->routines[3].is_recursive, 0U);
}

TEST(Irl, CodeOfMotionsHasTargetsAttributesAndTheConditionThatEndsThem) {
  const std::string text =
      code(with("MOVE LIN pose SPEED := 8.0 UNTIL ready DO done; MOVE_INC PTP pos;"));
  const std::size_t at = text.find("TARGET");
  ASSERT_NE(at, std::string::npos);
  std::string shape;
  std::istringstream lines(text.substr(at));
  for (std::string l; std::getline(lines, l);) shape += l.substr(0, l.find(' ')) + " ";
  EXPECT_EQ(shape, "TARGET ATTRIBUTE UNTIL UNTIL_TEST LABEL MOVE TARGET MOVE END ");
  EXPECT_NE(text.find("ATTRIBUTE 8.0 SPEED -"), std::string::npos);
  EXPECT_NE(text.find("MOVE LIN #0 -"), std::string::npos);
  EXPECT_NE(text.find("MOVE PTP #1 -"), std::string::npos);
}

TEST(Irl, AValueThatACallChangesIsTakenBeforeIt) {
  const std::string text = code(
      "PROGRAM p; VAR INT: a; FUNCTION f: INT; BEGIN a := 5; RETURN 1; ENDFCT; BEGIN a := a + "
      "f(); ENDPROGRAM;");
  const std::size_t call = text.find("CALL"), copy = text.rfind("COPY v", call);
  EXPECT_NE(copy, std::string::npos) << text;
  EXPECT_LT(copy, call);
}

/// The samples and what the 2006 program had, where it is there.
std::vector<File> samples() {
  std::vector<File> out;
  for (const char* s :
       {"i := 1; IF b THEN MOVE LIN pose UNTIL ready; ELSE WAIT 0.5 SEC; ENDIF;",
        "CASE i OF WHEN 1: FOR i := 1 TO 3 DO a[i] := i; ENDFOR; DEFAULT: HALT; ENDCASE;",
        "LOOP IF i > 3 THEN EXIT; ENDIF; i := i + 1; MOVE CIRCLE pose, target C_CP := 2.0; "
        "ENDLOOP;",
        "s := CONCAT(s, 'x'); target := ROBTARGET(((1, 2, 3), ORIZYX(4, 5, 6)), 4, 100, 0);"})
    out.push_back({"sample.irl", with(s)});
  return out;
}
fs::path irl_data() {
  const char* given = std::getenv("ROBOMOSP_OLD_FILES");
  return (given ? fs::path(given) : fs::path(ROBOMOSP_SOURCE_DIR) / "../shared/data/robomosp-1.4") /
         "Saves/IRL";
}
std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Irl, CodeIsTheSameWhenItsTextIsReadAgain) {
  for (const File& f : samples()) {
    const auto p = compiled_files(std::vector<File>{f});
    ASSERT_EQ(faults(*p), "");
    const std::string text = code_text(p->code());
    auto again = read_code_text(text);
    ASSERT_TRUE(again.ok()) << again.error().sentence();
    EXPECT_EQ(code_text((*again)->code()), text);
    ASSERT_EQ((*again)->instructions.size(), p->instructions.size());
    for (std::size_t i = 0; i < p->instructions.size(); ++i) {
      EXPECT_EQ((*again)->instructions[i].op, p->instructions[i].op);
      EXPECT_EQ((*again)->instructions[i].a.kind, p->instructions[i].a.kind);
      EXPECT_EQ((*again)->instructions[i].r.type, p->instructions[i].r.type);
    }
  }
}

TEST(Irl, BrokenTextOfCodeIsRefusedWithItsLine) {
  const std::pair<const char*, const char*> kBad[] = {
      {"", "it is empty"},
      {"robomosp code 2\n", "it does not begin with \"robomosp code 1\""},
      {"robomosp code 1\nCOPY 1 -\n", "a line has four fields"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nCOPY 1 - v3\nEND - - -\n", "there is no v3 above"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nJUMP - - L1\nEND - - -\n", "label L1 does not exist"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nCALL r7 #0 -\nEND - - -\n", "there is no routine r7"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nFLY - - -\nEND - - -\n", "no instruction \"FLY\""},
      {"robomosp code 1\nROUTINE r0 #0 'p'\n", "the last routine has no END"},
      {"robomosp code 1\nRECORD #0 - 'R'\nMEMBER - T10 'x'\n", "a record cannot contain itself"},
      {"robomosp code 1\nARRAY 3..1 T1 ''\n", "are not valid array bounds"},
      {"robomosp code 1\nARRAY 1..99999999 T1 ''\n", "more than 16000000 values"},
      {"robomosp code 1\nINPUT v1 T4 'a'\nAT #-1 #1 -\n", "a signal has a number from 0"},
      {"robomosp code 1\nVARIABLE v1 T0 'a'\n", "holds no value"},
      {"robomosp code 1\nRECORD #1 - 'P'\nMEMBER - T1 'x'\nROUTINE r0 #0 'p'\nEND - - -\n",
       "not those of its role #1"},
      {"robomosp code 1\nROUTINE r0 #1 'p'\nEND - - -\n", "r0 is not of the kind #0"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nNOT 1 - t0:T1\nEND - - -\n", "NOT has a BOOL"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nJUMP_IF 1 - L0\nLABEL - - L0\nEND - - -\n",
       "this has a BOOL and a label"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nADD 1 2.0 t0:T1\nEND - - -\n",
       "two numbers of one type"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nCOPY t0:T1 - t1:T1\nEND - - -\n",
       "before it was set with this type"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nCOPY 1 - t0:T1\nCOPY t0:T5 - t1:T5\nEND - - -\n",
       "before it was set with this type"},
      {"robomosp code 1\nINPUT v1 T1 'a'\nROUTINE r0 #0 'p'\nCOPY 1 - v1\nEND - - -\n",
       "COPY has a value"},
      {"robomosp code 1\nRECORD #0 - 'R'\nMEMBER - T1 'x'\nVARIABLE v1 T10 'a'\nROUTINE r0 #0 "
       "'p'\nFIELD v1 #1 p0:T1\nEND - - -\n",
       "FIELD has a record"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nARGUMENT 1 - -\nHALT - - -\nEND - - -\n",
       "directly before the CALL"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nARGUMENT 1 - -\nEND - - -\n", "not followed by a CALL"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nCALL r0 #0 -\nEND - - -\n", "CALL has a procedure"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nMOVE LIN #0 -\nEND - - -\n", "MOVE has an"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nRETURN 1 - -\nEND - - -\n", "RETURN has a value"},
      {"robomosp code 1\nROUTINE r0 #0 'p'\nWAIT_TIME 1 - -\nEND - - -\n", "WAIT_TIME has a REAL"}};
  for (const auto& [text, expected] : kBad) {
    const auto r = read_code_text(text);
    ASSERT_FALSE(r.ok()) << text;
    EXPECT_NE(r.error().sentence().find(expected), std::string::npos) << r.error().sentence();
    EXPECT_NE(r.error().where.find("line "), std::string::npos);
  }
}

TEST(Irl, DamagedCodeIsRefusedInWordsOrIsCodeThatReadsAgain) {
  std::mt19937 random(test::seed());
  std::vector<std::string> texts;
  for (const File& f : samples())
    texts.push_back(code_text(compiled_files(std::vector<File>{f})->code()));
  static const char* const kTokens[] = {"t0:T1", "p0:T2", "v1",    "L0",   "r0",   "#1",     "-",
                                        "TRUE",  "1.5",   "'s'",   "T12",  "CALL", "MOVE",   "\n",
                                        "#99",   "T99",   "t9:T9", "1..3", "END",  "ROUTINE"};
  test::Mutator mutator(random, texts, kTokens);
  int refused = 0;
  for (int n = 0; n < 3000; ++n) {
    const auto r = read_code_text(mutator.mutate(texts[random() % texts.size()]));
    if (!r.ok()) {
      ++refused;
      ASSERT_FALSE(r.error().message.empty());
      continue;
    }
    const std::string again = code_text((*r)->code());
    ASSERT_TRUE(read_code_text(again).ok()) << again;
  }
  EXPECT_GT(refused, 1000);
}

// ---- random programs ----

TEST(IrlRandom, ProgramsCompileAndTheirPrintedFormMeansTheSame) {
  std::mt19937 random(test::seed());
  Generator generator(random);
  for (int n = 0; n < 500; ++n) {
    const std::string text = generator.program();
    const auto first = compiled_files(text);
    if (first->code().has_errors) {
      // Known numbers may leave what INT holds; nothing else may be wrong.
      ASSERT_NE(faults(*first).find("beyond what INT holds"), std::string::npos) << text << "\n"
                                                                                 << faults(*first);
      continue;
    }
    const std::string once = reprinted(text);
    ASSERT_EQ(reprinted(once), once) << text;
    const auto second = compiled_files(once);
    ASSERT_EQ(faults(*second), faults(*second)) << once;
    ASSERT_FALSE(second->code().has_errors) << once << faults(*second);
    ASSERT_EQ(second->instructions.size(), first->instructions.size());
    for (std::size_t i = 0; i < first->instructions.size(); ++i) {
      const auto &x = first->instructions[i], &y = second->instructions[i];
      ASSERT_EQ(x.op, y.op) << once;
      ASSERT_EQ(x.a.kind, y.a.kind);
      ASSERT_EQ(x.a.index, y.a.index);
      ASSERT_EQ(x.b.index, y.b.index);
      ASSERT_EQ(x.r.index, y.r.index);
    }
    const std::string stored = code_text(second->code());
    auto again = read_code_text(stored);
    ASSERT_TRUE(again.ok()) << again.error().sentence();
    ASSERT_EQ(code_text((*again)->code()), stored);
  }
}

TEST(IrlRandom, BrokenSourcesAreRefusedInWordsAndNeverCrash) {
  static const char* const kTokens[] = {"BEGIN",       "END",         "ENDPROGRAM;",
                                        "IF ",         "THEN ",       "ENDIF;",
                                        ":=",          ";",           "(",
                                        ")",           "[",           "]",
                                        "{",           "}",           "'",
                                        "..",          "@",           "RECORD ",
                                        "ENDRECORD",   "ARRAY [",     " OF ",
                                        "PROCEDURE x", "ENDPROC;",    "MOVE LIN ",
                                        "UNTIL ",      "WHEN ",       "\xff",
                                        "\0",          "99999999999", "1e999",
                                        "TEACH ",      "IMPORT a;",   "SYSTEM_SPECIFICATION 'x';",
                                        "NOT ",        "-",           "CASE ",
                                        "LABEL a:",    "FOR i:=1 TO "};
  std::vector<std::string> all;
  for (const File& f : samples()) all.push_back(f.text);
  std::mt19937 random(test::seed());
  test::Mutator mutator(random, all, kTokens);
  std::vector<std::string> codes;
  for (const File& f : samples()) codes.push_back(code_text(compiled_files(f.text)->code()));
  test::Mutator code_mutator(random, codes, kTokens);
  const test::FuzzBudget budget(3000);
  for (std::size_t n = 0; budget.allows(n); ++n) {
    const std::string text = mutator.mutate(all[n % all.size()]);
    const auto p = compiled_files(std::vector<File>{{"p.irl", text}, {"x", all[n % all.size()]}});
    for (const rmp_code_fault& f : p->faults) {
      EXPECT_GE(f.span.line, 1U);
      EXPECT_NE(std::string_view(f.message), "");
    }
    const std::string once = reprinted(text);
    if (!p->code().has_errors) {
      EXPECT_EQ(reprinted(once), once) << text;
    }
    const auto r = read_code_text(code_mutator.mutate(codes[n % codes.size()]));
    if (!r.ok()) {
      EXPECT_NE(r.error().message, "");
    }
  }
}

TEST(IrlRandom, DeepNestingIsRefusedInASentence) {
  const auto repeated = [](const char* what, int n) {
    std::string s;
    for (int i = 0; i < n; ++i) s += what;
    return s;
  };
  constexpr int kDeep = 100000;
  for (const std::string& s :
       {"i := " + repeated("(", kDeep) + "1", "i := " + repeated("-", kDeep) + "1",
        "b := " + repeated("NOT ", kDeep) + "b", repeated("IF b THEN ", kDeep),
        repeated("WHILE b ", kDeep), "i := " + repeated("a[", kDeep),
        "i := " + repeated("SIN(", kDeep), repeated("LOOP ", kDeep)}) {
    const std::string found = faults(with(s + ";"));
    EXPECT_NE(found.find("the source is nested more than 200 levels deep"), std::string::npos)
        << found.substr(0, 300);
    EXPECT_LT(found.size(), 20000U);
  }
  const std::string types = faults("PROGRAM p; VAR " + repeated("ARRAY [1..2] OF ", kDeep));
  EXPECT_NE(types.find("200 levels"), std::string::npos) << types.substr(0, 300);
  const std::string chain = faults(with("i := 1" + repeated(" + i", kDeep) + ";"));
  EXPECT_NE(chain.find("combines more than 500 values"), std::string::npos) << chain.substr(0, 300);
  EXPECT_NE(faults(with("i := a" + repeated("[1]", kDeep) + ";")).find("200 levels deep"),
            std::string::npos);
  // Arms of one IF are not nested.
  EXPECT_EQ(faults(with("IF b THEN i := 0; " + repeated("ELSIF b THEN i := 1; ", 5000) + "ENDIF;")),
            "");
}

TEST(IrlRandom, TenTimesTheLinesTakeAboutTenTimesTheTime) {
  const auto source = [](int routines) {
    std::string s = "PROGRAM big;\nVAR INT: i; REAL: r; POSE: p;\n";
    for (int k = 0; k < routines; ++k) {
      const std::string n = std::to_string(k);
      s += "PROCEDURE q" + n + " (IN INT: n);\nVAR REAL: z;\nBEGIN\n  z := n * 2.5 + " + n +
           ";\n  IF n > " + n + " AND z < 100.0 THEN\n    r := r + z;\n  ENDIF;\n" +
           "  MOVE LIN POSE(POSITION(z, 0.0, 100.0), ORIZYX(0.0, 180.0, 0.0)) SPEED := 80.0;\n" +
           (k ? "  q" + std::to_string(k - 1) + "(n - 1);\n" : "") + "ENDPROC;\n";
    }
    return s + "BEGIN\n  q" + std::to_string(routines - 1) + "(3);\nENDPROGRAM;\n";
  };
  const auto seconds = [&](int routines) {
    const std::string text = source(routines);
    const std::clock_t begin = std::clock();  // of the processor, whoever else uses it
    const auto p = compiled_files(text);
    EXPECT_EQ(faults(*p), "");
    return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  const double small = std::min(seconds(1000), seconds(1000)), large = seconds(10000);
  std::cout << "10,000 lines " << small << " s, 100,000 lines " << large << " s\n";
  EXPECT_LT(large, 40 * small + 0.5);
}

TEST(IrlFiles, ProgramsOf2006AreChecked) {
  if (!fs::exists(irl_data())) GTEST_SKIP() << "no files of 2006 in " << irl_data();
  int programs = 0;
  std::vector<File> all;
  for (const auto& entry : fs::directory_iterator(irl_data()))
    all.push_back({entry.path().filename().string(), text_of(entry.path())});
  for (const File& f : all) {
    std::vector<File> files{f};
    for (const File& other : all)
      if (other.name != f.name) files.push_back(other);
    const auto p = compiled_files(files);
    EXPECT_EQ(faults(*p), "") << f.name;
    const std::string once = reprinted(f.text);
    EXPECT_EQ(reprinted(once), once);
    ++programs;
  }
  EXPECT_GE(programs, 3);
}

/// Faults of a program whose variables are given values.
std::string given_faults(const std::vector<GivenValue>& values, std::string* tables = nullptr) {
  const std::string text =
      "PROGRAM p;\nCONST\n  INT: N := 2;\nVAR\n  REAL: r;\n  SEMAPHORE: s := 1;\n  ARRAY [1..N] "
      "OF INT: a;\n  ROBTARGET: t := ROBTARGET(POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, "
      "0.0)), 2, [0, 0], ADD_JOINT(0.0));\n  ROBTARGET: u;\nBEGIN\n  r := r + 1.0;\nENDPROGRAM;\n";
  const std::vector<SourceFile> files{{"p.irl", text, {}}};
  NoProgress progress;
  auto made = compile(files, progress, values);
  EXPECT_TRUE(made.ok());
  if (!made.ok()) return {};
  if (tables && (*made)->code().has_errors == 0) *tables = code_text((*made)->code());
  return faults(**made);
}

TEST(IrlGivenValues, TakeThePlaceOfWhatIsDeclared) {
  std::string plain, given;
  EXPECT_EQ(given_faults({}, &plain), "");
  EXPECT_EQ(given_faults({{"n", "", "5", {}},
                          {"R", "", "1.5 + 2.0", {}},
                          {"t", "pse", "POSE(POSITION(7.0, 8.0, 9.0), ORIZYX(0.0, 0.0, 0.0))", {}}},
                         &given),
            "");
  EXPECT_NE(plain, given);
  EXPECT_NE(given.find("3.5"), std::string::npos) << given;
  EXPECT_EQ(plain.find("3.5"), std::string::npos);
  // A line end in a value is a blank.
  EXPECT_EQ(given_faults({{"r", "", "1.5\n + 2.0", {}}, {"n", "", "3", {}}}), "");
}

TEST(IrlGivenValues, WhatDoesNotFitIsAFault) {
  const auto says = [](const std::vector<GivenValue>& values, const char* words) {
    const std::string all = given_faults(values);
    EXPECT_NE(all.find(words), std::string::npos) << all;
  };
  says({{"nobody", "", "1", {}}}, "declares no nobody");
  says({{"", "", "", {}}}, "declares no ");
  says({{"r", "", "TRUE", {}}}, "needs REAL");
  says({{"n", "", "1.5", {}}}, "needs INT");
  says({{"s", "", "3", {}}}, "takes none");
  says({{"t", "NONE", "3", {}}}, "has no field NONE");
  says({{"u", "PSE", "POSE(POSITION(7.0, 8.0, 9.0), ORIZYX(0.0, 0.0, 0.0))", {}}}, "others none");
  for (const char* broken : {"", "1 +", "(", ")", ";", "1; r := 2", "'", "{", "{ }", "\xff", "r",
                             "r := 3", "1.0e999", "nothing", "((((((((((1", "BEGIN", "ENDPROGRAM;"})
    EXPECT_NE(given_faults({{"r", "", broken, {}}}), "") << broken;
  // A long one is read, or refused with a sentence.
  std::string sum = "1.0";
  for (int i = 0; i < 20000; ++i) sum += " + 1.0";
  (void)given_faults({{"r", "", sum, {}}});
}

}  // namespace
}  // namespace robomosp::irl
