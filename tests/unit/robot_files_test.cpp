// SPDX-License-Identifier: Apache-2.0
// Robots from URDF, MJCF and SDF and out as URDF. Expected poses, masses and inertias are closed
// forms written out here; damaged files must end as sentences.
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>

#include <gtest/gtest.h>
#include <robomosp/sdk/dynamics.h>

#include "robot_files/read.h"
#include "robotics/build_model.h"
#include "robotics/coordinates.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "spatial/pose.h"
#include "support/robot_files.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using robot_files::Options;
using robot_files::read_robot;
using test::unwrap;

using test::RobotFiles;

constexpr const char* kArm = R"(<robot name="arm">
  <material name="steel"><color rgba="0.6 0.6 0.7 1"/></material>
  <link name="ground"><visual><geometry><box size="1 1 0.2"/></geometry></visual></link>
  <link name="upper">
    <inertial><origin xyz="0 0 0.5" rpy="0 0 1.5707963267948966"/><mass value="3"/>
      <inertia ixx="1" iyy="2" izz="3" ixy="0.1" ixz="0.2" iyz="0.3"/></inertial>
    <visual><origin xyz="0 0 0.5"/><geometry><cylinder radius="0.1" length="1"/></geometry>
      <material name="steel"/></visual>
  </link>
  <link name="slider"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0"
    ixz="0" iyz="0"/></inertial></link>
  <link name="follower"/>
  <joint name="turn" type="revolute"><parent link="ground"/><child link="upper"/>
    <origin xyz="0 0 0.1" rpy="0 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="1" effort="50" velocity="3"/>
    <dynamics damping="0.5" friction="0.25"/></joint>
  <joint name="late" type="continuous"><parent link="slider"/><child link="follower"/>
    <axis xyz="1 0 0"/><mimic joint="turn" multiplier="-2" offset="0.5"/></joint>
  <joint name="slide" type="prismatic"><parent link="upper"/><child link="slider"/>
    <origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 0 2"/>
    <limit lower="0" upper="0.4" effort="0" velocity="1"/></joint>
</robot>)";

TEST_F(RobotFiles, NothingIsGeneratedInPlaceOfWhatTheFileLeavesBare) {
  const AnyId with_bodies = load(kArm);
  for (const model::Link& link : robot(with_bodies).links)
    EXPECT_EQ(link.visible, link.name == "upper") << link.name;
  std::string bare = kArm;
  for (std::size_t at; (at = bare.find("<visual>")) != std::string::npos;)
    bare.erase(at, bare.find("</visual>") + 9 - at);
  const AnyId without = load(bare);
  for (const model::Link& link : robot(without).links) EXPECT_TRUE(link.visible) << link.name;
}

TEST_F(RobotFiles, AUrdfHasItsPosesMassesAndLimits) {
  const AnyId id = load(kArm);
  const model::Robot& r = robot(id);
  ASSERT_EQ(r.links.size(), 3U);
  const RobotModel m = model_of(id);
  ASSERT_EQ(m.dof(), 2U);
  // (turn, slide): the slider is on the upper arm, which leans by 0.3 about y.
  const Pose at = tip(m, {0.3, 0.2});
  EXPECT_NEAR(at.p[0], std::sin(0.3) * 1.2, 1e-14);
  EXPECT_NEAR(at.p[1], 0, 1e-14);
  EXPECT_NEAR(at.p[2], 0.1 + std::cos(0.3) * 1.2, 1e-14);
  const model::Link& upper = r.links[0];
  EXPECT_EQ(upper.name, "upper");
  EXPECT_EQ(upper.lower, -2);
  EXPECT_EQ(upper.upper, 1);
  EXPECT_EQ(upper.max_force, 50);
  EXPECT_EQ(upper.drive.viscous, 0.5);
  EXPECT_EQ(upper.drive.coulomb_negative, -0.25);
  // Turned by 90 degrees about z: x' = y, y' = -x, so Ixx' = Iyy, Ixy' = -Ixy, Ixz' = -Iyz.
  ASSERT_TRUE(upper.given);
  EXPECT_NEAR(upper.given->inertia.xx, 2, 1e-14);
  EXPECT_NEAR(upper.given->inertia.yy, 1, 1e-14);
  EXPECT_NEAR(upper.given->inertia.xy, -0.1, 1e-14);
  EXPECT_NEAR(upper.given->inertia.xz, -0.3, 1e-14);
  EXPECT_NEAR(upper.given->inertia.yz, 0.2, 1e-14);
  EXPECT_EQ(upper.given->com[2], 0.5);
  // An effort of 0 is none; the axis is a unit vector.
  EXPECT_TRUE(std::isinf(r.links[1].max_force));
  EXPECT_NE(notes.find("force of joint \"slide\" is 0"), std::string::npos) << notes;
  EXPECT_EQ(r.links[1].axis[2], 1);
  ASSERT_TRUE(r.links[2].mimic);
  EXPECT_EQ(r.links[2].mimic->link, 0);
  EXPECT_EQ(r.links[2].mimic->ratio, -2);
  EXPECT_EQ(r.base_parts.size(), 1U);
  EXPECT_EQ(r.links[0].parts.size(), 1U);
}

// The base of the Panda in franka_description: 0.629769 kg. A frame turned by 90 degrees about x
// has y' = z and z' = -y, so Iyy' = Izz, Izz' = Iyy, Iyz' = -Iyz, Ixy' = -Ixz and Ixz' = Ixy.
TEST_F(RobotFiles, TheRootOfAUrdfKeepsItsMassWithAndWithoutBodies) {
  const char* const kInertial =
      "<inertial><origin xyz=\"-0.041018 -0.00014 0.049974\" rpy=\"1.5707963267948966 0 0\"/>"
      "<mass value=\"0.629769\"/><inertia ixx=\"0.00315\" iyy=\"0.00388\" izz=\"0.004285\" "
      "ixy=\"8.2904e-07\" ixz=\"0.00015\" iyz=\"8.2299e-06\"/></inertial>";
  for (const bool has_bodies : {true, false}) {
    std::string text = kArm;
    const std::string ground = "<link name=\"ground\">";
    text.insert(text.find(ground) + ground.size(), kInertial);
    for (std::size_t at; !has_bodies && (at = text.find("<visual>")) != std::string::npos;)
      text.erase(at, text.find("</visual>") + 9 - at);
    const AnyId id = load(text);
    const model::Robot& r = robot(id);
    ASSERT_TRUE(r.base_mass) << has_bodies;
    EXPECT_EQ(notes.find("mass of the root"), std::string::npos) << notes;
    EXPECT_EQ(r.base_mass->mass, 0.629769);
    EXPECT_EQ(r.base_mass->com[0], -0.041018);
    EXPECT_NEAR(r.base_mass->inertia.xx, 0.00315, 1e-16);
    EXPECT_NEAR(r.base_mass->inertia.yy, 0.004285, 1e-16);
    EXPECT_NEAR(r.base_mass->inertia.zz, 0.00388, 1e-16);
    EXPECT_NEAR(r.base_mass->inertia.xy, -0.00015, 1e-16);
    EXPECT_NEAR(r.base_mass->inertia.xz, 8.2904e-07, 1e-16);
    EXPECT_NEAR(r.base_mass->inertia.yz, -8.2299e-06, 1e-16);
    NoProgress progress;
    const auto standing =
        unwrap(bench.derived.standing_mass(*bench.document.now(), RobotId{id.number}, progress));
    ASSERT_TRUE(standing);
    EXPECT_EQ(standing->mass, 0.629769);
    EXPECT_EQ(standing->com[2], 0.049974);
  }
}

// In the two other formats what stands is a body of its own, with the same mass.
TEST_F(RobotFiles, WhatStandsHasItsMassInEveryFormat) {
  const char* const kMjcf =
      "<mujoco><worldbody><body name=\"foot\"><inertial pos=\"0 0 0.1\" mass=\"0.63\" "
      "diaginertia=\"0.003 0.004 0.005\"/><geom type=\"box\" size=\"0.1 0.1 0.1\"/>"
      "<body name=\"arm\"><joint name=\"turn\"/><inertial pos=\"0 0 0\" mass=\"2\" "
      "diaginertia=\"1 1 1\"/></body></body></worldbody></mujoco>";
  const char* const kSdf =
      "<sdf version=\"1.7\"><model name=\"m\"><link name=\"foot\"><inertial><pose>0 0 0.1 0 0 "
      "0</pose>"
      "<mass>0.63</mass><inertia><ixx>0.003</ixx><iyy>0.004</iyy><izz>0.005</izz></inertia></"
      "inertial>"
      "<visual name=\"v\"><geometry><box><size>0.2 0.2 0.2</size></box></geometry></visual></link>"
      "<link name=\"arm\"><inertial><mass>2</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz>"
      "</inertia></inertial></link>"
      "<joint name=\"hold\" type=\"fixed\"><parent>world</parent><child>foot</child></joint>"
      "<joint name=\"turn\" type=\"revolute\"><parent>foot</parent><child>arm</child>"
      "<axis><xyz>0 0 1</xyz></axis></joint></model></sdf>";
  for (const char* text : {kMjcf, kSdf}) {
    const AnyId id = load(text);
    NoProgress progress;
    const auto standing =
        unwrap(bench.derived.standing_mass(*bench.document.now(), RobotId{id.number}, progress));
    ASSERT_TRUE(standing) << text;
    EXPECT_NEAR(standing->mass, 0.63, 1e-15) << text;
    EXPECT_NEAR(standing->com[2], 0.1, 1e-15) << text;
    EXPECT_NEAR(standing->inertia.zz, 0.005, 1e-15) << text;
  }
}

TEST_F(RobotFiles, WhatIsNoRobotIsRefusedWithASentence) {
  EXPECT_NE(fault("<robot xmlns:xacro=\"x\"><xacro:macro name=\"a\"/></robot>").find("xacro"),
            std::string::npos);
  EXPECT_NE(
      fault("<robot name=\"a\"><link name=\"a\"/><link name=\"b\"/></robot>").find("several trees"),
      std::string::npos);
  EXPECT_NE(fault("<html/>").find("not a robot's file"), std::string::npos);
  EXPECT_NE(fault("<robot name=\"a\"><link name=\"a\"/></robot>").find("nothing moves"),
            std::string::npos);
  EXPECT_NE(
      fault("<robot><link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"fixed\">"
            "<parent link=\"a\"/><child link=\"b\"/><origin xyz=\"0 nan 0\"/></joint></robot>")
          .find("not a number"),
      std::string::npos);
  std::string deep;
  for (int i = 0; i < 5000; ++i) deep += "<body>";
  EXPECT_NE(fault("<mujoco><worldbody>" + deep).find("nested deeper"), std::string::npos);
  // Looking for doubled ones among these would take minutes.
  std::string attributes;
  for (int i = 0; i < 300'000; ++i) attributes += " a" + std::to_string(i) + "='>\"'";
  const std::string many = fault("<robot>\n<!-- \"<x a='1' -->\n<link" + attributes + "/></robot>");
  EXPECT_NE(many.find("more than 1000 attributes"), std::string::npos) << many;
  EXPECT_NE(many.find("line 3"), std::string::npos) << many;
}

constexpr const char* kMjcf = R"(<mujoco model="swing">
  <compiler angle="degree" eulerseq="zyx"/>
  <default><geom density="500"/><joint damping="0.1"/>
    <default class="light"><geom density="100"/></default></default>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="arm" pos="0 0 1" euler="90 0 0">
      <joint name="a" axis="0 1 0" pos="0 0 0.2" range="-90 45"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.6" size="0.05"/>
      <body name="hand" pos="0 0 -0.6" childclass="light">
        <joint name="b" type="slide" axis="0 0 1" range="0 0.2"/>
        <geom type="box" size="0.1 0.2 0.3"/>
        <geom type="ellipsoid" size="0.1 0.2 0.3" mass="0"/>
      </body>
      <body name="ball" pos="0 0 -0.3"><joint name="c" type="ball"/>
        <inertial pos="0 0 0" mass="2" fullinertia="1 2 3 0.1 0.2 0.3"/></body>
    </body>
  </worldbody>
  <actuator><motor joint="a" gear="10"/></actuator>
  <equality><connect name="pin" body1="hand" body2="ball" anchor="0 0 0.1"/></equality>
</mujoco>)";

TEST_F(RobotFiles, AnMjcfHasItsPosesAndTheMassesOfItsGeoms) {
  const AnyId id = load(kMjcf);
  const model::Robot& r = robot(id);
  const RobotModel m = model_of(id);
  ASSERT_EQ(m.dof(), 5U);
  const auto named = [&](std::string_view name) {
    for (std::size_t i = 0; i < r.links.size(); ++i)
      if (r.links[i].name == name) return i;
    ADD_FAILURE() << name;
    return std::size_t{0};
  };
  // The joint turns about a point 0.2 above the body: two links.
  ASSERT_EQ(r.links.size(), 4U);
  const double angle = 0.4, way = 0.05;
  std::vector<double> q{angle, way, 1, 0, 0, 0};
  std::vector<Pose> joints(m.joints.size()), links(r.links.size());
  robotics::forward_kinematics(m, q, joints);
  robotics::link_poses(robotics::link_frames(r), joints, links);
  // In the arm's frame at rest, turned by 90 degrees about z: x -> y. The hand's origin is 0.8
  // below the pivot, less the way that it slides up.
  const Pose hand = links[named("hand")];
  EXPECT_NEAR(hand.p[0], 0, 1e-14);
  EXPECT_NEAR(hand.p[1], -std::sin(angle) * (0.8 - way), 1e-14);
  EXPECT_NEAR(hand.p[2], 1.2 - std::cos(angle) * (0.8 - way), 1e-14);
  EXPECT_NEAR(r.links[named("a")].lower, -std::numbers::pi / 2, 1e-15);
  EXPECT_EQ(r.links[named("a")].drive.viscous, 0.1);
  EXPECT_FALSE(r.links[named("a")].passive);
  EXPECT_TRUE(r.links[named("hand")].passive);
  // Mass of the geoms: 500 kg/m^3 times pi r^2 l + 4/3 pi r^3.
  const double tube = std::numbers::pi * 0.05 * 0.05 * 0.6,
               caps = 4 * std::numbers::pi * 0.05 * 0.05 * 0.05 / 3;
  ASSERT_TRUE(r.links[named("arm")].given);
  EXPECT_NEAR(r.links[named("arm")].given->mass, 500 * (tube + caps), 1e-12);
  EXPECT_NEAR(r.links[named("arm")].given->com[2], -0.3, 1e-14);
  // A half ball's centre is 3/8 r from its disc, its inertia about that 83/320 m r^2.
  const double half = 500 * caps / 2, away = 0.3 + 3 * 0.05 / 8;
  EXPECT_NEAR(r.links[named("arm")].given->inertia.xx,
              500 * tube * (3 * 0.05 * 0.05 + 0.36) / 12 +
                  2 * half * (83.0 / 320 * 0.05 * 0.05 + away * away),
              1e-12);
  ASSERT_TRUE(r.links[named("hand")].given);
  EXPECT_NEAR(r.links[named("hand")].given->mass, 100 * 0.2 * 0.4 * 0.6, 1e-12);
  EXPECT_NEAR(r.links[named("hand")].given->inertia.zz, 4.8 * (0.04 + 0.16) / 12, 1e-12);
  // xx yy zz xy xz yz
  EXPECT_EQ(r.links[named("ball")].given->inertia.xz, 0.2);
  EXPECT_EQ(r.links[named("ball")].given->inertia.yz, 0.3);
  ASSERT_EQ(r.loops.size(), 1U);
  EXPECT_EQ(r.loops[0].kind, model::LoopKind::point);
  // The hand is 0.3 below the ball's body; the anchor 0.1 above the hand.
  EXPECT_NEAR(r.loops[0].in_b.position[2], -0.2, 1e-14);
  EXPECT_NE(notes.find("plane"), std::string::npos) << notes;
  EXPECT_NE(notes.find("gear"), std::string::npos) << notes;
}

constexpr const char* kSdf = R"(<sdf version="1.9"><model name="gate">
  <frame name="hinge" attached_to="post"><pose>0.1 0 0 0 0 0</pose></frame>
  <link name="post"><pose>0 0 1 0 0 0</pose><inertial><mass>4</mass></inertial></link>
  <link name="leaf"><pose relative_to="hinge">0.5 0 0 0 0 1.5707963267948966</pose>
    <inertial><mass>2</mass><pose>0 0 0.1 0 0 0</pose><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz>
    </inertia></inertial>
    <visual name="v"><geometry><box><size>1 0.1 1</size></box></geometry></visual></link>
  <joint name="fix" type="fixed"><parent>world</parent><child>post</child></joint>
  <joint name="swing" type="revolute"><pose relative_to="hinge"/><parent>post</parent>
    <child>leaf</child><axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>1</upper></limit>
    <dynamics><damping>0.3</damping></dynamics></axis></joint>
</model></sdf>)";

TEST_F(RobotFiles, AnSdfTurnsAboutTheFrameOfItsJoint) {
  const AnyId id = load(kSdf);
  const model::Robot& r = robot(id);
  const RobotModel m = model_of(id);
  ASSERT_EQ(m.dof(), 1U);
  EXPECT_EQ(r.links.back().name, "leaf");
  const Pose leaf = tip(m, {0.6});
  EXPECT_NEAR(leaf.p[0], 0.1 + 0.5 * std::cos(0.6), 1e-14);
  EXPECT_NEAR(leaf.p[1], 0.5 * std::sin(0.6), 1e-14);
  EXPECT_NEAR(leaf.p[2], 1, 1e-14);
  EXPECT_NEAR(leaf.R[0], std::cos(0.6 + std::numbers::pi / 2), 1e-14);
  EXPECT_EQ(m.joints[0].lower, -1);
  EXPECT_EQ(m.joints[0].friction.viscous, 0.3);
  EXPECT_NEAR(m.joints[0].body.mass, 2, 0);
}

/// Whether our own reader takes what the importer made.
Result<io::Loaded> loads(Imported made) {
  io::MemoryFiles files;
  for (ImportedGeometry& g : made.geometries)
    files.geometries.emplace(g.name, unwrap(io::make_geometry(std::move(g.geometry))));
  for (ImportedFile& f : made.records) files.texts.emplace(f.name, f.text);
  document::Document document;
  auto tx = document.begin("import");
  return io::load_memory(*tx, files, made.records.back().name, "test", {}, {});
}

constexpr const char* kNested = R"(<sdf version="1.8"><model name="cell" canonical_link="post">
  <link name="post"><inertial auto="true"/><collision name="c"><geometry><box><size>1 1 1</size>
  </box></geometry></collision></link><frame name="top" attached_to="post"><pose degrees="true">0 0
  1 0 0 90</pose></frame><model name="arm" placement_frame="end"><pose relative_to="top">0.2 0 0 0 0
  0</pose><link name="rod"/><frame name="end" attached_to="rod"><pose>0 0 1 0 0 0</pose></frame>
  </model><joint name="s" type="screw"><pose relative_to="top"/><parent>top</parent><child>arm::rod
  </child><screw_thread_pitch>0.1</screw_thread_pitch><axis><xyz expressed_in="top">0 1 0</xyz>
  </axis></joint><joint name="b" type="ball"><parent>arm</parent><child>post</child></joint>
</model></sdf>)";
constexpr const char* kCart = R"(<mujoco><compiler settotalmass="3" eulerseq="XYZ"/><default
  class="m"><default class="k"><joint range="-1 1"/></default></default><worldbody><body pos="0 0 1">
  <freejoint name="f"/><geom size="0.1"/><site name="s" pos="0 0 1"/><frame euler="1 2 3"><body
  name="b" childclass="k"><joint name="j"/><joint name="k" type="slide" ref="0.1"/><geom size="0.1"/>
  <site name="t"/></body></frame></body></worldbody><tendon><fixed name="p"><joint joint="j" coef="2"
  /></fixed></tendon><actuator><motor tendon="p" ctrlrange="-1 1"/></actuator><equality><connect
  site1="s" site2="t"/><joint joint1="k" joint2="j"/></equality><keyframe><key name="home" qpos="0 0
  1 1 0 0 0 0.1 0.2"/></keyframe></mujoco>)";

TEST_F(RobotFiles, DamagedFilesEndAsSentencesOrAsRecordsThatLoad) {
  std::mt19937 random(4);  // fixed seed, so that a failure can be repeated
  for (const char* whole : {kArm, kMjcf, kSdf, kNested, kCart}) {
    const std::string text = whole;
    for (int i = 0; i < 600; ++i) {
      std::string t = text;
      const int changes = 1 + static_cast<int>(random() % 4);
      for (int k = 0; k < changes && !t.empty(); ++k) {
        const std::size_t at = random() % t.size();
        switch (random() % 5) {
          case 0: t[at] = static_cast<char>(random()); break;
          case 1: t.erase(at, random() % 40); break;
          case 2: t.resize(at); break;
          case 3: t.insert(at, t.substr(random() % t.size(), random() % 60)); break;
          default: t.insert(at, std::array{"1e308", "-", "9", "inf", "<body>"}[random() % 5]);
        }
      }
      Options options;
      options.source = "damaged";
      auto made = read_robot(t, options);
      if (!made.ok()) {
        EXPECT_FALSE(made.error().message.empty());
        continue;
      }
      // Whatever is handed over is text that our own reader takes.
      const auto loaded = loads(std::move(*made));
      EXPECT_TRUE(loaded.ok()) << loaded.error().sentence() << "\n" << t;
    }
  }
}

/// A file may be refused in a sentence: scenes and parts stand beside robots. With a folder of your
/// own in ROBOMOSP_ROBOT_DATA the refusals are printed.
TEST_F(RobotFiles, PublishedRobotsLoad) {
  const char* given = std::getenv("ROBOMOSP_ROBOT_DATA");
  const fs::path data =
      given ? fs::path(given) : fs::path(ROBOMOSP_SOURCE_DIR) / "../shared/data/robots";
  if (!fs::is_directory(data)) GTEST_SKIP() << "no published robots here";
  std::size_t count = 0, refused = 0;
  for (const auto& entry : fs::recursive_directory_iterator(data)) {
    const std::string kind = entry.path().extension();
    if (kind != ".urdf" && kind != ".xml" && kind != ".sdf") continue;
    SCOPED_TRACE(entry.path().string());
    std::ifstream in(entry.path());
    std::stringstream text;
    text << in.rdbuf();
    Options options;
    options.folder = entry.path().parent_path();
    options.file = entry.path();
    options.source = entry.path().filename().string();
    auto made = read_robot(text.str(), options);
    if (!made.ok()) {
      EXPECT_FALSE(made.error().message.empty());
      if (given) std::printf("%s: %s\n", entry.path().c_str(), made.error().sentence().c_str());
      ++refused;
      continue;
    }
    for (const ForeignGeometry& f : made->foreign) EXPECT_TRUE(fs::is_regular_file(f.path));
    ++count;
    if (!made->foreign.empty()) continue;  // meshes are read by another plugin
    const auto loaded = loads(std::move(*made));
    EXPECT_TRUE(loaded.ok()) << loaded.error().sentence();
  }
  EXPECT_GT(count, 0U);
  if (!given) {
    EXPECT_EQ(refused, 0U);
  }
}

}  // namespace
}  // namespace robomosp
