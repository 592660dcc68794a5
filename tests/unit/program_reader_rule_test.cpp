// SPDX-License-Identifier: Apache-2.0
// The rule of all readers of controllers' programs: every statement is carried out, or is an error
// at its line; a warning moves and switches as before; what is made compiles.
#include <algorithm>
#include <array>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "compile.h"
#include "readers.h"
#include "support/reader_settings.h"
#include "support/seed.h"

namespace robomosp::readers {
namespace {

using RuleReader = Made (*)(const ProgramReaderTask&, const Params&, Progress&);
struct RuleFile {
  std::string name, text;
};
std::unique_ptr<ReadProgram> read_for_rule(RuleReader reader, const std::vector<RuleFile>& files) {
  std::vector<SourceFile> all;
  for (const RuleFile& f : files) all.push_back({f.name, f.text, {}});
  ProgramReaderTask task;
  task.files = all;
  NoProgress progress;
  auto made = reader(task, test::ReaderSettings(), progress);
  EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().sentence());
  return made.ok() ? std::move(made).value() : nullptr;
}
/// Errors of the IRL; "" = it compiles.
std::string rule_irl_errors(const ReadProgram& p) {
  std::vector<SourceFile> files;
  for (const ReadFile& f : p.files()) files.push_back({f.name, f.text, {}});
  NoProgress progress;
  const auto made = irl::compile(files, progress);
  if (!made.ok()) return made.error().sentence();
  std::string out;
  for (const rmp_code_fault& f : made.value()->faults)
    if (f.severity == RMP_FAULT_ERROR) out += std::to_string(f.span.line) + ": " + f.message + "\n";
  return out;
}
/// "3 error", "5 warning" of each fault that is no note, and the messages.
std::string rule_faults(const ReadProgram& p, bool with_messages) {
  std::string out;
  for (const rmp_code_fault& f : p.faults())
    if (f.severity != RMP_FAULT_NOTE)
      out += std::to_string(f.span.line) + (f.severity == RMP_FAULT_ERROR ? " error" : " warning") +
             (with_messages ? " " + std::string(f.message) : "") + "\n";
  return out;
}
std::string rule_trimmed(const std::string& s) {
  const std::size_t b = s.find_first_not_of(' ');
  return b == std::string::npos ? std::string() : s.substr(b, s.find_last_not_of(' ') - b + 1);
}
/// The first of the expected lines that the IRL lacks in their order; "" = it has all of them.
std::string missing_line(const ReadProgram& p, const std::string& expected) {
  std::istringstream made{std::string(p.files()[0].text)}, wanted{expected};
  std::string line;
  for (std::string want; std::getline(wanted, want);) {
    if ((want = rule_trimmed(want)).empty()) continue;
    bool is_found = false;
    while (!is_found && std::getline(made, line)) is_found = rule_trimmed(line) == want;
    if (!is_found) return want;
  }
  return {};
}

struct Rule {
  const char* text;    ///< the statements of a program
  const char* faults;  ///< of their lines, counted from 1
  const char* irl;     ///< lines that the IRL has, in this order
};
void expect_rules(RuleReader reader, const char* file, const std::string& before,
                  const std::string& behind, const std::vector<Rule>& rules,
                  const std::vector<RuleFile>& beside = {}) {
  const auto first = static_cast<int>(std::count(before.begin(), before.end(), '\n'));
  for (const Rule& r : rules) {
    SCOPED_TRACE(r.text);
    std::vector<RuleFile> files{{file, before + r.text + "\n" + behind}};
    files.insert(files.end(), beside.begin(), beside.end());
    const auto p = read_for_rule(reader, files);
    ASSERT_TRUE(p);
    std::string faults;
    std::istringstream lines{rule_faults(*p, false)};
    for (std::string l; std::getline(lines, l);)
      faults += std::to_string(std::stoi(l) - first) + l.substr(l.find(' ')) + "\n";
    EXPECT_EQ(faults, r.faults) << rule_faults(*p, true);
    EXPECT_EQ(missing_line(*p, r.irl), "") << p->files()[0].text;
    EXPECT_EQ(rule_irl_errors(*p), "") << p->files()[0].text;
  }
}

constexpr const char* kKrlTool = "$TOOL={X 0,Y 0,Z 100,A 0,B 0,C 0}\n";
constexpr const char* kKrlGo = "LIN {X 500,Y 0,Z 350,A 0,B 90,C 0}";

TEST(ProgramReaderRule, KrlSettingsHoldFromWhereTheyAre) {
  const std::string go = kKrlGo, tool = kKrlTool;
  const std::string moved = "MOVE LIN POSE(POSITION(500.0, 0.0, 350.0), ORIZYX(0.0, 90.0, 0.0))";
  const std::string late = go + "\n" + tool + go;
  const std::string late_irl = moved + ";\n" + moved + " TOOL := present_tool;";
  const std::string branch = "IF $IN[1] THEN\n$BASE={X 100,Y 0,Z 0,A 0,B 0,C 0}\nENDIF\n" + go;
  const std::string branch_irl =
      "IF in_1 THEN\npresent_frame := POSE(POSITION(100.0, 0.0, 0.0), ORIZYX(0.0, 0.0, "
      "0.0));\nENDIF;\n" +
      moved + " FRAME := present_frame;";
  const std::string both = "IF $IN[1] THEN\n" + tool + "ELSE\n" + tool + "ENDIF\n" + go;
  const std::string loop = tool + "LOOP\n" + go + "\n$TOOL={X 0,Y 0,Z 7,A 0,B 0,C 0}\nENDLOOP";
  const std::string loop_irl =
      "present_tool := POSE(POSITION(0.0, 0.0, 100.0), ORIZYX(0.0, 0.0, "
      "0.0));\nLOOP\n" +
      moved +
      " TOOL := present_tool;\npresent_tool := "
      "POSE(POSITION(0.0, 0.0, 7.0), ORIZYX(0.0, 0.0, 0.0));";
  const std::string jump = "GOTO there\n" + tool + "there:\n" + go + "\n" + tool + go;
  const std::string part = tool + "$TOOL.Z=5\n" + go;
  const std::string part_irl = "present_tool.POS.Z := 5.0;\n" + moved + " TOOL := present_tool;";
  const std::string some = tool + "$TOOL={Z 5}\n" + go;
  const std::string unknown_part = "$BASE={X 1}\n" + go;
  const std::string called = "settool( )\n" + go;
  const std::string near = go + " C_DIS\n$APO.CDIS=5\n" + go + " C_DIS";
  const std::string joints = "PTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\n" + tool + go;
  const std::string with =
      tool + "S" + go + " WITH $VEL=SVEL_CP(0.02), $TOOL={X 0,Y 0,Z 9,A 0,B 0,C 0}\n" + go;
  const std::string with_irl = moved +
                               " SPEED := 20.0 TOOL := POSE(POSITION(0.0, 0.0, 9.0), ORIZYX(0.0, "
                               "0.0, 0.0));\n" +
                               moved + " TOOL := present_tool;";
  const std::string with_unknown = tool + "S" + go + " WITH $CIRC_TYPE=#PATH";
  expect_rules(read_krl, "p.src", "DEF p( )\n", "END\n",
               {{late.c_str(), "1 error\n", late_irl.c_str()},
                {branch.c_str(), "4 error\n", branch_irl.c_str()},
                {both.c_str(), "", (moved + " TOOL := present_tool;").c_str()},
                {jump.c_str(), "4 error\n", ""},
                {near.c_str(), "1 error\n", ""},
                {joints.c_str(), "", ""},
                {with_unknown.c_str(), "2 error\n", ""},
                {unknown_part.c_str(), "1 error\n2 error\n", "present_frame.POS.X := 1.0;"}});
  expect_rules(read_krl, "p.src", "DEF p( )\n",
               "END\nDEF settool( )\n$TOOL={X 0,Y 0,Z 3,A 0,B 0,C 0}\nEND\n",
               {{called.c_str(), "", ("settool();\n" + moved + " TOOL := present_tool;").c_str()}});
  expect_rules(read_krl, "p.src", "DEF p( )\n", "END\n",
               {{loop.c_str(), "", loop_irl.c_str()},
                {part.c_str(), "", part_irl.c_str()},
                {some.c_str(), "", part_irl.c_str()},
                {with.c_str(), "", with_irl.c_str()}});
}
// A setting of one value stays a variable with that value.
TEST(ProgramReaderRule, ASettingWithOneValueIsSetOnce) {
  const auto p = read_for_rule(read_krl, {{"p.src", "DEF p( )\n" + std::string(kKrlTool) + kKrlGo +
                                                        "\n" + kKrlTool + kKrlGo + "\nEND\n"}});
  EXPECT_EQ(missing_line(*p,
                         "POSE: present_tool := POSE(POSITION(0.0, 0.0, 100.0), ORIZYX(0.0, "
                         "0.0, 0.0));"),
            "");
  EXPECT_EQ(p->files()[0].text.find("  present_tool :="), std::string::npos) << p->files()[0].text;
}
TEST(ProgramReaderRule, SettingsOfOtherLanguagesHoldFromWhereTheyAre) {
  const auto ur = read_for_rule(
      read_urscript, {{"p.script",
                       "def p():\n  movel(p[0.4,0,0.3,0,0,0], v=0.1)\n  set_tcp(p[0,0,0.1,0,0,0])\n"
                       "  movel(p[0.4,0,0.3,0,0,0], v=0.1)\nend\n"}});
  EXPECT_EQ(rule_faults(*ur, false), "2 error\n") << rule_faults(*ur, true);
  const auto melfa = read_for_rule(
      read_melfa,
      {{"p.prg", "1 Mvs P1\n2 Tool (0,0,100,0,0,0)\n3 Mvs P1\n4 End\nP1=(1,2,3,0,0,0)(7,0)\n"}});
  EXPECT_EQ(rule_faults(*melfa, false), "1 error\n") << rule_faults(*melfa, true);
}

TEST(ProgramReaderRule, KrlStatementsAreCarriedOutOrRefused) {
  expect_rules(
      read_krl, "p.src",
      "DEF p( )\nDECL INT n\nDECL FRAME f\nDECL E6POS q\nDECL AXIS a\nDECL REAL r\n", "END\n",
      {{"f={X 10}", "", "f.POS.X := 10.0;"},
       {"q={X 10,Z 5}", "", "q.PSE.POS.X := 10.0;\nq.PSE.POS.Z := 5.0;"},
       {"a={A1 5}", "", "a.A1 := 5.0;"},
       {"LIN {X 10}", "1 error\n", "{ not read: LIN (X 10) }"},
       {"IF foo[3 THEN\n$OUT[1]=TRUE\nENDIF", "1 error\n", "IF FALSE THEN\nout_1 := TRUE;\nENDIF;"},
       {"WHILE foo>1\n$OUT[1]=TRUE\nENDWHILE", "1 error\n",
        "WHILE FALSE DO\nout_1 := TRUE;\nENDWHILE;"},
       {"FOR n=1 TO foo\nEXIT\nENDFOR", "1 error\n", "WHILE FALSE DO\nEXIT;\nENDWHILE;"},
       {"SWITCH n\nCASE 1\n$OUT[1]=TRUE\nCASE 1,2\n$OUT[2]=TRUE\nENDSWITCH", "",
        "WHEN 1:\nout_1 := TRUE;\nWHEN 2:\nout_2 := TRUE;"},
       {"SWITCH n\n$OUT[3]=TRUE\nCASE 1\n$OUT[1]=TRUE\nENDSWITCH", "2 error\n", "out_3 := TRUE;"},
       {"SWITCH n\nDEFAULT\n$OUT[1]=TRUE\nENDSWITCH", "", "out_1 := TRUE;"},
       {"SWITCH n\nCASE foo\n$OUT[1]=TRUE\nCASE 2\n$OUT[2]=TRUE\nENDSWITCH", "2 error\n",
        "IF FALSE THEN\nout_1 := TRUE;\nELSIF n = 2 THEN\nout_2 := TRUE;\nENDIF;"},
       {"SWITCH r\nCASE 2\n$OUT[1]=TRUE\nENDSWITCH", "", "IF r = 2 THEN\nout_1 := TRUE;\nENDIF;"},
       {"IF n==1 THEN\nELSE\nELSE\n$OUT[1]=TRUE\nENDIF", "3 error\n", ""},
       {"$APO.CDIS=5\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0} C_DIS C_DIS", "",
        "MOVE LIN POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0)) C_CP := 5.0;"},
       {"LIN {X 1,Y 2,Z 3,A 0,B 0,C 0} C_ORI", "1 error\n", ""},
       {"CIRC {X 1,Y 2,Z 3,A 0,B 0,C 0},{X 4,Y 5,Z 6,A 0,B 0,C 0}, CA 90", "1 error\n", ""},
       {"PULSE($OUT[7],TRUE,0.5)\n$OUT[8]=TRUE", "",
        "CANCEL pulse_out_7;\nout_7 := TRUE;\nlength_out_7 := 0.5;\nSTART pulse_out_7;\nout_8 := "
        "TRUE;"},
       {"$APO.CDIS=5\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0} C_DIS\nWAIT SEC 0", "",
        "MOVE LIN POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0)) C_CP := 5.0;\nWAIT 0.0 "
        "SEC;"},
       {"CONTINUE\n$OUT[1]=TRUE", "1 error\n", "out_1 := TRUE;"},
       {"CONTINUE\nn=1", "", "n := 1;"},
       {"FDAT_ACT=FHOME\nBAS(#PTP_PARAMS,100)\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}", "3 error\n3 error\n",
        "R_SPEED_PTP := 100.0;"},
       {"$MSG_T.KEY=5", "1 warning\n", ""},
       {"$ORI_TYPE=#CONSTANT", "1 error\n", ""},
       {"$ORI_TYPE=#VAR", "", ""},
       {"$IPO_MODE=#TCP", "1 error\n", ""},
       {"$OV_PRO=50", "1 error\n", ""},
       {"$OV_PRO=100", "", ""},
       {"$VEL_AXIS[1]=20\n$VEL_AXIS[2]=30", "2 error\n", "R_SPEED_PTP := 20.0;"},
       {"$VEL_AXIS[1]=20\n$VEL_AXIS[2]=20", "", "R_SPEED_PTP := 20.0;"},
       {"$ACC.CP=1.5", "1 warning\n", ""},
       {"other( )", "1 error\n", "other();"},
       {"IF $IN[1]==TRUE AND $IN[2] THEN\n$OUT[1]=TRUE\nENDIF", "1 error\n", "out_1 := TRUE;"},
       {"IF ($IN[1]==TRUE) AND $IN[2] THEN\nENDIF", "", "IF in_1 = TRUE AND in_2 THEN"},
       {"TRIGGER WHEN DISTANCE=0 DELAY=20 DO $OUT[9]=TRUE", "1 error\n", ""},
       {"BASE_DATA[2].Z=5\nBASE_DATA[3].Z=6", "1 error\n", "base_data[3].POS.Z := 6.0;"},
       {"SPTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0} WITH $VEL_AXIS[1]=SVEL_JOINT(40)", "",
        "MOVE PTP MAIN_JOINT(0.0, 0.0, 0.0, 0.0, 0.0, 0.0) SPEED_PTP := 40.0;"}});
}

/// A position that gets no value, only some components, or a value that depends on itself is the
/// controller's: an error where the robot moves to it. One that gets all components is known.
TEST(ProgramReaderRule, TargetsWithoutAWholeValueAreErrors) {
  const std::string tool = kKrlTool, from = "DEF probe( )\nDECL FRAME p,q\nDECL E6AXIS j\n" + tool +
                                            "$BASE={X 0,Y 0,Z 0,A 0,B 0,C 0}\n$VEL.CP=0.2\n";
  const std::string whole = "p.X=1\np.Y=2\np.Z=3\np.A=0\np.B=0\np.C=0\nLIN p";
  const std::string later = "p={X 1,Y 2,Z 3,A 0,B 0,C 0}\np.Z=p.Z+5\nq=p\nLIN q";
  const std::string joints = "j.A1=1\nj.A2=2\nj.A3=3\nj.A4=4\nj.A5=5\nj.A6=6\nPTP j";
  expect_rules(read_krl, "probe.src", from, "END\n",
               {{"LIN p", "1 error\n", ""},
                {"p.X=10\np.Z=20\nLIN p", "3 error\n", ""},
                {"p.X=10\nq=p\nLIN q\nLIN q", "3 error\n", ""},
                {"p.Z=p.Z+5\nLIN p", "2 error\n", ""},
                {"j.A1=5\nPTP j", "2 error\n", ""},
                {whole.c_str(), "", "MOVE LIN p TOOL := present_tool FRAME := present_frame;"},
                {later.c_str(), "", "MOVE LIN q TOOL := present_tool FRAME := present_frame;"},
                {joints.c_str(), "", "MOVE PTP j TOOL := present_tool;"}});
  expect_rules(read_rapid, "probe.mod",
               "MODULE probe\n VAR robtarget p;\n VAR jointtarget j;\n PROC main()\n",
               " ENDPROC\nENDMODULE\n",
               {{"p.trans.z:=50;\nMoveL p,v100,fine,tool0;", "2 error\n", ""},
                {"p.trans:=[1,2,3];\np.rot:=[1,0,0,0];\nMoveL p,v100,fine,tool0;", "",
                 "MOVE LIN p SPEED := 100.0;"},
                // Joints are 0 in RAPID.
                {"j.robax.rax_1:=5;\nMoveAbsJ j,v100,fine,tool0;", "", "j.A1 := 5.0;"}});
  expect_rules(read_melfa, "probe.prg", "", "",
               {{"1 Mvs P1", "1 error\n", ""},
                {"1 P1.X=10\n2 Mvs P1", "2 error\n", ""},
                {"1 P1=P1+P2\n2 Mvs P1\nP2=(1,2,3,0,0,0)(7,0)", "2 error\n", ""}});
  expect_rules(
      read_as, "probe.as", ".PROGRAM probe()\n", ".END\n",
      {{"POINT p = SHIFT(p BY 0,0,5)\nLMOVE p", "2 error\n", ""},
       {"POINT p = TRANS(1,2,3,0,0,0)\nPOINT p = SHIFT(p BY 0,0,5)\nLMOVE p", "", "MOVE LIN p;"}});
  expect_rules(
      read_pdl2, "probe.pdl", "PROGRAM probe\nVAR p : POSITION\nBEGIN\n", "END probe\n",
      {{"MOVE LINEAR TO p", "1 error\n", ""},
       {"p.X := 5\nMOVE LINEAR TO p", "2 error\n", ""},
       {"p := POS(1, 2, 3, 0, 0, 0, '')\np.X := 5\nMOVE LINEAR TO p", "", "MOVE LIN p.PSE;"}});
}

TEST(ProgramReaderRule, ATestOfAnExpressionHasItsCases) {
  expect_rules(read_rapid, "probe.mod", "MODULE probe\n VAR num n:=4;\n PROC main()\n",
               " ENDPROC\nENDMODULE\n",
               {{"TEST n/2\nCASE 2:\nn:=9;\nDEFAULT:\nn:=1;\nENDTEST", "",
                 "tested := n / 2;\nIF tested = 2 THEN\nn := 9.0;\nELSE\nn := 1.0;\nENDIF;"},
                {"TEST n/2\nn:=3;\nCASE 2:\nn:=9;\nENDTEST", "2 error\n", ""}});
}

TEST(ProgramReaderRule, KrlTakesOfConfigDatWhatTheProgramUses) {
  const auto p = read_for_rule(
      read_krl, {{"p.src", "DEF p( )\nFDAT_ACT=FP1\nBAS(#CP_PARAMS,0.5)\nLIN XP1\nEND\n"},
                 {"p.dat",
                  "DEFDAT p\nDECL E6POS XP1={X 1,Y 2,Z 3,A 0,B 0,C 0,S 2,T 0}\n"
                  "DECL FDAT FP1={TOOL_NO 2,BASE_NO 0,IPO_FRAME #BASE}\nENDDAT\n"},
                 {"$config.dat",
                  "DEFDAT $CONFIG\nDECL STRANGE_T other={A 1,B #X}\nSIGNAL pump $ANOUT[3]\n"
                  "DECL FRAME TOOL_DATA[16]\nTOOL_DATA[2]={X 0,Y 0,Z 70,A 0,B 0,C 0}\n"
                  "broken[2]={{\nENDDAT\n"}});
  EXPECT_EQ(rule_faults(*p, true), "");
  EXPECT_EQ(missing_line(*p,
                         "TOOL_DATA[2] := POSE(POSITION(0.0, 0.0, 70.0), ORIZYX(0.0, 0.0, 0.0));\n"
                         "present_tool := TOOL_DATA[2];"),
            "")
      << p->files()[0].text;
  EXPECT_EQ(rule_irl_errors(*p), "");
}

TEST(ProgramReaderRule, RapidStatementsAreCarriedOutOrRefused) {
  const std::string place = "[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
  const std::string conf =
      "ConfJ\\Off;\nMoveJ p1,v100,fine,tool0;\nConfJ\\On;\nMoveJ p1,v100,fine,tool0;";
  const std::string mixed = "IF di1=1 ConfJ\\Off;\nMoveJ p1,v100,fine,tool0;";
  const std::string disp =
      "PDispSet [[10,0,0],[1,0,0,0]];\nMoveL p1,v100,fine,tool0\\WObj:=w;\nPDispOff;\nMoveL "
      "p1,v100,fine,tool0;";
  expect_rules(
      read_rapid, "p.mod",
      "MODULE p\nVAR num n;\nVAR robtarget p1:=" + place +
          ";\nVAR num list{2,2};\nPERS tooldata g:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],"
          "[1,0,0,0],0,0,0]];\nPERS wobjdata w:=[FALSE,TRUE,\"\",[[5,0,0],[1,0,0,0]],[[0,0,0],"
          "[1,0,0,0]]];\nPERS tooldata tools{2}:=[[TRUE,[[0,0,1],[1,0,0,0]],[1,[0,0,50],"
          "[1,0,0,0],0,0,0]],[TRUE,[[0,0,2],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]]];\n"
          "PROC go(robtarget t)\nMoveL t,v100,fine,tool0;\nENDPROC\nPROC main()\n",
      "ENDPROC\nENDMODULE\n",
      {{"p1.trans:=[1,2,3];", "", "p1.PSE.POS := POSITION(1.0, 2.0, 3.0);"},
       {"list:=[[1,2],[3,4]];", "", "list_v := [[1.0, 2.0], [3.0, 4.0]];"},
       {"go [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];", "",
        "go(ROBTARGET(POSE(POSITION(1.0, 2.0, 3.0), ORIQUAT(1.0, 0.0, 0.0, 0.0)), 0, [0, -128, "
        "-128, 0, -128, 0], ADD_JOINT(0.0)));"},
       {"g.tframe.trans.z:=50;\nMoveL p1,v100,fine,g;", "",
        "g.POS.Z := 50.0;\nMOVE LIN p1 SPEED := 100.0 TOOL := g;"},
       {"MoveL p1,v100,fine,tools{2};", "", "MOVE LIN p1 SPEED := 100.0 TOOL := tools[2];"},
       {"w.oframe:=[[1,2,3],[1,0,0,0]];", "1 error\n", ""},
       {"n:=2.4;\nTEST n\nCASE 2: Set do1;\nENDTEST", "",
        "n := 2.4;\nIF n = 2 THEN\ndo1 := TRUE;\nENDIF;"},
       {"TEST n\nCASE 1,2: Set do1;\nDEFAULT: Reset do1;\nCASE 3: Set do2;\nENDTEST", "4 error\n",
        "IF n = 1 OR n = 2 THEN\ndo1 := TRUE;\nELSE\ndo1 := FALSE;"},
       {"IF foo(3)=1 THEN\nSet do1;\nELSEIF bar{2}>1 THEN\nSet do2;\nENDIF", "1 error\n3 error\n",
        "do1 := TRUE;\nELSIF FALSE THEN\ndo2 := TRUE;\nENDIF;"},
       {"VelSet 50,800;", "1 error\n", ""},
       {"VelSet 100,5000;", "", ""},
       {"AccSet 50,100;", "", "R_ACC := 50.0;"},
       {"AccSet 50,80;", "1 warning\n", "R_ACC := 50.0;"},
       {"SingArea\\Wrist;", "1 error\n", ""},
       {"SingArea\\Off;", "", ""},
       {conf.c_str(), "", "MOVE PTP p1.PSE SPEED_PTP := 10.0;\nMOVE PTP p1 SPEED_PTP := 10.0;"},
       {mixed.c_str(), "2 error\n", ""},
       {disp.c_str(), "",
        "present_displacement := POSE(POSITION(10.0, 0.0, 0.0), ORIQUAT(1.0, 0.0, 0.0, 0.0));\n"
        "MOVE LIN p1 SPEED := 100.0 FRAME := w @ present_displacement;"},
       {"InvertDO do1;", "", "do1 := NOT do1;"},
       {"PulseDO\\PLength:=0.3,do1;\nSet do2;", "",
        "do1 := NOT do1;\nlength_do1 := 0.3;\nSTART pulse_do1;\ndo2 := TRUE;"},
       {"MoveL p1,v100,z10,tool0;\nWaitTime\\InPos,0.5;", "", "WAIT 0.5 SEC;"},
       {"MoveL p1,v100,z10,tool0;\nWaitRob\\InPos;", "", "WAIT 0.0 SEC;"},
       {"g.tload.mass:=3;", "1 warning\n", ""},
       {"FOR i FROM 10 TO 1 STEP n DO\nn:=n+i;\nENDFOR", "", "FOR i := 10 TO 1 STEP ROUND(n) DO"},
       {"FOR i FROM 0 TO 1 STEP 0.1 DO\nSet do1;\nENDFOR", "1 error\n", "do1 := TRUE;"},
       {"FOR i FROM 10 TO 1 STEP 0 DO\nENDFOR", "1 error\n", ""},
       {"MoveL p1,v100,fine,tool0;\nWaitTime\\InPos,0.5;", "", "WAIT 0.5 SEC;"},
       {"MoveL p1,v100,z20\\Inpos:=inpos50,tool0;", "", "MOVE LIN p1 SPEED := 100.0;"},
       {"MoveL\\Conc,p1,v100,fine,tool0;", "1 error\n", ""},
       {"WaitDI di1,1\\MaxTime:=2;", "",
        "WAIT FOR di1 = TRUE TIMEOUT 2.0;\nIF R_TIMEOUT THEN HALT; ENDIF;"},
       {"FOR i FROM 1 TO n DO\nn:=n+i;\nENDFOR", "",
        "FOR i := 1 TO ROUND(n) STEP counting(1, ROUND(n)) DO"},
       {"other;", "1 error\n", "other();"},
       {"EOffsSet [10,0,0,0,0,0];", "1 error\n", ""},
       {"PDispOn\\Rot,p1,tool0;", "1 error\n", ""},
       {"ActUnit STN1;", "1 warning\n", ""}});
}

// ---- programs of pieces, whole and broken, in any order ----

struct Pieces {
  RuleReader reader;
  const char *file, *before, *behind;
  std::vector<const char*> pieces;
};
const std::vector<Pieces>& pieces_of_languages() {
  static const std::vector<Pieces> kPieces{
      {read_krl,
       "p.src",
       "DEF p( )\nDECL INT i,n\nDECL REAL r\nDECL BOOL b\nDECL FRAME f\nDECL E6POS q\nDECL AXIS "
       "a\nDECL INT list[3]\nDECL CHAR word[10]\n",
       "END\nDEF sub(x:IN,y:OUT)\nDECL INT x\nDECL REAL y\ny=x\nEND\nDEFFCT REAL half(x:IN)\nREAL "
       "x\nRETURN x/2\nENDFCT\n",
       {"IF n==1 THEN",
        "IF b AND foo THEN",
        "IF (n",
        "ELSE",
        "ENDIF",
        "FOR i=1 TO 5",
        "FOR i=1 TO 9 STEP 0",
        "FOR x=1 TO 2",
        "ENDFOR",
        "WHILE b",
        "WHILE zz[",
        "ENDWHILE",
        "REPEAT",
        "UNTIL n>3",
        "UNTIL",
        "LOOP",
        "ENDLOOP",
        "SWITCH n",
        "SWITCH r",
        "SWITCH word[]",
        "SWITCH",
        "CASE 1",
        "CASE 1,2,n",
        "CASE \"a\"",
        "CASE r",
        "DEFAULT",
        "ENDSWITCH",
        "EXIT",
        "GOTO here",
        "here:",
        "GOTO nowhere",
        "RETURN",
        "RETURN 5",
        "n=n+1",
        "r=7/2",
        "n=half(3)",
        "b=NOT b",
        "b=n",
        "f={X 1}",
        "f={X 1,Y 2,Z 3,A 0,B 0,C 0}",
        "q={X 1,Y 2,Z 3,A 0,B 0,C 0,S 2,T 5}",
        "q=f",
        "f=q",
        "q.A=5",
        "a={A1 0,A2 0}",
        "list[2]=5",
        "list[9]=5",
        "list[]=5",
        "word[]=\"hello\"",
        "word[1]=\"h\"",
        "sub(n,r)",
        "sub(n,n)",
        "sub(n)",
        "sub()",
        "half(2)",
        "missing(3)",
        "missing(3,4)",
        "missing(\"a\")",
        "$TOOL={X 0,Y 0,Z 5,A 0,B 0,C 0}",
        "$BASE=BASE_DATA[2]",
        "$BASE=BASE_DATA[n]",
        "$BASE.X=5",
        "$TOOL=foo",
        "TOOL_DATA[4].Z=5",
        "$APO.CDIS=n",
        "$VEL.CP=0.2",
        "$VEL.CP=n",
        "$VEL_AXIS[2]=7",
        "$OUT[3]=TRUE",
        "$OUT[n]=TRUE",
        "$OUT[4]=$IN[2] AND NOT b",
        "PULSE($OUT[3],TRUE,0.2)",
        "PULSE($OUT[3],FALSE,r)",
        "WAIT SEC 0.5",
        "WAIT SEC r",
        "WAIT FOR $IN[3]",
        "WAIT FOR",
        "HALT",
        "LIN q",
        "LIN f C_DIS",
        "LIN q C_DIS C_DIS",
        "PTP q C_PTP C_DIS",
        "PTP a",
        "LIN a",
        "LIN n",
        "LIN f:f",
        "LIN_REL {Z 5}",
        "CIRC q,f",
        "CIRC q",
        "CIRC q,f,CA 20",
        "SLIN q WITH $VEL=SVEL_CP(0.1), $TOOL=TOOL_DATA[2]",
        "SPTP q WITH $VEL_AXIS[1]=SVEL_JOINT(30) C_SPL",
        "PTP XHOME",
        "INTERRUPT DECL 4 WHEN $IN[3] DO missing( )",
        "INTERRUPT ON 4",
        "INTERRUPT OFF",
        "BRAKE",
        "RESUME",
        "= = 4",
        ")",
        "{",
        "x"}},
      {read_rapid,
       "p.mod",
       "MODULE p\nRECORD rec num a; bool b; ENDRECORD\nVAR num n;\nVAR bool b;\nVAR string s;\nVAR "
       "pos v;\nVAR pose f;\nVAR robtarget p1;\nVAR jointtarget j1;\nVAR rec r1;\nVAR num "
       "list{3};\nPERS tooldata "
       "g:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];\nPROC "
       "sub(num x,INOUT num y)\ny:=x;\nENDPROC\nFUNC num half(num x)\nRETURN x/2;\nENDFUNC\nTRAP "
       "tr\nSet do1;\nENDTRAP\nPROC main()\n",
       "ENDPROC\nENDMODULE\n",
       {"IF n=1 THEN",
        "IF b AND foo THEN",
        "IF n=1 Set do1;",
        "IF (n THEN",
        "ELSEIF n=3 THEN",
        "ELSEIF foo THEN",
        "ELSE",
        "ENDIF",
        "FOR i FROM 1 TO 5 DO",
        "FOR i FROM 1 TO n STEP 2 DO",
        "FOR i FROM foo TO 3 DO",
        "ENDFOR",
        "WHILE b DO",
        "WHILE n DO",
        "WHILE foo DO",
        "ENDWHILE",
        "TEST n",
        "TEST s",
        "TEST b",
        "TEST foo",
        "CASE 1,2:",
        "CASE n:",
        "CASE \"a\":",
        "CASE TRUE:",
        "CASE foo:",
        "DEFAULT:",
        "ENDTEST",
        "GOTO here;",
        "here:",
        "GOTO nowhere;",
        "RETURN;",
        "RETURN 5;",
        "n:=n+1;",
        "n:=half(3);",
        "n:=half();",
        "b:=NOT b AND n>3;",
        "b:=n;",
        "s:=\"x\"+s;",
        "s:=n;",
        "v:=[1,2,3];",
        "v:=p1.trans;",
        "v:=v+p1.trans;",
        "f:=[[1,2,3],[1,0,0,0]];",
        "p1:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];",
        "p1:=Offs(p1,1,2,3);",
        "p1.trans:=[1,2,3];",
        "p1.trans.x:=4;",
        "p1.robconf:=[0,0,0,0];",
        "p1:=f;",
        "r1:=[3,TRUE];",
        "r1:=[3];",
        "r1.a:=3;",
        "list:=[1,2,3];",
        "list:=[1,2];",
        "list{2}:=n;",
        "list{7}:=n;",
        "sub 3,n;",
        "sub 3,list{1};",
        "sub 3;",
        "sub [1,2],n;",
        "half 3;",
        "missing 3;",
        "missing 3,4;",
        "missing \"a\";",
        "missing\\sw;",
        "g.tframe.trans.z:=4;",
        "g:=[TRUE,[[0,0,1],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];",
        "MoveL p1,v100,fine,tool0;",
        "MoveL p1,v100,z10,g;",
        "MoveJ p1,v100\\T:=3,z10,g\\WObj:=wobj0;",
        "MoveL Offs(p1,0,0,n),v100,fine,g;",
        "MoveC p1,p1,v100,fine,g;",
        "MoveC p1,v100,fine,g;",
        "MoveAbsJ j1,v100,fine,g;",
        "MoveL j1,v100,fine,g;",
        "MoveL p9,vfoo,fine,g;",
        "MoveL p1,v100,fine,tGone;",
        "MoveL p1;",
        "MoveL RelTool(p1,0,0,5\\Rz:=20),v100,fine,g;",
        "SetDO do1,1;",
        "SetGO go1,n;",
        "SetAO ao1,n;",
        "SetDO do1,n;",
        "Set go1;",
        "PulseDO do1;",
        "PulseDO\\High\\PLength:=n,do1;",
        "InvertDO do1;",
        "WaitDI di1,1;",
        "WaitDI di1,1\\MaxTime:=n;",
        "WaitUntil b;",
        "WaitTime n;",
        "WaitTime\\InPos,0;",
        "TPWrite \"n=\"\\Num:=n;",
        "ConfJ\\Off;",
        "ConfL\\On;",
        "PDispSet f;",
        "PDispSet [[1,2,3],[1,0,0,0]];",
        "PDispOff;",
        "VelSet n,100;",
        "AccSet n,100;",
        "AccSet 100,100;",
        "Incr n;",
        "Add n,2;",
        "Incr s;",
        "Stop;",
        "EXIT;",
        "CONNECT i1 WITH tr;",
        "ISignalDI di1,1,i1;",
        ":= 4;",
        ")",
        "];",
        "x"}}};
  return kPieces;
}
TEST(ProgramReaderRule, WhatIsReadCompilesWhateverTheProgramIs) {
  std::mt19937 random(test::seed());
  for (const Pieces& l : pieces_of_languages()) {
    int whole = 0;
    for (int round = 0; round < 600; ++round) {
      std::string text = l.before;
      // Few pieces at first, so that some programs are whole.
      const int count = std::uniform_int_distribution<int>(1, 1 + round / 20)(random);
      for (int k = 0; k < count; ++k)
        text += std::string(l.pieces[std::uniform_int_distribution<std::size_t>(
                    0, l.pieces.size() - 1)(random)]) +
                "\n";
      text += l.behind;
      const auto p = read_for_rule(l.reader, {{l.file, text}});
      ASSERT_TRUE(p);
      const std::string faults = rule_faults(*p, true);
      whole += faults.find(" error ") == std::string::npos;
      ASSERT_EQ(rule_irl_errors(*p), "") << text << "\n" << faults << "\n" << p->files()[0].text;
    }
    EXPECT_GT(whole, 20) << l.file;
  }
}

}  // namespace
}  // namespace robomosp::readers
