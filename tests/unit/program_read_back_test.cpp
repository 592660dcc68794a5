// SPDX-License-Identifier: Apache-2.0
// What is posted is what was run: frame and tool of the world in every target, and the posted files
// read back and run beside the program.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/program.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

std::string read_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class ProgramReadBack : public test::CommandTest {
 protected:
  /// An arm with a cup of `tool` metres, mounted away from the world's origin and turned, and a
  /// frame that is turned on.
  void put_cell(const std::string& which, double tool, const List& frame, double turn,
                const std::string& name = "cell") {
    arm_ = call("robot.duplicate",
                {{"id", call("robot.get", {{"name", which}})}, {"name", "picker of " + name}});
    // What it touches is not looked at here.
    for (int link = 1; link <= 6; ++link)
      call(
          "record.set",
          {{"id", arm_}, {"path", "links[" + std::to_string(link) + "].parts"}, {"value", List{}}});
    call("record.set", {{"id", arm_}, {"path", std::string("base_parts")}, {"value", List{}}});
    if (tool > 0) {
      const Value cup = call("object.create", {{"name", std::string("cup")}});
      call("object.add_tcp",
           {{"id", cup}, {"name", std::string("lip")}, {"position", List{0.0, 0.0, tool}}});
      call("robot.attach", {{"id", arm_}, {"tool", cup}});
    }
    cell_ = call("world.create", {{"name", name}});
    call("world.add_robot", {{"id", cell_},
                             {"robot", arm_},
                             {"name", std::string("arm")},
                             {"position", List{0.3, -0.2, 0.1}},
                             {"rpy", List{0.0, 0.0, 1.5707963267948966}}});
    call("world.add_frame", {{"id", cell_},
                             {"name", std::string("table")},
                             {"position", frame},
                             {"rpy", List{0.0, 0.0, 1.5707963267948966 + turn}}});
  }
  Value put_program(const std::string& name, const std::string& source) {
    const Value p = call("program.create", {{"name", name}, {"source", source}});
    call("world.add_program", {{"id", cell_}, {"program", p}, {"robot", std::string("arm")}});
    call("program.bind", {{"id", p},
                          {"kind", std::string("robot")},
                          {"to", std::string("arm")},
                          {"frame", std::string("table")}});
    return p;
  }
  /// A shipped program in a cell with the signals that it knows.
  Value put_shipped(const std::string& robot, double tool, const std::string& cell,
                    const std::string& name, const std::string& source) {
    put_cell(robot, tool, List{0.3, -0.2, 0.1 - tool}, 0.3490658503988659, cell);
    for (const char* signal : {"gripper", "arc"})
      call("world.add_signal", {{"id", cell_}, {"name", std::string(signal)}});
    for (const char* signal : {"part_here", "tray_ok", "arc_stable"})
      call("world.add_signal", {{"id", cell_}, {"name", std::string(signal)}, {"initial", 1.0}});
    call("world.add_signal",
         {{"id", cell_}, {"name", std::string("lamp")}, {"kind", std::string("analogue")}});
    return put_program(name, source);
  }
  Value post(const Value& p, const std::string& target, Map more = {}) {
    more.set("id", p);
    if (!more.find("profile")) more.set("target", Value(target));
    more.set("world", cell_);
    more.set("check", true);
    return call("program.post", more);
  }
  static std::string text(const Value& posted) {
    std::string all;
    for (const Value& f : *at(posted, "files").as_list()) all += *at(f, "text").as_string();
    return all;
  }
  static std::string first_error(const Value& posted) {
    for (const Value& f : *at(posted, "faults").as_list())
      if (*at(f, "severity").as_string() == "error") return *at(f, "message").as_string();
    return {};
  }
  static std::string all_faults(const Value& posted) {
    std::string out;
    for (const Value& f : *at(posted, "faults").as_list())
      out += *at(f, "severity").as_string() + ": " + *at(f, "message").as_string() + "\n";
    return out;
  }
  Value arm_, cell_;
};

constexpr const char* kPick = R"(PROGRAM pick;
SIGNAL
  OUTPUT BOOL: vac AT 3;
VAR
  POSE: place := POSE(POSITION(0.0, 100.0, 50.0), ORIZYX(0.0, 180.0, 0.0));
  POSE: above := POSE(POSITION(0.0, 0.0, -80.0), ORIZYX(0.0, 0.0, 0.0));
BEGIN
  MOVE PTP place @ above;
  MOVE LIN place SPEED := 123.4;
  vac := TRUE;
  MOVE LIN place @ above;
ENDPROGRAM;
)";

TEST_F(ProgramReadBack, FrameAndToolOfTheWorldAreWrittenOrRefused) {
  // The table 0.45 m in front of the mounting and 0.12 m above: turned by 90 degrees as it is.
  put_cell("ur5", 0.06, List{0.3, 0.25, 0.22}, 0);
  call("world.add_signal", {{"id", cell_}, {"name", std::string("vac")}});
  const Value p = put_program("pick", kPick);
  const std::map<std::string, std::vector<std::string>> words{
      {"krl", {"$TOOL={X 0.000,Y 0.000,Z 60.000,", "$BASE={X 450.000,Y 0.000,Z 120.000,"}},
      {"rapid", {"RmpTool:=[TRUE,[[0,0,60],", "\"\",[[450,0,120],[1,0,0,0]]"}},
      {"urscript", {"set_tcp(p[0.0, 0.0, 0.06, ", "p[0.45, 0.1, 0.17, "}},
      {"melfa5", {"Tool "}},
      {"as", {"TOOL "}},
      {"pdl2", {"$TOOL := POS(0.000, 0.000, 60.000", "$UFRAME := POS(450.000, 0.000, 120.000"}},
      {"movemaster", {"TL 60"}}};
  const Value all = call("program.targets");
  for (const Value& t : *all.as_list()) {
    const std::string target = *at(t, "name").as_string();
    SCOPED_TRACE(target);
    const Value posted = post(p, target);
    const std::string refusal = first_error(posted);
    if (const auto it = words.find(target); it != words.end()) {
      EXPECT_EQ(refusal, "");
      for (const std::string& w : it->second)
        EXPECT_NE(text(posted).find(w), std::string::npos) << text(posted);
    } else if (!refusal.empty() && target != "pacscript") {
      EXPECT_NE(refusal.find("tool"), std::string::npos) << refusal;
    }
    EXPECT_NE(all_faults(posted).find("frame \"table\" at (450, 0, 120) mm"), std::string::npos)
        << all_faults(posted);
  }
}

TEST_F(ProgramReadBack, AToolThatIsLostOnTheWayIsFoundInTheWorld) {
  put_cell("ur5", 0.06, List{0.3, 0.25, 0.22}, 0);
  call("world.add_signal", {{"id", cell_}, {"name", std::string("vac")}});
  const Value p = put_program("pick", kPick);
  const Value right = post(p, "krl", {{"run_check", true}});
  EXPECT_TRUE(*at(right, "correct").as_bool()) << all_faults(right);
  EXPECT_LT(*at(at(right, "read_back"), "most_distance").as_real(), 1e-6);
  EXPECT_EQ(*at(at(right, "read_back"), "ends").as_int(), 3);
  EXPECT_EQ(*at(at(right, "read_back"), "read_changes").as_int(), 1);
  // A line of the profile takes the tool away again: every place is 60 mm off, as long as it is.
  const auto with_line = [&](const char* name, const char* line) {
    return call("record.create", {{"kind", std::string("controller")},
                                  {"name", std::string(name)},
                                  {"fields", Map{{"target", std::string("krl")},
                                                 {"prologue", List{Value(std::string(line))}}}}});
  };
  const Value no_tool =
      post(p, "krl", {{"run_check", true}, {"profile", with_line("cut", "$TOOL=$NULLFRAME")}});
  EXPECT_FALSE(*at(no_tool, "correct").as_bool());
  EXPECT_NEAR(*at(at(no_tool, "read_back"), "most_distance").as_real(), 0.06, 1e-6);
  EXPECT_NE(all_faults(no_tool).find("60 mm"), std::string::npos) << all_faults(no_tool);
  // Another base is one, too.
  const Value other_base =
      post(p, "krl",
           {{"run_check", true},
            {"profile", with_line("moved", "$BASE={X 450,Y 0,Z 130,A 0,B 0,C 0}")}});
  EXPECT_NEAR(*at(at(other_base, "read_back"), "most_distance").as_real(), 0.01, 1e-6);
  EXPECT_FALSE(*at(other_base, "correct").as_bool());
}

// A tool that the binding names: an object that the robot holds at the start.
TEST_F(ProgramReadBack, AToolOfTheBindingAndAToolOfTheProgramAreOnTheFlange) {
  put_cell("ur5", 0, List{0.3, 0.25, 0.22}, 0);
  const Value pen = call("object.create", {{"name", std::string("pen")}});
  call("object.add_tcp",
       {{"id", pen}, {"name", std::string("point")}, {"position", List{0.01, 0.0, 0.08}}});
  call("world.add_object", {{"id", cell_}, {"what", pen}, {"name", std::string("pen")}});
  call("world.attach",
       {{"id", cell_}, {"object", std::string("pen")}, {"robot", std::string("arm")}});
  call("world.add_signal", {{"id", cell_}, {"name", std::string("vac")}});
  const Value p = put_program("pick", kPick);
  call("program.bind", {{"id", p},
                        {"kind", std::string("robot")},
                        {"to", std::string("arm")},
                        {"frame", std::string("table")},
                        {"tool", std::string("pen.point")}});
  const Value posted = post(p, "krl", {{"run_check", true}});
  EXPECT_NE(text(posted).find("$TOOL={X 10.000,Y 0.000,Z 80.000,"), std::string::npos)
      << text(posted);
  EXPECT_TRUE(*at(posted, "correct").as_bool()) << all_faults(posted);
  EXPECT_LT(*at(at(posted, "read_back"), "most_distance").as_real(), 1e-6);
  // A TOOL and a FRAME of the program's own: within the frame of the world, on the same flange.
  // kr5's flange is 115 mm in front of its last axes.
  app().document.clear();
  put_cell("kr5", 0.06, List{0.3, -0.2, 0.2}, 0);
  const Value q = put_program("own", R"(PROGRAM own;
VAR
  POSE: place := POSE(POSITION(500.0, 100.0, 150.0), ORIZYX(0.0, 180.0, 0.0));
BEGIN
  MOVE PTP place;
  MOVE LIN place TOOL := POSE(POSITION(0.0, 0.0, 90.0), ORIZYX(0.0, 0.0, 0.0)),
    FRAME := POSE(POSITION(0.0, 20.0, 0.0), ORIZYX(10.0, 0.0, 0.0)) SPEED := 100.0;
ENDPROGRAM;
)");
  const Value own = post(q, "krl");
  for (const char* each :
       {"$TOOL={X 0.000,Y 0.000,Z 60.000,A 0.0000", "$BASE={X 0.000,Y 0.000,Z 100.000,A 0.0000",
        "$TOOL={X 0.000,Y 0.000,Z 90.000,A 0.0000", "$BASE={X 0.000,Y 20.000,Z 100.000,A 10.0000"})
    EXPECT_NE(text(own).find(each), std::string::npos) << each << "\n" << text(own);
}

// A program that a trajectory makes says itself which tool it moves, in the world and without.
TEST_F(ProgramReadBack, AProgramOfATrajectoryMovesTheSameTool) {
  put_cell("ur5", 0.06, List{0.3, 0.25, 0.22}, 0);
  const double down = 3.141592653589793;
  call("trajectory.create",
       {{"name", std::string("seam")},
        {"sample_time", 0.05},
        {"segments", List{Map{{"shape", std::string("line")},
                              {"points", List{List{0.3, 0.25, 0.3, 0.0, down, 0.0},
                                              List{0.4, 0.25, 0.3, 0.0, down, 0.0}}}}}}});
  call("world.add_trajectory", {{"id", cell_}, {"trajectory", std::string("seam")}});
  const Value p =
      call("program.from_trajectory",
           {{"world", cell_}, {"robot", std::string("arm")}, {"trajectory", std::string("seam")}});
  const Value alone =
      call("program.post",
           {{"id", p}, {"target", std::string("rapid")}, {"robot", arm_}, {"check", true}});
  EXPECT_NE(text(alone).find("RmpTool:=[TRUE,[[0,0,60],"), std::string::npos) << text(alone);
  call("world.add_program", {{"id", cell_}, {"program", p}, {"robot", std::string("arm")}});
  const Value placed = post(p, "rapid", {{"run_check", true}});
  EXPECT_TRUE(*at(placed, "correct").as_bool()) << all_faults(placed);
  const Value& beside = at(placed, "read_back");
  EXPECT_EQ(*at(beside, "ends").as_int(), *at(beside, "motions").as_int());
  EXPECT_LT(*at(beside, "most_distance").as_real(), 1e-6);
}

TEST_F(ProgramReadBack, TargetsAreComparedInTheWorld) {
  put_cell("ur5", 0.06, List{0.3, 0.25, 0.22}, 0);
  call("world.add_signal", {{"id", cell_}, {"name", std::string("vac")}});
  const Value p = put_program("pick", kPick);
  const Value c =
      call("program.compare_targets",
           {{"id", p},
            {"world", cell_},
            {"targets", List{Value(std::string("krl")), Value(std::string("urscript"))}}});
  for (const Value& t : *at(c, "targets").as_list()) {
    EXPECT_EQ(*at(t, "compared").as_int(), 3) << t.text();
    EXPECT_LT(*at(t, "most_distance").as_real(), 1e-5) << t.text();
  }
  EXPECT_LT(*at(c, "most_distance").as_real(), 1e-5);
}

// ---- C, compiled and run ----

/// A value of the environment as long as it lives.
class Environment {
 public:
  Environment(const char* name, const std::string& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    ::setenv(name, value.c_str(), 1);
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;
  ~Environment() {
    if (before_) ::setenv(name_, before_->c_str(), 1);
    else ::unsetenv(name_);
  }

 private:
  const char* name_;
  std::optional<std::string> before_;
};
/// An executable script in a folder of its own, and a file that it may make beside it.
class Script {
 public:
  explicit Script(const std::string& lines) {
    fs::create_directories(folder_);
    std::ofstream(path()) << "#!/bin/sh\n" << lines;
    fs::permissions(path(), fs::perms::owner_all);
  }
  Script(const Script&) = delete;
  Script& operator=(const Script&) = delete;
  ~Script() { fs::remove_all(folder_); }
  [[nodiscard]] std::string path() const { return (folder_ / "compiler").string(); }
  [[nodiscard]] std::string mark() const { return (folder_ / "mark").string(); }

 private:
  fs::path folder_ = fs::temp_directory_path() / ("read-back-" + std::to_string(::getpid()));
};

class ProgramReadBackC : public ProgramReadBack {
 protected:
  void SetUp() override {
    ProgramReadBack::SetUp();
    put_cell("ur5", 0, List{0.3, 0.25, 0.22}, 0);
    call("world.add_signal", {{"id", cell_}, {"name", std::string("vac")}});
    program_ = put_program("pick", kPick);
  }
  Value posted(const char* target, Map more = {}) {
    more.set("run_check", true);
    return post(program_, target, more);
  }
  Value program_;
};

TEST_F(ProgramReadBackC, CommandsOfTheCompiledProgramAreThoseOfTheRun) {
  for (const char* target : {"c", "pa10"}) {
    SCOPED_TRACE(target);
    const Value done = posted(target);
    const Value& beside = at(done, "read_back");
    ASSERT_TRUE(*at(beside, "compared").as_bool()) << *at(beside, "why_not").as_string();
    EXPECT_TRUE(*at(done, "correct").as_bool()) << all_faults(done);
    EXPECT_EQ(*at(beside, "ends").as_int(), 3);
    EXPECT_EQ(*at(beside, "motions").as_int(), 3);
    EXPECT_LT(*at(beside, "most_distance").as_real(), 1e-6);
    EXPECT_LT(*at(beside, "most_joint").as_real(), 0.01);
    EXPECT_EQ(*at(beside, "read_changes").as_int(), 1);
    if (target == std::string("c")) EXPECT_GT(*at(beside, "read_time").as_real(), 0.5);
    else EXPECT_NE(all_faults(done).find("no times"), std::string::npos) << all_faults(done);
  }
}

TEST_F(ProgramReadBackC, AnotherNumberAndAMissingOutputInTheCodeAreFound) {
  const auto with = [&](const std::string& edit) {
    // A compiler that changes what it is given.
    const Script script("for a; do case $a in *seen_program.c) sed -i '" + edit +
                        "' \"$(dirname \"$a\")/pick.c\";; esac; done\nexec cc \"$@\"\n");
    const Environment chosen("ROBOMOSP_CC", script.path());
    return posted("c");
  };
  const Value moved = with("s/rmp_lin(rmp_composed(rmp_placed(rmp_at(/&10 + /");
  EXPECT_FALSE(*at(moved, "correct").as_bool());
  EXPECT_NEAR(*at(at(moved, "read_back"), "most_distance").as_real(), 0.01, 1e-6);
  const Value silent = with("s/^ *rmp_output.*//");
  EXPECT_FALSE(*at(silent, "correct").as_bool());
  EXPECT_NE(all_faults(silent).find("signals of the world change 1 times in the run, and as it was "
                                    "read back 0"),
            std::string::npos)
      << all_faults(silent);
  const Value slow = with("s/123.4/12.34/");
  EXPECT_NE(all_faults(slow).find("the run takes"), std::string::npos) << all_faults(slow);
}

TEST_F(ProgramReadBackC, WithoutACompilerASentenceSaysSo) {
  const Environment chosen("ROBOMOSP_CC", "no-such-compiler");
  const Value done = posted("c");
  EXPECT_FALSE(*at(at(done, "read_back"), "compared").as_bool());
  EXPECT_EQ(*at(at(done, "read_back"), "why_not").as_string(),
            "the C compiler \"no-such-compiler\" of ROBOMOSP_CC is not on the search path");
  EXPECT_TRUE(*at(done, "correct").as_bool()) << all_faults(done);
}

TEST_F(ProgramReadBackC, SessionsThatStartNoProgramsCompileNothing) {
  const Script script("touch \"$(dirname \"$0\")/mark\"\nexec cc \"$@\"\n");
  const Environment chosen("ROBOMOSP_CC", script.path());
  session_.deny(Effect::processes);
  const Value done = posted("c");
  EXPECT_FALSE(fs::exists(script.mark()));
  EXPECT_FALSE(*at(at(done, "read_back"), "compared").as_bool());
  EXPECT_NE(at(at(done, "read_back"), "why_not")
                .as_string()
                ->find("only for sessions that may start programs"),
            std::string::npos)
      << at(done, "read_back").text();
}

// What a record says is neither the compiler nor code that runs.
TEST_F(ProgramReadBackC, LinesOfARecordAreNotRun) {
  const Script script("touch \"$(dirname \"$0\")/mark\"\nexec cc \"$@\"\n");
  const Environment chosen("ROBOMOSP_CC", script.path());
  const Value profile = call(
      "record.create",
      {{"kind", std::string("controller")},
       {"name", std::string("own")},
       {"fields", Map{{"target", std::string("c")},
                      {"prologue", List{Value("system(\"touch " + script.mark() + ".2\");")}}}}});
  const Value done = posted("c", {{"profile", profile}});
  EXPECT_FALSE(fs::exists(script.mark()));
  EXPECT_FALSE(fs::exists(script.mark() + ".2"));
  EXPECT_NE(at(at(done, "read_back"), "why_not").as_string()->find("prologue"), std::string::npos);
}

constexpr const char* kWaits = R"(PROGRAM waiting;
SIGNAL
  INPUT BOOL: ready AT 4;
  OUTPUT BOOL: vac AT 3;
BEGIN
  WAIT FOR ready TIMEOUT 5.0;
  MOVE PTP POSE(POSITION(0.0, 100.0, 50.0), ORIZYX(0.0, 180.0, 0.0));
  vac := TRUE;
ENDPROGRAM;
)";

TEST_F(ProgramReadBack, CProgramsHaveTheInputsOfTheRunAndThoseThatChangeAreSaid) {
  for (const bool changes : {false, true}) {
    app().document.clear();
    put_cell("ur5", 0, List{0.3, 0.25, 0.22}, 0);
    call("world.add_signal", {{"id", cell_}, {"name", std::string("vac")}});
    call("world.add_signal",
         {{"id", cell_}, {"name", std::string("ready")}, {"initial", changes ? 0.0 : 1.0}});
    const Value p = put_program("waiting", kWaits);
    if (changes) {
      const Value other =
          call("program.create",
               {{"name", std::string("other")},
                {"source", std::string("PROGRAM other;\nSIGNAL\n  OUTPUT BOOL: ready AT 1;\nBEGIN\n"
                                       "  WAIT 1.0 SEC;\n  ready := TRUE;\nENDPROGRAM;\n")}});
      call("world.add_program", {{"id", cell_}, {"program", other}, {"robot", std::string("arm")}});
    }
    const Value done = post(p, "c", {{"run_check", true}});
    ASSERT_TRUE(done.as_map()->find("read_back")) << all_faults(done);
    const Value& beside = at(done, "read_back");
    EXPECT_TRUE(*at(done, "correct").as_bool()) << all_faults(done);
    EXPECT_EQ(*at(beside, "compared").as_bool(), !changes) << beside.text();
    if (changes) {
      EXPECT_EQ(*at(beside, "why_not").as_string(),
                "input \"ready\" changes in the run, and a program in C is run with inputs that "
                "stay");
      continue;
    }
    EXPECT_EQ(*at(beside, "ends").as_int(), 1);
    EXPECT_LT(*at(beside, "read_time").as_real(), 4.0);
  }
}

// ---- additional joints ----

/// Opens and shuts its gripper by the first additional joint, as the Hanoi of 2006 does.
constexpr const char* kGrips = R"(PROGRAM grips;
SYSTEM_SPECIFICATION 'grips.ssi';
VAR
  ROBTARGET: dest;
BEGIN
  dest.PSE := POSE(POSITION(0.0, 100.0, 150.0), ORIZYX(0.0, 180.0, 0.0));
  dest.STATUS := -1;
  dest.A_JOINT.AA1 := 0;
  MOVE PTP dest;
  dest.PSE.POS := POSITION(0.0, 100.0, 50.0);
  MOVE LIN dest;
  dest.A_JOINT.AA1 := 1;
  WRITELN('shut ', dest.PSE.POS);
  dest.PSE.POS := POSITION(0.0, 100.0, 150.0);
  MOVE LIN dest;
  dest.A_JOINT.AA1 := 0;
  MOVE LIN dest;
ENDPROGRAM;
)";
/// A cell whose additional joint is an INT, as in the cells of 2006.
constexpr const char* kGripsCell = R"(PROGRAM cell;
CONST
  INT: R_NTURNS := 2, R_NADDJ := 1, R_NJ := 7, R_DEVICE_NUMBER := 1;
  STRING: RS := 'RS', XYZ := 'XYZ', YXZ := 'YXZ', ZYX := 'ZYX', ZYZ2 := 'ZYZ2';
  STRING: R_DEF_ORI := ZYX;
TYPE
  RECORD INT: A1, A2, A3, A4, A5, A6; ENDRECORD: MAIN_JOINT;
  RECORD INT: AA1; ENDRECORD: ADD_JOINT;
  RECORD MAIN_JOINT: M_JOINT; ADD_JOINT: A_JOINT; ENDRECORD: JOINT;
  RECORD POSE: PSE; INT: STATUS; ARRAY [1..R_NTURNS] OF INT: TURNS; ADD_JOINT: A_JOINT; ENDRECORD: ROBTARGET;
ENDPROGRAM;
)";

TEST_F(ProgramReadBack, AGripperOnAnAdditionalJointOpensAndShutsInThePostAsInTheRun) {
  put_cell("ur5", 0, List{0.3, 0.25, 0.22}, 0);
  const Value p =
      call("program.create", {{"name", std::string("grips")}, {"source", std::string(kGrips)}});
  call("program.set_file",
       {{"id", p}, {"name", std::string("grips.ssi")}, {"text", std::string(kGripsCell)}});
  const Value checked = call("program.check", {{"id", p}});
  EXPECT_TRUE(*at(checked, "correct").as_bool()) << checked.text();
  call("world.add_program", {{"id", cell_}, {"program", p}, {"robot", std::string("arm")}});
  call("program.bind", {{"id", p},
                        {"kind", std::string("robot")},
                        {"to", std::string("arm")},
                        {"frame", std::string("table")}});
  for (const char* target : {"pa10", "c", "krl", "rapid"}) {
    SCOPED_TRACE(target);
    const Value done = post(p, target, {{"run_check", true}});
    ASSERT_TRUE(done.as_map()->find("read_back")) << all_faults(done);
    const Value& beside = at(done, "read_back");
    ASSERT_TRUE(*at(beside, "compared").as_bool()) << beside.text();
    EXPECT_TRUE(*at(done, "correct").as_bool()) << all_faults(done);
    EXPECT_EQ(*at(beside, "ends").as_int(), 4);
  }
  // A gripper that never shuts is found.
  const Script script(
      "for a; do case $a in *seen_program.c) sed -i 's/rmp_additional(.*/;/' "
      "\"$(dirname \"$a\")/grips.c\";; esac; done\nexec cc \"$@\"\n");
  const Environment chosen("ROBOMOSP_CC", script.path());
  const Value open = post(p, "pa10", {{"run_check", true}});
  EXPECT_NE(all_faults(open).find("additional joint 1 ends at 0, and in the run at 1"),
            std::string::npos)
      << all_faults(open);
  EXPECT_FALSE(*at(open, "correct").as_bool());
}

// The Hanoi of the paper of 2006, from its own files, in its own cell.
TEST_F(ProgramReadBack, HanoiOf2006GripsInThePostOfThePa10) {
  const fs::path old = fs::path(ROBOMOSP_SOURCE_DIR) / "../shared/data/robomosp-1.4/Saves/IRL";
  if (!fs::exists(old / "HanoiPA10.irl")) GTEST_SKIP() << "the old files are not here";
  const Value p = call("program.import", {{"file", (old / "HanoiPA10.irl").string()}});
  const Value robot = call("robot.get", {{"name", std::string("pa10")}});
  for (const char* form : {"structured", "automatic", "flat"}) {
    SCOPED_TRACE(form);
    const Value posted = call("program.post", {{"id", p},
                                               {"target", std::string("pa10")},
                                               {"form", std::string(form)},
                                               {"robot", robot},
                                               {"check", true}});
    EXPECT_TRUE(*at(posted, "correct").as_bool()) << all_faults(posted);
    EXPECT_EQ(*at(posted, "form").as_string(), form == std::string("flat") ? "flat" : "structured");
  }
}

// ---- tasks, trajectories, rails ----

TEST_F(ProgramReadBack, AProgramOfATaskMovesTheToolThatTheTaskMoves) {
  put_cell("ur5", 0.06, List{0.3, 0.25, 0.22}, 0);
  call("world.add_signal", {{"id", cell_}, {"name", std::string("vac")}});
  const double down = 3.141592653589793;
  const auto move = [&](double z, const char* path) {
    return Map{{"step", std::string("move")},
               {"target", List{0.3, 0.25, z, 0.0, down, 0.0}},
               {"path", std::string(path)}};
  };
  call("task.create",
       {{"name", std::string("fetch")},
        {"steps",
         List{move(0.35, "joint"), move(0.25, "straight"),
              Map{{"step", std::string("set")}, {"signal", std::string("vac")}, {"value", 1.0}},
              move(0.35, "straight")}}});
  call("world.add_task",
       {{"id", cell_}, {"task", std::string("fetch")}, {"robot", std::string("arm")}});
  const Value p = call("program.from_task", {{"world", cell_}, {"task", std::string("fetch")}});
  call("world.remove_member", {{"id", cell_}, {"member", std::string("fetch")}});
  call("world.add_program", {{"id", cell_}, {"program", p}, {"robot", std::string("arm")}});
  for (const char* target : {"rapid", "urscript", "joint_trajectory"}) {
    SCOPED_TRACE(target);
    const Value done = post(p, target, {{"run_check", true}});
    ASSERT_TRUE(done.as_map()->find("read_back")) << all_faults(done);
    const Value& beside = at(done, "read_back");
    EXPECT_TRUE(*at(done, "correct").as_bool()) << all_faults(done);
    EXPECT_EQ(*at(beside, "ends").as_int(), 3) << beside.text();
    EXPECT_LT(*at(beside, "most_distance").as_real(), 1e-5);
  }
  // Its cup is 60 mm long, and where the task goes the tip is.
  const Value written = post(p, "rapid");
  EXPECT_NE(text(written).find("RmpTool:=[TRUE,[[0,0,60],"), std::string::npos) << text(written);
}

/// Rounded up to a power of ten, from 0.001 on.
std::string at_most(double v, const char* unit) {
  for (const char* each : {"0.001", "0.01", "0.1", "1", "10", "100"})
    if (v <= std::atof(each)) return std::string(each) + unit;
  return "1000" + std::string(unit);
}

class ReadBackTable : public ProgramReadBack {
 protected:
  /// A Yaskawa with pulses for each axis, and the tool of the cells in its list.
  Value pulses() {
    List axes;
    for (int i = 1; i <= 6; ++i)
      axes.emplace_back(Map{{"name", "A" + std::to_string(i)}, {"joint", i}, {"pulses", 1341.4}});
    return call("record.create",
                {{"kind", "controller"},
                 {"name", "pulses"},
                 {"fields", Map{{"target", "inform"}, {"axes", axes}, {"tools", tools()}}}});
  }
  /// A FANUC with the tool of the cells in its list.
  Value fanuc() {
    return call("record.create", {{"kind", "controller"},
                                  {"name", "fanuc"},
                                  {"fields", Map{{"target", "fanuc_tp"}, {"tools", tools()}}}});
  }
  static List tools() {
    return List{Map{
        {"name", "cup"}, {"number", 1}, {"placement", Map{{"position", List{0.0, 0.0, 0.05}}}}}};
  }
};

TEST_F(ReadBackTable, ThePagesTableIsWhatRunsGive) {
  const std::vector<std::string> shipped{"hanoi", "pick_and_place", "palletising", "arc_weld"};
  std::vector<std::string> targets;
  const Value all = call("program.targets");
  for (const Value& t : *all.as_list())
    if (*at(t, "by").as_string() == "plugin") targets.push_back(*at(t, "name").as_string());
  std::map<std::string, std::string> rows, unread;
  std::vector<std::string> reasons;
  for (const std::string& program : shipped) {
    app().document.clear();
    const std::string source =
        read_file(fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/programs" / (program + ".irl"));
    // With a tool that stands on what the frame lies lower; and without, for targets without tools.
    const Value p = put_shipped("ur10e", 0.05, "cell", program, source), with_tool = cell_;
    const Value bare = put_shipped("ur10e", 0, "bare", program + "_bare", source);
    const Value without_tool = cell_, yaskawa = pulses(), robots_of_fanuc = fanuc();
    for (const std::string& target : targets) {
      Value used = p;
      cell_ = with_tool;
      Map more;
      if (target == "pacscript")  // speeds are shares of the greatest
        more.set("profile", call("controller.get", {{"name", std::string("denso_rc8")}}));
      if (target == "inform") more.set("profile", yaskawa);
      if (target == "fanuc_tp") more.set("profile", robots_of_fanuc);
      Value posted = post(used, target, more);
      std::string cell;
      if (first_error(posted).find("tool") != std::string::npos) {
        used = bare, cell_ = without_tool;
        cell = "without a tool: ";
        posted = post(used, target, more);
      }
      // Where it is refused, or nobody reads the target, a run says no more.
      const bool is_run = first_error(posted).empty() && !unread.contains(target);
      more.set("run_check", true);
      more.set("contacts", false);
      if (is_run) posted = post(used, target, more);
      const Value* read = posted.as_map()->find("read_back");
      const auto numbered = [&](const std::string& why) {
        const auto it = std::find(reasons.begin(), reasons.end(), why);
        const auto n = it - reasons.begin();
        if (it == reasons.end()) reasons.push_back(why);
        return "(" + std::to_string(n + 1) + ")";
      };
      if (!is_run && first_error(posted).empty()) {
        cell += *at(posted, "form").as_string() + "; " + unread[target];
      } else if (!read) {
        cell += "refused " + numbered(first_error(posted));
      } else if (!*at(*read, "compared").as_bool()) {
        unread[target] = numbered("Not compared: " + *at(*read, "why_not").as_string() + ".");
        cell += *at(posted, "form").as_string() + "; " + unread[target];
      } else {
        const double time = *at(*read, "time").as_real(), other = *at(*read, "read_time").as_real();
        cell += *at(posted, "form").as_string() + ": " +
                std::to_string(*at(*read, "ends").as_int()) + " of " +
                std::to_string(*at(*read, "motions").as_int()) + ", " +
                at_most(*at(*read, "most_distance").as_real() * 1000, " mm") + ", " +
                at_most(*at(*read, "most_joint").as_real(), "°") + ", " +
                (*at(*read, "has_times").as_bool()
                     ? std::to_string(std::lround(100 * (other / time - 1))) + " %, "
                     : std::string("no times, ")) +
                std::to_string(*at(*read, "read_changes").as_int()) + " of " +
                std::to_string(*at(*read, "changes").as_int());
        if (const auto n = *at(*read, "not_said").as_int(); n > 0)
          cell += ", " + std::to_string(n) + " left out";
        // What a reader takes whole is where the run is.
        if (*at(*read, "not_said").as_int() == 0) {
          EXPECT_TRUE(*at(posted, "correct").as_bool()) << target << "\n" << all_faults(posted);
          EXPECT_LT(*at(*read, "most_distance").as_real(), 1e-4) << target;
        }
      }
      rows[target] += " " + cell + " |";
    }
  }
  std::ostringstream table;
  table << "| target | `hanoi` | `pick_and_place` | `palletising` | `arc_weld` "
           "|\n|---|---|---|---|---|\n";
  for (const std::string& t : targets) table << "| `" << t << "` |" << rows[t] << "\n";
  table << "\n";
  for (std::size_t i = 0; i < reasons.size(); ++i) table << i + 1 << ". " << reasons[i] << "\n";
  const fs::path page = fs::path(ROBOMOSP_SOURCE_DIR) / "docs/user/irl/read_back.md";
  const std::string whole = read_file(page);
  const std::string begin = "<!-- table: program_read_back_test -->\n",
                    end = "<!-- end of table -->";
  const std::size_t from = whole.find(begin), to = whole.find(end);
  ASSERT_NE(from, std::string::npos);
  ASSERT_NE(to, std::string::npos);
  const std::string there = whole.substr(from + begin.size(), to - from - begin.size());
  if (std::getenv("ROBOMOSP_UPDATE_GOLDEN")) {
    std::ofstream(page, std::ios::binary)
        << whole.substr(0, from + begin.size()) << table.str() << whole.substr(to);
    return;
  }
  EXPECT_EQ(there, table.str()) << "ROBOMOSP_UPDATE_GOLDEN=1 writes it anew.";
}

}  // namespace
}  // namespace robomosp
