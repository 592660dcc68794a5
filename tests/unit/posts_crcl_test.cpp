// SPDX-License-Identifier: Apache-2.0
// The post for CRCL: well-formed, of NIST's schema where ROBOMOSP_CRCL_XSD names
// CRCLProgramInstance.xsd, and read again, command by command.
#include "support/post_run.h"

#include "crcl.h"

namespace robomosp::post_run {
namespace {

const post::crcl::Crcl kCrcl;

bool is_good(const std::string& text) {
  const char* schema = std::getenv("ROBOMOSP_CRCL_XSD");
  return is_xml(text, schema ? schema : "").value_or(true);
}
double value(const std::string& l) { return std::stod(l.substr(l.find('>') + 1)); }

/// Commands in order, each the lines between its marks.
std::vector<std::pair<std::string, std::vector<std::string>>> commands(const std::string& all) {
  std::vector<std::pair<std::string, std::vector<std::string>>> out;
  for (const std::string& raw : lines(all)) {
    const std::string l = raw.substr(std::min(raw.find_first_not_of(' '), raw.size()));
    if (l.starts_with("<MiddleCommand")) {
      const std::size_t a = l.find('"') + 1;
      out.emplace_back(l.substr(a, l.find('"', a) - a), std::vector<std::string>());
    } else if (!out.empty()) {
      out.back().second.push_back(l);
    }
  }
  return out;
}
std::vector<Read> read_crcl(const std::string& all) {
  std::vector<Read> out;
  double speed = -1;
  for (const auto& [type, body] : commands(all)) {
    if (type == "SetTransSpeedType")
      for (const std::string& l : body) {
        if (l.starts_with("<Setting>")) speed = value(l);
        if (l.starts_with("<Fraction>")) speed = value(l) * 100;
      }
    Read r;
    r.speed = speed;
    if (type == "MoveToType") {
      std::vector<double> n;
      for (const std::string& l : body) {
        if (l.size() > 2 && l[2] == '>' && std::string("XYZIJK").find(l[1]) != std::string::npos)
          n.push_back(value(l));
        if (l.starts_with("<MoveStraight>"))
          r.kind = l.find("true") != std::string::npos ? "lin" : "ptp";
      }
      EXPECT_EQ(n.size(), 9U);
      if (n.size() != 9) continue;
      r.numbers = {n[0], n[1], n[2]};
      // The second axis is the product of the third and the first.
      const double* x = &n[3];
      const double* z = &n[6];
      r.R = {x[0], z[1] * x[2] - z[2] * x[1], z[0], x[1], z[2] * x[0] - z[0] * x[2], z[1],
             x[2], z[0] * x[1] - z[1] * x[0], z[2]};
      out.push_back(r);
    } else if (type == "ActuateJointsType") {
      r.kind = "joints";
      for (const std::string& l : body)
        if (l.starts_with("<JointPosition>")) r.numbers.push_back(value(l));
      out.push_back(r);
    }
  }
  return out;
}

TEST(PostCrcl, WritesCommandsOfTheSchema) {
  Station s;
  PostSignal grip;
  grip.name = "grip";
  grip.kind = "gripper";
  s.signals = {grip};
  const Output o = run(kCrcl, R"(PROGRAM p;
SIGNAL OUTPUT BOOL: grip AT 3; OUTPUT INT: lamp AT 10, 4;
BEGIN
  MOVE PTP MAIN_JOINT(0.0, -90.0, 90.0, 0.0, 90.0, 0.0);
  MOVE LIN POSE(POSITION(550.0, -300.0, 200.0), ORIZYX(0.0, 180.0, 0.0)) SPEED := 80.0, C_CP := 2.0, ACC := 50.0;
  grip := TRUE;
  lamp := 5;
  WAIT 0.25 SEC;
  WRITELN('a < b & c ', 7);
ENDPROGRAM;)",
                       s);
  EXPECT_EQ(
      o.faults,
      "note 5: the motion ends at its target: an output, a wait, a text or a motion with UNTIL "
      "follows\n"
      "note 7: outputs are posted as robot parameters, which the robot interprets\n");
  EXPECT_TRUE(is_good(o.only())) << o.only();
  EXPECT_EQ(o.only(), R"(<?xml version="1.0" encoding="UTF-8"?>
<CRCLProgram xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
  <Name>prog</Name>
  <InitCanon>
    <CommandID>1</CommandID>
  </InitCanon>
  <MiddleCommand xsi:type="SetLengthUnitsType">
    <CommandID>2</CommandID>
    <UnitName>millimeter</UnitName>
  </MiddleCommand>
  <MiddleCommand xsi:type="SetAngleUnitsType">
    <CommandID>3</CommandID>
    <UnitName>degree</UnitName>
  </MiddleCommand>
  <MiddleCommand xsi:type="ActuateJointsType">
    <CommandID>4</CommandID>
    <ActuateJoint>
      <JointNumber>1</JointNumber>
      <JointPosition>0.0000</JointPosition>
      <JointDetails xsi:type="JointSpeedAccelType">
      </JointDetails>
    </ActuateJoint>
    <ActuateJoint>
      <JointNumber>2</JointNumber>
      <JointPosition>-90.0000</JointPosition>
      <JointDetails xsi:type="JointSpeedAccelType">
      </JointDetails>
    </ActuateJoint>
    <ActuateJoint>
      <JointNumber>3</JointNumber>
      <JointPosition>90.0000</JointPosition>
      <JointDetails xsi:type="JointSpeedAccelType">
      </JointDetails>
    </ActuateJoint>
    <ActuateJoint>
      <JointNumber>4</JointNumber>
      <JointPosition>0.0000</JointPosition>
      <JointDetails xsi:type="JointSpeedAccelType">
      </JointDetails>
    </ActuateJoint>
    <ActuateJoint>
      <JointNumber>5</JointNumber>
      <JointPosition>90.0000</JointPosition>
      <JointDetails xsi:type="JointSpeedAccelType">
      </JointDetails>
    </ActuateJoint>
    <ActuateJoint>
      <JointNumber>6</JointNumber>
      <JointPosition>0.0000</JointPosition>
      <JointDetails xsi:type="JointSpeedAccelType">
      </JointDetails>
    </ActuateJoint>
  </MiddleCommand>
  <MiddleCommand xsi:type="SetTransSpeedType">
    <CommandID>5</CommandID>
    <TransSpeed xsi:type="TransSpeedAbsoluteType">
      <Setting>80.000</Setting>
    </TransSpeed>
  </MiddleCommand>
  <MiddleCommand xsi:type="SetRotSpeedType">
    <CommandID>6</CommandID>
    <RotSpeed xsi:type="RotSpeedAbsoluteType">
      <Setting>90.000</Setting>
    </RotSpeed>
  </MiddleCommand>
  <MiddleCommand xsi:type="SetTransAccelType">
    <CommandID>7</CommandID>
    <TransAccel xsi:type="TransAccelRelativeType">
      <Fraction>0.500000</Fraction>
    </TransAccel>
  </MiddleCommand>
  <MiddleCommand xsi:type="SetEndPoseToleranceType">
    <CommandID>8</CommandID>
    <Tolerance>
      <XPointTolerance>0.100</XPointTolerance>
      <YPointTolerance>0.100</YPointTolerance>
      <ZPointTolerance>0.100</ZPointTolerance>
    </Tolerance>
  </MiddleCommand>
  <MiddleCommand xsi:type="MoveToType">
    <CommandID>9</CommandID>
    <MoveStraight>true</MoveStraight>
    <EndPosition>
      <Point>
        <X>550.000</X>
        <Y>-300.000</Y>
        <Z>200.000</Z>
      </Point>
      <XAxis>
        <I>-1.000000000</I>
        <J>0.000000000</J>
        <K>0.000000000</K>
      </XAxis>
      <ZAxis>
        <I>0.000000000</I>
        <J>0.000000000</J>
        <K>-1.000000000</K>
      </ZAxis>
    </EndPosition>
  </MiddleCommand>
  <MiddleCommand xsi:type="SetEndEffectorType">
    <CommandID>10</CommandID>
    <Setting>1.0</Setting>
  </MiddleCommand>
  <MiddleCommand xsi:type="SetRobotParametersType">
    <CommandID>11</CommandID>
    <ParameterSetting>
      <ParameterName>output 10</ParameterName>
      <ParameterValue>5</ParameterValue>
    </ParameterSetting>
  </MiddleCommand>
  <MiddleCommand xsi:type="DwellType">
    <CommandID>12</CommandID>
    <DwellTime>0.250000</DwellTime>
  </MiddleCommand>
  <MiddleCommand xsi:type="MessageType">
    <CommandID>13</CommandID>
    <Message>a &lt; b &amp; c 7</Message>
  </MiddleCommand>
  <EndCanon>
    <CommandID>14</CommandID>
  </EndCanon>
</CRCLProgram>
)");
}
TEST(PostCrcl, MotionsAreReadAgain) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Motions m = straight_program(150, seed, false, false);
    const Output o = run(kCrcl, m.source);
    EXPECT_EQ(o.faults, "");
    EXPECT_TRUE(is_good(o.only()));
    expect_same(read_crcl(o.only()), m.meant);
  }
  const Output o = run(kCrcl,
                       "PROGRAM p; BEGIN MOVE PTP MAIN_JOINT(1.0, -2.5, 3.0, 4.0, 5.0, 6.0) "
                       "SPEED_PTP := 50.0; ENDPROGRAM;");
  EXPECT_EQ(
      o.faults,
      "warning 1: SPEED_PTP is left to the robot, since its joint speed limits are unknown\n");
  const auto read = read_crcl(o.only());
  ASSERT_EQ(read.size(), 1U);
  EXPECT_EQ(read[0].numbers, (std::vector<double>{1, -2.5, 3, 4, 5, 6}));
}
TEST(PostCrcl, FramesAreMultipliedIn) {
  const Output o =
      run(kCrcl,
          "PROGRAM p; BEGIN MOVE LIN POSE(POSITION(10.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0)) "
          "FRAME := POSE(POSITION(100.0, 0.0, 0.0), ORIZYX(90.0, 0.0, 0.0)); ENDPROGRAM;");
  const auto read = read_crcl(o.only());
  ASSERT_EQ(read.size(), 1U);
  EXPECT_NEAR(read[0].numbers[0], 100, 1e-9);
  EXPECT_NEAR(read[0].numbers[1], 10, 1e-9);
  EXPECT_LT(between(read[0].R, about(2, 90)), 1e-6);
}
TEST(PostCrcl, WhatItHasNoneOfIsRefused) {
  const std::string refused = table(kCrcl);
  // The few statements of a straight program that it says.
  for (const char* s :
       {"grip := TRUE;", "lamp := 5;", "amps := 2.5;", "WAIT 0.5 SEC;", "HALT;", "WRITELN();",
        "MOVE PTP " RMP_A ";", "MOVE LIN " RMP_A " SPEED := 80.0, C_CP := 5.0;"})
    EXPECT_EQ(refused.find(std::string(s) + "\n"), std::string::npos) << s;
  for (const char* s : {"i := 1;", "WHILE i < 3 DO i := i + 1; ENDWHILE;", "WAIT FOR ready;",
                        "b := ready;", "MOVE LIN " RMP_A " UNTIL ready;", "done();", "START side;",
                        "MOVE CIRCLE " RMP_A ", " RMP_B ";"})
    EXPECT_NE(refused.find(std::string(s) + "\n"), std::string::npos) << s;
}
TEST(PostCrcl, WrongInputIsSaid) { expect_sane(kCrcl); }
TEST(PostCrcl, TimeGrowsWithTheProgram) { expect_linear(kCrcl, false, true); }

}  // namespace
}  // namespace robomosp::post_run
