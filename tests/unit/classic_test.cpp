// SPDX-License-Identifier: Apache-2.0
// Every command of the 2006 program, by the name it had there, is found and runs.
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "ioci/core/application.h"
#include "support/program.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;

/// A name of the original and a line that uses it. `noun option`, as its manual and the paper of
/// 2006 list them; the lines run one after the other in one session.
struct Line {
  const char *noun, *option, *line;
};
constexpr Line kLines[] = {
    {"Worlds", "Create", "Worlds Create cell"},
    {"Worlds", "LsWorlds", "Worlds LsWorlds"},
    {"Worlds", "GetWorldId", "Worlds GetWorldId 1"},
    {"Worlds", "GetWorldIndex", "Worlds GetWorldIndex bench"},
    {"Worlds", "GetActiveWorld", "Worlds GetActiveWorld"},
    {"World", "Show", "World bench Show"},
    {"World", "LsPObjects", "World bench LsPObjects"},
    {"World", "LsPRobots", "World bench LsPRobots"},
    {"World", "LsPTrajectories", "World bench LsPTrajectories"},
    {"World", "GetTargetId", "World bench GetTargetId"},
    {"World", "GetPObjectId", "World bench GetPObjectId 1"},
    {"World", "GetPRobotId", "World bench GetPRobotId 1"},
    {"World", "GetPRobotIdDesc", "World bench GetPRobotIdDesc \"an arm\""},
    {"World", "GetPTrajectoryId", "World bench GetPTrajectoryId 1"},
    {"World", "GetPRobotIndex", "World bench GetPRobotIndex arm"},
    {"World", "GetPTrajectoryIndex", "World bench GetPTrajectoryIndex stroke"},
    {"World", "LoadPTrajectory", "World cell LoadPTrajectory stroke.tjc"},
    {"World", "WorldSimulate", "World bench WorldSimulate arm stroke"},
    {"World", "InvKineWorldSim", "World bench InvKineWorldSim arm stroke"},
    {"World", "WorldInvKineSim", "World bench WorldInvKineSim arm stroke"},
    {"World", "InvDynWorldSim", "World bench InvDynWorldSim arm stroke"},
    {"World", "WorldInvDynSim", "World bench WorldInvDynSim arm stroke"},
    {"World", "WorldfKineSim", "World bench WorldfKineSim arm swing"},
    {"World", "WorldfDynSim", "World bench WorldfDynSim arm {0 0 0 0 0 0} 0.05"},
    {"World", "FwdDynWorldSim",
     "World bench FwdDynWorldSim arm 0.05 {0 0 0 0 0 0} runge_kutta4 0.001 {0 0 0 0 0 0}"},
    {"World", "ComputeBaseTjc", "World bench ComputeBaseTjc arm stroke"},
    {"World", "Save", "World bench Save bench.wld"},
    {"Transform", "Get", "Transform bench.target Get P3"},
    {"Transform", "Set", "Transform bench.target Set P3 0.6"},
    {"Transform", "Add", "Transform bench.target Add P3 \"10 mm\""},
    {"Transform", "Get mLocal", "Transform bench.target Get mLocal"},
    {"Transform", "mGlobal", "Transform bench.target mGlobal"},
    {"PObject", "vGetDynamicp", "PObject stand vGetDynamicp"},
    {"PTrajectory", "GetParameters", "PTrajectory stroke GetParameters"},
    {"PTrajectory", "GetNumGenPoints", "PTrajectory stroke GetNumGenPoints"},
    {"PTrajectory", "GetGenPoint", "PTrajectory stroke GetGenPoint 1"},
    {"PRobot", "AddLinks", "PRobot arm AddLinks 0 0 0 0 0 0.1"},
    {"PRobot", "SetLinks", "PRobot arm SetLinks 0 -45 30 0 57 0"},
    {"PRobot", "vGetDynamicp", "PRobot arm vGetDynamicp"},
    {"PRobot", "vGetDynamic", "PRobot arm vGetDynamic"},
    {"PRobot", "mGetDHp", "PRobot arm mGetDHp"},
    {"PRobot", "mGetDHP", "PRobot arm mGetDHP"},
    {"PRobot", "mGetToolHMT", "PRobot arm mGetToolHMT"},
    {"PRobot", "GetToolTransformId", "PRobot arm GetToolTransformId"},
    {"PRobot", "GetDOF", "PRobot arm GetDOF"},
    {"PRobot", "GetBaseType", "PRobot arm GetBaseType"},
    {"PRobot", "Link Add", "PRobot arm Link 6 Add 5"},
    {"PRobot", "Link Set", "PRobot arm Link 6 Set \"5 deg\""},
    {"PRobot", "Link mGetLocal", "PRobot arm Link 2 mGetLocal"},
    {"PRobot", "Link mGetGlobal", "PRobot arm Link 2 mGetGlobal"},
    {"PRobot", "Link vGetDHp", "PRobot arm Link 2 vGetDHp"},
    {"PRobot", "LLRL mGetDHp", "PRobot arm LLRL mGetDHp"},
    {"PRobot", "LLRL mGetInJointp", "PRobot arm LLRL mGetInJointp"},
    {"PRobot", "LLRL mGetInHMT", "PRobot arm LLRL mGetInHMT"},
    {"PRobot", "LLRL mGetOutJointp", "PRobot arm LLRL mGetOutJointp"},
    {"PRobot", "LLRL mGetOutHMT", "PRobot arm LLRL mGetOutHMT"},
    {"PRobot", "LLRL FKine", "PRobot arm LLRL FKine 0 0 0 0 0 0"},
    {"PRobot", "LLRL IKine", "PRobot arm LLRL IKine 0.4 0.1 0.5 0 0 0 partial=true"},
    {"PRobot", "LLRL mJacobian Local", "PRobot arm LLRL mJacobian Local"},
    {"PRobot", "LLRL mJacobian Global", "PRobot arm LLRL mJacobian Global"},
    {"PRobot", "LLRL RotVec", "PRobot arm LLRL RotVec"},
    {"PRobot", "FollowTarget", "PRobot arm FollowTarget"},
    {"ForceReDraw", "", "ForceReDraw"},
    {"World", "Close", "World cell Close"},
    {"Worlds", "Open", "Worlds Open bench.wld"},
};

class Classic : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    folder_ = fs::temp_directory_path() / ("robomosp-classic-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    fs::current_path(folder_);
    const Value links =
        List{Map{{"alpha", -1.5707963267948966}, {"d", 0.4}, {"lower", -3}, {"upper", 3}},
             Map{{"a", 0.45}, {"lower", -2}, {"upper", 2}},
             Map{{"alpha", -1.5707963267948966}, {"a", 0.05}, {"lower", -2.5}, {"upper", 2.5}},
             Map{{"alpha", 1.5707963267948966}, {"d", 0.4}, {"lower", -3}, {"upper", 3}},
             Map{{"alpha", -1.5707963267948966}, {"lower", -2}, {"upper", 2}},
             Map{{"d", 0.08},
                 {"lower", -6},
                 {"upper", 6},
                 {"mass", 2.0},
                 {"inertia", List{0.01, 0.01, 0.01, 0, 0, 0}}}};
    call("robot.create", {{"name", "arm"}, {"description", "an arm"}, {"links", links}});
    call("solid.create",
         {{"name", "block"}, {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}}});
    call("object.create", {{"name", "stand"}, {"parts", List{Map{{"what", "block"}}}}});
    call("world.create", {{"name", "bench"}});
    call("world.add_object", {{"id", "bench"}, {"what", "stand"}, {"position", List{0, 1, 0}}});
    call("world.add_robot",
         {{"id", "bench"}, {"robot", "arm"}, {"q", List{0, -0.8, 0.5, 0, 1, 0}}});
    const Value pose = call("robot.fk", {{"id", "arm"}});
    const auto at = reals(pose, "position"), turned = reals(pose, "rpy");
    const auto point = [&](double dy) {
      return List{at[0], at[1] + dy, at[2], turned[0], turned[1], turned[2]};
    };
    call("trajectory.create",
         {{"name", "stroke"},
          {"sample_time", 0.05},
          {"segments", List{Map{{"shape", "line"}, {"points", List{point(0), point(0.02)}}}}}});
    call("trajectory.create",
         {{"name", "swing"},
          {"segments", List{Map{{"shape", "ptp"},
                                {"joints", List{List{0, -0.8, 0.5, 0, 1, 0},
                                                List{0.3, -0.8, 0.5, 0, 1, 0}}}}}}});
    call("world.add_trajectory", {{"id", "bench"}, {"trajectory", "stroke"}});
    call("world.add_trajectory", {{"id", "bench"}, {"trajectory", "swing"}});
    call("trajectory.save", {{"id", "stroke"}, {"file", "stroke.tjc"}});
    call("world.add_frame", {{"id", "bench"},
                             {"name", "target"},
                             {"position", List{at[0], at[1] + 0.05, at[2]}},
                             {"rpy", List{turned[0], turned[1], turned[2]}}});
  }
  void TearDown() override {
    fs::current_path(fs::temp_directory_path());
    fs::remove_all(folder_);
  }
  static std::vector<double> reals(const Value& map, std::string_view name) {
    return map.as_map()->find(name)->as_array()->data();
  }
  Value classic(std::string_view line) {
    auto r = app().dispatch_classic(session_, line);
    EXPECT_TRUE(r.ok()) << line << ": " << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? std::move(*r) : Value();
  }
  fs::path folder_;
};

TEST_F(Classic, EveryNameOfTheOriginalIsFoundAndRuns) {
  for (const Line& l : kLines) {
    EXPECT_NE(app().commands.find_classic(l.noun, l.option), nullptr) << l.noun << " " << l.option;
    classic(l.line);
  }
}

TEST_F(Classic, ASpellingHasItsOwnOrderOfWordsAndFixedArguments) {
  const Value q(List{0, -0.8, 0.5, 0, 1, 0});
  EXPECT_EQ(classic("PRobot arm LLRL mJacobian Local"),
            call("robot.jacobian", {{"id", "arm"}, {"q", q}, {"frame", "tool"}}));
  EXPECT_EQ(classic("probot arm llrl mjacobian global 0 -0.8 0.5 0 1 0"),
            call("robot.jacobian", {{"id", "arm"}, {"q", q}}));
  EXPECT_EQ(classic("PRobot arm LLRL mGetOutHMT"), call("robot.fk", {{"id", "arm"}, {"q", q}}));
  const Value fall = classic("World bench FwdDynWorldSim arm 0.2 {0 0 0 0 0 0.5}");
  EXPECT_NEAR(
      call("recording.values", {{"id", fall}, {"columns", "time"}}).as_array()->data().back(), 0.2,
      1e-12);
  EXPECT_EQ(call("recording.values", {{"id", fall}, {"columns", "qd6"}}).as_array()->data().front(),
            0.5);
  const Value held = classic("World bench InvDynWorldSim arm stroke");
  const std::string name = app().describe(*held.as_handle());
  const Value driven = classic("World bench WorldfDynSim arm " + name);
  EXPECT_EQ(
      call("recording.values", {{"id", driven}, {"columns", "time"}}).as_array()->data().back(),
      call("recording.values", {{"id", held}, {"columns", "time"}}).as_array()->data().back())
      << "as long as the torques are known";
  const auto refused = app().dispatch_classic(session_, "PRobot arm LLRL mGetOutHMT 0 0 0 0 0 0");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(
      refused.error().sentence(),
      "robot.fk: the word \"0\" is one argument too many. help(\"robot.fk\") lists the arguments.");
}

/// No spelling for programs is known of 2006, and none is made up (decision 0067).
TEST_F(Classic, ProgramsHaveNoLinesOfTheirOwn) {
  for (const CommandSpec* c : app().commands.list())
    if (std::string_view(c->name).starts_with("program.")) {
      EXPECT_EQ(c->classic, "") << c->name;
    }
  for (const char* line : {"PProgram hanoi Run", "feIRLC hanoi.irl -S ../System"}) {
    const auto refused = app().dispatch_classic(session_, line);
    ASSERT_FALSE(refused.ok()) << line;
    EXPECT_NE(refused.error().sentence().find(std::string(line).substr(0, 6)), std::string::npos)
        << refused.error().sentence();
  }
}

TEST_F(Classic, TheToolFollowsTheTargetOfTheWorld) {
  EXPECT_EQ(classic("World bench GetTargetId"), Value("bench.target"));
  classic("PRobot arm FollowTarget");
  const auto tool = reals(classic("PRobot arm LLRL mGetOutHMT"), "position");
  const auto target = reals(classic("Transform bench.target Get mGlobal"), "position");
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(tool[k], target[k], 1e-8);
  EXPECT_EQ(classic("PRobot arm LLRL mGetOutJointp").as_array()->data().size(), 6U);
  classic("Transform bench.target Add P1 5");
  const auto far = app().dispatch_classic(session_, "PRobot arm FollowTarget");
  ASSERT_FALSE(far.ok());
  EXPECT_EQ(far.error().code, ErrorCode::unreachable);
  EXPECT_EQ(reals(classic("PRobot arm LLRL mGetOutHMT"), "position"), tool) << "it stays";
  // A world without the frame has its target at its origin until an element of it is set.
  classic("Worlds Create empty");
  EXPECT_EQ(classic("Transform empty.target Get P1"), Value(0.0));
  classic("Transform empty.target Set P1 0.5");
  EXPECT_EQ(classic("Transform empty.target Get P1"), Value(0.5));
  EXPECT_EQ(call("world.frames", {{"id", "empty"}}).as_list()->size(), 1U);
}

TEST_F(Classic, AJointTrajectoryMovesTheToolAsForwardKinematicsSays) {
  const Value run = classic("World bench WorldfKineSim arm swing");
  const auto column = [&](const char* name) -> std::vector<double> {
    return call("recording.values", {{"id", run}, {"columns", name}}).as_array()->data();
  };
  const auto q = column("q1"), x = column("x"), y = column("y"), yaw = column("wz"),
             qd = column("qd1");
  EXPECT_NEAR(q.back(), 0.3, 1e-12);
  const double radius = std::hypot(x.front(), y.front());
  for (std::size_t i = 0; i < q.size(); ++i) {
    EXPECT_NEAR(x[i], radius * std::cos(q[i]), 1e-12);
    EXPECT_NEAR(y[i], radius * std::sin(q[i]), 1e-12);
    EXPECT_NEAR(yaw[i], qd[i], 1e-12);
  }
  const auto refused = app().dispatch_classic(session_, "World bench WorldfKineSim arm stroke");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().sentence(),
            "trajectory \"stroke\", segment 1: it moves the tool, not the joints. "
            "Run such a trajectory with world.inverse_kinematics.");
}

TEST_F(Classic, ATrajectoryIsSeenFromTheBaseOfARobot) {
  call("robot.set", {{"id", "arm"}, {"base", Map{{"position", List{0, 0, 0.5}}}}});
  call("world.place", {{"id", "bench"},
                       {"member", "arm"},
                       {"position", List{1, 0, 0}},
                       {"rpy", List{0, 0, 1.5707963267948966}}});
  const auto rows = classic("World bench ComputeBaseTjc arm stroke");
  const auto world = call("trajectory.points", {{"id", "stroke"}});
  ASSERT_EQ(rows.as_array()->rows(), world.as_array()->rows());
  for (std::size_t i = 0; i < rows.as_array()->rows(); ++i) {
    const double* b = rows.as_array()->data().data() + 7 * i;
    const double* w = world.as_array()->data().data() + 7 * i;
    EXPECT_NEAR(b[1], w[2], 1e-12);      // x of the base is y of the world
    EXPECT_NEAR(b[2], 1 - w[1], 1e-12);  // y is -x, from 1
    EXPECT_NEAR(b[3], w[3] - 0.5, 1e-12);
  }
}

}  // namespace
}  // namespace robomosp::ioci
