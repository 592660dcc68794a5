// SPDX-License-Identifier: Apache-2.0
// The finer rules of MJCF and SDF on small files written for them: defaults, includes, notations,
// actuators, loops, nested models, frames of frames; and wrong files, each of which ends as one
// sentence that names file and line. Expected values are products of elementary rotations.
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include "robotics/coordinates.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "support/robot_files.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

struct RobotFormats : test::RobotFiles {
  void SetUp() override {
    folder = fs::temp_directory_path() / ("robomosp-formats-" + std::to_string(::getpid()));
    fs::create_directories(folder);
  }
  void TearDown() override { fs::remove_all(folder); }
  void file(const std::string& name, const std::string& text) const {
    fs::create_directories((folder / name).parent_path());
    std::ofstream(folder / name, std::ios::binary) << text;
  }
  static const model::Link& link(const model::Robot& r, std::string_view name) {
    for (const model::Link& l : r.links)
      if (l.name == name) return l;
    ADD_FAILURE() << "no link " << name;
    return r.links.front();
  }
  /// The world's pose of a link.
  Pose pose(AnyId id, std::string_view name, const std::vector<double>& q) {
    const model::Robot& r = robot(id);
    const RobotModel m = model_of(id);
    EXPECT_EQ(m.coordinate_count(), q.size());
    std::vector<Pose> joints(m.joints.size()), links(r.links.size());
    if (m.coordinate_count() != q.size()) return {};
    robotics::forward_kinematics(m, q, joints);
    robotics::link_poses(robotics::link_frames(r), joints, links);
    for (std::size_t i = 0; i < links.size(); ++i)
      if (r.links[i].name == name) return links[i];
    ADD_FAILURE() << "no link " << name;
    return {};
  }
  void told(const char* what) const {
    EXPECT_NE(notes.find(what), std::string::npos) << what << " in\n" << notes;
  }
};

void expect_near(const Pose& a, const Pose& b, double tolerance = 1e-14) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a.p[i], b.p[i], tolerance) << i;
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(a.R[i], b.R[i], tolerance) << i;
}
template <class... P>
Pose product(const Pose& first, const P&... rest) {
  Pose t = first;
  ((t = spatial::compose(t, rest)), ...);
  return t;
}
Pose shift(double x, double y, double z) { return spatial::translation({x, y, z}); }
using spatial::rotation_x;
using spatial::rotation_y;
using spatial::rotation_z;

// --- MJCF ----------------------------------------------------------------------------------------

TEST_F(RobotFormats, MjcfClassesAndIncludesGiveWhatTheyMean) {
  file("parts/defaults.xml", R"(<mujocoinclude><default class="top"><joint damping="0.5"/>
    <motor ctrlrange="-1 1"/>
    <default class="leg"><joint axis="0 1 0" range="-1 2" damping="0.3"/>
      <geom type="box" size="0.1 0.1 0.2" quat="0 1 0 0"/>
      <default class="foot"><joint type="slide" axis="0 0 1" range="-0.1 0.2"/></default></default>
    </default></mujocoinclude>)");
  // Named from the robot's file, though it stands in a folder.
  file("parts/leg.xml", R"(<mujocoinclude><body name="thigh" childclass="leg" pos="0.1 0 0"
    euler="0.3 0.2 0"><joint name="hip"/><inertial pos="0 0 -0.2" mass="2" diaginertia="1 1 1"/>
    <geom name="plate" euler="0 0 0.4" pos="0 0 0.1"/><include file="parts/foot.xml"/>
    </body></mujocoinclude>)");
  file("parts/foot.xml", R"(<mujocoinclude><body name="shin" pos="0 0 -0.5">
    <joint name="knee" class="foot"/><joint name="turn" class="top" ref="0.25" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></mujocoinclude>)");
  const AnyId id = load(R"(<mujoco model="cart">
    <compiler angle="radian" eulerseq="XYZ" settotalmass="14"/>
    <include file="parts/defaults.xml"/>
    <worldbody><body name="hull" pos="0 0 1"><freejoint name="float"/>
      <inertial pos="0 0 0" mass="4" diaginertia="1 2 3"/><include file="parts/leg.xml"/></body>
    </worldbody>
    <tendon><fixed name="both"><joint joint="knee" coef="0.5"/><joint joint="turn" coef="-2"/>
      </fixed><spatial name="rope"/></tendon>
    <actuator><motor joint="hip" gear="20"/><position joint="knee" forcerange="-7 6" kp="100"/>
      <motor tendon="both" ctrlrange="-3 2"/><general joint="hip" gainprm="5" ctrlrange="0 1"/>
      <adhesion body="shin"/></actuator>
    <keyframe><key name="ready" qpos="0.5 0 2 0 0 0 2  0.1 0.05 0.75"/></keyframe></mujoco>)");
  const model::Robot& r = robot(id);
  ASSERT_EQ(r.links.size(), 4U) << "hull, thigh, knee and shin";
  // Upper case: about axes that stay, x first.
  const std::vector<double> q{0, 0, 0, 1, 0, 0, 0, 0.7, 0.05, 0.6};
  const Pose thigh = product(shift(0.1, 0, 1), rotation_y(0.2), rotation_x(0.3), rotation_y(0.7));
  expect_near(pose(id, "thigh", q), thigh);
  expect_near(pose(id, "shin", q), product(thigh, shift(0, 0, -0.45), rotation_z(0.6)));
  EXPECT_EQ(link(r, "thigh").lower, -1);
  EXPECT_EQ(link(r, "thigh").upper, 2);
  EXPECT_EQ(link(r, "thigh").drive.viscous, 0.3);
  EXPECT_EQ(link(r, "knee").upper, 0.2);
  EXPECT_EQ(link(r, "knee").drive.viscous, 0.3) << "a class has what its parent has";
  EXPECT_EQ(link(r, "shin").drive.viscous, 0.5) << "the top class may have a name";
  EXPECT_TRUE(std::isinf(link(r, "shin").upper));
  // 7 kg become 14.
  EXPECT_NEAR(link(r, "hull").given->mass, 8, 1e-14);
  EXPECT_NEAR(link(r, "hull").given->inertia.zz, 6, 1e-14);
  EXPECT_NEAR(link(r, "shin").given->mass, 2, 1e-14);
  // hip: 20 * 1 of the default's range, and 5 * 1; knee: 7, and 0.5 * 3; turn: 2 * 3.
  EXPECT_NEAR(link(r, "thigh").max_force, 25, 1e-14);
  EXPECT_NEAR(link(r, "knee").max_force, 8.5, 1e-14);
  EXPECT_NEAR(link(r, "shin").max_force, 6, 1e-14);
  EXPECT_TRUE(link(r, "hull").passive);
  EXPECT_FALSE(link(r, "knee").passive);
  // The geom's own notation goes before that of its class.
  ASSERT_EQ(link(r, "thigh").parts.size(), 1U);
  const model::Placement& plate = link(r, "thigh").parts[0].placement;
  EXPECT_NEAR(plate.angles[2], 0.4, 1e-15);
  EXPECT_NEAR(plate.position[2], 0.1 - 0.2, 1e-15) << "boxes stand on their lower face here";
  // The free joint of the key is in the world there, at (0.5, 0, 2), turned by pi about z.
  ASSERT_EQ(r.poses.size(), 1U);
  EXPECT_EQ(r.poses[0].name, "ready");
  const std::vector<double> ready{0.5, 0, 1, 0, 0, 0, 1, 0.1, 0.05, 0.5};
  ASSERT_EQ(r.poses[0].q.size(), ready.size());
  for (std::size_t i = 0; i < ready.size(); ++i) EXPECT_NEAR(r.poses[0].q[i], ready[i], 1e-15);
  for (const char* what : {"<spatial> in <tendon>", "<adhesion> that drives no joint", "its ref",
                           "gear of the actuators of 1 joint"})
    told(what);
}

TEST_F(RobotFormats, MjcfEqualitiesBecomeLoopsAndFollowers) {
  const AnyId id = load(R"(<mujoco><compiler inertiagrouprange="0 1"/><worldbody>
    <site name="ground" pos="1 0 0" euler="0 0 90"/>
    <body name="a"><joint name="ja" axis="0 0 1" range="-10 10" limited="false"/>
      <geom size="0.1" density="300"/><geom size="0.2" group="4"/><frame pos="0 0.5 0">
      <site name="end" pos="0.2 0 0"/></frame></body>
    <body name="b" pos="0 1 0"><joint name="jb" axis="0 0 1"/><geom size="0.1" mass="3"/></body>
    <body name="c" pos="0 2 0"><joint name="jc" axis="0 0 1"/><geom size="0.1"/></body>
    </worldbody><equality>
    <connect name="pin" site1="end" site2="ground"/>
    <weld name="hold" body1="a" body2="b" anchor="0 0 0.1" relpose="0.3 0 0 1 0 0 0"/>
    <weld name="rest" body1="b" body2="c" anchor="0 0 0.2"/>
    <joint joint1="ja" joint2="jb" polycoef="0.2 -3 0 0 0"/>
    <connect name="off" body1="a" body2="c" anchor="0 0 0" active="false"/>
    <distance/></equality></mujoco>)");
  const model::Robot& r = robot(id);
  ASSERT_EQ(r.loops.size(), 3U);
  EXPECT_EQ(r.loops[0].kind, model::LoopKind::point);
  EXPECT_NEAR(r.loops[0].in_a.position[0], 0.2, 1e-15);
  EXPECT_NEAR(r.loops[0].in_a.position[1], 0.5, 1e-15);
  EXPECT_EQ(r.loops[0].link_b, -1);
  EXPECT_NEAR(r.loops[0].in_b.position[0], 1, 1e-15);
  EXPECT_EQ(r.loops[1].kind, model::LoopKind::weld);
  EXPECT_NEAR(r.loops[1].in_a.position[0], 0.3, 1e-15);
  EXPECT_NEAR(r.loops[1].in_b.position[2], 0.1, 1e-15);
  // As the file shows them: c is one above b in y.
  EXPECT_NEAR(r.loops[2].in_a.position[1], 1, 1e-15);
  EXPECT_NEAR(r.loops[2].in_a.position[2], 0.2, 1e-15);
  ASSERT_TRUE(link(r, "a").mimic);
  EXPECT_EQ(r.links[static_cast<std::size_t>(link(r, "a").mimic->link)].name, "b");
  EXPECT_EQ(link(r, "a").mimic->ratio, -3);
  EXPECT_EQ(link(r, "a").mimic->offset, 0.2);
  EXPECT_TRUE(std::isinf(link(r, "a").upper)) << "limited=false";
  const double ball = 4 * std::numbers::pi * 1e-3 / 3;
  EXPECT_NEAR(link(r, "a").given->mass, 300 * ball, 1e-13) << "group 4 has no mass";
  EXPECT_NEAR(link(r, "b").given->mass, 3, 1e-14);
  told("inactive <connect>");
  told("<distance> in <equality>");
}

TEST_F(RobotFormats, MjcfMeshesMayStandInTheFile) {
  // The corners of a box of 0.2 x 0.4 x 0.6, scaled; without faces it is their convex hull. A
  // mirrored pyramid has its faces.
  const AnyId id = load(R"(<mujoco><asset>
    <mesh name="block" scale="0.1 0.2 0.3" vertex="-1 -1 -1  1 -1 -1  -1 1 -1  1 1 -1
      -1 -1 1  1 -1 1  -1 1 1  1 1 1  0 0 0"/>
    <mesh name="peak" scale="-1 1 1" inertia="exact" vertex="0 0 0  .3 0 0  0 .3 0  0 0 .3"
      face="0 2 1  0 1 3  0 3 2  1 2 3"/></asset>
    <worldbody><body name="a"><joint/><geom type="mesh" mesh="block" density="500"/>
      <body name="b" pos="1 0 0"><joint type="slide"/><geom type="mesh" mesh="peak"/></body></body>
    </worldbody></mujoco>)");
  const model::Robot& r = robot(id);
  ASSERT_TRUE(link(r, "a").given && link(r, "b").given);
  const double mass = 500 * 0.2 * 0.4 * 0.6;
  EXPECT_NEAR(link(r, "a").given->mass, mass, 1e-12);
  EXPECT_NEAR(link(r, "a").given->inertia.xx, mass * (0.16 + 0.36) / 12, 1e-12);
  EXPECT_NEAR(link(r, "b").given->mass, 1000 * 0.027 / 6, 1e-12);
  EXPECT_NEAR(link(r, "b").given->com[0], -0.3 / 4, 1e-14);
  EXPECT_NEAR(link(r, "b").given->com[2], 0.3 / 4, 1e-14);
  ASSERT_EQ(link(r, "a").parts.size(), 1U);
  ASSERT_EQ(link(r, "b").parts.size(), 1U);
  NoProgress progress;
  const auto drawn =
      test::unwrap(bench.derived.mass(*bench.document.now(), link(r, "b").parts[0].what, progress));
  EXPECT_NEAR(drawn.volume, 0.027 / 6, 1e-12) << "the mirrored one is not inside out";
  EXPECT_EQ(notes.find("Left out"), std::string::npos) << notes;
  const auto wrong = [&](const std::string& mesh) {
    return fault("<mujoco><asset>\n<mesh name=\"m\" " + mesh +
                 "/></asset><worldbody><body><joint/><geom type=\"mesh\" mesh=\"m\"/></body>"
                 "</worldbody></mujoco>");
  };
  EXPECT_NE(wrong("vertex=\"0 0 0 1 0\"").find("line 2, <mesh>"), std::string::npos);
  EXPECT_NE(wrong("vertex=\"0 0 0 1 0 0 0 1 0 1 1 0\"").find("in a plane"), std::string::npos);
  for (const char* face : {"0 1 4", "0 1 -1", "0 1 0.5", "0 1 nan"})
    EXPECT_NE(wrong("vertex=\"0 0 0 1 0 0 0 1 0 0 0 1\" face=\"" + std::string(face) + "\"")
                  .find("line 2, <mesh>"),
              std::string::npos)
        << face;
}

TEST_F(RobotFormats, MjcfSaysWhatJointsHaveInAnyClassAndOfAnyKind) {
  file("classes.xml", R"(<mujocoinclude><default class="in"><default class="deep">
    <joint springdamper="0.1 1"/></default></default></mujocoinclude>)");
  load(R"(<mujoco><default><joint damping="1"/><default class="tail">
    <default class="tip"><joint springdamper="0.1 1" range="-15 15"/></default></default>
    <include file="classes.xml"/></default>
    <worldbody><body name="a"><joint name="loose" type="free"/>
      <geom size="0.1"/><body name="b"><joint name="ball" type="ball" armature="0.1"/>
      <geom size="0.1"/><body name="c"><joint name="still" type="ball" damping="0"/>
      <geom size="0.1"/></body></body><body name="d"><joint class="tip"/><geom size="0.1"/></body>
    </body><body name="e"><freejoint name="airy" align="true"/><geom size="0.1"/></body></worldbody></mujoco>)");
  told("springdamper of <joint> (2)");
  told("align of <freejoint>");
  told("\"loose\" is free: its damping was left out.");
  told("\"ball\" is spherical: its damping and motor inertia were left out.");
  EXPECT_EQ(notes.find("\"still\""), std::string::npos) << notes;
  EXPECT_EQ(notes.find("\"airy\""), std::string::npos) << "<freejoint> takes no defaults" << notes;
}

TEST_F(RobotFormats, MeshesOutOfReachAreNotSaidToBeMissing) {
  file("away/two.stl", "");
  const fs::path above = folder;
  folder /= "alone";  // neither a package nor a folder that robots are kept in
  fs::create_directories(folder);
  const std::string urdf_mesh =
      "<link name=\"b\"><visual><geometry><mesh filename=\"../away/two.stl\"/></geometry>"
      "</visual></link>";
  const std::string joint =
      "<joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/></joint>";
  load("<robot name=\"r\"><link name=\"a\"/>" + urdf_mesh + joint + "</robot>");
  told("outside the package");
  EXPECT_EQ(notes.find("not found"), std::string::npos) << notes;
  load(R"(<mujoco><asset><mesh name="m" file="../away/two.stl"/></asset><worldbody><body>
    <joint/><geom size="1"/><geom type="mesh" mesh="m"/></body></worldbody></mujoco>)");
  told("outside the package");
  EXPECT_EQ(notes.find("not found; its"), std::string::npos) << notes;
  load(R"(<sdf version="1.9"><model name="m"><link name="a"/><link name="b"><visual name="v">
    <geometry><mesh><uri>../away/two.stl</uri></mesh></geometry></visual></link>
    <joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz></axis>
    </joint></model></sdf>)");
  told("outside the package");
  EXPECT_EQ(notes.find("not found"), std::string::npos) << notes;
  // Many that are missing are one sentence.
  std::string many = "<robot name=\"r\"><link name=\"a\"/><link name=\"b\">";
  for (int i = 0; i < 12; ++i)
    many += "<visual><geometry><mesh filename=\"none" + std::to_string(i) +
            ".stl\"/></geometry></visual>";
  load(many + "</link>" + joint + "</robot>");
  told("12 meshes were not found, and their shapes were left out: \"none0.stl\"");
  told(" and 4 more.");
  folder = above;
}

// --- SDF -----------------------------------------------------------------------------------------

TEST_F(RobotFormats, SdfModelsInModelsStandWhereTheirFramesSay) {
  file("gripper/model.config",
       "<model><name>g</name><sdf version=\"1.4\">old.sdf</sdf>"
       "<sdf version=\"1.9\">new.sdf</sdf></model>");
  file("gripper/old.sdf", "<sdf version=\"1.4\"/>");
  file("gripper/new.sdf", R"(<sdf version="1.9"><model name="gripper">
    <frame name="flange"><pose>0 0 0.1 0 0 0</pose></frame>
    <link name="palm"><inertial><mass>2</mass></inertial><sensor name="s" type="imu"/></link>
    <link name="finger"><pose relative_to="slide"/></link>
    <joint name="slide" type="prismatic"><pose relative_to="palm">0 0 0.3 0 0 0</pose>
      <parent>palm</parent><child>finger</child><axis><xyz expressed_in="flange">1 0 0</xyz>
      <limit><lower>0</lower><upper>0.05</upper></limit></axis></joint></model></sdf>)");
  const AnyId id = load(R"(<sdf version="1.9"><world name="w"><model name="floor">
    <static>true</static><link name="l"/></model><model name="cell">
    <link name="post"/><joint name="foot" type="fixed"><parent>world</parent><child>post</child>
    </joint>
    <frame name="top" attached_to="post"><pose degrees="true">0 0 1 0 0 90</pose></frame>
    <model name="arm"><pose relative_to="top">0.2 0 0 0 0 0</pose><link name="rod">
      <pose>0 0 0.4 0 0 0</pose></link><frame name="end" attached_to="rod"/></model>
    <joint name="swing" type="revolute"><pose relative_to="top"/><parent>top</parent>
      <child>arm::rod</child><axis><xyz>0 1 0</xyz></axis></joint>
    <include><uri>model://gripper</uri><name>hand</name><placement_frame>flange</placement_frame>
      <pose relative_to="arm::end">0 0.5 0 0 0 0</pose></include>
    <include><uri>model://nowhere</uri></include>
    <joint name="hold" type="fixed"><parent>arm</parent><child>hand</child></joint>
    </model></world></sdf>)");
  const model::Robot& r = robot(id);
  const RobotModel m = model_of(id);
  ASSERT_EQ(m.dof(), 2U);
  EXPECT_EQ(m.joints[1].upper, 0.05);
  // The joint "swing" stands at (0, 0, 1), its axis is y of "top", turned by 90 degrees: -x.
  const std::vector<double> q{0.3, 0.02};
  const Pose rod = product(shift(0, 0, 1), rotation_z(std::numbers::pi / 2), rotation_y(0.3),
                           shift(0.2, 0, 0.4));
  expect_near(pose(id, "arm__rod", q), rod);
  const Pose palm = product(rod, shift(0, 0.5, 0), shift(0, 0, -0.1));
  expect_near(pose(id, "hand__palm", q), palm);
  expect_near(pose(id, "hand__finger", q), product(palm, shift(0.02, 0, 0.3)));
  EXPECT_NEAR(link(r, "hand__palm").given->mass, 2, 0);
  told("left out: \"floor\"");
  told("\"model://nowhere\" (line");
  told("<sensor> in <link>");
}

TEST_F(RobotFormats, SdfVersionsLoopsAndScrews) {
  // Before 1.5 axes are in the model's frame: the turned link's x axis is y there.
  const auto arm = [](const char* version) {
    return std::string("<sdf version=\"") + version + R"("><model name="m"><link name="a">
      <pose>0 0 0 0 0 1.5707963267948966</pose></link><joint name="j" type="revolute">
      <parent>world</parent><child>a</child><axis><xyz>1 0 0</xyz></axis></joint></model></sdf>)";
  };
  const double angle = 0.4, quarter = std::numbers::pi / 2;
  expect_near(pose(load(arm("1.4")), "a", {angle}),
              product(rotation_x(angle), rotation_z(quarter)));
  expect_near(pose(load(arm("1.6")), "a", {angle}),
              product(rotation_z(quarter), rotation_x(angle)));

  // A square of four links; the last joint's child carries its parent.
  const AnyId bars = load(R"(<sdf version="1.7"><model name="bars"><link name="g"/>
    <link name="a"><pose>0 0 0 0 0 0</pose></link><link name="b"><pose>0 0 1 0 0 0</pose></link>
    <link name="c"><pose>1 0 1 0 0 0</pose></link>
    <joint name="w" type="fixed"><parent>world</parent><child>g</child></joint>
    <joint name="j1" type="revolute"><parent>g</parent><child>a</child><axis><xyz>0 1 0</xyz></axis>
    </joint><joint name="j2" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 1 0
    </xyz></axis></joint><joint name="j3" type="revolute"><parent>b</parent><child>c</child><axis>
    <xyz>0 1 0</xyz></axis></joint><joint name="j4" type="revolute"><pose>1 0 0 0 0 0</pose>
    <parent>c</parent><child>g</child><axis><xyz>0 1 0</xyz></axis></joint></model></sdf>)");
  ASSERT_EQ(robot(bars).loops.size(), 1U);
  const model::LoopClosure& l = robot(bars).loops[0];
  EXPECT_EQ(l.kind, model::LoopKind::revolute);
  // At (1, 0, 0), which is 1 below c.
  EXPECT_NEAR(l.in_a.position[2], -1, 1e-15);
  EXPECT_NEAR(l.in_b.position[0], 1, 1e-15);

  // What cannot close a loop leaves it open.
  const AnyId open = load(R"(<sdf version="1.6"><model name="o"><link name="l"/>
    <joint name="turn" type="revolute"><parent>world</parent><child>l</child><axis><xyz>0 0 1</xyz>
    </axis></joint>
    <joint name="slide" type="prismatic"><parent>world</parent><child>l</child>
    <axis><xyz>0 0 1</xyz></axis></joint></model></sdf>)");
  EXPECT_TRUE(robot(open).loops.empty());
  told("Joint \"slide\" (line 4, <joint>) closes a loop");

  const AnyId screw = load(R"(<sdf version="1.10"><model name="s"><link name="nut"/>
    <joint name="lead" type="screw"><parent>world</parent><child>nut</child>
    <screw_thread_pitch>0.01</screw_thread_pitch><axis><xyz>0 0 1</xyz></axis></joint>
    </model></sdf>)");
  expect_near(pose(screw, "nut", {3}),
              product(rotation_z(3), shift(0, 0, 0.01 * 3 / (2 * std::numbers::pi))));

  const AnyId full = load(R"(<sdf version="1.11"><model name="f"><link name="l">
    <inertial auto="true"><density>500</density></inertial><collision name="c"><density>2000
    </density><pose>0 0 0.5 0 0 0</pose><geometry><box><size>0.1 0.2 0.3</size></box></geometry>
    </collision><collision name="d"><geometry><sphere><radius>0.1</radius></sphere></geometry>
    </collision></link></model></sdf>)");
  const double ball = 500 * 4 * std::numbers::pi * 1e-3 / 3;
  const MassProperties& mass = *robot(full).links[0].given;
  EXPECT_NEAR(mass.mass, 12 + ball, 1e-13);
  EXPECT_NEAR(mass.com[2], 12 * 0.5 / (12 + ball), 1e-14);
  EXPECT_EQ(robot(full).links[0].joint, model::JointKind::free);
}

// --- wrong files ---------------------------------------------------------------------------------

TEST_F(RobotFormats, EveryWrongFileIsOneSentenceWithFileAndLine) {
  file("loop.xml", "<mujocoinclude>\n<body><include file=\"loop.xml\"/></body></mujocoinclude>");
  file("cut.xml", "<mujocoinclude>\n<body name=\"a\">\n<geom");
  file("nan.xml", "<mujocoinclude>\n\n<body name=\"a\" pos=\"0 nan 0\"/></mujocoinclude>");
  file("own.sdf",
       "<sdf version=\"1.9\"><model name=\"x\">\n<include><uri>own.sdf</uri><name>y"
       "</name></include></model></sdf>");
  struct Case {
    const char* text;
    std::vector<const char*> told;
  };
  const std::string body = "<mujoco><worldbody><body name=\"a\"><joint name=\"j\"/>";
  const Case cases[] = {
      {"", {"line", "XML"}},
      {"<robot name=\"a\">\n<link name=\"b\"", {"line 2", "XML"}},
      {"<mujoco>\n<include file=\"no.xml\"/></mujoco>", {"line 2, <include>", "no.xml"}},
      {"<mujoco><worldbody><include file=\"loop.xml\"/></worldbody></mujoco>",
       {"file \"loop.xml\", line 2", "includes itself"}},
      {"<mujoco><worldbody><include file=\"cut.xml\"/></worldbody></mujoco>",
       {"file \"cut.xml\", line 3", "XML"}},
      {"<mujoco><worldbody><include file=\"nan.xml\"/></worldbody></mujoco>",
       {"file \"nan.xml\", line 3, <body>", "\"nan\" is not a number"}},
      {"<mujoco><worldbody>\n<body><joint class=\"k\"/></body></worldbody></mujoco>",
       {"line 2, <joint>", "class \"k\""}},
      {"<mujoco><worldbody><body><joint name=\"j\"/></body></worldbody><actuator>\n"
       "<motor joint=\"z\"/></actuator></mujoco>",
       {"line 2, <motor>", "joint \"z\""}},
      {"<mujoco><worldbody><body><joint/></body></worldbody><equality>\n<connect body1=\"z\" "
       "anchor=\"0 0 0\"/></equality></mujoco>",
       {"line 2, <connect>", "body \"z\""}},
      {"<mujoco><worldbody><body><joint/>\n<geom type=\"mesh\" mesh=\"m\"/></body></worldbody>"
       "</mujoco>",
       {"line 2, <geom>", "mesh \"m\""}},
      {"<mujoco><compiler eulerseq=\"xyw\"/></mujoco>", {"line 1, <compiler>", "Euler"}},
      {"<mujoco><worldbody>\n<body quat=\"0 0 0 0\"/></worldbody></mujoco>",
       {"line 2, <body>", "no length"}},
      {"<robot name=\"a\"><link name=\"a\"/><link name=\"b\"/>\n<joint name=\"j\" type=\"fixed\">"
       "<parent link=\"a\"/><child link=\"z\"/></joint></robot>",
       {"line 2, <joint>", "link \"z\""}},
      {"<robot name=\"a\"><link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"fixed\">"
       "<parent link=\"a\"/><child link=\"b\"/>\n<origin xyz=\"${x} 0 0\"/></joint></robot>",
       {"line 2, <origin>", "xacro"}},
      {"<sdf version=\"1.9\"><model name=\"m\"><link name=\"a\"/>\n<joint name=\"j\" "
       "type=\"revolute\"><parent>a</parent><child>z</child></joint></model></sdf>",
       {"line 2, <joint>", "\"z\""}},
      {"<sdf version=\"1.9\"><model name=\"m\"><link name=\"a\"/><include><uri>model://gone</uri>"
       "</include>\n<joint name=\"j\" type=\"fixed\"><parent>a</parent><child>gone::b</child>"
       "</joint></model></sdf>",
       {"line 2, <joint>", "Perhaps it is in model \"model://gone\""}},
      {"<sdf version=\"1.9\"><model name=\"m\"><include><uri>own.sdf</uri></include></model></sdf>",
       {"file \"own.sdf\", line 2", "includes itself"}},
      {"<sdf version=\"1.9\"><model name=\"m\"><link name=\"a\"><pose relative_to=\"f\"/></link>\n"
       "<frame name=\"f\"><pose relative_to=\"a\"/></frame></model></sdf>",
       {"<link>", "in a circle"}},
      {"<sdf version=\"1.9\"><model name=\"m\"><link name=\"a\"/>\n<model name=\"i\" "
       "placement_frame=\"no\"><link name=\"b\"/></model></model></sdf>",
       {"\"i::no\" is not a frame"}},
      {"<sdf version=\"1.9\"><model name=\"m\"><link name=\"a\"/><joint name=\"j\" "
       "type=\"screw\"><parent>world</parent><child>a</child>\n<axis><xyz>0 0 "
       "1</xyz></axis></joint>"
       "</model></sdf>",
       {"<joint>", "no pitch"}},
  };
  for (const Case& c : cases) {
    const std::string said = fault(c.text);
    EXPECT_FALSE(said.empty()) << c.text;
    for (const char* what : c.told)
      EXPECT_NE(said.find(what), std::string::npos) << what << " in: " << said << "\n" << c.text;
    EXPECT_EQ(said.find('\n'), std::string::npos);
  }
  // A mesh that is not there costs its shape only.
  load(
      "<robot name=\"a\"><link name=\"a\"/><link name=\"b\"><visual><geometry><mesh "
      "filename=\"package://p/none.stl\"/></geometry></visual></link><joint name=\"j\" "
      "type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/></joint></robot>");
  told("\"package://p/none.stl\" was not found");
}

}  // namespace
}  // namespace robomosp
