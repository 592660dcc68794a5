// SPDX-License-Identifier: Apache-2.0
// Programs of robots that additional joints of the program carry: what is posted of them, and what
// is read back, beside their runs.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/program.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

constexpr double kQuarter = std::numbers::pi / 2;

/// Rows of an arm with a spherical wrist.
List arm_rows() {
  const auto row = [](const char* name, double theta, double d, double a, double alpha) {
    return Map{{"name", name}, {"theta", theta},      {"d", d},
               {"a", a},       {"alpha", alpha},      {"lower", -3.1},
               {"upper", 3.1}, {"max_velocity", 3.0}, {"max_acceleration", 15.0}};
  };
  List out;
  out.emplace_back(row("turn", 0, 0.4, 0.1, -kQuarter));
  out.emplace_back(row("upper", -kQuarter, 0, 0.5, 0));
  out.emplace_back(row("fore", 0, 0, 0.05, -kQuarter));
  out.emplace_back(row("roll", 0, 0.5, 0, kQuarter));
  out.emplace_back(row("pitch", 0, 0, 0, -kQuarter));
  out.emplace_back(row("flange", 0, 0.1, 0, 0));
  return out;
}
/// A joint that slides along z, with the frame behind it turned so that z is -x of the one before.
Map slide(const char* name, double upper = 2.0) {
  return Map{{"name", name},        {"joint", "prismatic"},   {"theta", -kQuarter},
             {"alpha", kQuarter},   {"lower", 0.0},           {"upper", upper},
             {"max_velocity", 1.0}, {"max_acceleration", 2.0}};
}
/// One that turns about z.
Map column(const char* name) {
  return Map{{"name", name},           {"d", 0.1},     {"a", 0.2},
             {"lower", -2.0},          {"upper", 2.0}, {"max_velocity", 1.0},
             {"max_acceleration", 2.0}};
}

class ProgramRail : public test::CommandTest {
 protected:
  /// A rail along x of the world from (0.2, -0.1, 0.3) m on, with what `carriers` say, then the
  /// arm, at `q`; a frame at the world's origin, so that targets are in the world.
  void put_cell(const List& carriers, const NumericArray& q, double tool = 0) {
    List links = carriers;
    for (const Value& v : arm_rows()) links.push_back(v);
    robot_ = call("robot.create", {{"name", "carried"}, {"links", std::move(links)}});
    call("robot.create", {{"name", "arm alone"}, {"links", arm_rows()}});
    if (tool > 0) {
      const Value cup = call("object.create", {{"name", "cup"}});
      call("object.add_tcp", {{"id", cup}, {"name", "lip"}, {"position", List{0.0, 0.0, tool}}});
      call("robot.attach", {{"id", robot_}, {"tool", cup}});
    }
    cell_ = call("world.create", {{"name", "cell"}});
    call("world.add_robot", {{"id", cell_},
                             {"robot", robot_},
                             {"name", "arm"},
                             {"position", List{0.2, -0.1, 0.3}},
                             {"rpy", List{0.0, kQuarter, 0.0}},
                             {"q", q}});
    call("world.add_frame", {{"id", cell_}, {"name", "floor"}, {"position", List{0.0, 0.0, 0.0}}});
    call("world.add_signal", {{"id", cell_}, {"name", "vac"}});
  }
  void put_rail(double at = 0, double tool = 0) {
    put_cell(List{Value(slide("rail"))}, NumericArray({at, 0.2, 0.3, 0.2, 0.0, 0.9, 0.0}), tool);
  }
  Value put_program(const std::string& name, const std::string& body, int slots = 1, int bound = 1,
                    const std::string& cell_more = "") {
    std::string axes;
    for (int i = 1; i <= slots; ++i) axes += (i > 1 ? ", AA" : "AA") + std::to_string(i);
    const Value p = call("program.create",
                         {{"name", name},
                          {"source", "PROGRAM " + name + ";\nSYSTEM_SPECIFICATION 'rail.ssi';\n" +
                                         body + "ENDPROGRAM;\n"}});
    call("program.set_file",
         {{"id", p},
          {"name", "rail.ssi"},
          {"text",
           "PROGRAM rail;\nCONST INT: R_NTURNS := 2, R_NADDJ := " + std::to_string(slots) +
               ", R_NJ := " + std::to_string(6 + slots) + ", R_DEVICE_NUMBER := 1;\n" + cell_more +
               "TYPE\nRECORD REAL: A1, A2, A3, A4, A5, A6; ENDRECORD: MAIN_JOINT;\n"
               "RECORD REAL: " +
               axes +
               "; ENDRECORD: ADD_JOINT;\n"
               "RECORD MAIN_JOINT: M_JOINT; ADD_JOINT: A_JOINT; ENDRECORD: JOINT;\n"
               "RECORD POSE: PSE; INT: STATUS; ARRAY [1..R_NTURNS] OF INT: TURNS; ADD_JOINT: "
               "A_JOINT; ENDRECORD: ROBTARGET;\nENDPROGRAM;\n"}});
    place(p, bound);
    return p;
  }
  void place(const Value& p, int bound) {
    call("world.add_program", {{"id", cell_}, {"program", p}, {"robot", "arm"}});
    call("program.bind", {{"id", p}, {"kind", "robot"}, {"to", "arm"}, {"frame", "floor"}});
    for (int i = 1; i <= bound; ++i)
      call("program.bind", {{"id", p},
                            {"kind", "joint"},
                            {"name", std::to_string(i)},
                            {"to", "arm"},
                            {"joint", std::to_string(i)}});
  }
  Value post(const Value& p, const std::string& target, Map more = {}) {
    more.set("id", p);
    if (!more.find("profile")) more.set("target", Value(target));
    more.set("world", cell_);
    more.set("check", true);
    return call("program.post", more);
  }
  Value run_post(const Value& p, const std::string& target, Map more = {}) {
    more.set("run_check", true);
    more.set("contacts", false);
    return post(p, target, more);
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
  /// A post that was run and found to be the run.
  void expect_same(const Value& done, int ends, double joint = 0.01) {
    ASSERT_TRUE(done.as_map()->find("read_back")) << all_faults(done);
    const Value& beside = at(done, "read_back");
    ASSERT_TRUE(*at(beside, "compared").as_bool()) << beside.text() << all_faults(done);
    EXPECT_TRUE(*at(done, "correct").as_bool()) << all_faults(done) << text(done);
    EXPECT_EQ(*at(beside, "ends").as_int(), ends) << beside.text();
    EXPECT_LT(*at(beside, "most_distance").as_real(), 1e-4) << text(done);
    EXPECT_LT(*at(beside, "most_angle").as_real(), 1e-3);
    EXPECT_LT(*at(beside, "most_joint").as_real(), joint) << text(done);
  }
  /// Numbers behind `word`, up to the bracket.
  static std::vector<double> numbers_behind(const std::string& text, const std::string& word,
                                            std::size_t from = 0) {
    std::vector<double> out;
    std::size_t i = text.find(word, from);
    if (i == std::string::npos) return out;
    i += word.size();
    for (const char* c = text.c_str() + i; *c && *c != '}' && *c != ']';) {
      char* end = nullptr;
      const double v = std::strtod(c, &end);
      if (end == c) ++c;
      else out.push_back(v), c = end;
    }
    return out;
  }
  /// Where the flange of the arm alone is [m].
  std::array<double, 3> flange(const std::vector<double>& degrees) {
    List q;
    for (const double d : degrees) q.emplace_back(d / 180 * std::numbers::pi);
    const Value pose = call("robot.fk", {{"id", "arm alone"}, {"q", q}});
    const auto& p = at(pose, "position").as_array()->data();
    return {p[0], p[1], p[2]};
  }
  Value robot_, cell_;
};

/// Places in the world. The arm's axis 1 is at (0.2 + rail, -0.1) m, 0.3 m above the floor.
constexpr const char* kRides = R"(SIGNAL
  OUTPUT BOOL: vac AT 3;
VAR
  ORIENTATION: down := ORIZYX(0.0, 0.0, 180.0);
BEGIN
  MOVE PTP ROBTARGET(POSE(POSITION(700.0, -700.0, 600.0), down), -1, [-128, -128], ADD_JOINT(400.0));
  MOVE LIN POSE(POSITION(800.0, -700.0, 500.0), down) SPEED := 200.0;
  vac := TRUE;
  MOVE LIN ROBTARGET(POSE(POSITION(1000.0, -650.0, 550.0), down), -1, [-128, -128], ADD_JOINT(700.0)) SPEED := 200.0 ADAX_CONTROL := TCP_KEEP;
  MOVE PTP JOINT(MAIN_JOINT(20.0, 10.0, 20.0, 0.0, 50.0, 0.0), ADD_JOINT(100.0));
  MOVE PTP MAIN_JOINT(0.0, 10.0, 20.0, 0.0, 60.0, 30.0);
  vac := FALSE;
)";

std::string without_control() {
  std::string body = kRides;
  const std::string control = " ADAX_CONTROL := TCP_KEEP";
  return body.replace(body.find(control), control.size(), "");
}

TEST_F(ProgramRail, EveryTargetWritesTheRailOrRefusesIt) {
  put_rail();
  const Value p = put_program("ride", kRides);
  const std::set<std::string> with_rail{"krl", "rapid", "fanuc_tp", "pdl2", "as"};
  const Value all = call("program.targets");
  for (const Value& t : *all.as_list()) {
    if (*at(t, "by").as_string() != "plugin") continue;
    const std::string target = *at(t, "name").as_string();
    SCOPED_TRACE(target);
    const Value done = run_post(p, target);
    const std::string refusal = first_error(done);
    if (with_rail.contains(target)) {
      expect_same(done, 5);
    } else if (*at(t, "external_axes").as_int() == 0) {
      EXPECT_NE(refusal.find("additional joint"), std::string::npos) << refusal;
    }
  }
}

// Joints that the post computes, against the arm alone on its carriage: at rail 0.4 m its base is
// at (0.6, -0.1, 0.3) m in the world, turned by -90 degrees about z.
TEST_F(ProgramRail, JointsAreThoseOfTheArmWhereTheCarriageIs) {
  put_rail();
  const Value p = put_program("ride", kRides);
  const Value pa10 = post(put_program("free", without_control()), "pa10");
  EXPECT_EQ(all_faults(pa10).find("not known"), std::string::npos) << all_faults(pa10);
  std::string whole = text(pa10);
  whole = whole.substr(whole.find("rmp_ptp_to(rmp_joints("));
  const auto q = numbers_behind(whole, "(const double[]){");
  ASSERT_EQ(q.size(), 6U) << whole;
  const auto at_flange = flange(q);
  EXPECT_NEAR(0.6 + at_flange[1], 0.7, 1e-6);
  EXPECT_NEAR(-0.1 - at_flange[0], -0.7, 1e-6);
  EXPECT_NEAR(0.3 + at_flange[2], 0.6, 1e-6);
  // KUKA's base is that of the rail: z along x of the world.
  const Value krl = post(p, "krl");
  EXPECT_NE(text(krl).find("E1 400.000"), std::string::npos) << text(krl);
  EXPECT_NE(text(krl).find("E1 700.000"), std::string::npos) << text(krl);
  EXPECT_NE(text(krl).find("E1 100.000"), std::string::npos) << text(krl);
  // Measured from the carriage the first target is (0.6, 0.1, 0.3) m.
  EXPECT_NE(all_faults(krl).find("additional joint 1 (rail of arm)"), std::string::npos)
      << all_faults(krl);
}

// A variable has one text, and the rail another place at each use.
TEST_F(ProgramRail, OnePoseIsGoneToFromTwoPlacesOfTheRail) {
  put_rail(0.2);
  const Value p = put_program("twice", R"(VAR
  ORIENTATION: down := ORIZYX(0.0, 0.0, 180.0);
  POSE: here := POSE(POSITION(800.0, -700.0, 500.0), down);
BEGIN
  MOVE PTP here;
  MOVE PTP ROBTARGET(POSE(POSITION(900.0, -700.0, 600.0), down), -1, [-128, -128], ADD_JOINT(700.0));
  MOVE LIN here SPEED := 200.0;
  MOVE PTP ROBTARGET(POSE(POSITION(900.0, -700.0, 600.0), down), -1, [-128, -128], ADD_JOINT(0.0));
  MOVE PTP here;
)");
  for (const char* target : {"krl", "rapid", "c", "pa10"}) {
    SCOPED_TRACE(target);
    expect_same(run_post(p, target), 5);
  }
}

TEST_F(ProgramRail, CProgramsMoveTheRailBehindEachMotion) {
  put_rail();
  const Value p = put_program("ride", without_control());
  for (const char* target : {"c", "pa10"}) {
    SCOPED_TRACE(target);
    expect_same(run_post(p, target), 5);
  }
}

TEST_F(ProgramRail, ToolsAreOnTheArmWhereverTheRailIs) {
  put_rail(0.3, 0.08);
  const Value p = put_program("tooled", kRides);
  for (const char* target : {"krl", "rapid"}) {
    SCOPED_TRACE(target);
    expect_same(run_post(p, target), 5);
  }
  EXPECT_NE(text(post(p, "krl")).find("$TOOL={X 0.000,Y 0.000,Z 80.000,"), std::string::npos);
}

// A rail that stays is no reason to refuse: a controller without external axes has its base on the
// carriage.
TEST_F(ProgramRail, ARailThatStaysIsTheBaseOfControllersWithoutExternalAxes) {
  put_rail(0.4);
  const Value p = put_program("stays", R"(VAR
  ORIENTATION: down := ORIZYX(0.0, 0.0, 180.0);
BEGIN
  MOVE PTP POSE(POSITION(700.0, -700.0, 600.0), down);
  MOVE LIN ROBTARGET(POSE(POSITION(800.0, -700.0, 500.0), down), -1, [-128, -128], ADD_JOINT(400.0)) SPEED := 200.0;
)");
  for (const char* target : {"urscript", "krl", "rapid", "c", "joint_trajectory", "val3"}) {
    SCOPED_TRACE(target);
    const Value done = run_post(p, target);
    EXPECT_EQ(first_error(done), "") << all_faults(done);
    if (const Value* beside = done.as_map()->find("read_back");
        beside && *at(*beside, "compared").as_bool())
      expect_same(done, 2);
  }
  // (0.6, 0.1, 0.3) m from the carriage.
  const Value ur = post(p, "urscript");
  EXPECT_NE(all_faults(ur).find("measured from the carriage"), std::string::npos) << all_faults(ur);
}

TEST_F(ProgramRail, MakersAxesOfTheRailAreWrittenAndRead) {
  put_rail();
  List axes;
  for (int i = 1; i <= 6; ++i)
    axes.emplace_back(
        Map{{"name", "A" + std::to_string(i)},
            {"link", std::array<const char*, 6>{"turn", "upper", "fore", "roll", "pitch",
                                                "flange"}[std::size_t(i - 1)]},
            {"sign", i == 2 ? -1 : 1}});
  axes.emplace_back(Map{{"name", "E1"},
                        {"link", "rail"},
                        {"sign", -1},
                        {"offset", 1.5},
                        {"unit", "mm"},
                        {"external", true}});
  call("robot.set_axes", {{"id", robot_}, {"axes", axes}});
  const Value p = put_program("makers", kRides);
  for (const char* target : {"krl", "rapid"}) {
    SCOPED_TRACE(target);
    expect_same(run_post(p, target), 5);
  }
  EXPECT_NE(text(post(p, "krl")).find("E1 1100.000"), std::string::npos) << text(post(p, "krl"));
  // The same by the controller's profile, of a robot that does not know.
  call("robot.set_axes", {{"id", robot_}, {"axes", List{}}});
  call("record.create", {{"kind", "controller"},
                         {"name", "kuka"},
                         {"fields", Map{{"target", "krl"},
                                        {"axes", List{Map{{"name", "E1"},
                                                          {"joint", 1},
                                                          {"is_external", true},
                                                          {"is_linear", true},
                                                          {"sign", -1},
                                                          {"offset", 1500.0}}}}}}});
  const Value by_profile = run_post(p, "krl", {{"profile", "kuka"}});
  expect_same(by_profile, 5);
  EXPECT_NE(text(by_profile).find("E1 1100.000"), std::string::npos) << text(by_profile);
}

TEST_F(ProgramRail, ARailOfSeveralJointsMovesInItsOwnOrder) {
  put_cell(List{Value(slide("rail")), Value(column("column"))},
           NumericArray({0.0, 0.3, 0.2, 0.3, 0.2, 0.0, 0.9, 0.0}));
  const Value p = put_program("both", R"(VAR
  ORIENTATION: down := ORIZYX(0.0, 0.0, 180.0);
BEGIN
  MOVE PTP JOINT(MAIN_JOINT(20.0, 10.0, 20.0, 0.0, 50.0, 0.0), ADD_JOINT(500.0, 30.0));
  MOVE PTP ROBTARGET(POSE(POSITION(900.0, -700.0, 600.0), down), -1, [-128, -128], ADD_JOINT(600.0, -20.0));
  MOVE LIN POSE(POSITION(900.0, -650.0, 600.0), down) SPEED := 200.0;
  MOVE LIN ROBTARGET(POSE(POSITION(950.0, -700.0, 600.0), down), -1, [-128, -128], ADD_JOINT(700.0, -10.0)) SPEED := 200.0 ADAX_CONTROL := TCP_KEEP;
)",
                              2, 2);
  for (const char* target : {"krl", "rapid"}) {
    SCOPED_TRACE(target);
    expect_same(run_post(p, target), 4);
  }
}

// The action of UNTIL begins where the motion was left: that is known only if the rail stays.
TEST_F(ProgramRail, TheActionOfAConditionBeginsWhereTheMotionWasLeft) {
  put_rail();
  call("world.add_signal", {{"id", cell_}, {"name", "stop"}});
  const auto faults_of = [&](const std::string& name, const std::string& motion) {
    const Value p = put_program(name, R"(SIGNAL
  INPUT BOOL: stop AT 1;
VAR
  ORIENTATION: down := ORIZYX(0.0, 0.0, 180.0);
PROCEDURE lift;
BEGIN
  MOVE LIN POSE(POSITION(800.0, -700.0, 600.0), down) SPEED := 200.0;
ENDPROC;
BEGIN
  MOVE PTP ROBTARGET(POSE(POSITION(700.0, -700.0, 600.0), down), -1, [-128, -128], ADD_JOINT(400.0));
  )" + motion + R"( SPEED := 200.0 UNTIL stop DO lift;
)");
    return all_faults(post(p, "krl", {{"form", "structured"}}));
  };
  const char* unknown = "known at run time only";
  EXPECT_EQ(faults_of("stays", "MOVE LIN POSE(POSITION(800.0, -700.0, 500.0), down)").find(unknown),
            std::string::npos);
  EXPECT_NE(faults_of("rides",
                      "MOVE LIN ROBTARGET(POSE(POSITION(900.0, -700.0, 500.0), down), -1, [-128, "
                      "-128], ADD_JOINT(700.0))")
                .find(unknown),
            std::string::npos);
}

// REPEAT asks its condition behind the body, where the rail is known; WHILE asks it before.
TEST_F(ProgramRail, RepeatAsksItsConditionBehindItsBody) {
  put_rail();
  const auto faults_of = [&](const std::string& name, const std::string& loop) {
    const Value p = put_program(name, R"(VAR
  INT: n;
  ORIENTATION: down := ORIZYX(0.0, 0.0, 180.0);
FUNCTION again(): BOOL;
BEGIN
  n := n + 1;
  MOVE PTP POSE(POSITION(800.0, -700.0, 500.0), down);
  RETURN n < 3;
ENDFCT;
PROCEDURE ride;
BEGIN
  MOVE PTP ROBTARGET(POSE(POSITION(900.0, -700.0, 600.0), down), -1, [-128, -128], ADD_JOINT(700.0));
ENDPROC;
BEGIN
)" + loop);
    return all_faults(post(p, "krl", {{"form", "structured"}}));
  };
  const char* unknown = "known at run time only";
  const std::string repeat = faults_of("repeats", "  REPEAT\n    ride;\n  UNTIL NOT again();\n");
  EXPECT_EQ(repeat.find(unknown), std::string::npos) << repeat;
  const std::string loop = faults_of("whiles", "  WHILE again() DO\n    ride;\n  ENDWHILE;\n");
  EXPECT_NE(loop.find(unknown), std::string::npos) << loop;
}

// What the text does not say is not made up.
TEST_F(ProgramRail, JointsOfARailThatIsKnownAtRunTimeOnlyAreNotKnown) {
  put_rail();
  const Value p = put_program("asks", R"(SIGNAL
  INPUT BOOL: far AT 1;
VAR
  ORIENTATION: down := ORIZYX(0.0, 0.0, 180.0);
BEGIN
  IF far THEN
    MOVE PTP ROBTARGET(POSE(POSITION(900.0, -700.0, 600.0), down), -1, [-128, -128], ADD_JOINT(700.0));
  ELSE
    MOVE PTP ROBTARGET(POSE(POSITION(700.0, -700.0, 600.0), down), -1, [-128, -128], ADD_JOINT(400.0));
  ENDIF;
  MOVE PTP POSE(POSITION(800.0, -700.0, 500.0), down);
)");
  call("world.add_signal", {{"id", cell_}, {"name", "far"}});
  const Value krl = post(p, "krl", {{"form", "structured"}});
  EXPECT_NE(all_faults(krl).find("known at run time only"), std::string::npos) << all_faults(krl);
  const Value pa10 = post(p, "pa10", {{"form", "structured"}});
  EXPECT_NE(first_error(pa10).find("known at run time only"), std::string::npos)
      << all_faults(pa10);
}

TEST_F(ProgramRail, AFrameThatTheProgramMovesIsRefused) {
  put_rail();
  call("robot.create", {{"name", "table"},
                        {"links", List{Map{{"name", "plate"}, {"lower", -3.0}, {"upper", 3.0}}}}});
  call("world.add_robot",
       {{"id", cell_}, {"robot", "table"}, {"name", "table"}, {"position", List{0.8, -0.9, 0.2}}});
  call("object.create", {{"name", "jig"}});
  call("world.add_object",
       {{"id", cell_}, {"what", "jig"}, {"name", "jig"}, {"position", List{0.8, -0.9, 0.2}}});
  call("world.attach", {{"id", cell_}, {"object", "jig"}, {"robot", "table"}});
  const Value p = put_program("turns", R"(VAR
  ORIENTATION: down := ORIZYX(0.0, 0.0, 180.0);
BEGIN
  MOVE PTP ROBTARGET(POSE(POSITION(700.0, -700.0, 600.0), down), -1, [-128, -128], ADD_JOINT(400.0, 30.0));
  MOVE LIN POSE(POSITION(750.0, -700.0, 600.0), down) SPEED := 200.0;
)",
                              2);
  call("program.bind", {{"id", p}, {"kind", "joint"}, {"name", "2"}, {"to", "table"}});
  // The positioner turns beside the motions, whose targets stay in the world.
  for (const char* target : {"krl", "rapid"}) {
    SCOPED_TRACE(target);
    expect_same(run_post(p, target), 2);
  }
  EXPECT_NE(text(post(p, "krl")).find("E1 400.000,E2 30.000"), std::string::npos);
  call("program.bind", {{"id", p}, {"kind", "robot"}, {"to", "arm"}, {"frame", "jig"}});
  EXPECT_NE(first_error(post(p, "krl")).find("\"table\" carries"), std::string::npos)
      << all_faults(post(p, "krl"));
}

TEST_F(ProgramRail, TargetsAreComparedWithTheRail) {
  put_rail();
  const Value p = put_program("ride", kRides);
  const Value c = call("program.compare_targets",
                       {{"id", p}, {"world", cell_}, {"targets", List{"krl", "rapid"}}});
  for (const Value& t : *at(c, "targets").as_list()) {
    EXPECT_EQ(*at(t, "compared").as_int(), 5) << t.text();
    EXPECT_LT(*at(t, "most_distance").as_real(), 1e-5) << t.text();
  }
  for (const Value& d : *at(c, "differences").as_list())
    EXPECT_NE(*at(d, "kind").as_string(), "additional") << d.text();
}

// Without a world the maker's external axes are the additional joints.
TEST_F(ProgramRail, AloneTheMakersExternalAxesCarryTheRobot) {
  put_rail();
  List axes;
  for (const char* link : {"turn", "upper", "fore", "roll", "pitch", "flange"})
    axes.emplace_back(Map{{"name", std::string("A ") + link}, {"link", link}});
  axes.emplace_back(Map{{"name", "E1"}, {"link", "rail"}, {"unit", "mm"}, {"external", true}});
  call("robot.set_axes", {{"id", robot_}, {"axes", axes}});
  const Value p = call("program.create", {{"name", "alone"}, {"source", R"(PROGRAM alone;
VAR
  ORIENTATION: across := ORIZYX(0.0, 90.0, 0.0);
BEGIN
  MOVE PTP JOINT(MAIN_JOINT(20.0, 10.0, 20.0, 0.0, 50.0, 0.0), ADD_JOINT(500.0));
  MOVE PTP MAIN_JOINT(0.0, 10.0, 20.0, 0.0, 60.0, 30.0);
ENDPROGRAM;
)"}});
  const Value checked =
      call("program.check_run", {{"id", p}, {"robot", robot_}, {"contacts", false}});
  EXPECT_EQ(*at(checked, "errors").as_int(), 0) << checked.text();
  const Value krl = call("program.post", {{"id", p},
                                          {"target", "krl"},
                                          {"robot", robot_},
                                          {"check", true},
                                          {"contacts", false},
                                          {"run_check", true}});
  expect_same(krl, 2);
  EXPECT_NE(text(krl).find("E1 500.000"), std::string::npos) << text(krl);
}

// A controller's program with external axes, bound to a robot on a rail: ends of motions are those
// of the program that it was posted from.
TEST_F(ProgramRail, AProgramOfAControllerRunsOnTheRail) {
  put_rail();
  const Value own = put_program("ride", kRides);
  const auto ends = [&](const Value& p) {
    const Value run = call("program.check_run",
                           {{"id", p}, {"world", cell_}, {"unbound", "free"}, {"contacts", false}});
    EXPECT_EQ(*at(run, "errors").as_int(), 0) << run.text();
    std::vector<std::array<double, 3>> out;
    for (const Value& m : *at(run, "motions").as_list()) {
      const auto& end = at(m, "end").as_array()->data();
      out.push_back({end[0], end[1], end[2]});
    }
    return out;
  };
  const auto wanted = ends(own);
  ASSERT_EQ(wanted.size(), 5U);
  std::map<std::string, std::vector<std::pair<std::string, std::string>>> written;
  for (const char* target : {"krl", "rapid"}) {
    const Value posted = post(own, target);
    for (const Value& f : *at(posted, "files").as_list())
      written[target].emplace_back(*at(f, "name").as_string(), *at(f, "text").as_string());
  }
  for (const auto& [target, files] : written) {
    SCOPED_TRACE(target);
    app().document.clear();
    put_rail();
    const fs::path folder =
        fs::temp_directory_path() / ("rail-" + std::to_string(::getpid()) + "-" + target);
    fs::create_directories(folder);
    for (const auto& [name, text] : files) std::ofstream(folder / name, std::ios::binary) << text;
    const Value read = call("program.import", {{"file", (folder / files.front().first).string()}});
    fs::remove_all(folder);
    call("world.add_program", {{"id", cell_}, {"program", read}, {"robot", "arm"}});
    call("program.bind", {{"id", read}, {"kind", "joint"}, {"name", "1"}, {"to", "arm"}});
    const auto got = ends(read);
    ASSERT_EQ(got.size(), wanted.size());
    for (std::size_t i = 0; i < got.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(got[i][k], wanted[i][k], 1e-5) << i;
  }
}

}  // namespace
}  // namespace robomosp
