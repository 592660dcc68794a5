// SPDX-License-Identifier: Apache-2.0
// Lines of the 2006 program: every spelling, its answer held against one that is computed here, by
// the trigonometry of a robot of two turns in a plane and a slide out of it.
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ioci/core/application.h"
#include "support/program.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;
using Numbers = std::vector<double>;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kUpper = 0.4, kFore = 0.3, kMass = 2, kGravity = 9.81;

/// Where the tool of the robot is at two angles and a slide.
struct Tool {
  double x, y, z, yaw;
};
Tool tool_at(double q1, double q2, double q3) {
  return {kUpper * std::cos(q1) + kFore * std::cos(q1 + q2),
          kUpper * std::sin(q1) + kFore * std::sin(q1 + q2), q3, q1 + q2};
}

class ClassicAnswers : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    folder_ = fs::temp_directory_path() / ("robomosp-answers-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    fs::current_path(folder_);
    const Value links = List{
        Map{{"name", "upper"}, {"a", kUpper}, {"lower", -120 * kDegree}, {"upper", 150 * kDegree}},
        Map{{"name", "fore"}, {"a", kFore}, {"lower", -90 * kDegree}, {"upper", 90 * kDegree}},
        Map{{"name", "slide"},
            {"joint", "prismatic"},
            {"lower", -1},
            {"upper", 2},
            {"mass", kMass},
            {"inertia", List{0.01, 0.01, 0.01, 0, 0, 0}}}};
    call("robot.create", {{"name", "arm"}, {"description", "two and a slide"}, {"links", links}});
    call("robot.set_pose",
         {{"id", "arm"}, {"name", "home"}, {"q", List{10 * kDegree, 20 * kDegree, 0.05}}});
    call("robot.set_pose",
         {{"id", "arm"}, {"name", "nest"}, {"q", List{-30 * kDegree, 40 * kDegree, 0.3}}});
    call("material.create", {{"name", "steel"}, {"density", 7850}});
    call("solid.create", {{"name", "block"},
                          {"material", "steel"},
                          {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.2}, {"z", 0.3}}}});
    call("object.create", {{"name", "stand"}, {"parts", List{Map{{"what", "block"}}}}});
    call("world.create", {{"name", "cell"}});
    call("world.create", {{"name", "bench"}});
    call("world.add_object", {{"id", "bench"}, {"what", "stand"}, {"position", List{0, 1, 0}}});
    call("world.add_robot", {{"id", "bench"}, {"robot", "arm"}, {"q", List{kQ1, kQ2, 0.1}}});
    const Tool at = tool_at(kQ1, kQ2, 0.1);
    // Up by 0.2 m in 1 s, at a constant speed.
    trajectory("stroke", {at.x, at.y, 0.1, 0, 0, at.yaw}, {at.x, at.y, 0.3, 0, 0, at.yaw},
               "constant_speed", {{"speed", 0.2}});
    // The base goes up by 0.05 m, from rest with 0.1 m/s^2.
    trajectory("drive", {0, 0, 0, 0, 0, 0}, {0, 0, 0.05, 0, 0, 0}, "constant_acceleration",
               {{"acceleration", 0.1}});
    call("world.add_frame", {{"id", "bench"},
                             {"name", "target"},
                             {"position", List{at.x, at.y, 0.25}},
                             {"rpy", List{0, 0, at.yaw}}});
  }
  void TearDown() override {
    fs::current_path(fs::temp_directory_path());
    fs::remove_all(folder_);
  }

  void trajectory(const char* name, const Numbers& from, const Numbers& to, const char* law,
                  Map params) {
    const auto list = [](const Numbers& v) {
      List out;
      for (const double x : v) out.emplace_back(x);
      return out;
    };
    Map segment = std::move(params);
    segment.set("shape", "line");
    segment.set("law", law);
    segment.set("points", List{list(from), list(to)});
    call("trajectory.create",
         {{"name", name}, {"sample_time", 0.1}, {"segments", List{std::move(segment)}}});
    call("world.add_trajectory", {{"id", "bench"}, {"trajectory", name}});
  }
  Value classic(const std::string& line) {
    auto r = app().dispatch_classic(session_, line);
    EXPECT_TRUE(r.ok()) << line << ": " << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? std::move(*r) : Value();
  }
  std::string refused(const std::string& line) {
    auto r = app().dispatch_classic(session_, line);
    EXPECT_FALSE(r.ok()) << line << " should have failed";
    return r.ok() ? std::string() : r.error().sentence();
  }
  static Numbers numbers(const Value& v) {
    if (v.is_number()) return {v.number()};
    if (!v.as_array()) return {};
    return {v.as_array()->data().begin(), v.as_array()->data().end()};
  }
  static Numbers field(const Value& v, std::string_view name) { return numbers(at(v, name)); }
  void expect(const std::string& line, const Numbers& wanted, double within = 1e-12) {
    compare(numbers(classic(line)), wanted, line, within);
  }
  static void compare(const Numbers& is, const Numbers& wanted, const std::string& line,
                      double within = 1e-12) {
    ASSERT_EQ(is.size(), wanted.size()) << line;
    for (std::size_t i = 0; i < is.size(); ++i)
      EXPECT_NEAR(is[i], wanted[i], within) << line << ", number " << i + 1;
  }
  Numbers column(const Value& recording, const char* name) {
    return numbers(call("recording.values", {{"id", recording}, {"columns", name}}));
  }
  /// Whether a message of the last line has these words.
  bool told(const std::string& words) {
    for (const Message& m : app().messages.recent(20))
      if (m.text.find(words) != std::string::npos) return true;
    return false;
  }

  static constexpr double kQ1 = 30 * kDegree, kQ2 = 45 * kDegree;
  fs::path folder_;
};

TEST_F(ClassicAnswers, JointsAreInDegreesAndMetresAndCountFromOne) {
  expect("PRobot arm SetLinks 10 -20 0.15", {10, -20, 0.15});
  expect("PRobot arm LLRL mGetInJointp", {10 * kDegree, -20 * kDegree, 0.15});
  expect("PRobot arm AddLinks 5 5 0.05", {15, -15, 0.2});
  expect("PRobot arm SetLinks {10 -20 0.15}", {10, -20, 0.15});
  expect("PRobot arm SetLinks {0.5rad, 10 deg, 5 cm}", {0.5 / kDegree, 10, 0.05});
  expect("PRobot arm SetLinks 10deg -20 15cm", {10, -20, 0.15});
  expect("PRobot arm Link 1 Set 30", {30, -20, 0.15});
  expect("PRobot arm Link 2 Add 65", {30, 45, 0.15});
  expect("PRobot arm Link 3 Set 0.1", {30, 45, 0.1});
  expect("PRobot arm Link 3 Add 0.01", {30, 45, 0.11});
  expect("PRobot arm Link slide Set 10cm", {30, 45, 0.1});
  expect("PRobot arm Link 1 GetAngle", {30});
  expect("PRobot arm Link 3 GetAngle", {0.1});
  expect("PRobot arm Link 1 GetMinAngle", {-120});
  expect("PRobot arm GetMaxAngle 2", {90});
  expect("PRobot arm Link 3 GetMaxAngle", {2});
  expect("PRobot arm GetMinAngle 3", {-1});
  expect("PRobot arm GetAngle 2", {45});
  EXPECT_EQ(refused("PRobot arm Link 0 Set 1"),
            "robot.set_joint, joint: there is no link 0. Links are numbered 1 to 3.");
  EXPECT_EQ(refused("PRobot arm Link 4 GetAngle"),
            "robot.joint_value, joint: there is no link 4. Links are numbered 1 to 3.");
  EXPECT_NE(refused("PRobot arm SetLinks 1 2").find("the robot has 3 joints"), std::string::npos);
  EXPECT_NE(refused("PRobot arm SetLinks 1 2 nan"), "");
  expect("PRobot arm LLRL mGetInJointp", {kQ1, kQ2, 0.1});
}

TEST_F(ClassicAnswers, LlrlAnswersInRadians) {
  const Tool home = tool_at(kQ1, kQ2, 0.1);
  const auto tool = [&](const std::string& line, const Tool& wanted) {
    const Value pose = classic(line);
    compare(field(pose, "position"), {wanted.x, wanted.y, wanted.z}, line);
    compare(field(pose, "rpy"), {0, 0, wanted.yaw}, line);
  };
  tool("PRobot arm LLRL mGetOutHMT", home);
  tool("PRobot arm LLRL FKine 0.2 0.3 0.4", tool_at(0.2, 0.3, 0.4));
  tool("PRobot arm Link 3 mGetGlobal", home);
  tool("PRobot arm Link 3 mGetLocal", {0, 0, 0.1, 0});
  tool("PRobot arm Link 2 mGetLocal", {kFore * std::cos(kQ2), kFore * std::sin(kQ2), 0, kQ2});
  expect("PRobot arm LLRL mGetOriginAngles", {10 * kDegree, 20 * kDegree, 0.05});
  expect("PRobot arm LLRL mGetNestAngles", {-30 * kDegree, 40 * kDegree, 0.3});
  const double s1 = std::sin(kQ1), c1 = std::cos(kQ1), s = std::sin(kQ1 + kQ2),
               c = std::cos(kQ1 + kQ2);
  const Numbers jacobian{-kUpper * s1 - kFore * s,
                         -kFore * s,
                         0,
                         kUpper * c1 + kFore * c,
                         kFore * c,
                         0,
                         0,
                         0,
                         1,
                         0,
                         0,
                         0,
                         0,
                         0,
                         0,
                         1,
                         1,
                         0};
  expect("PRobot arm LLRL mJacobian Global", jacobian);
  expect("PRobot arm LLRL mJacobian", jacobian);
  Numbers local = jacobian;
  for (std::size_t j = 0; j < 3; ++j) {
    local[j] = c * jacobian[j] + s * jacobian[3 + j];
    local[3 + j] = -s * jacobian[j] + c * jacobian[3 + j];
  }
  expect("PRobot arm LLRL mJacobian Local", local);
  expect("PRobot arm LLRL RotVec", {0, 0, home.yaw});
  expect("PRobot arm LLRL RotVec 0.2 0.3 0.4", {0, 0, 0.5});
  expect("PRobot arm LLRL RotVec 0 -1 0 1 0 0 0 0 1", {0, 0, std::numbers::pi / 2});
  EXPECT_NE(refused("PRobot arm LLRL RotVec 1 1 0 1 0 0 0 0 1").find("not a rotation"),
            std::string::npos);
  tool("PRobot arm LLRL mGetInHMT", {home.x, home.y, 0.25, home.yaw});
  expect("PRobot arm LLRL mGetOutJointp", {kQ1, kQ2, 0.25}, 1e-8);
  compare(field(classic("PRobot arm LLRL IKine"), "q"), {kQ1, kQ2, 0.25}, "IKine", 1e-8);
  const Tool there = tool_at(0.5, 0.6, 0.2);
  classic("PRobot arm LLRL mSetInHMT " + std::to_string(there.x) + " " + std::to_string(there.y) +
          " 0.2 0 0 1.1");
  compare(field(classic("PRobot arm LLRL mGetInHMT"), "position"), {there.x, there.y, 0.2},
          "mSetInHMT", 1e-6);
  // The same as a matrix, to all digits.
  std::string matrix;
  for (const double x : {std::cos(1.1), -std::sin(1.1), 0.0, there.x, std::sin(1.1), std::cos(1.1),
                         0.0, there.y, 0.0, 0.0, 1.0, 0.2, 0.0, 0.0, 0.0, 1.0}) {
    std::array<char, 40> digits{};
    std::snprintf(digits.data(), digits.size(), " %.17g", x);
    matrix += digits.data();
  }
  classic("PRobot arm LLRL mSetInHMT" + matrix);
  compare(field(classic("PRobot arm LLRL IKine"), "q"), {0.5, 0.6, 0.2}, "IKine", 1e-8);
  compare(field(classic("PRobot arm LLRL IKine" + matrix), "q"), {0.5, 0.6, 0.2}, "IKine", 1e-8);
  expect("PRobot arm FollowTarget", {0.5 / kDegree, 0.6 / kDegree, 0.2}, 1e-6);
}

TEST_F(ClassicAnswers, RowsOfLinksAreThoseOfTheFile) {
  expect("PRobot arm Link 1 vGetDHp", {0, kUpper, 0, 0, -120, 150, 10, -30, 0});
  expect("PRobot arm Link 3 vGetDHp", {0, 0, 0, 0, -1, 2, 0.05, 0.3, 1});
  call("robot.set_link", {{"id", "arm"}, {"link", 1}, {"alpha", 90 * kDegree}});
  compare(field(classic("PRobot arm mGetDHp"), "matrix"),
          {90, kUpper, 0, 0, 0, 0, kFore, 0, 0, 0, 0, 0, 0, 0, 1}, "mGetDHp");
  compare(field(classic("PRobot arm LLRL mGetDHp"), "matrix"),
          {90 * kDegree, kUpper, 0, 0, 0, 0, kFore, 0, 0, 0, 0, 0, 0, 0, 1}, "LLRL mGetDHp");
  expect("PRobot arm GetDOF", {3});
  EXPECT_EQ(classic("PRobot arm GetBaseType"), Value("Fixed"));
  const auto dynamics = numbers(at(classic("PRobot arm vGetDynamicp"), "matrix"));
  ASSERT_EQ(dynamics.size(), 45U);
  EXPECT_EQ(dynamics[30], kMass);
  const Numbers stand = numbers(classic("PObject stand vGetDynamicp"));
  ASSERT_EQ(stand.size(), 15U);
  const double m = 0.1 * 0.2 * 0.3 * 7850;
  EXPECT_NEAR(stand[0], m, 1e-9);
  EXPECT_NEAR(stand[4], m * (0.04 + 0.09) / 12, 1e-9);
}

TEST_F(ClassicAnswers, ListsCountFromOneAndSayTheirRange) {
  EXPECT_EQ(classic("Worlds GetWorldId 1"), Value("cell"));
  EXPECT_EQ(classic("Worlds GetWorldId 2"), Value("bench"));
  expect("Worlds GetWorldIndex bench", {2});
  EXPECT_EQ(classic("World bench GetPObjectId 1"), Value("stand"));
  EXPECT_EQ(classic("World bench GetPRobotId 1"), Value("arm"));
  EXPECT_EQ(classic("World bench GetPTrajectoryId 2"), Value("drive"));
  expect("World bench GetPRobotIndex arm", {1});
  expect("World bench GetPTrajectoryIndex drive", {2});
  expect("PTrajectory stroke GetNumGenPoints", {11});
  compare(field(classic("PTrajectory stroke GetGenPoint 1"), "time"), {0}, "first");
  const Value last = classic("PTrajectory stroke GetGenPoint 11");
  compare(field(last, "time"), {1}, "last");
  EXPECT_NEAR(field(last, "position")[2], 0.3, 1e-12);
  EXPECT_EQ(refused("World bench GetPTrajectoryId 0"),
            "world \"bench\", index: there is no trajectory 0. There are 2, "
            "numbered from 1 to 2.");
  EXPECT_EQ(refused("Worlds GetWorldId 3"),
            "world.name_at, index: there is no world 3. There are 2, numbered from 1 to 2.");
  EXPECT_EQ(refused("PTrajectory stroke GetGenPoint 12"),
            "trajectory.point, index: there is no point 12. There are 11, numbered from 1 to 11.");
  // The commands themselves count from 0, as before.
  EXPECT_EQ(call("world.trajectory_name", {{"id", "bench"}, {"index", 0}}), Value("stroke"));
}

TEST_F(ClassicAnswers, AWorldNeedsNoNameAndNounsMayHaveTheirPrefix) {
  const Value made = classic("IOIC::Worlds Create");
  EXPECT_EQ(classic("ioic::worlds GetActiveWorld"), made);
  EXPECT_EQ(classic("IOIC::Worlds GetWorldId 3"), Value("world"));
  classic("Worlds Create");
  EXPECT_NE(classic("Worlds GetWorldId 4"), Value("world"));
  expect("IOIC::PRobot arm GetDOF", {3});
  EXPECT_EQ(classic("World bench GetPRobotIdDesc \"two and\""), Value("arm"));
}

TEST_F(ClassicAnswers, TheToolIsShownPointByPoint) {
  const auto shown = [&](const std::string& line, int point, double time, double slide) {
    const Value v = classic(line);
    compare(field(v, "point"), {static_cast<double>(point)}, line);
    compare(field(v, "time"), {time}, line);
    compare(field(v, "q"), {30, 45, slide}, line, 1e-6);
    compare(numbers(classic("PRobot arm LLRL mGetInJointp")), {kQ1, kQ2, slide}, line, 1e-8);
  };
  shown("World bench InvKineFinalPoint arm stroke", 11, 1, 0.3);
  shown("World bench InvKinePrevPoint arm stroke", 10, 0.9, 0.28);
  shown("World bench InvKineFirstPoint arm stroke", 1, 0, 0.1);
  shown("World bench InvKineNextPoint arm stroke", 2, 0.1, 0.12);
  shown("World bench InvKineNextPoint arm stroke", 3, 0.2, 0.14);
  shown("World bench InvKinePrevPoint arm stroke", 2, 0.1, 0.12);
  // Put there by hand, it goes on from there.
  classic("PRobot arm SetLinks 30 45 0.2");
  shown("World bench InvKineNextPoint arm stroke", 7, 0.6, 0.22);
  classic("PRobot arm SetLinks 30 45 0.21");
  EXPECT_NE(refused("World bench InvKineNextPoint arm stroke").find("not at a point"),
            std::string::npos);
  classic("World bench InvKineFinalPoint arm stroke");
  EXPECT_NE(refused("World bench InvKineNextPoint arm stroke").find("the last of its 11 points"),
            std::string::npos);
}

TEST_F(ClassicAnswers, RunsMeetWhatGravityAndTheLineSay) {
  for (const char* line :
       {"World bench InvKineWorldSim arm stroke", "World bench WorldInvKineSim arm stroke",
        "World bench InvKineWorldSim arm stroke TIME_DELAY_OFF 0",
        "World bench InvKineWorldSim arm stroke TIME_DELAY_ON 2"}) {
    const Value run = classic(line);
    const auto t = column(run, "time"), q1 = column(run, "q1"), q3 = column(run, "q3"),
               qd3 = column(run, "qd3");
    ASSERT_EQ(t.size(), 11U) << line;
    for (std::size_t i = 0; i < t.size(); ++i) {
      EXPECT_NEAR(q1[i], kQ1, 1e-8) << line;
      EXPECT_NEAR(q3[i], 0.1 + 0.2 * t[i], 1e-8) << line;
      EXPECT_NEAR(qd3[i], 0.2, 1e-8) << line;
    }
  }
  EXPECT_TRUE(told("TIME_DELAY_ON changes nothing"));
  EXPECT_TRUE(told("KineType 2 chooses nothing"));
  for (const char* line :
       {"World bench InvDynWorldSim arm stroke", "World bench WorldInvDynSim arm stroke",
        "World bench WorldSimulate arm stroke",
        "World bench InvDynWorldSim arm stroke TIME_DELAY_OFF 1"})
    for (const double tau : column(classic(line), "tau3"))
      EXPECT_NEAR(tau, kMass * kGravity, 1e-8) << line;
  EXPECT_TRUE(told("TauOption 1 chooses nothing"));
  EXPECT_NE(refused("World bench InvKineWorldSim arm stroke TIME_DELAY_OFF 0 more"), "");

  const Value rows = classic("World bench ComputeBaseTjc arm stroke");
  ASSERT_EQ(rows.as_array()->rows(), 11U);
  EXPECT_NEAR(rows.as_array()->data()[7 * 5 + 3], 0.2, 1e-12);
}

TEST_F(ClassicAnswers, ForwardDynamicsFallsOrIsHeldByTheTorquesOfAFile) {
  const auto falls = [&](const std::string& line, double v) {
    const Value run = classic(line);
    const auto t = column(run, "time"), q3 = column(run, "q3");
    ASSERT_EQ(t.size(), 21U) << line;
    for (std::size_t i = 0; i < t.size(); ++i)
      EXPECT_NEAR(q3[i], 0.1 + v * t[i] - kGravity * t[i] * t[i] / 2, 1e-9) << line;
  };
  falls("World bench FwdDynWorldSim arm 0.2 0 0 0.5", 0.5);
  falls("World bench FwdDynWorldSim arm 0.2 {0 0 0.5} runge_kutta4 0.001", 0.5);
  falls("World bench FwdDynWorldSim arm 0.2 {0 0 0.5} TIME_DELAY_OFF runge_kutta4 0.001 0", 0.5);
  std::ofstream("hold.plot") << "#3\n# time tau1 tau2 tau3\n0 0 0 " << kMass * kGravity
                             << "\n1 0 0 " << kMass * kGravity << "\n";
  for (const char* line :
       {"World bench FwdDynWorldSim arm 0.2 0 0 0.1 runge_kutta4 0.001 hold.plot",
        "World bench FwdDynWorldSim arm 0.2 {0 0 0.1} TIME_DELAY_ON runge_kutta4 0.001 1 hold.plot",
        "World bench WorldfDynSim arm hold.plot 0.2"}) {
    const Value run = classic(line);
    const auto t = column(run, "time"), q3 = column(run, "q3");
    const double v = std::string(line).find("fDynSim arm hold") == std::string::npos ? 0.1 : 0;
    for (std::size_t i = 0; i < t.size(); ++i) EXPECT_NEAR(q3[i], 0.1 + v * t[i], 1e-6) << line;
  }
  EXPECT_NE(refused("World bench FwdDynWorldSim arm 0.2 {0 0 0} 0 runge_kutta4 0.001 1")
                .find("the torque flag is 1"),
            std::string::npos);
  EXPECT_NE(refused("World bench FwdDynWorldSim arm 0.2 {0 0 0} 0 runge_kutta4 0.001 1 none.plot"),
            "");
  EXPECT_NE(refused("World bench FwdDynWorldSim arm 0.2 {0 0} 0 runge_kutta4 0.001 0")
                .find("qd has 2 numbers, but 3 are needed"),
            std::string::npos);
}

TEST_F(ClassicAnswers, ABaseFollowsATrajectoryOfItsOwn) {
  EXPECT_NE(refused("PRobot arm GetBaseTjcId").find("its base follows no trajectory"),
            std::string::npos);
  EXPECT_EQ(classic("PRobot arm AddBaseTjc drive"), Value("drive"));
  EXPECT_EQ(classic("PRobot arm GetBaseType"), Value("Free Flying"));
  EXPECT_EQ(classic("PRobot arm GetBaseTjcId"), Value("drive"));
  expect("PRobot arm GetBaseNumGen", {11});
  const Numbers way = numbers(classic("PRobot arm GetBaseTjc"));
  ASSERT_EQ(way.size(), 77U);
  EXPECT_NEAR(way[7 * 5 + 3], 0.05 * 0.25, 1e-12) << "a t^2 / 2 at 0.5 s";
  call("robot.set_base", {{"id", "arm"}, {"kind", "serpentine"}});
  EXPECT_EQ(classic("PRobot arm GetBaseType"), Value("Serpentine"));

  const Value run = classic("World bench InvDynWorldSim arm stroke");
  const auto t = column(run, "time"), q3 = column(run, "q3"), qd3 = column(run, "qd3"),
             qdd3 = column(run, "qdd3"), tau = column(run, "tau3"), z = column(run, "z");
  ASSERT_EQ(t.size(), 11U);
  for (std::size_t i = 0; i < t.size(); ++i) {
    EXPECT_NEAR(q3[i], 0.1 + 0.2 * t[i] - 0.05 * t[i] * t[i], 1e-8);
    EXPECT_NEAR(qd3[i], 0.2 - 0.1 * t[i], 1e-8);
    EXPECT_NEAR(qdd3[i], -0.1, 1e-8);
    EXPECT_NEAR(tau[i], kMass * kGravity, 1e-8) << "the tool does not accelerate in the world";
    EXPECT_NEAR(z[i], 0.1 + 0.2 * t[i], 1e-8);
  }
  // Free fall as seen from a base that rises with 0.1 m/s^2.
  const Value fall = classic("World bench FwdDynWorldSim arm 0.2 0 0 0");
  const auto s = column(fall, "time"), fallen = column(fall, "q3");
  for (std::size_t i = 0; i < s.size(); ++i)
    EXPECT_NEAR(fallen[i], 0.1 - (kGravity + 0.1) * s[i] * s[i] / 2, 1e-9);
  compare(field(classic("World bench InvKineFinalPoint arm stroke"), "q"), {30, 45, 0.25}, "last",
          1e-6);
  EXPECT_NE(
      fails("world.time_optimal", {{"id", "bench"}, {"robot", "arm"}, {"trajectory", "stroke"}})
          .sentence()
          .find("its base moves along \"drive\""),
      std::string::npos);
  // Saved and loaded, and taken away with its trajectory.
  classic("World bench Save bench.wld");
  EXPECT_NE(call("world.text", {{"id", "bench"}}).as_string()->find("drive"), std::string::npos);
  call("world.remove_member", {{"id", "bench"}, {"member", "drive"}});
  EXPECT_NE(refused("PRobot arm GetBaseTjcId"), "");
  app().document.clear();
  classic("Worlds Open bench.wld");
  EXPECT_EQ(classic("PRobot arm GetBaseTjcId"), Value("drive"));
  EXPECT_EQ(classic("PRobot arm GetBaseType"), Value("Serpentine"));
}

TEST_F(ClassicAnswers, ABaseMayTurnUnderARobotThatStaysWhereItIs) {
  // The base turns by 0.4 rad while the tool keeps its place: the first joint turns back.
  trajectory("turn", {0, 0, 0, 0, 0, 0}, {0, 0, 0, 0, 0, 0.4}, "constant_speed",
             {{"angular_speed", 0.4}});
  classic("PRobot arm AddBaseTjc turn");
  const Value run = classic("World bench InvKineWorldSim arm stroke");
  const auto t = column(run, "time"), q1 = column(run, "q1"), qd1 = column(run, "qd1"),
             qdd1 = column(run, "qdd1"), qd2 = column(run, "qd2");
  for (std::size_t i = 0; i < t.size(); ++i) {
    EXPECT_NEAR(q1[i], kQ1 - 0.4 * t[i], 1e-8);
    EXPECT_NEAR(qd1[i], -0.4, 1e-8);
    EXPECT_NEAR(qd2[i], 0, 1e-8);
    EXPECT_NEAR(qdd1[i], 0, 1e-7);
  }
}

TEST_F(ClassicAnswers, TransformsAreReadAndSetByEveryCode) {
  const auto get = [&](const std::string& element) {
    return numbers(classic("Transform stand Get " + element)).at(0);
  };
  call("world.create", {{"name", "last"}});  // the active world has no such member
  EXPECT_EQ(get("P2"), 1);
  classic("Transform bench.stand Set P1 1");
  classic("Transform stand Add P3 50cm");
  EXPECT_EQ(get("P1"), 1);
  EXPECT_EQ(get("P3"), 0.5);
  // Angles in degrees; roll-pitch-yaw turns about z by O1.
  classic("Transform stand Set O1 90");
  classic("Transform stand Add O1 -30");
  classic("Transform stand Set O3 20");
  const double c1 = std::cos(60 * kDegree), s1 = std::sin(60 * kDegree),
               c3 = std::cos(20 * kDegree), s3 = std::sin(20 * kDegree);
  const Numbers local{c1, -s1 * c3, s1 * s3, 1,   s1, c1 * c3, -c1 * s3, 1,
                      0,  s3,       c3,      0.5, 0,  0,       0,        1};
  const auto stays = [&](const char* after) {
    for (const char* line : {"Transform stand Get mLocal", "Transform stand Get mGlobal",
                             "Transform stand mLocal", "Transform stand mGlobal"})
      compare(field(classic(line), "pose"), local, std::string(line) + " after " + after);
  };
  stays("angles");
  const auto code = [&](const char* element, int value) {
    classic(std::string("Transform stand Set ") + element + " " + std::to_string(value));
    EXPECT_EQ(get(element), value);
    stays(element);
  };
  code("PType", 1);
  EXPECT_NEAR(get("P1"), std::sqrt(2), 1e-12);
  EXPECT_NEAR(get("P2"), 45, 1e-12);
  EXPECT_NEAR(get("P3"), 0.5, 1e-12);
  code("PType", 2);
  EXPECT_NEAR(get("P1"), 1.5, 1e-12);
  EXPECT_NEAR(get("P2"), 45, 1e-12);
  EXPECT_NEAR(get("P3"), std::acos(0.5 / 1.5) / kDegree, 1e-12);
  classic("Transform stand Add P2 45");
  compare(field(classic("Transform stand mLocal"), "position"), {0, std::sqrt(2), 0.5}, "turned");
  classic("Transform stand Add P2 -45");
  code("PType", 0);
  // Each orientation's own formula makes the same rotation of its three numbers.
  const auto turn = [](char axis, double degrees) {
    const double c = std::cos(degrees * kDegree), s = std::sin(degrees * kDegree);
    if (axis == 'x') return std::array<double, 9>{1, 0, 0, 0, c, -s, 0, s, c};
    if (axis == 'y') return std::array<double, 9>{c, 0, s, 0, 1, 0, -s, 0, c};
    return std::array<double, 9>{c, -s, 0, s, c, 0, 0, 0, 1};
  };
  const auto times = [](const std::array<double, 9>& a, const std::array<double, 9>& b) {
    std::array<double, 9> out{};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t k = 0; k < 3; ++k) out[3 * i + j] += a[3 * i + k] * b[3 * k + j];
    return out;
  };
  const struct {
    int otype;
    const char* axes;
  } kinds[] = {{0, "xyz"}, {1, "zxz"}, {2, "zyz"}, {3, "zyx"}};
  for (const auto& kind : kinds) {
    code("OType", kind.otype);
    const auto made = times(times(turn(kind.axes[0], get("O1")), turn(kind.axes[1], get("O2"))),
                            turn(kind.axes[2], get("O3")));
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        EXPECT_NEAR(made[3 * i + j], local[4 * i + j], 1e-12) << kind.axes;
    // Set as they are, they change nothing; set otherwise, they make what the formula makes.
    classic("Transform stand Set O2 " + std::to_string(get("O2")));
    classic("Transform stand Add O1 10");
    const auto more = times(times(turn(kind.axes[0], get("O1")), turn(kind.axes[1], get("O2"))),
                            turn(kind.axes[2], get("O3")));
    const Numbers pose = field(classic("Transform stand mLocal"), "pose");
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        EXPECT_NEAR(more[3 * i + j], pose[4 * i + j], 1e-12) << kind.axes;
    for (const char* back : {"OType 3", "O1 60", "O2 0", "O3 20"})
      classic(std::string("Transform stand Set ") + back);
    stays(kind.axes);
  }
  code("OType", 4);
  const double h1 = 30 * kDegree, h3 = 10 * kDegree;  // half the angles
  EXPECT_NEAR(get("O1"), std::cos(h1) * std::sin(h3), 1e-12);
  EXPECT_NEAR(get("O2"), std::sin(h1) * std::sin(h3), 1e-12);
  EXPECT_NEAR(get("O3"), std::sin(h1) * std::cos(h3), 1e-12);
  for (const char* set : {"O1 0", "O2 0", "O3 0.5"})
    classic(std::string("Transform stand Set ") + set);
  compare(field(classic("Transform stand mLocal"), "rpy"), {0, 0, 60 * kDegree}, "quaternion");
  EXPECT_NE(refused("Transform stand Set O1 0.9").find("longer than 1"), std::string::npos);
  EXPECT_NE(refused("Transform stand Set OType 5").find("4 quaternion"), std::string::npos);
  EXPECT_NE(refused("Transform stand Set PType 3").find("2 spherical"), std::string::npos);
  EXPECT_NE(refused("Transform stand Set RType 2").find("1 global"), std::string::npos);
  EXPECT_NE(refused("Transform stand Set P1 nan"), "");
}

TEST_F(ClassicAnswers, TheToolsTransformIsSeenLocallyOrGlobally) {
  EXPECT_EQ(classic("PRobot arm GetToolTransformId"), Value("arm.tool"));
  classic("Transform arm.tool Set P3 0.02");
  compare(field(classic("PRobot arm mGetToolHMT"), "position"), {0, 0, 0.02}, "mGetToolHMT");
  const Tool home = tool_at(10 * kDegree, 20 * kDegree, 0.05);
  compare(field(classic("Transform arm.tool Get mGlobal"), "position"), {home.x, home.y, 0.07},
          "mGlobal");
  classic("Transform arm.tool Set RType 1");
  expect("Transform arm.tool Get RType", {1});
  expect("Transform arm.tool Get P1", {home.x});
  expect("Transform arm.tool Get P3", {0.07});
  expect("Transform arm.tool Get O1", {30});
  classic("Transform arm.tool Add P3 0.01");
  compare(field(classic("Transform arm.tool Get mLocal"), "position"), {0, 0, 0.03}, "mLocal");
  classic("Transform arm.tool Set RType 0");
  expect("Transform arm.tool Get P3", {0.03});
  // A robot and a trajectory by their own names.
  classic("Transform arm Set P1 0.5");
  expect("Transform arm Get P1", {0.5});
  classic("Transform stroke Set P2 -0.5");
  expect("Transform bench.stroke Get P2", {-0.5});
}

}  // namespace
}  // namespace robomosp::ioci
