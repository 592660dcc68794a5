// SPDX-License-Identifier: Apache-2.0
// The rule of the readers of FANUC TP, URScript, MELFA-BASIC, VAL 3 and G-code: each statement and
// argument is carried out, or is an error at its line; what is read compiles. What the IRL does is
// seen by running it, not by its text; expected values are those of the makers' manuals.
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/program_tables.h>

#include "compile.h"
#include "program/trace.h"
#include "reader.h"
#include "readers.h"
#include "support/mutator.h"
#include "support/reader_settings.h"
#include "support/seed.h"

namespace robomosp::readers {
namespace {

struct RuleFile {
  std::string name, text;
};
using RuleReader = Made (*)(const ProgramReaderTask&, const Params&, Progress&);

std::string short_number(double v) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.3f", std::fabs(v) < 5e-4 ? 0.0 : v);
  std::string s(buffer);
  while (s.back() == '0') s.pop_back();
  if (s.back() == '.') s.pop_back();
  return s;
}
std::string short_pose(const program::PlainPose& p) {
  std::string out;
  for (const double v : p.position) out += (out.empty() ? "" : ",") + short_number(v);
  // Either sign of a quaternion is the same turn.
  std::array<double, 4> q{};
  for (std::size_t i = 0; i < 4; ++i) q[i] = p.quaternion[i];
  double sign = 1;
  for (const double v : q)
    if (std::fabs(v) > 1e-6) {
      sign = v < 0 ? -1 : 1;
      break;
    }
  if (std::fabs(std::fabs(q[0]) - 1) < 1e-6) return out;
  out += " turned";
  for (const double v : q) out += " " + short_number(sign * v);
  return out;
}
std::string effect_of(const program::TracedMotion& traced) {
  const program::Motion& m = traced.motion;
  static constexpr const char* kWords[] = {"ptp", "lin", "circle", "path"};
  std::string out = std::string(m.is_incremental ? "by " : "") + kWords[m.interpolation];
  for (const program::Target& t : m.targets) {
    out += " (";
    if (t.joints.empty()) {
      out += short_pose(t.pose);
    } else {
      for (std::size_t i = 0; i < t.joints.size(); ++i)
        out += (i ? "," : "joints ") + short_number(t.joints[i]);
    }
    out += ")";
  }
  const program::MotionAttributes& a = m.attributes;
  const auto given = [&](int attribute) { return (a.given & (1U << attribute)) != 0; };
  const auto number = [&](int attribute, const char* name, double v) {
    if (given(attribute)) out += std::string(" ") + name + " " + short_number(v);
  };
  number(RMP_ATTR_SPEED, "speed", a.speed);
  number(RMP_ATTR_SPEED_ORI, "turns", a.speed_orientation);
  number(RMP_ATTR_TIME, "time", a.time);
  number(RMP_ATTR_ACC, "acc", a.acceleration);
  number(RMP_ATTR_C_CP, "near", a.c_cp);
  number(RMP_ATTR_C_SPEED, "keeps", a.c_speed);
  number(RMP_ATTR_SPEED_PTP, "percent", a.speed_ptp);
  number(RMP_ATTR_ACC_PTP, "acc%", a.acceleration_ptp);
  number(RMP_ATTR_C_PTP, "near%", a.c_ptp);
  if (given(RMP_ATTR_C_PASS) && a.passes) out += " passes";
  if (a.tool) out += " tool (" + short_pose(*a.tool) + ")";
  if (a.frame) out += " frame (" + short_pose(*a.frame) + ")";
  if (traced.until) out += " until";
  return out;
}
/// Faults that are no notes, and what the IRL does, a line each.
std::string effects_of(RuleReader reader, const std::vector<RuleFile>& files,
                       const std::map<std::string, double>& inputs, bool runs = true) {
  std::vector<SourceFile> all;
  for (const RuleFile& f : files) all.push_back({f.name, f.text, {}});
  ProgramReaderTask task;
  task.files = all;
  NoProgress progress;
  const auto read = reader(task, test::ReaderSettings(), progress);
  if (!read.ok()) return "refused: " + read.error().sentence();
  std::string out;
  for (const rmp_code_fault& f : read.value()->faults())
    if (f.severity != RMP_FAULT_NOTE)
      out += std::string(f.severity == RMP_FAULT_ERROR ? "error " : "warning ") +
             std::to_string(f.span.line) + ": " + f.message + "\n";
  std::vector<SourceFile> irl_files;
  for (const ReadFile& f : read.value()->files()) irl_files.push_back({f.name, f.text, {}});
  auto made = irl::compile(irl_files, progress);
  if (!made.ok()) return out + "no IRL: " + made.error().sentence() + "\n";
  for (const rmp_code_fault& f : (*made)->faults)
    if (f.severity == RMP_FAULT_ERROR)
      return out + "the IRL has an error in line " + std::to_string(f.span.line) + ": " +
             f.message + "\n" + std::string(irl_files[0].text);
  if (!runs) return out;
  program::TraceOptions options;
  for (const auto& [name, v] : inputs)
    options.inputs[name] = {static_cast<std::int64_t>(std::lround(v)), v};
  const auto trace =
      program::trace(std::shared_ptr<const CompiledProgram>(std::move(*made)), options);
  if (!trace.ok()) return out + "it stops: " + trace.error().sentence() + "\n";
  for (const program::TraceEntry& e : trace->entries) {
    if (const auto* m = std::get_if<program::TracedMotion>(&e.what)) out += effect_of(*m) + "\n";
    if (const auto* w = std::get_if<program::TracedWrite>(&e.what)) {
      const rmp_table& symbols = trace->program->code().symbols;
      out +=
          std::string(row<rmp_code_symbol>(symbols, w->symbol).name) + " = " +
          short_number(w->value.real != 0 ? w->value.real : static_cast<double>(w->value.integer)) +
          "\n";
    }
    if (const auto* w = std::get_if<program::TracedWait>(&e.what))
      out += w->condition ? "wait for\n" : "wait " + short_number(w->seconds) + "\n";
    if (const auto* t = std::get_if<program::TracedText>(&e.what)) out += "text " + t->text;
    if (std::get_if<program::TracedPause>(&e.what)) out += "pause\n";
    if (std::get_if<program::TracedHalt>(&e.what)) out += "halt\n";
  }
  return out;
}

struct RuleCase {
  const char* what;  ///< that is looked at
  std::vector<RuleFile> files;
  std::string expected;
  std::map<std::string, double> inputs = {};
};
/// Whatever is changed in a program, the IRL that is read from it compiles.
void expect_changed_compile(RuleReader reader, const std::vector<RuleCase>& cases) {
  static constexpr const char* kTokens[] = {"IF ", "END",   "(",    ")",   "[",  "]",
                                            "=",   ",",     ";",    "\n",  "-1", "9999",
                                            "P1",  "CALL ", "FOR ", "x = "};
  std::vector<std::string> texts;
  for (const RuleCase& c : cases)
    for (const RuleFile& f : c.files) texts.push_back(f.text);
  std::mt19937 random(test::seed());
  test::Mutator mutator(random, texts, kTokens);
  int rounds = 0, broken = 0;
  std::string first;
  for (const RuleCase& c : cases)
    for (int k = 0; k < 60; ++k, ++rounds) {
      std::vector<RuleFile> files = c.files;
      RuleFile& f = files[std::uniform_int_distribution<std::size_t>(0, files.size() - 1)(random)];
      f.text = mutator.mutate(f.text);
      const std::string effects = effects_of(reader, files, c.inputs, false);
      const std::size_t at = effects.find("the IRL has an error");
      if (at == std::string::npos) continue;
      if (broken++ < 6) first += f.text + "\n->\n" + effects.substr(at, 3000) + "\n";
    }
  EXPECT_LE(broken, rounds / 200) << broken << " of " << rounds << "\n" << first;
}
void expect_rule(RuleReader reader, const std::vector<RuleCase>& cases) {
  for (const RuleCase& c : cases) {
    SCOPED_TRACE(c.what);
    std::string expected;
    std::istringstream lines(c.expected);
    for (std::string line; std::getline(lines, line);) {
      const std::size_t b = line.find_first_not_of(' ');
      if (b != std::string::npos) expected += line.substr(b) + "\n";
    }
    EXPECT_EQ(effects_of(reader, c.files, c.inputs), expected) << c.files[0].text;
  }
  expect_changed_compile(reader, cases);
}

// ---- FANUC TP ----

/// A listing with these statements, P[1] in frame 1 with tool 1, P[2] in frame 2 with tool 1, P[3]
/// of joints and P[4] in whatever is active.
std::string listing(const std::string& statements, const std::string& name = "MAIN") {
  const auto place = [](int n, const char* frame, const char* tool, const char* x) {
    return "P[" + std::to_string(n) + "]{\n   GP1:\n\tUF : " + frame + ", UT : " + tool +
           ",\tCONFIG : 'N U T, 0, 0, 0',\n\tX = " + x +
           " mm,\tY = 0.000 mm,\tZ = 300.000 mm,\n\tW = 0.000 deg,\tP = 0.000 deg,\tR = 0.000 "
           "deg\n};\n";
  };
  return "/PROG " + name + "\n/MN\n" + statements + "/POS\n" + place(1, "1", "1", "100.000") +
         place(2, "2", "1", "200.000") +
         "P[3]{\n   GP1:\n\tUF : 0, UT : 1,\n\tJ1= 0.0 deg,\tJ2= 10.0 deg,\tJ3= -20.0 deg,\n\tJ4= "
         "0.0 "
         "deg,\tJ5= -70.0 deg,\tJ6= 0.0 deg\n};\n" +
         place(4, "F", "F", "400.000") + "/END\n";
}
const std::string kFrames =
    R"([*SYSTEM*]$MNUFRAME  Storage: CMOS  Access: RW  : ARRAY[1,9] OF POSITION
     [1,1] =
  Group: 1   Config: N D B, 0, 0, 0
  X:  1000.000   Y:     0.000   Z:     0.000
  W:     0.000   P:     0.000   R:     0.000
     [1,2] =
  Group: 1   Config: N D B, 0, 0, 0
  X:  2000.000   Y:     0.000   Z:     0.000
  W:     0.000   P:     0.000   R:     0.000
[*SYSTEM*]$MNUTOOL  Storage: CMOS  Access: RW  : ARRAY[1,10] OF POSITION
     [1,1] =
  Group: 1   Config: N D B, 0, 0, 0
  X:     0.000   Y:     0.000   Z:    10.000
  W:     0.000   P:     0.000   R:     0.000
     [1,2] =
  Group: 1   Config: N D B, 0, 0, 0
  X:     0.000   Y:     0.000   Z:    20.000
  W:     0.000   P:     0.000   R:     0.000
)";
std::vector<RuleFile> tp_with(const std::string& statements, std::vector<RuleFile> more = {}) {
  std::vector<RuleFile> out{{"main.ls", listing(statements)}, {"sysframe.va", kFrames}};
  out.insert(out.end(), more.begin(), more.end());
  return out;
}

TEST(ReaderRule, TpPlacesAreInTheFrameAndToolTheyWereTaughtIn) {
  expect_rule(
      read_tp,
      {{"what a place was taught in counts where nothing is selected",
        tp_with("L P[1] 100mm/sec FINE ;\nJ P[3] 20% FINE ;\n"),
        R"(lin (100,0,300) speed 100 tool (0,0,10) frame (1000,0,0)
           ptp (joints 0,10,-20,0,-70,0) percent 20 tool (0,0,10))"},
       {"a straight motion to joints is that of the robot's own tool",
        tp_with("UTOOL_NUM=1 ;\nL P[3] 100mm/sec FINE ;\n"),
        R"(error 4: this straight motion to joint values uses the robot's present tool, not UTOOL
           it stops: main.irl:11:3: the flow depends on the robot's state or kinematics. Run the program in a world that has the robot.)"},
       {"what is selected is what it was taught in",
        tp_with("UFRAME_NUM=1 ;\nUTOOL_NUM=1 ;\nL P[1] 100mm/sec FINE ;\nUFRAME_NUM=2 ;\n"
                "L P[2] 100mm/sec FINE ;\nL P[4] 100mm/sec FINE ;\n"),
        R"(lin (100,0,300) speed 100 tool (0,0,10) frame (1000,0,0)
           lin (200,0,300) speed 100 tool (0,0,10) frame (2000,0,0)
           lin (400,0,300) speed 100 tool (0,0,10) frame (2000,0,0))"},
       {"another frame is active: the controller stops",
        tp_with("UFRAME_NUM=2 ;\nL P[1] 100mm/sec FINE ;\nL P[2] 100mm/sec FINE ;\n"),
        R"(error 4: this position was taught in UFRAME 1, and UFRAME 2 is active; the controller stops here (INTP-252)
           lin (200,0,300) speed 100 tool (0,0,10) frame (2000,0,0))"},
       {"another tool is active, behind a first motion that shows which one was before",
        tp_with("L P[1] 100mm/sec FINE ;\nUTOOL_NUM=2 ;\nL P[1] 100mm/sec FINE ;\n"),
        R"(error 5: this position was taught with UTOOL 1, and UTOOL 2 is active; the controller stops here (INTP-253)
           lin (100,0,300) speed 100 tool (0,0,10) frame (1000,0,0))"},
       {"a frame chosen in an IF, taken",
        tp_with("UFRAME_NUM=1 ;\nUTOOL_NUM=1 ;\nIF (DI[1]=ON) THEN ;\nUFRAME_NUM=2 ;\nENDIF ;\n"
                "L P[4] 50mm/sec FINE ;\nL P[2] 100mm/sec FINE ;\nDO[1]=ON ;\n"),
        R"(lin (400,0,300) speed 50 tool (0,0,10) frame (2000,0,0)
           lin (200,0,300) speed 100 tool (0,0,10) frame (2000,0,0)
           out_1 = 1)",
        {{"in_1", 1}}},
       {"a frame chosen in an IF, not taken: the controller stops at the place of the other frame",
        tp_with("UFRAME_NUM=1 ;\nUTOOL_NUM=1 ;\nIF (DI[1]=ON) THEN ;\nUFRAME_NUM=2 ;\nENDIF ;\n"
                "L P[4] 50mm/sec FINE ;\nL P[2] 100mm/sec FINE ;\nDO[1]=ON ;\n"),
        R"(lin (400,0,300) speed 50 tool (0,0,10) frame (1000,0,0)
           halt)",
        {{"in_1", 0}}},
       {"a frame chosen in a program that is called",
        tp_with("UTOOL_NUM=1 ;\nCALL TWO ;\nL P[2] 100mm/sec FINE ;\nL P[4] 100mm/sec FINE ;\n"
                "L P[1] 100mm/sec FINE ;\n",
                {{"two.ls", "/PROG TWO\n/MN\nUFRAME_NUM=2 ;\n/POS\n/END\n"}}),
        R"(error 7: this position was taught in UFRAME 1, and UFRAME 2 is active; the controller stops here (INTP-252)
           lin (200,0,300) speed 100 tool (0,0,10) frame (2000,0,0)
           lin (400,0,300) speed 100 tool (0,0,10) frame (2000,0,0))"},
       {"a frame whose number is computed",
        tp_with("UTOOL_NUM=1 ;\nR[1]=2 ;\nUFRAME_NUM=R[1] ;\nL P[2] 100mm/sec FINE ;\n"
                "L P[4] 100mm/sec FINE ;\n"),
        R"(lin (200,0,300) speed 100 tool (0,0,10) frame (2000,0,0)
           lin (400,0,300) speed 100 tool (0,0,10) frame (2000,0,0))"},
       {"a frame that changes while it is active",
        tp_with("UTOOL_NUM=1 ;\nUFRAME_NUM=1 ;\nPR[1]=P[2] ;\nUFRAME[1]=PR[1] ;\n"
                "L P[1] 100mm/sec FINE ;\n"),
        "lin (100,0,300) speed 100 tool (0,0,10) frame (200,0,300)"},
       {"a register is in what is active, and where only the controller knows that, it is an error",
        tp_with("PR[1]=P[4] ;\nL PR[1] 100mm/sec FINE ;\nUFRAME_NUM=2 ;\nUTOOL_NUM=2 ;\n"
                "L PR[1] 100mm/sec FINE ;\n"),
        R"(error 4: which UFRAME is active here is set on the controller; none is taken
           lin (400,0,300) speed 100
           lin (400,0,300) speed 100 tool (0,0,20) frame (2000,0,0))"},
       {"arguments that a program does not read",
        tp_with("CALL TWO(3,4,5) ;\n", {{"two.ls", "/PROG TWO\n/MN\nWAIT AR[2] ;\n/POS\n/END\n"}}),
        "wait 4"},
       {"frames without a value are an error where they are used",
        {{"main.ls", listing("L P[1] 100mm/sec FINE ;\n")}},
        R"(error 3: UFRAME[1] is set on the controller; it is zero here
           error 3: UTOOL[1] is set on the controller; it is zero here
           lin (100,0,300) speed 100 tool (0,0,0) frame (0,0,0))"}});
}

// Position registers are read as poses. Where the positions of the program have additional axes,
// those of a register would be lost.
TEST(ReaderRule, TpRegistersOfARobotWithAdditionalAxes) {
  const auto on_rail = [](const std::string& statements) {
    return std::vector<RuleFile>{
        {"main.ls",
         "/PROG MAIN\n/MN\n" + statements +
             "/POS\nP[1]{\n   GP1:\n\tUF : 0, UT : 1,\tCONFIG : 'N U T, 0, 0, 0',\n\tX = 100.000 "
             "mm,\tY = 0.000 mm,\tZ = 300.000 mm,\n\tW = 0.000 deg,\tP = 0.000 deg,\tR = 0.000 "
             "deg,\n\tE1= 250.000 mm\n};\n/END\n"},
        {"sysframe.va", kFrames}};
  };
  const std::string set = "   1:  UFRAME_NUM=0 ;\n   2:  UTOOL_NUM=1 ;\n";
  expect_rule(
      read_tp,
      {{"a motion to a register",
        on_rail(set + "   3:  PR[1]=P[1] ;\n   4:L P[1] 100mm/sec FINE ;\n   5:L PR[1] 100mm/sec "
                      "FINE ;\n   6:L PR[1] 50mm/sec FINE ;\n"),
        R"(error 7: the additional axes E1 to E3 of position registers are not read; in motions to them these axes keep their positions
           lin (100,0,300) speed 100 tool (0,0,10)
           lin (100,0,300) speed 100 tool (0,0,10)
           lin (100,0,300) speed 50 tool (0,0,10))"},
       {"a component of it", on_rail(set + "   3:  PR[1]=P[1] ;\n   4:  PR[1,7]=(-100) ;\n"),
        "error 6: the additional axes E1 to E3 of position registers are not read"},
       {"no register", on_rail(set + "   3:L P[1] 100mm/sec FINE ;\n"),
        "lin (100,0,300) speed 100 tool (0,0,10)"}});
}

TEST(ReaderRule, TpSpeedsAndConditions) {
  const std::string begin = "UFRAME_NUM=1 ;\nUTOOL_NUM=1 ;\n";
  const std::string tool = " tool (0,0,10) frame (1000,0,0)\n";
  const std::string to = "lin (100,0,300)";
  expect_rule(
      read_tp,
      {{"each unit of a speed",
        tp_with(begin +
                "L P[1] 1200cm/min FINE ;\nL P[1] 100inch/min FINE ;\nL P[1] 45deg/sec FINE ;\n"
                "L P[1] 2.5sec FINE ;\nL P[1] 250msec FINE ;\nJ P[3] 50% FINE ;\n"
                "J P[1] 500mm/sec FINE ;\n"),
        to + " speed 200" + tool + to + " speed 42.333" + tool + to + " turns 45" + tool + to +
            " time 2.5" + tool + to + " time 0.25" + tool +
            "ptp (joints 0,10,-20,0,-70,0) percent 50 tool (0,0,10)\n" +
            "ptp (100,0,300) percent 50" + tool},
       {"max_speed", tp_with(begin + "L P[1] max_speed FINE ;\nJ P[3] max_speed FINE ;\n"),
        "warning 5: max_speed is a limit of the controller; 2000.0 mm/s is assumed\n" + to +
            " speed 2000" + tool + "ptp (joints 0,10,-20,0,-70,0) percent 100 tool (0,0,10)\n"},
       {"no unit, and units of the other kind of motion",
        tp_with(begin + "L P[1] 100 FINE ;\nL P[1] 50% FINE ;\nJ P[3] 45deg/sec FINE ;\n"),
        R"(error 5: the unit of a speed is expected here: %, sec, msec, mm/sec, cm/min, inch/min, deg/sec
           error 6: a path needs a speed in mm/sec
           error 7: a joint motion has no speed in deg/sec)"},
       {"OVERRIDE holds from where it is set",
        tp_with(begin + "L P[1] 200mm/sec FINE ;\nOVERRIDE=50% ;\nL P[1] 200mm/sec FINE ;\n"
                        "L P[1] 2sec FINE ;\n"),
        to + " speed 200" + tool + to + " speed 100" + tool + to + " time 4" + tool},
       {"the condition of SKIP that counts depends on the path",
        tp_with(begin +
                "SKIP CONDITION DI[1]=ON ;\nIF (DI[2]=ON) THEN ;\nSKIP CONDITION DI[3]=ON ;\n"
                "ENDIF ;\nL P[1] 100mm/sec FINE Skip,LBL[1] ;\nLBL[1] ;\nDO[1]=ON ;\n"),
        "error 9: which SKIP CONDITION applies here depends on the path to this point\nout_1 = "
        "1\n",
        {{"in_2", 0}}},
       {"an offset of a condition, seen from another frame",
        tp_with(begin + "PR[1]=P[4] ;\nOFFSET CONDITION PR[1],UFRAME[2] ;\nL P[1] 100mm/sec FINE "
                        "Offset ;\nL P[1] 100mm/sec FINE Offset,PR[1] ;\n"),
        R"(error 6: an offset in another user frame is not read
           error 7: the condition that applies here was not read
           lin (500,0,600) speed 100 tool (0,0,10) frame (1000,0,0))"},
       {"what turns or couples a motion in another manner",
        tp_with(begin + "L P[1] 100mm/sec FINE Wjnt ;\nL P[1] 100mm/sec FINE RTCP ;\n"
                        "L P[1] 100mm/sec FINE COORD ;\nLINEAR_MAX_SPEED=100 ;\n"),
        R"(error 5: "Wjnt" of a motion has no counterpart in IRL
           error 6: "RTCP" of a motion has no counterpart in IRL
           error 7: "COORD" of a motion has no counterpart in IRL
           error 8: IRL has no counterpart of LINEAR_MAX_SPEED)"}});
}

TEST(ReaderRule, TpConditionsThatAreNotReadKeepWhatDependsOnThem) {
  expect_rule(
      read_tp,
      {{"IF THEN",
        tp_with("IF (DI[R[1]]=ON AND JPOS) THEN ;\nDO[1]=ON ;\nELSE ;\nDO[2]=ON ;\nENDIF ;\n"
                "DO[3]=ON ;\n"),
        R"(error 3: IRL has no signals with computed numbers
           warning 3: R[1] is not set by any program here; it is zero
           out_2 = 1
           out_3 = 1)"},
       {"IF with its action",
        tp_with("IF DI[R[1]]=ON,JMP LBL[1] ;\nDO[1]=ON ;\nLBL[1] ;\nDO[2]=ON ;\n"),
        R"(error 3: IRL has no signals with computed numbers
           warning 3: R[1] is not set by any program here; it is zero
           out_1 = 1
           out_2 = 1)"},
       {"SELECT",
        tp_with("SELECT TIMER[1]=1,JMP LBL[1] ;\n       ELSE,CALL SUB ;\nLBL[1] ;\nDO[2]=ON ;\n",
                {{"sub.ls", "/PROG SUB\n/MN\nDO[5]=ON ;\n/POS\n/END\n"}}),
        R"(error 3: IRL has no counterpart of TIMER
           out_5 = 1
           out_2 = 1)"},
       {"FOR", tp_with("FOR R[1]=1 TO JPOS ;\nDO[1]=ON ;\nENDFOR ;\nDO[2]=ON ;\n"),
        R"(error 3: position registers are Cartesian here, and JPOS is joints
           out_2 = 1)"},
       {"a label behind a line of nothing",
        {{"main.ls",
          "/PROG MAIN\n/MN\n:\n:LBL[1];\n:IF DI[1]=ON,JMP LBL[1] ;\n:DO[1]=ON ;\n/POS\n/END\n"}},
        "out_1 = 1",
        {{"in_1", 0}}}});
}

// ---- URScript ----

TEST(ReaderRule, UrscriptToolHoldsFromWhereItIsSet) {
  const std::string to = "p[0.5,0,0.3,0,0,0]";
  expect_rule(read_urscript,
              {{"in an IF",
                {{"p.script",
                  "def p():\n  set_tcp(p[0,0,0.1,0,0,0])\n  if get_digital_in(1):\n    "
                  "set_tcp(p[0,0,0.2,0,0,0])\n  end\n  movel(" +
                      to + ",v=0.1)\nend\n"}},
                "lin (500,0,300) speed 100 tool (0,0,100)",
                {{"in_1", 0}}},
               {"in an IF that is taken",
                {{"p.script",
                  "def p():\n  set_tcp(p[0,0,0.1,0,0,0])\n  if get_digital_in(1):\n    "
                  "set_tcp(p[0,0,0.2,0,0,0])\n  end\n  movel(" +
                      to + ",v=0.1)\nend\n"}},
                "lin (500,0,300) speed 100 tool (0,0,200)",
                {{"in_1", 1}}},
               {"between motions and in functions",
                {{"p.script",
                  "def p():\n  def other():\n    set_tcp(p[0,0,0.2,0,0,0])\n  end\n"
                  "  set_tcp(p[0,0,0.1,0,0,0])\n  movel(" +
                      to + ",v=0.1)\n  other()\n  movel(" + to + ",v=0.1)\nend\n"}},
                R"(lin (500,0,300) speed 100 tool (0,0,100)
           lin (500,0,300) speed 100 tool (0,0,200))"},
               {"never set: the robot's own",
                {{"p.script", "def p():\n  movel(" + to + ",v=0.1)\nend\n"}},
                "lin (500,0,300) speed 100"}});
}

TEST(ReaderRule, UrscriptFunctionsListsAndArguments) {
  expect_rule(
      read_urscript,
      // Positions are added, orientations multiplied in this order (URScript manual, pose_add).
      {{"a sum of poses",
        {{"p.script", R"(def p():
  set_tcp(p[0,0,0.1,0,0,0])
  a=p[0.1,0,0,0,0,1.570796326794897]
  movel(pose_add(a,p[0,0.2,0,1.570796326794897,0,0]))
  movel(pose_add(pose_trans(a,p[0.1,0,0,0,0,0]),p[0,0,0.3,0,0,0]))
end
)"}},
        R"(lin (100,200,0 turned 0.5 0.5 0.5 0.5) tool (0,0,100)
           lin (100,100,300 turned 0.707 0 0 0.707) tool (0,0,100))"},
       {"functions of one name, each within another",
        {{"p.script", R"(def p():
  def f(a):
    return a+1
  end
  def g():
    def f(a):
      return a+20
    end
    return f(1)
  end
  def h():
    def f(a):
      return a+300
    end
    return f(1)
  end
  sleep(f(1)+g()+h())
end
)"}},
        "wait 324"},
       {"a list that grows",
        {{"p.script", R"(def p():
  l=[p[0.1,0,0,0,0,0]]
  sleep(length(l))
  l=[p[0.2,0,0,0,0,0],p[0.3,0,0,0,0,0]]
  i=0
  while i<length(l):
    movel(l[i],v=0.1)
    i=i+1
  end
  l=[]
  sleep(length(l))
end
)"}},
        R"(wait 1
           lin (200,0,0) speed 100
           lin (300,0,0) speed 100
           wait 0)"},
       {"numbers of a list are any",
        {{"p.script", "def p():\n  l=[1,2]\n  l[0]=1.5\n  sleep(l[0])\nend\n"}},
        "wait 1.5"},
       {"a value of a different kind",
        {{"p.script", "def p():\n  x=1\n  x=\"a\"\n  sleep(x)\nend\n"}},
        R"(error 3: a whole number is expected here, but this is a text
           wait 1)"},
       {"arguments that are not carried out",
        {{"p.script",
          "def p():\n  movec(p[0,0,0,0,0,0],p[0.1,0,0,0,0,0],1,0.1,0,1)\n"
          "  movej([0,0,0,0,0,0],speed=1)\n  movel(p[0,0,0,0,0,0],1,0.1,0,0,3)\n"
          "  set_digital_out(1)\n  set_flag(1,True)\n  mine(3)\nend\n"}},
        R"(error 2: an arc that keeps its orientation to the path (mode = 1) is not read
           error 3: movej has no argument speed that is read
           error 4: movel has more arguments than are supported
           error 5: set_digital_out is not read with these arguments
           error 6: IRL has no counterpart of set_flag
           error 7: mine is not among the files; an empty routine replaces it
           text mine is not among the files
        )"},
       {"a condition that is not read keeps its body",
        {{"p.script",
          "def p():\n  if force() > 3 and socket_open(\"a\",1):\n    set_digital_out(1,True)\n"
          "  else:\n    set_digital_out(2,True)\n  end\n  while 3 x:\n"
          "    set_digital_out(3,True)\n  end\n  sleep(1)\nend\n"}},
        R"(error 2: IRL has no counterpart of force
           error 7: ":" is expected here
           out_2 = 1
           wait 1)"}});
}

// ---- MELFA-BASIC ----

const std::string kPlaces =
    "P1=(500.00,0.00,300.00,0.00,0.00,0.00)(7,0)\nP2=(500.00,100.00,300.00,0.00,0.00,0.00)(7,0)\n";

TEST(ReaderRule, MelfaSettingsHoldFromWhereTheyAreMade) {
  const auto program = [](const std::string& lines) {
    return std::vector<RuleFile>{{"m.prg", lines + "99 End\n" + kPlaces}};
  };
  expect_rule(
      read_melfa,
      {{"Spd, Ovrd and JOvrd between motions",
        program("1 Spd 200\n2 Mvs P1\n3 Ovrd 50\n4 Mvs P2\n5 JOvrd 40\n6 Mov P1\n7 Ovrd M_NOvrd\n"
                "8 Mov P1\n"),
        R"(lin (500,0,300) speed 200
           lin (500,100,300) speed 100
           ptp (500,0,300) percent 20
           ptp (500,0,300) percent 40)"},
       {"Tool in an If, taken",
        program("1 Tool (0,0,10,0,0,0)\n2 If M_In(1)=1 Then Tool (0,0,20,0,0,0)\n3 Mvs P1\n"),
        "lin (500,0,300) tool (0,0,20)",
        {{"in_1", 1}}},
       {"Tool in an If, not taken",
        program("1 Tool (0,0,10,0,0,0)\n2 If M_In(1)=1 Then Tool (0,0,20,0,0,0)\n3 Mvs P1\n"),
        "lin (500,0,300) tool (0,0,10)",
        {{"in_1", 0}}},
       {"Base in a subroutine, and what each motion sees",
        program("1 Base (0,0,0,0,0,0)\n2 Mvs P1\n3 GoSub *S\n4 Mvs P1\n5 GoTo *E\n6 *S\n7 Base "
                "(100,0,0,0,0,0)\n8 Return\n9 *E\n"),
        R"(lin (500,0,300) frame (0,0,0)
           lin (500,0,300) frame (-100,0,0))"},
       {"what is not carried out",
        program(
            "1 Spd M_NSpd\n2 Cnt 1,10,20\n3 Mvs P1 Type 1,0\n4 Ovrd 50,20\n5 Accel 50,80\n6 Mvs "
            "P1\n"),
        R"(error 1: the controller's maximum speed (M_NSpd) is unknown
           error 2: IRL has one distance for the end of a motion and the start of the next, but these differ
           error 3: IRL cannot choose how the tool rotates during a motion (Type)
           error 4: overrides of upward and downward motions are not read
           warning 5: IRL decelerates as it accelerates; the deceleration is left out; the path stays the same, and times differ
           lin (500,0,300))"},
       {"a pulse, and arms of Select that are not read",
        program(
            "1 M_Out(3)=1 Dly 0.5\n2 M1=7\n3 Select M1\n4 Case Is > 3\n5 M_Out(1)=1\n6 Break\n7 "
            "Default\n8 M_Out(2)=1\n9 End Select\n"),
        R"(warning 1: the IRL program waits for the end of this pulse; the controller does not
           error 4: Case Is is not read
           out_3 = 1
           wait 0.5
           out_3 = 0
           out_2 = 1)"},
       {"a condition that is not read keeps what depends on it",
        program("1 If P_Fbc.X>3 Then M_Out(1)=1 Else M_Out(2)=1\n2 If J_Fbc.J1>3 Then\n3 "
                "M_Out(3)=1\n4 "
                "Else\n5 M_Out(4)=1\n6 EndIf\n"),
        R"(error 1: IRL has no counterpart of P_Fbc
           error 2: IRL has no counterpart of J_Fbc
           out_2 = 1
           out_4 = 1)"}});
}

TEST(ReaderRule, MelfaWholeNumbersAreRoundedWhereTheyAreAssigned) {
  // Work2 = 10.562 gives 11 (instruction manual, Def Inte).
  expect_rule(
      read_melfa,
      {{"Def Inte",
        {{"m.prg",
          "1 Def Inte Work2\n2 Work2=10.562\n3 Dly Work2\n4 Work2=10.12\n5 Dly Work2\n"
          "6 End\n"}},
        "wait 11\nwait 10"},
       {"the sign %",
        {{"m.prg",
          "1 M2%=7/2\n2 Dly M2%\n3 M2=9/4\n4 Dly M2\n5 M3=7/2\n6 Dly M3\n7 M4=7\\2\n8 Dly M4\n9 "
          "For M5%=1 To 2\n10 Dly M5%\n11 Next M5%\n12 End\n"}},
        "wait 4\nwait 2\nwait 3.5\nwait 3\nwait 1\nwait 2"},
       {"arrays", {{"m.prg", "1 Dim M1%(3)\n2 M1%(2)=2.6\n3 Dly M1%(2)\n4 End\n"}}, "wait 3"}});
}

// ---- VAL 3 ----

std::vector<RuleFile> val3_with(const std::string& code, const std::string& data,
                                const std::string& more = {}) {
  std::vector<RuleFile> out{
      {"a.pjx", "<Project><Programs><Program file=\"start.pgx\"/>" +
                    std::string(more.empty() ? "" : "<Program file=\"more.pgx\"/>") +
                    "</Programs><Database><Data file=\"a.dtx\"/></Database></Project>"},
      {"start.pgx", "<Programs><Program name=\"start\"><Code><![CDATA[begin\n" + code +
                        "end]]></Code></Program></Programs>"},
      {"a.dtx",
       "<Database><Datas>" + data +
           R"(<Data name="mS" type="mdesc" size="1"><Value key="0" accel="100" vel="40" tmax="250" blend="off"/></Data>
<Data name="tG" type="tool" size="1"><Value key="0" z="120" fatherId="flange[0]"/></Data>
<Data name="tIn" type="tool" size="1"><Value key="0" z="5" fatherId="tG[0]"/></Data>
<Data name="fA" type="frame" size="2"><Value key="0" x="100" fatherId="world[0]"/><Value key="1" x="200" fatherId="fA[0]"/></Data>
<Data name="pA" type="pointRx" size="2"><Value key="0" x="1" fatherId="fA[0]"/><Value key="1" x="2" fatherId="fA[1]"/></Data>
<Data name="pB" type="pointRx" size="1"><Value key="0" x="3" fatherId="fA[1]"/></Data>
<Data name="n" type="num" size="1"><Value key="0" value="1"/></Data>
<Data name="di" type="dio" size="1"/>
</Datas></Database>)"}};
  if (!more.empty()) out.push_back({"more.pgx", more});
  return out;
}

TEST(ReaderRule, Val3ToolsFramesAndDescriptorsAsTheyAreThen) {
  expect_rule(
      read_val3,
      {{"frames and tools are relative to others, each element to its own",
        val3_with("movel(pA[0],tG,mS)\nmovel(pA[1],tIn,mS)\n", ""),
        R"(lin (1,0,0) speed 250 tool (0,0,120) frame (100,0,0)
           lin (2,0,0) speed 250 tool (0,0,125) frame (300,0,0))"},
       {"a tool and a frame that are set while it runs",
        val3_with("movel(pB,tG,mS)\ntG.trsf.z=10\nfA[1].trsf.x=7\nmovel(pB,tG,mS)\n", ""),
        R"(lin (3,0,0) speed 250 tool (0,0,120) frame (300,0,0)
           lin (3,0,0) speed 250 tool (0,0,10) frame (107,0,0))"},
       {"a descriptor that changes in an if",
        val3_with("if di==true\n  mS.tvel=50\nendIf\nmovel(pB,tG,mS)\nmS.vel=20\nmovej(pB,tG,mS)\n",
                  ""),
        R"(lin (3,0,0) speed 50 tool (0,0,120) frame (300,0,0)
           ptp (3,0,0) percent 20 tool (0,0,120) frame (300,0,0))",
        {{"di", 1}}},
       {"a descriptor that changes in an if that is not taken",
        val3_with("if di==true\n  mS.tvel=50\nendIf\nmovel(pB,tG,mS)\n", ""),
        "lin (3,0,0) speed 250 tool (0,0,120) frame (300,0,0)",
        {{"di", 0}}},
       {"an element that is computed, of frames that differ",
        val3_with("movel(pA[n],tG,mS)\nsetMonitorSpeed(50)\n", ""),
        R"(error 2: the elements of pA are in different frames, and the index is computed
           error 3: IRL has no counterpart of setMonitorSpeed)"},
       {"a point that would lose its frame", val3_with("pB=pA[0]\n", ""),
        "error 2: assigning this point would change its frame, which is not read"},
       {"a condition that is not read keeps its body",
        val3_with(
            "if isPowered()\n  n=2\nelse\n  delay(1)\nendIf\nfor n=1 to getSpeed()\n  delay(2)\n"
            "endFor\nswitch clock()\n  case 1\n    delay(3)\n  break\n  default\n    delay(4)\n  "
            "break\nendSwitch\n",
            ""),
        R"(error 2: IRL has no counterpart of isPowered
           error 7: IRL has no counterpart of getSpeed
           error 10: IRL has no counterpart of clock
           wait 1
           wait 4)"}});
}

// Programs and data are named apart in VAL 3.
TEST(ReaderRule, Val3ProgramsMayHaveTheNameOfAVariable) {
  const std::string more =
      "<Programs><Program name=\"n\"><Parameters><Parameter name=\"x_by\" type=\"num\" "
      "xsi:type=\"element\" use=\"value\" dimension=\"1\"/></Parameters><Code><![CDATA[begin\n"
      "n=n+x_by\ndelay(n)\nend]]></Code></Program></Programs>";
  expect_rule(read_val3, {{"a program with the name of a number",
                           val3_with("n=2\ncall n(3)\ndelay(n)\n", "", more),
                           R"(wait 5
           wait 5)"},
                          {"too many values", val3_with("call n(3,4)\n", "", more),
                           "error 2: n takes 1 values, but here are 2"},
                          {"the program itself", val3_with("call start()\n", ""),
                           "error 2: the program calls itself"}});
}

// ---- G-code ----

TEST(ReaderRule, GcodeModesAndWords) {
  const auto program = [](const std::string& lines) {
    return std::vector<RuleFile>{{"g.ngc", lines + "M2\n"}};
  };
  expect_rule(read_gcode, {{"units, increments and feeds hold from where they are set",
                            program("G21 G90\nG1 X10 Y0 Z0 F600\nG91 X5\nG20 X1 F60\nG90 G21 X0\n"),
                            R"(lin (10,0,0) speed 10
           lin (15,0,0) speed 10
           lin (40.4,0,0) speed 25.4
           lin (0,0,0) speed 25.4)"},
                           {"offsets, lengths, cycles and coordinates are errors",
                            program("G0 X0 Y0 Z0\nG43 H1\nG92 X0\nG55\nG41 D1\nG10 L2 P1 X0\nG81 "
                                    "X1 Z-1 R2\nX5\nG80\nX6\nM6 "
                                    "T1\nO100 sub\nG1 X#1\n"),
                            R"(error 2: G43 is not read
           error 3: offsets and homes of the machine (G92) are not read
           error 4: the work coordinates G55 are set on the machine
           error 5: G41 is not read
           error 6: offsets and homes of the machine (G10) are not read
           error 7: G81 is not read
           error 8: no G0, G1, G2 or G3 sets the type of this motion
           error 10: no G0, G1, G2 or G3 sets the type of this motion
           error 11: M6 is not read
           error 12: parameters, expressions and subroutines of G-code are not read
           error 13: parameters, expressions and subroutines of G-code are not read
           ptp (0,0,0))"},
                           {"words that no code uses",
                            program("G0 X0 Y0 Z0\nG1 X1 R5 F60\nG1 X1 I2\nX3 P2\nH2\nG0 X4 E1\n"),
                            R"(error 2: R5 does not belong to any code of this line
           error 3: I2 does not belong to any code of this line
           error 4: P2 does not belong to any code of this line
           error 5: H2 does not belong to any code of this line
           error 6: IRL has no extruder (E); it is left out here and in all later lines
           ptp (0,0,0)
           ptp (4,0,0))"},
                           {"the spindle", program("M3 S1000\nS500\nM4\nM5\n"),
                            R"(spindle_speed = 1000
           spindle_back = 0
           spindle = 1
           spindle_speed = 500
           spindle_back = 1
           spindle = 1
           spindle_back = 0
           spindle = 0)"},
                           {"a line that was not read leaves the place where it ends",
                            program("G1 X0 Y0 Z0 F60\nG2 X10 Y0 Z5 I5 J0\nG1 X20\n"),
                            R"(error 2: a helix has no counterpart in IRL
           lin (0,0,0) speed 1
           lin (20,0,5) speed 1)"}});
}

}  // namespace
}  // namespace robomosp::readers
