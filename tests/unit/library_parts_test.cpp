// SPDX-License-Identifier: Apache-2.0
// Bodies of the library's robots and its parametric parts: that every moving link has a designed
// body and touches no other at home, that bodies follow lengths, and that motors, gears, bearings
// and profiles are what their catalogues say over all their sizes.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ioci/core/commands.h"
#include "lua/lua_state.h"
#include "support/library_robots.h"
#include "support/program.h"

namespace robomosp::lua {
namespace {

namespace fs = std::filesystem;

class LibraryParts : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    state_ = std::make_unique<LuaState>(app(), session_, LuaOptions{});
  }
  std::string eval(const std::string& code) {
    auto r = state_->eval(code);
    return r.ok() ? *r : r.error().sentence();
  }
  double number(const std::string& code) {
    const std::string answer = eval("string.format('%.17g', " + code + ")");
    std::istringstream in(answer.substr(answer.find_first_not_of('"')));
    double value = 0;
    EXPECT_TRUE(in >> value) << code << ": " << answer;
    return value;
  }
  ioci::Session session_{"test"};
  std::unique_ptr<LuaState> state_;
};

TEST_F(LibraryParts, EveryMovingLinkHasADesignedBody) {
  ASSERT_EQ(test::library_robots().size(), 23U);
  for (const std::string& name : test::library_robots()) {
    eval("missing = '' for _, l in ipairs(robot('" + name +
         "'):links()) do if l.joint ~= 'fixed' and #(l.parts or {}) == 0 then missing = missing .. "
         "' ' .. l.name end end");
    EXPECT_EQ(eval("missing"), "") << name << " has links without bodies";
    EXPECT_EQ(eval("robot('" + name + "'):skin().generated"), "false") << name;
  }
}

TEST_F(LibraryParts, NoRobotTouchesItselfAtHome) {
  for (const std::string& name : test::library_robots())
    EXPECT_EQ(eval("#robot('" + name + "'):self_collisions{}"), "0")
        << name << ": " << eval("robot('" + name + "'):self_collisions{}");
}

// The ends of a link stay at its joints, and what lies between slides together.
TEST_F(LibraryParts, BodiesFollowTheLengthsOfTheirRobots) {
  struct Row {
    std::string robot, parameter, link;
    double sign;  ///< of the near end's x in the link's frame
  };
  for (const Row& row :
       {Row{"ur5", "upper_arm_length", "shoulder_lift", 1},
        Row{"ur5", "forearm_length", "elbow", 1},
        Row{"ur10e", "upper_arm_length", "shoulder_lift", 1},
        Row{"ur10e", "forearm_length", "elbow", 1}, Row{"arm", "upper_arm_length", "link2", -1},
        Row{"twolink", "upper_length", "upper", -1}, Row{"twolink", "lower_length", "lower", -1},
        Row{"planar2rods", "upper_length", "upper", -1},
        Row{"planar2rods", "lower_length", "lower", -1}}) {
    const std::string r = "robot('" + row.robot + "')";
    const double was = number(r + ":parameters()." + row.parameter + ".value");
    for (const double factor : {0.7, 1.15}) {
      const double length = factor * was;
      eval(r + ":set_parameter('" + row.parameter + "', " + std::to_string(length) + ")");
      EXPECT_NEAR(number(r + ":link('" + row.link + "').a"), -row.sign * length, 1e-6)
          << row.robot << " " << row.link;
      EXPECT_NEAR(number(r + ":link('" + row.link + "').parts[2].placement.position[1]"),
                  row.sign * length, 1e-6)
          << row.robot << " " << row.link;
      EXPECT_EQ(eval("#" + r + ":self_collisions{}"), "0") << row.robot << " " << factor;
    }
  }
}

// Data sheets of the IRB 140 and the KR 5 arc: 98 and 127 kg.
TEST_F(LibraryParts, RobotsWithoutPublishedMassesWeighWhatTheirDataSheetsSay) {
  EXPECT_NEAR(number("robot('irb140'):mass{}.mass"), 98, 0.02 * 98);
  EXPECT_NEAR(number("robot('kr5'):mass{}.mass"), 127, 0.02 * 127);
}

/// A part with values of its parameters, and the mass that a catalogue has for it [kg].
struct Entry {
  std::string set;  ///< "length=80 mm,nema=34", in the order they are set
  double mass, within;
};

void expect_masses(const std::function<double(const std::string&)>& number,
                   const std::function<std::string(const std::string&)>& eval,
                   const std::string& part, const std::vector<Entry>& entries) {
  for (const Entry& e : entries) {
    eval("p = solid.duplicate{id = solid('" + part + "')}");
    std::istringstream in(e.set);
    for (std::string each; std::getline(in, each, ',');) {
      const auto at = each.find('=');
      EXPECT_EQ(eval("p:set_parameter('" + each.substr(0, at) + "', '" + each.substr(at + 1) +
                     "') return 'ok'"),
                "ok")
          << part << " " << e.set;
    }
    EXPECT_NEAR(number("p:mass().mass"), e.mass, e.within * e.mass) << part << " " << e.set;
    EXPECT_EQ(eval("p:mesh_info{}.triangles > 0"), "true") << part << " " << e.set;
  }
}

// NEMA 17: AKT 42HS series; NEMA 23: Trinamic QSH5718; NEMA 34: Trinamic QSH8618, manual V1.08,
// table 2.1 (flange 85.85 mm, shaft 12.7 mm in diameter and 31.75 mm long). Data sheets.
TEST_F(LibraryParts, StepperMotorsWeighWhatTheirDataSheetsSay) {
  expect_masses([&](const auto& c) { return number(c); }, [&](const auto& c) { return eval(c); },
                "stepper_motor",
                {{"length=28 mm", 0.18, 0.15},
                 {"length=34 mm", 0.25, 0.15},
                 {"length=40 mm", 0.30, 0.15},
                 {"length=45 mm", 0.34, 0.15},
                 {"nema=23,length=41 mm", 0.50, 0.15},
                 {"nema=23,length=55 mm", 0.70, 0.15},
                 {"nema=23,length=78.5 mm", 1.00, 0.15},
                 {"length=80 mm,nema=34", 2.3, 0.15},
                 {"length=65 mm,nema=34", 1.7, 0.15},
                 {"length=96 mm,nema=34", 2.8, 0.15},
                 {"length=118 mm,nema=34", 3.8, 0.15},
                 {"length=156 mm,nema=34", 5.4, 0.18}});
  eval(
      "m = solid.duplicate{id = solid('stepper_motor')} m:set_parameter('length', '80 mm') "
      "m:set_parameter('nema', 34)");
  EXPECT_NEAR(number("m:parameters().flange.value"), 0.08585, 1e-12);
  EXPECT_NEAR(number("m:parameters().shaft.value"), 0.0127, 1e-12);
  EXPECT_NEAR(number("m:parameters().shaft_length.value"), 0.03175, 1e-12);
  EXPECT_NE(eval("solid('stepper_motor'):set_parameter('nema', 42)").find("must be greater than 0"),
            std::string::npos)
      << eval("solid('stepper_motor'):set_parameter('nema', 42)");
}

// Yaskawa SGM-01 (40 mm flange), SGMAH-02, -04 (60 mm) and -08 (80 mm): manuals.
TEST_F(LibraryParts, ServoMotorsWeighWhatTheirManualsSay) {
  expect_masses([&](const auto& c) { return number(c); }, [&](const auto& c) { return eval(c); },
                "servo_motor",
                {{"length=94.5 mm,flange=40 mm", 0.5, 0.15},
                 {"", 1.1, 0.15},
                 {"length=124.5 mm", 1.7, 0.15},
                 {"length=145 mm,flange=80 mm", 3.4, 0.15}});
}

// Typical masses of component sets of these sizes; no catalogue was at hand.
TEST_F(LibraryParts, StrainWaveGearsWeighWhatSuchSetsDo) {
  expect_masses([&](const auto& c) { return number(c); }, [&](const auto& c) { return eval(c); },
                "strain_wave_gear",
                {{"size=14", 0.09, 0.2},
                 {"size=17", 0.15, 0.2},
                 {"size=20", 0.28, 0.2},
                 {"size=25", 0.42, 0.2},
                 {"size=32", 0.89, 0.2}});
}

// With one stage of 60 and 80 mm as Neugart PLE; the others are typical masses.
TEST_F(LibraryParts, PlanetaryGearsWeighWhatSuchGearsDo) {
  expect_masses([&](const auto& c) { return number(c); }, [&](const auto& c) { return eval(c); },
                "planetary_gear",
                {{"size=40", 0.35, 0.15},
                 {"", 0.9, 0.15},
                 {"size=80", 2.1, 0.15},
                 {"size=120", 6.0, 0.15},
                 {"stages=2", 1.1, 0.15},
                 {"size=80,stages=2", 2.6, 0.15}});
}

// Boundary dimensions of ISO 15; masses of the SKF catalogue.
TEST_F(LibraryParts, BallBearingsHaveTheSizesOfIso15AndTheMassesOfTheirCatalogue) {
  struct Row {
    int number;
    double bore, outer, width, mass;  ///< [mm], [kg]
  };
  for (const Row& row :
       {Row{6000, 10, 26, 8, 0.019}, Row{6001, 12, 28, 8, 0.021}, Row{6002, 15, 32, 9, 0.030},
        Row{6003, 17, 35, 10, 0.038}, Row{6004, 20, 42, 12, 0.067}, Row{6005, 25, 47, 12, 0.078},
        Row{6006, 30, 55, 13, 0.12}, Row{6007, 35, 62, 14, 0.15}, Row{6008, 40, 68, 15, 0.19}}) {
    eval("b = solid.duplicate{id = solid('ball_bearing')} b:set_parameter('number', " +
         std::to_string(row.number) + ")");
    EXPECT_NEAR(number("b:parameters().bore.value"), 1e-3 * row.bore, 1e-12) << row.number;
    EXPECT_NEAR(number("b:parameters().outer.value"), 1e-3 * row.outer, 1e-12) << row.number;
    EXPECT_NEAR(number("b:parameters().width.value"), 1e-3 * row.width, 1e-12) << row.number;
    EXPECT_NEAR(number("b:mass().mass"), row.mass, 0.1 * row.mass) << row.number;
    // Its frame is in the middle.
    EXPECT_NEAR(number("b:mass().com[3]"), 0, 1e-9) << row.number;
  }
  EXPECT_NE(eval("b:set_parameter('number', 6009)").find("ball is 0"), std::string::npos);
}

// THK RB5013 and RB8016: catalogue 382-5E; those of 30 and 100 mm are typical masses.
TEST_F(LibraryParts, CrossedRollerBearingsWeighWhatSuchBearingsDo) {
  expect_masses([&](const auto& c) { return number(c); }, [&](const auto& c) { return eval(c); },
                "crossed_roller_bearing",
                {{"bore=30 mm,outer=55 mm,width=10 mm", 0.12, 0.1},
                 {"", 0.27, 0.1},
                 {"outer=120 mm,bore=80 mm,width=16 mm", 0.7, 0.1},
                 {"outer=150 mm,bore=100 mm,width=20 mm", 1.45, 0.1}});
}

// Profiles of these sizes typically weigh 0.40 to 0.50, 0.80 to 1.0 and 1.45 to 1.8 kg/m (Misumi
// HFS5-2020: 0.5; HFS8-4040: 1.73). Twice the length is twice the mass.
TEST_F(LibraryParts, ProfilesWeighWhatSuchProfilesDoAMetre) {
  struct Row {
    std::string part;
    double least, most;
  };
  for (const Row& row :
       {Row{"profile_20", 0.40, 0.50}, Row{"profile_30", 0.80, 1.0}, Row{"profile_40", 1.45, 1.8}})
    for (const double length : {0.001, 1.0, 6.0}) {
      eval("q = solid.duplicate{id = solid('" + row.part + "')} q:set_parameter('length', " +
           std::to_string(length) + ")");
      const double mass = number("q:mass().mass") / length;
      EXPECT_GT(mass, row.least) << row.part << " " << length;
      EXPECT_LT(mass, row.most) << row.part << " " << length;
    }
}

}  // namespace
}  // namespace robomosp::lua
