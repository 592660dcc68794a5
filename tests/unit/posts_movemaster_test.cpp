// SPDX-License-Identifier: Apache-2.0
// Movemaster RV-M1: positions read back as hands in the plane of the arm, limits, every construct.
#include "movemaster.h"
#include "posts_support.h"

namespace robomosp::posts_test {
namespace {

const post::Movemaster kMovemaster;

TEST(MovemasterPost, PositionsAreHandsInThePlaneOfTheArm) {
  // Hands of pitch p and roll r at points around the waist, made here by rotations.
  std::string irl = "PROGRAM prog;\nBEGIN\n";
  struct Hand {
    double x, y, z, pitch, roll;
  };
  std::vector<Hand> want;
  for (int i = 0; i < 60; ++i) {
    Hand h{};
    const double waist = -150 + 5 * i, away = 200 + 3 * i;
    h.x = std::round(away * std::cos(waist * kDeg) * 10) / 10;
    h.y = std::round(away * std::sin(waist * kDeg) * 10) / 10;
    h.z = 100 + i;
    h.pitch = -90 + i;
    h.roll = -85 + 2 * i;
    want.push_back(h);
    // The tool's z leans from the vertical by 90 - pitch, its y is across the plane at roll 0.
    const double w = std::atan2(h.y, h.x) / kDeg;
    const Q q = times(times(about(2, w), about(1, 90 - h.pitch)), about(2, h.roll));
    irl += "MOVE " + std::string(i % 2 ? "LIN" : "PTP") + " POSE(POSITION(" + post::fixed(h.x, 1) +
           ", " + post::fixed(h.y, 1) + ", " + post::fixed(h.z, 1) + "), ORIQUAT(" +
           post::fixed(q[0], 12) + ", " + post::fixed(q[1], 12) + ", " + post::fixed(q[2], 12) +
           ", " + post::fixed(q[3], 12) + "));\n";
  }
  const Posted p = posted(kMovemaster, irl + "ENDPROGRAM;\n");
  ASSERT_EQ(p.errors, 0) << p.faults;
  std::map<int, Numbers> positions;
  std::vector<std::pair<std::string, int>> moves;
  int line = 0;
  for (const std::string& l : lines_of(p.text())) {
    const Numbers n = numbers_in(l);
    if (l.starts_with("PD ")) {
      positions[static_cast<int>(n[0])] = n;
      continue;
    }
    EXPECT_EQ(static_cast<int>(n[0]), ++line) << l;
    if (has_text(l, " MO ") || has_text(l, " MS "))
      moves.emplace_back(l.substr(l.find('M'), 2), static_cast<int>(n[1]));
  }
  ASSERT_EQ(moves.size(), want.size());
  for (std::size_t i = 0; i < want.size(); ++i) {
    EXPECT_EQ(moves[i].first, i % 2 ? "MS" : "MO");
    const Numbers& n = positions.at(moves[i].second);
    EXPECT_NEAR(n[1], want[i].x, 0.051);
    EXPECT_NEAR(n[2], want[i].y, 0.051);
    EXPECT_NEAR(n[3], want[i].z, 0.051);
    EXPECT_NEAR(n[4], want[i].pitch, 0.051);
    EXPECT_NEAR(n[5], want[i].roll, 0.051);
  }
}

TEST(MovemasterPost, AHandOutOfThePlaneIsAnError) {
  const Posted p = posted(kMovemaster,
                          "PROGRAM prog;\nBEGIN\nMOVE PTP POSE(POSITION(300.0, 0.0, 200.0), "
                          "ORIXYZ(90.0, 0.0, 0.0));\nENDPROGRAM;\n");
  EXPECT_TRUE(has_text(p.faults, "error 3: the hand would tilt out of the plane of the arm by -90"))
      << p.faults;
}
TEST(MovemasterPost, LimitsAreTheControllers) {
  std::string irl = "PROGRAM prog;\nBEGIN\n";
  for (int i = 0; i < 700; ++i)
    irl += "MOVE PTP POSE(POSITION(" + std::to_string(200 + i) +
           ".0, 0.0, 200.0), ORIZYX(0.0, 180.0, 0.0));\n";
  const Posted p = posted(kMovemaster, irl + "ENDPROGRAM;\n");
  EXPECT_TRUE(has_text(p.faults, "has 700 positions, and the Movemaster allows 629")) << p.faults;
}
TEST(MovemasterPost, ThePageIsRight) { page_is_right(kMovemaster, "movemaster.md", {}); }
TEST(MovemasterPost, EveryConstructIsTextOrAnErrorAtItsLine) {
  every_construct(kMovemaster, {}, 15);
}
TEST(MovemasterPost, WrongInputIsSaid) { wrong_input(kMovemaster, {}); }

}  // namespace
}  // namespace robomosp::posts_test
