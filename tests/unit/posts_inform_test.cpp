// SPDX-License-Identifier: Apache-2.0
// INFORM: pulses and BASE positions read back, every construct, wrong input.
#include "inform.h"
#include "posts_support.h"

namespace robomosp::posts_test {
namespace {

const post::Inform kInform;

struct Axes {
  std::vector<PostAxis> axes;
  Axes() {
    static constexpr const char* kNames[] = {"S", "L", "U", "R", "B", "T"};
    for (int i = 0; i < 6; ++i) {
      PostAxis a;
      a.name = kNames[i];
      a.joint = i;
      a.sign = i == 2 ? -1 : 1;
      a.offset = i == 1 ? 90 : 0;
      a.pulses = 1000.5 + 100 * i;
      axes.push_back(a);
    }
  }
};

std::vector<Seen> read_inform(const std::string& text, const std::vector<PostAxis>& axes) {
  std::vector<Seen> out;
  std::map<std::string, Seen> points;
  bool pulses = false;
  int moves = 0;
  for (std::string l : lines_of(text)) {
    EXPECT_TRUE(l.ends_with('\r')) << l;
    l.pop_back();
    if (l.starts_with("///POSTYPE")) pulses = l == "///POSTYPE PULSE";
    Seen s;
    if (l[0] == 'C' && l.size() > 7 && l[6] == '=') {
      const Numbers n = numbers_in(l.substr(6));
      if (pulses)
        for (std::size_t i = 0; i < 6; ++i)
          s.joints.push_back((n[i] / axes[i].pulses - axes[i].offset) / axes[i].sign);
      else set_pose(s, n, 0, 1, rpy(n[3], n[4], n[5]));
      points[l.substr(0, 6)] = s;
    } else if (l.starts_with("MOV")) {
      const Seen p = points.at(l.substr(5, 6));
      s = p;
      s.value = numbers_in(l.substr(l.find('=')))[0];
      if (l[3] == 'C') {
        // The first of three is where the robot is.
        if (++moves % 3 == 1) continue;
        s.what = moves % 3 == 2 ? "via" : "circle";
      } else {
        s.what = l[3] == 'L' ? "lin" : s.joints.empty() ? "ptp" : "ptp joints";
      }
      out.push_back(s);
    } else if (l.starts_with("DOUT OT#(")) {
      s.what = "out";
      s.number = static_cast<int>(numbers_in(l)[0]);
      s.value = l.ends_with("ON");
      out.push_back(s);
    } else if (l.starts_with("TIMER T=")) {
      s.what = "wait";
      s.value = numbers_in(l)[0];
      out.push_back(s);
    }
  }
  return out;
}

TEST(InformPost, WhatIsReadFromTheTextIsWhatTheProgramSays) {
  const Axes axes;
  PostOption base;
  base.name = "postype";
  base.value = "BASE";
  for (unsigned seed = 1; seed < 6; ++seed) {
    const Straight s = straight(200, seed);
    How how;
    how.robot = true;
    how.form = kPostFlat;
    how.profile.axes = axes.axes;
    how.profile.options = {&base, 1};
    const Posted p = posted(kInform, s.irl, how);
    ASSERT_EQ(p.errors, 0) << p.faults;
    same(s.seen, read_inform(p.text(), axes.axes));
  }
}

TEST(InformPost, PulsesAreThoseOfTheTargetsJoints) {
  const Axes axes;
  const Straight s = straight(100, 7);
  How how;
  how.robot = true;
  how.profile.axes = axes.axes;
  const Posted p = posted(kInform, s.irl, how);
  ASSERT_EQ(p.errors, 0) << p.faults;
  EXPECT_FALSE(has_text(p.text(), "BASE"));
  const auto got = read_inform(p.text(), axes.axes);
  ASSERT_EQ(got.size(), s.seen.size());
  const PlainKinematics k;
  for (std::size_t i = 0; i < got.size(); ++i) {
    if (got[i].joints.empty()) continue;
    Numbers q = got[i].joints;
    for (double& v : q) v *= kDeg;
    const Pose at = *k.forward(q);
    const Seen& want = s.seen[i];
    if (!want.joints.empty()) continue;
    // A pulse is a thousandth of a degree here, which is 0.02 mm of the test's robot.
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(at.p[c] * 1000, want.mm[c], 0.02) << i;
    for (std::size_t c = 0; c < 9; ++c) EXPECT_NEAR(at.R[c], want.R[c], 1.7e-4) << i;
  }
}

TEST(InformPost, AnalogueOutputsAreVoltsWithinWhatTheControllerHas) {
  const auto with = [](const std::string& number, const std::string& volts) {
    How how;
    how.form = kPostFlat;
    return posted(kInform,
                  "PROGRAM prog;\nSIGNAL OUTPUT REAL: v AT " + number + ";\nBEGIN\nv := " + volts +
                      ";\nENDPROGRAM;\n",
                  how);
  };
  for (const auto& [volts, written] : {std::pair{"2.5", "2.50"}, std::pair{"-14.0", "-14.00"},
                                       std::pair{"0.0", "0.00"}, std::pair{"14.0", "14.00"}}) {
    const Posted p = with("3", volts);
    EXPECT_EQ(p.errors, 0) << p.faults;
    EXPECT_TRUE(has_text(p.text(), std::string("\r\nAOUT AO#(3) ") + written + "\r\n")) << p.text();
  }
  EXPECT_TRUE(has_text(with("3", "14.01").faults, "error 4: an analogue output of 14.01 V"));
  EXPECT_TRUE(has_text(with("3", "-1.0E300").faults, "error 4: an analogue output of "));
  EXPECT_TRUE(
      has_text(with("41", "1.0").faults, "error 4: signal 41 is not one of the analogue signals"));
  EXPECT_EQ(with("40", "1.0").errors, 0);
  EXPECT_TRUE(
      has_text(with("0", "1.0").faults, "error 4: signal 0 is not one of the analogue signals"));
}

TEST(InformPost, ThePageIsRight) {
  How how;
  how.robot = true;
  page_is_right(kInform, "inform.md", how);
}
TEST(InformPost, EveryConstructIsTextOrAnErrorAtItsLine) {
  const Axes axes;
  How how;
  how.robot = true;
  how.profile.axes = axes.axes;
  every_construct(kInform, how, 25);
}
TEST(InformPost, WrongInputIsSaid) {
  wrong_input(kInform, {});
  How how;
  PostOption pulse;
  pulse.name = "postype";
  pulse.value = "PULSE";
  how.profile.options = {&pulse, 1};
  how.robot = true;
  const Posted p = posted(kInform, weld(), how);
  EXPECT_TRUE(has_text(p.faults, "the profile has no pulses for each axis of the robot"))
      << p.faults;
  EXPECT_TRUE(has_text(p.faults, "error 9:")) << p.faults;
}
TEST(InformPost, TimeGrowsWithTheProgram) {
  const Axes axes;
  How how;
  how.robot = true;
  how.profile.axes = axes.axes;
  is_linear(kInform, how);
}

}  // namespace
}  // namespace robomosp::posts_test
